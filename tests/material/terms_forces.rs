//! Terms beside springs: forces against derivatives of formulas in `f64`, energy and momentum, agreement of every
//! solver, storage and number of threads, removed springs, and refusals.

use std::ops::Range;

use crate::support::bodies::{FREE, Random, largest_difference};
use crate::support::scene::{SOLVERS, STORAGES, Scene};
use glam::{DMat3, DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Error, RestStateDefinition, Solver, SpringLaw, Storage, Values, World, WorldDefinition};

const STIFFNESS: f64 = 4.0;
const HOME: f64 = 0.5;
const RIGIDITY: f64 = 3e-5;
const FIBRE: f64 = 4000.0;
const MASS: f32 = 1e-4;

/// A block with a surface that has edges, faces and fibers.
struct Tissue {
    mesh: Mesh,
    surface: Vec<[u32; 3]>,
    springs: Vec<[u32; 2]>,
    directions: Vec<Vec3>,
}

/// The terms of a body.
#[derive(Clone, Copy, Debug, Default)]
struct TermSet {
    home: bool,
    bending: bool,
    law: SpringLaw,
    fibres: bool,
}

const EXPONENTIAL: SpringLaw = SpringLaw::Exponential {
    steepness: 8.0,
    limit: 0.2,
};
const CUBIC: SpringLaw = SpringLaw::Cubic {
    quadratic: 3.0,
    cubic: 4.0,
    limit: 0.25,
};
const ALL: TermSet = TermSet {
    home: true,
    bending: true,
    law: EXPONENTIAL,
    fibres: true,
};

/// Returns each term alone, and all together.
fn all_term_sets() -> [TermSet; 6] {
    let none = TermSet::default();
    [
        TermSet { home: true, ..none },
        TermSet { bending: true, ..none },
        TermSet {
            law: EXPONENTIAL,
            ..none
        },
        TermSet { law: CUBIC, ..none },
        TermSet { fibres: true, ..none },
        ALL,
    ]
}

impl Tissue {
    /// With many `cells` it is large enough for several tiles.
    fn new(cells: [u32; 3]) -> Self {
        let size = cells.map(|count| count as f32 * 0.01);
        let mut mesh = Mesh::block(size, cells).expect("a block");
        let mut random = Random::new(11);
        for position in &mut mesh.positions {
            *position += random.vector() * 1e-3;
        }
        let mut world = World::new(FREE).expect("a world");
        let body = world.create_body(&BodyDefinition {
            masses: Values::Uniform(MASS),
            ..BodyDefinition::of(&mesh)
        });
        let body = world.body(body.expect("a body")).expect("the body");
        let directions = mesh.tetrahedra.iter().enumerate().map(|(index, _)| {
            if index % 5 == 0 {
                Vec3::ZERO
            } else {
                (Vec3::X + 0.3 * random.vector()).normalize()
            }
        });
        Self {
            directions: directions.collect(),
            surface: body.surface().to_vec(),
            springs: body.spring_pairs().expect("springs"),
            mesh,
        }
    }

