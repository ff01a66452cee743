//! The table of results.

use crate::report::{Report, Table};

#[derive(Default)]
pub struct Lines(Vec<Line>);

struct Line {
    what: String,
    expected: String,
    found: String,
    error: f64,
    target: f64,
    /// Why it misses its target, where that is known: such a line does not fail the bench.
    reason: &'static str,
}

impl Lines {
    /// A value and what it should be, in a unit; the error is a part of what was expected.
    pub fn value(&mut self, what: &str, [expected, found]: [f64; 2], unit: &str, target: f64, reason: &'static str) {
        let text = |value: f64| format!("{value:.4} {unit}").trim_end().to_owned();
        let error = (found / expected - 1.0).abs();
        self.error(what, [text(expected), text(found)], error, target, reason);
    }

    /// An error that is known as a part of what it should be compared with.
    pub fn error(&mut self, what: &str, [expected, found]: [String; 2], error: f64, target: f64, reason: &'static str) {
        self.0.push(Line {
            what: what.to_owned(),
            expected,
            found,
            error,
            target,
            reason,
        });
    }

    /// Lines that miss their target without a known reason.
    pub fn missed(&self) -> usize {
        self.0
            .iter()
            .filter(|line| !line.passes() && line.reason.is_empty())
            .count()
    }

    pub fn write(&self, report: &mut Report) {
        report.write("\n## Results\n");
        let mut table = Table::new(&["what", "expected", "found", "error, %", "target, %", "passed"]);
        for line in &self.0 {
            let verdict = if line.passes() {
                "yes".into()
            } else {
                format!("**no** {}", line.reason)
            };
            table.row(vec![
                line.what.clone(),
                line.expected.clone(),
                line.found.clone(),
                format!("{:.3}", 100.0 * line.error),
                format!("{}", 100.0 * line.target),
                verdict.trim_end().into(),
            ]);
        }
        report.table(&table);
    }
}

impl Line {
    /// Not where the error is no number.
    fn passes(&self) -> bool {
        self.error <= self.target
    }
}
