//! Tissue that other tissue presses against tools.

use crate::support::organ::of_elements;
use crate::support::tissue::moved;
use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyContact, BodyDefinition, BodyId, Shape, Solver, ToolDefinition, ToolId, Values, Viscosity, World,
    WorldDefinition,
};

const GRAVITY: f32 = 9.81;
const SOLVERS: [Solver; 2] = [Solver::Verlet, Solver::Implicit];

fn world_with_plane(friction: f32) -> (World, ToolId) {
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::NEG_Y * GRAVITY,
        max_substeps: 10_000,
        ..Default::default()
    })
    .expect("a world");
    let definition = ToolDefinition {
        friction,
        ..ToolDefinition::new(Shape::Plane)
    };
    let plane = world.create_tool(&definition).expect("a plane");
    (world, plane)
}

/// Creates a soft cube of finite elements, 0.36 m wide, that collides with other bodies.
fn cube(world: &mut World, at: Vec3, solver: Solver, thickness: f32) -> BodyId {
    let mesh = moved(Mesh::block([0.36; 3], [3; 3]).expect("a block"), at);
    let body = BodyDefinition {
        contact: BodyContact {
            thickness,
            with_bodies: true,
            friction: 0.5,
            ..BodyContact::NOTHING
        },
        solver,
        ..of_elements(&mesh, [20e3, 0.3, 500.0])
    };
    world.create_body(&body).expect("a cube")
}

fn lowest(world: &World, bodies: &[BodyId]) -> f32 {
    let all = bodies.iter().map(|&id| world.body(id).expect("a body"));
    let lows = all.map(|body| {
        body.positions()
            .iter()
            .map(|position| position.y)
            .fold(f32::INFINITY, f32::min)
    });
    lows.fold(f32::INFINITY, f32::min)
}

fn momentum(world: &World, bodies: &[BodyId]) -> DVec3 {
    let body_momentum = |&id: &BodyId| {
        let body = world.body(id).expect("a body");
        let nodes = (0..).zip(body.velocities());
        let momenta =
            nodes.map(|(node, velocity)| velocity.as_dvec3() * f64::from(body.node_mass(node).expect("a mass")));
        momenta.sum::<DVec3>()
    };
    bodies.iter().map(body_momentum).sum()
}

/// Three cubes that fall onto each other press the lowest one with many times its weight. Tissue contacts that were
/// solved after tool contacts pushed it 0.1 m through the plane. The wrench of the plane equals the change of the total
/// momentum.
#[test]
fn falling_tissue_does_not_push_other_tissue_through_a_plane() {
    for solver in SOLVERS {
        let (mut world, plane) = world_with_plane(0.5);
        let positions = [0, 1, 2].map(|index| {
            let index = index as f32;
            Vec3::new(0.03 * (index % 2.0), 0.2 + 0.45 * index, 0.02 * index)
        });
        let bodies = positions.map(|position| cube(&mut world, position, solver, 0.02));
        let dt = 1.0 / 60.0;
        let mass = 3.0 * 500.0 * 0.36_f64.powi(3);
        let (mut before, mut largest) = (momentum(&world, &bodies), 0.0_f64);
        for frame in 0..90 {
            world.step(dt).expect("a step");
            let low = lowest(&world, &bodies);
            assert!(
                low >= 0.0199,
                "{solver:?}, frame {frame}: a node is {low} m above the plane of 0.02 m"
            );
            let after = momentum(&world, &bodies);
            let pressed = f64::from(world.wrench(plane).expect("a wrench").0.y) * f64::from(dt);
            // The tool receives the momentum that the tissue loses. IMPLICIT solves its equation to a hundredth, and
            // the residual contains momentum.
            let bound = if solver == Solver::Verlet { 2e-3 } else { 1e-2 };
            let change = after.y - before.y + mass * f64::from(GRAVITY * dt);
            largest = largest.max(change.abs());
            assert!(
                (change + pressed).abs() < bound * largest + 1e-3,
                "{solver:?}, frame {frame}: {change} N s, the plane reports {pressed}"
            );
            before = after;
        }
        assert!(largest > 2.0 * mass * f64::from(GRAVITY * dt), "{solver:?}: no impact");
    }
}

/// A sheet on its edge crumples on a plane. It keeps its thickness off the plane with and without self-contact.
#[test]
fn a_sheet_with_self_contact_stays_off_a_plane() {
    check_a_sheet_with_self_contact_stays_off_a_plane(Solver::Verlet);
}

#[test]
#[ignore = "long"]
fn a_sheet_with_self_contact_stays_off_a_plane_with_implicit() {
    check_a_sheet_with_self_contact_stays_off_a_plane(Solver::Implicit);
}

fn check_a_sheet_with_self_contact_stays_off_a_plane(solver: Solver) {
    const THICKNESS: f32 = 0.01;
    let (mut world, _) = world_with_plane(0.0);
    let mut mesh = Mesh::cloth([1.2; 2], [16; 2]).expect("a cloth");
    for position in &mut mesh.positions {
        *position = Vec3::new(
            position.x,
            position.z + 0.65,
            0.02 * (5.0 * position.z).sin() + 0.01 * (7.0 * position.x).sin(),
        );
    }
    let mass = 0.6 / mesh.positions.len() as f32;
    let body = world
        .create_body(&BodyDefinition {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            masses: Values::Uniform(mass),
            stiffnesses: Values::Uniform(200.0),
            node_dampings: Values::Uniform(mass),
            bending_stiffness: 1e-4,
            contact: BodyContact {
                thickness: THICKNESS,
                with_itself: true,
                friction: 0.5,
                ..BodyContact::NOTHING
            },
            solver,
            ..Default::default()
        })
        .expect("a sheet");
    let mut is_down = false;
    for frame in 0..40 {
        world.step(1.0 / 60.0).expect("a step");
        let low = lowest(&world, &[body]);
        is_down |= low < 1.01 * THICKNESS;
        assert!(
            low > 0.995 * THICKNESS,
            "{solver:?}, frame {frame}: a node is {low} m above the plane"
        );
    }
    assert!(is_down, "{solver:?}: no impact");
}

/// Viscous tissue that is created within the thickness of a plane is moved out. The speed of push-out grew with shorter
/// substeps, which looked like a strain rate that requires shorter substeps, so every step was refused.
#[test]
fn viscous_tissue_is_pushed_out_of_a_tools_thickness() {
    const THICKNESS: f32 = 0.03;
    let (mut world, _) = world_with_plane(0.0);
    let mesh = moved(Mesh::block([1.0; 3], [3; 3]).expect("a block"), Vec3::Y * 0.5);
    let body = world
        .create_body(&BodyDefinition {
            viscosity: Viscosity {
                retardation_time: 0.01,
                ..Viscosity::default()
            },
            contact: BodyContact {
                thickness: THICKNESS,
                ..BodyContact::NOTHING
            },
            ..of_elements(&mesh, [1e4, 0.4, 6.4])
        })
        .expect("a cube");
    for _ in 0..60 {
        world.step(1.0 / 60.0).expect("a step");
    }
    let low = lowest(&world, &[body]);
    assert!((low - THICKNESS).abs() < 0.01 * THICKNESS, "{low} m");
}
