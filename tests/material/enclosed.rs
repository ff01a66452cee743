//! Pressure inside closed surfaces: forces against gradients of a formula in `f64`, thin-shell theory, conserved
//! volumes, the same rest shape with every solver, oscillation, conserved quantities, cuts, and refusals.

use std::f64::consts::PI;

use crate::support::bodies::{FREE, Random, largest_difference};
use crate::support::scene::{SOLVERS, STORAGES, Scene};
use crate::support::solid::ball;
use glam::{DMat3, DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Error, Material, Model, Solver, Storage, Values, World, WorldDefinition};

const RADIUS: f64 = 0.05;
const YOUNG: f64 = 1e5;
const THICKNESS: f64 = 1e-3;

/// Rubber that fills the triangles.
const SHEET: Material = Material {
    model: Model::Springs,
    young_modulus: YOUNG as f32,
    poisson_ratio: 0.0,
    density: 1000.0,
    thickness: THICKNESS as f32,
};

#[derive(Clone, Default)]
struct Surface {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    fn sphere(radius: f64, levels: u32) -> Self {
        let Mesh {
            positions, triangles, ..
        } = ball(radius as f32, levels);
        Self { positions, triangles }
    }

    /// Returns both surfaces, the other one translated.
    fn combined_with(mut self, other: &Self, offset: Vec3) -> Self {
        let first = self.positions.len() as u32;
        self.positions
            .extend(other.positions.iter().map(|&position| position + offset));
        self.triangles.extend(
            other
                .triangles
                .iter()
                .map(|corners| corners.map(|corner| corner + first)),
        );
        self
    }

    fn at(&self) -> Vec<DVec3> {
        as_f64(&self.positions)
    }

    /// A body with springs of zero stiffness.
    fn without_stiffness(&self) -> BodyDefinition<'_> {
        BodyDefinition {
            positions: &self.positions,
            triangles: &self.triangles,
            masses: Values::Uniform(1e-4),
            ..BodyDefinition::default()
        }
    }

    /// A body of rubber.
    fn sheet(&self) -> BodyDefinition<'_> {
        BodyDefinition {
            positions: &self.positions,
            triangles: &self.triangles,
            material: Some(SHEET),
            ..BodyDefinition::default()
        }
    }
}

fn as_f64(positions: &[Vec3]) -> Vec<DVec3> {
    positions.iter().map(|position| position.as_dvec3()).collect()
}

/// Returns the volume enclosed by triangles (m³).
fn volume(triangles: &[[u32; 3]], at: &[DVec3]) -> f64 {
    let terms = triangles.iter().map(|corners| {
        let [a, b, c] = corners.map(|corner| at[corner as usize]);
        DMat3::from_cols(a, b, c).determinant() / 6.0
    });
    terms.sum()
}

/// A body with cavities that keep their volumes and are under pressure.
struct Formula<'a> {
    cavities: Vec<&'a [[u32; 3]]>,
    rest: Vec<DVec3>,
    stiffness: f64,
    pressure: f64,
}

impl Formula<'_> {
    fn energy(&self, at: &[DVec3]) -> f64 {
        let terms = self.cavities.iter().map(|triangles| {
            let (rest, now) = (volume(triangles, &self.rest), volume(triangles, at));
            0.5 * self.stiffness * rest * (now / rest - 1.0).powi(2) - self.pressure * (now - rest)
        });
        terms.sum()
    }

    /// Returns the negative gradient of the energy.
    fn forces(&self, at: &[DVec3]) -> Vec<DVec3> {
        const STEP: f64 = 1e-5;
        let mut at = at.to_vec();
        let mut force = |node: usize| {
            DVec3::from_array([0, 1, 2].map(|axis| {
                let position = at[node][axis];
                let [more, less] = [STEP, -STEP].map(|step| {
                    at[node][axis] = position + step;
                    self.energy(&at)
                });
                at[node][axis] = position;
                (less - more) / (2.0 * STEP)
            }))
        };
        (0..self.rest.len()).map(&mut force).collect()
    }
}

impl Scene {
    /// Returns the force on each node at these positions, measured as the force that holds it.
    fn forces(&mut self, positions: &[Vec3]) -> Vec<DVec3> {
        let nodes = 0..positions.len() as u32;
        let body = self.body_mut();
        nodes.clone().for_each(|node| body.pin(node).expect("a node"));
        body.set_positions(positions).expect("positions");
        self.run(1e-5, 1);
        let held = |node| -self.body().pin_force(node).expect("a pin").as_dvec3();
        nodes.map(held).collect()
    }
}

