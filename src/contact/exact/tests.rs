//! EXACT against brute force over all triangles in `f64`.

use std::path::Path;

use glam::{DVec3, Vec3};

use super::ExactSolid;
use crate::geometry::predicates::solid_angle;
use crate::mesh::{ClosedSurface, Mesh, MeshFormat, load};
use crate::random::Random;

/// Search distance, m. All solids here are about 0.1 m across.
const WITHIN: f32 = 0.004;

pub(in crate::contact) fn cube() -> ClosedSurface {
    let mesh = Mesh::lattice(0.02, [4; 3]).expect("a lattice");
    ClosedSurface::new(&mesh.positions, &mesh.surface().expect("a surface")).expect("a cube")
}

/// Returns the surface of revolution of a section.
fn revolve(rings: u32, section: &[(f32, f32)], closes: bool) -> ClosedSurface {
    let sides = section.len() as u32;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for ring in 0..rings {
        let around = std::f32::consts::TAU * ring as f32 / rings as f32;
        for (side, &(radius, height)) in (0_u32..).zip(section) {
            positions.push(Vec3::new(radius * around.cos(), radius * around.sin(), height));
            if side + 1 == sides && !closes {
                continue;
            }
            let node = |ring: u32, side: u32| (ring % rings) * sides + side % sides;
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(r, s)| node(ring + r, side + s));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    // Removes degenerate triangles at the ends of the axis.
    let axis = |node: u32| positions[node as usize].truncate() == glam::Vec2::ZERO;
    triangles.retain(|&[a, b, c]| !(axis(a) && axis(b) || axis(b) && axis(c) || axis(c) && axis(a)));
    ClosedSurface::new(&positions, &triangles).expect("a surface")
}

/// A convex sphere of planar quadrangles.
pub(in crate::contact) fn sphere(rings: u32) -> ClosedSurface {
    let bands = rings / 2;
    let angle = |index: u32| std::f32::consts::PI * (index as f32 / bands as f32 - 0.5);
    let at = |index: u32| {
        let radius = if index.is_multiple_of(bands) {
            0.0
        } else {
            0.05 * angle(index).cos()
        };
        (radius, 0.05 * angle(index).sin())
    };
    let section: Vec<(f32, f32)> = (0..=bands).map(at).collect();
    revolve(rings, &section, false)
}

fn torus() -> ClosedSurface {
    let angle = |side: u32| std::f32::consts::TAU * side as f32 / 12.0;
    let section: Vec<(f32, f32)> = (0..12)
        .map(|side| (0.035 + 0.015 * angle(side).cos(), 0.015 * angle(side).sin()))
        .collect();
    revolve(24, &section, true)
}

/// A mesh from a file, about 0.1 m across; `None` if the folder is missing.
fn load_mesh(name: &str, scale: f32) -> Option<ClosedSurface> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .map(|above| above.join("shared/meshes"))
        .find(|folder| folder.is_dir())?;
    let mesh = load(folder.join(name), MeshFormat::Auto, scale).expect("a mesh").mesh;
    Some(ClosedSurface::new(&mesh.positions, &mesh.triangles).expect("a closed surface"))
}

fn solids() -> Vec<(&'static str, ClosedSurface)> {
    let mut solids = vec![("cube", cube()), ("sphere", sphere(32)), ("torus", torus())];
    for (name, scale) in [("stomach.stl", 0.001), ("forceps_jaw_left.stl", 0.004)] {
        match load_mesh(name, scale) {
            Some(surface) => solids.push((name, surface)),
            None => skip(name),
        }
    }
    solids
}

#[allow(clippy::print_stderr)]
fn skip(name: &str) {
    eprintln!("SKIPPED: ../shared/meshes/{name} is missing");
}

/// All triangles of a solid.
struct Reference(Vec<[DVec3; 3]>);

impl Reference {
    fn new(surface: &ClosedSurface) -> Self {
        let position = |node: u32| surface.positions()[node as usize].as_dvec3();
        Self(surface.triangles().iter().map(|nodes| nodes.map(position)).collect())
    }

    fn near(&self, low: DVec3, high: DVec3) -> Self {
        let overlaps = |triangle: &&[DVec3; 3]| {
            let [a, b, c] = triangle;
            a.min(*b).min(*c).cmple(high).all() && low.cmple(a.max(*b).max(*c)).all()
        };
        Self(self.0.iter().filter(overlaps).copied().collect())
    }

