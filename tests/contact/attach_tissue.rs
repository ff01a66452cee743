//! Attachments between bodies: forces, momentum, force limits, and when they end.

use crate::support::hanging::*;
use crate::support::tissue::*;
use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{Anchor, BodyContact, BodyDefinition, BodyId, Error, Solver, SurfacePoint, Values, World};

#[test]
fn a_block_hangs_from_another() {
    check_a_block_hangs_from_another(|case| case % 5 == 2);
}

#[test]
#[ignore = "long"]
fn a_block_hangs_from_another_in_the_other_cases() {
    check_a_block_hangs_from_another(|case| case % 5 != 2);
}

fn check_a_block_hangs_from_another(is_selected: fn(usize) -> bool) {
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
    for (_, (masses, solvers, dt, count)) in (0..).zip(cases).filter(|case| is_selected(case.0)) {
        let [above, below] = [0, 1].map(|index| Block {
            mass: masses[index],
            solver: solvers[index],
            ..Block::CALM
        });
        let mut hanging = Hanging::new(above, below, count, DOWN);
        let mut largest = 0.0_f32;
        for _ in 0..(0.7 / dt) as u32 {
            hanging.world.step(dt).expect("a step");
            largest = largest.max(hanging.drift());
        }
        let case = format!("{masses:?} kg, {solvers:?}, {dt} s, {count}");
        let weight = 9.81 * f64::from(masses[1]);
        let error = (hanging.force() + DVec3::Y * -weight).length() / weight;
        assert!(error < 1e-3, "{case}: the force is off by {error:e}");
        assert!(hanging.drift() < 1e-4 * SIZE, "{case}: drift of {}", hanging.drift());
        assert!(largest < 1e-3 * SIZE, "{case}: largest drift {largest}");
        let pins = pin_forces(&hanging.world, hanging.above, &hanging.pinned).y;
        let both = weight + 9.81 * f64::from(masses[0]);
        assert!(
            // Damping also acts on forces that the implicit equation does not contain.
            (pins - both).abs() < 5e-3 * both,
            "{case}: pins hold {pins} N of {both}"
        );
    }
}

#[test]
fn swinging_blocks_gain_no_energy() {
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
        let (mut largest, mut widest) = (f64::NEG_INFINITY, 0.0_f32);
        for _ in 0..500 {
            hanging.world.step(1e-3).expect("a step");
            largest = largest.max(energy(&hanging) - first);
            let positions = body(&hanging.world, hanging.below).positions();
            widest = positions.iter().map(|position| position.x.abs()).fold(widest, f32::max);
        }
        assert!(largest < 0.03 * thrown, "{solvers:?}: {largest} J gained of {thrown}");
        assert!(hanging.drift() < 1e-4 * SIZE, "{solvers:?}: {}", hanging.drift());
        // The block did move.
        assert!(widest > 0.7 * SIZE, "{solvers:?}: {widest}");
    }
}

