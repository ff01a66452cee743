//! Groups of bodies that fell asleep together. They support each other, so all of them wake together.

use crate::base::{Result, memory};
use crate::codec::saved;

/// Marks a body that is in no group.
const NO_GROUP: u32 = u32::MAX;

/// Groups of sleeping bodies.
#[derive(Debug, Default)]
pub(crate) struct SleepGroups {
    /// Group of each body index, named by the index of one of its members.
    group_of_body: Vec<u32>,
    /// True for groups with a member that is awake.
    has_awake_member: Vec<bool>,
}

saved! { SleepGroups { group_of_body, has_awake_member } }

impl SleepGroups {
    /// Reserves memory for a body index.
    pub(super) fn reserve_body(&mut self, body_index: usize) -> Result<()> {
        while self.group_of_body.len() <= body_index {
            memory::push(&mut self.group_of_body, NO_GROUP)?;
            memory::push(&mut self.has_awake_member, false)?;
        }
        Ok(())
    }

    /// Puts bodies that fall asleep into one group.
    pub fn add_group(&mut self, members: &[u32]) {
        for &member in members {
            if let Some(group) = self.group_of_body.get_mut(member as usize) {
                *group = members[0];
            }
        }
    }

    /// Removes a body that is awake at the end of a step, or destroyed.
    pub fn remove(&mut self, body_index: usize) {
        if let Some(group) = self.group_of_body.get_mut(body_index) {
            *group = NO_GROUP;
        }
    }

    /// Returns the other members of a body's group.
    pub fn others(&self, body_index: usize) -> impl Iterator<Item = usize> + '_ {
        let group = self
            .group_of_body
            .get(body_index)
            .copied()
            .filter(|&group| group != NO_GROUP);
        let others = self.group_of_body.iter().enumerate();
        let others =
            others.filter(move |&(other, group_of_other)| other != body_index && group == Some(*group_of_other));
        others.map(|(other, _)| other)
    }

    /// Finds the groups with a member that is not asleep.
    pub fn find_awake_groups(&mut self, is_asleep: impl Fn(usize) -> bool) {
        self.has_awake_member.fill(false);
        for (body_index, &group) in self.group_of_body.iter().enumerate() {
            if let Some(has_awake_member) = self.has_awake_member.get_mut(group as usize)
                && !is_asleep(body_index)
            {
                *has_awake_member = true;
            }
        }
    }

    /// Returns the members of groups with a member that is awake.
    pub fn members_of_awake_groups(&self) -> impl Iterator<Item = usize> + '_ {
        let members = self.group_of_body.iter().enumerate();
        let awake = members.filter(|&(_, &group)| self.has_awake_member.get(group as usize) == Some(&true));
        awake.map(|(body_index, _)| body_index)
    }
}
