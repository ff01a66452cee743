//! Lists of objects with generational ids: the id of a destroyed object is detected even after its slot is reused.

use crate::base::{Error, Result, SlotId, WorldTag};
use crate::codec::{Reader, Saved, Writer, saved};

/// A list of objects with generational ids. Slots of removed objects are reused.
#[derive(Debug)]
pub(crate) struct Slots<T> {
    slots: Vec<Slot<T>>,
    /// No slot before this one is free.
    first_free: usize,
    /// The number of objects.
    count: usize,
    /// The name of the objects, for error messages.
    noun: &'static str,
    /// The tag of all ids of this list.
    tag: WorldTag,
}

#[derive(Debug)]
pub(crate) struct Slot<T> {
    /// The generation of the slot, with the tag of the world above it.
    generation: u32,
    content: Option<T>,
}

saved! { [T: Saved] Slot<T> { generation, content } }

impl<T: Saved> Slots<T> {
    /// Writes all slots.
    pub fn save(&self, to: &mut Writer) {
        let Self {
            slots,
            first_free: _,
            count: _,
            noun: _,
            tag: _,
        } = self;
        slots.save(to);
    }

    /// Reads all slots.
    pub fn load(noun: &'static str, tag: WorldTag, from: &mut Reader) -> Result<Self> {
        let slots: Vec<Slot<T>> = Saved::load(from)?;
        let had_nothing = |slot: &Slot<T>| slot.had_nothing() || WorldTag::of(slot.generation) != Some(tag);
        if slots.len() >= u32::MAX as usize || slots.iter().any(had_nothing) {
            return Err(from.refusal("a slot that nothing ever had"));
        }
        Ok(Self {
            first_free: slots.iter().position(is_usable).unwrap_or(slots.len()),
            count: slots.iter().filter(|slot| slot.content.is_some()).count(),
            slots,
            noun,
            tag,
        })
    }
}

/// True if the slot is free and its generation can still grow.
fn is_usable<T>(slot: &Slot<T>) -> bool {
    slot.content.is_none() && slot.generation & WorldTag::COUNT < WorldTag::COUNT
}

impl<T> Slot<T> {
    /// True if no id of this slot was ever returned.
    fn had_nothing(&self) -> bool {
        self.generation & WorldTag::COUNT == 0
    }

    /// The object in this slot.
    pub fn content_mut(&mut self) -> Option<&mut T> {
        self.content.as_mut()
    }
}

impl<T> Slots<T> {
    pub fn new(noun: &'static str, tag: WorldTag) -> Self {
        Self {
            slots: Vec::new(),
            first_free: 0,
            count: 0,
            noun,
            tag,
        }
    }

    /// The number of slots, including free ones.
    pub fn slot_count(&self) -> usize {
        self.slots.len()
    }

    /// The number of objects.
    pub fn count(&self) -> usize {
        self.count
    }

    pub fn insert(&mut self, content: T) -> Result<SlotId> {
        let index = match self.slots[self.first_free..].iter().position(is_usable) {
            Some(beyond) => self.first_free + beyond,
            None => {
                self.slots.try_reserve(1)?;
                self.slots.push(Slot {
                    generation: self.tag.generation(),
                    content: None,
                });
                self.slots.len() - 1
            }
        };
        let slot = &mut self.slots[index];
        slot.generation += 1;
        slot.content = Some(content);
        self.first_free = index + 1;
        self.count += 1;
        Ok(SlotId {
            index1: index as u32 + 1,
            generation: slot.generation,
        })
    }

    pub fn remove(&mut self, id: SlotId) -> Result<T> {
        let index = self.index(id)?;
        let content = self.slots[index]
            .content
            .take()
            .ok_or_else(|| refused(self.noun, self.tag, id))?;
        self.first_free = self.first_free.min(index);
        self.count -= 1;
        Ok(content)
    }

    /// Removes an object whose id nobody has seen, so that the id can be used again.
    pub fn undo_insert(&mut self, id: SlotId) -> Result<T> {
        let content = self.remove(id)?;
        let index = id.index();
        self.slots[index].generation -= 1;
        // Trailing slots that were never used are dropped.
        while self.slots.last().is_some_and(Slot::had_nothing) {
            self.slots.pop();
        }
        self.first_free = self.first_free.min(self.slots.len());
        Ok(content)
    }

