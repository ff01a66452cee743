//! The table of long runs, all of it: hours.
//!
//! `cargo bench --bench stability -- long [parts of a row's name] [--not PART] [--seconds S] [--minutes M] [--quick] [--list]` writes
//! `target/report/long_runs.md` as it goes. Only rows that have all these parts in their names are run, and none of those after `--not`,
//! each for S simulated seconds, 600 where it is not given, and no longer than M minutes of processor time, 10. It fails where a row does.
//!
//! `--quick` takes the rows that `cargo test` takes, for as long as it does. `--list` shows the rows. `cargo bench --profile dev ...` takes the library as tests do.

use std::fs;
use std::process::ExitCode;
use std::time::Instant;

use crate::cases::long_runs::{Outcome, Row, full, quick};
use crate::support::report_folder;

/// What is asked for.
struct Asked {
    parts: Vec<String>,
    others: Vec<String>,
    /// Simulated, s.
    seconds: f64,
    /// Of processor time at the most.
    minutes: f64,
    quick: bool,
    list: bool,
}

impl Asked {
    fn of(arguments: &[String]) -> Result<Self, String> {
        let mut asked = Self {
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
                "--quick" => asked.quick = true,
                "--list" => asked.list = true,
                "--not" => asked.others.push(word()?.to_lowercase()),
                "--seconds" => asked.seconds = number()?,
                "--minutes" => asked.minutes = number()?,
                part => asked.parts.push(part.to_lowercase()),
            }
        }
        Ok(asked)
    }

    /// The rows, and for how many simulated seconds.
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
    let failed = Asked::of(arguments).and_then(|asked| {
        let rows = asked.rows();
        if asked.list {
            rows.iter().for_each(|(row, _)| eprintln!("{row}"));
            return Ok(0);
        }
        run(&asked, &rows)
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

/// Runs the rows; how many failed.
fn run(asked: &Asked, rows: &[(Row, f64)]) -> Result<usize, String> {
    let path = report_folder().join("long_runs.md");
    let mut report = format!("# Long runs\n\n| row | {}\n", Outcome::HEADS);
    report += &format!("|---|{}\n", "---|".repeat(Outcome::HEADS.matches('|').count()));
    let mut failed = 0;
    for (index, (row, seconds)) in rows.iter().enumerate() {
        let number = format!("{}/{} {row}", index + 1, rows.len());
        let (start, mut told) = (Instant::now(), Instant::now());
        let outcome = row.run(*seconds, 60.0 * asked.minutes, &mut |figures| {
            if told.elapsed().as_secs() >= 10 {
                told = Instant::now();
                let rate = figures.time / start.elapsed().as_secs_f64();
                eprintln!(
                    "{number}: {:.0} of {} s, {rate:.1} times real time",
                    figures.time, asked.seconds
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
