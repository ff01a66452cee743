//! Closed and curved surfaces, and blades in any position.

use super::sheet::{Body, flat};
use crate::support::random::Random;
use crate::support::solid::octahedral_ball;
use glam::{Vec3, vec3};
use sinew::cutting::{Limits, Sweep};

fn cut(body: &mut Body, start: [Vec3; 2], end: [Vec3; 2]) -> usize {
    let sweep = Sweep { start, end };
    let near = body.surface.near(&sweep, &body.positions).unwrap();
    let changes = body
        .surface
        .cut(&sweep, &body.follower.positions, &near, Limits::NONE)
        .unwrap();
    body.apply(&changes);
    changes.rim.len()
}

#[test]
fn a_blade_through_a_sphere_halves_it() {
    for z in [0.0, 0.1, -0.37] {
        let mut body = Body::new(octahedral_ball(4), flat);
        cut(
            &mut body,
            [vec3(-2.0, -2.0, z), vec3(-2.0, 2.0, z)],
            [vec3(2.0, -2.0, z), vec3(2.0, 2.0, z)],
        );
        assert_eq!(body.check(), 2, "at {z}");
        cut(
            &mut body,
            [vec3(0.3, -2.0, -2.0), vec3(0.2, 2.0, -2.0)],
            [vec3(0.2, -2.0, 2.0), vec3(0.3, 2.0, 2.0)],
        );
        assert_eq!(body.check(), 4, "at {z}");
    }
}

#[test]
fn a_blade_halfway_into_a_sphere_leaves_it_whole() {
    let mut body = Body::new(octahedral_ball(4), flat);
    cut(
        &mut body,
        [vec3(-2.0, -2.0, 0.1), vec3(-2.0, 2.0, 0.1)],
        [vec3(0.4, -2.0, 0.1), vec3(0.4, 2.0, 0.1)],
    );
    assert_eq!(body.check(), 1);
    cut(
        &mut body,
        [vec3(0.4, -2.0, 0.1), vec3(0.4, 2.0, 0.1)],
        [vec3(2.0, -2.0, 0.1), vec3(2.0, 2.0, 0.1)],
    );
    assert_eq!(body.check(), 2);
}

#[test]
fn blades_in_any_position_break_nothing() {
    let mut random = Random(9);
    let mut body = Body::new(octahedral_ball(4), flat);
    let before = body.worst_ratio();
    let mut point = |size: f32| {
        vec3(
            random.between(-size, size),
            random.between(-size, size),
            random.between(-size, size),
        )
    };
    let mut rim = 0;
    for round in 0..400 {
        let start = point(1.2);
        let (displacement, edge, turned) = (point(0.4), point(0.6), point(0.2));
        rim += cut(
            &mut body,
            [start, start + edge],
            [start + displacement, start + displacement + edge + turned],
        );
        if round % 25 == 24 {
            body.check();
        }
    }
    assert!(rim > 1000, "{rim} edges");
    assert!(body.worst_ratio() < 4.0 * before);
}
