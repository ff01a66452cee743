//! Nearly incompressible solids that are cut: rings of tetrahedra that keep their volume fall apart, without a jolt, and each piece comes to the
//! rest shape that it has by itself.

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
    /// N s/m of each node.
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

/// The block, with its nodes at `place` of where they are at rest.
fn tissue(of: Tissue, place: impl Fn(Vec3) -> Vec3) -> (World, BodyId) {
    let (rest, cells) = mesh();
    let positions: Vec<Vec3> = rest.iter().map(|&rest| place(rest)).collect();
    let mut world = World::new(WorldDefinition {
        gravity: vec3(0.0, of.gravity, 0.0),
        substeps: of.substeps,
        ..Default::default()
    })
    .unwrap();
    let time = if of.is_viscous { 0.05 } else { 0.0 };
    let body = world
        .create_body(&BodyDefinition {
            positions: &positions,
            rest_positions: Some(&rest),
            tetrahedra: &cells,
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: 3000.0,
                poisson_ratio: of.poisson_ratio,
                density: 1000.0,
                ..Default::default()
            }),
            viscosity: Viscosity {
                retardation_time: time,
                relaxation_time: time,
            },
            node_dampings: Values::Uniform(of.damping),
            spare_nodes: 3000,
            solver: of.solver,
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

/// Where all points are at rest, as who follows the list of changes knows.
fn carried(body: &Body) -> Vec<DVec3> {
    let mut places: Vec<DVec3> = mesh().0.iter().map(|rest| rest.as_dvec3()).collect();
    for new in body.changes_since(0).unwrap().nodes {
        let place = (0..3).map(|k| f64::from(new.weights[k]) * places[new.sources[k] as usize]);
        places.push(place.sum());
    }
    places
}

/// What is drawn of each piece: its triangles.
fn skins(body: &Body) -> Vec<Vec<[u32; 3]>> {
    let pieces = body.pieces().unwrap();
    let mut skins = BTreeMap::new();
    for &corners in body.surface() {
        let of: &mut Vec<[u32; 3]> = skins.entry(pieces.of_nodes[corners[0] as usize]).or_default();
        of.push(corners);
    }
    skins.into_values().collect()
}

/// By how much distances between drawn points of a piece are off from those at rest at most, m.
fn off_rest(body: &Body, rest: &[DVec3]) -> f64 {
    let mut off = 0.0_f64;
    for skin in skins(body) {
        let mut points: Vec<u32> = skin.into_iter().flatten().collect();
        points.sort_unstable();
        points.dedup();
        for (k, &a) in points.iter().enumerate() {
            for &b in &points[..k] {
                let [from, to] = [a, b].map(|point| body.positions()[point as usize].as_dvec3());
                off = off.max((from.distance(to) - rest[a as usize].distance(rest[b as usize])).abs());
            }
        }
    }
    off
}

/// How far the volume of any piece is off that at rest, as a part of it.
fn off_volume(body: &Body, rest: &[DVec3]) -> f64 {
    let of_piece = |skin: Vec<[u32; 3]>| {
        let now = enclosed(&skin, |point| body.positions()[point as usize].as_dvec3());
        (now / enclosed(&skin, |point| rest[point as usize]) - 1.0).abs()
    };
    skins(body).into_iter().map(of_piece).fold(0.0, f64::max)
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
fn a_piece_comes_to_its_own_rest_shape_and_keeps_its_volume() {
    a_piece_comes_to_its_own_rest_shape_and_keeps_its_volume_of(&[
        (Solver::Verlet, 0.49, false),
        (Solver::Implicit, 0.45, true),
    ]);
}

#[test]
#[ignore = "long"]
fn a_piece_comes_to_its_own_rest_shape_and_keeps_its_volume_in_the_other_cases() {
    a_piece_comes_to_its_own_rest_shape_and_keeps_its_volume_of(&[
        (Solver::Verlet, 0.45, true),
        (Solver::Implicit, 0.49, false),
        (Solver::Newton, 0.49, false),
    ]);
}

fn a_piece_comes_to_its_own_rest_shape_and_keeps_its_volume_of(cases: &[(Solver, f32, bool)]) {
    for &(solver, poisson_ratio, is_viscous) in cases {
        let what = format!("{poisson_ratio}, {solver:?}");
        let of = Tissue {
            poisson_ratio,
            solver,
            is_viscous,
            damping: 0.02,
            ..FREE
        };
        let (mut world, body) = tissue(of, stretched);
        for _ in 0..10 {
            world.step(2e-3).unwrap();
        }
        cut_across(&mut world, body);
        let it = world.body(body).unwrap();
        let rest = carried(it);
        assert!(off_rest(it, &rest) > 1e-3, "{what}: strained as it is cut");
        // As near to incompressible as the whole was: what presses it is some part of Young's modulus.
        let most = (2.0 * off_volume(it, &rest)).max(0.01);
        for step in 0..400 {
            world.step(2e-3).unwrap();
            if step % 10 == 0 {
                let off = off_volume(world.body(body).unwrap(), &rest);
                assert!(
                    off < most,
                    "{what}: a volume is off by {off}, {most} expected, at {step}"
                );
            }
        }
        let it = world.body(body).unwrap();
        let off = off_rest(it, &rest);
        assert!(off < 1e-4 * 0.06, "{what}: {off} m off the rest shape");
        assert!(off_volume(it, &rest) < 1e-4, "{what}");
    }
}

/// A state of rest knows nothing of the past.
#[test]
fn under_load_it_comes_to_rest_where_it_would_without_a_past() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let of = Tissue {
            solver,
            damping: 0.02,
            gravity: -9.81,
            ..FREE
        };
        let (mut world, body) = tissue(of, |rest| rest);
        let (rest, _) = mesh();
        for node in (0..rest.len()).filter(|&node| rest[node].y > 0.049) {
            world.body_mut(body).unwrap().pin(node as u32).unwrap();
        }
        world.rest_state(body, &RestStateDefinition::default()).unwrap();
        let it = world.body(body).unwrap();
        // Not through: nothing falls.
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
        let way = |from: &[Vec3]| {
            let places = world.body(body).unwrap().positions().iter();
            places.zip(from).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
        };
        let (moved, off) = (way(&start), way(&settled));
        assert!(moved > 5e-4, "{solver:?}: the wound opened by {moved} m");
        assert!(off < 1e-3 * 0.06, "{solver:?}: {off} m off where it would be at rest");
    }
}

