//! Nodes that a tool holds: where they are, what holds them, and when they slip.

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
/// Where the tool is at first.
const GRIP: Vec3 = Vec3::new(0.01, 0.035, -0.015);
const NODE_MASS: f32 = 0.002;

/// A block of tissue that a small ball above it holds by nodes of its upper side.
struct Held {
    world: World,
    body: BodyId,
    tool: ToolId,
    nodes: Vec<u32>,
    ids: Vec<AttachmentId>,
    /// What is held, in the tool's axes.
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
    /// Of IMPLICIT.
    accuracy: f32,
    /// Along springs, N s/m; without, VERLET leaves steps open where it may.
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

/// So far that the tool is near no part of the block, so that IMPLICIT takes its steps whole.
const APART: Vec3 = Vec3::new(0.01, 4.0, -0.015);

/// The nodes of the upper side within 3 cm of its middle.
fn upper(mesh: &Mesh, away: Vec3) -> Vec<u32> {
    let is_held = |position: Vec3| position.y > 0.49 * SIZE.y && position.x.abs() < 0.02 && position.z.abs() < 0.03;
    nodes_at(mesh, |position| is_held(position - away))
}

impl Held {
    fn new(setup: Setup) -> Self {
        let mut held = Self::loose(setup);
        held.attach(0.0);
        held
    }

