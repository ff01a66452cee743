//! Changes of a body by the caller between steps.

use glam::{BVec3, Vec3};

use super::Body;
use crate::base::{Error, Result, ensure, finite, memory, not_negative};
use crate::def::{Spring, distance, expect_count, finite_vector, finite_vectors};
use crate::geometry::Aabb;
use crate::solver::{Changed, GravityKicks, correct_deferred_kick, flush_half_kick};
use crate::springs::{Link, already_joined, not_joined, pull};

impl Body {
    /// Adds `force`, N, to the external force on `node` during the whole next step. The force is ignored on a pinned
    /// node, on a node that a tool holds, and along each axis along which a node is held. A point that is bound to
    /// nodes distributes the force to these nodes by its weights.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, or the force is not finite.
    pub fn apply_force(&mut self, node: u32, force: Vec3) -> Result<()> {
        self.check_node(&"node", node)?;
        finite_vector("force", force)?;
        self.apply_forces(&[node], &[force])
    }

    /// Adds a force, N, to each of `nodes`, which can contain a node more than once.
    ///
    /// # Errors
    /// As [`Body::apply_force`]. An error adds no force at all.
    pub fn apply_forces(&mut self, nodes: &[u32], forces: &[Vec3]) -> Result<()> {
        expect_count("forces", forces.len(), nodes.len())?;
        for (index, (&node, &force)) in nodes.iter().zip(forces).enumerate() {
            self.check_node(&format_args!("nodes[{index}]"), node)?;
            ensure!(force.is_finite(), "forces[{index}] is {force}: must be finite");
        }
        if self.system.applied.is_none() {
            self.system.applied = Some(self.system.zeros()?);
        }
        let Some(applied) = &mut self.system.applied else {
            return Ok(());
        };
        let mut add_force = |node: u32, force: Vec3| {
            if self.system.inverse_masses[node as usize] == 0.0 {
                return;
            }
            let held = self.system.pins.partial_axes_of(node);
            let force = Vec3::select(held, Vec3::ZERO, force);
            // Sums of finite forces stay finite.
            let sum = (applied.get(node as usize) + force).clamp(Vec3::MIN, Vec3::MAX);
            applied.set(node as usize, sum);
            self.system.forces_applied = true;
        };
        for (&node, &force) in nodes.iter().zip(forces) {
            let own = self.system.order.own(node);
            match self.system.bindings.as_ref().and_then(|bindings| bindings.get(own)) {
                Some(bound) => bound
                    .weighted_nodes()
                    .for_each(|(node, weight)| add_force(node, force * weight)),
                None => add_force(own, force),
            }
        }
        if self.system.any_tile_asleep() {
            for &node in nodes {
                let own = self.system.order.own(node);
                self.system.movers(own).for_each(|(node, _)| self.system.wake_at(node));
            }
        }
        Ok(())
    }

    /// Sets the positions of all nodes, pinned ones included, m. Velocities stay, and no contact occurs on the path.
    /// Attached nodes stay attached at their new positions. Points that are bound to nodes follow these nodes.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the number of positions is not the number of nodes, or a position is not finite.
    pub fn set_positions(&mut self, positions: &[Vec3]) -> Result<()> {
        expect_count("positions", positions.len(), self.node_count())?;
        finite_vectors("positions", positions)?;
        flush_half_kick(&mut self.system);
        self.set_node_positions(positions);
        Ok(())
    }

    /// Sets the velocities of all nodes, m/s. A pinned node keeps its velocity, and every node keeps it along the axes
    /// along which it is held.
    /// # Errors
    /// [`Error::InvalidArgument`]: the number of velocities is not the number of nodes, or a velocity is not finite.
    pub fn set_velocities(&mut self, velocities: &[Vec3]) -> Result<()> {
        expect_count("velocities", velocities.len(), self.node_count())?;
        finite_vectors("velocities", velocities)?;
        flush_half_kick(&mut self.system);
        self.system.wake();
        for (node, &velocity) in (0..).zip(velocities) {
            let own = self.system.order.own(node);
            if self.system.inverse_masses[own as usize] > 0.0 {
                let current = self.system.state.velocities().get(own as usize);
                self.set_velocity(
                    node,
                    Vec3::select(self.system.pins.partial_axes_of(own), current, velocity),
                );
            }
        }
        self.update_from_velocities();
        Ok(())
    }

