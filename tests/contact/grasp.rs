//! Nodes attached to a tool: their positions, the forces on them, and when attachments break.

use crate::support::hanging::nodes_at;
use crate::support::scene::{SOLVERS, STORAGES};
use crate::support::tissue::*;
use glam::{DQuat, DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    AttachmentId, BodyDefinition, BodyId, Error, Pose, Shape, Solver, Storage, SurfacePoint, ToolId, Values, World,
    WorldDefinition,
};

const GRAVITY: Vec3 = Vec3::new(1.0, -9.81, 0.5);
const HANG: f64 = 9.81;
const SIZE: Vec3 = Vec3::new(0.08, 0.04, 0.08);
/// The initial position of the tool.
const GRIP: Vec3 = Vec3::new(0.01, 0.035, -0.015);
const NODE_MASS: f32 = 0.002;

/// A block of tissue that a small ball above it holds by nodes of its upper side.
struct Grasp {
    world: World,
    body: BodyId,
    tool: ToolId,
    nodes: Vec<u32>,
    ids: Vec<AttachmentId>,
    /// The attached nodes in the tool's axes.
    offsets: Vec<DVec3>,
}

#[derive(Clone, Copy)]
struct Setup {
    solver: Solver,
    storage: Storage,
    order: u32,
    substeps: u32,
    tolerance: f32,
    gravity: Vec3,
    drag: f32,
    away: Vec3,
    grip: Vec3,
    /// For IMPLICIT.
    accuracy: f32,
    /// Damping along springs (N s/m). Without it, VERLET defers half kicks where it can.
    spring_damping: f32,
}

const SETUP: Setup = Setup {
    solver: Solver::Verlet,
    storage: Storage::Packed,
    order: 0,
    substeps: 0,
    tolerance: 0.0,
    gravity: GRAVITY,
    drag: 0.0,
    away: Vec3::ZERO,
    grip: GRIP,
    accuracy: 1e-6,
    spring_damping: 0.02,
};

/// So far away that the tool is near no part of the block, and IMPLICIT does not subdivide its steps.
const APART: Vec3 = Vec3::new(0.01, 4.0, -0.015);

/// Returns the nodes of the upper side within 3 cm of its middle.
fn upper(mesh: &Mesh, away: Vec3) -> Vec<u32> {
    let is_held = |position: Vec3| position.y > 0.49 * SIZE.y && position.x.abs() < 0.02 && position.z.abs() < 0.03;
    nodes_at(mesh, |position| is_held(position - away))
}

impl Grasp {
    fn new(setup: Setup) -> Self {
        let mut grasp = Self::loose(setup);
        grasp.attach(0.0);
        grasp
    }

    /// Creates the block and the tool without attachments.
    fn loose(setup: Setup) -> Self {
        let mesh = moved(Mesh::block(SIZE.to_array(), [5, 3, 5]).expect("a block"), setup.away);
        let mut world = World::new(WorldDefinition {
            gravity: setup.gravity,
            substeps: setup.substeps,
            tolerance: setup.tolerance,
            ..Default::default()
        })
        .expect("a world");
        let body = world
            .create_body(&BodyDefinition {
                positions: &mesh.positions,
                masses: Values::Uniform(NODE_MASS),
                node_dampings: Values::Uniform(setup.drag * NODE_MASS),
                stiffnesses: Values::Uniform(100.0),
                spring_dampings: Values::Uniform(setup.spring_damping),
                triangles: &mesh.triangles,
                tetrahedra: &mesh.tetrahedra,
                storage: setup.storage,
                solver: setup.solver,
                order: setup.order,
                accuracy: setup.accuracy,
                iterations: if setup.accuracy > 0.0 { 20_000 } else { 0 },
                mass_scaling: 0.0,
                ..Default::default()
            })
            .expect("a body");
        let shape = Shape::Sphere { radius: 0.004 };
        let tool = tool(&mut world, shape, 0.0, setup.grip + setup.away, orientation_at(0.0));
        Self {
            world,
            body,
            tool,
            nodes: upper(&mesh, setup.away),
            ids: Vec::new(),
            offsets: Vec::new(),
        }
    }

    fn attach(&mut self, limit: f32) {
        let Pose { position, orientation } = self.world.pose(self.tool).expect("a tool");
        let back = orientation.as_dquat().normalize().conjugate();
        let at = |node: &u32| {
            let grasp = body(&self.world, self.body).positions()[*node as usize];
            back * (grasp.as_dvec3() - position.as_dvec3())
        };
        self.offsets = self.nodes.iter().map(at).collect();
        let attached = self.world.attach_nodes(self.body, &self.nodes, self.tool, limit);
        self.ids = attached.expect("attachments");
    }

    /// Returns the largest distance of attached nodes from their positions in the tool's frame (m).
    fn position_error(&self) -> f64 {
        let Pose { position, orientation } = self.world.pose(self.tool).expect("a tool");
        let rotation: DQuat = orientation.as_dquat().normalize();
        let body = body(&self.world, self.body);
        self.nodes
            .iter()
            .zip(&self.offsets)
            .map(|(&node, &offset)| {
                let expected = position.as_dvec3() + rotation * offset;
                body.positions()[node as usize].as_dvec3().distance(expected)
            })
            .fold(0.0, f64::max)
    }

    fn wrench(&self) -> [DVec3; 2] {
        let (force, torque) = self.world.wrench(self.tool).expect("a tool");
        [force.as_dvec3(), torque.as_dvec3()]
    }

    fn mass(&self) -> f64 {
        f64::from(NODE_MASS) * body(&self.world, self.body).node_count() as f64
    }

    fn momentum(&self) -> DVec3 {
        momentum(body(&self.world, self.body), NODE_MASS)
    }
}

fn orientation_at(time: f32) -> Quat {
    Quat::from_rotation_z(0.3) * Quat::from_scaled_axis(Vec3::new(6.0, -9.0, 4.0) * time)
}

/// A path along which all accelerations vary.
fn path(time: f32) -> Vec3 {
    GRIP + Vec3::new(0.05 * (20.0 * time).sin(), 0.3 * time, 0.4 * time * time)
}

