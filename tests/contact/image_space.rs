//! Contact in image space, compared with brute force in `f64`.

use crate::support::solid::{ball, real};
use glam::{DVec3, Quat, Vec3};
use sinew::Error;
use sinew::detection::exact::Exact;
use sinew::detection::image_space::{
    Form, ImageSpace, ImageSpaceDefinition, LayeredImage, Overlap, Placed, Surface, Views,
};
use sinew::mesh::{ClosedSurface, Mesh};

/// Half the diagonal of a pixel, in pixels: the largest distance of a point from the ray at the center of its pixel.
const HALF_DIAGONAL: f64 = 0.7072;

/// A generator of pseudo-random numbers with a fixed seed (xorshift64*).
struct Random(u64);

impl Random {
    /// Returns a number from 0 to 1.
    fn unit(&mut self) -> f32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f32 / (1 << 24) as f32
    }

    /// Returns a vector with coordinates from -1 to 1.
    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    fn direction(&mut self) -> Vec3 {
        loop {
            let vector = self.vector();
            if (0.1..1.0).contains(&vector.length()) {
                return vector.normalize();
            }
        }
    }
}

/// A mesh: nodes and triangles.
#[derive(Clone)]
struct Shape {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// Returns a ball of radius 1.
    fn sphere(cuts: u32) -> Self {
        let Mesh {
            positions, triangles, ..
        } = ball(1.0, cuts);
        Self { positions, triangles }
    }

    /// Returns a ball with dents and bumps.
    fn bumpy(cuts: u32) -> Self {
        Self::sphere(cuts)
            .moved(|p| p * (1.0 + 0.15 * (5.0 * p.x).sin() * (4.0 * p.y + 1.0).cos() + 0.1 * (6.0 * p.z).sin()))
    }

    fn cuboid(low: Vec3, high: Vec3) -> Self {
        let (positions, triangles) = crate::support::solid::cuboid(low, high);
        Self { positions, triangles }
    }

    /// Returns a grid of 2 x 2 m in the plane z = 0.
    fn grid(cells: u32) -> Self {
        let row = cells + 1;
        let at =
            |i: u32| Vec3::new((i % row) as f32, (i / row) as f32, 0.0) * 2.0 / cells as f32 - Vec3::new(1.0, 1.0, 0.0);
        let squares = (0..cells * cells).map(|i| i / cells * row + i % cells);
        Self {
            positions: (0..row * row).map(at).collect(),
            triangles: squares
                .flat_map(|i| [[i, i + 1, i + row + 1], [i, i + row + 1, i + row]])
                .collect(),
        }
    }

    fn moved(mut self, change: impl Fn(Vec3) -> Vec3) -> Self {
        self.positions.iter_mut().for_each(|p| *p = change(*p));
        self
    }

    fn closed(&self) -> Surface {
        Surface::closed(self.positions.len(), &self.triangles).expect("a closed surface")
    }

    fn open(&self) -> Surface {
        Surface::open(self.positions.len(), &self.triangles).expect("a surface")
    }

    fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|node| self.positions[node as usize].as_dvec3())
    }

    fn volume(&self) -> f64 {
        let cones = self.triangles.iter().map(|&triangle| self.corners(triangle));
        cones.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    /// Returns the derivative of the volume with respect to each node.
    fn volume_gradient(&self) -> Vec<DVec3> {
        let mut gradient = vec![DVec3::ZERO; self.positions.len()];
        for &triangle in &self.triangles {
            let corners = self.corners(triangle);
            for i in 0..3 {
                gradient[triangle[i] as usize] += corners[(i + 1) % 3].cross(corners[(i + 2) % 3]) / 6.0;
            }
        }
        gradient
    }

    /// Returns the signed distance of a point from all triangles. The sign comes from the solid angle that they cover.
    fn distance(&self, point: DVec3) -> f64 {
        let (mut least, mut angle) = (f64::MAX, 0.0);
        for &triangle in &self.triangles {
            let [a, b, c] = self.corners(triangle).map(|corner| corner - point);
            least = least.min(distance_to_origin([a, b, c]));
            // The solid angle (van Oosterom and Strackee 1983).
            let [la, lb, lc] = [a, b, c].map(DVec3::length);
            let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            angle += 2.0 * a.dot(b.cross(c)).atan2(denominator);
        }
        if angle > std::f64::consts::TAU { -least } else { least }
    }
}

