//! The upper bounds of a cuttable body are known when it is created: no sequence of cuts exceeds them.

use std::ops::Range;

use glam::{Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, BodyId, Error, Material, Model, Values, World, WorldDefinition};

use crate::support::random::Random;

const SPARE: u32 = 400;

fn world(mesh: &Mesh, spare_nodes: u32) -> (World, BodyId) {
    let mut world = World::new(WorldDefinition::default()).unwrap();
    let is_solid = !mesh.tetrahedra.is_empty();
    let body = BodyDefinition {
        masses: Values::Uniform(1e-3),
        stiffnesses: if is_solid {
            Values::Uniform(0.0)
        } else {
            Values::Uniform(20.0)
        },
        material: is_solid.then(|| Material {
            model: Model::Tetrahedra,
            young_modulus: 3000.0,
            poisson_ratio: 0.3,
            ..Material::default()
        }),
        spare_nodes,
        ..BodyDefinition::of(mesh)
    };
    let body = world.create_body(&body).unwrap();
    (world, body)
}

fn end(random: &mut Random, reach: f32) -> Vec3 {
    random.point(-reach, reach)
}

/// A short or long cut of an edge that may pass through the body or end in it, also along faces and through nodes.
fn sweep(random: &mut Random) -> Sweep {
    let reach = random.between(0.02, 0.2);
    let mut ends = [(); 4].map(|()| end(random, reach));
    if random.next() < 0.3 {
        for position in &mut ends {
            *position = (*position / 0.01).round() * 0.01;
        }
    }
    let [a, b, c, d] = ends;
    if random.next() < 0.5 {
        // All the way through, as upright strokes do.
        let (below, above) = (vec3(0.0, -0.3, 0.0), vec3(0.0, 0.3, 0.0));
        return Sweep {
            start: [a + below, a + above],
            end: [b + below, b + above],
        };
    }
    Sweep {
        start: [a, b],
        end: [c, d],
    }
}

#[test]
fn no_cuts_exceed_the_bounds_of_a_body() {
    no_cuts_exceed_the_bounds_of_a_body_of(0..4);
}

#[test]
#[ignore = "long"]
fn no_cuts_exceed_the_bounds_of_a_body_with_other_seeds() {
    no_cuts_exceed_the_bounds_of_a_body_of(4..12);
}

fn no_cuts_exceed_the_bounds_of_a_body_of(seeds: Range<u64>) {
    let sheet = Mesh::cloth([0.1; 2], [10, 10]).unwrap();
    let block = Mesh::block([0.04; 3], [4; 3]).unwrap();
    for (mesh, per_node) in [(&sheet, 2), (&block, 6)] {
        let mut most = 0.0f64;
        let mut refused = 0;
        for seed in seeds.clone() {
            let mut random = Random(77 + seed);
            let (mut world, body) = world(mesh, SPARE);
            let it = world.body(body).unwrap();
            let (nodes, triangles) = (it.node_count(), it.surface().len());
            let bounds = (it.max_nodes(), it.max_triangles());
            assert_eq!(
                bounds,
                (nodes + SPARE as usize, triangles + (per_node * SPARE) as usize)
            );
            for _ in 0..60 {
                match world.cut(body, &sweep(&mut random)) {
                    Ok(_) => {}
                    // The nodes run out first.
                    Err(Error::Capacity(message)) if message.contains("nodes") => refused += 1,
                    Err(other) => panic!("seed {seed}: {other}"),
                }
                let it = world.body(body).unwrap();
                assert_eq!((it.max_nodes(), it.max_triangles()), bounds, "seed {seed}");
                assert!(
                    it.node_count() <= bounds.0 && it.surface().len() <= bounds.1,
                    "seed {seed}"
                );
                if it.node_count() > nodes {
                    let added = (it.surface().len() - triangles) as f64;
                    most = most.max(added / (it.node_count() - nodes) as f64);
                }
            }
        }
        assert!(
            refused > seeds.clone().count(),
            "{refused} cuts needed more than there was"
        );
        assert!(most > 0.2 * f64::from(per_node), "{most}: the bound is far off");
    }
}

#[test]
fn the_bounds_of_an_uncuttable_body_are_its_sizes() {
    let mesh = Mesh::cloth([0.1; 2], [3, 3]).unwrap();
    let (world, body) = world(&mesh, 0);
    let it = world.body(body).unwrap();
    assert_eq!(
        (it.max_nodes(), it.max_triangles()),
        (it.node_count(), it.surface().len())
    );
}