#[test]
fn attached_nodes_follow_the_tool() {
    for solver in SOLVERS {
        for storage in STORAGES {
            for away in [Vec3::ZERO, Vec3::new(3.0, -1.0, 2.0)] {
                let mut grasp = Grasp::new(Setup {
                    solver,
                    storage,
                    away,
                    ..SETUP
                });
                assert!(grasp.nodes.len() > 4);
                let mut time = 0.0;
                for dt in [0.002, 1.0 / 60.0, 1.0 / 60.0, 0.1, 0.003] {
                    time += dt;
                    grasp
                        .world
                        .set_pose(grasp.tool, path(time) + away, Some(orientation_at(time)))
                        .expect("a pose");
                    grasp.world.step(dt).expect("a step");
                    // Positions are returned in f32.
                    let error = grasp.position_error();
                    let bound = 1e-6 * 0.08 + 1.5e-7 * f64::from(away.length());
                    assert!(error < bound, "{solver:?}, {storage:?}, {away}: {error} m");
                }
            }
        }
    }
}

#[test]
fn attached_nodes_follow_the_tool_with_a_tolerance() {
    for solver in SOLVERS {
        let mut grasp = Grasp::new(Setup {
            solver,
            tolerance: 1e-4,
            ..SETUP
        });
        for step in 1..=4 {
            let time = 0.002 * step as f32;
            let turn = Some(orientation_at(time));
            grasp.world.set_pose(grasp.tool, path(time), turn).expect("a pose");
            grasp.world.step(0.002).expect("a step");
            assert!(
                grasp.position_error() < 1e-6 * 0.08,
                "{solver:?}: {} m",
                grasp.position_error()
            );
        }
        assert!(grasp.wrench()[0].length() > 0.1);
    }
}

/// With substeps, attached nodes follow an arc instead of a straight line.
#[test]
fn a_rotating_tool_moves_attached_nodes_along_an_arc() {
    // A free node lies between two attached nodes, and the tool makes half a turn in one step. Motion along chords
    // would compress the springs flat and leave the node with their energy.
    let run = |steps: u32| {
        let mut grasp = Grasp::new(Setup {
            substeps: 240 / steps,
            gravity: Vec3::ZERO,
            ..SETUP
        });
        for step in 1..=steps {
            let turn = Quat::from_rotation_y(3.0 * step as f32 / steps as f32) * orientation_at(0.0);
            grasp.world.set_pose(grasp.tool, GRIP, Some(turn)).expect("a pose");
            grasp.world.step(0.24 / steps as f32).expect("a step");
        }
        body(&grasp.world, grasp.body).positions().to_vec()
    };
    let (single_step, many_steps) = (run(1), run(240));
    let error = single_step.iter().zip(&many_steps).map(|(a, b)| a.distance(*b));
    let error = error.fold(0.0, f32::max);
    assert!(error < 1e-5, "{error} m");
}

#[test]
fn at_rest_the_wrench_is_the_weight() {
    for solver in SOLVERS {
        let mut grasp = Grasp::new(Setup {
            solver,
            drag: 30.0,
            order: 1,
            gravity: Vec3::Y * -9.81,
            ..SETUP
        });
        let report = grasp.world.rest_state(grasp.body, &Default::default());
        report.expect("a state of rest");
        for _ in 0..60 {
            grasp.world.step(0.01).expect("a step");
        }
        let [force, torque] = grasp.wrench();
        let weight = DVec3::Y * -HANG * grasp.mass();
        let arm = centre(body(&grasp.world, grasp.body)) - GRIP.as_dvec3();
        let error = force.distance(weight) / weight.length();
        assert!(error < 1e-4, "{solver:?}: {force} N of {weight} N");
        let error = torque.distance(arm.cross(weight));
        assert!(error < 1e-4 * 0.08 * weight.length(), "{solver:?}: {torque} N m");
        // The wrench is the sum of the attachment forces.
        let forces = grasp
            .ids
            .iter()
            .map(|&id| grasp.world.attachment_force(id).expect("held"));
        let sum: DVec3 = forces.map(|force| force.as_dvec3()).sum();
        assert!((sum + force).length() < 1e-6 * weight.length(), "{solver:?}: {sum}");
    }
}

#[test]
fn a_static_equilibrium_returns_attachment_forces() {
    let mut grasp = Grasp::new(SETUP);
    let report = grasp.world.rest_state(grasp.body, &Default::default());
    report.expect("a state of rest");
    let forces = grasp
        .ids
        .iter()
        .map(|&id| grasp.world.attachment_force(id).expect("held"));
    let sum: DVec3 = forces.map(|force| force.as_dvec3()).sum();
    let weight = GRAVITY.as_dvec3() * grasp.mass();
    assert!((sum + weight).length() < 1e-4 * weight.length(), "{sum} N");
    assert!(grasp.position_error() < 1e-7);
}

/// Returns the largest relative difference between the impulse on the tool and the momentum change of the body, while
/// the block is thrown, caught and carried.
fn largest_imbalance(setup: Setup, dt: f32) -> f64 {
    let mut grasp = Grasp::loose(setup);
    let thrown = vec![Vec3::new(0.2, 0.5, -0.3); body(&grasp.world, grasp.body).node_count()];
    let thrown_body = grasp.world.body_mut(grasp.body).expect("a body");
    thrown_body.set_velocities(&thrown).expect("velocities");
    let mut before = grasp.momentum();
    grasp.world.step(dt).expect("a step");
    let weight = setup.gravity.as_dvec3() * grasp.mass();
    let mut now = grasp.momentum();
    grasp.attach(0.0);
    let mut largest = 0.0_f64;
    for step in 1..=40 {
        let time = step as f32 * dt;
        let pose = (path(time) + APART - GRIP, orientation_at(0.02 * time));
        grasp.world.set_pose(grasp.tool, pose.0, Some(pose.1)).expect("a pose");
        grasp.world.step(dt).expect("a step");
        let after = grasp.momentum();
        let size: f64 = grasp
            .ids
            .iter()
            .map(|&id| f64::from(grasp.world.attachment_force(id).expect("held").length()))
            .sum();
        // The factors t and c of the second-order formula.
        let is_second = setup.solver != Solver::Verlet && setup.order != 1;
        let (t, c) = if is_second { (2.0 / 3.0, 1.0 / 3.0) } else { (1.0, 0.0) };
        let t = t * f64::from(dt);
        let error = after - now - (now - before) * c - (weight - grasp.wrench()[0]) * t;
        largest = largest.max(error.length() / (size * t));
        (before, now) = (now, after);
    }
    largest
}