fn longest(vectors: &[DVec3]) -> f64 {
    vectors.iter().map(|vector| vector.length()).fold(0.0, f64::max)
}

/// Returns rotated, widened and crumpled positions.
fn deformed(surface: &Surface, seed: u64) -> Vec<Vec3> {
    let mut random = Random::new(seed);
    let turned = glam::Quat::from_rotation_y(0.4) * glam::Quat::from_rotation_x(0.3);
    let stretched = |position: &Vec3| turned * (*position * Vec3::new(1.3, 0.8, 1.0)) + random.vector() * 2e-3;
    surface.positions.iter().map(stretched).collect()
}

#[test]
fn forces_and_energy_agree_with_the_formula() {
    let (large, small) = (Surface::sphere(RADIUS, 3), Surface::sphere(0.02, 1));
    let both = large.clone().combined_with(&small, Vec3::new(0.2, 0.01, 0.0));
    let positions = deformed(&both, 3);
    let (first, second) = both.triangles.split_at(large.triangles.len());
    let formula = Formula {
        cavities: vec![first, second],
        rest: both.at(),
        stiffness: 2000.0,
        pressure: 300.0,
    };
    let expected = formula.forces(&as_f64(&positions));
    let size = longest(&expected);
    for storage in STORAGES {
        for solver in SOLVERS {
            if storage != Storage::Packed && solver != Solver::Verlet {
                continue;
            }
            let mut scene = Scene::new(
                FREE,
                &BodyDefinition {
                    storage,
                    solver,
                    enclosed_stiffness: 2000.0,
                    pressure: 300.0,
                    ..both.without_stiffness()
                },
            );
            let error = largest_difference(&scene.forces(&positions), &expected) / size;
            assert!(error < 2e-6, "{storage:?}, {solver:?}: {error:e} off");
            let (energy, expected) = (scene.energy(), formula.energy(&as_f64(&positions)));
            assert!((energy / expected - 1.0).abs() < 1e-6, "{energy} {expected}");
            let report = scene.body().enclosed();
            let [rest, now] = [both.at(), as_f64(&positions)].map(|at| volume(&both.triangles, &at));
            assert_eq!(report.cavity_count, 2);
            assert!((report.rest_volume / rest - 1.0).abs() < 1e-9);
            assert!((report.volume / now - 1.0).abs() < 1e-6, "{} {now}", report.volume);
            let pressure = 300.0 - 2000.0 * (now / rest - 1.0);
            assert!(
                (report.pressure - pressure).abs() < 0.01,
                "{} {pressure}",
                report.pressure
            );
        }
    }
}

#[test]
fn pressure_has_no_net_force() {
    let surface = Surface::sphere(RADIUS, 3);
    for solver in SOLVERS {
        let mut scene = Scene::new(
            FREE,
            &BodyDefinition {
                solver,
                enclosed_stiffness: 1000.0,
                pressure: 500.0,
                ..surface.without_stiffness()
            },
        );
        scene
            .body_mut()
            .set_positions(&deformed(&surface, 5))
            .expect("positions");
        scene.run(1e-4, 1);
        let body = scene.body();
        let centre = scene.positions().iter().sum::<DVec3>() / surface.positions.len() as f64;
        let (mut sum, mut turn, mut size) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for (position, velocity) in scene.positions().iter().zip(body.velocities()) {
            let velocity = velocity.as_dvec3();
            sum += velocity;
            turn += (*position - centre).cross(velocity) / RADIUS;
            size += velocity.length();
        }
        assert!(size > 1.0, "{solver:?}: hardly anything moves");
        assert!(sum.length() < 1e-6 * size, "{solver:?}: {sum} of {size}");
        assert!(turn.length() < 1e-6 * size, "{solver:?}: {turn} of {size}");
    }
}

/// Springs with cotangent weights (Pinkall, Polthier 1993): unlike those of a material they balance each other on any
/// uniformly stretched mesh. Their E t is the same, and Poisson's ratio is 1/3.
fn balanced_springs(surface: &Surface) -> (Vec<[u32; 2]>, Vec<f32>) {
    let at = surface.at();
    let mut weights = std::collections::BTreeMap::new();
    for &[a, b, c] in &surface.triangles {
        for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
            let [to_a, to_b] = [a, b].map(|node| at[node as usize] - at[c as usize]);
            *weights.entry([a.min(b), a.max(b)]).or_insert(0.0) += to_a.dot(to_b) / to_a.cross(to_b).length() / 2.0;
        }
    }
    let stiffness = |weight: f64| (1.5 * YOUNG * THICKNESS * weight) as f32;
    weights
        .into_iter()
        .map(|(pair, weight)| (pair, stiffness(weight)))
        .unzip()
}

