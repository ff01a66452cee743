//! The engines: how each is started, and with which settings each scene is simulated.

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

pub use process::{Played, Said, play};
pub use serve::{Player, Settings, processor_seconds};
pub use sinew::SinewPlayer;

/// An engine, or a part of one that is set up alike.
pub struct Engine {
    pub name: &'static str,
    /// Of its lines in pictures.
    pub color: &'static str,
    /// The program and its first arguments; an error says why it cannot be there. What has to be compiled first is.
    pub program: fn() -> Result<Vec<PathBuf>, String>,
    /// What is tried; an error says why it cannot simulate this.
    pub lines: fn(&Scene) -> Result<Vec<Line>, String>,
    /// What a reader should know.
    pub notes: &'static str,
}

/// One way to set an engine up, from coarse to fine.
pub struct Line {
    pub name: String,
    pub law: Law,
    /// Each a point: settings as `name=value`.
    pub points: Vec<Vec<String>>,
}

impl Line {
    /// A line whose frames are cut in twice as many parts from point to point.
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

/// Everyone.
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

/// Whether a player that knows one body beside a ball at most can have this.
fn has_one_body(scene: &Scene) -> Result<(), String> {
    let Model { has_floor, ball, .. } = scene.model;
    let is_pressed = ball.is_some_and(|ball| ball.speed != 0.0);
    match has_floor || is_pressed || scene.model.body_count() > 1 {
        true => Err("this player sets up one body and a fixed ball alone".into()),
        false => Ok(()),
    }
}

/// This program, as one of the engines that are built in.
fn built_in(engine: &str) -> Result<Vec<PathBuf>, String> {
    let this = std::env::current_exe().map_err(|error| error.to_string())?;
    Ok(vec![this, "player".into(), engine.into()])
}

/// Is one of the engines that are built in: `player <engine> <model> <positions> <settings>`.
pub fn serve(arguments: &[String]) {
    let (engine, arguments) = arguments.split_first().expect("an engine");
    match engine.as_str() {
        "sinew" => serve::serve::<sinew::SinewPlayer>(arguments),
        "rapier" => serve::serve::<rapier::RapierPlayer>(arguments),
        other => panic!("{other} is not built in"),
    }
}
