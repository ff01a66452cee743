//! Tearing: springs loaded beyond their limits separate the surface.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use super::sheet::{grid, unstructured};
use crate::support::random::Random;
use glam::{DVec3, Vec2, Vec3, vec2};
use sinew::cutting::Sweep;
use sinew::{
    Anchor, Body, BodyDefinition, BodyId, Error, Material, Model, Solver, Storage, SurfacePoint, SutureDefinition,
    TearReport, Tearing, Values, World, WorldDefinition,
};

const CELL: f32 = 0.01;

/// A millimeter thick, about 50 N/m per spring.
const TISSUE: Material = Material {
    model: Model::Springs,
    young_modulus: 5e4,
    poisson_ratio: 0.0,
    density: 1000.0,
    thickness: 1e-3,
};

/// A sheet in the plane z = 0 at rest.
struct Sheet {
    rest: Vec<Vec3>,
    cells: Vec<[u32; 3]>,
}

#[derive(Clone, Copy)]
struct Options {
    tearing: Tearing,
    solver: Solver,
    storage: Storage,
    spare_nodes: u32,
    threads: u32,
    /// Length along x relative to the rest length.
    stretched: f32,
}

const PLAIN: Options = Options {
    tearing: Tearing {
        strain: 0.2,
        force: 0.0,
        most_per_step: 1,
        smallest_piece: 0.0,
    },
    solver: Solver::Verlet,
    storage: Storage::Packed,
    spare_nodes: 4000,
    threads: 1,
    stretched: 0.0,
};

impl Sheet {
    fn of((rest, cells): (Vec<Vec3>, Vec<[u32; 3]>)) -> Self {
        let rest = rest.into_iter().map(|position| CELL * position).collect();
        Self { rest, cells }
    }

    /// Returns the sheet with a neck in the middle of its length.
    fn with_neck(mut self, length: f32) -> Self {
        for position in &mut self.rest {
            let offset = (position.x - 0.5 * length) / (0.2 * length);
            position.y *= 1.0 - 0.5 * (-offset * offset).exp();
        }
        self
    }

    fn positions(&self, stretched: f32) -> Vec<Vec3> {
        self.rest
            .iter()
            .map(|position| Vec3::new((1.0 + stretched) * position.x, position.y, position.z))
            .collect()
    }

    fn world(&self, made: Options) -> Result<(World, BodyId), Error> {
        self.world_with(made, 0)
    }

    fn world_with(&self, made: Options, springs_per_node: u32) -> Result<(World, BodyId), Error> {
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            thread_count: made.threads,
            ..Default::default()
        })
        .unwrap();
        let body = world.create_body(&BodyDefinition {
            positions: &self.positions(made.stretched),
            rest_positions: Some(&self.rest),
            material: Some(TISSUE),
            triangles: &self.cells,
            spring_dampings: Values::Uniform(0.02),
            node_dampings: Values::Uniform(1e-3),
            springs_per_node: match (made.storage, springs_per_node) {
                (Storage::FastLink, 0) => 24,
                _ => springs_per_node,
            },
            mass_scaling: 0.0,
            spare_nodes: made.spare_nodes,
            solver: made.solver,
            storage: made.storage,
            tearing: made.tearing,
            ..Default::default()
        })?;
        Ok((world, body))
    }

    /// Returns the nodes whose coordinate at rest has one of two values.
    fn nodes_at(&self, coordinate: fn(Vec3) -> f32, values: [f32; 2]) -> Vec<u32> {
        let is_there = |position: &Vec3| values.iter().any(|value| (coordinate(*position) - value).abs() < 1e-6);
        (0..self.rest.len() as u32)
            .filter(|&node| is_there(&self.rest[node as usize]))
            .collect()
    }
}

const NEVER: Tearing = Tearing {
    strain: 0.0,
    force: 0.0,
    most_per_step: 0,
    smallest_piece: 0.0,
};

/// Returns the strain and the force (N) of each spring.
fn loads(body: &Body) -> Vec<([u32; 2], f64, f64)> {
    let pairs = body.spring_pairs().unwrap();
    let springs = body.springs(&pairs).unwrap();
    let load = |(pair, spring): (&[u32; 2], &sinew::SpringState)| {
        let [a, b] = pair.map(|node| body.positions()[node as usize].as_dvec3());
        let longer = a.distance(b) - f64::from(spring.rest_length);
        let strain = longer / f64::from(spring.rest_length);
        (*pair, strain, longer * f64::from(spring.stiffness))
    };
    pairs.iter().zip(&springs).map(load).collect()
}

/// Returns the rest position of each node, tracked by change lists only.
fn at_rest(sheet: &Sheet, body: &Body) -> Vec<DVec3> {
    let mut rest: Vec<DVec3> = sheet.rest.iter().map(|position| position.as_dvec3()).collect();
    for new in body.changes_since(0).unwrap().nodes {
        assert_eq!(new.node as usize, rest.len());
        let position = (0..3).map(|k| f64::from(new.weights[k]) * rest[new.sources[k] as usize]);
        rest.push(position.sum());
    }
    assert_eq!(rest.len(), body.node_count());
    rest
}

