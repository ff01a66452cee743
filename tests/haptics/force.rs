//! The haptic force follows the world's force with a delay of at most two steps.

use std::f64::consts::{PI, TAU};

use super::bench::*;
use glam::{DVec3, Vec3, dvec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, HapticDefinition, Material, Model, Pose, Shape, Solver, ToolDefinition, World, WorldDefinition,
};

const TOP: f64 = RADIUS as f64;
const START: f64 = (RADIUS + CLEAR) as f64;

/// Returns the largest relative difference of forces along the same path, where the force is not small.
fn difference(one: &[Record], other: &[Record]) -> f64 {
    let pairs = one.iter().zip(other);
    let differences = pairs.filter_map(|(one, other)| {
        let [a, b] = [one, other].map(|record| record.tick.force.as_dvec3());
        let larger = a.length().max(b.length());
        (larger > 0.1).then(|| (a - b).length() / larger)
    });
    differences.fold(0.0, f64::max)
}

#[test]
fn slow_motions_match_one_step_per_tick() {
    // A press, a stroke along the surface and back, and withdrawal, at most at 8 mm/s.
    let path = |t: f64| match t {
        t if t < 1.6 => dvec3(0.0, START - 0.0025 * (1.0 - (PI * t / 1.6).cos()) * 1.6, 0.0),
        t if t < 3.2 => dvec3(0.004 * (1.0 - (TAU * (t - 1.6) / 1.6).cos()) * 0.5, START - 0.008, 0.0),
        t => dvec3(
            0.0,
            START - 0.008 + 0.0025 * (1.0 - (PI * (t - 3.2) / 1.6).cos()) * 1.6,
            0.0,
        ),
    };
    let [full, local] = [1, 16].map(|every| Bench::fine(Solver::Verlet, every).follow(4.8, path));
    let largest = full.iter().map(|record| record.tick.force.length()).fold(0.0, f32::max);
    assert!(largest > 0.3, "{largest} N at most");
    let error = difference(&full, &local);
    assert!(error < 0.02, "{error} off");
}

#[test]
fn the_force_at_rest_is_that_of_the_world() {
    let mut bench = Bench::new(Solver::Verlet, 16);
    bench.follow(0.6, |t| dvec3(0.0, TOP - 0.01 * t.min(0.4), 0.0));
    let still = bench.follow(0.5, |_| dvec3(0.0, TOP - 0.004, 0.0));
    let result = still.last().unwrap().tick;
    let (force, _) = bench.world.wrench(bench.tool).unwrap();
    assert!(
        (result.force - force).length() < 1e-3 * force.length(),
        "{result:?} {force}"
    );
    // The force stretches the coupling between device and proxy.
    let stretch = result.proxy.position - still.last().unwrap().position.as_vec3();
    assert!((1000.0 * stretch - result.force).length() < 1e-3 * result.force.length());
    assert!(result.contact_count > 0);
    let mut pressed = Vec3::ZERO;
    bench.handle.contacts(|contact| {
        assert!(
            contact.normal.y < -0.5 && contact.velocity.length() < 1e-3,
            "{contact:?}"
        );
        pressed += contact.force;
    });
    assert!((pressed - force).length() < 0.01 * force.length(), "{pressed} {force}");
}

#[test]
fn the_force_is_at_most_two_steps_old() {
    let mut bench = Bench::new(Solver::Implicit, 16);
    // A motion slow enough for the local model, then a stop. Then the force settles.
    let speed = 0.02;
    let moved = bench.follow(0.3, |t| dvec3(0.0, TOP - speed * t, 0.0));
    let ages = moved.iter().skip(32).map(|record| record.tick.age);
    assert!(ages.fold(0.0, f32::max) <= 2.0 * 16.0 * TICK, "{:?}", moved.last());
    let stop = TOP - speed * 0.3;
    let still = bench.follow(0.5, |_| dvec3(0.0, stop, 0.0));
    let end = still.last().unwrap().tick.force.as_dvec3();
    let late = still[32].tick.force.as_dvec3();
    assert!((late - end).length() < 0.02 * end.length(), "{late} {end}");
}

#[test]
fn a_stale_model_fades_out() {
    let mut bench = Bench::new(Solver::Verlet, 16);
    bench.follow(0.5, |t| dvec3(0.0, TOP - 0.01 * t.min(0.4), 0.0));
    let pressed_position = dvec3(0.0, TOP - 0.004, 0.0);
    let before = bench.tick(pressed_position, DVec3::ZERO).tick.force;
    assert!(before.y > 0.1);
    bench.every = 0;
    let stalled = bench.follow(0.5, |_| pressed_position);
    // The force stays until the model is stale.
    let soon = stalled[60].tick;
    assert!(
        soon.gain == 1.0 && (soon.force - before).length() < 0.02 * before.length(),
        "{soon:?}"
    );
    let end = stalled.last().unwrap().tick;
    assert!(
        end.gain == 0.0 && end.force == Vec3::ZERO && end.torque == Vec3::ZERO,
        "{end:?}"
    );
    // The force falls monotonically, and returns afterwards.
    let falls = |pair: &[Record]| pair[1].tick.force.y <= pair[0].tick.force.y + 1e-6;
    assert!(stalled[80..].windows(2).all(falls));
    bench.every = 16;
    let resumed = bench.follow(0.5, |_| pressed_position);
    let end = resumed.last().unwrap().tick;
    assert!(
        end.gain == 1.0 && (end.force - before).length() < 0.02 * before.length(),
        "{end:?} {before}"
    );
}