fn distance_to_origin([a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let sides = [(a, b), (b, c), (c, a)];
    if sides
        .iter()
        .all(|(from, to)| (*to - *from).cross(-*from).dot(normal) >= 0.0)
    {
        return a.dot(normal).abs() / normal.length();
    }
    let to_side = |(from, to): (DVec3, DVec3)| {
        let along = to - from;
        (from + along * (-from.dot(along) / along.length_squared()).clamp(0.0, 1.0)).length()
    };
    sides.into_iter().map(to_side).fold(f64::MAX, f64::min)
}

fn detector(pixel: f32, views: Views, form: Form, surfaces: &[&Surface]) -> ImageSpace {
    let definition = ImageSpaceDefinition {
        views,
        form,
        pixels: 1 << 21,
        crossings: 1 << 22,
        ..ImageSpaceDefinition::new(pixel)
    };
    ImageSpace::new(&definition, surfaces).expect("a detector")
}

fn placed<'a>(surface: &'a Surface, shape: &'a Shape) -> Placed<'a> {
    Placed {
        surface,
        positions: &shape.positions,
        thickness: 0.0,
    }
}

/// Returns true if a point of an edge, given as a fraction, lies in or just beside a detected part of the edge.
fn is_found(overlap: &Overlap, side: usize, edge: usize, share: f64) -> bool {
    let parts = overlap.inside[side]
        .edges
        .iter()
        .filter(|part| part.edge as usize == edge);
    parts
        .into_iter()
        .any(|part| f64::from(part.entry) - 1e-5 <= share && share <= f64::from(part.exit) + 1e-5)
}

/// Returns the slope of log(error) against log(size), by least squares.
fn order(sizes: &[f64], errors: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().map(|v| v.ln()).sum::<f64>() / values.len() as f64;
    let (x, y) = (mean(sizes), mean(errors));
    let pairs = || sizes.iter().zip(errors).map(|(s, e)| (s.ln() - x, e.ln() - y));
    pairs().map(|(s, e)| s * e).sum::<f64>() / pairs().map(|(s, _)| s * s).sum::<f64>()
}

#[test]
fn entry_and_exit_of_grid_edges_in_a_ball_converge_with_first_order() {
    let ball = Shape::sphere(5);
    // The grid passes through the ball, rotated so that no edge is parallel to a view.
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.4, 0.3, 0.2);
    let grid = Shape::grid(24).moved(|p| turn * (p * 1.3 + Vec3::new(0.02, -0.03, 0.15)));
    let (occluder, other) = (ball.closed(), grid.open());
    // The positions where the line through an edge crosses the sphere. The mesh lies inside the sphere by less than
    // `flatness`.
    let flatness = 3e-4;
    let crossings: Vec<_> = other
        .edges()
        .iter()
        .map(|edge| {
            let [a, b] = edge.map(|node| grid.positions[node as usize].as_dvec3());
            let along = b - a;
            let (half, square) = (-a.dot(along) / along.length_squared(), along.length_squared());
            let half_chord = half * half - (a.length_squared() - 1.0) / square;
            (a, along, half, half_chord.max(0.0).sqrt())
        })
        .collect();
    let (mut pixels, mut errors) = (Vec::new(), Vec::new());
    for parts in [32, 64, 128, 256, 512, 1024] {
        let pixel = 2.0 / parts as f32;
        let mut detector = detector(
            pixel,
            Views::Along(Vec3::new(0.3, 0.2, 1.0)),
            Form::Intervals,
            &[&occluder, &other],
        );
        let overlap = detector
            .detect(&[placed(&occluder, &ball), placed(&other, &grid)])
            .expect("an overlap");
        assert!(
            overlap.inside[0].edges.is_empty() && overlap.volume == 0.0,
            "an open body is no occluder"
        );
        let pixel = f64::from(overlap.pixel);
        assert!((pixel * f64::from(parts) - 2.0).abs() < 1e-6);
        let bound = HALF_DIAGONAL * pixel;
        let (mut sum, mut count) = (0.0, 0);
        for (edge, &(start, along, half, half_chord)) in crossings.iter().enumerate() {
            for i in 0..=16 {
                let share = f64::from(i) / 16.0;
                let depth = 1.0 - (start + along * share).length();
                let found = is_found(overlap, 1, edge, share);
                assert!(
                    found || depth < bound + flatness,
                    "1/{parts}: edge {edge} at {share}, {depth} m deep, missed"
                );
                assert!(
                    !found || depth > -bound,
                    "1/{parts}: edge {edge} at {share}, {depth} m deep, found"
                );
            }
            // Ends that cross the sphere at a steep angle.
            let slope = half_chord * along.length();
            for (share, is_entry) in [(half - half_chord, true), (half + half_chord, false)] {
                if slope < 0.5 || !(0.1..0.9).contains(&share) {
                    continue;
                }
                let ends = overlap.inside[1].edges.iter().filter(|part| part.edge as usize == edge);
                let ends = ends.map(|part| f64::from(if is_entry { part.entry } else { part.exit }));
                let error = ends
                    .map(|end| (end - share).abs() * along.length())
                    .fold(f64::MAX, f64::min);
                if error < f64::MAX {
                    assert!(
                        error < 2.5 * (bound + flatness),
                        "1/{parts}: edge {edge} ends {error} m off"
                    );
                    sum += error * error;
                    count += 1;
                }
            }
        }
        assert!(count > 50, "{count} ends");
        pixels.push(pixel);
        errors.push((sum / f64::from(count)).sqrt());
    }
    let order = order(&pixels, &errors);
    assert!((0.85..1.2).contains(&order), "order {order}: {errors:?}");
}

