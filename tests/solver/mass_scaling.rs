//! Mass scaling: a few light nodes between stiff springs, as in mesh slivers, do not slow the body down.

use crate::support::bodies::{FREE, Parts, Random, Scene, largest_difference};
use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, BodyId, Error, Material, Model, Solver, StepReport, Storage, Values, Viscosity, World,
    WorldDefinition,
};

const FRAME: f32 = 1.0 / 60.0;
const G: f32 = 9.81;
/// The default for the fraction of mass that may be added.
const DEFAULT: f64 = 0.001;
/// A fraction that is enough for the slivers of a small body.
const PLENTY: f64 = 0.02;
/// The fraction of the longest stable substep that is used.
const RESERVE: f64 = 0.9;

fn gravity() -> WorldDefinition {
    WorldDefinition {
        gravity: Vec3::NEG_Y * G,
        ..FREE
    }
}

/// A block of uneven cells with `count` nodes of a thousandth of the mass, each joined to the eight nodes around it. If
/// `held`, the top is pinned.
fn slivers(cells: usize, count: usize, held: bool) -> Parts {
    const SPACING: f32 = 0.01;
    const MASS: f32 = 1e-3;
    const STIFFNESS: f32 = 100.0;
    let mut random = Random::new(21);
    let mut parts = Parts::block([cells; 3], SPACING, MASS, STIFFNESS);
    let regular = parts.positions.len();
    for sliver in 0..count {
        let mut along = || (random.below(cells) as f32 + 0.5) * SPACING;
        let place = Vec3::new(along(), along(), along());
        parts.positions.push(place + 0.1 * SPACING * random.vector());
        parts.masses.push(1e-3 * MASS);
        parts.node_dampings.push(0.0);
        let mut others: Vec<usize> = (0..regular).collect();
        others.sort_by(|&a, &b| {
            let distance = |node: usize| parts.positions[node].distance_squared(place);
            distance(a).total_cmp(&distance(b))
        });
        for &other in &others[..8] {
            parts.join(regular + sliver, other, 0.1 * STIFFNESS);
        }
    }
    if held {
        let top = SPACING * cells as f32;
        for (position, mass) in parts.positions.iter().zip(&mut parts.masses) {
            if position.y > top - 1e-4 {
                *mass = 0.0;
            }
        }
    }
    parts
}

fn total_mass(parts: &Parts) -> f64 {
    parts.masses.iter().map(|&mass| f64::from(mass)).sum()
}

fn scene(parts: &Parts, world: WorldDefinition, mass_scaling: f32) -> Scene {
    Scene::with(parts, world, |definition| BodyDefinition {
        mass_scaling,
        ..definition
    })
}

fn added(scene: &Scene) -> f64 {
    scene.body().solver_report().added_mass
}

/// Returns the mass that each node needs for this substep (kg), or its own mass if that is larger.
fn masses_for(parts: &Parts, substep: f64) -> Vec<f64> {
    let mut stiffnesses = vec![0.0; parts.positions.len()];
    for (spring, &stiffness) in parts.springs.iter().zip(&parts.stiffnesses) {
        for &node in spring {
            stiffnesses[node as usize] += f64::from(stiffness);
        }
    }
    let step = substep / RESERVE;
    let masses = parts.masses.iter().zip(&stiffnesses);
    masses
        .map(|(&mass, stiffness)| match f64::from(mass) {
            0.0 => 0.0,
            mass => mass.max(0.5 * step * step * stiffness),
        })
        .collect()
}

/// Leapfrog in `f64` from rest with this inertia and the unscaled weight.
fn leapfrog(parts: &Parts, inertia: &[f64], substep: f64, substeps: u32) -> Vec<DVec3> {
    let mut reference = parts.reference(Vec3::ZERO);
    let weights: Vec<DVec3> = (parts.masses.iter().map(|&mass| DVec3::NEG_Y * f64::from(G * mass))).collect();
    for index in 0..substeps {
        let forces = reference.forces();
        let time = if index == 0 { 0.5 * substep } else { substep };
        for node in 0..inertia.len() {
            if inertia[node] > 0.0 {
                reference.velocities[node] += (forces[node] + weights[node]) / inertia[node] * time;
                let displacement = reference.velocities[node] * substep;
                reference.positions[node] += displacement;
            }
        }
    }
    reference.positions
}

