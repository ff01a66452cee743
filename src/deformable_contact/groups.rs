//! Bodies that fell asleep together: each is held up by others, so none sleeps on where one of them wakes.

use crate::base::{Result, memory};
use crate::codec::saved;

/// In no group.
const NONE: u32 = u32::MAX;

/// The groups of sleeping bodies, by a body's place in the world.
#[derive(Debug, Default)]
pub(crate) struct Groups {
    /// The group of each body: the place of one of its members.
    groups: Vec<u32>,
    /// Which groups have a member that is awake.
    is_awake: Vec<bool>,
}

saved! { Groups { groups, is_awake } }

impl Groups {
    /// Makes room for the body at this place.
    pub(super) fn make_place(&mut self, place: usize) -> Result<()> {
        while self.groups.len() <= place {
            memory::push(&mut self.groups, NONE)?;
            memory::push(&mut self.is_awake, false)?;
        }
        Ok(())
    }

    /// These bodies fall asleep.
    pub fn lie_down(&mut self, members: &[u32]) {
        for &member in members {
            if let Some(group) = self.groups.get_mut(member as usize) {
                *group = members[0];
            }
        }
    }

    /// The body at this place is awake as a step ends, or gone.
    pub fn leave(&mut self, place: usize) {
        if let Some(group) = self.groups.get_mut(place) {
            *group = NONE;
        }
    }

    /// The other members of the group of the body at this place.
    pub fn others(&self, place: usize) -> impl Iterator<Item = usize> + '_ {
        let group = self.groups.get(place).copied().filter(|&group| group != NONE);
        let others = self.groups.iter().enumerate();
        let others = others.filter(move |&(other, of)| other != place && group == Some(*of));
        others.map(|(other, _)| other)
    }

    /// Finds the groups of which one is not asleep, as this tells.
    pub fn find_woken(&mut self, is_asleep: impl Fn(usize) -> bool) {
        self.is_awake.fill(false);
        for (place, &group) in self.groups.iter().enumerate() {
            if let Some(is_awake) = self.is_awake.get_mut(group as usize)
                && !is_asleep(place)
            {
                *is_awake = true;
            }
        }
    }

    /// The members of these groups.
    pub fn woken(&self) -> impl Iterator<Item = usize> + '_ {
        let members = self.groups.iter().enumerate();
        let woken = members.filter(|&(_, &group)| self.is_awake.get(group as usize) == Some(&true));
        woken.map(|(place, _)| place)
    }
}
