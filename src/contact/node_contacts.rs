//! Contacts of single nodes with tools.
//!
//! A tool is kinematic, so what it gives to a node depends on no other node: the impulse with Coulomb friction has a closed form, and where
//! several tools meet a node, a few iterations over their contacts alone find it.

use glam::{BVec3, Vec3, Vec3A};

use super::distance::closest_on_segment;
use super::features::Feature;
use super::impulses::{Effort, LEVERAGE, Sweep, pushed_out, relax};
use super::meet::{ContactGeometry, meet_mesh, meet_plane, meet_rounded, mesh_geometry, round_geometry};
use super::meeting::{Meeting, Slice};
use super::mesh_solid::MeshSolid;
use super::nearest_plane::NearestPlane;
use super::path::{Motion, Solid};
use super::sweep::{Corners, Segment, Separation, TOUCHING};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::Vectors;

/// What finds the contacts of nodes with a tool in a slice: what is the same for all of them.
pub(super) struct NodeLook<'a> {
    motion: &'a Motion<'a>,
    /// The tool's place in the world.
    pub slot: usize,
    /// The segment of a round tool, and the radius at which it is met.
    pub segment: Segment,
    pub around: f32,
    /// How much nearer a node and the tool may come, m.
    pub closing: f32,
}

impl<'a> NodeLook<'a> {
    pub fn new(meeting: &Meeting, slice: &Slice, motion: &'a Motion<'a>, slot: usize) -> Self {
        let segment = motion.segment(meeting.drifts);
        let travel = match (motion.from, motion.to) {
            (Solid::Rounded { .. }, _) => segment.travel(),
            (Solid::HalfSpace { point: from, .. }, Solid::HalfSpace { point: to, .. }) if motion.spin == Vec3::ZERO => {
                from.distance(to)
            }
            (Solid::Mesh(from), Solid::Mesh(to)) => {
                let reach = motion.mesh.map_or(0.0, |solid| solid.reach());
                from.centre.distance(to.centre) + motion.spin.length() * slice.duration * reach
            }
            _ => f32::INFINITY,
        };
        Self {
            motion,
            slot,
            around: segment.radius + meeting.thickness,
            segment,
            closing: meeting.fastest * slice.duration + 2.0 * travel + meeting.slack,
        }
    }

    /// How a node meets the tool. `plane` is how it saw a mesh last.
    #[inline]
    pub fn meet(
        &self,
        meeting: &Meeting,
        slice: &Slice,
        node: usize,
        plane: Option<&mut NearestPlane>,
    ) -> Option<ContactGeometry> {
        let start = meeting.position(slice, node);
        match self.motion.from {
            Solid::Rounded { .. } => self.meet_rounded(meeting, slice, node, start),
            Solid::HalfSpace { point, normal } => {
                let is_near = (start - point).dot(normal) <= meeting.thickness + self.closing;
                is_near.then(|| meet_plane(meeting, slice, self.motion, node)).flatten()
            }
            Solid::Mesh(_) => self.meet_mesh(meeting, slice, (node, start), plane),
        }
    }