    /// By planes and sides, independently of the tested code.
    fn distance(&self, point: DVec3) -> f64 {
        let distance_to_triangle = |&[a, b, c]: &[DVec3; 3]| {
            let normal = (b - a).cross(c - a);
            let above = |p: DVec3, q: DVec3| normal.dot((q - p).cross(point - p)) >= 0.0;
            if above(a, b) && above(b, c) && above(c, a) {
                return normal.dot(point - a).abs() / normal.length();
            }
            let to_side = |p: DVec3, q: DVec3| {
                let along = ((point - p).dot(q - p) / p.distance_squared(q)).clamp(0.0, 1.0);
                point.distance(p + (q - p) * along)
            };
            to_side(a, b).min(to_side(b, c)).min(to_side(c, a))
        };
        self.0.iter().map(distance_to_triangle).fold(f64::INFINITY, f64::min)
    }

    fn is_inside(&self, point: DVec3) -> bool {
        let angle: f64 = self.0.iter().map(|&triangle| solid_angle(point, triangle)).sum();
        angle > std::f64::consts::TAU
    }

    fn signed(&self, point: DVec3) -> f64 {
        self.distance(point) * if self.is_inside(point) { -1.0 } else { 1.0 }
    }
}

/// A random point near a solid, or further in and out.
fn random_point(random: &mut Random, surface: &ClosedSurface, spread: f32) -> Vec3 {
    let triangle = surface.triangles()[random.below(surface.triangles().len())];
    let [a, b, c] = triangle.map(|node| surface.positions()[node as usize]);
    // Often at a node or an edge.
    let [u, v, w] = [(); 3].map(|()| {
        if random.below(4) == 0 {
            0.0
        } else {
            random.unit() + 1e-3
        }
    });
    let on = if u + v + w > 0.0 {
        (a * u + b * v + c * w) / (u + v + w)
    } else {
        a
    };
    let far = 10.0_f32.powf(-4.0 * random.unit());
    on + random.vector() * spread * far
}

#[test]
fn points_have_exact_signed_distances() {
    let mut random = Random(5);
    for (name, surface) in solids() {
        let solid = ExactSolid::new(&surface).expect("a solid");
        let changing = ExactSolid::changing(&surface).expect("a solid");
        let reference = Reference::new(&surface);
        let (mut insides, mut found) = (0, 0);
        for _ in 0..400 {
            let point = random_point(&mut random, &surface, 0.03);
            let expected = reference.signed(point.as_dvec3());
            for solid in [&solid, &changing] {
                let told = solid.closest(&[point], WITHIN);
                // A point on the surface up to rounding has no side.
                if expected.abs() > 1e-9 {
                    assert_eq!(solid.is_inside(point), expected < 0.0, "{name}: {point} at {expected}");
                }
                let Some(told) = told else {
                    assert!(
                        expected > f64::from(WITHIN) * 0.999_999,
                        "{name}: {point} at {expected} is not found"
                    );
                    continue;
                };
                assert!(
                    (f64::from(told.distance) - expected).abs() < 1e-8,
                    "{name}: {point}: {} for {expected}",
                    told.distance
                );
                // The normal is the direction of steepest ascent.
                let step = 1e-5 * expected.abs().max(1e-4);
                let ahead = reference.signed(point.as_dvec3() + told.normal.as_dvec3() * step);
                assert!(
                    ahead - expected > 0.99 * step,
                    "{name}: {point} at {expected}: {} of {step}",
                    ahead - expected
                );
                found += 1;
            }
            insides += i32::from(expected < 0.0);
        }
        assert!(insides > 50 && found > 300, "{name}: {insides} inside, {found} near");
    }
}