#[test]
fn the_impulse_on_the_tool_balances_the_momentum() {
    check_the_impulse_on_the_tool_balances_the_momentum(&[(Solver::Verlet, 0), (Solver::Implicit, 2)]);
}

#[test]
#[ignore = "long"]
fn the_impulse_on_the_tool_balances_the_momentum_with_other_solvers() {
    check_the_impulse_on_the_tool_balances_the_momentum(&[
        (Solver::Implicit, 1),
        (Solver::Newton, 1),
        (Solver::Newton, 2),
    ]);
}

fn check_the_impulse_on_the_tool_balances_the_momentum(solvers: &[(Solver, u32)]) {
    for &(solver, order) in solvers {
        for (dt, substeps) in [(0.001, 0), (1.0 / 60.0, 0), (1.0 / 60.0, 30)] {
            if solver != Solver::Verlet && substeps > 0 {
                continue;
            }
            let setup = Setup {
                solver,
                order,
                substeps,
                grip: APART,
                ..SETUP
            };
            let error = largest_imbalance(setup, dt);
            assert!(error < 1e-4, "{solver:?} of order {order}, dt {dt}: {error}");
        }
    }
}

#[test]
fn the_impulse_of_an_undamped_body_balances_its_momentum() {
    for dt in [0.001, 1.0 / 60.0] {
        let undamped = Setup {
            grip: APART,
            spring_damping: 0.0,
            ..SETUP
        };
        let error = largest_imbalance(undamped, dt);
        assert!(error < 1e-4, "undamped, dt {dt}: {error}");
    }
}

#[test]
fn the_torque_balances_the_angular_momentum() {
    // The tool rotates in place, about its own position.
    let mut grasp = Grasp::new(Setup { substeps: 40, ..SETUP });
    let about = GRIP.as_dvec3();
    let weight = GRAVITY.as_dvec3() * grasp.mass();
    let dt = 0.01;
    for step in 1..=40 {
        let spin = Some(orientation_at(0.01 * step as f32));
        grasp.world.set_pose(grasp.tool, GRIP, spin).expect("a pose");
        let before = body(&grasp.world, grasp.body);
        let (l, from) = (angular_momentum(before, NODE_MASS, about), centre(before));
        let mut middle = from;
        grasp.world.step(dt as f32).expect("a step");
        let after = body(&grasp.world, grasp.body);
        middle = (middle + centre(after)) / 2.0 - about;
        let [force, torque] = grasp.wrench();
        let imbalance = angular_momentum(after, NODE_MASS, about) - l - (middle.cross(weight) - torque) * dt;
        // The center moves along a curve, so the contribution of the weight is known to a few per cent of its
        // displacement per step.
        let displacement = centre(after).distance(from);
        let bound = (2e-4 * 0.05 * force.length() + 0.05 * displacement * weight.length()) * dt;
        assert!(
            imbalance.length() < bound,
            "step {step}: {} of {bound}",
            imbalance.length()
        );
    }
}

#[test]
fn damping_of_attached_nodes_is_part_of_the_wrench() {
    for solver in SOLVERS {
        let mut grasp = Grasp::new(Setup {
            solver,
            drag: 20.0,
            gravity: Vec3::ZERO,
            ..SETUP
        });
        for &id in &grasp.ids {
            grasp.world.release(id).expect("held");
        }
        grasp.nodes = (0..body(&grasp.world, grasp.body).node_count() as u32).collect();
        grasp.attach(0.0);
        let velocity = Vec3::new(0.3, 0.2, -0.1);
        for step in 1..=4 {
            let position = GRIP + velocity * (step as f32 * 0.01);
            grasp.world.set_pose(grasp.tool, position, None).expect("a pose");
            grasp.world.step(0.01).expect("a step");
        }
        let drag = velocity.as_dvec3() * (-20.0 * grasp.mass());
        let [force, _] = grasp.wrench();
        assert!(
            force.distance(drag) < 2e-4 * drag.length(),
            "{solver:?}: {force} N of {drag} N"
        );
    }
}

#[test]
fn an_attachment_breaks_in_the_step_that_exceeds_its_limit() {
    for solver in SOLVERS {
        // One node carries the whole weight.
        let mut grasp = Grasp::loose(Setup {
            solver,
            drag: 30.0,
            gravity: Vec3::Y * -9.81,
            ..SETUP
        });
        let top = grasp.nodes[grasp.nodes.len() / 2];
        let weight = grasp.mass() as f32 * 9.81;
        let strong = grasp.world.attach_node(grasp.body, top, grasp.tool, 1.01 * weight);
        let strong = strong.expect("an attachment");
        let report = grasp.world.rest_state(grasp.body, &Default::default());
        report.expect("a state of rest");
        for _ in 0..50 {
            grasp.world.step(0.01).expect("a step");
            assert!(grasp.world.slipped().is_empty());
        }
        let force = grasp.world.attachment_force(strong).expect("held");
        assert!((force.length() / weight - 1.0).abs() < 1e-3, "{solver:?}: {force} N");
        // Upward with constant acceleration.
        let mut rise = 0.0;
        let slipped = (1..100).find(|&step| {
            let before = body(&grasp.world, grasp.body).positions()[top as usize];
            rise += 2e-5 * step as f32;
            let position = GRIP + Vec3::Y * rise;
            grasp.world.set_pose(grasp.tool, position, None).expect("a pose");
            grasp.world.step(0.01).expect("a step");
            // In the step in which it breaks, the node still follows the tool, and its force is still part of the
            // wrench.
            let driven = body(&grasp.world, grasp.body).positions()[top as usize].y - before.y;
            assert!((driven - 2e-5 * step as f32).abs() < 1e-7, "{solver:?}");
            let felt = grasp.wrench()[0].length() as f32;
            let is_over = felt > 1.01 * weight;
            assert_eq!(is_over, !grasp.world.slipped().is_empty(), "{solver:?}: {felt} N");
            is_over
        });
        let slipped = slipped.expect("it slips");
        assert_eq!(grasp.world.slipped(), [strong]);
        assert!(matches!(grasp.world.attachment_force(strong), Err(Error::StaleId(_))));
        assert!(matches!(grasp.world.release(strong), Err(Error::StaleId(_))));
        // The node keeps the velocity at which it was driven.
        let speed = body(&grasp.world, grasp.body).velocities()[top as usize].y;
        let driven = 2e-3 * slipped as f32;
        assert!(
            (speed - driven).abs() < 1e-4 * driven + 1e-5,
            "{solver:?}: {speed} of {driven} m/s"
        );
        grasp.world.step(0.01).expect("a step");
        assert!(grasp.world.slipped().is_empty());
        assert_eq!(grasp.wrench(), [DVec3::ZERO; 2]);
    }
}

