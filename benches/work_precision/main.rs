//! Work-precision diagrams: error against a converged reference over run time. They compare sinew's solvers, the
//! paper's Verlet (Halic et al., section 3) as printed, XPBD with substeps (Macklin et al. 2019) and Projective
//! Dynamics (Liu et al. 2013).
//!
//! `cargo bench --bench work_precision [-- --quick] [--only <scene or settling>] [--part <part>] [--threads <n>]
//! [--check]` writes `target/report/work_precision.md` and diagrams. References are computed once and cached in
//! `target/reference`.
#![allow(clippy::print_stderr)]

mod bisection;
mod cache;
mod check;
mod cholesky;
#[path = "../storage/clock.rs"]
mod clock;
mod contender;
mod exact;
mod lines;
#[path = "../storage/machine.rs"]
mod machine;
mod motion;
mod overview;
mod paper;
mod projective;
#[path = "../storage/random.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod random;
mod reference;
#[path = "../storage/report.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod report;
mod rest;
mod rows;
mod scene;
mod scenes;
mod settling;
mod simd;
mod summary;
#[path = "../storage/svg.rs"]
mod svg;
mod tables;
mod tissue;
mod tolerance;
mod xpbd;

use std::process::ExitCode;

use motion::{Effort, Sweep};
use overview::Overview;
use reference::Reference;
use report::Report;
use scene::Scene;

/// The measurements of a scene.
const PARTS: [&str; 3] = ["motion", "rest", "tolerance"];

/// The command-line options.
struct Options {
    quick: bool,
    check: bool,
    scenes: Vec<&'static str>,
    /// Run the measurement that belongs to no scene.
    settling: bool,
    /// The measurements of each scene.
    parts: Vec<&'static str>,
    threads: u32,
}

impl Options {
    fn from_arguments() -> Result<Self, String> {
        let mut options = Self {
            quick: false,
            check: false,
            scenes: scenes::NAMES.to_vec(),
            settling: true,
            parts: PARTS.to_vec(),
            threads: 1,
        };
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                // Passed by cargo.
                "--bench" => {}
                "--quick" => options.quick = true,
                "--check" => options.check = true,
                "--only" => {
                    let name = arguments.next().unwrap_or_default();
                    options.scenes.retain(|scene| *scene == name);
                    options.settling = name == "settling";
                    if options.scenes.is_empty() && !options.settling {
                        return Err(format!(
                            "--only {name:?}: must be settling or one of {:?}",
                            scenes::NAMES
                        ));
                    }
                }
                "--part" => {
                    let name = arguments.next().unwrap_or_default();
                    options.parts.retain(|part| *part == name);
                    if options.parts.is_empty() {
                        return Err(format!("--part {name:?}: must be one of {PARTS:?}"));
                    }
                }
                "--threads" => match arguments.next().map(|count| count.parse()) {
                    Some(Ok(threads)) if threads > 0 => options.threads = threads,
                    other => return Err(format!("--threads {other:?}: must be a number above 0")),
                },
                other => {
                    return Err(format!(
                        "{other}: there is --quick, --check, --only <scene or settling>, --part <part> and --threads <n>"
                    ));
                }
            }
        }
        Ok(options)
    }
}

fn main() -> ExitCode {
    let result =
        Options::from_arguments().and_then(|options| if options.check { check(&options) } else { run(&options) });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// Checks that the baselines are correct.
fn check(options: &Options) -> Result<(), String> {
    let report = Report::new("work_precision");
    for name in &options.scenes {
        // At these settings no baseline is expected to converge with stiffness ratios of a thousand or slivers that
        // snap through.
        if !["contrast", "stomach"].contains(name) {
            let scene = scenes::scene(name)?;
            check::run(&report, &scene, &Reference::of(&scene, &report))?;
        }
    }
    Ok(())
}

/// Runs all measurements.
fn run(options: &Options) -> Result<(), String> {
    let effort = if options.quick { Effort::QUICK } else { Effort::FULL };
    let mut report = Report::new("work_precision");
    report.write(&introduction(options));
    let mut overview = Overview::default();
    for name in &options.scenes {
        let scene = match scenes::scene(name) {
            Ok(scene) => scene,
            Err(reason) => {
                report.not_offered(name, &reason);
                continue;
            }
        };
        let reference = Reference::of(&scene, &report);
        report.write(&format!(
            "\n## {name}\n\n{} {} nodes, {} springs; leapfrog is stable up to steps of {:.4} ms. Half as many steps \
             change the reference by {}.\n",
            scene.description,
            scene.node_count(),
            scene.springs.len(),
            1e3 * reference.stable_step,
            tables::percent(reference.uncertainty)
        ));
        let is_selected = |part| options.parts.contains(&part);
        if is_selected("motion") {
            let sweeps = sweeps(&scene, &reference, options.threads, effort, &mut report);
            tables::write(&mut report, &scene, &reference, &sweeps);
            overview.add(name, &reference, &sweeps);
        }
        if is_selected("rest") {
            rest::run(&mut report, &scene, options.threads, effort.patience_at_rest);
        }
        if is_selected("tolerance") {
            tolerance::run(
                &mut report,
                &scene,
                &reference,
                options.threads,
                effort.patience_at_rest,
            );
        }
    }
    overview.write(&mut report);
    if options.settling {
        settling::run(&mut report);
    }
    for (scene, reason) in scenes::PENDING {
        report.not_offered(scene, &format!("pending: {reason}"));
    }
    let path = report
        .finish()
        .map_err(|error| format!("the report could not be written: {error}"))?;
    eprintln!("report: {}", path.display());
    Ok(())
}

/// All lines of a scene.
fn sweeps(scene: &Scene, reference: &Reference, threads: u32, effort: Effort, report: &mut Report) -> Vec<Sweep> {
    let mut sweeps = Vec::new();
    for line in lines::lines(reference.stable_step, threads) {
        let sweep = motion::sweep(scene, reference, line, effort, report);
        if let Err(reason) = &sweep.points {
            report.not_offered(&sweep.line.name, reason);
        }
        sweeps.push(sweep);
    }
    sweeps
}

fn introduction(options: &Options) -> String {
    let mut text = format!("# Work and precision\n\n{}", machine::description());
    text.push_str(
        "- Error: RMS over nodes and 8 sample times within 0.25 s of the distance to leapfrog in `f64`, over RMS of its \
         motion. Force error: of the force on all pins together, in the RMS of that force. Volume error: of the \
         tetrahedra's volume, in that at the start. s/s: seconds per simulated second. h: a solver's step, or its substep if it has any. Energy \
         drift: at the end, in the largest kinetic energies.\n\
         - Times are the best of up to two runs, in processor time of the thread. Preparing (laying out springs, \
         coloring, factoring) is not included and listed separately. Runs that take too long are stopped, or not started, and listed as \
         too slow, with the expected time.\n",
    );
    if options.threads > 1 {
        text.push_str(&format!(
            "- sinew on {} threads and all times in wall time; baselines run on one thread.\n",
            options.threads
        ));
    }
    if options.quick {
        text.push_str("- A quick run: every second point, two runs each, no long ones.\n");
    }
    text
}
