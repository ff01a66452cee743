//! Rigid-body state of dynamic tools: mass, motion, and response to forces and impulses.

use glam::{DMat3, DQuat, DVec3, Quat, Vec3};

use super::contacts::ToolLoad;
use super::tool::{Pose, ToolShape};
use crate::base::{Error, Result, StateHasher, above_zero, all_finite, ensure, outer, trace};
use crate::codec::saved;
use crate::def::finite_vector;
use crate::geometry::rotation::rotated;
use crate::mesh::MAX_COORDINATE;

/// A free flight is divided so that its parts turn by at most this angle, rad.
const MAX_TURN: f64 = 0.1;

/// Maximum number of parts of a free flight.
const MAX_PARTS: f64 = 256.0;

/// Largest mass (kg) and largest principal moment of inertia (kg m²). The least ones are their inverses.
const HEAVIEST: f32 = 1e12;

/// Mass, center of mass and inertia of a rigid tool, in the tool's own axes.
///
/// ```
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let ball = world.create_tool(&ToolDefinition::new(Shape::Sphere { radius: 0.01 }))?;
/// let mass = world.mass_of_density(ball, 7800.0)?;
/// assert!((mass.mass - 0.0327).abs() < 1e-4);
/// world.set_dynamic(ball, Some(&mass))?;
/// world.step(1.0 / 60.0)?;
/// assert!(world.pose(ball)?.position.y < 0.0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// kg, 1e-12 to 1e12.
    pub mass: f32,
    /// From the tool's position, m, each coordinate within 1e9.
    pub center_of_mass: Vec3,
    /// Moments xx, yy, zz and products xy, xz, yz of the inertia tensor about the center of mass, kg m². The tensor is
    /// positive definite, with principal moments of 1e-24 to 1e12, of which none is more than the sum of the others.
    pub inertia: [f32; 6],
}

/// Mass properties in the form that the step uses. They are `f64`, since a heavy body gains little velocity in each
/// of many short substeps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RigidMass {
    pub mass: f64,
    /// Center of mass in the tool's own axes, m.
    pub center: DVec3,
    /// About the center of mass, in the tool's own axes, kg m².
    inertia: DMat3,
    inverse_inertia: DMat3,
}

saved! { RigidMass { mass, center, inertia, inverse_inertia } where RigidMass::is_sound }

/// Pose and velocity of a rigid tool.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RigidState {
    /// Center of mass, m.
    pub center: DVec3,
    pub orientation: DQuat,
    /// Velocity of the center of mass, m/s.
    pub velocity: DVec3,
    /// About the center of mass, kg m²/s.
    pub angular_momentum: DVec3,
}

saved! { RigidState { center, orientation, velocity, angular_momentum } }

/// A tool that is a rigid body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rigid {
    pub properties: MassProperties,
    pub mass: RigidMass,
    pub motion: RigidState,
    /// Force at the center of mass (N) and torque about it (N m) that the caller applies in the next step.
    pub force: DVec3,
    pub torque: DVec3,
}

saved! { MassProperties { mass, center_of_mass, inertia } }
saved! { Rigid { properties, mass, motion, force, torque } }

impl MassProperties {
    /// Computes the properties of a uniformly filled shape from its density, kg/m³ (Eberly, Polyhedral Mass
    /// Properties, 2002, for meshes). Fails for an unbounded shape.
    pub(crate) fn of(shape: &ToolShape, density: f32) -> Result<Self> {
        above_zero("density", density)?;
        let (volume, center, inertia) = match shape {
            ToolShape::HalfSpace => {
                return Err(Error::invalid("tool is a plane: a plane has no mass"));
            }
            ToolShape::Rounded { radius, half_length } => {
                let [along, across, volume] = mass_of_capsule(f64::from(*radius), f64::from(*half_length));
                (
                    volume,
                    DVec3::ZERO,
                    DMat3::from_diagonal(DVec3::new(across, along, across)),
                )
            }
            ToolShape::Mesh(solid) => mass_of_mesh(solid.surface().positions(), solid.surface().triangles()),
        };
        let density = f64::from(density);
        let inertia = inertia * density;
        let [x, y, z] = [inertia.x_axis, inertia.y_axis, inertia.z_axis];
        Ok(Self {
            mass: (volume * density) as f32,
            center_of_mass: center.as_vec3(),
            inertia: [x.x, y.y, z.z, x.y, x.z, y.z].map(|moment| moment as f32),
        })
    }

