//! Features against solids with known distance.

use glam::Vec3;

use super::LayeredImage;
use crate::random::Random;

/// A box around the origin with these half extents.
fn cuboid(half: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let corner = |i: u32| half * Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32).map(|c| 2.0 * c - 1.0);
    let sides = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    ((0..8).map(corner).collect(), triangles)
}

/// The signed distance of a point from such a box.
fn distance_to_cuboid(point: Vec3, half: Vec3) -> f32 {
    let beyond = point.abs() - half;
    beyond.max(Vec3::ZERO).length() + beyond.max_element().min(0.0)
}

#[test]
fn features_are_deepest_where_sampled() {
    let half = Vec3::new(0.3, 0.2, 0.25);
    let (positions, triangles) = cuboid(half);
    let pixel = 0.01;
    let image = LayeredImage::new(&positions, &triangles, pixel).expect("a closed box");
    let mut random = Random(11);
    let mut seen = [0; 3];
    for _ in 0..400 {
        let [a, b, c] = [0; 3].map(|_| random.vector() * 0.5);
        for corners in [&[a][..], &[a, b], &[a, b, c]] {
            let within = 0.05;
            let steps = 60;
            let mut least = f32::MAX;
            for i in 0..=steps {
                for j in 0..=steps - i {
                    let (u, v) = (i as f32 / steps as f32, j as f32 / steps as f32);
                    let point = match corners.len() {
                        1 => a,
                        2 => a.lerp(b, u),
                        _ => a + (b - a) * u + (c - a) * v,
                    };
                    least = least.min(distance_to_cuboid(point, half));
                }
            }
            let result = image.closest(corners, within);
            let Some(closest) = result else {
                assert!(least > within - pixel, "{corners:?}: {least}");
                continue;
            };
            seen[corners.len() - 1] += 1;
            let weights = closest.weights;
            assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            let point = corners
                .iter()
                .zip(weights)
                .map(|(&corner, weight)| corner * weight)
                .sum::<Vec3>();
            let exact = distance_to_cuboid(point, half);
            // The result is the distance of the point found, which is as deep as any sample.
            let slack = match corners.len() {
                1 | 2 if least < -pixel => 0.25 * pixel,
                3 if least < -pixel => 0.5 * pixel,
                _ => pixel,
            };
            assert!(
                (exact - closest.distance).abs() < pixel,
                "{corners:?}: {closest:?} {exact}"
            );
            assert!(exact < least + slack, "{corners:?}: {closest:?} {exact} {least}");
            assert!((closest.normal.length() - 1.0).abs() < 1e-4);
        }
    }
    assert!(seen.iter().all(|&count| count > 50), "{seen:?}");
}
