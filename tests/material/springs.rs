//! Springs from Young's modulus and masses from density, against the theory of a deformed lattice (Cauchy-Born) and
//! against simulated laboratory tests.

use std::collections::BTreeMap;

use crate::support::bodies::{FREE, Random};
use crate::support::scene::STORAGES;
use crate::support::statics::{cubic_cell, stress, triangle_cell, uniaxial};
use glam::{DMat3, DVec3, Vec3};
use sinew::material::presets;
use sinew::mesh::{Mesh, is_closed};
use sinew::{BodyDefinition, BodyId, Error, Material, RestStateDefinition, Solver, Values, World};

const YOUNG_MODULUS: f32 = 5000.0;

const TISSUE: Material = Material {
    model: sinew::Model::Springs,
    young_modulus: YOUNG_MODULUS,
    poisson_ratio: 0.0,
    density: 1000.0,
    thickness: 0.0,
};

/// m
const THICKNESS: f32 = 0.001;

const SHEET: Material = Material {
    thickness: THICKNESS,
    ..TISSUE
};

fn definition(mesh: &Mesh, material: Material) -> BodyDefinition<'_> {
    BodyDefinition {
        material: Some(material),
        ..BodyDefinition::of(mesh)
    }
}

fn world_of(definition: &BodyDefinition) -> (World, BodyId) {
    let mut world = World::new(FREE).expect("a world");
    let id = world.create_body(definition).expect("a body");
    (world, id)
}

/// m; its small multiples are exact in `f32`, also stretched by a few binary digits, so that there is no rounding.
const DYADIC: f32 = 0.03125;

/// Equilateral triangles in the plane z = 0, to 20 binary digits.
fn triangle_sheet(cells: u32, side: f64) -> Mesh {
    let height = (0.75_f64.sqrt() * f64::from(1 << 20)).round() / f64::from(1 << 20);
    let mut mesh = Mesh::default();
    let corner = |x: u32, y: u32| y * (cells + 1) + x;
    for y in 0..=cells {
        for x in 0..=cells {
            let place = DVec3::new(f64::from(x) + 0.5 * f64::from(y), height * f64::from(y), 0.0);
            mesh.positions.push((place * side).as_vec3());
            if x < cells && y < cells {
                mesh.triangles.push([corner(x, y), corner(x + 1, y), corner(x, y + 1)]);
                mesh.triangles
                    .push([corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)]);
            }
        }
    }
    mesh
}

/// Returns the spring force on each node when all nodes are held at positions given by `deformation` (N).
fn forces(definition: &BodyDefinition, deformation: DMat3) -> Vec<DVec3> {
    let (mut world, id) = world_of(definition);
    let body = world.body_mut(id).expect("the body");
    let deformed = definition
        .positions
        .iter()
        .map(|p| (deformation * p.as_dvec3()).as_vec3());
    body.set_positions(&deformed.collect::<Vec<_>>()).expect("positions");
    for node in 0..definition.positions.len() as u32 {
        body.pin(node).expect("a node");
    }
    world.step(1e-3).expect("a step");
    let body = world.body(id).expect("the body");
    let force = |node: usize| -body.pin_force(node as u32).expect("a pin").as_dvec3();
    (0..definition.positions.len()).map(force).collect()
}

/// Returns the largest difference of forces, relative to the largest expected force.
fn error_of(found: &[DVec3], expected: &[DVec3]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().map(|force| force.length()).fold(0.0, f64::max);
    let errors = found
        .iter()
        .zip(expected)
        .map(|(found, expected)| found.distance(*expected));
    errors.fold(0.0, f64::max) / largest
}

/// Stretches and shears, small and up to 0.2, that keep dyadic positions exact.
fn deformations() -> [DMat3; 5] {
    let shear = DMat3::from_cols(DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.125, 1.0, 0.0), DVec3::Z);
    [
        DMat3::from_diagonal(DVec3::new(1.0 + 1.0 / 32.0, 1.0, 1.0)),
        DMat3::from_diagonal(DVec3::new(1.1875, 0.9375, 0.9375)),
        DMat3::from_diagonal(DVec3::new(0.8125, 1.0625, 1.0625)),
        shear,
        shear * DMat3::from_diagonal(DVec3::new(1.0625, 0.875, 1.1875)),
    ]
}

