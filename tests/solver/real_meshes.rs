//! Real organs with all defaults: no step is refused where thin elements are stretched until they are many times
//! stiffer.

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, BodyId, Material, Model, Shape, ToolDefinition, World, WorldDefinition};

use crate::support::solid::real;

fn world_of(mesh: &Mesh, model: Model, young_modulus: f32, volume_stiffness: f32) -> (World, BodyId) {
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let body = world.create_body(&BodyDefinition {
        positions: &mesh.positions,
        tetrahedra: &mesh.tetrahedra,
        material: Some(Material {
            model,
            young_modulus,
            poisson_ratio: if model == Model::Springs { 0.25 } else { 0.3 },
            density: 1000.0,
            ..Material::default()
        }),
        volume_stiffness,
        ..Default::default()
    });
    (world, body.expect("a body"))
}

/// Takes this many steps and checks each: nothing is refused, the added mass stays below the body's mass, and nodes
/// stay within bounds.
fn take_steps(world: &mut World, body: BodyId, steps: usize, dt: f32) {
    let masses: f64 = {
        let body = world.body(body).expect("a body");
        (0..body.node_count() as u32)
            .map(|node| f64::from(body.node_mass(node).expect("a mass")))
            .sum()
    };
    for step in 0..steps {
        let report = world.step(dt).unwrap_or_else(|error| panic!("step {step}: {error}"));
        assert_eq!(report.bodies_restored, 0, "step {step}");
        let body = world.body(body).expect("a body");
        let added = body.solver_report().added_mass;
        assert!((0.0..=masses).contains(&added), "step {step}: {added} kg of {masses}");
        assert!(
            body.positions()
                .iter()
                .all(|position| position.abs().max_element() < 1.0)
        );
    }
}

#[test]
fn a_gallbladder_falls_on_a_plane() {
    let Some(mut mesh) = real("gallbladder_volumetric.vtk", 1e-3) else {
        return;
    };
    let low = mesh
        .positions
        .iter()
        .map(|position| position.y)
        .fold(f32::MAX, f32::min);
    mesh.positions
        .iter_mut()
        .for_each(|position| *position += Vec3::Y * (0.05 - low));
    let (mut world, body) = world_of(&mesh, Model::Springs, 6000.0, 3000.0);
    world.create_tool(&ToolDefinition::new(Shape::Plane)).expect("a plane");
    take_steps(&mut world, body, 60, 1.0 / 60.0);
}

/// Lets a stomach that is held at its top hang for this many steps.
fn hang_stomach(model: Model, young_modulus: f32, volume_stiffness: f32, steps: usize, dt: f32) {
    let Some(mesh) = real("stomach.msh", 1e-3) else {
        return;
    };
    let (mut world, body) = world_of(&mesh, model, young_modulus, volume_stiffness);
    let top = mesh
        .positions
        .iter()
        .map(|position| position.y)
        .fold(f32::MIN, f32::max);
    for (node, _) in (0..)
        .zip(&mesh.positions)
        .filter(|(_, position)| position.y > top - 0.01)
    {
        world.body_mut(body).expect("a body").pin(node).expect("a pin");
    }
    take_steps(&mut world, body, steps, dt);
}

/// It was refused at 0.17 s.
#[test]
#[ignore = "long"]
fn a_stomach_of_springs_hangs() {
    hang_stomach(Model::Springs, 1900.0, 950.0, 14, 1.0 / 60.0);
}

/// It was refused at 0.5 s.
#[test]
#[ignore = "long"]
fn a_stomach_of_elements_hangs() {
    hang_stomach(Model::Tetrahedra, 5000.0, 0.0, 17, 1.0 / 30.0);
}
