//! Tearing of tetrahedral solids: springs and element edges loaded beyond their limits separate the material.
#![allow(clippy::unwrap_used)]

use std::collections::HashMap;

use super::block::{Mesh, shaken, upright};
use crate::support::kept::kept;
use crate::support::random::Random;
use glam::{DVec3, Vec3, vec3};
use sinew::{
    Body, BodyDefinition, BodyId, Material, Model, Solver, Storage, TearReport, Tearing, Values, World, WorldDefinition,
};

/// The side of a cell (m).
const CELL: f32 = 0.01;

const TEARING: Tearing = Tearing {
    strain: 0.2,
    force: 0.0,
    most_per_step: 1,
    smallest_piece: 0.0,
};

/// Tearing is enabled, with limits that are never reached.
const NEVER: Tearing = Tearing {
    strain: 100.0,
    ..TEARING
};

#[derive(Clone, Copy)]
struct Options {
    size: [usize; 3],
    has_elements: bool,
    tearing: Tearing,
    solver: Solver,
    storage: Storage,
    spare_nodes: u32,
    thread_count: u32,
    /// Length along x relative to the rest length.
    stretched: f32,
    damping: f32,
}

const BAR: Options = Options {
    size: [10, 3, 3],
    has_elements: true,
    tearing: TEARING,
    solver: Solver::Verlet,
    storage: Storage::Packed,
    spare_nodes: 3000,
    thread_count: 1,
    stretched: 0.0,
    damping: 20.0,
};

impl Options {
    fn mesh(&self) -> Mesh {
        let (rest, cells) = shaken(self.size, 5);
        let cells = cells.iter().map(|&cell| upright(&rest, cell)).collect();
        (rest.iter().map(|&position| CELL * position).collect(), cells)
    }

    fn definition_with<T>(&self, made: impl FnOnce(&BodyDefinition) -> T) -> T {
        let (rest, cells) = self.mesh();
        let positions: Vec<Vec3> = rest
            .iter()
            .map(|&position| position * vec3(1.0 + self.stretched, 1.0, 1.0))
            .collect();
        let definition = BodyDefinition {
            positions: &positions,
            rest_positions: Some(&rest),
            masses: Values::Uniform(1e-3),
            node_dampings: Values::Uniform(self.damping * 1e-3),
            tetrahedra: &cells,
            springs_per_node: if self.storage == Storage::FastLink { 60 } else { 0 },
            spare_nodes: self.spare_nodes,
            tearing: self.tearing,
            mass_scaling: 0.0,
            solver: self.solver,
            storage: self.storage,
            ..Default::default()
        };
        made(&if self.has_elements {
            BodyDefinition {
                material: Some(Material {
                    model: Model::Tetrahedra,
                    young_modulus: 3000.0,
                    poisson_ratio: 0.3,
                    ..Default::default()
                }),
                ..definition
            }
        } else {
            BodyDefinition {
                stiffnesses: Values::Uniform(20.0),
                ..definition
            }
        })
    }

