//! The tables and the diagram of a scene's motion.

use sinew::Solver;

use crate::contender::{Method, Setup};
use crate::motion::{Missing, Point, Sweep};
use crate::reference::Reference;
use crate::report::{Report, Table, digits, milliseconds};
use crate::scene::Scene;
use crate::summary::{error_in, families, measured, times};
use crate::svg::{Series, plot};

/// Frames per second.
const FRAMES: f64 = 60.0;

/// Error ranges of the two diagrams of a scene; they overlap, so that lines can be followed.
const RANGES: [(&str, &str, [f64; 2]); 2] = [("", "loose", [5e-3, 2.0]), ("_tight", "tight", [0.0, 2e-2])];

pub fn write(report: &mut Report, scene: &Scene, reference: &Reference, sweeps: &[Sweep]) {
    for (suffix, name, range) in RANGES {
        let series: Vec<Series> = sweeps.iter().filter_map(|sweep| series(sweep, range)).collect();
        let title = format!("{}: work and precision, {name}", scene.name);
        let svg = plot(
            &title,
            "error, RMS over RMS of the motion",
            "s per simulated s",
            &series,
        );
        report.plot(&format!("work_precision_{}{suffix}.svg", scene.name), &title, svg);
    }
    report.table(&summary(reference, sweeps));
    report.table(&points(sweeps));
}

/// The points of a line with errors in this range. The name states failed and too slow points. Lines without points in
/// the range are omitted.
fn series(sweep: &Sweep, [low, high]: [f64; 2]) -> Option<Series> {
    let no_points = Vec::new();
    let all = sweep.points.as_ref().unwrap_or(&no_points);
    let failed = all
        .iter()
        .filter(|point| matches!(point.outcome, Err(Missing::Failed(_))))
        .count();
    let slow = all
        .iter()
        .filter(|point| matches!(point.outcome, Err(Missing::TooSlow(_))))
        .count();
    let visible: Vec<(f64, f64)> = (all.iter().filter_map(measured))
        .filter(|point| (low..=high).contains(&point.error))
        .map(|point| (point.error, point.seconds))
        .collect();
    if visible.is_empty() && all.iter().any(|point| point.outcome.is_ok()) {
        return None;
    }
    let name = &sweep.line.name;
    let name = match (&sweep.points, failed, slow) {
        (Err(_), ..) => format!("{name} (not offered)"),
        (_, 0, _) if !visible.is_empty() => name.clone(),
        (_, 0, slow) => format!("{name} ({slow} too slow)"),
        (_, failed, _) => format!("{name} ({failed} failed)"),
    };
    Some(Series {
        name,
        points: visible,
        dashed: matches!(sweep.line.setups.first(), Some(setup) if !matches!(setup.method, Method::Sinew(_))),
    })
}

/// The time of each family of lines for an error, and its error in a time.
fn summary(reference: &Reference, sweeps: &[Sweep]) -> Table {
    let mut table = Table::new(&[
        "solver, at its best",
        "s/s for 10 %",
        "1 %",
        "0.1 %",
        "error in 1 ms a frame",
        "in 16 ms",
    ]);
    for (family, lines) in families(sweeps) {
        let mut row = vec![family.to_owned()];
        if lines.iter().all(|line| line.points.is_err()) {
            row.extend(vec!["not offered".to_owned(); 5]);
        } else {
            let error = |milliseconds: f64| error_in(&lines, 1e-3 * milliseconds * FRAMES).map_or("-".into(), percent);
            row.extend(times(reference, &lines));
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
        "position error",
        "force error",
        "volume error",
        "energy drift",
        "s/s",
        "ns per spring and step",
        "times real time",
        "prepared in, ms",
        "status",
    ]);
    for sweep in sweeps {
        match &sweep.points {
            Ok(points) => points.iter().for_each(|point| table.row(row(&sweep.line.name, point))),
            Err(_) => {
                let mut row = vec![sweep.line.name.clone()];
                row.extend(vec!["-".to_owned(); 10]);
                row.push("not offered".to_owned());
                table.row(row);
            }
        }
    }
    table
}

fn row(name: &str, point: &Point) -> Vec<String> {
    let name = match point.setup.mass_scaling {
        0.0 => name.to_owned(),
        part => format!("{name}, {part:e}"),
    };
    let counted = point.outcome.as_ref().ok().and_then(|measured| measured.iterations);
    let mut row = vec![name, milliseconds(point.step), iterations(&point.setup, counted)];
    match &point.outcome {
        Ok(measured) => row.extend([
            percent(measured.error),
            percent(measured.force_error),
            measured.volume_error.map_or("-".into(), percent),
            format!("{:+.1e}", measured.drift),
            digits(measured.seconds),
            digits(1e9 * measured.per_spring),
            digits(1.0 / measured.seconds),
        ]),
        Err(_) => row.extend(vec!["-".to_owned(); 7]),
    }
    row.push(milliseconds(point.preparation));
    row.push(match &point.outcome {
        Ok(_) => "ok".to_owned(),
        Err(missing) => missing.to_string(),
    });
    row
}

/// Iterations per step: the average count, or the setting.
pub fn iterations(setup: &Setup, counted: Option<f64>) -> String {
    match (counted, setup.iterations, setup.method) {
        (Some(counted), 0, _) => digits(counted),
        (Some(counted), most, _) => format!("{} of {most}", digits(counted)),
        (None, 0, Method::Sinew(Solver::Implicit | Solver::Newton)) => "-".into(),
        (None, 0, _) => "1".into(),
        (None, iterations, _) => iterations.to_string(),
    }
}

/// An error in percent, three digits.
pub fn percent(error: f64) -> String {
    match 100.0 * error {
        percent if percent < 0.01 => format!("{percent:.1e} %"),
        percent => format!("{} %", digits(percent)),
    }
}
