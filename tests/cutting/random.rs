//! Many random cuts: nothing breaks, closed cuts separate pieces, and simulation elements stay well shaped.

use super::sheet::{Body, far, flat, grid, snap, unstructured, wavy};
use crate::support::change_lists::Follower;
use crate::support::random::Random;
use glam::{Vec2, Vec3, vec2, vec3};

/// Rounds with rare cases.
const RARE: [usize; 1] = [1237];

#[test]
fn loops_of_any_size_and_speed_cut_a_piece_out() {
    loops_of_any_size_and_speed_cut_a_piece_out_of(0..70);
}

#[test]
#[ignore = "long"]
fn loops_of_any_size_and_speed_cut_a_piece_out_in_more_rounds() {
    loops_of_any_size_and_speed_cut_a_piece_out_of((70..200).chain(RARE));
}

fn loops_of_any_size_and_speed_cut_a_piece_out_of(rounds: impl Iterator<Item = usize>) {
    let sheets = [grid(12), unstructured(12, 6), unstructured(12, 7)];
    for round in rounds {
        let mut random = Random(100_000 + round as u64);
        let center = vec2(random.between(4.0, 8.0), random.between(4.0, 8.0));
        let (wide, high) = (random.between(0.6, 3.5), random.between(0.6, 3.5));
        let steps = (4.0 * 100f64.powf(random.next())) as usize;
        let ellipse: Vec<Vec2> = (0..=steps)
            .map(|at| (at % steps) as f32 / steps as f32 * std::f32::consts::TAU)
            .map(|angle| center + Vec2::from_angle(angle) * vec2(wide, high))
            .collect();
        let mut body = Body::new(sheets[round % 3].clone(), [flat, wavy, far][round / 3 % 3]);
        body.cut_along(&ellipse);
        let areas = body.piece_areas();
        assert_eq!(
            body.check(),
            2,
            "round {round}: {steps} steps about {center}, {wide} x {high}: {areas:?}"
        );
        let (rim, path) = body.distance_from_path(&ellipse);
        assert!(
            rim.max(path) < 1.002 * snap(&body),
            "round {round}: rim {rim}, path {path}, snap {}",
            snap(&body)
        );
    }
}

#[test]
fn random_lines_from_border_to_border_separate_a_sheet() {
    random_lines_from_border_to_border_separate_a_sheet_of(0..70);
}

#[test]
#[ignore = "long"]
fn random_lines_from_border_to_border_separate_a_sheet_in_more_rounds() {
    random_lines_from_border_to_border_separate_a_sheet_of((70..200).chain(RARE));
}

fn random_lines_from_border_to_border_separate_a_sheet_of(rounds: impl Iterator<Item = usize>) {
    let sheets = [grid(12), unstructured(12, 8), unstructured(12, 9)];
    for round in rounds {
        let mut random = Random(200_000 + round as u64);
        let steps = (4.0 * 100f64.powf(random.next())) as usize;
        let [a, b, c] = [0; 3].map(|_| random.between(-1.5, 1.5));
        let line: Vec<Vec2> = (0..=steps)
            .map(|at| 14.0 * at as f32 / steps as f32 - 1.0)
            .map(|x| vec2(x, 6.0 + a * (0.5 * x).sin() + b * (1.3 * x).cos() + c * (2.9 * x).sin()))
            .collect();
        let mut body = Body::new(sheets[round % 3].clone(), [flat, wavy, far][round / 3 % 3]);
        body.cut_along(&line);
        let areas = body.piece_areas();
        assert_eq!(body.check(), 2, "round {round}: {steps} steps, {a} {b} {c}: {areas:?}");
    }
}

#[test]
fn three_hundred_cuts_in_sequence() {
    cuts_in_sequence(unstructured(30, 2), 300, 1);
}

#[test]
#[ignore = "long"]
fn a_thousand_cuts_in_sequence() {
    cuts_in_sequence(unstructured(30, 2), 1000, 1);
    cuts_in_sequence(unstructured(99, 5), 1000, 2);
}

fn cuts_in_sequence(sheet: (Vec<Vec3>, Vec<[u32; 3]>), cuts: usize, seed: u64) {
    let side = sheet.0.last().map_or(0.0, |position| position.x);
    let mut body = Body::new(sheet, wavy);
    let (nodes, triangles) = (body.positions.len(), body.triangles.len());
    let before = body.worst_ratio();
    let mut random = Random(seed);
    let mut worst = 0.0f64;
    for cut in 0..cuts {
        let from = vec2(random.between(-1.0, side + 1.0), random.between(-1.0, side + 1.0));
        let displacement = Vec2::from_angle(random.between(0.0, 7.0)) * random.between(0.01, 8.0);
        // The wounds open, and nodes move at random.
        let Follower { positions, rest, .. } = &mut body.follower;
        for (position, &rest) in positions.iter_mut().zip(&*rest) {
            *position = wavy(rest) + 0.1 * vec3(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.0);
        }
        body.cut(from, from + displacement);
        if cut % 100 == 99 {
            body.check();
            worst = worst.max(body.worst_ratio() / before);
        }
    }
    let counts = [
        body.nodes_that_move(),
        body.surface.triangles().len(),
        body.surface.vertices().len(),
    ];
    assert!(worst < 2.0, "stiffness by mass {worst} times what it was");
    // A cut has a mean length of 4: it crosses at most about 15 edges. Each adds a vertex, a copy of it and three
    // triangles.
    assert!(
        counts[0] < nodes + 18 * cuts && counts[1] < triangles + 50 * cuts && counts[2] < nodes + 55 * cuts,
        "{nodes} nodes and {triangles} triangles, then nodes, triangles, vertices {counts:?}"
    );
    body.check();
}
