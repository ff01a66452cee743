//! IMPLICIT bodies that press each other: their equations know of it, and nothing else comes of it.

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

const MEETS: BodyContact = BodyContact {
    with_bodies: true,
    ..BodyContact::NOTHING
};

/// A world with gravity and a floor.
fn floor() -> World {
    let mut world = world(Vec3::Y * -9.81);
    world.create_tool(&ToolDefinition::new(Shape::Plane)).expect("a floor");
    world
}

/// A block of soft tetrahedra; mirrored: upside down, so that two of them are each other's images, its elements and triangles inside out.
fn block(
    world: &mut World,
    (solver, stiffness): (Solver, f32),
    height: f32,
    mirrored: bool,
    damping: f32,
) -> (BodyId, Mesh) {
    let mut mesh = Mesh::block(SIZE, CELLS).expect("a block");
    if mirrored {
        mesh.positions.iter_mut().for_each(|place| place.y = -place.y);
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
            contact: MEETS,
            ..BodyDefinition::of(&mesh)
        })
        .expect("a body");
    (id, mesh)
}

/// Two blocks between pinned plates that come 4 mm closer than the blocks are high, and apart again: what the lower plate feels then, N.
fn pressed(of: (Solver, f32), dt: f32) -> [f64; 2] {
    let mut world = world(Vec3::ZERO);
    let damping = 30.0 * (of.1 / SOFT).sqrt();
    let (lower, below) = block(&mut world, of, -0.5 * SIZE[1], false, damping);
    let (upper, above) = block(&mut world, of, 0.5 * SIZE[1] + 2e-4, true, damping);
    let ground = nodes_at(&below, |place| place.y < -0.999 * SIZE[1]);
    let plate = nodes_at(&above, |place| place.y > SIZE[1] + 1.9e-4);
    pin_all(&mut world, lower, &ground);
    pin_all(&mut world, upper, &plate);
    let lead = |world: &mut World, seconds: f32, from: f32, to: f32| {
        let steps = (seconds / dt) as usize;
        for step in 1..=steps {
            let way = from + (to - from) * step as f32 / steps as f32;
            for &node in &plate {
                let place = above.positions[node as usize] - Vec3::Y * way;
                world
                    .body_mut(upper)
                    .expect("a body")
                    .move_pin(node, place)
                    .expect("a pin");
            }
            world.step(dt).expect("a step");
        }
    };
    lead(&mut world, 0.6, 0.0, 4.2e-3);
    lead(&mut world, 0.6, 4.2e-3, 4.2e-3);
    let together = pin_forces(&world, lower, &ground).y;
    lead(&mut world, 0.2, 4.2e-3, -5e-3);
    lead(&mut world, 0.6, -5e-3, -5e-3);
    [together, pin_forces(&world, lower, &ground).y]
}

#[test]
fn tissue_pressed_on_tissue_bears_what_it_should() {
    tissue_pressed_on_tissue_bears_what_it_should_of(&[(Solver::Implicit, 2.5e5, FRAME)]);
}

#[test]
#[ignore = "long"]
fn tissue_pressed_on_tissue_bears_what_it_should_in_the_other_cases() {
    tissue_pressed_on_tissue_bears_what_it_should_of(&[
        (Solver::Verlet, SOFT, FRAME),
        (Solver::Implicit, SOFT, FRAME),
        (Solver::Implicit, SOFT, 4e-3),
        (Solver::Implicit, 6e4, FRAME),
        (Solver::Implicit, 2.5e6, FRAME),
        (Solver::Newton, SOFT, FRAME),
        (Solver::Newton, 2.5e5, FRAME),
    ]);
}