#[test]
fn a_body_moves_with_the_reported_inertia_and_its_own_weight() {
    let parts = slivers(8, 6, true);
    let mut scene = scene(&parts, gravity(), DEFAULT as f32);
    let mut substeps = 0;
    for _ in 0..6 {
        substeps += scene.step(FRAME).substeps;
    }
    let substep = 6.0 * f64::from(FRAME) / f64::from(substeps);
    let inertia = masses_for(&parts, substep);
    let expected = inertia.iter().sum::<f64>() - total_mass(&parts);
    assert!(expected > 0.0 && expected <= DEFAULT * total_mass(&parts), "{expected}");
    assert!(
        (added(&scene) / expected - 1.0).abs() < 1e-5,
        "{} of {expected}",
        added(&scene)
    );
    let reference = leapfrog(&parts, &inertia, substep, substeps);
    let error = largest_difference(&scene.positions(), &reference) / parts.size();
    assert!(error < 1e-5, "{error:e}");
    // The number of substeps is minimal: one fewer would need too much added mass.
    let fewer = f64::from(FRAME) / (f64::from(substeps / 6) - 1.0);
    let more = masses_for(&parts, fewer).iter().sum::<f64>() - total_mass(&parts);
    assert!(more > DEFAULT * total_mass(&parts), "{more}");
}

/// The added mass acts as a load of its mass times its acceleration. Relative to the weight, this load is at most the
/// added fraction, times 2 for a sudden load, and times 2 for accelerations beyond g. A light node also lags: its
/// springs must accelerate the added mass, twice as much after a sudden start, and twice more at turning points.
#[test]
fn the_motion_agrees_with_that_without_added_mass() {
    let parts = slivers(8, 6, true);
    let mut plain = scene(&parts, gravity(), 0.0);
    let mut scaled = scene(&parts, gravity(), DEFAULT as f32);
    let start = plain.positions();
    let mut farthest = 0.0_f64;
    for frame in 0..60 {
        let (many, few) = (plain.step(FRAME).substeps, scaled.step(FRAME).substeps);
        assert!(3 * few <= many, "{few} substeps for {many}");
        farthest = farthest.max(largest_difference(&plain.positions(), &start));
        let error = largest_difference(&plain.positions(), &scaled.positions());
        let inertia = masses_for(&parts, f64::from(FRAME) / f64::from(few));
        let masses = inertia.iter().zip(&parts.masses);
        let heaviest = masses.fold(0.0_f64, |most, (inertia, &mass)| most.max(inertia - f64::from(mass)));
        // Eight springs of 10 N/m, a third of them along each axis.
        let lag = 4.0 * heaviest * f64::from(G) / (8.0 * 10.0 / 3.0);
        // The slowest mode swings by half of the maximum displacement about an equal sag. It lags by half of its growth
        // in mass, and by the h² omega² / 24 of a longer substep. Faster modes swing less, by the square of the
        // frequency ratio.
        let omega = (2.0 * f64::from(G) / farthest).sqrt();
        let substep = f64::from(FRAME) / f64::from(few);
        let behind =
            omega * f64::from(FRAME) * f64::from(frame + 1) * (DEFAULT / 2.0 + (substep * omega).powi(2) / 24.0);
        let most = lag + (4.0 * DEFAULT + behind) * farthest;
        assert!(
            error < most,
            "frame {frame}: {error:e}, at most {most:e} of {farthest:e}"
        );
        assert!(most < 0.1 * farthest, "{most:e} of {farthest:e}");
    }
    assert_eq!(added(&plain), 0.0);
    assert!(added(&scaled) > 0.0);
}

#[test]
fn pins_carry_the_unscaled_weight() {
    let mut parts = slivers(4, 4, true);
    for (damping, mass) in parts.node_dampings.iter_mut().zip(&parts.masses) {
        *damping = 15.0 * mass;
    }
    // A larger fraction, to make an error visible.
    let mut scene = scene(&parts, gravity(), 0.02);
    scene.run(FRAME, 300);
    let part = added(&scene) / total_mass(&parts);
    assert!(part > 1e-3, "{part}");
    let held = (0..parts.masses.len() as u32).filter(|&node| parts.masses[node as usize] == 0.0);
    let force: DVec3 = held
        .map(|node| scene.body().pin_force(node).expect("a pin").as_dvec3())
        .sum();
    let weight = total_mass(&parts) * f64::from(G);
    assert!(
        (force - DVec3::Y * weight).length() < 1e-5 * weight,
        "{force} for {weight}"
    );
}

