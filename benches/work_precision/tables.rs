//! The tables and the diagram of a scene's motion.

use crate::contender::{Method, Setup};
use crate::motion::{Point, Sweep};
use crate::reference::Reference;
use crate::report::{Report, Table, digits, milliseconds};
use crate::scene::Scene;
use crate::summary::{error_in, measured, time_for};
use crate::svg::{Series, plot};

/// Frames per second.
const FRAMES: f64 = 60.0;

pub fn write(report: &mut Report, scene: &Scene, reference: &Reference, sweeps: &[Sweep]) {
    let series: Vec<Series> = sweeps.iter().map(series).collect();
    let title = format!("{}: work and precision", scene.name);
    let svg = plot(
        &title,
        "error, RMS over RMS of the motion",
        "s per simulated s",
        &series,
    );
    report.plot(&format!("work_precision_{}.svg", scene.name), &title, svg);
    report.table(&summary(reference, sweeps));
    report.table(&points(sweeps));
}

/// The points that did not fail; how many did is said in the name.
fn series(sweep: &Sweep) -> Series {
    let Ok(points) = &sweep.points else {
        return Series {
            name: sweep.line.name.clone(),
            points: Vec::new(),
            dashed: false,
        };
    };
    let failed = points.iter().filter(|point| point.outcome.is_err()).count();
    let name = match failed {
        0 => sweep.line.name.clone(),
        failed => format!("{} ({failed} failed)", sweep.line.name),
    };
    Series {
        name,
        points: points
            .iter()
            .filter_map(measured)
            .map(|point| (point.error, point.seconds))
            .collect(),
        dashed: matches!(points.first(), Some(point) if !matches!(point.setup.method, Method::Sinew(_))),
    }
}

/// What each family of lines needs and leaves.
fn summary(reference: &Reference, sweeps: &[Sweep]) -> Table {
    let mut table = Table::new(&[
        "solver, at its best",
        "s/s for 10 %",
        "1 %",
        "0.1 %",
        "error in 1 ms a frame",
        "in 16 ms",
    ]);
    let mut families: Vec<&str> = sweeps.iter().map(|sweep| sweep.line.family).collect();
    families.dedup();
    for family in families {
        let lines: Vec<&Sweep> = sweeps.iter().filter(|sweep| sweep.line.family == family).collect();
        let mut row = vec![family.to_owned()];
        if lines.iter().all(|line| line.points.is_err()) {
            row.extend(vec!["not offered".to_owned(); 5]);
        } else {
            let time = |error| match time_for(&lines, error) {
                _ if error < reference.uncertainty => "unresolved".into(),
                None => "never".into(),
                Some(seconds) => digits(seconds),
            };
            let error = |milliseconds: f64| error_in(&lines, 1e-3 * milliseconds * FRAMES).map_or("-".into(), percent);
            row.extend([0.1, 0.01, 0.001].map(time));
            row.extend([1.0, 16.0].map(error));
        }
        table.row(row);
    }
    table
}

fn points(sweeps: &[Sweep]) -> Table {
    let mut table = Table::new(&[
        "solver",
        "h, ms",
        "iterations",
        "error",
        "s/s",
        "ns per spring and step",
        "times real time",
        "energy drift",
        "prepared in, ms",
        "status",
    ]);
    for sweep in sweeps {
        match &sweep.points {
            Ok(points) => points.iter().for_each(|point| table.row(row(&sweep.line.name, point))),
            Err(_) => {
                let mut row = vec![sweep.line.name.clone()];
                row.extend(vec!["-".to_owned(); 8]);
                row.push("not offered".to_owned());
                table.row(row);
            }
        }
    }
    table
}

fn row(name: &str, point: &Point) -> Vec<String> {
    let mut row = vec![name.to_owned(), milliseconds(point.step), iterations(&point.setup)];
    match &point.outcome {
        Ok(measured) => row.extend([
            percent(measured.error),
            digits(measured.seconds),
            digits(1e9 * measured.per_spring),
            digits(1.0 / measured.seconds),
            format!("{:+.1e}", measured.drift),
        ]),
        Err(_) => row.extend(vec!["-".to_owned(); 5]),
    }
    row.push(milliseconds(point.preparation));
    row.push(match &point.outcome {
        Ok(_) => "ok".to_owned(),
        Err(reason) => format!("failed: {reason}"),
    });
    row
}

pub fn iterations(setup: &Setup) -> String {
    match setup.iterations {
        0 => "1".into(),
        iterations => iterations.to_string(),
    }
}

/// An error, three digits.
pub fn percent(error: f64) -> String {
    match 100.0 * error {
        percent if percent < 0.01 => format!("{percent:.1e} %"),
        percent => format!("{} %", digits(percent)),
    }
}
