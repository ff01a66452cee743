//! Contacts and attachments of a sheet continue while it is cut.

use glam::{Vec2, Vec3, vec2, vec3};
use sinew::cutting::Sweep;
use sinew::{
    Anchor, Body, BodyDefinition, BodyId, Shape, Solver, SurfacePoint, SutureDefinition, ToolDefinition, ToolId,
    Values, World, WorldDefinition,
};

use super::sheet::unstructured;

const SOLVERS: [Solver; 2] = [Solver::Verlet, Solver::Implicit];

/// A level sheet of 20 x 20 cells of 1 cm, 1 g per node, held at its border or free.
fn level(solver: Solver, is_held: bool) -> (World, BodyId) {
    let (rest, cells) = unstructured(20, 4);
    let positions: Vec<Vec3> = rest
        .iter()
        .map(|position| 0.01 * vec3(position.x, 0.0, -position.y))
        .collect();
    let is_rim = |position: &Vec3| {
        [position.x, position.y]
            .iter()
            .any(|&along| along == 0.0 || along == 20.0)
    };
    let masses: Vec<f32> = rest
        .iter()
        .map(|position| if is_held && is_rim(position) { 0.0 } else { 1e-4 })
        .collect();
    let mut world = World::new(WorldDefinition::default()).unwrap();
    let body = world
        .create_body(&BodyDefinition {
            positions: &positions,
            masses: Values::Each(&masses),
            node_dampings: Values::Uniform(2e-3),
            triangles: &cells,
            stiffnesses: Values::Uniform(100.0),
            spare_nodes: 4000,
            mass_scaling: 0.0,
            solver,
            ..Default::default()
        })
        .unwrap();
    (world, body)
}

fn tool(world: &mut World, shape: Shape, position: Vec3) -> ToolId {
    let mut definition = ToolDefinition::new(shape);
    definition.pose.position = position;
    definition.friction = 0.1;
    world.create_tool(&definition).unwrap()
}

/// An upright blade, along a line of the plane in which the sheet was created.
fn sweep(from: Vec2, to: Vec2) -> Sweep {
    let blade = |at: Vec2| [-0.2, 0.2].map(|y| vec3(at.x, y, -at.y));
    Sweep {
        start: blade(from),
        end: blade(to),
    }
}

fn weight(body: &Body) -> f32 {
    (0..body.node_count() as u32)
        .map(|node| 9.81 * body.node_mass(node).unwrap())
        .sum()
}

#[test]
fn a_sphere_carries_a_sheet_that_is_cut_and_nothing_passes_through() {
    for solver in SOLVERS {
        let (mut world, body) = level(solver, true);
        let radius = 0.03;
        let centre = vec3(0.1, 0.028, -0.1);
        let tool = tool(&mut world, Shape::Sphere { radius }, centre + 0.01 * Vec3::Y);
        world.set_pose(tool, centre, None).unwrap();
        for _ in 0..100 {
            world.step(2e-3).unwrap();
        }
        let held = world.wrench(tool).unwrap().0;
        let cuts = [
            sweep(vec2(0.05, 0.05), vec2(0.1, 0.1)),
            sweep(vec2(0.1, 0.1), vec2(0.15, 0.152)),
            sweep(vec2(0.06, 0.14), vec2(0.14, 0.061)),
        ];
        let mut last = held;
        for cut in &cuts {
            world.cut(body, cut).unwrap();
            for step in 0..30 {
                world.step(1e-3).unwrap();
                let force = world.wrench(tool).unwrap().0;
                assert!(force.is_finite());
                if step == 0 {
                    assert!(
                        force.distance(last) < 0.25 * held.length() + 0.02,
                        "{solver:?}: {last} N, then {force} N"
                    );
                }
                last = force;
            }
            let it = world.body(body).unwrap();
            let drawn = it.surface().as_flattened();
            for &node in drawn {
                let depth = radius - it.positions()[node as usize].distance(centre);
                assert!(depth < 2e-4, "{solver:?}: node {node} is {depth} m inside");
            }
            for triangle in it.surface() {
                let middle = triangle.map(|node| it.positions()[node as usize]).iter().sum::<Vec3>() / 3.0;
                assert!(radius - middle.distance(centre) < 5e-4, "{solver:?}: a face is inside");
            }
        }
    }
}

