//! Viscous springs and tetrahedra: relaxation and creep along the curves of the standard linear solid and of
//! Kelvin-Voigt, for every solver and storage, stable for any relaxation time and step.

use crate::support::bodies::{FREE, Random};
use crate::support::hanging::nodes_at;
use crate::support::scene::{SOLVERS, STORAGES, Scene};
use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, Material, Model, Solver, SpringLaw, Storage, Values, Viscosity, World, WorldDefinition, Yielding,
};

fn tissue(poisson_ratio: f32) -> Material {
    Material {
        model: Model::Tetrahedra,
        young_modulus: 5000.0,
        poisson_ratio,
        density: 1000.0,
        ..Material::default()
    }
}

fn springs() -> Material {
    Material {
        model: Model::Springs,
        poisson_ratio: 0.0,
        ..tissue(0.0)
    }
}

/// Checks forces at these fractions of the relaxation time, with these step lengths.
fn check_relaxation(solver: Solver, viscosity: Viscosity, scene: &mut Scene, held: &[u32], pull: impl Fn(&mut Scene)) {
    let (retardation, relaxation) = (
        f64::from(viscosity.retardation_time),
        f64::from(viscosity.relaxation_time),
    );
    for part in [0.02_f32, 0.3, 8.0] {
        let step = part * viscosity.relaxation_time;
        let force = |scene: &mut Scene| -> DVec3 {
            let force = |node: &u32| scene.body().pin_force(*node).expect("a pin").as_dvec3();
            held.iter().map(force).sum()
        };
        // The final force: long steps later.
        pull(scene);
        scene.step(step);
        let mut forces = vec![force(scene)];
        for _ in 0..40 {
            scene.step(step);
            forces.push(force(scene));
        }
        for _ in 0..10 {
            scene.step(20.0 * viscosity.relaxation_time);
        }
        let rest = force(scene);
        // The strain grew linearly within the first step.
        let ratio = f64::from(step) / relaxation;
        let peak = retardation / f64::from(step) * (1.0 - (-ratio).exp());
        for (index, force) in forces.iter().enumerate().skip(1) {
            let after = |steps: usize| 1.0 + peak * (-ratio * steps as f64).exp();
            // VERLET reports a mean that includes the half kicks at both ends of the step.
            let expected = match solver {
                Solver::Verlet => 0.5 * (after(index - 1) + after(index)),
                _ => after(index),
            };
            let expected = rest * expected;
            assert!(
                (*force - expected).length() < 2e-4 * expected.length(),
                "{solver:?}, {viscosity:?}, step {step}, number {index}: {force} {expected}"
            );
        }
        assert!(rest.length() > 0.0);
    }
}

const SOLID: Viscosity = Viscosity {
    retardation_time: 0.15,
    relaxation_time: 0.1,
};

#[test]
fn a_stretched_spring_relaxes_along_the_curve() {
    for (solver, storage) in SOLVERS
        .into_iter()
        .zip(STORAGES)
        .chain([(Solver::Verlet, Storage::DynamicBulk)])
    {
        for spring_law in [
            SpringLaw::Linear,
            SpringLaw::Exponential {
                steepness: 5.0,
                limit: 0.4,
            },
        ] {
            let definition = BodyDefinition {
                positions: &[Vec3::ZERO, Vec3::X * 0.1],
                masses: Values::Each(&[0.0, 0.0]),
                springs: Some(&[[0, 1]]),
                stiffnesses: Values::Uniform(30.0),
                spring_law,
                viscosity: SOLID,
                solver,
                storage,
                ..BodyDefinition::default()
            };
            let mut scene = Scene::new(FREE, &definition);
            let lengths = [0.13, 0.15, 0.08];
            let next = std::cell::Cell::new(0);
            // From one strain to another: each pull begins at rest, since the check is of the change.
            check_relaxation(solver, SOLID, &mut scene, &[1], |scene| {
                for _ in 0..10 {
                    scene.body_mut().move_pin(1, Vec3::X * 0.1).expect("a pin");
                    scene.step(2.0);
                }
                let length = lengths[next.replace(next.get() + 1)];
                scene.body_mut().move_pin(1, Vec3::X * length).expect("a pin");
            });
        }
    }
}

