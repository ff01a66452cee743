//! Sheets that are cut in motion: conserved quantities, with every storage and solver.

use glam::{DVec3, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::{Body, BodyDefinition, BodyId, Solver, Storage, Values, World, WorldDefinition};

use super::sheet::unstructured;
use crate::support::kept::kept;
use crate::support::random::Random;
use crate::support::scene::{SOLVERS, STORAGES};

/// An unstructured sheet of `n` x `n` cells of 1 cm, 1 kg/m², springs of 50 N/m, in flight without gravity, spinning
/// and swinging.
fn in_flight(n: usize, solver: Solver, storage: Storage, damping: f32) -> (World, BodyId) {
    in_flight_with(n, solver, storage, damping, |definition| definition)
}

/// Creates the same sheet from an extended definition.
pub fn in_flight_with(
    n: usize,
    solver: Solver,
    storage: Storage,
    damping: f32,
    with: impl for<'a> Fn(BodyDefinition<'a>) -> BodyDefinition<'a>,
) -> (World, BodyId) {
    let (rest, cells) = unstructured(n, 5);
    let positions: Vec<Vec3> = rest.iter().map(|position| 0.01 * *position).collect();
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
        .create_body(&with(BodyDefinition {
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
        }))
        .unwrap();
    let centre = positions.iter().sum::<Vec3>() / positions.len() as f32;
    let velocities: Vec<Vec3> = positions
        .iter()
        .map(|&position| {
            let shaken = vec3(
                random.between(-0.1, 0.1),
                random.between(-0.1, 0.1),
                random.between(-0.1, 0.1),
            );
            vec3(0.3, -0.2, 0.1) + vec3(1.0, 2.0, 6.0).cross(position - centre) + shaken
        })
        .collect();
    world.body_mut(body).unwrap().set_velocities(&velocities).unwrap();
    (world, body)
}

/// An upright blade that moves between two points of the rest shape, at the sheet's current positions.
pub fn across(body: &Body, from: Vec3, to: Vec3) -> Sweep {
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
    cuts_in_motion_keep_mass_momentum_and_energy_of(|case| case % 4 == 0);
}

#[test]
#[ignore = "long"]
fn cuts_in_motion_keep_mass_momentum_and_energy_in_the_other_cases() {
    cuts_in_motion_keep_mass_momentum_and_energy_of(|case| case % 4 != 0);
}

fn cuts_in_motion_keep_mass_momentum_and_energy_of(is_selected: fn(usize) -> bool) {
    for (number, solver) in (0..).zip(SOLVERS) {
        for (first_case, storage) in (number..).zip(STORAGES) {
            for (_, damping) in (first_case..).zip([0.0, 1e-3]).filter(|case| is_selected(case.0)) {
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
                    after.check_motion(&before, &what);
                    let gained = after.energy - before.energy;
                    assert!(
                        gained.abs() < 1e-6 * before.energy,
                        "{what}: energy {} {}",
                        before.energy,
                        after.energy
                    );
                }
                // The last cut lies within a piece.
                assert_eq!(pieces, 4, "{solver:?}, {storage:?}");
                let at_end = kept(&world, body);
                for _ in 0..200 {
                    world.step(1e-3).unwrap();
                }
                let later = kept(&world, body);
                assert!(
                    later.energy < 1.02 * at_end.energy,
                    "{solver:?}, {storage:?}: {} {}",
                    at_end.energy,
                    later.energy
                );
                assert!(later.momentum.distance(at_end.momentum) < 1e-4 * at_end.momentum.length());
                assert!(
                    world
                        .body(body)
                        .unwrap()
                        .positions()
                        .iter()
                        .all(|position| position.is_finite())
                );
            }
        }
    }
}