#[test]
fn the_volume_of_half_a_ball_and_its_gradient_converge() {
    // The ball is symmetric about z = 0, and a box covers its lower half.
    let ball = Shape::sphere(4).moved(|p| p + Vec3::new(0.013, 0.007, 0.0));
    // The whole section lies in the triangle 4 7 6 of the box's upper side.
    let half_space = Shape::cuboid(Vec3::new(-1.5, -8.0, -3.0), Vec3::new(8.0, 1.5, 0.0));
    let surfaces = [ball.closed(), half_space.closed()];
    let exact = ball.volume() / 2.0;
    let (mut pixels, mut errors) = (Vec::new(), Vec::new());
    for parts in [32, 64, 128, 256, 512, 1024] {
        let mut detector = detector(
            2.0 / parts as f32,
            Views::Axes,
            Form::Intervals,
            &[&surfaces[0], &surfaces[1]],
        );
        let overlap = detector
            .detect(&[placed(&surfaces[0], &ball), placed(&surfaces[1], &half_space)])
            .expect("an overlap");
        let pixel = f64::from(overlap.pixel);
        let error = (overlap.volume - exact).abs() / exact;
        assert!(error < pixel, "1/{parts}: {error}");
        // The ball is pushed straight up by its volume divided by the area of its section.
        let section = std::f64::consts::PI;
        assert!(
            overlap.normal.dot(Vec3::Z) > 1.0 - pixel as f32,
            "1/{parts}: {}",
            overlap.normal
        );
        let depth = f64::from(overlap.depth) * section / exact - 1.0;
        assert!(depth.abs() < 0.01 + 2.0 * pixel, "1/{parts}: depth off by {depth}");
        let sums = [0, 1].map(|side| overlap.gradients[side].iter().sum::<DVec3>());
        assert!(
            (sums[0] + sums[1]).length() < 0.1 * pixel,
            "a common translation must not change the volume: {sums:?}"
        );
        // The gradient is distributed to the corners by the barycentric coordinates of the section's center.
        let [a, b, c] = half_space.corners([4, 7, 6]);
        let middle = DVec3::new(0.013, 0.007, 0.0);
        let area = (b - a).cross(c - a).z;
        for (node, from, to) in [(4, b, c), (7, c, a), (6, a, b)] {
            let weight = (to - from).cross(middle - from).z / area;
            let share = overlap.gradients[1][node].z / sums[1].z;
            assert!(
                (share - weight).abs() < 0.1 * pixel,
                "1/{parts}: node {node} has {share} of {weight}"
            );
        }
        pixels.push(pixel);
        errors.push(error);
    }
    assert!(order(&pixels, &errors) > 0.9, "{errors:?}");
}

