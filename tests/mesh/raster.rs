//! The rasterizer and rendered images, through the public API.

use glam::{DVec3, Vec3};
use sinew::raster::{
    Camera, Fragment, Image, Lines, Look, PixelVertex, Scene, Shape, Surface, View, Window, rasterise_triangle,
};
use std::collections::BTreeSet;

/// A generator of pseudo-random numbers with a fixed seed (xorshift64*).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn point(&mut self, size: f64) -> Vec3 {
        DVec3::from_array([0; 3].map(|_| self.within(-size, size))).as_vec3()
    }
}

fn flat(x: f64, y: f64) -> PixelVertex {
    PixelVertex {
        x,
        y,
        depth: 1.0,
        reciprocal: 1.0,
    }
}

/// Returns the triangles of a square, refined by splits of random triangles at random points.
fn triangulation(random: &mut Random, size: f64, splits: usize) -> Vec<[(f64, f64); 3]> {
    let corners = [(0.0, 0.0), (size, 0.0), (size, size), (0.0, size)];
    let mut triangles = vec![
        [corners[0], corners[1], corners[2]],
        [corners[0], corners[2], corners[3]],
    ];
    for _ in 0..splits {
        let index = (random.next() * triangles.len() as f64) as usize;
        let [a, b, c] = triangles.swap_remove(index);
        let (mut u, mut v) = (random.next(), random.next());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        // Snaps to a grid of 1/4096 pixel, and often to pixel centers, where the fill rule decides.
        let snap = |value: f64, steps: f64| (value * steps).round() / steps;
        let steps = if random.next() < 0.5 { 2.0 } else { 4096.0 };
        let middle = (
            snap(a.0 + u * (b.0 - a.0) + v * (c.0 - a.0), steps),
            snap(a.1 + u * (b.1 - a.1) + v * (c.1 - a.1), steps),
        );
        let doubled =
            |p: (f64, f64), q: (f64, f64), r: (f64, f64)| (q.0 - p.0) * (r.1 - p.1) - (q.1 - p.1) * (r.0 - p.0);
        let parts = [[a, b, middle], [b, c, middle], [c, a, middle]];
        let inside = parts
            .iter()
            .all(|[p, q, r]| doubled(*p, *q, *r) * doubled(a, b, c) > 0.0);
        if inside {
            triangles.extend(parts);
        } else {
            triangles.push([a, b, c]);
        }
    }
    triangles
}

#[test]
fn a_triangulation_covers_each_pixel_once() {
    let size = 97;
    let mut random = Random(11);
    for _ in 0..20 {
        let mut counts = vec![0; size * size];
        for (i, triangle) in triangulation(&mut random, size as f64, 400).into_iter().enumerate() {
            let [a, b, c] = triangle.map(|(x, y)| flat(x, y));
            // Both orientations, because the fill rule must not depend on them.
            let vertices = if i % 2 == 0 { [a, b, c] } else { [b, a, c] };
            rasterise_triangle(&Window::new(size as u32, size as u32), &vertices, |f| {
                counts[f.y as usize * size + f.x as usize] += 1;
            });
        }
        assert_eq!(counts.iter().filter(|&&count| count != 1).count(), 0);
    }
}

#[test]
fn clipped_triangles_still_cover_each_pixel_once() {
    // A plane of random triangles that passes below the camera, through the near plane and far out to the sides.
    let camera = Camera {
        eye: Vec3::new(0.0, 0.02, 0.0),
        target: Vec3::new(0.0, 0.01, -1.0),
        up: Vec3::Y,
        field_of_view: 1.2,
    };
    let view = camera.view(160, 120).expect("a valid camera");
    let mut counts = vec![0; 160 * 120];
    for triangle in triangulation(&mut Random(5), 2000.0, 300) {
        let points = triangle.map(|(x, z)| Vec3::new(x as f32 - 1000.0, 0.0, z as f32 - 1000.0));
        view.triangle(&Window::new(160, 120), points, |f| {
            counts[f.y as usize * 160 + f.x as usize] += 1;
        });
    }
    let rows: BTreeSet<Vec<i32>> = counts
        .chunks(160)
        .map(|row| row.iter().copied().collect::<BTreeSet<_>>().into_iter().collect())
        .collect();
    // Each row is all sky or all ground.
    assert_eq!(rows, BTreeSet::from([vec![0], vec![1]]));
    let covered = counts.iter().filter(|&&count| count == 1).count();
    assert!((9000..10_800).contains(&covered), "{covered}");
}

