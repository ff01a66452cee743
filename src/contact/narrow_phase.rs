//! Finds the contacts of what is near tools.

use glam::Vec3A;

use super::contacts::Contacts;
use super::features::Feature;
use super::meet::{ContactGeometry, meet_mesh, meet_plane, meet_rounded};
use super::meeting::{Meeting, Slice};
use super::node_contacts::{NodeContact, NodeLook};
use super::path::{Motion, Solid};
use super::press::solve_alone;
use super::press_nodes::{PressNodes, PressingSolid};
use super::supports::Supports;
use super::sweep::Corners;
use super::zone::zone_bit;
use crate::base::{Count, Stage, Stopwatch};
use crate::nodes::Bindings;

impl Contacts {
    /// Whether the tool in this place holds a node of the feature. What it holds may lie within it, and edges and faces from there
    /// on pass its surface: so it does not touch those either.
    fn is_held(&self, feature: Feature, slot: usize, bindings: Option<&Bindings>) -> bool {
        let held = |&node: &u32| self.held.binary_search(&(node, slot)).is_ok();
        !self.held.is_empty() && Supports::of(feature, bindings).nodes().iter().any(held)
    }

    /// Adds the contacts of a slice between these fractions of the step.
    pub(super) fn find(&mut self, meeting: &mut Meeting, slice: &Slice, ends: [f64; 2]) {
        let watch = Stopwatch::start(meeting.profile);
        self.find_among_candidates(meeting, slice, ends);
        watch.stop(meeting.profile, Stage::NarrowPhase);
        if let Some(profile) = meeting.profile {
            profile.count(Count::ToolContacts, self.constraints.len() + self.nodes.len());
        }
    }

    fn find_among_candidates(&mut self, meeting: &mut Meeting, slice: &Slice, [start, end]: [f64; 2]) {
        // Contacts that an equation is to know of, or has seen, are constraints all of them.
        let node_by_node = !slice.foresees && self.holds.is_empty();
        let all = self.candidates.masks.iter().fold(0, |all, mask| all | mask);
        let is_one = meeting.bindings.is_none()
            && meeting.neighbor_speed.is_none()
            && all.count_ones() == 1
            && all.leading_zeros() > 0;
        let mut zone = 0;
        for (place, tool) in meeting.tools.iter().enumerate() {
            if !tool.filter.meets(self.filter) {
                continue;
            }
            let bit = zone_bit(zone);
            zone += 1;
            let yields = self.driven.place(place);
            // An equation cannot move a tool.
            if all & bit == 0 || slice.foresees && yields.is_some() {
                continue;
            }
            let motion = tool.motion(start, end, meeting.dt, meeting.origin);
            let takes_nodes = node_by_node && yields.is_none();
            self.find_features(meeting, slice, (place, &motion), (bit, takes_nodes));
            if takes_nodes {
                // Nodes that share none with a touching edge or face, and meet no other tool, answer each by itself.
                let is_alone = is_one && self.constraints.is_empty();
                self.find_nodes(meeting, slice, (place, &motion), (bit, is_alone));
            }
        }
    }

    /// Adds the contacts of edges and faces with a tool, and those of nodes but where these are taken node by node and not bound to others.
    fn find_features(
        &mut self,
        meeting: &mut Meeting,
        slice: &Slice,
        (place, motion): (usize, &Motion),
        (bit, node_by_node): (u32, bool),
    ) {
        let (nodes, count) = (self.candidates.node_count(&self.features), self.candidates.near().len());
        let skips_nodes = node_by_node && meeting.bindings.is_none();
        let first = if skips_nodes { nodes } else { 0 };
        if first == count {
            return;
        }
        let room = motion.room(meeting, slice);
        if let Some(room) = &room {
            self.candidates
                .see_corners(room, skips_nodes, |corner| meeting.way(slice, corner));
        }
        for candidate in first..count {
            if self.candidates.masks[candidate] & bit == 0 {
                continue;
            }
            let index = self.candidates.near()[candidate];
            let is_bound = || meeting.bindings.is_some_and(|bindings| bindings.get(index).is_some());
            if node_by_node && candidate < nodes && !is_bound() {
                continue;
            }
            let Some(feature) = self.features.get(index) else {
                continue;
            };
            if room.is_none() {
                self.touch_plane(meeting, slice, (place, motion), feature);
            } else if let Some(corners) = self.candidates.corners(feature) {
                let met = candidate.checked_sub(nodes);
                self.touch(meeting, slice, (place, motion), (feature, &corners, met));
            }
        }
    }

    /// Adds the contacts of nodes with a tool, but for points that are bound to nodes.
    fn find_nodes(
        &mut self,
        meeting: &mut Meeting,
        slice: &Slice,
        (tool, motion): (usize, &Motion),
        (bit, is_alone): (u32, bool),
    ) {
        let count = self.candidates.node_count(&self.features);
        let look = NodeLook::new(meeting, slice, motion, meeting.tools[tool].slot);
        let is_even = is_alone && meeting.is_even(slice) && self.held.is_empty();
        let is_pressed = is_even && self.press_nodes(meeting, (tool, motion), &look, count);
        let left = if is_pressed { self.undecided.len() } else { count };
        for place in 0..left {
            let (node, candidate) = match self.undecided.get(place).filter(|_| is_pressed) {
                Some(&node) => (node, self.candidates.near[..count].partition_point(|&near| near < node)),
                None if self.candidates.masks[place] & bit == 0 => continue,
                None => (self.candidates.near()[place], place),
            };
            if meeting.bindings.is_some_and(|bindings| bindings.get(node).is_some()) {
                continue;
            }
            let plane = self.candidates.planes.get_mut(candidate);
            let Some(geometry) = look.meet(meeting, slice, node as usize, plane) else {
                continue;
            };
            if self.is_held(Feature::node(node), look.slot, meeting.bindings) {
                continue;
            }
            let Some(mut contact) = NodeContact::new(meeting, slice, (node, tool), &geometry, motion.friction) else {
                continue;
            };
            // What another tool gives may bring it nearer.
            if is_alone && contact.is_idle(meeting.velocities) {
                continue;
            }
            if !self.nodes.push(contact) {
                contact.solve_alone(meeting.velocities);
                self.settle_node(meeting, slice, &contact);
            }
        }
    }

