//! A block of 7 x 2.5 x 7 cm with a pinned bottom, in a world without gravity, into which tools press.

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, BodyId, Material, Model, Solver, Values, World, WorldDefinition};

use super::hanging::nodes_at;
use super::tissue::pin_all;

pub const CELL: f32 = 0.005;
const CELLS: [u32; 3] = [14, 5, 14];
/// The height of its upper side (m).
pub const TOP: f32 = 0.5 * CELL * CELLS[1] as f32;

pub const ELEMENTS: Material = Material {
    model: Model::Tetrahedra,
    young_modulus: 10e3,
    poisson_ratio: 0.3,
    density: 1000.0,
    thickness: 0.0,
};

/// Creates the block. `with` completes a definition without material, and takes the mass of each node (kg).
pub fn held_block_with(
    with: impl for<'a> FnOnce(BodyDefinition<'a>, f32) -> BodyDefinition<'a>,
) -> (World, BodyId, Mesh) {
    let size = CELLS.map(|count| count as f32 * CELL);
    let mesh = Mesh::block(size, CELLS).expect("a block");
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        max_substeps: 1000,
        ..Default::default()
    })
    .expect("a world");
    let node_mass = 1000.0 * size.iter().product::<f32>() / mesh.positions.len() as f32;
    let definition = BodyDefinition {
        node_dampings: Values::Uniform(200.0 * node_mass),
        ..BodyDefinition::of(&mesh)
    };
    let body = world.create_body(&with(definition, node_mass)).expect("a body");
    pin_all(&mut world, body, &nodes_at(&mesh, |position| position.y < -0.99 * TOP));
    (world, body, mesh)
}

/// Creates the block from finite elements, or from springs of 50 N/m.
pub fn held_block(elements: bool, solver: Solver) -> (World, BodyId, Mesh) {
    held_block_with(|definition, node_mass| match elements {
        true => BodyDefinition {
            material: Some(ELEMENTS),
            solver,
            ..definition
        },
        false => BodyDefinition {
            masses: Values::Uniform(node_mass),
            stiffnesses: Values::Uniform(50.0),
            solver,
            ..definition
        },
    })
}
