//! Contenders measured in rounds: each round gives every contender a few units of its work, so that what disturbs the
//! machine for a while disturbs all of them, and ratios within a round hold.

use std::time::{Duration, Instant};

use crate::clock::{self, Elapsed};

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    pub quick: bool,
    pub rounds: usize,
    /// Rounds end early, but not before three, once a group has taken so long.
    pub patience: Duration,
    /// A sample lasts at least so long, in seconds.
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
        rounds: 5,
        patience: Duration::from_secs(2),
        sample: 2e-3,
    };
}

/// A unit of work of so many seconds needs no second look before it is measured.
const LONG: f64 = 0.3;

/// Something whose time is measured.
pub struct Contender<'a> {
    pub name: String,
    /// Above 1: measured on the wall's clock, since the caller's thread does not do it all.
    pub threads: u32,
    /// Does so many units of work.
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

/// What was measured of a contender: seconds per unit, a sample per round.
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

    /// How many times as long this takes as `other`: the median of the ratios within rounds.
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

/// What rounds gave.
pub struct Results {
    samples: Vec<Samples>,
    /// The share of the time in which the machine did not run us.
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
            // The first unit is slower: memory is touched for the first time. Of what is long, that is all the same.
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
        for place in 0..contenders.len() {
            // To and fro, so that nobody always follows the same one.
            let index = if round % 2 == 0 {
                place
            } else {
                contenders.len() - 1 - place
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

/// The time that counts.
fn seconds(threads: u32, elapsed: Elapsed) -> f64 {
    if threads == 1 { elapsed.processor } else { elapsed.wall }
}