/// Returns the nodes at rest on the boundary of tears and cuts since a version.
fn rim(sheet: &Sheet, body: &Body, since: u64) -> Vec<DVec3> {
    let rest = at_rest(sheet, body);
    let rim = body.changes_since(since).unwrap().rim;
    rim.iter()
        .flat_map(|edge| edge.nodes)
        .map(|node| rest[node as usize])
        .collect()
}

fn extent(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}

/// Returns the rest areas of the pieces of the render surface (m²).
fn piece_areas(sheet: &Sheet, body: &Body) -> Vec<f64> {
    let rest = at_rest(sheet, body);
    let mut parents: Vec<usize> = (0..rest.len()).collect();
    let root = |parents: &[usize], mut at: usize| {
        while parents[at] != at {
            at = parents[at];
        }
        at
    };
    for triangle in body.surface() {
        for pair in triangle.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|node| root(&parents, node as usize));
            parents[a.max(b)] = a.min(b);
        }
    }
    let mut areas = BTreeMap::new();
    for triangle in body.surface() {
        let [a, b, c] = triangle.map(|node| rest[node as usize]);
        *areas.entry(root(&parents, triangle[0] as usize)).or_insert(0.0) += 0.5 * (b - a).cross(c - a).length();
    }
    areas.into_values().collect()
}

/// Returns mass, momentum, angular momentum about the origin, and energy.
fn conserved(world: &World, body: BodyId) -> (f64, DVec3, DVec3, f64) {
    let it = world.body(body).unwrap();
    let energy = it.energy(Vec3::ZERO);
    let mut conserved = (0.0, DVec3::ZERO, DVec3::ZERO, energy.kinetic + energy.elastic);
    for (node, (position, velocity)) in (0..).zip(it.positions().iter().zip(it.velocities())) {
        let mass = f64::from(it.node_mass(node).unwrap());
        let (position, velocity) = (position.as_dvec3(), velocity.as_dvec3());
        conserved.0 += mass;
        conserved.1 += mass * velocity;
        conserved.2 += mass * position.cross(velocity);
    }
    conserved
}

fn report(world: &World, body: BodyId) -> TearReport {
    world.body(body).unwrap().tear_report()
}

/// Pins nodes, and moves each a bit farther from the middle with each step.
fn pull(world: &mut World, body: BodyId, ends: &[(u32, Vec3)], step: f32) {
    let it = world.body_mut(body).unwrap();
    for &(node, direction) in ends {
        let position = it.positions()[node as usize];
        it.move_pin(node, position + step * direction).unwrap();
    }
}

fn ends(sheet: &Sheet, nodes: &[u32], middle: f32, along: Vec3) -> Vec<(u32, Vec3)> {
    let side = |node: u32| {
        if sheet.rest[node as usize].dot(along) < middle {
            -along
        } else {
            along
        }
    };
    nodes.iter().map(|&node| (node, side(node))).collect()
}

#[test]
fn a_strip_tears_across_at_its_limit_and_not_below() {
    let length = 24.0 * CELL;
    let (rest, cells) = grid(24);
    let conserved: Vec<[u32; 3]> = cells
        .into_iter()
        .filter(|cell| cell.iter().all(|&node| rest[node as usize].y <= 6.0))
        .collect();
    let count = 25 * 7;
    let strip = Sheet::of((rest[..count].to_vec(), conserved)).with_neck(length);
    let held = strip.nodes_at(|position| position.x, [0.0, length]);
    let ends = ends(&strip, &held, 0.5 * length, Vec3::X);
    for by_force in [false, true] {
        let limit = if by_force { 0.1 } else { 0.2 };
        let tearing = Tearing {
            strain: if by_force { 0.0 } else { limit },
            force: if by_force { limit } else { 0.0 },
            ..PLAIN.tearing
        };
        let (mut torn, body) = strip.world(Options { tearing, ..PLAIN }).unwrap();
        let (mut whole, twin) = strip
            .world(Options {
                tearing: NEVER,
                ..PLAIN
            })
            .unwrap();
        for (world, body) in [(&mut torn, body), (&mut whole, twin)] {
            held.iter()
                .for_each(|&node| world.body_mut(body).unwrap().pin(node).unwrap());
        }
        let most = |body: &Body| {
            let load = |&(_, strain, force): &(_, f64, f64)| if by_force { force } else { strain };
            loads(body).iter().map(load).fold(0.0, f64::max)
        };
        // Slowly up to 0.99 of the limit, and a while there.
        let mut steps = 0;
        while most(whole.body(twin).unwrap()) < 0.985 * f64::from(limit) {
            for (world, body) in [(&mut torn, body), (&mut whole, twin)] {
                pull(world, body, &ends, 5e-5);
                world.step(5e-3).unwrap();
            }
            steps += 1;
            assert!(steps < 2000);
        }
        for _ in 0..100 {
            for (world, body) in [(&mut torn, body), (&mut whole, twin)] {
                world.step(5e-3).unwrap();
                assert!(most(world.body(body).unwrap()) < f64::from(limit));
            }
            assert_eq!(report(&torn, body), TearReport::default());
        }
        // Beyond the limit, it tears in the first step that exceeds it.
        loop {
            for (world, body) in [(&mut torn, body), (&mut whole, twin)] {
                pull(world, body, &ends, 2e-5);
                world.step(5e-3).unwrap();
            }
            let is_beyond = most(whole.body(twin).unwrap()) > f64::from(limit);
            assert_eq!(report(&torn, body).tears, u32::from(is_beyond), "by force: {by_force}");
            if is_beyond {
                break;
            }
            steps += 1;
            assert!(steps < 4000);
        }
        let mut parted = report(&torn, body).pieces_parted;
        for _ in 0..200 {
            torn.step(5e-3).unwrap();
            parted += report(&torn, body).pieces_parted;
        }
        let it = torn.body(body).unwrap();
        assert_eq!(it.pieces().unwrap().count, 1 + parted);
        assert_eq!(piece_areas(&strip, it).len(), 2, "by force: {by_force}");
        let [from, to] = extent(rim(&strip, it, 0).iter().map(|position| position.x));
        assert!(
            to - from < 3.0 * f64::from(CELL),
            "by force: {by_force}, from {from} to {to}"
        );
        // At the neck strain is largest; the force of a spring is the same everywhere.
        if !by_force {
            assert!((0.5 * (from + to) - 0.5 * f64::from(length)).abs() < 4.0 * f64::from(CELL));
        }
        // No forces are left.
        assert!(most(it) < 0.5 * f64::from(limit));
    }
}

