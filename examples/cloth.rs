//! A cloth falls over a ball and comes to rest.
//!
//! `cargo run --release --example cloth`
//!
//! ```text
//! time [s]  mean height [mm]  kinetic energy [mJ]
//!     0.00                 0                  0.0
//!     0.33               -80                  0.7
//!     0.67               -81                  0.0
//!     1.00               -81                  0.0
//!     1.33               -81                  0.0
//!     1.67               -81                  0.0
//!     2.00               -81                  0.0
//! ```
#![allow(clippy::print_stdout)]

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, Result, Shape, ToolDefinition, Values, World, WorldDefinition};

const RADIUS: f32 = 0.08;

fn main() -> Result<()> {
    let mut world = World::new(WorldDefinition::default())?;
    let mesh = Mesh::cloth([0.3, 0.3], [30, 30])?;
    let cloth = world.create_body(&BodyDefinition {
        masses: Values::Uniform(2e-5),
        stiffnesses: Values::Uniform(20.0),
        node_dampings: Values::Uniform(5e-5),
        bending_stiffness: 1e-6,
        contact: BodyContact {
            thickness: 0.002,
            friction: 0.5,
            with_itself: true,
            ..BodyContact::default()
        },
        ..BodyDefinition::of(&mesh)
    })?;
    let mut ball = ToolDefinition::new(Shape::Sphere { radius: RADIUS });
    ball.pose.position = (RADIUS + 0.01) * Vec3::NEG_Y;
    ball.friction = 0.5;
    world.create_tool(&ball)?;

    println!("time [s]  mean height [mm]  kinetic energy [mJ]");
    for frame in 0..=120 {
        if frame % 20 == 0 {
            let body = world.body(cloth)?;
            let heights = body.positions().iter().map(|position| position.y);
            let mean = heights.sum::<f32>() / body.node_count() as f32;
            let kinetic = body.energy(world.gravity()).kinetic;
            println!("{:8.2}  {:16.0}  {:19.1}", world.time(), 1e3 * mean, 1e3 * kinetic);
        }
        world.step(1.0 / 60.0)?;
    }
    Ok(())
}
