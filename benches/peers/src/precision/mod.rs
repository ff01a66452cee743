//! Error against time of every engine in every scene, at 60 frames a second.

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
use crate::players::{self, Engine, Line, Said};
use crate::scenes::{self, Measure, Scene, tip_ratio};
use follow::follow;
use law::Law;
use motion::{Motion, relative_difference};
use reference::Reference;

/// What a player is said to do whose step is too long.
pub const DIVERGES: &str = "it diverges";

/// What a command asks for.
pub struct Request {
    /// The processor's seconds that a point may take for a simulated second.
    pub limit: f64,
    /// Only scenes and engines whose name has this; empty: all.
    pub scene: String,
    pub engine: String,
}

/// A scene with what everyone did.
pub struct Outcome {
    pub scene: Scene,
    pub references: Vec<(Law, f64, usize)>,
    pub theory: Option<f64>,
    pub engines: Vec<EngineOutcome>,
}

/// An engine in a scene.
pub struct EngineOutcome {
    pub name: &'static str,
    pub color: &'static str,
    pub version: Option<String>,
    pub notes: Vec<String>,
    /// Or why there are none.
    pub lines: Result<Vec<LineOutcome>, String>,
}

/// A line of points, and how it ended.
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
    /// Of one thread, for a simulated second.
    pub seconds: f64,
    /// A part of the motion.
    pub error: f64,
    /// Of the nodes at the last frame, on the mean, m.
    pub height: f64,
    /// See [`Motion::speed_at_end`], m/s.
    pub speed: f64,
    /// See [`contact::energy_gain`].
    pub gain: f64,
}

/// Why a line has no further points.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// Its last point is near enough.
    Reached,
    /// Its last points are no nearer than those before.
    Flat,
    /// The next point would have taken so many seconds for a simulated second, above the limit.
    Limit(f64),
    /// All of its settings were tried.
    Tried,
    /// Every point failed, and why.
    Failed(String),
}

/// Runs everything and leaves tables and pictures in `target/report`.
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
        // Checks are not timed: a short look is enough.
        let part = if scene.measure == Measure::Check { 0.1 } else { 1.0 };
        let limit = part * request.limit;
        outcomes.push(simulate(scene, &programs, limit));
        // After each scene: a run that is cut short has measured something.
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
                        Said::default(),
                    );
                };
                let reference = measured(&scene, &reference.motion);
                let error = |motion: &Motion| relative_difference(&measured(&scene, motion), &reference);
                follow(&scene, engine.name, &program, line, &error, limit)
            };
            let mut outcomes = Vec::new();
            for (line, said) in lines.iter().map(play) {
                outcome.version = said.version.or(outcome.version.take());
                for note in said.notes {
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

/// The part of a motion that a scene asks for.
fn measured(scene: &Scene, motion: &Motion) -> Motion {
    match scene.measure {
        Measure::Rest => motion.end(),
        _ => motion.clone(),
    }
}
