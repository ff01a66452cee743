//! Refused cuts change nothing, and a cut can be undone.

use super::sheet::{Body, flat, grid, unstructured, wavy};
use glam::{Vec3, vec2};
use sinew::Error;
use sinew::cutting::{CutSurface, Limits, Sweep};

/// Returns the full state of a surface as text.
fn state_text(surface: &CutSurface) -> String {
    format!("{surface:?}")
        .split("before")
        .next()
        .map(str::to_owned)
        .unwrap_or_default()
        + &format!(
            "{:?} {:?} {:?}",
            surface.cells(),
            surface.triangles(),
            surface.vertices()
        )
}

fn cut_twice() -> Body {
    let mut body = Body::new(unstructured(8, 3), wavy);
    body.cut(vec2(-1.0, 4.2), vec2(9.0, 3.7));
    body.cut(vec2(2.2, 2.0), vec2(6.1, 6.3));
    body
}

#[test]
fn a_cut_beyond_the_limits_changes_nothing() {
    let mut body = cut_twice();
    let before = state_text(&body.surface);
    let (from, to) = (vec2(2.0, 6.6), vec2(5.1, -1.0));
    let room = |surface: &CutSurface| {
        [
            surface.node_count(),
            surface.vertices().len() as u32,
            surface.triangles().len() as u32,
        ]
    };
    let [nodes, vertices, triangles] = room(&body.surface);
    let mut free = cut_twice();
    free.cut(from, to);
    let needed = room(&free.surface);
    for refused in 0..3 {
        let mut limits = needed;
        for left in 1..=(needed[refused] - [nodes, vertices, triangles][refused]) {
            limits[refused] = needed[refused] - left;
            let [nodes, vertices, triangles] = limits;
            let answer = body.try_cut(
                from,
                to,
                Limits {
                    nodes,
                    vertices,
                    triangles,
                },
            );
            assert!(matches!(answer, Err(Error::Capacity(_))), "{answer:?}");
            assert_eq!(state_text(&body.surface), before);
        }
    }
    let [nodes, vertices, triangles] = needed;
    assert!(
        body.try_cut(
            from,
            to,
            Limits {
                nodes,
                vertices,
                triangles
            }
        )
        .is_ok()
    );
    body.check();
}

#[test]
fn an_undone_cut_leaves_no_trace() {
    let mut body = cut_twice();
    let before = state_text(&body.surface);
    let sweep = body.sweep(vec2(2.0, 6.6), vec2(5.1, -1.0));
    let near = body.surface.near(&sweep, &body.positions).unwrap();
    let first = body
        .surface
        .cut(&sweep, &body.follower.positions, &near, Limits::NONE)
        .unwrap();
    assert_ne!(state_text(&body.surface), before);
    body.surface.undo();
    assert_eq!(state_text(&body.surface), before);
    body.surface.undo();
    assert_eq!(state_text(&body.surface), before);
    let mut turned = near.clone();
    turned.reverse();
    let again = body
        .surface
        .cut(&sweep, &body.follower.positions, &turned, Limits::NONE)
        .unwrap();
    assert_eq!(first, again, "for any order of the candidates");
    body.apply(&again);
    body.check();
}

#[test]
fn arguments_are_checked() {
    let mut body = cut_twice();
    let before = state_text(&body.surface);
    let sweep = body.sweep(vec2(2.0, 6.6), vec2(5.1, -1.0));
    let near = body.surface.near(&sweep, &body.positions).unwrap();
    let refused = |body: &mut Body, sweep: &Sweep, positions: &[Vec3], near: &[u32], expected_message: &str| {
        let message = body
            .surface
            .cut(sweep, positions, near, Limits::NONE)
            .unwrap_err()
            .to_string();
        assert!(message.contains(expected_message), "{message}");
        assert_eq!(state_text(&body.surface), before);
    };
    let positions = body.positions.clone();
    refused(&mut body, &sweep, &positions[1..], &near, "positions for");
    refused(&mut body, &sweep, &positions, &[7, 100_000], "candidate 100000");
    let broken = Sweep {
        end: [Vec3::NAN; 2],
        ..sweep
    };
    refused(&mut body, &broken, &positions, &near, "NaN");
    let node = body.surface.cells()[body.surface.triangles()[near[0] as usize].cell as usize].nodes[1];
    let mut wild = positions.clone();
    wild[node as usize].y = f32::INFINITY;
    refused(&mut body, &sweep, &wild, &near, &format!("node {node} "));
}

#[test]
fn surfaces_that_are_not_manifold_are_refused() {
    let (rest, cells) = grid(2);
    let refused = |rest: &[Vec3], cells: &[[u32; 3]], expected_message: &str| {
        let message = CutSurface::new(rest, cells).unwrap_err().to_string();
        assert!(message.contains(expected_message), "{message}");
    };
    let mut turned = cells.clone();
    turned[3].swap(0, 1);
    refused(&rest, &turned, "same direction");
    refused(&rest, &[[0, 1, 3], [1, 0, 4], [0, 1, 6]], "3 cells");
    refused(
        &rest,
        &[[0, 1, 3], [4, 5, 8], [4, 7, 6]],
        "node 4 has 2 cells, of which 1",
    );
    refused(&rest, &[[0, 1, 2]], "no area");
    refused(&rest, &[[0, 1, 9]], "node 9 of 9");
    let mut broken = rest.clone();
    broken[4].z = f32::NAN;
    refused(&broken, &cells, "rest position 4");
}

#[test]
fn a_blade_that_does_not_meet_the_surface_changes_nothing() {
    let mut body = Body::new(grid(6), flat);
    let all: Vec<u32> = (0..body.triangles.len() as u32).collect();
    let before = state_text(&body.surface);
    let position = Vec3::new(2.3, 2.4, 0.0);
    for (start, end) in [
        // Beside it, above it, at rest in it, along itself, in its plane, of zero length.
        (
            [position - 9.0 * Vec3::X, position - 9.0 * Vec3::X + Vec3::Z],
            [position - 5.0 * Vec3::X, position - 4.0 * Vec3::X + Vec3::Z],
        ),
        (
            [position + Vec3::Z, position + 2.0 * Vec3::Z],
            [position + Vec3::new(2.0, 2.0, 0.1), position + Vec3::new(2.0, 2.0, 3.0)],
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
    ] {
        let changes = body
            .surface
            .cut(&Sweep { start, end }, &body.follower.positions, &all, Limits::NONE)
            .unwrap();
        assert!(
            changes.rim.is_empty() && changes.nodes.is_empty(),
            "{start} to {end}: {changes:?}",
            start = start[1],
            end = end[1]
        );
        assert_eq!(state_text(&body.surface), before);
    }
}
