//! Terms beside springs with analytic solutions: a mass on its anchor spring, springs along their curve, strips and
//! arcs in bending, and blocks pulled along and across their fibers.

use crate::support::bodies::FREE;
use crate::support::scene::Scene;
use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Material, Model, Solver, SpringLaw, Values, WorldDefinition};

fn hung(gravity: Vec3, definition: &BodyDefinition) -> Scene {
    Scene::new(WorldDefinition { gravity, ..FREE }, definition)
}

#[test]
fn a_mass_on_its_anchor_spring_sags_by_weight_over_stiffness() {
    for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
        let positions = [Vec3::new(0.3, 0.2, 0.1), Vec3::new(0.4, 0.2, 0.1)];
        let definition = BodyDefinition {
            positions: &positions,
            masses: Values::Each(&[0.02, 0.05]),
            home_stiffnesses: Values::Each(&[5.0, 20.0]),
            node_dampings: Values::Each(&[0.3, 0.9]),
            solver,
            ..BodyDefinition::default()
        };
        let mut scene = hung(Vec3::NEG_Z * 9.81, &definition);
        for _ in 0..300 {
            scene.world.step(0.01).expect("a step");
        }
        for (node, sag) in [0.02 * 9.81 / 5.0, 0.05 * 9.81 / 20.0].into_iter().enumerate() {
            let direction = f64::from(positions[node].z - scene.body().positions()[node].z);
            assert!(
                (direction / sag - 1.0).abs() < 1e-5,
                "{solver:?}, node {node}: {direction} of {sag}"
            );
        }
    }
}

#[test]
fn springs_pull_along_their_curve() {
    const LENGTH: f64 = 0.02;
    const STIFFNESS: f64 = 30.0;
    let exponential = |e: f64| if e < 0.0 { e } else { ((12.0 * e).exp() - 1.0) / 12.0 };
    let cubic = |e: f64| e - 2.0 * e * e + 5.0 * e * e * e;
    // The stress at the limit, and the slope there.
    let laws = [
        (
            SpringLaw::Exponential {
                steepness: 12.0,
                limit: 0.25,
            },
            exponential as fn(f64) -> f64,
            0.25,
            3.0_f64.exp(),
        ),
        (
            SpringLaw::Cubic {
                quadratic: -2.0,
                cubic: 5.0,
                limit: 0.5,
            },
            cubic,
            0.5,
            1.0 - 2.0 + 15.0 * 0.25,
        ),
    ];
    for (spring_law, law, limit, slope) in laws {
        let positions = [Vec3::ZERO, Vec3::X * LENGTH as f32];
        let definition = BodyDefinition {
            positions: &positions,
            masses: Values::Each(&[0.0, 0.0]),
            springs: Some(&[[0, 1]]),
            stiffnesses: Values::Uniform(STIFFNESS as f32),
            rest_lengths: Some(&[LENGTH as f32]),
            spring_law,
            ..BodyDefinition::default()
        };
        let mut scene = hung(Vec3::ZERO, &definition);
        for strain in [-0.9, -0.5, -0.1, 0.01, 0.05, 0.1, 0.2, 0.249, 0.4, 0.49, 0.6, 1.0, 3.0] {
            let end = Vec3::new(0.6, 0.0, -0.8) * (LENGTH * (1.0 + strain)) as f32;
            scene.body_mut().set_positions(&[Vec3::ZERO, end]).expect("positions");
            scene.world.step(1e-4).expect("a step");
            let strain = end.as_dvec3().length() / f64::from(LENGTH as f32) - 1.0;
            let pull = law(strain.min(limit)) + slope * (strain - limit).max(0.0);
            let expected = DVec3::new(0.6, 0.0, -0.8) * (STIFFNESS * LENGTH * pull);
            let force = scene.body().pin_force(1).expect("a pin").as_dvec3();
            let error = force.distance(expected) / expected.length();
            assert!(error < 1e-5, "{spring_law:?}, strain {strain}: {force} {expected}");
        }
    }
}

