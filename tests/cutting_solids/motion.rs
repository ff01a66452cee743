//! Solids that are cut in motion: conserved quantities, with every material, storage and solver.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::{DVec3, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::boundary;
use sinew::{
    BladeDefinition, Body, BodyDefinition, BodyId, ElementLaw, Material, Model, Solver, Storage, Values, Viscosity,
    World, WorldDefinition,
};

use super::block::{Mesh, shaken, upright};
use crate::support::kept::kept;
use crate::support::random::Random;
use crate::support::scene::SOLVERS;

/// The material of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Matter {
    Springs,
    Elements,
    Viscous,
    Both,
    /// Elements with average nodal pressure.
    Rings,
    ViscousRings,
    /// Elements with fibers, and a skin that resists bending.
    Fibres,
    NeoHookean,
    MooneyRivlinRings,
}

const MATTER: [Matter; 9] = [
    Matter::Springs,
    Matter::Elements,
    Matter::Viscous,
    Matter::Both,
    Matter::Rings,
    Matter::ViscousRings,
    Matter::Fibres,
    Matter::NeoHookean,
    Matter::MooneyRivlinRings,
];

/// Sides of 6, 5 and 4 cm.
pub fn mesh() -> Mesh {
    let (rest, cells) = shaken([6, 5, 4], 3);
    let cells = cells.iter().map(|&cell| upright(&rest, cell)).collect();
    (rest.iter().map(|&position| 0.01 * position).collect(), cells)
}

fn edges_of(cells: &[[u32; 4]]) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = cells
        .iter()
        .flat_map(|cell| (0..4).flat_map(move |a| (0..a).map(move |b| [cell[a].min(cell[b]), cell[a].max(cell[b])])))
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

fn made(matter: Matter, solver: Solver, storage: Storage, gravity: Vec3) -> (World, BodyId) {
    let (positions, cells) = mesh();
    let masses = vec![1e-3; positions.len()];
    let edges = edges_of(&cells);
    let directions = vec![vec3(0.6, 0.8, 0.0); cells.len()];
    let skin = boundary(&cells).unwrap();
    let mut world = World::new(WorldDefinition {
        gravity,
        ..Default::default()
    })
    .unwrap();
    let elements = Material {
        model: Model::Tetrahedra,
        young_modulus: 3000.0,
        poisson_ratio: match matter {
            Matter::Rings => 0.49,
            Matter::ViscousRings | Matter::MooneyRivlinRings => 0.45,
            _ => 0.3,
        },
        ..Default::default()
    };
    let definition = BodyDefinition {
        positions: &positions,
        masses: Values::Each(&masses),
        tetrahedra: &cells,
        springs_per_node: if storage == Storage::FastLink { 40 } else { 0 },
        spare_nodes: 3000,
        mass_scaling: 0.0,
        solver,
        storage,
        ..Default::default()
    };
    let definition = match matter {
        Matter::Springs => BodyDefinition {
            stiffnesses: Values::Uniform(20.0),
            ..definition
        },
        Matter::Elements | Matter::Rings => BodyDefinition {
            material: Some(elements),
            ..definition
        },
        Matter::NeoHookean => BodyDefinition {
            material: Some(elements),
            element_law: ElementLaw::NeoHookean,
            ..definition
        },
        Matter::MooneyRivlinRings => BodyDefinition {
            material: Some(elements),
            element_law: ElementLaw::MooneyRivlin { ratio: 0.3 },
            ..definition
        },
        Matter::Viscous | Matter::ViscousRings => BodyDefinition {
            material: Some(elements),
            viscosity: Viscosity {
                retardation_time: 0.05,
                relaxation_time: 0.05,
            },
            ..definition
        },
        Matter::Fibres => BodyDefinition {
            material: Some(elements),
            triangles: &skin,
            bending_stiffness: 1e-4,
            fibre_directions: &directions,
            fibre_stiffnesses: Values::Uniform(5000.0),
            ..definition
        },
        Matter::Both => BodyDefinition {
            material: Some(elements),
            springs: Some(&edges),
            stiffnesses: Values::Uniform(5.0),
            ..definition
        },
    };
    let body = world.create_body(&definition).unwrap();
    (world, body)
}

