//! Crossing cuts of solids in motion, and open strokes.

use glam::{DVec3, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::{BladeDefinition, Body, BodyId, Error, Solver, Storage, World};

use super::motion::{Matter, edge, enclosed, in_flight};
use crate::support::kept::kept;
use crate::support::scene::SOLVERS;

const THROUGH: [f32; 2] = [-0.02, 0.06];

/// Strokes through a block of 6, 5 and 4 cm, each from one point to another, and the number of pieces.
type StrokePattern = (&'static str, Vec<[[f32; 2]; 2]>, u32);

fn stroke_patterns() -> Vec<StrokePattern> {
    vec![
        (
            "a cross",
            vec![[[-0.02, 0.023], [0.08, 0.026]], [[0.031, -0.02], [0.027, 0.07]]],
            4,
        ),
        (
            "a slanting cross",
            vec![[[-0.02, 0.01], [0.08, 0.041]], [[-0.02, 0.043], [0.08, 0.008]]],
            4,
        ),
        (
            "a T",
            vec![[[-0.02, 0.023], [0.08, 0.026]], [[0.031, -0.02], [0.03, 0.035]]],
            3,
        ),
        (
            "a T whose foot comes first",
            vec![[[0.031, -0.02], [0.03, 0.04]], [[-0.02, 0.023], [0.08, 0.026]]],
            3,
        ),
        (
            "a star",
            vec![
                [[-0.02, 0.025], [0.08, 0.025]],
                [[0.01, -0.02], [0.05, 0.07]],
                [[0.052, -0.02], [0.013, 0.07]],
            ],
            0,
        ),
    ]
}

fn volume_of(body: &Body, rest: &mut Vec<DVec3>) -> f64 {
    for new in &body.changes_since(0).unwrap().nodes[rest.len() - 210..] {
        assert_eq!(new.node as usize, rest.len());
        let position = (0..3).map(|k| f64::from(new.weights[k]) * rest[new.sources[k] as usize]);
        rest.push(position.sum());
    }
    enclosed(body.surface(), |node| rest[node as usize])
}

#[test]
fn crossing_cuts_in_motion_keep_mass_momentum_and_volume() {
    crossing_cuts_in_motion_keep_mass_momentum_and_volume_of(&SOLVERS[..2]);
}

#[test]
#[ignore = "long"]
fn crossing_cuts_in_motion_keep_mass_momentum_and_volume_with_newton() {
    crossing_cuts_in_motion_keep_mass_momentum_and_volume_of(&SOLVERS[2..]);
}

fn crossing_cuts_in_motion_keep_mass_momentum_and_volume_of(solvers: &[Solver]) {
    for (figure, strokes, expected) in stroke_patterns() {
        for matter in [Matter::Springs, Matter::Elements] {
            for &solver in solvers {
                let what = format!("{figure}, {matter:?}, {solver:?}");
                let (mut world, body) = in_flight(matter, solver, Storage::Packed);
                let mut rest: Vec<DVec3> = super::motion::mesh()
                    .0
                    .iter()
                    .map(|position| position.as_dvec3())
                    .collect();
                assert_eq!(rest.len(), 210);
                let mut pieces = 1;
                for [from, to] in &strokes {
                    let mut last = None;
                    for step in 0..6 {
                        world.step(1e-3).unwrap();
                        let before = kept(&world, body);
                        let it = world.body(body).unwrap();
                        let at = |part: f32| [0, 1].map(|k| from[k] + (to[k] - from[k]) * part);
                        let end = edge(it, at((step + 1) as f32 / 6.0), THROUGH);
                        let sweep = Sweep {
                            start: last.unwrap_or(edge(it, at(0.0), THROUGH)),
                            end,
                        };
                        last = Some(end);
                        let report = world.cut(body, &sweep).unwrap();
                        pieces += report.pieces_parted;
                        let after = kept(&world, body);
                        after.check_motion(&before, &what);
                        let gained = (after.energy - before.energy).abs();
                        assert!(gained < 1e-6 * before.energy, "{what}: energy {gained}");
                        let it = world.body(body).unwrap();
                        let volume = volume_of(it, &mut rest);
                        assert!((volume / 1.2e-4 - 1.0).abs() < 1e-6, "{what}: {volume} m³");
                    }
                }
                let counted = world.body(body).unwrap().pieces().unwrap().count;
                assert_eq!(counted, pieces, "{what}");
                // Where three cuts meet there may be a seventh piece between them.
                let is_right = if expected == 0 {
                    (6..=7).contains(&pieces)
                } else {
                    pieces == expected
                };
                assert!(is_right, "{what}: {pieces} pieces");
            }
        }
    }
}

/// A block and an edge that has stopped in it.
fn with_open_stroke(solver: Solver) -> (World, BodyId, [Vec3; 2]) {
    let (mut world, body) = in_flight(Matter::Springs, solver, Storage::FastLink);
    world.step(1e-3).unwrap();
    let it = world.body(body).unwrap();
    let sweep = Sweep {
        start: edge(it, [-0.02, 0.023], THROUGH),
        end: edge(it, [0.032, 0.026], THROUGH),
    };
    world.cut(body, &sweep).unwrap();
    (world, body, sweep.end)
}

#[test]
fn a_refused_cut_leaves_the_stroke_and_the_step_open() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut worlds = [with_open_stroke(solver), with_open_stroke(solver)];
        for (world, body, stopped) in &mut worlds {
            // A held node's step must be closed before it is copied.
            world.body_mut(*body).unwrap().pin(100).unwrap();
            world.step(1e-3).unwrap();
            let _ = stopped;
        }
        assert_eq!(worlds[0].0.state_hash(), worlds[1].0.state_hash());
        let (world, body, stopped) = &mut worlds[0];
        let hash = world.state_hash();
        let it = world.body(*body).unwrap();
        let end = edge(it, [0.08, 0.029], THROUGH);
        for bad in [[Vec3::NAN; 2], [vec3(f32::INFINITY, 0.0, 0.0); 2]] {
            let sweep = Sweep {
                start: *stopped,
                end: bad,
            };
            assert!(world.cut(*body, &sweep).is_err());
            assert_eq!(world.state_hash(), hash, "{solver:?}");
        }
        // Both continue as if nothing had been requested.
        for (world, body, stopped) in &mut worlds {
            let sweep = Sweep { start: *stopped, end };
            let report = world.cut(*body, &sweep).unwrap();
            assert_eq!(report.pieces_parted, 1, "{solver:?}");
            world.step(1e-3).unwrap();
        }
        assert_eq!(worlds[0].0.state_hash(), worlds[1].0.state_hash(), "{solver:?}");
    }
}