/// Returns the depth along `forward` at which a ray hits the plane of a triangle.
fn plane_depth(origin: DVec3, direction: DVec3, corners: [DVec3; 3], eye: DVec3, forward: DVec3) -> f64 {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let distance = normal.dot(corners[0] - origin) / normal.dot(direction);
    (origin + distance * direction - eye).dot(forward)
}

#[test]
fn depths_and_weights_agree_with_rays() {
    let (width, height) = (640_u32, 480_u32);
    let mut random = Random(3);
    let eye = Vec3::new(0.4, 0.3, 3.0);
    let target = Vec3::new(0.1, -0.1, 0.0);
    let camera = Camera {
        eye,
        target,
        up: Vec3::Y,
        field_of_view: 0.7,
    };
    let eye64 = eye.as_dvec3();
    let forward = (target.as_dvec3() - eye64).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let scale = 250.0;
    let perspective = camera.view(width, height).expect("a valid camera");
    let parallel = View::orthographic(eye, target - eye, Vec3::Y, scale, width, height);
    let tangent = 0.35_f64.tan() / (f64::from(height) / 2.0);

    let mut checked = 0;
    for round in 0..200 {
        let points = [0; 3].map(|_| random.point(0.9));
        let corners = points.map(|point| point.as_dvec3());
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        // For a triangle seen edge-on, depth changes by more than 1e-5 within the rounding of a pixel coordinate.
        if normal.length() < 0.2 || normal.normalize().dot(forward).abs() < 0.2 {
            continue;
        }
        let orthographic = round % 2 == 0;
        let view = if orthographic { parallel } else { perspective };
        let mut check = |fragment: Fragment| {
            let across = f64::from(fragment.x) + 0.5 - f64::from(width) / 2.0;
            let down = f64::from(fragment.y) + 0.5 - f64::from(height) / 2.0;
            let (origin, direction) = if orthographic {
                (eye64 + (right * across - up * down) / scale, forward)
            } else {
                (eye64, forward + tangent * (right * across - up * down))
            };
            let expected = plane_depth(origin, direction, corners, eye64, forward);
            assert!(
                (f64::from(fragment.depth) - expected).abs() < 1e-5,
                "{} {expected}",
                fragment.depth
            );
            let position = (0..3)
                .map(|i| f64::from(fragment.weights[i]) * corners[i])
                .sum::<DVec3>();
            let ray = origin + direction * expected;
            assert!((position - ray).length() < 1e-5, "{position} {ray}");
            assert_eq!(fragment.front, normal.dot(direction) < 0.0);
            checked += 1;
        };
        view.triangle(&Window::new(width, height), points, &mut check);
    }
    assert!(checked > 100_000, "{checked}");
}

#[test]
fn lines_have_the_depth_of_their_points() {
    let camera = Camera {
        eye: Vec3::new(0.0, 0.0, 2.0),
        target: Vec3::ZERO,
        up: Vec3::Y,
        field_of_view: 0.8,
    };
    let view = camera.view(400, 300).expect("a valid camera");
    let mut random = Random(8);
    for _ in 0..100 {
        // Some lines begin behind the camera.
        let points = [random.point(0.5), random.point(3.0)];
        view.line(&Window::new(400, 300), points, |fragment| {
            let point = points[0] * fragment.weights[0] + points[1] * fragment.weights[1];
            assert!((2.0 - point.z - fragment.depth).abs() < 1e-5);
            let pixel = view.project(point).expect("in front of the camera");
            assert!((pixel.x - f64::from(fragment.x) - 0.5).abs() < 0.51);
            assert!((pixel.y - f64::from(fragment.y) - 0.5).abs() < 0.51);
        });
    }
}

#[test]
fn unproject_undoes_project() {
    let camera = Camera {
        eye: Vec3::new(1.0, 2.0, 3.0),
        target: Vec3::ZERO,
        up: Vec3::Y,
        field_of_view: 0.8,
    };
    let parallel = View::orthographic(Vec3::new(0.0, 5.0, 0.0), Vec3::NEG_Y, Vec3::Y, 90.0, 300, 200);
    let mut random = Random(4);
    for view in [camera.view(300, 200).expect("a valid camera"), parallel] {
        for _ in 0..100 {
            let point = random.point(1.0);
            let pixel = view.project(point).expect("in front of the camera");
            assert!(view.unproject(pixel.x, pixel.y, pixel.depth).distance(point) < 1e-6);
        }
    }
}