/// A grid of quads, each cut in two. The cut direction alternates along the strip, and if `checks`, across it too.
fn strip(cells: [u32; 2], checks: bool, position: impl Fn(u32, u32) -> DVec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let node = |i: u32, j: u32| i * (cells[1] + 1) + j;
    let columns = (0..=cells[0]).flat_map(|i| (0..=cells[1]).map(move |j| (i, j)));
    let positions = columns.map(|(i, j)| position(i, j).as_vec3()).collect();
    let mut triangles = Vec::new();
    for i in 0..cells[0] {
        for j in 0..cells[1] {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            if (i + if checks { j } else { 1 }) % 2 == 0 {
                triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    (positions, triangles)
}

const RIGIDITY: f64 = 1e-5;
const WIDTH: f64 = 0.02;

/// Returns the deflection of the free end of a strip, clamped at its first two columns, under forces on its nodes.
fn deflection(positions: &[Vec3], triangles: &[[u32; 3]], rows: usize, load: impl Fn(usize) -> Vec3) -> DVec3 {
    let mut scene = hung(
        Vec3::ZERO,
        &BodyDefinition {
            positions,
            triangles,
            masses: Values::Uniform(1e-4),
            stiffnesses: Values::Uniform(100.0),
            bending_stiffness: RIGIDITY as f32,
            solver: Solver::Newton,
            ..BodyDefinition::default()
        },
    );
    for node in 0..positions.len() {
        let column = node / rows;
        if column < 2 {
            scene.body_mut().pin(node as u32).expect("a node");
        } else {
            scene
                .body_mut()
                .apply_force(node as u32, load(column))
                .expect("a force");
        }
    }
    scene.rest();
    let rest = scene.positions();
    let end = positions.len() - rows..positions.len();
    let displacements = end.map(|node| rest[node] - positions[node].as_dvec3());
    displacements.sum::<DVec3>() / rows as f64
}

#[test]
fn a_strip_bends_as_a_beam() {
    // A strip with free sides has D (1 - nu²): a lattice of equilateral triangles is a plate with a Poisson's ratio of
    // -1/3 (Seung, Nelson 1988). Where squares are cut alternately every other node moves freely, so that 5/6 of D
    // remain.
    for (is_equilateral, part) in [(true, 8.0 / 9.0), (false, 5.0 / 6.0)] {
        for columns in [24, 48] {
            let spacing = 0.12 / f64::from(columns);
            let side = if is_equilateral {
                spacing / 0.75_f64.sqrt()
            } else {
                spacing
            };
            let across = (WIDTH / side).round() as u32;
            let (rows, width) = (across as usize + 1, side * f64::from(across));
            let (positions, triangles) = strip([columns, across], !is_equilateral, |i, j| {
                let shift = if is_equilateral && i % 2 == 1 { 0.5 } else { 0.0 };
                DVec3::new(spacing * f64::from(i), 0.0, side * (f64::from(j) + shift))
            });
            // The hinges at the second column represent half a cell on either side.
            let length = 0.12 - 0.5 * spacing;
            let force = 1e-6;
            let tip = deflection(&positions, &triangles, rows, |column| {
                let is_end = column == columns as usize;
                Vec3::NEG_Y * if is_end { (force / rows as f64) as f32 } else { 0.0 }
            });
            let expected_by_tip = force * length.powi(3) / (3.0 * part * RIGIDITY * width);
            // N/m
            let weight = 2e-5;
            let sag = deflection(&positions, &triangles, rows, |column| {
                let part = if column == columns as usize { 0.5 } else { 1.0 };
                Vec3::NEG_Y * (part * weight * spacing / rows as f64) as f32
            });
            let expected_by_weight = weight * length.powi(4) / (8.0 * part * RIGIDITY * width);
            for (found, expected) in [(-tip.y, expected_by_tip), (-sag.y, expected_by_weight)] {
                assert!(
                    (found / expected - 1.0).abs() < 0.03,
                    "equilateral {is_equilateral}, {columns} columns: {found} of {expected}"
                );
            }
        }
    }
}

#[test]
fn equilateral_triangles_have_the_requested_rigidity_for_any_rolling_direction() {
    const RADIUS: f64 = 0.1;
    let (columns, across, side) = (40_u32, 40_u32, 1e-3);
    for direction in [0.0, 0.3, 0.7, 1.1, 1.5_f64] {
        let flat = |i: u32, j: u32| {
            let shift = if i % 2 == 1 { 0.5 } else { 0.0 };
            DVec3::new(
                side * 0.75_f64.sqrt() * (f64::from(i) - 20.0),
                0.0,
                side * (f64::from(j) + shift - 20.0),
            )
        };
        let (rest, triangles) = strip([columns, across], false, flat);
        let rolled = |at: &Vec3| {
            let at = at.as_dvec3();
            let (along, beside) = (
                at.x * direction.cos() + at.z * direction.sin(),
                at.z * direction.cos() - at.x * direction.sin(),
            );
            let angle = along / RADIUS;
            DVec3::new(RADIUS * angle.sin(), RADIUS * angle.cos(), beside).as_vec3()
        };
        let positions: Vec<Vec3> = rest.iter().map(rolled).collect();
        let definition = BodyDefinition {
            positions: &positions,
            rest_positions: Some(&rest),
            triangles: &triangles,
            masses: Values::Uniform(1e-3),
            bending_stiffness: RIGIDITY as f32,
            ..BodyDefinition::default()
        };
        let scene = hung(Vec3::ZERO, &definition);
        let energy = scene.body().energy(Vec3::ZERO).elastic;
        let area = 0.5 * side * side * 0.75_f64.sqrt() * triangles.len() as f64;
        let expected = 0.5 * RIGIDITY * area / (RADIUS * RADIUS);
        // Border edges are no hinges.
        assert!(
            (energy / expected - 1.0).abs() < 0.04,
            "{direction}: {energy} of {expected}"
        );
    }
}

#[test]
fn an_arc_keeps_its_shape_and_bends_as_a_curved_beam() {
    const RADIUS: f64 = 0.08;
    for columns in [16, 32] {
        let step = 0.5 * std::f64::consts::PI / (f64::from(columns) - 0.5);
        let across = (WIDTH / (RADIUS * step)).round().max(2.0) as u32;
        let (positions, triangles) = strip([columns, across], true, |i, j| {
            // A quarter circle from half a cell before the second column to the end.
            let angle = (f64::from(i) - 0.5) * step;
            let z = WIDTH * f64::from(j) / f64::from(across);
            DVec3::new(RADIUS * angle.sin(), RADIUS * angle.cos(), z)
        });
        let rows = across as usize + 1;
        let still = deflection(&positions, &triangles, rows, |_| Vec3::ZERO);
        assert!(still.length() < 1e-7, "{columns}: {still}");
        // Outward along the radius at the end.
        let force = 2e-6;
        let tip = deflection(&positions, &triangles, rows, |column| {
            Vec3::X
                * if column == columns as usize {
                    (force / rows as f64) as f32
                } else {
                    0.0
                }
        });
        // Squares cut alternately have 5/6 of the rigidity.
        let expected = 0.25 * std::f64::consts::PI * force * RADIUS.powi(3) / (5.0 / 6.0 * RIGIDITY * WIDTH);
        assert!((tip.x / expected - 1.0).abs() < 0.05, "{columns}: {tip} of {expected}");
    }
}

#[test]
fn a_hinge_has_the_energy_of_its_angle() {
    let corners = |angle: f32| {
        let (sine, cosine) = angle.sin_cos();
        [
            Vec3::ZERO,
            Vec3::Z * 0.03,
            Vec3::new(-0.02, 0.0, 0.01),
            Vec3::new(0.04 * cosine, 0.04 * sine, 0.02),
        ]
    };
    // E: k (1 - cos) of the angle difference, with k the rigidity times the squared edge length over both areas.
    let stiffness = RIGIDITY * 0.03 * 0.03 / (0.5 * 0.03 * 0.06);
    for rest in [0.0, 0.5, -1.2, 3.0, std::f32::consts::PI] {
        let (positions, triangles) = (corners(rest), [[0, 1, 2], [1, 0, 3]]);
        let definition = BodyDefinition {
            positions: &positions,
            triangles: &triangles,
            masses: Values::Uniform(1e-3),
            bending_stiffness: RIGIDITY as f32,
            ..BodyDefinition::default()
        };
        let mut scene = hung(Vec3::ZERO, &definition);
        for angle in [0.0, 0.4, -0.7, 2.0, 3.1, -3.1] {
            scene.body_mut().set_positions(&corners(angle)).expect("positions");
            let energy = scene.body().energy(Vec3::ZERO).elastic;
            let expected = stiffness * (1.0 - f64::from(angle - rest).cos());
            assert!(
                (energy - expected).abs() < 1e-6 * stiffness,
                "{angle} from {rest}: {energy} {expected}"
            );
        }
    }
}

#[test]
fn fibers_resist_only_tension_along_them() {
    const SIZE: [f32; 3] = [0.04, 0.02, 0.02];
    const YOUNG: f64 = 5000.0;
    const FIBRE: f64 = 15000.0;
    let mesh = Mesh::block(SIZE, [8, 4, 4]).expect("a block");
    // Without a Poisson's ratio the only strain is along the pull.
    let tissue = Material {
        model: Model::Tetrahedra,
        young_modulus: YOUNG as f32,
        poisson_ratio: 0.0,
        density: 1000.0,
        ..Material::default()
    };
    for (direction, pull, expected) in [
        (Vec3::X, 1.0, YOUNG + FIBRE),
        (Vec3::X, -1.0, YOUNG),
        (Vec3::Y, 1.0, YOUNG),
        (Vec3::ZERO, 1.0, YOUNG),
    ] {
        let directions = vec![direction; mesh.tetrahedra.len()];
        let definition = BodyDefinition {
            material: Some(tissue),
            fibre_directions: &directions,
            fibre_stiffnesses: Values::Uniform(FIBRE as f32),
            solver: Solver::Newton,
            ..BodyDefinition::of(&mesh)
        };
        let mut scene = hung(Vec3::ZERO, &definition);
        let strain = 0.002 * pull;
        for (node, position) in mesh.positions.iter().enumerate() {
            if position.x.abs() < 0.499 * SIZE[0] {
                continue;
            }
            if position.x < 0.0 {
                scene.body_mut().pin(node as u32).expect("a node");
                continue;
            }
            let share = |at: f32| if at.abs() > 0.499 * SIZE[1] { 0.125 } else { 0.25 };
            let force = expected * strain * f64::from(SIZE[1] * SIZE[2] * share(position.y) * share(position.z));
            let force = Vec3::X * force as f32;
            scene.body_mut().apply_force(node as u32, force).expect("a force");
        }
        scene.rest();
        let rest = scene.positions();
        let (mut longer, mut lengths) = (0.0, 0.0);
        for (before, after) in mesh.positions.iter().zip(&rest) {
            if before.x.abs() < 0.3 * SIZE[0] {
                let before = f64::from(before.x + 0.5 * SIZE[0]);
                longer += (after.x + 0.5 * f64::from(SIZE[0]) - before) * before;
                lengths += before * before;
            }
        }
        let found = longer / lengths;
        assert!(
            (found / strain - 1.0).abs() < 0.01,
            "{direction}, {pull}: {found} of {strain}"
        );
    }
}