/// Creates a cloth whose short sides are attached to two tools. Returns the ids of the attachments.
fn stretched_cloth(solver: Solver, width: u32) -> (World, BodyId, [ToolId; 2], Vec<AttachmentId>) {
    let mesh = Mesh::cloth([0.2, 0.1], [2 * width, width]).expect("a cloth");
    let mut world = world(Vec3::Y * -9.81);
    let node_mass = 0.02 / mesh.positions.len() as f32;
    let cloth = world
        .create_body(&BodyDefinition {
            positions: &mesh.positions,
            masses: Values::Uniform(node_mass),
            node_dampings: Values::Uniform(20.0 * node_mass),
            stiffnesses: Values::Uniform(50.0),
            triangles: &mesh.triangles,
            solver,
            ..Default::default()
        })
        .expect("a cloth");
    let mut ids = Vec::new();
    let jaws = [-1.0, 1.0].map(|side| {
        // A capsule along the side, through the attached nodes.
        let shape = Shape::Capsule {
            radius: 0.002,
            half_length: 0.05,
        };
        let along = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let jaw = tool(&mut world, shape, 0.3, Vec3::X * side * 0.1, along);
        let nodes = nodes_at(&mesh, |position| position.x * side > 0.0999);
        assert_eq!(nodes.len() as u32, width + 1);
        ids.extend(world.attach_nodes(cloth, &nodes, jaw, 0.0).expect("attachments"));
        jaw
    });
    (world, cloth, jaws, ids)
}

#[test]
fn two_tools_stretch_a_cloth() {
    for solver in SOLVERS {
        let (mut world, cloth, jaws, ids) = stretched_cloth(solver, 4);
        for step in 1..=100 {
            let apart = 0.1 + 0.01 * (step as f32 / 50.0).min(1.0);
            world.set_pose(jaws[0], Vec3::X * -apart, None).expect("a pose");
            world.set_pose(jaws[1], Vec3::X * apart, None).expect("a pose");
            world.step(0.01).expect("a step");
        }
        for _ in 0..100 {
            world.step(0.01).expect("a step");
        }
        let pulls = jaws.map(|jaw| world.wrench(jaw).expect("a tool").0.as_dvec3());
        assert!(pulls[0].x > 0.5 && pulls[1].x < -0.5, "{solver:?}: {pulls:?}");
        let weight = DVec3::Y * -0.02 * HANG;
        let (force, torque) = world.wrench_about(&jaws, Vec3::new(0.3, 0.1, -0.2)).expect("tools");
        let error = force.as_dvec3().distance(weight);
        assert!(error < 1e-3 * weight.length(), "{solver:?}: {force} N");
        // The cloth hangs evenly, so the weight acts below the middle between the jaws.
        let arm = DVec3::new(-0.3, 0.0, 0.2);
        let expected = arm.cross(weight);
        assert!(
            torque.as_dvec3().distance(expected) < 1e-3 * expected.length(),
            "{solver:?}: {torque} N m of {expected}"
        );
        // The same sum from the wrenches of the two tools.
        let by_hand: DVec3 = jaws
            .iter()
            .map(|&jaw| {
                let (force, torque) = world.wrench(jaw).expect("a tool");
                let arm = world.pose(jaw).expect("a tool").position.as_dvec3() - DVec3::new(0.3, 0.1, -0.2);
                torque.as_dvec3() + arm.cross(force.as_dvec3())
            })
            .sum();
        assert!(torque.as_dvec3().distance(by_hand) < 1e-6);
        // When one side is released, the cloth swings from the other.
        for id in &ids[5..] {
            world.release(*id).expect("held");
        }
        world.set_pose(jaws[1], Vec3::new(0.3, 0.0, 0.0), None).expect("a pose");
        for _ in 0..200 {
            world.step(0.01).expect("a step");
        }
        let hangs = world.wrench(jaws[0]).expect("a tool").0.as_dvec3();
        assert!(hangs.distance(weight) < 0.05 * weight.length(), "{solver:?}: {hangs} N");
        assert_eq!(world.wrench(jaws[1]).expect("a tool").0, Vec3::ZERO);
        assert!(body(&world, cloth).positions().iter().all(|node| node.x < 0.0));
    }
}

