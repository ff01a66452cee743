//! Dynamic tools: weight, momentum and energy, for light tools on heavy tissue and heavy tools on light tissue.

use crate::support::hanging::nodes_at;
use crate::support::scene::SOLVERS;
use crate::support::tissue::*;
use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, BodyId, MassProperties, Shape, Solver, ToolId, Values, World, WorldDefinition};

const DOWN: Vec3 = Vec3::new(0.0, -9.81, 0.0);
const DT: f32 = 1.0 / 60.0;

/// Returns the mass properties of a ball of uniform density.
fn ball_properties(mass: f32, radius: f32) -> MassProperties {
    let moment = 0.4 * mass * radius * radius;
    MassProperties {
        mass,
        center_of_mass: Vec3::ZERO,
        inertia: [moment, moment, moment, 0.0, 0.0, 0.0],
    }
}

fn ball(world: &mut World, mass: f32, radius: f32, position: Vec3) -> ToolId {
    let ball = sphere(world, radius, position);
    world
        .set_dynamic(ball, Some(&ball_properties(mass, radius)))
        .expect("a ball");
    ball
}

fn steps(world: &mut World, dt: f32, count: usize) {
    for _ in 0..count {
        world.step(dt).expect("a step");
    }
}

/// Creates a block of springs on a floor, or with its lowest nodes pinned.
fn block(world: &mut World, solver: Solver, on_floor: bool) -> BodyId {
    let tissue = Tissue {
        mass: 0.5,
        stiffness: 400.0,
        drag: 20.0,
        spring_damping: 2.0,
    };
    let mesh = Mesh::block([0.08, 0.04, 0.08], [4, 2, 4]).expect("a block");
    if on_floor {
        tool(world, Shape::Plane, 0.5, Vec3::Y * -0.02, Quat::IDENTITY);
    }
    let block = tissue.put_for(solver, world, &mesh);
    if !on_floor {
        pin_all(world, block, &nodes_at(&mesh, |at| at.y < -0.019));
    }
    block
}

#[test]
fn tissue_carries_the_weight_of_a_ball_at_rest() {
    check_tissue_carries_the_weight_of_a_ball_at_rest(&SOLVERS[..2], &[(0.6, false)]);
}

#[test]
#[ignore = "long"]
fn a_ball_of_any_weight_comes_to_rest_on_tissue() {
    check_tissue_carries_the_weight_of_a_ball_at_rest(&SOLVERS[2..], &[(0.6, false)]);
    check_tissue_carries_the_weight_of_a_ball_at_rest(&SOLVERS, &[(5e-6, true), (0.02, false), (0.6, true)]);
}

/// Each entry of `balls` is a mass (kg), and true if the tissue lies on a floor.
fn check_tissue_carries_the_weight_of_a_ball_at_rest(solvers: &[Solver], balls: &[(f32, bool)]) {
    // A node has 5.5 g. Tools range from a thousandth of a node's mass to more than the mass of the tissue.
    for &solver in solvers {
        for &(mass, on_floor) in balls {
            if solver == Solver::Newton && on_floor {
                continue;
            }
            let mut world = world(DOWN);
            let block = block(&mut world, solver, on_floor);
            // A light ball makes no dent and would roll off.
            let shape = if mass < 0.1 {
                Shape::Box {
                    half_extents: Vec3::splat(0.03),
                }
            } else {
                Shape::Sphere { radius: 0.03 }
            };
            let ball = tool(&mut world, shape, 0.2, Vec3::new(0.003, 0.06, 0.002), Quat::IDENTITY);
            world
                .set_dynamic(ball, Some(&ball_properties(mass, 0.03)))
                .expect("a dynamic tool");
            let mut highest = 0.0_f32;
            for step in 0..240 {
                world.step(DT).expect("a step");
                if step > 30 {
                    highest = highest.max(world.pose(ball).expect("a ball").position.y);
                }
            }
            let case = format!("{solver:?}, {mass} kg, on a floor: {on_floor}");
            let (force, _) = world.wrench(ball).expect("a ball");
            let weight = mass * 9.81;
            let (velocity, _) = world.tool_velocity(ball).expect("a ball");
            assert!(highest < 0.06, "{case}: thrown to {highest} m");
            assert!(velocity.length() < 2e-3, "{case}: {velocity} m/s");
            assert!(
                (force.y - weight).abs() < 0.01 * weight,
                "{case}: {force} of {weight} N"
            );
            assert!(all_finite(body(&world, block)), "{case}");
            // The ball can still be pushed out for a few more steps.
            let deepest = penetration_of(&world, block, shape, ball);
            assert!(deepest < 2e-4, "{case}: {deepest} m deep");
        }
    }
}

