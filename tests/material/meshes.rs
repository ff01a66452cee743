//! Springs from Young's modulus on irregular meshes, and a beam in bending. The figures are those of
//! docs/methods/materials.md and of `Model::Springs`.

use std::collections::BTreeSet;
use std::path::Path;

use crate::support::bodies::{FREE, Random};
use crate::support::skip;
use glam::{DMat3, DVec3, Vec3};
use sinew::mesh::{Mesh, MeshFormat, load};
use sinew::{BodyDefinition, BodyId, Material, RestStateDefinition, World};

const YOUNG_MODULUS: f32 = 5000.0;

/// Small enough that the modulus does not change with it, large enough for `f32`.
const STRAIN: f64 = 0.002;

/// m
const THICKNESS: f32 = 0.001;

fn world_of(mesh: &Mesh) -> (World, BodyId) {
    let sheet = mesh.tetrahedra.is_empty() && mesh.cells.is_empty();
    let mut world = World::new(FREE).expect("a world");
    let id = world
        .create_body(&BodyDefinition {
            positions: &mesh.positions,
            triangles: if sheet { &mesh.triangles } else { &[] },
            tetrahedra: &mesh.tetrahedra,
            cells: &mesh.cells,
            material: Some(Material {
                young_modulus: YOUNG_MODULUS,
                density: 1000.0,
                thickness: if sheet { THICKNESS } else { 0.0 },
                ..Material::default()
            }),
            ..BodyDefinition::default()
        })
        .expect("a body");
    (world, id)
}

fn settle(world: &mut World, id: BodyId) -> Vec<DVec3> {
    world
        .rest_state(id, &RestStateDefinition::default())
        .expect("a state of rest");
    let body = world.body(id).expect("the body");
    body.positions().iter().map(|p| p.as_dvec3()).collect()
}

/// Cubes of side 10 mm cut into five tetrahedra each, or squares cut into two triangles. Nodes are moved by up to
/// `amount` times the side along each axis; outer nodes stay in the surface.
fn shaken(mut mesh: Mesh, amount: f32) -> Mesh {
    let mut random = Random::new(7);
    let half = mesh.positions[0].abs();
    for position in &mut mesh.positions {
        let displacement = random.vector() * (amount * 0.01);
        for axis in 0..3 {
            if position[axis].abs() != half[axis] {
                position[axis] += displacement[axis];
            }
        }
    }
    mesh
}

fn block(amount: f32) -> Mesh {
    shaken(Mesh::block([0.08; 3], [8; 3]).expect("a block"), amount)
}

fn sheet(amount: f32) -> Mesh {
    shaken(Mesh::cloth([0.2; 2], [20; 2]).expect("a sheet"), amount)
}

/// Equilateral triangles of side 10 mm in the plane y = 0; inner nodes are moved by up to `amount` times the side.
fn equilateral(amount: f32) -> Mesh {
    let (cells, mut mesh, mut random) = (20_u32, Mesh::default(), Random::new(7));
    let corner = |x: u32, z: u32| z * (cells + 1) + x;
    for z in 0..=cells {
        for x in 0..=cells {
            let inside = x % cells > 0 && z % cells > 0;
            let displacement = if inside { random.vector() * amount } else { Vec3::ZERO };
            let position = Vec3::new(x as f32 + 0.5 * z as f32, 0.0, 0.75_f32.sqrt() * z as f32);
            mesh.positions
                .push((position + displacement * Vec3::new(1.0, 0.0, 1.0)) * 0.01);
            if x < cells && z < cells {
                mesh.triangles.push([corner(x, z), corner(x, z + 1), corner(x + 1, z)]);
                mesh.triangles
                    .push([corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1)]);
            }
        }
    }
    mesh
}

/// Returns the gradient of the volume by the position of each surface node, and the volume.
fn outside(mesh: &Mesh) -> (Vec<DVec3>, f64) {
    let mut areas = vec![DVec3::ZERO; mesh.positions.len()];
    let positions = |t: [u32; 3]| t.map(|node| mesh.positions[node as usize].as_dvec3());
    if !mesh.tetrahedra.is_empty() {
        for triangle in mesh.surface().expect("a surface") {
            let [a, b, c] = positions(triangle);
            for node in triangle {
                areas[node as usize] += (b - a).cross(c - a) / 6.0;
            }
        }
        return (areas, mesh.volume().expect("a volume"));
    }
    let (t, mut volume) = (f64::from(THICKNESS), 0.0);
    for &triangle in &mesh.triangles {
        let [a, b, c] = positions(triangle);
        let area = 0.5 * (b - a).cross(c - a);
        volume += area.length() * t;
        for (corner, side) in [b - c, c - a, a - b].into_iter().enumerate() {
            areas[triangle[corner] as usize] += 0.5 * side.cross(area.normalize()) * t;
        }
    }
    (areas, volume)
}

