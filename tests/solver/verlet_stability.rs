//! VERLET in hard cases: bad starts, large ratios, violent pins and forces, long and varying steps.
//!
//! Leapfrog keeps a shadow energy; the energy itself is at most E0 / (1 - (h omega)²/4). The library keeps h omega to
//! 0.8 of its limit of 2 at the current positions, or to 0.9 of a limit that holds for all positions.

use crate::support::bodies::{FREE, Parts, Random, Scene, largest_difference};
use crate::support::organ::of_elements;
use glam::{DVec3, Quat, Vec3};
use sinew::{BodyDefinition, Error, Material, Model, Solver, Storage, Values, World, WorldDefinition};

const SHADOW: f64 = 1.0 / (1.0 - 0.8 * 0.8);
const FRAME: f32 = 1.0 / 60.0;
const G: f32 = 9.81;

fn gravity() -> WorldDefinition {
    WorldDefinition {
        gravity: Vec3::NEG_Y * G,
        ..FREE
    }
}

fn damp(parts: &mut Parts, rate: f32) {
    for (damping, mass) in parts.node_dampings.iter_mut().zip(&parts.masses) {
        *damping = rate * mass;
    }
}

fn pin_where(parts: &mut Parts, held: impl Fn(Vec3) -> bool) {
    for (position, mass) in parts.positions.iter().zip(&mut parts.masses) {
        if held(*position) {
            *mass = 0.0;
        }
    }
}

/// Steps `scene` and checks that everything stays finite and that the energy stays at or below `most`.
fn watch(scene: &mut Scene, name: &str, h: f32, steps: usize, energy_limit: f64) {
    for step in 0..steps {
        scene.step(h);
        assert!(scene.is_finite(), "{name}, step {step} of {h} s");
        let energy = scene.energy();
        assert!(
            energy <= energy_limit,
            "{name}, step {step} of {h} s: {energy} J, at most {energy_limit}"
        );
    }
}

