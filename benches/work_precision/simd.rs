//! Vectors of floats for the baselines: AVX-512, AVX2 or plain Rust, depending on the processor. This is the only
//! unsafe code of this bench. Code built on it is safe: a [`Vector`] is only made with a [`Proof`] that its
//! instructions are available, and records are only accessed through checked [`IndexList`]s.
#![allow(unsafe_code)]

use std::marker::PhantomData;
use std::ops::{Add, Mul, Sub};

/// Four adjacent numbers, 16 bytes: x, y, z and one more.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(16))]
pub struct Record(pub [f32; 4]);

impl Record {
    #[inline(always)]
    pub fn zip(self, other: Self, with: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|lane| with(self.0[lane], other.0[lane])))
    }
}

/// Indices of records, each below `bound`.
#[derive(Clone, Debug)]
pub struct IndexList {
    indices: Vec<u32>,
    bound: usize,
}

impl IndexList {
    pub fn new(indices: Vec<u32>) -> Self {
        let bound = indices.iter().max().map_or(0, |&index| index as usize + 1);
        Self { indices, bound }
    }

    pub fn as_slice(&self) -> &[u32] {
        &self.indices
    }

    /// `count` indices from `at` on, for this many records after the offset.
    #[inline(always)]
    fn checked(&self, at: usize, count: usize, records: usize) -> *const u32 {
        assert!(self.bound <= records, "an index below the number of records");
        self.indices[at..at + count].as_ptr()
    }
}

/// Proof that a vector's instructions are available.
#[derive(Clone, Copy)]
pub struct Proof<V>(PhantomData<V>);

/// Several floats that are processed together.
pub trait Vector: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    const COUNT: usize;

    fn splat(proof: Proof<Self>, value: f32) -> Self;
    /// Loads the first [`Self::COUNT`] numbers.
    fn load(proof: Proof<Self>, from: &[f32]) -> Self;
    /// `self * factor + term`
    fn mul_add(self, factor: Self, term: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn divided_by(self, divisor: Self) -> Self;
    /// 1 over the square root, to within one or two units in the last place.
    fn inverse_root(self) -> Self;

    /// Gathers records at [`Self::COUNT`] indices from `at` on, relative to `offset`, as vectors of components.
    fn load_records(proof: Proof<Self>, records: &[Record], indices: &IndexList, at: usize, offset: usize)
    -> [Self; 4];
    /// Scatters components to records, the inverse of `load_records`.
    fn store_records(components: [Self; 4], records: &mut [Record], indices: &IndexList, at: usize, offset: usize);

    /// The first `COUNT / 4` numbers, each four times.
    fn spread(proof: Proof<Self>, from: &[f32]) -> Self;
    /// The record, `COUNT / 4` times.
    fn repeat(proof: Proof<Self>, record: &Record) -> Self;
    /// The first `COUNT / 4` records in their order.
    fn load_adjacent(proof: Proof<Self>, from: &[Record]) -> Self;
    /// Stores `COUNT / 4` records.
    fn store_adjacent(self, to: &mut [Record]);
    /// The sum of its `COUNT / 4` records.
    fn folded(self) -> Record;
}

/// Work that is compiled once for each kind of vector. `run` must be inlined.
pub trait Kernel {
    type Output;
    fn run<V: Vector>(self, proof: Proof<V>) -> Self::Output;
}

/// Runs a kernel with the widest available vectors.
pub fn run<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if x86::has_avx512() {
            // SAFETY: the instructions are available.
            return unsafe { x86::with_avx512(kernel) };
        }
        if x86::has_avx2() {
            // SAFETY: the instructions are available.
            return unsafe { x86::with_avx2(kernel) };
        }
    }
    kernel.run(Proof::<Plain>(PhantomData))
}

/// The number of floats that [`run`] processes together.
pub fn lanes() -> usize {
    struct Count;
    impl Kernel for Count {
        type Output = usize;
        fn run<V: Vector>(self, _: Proof<V>) -> usize {
            V::COUNT
        }
    }
    run(Count)
}

/// Eight floats in plain Rust.
#[derive(Clone, Copy)]
pub struct Plain([f32; 8]);

impl Plain {
    #[inline(always)]
    fn map(self, other: Self, with: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|lane| with(self.0[lane], other.0[lane])))
    }
}

impl Add for Plain {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.map(other, |a, b| a + b)
    }
}

impl Sub for Plain {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.map(other, |a, b| a - b)
    }
}