#[test]
fn the_gradient_of_each_node_is_the_derivative_of_the_volume() {
    let body = Shape::bumpy(2);
    let enclosing = Shape::cuboid(Vec3::splat(-2.0), Vec3::splat(2.0));
    let surfaces = [body.closed(), enclosing.closed()];
    let mut detector = detector(2.0 / 512.0, Views::Axes, Form::Intervals, &[&surfaces[0], &surfaces[1]]);
    let overlap = detector
        .detect(&[placed(&surfaces[0], &body), placed(&surfaces[1], &enclosing)])
        .expect("an overlap");
    assert!((overlap.volume / body.volume() - 1.0).abs() < 1e-3);
    let exact = body.volume_gradient();
    let size = (exact.iter().map(|g| g.length_squared()).sum::<f64>() / exact.len() as f64).sqrt();
    for (found, exact) in overlap.gradients[0].iter().zip(exact) {
        assert!(found.distance(exact) < 0.03 * size, "{found} {exact}");
    }
    assert!(overlap.gradients[1].iter().all(|&gradient| gradient == DVec3::ZERO));
    assert_eq!(overlap.inside[0].points.len(), body.positions.len());
    assert!(overlap.inside[1].points.is_empty() && overlap.inside[1].edges.is_empty());
}

#[test]
fn edges_along_the_view_are_missed_by_counting_and_found_from_the_side() {
    let block = Shape::cuboid(Vec3::splat(-1.0), Vec3::splat(1.0));
    let rod = Shape::cuboid(Vec3::new(-0.3, -0.35, -3.0), Vec3::new(0.32, 0.31, 3.0));
    let surfaces = [block.closed(), rod.closed()];
    let along = |direction: Vec3, form: Form| {
        let mut detector = detector(1.0 / 64.0, Views::Along(direction), form, &[&surfaces[0], &surfaces[1]]);
        let overlap = detector
            .detect(&[placed(&surfaces[0], &block), placed(&surfaces[1], &rod)])
            .expect("an overlap");
        overlap.inside[1].edges.clone()
    };
    assert!(along(Vec3::Z, Form::Counted).is_empty());
    assert!(!along(Vec3::X, Form::Counted).is_empty());
    let found = along(Vec3::Z, Form::Intervals);
    for (index, edge) in surfaces[1].edges().iter().enumerate() {
        let [a, b] = edge.map(|node| rod.positions[node as usize]);
        let part = found.iter().find(|part| part.edge as usize == index);
        assert_eq!(part.is_some(), a.z != b.z, "edge {index}");
        if let Some(part) = part {
            assert!(
                (part.entry - 1.0 / 3.0).abs() < 1e-5 && (part.exit - 2.0 / 3.0).abs() < 1e-5,
                "{part:?}"
            );
            assert!((part.depth - 1.0).abs() < 1e-5, "half of the block: {part:?}");
        }
    }
}

#[test]
fn only_the_nearest_edge_in_a_pixel_is_counted() {
    let block = Shape::cuboid(Vec3::splat(-1.0), Vec3::splat(1.0));
    let inside = [
        Vec3::new(-0.5, 0.013, 0.0),
        Vec3::new(0.5, 0.013, 0.0),
        Vec3::new(0.0, 0.013, 0.2),
    ];
    let pair = Shape {
        positions: inside.into_iter().chain(inside.map(|p| p - Vec3::Z * 2.0)).collect(),
        triangles: vec![[0, 1, 2], [3, 4, 5]],
    };
    let (occluder, other) = (block.closed(), pair.open());
    for (view, count) in [(Vec3::Z, 0), (Vec3::NEG_Z, 1), (Vec3::Y, 3)] {
        let mut detector = detector(1.0 / 64.0, Views::Along(view), Form::Counted, &[&occluder, &other]);
        let overlap = detector
            .detect(&[placed(&occluder, &block), placed(&other, &pair)])
            .expect("an overlap");
        let edges = &overlap.inside[1].edges;
        assert!(
            edges.len() >= count && edges.is_empty() == (count == 0),
            "{view}: {edges:?}"
        );
        assert!(
            edges.iter().all(|part| other.edges()[part.edge as usize][1] < 3),
            "{view}: {edges:?}"
        );
    }
}

