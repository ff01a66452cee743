//! Forces of fully pinned tissue on tools. Pinned nodes do not respond to impulses, so the tissue acts as a spring.
//!
//! These forces act on features whose neighbors are pinned too. A tool on free tissue may overlap a pinned border.
//! There the free tissue determines the force.

use super::contact_geometry::{ContactGeometry, mesh_contact, plane_contact, rounded_contact};
use super::contact_input::{ContactInput, SubSlice};
use super::contacts::Contacts;
use super::corner_weights::FeatureNodes;
use super::features::Feature;
use super::path::{PosedShape, ToolMotion, ToolPath};
use super::report::ToolContact;
use super::time_of_impact::Corners;
use super::zone::zone_bit;
use crate::nodes::weighted_nodes;

/// If the cosine between the normals of this step and the last is smaller, the tool has passed to the other side.
const MIN_SAME_SIDE_COSINE: f32 = 0.7;

impl Contacts {
    /// Adds the force of pinned tissue on each kinematic tool that is moved into it. The force is the deepest
    /// penetration in the step times the stiffness of the nodes there, N/m. `input` is the whole step of `substeps`
    /// substeps, with its final node positions.
    pub fn add_pinned_forces(&mut self, input: ContactInput, substeps: u32, stiffness_of: impl Fn(usize) -> f32) {
        self.pinned_touches.clear();
        if self.is_clear_of_tools() || !input.pins.iter().any(|pin| !pin.is_partial()) {
            return;
        }
        let mut free_marks = std::mem::take(&mut self.free_node_marks);
        free_marks.clear();
        // Several samples, so that a tool cannot pass through a thin sheet within the step.
        let samples = self.needed_slices(&input);
        let mut bits = (0..).map(zone_bit);
        for (index, tool) in input.tools.iter().enumerate() {
            if !tool.filter.meets(self.filter) {
                continue;
            }
            let deepest = bits
                .next()
                .filter(|_| tool.collides_with_pinned && self.dynamic_tools.find(index).is_none())
                .and_then(|bit| self.deepest(&input, (tool, bit), samples, &mut free_marks));
            let Some((depth, feature, geometry)) = deepest else {
                continue;
            };
            let feature_nodes = FeatureNodes::new(feature, input.bindings);
            let shares = feature_nodes.shares(geometry.weights);
            let shares = || feature_nodes.nodes().iter().zip(shares);
            let stiffness: f32 = shares().map(|(&node, share)| share * stiffness_of(node as usize)).sum();
            let force = geometry.normal * -(stiffness * depth);
            self.loads[index].add(force.as_dvec3() * f64::from(input.dt), geometry.arm);
            for (&node, share) in shares() {
                if let Some(pin) = input.pins.get_mut(node) {
                    pin.force_sum += (force * share).as_dvec3() * f64::from(substeps);
                }
            }
            // Memory for one per tool is reserved.
            self.pinned_touches.push(ToolContact {
                slot: tool.slot,
                nodes: feature.three_nodes(),
                weights: geometry.weights,
                normal: geometry.normal,
                force,
            });
        }
        self.free_node_marks = free_marks;
    }

    /// The deepest penetration of a tool into pinned tissue over `samples` samples of its path. `bit` is the bit of the
    /// tool's zone.
    fn deepest(
        &self,
        input: &ContactInput,
        (tool, bit): (&ToolPath, u32),
        samples: u32,
        free_marks: &mut Vec<u64>,
    ) -> Option<(f32, Feature, ContactGeometry)> {
        let mut deepest: Option<(f32, Feature, ContactGeometry)> = None;
        let last_touch = self.last_pinned_touches.iter().find(|touch| touch.slot == tool.slot);
        let radius = tool.sweep(input.origin).map_or(0.0, |sweep| sweep.thickness);
        let near = self.candidates.near.iter().zip(&self.candidates.zone_masks);
        let near = near.filter(|&(_, mask)| mask & bit != 0);
        let features = near.filter_map(|(&index, _)| self.features.get(index));
        let is_pinned = |feature: &Feature| feature.nodes().iter().all(|&node| self.is_pinned(input, node));
        for feature in features.filter(is_pinned) {
            for sample in 1..=samples {
                let fraction = f64::from(sample) / f64::from(samples);
                let motion = tool.motion(fraction, fraction, input.dt, input.origin);
                let Some(mut geometry) = static_contact(input, &motion, feature) else {
                    continue;
                };
                // A tool that is more than half inside keeps the normal of the side on which it entered.
                let along = last_touch.map_or(1.0, |last_touch| last_touch.normal.dot(geometry.normal));
                let mut depth = input.thickness - geometry.gap;
                if let Some(last_touch) = last_touch.filter(|_| along < MIN_SAME_SIDE_COSINE) {
                    depth += (geometry.gap + radius) * (1.0 - along);
                    geometry.arm += (last_touch.normal - geometry.normal) * radius;
                    geometry.normal = last_touch.normal;
                }
                if depth <= deepest.map_or(0.0, |(depth, ..)| depth) {
                    continue;
                }
                if free_marks.is_empty() {
                    self.mark_free_nodes(input, free_marks);
                }
                if feature.nodes().iter().any(|&node| is_marked(free_marks, node)) {
                    break;
                }
                deepest = Some((depth, feature, geometry));
            }
        }
        deepest
    }

    /// True if a surface node, or all nodes that it is bound to, are pinned and not attached to a tool.
    fn is_pinned(&self, input: &ContactInput, node: u32) -> bool {
        weighted_nodes(input.bindings, node).all(|(node, _)| {
            let is_attached = || {
                self.attached_nodes
                    .binary_search_by_key(&node, |&(attached, _)| attached)
                    .is_ok()
            };
            input.mobility.inverse_masses[node as usize] == 0.0 && !is_attached()
        })
    }

    /// Marks the surface nodes that are free or have a free neighbor.
    fn mark_free_nodes(&self, input: &ContactInput, marks: &mut Vec<u64>) {
        // The memory is reserved.
        marks.resize((self.features.node_count as usize).div_ceil(64), 0);
        for edge in self.features.edges() {
            if edge.iter().any(|&node| !self.is_pinned(input, node)) {
                edge.iter()
                    .for_each(|&node| marks[node as usize / 64] |= 1 << (node % 64));
            }
        }
    }
}

fn is_marked(marks: &[u64], node: u32) -> bool {
    marks[node as usize / 64] >> (node % 64) & 1 == 1
}

/// The contact of a feature with a tool at rest.
fn static_contact(input: &ContactInput, motion: &ToolMotion, feature: Feature) -> Option<ContactGeometry> {
    let slice = SubSlice::ahead(input);
    let nodes = feature.nodes();
    let corners = Corners::still(nodes.iter().map(|&node| input.position(&slice, node as usize).into()));
    match (motion.from, motion.to) {
        (PosedShape::HalfSpace { .. }, _) if nodes.len() > 1 => None,
        (PosedShape::HalfSpace { .. }, _) => plane_contact(input, &slice, motion, nodes[0] as usize),
        (PosedShape::Rounded { .. }, _) => rounded_contact(input, &slice, motion, &corners, &motion.segment(false)),
        (PosedShape::Mesh(from), PosedShape::Mesh(to)) => {
            mesh_contact(input, &slice, motion, (feature, &corners), [&from, &to], None)
        }
        (PosedShape::Mesh(_), _) => None,
    }
}
