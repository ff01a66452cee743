//! Narrow phase of one body: finds the contacts of listed features with tools.

use glam::Vec3A;

use super::contact_geometry::{ContactGeometry, mesh_contact, plane_contact, rounded_contact};
use super::contact_input::{ContactInput, SubSlice};
use super::contacts::Contacts;
use super::corner_weights::FeatureNodes;
use super::features::Feature;
use super::node_batches::{BatchSolid, NodeBatches};
use super::node_contacts::{NodeContact, NodeQuery};
use super::path::{PosedShape, ToolMotion};
use super::pgs::solve_alone;
use super::time_of_impact::Corners;
use super::zone::zone_bit;
use crate::base::{Count, Stage, Stopwatch};
use crate::nodes::Bindings;

impl Contacts {
    /// True if the tool in this slot is attached to a node of the feature. Attached tissue may lie inside the tool, and
    /// edges and faces from there pass through its surface. So the tool does not collide with them.
    fn is_attached(&self, feature: Feature, slot: usize, bindings: Option<&Bindings>) -> bool {
        let held = |&node: &u32| self.attached_nodes.binary_search(&(node, slot)).is_ok();
        !self.attached_nodes.is_empty() && FeatureNodes::new(feature, bindings).nodes().iter().any(held)
    }

    /// Adds the contacts of a slice between these fractions of the step.
    pub(super) fn find(&mut self, input: &mut ContactInput, slice: &SubSlice, ends: [f64; 2]) {
        let watch = Stopwatch::start(input.profile);
        self.find_among_candidates(input, slice, ends);
        watch.stop(input.profile, Stage::NarrowPhase);
        if let Some(profile) = input.profile {
            profile.count(Count::ToolContacts, self.constraints.len() + self.nodes.len());
        }
    }

    fn find_among_candidates(&mut self, input: &mut ContactInput, slice: &SubSlice, [start, end]: [f64; 2]) {
        // Contacts within an equation are constraints, also those of nodes.
        let node_by_node = !slice.is_predictive && self.multipliers.is_empty();
        let all = self.candidates.zone_masks.iter().fold(0, |all, mask| all | mask);
        let has_single_tool = input.bindings.is_none()
            && input.neighbor_speed.is_none()
            && all.count_ones() == 1
            && all.leading_zeros() > 0;
        let mut zone = 0;
        for (index, tool) in input.tools.iter().enumerate() {
            if !tool.filter.meets(self.filter) {
                continue;
            }
            let bit = zone_bit(zone);
            zone += 1;
            let dynamic_index = self.dynamic_tools.find(index);
            // An equation cannot move a tool.
            if all & bit == 0 || slice.is_predictive && dynamic_index.is_some() {
                continue;
            }
            let motion = tool.motion(start, end, input.dt, input.origin);
            let solves_nodes = node_by_node && dynamic_index.is_none();
            self.find_feature_contacts(input, slice, (index, &motion), (bit, solves_nodes));
            if solves_nodes {
                // Contacts of nodes are independent if their tool is the only one and no edge or face touches it.
                let is_alone = has_single_tool && self.constraints.is_empty();
                self.find_node_contacts(input, slice, (index, &motion), (bit, is_alone));
            }
        }
    }

    /// Adds the contacts of edges and faces with a tool. Contacts of nodes are added too, unless `node_by_node` leaves
    /// them to [`Self::find_node_contacts`].
    fn find_feature_contacts(
        &mut self,
        input: &mut ContactInput,
        slice: &SubSlice,
        (tool_index, motion): (usize, &ToolMotion),
        (bit, node_by_node): (u32, bool),
    ) {
        let (nodes, count) = (self.candidates.node_count(&self.features), self.candidates.near().len());
        let skips_nodes = node_by_node && input.bindings.is_none();
        let first = if skips_nodes { nodes } else { 0 };
        if first == count {
            return;
        }
        let slice_bounds = motion.slice_bounds(input, slice);
        if let Some(slice_bounds) = &slice_bounds {
            self.candidates
                .update_corners(slice_bounds, skips_nodes, |corner| input.corner_motion(slice, corner));
        }
        for candidate in first..count {
            if self.candidates.zone_masks[candidate] & bit == 0 {
                continue;
            }
            let index = self.candidates.near()[candidate];
            let is_bound = || input.bindings.is_some_and(|bindings| bindings.get(index).is_some());
            if node_by_node && candidate < nodes && !is_bound() {
                continue;
            }
            let Some(feature) = self.features.get(index) else {
                continue;
            };
            if slice_bounds.is_none() {
                self.add_plane_contact(input, slice, (tool_index, motion), feature);
            } else if let Some(corners) = self.candidates.corners(feature) {
                let listed = candidate.checked_sub(nodes);
                self.add_feature_contacts(input, slice, (tool_index, motion), (feature, &corners, listed));
            }
        }
    }

