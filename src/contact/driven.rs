//! Tools that are rigid bodies, as one body meets them in a step.
//!
//! A dynamic tool is one more unknown of the contact solver: in each substep its velocity changes in the same sweeps as those of
//! the nodes, so that neither a light nor a heavy one overshoots. Bodies take a step independently of each other, and in substeps of
//! their own. Each therefore moves a copy of the tool, with the tool's mass divided among the bodies that it presses, and the step puts
//! the copies together (mass splitting: Tonge, Benevolenski, Voroshilov 2012). Momentum is kept exactly, and energy does not grow.

use glam::{DVec3, Mat3A, Vec3, Vec3A};

use super::contacts::ToolLoad;
use super::path::ToolPath;
use super::rigid::{Rigid, RigidMass, RigidState};
use super::tool::Pose;
use crate::base::{Result, memory};
use crate::geometry::rotation::{turn_between, turned};

/// A dynamic tool in a step that begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DynamicTool {
    /// Its place among the tools of the step.
    pub index: usize,
    /// Its mass, divided among the bodies that it presses.
    pub mass: RigidMass,
    pub motion: RigidState,
    /// What accelerates it beside contacts, m/s² and N m, divided as the mass is.
    pub drive: (DVec3, DVec3),
    /// Among how many bodies it is divided.
    pub shares: u32,
}

/// A dynamic tool on its way through a step.
#[derive(Clone, Copy, Debug)]
struct Copied {
    tool: DynamicTool,
    /// What part of the step it has gone.
    gone: f64,
    /// What of its load has moved it.
    taken: ToolLoad,
    /// The energy that contact gave it, J.
    received: f64,
    /// For how long its drive has acted, s, and acts in the slice in progress.
    driven_for: f64,
    kick: f64,
    /// For how long the contacts of the last slice moved it, s.
    moved_for: f64,
}

/// The dynamic tools of a step, as contact with one body moves them; empty where there are none.
#[derive(Debug, Default)]
pub(super) struct Driven {
    copies: Vec<Copied>,
    /// The ways of all tools, those of dynamic ones as they go on from where they are.
    pub paths: Vec<ToolPath>,
}

/// A dynamic tool while contacts are solved: how it answers impulses, and by how much it has become faster.
#[derive(Clone, Copy, Debug)]
pub(super) struct YieldingTool {
    /// From the tool's position to its centre of mass, m.
    pub center: Vec3A,
    /// 1/kg
    pub inverse_mass: f32,
    /// In world axes, 1/(kg m²).
    pub inverse_inertia: Mat3A,
    /// m/s
    pub velocity: Vec3A,
    /// rad/s
    pub spin: Vec3A,
    /// What moves it out of tissue, m, in sum over so many contacts.
    pub out: Vec3A,
    pub outs: u32,
}

impl DynamicTool {
    /// A tool at this place among those of the step, divided among so many bodies.
    pub fn new(index: usize, rigid: &Rigid, gravity: Vec3, shares: u32) -> Self {
        let part = 1.0 / f64::from(shares);
        let (acceleration, torque) = rigid.drive(gravity);
        Self {
            index,
            mass: rigid.mass.part(part),
            motion: RigidState {
                angular_momentum: rigid.motion.angular_momentum * part,
                ..rigid.motion
            },
            drive: (acceleration, torque * part),
            shares,
        }
    }

    /// Where it is after a step in which nothing is in its way.
    fn free(&self, dt: f32) -> RigidState {
        let mut motion = self.motion;
        motion.fly(&self.mass, self.drive, f64::from(dt));
        motion
    }

    /// Makes a way that of its free flight.
    pub fn plan(&self, path: &mut ToolPath, dt: f32) {
        let end = self.free(dt);
        let turn = turn_between(self.motion.orientation, end.orientation).as_vec3();
        let strays = self.drive.0.length() * f64::from(dt) * f64::from(dt);
        let poses = [self.motion.pose(&self.mass), end.pose(&self.mass)];
        path.lead(poses, turn, 0.0, strays as f32);
    }

    /// Puts together where bodies that pressed it moved their parts of it in a step: the change of its momentum is the sum of what they
    /// gave it, and its place the mean over all parts, of which the others flew freely.
    pub fn joined(&self, dt: f32, ends: impl Iterator<Item = RigidState>) -> RigidState {
        let free = self.free(dt);
        let part = 1.0 / f64::from(self.shares);
        let mut whole = RigidState {
            angular_momentum: free.angular_momentum / part,
            ..free
        };
        let mut turn = DVec3::ZERO;
        for end in ends {
            whole.center += (end.center - free.center) * part;
            whole.velocity += (end.velocity - free.velocity) * part;
            whole.angular_momentum += end.angular_momentum - free.angular_momentum;
            turn += turn_between(free.orientation, end.orientation) * part;
        }
        whole.orientation = turned(free.orientation, turn);
        whole
    }
}