    fn definition(&self, terms: TermSet) -> BodyDefinition<'_> {
        BodyDefinition {
            masses: Values::Uniform(MASS),
            springs: Some(&self.springs),
            stiffnesses: Values::Uniform(STIFFNESS as f32),
            triangles: &self.surface,
            home_stiffnesses: Values::Uniform(if terms.home { HOME as f32 } else { 0.0 }),
            bending_stiffness: if terms.bending { RIGIDITY as f32 } else { 0.0 },
            spring_law: terms.law,
            fibre_directions: if terms.fibres { &self.directions } else { &[] },
            fibre_stiffnesses: Values::Uniform(if terms.fibres { FIBRE as f32 } else { 0.0 }),
            ..BodyDefinition::of(&self.mesh)
        }
    }

    fn rest(&self, node: u32) -> DVec3 {
        self.mesh.positions[node as usize].as_dvec3()
    }

    /// Returns the hinges: the nodes of the edge, and the opposite nodes.
    fn hinges(&self) -> Vec<[u32; 4]> {
        let mut sides = std::collections::BTreeMap::new();
        for &[a, b, c] in &self.surface {
            for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
                sides.entry([a.min(b), a.max(b)]).or_insert(Vec::new()).push(c);
            }
        }
        let hinges = sides.into_iter().filter(|(_, corners)| corners.len() == 2);
        hinges.map(|([a, b], corners)| [a, b, corners[0], corners[1]]).collect()
    }

    /// Returns the elastic energy as the documentation states it.
    fn energy(&self, terms: TermSet, at: &[DVec3]) -> f64 {
        let mut energy = 0.0;
        for &[a, b] in &self.springs {
            let rest_length = f64::from(self.rest(a).distance(self.rest(b)) as f32);
            let strain = at[a as usize].distance(at[b as usize]) / rest_length - 1.0;
            energy += STIFFNESS * rest_length * rest_length * integral(terms.law, strain);
        }
        if terms.home {
            for (place, rest) in at.iter().zip(&self.mesh.positions) {
                energy += 0.5 * HOME * place.distance_squared(rest.as_dvec3());
            }
        }
        if terms.bending {
            for nodes in self.hinges() {
                let rest = nodes.map(|node| self.rest(node));
                energy += RIGIDITY * hinge(rest, nodes.map(|node| at[node as usize]));
            }
        }
        if terms.fibres {
            for (corners, direction) in self.mesh.tetrahedra.iter().zip(&self.directions) {
                let edges = |at: &dyn Fn(u32) -> DVec3| {
                    let [a, b, c, d] = corners.map(at);
                    DMat3::from_cols(b - a, c - a, d - a)
                };
                let rest = edges(&|node| self.rest(node));
                let gradient = edges(&|node| at[node as usize]) * rest.inverse();
                let stretch = ((gradient * direction.as_dvec3()).length() - 1.0).max(0.0);
                energy += 0.5 * FIBRE * rest.determinant().abs() / 6.0 * stretch * stretch;
            }
        }
        energy
    }

    /// Returns the negative gradient of the energy for a node.
    fn force(&self, terms: TermSet, at: &mut [DVec3], node: usize) -> DVec3 {
        const STEP: f64 = 1e-7;
        DVec3::from_array([0, 1, 2].map(|axis| {
            let place = at[node][axis];
            at[node][axis] = place + STEP;
            let more = self.energy(terms, at);
            at[node][axis] = place - STEP;
            let less = self.energy(terms, at);
            at[node][axis] = place;
            (less - more) / (2.0 * STEP)
        }))
    }
}

/// Returns the energy of a spring of unit stiffness and length: the integral of its force over its strain.
fn integral(law: SpringLaw, strain: f64) -> f64 {
    let pull_to = |strain: f64| match law {
        SpringLaw::Linear => [strain, 0.5 * strain * strain, 1.0],
        SpringLaw::Exponential { steepness, .. } => {
            let b = f64::from(steepness);
            let e = (b * strain).exp();
            if strain < 0.0 {
                [strain, 0.5 * strain * strain, 1.0]
            } else {
                [(e - 1.0) / b, (e - 1.0) / (b * b) - strain / b, e]
            }
        }
        SpringLaw::Cubic { quadratic, cubic, .. } => {
            let (a, b) = (f64::from(quadratic), f64::from(cubic));
            [
                strain + a * strain.powi(2) + b * strain.powi(3),
                strain.powi(2) / 2.0 + a * strain.powi(3) / 3.0 + b * strain.powi(4) / 4.0,
                1.0 + 2.0 * a * strain + 3.0 * b * strain.powi(2),
            ]
        }
    };
    let limit = match law {
        SpringLaw::Linear => return pull_to(strain)[1],
        SpringLaw::Exponential { limit, .. } | SpringLaw::Cubic { limit, .. } => f64::from(limit),
    };
    let [pull, energy, slope] = pull_to(strain.min(limit));
    let beyond = (strain - limit).max(0.0);
    energy + pull * beyond + 0.5 * slope * beyond * beyond
}

/// Returns the energy of a hinge of unit flexural rigidity, as documented for bending.
fn hinge(rest: [DVec3; 4], positions: [DVec3; 4]) -> f64 {
    let [a, b, opposite @ ..] = rest;
    let edge = b - a;
    let feet = opposite.map(|corner| (corner - a).dot(edge) / edge.length_squared());
    let heights = [0, 1].map(|arm| (opposite[arm] - a - edge * feet[arm]).length());
    let arms = |[a, b, c, d]: [DVec3; 4]| {
        let edge = b - a;
        [
            (c - a - edge * feet[0]) / heights[0],
            (d - a - edge * feet[1]) / heights[1],
        ]
    };
    let [first, second] = arms(rest);
    // The angle between the arms is half a turn minus the angle of the hinge.
    let angle = std::f64::consts::PI - first.cross(second).length().atan2(first.dot(second));
    let side = (first + second).dot(edge.cross(first - second)).signum();
    let (sine, cosine) = (0.5 * angle).sin_cos();
    let [t, u] = arms(positions);
    let turn = (t + u) * cosine - (positions[1] - positions[0]).cross(t - u) * (side * sine / edge.length());
    let areas = 0.5 * edge.length() * (heights[0] + heights[1]);
    0.5 * edge.length_squared() / areas * turn.length_squared()
}

