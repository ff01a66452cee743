//! Tissue against tissue, and against itself.

#[path = "support/tissue.rs"]
mod tissue;

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, BodyId, Solver, Values, World};
use tissue::*;

/// What each surface keeps off, m.
const THICKNESS: f32 = 0.5e-3;

const CONTACT: BodyContact = BodyContact {
    thickness: THICKNESS,
    friction: 0.0,
    with_bodies: true,
    ..BodyContact::NOTHING
};

/// A block that is damped along its springs alone.
fn block(world: &mut World, at: Vec3, size: f32, cells: u32, solver: Solver, contact: BodyContact) -> BodyId {
    let mesh = moved(Mesh::block([size; 3], [cells; 3]).expect("a block"), at);
    put(world, &mesh, 0.05, 60.0, 0.05, solver, contact)
}

fn put(
    world: &mut World,
    mesh: &Mesh,
    mass: f32,
    stiffness: f32,
    damping: f32,
    solver: Solver,
    contact: BodyContact,
) -> BodyId {
    world
        .create_body(&BodyDefinition {
            positions: &mesh.positions,
            masses: Values::Uniform(mass / mesh.positions.len() as f32),
            stiffnesses: Values::Uniform(stiffness),
            spring_dampings: Values::Uniform(damping),
            triangles: &mesh.triangles,
            tetrahedra: &mesh.tetrahedra,
            solver,
            contact,
            ..Default::default()
        })
        .expect("a body")
}

#[test]
fn two_blocks_that_meet_keep_their_momentum_and_bounce() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut world = world(Vec3::ZERO);
        let size = 0.04;
        let left = block(&mut world, Vec3::new(-0.03, 0.0, 0.0), size, 4, solver, CONTACT);
        let right = block(&mut world, Vec3::new(0.03, 0.003, 0.002), size, 4, solver, CONTACT);
        let count = body(&world, left).node_count();
        for (id, speed) in [(left, 0.5), (right, -0.5)] {
            let velocities = vec![Vec3::new(speed, 0.0, 0.0); count];
            world
                .body_mut(id)
                .expect("a body")
                .set_velocities(&velocities)
                .expect("velocities");
        }
        let node_mass = 0.05 / count as f32;
        let total = |world: &World| momentum(body(world, left), node_mass) + momentum(body(world, right), node_mass);
        let mut closest = f64::INFINITY;
        for _ in 0..400 {
            world.step(1e-3).expect("a step");
            let gap = body(&world, right)
                .positions()
                .iter()
                .map(|p| f64::from(p.x))
                .fold(f64::INFINITY, f64::min)
                - body(&world, left)
                    .positions()
                    .iter()
                    .map(|p| f64::from(p.x))
                    .fold(f64::NEG_INFINITY, f64::max);
            closest = closest.min(gap);
        }
        let [l, r] = [left, right].map(|id| momentum(body(&world, id), node_mass));
        println!(
            "{solver:?}: momentum {:?}, left {l}, right {r}, closest {closest}",
            total(&world)
        );
    }
}

#[test]
fn a_block_rests_on_another() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        for dt in [1e-3_f32, 1.0 / 60.0] {
            let mut world = world(Vec3::new(0.0, -9.81, 0.0));
            let size = 0.04;
            let below = block(&mut world, Vec3::ZERO, 0.06, 4, solver, CONTACT);
            let pinned: Vec<u32> = (0..)
                .zip(body(&world, below).positions())
                .filter(|(_, p)| p.y < -0.029)
                .map(|(node, _)| node)
                .collect();
            pin_all(&mut world, below, &pinned);
            let above = block(
                &mut world,
                Vec3::new(0.004, 0.0525, 0.003),
                size,
                4,
                solver,
                BodyContact {
                    friction: 0.5,
                    ..CONTACT
                },
            );
            let start = std::time::Instant::now();
            let steps = (1.5 / dt) as u32;
            let mut noise: f64 = 0.0;
            for step in 0..steps {
                world.step(dt).expect("a step");
                if step > steps - 20 {
                    let held = pin_forces(&world, below, &pinned).y;
                    noise = noise.max((held - 0.981).abs());
                }
            }
            let held: DVec3 = pin_forces(&world, below, &pinned);
            let fastest = [below, above].map(|id| {
                body(&world, id)
                    .velocities()
                    .iter()
                    .fold(0.0_f32, |a, v| a.max(v.length()))
            });
            let lowest = body(&world, above)
                .positions()
                .iter()
                .map(|p| p.y)
                .fold(f32::INFINITY, f32::min);
            println!(
                "{solver:?} {dt}: pins hold {held} of 0.981, noise {noise:.2e}, speeds {fastest:?}, lowest {lowest}, {:.2} s",
                start.elapsed().as_secs_f64()
            );
        }
    }
}