fn red_and_blue(order: [usize; 2]) -> Image {
    let triangles = [[0, 1, 2], [0, 2, 3]];
    let square = |z: f32| [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, z));
    let squares = [square(0.0), square(0.3)];
    let looks = [
        Look::TISSUE.coloured([0.9, 0.1, 0.1]),
        Look::TISSUE.coloured([0.1, 0.1, 0.9]),
    ];
    let mut scene = Scene::default();
    for i in order {
        scene.surfaces.push(Surface {
            positions: &squares[i],
            triangles: &triangles,
            look: looks[i],
            coloured: None,
        });
    }
    let camera = Camera {
        eye: Vec3::new(0.0, 0.0, 4.0),
        target: Vec3::ZERO,
        up: Vec3::Y,
        field_of_view: 0.6,
    };
    scene.draw(&camera, 64, 48).expect("a picture")
}

#[test]
fn the_nearer_surface_wins_in_any_order() {
    let image = red_and_blue([0, 1]);
    assert_eq!(image, red_and_blue([1, 0]));
    let [red, _, blue, alpha] = image.pixels[24 * 64 + 32];
    assert!(blue > 2 * red, "{red} {blue}");
    assert_eq!(alpha, 255);
}

#[test]
fn a_sphere_covers_the_area_of_its_silhouette() {
    let (eye, centre, radius) = (Vec3::new(0.0, 0.0, 3.0), Vec3::new(0.5, 0.35, 0.0), 0.4_f32);
    let camera = Camera {
        eye,
        target: Vec3::ZERO,
        up: Vec3::Y,
        field_of_view: 0.7,
    };
    let (width, height) = (1600, 1200);
    let mut scene = Scene::default();
    let empty = scene.draw(&camera, width, height).expect("a picture");
    scene.shapes.push((Shape::Sphere { centre, radius }, Look::INSTRUMENT));
    let image = scene.draw(&camera, width, height).expect("a picture");
    let changed = image.pixels.iter().zip(&empty.pixels).filter(|(a, b)| a != b).count();
    // The outline of a sphere is the intersection of a cone about the line to its center with the image plane. It is an
    // ellipse with semi-axes f r sqrt(d^2 - r^2) / (z^2 - r^2) and f r / sqrt(z^2 - r^2), where d and z are the
    // distance and depth of the center.
    let offset = (centre - eye).as_dvec3();
    let (d2, z2, r2) = (offset.length_squared(), offset.z * offset.z, f64::from(radius).powi(2));
    let focal = f64::from(height) / 2.0 / 0.35_f64.tan();
    let major = focal * (r2 * (d2 - r2)).sqrt() / (z2 - r2);
    let minor = focal * (r2 / (z2 - r2)).sqrt();
    let area = std::f64::consts::PI * major * minor;
    // A pixel at the outline counts even if only a quarter of it is covered, which adds 0.3 % at this size.
    let error = (changed as f64 - area).abs() / area;
    assert!(error < 0.01, "{changed} {area}");
}

#[test]
fn a_fitted_camera_shows_all_points_tightly() {
    let mut random = Random(21);
    let mut close = 0;
    for round in 0..200 {
        let stretch = random.point(1.0).abs() + Vec3::splat(0.05);
        let shift = random.point(5.0);
        let points: Vec<_> = (0..50).map(|_| shift + stretch * random.point(1.0)).collect();
        let mut direction = random.point(1.0);
        if round % 10 == 0 {
            direction = Vec3::Y;
        }
        let aspect = random.within(0.3, 3.0) as f32;
        let angle = random.within(0.1, 1.6) as f32;
        let (width, height) = ((aspect * 1000.0).round() as u32, 1000);
        let camera = Camera::fitted(
            points.iter().copied(),
            direction,
            Vec3::Y,
            angle,
            width as f32 / height as f32,
        )
        .expect("a camera");
        let view = camera.view(width, height).expect("a view");
        let (mut x, mut y, mut nearest) = (0.0_f64, 0.0_f64, f64::INFINITY);
        for &point in &points {
            let pixel = view.project(point).expect("in front of the camera");
            x = x.max((pixel.x / f64::from(width) * 2.0 - 1.0).abs());
            y = y.max((pixel.y / f64::from(height) * 2.0 - 1.0).abs());
            nearest = nearest.min(pixel.depth);
        }
        assert!(x < 0.945 && y < 0.945, "{x} {y}");
        if x.max(y) < 0.935 {
            // Only when the camera is at its minimum distance: 2 % of at most 2 sqrt(3) times the stretch.
            assert!(nearest < 0.07 * f64::from(stretch.max_element()), "{nearest} {x} {y}");
            close += 1;
        }
        let towards = (camera.eye - camera.target).normalize();
        assert!(towards.dot(direction.normalize()) > 0.999);
    }
    assert!(close < 20, "{close}");
}

