//! Tissue that is pinned all about a tool gives way to no impulse. So that a tool feels it, it presses back like a spring.
//!
//! It is features whose neighbours are pinned too. A tool that is pressed on free tissue may reach over a pinned border: there tissue
//! beside it gives way, and what it does is known.

use super::contacts::Contacts;
use super::features::Feature;
use super::meet::{ContactGeometry, meet_mesh, meet_plane, meet_rounded};
use super::meeting::{Meeting, Slice};
use super::path::{Motion, Solid, ToolPath};
use super::report::Touch;
use super::supports::Supports;
use super::sweep::Corners;
use super::zone::zone_bit;
use crate::nodes::parts;

/// A normal that lies by less than this cosine along that of the last step is taken for one of the other side.
const TURNED: f32 = 0.7;

impl Contacts {
    /// Has what is pinned press each tool that is led into it, where it was deepest in the step: with the depth times the stiffness of the
    /// nodes there, N/m. `meeting` is the whole step, of so many substeps, with the nodes where it has led them.
    pub fn press_pinned(&mut self, meeting: Meeting, substeps: u32, stiffness_of: impl Fn(usize) -> f32) {
        self.pinned.clear();
        if self.are_far() || !meeting.pins.iter().any(|pin| !pin.is_partial()) {
            return;
        }
        let mut yielding = std::mem::take(&mut self.yielding_nodes);
        yielding.clear();
        // A tool that passes a thin sheet within the step must not miss it.
        let looks = self.needed_slices(&meeting);
        let mut bits = (0..).map(zone_bit);
        for (place, tool) in meeting.tools.iter().enumerate() {
            if !tool.filter.meets(self.filter) {
                continue;
            }
            let deepest = bits
                .next()
                .filter(|_| tool.meets_pinned && self.driven.place(place).is_none())
                .and_then(|bit| self.deepest(&meeting, (tool, bit), looks, &mut yielding));
            let Some((depth, feature, geometry)) = deepest else {
                continue;
            };
            let supports = Supports::of(feature, meeting.bindings);
            let shares = supports.shares(geometry.weights);
            let shares = || supports.nodes().iter().zip(shares);
            let stiffness: f32 = shares().map(|(&node, share)| share * stiffness_of(node as usize)).sum();
            let force = geometry.normal * -(stiffness * depth);
            self.loads[place].add(force.as_dvec3() * f64::from(meeting.dt), geometry.arm);
            for (&node, share) in shares() {
                if let Some(pin) = meeting.pins.get_mut(node) {
                    pin.force_sum += (force * share).as_dvec3() * f64::from(substeps);
                }
            }
            // There is room for one of each tool.
            self.pinned.push(Touch {
                slot: tool.slot,
                nodes: feature.three_nodes(),
                weights: geometry.weights,
                normal: geometry.normal,
                force,
            });
        }
        self.yielding_nodes = yielding;
    }

    /// How deep a tool, whose zone has this bit, comes to lie in what is pinned, and where, as so many looks on its way tell.
    fn deepest(
        &self,
        meeting: &Meeting,
        (tool, bit): (&ToolPath, u32),
        looks: u32,
        yielding: &mut Vec<u64>,
    ) -> Option<(f32, Feature, ContactGeometry)> {
        let mut deepest: Option<(f32, Feature, ContactGeometry)> = None;
        let before = self.pinned_before.iter().find(|touch| touch.slot == tool.slot);
        let radius = tool.sweep(meeting.origin).map_or(0.0, |sweep| sweep.thickness);
        let near = self.candidates.near.iter().zip(&self.candidates.masks);
        let near = near.filter(|&(_, mask)| mask & bit != 0);
        let features = near.filter_map(|(&index, _)| self.features.get(index));
        let is_pinned = |feature: &Feature| feature.nodes().iter().all(|&node| self.is_pinned(meeting, node));
        for feature in features.filter(is_pinned) {
            for look in 1..=looks {
                let fraction = f64::from(look) / f64::from(looks);
                let motion = tool.motion(fraction, fraction, meeting.dt, meeting.origin);
                let Some(mut geometry) = meet_standing(meeting, &motion, feature) else {
                    continue;
                };
                // One that is in by more than half goes on out by the side on which it came.
                let along = before.map_or(1.0, |before| before.normal.dot(geometry.normal));
                let mut depth = meeting.thickness - geometry.gap;
                if let Some(before) = before.filter(|_| along < TURNED) {
                    depth += (geometry.gap + radius) * (1.0 - along);
                    geometry.arm += (before.normal - geometry.normal) * radius;
                    geometry.normal = before.normal;
                }
                if depth <= deepest.map_or(0.0, |(depth, ..)| depth) {
                    continue;
                }
                if yielding.is_empty() {
                    self.mark_yielding(meeting, yielding);
                }
                if feature.nodes().iter().any(|&node| is_marked(yielding, node)) {
                    break;
                }
                deepest = Some((depth, feature, geometry));
            }
        }
        deepest
    }

    /// Whether a node of the surface is pinned, or all that it is bound to, and no tool holds it.
    fn is_pinned(&self, meeting: &Meeting, node: u32) -> bool {
        parts(meeting.bindings, node).all(|(node, _)| {
            let is_held = || self.held.binary_search_by_key(&node, |&(held, _)| held).is_ok();
            meeting.mobility.inverse_masses[node as usize] == 0.0 && !is_held()
        })
    }

    /// Marks the nodes of the surface that give way, or have a neighbour that does.
    fn mark_yielding(&self, meeting: &Meeting, marks: &mut Vec<u64>) {
        // There is room.
        marks.resize((self.features.node_count as usize).div_ceil(64), 0);
        for edge in self.features.edges() {
            if edge.iter().any(|&node| !self.is_pinned(meeting, node)) {
                edge.iter()
                    .for_each(|&node| marks[node as usize / 64] |= 1 << (node % 64));
            }
        }
    }
}

fn is_marked(marks: &[u64], node: u32) -> bool {
    marks[node as usize / 64] >> (node % 64) & 1 == 1
}

/// How a feature lies within a tool that stands.
fn meet_standing(meeting: &Meeting, motion: &Motion, feature: Feature) -> Option<ContactGeometry> {
    let slice = Slice::ahead(meeting);
    let nodes = feature.nodes();
    let corners = Corners::still(nodes.iter().map(|&node| meeting.position(&slice, node as usize).into()));
    match (motion.from, motion.to) {
        (Solid::HalfSpace { .. }, _) if nodes.len() > 1 => None,
        (Solid::HalfSpace { .. }, _) => meet_plane(meeting, &slice, motion, nodes[0] as usize),
        (Solid::Rounded { .. }, _) => meet_rounded(meeting, &slice, motion, &corners, &motion.segment(false)),
        (Solid::Mesh(from), Solid::Mesh(to)) => {
            meet_mesh(meeting, &slice, motion, (feature, &corners), [&from, &to], None)
        }
        (Solid::Mesh(_), _) => None,
    }
}
