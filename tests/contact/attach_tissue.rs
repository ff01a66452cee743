//! Tissue attached to tissue: what holds, what is handed on and when it ends.

use crate::support::hanging::*;
use crate::support::tissue::*;
use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{Anchor, BodyContact, BodyDefinition, BodyId, Error, Solver, SurfacePoint, Values, World};

#[test]
fn a_block_hangs_from_another() {
    a_block_hangs_from_another_of(|case| case % 5 == 2);
}

#[test]
#[ignore = "long"]
fn a_block_hangs_from_another_in_the_other_cases() {
    a_block_hangs_from_another_of(|case| case % 5 != 2);
}

fn a_block_hangs_from_another_of(is_tried: fn(usize) -> bool) {
    let [verlet, implicit] = [Solver::Verlet, Solver::Implicit];
    let mut cases = vec![
        ([0.01, 1.0], [implicit; 2], 1.0 / 60.0, 1),
        ([1.0, 0.01], [implicit; 2], 1e-3, 25),
        ([0.01, 1.0], [verlet, implicit], 1.0 / 60.0, 4),
        ([1.0, 0.01], [implicit, verlet], 1e-3, 4),
    ];
    for masses in [[0.01, 1.0], [1.0, 0.01]] {
        for dt in [1e-3, 1.0 / 60.0] {
            cases.extend([1, 4, 25].map(|count| (masses, [verlet; 2], dt, count)));
        }
    }
    for (_, (masses, solvers, dt, count)) in (0..).zip(cases).filter(|case| is_tried(case.0)) {
        let [above, below] = [0, 1].map(|index| Block {
            mass: masses[index],
            solver: solvers[index],
            ..Block::CALM
        });
        let mut hanging = Hanging::new(above, below, count, DOWN);
        let mut most = 0.0_f32;
        for _ in 0..(0.7 / dt) as u32 {
            hanging.world.step(dt).expect("a step");
            most = most.max(hanging.drift());
        }
        let case = format!("{masses:?} kg, {solvers:?}, {dt} s, {count}");
        let weight = 9.81 * f64::from(masses[1]);
        let off = (hanging.force() + DVec3::Y * -weight).length() / weight;
        assert!(off < 1e-3, "{case}: the force is off by {off:e}");
        assert!(hanging.drift() < 1e-4 * SIZE, "{case}: drift of {}", hanging.drift());
        assert!(most < 1e-3 * SIZE, "{case}: drift of {most} on the way");
        let pins = pin_forces(&hanging.world, hanging.above, &hanging.pinned).y;
        let both = weight + 9.81 * f64::from(masses[0]);
        assert!(
            // What an equation does not know of is damped too.
            (pins - both).abs() < 5e-3 * both,
            "{case}: pins hold {pins} N of {both}"
        );
    }
}

#[test]
fn what_swings_gains_no_energy() {
    for solvers in [
        [Solver::Verlet; 2],
        [Solver::Implicit; 2],
        [Solver::Verlet, Solver::Implicit],
    ] {
        let [above, below] = solvers.map(|solver| Block { solver, ..Block::FREE });
        let mut hanging = Hanging::new(above, below, 1, DOWN);
        let count = body(&hanging.world, hanging.below).node_count();
        let velocities = vec![Vec3::new(0.4, 0.0, 0.2); count];
        let thrown = hanging.world.body_mut(hanging.below).expect("a body");
        thrown.set_velocities(&velocities).expect("velocities");
        let energy = |hanging: &Hanging| -> f64 {
            let bodies = [hanging.above, hanging.below];
            bodies.iter().map(|&id| total_energy(&hanging.world, id)).sum()
        };
        let first = energy(&hanging);
        let thrown = 0.5 * 0.1 * 0.2;
        let (mut most, mut aside) = (f64::NEG_INFINITY, 0.0_f32);
        for _ in 0..500 {
            hanging.world.step(1e-3).expect("a step");
            most = most.max(energy(&hanging) - first);
            let places = body(&hanging.world, hanging.below).positions();
            aside = places.iter().map(|place| place.x.abs()).fold(aside, f32::max);
        }
        assert!(most < 0.03 * thrown, "{solvers:?}: {most} J gained of {thrown}");
        assert!(hanging.drift() < 1e-4 * SIZE, "{solvers:?}: {}", hanging.drift());
        // It did move.
        assert!(aside > 0.7 * SIZE, "{solvers:?}: {aside}");
    }
}

