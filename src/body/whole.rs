//! A body as a whole: where it lies, what it weighs, and where it is moved.

use glam::{DVec3, Quat, Vec3};

use super::Body;
#[cfg(doc)]
use crate::base::Error;
use crate::base::{Result, ensure, finite, memory};
use crate::def::{CollisionFilter, expect_count, finite_vector};
use crate::geometry::{Bounds, vertex_normals};
use crate::solver::close;

impl Body {
    /// The box about its nodes, m: the lowest and the highest coordinates.
    pub fn bounds(&self) -> [Vec3; 2] {
        let bounds = Bounds::of(self.positions().iter().copied());
        [bounds.min, bounds.max]
    }

    /// Writes the mass of each node, kg: as [`Body::node_mass`].
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: not one place for each node.
    pub fn node_masses(&self, masses: &mut [f32]) -> Result<()> {
        expect_count("masses", masses.len(), self.node_count())?;
        for (node, mass) in (0..).zip(masses) {
            *mass = self.system.masses[self.system.order.own(node) as usize];
        }
        Ok(())
    }

    /// Writes the unit normal of its surface at each node, outward: the mean of the triangles' by area; 0 of a node
    /// without a triangle.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: not one place for each node.
    pub fn normals(&self, normals: &mut [Vec3]) -> Result<()> {
        expect_count("normals", normals.len(), self.node_count())?;
        let [low, high] = self.bounds();
        let scale = 1.0 / (high - low).max_element();
        vertex_normals(self.positions(), &self.system.surface, scale, normals);
        Ok(())
    }

    /// Turns it about `pivot`, m, and then shifts it by `translation`, m; `None`: about the middle of its box. Pins
    /// and velocities go with it, nothing is swept, and what is viscous relaxes, as in [`Body::set_positions`].
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a number is not finite, the rotation is zero, or a node would be at infinity.
    /// [`Error::OutOfMemory`]. Then nothing has changed.
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
        let place = |position: &Vec3| rotation * (position.as_dvec3() - pivot) + pivot + translation.as_dvec3();
        let positions = memory::collected(self.positions().iter().map(|position| place(position).as_vec3()))?;
        for (node, position) in positions.iter().enumerate() {
            ensure!(
                position.is_finite(),
                "translation is {translation}: node {node} would be at infinity"
            );
        }
        let turned = |velocity: &Vec3| (rotation * velocity.as_dvec3()).as_vec3();
        let velocities = memory::collected(self.velocities().iter().map(turned))?;
        self.set_positions(&positions)?;
        if rotation.xyz() == DVec3::ZERO {
            return Ok(());
        }
        self.set_velocities(&velocities)
    }

    /// Changes the velocity of nodes at once by an impulse on each, N s; nothing of a pinned node or one that a tool
    /// holds, nor along an axis along which a node is held. A point that is bound to nodes hands it on to those.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: not one impulse for each node, no such node, or an impulse is not finite. Then
    /// nothing has changed.
    pub fn apply_impulses(&mut self, nodes: &[u32], impulses: &[Vec3]) -> Result<()> {
        expect_count("impulses", impulses.len(), nodes.len())?;
        for (index, (&node, impulse)) in nodes.iter().zip(impulses).enumerate() {
            self.check_node(&format_args!("nodes[{index}]"), node)?;
            ensure!(impulse.is_finite(), "impulses[{index}] is {impulse}: must be finite");
        }
        close(&mut self.system);
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
        self.follow_velocities();
        Ok(())
    }

    /// The part of the world's gravity that acts on it: 1 unless it was set.
    pub fn gravity_scale(&self) -> f32 {
        self.system.gravity_scale
    }

    /// Lets this part of the world's gravity act on it from the next step on: 0 none, -1 upward.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: it is not finite.
    pub fn set_gravity_scale(&mut self, scale: f32) -> Result<()> {
        finite("gravity_scale", scale)?;
        if std::mem::replace(&mut self.system.gravity_scale, scale) != scale {
            self.system.wake();
        }
        Ok(())
    }

    /// What acts on all its nodes beside gravity, m/s²: 0 unless it was set.
    pub fn acceleration(&self) -> Vec3 {
        self.system.acceleration
    }

    /// Lets this acceleration act on all nodes beside gravity from the next step on: a wind, or a field that is the same everywhere.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: it is not finite.
    pub fn set_acceleration(&mut self, acceleration: Vec3) -> Result<()> {
        finite_vector("acceleration", acceleration)?;
        if std::mem::replace(&mut self.system.acceleration, acceleration) != acceleration {
            self.system.wake();
        }
        Ok(())
    }

    /// Has tools and other bodies meet it as this filter says, from the next step on. What lies within it or them then is pushed out.
    pub fn set_collision_filter(&mut self, filter: CollisionFilter) {
        self.system.contact.filter = filter;
        self.system.wake();
        if let Some(contacts) = &mut self.system.contacts {
            contacts.set_filter(filter);
        }
    }

    /// What it meets.
    pub fn collision_filter(&self) -> CollisionFilter {
        self.system.contact.filter
    }

    /// The pressure of its cavities at their volumes at rest, Pa: as it was made or set; 0 without cavities.
    pub fn pressure(&self) -> f32 {
        self.system.forces.pressure()
    }

    /// What the caller keeps with it: 0 unless it was set, and after a snapshot.
    pub fn user_data(&self) -> usize {
        self.user_data
    }

    /// Keeps a number or a pointer of the caller's with it; it changes no motion.
    pub fn set_user_data(&mut self, data: usize) {
        self.user_data = data;
    }
}
