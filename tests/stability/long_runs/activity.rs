//! What a body does in a long run, and how it begins.

use glam::Vec3;
use sinew::{Error, Solver};

use super::rest::rest_shape;
use super::scene::Scene;
use super::subject::Subject;

/// m/s²
const GRAVITY: f32 = 9.81;

/// Of the ends of what spins, m/s: soft tissue is some per cent longer then.
const SPEED: f32 = 0.5;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// It is let go of in its rest shape, held at one end: it swings down.
    Hanging,
    /// It spins, free and without gravity.
    Spinning,
    /// It hangs straight and still; its free end is led aside by pins, and let go of.
    Led,
    /// The same with forces.
    Pushed,
    /// The same with a sphere that presses it in the middle, and is withdrawn.
    Poked,
    /// The same with a displacement so small that it rings in its first mode: its frequency.
    Plucked,
}

impl Activity {
    /// A body where it begins.
    pub fn begin(self, subject: &Subject, solver: Solver) -> Result<Scene, Error> {
        let gravity = match self {
            Activity::Hanging => GRAVITY * Vec3::NEG_Y,
            Activity::Spinning => Vec3::ZERO,
            _ => -GRAVITY * subject.axis,
        };
        let mut scene = Scene::new(&subject.definition(solver), gravity);
        match self {
            Activity::Hanging => scene.pin(&subject.ends[0]),
            Activity::Spinning => spin(&mut scene, subject),
            _ => {
                scene.pin(&subject.ends[0]);
                let rest = rest_shape(subject, gravity, false)?;
                scene.body_mut().set_positions(&rest).expect("positions");
            }
        }
        Ok(scene)
    }
}

/// About the centre of mass.
fn spin(scene: &mut Scene, subject: &Subject) {
    let positions = scene.body().positions();
    let weighed = positions.iter().zip(&subject.masses);
    let sum: glam::DVec3 = weighed.map(|(p, &mass)| p.as_dvec3() * f64::from(mass)).sum();
    let centre = sum / subject.masses.iter().map(|&mass| f64::from(mass)).sum::<f64>();
    let axis = glam::DVec3::new(0.3, 0.8, 0.5).normalize();
    let rate = f64::from(2.0 * SPEED / subject.length);
    let velocities = positions
        .iter()
        .map(|p| (rate * axis.cross(p.as_dvec3() - centre)).as_vec3());
    let velocities: Vec<Vec3> = velocities.collect();
    scene.body_mut().set_velocities(&velocities).expect("velocities");
}
