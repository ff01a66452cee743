//! Eight links of one node at a time, for storages that keep the links of a node side by side.

use std::marker::PhantomData;

use glam::Vec3;

use super::Lanes;
use super::{ChosenKernel, WithLanes};

/// Links: the neighbour, and the bits of the stiffness and the rest length.
pub(crate) type EightLinks = [[u32; 3]; 8];

/// Where the coordinates of all nodes are, and those of the node whose links they are.
#[derive(Clone, Copy)]
pub(crate) struct Sight<'a> {
    pub positions: [&'a [f32]; 3],
    pub here: Vec3,
}

/// A kernel's way to work out eight links together.
pub(crate) trait Eights: Copy {
    /// The force of the links on their node; `None` where an end of one coincides with it. All lead to nodes.
    fn pull(self, sight: Sight, links: &EightLinks) -> Option<Vec3>;
}

/// Work that takes links eight at a time.
pub(crate) trait WithEights {
    /// To be marked `#[inline(always)]`: it is compiled as part of its caller, with that one's instructions.
    fn run<E: Eights>(self, eights: E);
}

/// Made only where the processor has the instructions of `L`.
struct Offered<L>(PhantomData<L>);

impl<L> Clone for Offered<L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L> Copy for Offered<L> {}

impl<L: Lanes> Eights for Offered<L> {
    #[inline(always)]
    fn pull(self, sight: Sight, links: &EightLinks) -> Option<Vec3> {
        // SAFETY: there would be none without the instructions.
        unsafe { L::pull_eight(sight, links) }
    }
}

struct Work<W>(W);

impl<W: WithEights> WithLanes for Work<W> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        self.0.run(Offered::<L>(PhantomData));
    }
}

impl ChosenKernel {
    /// Runs `work` with the kernel's way to work out eight links together.
    #[inline]
    pub(crate) fn run_with_eights(self, work: impl WithEights) {
        self.run_with_lanes(Work(work));
    }
}

/// One link after the other: the same bits on every processor.
#[inline(always)]
pub(super) fn pull_one_by_one(sight: Sight, links: &EightLinks) -> Option<Vec3> {
    let [x, y, z] = sight.positions;
    let mut sum = Vec3::ZERO;
    for &[neighbour, stiffness, rest_length] in links {
        let neighbour = neighbour as usize;
        let way = Vec3::new(x[neighbour], y[neighbour], z[neighbour]) - sight.here;
        let length = way.length_squared().sqrt();
        let [stiffness, rest_length] = [stiffness, rest_length].map(f32::from_bits);
        sum += way * (stiffness * (length - rest_length) / length);
    }
    (!sum.is_nan()).then_some(sum)
}