#[test]
fn thin_tissue_on_a_plane_carries_a_ball_of_any_mass() {
    for (mass, dt) in [(0.5, 1.0 / 480.0), (0.5, DT), (50.0, DT), (50_000.0, DT)] {
        let mut world = world(DOWN);
        tool(&mut world, Shape::Plane, 0.5, Vec3::ZERO, Quat::IDENTITY);
        let tissue = Tissue {
            mass: 5.0,
            stiffness: 888.0,
            drag: 0.0,
            spring_damping: 9.4,
        };
        let sheet = tissue.put(&mut world, &moved(square(0.9, 9), Vec3::Y * 0.001));
        let ball = ball(&mut world, mass, 0.05, Vec3::new(-0.22, 0.0515, 0.03));
        world
            .set_tool_velocity(ball, Vec3::X * 0.5, Vec3::ZERO)
            .expect("a velocity");
        let weight = mass * 9.81;
        for step in 0..(0.5 / dt) as u32 {
            world.step(dt).expect("a step");
            let height = world.pose(ball).expect("a ball").position.y;
            assert!(
                (0.0495..0.052).contains(&height),
                "{mass} kg, step {step}: at {height} m"
            );
        }
        let (force, _) = world.wrench(ball).expect("a ball");
        assert!((force.y - weight).abs() < 0.01 * weight, "{mass} kg: {force} N");
        let final_x = world.pose(ball).expect("a ball").position.x;
        assert!((final_x - 0.03).abs() < 0.01, "{mass} kg rolled to {final_x} m");
        assert!(kinetic(&world, sheet) < 1e-3, "{mass} kg");
    }
}

/// Returns the total momentum and the angular momentum about the origin.
fn momenta(world: &World, (block, node_mass): (BodyId, f32), (tool, mass): (ToolId, &MassProperties)) -> [DVec3; 2] {
    let tissue = body(world, block);
    let pose = world.pose(tool).expect("a tool");
    let (velocity, spin) = world.tool_velocity(tool).expect("a tool");
    let center = pose.position.as_dvec3() + pose.orientation.as_dquat() * mass.center_of_mass.as_dvec3();
    let own = pose.orientation.as_dquat().inverse() * spin.as_dvec3();
    let [x, y, z, xy, xz, yz] = mass.inertia.map(f64::from);
    let own = DVec3::new(
        x * own.x + xy * own.y + xz * own.z,
        xy * own.x + y * own.y + yz * own.z,
        xz * own.x + yz * own.y + z * own.z,
    );
    let linear = velocity.as_dvec3() * f64::from(mass.mass);
    let angular = center.cross(linear) + pose.orientation.as_dquat() * own;
    [
        momentum(tissue, node_mass) + linear,
        angular_momentum(tissue, node_mass, DVec3::ZERO) + angular,
    ]
}

