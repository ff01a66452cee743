//! Refused cuts change nothing, and a cut can be undone.

use super::block::{Body, bent, block, shaken};
use glam::{Vec3, vec3};
use sinew::Error;
use sinew::cutting::{CutSolid, Limits, Sweep};

/// Returns the full state of a solid as text.
fn state_text(solid: &CutSolid) -> String {
    format!(
        "{:?} {:?} {:?} {:?} {:?}",
        solid.cells(),
        solid.tetrahedra(),
        solid.triangles(),
        solid.vertices(),
        (0..solid.node_count()).map(|node| solid.rest(node)).collect::<Vec<_>>()
    )
}

fn cut_twice() -> Body {
    let mut body = Body::new(shaken([4, 4, 3], 3), bent);
    body.cut(
        [vec3(-1.0, 2.2, -1.0), vec3(-1.0, 1.9, 4.0)],
        [vec3(5.0, 1.7, -1.0), vec3(5.0, 2.0, 4.0)],
    );
    body.cut(
        [vec3(1.2, 1.0, 1.0), vec3(1.2, 1.2, 4.0)],
        [vec3(3.1, 3.3, 1.0), vec3(3.0, 3.3, 4.0)],
    );
    body
}

/// A cut that crosses both, and ends inside.
const THIRD: [[Vec3; 2]; 2] = [
    [vec3(2.0, 4.6, -1.0), vec3(2.2, 4.6, 4.0)],
    [vec3(2.9, 0.6, -1.0), vec3(2.7, 0.5, 4.0)],
];

#[test]
fn a_cut_beyond_the_limits_changes_nothing() {
    let mut body = cut_twice();
    let before = state_text(&body.solid);
    let room = |solid: &CutSolid| {
        [
            solid.node_count(),
            solid.vertices().len() as u32,
            solid.triangles().len() as u32,
        ]
    };
    let has = room(&body.solid);
    let mut free = cut_twice();
    free.cut(THIRD[0], THIRD[1]);
    let needed = room(&free.solid);
    let limits = |[nodes, vertices, triangles]: [u32; 3]| Limits {
        nodes,
        vertices,
        triangles,
    };
    for refused in 0..3 {
        let more = needed[refused] - has[refused];
        assert!(more > 3);
        for left in [1, 2, more / 2, more] {
            let mut most = needed;
            most[refused] -= left;
            let answer = body.try_cut(THIRD[0], THIRD[1], limits(most));
            assert!(matches!(answer, Err(Error::Capacity(_))), "{answer:?}");
            assert_eq!(state_text(&body.solid), before);
        }
    }
    assert!(body.try_cut(THIRD[0], THIRD[1], limits(needed)).is_ok());
    body.check();
}

#[test]
fn an_undone_cut_leaves_no_trace() {
    let mut body = cut_twice();
    let before = state_text(&body.solid);
    let sweep = body.sweep(THIRD[0], THIRD[1]);
    let near = body.solid.near(&sweep, &body.positions).unwrap();
    let first = body
        .solid
        .cut(&sweep, &body.follower.positions, &near, Limits::NONE)
        .unwrap();
    let after = state_text(&body.solid);
    assert_ne!(after, before);
    body.solid.undo();
    assert_eq!(state_text(&body.solid), before);
    body.solid.undo();
    assert_eq!(state_text(&body.solid), before);
    // For any order of the candidates, and with additional ones.
    let mut all: Vec<u32> = (0..body.solid.cells().len() as u32).rev().collect();
    all.extend(&near);
    let again = body
        .solid
        .cut(&sweep, &body.follower.positions, &all, Limits::NONE)
        .unwrap();
    assert_eq!(first, again);
    assert_eq!(state_text(&body.solid), after);
    body.apply(&again);
    body.check();
}

#[test]
fn a_stroke_continues_after_an_undone_step() {
    let position = |x: f32| [vec3(x, 2.2, -1.0), vec3(x, 1.9, 5.0)];
    let mut body = Body::new(block([4, 4, 4]), bent);
    let mut other = Body::new(block([4, 4, 4]), bent);
    for at in 0..60 {
        let [from, to] = [at, at + 1].map(|at| position(0.1 * at as f32 - 1.0));
        let astray = body.sweep(from, [to[0] + vec3(0.5, 1.0, 0.0), to[1] + vec3(0.5, 1.0, 0.0)]);
        let near = body.solid.near(&astray, &body.positions).unwrap();
        body.solid
            .cut(&astray, &body.follower.positions, &near, Limits::NONE)
            .unwrap();
        body.solid.undo();
        body.cut(from, to);
        other.cut(from, to);
        assert_eq!(state_text(&body.solid), state_text(&other.solid));
    }
    assert_eq!(body.check(), 2);
}

#[test]
fn arguments_are_checked() {
    let mut body = cut_twice();
    let before = state_text(&body.solid);
    let sweep = body.sweep(THIRD[0], THIRD[1]);
    let near = body.solid.near(&sweep, &body.positions).unwrap();
    let refused = |body: &mut Body, sweep: &Sweep, positions: &[Vec3], near: &[u32], expected_message: &str| {
        let message = body
            .solid
            .cut(sweep, positions, near, Limits::NONE)
            .unwrap_err()
            .to_string();
        assert!(message.contains(expected_message), "{message}");
        assert_eq!(state_text(&body.solid), before);
    };
    let positions = body.positions.clone();
    refused(&mut body, &sweep, &positions[1..], &near, "positions for");
    refused(&mut body, &sweep, &positions, &[7, 100_000], "candidate 100000");
    let broken = Sweep {
        end: [Vec3::NAN; 2],
        ..sweep
    };
    refused(&mut body, &broken, &positions, &near, "NaN");
    let node = body.solid.cells()[near[0] as usize].nodes[1];
    let mut wild = positions.clone();
    wild[node as usize].y = f32::INFINITY;
    refused(&mut body, &sweep, &wild, &near, &format!("node {node} "));
}

#[test]
fn invalid_solids_are_refused() {
    let (rest, cells) = block([2, 2, 2]);
    let refused = |rest: &[Vec3], cells: &[[u32; 4]], expected_message: &str| {
        let message = CutSolid::new(rest, cells, &[]).unwrap_err().to_string();
        assert!(message.contains(expected_message), "{message}");
    };
    let mut twice = cells.clone();
    twice.push(cells[3]);
    refused(&rest, &twice, "same side");
    refused(
        &rest,
        &[[0, 1, 3, 9], [0, 1, 3, 10], [0, 1, 3, 12]],
        "3 cells have the face",
    );
    refused(&rest, &[[0, 1, 4, 13], [0, 1, 4, 14]], "same side");
    refused(&rest, &[[0, 1, 3, 9], [13, 14, 16, 22], [0, 1, 3, 13]], "same side");
    refused(
        &rest,
        &[[0, 1, 3, 9], [10, 11, 14, 1]],
        "node 1 has 2 cells, of which 1",
    );
    refused(&rest, &[[0, 1, 2, 9]], "no volume");
    refused(&rest, &[[0, 1, 3, 27]], "node 27 of 27");
    let mut broken = rest.clone();
    broken[4].z = f32::NAN;
    refused(&broken, &cells, "rest position 4");
    // Cells may have either orientation.
    let turned: Vec<[u32; 4]> = cells.iter().map(|&[a, b, c, d]| [b, a, c, d]).collect();
    assert!(CutSolid::new(&rest, &turned, &[]).is_ok());
}