/// With damping proportional to mass all nodes fall alike, so that no spring is stretched.
#[test]
fn weight_and_damping_of_a_scaled_node_are_unchanged() {
    const RATE: f32 = 5.0;
    let mut parts = slivers(6, 5, false);
    for (damping, mass) in parts.node_dampings.iter_mut().zip(&parts.masses) {
        *damping = RATE * mass;
    }
    let mut scene = scene(&parts, gravity(), PLENTY as f32);
    scene.run(FRAME, 240);
    assert!(added(&scene) > 0.0);
    for velocity in scene.velocities() {
        let error = velocity - DVec3::NEG_Y * f64::from(G / RATE);
        assert!(error.length() < 1e-4 * f64::from(G / RATE), "{error}");
    }
}

#[test]
fn no_mass_is_added_with_fixed_substeps_or_a_tolerance() {
    let parts = slivers(4, 4, true);
    let fixed = WorldDefinition {
        substeps: 400,
        ..gravity()
    };
    let tolerant = WorldDefinition {
        tolerance: 1e-3,
        max_substeps: 100_000,
        ..gravity()
    };
    for world in [fixed, tolerant] {
        let mut scenes = [0.0, 0.02].map(|part| scene(&parts, world, part));
        for scene in &mut scenes {
            scene.run(FRAME, 5);
            assert_eq!(added(scene), 0.0);
        }
        assert_eq!(scenes[0].positions(), scenes[1].positions());
        assert_eq!(scenes[0].velocities(), scenes[1].velocities());
    }
    // The same body gets added mass where it is allowed.
    let mut free = scene(&parts, gravity(), 0.02);
    free.step(FRAME);
    assert!(added(&free) > 0.0);
}

#[test]
fn a_body_without_slivers_is_unaffected() {
    let even = Parts::block([6; 3], 0.01, 1e-3, 100.0);
    let mut scenes = [0.0, DEFAULT as f32].map(|part| scene(&even, gravity(), part));
    for scene in &mut scenes {
        scene.run(FRAME, 20);
        assert_eq!(added(scene), 0.0);
    }
    assert_eq!(scenes[0].world.state_hash(), scenes[1].world.state_hash());
    // A step that is short anyway needs no added mass either.
    let parts = slivers(6, 4, true);
    let mut short = scene(&parts, gravity(), DEFAULT as f32);
    for _ in 0..10 {
        assert_eq!(short.step(1e-5).substeps, 1);
    }
    assert_eq!(added(&short), 0.0);
}

/// Leapfrog keeps a shadow energy; the energy is at most E0 / (1 - (h omega)²/4), with h omega up to 0.9 of its limit.
#[test]
fn energy_does_not_grow() {
    energy_does_not_grow_of(&[(0.02, 1e-4)]);
}

#[test]
#[ignore = "long"]
fn energy_does_not_grow_in_the_other_cases() {
    energy_does_not_grow_of(&[(0.003, 0.0), (0.02, 0.0), (0.2, 0.0)]);
}

fn energy_does_not_grow_of(cases: &[(f32, f32)]) {
    const SHADOW: f64 = 1.0 / (1.0 - RESERVE * RESERVE);
    for &(part, spring_damping) in cases {
        let mut parts = slivers(5, 5, false);
        parts.spring_damping = spring_damping;
        let mut scene = scene(&parts, FREE, part);
        let mut random = Random::new(22);
        let velocities: Vec<Vec3> = parts.positions.iter().map(|_| 0.2 * random.vector()).collect();
        scene.body_mut().set_velocities(&velocities).expect("velocities");
        scene.step(FRAME);
        let most = SHADOW * scene.energy();
        for step in 0..600 {
            // Masses follow the length of the step.
            let report = scene.step(FRAME * (0.75 + 0.25 * random.signed()));
            assert!(report.stable_substep * report.substeps as f32 >= 0.5 * FRAME);
            let energy = scene.energy();
            assert!(energy <= most, "step {step}, {part}: {energy} J of {most}");
            assert!(added(&scene) <= f64::from(part) * total_mass(&parts));
        }
        assert!(added(&scene) > 0.0, "{part}");
    }
}

