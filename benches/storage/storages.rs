//! Experiment A: the paper's table 3 and figure 8, with memory, a fragmented heap and cutting load.

use std::collections::HashSet;
use std::time::Instant;

use sinew::Storage;

use crate::bodies::{Setup, Stepped};
use crate::clock;
use crate::fast_link::{FastLink, Library, Variant};
use crate::heap::{self, Fragmented};
use crate::random::Random;
use crate::report::{Report, Table, count, digits, megabytes, milliseconds};
use crate::rounds::{Contender, Effort, Results, Samples, interleave};
use crate::scenes::Scene;
use crate::svg::{self, Series};

const STORAGES: [(&str, Storage); 4] = [
    ("EFFICIENT", Storage::Efficient),
    ("FAST_LINK", Storage::FastLink),
    ("DYNAMIC_BULK", Storage::DynamicBulk),
    ("PACKED", Storage::Packed),
];

const SIZES: [usize; 6] = [100_000, 200_000, 300_000, 500_000, 1_000_000, 2_000_000];

/// The times of each storage in the paper's table 3 at each of `SIZES` [s]. The numbers are not available yet.
const PAPER: [(&str, [Option<f64>; 6]); 3] = [
    ("EFFICIENT", [None; 6]),
    ("FAST_LINK", [None; 6]),
    ("DYNAMIC_BULK", [None; 6]),
];

const C_PLAIN: &str = "C fast link";
const C_PREFETCH: &str = "C fast link, prefetch";

/// Fraction of springs removed, and added, between two steps.
const CUT_SHARE: f64 = 0.01;
/// Nodes of a sheet have 8 springs; cutting adds up to 4.
const ROW_WHEN_CUT: u32 = 12;

pub fn run(report: &mut Report, effort: Effort, library: Option<&Library>) {
    report.write(
        "\n## A. The paper's table 3 and figure 8\n\nA sheet with 8 neighbors per node, one thread, steps of one \
         substep, its storages as the paper describes them; PACKED is sinew's.\n",
    );
    report.progress("checking the effect of a fragmented heap");
    let links = if effort.quick { 400_000 } else { 2_000_000 };
    report.write(&format!(
        "\nA fragmented heap works: walking {links} links of lists in it takes {} times as long as in a fresh one.\n",
        digits(heap::effect(links))
    ));
    let sizes = if effort.quick { &SIZES[..2] } else { &SIZES[..] };
    let sizes: Vec<Size> = sizes
        .iter()
        .map(|&nodes| measure(report, effort, library, nodes))
        .collect();
    times(report, &sizes);
    details(report, &sizes);
    figure(report, &sizes);
}