#[test]
fn no_energy_comes_in_afterwards() {
    no_energy_comes_in_afterwards_of(|matter, solver| matter == Matter::ViscousRings && solver != Solver::Newton);
}

#[test]
#[ignore = "long"]
fn no_energy_comes_in_afterwards_in_the_other_cases() {
    no_energy_comes_in_afterwards_of(|matter, solver| matter == Matter::Rings || solver == Solver::Newton);
}

fn no_energy_comes_in_afterwards_of(is_tried: fn(Matter, Solver) -> bool) {
    for matter in [Matter::Rings, Matter::ViscousRings] {
        for solver in SOLVERS.into_iter().filter(|solver| is_tried(matter, *solver)) {
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

/// What is held cannot pay for what fades.
#[test]
fn fading_by_itself_takes_energy() {
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
    let of = Tissue { substeps: 1, ..FREE };
    let hash_after = |is_refused: bool| {
        let (mut world, body) = tissue(of, stretched);
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

/// Where places are set the past is forgotten, and nothing but that sets the states apart.
#[test]
fn the_state_hash_knows_the_past() {
    for (poisson_ratio, has_rings) in [(0.3, false), (0.49, true)] {
        let of = Tissue { poisson_ratio, ..FREE };
        let hash = |forgets: bool| {
            let (mut world, body) = tissue(of, stretched);
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
    assert!(rest.len() > 8192, "so many are shared out");
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