/// The added mass lies on one side, and gravity acts on all of it, so the body falls without rotating.
#[test]
fn a_falling_body_does_not_rotate() {
    const STEPS: usize = 30;
    let parts = slivers(5, 1, false);
    let extent = 0.05;
    let mut scene = scene(&parts, gravity(), PLENTY as f32);
    scene.run(FRAME, STEPS);
    let lacks_weight = added(&scene);
    assert!(lacks_weight > 1e-4 * total_mass(&parts), "{lacks_weight} kg");
    let (positions, velocities) = (scene.positions(), scene.velocities());
    let count = positions.len() as f64;
    let [centre, mean] = [&positions, &velocities].map(|all| all.iter().sum::<DVec3>() / count);
    let turns = positions
        .iter()
        .zip(&velocities)
        .map(|(position, velocity)| (position - centre).cross(velocity - mean) * 1e-3);
    let turns = turns.sum::<DVec3>().length();
    // The rotation if the added mass had no weight, a tenth of the body's size from the center.
    let expected_turn = lacks_weight * 0.1 * extent * f64::from(G * FRAME * STEPS as f32);
    assert!(turns < 0.02 * expected_turn, "{turns:e} kg m2/s, {expected_turn:e}");
}

#[test]
fn momentum_is_kept() {
    let parts = slivers(5, 5, false);
    let mut scene = scene(&parts, FREE, PLENTY as f32);
    scene.step(FRAME);
    assert!(added(&scene) > 0.0);
    let mut random = Random::new(23);
    let velocities: Vec<Vec3> = parts.positions.iter().map(|_| 0.2 * random.vector()).collect();
    scene.body_mut().set_velocities(&velocities).expect("velocities");
    let substep = f64::from(FRAME) / f64::from(scene.step(FRAME).substeps);
    let inertia = masses_for(&parts, substep);
    let momentum = |scene: &Scene| -> DVec3 { scene.velocities().iter().zip(&inertia).map(|(v, m)| v * m).sum() };
    let start = momentum(&scene);
    scene.run(FRAME, 30);
    let change = (momentum(&scene) - start).length();
    let scale: f64 = inertia.iter().sum::<f64>() * 0.2;
    assert!(change < 1e-6 * scale, "{change:e} of {scale:e}");
}

#[test]
fn any_number_of_threads_is_bitwise_identical() {
    let parts = slivers(20, 30, true);
    assert!(parts.positions.len() > 8192);
    let hashes = [1, 2, 5].map(|thread_count| {
        let world = WorldDefinition {
            thread_count,
            ..gravity()
        };
        let mut scene = scene(&parts, world, DEFAULT as f32);
        scene.run(FRAME, 4);
        assert!(added(&scene) > 0.0);
        scene.world.state_hash()
    });
    assert!(hashes.iter().all(|&hash| hash == hashes[0]));
}

#[test]
fn all_storages_agree() {
    let parts = slivers(8, 6, true);
    let storages = [
        Storage::Packed,
        Storage::Efficient,
        Storage::FastLink,
        Storage::DynamicBulk,
    ];
    let runs = storages.map(|storage| {
        let mut scene = Scene::with(&parts, gravity(), |definition| BodyDefinition { storage, ..definition });
        let mut substeps = 0;
        for _ in 0..10 {
            substeps += scene.step(FRAME).substeps;
        }
        (substeps, added(&scene), scene.positions())
    });
    for (storage, (substeps, mass, positions)) in storages.iter().zip(&runs) {
        assert_eq!(*substeps, runs[0].0, "{storage:?}");
        assert!(
            *mass > 0.0 && (mass / runs[0].1 - 1.0).abs() < 1e-5,
            "{storage:?}: {mass}"
        );
        let error = largest_difference(positions, &runs[0].2) / parts.size();
        assert!(error < 1e-5, "{storage:?}: {error:e}");
    }
}