    fn world(&self) -> (World, BodyId) {
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            thread_count: self.thread_count,
            ..Default::default()
        })
        .unwrap();
        let body = self.definition_with(|definition| world.create_body(definition).unwrap());
        (world, body)
    }

    fn volume(&self) -> f64 {
        let [x, y, z] = self.size;
        (x * y * z) as f64 * f64::from(CELL).powi(3)
    }

    /// Returns the rest positions of nodes and points.
    fn at_rest(&self, body: &Body) -> Vec<DVec3> {
        let mut rest: Vec<DVec3> = self.mesh().0.iter().map(|position| position.as_dvec3()).collect();
        for new in body.changes_since(0).unwrap().nodes {
            assert_eq!(new.node as usize, rest.len());
            let position = (0..3).map(|k| f64::from(new.weights[k]) * rest[new.sources[k] as usize]);
            rest.push(position.sum());
        }
        rest
    }

    /// Returns the rest volumes of the connected components of the surface, the smallest first; checks that each is
    /// closed and has each edge once.
    fn pieces(&self, body: &Body) -> Vec<f64> {
        let rest = self.at_rest(body);
        let triangles = body.surface();
        let mut sides = HashMap::new();
        for (number, &[a, b, c]) in triangles.iter().enumerate() {
            for side in [[a, b], [b, c], [c, a]] {
                assert_eq!(sides.insert(side, number), None, "{side:?} twice");
            }
        }
        let mut piece = vec![usize::MAX; triangles.len()];
        let mut volumes = Vec::new();
        for start in 0..triangles.len() {
            if piece[start] != usize::MAX {
                continue;
            }
            let mut open = vec![start];
            let mut volume = 0.0;
            piece[start] = volumes.len();
            while let Some(at) = open.pop() {
                let [a, b, c] = triangles[at];
                let [p, q, r] = [a, b, c].map(|node| rest[node as usize]);
                volume += p.cross(q).dot(r) / 6.0;
                for side in [[b, a], [c, b], [a, c]] {
                    let across = *sides.get(&side).expect("closed");
                    if piece[across] == usize::MAX {
                        piece[across] = volumes.len();
                        open.push(across);
                    }
                }
            }
            volumes.push(volume);
        }
        volumes.sort_by(f64::total_cmp);
        let whole: f64 = volumes.iter().sum();
        assert!(
            (whole / self.volume() - 1.0).abs() < 1e-6,
            "{whole} m³ of {}",
            self.volume()
        );
        volumes
    }

    /// Returns the largest strain of an original cell edge whose nodes were not copied.
    fn largest_strain(&self, body: &Body) -> f64 {
        let (rest, cells) = self.mesh();
        let edges = cells
            .iter()
            .flat_map(|cell| (0..4).flat_map(move |a| (0..a).map(move |b| [cell[a], cell[b]])));
        let strain = |[a, b]: [u32; 2]| {
            let length = |places: &[Vec3]| places[a as usize].as_dvec3().distance(places[b as usize].as_dvec3());
            length(body.positions()) / length(&rest) - 1.0
        };
        edges.map(strain).fold(0.0, f64::max)
    }
}

fn report(world: &World, body: BodyId) -> TearReport {
    world.body(body).unwrap().tear_report()
}

#[test]
fn a_bar_tears_in_two_at_its_limit_and_not_below() {
    for (has_elements, solver) in [
        (true, Solver::Verlet),
        (false, Solver::Verlet),
        (true, Solver::Implicit),
        (false, Solver::Implicit),
    ] {
        let what = format!("elements {has_elements}, {solver:?}");
        let made = Options {
            has_elements,
            solver,
            ..BAR
        };
        let twin = Options { tearing: NEVER, ..made };
        let mut worlds = [made.world(), twin.world()];
        let (rest, _) = made.mesh();
        let end = made.size[0] as f32 * CELL;
        let held: Vec<(u32, f32)> = (0..)
            .zip(&rest)
            .filter(|(_, position)| position.x < 1e-5 || position.x > end - 1e-5)
            .map(|(node, position)| (node, (position.x - 0.5 * end).signum()))
            .collect();
        for (world, body) in &mut worlds {
            held.iter()
                .for_each(|&(node, _)| world.body_mut(*body).unwrap().pin(node).unwrap());
        }
        let mut steps = 0;
        loop {
            for (world, body) in &mut worlds {
                let it = world.body_mut(*body).unwrap();
                for &(node, direction) in &held {
                    let position = it.positions()[node as usize];
                    it.move_pin(node, position + 2e-5 * direction * Vec3::X).unwrap();
                }
                world.step(5e-3).unwrap();
            }
            let [(torn, body), (whole, twin)] = &worlds;
            let is_beyond = made.largest_strain(whole.body(*twin).unwrap()) > 0.2 * (1.0 + 1e-6);
            assert_eq!(report(torn, *body).tears, u32::from(is_beyond), "{what}");
            if is_beyond {
                break;
            }
            steps += 1;
            assert!(steps < 2000);
        }
        let [(world, body), _] = &mut worlds;
        let mut parted = report(world, *body).pieces_parted;
        for step in 0..500 {
            if step < 300 {
                let it = world.body_mut(*body).unwrap();
                for &(node, direction) in &held {
                    let position = it.positions()[node as usize];
                    it.move_pin(node, position + 2e-5 * direction * Vec3::X).unwrap();
                }
            }
            world.step(5e-3).unwrap();
            parted += report(world, *body).pieces_parted;
        }
        let it = world.body(*body).unwrap();
        let pieces = made.pieces(it);
        assert_eq!(pieces.len() as u32, 1 + parted, "{what}");
        assert_eq!(it.pieces().unwrap().count, 1 + parted, "{what}");
        // Two ends, and possibly slivers.
        let largest: f64 = pieces.iter().rev().take(2).sum();
        assert!(pieces.len() >= 2 && pieces.len() < 6, "{what}: {pieces:?}");
        assert!(largest > 0.95 * made.volume(), "{what}: {pieces:?}");
        assert!(pieces[pieces.len() - 2] > 0.03 * made.volume(), "{what}: {pieces:?}");
        let still: Vec<f32> = it.velocities().iter().map(|velocity| velocity.length()).collect();
        assert!(still.iter().all(|&speed| speed < 0.05), "{what}");
    }
}