    /// Updates everything that is derived from velocities.
    pub(super) fn update_from_velocities(&mut self) {
        self.system.update_bound_points();
        self.system.carry.gravity = GravityKicks::new(Aabb::of(self.system.state.velocities().iter()));
        self.system.changed(Changed::Trajectory);
    }

    /// Holds `node` at its position from now on. Does nothing if it is already held.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a tool holds it, or it is a point that is bound to nodes.
    pub fn pin(&mut self, node: u32) -> Result<()> {
        self.pin_axes(node, [true; 3])
    }

    /// Holds `node` at its position along those of the axes x, y and z that are `true`, and along no others. Use it for
    /// a symmetry plane, a rail or a sliding support. Along the other axes the node moves freely with its mass. All
    /// `true` is [`Body::pin`], all `false` [`Body::unpin`].
    ///
    /// An axis that was already held stays as it is. A released axis continues with the prescribed velocity of the last
    /// step. If the axes change, a target of [`Body::move_pin`] since the last step is discarded, and so are applied
    /// forces along newly held axes. The longest stable substep is computed as if the node were free.
    ///
    /// A tool acts on the node along its free axes only. The pin takes the rest of the force, which [`Body::pin_force`]
    /// includes. Where a tool pushes almost only along held axes, it enters the tissue with little force, as at a
    /// pinned node.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a tool holds it, it is a point that is bound to nodes, or it
    /// has no mass and is therefore permanently pinned along all axes.
    pub fn pin_axes(&mut self, node: u32, axes: [bool; 3]) -> Result<()> {
        let axes = BVec3::from(axes);
        if !axes.any() {
            return self.unpin(node);
        }
        self.check_pinnable(&"node", node)?;
        let own = self.system.order.own(node);
        let before = self.system.pins.axes_of(own);
        if axes == before {
            return Ok(());
        }
        let inverse_mass = if axes.all() {
            0.0
        } else {
            1.0 / self.mass_to_unpin(node)?
        };
        self.system.wake_at(own);
        if before.any() {
            flush_half_kick(&mut self.system);
        }
        self.system.pins.hold(own, axes)?;
        self.system.inverse_masses[own as usize] = inverse_mass;
        let velocity = self.system.state.velocities().get(own as usize);
        self.set_velocity(node, Vec3::select(axes & !before, Vec3::ZERO, velocity));
        if let Some(applied) = &mut self.system.applied {
            let force = applied.get(own as usize);
            applied.set(own as usize, Vec3::select(axes, Vec3::ZERO, force));
        }
        self.system.scale_masses(self.system.carry.scaling_substep);
        self.system.changed(Changed::Pin);
        Ok(())
    }

    /// Releases `node` along all axes. It continues with the prescribed velocity of the last step. Does nothing if it
    /// is not held.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a tool holds it, or it has no mass and is permanently pinned.
    pub fn unpin(&mut self, node: u32) -> Result<()> {
        self.check_pinnable(&"node", node)?;
        let own = self.system.order.own(node);
        let mass = self.mass_to_unpin(node)?;
        if self.system.pins.get(own).is_some() {
            self.system.wake_at(own);
            flush_half_kick(&mut self.system);
            self.system.pins.remove(own);
            self.system.inverse_masses[own as usize] = 1.0 / mass;
            self.system.scale_masses(self.system.carry.scaling_substep);
            self.system.changed(Changed::Pin);
        }
        Ok(())
    }

    /// Moves a pinned node in a straight line to `position`, m, where it arrives at the end of the next step. A node
    /// that is held along some axes moves along these axes only.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, it is not pinned, a tool holds it, or the position is not
    /// finite.
    pub fn move_pin(&mut self, node: u32, position: Vec3) -> Result<()> {
        self.check_pinnable(&"node", node)?;
        finite_vector("position", position)?;
        match self.system.pins.get_mut(self.system.order.own(node)) {
            Some(pin) => pin.target = Some(position),
            None => return Err(not_pinned(node)),
        }
        self.system.wake_at(self.system.order.own(node));
        Ok(())
    }

    /// The force that holds a pinned node against its springs and its weight, N, averaged over the last step. It is 0
    /// along axes along which the node is not held.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, it is not pinned, or a tool holds it
    /// ([`World::attachment_force`](crate::World::attachment_force)).
    pub fn pin_force(&self, node: u32) -> Result<Vec3> {
        self.check_node(&"node", node)?;
        self.system.check_not_attached(&"node", node)?;
        let pin = self.system.pins.get(self.system.order.own(node));
        let pin = pin.ok_or_else(|| not_pinned(node))?;
        Ok(self.system.mean_force(pin))
    }

