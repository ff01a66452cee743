//! The material separates along the path of the blade, and nowhere else.

use super::block::{Body, bent, block, flat, shaken, snap, volume};
use crate::support::random::Random;
use glam::{DVec3, Vec3, vec3};
use sinew::cutting::{Limits, Sweep};

/// Returns the tetrahedron that contains a point of the rest shape.
fn find(body: &Body, position: DVec3) -> Option<usize> {
    body.solid.tetrahedra().iter().position(|tetrahedron| {
        let corners = tetrahedron.corners.map(|corner| body.solid.rest_place(corner));
        (0..4).all(|k| {
            let mut with = corners;
            with[k] = position;
            volume(with) >= 0.0
        })
    })
}

/// Returns a sweep along a random plane through the middle of a block of this size, beyond its sides, and the plane's
/// normal.
fn across(random: &mut Random, size: Vec3) -> (Sweep, DVec3) {
    let middle = 0.5 * size + random.point(-0.5, 0.5);
    let normal = random.point(-1.0, 1.0).normalize();
    let along = normal.any_orthonormal_vector();
    let up = normal.cross(along);
    let at = |a: f32, b: f32| middle + 5.0 * (a * along + b * up);
    let sweep = Sweep {
        start: [at(-1.0, -1.0), at(-1.0, 1.0)],
        end: [at(1.0, -1.0), at(1.0, 1.0)],
    };
    (sweep, normal.as_dvec3())
}

#[test]
fn the_two_sides_of_a_plane_are_different_pieces() {
    let size = vec3(5.0, 4.0, 4.0);
    for round in 0..24 {
        let mut random = Random(300 + round);
        let mesh = [block([5, 4, 4]), shaken([5, 4, 4], round)][round as usize % 2].clone();
        let mut body = Body::new(mesh, flat);
        let (sweep, normal) = across(&mut random, size);
        let changes = body.cut(sweep.start, sweep.end);
        assert_eq!(body.check(), 2, "round {round}");
        let snap = snap(&body);
        let height = |position: DVec3| normal.dot(position - sweep.start[0].as_dvec3());
        let mut area = 0.0;
        for face in &changes.faces {
            area += face.area;
            for triangle in face.triangles {
                for corner in body.solid.triangles()[triangle as usize].corners {
                    let distance = height(body.solid.rest_place(corner)).abs();
                    assert!(
                        distance <= 1.001 * snap,
                        "round {round}: the cut is {distance} off the blade"
                    );
                }
            }
        }
        for edge in &changes.rim {
            let [inner, skin] = [edge.triangle, edge.across].map(|triangle| body.solid.triangles()[triangle as usize]);
            assert!(inner.is_inner && !skin.is_inner);
            for triangle in [inner, skin] {
                let points = triangle
                    .corners
                    .map(|corner| body.solid.vertices()[corner as usize].point);
                assert!(edge.points.iter().all(|point| points.contains(point)));
            }
        }
        // Points on the blade, and the fraction of the blade inside the block.
        let pieces = body.piece_of_each();
        let (mut inside, mut tried) = (0, 0);
        let [a, b, c] = [sweep.start[0], sweep.start[1], sweep.end[0]];
        let mut sides = [None; 2];
        for at in 0..1600 {
            let [i, j] = [at % 40, at / 40].map(|k| (k as f32 + 0.5) / 40.0);
            let position = a + (b - a) * i + (c - a) * j;
            tried += 1;
            if position.cmplt(Vec3::ZERO).any() || position.cmpgt(size).any() {
                continue;
            }
            inside += 1;
            for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
                let position = position.as_dvec3() + sign * 1.01 * snap * normal;
                if let Some(found) = find(&body, position) {
                    let side_piece = *sides[side].get_or_insert(pieces[found]);
                    assert_eq!(side_piece, pieces[found], "round {round}: at {position}");
                }
            }
        }
        assert_ne!(sides[0], sides[1]);
        let swept = 100.0 * inside as f64 / tried as f64;
        assert!(
            (area / swept - 1.0).abs() < 0.1 && inside > 100,
            "round {round}: {area} was cut of {swept}"
        );
    }
}

