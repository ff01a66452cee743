//! Error bounds of tool forces after an unconverged equation.

use glam::DVec3;

use super::contacts::Contacts;
use super::path::ToolPath;

impl Contacts {
    /// Updates the error bound of each tool's force, given the squared error of the equation in the norm of its
    /// matrix, J. The nodes at a tool, moved as one, have at most the sum k of their stiffnesses, so the error is at
    /// most `sqrt(k square)` (Cauchy and Schwarz). Unconverged contact multipliers add to it. `stiffness_held`
    /// returns the stiffness of the nodes that the tool at an index of the world holds, N/m.
    pub fn bound_force_errors(
        &mut self,
        tools: &[ToolPath],
        square: f64,
        displacement_of: impl Fn(usize) -> DVec3,
        stiffness_held: impl Fn(usize) -> f64,
    ) {
        for (tool_index, (tool, load)) in tools.iter().zip(&mut self.loads).enumerate() {
            let of_tool = |&(index, _): &(usize, _)| self.constraints[index].tool == tool_index;
            let (mut stiffness, mut missing) = (stiffness_held(tool.slot), 0.0);
            for (index, contact) in self.multipliers.active().filter(of_tool) {
                stiffness += contact.resistance(self.constraints[index].relaxation);
                missing += contact.multiplier_error(&displacement_of).abs();
            }
            load.force_error = load.force_error.max((stiffness * square).sqrt() + missing);
        }
    }

    /// Counts impulses given after the equation of a long substep (s) as an error of the tool forces, since tissue
    /// did not react to them.
    pub fn add_errors_beyond_equation(&mut self, substep: f64) {
        let mut loads = std::mem::take(&mut self.loads);
        for (tool, beyond, _) in self.excess_impulses(substep) {
            loads[tool].force_error += beyond / substep;
        }
        self.loads = loads;
    }

    /// Discards the contacts of a failed equation. Their whole force counts as an error of the tool forces.
    pub fn discard_equation_contacts(&mut self) {
        for (index, _) in self.multipliers.active() {
            self.loads[self.constraints[index].tool].force_error += self.multipliers.force(index).length();
        }
        self.multipliers.clear();
    }
}