fn tissue_pressed_on_tissue_bears_what_it_should_of(cases: &[(Solver, f32, f32)]) {
    // Of two mirrored blocks each bears what one does against a smooth plane: from finite elements in double precision, N.
    const RIGHT: f64 = 1.3394;
    for &(solver, stiffness, dt) in cases {
        let [together, apart] = pressed((solver, stiffness), dt).map(|force| force / f64::from(stiffness / SOFT));
        let off = together.abs() / RIGHT - 1.0;
        assert!(off.abs() < 0.005, "{solver:?}, {stiffness} Pa, {dt} s: {together} N");
        assert!(
            apart.abs() < 1e-3 * RIGHT,
            "{solver:?}, {stiffness} Pa, {dt} s: {apart} N once apart"
        );
    }
}

#[test]
fn bodies_that_collide_with_implicit_ones_keep_their_momentum_and_gain_no_energy() {
    for (of, below) in [
        ((Solver::Implicit, SOFT), SOFT),
        ((Solver::Verlet, SOFT), SOFT),
        ((Solver::Implicit, 2.5e6), 2.5e6),
        ((Solver::Verlet, 2.5e5), 2.5e5),
        ((Solver::Implicit, SOFT), 5e6),
        ((Solver::Implicit, 5e6), SOFT),
    ] {
        collide(of, below);
    }
}

fn collide(of: (Solver, f32), below: f32) {
    let mut world = world(Vec3::ZERO);
    let (lower, mesh) = block(&mut world, (Solver::Implicit, below), -0.5 * SIZE[1] - 1e-3, false, 0.0);
    let (upper, _) = block(&mut world, of, 0.5 * SIZE[1] + 1e-3, true, 0.0);
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
        let (now, left) = all(&world);
        let lost = (now - start).length() / start.length();
        assert!(
            lost < 1e-4,
            "{of:?} on {below} Pa, frame {frame}: {lost} of the momentum"
        );
        assert!(
            left < 1.001 * energy,
            "{of:?} on {below} Pa, frame {frame}: {left} J of {energy} J"
        );
    }
    assert!(
        kinetic(&world, upper) > 0.1 * energy,
        "{of:?} on {below} Pa: it never touched"
    );
}

#[test]
fn implicit_bodies_that_lie_on_each_other_stay_calm() {
    implicit_bodies_that_lie_on_each_other_stay_calm_of(150);
}

#[test]
#[ignore = "long"]
fn implicit_bodies_that_lie_on_each_other_stay_calm_for_long() {
    implicit_bodies_that_lie_on_each_other_stay_calm_of(300);
}

fn implicit_bodies_that_lie_on_each_other_stay_calm_of(frames: usize) {
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

/// Where contacts of a corner with faces, or of a long edge with short ones, took turns, the block was never at rest. Every node is seen as fast as
/// it goes: over a step the two differ by no more than a node that swings gains in half of it.
#[test]
fn a_sheet_over_the_corners_of_an_implicit_block_does_not_tremble() {
    a_sheet_over_the_corners_of_an_implicit_block_does_not_tremble_of(150);
}

#[test]
#[ignore = "long"]
fn a_sheet_over_the_corners_of_an_implicit_block_does_not_tremble_for_long() {
    a_sheet_over_the_corners_of_an_implicit_block_does_not_tremble_of(240);
}

fn a_sheet_over_the_corners_of_an_implicit_block_does_not_tremble_of(frames: usize) {
    let mut world = floor();
    let block = moved(Mesh::block([1.0; 3], [2; 3]).expect("a block"), Vec3::Y * 0.6);
    let cloth = moved(Mesh::cloth([1.8; 2], [15; 2]).expect("a cloth"), Vec3::Y * 1.25);
    let contact = |thickness| BodyContact {
        thickness,
        friction: 0.7,
        ..MEETS
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
    let places = |world: &World, id| body(world, id).positions().to_vec();
    for frame in 0..frames {
        let before = ids.map(|id| places(&world, id));
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
                let off = (*velocity - (*now - *before) / FRAME).length();
                assert!(
                    off < 5e-3,
                    "frame {frame}, node {node} of {id:?}: {velocity} m/s, off by {off}"
                );
            }
        }
    }
}
