//! DISTANCE_FIELD detection: signed distances of a solid on a grid, sampled once with EXACT.
//!
//! Distances are interpolated trilinearly. The error is second order in the cell size where the distance is smooth,
//! and first order at features sharper than a cell. The closest point of an edge or face is searched on the grid
//! (Macklin et al. 2020, Local Optimization for Robust Signed Distance Field Collision).

use glam::{UVec3, Vec3};

use super::closest::Closest;
use super::exact::ExactSolid;
use crate::base::{Result, ensure, memory};
use crate::geometry::Aabb;

/// Default number of cells along the longest side of a solid.
const DEFAULT_CELLS: f32 = 64.0;

/// Number of cells around a solid on each side.
const MARGIN: f32 = 3.0;

/// Maximum number of samples: 64 MiB.
const SAMPLES: u64 = 1 << 24;

/// Maximum number of initial intervals of an edge, and of a side of a face.
const MAX_INTERVALS: u32 = 24;
const MAX_INTERVALS_OF_SIDE: u32 = 8;

/// Number of times that a search then halves its step.
const HALVINGS: u32 = 8;

/// Largest weight at which a point counts as lying on a feature's border, the resolution of the search.
const BORDER: f32 = 1e-4;

/// Signed distances at the corners of grid cells.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::mesh::{ClosedSurface, Mesh};
/// # let mesh = Mesh::block([0.1, 0.1, 0.1], [2, 2, 2])?;
/// # let triangles = mesh.surface()?;
/// use sinew::detection::distance_field::DistanceField;
/// let field = DistanceField::new(&ClosedSurface::new(&mesh.positions, &triangles)?, 0.005)?;
/// // 1 cm above the cube's upper side, and in its middle.
/// assert!((field.distance(0.06 * Vec3::Y) - 0.01).abs() < 0.001);
/// assert!(field.distance(Vec3::ZERO) < -0.045);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct DistanceField {
    low: Vec3,
    cell: f32,
    counts: UVec3,
    distances: Vec<f32>,
    /// Bounding box of the solid.
    bounds: Aabb,
}

impl DistanceField {
    /// Samples a solid with cells of this size, m; 0 selects 1/64 of its longest side.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the cell size is negative, not finite, or so small that more than 16.8 million
    /// samples are needed; [`Error::OutOfMemory`].
    pub(crate) fn of(solid: &ExactSolid, cell: f32) -> Result<Self> {
        ensure!(
            cell >= 0.0 && cell.is_finite(),
            "cell is {cell} m: must be finite and at least 0"
        );
        let bounds = solid.bounds();
        let sides = bounds.max - bounds.min;
        let cell = if cell > 0.0 {
            cell
        } else {
            sides.max_element() / DEFAULT_CELLS
        };
        let along = (sides / cell).ceil() + 2.0 * MARGIN + 1.0;
        let samples = along.as_dvec3().element_product();
        ensure!(
            samples <= SAMPLES as f64,
            "cell is {cell} m: a solid of {} x {} x {} m would take {samples:.0} samples, at most {SAMPLES} are possible",
            sides.x,
            sides.y,
            sides.z
        );
        let counts = along.as_uvec3();
        let mut field = Self {
            low: bounds.min - MARGIN * cell,
            cell,
            counts,
            distances: memory::reserved(samples as usize)?,
            bounds,
        };
        for z in 0..counts.z {
            for y in 0..counts.y {
                for x in 0..counts.x {
                    let point = field.low + UVec3::new(x, y, z).as_vec3() * cell;
                    let measured = solid.measure(point, f32::INFINITY);
                    field
                        .distances
                        .push(measured.map_or(f32::INFINITY, |(distance, _)| distance));
                }
            }
        }
        Ok(field)
    }

