//! Cuts of all shapes, on sheets of all kinds: conserved quantities and the expected number of pieces.

use super::sheet::{Body, far, flat, grid, snap, unstructured, wavy};
use glam::{Vec2, vec2};

/// Each sheet has sides of 12 and spans 0 to 12.
fn sheets() -> Vec<Body> {
    let mut bodies = Vec::new();
    for deformation in [flat, wavy, far] {
        bodies.push(Body::new(grid(12), deformation));
        bodies.push(Body::new(unstructured(12, 3), deformation));
        bodies.push(Body::new(unstructured(12, 4), deformation));
    }
    bodies
}

/// Cuts along lines; checks everything after each, and the position of the cut boundary. Returns the number of pieces.
fn cut(body: &mut Body, lines: &[&[Vec2]]) -> usize {
    let mut pieces = 0;
    let uncut = body.rim().is_empty();
    for (at, line) in lines.iter().enumerate() {
        body.cut_along(line);
        pieces = body.check();
        if at == 0 && uncut {
            let inside = inside(line);
            let (rim, path) = body.distance_from_path(&inside);
            let snap = snap(body) * 1.002;
            assert!(rim <= snap && path <= snap, "rim {rim}, path {path}, snap {snap}");
        }
    }
    pieces
}

/// Returns the part of a line on the sheet, if only its ends are off the sheet.
fn inside(line: &[Vec2]) -> Vec<Vec2> {
    let is_inside = |point: Vec2| point.cmpge(Vec2::ZERO).all() && point.cmple(Vec2::splat(12.0)).all();
    let mut points = Vec::new();
    for segment in line.windows(2) {
        let inside = (0..=1000)
            .map(|step| segment[0].lerp(segment[1], step as f32 / 1000.0))
            .filter(|&point| is_inside(point));
        points.extend(inside.clone().next());
        points.extend({
            let mut inside = inside;
            inside.next_back()
        });
    }
    points
}

#[test]
fn a_straight_cut_separates_a_sheet_in_two() {
    for mut body in sheets() {
        assert_eq!(cut(&mut body, &[&[vec2(-1.0, 5.3), vec2(13.0, 6.9)]]), 2);
        let pieces = body.pieces();
        let mut by_side = [None; 2];
        for triangle in body.surface.triangles() {
            let corners = triangle.corners.map(|corner| body.surface.rest_place(corner));
            let middle = corners.iter().sum::<glam::DVec3>() / 3.0;
            let side = &mut by_side[usize::from(middle.y > 5.3 + (middle.x + 1.0) * 1.6 / 14.0)];
            for node in body.surface.cells()[triangle.cell as usize].nodes {
                assert_eq!(
                    *side.get_or_insert(pieces[node as usize]),
                    pieces[node as usize],
                    "node {node}"
                );
            }
        }
        assert_ne!(by_side[0], by_side[1]);
    }
}

#[test]
fn a_cut_through_nodes_and_along_edges_separates_too() {
    for ends in [
        [vec2(-1.0, 6.0), vec2(13.0, 6.0)],
        [vec2(6.0, 13.0), vec2(6.0, -1.0)],
        [vec2(-1.0, -1.0), vec2(13.0, 13.0)],
        [vec2(-1.0, 13.0), vec2(13.0, -1.0)],
        [vec2(-1.0, 6.01), vec2(13.0, 5.99)],
    ] {
        for deformation in [flat, wavy] {
            let mut body = Body::new(grid(12), deformation);
            assert_eq!(cut(&mut body, &[&ends]), 2, "{ends:?}");
        }
    }
}