#[test]
fn a_free_body_and_a_tool_conserve_momentum() {
    let shapes = [
        Shape::Sphere { radius: 0.02 },
        Shape::Capsule {
            radius: 0.012,
            half_length: 0.03,
        },
        Shape::Box {
            half_extents: Vec3::new(0.03, 0.015, 0.02),
        },
    ];
    for solver in [Solver::Verlet, Solver::Implicit] {
        for shape in shapes {
            if solver == Solver::Implicit && shape != shapes[0] {
                continue;
            }
            for (density, friction) in [(10.0, 0.0), (1e3, 0.6), (1e5, 0.3)] {
                let mut world = world(Vec3::ZERO);
                let tissue = Tissue {
                    mass: 0.2,
                    stiffness: 100.0,
                    ..Tissue::VISCOUS
                };
                let mesh = Mesh::block([0.08, 0.04, 0.08], [4, 2, 4]).expect("a block");
                let block = tissue.put_for(solver, &mut world, &mesh);
                let node_mass = tissue.node_mass(&mesh);
                let turned = Quat::from_rotation_z(0.7);
                let tool_id = tool(&mut world, shape, friction, Vec3::new(0.012, 0.065, 0.004), turned);
                let mass = world.mass_of_density(tool_id, density).expect("a mass");
                world.set_dynamic(tool_id, Some(&mass)).expect("a dynamic tool");
                world
                    .set_tool_velocity(tool_id, Vec3::new(0.1, -0.5, 0.0), Vec3::new(2.0, 1.0, -3.0))
                    .expect("a velocity");
                let [linear, angular] = momenta(&world, (block, node_mass), (tool_id, &mass));
                let (mut impulse, mut angular_impulse) = (0.0, 0.0);
                for _ in 0..20 {
                    world.step(DT).expect("a step");
                    let (force, torque) = world.wrench(tool_id).expect("a tool");
                    impulse += f64::from(force.length() * DT);
                    angular_impulse += f64::from((force.length() * 0.05 + torque.length()) * DT);
                }
                let case = format!("{solver:?}, {shape:?}, {density} kg/m3");
                assert!(impulse > 1e-4, "{case}: not touched");
                let [now, turned] = momenta(&world, (block, node_mass), (tool_id, &mass));
                let size = linear.length() + impulse;
                // The tolerance covers sums over f32 velocities and the accuracy of an implicit step.
                assert!((now - linear).length() < 2e-5 * size, "{case}: {linear} to {now}");
                // The lever arm changes by the displacement of a substep.
                let off = (turned - angular).length();
                assert!(
                    off < 0.02 * angular_impulse,
                    "{case}: {angular} to {turned}, {angular_impulse}"
                );
            }
        }
    }
}

#[test]
fn two_bodies_share_the_momentum_of_a_tool() {
    let mut world = world(Vec3::ZERO);
    let mesh = Mesh::block([0.06, 0.03, 0.06], [3, 2, 3]).expect("a block");
    let tissue = Tissue {
        mass: 0.3,
        stiffness: 100.0,
        ..Tissue::VISCOUS
    };
    let apart = [-0.032, 0.032].map(|x| moved(mesh.clone(), Vec3::X * x));
    let blocks = apart.map(|mesh| tissue.put(&mut world, &mesh));
    let radius = 0.02;
    let tool_id = ball(&mut world, 0.05, radius, Vec3::new(0.0, 0.038, 0.0));
    world
        .set_tool_velocity(tool_id, Vec3::Y * -1.0, Vec3::ZERO)
        .expect("a velocity");
    let node_mass = tissue.node_mass(&mesh);
    for _ in 0..20 {
        world.step(DT).expect("a step");
        let (velocity, _) = world.tool_velocity(tool_id).expect("a ball");
        let tissue: DVec3 = blocks
            .iter()
            .map(|&block| momentum(body(&world, block), node_mass))
            .sum();
        let all = tissue + velocity.as_dvec3() * 0.05;
        assert!((all - DVec3::Y * -0.05).length() < 2e-7, "{all} N s");
        let momentum_of = |block| momentum(body(&world, block), node_mass);
        // The left and right halves mirror each other.
        assert!(
            (momentum_of(blocks[0]).y - momentum_of(blocks[1]).y).abs() < 1e-3,
            "{:?}",
            blocks.map(momentum_of)
        );
    }
    assert!(world.tool_velocity(tool_id).expect("a ball").0.y > -0.3);
}

#[test]
fn a_collision_gains_no_energy() {
    for (mass, seed) in [(1e-4, 1), (0.05, 2), (5.0, 3)] {
        let mut random = Random::new(seed);
        for _ in 0..4 {
            let mut world = world_of(Vec3::ZERO, 24);
            let tissue = Tissue {
                mass: 0.2,
                stiffness: 60.0,
                ..Tissue::VISCOUS
            };
            let mesh = Mesh::block([0.08, 0.04, 0.08], [4, 2, 4]).expect("a block");
            let block = tissue.put(&mut world, &mesh);
            let from = random.direction();
            let properties = ball_properties(mass, 0.015);
            let tool_id = ball(&mut world, mass, 0.015, from * 0.075);
            world
                .set_tool_velocity(tool_id, -1.5 * from, random.vector() * 5.0)
                .expect("a velocity");
            let energy = |world: &World| {
                let (velocity, spin) = world.tool_velocity(tool_id).expect("a ball");
                let own = mass * velocity.length_squared() + properties.inertia[0] * spin.length_squared();
                total_energy(world, block) + 0.5 * f64::from(own)
            };
            let first = energy(&world);
            for step in 0..60 {
                world.step(0.005).expect("a step");
                let now = energy(&world);
                // Leapfrog kicks and push-out add at most a fraction of the collision energy.
                assert!(now < 1.01 * first, "{mass} kg, step {step}: {first} J to {now} J");
            }
        }
    }
}