#[test]
fn force_limits_hold() {
    let path = |t: f64| dvec3(0.0, TOP - 0.2 * t.min(0.04) + 1e-3, 0.0);
    let free = Bench::new(Solver::Verlet, 16).follow(0.5, path);
    let largest = free.iter().map(|record| record.tick.force.length()).fold(0.0, f32::max);
    let mut limited = Bench::with(Solver::Verlet, 16, |definition| {
        definition.force_limit = 0.2;
        definition.force_rate_limit = 3.0;
    });
    let records = limited.follow(0.5, path);
    assert!(largest > 0.4, "{largest}");
    let mut before = Vec3::ZERO;
    for Record { tick, .. } in &records {
        assert!(tick.force.length() <= 0.2 * (1.0 + 1e-6), "{tick:?}");
        assert!((tick.force - before).length() <= 3.0 * TICK * (1.0 + 1e-3), "{tick:?}");
        before = tick.force;
    }
    assert!(before.length() > 0.199, "{before}");
}

/// The coupling damper does not hold back a tool that withdraws: tissue presses but does not pull.
#[test]
fn tissue_does_not_pull_at_a_withdrawing_tool() {
    for speed in [0.05, 0.2] {
        let mut bench = Bench::new(Solver::Verlet, 16);
        let depth = |t: f64| TOP - 0.008 * (t / 0.4).min(1.0);
        let pressed = bench.follow(0.8, |t| dvec3(0.0, depth(t), 0.0));
        let largest = pressed.last().unwrap().tick.force.y;
        assert!(largest > 0.1, "{largest} N");
        // The hand accelerates smoothly.
        let lift = |t: f64| speed * if t < 0.05 { 10.0 * t * t } else { t - 0.025 };
        let lifted = bench.follow(0.3, |t| dvec3(0.0, TOP - 0.008 + lift(t), 0.0));
        let least = lifted.iter().map(|record| record.tick.force.y).fold(0.0, f32::min);
        assert!(least > -0.01 * largest, "{speed} m/s: {least} N of {largest} N");
    }
}

/// A tool holds tissue about as stiff as its coupling, and the device stands still. The tissue comes to rest.
#[test]
fn attached_tissue_comes_to_rest_with_the_device() {
    for (young_modulus, stiffness) in [(5_400.0, 200.0), (20_000.0, 1000.0), (20_000.0, 500.0)] {
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            ..WorldDefinition::default()
        })
        .unwrap();
        let mesh = Mesh::block([0.06, 0.03, 0.06], [8, 4, 8]).unwrap();
        let definition = BodyDefinition {
            material: Some(Material {
                model: Model::Springs,
                young_modulus,
                density: 1060.0,
                ..Material::default()
            }),
            damping_rate: 5.0,
            ..BodyDefinition::of(&mesh)
        };
        let body = world.create_body(&definition).unwrap();
        let mut pose = Pose {
            position: Vec3::Y * 0.0205,
            ..Pose::IDENTITY
        };
        let tool = world.create_tool(&ToolDefinition {
            pose,
            ..ToolDefinition::new(Shape::Sphere { radius: 0.005 })
        });
        let tool = tool.unwrap();
        for (node, rest) in (0..).zip(&mesh.positions) {
            if rest.y < -0.0149 {
                world.body_mut(body).unwrap().pin(node).unwrap();
            } else if rest.y > 0.0149 && rest.x.abs() < 0.008 && rest.z.abs() < 0.008 {
                world.attach_node(body, node, tool, 0.0).unwrap();
            }
        }
        let mut haptic = HapticDefinition::new(tool);
        haptic.stiffness = stiffness;
        let mut handle = world.create_haptic(&haptic).unwrap();
        let mut range = [f32::INFINITY, f32::NEG_INFINITY];
        for step in 0..240 {
            // Lifted by 5 mm in a second, then held for three seconds.
            for _ in 0..16 {
                pose.position.y = (pose.position.y + 5e-6).min(0.0255);
                let tick = handle.tick(pose, None, None, 1.0 / 960.0).unwrap();
                if step > 180 {
                    range = [range[0].min(tick.force.y), range[1].max(tick.force.y)];
                }
            }
            world.step(1.0 / 60.0).unwrap();
        }
        let [least, largest] = range;
        let case = format!("{young_modulus} Pa, {stiffness} N/m: {range:?} N");
        assert!(largest < -0.1 && largest - least < -1e-3 * largest, "{case}");
        let kinetic = world.body(body).unwrap().energy(Vec3::ZERO).kinetic;
        assert!(kinetic < 1e-7, "{case}, {kinetic:e} J");
    }
}
