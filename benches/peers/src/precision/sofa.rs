//! Compares sinew with times per step published by SOFA's authors.

use std::fmt::Write;

use crate::players::{Player, Settings, SinewPlayer, processor_seconds};
use crate::precision::implicit_euler;
use crate::precision::law::Law;
use crate::precision::model::Model;
use crate::precision::motion::{Motion, relative_difference};
use crate::precision::summary::number;
use crate::scenes::{SofaBeam, sofa_beams};

/// Duration of a step [s].
const STEP: f64 = 0.01;

/// A beam with one setting of sinew.
pub struct Row {
    nodes: [usize; 3],
    published: f64,
    settings: &'static str,
    /// Time of one thread per step of 10 ms [ms].
    milliseconds: f64,
    /// Error against converged implicit Euler steps, relative to the motion.
    error: f64,
}

/// The name of a setting, and its values.
type Setting = (&'static str, &'static [(&'static str, &'static str)]);

const SETTINGS: [Setting; 7] = [
    ("`iterations` 1", &[("iterations", "1")]),
    ("`iterations` 2", &[("iterations", "2")]),
    ("`iterations` 4", &[("iterations", "4")]),
    ("`iterations` 8", &[("iterations", "8")]),
    ("`iterations` 16", &[("iterations", "16")]),
    ("defaults", &[]),
    ("`accuracy` 1e-4", &[("accuracy", "1e-4")]),
];

/// Measures both beams with every setting.
pub fn measure() -> Vec<Row> {
    let mut rows = Vec::new();
    for (beam, steps) in sofa_beams().iter().zip([20, 4]) {
        eprintln!("SOFA's beam of {:?} nodes: reference of {steps} steps", beam.nodes);
        let reference = implicit_euler::steps(&beam.model, Law::SignedVolume, STEP, steps);
        for (name, settings) in SETTINGS {
            match row(beam, &reference, settings, name) {
                Ok(row) => {
                    eprintln!("  {name}: {:.2} ms, {:.2e}", row.milliseconds, row.error);
                    rows.push(row);
                }
                Err(reason) => eprintln!("  {name}: {reason}"),
            }
        }
    }
    rows
}

fn row(beam: &SofaBeam, reference: &Motion, settings: &[(&str, &str)], name: &'static str) -> Result<Row, String> {
    let fixed = [("solver", "implicit"), ("order", "1")];
    let settings = Settings::new(fixed.iter().chain(settings));
    let frames = reference.frames.len();
    // The first run measures the error. The time is that of a longer run, since steps far from rest cost as much as
    // later ones.
    let (motion, _) = run(&beam.model, &settings, frames)?;
    let (_, mut times) = run(&beam.model, &settings, 40)?;
    times.sort_unstable_by(f64::total_cmp);
    Ok(Row {
        nodes: beam.nodes,
        published: beam.published,
        settings: name,
        milliseconds: times[times.len() / 2],
        error: relative_difference(&motion, reference),
    })
}

/// The motion, and the time of each step [ms].
fn run(model: &Model, settings: &Settings, steps: usize) -> Result<(Motion, Vec<f64>), String> {
    let mut player = SinewPlayer::build(model, settings)?;
    let (mut frames, mut times) = (Vec::new(), Vec::new());
    for _ in 0..steps {
        let start = processor_seconds();
        player.step(STEP as f32)?;
        times.push((processor_seconds() - start) * 1e3);
        let position = |node| player.position(node).map(f64::from);
        frames.push((0..model.positions.len()).map(position).collect());
    }
    Ok((Motion::new(model.positions.clone(), frames), times))
}

/// The section of the report.
pub fn markdown(rows: &[Row]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let mut text = String::from(
        "## Comparison with SOFA's published times\n\nBeams of tetrahedra, implicit Euler, steps of 10 ms. SOFA's times are its authors' on their \
         machine; its error is not published. sinew: IMPLICIT, `order` 1, one thread, median of 40 steps; its error is relative to \
         implicit Euler steps that are solved in double precision, so that it excludes the time discretization.\n\n\
         | nodes | SOFA, ms | sinew | ms | times as fast | error |\n|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let [x, y, z] = row.nodes;
        let _ = writeln!(
            text,
            "| {x} x {y} x {z} | {} | {} | {} | {} | {:.1e} |",
            row.published,
            row.settings,
            number(row.milliseconds),
            number(row.published / row.milliseconds),
            row.error
        );
    }
    text.push('\n');
    text
}
