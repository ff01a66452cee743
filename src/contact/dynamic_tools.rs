//! Dynamic tools during one body's step.
//!
//! A dynamic tool is one more unknown of the contact solver. In each substep its velocity is updated in the same
//! sweeps as the velocities of the nodes, so that neither light nor heavy tools overshoot. Bodies are stepped
//! independently, each with its own substeps. Each body therefore moves a copy of the tool, whose mass is divided
//! among the bodies in contact with it. At the end of the step the copies are merged (mass splitting: Tonge,
//! Benevolenski, Voroshilov 2012). Momentum is conserved exactly, and energy does not grow.

use glam::{DVec3, Mat3A, Vec3, Vec3A};

use super::contacts::ToolLoad;
use super::path::ToolPath;
use super::rigid::{Rigid, RigidMass, RigidState};
use super::tool::Pose;
use crate::base::{Result, memory};
use crate::geometry::rotation::{rotated, rotation_between};

/// A dynamic tool at the start of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DynamicTool {
    /// Index among the tools of the step.
    pub index: usize,
    /// Mass, divided among the bodies in contact with the tool.
    pub mass: RigidMass,
    pub motion: RigidState,
    /// Acceleration (m/s²) and torque (N m) without contact, divided like the mass.
    pub drive: (DVec3, DVec3),
    /// Number of bodies that the mass is divided among.
    pub share_count: u32,
}

/// A body's copy of a dynamic tool during a step.
#[derive(Clone, Copy, Debug)]
struct ToolCopy {
    tool: DynamicTool,
    /// Fraction of the step completed.
    completed: f64,
    /// Load that has already been applied.
    applied: ToolLoad,
    /// Energy received from contact, J.
    received: f64,
    /// Time for which the drive has acted, s, and for which it acts in the current slice.
    driven_for: f64,
    kick: f64,
    /// Duration of the motion in the last slice, s.
    moved_for: f64,
}

/// The dynamic tools of a step, as contact with one body moves them. Empty without dynamic tools.
#[derive(Debug, Default)]
pub(super) struct DynamicTools {
    copies: Vec<ToolCopy>,
    /// Paths of all tools. Those of dynamic tools continue from their current state.
    pub paths: Vec<ToolPath>,
}

/// A dynamic tool in the contact solver: its response to impulses and its change of velocity.
#[derive(Clone, Copy, Debug)]
pub(super) struct SolverTool {
    /// From the tool's position to its center of mass, m.
    pub center: Vec3A,
    /// 1/kg
    pub inverse_mass: f32,
    /// Inverse inertia in world axes, 1/(kg m²).
    pub inverse_inertia: Mat3A,
    /// Change of velocity, m/s.
    pub velocity: Vec3A,
    /// Change of angular velocity, rad/s.
    pub spin: Vec3A,
    /// Sum of the displacements out of tissue, m, and the number of contacts that contributed.
    pub push_out_sum: Vec3A,
    pub push_out_count: u32,
}

impl DynamicTool {
    /// Creates a tool with this index among the tools of the step, divided among `shares` bodies.
    pub fn new(index: usize, rigid: &Rigid, gravity: Vec3, share_count: u32) -> Self {
        let fraction = 1.0 / f64::from(share_count);
        let (acceleration, torque) = rigid.drive(gravity);
        Self {
            index,
            mass: rigid.mass.scaled(fraction),
            motion: RigidState {
                angular_momentum: rigid.motion.angular_momentum * fraction,
                ..rigid.motion
            },
            drive: (acceleration, torque * fraction),
            share_count,
        }
    }

    /// Returns the state after a step without contact.
    fn free_flight(&self, dt: f32) -> RigidState {
        let mut motion = self.motion;
        motion.fly(&self.mass, self.drive, f64::from(dt));
        motion
    }

    /// Sets a path to that of free flight.
    pub fn set_free_flight(&self, path: &mut ToolPath, dt: f32) {
        let end = self.free_flight(dt);
        let turn = rotation_between(self.motion.orientation, end.orientation).as_vec3();
        let max_deviation = self.drive.0.length() * f64::from(dt) * f64::from(dt);
        let poses = [self.motion.pose(&self.mass), end.pose(&self.mass)];
        path.set(poses, turn, 0.0, max_deviation as f32);
    }