/// The relative growth in radius of a sphere with Poisson's ratio 1/3: `p R (1 - nu) / 2 E t`.
#[test]
fn a_thin_sphere_widens_by_laplaces_law() {
    let pressure = 18.0;
    let expected = pressure * RADIUS * (1.0 - 1.0 / 3.0) / (2.0 * YOUNG * THICKNESS);
    let mut errors = Vec::new();
    for levels in [1, 2, 3, 4] {
        let surface = Surface::sphere(RADIUS, levels);
        let (springs, stiffnesses) = balanced_springs(&surface);
        let mut scene = Scene::new(
            FREE,
            &BodyDefinition {
                springs: Some(&springs),
                stiffnesses: Values::Each(&stiffnesses),
                pressure: pressure as f32,
                ..surface.without_stiffness()
            },
        );
        scene.rest();
        let report = scene.body().enclosed();
        let wider = (report.volume / report.rest_volume).cbrt() - 1.0;
        // The surface under pressure has grown too.
        errors.push(wider / (1.0 + wider).powi(2) / expected - 1.0);
    }
    assert!(errors[3].abs() < 0.001, "{errors:?}");
    for pair in errors.windows(2) {
        assert!(pair[1].abs() < 0.4 * pair[0].abs(), "{errors:?}");
    }
}

/// Compresses a sphere at its poles by moving pins.
fn squeezed(surface: &Surface, solver: Solver, stiffness: f32) -> Scene {
    let definition = BodyDefinition {
        solver,
        enclosed_stiffness: stiffness,
        node_dampings: Values::Uniform(1e-3),
        ..surface.sheet()
    };
    let mut scene = Scene::new(FREE, &definition);
    let poles: Vec<u32> = (0..surface.positions.len() as u32)
        .filter(|&node| surface.positions[node as usize].y.abs() > 0.9 * RADIUS as f32)
        .collect();
    let body = scene.body_mut();
    poles.iter().for_each(|&node| body.pin(node).expect("a node"));
    for step in 1..=30 {
        for &node in &poles {
            let position = surface.positions[node as usize];
            let lower = position.y * (1.0 - 0.3 * step as f32 / 30.0);
            let body = scene.body_mut();
            body.move_pin(node, Vec3::new(position.x, lower, position.z))
                .expect("a pin");
        }
        scene.run(1.0 / 60.0, 1);
    }
    scene
}

#[test]
fn a_squeezed_sphere_keeps_its_volume() {
    let surface = Surface::sphere(RADIUS, 2);
    for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
        let [soft, hard] = [1e5, 1e6].map(|stiffness| {
            let mut scene = squeezed(&surface, solver, stiffness);
            let converged = scene.body().solver_report().has_converged;
            assert!(converged || solver == Solver::Verlet, "{solver:?}: {stiffness} Pa");
            scene.rest();
            scene.body().enclosed()
        });
        let growth = |report: sinew::EnclosedReport| report.volume / report.rest_volume - 1.0;
        assert!(hard.pressure > 100.0, "{solver:?}: {hard:?}");
        assert!(growth(hard).abs() < 0.002, "{solver:?}: {hard:?}");
        // The stiffer sphere deforms less under almost the same pressure.
        assert!((soft.pressure / hard.pressure - 1.0).abs() < 0.05, "{soft:?} {hard:?}");
        assert!(
            (growth(soft) / growth(hard) / 10.0 - 1.0).abs() < 0.05,
            "{soft:?} {hard:?}"
        );
    }
    let lax = squeezed(&surface, Solver::Implicit, 0.0).positions();
    let left = volume(&surface.triangles, &lax) / volume(&surface.triangles, &surface.at());
    assert!(left < 0.95, "a sphere without contents keeps {left} of its volume");
}

