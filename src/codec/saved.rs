//! Serialization of numbers, lists, and structures field by field.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{BVec3, DMat3, DQuat, DVec3, Quat, Vec3, Vec3A};

use super::bytes::{Reader, Writer};
use crate::base::{
    AttachmentId, BodyId, Error, LimitKind, Result, SlotId, StepLimit, StepReport, SubstepLimit, ToolId, memory,
};

/// A type that can be saved and loaded bitwise.
pub(crate) trait Saved: Sized {
    /// A hash of the layout: it changes with the fields.
    const SHAPE: u64;

    /// The least number of bytes of a value.
    const LEAST: usize;

    fn save(&self, to: &mut Writer);

    fn load(from: &mut Reader) -> Result<Self>;

    /// Writes several values.
    fn save_all(all: &[Self], to: &mut Writer) {
        all.iter().for_each(|one| one.save(to));
    }

    /// Reads `count` values into a list that has room for them.
    fn load_all(count: usize, into: &mut Vec<Self>, from: &mut Reader) -> Result<()> {
        for _ in 0..count {
            into.push(Self::load(from)?);
        }
        Ok(())
    }
}

/// The shape of a name (FNV-1a).
pub(crate) const fn shape_of_name(name: &str) -> u64 {
    let bytes = name.as_bytes();
    let mut shape = 0xcbf2_9ce4_8422_2325;
    let mut index = 0;
    while index < bytes.len() {
        shape = (shape ^ bytes[index] as u64).wrapping_mul(0x0100_0000_01b3);
        index += 1;
    }
    shape
}

