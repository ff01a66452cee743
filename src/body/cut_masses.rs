//! How nodes go on after a cut: with their parts of masses, and so that the step that is still open gives them what it would have given.

use glam::{BVec3, DVec3, Vec3};

use super::Body;
use super::cuttable::Cuttable;
use crate::base::{Result, memory};
use crate::cutting::{Changes, CutMaterial};
use crate::def::SMALLEST_MASS;
use crate::soa::Masses;
use crate::solver::{Candidate, Changed, make_up_for};
use crate::springs::Rewiring;

/// A node whose springs or mass a cut changes.
pub(super) struct Touched {
    /// In its own number.
    pub node: u32,
    source: u32,
    /// Its part of the mass that it, or its source, had.
    part: f32,
    /// What springs did to its source, N.
    before: Vec3,
}

impl Body {
    /// All nodes whose springs or mass are to change, in order, with what springs do to them now.
    pub(super) fn touched(&self, changes: &Changes, rewiring: &Rewiring) -> Result<Vec<Touched>> {
        let known = self.node_count() as u32;
        let mut touched: Vec<Touched> = Vec::new();
        for piece in &changes.nodes {
            memory::push(
                &mut touched,
                Touched {
                    node: self.system.order.own(piece.node),
                    source: self.system.order.own(piece.source),
                    part: piece.part as f32,
                    before: Vec3::ZERO,
                },
            )?;
        }
        let changed = rewiring
            .changed
            .iter()
            .flat_map(|change| [change.node, change.before.neighbour]);
        let ends = rewiring.removed.iter().flat_map(|spring| spring.nodes).chain(changed);
        let added = rewiring.added.iter().flat_map(|spring| spring.nodes);
        for node in ends.chain(added.filter(|&node| node < known)) {
            let (source, part, before) = (node, 1.0, Vec3::ZERO);
            memory::push(
                &mut touched,
                Touched {
                    node,
                    source,
                    part,
                    before,
                },
            )?;
        }
        // Of a node that fell apart what is known of that comes first.
        touched.sort_unstable_by(|a, b| a.node.cmp(&b.node).then(a.part.total_cmp(&b.part)));
        touched.dedup_by_key(|touched| touched.node);
        for touched in &mut touched {
            touched.before = self.spring_force(touched.source);
        }
        Ok(touched)
    }

    /// What springs do to a node where it is, but for their damping, N; nothing where nobody asks.
    fn spring_force(&self, node: u32) -> Vec3 {
        let mut force = Vec3::ZERO;
        if self.system.carry.closing.is_some() {
            let positions = self.system.state.positions();
            self.system
                .forces
                .add_spring_forces(node as usize, positions, &mut force);
        }
        force
    }

    /// Gives nodes that fell apart their parts of the mass, and holds copies of held nodes that are drawn.
    pub(super) fn share_masses(&mut self, cuttable: &Cuttable, changes: &Changes) -> Result<()> {
        for pieces in changes.nodes.chunk_by(|a, b| a.source == b.source) {
            let source = self.system.order.own(pieces[0].source);
            let whole = f64::from(self.system.masses[source as usize]);
            // Of what a tool holds no copies are held.
            let axes = if self.system.is_held_by_tool(source) {
                BVec3::FALSE
            } else {
                self.system.pins.axes_of(source)
            };
            let is_held = self.system.inverse_masses[source as usize] == 0.0;
            for piece in pieces {
                let node = self.system.order.own(piece.node);
                let is_drawn = changes.undrawn.binary_search(&piece.node).is_err();
                let is_copy = piece.node != piece.source;
                let mass = if whole > 0.0 {
                    whole * piece.part
                } else if is_drawn {
                    0.0
                } else {
                    cuttable.density * cuttable.material.share_at(piece.node)
                } as f32;
                let mass = if mass > 0.0 { mass.max(SMALLEST_MASS) } else { mass };
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

    /// The same for elements, at all nodes of pieces and all others of which masses or springs have changed.
    pub(super) fn follow_elements(&mut self, material: &CutMaterial, changes: &Changes, nodes: &[u32]) {
        let order = &self.system.order;
        let masses = Masses::new(&self.system.masses, &self.system.inverse_masses);
        let cells_at = |node: u32| material.tetrahedra_at(order.caller(node));
        self.system.forces.find_rates_at(nodes, cells_at, &masses);
        if self.system.carry.closing.is_none() || !self.system.forces.has_elements() {
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
            let whole: DVec3 = pieces.iter().map(|piece| force_on(self, piece.node)).sum();
            for piece in pieces {
                let more = whole * piece.part - force_on(self, piece.node);
                let own = self.system.order.own(piece.node);
                make_up_for(&mut self.system, own, more.as_vec3());
            }
        }
    }

    /// Has nodes go on after their springs and masses have changed: closing the last step gives them what it would have given.
    pub(super) fn go_on(&mut self, touched: &[Touched], nodes: &[u32], candidates: Vec<Candidate>) {
        self.system.changed(Changed::Topology);
        self.forget_velocities();
        self.system.scale_for_springs(nodes);
        for touched in touched {
            let force = self.spring_force(touched.node);
            make_up_for(&mut self.system, touched.node, touched.before * touched.part - force);
        }
        self.system.follow_nodes();
        let masses = Masses::new(&self.system.masses, &self.system.inverse_masses);
        let watched = (&mut self.system.watched, candidates);
        let positions = self.system.state.positions();
        self.system.carry.stability =
            self.system
                .carry
                .stability
                .cut(nodes, &*self.system.forces.springs, masses, positions, watched);
    }
}
