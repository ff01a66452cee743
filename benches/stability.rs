//! The complete stability table: every case with every solver, storage and step.
//!
//! `cargo bench --bench stability [-- part of a case's name [solver]]` writes `target/report/stability.md`. It fails if
//! any result is not as expected. The empty name `""` matches all cases.
//!
//! `cargo bench --bench stability -- long` writes the table of long runs; see `stability/long_runs.rs`.
#![allow(clippy::print_stderr)]

#[path = "../tests/stability/mod.rs"]
mod cases;
#[path = "stability/long_runs.rs"]
mod long_runs;
#[path = "../tests/support/mod.rs"]
mod support;

use std::fmt::Write;
use std::process::ExitCode;
use std::time::Instant;

use cases::{CASES, Case, PENDING, SOLVERS, STEPS, STORAGES, Setup, Stop, Tier, Verdict};
use sinew::Solver;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench")
        .collect();
    if arguments.first().is_some_and(|first| first == "long") {
        return long_runs::main(&arguments[1..]);
    }
    let filter = arguments.first().map_or("", String::as_str);
    let solver = arguments.get(1).map(String::as_str);
    let solvers: Vec<Solver> = SOLVERS
        .into_iter()
        .filter(|tried| solver.is_none_or(|name| name.eq_ignore_ascii_case(&format!("{tried:?}"))))
        .collect();
    let mut report = String::from("# Stability\n\n");
    let mut wrong = 0;
    for case in CASES.iter().filter(|case| case.name.contains(filter)) {
        wrong += line(case, &solvers, &mut report);
    }
    report.push_str("## Pending features\n\n");
    for (name, feature) in PENDING {
        let _ = writeln!(report, "- {name}: {feature}");
    }
    let folder = support::report_folder();
    if let Err(error) =
        std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(folder.join("stability.md"), report))
    {
        eprintln!("{}: {error}", folder.display());
        return ExitCode::FAILURE;
    }
    eprintln!("{}: {wrong} not as expected", folder.join("stability.md").display());
    if wrong == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Runs a row of the table and returns the number of cells that are not as expected.
fn line(case: &Case, solvers: &[Solver], report: &mut String) -> usize {
    let mut wrong = 0;
    let _ = writeln!(report, "## {}\n", case.name);
    report.push_str("| solver | storage |");
    for step in STEPS {
        let _ = write!(report, " {step:.3e} s |");
    }
    let _ = writeln!(report, "\n|---|---|{}", "---|".repeat(STEPS.len()));
    for &solver in solvers {
        for storage in STORAGES {
            let _ = write!(report, "| {solver:?} | {storage:?} |");
            for step in STEPS {
                let setup = Setup {
                    solver,
                    storage,
                    step,
                    tier: Tier::Full,
                };
                let start = Instant::now();
                let verdict = Verdict::of(case, &setup);
                let expected = verdict.is_expected(&setup);
                wrong += usize::from(!expected);
                if !matches!(verdict.outcome, Err(Stop::Unsupported(_))) {
                    let seconds = start.elapsed().as_secs_f64();
                    let mark = if expected { "" } else { " <<<" };
                    eprintln!(
                        "{}, {solver:?}, {storage:?}, {step:.3e} s: {verdict}, {seconds:.1} s{mark}",
                        case.name
                    );
                }
                let _ = write!(report, " {verdict} |");
            }
            report.push('\n');
        }
    }
    report.push('\n');
    wrong
}