    /// Before anything is held.
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
        let tool = tool(&mut world, shape, 0.0, setup.grip + setup.away, turned(0.0));
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
            let held = body(&self.world, self.body).positions()[*node as usize];
            back * (held.as_dvec3() - position.as_dvec3())
        };
        self.offsets = self.nodes.iter().map(at).collect();
        let attached = self.world.attach_nodes(self.body, &self.nodes, self.tool, limit);
        self.ids = attached.expect("attachments");
    }

    /// How far what is held is from where the tool has it, m.
    fn off(&self) -> f64 {
        let Pose { position, orientation } = self.world.pose(self.tool).expect("a tool");
        let turned: DQuat = orientation.as_dquat().normalize();
        let body = body(&self.world, self.body);
        self.nodes
            .iter()
            .zip(&self.offsets)
            .map(|(&node, &offset)| {
                let there = position.as_dvec3() + turned * offset;
                body.positions()[node as usize].as_dvec3().distance(there)
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

fn turned(time: f32) -> Quat {
    Quat::from_rotation_z(0.3) * Quat::from_scaled_axis(Vec3::new(6.0, -9.0, 4.0) * time)
}

/// A way with all accelerations.
fn way(time: f32) -> Vec3 {
    GRIP + Vec3::new(0.05 * (20.0 * time).sin(), 0.3 * time, 0.4 * time * time)
}

#[test]
fn what_is_held_is_where_the_tool_has_it() {
    for solver in SOLVERS {
        for storage in STORAGES {
            for away in [Vec3::ZERO, Vec3::new(3.0, -1.0, 2.0)] {
                let mut held = Held::new(Setup {
                    solver,
                    storage,
                    away,
                    ..SETUP
                });
                assert!(held.nodes.len() > 4);
                let mut time = 0.0;
                for dt in [0.002, 1.0 / 60.0, 1.0 / 60.0, 0.1, 0.003] {
                    time += dt;
                    held.world
                        .set_pose(held.tool, way(time) + away, Some(turned(time)))
                        .expect("a pose");
                    held.world.step(dt).expect("a step");
                    // Positions are told in f32.
                    let off = held.off();
                    let most = 1e-6 * 0.08 + 1.5e-7 * f64::from(away.length());
                    assert!(off < most, "{solver:?}, {storage:?}, {away}: {off} m");
                }
            }
        }
    }
}

#[test]
fn a_step_to_a_tolerance_holds_it_there_too() {
    for solver in SOLVERS {
        let mut held = Held::new(Setup {
            solver,
            tolerance: 1e-4,
            ..SETUP
        });
        for step in 1..=4 {
            let time = 0.002 * step as f32;
            let turn = Some(turned(time));
            held.world.set_pose(held.tool, way(time), turn).expect("a pose");
            held.world.step(0.002).expect("a step");
            assert!(held.off() < 1e-6 * 0.08, "{solver:?}: {} m", held.off());
        }
        assert!(held.wrench()[0].length() > 0.1);
    }
}

/// With substeps what is held goes round with the tool, and not straight.
#[test]
fn a_turning_tool_leads_on_an_arc() {
    // A free node between two that are held, half a turn in one step: pulled along chords it would end with the energy of
    // springs that were pressed flat.
    let run = |steps: u32| {
        let mut held = Held::new(Setup {
            substeps: 240 / steps,
            gravity: Vec3::ZERO,
            ..SETUP
        });
        for step in 1..=steps {
            let turn = Quat::from_rotation_y(3.0 * step as f32 / steps as f32) * turned(0.0);
            held.world.set_pose(held.tool, GRIP, Some(turn)).expect("a pose");
            held.world.step(0.24 / steps as f32).expect("a step");
        }
        body(&held.world, held.body).positions().to_vec()
    };
    let (whole, pieces) = (run(1), run(240));
    let off = whole.iter().zip(&pieces).map(|(a, b)| a.distance(*b));
    let off = off.fold(0.0, f32::max);
    assert!(off < 1e-5, "{off} m");
}

#[test]
fn at_rest_the_wrench_is_the_weight() {
    for solver in SOLVERS {
        let mut held = Held::new(Setup {
            solver,
            drag: 30.0,
            order: 1,
            gravity: Vec3::Y * -9.81,
            ..SETUP
        });
        let report = held.world.rest_state(held.body, &Default::default());
        report.expect("a state of rest");
        for _ in 0..60 {
            held.world.step(0.01).expect("a step");
        }
        let [force, torque] = held.wrench();
        let weight = DVec3::Y * -HANG * held.mass();
        let arm = centre(body(&held.world, held.body)) - GRIP.as_dvec3();
        let off = force.distance(weight) / weight.length();
        assert!(off < 1e-4, "{solver:?}: {force} N of {weight} N");
        let off = torque.distance(arm.cross(weight));
        assert!(off < 1e-4 * 0.08 * weight.length(), "{solver:?}: {torque} N m");
        // It is the sum of what holds each node.
        let forces = held
            .ids
            .iter()
            .map(|&id| held.world.attachment_force(id).expect("held"));
        let sum: DVec3 = forces.map(|force| force.as_dvec3()).sum();
        assert!((sum + force).length() < 1e-6 * weight.length(), "{solver:?}: {sum}");
    }
}

#[test]
fn a_state_of_rest_tells_what_holds_it() {
    let mut held = Held::new(SETUP);
    let report = held.world.rest_state(held.body, &Default::default());
    report.expect("a state of rest");
    let forces = held
        .ids
        .iter()
        .map(|&id| held.world.attachment_force(id).expect("held"));
    let sum: DVec3 = forces.map(|force| force.as_dvec3()).sum();
    let weight = GRAVITY.as_dvec3() * held.mass();
    assert!((sum + weight).length() < 1e-4 * weight.length(), "{sum} N");
    assert!(held.off() < 1e-7);
}

/// The largest part by which the impulse on the tool is not what the momentum of the body lacks, over steps in which the block is
/// thrown, caught and carried.
fn unbalanced(setup: Setup, dt: f32) -> f64 {
    let mut held = Held::loose(setup);
    let thrown = vec![Vec3::new(0.2, 0.5, -0.3); body(&held.world, held.body).node_count()];
    let thrown_body = held.world.body_mut(held.body).expect("a body");
    thrown_body.set_velocities(&thrown).expect("velocities");
    let mut before = held.momentum();
    held.world.step(dt).expect("a step");
    let weight = setup.gravity.as_dvec3() * held.mass();
    let mut now = held.momentum();
    held.attach(0.0);
    let mut largest = 0.0_f64;
    for step in 1..=40 {
        let time = step as f32 * dt;
        let pose = (way(time) + APART - GRIP, turned(0.02 * time));
        held.world.set_pose(held.tool, pose.0, Some(pose.1)).expect("a pose");
        held.world.step(dt).expect("a step");
        let after = held.momentum();
        let size: f64 = held
            .ids
            .iter()
            .map(|&id| f64::from(held.world.attachment_force(id).expect("held").length()))
            .sum();
        // t and c of the formula of order 2.
        let is_second = setup.solver != Solver::Verlet && setup.order != 1;
        let (t, c) = if is_second { (2.0 / 3.0, 1.0 / 3.0) } else { (1.0, 0.0) };
        let t = t * f64::from(dt);
        let off = after - now - (now - before) * c - (weight - held.wrench()[0]) * t;
        largest = largest.max(off.length() / (size * t));
        (before, now) = (now, after);
    }
    largest
}

#[test]
fn the_impulse_on_the_tool_is_what_the_momentum_lacks() {
    the_impulse_on_the_tool_is_what_the_momentum_lacks_of(&[(Solver::Verlet, 0), (Solver::Implicit, 2)]);
}

#[test]
#[ignore = "long"]
fn the_impulse_on_the_tool_is_what_the_momentum_lacks_with_other_solvers() {
    the_impulse_on_the_tool_is_what_the_momentum_lacks_of(&[
        (Solver::Implicit, 1),
        (Solver::Newton, 1),
        (Solver::Newton, 2),
    ]);
}

fn the_impulse_on_the_tool_is_what_the_momentum_lacks_of(solvers: &[(Solver, u32)]) {
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
            let off = unbalanced(setup, dt);
            assert!(off < 1e-4, "{solver:?} of order {order}, dt {dt}: {off}");
        }
    }
}

#[test]
fn the_impulse_of_what_is_undamped_is_what_the_momentum_lacks() {
    for dt in [0.001, 1.0 / 60.0] {
        let undamped = Setup {
            grip: APART,
            spring_damping: 0.0,
            ..SETUP
        };
        let off = unbalanced(undamped, dt);
        assert!(off < 1e-4, "undamped, dt {dt}: {off}");
    }
}

#[test]
fn the_torque_is_what_the_angular_momentum_lacks() {
    // A tool that turns where it is: about its position.
    let mut held = Held::new(Setup { substeps: 40, ..SETUP });
    let about = GRIP.as_dvec3();
    let weight = GRAVITY.as_dvec3() * held.mass();
    let dt = 0.01;
    for step in 1..=40 {
        let spin = Some(turned(0.01 * step as f32));
        held.world.set_pose(held.tool, GRIP, spin).expect("a pose");
        let before = body(&held.world, held.body);
        let (l, from) = (angular_momentum(before, NODE_MASS, about), centre(before));
        let mut middle = from;
        held.world.step(dt as f32).expect("a step");
        let after = body(&held.world, held.body);
        middle = (middle + centre(after)) / 2.0 - about;
        let [force, torque] = held.wrench();
        let turning = angular_momentum(after, NODE_MASS, about) - l - (middle.cross(weight) - torque) * dt;
        // The middle goes on a curve: the weight's own part is known to some per cent of its way in a step.
        let way = centre(after).distance(from);
        let most = (2e-4 * 0.05 * force.length() + 0.05 * way * weight.length()) * dt;
        assert!(turning.length() < most, "step {step}: {} of {most}", turning.length());
    }
}

#[test]
fn what_damps_held_nodes_is_felt() {
    for solver in SOLVERS {
        let mut held = Held::new(Setup {
            solver,
            drag: 20.0,
            gravity: Vec3::ZERO,
            ..SETUP
        });
        for &id in &held.ids {
            held.world.release(id).expect("held");
        }
        held.nodes = (0..body(&held.world, held.body).node_count() as u32).collect();
        held.attach(0.0);
        let velocity = Vec3::new(0.3, 0.2, -0.1);
        for step in 1..=4 {
            let place = GRIP + velocity * (step as f32 * 0.01);
            held.world.set_pose(held.tool, place, None).expect("a pose");
            held.world.step(0.01).expect("a step");
        }
        let drag = velocity.as_dvec3() * (-20.0 * held.mass());
        let [force, _] = held.wrench();
        assert!(
            force.distance(drag) < 2e-4 * drag.length(),
            "{solver:?}: {force} N of {drag} N"
        );
    }
}

#[test]
fn a_grasp_slips_in_the_step_that_is_too_much() {
    for solver in SOLVERS {
        // One node holds all.
        let mut held = Held::loose(Setup {
            solver,
            drag: 30.0,
            gravity: Vec3::Y * -9.81,
            ..SETUP
        });
        let top = held.nodes[held.nodes.len() / 2];
        let weight = held.mass() as f32 * 9.81;
        let strong = held.world.attach_node(held.body, top, held.tool, 1.01 * weight);
        let strong = strong.expect("an attachment");
        let report = held.world.rest_state(held.body, &Default::default());
        report.expect("a state of rest");
        for _ in 0..50 {
            held.world.step(0.01).expect("a step");
            assert!(held.world.slipped().is_empty());
        }
        let force = held.world.attachment_force(strong).expect("held");
        assert!((force.length() / weight - 1.0).abs() < 1e-3, "{solver:?}: {force} N");
        // Up, faster and faster.
        let mut rise = 0.0;
        let slipped = (1..100).find(|&step| {
            let before = body(&held.world, held.body).positions()[top as usize];
            rise += 2e-5 * step as f32;
            let place = GRIP + Vec3::Y * rise;
            held.world.set_pose(held.tool, place, None).expect("a pose");
            held.world.step(0.01).expect("a step");
            // In that step it is still led, and its force is still part of the wrench.
            let led = body(&held.world, held.body).positions()[top as usize].y - before.y;
            assert!((led - 2e-5 * step as f32).abs() < 1e-7, "{solver:?}");
            let felt = held.wrench()[0].length() as f32;
            let is_over = felt > 1.01 * weight;
            assert_eq!(is_over, !held.world.slipped().is_empty(), "{solver:?}: {felt} N");
            is_over
        });
        let slipped = slipped.expect("it slips");
        assert_eq!(held.world.slipped(), [strong]);
        assert!(matches!(held.world.attachment_force(strong), Err(Error::StaleId(_))));
        assert!(matches!(held.world.release(strong), Err(Error::StaleId(_))));
        // It goes on as it was led.
        let speed = body(&held.world, held.body).velocities()[top as usize].y;
        let led = 2e-3 * slipped as f32;
        assert!(
            (speed - led).abs() < 1e-4 * led + 1e-5,
            "{solver:?}: {speed} of {led} m/s"
        );
        held.world.step(0.01).expect("a step");
        assert!(held.world.slipped().is_empty());
        assert_eq!(held.wrench(), [DVec3::ZERO; 2]);
    }
}

/// A cloth between two tools that go apart; with node numbers that attach where its short sides are.
fn stretched(solver: Solver, width: u32) -> (World, BodyId, [ToolId; 2], Vec<AttachmentId>) {
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
        // A capsule along the side, through the nodes that it holds.
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
        let (mut world, cloth, jaws, ids) = stretched(solver, 4);
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
        let off = force.as_dvec3().distance(weight);
        assert!(off < 1e-3 * weight.length(), "{solver:?}: {force} N");
        // It hangs evenly: the weight acts below the middle between the jaws.
        let arm = DVec3::new(-0.3, 0.0, 0.2);
        let expected = arm.cross(weight);
        assert!(
            torque.as_dvec3().distance(expected) < 1e-3 * expected.length(),
            "{solver:?}: {torque} N m of {expected}"
        );
        // Each by hand.
        let by_hand: DVec3 = jaws
            .iter()
            .map(|&jaw| {
                let (force, torque) = world.wrench(jaw).expect("a tool");
                let arm = world.pose(jaw).expect("a tool").position.as_dvec3() - DVec3::new(0.3, 0.1, -0.2);
                torque.as_dvec3() + arm.cross(force.as_dvec3())
            })
            .sum();
        assert!(torque.as_dvec3().distance(by_hand) < 1e-6);
        // Let go on one side it swings from the other.
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
fn what_is_held_does_not_touch_its_holder() {
    for solver in SOLVERS {
        // Jaws about their nodes, at rest: any contact would push.
        let (mut world, cloth, jaws, _) = stretched(solver, 4);
        world.set_gravity(Vec3::ZERO).expect("a gravity");
        let before = body(&world, cloth).positions().to_vec();
        for _ in 0..20 {
            world.step(0.01).expect("a step");
        }
        for jaw in jaws {
            let (force, torque) = world.wrench(jaw).expect("a tool");
            // Springs have what rounding makes of coordinates of 0.1 m: some 1e-8 m.
            assert!(
                force.length() < 1e-5 && torque.length() < 1e-7,
                "{solver:?}: {force} N, {torque} N m"
            );
        }
        let moved = body(&world, cloth).positions().iter().zip(&before);
        let moved = moved.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(moved < 1e-7, "{solver:?}: {moved} m");
        // What it does not hold it touches, and another tool touches all.
        let other = sphere(&mut world, 0.004, Vec3::new(0.1, 0.003, 0.0));
        world.step(0.01).expect("a step");
        let pushed = world.wrench(other).expect("a tool").0;
        // The nodes there are held, and take what the other does.
        assert!(pushed.y >= 0.0);
        let middle = sphere(&mut world, 0.004, Vec3::new(0.0, 0.008, 0.0));
        let mut felt = 0.0_f32;
        for step in 1..=10 {
            let place = Vec3::new(0.0, 0.008 - 0.002 * step as f32, 0.0);
            world.set_pose(middle, place, None).expect("a pose");
            world.step(0.01).expect("a step");
            felt = felt.max(world.wrench(middle).expect("a tool").0.y);
        }
        assert!(felt > 1e-3, "{solver:?}: {felt} N");
    }
}

#[test]
fn a_holder_still_touches_what_it_does_not_hold() {
    // A ball that holds a corner of a cloth and is put to its middle.
    let mut world = world(Vec3::ZERO);
    let cloth = Tissue::CALM.put(&mut world, &square(0.2, 10));
    pin_all(&mut world, cloth, &[10, 110, 120]);
    let ball = sphere(&mut world, 0.01, Vec3::new(-0.1, 0.02, -0.1));
    world.attach_node(cloth, 0, ball, 0.0).expect("an attachment");
    let mut deepest = 0.0_f64;
    for step in 1..=40 {
        let part = step as f32 / 40.0;
        let place = Vec3::new(-0.1, 0.03, -0.1).lerp(Vec3::new(0.0, -0.03, 0.0), part);
        world.set_pose(ball, place, None).expect("a pose");
        world.step(0.01).expect("a step");
        let at = place.as_dvec3();
        let body = body(&world, cloth);
        let held = |triangle: &[u32; 3]| triangle.contains(&0);
        let free = body.surface().iter().filter(|triangle| !held(triangle));
        let nearest = free
            .map(|&triangle| point_to_triangle(at, corners(body, triangle)))
            .fold(f64::INFINITY, f64::min);
        deepest = deepest.max(0.01 - nearest);
    }
    assert!(deepest < 1e-4, "{deepest} m deep");
}

#[test]
fn let_go_it_moves_as_if_it_had_been_pinned() {
    for solver in SOLVERS {
        let run = |attached: bool| {
            let mut held = Held::loose(Setup {
                solver,
                grip: APART,
                ..SETUP
            });
            if attached {
                held.attach(0.0);
            } else {
                pin_all(&mut held.world, held.body, &held.nodes);
            }
            let first: Vec<Vec3> = body(&held.world, held.body).positions().to_vec();
            let velocity = Vec3::new(0.2, 0.3, -0.1);
            for step in 1..=8 {
                let by = velocity * (0.01 * step as f32);
                if attached {
                    held.world.set_pose(held.tool, APART + by, None).expect("a pose");
                } else {
                    for &node in &held.nodes {
                        let body = held.world.body_mut(held.body).expect("a body");
                        body.move_pin(node, first[node as usize] + by).expect("a pin");
                    }
                }
                held.world.step(0.01).expect("a step");
            }
            for (index, &node) in held.nodes.iter().enumerate() {
                if attached {
                    held.world.release(held.ids[index]).expect("held");
                } else {
                    let body = held.world.body_mut(held.body).expect("a body");
                    body.unpin(node).expect("a pin");
                }
            }
            for _ in 0..8 {
                held.world.step(0.01).expect("a step");
            }
            body(&held.world, held.body).positions().to_vec()
        };
        let (attached, pinned) = (run(true), run(false));
        let off = attached.iter().zip(&pinned).map(|(a, b)| a.distance(*b));
        let off = off.fold(0.0, f32::max);
        assert!(off < 2e-6, "{solver:?}: {off} m");
    }
}

#[test]
fn surface_points_are_where_the_tool_has_them() {
    for solver in SOLVERS {
        let mut held = Held::loose(Setup {
            solver,
            gravity: Vec3::Y * -9.81,
            drag: 20.0,
            ..SETUP
        });
        let surface = body(&held.world, held.body).surface().to_vec();
        let above = |triangle: &[u32; 3]| triangle.iter().all(|corner| held.nodes.contains(corner));
        let triangles: Vec<u32> = (0..)
            .zip(&surface)
            .filter(|(_, it)| above(it))
            .map(|(it, _)| it)
            .collect();
        assert!(triangles.len() > 3);
        // Within, on an edge, and in a corner; some corners are those of several.
        let weights = [[0.2, 0.3, 0.5], [0.6, 0.0, 0.4], [0.0, 1.0, 0.0], [0.5, 0.25, 0.25]];
        let points: Vec<SurfacePoint> = triangles
            .iter()
            .zip(weights)
            .map(|(&triangle, weights)| SurfacePoint { triangle, weights })
            .collect();
        let at = |held: &Held| -> Vec<DVec3> {
            let body = body(&held.world, held.body);
            let place = |point: &SurfacePoint| {
                let corners = corners(body, surface[point.triangle as usize]);
                let parts = corners.iter().zip(point.weights);
                parts.map(|(corner, weight)| *corner * f64::from(weight)).sum()
            };
            points.iter().map(place).collect()
        };
        let first = at(&held);
        let turn = |held: &Held| {
            held.world
                .pose(held.tool)
                .expect("a tool")
                .orientation
                .as_dquat()
                .normalize()
        };
        let start = turn(&held);
        let attached = held.world.attach_points(held.body, &points, held.tool, 0.0);
        held.ids = attached.expect("attachments");
        let mut time = 0.0;
        for dt in [0.002, 1.0 / 60.0, 0.05, 0.003] {
            time += dt;
            held.world
                .set_pose(held.tool, way(time), Some(turned(time)))
                .expect("a pose");
            held.world.step(dt).expect("a step");
            let there =
                |first: &DVec3| way(time).as_dvec3() + turn(&held) * (start.conjugate() * (*first - GRIP.as_dvec3()));
            for (now, first) in at(&held).iter().zip(&first) {
                let off = now.distance(there(first));
                assert!(off < 1e-6 * 0.08, "{solver:?}: {off} m");
            }
            // Each has its share of what holds the corners.
            let forces = held
                .ids
                .iter()
                .map(|&id| held.world.attachment_force(id).expect("held").as_dvec3());
            let (sum, size) = forces.fold((DVec3::ZERO, 0.0), |(sum, size), force| {
                (sum + force, size + force.length())
            });
            assert!((sum + held.wrench()[0]).length() < 1e-5 * size, "{solver:?}: {sum} N");
        }
        // One is let go: what it shares with others stays held, and all go in the end.
        let mut free = 0;
        for (index, &id) in held.ids.iter().enumerate() {
            held.world.release(id).expect("held");
            let others: Vec<u32> = points[index + 1..]
                .iter()
                .flat_map(|point| surface[point.triangle as usize].into_iter().zip(point.weights))
                .filter(|(_, weight)| *weight > 0.0)
                .map(|(corner, _)| corner)
                .collect();
            for corner in surface[points[index].triangle as usize] {
                let there = held.world.body_mut(held.body).expect("a body");
                let is_held = there.pin(corner).is_err();
                assert_eq!(
                    is_held,
                    others.contains(&corner),
                    "{solver:?}: corner {corner} after {index}"
                );
                if !is_held {
                    there.unpin(corner).expect("a pin");
                    free += 1;
                }
            }
        }
        assert!(free > 4);
    }
}

#[test]
fn a_grip_shared_by_two_slips_in_parts() {
    // A node held twice: each has half, and the weaker one leaves the whole to the other.
    let mut held = Held::loose(Setup {
        drag: 30.0,
        gravity: Vec3::Y * -9.81,
        ..SETUP
    });
    let weight = held.mass() as f32 * 9.81;
    let top = held.nodes[held.nodes.len() / 2];
    let [weak, strong] = [0.4, 2.0].map(|part| {
        let attached = held.world.attach_node(held.body, top, held.tool, part * weight);
        attached.expect("an attachment")
    });
    let report = held.world.rest_state(held.body, &Default::default());
    report.expect("a state of rest");
    for id in [weak, strong] {
        let force = held.world.attachment_force(id).expect("held");
        assert!((force.y / weight - 0.5).abs() < 1e-3, "{force} N of {weight} N");
    }
    held.world.step(0.01).expect("a step");
    assert_eq!(held.world.slipped(), [weak]);
    held.world.step(0.01).expect("a step");
    assert!(held.world.slipped().is_empty());
    let force = held.world.attachment_force(strong).expect("held");
    assert!((force.y / weight - 1.0).abs() < 1e-2, "{force} N of {weight} N");
}

#[test]
fn a_refused_step_changes_nothing_and_a_pose_can_be_taken_back() {
    let mut held = Held::new(Setup { substeps: 4, ..SETUP });
    let pose = |held: &mut Held, place: Vec3| {
        let turn = Some(turned(0.01));
        held.world.set_pose(held.tool, place, turn).expect("a pose");
    };
    pose(&mut held, GRIP + Vec3::Y * 0.001);
    held.world.step(0.004).expect("a step");
    let mut twin = Held::new(Setup { substeps: 4, ..SETUP });
    pose(&mut twin, GRIP + Vec3::Y * 0.001);
    twin.world.step(0.004).expect("a step");
    assert_eq!(held.world.state_hash(), twin.world.state_hash());
    pose(&mut held, GRIP + Vec3::Y * 2.0);
    let before = held.world.state_hash();
    assert!(matches!(held.world.step(1.0), Err(Error::Unstable { .. })));
    assert_eq!(held.world.state_hash(), before);
    pose(&mut held, GRIP + Vec3::Y * 0.002);
    pose(&mut twin, GRIP + Vec3::Y * 0.002);
    for _ in 0..5 {
        held.world.step(0.004).expect("a step");
        twin.world.step(0.004).expect("a step");
    }
    assert_eq!(held.world.state_hash(), twin.world.state_hash());
    assert!(held.off() < 1e-7);
}

#[test]
fn the_state_hash_knows_what_is_held() {
    let hash = |limit: Option<f32>, nodes: usize| {
        let mut held = Held::loose(SETUP);
        held.nodes.truncate(nodes);
        if let Some(limit) = limit {
            held.attach(limit);
        } else {
            pin_all(&mut held.world, held.body, &held.nodes);
        }
        held.world.state_hash()
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
    // Let go, nothing is left of it.
    let mut held = Held::loose(SETUP);
    let loose = held.world.state_hash();
    held.attach(0.0);
    for id in held.ids {
        held.world.release(id).expect("held");
    }
    assert_eq!(held.world.state_hash(), loose);
}

#[test]
fn threads_give_the_same_bits() {
    // A body that all threads share, and two that are shared among them.
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
fn positions_that_are_set_are_where_it_is_held() {
    for solver in SOLVERS {
        let mut held = Held::new(Setup { solver, ..SETUP });
        held.world.step(0.01).expect("a step");
        let aside = Vec3::new(0.01, -0.02, 0.03);
        let put: Vec<Vec3> = body(&held.world, held.body)
            .positions()
            .iter()
            .map(|x| *x + aside)
            .collect();
        let there = held.world.body_mut(held.body).expect("a body");
        there.set_positions(&put).expect("positions");
        for _ in 0..3 {
            held.world.step(0.01).expect("a step");
        }
        for &node in &held.nodes {
            let now = body(&held.world, held.body).positions()[node as usize];
            assert!(now.distance(put[node as usize]) < 1e-7, "{solver:?}: {now}");
        }
        let turn = Quat::from_rotation_y(0.4);
        held.world
            .set_pose(held.tool, GRIP, Some(turn * turned(0.0)))
            .expect("a pose");
        held.world.step(0.01).expect("a step");
        for &node in &held.nodes {
            let now = body(&held.world, held.body).positions()[node as usize];
            let there = GRIP + turn * (put[node as usize] - GRIP);
            assert!(now.distance(there) < 1e-7, "{solver:?}: {now}");
        }
    }
}

#[test]
fn a_body_that_was_put_back_is_led_to_its_holder_again() {
    let mut held = Held::new(SETUP);
    held.world.step(0.01).expect("a step");
    let heavy = Vec3::splat(3e38);
    let free = (0..).find(|node| !held.nodes.contains(node)).expect("a free node");
    let pushed = held.world.body_mut(held.body).expect("a body");
    pushed.apply_force(free, heavy).expect("a force");
    held.world
        .set_pose(held.tool, GRIP + Vec3::X * 0.005, None)
        .expect("a pose");
    let report = held.world.step(0.01).expect("a step");
    assert_eq!(report.bodies_restored, 1);
    assert!((held.off() - 0.005).abs() < 1e-7);
    held.world.step(0.01).expect("a step");
    assert!(held.off() < 1e-7);
}

#[test]
fn an_attachment_ends_with_its_tool_and_its_body() {
    let mut held = Held::new(SETUP);
    let twin = Held::loose(SETUP);
    held.world.destroy_tool(held.tool).expect("a tool");
    for &id in &held.ids {
        assert!(matches!(held.world.attachment_force(id), Err(Error::StaleId(_))));
    }
    let mut twin = twin;
    twin.world.destroy_tool(twin.tool).expect("a tool");
    assert_eq!(held.world.state_hash(), twin.world.state_hash());
    for &node in &held.nodes {
        let there = held.world.body_mut(held.body).expect("a body");
        there.pin(node).expect("it is free");
    }

    let mut held = Held::new(SETUP);
    held.world.destroy_body(held.body).expect("a body");
    for &id in &held.ids {
        assert!(matches!(held.world.release(id), Err(Error::StaleId(_))));
    }
    held.world.step(0.01).expect("a step");
    assert_eq!(held.wrench(), [DVec3::ZERO; 2]);
}

#[test]
fn what_cannot_be_held_is_refused() {
    let mut held = Held::new(SETUP);
    let free: Vec<u32> = (0..body(&held.world, held.body).node_count() as u32)
        .filter(|node| !held.nodes.contains(node))
        .collect();
    let there = held.world.body_mut(held.body).expect("a body");
    there.pin(free[0]).expect("a pin");
    there.pin_axes(free[1], [true, false, false]).expect("a pin");
    let before = held.world.state_hash();
    let taken = held.nodes[0];
    for (nodes, limit, word) in [
        (vec![free[2], 100_000], 0.0, "nodes[1]"),
        (vec![free[2], free[0]], 0.0, "nodes[1]"),
        (vec![free[1]], 0.0, "nodes[0]"),
        (vec![free[2]], -1.0, "force_limit"),
        (vec![free[2]], f32::NAN, "force_limit"),
    ] {
        match held.world.attach_nodes(held.body, &nodes, held.tool, limit) {
            Err(Error::InvalidArgument(message)) => assert!(message.contains(word), "{message}"),
            other => panic!("{nodes:?}: {other:?}"),
        }
    }
    let there = held.world.body_mut(held.body).expect("a body");
    for refused in [
        there.pin(taken),
        there.pin_axes(taken, [false, true, false]),
        there.unpin(taken),
        there.move_pin(taken, Vec3::ZERO),
        there.pin_force(taken).map(drop),
    ] {
        assert!(matches!(refused, Err(Error::InvalidArgument(_))), "{refused:?}");
    }
    let other = sphere(&mut held.world, 0.001, Vec3::Y);
    let before = (held.world.state_hash(), before).0;
    let refused = held.world.attach_nodes(held.body, &[free[2], taken], other, 0.0);
    assert!(matches!(refused, Err(Error::InvalidArgument(_))), "{refused:?}");
    let refused = held.world.wrench_about(&[held.tool, held.tool], Vec3::ZERO);
    assert!(matches!(refused, Err(Error::InvalidArgument(_))), "{refused:?}");
    assert_eq!(held.world.state_hash(), before);
}

/// Of a node held by a whole grasp and by a point with next to no part in it, the point is left.
#[test]
fn what_is_left_of_a_shared_grip_has_all_of_the_force() {
    for weight in [1e-8, 1e-30, f32::from_bits(1)] {
        let mut held = Held::loose(SETUP);
        let surface = body(&held.world, held.body).surface();
        let triangle = (0..).zip(surface).find(|(_, corners)| corners.contains(&held.nodes[0]));
        let (triangle, &corners) = triangle.expect("a triangle");
        let mut weights = [0.5; 3];
        let corner = corners.iter().position(|&node| node == held.nodes[0]);
        weights[corner.expect("its corner")] = weight;
        let node = held.world.attach_node(held.body, held.nodes[0], held.tool, 0.0);
        let node = node.expect("an attachment");
        let point = SurfacePoint { triangle, weights };
        let attached = held.world.attach_points(held.body, &[point], held.tool, 1e6);
        let attached = attached.expect("attachments");
        held.world.step(0.004).expect("a step");
        held.world.release(node).expect("held");
        held.world.step(0.004).expect("a step");
        assert_eq!(held.world.slipped(), []);
        let force = held.world.attachment_force(attached[0]).expect("held").as_dvec3();
        let [wrench, _] = held.wrench();
        assert!(force.length() > 0.01, "{weight}: {force} N");
        let off = (force + wrench).length() / wrench.length();
        assert!(off < 1e-6, "{weight}: {force} N of {wrench} N");
    }
}

/// Whatever came and went before, and in what order: what is held in the end counts.
#[test]
fn what_was_let_go_leaves_no_trace() {
    let mut random = Random::new(12);
    for round in 0..6 {
        let mut held = Held::loose(SETUP);
        let node_count = body(&held.world, held.body).node_count();
        let nodes: Vec<u32> = (0..node_count as u32).collect();
        let other = sphere(&mut held.world, 0.004, APART + Vec3::X);
        // Every node goes to one of the tools; some twice.
        let mut of_other = Vec::new();
        let mut of_tool = Vec::new();
        for batch in 0..8 {
            let mut more: Vec<u32> = (0..12).map(|_| nodes[random.below(nodes.len())]).collect();
            more.retain(|node| node % 5 == 0 || batch % 2 == 0);
            let (theirs, ours): (Vec<u32>, Vec<u32>) = more.iter().partition(|&&node| node % 5 == 0);
            of_other.extend(held.world.attach_nodes(held.body, &theirs, other, 0.0).expect("fit"));
            let ids = held.world.attach_nodes(held.body, &ours, held.tool, 0.0).expect("fit");
            of_tool.extend(ours.into_iter().zip(ids));
            for _ in 0..batch / 2 {
                if !of_tool.is_empty() {
                    let (_, id) = of_tool.swap_remove(random.below(of_tool.len()));
                    held.world.release(id).expect("held");
                    assert!(matches!(held.world.release(id), Err(Error::StaleId(_))));
                }
            }
        }
        if round % 2 == 0 {
            held.world.destroy_tool(other).expect("a tool");
            assert!(of_other.iter().all(|&id| held.world.attachment_force(id).is_err()));
        } else {
            of_other
                .into_iter()
                .for_each(|id| held.world.release(id).expect("held"));
        }
        let mut fresh = Held::loose(SETUP);
        of_tool.sort_unstable_by_key(|(node, _)| *node);
        let last: Vec<u32> = of_tool.iter().map(|(node, _)| *node).collect();
        assert!(last.len() > 8);
        let ids = fresh
            .world
            .attach_nodes(fresh.body, &last, fresh.tool, 0.0)
            .expect("fit");
        for step in 1..=5 {
            let time = 0.003 * step as f32;
            for held in [&mut held, &mut fresh] {
                held.world
                    .set_pose(held.tool, way(time), Some(turned(time)))
                    .expect("a pose");
                held.world.step(0.003).expect("a step");
            }
            let places = [&held, &fresh].map(|held| body(&held.world, held.body).positions().to_vec());
            assert!(places[0] == places[1], "round {round}, step {step}");
        }
        for ((node, id), fresh_id) in of_tool.into_iter().zip(ids) {
            let [force, alone] = [held.world.attachment_force(id), fresh.world.attachment_force(fresh_id)];
            let (force, alone) = (force.expect("held"), alone.expect("held"));
            assert!(
                force == alone && force.length() > 0.0,
                "node {node}: {force} N for {alone} N"
            );
        }
    }
}
