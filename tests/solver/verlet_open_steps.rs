//! A step defers its closing half kick to the next step. Callers must not notice: whatever happens between steps,
//! bodies move as leapfrog in `f64` with every step closed. Reads and refused steps change nothing.

use crate::support::bodies::{FREE, Parts, Random, Scene, largest_difference};
use crate::support::reference::Reference;
use glam::Vec3;
use sinew::{Error, Shape, ToolDefinition, WorldDefinition};

const HELD: u32 = 5;

fn scene(parts: &Parts, substeps: u32) -> Scene {
    Scene::new(
        parts,
        WorldDefinition {
            gravity: Vec3::new(0.0, -9.0, 0.0),
            substeps,
            ..FREE
        },
    )
}

/// A block with varying masses, springs and dampings.
fn uneven(random: &mut Random, damping: f32) -> Parts {
    let mut parts = Parts::block([4, 3, 2], 0.05, 0.01, 40.0);
    for (mass, node_damping) in parts.masses.iter_mut().zip(&mut parts.node_dampings) {
        *mass *= 1.0 + 0.5 * random.signed();
        *node_damping = damping * (1.0 + 0.5 * random.signed());
    }
    for position in &mut parts.positions {
        *position += 0.004 * random.vector();
    }
    parts
}

/// Steps the reference in the same way as `scene`, and returns the mean force on [`HELD`] (N).
fn step_reference(reference: &mut Reference, mass: f64, dt: f32, substeps: u32) -> glam::DVec3 {
    let h = f64::from(dt) / f64::from(substeps);
    let mut holding = glam::DVec3::ZERO;
    let mut feel = |reference: &Reference| {
        holding -= 0.5 * (reference.forces()[HELD as usize] + reference.gravity * mass);
    };
    for _ in 0..substeps {
        feel(reference);
        reference.step(h);
        feel(reference);
    }
    reference.applied.fill(glam::DVec3::ZERO);
    holding / f64::from(substeps)
}

#[test]
fn changes_between_steps_act_on_closed_velocities() {
    for (substeps, damping) in [(1, 0.0), (3, 0.0), (1, 0.02), (3, 0.5)] {
        let mut random = Random::new(70);
        let parts = uneven(&mut random, damping);
        let mut scene = scene(&parts, substeps);
        let mut reference = parts.reference(scene.world.gravity());
        let nodes = parts.positions.len();
        let held = HELD as usize;
        let mass = reference.masses[held];
        let mut is_held = false;
        let mut dt = 1e-3;
        let mut last = 0;
        for step in 0..400 {
            let named = format!("{substeps} substeps, damping {damping}, step {step}, after {last}");
            let body = scene.world.body_mut(scene.id).expect("the body");
            let node = random.below(nodes);
            last = random.below(14);
            match last {
                0 => dt = 1e-3 + 9e-4 * random.signed(),
                1 => {
                    let gravity = 9.0 * random.vector();
                    scene.world.set_gravity(gravity).expect("gravity");
                    reference.gravity = gravity.as_dvec3();
                }
                2 => {
                    let force = 0.5 * random.vector();
                    body.apply_force(node as u32, force).expect("a force");
                    if reference.masses[node] > 0.0 {
                        reference.applied[node] = force.as_dvec3();
                    }
                }
                3 => {
                    let pair = reference.springs.swap_remove(random.below(reference.springs.len())).0;
                    body.remove_spring(pair[1], pair[0]).expect("a spring");
                }
                4 => {
                    let (a, b) = (node, (node + 1 + random.below(nodes - 1)) % nodes);
                    if body.add_spring(a as u32, b as u32, 3.0, Some(0.1)).is_ok() {
                        reference.springs.push(([a as u32, b as u32], 3.0, f64::from(0.1_f32)));
                    }
                }
                5 => {
                    is_held = !is_held;
                    reference.masses[held] = if is_held { 0.0 } else { mass };
                    if is_held {
                        body.pin(HELD).expect("a pin");
                        reference.velocities[held] = glam::DVec3::ZERO;
                    } else {
                        body.unpin(HELD).expect("a pin");
                    }
                }
                6 => {
                    let velocities: Vec<Vec3> = (0..nodes).map(|_| 0.3 * random.vector()).collect();
                    body.set_velocities(&velocities).expect("velocities");
                    for (node, velocity) in velocities.iter().enumerate() {
                        if reference.masses[node] > 0.0 {
                            reference.velocities[node] = velocity.as_dvec3();
                        }
                    }
                }
                7 => {
                    let positions: Vec<Vec3> = body.positions().iter().map(|&p| 0.99 * p).collect();
                    body.set_positions(&positions).expect("positions");
                    reference.positions = positions.iter().map(|p| p.as_dvec3()).collect();
                }
                _ => {}
            }
            assert_eq!(scene.step(dt).substeps, substeps);
            let holding = step_reference(&mut reference, mass, dt, substeps);
            if random.below(2) == 0 {
                let error = largest_difference(&scene.velocities(), &reference.velocities);
                assert!(error < 2e-4, "{named}: velocities {error:e} m/s");
            }
            let error = largest_difference(&scene.positions(), &reference.positions);
            assert!(error < 5e-6, "{named}: positions {error:e} m");
            if is_held {
                let force = scene.body().pin_force(HELD).expect("a pin").as_dvec3();
                assert!(force.distance(holding) < 1e-3, "{named}: {force} N, {holding} N");
            }
            // Rounding errors must not add up over all these steps.
            reference.positions = scene.positions();
            reference.velocities = scene.velocities();
        }
    }
}

