//! Time and memory of a step against the number of nodes. It measures the table and the figure of Halic, Kockara,
//! Bayrak, Rowe and Chen (section 4: table 3 and figure 8) for their three storages, and compares PACKED with the
//! limits of the processor.
//!
//! `cargo bench --bench storage [-- --quick] [--only a|b|c]` writes `target/report/storage.md` and plots.
#![allow(clippy::print_stderr)]

mod bodies;
mod clock;
mod fast_link;
mod features;
mod heap;
mod limits;
mod machine;
mod packed;
mod random;
mod report;
mod rounds;
mod scenes;
mod storages;
mod svg;

use report::Report;
use rounds::Effort;

/// The command-line options.
struct Options {
    quick: bool,
    /// A selection of the experiments a, b and c.
    experiments: String,
}

impl Options {
    fn from_arguments() -> Result<Self, String> {
        let mut options = Self {
            quick: false,
            experiments: "abc".into(),
        };
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                // Passed by cargo.
                "--bench" => {}
                "--quick" => options.quick = true,
                "--only" => match arguments.next() {
                    Some(letter) if ["a", "b", "c"].contains(&letter.as_str()) => options.experiments = letter,
                    other => return Err(format!("--only {other:?}: must be a, b or c")),
                },
                other => return Err(format!("{other}: there is --quick, and --only a|b|c")),
            }
        }
        Ok(options)
    }
}

fn main() -> std::process::ExitCode {
    let options = match Options::from_arguments() {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}");
            return std::process::ExitCode::FAILURE;
        }
    };
    let effort = if options.quick { Effort::QUICK } else { Effort::FULL };
    let mut report = Report::new("storage");
    report.write(&introduction(options.quick));
    let library = fast_link::Library::compile();
    if let Err(reason) = &library {
        report.not_offered("fast link in C", reason);
    }
    let library = library.ok();
    if options.experiments.contains('a') {
        storages::run(&mut report, effort, library.as_ref());
    }
    if options.experiments.contains('b') {
        packed::run(&mut report, effort, library.as_ref());
    }
    if options.experiments.contains('c') {
        features::run(&mut report, effort);
    }
    match report.finish() {
        Ok(path) => {
            eprintln!("report: {}", path.display());
            std::process::ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("the report could not be written: {error}");
            std::process::ExitCode::FAILURE
        }
    }
}

fn introduction(quick: bool) -> String {
    let mut text = format!("# Storages\n\n{}", machine::description());
    text.push_str(
        "- Times are the least over rounds in which all contenders of a size take turns: disturbances make them longer, \
         never shorter. Ratios are medians of the ratios within rounds. Work on one thread is measured in processor time of that thread, work on several threads in \
         wall time.\n",
    );
    if quick {
        text.push_str("- A quick run: few sizes, few rounds.\n");
    }
    text
}
