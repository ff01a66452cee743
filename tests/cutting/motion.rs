//! Sheets that are cut while they move: what is kept, whatever keeps their springs and moves them.

use glam::{DVec3, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::{Body, BodyDefinition, BodyId, Solver, Storage, Values, World, WorldDefinition};

use super::sheet::{Random, unstructured};

const STORAGES: [Storage; 4] = [
    Storage::Packed,
    Storage::Efficient,
    Storage::FastLink,
    Storage::DynamicBulk,
];

const SOLVERS: [Solver; 3] = [Solver::Verlet, Solver::Implicit, Solver::Newton];

/// An unstructured sheet of `n` x `n` cells of 1 cm, 1 kg/m², springs of 50 N/m, in flight without gravity, spinning and swinging.
fn in_flight(n: usize, solver: Solver, storage: Storage, damping: f32) -> (World, BodyId) {
    let (rest, cells) = unstructured(n, 5);
    let positions: Vec<Vec3> = rest.iter().map(|place| 0.01 * *place).collect();
    let mut random = Random(3);
    let mut masses = vec![0.0; positions.len()];
    for cell in &cells {
        let [a, b, c] = cell.map(|node| positions[node as usize]);
        let area = 0.5 * (b - a).cross(c - a).length();
        cell.iter().for_each(|&node| masses[node as usize] += area / 3.0);
    }
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..Default::default()
    })
    .unwrap();
    let body = world
        .create_body(&BodyDefinition {
            positions: &positions,
            masses: Values::Each(&masses),
            triangles: &cells,
            stiffnesses: Values::Uniform(50.0),
            spring_dampings: Values::Uniform(damping),
            springs_per_node: if storage == Storage::FastLink { 24 } else { 0 },
            spare_nodes: 2000,
            mass_scaling: 0.0,
            solver,
            storage,
            ..Default::default()
        })
        .unwrap();
    let centre = positions.iter().sum::<Vec3>() / positions.len() as f32;
    let velocities: Vec<Vec3> = positions
        .iter()
        .map(|&place| {
            let shaken = vec3(
                random.between(-0.1, 0.1),
                random.between(-0.1, 0.1),
                random.between(-0.1, 0.1),
            );
            vec3(0.3, -0.2, 0.1) + vec3(1.0, 2.0, 6.0).cross(place - centre) + shaken
        })
        .collect();
    world.body_mut(body).unwrap().set_velocities(&velocities).unwrap();
    (world, body)
}

/// Mass, momentum, angular momentum about the origin, energy, in `f64`.
struct Kept {
    mass: f64,
    momentum: DVec3,
    spin: DVec3,
    energy: f64,
}

fn kept(world: &World, body: BodyId) -> Kept {
    let it = world.body(body).unwrap();
    let mut kept = Kept {
        mass: 0.0,
        momentum: DVec3::ZERO,
        spin: DVec3::ZERO,
        energy: it.energy(Vec3::ZERO).kinetic + it.energy(Vec3::ZERO).elastic,
    };
    for (node, (place, velocity)) in (0..).zip(it.positions().iter().zip(it.velocities())) {
        let mass = f64::from(it.node_mass(node).unwrap());
        let (place, velocity) = (place.as_dvec3(), velocity.as_dvec3());
        kept.mass += mass;
        kept.momentum += mass * velocity;
        kept.spin += mass * place.cross(velocity);
    }
    kept
}

/// A blade that stands upright, from one point of the rest shape to another, where the sheet is now.
fn across(body: &Body, from: Vec3, to: Vec3) -> Sweep {
    let positions = body.positions();
    let normal = (positions[20] - positions[0])
        .cross(positions[20 * 21] - positions[0])
        .normalize();
    let at = |point: Vec3| {
        let [x, y] = [point.x, point.y].map(|along| along / 0.2);
        positions[0] + x * (positions[20] - positions[0]) + y * (positions[20 * 21] - positions[0])
    };
    let edge = |point: Vec3| [at(point) - 0.05 * normal, at(point) + 0.05 * normal];
    Sweep {
        start: edge(from),
        end: edge(to),
    }
}

#[test]
fn cuts_in_motion_keep_mass_momentum_and_energy() {
    for solver in SOLVERS {
        for storage in STORAGES {
            for damping in [0.0, 1e-3] {
                if solver == Solver::Newton && storage != Storage::Packed {
                    continue;
                }
                let (mut world, body) = in_flight(20, solver, storage, damping);
                let cuts = [
                    (vec3(-0.01, 0.083, 0.0), vec3(0.11, 0.095, 0.0)),
                    (vec3(0.11, 0.095, 0.0), vec3(0.22, 0.12, 0.0)),
                    (vec3(0.052, -0.02, 0.0), vec3(0.049, 0.22, 0.0)),
                    (vec3(0.1, 0.04, 0.0), vec3(0.17, 0.17, 0.0)),
                ];
                let mut pieces = 1;
                for (from, to) in cuts {
                    for _ in 0..5 {
                        world.step(1e-3).unwrap();
                    }
                    let before = kept(&world, body);
                    let sweep = across(world.body(body).unwrap(), from, to);
                    let report = world.cut(body, &sweep).unwrap();
                    pieces += report.pieces_parted;
                    let after = kept(&world, body);
                    let what = format!("{solver:?}, {storage:?}, damping {damping}");
                    assert!(report.new_nodes > 0 && report.new_triangles > 0, "{what}: {report:?}");
                    assert!((after.mass / before.mass - 1.0).abs() < 1e-6, "{what}: mass");
                    let size = before.momentum.length();
                    assert!(
                        before.momentum.distance(after.momentum) < 1e-6 * size,
                        "{what}: momentum {} {}",
                        before.momentum,
                        after.momentum
                    );
                    assert!(
                        before.spin.distance(after.spin) < 1e-6 * before.spin.length().max(0.1 * size),
                        "{what}: angular momentum"
                    );
                    let gained = after.energy - before.energy;
                    assert!(
                        gained.abs() < 1e-6 * before.energy,
                        "{what}: energy {} {}",
                        before.energy,
                        after.energy
                    );
                }
                // The last cut is within a piece.
                assert_eq!(pieces, 4, "{solver:?}, {storage:?}");
                let at_last = kept(&world, body);
                for _ in 0..200 {
                    world.step(1e-3).unwrap();
                }
                let later = kept(&world, body);
                assert!(
                    later.energy < 1.02 * at_last.energy,
                    "{solver:?}, {storage:?}: {} {}",
                    at_last.energy,
                    later.energy
                );
                assert!(later.momentum.distance(at_last.momentum) < 1e-4 * at_last.momentum.length());
                assert!(
                    world
                        .body(body)
                        .unwrap()
                        .positions()
                        .iter()
                        .all(|place| place.is_finite())
                );
            }
        }
    }
}