/// Returns a block and bad positions to start it from.
fn bad_starts() -> (Parts, [(&'static str, Vec<Vec3>); 3]) {
    let parts = Parts::block([3, 3, 3], 0.05, 0.01, 100.0);
    let mut random = Random::new(11);
    let scattered = parts.positions.iter().map(|_| 0.15 * random.vector()).collect();
    let flattened = parts.positions.iter().map(|p| p.with_z(0.05)).collect();
    let collapsed = parts.positions.iter().map(|_| 1e-6 * random.vector()).collect();
    (
        parts,
        [
            ("scattered", scattered),
            ("flattened", flattened),
            ("collapsed", collapsed),
        ],
    )
}

/// The transverse stiffness of a spring compressed to L is k (1 - L0/L), without bound as nodes pass through each
/// other. A step just below the limit does not follow that. An undamped body that stays folded heats up, in `f64` as
/// well (20 times in a minute of frames). With short steps the bound holds; with frames the body stays finite.
#[test]
fn bad_starts_stay_finite_and_gain_no_energy_in_short_steps() {
    let (parts, starts) = bad_starts();
    for (name, positions) in &starts {
        for (h, steps) in [(1e-5, 300), (1e-4, 3000), (1e-3, 1000), (FRAME, 200), (1.0, 5)] {
            let mut scene = Scene::new(&parts, FREE);
            scene.body_mut().set_positions(positions).expect("positions");
            let start = scene.energy();
            assert!(start > 0.0);
            let energy_limit = if h > 1e-3 { f64::INFINITY } else { SHADOW * start };
            watch(&mut scene, name, h, steps, energy_limit);
        }
    }
}

#[test]
fn bad_starts_lose_energy_with_damping() {
    let (parts, starts) = bad_starts();
    let (mut at_nodes, mut along) = (parts.clone(), parts);
    damp(&mut at_nodes, 10.0);
    along.spring_damping = 0.05;
    for parts in [at_nodes, along] {
        for (name, positions) in &starts {
            let mut scene = Scene::new(&parts, FREE);
            scene.body_mut().set_positions(positions).expect("positions");
            let start = scene.energy();
            watch(&mut scene, name, FRAME, 300, SHADOW * start);
            watch(&mut scene, name, 1.0, 5, start);
            let energy = scene.body().energy(Vec3::ZERO);
            // Flattened bodies stay flat: nothing pushes them out of the plane. The others unfold more or less.
            assert!(energy.elastic < start, "{name}: {energy:?} of {start}");
            assert!(energy.kinetic < 1e-6 * start, "{name}: {energy:?} of {start}");
        }
    }
}

#[test]
fn springs_with_any_damping_gain_no_energy() {
    let parts = Parts::block([2, 2, 2], 0.05, 0.01, 100.0);
    let mut random = Random::new(12);
    for damping in [1e-3, 0.1, 1.0, 10.0, 100.0] {
        let mut damped = parts.clone();
        damped.spring_damping = damping;
        let mut scene = Scene::new(&damped, FREE);
        let velocities: Vec<Vec3> = damped.positions.iter().map(|_| random.vector()).collect();
        scene.body_mut().set_velocities(&velocities).expect("velocities");
        let start = scene.energy();
        watch(&mut scene, &format!("damping {damping}"), 1e-3, 300, start * SHADOW);
        assert!(scene.energy() < start);
    }
}

#[test]
fn coincident_nodes_separate_along_one_direction() {
    let mut parts = Parts::nodes(vec![Vec3::new(0.3, 0.2, 0.1); 3], 0.1);
    parts.springs = vec![[0, 1], [1, 2]];
    parts.stiffnesses = vec![50.0; 2];
    parts.rest_lengths = vec![0.0, 0.04];
    let mut scene = Scene::new(&parts, FREE);
    let start = scene.energy();
    watch(&mut scene, "coincident", 1e-3, 20, SHADOW * start);
    let positions = scene.positions();
    assert!((positions[2] - positions[1]).length() > 1e-4, "{positions:?}");
    for (position, velocity) in positions.iter().zip(scene.velocities()) {
        assert_eq!((position.y as f32, position.z as f32), (0.2, 0.1));
        assert_eq!((velocity.y, velocity.z), (0.0, 0.0));
    }
    let momentum: DVec3 = scene.velocities().iter().sum();
    assert!(momentum.length() < 1e-6 * scene.velocities()[2].length());
    watch(&mut scene, "coincident", 1e-3, 5000, SHADOW * start);

    // A spring of zero length is an isotropic oscillator: two opposite bobs through one point.
    let mut bobs = Parts::nodes(vec![Vec3::X, Vec3::NEG_X], 1.0);
    bobs.join(0, 1, 50.0);
    bobs.rest_lengths[0] = 0.0;
    let mut scene = Scene::new(&bobs, FREE);
    let mut reference: (f64, f64) = (1.0, 0.0);
    let h = 1e-3_f32;
    for _ in 0..1000 {
        scene.step(h);
        let h = f64::from(h);
        reference.1 -= 100.0 * reference.0 * h / 2.0;
        reference.0 += reference.1 * h;
        reference.1 -= 100.0 * reference.0 * h / 2.0;
        let error = (scene.positions()[0].x - reference.0).abs();
        assert!(error < 1e-5, "{error:e}");
    }
}

/// Returns the largest stretch error of a spring in a hanging chain, relative to the largest stretch.
fn hanging_error(parts: &Parts, h: f32, steps: usize) -> f64 {
    let mut scene = Scene::new(parts, gravity());
    scene.run(h, steps);
    let positions = scene.positions();
    let (mut load, mut worst, mut largest) = (0.0, 0.0_f64, 0.0_f64);
    for link in (0..parts.springs.len()).rev() {
        load += f64::from(parts.masses[link + 1]) * f64::from(G);
        let expected = load / f64::from(parts.stiffnesses[link]);
        let stretch = positions[link].distance(positions[link + 1]) - f64::from(parts.rest_lengths[link]);
        worst = worst.max((stretch - expected).abs());
        largest = largest.max(expected);
    }
    worst / largest
}

#[test]
fn stiffness_may_differ_a_million_times() {
    let mut parts = Parts::chain(7, Vec3::NEG_Y * 0.02, 0.1, 20.0);
    for stiffness in parts.stiffnesses.iter_mut().step_by(2) {
        *stiffness = 2e7;
    }
    parts.masses[0] = 0.0;
    damp(&mut parts, 0.8);
    let error = hanging_error(&parts, FRAME, 2400);
    assert!(error < 1e-4, "{error:e}");
}

#[test]
fn masses_may_differ_a_million_times() {
    let mut parts = Parts::chain(6, Vec3::NEG_Y * 0.02, 1e-6, 40.0);
    parts.masses[0] = 0.0;
    parts.masses[5] = 1.0;
    damp(&mut parts, 0.8);
    let error = hanging_error(&parts, FRAME, 2400);
    assert!(error < 1e-3, "{error:e}");
}

#[test]
fn a_step_far_above_the_limit_is_cut_or_refused() {
    for stiffness in [1e2, 1e4, 1e6, 1e10, 1e30] {
        let mut parts = Parts::block([2, 2, 2], 0.05, 0.01, stiffness);
        pin_where(&mut parts, |p| p.y == 0.1);
        let mut scene = Scene::new(&parts, gravity());
        let limit = {
            let mut probe = Scene::new(&parts, gravity());
            match probe.world.step(1e-6) {
                Ok(report) => report.stable_substep,
                Err(Error::Unstable { report, .. }) => report.stable_substep,
                Err(error) => panic!("{error}"),
            }
        };
        let before = scene.world.state_hash();
        let energy = scene.energy();
        match scene.world.step(1.0) {
            Ok(report) => {
                assert!(report.substeps as f32 >= 1.0 / limit, "{report:?}");
                assert!(scene.is_finite());
                // The energy of gravity: the block falls by at most twice its static sag.
                assert!(scene.energy() <= energy + 0.1 * energy.abs() + 1e-3);
            }
            Err(Error::Unstable { report, allowed }) => {
                assert_eq!(allowed, 1000);
                assert!(1.0 / report.stable_substep > 800.0, "{report:?}");
                assert_eq!(scene.world.state_hash(), before);
            }
            Err(error) => panic!("{error}"),
        }
    }
}

/// A sheet in a plane through the origin, stretched and held at its border, that is struck across its plane.
fn drum() -> (Parts, Vec<Vec3>) {
    const SIDE: usize = 12;
    const SPACING: f32 = 1.0 / 64.0;
    let position = |node: usize| SPACING * Vec3::new((node % SIDE) as f32, 0.0, (node / SIDE) as f32);
    let mut parts = Parts::nodes((0..SIDE * SIDE).map(position).collect(), 1e-4);
    for node in 0..SIDE * SIDE {
        let (column, row) = (node % SIDE, node / SIDE);
        for (last, neighbour) in [(column, node + 1), (row, node + SIDE)] {
            if last + 1 < SIDE {
                parts.join(node, neighbour, 100.0);
            }
        }
    }
    parts.rest_lengths.iter_mut().for_each(|length| *length *= 0.9);
    damp(&mut parts, 60.0);
    let rim = (SIDE - 1) as f32 * SPACING;
    pin_where(&mut parts, |p| {
        [p.x, p.z].iter().any(|&position| position == 0.0 || position == rim)
    });
    let struck = parts
        .masses
        .iter()
        .map(|&mass| if mass > 0.0 { 0.03 * Vec3::Y } else { Vec3::ZERO });
    let struck = struck.collect();
    (parts, struck)
}

/// Processors can take a hundred times as long for subnormal numbers: squares of velocities and of displacements must
/// not be subnormal.
#[test]
fn a_body_coming_to_rest_has_no_subnormal_numbers() {
    let is_normal_or_zero = |value: f32| value == 0.0 || (value * value).is_normal();
    let (parts, struck) = drum();
    for (solver, storage, frames) in [
        (Solver::Verlet, Storage::Packed, 180),
        (Solver::Verlet, Storage::Efficient, 180),
        (Solver::Verlet, Storage::FastLink, 180),
        (Solver::Verlet, Storage::DynamicBulk, 180),
        (Solver::Implicit, Storage::Packed, 1200),
    ] {
        let mut scene = Scene::with(&parts, FREE, |definition| BodyDefinition {
            solver,
            storage,
            ..definition
        });
        scene.body_mut().set_velocities(&struck).expect("velocities");
        scene.run(FRAME, frames);
        let across = scene.body().positions().iter().map(|p| p.y.abs()).fold(0.0, f32::max);
        assert!(
            across < 1e-12,
            "{solver:?}, {storage:?}: it is still {across:e} m from its plane"
        );
        for velocity in scene.body().velocities() {
            let values = velocity.to_array();
            assert!(
                values.into_iter().all(is_normal_or_zero),
                "{solver:?}, {storage:?}: {velocity:?}"
            );
        }
        for &[a, b] in &parts.springs {
            let span = scene.body().positions()[b as usize] - scene.body().positions()[a as usize];
            let values = span.to_array();
            assert!(
                values.into_iter().all(is_normal_or_zero),
                "{solver:?}, {storage:?}: {span:?}"
            );
        }
    }
}

#[test]
fn a_released_pin_comes_to_rest() {
    let mut parts = Parts::chain(6, Vec3::X * 0.02, 0.01, 50.0);
    damp(&mut parts, 4.0);
    parts.masses[0] = 0.0;
    let mut scene = Scene::new(&parts, FREE);
    scene.body_mut().pin(5).expect("a pin");
    scene.body_mut().move_pin(5, Vec3::new(1.0, 0.1, 0.0)).expect("a pin");
    scene.run(FRAME, 60);
    let held = scene.energy();
    scene.body_mut().unpin(5).expect("a pin");
    watch(&mut scene, "let go", FRAME, 1200, SHADOW * held);
    // A chain of springs has no shape, only lengths.
    for pair in scene.positions().windows(2) {
        let error = pair[0].distance(pair[1]) / 0.02 - 1.0;
        assert!(error.abs() < 1e-4, "{error:e}");
    }
    let speed = scene.velocities().iter().map(|v| v.length()).fold(0.0, f64::max);
    assert!(speed < 1e-4, "{speed}");
}

#[test]
fn a_pin_adds_no_more_energy_than_its_work() {
    for h in [1e-4_f32, 1e-3, FRAME, 0.2] {
        let mut parts = Parts::block([3, 3, 3], 0.05, 0.01, 100.0);
        pin_where(&mut parts, |p| p.y == 0.0);
        let mut scene = Scene::new(&parts, FREE);
        let node = parts.positions.len() - 1;
        let from = parts.positions[node];
        let to = from + Vec3::new(3.0, 4.0, 0.0);
        scene.body_mut().pin(node as u32).expect("a pin");
        scene.body_mut().move_pin(node as u32, to).expect("a pin");
        scene.step(h);
        assert_eq!(scene.body().positions()[node], to);
        let force = scene.body().pin_force(node as u32).expect("a pin");
        let work = f64::from(force.dot(to - from));
        let energy = scene.energy();
        assert!(work > 0.0 && energy <= SHADOW * work, "h {h}: {energy} J from {work} J");
        watch(&mut scene, "pulled", h, 200, SHADOW * SHADOW * work);
    }
}

#[test]
fn the_work_of_a_pin_is_the_energy_of_the_body() {
    let mut parts = Parts::block([2, 2, 2], 0.05, 0.01, 100.0);
    pin_where(&mut parts, |p| p.y == 0.0);
    let mut scene = Scene::new(&parts, gravity());
    let node = parts.positions.len() - 1;
    scene.body_mut().pin(node as u32).expect("a pin");
    let start = scene.energy();
    let (mut at, mut work) = (parts.positions[node], 0.0);
    let mass = f64::from(parts.masses[node]);
    for _ in 0..200 {
        let to = at + Vec3::new(2e-4, 1e-4, -1e-4);
        scene.body_mut().move_pin(node as u32, to).expect("a pin");
        scene.step(1e-3);
        let force = scene.body().pin_force(node as u32).expect("a pin");
        work += force.as_dvec3().dot((to - at).as_dvec3());
        at = to;
    }
    // The pin force also carries the pin's own weight, and its height counts; its speed does not.
    let gained = scene.energy() - start;
    assert!(
        mass > 0.0 && (gained / work - 1.0).abs() < 2e-3,
        "{gained} J gained from {work} J"
    );
}

#[test]
fn a_body_at_ten_kilometres_moves_as_at_the_origin() {
    let mut parts = Parts::block([3, 2, 2], 0.0625, 0.01, 60.0);
    pin_where(&mut parts, |p| p.x == 0.0);
    let offset = Vec3::new(10_000.0, -10_000.0, 10_000.0);
    let far = parts.moved(Quat::IDENTITY, offset);
    let (mut near, mut far) = (Scene::new(&parts, gravity()), Scene::new(&far, gravity()));
    let half_ulp = 0.5 * f64::from(offset.x.next_up() - offset.x) * 3.0_f64.sqrt();
    for _ in 0..300 {
        near.step(2e-3);
        far.step(2e-3);
        let expected: Vec<DVec3> = near.positions().iter().map(|p| *p + offset.as_dvec3()).collect();
        let error = largest_difference(&far.positions(), &expected);
        assert!(error < half_ulp + 2e-6, "{error:e}");
        // Velocities are not rounded on output.
        let error = largest_difference(&far.velocities(), &near.velocities());
        assert!(error < 1e-4, "{error:e} m/s");
    }
}

#[test]
fn frames_of_varying_length_reach_the_same_rest_shape() {
    let mut parts = Parts::block([2, 2, 2], 0.05, 0.01, 100.0);
    pin_where(&mut parts, |p| p.x == 0.0);
    damp(&mut parts, 4.0);
    let mut even = Scene::new(&parts, gravity());
    even.run(FRAME, 900);
    let least = even.energy();
    let mut uneven = Scene::new(&parts, gravity());
    let given = uneven.energy() - least;
    assert!(given > 0.0);
    let mut random = Random::new(13);
    for _ in 0..900 {
        let h = 1e-3 * (15.5 + 14.5 * random.signed());
        let substeps = uneven.step(h).substeps;
        let gained = uneven.energy() - least;
        assert!(
            gained <= SHADOW * given,
            "{gained} J of {given} after {h} s in {substeps}"
        );
    }
    let error = largest_difference(&uneven.positions(), &even.positions()) / parts.size();
    assert!(error < 1e-5, "{error:e}");
}

#[test]
fn a_force_of_a_million_newtons_leaves_the_body_finite_or_unchanged() {
    for h in [1e-5_f32, 1e-3, FRAME, 0.1, 1.0] {
        let mut parts = Parts::block([2, 2, 2], 0.05, 0.01, 100.0);
        pin_where(&mut parts, |p| p.x == 0.0);
        let mut scene = Scene::new(&parts, FREE);
        let node = parts.positions.len() - 1;
        let before = scene.positions()[node];
        scene
            .body_mut()
            .apply_force(node as u32, Vec3::new(6e5, 8e5, 0.0))
            .expect("a force");
        step_or_refuse(&mut scene, h);
        let pushed = scene.positions()[node] - before;
        let work = pushed.dot(DVec3::new(6e5, 8e5, 0.0));
        for _ in 0..100 {
            step_or_refuse(&mut scene, h);
            assert!(
                scene.energy() <= SHADOW * SHADOW * work,
                "h {h}: {} J of {work}",
                scene.energy()
            );
        }
    }
}

/// Takes a step that may be refused without changes, and returns true if it was taken.
fn step_or_refuse(scene: &mut Scene, h: f32) -> bool {
    let before = (scene.world.state_hash(), scene.positions(), scene.velocities());
    match scene.world.step(h) {
        Ok(report) => assert!(report.stable_substep > 0.0),
        Err(Error::Unstable { .. }) => {
            let after = (scene.world.state_hash(), scene.positions(), scene.velocities());
            assert_eq!(before, after);
            return false;
        }
        Err(error) => panic!("{error}"),
    }
    assert!(scene.is_finite());
    true
}

#[test]
fn steps_from_ten_microseconds_to_a_second_stay_finite() {
    let (parts, starts) = bad_starts();
    let mut random = Random::new(14);
    for exponent in 0..=10 {
        let h = 1e-5 * 10.0_f32.powf(0.5 * exponent as f32);
        for stiffness in [0.0, 1e-6, 1.0, 1e4] {
            let mut stiffer = parts.clone();
            for k in &mut stiffer.stiffnesses {
                *k *= stiffness;
            }
            for damping in &mut stiffer.node_dampings {
                *damping = random.signed().max(0.0);
            }
            for (_, positions) in &starts {
                let mut scene = Scene::new(&stiffer, gravity());
                scene.body_mut().set_positions(positions).expect("positions");
                for _ in 0..5 {
                    step_or_refuse(&mut scene, h);
                }
            }
        }
    }
}

#[test]
fn steps_of_absurd_length_are_taken_or_refused() {
    let parts = Parts::block([1, 1, 1], 0.05, 0.01, 100.0);
    let free = Parts::nodes(vec![Vec3::ZERO, Vec3::X], 1.0);
    for parts in [parts, free] {
        for h in [1e-45, 1e-38, 1e-20, 10.0, 1e10, 1e30, f32::MAX] {
            let mut scene = Scene::new(&parts, gravity());
            for _ in 0..3 {
                step_or_refuse(&mut scene, h);
            }
            scene
                .body_mut()
                .set_velocities(&vec![Vec3::ZERO; parts.positions.len()])
                .expect("velocities");
            step_or_refuse(&mut scene, 1e-3);
        }
        for h in [0.0, -1e-3, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut scene = Scene::new(&parts, gravity());
            let before = scene.world.state_hash();
            assert!(matches!(scene.world.step(h), Err(Error::InvalidArgument(_))));
            assert_eq!(scene.world.state_hash(), before);
        }
    }
}

/// The bound on the step must not become stale where a small stiff part of a large body changes.
#[test]
fn a_stiff_corner_of_a_large_body_stays_stable() {
    // Springs of 1 mm hold a node from six sides; far away are springs of 10 m that hardly pull.
    let mut parts = Parts::nodes(vec![Vec3::ZERO], 0.001);
    for direction in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
        parts.positions.push(1e-3 * direction);
    }
    for i in 0..30 {
        parts.positions.push(Vec3::new(10.0 * i as f32, 5.0, 0.0));
    }
    parts.masses.resize(parts.positions.len(), 1.0);
    parts.node_dampings.resize(parts.positions.len(), 0.0);
    for i in 1..=6 {
        parts.join(0, i, 1000.0);
    }
    for i in 8..37 {
        parts.join(i - 1, i, 1e-3);
    }
    let mut scene = Scene::new(&parts, FREE);
    for i in 1..=6 {
        scene.body_mut().pin(i).expect("a pin");
    }
    // Stretched to ten times their length, the springs also hold the node transversely: omega² grows from 2 to 5.6 k/m.
    for step in 1..=10 {
        for i in 1..=6 {
            let to = parts.positions[i as usize] * (1.0 + 0.9 * step as f32);
            scene.body_mut().move_pin(i, to).expect("a pin");
        }
        scene.step(0.1);
    }
    let still = scene.energy();
    scene
        .body_mut()
        .apply_force(0, Vec3::new(0.3, 0.2, 0.1))
        .expect("a force");
    let at = scene.positions()[0];
    scene.step(1e-3);
    let given = (scene.positions()[0] - at).dot(DVec3::new(0.3, 0.2, 0.1));
    assert!(given > 0.0);
    watch(
        &mut scene,
        "drawn out",
        FRAME,
        300,
        still + SHADOW * SHADOW * given + 1e-6 * still,
    );
}

#[test]
fn stretched_elements_take_substeps_near_the_bound_of_their_law() {
    const NU: f64 = 0.3;
    let mesh = sinew::mesh::Mesh::block([0.04; 3], [3; 3]).expect("a block");
    let stable = |stretch: f32, across: f32| {
        let mut world = sinew::World::new(sinew::WorldDefinition::default()).expect("a world");
        let definition = sinew::BodyDefinition {
            masses: sinew::Values::Uniform(1e-3),
            mass_scaling: 0.0,
            material: Some(sinew::Material {
                model: sinew::Model::Tetrahedra,
                young_modulus: 1e4,
                poisson_ratio: NU as f32,
                ..Default::default()
            }),
            ..BodyDefinition::of(&mesh)
        };
        let body = world.create_body(&definition).expect("a body");
        let drawn: Vec<_> = mesh
            .positions
            .iter()
            .map(|position| *position * glam::vec3(stretch, across, across))
            .collect();
        world
            .body_mut(body)
            .expect("a body")
            .set_positions(&drawn)
            .expect("positions");
        f64::from(world.step(1e-7).expect("a step").stable_substep)
    };
    // The stiffness of the law along a stretch, relative to E: St. Venant-Kirchhoff with `kappa / 2 (J - 1)^2` for all
    // of lambda.
    let (lambda, mu) = (NU / ((1.0 + NU) * (1.0 - 2.0 * NU)), 0.5 / (1.0 + NU));
    let stiff = |stretch: f64, across: f64| {
        let stress = mu * (stretch * stretch - 1.0);
        2.0 * mu * stretch * stretch + stress + lambda * across.powi(4)
    };
    for (stretch, across) in [(2.0, 0.9), (3.0, 0.8), (5.0, 0.7)] {
        let found = stable(stretch, across) / stable(1.0, 1.0);
        let allowed = (stiff(1.0, 1.0) / stiff(f64::from(stretch), f64::from(across))).sqrt();
        assert!(
            found > 0.55 * allowed && found < 1.1 * allowed,
            "{stretch} times as long: {found} of {allowed}"
        );
    }
}

/// An organ that is suddenly twice as long stiffens within the first step, before any force shows it. A step is refused
/// only where it needs more substeps than are allowed.
#[test]
fn a_sudden_stretch_is_refused_only_if_it_needs_too_many_substeps() {
    let mesh = sinew::mesh::Mesh::organ(0.15, 0.0187).expect("an organ");
    let mut taken = 0;
    for (stretch, dt) in [(1.5, 1.0 / 30.0), (2.0, FRAME), (2.0, 1.0 / 30.0), (3.0, FRAME)] {
        let mut world = World::new(FREE).expect("a world");
        let definition = BodyDefinition {
            element_law: sinew::ElementLaw::MooneyRivlin { ratio: 0.3 },
            ..of_elements(&mesh, [1e3, 0.49, 1000.0])
        };
        let id = world.create_body(&definition).expect("a body");
        let body = world.body_mut(id).expect("the body");
        let left = mesh
            .positions
            .iter()
            .map(|position| position.x)
            .fold(f32::INFINITY, f32::min);
        body.pin_box(Vec3::splat(-9.0), Vec3::new(left + 0.0075, 9.0, 9.0))
            .expect("pins");
        let drawn: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|position| Vec3::new(left + (position.x - left) * stretch, position.y, position.z))
            .collect();
        body.set_positions(&drawn).expect("positions");
        match world.step(dt) {
            Ok(_) => taken += 1,
            Err(Error::Unstable { report, allowed }) => {
                let needed = dt / (0.8 * report.stable_substep);
                assert!(
                    needed > allowed as f32,
                    "{stretch} times as long: {needed} substeps of {allowed}"
                );
            }
            Err(error) => panic!("{stretch} times as long: {error}"),
        }
    }
    assert!(taken >= 2, "only {taken} of the steps were taken");
}