/// Returns the stiffness of an inner spring of a lattice of cubes of edge `a`.
fn lattice_stiffness(a: f64) -> f64 {
    0.4 * f64::from(YOUNG_MODULUS) * a
}

#[test]
fn lattice_forces_agree_with_its_deformed_cells() {
    let mesh = Mesh::lattice(DYADIC, [4, 3, 2]).expect("a lattice");
    let a = f64::from(DYADIC);
    for deformation in deformations() {
        let stress = stress(deformation, &cubic_cell(a, lattice_stiffness(a)), a * a * a);
        // A uniform stress in each cell exerts forces on its corners: inside the body they cancel.
        let mut expected = vec![DVec3::ZERO; mesh.positions.len()];
        for cell in &mesh.cells {
            for (corner, &node) in cell.iter().enumerate() {
                let inward = [1, 2, 4].map(|bit| if corner & bit == 0 { 1.0 } else { -1.0 });
                expected[node as usize] += stress * DVec3::from(inward) * (a * a / 4.0);
            }
        }
        for storage in STORAGES {
            let found = forces(
                &BodyDefinition {
                    storage,
                    ..definition(&mesh, TISSUE)
                },
                deformation,
            );
            let error = error_of(&found, &expected);
            assert!(error < 1e-5, "{storage:?}, {deformation}: {error:.2e}");
        }
    }
}

#[test]
fn a_lattice_has_the_requested_stiffness_in_every_direction() {
    let a = 0.01;
    let springs = cubic_cell(a, lattice_stiffness(a));
    let stretched = |axis, strain| {
        let f = uniaxial(
            axis,
            1.0 + strain,
            &[(axis + 1) % 3, (axis + 2) % 3],
            &springs,
            a * a * a,
        );
        let stress = stress(f, &springs, a * a * a).col(axis)[axis];
        (stress / strain, (1.0 - f.col((axis + 1) % 3)[(axis + 1) % 3]) / strain)
    };
    for axis in 0..3 {
        let (modulus, ratio) = stretched(axis, 1e-6);
        assert!((modulus / f64::from(YOUNG_MODULUS) - 1.0).abs() < 1e-5, "{modulus}");
        assert!((ratio - 0.25).abs() < 1e-5, "{ratio}");
        let (stretched, _) = stretched(axis, 0.01);
        let shift = (stretched / f64::from(YOUNG_MODULUS) - 1.0) / 0.01;
        assert!((shift - 0.7).abs() < 0.02, "{shift}");
    }
}

#[test]
fn triangle_sheet_forces_agree_with_its_deformed_triangles() {
    let mesh = triangle_sheet(4, f64::from(DYADIC));
    let stiffness = 0.75_f64.sqrt() * f64::from(YOUNG_MODULUS) * f64::from(THICKNESS);
    let (directions, area) = triangle_cell(f64::from(DYADIC), stiffness);
    // E t = 2k / sqrt 3 and nu = 1/3 along a side and across it.
    for (axis, across) in [(0, 1), (1, 0)] {
        let f = uniaxial(axis, 1.0 + 1e-6, &[across], &directions, area);
        let modulus = stress(f, &directions, area).col(axis)[axis] / 1e-6 / f64::from(THICKNESS);
        assert!((modulus / f64::from(YOUNG_MODULUS) - 1.0).abs() < 1e-5, "{modulus}");
        let ratio = (1.0 - f.col(across)[across]) / 1e-6;
        assert!((ratio - 1.0 / 3.0).abs() < 1e-5, "{ratio}");
    }
    for mut deformation in deformations() {
        deformation.z_axis = DVec3::Z;
        let stress = stress(deformation, &directions, area);
        // A uniform stress exerts on each corner of a triangle P times half the inward normal of the opposite side.
        let mut expected = vec![DVec3::ZERO; mesh.positions.len()];
        for triangle in &mesh.triangles {
            for corner in 0..3 {
                let [from, to] = [1, 2].map(|next| mesh.positions[triangle[(corner + next) % 3] as usize].as_dvec3());
                let side = to - from;
                expected[triangle[corner] as usize] -= stress * DVec3::new(-side.y, side.x, 0.0) * 0.5;
            }
        }
        for storage in STORAGES {
            let found = forces(
                &BodyDefinition {
                    storage,
                    ..definition(&mesh, SHEET)
                },
                deformation,
            );
            let error = error_of(&found, &expected);
            assert!(error < 1e-5, "{storage:?}, {deformation}: {error:.2e}");
        }
    }
}