    /// Joins two nodes by a linear spring without damping. `stiffness` is in N/m, and `rest_length` in m. `None` is the
    /// current distance.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, the nodes are the same, they already have a spring, one is a
    /// point that is bound to nodes, or a number is negative or not finite. [`Error::Capacity`]: a node has no free
    /// slot in a storage with a fixed number. [`Error::OutOfMemory`].
    pub fn add_spring(&mut self, a: u32, b: u32, stiffness: f32, rest_length: Option<f32>) -> Result<()> {
        let nodes = self.check_pair(a, b)?;
        self.check_not_bound(&"a", a)?;
        self.check_not_bound(&"b", b)?;
        not_negative("stiffness", stiffness)?;
        let rest_length = rest_length.unwrap_or_else(|| {
            let [a, b] = nodes.map(|node| self.system.state.positions().get(node as usize));
            distance(a, b)
        });
        not_negative("rest_length", rest_length)?;
        if let Some(scaling) = &mut self.system.scaling {
            scaling.reserve(nodes.len())?;
        }
        let spring = Spring {
            nodes,
            stiffness,
            rest_length,
            damping: 0.0,
        };
        let springs = self.system.forces.springs.spring_count() + 1;
        self.system.integrator.reserve_springs(springs)?;
        if let Some(cut_state) = &mut self.cut_state {
            cut_state.reserve_spring([a, b], &self.system.order)?;
        }
        // Errors name the caller's indices.
        self.system.forces.springs.add(&spring).map_err(|error| match error {
            Error::InvalidArgument(_) => already_joined(a, b),
            error => error,
        })?;
        if let Some(cut_state) = &mut self.cut_state {
            cut_state.add_spring([a, b], &self.system.order);
        }
        if let Some(sleep_state) = &mut self.system.sleep_state {
            sleep_state.join([a, b].map(|node| self.system.order.own(node)));
        }
        self.system.changed(Changed::Stiffness);
        self.correct_half_kick_for_spring(Link::ends(&spring), -1.0);
        let nodes = [nodes[0].min(nodes[1]), nodes[0].max(nodes[1])];
        self.system.update_added_masses(&nodes);
        self.system.update_stability(&nodes);
        Ok(())
    }

    /// Removes the spring between two nodes, and everything else along this edge, with or without a spring. Tetrahedra
    /// of [`Model::Tetrahedra`](crate::Model::Tetrahedra) with this edge are removed with their fibers, and so is the
    /// bending of triangles with it. A cavity whose surface has the edge becomes open: it keeps neither its volume nor
    /// its pressure, and nothing is inside it for other tissue ([`is_closed`](Self::is_closed)).
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, or nothing to remove between them.
    pub fn remove_spring(&mut self, a: u32, b: u32) -> Result<()> {
        let nodes @ [own_a, own_b] = self.check_pair(a, b)?;
        let link = self.link(nodes);
        // Everything that can fail comes first.
        if let Some(link) = link {
            if let Some(cut_state) = &mut self.cut_state {
                cut_state.log.reserve_removed_spring()?;
            }
            self.remove_link(nodes, link)?;
            if let Some(cut_state) = &mut self.cut_state {
                cut_state.log.add_removed_spring([a, b]);
            }
        }
        let removed = self.system.forces.remove_edge(own_a, own_b);
        if removed > 0 {
            self.system.changed(Changed::Stiffness);
            // Averages over fewer tetrahedra give other pressures, although nothing was deformed.
            self.system
                .forces
                .recompute_elastic_state(self.system.state.positions());
        }
        ensure!(link.is_some() || removed > 0, not_joined(a, b));
        self.system.is_cut_open = self.system.is_cut_open || self.is_surface_edge(a, b);
        Ok(())
    }

    /// Sets the cavity overpressure at rest volume, Pa, from the next step on: see
    /// [`BodyDefinition::pressure`](crate::BodyDefinition::pressure). A cavity that was cut open has no pressure.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the pressure is not finite, or the body was created with neither an
    /// `enclosed_stiffness` nor a `pressure`.
    pub fn set_pressure(&mut self, pressure: f32) -> Result<()> {
        finite("pressure", pressure)?;
        ensure!(
            self.system.forces.set_pressure(pressure),
            "pressure is {pressure} Pa, and the body was made with neither an enclosed_stiffness nor a pressure"
        );
        self.system.changed(Changed::Pressure);
        Ok(())
    }