#[test]
fn cut_off_tissue_falls_and_held_tissue_stays() {
    for solver in SOLVERS {
        for pinned_for_good in [false, true] {
            let (rest, cells) = super::sheet::grid(12);
            let positions: Vec<Vec3> = rest
                .iter()
                .map(|position| 0.01 * vec3(position.x, 0.0, position.y))
                .collect();
            let is_held = |node: usize| rest[node].y == 0.0;
            let masses: Vec<f32> = (0..positions.len())
                .map(|node| if pinned_for_good && is_held(node) { 0.0 } else { 1e-4 })
                .collect();
            let mut world = World::new(WorldDefinition::default()).unwrap();
            let definition = BodyDefinition {
                positions: &positions,
                masses: Values::Each(&masses),
                node_dampings: Values::Uniform(1e-3),
                triangles: &cells,
                stiffnesses: Values::Uniform(50.0),
                spare_nodes: 400,
                solver,
                ..Default::default()
            };
            let body = world.create_body(&definition).unwrap();
            for node in (0..positions.len()).filter(|&node| is_held(node)) {
                world.body_mut(body).unwrap().pin(node as u32).unwrap();
            }
            for _ in 0..100 {
                world.step(2e-3).unwrap();
            }
            // Within the first row of cells: nodes of both sides have copies beyond the cut.
            let at = world.body(body).unwrap().positions();
            let (low, high) = (at[0].lerp(at[13], 0.4), at[12].lerp(at[25], 0.4));
            let (along, normal) = ((high - low).normalize(), Vec3::Y + Vec3::Z);
            let edge = |point: Vec3| [point - 0.02 * normal, point + 0.02 * normal];
            let sweep = Sweep {
                start: edge(low - 0.01 * along),
                end: edge(high + 0.01 * along),
            };
            let report = world.cut(body, &sweep).unwrap();
            assert_eq!(report.pieces_parted, 1, "{solver:?}");
            let it = world.body(body).unwrap();
            let pieces = it.pieces().unwrap();
            assert_eq!(pieces.count, 2, "{solver:?}");
            let copies: Vec<u32> = it
                .changes_since(0)
                .unwrap()
                .nodes
                .iter()
                .map(|new| new.node)
                .filter(|&node| it.node_mass(node).unwrap() > 0.0)
                .collect();
            assert!(copies.len() >= 26, "{solver:?}: a copy for each node along the cut");
            let centre = |world: &World| {
                let it = world.body(body).unwrap();
                let (mut sum, mut mass) = (DVec3::ZERO, 0.0);
                for (node, position) in (0..).zip(it.positions()) {
                    if pieces.of_nodes[node as usize] == pieces.of_nodes[30] {
                        let node_mass = f64::from(it.node_mass(node).unwrap());
                        sum += node_mass * position.as_dvec3();
                        mass += node_mass;
                    }
                }
                (sum / mass, mass)
            };
            let still = vec![Vec3::ZERO; world.body(body).unwrap().node_count()];
            world.body_mut(body).unwrap().set_velocities(&still).unwrap();
            let (before, mass) = centre(&world);
            let time = 50.0 * 2e-3;
            for _ in 0..50 {
                world.step(2e-3).unwrap();
            }
            // Free fall with nodal damping: the damping of a copy is proportional to its mass.
            let (after, _) = centre(&world);
            let it = world.body(body).unwrap();
            let fallen = before.y - after.y;
            let free = 0.5 * 9.81 * time * time;
            assert!(
                fallen > 0.5 * free && fallen < free,
                "{solver:?}: {fallen} of {free} m, {mass} kg"
            );
            for node in (0..positions.len()).filter(|&node| is_held(node)) {
                assert_eq!(it.positions()[node], positions[node], "{solver:?}: node {node} is held");
            }
        }
    }
}