#[test]
fn every_solver_and_storage_comes_to_the_same_rest() {
    let surface = Surface::sphere(RADIUS, 2);
    let world = WorldDefinition {
        gravity: Vec3::new(0.0, -9.81, 0.0),
        ..FREE
    };
    let hung = |solver, storage| {
        let mut scene = Scene::new(
            world,
            &BodyDefinition {
                solver,
                storage,
                node_dampings: Values::Uniform(2e-3),
                enclosed_stiffness: 1000.0,
                pressure: 800.0,
                ..surface.sheet()
            },
        );
        for node in (0..162).filter(|&node| surface.positions[node as usize].y > 0.8 * RADIUS as f32) {
            scene.body_mut().pin(node).expect("a node");
        }
        scene
    };
    let mut found = hung(Solver::Newton, Storage::Packed);
    let iterations = found.rest();
    assert!(
        iterations < 30,
        "{iterations} linearised equations: second derivatives are wrong"
    );
    let rest = found.positions();
    assert!(
        largest_difference(&rest, &surface.at()) > 0.05 * RADIUS,
        "it hardly moves"
    );
    for solver in SOLVERS {
        for storage in STORAGES {
            if storage != Storage::Packed && solver == Solver::Newton {
                continue;
            }
            let mut scene = hung(solver, storage);
            scene.run(0.02, 100);
            let error = largest_difference(&scene.positions(), &rest) / RADIUS;
            assert!(error < 2e-5, "{solver:?}, {storage:?}: {error:e} off");
        }
    }
}

/// A sphere that grows and shrinks with the frequency of its springs and contents.
#[test]
fn a_sphere_oscillates_at_its_frequency() {
    const STIFFNESS: f64 = 3e4;
    let surface = Surface::sphere(RADIUS, 3);
    let area = 4.0 * PI * RADIUS * RADIUS;
    let mass = 1000.0 * THICKNESS * area;
    let contents = 9.0 * STIFFNESS * area * RADIUS / 3.0;
    let stiffness = 3.0 * YOUNG * THICKNESS * area + contents;
    let expected = 2.0 * PI / (stiffness / (mass * RADIUS * RADIUS)).sqrt();
    let wide: Vec<Vec3> = surface.positions.iter().map(|&position| position * 1.001).collect();
    for solver in SOLVERS {
        let mut scene = Scene::new(
            FREE,
            &BodyDefinition {
                solver,
                enclosed_stiffness: STIFFNESS as f32,
                ..surface.sheet()
            },
        );
        scene.body_mut().set_positions(&wide).expect("positions");
        let step = expected / 200.0;
        let growth = |scene: &Scene| {
            let report = scene.body().enclosed();
            report.volume / report.rest_volume - 1.0
        };
        // The time of its third passage through rest: three quarters and half a period more.
        let (mut crossings, mut last, mut time) = (0, growth(&scene), 0.0);
        while crossings < 3 {
            scene.run(step as f32, 1);
            let now = growth(&scene);
            time += step;
            if now * last < 0.0 {
                crossings += 1;
                if crossings == 3 {
                    time -= step * now / (now - last);
                }
            }
            last = now;
            assert!(time < 3.0 * expected, "{solver:?}: no oscillation");
        }
        let period = time / 1.25;
        assert!(
            (period / expected - 1.0).abs() < 0.01,
            "{solver:?}: {period} s, {expected} s"
        );
    }
}

/// Returns the highest frequency of nodes of equal mass under pressure (1/s), by power iteration with differences of
/// forces.
fn highest_frequency(
    triangles: &[[u32; 3]],
    [rest, at]: [&[DVec3]; 2],
    [stiffness, pressure]: [f64; 2],
    mass: f64,
) -> f64 {
    let forces = |at: &[DVec3]| {
        let pressure = pressure - stiffness * (volume(triangles, at) / volume(triangles, rest) - 1.0);
        let mut forces = vec![DVec3::ZERO; at.len()];
        for corners in triangles {
            let [a, b, c] = corners.map(|corner| at[corner as usize]);
            corners
                .iter()
                .for_each(|&corner| forces[corner as usize] += (b - a).cross(c - a) * (pressure / 6.0));
        }
        forces
    };
    let mut random = Random::new(1);
    let mut mode: Vec<DVec3> = at.iter().map(|_| random.vector().as_dvec3()).collect();
    let mut square = 0.0;
    for _ in 0..400 {
        let size = mode.iter().map(|mode| mode.length_squared()).sum::<f64>().sqrt() / 1e-5;
        let moved = |sign: f64| -> Vec<DVec3> {
            at.iter()
                .zip(&mode)
                .map(|(at, mode)| *at + *mode * (sign / size))
                .collect()
        };
        let (more, less) = (forces(&moved(1.0)), forces(&moved(-1.0)));
        mode = more
            .iter()
            .zip(less)
            .map(|(more, less)| (*more - less) / (2e-5 * mass))
            .collect();
        square = mode.iter().map(|mode| mode.length_squared()).sum::<f64>().sqrt();
    }
    square.sqrt()
}

