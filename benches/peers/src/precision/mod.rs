//! Error against time of every engine in every scene, at 60 frames per second.

mod contact;
mod follow;
mod implicit_euler;
pub mod law;
pub mod model;
pub mod motion;
mod picture;
mod reference;
mod sofa;
mod summary;
mod tables;

use std::collections::HashMap;
use std::path::PathBuf;

use crate::contender::target;
use crate::players::{self, Engine, Line, Messages};
use crate::scenes::{self, Measure, Scene, tip_ratio};
use follow::follow;
use law::Law;
use motion::{Motion, relative_difference};
use reference::Reference;

/// The failure message of a player whose step is too long.
pub const DIVERGES: &str = "it diverges";

/// The options of the command.
pub struct Request {
    /// Processor time that a point may take per simulated second [s].
    pub limit: f64,
    /// Only scenes and engines whose names contain these; empty selects all.
    pub scene: String,
    pub engine: String,
}

/// A scene with the results of all engines.
pub struct Outcome {
    pub scene: Scene,
    pub references: Vec<(Law, f64, usize)>,
    pub theory: Option<f64>,
    pub engines: Vec<EngineOutcome>,
}

/// The results of an engine in a scene.
pub struct EngineOutcome {
    pub name: &'static str,
    pub color: &'static str,
    pub version: Option<String>,
    pub notes: Vec<String>,
    /// The results of its lines, or the reason that there are none.
    pub lines: Result<Vec<LineOutcome>, String>,
}

/// A line of points, and the reason of its end.
pub struct LineOutcome {
    pub name: String,
    pub law: Law,
    pub points: Vec<Point>,
    pub end: End,
}

impl LineOutcome {
    fn failed(line: &Line, reason: &str) -> Self {
        Self {
            name: line.name.clone(),
            law: line.law,
            points: Vec::new(),
            end: End::Failed(reason.into()),
        }
    }
}

/// A point of a diagram.
pub struct Point {
    pub settings: String,
    /// Time of one thread per simulated second [s].
    pub seconds: f64,
    /// Error relative to the motion.
    pub error: f64,
    /// Mean height of the nodes at the last frame [m].
    pub height: f64,
    /// See [`Motion::speed_at_end`] [m/s].
    pub speed: f64,
    /// See [`contact::energy_gain`].
    pub gain: f64,
}

/// The reason that a line has no further points.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// The error of its last point is small enough.
    Reached,
    /// The errors of its last points no longer decrease.
    Flat,
    /// The next point would exceed the limit; its time per simulated second [s].
    Limit(f64),
    /// All of its settings were measured.
    Tried,
    /// Every point failed, with the reason.
    Failed(String),
}

/// Runs all scenes and engines, and writes tables and diagrams to `target/report`.
pub fn compare(request: &Request) {
    let programs: Vec<(Engine, Result<Vec<PathBuf>, String>)> = players::all()
        .into_iter()
        .filter(|engine| engine.name.to_lowercase().contains(&request.engine))
        .map(|engine| {
            let program = (engine.program)();
            (engine, program)
        })
        .collect();
    let mut outcomes = Vec::new();
    for scene in scenes::all() {
        if !scene.name.contains(&request.scene) {
            continue;
        }
        // Checks are not timed, so a short limit is enough.
        let factor = if scene.measure == Measure::Check { 0.1 } else { 1.0 };
        let limit = factor * request.limit;
        outcomes.push(simulate(scene, &programs, limit));
        // Written after each scene, so that an interrupted run has results.
        report(&outcomes, &programs, &[]);
    }
    let beams = if "sofa".contains(&request.scene) {
        sofa::measure()
    } else {
        Vec::new()
    };
    report(&outcomes, &programs, &beams);
}

fn report(outcomes: &[Outcome], programs: &[(Engine, Result<Vec<PathBuf>, String>)], beams: &[sofa::Row]) {
    let folder = target().join("report");
    let notes: Vec<(&str, &str)> = programs.iter().map(|(engine, _)| (engine.name, engine.notes)).collect();
    let mut files = vec![
        ("engines.md".to_string(), tables::markdown(outcomes, &notes, beams)),
        ("engines.csv".to_string(), tables::csv(outcomes)),
        ("engines.svg".to_string(), picture::overview(outcomes)),
    ];
    for outcome in outcomes.iter().filter(|outcome| tables::is_timed(outcome)) {
        let file = format!("engines_{}.svg", outcome.scene.name.replace(' ', "_"));
        files.push((file, picture::scene(outcome)));
    }
    for (name, text) in files {
        let file = folder.join(name);
        if let Err(error) = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, text)) {
            eprintln!("{}: {error}", file.display());
        }
    }
}

fn simulate(scene: Scene, programs: &[(Engine, Result<Vec<PathBuf>, String>)], limit: f64) -> Outcome {
    let folder = target().join("peers/references");
    let _ = std::fs::create_dir_all(&folder);
    let mut references: HashMap<Law, Option<Reference>> = HashMap::new();
    let mut engines = Vec::new();
    for (engine, program) in programs {
        let mut outcome = EngineOutcome {
            name: engine.name,
            color: engine.color,
            version: None,
            notes: Vec::new(),
            lines: Ok(Vec::new()),
        };
        outcome.lines = program.clone().and_then(|program| {
            let lines = (engine.lines)(&scene)?;
            let play = |line: &Line| {
                if let Measure::Contact { size } = scene.measure {
                    let deepest = |motion: &Motion| contact::deepest(&scene.model, motion) / size;
                    return follow(&scene, engine.name, &program, line, &deepest, limit);
                }
                let reference = references.entry(line.law).or_insert_with(|| {
                    eprintln!("{}: reference, {}", scene.name, line.law.name());
                    reference::converged(&scene.model, line.law, &folder)
                });
                let Some(reference) = reference else {
                    return (
                        LineOutcome::failed(line, "its law has no converged reference here"),
                        Messages::default(),
                    );
                };
                let reference = measured(&scene, &reference.motion);
                let error = |motion: &Motion| relative_difference(&measured(&scene, motion), &reference);
                follow(&scene, engine.name, &program, line, &error, limit)
            };
            let mut outcomes = Vec::new();
            for (line, messages) in lines.iter().map(play) {
                outcome.version = messages.version.or(outcome.version.take());
                for note in messages.notes {
                    if !outcome.notes.contains(&note) {
                        outcome.notes.push(note);
                    }
                }
                outcomes.push(line);
            }
            Ok(outcomes)
        });
        if let Err(reason) = &outcome.lines {
            eprintln!("{}: {}: {reason}", scene.name, engine.name);
        }
        engines.push(outcome);
    }
    let mut theory = None;
    if scene.measure == Measure::Rest
        && let Some(Some(reference)) = references.get(&Law::SignedVolume)
    {
        theory = Some(tip_ratio(&scene.model, &reference.motion));
    }
    let sure = references.into_iter();
    let mut references: Vec<(Law, f64, usize)> = sure
        .filter_map(|(law, reference)| reference.map(|reference| (law, reference.doubt, reference.substeps)))
        .collect();
    references.sort_by_key(|(law, ..)| law.name());
    Outcome {
        scene,
        references,
        theory,
        engines,
    }
}

/// The part of a motion that the scene measures.
fn measured(scene: &Scene, motion: &Motion) -> Motion {
    match scene.measure {
        Measure::Rest => motion.end(),
        _ => motion.clone(),
    }
}
