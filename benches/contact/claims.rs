//! Checks the contact figures of FIGURES.md against measurements.

use crate::report::{Report, Table};

/// Claims with the measured values and verdicts. No claim is about time, which depends on the machine.
#[derive(Default)]
pub struct Claims {
    rows: Vec<(String, String, bool)>,
}

impl Claims {
    pub fn claim(&mut self, claim: impl Into<String>, measured: String, holds: bool) {
        self.rows.push((claim.into(), measured, holds));
    }

    /// Claims that a value is at most a limit. NaN fails.
    pub fn at_most(&mut self, claim: impl Into<String>, value: f64, most: f64) {
        self.claim(claim, format!("{value:.3e}, at most {most:.3e}"), value <= most);
    }

    pub fn write(&self, report: &mut Report) {
        report.write("\n## What FIGURES.md says\n");
        let mut table = Table::new(&["claim", "measured", ""]);
        for (claim, measured, holds) in &self.rows {
            let verdict = if *holds { "holds" } else { "**FAILS**" };
            table.row(vec![claim.clone(), measured.clone(), verdict.into()]);
        }
        report.table(&table);
    }

    /// The claims that do not hold.
    pub fn failures(&self) -> Vec<&str> {
        let failed = self.rows.iter().filter(|row| !row.2);
        failed.map(|row| row.0.as_str()).collect()
    }
}