#[test]
fn a_plate_thinner_than_a_pixel_is_detected_with_a_thickness_or_by_intervals() {
    let pixel = 1.0 / 64.0;
    let plate = Shape::cuboid(Vec3::new(-1.0, -1.0, 0.1), Vec3::new(1.0, 1.0, 0.1 + pixel / 10.0));
    // Slanted needles; each is a triangle with two long edges and a short one.
    let mut random = Random(3);
    let mut needles = Shape {
        positions: Vec::new(),
        triangles: Vec::new(),
    };
    for needle in 0..50 {
        // Side by side, so that no needle hides another.
        let foot = Vec3::new(0.6 * random.unit(), needle as f32 / 30.0 - 0.8, -0.5);
        let tip = foot + Vec3::new(0.3, 0.0, 1.2);
        needles.positions.extend([foot, foot + Vec3::X * 0.01, tip]);
        needles.triangles.push([0, 1, 2].map(|corner| 3 * needle + corner));
    }
    let (occluder, other) = (plate.closed(), needles.open());
    let needles_found = |views: Views, form: Form, thickness: f32| {
        let mut detector = detector(pixel, views, form, &[&occluder, &other]);
        let bodies = [
            Placed {
                thickness,
                ..placed(&occluder, &plate)
            },
            placed(&other, &needles),
        ];
        let overlap = detector.detect(&bodies).expect("an overlap");
        let mut found: Vec<u32> = overlap.inside[1]
            .edges
            .iter()
            .map(|part| other.edges()[part.edge as usize][0] / 3)
            .collect();
        found.dedup();
        found.len()
    };
    let above = Views::Along(Vec3::Z);
    assert!(needles_found(above, Form::Counted, 0.0) < 15);
    assert_eq!(needles_found(above, Form::Counted, 3.0 * pixel), 50);
    assert_eq!(needles_found(above, Form::Intervals, 0.0), 50);
    assert_eq!(needles_found(Views::Axes, Form::Intervals, 0.0), 50);
    // Seen edge on, the image is one pixel high and cropped to the plate, and its rays pass through the middle of the
    // plate.
    assert_eq!(needles_found(Views::Along(Vec3::X), Form::Intervals, 0.0), 50);
}

#[test]
fn few_edges_are_missed_from_random_views_and_none_deeper_than_a_ray_offset() {
    let shapes = [
        Shape::bumpy(3),
        Shape::bumpy(2).moved(|p| Quat::from_rotation_x(1.0) * p * 0.8 + Vec3::new(0.9, 0.5, 0.3)),
    ];
    let surfaces = shapes.each_ref().map(Shape::closed);
    // The signed distances of points along all edges from the other body.
    const STEPS: usize = 8;
    let depths = [0, 1].map(|side| {
        let edges = surfaces[side].edges().iter();
        let depths_along = |edge: &[u32; 2]| {
            let [a, b] = edge.map(|node| shapes[side].positions[node as usize].as_dvec3());
            let depth = |i: usize| -shapes[1 - side].distance(a.lerp(b, i as f64 / STEPS as f64));
            std::array::from_fn::<f64, { STEPS + 1 }, _>(depth)
        };
        edges.map(depths_along).collect::<Vec<_>>()
    });
    let pixel = 2.0 / 256.0;
    let bound = HALF_DIAGONAL * f64::from(pixel);
    let mut random = Random(9);
    let [mut drawn, mut missed] = [0, 0];
    for _ in 0..10 {
        // Form::Counted, along three axes that are rotated relative to the bodies.
        let turn = Quat::from_axis_angle(random.direction(), 3.0 * random.unit());
        let turned = shapes.clone().map(|shape| shape.moved(|p| turn * p));
        let mut counted = detector(pixel, Views::Axes, Form::Counted, &[&surfaces[0], &surfaces[1]]);
        let bodies = [0, 1].map(|side| placed(&surfaces[side], &turned[side]));
        let overlap = counted.detect(&bodies).expect("an overlap");
        for side in 0..2 {
            let mut found = vec![false; surfaces[side].edges().len()];
            overlap.inside[side]
                .edges
                .iter()
                .for_each(|part| found[part.edge as usize] = true);
            for (edge, depths) in depths[side].iter().enumerate() {
                let deepest = depths.iter().copied().fold(f64::MIN, f64::max);
                assert!(
                    !found[edge] || deepest > -2.0 * bound,
                    "edge {edge} of {side} is outside by {}",
                    -deepest
                );
                drawn += usize::from(deepest > 0.0);
                missed += usize::from(deepest > 0.0 && !found[edge]);
            }
        }
        // Form::Intervals, from one side.
        let views = Views::Along(random.direction());
        let mut traced = detector(pixel, views, Form::Intervals, &[&surfaces[0], &surfaces[1]]);
        let bodies = [0, 1].map(|side| placed(&surfaces[side], &shapes[side]));
        let overlap = traced.detect(&bodies).expect("an overlap");
        for side in 0..2 {
            assert_eq!(overlap.inside[side].unlisted, 0);
            for (edge, depths) in depths[side].iter().enumerate() {
                for (i, &depth) in depths.iter().enumerate() {
                    let found = is_found(overlap, side, edge, i as f64 / STEPS as f64);
                    assert!(found || depth < bound, "edge {edge} of {side}: {depth} m deep, missed");
                    assert!(!found || depth > -bound, "edge {edge} of {side}: {depth} m deep, found");
                }
            }
            let points = &overlap.inside[side].points;
            for (node, position) in shapes[side].positions.iter().enumerate() {
                let depth = -shapes[1 - side].distance(position.as_dvec3());
                let found = points.iter().find(|point| point.node as usize == node);
                assert!(
                    found.is_some() || depth < bound,
                    "node {node} of {side}: {depth} m deep, missed"
                );
                if let Some(point) = found {
                    // The push-out path along the view is no shorter than the shortest.
                    assert!(
                        depth > -bound && f64::from(point.depth) > depth - bound,
                        "{point:?}: {depth}"
                    );
                }
            }
        }
    }
    assert!(drawn > 4000 && missed * 100 < drawn, "{missed} of {drawn}");
}