/// A block cut into tetrahedra whose inner nodes are moved at random.
fn irregular_block(seed: u64) -> Mesh {
    let mut mesh = Mesh::block([4.0 * DYADIC; 3], [4; 3]).expect("a block");
    let mut random = Random::new(seed);
    for position in &mut mesh.positions {
        if position.abs().max_element() < 2.0 * DYADIC {
            *position += random.vector() * (0.2 * DYADIC);
        }
    }
    mesh
}

/// Uniform swelling stretches all springs alike. On any mesh the tension follows from three times the bulk modulus, E /
/// (1 - 2 nu), and in the plane from E t / (1 - nu), at the nu that springs imply.
#[test]
fn uniform_swelling_gives_the_tension_of_the_material() {
    let strain = 0.0625;
    let swollen = |mesh: &Mesh, material: Material| {
        let found = forces(
            &definition(mesh, material),
            DMat3::from_diagonal(DVec3::splat(1.0 + strain)),
        );
        let positions = mesh.positions.iter().map(|p| p.as_dvec3());
        -found
            .iter()
            .zip(positions)
            .map(|(force, place)| force.dot(place))
            .sum::<f64>()
    };
    let young_modulus = f64::from(YOUNG_MODULUS);
    for seed in 0..3 {
        let mesh = irregular_block(seed);
        let tension = swollen(&mesh, TISSUE) / (3.0 * mesh.volume().expect("a volume"));
        let expected = young_modulus * strain / (1.0 - 2.0 * 0.25);
        assert!((tension / expected - 1.0).abs() < 1e-5, "{tension} Pa for {expected}");

        let mut sheet = Mesh::cloth([0.25, 0.125], [8, 4]).expect("a sheet");
        let mut random = Random::new(seed);
        for p in &mut sheet.positions {
            *p += Vec3::new(random.signed(), 0.0, random.signed()) * (0.2 * DYADIC);
        }
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|node| sheet.positions[node as usize].as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        };
        let area: f64 = sheet.triangles.iter().map(area).sum();
        let tension = swollen(&sheet, SHEET) / (2.0 * area);
        let expected = young_modulus * f64::from(THICKNESS) * strain / (1.0 - 1.0 / 3.0);
        assert!((tension / expected - 1.0).abs() < 1e-5, "{tension} N/m for {expected}");
    }
}