#[test]
fn the_stable_substep_is_short_enough_and_not_far_too_short() {
    let surface = Surface::sphere(RADIUS, 2);
    let crumpled = deformed(&surface, 4);
    for (stiffness, pressure, positions, least) in [
        (1e4, 0.0, &surface.positions, 0.95),
        (0.0, 500.0, &surface.positions, 0.6),
        (0.0, -500.0, &crumpled, 0.4),
        (1e4, 500.0, &crumpled, 0.5),
    ] {
        let mut scene = Scene::new(
            FREE,
            &BodyDefinition {
                enclosed_stiffness: stiffness,
                pressure,
                ..surface.without_stiffness()
            },
        );
        scene.body_mut().set_positions(positions).expect("positions");
        let stable = scene.world.step(1e-7).expect("a step").stable_substep;
        let numbers = [stiffness, pressure].map(f64::from);
        let highest = highest_frequency(&surface.triangles, [&surface.at(), &as_f64(positions)], numbers, 1e-4);
        let part = f64::from(stable) / (2.0 / highest);
        assert!(
            (least..1.001).contains(&part),
            "{stiffness}, {pressure}: {part} of the limit"
        );
    }
}

#[test]
fn verlet_keeps_the_energy_of_a_balloon() {
    let surface = Surface::sphere(RADIUS, 2);
    let wide: Vec<Vec3> = surface
        .positions
        .iter()
        .map(|&p| p * Vec3::new(1.1, 0.95, 1.0))
        .collect();
    for (stiffness, pressure) in [(0.0, 400.0), (5e4, 0.0), (2e4, -300.0)] {
        let lost = |substeps| {
            let world = WorldDefinition { substeps, ..FREE };
            let mut scene = Scene::new(
                world,
                &BodyDefinition {
                    enclosed_stiffness: stiffness,
                    pressure,
                    ..surface.sheet()
                },
            );
            scene.body_mut().set_positions(&wide).expect("positions");
            let before = scene.energy();
            let (mut most, mut fastest) = (0.0_f64, 0.0_f64);
            for _ in 0..200 {
                scene.run(1e-3, 1);
                most = most.max((scene.energy() - before).abs());
                fastest = fastest.max(scene.body().energy(Vec3::ZERO).kinetic);
            }
            most / fastest
        };
        let [whole, half] = [8, 16].map(lost);
        assert!(whole < 0.02, "{stiffness}, {pressure}: {whole} of the energy");
        assert!(half < 0.35 * whole, "{stiffness}, {pressure}: {whole} {half}");
    }
}

#[test]
fn implicit_steps_gain_no_energy_and_keep_momentum() {
    let surface = Surface::sphere(RADIUS, 2);
    for solver in [Solver::Implicit, Solver::Newton] {
        let mut scene = Scene::new(
            FREE,
            &BodyDefinition {
                solver,
                enclosed_stiffness: 2e4,
                pressure: 600.0,
                ..surface.sheet()
            },
        );
        let before = scene.energy();
        let mut lowest = f64::INFINITY;
        for _ in 0..60 {
            scene.run(1.0 / 60.0, 1);
            assert!(scene.body().solver_report().has_converged, "{solver:?}");
            lowest = lowest.min(scene.energy());
        }
        // The work of the pressure exceeds the stored energy; the rest was dissipated.
        assert!(
            scene.energy() < 0.0 && scene.energy() < before,
            "{solver:?}: {}",
            scene.energy()
        );
        let mut found = Scene::new(
            FREE,
            &BodyDefinition {
                enclosed_stiffness: 2e4,
                pressure: 600.0,
                ..surface.sheet()
            },
        );
        found.rest();
        assert!(
            (scene.energy() / found.energy() - 1.0).abs() < 1e-3,
            "{solver:?}: {} {}",
            scene.energy(),
            found.energy()
        );
        let sum: DVec3 = as_f64(scene.body().velocities()).iter().sum();
        assert!(sum.length() < 1e-4, "{solver:?}: {sum}");
    }
}

#[test]
fn results_are_the_same_for_any_number_of_threads() {
    results_are_the_same_for_any_number_of_threads_of(Solver::Verlet);
}

