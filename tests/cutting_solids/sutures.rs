//! Sutures on an interior surface exposed by a cut.

use glam::{Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::{Anchor, Solver, Storage, SurfacePoint, SutureDefinition};

use super::motion::{CUTS, Matter, edge, in_flight};

/// The two sides of a wound coincide in the rest shape, and sutures stay on their side.
#[test]
fn a_suture_stays_on_its_side_of_a_wound_that_is_cut_again() {
    let (mut world, body) = in_flight(Matter::Springs, Solver::Verlet, Storage::Packed);
    let it = world.body(body).unwrap();
    let depth = [-0.02, 0.06];
    let sweep = Sweep {
        start: edge(it, [-0.02, 0.024], depth),
        end: edge(it, [0.08, 0.027], depth),
    };
    assert_eq!(world.cut(body, &sweep).unwrap().pieces_parted, 1);
    let pieces = world.body(body).unwrap().pieces().unwrap();
    let apart = |piece: u32| vec3(0.0, if piece == pieces.of_nodes[0] { -0.5 } else { 0.5 }, 0.0);
    let velocities: Vec<Vec3> = pieces.of_nodes.iter().map(|&piece| apart(piece)).collect();
    world.body_mut(body).unwrap().set_velocities(&velocities).unwrap();
    for _ in 0..5 {
        world.step(1e-3).unwrap();
    }
    let weights = [0.5, 0.3, 0.2];
    let sutures: Vec<_> = (0..world.body(body).unwrap().surface().len() as u32)
        .map(|triangle| {
            let point = Anchor::Point(SurfacePoint { triangle, weights });
            let definition = SutureDefinition::default();
            world.suture(body, &point, body, &Anchor::Node(0), &definition).unwrap()
        })
        .collect();
    for [from, to, depth] in &CUTS[2..] {
        let distance = |world: &sinew::World, suture| world.suture_report(suture).unwrap().distance;
        let before: Vec<f32> = sutures.iter().map(|&suture| distance(&world, suture)).collect();
        let it = world.body(body).unwrap();
        let sweep = Sweep {
            start: edge(it, *from, *depth),
            end: edge(it, *to, *depth),
        };
        assert!(world.cut(body, &sweep).unwrap().new_triangles > 0);
        for (triangle, (&suture, before)) in sutures.iter().zip(before).enumerate() {
            let now = distance(&world, suture);
            assert!(
                (now - before).abs() < 1e-6,
                "of triangle {triangle}: {before} m, then {now} m"
            );
        }
    }
}
