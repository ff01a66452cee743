//! Compares the library with published benchmarks, measurements and theory, and checks whether results are within their
//! targets.
//!
//! `cargo bench --bench validation [-- --quick] [--only NAME]` writes `target/report/validation.md` and plots. The
//! table lists missed and met targets alike. The bench fails only if a line misses a target that it met when its
//! figures were published.
#![allow(clippy::print_stderr)]

#[path = "../../tests/accuracy/mod.rs"]
mod accuracy;
mod balloon;
mod beam;
mod c3d;
#[path = "../storage/clock.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod clock;
mod csm;
mod defaults;
mod hertz;
mod hyperelastic;
#[path = "../../tests/material/laws.rs"]
#[allow(dead_code, unused_imports)] // its tests are not compiled here
mod laws;
mod lines;
#[path = "../storage/machine.rs"]
mod machine;
#[path = "../storage/report.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod report;
#[path = "../../tests/support/mod.rs"]
mod support;
#[path = "../storage/svg.rs"]
mod svg;
mod time_plot;

use std::process::ExitCode;

use lines::Lines;
use report::Report;

/// Writes a section of the report and adds lines to the table of results. The flag selects small meshes.
type Section = fn(&mut Report, &mut Lines, bool);

/// The sections by name.
const PARTS: [(&str, Section); 6] = [
    ("csm", csm::run),
    ("beam", beam::run),
    ("hertz", hertz::run),
    ("hyperelastic", hyperelastic::run),
    ("balloon", balloon::run),
    ("defaults", defaults::run),
];

fn main() -> ExitCode {
    let (mut is_quick, mut only) = (false, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            // Passed by cargo.
            "--bench" => {}
            "--quick" => is_quick = true,
            "--only" => only = Some(arguments.next().unwrap_or_default()),
            other => {
                eprintln!("{other}: there is --quick, and --only NAME");
                return ExitCode::FAILURE;
            }
        }
    }
    let is_selected = |name: &str| only.as_ref().is_none_or(|only| only == name);
    if !PARTS.iter().any(|(name, _)| is_selected(name)) {
        eprintln!("--only: must be one of {:?}", PARTS.map(|(name, _)| name));
        return ExitCode::FAILURE;
    }
    let mut report = Report::new("validation");
    report.write("# Validation\n\n");
    report.write(&machine::description());
    let mut lines = Lines::default();
    for (name, run) in PARTS {
        if is_selected(name) {
            report.progress(name);
            run(&mut report, &mut lines, is_quick);
        }
    }
    lines.write(&mut report);
    match report.finish() {
        Ok(path) => eprintln!("{}", path.display()),
        Err(error) => {
            eprintln!("the report cannot be written: {error}");
            return ExitCode::FAILURE;
        }
    }
    if lines.missed() == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
