//! Attachments between bodies: which bodies they couple, attachments over long distances, and calls that change
//! nothing.

use super::allocator::allocator_calls;
use crate::support::hanging::*;
use crate::support::tissue::*;
use glam::{DVec3, Vec3};
use sinew::{
    Anchor, BodyContact, BodyId, Error, RestStateDefinition, Solver, SurfacePoint, SutureDefinition, World,
    WorldDefinition,
};

const SOLVERS: [[Solver; 2]; 4] = [
    [Solver::Verlet; 2],
    [Solver::Implicit; 2],
    [Solver::Newton; 2],
    [Solver::Verlet, Solver::Implicit],
];

/// Returns the total momentum of these bodies.
fn sum_of(world: &World, bodies: &[(BodyId, f32)]) -> DVec3 {
    let momentum_of = |&(id, mass): &(BodyId, f32)| {
        let body = body(world, id);
        momentum(body, mass / body.node_count() as f32)
    };
    bodies.iter().map(momentum_of).sum()
}

#[test]
fn distant_points_are_pulled_together_gently() {
    for solvers in SOLVERS {
        for (distance, dt, seconds) in [
            (0.05, 1e-3, 0.4),
            (0.2, 1.0 / 60.0, 0.2),
            (1e4, 1.0 / 60.0, 0.1),
            (1e30, 1e-3, 0.01),
        ] {
            let mut world = world(Vec3::ZERO);
            let [left, right] = [0, 1].map(|index| Block {
                solver: solvers[index],
                at: Vec3::X * (index as f32 * (SIZE + distance)),
                ..Block::FREE
            });
            let ids = [left, right].map(|block| block.put(&mut world));
            let faces = [(left, 0.5), (right, -0.5)].map(|(block, side)| {
                nodes_at(
                    &Block {
                        at: Vec3::ZERO,
                        ..block
                    }
                    .mesh(),
                    |position| position.x == side * SIZE,
                )
            });
            world
                .attach_to_body(ids[0], &anchors(&faces[0]), ids[1], &anchors(&faces[1]), 0.0)
                .expect("attachments");
            let gap = |world: &World| {
                let [left, right] = ids.map(|id| body(world, id).positions());
                let pairs = faces[0].iter().zip(&faces[1]);
                let gaps = pairs.map(|(&a, &b)| left[a as usize].distance(right[b as usize]));
                gaps.fold(0.0, f32::max)
            };
            let bodies = ids.map(|id| (id, left.mass));
            let (first, mut largest, mut fastest) = (gap(&world), 0.0_f32, 0.0_f32);
            for _ in 0..(seconds / dt) as u32 {
                world.step(dt).expect("a step");
                for id in ids {
                    let body = body(&world, id);
                    assert!(all_finite(body), "{solvers:?}, {distance} m");
                    let middle = centre(body);
                    let distance_to_center = |position: &Vec3| (position.as_dvec3() - middle).length() as f32;
                    if distance < 1e3 {
                        largest = largest.max(body.positions().iter().map(distance_to_center).fold(0.0, f32::max));
                    }
                    fastest = fastest.max(body.velocities().iter().map(|v| v.length()).fold(0.0, f32::max));
                }
            }
            let error = sum_of(&world, &bodies).length();
            assert!(largest < 0.9 * SIZE, "{solvers:?}, {distance} m: {largest} m");
            assert!(fastest < 0.5, "{solvers:?}, {distance} m: {fastest} m/s");
            assert!(error < 1e-6, "{solvers:?}, {distance} m: momentum {error}");
            if distance < 0.1 {
                assert!(gap(&world) < 1e-5, "{solvers:?}: {} m apart", gap(&world));
            } else if distance < 1.0 {
                assert!(gap(&world) < first - 0.03, "{solvers:?}: {} m apart", gap(&world));
            }
        }
    }
}