impl Scene {
    fn momentum(&self) -> [DVec3; 2] {
        let body = self.body();
        let nodes = body.positions().iter().zip(body.velocities());
        nodes.fold([DVec3::ZERO; 2], |[linear, angular], (position, velocity)| {
            let momentum = velocity.as_dvec3() * f64::from(MASS);
            [linear + momentum, angular + position.as_dvec3().cross(momentum)]
        })
    }
}

/// Far from rest, with a different deformation of every spring, hinge and fiber.
fn deformed(mesh: &Mesh, seed: u64) -> Vec<Vec3> {
    let mut random = Random::new(seed);
    let turned = Quat::from_rotation_y(0.4) * Quat::from_rotation_x(0.3);
    let stretched = |position: &Vec3| turned * (*position * Vec3::new(1.2, 0.9, 1.0)) + random.vector() * 1.5e-3;
    mesh.positions.iter().map(stretched).collect()
}

#[test]
fn forces_and_energy_agree_with_the_formulas() {
    let tissue = Tissue::new([4, 3, 3]);
    for terms in all_term_sets() {
        for storage in STORAGES {
            for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
                if storage != Storage::Packed && solver != Solver::Verlet {
                    continue;
                }
                let definition = BodyDefinition {
                    storage,
                    solver,
                    ..tissue.definition(terms)
                };
                let mut scene = Scene::new(FREE, &definition);
                let positions = deformed(&tissue.mesh, 4);
                let body = scene.body_mut();
                for node in 0..positions.len() as u32 {
                    body.pin(node).expect("a node");
                }
                body.set_positions(&positions).expect("positions");
                scene.world.step(1e-5).expect("a step");
                let mut at: Vec<DVec3> = positions.iter().map(|position| position.as_dvec3()).collect();
                let forces: Vec<DVec3> = (0..at.len()).map(|node| tissue.force(terms, &mut at, node)).collect();
                let size = forces.iter().map(|force| force.length()).fold(0.0, f64::max);
                for (node, expected) in forces.iter().enumerate() {
                    let force = -scene.body().pin_force(node as u32).expect("a pin").as_dvec3();
                    let error = force.distance(*expected) / size;
                    assert!(
                        error < 3e-6,
                        "{terms:?}, {storage:?}, {solver:?}, node {node}: {force} {expected}, {error:e} off"
                    );
                }
                let (energy, expected) = (scene.energy(), tissue.energy(terms, &at));
                assert!(
                    (energy - expected).abs() < 1e-6 * expected,
                    "{terms:?}: {energy} {expected}"
                );
            }
        }
    }
}

#[test]
fn the_shape_given_is_at_rest() {
    let tissue = Tissue::new([4, 3, 3]);
    for solver in SOLVERS {
        let definition = BodyDefinition {
            solver,
            ..tissue.definition(ALL)
        };
        let mut scene = Scene::new(FREE, &definition);
        let before = scene.positions();
        for _ in 0..50 {
            scene.world.step(2e-3).expect("a step");
        }
        let moved = largest_difference(&before, &scene.positions());
        assert!(moved < 1e-8, "{solver:?}: {moved} m");
    }
}

