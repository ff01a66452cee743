//! VERLET against motions with closed-form solutions: oscillators, damping, falls, waves, the pendulum.
//!
//! "Discrete" is the integrator's own exact solution, with omega_h = (2/h) asin(h omega / 2): any difference from it is
//! rounding or a bug.

use std::f64::consts::PI;

use crate::support::bodies::{FREE, Parts, Scene};
use crate::support::motion::{
    Pendulum, STRETCH, Waves, fixed_chain, omega, period_of, rounding, stretch, two_masses, unwrapped,
};
use glam::{DVec3, Vec3};
use sinew::{Error, WorldDefinition};

/// Returns the phase of an oscillation that starts at rest, from its displacement and velocity; `theta` is the phase of
/// one step.
fn phase(q: f64, v: f64, h: f64, theta: f64, steps: usize) -> f64 {
    unwrapped((-v * h / theta.sin()).atan2(q), steps as f64 * theta)
}

/// Returns the phase of the two masses after this many steps of `h`, and the phase of one step.
fn two_masses_phase(h: f32, steps: usize) -> (f64, f64) {
    let mut scene = Scene::new(&two_masses().0, FREE);
    for _ in 0..steps {
        assert_eq!(scene.step(h).substeps, 1);
    }
    let (q, v) = stretch(&scene);
    let h = f64::from(h);
    let theta = 2.0 * (h * omega() / 2.0).asin();
    let amplitude = q.hypot(v * h / theta.sin());
    // Rounding makes the phase drift by up to 1.7e-5 in 4000 steps of h omega 1.5, over two dozen starts and all SIMD
    // levels.
    assert!((amplitude / STRETCH - 1.0).abs() < 3e-5, "amplitude {amplitude}");
    (phase(q, v, h, theta, steps), theta)
}

#[test]
fn two_masses_follow_the_discrete_phase() {
    for x in [0.05, 0.2, 0.8, 1.5] {
        let steps = 4000;
        let (phase, theta) = two_masses_phase((x / omega()) as f32, steps);
        let error = phase / (steps as f64 * theta) - 1.0;
        assert!(error.abs() < 1e-6, "h omega {x}: {error:e}");
    }
}

#[test]
fn two_masses_converge_with_second_order() {
    let errors = [1.0, 2.0, 4.0].map(|finer| {
        let h = (0.2 / finer / omega()) as f32;
        let steps = (1000.0 * finer) as usize;
        let (phase, _) = two_masses_phase(h, steps);
        phase / (steps as f64 * f64::from(h) * omega()) - 1.0
    });
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((order - 2.0).abs() < 0.02, "order {order}, {errors:?}");
    }
}

#[test]
fn two_masses_are_bounded_below_the_limit_and_refused_above() {
    let fixed = WorldDefinition { substeps: 1, ..FREE };
    let mut scene = Scene::new(&two_masses().0, fixed);
    let below = (1.999 / omega()) as f32;
    for _ in 0..100_000 {
        let report = scene.step(below);
        assert!((f64::from(report.stable_substep) * omega() / 2.0 - 1.0).abs() < 1e-4);
        let (q, _) = stretch(&scene);
        assert!(q.abs() < 1.01 * STRETCH, "{q}");
    }

    let above = (2.001 / omega()) as f32;
    let before = (scene.world.state_hash(), scene.positions());
    match scene.world.step(above) {
        Err(Error::Unstable { report, allowed: 1 }) => assert!(report.stable_substep < above),
        other => panic!("{other:?}"),
    }
    assert_eq!(before, (scene.world.state_hash(), scene.positions()));
    scene.step(below);

    let mut free = Scene::new(&two_masses().0, FREE);
    for _ in 0..1000 {
        assert!(free.step(above).substeps >= 2);
        assert!(stretch(&free).0.abs() < 1.01 * STRETCH);
    }
}

/// Returns the deviation of a damped oscillator from exp(-zeta omega t) cos(omega sqrt(1 - zeta²) t), and of its decay
/// rate.
fn damped_error(parts: &Parts, zeta: f64, h: f32, steps: usize) -> (f64, f64) {
    let mut scene = Scene::new(parts, FREE);
    let omega = omega();
    let v0 = -zeta * omega * STRETCH;
    let velocities = [Vec3::X * (-0.75 * v0) as f32, Vec3::X * (0.25 * v0) as f32];
    scene.body_mut().set_velocities(&velocities).expect("velocities");
    scene.run(h, steps);
    let t = f64::from(h) * steps as f64;
    let damped = omega * (1.0 - zeta * zeta).sqrt();
    let (q, v) = stretch(&scene);
    let (re, im) = (q, -(v + zeta * omega * q) / damped);
    let amplitude = STRETCH * (-zeta * omega * t).exp();
    let (exact_re, exact_im) = (amplitude * (damped * t).cos(), amplitude * (damped * t).sin());
    let decay = -(re.hypot(im) / STRETCH).ln() / (zeta * omega * t);
    ((re - exact_re).hypot(im - exact_im) / amplitude, decay - 1.0)
}

