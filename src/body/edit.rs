//! What a caller does to a body between steps.

use glam::Vec3;

use super::definition::{Spring, distance, expect_count, finite_vector, finite_vectors, not_negative};
use super::{Body, Bounds, Vectors};
use crate::error::{Error, Result};
use crate::solver::{GravityKicks, Stability};

impl Body {
    /// Adds `force`, in newtons, to what acts on `node` over the whole next step; nothing on a pinned node.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, or the force is not finite.
    pub fn apply_force(&mut self, node: u32, force: Vec3) -> Result<()> {
        self.check_node(&"node", node)?;
        finite_vector("force", force)?;
        self.apply_forces(&[node], &[force])
    }

    /// Adds a force, in newtons, to each of `nodes`, which may name a node more than once.
    ///
    /// # Errors
    /// As [`Body::apply_force`]; then no force is added at all.
    pub fn apply_forces(&mut self, nodes: &[u32], forces: &[Vec3]) -> Result<()> {
        expect_count("forces", forces.len(), nodes.len())?;
        for (index, (&node, &force)) in nodes.iter().zip(forces).enumerate() {
            self.check_node(&format_args!("nodes[{index}]"), node)?;
            if !force.is_finite() {
                return Err(Error::invalid(format!("forces[{index}] is {force}: must be finite")));
            }
        }
        let count = self.node_count();
        let applied = match &mut self.applied {
            Some(applied) => applied,
            None => self.applied.insert(Vectors::zeros(count)?),
        };
        for (&node, &force) in nodes.iter().zip(forces) {
            let node = node as usize;
            if self.inverse_masses[node] == 0.0 {
                continue;
            }
            // Sums of finite forces stay finite.
            let sum = (applied.get(node) + force).clamp(Vec3::MIN, Vec3::MAX);
            applied.set(node, sum);
            self.forces_applied = true;
        }
        Ok(())
    }

    /// Puts all nodes, pinned ones too, at these places, in metres; velocities stay, and nothing is swept.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: not one position for each node, or one that is not finite.
    pub fn set_positions(&mut self, positions: &[Vec3]) -> Result<()> {
        expect_count("positions", positions.len(), self.node_count())?;
        finite_vectors("positions", positions)?;
        self.place(positions);
        Ok(())
    }

    /// Gives all nodes these velocities, in m/s; a pinned node keeps its own.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: not one velocity for each node, or one that is not finite.
    pub fn set_velocities(&mut self, velocities: &[Vec3]) -> Result<()> {
        expect_count("velocities", velocities.len(), self.node_count())?;
        finite_vectors("velocities", velocities)?;
        for (node, &velocity) in velocities.iter().enumerate() {
            if self.inverse_masses[node] > 0.0 {
                self.set_velocity(node, velocity);
            }
        }
        self.carry.gravity = GravityKicks::new(Bounds::of(self.state.velocities().iter()));
        Ok(())
    }

    /// Holds `node` where it is, from now on; nothing where it is held already.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node.
    pub fn pin(&mut self, node: u32) -> Result<()> {
        self.check_node(&"node", node)?;
        if self.pins.get(node).is_none() {
            self.pins.insert(node)?;
            self.inverse_masses[node as usize] = 0.0;
            self.set_velocity(node as usize, Vec3::ZERO);
            self.carry.stability = Stability::UNKNOWN;
        }
        Ok(())
    }

    /// Lets go of `node`, which goes on as it was led in the last step; nothing where it is not held.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, or it has no mass and is pinned for good.
    pub fn unpin(&mut self, node: u32) -> Result<()> {
        self.check_node(&"node", node)?;
        let mass = self.masses[node as usize];
        if mass == 0.0 {
            return Err(Error::invalid(format!(
                "node {node} has no mass: it is pinned for good"
            )));
        }
        if self.pins.remove(node) {
            self.inverse_masses[node as usize] = 1.0 / mass;
            self.carry.stability = Stability::UNKNOWN;
        }
        Ok(())
    }

    /// Leads a pinned node on a straight line to `position`, in metres, where it is at the end of the next step.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, it is not pinned, or the position is not finite.
    pub fn move_pin(&mut self, node: u32, position: Vec3) -> Result<()> {
        self.check_node(&"node", node)?;
        finite_vector("position", position)?;
        match self.pins.get_mut(node) {
            Some(pin) => pin.target = Some(position),
            None => return Err(not_pinned(node)),
        }
        Ok(())
    }

    /// What holds a pinned node against its springs and its weight, in newtons, mean over the last step.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, or it is not pinned.
    pub fn pin_force(&self, node: u32) -> Result<Vec3> {
        self.check_node(&"node", node)?;
        self.pins.get(node).map(|pin| pin.force).ok_or_else(|| not_pinned(node))
    }

    /// Joins two nodes by a spring without damping: `stiffness` in N/m, `rest_length` in metres, `None`: the current
    /// distance.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, the nodes are one, they have a spring already, or a number is
    /// negative or not finite. [`Error::Capacity`]: a node has no free place in a row of fixed length.
    /// [`Error::OutOfMemory`].
    pub fn add_spring(&mut self, a: u32, b: u32, stiffness: f32, rest_length: Option<f32>) -> Result<()> {
        self.check_pair(a, b)?;
        not_negative("stiffness", stiffness)?;
        let rest_length = match rest_length {
            Some(length) => length,
            None => distance(
                self.state.positions().get(a as usize),
                self.state.positions().get(b as usize),
            ),
        };
        not_negative("rest_length", rest_length)?;
        self.springs.add(&Spring {
            nodes: [a, b],
            stiffness,
            rest_length,
            damping: 0.0,
        })?;
        self.springs_changed();
        Ok(())
    }

    /// Removes the spring between two nodes.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, or no spring between them.
    pub fn remove_spring(&mut self, a: u32, b: u32) -> Result<()> {
        self.check_pair(a, b)?;
        self.springs.remove(a, b)?;
        self.springs_changed();
        Ok(())
    }

    fn springs_changed(&mut self) {
        self.forces_current = false;
        self.carry.stability = Stability::UNKNOWN;
    }

    fn set_velocity(&mut self, node: usize, velocity: Vec3) {
        self.state.velocities_mut().set(node, velocity);
        self.published_velocities[node] = velocity;
        if self.springs.damped() {
            self.forces_current = false;
        }
    }

    fn check_node(&self, name: &dyn std::fmt::Display, node: u32) -> Result<()> {
        if (node as usize) < self.node_count() {
            return Ok(());
        }
        Err(Error::invalid(format!(
            "{name} is {node}: the body has {} nodes",
            self.node_count()
        )))
    }

    fn check_pair(&self, a: u32, b: u32) -> Result<()> {
        self.check_node(&"a", a)?;
        self.check_node(&"b", b)?;
        if a == b {
            return Err(Error::invalid(format!(
                "a and b are both {a}: a spring joins two nodes"
            )));
        }
        Ok(())
    }
}

fn not_pinned(node: u32) -> Error {
    Error::invalid(format!("node {node} is not pinned"))
}
