//! What tools hold of a body: nodes that a tool leads as if they were part of it, and what that takes.
//!
//! A node that is held is a pin, so every solver holds it exactly. What holds it is all that acts on the tool in return: what
//! pins tell, and what it takes to move the node's own mass, and to move it against what damps it.

use glam::{BVec3, DVec3, Vec3};

use super::{Body, Pin, Vectors};
use crate::contact::ToolPath;
use crate::diagnostics::StateHasher;
use crate::error::{Error, Result};
use crate::slots::SlotId;
use crate::solver::close;

/// A node that a tool holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grasp {
    /// Its name among the world's attachments.
    pub id: SlotId,
    /// The holder's place among the world's tools.
    pub tool: usize,
    node: u32,
    /// What is held in the tool's own axes, from its position, m; `None`: where it is when the next step begins.
    offset: Option<DVec3>,
    /// The mean force over a step with which the tool just holds it, N.
    limit: f32,
    /// What the tool did to the tissue, mean over the last step: N, and N m about the tool's position.
    pub force: Vec3,
    pub torque: Vec3,
    /// How much faster the node was led in the last step than before it, m/s.
    gain: Vec3,
    course: Course,
}

/// The step in progress of what is held.
#[derive(Clone, Copy, Debug, Default)]
struct Course {
    offset: DVec3,
    /// How far the node is from where the tool has it when the step begins, m; nothing, but for a body that was put back.
    gap: DVec3,
    /// The velocity of the node and what that gained in the last substep, m/s.
    velocity: Vec3,
    gain: Vec3,
    /// What is known already of what holds the pin.
    pin_sum: DVec3,
    /// Sums over substeps, N and N m.
    force_sum: DVec3,
    torque_sum: DVec3,
}

/// What a substep made of forces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lapse {
    /// How long they acted, s, and what part of the last gain went on without them.
    pub time: f64,
    pub carried: f64,
    /// The fraction of the step at which they acted.
    pub at: f64,
    /// What part of a substep nodes moved.
    pub moved: f64,
    /// Whether they acted with the nodes where they are next.
    pub is_next: bool,
}

/// All that tools hold of a body, in the order in which they came.
#[derive(Debug, Default)]
pub(crate) struct Grasps {
    grasps: Vec<Grasp>,
}

impl Grasps {
    pub fn iter(&self) -> std::slice::Iter<'_, Grasp> {
        self.grasps.iter()
    }

    /// Whether what is to be told of them is finite.
    pub fn sums_fit(&self, fits: impl Fn(DVec3) -> bool) -> bool {
        let fit = |course: &Course| fits(course.force_sum) && fits(course.torque_sum);
        self.grasps.iter().all(|grasp| fit(&grasp.course))
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for grasp in &self.grasps {
            hasher.write_u64(u64::from(grasp.node) << 32 | grasp.tool as u64);
            hasher.write_u64(u64::from(grasp.offset.is_some()));
            for value in grasp.offset.unwrap_or_default().to_array() {
                hasher.write_u64(value.to_bits());
            }
            hasher.write_floats(&[grasp.limit]);
            hasher.write_floats(&grasp.gain.to_array());
        }
    }
}

impl Grasp {
    /// Where the tool has the node after this fraction of the step, in the coordinates of a body that begin at `origin`.
    fn place(&self, path: &ToolPath, fraction: f64, origin: DVec3) -> DVec3 {
        path.carried(self.course.offset, fraction, origin) + self.course.gap * (1.0 - fraction)
    }
}

/// The way of the tool in this place.
fn path_of(tools: &[ToolPath], slot: usize) -> Option<&ToolPath> {
    let index = tools.binary_search_by_key(&slot, |path| path.slot).ok()?;
    Some(&tools[index])
}

impl Body {
    /// What tools hold of it.
    pub(crate) fn grasps(&self) -> impl Iterator<Item = &Grasp> {
        self.grasps.iter().flat_map(|grasps| grasps.iter())
    }

    /// Whether a tool holds anything of it.
    pub(crate) fn is_grasped(&self) -> bool {
        self.grasps().next().is_some()
    }

