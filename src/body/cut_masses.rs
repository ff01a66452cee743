//! Masses and velocities of nodes after a cut: copies share the mass, and the deferred half kick of the last step stays
//! the same.

use glam::{BVec3, DVec3, Vec3};

use super::Body;
use super::cut_state::CutState;
use crate::base::{Result, memory};
use crate::cutting::{Changes, CutMaterial};
use crate::def::MIN_MASS;
use crate::soa::NodalMasses;
use crate::solver::{Changed, CriticalNode, correct_deferred_kick};
use crate::springs::Rewiring;

/// A node whose springs or mass a cut changes.
pub(super) struct AffectedNode {
    /// The internal index.
    pub node: u32,
    source: u32,
    /// The part of the mass that the node, or its source, had.
    mass_fraction: f32,
    /// The force of springs on the source before the cut, N.
    before: Vec3,
}

impl Body {
    /// All nodes whose springs or masses will change, in order, with the current force of their springs.
    pub(super) fn affected_nodes(&self, changes: &Changes, rewiring: &Rewiring) -> Result<Vec<AffectedNode>> {
        let node_count_before = self.node_count() as u32;
        let mut affected: Vec<AffectedNode> = Vec::new();
        for piece in &changes.nodes {
            memory::push(
                &mut affected,
                AffectedNode {
                    node: self.system.order.own(piece.node),
                    source: self.system.order.own(piece.source),
                    mass_fraction: piece.part as f32,
                    before: Vec3::ZERO,
                },
            )?;
        }
        let changed = rewiring
            .changed
            .iter()
            .flat_map(|change| [change.node, change.before.neighbor]);
        let ends = rewiring.removed.iter().flat_map(|spring| spring.nodes).chain(changed);
        let added = rewiring.added.iter().flat_map(|spring| spring.nodes);
        for node in ends.chain(added.filter(|&node| node < node_count_before)) {
            let (source, mass_fraction, before) = (node, 1.0, Vec3::ZERO);
            memory::push(
                &mut affected,
                AffectedNode {
                    node,
                    source,
                    mass_fraction,
                    before,
                },
            )?;
        }
        // The entry of a node that fell apart comes first.
        affected.sort_unstable_by(|a, b| a.node.cmp(&b.node).then(a.mass_fraction.total_cmp(&b.mass_fraction)));
        affected.dedup_by_key(|affected| affected.node);
        for affected in &mut affected {
            affected.before = self.spring_force(affected.source);
        }
        Ok(affected)
    }

    /// The force of springs on a node without their damping, N. 0 if no half kick is deferred.
    fn spring_force(&self, node: u32) -> Vec3 {
        let mut force = Vec3::ZERO;
        if self.system.carry.deferred_kick.is_some() {
            let positions = self.system.state.positions();
            self.system
                .forces
                .add_spring_forces(node as usize, positions, &mut force);
        }
        force
    }

    /// Distributes the mass of each node that fell apart to its copies. Pins the copies of pinned nodes that are
    /// rendered.
    pub(super) fn distribute_masses(&mut self, cut_state: &CutState, changes: &Changes) -> Result<()> {
        for pieces in changes.nodes.chunk_by(|a, b| a.source == b.source) {
            let source = self.system.order.own(pieces[0].source);
            let total = f64::from(self.system.masses[source as usize]);
            // Copies of nodes that a tool holds are not held.
            let axes = if self.system.is_attached_node(source) {
                BVec3::FALSE
            } else {
                self.system.pins.axes_of(source)
            };
            let is_held = self.system.inverse_masses[source as usize] == 0.0;
            for piece in pieces {
                let node = self.system.order.own(piece.node);
                let is_drawn = changes.undrawn.binary_search(&piece.node).is_err();
                let is_copy = piece.node != piece.source;
                let mass = if total > 0.0 {
                    total * piece.part
                } else if is_drawn {
                    0.0
                } else {
                    cut_state.density * cut_state.material.material_at(piece.node)
                } as f32;
                let mass = if mass > 0.0 { mass.max(MIN_MASS) } else { mass };
                if is_copy && is_drawn && axes.any() {
                    let target = self.system.pins.get(source).and_then(|pin| pin.target);
                    self.system.pins.hold(node, axes)?;
                    if let Some(pin) = self.system.pins.get_mut(node) {
                        pin.target = target;
                    }
                } else if mass == 0.0 {
                    self.system.pins.hold(node, BVec3::TRUE)?;
                }
                let stays_held = mass == 0.0
                    || if is_copy {
                        is_drawn && axes == BVec3::TRUE
                    } else {
                        is_held
                    };
                self.system.masses[node as usize] = mass;
                self.system.inverse_masses[node as usize] = if stays_held { 0.0 } else { 1.0 / mass };
            }
        }
        Ok(())
    }

    /// Updates elements at the given nodes, and corrects the deferred half kick for their forces.
    pub(super) fn update_elements(&mut self, material: &CutMaterial, changes: &Changes, nodes: &[u32]) {
        let order = &self.system.order;
        let masses = NodalMasses::new(&self.system.masses, &self.system.inverse_masses);
        let cells_at = |node: u32| material.tetrahedra_at(order.caller(node));
        self.system.forces.find_rates_at(nodes, cells_at, &masses);
        if self.system.carry.deferred_kick.is_none() || !self.system.forces.has_elements() {
            return;
        }
        for pieces in changes.nodes.chunk_by(|a, b| a.source == b.source) {
            let force_on = |body: &Self, node: u32| {
                let cells = material.tetrahedra_at(node);
                let system = &body.system;
                system.forces.elements().map_or(DVec3::ZERO, |elements| {
                    elements.force_at(system.order.own(node), cells, system.state.positions())
                })
            };
            let total: DVec3 = pieces.iter().map(|piece| force_on(self, piece.node)).sum();
            for piece in pieces {
                let correction = total * piece.part - force_on(self, piece.node);
                let own = self.system.order.own(piece.node);
                correct_deferred_kick(&mut self.system, own, correction.as_vec3());
            }
        }
    }

    /// Updates the state after springs and masses have changed. The deferred half kick is corrected, so that velocities
    /// stay the same.
    pub(super) fn finish_cut(&mut self, affected: &[AffectedNode], nodes: &[u32], candidates: Vec<CriticalNode>) {
        self.system.changed(Changed::Topology);
        self.discard_velocities();
        self.system.update_added_masses(nodes);
        for affected in affected {
            let force = self.spring_force(affected.node);
            correct_deferred_kick(
                &mut self.system,
                affected.node,
                affected.before * affected.mass_fraction - force,
            );
        }
        self.system.update_bound_points();
        let masses = NodalMasses::new(&self.system.masses, &self.system.inverse_masses);
        let watched_and_candidates = (&mut self.system.critical_nodes, candidates);
        let positions = self.system.state.positions();
        self.system.carry.stability = self.system.carry.stability.cut(
            nodes,
            &*self.system.forces.springs,
            masses,
            positions,
            watched_and_candidates,
        );
    }
}
