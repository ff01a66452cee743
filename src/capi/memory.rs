//! What crosses the border as a pointer: checked, and turned into references and slices.

use std::borrow::Cow;
use std::ffi::{CStr, c_char};
use std::fmt;
use std::ops::Range;

use glam::{Quat, Vec3};

use crate::base::{Error, Result, ensure, memory};

/// A struct that begins with `struct_size`, so that it can grow.
///
/// A new field begins at or after the end of the struct in the last header, never in padding at its end: the size would
/// not tell whether the caller knows it.
///
/// # Safety
/// The type is `repr(C)`, begins with a `usize` named `struct_size`, has no padding that is read, and every pattern of
/// bits is a value of it.
pub(super) unsafe trait Versioned: Copy {
    /// The sizes that earlier headers gave it, and today's last.
    const SIZES: &'static [usize];

    /// What is 0, NULL or none throughout, but for its size.
    fn empty() -> Self {
        // SAFETY: every pattern of bits is a value of it.
        let mut empty: Self = unsafe { std::mem::zeroed() };
        // SAFETY: `struct_size` is the first field of every `Versioned`.
        unsafe { (&raw mut empty).cast::<usize>().write(size_of::<Self>()) };
        empty
    }
}

/// Makes structs [`Versioned`], each with the fields at which an earlier header ended, if any.
///
/// Who lists a struct vouches that it is `repr(C)` and has numbers and pointers alone. A function among them is what
/// the caller says it is.
macro_rules! versioned {
    ($($name:ident $({ $($later:ident),+ })?),+) => { $(
        const _: () = assert!(std::mem::offset_of!($name, struct_size) == 0);

        // SAFETY: as vouched for, with `struct_size` first.
        unsafe impl $crate::capi::memory::Versioned for $name {
            const SIZES: &'static [usize] = &[$($(std::mem::offset_of!(Self, $later),)+)? size_of::<Self>()];
        }
    )+ };
}
pub(super) use versioned;

/// Makes of a value of ours what C is told of it, field by field under the same names.
macro_rules! told {
    ($ours:ty => $c:ident { $($field:ident),+ }) => {
        impl From<$ours> for $c {
            fn from(ours: $ours) -> Self {
                Self {
                    struct_size: size_of::<Self>(),
                    $($field: ours.$field.into()),+
                }
            }
        }
    };
}
pub(super) use told;

/// The value that `pointer` points to.
///
/// # Safety
/// `pointer` is NULL or points to a valid `T` that nobody changes meanwhile.
pub(super) unsafe fn reference<'a, T>(name: &str, pointer: *const T) -> Result<&'a T> {
    aligned(name, pointer)?;
    // SAFETY: aligned; the caller vouches for a valid T where the pointer is not NULL.
    unsafe { pointer.as_ref() }.ok_or_else(|| null(name))
}

/// The place for a result.
///
/// # Safety
/// `pointer` is NULL or points to a valid `T` that nobody else uses meanwhile.
pub(super) unsafe fn output<'a, T>(name: &str, pointer: *mut T) -> Result<&'a mut T> {
    aligned(name, pointer)?;
    // SAFETY: aligned; the caller vouches for a valid T where the pointer is not NULL.
    unsafe { pointer.as_mut() }.ok_or_else(|| null(name))
}

/// Writes a result.
///
/// # Safety
/// As [`output`].
pub(super) unsafe fn write<T>(name: &str, pointer: *mut T, value: T) -> Result<()> {
    *output(name, pointer)? = value;
    Ok(())
}

/// A result, the place that it goes to, and the name of that.
type Output<'a, T> = (&'a str, *mut T, T);

/// Writes two results, or neither.
///
/// # Safety
/// As [`output`], for both.
pub(super) unsafe fn write_both<A, B>((name, place, value): Output<A>, other: Output<B>) -> Result<()> {
    let (place, other_place) = (output(name, place)?, output(other.0, other.1)?);
    (*place, *other_place) = (value, other.2);
    Ok(())
}

