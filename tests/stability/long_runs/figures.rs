//! The measured figures of a run, and their bounds.

use std::fmt;

/// Excess energy over the energy put in.
const ENERGY: f64 = 1e-3;

/// Change of momentum over the sum of the magnitudes of the nodal momenta, and how much more rounding adds in a substep
/// at most.
const MOMENTUM: f64 = 1e-5;
const ROUNDING: f64 = 1e-10;

/// Relative change of angular momentum.
const ANGULAR_MOMENTUM: f64 = 2e-3;

/// Kinetic energy of a damped body at the end, over the energy put in.
const KINETIC: f64 = 1e-6;

/// Relative error of the frequency of the first mode, against the frequency of the formula of the solver.
const FREQUENCY: f64 = 1e-2;

#[derive(Clone, Debug)]
pub enum Outcome {
    /// A file is missing.
    Skipped,
    Ran(Figures),
}

#[derive(Clone, Debug, Default)]
pub struct Figures {
    /// J
    pub put_in: f64,
    /// The largest excess energy over the energy put in.
    energy: Option<f64>,
    /// When the excess first passed its bound, s.
    exceeded_at: Option<f64>,
    momentum: Option<f64>,
    angular_momentum: Option<f64>,
    /// Kinetic energy left at the end over the energy put in, if damping should have taken it.
    pub kinetic: Option<f64>,
    /// Relative error of the frequency of the first mode, against the formula of the solver and against the true
    /// frequency.
    pub frequency: Option<[f64; 2]>,
    pub substeps: u32,
    /// Processor time of all steps, s.
    pub processor: f64,
    pub steps: usize,
    /// Simulated, s.
    pub time: f64,
    /// To be simulated, s.
    pub wanted: f64,
    /// Refused steps, restored bodies and the like.
    pub faults: Vec<String>,
}

/// Keeps the larger value; NaN is larger than all.
fn raise(most: &mut Option<f64>, figure: f64) {
    if most.is_none_or(|most| !(figure <= most)) {
        *most = Some(figure);
    }
}

impl Figures {
    /// Before the first step, with the energy put in, J.
    pub fn of(put_in: f64) -> Self {
        Self {
            put_in,
            ..Self::default()
        }
    }

    /// The figures of a run that could not start.
    pub fn from_fault(fault: String) -> Self {
        Self {
            faults: vec![fault],
            ..Self::default()
        }
    }

    pub fn record_energy(&mut self, excess: f64) {
        raise(&mut self.energy, excess);
        if !(excess <= ENERGY) && self.exceeded_at.is_none() {
            self.exceeded_at = Some(self.time);
        }
    }

    pub fn record_momentum(&mut self, lost: f64) {
        raise(&mut self.momentum, lost);
    }

    pub fn record_angular_momentum(&mut self, lost: f64) {
        raise(&mut self.angular_momentum, lost);
    }

    /// True if the run need not continue.
    pub fn is_hopeless(&self) -> bool {
        !self.faults.is_empty() || self.energy.is_some_and(|energy| !(energy <= 1.0))
    }

    /// Processor time of a step, ms.
    fn cost(&self) -> f64 {
        1e3 * self.processor / self.steps as f64
    }

    /// The checks that failed.
    pub fn wrong(&self) -> Vec<String> {
        let mut wrong = self.faults.clone();
        let momentum = MOMENTUM + ROUNDING * self.steps as f64 * f64::from(self.substeps);
        let bounds = [
            ("momentum", self.momentum, momentum),
            ("angular momentum", self.angular_momentum, ANGULAR_MOMENTUM),
            ("not at rest", self.kinetic, KINETIC),
            ("frequency", self.frequency.map(|[own, _]| own.abs()), FREQUENCY),
        ];
        if let Some(time) = self.exceeded_at {
            wrong.push(format!("energy from {time:.1} s on"));
        }
        for (name, figure, bound) in bounds {
            if figure.is_some_and(|figure| !(figure <= bound)) {
                wrong.push(name.into());
            }
        }
        wrong
    }
}

#[allow(dead_code, reason = "the bench writes a table")]
impl Outcome {
    /// The column heads of `cells`.
    pub const HEADS: &str = "verdict | put in, J | energy | momentum | angular momentum | kinetic left | frequency | against true | substeps | ms a step | s |";

    pub fn has_failed(&self) -> bool {
        matches!(self, Outcome::Ran(figures) if !figures.wrong().is_empty())
    }

    /// A row of a table in Markdown.
    pub fn cells(&self) -> String {
        let Outcome::Ran(figures) = self else {
            return format!("SKIPPED {}", "|".repeat(11));
        };
        let optional = |figure: Option<f64>| figure.map_or(String::new(), |figure| format!("{figure:+.1e}"));
        let [own, whole] = [0, 1].map(|which| figures.frequency.map(|errors| errors[which]));
        let ran = if figures.time < figures.wanted {
            format!("{:.1} of {:.0}", figures.time, figures.wanted)
        } else {
            format!("{:.0}", figures.time)
        };
        format!(
            "{} | {:.2e} | {} | {} | {} | {} | {} | {} | {} | {:.3} | {ran} |",
            self.verdict(),
            figures.put_in,
            optional(figures.energy),
            optional(figures.momentum),
            optional(figures.angular_momentum),
            optional(figures.kinetic),
            optional(own),
            optional(whole),
            figures.substeps,
            figures.cost(),
        )
    }

    fn verdict(&self) -> String {
        match self {
            Outcome::Skipped => "SKIPPED".into(),
            Outcome::Ran(_) if !self.has_failed() => "ok".into(),
            Outcome::Ran(figures) => format!("FAILED: {}", figures.wrong().join("; ")),
        }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.verdict())?;
        let Outcome::Ran(figures) = self else {
            return Ok(());
        };
        write!(f, " ({:.1} s", figures.time)?;
        if figures.put_in > 0.0 {
            write!(f, ", {:.2e} J put in", figures.put_in)?;
        }
        let parts = [
            ("energy", figures.energy),
            ("momentum", figures.momentum),
            ("angular momentum", figures.angular_momentum),
            ("kinetic left", figures.kinetic),
            ("frequency", figures.frequency.map(|[own, _]| own)),
            ("against true", figures.frequency.map(|[_, whole]| whole)),
        ];
        for (name, figure) in parts {
            if let Some(figure) = figure {
                write!(f, ", {name} {figure:+.1e}")?;
            }
        }
        write!(f, ", {} substeps, {:.3} ms a step)", figures.substeps, figures.cost())
    }
}