#[test]
fn attached_nodes_do_not_touch_their_tool() {
    for solver in SOLVERS {
        // The jaws contain their nodes at rest, so any contact would push.
        let (mut world, cloth, jaws, _) = stretched_cloth(solver, 4);
        world.set_gravity(Vec3::ZERO).expect("a gravity");
        let before = body(&world, cloth).positions().to_vec();
        for _ in 0..20 {
            world.step(0.01).expect("a step");
        }
        for jaw in jaws {
            let (force, torque) = world.wrench(jaw).expect("a tool");
            // Coordinates of 0.1 m are rounded to about 1e-8 m, which strains the springs.
            assert!(
                force.length() < 1e-5 && torque.length() < 1e-7,
                "{solver:?}: {force} N, {torque} N m"
            );
        }
        let moved = body(&world, cloth).positions().iter().zip(&before);
        let moved = moved.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(moved < 1e-7, "{solver:?}: {moved} m");
        // A tool still collides with nodes that it does not hold, and another tool collides with all nodes.
        let other = sphere(&mut world, 0.004, Vec3::new(0.1, 0.003, 0.0));
        world.step(0.01).expect("a step");
        let pushed = world.wrench(other).expect("a tool").0;
        // The nodes there are attached and transmit the force of the other tool.
        assert!(pushed.y >= 0.0);
        let middle = sphere(&mut world, 0.004, Vec3::new(0.0, 0.008, 0.0));
        let mut felt = 0.0_f32;
        for step in 1..=10 {
            let position = Vec3::new(0.0, 0.008 - 0.002 * step as f32, 0.0);
            world.set_pose(middle, position, None).expect("a pose");
            world.step(0.01).expect("a step");
            felt = felt.max(world.wrench(middle).expect("a tool").0.y);
        }
        assert!(felt > 1e-3, "{solver:?}: {felt} N");
    }
}

#[test]
fn a_tool_still_touches_nodes_that_it_does_not_hold() {
    // A ball holds a corner of a cloth and is moved to its middle.
    let mut world = world(Vec3::ZERO);
    let cloth = Tissue::CALM.put(&mut world, &square(0.2, 10));
    pin_all(&mut world, cloth, &[10, 110, 120]);
    let ball = sphere(&mut world, 0.01, Vec3::new(-0.1, 0.02, -0.1));
    world.attach_node(cloth, 0, ball, 0.0).expect("an attachment");
    let mut deepest = 0.0_f64;
    for step in 1..=40 {
        let part = step as f32 / 40.0;
        let position = Vec3::new(-0.1, 0.03, -0.1).lerp(Vec3::new(0.0, -0.03, 0.0), part);
        world.set_pose(ball, position, None).expect("a pose");
        world.step(0.01).expect("a step");
        let at = position.as_dvec3();
        let body = body(&world, cloth);
        let grasp = |triangle: &[u32; 3]| triangle.contains(&0);
        let free = body.surface().iter().filter(|triangle| !grasp(triangle));
        let nearest = free
            .map(|&triangle| point_to_triangle(at, corners(body, triangle)))
            .fold(f64::INFINITY, f64::min);
        deepest = deepest.max(0.01 - nearest);
    }
    assert!(deepest < 1e-4, "{deepest} m deep");
}

#[test]
fn released_nodes_move_like_unpinned_nodes() {
    for solver in SOLVERS {
        let run = |attached: bool| {
            let mut grasp = Grasp::loose(Setup {
                solver,
                grip: APART,
                ..SETUP
            });
            if attached {
                grasp.attach(0.0);
            } else {
                pin_all(&mut grasp.world, grasp.body, &grasp.nodes);
            }
            let first: Vec<Vec3> = body(&grasp.world, grasp.body).positions().to_vec();
            let velocity = Vec3::new(0.2, 0.3, -0.1);
            for step in 1..=8 {
                let displacement = velocity * (0.01 * step as f32);
                if attached {
                    grasp
                        .world
                        .set_pose(grasp.tool, APART + displacement, None)
                        .expect("a pose");
                } else {
                    for &node in &grasp.nodes {
                        let body = grasp.world.body_mut(grasp.body).expect("a body");
                        body.move_pin(node, first[node as usize] + displacement).expect("a pin");
                    }
                }
                grasp.world.step(0.01).expect("a step");
            }
            for (index, &node) in grasp.nodes.iter().enumerate() {
                if attached {
                    grasp.world.release(grasp.ids[index]).expect("held");
                } else {
                    let body = grasp.world.body_mut(grasp.body).expect("a body");
                    body.unpin(node).expect("a pin");
                }
            }
            for _ in 0..8 {
                grasp.world.step(0.01).expect("a step");
            }
            body(&grasp.world, grasp.body).positions().to_vec()
        };
        let (attached, pinned) = (run(true), run(false));
        let error = attached.iter().zip(&pinned).map(|(a, b)| a.distance(*b));
        let error = error.fold(0.0, f32::max);
        assert!(error < 2e-6, "{solver:?}: {error} m");
    }
}

#[test]
fn attached_surface_points_follow_the_tool() {
    for solver in SOLVERS {
        let mut grasp = Grasp::loose(Setup {
            solver,
            gravity: Vec3::Y * -9.81,
            drag: 20.0,
            ..SETUP
        });
        let surface = body(&grasp.world, grasp.body).surface().to_vec();
        let above = |triangle: &[u32; 3]| triangle.iter().all(|corner| grasp.nodes.contains(corner));
        let triangles: Vec<u32> = (0..)
            .zip(&surface)
            .filter(|(_, it)| above(it))
            .map(|(it, _)| it)
            .collect();
        assert!(triangles.len() > 3);
        // Inside a triangle, on an edge, and at a corner. Several points share corners.
        let weights = [[0.2, 0.3, 0.5], [0.6, 0.0, 0.4], [0.0, 1.0, 0.0], [0.5, 0.25, 0.25]];
        let points: Vec<SurfacePoint> = triangles
            .iter()
            .zip(weights)
            .map(|(&triangle, weights)| SurfacePoint { triangle, weights })
            .collect();
        let at = |grasp: &Grasp| -> Vec<DVec3> {
            let body = body(&grasp.world, grasp.body);
            let position = |point: &SurfacePoint| {
                let corners = corners(body, surface[point.triangle as usize]);
                let parts = corners.iter().zip(point.weights);
                parts.map(|(corner, weight)| *corner * f64::from(weight)).sum()
            };
            points.iter().map(position).collect()
        };
        let first = at(&grasp);
        let turn = |grasp: &Grasp| {
            grasp
                .world
                .pose(grasp.tool)
                .expect("a tool")
                .orientation
                .as_dquat()
                .normalize()
        };
        let start = turn(&grasp);
        let attached = grasp.world.attach_points(grasp.body, &points, grasp.tool, 0.0);
        grasp.ids = attached.expect("attachments");
        let mut time = 0.0;
        for dt in [0.002, 1.0 / 60.0, 0.05, 0.003] {
            time += dt;
            grasp
                .world
                .set_pose(grasp.tool, path(time), Some(orientation_at(time)))
                .expect("a pose");
            grasp.world.step(dt).expect("a step");
            let expected =
                |first: &DVec3| path(time).as_dvec3() + turn(&grasp) * (start.conjugate() * (*first - GRIP.as_dvec3()));
            for (now, first) in at(&grasp).iter().zip(&first) {
                let error = now.distance(expected(first));
                assert!(error < 1e-6 * 0.08, "{solver:?}: {error} m");
            }
            // The forces of all points add up to the force on the tool.
            let forces = grasp
                .ids
                .iter()
                .map(|&id| grasp.world.attachment_force(id).expect("held").as_dvec3());
            let (sum, size) = forces.fold((DVec3::ZERO, 0.0), |(sum, size), force| {
                (sum + force, size + force.length())
            });
            assert!((sum + grasp.wrench()[0]).length() < 1e-5 * size, "{solver:?}: {sum} N");
        }
        // After one point is released, corners that it shares with others stay attached. In the end all corners are
        // free.
        let mut free = 0;
        for (index, &id) in grasp.ids.iter().enumerate() {
            grasp.world.release(id).expect("held");
            let others: Vec<u32> = points[index + 1..]
                .iter()
                .flat_map(|point| surface[point.triangle as usize].into_iter().zip(point.weights))
                .filter(|(_, weight)| *weight > 0.0)
                .map(|(corner, _)| corner)
                .collect();
            for corner in surface[points[index].triangle as usize] {
                let held_body = grasp.world.body_mut(grasp.body).expect("a body");
                let is_held = held_body.pin(corner).is_err();
                assert_eq!(
                    is_held,
                    others.contains(&corner),
                    "{solver:?}: corner {corner} after {index}"
                );
                if !is_held {
                    held_body.unpin(corner).expect("a pin");
                    free += 1;
                }
            }
        }
        assert!(free > 4);
    }
}

