//! Planted faults, which the checks must find.
#![allow(dead_code, reason = "`cargo test` plants them")]

use glam::Vec3;
use sinew::Solver;

use super::account::Account;
use super::activity::Activity;
use super::subject::{Extra, Law, Shape, Subject};
use super::table::{FRAME, matter};

/// The failed checks of an undisturbed body, and those after a change of its velocities.
pub fn found(activity: Activity, change: fn(Vec3) -> Vec3) -> [Vec<String>; 2] {
    let matter = matter(Shape::SmallOrgan, Law::Young, Extra::Nothing);
    let subject = Subject::new(matter, 0.0).expect("it is made, not read");
    let mut scene = activity.begin(&subject, Solver::Verlet).expect("a start");
    let (mut account, mut figures) = Account::new(activity, &subject, Solver::Verlet, &scene).expect("a state of rest");
    let substeps = (0..60).map(|_| scene.step(FRAME, &mut figures).expect("a step"));
    let substep = f64::from(FRAME) / f64::from(substeps.last().expect("a step"));
    account.check(&scene, &subject.masses, substep, &mut figures);
    let before = figures.wrong();
    let velocities: Vec<Vec3> = scene.body().velocities().iter().copied().map(change).collect();
    scene.body_mut().set_velocities(&velocities).expect("velocities");
    account.check(&scene, &subject.masses, substep, &mut figures);
    [before, figures.wrong()]
}
