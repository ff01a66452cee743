//! Tetrahedra as finite elements: forces against the formula, the requested moduli, arbitrary deformations, and
//! agreement of every solver, storage, SIMD level and number of threads.

use crate::support::bodies::{FREE, Random};
use crate::support::scene::{SOLVERS, STORAGES};
use glam::{DMat3, DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, BodyId, Kernel, Material, Model, Pose, RestStateDefinition, Shape, Solver, Storage, ToolDefinition,
    Values, World, WorldDefinition,
};

const YOUNG: f32 = 5000.0;
const DENSITY: f32 = 1060.0;

fn tissue(nu: f32) -> Material {
    Material {
        model: Model::Tetrahedra,
        young_modulus: YOUNG,
        poisson_ratio: nu,
        density: DENSITY,
        ..Material::default()
    }
}

/// A block with irregular inner nodes.
fn block(size: [f32; 3], cells: [u32; 3], seed: u64) -> Mesh {
    let mut mesh = Mesh::block(size, cells).expect("a block");
    let mut random = Random::new(seed);
    let spacing = size[0] / cells[0] as f32;
    for position in &mut mesh.positions {
        let inner = (0..3).all(|axis| position[axis].abs() < 0.499 * size[axis]);
        let shift = random.vector() * 0.15 * spacing;
        if inner {
            *position += shift;
        }
    }
    mesh
}

struct Scene {
    world: World,
    body: BodyId,
}

fn scene(mesh: &Mesh, world: WorldDefinition, definition: &BodyDefinition) -> Scene {
    let mut world = World::new(world).expect("a world");
    let body = world
        .create_body(&BodyDefinition {
            positions: &mesh.positions,
            tetrahedra: &mesh.tetrahedra,
            ..*definition
        })
        .expect("a body");
    Scene { world, body }
}

impl Scene {
    fn positions(&self) -> Vec<DVec3> {
        let body = self.world.body(self.body).expect("the body");
        body.positions().iter().map(|position| position.as_dvec3()).collect()
    }

    fn energy(&self, gravity: Vec3) -> f64 {
        let energy = self.world.body(self.body).expect("the body").energy(gravity);
        energy.kinetic + energy.elastic + energy.gravitational
    }

    fn pin(&mut self, is_pinned: impl Fn(DVec3) -> bool) {
        let pinned: Vec<usize> = (0..)
            .zip(self.positions())
            .filter(|(_, p)| is_pinned(*p))
            .map(|(n, _)| n)
            .collect();
        let body = self.world.body_mut(self.body).expect("the body");
        for node in pinned {
            body.pin(node as u32).expect("a node");
        }
    }
}

/// Returns lambda, mu and kappa as the documentation states them.
fn moduli(nu: f64) -> [f64; 3] {
    let e = f64::from(YOUNG);
    let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    let mu = e / (2.0 * (1.0 + nu));
    let kappa = f64::max(lambda, 0.25 * (lambda + 2.0 * mu));
    [lambda - kappa, mu, kappa]
}

fn volume(corners: &[u32; 4], at: impl Fn(usize) -> DVec3) -> f64 {
    let [a, b, c, d] = corners.map(|corner| at(corner as usize));
    (b - a).cross(c - a).dot(d - a) / 6.0
}

/// Returns the nodal pressures, by which the tetrahedra around a node resist a change of their volume.
fn pressures(mesh: &Mesh, positions: &[DVec3], kappa: f64) -> Vec<f64> {
    let mut volumes = vec![[0.0; 2]; positions.len()];
    for corners in &mesh.tetrahedra {
        let before = volume(corners, |node| mesh.positions[node].as_dvec3());
        let after = volume(corners, |node| positions[node]) * before.signum();
        for &corner in corners {
            volumes[corner as usize][0] += before.abs();
            volumes[corner as usize][1] += after;
        }
    }
    volumes
        .iter()
        .map(|[before, after]| kappa * (after / before - 1.0))
        .collect()
}