#[test]
fn momentum_is_kept() {
    for solvers in [
        [Solver::Verlet; 2],
        [Solver::Implicit; 2],
        [Solver::Newton; 2],
        [Solver::Verlet, Solver::Implicit],
        [Solver::Implicit, Solver::Newton],
    ] {
        for dt in [1e-3, 1.0 / 120.0] {
            let masses = [0.1, 0.3];
            let [above, below] = [0, 1].map(|index| Block {
                solver: solvers[index],
                mass: masses[index],
                ..Block::FREE
            });
            let mut hanging = Hanging::new(above, below, 4, Vec3::ZERO);
            let Hanging { above, below, .. } = hanging;
            for &node in &hanging.pinned {
                let upper = hanging.world.body_mut(above).expect("a body");
                upper.unpin(node).expect("a free node");
            }
            let count = body(&hanging.world, below).node_count();
            let thrown = hanging.world.body_mut(below).expect("a body");
            let velocities = vec![Vec3::new(0.3, -0.2, 0.1); count];
            thrown.set_velocities(&velocities).expect("velocities");
            let parts = |world: &World| {
                [(above, masses[0]), (below, masses[1])]
                    .map(|(id, mass)| momentum(body(world, id), mass / count as f32))
            };
            let sum = |world: &World| parts(world)[0] + parts(world)[1];
            let first = sum(&hanging.world);
            let (mut off, mut handed) = (0.0_f64, 0.0);
            for _ in 0..(0.1 / dt) as u32 {
                hanging.world.step(dt).expect("a step");
                off = off.max((sum(&hanging.world) - first).length());
                handed += hanging.force().length() * f64::from(dt);
            }
            let [upper, _] = parts(&hanging.world);
            assert!(
                off < 1e-6 * handed,
                "{solvers:?}, {dt}: off by {off} of {handed} handed on"
            );
            assert!(hanging.drift() < 1e-6, "{solvers:?}, {dt}: {} m", hanging.drift());
            assert!(
                upper.length() > 0.05 * first.length(),
                "{solvers:?}, {dt}: {upper} above"
            );
        }
    }
}

#[test]
fn points_come_together_and_hold() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut world = world(DOWN);
        let above = Block {
            solver,
            at: Vec3::Y * (HEIGHT / 2.0),
            ..Block::CALM
        };
        let below = Block {
            at: Vec3::new(0.003, -HEIGHT / 2.0 - 0.002, 0.001),
            ..above
        };
        let [upper, lower] = [above, below].map(|block| block.put(&mut world));
        let top = nodes_at(&above.mesh(), |place| place.y > HEIGHT - 1e-4);
        pin_all(&mut world, upper, &top);
        // Points within triangles of the upper block's bottom, under three corners of it, and nodes of the lower one's top.
        let surface = body(&world, upper).surface().to_vec();
        let rest = above.mesh().positions;
        let weights = [0.2, 0.3, 0.5];
        let spot = |triangle: u32| -> Vec3 {
            let corners = surface[triangle as usize].map(|node| rest[node as usize]);
            (0..3).map(|corner| corners[corner] * weights[corner]).sum()
        };
        let is_below = |triangle: &u32| {
            surface[*triangle as usize]
                .iter()
                .all(|&node| rest[node as usize].y < 1e-4)
        };
        let triangles: Vec<u32> = (0..surface.len() as u32).filter(is_below).collect();
        let lowest = nodes_at(&below.mesh(), |place| place.y > -0.002 - 1e-4);
        let mut pairs = Vec::new();
        for target in [
            Vec3::new(1.0, 0.0, 1.0),
            Vec3::new(-1.0, 0.0, 1.0),
            Vec3::new(0.0, 0.0, -1.0),
        ] {
            let far = |place: Vec3| (place - target * SIZE / 2.0).length();
            let triangle = *triangles
                .iter()
                .min_by(|&&a, &&b| far(spot(a)).total_cmp(&far(spot(b))))
                .expect("a triangle");
            let positions = below.mesh().positions;
            let near = |node: u32| positions[node as usize].distance(spot(triangle));
            let node = *lowest
                .iter()
                .min_by(|&&a, &&b| near(a).total_cmp(&near(b)))
                .expect("a node");
            pairs.push((node, triangle));
        }
        let nodes: Vec<u32> = pairs.iter().map(|pair| pair.0).collect();
        let points: Vec<Anchor> = pairs
            .iter()
            .map(|&(_, triangle)| Anchor::Point(SurfacePoint { triangle, weights }))
            .collect();
        let ids = world
            .attach_to_body(lower, &anchors(&nodes), upper, &points, 0.0)
            .expect("attachments");
        let apart = |world: &World| {
            let [above, below] = [upper, lower].map(|id| body(world, id).positions());
            let gap = |&(node, triangle): &(u32, u32)| {
                let corners = surface[triangle as usize].map(|corner| above[corner as usize]);
                let point: Vec3 = (0..3).map(|corner| corners[corner] * weights[corner]).sum();
                point.distance(below[node as usize])
            };
            pairs.iter().map(gap).fold(0.0, f32::max)
        };
        let first = apart(&world);
        assert!(first > 0.05 * SIZE, "{first}");
        let mut last = first;
        for step in 0..800 {
            world.step(1e-3).expect("a step");
            let gap = apart(&world);
            assert!(
                gap < 1.01 * last + 1e-6,
                "{solver:?}, step {step}: {gap} m apart after {last}"
            );
            last = gap;
            if step == 99 {
                assert!(gap < 0.01 * first, "{solver:?}: {gap} m apart after 0.1 s");
            }
        }
        let held: Vec3 = ids.iter().map(|&id| world.attachment_force(id).expect("a force")).sum();
        assert!(last < 1e-4 * SIZE, "{solver:?}: {last} m apart");
        assert!((held - Vec3::Y * 0.981).length() < 1e-3 * 0.981, "{solver:?}: {held}");
    }
}

