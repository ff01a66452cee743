//! Runs a row and checks it.

use super::account::{Account, CHECKS};
use super::activity::Activity;
use super::figures::{Figures, Outcome};
use super::pluck;
use super::press::Press;
use super::subject::Subject;
use super::table::Row;

/// The duration of a run.
pub struct Length {
    /// Simulated, s.
    pub simulated: f64,
    /// Maximum processor time, s.
    pub processor: f64,
}

/// Damping times time after which a damped body is at rest: `exp(-30)` of its energy is left.
const DECAYED: f32 = 30.0;

/// Runs a row; `watch` gets the figures after each check.
pub fn run(row: &Row, length: &Length, watch: &mut dyn FnMut(&Figures)) -> Outcome {
    let Some(subject) = Subject::new(row.matter, row.damping) else {
        return Outcome::Skipped;
    };
    let result = match row.activity {
        Activity::Plucked => pluck::ring(row, &subject),
        _ => simulate(row, &subject, length, watch),
    };
    Outcome::Ran(result.unwrap_or_else(|error| Figures::from_fault(format!("no start: {error}"))))
}

fn simulate(
    row: &Row,
    subject: &Subject,
    length: &Length,
    watch: &mut dyn FnMut(&Figures),
) -> Result<Figures, sinew::Error> {
    let mut scene = row.activity.begin(subject, row.solver)?;
    let (mut account, mut figures) = Account::new(row.activity, subject, &scene)?;
    let mut press = Press::new(row.activity, subject, &mut scene);
    let step = f64::from(row.step);
    let per_second = (1.0 / step).round() as usize;
    let interval = per_second.div_ceil(CHECKS);
    figures.wanted = length.simulated;
    while figures.time < length.simulated && figures.processor < length.processor && !figures.is_hopeless() {
        if let Some(press) = &mut press {
            press.act(&mut scene, figures.time + step);
        }
        if !scene.step(row.step, &mut figures) {
            break;
        }
        if let Some(press) = &press {
            account.add_work(press.work(&scene), &mut figures);
        }
        let is_free = press.as_ref().is_none_or(Press::is_over);
        if is_free && figures.steps.is_multiple_of(interval) {
            account.check(&scene, &subject.masses, per_second / interval, &mut figures);
            watch(&figures);
        }
    }
    if row.damping * figures.time as f32 > DECAYED {
        let energy = scene.body().energy(scene.world.gravity());
        figures.kinetic = Some(energy.kinetic / figures.put_in);
    }
    Ok(figures)
}