/// Writes those of two results whose place is not NULL, or neither.
///
/// # Safety
/// As [`output`], for both.
pub(super) unsafe fn write_wanted<A, B>((name, place, value): Output<A>, other: Output<B>) -> Result<()> {
    let place = optional_output_array(name, place, 1)?;
    let other_place = optional_output_array(other.0, other.1, 1)?;
    if let Some(place) = place {
        place[0] = value;
    }
    if let Some(place) = other_place {
        place[0] = other.2;
    }
    Ok(())
}

/// Writes those of three results whose place is not NULL, or none.
///
/// # Safety
/// As [`output`], for all.
pub(super) unsafe fn write_wanted_of_three<A, B, C>(
    first: Output<A>,
    second: Output<B>,
    third: Output<C>,
) -> Result<()> {
    // The third is known to be usable before the first is written.
    optional_output_array(third.0, third.1, 1)?;
    write_wanted(first, second)?;
    write_wanted(third, ("", std::ptr::null_mut(), ()))
}

/// The array of `count` values that `pointer` points to; NULL is allowed where `count` is 0.
///
/// # Safety
/// `pointer` is NULL or points to `count` values that nobody changes meanwhile.
pub(super) unsafe fn array<'a, T>(name: &str, pointer: *const T, count: usize) -> Result<&'a [T]> {
    if pointer.is_null() {
        return if count == 0 { Ok(&[]) } else { Err(null(name)) };
    }
    if !pointer.is_aligned() || count > isize::MAX as usize / size_of::<T>().max(1) {
        return Err(Error::invalid(format!("{name} is no array of {count} entries")));
    }
    // SAFETY: not NULL, aligned, of a size that exists; the caller vouches for its content.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// The array, copied where it lies in `own`: a view of ours that the caller hands back, and that the call writes to.
///
/// # Safety
/// As [`array`].
pub(super) unsafe fn array_apart<'a, T: Copy>(
    name: &str,
    pointer: *const T,
    count: usize,
    own: Range<*const T>,
) -> Result<Cow<'a, [T]>> {
    let values = array(name, pointer, count)?;
    let given = values.as_ptr_range();
    if given.start < own.end && own.start < given.end {
        return memory::copied(values).map(Cow::Owned);
    }
    Ok(Cow::Borrowed(values))
}

/// An array that may be left out altogether.
///
/// # Safety
/// As [`array`].
pub(super) unsafe fn optional_array<'a, T>(name: &str, pointer: *const T, count: usize) -> Result<Option<&'a [T]>> {
    if pointer.is_null() {
        return Ok(None);
    }
    array(name, pointer, count).map(Some)
}

/// The place for `count` results; NULL is allowed where `count` is 0.
///
/// # Safety
/// `pointer` is NULL or points to `count` valid values that nobody else uses meanwhile.
pub(super) unsafe fn output_array<'a, T>(name: &str, pointer: *mut T, count: usize) -> Result<&'a mut [T]> {
    let values = array(name, pointer.cast_const(), count)?;
    if values.is_empty() {
        return Ok(&mut []);
    }
    // SAFETY: not NULL, aligned, of a size that exists; the caller vouches for its content.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, count) })
}

/// Writes as many of what is found as an array of so many has places for, and to `out_count` how many there are.
///
/// # Safety
/// As [`output_array`] and [`output`].
pub(super) unsafe fn write_found<T>(
    found: impl Iterator<Item = T>,
    (name, pointer, capacity): (&str, *mut T, usize),
    out_count: *mut usize,
) -> Result<()> {
    let (places, out_count) = (output_array(name, pointer, capacity)?, output("out_count", out_count)?);
    let mut count = 0;
    for one in found {
        if let Some(place) = places.get_mut(count) {
            *place = one;
        }
        count += 1;
    }
    *out_count = count;
    Ok(())
}

/// A place for results that may be left out altogether.
///
/// # Safety
/// As [`output_array`].
pub(super) unsafe fn optional_output_array<'a, T>(
    name: &str,
    pointer: *mut T,
    count: usize,
) -> Result<Option<&'a mut [T]>> {
    if pointer.is_null() {
        return Ok(None);
    }
    output_array(name, pointer, count).map(Some)
}

/// The 3 floats that `pointer` points to.
///
/// # Safety
/// `pointer` is NULL or points to 3 floats that nobody changes meanwhile.
pub(super) unsafe fn vector(name: &str, pointer: *const f32) -> Result<Vec3> {
    reference(name, pointer.cast::<[f32; 3]>()).map(|&vector| vector.into())
}