/// In flight without gravity, spinning and swinging.
pub fn in_flight(matter: Matter, solver: Solver, storage: Storage) -> (World, BodyId) {
    let (mut world, body) = made(matter, solver, storage, Vec3::ZERO);
    let positions = world.body(body).unwrap().positions().to_vec();
    let mut random = Random(3);
    let centre = positions.iter().sum::<Vec3>() / positions.len() as f32;
    let velocities: Vec<Vec3> = positions
        .iter()
        .map(|&position| vec3(0.3, -0.2, 0.1) + vec3(3.0, 2.0, 6.0).cross(position - centre) + random.point(-0.1, 0.1))
        .collect();
    world.body_mut(body).unwrap().set_velocities(&velocities).unwrap();
    (world, body)
}

/// Returns a blade's edge along z through a point of the rest shape (m), at the block's current positions.
pub fn edge(body: &Body, [x, y]: [f32; 2], depth: [f32; 2]) -> [Vec3; 2] {
    let positions = body.positions();
    // Corners of the block, far from each other.
    let at = |i: usize, j: usize, k: usize| positions[(k * 6 + j) * 7 + i];
    let (origin, x_axis, y_axis, z_axis) = (at(0, 0, 0), at(6, 0, 0), at(0, 5, 0), at(0, 0, 4));
    depth.map(|z| {
        origin + (x_axis - origin) * (x / 0.06) + (y_axis - origin) * (y / 0.05) + (z_axis - origin) * (z / 0.04)
    })
}

pub const CUTS: [[[f32; 2]; 3]; 4] = [
    [[-0.02, 0.023], [0.032, 0.026], [-0.02, 0.06]],
    [[0.032, 0.026], [0.08, 0.029], [-0.02, 0.06]],
    [[0.022, -0.02], [0.026, 0.07], [-0.02, 0.06]],
    [[0.04, 0.012], [0.052, 0.037], [0.015, 0.06]],
];

#[test]
fn cuts_in_motion_keep_mass_momentum_and_energy() {
    cuts_in_motion_keep_mass_momentum_and_energy_of(|matter, solver, storage| {
        is_short(matter, solver) && storage == Storage::Packed
    });
}

#[test]
#[ignore = "long"]
fn cuts_in_motion_keep_mass_momentum_and_energy_in_the_other_cases() {
    cuts_in_motion_keep_mass_momentum_and_energy_of(|matter, solver, storage| {
        !is_short(matter, solver) || storage != Storage::Packed
    });
}

/// Each material with a solver, and each solver with a material; NEWTON, which is slow, with one.
fn is_short(matter: usize, solver: Solver) -> bool {
    solver == SOLVERS[if matter == 1 { 2 } else { matter % 2 }]
}

fn cuts_in_motion_keep_mass_momentum_and_energy_of(is_selected: fn(usize, Solver, Storage) -> bool) {
    for (number, matter) in MATTER.into_iter().enumerate() {
        for solver in SOLVERS {
            for storage in [Storage::Packed, Storage::FastLink, Storage::DynamicBulk] {
                if !is_selected(number, solver, storage) {
                    continue;
                }
                if storage != Storage::Packed && (solver == Solver::Newton || matter == Matter::Elements) {
                    continue;
                }
                let what = format!("{matter:?}, {solver:?}, {storage:?}");
                let (mut world, body) = in_flight(matter, solver, storage);
                let (mut pieces, mut last) = (1, None);
                for [from, to, depth] in CUTS {
                    for _ in 0..5 {
                        world.step(1e-3).unwrap();
                    }
                    let before = kept(&world, body);
                    let it = world.body(body).unwrap();
                    // A continued stroke starts at the blade's last position, although the block has moved.
                    let start = last.filter(|&(at, _)| at == from).map(|(_, edge)| edge);
                    let sweep = Sweep {
                        start: start.unwrap_or(edge(it, from, depth)),
                        end: edge(it, to, depth),
                    };
                    last = Some((to, sweep.end));
                    let report = world.cut(body, &sweep).unwrap();
                    pieces += report.pieces_parted;
                    let after = kept(&world, body);
                    assert!(report.new_nodes > 0 && report.new_triangles > 0, "{what}: {report:?}");
                    assert!(report.area > 1e-4 && report.length > 0.0, "{what}: {report:?}");
                    after.check_motion(&before, &what);
                    let gained = after.energy - before.energy;
                    // Severed hinges of a skin are removed.
                    assert!(
                        gained < 1e-6 * before.energy && (gained > -1e-6 * before.energy || matter == Matter::Fibres),
                        "{what}: energy {} {}",
                        before.energy,
                        after.energy
                    );
                }
                assert_eq!(world.body(body).unwrap().pieces().unwrap().count, pieces, "{what}");
                assert_eq!(pieces, 4, "{what}");

                let at_end = kept(&world, body);
                for _ in 0..100 {
                    world.step(1e-3).unwrap();
                }
                let later = kept(&world, body);
                assert!(
                    later.energy < 1.02 * at_end.energy,
                    "{what}: {} {}",
                    at_end.energy,
                    later.energy
                );
                assert!(later.momentum.distance(at_end.momentum) < 1e-4 * at_end.momentum.length());
            }
        }
    }
}

