//! Nearly incompressible solids that are cut: average nodal pressures separate without a jolt, and each piece reaches
//! its own rest shape.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::{
    Body, BodyDefinition, BodyId, Error, Material, Model, RestStateDefinition, Solver, Storage, Values, Viscosity,
    World, WorldDefinition,
};

use super::block::{shaken, upright};
use super::motion::{CUTS, Matter, edge, enclosed, in_flight, mesh};
use crate::support::kept::kept;
use crate::support::random::Random;
use crate::support::scene::SOLVERS;

#[derive(Clone, Copy)]
struct Tissue {
    poisson_ratio: f32,
    solver: Solver,
    /// Damping of each node (N s/m).
    damping: f32,
    is_viscous: bool,
    gravity: f32,
    substeps: u32,
}

const FREE: Tissue = Tissue {
    poisson_ratio: 0.49,
    solver: Solver::Verlet,
    damping: 0.0,
    is_viscous: false,
    gravity: 0.0,
    substeps: 0,
};

/// The block, with its nodes moved from rest by `place`.
fn tissue(parameters: Tissue, place: impl Fn(Vec3) -> Vec3) -> (World, BodyId) {
    let (rest, cells) = mesh();
    let positions: Vec<Vec3> = rest.iter().map(|&rest| place(rest)).collect();
    let mut world = World::new(WorldDefinition {
        gravity: vec3(0.0, parameters.gravity, 0.0),
        substeps: parameters.substeps,
        ..Default::default()
    })
    .unwrap();
    let time = if parameters.is_viscous { 0.05 } else { 0.0 };
    let body = world
        .create_body(&BodyDefinition {
            positions: &positions,
            rest_positions: Some(&rest),
            tetrahedra: &cells,
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: 3000.0,
                poisson_ratio: parameters.poisson_ratio,
                density: 1000.0,
                ..Default::default()
            }),
            viscosity: Viscosity {
                retardation_time: time,
                relaxation_time: time,
            },
            node_dampings: Values::Uniform(parameters.damping),
            spare_nodes: 3000,
            solver: parameters.solver,
            ..Default::default()
        })
        .unwrap();
    (world, body)
}

fn stretched(rest: Vec3) -> Vec3 {
    vec3(
        1.25 * rest.x + 0.2 * rest.y,
        0.9 * rest.y + 4.0 * rest.x * rest.x,
        0.9 * rest.z + 2.0 * rest.x * rest.y,
    )
}

/// Returns the rest positions of all points, tracked by change lists.
fn tracked_rest_positions(body: &Body) -> Vec<DVec3> {
    let mut positions: Vec<DVec3> = mesh().0.iter().map(|rest| rest.as_dvec3()).collect();
    for new in body.changes_since(0).unwrap().nodes {
        let place = (0..3).map(|k| f64::from(new.weights[k]) * positions[new.sources[k] as usize]);
        positions.push(place.sum());
    }
    positions
}

/// Returns the triangles of each piece's surface.
fn piece_surfaces(body: &Body) -> Vec<Vec<[u32; 3]>> {
    let pieces = body.pieces().unwrap();
    let mut piece_surfaces = BTreeMap::new();
    for &corners in body.surface() {
        let triangles: &mut Vec<[u32; 3]> = piece_surfaces.entry(pieces.of_nodes[corners[0] as usize]).or_default();
        triangles.push(corners);
    }
    piece_surfaces.into_values().collect()
}

/// Returns the largest difference between distances of a piece's surface points and those at rest (m).
fn distance_error(body: &Body, rest: &[DVec3]) -> f64 {
    let mut error = 0.0_f64;
    for skin in piece_surfaces(body) {
        let mut points: Vec<u32> = skin.into_iter().flatten().collect();
        points.sort_unstable();
        points.dedup();
        for (k, &a) in points.iter().enumerate() {
            for &b in &points[..k] {
                let [from, to] = [a, b].map(|point| body.positions()[point as usize].as_dvec3());
                error = error.max((from.distance(to) - rest[a as usize].distance(rest[b as usize])).abs());
            }
        }
    }
    error
}

