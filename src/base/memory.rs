//! Fallible allocation: running out of memory returns an error instead of aborting.

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

/// The values in a vector of exact capacity.
pub(crate) fn collected<T>(values: impl ExactSizeIterator<Item = T>) -> Result<Vec<T>> {
    let mut all = reserved(values.len())?;
    all.extend(values);
    Ok(all)
}

/// The values in a vector of exact capacity, or the first error.
pub(crate) fn try_collected<T>(values: impl ExactSizeIterator<Item = Result<T>>) -> Result<Vec<T>> {
    let mut all = reserved(values.len())?;
    for value in values {
        all.push(value?);
    }
    Ok(all)
}

/// At most `most` values, in a vector with that capacity.
pub(crate) fn collected_within<T>(most: usize, values: impl Iterator<Item = T>) -> Result<Vec<T>> {
    let mut all = reserved(most)?;
    all.extend(values);
    Ok(all)
}

/// The values in a growing vector.
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
    // From the end, so that no value is overwritten before it is moved.
    for (remaining, added) in more.iter().enumerate().rev() {
        while known > 0 && key(&values[known - 1]) > key(added) {
            known -= 1;
            values[known + remaining + 1] = values[known];
        }
        values[known + remaining] = *added;
    }
}

/// Reserves room for `count` values in total.
pub(crate) fn reserve<T>(values: &mut Vec<T>, count: usize) -> Result<()> {
    Ok(values.try_reserve_exact(count.saturating_sub(values.len()))?)
}

/// Reserves room for `count` values, rounded up by at most an eighth, so that a list that grows with each body is
/// rarely copied. The capacity depends only on the count, so that a loaded world has the same.
pub(crate) fn reserve_in_steps<T>(values: &mut Vec<T>, count: usize) -> Result<()> {
    reserve(values, count.next_multiple_of((count.next_power_of_two() / 8).max(1)))
}

/// Frees unused capacity, by a copy. `shrink_to_fit` can copy too, and aborts the program if memory runs out.
pub(crate) fn shrink<T: Copy>(values: &mut Vec<T>) -> Result<()> {
    if values.capacity() > values.len() {
        *values = copied(values)?;
    }
    Ok(())
}

/// Sorts the values and removes duplicates.
pub(crate) fn sort_once<T: Ord>(values: &mut Vec<T>) {
    values.sort_unstable();
    values.dedup();
}

/// A value in a box.
#[allow(unsafe_code)]
pub(crate) fn boxed<T>(value: T) -> Result<Box<T>> {
    let mut one = reserved(1)?;
    one.push(value);
    let first = Box::into_raw(one.into_boxed_slice()).cast::<T>();
    // SAFETY: a slice of one value has the layout of that value, and nothing else refers to it.
    Ok(unsafe { Box::from_raw(first) })
}

/// The existing value, or a new default one in a box.
pub(crate) fn get_or_box<T: Default>(slot: &mut Option<Box<T>>) -> Result<&mut T> {
    let value = match slot.take() {
        Some(value) => value,
        None => boxed(T::default())?,
    };
    Ok(slot.insert(value))
}

/// Appends `value`, growing the vector fallibly.
pub(crate) fn push<T>(values: &mut Vec<T>, value: T) -> Result<()> {
    values.try_reserve(1)?;
    values.push(value);
    Ok(())
}

/// Appends the values, growing the vector fallibly.
pub(crate) fn extend<T>(values: &mut Vec<T>, more: impl IntoIterator<Item = T>) -> Result<()> {
    more.into_iter().try_for_each(|value| push(values, value))
}
