//! Embeddings: binding a fine render surface, reading it, and filling it with tetrahedra. Throughput is in vertices.

use std::collections::HashMap;
use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Quat, Vec3};
use sinew::mesh::{Mesh, boundary};
use sinew::{BodyDefinition, BodyId, Embedding, EmbeddingDefinition, Values, World, WorldDefinition};

/// A liver-like organ of about 5000 nodes.
fn organ() -> Mesh {
    Mesh::organ(0.2, 0.005).expect("an organ")
}

/// The organ's surface, with each triangle subdivided into four `times` times.
fn render_surface(organ: &Mesh, times: u32) -> Mesh {
    let mut positions = organ.positions.clone();
    let mut triangles = boundary(&organ.tetrahedra).expect("a boundary");
    for _ in 0..times {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[a, b]| {
                *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    positions.push((positions[a as usize] + positions[b as usize]) / 2.0);
                    positions.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    let mesh = Mesh {
        positions,
        triangles,
        ..Mesh::default()
    };
    // Removes the interior nodes.
    sinew::mesh::tidy(&mesh).expect("a mesh").mesh
}

fn bound(organ: &Mesh, render_surface: &Mesh) -> (World, BodyId, Embedding) {
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let body = world
        .create_body(&BodyDefinition {
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(50.0),
            ..BodyDefinition::of(organ)
        })
        .expect("a body");
    let definition = EmbeddingDefinition {
        vertices: &render_surface.positions,
        triangles: &render_surface.triangles,
        tetrahedra: &organ.tetrahedra,
    };
    let embedding = world.create_embedding(body, &definition).expect("an embedding");
    (world, body, embedding)
}

fn read(criterion: &mut Criterion) {
    let organ = organ();
    let mut group = criterion.benchmark_group("embedding");
    for times in [1, 3] {
        let render_surface = render_surface(&organ, times);
        let count = render_surface.positions.len();
        let (mut world, body, mut embedding) = bound(&organ, &render_surface);
        // A pose other than that at rest.
        let turn = Quat::from_rotation_x(0.3);
        let moved: Vec<Vec3> = organ.positions.iter().map(|&position| turn * position).collect();
        let host = world.body_mut(body).expect("the body");
        host.set_positions(&moved).expect("positions");
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::new("positions", count), |bench| {
            bench.iter(|| {
                embedding.update(&world).expect("an update");
                black_box(embedding.positions());
            });
        });
        group.bench_function(BenchmarkId::new("positions and normals", count), |bench| {
            bench.iter(|| {
                embedding.update(&world).expect("an update");
                black_box(embedding.normals());
            });
        });
        // The least memory traffic: bindings in, positions out.
        let from = vec![[0_u32; 7]; count];
        let mut to = vec![Vec3::ZERO; count];
        group.bench_function(BenchmarkId::new("as many bytes", count), |bench| {
            bench.iter(|| {
                for (to, from) in to.iter_mut().zip(black_box(&from)) {
                    let sum = from.iter().fold(0_u32, |sum, value| sum ^ value);
                    *to = Vec3::splat(f32::from_bits(sum));
                }
                black_box(&to);
            });
        });
    }
    group.finish();
}

fn make(criterion: &mut Criterion) {
    let organ = organ();
    let mut group = criterion.benchmark_group("embedding made");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    for times in [1, 3] {
        let render_surface = render_surface(&organ, times);
        group.throughput(Throughput::Elements(render_surface.positions.len() as u64));
        group.bench_function(BenchmarkId::new("bound", render_surface.positions.len()), |bench| {
            bench.iter(|| black_box(bound(&organ, &render_surface)));
        });
        for spacing in [0.02, 0.008] {
            let name = format!("filled at {} mm", 1e3 * spacing);
            group.bench_function(BenchmarkId::new(name, render_surface.positions.len()), |bench| {
                bench.iter(|| black_box(Mesh::filled(&render_surface, spacing).expect("a mesh")));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, read, make);
criterion_main!(benches);
