//! The cost of contact: scenes with a tool and without, and tissue with contact and without, in one run.
//!
//! `cargo bench --bench touch [-- --quick] [-- --only NAME]` writes `target/report/touch.md`. A row steps the same body
//! twice, frame by frame of 1/60 s: once with a tool, once without. It reports processor time per frame (one thread),
//! their ratio and the slowest frame. It also reports the deepest penetration of nodes and of centers of faces, and the
//! force on the tools. `tissue.rs` has the second group of rows.
#![allow(clippy::print_stderr)]

#[path = "../storage/clock.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod clock;
mod scene;
mod scenes;
mod tissue;

use std::fmt::Write;
use std::process::ExitCode;

use scene::Scene;
use scenes::SCENES;

/// Frame times of a run [ms], sorted.
struct Frames(Vec<f64>);

impl Frames {
    fn new(mut times: Vec<f64>) -> Self {
        times.sort_by(f64::total_cmp);
        Self(times)
    }

    fn median(&self) -> f64 {
        self.0[self.0.len() / 2]
    }

    fn slowest(&self) -> f64 {
        self.0[self.0.len() - 1]
    }
}

/// The results of a run with a tool.
#[derive(Default)]
struct ToolResult {
    /// Deepest penetration of nodes and of face centers [m].
    nodes_inside: f64,
    faces_inside: f64,
    /// Mean force over the last quarter, and its largest change between frames [N].
    force: f64,
    jump: f64,
    substeps: u32,
}

/// Steps a scene. Returns the frame times from the first contact on, and the results.
fn run(mut scene: Scene, frames: usize, from: usize) -> Result<(Frames, ToolResult), sinew::Error> {
    let (mut times, mut outcome) = (Vec::new(), ToolResult::default());
    let mut forces: Vec<f64> = Vec::new();
    for frame in 0..frames {
        scene.act(frame)?;
        let mut result = Ok(());
        let elapsed = clock::time(|| result = scene.step().map(|substeps| outcome.substeps = substeps));
        result?;
        if frame >= from {
            times.push(1e3 * elapsed.processor);
            let [nodes, faces] = scene.deepest();
            outcome.nodes_inside = outcome.nodes_inside.max(nodes);
            outcome.faces_inside = outcome.faces_inside.max(faces);
        }
        if frame >= frames - frames / 4 {
            forces.push(scene.force());
        }
    }
    outcome.force = forces.iter().sum::<f64>() / forces.len().max(1) as f64;
    outcome.jump = forces
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .fold(0.0, f64::max);
    Ok((Frames::new(times), outcome))
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench")
        .collect();
    let is_quick = arguments.iter().any(|argument| argument == "--quick");
    let only = arguments.iter().position(|argument| argument == "--only");
    let only = only
        .and_then(|index| arguments.get(index + 1))
        .cloned()
        .unwrap_or_default();
    let mut report = String::from(
        "# Contact: the cost of a tool\n\nProcessor time of frames of 1/60 s, one thread.\n\n\
         | scene | without, ms | in contact, ms | ratio | slowest, ms | substeps without / in contact | nodes inside, mm | faces inside, mm | force, N | jump, N |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (name, make, touches, frames) in SCENES.iter().filter(|row| row.0.contains(&only)) {
        let frames = if is_quick { frames / 4 + touches } else { *frames };
        let row = (|| {
            let (without, alone) = run(make(false)?, frames, *touches)?;
            let (with, outcome) = run(make(true)?, frames, *touches)?;
            Ok::<_, sinew::Error>(format!(
                "| {name} | {:.3} | {:.3} | {:.1} | {:.3} | {} / {} | {:.3} | {:.3} | {:.4} | {:.1e} |",
                without.median(),
                with.median(),
                with.median() / without.median(),
                with.slowest(),
                alone.substeps,
                outcome.substeps,
                1e3 * outcome.nodes_inside,
                1e3 * outcome.faces_inside,
                outcome.force,
                outcome.jump,
            ))
        })();
        let row = row.unwrap_or_else(|error| format!("| {name} | refused: {error} |"));
        eprintln!("{row}");
        let _ = writeln!(report, "{row}");
    }
    tissue::report(&mut report, &only, is_quick);
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("target/report");
    if let Err(error) = std::fs::create_dir_all(&path).and_then(|()| std::fs::write(path.join("touch.md"), report)) {
        eprintln!("target/report/touch.md: {error}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
