//! SIMD: kernels are written once, compiled for each instruction set, and selected at run time.
#![allow(unsafe_code)]

pub(crate) mod algebra;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod lanes;
mod link_batches;
#[cfg(all(target_arch = "aarch64", target_endian = "little"))]
mod neon;
mod portable;
mod prefetch;
mod range;
mod real;

pub(crate) use lanes::{Index, Lanes};
pub(crate) use link_batches::{BatchInput, BatchKernel, LinkBatch, WithBatches};
pub(crate) use prefetch::prefetch;
pub(crate) use range::Range;
use range::Ranges;
pub(crate) use real::{InLanes, Real};

use crate::base::{Error, Result};

/// A vector with one number of padding, so that it never crosses a cache line.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Record(pub [f32; 4]);

/// The SIMD level: the widest instructions that kernels use.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// let fallen = |kernel| {
///     let mut world = World::new(WorldDefinition { kernel, ..WorldDefinition::default() })?;
///     let body = world.create_body(&cloth)?;
///     world.step(1.0 / 60.0)?;
///     world.body(body).map(|body| body.positions()[0])
/// };
/// assert!(fallen(Kernel::Best)?.distance(fallen(Kernel::Portable)?) < 1e-6);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kernel {
    /// The widest instructions that the processor supports.
    #[default]
    Best,
    /// Sixteen lanes of x86-64's AVX-512 (F, BW, DQ, VL).
    Avx512,
    /// Eight lanes of x86-64's AVX2, with fused multiply-add.
    Avx2,
    /// Four lanes of AArch64's NEON.
    Neon,
    /// Plain code; the results are bitwise identical on every processor.
    Portable,
}

impl Kernel {
    /// Selects the kernel for this processor.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: the processor does not support it.
    pub(crate) fn choose(self) -> Result<ChosenKernel> {
        let best = [Self::Avx512, Self::Avx2, Self::Neon];
        let chosen = match self {
            Self::Best => best
                .into_iter()
                .find(|kernel| kernel.is_offered())
                .unwrap_or(Self::Portable),
            kernel => kernel,
        };
        if chosen.is_offered() {
            Ok(ChosenKernel(chosen))
        } else {
            Err(Error::Unsupported(format!(
                "kernel is {chosen:?}: this processor does not offer it"
            )))
        }
    }

    fn is_offered(self) -> bool {
        match self {
            Self::Best | Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
                    && Self::Avx2.is_offered()
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            // Every AArch64 processor has NEON.
            Self::Neon => cfg!(all(target_arch = "aarch64", target_endian = "little")),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx512 | Self::Avx2 => false,
        }
    }
}

/// A kernel that the processor supports. Only [`Kernel::choose`] creates one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ChosenKernel(Kernel);

impl ChosenKernel {
    pub(crate) fn kernel(self) -> Kernel {
        self.0
    }
}

/// Plain loops that the compiler vectorizes for a kernel.
pub(crate) trait Loops {
    type Output;

    /// Must be `#[inline(always)]`: it is compiled as part of its caller, with the caller's instructions.
    fn run(self) -> Self::Output;
}

/// Work that is generic over lanes.
pub(crate) trait WithLanes {
    type Output;

    /// Must be `#[inline(always)]`, like [`Loops::run`].
    ///
    /// # Safety
    /// The processor must have the instructions of `L`.
    unsafe fn run<L: Lanes>(self) -> Self::Output;
}

/// Adapter for plain loops, which do not use lanes.
struct PlainLoops<L>(L);

impl<L: Loops> WithLanes for PlainLoops<L> {
    type Output = L::Output;

    #[inline(always)]
    unsafe fn run<Unused: Lanes>(self) -> L::Output {
        self.0.run()
    }
}

impl ChosenKernel {
    /// Runs `loops` with the kernel's instructions.
    #[inline]
    pub(crate) fn run<L: Loops>(self, loops: L) -> L::Output {
        self.run_with_lanes(PlainLoops(loops))
    }

    /// Ranges of numbers along each axis.
    pub(crate) fn ranges(self, axes: [&[f32]; 3]) -> [Range; 3] {
        self.run_with_lanes(Ranges(axes))
    }

    /// Runs `work` with the kernel's lanes.
    #[inline]
    pub(crate) fn run_with_lanes<W: WithLanes>(self, work: W) -> W::Output {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: a kernel is selected only if the processor has its instructions.
            Kernel::Avx512 => unsafe { run_avx512(work) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: a kernel is selected only if the processor has its instructions.
            Kernel::Avx2 => unsafe { run_avx2(work) },
            #[cfg(all(target_arch = "aarch64", target_endian = "little"))]
            // SAFETY: every AArch64 processor has them.
            Kernel::Neon => unsafe { work.run::<neon::NeonLanes>() },
            // SAFETY: no special instructions.
            _ => unsafe { work.run::<portable::PortableLanes>() },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma")]
fn run_avx512<W: WithLanes>(work: W) -> W::Output {
    // SAFETY: these instructions are enabled.
    unsafe { work.run::<avx512::Avx512Lanes>() }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_avx2<W: WithLanes>(work: W) -> W::Output {
    // SAFETY: these instructions are enabled.
    unsafe { work.run::<avx2::Avx2Lanes>() }
}
