//! The cost of a cut, and the cost of cuttable bodies. Sheets of 10K and 1M nodes are cut across equally many
//! triangles, blocks of 40K and 1.1M tetrahedra across equally many elements, with cold caches.
//!
//! `cargo bench --bench cutting` writes `target/report/cutting.md`. Times are wall times, the median of all cuts.
#![allow(clippy::print_stderr)]

use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use glam::{Vec2, Vec3, vec2};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, BodyId, Material, Model, Solver, Storage, Tearing, Values, World, WorldDefinition};

/// Cells along a side of the small and the large sheet.
const SIDES: [usize; 2] = [99, 999];

/// Cells along a side of the small and the large block.
const BLOCKS: [u32; 2] = [20, 60];

const CUTS: usize = 40;

/// The largest allowed ratio of the same cut's times on the large and the small sheet.
const MAX_RATIO: f64 = 3.0;

/// Larger than any cache.
const FLUSH_BYTES: usize = 128 << 20;

const CELL: f32 = 0.01;

fn main() -> ExitCode {
    let mut report = String::from(
        "# Cutting\n\nA cut across a sheet, from detection to the change list, caches cold: median, and nine of ten below.\n\n\
         | springs in | nodes | triangles met | a cut, ms | 90 %, ms | on the large sheet over on the small |\n|---|---|---|---|---|---|\n",
    );
    let mut missed = 0;
    for storage in [
        Storage::Packed,
        Storage::Efficient,
        Storage::FastLink,
        Storage::DynamicBulk,
    ] {
        let mut small = f64::NAN;
        for side in SIDES {
            let (mut world, body) = sheet(side, storage, 100_000);
            let (triangles, times) = cuts(&mut world, body, side);
            let (median, most) = (times[times.len() / 2], times[times.len() * 9 / 10]);
            let ratio = median / small;
            let ratio_text = if small.is_nan() {
                String::new()
            } else {
                format!("{ratio:.2}")
            };
            small = if small.is_nan() { median } else { small };
            missed += usize::from(ratio > MAX_RATIO);
            let line = format!(
                "| {storage:?} | {} | {triangles} | {:.3} | {:.3} | {ratio_text} |",
                (side + 1) * (side + 1),
                1e3 * median,
                1e3 * most
            );
            eprintln!("{line}");
            let _ = writeln!(report, "{line}");
        }
    }
    report.push_str(
        "\nA cut 4 cells deep and long into a block of tetrahedra:\n\n\
         | made of | solver | tetrahedra | faces opened | a cut, ms | 90 %, ms | on the large block over on the small |\n|---|---|---|---|---|---|---|\n",
    );
    for (has_elements, solver) in [
        (false, Solver::Verlet),
        (true, Solver::Verlet),
        (true, Solver::Implicit),
    ] {
        let mut small = f64::NAN;
        for side in BLOCKS {
            let (mut world, body) = block(side, has_elements, solver);
            let (faces, times) = block_cuts(&mut world, body, side);
            let (median, most) = (times[times.len() / 2], times[times.len() * 9 / 10]);
            let ratio = median / small;
            let ratio_text = if small.is_nan() {
                String::new()
            } else {
                format!("{ratio:.2}")
            };
            small = if small.is_nan() { median } else { small };
            missed += usize::from(ratio > MAX_RATIO);
            let line = format!(
                "| {} | {solver:?} | {} | {faces} | {:.3} | {:.3} | {ratio_text} |",
                if has_elements { "elements" } else { "springs" },
                5 * side * side * side,
                1e3 * median,
                1e3 * most
            );
            eprintln!("{line}");
            let _ = writeln!(report, "{line}");
        }
    }
    report.push_str(
        "\nTime of a VERLET step of an uncut cuttable sheet of 10K nodes over that of a sheet that is not cuttable: ",
    );
    let [cut, tears] = cuttable_cost();
    let _ = writeln!(report, "{cut:.3}");
    report.push_str("\nTime of a tearable sheet without tears over that of a cuttable sheet: ");
    let _ = writeln!(report, "{tears:.3}");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("report");
    let path = folder.join("cutting.md");
    if let Err(error) = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, &report)) {
        eprintln!("{}: {error}", path.display());
        return ExitCode::FAILURE;
    }
    eprintln!("{}: {missed} targets missed", path.display());
    if missed == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn sheet(side: usize, storage: Storage, spare_nodes: u32) -> (World, BodyId) {
    torn_sheet(side, storage, spare_nodes, Tearing::default())
}

fn torn_sheet(side: usize, storage: Storage, spare_nodes: u32, tearing: Tearing) -> (World, BodyId) {
    let count = side + 1;
    let at = |x: usize, y: usize| (y * count + x) as u32;
    let positions: Vec<Vec3> = (0..count * count)
        .map(|node| CELL * vec2((node % count) as f32, (node / count) as f32).extend(0.0))
        .collect();
    let mut triangles = Vec::new();
    for y in 0..side {
        for x in 0..side {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            triangles.extend(if (x + y) % 2 == 0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            });
        }
    }
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let definition = BodyDefinition {
        positions: &positions,
        masses: Values::Uniform(1e-4),
        triangles: &triangles,
        stiffnesses: Values::Uniform(50.0),
        springs_per_node: if storage == Storage::FastLink { 16 } else { 0 },
        spare_nodes,
        tearing,
        solver: Solver::Verlet,
        storage,
        ..Default::default()
    };
    let body = world.create_body(&definition).expect("a body");
    world.step(1e-3).expect("a step");
    (world, body)
}

