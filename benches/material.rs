//! What a material and the terms beside springs cost: the time of a substep of VERLET, and of a frame of IMPLICIT, of one organ as plain springs, as springs from
//! Young's modulus, and as finite elements. Throughput is tetrahedra per second; the springs of the plain body are those of the
//! tetrahedra's edges.
#![allow(clippy::print_stderr)]

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use sinew::mesh::{Mesh, MeshFormat, load};
use sinew::{BodyDefinition, Material, Model, Solver, SpringLaw, Values, World, WorldDefinition};

const SUBSTEPS: u32 = 8;

/// Short enough for every body here, s.
const SUBSTEP: f32 = 1e-5;

/// A stomach where there is one, else a filled organ of as many nodes.
fn organ() -> Mesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/meshes/stomach.msh");
    match load(&path, MeshFormat::Auto, 1e-3) {
        Ok(loaded) => loaded.mesh,
        Err(_) => Mesh::organ(0.2, 0.006).expect("an organ"),
    }
}

/// Its boundary.
fn surface(mesh: &Mesh) -> Vec<[u32; 3]> {
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let body = world.create_body(&BodyDefinition {
        positions: &mesh.positions,
        tetrahedra: &mesh.tetrahedra,
        masses: Values::Uniform(1.0),
        ..BodyDefinition::default()
    });
    let body = world.body(body.expect("a body")).expect("the body");
    body.surface().to_vec()
}

fn bench(criterion: &mut Criterion) {
    let mesh = organ();
    eprintln!("{} nodes, {} tetrahedra", mesh.positions.len(), mesh.tetrahedra.len());
    let tissue = |model, poisson_ratio| Material {
        model,
        young_modulus: 5000.0,
        poisson_ratio,
        density: 1060.0,
        ..Material::default()
    };
    let plain = BodyDefinition {
        positions: &mesh.positions,
        tetrahedra: &mesh.tetrahedra,
        ..BodyDefinition::default()
    };
    let springs = BodyDefinition {
        masses: Values::Uniform(1e-5),
        stiffnesses: Values::Uniform(10.0),
        ..plain
    };
    let surface = surface(&mesh);
    let directions = vec![Vec3::X; mesh.tetrahedra.len()];
    let bodies = [
        ("plain springs", springs),
        (
            "with home springs",
            BodyDefinition {
                home_stiffnesses: Values::Uniform(1.0),
                ..springs
            },
        ),
        (
            "with bending of the surface",
            BodyDefinition {
                triangles: &surface,
                bending_stiffness: 1e-6,
                ..springs
            },
        ),
        (
            "with pressure inside",
            BodyDefinition {
                enclosed_stiffness: 1000.0,
                pressure: 10.0,
                ..springs
            },
        ),
        (
            "with springs that stiffen",
            BodyDefinition {
                spring_law: SpringLaw::Exponential {
                    steepness: 10.0,
                    limit: 0.2,
                },
                ..springs
            },
        ),
        (
            "with fibres",
            BodyDefinition {
                fibre_directions: &directions,
                fibre_stiffnesses: Values::Uniform(1000.0),
                ..springs
            },
        ),
        (
            "springs from E",
            BodyDefinition {
                material: Some(tissue(Model::Springs, 0.0)),
                ..plain
            },
        ),
        (
            "tetrahedra",
            BodyDefinition {
                material: Some(tissue(Model::Tetrahedra, 0.3)),
                ..plain
            },
        ),
        (
            "tetrahedra, nu 0.45",
            BodyDefinition {
                material: Some(tissue(Model::Tetrahedra, 0.45)),
                ..plain
            },
        ),
    ];
    for (solver, substeps, dt, name) in [
        (
            Solver::Verlet,
            SUBSTEPS,
            SUBSTEP * SUBSTEPS as f32,
            "substeps of VERLET",
        ),
        (Solver::Implicit, 0, 1.0 / 60.0, "a frame of IMPLICIT"),
    ] {
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Elements(
            u64::from(substeps.max(1)) * mesh.tetrahedra.len() as u64,
        ));
        for (name, body) in &bodies {
            let mut world = World::new(WorldDefinition {
                substeps,
                gravity: Vec3::ZERO,
                ..WorldDefinition::default()
            })
            .expect("a world");
            world.create_body(&BodyDefinition { solver, ..*body }).expect("a body");
            group.bench_function(*name, |bencher| {
                bencher.iter(|| black_box(world.step(dt)).expect("a step"))
            });
        }
        group.finish();
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_secs(2));
    targets = bench
}
criterion_main!(benches);