    fn tensor(&self) -> DMat3 {
        let [xx, yy, zz, xy, xz, yz] = self.inertia.map(f64::from);
        DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz])
    }

    /// Checks all ranges.
    fn checked(&self) -> Result<RigidMass> {
        ensure!(
            self.mass >= 1.0 / HEAVIEST && self.mass <= HEAVIEST,
            "mass is {}: must be {:e} to {HEAVIEST:e} kg",
            self.mass,
            1.0 / HEAVIEST
        );
        finite_vector("center_of_mass", self.center_of_mass)?;
        ensure!(
            self.center_of_mass.abs().max_element() <= MAX_COORDINATE,
            "center_of_mass is {}: must be within {:e} m of the tool's position",
            self.center_of_mass,
            MAX_COORDINATE
        );
        all_finite("inertia", &self.inertia)?;
        let inertia = self.tensor();
        let mass = RigidMass {
            mass: f64::from(self.mass),
            center: self.center_of_mass.as_dvec3(),
            inertia,
            inverse_inertia: inertia.inverse(),
        };
        // J = tr(I)/2 - I has the second moments of mass as principal values, none of which is negative.
        let second_moments = DMat3::from_diagonal(DVec3::splat(0.5 * trace(&inertia))) - inertia;
        let rounding = 1e-6 * trace(&inertia);
        ensure!(
            is_positive(&inertia, 1e-24) && is_positive(&second_moments, -rounding) && mass.is_sound(),
            "inertia is {:?}: must be positive definite, with no principal moment larger than the sum of the others",
            self.inertia
        );
        Ok(mass)
    }
}

/// Returns the moments of inertia of a capsule of density 1 about its axis and across it (kg m²), and its volume
/// (m³).
fn mass_of_capsule(radius: f64, half_length: f64) -> [f64; 3] {
    use std::f64::consts::PI;
    let (square, length) = (radius * radius, 2.0 * half_length);
    let (barrel, ball) = (PI * square * length, 4.0 / 3.0 * PI * square * radius);
    let along = 0.5 * barrel * square + 0.4 * ball * square;
    // The center of mass of half a ball is 3/8 of its radius from its flat side.
    let cap = 0.4 * square + half_length * half_length + 0.75 * half_length * radius;
    let across = barrel * (square / 4.0 + length * length / 12.0) + ball * cap;
    [along, across, barrel + ball]
}

/// Returns volume, center of mass and inertia about it of a closed surface with density 1. They are sums over the
/// tetrahedra between its triangles and one of its points.
fn mass_of_mesh(positions: &[Vec3], triangles: &[[u32; 3]]) -> (f64, DVec3, DMat3) {
    let origin = positions.first().map_or(DVec3::ZERO, |first| first.as_dvec3());
    let (mut volume, mut first_moment, mut second_moment) = (0.0, DVec3::ZERO, DMat3::ZERO);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| positions[corner as usize].as_dvec3() - origin);
        let sixfold = a.dot(b.cross(c));
        let sum = a + b + c;
        volume += sixfold / 6.0;
        first_moment += sum * (sixfold / 24.0);
        let [of_a, of_b, of_c, of_sum] = [a, b, c, sum].map(|v| outer(v, v));
        second_moment += (of_a + of_b + of_c + of_sum) * (sixfold / 120.0);
    }
    let center = first_moment / volume;
    let about_center = second_moment - outer(center, center) * volume;
    let inertia = DMat3::from_diagonal(DVec3::splat(trace(&about_center))) - about_center;
    (volume, origin + center, inertia)
}

