//! The engines: how each is started, and its settings for each scene.

mod bullet;
mod mujoco;
mod newton;
mod pbat;
mod process;
mod pypbd;
mod python;
mod rapier;
mod serve;
mod sinew;

use std::path::PathBuf;

use crate::precision::law::Law;
use crate::precision::model::Model;
use crate::scenes::Scene;

pub use process::{Messages, Played, play};
pub use serve::{Player, Settings, processor_seconds};
pub use sinew::SinewPlayer;

/// An engine, or a part of one with the same setup.
pub struct Engine {
    pub name: &'static str,
    /// Color of its lines in diagrams.
    pub color: &'static str,
    /// Returns the program and its first arguments; compiles the program if necessary. An error is the reason that it
    /// is not available.
    pub program: fn() -> Result<Vec<PathBuf>, String>,
    /// The lines to measure, or the reason that the engine cannot simulate the scene.
    pub lines: fn(&Scene) -> Result<Vec<Line>, String>,
    /// Notes for readers of the report.
    pub notes: &'static str,
}

/// One configuration of an engine, from coarse to fine.
pub struct Line {
    pub name: String,
    pub law: Law,
    /// The points, each with settings as `name=value`.
    pub points: Vec<Vec<String>>,
}

impl Line {
    /// A line that doubles the number of substeps per frame from point to point.
    pub fn doubling(name: &str, law: Law, settings: &[&str], first: u32, last: u32) -> Self {
        let counts = std::iter::successors(Some(first), |count| Some(2 * count)).take_while(|&count| count <= last);
        let point = |count| {
            let fixed = settings.iter().map(|setting| (*setting).to_string());
            fixed.chain([format!("substeps={count}")]).collect()
        };
        Self {
            name: name.into(),
            law,
            points: counts.map(point).collect(),
        }
    }
}

/// All engines.
pub fn all() -> Vec<Engine> {
    vec![
        sinew::engine(),
        rapier::engine(),
        bullet::engine(),
        mujoco::engine(),
        pbat::engine(),
        newton::engine(),
        pypbd::engine(),
    ]
}

/// Refuses scenes that need more than one body beside a fixed ball.
fn has_one_body(scene: &Scene) -> Result<(), String> {
    let Model { has_floor, ball, .. } = scene.model;
    let is_pressed = ball.is_some_and(|ball| ball.speed != 0.0);
    match has_floor || is_pressed || scene.model.body_count() > 1 {
        true => Err("this player only supports one body and a fixed ball".into()),
        false => Ok(()),
    }
}

/// This program as one of the built-in engines.
fn built_in(engine: &str) -> Result<Vec<PathBuf>, String> {
    let this = std::env::current_exe().map_err(|error| error.to_string())?;
    Ok(vec![this, "player".into(), engine.into()])
}

/// Runs as one of the built-in engines: `player <engine> <model> <positions> <settings>`.
pub fn serve(arguments: &[String]) {
    let (engine, arguments) = arguments.split_first().expect("an engine");
    match engine.as_str() {
        "sinew" => serve::serve::<sinew::SinewPlayer>(arguments),
        "rapier" => serve::serve::<rapier::RapierPlayer>(arguments),
        other => panic!("{other} is not built in"),
    }
}