#[test]
fn a_failed_step_restores_the_masses() {
    let parts = slivers(5, 5, true);
    let mut tried = scene(&parts, gravity(), PLENTY as f32);
    let mut plain = scene(&parts, gravity(), PLENTY as f32);
    for scene in [&mut tried, &mut plain] {
        scene.run(FRAME, 3);
        assert!(added(scene) > 0.0);
    }
    for dt in [10.0, 1e-3, 30.0] {
        let (before, mass) = (tried.world.state_hash(), added(&tried));
        if dt > 1.0 {
            assert!(matches!(tried.world.step(dt), Err(Error::Unstable { .. })));
            assert_eq!((tried.world.state_hash(), added(&tried)), (before, mass));
        }
        for scene in [&mut tried, &mut plain] {
            scene.run(1e-3, 2);
            scene.run(FRAME, 2);
        }
        assert_eq!(tried.world.state_hash(), plain.world.state_hash());
    }
    // A body that becomes infinite is rolled back together with its masses.
    let far = vec![Vec3::splat(1e30); parts.positions.len()];
    tried.body_mut().set_velocities(&far).expect("velocities");
    let mass = added(&tried);
    assert_eq!(tried.world.step(FRAME).expect("a step").bodies_restored, 1);
    assert_eq!(added(&tried), mass);
}

#[test]
fn pin_and_spring_changes_update_the_added_mass() {
    let parts = slivers(5, 5, true);
    let sliver = (parts.positions.len() - 1) as u32;
    let mut scene = scene(&parts, gravity(), PLENTY as f32);
    scene.run(FRAME, 3);
    let all = added(&scene);
    let start = scene.energy();
    scene.body_mut().pin(sliver).expect("a pin");
    let others = added(&scene);
    assert!(others < 0.9 * all, "{others} of {all}");
    scene.run(FRAME, 3);
    scene.body_mut().unpin(sliver).expect("a pin");
    scene.run(FRAME, 3);
    assert!((added(&scene) / all - 1.0).abs() < 1e-5);
    // A light node without neighbors needs no added mass.
    let own: Vec<[u32; 2]> = parts
        .springs
        .iter()
        .copied()
        .filter(|pair| pair.contains(&sliver))
        .collect();
    for &[a, b] in &own {
        let before = scene.velocities();
        scene.body_mut().remove_spring(a, b).expect("a spring");
        let error = largest_difference(&before, &scene.velocities());
        assert!(error < 1e-4, "{error:e} m/s");
    }
    scene.run(FRAME, 1);
    assert!((added(&scene) / others - 1.0).abs() < 1e-5);
    for &[a, b] in &own {
        scene.body_mut().add_spring(a, b, 10.0, None).expect("no spring");
    }
    scene.run(FRAME, 1);
    assert!((added(&scene) / all - 1.0).abs() < 1e-5, "{} of {all}", added(&scene));
    // A refused change has no effect.
    let before = scene.world.state_hash();
    assert!(scene.body_mut().add_spring(0, 1, 1e5, None).is_err());
    assert_eq!(scene.world.state_hash(), before);
    let far = (parts.positions.len() / 2) as u32;
    scene
        .body_mut()
        .add_spring(sliver - 1, far, 10.0, None)
        .expect("no spring");
    for _ in 0..120 {
        scene.step(FRAME);
        assert!(added(&scene) <= PLENTY * total_mass(&parts));
        assert!(scene.is_finite() && scene.energy() < start + 0.1 * start.abs());
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let positions = [Vec3::ZERO, Vec3::X];
    for solver in [Solver::Verlet, Solver::Implicit] {
        let definition = |mass_scaling| BodyDefinition {
            positions: &positions,
            masses: Values::Uniform(1.0),
            solver,
            mass_scaling,
            ..BodyDefinition::default()
        };
        for bad in [-1e-6, 1.0001, f32::NAN, f32::INFINITY] {
            match world.create_body(&definition(bad)) {
                Err(Error::InvalidArgument(message)) => {
                    assert!(message.starts_with("mass_scaling is "), "{message}");
                }
                other => panic!("{bad}: {other:?}"),
            }
        }
        for good in [0.0, 0.001, 1.0] {
            world.create_body(&definition(good)).expect("a body");
        }
    }
    assert_eq!(
        f64::from(BodyDefinition::default().mass_scaling),
        f64::from(DEFAULT as f32)
    );
}

/// A block of finite elements, held at the top. A few of the elements are split in four by a light node at their
/// center.
struct Tissue {
    world: World,
    body: BodyId,
}

impl Tissue {
    const SIZE: [f32; 3] = [0.06, 0.04, 0.04];
    /// Enough for the light nodes.
    const PART: f32 = 0.01;

    fn mesh() -> Mesh {
        let mut mesh = Mesh::block(Self::SIZE, [6, 4, 4]).expect("a block");
        let mut random = Random::new(8);
        let count = mesh.tetrahedra.len();
        for _ in 0..2 {
            let cell = random.below(count);
            let [a, b, c, d] = mesh.tetrahedra[cell];
            let middle = [a, b, c, d].map(|node| mesh.positions[node as usize]);
            let new = mesh.positions.len() as u32;
            mesh.positions.push(middle.into_iter().sum::<Vec3>() / 4.0);
            mesh.tetrahedra[cell] = [new, b, c, d];
            mesh.tetrahedra.extend([[a, new, c, d], [a, b, new, d], [a, b, c, new]]);
        }
        mesh
    }

    fn new(mass_scaling: f32, poisson_ratio: f32, retardation_time: f32, world: WorldDefinition) -> Self {
        let mesh = Self::mesh();
        let mut world = World::new(world).expect("a world");
        let body = world.create_body(&BodyDefinition {
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: 5000.0,
                poisson_ratio,
                density: 1000.0,
                ..Material::default()
            }),
            viscosity: Viscosity {
                retardation_time,
                relaxation_time: 0.0,
            },
            mass_scaling,
            ..BodyDefinition::of(&mesh)
        });
        let body = body.expect("a body");
        for (node, position) in (0..).zip(&mesh.positions) {
            if position.y > 0.49 * Self::SIZE[1] {
                world.body_mut(body).expect("the body").pin(node).expect("a node");
            }
        }
        Self { world, body }
    }

    fn mass() -> f64 {
        1000.0 * Self::SIZE.into_iter().map(f64::from).product::<f64>()
    }

    fn step(&mut self, dt: f32) -> StepReport {
        let report = self.world.step(dt).expect("a step");
        assert_eq!(report.bodies_restored, 0);
        report
    }

    fn added(&self) -> f64 {
        self.world.body(self.body).expect("the body").solver_report().added_mass
    }

    fn positions(&self) -> Vec<DVec3> {
        let body = self.world.body(self.body).expect("the body");
        body.positions().iter().map(|position| position.as_dvec3()).collect()
    }

    fn energy(&self) -> f64 {
        let energy = self.world.body(self.body).expect("the body").energy(Vec3::NEG_Y * G);
        energy.kinetic + energy.elastic + energy.gravitational
    }
}