#[test]
fn a_cut_that_ends_inside_opens_up_to_there() {
    for round in 0..20 {
        let mut random = Random(500 + round);
        let mesh = [block([6, 5, 4]), shaken([6, 5, 4], round)][round as usize % 2].clone();
        let mut body = Body::new(mesh, flat);
        let (x, y) = (random.between(2.0, 4.0), random.between(1.8, 3.2));
        let (lean, low) = (random.between(-0.2, 0.2), random.between(0.5, 1.5));
        let changes = body.cut(
            [vec3(-1.0, y, low), vec3(-1.0, y + lean, 9.0)],
            [vec3(x, y, low), vec3(x, y + lean, 9.0)],
        );
        assert_eq!(body.check(), 1);
        let snap = snap(&body);
        let normal = DVec3::new(0.0, 9.0 - low as f64, -lean as f64).normalize();
        let mut area = 0.0;
        for face in &changes.faces {
            area += face.area;
            for corner in body.solid.triangles()[face.triangles[0] as usize].corners {
                let position = body.solid.rest_place(corner);
                let distance = normal.dot(position - DVec3::new(0.0, y as f64, low as f64)).abs();
                assert!(distance <= 1.001 * snap, "{distance} off the blade");
                // Snapped vertices lie beyond the blade's ends by at most the snapping distance.
                assert!(position.x <= x as f64 + 1.001 * snap && position.z >= low as f64 - 1.001 * snap);
            }
        }
        // The opened region lags behind the blade by less than an element.
        let (swept, inner) = (
            x as f64 * (4.0 - low as f64),
            (x as f64 - 1.5) * (4.0 - low as f64 - 1.5),
        );
        assert!(
            area > inner && area < 1.1 * swept,
            "{area} of {swept}, {inner} at least"
        );
    }
}

#[test]
fn a_stroke_in_steps_does_what_one_step_does() {
    for round in 0..12 {
        let mut random = Random(700 + round);
        let mesh = [block([4, 4, 4]), shaken([4, 4, 4], round)][round as usize % 2].clone();
        let (sweep, _) = across(&mut random, Vec3::splat(4.0));
        let mut whole = Body::new(mesh.clone(), flat);
        whole.cut(sweep.start, sweep.end);
        let steps = 3 + 40 * (round as usize % 4);
        let mut stepped = Body::new(mesh, flat);
        let line: Vec<[Vec3; 2]> = (0..=steps)
            .map(|at| [0, 1].map(|k| sweep.start[k].lerp(sweep.end[k], at as f32 / steps as f32)))
            .collect();
        stepped.cut_along(&line);
        assert_eq!((whole.check(), stepped.check()), (2, 2), "round {round}");
        for (a, b) in whole.piece_volumes().iter().zip(stepped.piece_volumes()) {
            // Each vertex is snapped by at most a twentieth of an edge.
            assert!((a - b).abs() < 0.5, "round {round}: {a} and {b}");
        }
    }
}

#[test]
fn a_sawing_blade_separates_once() {
    let position = |x: f32| [vec3(x, 2.2 + 0.1 * x, -1.0), vec3(x, 2.0 + 0.1 * x, 5.0)];
    for mesh in [block([5, 4, 4]), shaken([5, 4, 4], 2)] {
        let mut body = Body::new(mesh, bent);
        let mut line = Vec::new();
        for step in 0..160 {
            let at = step as f32 * 0.05 - 1.0;
            line.push(position(at + 0.6 * (step as f32 * 0.9).sin()));
        }
        body.cut_along(&line);
        assert_eq!(body.check(), 2, "{:?}", body.piece_volumes());
    }
}

#[test]
fn a_rocking_blade_separates_once() {
    for (mesh, pace) in [
        (block([5, 4, 4]), 0.9),
        (shaken([5, 4, 4], 2), 0.9),
        (shaken([5, 4, 4], 7), 2.1),
    ] {
        let mut body = Body::new(mesh, flat);
        let mut line = Vec::new();
        for step in 0..200 {
            let (at, rock) = (step as f32 * 0.05 - 2.0, 1.5 * (step as f32 * pace).sin());
            line.push([vec3(at + rock, 2.13, -1.0), vec3(at - rock, 2.03, 5.0)]);
        }
        body.cut_along(&line);
        assert_eq!(body.check(), 2, "{:?}", body.piece_volumes());
    }
}

