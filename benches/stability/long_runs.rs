//! The table of long runs, all of it: hours.
//!
//! `cargo bench --bench stability -- long [parts of a row's name] [--seconds S] [--list]` writes `target/report/long_runs.md` as it goes. Only
//! rows that have all these parts in their names are run, for S simulated seconds, 600 where it is not given. It fails where a row does.

use std::fs;
use std::process::ExitCode;
use std::time::Instant;

use crate::cases::long_runs::full;
use crate::support::report_folder;

/// Simulated, s.
const SECONDS: f64 = 600.0;

pub fn main(arguments: &[String]) -> ExitCode {
    let mut seconds = SECONDS;
    let mut parts = Vec::new();
    let mut list = false;
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--list" => list = true,
            "--seconds" => {
                let Some(given) = arguments.next().and_then(|given| given.parse().ok()) else {
                    eprintln!("--seconds: a number must follow");
                    return ExitCode::FAILURE;
                };
                seconds = given;
            }
            part => parts.push(part.to_lowercase()),
        }
    }
    let mut rows = full();
    rows.retain(|row| {
        let name = row.to_string().to_lowercase();
        parts.iter().all(|part| name.contains(part))
    });
    if list {
        rows.iter().for_each(|row| eprintln!("{row}"));
        return ExitCode::SUCCESS;
    }
    let path = report_folder().join("long_runs.md");
    let mut report = format!("# Long runs of {seconds} s\n\n");
    let mut failed = 0;
    for (index, row) in rows.iter().enumerate() {
        let start = Instant::now();
        let outcome = row.run(seconds);
        failed += usize::from(outcome.has_failed());
        let line = format!("{row}: {outcome}");
        eprintln!(
            "{}/{} {line} ({:.0} s)",
            index + 1,
            rows.len(),
            start.elapsed().as_secs_f64()
        );
        report += &format!("- {line}\n");
        let written = fs::create_dir_all(report_folder()).and_then(|()| fs::write(&path, &report));
        if let Err(error) = written {
            eprintln!("{}: {error}", path.display());
            return ExitCode::FAILURE;
        }
    }
    eprintln!("{}: {failed} of {} failed", path.display(), rows.len());
    if failed == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