#[test]
fn a_camera_fits_degenerate_scenes() {
    let fit = |points: &[Vec3]| Camera::fitted(points.iter().copied(), Vec3::Z, Vec3::Z, 0.6, 1.0);
    for points in [&[][..], &[Vec3::ONE], &[Vec3::NAN, Vec3::ONE], &[Vec3::ZERO, Vec3::Z]] {
        let camera = fit(points).expect("a camera");
        let view = camera.view(100, 100).expect("a view");
        for &point in points.iter().filter(|point| point.is_finite()) {
            let pixel = view.project(point).expect("in front of the camera");
            assert!((pixel.x - 50.0).abs() < 1e-3 && (pixel.y - 50.0).abs() < 1e-3);
        }
    }
    assert!(Camera::fitted([Vec3::ONE], Vec3::ZERO, Vec3::ZERO, 0.6, 1.0).is_ok());
    for angle in [0.0, -1.0, 3.15, f32::NAN] {
        assert!(Camera::fitted([Vec3::ONE], Vec3::Z, Vec3::Y, angle, 1.0).is_err());
    }
}

#[test]
fn broken_triangles_neither_draw_nor_hang() {
    let camera = Camera {
        eye: Vec3::new(0.0, 0.0, 3.0),
        target: Vec3::ZERO,
        up: Vec3::Y,
        field_of_view: 0.7,
    };
    let view = camera.view(200, 150).expect("a valid camera");
    let window = Window::new(200, 150);
    let count = |points: [Vec3; 3]| {
        let mut count = 0;
        view.triangle(&window, points, |_| count += 1);
        count
    };
    let (a, b) = (Vec3::ZERO, Vec3::X);
    for bad in [Vec3::NAN, Vec3::INFINITY, Vec3::new(0.0, f32::NAN, 0.0)] {
        assert_eq!(count([a, b, bad]), 0);
    }
    assert_eq!(count([a, a, a]), 0);
    assert_eq!(count([a, b, b * 2.0]), 0);
    assert_eq!(
        count([a + Vec3::Z * 9.0, b + Vec3::Z * 9.0, Vec3::new(0.0, 1.0, 9.0)]),
        0
    );
    let huge = f32::MAX / 4.0;
    let wall = [
        Vec3::new(-huge, -huge, 0.0),
        Vec3::new(huge, -huge, 0.0),
        Vec3::new(0.0, huge, 0.0),
    ];
    assert_eq!(count(wall), 200 * 150);
    let start = std::time::Instant::now();
    let mut random = Random(2);
    for _ in 0..2000 {
        // Needles far longer than the screen.
        let (from, to) = (random.point(1e6), random.point(1e30));
        count([from, to, from + Vec3::splat(1e-3)]);
    }
    assert!(start.elapsed().as_secs() < 5);

    let positions = [a, b, Vec3::NAN, Vec3::splat(f32::MAX), Vec3::Y];
    let mut scene = Scene::default();
    let empty = scene.draw(&camera, 40, 30).expect("a picture");
    scene.surfaces.push(Surface {
        positions: &positions,
        triangles: &[[0, 1, 2], [0, 0, 1], [0, 1, 1]],
        look: Look::CLOTH,
        coloured: None,
    });
    scene.lines.push(Lines {
        positions: &positions,
        pairs: &[[0, 2], [1, 1]],
        thickness: 2.0,
        look: Look::SPRINGS,
        coloured: None,
    });
    for radius in [0.0, f32::NAN, f32::INFINITY] {
        let sphere = Shape::Sphere { centre: a, radius };
        scene.shapes.push((sphere, Look::INSTRUMENT));
    }
    for normal in [Vec3::ZERO, Vec3::NAN] {
        let plane = Shape::Plane { point: a, normal };
        scene.shapes.push((plane, Look::GROUND));
    }
    assert_eq!(scene.draw(&camera, 40, 30), Ok(empty));
    for (width, height) in [(16_384, 1), (1, 16_384), (1, 1)] {
        let image = scene.draw(&camera, width, height).expect("a picture");
        assert_eq!(image.pixels.len(), (width * height) as usize);
    }
}