#[test]
fn two_attachments_of_one_node_break_separately() {
    // A node is attached twice. Each attachment carries half, and when the weaker one breaks, the other carries all.
    let mut grasp = Grasp::loose(Setup {
        drag: 30.0,
        gravity: Vec3::Y * -9.81,
        ..SETUP
    });
    let weight = grasp.mass() as f32 * 9.81;
    let top = grasp.nodes[grasp.nodes.len() / 2];
    let [weak, strong] = [0.4, 2.0].map(|part| {
        let attached = grasp.world.attach_node(grasp.body, top, grasp.tool, part * weight);
        attached.expect("an attachment")
    });
    let report = grasp.world.rest_state(grasp.body, &Default::default());
    report.expect("a state of rest");
    for id in [weak, strong] {
        let force = grasp.world.attachment_force(id).expect("held");
        assert!((force.y / weight - 0.5).abs() < 1e-3, "{force} N of {weight} N");
    }
    grasp.world.step(0.01).expect("a step");
    assert_eq!(grasp.world.slipped(), [weak]);
    grasp.world.step(0.01).expect("a step");
    assert!(grasp.world.slipped().is_empty());
    let force = grasp.world.attachment_force(strong).expect("held");
    assert!((force.y / weight - 1.0).abs() < 1e-2, "{force} N of {weight} N");
}

#[test]
fn a_refused_step_changes_nothing_and_the_pose_can_be_replaced() {
    let mut grasp = Grasp::new(Setup { substeps: 4, ..SETUP });
    let pose = |grasp: &mut Grasp, position: Vec3| {
        let turn = Some(orientation_at(0.01));
        grasp.world.set_pose(grasp.tool, position, turn).expect("a pose");
    };
    pose(&mut grasp, GRIP + Vec3::Y * 0.001);
    grasp.world.step(0.004).expect("a step");
    let mut twin = Grasp::new(Setup { substeps: 4, ..SETUP });
    pose(&mut twin, GRIP + Vec3::Y * 0.001);
    twin.world.step(0.004).expect("a step");
    assert_eq!(grasp.world.state_hash(), twin.world.state_hash());
    pose(&mut grasp, GRIP + Vec3::Y * 2.0);
    let before = grasp.world.state_hash();
    assert!(matches!(grasp.world.step(1.0), Err(Error::Unstable { .. })));
    assert_eq!(grasp.world.state_hash(), before);
    pose(&mut grasp, GRIP + Vec3::Y * 0.002);
    pose(&mut twin, GRIP + Vec3::Y * 0.002);
    for _ in 0..5 {
        grasp.world.step(0.004).expect("a step");
        twin.world.step(0.004).expect("a step");
    }
    assert_eq!(grasp.world.state_hash(), twin.world.state_hash());
    assert!(grasp.position_error() < 1e-7);
}

#[test]
fn the_state_hash_covers_attachments() {
    let hash = |limit: Option<f32>, nodes: usize| {
        let mut grasp = Grasp::loose(SETUP);
        grasp.nodes.truncate(nodes);
        if let Some(limit) = limit {
            grasp.attach(limit);
        } else {
            pin_all(&mut grasp.world, grasp.body, &grasp.nodes);
        }
        grasp.world.state_hash()
    };
    let all = [
        hash(None, 3),
        hash(Some(0.0), 3),
        hash(Some(0.0), 2),
        hash(Some(1.0), 3),
    ];
    for (index, one) in all.iter().enumerate() {
        assert!(!all[..index].contains(one), "{index}");
    }
    assert_eq!(hash(Some(0.0), 3), hash(Some(f32::INFINITY), 3));
    // Released attachments leave no trace in the hash.
    let mut grasp = Grasp::loose(SETUP);
    let loose = grasp.world.state_hash();
    grasp.attach(0.0);
    for id in grasp.ids {
        grasp.world.release(id).expect("held");
    }
    assert_eq!(grasp.world.state_hash(), loose);
}