#[test]
fn separate_pairs_do_not_affect_each_other() {
    let positions = [false, true].map(|has_other| {
        let mut hanging = Hanging::new(Block::CALM, Block::CALM, 4, DOWN);
        if has_other {
            // This pair takes substeps of a quarter of a millisecond.
            let [first, second] = [2.0, 2.0 + SIZE].map(|x| Block {
                at: Vec3::X * x,
                solver: Solver::Implicit,
                ..Block::CALM
            });
            let [left, right] = [first, second].map(|block| block.put(&mut hanging.world));
            let joint = [Anchor::Node(0)];
            let attached = hanging.world.attach_to_body(left, &joint, right, &joint, 0.0);
            attached.expect("an attachment");
        }
        for _ in 0..30 {
            let report = hanging.world.step(4e-3).expect("a step");
            assert_eq!(report.substeps == 16, has_other, "{report:?}");
        }
        [hanging.above, hanging.below].map(|id| body(&hanging.world, id).positions().to_vec())
    });
    assert_eq!(positions[0], positions[1]);
}

/// Contact with other bodies.
const COLLIDING: BodyContact = BodyContact {
    thickness: 0.2e-3,
    with_bodies: true,
    ..BodyContact::NOTHING
};

#[test]
fn a_collision_moves_all_attached_bodies() {
    for solvers in SOLVERS {
        let mut world = world(Vec3::ZERO);
        // The first block flies at the second. The third is attached to the second, and the fourth, which collides with
        // nothing, to the third.
        let ids = [0, 1, 2, 3].map(|index| {
            let gap = if index == 0 { 0.005 } else { 0.0 };
            let block = Block {
                at: Vec3::X * (index as f32 * SIZE - gap),
                solver: solvers[index % 2],
                contact: if index < 3 { COLLIDING } else { BodyContact::NOTHING },
                stiffness: 300.0,
                ..Block::FREE
            };
            block.put(&mut world)
        });
        let faces = [0.5, -0.5].map(|side| {
            let is_corner =
                |position: Vec3| position.x == side * SIZE && position.y.abs() > 0.009 && position.z.abs() > 0.019;
            nodes_at(&Block::FREE.mesh(), is_corner)
        });
        assert_eq!(faces[0].len(), 4);
        for [left, right] in [[1, 2], [2, 3]] {
            let attached = world.attach_to_body(ids[left], &anchors(&faces[0]), ids[right], &anchors(&faces[1]), 0.0);
            attached.expect("attachments");
        }
        let count = body(&world, ids[0]).node_count();
        let thrown = world.body_mut(ids[0]).expect("a body");
        thrown.set_velocities(&vec![Vec3::X; count]).expect("velocities");
        let bodies = ids.map(|id| (id, 0.1));
        let first = sum_of(&world, &bodies);
        let (mut error, mut drift) = (0.0_f64, 0.0_f32);
        for _ in 0..60 {
            let report = world.step(2e-3).expect("a step");
            assert_eq!(report.crossings, 0, "{solvers:?}");
            error = error.max((sum_of(&world, &bodies) - first).length());
            for [left, right] in [[1, 2], [2, 3]] {
                let [left, right] = [left, right].map(|index| body(&world, ids[index]).positions());
                for (&a, &b) in faces[0].iter().zip(&faces[1]) {
                    drift = drift.max(left[a as usize].distance(right[b as usize]));
                }
            }
        }
        let fractions = bodies.map(|body| sum_of(&world, &[body]).x / first.x);
        // Most of the error is rounding in contact sweeps.
        assert!(error < 1e-5 * first.x, "{solvers:?}: off by {error} of {first}");
        assert!(drift < 1e-5, "{solvers:?}: {drift} m");
        assert!(fractions[0] < 0.5 && fractions[3] > 0.1, "{solvers:?}: {fractions:?}");
    }
}

