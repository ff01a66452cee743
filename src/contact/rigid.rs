//! A tool that is a rigid body: its mass, and how forces and impulses move it.

use glam::{DMat3, DQuat, DVec3, Quat, Vec3};

use super::contacts::ToolLoad;
use super::tool::{Form, Pose};
use crate::base::{Error, Result, StateHasher, above_zero, all_finite, ensure, outer, trace};
use crate::codec::saved;
use crate::def::finite_vector;
use crate::geometry::rotation::turned;
use crate::mesh::FURTHEST;

/// A body that turns by more than this in a part of its free flight takes it in more of them, rad.
const TURN: f64 = 0.1;

/// Parts of a free flight, at most.
const PARTS: f64 = 256.0;

/// The largest mass, kg, and the largest principal moment of inertia, kg m²; the least are their inverses.
const HEAVIEST: f32 = 1e12;

/// Mass, centre of mass and inertia of a rigid tool, in the tool's own axes.
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
    /// Moments xx, yy, zz and products xy, xz, yz of the inertia tensor about the centre of mass, kg m². The tensor is
    /// positive definite, with principal moments of 1e-24 to 1e12, of which none is more than the sum of the others.
    pub inertia: [f32; 6],
}

/// The mass of a rigid tool as the step works with it. In `f64`: a heavy body gains little from each of many short substeps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RigidMass {
    pub mass: f64,
    /// The centre of mass in the tool's own axes, m.
    pub center: DVec3,
    /// About the centre of mass, in the tool's own axes, kg m².
    inertia: DMat3,
    inverse_inertia: DMat3,
}

saved! { RigidMass { mass, center, inertia, inverse_inertia } where RigidMass::is_sound }

/// Where a rigid tool is and how it moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RigidState {
    /// The centre of mass, m.
    pub center: DVec3,
    pub orientation: DQuat,
    /// Of the centre of mass, m/s.
    pub velocity: DVec3,
    /// About the centre of mass, kg m²/s.
    pub angular_momentum: DVec3,
}

saved! { RigidState { center, orientation, velocity, angular_momentum } }

/// A tool that is a rigid body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rigid {
    pub properties: MassProperties,
    pub mass: RigidMass,
    pub motion: RigidState,
    /// What the caller applies in the next step: at the centre of mass, N, and about it, N m.
    pub force: DVec3,
    pub torque: DVec3,
}

saved! { MassProperties { mass, center_of_mass, inertia } }
saved! { Rigid { properties, mass, motion, force, torque } }

impl MassProperties {
    /// Of a shape that is filled evenly, kg/m³ (Eberly, Polyhedral Mass Properties, 2002, for meshes); refused where it has no end.
    pub(crate) fn of(form: &Form, density: f32) -> Result<Self> {
        above_zero("density", density)?;
        let (volume, center, inertia) = match form {
            Form::HalfSpace => {
                return Err(Error::invalid("tool is a plane: a plane has no mass"));
            }
            Form::Rounded { radius, half_length } => {
                let [along, across, volume] = rounded(f64::from(*radius), f64::from(*half_length));
                (
                    volume,
                    DVec3::ZERO,
                    DMat3::from_diagonal(DVec3::new(across, along, across)),
                )
            }
            Form::Mesh(solid) => enclosed(solid.surface().positions(), solid.surface().triangles()),
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

    /// Refused where a number is out of its range.
    fn checked(&self) -> Result<RigidMass> {
        ensure!(
            self.mass >= 1.0 / HEAVIEST && self.mass <= HEAVIEST,
            "mass is {}: must be {:e} to {HEAVIEST:e} kg",
            self.mass,
            1.0 / HEAVIEST
        );
        finite_vector("center_of_mass", self.center_of_mass)?;
        ensure!(
            self.center_of_mass.abs().max_element() <= FURTHEST,
            "center_of_mass is {}: must be within {:e} m of the tool's position",
            self.center_of_mass,
            FURTHEST
        );
        all_finite("inertia", &self.inertia)?;
        let inertia = self.tensor();
        let mass = RigidMass {
            mass: f64::from(self.mass),
            center: self.center_of_mass.as_dvec3(),
            inertia,
            inverse_inertia: inertia.inverse(),
        };
        // J = tr(I)/2 - I has the second moments of mass as its principal values: none is below 0.
        let second = DMat3::from_diagonal(DVec3::splat(0.5 * trace(&inertia))) - inertia;
        let rounding = 1e-6 * trace(&inertia);
        ensure!(
            is_positive(&inertia, 1e-24) && is_positive(&second, -rounding) && mass.is_sound(),
            "inertia is {:?}: must be positive definite, with no principal moment larger than the sum of the others",
            self.inertia
        );
        Ok(mass)
    }
}

/// The moments of a capsule of density 1 about its axis and across it, kg m², and its volume, m³.
fn rounded(radius: f64, half_length: f64) -> [f64; 3] {
    use std::f64::consts::PI;
    let (square, length) = (radius * radius, 2.0 * half_length);
    let (barrel, ball) = (PI * square * length, 4.0 / 3.0 * PI * square * radius);
    let along = 0.5 * barrel * square + 0.4 * ball * square;
    // Half a ball's centre of mass is 3/8 of its radius from its flat side.
    let cap = 0.4 * square + half_length * half_length + 0.75 * half_length * radius;
    let across = barrel * (square / 4.0 + length * length / 12.0) + ball * cap;
    [along, across, barrel + ball]
}

/// Volume, centre of mass and inertia about it, at density 1, of what a closed surface encloses: sums over the tetrahedra between its
/// triangles and one of its points.
fn enclosed(positions: &[Vec3], triangles: &[[u32; 3]]) -> (f64, DVec3, DMat3) {
    let origin = positions.first().map_or(DVec3::ZERO, |first| first.as_dvec3());
    let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| positions[corner as usize].as_dvec3() - origin);
        let sixfold = a.dot(b.cross(c));
        let sum = a + b + c;
        volume += sixfold / 6.0;
        first += sum * (sixfold / 24.0);
        let [of_a, of_b, of_c, of_sum] = [a, b, c, sum].map(|v| outer(v, v));
        second += (of_a + of_b + of_c + of_sum) * (sixfold / 120.0);
    }
    let center = first / volume;
    let about = second - outer(center, center) * volume;
    let inertia = DMat3::from_diagonal(DVec3::splat(trace(&about))) - about;
    (volume, origin + center, inertia)
}

