//! Tissue whose nodes around a tool are all pinned presses back like a spring, and stops a tool with a force limit.

use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, BodyId, Pose, Shape, Solver, ToolDefinition, ToolId, Values, World};

use crate::support::bodies::FREE;
use crate::support::scene::SOLVERS;
use crate::support::solid::cuboid;

const DT: f32 = 1.0 / 60.0;

/// The stiffness of the springs (N/m).
const STIFFNESS: f32 = 1000.0;

/// Creates a fully pinned sheet of 0.9 m at y = 0 with edges of 0.1 m and its center between nodes, and a tool 1 mm
/// above `target`.
fn scene(
    solver: Solver,
    shape: Shape,
    (target, orientation): (Vec3, Quat),
    force_limit: f32,
) -> (World, BodyId, ToolId) {
    let mut world = World::new(FREE).expect("a world");
    let mesh = Mesh::cloth([0.9; 2], [9; 2]).expect("a cloth");
    let body = world
        .create_body(&BodyDefinition {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            masses: Values::Uniform(1e-4),
            stiffnesses: Values::Uniform(STIFFNESS),
            solver,
            ..Default::default()
        })
        .expect("a body");
    for node in 0..mesh.positions.len() as u32 {
        world.body_mut(body).expect("a body").pin(node).expect("a pin");
    }
    let tool = ToolDefinition {
        pose: Pose {
            position: target + Vec3::Y * 1e-3,
            orientation,
        },
        force_limit,
        ..ToolDefinition::new(shape)
    };
    let tool = world.create_tool(&tool).expect("a tool");
    (world, body, tool)
}

/// Returns the sum of the pin forces.
fn pin_force_sum(world: &World, body: BodyId) -> DVec3 {
    let body = world.body(body).expect("a body");
    let nodes = 0..body.node_count() as u32;
    nodes.map(|node| body.pin_force(node).expect("a pin").as_dvec3()).sum()
}

#[test]
fn the_force_grows_with_the_depth_of_the_tool() {
    let (positions, triangles) = cuboid(Vec3::splat(-0.03), Vec3::splat(0.03));
    let mesh = Shape::Mesh {
        positions: &positions,
        triangles: &triangles,
    };
    let upright = (Vec3::Y * 0.03, Quat::IDENTITY);
    let shapes = [
        ("ball", Shape::Sphere { radius: 0.03 }, upright),
        (
            "lying capsule",
            Shape::Capsule {
                radius: 0.03,
                half_length: 0.05,
            },
            (Vec3::Y * 0.03, Quat::from_rotation_z(std::f32::consts::FRAC_PI_2)),
        ),
        (
            "box",
            Shape::Box {
                half_extents: Vec3::splat(0.03),
            },
            upright,
        ),
        ("mesh", mesh, upright),
    ];
    for solver in SOLVERS {
        for (name, shape, pose) in shapes {
            let case = format!("{name}, {solver:?}");
            let (mut world, body, tool) = scene(solver, shape, pose, f32::INFINITY);
            let mut last = 0.0;
            for millimetre in 0..6 {
                // First just above the sheet, then a millimeter deeper each time.
                let target = pose.0 + Vec3::Y * (1e-6 - 1e-3 * millimetre as f32);
                world.set_pose(tool, target, None).expect("a pose");
                world.step(DT).expect("a step");
                let force = world.wrench(tool).expect("a tool").0;
                if millimetre == 0 {
                    assert_eq!(force, Vec3::ZERO, "{case}: above the sheet");
                    continue;
                }
                assert!(force.y > last + 0.5, "{case}, {millimetre}: {force} after {last} N");
                // A node is held by up to eight springs, and has their stiffness.
                assert!(force.y < 8.0 * STIFFNESS * 1e-3 * millimetre as f32, "{case}: {force}");
                assert!(force.x.abs().max(force.z.abs()) < 0.1 * force.y, "{case}: {force}");
                let pin_force_sum = pin_force_sum(&world, body);
                assert!(
                    pin_force_sum.distance(force.as_dvec3()) < 1e-5 * f64::from(force.y),
                    "{case}: pins hold {pin_force_sum}, the tool has {force}"
                );
                let contacts: Vec3 = world.contacts(tool).expect("a tool").map(|contact| contact.force).sum();
                assert_eq!(contacts, force, "{case}");
                last = force.y;
            }
        }
    }
}

#[test]
fn a_tool_is_pushed_out_on_the_side_from_which_it_came() {
    for solver in SOLVERS {
        let shape = Shape::Sphere { radius: 0.03 };
        let start = Vec3::Y * 0.03;
        let (mut world, _, tool) = scene(solver, shape, (start, Quat::IDENTITY), f32::INFINITY);
        let mut last = 0.0;
        let depths = (0..56).chain((0..56).rev());
        for (step, depth) in depths.enumerate() {
            let target = start - Vec3::Y * (1e-3 * depth as f32);
            world.set_pose(tool, target, None).expect("a pose");
            world.step(DT).expect("a step");
            let force = world.wrench(tool).expect("a tool").0.y;
            let case = format!("{solver:?}, step {step}, {depth} mm deep: {force} N after {last} N");
            assert!(force >= 0.0 && (depth == 0 || force > 0.0), "{case}");
            assert!(if step < 56 { force >= last } else { force <= last }, "{case}");
            last = force;
        }
    }
}

#[test]
fn a_tool_with_a_force_limit_stops_at_it() {
    check_a_tool_with_a_force_limit_stops_at_it(|solver, speed| solver == Solver::Verlet || speed < 1.0);
}

#[test]
#[ignore = "long"]
fn a_tool_with_a_force_limit_stops_at_it_in_the_other_cases() {
    check_a_tool_with_a_force_limit_stops_at_it(|solver, speed| solver != Solver::Verlet && speed > 1.0);
}

fn check_a_tool_with_a_force_limit_stops_at_it(is_selected: fn(Solver, f32) -> bool) {
    let limit = 1.0;
    for solver in SOLVERS {
        // A fast tool would pass the sheet within one step.
        for speed in [0.6, 60.0_f32].into_iter().filter(|&speed| is_selected(solver, speed)) {
            let case = format!("{solver:?}, {speed} m/s");
            let shape = Shape::Sphere { radius: 0.04 };
            let (mut world, _, tool) = scene(solver, shape, (Vec3::Y * 0.3, Quat::IDENTITY), limit);
            for _ in 0..40 {
                let aim = world.pose(tool).expect("a tool").position - Vec3::Y * (speed * DT);
                world.set_pose(tool, aim, None).expect("a pose");
                world.step(DT).expect("a step");
                let force = world.wrench(tool).expect("a tool").0.length();
                assert!(force <= 1.01 * limit, "{case}: {force} N");
            }
            // The search for the stopping position is accurate to a fraction of the commanded displacement.
            let highest = 0.0401 + 5e-2 * speed * DT;
            let final_height = world.pose(tool).expect("a tool").position.y;
            assert!(
                (0.0389..highest).contains(&final_height),
                "{case}: the ball stands at {final_height} m"
            );
        }
    }
}
