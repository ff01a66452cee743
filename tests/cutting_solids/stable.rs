//! Cuts hardly shorten substeps: no copy of a node has more stiffness per mass than the nodes around it had.

use std::f32::consts::TAU;

use glam::{Quat, Vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Material, Model, Values};

use crate::support::kept::kept;
use crate::support::random::Random;
use crate::support::tissue::world;

#[test]
fn hundreds_of_cuts_of_elements_keep_the_substep() {
    let (stable, first) = least_substep_while_cutting(Model::Tetrahedra);
    assert!(stable > 0.999 * first, "{stable} of {first} s");
}

/// The bound for springs includes the masses at both ends: a copy beside a lighter one has a higher bound than before.
#[test]
fn hundreds_of_cuts_of_springs_leave_more_than_half_of_a_substep() {
    let (stable, first) = least_substep_while_cutting(Model::Springs);
    assert!(stable > 0.7 * first, "{stable} of {first} s");
}

/// Returns the shortest stable substep while an organ of this model is cut, and the one before cutting (s).
fn least_substep_while_cutting(model: Model) -> (f32, f32) {
    let organ = Mesh::organ(0.12, 0.006).unwrap();
    let mut world = world(Vec3::ZERO);
    let body = world
        .create_body(&BodyDefinition {
            positions: &organ.positions,
            tetrahedra: &organ.tetrahedra,
            masses: Values::Uniform(1e-4),
            // Added mass would hide the effect of a cut.
            mass_scaling: 0.0,
            spare_nodes: 60_000,
            stiffnesses: Values::Uniform(0.0),
            material: Some(Material {
                model,
                young_modulus: 3000.0,
                poisson_ratio: if model == Model::Springs { 0.25 } else { 0.3 },
                ..Default::default()
            }),
            ..Default::default()
        })
        .unwrap();
    let whole = kept(&world, body).mass;
    let first = world.step(1e-5).unwrap().stable_substep;
    let mut least = first;
    let mut random = Random(12345);
    for cut in 0..400 {
        let at = organ.positions[(random.next() * organ.positions.len() as f64) as usize];
        let turn = Quat::from_rotation_y(random.between(0.0, TAU)) * Quat::from_rotation_z(random.between(0.0, TAU));
        let edge = |x: f32| [-0.005, 0.005].map(|z| at + turn * Vec3::new(x, 0.0, z));
        let (start, end) = (edge(-0.005), edge(0.005));
        world.cut(body, &Sweep { start, end }).unwrap();
        if cut % 10 == 9 {
            least = least.min(world.step(1e-5).unwrap().stable_substep);
        }
    }
    let now = kept(&world, body).mass;
    assert!((now / whole - 1.0).abs() < 1e-6, "{now} of {whole} kg");
    let nodes = world.body(body).unwrap().positions().len();
    assert!(nodes > 2 * organ.positions.len(), "{nodes} nodes");
    (least, first)
}