#[test]
fn edges_and_faces_have_exact_closest_points() {
    let mut random = Random(11);
    for (name, surface) in solids() {
        let solid = ExactSolid::new(&surface).expect("a solid");
        let reference = Reference::new(&surface);
        // Counts of four cases: nothing near, closest at the border, closest in the interior, deep inside.
        let mut seen = [[0; 4]; 2];
        let mut lost = 0_i32;
        for turn in 0..400 {
            let count = 2 + turn % 2;
            let first = random_point(&mut random, &surface, 0.01);
            let size = 0.012 * random.unit() + 0.001;
            let (_, up) = solid.measure(first, f32::INFINITY).expect("a distance");
            // Every other feature lies along the surface.
            let mut random_direction = || {
                let direction = random.vector() * size;
                if turn % 4 < 2 {
                    direction
                } else {
                    direction.reject_from_normalized(up) + 0.03 * random.unit() * size * up
                }
            };
            let [a, b] = [random_direction(), random_direction()];
            let corners = [
                first - 0.4 * a - 0.3 * b,
                first + 0.6 * a - 0.3 * b,
                first + 0.7 * b - 0.4 * a,
            ];
            let corners = &corners[..count];
            let exact: Vec<DVec3> = corners.iter().map(|corner| corner.as_dvec3()).collect();
            // Upper bound of the distance of a feature's points from the surface.
            let furthest = exact
                .iter()
                .map(|corner| exact[0].distance(*corner))
                .fold(0.0, f64::max);
            let reach = DVec3::splat(2.0 * furthest + reference.distance(exact[0]) + 1e-4);
            let near = reference.near(exact[0] - reach, exact[0] + reach);
            // Least distance over a grid of points, refined around the minimum.
            let point_at = |weights: [f64; 3]| -> DVec3 { exact.iter().zip(weights).map(|(p, w)| *p * w).sum() };
            let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
            let mut centre = [0.0; 2];
            let mut width = 1.0;
            for round in 0..if count == 2 { 5 } else { 4 } {
                let steps = if count == 2 { 60 } else { 12 };
                let low = if round == 0 {
                    [0.0; 2]
                } else {
                    centre.map(|c: f64| c - width)
                };
                let span = if round == 0 { 1.0 } else { 2.0 * width };
                for i in 0..=steps {
                    for j in 0..=if count == 2 { 0 } else { steps } {
                        let [u, v] = [
                            low[0] + span * f64::from(i) / f64::from(steps),
                            low[1] + span * f64::from(j) / f64::from(steps),
                        ];
                        let v = if count == 2 { 0.0 } else { v.clamp(0.0, 1.0) };
                        let u = u.clamp(0.0, 1.0 - v);
                        let weights = [1.0 - u - v, u, v];
                        let point = point_at(weights);
                        let here = near.distance(point);
                        let here = if here < best.1.abs() || best.1 <= 0.0 || here > 0.0 && best.1 == f64::INFINITY {
                            if reference_is_inside(&solid, &reference, point, here) {
                                -here
                            } else {
                                here
                            }
                        } else {
                            here
                        };
                        if here < best.1 {
                            best = (weights, here);
                            centre = [u, v];
                        }
                    }
                }
                width = if round == 0 {
                    1.0 / f64::from(steps)
                } else {
                    width / f64::from(steps) * 2.0
                };
            }
            if count == 3 && best.1 > 0.0 {
                // A face outside is closest to a node of the solid, with no other part of the solid closer.
                best.1 = f64::INFINITY;
                for &node in near.0.iter().flatten() {
                    let weights = foot(&exact, node);
                    let distance = point_at(weights).distance(node);
                    // A point above a straight edge is no minimum, since the edge comes closer on one side.
                    let is_least = |weights: [f64; 3]| {
                        [[1, 2], [2, 0], [0, 1]].iter().all(|&[i, j]| {
                            [1e-4, -1e-4].iter().all(|step| {
                                let mut beside = weights;
                                beside[i] += step;
                                beside[j] -= step;
                                near.distance(point_at(beside)) > distance
                            })
                        })
                    };
                    if weights.iter().all(|&weight| weight > 1e-3)
                        && distance < best.1.min(f64::from(WITHIN))
                        && near.distance(point_at(weights)) > distance - 1e-9
                        && is_least(weights)
                    {
                        best = (weights, distance);
                    }
                }
            }
            let told = solid.closest(corners, WITHIN);
            let tally = &mut seen[count - 2];
            let inner = best.0[..count].iter().all(|&weight| weight > 1e-3);
            let Some(told) = told else {
                // Not found: it is far away, or closest at a corner or border, where another feature is in contact.
                assert!(
                    best.1 > 0.99 * f64::from(WITHIN) || !inner && best.1 > -1e-7,
                    "{name}: {corners:?}: {best:?} is not found"
                );
                tally[0] += 1;
                continue;
            };
            let weights = told.weights.map(f64::from);
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-6);
            assert!((told.normal.length() - 1.0).abs() < 1e-6);
            if told.inside {
                // The result is the distance of the point with these weights.
                let here = reference.signed(point_at(weights));
                assert!(
                    (here - f64::from(told.distance)).abs() < 2e-8,
                    "{name}: {corners:?}: {told:?}: {here}"
                );
            }
            // A slight overlap may be missed.
            if best.1 < -2e-5 {
                tally[3] += 1;
                // Cutting planes find the deepest point of a convex solid, elsewhere a deep one that is not at the
                // border.
                let convex = name == "cube" || name == "sphere";
                let least = if convex { 0.99 } else { 0.2 };
                assert!(told.distance < 0.0, "{name}: {corners:?}: {told:?} for {best:?}");
                let deep = f64::from(told.distance) <= least * best.1;
                if convex {
                    assert!(deep, "{name}: {corners:?}: {told:?} for {best:?}");
                } else {
                    lost += i32::from(inner && !(told.inside && deep));
                }
            } else if told.inside {
                tally[2] += 1;
                // A minimum in the interior is found, unless a border is closer.
                if inner {
                    assert!(
                        f64::from(told.distance) < best.1.max(0.0) + 2e-6,
                        "{name}: {corners:?}: {told:?} for {best:?}"
                    );
                }
            } else {
                tally[1] += 1;
                assert!(
                    f64::from(told.distance) > reference.signed(point_at(weights)) - 2e-8,
                    "{name}: {corners:?}: {told:?}"
                );
            }
        }
        // In a nonconvex solid the search may end at the border or in another dent.
        assert!(lost * 6 <= seen[0][3] + seen[1][3], "{name}: {lost} of {seen:?}");
        let [edges, faces] = seen;
        assert!(edges.iter().all(|&count| count > 1), "{name}: {seen:?}");
        // Few features of a solid with few convex corners meet one.
        assert!(
            faces[1] > 0 && faces[3] > 5 && (faces[2] > 0 || name != "sphere"),
            "{name}: {seen:?}"
        );
    }
}

