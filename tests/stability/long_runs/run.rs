//! A row is run, and looked at some sixty times a second.

use super::account::Account;
use super::activity::Activity;
use super::clock;
use super::figures::{Figures, Outcome};
use super::pluck;
use super::press::Press;
use super::scene::Scene;
use super::subject::Subject;
use super::table::Row;

/// How long a row runs.
pub struct Length {
    /// Simulated, s.
    pub simulated: f64,
    /// Processor time at the most, s.
    pub processor: f64,
}

/// Looked at so often, 1/s.
const LOOKS: f64 = 60.0;

/// Runs a row; `watch` is shown how it goes.
pub fn run(row: &Row, length: &Length, watch: &mut dyn FnMut(&Figures)) -> Outcome {
    let Some(subject) = Subject::new(row.matter, row.damping) else {
        return Outcome::Skipped;
    };
    let result = match row.activity {
        Activity::Plucked => pluck::ring(row, &subject),
        _ => go_on(row, &subject, length, watch),
    };
    Outcome::Ran(result.unwrap_or_else(|error| Figures::of_fault(format!("no state of rest: {error}"))))
}

fn go_on(
    row: &Row,
    subject: &Subject,
    length: &Length,
    watch: &mut dyn FnMut(&Figures),
) -> Result<Figures, sinew::Error> {
    let mut scene = row.activity.begin(subject, row.solver)?;
    let (mut account, mut figures) = Account::new(row.activity, subject, row.solver, &scene)?;
    let mut press = Press::new(row.activity, subject, &mut scene);
    let step = f64::from(row.step);
    let looks = (1.0 / (LOOKS * step)).round().max(1.0) as usize;
    figures.wanted = length.simulated;
    let (mut count, mut processor) = (0_usize, 0.0);
    while figures.time < length.simulated && processor < length.processor && !figures.is_hopeless() {
        count += 1;
        figures.time = count as f64 * step;
        if let Some(press) = &mut press {
            press.act(&mut scene, figures.time);
        }
        let substeps = take(&mut scene, row.step, count, &mut processor, &mut figures);
        figures.cost = processor / count as f64;
        let Some(substeps) = substeps else {
            break;
        };
        if let Some(press) = &press {
            account.add_work(press.work(&scene), &mut figures);
        }
        let is_free = press.as_ref().is_none_or(Press::is_over);
        if is_free && count.is_multiple_of(looks) {
            account.check(&scene, &subject.masses, step / f64::from(substeps), &mut figures);
            watch(&figures);
        }
    }
    Ok(figures)
}

/// Takes a step: how many substeps that took, `None` where it went wrong.
fn take(scene: &mut Scene, step: f32, count: usize, processor: &mut f64, figures: &mut Figures) -> Option<u32> {
    let mut result = None;
    *processor += clock::time(|| result = Some(scene.world.step(step))).processor;
    match result? {
        Err(error) => figures.faults.push(format!("step {count}: {error}")),
        Ok(report) if report.bodies_restored > 0 => figures.faults.push(format!("step {count}: restored")),
        Ok(report) => {
            figures.substeps = figures.substeps.max(report.substeps);
            return Some(report.substeps.max(1));
        }
    }
    None
}