#[test]
fn verlet_keeps_energy_and_momentum() {
    let tissue = Tissue::new([14, 6, 6]);
    for terms in all_term_sets() {
        let mut scene = Scene::new(FREE, &tissue.definition(terms));
        let mut random = Random::new(2);
        let spin = Vec3::new(1.0, 2.0, -1.0);
        let velocities: Vec<Vec3> = tissue
            .mesh
            .positions
            .iter()
            .map(|position| spin.cross(*position) + random.vector() * 0.05)
            .collect();
        scene.body_mut().set_velocities(&velocities).expect("velocities");
        let (energy, [linear, angular]) = (scene.energy(), scene.momentum());
        let mut most = 0.0_f64;
        for _ in 0..100 {
            scene.world.step(2e-3).expect("a step");
            most = most.max((scene.energy() / energy - 1.0).abs());
        }
        let substeps = scene.world.step(2e-3).expect("a step").substeps;
        assert!(
            most < 0.03,
            "{terms:?}: {most} of the energy, in steps of {substeps} substeps"
        );
        if !terms.home {
            let [then, turning] = scene.momentum();
            let size = f64::from(MASS) * 0.1 * tissue.mesh.positions.len() as f64;
            assert!(then.distance(linear) < 2e-6 * size, "{terms:?}: {linear} {then}");
            assert!(
                turning.distance(angular) < 2e-6 * size,
                "{terms:?}: {angular} {turning}"
            );
        }
    }
}

#[test]
fn implicit_steps_keep_linear_momentum() {
    let tissue = Tissue::new([4, 3, 3]);
    for solver in [Solver::Implicit, Solver::Newton] {
        let terms = TermSet { home: false, ..ALL };
        let definition = BodyDefinition {
            solver,
            ..tissue.definition(terms)
        };
        let mut scene = Scene::new(FREE, &definition);
        scene
            .body_mut()
            .set_positions(&deformed(&tissue.mesh, 9))
            .expect("positions");
        let energy = scene.energy();
        for _ in 0..20 {
            scene.world.step(5e-3).expect("a step");
        }
        assert!(scene.energy() < energy, "{solver:?}: {energy} {}", scene.energy());
        // Backward differences do not conserve the angular momentum of accelerated motion.
        let [linear, _] = scene.momentum();
        let size = (2.0 * energy * f64::from(MASS) * tissue.mesh.positions.len() as f64).sqrt();
        assert!(linear.length() < 3e-5 * size, "{solver:?}: {linear} of {size}");
    }
}

#[test]
fn every_solver_comes_to_the_same_rest() {
    every_solver_comes_to_the_same_rest_of(5..6);
}

#[test]
#[ignore = "long"]
fn every_solver_comes_to_the_same_rest_under_each_term_alone() {
    every_solver_comes_to_the_same_rest_of(0..5);
}

fn every_solver_comes_to_the_same_rest_of(which: Range<usize>) {
    let tissue = Tissue::new([6, 3, 3]);
    let gravity = Vec3::new(0.0, -2.0, 0.0);
    for &terms in &all_term_sets()[which] {
        let mut rests = Vec::new();
        for solver in SOLVERS {
            for storage in STORAGES {
                if storage != Storage::Packed && solver != Solver::Verlet {
                    continue;
                }
                let definition = BodyDefinition {
                    storage,
                    solver,
                    node_dampings: Values::Uniform(4e-3),
                    accuracy: if solver == Solver::Implicit { 1e-4 } else { 0.0 },
                    ..tissue.definition(terms)
                };
                let mut scene = Scene::new(WorldDefinition { gravity, ..FREE }, &definition);
                let pinned: Vec<u32> = (0..tissue.mesh.positions.len() as u32)
                    .filter(|&node| tissue.mesh.positions[node as usize].x < -0.025)
                    .collect();
                for node in pinned {
                    scene.body_mut().pin(node).expect("a node");
                }
                for _ in 0..150 {
                    scene.world.step(1.0 / 60.0).expect("a step");
                }
                rests.push(scene.positions());
                if solver == Solver::Newton {
                    let report = scene.world.rest_state(scene.id, &RestStateDefinition::default());
                    report.expect("a state of rest");
                    rests.push(scene.positions());
                }
            }
        }
        let lowest = rests[0].iter().zip(&tissue.mesh.positions);
        let sag = lowest.map(|(at, rest)| f64::from(rest.y) - at.y).fold(0.0, f64::max);
        assert!(sag > 5e-5, "{terms:?}: it hangs {sag} m");
        for (number, rest) in rests.iter().enumerate() {
            let error = largest_difference(&rests[0], rest);
            assert!(error < 0.003 * sag, "{terms:?}, rest {number}: {error} m of {sag}");
        }
    }
}