#[test]
fn a_cut_that_exceeds_the_rows_leaves_the_step_open() {
    let (mut world, body) = in_flight(Matter::Springs, Solver::Verlet, Storage::FastLink);
    let at = |i: u32, j: u32, k: u32| (k * 6 + j) * 7 + i;
    // Rows are full on both sides, and a held node's step must be closed before it is copied.
    let it = world.body_mut(body).unwrap();
    let mut is_full = false;
    for full in (1..4).flat_map(|k| (2..4).flat_map(move |j| (1..6).map(move |i| at(i, j, k)))) {
        // On the same side of the cut, which therefore does not sever them.
        let side = |node: u32| node / 7 % 6 < 3;
        for other in (0..210).filter(|&other| other != full && side(other) == side(full)) {
            match it.add_spring(full, other, 1.0, Some(0.02)) {
                Err(Error::Capacity(_)) => is_full = true,
                Err(Error::InvalidArgument(_)) => {}
                answer => answer.unwrap(),
            }
        }
    }
    assert!(is_full);
    (0..210).for_each(|node| it.pin(node).unwrap());
    (0..210)
        .filter(|node| node % 2 == 0)
        .for_each(|node| it.unpin(node).unwrap());
    world.step(1e-3).unwrap();
    let before = world.state_hash();
    let it = world.body(body).unwrap();
    let sweep = Sweep {
        start: edge(it, [-0.02, 0.024], THROUGH),
        end: edge(it, [0.037, 0.025], THROUGH),
    };
    let answer = world.cut(body, &sweep);
    assert!(matches!(answer, Err(Error::Capacity(_))), "{answer:?}");
    assert_eq!(world.state_hash(), before);
}

#[test]
fn open_strokes_are_in_the_hash() {
    // An edge that stopped beside the block, and one that stopped elsewhere: only the stroke differs.
    let hashes = [0.023_f32, 0.03].map(|y| {
        let (mut world, body) = in_flight(Matter::Springs, Solver::Verlet, Storage::Packed);
        world.step(1e-3).unwrap();
        let it = world.body(body).unwrap();
        let sweep = Sweep {
            start: edge(it, [-0.04, y], THROUGH),
            end: edge(it, [-0.02, y], THROUGH),
        };
        assert_eq!(world.cut(body, &sweep).unwrap().new_nodes, 0);
        world.state_hash()
    });
    assert_ne!(hashes[0], hashes[1]);
}

#[test]
fn blades_that_cross_in_one_instant_leave_no_bridge() {
    blades_that_cross_in_one_instant_leave_no_bridge_of(|matter, steps| matter == Matter::Springs && steps == 60);
}

#[test]
#[ignore = "long"]
fn blades_that_cross_in_one_instant_leave_no_bridge_in_the_other_cases() {
    blades_that_cross_in_one_instant_leave_no_bridge_of(|matter, steps| matter != Matter::Springs || steps != 60);
}

fn blades_that_cross_in_one_instant_leave_no_bridge_of(is_selected: fn(Matter, usize) -> bool) {
    for (matter, solver) in [
        (Matter::Elements, Solver::Implicit),
        (Matter::Springs, Solver::Verlet),
        (Matter::Elements, Solver::Verlet),
    ] {
        for steps in [60, 20, 75].into_iter().filter(|&steps| is_selected(matter, steps)) {
            let (mut world, body) = in_flight(matter, solver, Storage::Packed);
            let still = vec![Vec3::ZERO; 210];
            world.body_mut(body).unwrap().set_velocities(&still).unwrap();
            let it = world.body(body).unwrap();
            // They reach the middle together.
            let paths = [
                [edge(it, [-0.01, 0.021], THROUGH), edge(it, [0.066, 0.027], THROUGH)],
                [
                    edge(it, [0.0252, -0.0138], THROUGH),
                    edge(it, [0.0308, 0.0618], THROUGH),
                ],
            ];
            let blades = paths.map(|[start, _]| {
                let middle = 0.5 * (start[0] + start[1]);
                let mut definition = BladeDefinition::new(start.map(|end| end - middle));
                definition.pose.position = middle;
                world.create_blade(&definition).unwrap()
            });
            for step in 1..=steps {
                for (&blade, [start, end]) in blades.iter().zip(&paths) {
                    let [from, to] = [start, end].map(|edge| 0.5 * (edge[0] + edge[1]));
                    let position = from.lerp(to, step as f32 / steps as f32);
                    world.set_blade_pose(blade, position, None).unwrap();
                }
                world.step(1e-3).unwrap();
            }
            let count = world.body(body).unwrap().pieces().unwrap().count;
            assert_eq!(count, 4, "{matter:?}, {solver:?}, {steps} steps");
        }
    }
}
