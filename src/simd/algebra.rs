//! Vectors and matrices with one value per lane.
// SAFETY of every function: the processor must have the instructions of `L`.
#![allow(clippy::undocumented_unsafe_blocks)]
// No closures: they may be compiled separately, without the kernel's instructions.

use super::Lanes;

/// One vector per lane.
pub type Vector<L> = [L; 3];

/// Columns of a matrix.
pub type Matrix3<L> = [Vector<L>; 3];

/// Entries 00, 01, 02, 11, 12, 22 of a triangular or symmetric matrix.
pub type Six<L> = [L; 6];

#[inline(always)]
pub unsafe fn dot<L: Lanes>([ax, ay, az]: Vector<L>, [bx, by, bz]: Vector<L>) -> L {
    unsafe { az.mul_add(bz, ay.mul_add(by, ax.mul(bx))) }
}

#[inline(always)]
pub unsafe fn scaled<L: Lanes>(vector: Vector<L>, factor: L) -> Vector<L> {
    unsafe { [vector[0].mul(factor), vector[1].mul(factor), vector[2].mul(factor)] }
}

/// `sum + vector * factor`
#[inline(always)]
pub unsafe fn add_scaled<L: Lanes>(sum: Vector<L>, vector: Vector<L>, factor: L) -> Vector<L> {
    unsafe {
        [
            vector[0].mul_add(factor, sum[0]),
            vector[1].mul_add(factor, sum[1]),
            vector[2].mul_add(factor, sum[2]),
        ]
    }
}

#[inline(always)]
pub unsafe fn difference<L: Lanes>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    unsafe { [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])] }
}

#[inline(always)]
pub unsafe fn sum<L: Lanes>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    unsafe { [a[0].add(b[0]), a[1].add(b[1]), a[2].add(b[2])] }
}

#[inline(always)]
pub unsafe fn cross<L: Lanes>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    unsafe {
        [
            a[1].mul_sub(b[2], a[2].mul(b[1])),
            a[2].mul_sub(b[0], a[0].mul(b[2])),
            a[0].mul_sub(b[1], a[1].mul(b[0])),
        ]
    }
}

/// Product of a matrix and an upper triangular matrix.
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

/// Product of a matrix and the transpose of an upper triangular matrix.
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

/// `sum` plus the product of a matrix and a symmetric matrix.
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
pub unsafe fn times_vector<L: Lanes>([a, b, c]: Matrix3<L>, vector: Vector<L>) -> Vector<L> {
    unsafe { add_scaled(add_scaled(scaled(a, vector[0]), b, vector[1]), c, vector[2]) }
}

/// Product of a matrix and its transpose.
#[inline(always)]
pub unsafe fn times_transposed<L: Lanes>([a, b, c]: Matrix3<L>) -> Matrix3<L> {
    unsafe {
        let zero = [[L::splat(0.0); 3]; 3];
        add_outer(add_outer(add_outer(zero, a, a), b, b), c, c)
    }
}

/// `sum + a * b^T`
#[inline(always)]
pub unsafe fn add_outer<L: Lanes>(sum: Matrix3<L>, a: Vector<L>, b: Vector<L>) -> Matrix3<L> {
    unsafe {
        [
            add_scaled(sum[0], a, b[0]),
            add_scaled(sum[1], a, b[1]),
            add_scaled(sum[2], a, b[2]),
        ]
    }
}

/// The matrix plus a multiple of the identity.
#[inline(always)]
pub unsafe fn add_identity<L: Lanes>([[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]: Matrix3<L>, factor: L) -> Matrix3<L> {
    unsafe {
        [
            [xx.add(factor), xy, xz],
            [yx, yy.add(factor), yz],
            [zx, zy, zz.add(factor)],
        ]
    }
}

/// The matrix plus the one that crosses `vector` with others.
#[inline(always)]
pub unsafe fn add_skew<L: Lanes>([a, b, c]: Matrix3<L>, [x, y, z]: Vector<L>) -> Matrix3<L> {
    unsafe {
        [
            [a[0], a[1].add(z), a[2].sub(y)],
            [b[0].sub(z), b[1], b[2].add(x)],
            [c[0].add(y), c[1].sub(x), c[2]],
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
            a.mul(factor),
            b.mul(factor),
            c.mul(factor),
            d.mul(factor),
            e.mul(factor),
            f.mul(factor),
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

/// Upper bound of the eigenvalue magnitudes of a symmetric matrix (Gershgorin).
#[inline(always)]
pub unsafe fn largest<L: Lanes>([xx, xy, xz, yy, yz, zz]: Six<L>) -> L {
    unsafe {
        let (xy, xz, yz) = (xy.abs(), xz.abs(), yz.abs());
        let rows = [
            xx.abs().add(xy).add(xz),
            yy.abs().add(xy).add(yz),
            zz.abs().add(xz).add(yz),
        ];
        rows[0].max(rows[1]).max(rows[2])
    }
}