#[test]
fn a_plane_carries_the_pieces_of_a_cut_sheet() {
    let solver = Solver::Verlet;
    let (mut world, body) = level(solver, false);
    let floor = tool(&mut world, Shape::Plane, -0.005 * Vec3::Y);
    let mut pieces = 1;
    for line in 1..3 {
        let at = 0.066 * line as f32;
        pieces += world
            .cut(body, &sweep(vec2(-0.01, at), vec2(0.21, at + 0.003)))
            .unwrap()
            .pieces_parted;
        pieces += world
            .cut(body, &sweep(vec2(at, -0.01), vec2(at - 0.002, 0.21)))
            .unwrap()
            .pieces_parted;
    }
    assert_eq!(pieces, 9, "{solver:?}");
    for _ in 0..150 {
        world.step(2e-3).unwrap();
    }
    let mut sum = Vec3::ZERO;
    for _ in 0..20 {
        world.step(2e-3).unwrap();
        sum += world.wrench(floor).unwrap().0 / 20.0;
    }
    let it = world.body(body).unwrap();
    assert!(
        (-sum.y / weight(it) - 1.0).abs() < 0.01,
        "{solver:?}: {sum} N of {} N",
        weight(it)
    );
    let drawn = it.surface().as_flattened();
    let lowest = drawn
        .iter()
        .map(|&node| it.positions()[node as usize].y)
        .fold(f32::INFINITY, f32::min);
    assert!(lowest > -0.0052, "{solver:?}: {lowest}");
}

/// Returns the surface point at a point of the plane in which the sheet was created, by current positions.
fn point_at(body: &Body, at: Vec2) -> SurfacePoint {
    for (number, triangle) in (0..).zip(body.surface()) {
        let [a, b, c] = triangle.map(|node| {
            let position = body.positions()[node as usize];
            vec2(position.x, -position.z)
        });
        let whole = (b - a).perp_dot(c - a);
        let weights = [
            (b - at).perp_dot(c - at),
            (c - at).perp_dot(a - at),
            (a - at).perp_dot(b - at),
        ]
        .map(|part| part / whole);
        if weights.iter().all(|&weight| weight >= 0.0) {
            return SurfacePoint {
                triangle: number,
                weights,
            };
        }
    }
    panic!("nothing is drawn at {at}");
}

fn surface_position(body: &Body, point: &SurfacePoint) -> Vec3 {
    let corners = body.surface()[point.triangle as usize];
    (0..3)
        .map(|k| point.weights[k] * body.positions()[corners[k] as usize])
        .sum()
}

#[test]
fn sutures_close_a_wound_and_survive_another_cut() {
    for solver in SOLVERS {
        let (mut world, body) = level(solver, true);
        world.set_gravity(Vec3::ZERO).unwrap();
        // Stretched, so that cuts open.
        let it = world.body(body).unwrap();
        let wide: Vec<Vec3> = it
            .positions()
            .iter()
            .map(|position| *position * vec3(1.0, 1.0, 1.2))
            .collect();
        world.body_mut(body).unwrap().set_positions(&wide).unwrap();
        world.cut(body, &sweep(vec2(0.04, 0.121), vec2(0.16, 0.119))).unwrap();
        let it = world.body(body).unwrap();
        let points = [point_at(it, vec2(0.1, 0.132)), point_at(it, vec2(0.1, 0.108))];
        let apart = |world: &World| {
            let it = world.body(body).unwrap();
            surface_position(it, &points[0]).distance(surface_position(it, &points[1]))
        };
        for _ in 0..150 {
            world.step(2e-3).unwrap();
        }
        let gaping = apart(&world);
        assert!(gaping > 0.027, "{solver:?}: the wound gapes {gaping} m");
        let suture = world
            .suture(
                body,
                &Anchor::Point(points[0]),
                body,
                &Anchor::Point(points[1]),
                &SutureDefinition {
                    length: Some(0.02),
                    ..Default::default()
                },
            )
            .unwrap();
        for _ in 0..150 {
            world.step(2e-3).unwrap();
        }
        let closed = apart(&world);
        assert!((closed - 0.02).abs() < 2e-4, "{solver:?}: {closed} m");
        let force = world.attachment_force(suture).unwrap();
        assert!(force.length() > 0.01);
        // A cut beside one of the points, across its triangle and the cells around it: the point is now on a copy.
        let it = world.body(body).unwrap();
        let before = surface_position(it, &points[0]);
        let at = vec2(before.x, -before.z);
        world
            .cut(body, &sweep(at + vec2(-0.02, 0.0015), at + vec2(0.02, 0.0013)))
            .unwrap();
        let report = world.suture_report(suture).unwrap();
        assert!(
            (report.distance - closed).abs() < 1e-5,
            "{solver:?}: {} m, then {} m",
            closed,
            report.distance
        );
        for _ in 0..200 {
            world.step(2e-3).unwrap();
        }
        let report = world.suture_report(suture).unwrap();
        assert!(
            (report.distance - 0.02).abs() < 2e-4,
            "{solver:?}: {} m",
            report.distance
        );
        assert!(
            world
                .body(body)
                .unwrap()
                .positions()
                .iter()
                .all(|position| position.is_finite())
        );
    }
}