#[test]
fn distances_from_a_layered_image_are_exact_to_a_pixel() {
    for (shape, parts) in [(Shape::bumpy(4), 128), (Shape::sphere(2), 64), (Shape::bumpy(3), 256)] {
        let pixel = 2.4 / parts as f32;
        let image = LayeredImage::new(&shape.positions, &shape.triangles, pixel).expect("a closed surface");
        let mut random = Random(21);
        let (mut worst, mut sum, mut count) = (0.0_f64, 0.0, 0);
        for _ in 0..400 {
            let triangle =
                shape.triangles[(random.unit() * shape.triangles.len() as f32) as usize % shape.triangles.len()];
            let [a, b, c] = triangle.map(|node| shape.positions[node as usize]);
            let middle = (a + b + c) / 3.0 + (b - a) * 0.3 * random.unit();
            let point = middle + random.direction() * random.unit() * 4.0 * pixel;
            let exact = shape.distance(point.as_dvec3());
            let (distance, normal) = image.distance(point, 1.0).expect("near");
            let error = (f64::from(distance) - exact).abs() / f64::from(pixel);
            worst = worst.max(error);
            sum += error;
            count += 1;
            assert!((normal.length() - 1.0).abs() < 1e-4);
            // The distance increases along the normal.
            let step = 0.05 * f64::from(pixel);
            let ahead = shape.distance(point.as_dvec3() + normal.as_dvec3() * step);
            assert!(
                ahead > exact - 0.1 * step,
                "{point}: {normal} leads from {exact} to {ahead}"
            );
            let within = distance.abs() / 2.0;
            assert_eq!(image.distance(point, within).is_some(), distance <= within);
        }
        assert!(
            worst < 1.0 && sum / f64::from(count) < 0.05,
            "1/{parts}: {worst} pixels at worst, {} in the mean",
            sum / f64::from(count)
        );
    }
}

/// Creates a block with a groove in its upper side. The groove is `width` wide at the top and `depth` deep.
fn grooved(width: f32, depth: f32) -> Shape {
    let profile = [
        [0.1, 0.5 - depth],
        [0.1 - width / 2.0, 0.5],
        [-1.0, 0.5],
        [-1.0, -0.5],
        [1.0, -0.5],
        [1.0, 0.5],
        [0.1 + width / 2.0, 0.5],
    ];
    let count = profile.len() as u32;
    let at = |z: f32| profile.map(|[x, y]| Vec3::new(x, y, z));
    let mut triangles = Vec::new();
    for corner in 0..count {
        let next = (corner + 1) % count;
        triangles.extend([[corner, next, next + count], [corner, next + count, corner + count]]);
        // The end faces are fans of triangles from the bottom of the groove.
        if corner > 0 && next > 0 {
            triangles.extend([[0, next, corner], [count, corner + count, next + count]]);
        }
    }
    let shape = Shape {
        positions: [at(-0.6), at(0.6)].concat(),
        triangles,
    };
    assert!((shape.volume() - f64::from(1.2 * (2.0 - width * depth / 2.0))).abs() < 1e-5);
    shape
}