#[test]
fn a_tear_keeps_mass_momentum_volume_and_energy() {
    for has_elements in [true, false] {
        for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
            for storage in [Storage::Packed, Storage::FastLink, Storage::DynamicBulk] {
                if storage != Storage::Packed && (has_elements || solver == Solver::Newton) {
                    continue;
                }
                let what = format!("elements {has_elements}, {solver:?}, {storage:?}");
                let made = Options {
                    size: [6, 5, 4],
                    has_elements,
                    solver,
                    storage,
                    stretched: 0.22,
                    damping: 0.0,
                    ..BAR
                };
                let mut worlds = [made, Options { tearing: NEVER, ..made }].map(|made| made.world());
                for (world, body) in &mut worlds {
                    let it = world.body_mut(*body).unwrap();
                    let positions = it.positions().to_vec();
                    let velocities: Vec<Vec3> = positions
                        .iter()
                        .map(|&position| vec3(0.3, -0.2, 0.1) + vec3(0.5, 0.4, 2.0).cross(position))
                        .collect();
                    it.set_velocities(&velocities).unwrap();
                    world.step(2e-4).unwrap();
                }
                let [(torn, body), (whole, twin)] = &mut worlds;
                assert_eq!(report(torn, *body).tears, 1, "{what}");
                let (before, after) = (kept(whole, *twin), kept(torn, *body));
                assert!((after.mass / before.mass - 1.0).abs() < 1e-6, "{what}: mass");
                let momentum = before.momentum.length();
                assert!(
                    after.momentum.distance(before.momentum) < 1e-6 * momentum,
                    "{what}: momentum"
                );
                let spin = momentum * 0.06 + before.spin.length();
                assert!(after.spin.distance(before.spin) < 1e-6 * spin, "{what}: spin");
                assert!(
                    (after.energy - before.energy).abs() < 1e-6 * before.energy,
                    "{what}: energy {} {}",
                    before.energy,
                    after.energy
                );
                let it = torn.body(*body).unwrap();
                let positions = whole.body(*twin).unwrap().positions();
                assert_eq!(it.positions()[..positions.len()], *positions, "{what}: moved");
                assert!(
                    it.surface().len() > whole.body(*twin).unwrap().surface().len(),
                    "{what}"
                );
                made.pieces(it);
                // It continues without gaining energy.
                let mut last = after.energy;
                for _ in 0..60 {
                    torn.step(2e-4).unwrap();
                    let now = kept(torn, *body).energy;
                    assert!(now < 1.01 * last, "{what}: {last} then {now} J");
                    last = now;
                }
                made.pieces(torn.body(*body).unwrap());
            }
        }
    }
}

/// Returns the volumes of pieces, the number of tears, and the state hash.
fn pull_at_random(made: Options) -> (Vec<f64>, u32, u64) {
    let (mut world, body) = made.world();
    let mut random = Random(4);
    let count = made.mesh().0.len() as f32;
    let (mut tears, mut parted) = (0, 0);
    for _ in 0..40 {
        let pulled: Vec<u32> = (0..6).map(|_| random.between(0.0, count) as u32).collect();
        let forces: Vec<Vec3> = pulled.iter().map(|_| 1.5 * random.point(-1.0, 1.0)).collect();
        for _ in 0..5 {
            world.body_mut(body).unwrap().apply_forces(&pulled, &forces).unwrap();
            assert_eq!(world.step(2e-3).unwrap().bodies_restored, 0);
            let report = report(&world, body);
            assert!(report.tears <= made.tearing.most_per_step);
            tears += report.tears;
            parted += report.pieces_parted;
        }
        assert!(
            world
                .body(body)
                .unwrap()
                .positions()
                .iter()
                .all(|position| position.is_finite())
        );
    }
    let it = world.body(body).unwrap();
    let pieces = made.pieces(it);
    assert_eq!(pieces.len() as u32, 1 + parted);
    assert_eq!(it.pieces().unwrap().count, 1 + parted);
    (pieces, tears, world.state_hash())
}

#[test]
fn the_surface_stays_closed_and_no_piece_is_below_the_minimum() {
    the_surface_stays_closed_and_no_piece_is_below_the_minimum_of(&[(true, Solver::Verlet)]);
}