    /// Whether these nodes can be held, each by itself.
    pub(crate) fn check_graspable(&self, nodes: &[u32]) -> Result<()> {
        let mut own = crate::memory::reserved(nodes.len())?;
        for (index, &node) in nodes.iter().enumerate() {
            self.check_node(&format_args!("nodes[{index}]"), node)?;
            self.check_not_held(&format_args!("nodes[{index}]"), node)?;
            if self.pins.get(self.order.own(node)).is_some() {
                return Err(Error::invalid(format!(
                    "nodes[{index}] is {node}: it is pinned, and stays where its pin leads it"
                )));
            }
            own.push(node);
        }
        own.sort_unstable();
        match own.windows(2).find(|pair| pair[0] == pair[1]) {
            None => Ok(()),
            Some(pair) => Err(Error::invalid(format!("nodes names {} more than once", pair[0]))),
        }
    }

    /// Refuses a node that a tool holds.
    pub(super) fn check_not_held(&self, name: &dyn std::fmt::Display, node: u32) -> Result<()> {
        let own = self.order.own(node);
        if self.grasps().any(|grasp| grasp.node == own) {
            return Err(Error::invalid(format!("{name} is {node}: a tool holds it")));
        }
        Ok(())
    }

    /// Makes room for so many grasps more.
    pub(crate) fn reserve_grasps(&mut self, count: usize) -> Result<()> {
        self.pins.reserve(count, self.masses.len())?;
        if let Some(contacts) = &mut self.contacts {
            contacts.reserve_held(count)?;
        }
        let grasps = self.grasps.get_or_insert_default();
        Ok(grasps.grasps.try_reserve(count)?)
    }

    /// Has the tool in this place hold these nodes, for which there is room and which can be held, under these names.
    pub(crate) fn grasp(
        &mut self,
        tool: usize,
        nodes: &[u32],
        ids: impl Iterator<Item = SlotId>,
        limit: f32,
    ) -> Result<()> {
        close(self);
        // Damping is to be that of masses as they are.
        self.scale_masses(0.0);
        for (&node, id) in nodes.iter().zip(ids) {
            let node = self.order.own(node);
            self.pins.hold(node, BVec3::TRUE)?;
            self.inverse_masses[node as usize] = 0.0;
            if let Some(applied) = &mut self.applied {
                applied.set(node as usize, Vec3::ZERO);
            }
            if let Some(contacts) = &mut self.contacts {
                contacts.hold(node, tool);
            }
            self.grasps.get_or_insert_default().grasps.push(Grasp {
                id,
                tool,
                node,
                offset: None,
                limit: if limit > 0.0 { limit } else { f32::INFINITY },
                force: Vec3::ZERO,
                torque: Vec3::ZERO,
                gain: self
                    .implicit
                    .as_ref()
                    .map_or(Vec3::ZERO, |implicit| implicit.gain_of(node as usize)),
                course: Course::default(),
            });
        }
        self.forget_held();
        Ok(())
    }

    /// Ends a grasp.
    pub(crate) fn let_go(&mut self, id: SlotId) {
        self.let_go_where(|grasp| grasp.id == id, |_| ());
        if !self.is_grasped() {
            self.grasps = None;
        }
    }

    /// Ends all grasps of the tool in this place.
    pub(crate) fn let_go_of(&mut self, tool: usize) {
        self.let_go_where(|grasp| grasp.tool == tool, |_| ());
        if !self.is_grasped() {
            self.grasps = None;
        }
    }

    /// Ends the grasps whose limit the last step went beyond, and shows them. Needs no memory.
    pub(crate) fn slip(&mut self, see: impl FnMut(SlotId)) {
        self.let_go_where(|grasp| grasp.force.length() > grasp.limit, see);
    }

    fn let_go_where(&mut self, ends: impl Fn(&Grasp) -> bool, mut see: impl FnMut(SlotId)) {
        if !self.grasps().any(&ends) {
            return;
        }
        close(self);
        let Some(grasps) = &mut self.grasps else {
            return;
        };
        let (pins, contacts) = (&mut self.pins, &mut self.contacts);
        let (masses, inverse_masses) = (&self.masses, &mut self.inverse_masses);
        grasps.grasps.retain(|grasp| {
            let stays = !ends(grasp);
            if !stays {
                pins.remove(grasp.node);
                inverse_masses[grasp.node as usize] = 1.0 / masses[grasp.node as usize];
                if let Some(contacts) = contacts {
                    contacts.release(grasp.node, grasp.tool);
                }
                see(grasp.id);
            }
            stays
        });
        self.forget_held();
    }

    /// Other nodes are held now.
    fn forget_held(&mut self) {
        self.scale_masses(self.carry.masses_for);
        self.forget_matrix();
    }