#[test]
fn a_suture_closes_a_cut() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut world = world(Vec3::ZERO);
        let mut mesh = square(0.04, 4);
        let right = moved(mesh.clone(), Vec3::X * 0.043);
        let count = mesh.positions.len() as u32;
        mesh.positions.extend(right.positions);
        mesh.triangles
            .extend(right.triangles.iter().map(|triangle| triangle.map(|node| node + count)));
        let suture = put_cloth(&mut world, &mesh, solver);
        let edge = |x: f32| nodes_at(&mesh, |place| (place.x - x).abs() < 1e-4);
        let [one, other] = [edge(0.02), edge(0.023)];
        assert_eq!([one.len(), other.len()], [5; 2]);
        let ids = world
            .attach_to_body(suture, &anchors(&one), suture, &anchors(&other), 0.0)
            .expect("sutures");
        for _ in 0..400 {
            world.step(1e-3).expect("a step");
        }
        let places = body(&world, suture).positions();
        for (&a, &b) in one.iter().zip(&other) {
            let gap = places[a as usize].distance(places[b as usize]);
            assert!(gap < 1e-5, "{solver:?}: {gap} m apart");
        }
        let node_mass = 0.05 / mesh.positions.len() as f32;
        let drawn = momentum(body(&world, suture), node_mass).length();
        assert!(drawn < 1e-6, "{solver:?}: momentum {drawn}");
        for id in ids {
            world.release(id).expect("released");
            assert!(matches!(world.release(id), Err(Error::StaleId(_))));
        }
    }
}

fn put_cloth(world: &mut World, mesh: &Mesh, solver: Solver) -> BodyId {
    let node_mass = 0.05 / mesh.positions.len() as f32;
    world
        .create_body(&BodyDefinition {
            masses: Values::Uniform(node_mass),
            stiffnesses: Values::Uniform(50.0),
            spring_dampings: Values::Uniform(0.05),
            solver,
            ..BodyDefinition::of(mesh)
        })
        .expect("a cloth")
}

#[test]
fn pins_and_tools_take_what_hangs_on_them() {
    pins_and_tools_take_what_hangs_on_them_of(&[[Solver::Verlet; 2], [Solver::Implicit, Solver::Verlet]]);
}

#[test]
#[ignore = "long"]
fn pins_and_tools_take_what_hangs_on_them_with_other_solvers() {
    pins_and_tools_take_what_hangs_on_them_of(&[[Solver::Implicit; 2]]);
}

fn pins_and_tools_take_what_hangs_on_them_of(pairs: &[[Solver; 2]]) {
    for &solvers in pairs {
        let shortest = if solvers == [Solver::Verlet; 2] { 0.5e-3 } else { 2e-3 };
        for dt in [shortest, 5e-3] {
            for is_pinned in [true, false] {
                let [above, below] = solvers.map(|solver| Block { solver, ..Block::CALM });
                let mut hanging = Hanging::new(above, below, 4, DOWN);
                let holders: Vec<u32> = hanging.pairs.iter().map(|pair| pair[0]).collect();
                let tool = sphere(&mut hanging.world, 0.001, Vec3::new(0.0, 1.0, 0.0));
                if is_pinned {
                    pin_all(&mut hanging.world, hanging.above, &holders);
                } else {
                    let attached = hanging.world.attach_nodes(hanging.above, &holders, tool, 0.0);
                    attached.expect("attachments");
                }
                for _ in 0..(0.6 / dt) as u32 {
                    hanging.world.step(dt).expect("a step");
                }
                let weight = 0.981;
                let held = hanging.force().y;
                assert!((held - weight).abs() < 1e-3 * weight, "{solvers:?}, {dt}: {held} N");
                let mut all = pin_forces(&hanging.world, hanging.above, &hanging.pinned).y;
                let expected = 2.0 * weight;
                if is_pinned {
                    all += pin_forces(&hanging.world, hanging.above, &holders).y;
                } else {
                    let (force, _) = hanging.world.wrench(tool).expect("a wrench");
                    all -= f64::from(force.y);
                }
                assert!(
                    (all - expected).abs() < 2e-3 * expected,
                    "{solvers:?}, {dt}, {is_pinned}: {all} N"
                );
            }
        }
    }
}