    pub fn get(&self, id: SlotId) -> Result<&T> {
        let index = self.index(id)?;
        self.slots[index]
            .content
            .as_ref()
            .ok_or_else(|| refused(self.noun, self.tag, id))
    }

    pub fn get_mut(&mut self, id: SlotId) -> Result<&mut T> {
        let index = self.index(id)?;
        let Slots { slots, noun, tag, .. } = self;
        slots[index].content.as_mut().ok_or_else(|| refused(noun, *tag, id))
    }

    /// The object in a slot.
    pub fn at(&self, slot: usize) -> Option<&T> {
        self.slots.get(slot)?.content.as_ref()
    }

    /// The id of the object in a slot.
    pub fn id_at(&self, slot: usize) -> Option<SlotId> {
        let entry = self.slots.get(slot)?;
        entry.content.as_ref()?;
        Some(SlotId {
            index1: slot as u32 + 1,
            generation: entry.generation,
        })
    }

    /// The object in a slot.
    pub fn at_mut(&mut self, slot: usize) -> Option<&mut T> {
        self.slots.get_mut(slot)?.content.as_mut()
    }

    /// Removes the objects for which `stays` is false.
    pub fn retain(&mut self, stays: impl Fn(&T) -> bool) {
        for (index, slot) in self.slots.iter_mut().enumerate() {
            if slot.content.as_ref().is_some_and(|content| !stays(content)) {
                slot.content = None;
                self.first_free = self.first_free.min(index);
                self.count -= 1;
            }
        }
    }

    /// All objects, with their slots.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &T)> {
        self.slots
            .iter()
            .enumerate()
            .filter_map(|(index, slot)| slot.content.as_ref().map(|content| (index, content)))
    }

    /// All objects, with their ids.
    pub fn iter_ids(&self) -> impl Iterator<Item = (SlotId, &T)> {
        (1..).zip(&self.slots).filter_map(|(index1, slot)| {
            let generation = slot.generation;
            slot.content
                .as_ref()
                .map(|content| (SlotId { index1, generation }, content))
        })
    }

    /// All objects, with their slots.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (usize, &mut T)> {
        self.slots
            .iter_mut()
            .enumerate()
            .filter_map(|(index, slot)| slot.content.as_mut().map(|content| (index, content)))
    }

    /// All slots, including free ones.
    pub fn slots_mut(&mut self) -> &mut [Slot<T>] {
        &mut self.slots
    }

    /// The slot of an object.
    pub fn slot(&self, id: SlotId) -> Result<usize> {
        self.index(id)
    }

    fn index(&self, id: SlotId) -> Result<usize> {
        let index = (id.index1 as usize).wrapping_sub(1);
        match self.slots.get(index) {
            Some(slot) if slot.generation == id.generation && slot.content.is_some() => Ok(index),
            _ => Err(refused(self.noun, self.tag, id)),
        }
    }
}

/// The error for an id that names no object of a world.
fn refused(noun: &str, world: WorldTag, id: SlotId) -> Error {
    match WorldTag::of(id.generation) {
        Some(tag) if tag != world => Error::invalid(format!("{noun} is {id}: the id belongs to another world")),
        _ => Error::StaleId(format!("{noun} {id} does not exist, or no longer")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_left_alone_before_its_count_would_reach_the_tag_of_the_next_world() {
        let tag = WorldTag::next();
        let mut slots = Slots::new("number", tag);
        let mut last = SlotId::default();
        for _ in 0..WorldTag::COUNT {
            last = slots.insert(7).expect("a slot");
            assert_eq!((last.index1, WorldTag::of(last.generation)), (1, Some(tag)));
            slots.remove(last).expect("a number");
        }
        assert_eq!(slots.insert(8).map(|id| id.index1), Ok(2));
        assert!(matches!(slots.get(last), Err(Error::StaleId(_))));
    }
}
