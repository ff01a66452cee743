//! A cut that runs out of memory is refused and changes nothing.
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
    for allowed in 0.. {
        let result = with(allowed, || {
            body.surface.cut(&sweep, &body.follower.positions, &near, Limits::NONE)
        });
        match result {
            Ok(changes) => {
                assert!(allowed > 100, "only {allowed} allocations");
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

/// Cuts a body after every possible number of allocations, until the cut succeeds. Later steps need no memory.
fn cut_while_memory_is_scarce(definition: &BodyDefinition, sweep: &Sweep, case: &str) {
    let mut world = World::new(WorldDefinition::default()).unwrap();
    let body = world.create_body(definition).unwrap();
    let mut tool = ToolDefinition::new(Shape::Sphere { radius: 1.0 });
    tool.pose.position = 1.5 * Vec3::Z;
    world.create_tool(&tool).unwrap();
    let mut readers = [(), ()].map(|()| world.create_reader(body).unwrap());
    world.step(1e-3).unwrap();
    assert!(readers[0].read().is_new);
    let before = world.state_hash();
    let mut allowed = 0;
    loop {
        let result = with(allowed, || world.cut(body, sweep));
        match result {
            Ok(report) => {
                assert!(allowed > 100, "only {allowed} allocations");
                assert!(report.new_nodes > 0);
                break;
            }
            Err(error) => assert_eq!(error, Error::OutOfMemory),
        }
        assert_eq!(
            world.state_hash(),
            before,
            "{case}: out of memory after {allowed} allocations"
        );
        assert_eq!(world.body(body).unwrap().changes_since(0).unwrap().version, 0);
        assert!(!readers[0].read().is_new);
        // Nearly all positions at which memory can run out.
        allowed += 1 + allowed / 200;
    }
    world.step(1e-3).unwrap();
    let steps = with(0, || (0..20).try_for_each(|_| world.step(1e-3).map(|_| ())));
    steps.unwrap();
    let cut_body = world.body(body).unwrap();
    for reader in &mut readers {
        let frame = reader.read();
        assert!(
            frame.positions == cut_body.positions()
                && frame.triangles == cut_body.surface()
                && frame.topology_version == 1
        );
    }
    assert!(cut_body.positions().iter().all(|position| position.is_finite()));
}

const COLLIDING: BodyContact = BodyContact {
    with_bodies: true,
    with_itself: true,
    ..BodyContact::NOTHING
};

fn blade(x: f32, y: f32) -> [Vec3; 2] {
    [vec3(x, y, -9.0), vec3(x, y, 9.0)]
}

#[test]
fn a_body_is_unchanged_if_memory_for_a_cut_is_missing() {
    let (rest, cells) = unstructured(8, 3);
    for (solver, storage, contact) in [
        (Solver::Verlet, Storage::Packed, COLLIDING),
        (Solver::Verlet, Storage::Efficient, BodyContact::NOTHING),
        (Solver::Implicit, Storage::DynamicBulk, COLLIDING),
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
fn a_sheet_with_terms_is_unchanged_if_memory_for_a_cut_is_missing() {
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
fn a_solid_is_unchanged_if_memory_for_a_cut_is_missing() {
    let (rest, cells) = block::shaken([4, 4, 2], 3);
    let cells: Vec<[u32; 4]> = cells.iter().map(|&cell| block::upright(&rest, cell)).collect();
    // Strained, because nearly incompressible tissue stores internal variables of its strain.
    let positions: Vec<Vec3> = rest.iter().map(|rest| *rest * vec3(1.1, 1.0, 0.95)).collect();
    for (solver, has_springs, poisson_ratio, contact) in [
        (Solver::Verlet, true, 0.3, COLLIDING),
        (Solver::Verlet, false, 0.3, BodyContact::NOTHING),
        (Solver::Implicit, false, 0.3, COLLIDING),
        (Solver::Newton, false, 0.3, BodyContact::NOTHING),
        (Solver::Verlet, false, 0.45, COLLIDING),
        (Solver::Implicit, false, 0.45, BodyContact::NOTHING),
        (Solver::Newton, false, 0.45, COLLIDING),
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
