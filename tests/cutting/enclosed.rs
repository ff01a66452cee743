//! Closed surfaces that are cut open: the contents are lost, and so is the pressure energy.

use glam::{DVec3, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::{BodyDefinition, Values, World, WorldDefinition};

use crate::support::kept::kept;
use crate::support::scene::SOLVERS;
use crate::support::solid::octahedral_ball;

#[test]
fn a_pricked_balloon_has_no_pressure() {
    for solver in SOLVERS {
        for (pressure, squeezed) in [(0.0, 0.9), (50.0, 1.0)] {
            let what = format!("{solver:?}, {pressure} Pa");
            let (rest, triangles) = octahedral_ball(3);
            let rest: Vec<Vec3> = rest.iter().map(|position| 0.05 * *position).collect();
            let positions: Vec<Vec3> = rest.iter().map(|position| *position * squeezed).collect();
            let mut world = World::new(WorldDefinition {
                gravity: Vec3::ZERO,
                ..Default::default()
            })
            .unwrap();
            let definition = BodyDefinition {
                positions: &positions,
                rest_positions: Some(&rest),
                masses: Values::Uniform(1e-4),
                triangles: &triangles,
                stiffnesses: Values::Uniform(20.0),
                enclosed_stiffness: 2000.0,
                pressure,
                // The last nodes are in a tile that was empty before.
                spare_nodes: 1000,
                solver,
                ..Default::default()
            };
            let body = world.create_body(&definition).unwrap();
            let spin: Vec<Vec3> = positions
                .iter()
                .map(|&position| vec3(0.1, 0.2, 3.0).cross(position))
                .collect();
            world.body_mut(body).unwrap().set_velocities(&spin).unwrap();
            for _ in 0..3 {
                world.step(1e-3).unwrap();
            }
            let enclosed = world.body(body).unwrap().enclosed();
            assert_eq!(enclosed.cavity_count, 1);
            assert!(enclosed.pressure > 10.0, "{what}: {enclosed:?}");
            let before = kept(&world, body);
            let edge = |x: f32| [vec3(x, 0.001, 0.02), vec3(x, 0.0015, 0.08)];
            let sweep = Sweep {
                start: edge(-0.011),
                end: edge(0.012),
            };
            let report = world.cut(body, &sweep).unwrap();
            assert!(
                report.pieces_parted == 0 && report.new_triangles > 0,
                "{what}: {report:?}"
            );
            let after = kept(&world, body);
            assert_eq!(world.body(body).unwrap().enclosed().cavity_count, 0, "{what}");
            assert!((after.mass / before.mass - 1.0).abs() < 1e-6, "{what}");
            let size: f64 = spin.iter().map(|speed| 1e-4 * f64::from(speed.length())).sum();
            assert!(before.momentum.distance(after.momentum) < 1e-6 * size, "{what}");
            assert!(before.spin.distance(after.spin) < 1e-6 * before.spin.length(), "{what}");
            // Exactly the terms of the cavity are removed.
            let (volume, rest_volume) = (enclosed.volume, enclosed.rest_volume);
            let cavity_energy = 1000.0 * rest_volume * (volume / rest_volume - 1.0).powi(2)
                - f64::from(pressure) * (volume - rest_volume);
            let error = before.energy - after.energy - cavity_energy;
            assert!(
                error.abs() < 1e-5 * before.energy.abs().max(cavity_energy.abs()),
                "{what}: {error} J of {cavity_energy}"
            );
            let at_end = after.energy;
            for _ in 0..100 {
                world.step(1e-3).unwrap();
            }
            let later = kept(&world, body);
            assert!(later.energy < 1.02 * at_end, "{what}: {at_end} {}", later.energy);
            let centre: DVec3 = later.momentum / later.mass;
            assert!(centre.length() < 1e-3, "{what}: what was inside pushes it by {centre}");
        }
    }
}