    /// Adds the contacts of nodes with a tool. Points that are bound to nodes are not included.
    fn find_node_contacts(
        &mut self,
        input: &mut ContactInput,
        slice: &SubSlice,
        (tool, motion): (usize, &ToolMotion),
        (bit, is_alone): (u32, bool),
    ) {
        let count = self.candidates.node_count(&self.features);
        let query = NodeQuery::new(input, slice, motion, input.tools[tool].slot);
        let is_uniform = is_alone && input.is_uniform(slice) && self.attached_nodes.is_empty();
        let is_batched = is_uniform && self.solve_node_batches(input, (tool, motion), &query, count);
        let remaining = if is_batched { self.deferred_nodes.len() } else { count };
        for index in 0..remaining {
            let (node, candidate) = match self.deferred_nodes.get(index).filter(|_| is_batched) {
                Some(&node) => (node, self.candidates.near[..count].partition_point(|&near| near < node)),
                None if self.candidates.zone_masks[index] & bit == 0 => continue,
                None => (self.candidates.near()[index], index),
            };
            if input.bindings.is_some_and(|bindings| bindings.get(node).is_some()) {
                continue;
            }
            let plane = self.candidates.planes.get_mut(candidate);
            let Some(geometry) = query.contact(input, slice, node as usize, plane) else {
                continue;
            };
            if self.is_attached(Feature::node(node), query.slot, input.bindings) {
                continue;
            }
            let Some(mut contact) = NodeContact::new(input, slice, (node, tool), &geometry, motion.friction) else {
                continue;
            };
            // An idle contact must stay if another tool may push the node nearer.
            if is_alone && contact.is_idle(input.velocities) {
                continue;
            }
            if !self.nodes.push(contact) {
                contact.solve_alone(input.velocities);
                self.apply_node_impulse(input, slice, &contact);
            }
        }
    }

    /// Solves contacts of a rounded or mesh tool with nodes in batches, in closed form. Nodes that need a sweep or a
    /// new query of the mesh are deferred. Returns false for a tool of another shape.
    fn solve_node_batches(
        &mut self,
        input: &mut ContactInput,
        (tool, motion): (usize, &ToolMotion),
        query: &NodeQuery,
        count: usize,
    ) -> bool {
        let solid = match (motion.from, motion.to) {
            (PosedShape::Rounded { .. }, _) => BatchSolid::Round {
                segment: query.segment,
                spin: motion.spin,
            },
            (PosedShape::Mesh(from), PosedShape::Mesh(to)) => {
                let Some(planes) = self.candidates.planes.get(..count) else {
                    return false;
                };
                BatchSolid::Mesh {
                    planes,
                    slot: query.slot as u32,
                    from,
                    to,
                    flat: query.flat(),
                }
            }
            _ => return false,
        };
        self.deferred_nodes.clear();
        let sums = input.kernel.run(NodeBatches {
            nodes: &self.candidates.near[..count],
            positions: input.positions.axes(),
            velocities: input.velocities.axes_mut(),
            next_positions: input.next_positions.axes_mut(),
            inverse_masses: input.mobility.inverse_masses,
            damping: input.mobility.damping,
            substep: input.substep,
            solid,
            thickness: input.thickness,
            closing: query.closing,
            center: motion.center,
            friction: motion.friction,
            deferred: &mut self.deferred_nodes,
        });
        let load = &mut self.loads[tool];
        load.impulse += sums.impulse;
        load.angular_impulse += sums.angular_impulse;
        self.velocity_bounds = self.velocity_bounds.and(&sums.velocities);
        true
    }

