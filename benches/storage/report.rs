//! Reports: a file in `target/report`, and progress lines.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub struct Report {
    name: &'static str,
    start: Instant,
    text: String,
    not_offered: BTreeMap<String, String>,
    plots: Vec<(String, String)>,
    waited: f64,
}

impl Report {
    /// Creates the report `target/report/<name>.md`.
    pub fn new(name: &'static str) -> Self {
        Self {
            name,
            start: Instant::now(),
            text: String::new(),
            not_offered: BTreeMap::new(),
            plots: Vec::new(),
            waited: 0.0,
        }
    }

    pub fn progress(&self, line: &str) {
        eprintln!("[{:6.1} s] {line}", self.start.elapsed().as_secs_f64());
    }

    pub fn write(&mut self, text: &str) {
        eprint!("{text}");
        self.text.push_str(text);
    }

    /// Prints once, clearly visible, a feature that this version or this machine does not have.
    pub fn not_offered(&mut self, feature: &str, reason: &str) {
        if self.not_offered.insert(feature.to_owned(), reason.to_owned()).is_none() {
            eprintln!("!! NOT OFFERED: {feature}: {reason}");
        }
    }

    /// Records the fraction of a measurement's time in which the machine ran other programs.
    pub fn disturbed(&mut self, waited: f64) {
        self.waited = self.waited.max(waited);
    }

    /// Adds a plot file and shows it in the report.
    pub fn plot(&mut self, file: &str, title: &str, svg: String) {
        self.plots.push((file.to_owned(), svg));
        self.write(&format!("\n![{title}]({file})\n"));
    }

    pub fn table(&mut self, table: &Table) {
        self.write(&table.to_string());
    }

    /// Writes the report and its plots to `target/report`.
    pub fn finish(mut self) -> std::io::Result<PathBuf> {
        let mut missing = String::from("\n## Not offered\n\n");
        for (feature, reason) in &self.not_offered {
            let _ = writeln!(missing, "- **{feature}**: {reason}");
        }
        if self.not_offered.is_empty() {
            missing.push_str("Nothing: all requested measurements were made.\n");
        }
        if self.waited > 0.05 {
            let _ = write!(
                missing,
                "\n**The machine was busy**: for up to {:.0} % of the time it ran other programs. Times on two threads are not \
                 reliable, and others include the effects of shared caches and memory.\n",
                100.0 * self.waited
            );
        }
        self.write(&missing);
        self.progress("done");
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("report");
        std::fs::create_dir_all(&folder)?;
        for (file, svg) in &self.plots {
            std::fs::write(folder.join(file), svg)?;
        }
        let path = folder.join(self.name).with_extension("md");
        std::fs::write(&path, &self.text)?;
        Ok(path)
    }
}

/// A Markdown table.
pub struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    pub fn new(header: &[&str]) -> Self {
        Self {
            rows: vec![header.iter().map(|&cell| cell.to_owned()).collect()],
        }
    }

    pub fn row(&mut self, cells: Vec<String>) {
        assert_eq!(cells.len(), self.rows[0].len(), "a cell for each column");
        self.rows.push(cells);
    }
}

impl std::fmt::Display for Table {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        let width = |column: usize| {
            self.rows
                .iter()
                .map(|row| row[column].chars().count())
                .max()
                .unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.rows[0].len()).map(width).collect();
        writeln!(out)?;
        for (index, row) in self.rows.iter().enumerate() {
            for (cell, &width) in row.iter().zip(&widths) {
                write!(out, "| {cell:>width$} ")?;
            }
            writeln!(out, "|")?;
            if index == 0 {
                for &width in &widths {
                    write!(out, "|{}:", "-".repeat(width + 1))?;
                }
                writeln!(out, "|")?;
            }
        }
        Ok(())
    }
}

/// Formats seconds as milliseconds, three digits.
pub fn milliseconds(seconds: f64) -> String {
    digits(1e3 * seconds)
}

/// Formats a number with three digits.
pub fn digits(value: f64) -> String {
    match value.abs() {
        size if !size.is_finite() => "-".into(),
        size if size >= 99.95 => format!("{value:.0}"),
        size if size >= 9.995 => format!("{value:.1}"),
        size if size >= 0.9995 => format!("{value:.2}"),
        size if size >= 0.0995 => format!("{value:.3}"),
        _ => format!("{value:.4}"),
    }
}

/// Formats bytes in megabytes of 10^6.
pub fn megabytes(bytes: usize) -> String {
    digits(bytes as f64 * 1e-6)
}

/// Formats a number of nodes in short form.
pub fn count(nodes: usize) -> String {
    match nodes {
        0..1_000 => nodes.to_string(),
        1_000..10_000 => format!("{:.1}K", nodes as f64 * 1e-3),
        _ => format!("{:.0}K", nodes as f64 * 1e-3),
    }
}