#[test]
fn momentum_is_conserved() {
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
            let momenta = |world: &World| {
                [(above, masses[0]), (below, masses[1])]
                    .map(|(id, mass)| momentum(body(world, id), mass / count as f32))
            };
            let sum = |world: &World| momenta(world)[0] + momenta(world)[1];
            let first = sum(&hanging.world);
            let (mut error, mut transferred) = (0.0_f64, 0.0);
            for _ in 0..(0.1 / dt) as u32 {
                hanging.world.step(dt).expect("a step");
                error = error.max((sum(&hanging.world) - first).length());
                transferred += hanging.force().length() * f64::from(dt);
            }
            let [upper, _] = momenta(&hanging.world);
            assert!(
                error < 1e-6 * transferred,
                "{solvers:?}, {dt}: momentum error {error} of {transferred} transferred"
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
fn attached_points_are_pulled_together_and_hold() {
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
        let top = nodes_at(&above.mesh(), |position| position.y > HEIGHT - 1e-4);
        pin_all(&mut world, upper, &top);
        // Points in triangles of the upper block's bottom, under three of its corners, and nodes of the lower block's
        // top.
        let surface = body(&world, upper).surface().to_vec();
        let rest = above.mesh().positions;
        let weights = [0.2, 0.3, 0.5];
        let surface_point = |triangle: u32| -> Vec3 {
            let corners = surface[triangle as usize].map(|node| rest[node as usize]);
            (0..3).map(|corner| corners[corner] * weights[corner]).sum()
        };
        let is_below = |triangle: &u32| {
            surface[*triangle as usize]
                .iter()
                .all(|&node| rest[node as usize].y < 1e-4)
        };
        let triangles: Vec<u32> = (0..surface.len() as u32).filter(is_below).collect();
        let lowest = nodes_at(&below.mesh(), |position| position.y > -0.002 - 1e-4);
        let mut pairs = Vec::new();
        for target in [
            Vec3::new(1.0, 0.0, 1.0),
            Vec3::new(-1.0, 0.0, 1.0),
            Vec3::new(0.0, 0.0, -1.0),
        ] {
            let distance_to = |position: Vec3| (position - target * SIZE / 2.0).length();
            let triangle = *triangles
                .iter()
                .min_by(|&&a, &&b| distance_to(surface_point(a)).total_cmp(&distance_to(surface_point(b))))
                .expect("a triangle");
            let positions = below.mesh().positions;
            let distance_to_node = |node: u32| positions[node as usize].distance(surface_point(triangle));
            let node = *lowest
                .iter()
                .min_by(|&&a, &&b| distance_to_node(a).total_cmp(&distance_to_node(b)))
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
        let largest_gap = |world: &World| {
            let [above, below] = [upper, lower].map(|id| body(world, id).positions());
            let gap = |&(node, triangle): &(u32, u32)| {
                let corners = surface[triangle as usize].map(|corner| above[corner as usize]);
                let point: Vec3 = (0..3).map(|corner| corners[corner] * weights[corner]).sum();
                point.distance(below[node as usize])
            };
            pairs.iter().map(gap).fold(0.0, f32::max)
        };
        let first = largest_gap(&world);
        assert!(first > 0.05 * SIZE, "{first}");
        let mut last = first;
        for step in 0..800 {
            world.step(1e-3).expect("a step");
            let gap = largest_gap(&world);
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
        let edge = |x: f32| nodes_at(&mesh, |position| (position.x - x).abs() < 1e-4);
        let [left_edge, other] = [edge(0.02), edge(0.023)];
        assert_eq!([left_edge.len(), other.len()], [5; 2]);
        let ids = world
            .attach_to_body(suture, &anchors(&left_edge), suture, &anchors(&other), 0.0)
            .expect("sutures");
        for _ in 0..400 {
            world.step(1e-3).expect("a step");
        }
        let positions = body(&world, suture).positions();
        for (&a, &b) in left_edge.iter().zip(&other) {
            let gap = positions[a as usize].distance(positions[b as usize]);
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
fn pins_and_tools_carry_attached_weight() {
    check_pins_and_tools_carry_attached_weight(&[[Solver::Verlet; 2], [Solver::Implicit, Solver::Verlet]]);
}

#[test]
#[ignore = "long"]
fn pins_and_tools_carry_attached_weight_with_other_solvers() {
    check_pins_and_tools_carry_attached_weight(&[[Solver::Implicit; 2]]);
}

fn check_pins_and_tools_carry_attached_weight(pairs: &[[Solver; 2]]) {
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
fn attachments_break_only_beyond_their_force_limit() {
    check_attachments_break_only_beyond_their_force_limit(&[[Solver::Verlet; 2], [Solver::Implicit, Solver::Verlet]]);
}

#[test]
#[ignore = "long"]
fn attachments_break_only_beyond_their_force_limit_with_other_solvers() {
    check_attachments_break_only_beyond_their_force_limit(&[[Solver::Implicit; 2], [Solver::Newton; 2]]);
}

fn check_attachments_break_only_beyond_their_force_limit(pairs: &[[Solver; 2]]) {
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
        // Its load is handed to an attachment that is just strong enough, then to one that is just too weak.
        for (limit, slips) in [(1.02 * weight, false), (0.98 * weight, true)] {
            let world = &mut hanging.world;
            let next = world.attach_to_body(below, &[Anchor::Node(down)], above, &[Anchor::Node(up)], limit);
            let next = next.expect("an attachment")[0];
            world.release(held).expect("released");
            held = next;
            let mut break_step = None;
            for step in 0..100 {
                world.step(2e-3).expect("a step");
                if !world.slipped().is_empty() {
                    assert_eq!(world.slipped(), [held], "{solvers:?}");
                    break_step = break_step.or(Some(step));
                }
            }
            assert_eq!(break_step.is_some(), slips, "{solvers:?}, {limit} N");
            assert_eq!(world.attachment_force(held).is_err(), slips, "{solvers:?}");
        }
        assert!(hanging.drift() > 0.01, "{solvers:?}: the block has not fallen");
    }
}

#[test]
fn attachments_end_with_either_body() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        for is_first in [true, false] {
            let block = Block { solver, ..Block::CALM };
            let mut hanging = Hanging::new(block, block, 4, DOWN);
            for _ in 0..100 {
                hanging.world.step(1e-3).expect("a step");
            }
            let Hanging { above, below, ids, .. } = hanging;
            let [destroyed, remaining] = if is_first { [above, below] } else { [below, above] };
            hanging.world.destroy_body(destroyed).expect("destroyed");
            for id in ids {
                assert!(matches!(hanging.world.release(id), Err(Error::StaleId(_))));
                assert!(matches!(hanging.world.attachment_force(id), Err(Error::StaleId(_))));
            }
            // A new body in the slot of the destroyed body is not attached.
            let other = block.put(&mut hanging.world);
            for _ in 0..50 {
                hanging.world.step(1e-3).expect("a step");
            }
            let fallen = |id: BodyId| centre(body(&hanging.world, id)).y;
            let free = -0.5 * 9.81 * 0.05_f64.powi(2);
            // Damping slows its fall.
            assert!(fallen(other) < 0.5 * free, "{solver:?}: {} m", fallen(other));
            assert!(all_finite(body(&hanging.world, remaining)));
            if is_first {
                let from = f64::from(-HEIGHT / 2.0);
                assert!(
                    fallen(remaining) < from + 0.5 * free,
                    "{solver:?}: {}",
                    fallen(remaining)
                );
            }
        }
    }
}

#[test]
fn attached_nodes_have_no_contact() {
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
            // Without attachments, contact of thickness 0 separates touching surfaces.
            assert!(hanging.drift() > 1e-3 * SIZE, "{}", hanging.drift());
        }
    }
}

/// Returns the point of the lowest triangles of a block that lies straight above or below `position`.
fn point_at(surface: &[[u32; 3]], positions: &[Vec3], target: Vec3) -> SurfacePoint {
    let lowest = positions
        .iter()
        .map(|position| position.y)
        .fold(f32::INFINITY, f32::min);
    let candidates = (0..).zip(surface).filter_map(|(triangle, corners)| {
        let [a, b, c] = corners.map(|node| positions[node as usize]);
        let is_low = a.y.max(b.y).max(c.y) < lowest + 1e-4;
        let area = |p: Vec3, q: Vec3, r: Vec3| (q - p).cross(r - p).y;
        let weights = [area(target, b, c), area(a, target, c), area(a, b, target)].map(|part| part / area(a, b, c));
        (is_low && weights.iter().all(|&weight| weight >= 0.0)).then_some(SurfacePoint { triangle, weights })
    });
    candidates.last().expect("a triangle")
}

#[test]
fn attached_nodes_do_not_cross_surfaces() {
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
        let top = nodes_at(&above.mesh(), |position| position.y > HEIGHT - 1e-4);
        pin_all(&mut world, upper, &top);
        let inner = nodes_at(&below.mesh(), |position| {
            position.y > -1e-3 && position.x.abs().max(position.z.abs()) < 0.015
        });
        assert_eq!(inner.len(), 9);
        let surface = body(&world, upper).surface().to_vec();
        let points = inner
            .iter()
            .map(|&node| point_at(&surface, &rest, nodes[node as usize]));
        let points: Vec<Anchor> = points.map(Anchor::Point).collect();
        let attached = world.attach_to_body(lower, &anchors(&inner), upper, &points, 0.0);
        let ids = attached.expect("attachments");
        for step in 0..200 {
            let report = world.step(1e-3).expect("a step");
            assert_eq!(report.crossings, 0, "{solvers:?}, step {step}");
        }
        let held: Vec3 = ids.iter().map(|&id| world.attachment_force(id).expect("a force")).sum();
        assert!(held.y > 0.9, "{solvers:?}: {held}");
    }
}

#[test]
fn a_tool_carries_a_body_attached_to_the_body_it_holds() {
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
        let displacement = 0.1 * (step.min(200) as f32 / 200.0);
        hanging
            .world
            .set_pose(tool, Vec3::new(displacement, 1.0, 0.0), Some(Quat::IDENTITY))
            .expect("a pose");
        hanging.world.step(1e-3).expect("a step");
    }
    let positions = body(&hanging.world, below).positions();
    let middle = positions.iter().map(|position| position.as_dvec3()).sum::<DVec3>() / positions.len() as f64;
    assert!((middle.x - 0.1).abs() < 0.01, "{middle}");
    assert!(hanging.drift() < 1e-4 * SIZE, "{}", hanging.drift());
}