#[test]
fn points_below_a_groove_narrower_than_a_pixel_are_not_deep_inside() {
    let pixel = 0.02;
    let mut random = Random(77);
    for (width, depth) in [(0.6, 8.0), (0.3, 15.0), (1.5, 5.0)] {
        for _ in 0..12 {
            let turn = Quat::from_axis_angle(random.direction(), 3.0 * random.unit());
            let shape = grooved(width * pixel, depth * pixel).moved(|p| turn * p);
            let image = LayeredImage::new(&shape.positions, &shape.triangles, pixel).expect("a closed surface");
            for _ in 0..60 {
                let along = shape.positions[0].lerp(shape.positions[7], 0.1 + 0.8 * random.unit());
                let point = along + random.vector() * pixel * 1.5;
                let exact = shape.distance(point.as_dvec3());
                let (distance, _) = image.distance(point, 1.0).expect("near");
                assert!(
                    (f64::from(distance) - exact).abs() < f64::from(pixel),
                    "{width} x {depth} at {point}: {distance} for {exact}"
                );
            }
        }
    }
}

#[test]
fn organs_are_represented_to_within_a_pixel() {
    for name in ["stomach.stl", "liver_collision.stl"] {
        let Some(mesh) = real(name, 1e-3) else {
            continue;
        };
        let surface = ClosedSurface::new(&mesh.positions, &mesh.triangles).expect(name);
        let exact = Exact::new(&surface).expect("a solid");
        let [low, high] =
            [Vec3::min, Vec3::max].map(|pick| mesh.positions.iter().copied().reduce(pick).expect("nodes"));
        let pixel = (high - low).max_element() / 256.0;
        let image = LayeredImage::new(surface.positions(), surface.triangles(), pixel).expect("a closed surface");
        let mut random = Random(77);
        let (mut wrong, count) = (0, 40_000);
        for _ in 0..count {
            let triangle =
                mesh.triangles[(random.unit() * mesh.triangles.len() as f32) as usize % mesh.triangles.len()];
            let [a, b, c] = triangle.map(|node| mesh.positions[node as usize]);
            let (u, v) = (random.unit(), random.unit());
            let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            let point = a + (b - a) * u + (c - a) * v + random.vector() * pixel;
            let (distance, _) = image.distance(point, 1.0).expect("near");
            let (true_distance, _) = exact.distance(point, 1.0).expect("near");
            let error = (distance - true_distance).abs();
            assert!(error < pixel, "{name} at {point}: {distance} for {true_distance}");
            wrong += u32::from(error > 0.05 * pixel && (distance < 0.0) != (true_distance < 0.0));
        }
        assert!(wrong * 2000 < count, "{name}: {wrong} of {count} on the wrong side");
    }
}

#[test]
fn the_nearest_face_of_a_ball_is_found_from_inside_and_outside() {
    let ball = Shape::sphere(4);
    let pixel = 2.0 / 256.0;
    let image = LayeredImage::new(&ball.positions, &ball.triangles, pixel).expect("a closed surface");
    let mut random = Random(8);
    for _ in 0..400 {
        let direction = random.direction();
        let radius = 0.5 + 0.6 * random.unit();
        let (distance, normal) = image.distance(direction * radius, 1.0).expect("near");
        assert!(
            (distance - (radius - 1.0)).abs() < pixel,
            "{direction} {radius}: {distance}"
        );
        assert!(normal.dot(direction) > 0.98, "{direction} {radius}: {normal}");
    }
    assert!(image.distance(Vec3::X * 1.2, 0.1).is_none() && image.distance(Vec3::X * 1.2, 0.3).is_some());
}

