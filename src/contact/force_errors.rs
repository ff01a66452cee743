//! By how much the forces on tools may be off where an equation is not solved.

use glam::DVec3;

use super::contacts::Contacts;
use super::path::ToolPath;

impl Contacts {
    /// Takes up by how much an equation has the force on each tool off, at most, where it is off by this in the squared norm of its matrix, J. The
    /// nodes at a tool, moved as one, are held by no more than the sum k of their stiffnesses, so that the force is off by at most `sqrt(k square)`
    /// (Cauchy and Schwarz); beside that contacts may lack some of their multipliers. The stiffness of nodes that a tool holds, N/m, is that of its place in the world.
    pub fn bound_force_errors(
        &mut self,
        tools: &[ToolPath],
        square: f64,
        push_of: impl Fn(usize) -> DVec3,
        stiffness_held: impl Fn(usize) -> f64,
    ) {
        for (place, (tool, load)) in tools.iter().zip(&mut self.loads).enumerate() {
            let of_tool = |&(index, _): &(usize, _)| self.constraints[index].tool == place;
            let (mut stiffness, mut missing) = (stiffness_held(tool.slot), 0.0);
            for (index, hold) in self.holds.pressing().filter(of_tool) {
                stiffness += hold.resistance(self.constraints[index].firmness);
                missing += hold.missing(&push_of).abs();
            }
            load.force_error = load.force_error.max((stiffness * square).sqrt() + missing);
        }
    }

    /// Takes up as an error of the forces on tools what contacts gave after the equation of a long substep of so many seconds: tissue did not know of it.
    pub fn take_beyond_holds(&mut self, substep: f64) {
        let mut loads = std::mem::take(&mut self.loads);
        for (tool, beyond, _) in self.given_beyond(substep) {
            loads[tool].force_error += beyond / substep;
        }
        self.loads = loads;
    }

    /// Forgets the contacts of an equation that leads nowhere: what it had tools feel may be all wrong.
    pub fn forget_holds(&mut self) {
        for (index, _) in self.holds.pressing() {
            self.loads[self.constraints[index].tool].force_error += self.holds.force(index).length();
        }
        self.holds.clear();
    }
}