#[test]
fn any_number_of_threads_is_bitwise_identical() {
    let tissue = Tissue::new([20, 8, 8]);
    for solver in [Solver::Verlet, Solver::Implicit] {
        let hashes = [1, 3].map(|thread_count| {
            let definition = BodyDefinition {
                solver,
                ..tissue.definition(ALL)
            };
            let mut scene = Scene::new(WorldDefinition { thread_count, ..FREE }, &definition);
            scene
                .body_mut()
                .set_positions(&deformed(&tissue.mesh, 5))
                .expect("positions");
            for _ in 0..3 {
                scene.world.step(1e-3).expect("a step");
            }
            scene.world.state_hash()
        });
        assert_eq!(hashes[0], hashes[1], "{solver:?}");
    }
}

#[test]
fn anchor_springs_move_with_the_body() {
    // Far from the origin, where the body has a local origin that moves later.
    let far = Vec3::new(1000.0, -500.0, 250.0);
    let positions = [far, far + Vec3::X];
    let definition = BodyDefinition {
        positions: &positions,
        masses: Values::Uniform(0.5),
        home_stiffnesses: Values::Each(&[8.0, 0.0]),
        ..BodyDefinition::default()
    };
    let mut scene = Scene::new(FREE, &definition);
    scene
        .body_mut()
        .set_positions(&[far + Vec3::new(0.0, 25.0, 0.0), far])
        .expect("positions");
    let quarter = 0.5 * std::f32::consts::PI * (0.5_f32 / 8.0).sqrt();
    for _ in 0..2000 {
        scene.world.step(quarter / 2000.0).expect("a step");
    }
    let at = scene.positions();
    assert!(at[0].distance(far.as_dvec3()) < 1e-3, "{}", at[0]);
    assert_eq!(at[1], far.as_dvec3());
    let speed = f64::from(scene.body().velocities()[0].y);
    assert!((speed + 100.0).abs() < 0.01, "{speed}");
}

#[test]
fn terms_of_a_removed_spring_are_removed() {
    let tissue = Tissue::new([4, 3, 3]);
    for solver in SOLVERS {
        let definition = BodyDefinition {
            solver,
            ..tissue.definition(ALL)
        };
        let mut scene = Scene::new(FREE, &definition);
        let positions = deformed(&tissue.mesh, 4);
        for node in 0..positions.len() as u32 {
            scene.body_mut().pin(node).expect("a node");
        }
        let [a, b] = [tissue.surface[7][0], tissue.surface[7][1]];
        scene.body_mut().remove_spring(a, b).expect("a spring");
        scene.body_mut().set_positions(&positions).expect("positions");
        scene.world.step(1e-5).expect("a step");
        // Springs and terms that contain the edge are left out.
        let has = |nodes: &[u32]| nodes.contains(&a) && nodes.contains(&b);
        let (mut tetrahedra, mut directions) = (Vec::new(), Vec::new());
        for (corners, direction) in tissue.mesh.tetrahedra.iter().zip(&tissue.directions) {
            if !has(corners) {
                tetrahedra.push(*corners);
                directions.push(*direction);
            }
        }
        let mut left = Tissue {
            mesh: Mesh {
                tetrahedra,
                ..tissue.mesh.clone()
            },
            directions,
            springs: tissue.springs.clone(),
            surface: tissue.surface.clone(),
        };
        left.springs.retain(|pair| !has(pair));
        left.surface.retain(|corners| !has(corners));
        let mut at: Vec<DVec3> = positions.iter().map(|position| position.as_dvec3()).collect();
        for node in [a, b, 0, 20] {
            let expected = left.force(ALL, &mut at, node as usize);
            let force = -scene.body().pin_force(node).expect("a pin").as_dvec3();
            assert!(
                force.distance(expected) < 1e-5 * expected.length().max(0.01),
                "{solver:?}, node {node}: {force} {expected}"
            );
        }
        assert!(matches!(
            scene.body_mut().remove_spring(a, b),
            Err(Error::InvalidArgument(_))
        ));
    }
}

#[test]
fn every_outcome_is_finite() {
    let tissue = Tissue::new([4, 3, 3]);
    for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
        let definition = BodyDefinition {
            solver,
            node_dampings: Values::Uniform(1e-3),
            ..tissue.definition(ALL)
        };
        let count = tissue.mesh.positions.len();
        let flat: Vec<Vec3> = tissue.mesh.positions.iter().map(|p| Vec3::new(p.x, 0.0, 0.0)).collect();
        let turned: Vec<Vec3> = tissue.mesh.positions.iter().map(|p| -3.0 * *p).collect();
        for positions in [vec![Vec3::ZERO; count], flat, turned] {
            let mut scene = Scene::new(
                WorldDefinition {
                    max_substeps: 100_000,
                    ..FREE
                },
                &definition,
            );
            scene.body_mut().set_positions(&positions).expect("positions");
            let before = scene.energy();
            for _ in 0..20 {
                let report = scene.world.step(1e-3).expect("a step");
                assert_eq!(report.bodies_restored, 0, "{solver:?}");
            }
            assert!(
                scene.positions().iter().all(|position| position.is_finite()),
                "{solver:?}"
            );
            assert!(
                scene.energy() <= 1.05 * before,
                "{solver:?}: {before} J, {} J",
                scene.energy()
            );
        }
    }
}

