//! Scaling of the stiffness and size of regions of a body between steps.

use super::Body;
use crate::base::{Error, Result, above_zero, memory, not_negative};
use crate::soa::{Region, Scale};
use crate::solver::Changed;
use crate::springs::{Link, SpringChange};

impl Body {
    /// Scales the stiffness and the rest lengths within a region, for example to model cautery or swelling. The region
    /// contains springs between two of `nodes`, and the elements, bending and fibers whose nodes are all in it. Anchor
    /// springs become stiffer, and keep their anchors. Everything that extends beyond the region stays, and so do
    /// masses, damping, positions and velocities. The body moves to its new shape in the next steps.
    ///
    /// `stiffness` is at least 0, `length` above 0. Factors multiply those of earlier calls. A stiffness of 0 is
    /// permanent, and removes tetrahedra. `nodes` can contain a node more than once. The cost is proportional to the
    /// region plus some thousands of tetrahedra around it.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a factor is out of its range, or a stiffness or length would
    /// not be finite. [`Error::OutOfMemory`].
    pub fn scale_region(&mut self, nodes: &[u32], stiffness: f32, length: f32) -> Result<()> {
        not_negative("stiffness_factor", stiffness)?;
        above_zero("length_factor", length)?;
        let own = memory::try_collected(nodes.iter().enumerate().map(|(index, &node)| {
            self.check_node(&format_args!("nodes[{index}]"), node)?;
            Ok(self.system.order.own(node))
        }))?;
        if stiffness == 1.0 && length == 1.0 {
            return Ok(());
        }
        let region = Region::from_nodes(own);
        let scale = Scale { stiffness, length };
        let changes = self.springs_in(&region, scale)?;
        self.system.forces.check_scale(&region, scale)?;
        self.change_springs(&changes)?;
        if self.system.forces.scale(&region, scale) > 0 {
            self.system.changed(Changed::Stiffness);
            self.system
                .forces
                .recompute_elastic_state(self.system.state.positions());
        }
        Ok(())
    }

    /// The changes of the springs within a region.
    fn springs_in(&self, region: &Region, scale: Scale) -> Result<Vec<SpringChange>> {
        let mut changes = Vec::new();
        let mut result = Ok(());
        for &node in region.nodes() {
            self.system.forces.springs.visit(node as usize, &mut |before| {
                if before.neighbor < node || !region.has(before.neighbor) || result.is_err() {
                    return;
                }
                let after = Link {
                    stiffness: before.stiffness * scale.stiffness,
                    rest_length: before.rest_length * scale.length,
                    ..before
                };
                if after.stiffness.is_finite() && after.rest_length.is_finite() {
                    result = memory::push(&mut changes, SpringChange { node, before, after });
                } else {
                    let [a, b] = [node, before.neighbor].map(|node| self.system.order.caller(node));
                    result = Err(Error::invalid(format!(
                        "the spring of nodes {a} and {b} would have a stiffness of {} N/m and a rest length of {} m",
                        after.stiffness, after.rest_length
                    )));
                }
            });
        }
        result.map(|()| changes)
    }
}
