//! Contacts of single nodes with tools.
//!
//! The impulse of a kinematic tool on a node depends on no other node. With Coulomb friction it has a closed form. If
//! several tools touch a node, a few iterations over the node's contacts find the impulses.

use glam::{BVec3, Vec3, Vec3A};

use super::contact_geometry::{
    ContactGeometry, mesh_contact, mesh_geometry, plane_contact, rounded_contact, rounded_geometry,
};
use super::contact_input::{ContactInput, SubSlice};
use super::distance::closest_on_segment;
use super::features::Feature;
use super::mesh_solid::MeshSolid;
use super::nearest_plane::NearestPlane;
use super::path::{PosedShape, ToolMotion};
use super::sweep_control::{LEVERAGE, PgsLimits, PgsPass, depth_correction, sweep_until_converged};
use super::time_of_impact::{Corners, Segment, Separation, TOUCHING};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::Vectors;

/// Finds contacts of nodes with one tool in a slice. It stores the data that all nodes share.
pub(super) struct NodeQuery<'a> {
    motion: &'a ToolMotion<'a>,
    /// The tool's slot in the world.
    pub slot: usize,
    /// The segment of a rounded tool, and its radius with the contact thickness.
    pub segment: Segment,
    pub contact_radius: f32,
    /// Bound on the approach of a node and the tool, m.
    pub closing: f32,
}

impl<'a> NodeQuery<'a> {
    pub fn new(input: &ContactInput, slice: &SubSlice, motion: &'a ToolMotion<'a>, slot: usize) -> Self {
        let segment = motion.segment(input.drifts);
        let travel = match (motion.from, motion.to) {
            (PosedShape::Rounded { .. }, _) => segment.travel(),
            (PosedShape::HalfSpace { point: from, .. }, PosedShape::HalfSpace { point: to, .. })
                if motion.spin == Vec3::ZERO =>
            {
                from.distance(to)
            }
            (PosedShape::Mesh(from), PosedShape::Mesh(to)) => {
                let reach = motion.mesh.map_or(0.0, |solid| solid.reach());
                from.center.distance(to.center) + motion.spin.length() * slice.duration * reach
            }
            _ => f32::INFINITY,
        };
        Self {
            motion,
            slot,
            contact_radius: segment.radius + input.thickness,
            segment,
            closing: input.fastest * slice.duration + 2.0 * travel + input.slack,
        }
    }

    /// The contact of a node with the tool. `plane` is the last plane of a mesh for this node.
    #[inline]
    pub fn contact(
        &self,
        input: &ContactInput,
        slice: &SubSlice,
        node: usize,
        plane: Option<&mut NearestPlane>,
    ) -> Option<ContactGeometry> {
        let start = input.position(slice, node);
        match self.motion.from {
            PosedShape::Rounded { .. } => self.rounded_contact(input, slice, node, start),
            PosedShape::HalfSpace { point, normal } => {
                let is_near = (start - point).dot(normal) <= input.thickness + self.closing;
                is_near
                    .then(|| plane_contact(input, slice, self.motion, node))
                    .flatten()
            }
            PosedShape::Mesh(_) => self.mesh_contact(input, slice, (node, start), plane),
        }
    }

    #[inline]
    fn rounded_contact(
        &self,
        input: &ContactInput,
        slice: &SubSlice,
        node: usize,
        start: Vec3,
    ) -> Option<ContactGeometry> {
        let [a, b] = self.segment.ends;
        let along = closest_on_segment(start.into(), a, b);
        let offset = Vec3A::from(start) - a.lerp(b, along);
        let touching = self.contact_radius + TOUCHING * self.contact_radius;
        let distance_squared = offset.length_squared();
        if distance_squared > (touching + self.closing) * (touching + self.closing) {
            return None;
        }
        if distance_squared <= touching * touching {
            let separation = Separation {
                offset,
                weights: [1.0, 0.0, 0.0],
                along,
                inside: true,
            };
            return Some(rounded_geometry(
                input,
                slice,
                self.motion,
                &self.segment,
                (&separation, start),
            ));
        }
        let (start, step) = input.corner_motion(slice, node);
        rounded_contact(input, slice, self.motion, &Corners::of_node(start, step), &self.segment)
    }