#[test]
fn it_slips_beyond_its_limit_alone() {
    it_slips_beyond_its_limit_alone_of(&[[Solver::Verlet; 2], [Solver::Implicit, Solver::Verlet]]);
}

#[test]
#[ignore = "long"]
fn it_slips_beyond_its_limit_alone_with_other_solvers() {
    it_slips_beyond_its_limit_alone_of(&[[Solver::Implicit; 2], [Solver::Newton; 2]]);
}

fn it_slips_beyond_its_limit_alone_of(pairs: &[[Solver; 2]]) {
    let weight = 0.981_f32;
    for &solvers in pairs {
        let [above, below] = solvers.map(|solver| Block { solver, ..Block::CALM });
        let mut hanging = Hanging::new(above, below, 1, DOWN);
        for _ in 0..300 {
            hanging.world.step(2e-3).expect("a step");
        }
        let Hanging { above, below, .. } = hanging;
        let [up, down] = hanging.pairs[0];
        let mut held = hanging.ids[0];
        // What it carries is handed to one that is a little too weak, or not.
        for (limit, slips) in [(1.02 * weight, false), (0.98 * weight, true)] {
            let world = &mut hanging.world;
            let next = world.attach_to_body(below, &[Anchor::Node(down)], above, &[Anchor::Node(up)], limit);
            let next = next.expect("an attachment")[0];
            world.release(held).expect("released");
            held = next;
            let mut lost = None;
            for step in 0..100 {
                world.step(2e-3).expect("a step");
                if !world.slipped().is_empty() {
                    assert_eq!(world.slipped(), [held], "{solvers:?}");
                    lost = lost.or(Some(step));
                }
            }
            assert_eq!(lost.is_some(), slips, "{solvers:?}, {limit} N");
            assert_eq!(world.attachment_force(held).is_err(), slips, "{solvers:?}");
        }
        assert!(hanging.drift() > 0.01, "{solvers:?}: it has not fallen");
    }
}

#[test]
fn it_ends_with_either_body() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        for is_first in [true, false] {
            let block = Block { solver, ..Block::CALM };
            let mut hanging = Hanging::new(block, block, 4, DOWN);
            for _ in 0..100 {
                hanging.world.step(1e-3).expect("a step");
            }
            let Hanging { above, below, ids, .. } = hanging;
            let [gone, left] = if is_first { [above, below] } else { [below, above] };
            hanging.world.destroy_body(gone).expect("destroyed");
            for id in ids {
                assert!(matches!(hanging.world.release(id), Err(Error::StaleId(_))));
                assert!(matches!(hanging.world.attachment_force(id), Err(Error::StaleId(_))));
            }
            // A body in the same place in the world is not attached.
            let other = block.put(&mut hanging.world);
            for _ in 0..50 {
                hanging.world.step(1e-3).expect("a step");
            }
            let fallen = |id: BodyId| centre(body(&hanging.world, id)).y;
            let free = -0.5 * 9.81 * 0.05_f64.powi(2);
            // It is damped.
            assert!(fallen(other) < 0.5 * free, "{solver:?}: {} m", fallen(other));
            assert!(all_finite(body(&hanging.world, left)));
            if is_first {
                let from = f64::from(-HEIGHT / 2.0);
                assert!(fallen(left) < from + 0.5 * free, "{solver:?}: {}", fallen(left));
            }
        }
    }
}

#[test]
fn what_is_attached_does_not_touch_there() {
    let contact = BodyContact {
        thickness: 0.5e-3,
        with_bodies: true,
        ..BodyContact::NOTHING
    };
    let block = Block { contact, ..Block::CALM };
    for is_attached in [true, false] {
        let mut hanging = Hanging::new(block, block, 25, Vec3::ZERO);
        if !is_attached {
            for &id in &hanging.ids {
                hanging.world.release(id).expect("released");
            }
        }
        let mut force = 0.0_f64;
        for _ in 0..50 {
            hanging.world.step(1e-3).expect("a step");
            if is_attached {
                force = force.max(hanging.force().length());
            }
        }
        if is_attached {
            assert!(hanging.drift() < 1e-4 * SIZE, "{}", hanging.drift());
            assert!(force < 1e-4, "{force} N");
        } else {
            // Without it what touches is parted as surfaces without thickness are.
            assert!(hanging.drift() > 1e-3 * SIZE, "{}", hanging.drift());
        }
    }
}

