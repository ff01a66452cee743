//! The origin of a body's local coordinates. It is near the body, so that `f32` resolves small motions anywhere in the
//! world.

use glam::DVec3;

use crate::geometry::Aabb;

/// The smallest grid spacing of origins, m. A body with one node has no extent.
const SMALLEST_GRID: f64 = 1.0 / 1024.0;

/// The shift that moves the origin near the bounds; zero if it is near enough.
///
/// The shift is a multiple of a power of two that is at least the body's extent. It is made only if the center of the
/// body is at least that far away. Every coordinate minus the shift is then exact in `f32`, so that moving the origin
/// changes no position.
pub(crate) fn shift_towards(bounds: Aabb) -> DVec3 {
    let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
    let extent = (max - min).max_element().max(SMALLEST_GRID);
    let grid = power_of_two_from(extent);
    let steps = (min + max) * 0.5 / grid;
    let far = steps.abs().cmpge(DVec3::ONE);
    DVec3::select(far, steps.round() * grid, DVec3::ZERO)
}

/// The smallest power of two that is at least `value`, a positive normal number.
fn power_of_two_from(value: f64) -> f64 {
    let mantissa = (1_u64 << 52) - 1;
    let bits = value.to_bits();
    let floor = f64::from_bits(bits & !mantissa);
    if bits & mantissa == 0 { floor } else { 2.0 * floor }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use glam::Vec3;

    #[test]
    fn local_coordinates_are_exact() {
        // Offsets over many magnitudes, bodies over many extents.
        let mut numbers = Random(1);
        let mut random = || numbers.unit();
        for _ in 0..2000 {
            let extent = 10_f32.powf(4.0 * random() - 3.0);
            let offset = Vec3::new(random(), random(), random()) * 10_f32.powf(8.0 * random() - 3.0);
            let points: Vec<Vec3> = (0..20)
                .map(|_| offset + extent * Vec3::new(random(), random(), random()))
                .collect();
            let bounds = Aabb::of(points.iter().copied());
            let origin = shift_towards(bounds);
            for point in points {
                let local = (point.as_dvec3() - origin).as_vec3();
                assert_eq!(local.as_dvec3() + origin, point.as_dvec3());
                let reach =
                    1.5 * power_of_two_from(f64::from((bounds.max - bounds.min).max_element()).max(SMALLEST_GRID));
                assert!(
                    f64::from(local.abs().max_element()) <= reach,
                    "{local} of extent {extent}"
                );
            }
        }
    }
}
