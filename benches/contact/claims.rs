//! What FIGURES.md says of contact, held against what was measured.

use crate::report::{Report, Table};

/// What is claimed, what was measured, and whether it holds. Never a time: those are the machine's.
#[derive(Default)]
pub struct Claims {
    rows: Vec<(String, String, bool)>,
}

impl Claims {
    pub fn claim(&mut self, what: impl Into<String>, measured: String, holds: bool) {
        self.rows.push((what.into(), measured, holds));
    }

    /// At most so much; what is not a number does not hold.
    pub fn at_most(&mut self, what: impl Into<String>, value: f64, most: f64) {
        self.claim(what, format!("{value:.3e}, at most {most:.3e}"), value <= most);
    }

    pub fn write(&self, report: &mut Report) {
        report.write("\n## What FIGURES.md says\n");
        let mut table = Table::new(&["claim", "measured", ""]);
        for (what, measured, holds) in &self.rows {
            let verdict = if *holds { "holds" } else { "**FAILS**" };
            table.row(vec![what.clone(), measured.clone(), verdict.into()]);
        }
        report.table(&table);
    }

    /// Those that do not hold.
    pub fn failures(&self) -> Vec<&str> {
        let failed = self.rows.iter().filter(|row| !row.2);
        failed.map(|row| row.0.as_str()).collect()
    }
}