    #[inline]
    fn meet_rounded(&self, meeting: &Meeting, slice: &Slice, node: usize, start: Vec3) -> Option<ContactGeometry> {
        let [a, b] = self.segment.ends;
        let along = closest_on_segment(start.into(), a, b);
        let offset = Vec3A::from(start) - a.lerp(b, along);
        let touching = self.around + TOUCHING * self.around;
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
            return Some(round_geometry(
                meeting,
                slice,
                self.motion,
                &self.segment,
                (&separation, start),
            ));
        }
        let (start, step) = meeting.way(slice, node);
        meet_rounded(
            meeting,
            slice,
            self.motion,
            &Corners::of_node(start, step),
            &self.segment,
        )
    }

    /// A mesh is seen as flat by what moves no further, m.
    pub fn flat(&self) -> f32 {
        self.motion.mesh.map_or(0.0, MeshSolid::flat)
    }

    /// Makes the plane through the mesh's closest point one of where the node is, unless it still serves or the node cannot come near.
    fn refresh(&self, meeting: &Meeting, start: Vec3, plane: &mut NearestPlane) {
        let (Solid::Mesh(from), Some(solid)) = (self.motion.from, self.motion.mesh) else {
            return;
        };
        let own = from.own(start);
        let (flat, near) = (solid.flat(), meeting.thickness + self.closing);
        if plane.serves(self.slot, own, [flat, near]) {
            return;
        }
        *plane = NearestPlane::beyond(self.slot, own, near + flat);
        if let Some(closest) = solid.closest(&[own], plane.distance, false) {
            (plane.distance, plane.normal) = (closest.distance, closest.normal);
        }
    }

    /// A mesh is the plane through its closest point, as long as the node has not moved far against it.
    fn meet_mesh(
        &self,
        meeting: &Meeting,
        slice: &Slice,
        (node, start): (usize, Vec3),
        plane: Option<&mut NearestPlane>,
    ) -> Option<ContactGeometry> {
        let (Solid::Mesh(from), Solid::Mesh(to), Some(solid)) = (self.motion.from, self.motion.to, self.motion.mesh)
        else {
            return None;
        };
        let mut unknown = NearestPlane::NONE;
        let plane = plane.unwrap_or(&mut unknown);
        self.refresh(meeting, start, plane);
        if plane.normal == Vec3::ZERO || plane.slot as usize != self.slot {
            return None;
        }
        let (own, flat, near) = (from.own(start), self.flat(), meeting.thickness + self.closing);
        let distance = plane.distance + plane.normal.dot(own - plane.point);
        if distance > near {
            return None;
        }
        let (start, step) = meeting.way(slice, node);
        if meeting.drifts && to.own(start + step).distance_squared(own) > flat * flat {
            let corners = Corners::of_node(start, step);
            let feature = Feature::node(node as u32);
            return meet_mesh(meeting, slice, self.motion, (feature, &corners), [&from, &to], None);
        }
        if !meeting.drifts && distance > meeting.thickness + TOUCHING * solid.thickness() {
            return None;
        }
        let (surface, normal) = (own - plane.normal * distance, from.orientation * plane.normal);
        let weights = [1.0, 0.0, 0.0];
        let found = (surface, normal, distance, weights);
        Some(mesh_geometry(meeting, slice, self.motion, [&from, &to], found))
    }
}

/// The contact of a node with a tool over a slice.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeContact {
    pub node: u32,
    /// The tool's place among those near the body.
    pub tool: usize,
    /// Where the node is as the slice begins.
    pub start: Vec3,
    /// Away from the tool, of unit length.
    pub normal: Vec3,
    /// Velocity of the tool's surface at the contact, m/s.
    surface_velocity: Vec3,
    /// From the tool's position to the contact, m.
    pub arm: Vec3,
    /// How deep the node is inside at the start, m; not above 0 where it is outside.
    pub depth: f32,
    pub friction: f32,
    /// The node's velocity along the normal is at least this, m/s: then it ends the slice outside of the tool.
    least_speed: f32,
    /// Change of velocity along each axis for an impulse, 1/kg; 0 along held axes.
    answer: Vec3,
    /// Mass that an impulse along the normal moves, kg; less where the node is held along axes near the normal.
    effective_mass: f32,
    /// Mass that an impulse along a free direction moves, kg.
    free_mass: f32,
    /// By what part of itself the impulse is taken back in an iteration: above 0 where the node is held near the normal.
    give: f32,
    /// What the node has received so far along the normal, N s, at least 0, and by friction.
    impulse: f32,
    friction_impulse: Vec3,
    /// What of that its tool's load has, N s.
    pub counted: Vec3,
}

saved! { NodeContact {
    node, tool, start, normal, surface_velocity, arm, depth, friction, least_speed, answer, effective_mass, free_mass,
    give, impulse, friction_impulse, counted,
} }

impl NodeContact {
    /// A contact that has given nothing yet; `None` where the node cannot move along the normal.
    pub fn new(
        meeting: &Meeting,
        slice: &Slice,
        (node, tool): (u32, usize),
        geometry: &ContactGeometry,
        friction: f32,
    ) -> Option<Self> {
        let free = meeting.mobility.of(node as usize);
        let held = meeting.pins.partial_axes_of(node);
        let normal = geometry.normal;
        let (mut along, mut answer) = (1.0, Vec3::splat(free));
        if held != BVec3::FALSE {
            along = Vec3::select(held, Vec3::ZERO, normal).length_squared();
            answer = Vec3::select(held, Vec3::ZERO, answer);
        }
        // The nearer the normal is to axes that the node is held along, the less is given, down to nothing.
        let rigid = free * along;
        let leverage = free / LEVERAGE;
        let inverse_mass = leverage.max(rigid);
        let gap = geometry.gap - meeting.thickness;
        (rigid > 0.0).then(|| Self {
            node,
            tool,
            start: meeting.position(slice, node as usize),
            normal,
            surface_velocity: geometry.surface_velocity,
            arm: geometry.arm,
            depth: -gap,
            friction,
            least_speed: geometry.surface_velocity.dot(normal) - gap.max(0.0) / slice.duration,
            answer,
            effective_mass: (rigid / leverage).min(1.0) / inverse_mass,
            free_mass: 1.0 / free,
            give: 1.0 - rigid / inverse_mass,
            impulse: 0.0,
            friction_impulse: Vec3::ZERO,
            counted: Vec3::ZERO,
        })
    }

