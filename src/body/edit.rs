//! What a caller does to a body between steps.

use glam::{BVec3, Vec3};

use super::Body;
use crate::base::{Error, Result, ensure, finite, memory, not_negative};
use crate::def::{Spring, distance, expect_count, finite_vector, finite_vectors};
use crate::geometry::Bounds;
use crate::solver::{Changed, GravityKicks, close, make_up_for};
use crate::springs::{Link, already_joined, not_joined, pull};

impl Body {
    /// Adds `force`, in newtons, to what acts on `node` over the whole next step; nothing on a pinned node or one that a tool holds, nor
    /// along an axis along which a node is held. A point that is bound to nodes, as cuts make them, hands it on to those by its weights.
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
            ensure!(force.is_finite(), "forces[{index}] is {force}: must be finite");
        }
        if self.system.applied.is_none() {
            self.system.applied = Some(self.system.zeros()?);
        }
        let Some(applied) = &mut self.system.applied else {
            return Ok(());
        };
        let mut push = |node: u32, force: Vec3| {
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
                Some(bound) => bound.parts().for_each(|(node, weight)| push(node, force * weight)),
                None => push(own, force),
            }
        }
        if self.system.sleeps() {
            for &node in nodes {
                let own = self.system.order.own(node);
                self.system.movers(own).for_each(|(node, _)| self.system.wake_at(node));
            }
        }
        Ok(())
    }

    /// Puts all nodes, pinned ones too, at these places, in metres; velocities stay, and nothing is swept. What tools hold they hold there.
    /// Points that are bound to nodes are where those are.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: not one position for each node, or one that is not finite.
    pub fn set_positions(&mut self, positions: &[Vec3]) -> Result<()> {
        expect_count("positions", positions.len(), self.node_count())?;
        finite_vectors("positions", positions)?;
        close(&mut self.system);
        self.place(positions);
        Ok(())
    }

    /// Gives all nodes these velocities, in m/s; a pinned node keeps its own, and along each axis along which it is held any node
    /// does.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: not one velocity for each node, or one that is not finite.
    pub fn set_velocities(&mut self, velocities: &[Vec3]) -> Result<()> {
        expect_count("velocities", velocities.len(), self.node_count())?;
        finite_vectors("velocities", velocities)?;
        close(&mut self.system);
        self.system.wake();
        for (node, &velocity) in (0..).zip(velocities) {
            let own = self.system.order.own(node);
            if self.system.inverse_masses[own as usize] > 0.0 {
                let kept = self.system.state.velocities().get(own as usize);
                self.set_velocity(
                    node,
                    Vec3::select(self.system.pins.partial_axes_of(own), kept, velocity),
                );
            }
        }
        self.follow_velocities();
        Ok(())
    }

    /// Has what is known of velocities be that of those that were set.
    pub(super) fn follow_velocities(&mut self) {
        self.system.follow_nodes();
        self.system.carry.gravity = GravityKicks::new(Bounds::of(self.system.state.velocities().iter()));
        self.system.changed(Changed::Course);
    }

    /// Holds `node` where it is, from now on; nothing where it is held already.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a tool holds it, or it is a point that is bound to nodes.
    pub fn pin(&mut self, node: u32) -> Result<()> {
        self.pin_axes(node, [true; 3])
    }

    /// Holds `node` where it is along those of the axes x, y and z that are `true`, from now on, and no others: a symmetry plane, a
    /// rail, a sliding support. Along the others it moves as a free node does, with its mass. All `true` is [`Body::pin`], all `false`
    /// [`Body::unpin`].
    ///
    /// An axis along which it was held already stays as it is, and one that it is let go of goes on as it was led in the last step. Where
    /// the axes change, what [`Body::move_pin`] has asked of the node since the last step is forgotten, and so are forces that act on
    /// it along an axis which is held now. For stability the node counts as free, so that the longest stable substep is one.
    ///
    /// A tool acts on the node along its free axes alone. What it does along the others the pin takes, and [`Body::pin_force`] has; where
    /// a tool pushes nearly along those only, the node does not give way, and the tool goes in with little force, as it does at a
    /// pinned node.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a tool holds it, it is a point that is bound to nodes, or it has no mass, and is
    /// pinned for good along all axes.
    pub fn pin_axes(&mut self, node: u32, axes: [bool; 3]) -> Result<()> {
        let axes = BVec3::from(axes);
        if !axes.any() {
            return self.unpin(node);
        }
        self.check_free_to_pin(&"node", node)?;
        let own = self.system.order.own(node);
        let before = self.system.pins.axes_of(own);
        if axes == before {
            return Ok(());
        }
        let inverse_mass = if axes.all() {
            0.0
        } else {
            1.0 / self.mass_of_unpinned(node)?
        };
        self.system.wake_at(own);
        if before.any() {
            close(&mut self.system);
        }
        self.system.pins.hold(own, axes)?;
        self.system.inverse_masses[own as usize] = inverse_mass;
        let velocity = self.system.state.velocities().get(own as usize);
        self.set_velocity(node, Vec3::select(axes & !before, Vec3::ZERO, velocity));
        if let Some(applied) = &mut self.system.applied {
            let force = applied.get(own as usize);
            applied.set(own as usize, Vec3::select(axes, Vec3::ZERO, force));
        }
        self.system.scale_masses(self.system.carry.masses_for);
        self.system.changed(Changed::Pin);
        Ok(())
    }

    /// Lets go of `node` along all axes: it goes on as it was led in the last step; nothing where it is not held.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a tool holds it, or it has no mass and is pinned for good.
    pub fn unpin(&mut self, node: u32) -> Result<()> {
        self.check_free_to_pin(&"node", node)?;
        let own = self.system.order.own(node);
        let mass = self.mass_of_unpinned(node)?;
        if self.system.pins.get(own).is_some() {
            self.system.wake_at(own);
            close(&mut self.system);
            self.system.pins.remove(own);
            self.system.inverse_masses[own as usize] = 1.0 / mass;
            self.system.scale_masses(self.system.carry.masses_for);
            self.system.changed(Changed::Pin);
        }
        Ok(())
    }

    /// Leads a pinned node on a straight line to `position`, in metres, where it is at the end of the next step; one that is held along
    /// some axes alone along those.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, it is not pinned or a tool holds it, or the position is not finite.
    pub fn move_pin(&mut self, node: u32, position: Vec3) -> Result<()> {
        self.check_free_to_pin(&"node", node)?;
        finite_vector("position", position)?;
        match self.system.pins.get_mut(self.system.order.own(node)) {
            Some(pin) => pin.target = Some(position),
            None => return Err(not_pinned(node)),
        }
        self.system.wake_at(self.system.order.own(node));
        Ok(())
    }

    /// What holds a pinned node against its springs and its weight, in newtons, mean over the last step; 0 along axes along which it
    /// is not held.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, it is not pinned, or a tool holds it
    /// ([`World::attachment_force`](crate::World::attachment_force)).
    pub fn pin_force(&self, node: u32) -> Result<Vec3> {
        self.check_node(&"node", node)?;
        self.system.check_not_held(&"node", node)?;
        let pin = self.system.pins.get(self.system.order.own(node));
        let pin = pin.ok_or_else(|| not_pinned(node))?;
        Ok(self.system.mean_force(pin))
    }

    /// Joins two nodes by a linear spring without damping: `stiffness` in N/m, `rest_length` in metres, `None`: the current
    /// distance.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, the nodes are one, they have a spring already, one is a point that is bound to
    /// nodes, or a number is negative or not finite. [`Error::Capacity`]: a node has no free place in a row of fixed length.
    /// [`Error::OutOfMemory`].
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
        if let Some(cuttable) = &mut self.cuttable {
            cuttable.reserve_spring([a, b], &self.system.order)?;
        }
        // What is invalid is told in the caller's numbers.
        self.system.forces.springs.add(&spring).map_err(|error| match error {
            Error::InvalidArgument(_) => already_joined(a, b),
            error => error,
        })?;
        if let Some(cuttable) = &mut self.cuttable {
            cuttable.add_spring([a, b], &self.system.order);
        }
        if let Some(sleeper) = &mut self.system.sleeper {
            sleeper.join([a, b].map(|node| self.system.order.own(node)));
        }
        self.system.changed(Changed::Stiffness);
        self.make_up_for_spring(Link::ends(&spring), -1.0);
        let nodes = [nodes[0].min(nodes[1]), nodes[0].max(nodes[1])];
        self.system.scale_for_springs(&nodes);
        self.system.see_stability_of(&nodes);
        Ok(())
    }

    /// Removes the spring between two nodes, and with it the tetrahedra of [`Model::Tetrahedra`](crate::Model::Tetrahedra) that
    /// have this edge, with their fibres, and the bending of triangles that have it, whether or not there is a spring along it. A cavity
    /// whose surface has it is open from then on, and neither keeps its volume nor its pressure; for other tissue too nothing is within it
    /// ([`is_closed`](Self::is_closed)).
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, or nothing of all that between them.
    pub fn remove_spring(&mut self, a: u32, b: u32) -> Result<()> {
        let nodes @ [own_a, own_b] = self.check_pair(a, b)?;
        let link = self.link(nodes);
        // What may fail comes first.
        if let Some(link) = link {
            if let Some(cuttable) = &mut self.cuttable {
                cuttable.log.reserve_one()?;
            }
            self.remove_link(nodes, link)?;
            if let Some(cuttable) = &mut self.cuttable {
                cuttable.log.add_removed_spring([a, b]);
            }
        }
        let removed = self.system.forces.remove_edge(own_a, own_b);
        if removed > 0 {
            self.system.changed(Changed::Stiffness);
            // Rings of fewer tetrahedra have other pressures, of which nothing was deformed.
            self.system.forces.measure_anew(self.system.state.positions());
        }
        ensure!(link.is_some() || removed > 0, not_joined(a, b));
        self.system.is_cut_open = self.system.is_cut_open || self.has_on_surface(a, b);
        Ok(())
    }

    /// Makes the pressure of its cavities this, Pa, where they have their volumes at rest, from the next step on: see
    /// [`BodyDefinition::pressure`](crate::BodyDefinition::pressure). A cavity that was cut open stays without.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the pressure is not finite, or the body was made with neither an `enclosed_stiffness` nor a `pressure`.
    pub fn set_pressure(&mut self, pressure: f32) -> Result<()> {
        finite("pressure", pressure)?;
        ensure!(
            self.system.forces.set_pressure(pressure),
            "pressure is {pressure} Pa, and the body was made with neither an enclosed_stiffness nor a pressure"
        );
        self.system.changed(Changed::Pressure);
        Ok(())
    }

    /// Whether two nodes are corners of one triangle of the surface.
    fn has_on_surface(&mut self, a: u32, b: u32) -> bool {
        // That nodes are no corners at all, as mostly in a cut through a volume, is kept from the first cut on.
        if self.corners.is_empty()
            && !self.system.surface.is_empty()
            && let Ok(corners) = memory::filled(0_u64, self.node_count().div_ceil(64))
        {
            self.corners = corners;
            for &corner in self.system.surface.as_flattened() {
                self.corners[corner as usize / 64] |= 1 << (corner % 64);
            }
        }
        // Out of memory: it is not known.
        let is_corner = |node: u32| {
            self.corners
                .get(node as usize / 64)
                .is_none_or(|bits| bits >> (node % 64) & 1 == 1)
        };
        let has = |triangle: &[u32; 3]| triangle.contains(&a) && triangle.contains(&b);
        is_corner(a) && is_corner(b) && self.system.surface.iter().any(has)
    }

    /// Removes a spring, given as the first of its nodes sees it.
    fn remove_link(&mut self, [own_a, own_b]: [u32; 2], link: Link) -> Result<()> {
        self.system.forces.springs.remove(own_a, own_b)?;
        if let Some(tears) = &mut self.tears {
            tears.remove([own_a, own_b]);
        }
        self.system.changed(Changed::Stiffness);
        let other = Link {
            neighbour: own_a,
            ..link
        };
        self.make_up_for_spring([link, other], 1.0);
        let scaling = self.system.scaling.as_ref();
        if scaling.is_some_and(|scaling| scaling.concerns([own_a, own_b])) {
            self.system.scale_for_springs(&[own_a, own_b]);
        }
        // What was stable still is; nothing limits what has no springs.
        if self.system.forces.springs.spring_count() == 0 {
            self.system.changed(Changed::Softer);
        }
        Ok(())
    }

    /// Keeps the velocities at the time of the positions as they are after a spring has come (sign -1) or gone (1), given
    /// as each of its nodes sees it.
    fn make_up_for_spring(&mut self, [a, b]: [Link; 2], sign: f32) {
        if self.system.carry.closing.is_none() {
            return;
        }
        self.forget_velocities();
        for (node, link) in [(b.neighbour, a), (a.neighbour, b)] {
            let [here, there] = [node, link.neighbour].map(|node| self.system.state.positions().get(node as usize));
            let missing = pull(node as usize, &link, there - here, None) * sign;
            make_up_for(&mut self.system, node, missing);
        }
    }

    /// The mass of a node that is to move, kg.
    pub(super) fn mass_of_unpinned(&self, node: u32) -> Result<f32> {
        let mass = self.system.masses[self.system.order.own(node) as usize];
        ensure!(mass != 0.0, "node {node} has no mass: it is pinned for good");
        Ok(mass)
    }

    pub(super) fn set_velocity(&mut self, node: u32, velocity: Vec3) {
        self.system.set_velocity(self.system.order.own(node) as usize, velocity);
        self.forget_velocities();
    }

    pub(crate) fn check_node(&self, name: &dyn std::fmt::Display, node: u32) -> Result<()> {
        ensure!(
            (node as usize) < self.node_count(),
            "{name} is {node}: the body has {} nodes",
            self.node_count()
        );
        Ok(())
    }

    /// Whether it is a point that is bound to nodes.
    pub(super) fn is_bound(&self, node: u32) -> bool {
        let bindings = self.system.bindings.as_ref();
        bindings.is_some_and(|bindings| bindings.get(self.system.order.own(node)).is_some())
    }

    /// Refuses a point that is bound to nodes: nothing holds or pulls it but those.
    pub(super) fn check_not_bound(&self, name: &dyn std::fmt::Display, node: u32) -> Result<()> {
        ensure!(
            !self.is_bound(node),
            "{name} is {node}: a point of the surface that is bound to nodes, and goes where they go"
        );
        Ok(())
    }

    /// The body's own numbers of two nodes that a spring may join.
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
