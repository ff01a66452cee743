//! Contact between IMPLICIT bodies: forces match theory, and neither energy nor trembling results.

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, BodyId, Material, Model, Shape, Solver, ToolDefinition, Values, World};

use crate::support::hanging::nodes_at;
use crate::support::tissue::{body, kinetic, momentum, moved, pin_all, pin_forces, total_energy, world};

const FRAME: f32 = 1.0 / 60.0;
const SIZE: [f32; 3] = [0.06, 0.03, 0.06];
const CELLS: [u32; 3] = [6, 3, 6];
/// Pa
const SOFT: f32 = 5400.0;
/// kg/m³
const DENSITY: f32 = 1060.0;

const COLLIDES: BodyContact = BodyContact {
    with_bodies: true,
    ..BodyContact::NOTHING
};

/// Creates a world with gravity and a floor.
fn floor() -> World {
    let mut world = world(Vec3::Y * -9.81);
    world.create_tool(&ToolDefinition::new(Shape::Plane)).expect("a floor");
    world
}

/// Creates a block of soft tetrahedra. A mirrored block is upside down, so that two blocks are mirror images, with
/// inverted elements and triangles.
fn block(
    world: &mut World,
    (solver, stiffness): (Solver, f32),
    height: f32,
    mirrored: bool,
    damping: f32,
) -> (BodyId, Mesh) {
    let mut mesh = Mesh::block(SIZE, CELLS).expect("a block");
    if mirrored {
        mesh.positions.iter_mut().for_each(|position| position.y = -position.y);
    }
    let mesh = moved(mesh, Vec3::Y * height);
    let node_mass = DENSITY * SIZE.iter().product::<f32>() / mesh.positions.len() as f32;
    let id = world
        .create_body(&BodyDefinition {
            masses: Values::Uniform(node_mass),
            node_dampings: Values::Uniform(damping * node_mass),
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: stiffness,
                poisson_ratio: 0.3,
                ..Default::default()
            }),
            solver,
            contact: COLLIDES,
            ..BodyDefinition::of(&mesh)
        })
        .expect("a body");
    (id, mesh)
}

/// Presses two blocks between pinned plates that come 4 mm closer than the blocks are high, then separates them.
/// Returns the force on the lower plate while pressed and afterwards (N).
fn pressed_and_separated(model: (Solver, f32), dt: f32) -> [f64; 2] {
    let mut world = world(Vec3::ZERO);
    let damping = 30.0 * (model.1 / SOFT).sqrt();
    let (lower, below) = block(&mut world, model, -0.5 * SIZE[1], false, damping);
    let (upper, above) = block(&mut world, model, 0.5 * SIZE[1] + 2e-4, true, damping);
    let ground = nodes_at(&below, |position| position.y < -0.999 * SIZE[1]);
    let plate = nodes_at(&above, |position| position.y > SIZE[1] + 1.9e-4);
    pin_all(&mut world, lower, &ground);
    pin_all(&mut world, upper, &plate);
    let move_plate = |world: &mut World, seconds: f32, from: f32, to: f32| {
        let steps = (seconds / dt) as usize;
        for step in 1..=steps {
            let depth = from + (to - from) * step as f32 / steps as f32;
            for &node in &plate {
                let position = above.positions[node as usize] - Vec3::Y * depth;
                world
                    .body_mut(upper)
                    .expect("a body")
                    .move_pin(node, position)
                    .expect("a pin");
            }
            world.step(dt).expect("a step");
        }
    };
    move_plate(&mut world, 0.6, 0.0, 4.2e-3);
    move_plate(&mut world, 0.6, 4.2e-3, 4.2e-3);
    let together = pin_forces(&world, lower, &ground).y;
    move_plate(&mut world, 0.2, 4.2e-3, -5e-3);
    move_plate(&mut world, 0.6, -5e-3, -5e-3);
    [together, pin_forces(&world, lower, &ground).y]
}

#[test]
fn tissue_pressed_on_tissue_carries_the_expected_force() {
    check_tissue_pressed_on_tissue_carries_the_expected_force(&[(Solver::Implicit, 2.5e5, FRAME)]);
}

#[test]
#[ignore = "long"]
fn tissue_pressed_on_tissue_carries_the_expected_force_in_the_other_cases() {
    check_tissue_pressed_on_tissue_carries_the_expected_force(&[
        (Solver::Verlet, SOFT, FRAME),
        (Solver::Implicit, SOFT, FRAME),
        (Solver::Implicit, SOFT, 4e-3),
        (Solver::Implicit, 6e4, FRAME),
        (Solver::Implicit, 2.5e6, FRAME),
        (Solver::Newton, SOFT, FRAME),
        (Solver::Newton, 2.5e5, FRAME),
    ]);
}

fn check_tissue_pressed_on_tissue_carries_the_expected_force(cases: &[(Solver, f32, f32)]) {
    // Each of two mirrored blocks carries the force of one block on a smooth plane, from finite elements in double
    // precision (N).
    const EXPECTED: f64 = 1.3394;
    for &(solver, stiffness, dt) in cases {
        let [together, apart] =
            pressed_and_separated((solver, stiffness), dt).map(|force| force / f64::from(stiffness / SOFT));
        let error = together.abs() / EXPECTED - 1.0;
        assert!(error.abs() < 0.005, "{solver:?}, {stiffness} Pa, {dt} s: {together} N");
        assert!(
            apart.abs() < 1e-3 * EXPECTED,
            "{solver:?}, {stiffness} Pa, {dt} s: {apart} N once apart"
        );
    }
}

