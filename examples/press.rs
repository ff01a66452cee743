//! A ball presses a block of tissue and retracts: force against depth.
//!
//! `cargo run --release --example press`
//!
//! ```text
//! depth [mm]  force [N]
//!        0.0       0.00
//!        2.7       0.20
//!        5.3       0.56
//!        8.0       1.04
//!        5.3       0.61
//!        2.7       0.24
//!        0.0       0.01
//! ```
#![allow(clippy::print_stdout)]

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Material, Model, Result, Shape, ToolDefinition, World, WorldDefinition};

const HEIGHT: f32 = 0.04;
const RADIUS: f32 = 0.015;

fn main() -> Result<()> {
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })?;
    let mesh = Mesh::block([0.08, HEIGHT, 0.08], [8, 4, 8])?;
    let body = world.create_body(&BodyDefinition {
        material: Some(Material {
            model: Model::Tetrahedra,
            young_modulus: 5000.0,
            poisson_ratio: 0.45,
            density: 1000.0,
            thickness: 0.0,
        }),
        ..BodyDefinition::of(&mesh)
    })?;
    // The lower side is pinned, as on a table.
    let low = Vec3::new(-1.0, -1.0, -1.0);
    world
        .body_mut(body)?
        .pin_box(low, Vec3::new(1.0, -0.49 * HEIGHT, 1.0))?;

    let touching = Vec3::Y * (0.5 * HEIGHT + RADIUS);
    let mut ball = ToolDefinition::new(Shape::Sphere { radius: RADIUS });
    ball.pose.position = touching;
    let ball = world.create_tool(&ball)?;

    println!("depth [mm]  force [N]");
    for frame in 0..=60 {
        // 8 mm down in half a second, and up again.
        let depth = 0.008 * (1.0 - (frame as f32 / 30.0 - 1.0).abs());
        world.set_pose(ball, touching - depth * Vec3::Y, None)?;
        world.step(1.0 / 60.0)?;
        let (force, _torque) = world.wrench(ball)?;
        if frame % 10 == 0 {
            println!("{:10.1}  {:9.2}", 1e3 * depth, force.y);
        }
    }
    Ok(())
}