impl Mul for Plain {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.map(other, |a, b| a * b)
    }
}

impl Vector for Plain {
    const COUNT: usize = 8;

    #[inline(always)]
    fn splat(_: Proof<Self>, value: f32) -> Self {
        Self([value; 8])
    }
    #[inline(always)]
    fn load(_: Proof<Self>, from: &[f32]) -> Self {
        Self(std::array::from_fn(|lane| from[lane]))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.map(other, f32::max)
    }
    #[inline(always)]
    fn divided_by(self, divisor: Self) -> Self {
        self.map(divisor, |a, b| a / b)
    }
    #[inline(always)]
    fn inverse_root(self) -> Self {
        Self(self.0.map(|value| 1.0 / value.sqrt()))
    }
    #[inline(always)]
    fn load_records(_: Proof<Self>, records: &[Record], indices: &IndexList, at: usize, offset: usize) -> [Self; 4] {
        let gathered: [Record; 8] = std::array::from_fn(|lane| records[offset + indices.indices[at + lane] as usize]);
        std::array::from_fn(|component| Self(std::array::from_fn(|lane| gathered[lane].0[component])))
    }
    #[inline(always)]
    fn store_records(components: [Self; 4], records: &mut [Record], indices: &IndexList, at: usize, offset: usize) {
        for lane in 0..8 {
            let record = std::array::from_fn(|component| components[component].0[lane]);
            records[offset + indices.indices[at + lane] as usize] = Record(record);
        }
    }
    #[inline(always)]
    fn spread(_: Proof<Self>, from: &[f32]) -> Self {
        Self(std::array::from_fn(|lane| from[lane / 4]))
    }
    #[inline(always)]
    fn repeat(_: Proof<Self>, record: &Record) -> Self {
        Self(std::array::from_fn(|lane| record.0[lane % 4]))
    }
    #[inline(always)]
    fn load_adjacent(_: Proof<Self>, from: &[Record]) -> Self {
        Self(std::array::from_fn(|lane| from[lane / 4].0[lane % 4]))
    }
    #[inline(always)]
    fn store_adjacent(self, to: &mut [Record]) {
        for lane in 0..8 {
            to[lane / 4].0[lane % 4] = self.0[lane];
        }
    }
    #[inline(always)]
    fn folded(self) -> Record {
        Record(std::array::from_fn(|lane| self.0[lane] + self.0[lane + 4]))
    }
}

