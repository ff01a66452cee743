//! Bodies of springs alone lose exactly the springs that a blade passes through.

use glam::{DVec3, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::{BodyDefinition, BodyId, Solver, Storage, Values, World, WorldDefinition};

use crate::support::random::Random;

const SIDE: usize = 7;

/// Connects each node of an irregular lattice to all nodes within 1.8 edges, in flight and swinging.
fn lattice(solver: Solver, storage: Storage) -> (World, BodyId, Vec<[u32; 2]>) {
    let mut random = Random(9);
    let positions: Vec<Vec3> = (0..SIDE * SIDE * SIDE)
        .map(|node| {
            let [x, y, z] = [node % SIDE, node / SIDE % SIDE, node / SIDE / SIDE].map(|at| at as f32);
            vec3(x, y, z)
                + 0.2
                    * vec3(
                        random.between(-1.0, 1.0),
                        random.between(-1.0, 1.0),
                        random.between(-1.0, 1.0),
                    )
        })
        .collect();
    let mut springs = Vec::new();
    for a in 0..positions.len() {
        for b in 0..a {
            if positions[a].distance(positions[b]) < 1.8 {
                springs.push([b as u32, a as u32]);
            }
        }
    }
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..Default::default()
    })
    .unwrap();
    let body = world
        .create_body(&BodyDefinition {
            positions: &positions,
            masses: Values::Uniform(0.01),
            springs: Some(&springs),
            stiffnesses: Values::Uniform(40.0),
            spare_nodes: 1,
            mass_scaling: 0.0,
            solver,
            storage,
            ..Default::default()
        })
        .unwrap();
    let velocities: Vec<Vec3> = positions
        .iter()
        .map(|position| {
            vec3(0.3, 0.1, -0.2)
                + vec3(0.0, 1.0, 2.0).cross(*position)
                + 0.5 * vec3(random.between(-1.0, 1.0), 0.0, 0.0)
        })
        .collect();
    world.body_mut(body).unwrap().set_velocities(&velocities).unwrap();
    (world, body, springs)
}

/// True if a segment passes through the parallelogram from `corner` along two sides.
fn crosses(ends: [Vec3; 2], corner: Vec3, sides: [Vec3; 2]) -> bool {
    let [from, to] = ends.map(|end| end.as_dvec3() - corner.as_dvec3());
    let [u, v] = sides.map(|side| side.as_dvec3());
    let normal = u.cross(v);
    let (before, after) = (normal.dot(from), normal.dot(to));
    if before * after > 0.0 {
        return false;
    }
    let at = from + (to - from) * (before / (before - after));
    let along = |a: DVec3, b: DVec3| at.cross(b).dot(normal) / a.cross(b).dot(normal);
    (0.0..=1.0).contains(&along(u, v)) && (0.0..=1.0).contains(&along(v, u))
}

#[test]
fn springs_crossed_by_the_blade_are_removed() {
    for (solver, storage) in [
        (Solver::Verlet, Storage::Packed),
        (Solver::Verlet, Storage::Efficient),
        (Solver::Verlet, Storage::FastLink),
        (Solver::Implicit, Storage::DynamicBulk),
        (Solver::Newton, Storage::Packed),
    ] {
        let what = format!("{solver:?}, {storage:?}");
        let (mut world, body, mut springs) = lattice(solver, storage);
        // A spring added later, across the lattice.
        let last = (SIDE * SIDE * SIDE) as u32 - 1;
        if storage != Storage::FastLink {
            world.body_mut(body).unwrap().add_spring(0, last, 1.0, None).unwrap();
            springs.push([0, last]);
        }
        let mut random = Random(4);
        for cut in 0..5 {
            for _ in 0..3 {
                world.step(5e-3).unwrap();
            }
            let it = world.body(body).unwrap();
            let positions = it.positions().to_vec();
            let mut vector = |size: f32| {
                size * vec3(
                    random.between(-1.0, 1.0),
                    random.between(-1.0, 1.0),
                    random.between(-1.0, 1.0),
                )
            };
            let middle = positions.iter().sum::<Vec3>() / positions.len() as f32;
            let (corner, sides) = if cut == 4 {
                (
                    middle - Vec3::splat(20.0) + 0.3 * Vec3::Z,
                    [40.0 * Vec3::X, vec3(0.0, 40.0, 40.0)],
                )
            } else {
                (middle + vector(2.0), [vector(4.0), vector(4.0)])
            };
            let sweep = Sweep {
                start: [corner, corner + sides[0]],
                end: [corner + sides[1], corner + sides[0] + sides[1]],
            };
            let momentum = |world: &World| -> DVec3 {
                world
                    .body(body)
                    .unwrap()
                    .velocities()
                    .iter()
                    .map(|velocity| 0.01 * velocity.as_dvec3())
                    .sum()
            };
            let energy = |world: &World| world.body(body).unwrap().energy(Vec3::ZERO);
            let before = (momentum(&world), energy(&world), it.topology_version());
            let report = world.cut(body, &sweep).unwrap();
            let is_cut = |spring: &[u32; 2]| crosses(spring.map(|node| positions[node as usize]), corner, sides);
            let expected: Vec<[u32; 2]> = springs.iter().copied().filter(is_cut).collect();
            springs.retain(|spring| !is_cut(spring));
            assert!(!expected.is_empty());
            assert_eq!(report.springs_removed as usize, expected.len(), "{what}, cut {cut}");
            let it = world.body(body).unwrap();
            let mut reported: Vec<[u32; 2]> = it.changes_since(before.2).unwrap().removed_springs.to_vec();
            reported.iter_mut().for_each(|spring| spring.sort_unstable());
            reported.sort_unstable();
            let mut known = expected.clone();
            known.sort_unstable();
            assert_eq!(reported, known, "{what}, cut {cut}");
            assert_eq!(it.node_count(), positions.len());
            assert!(
                momentum(&world).distance(before.0) < 1e-6 * before.0.length(),
                "{what}, cut {cut}"
            );
            let after = energy(&world);
            assert!(
                (after.kinetic / before.1.kinetic - 1.0).abs() < 1e-6 && after.elastic < before.1.elastic,
                "{what}, cut {cut}"
            );
        }
        assert_eq!(world.body(body).unwrap().pieces().unwrap().count, 2, "{what}");
        for [a, b] in springs {
            world.body_mut(body).unwrap().remove_spring(a, b).unwrap();
        }
        assert_eq!(
            world.body(body).unwrap().pieces().unwrap().count as usize,
            SIDE * SIDE * SIDE,
            "{what}"
        );
    }
}