/// The measurements at one size.
struct Size {
    nodes: usize,
    times: Results,
    bodies: Vec<(&'static str, Memory)>,
    cuts: Vec<(&'static str, Cutting)>,
}

/// Memory of a body [bytes].
struct Memory {
    used: usize,
    reserved: usize,
    /// Memory of the whole body, as reported by the allocator.
    body: Option<usize>,
}

/// Times under cutting load [s].
struct Cutting {
    step: f64,
    edit: f64,
}

fn fragmented(name: &str) -> String {
    format!("{name}, fragmented heap")
}

fn measure(report: &mut Report, effort: Effort, library: Option<&Library>, nodes: usize) -> Size {
    report.progress(&format!("A: {} nodes", count(nodes)));
    heap::trim();
    let scene = Scene::grid(nodes);
    let mut memory = Vec::new();
    let mut fresh = Vec::new();
    for (name, storage) in STORAGES {
        let before = heap::allocated();
        match Stepped::new(
            &scene,
            Setup {
                storage,
                ..Setup::default()
            },
        ) {
            Ok(body) => {
                let bytes = body.storage_report();
                let used = heap::allocated()
                    .zip(before)
                    .map(|(after, before)| after.saturating_sub(before));
                memory.push((
                    name,
                    Memory {
                        used: bytes.bytes_used,
                        reserved: bytes.bytes_reserved,
                        body: used,
                    },
                ));
                fresh.push((name, storage, body));
            }
            Err(reason) => report.not_offered(name, &reason),
        }
    }
    let mut worn = Vec::new();
    for (name, storage, body) in &fresh {
        let (size, blocks) = small_blocks(*storage, body);
        let heap = Fragmented::new(size, blocks);
        let setup = Setup {
            storage: *storage,
            ..Setup::default()
        };
        worn.push((
            fragmented(name),
            Stepped::new(&scene, setup).expect("a setup that worked before"),
        ));
        drop(heap);
    }
    let mut rivals: Vec<(&str, FastLink, Variant)> = Vec::new();
    if let Some(library) = library {
        rivals.push((C_PLAIN, FastLink::new(library, &scene), Variant::PLAIN));
        let mut body = FastLink::new(library, &scene);
        let variant = fastest_variant(&mut body);
        report.progress(&format!("   {C_PREFETCH}: {variant:?}"));
        rivals.push((C_PREFETCH, body, variant));
    }

    let mut contenders = Vec::new();
    for (name, _, body) in &mut fresh {
        contenders.push(Contender::new(*name, 1, |steps| body.step(steps)));
    }
    for (name, body) in &mut worn {
        contenders.push(Contender::new(name.clone(), 1, |steps| body.step(steps)));
    }
    for (name, body, variant) in &mut rivals {
        let variant = *variant;
        contenders.push(Contender::new(*name, 1, move |steps| body.step(variant, steps)));
    }
    let times = interleave(contenders, effort);
    report.disturbed(times.waited);
    drop((worn, rivals));
    for (_, storage, body) in &mut fresh {
        if *storage == Storage::FastLink {
            let setup = Setup {
                storage: *storage,
                springs_per_node: ROW_WHEN_CUT,
                ..Setup::default()
            };
            *body = Stepped::new(&scene, setup).expect("a setup that worked before");
        }
    }
    let cuts = cut(&scene, fresh, effort);
    Size {
        nodes: scene.positions.len(),
        times,
        bodies: memory,
        cuts,
    }
}

/// The size and number of a storage's small allocations.
fn small_blocks(storage: Storage, body: &Stepped) -> (usize, usize) {
    let bytes = body.storage_report();
    match storage {
        Storage::Efficient => (bytes.bytes_used / (2 * bytes.spring_count), 2 * bytes.spring_count),
        Storage::DynamicBulk => (bytes.bytes_reserved / bytes.node_count, bytes.node_count),
        // These storages allocate a few large blocks.
        Storage::FastLink | Storage::Packed => (64, bytes.node_count),
    }
}

/// The fastest variant with prefetch on this machine.
pub fn fastest_variant(body: &mut FastLink) -> Variant {
    let mut time = |variant| {
        let times = (0..3).map(|_| clock::time(|| body.step(variant, 2)).processor);
        times.fold(f64::INFINITY, f64::min)
    };
    let timings = Variant::prefetching().map(|variant| (time(variant), variant));
    timings
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(Variant::PLAIN, |(_, variant)| variant)
}

/// Steps with springs removed and added between them, identically in every storage.
fn cut(
    scene: &Scene,
    mut bodies: Vec<(&'static str, Storage, Stepped)>,
    effort: Effort,
) -> Vec<(&'static str, Cutting)> {
    let start = Instant::now();
    let mut edits = SpringEdits::new(scene);
    let mut seconds: Vec<[Vec<f64>; 2]> = bodies.iter().map(|_| Default::default()).collect();
    for round in 0..effort.rounds {
        if round >= 3 && start.elapsed() > effort.patience {
            break;
        }
        let (removed, added) = edits.next();
        for ((_, _, stepped), [steps, edits]) in bodies.iter_mut().zip(&mut seconds) {
            let edit = clock::time(|| {
                let body = stepped.body_mut();
                for &[a, b] in &removed {
                    body.remove_spring(a, b).expect("a spring that is there");
                }
                for &[a, b] in &added {
                    body.add_spring(a, b, crate::scenes::STIFFNESS, None)
                        .expect("room for a spring");
                }
            });
            edits.push(edit.processor / (removed.len() + added.len()) as f64);
            steps.push(clock::time(|| stepped.step(1)).processor);
        }
    }
    let results = bodies.iter().zip(&seconds).map(|((name, _, _), [steps, edits])| {
        let cutting = Cutting {
            step: crate::rounds::median(steps.clone()),
            edit: crate::rounds::median(edits.clone()),
        };
        (*name, cutting)
    });
    results.collect()
}

/// Chooses springs to remove, and springs to add between nodes two apart along a row.
struct SpringEdits {
    random: Random,
    columns: usize,
    node_count: usize,
    springs: Vec<[u32; 2]>,
    added: HashSet<[u32; 2]>,
}

impl SpringEdits {
    fn new(scene: &Scene) -> Self {
        Self {
            random: Random(6),
            // A sheet is pinned along a row.
            columns: scene.pinned.len(),
            node_count: scene.positions.len(),
            springs: scene.springs.clone(),
            added: HashSet::new(),
        }
    }

    fn next(&mut self) -> (Vec<[u32; 2]>, Vec<[u32; 2]>) {
        let cuts = (CUT_SHARE * self.springs.len() as f64).ceil() as usize;
        let removed: Vec<[u32; 2]> = (0..cuts)
            .map(|_| {
                let pair = self.springs.swap_remove(self.random.below(self.springs.len()));
                self.added.remove(&pair);
                pair
            })
            .collect();
        let mut added = Vec::with_capacity(cuts);
        while added.len() < cuts {
            let node = self.random.below(self.node_count);
            if node % self.columns + 2 < self.columns {
                let pair = [node as u32, node as u32 + 2];
                if self.added.insert(pair) {
                    added.push(pair);
                }
            }
        }
        self.springs.extend(&added);
        (removed, added)
    }
}

fn cell(samples: Option<&Samples>) -> String {
    samples.map_or("not offered".into(), |samples| milliseconds(samples.minimum()))
}

/// The table of the paper.
fn times(report: &mut Report, sizes: &[Size]) {
    report.write("\n### Time per step, ms (in brackets: the paper's)\n");
    let mut header = vec!["nodes"];
    header.extend(STORAGES.iter().map(|(name, _)| *name));
    header.extend([C_PLAIN, C_PREFETCH, "not run"]);
    let mut table = Table::new(&header);
    for (index, size) in sizes.iter().enumerate() {
        let mut cells = vec![count(size.nodes)];
        for (name, _) in STORAGES {
            let paper = PAPER.iter().find(|(paper, _)| *paper == name);
            let paper = paper.map(|(_, times)| match times[index] {
                Some(time) => format!(" ({})", milliseconds(time)),
                None => " (not available)".into(),
            });
            cells.push(cell(size.times.get(name)) + &paper.unwrap_or_default());
        }
        cells.extend([C_PLAIN, C_PREFETCH].map(|name| cell(size.times.get(name))));
        cells.push(format!("{:.0} %", 100.0 * size.times.waited));
        table.row(cells);
    }
    report.table(&table);
    report.write("\n`not run`: the share of the time in which the machine ran other programs instead of this one.\n");
}

fn details(report: &mut Report, sizes: &[Size]) {
    report.write(&format!(
        "\n### Heap, cutting, memory\n\nCutting: {} % of the springs removed and as many others added before each step; a \
         row of FAST_LINK has {ROW_WHEN_CUT} slots then. Memory in MB of 10^6: springs' bytes used and held, and the whole \
         body by the allocator's account.\n",
        digits(100.0 * CUT_SHARE)
    ));
    let mut table = Table::new(&[
        "nodes",
        "storage",
        "step, ms",
        "median, ms",
        "of PACKED",
        "fragmented, ms",
        "of fresh",
        "cutting: step, ms",
        "edit, us",
        "used, MB",
        "held, MB",
        "body, MB",
    ]);
    for size in sizes {
        for (name, _) in STORAGES {
            let mut cells = vec![count(size.nodes), name.to_owned()];
            let fresh = size.times.get(name);
            let memory = size.bodies.iter().find(|(body, _)| *body == name);
            let cutting = size.cuts.iter().find(|(body, _)| *body == name);
            let (Some(fresh), Some((_, memory)), Some((_, cutting))) = (fresh, memory, cutting) else {
                cells.push("**not offered**".into());
                cells.extend((0..9).map(|_| String::new()));
                table.row(cells);
                continue;
            };
            let worn = size.times.get(&fragmented(name));
            let packed = size.times.get("PACKED");
            cells.extend([
                milliseconds(fresh.minimum()),
                milliseconds(fresh.median()),
                packed.map_or(String::new(), |packed| digits(fresh.ratio(packed))),
                cell(worn),
                worn.map_or(String::new(), |worn| digits(worn.ratio(fresh))),
                milliseconds(cutting.step),
                digits(1e6 * cutting.edit),
                megabytes(memory.used),
                megabytes(memory.reserved),
                memory.body.map_or("-".into(), megabytes),
            ]);
            table.row(cells);
        }
    }
    report.table(&table);
}

fn figure(report: &mut Report, sizes: &[Size]) {
    let points = |name: &str| {
        let point = |size: &Size| Some((size.nodes as f64, 1e3 * size.times.get(name)?.minimum()));
        sizes.iter().filter_map(point).collect()
    };
    let mut series = Vec::new();
    for (name, storage) in STORAGES {
        series.push(Series {
            name: name.into(),
            points: points(name),
            dashed: false,
        });
        if matches!(storage, Storage::Efficient | Storage::DynamicBulk) {
            series.push(Series {
                name: fragmented(name),
                points: points(&fragmented(name)),
                dashed: true,
            });
        }
    }
    for name in [C_PLAIN, C_PREFETCH] {
        series.push(Series {
            name: name.into(),
            points: points(name),
            dashed: false,
        });
    }
    let title = "Time per step against the number of nodes";
    let svg = svg::plot(title, "nodes", "ms per step", &series);
    report.plot("storages.svg", title, svg);
    let memory = STORAGES.iter().map(|(name, _)| Series {
        name: (*name).into(),
        points: sizes
            .iter()
            .filter_map(|size| {
                let (_, memory) = size.bodies.iter().find(|(body, _)| body == name)?;
                Some((size.nodes as f64, 1e-6 * memory.reserved as f64))
            })
            .collect(),
        dashed: false,
    });
    let title = "Memory of the springs against the number of nodes";
    let svg = svg::plot(title, "nodes", "MB held", &memory.collect::<Vec<_>>());
    report.plot("storages_memory.svg", title, svg);
}