#[test]
#[ignore = "long"]
fn the_surface_stays_closed_and_no_piece_is_below_the_minimum_in_the_other_cases() {
    the_surface_stays_closed_and_no_piece_is_below_the_minimum_of(&[(false, Solver::Verlet), (true, Solver::Implicit)]);
}

fn the_surface_stays_closed_and_no_piece_is_below_the_minimum_of(cases: &[(bool, Solver)]) {
    for &(has_elements, solver) in cases {
        let made = Options {
            size: [6, 5, 4],
            has_elements,
            solver,
            spare_nodes: 8000,
            tearing: Tearing {
                strain: 0.4,
                most_per_step: 4,
                ..TEARING
            },
            ..BAR
        };
        let what = format!("elements {has_elements}, {solver:?}");
        let (pieces, tears, _) = pull_at_random(made);
        assert!(tears > 40 && pieces.len() > 2, "{what}: {tears} tears, {pieces:?}");
        let least = 3e-6;
        assert!(pieces[0] < least, "{what}: {pieces:?}");
        let tearing = Tearing {
            smallest_piece: least as f32,
            ..made.tearing
        };
        let (pieces, tears, _) = pull_at_random(Options { tearing, ..made });
        assert!(tears > 40, "{what}: {tears} tears");
        assert!(pieces[0] > least * (1.0 - 1e-5), "{what}: {pieces:?}");
    }
}

#[test]
fn tears_of_solids_are_the_same_for_any_number_of_threads() {
    let [one, two] = [1, 2].map(|thread_count| {
        pull_at_random(Options {
            size: [6, 5, 4],
            thread_count,
            tearing: Tearing {
                strain: 0.3,
                most_per_step: 4,
                ..TEARING
            },
            ..BAR
        })
    });
    assert_eq!(one, two);
}

#[test]
fn without_capacity_the_step_succeeds_and_no_solid_tears() {
    let made = Options {
        stretched: 0.3,
        spare_nodes: 1,
        ..BAR
    };
    let (mut world, body) = made.world();
    let surface = world.body(body).unwrap().surface().to_vec();
    let (mut tears, mut without_room) = (0, 0);
    for _ in 0..5 {
        world.step(1e-3).unwrap();
        let report = report(&world, body);
        tears += report.tears;
        without_room += report.no_room;
    }
    assert!(without_room > 0);
    // At a corner one is enough.
    assert!(tears <= 1);
    // A tear opens a face on both sides. At a corner it opens a second face where the remainder would be connected by
    // an edge only.
    assert!(world.body(body).unwrap().surface().len() <= surface.len() + 4 * tears as usize);
    made.pieces(world.body(body).unwrap());
}

#[test]
fn an_element_edge_has_its_own_strain_limit() {
    let made = Options {
        tearing: Tearing { strain: 0.0, ..TEARING },
        stretched: 0.1,
        ..BAR
    };
    let (mut world, body) = made.world();
    world.step(1e-4).unwrap();
    assert_eq!(report(&world, body), TearReport::default());
    // An edge along x in the middle.
    let (rest, cells) = made.mesh();
    let [a, b] = cells
        .iter()
        .flat_map(|cell| (0..4).flat_map(move |a| (0..a).map(move |b| [cell[a], cell[b]])))
        .find(|&[a, b]| {
            let direction = rest[b as usize] - rest[a as usize];
            direction.x.abs() > 0.9 * direction.length() && (rest[a as usize].x - 0.05).abs() < 0.01
        })
        .unwrap();
    let it = world.body_mut(body).unwrap();
    it.set_tear_limits(&[[a, b]], Some(Values::Uniform(0.05)), None)
        .unwrap();
    let far = rest.len() as u32 - 1;
    assert!(
        it.set_tear_limits(&[[0, far]], Some(Values::Uniform(0.05)), None)
            .is_err()
    );
    world.step(1e-4).unwrap();
    assert_eq!(report(&world, body).tears, 1);
}

#[test]
fn invalid_tear_limits_of_elements_are_refused() {
    let tearing = Tearing { force: 0.1, ..TEARING };
    let mut world = World::new(WorldDefinition::default()).unwrap();
    let made = Options { tearing, ..BAR };
    let error = made.definition_with(|definition| world.create_body(definition).unwrap_err());
    assert!(error.to_string().contains("tear_force is 0.1"), "{error}");
    let springs = Options {
        has_elements: false,
        ..made
    };
    springs.definition_with(|definition| world.create_body(definition).unwrap());
}
