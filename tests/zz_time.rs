#![allow(missing_docs)]
use glam::{Vec3, vec2};
use sinew::*;
use std::time::Instant;
#[test]
fn time() {
    let count = 100;
    let at = |x: usize, y: usize| (y * count + x) as u32;
    let positions: Vec<Vec3> = (0..count * count)
        .map(|node| 0.01 * vec2((node % count) as f32, (node / count) as f32).extend(0.0))
        .collect();
    let mut triangles = Vec::new();
    for y in 0..99 {
        for x in 0..99 {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            triangles.extend(if (x + y) % 2 == 0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            });
        }
    }
    let tearing = Tearing {
        strain: 10.0,
        most_per_step: 1,
        ..Tearing::default()
    };
    for threads in [1, 2] {
        let mut worlds =
            [(0, Tearing::default()), (10_000, Tearing::default()), (10_000, tearing)].map(|(spare, tearing)| {
                let mut world = World::new(WorldDefinition {
                    thread_count: threads,
                    ..Default::default()
                })
                .unwrap();
                world
                    .create_body(&BodyDefinition {
                        positions: &positions,
                        masses: Values::Uniform(1e-4),
                        triangles: &triangles,
                        stiffnesses: Values::Uniform(50.0),
                        spare_nodes: spare,
                        tearing,
                        ..Default::default()
                    })
                    .unwrap();
                world
            });
        let mut least = [f64::INFINITY; 3];
        let mut sub = 0;
        for _ in 0..300 {
            for (world, least) in worlds.iter_mut().zip(&mut least) {
                let start = Instant::now();
                sub = world.step(1e-3).unwrap().substeps;
                *least = least.min(start.elapsed().as_secs_f64());
            }
        }
        let r = worlds[2].bodies().next().unwrap().tear_report();
        assert_eq!(r, TearReport::default());
        println!("{threads} threads, {sub} substeps: {:?} us", least.map(|l| l * 1e6));
    }
}
