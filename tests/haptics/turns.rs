//! Rotation: a capsule that lies on the tissue, moved and rotated by a hand.

use super::bench::*;
use glam::{DQuat, DVec3, Quat, Vec3, dvec3, vec3};
use sinew::{HapticDefinition, HapticTick, Pose, Shape, Solver, ToolDefinition};
use std::f64::consts::FRAC_PI_2;

const HALF: f32 = 0.02;

/// Creates a bench whose tool is a capsule along x, at the distance `above` from the tissue.
fn lying(solver: Solver, every: u32, above: f32, change: impl FnOnce(&mut HapticDefinition)) -> Bench {
    let mut bench = Bench::new(solver, every);
    bench.world.destroy_tool(bench.tool).unwrap();
    let capsule = ToolDefinition {
        pose: Pose {
            position: vec3(0.0, RADIUS + above, 0.0),
            orientation: Quat::from_rotation_z(FRAC_PI_2 as f32),
        },
        ..ToolDefinition::new(Shape::Capsule {
            radius: RADIUS,
            half_length: HALF,
        })
    };
    bench.tool = bench.world.create_tool(&capsule).unwrap();
    let mut definition = HapticDefinition::new(bench.tool);
    change(&mut definition);
    bench.handle = bench.world.create_haptic(&definition).unwrap();
    bench
}

/// Takes ticks with the hand at `position`, rotated from the lying orientation by `turned`.
fn hold(bench: &mut Bench, ticks: u32, position: Vec3, rotation: impl Fn(u32) -> Quat) -> HapticTick {
    let lying = Quat::from_rotation_z(FRAC_PI_2 as f32);
    let mut last = None;
    for tick in 1..=ticks {
        let pose = Pose {
            position,
            orientation: rotation(tick) * lying,
        };
        last = Some(bench.handle.tick(pose, None, None, TICK).unwrap());
        if tick % bench.every == 0 {
            bench.world.step(bench.every as f32 * TICK).unwrap();
        }
    }
    last.unwrap()
}

#[test]
fn a_torque_rotates_the_hand_back() {
    check_a_torque_rotates_the_hand_back(1.0);
}

#[test]
#[ignore = "long"]
fn a_torque_rotates_the_hand_back_the_other_way() {
    check_a_torque_rotates_the_hand_back(-1.0);
}

fn check_a_torque_rotates_the_hand_back(sign: f32) {
    let mut bench = lying(Solver::Implicit, 16, 0.0, |_| ());
    let position = vec3(0.0, RADIUS - 2e-3, 0.0);
    // Rotation about z raises the end at +x and presses the other end into the tissue. Both signs of a quaternion are
    // the same rotation.
    let result = hold(&mut bench, 600, position, |tick| {
        Quat::from_rotation_z(sign * 0.15 * (tick as f32 / 300.0).min(1.0)) * if tick % 2 == 0 { 1.0 } else { -1.0 }
    });
    let (force, torque) = bench.world.wrench(bench.tool).unwrap();
    assert!(sign * result.torque.z < -1e-3, "{result:?}");
    assert!(
        (result.torque - torque).length() < 2e-3 * torque.length(),
        "{result:?} {torque}"
    );
    assert!(
        (result.force - force).length() < 2e-3 * force.length(),
        "{result:?} {force}"
    );
    // The tool rotates back by the deflection of the angular coupling spring.
    let commanded = Quat::from_rotation_z(sign * 0.15 + FRAC_PI_2 as f32);
    let deflection = (result.proxy.orientation * commanded.conjugate()).to_scaled_axis();
    let lever = RADIUS + HALF;
    assert!(
        (deflection * 1000.0 * lever * lever - result.torque).length() < 5e-3 * result.torque.length(),
        "{deflection}"
    );
}

#[test]
fn the_angular_coupling_can_be_soft_or_stiff() {
    for (stiffness, furthest) in [(1e-3, 1.0), (1e38, 1e-6)] {
        let mut bench = lying(Solver::Implicit, 16, 0.0, |definition| {
            definition.angular_stiffness = stiffness
        });
        for tick in 1..=250 {
            let t = tick as f32 * TICK;
            let rotation = Quat::from_rotation_z(0.2 * (11.0 * t).sin());
            let position = vec3(0.01 * (3.0 * t).sin(), RADIUS - 4e-3 * (7.0 * t).sin(), 0.0);
            let result = hold(&mut bench, 1, position, |_| rotation);
            if tick % 16 == 0 {
                bench.world.step(16.0 * TICK).unwrap();
            }
            let commanded = rotation * Quat::from_rotation_z(FRAC_PI_2 as f32);
            let deviation = (result.proxy.orientation * commanded.conjugate())
                .to_scaled_axis()
                .length();
            assert!(deviation <= furthest * 1.001, "{deviation} rad: {result:?}");
            assert!(result.torque.length() < 0.1, "{result:?}");
        }
    }
}

/// A rigid hand that holds the tool, on a spring or free.
struct Hand {
    /// kg, kg m^2 and N/m.
    mass: f64,
    inertia: f64,
    stiffness: f64,
    home: DVec3,
    position: DVec3,
    orientation: DQuat,
    velocity: DVec3,
    spin: DVec3,
}

