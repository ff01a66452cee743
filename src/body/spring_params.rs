//! Reads and changes stiffnesses and rest lengths of springs between steps.

use super::Body;
use crate::base::{Error, Result, memory};
use crate::def::{Values, check_given};
use crate::solver::{Changed, correct_deferred_kick};
use crate::springs::{Link, SpringChange, not_joined, pull};

/// The parameters of a spring.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// let body = world.body_mut(body)?;
/// body.set_springs(&[[0, 1]], Some(Values::Uniform(40.0)), None)?;
/// assert_eq!(body.springs(&[[0, 1]])?[0], SpringState { stiffness: 40.0, rest_length: 0.025 });
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringState {
    /// Stiffness, N/m
    pub stiffness: f32,
    /// Rest length, m
    pub rest_length: f32,
}

impl Body {
    /// The parameters of the springs of these pairs of nodes.
    ///
    /// PACKED merges rest lengths that come from positions if they are equal after rounding.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a pair has no spring. [`Error::OutOfMemory`].
    pub fn springs(&self, pairs: &[[u32; 2]]) -> Result<Vec<SpringState>> {
        let mut springs = memory::reserved(pairs.len())?;
        for index in 0..pairs.len() {
            let Link {
                stiffness, rest_length, ..
            } = self.link_of_pair(pairs, index)?.1;
            springs.push(SpringState { stiffness, rest_length });
        }
        Ok(springs)
    }

    /// Sets the stiffnesses, N/m, or the rest lengths, m, of springs, or both. `None` leaves them unchanged. Damping
    /// and the stiffening law stay. If a pair occurs more than once, the last entry counts.
    ///
    /// Positions and velocities stay, so the energy changes. The cost is proportional to the number of springs, not to
    /// the body. Only if the springs that limit the stable substep become softer, the whole body is examined.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a pair has no spring, or a number is missing, negative or not finite.
    /// [`Error::OutOfMemory`].
    pub fn set_springs(
        &mut self,
        pairs: &[[u32; 2]],
        stiffnesses: Option<Values>,
        rest_lengths: Option<Values>,
    ) -> Result<()> {
        check_given([("stiffness", stiffnesses), ("rest_length", rest_lengths)], pairs.len())?;
        let mut changes = memory::reserved(pairs.len())?;
        for index in 0..pairs.len() {
            let (node, before) = self.link_of_pair(pairs, index)?;
            let after = Link {
                stiffness: stiffnesses.map_or(before.stiffness, |values| values.get(index)),
                rest_length: rest_lengths.map_or(before.rest_length, |values| values.get(index)),
                ..before
            };
            changes.push((index, SpringChange { node, before, after }));
        }
        // The last entry of each pair first.
        changes.sort_unstable_by_key(|(index, change)| {
            let nodes = (change.node, change.after.neighbor);
            (nodes, std::cmp::Reverse(*index))
        });
        changes.dedup_by_key(|(_, change)| (change.node, change.after.neighbor));
        let unique = memory::collected(changes.into_iter().map(|(_, change)| change))?;
        self.change_springs(&unique)
    }

    /// Changes springs, each once. An error changes nothing.
    pub(super) fn change_springs(&mut self, changes: &[SpringChange]) -> Result<()> {
        let nodes = changes.iter().flat_map(SpringChange::ends).map(|(node, _)| node);
        let mut nodes = memory::collected_within(2 * changes.len(), nodes)?;
        memory::sort_once(&mut nodes);
        if let Some(scaling) = &mut self.system.scaling {
            scaling.reserve(nodes.len())?;
        }
        self.system.forces.set_springs(changes)?;
        if changes.is_empty() {
            return Ok(());
        }
        if let Some(tear_queue) = &mut self.tear_queue {
            tear_queue.update_springs(changes);
        }
        self.system
            .forces
            .recompute_elastic_state(self.system.state.positions());
        self.system.changed(Changed::Stiffness);
        self.correct_half_kick_for_changes(changes);
        self.system.update_added_masses(&nodes);
        let limit = self.system.critical_nodes.limit();
        self.system.update_stability(&nodes);
        if self.system.critical_nodes.limit() > limit {
            // Longer substeps can be stable now.
            self.system.changed(Changed::SpringsSoftened);
        }
        Ok(())
    }

    /// Corrects the deferred half kick, so that velocities stay the same.
    fn correct_half_kick_for_changes(&mut self, changes: &[SpringChange]) {
        if self.system.carry.deferred_kick.is_none() {
            return;
        }
        self.discard_velocities();
        for &SpringChange { node, before, after } in changes {
            let [here, there] = [node, after.neighbor].map(|node| self.system.state.positions().get(node as usize));
            let [before, after_pull] = [before, after].map(|link| pull(node as usize, &link, there - here, None));
            correct_deferred_kick(&mut self.system, node, before - after_pull);
            correct_deferred_kick(&mut self.system, after.neighbor, after_pull - before);
        }
    }

    /// The node of a pair with the lower internal index, and its link to the other node.
    pub(super) fn link_of_pair(&self, pairs: &[[u32; 2]], index: usize) -> Result<(u32, Link)> {
        let [a, b] = pairs[index];
        let refused = |error| Error::invalid(format!("pairs[{index}]: {error}"));
        let [own_a, own_b] = self.check_pair(a, b).map_err(refused)?;
        let nodes = [own_a.min(own_b), own_a.max(own_b)];
        let link = self.link(nodes).ok_or_else(|| refused(not_joined(a, b)))?;
        Ok((nodes[0], link))
    }

    /// The link of the first of two nodes to the second, in internal indices.
    pub(super) fn link(&self, [node, neighbor]: [u32; 2]) -> Option<Link> {
        let mut link_to_neighbor = None;
        self.system.forces.springs.visit(node as usize, &mut |link| {
            if link.neighbor == neighbor {
                link_to_neighbor = Some(link);
            }
        });
        link_to_neighbor
    }
}