#[test]
#[ignore = "long"]
fn results_are_the_same_for_any_number_of_threads_with_implicit() {
    results_are_the_same_for_any_number_of_threads_of(Solver::Implicit);
}

fn results_are_the_same_for_any_number_of_threads_of(solver: Solver) {
    let surface = Surface::sphere(RADIUS, 5);
    let hash = |thread_count| {
        let world = WorldDefinition { thread_count, ..FREE };
        let mut scene = Scene::new(
            world,
            &BodyDefinition {
                solver,
                enclosed_stiffness: 2e4,
                pressure: 500.0,
                ..surface.sheet()
            },
        );
        scene
            .body_mut()
            .set_positions(&deformed(&surface, 8))
            .expect("positions");
        scene.run(1e-3, 4);
        scene.world.state_hash()
    };
    let alone = hash(1);
    assert_eq!([hash(2), hash(5)], [alone; 2], "{solver:?}");
}

#[test]
fn a_cut_opens_one_cavity_permanently() {
    let surface = Surface::sphere(RADIUS, 1).combined_with(&Surface::sphere(RADIUS, 1), Vec3::new(0.2, 0.0, 0.0));
    let [a, b, _] = surface.triangles[100];
    assert!(a >= 42 && b >= 42, "an edge of the second");
    for storage in STORAGES {
        for solver in SOLVERS {
            let mut scene = Scene::new(
                FREE,
                &BodyDefinition {
                    storage,
                    solver,
                    enclosed_stiffness: 1000.0,
                    pressure: 200.0,
                    ..surface.without_stiffness()
                },
            );
            scene.run(1e-4, 1);
            scene.body_mut().remove_spring(b, a).expect("an edge");
            assert_eq!(scene.body().enclosed().cavity_count, 1);
            scene.body_mut().add_spring(a, b, 0.0, None).expect("a spring");
            scene.body_mut().set_pressure(300.0).expect("a pressure");
            let forces = scene.forces(&surface.positions);
            assert!(
                longest(&forces[42..]) == 0.0,
                "{storage:?}, {solver:?}: {}",
                longest(&forces[42..])
            );
            let expected = Formula {
                cavities: vec![&surface.triangles[..80]],
                rest: surface.at(),
                stiffness: 1000.0,
                pressure: 300.0,
            };
            let expected = expected.forces(&surface.at());
            let error = largest_difference(&forces, &expected) / longest(&expected);
            assert!(error < 2e-6, "{storage:?}, {solver:?}: {error:e} off");
            // The spring no longer exists, and a second cut finds nothing else either.
            scene.body_mut().remove_spring(a, b).expect("a spring");
            let nothing = scene.body_mut().remove_spring(a, b);
            assert!(matches!(nothing, Err(Error::InvalidArgument(_))), "{nothing:?}");
        }
    }
}

#[test]
fn pressure_can_change_during_the_run() {
    let surface = Surface::sphere(RADIUS, 2);
    for solver in SOLVERS {
        let definition = BodyDefinition {
            solver,
            node_dampings: Values::Uniform(2e-3),
            pressure: 1.0,
            ..surface.sheet()
        };
        let mut scene = Scene::new(FREE, &definition);
        for step in 0..=60 {
            scene.body_mut().set_pressure(5.0 * step as f32).expect("a pressure");
            scene.run(0.01, 1);
        }
        scene.run(0.02, 80);
        let mut other = Scene::new(
            FREE,
            &BodyDefinition {
                pressure: 300.0,
                ..definition
            },
        );
        other.rest();
        let volumes = [&scene, &other].map(|scene| scene.body().enclosed().volume);
        assert!((volumes[0] / volumes[1] - 1.0).abs() < 1e-5, "{solver:?}: {volumes:?}");
        assert!(
            volumes[1] > 1.1 * volume(&surface.triangles, &surface.at()),
            "{volumes:?}"
        );
        // Under negative pressure it comes to rest smaller, or crumpled.
        scene.body_mut().set_pressure(-50.0).expect("a pressure");
        scene.run(0.02, 20);
        assert!(scene.body().enclosed().volume < 0.98 * volume(&surface.triangles, &surface.at()));
    }
}