#[test]
fn invalid_arguments_are_refused() {
    let camera = Camera {
        eye: Vec3::Z,
        target: Vec3::ZERO,
        up: Vec3::Y,
        field_of_view: 0.7,
    };
    let refused = |result: sinew::Result<Image>| {
        assert!(matches!(result, Err(sinew::Error::InvalidArgument(_))), "{result:?}");
    };
    let mut scene = Scene::default();
    for (width, height) in [(0, 10), (10, 0), (16_385, 1), (1, u32::MAX)] {
        refused(scene.draw(&camera, width, height));
    }
    let at_target = Camera {
        eye: Vec3::ZERO,
        ..camera
    };
    refused(scene.draw(&at_target, 10, 10));
    let nowhere = Camera {
        eye: Vec3::NAN,
        ..camera
    };
    refused(scene.draw(&nowhere, 10, 10));
    scene.surfaces.push(Surface {
        positions: &[Vec3::ZERO, Vec3::X],
        triangles: &[[0, 1, 2]],
        look: Look::TISSUE,
        coloured: None,
    });
    refused(scene.draw(&camera, 10, 10));
}

#[test]
fn a_hidden_instrument_shows_through() {
    let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let positions = square.map(|(x, y)| Vec3::new(x, y, 1.0));
    let camera = Camera {
        eye: Vec3::new(0.0, 0.0, 4.0),
        target: Vec3::ZERO,
        up: Vec3::Y,
        field_of_view: 0.6,
    };
    let draw = |show_through: f32| {
        let mut scene = Scene::default();
        scene.surfaces.push(Surface {
            positions: &positions,
            triangles: &[[0, 1, 2], [0, 2, 3]],
            look: Look::CLOTH,
            coloured: None,
        });
        let ball = Shape::Sphere {
            centre: Vec3::ZERO,
            radius: 0.4,
        };
        let look = Look {
            show_through,
            ..Look::INSTRUMENT
        };
        scene.shapes.push((ball, look));
        scene.draw(&camera, 80, 60).expect("a picture").pixels[30 * 80 + 40]
    };
    let (without, with) = (draw(0.0), draw(1.0));
    assert!(with[0] + 10 < without[0], "{with:?} {without:?}");
}

#[cfg(feature = "pictures")]
mod files {
    use super::*;

    fn noise(width: u32, height: u32) -> Image {
        let mut random = Random(17);
        let pixels = (0..width * height)
            .map(|_| [0; 4].map(|_| random.within(0.0, 256.0) as u8))
            .collect();
        Image { width, height, pixels }
    }

    fn directory(name: &str) -> std::path::PathBuf {
        let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::create_dir_all(&path).expect("a directory for the test");
        path
    }

    #[test]
    fn a_png_decodes_to_the_same_pixels() {
        let path = directory("png").join("noise.png");
        for (width, height) in [(37, 21), (1, 1)] {
            let image = noise(width, height);
            image.write_png(&path).expect("a file");
            let file = std::io::BufReader::new(std::fs::File::open(&path).expect("the file"));
            let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
            let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
            let info = reader.next_frame(&mut bytes).expect("a picture");
            assert_eq!((info.width, info.height), (width, height));
            assert_eq!(bytes, image.pixels.as_flattened());
        }
    }

    #[test]
    fn a_failed_write_leaves_nothing() {
        let directory = directory("failure");
        let target = directory.join("taken.png");
        std::fs::create_dir_all(target.join("full")).expect("a directory in the way");
        for path in [target, directory.join("missing/picture.png")] {
            let Err(sinew::Error::Io(message)) = noise(3, 3).write_png(&path) else {
                panic!("a write that cannot succeed");
            };
            assert!(message.contains(&path.display().to_string()), "{message}");
        }
        let entry_count = std::fs::read_dir(&directory).expect("the directory").count();
        assert_eq!(entry_count, 1);
        let mut broken = noise(3, 3);
        broken.width = 4;
        let result = broken.write_png(directory.join("broken.png"));
        assert!(matches!(result, Err(sinew::Error::InvalidArgument(_))));
    }
}

#[cfg(not(feature = "pictures"))]
#[test]
fn without_pictures_a_file_is_unsupported() {
    let image = Image {
        width: 1,
        height: 1,
        pixels: vec![[0; 4]],
    };
    let result = image.write_png("never.png");
    assert!(matches!(result, Err(sinew::Error::Unsupported(_))));
}
