//! Tools that are closed meshes, found in each of the three ways.

#[path = "support/solid.rs"]
mod solid;
#[path = "support/tissue.rs"]
mod tissue;

use glam::{Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, Detection, Pose, Shape, Solver, ToolDefinition, Values, WorldDefinition, World};
use solid::{Solid, real};
use tissue::*;

/// What a cloth keeps off, m.
const THICKNESS: f32 = 0.2e-3;

fn drape(detection: Detection, solver: Solver) {
    let Some(stomach) = real("stomach.stl", 1e-3) else {
        return;
    };
    let bounds = stomach.positions.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| [low.min(*p), high.max(*p)]);
    let centre = 0.5 * (bounds[0] + bounds[1]);
    let top = bounds[1].y;
    let cells = 24;
    let mut cloth = moved(square(0.09, cells), Vec3::new(centre.x, top + 0.005, centre.z));
    cloth.tetrahedra.clear();
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let mass = 0.02 / cloth.positions.len() as f32;
    let body = world.create_body(&BodyDefinition {
        positions: &cloth.positions,
        masses: Values::Uniform(mass),
        node_dampings: Values::Uniform(8.0 * mass),
        stiffnesses: Values::Uniform(30.0),
        spring_dampings: Values::Uniform(0.01),
        triangles: &cloth.triangles,
        contact: BodyContact { thickness: THICKNESS, ..Default::default() },
        solver,
        ..Default::default()
    }).expect("a cloth");
    let organ = world.create_tool(&ToolDefinition {
        detection,
        friction: 0.6,
        ..ToolDefinition::new(Shape::Mesh { positions: &stomach.positions, triangles: &stomach.triangles })
    }).expect("a tool");
    let start = std::time::Instant::now();
    for step in 0..1500 {
        let report = world.step(1e-3).expect("a step");
        assert_eq!(report.bodies_restored, 0);
        if step % 250 == 249 {
            let (force, _) = world.wrench(organ).expect("a tool");
            let solid = Solid::new(&stomach, Pose::IDENTITY);
            let held = tissue::body(&world, body);
            let distances: Vec<f64> = held.positions().iter().map(|p| solid.signed_distance(p.as_dvec3())).collect();
            let inside = distances.iter().filter(|d| **d < 0.0).count();
            let deepest = distances.iter().fold(0.0_f64, |a, b| a.min(*b));
            let mut lying = vec![false; distances.len()];
            for contact in world.contacts(organ).expect("contacts") { for (k, n) in contact.nodes.into_iter().enumerate() { if contact.weights[k] > 0.0 { lying[n as usize] = true; } } }
            let highest = distances.iter().zip(&lying).filter(|(_, l)| **l).fold(0.0_f64, |a, (d, _)| a.max(*d));
            let speed = held.velocities().iter().fold(0.0_f32, |a, v| a.max(v.length()));
            println!("{detection:?} {solver:?} t {step}: {} substeps, inside {inside}, deepest {deepest:.2e}, lying {} highest {highest:.2e}, force {force:.5} of {:.5}, speed {speed:.2e}, {:.2} s",
                report.substeps, lying.iter().filter(|l| **l).count(), 0.02*9.81, start.elapsed().as_secs_f64());
        }
    }
    let _ = (Quat::IDENTITY, Mesh::default());
}

#[test]
fn a_cloth_lies_on_an_organ_seen_in_images() {
    drape(Detection::ImageSpace, Solver::Verlet);
}