    /// How the node met the tool.
    pub fn geometry(&self, meeting: &Meeting) -> ContactGeometry {
        ContactGeometry {
            weights: [1.0, 0.0, 0.0],
            normal: self.normal,
            surface_velocity: self.surface_velocity,
            arm: self.arm,
            gap: meeting.thickness - self.depth,
            rounded: None,
        }
    }

    /// What the node received, N s.
    pub fn given(&self) -> Vec3 {
        self.normal * self.impulse + self.friction_impulse
    }

    /// Moves the node out of the tool by so much, m, without giving it speed.
    pub fn push_out(&self, positions: &mut Vectors, way: f32) {
        let node = self.node as usize;
        let push = self.normal * (way * self.effective_mass) * self.answer;
        positions.set(node, positions.get(node) + push);
    }

    /// How much further the node is to go to end the slice of `duration` seconds outside of the tool, or less deep within it, m.
    pub fn lacks(&self, positions: &Vectors, duration: f32) -> f32 {
        let way = (positions.get(self.node as usize) - self.start).dot(self.normal);
        self.least_speed * duration + pushed_out(duration) * self.depth.max(0.0) - way
    }

    /// Gives the node's velocity what is missing, or takes back what was too much: how much that changed, m/s.
    #[inline]
    fn press(&mut self, velocity: &mut Vec3) -> f32 {
        let missing = self.least_speed - velocity.dot(self.normal);
        let impulse = (self.impulse * (1.0 - self.give) + missing * self.effective_mass).max(0.0);
        let change = impulse - self.impulse;
        self.impulse = impulse;
        if change == 0.0 && self.friction == 0.0 {
            return 0.0;
        }
        let mut given = self.normal * change;
        if self.friction > 0.0 {
            let slip = (*velocity - self.surface_velocity).reject_from_normalized(self.normal);
            let wanted = self.friction_impulse - slip * self.free_mass;
            let friction = wanted.clamp_length_max(self.friction * impulse);
            given += friction - self.friction_impulse;
            self.friction_impulse = friction;
        }
        *velocity += given * self.answer;
        given.length() / self.free_mass
    }

    /// Whether the node is to receive nothing, as it moves now.
    #[inline]
    pub fn is_idle(&self, velocities: &Vectors) -> bool {
        self.depth <= 0.0 && velocities.get(self.node as usize).dot(self.normal) >= self.least_speed
    }

    /// Gives the impulse as if there were no other contacts.
    pub fn solve_alone(&mut self, velocities: &mut Vectors) {
        solve(std::slice::from_mut(self), velocities, 1);
    }
}

/// Gives the impulses of the contacts of one node, in so many sweeps at most.
fn solve(contacts: &mut [NodeContact], velocities: &mut Vectors, sweeps: u32) {
    let node = contacts[0].node as usize;
    let mut velocity = velocities.get(node);
    if let [contact] = contacts
        && sweeps == 1
    {
        contact.press(&mut velocity);
        velocities.set(node, velocity);
        return;
    }
    relax(Effort::of(sweeps), None, |_| {
        let pressed = contacts.iter_mut().map(|contact| contact.press(&mut velocity));
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

    /// Adds a contact, where there is room.
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

    /// One sweep on velocities that something else has changed: the most that a contact changed, m/s.
    pub fn sweep(&mut self, velocities: &mut [Vec3A], sweep: Sweep) -> f32 {
        let pressing = self.0.iter_mut();
        let pressing = pressing.filter(|contact| sweep == Sweep::All || contact.impulse > 0.0);
        let changes = pressing.map(|contact| {
            let node = contact.node as usize;
            let mut velocity = velocities[node].into();
            let change = contact.press(&mut velocity);
            velocities[node] = velocity.into();
            change
        });
        changes.fold(0.0, f32::max)
    }

    /// Gives the impulses, in so many sweeps over the contacts of a node at most.
    pub fn solve(&mut self, velocities: &mut Vectors, sweeps: u32) {
        if !self.0.is_sorted_by_key(|contact| contact.node) {
            self.0.sort_unstable_by_key(|contact| (contact.node, contact.tool));
        }
        for contacts in self.0.chunk_by_mut(|one, other| one.node == other.node) {
            let is_closed_form = contacts.len() == 1 && contacts[0].give == 0.0;
            let sweeps = if is_closed_form { 1 } else { sweeps };
            solve(contacts, velocities, sweeps);
        }
    }
}