/// Moves every node of a block to the positions of a uniform deformation.
#[test]
fn tetrahedra_relax_along_the_curve_for_any_poisson_ratio() {
    let mesh = Mesh::block([0.04; 3], [2; 3]).expect("a block");
    let masses = vec![0.0; mesh.positions.len()];
    for (solver, storage) in SOLVERS.into_iter().zip(STORAGES) {
        for nu in [0.0, 0.3, 0.45] {
            let definition = BodyDefinition {
                masses: Values::Each(&masses),
                material: Some(Material {
                    density: 0.0,
                    ..tissue(nu)
                }),
                viscosity: SOLID,
                solver,
                storage,
                ..BodyDefinition::of(&mesh)
            };
            let mut scene = Scene::new(FREE, &definition);
            let side = nodes_at(&mesh, |p| p.x > 0.019);
            let lead = |scene: &mut Scene, stretch: Vec3, shear: f32| {
                for (node, &p) in (0..).zip(&mesh.positions) {
                    let position = p * stretch + Vec3::Y * (shear * p.x);
                    scene.body_mut().move_pin(node, position).expect("a pin");
                }
            };
            check_relaxation(solver, SOLID, &mut scene, &side, |scene| {
                lead(scene, Vec3::ONE, 0.0);
                scene.step(2.0);
                for _ in 0..9 {
                    scene.step(2.0);
                }
                lead(scene, Vec3::new(1.1, 0.97, 1.02), 0.05);
            });
        }
    }
}

/// A light weight on a spring follows the creep curves with little effect of inertia.
#[test]
fn a_loaded_spring_creeps_along_the_curve() {
    const FORCE: f64 = 0.3;
    const STIFFNESS: f64 = 30.0;
    for viscosity in [
        SOLID,
        Viscosity {
            retardation_time: 0.1,
            relaxation_time: 0.0,
        },
    ] {
        for solver in SOLVERS {
            let definition = BodyDefinition {
                positions: &[Vec3::ZERO, Vec3::X * 0.1],
                masses: Values::Each(&[0.0, 1e-4]),
                springs: Some(&[[0, 1]]),
                stiffnesses: Values::Uniform(STIFFNESS as f32),
                // So little that the initial oscillation soon decays.
                node_dampings: Values::Uniform(0.02),
                viscosity,
                solver,
                order: 2,
                ..BodyDefinition::default()
            };
            let mut scene = Scene::new(FREE, &definition);
            let (t, tau) = (
                f64::from(viscosity.retardation_time),
                f64::from(viscosity.relaxation_time),
            );
            let step = 1e-3;
            for index in 1..=400 {
                scene
                    .body_mut()
                    .apply_force(1, Vec3::X * FORCE as f32)
                    .expect("a force");
                scene.step(step);
                let time = f64::from(step) * f64::from(index);
                // Zener's solid: F / (E + E1) at first, F / E finally, with the time tau (E + E1) / E between.
                let stiffening = if tau > 0.0 { t / tau } else { f64::INFINITY };
                let lacks = if tau > 0.0 {
                    stiffening / (1.0 + stiffening)
                } else {
                    1.0
                };
                let expected = FORCE / STIFFNESS * (1.0 - lacks * (-time / (tau + t)).exp());
                let displacement = scene.positions()[1].x - 0.1;
                if index > 60 {
                    assert!(
                        (displacement - expected).abs() < 0.01 * FORCE / STIFFNESS,
                        "{solver:?}, {viscosity:?}, {time} s: {displacement} {expected}"
                    );
                }
            }
        }
    }
}

