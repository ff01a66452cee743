//! A hollow solid: cuts in its wall leave its cavity closed, until one reaches it.

use glam::{Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::{BodyDefinition, Material, Model, Values, World, WorldDefinition};

use super::block::{shaken, upright};
use crate::support::kept::kept;
use crate::support::scene::SOLVERS;

#[test]
fn a_hollow_block_keeps_its_pressure_until_a_cut_reaches_it() {
    for solver in SOLVERS {
        let (rest, cells) = shaken([5, 5, 5], 6);
        let middle = |cell: &[u32; 4]| cell.iter().map(|&node| rest[node as usize]).sum::<Vec3>() / 4.0;
        let cells: Vec<[u32; 4]> = cells
            .iter()
            .filter(|cell| (middle(cell) - Vec3::splat(2.5)).abs().max_element() > 0.5)
            .map(|&cell| upright(&rest, cell))
            .collect();
        let rest: Vec<Vec3> = rest.iter().map(|&position| 0.01 * position).collect();
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            ..Default::default()
        })
        .unwrap();
        let definition = BodyDefinition {
            positions: &rest,
            masses: Values::Uniform(1e-3),
            tetrahedra: &cells,
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: 3000.0,
                poisson_ratio: 0.3,
                ..Default::default()
            }),
            enclosed_stiffness: 1e4,
            pressure: 200.0,
            spare_nodes: 3000,
            solver,
            ..Default::default()
        };
        let body = world.create_body(&definition).unwrap();
        for _ in 0..10 {
            world.step(1e-3).unwrap();
        }
        let through = |y: f32| {
            let edge = |x: f32| [vec3(x, y, -0.02), vec3(x, y, 0.07)];
            Sweep {
                start: edge(-0.02),
                end: edge(0.07),
            }
        };
        // Through the cells below the cavity, whose upper corners are its floor.
        let before = (kept(&world, body), world.body(body).unwrap().enclosed());
        assert_eq!(before.1.cavity_count, 1);
        assert_eq!(world.cut(body, &through(0.0125)).unwrap().pieces_parted, 1);
        let after = (kept(&world, body), world.body(body).unwrap().enclosed());
        assert_eq!(after.1, before.1, "{solver:?}");
        let gained = (after.0.energy / before.0.energy - 1.0).abs();
        assert!(gained < 1e-6, "{solver:?}: {gained} of the energy");
        for _ in 0..20 {
            world.step(1e-3).unwrap();
        }
        let it = world.body(body).unwrap();
        assert!(it.enclosed().pressure > 1.0, "{solver:?}: {:?}", it.enclosed());
        world.cut(body, &through(0.025)).unwrap();
        assert_eq!(world.body(body).unwrap().enclosed().cavity_count, 0, "{solver:?}");
        for _ in 0..20 {
            world.step(1e-3).unwrap();
        }
    }
}
