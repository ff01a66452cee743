//! The contender's side of the [`protocol`](crate::protocol) in Rust.

use std::io::BufRead;
use std::time::Instant;

use crate::cloth::Cloth;
use crate::protocol::{Hello, Report, Steps};

/// A cloth in one of the engines.
pub trait Contender: Sized {
    /// Builds the cloth, or returns the reason that this engine does not support it.
    fn build(cloth: &Cloth, threads: usize) -> Result<Self, String>;
    /// Name and version of the engine.
    fn version() -> String;
    /// Takes one step.
    fn step(&mut self);
    /// The position of a node.
    fn position(&self, node: u32) -> [f32; 3];
}

/// Answers until the input ends.
pub fn serve<C: Contender>(cloth: &Cloth, threads: usize) {
    let before = memory("VmRSS:");
    let mut contender = match C::build(cloth, threads) {
        Ok(contender) => contender,
        Err(refused) => {
            return send(&Hello {
                version: None,
                refused: Some(refused),
            });
        }
    };
    send(&Hello {
        version: Some(C::version()),
        refused: None,
    });
    for line in std::io::stdin().lock().lines() {
        let line = line.expect("readable input");
        match line.strip_prefix("steps ") {
            Some(count) => send(&Steps {
                milliseconds: timed_steps(&mut contender, count.parse().expect("a number of steps")),
            }),
            None => send(&report(&contender, cloth, before)),
        }
    }
}

fn timed_steps(contender: &mut impl Contender, count: usize) -> Vec<f64> {
    let step = |_| {
        let start = Instant::now();
        contender.step();
        start.elapsed().as_secs_f64() * 1e3
    };
    (0..count).map(step).collect()
}

fn report(contender: &impl Contender, cloth: &Cloth, before: Option<u64>) -> Report {
    let resident = memory("VmRSS:");
    let peak_bytes = memory("VmHWM:");
    let shape = cloth.shape(|node| contender.position(node));
    let finite = |number: f64| shape.mean_stretch.is_finite().then_some(number);
    Report {
        body_bytes: resident.zip(before).map(|(now, before)| now.saturating_sub(before)),
        peak_bytes,
        mean_stretch: finite(shape.mean_stretch),
        max_stretch: finite(shape.max_stretch),
        mean_height: finite(shape.mean_height),
    }
}

fn send(message: &impl serde::Serialize) {
    println!("{}", serde_json::to_string(message).expect("plain data"));
}

/// The value of a line of `/proc/self/status` [bytes]; `None` on other systems.
fn memory(name: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: u64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kibibytes * 1024)
}