/// True if all eigenvalues of a symmetric matrix are above `bound` (Sylvester).
fn is_positive(matrix: &DMat3, bound: f64) -> bool {
    let shifted = *matrix - DMat3::from_diagonal(DVec3::splat(bound));
    let minor = shifted.x_axis.x * shifted.y_axis.y - shifted.x_axis.y * shifted.y_axis.x;
    shifted.x_axis.x > 0.0 && minor > 0.0 && shifted.determinant() > 0.0
}

impl RigidMass {
    fn is_sound(&self) -> bool {
        let is_finite = |matrix: &DMat3| matrix.to_cols_array().iter().all(|entry| entry.is_finite());
        self.mass > 0.0
            && self.mass.is_finite()
            && self.center.is_finite()
            && is_finite(&self.inertia)
            && is_finite(&self.inverse_inertia)
    }

    /// Returns the same shape with a fraction of the mass.
    pub fn scaled(&self, fraction: f64) -> Self {
        Self {
            mass: self.mass * fraction,
            center: self.center,
            inertia: self.inertia * fraction,
            inverse_inertia: self.inverse_inertia * (1.0 / fraction),
        }
    }

    /// Returns the inverse inertia in world axes, 1/(kg m²).
    pub fn inverse_inertia_at(&self, orientation: DQuat) -> DMat3 {
        let turn = DMat3::from_quat(orientation);
        turn * self.inverse_inertia * turn.transpose()
    }

    fn momentum(&self, orientation: DQuat, spin: DVec3) -> DVec3 {
        orientation * (self.inertia * (orientation.conjugate() * spin))
    }

    /// Returns the angular velocity for this angular momentum, rad/s.
    pub fn spin(&self, orientation: DQuat, momentum: DVec3) -> DVec3 {
        orientation * (self.inverse_inertia * (orientation.conjugate() * momentum))
    }
}

impl RigidState {
    /// Returns the pose of the tool.
    pub fn pose(&self, mass: &RigidMass) -> Pose {
        Pose {
            position: self.position(mass).as_vec3(),
            orientation: self.orientation.as_quat(),
        }
    }

    pub fn position(&self, mass: &RigidMass) -> DVec3 {
        self.center - self.orientation * mass.center
    }

    pub fn spin(&self, mass: &RigidMass) -> DVec3 {
        mass.spin(self.orientation, self.angular_momentum)
    }

    /// Returns the kinetic energy, J.
    pub fn kinetic_energy(&self, mass: &RigidMass) -> f64 {
        0.5 * (mass.mass * self.velocity.length_squared() + self.spin(mass).dot(self.angular_momentum))
    }

    /// Returns the mean angular velocity over `duration` seconds, rad/s, by the midpoint rule: second-order accurate,
    /// conserves angular momentum.
    pub fn mean_angular_velocity(&self, mass: &RigidMass, duration: f64) -> DVec3 {
        let half = rotated(self.orientation, self.spin(mass) * (0.5 * duration));
        mass.spin(half, self.angular_momentum)
    }

    /// Moves it for `duration` seconds at its velocity.
    pub fn drift(&mut self, mass: &RigidMass, duration: f64) {
        self.center += self.velocity * duration;
        self.turn(mass, duration);
    }

    fn turn(&mut self, mass: &RigidMass, duration: f64) {
        let spin = self.mean_angular_velocity(mass, duration);
        self.orientation = rotated(self.orientation, spin * duration);
    }

    /// Advances a free flight of `duration` seconds with this acceleration and torque.
    pub fn fly(&mut self, mass: &RigidMass, (acceleration, torque): (DVec3, DVec3), duration: f64) {
        self.center += (self.velocity + acceleration * (0.5 * duration)) * duration;
        self.velocity += acceleration * duration;
        let turn = self.spin(mass).length() * duration;
        let parts = (turn / MAX_TURN).ceil().clamp(1.0, MAX_PARTS);
        for _ in 0..parts as u32 {
            self.angular_momentum += torque * (duration / parts);
            self.turn(mass, duration / parts);
        }
    }

