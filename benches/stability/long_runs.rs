//! The complete table of long runs, which takes hours.
//!
//! `cargo bench --bench stability -- long [parts of a row's name] [--not PART] [--seconds S] [--minutes M] [--quick]
//! [--list]` writes `target/report/long_runs.md` while it runs. It runs only rows whose names contain all these parts,
//! and none of those after `--not`. Each row takes S simulated seconds (default 600), and at most M minutes of
//! processor time (default 10). It fails if a row fails.
//!
//! `--quick` runs the rows that `cargo test` runs, for the same time. `--list` prints the rows. `cargo bench --profile
//! dev ...` builds the library as the tests do.

use std::fs;
use std::process::ExitCode;
use std::time::Instant;

use crate::cases::long_runs::{Outcome, Row, full, quick};
use crate::support::report_folder;

/// The command-line options.
struct Options {
    parts: Vec<String>,
    others: Vec<String>,
    /// Simulated time [s].
    seconds: f64,
    /// Limit of processor time [min].
    minutes: f64,
    quick: bool,
    list: bool,
}

impl Options {
    fn of(arguments: &[String]) -> Result<Self, String> {
        let mut options = Self {
            parts: Vec::new(),
            others: Vec::new(),
            seconds: 600.0,
            minutes: 10.0,
            quick: false,
            list: false,
        };
        let mut arguments = arguments.iter();
        while let Some(argument) = arguments.next() {
            let mut word = || {
                arguments
                    .next()
                    .ok_or_else(|| format!("something must follow {argument}"))
            };
            let mut number = || word()?.parse().map_err(|_| format!("a number must follow {argument}"));
            match argument.as_str() {
                "--quick" => options.quick = true,
                "--list" => options.list = true,
                "--not" => options.others.push(word()?.to_lowercase()),
                "--seconds" => options.seconds = number()?,
                "--minutes" => options.minutes = number()?,
                part => options.parts.push(part.to_lowercase()),
            }
        }
        Ok(options)
    }

    /// The rows and their simulated times [s].
    fn rows(&self) -> Vec<(Row, f64)> {
        let mut rows = match self.quick {
            true => quick(),
            false => full().into_iter().map(|row| (row, self.seconds)).collect(),
        };
        rows.retain(|(row, _)| {
            let name = row.to_string().to_lowercase();
            self.parts.iter().all(|part| name.contains(part)) && !self.others.iter().any(|part| name.contains(part))
        });
        rows
    }
}

pub fn main(arguments: &[String]) -> ExitCode {
    let failed = Options::of(arguments).and_then(|options| {
        let rows = options.rows();
        if options.list {
            rows.iter().for_each(|(row, _)| eprintln!("{row}"));
            return Ok(0);
        }
        run(&options, &rows)
    });
    match failed {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the rows and returns the number of failures.
fn run(options: &Options, rows: &[(Row, f64)]) -> Result<usize, String> {
    let path = report_folder().join("long_runs.md");
    let mut report = format!("# Long runs\n\n| row | {}\n", Outcome::HEADS);
    report += &format!("|---|{}\n", "---|".repeat(Outcome::HEADS.matches('|').count()));
    let mut failed = 0;
    for (index, (row, seconds)) in rows.iter().enumerate() {
        let number = format!("{}/{} {row}", index + 1, rows.len());
        let (start, mut last_report) = (Instant::now(), Instant::now());
        let outcome = row.run(*seconds, 60.0 * options.minutes, &mut |figures| {
            if last_report.elapsed().as_secs() >= 10 {
                last_report = Instant::now();
                let rate = figures.time / start.elapsed().as_secs_f64();
                eprintln!(
                    "{number}: {:.0} of {} s, {rate:.1} times real time",
                    figures.time, options.seconds
                );
            }
        });
        failed += usize::from(outcome.has_failed());
        eprintln!("{number}: {outcome}, took {:.1} s", start.elapsed().as_secs_f64());
        report += &format!("| {row} | {}\n", outcome.cells());
        let written = fs::create_dir_all(report_folder()).and_then(|()| fs::write(&path, &report));
        written.map_err(|error| format!("{}: {error}", path.display()))?;
    }
    eprintln!("{}: {failed} of {} failed", path.display(), rows.len());
    Ok(failed)
}