    /// Nodes were put elsewhere: tools hold them there.
    pub(super) fn grasp_anew(&mut self) {
        for grasp in self.grasps.iter_mut().flat_map(|grasps| &mut grasps.grasps) {
            grasp.offset = None;
        }
    }

    /// Begins a step over, from what is current.
    pub(crate) fn begin_grasps(&mut self, tools: &[ToolPath]) {
        let state = &self.state;
        for grasp in self.grasps.iter_mut().flat_map(|grasps| &mut grasps.grasps) {
            let Some(path) = path_of(tools, grasp.tool) else {
                continue;
            };
            let node = grasp.node as usize;
            let position = state.positions().get(node).as_dvec3();
            let offset = grasp.offset.unwrap_or_else(|| path.offset(position, self.origin));
            grasp.course = Course {
                offset,
                gap: position - path.carried(offset, 0.0, self.origin),
                velocity: state.velocities().get(node),
                gain: grasp.gain,
                ..Course::default()
            };
        }
    }

    /// Has the tools lead what they hold between these fractions of the step: from point to point of the way of a tool that turns.
    pub(crate) fn lead_grasps(&mut self, tools: &[ToolPath], [start, end]: [f64; 2]) {
        let origin = self.origin;
        for grasp in self.grasps.iter().flat_map(|grasps| &grasps.grasps) {
            let (Some(path), Some(pin)) = (path_of(tools, grasp.tool), self.pins.get_mut(grasp.node)) else {
                continue;
            };
            let there = grasp.place(path, end, origin);
            let travel = (there - grasp.place(path, start, origin)) / (end - start);
            pin.travel = travel.as_vec3();
            pin.goal = (there + travel * (1.0 - end)).as_vec3();
        }
    }

    /// Adds up what holds what tools hold, after a substep that is not current yet.
    pub(crate) fn feel_grasps(&mut self, tools: &[ToolPath], lapse: Lapse) {
        let Some(grasps) = &mut self.grasps else {
            return;
        };
        let rates = self.damping.as_ref().map(|damping| damping.rates());
        let state = self.state.substep();
        let positions = if lapse.is_next {
            state.next_positions
        } else {
            state.positions
        };
        for grasp in &mut grasps.grasps {
            let (Some(path), Some(pin)) = (path_of(tools, grasp.tool), self.pins.get(grasp.node)) else {
                continue;
            };
            let node = grasp.node as usize;
            let arm = positions.get(node).as_dvec3() - path.carried(DVec3::ZERO, lapse.at, self.origin);
            let mass = f64::from(self.masses[node]);
            let drag = rates.map_or(0.0, |rates| f64::from(rates[node])) * mass * lapse.moved;
            grasp.course.feel(pin, state.velocities, [mass, drag], &lapse, arm);
        }
    }

    /// The step in progress, of so many substeps, is the current state.
    pub(super) fn commit_grasps(&mut self, substeps: u32) {
        for grasp in self.grasps.iter_mut().flat_map(|grasps| &mut grasps.grasps) {
            let mean = |sum: DVec3| (sum / f64::from(substeps)).as_vec3();
            grasp.force = mean(grasp.course.force_sum);
            grasp.torque = mean(grasp.course.torque_sum);
            grasp.gain = grasp.course.gain;
            grasp.offset = Some(grasp.course.offset);
        }
    }

    /// What is held is at rest, as its pins tell.
    pub(super) fn rest_grasps(&mut self) {
        let pins = &self.pins;
        for grasp in self.grasps.iter_mut().flat_map(|grasps| &mut grasps.grasps) {
            grasp.force = pins.get(grasp.node).map_or(Vec3::ZERO, |pin| pin.force);
            grasp.gain = Vec3::ZERO;
        }
    }
}

impl Course {
    /// Adds what held the node of this pin, with its mass, kg, and what damps it, N s/m, at the end of this arm, m.
    fn feel(&mut self, pin: &Pin, velocities: &Vectors, [mass, drag]: [f64; 2], lapse: &Lapse, arm: DVec3) {
        let velocity = velocities.get(pin.node as usize);
        let gain = velocity - self.velocity;
        let without_force = self.gain.as_dvec3() * lapse.carried;
        let mut force = pin.force_sum - self.pin_sum;
        force += (gain.as_dvec3() - without_force) * (mass / lapse.time) + velocity.as_dvec3() * drag;
        self.force_sum += force;
        self.torque_sum += arm.cross(force);
        self.pin_sum = pin.force_sum;
        self.velocity = velocity;
        self.gain = gain;
    }
}
