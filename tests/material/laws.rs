//! The hyperelastic laws of elements: curves against theory, forces against differences of the energy, energy
//! conservation, small strains against the default law, every solver, and refusals.

use crate::support::bodies::{FREE, Random};
use crate::support::scene::{SOLVERS, Scene};
use glam::{DMat3, DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, ElementLaw, Kernel, Material, Model, Solver, Values, Viscosity, World, WorldDefinition, Yielding,
};

const YOUNG: f32 = 5000.0;
const SIDE: f32 = 0.04;

pub const LAWS: [ElementLaw; 4] = [
    ElementLaw::NeoHookean,
    ElementLaw::MooneyRivlin { ratio: 0.0 },
    ElementLaw::MooneyRivlin { ratio: 0.3 },
    ElementLaw::MooneyRivlin { ratio: 1.0 },
];

pub fn tissue(nu: f32) -> Material {
    Material {
        model: Model::Tetrahedra,
        young_modulus: YOUNG,
        poisson_ratio: nu,
        density: 1060.0,
        ..Material::default()
    }
}

pub fn block() -> Mesh {
    Mesh::block([SIDE; 3], [3; 3]).expect("a block")
}

pub fn scene(mesh: &Mesh, world: WorldDefinition, law: ElementLaw, nu: f32, solver: Solver) -> Scene {
    let definition = BodyDefinition {
        material: Some(tissue(nu)),
        element_law: law,
        mass_scaling: 0.0,
        solver,
        ..BodyDefinition::of(mesh)
    };
    Scene::new(world, &definition)
}

/// Returns the energy density as the documentation states it.
fn density(law: ElementLaw, nu: f64, gradient: DMat3) -> f64 {
    let e = f64::from(YOUNG);
    let (lambda, mu) = (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)));
    let j = gradient.determinant();
    let [x, y, z] = [gradient.x_axis, gradient.y_axis, gradient.z_axis];
    let i1 = x.length_squared() + y.length_squared() + z.length_squared();
    let i2 = x.cross(y).length_squared() + y.cross(z).length_squared() + z.cross(x).length_squared();
    let own = match law {
        ElementLaw::NeoHookean => {
            2.0 / 3.0 * mu * (i1 - 3.0 - ((i1 + 1.0) / 4.0).ln()) - mu * (j - 1.0) + 5.0 / 12.0 * mu * (j - 1.0).powi(2)
        }
        ElementLaw::MooneyRivlin { ratio } => {
            let c2 = 0.5 * mu * f64::from(ratio);
            let c1 = 0.5 * mu - c2;
            c1 * (i1 - 3.0) + c2 * (i2 - 3.0) - (2.0 * c1 + 4.0 * c2) * (j - 1.0) + c1 * (j - 1.0).powi(2)
        }
        ElementLaw::StVenantKirchhoff => panic!("has no such form"),
    };
    own + 0.5 * lambda * (j - 1.0).powi(2)
}

/// Returns the derivative of the energy by an entry of the deformation gradient (Pa).
pub fn stress(law: ElementLaw, nu: f64, gradient: DMat3, column: usize, row: usize) -> f64 {
    const STEP: f64 = 1e-5;
    let at = |by: f64| {
        let mut moved = gradient;
        moved.col_mut(column)[row] += by;
        density(law, nu, moved)
    };
    (at(STEP) - at(-STEP)) / (2.0 * STEP)
}