    /// Merges the copies of the bodies in contact. The change of momentum is the sum over the copies. The pose is the
    /// mean over all shares; the shares without a copy flew freely.
    pub fn merge_copies(&self, dt: f32, ends: impl Iterator<Item = RigidState>) -> RigidState {
        let free_end = self.free_flight(dt);
        let fraction = 1.0 / f64::from(self.share_count);
        let mut merged = RigidState {
            angular_momentum: free_end.angular_momentum / fraction,
            ..free_end
        };
        let mut turn = DVec3::ZERO;
        for end in ends {
            merged.center += (end.center - free_end.center) * fraction;
            merged.velocity += (end.velocity - free_end.velocity) * fraction;
            merged.angular_momentum += end.angular_momentum - free_end.angular_momentum;
            turn += rotation_between(free_end.orientation, end.orientation) * fraction;
        }
        merged.orientation = rotated(free_end.orientation, turn);
        merged
    }
}

impl SolverTool {
    /// Returns the change of the surface velocity along `direction` per impulse along it, at this arm from the center
    /// of mass, 1/kg.
    pub fn response(&self, arm: Vec3A, direction: Vec3A) -> f32 {
        let moment = arm.cross(direction);
        self.inverse_mass + moment.dot(self.inverse_inertia * moment)
    }

    /// Returns the largest response over all directions, 1/kg.
    pub fn max_response(&self, arm: Vec3A) -> f32 {
        let inertia = &self.inverse_inertia;
        let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
        self.inverse_mass + trace * arm.length_squared()
    }

    /// Returns the change of the surface velocity at this arm, m/s.
    #[inline]
    pub fn velocity_change(&self, arm: Vec3A) -> Vec3A {
        self.velocity + self.spin.cross(arm)
    }

    /// Applies the reaction to an impulse on tissue.
    #[inline]
    pub fn recoil(&mut self, arm: Vec3A, impulse: Vec3A) {
        self.velocity -= impulse * self.inverse_mass;
        self.spin -= self.inverse_inertia * arm.cross(impulse);
    }

    /// Adds a contact that moves the tool out of tissue by this impulse, kg m.
    pub fn push_out(&mut self, impulse: Vec3) {
        self.push_out_sum += Vec3A::from(impulse) * self.inverse_mass;
        self.push_out_count += 1;
    }

    /// Returns the displacement out of tissue, the mean over the contacts, m.
    fn push_out_displacement(&self) -> DVec3 {
        Vec3::from(self.push_out_sum / self.push_out_count.max(1) as f32).as_dvec3()
    }
}

impl DynamicTools {
    /// Reserves memory for `tools` tools, of which `dynamic` are dynamic.
    pub fn reserve(&mut self, tools: usize, dynamic: usize) -> Result<()> {
        memory::reserve(&mut self.copies, dynamic)?;
        memory::reserve(&mut self.paths, if dynamic > 0 { tools } else { 0 })
    }

    /// Reserves memory for the paths of `tools` tools, if any is dynamic.
    pub fn reserve_paths(&mut self, tools: usize) -> Result<()> {
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
        self.copies.extend(dynamic.iter().map(|&tool| ToolCopy {
            tool,
            completed: 0.0,
            applied: ToolLoad::default(),
            received: 0.0,
            driven_for: 0.0,
            kick: 0.0,
            moved_for: 0.0,
        }));
        self.paths.extend(tools.iter().cloned());
    }

    /// Returns the index of a tool of the step among the dynamic ones.
    #[inline]
    pub fn find(&self, index: usize) -> Option<usize> {
        self.copies.iter().position(|copy| copy.tool.index == index)
    }

    /// Returns the energy that contact gave a tool, J; `None` for a kinematic tool.
    pub fn received(&self, index: usize) -> Option<f64> {
        Some(self.copies[self.find(index)?].received)
    }

    /// Returns the state of a tool at the end of the step.
    pub fn end(&self, index: usize, dt: f32) -> Option<RigidState> {
        let mut copy = self.copies[self.find(index)?];
        copy.fly_to(1.0, f64::from(dt));
        // The closing half kick of a step may have been deferred to the next.
        copy.kick = f64::from(dt) - copy.driven_for;
        copy.kick();
        Some(copy.tool.motion)
    }