#[test]
fn invalid_terms_are_refused_by_name() {
    let tissue = Tissue::new([2, 2, 2]);
    let whole = tissue.definition(ALL);
    let count = tissue.mesh.positions.len();
    let mut wrong = vec![1.0; count];
    wrong[3] = -2.0;
    let mut long = tissue.directions.clone();
    long[4] = Vec3::new(0.0, 2.0, 0.0);
    let fan = [[0, 1, 2], [0, 1, 3], [1, 0, 4]];
    let twice = [[0, 1, 2], [1, 0, 2]];
    let exponential = |steepness, limit| SpringLaw::Exponential { steepness, limit };
    let cubic = |quadratic, cubic, limit| SpringLaw::Cubic {
        quadratic,
        cubic,
        limit,
    };
    let law = |law| BodyDefinition {
        spring_law: law,
        ..whole
    };
    let cases = [
        (
            BodyDefinition {
                home_stiffnesses: Values::Uniform(f32::NAN),
                ..whole
            },
            ["home_stiffness", "NaN"],
        ),
        (
            BodyDefinition {
                home_stiffnesses: Values::Each(&wrong),
                ..whole
            },
            ["home_stiffnesses[3]", "-2"],
        ),
        (
            BodyDefinition {
                home_stiffnesses: Values::Each(&wrong[..5]),
                ..whole
            },
            ["home_stiffnesses has 5", "27"],
        ),
        (
            BodyDefinition {
                bending_stiffness: -1.5,
                ..whole
            },
            ["bending_stiffness", "-1.5"],
        ),
        (
            BodyDefinition {
                triangles: &[],
                ..whole
            },
            ["bending_stiffness", "no triangles"],
        ),
        (
            BodyDefinition {
                triangles: &fan,
                ..whole
            },
            ["3 triangles share the edge of nodes [0, 1]", "bending_stiffness"],
        ),
        (
            BodyDefinition {
                triangles: &twice,
                ..whole
            },
            ["triangles[0] and triangles[1]", "bending_stiffness"],
        ),
        (law(exponential(0.0, 0.1)), ["steepness", "is 0"]),
        (law(exponential(5.0, f32::INFINITY)), ["limit", "inf"]),
        (law(exponential(100.0, 0.5)), ["steepness of spring_law is 100", "0.5"]),
        (law(cubic(2.0, 1.0, 0.5)), ["quadratic of spring_law is 2", "cubic 1"]),
        (law(cubic(0.0, 1.0, -0.5)), ["limit", "-0.5"]),
        (
            BodyDefinition {
                springs: Some(&[]),
                ..whole
            },
            ["spring_law", "no springs"],
        ),
        (
            BodyDefinition {
                tetrahedra: &[],
                ..whole
            },
            ["fibre_directions", "no tetrahedra"],
        ),
        (
            BodyDefinition {
                fibre_directions: &long,
                ..whole
            },
            ["fibre_directions[4]", "2 long"],
        ),
        (
            BodyDefinition {
                fibre_directions: &long[..3],
                ..whole
            },
            ["fibre_directions has 3", "40"],
        ),
        (
            BodyDefinition {
                fibre_directions: &[],
                ..whole
            },
            ["fibre_stiffness", "fibre_directions"],
        ),
        (
            BodyDefinition {
                fibre_stiffnesses: Values::Uniform(-3.0),
                ..whole
            },
            ["fibre_stiffness", "-3"],
        ),
    ];
    let mut world = World::new(FREE).expect("a world");
    for (definition, parts) in cases {
        match world.create_body(&definition) {
            Err(Error::InvalidArgument(message)) => {
                assert!(parts.iter().all(|part| message.contains(part)), "{message}: {parts:?}");
            }
            other => panic!("{parts:?}: {other:?}"),
        }
    }
}