/// Returns the stretch of the free axes at zero transverse stress.
pub fn free_stretch(stress: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.2, 3.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if stress(middle) < 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

/// Returns the pin forces on one side along an axis, divided by the side's area at rest (Pa).
pub fn pull(mesh: &Mesh, scene: &Scene, side: usize, axis: usize) -> f64 {
    let nodes = (0..mesh.positions.len()).filter(|&node| mesh.positions[node][side] > 0.499 * SIDE);
    let force = |node: usize| f64::from(scene.body().pin_force(node as u32).expect("a pin")[axis]);
    nodes.map(force).sum::<f64>() / f64::from(SIDE * SIDE)
}

/// Holds the low sides of all axes, stretches some of the high sides, and finds equilibrium.
pub fn stretched(mesh: &Mesh, law: ElementLaw, nu: f32, stretches: [Option<f32>; 3]) -> Scene {
    let mut scene = scene(mesh, FREE, law, nu, Solver::Newton);
    let mut positions = mesh.positions.clone();
    for (axis, stretch) in stretches.into_iter().enumerate() {
        for position in &mut positions {
            position[axis] *= stretch.unwrap_or(1.0);
        }
    }
    let body = scene.body_mut();
    body.set_positions(&positions).expect("positions");
    for (node, rest) in mesh.positions.iter().enumerate() {
        let held =
            [0, 1, 2].map(|axis| rest[axis] < -0.499 * SIDE || rest[axis] > 0.499 * SIDE && stretches[axis].is_some());
        if held.contains(&true) {
            body.pin_axes(node as u32, held).expect("a node");
        }
    }
    scene.rest();
    scene.step(1e-3);
    scene
}

#[test]
fn uniaxial_and_biaxial_curves_agree_with_theory() {
    let mesh = block();
    for law in LAWS {
        for nu in [0.3, 0.49] {
            let exact = f64::from(nu);
            for stretch in [0.7_f32, 1.3, 1.8] {
                let x = f64::from(stretch);
                for is_biaxial in [false, true] {
                    let shape =
                        |free: f64| DMat3::from_diagonal(DVec3::new(x, if is_biaxial { x } else { free }, free));
                    let free = free_stretch(|free| stress(law, exact, shape(free), 2, 2));
                    let expected = stress(law, exact, shape(free), 0, 0);
                    let second = is_biaxial.then_some(stretch);
                    let scene = stretched(&mesh, law, nu, [Some(stretch), second, None]);
                    let pulled = pull(&mesh, &scene, 0, 0);
                    assert!(
                        (pulled / expected - 1.0).abs() < 1e-4,
                        "{law:?}, nu {nu}, {stretch}, {is_biaxial}: {pulled} {expected}"
                    );
                    for (rest, then) in mesh.positions.iter().zip(scene.positions()) {
                        let at = f64::from(rest.z + 0.5 * SIDE) * free - 0.5 * f64::from(SIDE);
                        assert!((then.z - at).abs() < 1e-4 * f64::from(SIDE), "{law:?} {nu} {stretch}");
                    }
                }
            }
        }
    }
}

#[test]
fn simple_shear_agrees_with_theory() {
    let mesh = block();
    for law in LAWS {
        for (nu, solver) in SOLVERS.into_iter().flat_map(|solver| [(0.3, solver), (0.49, solver)]) {
            for shear in [0.1_f32, 0.5, 1.0] {
                let mut scene = scene(&mesh, FREE, law, nu, solver);
                let positions: Vec<Vec3> = mesh.positions.iter().map(|p| *p + Vec3::X * p.y * shear).collect();
                let body = scene.body_mut();
                (0..positions.len() as u32).for_each(|node| body.pin(node).expect("a node"));
                body.set_positions(&positions).expect("positions");
                scene.step(1e-3);
                let gradient = DMat3::from_cols(DVec3::X, DVec3::new(f64::from(shear), 1.0, 0.0), DVec3::Z);
                // Along the shear, and across it (Poynting effect).
                let size = stress(law, f64::from(nu), gradient, 1, 0);
                for axis in [0, 1] {
                    let expected = stress(law, f64::from(nu), gradient, 1, axis);
                    let found = pull(&mesh, &scene, 1, axis);
                    assert!(
                        (found - expected).abs() < 1e-4 * size,
                        "{law:?}, nu {nu}, {solver:?}, {shear}, {axis}: {found} {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn forces_of_every_kernel_are_gradients_of_the_energy() {
    const STEP: f64 = 1e-7;
    let mesh = block();
    let rest = |corner: u32| mesh.positions[corner as usize].as_dvec3();
    let edges = |corners: &[u32; 4], at: &dyn Fn(u32) -> DVec3| {
        let [a, b, c, d] = corners.map(at);
        DMat3::from_cols(b - a, c - a, d - a)
    };
    let mut random = Random::new(4);
    for law in LAWS {
        for kernel in [Kernel::Best, Kernel::Avx2, Kernel::Portable] {
            let world = WorldDefinition { kernel, ..FREE };
            if World::new(world).is_err() {
                continue;
            }
            let mut scene = scene(&mesh, world, law, 0.3, Solver::Verlet);
            // Some are inverted.
            let positions: Vec<Vec3> = mesh
                .positions
                .iter()
                .map(|p| *p * 1.1 + random.vector() * 0.006)
                .collect();
            let body = scene.body_mut();
            (0..positions.len() as u32).for_each(|node| body.pin(node).expect("a node"));
            body.set_positions(&positions).expect("positions");
            scene.step(1e-5);
            let energy = |node: u32, by: DVec3| -> f64 {
                let at =
                    |corner: u32| positions[corner as usize].as_dvec3() + if corner == node { by } else { DVec3::ZERO };
                let near = mesh.tetrahedra.iter().filter(|corners| corners.contains(&node));
                near.map(|corners| {
                    let before = edges(corners, &rest);
                    density(law, 0.3, edges(corners, &at) * before.inverse()) * before.determinant().abs() / 6.0
                })
                .sum()
            };
            let axis_steps = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * STEP);
            let expected: Vec<DVec3> = (0..positions.len() as u32)
                .map(|node| {
                    DVec3::from_array(axis_steps.map(|by| (energy(node, by) - energy(node, -by)) / (2.0 * STEP)))
                })
                .collect();
            let size = expected.iter().map(|force| force.length()).fold(0.0, f64::max);
            for (node, expected) in expected.iter().enumerate() {
                let force = scene.body().pin_force(node as u32).expect("a pin").as_dvec3();
                assert!(
                    force.distance(*expected) < 1e-5 * size,
                    "{law:?}, {kernel:?}: {force} {expected}"
                );
            }
        }
    }
}

#[test]
fn small_strains_agree_with_the_default_law() {
    let mesh = block();
    for (law, nu) in LAWS.into_iter().flat_map(|law| [(law, 0.0), (law, 0.3), (law, 0.45)]) {
        let sag = |law: ElementLaw| {
            let gravity = Vec3::new(0.0, -0.03, 0.01);
            let mut scene = scene(&mesh, WorldDefinition { gravity, ..FREE }, law, nu, Solver::Newton);
            let body = scene.body_mut();
            for (node, rest) in mesh.positions.iter().enumerate() {
                if rest.x < -0.499 * SIDE {
                    body.pin(node as u32).expect("a node");
                }
            }
            scene.rest();
            let moved = mesh.positions.iter().zip(scene.positions());
            let last = moved.max_by(|a, b| a.0.x.total_cmp(&b.0.x)).expect("nodes");
            last.1 - last.0.as_dvec3()
        };
        let (found, expected) = (sag(law), sag(ElementLaw::StVenantKirchhoff));
        let error = found.distance(expected) / expected.length();
        assert!(error < 2e-3, "{law:?}, nu {nu}: {found} {expected}");
    }
}

#[test]
fn a_swinging_body_keeps_its_energy_and_momentum() {
    let mesh = block();
    for (law, nu) in LAWS.into_iter().flat_map(|law| [(law, 0.3), (law, 0.45)]) {
        let mut scene = scene(&mesh, FREE, law, nu, Solver::Verlet);
        let stretched: Vec<Vec3> = mesh.positions.iter().map(|p| *p * Vec3::new(1.3, 0.9, 0.9)).collect();
        let turned: Vec<Vec3> = mesh.positions.iter().map(|p| p.cross(Vec3::Y) * 5.0).collect();
        scene.body_mut().set_positions(&stretched).expect("positions");
        scene.body_mut().set_velocities(&turned).expect("velocities");
        let before = scene.energy();
        let momentum = |scene: &Scene| -> DVec3 {
            let mass = |node: usize| f64::from(scene.body().node_mass(node as u32).expect("a node"));
            let velocities = scene.body().velocities();
            let parts = (0..).zip(velocities).map(|(node, v)| v.as_dvec3() * mass(node));
            parts.sum()
        };
        let moves = momentum(&scene);
        let mut worst = 0.0_f64;
        for _ in 0..2000 {
            scene.step(1e-3);
            worst = worst.max((scene.energy() / before - 1.0).abs());
        }
        assert!(worst < 0.02, "{law:?}, nu {nu}: energy changed by {worst}");
        // Compared with 0.07 kg at 0.1 m/s.
        let gained = momentum(&scene).distance(moves);
        assert!(gained < 1e-6, "{law:?}, nu {nu}: {gained} kg m/s");
    }
}

#[test]
fn every_solver_comes_to_the_same_rest() {
    every_solver_comes_to_the_same_rest_of([LAWS[0], LAWS[2]]);
}

#[test]
#[ignore = "long"]
fn every_solver_comes_to_the_same_rest_with_other_laws() {
    every_solver_comes_to_the_same_rest_of([LAWS[1], LAWS[3]]);
}

fn every_solver_comes_to_the_same_rest_of(laws: [ElementLaw; 2]) {
    let mesh = Mesh::block([0.08, 0.02, 0.02], [8, 2, 2]).expect("a block");
    let gravity = Vec3::NEG_Y * 9.81;
    for (law, nu) in laws.into_iter().flat_map(|law| [(law, 0.3), (law, 0.47)]) {
        let mut expected = None;
        for solver in SOLVERS.into_iter().rev() {
            let definition = BodyDefinition {
                material: Some(tissue(nu)),
                element_law: law,
                node_dampings: Values::Uniform(0.002),
                solver,
                ..BodyDefinition::of(&mesh)
            };
            let mut scene = Scene::new(WorldDefinition { gravity, ..FREE }, &definition);
            for (node, rest) in mesh.positions.iter().enumerate() {
                if rest.x < -0.039 {
                    scene.body_mut().pin(node as u32).expect("a node");
                }
            }
            if solver == Solver::Newton {
                scene.rest();
            } else {
                scene.run(1.0 / 60.0, 600);
            }
            let positions = scene.positions();
            let expected = expected.get_or_insert(positions.clone());
            let error = positions
                .iter()
                .zip(&*expected)
                .map(|(a, b)| a.distance(*b))
                .fold(0.0, f64::max);
            assert!(error < 1e-6, "{law:?}, nu {nu}, {solver:?}: {error} m off");
        }
    }
}

#[test]
fn invalid_parameters_are_refused() {
    let mesh = block();
    let plain = BodyDefinition {
        material: Some(tissue(0.3)),
        element_law: ElementLaw::NeoHookean,
        ..BodyDefinition::of(&mesh)
    };
    let says = |definition: BodyDefinition, words: &[&str]| {
        let mut world = World::new(FREE).expect("a world");
        let error = world.create_body(&definition).expect_err("refused").to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    };
    let viscosity = Viscosity {
        retardation_time: 0.25,
        relaxation_time: 0.0,
    };
    says(
        BodyDefinition { viscosity, ..plain },
        &["retardation_time is 0.25", "SINEW_ELEMENT_LAW_NEO_HOOKEAN"],
    );
    let yielding = Yielding {
        strain: 0.125,
        ..Yielding::default()
    };
    says(BodyDefinition { yielding, ..plain }, &["yield_strain is 0.125"]);
    let springs = Some(Material {
        model: Model::Springs,
        poisson_ratio: 0.0,
        ..tissue(0.0)
    });
    says(
        BodyDefinition {
            material: springs,
            ..plain
        },
        &["element_law is SINEW_ELEMENT_LAW_NEO_HOOKEAN"],
    );
    for ratio in [-0.1, 1.5, f32::NAN] {
        let element_law = ElementLaw::MooneyRivlin { ratio };
        says(
            BodyDefinition { element_law, ..plain },
            &["mooney_ratio is", &ratio.to_string()],
        );
    }
}