/// Returns the forces of the finite-element formula: minus the first Piola-Kirchhoff stress times the area vectors at
/// rest.
fn forces(mesh: &Mesh, positions: &[DVec3], nu: f64) -> Vec<DVec3> {
    let [lambda, mu, kappa] = moduli(nu);
    let mut forces = vec![DVec3::ZERO; positions.len()];
    let pressures = (nu >= 0.4).then(|| pressures(mesh, positions, kappa));
    for corners in &mesh.tetrahedra {
        let edges = |at: &dyn Fn(usize) -> DVec3| {
            let [a, b, c, d] = corners.map(|corner| at(corner as usize));
            DMat3::from_cols(b - a, c - a, d - a)
        };
        let rest = edges(&|node| mesh.positions[node].as_dvec3());
        let gradient = edges(&|node| positions[node]) * rest.inverse();
        let strain = (gradient.transpose() * gradient - DMat3::IDENTITY) * 0.5;
        let trace = strain.x_axis.x + strain.y_axis.y + strain.z_axis.z;
        let second = strain * (2.0 * mu) + DMat3::IDENTITY * (lambda * trace);
        let j = gradient.determinant();
        let pressure = match &pressures {
            Some(pressures) => corners.iter().map(|&corner| 0.25 * pressures[corner as usize]).sum(),
            None => kappa * (j - 1.0),
        };
        let stress = gradient * second + gradient.inverse().transpose() * (pressure * j);
        let volume = rest.determinant().abs() / 6.0;
        let corner_forces = stress * rest.inverse().transpose() * -volume;
        let columns = [corner_forces.x_axis, corner_forces.y_axis, corner_forces.z_axis];
        for (corner, force) in corners[1..].iter().zip(columns) {
            forces[*corner as usize] += force;
            forces[corners[0] as usize] -= force;
        }
    }
    forces
}