/// Whether all eigenvalues of a symmetric matrix are above this (Sylvester).
fn is_positive(matrix: &DMat3, least: f64) -> bool {
    let rest = *matrix - DMat3::from_diagonal(DVec3::splat(least));
    let minor = rest.x_axis.x * rest.y_axis.y - rest.x_axis.y * rest.y_axis.x;
    rest.x_axis.x > 0.0 && minor > 0.0 && rest.determinant() > 0.0
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

    /// The same shape with a part of the mass.
    pub fn part(&self, part: f64) -> Self {
        Self {
            mass: self.mass * part,
            center: self.center,
            inertia: self.inertia * part,
            inverse_inertia: self.inverse_inertia * (1.0 / part),
        }
    }

    /// The inverse of the inertia in world axes, 1/(kg m²).
    pub fn inverse_inertia_at(&self, orientation: DQuat) -> DMat3 {
        let turn = DMat3::from_quat(orientation);
        turn * self.inverse_inertia * turn.transpose()
    }

    fn momentum(&self, orientation: DQuat, spin: DVec3) -> DVec3 {
        orientation * (self.inertia * (orientation.conjugate() * spin))
    }

    /// How fast it turns with this angular momentum, rad/s.
    pub fn spin(&self, orientation: DQuat, momentum: DVec3) -> DVec3 {
        orientation * (self.inverse_inertia * (orientation.conjugate() * momentum))
    }
}

impl RigidState {
    /// Where the tool is.
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

    /// J
    pub fn kinetic_energy(&self, mass: &RigidMass) -> f64 {
        0.5 * (mass.mass * self.velocity.length_squared() + self.spin(mass).dot(self.angular_momentum))
    }

    /// How fast it turns on its way through `duration` seconds: the midpoint rule, which is of order 2 and keeps the angular momentum.
    pub fn mean_spin(&self, mass: &RigidMass, duration: f64) -> DVec3 {
        let half = turned(self.orientation, self.spin(mass) * (0.5 * duration));
        mass.spin(half, self.angular_momentum)
    }

    /// Moves it on for `duration` seconds with its velocity.
    pub fn drift(&mut self, mass: &RigidMass, duration: f64) {
        self.center += self.velocity * duration;
        self.turn(mass, duration);
    }

    fn turn(&mut self, mass: &RigidMass, duration: f64) {
        let spin = self.mean_spin(mass, duration);
        self.orientation = turned(self.orientation, spin * duration);
    }

    /// A free flight of `duration` seconds with this acceleration and torque.
    pub fn fly(&mut self, mass: &RigidMass, (acceleration, torque): (DVec3, DVec3), duration: f64) {
        self.center += (self.velocity + acceleration * (0.5 * duration)) * duration;
        self.velocity += acceleration * duration;
        let turn = self.spin(mass).length() * duration;
        let parts = (turn / TURN).ceil().clamp(1.0, PARTS);
        for _ in 0..parts as u32 {
            self.angular_momentum += torque * (duration / parts);
            self.turn(mass, duration / parts);
        }
    }

    /// Takes an impulse, given with its moment about the tool's position.
    pub fn take(&mut self, mass: &RigidMass, load: &ToolLoad) {
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
    /// At rest, where the tool is.
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
        rigid.place(pose);
        Ok(rigid)
    }

    /// Puts it there, as fast as it is.
    pub fn place(&mut self, pose: &Pose) {
        let spin = self.motion.spin(&self.mass);
        self.motion.orientation = exact(pose.orientation);
        self.motion.center = pose.position.as_dvec3() + self.motion.orientation * self.mass.center;
        self.motion.angular_momentum = self.mass.momentum(self.motion.orientation, spin);
    }

    /// Has it move so: the velocity of its centre of mass, m/s, and how fast it turns, rad/s.
    pub fn set_velocity(&mut self, velocity: Vec3, spin: Vec3) {
        self.motion.velocity = velocity.as_dvec3();
        self.motion.angular_momentum = self.mass.momentum(self.motion.orientation, spin.as_dvec3());
    }

    /// The velocity of its centre of mass, m/s, and how fast it turns, rad/s.
    pub fn velocity(&self) -> (Vec3, Vec3) {
        let finite = |vector: DVec3| vector.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
        (finite(self.motion.velocity), finite(self.motion.spin(&self.mass)))
    }

    /// A step has moved it so. Where that leads beyond all bounds it stops instead.
    pub fn arrive(&mut self, motion: RigidState) {
        (self.force, self.torque) = (DVec3::ZERO, DVec3::ZERO);
        let reaches = motion.position(&self.mass).abs().max_element() <= f64::from(FURTHEST);
        if motion.is_finite() && reaches {
            self.motion = motion;
        } else {
            (self.motion.velocity, self.motion.angular_momentum) = (DVec3::ZERO, DVec3::ZERO);
        }
    }

    /// What accelerates it in the next step beside contacts: m/s², and N m.
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
