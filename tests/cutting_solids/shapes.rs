//! Cuts of all shapes, through blocks of all kinds: conserved quantities and the expected number of pieces.

use super::block::{Body, bent, block, far, flat, shaken};
use glam::{Vec3, vec3};

/// Each block has sides of 6, 6 and 4.
fn blocks() -> Vec<Body> {
    let mut bodies = Vec::new();
    for deformation in [flat, bent, far] {
        bodies.push(Body::new(block([6, 6, 4]), deformation));
        bodies.push(Body::new(shaken([6, 6, 4], 3), deformation));
    }
    bodies
}

/// Returns the blade's edge upright at a point, through all of the block.
fn upright(x: f32, y: f32) -> [Vec3; 2] {
    [vec3(x, y, -3.0), vec3(x, y, 7.0)]
}

/// Cuts along lines; checks everything after each. Returns the number of pieces.
fn cut(body: &mut Body, lines: &[&[[Vec3; 2]]]) -> usize {
    let mut pieces = 1;
    for line in lines {
        body.cut_along(line);
        pieces = body.check();
    }
    pieces
}

#[test]
fn a_plane_separates_a_block_in_two() {
    for mut body in blocks() {
        assert_eq!(cut(&mut body, &[&[upright(-2.0, 2.3), upright(8.0, 3.6)]]), 2);
    }
}

#[test]
fn planes_through_nodes_edges_and_faces_separate_too() {
    for ends in [
        [upright(-2.0, 3.0), upright(8.0, 3.0)],
        [upright(3.0, 8.0), upright(3.0, -2.0)],
        [upright(-2.0, -2.0), upright(8.0, 8.0)],
        [upright(-2.0, 8.0), upright(8.0, -2.0)],
        [upright(-2.0, 3.01), upright(8.0, 2.99)],
        [
            [vec3(-2.0, -2.0, 2.0), vec3(-2.0, 8.0, 2.0)],
            [vec3(8.0, -2.0, 2.0), vec3(8.0, 8.0, 2.0)],
        ],
        [
            [vec3(-2.0, -2.0, -2.0), vec3(-2.0, 8.0, -2.0)],
            [vec3(8.0, -2.0, 8.0), vec3(8.0, 8.0, 8.0)],
        ],
    ] {
        for deformation in [flat, bent] {
            let mut body = Body::new(block([6, 6, 4]), deformation);
            assert_eq!(cut(&mut body, &[&ends]), 2, "{ends:?} {:?}", body.piece_volumes());
        }
    }
}

#[test]
fn crossing_planes_separate_a_block_in_four() {
    for mut body in blocks() {
        let (one, other) = (
            [upright(-2.0, 2.3), upright(8.0, 3.6)],
            [upright(2.7, 8.0), upright(3.2, -2.0)],
        );
        assert_eq!(cut(&mut body, &[&one, &other]), 4);
    }
}

#[test]
fn a_t_cut_separates_a_block_in_three() {
    for mut body in blocks() {
        let (one, other) = (
            [upright(-2.0, 2.3), upright(8.0, 3.6)],
            [upright(2.7, 8.0), upright(3.1, 2.2)],
        );
        assert_eq!(cut(&mut body, &[&one, &other]), 3);
    }
}

#[test]
fn a_cut_that_pauses_continues() {
    for (number, mut body) in blocks().into_iter().enumerate() {
        assert_eq!(cut(&mut body, &[&[upright(-2.0, 2.3), upright(3.4, 3.0)]]), 1);
        assert_eq!(
            cut(&mut body, &[&[upright(3.4, 3.0), upright(8.0, 3.6)]]),
            2,
            "block {number}"
        );
    }
}

#[test]
fn steps_are_one_stroke() {
    for steps in [7, 50, 333] {
        let line: Vec<[Vec3; 2]> = (0..=steps)
            .map(|at| at as f32 / steps as f32 * 10.0 - 2.0)
            .map(|x| upright(x, 2.3 + 0.1 * x))
            .collect();
        for mut body in blocks() {
            assert_eq!(cut(&mut body, &[&line]), 2, "{steps} steps: {:?}", body.piece_volumes());
        }
    }
}

#[test]
fn a_curved_stroke() {
    let line: Vec<[Vec3; 2]> = (0..=60)
        .map(|at| at as f32 / 60.0 * 10.0 - 2.0)
        .map(|x| upright(x, 3.0 + 1.2 * (1.1 * x).sin()))
        .collect();
    for mut body in blocks() {
        assert_eq!(cut(&mut body, &[&line]), 2, "{:?}", body.piece_volumes());
    }
}

#[test]
fn a_closed_loop_cuts_a_piece_out() {
    for steps in [4, 9, 40, 200] {
        let circle: Vec<[Vec3; 2]> = (0..=steps)
            .map(|at| ((at % steps) as f32 + 0.5) / steps as f32 * std::f32::consts::TAU)
            .map(|angle| upright(3.1 + 1.8 * angle.cos(), 2.9 + 1.8 * angle.sin()))
            .collect();
        for (number, mut body) in blocks().into_iter().enumerate() {
            assert_eq!(
                cut(&mut body, &[&circle]),
                2,
                "{steps} steps, block {number}: {:?}",
                body.piece_volumes()
            );
        }
    }
}

#[test]
fn far_from_the_origin() {
    let offset = vec3(2000.0, -1700.0, 900.0);
    for (mut rest, cells) in [block([6, 6, 4]), shaken([6, 6, 4], 3)] {
        for position in &mut rest {
            *position += offset;
        }
        let mut body = Body::new((rest, cells), flat);
        let circle: Vec<[Vec3; 2]> = (0..=30)
            .map(|at| (at % 30) as f32 / 30.0 * std::f32::consts::TAU)
            .map(|angle| upright(3.1 + 1.8 * angle.cos(), 2.9 + 1.8 * angle.sin()).map(|end| end + offset))
            .collect();
        let plane = [upright(-2.0, 2.3), upright(8.0, 3.6)].map(|edge| edge.map(|end| end + offset));
        assert_eq!(cut(&mut body, &[&circle]), 2);
        assert_eq!(cut(&mut body, &[&plane]), 4);
    }
}