#[test]
fn forces_agree_with_the_finite_element_formula() {
    let mesh = block([0.06, 0.04, 0.05], [6, 4, 5], 3);
    for nu in [0.0, 0.25, 0.35, 0.45, 0.49] {
        for storage in STORAGES {
            for kernel in [Kernel::Best, Kernel::Avx2, Kernel::Portable] {
                if storage != Storage::Packed && kernel != Kernel::Best {
                    continue;
                }
                let mut world = FREE;
                world.kernel = kernel;
                if World::new(world).is_err() {
                    continue;
                }
                let mut scene = scene(
                    &mesh,
                    world,
                    &BodyDefinition {
                        material: Some(tissue(nu)),
                        storage,
                        ..BodyDefinition::default()
                    },
                );
                scene.pin(|_| true);
                let mut random = Random::new(8);
                let turned = glam::Quat::from_rotation_y(1.0) * glam::Quat::from_rotation_x(0.5);
                let positions: Vec<Vec3> = mesh
                    .positions
                    .iter()
                    .map(|position| turned * (*position * Vec3::new(1.2, 0.9, 1.0)) + random.vector() * 1e-3)
                    .collect();
                let body = scene.world.body_mut(scene.body).expect("the body");
                body.set_positions(&positions).expect("positions");
                scene.world.step(1e-5).expect("a step");
                let body = scene.world.body(scene.body).expect("the body");
                let exact: Vec<DVec3> = positions.iter().map(|place| place.as_dvec3()).collect();
                let expected = forces(&mesh, &exact, f64::from(nu));
                let size = expected.iter().map(|force| force.length()).fold(0.0, f64::max);
                for (node, expected) in expected.iter().enumerate() {
                    let force = -body.pin_force(node as u32).expect("a pin").as_dvec3();
                    let error = force.distance(*expected) / size;
                    assert!(
                        error < 1e-5,
                        "nu {nu}, {storage:?}, {kernel:?}, node {node}: {force} {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_pulled_block_has_the_expected_length_and_width() {
    // A long bar, held and pulled at its ends so that these can get thinner.
    const SIZE: [f32; 3] = [0.08, 0.02, 0.02];
    const STRAIN: f64 = 0.002;
    for (nu, stretch_error, width_error) in [
        (0.0, 0.01, 0.02),
        (0.25, 0.01, 0.02),
        (0.35, 0.01, 0.02),
        (0.45, 0.01, 0.02),
        (0.49, 0.01, 0.02),
    ] {
        let mesh = block(SIZE, [16, 4, 4], 4);
        let mut scene = scene(
            &mesh,
            FREE,
            &BodyDefinition {
                material: Some(tissue(nu)),
                solver: Solver::Newton,
                ..BodyDefinition::default()
            },
        );
        let force = f64::from(YOUNG) * STRAIN * f64::from(SIZE[1] * SIZE[2]);
        let body = scene.world.body_mut(scene.body).expect("the body");
        // Each end node carries the share of the faces around it.
        for side in [-1.0, 1.0] {
            let cell = SIZE[1] / 4.0;
            for (node, position) in mesh.positions.iter().enumerate() {
                if (position.x - side * 0.5 * SIZE[0]).abs() > 1e-6 {
                    continue;
                }
                let share = |at: f32| {
                    if at.abs() > 0.5 * SIZE[1] - 0.5 * cell {
                        0.5
                    } else {
                        1.0
                    }
                };
                let part = share(position.y) * share(position.z) / 16.0;
                let pull = Vec3::X * (side as f64 * force * part) as f32;
                body.apply_force(node as u32, pull).expect("a force");
            }
        }
        let definition = RestStateDefinition::default();
        scene.world.rest_state(scene.body, &definition).expect("rest");
        let then = scene.positions();
        let (mut longer, mut wider, mut lengths, mut widths) = (0.0, 0.0, 0.0, 0.0);
        let centre = then.iter().sum::<DVec3>() / then.len() as f64;
        for (before, after) in mesh.positions.iter().zip(&then) {
            // Away from the ends.
            if before.x.abs() > 0.25 * SIZE[0] {
                continue;
            }
            let (before, after) = (before.as_dvec3(), *after - centre);
            longer += (after.x - before.x) * before.x;
            lengths += before.x * before.x;
            wider += (after.y - before.y) * before.y + (after.z - before.z) * before.z;
            widths += before.y * before.y + before.z * before.z;
        }
        let (strain, across) = (longer / lengths, wider / widths);
        // At finite strain the law is stiffer by 1.5 times the strain.
        let expected = STRAIN * (1.0 - 1.5 * STRAIN);
        assert!(
            (strain / expected - 1.0).abs() < stretch_error,
            "nu {nu}: stretched by {strain}"
        );
        assert!(
            (across + f64::from(nu) * strain).abs() < width_error * strain,
            "nu {nu}: {across} across {strain}"
        );
    }
}

#[test]
fn every_solver_and_storage_comes_to_the_same_rest() {
    every_solver_and_storage_comes_to_the_same_rest_of(&[0.47]);
}

#[test]
#[ignore = "long"]
fn every_solver_and_storage_comes_to_the_same_rest_with_other_ratios() {
    every_solver_and_storage_comes_to_the_same_rest_of(&[0.3, 0.0]);
}

fn every_solver_and_storage_comes_to_the_same_rest_of(ratios: &[f32]) {
    let mesh = block([0.08, 0.02, 0.02], [8, 2, 2], 5);
    let world = || WorldDefinition {
        gravity: Vec3::NEG_Y * 9.81,
        ..FREE
    };
    for &nu in ratios {
        let mut expected = None;
        for solver in SOLVERS.into_iter().rev() {
            for storage in STORAGES {
                if solver == Solver::Newton && storage != Storage::Packed {
                    continue;
                }
                let mut scene = scene(
                    &mesh,
                    world(),
                    &BodyDefinition {
                        material: Some(tissue(nu)),
                        node_dampings: Values::Uniform(0.002),
                        solver,
                        storage,
                        ..BodyDefinition::default()
                    },
                );
                scene.pin(|position| position.x < -0.039);
                if solver == Solver::Newton {
                    let definition = RestStateDefinition::default();
                    scene.world.rest_state(scene.body, &definition).expect("rest");
                } else {
                    for _ in 0..600 {
                        scene.world.step(1.0 / 60.0).expect("a step");
                    }
                }
                let positions = scene.positions();
                let sag = positions
                    .iter()
                    .zip(&mesh.positions)
                    .map(|(a, b)| f64::from(b.y) - a.y)
                    .fold(0.0, f64::max);
                let expected = expected.get_or_insert(positions.clone());
                let error = positions
                    .iter()
                    .zip(&*expected)
                    .map(|(a, b)| a.distance(*b))
                    .fold(0.0, f64::max);
                assert!(sag > 0.005, "{sag}");
                assert!(
                    error < 2e-5 * sag,
                    "{solver:?}, {storage:?}, nu {nu}: {error} m off of {sag}"
                );
            }
        }
    }
}

#[test]
fn a_free_body_keeps_its_energy_and_momentum() {
    let mesh = block([0.06, 0.04, 0.04], [6, 4, 4], 6);
    let mut scene = scene(
        &mesh,
        FREE,
        &BodyDefinition {
            material: Some(tissue(0.3)),
            ..BodyDefinition::default()
        },
    );
    let mut random = Random::new(9);
    let body = scene.world.body_mut(scene.body).expect("the body");
    let velocities: Vec<Vec3> = mesh
        .positions
        .iter()
        .map(|p| p.cross(Vec3::Y) * 20.0 + random.vector() * 0.2)
        .collect();
    body.set_velocities(&velocities).expect("velocities");
    let before = scene.energy(Vec3::ZERO);
    let mut worst = 0.0_f64;
    for _ in 0..1000 {
        let report = scene.world.step(1e-3).expect("a step");
        assert_eq!(report.bodies_restored, 0);
        worst = worst.max((scene.energy(Vec3::ZERO) / before - 1.0).abs());
    }
    assert!(worst < 0.05, "energy changed by {worst}");
}

#[test]
fn any_number_of_threads_is_bitwise_identical() {
    // More than one part, and several tiles.
    let mesh = block([0.1, 0.1, 0.1], [11, 11, 11], 7);
    for (solver, nu) in [(Solver::Verlet, 0.3), (Solver::Verlet, 0.45), (Solver::Implicit, 0.45)] {
        let hashes = [1, 2, 5].map(|thread_count| {
            let mut scene = scene(
                &mesh,
                WorldDefinition {
                    thread_count,
                    gravity: Vec3::NEG_Y * 9.81,
                    ..FREE
                },
                &BodyDefinition {
                    material: Some(tissue(nu)),
                    solver,
                    ..BodyDefinition::default()
                },
            );
            scene.pin(|position| position.x < -0.049);
            for _ in 0..5 {
                scene.world.step(1e-2).expect("a step");
            }
            scene.world.state_hash()
        });
        assert_eq!(hashes[0], hashes[1], "{solver:?}, nu {nu}");
        assert_eq!(hashes[0], hashes[2], "{solver:?}, nu {nu}");
    }
}

#[test]
fn removing_an_edge_removes_its_tetrahedra() {
    let mesh = block([0.06, 0.04, 0.04], [6, 4, 4], 10);
    let edge = [mesh.tetrahedra[200][1], mesh.tetrahedra[200][3]];
    let has_edge = |corners: &&[u32; 4]| edge.iter().all(|node| corners.contains(node));
    let mut left = mesh.clone();
    left.tetrahedra = mesh
        .tetrahedra
        .iter()
        .filter(|corners| !has_edge(corners))
        .copied()
        .collect();
    assert!(left.tetrahedra.len() < mesh.tetrahedra.len());
    for solver in SOLVERS {
        for nu in [0.3, 0.45] {
            let definition = BodyDefinition {
                material: Some(Material {
                    density: 0.0,
                    ..tissue(nu)
                }),
                masses: Values::Uniform(1e-3),
                solver,
                ..BodyDefinition::default()
            };
            let mut cut = scene(&mesh, FREE, &definition);
            let mut fresh = scene(&left, FREE, &definition);
            let body = cut.world.body_mut(cut.body).expect("the body");
            body.remove_spring(edge[0], edge[1]).expect("an edge");
            assert!(body.remove_spring(edge[0], edge[1]).is_err(), "it is gone");
            let mut random = Random::new(11);
            let velocities: Vec<Vec3> = mesh.positions.iter().map(|_| random.vector()).collect();
            for scene in [&mut cut, &mut fresh] {
                let body = scene.world.body_mut(scene.body).expect("the body");
                body.set_velocities(&velocities).expect("velocities");
                for _ in 0..10 {
                    scene.world.step(1e-3).expect("a step");
                }
            }
            // Sums are added up in another order.
            let error = cut
                .positions()
                .iter()
                .zip(fresh.positions())
                .map(|(a, b)| a.distance(b))
                .fold(0.0, f64::max);
            assert!(error < 1e-6, "{solver:?}, nu {nu}: {error} m");
        }
    }
}

#[test]
fn a_plate_gets_the_same_force_with_every_solver() {
    a_plate_gets_the_same_force_with_every_solver_of((Solver::Implicit, 1e-2));
}

#[test]
#[ignore = "long"]
fn a_plate_gets_the_same_force_with_every_solver_with_newton() {
    a_plate_gets_the_same_force_with_every_solver_of((Solver::Newton, 1.0 / 60.0));
}

fn a_plate_gets_the_same_force_with_every_solver_of(other: (Solver, f32)) {
    const THICKNESS: f32 = 0.04;
    let mesh = block([THICKNESS; 3], [4; 3], 13);
    for nu in [0.3, 0.45] {
        let forces = [(Solver::Verlet, 1e-3), other].map(|(solver, dt)| {
            let mut scene = scene(
                &mesh,
                FREE,
                &BodyDefinition {
                    material: Some(tissue(nu)),
                    node_dampings: Values::Uniform(0.02),
                    solver,
                    ..BodyDefinition::default()
                },
            );
            scene.pin(|position| position.y < -0.49 * f64::from(THICKNESS));
            let plate = ToolDefinition {
                pose: Pose {
                    position: Vec3::Y * 0.5 * THICKNESS,
                    orientation: Quat::from_rotation_x(std::f32::consts::PI),
                },
                ..ToolDefinition::new(Shape::Plane)
            };
            let plate = scene.world.create_tool(&plate).expect("a tool");
            let (press, hold) = (0.2_f32, 0.6);
            let mut time = 0.0_f32;
            while time < press + hold {
                time += dt;
                let down = 0.1 * THICKNESS * (time / press).min(1.0);
                scene
                    .world
                    .set_pose(plate, Vec3::Y * (0.5 * THICKNESS - down), None)
                    .expect("a pose");
                scene.world.step(dt).expect("a step");
            }
            scene.world.wrench(plate).expect("the plate").0.y
        });
        for force in forces {
            assert!((force / forces[0] - 1.0).abs() < 0.01, "nu {nu}: {forces:?}");
        }
        // At least the force of a bar with free sides, since its foot is held.
        let least = YOUNG * 0.1 * THICKNESS * THICKNESS;
        assert!(
            forces[0] > 0.9 * least && forces[0] < 2.5 * least,
            "nu {nu}: {forces:?}, {least} for a free bar"
        );
    }
}

#[test]
fn invalid_tetrahedra_are_refused() {
    let mesh = block([0.06, 0.04, 0.04], [3, 2, 2], 1);
    let definition = BodyDefinition {
        material: Some(tissue(0.3)),
        ..BodyDefinition::of(&mesh)
    };
    let mut flat = mesh.positions.clone();
    let corners = mesh.tetrahedra[5].map(|node| node as usize);
    flat[corners[3]] = (flat[corners[0]] + flat[corners[1]] + flat[corners[2]]) / 3.0;
    for (named, refused) in [
        (
            "poisson_ratio is 0.5",
            BodyDefinition {
                material: Some(tissue(0.5)),
                ..definition
            },
        ),
        (
            "poisson_ratio is -0.1",
            BodyDefinition {
                material: Some(tissue(-0.1)),
                ..definition
            },
        ),
        (
            "tetrahedron_count is 0",
            BodyDefinition {
                tetrahedra: &[],
                triangles: &mesh.triangles,
                ..definition
            },
        ),
        (
            "volume_stiffness is 1 Pa",
            BodyDefinition {
                volume_stiffness: 1.0,
                ..definition
            },
        ),
        (
            "tetrahedra[5]",
            BodyDefinition {
                positions: &flat,
                ..definition
            },
        ),
        (
            "volume_stiffness is -2",
            BodyDefinition {
                material: None,
                masses: Values::Uniform(1.0),
                volume_stiffness: -2.0,
                ..definition
            },
        ),
    ] {
        let mut world = World::new(FREE).expect("a world");
        let error = world.create_body(&refused).expect_err(named).to_string();
        assert!(error.contains(named), "{named}: {error}");
    }
}

/// A stiffness that would have no effect is refused by name; springs given beside elements use theirs.
#[test]
fn spring_settings_apply_to_springs_or_are_refused() {
    let mesh = Mesh::block([0.04; 3], [2; 3]).expect("a block");
    let elements = BodyDefinition {
        material: Some(tissue(0.3)),
        ..BodyDefinition::of(&mesh)
    };
    let refused = |definition: &BodyDefinition, name: &str| {
        let mut world = World::new(FREE).expect("a world");
        let message = world.create_body(definition).expect_err("refused").to_string();
        assert!(message.starts_with(&format!("{name} is 3")), "{message}");
    };
    let nothing: &[[u32; 2]] = &[];
    for springs in [None, Some(nothing)] {
        let body = BodyDefinition { springs, ..elements };
        let stiff = BodyDefinition {
            stiffnesses: Values::Uniform(3.0),
            ..body
        };
        refused(&stiff, "stiffness");
        let damped = BodyDefinition {
            spring_dampings: Values::Uniform(3.0),
            ..body
        };
        refused(&damped, "spring_damping");
        World::new(FREE).expect("a world").create_body(&body).expect("a body");
    }
    // One spring beside the elements, stretched to twice its rest length.
    let spring = [[0, mesh.positions.len() as u32 - 1]];
    let length = mesh.positions[0].distance(*mesh.positions.last().expect("a node"));
    let energy = |definition: &BodyDefinition| {
        let mut world = World::new(FREE).expect("a world");
        let body = world.create_body(definition).expect("a body");
        world.body(body).expect("the body").energy(Vec3::ZERO).elastic
    };
    let both = BodyDefinition {
        springs: Some(&spring),
        stiffnesses: Values::Uniform(300.0),
        rest_lengths: Some(&[2.0 * length]),
        ..elements
    };
    let (alone, both) = (energy(&elements), energy(&both));
    let expected = 0.5 * 300.0 * f64::from(length).powi(2);
    assert!(
        (both - alone - expected).abs() < 1e-5 * expected,
        "{alone} J, {both} J with it"
    );
}