/// The orientation that `pointer` points to; `None` where it is NULL.
///
/// # Safety
/// `pointer` is NULL or points to 4 floats that nobody changes meanwhile.
pub(super) unsafe fn optional_orientation(name: &str, pointer: *const f32) -> Result<Option<Quat>> {
    let orientation = optional_array(name, pointer.cast::<[f32; 4]>(), 1)?;
    Ok(orientation.map(|orientation| Quat::from_array(orientation[0])))
}

/// The text that `pointer` points to.
///
/// # Safety
/// `pointer` is NULL or points to bytes that end with NUL.
pub(super) unsafe fn text<'a>(name: &str, pointer: *const c_char) -> Result<&'a str> {
    ensure!(!pointer.is_null(), null(name));
    // SAFETY: not NULL; the caller vouches for the NUL at its end.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str()
        .map_err(|error| Error::invalid(format!("{name} is not UTF-8: {error}")))
}

/// The definition that `pointer` points to, in the size of whatever header the caller was built with; what that header
/// did not know is as in `defaults`.
///
/// # Safety
/// `pointer` is NULL or points to a T of the size that its `struct_size` states.
pub(super) unsafe fn definition<T: Versioned>(name: &str, pointer: *const T, defaults: T) -> Result<T> {
    ensure!(!pointer.is_null(), null(name));
    // SAFETY: `struct_size` is the first field of every `Versioned`.
    let size = unsafe { pointer.cast::<usize>().read_unaligned() };
    known_size::<T>(&format_args!("{name}->struct_size"), size)?;
    let mut definition = defaults;
    // SAFETY: `size` bytes are there, and fit into T: no known size is larger.
    unsafe {
        std::ptr::copy_nonoverlapping(pointer.cast::<u8>(), (&raw mut definition).cast::<u8>(), size);
    }
    Ok(definition)
}

/// The definition that `pointer` points to, or the defaults where it is left out.
///
/// # Safety
/// As [`definition`].
pub(super) unsafe fn optional_definition<T: Versioned>(name: &str, pointer: *const T, defaults: T) -> Result<T> {
    if pointer.is_null() {
        return Ok(defaults);
    }
    definition(name, pointer, defaults)
}

/// Fills the definition at `pointer` with `defaults`, as much of it as `size` says the caller knows.
///
/// # Safety
/// `pointer` is NULL or points to `size` writable bytes.
pub(super) unsafe fn initialise<T: Versioned>(pointer: *mut T, size: usize, mut defaults: T) -> Result<()> {
    ensure!(!pointer.is_null(), null("def"));
    known_size::<T>(&"struct_size", size)?;
    // SAFETY: `struct_size` is the first field of every `Versioned`.
    unsafe { (&raw mut defaults).cast::<usize>().write(size) };
    // SAFETY: the caller vouches for `size` bytes, and T has as many: no known size is larger.
    unsafe { std::ptr::copy_nonoverlapping((&raw const defaults).cast::<u8>(), pointer.cast::<u8>(), size) };
    Ok(())
}

/// A result struct of the caller's, found to be usable.
pub(super) struct Report<T> {
    pointer: *mut T,
    size: usize,
}

/// The result struct at `pointer`, whose `struct_size` the caller has set.
///
/// # Safety
/// `pointer` is NULL or points to as many writable bytes as its `struct_size` states.
pub(super) unsafe fn report<T: Versioned>(name: &str, pointer: *mut T) -> Result<Report<T>> {
    ensure!(!pointer.is_null(), null(name));
    // SAFETY: `struct_size` is the first field of every `Versioned`.
    let size = unsafe { pointer.cast::<usize>().read_unaligned() };
    known_size::<T>(&format_args!("{name}->struct_size"), size)?;
    Ok(Report { pointer, size })
}

/// Writes a result struct.
///
/// # Safety
/// As [`report`].
pub(super) unsafe fn write_report<T: Versioned>(name: &str, pointer: *mut T, value: T) -> Result<()> {
    report(name, pointer)?.fill(value);
    Ok(())
}