#[test]
fn a_free_flight_is_a_parabola_and_keeps_its_spin() {
    let mut world = world(DOWN);
    let half_extents = Vec3::new(0.01, 0.03, 0.05);
    let tool_id = tool(&mut world, Shape::Box { half_extents }, 0.0, Vec3::ZERO, Quat::IDENTITY);
    let mass = world.mass_of_density(tool_id, 1e3).expect("a mass");
    let volume = 8.0 * half_extents.element_product();
    assert!((mass.mass - 1e3 * volume).abs() < 1e-6 * mass.mass);
    for (axis, moment) in mass.inertia[..3].iter().enumerate() {
        let squares = half_extents.length_squared() - half_extents[axis] * half_extents[axis];
        let exact = mass.mass * squares / 3.0;
        assert!((moment - exact).abs() < 1e-5 * exact, "{moment} of {exact}");
    }
    world.set_dynamic(tool_id, Some(&mass)).expect("a dynamic tool");
    let (velocity, spin) = (Vec3::new(1.0, 2.0, 0.0), Vec3::new(0.1, 8.0, 0.1));
    world.set_tool_velocity(tool_id, velocity, spin).expect("a velocity");
    let momentum_of = |world: &World| {
        let turn = world.pose(tool_id).expect("a tool").orientation;
        let spin = turn.inverse() * world.tool_velocity(tool_id).expect("a tool").1;
        turn * (spin * Vec3::from_slice(&mass.inertia[..3]))
    };
    let first = momentum_of(&world);
    steps(&mut world, DT, 60);
    let at = world.pose(tool_id).expect("a tool").position;
    assert!(at.distance(velocity + 0.5 * DOWN) < 1e-5, "at {at}");
    assert!(momentum_of(&world).distance(first) < 1e-5 * first.length());
    // The tool tumbles, because rotation about the intermediate axis is unstable.
    world
        .apply_wrench(tool_id, mass.mass * -DOWN, Vec3::ZERO)
        .expect("a force");
    let before = world.tool_velocity(tool_id).expect("a tool").0;
    world.step(DT).expect("a step");
    let after = world.tool_velocity(tool_id).expect("a tool").0;
    assert!(
        after.distance(before) < 1e-6,
        "its weight is carried: {before} to {after}"
    );
}

#[test]
fn pinned_tissue_stops_a_dynamic_tool() {
    for mass in [0.001, 1.0, 1000.0] {
        let mut world = world(DOWN);
        let sheet = Tissue::SOFT.put(&mut world, &square(0.9, 9));
        let nodes: Vec<u32> = (0..100).collect();
        pin_all(&mut world, sheet, &nodes);
        let ball = ball(&mut world, mass, 0.1, Vec3::new(0.04, 0.3, 0.03));
        steps(&mut world, DT, 120);
        let height = world.pose(ball).expect("a ball").position.y;
        assert!((0.09..0.101).contains(&height), "{mass} kg: at {height} m");
        let (force, _) = world.wrench(ball).expect("a ball");
        let weight = 9.81 * mass;
        assert!((force.y - weight).abs() < 0.01 * weight, "{mass} kg: {force} N");
        let held = pin_forces(&world, sheet, &nodes);
        let own = f64::from(Tissue::SOFT.mass) * 9.81;
        assert!(
            (held.y - own - f64::from(weight)).abs() < 0.02 * f64::from(weight) + 1e-3 * own,
            "{held} N"
        );
    }
}

/// Creates a scene with two bodies, a floor and two dynamic tools.
fn scene(threads: u32) -> World {
    let mut world = World::new(WorldDefinition {
        thread_count: threads,
        ..Default::default()
    })
    .expect("a world");
    for (index, solver) in [Solver::Verlet, Solver::Implicit].into_iter().enumerate() {
        block(&mut world, solver, index == 0);
    }
    let mesh = moved(
        Mesh::block([0.3, 0.02, 0.3], [30, 2, 30]).expect("a block"),
        Vec3::Y * 0.05,
    );
    Tissue::CALM.put(&mut world, &mesh);
    ball(&mut world, 0.2, 0.03, Vec3::new(0.003, 0.1, 0.002));
    ball(&mut world, 0.01, 0.02, Vec3::new(0.1, 0.09, 0.1));
    world
}

