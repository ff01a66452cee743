//! Three contact detection methods: the time of a detection against its misses and errors, for surfaces of 1K to 200K
//! triangles, and the cost for tissue on a tool.
//!
//! `cargo bench --bench contact [-- --quick] [--only pairs|tools|cloth]` writes `target/report/contact.md` and plots.
//! It fails if an error exceeds the figure in FIGURES.md.
#![allow(clippy::print_stderr)]

mod claims;
#[path = "../storage/clock.rs"]
mod clock;
mod cloth;
mod errors;
#[path = "../storage/machine.rs"]
mod machine;
mod pairs;
#[path = "../storage/random.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod random;
#[path = "../storage/report.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod report;
#[path = "../storage/rounds.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod rounds;
mod scene;
mod shapes;
#[path = "../storage/svg.rs"]
mod svg;
mod tools;
mod truth;
mod volume;

use std::process::ExitCode;
use std::time::Duration;

use claims::Claims;
use cloth::Extent;
use report::Report;
use rounds::Effort;
use sinew::Solver;

const PARTS: [&str; 3] = ["pairs", "tools", "cloth"];

/// The command-line options.
struct Options {
    quick: bool,
    parts: Vec<&'static str>,
}

impl Options {
    fn from_arguments() -> Result<Self, String> {
        let mut options = Self {
            quick: false,
            parts: PARTS.to_vec(),
        };
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                // Passed by cargo.
                "--bench" => {}
                "--quick" => options.quick = true,
                "--only" => {
                    let name = arguments.next().unwrap_or_default();
                    options.parts.retain(|part| *part == name);
                    if options.parts.is_empty() {
                        return Err(format!("--only {name:?}: must be one of {PARTS:?}"));
                    }
                }
                other => return Err(format!("{other}: there is --quick, and --only pairs|tools|cloth")),
            }
        }
        Ok(options)
    }
}

/// The sizes to measure.
struct Plan {
    pairs: &'static [usize],
    tools: &'static [usize],
    cloth: &'static [Extent],
    effort: Effort,
}

const fn cloth_sizes(solver: Solver, tool: usize, cells: u32) -> Extent {
    Extent { solver, tool, cells }
}

const FULL: Plan = Plan {
    pairs: &[1_000, 5_000, 20_000, 70_000, 200_000],
    tools: &[1_000, 20_000, 200_000],
    cloth: &[
        cloth_sizes(Solver::Verlet, 5_000, 31),
        cloth_sizes(Solver::Verlet, 50_000, 15),
    ],
    effort: Effort {
        quick: false,
        rounds: 4,
        patience: Duration::from_secs(8),
        sample: 5e-3,
    },
};

const QUICK: Plan = Plan {
    pairs: &[1_000, 5_000, 12_000],
    tools: &[5_000],
    cloth: &[cloth_sizes(Solver::Verlet, 5_000, 12)],
    effort: Effort {
        quick: true,
        rounds: 3,
        patience: Duration::from_secs(1),
        sample: 2e-3,
    },
};

fn main() -> ExitCode {
    let options = match Options::from_arguments() {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::FAILURE;
        }
    };
    let plan = if options.quick { QUICK } else { FULL };
    let is_selected = |part| options.parts.contains(&part);
    let mut report = Report::new("contact");
    let mut claims = Claims::default();
    report.write(&introduction(options.quick));
    if is_selected("pairs") {
        pairs::run(&mut report, &mut claims, plan.pairs, plan.effort);
    }
    if is_selected("tools") {
        tools::run(&mut report, &mut claims, plan.tools, plan.effort);
    }
    if is_selected("cloth") {
        cloth::run(&mut report, &mut claims, plan.cloth, plan.effort);
    }
    claims.write(&mut report);
    match report.finish() {
        Ok(path) => eprintln!("report: {}", path.display()),
        Err(error) => {
            eprintln!("the report could not be written: {error}");
            return ExitCode::FAILURE;
        }
    }
    let failures = claims.failures();
    for failure in &failures {
        eprintln!("!! NO LONGER SO: {failure}");
    }
    if failures.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn introduction(quick: bool) -> String {
    let mut text = format!("# Contact\n\n{}", machine::description());
    text.push_str(
        "- Times are the least over rounds in which all contenders of a size take turns, in processor time of one thread: disturbances \
         make them longer, never shorter.\n\
         - Errors are relative to brute force over the same triangles in `f64`: distances to all of them, and the crossings of \
         a ray.\n",
    );
    if quick {
        text.push_str("- A quick run: small sizes, few rounds.\n");
    }
    text
}