    /// True if two nodes are corners of one triangle of the surface.
    fn is_surface_edge(&mut self, a: u32, b: u32) -> bool {
        // The set of corners is built at the first removal. In a cut through a volume most nodes are no corners.
        if self.surface_corners.is_empty()
            && !self.system.surface.is_empty()
            && let Ok(corners) = memory::filled(0_u64, self.node_count().div_ceil(64))
        {
            self.surface_corners = corners;
            for &corner in self.system.surface.as_flattened() {
                self.surface_corners[corner as usize / 64] |= 1 << (corner % 64);
            }
        }
        // Out of memory: the node can be a corner.
        let is_corner = |node: u32| {
            self.surface_corners
                .get(node as usize / 64)
                .is_none_or(|bits| bits >> (node % 64) & 1 == 1)
        };
        let has_edge = |triangle: &[u32; 3]| triangle.contains(&a) && triangle.contains(&b);
        is_corner(a) && is_corner(b) && self.system.surface.iter().any(has_edge)
    }

    /// Removes a spring, given as the link of its first node.
    fn remove_link(&mut self, [own_a, own_b]: [u32; 2], link: Link) -> Result<()> {
        self.system.forces.springs.remove(own_a, own_b)?;
        if let Some(tear_queue) = &mut self.tear_queue {
            tear_queue.remove([own_a, own_b]);
        }
        self.system.changed(Changed::Stiffness);
        let other = Link {
            neighbor: own_a,
            ..link
        };
        self.correct_half_kick_for_spring([link, other], 1.0);
        let scaling = self.system.scaling.as_ref();
        if scaling.is_some_and(|scaling| scaling.concerns([own_a, own_b])) {
            self.system.update_added_masses(&[own_a, own_b]);
        }
        // Substeps that were stable stay stable. Without springs nothing limits them.
        if self.system.forces.springs.spring_count() == 0 {
            self.system.changed(Changed::SpringsSoftened);
        }
        Ok(())
    }

    /// Corrects the deferred half kick after a spring was added (sign -1) or removed (1), so that velocities stay the
    /// same. The spring is given as the link of each of its nodes.
    fn correct_half_kick_for_spring(&mut self, [a, b]: [Link; 2], sign: f32) {
        if self.system.carry.deferred_kick.is_none() {
            return;
        }
        self.discard_velocities();
        for (node, link) in [(b.neighbor, a), (a.neighbor, b)] {
            let [here, there] = [node, link.neighbor].map(|node| self.system.state.positions().get(node as usize));
            let lost_force = pull(node as usize, &link, there - here, None) * sign;
            correct_deferred_kick(&mut self.system, node, lost_force);
        }
    }

    /// The mass of a node that will be unpinned, kg.
    pub(super) fn mass_to_unpin(&self, node: u32) -> Result<f32> {
        let mass = self.system.masses[self.system.order.own(node) as usize];
        ensure!(mass != 0.0, "node {node} has no mass: it is pinned for good");
        Ok(mass)
    }

    pub(super) fn set_velocity(&mut self, node: u32, velocity: Vec3) {
        self.system.set_velocity(self.system.order.own(node) as usize, velocity);
        self.discard_velocities();
    }

    pub(crate) fn check_node(&self, name: &dyn std::fmt::Display, node: u32) -> Result<()> {
        ensure!(
            (node as usize) < self.node_count(),
            "{name} is {node}: the body has {} nodes",
            self.node_count()
        );
        Ok(())
    }

    /// True if the node is a point that is bound to nodes.
    pub(super) fn is_bound(&self, node: u32) -> bool {
        let bindings = self.system.bindings.as_ref();
        bindings.is_some_and(|bindings| bindings.get(self.system.order.own(node)).is_some())
    }

    /// Refuses a point that is bound to nodes: only these nodes move it.
    pub(super) fn check_not_bound(&self, name: &dyn std::fmt::Display, node: u32) -> Result<()> {
        ensure!(
            !self.is_bound(node),
            "{name} is {node}: a point of the surface that is bound to nodes, and goes where they go"
        );
        Ok(())
    }

    /// The internal indices of two nodes that a spring can join.
    pub(super) fn check_pair(&self, a: u32, b: u32) -> Result<[u32; 2]> {
        self.check_node(&"a", a)?;
        self.check_node(&"b", b)?;
        ensure!(a != b, "a and b are both {a}: a spring joins two nodes");
        Ok([a, b].map(|node| self.system.order.own(node)))
    }
}

fn not_pinned(node: u32) -> Error {
    Error::invalid(format!("node {node} is not pinned"))
}
