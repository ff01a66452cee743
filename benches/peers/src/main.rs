//! Compares sinew with other engines in one run: a large cloth step by step, and error against time in small scenes.
//!
//! ```text
//! cd benches/peers && cargo run --release                  # the cloth, about 20 minutes
//! cd benches/peers && cargo run --release -- --seconds 20  # each contender on each cloth, at most
//! cd benches/peers && cargo run --release -- --quick       # below one minute
//! cd benches/peers && cargo run --release -- scenes        # error against time, about an hour
//! cd benches/peers && cargo run --release -- scenes --scene rope --engine bullet --limit 20
//! ```
//!
//! The cloth runs in Taichi, NVIDIA Warp, Rapier's soft bodies and Bullet's. The table in `target/report/peers.md`
//! states each engine's settings. The scenes run in Rapier, Bullet, MuJoCo, pbatoolkit, Newton and pyPBD. Tables and
//! diagrams are written to `target/report/engines*`. `--limit` is the processor time that a point may take per
//! simulated second.
//!
//! Engines that are not installed are reported and skipped. To install all engines of the scenes:
//!
//! ```text
//! apt-get install g++ pkg-config libbullet-dev
//! python3 -m venv target/peers/venv
//! target/peers/venv/bin/pip install mujoco pbatoolkit==0.0.11 newton pypbd
//! ```

mod child;
mod cloth;
mod contender;
mod players;
mod precision;
mod protocol;
mod rapier_cloth;
mod report;
mod scenes;
mod sinew_cloth;

use cloth::Cloth;
use contender::{Contender, Running};
use protocol::Report;

/// The measuring effort.
struct Effort {
    /// Nodes along an edge of each cloth.
    sides: &'static [u32],
    /// Time limit of a contender for its simulated second [s]; beyond it, fewer steps are taken.
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

/// Number of turns of each contender, so that disturbances by other programs affect all.
const ROUNDS: usize = 10;

/// Untimed steps at the start; a slow engine takes fewer.
const WARM_UP: usize = 10;

/// The measurements of a contender on one cloth, or the reason that there are none.
pub struct Row {
    pub contender: Contender,
    pub result: Result<Measured, String>,
}

/// The measurements of a contender on one cloth.
pub struct Measured {
    pub version: String,
    /// Median time of a step [ms].
    pub milliseconds: f64,
    /// The 10th percentile of step times [ms], for a machine that also runs other programs.
    pub fast_milliseconds: f64,
    /// Number of timed steps.
    pub steps: usize,
    /// True if the report describes the end of one simulated second.
    pub whole_second: bool,
    pub report: Report,
}

/// A contender that is being measured.
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
        Some("--seconds") => match arguments.get(1).and_then(|seconds| seconds.parse().ok()) {
            Some(seconds) => compare(&Effort { seconds, ..FULL }),
            None => {
                eprintln!("--seconds: needs the number of seconds per contender");
                std::process::exit(2);
            }
        },
        Some("child") => serve(&arguments[1..]),
        Some("player") => players::serve(&arguments[1..]),
        Some("scenes") => match request(&arguments[1..]) {
            Some(request) => precision::compare(&request),
            None => {
                eprintln!("scenes: --scene, --engine and --limit, each with a word or a number, or nothing");
                std::process::exit(2);
            }
        },
        Some(other) => {
            eprintln!("{other} is not understood: --quick, --seconds and a number, or nothing");
            std::process::exit(2);
        }
    }
}

/// Parses the arguments of `scenes`.
fn request(arguments: &[String]) -> Option<precision::Request> {
    let mut request = precision::Request {
        limit: 4.0,
        scene: String::new(),
        engine: String::new(),
    };
    for pair in arguments.chunks(2) {
        let value = pair.get(1)?;
        match pair[0].as_str() {
            "--scene" => request.scene.clone_from(value),
            "--engine" => request.engine = value.to_lowercase(),
            "--limit" => request.limit = value.parse().ok()?,
            _ => return None,
        }
    }
    Some(request)
}

/// Runs as one of the contenders.
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
        // Written after each size, so that an interrupted run has results.
        write(&report::markdown(&tables, &skipped));
    }
    println!("{}", report::markdown(&tables, &skipped));
    for reason in &skipped {
        eprintln!("SKIPPED: {reason}");
    }
}

fn write(text: &str) {
    let folder = contender::target().join("report");
    let file = folder.join("peers.md");
    match std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, text)) {
        Ok(()) => eprintln!("written to {}", file.display()),
        Err(error) => eprintln!("{}: {error}", file.display()),
    }
}

/// Measures all contenders on one cloth, in turns.
fn measure(cloth: &Cloth, contenders: &[Contender], seconds: f64) -> Vec<Row> {
    let mut runs: Vec<(Contender, Result<Run, String>)> = Vec::new();
    for contender in contenders {
        let Contender { name, threads, .. } = contender;
        eprintln!("{0} x {0}: {name} on {threads} thread(s) is built", cloth.side);
        let run = Run::start(contender, cloth, seconds);
        runs.push((contender.clone(), run));
    }
    for round in 1..=ROUNDS {
        eprintln!("{0} x {0}: round {round} of {ROUNDS}", cloth.side);
        for (_, run) in &mut runs {
            if let Ok(started) = run
                && let Err(error) = started.round()
            {
                *run = Err(error);
            }
        }
    }
    let rows = runs.into_iter().map(|(contender, run)| Row {
        contender,
        result: run.and_then(|run| run.finish(cloth)),
    });
    rows.collect()
}

impl Run {
    /// Builds the cloth and computes the number of affordable steps: those of one second, or fewer.
    fn start(contender: &Contender, cloth: &Cloth, seconds: f64) -> Result<Self, String> {
        let mut running = contender.start(cloth)?;
        // The first steps compile and allocate.
        let mut warm_up = 0;
        let mut fastest = f64::INFINITY;
        let mut spent = 0.0;
        while warm_up < WARM_UP && (warm_up < 2 || spent < 0.1 * seconds * 1e3) {
            let milliseconds = running.steps(1)?[0];
            fastest = fastest.min(milliseconds);
            spent += milliseconds;
            warm_up += 1;
        }
        let affordable = (seconds * 1e3 / fastest) as usize;
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
        // The remainder of the division into rounds.
        let whole_second = left < ROUNDS;
        if whole_second {
            self.running.steps(left)?;
        }
        let steps = self.milliseconds.len();
        self.milliseconds.sort_unstable_by(f64::total_cmp);
        Ok(Measured {
            version: self.running.version.clone(),
            milliseconds: self.milliseconds[steps / 2],
            fast_milliseconds: self.milliseconds[steps / 10],
            steps,
            whole_second,
            report: self.running.report()?,
        })
    }
}
