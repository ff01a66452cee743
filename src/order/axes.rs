//! The axes of a lattice at one of its nodes.

use glam::{DMat3, DVec3, Vec3};

/// The largest distance from an integer multiple of the axes at which an offset counts as that multiple, in axes.
pub(super) const NEAR: f64 = 0.25;

/// The smallest height of an axis above the span of the previous ones, relative to its length.
const MIN_SINE: f64 = 0.3;

/// The largest reach of a lattice's spring, in axes.
const REACH: f64 = 4.0;

/// Three vectors. A lattice steps along the first ones; in a sheet the third is its normal.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Axes([Vec3; 3]);

impl Axes {
    /// Takes the first linearly independent offsets as axes. Returns the axes and their number.
    pub fn from_offsets(offsets: impl Iterator<Item = DVec3>) -> (Self, usize) {
        let mut axes = Self::default();
        let mut count = 0;
        for offset in offsets {
            if count < 3 && axes.height(count, offset) > MIN_SINE * offset.length() {
                axes.0[count] = offset.as_vec3();
                count += 1;
            }
        }
        axes.complete(count);
        (axes, count)
    }

    /// The map from an offset in space to one in axes; not finite if the axes are coplanar.
    pub fn inverse(&self) -> DMat3 {
        let [a, b, c] = self.0.map(|axis| axis.as_dvec3());
        DMat3::from_cols(a, b, c).inverse()
    }

    /// Refits the first `count` axes to single steps along them, if there are any, and completes the rest.
    pub fn fit(&mut self, steps: &AxisSteps, count: usize) {
        for axis in 0..count {
            if steps.counts[axis] > 0.0 {
                self.0[axis] = (steps.sums[axis] / steps.counts[axis]).as_vec3();
            }
        }
        self.complete(count);
    }

    /// The height of an offset above the span of the first axes.
    fn height(&self, count: usize, offset: DVec3) -> f64 {
        let [a, b, _] = self.0.map(|axis| axis.as_dvec3());
        match count {
            0 => offset.length(),
            1 => offset.cross(a.normalize_or_zero()).length(),
            _ => offset.dot(a.cross(b).normalize_or_zero()).abs(),
        }
    }

    /// Completes missing axes perpendicular to the first ones.
    fn complete(&mut self, count: usize) {
        if count == 0 {
            self.0[0] = Vec3::X;
        }
        let a = self.0[0].as_dvec3();
        if count < 2 {
            self.0[1] = (a.normalize_or(DVec3::X).any_orthogonal_vector().normalize() * a.length()).as_vec3();
        }
        if count < 3 {
            let normal = a.cross(self.0[1].as_dvec3()).normalize_or_zero();
            self.0[2] = (normal * a.length()).as_vec3();
        }
    }
}

/// Sums of single steps along the axes, in space.
#[derive(Default)]
pub(super) struct AxisSteps {
    sums: [DVec3; 3],
    counts: [f64; 3],
}

impl AxisSteps {
    /// Adds an offset with this integer multiple of the axes, if it is a single step.
    pub fn add(&mut self, offset: DVec3, multiple: [i32; 3]) {
        let axis = match multiple {
            [1 | -1, 0, 0] => 0,
            [0, 1 | -1, 0] => 1,
            [0, 0, 1 | -1] => 2,
            _ => return,
        };
        self.sums[axis] += offset * f64::from(multiple[axis]);
        self.counts[axis] += 1.0;
    }
}

/// The integer multiple of the axes nearest to an offset in axes. The flag is true if it is near and not 0.
pub(super) fn nearest_multiple(offset: DVec3) -> ([i32; 3], bool) {
    // Conversion of positive numbers rounds down on every processor; a rounding instruction is not available on all.
    let up = REACH + 0.5;
    let steps = offset.clamp(DVec3::splat(-REACH), DVec3::splat(REACH)) + up;
    let steps = steps.to_array().map(|step| step as i32 - REACH as i32);
    let [x, y, z] = steps.map(f64::from);
    let near = (offset - DVec3::new(x, y, z)).abs().max_element() < NEAR && steps != [0; 3];
    (steps, near)
}