impl Hand {
    fn energy(&self) -> f64 {
        0.5 * self.mass * self.velocity.length_squared()
            + 0.5 * self.inertia * self.spin.length_squared()
            + 0.5 * self.stiffness * (self.position - self.home).length_squared()
    }

    /// Takes a tick: exact for a free hand, else in a hundred substeps.
    fn tick(&mut self, result: &HapticTick) {
        let substeps = if self.stiffness == 0.0 { 1 } else { 100 };
        let dt = f64::from(TICK) / f64::from(substeps);
        let angular_acceleration = result.torque.as_dvec3() / self.inertia;
        for _ in 0..substeps {
            let pull = |position: DVec3| self.stiffness * (self.home - position) + result.force.as_dvec3();
            let before = pull(self.position) / self.mass;
            self.position += self.velocity * dt + 0.5 * dt * dt * before;
            self.velocity += 0.5 * dt * (before + pull(self.position) / self.mass);
            let rotation = self.spin * dt + 0.5 * dt * dt * angular_acceleration;
            self.spin += angular_acceleration * dt;
            self.orientation = (DQuat::from_scaled_axis(rotation) * self.orientation).normalize();
        }
    }
}

/// Takes 200 ticks with this hand. Returns its largest energy (J).
fn run_hand(bench: &mut Bench, hand: &mut Hand) -> f64 {
    let mut largest = 0.0_f64;
    for tick in 1..=200 {
        let pose = Pose {
            position: hand.position.as_vec3(),
            orientation: hand.orientation.as_quat(),
        };
        let [velocity, angular_velocity] = [hand.velocity, hand.spin].map(|rate| Some(rate.as_vec3()));
        let result = bench.handle.tick(pose, velocity, angular_velocity, TICK).unwrap();
        if tick % bench.every == 0 {
            bench.world.step(bench.every as f32 * TICK).unwrap();
        }
        hand.tick(&result);
        largest = largest.max(hand.energy());
    }
    largest
}

#[test]
fn a_hand_that_strikes_with_a_capsule_gains_no_energy() {
    // The energy of a spring of 1000 N/m stretched by 0.06 mm (J).
    let tolerance = 2e-6;
    for (mass, stiffness, speed, spin, ratio) in [
        (0.05, 0.0, 0.2, 0.0, 1.0),
        (0.05, 0.0, 0.1, 4.0, 1.0),
        (0.07, 0.0, 0.2, 0.0, 1.0),
        (0.1, 0.0, 0.2, 4.0, 1.0),
        (0.1, 0.0, 0.1, 0.0, 0.0),
        (0.3, 0.0, 0.05, 2.0, 0.0),
        (0.1, 3000.0, 0.1, 4.0, 0.0),
    ] {
        for phase in 0..4 {
            // Contact begins at any time between two steps.
            let above = 1e-4 + f64::from(phase) / 4.0 * speed * 0.016;
            let mut bench = lying(Solver::Verlet, 16, above as f32, |definition| {
                definition.damping_ratio = ratio
            });
            let start = dvec3(0.0, f64::from(RADIUS) + above, 0.0);
            let mut hand = Hand {
                mass,
                inertia: mass * 4.5e-4,
                stiffness,
                home: start,
                position: start,
                orientation: DQuat::from_rotation_z(FRAC_PI_2),
                velocity: dvec3(0.0, -speed, 0.0),
                spin: dvec3(0.0, 0.0, spin),
            };
            let first = hand.energy();
            let largest = run_hand(&mut bench, &mut hand);
            let case = format!("{mass} kg, {stiffness} N/m, {speed} m/s, {spin} rad/s, damped {ratio}, phase {phase}");
            assert!(largest <= first + tolerance, "{case}: {largest} J of {first} J");
        }
    }
}

#[test]
fn tissue_that_moves_carries_a_hand() {
    for (mass, speed) in [(0.05, 0.1), (0.05, 0.3), (0.1, 0.3), (0.3, 0.1)] {
        // The hand starts at rest and must gain the same velocity as with one step per tick.
        let [ticks, steps] = [1, 16].map(|every| {
            let mut bench = lying(Solver::Verlet, every, 1e-4, |_| ());
            let start = dvec3(0.0, f64::from(RADIUS) + 1e-4, 0.0);
            let mut hand = Hand {
                mass,
                inertia: mass * 4.5e-4,
                stiffness: 0.0,
                home: start,
                position: start,
                orientation: DQuat::from_rotation_z(FRAC_PI_2),
                velocity: DVec3::ZERO,
                spin: DVec3::ZERO,
            };
            let body = bench.world.body_mut(bench.body).unwrap();
            let rising: Vec<Vec3> = body
                .positions()
                .iter()
                .map(|node| vec3(0.0, speed * (1.0 + node.y / HEIGHT).max(0.0), 0.0))
                .collect();
            body.set_velocities(&rising).unwrap();
            run_hand(&mut bench, &mut hand);
            hand.velocity.y
        });
        assert!(ticks > 0.003, "{ticks} m/s");
        assert!(
            (steps - ticks).abs() < 0.25 * ticks,
            "{mass} kg, tissue at {speed} m/s: {steps} m/s, {ticks} where every tick is a step"
        );
    }
}
