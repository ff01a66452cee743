//! Springs that yield and springs with a strain limit: forces along their curves, work loops, and rest under loads.

use crate::support::bodies::FREE;
use crate::support::organ::of_elements;
use crate::support::scene::{SOLVERS, STORAGES, Scene};
use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, Material, Model, RestStateDefinition, Solver, SpringLaw, Storage, Values, World, WorldDefinition,
    Yielding,
};

const LENGTH: f64 = 0.1;
const STIFFNESS: f64 = 30.0;
const PAIR: [Vec3; 2] = [Vec3::ZERO, Vec3::new(0.1, 0.0, 0.0)];

impl Scene {
    /// Returns the force of the pair's spring when its far end moves to a strain within a step.
    fn pull_at(&mut self, strain: f64) -> f64 {
        let position = Vec3::X * (LENGTH * (1.0 + strain)) as f32;
        self.body_mut().move_pin(1, position).expect("a pin");
        // The first step moves the end; the second reports the force there.
        for _ in 0..2 {
            self.world.step(0.01).expect("a step");
        }
        self.body().pin_force(1).expect("a pin").as_dvec3().x
    }
}

fn yielding(strain: f32) -> Yielding {
    Yielding {
        strain,
        ..Yielding::default()
    }
}

/// A spring between pinned nodes.
fn pair(masses: &'static [f32; 2]) -> BodyDefinition<'static> {
    BodyDefinition {
        positions: &PAIR,
        masses: Values::Each(masses),
        springs: Some(&[[0, 1]]),
        stiffnesses: Values::Uniform(STIFFNESS as f32),
        ..BodyDefinition::default()
    }
}

/// Elastic and perfectly plastic: the force stays at its limit and unloads along the elastic slope. A loop takes
/// exactly the work enclosed by its corners.
#[test]
fn a_spring_yields_permanently() {
    const YIELD: f64 = 0.1;
    const FAR: f64 = 0.25;
    for (solver, storage) in SOLVERS
        .into_iter()
        .zip(STORAGES)
        .chain([(Solver::Verlet, Storage::DynamicBulk)])
    {
        let definition = BodyDefinition {
            yielding: yielding(YIELD as f32),
            solver,
            storage,
            ..pair(&[0.0, 0.0])
        };
        let mut scene = Scene::new(FREE, &definition);
        let most = STIFFNESS * LENGTH * YIELD;
        let near = |pull: f64, expected: f64| {
            assert!((pull - expected).abs() < 2e-5 * most, "{solver:?}: {pull} {expected}");
        };
        near(scene.pull_at(0.08), 0.8 * most);
        near(scene.pull_at(0.0), 0.0);
        near(scene.pull_at(FAR), most);
        // It is at rest at 15 % elongation.
        near(scene.pull_at(FAR - YIELD), 0.0);
        near(scene.pull_at(FAR - 1.5 * YIELD), -0.5 * most);
        // A loop between both ends in small steps: four sides, two of which are flat.
        scene.pull_at(FAR);
        let path = |from: f64, to: f64| (1..=50).map(move |i| from + (to - from) * f64::from(i) / 50.0);
        let mut work = 0.0;
        let (mut last, mut last_pull) = (FAR, most);
        for strain in path(FAR, -FAR).chain(path(-FAR, FAR)) {
            let pull = scene.pull_at(strain);
            work += 0.5 * (pull + last_pull) * LENGTH * (strain - last);
            (last, last_pull) = (strain, pull);
        }
        let expected = 4.0 * most * LENGTH * (FAR - YIELD);
        assert!((work / expected - 1.0).abs() < 1e-3, "{solver:?}: {work} {expected}");
        let stored = 0.5 * STIFFNESS * (LENGTH * YIELD).powi(2);
        assert!((scene.energy() / stored - 1.0).abs() < 1e-3);
    }
}

/// A spring stretched far beyond its limit at once has at most the yield force, for any solver and step. A weight that
/// it cannot hold falls as expected.
#[test]
fn yielding_does_not_depend_on_the_step() {
    let definition = BodyDefinition {
        yielding: yielding(0.1),
        ..pair(&[0.0, 0.0])
    };
    let most = STIFFNESS * LENGTH * 0.1;
    for solver in SOLVERS {
        for step in [1e-3, 1.0 / 60.0, 1.0] {
            let mut scene = Scene::new(FREE, &BodyDefinition { solver, ..definition });
            scene.body_mut().move_pin(1, Vec3::X * 0.14).expect("a pin");
            scene.step(step);
            scene.step(step);
            let pull = f64::from(scene.body().pin_force(1).expect("a pin").x);
            assert!(
                (pull / most - 1.0).abs() < 1e-4,
                "{solver:?}, step {step}: {pull} of {most}"
            );
        }
        for step in [1e-3_f32, 1.0 / 60.0] {
            // Twice the weight that it can hold: once it yields, half of the weight accelerates the mass.
            let mass = 2.0 * most / 9.81;
            let masses = [0.0, mass as f32];
            let gravity = Vec3::X * 9.81;
            let falling = BodyDefinition {
                masses: Values::Each(&masses),
                yielding: Yielding {
                    strain: 0.1,
                    largest: 0.99,
                },
                solver,
                ..definition
            };
            let mut scene = Scene::new(WorldDefinition { gravity, ..FREE }, &falling);
            let steps = (0.1 / step).round();
            scene.run(step, steps as usize);
            let time = f64::from(step) * f64::from(steps);
            // Until it yields it oscillates: y = y0 (1 - cos w t) with y0 = 2 most / k; then a = g / 2.
            let (omega, deepest) = ((STIFFNESS / mass).sqrt(), 2.0 * most / STIFFNESS);
            let first = (1.0_f64 - 0.5).acos() / omega;
            let (speed, left) = (deepest * omega * (omega * first).sin(), time - first);
            let expected = 0.5 * deepest + speed * left + 0.25 * 9.81 * left * left;
            let displacement = scene.positions()[1].x - LENGTH;
            let tolerance = if step < 0.01 { 0.01 } else { 0.08 };
            assert!(
                (displacement / expected - 1.0).abs() < tolerance,
                "{solver:?}, step {step}: {displacement} of {expected}"
            );
        }
    }
}

/// The static equilibrium is unique: springs yield until they balance the load, and a missing equilibrium is reported.
#[test]
fn the_static_equilibrium_includes_yielding() {
    let definition = BodyDefinition {
        yielding: Yielding {
            strain: 0.1,
            largest: 0.3,
        },
        ..pair(&[0.0, 0.0458716])
    };
    // One and a half times the yield force.
    let mut scene = Scene::new(
        WorldDefinition {
            gravity: Vec3::X * 9.81,
            ..FREE
        },
        &definition,
    );
    scene.rest();
    let found = scene.positions()[1].x;
    // At its maximum plastic strain it is elastic again: 0.3 + 0.15 longer.
    assert!((found - LENGTH * 1.45).abs() < 1e-5, "{found}");
    let damped = BodyDefinition {
        node_dampings: Values::Uniform(1.0),
        ..definition
    };
    let mut falling = Scene::new(
        WorldDefinition {
            gravity: Vec3::X * 9.81,
            ..FREE
        },
        &damped,
    );
    falling.run(0.01, 300);
    assert!((falling.positions()[1].x - found).abs() < 1e-5);
    scene.run(0.01, 10);
    assert!((scene.positions()[1].x - found).abs() < 1e-5);
    // For tetrahedra too, an equilibrium that is not found is reported.
    let mesh = Mesh::block([0.04, 0.02, 0.02], [4, 2, 2]).expect("a block");
    let tissue = BodyDefinition {
        yielding: yielding(0.02),
        ..of_elements(&mesh, [5000.0, 0.3, 1000.0])
    };
    for (gravity, holds) in [(0.5, true), (30.0, false)] {
        let gravity = Vec3::NEG_Y * gravity;
        let mut scene = Scene::new(WorldDefinition { gravity, ..FREE }, &tissue);
        for (node, p) in (0..).zip(&mesh.positions) {
            if p.x < -0.019 {
                scene.body_mut().pin(node).expect("a pin");
            }
        }
        let before = scene.world.state_hash();
        let id = scene.id;
        let found = scene.world.rest_state(id, &RestStateDefinition::default());
        assert_eq!(found.is_ok(), holds, "{found:?}");
        assert_eq!(scene.world.state_hash() == before, !holds);
    }
}

#[test]
fn plastic_strain_has_a_maximum() {
    for solver in SOLVERS {
        let definition = BodyDefinition {
            yielding: Yielding {
                strain: 0.1,
                largest: 0.2,
            },
            solver,
            ..pair(&[0.0, 0.0])
        };
        let mut scene = Scene::new(FREE, &definition);
        for strain in [0.5, 0.31, 0.9] {
            let (pull, expected) = (scene.pull_at(strain), STIFFNESS * LENGTH * (strain - 0.2));
            assert!((pull / expected - 1.0).abs() < 1e-4, "{solver:?}: {pull} {expected}");
        }
    }
}

/// A block that fell on its side keeps its new shape and loses no energy or momentum afterwards; its static equilibrium
/// is its final state.
#[test]
fn a_block_that_was_bent_stays_bent() {
    let mesh = Mesh::block([0.08, 0.02, 0.02], [8, 2, 2]).expect("a block");
    for (solver, storage) in SOLVERS.into_iter().zip(STORAGES) {
        let mut ends = Vec::new();
        for yield_strain in [0.0, 0.02] {
            let definition = BodyDefinition {
                masses: Values::Uniform(1e-4),
                node_dampings: Values::Uniform(2.5e-3),
                stiffnesses: Values::Uniform(20.0),
                yielding: yielding(yield_strain),
                solver,
                storage,
                ..BodyDefinition::of(&mesh)
            };
            let mut scene = Scene::new(FREE, &definition);
            for (node, p) in (0..).zip(&mesh.positions) {
                if p.x < -0.039 {
                    scene.body_mut().pin(node).expect("a pin");
                }
            }
            let (mut first, mut last) = (0.0, 0.0);
            for index in 0..800 {
                if index < 200 {
                    for (node, p) in (0..).zip(&mesh.positions) {
                        if p.x > 0.039 {
                            scene.body_mut().apply_force(node, Vec3::Y * -0.001).expect("a force");
                        }
                    }
                }
                scene.world.step(2e-3).expect("a step");
                let energy = scene.energy();
                if index == 200 {
                    first = energy;
                }
                if index > 200 {
                    assert!(
                        energy <= last + 1e-5 * first,
                        "{solver:?}, step {index}: {energy} of {last}"
                    );
                }
                last = energy;
            }
            let before = scene.positions();
            scene.rest();
            let (after, tip) = (scene.positions(), mesh.positions.len() - 1);
            let error = before[tip].distance(after[tip]);
            assert!(error < 2e-4, "{solver:?}, {yield_strain}: {error}");
            ends.push(after[tip].distance(mesh.positions[tip].as_dvec3()));
        }
        assert!(ends[0] < 1e-6 && ends[1] > 2e-3, "{solver:?}: {ends:?}");
    }
}

/// A block of tetrahedra whose nodes are all moved. Under uniform shear it yields at the von Mises stress for any
/// Poisson's ratio, keeps the plastic strain, and unloads elastically; volumetric strain does not yield.
#[test]
fn tetrahedra_yield_at_the_stress_of_von_mises() {
    const YOUNG: f64 = 5000.0;
    const YIELD: f64 = 0.02;
    let mesh = Mesh::block([0.04; 3], [2; 3]).expect("a block");
    let masses = vec![0.0; mesh.positions.len()];
    for (solver, storage) in SOLVERS.into_iter().zip(STORAGES) {
        for nu in [0.0, 0.3, 0.45] {
            let definition = BodyDefinition {
                masses: Values::Each(&masses),
                material: Some(Material {
                    model: Model::Tetrahedra,
                    young_modulus: YOUNG as f32,
                    poisson_ratio: nu,
                    ..Material::default()
                }),
                yielding: yielding(YIELD as f32),
                solver,
                storage,
                ..BodyDefinition::of(&mesh)
            };
            let mut scene = Scene::new(FREE, &definition);
            // The shear stress on the upper side, in steps so small that the side does not rotate.
            let mut shear_at = |shear: f64| {
                for (node, &p) in (0..).zip(&mesh.positions) {
                    let position = p + Vec3::X * (shear as f32 * (p.y + 0.02));
                    scene.body_mut().move_pin(node, position).expect("a pin");
                }
                for _ in 0..2 {
                    scene.world.step(0.01).expect("a step");
                }
                let upper = (0..).zip(&mesh.positions).filter(|(_, p)| p.y > 0.019);
                let force: f32 = upper
                    .map(|(node, _)| scene.body().pin_force(node).expect("a pin").x)
                    .sum();
                f64::from(force) / (0.04 * 0.04)
            };
            let mu = YOUNG / (2.0 * (1.0 + f64::from(nu)));
            let yields = YOUNG * YIELD / 3.0_f64.sqrt();
            let near = |stress: f64, expected: f64| {
                // The squares of strains of a few hundredths, which small-strain theory neglects.
                assert!(
                    (stress - expected).abs() < 0.05 * yields,
                    "{solver:?}, nu {nu}: {stress} {expected}"
                );
            };
            near(shear_at(0.5 * yields / mu), 0.5 * yields);
            near(shear_at(0.0), 0.0);
            for part in 1..=20 {
                shear_at(0.1 * yields / mu * f64::from(part));
            }
            near(shear_at(2.0 * yields / mu), yields);
            near(shear_at(yields / mu), 0.0);
            near(shear_at(0.5 * yields / mu), -0.5 * yields);
            // Swelling and shrinking back leaves no plastic strain.
            let mut other = Scene::new(FREE, &definition);
            for factor in [1.1, 1.0] {
                for (node, &p) in (0..).zip(&mesh.positions) {
                    other.body_mut().move_pin(node, p * factor).expect("a pin");
                }
                other.world.step(0.01).expect("a step");
            }
            other.world.step(0.01).expect("a step");
            let left = other.body().pin_force(0).expect("a pin").length();
            assert!(left < 1e-4, "{solver:?}, nu {nu}: {left}");
            assert!(other.energy() < 1e-9);
        }
    }
}

/// Yielding dissipates the work of deformation: energy never rises while a block of tetrahedra swings, and falls at
/// once.
#[test]
fn tetrahedra_that_yield_lose_energy() {
    let mesh = Mesh::block([0.04, 0.02, 0.02], [4, 2, 2]).expect("a block");
    for solver in SOLVERS {
        for nu in [0.3, 0.45] {
            let mut left = Vec::new();
            for strain in [0.0, 0.02] {
                let definition = BodyDefinition {
                    yielding: yielding(strain),
                    solver,
                    ..of_elements(&mesh, [5000.0, nu, 1000.0])
                };
                let mut scene = Scene::new(FREE, &definition);
                let thrown: Vec<Vec3> = mesh
                    .positions
                    .iter()
                    .map(|p| Vec3::new(10.0, -5.0, -5.0) * *p)
                    .collect();
                scene.body_mut().set_velocities(&thrown).expect("velocities");
                let first = scene.energy();
                for _ in 0..200 {
                    scene.world.step(2e-4).expect("a step");
                    let energy = scene.energy();
                    assert!(energy < 1.01 * first, "{solver:?}, nu {nu}: {energy} of {first}");
                }
                left.push(scene.energy() / first);
            }
            assert!(left[0] > 0.9 && left[1] < 0.6, "{solver:?}, nu {nu}: {left:?}");
        }
    }
}

#[test]
fn a_limit_stiffens_beyond_its_strain() {
    const STRAIN: f64 = 0.2;
    for (solver, storage) in SOLVERS
        .into_iter()
        .zip(STORAGES)
        .chain([(Solver::Verlet, Storage::DynamicBulk)])
    {
        let definition = BodyDefinition {
            strain_limit: STRAIN as f32,
            limit_stiffening: 50.0,
            solver,
            storage,
            ..pair(&[0.0, 0.0])
        };
        let mut scene = Scene::new(FREE, &definition);
        for strain in [-0.5, 0.1, 0.19, 0.21, 0.25, 0.6] {
            let strain = f64::from((LENGTH * (1.0 + strain)) as f32) / f64::from(0.1_f32) - 1.0;
            let expected = STIFFNESS * LENGTH * (strain + 50.0 * (strain - f64::from(0.2_f32)).max(0.0));
            let pull = scene.pull_at(strain);
            assert!(
                (pull - expected).abs() < 2e-5 * expected.abs(),
                "{solver:?}, {strain}: {pull} {expected}"
            );
            let energy =
                0.5 * STIFFNESS * LENGTH.powi(2) * (strain.powi(2) + 50.0 * (strain - STRAIN).max(0.0).powi(2));
            assert!((scene.energy() / energy - 1.0).abs() < 1e-4);
        }
    }
}

/// A chain of springs too soft for its weight hangs at the strain of their limit, for any start and solver.
#[test]
fn a_heavy_chain_hangs_at_its_limit() {
    const NODES: usize = 10;
    const MASS: f64 = 0.02;
    let positions: Vec<Vec3> = (0..NODES).map(|i| Vec3::NEG_Y * (0.1 * i as f32)).collect();
    let springs: Vec<[u32; 2]> = (1..NODES as u32).map(|i| [i - 1, i]).collect();
    let mut masses = vec![MASS as f32; NODES];
    masses[0] = 0.0;
    for (solver, storage) in SOLVERS.into_iter().zip(STORAGES) {
        let definition = BodyDefinition {
            positions: &positions,
            masses: Values::Each(&masses),
            springs: Some(&springs),
            stiffnesses: Values::Uniform(2.0),
            node_dampings: Values::Uniform(0.2),
            strain_limit: 0.3,
            limit_stiffening: 100.0,
            solver,
            storage,
            ..BodyDefinition::default()
        };
        let gravity = Vec3::NEG_Y * 9.81;
        let mut scene = Scene::new(WorldDefinition { gravity, ..FREE }, &definition);
        for _ in 0..1500 {
            scene.world.step(0.01).expect("a step");
        }
        let found = scene.positions();
        for spring in 1..NODES {
            let load = MASS * 9.81 * (NODES - spring) as f64 / (2.0 * 0.1);
            let strain = if load > 0.3 { (load + 100.0 * 0.3) / 101.0 } else { load };
            let length = found[spring].distance(found[spring - 1]);
            assert!(
                (length / (0.1 * (1.0 + strain)) - 1.0).abs() < 1e-4,
                "{solver:?}, spring {spring}: {length} {strain}"
            );
        }
    }
}

/// A mass that bounces on its strain limit keeps its energy, with the short substeps that the limit needs.
#[test]
fn energy_is_kept_at_the_limit() {
    let definition = BodyDefinition {
        strain_limit: 0.1,
        limit_stiffening: 100.0,
        ..pair(&[0.0, 1e-3])
    };
    // Beyond the limit a step h at this frequency w keeps the energy within 1 / (1 - (h w)² / 4). A step across the
    // kink of the law may add or remove as much.
    let highest = (STIFFNESS * 101.0 / 1e-3).sqrt();
    for step in [1e-4_f32, 4e-4] {
        let mut scene = Scene::new(FREE, &definition);
        scene
            .body_mut()
            .set_velocities(&[Vec3::ZERO, Vec3::X * 3.0])
            .expect("velocities");
        let first = scene.energy();
        let mut most = 0.0_f64;
        let phase = f64::from(step) * highest;
        let bound = 1.001 * first / (1.0 - 0.5 * phase * phase);
        for _ in 0..(0.5 / step) as usize {
            scene.world.step(step).expect("a step");
            most = most.max(scene.positions()[1].distance(DVec3::ZERO) / LENGTH - 1.0);
            let energy = scene.energy();
            assert!(energy < bound, "step {step}: {energy} of {first}");
        }
        // All energy at the largest stretch: E = k L²/2 (e² + 100 (e - 0.1)²), that is 101 e² - 20 e + 1 = 2 E / k L².
        let farthest = |energy: f64| {
            let square = 2.0 * energy / (STIFFNESS * LENGTH * LENGTH);
            (20.0 + (400.0 - 404.0 * (1.0 - square)).sqrt()) / 202.0
        };
        let range = 0.98 * farthest(first)..1.001 * farthest(bound);
        assert!(range.contains(&most), "step {step}: {most}, not within {range:?}");
    }
}

#[test]
fn a_refused_step_and_threads_change_nothing() {
    let mesh = Mesh::block([0.04, 0.02, 0.02], [4, 2, 2]).expect("a block");
    let definition = BodyDefinition {
        masses: Values::Uniform(1e-4),
        stiffnesses: Values::Uniform(20.0),
        yielding: yielding(0.02),
        strain_limit: 0.1,
        ..BodyDefinition::of(&mesh)
    };
    let thrown: Vec<Vec3> = mesh.positions.iter().map(|p| *p * 60.0).collect();
    let hashes = [1, 2, 5].map(|thread_count| {
        let world = WorldDefinition {
            thread_count,
            max_substeps: 100,
            ..FREE
        };
        let mut scene = Scene::new(world, &definition);
        scene.body_mut().set_velocities(&thrown).expect("velocities");
        for _ in 0..20 {
            scene.world.step(1e-3).expect("a step");
        }
        let before = scene.world.state_hash();
        scene.world.step(10.0).expect_err("too long a step");
        assert_eq!(scene.world.state_hash(), before);
        scene.world.step(1e-3).expect("a step");
        scene.world.state_hash()
    });
    assert!(hashes.iter().all(|&hash| hash == hashes[0]));
}

#[test]
fn invalid_terms_are_refused_by_name() {
    let refused = |definition: &BodyDefinition, words: &[&str]| {
        let mut world = World::new(FREE).expect("a world");
        let message = world.create_body(definition).expect_err("refused").to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    let pair = pair(&[1.0, 1.0]);
    let bare = BodyDefinition {
        springs: Some(&[]),
        ..pair
    };
    refused(
        &BodyDefinition {
            yielding: yielding(-1.0),
            ..pair
        },
        &["yield_strain", "-1"],
    );
    refused(
        &BodyDefinition {
            strain_limit: f32::NAN,
            ..pair
        },
        &["strain_limit", "NaN"],
    );
    for largest_set in [0.0, 1.0, f32::NAN] {
        let definition = BodyDefinition {
            yielding: Yielding {
                strain: 0.1,
                largest: largest_set,
            },
            ..pair
        };
        refused(&definition, &["largest_set", &largest_set.to_string()]);
    }
    for limit_stiffening in [0.0, 1e7, f32::INFINITY] {
        let definition = BodyDefinition {
            strain_limit: 0.1,
            limit_stiffening,
            ..pair
        };
        refused(&definition, &["limit_stiffening", &limit_stiffening.to_string()]);
    }
    let yields = BodyDefinition {
        yielding: yielding(0.1),
        ..bare
    };
    refused(&yields, &["yield_strain", "0.1", "springs"]);
    let limited = BodyDefinition {
        strain_limit: 0.1,
        ..bare
    };
    refused(&limited, &["strain_limit", "0.1", "springs"]);
    let nonlinear = BodyDefinition {
        yielding: yielding(0.1),
        spring_law: SpringLaw::Exponential {
            steepness: 1.0,
            limit: 1.0,
        },
        ..pair
    };
    refused(&nonlinear, &["yield_strain", "spring_law"]);
}