#[test]
fn a_restarted_step_transfers_the_same_momentum() {
    for solvers in SOLVERS {
        // From rest, the force of one step drives the pair into the waiting third block.
        let mut world = world(Vec3::ZERO);
        let ids = [0, 1, 2].map(|index| {
            let gap = if index == 2 { 0.002 } else { 0.0 };
            let block = Block {
                at: Vec3::X * (index as f32 * SIZE + gap),
                solver: solvers[index % 2],
                contact: COLLIDING,
                ..Block::FREE
            };
            block.put(&mut world)
        });
        let faces = [0.5, -0.5].map(|side| nodes_at(&Block::FREE.mesh(), |position| position.x == side * SIZE));
        world
            .attach_to_body(ids[0], &anchors(&faces[0]), ids[1], &anchors(&faces[1]), 0.0)
            .expect("attachments");
        let (force, dt) = (Vec3::X, 1.0 / 60.0);
        let forces = vec![force; faces[0].len()];
        let pushed = world.body_mut(ids[0]).expect("a body");
        pushed.apply_forces(&faces[0], &forces).expect("forces");
        world.step(dt).expect("a step");
        let bodies = ids.map(|id| (id, 0.1));
        let expected = force.as_dvec3() * f64::from(dt) * forces.len() as f64;
        let error = (sum_of(&world, &bodies) - expected).length() / expected.x;
        let impulse_fraction = sum_of(&world, &bodies[2..]).x / expected.x;
        assert!(error < 2e-6, "{solvers:?}: off by {error}");
        assert!(impulse_fraction > 0.01, "{solvers:?}: {impulse_fraction}");
        // Applied forces act in one step only.
        world.step(1e-3).expect("a step");
        let error = (sum_of(&world, &bodies) - expected).length() / expected.x;
        assert!(error < 2e-6, "{solvers:?}: off by {error} after another");
    }
}

#[test]
fn refused_calls_change_nothing() {
    let mut hanging = Hanging::new(
        Block::CALM,
        Block {
            solver: Solver::Implicit,
            ..Block::CALM
        },
        4,
        DOWN,
    );
    for _ in 0..5 {
        hanging.world.step(1e-3).expect("a step");
    }
    let Hanging {
        mut world,
        above,
        below,
        ..
    } = hanging;
    let destroyed = Block::CALM.put(&mut world);
    world.destroy_body(destroyed).expect("destroyed");
    let before = world.state_hash();
    let node = |node: u32| vec![Anchor::Node(node)];
    let point = |triangle: u32, weights: [f32; 3]| vec![Anchor::Point(SurfacePoint { triangle, weights })];
    let cases = [
        ("nodes[0]", above, node(75), below, node(0), 0.0),
        ("other_nodes[0]", above, node(0), below, node(u32::MAX), 0.0),
        (
            "other_nodes[1]",
            above,
            [node(0), node(1)].concat(),
            below,
            [node(0), node(75)].concat(),
            0.0,
        ),
        ("other_anchors", above, node(0), below, Vec::new(), 0.0),
        ("one point", above, node(3), above, node(3), 0.0),
        ("force_limit", above, node(0), below, node(0), f32::NAN),
        ("force_limit", above, node(0), below, node(0), -1.0),
        (
            "triangles[0]",
            above,
            point(10_000, [1.0, 0.0, 0.0]),
            below,
            node(0),
            0.0,
        ),
        (
            "other_weights[0]",
            above,
            node(0),
            below,
            point(0, [0.5, 0.5, 0.5]),
            0.0,
        ),
        ("weights[0]", above, point(0, [f32::NAN, 0.5, 0.5]), below, node(0), 0.0),
        ("weights[0]", above, point(0, [-1.0, 1.0, 1.0]), below, node(0), 0.0),
    ];
    for (name, body, anchors, other, others, limit) in cases {
        let refused = world.attach_to_body(body, &anchors, other, &others, limit);
        let Err(Error::InvalidArgument(message)) = refused else {
            panic!("{name}: {refused:?}")
        };
        assert!(message.contains(name), "{name}: {message}");
        assert_eq!(world.state_hash(), before, "{name}");
    }
    for [body, other] in [[destroyed, below], [above, destroyed]] {
        let refused = world.attach_to_body(body, &node(0), other, &node(0), 0.0);
        assert!(matches!(refused, Err(Error::StaleId(_))), "{refused:?}");
    }
    let none = world.attach_to_body(above, &[], below, &[], 0.0).expect("nothing");
    assert!(none.is_empty());
    assert_eq!(world.state_hash(), before);
}