#[test]
fn refused_cuts_change_nothing() {
    let sweep = Sweep {
        start: [vec3(-0.02, 0.043, -1.0), vec3(-0.02, 0.043, 1.0)],
        end: [vec3(0.3, 0.12, -1.0), vec3(0.3, 0.12, 1.0)],
    };
    let (rest, cells) = unstructured(20, 5);
    let positions: Vec<Vec3> = rest.iter().map(|position| 0.01 * *position).collect();
    let definition = BodyDefinition {
        positions: &positions,
        masses: Values::Uniform(1e-4),
        triangles: &cells,
        stiffnesses: Values::Uniform(50.0),
        ..Default::default()
    };
    let refused = |definition: &BodyDefinition, sweep: &Sweep| {
        let mut world = World::new(WorldDefinition::default()).unwrap();
        let body = world.create_body(definition).unwrap();
        world.step(1e-3).unwrap();
        let before = (world.state_hash(), format!("{:?}", world.body(body).unwrap().surface()));
        let error = world.cut(body, sweep).unwrap_err();
        let after = (world.state_hash(), format!("{:?}", world.body(body).unwrap().surface()));
        assert!(before == after, "{error}");
        assert_eq!(world.body(body).unwrap().changes_since(0).unwrap().version, 0);
        world.step(1e-3).unwrap();
        error
    };
    let error = refused(&definition, &sweep);
    assert!(
        matches!(error, sinew::Error::Unsupported(_)) && error.to_string().contains("spare_nodes is 0"),
        "{error}"
    );
    let error = refused(
        &BodyDefinition {
            spare_nodes: 20,
            ..definition
        },
        &sweep,
    );
    assert!(matches!(error, sinew::Error::Capacity(_)), "{error}");
    let (rest, cells) = super::sheet::grid(20);
    let positions: Vec<Vec3> = rest.iter().map(|position| 0.01 * *position).collect();
    let full = BodyDefinition {
        positions: &positions,
        triangles: &cells,
        spare_nodes: 500,
        storage: Storage::FastLink,
        springs_per_node: 0,
        ..definition
    };
    let mut sweeps = 0;
    for shift in 0..20 {
        // Where a cut ends, the node ahead is connected to both copies of a neighbor: by one spring more than before.
        let mut world = World::new(WorldDefinition::default()).unwrap();
        let body = world.create_body(&full).unwrap();
        let offset = 0.007 * shift as f32 * Vec3::Y;
        let shifted = Sweep {
            start: sweep.start.map(|end| end + offset),
            end: sweep
                .start
                .map(|end| end + offset + (0.1 + 0.003 * shift as f32) * Vec3::X),
        };
        if world.cut(body, &shifted).is_err() {
            let error = refused(&full, &shifted);
            assert!(
                matches!(error, sinew::Error::Capacity(_)) && error.to_string().contains("springs_per_node"),
                "{error}"
            );
            sweeps += 1;
        }
    }
    assert!(sweeps > 0, "a row is too short for some cut");
    let bad = Sweep {
        start: [Vec3::NAN, Vec3::ZERO],
        ..sweep
    };
    let error = refused(
        &BodyDefinition {
            spare_nodes: 500,
            ..definition
        },
        &bad,
    );
    assert!(matches!(error, sinew::Error::InvalidArgument(_)), "{error}");
}

#[test]
fn a_stroke_continues_in_opening_tissue() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let (rest, cells) = super::sheet::grid(24);
        let at_rest: Vec<Vec3> = rest.iter().map(|position| 0.005 * *position).collect();
        // Stretched across the cut by a fifth, and held on all sides: it opens as fast as it is cut.
        let positions: Vec<Vec3> = at_rest.iter().map(|position| *position * vec3(1.0, 1.2, 1.0)).collect();
        let is_rim = |position: &Vec3| {
            [position.x, position.y]
                .iter()
                .any(|&along| along == 0.0 || along == 24.0)
        };
        let masses: Vec<f32> = rest
            .iter()
            .map(|position| if is_rim(position) { 0.0 } else { 2.5e-5 })
            .collect();
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            ..Default::default()
        })
        .unwrap();
        let definition = BodyDefinition {
            positions: &positions,
            rest_positions: Some(&at_rest),
            masses: Values::Each(&masses),
            node_dampings: Values::Uniform(5e-4),
            triangles: &cells,
            stiffnesses: Values::Uniform(80.0),
            spare_nodes: 1000,
            solver,
            ..Default::default()
        };
        let body = world.create_body(&definition).unwrap();
        let edge = |x: f32, y: f32| [vec3(x, y, -0.05), vec3(x, y, 0.05)];
        // In small steps within the sheet, with a pause, at an angle, so that the opening wound moves the blade's end
        // sideways.
        let position = |step: u32| (0.02 + 0.0021 * step as f32, 0.062 + 0.0006 * step as f32);
        let mut length = 0.0;
        for step in 0..40 {
            let ((x, y), (u, v)) = (position(step), position(step + 1));
            let (start, end) = (edge(x, y), edge(u, v));
            length += world.cut(body, &Sweep { start, end }).unwrap().length;
            world.step(2e-3).unwrap();
            if step == 20 {
                for _ in 0..50 {
                    // The tissue moves across a stationary blade.
                    let still = Sweep { start: end, end };
                    length += world.cut(body, &still).unwrap().length;
                    world.step(2e-3).unwrap();
                }
            }
        }
        assert!(length > 0.07, "{length} m were cut");
        // One cut boundary: it connects any two of its edges, without a bridge.
        let it = world.body(body).unwrap();
        let surface = it.surface();
        let mut next = std::collections::BTreeMap::new();
        let sides = |triangle: &[u32; 3]| [0, 1, 2].map(|k| (triangle[k], triangle[(k + 1) % 3]));
        let all: std::collections::BTreeSet<(u32, u32)> = surface.iter().flat_map(sides).collect();
        let is_outer = |node: u32| (node as usize) < rest.len() && is_rim(&rest[node as usize]);
        for &(from, to) in &all {
            let is_border = is_outer(from) && is_outer(to);
            if !(is_border || all.contains(&(to, from))) {
                assert!(
                    next.insert(from, to).is_none(),
                    "{solver:?}: two sides of the rim begin at {from}"
                );
            }
        }
        let (&first, _) = next.iter().next().unwrap();
        let (mut at, mut count) = (first, 0);
        loop {
            at = next[&at];
            count += 1;
            if at == first {
                break;
            }
        }
        assert_eq!(count, next.len(), "{solver:?}: the cut boundary has several components");
    }
}