#[test]
fn a_block_under_a_known_force_has_the_expected_length_and_width() {
    let (edge, cells) = (0.01_f32, [10_u32, 5, 5]);
    let mesh = Mesh::lattice(edge, cells).expect("a lattice");
    let section = (f64::from(edge) * 5.0).powi(2);
    // N; a strain of 0.4 %.
    let force = 0.004 * f64::from(YOUNG_MODULUS) * section;
    let half = mesh.positions[0].abs();
    for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
        let (mut world, id) = world_of(&BodyDefinition {
            solver,
            ..definition(&mesh, TISSUE)
        });
        let at_rim = |place: f32, rim: f32| if place.abs() == rim { 0.5 } else { 1.0 };
        for (node, p) in (0..).zip(&mesh.positions) {
            if p.x.abs() == half.x {
                let share = at_rim(p.y, half.y) * at_rim(p.z, half.z) / 25.0;
                let load = Vec3::X * (f64::from(p.x.signum()) * force * share) as f32;
                world
                    .body_mut(id)
                    .expect("the body")
                    .apply_force(node, load)
                    .expect("a force");
            }
        }
        world.rest_state(id, &RestStateDefinition::default()).expect("rest");
        let now = world.body(id).expect("the body").positions();
        let extent = |axis: usize| {
            let at = now.iter().map(|p| f64::from(p[axis]));
            at.clone().fold(f64::MIN, f64::max) - at.fold(f64::MAX, f64::min)
        };
        let strain = extent(0) / (2.0 * f64::from(half.x)) - 1.0;
        assert!((strain / 0.004 - 1.0).abs() < 0.01, "{solver:?}: a strain of {strain}");
        for axis in [1, 2] {
            let ratio = (1.0 - extent(axis) / (2.0 * f64::from(half.y))) / strain;
            assert!((ratio / 0.25 - 1.0).abs() < 0.02, "{solver:?}: nu {ratio}");
        }
    }
}

#[test]
fn masses_are_density_times_volume() {
    let lattice = Mesh::lattice(0.01, [3, 4, 5]).expect("a lattice");
    let sheet = Mesh::cloth([0.2, 0.1], [5, 7]).expect("a sheet");
    let irregular = irregular_block(1);
    for (mesh, material, expected) in [
        (&lattice, TISSUE, 1000.0 * 60.0 * 1e-6),
        (&sheet, SHEET, 1000.0 * 0.02 * 0.001),
        (&irregular, TISSUE, 1000.0 * (4.0 * f64::from(DYADIC)).powi(3)),
    ] {
        for storage in STORAGES {
            let (world, id) = world_of(&BodyDefinition {
                storage,
                ..definition(mesh, material)
            });
            // In a field of 1 m/s² along an axis, the potential energy of the body is its mass times the position of
            // its center.
            let body = world.body(id).expect("the body");
            let moment = |gravity: Vec3| -body.energy(gravity).gravitational;
            let (mut world, id) = world_of(&definition(mesh, material));
            let body = world.body_mut(id).expect("the body");
            let moved: Vec<Vec3> = mesh.positions.iter().map(|&p| p + Vec3::X).collect();
            body.set_positions(&moved).expect("positions");
            let mass = -body.energy(Vec3::X).gravitational - moment(Vec3::X);
            assert!(
                (mass / expected - 1.0).abs() < 1e-5,
                "{storage:?}: {mass} kg for {expected}"
            );
            // Their center is the origin, except for a small offset of the irregular one.
            for axis in Vec3::AXES {
                assert!(moment(axis).abs() < 1e-3 * expected);
            }
        }
    }
    // A corner of a lattice has an eighth of a cell: falling with all other nodes pinned, it has that weight.
    let mut world = World::new(sinew::WorldDefinition {
        gravity: Vec3::NEG_Y * 10.0,
        ..FREE
    })
    .expect("a world");
    let id = world.create_body(&definition(&lattice, TISSUE)).expect("a body");
    let body = world.body_mut(id).expect("the body");
    for node in 0..lattice.positions.len() as u32 {
        body.pin(node).expect("a node");
    }
    world.step(1e-3).expect("a step");
    let held = world.body(id).expect("the body").pin_force(0).expect("a pin");
    assert!((held.y / (1000.0 * 1e-6 / 8.0 * 10.0) - 1.0).abs() < 1e-5, "{held}");
}

