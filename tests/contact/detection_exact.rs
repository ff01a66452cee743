//! Exact tests of points and edges against closed surfaces.

use crate::support::random::Random;
use crate::support::solid::real;
use glam::{Quat, Vec3};
use sinew::detection::exact::{Exact, Overlap};
use sinew::mesh::{ClosedSurface, Mesh};

/// Half the extent of the box, which reaches from -0.04 to 0.04 m along each axis.
const HALF: f32 = 0.04;

fn cube() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mesh = Mesh::lattice(0.02, [4; 3]).expect("a lattice");
    let surface = mesh.surface().expect("a surface");
    let bounds = |pick: fn(Vec3, Vec3) -> Vec3| mesh.positions.iter().copied().reduce(pick).expect("nodes");
    let centre = (bounds(Vec3::min) + bounds(Vec3::max)) * 0.5;
    (
        mesh.positions.iter().map(|position| *position - centre).collect(),
        surface,
    )
}

fn moved((positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>), by: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    (positions.iter().map(|position| *position + by).collect(), triangles)
}

fn both(first: (Vec<Vec3>, Vec<[u32; 3]>), second: (Vec<Vec3>, Vec<[u32; 3]>)) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = first;
    let count = positions.len() as u32;
    positions.extend(second.0);
    triangles.extend(second.1.iter().map(|nodes| nodes.map(|node| node + count)));
    (positions, triangles)
}

fn turned((positions, mut triangles): (Vec<Vec3>, Vec<[u32; 3]>)) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    for triangle in &mut triangles {
        triangle.swap(1, 2);
    }
    (positions, triangles)
}

/// Returns a generator of pseudo-random numbers from -1 to 1.
fn numbers(mut seed: u64) -> impl FnMut() -> f32 {
    move || {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1 << 23) as f32 - 1.0
    }
}

fn refusal((positions, triangles): &(Vec<Vec3>, Vec<[u32; 3]>)) -> String {
    ClosedSurface::new(positions, triangles)
        .expect_err("refused")
        .to_string()
}

#[test]
fn surfaces_that_bound_no_solid_are_refused() {
    let solid = cube();
    assert!(ClosedSurface::new(&solid.0, &solid.1).is_ok());
    assert!(refusal(&(solid.0.clone(), Vec::new())).contains("no triangles"));
    let mut broken = solid.clone();
    broken.1[7][2] = 4_000;
    assert!(refusal(&broken).contains("triangle 7 names node 4000"));
    let mut broken = solid.clone();
    broken.0[3].y = f32::NAN;
    assert!(refusal(&broken).contains("the position of node 3"));
    let mut broken = solid.clone();
    broken.0[3].y = 2e9;
    assert!(refusal(&broken).contains("the position of node 3"));
    let mut broken = solid.clone();
    broken.1[5][1] = broken.1[5][0];
    assert!(refusal(&broken).contains("triangle 5 has no area"));
    let mut broken = solid.clone();
    let [a, b, c] = broken.1.remove(11);
    let message = refusal(&broken);
    assert!(message.contains("not closed"), "{message}");
    assert!(
        [a, b, c]
            .iter()
            .filter(|node| message.contains(&format!("node {node}")))
            .count()
            >= 2,
        "{message}"
    );
    let mut broken = solid.clone();
    broken.1[11].swap(0, 1);
    assert!(refusal(&broken).contains("not closed"));
    assert!(refusal(&turned(solid.clone())).contains("face inward"));
    // A triangle and its reverse enclose nothing.
    let sheet = (solid.0[..3].to_vec(), vec![[0, 1, 2], [0, 2, 1]]);
    assert!(!refusal(&sheet).is_empty());
    let crossed = both(solid.clone(), moved(solid.clone(), Vec3::new(0.031, 0.027, 0.013)));
    assert!(refusal(&crossed).contains("pass through each other"));
    let apart = Vec3::X * 0.2;
    let flipped_apart = both(both(solid.clone(), solid.clone()), turned(moved(solid.clone(), apart)));
    assert!(!refusal(&flipped_apart).is_empty());
    let half: Vec<Vec3> = solid.0.iter().map(|position| *position * 0.5).collect();
    let within = both(solid.clone(), (half.clone(), solid.1.clone()));
    assert!(refusal(&within).contains("lies within another part"));
    let larger: Vec<Vec3> = solid.0.iter().map(|position| *position * 2.0).collect();
    let flipped_second = both((larger, solid.1.clone()), turned(moved(solid.clone(), Vec3::X)));
    assert!(refusal(&flipped_second).contains("inside out"));
}

