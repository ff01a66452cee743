//! The table of results.

use crate::report::{Report, Table};

#[derive(Default)]
pub struct Lines(Vec<Line>);

struct Line {
    label: String,
    expected: String,
    result: String,
    error: f64,
    target: f64,
    /// The known reason for a missed target; a line with a reason does not fail the bench.
    reason: &'static str,
}

impl Lines {
    /// Adds a value with a unit and its expected value; the error is relative to the expected value.
    pub fn value(&mut self, label: &str, [expected, result]: [f64; 2], unit: &str, target: f64, reason: &'static str) {
        let text = |value: f64| format!("{value:.4} {unit}").trim_end().to_owned();
        let error = (result / expected - 1.0).abs();
        self.error(label, [text(expected), text(result)], error, target, reason);
    }

    /// Adds a relative error.
    pub fn error(
        &mut self,
        label: &str,
        [expected, result]: [String; 2],
        error: f64,
        target: f64,
        reason: &'static str,
    ) {
        self.0.push(Line {
            label: label.to_owned(),
            expected,
            result,
            error,
            target,
            reason,
        });
    }

    /// The number of lines that miss their target without a known reason.
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
                line.label.clone(),
                line.expected.clone(),
                line.result.clone(),
                format!("{:.3}", 100.0 * line.error),
                format!("{}", 100.0 * line.target),
                verdict.trim_end().into(),
            ]);
        }
        report.table(&table);
    }
}

impl Line {
    /// False if the error is NaN.
    fn passes(&self) -> bool {
        self.error <= self.target
    }
}