    /// Extrapolates the paths from the start of a slice between two fractions of the step, without contact. The drive
    /// acts for the same time as forces on nodes: half of the slice, all of it, or for a slice without drift the rest
    /// of the step.
    pub fn extrapolate_paths(
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
            let mut extrapolated = *copy;
            extrapolated.kick();
            extrapolated.set_path(&mut paths[copy.tool.index], [start, end], step);
        }
    }

    /// Visits each tool as the contact solver sees it.
    pub fn visit_solver_tools(&self, mut visit: impl FnMut(SolverTool)) {
        for ToolCopy { tool, .. } in &self.copies {
            let (mass, motion) = (&tool.mass, &tool.motion);
            visit(SolverTool {
                center: (motion.orientation * mass.center).as_vec3a(),
                inverse_mass: (1.0 / mass.mass) as f32,
                inverse_inertia: mass.inverse_inertia_at(motion.orientation).as_mat3().into(),
                velocity: Vec3A::ZERO,
                spin: Vec3A::ZERO,
                push_out_sum: Vec3A::ZERO,
                push_out_count: 0,
            });
        }
    }

    /// Moves the tools through the extrapolated slice with the new loads, and by their displacements out of tissue.
    pub fn advance(&mut self, loads: &[ToolLoad], end: f64, solver_tools: &[SolverTool]) {
        for (copy, solver_tool) in self.copies.iter_mut().zip(solver_tools) {
            copy.kick();
            copy.apply_load(loads);
            let DynamicTool { mass, motion, .. } = &mut copy.tool;
            motion.drift(mass, copy.moved_for);
            motion.center += solver_tool.push_out_displacement();
            copy.completed = end;
        }
    }

    /// Corrects the motion of the last slice for loads added since.
    pub fn correct(&mut self, loads: &[ToolLoad]) {
        for copy in &mut self.copies {
            let before = copy.tool.motion;
            copy.apply_load(loads);
            let motion = &mut copy.tool.motion;
            motion.center += (motion.velocity - before.velocity) * copy.moved_for;
            let spin = motion.spin(&copy.tool.mass) - before.spin(&copy.tool.mass);
            motion.orientation = rotated(motion.orientation, spin * copy.moved_for);
        }
    }
}

impl ToolCopy {
    /// Applies the drive of the slice to the velocities.
    fn kick(&mut self) {
        let (acceleration, torque) = self.tool.drive;
        self.tool.motion.velocity += acceleration * self.kick;
        self.tool.motion.angular_momentum += torque * self.kick;
        self.driven_for += self.kick;
    }

    fn fly_to(&mut self, fraction: f64, step: f64) {
        if fraction > self.completed {
            let duration = (fraction - self.completed) * step;
            self.tool.motion.fly(&self.tool.mass, self.tool.drive, duration);
            self.driven_for += duration;
            self.completed = fraction;
        }
    }

    fn apply_load(&mut self, loads: &[ToolLoad]) {
        let load = loads[self.tool.index];
        let DynamicTool { mass, motion, .. } = &mut self.tool;
        let added = load.since(&self.applied);
        if added.impulse == DVec3::ZERO && added.angular_impulse == DVec3::ZERO {
            return;
        }
        let before = motion.kinetic_energy(mass);
        motion.apply_load(mass, &added);
        self.received += motion.kinetic_energy(mass) - before;
        self.applied = load;
    }

    /// Sets a path that continues from the current state at its velocity.
    fn set_path(&self, path: &mut ToolPath, [start, end]: [f64; 2], step: f64) {
        let DynamicTool {
            mass, motion, drive, ..
        } = &self.tool;
        // After the last half kick of a step the slice is over: the path is the one just completed.
        let (begin, duration) = if start < 1.0 {
            (start, (end - start).max(f64::MIN_POSITIVE) * step)
        } else {
            (0.0, -step)
        };
        let spin = motion.mean_angular_velocity(mass, duration);
        let mut end_state = *motion;
        end_state.center += motion.velocity * duration;
        end_state.orientation = rotated(motion.orientation, spin * duration);
        let velocity = (end_state.position(mass) - motion.position(mass)) / duration;
        let remaining = (1.0 - begin) * step;
        let mut first_state = *motion;
        if start >= 1.0 {
            first_state.center -= motion.velocity * remaining;
            first_state.orientation = rotated(motion.orientation, -spin * remaining);
        }
        let position = first_state.position(mass);
        let start_pose = Pose {
            position: position.as_vec3(),
            orientation: first_state.orientation.as_quat(),
        };
        let end_pose = Pose {
            position: (position + velocity * remaining).as_vec3(),
            orientation: rotated(first_state.orientation, spin * remaining).as_quat(),
        };
        // The tool may gain this much speed until the end of the step.
        let max_deviation = drive.0.length() * remaining * remaining;
        path.set(
            [start_pose, end_pose],
            (spin * remaining).as_vec3(),
            begin,
            max_deviation as f32,
        );
    }
}
