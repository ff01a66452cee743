//! Interleaved measurements. Each round runs a few units of work of every contender, so that temporary disturbances
//! affect all of them and ratios within a round are valid.

use std::time::{Duration, Instant};

use crate::clock::{self, Elapsed};

/// The measuring effort.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    pub quick: bool,
    pub rounds: usize,
    /// Rounds end early, but not before the third, when a group has taken this long.
    pub patience: Duration,
    /// The minimum duration of a sample [s].
    pub sample: f64,
}

impl Effort {
    pub const FULL: Self = Self {
        quick: false,
        rounds: 9,
        patience: Duration::from_secs(8),
        sample: 5e-3,
    };
    pub const QUICK: Self = Self {
        quick: true,
        rounds: 4,
        patience: Duration::from_secs(1),
        sample: 2e-3,
    };
}

/// A unit of work of at least this duration is not repeated before it is measured [s].
const LONG: f64 = 0.3;

/// A piece of work that is measured.
pub struct Contender<'a> {
    pub name: String,
    /// Above 1, wall time is measured, since other threads do part of the work.
    pub threads: u32,
    /// Does this many units of work.
    pub work: Box<dyn FnMut(usize) + 'a>,
}

impl<'a> Contender<'a> {
    pub fn new(name: impl Into<String>, threads: u32, work: impl FnMut(usize) + 'a) -> Self {
        Self {
            name: name.into(),
            threads,
            work: Box::new(work),
        }
    }
}

/// The measurements of a contender: seconds per unit, one sample per round.
#[derive(Clone, Debug)]
pub struct Samples {
    pub name: String,
    seconds: Vec<f64>,
}

impl Samples {
    pub fn minimum(&self) -> f64 {
        self.seconds.iter().copied().fold(f64::INFINITY, f64::min)
    }

    pub fn median(&self) -> f64 {
        median(self.seconds.clone())
    }

    /// The time relative to `other`: the median of the ratios within rounds.
    pub fn ratio(&self, other: &Samples) -> f64 {
        median(self.seconds.iter().zip(&other.seconds).map(|(a, b)| a / b).collect())
    }
}

pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        count => (values[(count - 1) / 2] + values[count / 2]) / 2.0,
    }
}

/// The results of all rounds.
pub struct Results {
    samples: Vec<Samples>,
    /// The fraction of the time in which the machine ran other programs.
    pub waited: f64,
}

impl Results {
    pub fn get(&self, name: &str) -> Option<&Samples> {
        self.samples.iter().find(|samples| samples.name == name)
    }
}

/// Measures all contenders, round by round.
pub fn interleave(mut contenders: Vec<Contender>, effort: Effort) -> Results {
    let start = Instant::now();
    let units: Vec<usize> = contenders
        .iter_mut()
        .map(|contender| {
            // The first unit is slower, as it touches memory for the first time. For long units this is negligible.
            let mut once = seconds(contender.threads, clock::time(|| (contender.work)(1)));
            if once < LONG {
                once = seconds(contender.threads, clock::time(|| (contender.work)(1)));
            }
            (effort.sample / once.max(1e-9)).ceil().clamp(1.0, 1e6) as usize
        })
        .collect();
    let mut samples: Vec<Samples> = contenders
        .iter()
        .map(|contender| Samples {
            name: contender.name.clone(),
            seconds: Vec::new(),
        })
        .collect();
    let mut alone = Elapsed::default();
    for round in 0..effort.rounds {
        if round >= 3 && start.elapsed() > effort.patience {
            break;
        }
        for position in 0..contenders.len() {
            // Alternating order, so that no contender always follows the same one.
            let index = if round % 2 == 0 {
                position
            } else {
                contenders.len() - 1 - position
            };
            let contender = &mut contenders[index];
            let elapsed = clock::time(|| (contender.work)(units[index]));
            if contender.threads == 1 {
                alone.wall += elapsed.wall;
                alone.processor += elapsed.processor;
            }
            samples[index]
                .seconds
                .push(seconds(contender.threads, elapsed) / units[index] as f64);
        }
    }
    Results {
        samples,
        waited: 1.0 - alone.processor / alone.wall.max(1e-9),
    }
}

/// The counted time: processor time for one thread, wall time for more.
fn seconds(threads: u32, elapsed: Elapsed) -> f64 {
    if threads == 1 { elapsed.processor } else { elapsed.wall }
}