#[test]
fn light_nodes_of_elements_need_fewer_substeps_and_move_the_same() {
    for (nu, viscous) in [(0.3, 0.0), (0.45, 0.0), (0.3, 1e-5)] {
        let world = WorldDefinition {
            max_substeps: 100_000,
            ..gravity()
        };
        let mut plain = Tissue::new(0.0, nu, viscous, world);
        let mut scaled = Tissue::new(Tissue::PART, nu, viscous, gravity());
        let start = scaled.positions();
        let most = scaled.energy() + 1e-3 * Tissue::mass() * f64::from(G) * 0.01;
        for frame in 0..6 {
            let [many, few] = [&mut plain, &mut scaled].map(|tissue| tissue.step(FRAME).substeps);
            assert!(
                3 * few <= 2 * many,
                "nu {nu}, {viscous} s, frame {frame}: {few} substeps for {many}"
            );
            let added = scaled.added();
            assert!(
                added > 0.0 && added <= f64::from(Tissue::PART) * Tissue::mass(),
                "{added} kg"
            );
            assert!(scaled.energy() <= most);
        }
        assert_eq!(plain.added(), 0.0);
        let mean = |a: &[DVec3], b: &[DVec3]| {
            let squares = a.iter().zip(b).map(|(a, b)| a.distance_squared(*b));
            (squares.sum::<f64>() / a.len() as f64).sqrt()
        };
        let displacement = mean(&start, &plain.positions());
        let apart = mean(&scaled.positions(), &plain.positions());
        // The phase lags by half the added fraction, of about 9 radians of the slowest wave.
        let part = f64::from(Tissue::PART);
        assert!(
            apart < 0.5 * part * 9.0 * displacement,
            "nu {nu}, {viscous} s: {apart:e} m of {displacement:e}"
        );
    }
}

