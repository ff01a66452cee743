//! Batches of eight links of one node, for storages that keep a node's links contiguously.

use std::marker::PhantomData;

use glam::Vec3;

use super::Lanes;
use super::{ChosenKernel, WithLanes};

/// Links: the neighbor, and the bits of the stiffness and the rest length.
pub(crate) type LinkBatch = [[u32; 3]; 8];

/// Coordinates of all nodes, and of the node that the links belong to.
#[derive(Clone, Copy)]
pub(crate) struct BatchInput<'a> {
    pub positions: [&'a [f32]; 3],
    pub here: Vec3,
}

/// SIMD implementation of batches.
pub(crate) trait BatchKernel: Copy {
    /// Computes the force of the links on their node. Returns `None` if an end coincides with the node. All neighbors
    /// must exist.
    fn pull(self, input: BatchInput, links: &LinkBatch) -> Option<Vec3>;
}

/// Work that processes links in batches.
pub(crate) trait WithBatches {
    /// Must be `#[inline(always)]`: it is compiled as part of its caller, with the caller's instructions.
    fn run<E: BatchKernel>(self, kernel: E);
}

/// Created only if the processor has the instructions of `L`.
struct SupportedKernel<L>(PhantomData<L>);

impl<L> Clone for SupportedKernel<L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L> Copy for SupportedKernel<L> {}

impl<L: Lanes> BatchKernel for SupportedKernel<L> {
    #[inline(always)]
    fn pull(self, input: BatchInput, links: &LinkBatch) -> Option<Vec3> {
        // SAFETY: this type exists only if the processor has the instructions.
        unsafe { L::pull_batch(input, links) }
    }
}

struct BatchWork<W>(W);

impl<W: WithBatches> WithLanes for BatchWork<W> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        self.0.run(SupportedKernel::<L>(PhantomData));
    }
}

impl ChosenKernel {
    /// Runs `work` with the kernel's implementation of batches.
    #[inline]
    pub(crate) fn run_with_batches(self, work: impl WithBatches) {
        self.run_with_lanes(BatchWork(work));
    }
}

/// Processes the links sequentially. The result is bitwise identical on every processor.
#[inline(always)]
pub(super) fn pull_sequentially(input: BatchInput, links: &LinkBatch) -> Option<Vec3> {
    let [x, y, z] = input.positions;
    let mut sum = Vec3::ZERO;
    for &[neighbor, stiffness, rest_length] in links {
        let neighbor = neighbor as usize;
        let edge = Vec3::new(x[neighbor], y[neighbor], z[neighbor]) - input.here;
        let length = edge.length_squared().sqrt();
        let [stiffness, rest_length] = [stiffness, rest_length].map(f32::from_bits);
        sum += edge * (stiffness * (length - rest_length) / length);
    }
    (!sum.is_nan()).then_some(sum)
}