#[test]
fn a_later_stroke_continues_an_earlier_one() {
    let position = |x: f32| [vec3(x, 2.23, -1.0), vec3(x, 2.04, 5.0)];
    for mesh in [block([5, 4, 4]), shaken([5, 4, 4], 2)] {
        for end in [0.4, 1.1, 1.6, 2.0, 2.45, 2.7, 3.3, 4.0] {
            // From the other side, or again from the first.
            for (from, to) in [(6.0, end - 0.05), (end - 0.3, 6.0), (-1.0, 6.0)] {
                let mut body = Body::new(mesh.clone(), flat);
                body.cut(position(-1.0), position(end));
                assert_eq!(body.check(), 1);
                body.cut(position(from), position(to));
                assert_eq!(body.check(), 2, "{end}, {from} to {to}: {:?}", body.piece_volumes());
            }
        }
    }
}

#[test]
fn a_notch_in_a_single_cell_opens_when_it_is_severed() {
    let rest = vec![Vec3::ZERO, 4.0 * Vec3::X, 4.0 * Vec3::Y, 4.0 * Vec3::Z];
    let position = |x: f32| [vec3(x, -1.0, 1.1), vec3(x, 9.0, 1.2)];
    let mut body = Body::new((rest, vec![[0, 1, 2, 3]]), flat);
    body.cut(position(-1.0), position(1.0));
    assert_eq!((body.check(), body.nodes_that_move()), (1, 4));
    body.cut(position(1.0), position(2.0));
    assert_eq!((body.check(), body.nodes_that_move()), (1, 4));
    body.cut(position(2.0), position(3.5));
    assert_eq!((body.check(), body.nodes_that_move()), (2, 8));
    assert_eq!(body.solid.cells().len(), 2);
}

#[test]
fn close_parallel_cuts_leave_a_slice() {
    for gap in [0.25f32, 0.4, 0.7] {
        for mesh in [block([5, 4, 4]), shaken([5, 4, 4], 2)] {
            for is_there_and_back in [false, true] {
                let position = |x: f32, y: f32| [vec3(x, y, -1.0), vec3(x, y + 0.1, 5.0)];
                let mut body = Body::new(mesh.clone(), bent);
                body.cut(position(-1.0, 1.3), position(6.0, 1.3));
                if is_there_and_back {
                    body.cut(position(6.0, 1.3), position(6.0, 1.3 + gap));
                    body.cut(position(6.0, 1.3 + gap), position(-1.0, 1.3 + gap));
                } else {
                    body.cut(position(-1.0, 1.3 + gap), position(6.0, 1.3 + gap));
                }
                assert_eq!(body.check(), 3, "{gap}: {:?}", body.piece_volumes());
                let slice = body.piece_volumes()[0];
                assert!((slice / (20.0 * gap as f64) - 1.0).abs() < 0.3, "{gap}: {slice}");
            }
        }
    }
}

#[test]
fn a_blade_that_does_not_meet_the_material_changes_nothing() {
    let mut body = Body::new(block([3, 3, 3]), flat);
    let all: Vec<u32> = (0..body.solid.cells().len() as u32).collect();
    let position = vec3(1.3, 1.4, 1.2);
    for (start, end) in [
        // Beside it, at rest in it, along itself, of zero length, in one of its faces.
        (
            [position - 9.0 * Vec3::X, position - 9.0 * Vec3::X + Vec3::Z],
            [position - 5.0 * Vec3::X, position - 4.0 * Vec3::X + Vec3::Z],
        ),
        (
            [position - Vec3::Z, position + Vec3::Z],
            [position - Vec3::Z, position + Vec3::Z],
        ),
        (
            [position - Vec3::Z, position + Vec3::Z],
            [position - 2.0 * Vec3::Z, position + 2.0 * Vec3::Z],
        ),
        (
            [position - Vec3::Z, position - Vec3::Z],
            [position + Vec3::Z, position + Vec3::Z],
        ),
        (
            [vec3(-1.0, -1.0, 0.0), vec3(-1.0, 4.0, 0.0)],
            [vec3(4.0, -1.0, 0.0), vec3(4.0, 4.0, 0.0)],
        ),
        (
            [vec3(-1.0, -1.0, 3.0), vec3(-1.0, 4.0, 3.0)],
            [vec3(4.0, -1.0, 3.0), vec3(4.0, 4.0, 3.0)],
        ),
    ] {
        let changes = body
            .solid
            .cut(&Sweep { start, end }, &body.follower.positions, &all, Limits::NONE)
            .unwrap();
        assert!(
            changes.faces.is_empty() && changes.nodes.is_empty() && changes.sources.is_empty(),
            "{start:?} to {end:?}: {changes:?}"
        );
        body.apply(&changes);
        assert_eq!(body.check(), 1);
    }
}