    /// Distance of motion within which a mesh is treated as flat, m.
    pub fn flat(&self) -> f32 {
        self.motion.mesh.map_or(0.0, MeshSolid::flat)
    }

    /// Recomputes the plane through the mesh's closest point, unless it is still valid or the node cannot come near.
    fn refresh(&self, input: &ContactInput, start: Vec3, plane: &mut NearestPlane) {
        let (PosedShape::Mesh(from), Some(solid)) = (self.motion.from, self.motion.mesh) else {
            return;
        };
        let local = from.body_to_local(start);
        let (flat, near) = (solid.flat(), input.thickness + self.closing);
        if plane.is_valid_at(self.slot, local, [flat, near]) {
            return;
        }
        *plane = NearestPlane::farther_than(self.slot, local, near + flat);
        if let Some(closest) = solid.closest(&[local], plane.distance, false) {
            (plane.distance, plane.normal) = (closest.distance, closest.normal);
        }
    }

    /// The contact with a mesh. The plane through the closest point replaces the mesh until the node has moved far
    /// relative to it.
    fn mesh_contact(
        &self,
        input: &ContactInput,
        slice: &SubSlice,
        (node, start): (usize, Vec3),
        plane: Option<&mut NearestPlane>,
    ) -> Option<ContactGeometry> {
        let (PosedShape::Mesh(from), PosedShape::Mesh(to), Some(solid)) =
            (self.motion.from, self.motion.to, self.motion.mesh)
        else {
            return None;
        };
        let mut no_plane = NearestPlane::NONE;
        let plane = plane.unwrap_or(&mut no_plane);
        self.refresh(input, start, plane);
        if plane.normal == Vec3::ZERO || plane.slot as usize != self.slot {
            return None;
        }
        let (local, flat, near) = (from.body_to_local(start), self.flat(), input.thickness + self.closing);
        let distance = plane.distance + plane.normal.dot(local - plane.point);
        if distance > near {
            return None;
        }
        let (start, step) = input.corner_motion(slice, node);
        if input.drifts && to.body_to_local(start + step).distance_squared(local) > flat * flat {
            let corners = Corners::of_node(start, step);
            let feature = Feature::node(node as u32);
            return mesh_contact(input, slice, self.motion, (feature, &corners), [&from, &to], None);
        }
        if !input.drifts && distance > input.thickness + TOUCHING * solid.thickness() {
            return None;
        }
        let (surface, normal) = (local - plane.normal * distance, from.orientation * plane.normal);
        let weights = [1.0, 0.0, 0.0];
        let geometry = (surface, normal, distance, weights);
        Some(mesh_geometry(input, slice, self.motion, [&from, &to], geometry))
    }
}

/// The contact of a node with a tool over a slice.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeContact {
    pub node: u32,
    /// Index of the tool among those near the body.
    pub tool: usize,
    /// Position of the node when the slice begins.
    pub start: Vec3,
    /// Unit normal, away from the tool.
    pub normal: Vec3,
    /// Velocity of the tool's surface at the contact, m/s.
    surface_velocity: Vec3,
    /// Vector from the tool's position to the contact, m.
    pub arm: Vec3,
    /// Penetration depth at the start, m; not positive outside.
    pub depth: f32,
    pub friction: f32,
    /// Minimum velocity along the normal with which the node ends the slice outside the tool, m/s.
    target_velocity: f32,
    /// Velocity change along each axis per impulse, 1/kg; 0 along held axes.
    inv_mass: Vec3,
    /// Effective mass along the normal, kg. It is smaller if the node is held along axes near the normal.
    effective_mass: f32,
    /// Effective mass along a free direction, kg.
    tangent_mass: f32,
    /// Fraction of the impulse that is dropped in each iteration; positive if the node is held near the normal.
    softness: f32,
    /// Accumulated normal impulse, at least 0, and accumulated friction impulse, N s.
    impulse: f32,
    friction_impulse: Vec3,
    /// The impulse that the tool's load already includes, N s.
    pub counted_impulse: Vec3,
}