#[test]
fn scrambled_flattened_and_collapsed_spheres_stay_finite() {
    let surface = Surface::sphere(RADIUS, 2);
    let mut random = Random::new(6);
    let scrambled: Vec<Vec3> = surface
        .positions
        .iter()
        .map(|_| random.vector() * RADIUS as f32)
        .collect();
    let flat: Vec<Vec3> = surface
        .positions
        .iter()
        .map(|&p| p * Vec3::new(1.0, 0.0, 1.0))
        .collect();
    let inside_out: Vec<Vec3> = surface.positions.iter().map(|&p| -p).collect();
    let point = vec![Vec3::splat(0.01); surface.positions.len()];
    for solver in [Solver::Verlet, Solver::Implicit] {
        for (name, positions) in [
            ("scrambled", &scrambled),
            ("flat", &flat),
            ("inside out", &inside_out),
            ("a point", &point),
        ] {
            let mut scene = Scene::new(
                FREE,
                &BodyDefinition {
                    solver,
                    node_dampings: Values::Uniform(1e-3),
                    enclosed_stiffness: 2e4,
                    pressure: 200.0,
                    ..surface.sheet()
                },
            );
            scene.body_mut().set_positions(positions).expect("positions");
            scene.run(1.0 / 60.0, 90);
            let report = scene.body().enclosed();
            assert!(
                scene.energy().is_finite() && longest(&scene.positions()) < 10.0 * RADIUS,
                "{solver:?}, {name}"
            );
            if name == "a point" {
                // All springs lie on one line: no force leads off it.
                continue;
            }
            // The contents expand: the volume recovers, whether or not folds are left.
            let filled = report.volume / report.rest_volume;
            assert!(
                (0.9..1.1).contains(&filled),
                "{solver:?}, {name}: {filled} of the volume"
            );
        }
    }
}

/// A constant pressure that springs cannot balance: the pressurized area grows, and the body soon becomes infinitely
/// large. It grows until a step is refused, or ends otherwise; nothing becomes NaN.
#[test]
fn bursting_is_refused_or_stays_finite() {
    let surface = Surface::sphere(RADIUS, 1);
    for solver in SOLVERS {
        let mut scene = Scene::new(
            FREE,
            &BodyDefinition {
                solver,
                pressure: 3000.0,
                ..surface.sheet()
            },
        );
        for _ in 0..30 {
            let stepped = scene.world.step(1e-3);
            assert!(
                matches!(stepped, Ok(_) | Err(Error::Unstable { .. })),
                "{solver:?}: {stepped:?}"
            );
            assert!(
                scene
                    .body()
                    .positions()
                    .iter()
                    .chain(scene.body().velocities())
                    .all(|v| v.is_finite())
            );
        }
        assert!(longest(&scene.positions()) > 2.0 * RADIUS, "{solver:?}");
    }
}

/// Returns a ball of tetrahedra with a cavity.
fn hollow_ball(inside: &Surface) -> (Vec<Vec3>, Vec<[u32; 4]>) {
    let count = inside.positions.len() as u32;
    let mut positions = inside.positions.clone();
    positions.extend(inside.positions.iter().map(|&position| position * 1.5));
    let mut tetrahedra = Vec::new();
    for mut corners in inside.triangles.iter().copied() {
        corners.sort_unstable();
        let ([a, b, c], [d, e, f]) = (corners, corners.map(|corner| corner + count));
        for corners in [[a, b, c, f], [a, b, e, f], [a, d, e, f]] {
            let [p, q, r, s] = corners.map(|corner| positions[corner as usize].as_dvec3());
            let volume = DMat3::from_cols(q - p, r - p, s - p).determinant();
            let [p, q, r, s] = corners;
            tetrahedra.push(if volume > 0.0 { [p, q, r, s] } else { [q, p, r, s] });
        }
    }
    (positions, tetrahedra)
}

#[test]
fn the_cavity_of_a_hollow_organ_is_its_inside() {
    let inside = Surface::sphere(RADIUS, 2);
    let (positions, tetrahedra) = hollow_ball(&inside);
    let definition = BodyDefinition {
        positions: &positions,
        tetrahedra: &tetrahedra,
        masses: Values::Uniform(1e-4),
        pressure: 100.0,
        ..BodyDefinition::default()
    };
    let mut scene = Scene::new(FREE, &definition);
    let report = scene.body().enclosed();
    assert_eq!(report.cavity_count, 1);
    let within = volume(&inside.triangles, &inside.at());
    assert!((report.volume / within - 1.0).abs() < 1e-6, "{report:?}");
    let forces = scene.forces(&positions);
    let (wall, outside) = forces.split_at(inside.positions.len());
    assert_eq!(longest(outside), 0.0);
    for (force, position) in wall.iter().zip(inside.at()) {
        // The force points outward and is the node's share of the area times the pressure.
        assert!(
            force.dot(position) > 0.999 * force.length() * position.length(),
            "{force} at {position}"
        );
    }
    let pushed: f64 = wall
        .iter()
        .zip(inside.at())
        .map(|(force, position)| force.dot(position))
        .sum();
    assert!((pushed / (3.0 * 100.0 * within) - 1.0).abs() < 1e-5, "{pushed}");
}