#[test]
fn a_step_of_elements_meets_its_tolerance() {
    const TOLERANCE: f32 = 1e-6;
    let world = WorldDefinition {
        max_substeps: 100_000,
        tolerance: TOLERANCE,
        ..gravity()
    };
    let exact = WorldDefinition {
        max_substeps: 100_000,
        substeps: 20_000,
        ..gravity()
    };
    let mut scene = Tissue::new(Tissue::PART, 0.3, 0.0, world);
    let mut reference = Tissue::new(0.0, 0.3, 0.0, exact);
    let report = scene.step(FRAME);
    reference.step(FRAME);
    assert!(
        report.error_estimate <= TOLERANCE && report.substeps < 20_000,
        "{report:?}"
    );
    assert_eq!(scene.added(), 0.0);
    let error = largest_difference(&scene.positions(), &reference.positions());
    assert!(error <= f64::from(TOLERANCE), "{error:e} m, {report:?}");
}

/// Where an organ swings down, a few of its elements become so stiff that they need more substeps than are allowed.
#[test]
fn elements_stiffened_by_motion_refuse_no_step() {
    const PART: f32 = 0.01;
    const STEPS: u32 = 90;
    let mesh = Mesh::organ(0.15, 0.15 / 8.0).expect("a mesh");
    let run = |mass_scaling: f32, max_substeps: u32| {
        let mut world = World::new(WorldDefinition {
            max_substeps,
            ..gravity()
        })
        .expect("a world");
        let body = world.create_body(&BodyDefinition {
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: 3000.0,
                density: 1060.0,
                ..Material::default()
            }),
            mass_scaling,
            ..BodyDefinition::of(&mesh)
        });
        let body = body.expect("a body");
        let held = mesh
            .positions
            .iter()
            .map(|position| position.x)
            .fold(f32::INFINITY, f32::min)
            + 0.015;
        for (node, position) in (0..).zip(&mesh.positions) {
            if position.x < held {
                world.body_mut(body).expect("the body").pin(node).expect("a node");
            }
        }
        let mass: f64 = (0..mesh.positions.len() as u32)
            .map(|node| f64::from(world.body(body).expect("the body").node_mass(node).expect("a node")))
            .sum();
        let energy = |world: &World| {
            let energy = world.body(body).expect("the body").energy(Vec3::NEG_Y * G);
            energy.kinetic + energy.elastic + energy.gravitational
        };
        let start = energy(&world);
        let (mut most, mut added, mut lowest) = (0, 0.0_f64, 0.0_f64);
        for _ in 0..STEPS {
            let hash = world.state_hash();
            let Ok(report) = world.step(FRAME) else {
                assert_eq!(world.state_hash(), hash);
                return None;
            };
            let now = world.body(body).expect("the body");
            added = added.max(now.solver_report().added_mass / mass);
            most = most.max(report.substeps);
            lowest = lowest.min(now.energy(Vec3::NEG_Y * G).gravitational - start);
            // Leapfrog's own energy differs by the squares of the fast frequencies.
            assert!(
                energy(&world) - start < -2e-2 * lowest,
                "{} of {lowest} J",
                energy(&world) - start
            );
        }
        Some((most, added))
    };
    let (most, _) = run(0.0, 10_000).expect("enough substeps");
    // Three fifths of the substeps that it needs.
    let allowed = 3 * most / 5;
    assert_eq!(run(0.0, allowed), None);
    let (taken, added) = run(PART, allowed).expect("no step is refused");
    assert!(taken <= allowed, "{taken} of {allowed}");
    assert!(added > 0.0 && added <= 10.0 * f64::from(PART), "{added}");
}

#[test]
fn a_refused_step_of_elements_changes_nothing() {
    let mut scenes = [0, 1].map(|_| Tissue::new(Tissue::PART, 0.3, 0.0, gravity()));
    for scene in &mut scenes {
        scene.step(FRAME);
    }
    let (before, added) = (scenes[0].world.state_hash(), scenes[0].added());
    assert!(added > 0.0);
    assert!(matches!(scenes[0].world.step(10.0), Err(Error::Unstable { .. })));
    assert_eq!((scenes[0].world.state_hash(), scenes[0].added()), (before, added));
    for scene in &mut scenes {
        scene.step(0.5 * FRAME);
        scene.step(FRAME);
    }
    assert_eq!(scenes[0].world.state_hash(), scenes[1].world.state_hash());
}