/// The vectors of x86-64.
#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;
    use std::array::from_fn;
    use std::marker::PhantomData;
    use std::ops::{Add, Mul, Sub};

    use super::{IndexList, Kernel, Proof, Record, Vector};

    pub fn has_avx512() -> bool {
        is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") && has_avx2()
    }

    pub fn has_avx2() -> bool {
        is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
    }

    #[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
    pub fn with_avx512<K: Kernel>(kernel: K) -> K::Output {
        kernel.run(Proof::<Sixteen>(PhantomData))
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
        kernel.run(Proof::<Eight>(PhantomData))
    }

    /// Sixteen floats of AVX-512.
    #[derive(Clone, Copy)]
    pub struct Sixteen(__m512);

    /// Eight floats of AVX2.
    #[derive(Clone, Copy)]
    pub struct Eight(__m256);

    /// Defines an operator by `$with` on the contents of two vectors.
    macro_rules! arithmetic {
        ($vector:ident, $trait:ident, $name:ident, $with:ident) => {
            impl $trait for $vector {
                type Output = Self;
                #[inline(always)]
                fn $name(self, other: Self) -> Self {
                    // SAFETY: a vector is only made with the proof that its instructions are available.
                    Self(unsafe { $with(self.0, other.0) })
                }
            }
        };
    }
    arithmetic!(Sixteen, Add, add, _mm512_add_ps);
    arithmetic!(Sixteen, Sub, sub, _mm512_sub_ps);
    arithmetic!(Sixteen, Mul, mul, _mm512_mul_ps);
    arithmetic!(Eight, Add, add, _mm256_add_ps);
    arithmetic!(Eight, Sub, sub, _mm256_sub_ps);
    arithmetic!(Eight, Mul, mul, _mm256_mul_ps);

    // SAFETY of every block: a vector or a proof shows that the instructions are available. Slices are as long as the
    // read or written range, and indices were checked. No load or store requires more than the alignment of its
    // numbers.
    #[allow(clippy::undocumented_unsafe_blocks)]
    impl Vector for Sixteen {
        const COUNT: usize = 16;

        #[inline(always)]
        fn splat(_: Proof<Self>, value: f32) -> Self {
            Self(unsafe { _mm512_set1_ps(value) })
        }
        #[inline(always)]
        fn load(_: Proof<Self>, from: &[f32]) -> Self {
            Self(unsafe { _mm512_loadu_ps(from[..16].as_ptr()) })
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            Self(unsafe { _mm512_fmadd_ps(self.0, factor.0, term.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Self(unsafe { _mm512_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn divided_by(self, divisor: Self) -> Self {
            Self(unsafe { _mm512_div_ps(self.0, divisor.0) })
        }
        #[inline(always)]
        fn inverse_root(self) -> Self {
            unsafe {
                let root = _mm512_rsqrt14_ps(self.0);
                let half = _mm512_mul_ps(_mm512_mul_ps(_mm512_set1_ps(0.5), self.0), root);
                let correction = _mm512_fnmadd_ps(half, root, _mm512_set1_ps(1.5));
                Self(_mm512_mul_ps(root, correction))
            }
        }
        #[inline(always)]
        fn load_records(
            _: Proof<Self>,
            records: &[Record],
            indices: &IndexList,
            at: usize,
            offset: usize,
        ) -> [Self; 4] {
            unsafe {
                let indices = indices.checked(at, 16, records.len() - offset);
                let record =
                    |lane: usize| _mm_load_ps(records.as_ptr().add(offset + *indices.add(lane) as usize).cast());
                // Row r holds records r, 4 + r, 8 + r and 12 + r; after transposing each quarter, lanes are in order.
                let row = |r: usize| {
                    let low = _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(record(r)), record(4 + r));
                    let high = _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(record(8 + r)), record(12 + r));
                    _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high)
                };
                transposed(from_fn(row)).map(Self)
            }
        }
        #[inline(always)]
        fn store_records(components: [Self; 4], records: &mut [Record], indices: &IndexList, at: usize, offset: usize) {
            unsafe {
                let indices = indices.checked(at, 16, records.len() - offset);
                let base = records.as_mut_ptr().add(offset);
                let rows = transposed(components.map(|component| component.0));
                for (r, row) in rows.into_iter().enumerate() {
                    let to = |lane: usize| base.add(*indices.add(lane) as usize).cast();
                    _mm_store_ps(to(r), _mm512_castps512_ps128(row));
                    _mm_store_ps(to(4 + r), _mm512_extractf32x4_ps::<1>(row));
                    _mm_store_ps(to(8 + r), _mm512_extractf32x4_ps::<2>(row));
                    _mm_store_ps(to(12 + r), _mm512_extractf32x4_ps::<3>(row));
                }
            }
        }
        #[inline(always)]
        fn spread(_: Proof<Self>, from: &[f32]) -> Self {
            unsafe {
                let each = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
                let four = _mm512_castps128_ps512(_mm_loadu_ps(from[..4].as_ptr()));
                Self(_mm512_permutexvar_ps(each, four))
            }
        }
        #[inline(always)]
        fn repeat(_: Proof<Self>, record: &Record) -> Self {
            Self(unsafe { _mm512_broadcast_f32x4(_mm_load_ps(record.0.as_ptr())) })
        }
        #[inline(always)]
        fn load_adjacent(_: Proof<Self>, from: &[Record]) -> Self {
            Self(unsafe { _mm512_loadu_ps(from[..4].as_ptr().cast()) })
        }
        #[inline(always)]
        fn store_adjacent(self, to: &mut [Record]) {
            unsafe { _mm512_storeu_ps(to[..4].as_mut_ptr().cast(), self.0) }
        }
        #[inline(always)]
        fn folded(self) -> Record {
            let mut record = Record::default();
            unsafe {
                let halves = _mm256_add_ps(_mm512_castps512_ps256(self.0), _mm512_extractf32x8_ps::<1>(self.0));
                let sum = _mm_add_ps(_mm256_castps256_ps128(halves), _mm256_extractf128_ps::<1>(halves));
                _mm_store_ps(record.0.as_mut_ptr(), sum);
            }
            record
        }
    }

    // SAFETY of every block: as in `Vector for Sixteen`.
    #[allow(clippy::undocumented_unsafe_blocks)]
    impl Vector for Eight {
        const COUNT: usize = 8;

        #[inline(always)]
        fn splat(_: Proof<Self>, value: f32) -> Self {
            Self(unsafe { _mm256_set1_ps(value) })
        }
        #[inline(always)]
        fn load(_: Proof<Self>, from: &[f32]) -> Self {
            Self(unsafe { _mm256_loadu_ps(from[..8].as_ptr()) })
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            Self(unsafe { _mm256_fmadd_ps(self.0, factor.0, term.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Self(unsafe { _mm256_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn divided_by(self, divisor: Self) -> Self {
            Self(unsafe { _mm256_div_ps(self.0, divisor.0) })
        }
        #[inline(always)]
        fn inverse_root(self) -> Self {
            unsafe {
                let root = _mm256_rsqrt_ps(self.0);
                let half = _mm256_mul_ps(_mm256_mul_ps(_mm256_set1_ps(0.5), self.0), root);
                let correction = _mm256_fnmadd_ps(half, root, _mm256_set1_ps(1.5));
                Self(_mm256_mul_ps(root, correction))
            }
        }
        #[inline(always)]
        fn load_records(
            _: Proof<Self>,
            records: &[Record],
            indices: &IndexList,
            at: usize,
            offset: usize,
        ) -> [Self; 4] {
            unsafe {
                let indices = indices.checked(at, 8, records.len() - offset);
                let record =
                    |lane: usize| _mm_load_ps(records.as_ptr().add(offset + *indices.add(lane) as usize).cast());
                let row = |r: usize| _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(record(r)), record(4 + r));
                transposed_halves(from_fn(row)).map(Self)
            }
        }
        #[inline(always)]
        fn store_records(components: [Self; 4], records: &mut [Record], indices: &IndexList, at: usize, offset: usize) {
            unsafe {
                let indices = indices.checked(at, 8, records.len() - offset);
                let base = records.as_mut_ptr().add(offset);
                let rows = transposed_halves(components.map(|component| component.0));
                for (r, row) in rows.into_iter().enumerate() {
                    let to = |lane: usize| base.add(*indices.add(lane) as usize).cast();
                    _mm_store_ps(to(r), _mm256_castps256_ps128(row));
                    _mm_store_ps(to(4 + r), _mm256_extractf128_ps::<1>(row));
                }
            }
        }
        #[inline(always)]
        fn spread(_: Proof<Self>, from: &[f32]) -> Self {
            unsafe {
                let [low, high] = [_mm_broadcast_ss(&from[0]), _mm_broadcast_ss(&from[1])];
                Self(_mm256_insertf128_ps::<1>(_mm256_castps128_ps256(low), high))
            }
        }
        #[inline(always)]
        fn repeat(_: Proof<Self>, record: &Record) -> Self {
            let record = unsafe { _mm_load_ps(record.0.as_ptr()) };
            Self(unsafe { _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(record), record) })
        }
        #[inline(always)]
        fn load_adjacent(_: Proof<Self>, from: &[Record]) -> Self {
            Self(unsafe { _mm256_loadu_ps(from[..2].as_ptr().cast()) })
        }
        #[inline(always)]
        fn store_adjacent(self, to: &mut [Record]) {
            unsafe { _mm256_storeu_ps(to[..2].as_mut_ptr().cast(), self.0) }
        }
        #[inline(always)]
        fn folded(self) -> Record {
            let mut record = Record::default();
            unsafe {
                let sum = _mm_add_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
                _mm_store_ps(record.0.as_mut_ptr(), sum);
            }
            record
        }
    }

    /// Transposes four by four numbers in each quarter.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn transposed([a, b, c, d]: [__m512; 4]) -> [__m512; 4] {
        let [ab, cd] = [_mm512_unpacklo_ps(a, b), _mm512_unpacklo_ps(c, d)];
        let [ab_high, cd_high] = [_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d)];
        [
            _mm512_shuffle_ps::<0b01_00_01_00>(ab, cd),
            _mm512_shuffle_ps::<0b11_10_11_10>(ab, cd),
            _mm512_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
            _mm512_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
        ]
    }

    /// Transposes four by four numbers in each half.
    #[inline]
    #[target_feature(enable = "avx")]
    fn transposed_halves([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
        let [ab, cd] = [_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d)];
        let [ab_high, cd_high] = [_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d)];
        [
            _mm256_shuffle_ps::<0b01_00_01_00>(ab, cd),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab, cd),
            _mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
        ]
    }
}
