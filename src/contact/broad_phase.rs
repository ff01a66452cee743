//! Broad phase of one body: the features near tools, and the number of slices of a substep.

use super::contact_input::ContactInput;
use super::contacts::Contacts;
use super::path::ToolPath;
use super::zone::filtered_tools;
use crate::base::{Count, Stage, Stopwatch};

/// Maximum number of slices of a substep.
const MAX_SLICES: u32 = 512;

/// Maximum relative motion of tool and body in a slice, as a fraction of the tool's radius.
const MAX_SLICE_TRAVEL: f32 = 0.5;

impl Contacts {
    /// True if no tool can come near within `duration` seconds while no node is faster than `fastest`, m/s.
    pub fn remains_clear_of_tools(&self, tools: &[ToolPath], dt: f32, duration: f32, fastest: f32) -> bool {
        let travel = duration * (fastest + self.tool_speed(tools, dt));
        self.loads.is_empty() || self.candidates.near().is_empty() && self.candidates.has_slack_for(travel)
    }

    /// Accounts for a substep taken without tools near. Returns true if the candidate list is still valid.
    pub fn advance_clear_of_tools(&mut self, tools: &[ToolPath], dt: f32, substep: f32, fastest: f32) -> bool {
        let travel = substep * (fastest + self.tool_speed(tools, dt));
        self.loads.is_empty() || self.candidates.spend_slack(travel)
    }

    /// Speed of the fastest tool that the body collides with, m/s.
    fn tool_speed(&self, tools: &[ToolPath], dt: f32) -> f32 {
        filtered_tools(tools, self.filter)
            .map(|tool| tool.speed(dt))
            .fold(0.0, f32::max)
    }

    /// True if no tool was near in the last substep.
    pub fn is_clear_of_tools(&self) -> bool {
        self.loads.is_empty() || self.candidates.near().is_empty()
    }

    /// True if the list was built for much faster tools than these, so that its features are not near them.
    pub(super) fn has_oversized_list(&self, tools: &[ToolPath]) -> bool {
        // For a step of one second, the speed equals the length of the path.
        self.candidates.excess_travel > 2.0 * self.tool_speed(tools, 1.0)
    }

    /// The number of slices that a substep needs. Only tools whose path comes near the body count.
    pub(super) fn needed_slices(&self, input: &ContactInput) -> u32 {
        let mut slices = 1.0_f32;
        for tool in filtered_tools(input.tools, self.filter) {
            let Some(sweep) = tool.sweep(input.origin) else {
                continue;
            };
            let travel = (tool.speed(input.dt) + input.fastest) * input.substep;
            let upper_bound = (travel / (sweep.thickness * MAX_SLICE_TRAVEL)).ceil();
            if upper_bound <= slices {
                continue;
            }
            let reachable = input.bounds().extended(input.fastest * input.substep);
            if reachable.overlaps(&sweep.bounds) {
                let travel = self.closing_speed(input, tool) * input.substep;
                slices = slices.max((travel / (sweep.thickness * MAX_SLICE_TRAVEL)).ceil().min(upper_bound));
            }
        }
        (slices as u32).clamp(1, MAX_SLICES)
    }

    /// True if a tool alone moves further in a substep than a slice allows.
    pub(super) fn has_fast_tool(&self, input: &ContactInput) -> bool {
        filtered_tools(input.tools, self.filter).any(|tool| {
            let travel = tool.speed(input.dt) * input.substep;
            let sweep = tool.sweep(input.origin);
            sweep.is_some_and(|sweep| travel > sweep.thickness * MAX_SLICE_TRAVEL)
        })
    }

    /// Maximum speed of the listed nodes relative to the tool, m/s.
    fn closing_speed(&self, input: &ContactInput, tool: &ToolPath) -> f32 {
        let motion = tool.motion(input.start, input.end, input.dt, input.origin);
        let speeds = self
            .candidates
            .corner_nodes()
            .map(|node| (input.vector(input.velocities, node) - motion.velocity).length());
        // Rotation counts at the tool's furthest point: an arc is approximated by its chord.
        let rotation_speed = (tool.speed(input.dt) - motion.velocity.length()).max(0.0);
        speeds.fold(rotation_speed, |fastest, speed| fastest.max(speed + rotation_speed))
    }

    pub(super) fn find_candidates(&mut self, input: &ContactInput) {
        let watch = Stopwatch::start(input.profile);
        self.gather_candidates(input);
        watch.stop(input.profile, Stage::BroadPhase);
        if let Some(profile) = input.profile {
            profile.count(Count::Candidates, self.candidates.near().len());
        }
    }

    fn gather_candidates(&mut self, input: &ContactInput) {
        let tools = filtered_tools(input.tools, self.filter);
        let tool_speed = self.tool_speed(input.tools, input.dt);
        let fastest = input.fastest.max(input.neighbor_speed.unwrap_or(0.0));
        let travel = input.substep * (fastest + tool_speed);
        if self.candidates.spend_slack(travel) || self.candidates.extend_validity(input.positions, travel) {
            return;
        }
        let bounds = input.bounds();
        // The list lasts for the rest of the step if that takes only a fraction of the body's size.
        let size = (bounds.max - bounds.min).length();
        let substeps_left = ((1.0 - input.start) / (input.end - input.start).max(1e-9)) as f32;
        let usual_slack = 0.05 * size;
        let slack = (substeps_left.max(8.0) * travel)
            .min(usual_slack)
            .max(8.0 * travel)
            .max(0.02 * size);
        self.candidates.excess_travel = (travel - usual_slack / 8.0).max(0.0);
        self.candidates.gather(
            &self.features,
            (input.positions, input.bindings),
            tools,
            input.origin,
            [input.substep * tool_speed + input.slack + input.thickness, slack],
        );
        self.candidates.spend_slack(travel);
    }
}