/// A body behaves the same whether its stiffnesses and masses were computed or given.
#[test]
fn a_body_with_a_material_equals_the_body_of_its_springs() {
    let mesh = Mesh::lattice(DYADIC, [3, 3, 3]).expect("a lattice");
    let stiffness = lattice_stiffness(f64::from(DYADIC));
    let cell_mass = 1000.0 * f64::from(DYADIC).powi(3);
    let mut shares = BTreeMap::new();
    let mut masses = vec![0.0_f32; mesh.positions.len()];
    for cell in &mesh.cells {
        for a in 0..8_usize {
            masses[cell[a] as usize] += (cell_mass / 8.0) as f32;
            for b in 0..a {
                let share = match (a ^ b).count_ones() {
                    1 => 0.25,
                    2 => 0.5,
                    _ => continue,
                };
                let (a, b) = (cell[a], cell[b]);
                *shares.entry([a.min(b), a.max(b)]).or_insert(0.0) += share;
            }
        }
    }
    let springs: Vec<[u32; 2]> = shares.keys().copied().collect();
    let stiffnesses: Vec<f32> = shares.values().map(|share| (share * stiffness) as f32).collect();
    for storage in STORAGES {
        for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
            let plain = BodyDefinition {
                material: None,
                springs: Some(&springs),
                stiffnesses: Values::Each(&stiffnesses),
                masses: Values::Each(&masses),
                storage,
                solver,
                ..definition(&mesh, TISSUE)
            };
            let requested = BodyDefinition {
                storage,
                solver,
                ..definition(&mesh, TISSUE)
            };
            let [mut given, mut made] = [plain, requested].map(|definition| world_of(&definition));
            for (world, id) in [&mut given, &mut made] {
                let body = world.body_mut(*id).expect("the body");
                body.pin(0).expect("a node");
                body.apply_force(63, Vec3::new(0.3, 0.2, 0.1)).expect("a force");
                world.step(0.01).expect("a step");
            }
            assert_eq!(given.0.state_hash(), made.0.state_hash(), "{storage:?}, {solver:?}");
            let report = |(world, id): &(World, BodyId)| world.body(*id).expect("the body").storage_report();
            assert_eq!(report(&given), report(&made), "{storage:?}");
        }
    }
}

/// Rounded positions create no extra spring types: sheets and blocks of equal elements stay bodies of few types,
/// wherever they are.
#[test]
fn equal_elements_have_equal_springs() {
    let mut sheet = Mesh::cloth([1.0, 1.0], [50, 50]).expect("a sheet");
    for position in &mut sheet.positions {
        *position += Vec3::new(0.3, 0.7, -0.9);
    }
    let made = world_of(&definition(&sheet, SHEET));
    let (young_modulus, t) = (YOUNG_MODULUS, THICKNESS);
    // Legs lie between two triangles of half a square, or belong to one; diagonals lie between two.
    let pairs = sheet.edges().expect("edges");
    let at_rim = |[a, b]: [u32; 2]| {
        let rim = |node: u32| {
            let (x, z) = (node % 51, node / 51);
            [x == 0, x == 50, z == 0, z == 50]
        };
        rim(a).iter().zip(rim(b)).any(|(&a, b)| a && b)
    };
    let stiffness = |&[a, b]: &[u32; 2]| {
        let leg = b - a == 1 || b - a == 51;
        let inner = if leg { 1.0 } else { 0.5 };
        young_modulus * t * inner * if leg && at_rim([a, b]) { 0.5 } else { 1.0 }
    };
    let stiffnesses: Vec<f32> = pairs.iter().map(stiffness).collect();
    let given = world_of(&BodyDefinition {
        springs: Some(&pairs),
        stiffnesses: Values::Each(&stiffnesses),
        material: None,
        masses: Values::Uniform(1.0),
        ..definition(&sheet, SHEET)
    });
    let report = |(world, id): &(World, BodyId)| world.body(*id).expect("the body").storage_report();
    assert_eq!(report(&given), report(&made));
}

