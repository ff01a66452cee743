//! Experiment B: PACKED against the limits of memory and arithmetic, and against the paper's fast link in C.

use std::cell::RefCell;
use std::rc::Rc;

use glam::Vec3;
use sinew::Kernel;

use crate::bodies::{Setup, Stepped};
use crate::fast_link::{FastLink, Library, Variant};
use crate::heap;
use crate::limits::Memory;
use crate::report::{Report, Table, count, digits, milliseconds};
use crate::rounds::{Contender, Effort, Results, interleave};
use crate::scenes::{Kind, Scene};
use crate::storages::fastest_variant;
use crate::svg::{self, Series};

const SIZES: [usize; 5] = [1_000, 10_000, 100_000, 1_000_000, 2_000_000];

const THREADS: [u32; 2] = [1, 2];

/// Substeps of a step, enough to measure a single substep: the fixed cost of a step is divided among them.
const SUBSTEPS: u32 = 16;

/// Bodies that fit into a core's caches. The smallest has most of its springs near its border, where rows are uneven.
const CACHED_SIZES: [usize; 3] = [1_000, 4_000, 16_000];

const KERNELS: [(&str, Kernel); 4] = [
    ("AVX-512", Kernel::Avx512),
    ("AVX2", Kernel::Avx2),
    ("NEON", Kernel::Neon),
    ("portable", Kernel::Portable),
];

/// Above this size, a randomly numbered sheet takes seconds per step without new information.
const MOST_AT_RANDOM: usize = 1_000_000;

const MOST_FOR_KERNELS: usize = 100_000;

const C_PLAIN: &str = "C";
const C_PREFETCH: &str = "C, prefetch";

pub fn run(report: &mut Report, effort: Effort, library: Option<&Library>) {
    report.write(&format!(
        "\n## B. PACKED against the limits\n\n\
         - *step*: a step of one substep. *substep*: a {SUBSTEPS}th of a step of {SUBSTEPS} substeps. The C program runs one \
         substep per call and stores velocities; it is compared with both.\n\
         - *memory*: reading positions (12 B a node), reading and writing velocities (24 B), writing the next positions (12 B, \
         and 12 B to fetch them unless stores are non-temporal), and reading the links' bytes, by loops that do \
         nothing else. *state*: the same without the links.\n\
         - *arithmetic*: PACKED itself, a substep of bodies of 1K, 4K and 16K nodes of the same kind, all in cache; the least \
         time per spring of the three, times the springs; halved for two threads.\n\
         - The limit is the larger of memory and arithmetic; *of limit*: substep over limit, and step over limit. \
         It is below 1 if a large body has less border for its size than those in cache.\n"
    ));
    agreement(report, library);
    let sizes = if effort.quick { &SIZES[..3] } else { &SIZES[..] };
    let mut series = Vec::new();
    for kind in Kind::ALL {
        let rows: Vec<Row> = sizes
            .iter()
            .filter(|&&nodes| kind != Kind::GridAtRandom || nodes <= MOST_AT_RANDOM)
            .map(|&nodes| measure(report, effort, library, kind, nodes))
            .collect();
        against_limits(report, kind, &rows);
        against_rivals(report, kind, &rows);
        let points = |value: &dyn Fn(&Row) -> Option<f64>| -> Vec<(f64, f64)> {
            let point = |row: &Row| Some((row.nodes as f64, 1e9 * value(row)? / row.nodes as f64));
            rows.iter().filter_map(point).collect()
        };
        for threads in THREADS {
            series.push(Series {
                name: format!(
                    "{}, {threads} thread{}",
                    kind.name(),
                    if threads == 1 { "" } else { "s" }
                ),
                points: points(&|row| row.substep(threads)),
                dashed: false,
            });
        }
        series.push(Series {
            name: format!("{}, limit of 1", kind.name()),
            points: points(&|row| row.limit(1)),
            dashed: true,
        });
    }
    let title = "PACKED: time of a substep per node";
    let svg = svg::plot(title, "nodes", "ns per substep and node", &series);
    report.plot("packed.svg", title, svg);
}

fn step_name(threads: u32) -> String {
    format!("step, {threads}")
}

fn substep_name(threads: u32) -> String {
    format!("substep, {threads}")
}

fn memory_name(threads: u32) -> String {
    format!("memory, {threads}")
}