/// A square of `n` x `n` nearly equilateral triangles, with inner nodes moved at random.
fn shaken(n: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut random = Random(6);
    let rows = (n as f32 / 0.75_f32.sqrt()).round() as usize;
    let height = n as f32 / rows as f32;
    let (mut rest, mut starts) = (Vec::new(), Vec::new());
    for row in 0..=rows {
        starts.push(rest.len() as u32);
        // Every second row is shifted by half a triangle, and has an additional one at its ends.
        for x in 0..=n + row % 2 {
            let at = (x as f32 - 0.5 * (row % 2) as f32).clamp(0.0, n as f32);
            let is_inside = at > 0.0 && at < n as f32 && row > 0 && row < rows;
            let by = if is_inside { 0.12 } else { 0.0 };
            rest.push(Vec3::new(
                at + random.between(-by, by),
                height * row as f32 + random.between(-by, by),
                0.0,
            ));
        }
    }
    let mut cells = Vec::new();
    for row in 0..rows as u32 {
        let (below, above) = (starts[row as usize], starts[row as usize + 1]);
        let n = n as u32;
        if row % 2 == 0 {
            cells.extend((0..n).map(|x| [below + x, below + x + 1, above + x + 1]));
            cells.extend((0..=n).map(|x| [below + x, above + x + 1, above + x]));
        } else {
            cells.extend((0..=n).map(|x| [below + x, below + x + 1, above + x]));
            cells.extend((0..n).map(|x| [below + x + 1, above + x + 1, above + x]));
        }
    }
    (rest, cells)
}

#[test]
fn a_crack_starts_at_a_notch_and_runs_straight_across() {
    for (name, of) in [("grid", grid(20)), ("shaken", shaken(20))] {
        let sheet = Sheet::of(of);
        let side = 20.0 * CELL;
        let held = sheet.nodes_at(|position| position.x, [0.0, side]);
        let ends = ends(&sheet, &held, 0.5 * side, Vec3::X);
        let (mut world, body) = sheet.world(PLAIN).unwrap();
        // The transverse axes are free, so that corners carry no more load than other nodes.
        let hold = |it: &mut Body, node| it.pin_axes(node, [true, false, false]).unwrap();
        held.iter().for_each(|&node| hold(world.body_mut(body).unwrap(), node));
        let blade = |at: Vec2| [-0.1, 0.1].map(|z| at.extend(z));
        let tip = vec2(0.5 * side + 0.003, 8.3 * CELL);
        let cut = world
            .cut(
                body,
                &Sweep {
                    start: blade(vec2(tip.x, -CELL)),
                    end: blade(tip),
                },
            )
            .unwrap();
        assert!(cut.length > 0.08);
        let notched = world.body(body).unwrap().topology_version();
        let mut steps = 0;
        while report(&world, body).tears == 0 {
            pull(&mut world, body, &ends, 5e-5);
            world.step(5e-3).unwrap();
            steps += 1;
            assert!(steps < 2000, "{name}");
        }
        let first = rim(&sheet, world.body(body).unwrap(), notched);
        let tip_at = tip.extend(0.0).as_dvec3();
        let nearest = first
            .iter()
            .map(|position| position.distance(tip_at))
            .fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-6, "{name}: begins {nearest} m from the tip");
        let mut parted = 0;
        for _ in 0..1000 {
            pull(&mut world, body, &ends, 1e-5);
            world.step(5e-3).unwrap();
            parted += report(&world, body).pieces_parted;
            if parted > 0 {
                break;
            }
        }
        let it = world.body(body).unwrap();
        let areas = piece_areas(&sheet, it);
        assert_eq!(areas.len(), 2, "{name}");
        let mut furthest = 0.0_f64;
        for position in rim(&sheet, it, notched) {
            furthest = furthest.max((position.x - tip_at.x).abs());
            assert!(position.y > tip_at.y - 1e-6, "{name}: back at {position}");
        }
        assert!(furthest < 3.0 * f64::from(CELL), "{name}: {furthest} m aside");
        assert!(it.positions().iter().all(|position| position.is_finite()));
    }
}

