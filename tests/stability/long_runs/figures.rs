//! What a run showed, and whether it may.

use std::fmt;

/// Of the energy put in, how much more there may be.
const ENERGY: f64 = 1e-3;

/// What may be lost of the momentum, as a part of the sum of the nodes' own, and of the angular momentum.
const MOMENTUM: f64 = 1e-5;
const ANGULAR_MOMENTUM: f64 = 2e-3;

/// How far the frequency of the first mode may be from the one that the solver's formula has.
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
    /// The most energy above what was put in, as a part of it, and when it was too much first, s.
    energy: Option<f64>,
    too_much_at: Option<f64>,
    momentum: Option<f64>,
    angular_momentum: Option<f64>,
    /// Of the first mode, against that of the solver's formula, and against the true one.
    pub frequency: Option<[f64; 2]>,
    pub substeps: u32,
    /// Processor time of all steps, s.
    pub processor: f64,
    pub steps: usize,
    /// How long it ran, and how long it should have, s.
    pub time: f64,
    pub wanted: f64,
    /// What else went wrong.
    pub faults: Vec<String>,
}

/// The larger one; what is not a number is larger than all.
fn raise(most: &mut Option<f64>, figure: f64) {
    if most.is_none_or(|most| !(figure <= most)) {
        *most = Some(figure);
    }
}

impl Figures {
    /// Of a body into which so much energy was put, J.
    pub fn of(put_in: f64) -> Self {
        Self {
            put_in,
            ..Self::default()
        }
    }

    /// Of a run that could not begin.
    pub fn of_fault(fault: String) -> Self {
        Self {
            faults: vec![fault],
            ..Self::default()
        }
    }

    pub fn see_energy(&mut self, excess: f64) {
        raise(&mut self.energy, excess);
        if !(excess <= ENERGY) && self.too_much_at.is_none() {
            self.too_much_at = Some(self.time);
        }
    }

    pub fn see_momentum(&mut self, lost: f64) {
        raise(&mut self.momentum, lost);
    }

    pub fn see_angular_momentum(&mut self, lost: f64) {
        raise(&mut self.angular_momentum, lost);
    }

    /// Whether it need not be looked at any longer.
    pub fn is_hopeless(&self) -> bool {
        !self.faults.is_empty() || self.energy.is_some_and(|energy| !(energy <= 1.0))
    }

    /// Processor time of a step, ms.
    fn cost(&self) -> f64 {
        1e3 * self.processor / self.steps as f64
    }

    /// What is not as it should be.
    pub fn wrong(&self) -> Vec<String> {
        let mut wrong = self.faults.clone();
        let bounds = [
            ("momentum", self.momentum, MOMENTUM),
            ("angular momentum", self.angular_momentum, ANGULAR_MOMENTUM),
            ("frequency", self.frequency.map(|[own, _]| own.abs()), FREQUENCY),
        ];
        if let Some(time) = self.too_much_at {
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
    /// The heads of the columns of `cells`.
    pub const HEADS: &str = "verdict | put in, J | energy | momentum | angular momentum | frequency | against the true one | substeps | ms a step | s |";

    pub fn has_failed(&self) -> bool {
        matches!(self, Outcome::Ran(figures) if !figures.wrong().is_empty())
    }

    /// A row of a table in Markdown.
    pub fn cells(&self) -> String {
        let Outcome::Ran(figures) = self else {
            return format!("SKIPPED {}", "|".repeat(10));
        };
        let optional = |figure: Option<f64>| figure.map_or(String::new(), |figure| format!("{figure:+.1e}"));
        let [own, whole] = [0, 1].map(|which| figures.frequency.map(|errors| errors[which]));
        let ran = if figures.time < figures.wanted {
            format!("{:.1} of {:.0}", figures.time, figures.wanted)
        } else {
            format!("{:.0}", figures.time)
        };
        format!(
            "{} | {:.2e} | {} | {} | {} | {} | {} | {} | {:.3} | {ran} |",
            self.verdict(),
            figures.put_in,
            optional(figures.energy),
            optional(figures.momentum),
            optional(figures.angular_momentum),
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
            ("frequency", figures.frequency.map(|[own, _]| own)),
            ("against the true one", figures.frequency.map(|[_, whole]| whole)),
        ];
        for (name, figure) in parts {
            if let Some(figure) = figure {
                write!(f, ", {name} {figure:+.1e}")?;
            }
        }
        write!(f, ", {} substeps, {:.3} ms a step)", figures.substeps, figures.cost())
    }
}