/// Returns the volume of the render surface with nodes at these positions; it must be closed and oriented outward.
pub fn enclosed(surface: &[[u32; 3]], position: impl Fn(u32) -> DVec3) -> f64 {
    let mut sides = BTreeMap::new();
    let mut volume = 0.0;
    let origin = position(surface[0][0]);
    for corners in surface {
        let [a, b, c] = corners.map(|corner| position(corner) - origin);
        volume += a.dot(b.cross(c)) / 6.0;
        for k in 0..3 {
            *sides.entry((corners[k], corners[(k + 1) % 3])).or_insert(0) += 1;
        }
    }
    for (&(from, to), count) in &sides {
        assert_eq!(sides.get(&(to, from)), Some(count), "opposite side of {from} and {to}");
    }
    volume
}

#[test]
fn a_separate_mesh_follows_the_change_lists() {
    let (mut world, body) = in_flight(Matter::Elements, Solver::Verlet, Storage::Packed);
    let it = world.body(body).unwrap();
    let mut triangles = it.surface().to_vec();
    let mut tracked: Vec<DVec3> = it.positions().iter().map(|position| position.as_dvec3()).collect();
    let whole = enclosed(&triangles, |node| tracked[node as usize]);
    assert!((whole / 1.2e-4 - 1.0).abs() < 1e-6, "{whole}");
    let mut version = 0;
    for [from, to, depth] in CUTS {
        for step in 0..8 {
            world.step(1e-3).unwrap();
            let it = world.body(body).unwrap();
            let at = |part: f32| {
                let [x, y] = [0, 1].map(|k| from[k] + (to[k] - from[k]) * part);
                edge(it, [x, y], depth)
            };
            let sweep = Sweep {
                start: at(step as f32 / 8.0),
                end: at((step + 1) as f32 / 8.0),
            };
            world.cut(body, &sweep).unwrap();
            let it = world.body(body).unwrap();
            let changes = it.changes_since(version).unwrap();
            version = changes.version;
            for new in changes.nodes {
                assert_eq!(new.node as usize, tracked.len());
                let position = (0..3)
                    .map(|k| f64::from(new.weights[k]) * tracked[new.sources[k] as usize])
                    .sum();
                tracked.push(position);
            }
            triangles.resize(it.surface().len(), [0; 3]);
            for &triangle in changes.triangles {
                triangles[triangle as usize] = it.surface()[triangle as usize];
            }
            assert_eq!(triangles, it.surface());
            let now = enclosed(&triangles, |node| tracked[node as usize]);
            assert!((now / whole - 1.0).abs() < 1e-6, "{now} of {whole} m³ is drawn");
        }
    }
}

#[test]
fn cut_off_tissue_falls_and_held_tissue_stays() {
    cut_off_tissue_falls_and_held_tissue_stays_of(is_short);
}

#[test]
#[ignore = "long"]
fn cut_off_tissue_falls_and_held_tissue_stays_in_the_other_cases() {
    cut_off_tissue_falls_and_held_tissue_stays_of(|matter, solver| !is_short(matter, solver));
}