#[test]
fn cells_have_their_outer_faces_as_surface() {
    let mut mesh = Mesh::lattice(0.5, [2, 3, 4]).expect("a lattice");
    assert_eq!(mesh.cells.len(), 24);
    assert!((mesh.volume().expect("a volume") - 3.0).abs() < 1e-12);
    let (faces, inside) = (2 * (6 + 8 + 12), mesh.triangles.clone());
    assert_eq!(inside.len(), 2 * faces);
    assert!(is_closed(&mesh.triangles).expect("memory"));
    // The outward triangles enclose the volume of the cells.
    let enclosed = Mesh {
        cells: vec![],
        ..mesh.clone()
    };
    assert!((enclosed.volume().expect("a volume") - 3.0).abs() < 1e-6);
    mesh.triangles.clear();
    let (world, id) = world_of(&definition(&mesh, TISSUE));
    assert_eq!(world.body(id).expect("the body").surface(), inside);
    // Without a material cells are also springs, each pair once.
    let (world, id) = world_of(&BodyDefinition {
        material: None,
        masses: Values::Uniform(1.0),
        stiffnesses: Values::Uniform(10.0),
        ..definition(&mesh, TISSUE)
    });
    let edges = 2 * 4 * 5 + 3 * 3 * 5 + 3 * 4 * 4;
    let squares = 6 * 5 + 8 * 4 + 12 * 3;
    let springs = world.body(id).expect("the body").storage_report().spring_count;
    assert_eq!(springs, edges + 2 * squares);
    assert_eq!(springs, mesh.edges().expect("edges").len());
}

#[test]
fn surfaces_face_outward_for_any_tetrahedron_orientation() {
    let mut mesh = Mesh::block([0.2, 0.3, 0.4], [2, 3, 4]).expect("a block");
    mesh.positions.iter_mut().for_each(|place| place.x = -place.x);
    let bare = Mesh {
        triangles: vec![],
        ..mesh.clone()
    };
    for mesh in [mesh, bare] {
        let (world, id) = world_of(&definition(&mesh, TISSUE));
        let enclosed = Mesh {
            triangles: world.body(id).expect("the body").surface().to_vec(),
            tetrahedra: vec![],
            ..mesh
        };
        let volume = enclosed.volume().expect("a volume");
        assert!((volume / 0.024 - 1.0).abs() < 1e-5, "{volume} m³");
    }
}

/// Returns the error of a refused definition.
fn refusal(definition: &BodyDefinition) -> String {
    let mut world = World::new(FREE).expect("a world");
    match world.create_body(definition) {
        Err(Error::InvalidArgument(message)) => message,
        other => panic!("{other:?}"),
    }
}

#[test]
fn numbers_out_of_range_are_named() {
    let mesh = Mesh::lattice(0.01, [2, 2, 2]).expect("a lattice");
    let sheet = triangle_sheet(2, 0.01);
    let says = |mesh: &Mesh, material: Material, words: &[&str]| {
        let message = refusal(&definition(mesh, material));
        for word in words {
            assert!(message.contains(word), "{message}: {word}");
        }
    };
    for young_modulus in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        says(
            &mesh,
            Material {
                young_modulus,
                ..TISSUE
            },
            &["young_modulus is", "above 0"],
        );
    }
    let large = Mesh::lattice(10.0, [1, 1, 1]).expect("a lattice");
    says(
        &large,
        Material {
            young_modulus: f32::MAX,
            ..TISSUE
        },
        &["young_modulus is", "[0, 3]"],
    );
    for poisson_ratio in [0.3, -0.25, 0.2515, f32::NAN] {
        says(
            &mesh,
            Material {
                poisson_ratio,
                ..TISSUE
            },
            &["poisson_ratio is", &poisson_ratio.to_string(), "cells imply 0.25"],
        );
    }
    says(
        &sheet,
        Material {
            poisson_ratio: 0.25,
            ..SHEET
        },
        &["poisson_ratio is 0.25", "triangles imply 0.33"],
    );
    for (mesh, poisson_ratio, material) in [(&mesh, 0.2505, TISSUE), (&sheet, 0.333, SHEET)] {
        world_of(&definition(
            mesh,
            Material {
                poisson_ratio,
                ..material
            },
        ));
    }
    for density in [-1.0, f32::NAN, f32::INFINITY] {
        says(&mesh, Material { density, ..TISSUE }, &["density is"]);
    }
    says(
        &mesh,
        Material {
            density: 1e-35,
            ..TISSUE
        },
        &["density is", "node 0"],
    );
    for thickness in [-1.0, f32::NAN] {
        says(&sheet, Material { thickness, ..SHEET }, &["thickness is"]);
    }
    says(&sheet, TISSUE, &["thickness is 0", "triangles"]);
    says(&mesh, SHEET, &["thickness is 0.001", "cells"]);
}