/// A Kelvin-Voigt solid of springs is damping along springs.
#[test]
fn a_dashpot_alone_is_damping_along_the_spring() {
    for solver in SOLVERS {
        let mut hashes = Vec::new();
        for has_springs in [false, true] {
            let mesh = Mesh::block([0.04, 0.02, 0.02], [4, 2, 2]).expect("a block");
            let stiffnesses = 20.0;
            let definition = BodyDefinition {
                positions: &mesh.positions,
                tetrahedra: &mesh.tetrahedra,
                masses: Values::Uniform(1e-4),
                stiffnesses: Values::Uniform(stiffnesses),
                spring_dampings: Values::Uniform(if has_springs { 0.25 * stiffnesses } else { 0.0 }),
                viscosity: Viscosity {
                    retardation_time: if has_springs { 0.0 } else { 0.25 },
                    relaxation_time: 0.0,
                },
                solver,
                ..BodyDefinition::default()
            };
            let mut scene = Scene::new(FREE, &definition);
            scene
                .body_mut()
                .apply_force(3, Vec3::new(0.1, 0.2, 0.0))
                .expect("a force");
            for _ in 0..20 {
                scene.step(1e-3);
            }
            hashes.push(scene.world.state_hash());
        }
        assert_eq!(hashes[0], hashes[1], "{solver:?}");
    }
}

/// A block as springs and as tetrahedra that swings after an impulse.
fn block(nu: Option<f32>) -> (Mesh, Material) {
    let mesh = Mesh::block([0.04, 0.02, 0.02], [4, 2, 2]).expect("a block");
    (mesh, nu.map_or(springs(), tissue))
}

fn swinging(nu: Option<f32>, viscosity: Viscosity, solver: Solver, world: WorldDefinition) -> Scene {
    let (mesh, material) = block(nu);
    let definition = BodyDefinition {
        material: Some(material),
        viscosity,
        solver,
        ..BodyDefinition::of(&mesh)
    };
    let mut scene = Scene::new(world, &definition);
    for (node, p) in (0..).zip(&mesh.positions) {
        if p.x < -0.019 {
            scene.body_mut().pin(node).expect("a pin");
        }
    }
    let thrown: Vec<Vec3> = mesh
        .positions
        .iter()
        .map(|p| Vec3::new(0.1, 0.4, 0.0) * (p.x + 0.02) / 0.04)
        .collect();
    scene.body_mut().set_velocities(&thrown).expect("velocities");
    scene
}

#[test]
fn solvers_agree_on_the_motion() {
    for viscosity in [
        Viscosity {
            retardation_time: 0.02,
            relaxation_time: 0.01,
        },
        Viscosity {
            retardation_time: 0.004,
            relaxation_time: 0.0,
        },
    ] {
        for nu in [None, Some(0.3), Some(0.45)] {
            let ends: Vec<Vec<DVec3>> = SOLVERS
                .into_iter()
                .map(|solver| {
                    let mut scene = swinging(nu, viscosity, solver, FREE);
                    for _ in 0..150 {
                        scene.step(2e-4);
                    }
                    scene.positions()
                })
                .collect();
            let start: Vec<DVec3> = block(nu).0.positions.iter().map(|p| p.as_dvec3()).collect();
            let displacement = distance(&ends[0], &start);
            assert!(displacement > 1e-4, "{displacement}");
            for (solver, end) in SOLVERS.iter().zip(&ends) {
                let error = distance(end, &ends[0]) / displacement;
                assert!(
                    error < 0.01,
                    "{solver:?}, {viscosity:?}, nu {nu:?}: {error} of {displacement} m"
                );
            }
        }
    }
}

fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    let distances = a.iter().zip(b).map(|(a, b)| a.distance(*b));
    distances.fold(0.0, f64::max)
}