/// Returns the weights of the projection of `point` to a face's plane.
fn foot(face: &[DVec3], point: DVec3) -> [f64; 3] {
    let normal = (face[1] - face[0]).cross(face[2] - face[0]);
    let part = |a: usize, b: usize| normal.dot((face[b] - face[a]).cross(point - face[a])) / normal.length_squared();
    [part(1, 2), part(2, 0), part(0, 1)]
}

/// By the solid angle only near the surface.
fn reference_is_inside(solid: &ExactSolid, reference: &Reference, point: DVec3, distance: f64) -> bool {
    if distance < 1e-6 {
        reference.is_inside(point)
    } else {
        solid.is_inside(point.as_vec3())
    }
}

#[test]
fn crossings_alternate() {
    let mut random = Random(23);
    for (name, surface) in solids() {
        let solid = ExactSolid::new(&surface).expect("a solid");
        let reference = Reference::new(&surface);
        let mut crossed = 0;
        for turn in 0..600 {
            let [from, to] = if turn % 2 == 0 {
                [(); 2].map(|()| random_point(&mut random, &surface, 0.05))
            } else {
                // From node to node, through edges and nodes.
                let count = surface.triangles().len();
                let [a, b] =
                    [(); 2].map(|()| surface.positions()[surface.triangles()[random.below(count)][0] as usize]);
                [a + (a - b), b + (b - a)]
            };
            if reference.distance(from.as_dvec3()) < 1e-7 {
                continue;
            }
            let mut crossings = Vec::new();
            solid.crossings(from, to, |crossing| crossings.push(crossing));
            crossings.sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
            let mut winding = i32::from(reference.is_inside(from.as_dvec3()));
            let mut last = 0.0;
            let check = |winding: i32, from_fraction: f64, to_fraction: f64| {
                // Between two separate crossings the side agrees with the count.
                let middle = from.as_dvec3().lerp(to.as_dvec3(), 0.5 * (from_fraction + to_fraction));
                if to_fraction - from_fraction > 1e-4 && reference.distance(middle) > 1e-7 {
                    assert_eq!(
                        winding,
                        i32::from(reference.is_inside(middle)),
                        "{name}: {from} to {to}"
                    );
                }
            };
            for crossing in &crossings {
                check(winding, last, crossing.fraction);
                winding += if crossing.enters { 1 } else { -1 };
                last = crossing.fraction;
            }
            check(winding, last, 1.0);
            if reference.distance(to.as_dvec3()) > 1e-7 {
                assert_eq!(
                    winding,
                    i32::from(reference.is_inside(to.as_dvec3())),
                    "{name}: {from} to {to}"
                );
            }
            crossed += crossings.len();
        }
        assert!(crossed > 500, "{name}: {crossed}");
    }
}