/// Returns the largest relative volume error of a piece.
fn volume_error(body: &Body, rest: &[DVec3]) -> f64 {
    let piece_volume = |skin: Vec<[u32; 3]>| {
        let now = enclosed(&skin, |point| body.positions()[point as usize].as_dvec3());
        (now / enclosed(&skin, |point| rest[point as usize]) - 1.0).abs()
    };
    piece_surfaces(body).into_iter().map(piece_volume).fold(0.0, f64::max)
}

fn cut_across(world: &mut World, body: BodyId) {
    let it = world.body(body).unwrap();
    let sweep = Sweep {
        start: edge(it, [0.027, -0.03], [-0.03, 0.07]),
        end: edge(it, [0.031, 0.08], [-0.03, 0.07]),
    };
    let report = world.cut(body, &sweep).unwrap();
    assert_eq!(report.pieces_parted, 1);
}

#[test]
fn a_piece_reaches_its_own_rest_shape_and_keeps_its_volume() {
    a_piece_reaches_its_own_rest_shape_and_keeps_its_volume_of(&[
        (Solver::Verlet, 0.49, false),
        (Solver::Implicit, 0.45, true),
    ]);
}

#[test]
#[ignore = "long"]
fn a_piece_reaches_its_own_rest_shape_and_keeps_its_volume_in_the_other_cases() {
    a_piece_reaches_its_own_rest_shape_and_keeps_its_volume_of(&[
        (Solver::Verlet, 0.45, true),
        (Solver::Implicit, 0.49, false),
        (Solver::Newton, 0.49, false),
    ]);
}

fn a_piece_reaches_its_own_rest_shape_and_keeps_its_volume_of(cases: &[(Solver, f32, bool)]) {
    for &(solver, poisson_ratio, is_viscous) in cases {
        let what = format!("{poisson_ratio}, {solver:?}");
        let parameters = Tissue {
            poisson_ratio,
            solver,
            is_viscous,
            damping: 0.02,
            ..FREE
        };
        let (mut world, body) = tissue(parameters, stretched);
        for _ in 0..10 {
            world.step(2e-3).unwrap();
        }
        cut_across(&mut world, body);
        let it = world.body(body).unwrap();
        let rest = tracked_rest_positions(it);
        assert!(distance_error(it, &rest) > 1e-3, "{what}: strained when it is cut");
        // As nearly incompressible as the whole body: the pressure is a fraction of Young's modulus.
        let most = (2.0 * volume_error(it, &rest)).max(0.01);
        for step in 0..400 {
            world.step(2e-3).unwrap();
            if step % 10 == 0 {
                let error = volume_error(world.body(body).unwrap(), &rest);
                assert!(
                    error < most,
                    "{what}: a volume is off by {error}, {most} expected, at {step}"
                );
            }
        }
        let it = world.body(body).unwrap();
        let error = distance_error(it, &rest);
        assert!(error < 1e-4 * 0.06, "{what}: {error} m off the rest shape");
        assert!(volume_error(it, &rest) < 1e-4, "{what}");
    }
}

/// A static equilibrium does not depend on the history.
#[test]
fn under_load_it_rests_as_without_history() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let parameters = Tissue {
            solver,
            damping: 0.02,
            gravity: -9.81,
            ..FREE
        };
        let (mut world, body) = tissue(parameters, |rest| rest);
        let (rest, _) = mesh();
        for node in (0..rest.len()).filter(|&node| rest[node].y > 0.049) {
            world.body_mut(body).unwrap().pin(node as u32).unwrap();
        }
        world.rest_state(body, &RestStateDefinition::default()).unwrap();
        let it = world.body(body).unwrap();
        // Not all the way through: nothing falls.
        let sweep = Sweep {
            start: edge(it, [0.027, -0.03], [-0.03, 0.07]),
            end: edge(it, [0.031, 0.033], [-0.03, 0.07]),
        };
        assert!(world.cut(body, &sweep).unwrap().area > 1e-4);
        let start: Vec<Vec3> = world.body(body).unwrap().positions().to_vec();
        for _ in 0..400 {
            world.step(2e-3).unwrap();
        }
        let settled = world.body(body).unwrap().positions().to_vec();
        world.rest_state(body, &RestStateDefinition::default()).unwrap();
        let displacement = |from: &[Vec3]| {
            let positions = world.body(body).unwrap().positions().iter();
            positions.zip(from).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
        };
        let (moved, error) = (displacement(&start), displacement(&settled));
        assert!(moved > 5e-4, "{solver:?}: the wound opened by {moved} m");
        assert!(
            error < 1e-3 * 0.06,
            "{solver:?}: {error} m off where it would be at rest"
        );
    }
}