#[test]
fn damped_oscillators_converge_with_second_order_and_decay_alike() {
    for zeta in [0.05, 0.2] {
        let (mut at_nodes, reduced) = two_masses();
        let rate = 2.0 * zeta * omega();
        at_nodes.node_dampings = at_nodes.masses.iter().map(|m| m * rate as f32).collect();
        let (mut along, _) = two_masses();
        along.spring_damping = (rate * reduced) as f32;
        for (name, parts) in [("nodes", at_nodes), ("springs", along)] {
            let errors = [1.0, 2.0, 4.0].map(|finer| {
                let (error, decay) =
                    damped_error(&parts, zeta, (0.1 / finer / omega()) as f32, (100.0 * finer) as usize);
                assert!(decay.abs() < 1e-3, "{name}, zeta {zeta}: decay is off by {decay:e}");
                error
            });
            for pair in errors.windows(2) {
                let order = (pair[0] / pair[1]).log2();
                assert!(
                    (order - 2.0).abs() < 0.05,
                    "{name}, zeta {zeta}: order {order}, {errors:?}"
                );
            }
        }
    }
}

#[test]
fn nodes_reach_their_terminal_velocity_with_every_step() {
    let g = 9.81_f32;
    let gravity = WorldDefinition {
        gravity: Vec3::NEG_Y * g,
        ..FREE
    };
    let mut parts = Parts::nodes(vec![Vec3::ZERO, Vec3::X, Vec3::Y], 0.0);
    parts.masses = vec![0.001, 0.5, 20.0];
    parts.node_dampings = vec![1.0, 20.0, 1000.0];
    for h in [1e-5_f32, 1e-4, 1e-3, 1.0 / 60.0, 0.1, 1.0] {
        let mut scene = Scene::new(&parts, gravity);
        let steps = (0.2 / h).ceil() as usize;
        for step in 1..=steps {
            scene.step(h);
            let t = f64::from(h) * step as f64;
            for (node, velocity) in scene.velocities().into_iter().enumerate() {
                let rate = f64::from(parts.node_dampings[node]) / f64::from(parts.masses[node]);
                let terminal = f64::from(g) / rate;
                let expected = -(-rate * t).exp_m1() * terminal;
                let error = (velocity.y + expected) / terminal;
                // The target is 1e-5. A half kick rounds the velocity twice and the factor once, by 6e-8 each. Damping
                // forgets a fraction s/2 per half kick, so an error of 3.6e-7/s can remain.
                let s = rate * f64::from(h);
                let allowed = f64::max(1e-5, 3.6e-7 / s);
                assert!(error.abs() < allowed, "h {h}, node {node}, t {t}: {error:e}");
                assert_eq!((velocity.x, velocity.z), (0.0, 0.0));
            }
        }
    }
}

#[test]
fn bodies_fall_alike_far_from_the_origin() {
    let g = 9.81_f32;
    let gravity = WorldDefinition {
        gravity: Vec3::NEG_Y * g,
        ..FREE
    };
    let h = 1e-4_f32;
    let bodies = [
        Parts::nodes(vec![Vec3::ZERO], 0.1),
        Parts::block([2, 2, 2], 0.05, 0.01, 50.0),
    ];
    for offset in [0.0_f32, 1.0, 10.0, 10_000.0] {
        for body in &bodies {
            let parts = body.moved(glam::Quat::IDENTITY, Vec3::new(-offset, offset, 0.3 * offset));
            let mut scene = Scene::new(&parts, gravity);
            // This is the motion of the center of mass: rounded positions make the nodes of a body vibrate against each
            // other.
            let centre = |vectors: &[DVec3]| {
                let weighted = vectors.iter().zip(&parts.masses).map(|(v, &m)| *v * f64::from(m));
                weighted.sum::<DVec3>() / parts.masses.iter().map(|&m| f64::from(m)).sum::<f64>()
            };
            let start = centre(&scene.positions());
            let mut done = 0;
            for steps in [10, 100, 1000, 3000, 5000, 8000, 9000, 10_000, 20_000] {
                scene.run(h, steps - done);
                done = steps;
                let t = f64::from(h) * steps as f64;
                let fall = f64::from(g) * t * t / 2.0;
                let expected = start.y - fall;
                let error = (centre(&scene.positions()).y - expected).abs();
                assert!(
                    error <= 3e-5 * fall + rounding(expected) + rounding(parts.size()),
                    "{} nodes at {offset} m, {t} s: fell {:e} wrong",
                    parts.positions.len(),
                    error / fall
                );
                let velocity = centre(&scene.velocities());
                let off = velocity.distance(DVec3::NEG_Y * (f64::from(g) * t)) / (f64::from(g) * t);
                assert!(
                    off < 1e-4,
                    "{} nodes at {offset} m, {t} s: velocity {off:e}",
                    parts.positions.len()
                );
            }
        }
    }
}

