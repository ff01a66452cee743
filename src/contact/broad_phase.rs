//! What of a body is near tools, and in how many slices a substep is taken there.

use super::contacts::Contacts;
use super::meeting::Meeting;
use super::path::ToolPath;
use super::zone::met;
use crate::base::{Count, Stage, Stopwatch};

/// A substep is cut into at most so many slices.
const SLICES: u32 = 512;

/// How far a tool and the body may move against each other in a slice, as a part of the tool's radius.
const SLICE_TRAVEL: f32 = 0.5;

impl Contacts {
    /// Whether no tool can come near within `duration` seconds, where no node is faster than `fastest`, m/s.
    pub fn stay_far(&self, tools: &[ToolPath], dt: f32, duration: f32, fastest: f32) -> bool {
        let travel = duration * (fastest + self.tool_speed(tools, dt));
        self.loads.is_empty() || self.candidates.near().is_empty() && self.candidates.lasts_for(travel)
    }

    /// A substep without tools near has been taken: whether the list of what is near is still good.
    pub fn pass_far(&mut self, tools: &[ToolPath], dt: f32, substep: f32, fastest: f32) -> bool {
        let travel = substep * (fastest + self.tool_speed(tools, dt));
        self.loads.is_empty() || self.candidates.spend(travel)
    }

    /// The speed of the fastest tool that the body meets, m/s.
    fn tool_speed(&self, tools: &[ToolPath], dt: f32) -> f32 {
        met(tools, self.filter).map(|tool| tool.speed(dt)).fold(0.0, f32::max)
    }

    /// Whether no tool was near in the last substep.
    pub fn are_far(&self) -> bool {
        self.loads.is_empty() || self.candidates.near().is_empty()
    }

    /// Whether the list was made for something much faster than these tools are now: what is in it is not near them.
    pub(super) fn are_listed_too_far(&self, tools: &[ToolPath]) -> bool {
        // Speed over one second is the way of the step.
        self.candidates.excess > 2.0 * self.tool_speed(tools, 1.0)
    }

    /// How many slices a substep needs. Only tools whose way comes near the body count: what is far changes nothing.
    pub(super) fn needed_slices(&self, meeting: &Meeting) -> u32 {
        let mut slices = 1.0_f32;
        for tool in met(meeting.tools, self.filter) {
            let Some(sweep) = tool.sweep(meeting.origin) else {
                continue;
            };
            let travel = (tool.speed(meeting.dt) + meeting.fastest) * meeting.substep;
            let wanted = (travel / (sweep.thickness * SLICE_TRAVEL)).ceil();
            if wanted <= slices {
                continue;
            }
            let reached = meeting.bounds().extended(meeting.fastest * meeting.substep);
            if reached.overlaps(&sweep.bounds) {
                let travel = self.closing_speed(meeting, tool) * meeting.substep;
                slices = slices.max((travel / (sweep.thickness * SLICE_TRAVEL)).ceil().min(wanted));
            }
        }
        (slices as u32).clamp(1, SLICES)
    }

    /// Whether a tool goes further in a substep than it may in a slice, whatever the body does.
    pub(super) fn has_fast_tool(&self, meeting: &Meeting) -> bool {
        met(meeting.tools, self.filter).any(|tool| {
            let travel = tool.speed(meeting.dt) * meeting.substep;
            let sweep = tool.sweep(meeting.origin);
            sweep.is_some_and(|sweep| travel > sweep.thickness * SLICE_TRAVEL)
        })
    }

    /// How fast what is near moves against the tool at most, m/s.
    fn closing_speed(&self, meeting: &Meeting, tool: &ToolPath) -> f32 {
        let motion = tool.motion(meeting.start, meeting.end, meeting.dt, meeting.origin);
        let speeds = self
            .candidates
            .corner_nodes()
            .map(|node| (meeting.vector(meeting.velocities, node) - motion.velocity).length());
        // Turning counts by the tool's furthest point: an arc is taken for its chord.
        let turning = (tool.speed(meeting.dt) - motion.velocity.length()).max(0.0);
        speeds.fold(turning, |fastest, speed| fastest.max(speed + turning))
    }

    pub(super) fn find_candidates(&mut self, meeting: &Meeting) {
        let watch = Stopwatch::start(meeting.profile);
        self.gather_candidates(meeting);
        watch.stop(meeting.profile, Stage::BroadPhase);
        if let Some(profile) = meeting.profile {
            profile.count(Count::Candidates, self.candidates.near().len());
        }
    }

    fn gather_candidates(&mut self, meeting: &Meeting) {
        let tools = met(meeting.tools, self.filter);
        let tool_speed = self.tool_speed(meeting.tools, meeting.dt);
        let fastest = meeting.fastest.max(meeting.neighbor_speed.unwrap_or(0.0));
        let travel = meeting.substep * (fastest + tool_speed);
        if self.candidates.spend(travel) || self.candidates.renew(meeting.positions, travel) {
            return;
        }
        let bounds = meeting.bounds();
        // Good for the rest of the step, where that is no more than a part of the body.
        let size = (bounds.max - bounds.min).length();
        let left = ((1.0 - meeting.start) / (meeting.end - meeting.start).max(1e-9)) as f32;
        let usual = 0.05 * size;
        let slack = (left.max(8.0) * travel).min(usual).max(8.0 * travel).max(0.02 * size);
        self.candidates.excess = (travel - usual / 8.0).max(0.0);
        self.candidates.gather(
            &self.features,
            (meeting.positions, meeting.bindings),
            tools,
            meeting.origin,
            [meeting.substep * tool_speed + meeting.slack + meeting.thickness, slack],
        );
        self.candidates.spend(travel);
    }
}