#[test]
fn a_dynamic_tool_is_the_same_for_any_number_of_threads_and_after_a_snapshot() {
    check_a_dynamic_tool_is_the_same_for_any_number_of_threads_and_after_a_snapshot(6);
}

#[test]
#[ignore = "long"]
fn a_dynamic_tool_is_the_same_for_any_number_of_threads_and_after_a_snapshot_for_long() {
    check_a_dynamic_tool_is_the_same_for_any_number_of_threads_and_after_a_snapshot(40);
}

fn check_a_dynamic_tool_is_the_same_for_any_number_of_threads_and_after_a_snapshot(steps: usize) {
    let mut one = scene(1);
    let mut two = scene(2);
    for step in 0..steps {
        one.step(DT).expect("a step");
        two.step(DT).expect("a step");
        assert_eq!(one.state_hash(), two.state_hash(), "step {step}");
        if step == steps / 2 {
            let bytes = one.save().expect("a snapshot");
            two = World::load(&bytes, 2, None).expect("the same world");
            assert_eq!(one.state_hash(), two.state_hash());
        }
    }
}

#[test]
fn a_tool_is_teleported_without_sweeping() {
    for is_dynamic in [false, true] {
        let mut world = world(Vec3::ZERO);
        let sheet = Tissue::VISCOUS.put(&mut world, &square(0.2, 10));
        let tool_id = sphere(&mut world, 0.02, Vec3::Y * 0.1);
        if is_dynamic {
            world
                .set_dynamic(tool_id, Some(&ball_properties(0.1, 0.02)))
                .expect("a ball");
            world
                .set_tool_velocity(tool_id, Vec3::X * 0.01, Vec3::ZERO)
                .expect("a velocity");
        }
        steps(&mut world, DT, 2);
        world.teleport(tool_id, Vec3::Y * -0.1, None).expect("teleported");
        assert_eq!(world.pose(tool_id).expect("a tool").position, Vec3::Y * -0.1);
        steps(&mut world, DT, 3);
        assert_eq!(world.wrench(tool_id).expect("a tool").0, Vec3::ZERO);
        // Rest lengths are rounded.
        assert!(kinetic(&world, sheet) < 1e-10, "nothing may be touched in between");
        if is_dynamic {
            assert_eq!(world.tool_velocity(tool_id).expect("a ball").0, Vec3::X * 0.01);
        }
    }
}

#[test]
fn invalid_dynamic_tools_are_refused_and_change_nothing() {
    let mut world = world(DOWN);
    let plane = tool(&mut world, Shape::Plane, 0.0, Vec3::ZERO, Quat::IDENTITY);
    let tool_id = sphere(&mut world, 0.02, Vec3::Y * 0.1);
    let cloth = Tissue::SOFT.put(&mut world, &moved(square(0.2, 4), Vec3::Y * 0.5));
    let first = world.state_hash();
    let valid = ball_properties(1.0, 0.02);
    let refused = [
        MassProperties { mass: 0.0, ..valid },
        MassProperties {
            mass: f32::NAN,
            ..valid
        },
        MassProperties { mass: 1e13, ..valid },
        MassProperties {
            center_of_mass: Vec3::splat(f32::INFINITY),
            ..valid
        },
        MassProperties {
            inertia: [0.0; 6],
            ..valid
        },
        MassProperties {
            inertia: [1.0, 1.0, 3.0, 0.0, 0.0, 0.0],
            ..valid
        },
        MassProperties {
            inertia: [1.0, 1.0, 1.0, 2.0, 0.0, 0.0],
            ..valid
        },
        MassProperties {
            inertia: [1.0, f32::NAN, 1.0, 0.0, 0.0, 0.0],
            ..valid
        },
    ];
    for properties in refused {
        assert!(world.set_dynamic(tool_id, Some(&properties)).is_err(), "{properties:?}");
    }
    assert!(world.set_dynamic(plane, Some(&valid)).is_err());
    assert!(world.mass_of_density(plane, 1e3).is_err());
    assert!(world.mass_of_density(tool_id, 0.0).is_err());
    assert!(world.tool_velocity(tool_id).is_err());
    assert!(world.set_tool_velocity(tool_id, Vec3::X, Vec3::ZERO).is_err());
    assert!(world.apply_wrench(tool_id, Vec3::X, Vec3::ZERO).is_err());
    assert!(world.teleport(tool_id, Vec3::NAN, None).is_err());
    assert_eq!(world.state_hash(), first);
    let held = world.attach_node(cloth, 0, tool_id, f32::INFINITY).expect("attached");
    assert!(
        world.set_dynamic(tool_id, Some(&valid)).is_err(),
        "nodes are attached to it"
    );
    assert!(
        world.teleport(tool_id, Vec3::ZERO, None).is_err(),
        "nodes are attached to it"
    );
    world.release(held).expect("released");
    world.set_dynamic(tool_id, Some(&valid)).expect("a dynamic tool");
    assert_eq!(world.mass_properties(tool_id).expect("a tool"), Some(valid));
    let first = world.state_hash();
    assert!(world.set_pose(tool_id, Vec3::ZERO, None).is_err());
    assert!(world.attach_node(cloth, 0, tool_id, f32::INFINITY).is_err());
    assert!(world.set_tool_velocity(tool_id, Vec3::NAN, Vec3::ZERO).is_err());
    assert!(world.apply_wrench(tool_id, Vec3::ZERO, Vec3::INFINITY).is_err());
    assert_eq!(world.state_hash(), first);
    world.set_dynamic(tool_id, None).expect("kinematic again");
    world.set_pose(tool_id, Vec3::ZERO, None).expect("a pose");
}