/// The point of the lowest triangles of a block that is straight above or below a place.
fn point_at(surface: &[[u32; 3]], positions: &[Vec3], place: Vec3) -> SurfacePoint {
    let lowest = positions
        .iter()
        .map(|position| position.y)
        .fold(f32::INFINITY, f32::min);
    let candidates = (0..).zip(surface).filter_map(|(triangle, corners)| {
        let [a, b, c] = corners.map(|node| positions[node as usize]);
        let is_low = a.y.max(b.y).max(c.y) < lowest + 1e-4;
        let area = |p: Vec3, q: Vec3, r: Vec3| (q - p).cross(r - p).y;
        let weights = [area(place, b, c), area(a, place, c), area(a, b, place)].map(|part| part / area(a, b, c));
        (is_low && weights.iter().all(|&weight| weight >= 0.0)).then_some(SurfacePoint { triangle, weights })
    });
    candidates.last().expect("a triangle")
}

#[test]
fn what_is_attached_crosses_nothing_there() {
    let contact = BodyContact {
        thickness: 0.1e-3,
        with_bodies: true,
        ..BodyContact::NOTHING
    };
    for solvers in [[Solver::Verlet; 2], [Solver::Implicit, Solver::Verlet]] {
        let mut world = world(DOWN);
        let [above, below] = [0, 1].map(|index| Block {
            solver: solvers[index],
            at: [
                Vec3::Y * (HEIGHT / 2.0),
                Vec3::new(0.0013, -HEIGHT / 2.0 - 0.3e-3, 0.0007),
            ][index],
            contact,
            ..Block::CALM
        });
        let [upper, lower] = [above, below].map(|block| block.put(&mut world));
        let [rest, nodes] = [above, below].map(|block| block.mesh().positions);
        let top = nodes_at(&above.mesh(), |place| place.y > HEIGHT - 1e-4);
        pin_all(&mut world, upper, &top);
        let inner = nodes_at(&below.mesh(), |place| {
            place.y > -1e-3 && place.x.abs().max(place.z.abs()) < 0.015
        });
        assert_eq!(inner.len(), 9);
        let surface = body(&world, upper).surface().to_vec();
        let points = inner
            .iter()
            .map(|&node| point_at(&surface, &rest, nodes[node as usize]));
        let points: Vec<Anchor> = points.map(Anchor::Point).collect();
        let made = world.attach_to_body(lower, &anchors(&inner), upper, &points, 0.0);
        let ids = made.expect("attachments");
        for step in 0..200 {
            let report = world.step(1e-3).expect("a step");
            assert_eq!(report.crossings, 0, "{solvers:?}, step {step}");
        }
        let held: Vec3 = ids.iter().map(|&id| world.attachment_force(id).expect("a force")).sum();
        assert!(held.y > 0.9, "{solvers:?}: {held}");
    }
}

#[test]
fn a_tool_carries_what_hangs_on_what_it_holds() {
    let mut hanging = Hanging::new(Block::CALM, Block::CALM, 4, Vec3::ZERO);
    let Hanging { above, below, .. } = hanging;
    for &node in &hanging.pinned {
        hanging
            .world
            .body_mut(above)
            .expect("a body")
            .unpin(node)
            .expect("free");
    }
    let tool = sphere(&mut hanging.world, 0.001, Vec3::new(0.0, 1.0, 0.0));
    let held = hanging.world.attach_nodes(above, &hanging.pinned, tool, 0.0);
    held.expect("attachments");
    for step in 1..=500 {
        let way = 0.1 * (step.min(200) as f32 / 200.0);
        hanging
            .world
            .set_pose(tool, Vec3::new(way, 1.0, 0.0), Some(Quat::IDENTITY))
            .expect("a pose");
        hanging.world.step(1e-3).expect("a step");
    }
    let places = body(&hanging.world, below).positions();
    let middle = places.iter().map(|place| place.as_dvec3()).sum::<DVec3>() / places.len() as f64;
    assert!((middle.x - 0.1).abs() < 0.01, "{middle}");
    assert!(hanging.drift() < 1e-4 * SIZE, "{}", hanging.drift());
}
