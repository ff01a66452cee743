//! Vectors and matrices of which each lane has one.
// SAFETY of every function here: the processor has the instructions of `L`.
#![allow(clippy::undocumented_unsafe_blocks)]
// No closures: one may be compiled on its own, without the kernel's instructions.

use super::Lanes;

/// A vector per lane.
pub type Vector<L> = [L; 3];

/// The columns of a matrix.
pub type Matrix3<L> = [Vector<L>; 3];

/// The entries 00, 01, 02, 11, 12, 22 of a triangular or symmetric matrix.
pub type Six<L> = [L; 6];

#[inline(always)]
pub unsafe fn dot<L: Lanes>([ax, ay, az]: Vector<L>, [bx, by, bz]: Vector<L>) -> L {
    unsafe { az.multiply_add(bz, ay.multiply_add(by, ax.multiply(bx))) }
}

#[inline(always)]
pub unsafe fn scaled<L: Lanes>(vector: Vector<L>, factor: L) -> Vector<L> {
    unsafe {
        [
            vector[0].multiply(factor),
            vector[1].multiply(factor),
            vector[2].multiply(factor),
        ]
    }
}

/// `sum + vector * factor`
#[inline(always)]
pub unsafe fn add_scaled<L: Lanes>(sum: Vector<L>, vector: Vector<L>, factor: L) -> Vector<L> {
    unsafe {
        [
            vector[0].multiply_add(factor, sum[0]),
            vector[1].multiply_add(factor, sum[1]),
            vector[2].multiply_add(factor, sum[2]),
        ]
    }
}

#[inline(always)]
pub unsafe fn difference<L: Lanes>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    unsafe { [a[0].subtract(b[0]), a[1].subtract(b[1]), a[2].subtract(b[2])] }
}

#[inline(always)]
pub unsafe fn sum<L: Lanes>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    unsafe { [a[0].add(b[0]), a[1].add(b[1]), a[2].add(b[2])] }
}

#[inline(always)]
pub unsafe fn cross<L: Lanes>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    unsafe {
        [
            a[1].multiply_subtract(b[2], a[2].multiply(b[1])),
            a[2].multiply_subtract(b[0], a[0].multiply(b[2])),
            a[0].multiply_subtract(b[1], a[1].multiply(b[0])),
        ]
    }
}

/// A matrix times an upper triangular one.
#[inline(always)]
pub unsafe fn times_upper<L: Lanes>([a, b, c]: Matrix3<L>, upper: Six<L>) -> Matrix3<L> {
    unsafe {
        [
            scaled(a, upper[0]),
            add_scaled(scaled(a, upper[1]), b, upper[3]),
            add_scaled(add_scaled(scaled(a, upper[2]), b, upper[4]), c, upper[5]),
        ]
    }
}

/// A matrix times the transposed of an upper triangular one.
#[inline(always)]
pub unsafe fn times_lower<L: Lanes>([a, b, c]: Matrix3<L>, upper: Six<L>) -> Matrix3<L> {
    unsafe {
        [
            add_scaled(add_scaled(scaled(a, upper[0]), b, upper[1]), c, upper[2]),
            add_scaled(scaled(b, upper[3]), c, upper[4]),
            scaled(c, upper[5]),
        ]
    }
}

/// `sum` and a matrix times a symmetric one.
#[inline(always)]
pub unsafe fn add_times<L: Lanes>(sum: Matrix3<L>, [a, b, c]: Matrix3<L>, s: Six<L>) -> Matrix3<L> {
    unsafe {
        [
            add_scaled(add_scaled(add_scaled(sum[0], a, s[0]), b, s[1]), c, s[2]),
            add_scaled(add_scaled(add_scaled(sum[1], a, s[1]), b, s[3]), c, s[4]),
            add_scaled(add_scaled(add_scaled(sum[2], a, s[2]), b, s[4]), c, s[5]),
        ]
    }
}

#[inline(always)]
pub unsafe fn scaled_matrix<L: Lanes>([a, b, c]: Matrix3<L>, factor: L) -> Matrix3<L> {
    unsafe { [scaled(a, factor), scaled(b, factor), scaled(c, factor)] }
}

#[inline(always)]
pub unsafe fn scaled_six<L: Lanes>([a, b, c, d, e, f]: Six<L>, factor: L) -> Six<L> {
    unsafe {
        [
            a.multiply(factor),
            b.multiply(factor),
            c.multiply(factor),
            d.multiply(factor),
            e.multiply(factor),
            f.multiply(factor),
        ]
    }
}

#[inline(always)]
pub unsafe fn sum_six<L: Lanes>(a: Six<L>, b: Six<L>) -> Six<L> {
    unsafe {
        [
            a[0].add(b[0]),
            a[1].add(b[1]),
            a[2].add(b[2]),
            a[3].add(b[3]),
            a[4].add(b[4]),
            a[5].add(b[5]),
        ]
    }
}

/// No less than the largest eigenvalue of a symmetric matrix, without its sign (Gershgorin).
#[inline(always)]
pub unsafe fn largest<L: Lanes>([xx, xy, xz, yy, yz, zz]: Six<L>) -> L {
    unsafe {
        let (xy, xz, yz) = (xy.size(), xz.size(), yz.size());
        let rows = [
            xx.size().add(xy).add(xz),
            yy.size().add(xy).add(yz),
            zz.size().add(xz).add(yz),
        ];
        rows[0].greater(rows[1]).greater(rows[2])
    }
}
