//! Planted faults, which the checks must find.
#![allow(dead_code, reason = "`cargo test` plants them")]

use glam::Vec3;
use sinew::Solver;

use super::account::{Account, CHECKS};
use super::activity::Activity;
use super::subject::{Extra, Law, Shape, Subject};
use super::table::{FRAME, matter};

/// The failed checks of a second without and of a second after a change of all velocities.
pub fn found(activity: Activity, change: fn(Vec3) -> Vec3) -> [Vec<String>; 2] {
    let matter = matter(Shape::SmallOrgan, Law::Young, Extra::Nothing);
    let subject = Subject::new(matter, 0.0).expect("it is made, not read");
    let mut scene = activity.begin(&subject, Solver::Verlet).expect("a start");
    let (mut account, mut figures) = Account::new(activity, &subject, &scene).expect("a static equilibrium");
    let mut second = || {
        for _ in 0..CHECKS {
            assert!(scene.step(FRAME, &mut figures));
            account.check(&scene, &subject.masses, CHECKS, &mut figures);
        }
        let velocities: Vec<Vec3> = scene.body().velocities().iter().copied().map(change).collect();
        scene.body_mut().set_velocities(&velocities).expect("velocities");
        figures.wrong()
    };
    [second(), second()]
}