#[test]
fn a_tear_keeps_mass_momentum_and_energy_in_every_storage() {
    let sheet = Sheet::of(unstructured(12, 8));
    let mut slots: Option<Vec<DVec3>> = None;
    for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
        for storage in [
            Storage::Packed,
            Storage::Efficient,
            Storage::FastLink,
            Storage::DynamicBulk,
        ] {
            if solver == Solver::Newton && storage != Storage::Packed {
                continue;
            }
            let what = format!("{solver:?}, {storage:?}");
            let made = Options {
                solver,
                storage,
                stretched: 0.25,
                ..PLAIN
            };
            let (mut torn, body) = sheet.world(made).unwrap();
            let (mut whole, twin) = sheet.world(Options { tearing: NEVER, ..made }).unwrap();
            for (world, body) in [(&mut torn, body), (&mut whole, twin)] {
                let velocities: Vec<Vec3> = sheet
                    .rest
                    .iter()
                    .map(|position| Vec3::new(0.3, -0.2, 0.1) + Vec3::new(0.5, 0.4, 2.0).cross(*position))
                    .collect();
                world.body_mut(body).unwrap().set_velocities(&velocities).unwrap();
                world.step(2e-4).unwrap();
            }
            assert_eq!(report(&torn, body).tears, 1, "{what}");
            let (before, after) = (conserved(&whole, twin), conserved(&torn, body));
            assert!((after.0 / before.0 - 1.0).abs() < 1e-6, "{what}: mass");
            assert!(
                after.1.distance(before.1) < 1e-6 * before.1.length(),
                "{what}: momentum"
            );
            assert!(
                after.2.distance(before.2) < 1e-6 * before.1.length().max(before.2.length()),
                "{what}: spin"
            );
            assert!(
                (after.3 - before.3).abs() < 1e-6 * before.3,
                "{what}: energy {} {}",
                before.3,
                after.3
            );
            let it = torn.body(body).unwrap();
            let whole = whole.body(twin).unwrap().positions();
            assert_eq!(it.positions()[..whole.len()], *whole, "{what}: moved");
            let area: f64 = piece_areas(&sheet, it).iter().sum();
            assert!((area / 0.0144 - 1.0).abs() < 1e-6, "{what}: area {area}");
            let rim = rim(&sheet, it, 0);
            let first = slots.get_or_insert_with(|| rim.clone());
            assert_eq!(rim.len(), first.len(), "{what}");
            for (a, b) in rim.iter().zip(first) {
                assert!(a.distance(*b) < 1e-4, "{what}: {a} and {b}");
            }
            // It opens and continues without gaining energy.
            let mut last = after.3;
            for _ in 0..100 {
                torn.step(2e-4).unwrap();
                let now = conserved(&torn, body).3;
                assert!(now < 1.01 * last, "{what}: {last} then {now} J");
                last = now;
            }
        }
    }
}

#[test]
fn the_most_loaded_springs_tear_first_up_to_the_maximum() {
    let sheet = Sheet::of(unstructured(12, 8));
    let made = |most_per_step| Options {
        stretched: 0.25,
        tearing: Tearing {
            most_per_step,
            ..PLAIN.tearing
        },
        ..PLAIN
    };
    // The state without tearing.
    let (mut whole, twin) = sheet
        .world(Options {
            tearing: NEVER,
            ..made(0)
        })
        .unwrap();
    whole.step(1e-5).unwrap();
    let mut loads = loads(whole.body(twin).unwrap());
    loads.sort_by(|a, b| b.1.total_cmp(&a.1));
    let beyond = loads.iter().filter(|load| load.1 > 0.2).count() as u32;
    assert!(beyond > 20);
    for most in [1, 3, 5] {
        let (mut world, body) = sheet.world(made(most)).unwrap();
        world.step(1e-5).unwrap();
        let report = report(&world, body);
        assert_eq!(report.tears, most);
        assert_eq!(world.body(body).unwrap().topology_version(), u64::from(most));
        assert!(report.waiting + most <= beyond);
        assert!(report.waiting + 8 * most >= beyond, "{report:?} of {beyond}");
        // No two are adjacent.
        let it = world.body(body).unwrap();
        let rest = at_rest(&sheet, it);
        let mut seen: Vec<DVec3> = Vec::new();
        for version in 0..u64::from(most) {
            let (from, later) = (
                it.changes_since(version).unwrap().rim,
                it.changes_since(version + 1).unwrap().rim,
            );
            let slots: Vec<DVec3> = from[..from.len() - later.len()]
                .iter()
                .flat_map(|edge| edge.nodes)
                .map(|node| rest[node as usize])
                .collect();
            assert!(slots.iter().all(|position| !seen.contains(position)), "{most}");
            seen.extend(slots);
        }
        // The first runs through a node of the most loaded spring.
        let [a, b] = loads[0].0.map(|node| sheet.rest[node as usize].as_dvec3());
        let rim = rim(&sheet, world.body(body).unwrap(), 0);
        assert!(rim.iter().any(|position| *position == a || *position == b), "{most}");
    }
    // A stronger spring does not tear, and a weaker one tears first.
    let (mut world, body) = sheet.world(made(1)).unwrap();
    let it = world.body_mut(body).unwrap();
    let middle = loads.iter().find(|load| load.1 < 0.15 && load.1 > 0.1).unwrap().0;
    it.set_tear_limits(&[middle], Some(Values::Uniform(0.05)), None)
        .unwrap();
    world.step(1e-5).unwrap();
    assert_eq!(report(&world, body).tears, 1);
    let ends = middle.map(|node| sheet.rest[node as usize].as_dvec3());
    let first = rim(&sheet, world.body(body).unwrap(), 0);
    assert!(first.iter().any(|position| ends.contains(position)));
    let (mut world, body) = sheet.world(made(1)).unwrap();
    let all: Vec<[u32; 2]> = loads.iter().map(|load| load.0).collect();
    let it = world.body_mut(body).unwrap();
    it.set_tear_limits(&all, Some(Values::Uniform(0.0)), None).unwrap();
    world.step(1e-5).unwrap();
    assert_eq!(report(&world, body), TearReport::default());
    let it = world.body_mut(body).unwrap();
    let [a, b] = [loads[0], loads[1]].map(|load| load.0);
    let forces = [loads[0].2 as f32 * 1.01, loads[1].2 as f32 * 0.99];
    it.set_tear_limits(&[a, b], None, Some(Values::Each(&forces))).unwrap();
    world.step(1e-5).unwrap();
    assert_eq!(report(&world, body).tears, 1);
    let ends = b.map(|node| sheet.rest[node as usize].as_dvec3());
    let first = rim(&sheet, world.body(body).unwrap(), 0);
    assert!(first.iter().any(|position| ends.contains(position)));
}