#[test]
fn cells_and_tetrahedra_have_the_cavity_of_their_boundary() {
    let block = sinew::mesh::Mesh::block([0.03, 0.02, 0.02], [3, 2, 2]).expect("a block");
    let lattice = sinew::mesh::Mesh::lattice(0.01, [3, 2, 2]).expect("a lattice");
    for mesh in [block, lattice] {
        let scene = Scene::new(
            FREE,
            &BodyDefinition {
                positions: &mesh.positions,
                tetrahedra: &mesh.tetrahedra,
                cells: &mesh.cells,
                masses: Values::Uniform(1e-4),
                enclosed_stiffness: 1.0,
                ..BodyDefinition::default()
            },
        );
        let report = scene.body().enclosed();
        assert_eq!(report.cavity_count, 1);
        assert!((report.volume / 12e-6 - 1.0).abs() < 1e-6, "{report:?}");
    }
}

#[test]
fn invalid_definitions_are_refused() {
    let surface = Surface::sphere(RADIUS, 1);
    let good = BodyDefinition {
        enclosed_stiffness: 7.0,
        ..surface.without_stiffness()
    };
    let refused = |definition: BodyDefinition, words: &str| {
        let mut world = World::new(FREE).expect("a world");
        match world.create_body(&definition) {
            Err(Error::InvalidArgument(message)) => assert!(message.contains(words), "{message}"),
            other => panic!("{words}: {other:?}"),
        }
    };
    for enclosed_stiffness in [-1.0, f32::NAN, f32::INFINITY] {
        let words = format!("enclosed_stiffness is {enclosed_stiffness}");
        refused(
            BodyDefinition {
                enclosed_stiffness,
                ..good
            },
            &words,
        );
    }
    for pressure in [f32::NEG_INFINITY, f32::NAN, f32::INFINITY] {
        refused(BodyDefinition { pressure, ..good }, &format!("pressure is {pressure}"));
    }
    let closed_by = |triangles| BodyDefinition { triangles, ..good };
    refused(
        closed_by(&[]),
        "enclosed_stiffness is 7 Pa, and the body has no surface",
    );
    refused(
        closed_by(&surface.triangles[1..]),
        "enclosed_stiffness is 7 Pa, and the surface is not closed",
    );
    let mut turned = surface.triangles.clone();
    turned[5].swap(0, 1);
    refused(
        BodyDefinition {
            enclosed_stiffness: 0.0,
            pressure: -3.0,
            ..closed_by(&turned)
        },
        "pressure is -3 Pa, and the surface is not closed",
    );
    let flat: Vec<Vec3> = surface
        .positions
        .iter()
        .map(|&p| p * Vec3::new(1.0, 0.0, 1.0))
        .collect();
    refused(
        BodyDefinition {
            positions: &flat,
            ..good
        },
        "it is flat",
    );
    refused(
        BodyDefinition {
            rest_positions: Some(&flat),
            ..good
        },
        "it is flat",
    );

    let mut plain = Scene::new(FREE, &surface.without_stiffness());
    assert_eq!(plain.body().enclosed(), sinew::EnclosedReport::default());
    let hash = plain.world.state_hash();
    assert!(matches!(
        plain.body_mut().set_pressure(1.0),
        Err(Error::InvalidArgument(_))
    ));
    assert_eq!(plain.world.state_hash(), hash);
    let mut scene = Scene::new(
        FREE,
        &BodyDefinition {
            pressure: 2.0,
            ..surface.without_stiffness()
        },
    );
    let hash = scene.world.state_hash();
    for value in [f32::NAN, f32::INFINITY] {
        assert!(matches!(
            scene.body_mut().set_pressure(value),
            Err(Error::InvalidArgument(_))
        ));
    }
    assert_eq!(scene.world.state_hash(), hash);
    assert_eq!(scene.body().enclosed().pressure, 2.0);
}