#[test]
fn settings_that_conflict_with_a_material_are_named() {
    let mesh = irregular_block(2);
    let good = definition(&mesh, TISSUE);
    let light = Material { density: 0.0, ..TISSUE };
    let masses = vec![0.1; mesh.positions.len()];
    let nowhere: Vec<Vec3> = mesh.positions.iter().copied().chain([Vec3::ONE]).collect();
    let lattice = Mesh::lattice(0.01, [2, 2, 2]).expect("a lattice");
    let across = [[0, 1, 124]];
    for (words, bad) in [
        (
            vec!["springs is given", "material"],
            BodyDefinition {
                springs: Some(&[]),
                ..good
            },
        ),
        (
            vec!["stiffness is 10", "material"],
            BodyDefinition {
                stiffnesses: Values::Uniform(10.0),
                ..good
            },
        ),
        (
            vec!["node_mass is 0.1", "density"],
            BodyDefinition {
                masses: Values::Uniform(0.1),
                ..good
            },
        ),
        (
            vec!["masses is given", "density"],
            BodyDefinition {
                masses: Values::Each(&masses),
                ..good
            },
        ),
        (
            vec!["node_mass is 0", "above 0"],
            BodyDefinition {
                material: Some(light),
                ..good
            },
        ),
        (
            vec!["without triangles, tetrahedra or cells"],
            BodyDefinition {
                triangles: &[],
                tetrahedra: &[],
                ..good
            },
        ),
        (
            vec!["tetrahedra and cells"],
            BodyDefinition {
                cells: &lattice.cells,
                ..good
            },
        ),
        (
            vec!["node 125", "none of the tetrahedra"],
            BodyDefinition {
                positions: &nowhere,
                ..good
            },
        ),
        (
            vec!["nodes 0 and 124", "surface"],
            BodyDefinition {
                triangles: &across,
                ..good
            },
        ),
        (
            vec!["cells[0] names node"],
            BodyDefinition {
                cells: &[[0, 1, 2, 3, 4, 5, 6, 999]],
                ..good
            },
        ),
    ] {
        let message = refusal(&bad);
        for word in words {
            assert!(message.contains(word), "{message}: {word}");
        }
    }
    // If the material has no density, the masses are those of the definition.
    world_of(&BodyDefinition {
        material: Some(light),
        masses: Values::Each(&masses),
        ..good
    });
}

#[test]
fn degenerate_elements_are_named() {
    let mut flat = irregular_block(3);
    let [a, b, c, d] = flat.tetrahedra[7].map(|node| node as usize);
    flat.positions[d] = (flat.positions[a] + flat.positions[b] + flat.positions[c]) / 3.0;
    flat.triangles.clear();
    let message = refusal(&definition(&flat, TISSUE));
    assert!(
        message.contains("tetrahedra[7]") && message.contains("flat"),
        "{message}"
    );
    // Validation uses the rest shape.
    let sound = irregular_block(3);
    let rested = BodyDefinition {
        rest_positions: Some(&sound.positions),
        ..definition(&flat, TISSUE)
    };
    world_of(&rested);

    let mut sheet = triangle_sheet(3, 0.01);
    sheet.triangles[4] = [0, 1, 2];
    let message = refusal(&definition(&sheet, SHEET));
    assert!(
        message.contains("triangles[4]") && message.contains("flat"),
        "{message}"
    );

    let lattice = Mesh::lattice(0.01, [3, 2, 2]).expect("a lattice");
    let corner = lattice.positions.len() - 1;
    let mut skewed = lattice.clone();
    skewed.positions[corner].x += 2e-5;
    let message = refusal(&definition(&skewed, TISSUE));
    assert!(message.contains("cells[11] is no cube"), "{message}");
    skewed.positions[corner].x -= 1.5e-5;
    world_of(&definition(&skewed, TISSUE));

    let mut mirrored = lattice.clone();
    for cell in &mut mirrored.cells {
        for pair in cell.chunks_mut(2) {
            pair.swap(0, 1);
        }
    }
    let message = refusal(&definition(&mirrored, TISSUE));
    assert!(message.contains("cells[0] is a mirrored cube"), "{message}");

    let mut point = lattice;
    point.positions.fill(Vec3::ZERO);
    let message = refusal(&definition(&point, TISSUE));
    assert!(message.contains("cells[0] is no cube"), "{message}");
}