/// Pulls a sheet at random nodes; returns the areas of its pieces, the number of tears, and the hash.
fn pull_at_random(smallest_piece: f32, threads: u32, solver: Solver) -> (Vec<f64>, u32, u64) {
    let sheet = Sheet::of(unstructured(16, 3));
    let (mut world, body) = sheet
        .world(Options {
            tearing: Tearing {
                strain: 0.3,
                most_per_step: 4,
                smallest_piece,
                ..PLAIN.tearing
            },
            threads,
            solver,
            ..PLAIN
        })
        .unwrap();
    let mut random = Random(4);
    let (mut tears, mut parted) = (0, 0);
    let mut version = 0;
    let mut triangles = sheet.cells.clone();
    for _ in 0..60 {
        let pulled: Vec<u32> = (0..8).map(|_| (random.next() * 289.0) as u32).collect();
        let forces: Vec<Vec3> = pulled
            .iter()
            .map(|_| {
                let along = Vec3::new(
                    random.between(-1.0, 1.0),
                    random.between(-1.0, 1.0),
                    random.between(-1.0, 1.0),
                );
                3.0 * along
            })
            .collect();
        for _ in 0..5 {
            world.body_mut(body).unwrap().apply_forces(&pulled, &forces).unwrap();
            assert_eq!(world.step(2e-3).unwrap().bodies_restored, 0);
            let report = report(&world, body);
            assert!(report.tears <= 4);
            tears += report.tears;
            parted += report.pieces_parted;
        }
        let it = world.body(body).unwrap();
        assert!(it.positions().iter().all(|position| position.is_finite()));
        let changes = it.changes_since(version).unwrap();
        triangles.resize(it.surface().len(), [0; 3]);
        for &triangle in changes.triangles {
            triangles[triangle as usize] = it.surface()[triangle as usize];
        }
        version = changes.version;
        assert_eq!(triangles, it.surface());
    }
    let it = world.body(body).unwrap();
    let areas = piece_areas(&sheet, it);
    assert_eq!(areas.len() as u32, 1 + parted);
    assert_eq!(it.pieces().unwrap().count, 1 + parted);
    let whole: f64 = areas.iter().sum();
    assert!((whole / 0.0256 - 1.0).abs() < 1e-5, "{whole}");
    (areas, tears, world.state_hash())
}

#[test]
fn no_piece_is_below_the_minimum_fragment_size() {
    no_piece_is_below_the_minimum_fragment_size_of(Solver::Verlet);
}

#[test]
#[ignore = "long"]
fn no_piece_is_below_the_minimum_fragment_size_implicit() {
    no_piece_is_below_the_minimum_fragment_size_of(Solver::Implicit);
}

fn no_piece_is_below_the_minimum_fragment_size_of(solver: Solver) {
    let least = |areas: &[f64]| areas.iter().copied().fold(f64::INFINITY, f64::min);
    let (areas, tears, _) = pull_at_random(0.0, 1, solver);
    assert!(tears > 50 && areas.len() > 3, "{tears} tears, {areas:?}");
    assert!(least(&areas) < 4e-4, "{areas:?}");
    let (areas, tears, _) = pull_at_random(4e-4, 1, solver);
    assert!(tears > 50, "{tears} tears");
    assert!(least(&areas) > 4e-4 * (1.0 - 1e-5), "{areas:?}");
}