#[test]
fn no_energy_is_added_afterwards() {
    no_energy_is_added_afterwards_of(|matter, solver| matter == Matter::ViscousRings && solver != Solver::Newton);
}

#[test]
#[ignore = "long"]
fn no_energy_is_added_afterwards_in_the_other_cases() {
    no_energy_is_added_afterwards_of(|matter, solver| matter == Matter::Rings || solver == Solver::Newton);
}

fn no_energy_is_added_afterwards_of(is_selected: fn(Matter, Solver) -> bool) {
    for matter in [Matter::Rings, Matter::ViscousRings] {
        for solver in SOLVERS.into_iter().filter(|solver| is_selected(matter, *solver)) {
            let what = format!("{matter:?}, {solver:?}");
            let mut tops = [f64::MIN; 2];
            for (cuts, top) in [0, CUTS.len()].into_iter().zip(&mut tops) {
                let (mut world, body) = in_flight(matter, solver, Storage::Packed);
                for _ in 0..20 {
                    world.step(1e-3).unwrap();
                }
                let mut last = None;
                for [from, to, depth] in &CUTS[..cuts] {
                    let it = world.body(body).unwrap();
                    let start = last.filter(|&(at, _)| at == *from).map(|(_, edge)| edge);
                    let sweep = Sweep {
                        start: start.unwrap_or(edge(it, *from, *depth)),
                        end: edge(it, *to, *depth),
                    };
                    last = Some((*to, sweep.end));
                    world.cut(body, &sweep).unwrap();
                }
                let before = kept(&world, body).energy;
                let steps = if solver == Solver::Newton { 100 } else { 1000 };
                for step in 0..steps {
                    world.step(1e-3).unwrap();
                    if step < 100 || step % 10 == 0 {
                        *top = top.max(kept(&world, body).energy / before - 1.0);
                    }
                }
            }
            assert!(
                tops[1] < tops[0].max(0.0) + 1e-5,
                "{what}: {tops:?} of the energy comes in"
            );
        }
    }
}

/// Fully pinned tissue does no work, so the fading pressure offset can only dissipate energy.
#[test]
fn fading_dissipates_energy() {
    for solver in SOLVERS {
        let (mut world, body) = tissue(Tissue { solver, ..FREE }, stretched);
        for node in 0..mesh().0.len() {
            world.body_mut(body).unwrap().pin(node as u32).unwrap();
        }
        cut_across(&mut world, body);
        let first = kept(&world, body).energy;
        for step in 0..60 {
            world.step(1e-3).unwrap();
            let energy = kept(&world, body).energy;
            assert!(
                energy < (1.0 + 1e-5) * first,
                "{solver:?}: from {first} to {energy} J in step {step}"
            );
        }
    }
}

#[test]
fn a_refused_step_leaves_everything_as_it_was() {
    let parameters = Tissue { substeps: 1, ..FREE };
    let hash_after = |is_refused: bool| {
        let (mut world, body) = tissue(parameters, stretched);
        cut_across(&mut world, body);
        for _ in 0..40 {
            world.step(1e-4).unwrap();
        }
        if is_refused {
            let before = world.state_hash();
            assert!(matches!(world.step(0.5), Err(Error::Unstable { .. })));
            assert_eq!(world.state_hash(), before);
        }
        for _ in 0..40 {
            world.step(1e-4).unwrap();
        }
        world.state_hash()
    };
    assert_eq!(hash_after(true), hash_after(false));
}

