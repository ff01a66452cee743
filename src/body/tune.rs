//! Springs read, and their stiffnesses and rest lengths changed, between steps.

use super::Body;
use crate::base::{Error, Result, memory};
use crate::def::{Values, check_given};
use crate::solver::{Changed, make_up_for};
use crate::springs::{Link, SpringChange, not_joined, pull};

/// A spring as it is.
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
    /// N/m
    pub stiffness: f32,
    /// m
    pub rest_length: f32,
}

impl Body {
    /// What the springs of these pairs of nodes are like.
    ///
    /// PACKED keeps rest lengths that come from positions merged where these are rounded to the same.
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

    /// Gives the springs of these pairs of nodes other stiffnesses, in N/m, or rest lengths, in metres, or both; `None` leaves them.
    /// Their damping stays, and the law by which they stiffen. Of a pair that is named more than once the last counts.
    ///
    /// Positions and velocities stay, so the energy changes by what the springs then hold. It takes as long as the springs are many,
    /// however large the body; only where the springs that set the longest stable substep become softer is the body looked through.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a pair has no spring, or a number is missing, negative or not finite. [`Error::OutOfMemory`].
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
        // The last of each pair first.
        changes.sort_unstable_by_key(|(index, change)| {
            let nodes = (change.node, change.after.neighbour);
            (nodes, std::cmp::Reverse(*index))
        });
        changes.dedup_by_key(|(_, change)| (change.node, change.after.neighbour));
        let once = memory::collected(changes.into_iter().map(|(_, change)| change))?;
        self.change_springs(&once)
    }

    /// Changes springs, each once. Changes nothing where it fails.
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
        if let Some(tears) = &mut self.tears {
            tears.change(changes);
        }
        self.system.forces.measure_anew(self.system.state.positions());
        self.system.changed(Changed::Stiffness);
        self.make_up_for_changes(changes);
        self.system.scale_for_springs(&nodes);
        let limit = self.system.watched.limit();
        self.system.see_stability_of(&nodes);
        if self.system.watched.limit() > limit {
            // Longer substeps may be stable now.
            self.system.changed(Changed::Softer);
        }
        Ok(())
    }

    /// Keeps the velocities at the time of the positions as they are.
    fn make_up_for_changes(&mut self, changes: &[SpringChange]) {
        if self.system.carry.closing.is_none() {
            return;
        }
        self.forget_velocities();
        for &SpringChange { node, before, after } in changes {
            let [here, there] = [node, after.neighbour].map(|node| self.system.state.positions().get(node as usize));
            let [before, after_it] = [before, after].map(|link| pull(node as usize, &link, there - here, None));
            make_up_for(&mut self.system, node, before - after_it);
            make_up_for(&mut self.system, after.neighbour, after_it - before);
        }
    }

    /// The node of a pair with the lower number of the body's own, and what it sees of the pair's spring.
    pub(super) fn link_of_pair(&self, pairs: &[[u32; 2]], index: usize) -> Result<(u32, Link)> {
        let [a, b] = pairs[index];
        let refused = |error| Error::invalid(format!("pairs[{index}]: {error}"));
        let [own_a, own_b] = self.check_pair(a, b).map_err(refused)?;
        let nodes = [own_a.min(own_b), own_a.max(own_b)];
        let link = self.link(nodes).ok_or_else(|| refused(not_joined(a, b)))?;
        Ok((nodes[0], link))
    }

    /// What the first of two nodes sees of their spring, in the body's own numbers.
    pub(super) fn link(&self, [node, neighbour]: [u32; 2]) -> Option<Link> {
        let mut found = None;
        self.system.forces.springs.visit(node as usize, &mut |link| {
            if link.neighbour == neighbour {
                found = Some(link);
            }
        });
        found
    }
}