    /// Adds the contact of a feature with a plane.
    fn add_plane_contact(
        &mut self,
        input: &mut ContactInput,
        slice: &SubSlice,
        (tool, motion): (usize, &ToolMotion),
        feature: Feature,
    ) {
        if let &[node] = feature.nodes()
            && !self.has_multiplier(slice, (tool, feature, 0))
            && !self.is_attached(feature, input.tools[tool].slot, input.bindings)
        {
            let geometry = plane_contact(input, slice, motion, node as usize);
            self.add(input, slice, (tool, motion.friction), (feature, 0), geometry);
        }
    }

    /// Adds the contacts of a feature with a bounded tool. `listed` is the index of an edge or face among the listed
    /// ones.
    fn add_feature_contacts(
        &mut self,
        input: &mut ContactInput,
        slice: &SubSlice,
        (tool, motion): (usize, &ToolMotion),
        (feature, corners, listed): (Feature, &Corners, Option<usize>),
    ) {
        if self.is_attached(feature, input.tools[tool].slot, input.bindings) {
            return;
        }
        let tool_and_friction = (tool, motion.friction);
        if let (PosedShape::Mesh(from), PosedShape::Mesh(to)) = (motion.from, motion.to) {
            if !self.has_multiplier(slice, (tool, feature, 0)) {
                let last = listed.and_then(|listed| self.candidates.mesh_distances.get_mut(listed));
                let last = last.map(|last| (input.tools[tool].slot, last));
                let geometry = mesh_contact(input, slice, motion, (feature, corners), [&from, &to], last);
                self.add(input, slice, tool_and_friction, (feature, 0), geometry);
            }
            return;
        }
        let segment = motion.segment(input.drifts);
        let has_tips = corners.count == 3 && !segment.is_point();
        for tip in 0..1 + u8::from(has_tips) {
            if self.has_multiplier(slice, (tool, feature, tip)) {
                continue;
            }
            let tip_segment = if has_tips { segment.end(tip.into()) } else { segment };
            let geometry = rounded_contact(input, slice, motion, corners, &tip_segment);
            self.add(input, slice, tool_and_friction, (feature, tip), geometry);
        }
    }

    /// True if the solved equation includes the contact of this tool's tip with the feature.
    fn has_multiplier(&self, slice: &SubSlice, contact: (usize, Feature, u8)) -> bool {
        !slice.is_predictive && self.multipliers.contains(contact)
    }

    pub(super) fn add(
        &mut self,
        input: &mut ContactInput,
        slice: &SubSlice,
        (tool, friction): (usize, f32),
        (feature, tip): (Feature, u8),
        geometry: Option<ContactGeometry>,
    ) {
        let dynamic_tool = self
            .dynamic_tools
            .find(tool)
            .map(|index| (index, &self.contact_rows.dynamic_tools[index]));
        let constraint = geometry.and_then(|geometry| {
            let recoil = dynamic_tool.map_or([0.0; 2], |(_, tool)| {
                let arm = Vec3A::from(geometry.arm) - tool.center;
                [tool.response(arm, geometry.normal.into()), tool.max_response(arm)]
            });
            input.constraint(slice, feature, &geometry, friction, recoil)
        });
        let Some(mut constraint) = constraint else {
            return;
        };
        (constraint.tool, constraint.tip) = (tool, tip);
        constraint.dynamic_index = dynamic_tool.map_or(u32::MAX, |(index, _)| index as u32);
        if self.constraints.len() < self.batch_capacity {
            self.constraints.push(constraint);
        } else if !slice.is_predictive {
            solve_alone(&mut constraint, input.velocities, &mut self.contact_rows.dynamic_tools);
            self.apply_impulse(input, slice, &constraint, true);
        }
    }
}
