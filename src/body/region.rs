//! Regions of a body made stiffer or softer, larger or smaller, between steps.

use super::Body;
use crate::base::{Error, Result, above_zero, memory, not_negative};
use crate::soa::{Region, Scale};
use crate::solver::Changed;
use crate::springs::{Link, SpringChange};

impl Body {
    /// Makes what lies between `nodes` alone `stiffness` times as stiff and `length` times as long at rest, as cautery stiffens and
    /// shrinks, and as tissue swells: springs of two of them, tetrahedra that are elements with all corners among them, and of the body's
    /// other terms bending and fibres alike. Home springs become stiffer, and draw where they did. What reaches beyond the region stays
    /// as it is, and so do masses, damping, positions and velocities: the body moves to its new shape by itself.
    ///
    /// `stiffness` is at least 0, `length` above 0. Factors multiply those of calls before; a stiffness of 0 is for good, and takes
    /// tetrahedra away. Nodes may be named more than once. It takes as long as the region is large, with some thousands of tetrahedra
    /// about it.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a factor is out of its range, or something would become so stiff, long or small
    /// that it is no number. [`Error::OutOfMemory`].
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
        let region = Region::of(own);
        let scale = Scale { stiffness, length };
        let changes = self.springs_in(&region, scale)?;
        self.system.forces.check_scale(&region, scale)?;
        self.change_springs(&changes)?;
        if self.system.forces.scale(&region, scale) > 0 {
            self.system.changed(Changed::Stiffness);
            self.system.forces.measure_anew(self.system.state.positions());
        }
        Ok(())
    }

    /// How the springs within a region are to change.
    fn springs_in(&self, region: &Region, scale: Scale) -> Result<Vec<SpringChange>> {
        let mut changes = Vec::new();
        let mut result = Ok(());
        for &node in region.nodes() {
            self.system.forces.springs.visit(node as usize, &mut |before| {
                if before.neighbour < node || !region.has(before.neighbour) || result.is_err() {
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
                    let [a, b] = [node, before.neighbour].map(|node| self.system.order.caller(node));
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