impl YieldingTool {
    /// How much faster its surface becomes at this arm from its centre of mass along this direction for an impulse along it, 1/kg.
    pub fn answer(&self, arm: Vec3A, direction: Vec3A) -> f32 {
        let moment = arm.cross(direction);
        self.inverse_mass + moment.dot(self.inverse_inertia * moment)
    }

    /// The same along any direction, at most.
    pub fn largest_answer(&self, arm: Vec3A) -> f32 {
        let inertia = &self.inverse_inertia;
        let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
        self.inverse_mass + trace * arm.length_squared()
    }

    /// How much faster its surface has become there, m/s.
    #[inline]
    pub fn gained(&self, arm: Vec3A) -> Vec3A {
        self.velocity + self.spin.cross(arm)
    }

    /// Takes the reaction of an impulse on tissue.
    #[inline]
    pub fn recoil(&mut self, arm: Vec3A, given: Vec3A) {
        self.velocity -= given * self.inverse_mass;
        self.spin -= self.inverse_inertia * arm.cross(given);
    }

    /// Counts a contact that moves it out of tissue by such an impulse, kg m.
    pub fn push_out(&mut self, impulse: Vec3) {
        self.out += Vec3A::from(impulse) * self.inverse_mass;
        self.outs += 1;
    }

    /// Where it began inside of tissue: its part of the way out, the mean of what its contacts ask for, m.
    fn way_out(&self) -> DVec3 {
        Vec3::from(self.out / self.outs.max(1) as f32).as_dvec3()
    }
}

impl Driven {
    /// Makes room for so many tools in all, of which so many are dynamic.
    pub fn reserve(&mut self, tools: usize, dynamic: usize) -> Result<()> {
        memory::reserve(&mut self.copies, dynamic)?;
        memory::reserve(&mut self.paths, if dynamic > 0 { tools } else { 0 })
    }

    /// Makes room for so many tools in all, where some are dynamic.
    pub fn reserve_ways(&mut self, tools: usize) -> Result<()> {
        let is_used = self.copies.capacity() > 0;
        memory::reserve(&mut self.paths, if is_used { tools } else { 0 })
    }

    /// Begins a step.
    pub fn begin(&mut self, tools: &[ToolPath], dynamic: &[DynamicTool]) {
        self.copies.clear();
        self.paths.clear();
        if dynamic.is_empty() {
            return;
        }
        self.copies.extend(dynamic.iter().map(|&tool| Copied {
            tool,
            gone: 0.0,
            taken: ToolLoad::default(),
            received: 0.0,
            driven_for: 0.0,
            kick: 0.0,
            moved_for: 0.0,
        }));
        self.paths.extend(tools.iter().cloned());
    }

    /// The place of a tool of the step among the dynamic ones.
    #[inline]
    pub fn place(&self, index: usize) -> Option<usize> {
        self.copies.iter().position(|copy| copy.tool.index == index)
    }

    /// The energy that contact gave a tool, J; `None`: it is led.
    pub fn received(&self, index: usize) -> Option<f64> {
        Some(self.copies[self.place(index)?].received)
    }

    /// Where a tool is when the step has ended.
    pub fn end(&self, index: usize, dt: f32) -> Option<RigidState> {
        let mut copy = self.copies[self.place(index)?];
        copy.fly_to(1.0, f64::from(dt));
        // The half kick that closes a step may have been left to the next.
        copy.kick = f64::from(dt) - copy.driven_for;
        copy.kick();
        Some(copy.tool.motion)
    }

    /// Has the ways lead on from where the tools are as a slice begins that lasts from `start` to `end`, fractions of the step, as fast as
    /// they would be without contact: their drive acts for as long as the forces on nodes, the half of the slice, all of it, or where nodes do not
    /// drift what is left of the step.
    pub fn look_ahead(
        &mut self,
        paths: &mut [ToolPath],
        [start, end]: [f64; 2],
        dt: f32,
        (drifts, half): (bool, bool),
    ) {
        let step = f64::from(dt);
        for copy in &mut self.copies {
            copy.fly_to(start, step);
            copy.moved_for = if drifts { (end - start) * step } else { 0.0 };
            copy.kick = match (drifts, half) {
                (false, _) => step - copy.driven_for,
                (true, true) => 0.5 * copy.moved_for,
                (true, false) => copy.moved_for,
            };
            let mut ahead = *copy;
            ahead.kick();
            ahead.show(&mut paths[copy.tool.index], [start, end], step);
        }
    }

