//! A singly linked list with individually allocated elements.

use crate::base::{Error, Result, memory};
use crate::codec::{Reader, Saved, Writer, load_count};

/// An element on the heap. It is an array of one, because that allocation can fail without aborting.
type Owned<T> = Box<[ListElement<T>; 1]>;

/// An element of a list.
#[derive(Debug)]
pub(super) struct ListElement<T> {
    pub value: T,
    next: Option<Owned<T>>,
}

/// A singly linked list.
#[derive(Debug)]
pub(super) struct Chain<T> {
    first: Option<Owned<T>>,
}

impl<T> Chain<T> {
    pub const EMPTY: Self = Self { first: None };

    /// Inserts `value` at the front.
    pub fn push(&mut self, value: T) -> Result<()> {
        self.push_element(unlinked(value)?);
        Ok(())
    }

    /// Inserts an unlinked element at the front.
    pub fn push_element(&mut self, Unlinked(mut element): Unlinked<T>) {
        element[0].next = self.first.take();
        self.first = Some(element);
    }

    /// Removes the first value that satisfies `predicate`. Returns true if there was one.
    pub fn remove(&mut self, predicate: impl Fn(&T) -> bool) -> bool {
        let mut cursor = &mut self.first;
        while cursor.as_ref().is_some_and(|element| !predicate(&element[0].value)) {
            cursor = match cursor {
                Some(element) => &mut element[0].next,
                None => return false,
            };
        }
        match cursor.take() {
            Some(mut removed) => {
                *cursor = removed[0].next.take();
                true
            }
            None => false,
        }
    }

    #[inline(always)]
    pub fn first(&self) -> Option<&ListElement<T>> {
        self.first.as_deref().map(|[element]| element)
    }

    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        std::iter::successors(self.first(), |element| element.next()).map(|element| &element.value)
    }

    /// The first value that satisfies `predicate`.
    pub fn find_mut(&mut self, predicate: impl Fn(&T) -> bool) -> Option<&mut T> {
        let mut next = self.first.as_deref_mut();
        while let Some([element]) = next {
            if predicate(&element.value) {
                return Some(&mut element.value);
            }
            next = element.next.as_deref_mut();
        }
        None
    }
}

impl<T> ListElement<T> {
    #[inline(always)]
    pub fn next(&self) -> Option<&Self> {
        self.next.as_deref().map(|[element]| element)
    }
}

impl<T> Drop for Chain<T> {
    /// Drops the elements in a loop. The default drop would recurse as deep as the list is long.
    fn drop(&mut self) {
        let mut next = self.first.take();
        while let Some(mut element) = next {
            next = element[0].next.take();
        }
    }
}

/// Values are saved in list order.
impl<T: Saved> Saved for Chain<T> {
    const SHAPE: u64 = T::SHAPE;
    const LEAST: usize = 8;

    fn save(&self, to: &mut Writer) {
        self.iter().count().save(to);
        for value in self.iter() {
            to.needs(size_of::<ListElement<T>>());
            value.save(to);
        }
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let count = load_count(from, T::LEAST)?;
        from.reserve_memory(count.checked_mul(size_of::<ListElement<T>>()))?;
        let mut values = memory::reserved(count)?;
        T::load_all(count, &mut values, from)?;
        let mut chain = Self::EMPTY;
        values.into_iter().rev().try_for_each(|value| chain.push(value))?;
        Ok(chain)
    }
}

/// An allocated element that is not in a list yet.
#[derive(Debug)]
pub(super) struct Unlinked<T>(Owned<T>);

/// Allocates an element.
pub(super) fn unlinked<T>(value: T) -> Result<Unlinked<T>> {
    let mut element = memory::reserved(1)?;
    element.push(ListElement { value, next: None });
    match element.into_boxed_slice().try_into() {
        Ok(element) => Ok(Unlinked(element)),
        Err(_) => Err(Error::Internal("a list's element is not one".into())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_list_is_dropped_in_a_small_stack() {
        let mut chain = Chain::EMPTY;
        for value in 0..1_000_000_u32 {
            chain.push(value).expect("memory");
        }
        let count = || {
            assert_eq!(chain.iter().count(), 1_000_000);
            drop(chain);
        };
        let thread = std::thread::Builder::new().stack_size(64 << 10).spawn(count);
        thread.expect("a thread").join().expect("a drop without recursion");
    }

    #[test]
    fn elements_leave_from_every_place() {
        for removed in 0..4 {
            let mut chain = Chain::EMPTY;
            for value in 0..4 {
                chain.push(value).expect("memory");
            }
            assert!(chain.remove(|&value| value == removed));
            assert!(!chain.remove(|&value| value == removed));
            let left: Vec<i32> = chain.iter().copied().collect();
            let expected: Vec<i32> = (0..4).rev().filter(|&value| value != removed).collect();
            assert_eq!(left, expected);
        }
    }
}