fn state_name(threads: u32) -> String {
    format!("state, {threads}")
}

/// The measurements of a scene.
struct Row {
    nodes: usize,
    springs: usize,
    results: Results,
    /// The names of the bodies in cache, and their numbers of springs.
    cached: Vec<(String, usize)>,
}

impl Row {
    fn least(&self, name: &str) -> Option<f64> {
        Some(self.results.get(name)?.minimum())
    }

    /// More threads can be slower, but are never necessary.
    fn memory(&self, threads: u32) -> Option<f64> {
        let alone = self.least(&memory_name(1))?;
        Some(self.least(&memory_name(threads))?.min(alone))
    }

    fn substep(&self, threads: u32) -> Option<f64> {
        Some(self.least(&substep_name(threads))? / f64::from(SUBSTEPS))
    }

    fn arithmetic(&self, threads: u32) -> Option<f64> {
        let per_spring = |(name, springs): &(String, usize)| Some(self.least(name)? / *springs as f64);
        let least = self.cached.iter().filter_map(per_spring).min_by(f64::total_cmp)?;
        Some(least / f64::from(SUBSTEPS) * self.springs as f64 / f64::from(threads))
    }

    fn limit(&self, threads: u32) -> Option<f64> {
        Some(self.memory(threads)?.max(self.arithmetic(threads)?))
    }
}

fn measure(report: &mut Report, effort: Effort, library: Option<&Library>, kind: Kind, nodes: usize) -> Row {
    heap::trim();
    let scene = kind.scene(nodes);
    report.progress(&format!(
        "B: {}, {} nodes, {} springs",
        scene.name,
        count(scene.positions.len()),
        count(scene.springs.len())
    ));
    let mut contenders = Vec::new();
    let mut link_bytes = 0;
    for threads in THREADS {
        for (name, substeps) in [(step_name(threads), 1), (substep_name(threads), SUBSTEPS)] {
            let setup = Setup {
                threads,
                substeps,
                ..Setup::default()
            };
            match Stepped::new(&scene, setup) {
                Ok(mut body) => {
                    link_bytes = body.storage_report().bytes_used;
                    contenders.push(Contender::new(name, threads, move |steps| body.step(steps)));
                }
                Err(reason) => report.not_offered(&format!("{threads} threads"), &reason),
            }
        }
    }
    // Large bodies are limited by memory at every SIMD level.
    if nodes <= MOST_FOR_KERNELS {
        for (name, kernel) in KERNELS {
            let setup = Setup {
                kernel,
                substeps: SUBSTEPS,
                ..Setup::default()
            };
            match Stepped::new(&scene, setup) {
                Ok(mut body) => contenders.push(Contender::new(name, 1, move |steps| body.step(steps))),
                Err(reason) => report.not_offered(&format!("kernel {name}"), &reason),
            }
        }
    }
    let mut cached = Vec::new();
    for nodes in CACHED_SIZES {
        let scene = kind.scene(nodes);
        let setup = Setup {
            substeps: SUBSTEPS,
            ..Setup::default()
        };
        let mut body = Stepped::new(&scene, setup).expect("PACKED on one thread");
        let name = format!("in cache, {nodes}");
        cached.push((name.clone(), scene.springs.len()));
        contenders.push(Contender::new(name, 1, move |steps| body.step(steps)));
    }
    for threads in THREADS {
        let memory = Memory::new(scene.positions.len(), link_bytes, threads as usize);
        let memory = Rc::new(RefCell::new(memory));
        let state = Rc::clone(&memory);
        contenders.push(Contender::new(memory_name(threads), threads, move |passes| {
            memory.borrow_mut().substep(passes);
        }));
        contenders.push(Contender::new(state_name(threads), threads, move |passes| {
            state.borrow_mut().advance(passes);
        }));
    }
    if let Some(library) = library {
        let mut body = FastLink::new(library, &scene);
        let variant = fastest_variant(&mut body);
        let body = Rc::new(RefCell::new(body));
        for (name, variant) in [(C_PLAIN, Variant::PLAIN), (C_PREFETCH, variant)] {
            let body = Rc::clone(&body);
            contenders.push(Contender::new(name, 1, move |steps| {
                body.borrow_mut().step(variant, steps)
            }));
        }
    }
    let results = interleave(contenders, effort);
    report.disturbed(results.waited);
    Row {
        nodes: scene.positions.len(),
        springs: scene.springs.len(),
        results,
        cached,
    }
}