saved! { NodeContact {
    node, tool, start, normal, surface_velocity, arm, depth, friction, target_velocity, inv_mass, effective_mass,
    tangent_mass, softness, impulse, friction_impulse, counted_impulse,
} }

impl NodeContact {
    /// Creates a contact without impulse. Returns `None` if the node cannot move along the normal.
    pub fn new(
        input: &ContactInput,
        slice: &SubSlice,
        (node, tool): (u32, usize),
        geometry: &ContactGeometry,
        friction: f32,
    ) -> Option<Self> {
        let node_inv_mass = input.mobility.inverse_mass(node as usize);
        let held = input.pins.partial_axes_of(node);
        let normal = geometry.normal;
        let (mut normal_part, mut inv_mass) = (1.0, Vec3::splat(node_inv_mass));
        if held != BVec3::FALSE {
            normal_part = Vec3::select(held, Vec3::ZERO, normal).length_squared();
            inv_mass = Vec3::select(held, Vec3::ZERO, inv_mass);
        }
        // The impulse fades to 0 as the normal turns toward axes along which the node is held.
        let normal_inv_mass = node_inv_mass * normal_part;
        let leverage = node_inv_mass / LEVERAGE;
        let inverse_mass = leverage.max(normal_inv_mass);
        let gap = geometry.gap - input.thickness;
        (normal_inv_mass > 0.0).then(|| Self {
            node,
            tool,
            start: input.position(slice, node as usize),
            normal,
            surface_velocity: geometry.surface_velocity,
            arm: geometry.arm,
            depth: -gap,
            friction,
            target_velocity: geometry.surface_velocity.dot(normal) - gap.max(0.0) / slice.duration,
            inv_mass,
            effective_mass: (normal_inv_mass / leverage).min(1.0) / inverse_mass,
            tangent_mass: 1.0 / node_inv_mass,
            softness: 1.0 - normal_inv_mass / inverse_mass,
            impulse: 0.0,
            friction_impulse: Vec3::ZERO,
            counted_impulse: Vec3::ZERO,
        })
    }

    /// The geometry of the contact.
    pub fn geometry(&self, input: &ContactInput) -> ContactGeometry {
        ContactGeometry {
            weights: [1.0, 0.0, 0.0],
            normal: self.normal,
            surface_velocity: self.surface_velocity,
            arm: self.arm,
            gap: input.thickness - self.depth,
            rounded: None,
        }
    }

    /// Total impulse on the node, N s.
    pub fn total_impulse(&self) -> Vec3 {
        self.normal * self.impulse + self.friction_impulse
    }

    /// Moves the node out of the tool by `displacement`, m, without changing its velocity.
    pub fn push_out(&self, positions: &mut Vectors, displacement: f32) {
        let node = self.node as usize;
        let push = self.normal * (displacement * self.effective_mass) * self.inv_mass;
        positions.set(node, positions.get(node) + push);
    }

    /// Distance that the node still has to move to end the slice outside the tool, or less deep inside it, m.
    pub fn missing_distance(&self, positions: &Vectors, duration: f32) -> f32 {
        let displacement = (positions.get(self.node as usize) - self.start).dot(self.normal);
        self.target_velocity * duration + depth_correction(duration) * self.depth.max(0.0) - displacement
    }