#[test]
fn results_are_bitwise_identical_for_any_number_of_threads() {
    // One body that all threads share, and two bodies that are distributed over them.
    for solver in SOLVERS {
        let run = |threads: u32| {
            let mut world = World::new(WorldDefinition {
                thread_count: threads,
                ..Default::default()
            })
            .expect("a world");
            let above = sphere(&mut world, 0.01, Vec3::Y);
            let cells: &[[u32; 2]] = if solver == Solver::Newton {
                &[[26, 20], [20, 26]]
            } else {
                &[[128, 64], [26, 20], [20, 26]]
            };
            let mut ids = Vec::new();
            for &cells in cells {
                let mesh = Mesh::cloth([0.2, 0.1], cells).expect("a cloth");
                let cloth = world
                    .create_body(&BodyDefinition {
                        positions: &mesh.positions,
                        masses: Values::Uniform(1e-5),
                        stiffnesses: Values::Uniform(20.0),
                        triangles: &mesh.triangles,
                        solver,
                        ..Default::default()
                    })
                    .expect("a cloth");
                let nodes: Vec<u32> = (0..mesh.positions.len() as u32).step_by(37).collect();
                ids.extend(world.attach_nodes(cloth, &nodes, above, 0.0).expect("attachments"));
            }
            for step in 1..=2 {
                let turn = Quat::from_rotation_x(0.01 * step as f32);
                world.set_pose(above, Vec3::Y, Some(turn)).expect("a pose");
                world.step(0.002).expect("a step");
            }
            let forces: Vec<_> = ids
                .iter()
                .map(|&id| world.attachment_force(id).expect("held"))
                .collect();
            assert!(forces.iter().all(|force| *force != Vec3::ZERO));
            (world.state_hash(), world.wrench(above).expect("a tool"), forces)
        };
        assert_eq!(run(1), run(3), "{solver:?}");
    }
}

#[test]
fn attached_nodes_stay_at_positions_that_are_set() {
    for solver in SOLVERS {
        let mut grasp = Grasp::new(Setup { solver, ..SETUP });
        grasp.world.step(0.01).expect("a step");
        let shift = Vec3::new(0.01, -0.02, 0.03);
        let new_positions: Vec<Vec3> = body(&grasp.world, grasp.body)
            .positions()
            .iter()
            .map(|x| *x + shift)
            .collect();
        let moved_body = grasp.world.body_mut(grasp.body).expect("a body");
        moved_body.set_positions(&new_positions).expect("positions");
        for _ in 0..3 {
            grasp.world.step(0.01).expect("a step");
        }
        for &node in &grasp.nodes {
            let now = body(&grasp.world, grasp.body).positions()[node as usize];
            assert!(now.distance(new_positions[node as usize]) < 1e-7, "{solver:?}: {now}");
        }
        let turn = Quat::from_rotation_y(0.4);
        grasp
            .world
            .set_pose(grasp.tool, GRIP, Some(turn * orientation_at(0.0)))
            .expect("a pose");
        grasp.world.step(0.01).expect("a step");
        for &node in &grasp.nodes {
            let now = body(&grasp.world, grasp.body).positions()[node as usize];
            let expected = GRIP + turn * (new_positions[node as usize] - GRIP);
            assert!(now.distance(expected) < 1e-7, "{solver:?}: {now}");
        }
    }
}

#[test]
fn a_rolled_back_body_returns_to_its_tool() {
    let mut grasp = Grasp::new(SETUP);
    grasp.world.step(0.01).expect("a step");
    let heavy = Vec3::splat(3e38);
    let free = (0..).find(|node| !grasp.nodes.contains(node)).expect("a free node");
    let pushed = grasp.world.body_mut(grasp.body).expect("a body");
    pushed.apply_force(free, heavy).expect("a force");
    grasp
        .world
        .set_pose(grasp.tool, GRIP + Vec3::X * 0.005, None)
        .expect("a pose");
    let report = grasp.world.step(0.01).expect("a step");
    assert_eq!(report.bodies_restored, 1);
    assert!((grasp.position_error() - 0.005).abs() < 1e-7);
    grasp.world.step(0.01).expect("a step");
    assert!(grasp.position_error() < 1e-7);
}

#[test]
fn an_attachment_ends_with_its_tool_and_its_body() {
    let mut grasp = Grasp::new(SETUP);
    let twin = Grasp::loose(SETUP);
    grasp.world.destroy_tool(grasp.tool).expect("a tool");
    for &id in &grasp.ids {
        assert!(matches!(grasp.world.attachment_force(id), Err(Error::StaleId(_))));
    }
    let mut twin = twin;
    twin.world.destroy_tool(twin.tool).expect("a tool");
    assert_eq!(grasp.world.state_hash(), twin.world.state_hash());
    for &node in &grasp.nodes {
        let held_body = grasp.world.body_mut(grasp.body).expect("a body");
        held_body.pin(node).expect("it is free");
    }

    let mut grasp = Grasp::new(SETUP);
    grasp.world.destroy_body(grasp.body).expect("a body");
    for &id in &grasp.ids {
        assert!(matches!(grasp.world.release(id), Err(Error::StaleId(_))));
    }
    grasp.world.step(0.01).expect("a step");
    assert_eq!(grasp.wrench(), [DVec3::ZERO; 2]);
}