/// The nodes have very different masses; the tool's mass lies between them.
#[test]
fn a_ball_of_any_mass_that_falls_on_a_sheet_of_heavy_nodes_is_not_flung() {
    for mass in [1e-5, 0.03, 0.1, 1.0, 10.0] {
        let mut world = world(DOWN);
        let mesh = square(1.1, 11);
        let sheet = world
            .create_body(&BodyDefinition {
                positions: &mesh.positions,
                masses: Values::Uniform(0.1),
                stiffnesses: Values::Uniform(1777.0),
                spring_dampings: Values::Uniform(19.0),
                triangles: &mesh.triangles,
                ..Default::default()
            })
            .expect("a sheet");
        pin_all(&mut world, sheet, &[0, 11, 132, 143]);
        let ball = ball(&mut world, mass, 0.15, Vec3::Y * 0.45);
        let mut highest = f32::NEG_INFINITY;
        for step in 0..120 {
            world.step(DT).expect("a step");
            if step > 30 {
                highest = highest.max(world.pose(ball).expect("a ball").position.y);
            }
        }
        // Contact has no rebound. The sheet swings by the energy of the fall.
        assert!(highest < 0.3, "{mass} kg: thrown to {highest} m");
    }
}

#[test]
fn the_velocity_change_of_a_tool_matches_its_wrench_for_coupling_to_an_engine() {
    // The body of another engine: a spring of that engine pulls it up, and the tool takes its pose and velocity before
    // each step.
    let (mass, dt) = (0.05_f32, DT);
    let mut world = world(DOWN);
    let block = block(&mut world, Solver::Verlet, true);
    let tool_id = sphere(&mut world, 0.03, Vec3::Y * 0.06);
    world
        .set_dynamic(tool_id, Some(&ball_properties(mass, 0.03)))
        .expect("a ball");
    let (mut position, mut velocity) = (Vec3::Y * 0.06, Vec3::ZERO);
    let mut force = Vec3::ZERO;
    for step in 0..240 {
        let spring = (Vec3::Y * 0.1 - position) * 2.0 - velocity * 0.3;
        world.teleport(tool_id, position, None).expect("teleported");
        world
            .set_tool_velocity(tool_id, velocity, Vec3::ZERO)
            .expect("a velocity");
        world.apply_wrench(tool_id, spring, Vec3::ZERO).expect("a force");
        world.step(dt).expect("a step");
        let after = world.tool_velocity(tool_id).expect("a ball").0;
        force = world.wrench(tool_id).expect("a ball").0;
        let impulse = (after - velocity - DOWN * dt) * mass - spring * dt;
        assert!(
            impulse.distance(force * dt) < 1e-5 * mass,
            "step {step}: {impulse} of {force}"
        );
        (position, velocity) = (world.pose(tool_id).expect("a ball").position, after);
    }
    let carried = mass * 9.81 - 2.0 * (0.1 - position.y);
    assert!((force.y - carried).abs() < 0.01 * carried, "{force} of {carried} N");
    assert!(
        velocity.length() < 2e-3 && position.y < 0.055,
        "{velocity} m/s at {position}"
    );
    assert!(all_finite(body(&world, block)));
}
