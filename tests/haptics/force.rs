//! What is felt is what the world says, no later than two of its steps.

use std::f64::consts::{PI, TAU};

use super::bench::*;
use glam::{DVec3, Vec3, dvec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, HapticDefinition, Material, Model, Pose, Shape, Solver, ToolDefinition, World, WorldDefinition,
};

const TOP: f64 = RADIUS as f64;
const START: f64 = (RADIUS + CLEAR) as f64;

/// The most that forces along the same path differ, as a part of the greater, where there is something to feel.
fn difference(one: &[Record], other: &[Record]) -> f64 {
    let pairs = one.iter().zip(other);
    let felt = pairs.filter_map(|(one, other)| {
        let [a, b] = [one, other].map(|record| record.tick.force.as_dvec3());
        let larger = a.length().max(b.length());
        (larger > 0.1).then(|| (a - b).length() / larger)
    });
    felt.fold(0.0, f64::max)
}

#[test]
fn slow_motions_feel_as_if_every_tick_were_a_step() {
    // A press, a stroke along the surface and back, and a way out, at 8 mm/s at most.
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
    let most = full.iter().map(|record| record.tick.force.length()).fold(0.0, f32::max);
    assert!(most > 0.3, "{most} N at most");
    let off = difference(&full, &local);
    assert!(off < 0.02, "{off} off");
}

#[test]
fn a_hand_at_rest_feels_what_the_world_tells() {
    let mut bench = Bench::new(Solver::Verlet, 16);
    bench.follow(0.6, |t| dvec3(0.0, TOP - 0.01 * t.min(0.4), 0.0));
    let still = bench.follow(0.5, |_| dvec3(0.0, TOP - 0.004, 0.0));
    let felt = still.last().unwrap().tick;
    let (told, _) = bench.world.wrench(bench.tool).unwrap();
    assert!((felt.force - told).length() < 1e-3 * told.length(), "{felt:?} {told}");
    // The spring between device and proxy is drawn out by it.
    let drawn = felt.proxy.position - still.last().unwrap().position.as_vec3();
    assert!((1000.0 * drawn - felt.force).length() < 1e-3 * felt.force.length());
    assert!(felt.contact_count > 0);
    let mut pressed = Vec3::ZERO;
    bench.handle.contacts(|contact| {
        assert!(
            contact.normal.y < -0.5 && contact.velocity.length() < 1e-3,
            "{contact:?}"
        );
        pressed += contact.force;
    });
    assert!((pressed - told).length() < 0.01 * told.length(), "{pressed} {told}");
}

#[test]
fn what_is_felt_is_two_steps_old_at_most() {
    let mut bench = Bench::new(Solver::Implicit, 16);
    // As slow as a model is good for, and then still: what is felt then settles.
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
fn a_stale_model_is_felt_no_more() {
    let mut bench = Bench::new(Solver::Verlet, 16);
    bench.follow(0.5, |t| dvec3(0.0, TOP - 0.01 * t.min(0.4), 0.0));
    let here = dvec3(0.0, TOP - 0.004, 0.0);
    let before = bench.tick(here, DVec3::ZERO).tick.force;
    assert!(before.y > 0.1);
    bench.every = 0;
    let stalled = bench.follow(0.5, |_| here);
    // Until it is stale it stays.
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
    // As it goes it only falls, and it comes back.
    let falls = |pair: &[Record]| pair[1].tick.force.y <= pair[0].tick.force.y + 1e-6;
    assert!(stalled[80..].windows(2).all(falls));
    bench.every = 16;
    let again = bench.follow(0.5, |_| here);
    let end = again.last().unwrap().tick;
    assert!(
        end.gain == 1.0 && (end.force - before).length() < 0.02 * before.length(),
        "{end:?} {before}"
    );
}

#[test]
fn limits_are_kept() {
    let path = |t: f64| dvec3(0.0, TOP - 0.2 * t.min(0.04) + 1e-3, 0.0);
    let free = Bench::new(Solver::Verlet, 16).follow(0.5, path);
    let most = free.iter().map(|record| record.tick.force.length()).fold(0.0, f32::max);
    let mut limited = Bench::with(Solver::Verlet, 16, |definition| {
        definition.force_limit = 0.2;
        definition.force_rate_limit = 3.0;
    });
    let felt = limited.follow(0.5, path);
    assert!(most > 0.4, "{most}");
    let mut before = Vec3::ZERO;
    for Record { tick, .. } in &felt {
        assert!(tick.force.length() <= 0.2 * (1.0 + 1e-6), "{tick:?}");
        assert!((tick.force - before).length() <= 3.0 * TICK * (1.0 + 1e-3), "{tick:?}");
        before = tick.force;
    }
    assert!(before.length() > 0.199, "{before}");
}

/// The damper between device and tool does not hold back a tool that leaves: tissue presses, it does not pull.
#[test]
fn tissue_does_not_pull_at_a_tool_that_leaves() {
    for speed in [0.05, 0.2] {
        let mut bench = Bench::new(Solver::Verlet, 16);
        let depth = |t: f64| TOP - 0.008 * (t / 0.4).min(1.0);
        let pressed = bench.follow(0.8, |t| dvec3(0.0, depth(t), 0.0));
        let most = pressed.last().unwrap().tick.force.y;
        assert!(most > 0.1, "{most} N");
        // As a hand sets off, not with a jerk.
        let way = |t: f64| speed * if t < 0.05 { 10.0 * t * t } else { t - 0.025 };
        let lifted = bench.follow(0.3, |t| dvec3(0.0, TOP - 0.008 + way(t), 0.0));
        let least = lifted.iter().map(|record| record.tick.force.y).fold(0.0, f32::min);
        assert!(least > -0.01 * most, "{speed} m/s: {least} N of {most} N");
    }
}

/// A device that stands still, on a tool that holds tissue about as stiff as its coupling: the tissue comes to rest.
#[test]
fn what_a_tool_holds_comes_to_rest_with_the_device() {
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
        for (node, place) in (0..).zip(&mesh.positions) {
            if place.y < -0.0149 {
                world.body_mut(body).unwrap().pin(node).unwrap();
            } else if place.y > 0.0149 && place.x.abs() < 0.008 && place.z.abs() < 0.008 {
                world.attach_node(body, node, tool, 0.0).unwrap();
            }
        }
        let mut haptic = HapticDefinition::new(tool);
        haptic.stiffness = stiffness;
        let mut handle = world.create_haptic(&haptic).unwrap();
        let mut range = [f32::INFINITY, f32::NEG_INFINITY];
        for step in 0..240 {
            // Lifted by 5 mm in a second, then held for three.
            for _ in 0..16 {
                pose.position.y = (pose.position.y + 5e-6).min(0.0255);
                let tick = handle.tick(pose, None, None, 1.0 / 960.0).unwrap();
                if step > 180 {
                    range = [range[0].min(tick.force.y), range[1].max(tick.force.y)];
                }
            }
            world.step(1.0 / 60.0).unwrap();
        }
        let [least, most] = range;
        let case = format!("{young_modulus} Pa, {stiffness} N/m: {range:?} N");
        assert!(most < -0.1 && most - least < -1e-3 * most, "{case}");
        let kinetic = world.body(body).unwrap().energy(Vec3::ZERO).kinetic;
        assert!(kinetic < 1e-7, "{case}, {kinetic:e} J");
    }
}
