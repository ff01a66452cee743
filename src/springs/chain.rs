//! A linked list whose elements are allocated one by one.

use crate::base::{Error, Result, memory};
use crate::codec::{Reader, Saved, Writer, load_count};

/// An element on the heap: an array of one, because its memory can be asked for in a way that may be refused.
type Owned<T> = Box<[ListElement<T>; 1]>;

/// An element of a list.
#[derive(Debug)]
pub(super) struct ListElement<T> {
    pub value: T,
    next: Option<Owned<T>>,
}

/// A linked list.
#[derive(Debug)]
pub(super) struct Chain<T> {
    first: Option<Owned<T>>,
}

impl<T> Chain<T> {
    pub const EMPTY: Self = Self { first: None };

    /// Puts `value` before the others.
    pub fn push(&mut self, value: T) -> Result<()> {
        self.put(unlinked(value)?);
        Ok(())
    }

    /// Puts in an element that is in no list.
    pub fn put(&mut self, Unlinked(mut element): Unlinked<T>) {
        element[0].next = self.first.take();
        self.first = Some(element);
    }

    /// Drops the first value of which this is true; whether there was one.
    pub fn remove(&mut self, is: impl Fn(&T) -> bool) -> bool {
        let mut place = &mut self.first;
        while place.as_ref().is_some_and(|element| !is(&element[0].value)) {
            place = match place {
                Some(element) => &mut element[0].next,
                None => return false,
            };
        }
        match place.take() {
            Some(mut found) => {
                *place = found[0].next.take();
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

    /// The first value of which this is true.
    pub fn find_mut(&mut self, is: impl Fn(&T) -> bool) -> Option<&mut T> {
        let mut next = self.first.as_deref_mut();
        while let Some([element]) = next {
            if is(&element.value) {
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
    /// One after the other: by itself each element would drop the next within its own drop, as deep as the list is long.
    fn drop(&mut self) {
        let mut next = self.first.take();
        while let Some(mut element) = next {
            next = element[0].next.take();
        }
    }
}

/// In their order.
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
        from.will_take(count.checked_mul(size_of::<ListElement<T>>()))?;
        let mut values = memory::reserved(count)?;
        T::load_all(count, &mut values, from)?;
        let mut chain = Self::EMPTY;
        values.into_iter().rev().try_for_each(|value| chain.push(value))?;
        Ok(chain)
    }
}

/// An element that is in no list yet.
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