#[test]
fn tears_are_the_same_for_any_number_of_threads() {
    let sheet = Sheet::of(grid(100));
    let mut hashes = Vec::new();
    for threads in [1, 2] {
        let (mut world, body) = sheet
            .world(Options {
                stretched: 0.25,
                threads,
                tearing: Tearing {
                    most_per_step: 8,
                    ..PLAIN.tearing
                },
                ..PLAIN
            })
            .unwrap();
        let mut tears = 0;
        for _ in 0..20 {
            world.step(5e-4).unwrap();
            tears += report(&world, body).tears;
        }
        assert!(tears > 100, "{tears}");
        hashes.push(world.state_hash());
    }
    assert_eq!(hashes[0], hashes[1]);
}

#[test]
fn without_capacity_the_step_succeeds_and_nothing_tears() {
    let sheet = Sheet::of(unstructured(12, 8));
    let never = Tearing {
        strain: 0.0,
        ..PLAIN.tearing
    };
    let made = |storage, spare_nodes| {
        [never, NEVER].map(|tearing| Options {
            storage,
            spare_nodes,
            stretched: 0.25,
            tearing,
            ..PLAIN
        })
    };
    // An inner node is doubled, and an end of the tear is new.
    let inner = |node: &u32| {
        let position = sheet.rest[*node as usize];
        (position - Vec3::new(0.06, 0.06, 0.0)).length() < 0.03
    };
    for (made, springs_per_node) in [(made(Storage::Packed, 1), 0), (made(Storage::FastLink, 1000), 12)] {
        let [(mut torn, body), (mut whole, twin)] = made.map(|made| sheet.world_with(made, springs_per_node).unwrap());
        let it = torn.body_mut(body).unwrap();
        let mut pairs = it.spring_pairs().unwrap();
        pairs.retain(|pair| pair.iter().all(inner));
        let along = |[a, b]: [u32; 2]| sheet.rest[a as usize].x - sheet.rest[b as usize].x;
        pairs.retain(|pair| along(*pair).abs() > 0.9 * CELL);
        pairs.truncate(1);
        if springs_per_node > 0 {
            fill_rows(
                &mut [(&mut torn, body), (&mut whole, twin)],
                springs_per_node as usize,
                inner,
            );
        }
        let it = torn.body_mut(body).unwrap();
        it.set_tear_limits(&pairs, Some(Values::Uniform(0.2)), None).unwrap();
        for step in 0..5 {
            torn.step(1e-4).unwrap();
            whole.step(1e-4).unwrap();
            let report = report(&torn, body);
            // After the first attempt, refused tears are only counted.
            let what = format!("{:?} {step} {report:?}", made[0].storage);
            let withheld = TearReport {
                no_room: 1,
                ..Default::default()
            };
            assert_eq!(report, withheld, "{what}");
            let [it, twin] = [torn.body(body).unwrap(), whole.body(twin).unwrap()];
            assert_eq!(it.positions(), twin.positions(), "{what}");
            assert_eq!(it.topology_version(), 0, "{what}");
        }
    }
}

/// Gives inner nodes as many springs of zero stiffness as they have slots for.
fn fill_rows(worlds: &mut [(&mut World, BodyId)], slots: usize, inner: impl Fn(&u32) -> bool) {
    for (world, body) in worlds {
        let it = world.body_mut(*body).unwrap();
        let pairs = it.spring_pairs().unwrap();
        let mut counts = vec![0; it.node_count()];
        pairs.iter().flatten().for_each(|&node| counts[node as usize] += 1);
        let nodes = 0..it.node_count() as u32;
        for node in nodes.clone().filter(&inner) {
            for other in nodes.clone().filter(|other| !inner(other)) {
                let has_room = counts[node as usize] < slots && counts[other as usize] < slots;
                if has_room && it.add_spring(node, other, 0.0, None).is_ok() {
                    counts[node as usize] += 1;
                    counts[other as usize] += 1;
                }
            }
            assert_eq!(counts[node as usize], slots);
        }
    }
}