/// Returns the mean strain along two axes of a free body under uniform tension on its surface, given as fractions of E
/// along the axes.
fn strains(mesh: &Mesh, axes: [usize; 2], tensions: [f64; 2]) -> [f64; 2] {
    let (mut world, id) = world_of(mesh);
    let (areas, volume) = outside(mesh);
    let mut stress = DVec3::ZERO;
    for (axis, tension) in axes.into_iter().zip(tensions) {
        stress[axis] = tension * f64::from(YOUNG_MODULUS);
    }
    let loads: Vec<Vec3> = areas.iter().map(|&area| (area * stress).as_vec3()).collect();
    let nodes: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let body = world.body_mut(id).expect("the body");
    body.apply_forces(&nodes, &loads).expect("forces");
    let now = settle(&mut world, id);
    // The mean strain of a body is an integral over its surface.
    axes.map(|axis| {
        let displacement = |node: usize| now[node][axis] - f64::from(mesh.positions[node][axis]);
        (0..now.len())
            .map(|node| displacement(node) * areas[node][axis])
            .sum::<f64>()
            / volume
    })
}

/// Returns E relative to the requested modulus, and nu, of a body pulled along the first of two axes.
fn moduli_under_tension(mesh: &Mesh, axes: [usize; 2]) -> (f64, f64) {
    let [along, across] = strains(mesh, axes, [STRAIN, 0.0]);
    (STRAIN / along, -across / along)
}

/// Returns the same for a pre-stretched sheet: without tension it folds, since nothing resists bending.
fn moduli_of_pretensioned_sheet(mesh: &Mesh, axes: [usize; 2]) -> (f64, f64) {
    let before = strains(mesh, axes, [STRAIN, STRAIN]);
    let after = strains(mesh, axes, [2.0 * STRAIN, STRAIN]);
    let [along, across] = [0, 1].map(|k| after[k] - before[k]);
    (STRAIN / along, -across / along)
}

/// Returns E relative to the requested modulus, and nu, averaged over all directions, of a body whose surface follows a
/// uniform strain.
fn moduli_under_uniform_strain(mesh: &Mesh) -> (f64, f64) {
    let volume = mesh.volume().expect("a volume");
    let outside: BTreeSet<u32> = mesh.surface().expect("a surface").into_iter().flatten().collect();
    // The sums of the stiffnesses c_iijj and c_ijij.
    let (mut squeezed, mut sheared) = (0.0, 0.0);
    for i in 0..3 {
        for j in 0..=i {
            let mut deformation = DMat3::IDENTITY;
            deformation.col_mut(i)[j] += STRAIN / 2.0;
            deformation.col_mut(j)[i] += STRAIN / 2.0;
            let (mut world, id) = world_of(mesh);
            let body = world.body_mut(id).expect("the body");
            let positions = mesh.positions.iter().map(|p| (deformation * p.as_dvec3()).as_vec3());
            body.set_positions(&positions.collect::<Vec<_>>()).expect("positions");
            for &node in &outside {
                body.pin(node).expect("a node");
            }
            settle(&mut world, id);
            let body = world.body(id).expect("the body");
            let mut stress = DMat3::ZERO;
            for &node in &outside {
                let held = body.pin_force(node).expect("a pin").as_dvec3() / (volume * STRAIN);
                let position = mesh.positions[node as usize].as_dvec3();
                stress += DMat3::from_cols(held * position.x, held * position.y, held * position.z);
            }
            let shear = 0.5 * (stress.col(i)[j] + stress.col(j)[i]);
            if i == j {
                squeezed += stress.col(0)[0] + stress.col(1)[1] + stress.col(2)[2];
                sheared += shear;
            } else {
                sheared += 2.0 * shear;
            }
        }
    }
    // For an isotropic material: 9 lambda + 6 mu and 3 lambda + 12 mu.
    let mu = (3.0 * sheared - squeezed) / 30.0;
    let lambda = (squeezed - 6.0 * mu) / 9.0;
    let modulus = mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu);
    (modulus / f64::from(YOUNG_MODULUS), lambda / (2.0 * (lambda + mu)))
}

#[track_caller]
fn assert_near((modulus, ratio): (f64, f64), expected: (f64, f64)) {
    assert!(
        (modulus - expected.0).abs() < 0.015 && (ratio - expected.1).abs() < 0.01,
        "E {modulus:.4}, nu {ratio:.4}"
    );
}

/// Cubes cut into five tetrahedra have the edges of a lattice in other proportions: they are stiffer along the axes
/// than across.
#[test]
fn cubes_cut_in_five_have_the_documented_stiffness() {
    assert_near(moduli_under_uniform_strain(&block(0.0)), (1.0, 0.25));
    assert_near(moduli_under_tension(&block(0.0), [0, 1]), (1.187, 0.186));
}

