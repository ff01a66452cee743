//! The motions of the long runs, and their initial states.

use glam::Vec3;
use sinew::{Error, Solver};

use super::rest::rest_shape;
use super::scene::Scene;
use super::subject::Subject;

/// m/s²
const GRAVITY: f32 = 9.81;

/// The speed of the ends of a spinning body, m/s: soft tissue stretches by a few per cent.
const SPEED: f32 = 0.5;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Pinned at one end and released in its rest shape: it swings down.
    Hanging,
    /// Free and without gravity, it spins.
    Spinning,
    /// In equilibrium at first; pins move its free end aside and release it.
    Led,
    /// In equilibrium at first; forces push its free end aside.
    Pushed,
    /// In equilibrium at first; a sphere presses its middle and retreats.
    Poked,
    /// Released near equilibrium, it oscillates in its first mode.
    Plucked,
}

impl Activity {
    /// Creates the body in its initial state.
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

/// Sets velocities of a rotation about the center of mass.
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
