//! The measuring side: starts a player, reads its frames, and stops it if it takes too long.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use crate::contender::target;
use crate::precision::DIVERGES;
use crate::precision::model::Model;
use crate::precision::motion::Motion;

/// The result of a run.
pub enum Played {
    /// All frames, and the processor time of stepping [s].
    Whole { motion: Motion, seconds: f64 },
    /// Stopped, since it would have exceeded the limit.
    Cut { expected: f64 },
    /// The engine did not complete it, and the reason.
    Refused(String),
}

/// Messages of a run.
#[derive(Default)]
pub struct Messages {
    pub version: Option<String>,
    pub notes: Vec<String>,
}

/// Time limit for starting and compiling a player [s].
const START: f64 = 120.0;

/// Number of frames before the estimate of the total time is used.
const TRUSTED: usize = 4;

/// Simulates `model` with `settings` in a separate process; `limit` is processor time [s].
pub fn play(program: &[std::path::PathBuf], model: &Model, settings: &[String], limit: f64) -> (Played, Messages) {
    let folder = target().join("peers/players");
    let mut messages = Messages::default();
    let played = run(&folder, program, model, settings, limit, &mut messages);
    (played.unwrap_or_else(Played::Refused), messages)
}

fn run(
    folder: &Path,
    program: &[std::path::PathBuf],
    model: &Model,
    settings: &[String],
    limit: f64,
    messages: &mut Messages,
) -> Result<Played, String> {
    let failed = |error: std::io::Error| error.to_string();
    std::fs::create_dir_all(folder).map_err(failed)?;
    let folder = folder.canonicalize().map_err(failed)?;
    let (file, positions) = (folder.join("model"), folder.join("positions"));
    std::fs::write(&file, model.text()).map_err(failed)?;
    std::fs::write(&positions, []).map_err(failed)?;
    let log = std::fs::File::create(folder.join("log")).map_err(failed)?;
    let mut process = Command::new(&program[0])
        .args(&program[1..])
        .args([&file, &positions])
        .args(settings)
        // Engines write logs and caches to their working directory.
        .current_dir(&folder)
        .envs([
            ("PYTHONDONTWRITEBYTECODE", "1"),
            ("OMP_NUM_THREADS", "1"),
            ("TBB_NUM_THREADS", "1"),
        ])
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(log)
        .spawn()
        .map_err(failed)?;
    let output = BufReader::new(process.stdout.take().expect("piped"));
    let (sender, receiver) = channel();
    let reader = std::thread::spawn(move || {
        for line in output.lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                break;
            }
        }
    });
    let (mut frames, mut seconds, mut refused, mut cut) = (0, 0.0, None, None);
    loop {
        // Other programs make a run take longer than its processor time.
        let patience = if frames == 0 { START + limit } else { 3.0 * limit };
        match receiver.recv_timeout(Duration::from_secs_f64(patience)) {
            Ok(line) => {
                let (word, rest) = line.split_once(' ').unwrap_or((&line, ""));
                match word {
                    "version" => messages.version = Some(rest.into()),
                    "note" => messages.notes.push(rest.into()),
                    "refused" => refused = Some(rest.to_string()),
                    "frame" => {
                        frames += 1;
                        seconds = rest.parse().unwrap_or(f64::INFINITY);
                    }
                    _ => {}
                }
                let expected = seconds / frames.max(1) as f64 * model.frames as f64;
                if seconds > limit || frames >= TRUSTED && expected > 1.5 * limit {
                    cut = Some(expected);
                }
            }
            Err(RecvTimeoutError::Timeout) => cut = Some(patience),
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if cut.is_some() && frames < model.frames {
            process.kill().map_err(failed)?;
            break;
        }
    }
    process.wait().map_err(failed)?;
    reader.join().map_err(|_| "its output could not be read")?;
    if let Some(reason) = refused {
        return Err(reason);
    }
    if frames < model.frames {
        return match cut {
            // Diverged runs are often slow; a finer step may be faster.
            Some(_) if has_diverged(&positions, model) => Err(DIVERGES.into()),
            Some(expected) => Ok(Played::Cut { expected }),
            None => Err(format!(
                "it ended after {frames} frames: {}",
                last_line(&folder.join("log"))
            )),
        };
    }
    let motion = read_motion(&positions, model).map_err(failed)?;
    match motion.frames.len() == model.frames && motion.is_finite() {
        true => Ok(Played::Whole { motion, seconds }),
        false => Err(DIVERGES.into()),
    }
}

/// True if the last written frame is far from the first.
fn has_diverged(positions: &Path, model: &Model) -> bool {
    let motion = read_motion(positions, model);
    motion.is_ok_and(|motion| {
        let reach = motion.end().displacement();
        !motion.frames.is_empty() && (reach.is_nan() || reach >= 100.0)
    })
}

/// Reads the frames that a player has written.
fn read_motion(positions: &Path, model: &Model) -> std::io::Result<Motion> {
    let bytes = std::fs::read(positions)?;
    let (chunks, _) = bytes.as_chunks::<8>();
    let numbers: Vec<f64> = chunks.iter().map(|chunk| f64::from_le_bytes(*chunk)).collect();
    Ok(Motion::from_numbers(&numbers, model))
}

fn last_line(log: &Path) -> String {
    let text = std::fs::read_to_string(log).unwrap_or_default();
    text.lines()
        .rfind(|line| !line.trim().is_empty())
        .unwrap_or("no word")
        .into()
}