#[test]
fn collisions_with_implicit_bodies_conserve_momentum_and_gain_no_energy() {
    for (model, below) in [
        ((Solver::Implicit, SOFT), SOFT),
        ((Solver::Verlet, SOFT), SOFT),
        ((Solver::Implicit, 2.5e6), 2.5e6),
        ((Solver::Verlet, 2.5e5), 2.5e5),
        ((Solver::Implicit, SOFT), 5e6),
        ((Solver::Implicit, 5e6), SOFT),
    ] {
        collide(model, below);
    }
}

fn collide(model: (Solver, f32), below: f32) {
    let mut world = world(Vec3::ZERO);
    let (lower, mesh) = block(&mut world, (Solver::Implicit, below), -0.5 * SIZE[1] - 1e-3, false, 0.0);
    let (upper, _) = block(&mut world, model, 0.5 * SIZE[1] + 1e-3, true, 0.0);
    let nodes = mesh.positions.len();
    let node_mass = DENSITY * SIZE.iter().product::<f32>() / nodes as f32;
    world
        .body_mut(lower)
        .expect("a body")
        .set_velocities(&vec![Vec3::new(0.05, 0.3, 0.0); nodes])
        .expect("velocities");
    let all = |world: &World| -> (DVec3, f64) {
        let [one, other] = [lower, upper].map(|id| (momentum(body(world, id), node_mass), total_energy(world, id)));
        (one.0 + other.0, one.1 + other.1)
    };
    let (start, energy) = all(&world);
    for frame in 0..60 {
        world.step(FRAME).expect("a step");
        let (now, remaining) = all(&world);
        let lost = (now - start).length() / start.length();
        assert!(
            lost < 1e-4,
            "{model:?} on {below} Pa, frame {frame}: {lost} of the momentum"
        );
        assert!(
            remaining < 1.001 * energy,
            "{model:?} on {below} Pa, frame {frame}: {remaining} J of {energy} J"
        );
    }
    assert!(
        kinetic(&world, upper) > 0.1 * energy,
        "{model:?} on {below} Pa: they never touched"
    );
}

#[test]
fn implicit_bodies_stacked_on_each_other_stay_at_rest() {
    check_implicit_bodies_stacked_on_each_other_stay_at_rest(150);
}

#[test]
#[ignore = "long"]
fn implicit_bodies_stacked_on_each_other_stay_at_rest_for_long() {
    check_implicit_bodies_stacked_on_each_other_stay_at_rest(300);
}

fn check_implicit_bodies_stacked_on_each_other_stay_at_rest(frames: usize) {
    let mut world = floor();
    let (lower, _) = block(&mut world, (Solver::Implicit, SOFT), 0.5 * SIZE[1], false, 2.0);
    let (upper, _) = block(&mut world, (Solver::Implicit, SOFT), 1.5 * SIZE[1], true, 2.0);
    let mass = 2.0 * f64::from(DENSITY * SIZE.iter().product::<f32>());
    for frame in 0..frames {
        world.step(FRAME).expect("a step");
        if frame > 120 {
            let kinetic = kinetic(&world, lower) + kinetic(&world, upper);
            let speed = (2.0 * kinetic / mass).sqrt();
            assert!(speed < 3e-3, "frame {frame}: {speed} m/s");
        }
    }
}

/// Contacts of a corner with faces, or of a long edge with short ones, once alternated, so that the block never came to
/// rest. The velocity of each node is compared with its displacement over the step. They differ by at most the velocity
/// that an oscillating node gains in half a step.
#[test]
fn a_sheet_over_the_corners_of_an_implicit_block_does_not_tremble() {
    check_a_sheet_over_the_corners_of_an_implicit_block_does_not_tremble(150);
}

#[test]
#[ignore = "long"]
fn a_sheet_over_the_corners_of_an_implicit_block_does_not_tremble_for_long() {
    check_a_sheet_over_the_corners_of_an_implicit_block_does_not_tremble(240);
}

fn check_a_sheet_over_the_corners_of_an_implicit_block_does_not_tremble(frames: usize) {
    let mut world = floor();
    let block = moved(Mesh::block([1.0; 3], [2; 3]).expect("a block"), Vec3::Y * 0.6);
    let cloth = moved(Mesh::cloth([1.8; 2], [15; 2]).expect("a cloth"), Vec3::Y * 1.25);
    let contact = |thickness| BodyContact {
        thickness,
        friction: 0.7,
        ..COLLIDES
    };
    let below = BodyDefinition {
        masses: Values::Uniform(0.1),
        node_dampings: Values::Uniform(0.5),
        material: Some(Material {
            model: Model::Tetrahedra,
            young_modulus: 1e4,
            poisson_ratio: 0.3,
            ..Default::default()
        }),
        solver: Solver::Implicit,
        contact: contact(0.08),
        ..BodyDefinition::of(&block)
    };
    let above = BodyDefinition {
        masses: Values::Uniform(0.02),
        node_dampings: Values::Uniform(0.1),
        stiffnesses: Values::Uniform(355.0),
        spring_dampings: Values::Uniform(3.8),
        contact: contact(0.05),
        ..BodyDefinition::of(&cloth)
    };
    let ids = [below, above].map(|definition| world.create_body(&definition).expect("a body"));
    let positions_of = |world: &World, id| body(world, id).positions().to_vec();
    for frame in 0..frames {
        let before = ids.map(|id| positions_of(&world, id));
        world.step(FRAME).expect("a step");
        if frame < 120 {
            continue;
        }
        for (id, before) in ids.into_iter().zip(&before) {
            let it = body(&world, id);
            for (node, (velocity, (now, before))) in it
                .velocities()
                .iter()
                .zip(it.positions().iter().zip(before))
                .enumerate()
            {
                let error = (*velocity - (*now - *before) / FRAME).length();
                assert!(
                    error < 5e-3,
                    "frame {frame}, node {node} of {id:?}: {velocity} m/s, off by {error}"
                );
            }
        }
    }
}