/// A branch that hardly relaxes is a spring: energy is conserved and moves between nodes and branches. A branch that
/// relaxes dissipates it.
#[test]
fn energy_is_kept_or_lost_and_never_gained() {
    for nu in [None, Some(0.3), Some(0.45)] {
        for (relaxation_time, kept) in [(1e5, true), (0.01, false)] {
            let viscosity = Viscosity {
                retardation_time: 2.0 * relaxation_time,
                relaxation_time,
            };
            let mut scene = swinging(nu, viscosity, Solver::Verlet, FREE);
            let first = scene.energy();
            let mut most = 0.0_f64;
            for _ in 0..1500 {
                scene.step(2e-4);
                most = most.max(scene.energy());
            }
            let last = scene.energy();
            assert!(most < 1.002 * first, "nu {nu:?}: {most} of {first}");
            if kept {
                assert!((last / first - 1.0).abs() < 0.002, "nu {nu:?}: {last} of {first}");
            } else {
                assert!(last < 0.2 * first, "nu {nu:?}: {last} of {first}");
            }
        }
    }
}

#[test]
fn any_times_and_any_step_are_stable() {
    let times = [
        (1e-5, 0.0),
        (10.0, 0.0),
        (1.0, 1e-6),
        (1e-4, 1e-3),
        (3.0, 1.0),
        (1e4, 1e3),
    ];
    for solver in SOLVERS {
        for (retardation_time, relaxation_time) in times {
            for nu in [None, Some(0.3), Some(0.45)] {
                for step in [1e-5_f32, 1.0 / 60.0, 1.0] {
                    let viscosity = Viscosity {
                        retardation_time,
                        relaxation_time,
                    };
                    let world = WorldDefinition {
                        max_substeps: 3000,
                        ..FREE
                    };
                    let mut scene = swinging(nu, viscosity, solver, world);
                    let first = scene.energy();
                    for _ in 0..5 {
                        match scene.world.step(step) {
                            Ok(report) => assert_eq!(report.bodies_restored, 0),
                            Err(sinew::Error::Unstable { .. }) if solver == Solver::Verlet => break,
                            Err(error) => panic!("{error}"),
                        }
                        let energy = scene.energy();
                        assert!(
                            energy <= 1.05 * first,
                            "{solver:?}, {viscosity:?}, nu {nu:?}, step {step}: {energy} of {first}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn scattered_bodies_stay_finite() {
    let mut random = Random::new(8);
    for solver in [Solver::Verlet, Solver::Implicit] {
        for nu in [None, Some(0.3), Some(0.45)] {
            let world = WorldDefinition {
                max_substeps: 100_000,
                ..FREE
            };
            let mut scene = swinging(nu, SOLID, solver, world);
            let positions: Vec<Vec3> = scene.positions().iter().map(|_| random.vector() * 0.03).collect();
            scene.body_mut().set_positions(&positions).expect("positions");
            for _ in 0..40 {
                scene.step(1.0 / 60.0);
            }
            assert!(scene.positions().iter().all(|p| p.is_finite()));
        }
    }
}

/// The static equilibrium is independent of viscosity, and unique: branches carry no force there.
#[test]
fn the_static_equilibrium_is_the_elastic_one() {
    for nu in [None, Some(0.3), Some(0.45)] {
        let mut shapes = Vec::new();
        for viscosity in [Viscosity::default(), SOLID] {
            let world = WorldDefinition {
                gravity: Vec3::NEG_Y * 3.0,
                ..FREE
            };
            let mut scene = swinging(nu, viscosity, Solver::Implicit, world);
            scene.step(0.01);
            scene.rest();
            let found = scene.positions();
            for _ in 0..20 {
                scene.step(0.01);
            }
            assert!(distance(&scene.positions(), &found) < 1e-6);
            shapes.push(found);
        }
        assert!(distance(&shapes[0], &shapes[1]) < 1e-7);
    }
}

/// Bodies large enough for several threads.
#[test]
fn any_number_of_threads_is_bitwise_identical() {
    any_number_of_threads_is_bitwise_identical_of(|solver, nu| {
        nu == [Some(0.45), Some(0.3)][usize::from(solver == Solver::Implicit)]
    });
}

#[test]
#[ignore = "long"]
fn any_number_of_threads_is_bitwise_identical_in_the_other_cases() {
    any_number_of_threads_is_bitwise_identical_of(|solver, nu| {
        nu != [Some(0.45), Some(0.3)][usize::from(solver == Solver::Implicit)]
    });
}

fn any_number_of_threads_is_bitwise_identical_of(is_selected: fn(Solver, Option<f32>) -> bool) {
    let mesh = Mesh::block([0.2, 0.2, 0.18], [20, 20, 18]).expect("a block");
    let thrown: Vec<Vec3> = mesh.positions.iter().map(|p| Vec3::new(3.0, -2.0, 1.0) * *p).collect();
    for solver in [Solver::Verlet, Solver::Implicit] {
        for nu in [None, Some(0.3), Some(0.45)]
            .into_iter()
            .filter(|&nu| is_selected(solver, nu))
        {
            let hashes = [1, 2, 5].map(|thread_count| {
                let world = WorldDefinition { thread_count, ..FREE };
                let definition = BodyDefinition {
                    material: Some(nu.map_or(springs(), tissue)),
                    viscosity: SOLID,
                    yielding: Yielding {
                        strain: 1e-3,
                        ..Yielding::default()
                    },
                    solver,
                    ..BodyDefinition::of(&mesh)
                };
                let mut scene = Scene::new(world, &definition);
                scene.body_mut().set_velocities(&thrown).expect("velocities");
                scene.run(1e-3, 3);
                scene.world.state_hash()
            });
            assert!(hashes.iter().all(|&hash| hash == hashes[0]), "{solver:?} {nu:?}");
        }
    }
}

/// A cut removes the energy of the springs it cuts, and the remaining energy does not rise, for any Maxwell branches of
/// nodal pressures.
#[test]
fn a_cut_adds_no_energy() {
    for solver in SOLVERS {
        for nu in [None, Some(0.3), Some(0.45)] {
            let viscosity = Viscosity {
                retardation_time: 2.0,
                relaxation_time: 0.1,
            };
            let mut scene = swinging(nu, viscosity, solver, FREE);
            scene.run(1e-3, 10);
            let before = scene.energy();
            // An edge across the middle, and all elements that contain it.
            let mesh = block(nu).0;
            let mut pairs = mesh.edges().expect("edges").into_iter();
            let near = |node: u32| mesh.positions[node as usize].length() < 0.012;
            let [a, b] = pairs.find(|pair| pair.iter().all(|&node| near(node))).expect("an edge");
            scene.body_mut().remove_spring(a, b).expect("an edge");
            let cut = scene.energy();
            scene.run(1e-6, 1);
            let after = scene.energy();
            assert!(
                cut < before && after < cut * 1.001,
                "{solver:?}, nu {nu:?}: {before} {cut} {after}"
            );
        }
    }
}

/// Moved beyond the range of `f32` and back, a body has its original state.
#[test]
fn non_finite_history_is_discarded() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        for nu in [None, Some(0.3), Some(0.45)] {
            let mut scene = swinging(nu, SOLID, solver, FREE);
            let positions = scene.body().positions().to_vec();
            for factor in [1e12, 1e20, 1e37] {
                let far: Vec<Vec3> = positions.iter().map(|position| *position * factor).collect();
                scene.body_mut().set_positions(&far).expect("positions");
                scene.body_mut().set_positions(&positions).expect("positions");
                assert!(scene.energy().is_finite());
                scene.run(1e-3, 3);
            }
        }
    }
}

/// NEWTON detects that nothing moves. Branch forces are rounded to `f32`, so their imbalance is a millionth of the
/// rounding of positions. The solver may be unable to converge then, and reports that.
#[test]
fn newton_keeps_a_body_at_rest() {
    newton_keeps_a_body_at_rest_of(&[Some(0.45)]);
}

#[test]
#[ignore = "long"]
fn newton_keeps_a_body_at_rest_in_the_other_cases() {
    newton_keeps_a_body_at_rest_of(&[None, Some(0.3)]);
}

fn newton_keeps_a_body_at_rest_of(ratios: &[Option<f32>]) {
    for &nu in ratios {
        for viscosity in [
            SOLID,
            Viscosity {
                retardation_time: 0.05,
                relaxation_time: 0.0,
            },
        ] {
            let (mesh, material) = block(nu);
            let definition = BodyDefinition {
                material: Some(material),
                viscosity,
                solver: Solver::Newton,
                ..BodyDefinition::of(&mesh)
            };
            let mut scene = Scene::new(FREE, &definition);
            for _ in 0..5 {
                scene.step(1.0 / 60.0);
                let report = scene.body().solver_report();
                assert!(
                    (report.has_converged || report.error < 1e-12) && report.iterations < 10_000,
                    "nu {nu:?}, {viscosity:?}: {report:?}"
                );
            }
        }
    }
}

/// The attempts of a refused step, or of a step to a tolerance, do not change the branches.
#[test]
fn a_refused_step_changes_nothing() {
    for nu in [None, Some(0.3), Some(0.45)] {
        let world = WorldDefinition {
            max_substeps: 1,
            ..FREE
        };
        let mut scene = swinging(nu, SOLID, Solver::Verlet, world);
        scene.step(1e-5);
        let before = scene.world.state_hash();
        scene.world.step(1.0).expect_err("too long a step");
        assert_eq!(scene.world.state_hash(), before);
        let mut other = swinging(nu, SOLID, Solver::Verlet, world);
        other.step(1e-5);
        scene.step(1e-5);
        other.step(1e-5);
        assert_eq!(scene.world.state_hash(), other.world.state_hash());
    }
}

/// Removing a spring removes its branch.
#[test]
fn removed_springs_pull_no_more() {
    for solver in SOLVERS {
        let definition = BodyDefinition {
            positions: &[Vec3::ZERO, Vec3::X * 0.1],
            masses: Values::Each(&[0.0, 0.0]),
            springs: Some(&[[0, 1]]),
            stiffnesses: Values::Uniform(30.0),
            viscosity: SOLID,
            solver,
            ..BodyDefinition::default()
        };
        let mut scene = Scene::new(FREE, &definition);
        scene.body_mut().move_pin(1, Vec3::X * 0.12).expect("a pin");
        scene.step(0.01);
        scene.body_mut().remove_spring(0, 1).expect("a spring");
        scene.step(0.01);
        assert_eq!(scene.body().pin_force(1).expect("a pin"), Vec3::ZERO, "{solver:?}");
        assert_eq!(scene.energy(), 0.0);
    }
}

#[test]
fn invalid_viscosity_is_refused_by_name() {
    let refused = |definition: &BodyDefinition, words: &[&str]| {
        let mut world = World::new(FREE).expect("a world");
        let message = world.create_body(definition).expect_err("refused").to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    let positions = [Vec3::ZERO, Vec3::X];
    let pair = BodyDefinition {
        positions: &positions,
        masses: Values::Uniform(1.0),
        springs: Some(&[[0, 1]]),
        stiffnesses: Values::Uniform(1.0),
        ..BodyDefinition::default()
    };
    let viscous = |retardation_time, relaxation_time| BodyDefinition {
        viscosity: Viscosity {
            retardation_time,
            relaxation_time,
        },
        ..pair
    };
    refused(&viscous(-1.0, 0.0), &["retardation_time", "-1"]);
    refused(&viscous(f32::NAN, 0.0), &["retardation_time", "NaN"]);
    refused(&viscous(1.0, f32::INFINITY), &["relaxation_time", "inf"]);
    refused(&viscous(2e6, 0.0), &["retardation_time", "2000000"]);
    refused(&viscous(1.0, 1e-12), &["relaxation_time", "0.000000000001"]);
    refused(&viscous(0.0, 2.0), &["relaxation_time", "2", "retardation_time"]);
    let bare = BodyDefinition {
        springs: Some(&[]),
        ..viscous(1.0, 2.0)
    };
    refused(&bare, &["retardation_time", "springs"]);
}