/// Two separate tetrahedra, the larger so stiff that its bound at rest is above that of the smaller with its springs.
/// Where the smaller one is stretched, its springs still count: the substep is no longer than for the smaller one
/// alone.
#[test]
fn springs_count_beside_distant_stiffer_elements() {
    let corners = |edge: f32, at: f32| [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].map(|p| edge * p + at * Vec3::X);
    let edges = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
    let stable = |positions: &[Vec3], moved: &[Vec3], stiffness: f32| {
        let cells: Vec<[u32; 4]> = (0..positions.len() as u32 / 4)
            .map(|cell| [0, 1, 2, 3].map(|corner| 4 * cell + corner))
            .collect();
        let mut world = World::new(FREE).expect("a world");
        let body = world
            .create_body(&BodyDefinition {
                positions,
                tetrahedra: &cells,
                springs: Some(&edges),
                stiffnesses: Values::Uniform(stiffness),
                masses: Values::Uniform(1e-3),
                material: Some(Material {
                    model: Model::Tetrahedra,
                    young_modulus: 1e4,
                    poisson_ratio: 0.3,
                    ..Default::default()
                }),
                mass_scaling: 0.0,
                ..Default::default()
            })
            .expect("a body");
        world
            .body_mut(body)
            .expect("a body")
            .set_positions(moved)
            .expect("positions");
        world.step(1e-7).expect("a step").stable_substep
    };
    let bound = |stable: f32| 1.0 / (stable * stable);
    let (edge, stretched) = (0.01, 2.0);
    let small = corners(edge, 0.0);
    // As stiff as the elements, and with them just below the bound of the larger one.
    let element_bound = bound(stable(&small, &small, 0.0));
    let spring_bound = bound(stable(&small, &small, 1.0)) - element_bound;
    let stiffness = element_bound / spring_bound;
    let larger = 1.05 * edge * bound(stable(&small, &small, stiffness)) / element_bound;
    let large = corners(larger, 1.0);
    let moved = small.map(|p| stretched * p);
    let alone = stable(&small, &moved, stiffness);
    assert!(
        alone < 0.9 * stable(&large, &large, 0.0),
        "the smaller one was to bound substeps"
    );
    let together = stable(&[small, large].concat(), &[moved, large].concat(), stiffness);
    assert!(together < 1.001 * alone, "{together} s, alone {alone}");
}