/// Steps the same scene in the C program and in PACKED, and checks that both agree.
fn agreement(report: &mut Report, library: Option<&Library>) {
    const STEPS: usize = 200;
    let Some(library) = library else { return };
    let scene = Scene::grid(1_000);
    let mut packed = Stepped::new(&scene, Setup::default()).expect("PACKED on one thread");
    packed.step(STEPS);
    for variant in Variant::prefetching().chain([Variant::PLAIN]) {
        let mut body = FastLink::new(library, &scene);
        body.step(variant, STEPS);
        let difference = |(a, b): (&Vec3, &Vec3)| a.distance(*b);
        let distance = packed.body().positions().iter().zip(body.positions()).map(difference);
        let distance = distance.fold(0.0, f32::max);
        let displacement = packed.body().positions().iter().zip(&scene.positions).map(difference);
        let displacement = displacement.fold(0.0, f32::max);
        // The C program starts with a full kick, PACKED with half a kick. They differ by h² g / 2 per step, a 200th of
        // the fall.
        assert!(
            displacement > 1e-4 && distance < 0.05 * displacement,
            "{variant:?}: {distance} m apart from PACKED, which moved by {displacement} m"
        );
    }
    report.write(&format!(
        "\nThe C program and PACKED agree on {STEPS} steps of a sheet of {} nodes.\n",
        count(scene.positions.len())
    ));
}

fn time(value: Option<f64>) -> String {
    value.map_or("**not offered**".into(), milliseconds)
}

fn quotient(value: Option<f64>, by: Option<f64>) -> String {
    value.zip(by).map_or(String::new(), |(value, by)| digits(value / by))
}

fn against_limits(report: &mut Report, kind: Kind, rows: &[Row]) {
    report.write(&format!("\n### {}: against the limits, ms\n", kind.name()));
    let mut table = Table::new(&[
        "nodes",
        "springs",
        "threads",
        "step",
        "substep",
        "state",
        "memory",
        "arithmetic",
        "limit",
        "substep, of limit",
        "step, of limit",
        "ns per spring",
    ]);
    for row in rows {
        for threads in THREADS {
            let (step, substep, limit) = (row.least(&step_name(threads)), row.substep(threads), row.limit(threads));
            let per_spring = substep.map_or(String::new(), |substep| digits(1e9 * substep / row.springs as f64));
            table.row(vec![
                count(row.nodes),
                count(row.springs),
                threads.to_string(),
                time(step),
                time(substep),
                time(row.least(&state_name(threads))),
                time(row.memory(threads)),
                time(row.arithmetic(threads)),
                time(limit),
                quotient(substep, limit),
                quotient(step, limit),
                per_spring,
            ]);
        }
    }
    report.table(&table);
}

fn against_rivals(report: &mut Report, kind: Kind, rows: &[Row]) {
    report.write(&format!(
        "\n### {}: against the fast link in C, and by kernel, one thread, ms per substep\n",
        kind.name()
    ));
    let mut header = vec![
        "nodes",
        C_PLAIN,
        C_PREFETCH,
        "PACKED step",
        "C, prefetch / step",
        "PACKED substep",
    ];
    header.push("C, prefetch / substep");
    header.extend(KERNELS.iter().map(|(name, _)| *name));
    header.push("not run");
    let mut table = Table::new(&header);
    for row in rows {
        let results = &row.results;
        let prefetch = results.get(C_PREFETCH);
        let ratio = |name: String, units: f64| {
            let ratio = prefetch
                .zip(results.get(&name))
                .map(|(c, packed)| units * c.ratio(packed));
            ratio.map_or(String::new(), digits)
        };
        let mut cells = vec![
            count(row.nodes),
            time(row.least(C_PLAIN)),
            time(row.least(C_PREFETCH)),
            time(row.least(&step_name(1))),
            ratio(step_name(1), 1.0),
            time(row.substep(1)),
            ratio(substep_name(1), f64::from(SUBSTEPS)),
        ];
        cells.extend(KERNELS.map(|(name, _)| {
            row.least(name)
                .map_or("-".into(), |seconds| milliseconds(seconds / f64::from(SUBSTEPS)))
        }));
        cells.push(format!("{:.0} %", 100.0 * results.waited));
        table.row(cells);
    }
    report.table(&table);
}
