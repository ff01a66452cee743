//! One table over all scenes: the time that each method needs for an error. FIGURES.md contains it.

use crate::motion::Sweep;
use crate::reference::Reference;
use crate::report::{Report, Table};
use crate::summary::{families, times};

/// Each scene adds a column.
#[derive(Default)]
pub struct Overview {
    scenes: Vec<&'static str>,
    /// For each family, one cell per scene.
    rows: Vec<(&'static str, Vec<String>)>,
}

impl Overview {
    pub fn add(&mut self, scene: &'static str, reference: &Reference, sweeps: &[Sweep]) {
        self.scenes.push(scene);
        for (family, lines) in families(sweeps) {
            let cell = times(reference, &lines).join(" / ");
            match self.rows.iter_mut().find(|(name, _)| *name == family) {
                Some((_, cells)) => cells.push(cell),
                None => self.rows.push((family, vec![cell])),
            }
        }
    }

    pub fn write(&self, report: &mut Report) {
        if self.scenes.is_empty() {
            return;
        }
        report.write("\n## All scenes\n\nSeconds per simulated second for an error of 10 % / 1 % / 0.1 %.\n");
        let header: Vec<&str> = ["solver"].iter().chain(&self.scenes).copied().collect();
        let mut table = Table::new(&header);
        for (family, cells) in &self.rows {
            table.row(
                [(*family).to_owned()]
                    .into_iter()
                    .chain(cells.iter().cloned())
                    .collect(),
            );
        }
        report.table(&table);
    }
}