#[test]
fn sutures_stay_at_their_material_point() {
    let sheet = Sheet::of(unstructured(12, 8));
    let made = Options {
        stretched: 0.25,
        ..PLAIN
    };
    let (mut scout, body) = sheet.world(made).unwrap();
    scout.step(1e-4).unwrap();
    let torn_at = rim(&sheet, scout.body(body).unwrap(), 0);
    // Points in all triangles next to the tear, each sutured to a distant point.
    let middle = |cell: &[u32; 3]| {
        cell.map(|node| sheet.rest[node as usize].as_dvec3())
            .into_iter()
            .sum::<DVec3>()
            / 3.0
    };
    let is_near = |cell: &[u32; 3]| {
        torn_at
            .iter()
            .any(|position| position.distance(middle(cell)) < f64::from(CELL))
    };
    let far = (0..sheet.cells.len())
        .find(|&cell| {
            torn_at
                .iter()
                .all(|position| position.distance(middle(&sheet.cells[cell])) > 0.05)
        })
        .unwrap() as u32;
    let mut worlds = [PLAIN.tearing, NEVER].map(|tearing| sheet.world(Options { tearing, ..made }).unwrap());
    let mut sutures = Vec::new();
    for triangle in (0..sheet.cells.len() as u32).filter(|&cell| is_near(&sheet.cells[cell as usize])) {
        for weights in [[0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]] {
            let [near, far] = [(triangle, weights), (far, [0.3, 0.3, 0.4])]
                .map(|(triangle, weights)| Anchor::Point(SurfacePoint { triangle, weights }));
            let slack = SutureDefinition {
                length: Some(1.0),
                ..Default::default()
            };
            let ids = worlds
                .iter_mut()
                .map(|(world, body)| world.suture(*body, &near, *body, &far, &slack).unwrap());
            let corners = sheet.cells[triangle as usize].map(|node| sheet.rest[node as usize].as_dvec3());
            let position: DVec3 = (0..3).map(|k| f64::from(weights[k]) * corners[k]).sum();
            sutures.push((ids.collect::<Vec<_>>(), position));
        }
    }
    assert!(sutures.len() > 10);
    for (world, _) in &mut worlds {
        world.step(1e-4).unwrap();
    }
    assert_eq!(report(&worlds[0].0, worlds[0].1).tears, 1);
    for (ids, _) in &sutures {
        let [(torn, _), (whole, _)] = &worlds;
        let distances =
            [torn.suture_report(ids[0]), whole.suture_report(ids[1])].map(|report| report.unwrap().distance);
        assert!((distances[0] - distances[1]).abs() < 1e-6, "{distances:?}");
    }
    // Also when the tear opens.
    let (torn, body) = &mut worlds[0];
    for _ in 0..100 {
        torn.step(1e-4).unwrap();
    }
    let it = torn.body(*body).unwrap();
    let rest = at_rest(&sheet, it);
    let now = |position: DVec3| {
        let found = it.surface().iter().find_map(|corners| {
            let [a, b, c] = corners.map(|node| rest[node as usize]);
            let whole = (b - a).cross(c - a).z;
            let weights = [(b, c), (c, a), (a, b)].map(|(p, q)| (p - position).cross(q - position).z / whole);
            let at = corners.map(|node| it.positions()[node as usize].as_dvec3());
            let is_inside = weights.iter().all(|&weight| weight >= 0.0);
            is_inside.then(|| (0..3).map(|k| weights[k] * at[k]).sum::<DVec3>())
        });
        found.unwrap()
    };
    let corners = sheet.cells[far as usize].map(|node| sheet.rest[node as usize].as_dvec3());
    let far = now(0.3 * corners[0] + 0.3 * corners[1] + 0.4 * corners[2]);
    for (ids, position) in sutures {
        let distance = f64::from(torn.suture_report(ids[0]).unwrap().distance);
        let expected = now(position).distance(far);
        assert!(
            (distance - expected).abs() < 1e-6,
            "{position}: {distance} and {expected}"
        );
    }
}

#[test]
fn springs_off_the_edges_tear_the_surface_and_are_removed_there() {
    let sheet = Sheet::of(grid(12));
    let at = |x: u32, y: u32| y * 13 + x;
    let over = (0..13).flat_map(|y| (0..11).map(move |x| [at(x, y), at(x + 2, y)]));
    let over: Vec<[u32; 2]> = over.collect();
    let (mut world, body) = sheet
        .world(Options {
            stretched: 0.1,
            ..PLAIN
        })
        .unwrap();
    let it = world.body_mut(body).unwrap();
    for &[a, b] in &over {
        it.add_spring(a, b, 20.0, Some(2.0 * CELL)).unwrap();
    }
    // The springs in the middle alone are weak.
    let middle: Vec<[u32; 2]> = over.iter().copied().filter(|[a, _]| a % 13 == 5).collect();
    it.set_tear_limits(&middle, Some(Values::Uniform(0.05)), None).unwrap();
    let mut parted = 0;
    for _ in 0..20 {
        // Held open by pins.
        let it = world.body_mut(body).unwrap();
        let rest = at_rest(&sheet, it);
        let taut: Vec<Vec3> = rest
            .iter()
            .map(|position| Vec3::new(1.1 * position.x as f32, position.y as f32, 0.0))
            .collect();
        it.set_positions(&taut).unwrap();
        it.set_velocities(&vec![Vec3::ZERO; taut.len()]).unwrap();
        world.step(1e-5).unwrap();
        parted += report(&world, body).pieces_parted;
    }
    let it = world.body(body).unwrap();
    assert_eq!(piece_areas(&sheet, it).len(), 2);
    assert_eq!(parted, 1);
    // With their springs.
    assert_eq!(it.pieces().unwrap().count, 2);
    assert_eq!(report(&world, body), TearReport::default());
}

