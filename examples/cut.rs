//! A blade cuts a sheet that is fixed at two sides in two.
//!
//! `cargo run --release --example cut`
//!
//! ```text
//! blade [mm]  force [N]  nodes  pieces
//!        -60      0.000    441       1
//!        -40      0.010    455       1
//!        -20      0.010    491       1
//!          0      0.010    527       1
//!         20      0.010    563       1
//!         40      0.010    599       1
//!         60      0.000    623       2
//! ```
#![allow(clippy::print_stdout)]

use glam::{Vec3, vec3};
use sinew::mesh::Mesh;
use sinew::{BladeDefinition, BodyDefinition, Result, Values, World, WorldDefinition};

/// Side length of the sheet [m].
const SIZE: f32 = 0.1;

fn main() -> Result<()> {
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })?;
    let mesh = Mesh::cloth([SIZE, SIZE], [20, 20])?;
    let sheet = world.create_body(&BodyDefinition {
        masses: Values::Uniform(1e-5),
        stiffnesses: Values::Uniform(20.0),
        node_dampings: Values::Uniform(1e-5),
        // Capacity for the nodes that the cut adds, and the resistance to cutting [J/m].
        spare_nodes: 1000,
        toughness: 0.01,
        ..BodyDefinition::of(&mesh)
    })?;
    // The left and the right side are pinned.
    let [low, high] = [vec3(-1.0, -1.0, -1.0), vec3(1.0, 1.0, 1.0)];
    let body = world.body_mut(sheet)?;
    body.pin_box(low, high.with_x(-0.49 * SIZE))?;
    body.pin_box(low.with_x(0.49 * SIZE), high)?;

    // A vertical edge behind the sheet, which moves through it.
    let mut blade = BladeDefinition::new([0.06 * Vec3::NEG_Y, 0.06 * Vec3::Y]);
    blade.pose.position = vec3(0.003, 0.0, -0.06);
    let blade = world.create_blade(&blade)?;

    println!("blade [mm]  force [N]  nodes  pieces");
    for frame in 0..=24 {
        let position = vec3(0.003, 0.0, -0.06 + 0.005 * frame as f32);
        world.set_blade_pose(blade, position, None)?;
        world.step(1.0 / 60.0)?;
        if frame % 4 == 0 {
            let force = world.blade_report(blade)?.force.length();
            let body = world.body(sheet)?;
            let pieces = body.pieces()?.count;
            println!(
                "{:10.0}  {force:9.3}  {:5}  {pieces:6}",
                1e3 * position.z,
                body.node_count()
            );
        }
    }
    Ok(())
}
