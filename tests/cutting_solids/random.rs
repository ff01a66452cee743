//! Many random cuts: nothing breaks, closed cuts separate pieces, and simulation elements stay well shaped.

use std::ops::Range;

use super::block::{Body, Mesh, bent, block, far, flat, shaken};
use crate::support::change_lists::Follower;
use crate::support::random::Random;
use glam::{Vec3, vec3};
use sinew::cutting::{Limits, Sweep};

/// Upright, or slightly tilted.
fn edge(x: f32, y: f32, lean: [f32; 2]) -> [Vec3; 2] {
    let lean = vec3(lean[0], lean[1], 0.0);
    [vec3(x, y, -4.0) - 3.0 * lean, vec3(x, y, 8.0) + 3.0 * lean]
}

#[test]
fn loops_of_any_size_and_speed_cut_a_piece_out() {
    loops_of_any_size_and_speed_cut_a_piece_out_of(0..30);
}

#[test]
#[ignore = "long"]
fn loops_of_any_size_and_speed_cut_a_piece_out_in_more_rounds() {
    loops_of_any_size_and_speed_cut_a_piece_out_of(30..90);
}

fn loops_of_any_size_and_speed_cut_a_piece_out_of(rounds: Range<usize>) {
    let blocks = [block([6, 6, 3]), shaken([6, 6, 3], 6), shaken([6, 6, 3], 7)];
    // Bends are no tighter than the elements: 0.65 edges.
    for round in rounds {
        let mut random = Random(100_000 + round as u64);
        let (x, y) = (random.between(2.5, 3.5), random.between(2.5, 3.5));
        let (wide, high) = (random.between(1.2, 2.2), random.between(1.2, 2.2));
        let steps = (4.0 * 100f64.powf(random.next())) as usize;
        let lean = [random.between(-0.1, 0.1), random.between(-0.1, 0.1)];
        let ellipse: Vec<[Vec3; 2]> = (0..=steps)
            .map(|at| (at % steps) as f32 / steps as f32 * std::f32::consts::TAU)
            .map(|angle| edge(x + wide * angle.cos(), y + high * angle.sin(), lean))
            .collect();
        let mut body = Body::new(blocks[round % 3].clone(), [flat, bent, far][round / 3 % 3]);
        body.cut_along(&ellipse);
        let volumes = body.piece_volumes();
        assert_eq!(
            body.check(),
            2,
            "round {round}: {steps} steps about {x} {y}, {wide} x {high}: {volumes:?}"
        );
    }
}

#[test]
fn random_strokes_from_side_to_side_separate_a_block() {
    random_strokes_from_side_to_side_separate_a_block_of(0..30);
}

#[test]
#[ignore = "long"]
fn random_strokes_from_side_to_side_separate_a_block_in_more_rounds() {
    random_strokes_from_side_to_side_separate_a_block_of(30..90);
}

fn random_strokes_from_side_to_side_separate_a_block_of(rounds: Range<usize>) {
    let blocks = [block([6, 6, 3]), shaken([6, 6, 3], 8), shaken([6, 6, 3], 9)];
    for round in rounds {
        let mut random = Random(200_000 + round as u64);
        let steps = (4.0 * 100f64.powf(random.next())) as usize;
        let [a, b, c] = [0; 3].map(|_| random.between(-0.5, 0.5));
        let lean = [random.between(-0.1, 0.1), random.between(-0.1, 0.1)];
        let line: Vec<[Vec3; 2]> = (0..=steps)
            .map(|at| 10.0 * at as f32 / steps as f32 - 2.0)
            .map(|x| {
                edge(
                    x,
                    3.0 + a * (0.5 * x).sin() + b * (1.3 * x).cos() + c * (2.1 * x).sin(),
                    lean,
                )
            })
            .collect();
        let mut body = Body::new(blocks[round % 3].clone(), [flat, bent, far][round / 3 % 3]);
        body.cut_along(&line);
        let volumes = body.piece_volumes();
        assert_eq!(
            body.check(),
            2,
            "round {round}: {steps} steps, {a} {b} {c}: {volumes:?}"
        );
    }
}

#[test]
fn three_hundred_cuts_in_sequence() {
    cuts_in_sequence(block([8, 8, 6]), 300, 1);
}

#[test]
#[ignore = "long"]
fn a_thousand_cuts_in_sequence() {
    cuts_in_sequence(shaken([8, 8, 6], 5), 1000, 2);
}

fn cuts_in_sequence(mesh: Mesh, cuts: usize, seed: u64) {
    let mut body = Body::new(mesh, bent);
    let (nodes, tetrahedra, triangles) = (
        body.positions.len(),
        body.solid.tetrahedra().len(),
        body.triangles.len(),
    );
    let before = body.worst_ratio();
    let mut random = Random(seed);
    let mut worst = 0.0f64;
    for cut in 0..cuts {
        let start = random.point(-1.0, 9.0);
        let (edge, displacement, turn) = (
            random.point(-2.0, 2.0),
            random.point(-1.5, 1.5),
            random.point(-0.5, 0.5),
        );
        // The wounds open, and nodes move at random.
        let Follower { positions, rest, .. } = &mut body.follower;
        for (position, &rest) in positions.iter_mut().zip(&*rest) {
            *position = bent(rest) + random.point(-0.1, 0.1);
        }
        let sweep = Sweep {
            start: [start, start + edge],
            end: [start + displacement, start + displacement + edge + turn],
        };
        let near = body.solid.near(&sweep, &body.positions).unwrap();
        let changes = body
            .solid
            .cut(&sweep, &body.follower.positions, &near, Limits::NONE)
            .unwrap();
        body.apply(&changes);
        if cut % 100 == 99 {
            body.check();
            worst = worst.max(body.worst_ratio() / before);
        }
    }
    let more = [
        body.positions.len() - body.bound.len() - nodes,
        body.solid.tetrahedra().len() - tetrahedra,
        body.solid.triangles().len() - triangles,
    ];
    assert!(worst < 2.0, "stiffness by mass {worst} times what it was");
    // A cut crosses about 20 edges with five tetrahedra around each, and the elements that earlier cuts created.
    assert!(
        more[0] < 2 * cuts && more[1] < 120 * cuts && more[2] < 80 * cuts,
        "more nodes, tetrahedra, triangles: {more:?}"
    );
}
