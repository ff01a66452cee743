//! Where memory runs out, a cut is refused, and nothing has changed.
#![allow(clippy::unwrap_used)]

#[path = "../cutting_solids/block.rs"]
mod block;
#[path = "../cutting/sheet.rs"]
mod sheet;

use super::allocator::with;
use glam::{Vec3, vec2, vec3};
use sheet::{Body, unstructured, wavy};
use sinew::cutting::{Limits, Sweep};
use sinew::{
    BodyContact, BodyDefinition, Error, Material, Model, Shape, Solver, SpringLaw, Storage, ToolDefinition, Values,
    Viscosity, World, WorldDefinition,
};

#[test]
fn a_cut_without_memory_changes_nothing() {
    let mut body = Body::new(unstructured(8, 3), wavy);
    body.cut(vec2(-1.0, 4.2), vec2(9.0, 3.7));
    let sweep = body.sweep(vec2(2.0, 6.6), vec2(5.1, -1.0));
    let near = body.surface.near(&sweep, &body.positions).unwrap();
    let before = format!(
        "{:?} {:?} {:?}",
        body.surface.cells(),
        body.surface.triangles(),
        body.surface.vertices()
    );
    for times in 0.. {
        let answer = with(times, || {
            body.surface.cut(&sweep, &body.follower.positions, &near, Limits::NONE)
        });
        match answer {
            Ok(changes) => {
                assert!(times > 100, "it needs memory {times} times");
                body.apply(&changes);
                assert_eq!(body.check(), 3);
                return;
            }
            Err(error) => assert_eq!(error, Error::OutOfMemory),
        }
        let after = format!(
            "{:?} {:?} {:?}",
            body.surface.cells(),
            body.surface.triangles(),
            body.surface.vertices()
        );
        assert_eq!(before, after);
    }
}

/// Cuts a body without memory after any number of allocations, and then with it; a step of it after that needs none.
fn cut_while_memory_is_scarce(definition: &BodyDefinition, sweep: &Sweep, what: &str) {
    let mut world = World::new(WorldDefinition::default()).unwrap();
    let body = world.create_body(definition).unwrap();
    let mut tool = ToolDefinition::new(Shape::Sphere { radius: 1.0 });
    tool.pose.position = 1.5 * Vec3::Z;
    world.create_tool(&tool).unwrap();
    let mut readers = [(), ()].map(|()| world.create_reader(body).unwrap());
    world.step(1e-3).unwrap();
    assert!(readers[0].read().is_new);
    let before = world.state_hash();
    let mut times = 0;
    loop {
        let answer = with(times, || world.cut(body, sweep));
        match answer {
            Ok(report) => {
                assert!(times > 100, "it needs memory {times} times");
                assert!(report.new_nodes > 0);
                break;
            }
            Err(error) => assert_eq!(error, Error::OutOfMemory),
        }
        assert_eq!(world.state_hash(), before, "{what}: without memory after {times} times");
        assert_eq!(world.body(body).unwrap().changes_since(0).unwrap().version, 0);
        assert!(!readers[0].read().is_new);
        // Nearly all of the ways that it may run out.
        times += 1 + times / 200;
    }
    world.step(1e-3).unwrap();
    let steps = with(0, || (0..20).try_for_each(|_| world.step(1e-3).map(|_| ())));
    steps.unwrap();
    let it = world.body(body).unwrap();
    for reader in &mut readers {
        let frame = reader.read();
        assert!(frame.positions == it.positions() && frame.triangles == it.surface() && frame.topology_version == 1);
    }
    assert!(it.positions().iter().all(|place| place.is_finite()));
}

const MEETS_TISSUE: BodyContact = BodyContact {
    with_bodies: true,
    with_itself: true,
    ..BodyContact::NOTHING
};

fn blade(x: f32, y: f32) -> [Vec3; 2] {
    [vec3(x, y, -9.0), vec3(x, y, 9.0)]
}