#[test]
fn invalid_attachments_are_refused() {
    let mut grasp = Grasp::new(SETUP);
    let free: Vec<u32> = (0..body(&grasp.world, grasp.body).node_count() as u32)
        .filter(|node| !grasp.nodes.contains(node))
        .collect();
    let held_body = grasp.world.body_mut(grasp.body).expect("a body");
    held_body.pin(free[0]).expect("a pin");
    held_body.pin_axes(free[1], [true, false, false]).expect("a pin");
    let before = grasp.world.state_hash();
    let attached_node = grasp.nodes[0];
    for (nodes, limit, word) in [
        (vec![free[2], 100_000], 0.0, "nodes[1]"),
        (vec![free[2], free[0]], 0.0, "nodes[1]"),
        (vec![free[1]], 0.0, "nodes[0]"),
        (vec![free[2]], -1.0, "force_limit"),
        (vec![free[2]], f32::NAN, "force_limit"),
    ] {
        match grasp.world.attach_nodes(grasp.body, &nodes, grasp.tool, limit) {
            Err(Error::InvalidArgument(message)) => assert!(message.contains(word), "{message}"),
            other => panic!("{nodes:?}: {other:?}"),
        }
    }
    let held_body = grasp.world.body_mut(grasp.body).expect("a body");
    for refused in [
        held_body.pin(attached_node),
        held_body.pin_axes(attached_node, [false, true, false]),
        held_body.unpin(attached_node),
        held_body.move_pin(attached_node, Vec3::ZERO),
        held_body.pin_force(attached_node).map(drop),
    ] {
        assert!(matches!(refused, Err(Error::InvalidArgument(_))), "{refused:?}");
    }
    let other = sphere(&mut grasp.world, 0.001, Vec3::Y);
    let before = (grasp.world.state_hash(), before).0;
    let refused = grasp
        .world
        .attach_nodes(grasp.body, &[free[2], attached_node], other, 0.0);
    assert!(matches!(refused, Err(Error::InvalidArgument(_))), "{refused:?}");
    let refused = grasp.world.wrench_about(&[grasp.tool, grasp.tool], Vec3::ZERO);
    assert!(matches!(refused, Err(Error::InvalidArgument(_))), "{refused:?}");
    assert_eq!(grasp.world.state_hash(), before);
}

/// A node is held by an attachment of its own and by a point that has almost no weight there. After the node is
/// released, the point remains.
#[test]
fn the_remaining_attachment_of_a_node_carries_all_of_the_force() {
    for weight in [1e-8, 1e-30, f32::from_bits(1)] {
        let mut grasp = Grasp::loose(SETUP);
        let surface = body(&grasp.world, grasp.body).surface();
        let triangle = (0..)
            .zip(surface)
            .find(|(_, corners)| corners.contains(&grasp.nodes[0]));
        let (triangle, &corners) = triangle.expect("a triangle");
        let mut weights = [0.5; 3];
        let corner = corners.iter().position(|&node| node == grasp.nodes[0]);
        weights[corner.expect("its corner")] = weight;
        let node = grasp.world.attach_node(grasp.body, grasp.nodes[0], grasp.tool, 0.0);
        let node = node.expect("an attachment");
        let point = SurfacePoint { triangle, weights };
        let attached = grasp.world.attach_points(grasp.body, &[point], grasp.tool, 1e6);
        let attached = attached.expect("attachments");
        grasp.world.step(0.004).expect("a step");
        grasp.world.release(node).expect("held");
        grasp.world.step(0.004).expect("a step");
        assert_eq!(grasp.world.slipped(), []);
        let force = grasp.world.attachment_force(attached[0]).expect("held").as_dvec3();
        let [wrench, _] = grasp.wrench();
        assert!(force.length() > 0.01, "{weight}: {force} N");
        let error = (force + wrench).length() / wrench.length();
        assert!(error < 1e-6, "{weight}: {force} N of {wrench} N");
    }
}

/// Only the attachments that remain at the end count, whatever was attached and released before, in any order.
#[test]
fn released_attachments_leave_no_trace() {
    let mut random = Random::new(12);
    for round in 0..6 {
        let mut grasp = Grasp::loose(SETUP);
        let node_count = body(&grasp.world, grasp.body).node_count();
        let nodes: Vec<u32> = (0..node_count as u32).collect();
        let other = sphere(&mut grasp.world, 0.004, APART + Vec3::X);
        // Every node goes to one of the tools, and some go twice.
        let mut other_ids = Vec::new();
        let mut tool_ids = Vec::new();
        for batch in 0..8 {
            let mut batch_nodes: Vec<u32> = (0..12).map(|_| nodes[random.below(nodes.len())]).collect();
            batch_nodes.retain(|node| node % 5 == 0 || batch % 2 == 0);
            let (other_nodes, tool_nodes): (Vec<u32>, Vec<u32>) = batch_nodes.iter().partition(|&&node| node % 5 == 0);
            other_ids.extend(
                grasp
                    .world
                    .attach_nodes(grasp.body, &other_nodes, other, 0.0)
                    .expect("fit"),
            );
            let ids = grasp
                .world
                .attach_nodes(grasp.body, &tool_nodes, grasp.tool, 0.0)
                .expect("fit");
            tool_ids.extend(tool_nodes.into_iter().zip(ids));
            for _ in 0..batch / 2 {
                if !tool_ids.is_empty() {
                    let (_, id) = tool_ids.swap_remove(random.below(tool_ids.len()));
                    grasp.world.release(id).expect("held");
                    assert!(matches!(grasp.world.release(id), Err(Error::StaleId(_))));
                }
            }
        }
        if round % 2 == 0 {
            grasp.world.destroy_tool(other).expect("a tool");
            assert!(other_ids.iter().all(|&id| grasp.world.attachment_force(id).is_err()));
        } else {
            other_ids
                .into_iter()
                .for_each(|id| grasp.world.release(id).expect("held"));
        }
        let mut fresh = Grasp::loose(SETUP);
        tool_ids.sort_unstable_by_key(|(node, _)| *node);
        let last: Vec<u32> = tool_ids.iter().map(|(node, _)| *node).collect();
        assert!(last.len() > 8);
        let ids = fresh
            .world
            .attach_nodes(fresh.body, &last, fresh.tool, 0.0)
            .expect("fit");
        for step in 1..=5 {
            let time = 0.003 * step as f32;
            for grasp in [&mut grasp, &mut fresh] {
                grasp
                    .world
                    .set_pose(grasp.tool, path(time), Some(orientation_at(time)))
                    .expect("a pose");
                grasp.world.step(0.003).expect("a step");
            }
            let positions = [&grasp, &fresh].map(|grasp| body(&grasp.world, grasp.body).positions().to_vec());
            assert!(positions[0] == positions[1], "round {round}, step {step}");
        }
        for ((node, id), fresh_id) in tool_ids.into_iter().zip(ids) {
            let [force, expected] = [grasp.world.attachment_force(id), fresh.world.attachment_force(fresh_id)];
            let (force, expected) = (force.expect("held"), expected.expect("held"));
            assert!(
                force == expected && force.length() > 0.0,
                "node {node}: {force} N for {expected} N"
            );
        }
    }
}