#[test]
fn solids_of_several_parts_are_accepted() {
    let solid = cube();
    let volume = f64::from(2.0 * HALF).powi(3);
    let half = (
        solid.0.iter().map(|position| *position * 0.5).collect(),
        solid.1.clone(),
    );
    let hollow = both(solid.clone(), turned(half));
    let surface = ClosedSurface::new(&hollow.0, &hollow.1).expect("a hollow cube");
    assert!((surface.volume() / volume - 0.875).abs() < 1e-6);
    let exact = Exact::new(&surface).expect("a solid");
    assert!(!exact.is_inside(Vec3::ZERO) && exact.is_inside(Vec3::X * 0.03) && !exact.is_inside(Vec3::X * 0.05));
    // Two cubes that touch along an edge, which four triangles share.
    let touching = both(
        solid.clone(),
        moved(solid.clone(), Vec3::new(2.0 * HALF, 2.0 * HALF, 0.0)),
    );
    let surface = ClosedSurface::new(&touching.0, &touching.1).expect("two cubes");
    assert!((surface.volume() / volume - 2.0).abs() < 1e-6);
    // Each triangle has its own corners, as in STL files.
    let corners: Vec<Vec3> = solid.1.iter().flatten().map(|&node| solid.0[node as usize]).collect();
    let separate: Vec<[u32; 3]> = (0..solid.1.len() as u32)
        .map(|index| [0, 1, 2].map(|corner| 3 * index + corner))
        .collect();
    let surface = ClosedSurface::new(&corners, &separate).expect("a cube");
    assert!((surface.volume() / volume - 1.0).abs() < 1e-6);
}

#[test]
fn real_meshes() {
    for (name, scale) in [
        ("stomach.stl", 1e-3),
        ("forceps_jaw_left.stl", 1e-3),
        // With other rounding, rows of flat triangles contain triangles that lie exactly on a line.
        ("forceps_jaw_left.stl", 1.0),
        ("liver_collision.stl", 1e-3),
    ] {
        let Some(mut mesh) = real(name, scale) else {
            continue;
        };
        let volume = mesh.volume().expect("a volume");
        let surface = ClosedSurface::new(&mesh.positions, &mesh.triangles).expect(name);
        assert!(
            (surface.volume() / volume - 1.0).abs() < 1e-5,
            "{name}: {} for {volume}",
            surface.volume()
        );
        mesh.triangles.swap_remove(17);
        let message = refusal(&(mesh.positions, mesh.triangles));
        assert!(message.contains("not closed"), "{name}: {message}");
    }
}

/// Fills the gap between a straight row of nodes and the line from its first to its last node with triangles of zero
/// area, in random order.
fn close_gap(triangles: &mut Vec<[u32; 3]>, row: &[u32], random: &mut Random) {
    if let [first, .., last] = row
        && row.len() > 2
    {
        let between = 1 + random.below(row.len() - 2);
        triangles.push([*first, *last, row[between]]);
        close_gap(triangles, &row[..=between], random);
        close_gap(triangles, &row[between..], random);
    }
}

#[test]
fn rows_of_flat_triangles_split_their_neighbors() {
    let mut random = Random(7);
    for case in 0..200 {
        let turned = Quat::from_scaled_axis(random.point(-3.0, 3.0));
        let (size, shift) = (10_f32.powf(random.between(-3.0, 3.0)), random.point(-2.0, 2.0));
        let at = |position: Vec3| size * (turned * position + shift);
        // A tetrahedron with nodes along one of its edges, which the face on one side does not contain.
        let between = 1 + random.below(30);
        let mut parts: Vec<f32> = (0..between).map(|_| random.between(0.01, 0.99)).collect();
        parts.sort_unstable_by(f32::total_cmp);
        let mut positions = vec![Vec3::Z, Vec3::Y, Vec3::ZERO];
        positions.extend(parts.iter().map(|&part| Vec3::X * part));
        positions.push(Vec3::X);
        let row: Vec<u32> = (2..positions.len() as u32).collect();
        let last = positions.len() as u32 - 1;
        let mut triangles = vec![[0, 1, 2], [0, last, 1], [0, 2, last]];
        triangles.extend(row.windows(2).map(|ends| [1, ends[1], ends[0]]));
        let open_count = triangles.len();
        close_gap(
            &mut triangles,
            &row.iter().rev().copied().collect::<Vec<_>>(),
            &mut random,
        );
        assert_eq!(triangles.len(), open_count + between);
        let positions: Vec<Vec3> = positions.into_iter().map(at).collect();
        let surface = ClosedSurface::new(&positions, &triangles).unwrap_or_else(|error| panic!("{case}: {error}"));
        let volume = f64::from(size).powi(3) / 6.0;
        assert!(
            (surface.volume() / volume - 1.0).abs() < 1e-5,
            "{case}: {} of {volume}",
            surface.volume()
        );
        assert_eq!(surface.triangles().len(), triangles.len());
        for nodes in surface.triangles() {
            let [a, b, c] = nodes.map(|node| surface.positions()[node as usize].as_dvec3());
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            let height = (b - a).cross(c - a).length() / longest;
            assert!(
                height > 1e-6 * longest,
                "{case}: {nodes:?} is {height} high of {longest}"
            );
        }
    }
}