/// Makes cuts of equal length all over a sheet. Returns the mean number of new triangles, and the sorted times [s].
fn cuts(world: &mut World, body: BodyId, side: usize) -> (usize, Vec<f64>) {
    let mut flushed = vec![1_u8; FLUSH_BYTES];
    let mut times = Vec::new();
    let mut triangles = 0;
    for cut in 0..CUTS {
        // In rows and columns, so that no two cuts intersect, each with another direction.
        let position = vec2((cut % 8) as f32 + 0.5, (cut / 8) as f32 + 0.5) / vec2(8.0, 5.0);
        let middle = CELL * side as f32 * position;
        let path = 5.3 * CELL * Vec2::from_angle(0.7 * cut as f32);
        let blade = |at: Vec2| [-0.1, 0.1].map(|z| at.extend(z));
        let lowest = world.body(body).expect("a body").positions()[0].z;
        let shift = |edge: [Vec3; 2]| edge.map(|end| end + Vec3::Z * lowest);
        let sweep = Sweep {
            start: shift(blade(middle - 0.5 * path)),
            end: shift(blade(middle + 0.5 * path)),
        };
        flushed.iter_mut().for_each(|byte| *byte = byte.wrapping_add(1));
        std::hint::black_box(&flushed);
        let start = Instant::now();
        let report = world.cut(body, &sweep).expect("a cut");
        times.push(start.elapsed().as_secs_f64());
        assert!(report.length > 0.03);
        triangles += report.new_triangles as usize;
    }
    times.sort_by(f64::total_cmp);
    (triangles / CUTS, times)
}

/// A free block of cubes of five tetrahedra each.
fn block(side: u32, has_elements: bool, solver: Solver) -> (World, BodyId) {
    let mesh = Mesh::block([CELL * side as f32; 3], [side; 3]).expect("a mesh");
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..Default::default()
    })
    .expect("a world");
    let definition = BodyDefinition {
        masses: Values::Uniform(1e-3),
        spare_nodes: 20_000,
        solver,
        ..BodyDefinition::of(&mesh)
    };
    let material = Material {
        model: Model::Tetrahedra,
        young_modulus: 3000.0,
        poisson_ratio: 0.3,
        ..Default::default()
    };
    let definition = if has_elements {
        BodyDefinition {
            material: Some(material),
            ..definition
        }
    } else {
        BodyDefinition {
            stiffnesses: Values::Uniform(20.0),
            ..definition
        }
    };
    let body = world.create_body(&definition).expect("a body");
    world.step(1e-3).expect("a step");
    (world, body)
}

/// Makes cuts of equal depth and length into a side of a block. Returns the mean number of opened faces, and the sorted
/// times [s].
fn block_cuts(world: &mut World, body: BodyId, side: u32) -> (usize, Vec<f64>) {
    let mut flushed = vec![1_u8; FLUSH_BYTES];
    let mut times = Vec::new();
    let mut area = 0.0;
    let low = world.body(body).expect("a body").positions()[0];
    for cut in 0..12 {
        let position = vec2((cut % 4) as f32 + 0.5, (cut / 4) as f32 + 0.5) / vec2(4.0, 3.0);
        let middle = CELL * side as f32 * position;
        let path = 4.0 * CELL * Vec2::from_angle(0.7 * cut as f32);
        let blade = |at: Vec2| [-0.5, 4.2].map(|depth| low + at.extend(CELL * depth));
        let sweep = Sweep {
            start: blade(middle - 0.5 * path),
            end: blade(middle + 0.5 * path),
        };
        flushed.iter_mut().for_each(|byte| *byte = byte.wrapping_add(1));
        std::hint::black_box(&flushed);
        let start = Instant::now();
        let report = world.cut(body, &sweep).expect("a cut");
        times.push(start.elapsed().as_secs_f64());
        area += report.area;
    }
    times.sort_by(f64::total_cmp);
    // A face has about half the area of a cell's side.
    ((area / 12.0 / f64::from(0.5 * CELL * CELL)) as usize, times)
}

/// The time of a step of a cuttable body over that of a plain one, and of a tearable body over that of a cuttable one.
fn cuttable_cost() -> [f64; 2] {
    let tearing = Tearing {
        strain: 10.0,
        most_per_step: 1,
        ..Tearing::default()
    };
    let side = SIDES[0];
    let mut worlds = [(0, Tearing::default()), (10_000, Tearing::default()), (10_000, tearing)]
        .map(|(spare, tearing)| torn_sheet(side, Storage::Packed, spare, tearing).0);
    let mut least = [f64::INFINITY; 3];
    for _ in 0..200 {
        for (world, least) in worlds.iter_mut().zip(&mut least) {
            let start = Instant::now();
            world.step(1e-3).expect("a step");
            *least = least.min(start.elapsed().as_secs_f64());
        }
    }
    [least[1] / least[0], least[2] / least[1]]
}