    /// Updates the impulse and the node's velocity. Returns the change of velocity, m/s.
    #[inline]
    fn apply_impulse(&mut self, velocity: &mut Vec3) -> f32 {
        let velocity_error = self.target_velocity - velocity.dot(self.normal);
        let impulse = (self.impulse * (1.0 - self.softness) + velocity_error * self.effective_mass).max(0.0);
        let change = impulse - self.impulse;
        self.impulse = impulse;
        if change == 0.0 && self.friction == 0.0 {
            return 0.0;
        }
        let mut applied = self.normal * change;
        if self.friction > 0.0 {
            let slip = (*velocity - self.surface_velocity).reject_from_normalized(self.normal);
            let trial = self.friction_impulse - slip * self.tangent_mass;
            let friction = trial.clamp_length_max(self.friction * impulse);
            applied += friction - self.friction_impulse;
            self.friction_impulse = friction;
        }
        *velocity += applied * self.inv_mass;
        applied.length() / self.tangent_mass
    }

    /// True if the node receives no impulse at its current velocity.
    #[inline]
    pub fn is_idle(&self, velocities: &Vectors) -> bool {
        self.depth <= 0.0 && velocities.get(self.node as usize).dot(self.normal) >= self.target_velocity
    }

    /// Solves the contact independently of all others.
    pub fn solve_alone(&mut self, velocities: &mut Vectors) {
        solve(std::slice::from_mut(self), velocities, 1);
    }
}

/// Solves the contacts of one node in at most `sweeps` sweeps.
fn solve(contacts: &mut [NodeContact], velocities: &mut Vectors, sweeps: u32) {
    let node = contacts[0].node as usize;
    let mut velocity = velocities.get(node);
    if let [contact] = contacts
        && sweeps == 1
    {
        contact.apply_impulse(&mut velocity);
        velocities.set(node, velocity);
        return;
    }
    sweep_until_converged(PgsLimits::new(sweeps), None, |_| {
        let pressed = contacts.iter_mut().map(|contact| contact.apply_impulse(&mut velocity));
        pressed.fold(0.0, f32::max)
    });
    velocities.set(node, velocity);
}

/// The contacts of a slice with single nodes.
#[derive(Debug, Default)]
pub(super) struct NodeContacts(Vec<NodeContact>);

saved! { NodeContacts { 0 } }

impl NodeContacts {
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        memory::reserve(&mut self.0, count)
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn get(&self, index: usize) -> &NodeContact {
        &self.0[index]
    }

    pub fn iter(&self) -> std::slice::Iter<'_, NodeContact> {
        self.0.iter()
    }

    /// Adds a contact if memory is reserved for it.
    pub fn push(&mut self, contact: NodeContact) -> bool {
        let has_room = self.0.len() < self.0.capacity();
        if has_room {
            self.0.push(contact);
        }
        has_room
    }

    pub fn retain(&mut self, stays: impl Fn(&NodeContact) -> bool) {
        self.0.retain(stays);
    }

    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, NodeContact> {
        self.0.iter_mut()
    }

    /// Sweeps once over the contacts, with velocities that other solvers have changed. Returns the largest velocity
    /// change, m/s.
    pub fn sweep(&mut self, velocities: &mut [Vec3A], sweep: PgsPass) -> f32 {
        let pressing = self.0.iter_mut();
        let pressing = pressing.filter(|contact| sweep == PgsPass::All || contact.impulse > 0.0);
        let changes = pressing.map(|contact| {
            let node = contact.node as usize;
            let mut velocity = velocities[node].into();
            let change = contact.apply_impulse(&mut velocity);
            velocities[node] = velocity.into();
            change
        });
        changes.fold(0.0, f32::max)
    }

    /// Solves the contacts in at most `sweeps` sweeps per node.
    pub fn solve(&mut self, velocities: &mut Vectors, sweeps: u32) {
        if !self.0.is_sorted_by_key(|contact| contact.node) {
            self.0.sort_unstable_by_key(|contact| (contact.node, contact.tool));
        }
        for contacts in self.0.chunk_by_mut(|one, other| one.node == other.node) {
            let is_closed_form = contacts.len() == 1 && contacts[0].softness == 0.0;
            let sweeps = if is_closed_form { 1 } else { sweeps };
            solve(contacts, velocities, sweeps);
        }
    }
}
