//! Blades that are moved by hand.

use glam::{DVec3, Vec3};
use sinew::{BladeDefinition, BladeId, Pose, World};

/// Creates a blade whose edge is relative to its origin.
pub fn blade_at(world: &mut World, stiffness: f32, at: Vec3, edge: [Vec3; 2]) -> BladeId {
    let pose = Pose {
        position: at,
        ..Pose::IDENTITY
    };
    let definition = BladeDefinition {
        stiffness,
        pose,
        ..BladeDefinition::new(edge)
    };
    world.create_blade(&definition).expect("a blade")
}

/// The accumulated results of a stroke.
#[derive(Default)]
pub struct Stroke {
    /// The work of the hand (J): from force and displacement of the edge, and as reported.
    pub work: f64,
    pub told: f64,
    /// m.
    pub length: f64,
    /// m².
    pub area: f64,
    /// The force on the blade after each step (N), and the distance of the blade ahead of its proxy (m).
    pub forces: Vec<Vec3>,
    pub lags: Vec<f64>,
    pub refused: usize,
    /// The impulse on the tissue (N s), and its moment about the origin (N m s).
    pub impulse: DVec3,
    pub spin: DVec3,
}

impl Stroke {
    /// Moves a blade evenly between two positions.
    pub fn draw(&mut self, world: &mut World, blade: BladeId, [from, to]: [Vec3; 2], steps: usize, dt: f32) {
        let mut last = from;
        for step in 1..=steps {
            let position = from.lerp(to, step as f32 / steps as f32);
            world.set_blade_pose(blade, position, None).expect("a pose");
            world.step(dt).expect("a step");
            let report = world.blade_report(blade).expect("a report");
            let (force, torque) = (report.force.as_dvec3(), report.torque.as_dvec3());
            self.work -= force.dot((position - last).as_dvec3());
            self.told += report.work;
            self.length += report.length;
            self.area += report.area;
            self.forces.push(report.force);
            self.lags.push(report.lag);
            self.refused += usize::from(report.refused.is_some());
            self.impulse -= force * f64::from(dt);
            self.spin -= (torque + (0.5 * (last + position)).as_dvec3().cross(force)) * f64::from(dt);
            last = position;
        }
    }

    pub fn largest_jump(&self) -> f32 {
        let jumps = self.forces.windows(2).map(|pair| pair[0].distance(pair[1]));
        jumps.fold(0.0, f32::max)
    }
}
