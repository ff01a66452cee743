//! The same cloth, side by side in one run: sinew, Taichi, NVIDIA Warp, Rapier's soft bodies and Bullet's.
//!
//! ```text
//! cd benches/peers && cargo run --release             # some ten minutes
//! cd benches/peers && cargo run --release -- --quick  # below one minute
//! ```
//!
//! What is not installed is skipped, loudly. A table is printed and written to `target/report/peers.md`, with what was
//! asked of each engine.

mod child;
mod cloth;
mod contender;
mod protocol;
mod rapier_cloth;
mod report;
mod sinew_cloth;

use cloth::Cloth;
use contender::{Contender, Running};
use protocol::Report;

/// How long to measure.
struct Effort {
    /// Nodes along an edge of each cloth.
    sides: &'static [u32],
    /// Seconds that a contender may take for its simulated second; fewer steps otherwise.
    seconds: f64,
}

const FULL: Effort = Effort {
    sides: &[100, 316, 1000],
    seconds: 120.0,
};
const QUICK: Effort = Effort {
    sides: &[100, 316],
    seconds: 1.0,
};

/// Contenders take turns this often, so that what else the machine does hits all.
const ROUNDS: usize = 10;

/// What was measured of a contender on one cloth, or why nothing was.
pub struct Row {
    pub contender: Contender,
    pub result: Result<Measured, String>,
}

/// What was measured of a contender on one cloth.
pub struct Measured {
    pub version: String,
    /// Median over the steps.
    pub milliseconds: f64,
    /// Steps that were timed.
    pub steps: usize,
    /// Whether the report is of the end of one simulated second.
    pub whole_second: bool,
    pub report: Report,
}

/// A contender in the course of being measured.
struct Run {
    running: Running,
    /// Steps per round.
    share: usize,
    warm_up: usize,
    milliseconds: Vec<f64>,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.first().map(String::as_str) {
        None => compare(&FULL),
        Some("--quick") => compare(&QUICK),
        Some("child") => serve(&arguments[1..]),
        Some(other) => {
            eprintln!("{other} is not understood: --quick, or nothing");
            std::process::exit(2);
        }
    }
}

/// Is one of the contenders.
fn serve(arguments: &[String]) {
    let cloth = arguments.get(2..).and_then(Cloth::from_arguments).expect("a cloth");
    let threads = arguments[1].parse().expect("a thread count");
    match arguments[0].as_str() {
        "sinew" => child::serve::<sinew_cloth::SinewCloth>(&cloth, threads),
        "rapier" => child::serve::<rapier_cloth::RapierCloth>(&cloth, threads),
        other => panic!("{other} is not built in"),
    }
}

fn compare(effort: &Effort) {
    let mut skipped = Vec::new();
    let mut contenders = Vec::new();
    for contender in contender::all() {
        match contender {
            Ok(contender) => contenders.push(contender),
            Err(reason) => skipped.push(reason),
        }
    }
    let mut tables = Vec::new();
    for &side in effort.sides {
        let cloth = Cloth::new(side);
        let rows = measure(&cloth, &contenders, effort.seconds);
        for row in &rows {
            if let Err(reason) = &row.result {
                let Contender { name, threads, .. } = row.contender;
                let reason = format!("{name} on {threads} thread(s): {reason}");
                if !skipped.contains(&reason) {
                    skipped.push(reason);
                }
            }
        }
        tables.push((cloth, rows));
    }
    let text = report::markdown(&tables, &skipped);
    println!("{text}");
    let folder = contender::target().join("report");
    let file = folder.join("peers.md");
    match std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, text)) {
        Ok(()) => eprintln!("written to {}", file.display()),
        Err(error) => eprintln!("{}: {error}", file.display()),
    }
    for reason in &skipped {
        eprintln!("SKIPPED: {reason}");
    }
}

/// Measures everyone on one cloth, in turns.
fn measure(cloth: &Cloth, contenders: &[Contender], seconds: f64) -> Vec<Row> {
    let mut runs: Vec<(Contender, Result<Run, String>)> = Vec::new();
    for contender in contenders {
        progress(cloth, contender, "builds");
        let run = Run::start(contender, cloth, seconds);
        runs.push((contender.clone(), run));
    }
    for round in 1..=ROUNDS {
        for (contender, run) in &mut runs {
            if let Ok(started) = run {
                progress(cloth, contender, &format!("round {round} of {ROUNDS}"));
                if let Err(error) = started.round() {
                    *run = Err(error);
                }
            }
        }
    }
    let rows = runs.into_iter().map(|(contender, run)| {
        progress(cloth, &contender, "reports");
        let result = run.and_then(|run| run.finish(cloth));
        Row { contender, result }
    });
    rows.collect()
}

fn progress(cloth: &Cloth, contender: &Contender, what: &str) {
    let Contender { name, threads, .. } = contender;
    eprintln!("{0} x {0}: {name} on {threads} thread(s) {what}", cloth.side);
}

impl Run {
    /// Builds the cloth and finds how many steps there is time for: those of one second, or fewer.
    fn start(contender: &Contender, cloth: &Cloth, seconds: f64) -> Result<Self, String> {
        let mut running = contender.start(cloth)?;
        // The first steps compile and allocate. A slow engine has fewer.
        let mut warm_up = 0;
        let mut last = f64::INFINITY;
        for _ in 0..10 {
            let before = last;
            last = running.steps(1)?[0];
            warm_up += 1;
            if before.min(last) > 1000.0 * seconds / 120.0 {
                break;
            }
        }
        let affordable = (seconds * 1000.0 / last) as usize;
        let share = affordable.min(cloth.steps_per_second() - warm_up) / ROUNDS;
        Ok(Self {
            running,
            share: share.max(1),
            warm_up,
            milliseconds: Vec::new(),
        })
    }

    fn round(&mut self) -> Result<(), String> {
        self.milliseconds.extend(self.running.steps(self.share)?);
        Ok(())
    }

    fn finish(mut self, cloth: &Cloth) -> Result<Measured, String> {
        let done = self.warm_up + self.milliseconds.len();
        let left = cloth.steps_per_second().saturating_sub(done);
        // What the rounds did not divide.
        let whole_second = left < ROUNDS;
        if whole_second {
            self.running.steps(left)?;
        }
        let steps = self.milliseconds.len();
        let (_, &mut milliseconds, _) = self.milliseconds.select_nth_unstable_by(steps / 2, f64::total_cmp);
        Ok(Measured {
            version: self.running.version.clone(),
            milliseconds,
            steps,
            whole_second,
            report: self.running.report()?,
        })
    }
}