#[test]
fn a_body_that_cannot_be_cut_for_lack_of_memory_stays_as_it_was() {
    let (rest, cells) = unstructured(8, 3);
    for (solver, storage, contact) in [
        (Solver::Verlet, Storage::Packed, MEETS_TISSUE),
        (Solver::Verlet, Storage::Efficient, BodyContact::NOTHING),
        (Solver::Implicit, Storage::DynamicBulk, MEETS_TISSUE),
        (Solver::Newton, Storage::FastLink, BodyContact::NOTHING),
    ] {
        let definition = BodyDefinition {
            positions: &rest,
            masses: Values::Uniform(1.0),
            triangles: &cells,
            stiffnesses: Values::Uniform(100.0),
            springs_per_node: if storage == Storage::FastLink { 20 } else { 0 },
            spare_nodes: 200,
            solver,
            storage,
            contact,
            ..Default::default()
        };
        let sweep = Sweep {
            start: blade(2.0, 6.6),
            end: blade(5.1, -1.0),
        };
        cut_while_memory_is_scarce(&definition, &sweep, &format!("{solver:?}, {storage:?}"));
    }
}

#[test]
fn a_sheet_with_terms_that_cannot_be_cut_for_lack_of_memory_stays_as_it_was() {
    let (rest, cells) = unstructured(8, 3);
    for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
        let definition = BodyDefinition {
            positions: &rest,
            masses: Values::Uniform(1.0),
            triangles: &cells,
            stiffnesses: Values::Uniform(100.0),
            bending_stiffness: 1.0,
            home_stiffnesses: Values::Uniform(1.0),
            spring_law: SpringLaw::Cubic {
                quadratic: 0.0,
                cubic: 1.0,
                limit: 1.0,
            },
            spare_nodes: 200,
            solver,
            ..Default::default()
        };
        let sweep = Sweep {
            start: blade(2.0, 6.6),
            end: blade(5.1, -1.0),
        };
        cut_while_memory_is_scarce(&definition, &sweep, &format!("terms, {solver:?}"));
    }
}

#[test]
fn a_solid_that_cannot_be_cut_for_lack_of_memory_stays_as_it_was() {
    let (rest, cells) = block::shaken([4, 4, 2], 3);
    let cells: Vec<[u32; 4]> = cells.iter().map(|&cell| block::upright(&rest, cell)).collect();
    // Strained: what is nearly incompressible remembers how.
    let positions: Vec<Vec3> = rest.iter().map(|rest| *rest * vec3(1.1, 1.0, 0.95)).collect();
    for (solver, has_springs, poisson_ratio, contact) in [
        (Solver::Verlet, true, 0.3, MEETS_TISSUE),
        (Solver::Verlet, false, 0.3, BodyContact::NOTHING),
        (Solver::Implicit, false, 0.3, MEETS_TISSUE),
        (Solver::Newton, false, 0.3, BodyContact::NOTHING),
        (Solver::Verlet, false, 0.45, MEETS_TISSUE),
        (Solver::Implicit, false, 0.45, BodyContact::NOTHING),
        (Solver::Newton, false, 0.45, MEETS_TISSUE),
    ] {
        let elements = Material {
            model: Model::Tetrahedra,
            young_modulus: 100.0,
            poisson_ratio,
            ..Default::default()
        };
        let definition = BodyDefinition {
            positions: &positions,
            rest_positions: Some(&rest),
            masses: Values::Uniform(1.0),
            tetrahedra: &cells,
            stiffnesses: Values::Uniform(if has_springs { 100.0 } else { 0.0 }),
            material: (!has_springs).then_some(elements),
            viscosity: Viscosity {
                retardation_time: if has_springs { 0.0 } else { 0.1 },
                relaxation_time: if has_springs { 0.0 } else { 0.1 },
            },
            spare_nodes: 400,
            solver,
            contact,
            ..Default::default()
        };
        let sweep = Sweep {
            start: blade(1.2, 4.6),
            end: blade(2.9, -0.6),
        };
        cut_while_memory_is_scarce(
            &definition,
            &sweep,
            &format!("{solver:?}, springs: {has_springs}, {poisson_ratio}"),
        );
    }
}