#[test]
fn no_spring_off_the_edges_stays_across_a_cut() {
    for is_given in [true, false] {
        let (rest, cells) = super::sheet::grid(12);
        let positions: Vec<Vec3> = rest.iter().map(|position| 0.01 * *position).collect();
        let at = |x: u32, y: u32| y * 13 + x;
        let mut edges: Vec<[u32; 2]> = cells
            .iter()
            .flat_map(|cell| [0, 1, 2].map(|k| [cell[k].min(cell[(k + 1) % 3]), cell[k].max(cell[(k + 1) % 3])]))
            .collect();
        edges.sort_unstable();
        edges.dedup();
        // Springs that span two cells keep the sheet from folding.
        let over: Vec<[u32; 2]> = (0..13)
            .flat_map(|a| (0..11).flat_map(move |b| [[at(b, a), at(b + 2, a)], [at(a, b), at(a, b + 2)]]))
            .collect();
        let all = [&edges[..], &over[..]].concat();
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            ..Default::default()
        })
        .unwrap();
        let definition = BodyDefinition {
            positions: &positions,
            masses: Values::Uniform(1e-4),
            triangles: &cells,
            springs: Some(if is_given { &all } else { &edges }),
            stiffnesses: Values::Uniform(50.0),
            spare_nodes: 400,
            mass_scaling: 0.0,
            ..Default::default()
        };
        let body = world.create_body(&definition).unwrap();
        if !is_given {
            for &[a, b] in &over {
                world.body_mut(body).unwrap().add_spring(a, b, 50.0, None).unwrap();
            }
        }
        let stretched: Vec<Vec3> = positions
            .iter()
            .map(|position| *position * vec3(1.1, 1.05, 1.0))
            .collect();
        world.body_mut(body).unwrap().set_positions(&stretched).unwrap();
        world.step(1e-3).unwrap();
        let before = kept(&world, body);
        let edge = |x: f32, y: f32| [vec3(x, y, -0.05), vec3(x, y, 0.05)];
        let sweep = Sweep {
            start: edge(-0.01, 0.058),
            end: edge(0.15, 0.067),
        };
        assert_eq!(world.cut(body, &sweep).unwrap().pieces_parted, 1);
        // Springs also connect pieces.
        assert_eq!(
            world.body(body).unwrap().pieces().unwrap().count,
            2,
            "given at first: {is_given}"
        );
        let after = kept(&world, body);
        assert!(after.energy < before.energy, "removed springs stored energy");
        assert!(after.momentum.distance(before.momentum) < 1e-9);
    }
}