    /// Shows the solver each tool as it answers impulses.
    pub fn show_yielding(&self, mut show: impl FnMut(YieldingTool)) {
        for Copied { tool, .. } in &self.copies {
            let (mass, motion) = (&tool.mass, &tool.motion);
            show(YieldingTool {
                center: (motion.orientation * mass.center).as_vec3a(),
                inverse_mass: (1.0 / mass.mass) as f32,
                inverse_inertia: mass.inverse_inertia_at(motion.orientation).as_mat3().into(),
                velocity: Vec3A::ZERO,
                spin: Vec3A::ZERO,
                out: Vec3A::ZERO,
                outs: 0,
            });
        }
    }

    /// Moves the tools through the slice that they were looked ahead for, with what has been added to their loads, and by so much more, m.
    pub fn arrive(&mut self, loads: &[ToolLoad], end: f64, yielding: &[YieldingTool]) {
        for (copy, yielding) in self.copies.iter_mut().zip(yielding) {
            copy.kick();
            copy.take(loads);
            let DynamicTool { mass, motion, .. } = &mut copy.tool;
            motion.drift(mass, copy.moved_for);
            motion.center += yielding.way_out();
            copy.gone = end;
        }
    }

    /// The same for what they have taken since, on a way that they have gone.
    pub fn amend(&mut self, loads: &[ToolLoad]) {
        for copy in &mut self.copies {
            let before = copy.tool.motion;
            copy.take(loads);
            let motion = &mut copy.tool.motion;
            motion.center += (motion.velocity - before.velocity) * copy.moved_for;
            let spin = motion.spin(&copy.tool.mass) - before.spin(&copy.tool.mass);
            motion.orientation = turned(motion.orientation, spin * copy.moved_for);
        }
    }
}

impl Copied {
    /// Gives it what its drive gives it in a slice.
    fn kick(&mut self) {
        let (acceleration, torque) = self.tool.drive;
        self.tool.motion.velocity += acceleration * self.kick;
        self.tool.motion.angular_momentum += torque * self.kick;
        self.driven_for += self.kick;
    }

    fn fly_to(&mut self, part: f64, step: f64) {
        if part > self.gone {
            let duration = (part - self.gone) * step;
            self.tool.motion.fly(&self.tool.mass, self.tool.drive, duration);
            self.driven_for += duration;
            self.gone = part;
        }
    }

    fn take(&mut self, loads: &[ToolLoad]) {
        let load = loads[self.tool.index];
        let DynamicTool { mass, motion, .. } = &mut self.tool;
        let new = load.since(&self.taken);
        if new.impulse == DVec3::ZERO && new.angular_impulse == DVec3::ZERO {
            return;
        }
        let before = motion.kinetic_energy(mass);
        motion.take(mass, &new);
        self.received += motion.kinetic_energy(mass) - before;
        self.taken = load;
    }

    /// Makes a way one that leads on from here as the tool moves now.
    fn show(&self, path: &mut ToolPath, [start, end]: [f64; 2], step: f64) {
        let DynamicTool {
            mass, motion, drive, ..
        } = &self.tool;
        // With the last half kick of a step it has come to its end: the way is the one behind it.
        let (begun, duration) = if start < 1.0 {
            (start, (end - start).max(f64::MIN_POSITIVE) * step)
        } else {
            (0.0, -step)
        };
        let spin = motion.mean_spin(mass, duration);
        let mut next = *motion;
        next.center += motion.velocity * duration;
        next.orientation = turned(motion.orientation, spin * duration);
        let velocity = (next.position(mass) - motion.position(mass)) / duration;
        let left = (1.0 - begun) * step;
        let mut from = *motion;
        if start >= 1.0 {
            from.center -= motion.velocity * left;
            from.orientation = turned(motion.orientation, -spin * left);
        }
        let first = from.position(mass);
        let pose = Pose {
            position: first.as_vec3(),
            orientation: from.orientation.as_quat(),
        };
        let last = Pose {
            position: (first + velocity * left).as_vec3(),
            orientation: turned(from.orientation, spin * left).as_quat(),
        };
        // It may be faster by so much when the step ends.
        let strays = drive.0.length() * left * left;
        path.lead([pose, last], (spin * left).as_vec3(), begun, strays as f32);
    }
}