#[test]
fn all_modes_of_a_chain_follow_the_discrete_phase() {
    let (free, spacing, mass, stiffness) = (100, 0.01_f32, 0.01_f32, 100.0_f32);
    let parts = fixed_chain(free, spacing, mass, stiffness);
    let h = 0.004_f32;
    for mode in 1..=free {
        let angle = mode as f64 * PI / (free + 1) as f64;
        let shape: Vec<f64> = (0..free + 2).map(|i| (angle * i as f64).sin()).collect();
        let norm: f64 = shape.iter().map(|s| s * s).sum();
        // Large enough to stretch springs by 0.4 of their length without inverting their order.
        let amplitude = 0.2 * f64::from(spacing) / (angle / 2.0).sin();
        let mut started = parts.clone();
        for (position, s) in started.positions.iter_mut().zip(&shape) {
            position.x = (f64::from(position.x) + amplitude * s) as f32;
        }
        let mut scene = Scene::new(&started, FREE);
        let project = |vectors: &[DVec3], from: f64| {
            let along = vectors.iter().zip(&shape).enumerate();
            along.map(|(i, (v, s))| (v.x - from * i as f64) * s).sum::<f64>() / norm
        };
        let steps = 2000;
        scene.run(h, steps);
        let omega = 2.0 * (f64::from(stiffness) / f64::from(mass)).sqrt() * (angle / 2.0).sin();
        let theta = 2.0 * (f64::from(h) * omega / 2.0).asin();
        let (q, v) = (
            project(&scene.positions(), f64::from(spacing)),
            project(&scene.velocities(), 0.0),
        );
        let error = phase(q, v, f64::from(h), theta, steps) / (steps as f64 * theta) - 1.0;
        assert!(error.abs() < 1e-6, "mode {mode}: {error:e}");
        let kept = q.hypot(v * f64::from(h) / theta.sin()) / amplitude - 1.0;
        // Positions of up to 1 m are rounded in each step; the amplitude of the highest mode is 2 mm.
        assert!(kept.abs() < 3e-4, "mode {mode}: amplitude off by {kept:e}");
    }
}

#[test]
fn waves_travel_at_their_speed() {
    let waves = Waves::new(799);
    let h = 0.001;
    let mut scene = Scene::new(&waves.parts, FREE);
    waves.start(&mut scene);
    // c = spacing sqrt(k/m) is one node in 10 ms: disturbances from the ends have not reached the middle in 2 s.
    let steps = 2000;
    scene.run(h, steps);
    let (speed, dispersed) = waves.speed(&scene, f64::from(h) * steps as f64, 200);
    assert!((speed / dispersed - 1.0).abs() < 1e-3, "{speed} for {dispersed}");
}

#[test]
fn a_pendulum_from_150_degrees_keeps_its_period() {
    let h = 1e-3_f32;
    let pendulum = Pendulum::from_150_degrees();
    let parts = &pendulum.parts;
    let gravity = Vec3::NEG_Y * pendulum.gravity;

    let mut scene = Scene::new(parts, WorldDefinition { gravity, ..FREE });
    let period = period_of(f64::from(h), || {
        scene.step(h);
        scene.positions()[1].x
    });
    let finer = 20;
    let mut reference = parts.reference(gravity);
    let expected = period_of(f64::from(h), || {
        reference.run(f64::from(h) / f64::from(finer), finer as usize);
        reference.positions[1].x
    });
    assert!(
        (period / expected - 1.0).abs() < 1e-4,
        "{period} s, in f64 {expected} s"
    );

    let lengthened = pendulum.period();
    assert!(
        (period / lengthened - 1.0).abs() < 1e-4,
        "{period} s, by formula {lengthened} s"
    );
}

/// Two nodes sink in thick air so slowly that a short substep moves them by less than a unit in the last place.
#[test]
fn slow_motion_is_not_lost_in_short_substeps() {
    const RATE: f32 = 100.0;
    const G: f32 = 0.01;
    const TIME: f64 = 2.0;
    for (dt, substeps) in [(1.0 / 60.0, 100), (1.0 / 60.0, 300), (1.0 / 60.0, 1000), (1e-5, 1)] {
        let mut parts = Parts::nodes(vec![Vec3::X * -0.1, Vec3::X * 0.1], 1e-3);
        parts.join(0, 1, 1.0);
        parts.node_dampings = vec![RATE * 1e-3; 2];
        let world = WorldDefinition {
            gravity: Vec3::NEG_X * G,
            substeps,
            ..FREE
        };
        let mut scene = Scene::new(&parts, world);
        let start = scene.positions();
        let steps = (TIME / f64::from(dt)).round();
        scene.run(dt, steps as usize);
        // v' = -G - RATE v from rest.
        let (rate, time) = (f64::from(RATE), steps * f64::from(dt));
        let expected = -f64::from(G) / rate * (time - (1.0 - (-rate * time).exp()) / rate);
        for (position, start) in scene.positions().iter().zip(start) {
            let displacement = position.x - start.x;
            assert!(
                (displacement / expected - 1.0).abs() < 1e-3,
                "{dt} s in {substeps}: {displacement:e} m of {expected:e}"
            );
        }
    }
}