    /// Samples a solid with cells of this size, m; 0 selects 1/64 of its longest side.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument) if the cell size is negative, not finite, or so
    /// small that more than 16.8 million samples are needed; [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn new(surface: &crate::mesh::ClosedSurface, cell: f32) -> Result<Self> {
        Self::of(&ExactSolid::new(surface)?, cell)
    }

    /// True if a sample is deeper inside than `depth`, m.
    pub(super) fn has_interior(&self, depth: f32) -> bool {
        self.distances.iter().any(|&distance| distance < -depth)
    }

    /// Returns the size of a cell, m.
    pub fn cell(&self) -> f32 {
        self.cell
    }

    /// Returns the closest point of a node, edge or face (1, 2 or 3 corners); `None` if it is further outside than
    /// `within`.
    pub(crate) fn closest(&self, corners: &[Vec3], within: f32) -> Option<Closest> {
        let count = corners.len();
        let weight = 1.0 / count as f32;
        let middle = corners.iter().sum::<Vec3>() * weight;
        let radius = corners
            .iter()
            .fold(0.0_f32, |radius, corner| radius.max(corner.distance(middle)));
        let reach = within + radius;
        let offset = (self.bounds.min - middle).max(middle - self.bounds.max).max(Vec3::ZERO);
        if offset.length_squared() > reach * reach * 1.000_01 {
            return None;
        }
        // Interpolated distances have an error of less than a cell.
        if self.distance(middle) > reach + self.cell {
            return None;
        }
        let weights = match count {
            1 => [1.0, 0.0, 0.0],
            2 => self.least_of_edge([corners[0], corners[1]]),
            3 => self.least_of_face([corners[0], corners[1], corners[2]]),
            _ => return None,
        };
        let point = corners
            .iter()
            .zip(weights)
            .map(|(corner, weight)| *corner * weight)
            .sum();
        let (distance, gradient) = self.measure(point);
        if !(distance <= within) {
            return None;
        }
        Some(Closest {
            weights,
            distance,
            normal: gradient.normalize_or(Vec3::Y),
            inside: weights[..count].iter().all(|&weight| weight > BORDER),
        })
    }

    /// Returns the signed distance of a point, m.
    pub fn distance(&self, point: Vec3) -> f32 {
        self.measure(point).0
    }

    /// Returns the signed distance of a point and its gradient.
    pub fn measure(&self, point: Vec3) -> (f32, Vec3) {
        let last = self.low + (self.counts - 1).as_vec3() * self.cell;
        let inside = point.clamp(self.low, last);
        let (distance, gradient) = self.interpolate(inside);
        if inside == point {
            return (distance, gradient);
        }
        // Beyond the grid: the distance from the surface point closest to the grid's border.
        let offset = point - (inside - gradient.normalize_or_zero() * distance);
        (offset.length(), offset)
    }

    fn interpolate(&self, point: Vec3) -> (f32, Vec3) {
        let position = (point - self.low) / self.cell;
        let first = position.floor().max(Vec3::ZERO).as_uvec3().min(self.counts - 2);
        let fraction = position - first.as_vec3();
        let row = self.counts.x as usize;
        let layer = row * self.counts.y as usize;
        let start = first.z as usize * layer + first.y as usize * row + first.x as usize;
        let at = |offset: usize| self.distances[start + offset];
        let mix = |a: f32, b: f32, fraction: f32| a + (b - a) * fraction;
        let along = |offset: usize| (mix(at(offset), at(offset + 1), fraction.x), at(offset + 1) - at(offset));
        let (near, far) = ([along(0), along(row)], [along(layer), along(layer + row)]);
        let plane = |[a, b]: [(f32, f32); 2]| (mix(a.0, b.0, fraction.y), mix(a.1, b.1, fraction.y), b.0 - a.0);
        let (near, far) = (plane(near), plane(far));
        let gradient = Vec3::new(
            mix(near.1, far.1, fraction.z),
            mix(near.2, far.2, fraction.z),
            far.0 - near.0,
        );
        (mix(near.0, far.0, fraction.z), gradient / self.cell)
    }

    /// Returns the closest point of an edge: the least of samples a cell apart, refined by halving the step.
    fn least_of_edge(&self, [a, b]: [Vec3; 2]) -> [f32; 3] {
        let interval_count = ((a.distance(b) / self.cell).ceil() as u32).clamp(2, MAX_INTERVALS);
        let mut width = 1.0 / interval_count as f32;
        let mut best = (f32::INFINITY, 0.0);
        let consider = |along: f32, best: &mut (f32, f32)| {
            let here = self.distance(a.lerp(b, along));
            if here < best.0 {
                *best = (here, along);
            }
        };
        for index in 0..=interval_count {
            consider(index as f32 * width, &mut best);
        }
        for _ in 0..HALVINGS {
            width *= 0.5;
            let center = best.1;
            consider((center - width).max(0.0), &mut best);
            consider((center + width).min(1.0), &mut best);
        }
        [1.0 - best.1, best.1, 0.0]
    }

    /// As [`DistanceField::least_of_edge`], over a face, with steps toward and away from each corner.
    fn least_of_face(&self, corners: [Vec3; 3]) -> [f32; 3] {
        let [a, b, c] = corners;
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let interval_count = ((longest / self.cell).ceil() as u32).clamp(3, MAX_INTERVALS_OF_SIDE);
        let mut width = 1.0 / interval_count as f32;
        let mut best = (f32::INFINITY, [1.0, 0.0, 0.0]);
        let consider = |weights: [f32; 3], best: &mut (f32, [f32; 3])| {
            let here = self.distance(a * weights[0] + b * weights[1] + c * weights[2]);
            if here < best.0 {
                *best = (here, weights);
            }
        };
        for i in 0..=interval_count {
            for j in 0..=interval_count - i {
                let (u, v) = (i as f32 * width, j as f32 * width);
                consider([(1.0 - u - v).max(0.0), u, v], &mut best);
            }
        }
        for _ in 0..HALVINGS {
            width *= 0.5;
            let center = best.1;
            for (from, to) in [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)] {
                let step = width.min(center[from]);
                let mut weights = center;
                weights[from] -= step;
                weights[to] += step;
                consider(weights, &mut best);
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::exact::tests::{cube, sphere};
    use crate::random::Random;

    /// Returns the largest error against EXACT for points up to 5 mm outside a sphere of 0.05 m.
    fn error(cell: f32) -> f64 {
        let solid = ExactSolid::new(&sphere(96)).expect("a solid");
        let field = DistanceField::of(&solid, cell).expect("a field");
        let mut random = Random(3);
        let mut largest = 0.0_f64;
        for _ in 0..2000 {
            let point = random.vector().normalize_or(Vec3::X) * (0.05 + 0.005 * random.unit());
            let (exact, normal) = solid.measure(point, f32::INFINITY).expect("a distance");
            let result = field.closest(&[point], 0.1).expect("a distance");
            largest = largest.max(f64::from(result.distance - exact).abs());
            assert!(
                result.normal.dot(normal) > 0.98,
                "{point}: {} for {normal}",
                result.normal
            );
        }
        largest
    }

    #[test]
    fn the_error_is_of_second_order() {
        let errors = [0.008, 0.004, 0.002].map(error);
        // Two second derivatives are 1 / 0.05 m; the mesh turns by 2 pi / 96 from face to face.
        for (error, cell) in errors.iter().zip([0.008_f64, 0.004, 0.002]) {
            assert!(
                *error < cell * cell / 8.0 * 2.0 / 0.05 * 1.5 + 0.065 * cell / 4.0,
                "{error} with cells of {cell}"
            );
        }
        assert!(errors[0] > 2.5 * errors[1], "{errors:?}");
    }

    #[test]
    fn features_are_found_as_by_exact() {
        let solid = ExactSolid::new(&cube()).expect("a solid");
        let field = DistanceField::of(&solid, 0.0).expect("a field");
        let cell = field.cell();
        let mut random = Random(9);
        let mut found = 0;
        for turn in 0..2000 {
            let count = 1 + turn % 3;
            let first = random.vector() * 0.06;
            let corners = [first, first + random.vector() * 0.02, first + random.vector() * 0.02];
            let corners = &corners[..count];
            let within = 0.01;
            let (told, exact) = (field.closest(corners, within), solid.closest(corners, within));
            if let Some(exact) = exact
                && exact.inside
                && exact.distance < within - cell
            {
                let told = told.expect("something near");
                assert!(
                    (told.distance - exact.distance).abs() < 0.6 * cell,
                    "{corners:?}: {told:?} for {exact:?}"
                );
                found += 1;
            }
            if let Some(told) = told {
                let point = corners
                    .iter()
                    .zip(told.weights)
                    .map(|(corner, weight)| *corner * weight)
                    .sum();
                let (exact, _) = solid.measure(point, f32::INFINITY).expect("a distance");
                assert!((told.distance - exact).abs() < 0.6 * cell);
            }
        }
        assert!(found > 300, "{found}");
        // Far from the grid, distances are exact up to the error at its border.
        let far = field.closest(&[Vec3::new(0.3, 0.0, 0.0)], 0.5).expect("within 0.5 m");
        assert!((far.distance - 0.26).abs() < cell && far.normal.x > 0.99);
        assert!(field.closest(&[Vec3::new(0.3, 0.0, 0.0)], 0.2).is_none());
    }

    #[test]
    fn too_many_samples_are_refused() {
        let solid = ExactSolid::new(&cube()).expect("a solid");
        for (cell, says) in [
            (1e-5, "at most 16777216"),
            (-1.0, "cell is -1 m"),
            (f32::NAN, "cell is NaN m"),
        ] {
            let error = DistanceField::of(&solid, cell).expect_err("refused").to_string();
            assert!(error.contains(says), "{error}");
        }
    }
}
