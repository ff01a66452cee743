//! Properties and motion of a body as a whole.

use glam::{DVec3, Quat, Vec3};

use super::Body;
#[cfg(doc)]
use crate::base::Error;
use crate::base::{Result, ensure, finite, memory};
use crate::def::{CollisionFilter, expect_count, finite_vector};
use crate::geometry::{Aabb, vertex_normals};
use crate::solver::flush_half_kick;

impl Body {
    /// The bounding box of the nodes, m: the lowest and the highest coordinates.
    pub fn bounds(&self) -> [Vec3; 2] {
        let bounds = Aabb::of(self.positions().iter().copied());
        [bounds.min, bounds.max]
    }

    /// Writes the mass of each node, kg, as [`Body::node_mass`].
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the length of `masses` is not the number of nodes.
    pub fn node_masses(&self, masses: &mut [f32]) -> Result<()> {
        expect_count("masses", masses.len(), self.node_count())?;
        for (node, mass) in (0..).zip(masses) {
            *mass = self.system.masses[self.system.order.own(node) as usize];
        }
        Ok(())
    }

    /// Writes the outward unit normal of the surface at each node, averaged over its triangles by area. It is 0 at a
    /// node without a triangle.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the length of `normals` is not the number of nodes.
    pub fn normals(&self, normals: &mut [Vec3]) -> Result<()> {
        expect_count("normals", normals.len(), self.node_count())?;
        let [low, high] = self.bounds();
        let scale = 1.0 / (high - low).max_element();
        vertex_normals(self.positions(), &self.system.surface, scale, normals);
        Ok(())
    }

    /// Rotates the body about `pivot`, m, and then translates it by `translation`, m. A `pivot` of `None` is the center
    /// of its bounding box. Pins and velocities are transformed too. No contact occurs on the path, and viscous stress
    /// relaxes, as in [`Body::set_positions`].
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a number is not finite, the rotation is zero, or a node would be at infinity.
    /// [`Error::OutOfMemory`]. An error changes nothing.
    pub fn transform(&mut self, translation: Vec3, rotation: Quat, pivot: Option<Vec3>) -> Result<()> {
        finite_vector("translation", translation)?;
        finite_vector("pivot", pivot.unwrap_or_default())?;
        let rotation = rotation.as_dquat();
        let length = rotation.length();
        ensure!(
            length > 0.0 && length.is_finite(),
            "rotation is {rotation}: must be finite and not zero"
        );
        let rotation = rotation / length;
        let [low, high] = self.bounds().map(|corner| corner.as_dvec3());
        let pivot = pivot.map_or((low + high) * 0.5, |pivot| pivot.as_dvec3());
        let transformed = |position: &Vec3| rotation * (position.as_dvec3() - pivot) + pivot + translation.as_dvec3();
        let positions = memory::collected(self.positions().iter().map(|position| transformed(position).as_vec3()))?;
        for (node, position) in positions.iter().enumerate() {
            ensure!(
                position.is_finite(),
                "translation is {translation}: node {node} would be at infinity"
            );
        }
        let rotated = |velocity: &Vec3| (rotation * velocity.as_dvec3()).as_vec3();
        let velocities = memory::collected(self.velocities().iter().map(rotated))?;
        self.set_positions(&positions)?;
        if rotation.xyz() == DVec3::ZERO {
            return Ok(());
        }
        self.set_velocities(&velocities)
    }

    /// Applies an impulse to each of `nodes`, N s, which changes velocities at once. The impulse is ignored on a pinned
    /// node, on a node that a tool holds, and along each axis along which a node is held. A point that is bound to
    /// nodes distributes it to these nodes.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the number of impulses is not the number of nodes, there is no such node, or an
    /// impulse is not finite. An error changes nothing.
    pub fn apply_impulses(&mut self, nodes: &[u32], impulses: &[Vec3]) -> Result<()> {
        expect_count("impulses", impulses.len(), nodes.len())?;
        for (index, (&node, impulse)) in nodes.iter().zip(impulses).enumerate() {
            self.check_node(&format_args!("nodes[{index}]"), node)?;
            ensure!(impulse.is_finite(), "impulses[{index}] is {impulse}: must be finite");
        }
        flush_half_kick(&mut self.system);
        for (&node, &impulse) in nodes.iter().zip(impulses) {
            for (own, weight) in self.system.movers(self.system.order.own(node)) {
                let change = impulse * (weight * self.system.inverse_masses[own as usize]);
                let change = Vec3::select(self.system.pins.partial_axes_of(own), Vec3::ZERO, change);
                let velocity = self.system.state.velocities().get(own as usize);
                let velocity = (velocity + change).clamp(Vec3::MIN, Vec3::MAX);
                self.system.wake_at(own);
                self.set_velocity(self.system.order.caller(own), velocity);
            }
        }
        self.update_from_velocities();
        Ok(())
    }

    /// The factor of the world's gravity for this body: 1 unless it was set.
    pub fn gravity_scale(&self) -> f32 {
        self.system.gravity_scale
    }

    /// Sets the factor of the world's gravity for this body from the next step on. 0 is no gravity, -1 upward.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the factor is not finite.
    pub fn set_gravity_scale(&mut self, scale: f32) -> Result<()> {
        finite("gravity_scale", scale)?;
        if std::mem::replace(&mut self.system.gravity_scale, scale) != scale {
            self.system.wake();
        }
        Ok(())
    }

    /// The acceleration of all nodes in addition to gravity, m/s²: 0 unless it was set.
    pub fn acceleration(&self) -> Vec3 {
        self.system.acceleration
    }

    /// Sets an acceleration of all nodes in addition to gravity from the next step on, such as wind or a uniform field,
    /// m/s².
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the acceleration is not finite.
    pub fn set_acceleration(&mut self, acceleration: Vec3) -> Result<()> {
        finite_vector("acceleration", acceleration)?;
        if std::mem::replace(&mut self.system.acceleration, acceleration) != acceleration {
            self.system.wake();
        }
        Ok(())
    }

    /// Sets the collision filter from the next step on. Tissue that is then inside a tool or another body is pushed
    /// out.
    pub fn set_collision_filter(&mut self, filter: CollisionFilter) {
        self.system.contact.filter = filter;
        self.system.wake();
        if let Some(contacts) = &mut self.system.contacts {
            contacts.set_filter(filter);
        }
    }

    /// The collision filter.
    pub fn collision_filter(&self) -> CollisionFilter {
        self.system.contact.filter
    }

    /// The cavity overpressure at rest volume, Pa, as it was at creation or set later. It is 0 without cavities.
    pub fn pressure(&self) -> f32 {
        self.system.forces.pressure()
    }

    /// The caller's data: 0 unless it was set, and after loading a snapshot.
    pub fn user_data(&self) -> usize {
        self.user_data
    }

    /// Stores a number or a pointer for the caller. It does not affect the simulation.
    pub fn set_user_data(&mut self, data: usize) {
        self.user_data = data;
    }
}
