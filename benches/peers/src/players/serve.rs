//! The player's side: reads a model, simulates frame by frame, and writes positions to a file and times to its output.
//!
//! It prints `version <text>` and `note <text>` before the first frame, or `refused <why>`. After each frame it prints
//! `frame <processor seconds of stepping so far>`. The file contains the coordinates of all nodes as `f64`, frame after
//! frame.

use std::io::{BufWriter, Write};

use crate::precision::model::Model;

/// A model in a Rust engine.
pub trait Player: Sized {
    /// Builds the model, or returns the reason that this engine does not support it.
    fn build(model: &Model, settings: &Settings) -> Result<Self, String>;
    /// Name and version of the engine.
    fn version() -> String;
    /// Simulates one frame, or returns the reason of a failure.
    fn frame(&mut self) -> Result<(), String>;
    /// The position of a node.
    fn position(&self, node: usize) -> [f32; 3];
    /// A note for readers after the last frame.
    fn note(&self) -> Option<String> {
        None
    }
}

/// Settings as `name=value`.
pub struct Settings(Vec<(String, String)>);

impl Settings {
    /// Creates settings from names and values.
    pub fn new<'a>(settings: impl Iterator<Item = &'a (&'a str, &'a str)>) -> Self {
        Self(
            settings
                .map(|(name, value)| ((*name).into(), (*value).into()))
                .collect(),
        )
    }

    /// The number of a setting, if it is set.
    pub fn number(&self, name: &str) -> Option<f32> {
        self.word(name).map(|word| word.parse().expect("a number"))
    }

    /// The word of a setting, if it is set.
    pub fn word(&self, name: &str) -> Option<&str> {
        let is_it = |(key, _): &&(String, String)| key == name;
        self.0.iter().find(is_it).map(|(_, value)| value.as_str())
    }
}

/// Simulates all frames.
pub fn serve<P: Player>(arguments: &[String]) {
    let [model, positions, settings @ ..] = arguments else {
        panic!("a model, a file for positions, and settings");
    };
    let model = Model::from_text(&std::fs::read_to_string(model).expect("a model"));
    let split = |setting: &String| {
        let (name, value) = setting.split_once('=').expect("name=value");
        (name.to_string(), value.to_string())
    };
    let settings = Settings(settings.iter().map(split).collect());
    let mut player = match P::build(&model, &settings) {
        Ok(player) => player,
        Err(reason) => return println!("refused {reason}"),
    };
    println!("version {}", P::version());
    let mut file = BufWriter::new(std::fs::File::create(positions).expect("a file for positions"));
    let mut spent = 0.0;
    for _ in 0..model.frames {
        let start = processor_seconds();
        if let Err(reason) = player.frame() {
            return println!("refused {reason}");
        }
        spent += processor_seconds() - start;
        for node in 0..model.positions.len() {
            for number in player.position(node) {
                file.write_all(&f64::from(number).to_le_bytes())
                    .expect("room for positions");
            }
        }
        file.flush().expect("room for positions");
        println!("frame {spent}");
    }
    if let Some(note) = player.note() {
        println!("note {note}");
    }
}

/// Processor time of all threads of this process [s].
pub fn processor_seconds() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a timespec of this function.
    let failed = unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &raw mut time) };
    assert_eq!(failed, 0, "the processor time of this process is known");
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
