//! Memory that grows with the caller's data, reserved so that running out of it is an answer, not an abort.

use super::Result;

/// A vector of `count` equal values.
pub(crate) fn filled<T: Clone>(value: T, count: usize) -> Result<Vec<T>> {
    let mut values = reserved(count)?;
    values.resize(count, value);
    Ok(values)
}

/// An empty vector with room for `count` values.
pub(crate) fn reserved<T>(count: usize) -> Result<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count)?;
    Ok(values)
}

/// The values in a vector that has room for no more.
pub(crate) fn collected<T>(values: impl ExactSizeIterator<Item = T>) -> Result<Vec<T>> {
    let mut all = reserved(values.len())?;
    all.extend(values);
    Ok(all)
}

/// The same of values that may be refused, as the first of them that is.
pub(crate) fn try_collected<T>(values: impl ExactSizeIterator<Item = Result<T>>) -> Result<Vec<T>> {
    let mut all = reserved(values.len())?;
    for value in values {
        all.push(value?);
    }
    Ok(all)
}

/// The values, of which there are `most` at most, in a vector with room for those.
pub(crate) fn collected_within<T>(most: usize, values: impl Iterator<Item = T>) -> Result<Vec<T>> {
    let mut all = reserved(most)?;
    all.extend(values);
    Ok(all)
}

/// The values, however many they turn out to be.
pub(crate) fn gathered<T>(values: impl IntoIterator<Item = T>) -> Result<Vec<T>> {
    let mut all = Vec::new();
    extend(&mut all, values)?;
    Ok(all)
}

/// A copy of `values`.
pub(crate) fn copied<T: Copy>(values: &[T]) -> Result<Vec<T>> {
    let mut copy = reserved(values.len())?;
    copy.extend_from_slice(values);
    Ok(copy)
}

/// Merges `more` into `values`, which has room for it, both in ascending order of their keys.
pub(crate) fn merge<T: Copy, K: Ord>(values: &mut Vec<T>, more: &[T], key: impl Fn(&T) -> K) {
    let mut known = values.len();
    values.extend_from_slice(more);
    // From the end: what is moved is not needed any more where it was.
    for (left, added) in more.iter().enumerate().rev() {
        while known > 0 && key(&values[known - 1]) > key(added) {
            known -= 1;
            values[known + left + 1] = values[known];
        }
        values[known + left] = *added;
    }
}

/// Makes room for `count` values in all.
pub(crate) fn reserve<T>(values: &mut Vec<T>, count: usize) -> Result<()> {
    Ok(values.try_reserve_exact(count.saturating_sub(values.len()))?)
}

/// The same and up to an eighth more, for a list that grows with each body: it is copied now and then, not each time. The count alone
/// tells how much room that is, so that a world that is loaded has as much.
pub(crate) fn reserve_in_steps<T>(values: &mut Vec<T>, count: usize) -> Result<()> {
    reserve(values, count.next_multiple_of((count.next_power_of_two() / 8).max(1)))
}

/// Gives back the room beyond the values. By a copy: `shrink_to_fit` makes one too of what is aligned by more than memory is anyway, and ends the program
/// where there is none for it.
pub(crate) fn shrink<T: Copy>(values: &mut Vec<T>) -> Result<()> {
    if values.capacity() > values.len() {
        *values = copied(values)?;
    }
    Ok(())
}

/// Sorts the values and leaves each once.
pub(crate) fn sort_once<T: Ord>(values: &mut Vec<T>) {
    values.sort_unstable();
    values.dedup();
}

/// A value in a place of its own.
#[allow(unsafe_code)]
pub(crate) fn boxed<T>(value: T) -> Result<Box<T>> {
    let mut one = reserved(1)?;
    one.push(value);
    let first = Box::into_raw(one.into_boxed_slice()).cast::<T>();
    // SAFETY: a slice of one lies in memory as what is in it, and nobody else has it.
    Ok(unsafe { Box::from_raw(first) })
}

/// What is there, or made in a place of its own.
pub(crate) fn get_or_box<T: Default>(place: &mut Option<Box<T>>) -> Result<&mut T> {
    let there = match place.take() {
        Some(there) => there,
        None => boxed(T::default())?,
    };
    Ok(place.insert(there))
}

/// Appends `value`, growing the vector fallibly.
pub(crate) fn push<T>(values: &mut Vec<T>, value: T) -> Result<()> {
    values.try_reserve(1)?;
    values.push(value);
    Ok(())
}

/// Appends all of these, growing the vector fallibly.
pub(crate) fn extend<T>(values: &mut Vec<T>, more: impl IntoIterator<Item = T>) -> Result<()> {
    more.into_iter().try_for_each(|value| push(values, value))
}