/// Setting positions clears the history, which is the only difference of the states.
#[test]
fn the_state_hash_includes_the_history() {
    for (poisson_ratio, has_rings) in [(0.3, false), (0.49, true)] {
        let parameters = Tissue { poisson_ratio, ..FREE };
        let hash = |forgets: bool| {
            let (mut world, body) = tissue(parameters, stretched);
            let put = |world: &mut World| {
                let positions = world.body(body).unwrap().positions().to_vec();
                world.body_mut(body).unwrap().set_positions(&positions).unwrap();
            };
            put(&mut world);
            cut_across(&mut world, body);
            if forgets {
                put(&mut world);
            }
            world.state_hash()
        };
        assert_eq!(hash(true) != hash(false), has_rings);
    }
}

#[test]
fn threads_agree() {
    let (rest, cells) = shaken([20, 20, 18], 5);
    let cells: Vec<[u32; 4]> = cells.iter().map(|&cell| upright(&rest, cell)).collect();
    let positions: Vec<Vec3> = rest.iter().map(|&rest| stretched(0.001 * rest)).collect();
    let rest: Vec<Vec3> = rest.iter().map(|&rest| 0.001 * rest).collect();
    assert!(rest.len() > 8192, "enough for several threads");
    let hashes = |thread_count: u32| {
        let mut world = World::new(WorldDefinition {
            thread_count,
            ..Default::default()
        })
        .unwrap();
        let body = world
            .create_body(&BodyDefinition {
                positions: &positions,
                rest_positions: Some(&rest),
                tetrahedra: &cells,
                material: Some(Material {
                    model: Model::Tetrahedra,
                    young_modulus: 3000.0,
                    poisson_ratio: 0.49,
                    density: 1000.0,
                    ..Default::default()
                }),
                spare_nodes: 20_000,
                ..Default::default()
            })
            .unwrap();
        let sweep = Sweep {
            start: [vec3(0.012, -0.01, -0.1), vec3(0.012, -0.01, 0.1)],
            end: [vec3(0.0125, 0.012, -0.1), vec3(0.0125, 0.012, 0.1)],
        };
        assert!(world.cut(body, &sweep).unwrap().new_nodes > 100);
        (0..4)
            .map(|_| {
                world.step(1e-3).unwrap();
                world.state_hash()
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(hashes(1), hashes(2));
}

#[test]
fn any_cuts_in_motion_keep_mass_momentum_and_energy() {
    for matter in [Matter::Rings, Matter::ViscousRings] {
        for solver in SOLVERS {
            let what = format!("{matter:?}, {solver:?}");
            let (mut world, body) = in_flight(matter, solver, Storage::Packed);
            let mut random = Random(17);
            let mut cuts = 0;
            for _ in 0..12 {
                for _ in 0..3 {
                    world.step(1e-3).unwrap();
                }
                let mut point = || [random.between(-0.01, 0.07), random.between(-0.01, 0.06)];
                let (from, to) = (point(), point());
                let it = world.body(body).unwrap();
                let sweep = Sweep {
                    start: edge(it, from, [0.013, 0.07]),
                    end: edge(it, to, [-0.02, 0.06]),
                };
                let before = kept(&world, body);
                match world.cut(body, &sweep) {
                    Ok(report) => cuts += u32::from(report.new_nodes > 0),
                    Err(error) => assert!(matches!(error, Error::Capacity(_)), "{what}: {error}"),
                }
                let after = kept(&world, body);
                after.check_motion(&before, &what);
                let gained = after.energy / before.energy - 1.0;
                assert!(gained.abs() < 1e-6, "{what}: {gained} of the energy after {cuts} cuts");
            }
            assert!(cuts >= 8, "{what}: {cuts} cuts");
        }
    }
}
