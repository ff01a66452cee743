//! The table of stability, all of it: every case with every solver, storage and step.
//!
//! `cargo bench --bench stability [-- part of a case's name [solver]]` writes `target/report/stability.md`. What is not as it
//! should be makes it fail. A name of nothing, `""`, is part of all.
//!
//! `cargo bench --bench stability -- long` is the table of long runs; see `stability/long_runs.rs`.
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
    let asked = arguments.first().map_or("", String::as_str);
    let solver = arguments.get(1).map(String::as_str);
    let solvers: Vec<Solver> = SOLVERS
        .into_iter()
        .filter(|tried| solver.is_none_or(|name| name.eq_ignore_ascii_case(&format!("{tried:?}"))))
        .collect();
    let mut report = String::from("# Stability\n\n");
    let mut wrong = 0;
    for case in CASES.iter().filter(|case| case.name.contains(asked)) {
        wrong += line(case, &solvers, &mut report);
    }
    report.push_str("## Waiting for what is not there yet\n\n");
    for (name, what) in PENDING {
        let _ = writeln!(report, "- {name}: {what}");
    }
    let folder = support::report_folder();
    if let Err(error) =
        std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(folder.join("stability.md"), report))
    {
        eprintln!("{}: {error}", folder.display());
        return ExitCode::FAILURE;
    }
    eprintln!(
        "{}: {wrong} not as they should be",
        folder.join("stability.md").display()
    );
    if wrong == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Tries a line of the table; how many of its cells are not as they should be.
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