#[test]
fn pixels_grow_if_memory_is_insufficient() {
    let shapes = [Shape::bumpy(3), Shape::bumpy(3).moved(|p| p + Vec3::X)];
    let surfaces = shapes.each_ref().map(Shape::closed);
    let bodies = [0, 1].map(|side| placed(&surfaces[side], &shapes[side]));
    let detect = |pixels: u32, crossings: u32| {
        let definition = ImageSpaceDefinition {
            pixels,
            crossings,
            ..ImageSpaceDefinition::new(0.01)
        };
        let mut detector = ImageSpace::new(&definition, &[&surfaces[0]]).expect("a detector");
        detector.detect(&bodies).map(|overlap| (overlap.pixel, overlap.volume))
    };
    let (pixel, fine) = detect(1 << 18, 1 << 18).expect("an overlap");
    assert_eq!(pixel, 0.01);
    for (pixels, crossings) in [(20_000, 1 << 18), (1 << 18, 20_000)] {
        let (pixel, volume) = detect(pixels, crossings).expect("an overlap");
        assert_eq!(pixel, 0.02, "{pixels} {crossings}");
        assert!((volume / fine - 1.0).abs() < 0.02);
    }
    assert!(matches!(detect(1 << 18, 1), Err(Error::Capacity(_))));
}

#[test]
fn invalid_surfaces_and_definitions_are_refused_by_name() {
    let ball = Shape::sphere(2);
    let assert_refused = |result: Result<(), Error>, words: &[&str]| match result {
        Err(Error::InvalidArgument(message)) => {
            assert!(words.iter().all(|word| message.contains(word)), "{message}");
        }
        other => panic!("{other:?}"),
    };
    let open = &ball.triangles[1..];
    assert_refused(Surface::closed(ball.positions.len(), open).map(drop), &["not closed"]);
    assert_refused(LayeredImage::new(&ball.positions, open, 0.1).map(drop), &["not closed"]);
    assert_refused(
        Surface::closed(5, &ball.triangles).map(drop),
        &["names node", "there are 5"],
    );
    assert_refused(Surface::open(0, &[]).map(drop), &["triangles"]);
    for pixel in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_refused(
            LayeredImage::new(&ball.positions, &ball.triangles, pixel).map(drop),
            &["pixel", &pixel.to_string()],
        );
        assert_refused(
            ImageSpace::new(&ImageSpaceDefinition::new(pixel), &[]).map(drop),
            &["pixel"],
        );
    }
    assert_refused(
        LayeredImage::new(&ball.positions, &ball.triangles, 1e-6).map(drop),
        &["pixel", "16777216"],
    );
    let mut broken = ball.clone();
    broken.positions[7].y = f32::NAN;
    assert_refused(
        LayeredImage::new(&broken.positions, &broken.triangles, 0.1).map(drop),
        &["node 7"],
    );

    let definition = ImageSpaceDefinition::new(0.1);
    let along_nothing = ImageSpaceDefinition {
        views: Views::Along(Vec3::ZERO),
        ..definition
    };
    assert_refused(ImageSpace::new(&along_nothing, &[]).map(drop), &["view"]);
    let too_many = ImageSpaceDefinition {
        pixels: u32::MAX,
        ..definition
    };
    assert_refused(ImageSpace::new(&too_many, &[]).map(drop), &["pixels", "4294967295"]);
    let surfaces = [ball.closed(), ball.open()];
    let mut detector = ImageSpace::new(&definition, &[&surfaces[0]]).expect("a detector");
    let [closed, sheet] = surfaces.each_ref().map(|surface| placed(surface, &ball));
    assert_refused(detector.detect(&[sheet, sheet]).map(drop), &["open"]);
    assert_refused(
        detector
            .detect(&[
                Placed {
                    thickness: -1.0,
                    ..closed
                },
                sheet,
            ])
            .map(drop),
        &["thickness"],
    );
    assert_refused(
        detector.detect(&[placed(&surfaces[0], &broken), closed]).map(drop),
        &["node 7"],
    );
    assert_refused(
        detector
            .detect(&[
                Placed {
                    positions: &ball.positions[1..],
                    ..closed
                },
                closed,
            ])
            .map(drop),
        &["positions"],
    );
    let larger = Shape::sphere(3);
    let surface = larger.closed();
    assert!(matches!(
        detector.detect(&[placed(&surface, &larger), closed]),
        Err(Error::Capacity(_))
    ));
    // After refused calls the detector works as before. A distant body has no overlap.
    assert!(!detector.detect(&[closed, closed]).expect("an overlap").is_empty());
    let distant = ball.clone().moved(|p| p + Vec3::X * 5.0);
    assert!(
        detector
            .detect(&[closed, placed(&surfaces[0], &distant)])
            .expect("none")
            .is_empty()
    );
}