#[test]
fn held_tissue_does_not_tear_but_its_neighbor_does() {
    let sheet = Sheet::of(unstructured(12, 8));
    let never = Tearing {
        strain: 0.0,
        ..PLAIN.tearing
    };
    let made = Options {
        stretched: 0.25,
        tearing: never,
        ..PLAIN
    };
    let inner = |node: &u32| (sheet.rest[*node as usize] - Vec3::new(0.06, 0.06, 0.0)).length() < 0.03;
    let (world, body) = sheet.world(made).unwrap();
    let mut pairs = world.body(body).unwrap().spring_pairs().unwrap();
    pairs.retain(|pair| pair.iter().all(inner));
    let along = |[a, b]: [u32; 2]| sheet.rest[a as usize].x - sheet.rest[b as usize].x;
    pairs.retain(|pair| along(*pair).abs() > 0.9 * CELL);
    assert!(pairs.len() > 3);
    for pair in pairs {
        for [held, free] in [pair, [pair[1], pair[0]]] {
            let (mut world, body) = sheet.world(made).unwrap();
            let it = world.body_mut(body).unwrap();
            it.pin(held).unwrap();
            it.set_tear_limits(&[pair], Some(Values::Uniform(0.02)), None).unwrap();
            world.step(1e-4).unwrap();
            assert_eq!(report(&world, body).tears, 1);
            let [held, free] = [held, free].map(|node| sheet.rest[node as usize].as_dvec3());
            let rim = rim(&sheet, world.body(body).unwrap(), 0);
            let doubled = |at: DVec3| rim.iter().filter(|position| **position == at).count() == 4;
            assert!(doubled(free) && !doubled(held), "{pair:?}");
        }
    }
}

#[test]
fn a_partly_cut_spring_keeps_its_share_of_the_limit() {
    let sheet = Sheet::of(grid(12));
    let never = Tearing {
        strain: 0.0,
        ..PLAIN.tearing
    };
    let (mut world, body) = sheet
        .world(Options {
            tearing: never,
            ..PLAIN
        })
        .unwrap();
    let spring = [6 * 13 + 5, 6 * 13 + 6];
    let it = world.body_mut(body).unwrap();
    let before = it.springs(&[spring]).unwrap()[0];
    let bears = 0.2 * before.stiffness * before.rest_length;
    it.set_tear_limits(&[spring], None, Some(Values::Uniform(bears)))
        .unwrap();
    let blade = |at: Vec2| [-0.1, 0.1].map(|z| at.extend(z));
    let sweep = Sweep {
        start: blade(vec2(-CELL, 5.5 * CELL)),
        end: blade(vec2(13.0 * CELL, 5.5 * CELL)),
    };
    assert_eq!(world.cut(body, &sweep).unwrap().pieces_parted, 1);
    let it = world.body_mut(body).unwrap();
    let after = it.springs(&[spring]).unwrap()[0];
    assert!(after.stiffness < 0.9 * before.stiffness);
    for is_set_again in [false, true] {
        for (strain, tears) in [(0.199, 0), (0.201, u32::from(is_set_again))] {
            let it = world.body_mut(body).unwrap();
            if is_set_again {
                // With the same value: this recomputes the limit.
                it.set_springs(&[spring], Some(Values::Uniform(after.stiffness)), None)
                    .unwrap();
            } else if tears == 0 && strain > 0.2 {
                continue;
            }
            let taut: Vec<Vec3> = at_rest(&sheet, it)
                .iter()
                .map(|position| Vec3::new((1.0 + strain) * position.x as f32, position.y as f32, 0.0))
                .collect();
            it.set_positions(&taut).unwrap();
            it.set_velocities(&vec![Vec3::ZERO; taut.len()]).unwrap();
            world.step(1e-6).unwrap();
            assert_eq!(report(&world, body).tears, tears, "{strain}");
        }
    }
}

#[test]
fn invalid_tearing_is_refused() {
    let sheet = Sheet::of(grid(3));
    let refused = |made: Options, words: &str| {
        let error = sheet.world(made).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
        error
    };
    let with = |tearing| Options { tearing, ..PLAIN };
    for bad in [-1.0, f32::NAN, f32::INFINITY] {
        refused(
            with(Tearing {
                strain: bad,
                ..PLAIN.tearing
            }),
            "tear_strain is",
        );
        refused(
            with(Tearing {
                force: bad,
                ..PLAIN.tearing
            }),
            "tear_force is",
        );
        refused(
            with(Tearing {
                smallest_piece: bad,
                ..PLAIN.tearing
            }),
            "smallest_piece is",
        );
    }
    let never = Tearing {
        most_per_step: 0,
        ..PLAIN.tearing
    };
    refused(with(never), "most_tears is 0");
    let error = refused(
        Options {
            spare_nodes: 0,
            ..PLAIN
        },
        "spare_nodes is 0",
    );
    assert!(matches!(error, Error::InvalidArgument(_)));
    let (mut world, body) = sheet
        .world(Options {
            tearing: NEVER,
            ..PLAIN
        })
        .unwrap();
    let it = world.body_mut(body).unwrap();
    let error = it
        .set_tear_limits(&[[0, 1]], Some(Values::Uniform(0.1)), None)
        .unwrap_err();
    assert!(matches!(error, Error::Unsupported(_)));
    let (mut world, body) = sheet.world(PLAIN).unwrap();
    let it = world.body_mut(body).unwrap();
    for (pairs, strains, words) in [
        ([[0, 15]], 0.1, "pairs[0]"),
        ([[0, 1]], -0.1, "strain is"),
        ([[0, 1]], f32::NAN, "strain is"),
    ] {
        let error = it
            .set_tear_limits(&pairs, Some(Values::Uniform(strains)), None)
            .unwrap_err();
        assert!(
            matches!(&error, Error::InvalidArgument(why) if why.contains(words)),
            "{error}"
        );
    }
}