    /// Applies an impulse and its moment about the tool's position.
    pub fn apply_load(&mut self, mass: &RigidMass, load: &ToolLoad) {
        let arm = self.orientation * mass.center;
        self.velocity += load.impulse / mass.mass;
        self.angular_momentum += load.angular_impulse - arm.cross(load.impulse);
    }

    pub fn is_finite(&self) -> bool {
        self.center.is_finite()
            && self.orientation.is_finite()
            && self.velocity.is_finite()
            && self.angular_momentum.is_finite()
    }
}

impl Rigid {
    /// Creates a rigid body at rest at this pose.
    pub fn new(properties: &MassProperties, pose: &Pose) -> Result<Self> {
        let mass = properties.checked()?;
        let mut rigid = Self {
            properties: *properties,
            mass,
            motion: RigidState {
                center: DVec3::ZERO,
                orientation: DQuat::IDENTITY,
                velocity: DVec3::ZERO,
                angular_momentum: DVec3::ZERO,
            },
            force: DVec3::ZERO,
            torque: DVec3::ZERO,
        };
        rigid.set_pose(pose);
        Ok(rigid)
    }

    /// Moves it to this pose and keeps its velocity.
    pub fn set_pose(&mut self, pose: &Pose) {
        let spin = self.motion.spin(&self.mass);
        self.motion.orientation = exact(pose.orientation);
        self.motion.center = pose.position.as_dvec3() + self.motion.orientation * self.mass.center;
        self.motion.angular_momentum = self.mass.momentum(self.motion.orientation, spin);
    }

    /// Sets the velocity of the center of mass (m/s) and the angular velocity, rad/s.
    pub fn set_velocity(&mut self, velocity: Vec3, spin: Vec3) {
        self.motion.velocity = velocity.as_dvec3();
        self.motion.angular_momentum = self.mass.momentum(self.motion.orientation, spin.as_dvec3());
    }

    /// Returns the velocity of the center of mass (m/s) and the angular velocity, rad/s.
    pub fn velocity(&self) -> (Vec3, Vec3) {
        let finite = |vector: DVec3| vector.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
        (finite(self.motion.velocity), finite(self.motion.spin(&self.mass)))
    }

    /// Adopts the state after a step. Stops the tool instead if that state is out of bounds.
    pub fn adopt(&mut self, motion: RigidState) {
        (self.force, self.torque) = (DVec3::ZERO, DVec3::ZERO);
        let reaches = motion.position(&self.mass).abs().max_element() <= f64::from(MAX_COORDINATE);
        if motion.is_finite() && reaches {
            self.motion = motion;
        } else {
            (self.motion.velocity, self.motion.angular_momentum) = (DVec3::ZERO, DVec3::ZERO);
        }
    }

    /// Returns the acceleration (m/s²) and torque (N m) of the next step without contact.
    pub fn drive(&self, gravity: Vec3) -> (DVec3, DVec3) {
        (gravity.as_dvec3() + self.force / self.mass.mass, self.torque)
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for vector in [
            self.motion.center,
            self.motion.velocity,
            self.motion.angular_momentum,
            self.force,
            self.torque,
            self.mass.center,
            DVec3::splat(self.mass.mass),
            self.mass.inertia.x_axis,
            self.mass.inertia.y_axis,
            self.mass.inertia.z_axis,
        ] {
            hasher.write_doubles(&vector.to_array());
        }
        let [x, y, z, w] = self.motion.orientation.to_array();
        hasher.write_doubles(&[x, y, z, w, w, w]);
    }
}

fn exact(orientation: Quat) -> DQuat {
    orientation.as_dquat().normalize()
}