fn cut_off_tissue_falls_and_held_tissue_stays_of(is_selected: fn(usize, Solver) -> bool) {
    for (number, matter) in MATTER.into_iter().enumerate() {
        for solver in SOLVERS.into_iter().filter(|&solver| is_selected(number, solver)) {
            let (mut world, body) = made(matter, solver, Storage::Packed, vec3(0.0, -9.81, 0.0));
            let (rest, _) = mesh();
            for node in (0..rest.len()).filter(|&node| rest[node].y > 0.049) {
                world.body_mut(body).unwrap().pin(node as u32).unwrap();
            }
            for _ in 0..20 {
                world.step(2e-3).unwrap();
            }
            let it = world.body(body).unwrap();
            // Within a layer of cells: nodes of both sides have copies beyond the cut.
            let sweep = Sweep {
                start: edge(it, [-0.02, 0.0255], [-0.02, 0.06]),
                end: edge(it, [0.08, 0.0245], [-0.02, 0.06]),
            };
            let report = world.cut(body, &sweep).unwrap();
            assert_eq!(report.pieces_parted, 1, "{matter:?}, {solver:?}");
            assert!(
                (report.area / 0.0024 - 1.0).abs() < 0.15,
                "{matter:?}, {solver:?}: {report:?}"
            );
            let it = world.body(body).unwrap();
            let pieces = it.pieces().unwrap();
            assert_eq!(pieces.count, 2);
            let centre = |world: &World| {
                let it = world.body(body).unwrap();
                let (mut sum, mut mass) = (DVec3::ZERO, 0.0);
                for (node, position) in (0..).zip(it.positions()) {
                    if pieces.of_nodes[node as usize] == pieces.of_nodes[0] {
                        let node_mass = f64::from(it.node_mass(node).unwrap());
                        sum += node_mass * position.as_dvec3();
                        mass += node_mass;
                    }
                }
                sum / mass
            };
            let still = vec![Vec3::ZERO; it.node_count()];
            world.body_mut(body).unwrap().set_velocities(&still).unwrap();
            let start = centre(&world);
            let time = 30.0 * 2e-3;
            for _ in 0..30 {
                world.step(2e-3).unwrap();
            }
            // Nothing holds it any more. First-order implicit steps fall by one step more.
            let fallen = start.y - centre(&world).y;
            let free = 0.5 * 9.81 * time * time;
            assert!(
                (fallen / free - 1.0).abs() < 0.04,
                "{matter:?}, {solver:?}: {fallen} of {free} m"
            );
            let it = world.body(body).unwrap();
            for node in (0..rest.len()).filter(|&node| rest[node].y > 0.049) {
                assert_eq!(
                    it.positions()[node],
                    rest[node],
                    "{matter:?}, {solver:?}: node {node} is held"
                );
            }
        }
    }
}

#[test]
fn a_stroke_through_opening_tissue_leaves_no_bridge() {
    a_stroke_through_opening_tissue_leaves_no_bridge_of(0..8);
}

#[test]
#[ignore = "long"]
fn a_stroke_through_opening_tissue_leaves_no_bridge_in_the_other_rounds() {
    a_stroke_through_opening_tissue_leaves_no_bridge_of(8..24);
}