#[test]
fn presets_have_figures_and_sources() {
    for preset in presets::PRESETS {
        assert!(preset.shear_modulus > 0.0 && preset.density > 900.0, "{preset:?}");
        assert_eq!(preset.young_modulus(), 3.0 * preset.shear_modulus);
        assert!(preset.source().contains("PMC6925591") && !preset.name().is_empty());
    }
    let mesh = Mesh::lattice(0.01, [2, 2, 2]).expect("a lattice");
    let liver = presets::LIVER;
    world_of(&definition(
        &mesh,
        Material {
            young_modulus: liver.young_modulus(),
            density: liver.density,
            ..Material::default()
        },
    ));
}

/// Coordinates far from the origin are rounded by up to 0.5 mm at 8 km and beyond.
#[test]
fn a_lattice_far_from_the_origin_is_accepted_as_cubes() {
    const EDGE: f32 = 0.2;
    let mesh = Mesh::lattice(EDGE, [5, 3, 4]).expect("a lattice");
    for far in [0.0, 1000.0, 8000.0, 10_000.0] {
        for towards in [Vec3::X, Vec3::new(0.6, -0.8, 0.0), Vec3::new(-0.48, 0.64, 0.6)] {
            let positions: Vec<Vec3> = mesh.positions.iter().map(|place| *place + far * towards).collect();
            let lattice = BodyDefinition {
                positions: &positions,
                node_dampings: Values::Uniform(10.0),
                ..definition(&mesh, TISSUE)
            };
            let (mut world, id) = world_of(&lattice);
            // The rounding error of an edge: twice that of a coordinate.
            let rounding = f32::EPSILON * (far + 1.0);
            let body = world.body(id).expect("the body");
            let mass: f64 = (0..body.node_count() as u32)
                .map(|node| f64::from(body.node_mass(node).expect("a node")))
                .sum();
            let expected = f64::from(TISSUE.density) * 60.0 * f64::from(EDGE).powi(3);
            let off = f64::from(3.0 * rounding / EDGE) + 1e-6;
            assert!(
                (mass / expected - 1.0).abs() < off,
                "{mass} kg of {expected}, {far} m away"
            );
            // It is at rest where it was created, within that rounding.
            for _ in 0..50 {
                world.step(0.01).expect("a step");
            }
            let now = world.body(id).expect("the body").positions();
            let moved = now.iter().zip(&positions).map(|(now, then)| now.distance(*then));
            let moved = moved.fold(0.0, f32::max);
            assert!(moved <= 8.0 * rounding, "{moved} m in half a second, {far} m away");
            // Cells that are not cubes are refused there too.
            let mut skew = positions.clone();
            skew[7] += Vec3::new(0.05 * EDGE, 0.0, 0.0);
            let skew = BodyDefinition {
                positions: &skew,
                ..lattice
            };
            let error = World::new(FREE)
                .expect("a world")
                .create_body(&skew)
                .expect_err("refused");
            assert!(error.to_string().contains("is no cube"), "{error}");
        }
    }
}