/// Combines two shapes.
pub(crate) const fn shape_with(shape: u64, other: u64) -> u64 {
    (shape.rotate_left(23) ^ other).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// The shape of a field.
pub(crate) const fn shape_of_field<T, F: Saved>(_: fn(&T) -> &F) -> u64 {
    F::SHAPE
}

/// The least number of bytes of a field.
pub(crate) const fn least_of_field<T, F: Saved>(_: fn(&T) -> &F) -> usize {
    F::LEAST
}

/// Implements [`Saved`] for a structure: `saved! { Name { all, its, fields } }`, or `saved! { [T: Saved] Name<T> { .. }
/// }` for a generic one. A missing field does not compile, unless `leaves { field: value }` gives its value after
/// loading. With `where check` loaded values must pass a check. `saved! { Name }` is for a structure without fields.
macro_rules! saved {
    ($name:ident) => {
        impl $crate::codec::Saved for $name {
            const SHAPE: u64 = $crate::codec::shape_of_name(stringify!($name));
            const LEAST: usize = 0;

            fn save(&self, _to: &mut $crate::codec::Writer) {}

            fn load(_from: &mut $crate::codec::Reader) -> $crate::base::Result<Self> {
                Ok(Self)
            }
        }
    };
    ([$($generics:tt)*] $name:ty { $($field:tt),* $(,)? } $(leaves { $($left:ident: $value:expr),* $(,)? })? $(where $check:path)?) => {
        impl<$($generics)*> $crate::codec::Saved for $name {
            const SHAPE: u64 = {
                let shape = $crate::codec::shape_of_name(stringify!($name));
                $(let shape = $crate::codec::shape_with(
                    $crate::codec::shape_with(shape, $crate::codec::shape_of_name(stringify!($field))),
                    $crate::codec::shape_of_field(|it: &Self| &it.$field),
                );)*
                shape
            };

            const LEAST: usize = 0 $(+ $crate::codec::least_of_field(|it: &Self| &it.$field))*;

            fn save(&self, to: &mut $crate::codec::Writer) {
                let Self { $($field: _,)* $($($left: _),*)? } = self;
                $($crate::codec::Saved::save(&self.$field, to);)*
            }

            fn load(from: &mut $crate::codec::Reader) -> $crate::base::Result<Self> {
                let it = Self { $($field: $crate::codec::Saved::load(from)?,)* $($($left: $value),*)? };
                $(if !$check(&it) {
                    return Err(from.refusal(concat!("no ", stringify!($name), " is like this")));
                })?
                Ok(it)
            }
        }
    };
    ($name:ty { $($rest:tt)* } $($more:tt)*) => {
        $crate::codec::saved!([] $name { $($rest)* } $($more)*);
    };
}

/// Implements [`Saved`] for an enum: `saved_enum!(Name { 0 => First, 1 => Second { field }, 2 => Third(value) })`.
macro_rules! saved_enum {
    ($name:ty { $($tag:literal => $variant:ident $({ $($field:ident),* $(,)? })? $(( $($value:ident),* ))?),* $(,)? }) => {
        impl $crate::codec::Saved for $name {
            const SHAPE: u64 = $crate::codec::shape_of_name(stringify!(
                $name { $($tag => $variant $({ $($field),* })? $(( $($value),* ))?),* }
            ));

            const LEAST: usize = 1;

            fn save(&self, to: &mut $crate::codec::Writer) {
                match self {
                    $(Self::$variant $({ $($field),* })? $(( $($value),* ))? => {
                        to.write(&[$tag]);
                        $($($crate::codec::Saved::save($field, to);)*)?
                        $($($crate::codec::Saved::save($value, to);)*)?
                    })*
                }
            }

            fn load(from: &mut $crate::codec::Reader) -> $crate::base::Result<Self> {
                let [tag] = from.take_array()?;
                Ok(match tag {
                    $($tag => {
                        $($(let $field = $crate::codec::Saved::load(from)?;)*)?
                        $($(let $value = $crate::codec::Saved::load(from)?;)*)?
                        Self::$variant $({ $($field),* })? $(( $($value),* ))?
                    })*
                    _ => return Err(from.refusal(concat!("no ", stringify!($name)))),
                })
            }
        }
    };
}

pub(crate) use {saved, saved_enum};

macro_rules! saved_numbers {
    ($($number:ty),*) => {
        $(impl Saved for $number {
            const SHAPE: u64 = shape_of_name(stringify!($number));
            const LEAST: usize = size_of::<$number>();

            fn save(&self, to: &mut Writer) {
                to.write(&self.to_le_bytes());
            }

            fn load(from: &mut Reader) -> Result<Self> {
                Ok(Self::from_le_bytes(from.take_array()?))
            }

            fn save_all(all: &[Self], to: &mut Writer) {
                const SIZE: usize = size_of::<$number>();
                if let Some(place) = to.buffer(SIZE * all.len()) {
                    for (place, one) in place.chunks_exact_mut(SIZE).zip(all) {
                        place.copy_from_slice(&one.to_le_bytes());
                    }
                }
            }

            fn load_all(count: usize, into: &mut Vec<Self>, from: &mut Reader) -> Result<()> {
                const SIZE: usize = size_of::<$number>();
                let size = count.checked_mul(SIZE).unwrap_or(usize::MAX);
                let (chunks, _) = from.take(size)?.as_chunks::<SIZE>();
                into.extend(chunks.iter().map(|chunk| Self::from_le_bytes(*chunk)));
                Ok(())
            }
        })*
    };
}

saved_numbers!(u8, u16, u32, u64, i32, f32, f64);

/// Fills a slice with numbers.
pub(crate) fn floats_into(places: &mut [f32], from: &mut Reader) -> Result<()> {
    let (chunks, _) = from.take(size_of_val(places))?.as_chunks::<4>();
    for (place, chunk) in places.iter_mut().zip(chunks) {
        *place = f32::from_le_bytes(*chunk);
    }
    Ok(())
}

/// Saves a type as the array with the same layout.
macro_rules! saved_as {
    ($($name:ty as $array:ty: $to:expr, $of:expr;)*) => {
        $(impl Saved for $name {
            const SHAPE: u64 = <$array>::SHAPE;
            const LEAST: usize = <$array>::LEAST;

            fn save(&self, to: &mut Writer) {
                let written: fn(&Self) -> $array = $to;
                written(self).save(to);
            }

            fn load(from: &mut Reader) -> Result<Self> {
                let read: fn($array, &Reader) -> Result<Self> = $of;
                read(<$array>::load(from)?, from)
            }
        })*
    };
}

saved_as! {
    usize as u64: |it| *it as u64, |it, from| usize::try_from(it).map_err(|_| from.refusal("a number is too large"));
    isize as u64: |it| *it as u64, |it, from| isize::try_from(it.cast_signed()).map_err(|_| from.refusal("a number is too large"));
    bool as u8: |it| u8::from(*it), |it, from| match it {
        0 | 1 => Ok(it == 1),
        _ => Err(from.refusal("neither true nor false")),
    };
    AtomicU32 as u32: |it| it.load(Ordering::Relaxed), |it, _| Ok(Self::new(it));
    Vec3 as [f32; 3]: Self::to_array, |it, _| Ok(it.into());
    Vec3A as [f32; 3]: Self::to_array, |it, _| Ok(it.into());
    DVec3 as [f64; 3]: Self::to_array, |it, _| Ok(it.into());
    Quat as [f32; 4]: |it| it.to_array(), |it, _| Ok(Self::from_array(it));
    DQuat as [f64; 4]: |it| it.to_array(), |it, _| Ok(Self::from_array(it));
    DMat3 as [f64; 9]: Self::to_cols_array, |it, _| Ok(Self::from_cols_array(&it));
    BVec3 as [bool; 3]: |it| [it.x, it.y, it.z], |it, _| Ok(it.into());
}

impl Saved for () {
    const SHAPE: u64 = 0;
    const LEAST: usize = 0;

    fn save(&self, _to: &mut Writer) {}

    fn load(_from: &mut Reader) -> Result<Self> {
        Ok(())
    }
}

impl<T: Saved, const N: usize> Saved for [T; N] {
    const SHAPE: u64 = shape_with(T::SHAPE, N as u64);
    const LEAST: usize = N * T::LEAST;

    fn save(&self, to: &mut Writer) {
        T::save_all(self, to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        // This avoids a heap allocation for each value.
        let mut refused = None;
        let array = std::array::from_fn(|_| match &refused {
            Some(_) => None,
            None => T::load(from).map_err(|error| refused = Some(error)).ok(),
        });
        if let Some(error) = refused {
            return Err(error);
        }
        if array.iter().any(Option::is_none) {
            return Err(from.refusal("an array ends early"));
        }
        Ok(array.map(|value| match value {
            Some(value) => value,
            None => unreachable!("all are there"),
        }))
    }
}

impl<T: Saved> Saved for Option<T> {
    const SHAPE: u64 = shape_with(T::SHAPE, 1);
    const LEAST: usize = 1;

    fn save(&self, to: &mut Writer) {
        self.is_some().save(to);
        if let Some(value) = self {
            value.save(to);
        }
    }

    fn load(from: &mut Reader) -> Result<Self> {
        Ok(if bool::load(from)? { Some(T::load(from)?) } else { None })
    }
}

impl<T: Saved> Saved for Box<T> {
    const SHAPE: u64 = T::SHAPE;
    const LEAST: usize = T::LEAST;

    fn save(&self, to: &mut Writer) {
        T::save(self, to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        memory::boxed(T::load(from)?)
    }
}

/// Reads a count of values of at least `least` bytes each.
pub(crate) fn load_count(from: &mut Reader, least: usize) -> Result<usize> {
    let count = usize::load(from)?;
    if count > from.left() / least {
        return Err(from.refusal("more is announced than there is"));
    }
    Ok(count)
}

/// Saves the capacity too, so that steps after loading allocate no more than before.
impl<T: Saved> Saved for Vec<T> {
    const SHAPE: u64 = shape_with(T::SHAPE, 2);
    const LEAST: usize = 16;

    fn save(&self, to: &mut Writer) {
        const { assert!(size_of::<T>() > 0 && T::LEAST > 0) };
        self.len().save(to);
        self.capacity().save(to);
        to.needs(self.capacity() * size_of::<T>());
        T::save_all(self, to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let (count, room) = (load_count(from, T::LEAST)?, usize::load(from)?);
        let mut values = from.reserved(room.max(count))?;
        T::load_all(count, &mut values, from)?;
        Ok(values)
    }
}

impl<T: Saved> Saved for Box<[T]> {
    const SHAPE: u64 = Vec::<T>::SHAPE;
    const LEAST: usize = 8;

    fn save(&self, to: &mut Writer) {
        self.len().save(to);
        to.needs(size_of_val(&**self));
        T::save_all(self, to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let count = load_count(from, T::LEAST)?;
        let mut values = from.reserved(count)?;
        T::load_all(count, &mut values, from)?;
        Ok(values.into_boxed_slice())
    }
}

impl Saved for String {
    const SHAPE: u64 = Vec::<u8>::SHAPE;
    const LEAST: usize = 8;

    fn save(&self, to: &mut Writer) {
        self.len().save(to);
        to.write(self.as_bytes());
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let count = usize::load(from)?;
        let bytes = memory::copied(from.take(count)?)?;
        Self::from_utf8(bytes).map_err(|_| from.refusal("a text is none"))
    }
}

macro_rules! saved_tuples {
    ($(($($name:ident $place:tt),*))*) => {
        $(impl<$($name: Saved),*> Saved for ($($name,)*) {
            const SHAPE: u64 = {
                let shape = 3;
                $(let shape = shape_with(shape, $name::SHAPE);)*
                shape
            };
            const LEAST: usize = 0 $(+ $name::LEAST)*;

            fn save(&self, to: &mut Writer) {
                $(self.$place.save(to);)*
            }

            fn load(from: &mut Reader) -> Result<Self> {
                Ok(($($name::load(from)?,)*))
            }
        })*
    };
}

saved_tuples!((A 0, B 1)(A 0, B 1, C 2));

saved! { [T: Saved] std::ops::Range<T> { start, end } }

saved_enum!(Error {
    0 => InvalidArgument(message),
    1 => StaleId(message),
    2 => Capacity(message),
    3 => OutOfMemory,
    4 => Unstable { report, allowed },
    5 => NotConverged(message),
    6 => Unsupported(message),
    7 => Io(message),
    8 => Internal(message),
});

saved_enum!(LimitKind { 0 => Spring, 1 => Element, 2 => Term, 3 => Cavity, 4 => Parts, 5 => Tolerance });

saved! { SubstepLimit { kind, nodes, node_count } }

saved! { StepLimit { body, of, needed, is_chosen } }

saved! { StepReport { substeps, stable_substep, bodies_restored, error_estimate, crossings, limit, substeps_body,
restored_body, crossing_body } }

saved! { BodyId { 0 } }

saved! { ToolId { 0 } }

saved! { AttachmentId { 0 } }

saved! { SlotId { index1, generation } }