fn a_stroke_through_opening_tissue_leaves_no_bridge_of(rounds: Range<usize>) {
    let (rest, cells) = mesh();
    let mut random = Random(8);
    for round in 0..rounds.end {
        let [a, b, lean, bend] = [0; 4].map(|_| random.between(-1.0, 1.0));
        if !rounds.contains(&round) {
            continue;
        }
        let solver = SOLVERS[round % 2];
        let positions: Vec<Vec3> = rest.iter().map(|&position| position * vec3(1.2, 1.0, 1.0)).collect();
        let mut world = World::new(WorldDefinition::default()).unwrap();
        let body = world
            .create_body(&BodyDefinition {
                positions: &positions,
                rest_positions: Some(&rest),
                tetrahedra: &cells,
                material: Some(Material {
                    model: Model::Tetrahedra,
                    young_modulus: 5000.0,
                    poisson_ratio: 0.35,
                    density: 1000.0,
                    ..Default::default()
                }),
                node_dampings: Values::Uniform([1e-2, 3e-2, 1e-1, 0.3][round % 4]),
                spare_nodes: 3000,
                solver,
                ..Default::default()
            })
            .unwrap();
        for node in (0..rest.len()).filter(|&node| rest[node].x < 0.001 || rest[node].x > 0.059) {
            world.body_mut(body).unwrap().pin(node as u32).unwrap();
        }
        let steps = [15, 40, 90][round % 3];
        let edge = |part: f32| {
            let x = 0.036 + 0.008 * a + 0.008 * b * (2.0 * part - 1.0) + 0.003 * bend * (3.0 * part).sin();
            let y = -0.01 + 0.07 * part;
            [
                vec3(x - 0.004 * lean, y, -0.02),
                vec3(x + 0.004 * lean, y + 0.006 * bend, 0.06),
            ]
        };
        for step in 0..steps {
            let at = |step: i32| edge(step as f32 / steps as f32);
            let sweep = Sweep {
                start: at(step),
                end: at(step + 1),
            };
            world.cut(body, &sweep).unwrap();
            world.step(1.0 / 120.0).unwrap();
        }
        let count = world.body(body).unwrap().pieces().unwrap().count;
        assert_eq!(count, 2, "round {round}, {steps} steps, {solver:?}");
    }
}

#[test]
fn tetrahedra_may_have_either_orientation() {
    let (positions, cells) = mesh();
    let turned: Vec<[u32; 4]> = (0..)
        .zip(&cells)
        .map(|(at, &[a, b, c, d])| if at % 3 == 0 { [b, a, c, d] } else { [a, b, c, d] })
        .collect();
    let mut seen = Vec::new();
    for tetrahedra in [&cells, &turned] {
        let mut world = World::new(WorldDefinition::default()).unwrap();
        let body = world
            .create_body(&BodyDefinition {
                positions: &positions,
                masses: Values::Uniform(1e-3),
                tetrahedra,
                stiffnesses: Values::Uniform(20.0),
                spare_nodes: 1000,
                ..Default::default()
            })
            .unwrap();
        let it = world.body(body).unwrap();
        let sweep = Sweep {
            start: edge(it, [-0.02, 0.023], [-0.02, 0.06]),
            end: edge(it, [0.08, 0.026], [-0.02, 0.06]),
        };
        let report = world.cut(body, &sweep).unwrap();
        let it = world.body(body).unwrap();
        let volume = enclosed(it.surface(), |node| it.positions()[node as usize].as_dvec3());
        assert!((volume / 1.2e-4 - 1.0).abs() < 1e-6, "{volume}");
        seen.push((report.pieces_parted, (report.area * 1e9) as i64));
    }
    assert_eq!(seen[0].0, 1);
    assert_eq!(seen[0], seen[1]);
}

#[test]
fn two_blades_in_one_solid_have_a_stroke_each() {
    let (mut world, body) = made(Matter::Elements, Solver::Verlet, Storage::Packed, Vec3::ZERO);
    let it = world.body(body).unwrap();
    // They cross, one after the other.
    let paths = [
        [
            edge(it, [-0.01, 0.021], [-0.02, 0.06]),
            edge(it, [0.07, 0.027], [-0.02, 0.06]),
        ],
        [
            edge(it, [0.022, -0.03], [-0.02, 0.06]),
            edge(it, [0.033, 0.06], [-0.02, 0.06]),
        ],
    ];
    let blades = paths.map(|[start, _]| {
        let middle = 0.5 * (start[0] + start[1]);
        let mut definition = BladeDefinition::new(start.map(|end| end - middle));
        definition.pose.position = middle;
        world.create_blade(&definition).unwrap()
    });
    for step in 1..=40 {
        for ((&blade, [start, end]), wait) in blades.iter().zip(&paths).zip([0, 10]) {
            let [from, to] = [start, end].map(|edge| 0.5 * (edge[0] + edge[1]));
            let part = ((step - wait) as f32 / 30.0).clamp(0.0, 1.0);
            world.set_blade_pose(blade, from.lerp(to, part), None).unwrap();
        }
        world.step(2e-3).unwrap();
    }
    assert_eq!(world.body(body).unwrap().pieces().unwrap().count, 4);
}