    /// Gives the impulses of a round tool or a mesh to the nodes that it touches, in closed form; nodes whose motion has to be swept, or that see
    /// a mesh otherwise than before, are left to be looked at. `false`: it is neither.
    fn press_nodes(
        &mut self,
        meeting: &mut Meeting,
        (tool, motion): (usize, &Motion),
        look: &NodeLook,
        count: usize,
    ) -> bool {
        let solid = match (motion.from, motion.to) {
            (Solid::Rounded { .. }, _) => PressingSolid::Round {
                segment: look.segment,
                spin: motion.spin,
            },
            (Solid::Mesh(from), Solid::Mesh(to)) => {
                let Some(planes) = self.candidates.planes.get(..count) else {
                    return false;
                };
                PressingSolid::Mesh {
                    planes,
                    slot: look.slot as u32,
                    from,
                    to,
                    flat: look.flat(),
                }
            }
            _ => return false,
        };
        self.undecided.clear();
        let pressed = meeting.kernel.run(PressNodes {
            nodes: &self.candidates.near[..count],
            positions: meeting.positions.axes(),
            velocities: meeting.velocities.axes_mut(),
            next_positions: meeting.next_positions.axes_mut(),
            inverse_masses: meeting.mobility.inverse_masses,
            damping: meeting.mobility.damping,
            substep: meeting.substep,
            solid,
            thickness: meeting.thickness,
            closing: look.closing,
            centre: motion.centre,
            friction: motion.friction,
            undecided: &mut self.undecided,
        });
        let load = &mut self.loads[tool];
        load.impulse += pressed.impulse;
        load.angular_impulse += pressed.angular_impulse;
        self.given = self.given.and(&pressed.velocities);
        true
    }

    /// Adds the contact of one feature with a plane.
    fn touch_plane(
        &mut self,
        meeting: &mut Meeting,
        slice: &Slice,
        (tool, motion): (usize, &Motion),
        feature: Feature,
    ) {
        if let &[node] = feature.nodes()
            && !self.is_known(slice, (tool, feature, 0))
            && !self.is_held(feature, meeting.tools[tool].slot, meeting.bindings)
        {
            let found = meet_plane(meeting, slice, motion, node as usize);
            self.add(meeting, slice, (tool, motion.friction), (feature, 0), found);
        }
    }

    /// Adds the contact of one feature with a tool of any other shape; of an edge or face, which it is of those that are near.
    fn touch(
        &mut self,
        meeting: &mut Meeting,
        slice: &Slice,
        (tool, motion): (usize, &Motion),
        (feature, corners, met): (Feature, &Corners, Option<usize>),
    ) {
        if self.is_held(feature, meeting.tools[tool].slot, meeting.bindings) {
            return;
        }
        let of_tool = (tool, motion.friction);
        if let (Solid::Mesh(from), Solid::Mesh(to)) = (motion.from, motion.to) {
            if !self.is_known(slice, (tool, feature, 0)) {
                let last = met.and_then(|met| self.candidates.met.get_mut(met));
                let last = last.map(|last| (meeting.tools[tool].slot, last));
                let found = meet_mesh(meeting, slice, motion, (feature, corners), [&from, &to], last);
                self.add(meeting, slice, of_tool, (feature, 0), found);
            }
            return;
        }
        let segment = motion.segment(meeting.drifts);
        let has_tips = corners.count == 3 && !segment.is_point();
        for tip in 0..1 + u8::from(has_tips) {
            if self.is_known(slice, (tool, feature, tip)) {
                continue;
            }
            let met = if has_tips { segment.end(tip.into()) } else { segment };
            let found = meet_rounded(meeting, slice, motion, corners, &met);
            self.add(meeting, slice, of_tool, (feature, tip), found);
        }
    }

    /// Whether the equation that was solved has seen how this tool's tip meets the feature.
    fn is_known(&self, slice: &Slice, met: (usize, Feature, u8)) -> bool {
        !slice.foresees && self.holds.know(met)
    }

    pub(super) fn add(
        &mut self,
        meeting: &mut Meeting,
        slice: &Slice,
        (tool, friction): (usize, f32),
        (feature, tip): (Feature, u8),
        found: Option<ContactGeometry>,
    ) {
        let yielding = self
            .driven
            .place(tool)
            .map(|place| (place, &self.presses.yielding[place]));
        let found = found.and_then(|geometry| {
            let recoil = yielding.map_or([0.0; 2], |(_, tool)| {
                let arm = Vec3A::from(geometry.arm) - tool.center;
                [tool.answer(arm, geometry.normal.into()), tool.largest_answer(arm)]
            });
            meeting.constraint(slice, feature, &geometry, friction, recoil)
        });
        let Some(mut constraint) = found else {
            return;
        };
        (constraint.tool, constraint.tip) = (tool, tip);
        constraint.yielding = yielding.map_or(u32::MAX, |(place, _)| place as u32);
        if self.constraints.len() < self.together {
            self.constraints.push(constraint);
        } else if !slice.foresees {
            solve_alone(&mut constraint, meeting.velocities, &mut self.presses.yielding);
            self.settle(meeting, slice, &constraint, true);
        }
    }
}
