//! Numbers that formulas are written for once: an `f64`, or an `f32` in each lane.

use std::ops::{Add, Div, Mul, Sub};

use super::Lanes;

/// A number, or one in each lane.
pub(crate) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The same number in all lanes.
    fn of(value: f64) -> Self;

    /// Without their signs.
    fn size(self) -> Self;

    fn lesser(self, other: Self) -> Self;

    fn greater(self, other: Self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn size(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn lesser(self, other: Self) -> Self {
        self.min(other)
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        self.max(other)
    }
}

/// Lanes with operators. [`Self::new`] alone makes one, where the processor has the instructions.
#[derive(Clone, Copy)]
pub(crate) struct InLanes<L>(L);

impl<L: Lanes> InLanes<L> {
    /// # Safety
    /// The processor has the instructions of `L`. A kernel alone calls the generic functions of [`Real`] with them.
    #[inline(always)]
    pub unsafe fn new(lanes: L) -> Self {
        Self(lanes)
    }

    #[inline(always)]
    pub fn lanes(self) -> L {
        self.0
    }
}

macro_rules! operators {
    ($($operator:ident $name:ident $of_lanes:ident),*) => {$(
        impl<L: Lanes> $operator for InLanes<L> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                // SAFETY: there are lanes, so there are their instructions.
                Self(unsafe { self.0.$of_lanes(other.0) })
            }
        }
    )*};
}

operators!(Add add add, Sub sub subtract, Mul mul multiply, Div div divide);

impl<L: Lanes> Real for InLanes<L> {
    #[inline(always)]
    fn of(value: f64) -> Self {
        // SAFETY: formulas are generic over lanes that their arguments have, so there are their instructions.
        Self(unsafe { L::splat(value as f32) })
    }

    #[inline(always)]
    fn size(self) -> Self {
        // SAFETY: there are lanes, so there are their instructions.
        Self(unsafe { self.0.size() })
    }

    #[inline(always)]
    fn lesser(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { self.0.lesser(other.0) })
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { self.0.greater(other.0) })
    }
}