/// Returns the fractions of a segment between which it lies within the box.
fn clipped(from: Vec3, to: Vec3) -> Option<(f64, f64)> {
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        let (start, delta) = (f64::from(from[axis]), f64::from(to[axis]) - f64::from(from[axis]));
        let [a, b] = [-HALF, HALF].map(|side| (f64::from(side) - start) / delta);
        enters = enters.max(a.min(b));
        leaves = leaves.min(a.max(b));
    }
    (leaves > enters).then_some((enters, leaves))
}

#[test]
fn points_and_edges_within_a_box() {
    let (positions, triangles) = cube();
    let surface = ClosedSurface::new(&positions, &triangles).expect("a cube");
    let (shift, turn) = (Vec3::new(0.3, -0.2, 0.1), Quat::from_rotation_y(0.7));
    let rigid = Exact::new(&surface).expect("a solid");
    let mut deformed = Exact::changing(&surface).expect("a solid");
    let moved_positions: Vec<Vec3> = positions.iter().map(|position| turn * *position + shift).collect();
    deformed.refit(&moved_positions).expect("other places");
    let mut number = numbers(3);
    let points: Vec<Vec3> = (0..2000)
        .map(|_| Vec3::new(number(), number(), number()) * 0.08)
        .collect();
    let edges: Vec<[u32; 2]> = (0..1999).map(|point| [point, point + 1]).collect();
    let moved_points: Vec<Vec3> = points.iter().map(|position| turn * *position + shift).collect();
    let mut overlap = Overlap::default();
    for (exact, points, tolerance) in [(&rigid, &points, 1e-6), (&deformed, &moved_points, 1e-5)] {
        exact.find(points, &edges, &mut overlap).expect("an overlap");
        let to_local = |position: Vec3| {
            if std::ptr::eq(points, &moved_points) {
                turn.inverse() * (position - shift)
            } else {
                position
            }
        };
        let mut found = overlap.points.iter();
        for (index, &position) in (0_u32..).zip(points) {
            let depth = HALF - to_local(position).abs().max_element();
            if depth > 1e-7 {
                let inside = found.next().expect("a point");
                assert_eq!(inside.point, index);
                assert!((inside.depth - depth).abs() < tolerance, "{} for {depth}", inside.depth);
                assert!((inside.normal.length() - 1.0).abs() < 1e-5);
            }
        }
        assert!(found.next().is_none() && overlap.points.len() > 100);
        let mut found = overlap.edges.iter();
        for (index, &[a, b]) in (0_u32..).zip(&edges) {
            let [from, to] = [a, b].map(|end| to_local(points[end as usize]));
            if let Some((enters, leaves)) = clipped(from, to)
                && leaves - enters > 1e-5
            {
                let inside = found.next().expect("an edge");
                assert_eq!(inside.edge, index);
                assert!(
                    (f64::from(inside.enters) - enters).abs() < 1e-4,
                    "{inside:?} for {enters}"
                );
                assert!(
                    (f64::from(inside.leaves) - leaves).abs() < 1e-4,
                    "{inside:?} for {leaves}"
                );
            }
        }
        assert!(found.next().is_none() && overlap.edges.len() > 300);
    }
}

#[test]
fn invalid_queries_are_refused() {
    let (positions, triangles) = cube();
    let surface = ClosedSurface::new(&positions, &triangles).expect("a cube");
    let mut exact = Exact::new(&surface).expect("a solid");
    let mut overlap = Overlap::default();
    let message = exact.refit(&positions[1..]).expect_err("refused").to_string();
    assert!(
        message.contains(&format!("{} positions", positions.len() - 1)),
        "{message}"
    );
    let message = exact
        .find(&[Vec3::ZERO], &[[0, 1]], &mut overlap)
        .expect_err("refused")
        .to_string();
    assert!(message.contains("edge 0 joins points [0, 1]"), "{message}");
    let message = exact
        .find(&[Vec3::ZERO, Vec3::NAN], &[], &mut overlap)
        .expect_err("refused")
        .to_string();
    assert!(message.contains("the position of point 1"), "{message}");
    assert!(exact.is_inside(Vec3::ZERO));
    let (distance, normal) = exact.distance(Vec3::X * 0.05, 0.02).expect("near");
    assert!((distance - 0.01).abs() < 1e-6 && normal.distance(Vec3::X) < 1e-5);
    assert!(exact.distance(Vec3::X * 0.07, 0.02).is_none());
}
