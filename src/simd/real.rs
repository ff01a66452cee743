//! Scalar type of generic formulas: an `f64`, or an `f32` in each lane.

use std::ops::{Add, Div, Mul, Sub};

use super::Lanes;

/// One number, or one per lane.
pub(crate) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Copies a number to all lanes.
    fn from_f64(value: f64) -> Self;

    /// Absolute value.
    fn abs(self) -> Self;

    fn min(self, other: Self) -> Self;

    fn max(self, other: Self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.min(other)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.max(other)
    }
}

/// Lanes with operators. Only [`Self::new`] creates one, if the processor has the instructions.
#[derive(Clone, Copy)]
pub(crate) struct InLanes<L>(L);

impl<L: Lanes> InLanes<L> {
    /// # Safety
    /// The processor must have the instructions of `L`. Only a kernel may call the generic functions of [`Real`] with
    /// them.
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
                // SAFETY: lanes exist only if the processor has their instructions.
                Self(unsafe { self.0.$of_lanes(other.0) })
            }
        }
    )*};
}

operators!(Add add add, Sub sub sub, Mul mul mul, Div div div);

impl<L: Lanes> Real for InLanes<L> {
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        // SAFETY: formulas are generic over the lanes of their arguments, which exist only with their instructions.
        Self(unsafe { L::splat(value as f32) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: lanes exist only if the processor has their instructions.
        Self(unsafe { self.0.abs() })
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: lanes exist only if the processor has their instructions.
        Self(unsafe { self.0.min(other.0) })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: lanes exist only if the processor has their instructions.
        Self(unsafe { self.0.max(other.0) })
    }
}