#[test]
fn irregular_tetrahedra_have_the_documented_stiffness() {
    assert_near(moduli_under_uniform_strain(&block(0.1)), (0.988, 0.249));
    assert_near(moduli_under_uniform_strain(&block(0.2)), (0.952, 0.246));
    assert_near(moduli_under_uniform_strain(&block(0.3)), (0.900, 0.238));
    for axis in 0..3 {
        assert_near(
            moduli_under_tension(&block(0.2), [axis, (axis + 1) % 3]),
            (1.076, 0.185),
        );
    }
}

#[test]
fn irregular_triangles_have_the_documented_stiffness() {
    for axes in [[0, 2], [2, 0]] {
        assert_near(moduli_of_pretensioned_sheet(&equilateral(0.0), axes), (1.0, 0.333));
        assert_near(moduli_of_pretensioned_sheet(&equilateral(0.2), axes), (0.953, 0.341));
        assert_near(moduli_of_pretensioned_sheet(&sheet(0.0), axes), (1.192, 0.191));
        assert_near(moduli_of_pretensioned_sheet(&sheet(0.2), axes), (1.095, 0.218));
    }
}

#[test]
fn organs_have_the_documented_stiffness() {
    assert_near(
        moduli_under_uniform_strain(&Mesh::organ(0.2, 0.01).expect("an organ")),
        (0.992, 0.251),
    );
    let Some(folder) = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .map(|above| above.join("shared/meshes"))
        .find(|folder| folder.is_dir())
    else {
        return skip("the stiffness of real meshes: ../shared/meshes is missing");
    };
    let mesh = |name: &str| load(folder.join(name), MeshFormat::Auto, 0.01).expect("a mesh").mesh;
    let stomach = mesh("stomach.msh");
    assert_near(moduli_under_tension(&stomach, [0, 1]), (0.930, 0.252));
    assert_near(
        moduli_under_uniform_strain(&mesh("liver_volumetric.vtk")),
        (0.983, 0.252),
    );
}

/// Returns the deflection of a beam of cells under a shear force at its end, relative to beam theory. The beam is
/// `thick` cells thick and eight times as long.
fn deflection(thick: u32) -> f64 {
    let (side, long) = (0.02_f64, 0.16_f64);
    let edge = side / f64::from(thick);
    let mesh = Mesh::lattice(edge as f32, [8 * thick, thick, thick]).expect("a lattice");
    let (mut world, id) = world_of(&mesh);
    let modulus = f64::from(YOUNG_MODULUS);
    let shear_modulus = modulus / 2.5;
    let inertia = side.powi(4) / 12.0;
    let compliance = long.powi(3) / (3.0 * modulus * inertia) + long / (5.0 / 6.0 * shear_modulus * side * side);
    let load = 0.005 * long / compliance;
    let half = mesh.positions[0].abs();
    let body = world.body_mut(id).expect("the body");
    let share = |p: Vec3| {
        let at = |position: f32, rim: f32| if position.abs() == rim { 0.5 } else { 1.0 };
        at(p.y, half.y) * at(p.z, half.z) / f64::from(thick * thick)
    };
    let mut end = Vec::new();
    for (node, &p) in (0..).zip(&mesh.positions) {
        if p.x == -half.x {
            body.pin(node).expect("a node");
        } else if p.x == half.x {
            end.push(node as usize);
            let force = Vec3::NEG_Y * (load * share(p)) as f32;
            body.apply_force(node, force).expect("a force");
        }
    }
    let now = settle(&mut world, id);
    let down = |&node: &usize| (f64::from(mesh.positions[node].y) - now[node].y) * share(mesh.positions[node]);
    end.iter().map(down).sum::<f64>() / (load * compliance)
}

#[test]
fn a_cantilever_of_cells_bends_as_a_beam_does() {
    let [coarse, middle, fine] = [2, 4, 8].map(deflection);
    // Richardson extrapolation: the limit for infinitely fine cells, and the order of convergence.
    let order = ((middle - coarse) / (fine - middle)).log2();
    let refined = fine + (fine - middle) / (order.exp2() - 1.0);
    assert!((fine - 1.0).abs() < 0.04, "{fine}");
    // 1.84 from 4, 8 and 16 cells, which refine to 0.994.
    assert!((1.5..2.0).contains(&order), "of order {order}");
    assert!((refined - 1.0).abs() < 0.01, "refined {refined}");
    let errors = [coarse, middle, fine].map(|found| (found / refined - 1.0).abs());
    assert!(errors[1] < 0.5 * errors[0] && errors[2] < 0.5 * errors[1], "{errors:?}");
}