#[test]
fn released_attachments_leave_no_trace() {
    for solvers in SOLVERS {
        let hashes = [false, true].map(|was_attached| {
            let mut world = world(DOWN);
            let ids = [0, 1].map(|index| {
                let at = Vec3::X * (index as f32 * SIZE);
                let solver = solvers[index];
                Block {
                    at,
                    solver,
                    ..Block::CALM
                }
                .put(&mut world)
            });
            if was_attached {
                let joint = [Anchor::Node(0)];
                let attached = world.attach_to_body(ids[0], &joint, ids[1], &joint, 0.0);
                for id in attached.expect("attachments") {
                    world.release(id).expect("released");
                }
            }
            let mut hashes = Vec::new();
            for _ in 0..20 {
                let mut substeps = 0;
                let calls = allocator_calls(|| substeps = world.step(4e-3).expect("a step").substeps);
                assert_eq!(calls, 0);
                hashes.push((world.state_hash(), substeps));
            }
            hashes
        });
        assert_eq!(hashes[0], hashes[1], "{solvers:?}");
    }
}

#[test]
fn equilibrium_of_attached_bodies_is_refused() {
    let mut hanging = Hanging::new(Block::CALM, Block::CALM, 4, DOWN);
    let before = hanging.world.state_hash();
    for id in [hanging.above, hanging.below] {
        let refused = hanging.world.rest_state(id, &RestStateDefinition::default());
        assert!(matches!(refused, Err(Error::InvalidArgument(_))), "{refused:?}");
    }
    assert_eq!(hanging.world.state_hash(), before);
    for &id in &hanging.ids {
        hanging.world.release(id).expect("released");
    }
    hanging
        .world
        .rest_state(hanging.above, &RestStateDefinition::default())
        .expect("a state of rest");
}

#[test]
fn the_state_hash_covers_attachments_and_threads_change_nothing() {
    let hashes = [1, 3].map(|thread_count| {
        let mut hashes = Vec::new();
        // All threads share the large bodies.
        for (solvers, cells, steps) in [
            ([Solver::Verlet; 2], [4, 2, 4], 20),
            ([Solver::Verlet, Solver::Implicit], [4, 2, 4], 20),
            ([Solver::Verlet; 2], [24, 16, 24], 2),
            ([Solver::Implicit, Solver::Verlet], [24, 16, 24], 1),
        ] {
            let world = World::new(WorldDefinition {
                thread_count,
                ..Default::default()
            });
            let [above, below] = solvers.map(|solver| Block {
                solver,
                cells,
                ..Block::FREE
            });
            let mut hanging = Hanging::in_world(world.expect("a world"), above, below, 4);
            for _ in 0..steps {
                hanging.world.step(1e-3).expect("a step");
                hashes.push(hanging.world.state_hash());
            }
        }
        hashes
    });
    assert_eq!(hashes[0], hashes[1]);
    // The worlds differ only in their attachments: all, all but one, and none.
    let hashes = [0, 1, 4].map(|count| {
        let mut hanging = Hanging::new(Block::FREE, Block::FREE, 4, DOWN);
        for &id in &hanging.ids[..count] {
            hanging.world.release(id).expect("released");
        }
        hanging.world.state_hash()
    });
    assert!(hashes[0] != hashes[1] && hashes[1] != hashes[2] && hashes[2] != hashes[0]);
}

#[test]
fn a_step_allocates_nothing() {
    for solvers in [[Solver::Verlet; 2], [Solver::Implicit, Solver::Newton]] {
        let [above, below] = solvers.map(|solver| Block { solver, ..Block::CALM });
        let mut hanging = Hanging::new(above, below, 4, DOWN);
        let [up, down] = hanging.pairs[0];
        hanging.world.release(hanging.ids[0]).expect("released");
        let weak = hanging.world.attach_to_body(
            hanging.below,
            &[Anchor::Node(down)],
            hanging.above,
            &[Anchor::Node(up)],
            1e-6,
        );
        weak.expect("an attachment");
        // The suture is tightened until it breaks.
        let [up, down] = [hanging.pairs[1][0], hanging.pairs[2][1]].map(Anchor::Node);
        let definition = SutureDefinition {
            length: Some(0.01),
            force_limit: 0.05,
            stiffness: 10.0,
        };
        let attached = hanging
            .world
            .suture(hanging.below, &down, hanging.above, &up, &definition);
        attached.expect("a suture");
        let mut lost = 0;
        for step in 0..10 {
            let calls = allocator_calls(|| drop(hanging.world.step(4e-3)));
            assert_eq!(calls, 0, "{solvers:?}, step {step}");
            lost += hanging.world.slipped().len();
        }
        assert_eq!(lost, 2, "{solvers:?}");
    }
}