#[test]
fn a_cut_that_pauses_and_turns_continues() {
    let curve: Vec<Vec2> = (0..=70)
        .map(|at| at as f32 * 0.2 - 1.0)
        .map(|x| vec2(x, 6.0 + 2.5 * (0.8 * x).sin()))
        .collect();
    for mut body in sheets() {
        assert_eq!(cut(&mut body, &[&curve]), 2);
    }
    // As slow as a hundredth of an edge per step, and not through the sheet.
    let slow: Vec<Vec2> = (0..=300)
        .map(|at| vec2(3.3 + 0.01 * at as f32, 4.2 + 0.004 * at as f32))
        .collect();
    for mut body in sheets() {
        assert_eq!(cut(&mut body, &[&slow]), 1);
    }
}

#[test]
fn a_t_and_a_crossing() {
    for mut body in sheets() {
        let (across, half): ([Vec2; 2], [Vec2; 2]) =
            ([vec2(-1.0, 5.8), vec2(13.0, 6.3)], [vec2(4.7, 13.0), vec2(5.2, 5.5)]);
        assert_eq!(cut(&mut body, &[&across, &half]), 3);
    }
    for mut body in sheets() {
        let (across, over) = ([vec2(-1.0, 5.8), vec2(13.0, 6.3)], [vec2(4.7, 13.0), vec2(7.2, -1.0)]);
        assert_eq!(cut(&mut body, &[&across, &over]), 4);
    }
    // Crossing cuts in the interior separate nothing; the last one, from the crossing to the border and back, makes a
    // piece.
    for mut body in sheets() {
        let (one, other) = ([vec2(3.1, 5.8), vec2(9.2, 6.3)], [vec2(5.7, 3.1), vec2(6.4, 9.2)]);
        assert_eq!(cut(&mut body, &[&one, &other]), 1);
        assert_eq!(cut(&mut body, &[&[vec2(3.5, 5.0), vec2(3.5, 13.0)]]), 1);
        assert_eq!(cut(&mut body, &[&[vec2(3.0, 8.6), vec2(8.0, 8.7)]]), 2);
    }
}

#[test]
fn a_closed_loop_cuts_a_piece_out() {
    for steps in [9, 40, 400] {
        let circle: Vec<Vec2> = (0..=steps)
            .map(|at| (at % steps) as f32 / steps as f32 * std::f32::consts::TAU)
            .map(|angle| vec2(6.1, 5.9) + 3.3 * Vec2::from_angle(angle))
            .collect();
        for mut body in sheets() {
            assert_eq!(cut(&mut body, &[&circle]), 2, "{steps} steps");
        }
    }
}

#[test]
fn a_small_loop_within_one_cell() {
    let (rest, cells) = (
        vec![glam::Vec3::ZERO, 10.0 * glam::Vec3::X, 10.0 * glam::Vec3::Y],
        vec![[0, 1, 2]],
    );
    let circle: Vec<Vec2> = (0..=12)
        .map(|at| (at % 12) as f32 / 12.0 * std::f32::consts::TAU)
        .map(|angle| vec2(2.9, 3.1) + 1.8 * Vec2::from_angle(angle))
        .collect();
    let mut body = Body::new((rest, cells), flat);
    body.cut_along(&circle[..8]);
    assert_eq!((body.check(), body.nodes_that_move()), (1, 3));
    body.cut_along(&circle[7..]);
    assert_eq!((body.check(), body.nodes_that_move()), (2, 6));
}

#[test]
fn a_cut_reports_where_it_ends() {
    for mut body in sheets() {
        assert_eq!(body.cut(vec2(-1.0, 5.3), vec2(7.21, 6.9)).ends.len(), 1);
        assert_eq!(
            body.cut(vec2(7.21, 6.9), vec2(7.21, 6.9)).ends.len(),
            0,
            "the blade does not move"
        );
        let changes = body.cut(vec2(7.21, 6.9), vec2(5.0, 8.7));
        let end = changes.ends[0];
        assert!(
            changes
                .rim
                .iter()
                .any(|edge| edge.points.contains(&body.surface.vertices()[end as usize].point))
        );
        assert!(
            body.cut(vec2(5.0, 8.7), vec2(4.0, 13.7)).ends.is_empty(),
            "it has left the sheet"
        );
        assert_eq!(body.check(), 2);
    }
}