#[test]
fn edits_keep_the_velocities_that_were_read() {
    for damping in [0.0, 0.05, 5.0] {
        let mut random = Random::new(71);
        let mut scene = scene(&uneven(&mut random, damping), 1);
        for _ in 0..30 {
            scene.step(1e-3);
            let before = scene.velocities();
            let pairs = scene.body().spring_pairs().expect("pairs");
            let [a, b] = pairs[random.below(pairs.len())];
            scene.body_mut().remove_spring(a, b).expect("a spring");
            scene.body_mut().add_spring(0, 59, 50.0, Some(0.01)).expect("a spring");
            let difference = largest_difference(&before, &scene.velocities());
            assert!(difference < 3e-6, "damping {damping}: {difference:e} m/s");
            scene.body_mut().remove_spring(0, 59).expect("a spring");
        }
    }
}

#[test]
fn reading_changes_nothing() {
    let mut random = Random::new(72);
    let parts = uneven(&mut random, 0.02);
    let [mut silent, mut read] = [scene(&parts, 1), scene(&parts, 1)];
    for _ in 0..20 {
        silent.step(1e-3);
        read.step(1e-3);
        let first = read.velocities();
        assert!(read.energy().is_finite());
        assert_eq!(first, read.velocities());
        assert_eq!(silent.world.state_hash(), read.world.state_hash());
    }
    assert_eq!(silent.velocities(), read.velocities());
}

#[test]
fn a_refused_step_leaves_an_open_body_unchanged() {
    let mut random = Random::new(73);
    let parts = uneven(&mut random, 0.02);
    let definition = WorldDefinition {
        max_substeps: 3,
        ..FREE
    };
    let [mut plain, mut refused] = [Scene::new(&parts, definition), Scene::new(&parts, definition)];
    for _ in 0..10 {
        plain.step(2e-3);
        refused.step(2e-3);
        let hash = refused.world.state_hash();
        assert!(matches!(refused.world.step(1.0), Err(Error::Unstable { .. })));
        assert_eq!(refused.world.state_hash(), hash);
        assert_eq!(refused.velocities(), plain.velocities());
    }
    assert_eq!(refused.world.state_hash(), plain.world.state_hash());
}

#[test]
fn steps_are_closed_while_a_tool_is_near() {
    let parts = Parts::block([4, 4, 1], 0.02, 1e-3, 20.0);
    let [mut alone, mut touched] = [scene(&parts, 2), scene(&parts, 2)];
    let far = Vec3::new(-0.1, 0.0, 0.0);
    let mut definition = ToolDefinition::new(Shape::Sphere { radius: 0.005 });
    definition.pose.position = far;
    let tool = touched.world.create_tool(&definition).expect("a tool");
    for _ in 0..5 {
        alone.step(1e-3);
        touched.step(1e-3);
        assert_eq!(alone.velocities(), touched.velocities());
    }
    // Beside the body, at a distance of 0.5 mm, without contact.
    for step in 0..110 {
        let distance = 0.1 - 0.001 * (step as f32).min(94.5);
        let beside = touched.positions()[0].as_vec3() - distance * Vec3::X;
        touched.world.set_pose(tool, beside, None).expect("a pose");
        alone.step(1e-3);
        touched.step(1e-3);
    }
    // The results differ by rounding.
    assert_ne!(alone.velocities(), touched.velocities());
    let difference = largest_difference(&alone.velocities(), &touched.velocities());
    assert!(difference < 1e-5, "{difference:e} m/s");
}