/// A result struct that may be left out.
///
/// # Safety
/// As [`report`].
pub(super) unsafe fn optional_report<T: Versioned>(name: &str, pointer: *mut T) -> Result<Option<Report<T>>> {
    if pointer.is_null() {
        return Ok(None);
    }
    report(name, pointer).map(Some)
}

impl<T: Versioned> Report<T> {
    /// Fills what the caller knows, and leaves `struct_size` as it is.
    ///
    /// # Safety
    /// The struct is still there.
    pub unsafe fn fill(&self, mut value: T) {
        // SAFETY: `struct_size` is the first field of every `Versioned`.
        unsafe { (&raw mut value).cast::<usize>().write(self.size) };
        let from = (&raw const value).cast::<u8>();
        // SAFETY: the caller vouches for `size` bytes, and the value has as many: no known size is larger.
        unsafe { std::ptr::copy_nonoverlapping(from, self.pointer.cast::<u8>(), self.size) };
    }
}

/// Refuses a size that no header gave the struct: it was not set, or is a newer header's.
fn known_size<T: Versioned>(name: &dyn fmt::Display, size: usize) -> Result<()> {
    if T::SIZES.contains(&size) {
        return Ok(());
    }
    let (_, type_name) = std::any::type_name::<T>().rsplit_once(':').unwrap_or_default();
    Err(Error::invalid(format!(
        "{name} is {size}: this library knows a {type_name} of {:?} bytes",
        T::SIZES
    )))
}

fn aligned<T>(name: &str, pointer: *const T) -> Result<()> {
    ensure!(pointer.is_aligned(), "{name} is not aligned");
    Ok(())
}

pub(super) fn null(name: &str) -> Error {
    Error::invalid(format!("{name} is NULL"))
}

/// Refuses a reserved field that is not zero.
pub(super) fn reserved(name: &str, value: u32) -> Result<()> {
    ensure!(value == 0, "{name} is {value}: reserved fields are 0");
    Ok(())
}

/// A flag of the caller's.
pub(super) fn flag(name: &str, value: u32) -> Result<bool> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(Error::invalid(format!("{name} is {other}: must be 0 or 1"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[repr(C)]
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Grown {
        struct_size: usize,
        old: u64,
        new: u64,
    }

    // SAFETY: repr(C), no padding, begins with struct_size.
    unsafe impl Versioned for Grown {
        const SIZES: &'static [usize] = &[16, 24];
    }

    const DEFAULTS: Grown = Grown {
        struct_size: 24,
        old: 1,
        new: 2,
    };

    #[test]
    fn an_older_definition_gets_defaults_for_what_it_does_not_know() {
        let given = [16_usize, 7, 99];
        // SAFETY: 24 bytes are there.
        let read = unsafe { definition("def", given.as_ptr().cast(), DEFAULTS) };
        assert_eq!(read.map(|read| (read.old, read.new)), Ok((7, 2)));
        for unknown in [0, 8, 20, 32] {
            let given = [unknown, 7, 99, 99];
            // SAFETY: 32 bytes are there.
            assert!(unsafe { definition("def", given.as_ptr().cast(), DEFAULTS) }.is_err());
        }
    }

    #[test]
    fn nothing_is_written_beyond_the_size_the_caller_knows() {
        let mut place = [0_usize, 0, 99];
        // SAFETY: 24 bytes are there.
        unsafe { initialise(place.as_mut_ptr().cast(), 16, DEFAULTS) }.expect("a known size");
        assert_eq!(place, [16, 1, 99]);
        // SAFETY: 24 bytes are there.
        unsafe {
            let report = report::<Grown>("out", place.as_mut_ptr().cast()).expect("a known size");
            report.fill(Grown { old: 5, ..DEFAULTS });
        }
        assert_eq!(place, [16, 5, 99]);
        for unknown in [0, 8, 20, 40] {
            let mut place = [unknown, 0, 99];
            // SAFETY: 24 bytes are there, and nothing is written.
            let refused = unsafe { report::<Grown>("out", place.as_mut_ptr().cast()) }.err();
            let message = refused.expect("refused").to_string();
            assert!(message.contains(&format!("out->struct_size is {unknown}")), "{message}");
        }
    }
}
