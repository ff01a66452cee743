//! Organ meshes: uneven tetrahedra with slivers, cavities and necks.

use std::collections::BTreeMap;
use std::f32::consts::TAU;
use std::ops::Range;
use std::path::Path;

use glam::{DVec3, Quat, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::{Mesh as Loaded, MeshFormat};
use sinew::{BodyDefinition, Material, Model, Solver, Storage, Values, World, WorldDefinition};

use super::block::{Body, Mesh, flat, snap};
use super::motion::enclosed;
use crate::support::kept::kept;
use crate::support::random::Random;
use crate::support::scene::SOLVERS;

/// Real meshes, with a report of missing files, and one that is always available; each is scaled to length 10 about the
/// origin.
fn organs() -> Vec<(String, Mesh)> {
    let made = Loaded::organ(0.2, 0.02).unwrap();
    let mut all = vec![("Mesh::organ".to_string(), made)];
    for name in [
        "liver_volumetric.vtk",
        "gallbladder_volumetric.vtk",
        "tissue_volume.msh",
        "stomach.msh",
    ] {
        let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
        let mut paths = above.map(|folder| folder.join("shared/meshes").join(name));
        match paths.find(|path| path.exists()) {
            Some(path) => all.push((
                name.into(),
                sinew::mesh::load(path, MeshFormat::Auto, 1.0).unwrap().mesh,
            )),
            None => {
                use std::io::Write;
                let _ = writeln!(
                    std::io::stderr(),
                    "SKIPPED: cuts of ../shared/meshes/{name}, which is missing"
                );
            }
        }
    }
    let sized = |mesh: Loaded| {
        let low = mesh.positions.iter().copied().reduce(Vec3::min).unwrap();
        let high = mesh.positions.iter().copied().reduce(Vec3::max).unwrap();
        let scale = 10.0 / (high - low).max_element();
        let positions = mesh
            .positions
            .iter()
            .map(|&position| scale * (position - 0.5 * (low + high)));
        (positions.collect(), mesh.tetrahedra)
    };
    all.into_iter().map(|(name, mesh)| (name, sized(mesh))).collect()
}

/// Checks that no piece has material farther than the snapping distance on both sides of the blade's path.
fn assert_parted(what: &str, body: &Body, side: impl Fn(DVec3) -> f64) {
    let far = 2.0 * snap(body);
    let mut sides: BTreeMap<u32, [f64; 2]> = BTreeMap::new();
    for (tetrahedron, piece) in body.solid.tetrahedra().iter().zip(body.piece_of_each()) {
        let middle = tetrahedron
            .corners
            .map(|corner| body.solid.rest_place(corner))
            .iter()
            .sum::<DVec3>()
            / 4.0;
        let distance = side(middle);
        if distance.abs() > far {
            sides.entry(piece).or_default()[usize::from(distance > 0.0)] += tetrahedron.volume;
        }
    }
    let mixed: Vec<_> = sides.iter().filter(|(_, [a, b])| *a > 0.0 && *b > 0.0).collect();
    assert!(mixed.is_empty(), "{what}: pieces on both sides {mixed:?}");
    assert!(sides.len() >= 2, "{what}: {} pieces", sides.len());
}

#[test]
fn planes_separate_organs() {
    planes_separate_organs_of(0..1);
}

#[test]
#[ignore = "long"]
fn planes_separate_organs_in_the_other_rounds() {
    planes_separate_organs_of(1..6);
}

fn planes_separate_organs_of(rounds: Range<usize>) {
    for (name, mesh) in organs() {
        let mut random = Random(31);
        for round in 0..rounds.end {
            let turn =
                Quat::from_rotation_y(random.between(0.0, TAU)) * Quat::from_rotation_x(random.between(0.0, TAU));
            let through = random.point(-0.8, 0.8);
            let at = |x: f32, z: f32| through + turn * vec3(x, 0.0, z);
            if !rounds.contains(&round) {
                continue;
            }
            let mut body = Body::new(mesh.clone(), flat);
            let steps = [1, 7, 40][round % 3];
            let edges: Vec<[Vec3; 2]> = (0..=steps)
                .map(|step| 40.0 * step as f32 / steps as f32 - 20.0)
                .map(|x| [at(x, -20.0), at(x, 20.0)])
                .collect();
            body.cut_along(&edges);
            let what = format!("{name}, round {round}");
            body.check();
            let normal = (turn * Vec3::Y).as_dvec3();
            assert_parted(&what, &body, |position| (position - through.as_dvec3()).dot(normal));
        }
    }
}

#[test]
fn curved_strokes_and_loops_separate_organs() {
    curved_strokes_and_loops_separate_organs_of(0..1);
}

#[test]
#[ignore = "long"]
fn curved_strokes_and_loops_separate_organs_in_the_other_rounds() {
    curved_strokes_and_loops_separate_organs_of(1..4);
}

fn curved_strokes_and_loops_separate_organs_of(rounds: Range<usize>) {
    for (name, mesh) in organs() {
        let mut random = Random(32);
        for round in 0..rounds.end {
            let turn =
                Quat::from_rotation_y(random.between(0.0, TAU)) * Quat::from_rotation_x(random.between(0.0, TAU));
            let (middle, radius) = (random.point(-1.0, 1.0), random.between(1.5, 2.5));
            let steps = [60, 90][round % 2];
            let edges: Vec<[Vec3; 2]> = (0..=steps)
                .map(|step| (step % steps) as f32 / steps as f32 * TAU)
                .map(|angle| [-20.0, 20.0].map(|z| middle + turn * vec3(radius * angle.cos(), radius * angle.sin(), z)))
                .collect();
            if !rounds.contains(&round) {
                continue;
            }
            let mut body = Body::new(mesh.clone(), flat);
            body.cut_along(&edges);
            let what = format!("{name}, round {round}");
            body.check();
            let (back, middle) = (turn.inverse().as_dquat(), middle.as_dvec3());
            // As a polygon it is inside the circle.
            let sagged = f64::from(radius) * (1.0 - (std::f64::consts::PI / f64::from(steps)).cos());
            assert_parted(&what, &body, |position| {
                let distance = (back * (position - middle)).truncate().length() - f64::from(radius) + 0.5 * sagged;
                if distance.abs() < sagged { 0.0 } else { distance }
            });
        }
    }
}

#[test]
fn t_cuts_and_crossings_in_organs() {
    for (name, mesh) in organs() {
        let plane = |at: f32, axis: usize| -> [[Vec3; 2]; 2] {
            let (u, v) = ([Vec3::Y, Vec3::Z, Vec3::X][axis], [Vec3::Z, Vec3::X, Vec3::Y][axis]);
            let origin = at * Vec3::AXES[axis];
            [-20.0, 20.0].map(|x| [-20.0, 20.0].map(|y| origin + x * u + y * v))
        };
        let mut body = Body::new(mesh.clone(), flat);
        for (at, axis) in [(0.113, 0), (-0.071, 1), (0.057, 2)] {
            body.cut_along(&plane(at, axis));
            body.check();
            let offset = f64::from(at);
            assert_parted(&format!("{name}, axis {axis}"), &body, |position| {
                position[axis] - offset
            });
        }
        // The foot ends in the transverse cut.
        let mut body = Body::new(mesh, flat);
        body.cut_along(&plane(0.113, 0));
        body.cut_along(&[
            [vec3(20.0, 0.05, -20.0), vec3(20.0, 0.05, 20.0)],
            [vec3(-0.4, 0.05, -20.0), vec3(-0.4, 0.05, 20.0)],
        ]);
        body.check();
        assert_parted(&format!("{name}, T"), &body, |position| position.x - 0.113);
        assert_parted(&format!("{name}, T"), &body, |position| {
            if position.x > 0.113 { position.y - 0.05 } else { 0.0 }
        });
    }
}

#[test]
fn organs_in_motion_keep_mass_momentum_and_volume() {
    organs_in_motion_keep_mass_momentum_and_volume_of(0..1);
}

#[test]
#[ignore = "long"]
fn organs_in_motion_keep_mass_momentum_and_volume_in_the_other_cases() {
    organs_in_motion_keep_mass_momentum_and_volume_of(1..usize::MAX);
}

fn organs_in_motion_keep_mass_momentum_and_volume_of(cases: Range<usize>) {
    for (name, (rest, cells)) in organs().into_iter().take(cases.end).skip(cases.start) {
        for (has_elements, solver) in SOLVERS.into_iter().flat_map(|solver| [(false, solver), (true, solver)]) {
            if rest.len() > 3000 && solver == Solver::Newton {
                continue;
            }
            let what = format!("{name}, elements {has_elements}, {solver:?}");
            let positions: Vec<Vec3> = rest.iter().map(|&position| 0.01 * position).collect();
            let mut masses = vec![0.0; positions.len()];
            for cell in &cells {
                let [a, b, c, d] = cell.map(|node| positions[node as usize]);
                let volume = (b - a).cross(c - a).dot(d - a) / 6.0;
                cell.iter().for_each(|&node| masses[node as usize] += 250.0 * volume);
            }
            let mut world = World::new(WorldDefinition {
                gravity: Vec3::ZERO,
                ..Default::default()
            })
            .unwrap();
            let elements = Material {
                model: Model::Tetrahedra,
                young_modulus: 3000.0,
                poisson_ratio: 0.3,
                ..Default::default()
            };
            let body = world
                .create_body(&BodyDefinition {
                    positions: &positions,
                    masses: Values::Each(&masses),
                    tetrahedra: &cells,
                    stiffnesses: Values::Uniform(if has_elements { 0.0 } else { 5.0 }),
                    material: has_elements.then_some(elements),
                    // Added mass is recomputed after a cut, and its momentum would count.
                    mass_scaling: 0.0,
                    spare_nodes: 60_000,
                    solver,
                    storage: Storage::Packed,
                    ..Default::default()
                })
                .unwrap();
            let velocities: Vec<Vec3> = positions
                .iter()
                .map(|&position| vec3(0.3, -0.2, 0.1) + vec3(1.0, 2.0, 3.0).cross(position))
                .collect();
            world.body_mut(body).unwrap().set_velocities(&velocities).unwrap();
            let mut tracked: Vec<DVec3> = positions.iter().map(|position| position.as_dvec3()).collect();
            let mut triangles = world.body(body).unwrap().surface().to_vec();
            let whole = enclosed(&triangles, |node| tracked[node as usize]);
            let (mut version, mut pieces, mut random) = (0, 1, Random(33));
            for cut in 0..4 {
                world.step(5e-4).unwrap();
                let it = world.body(body).unwrap();
                let middle = it.positions()[..positions.len()].iter().sum::<Vec3>() / positions.len() as f32;
                let turn =
                    Quat::from_rotation_y(random.between(0.0, TAU)) * Quat::from_rotation_z(random.between(0.0, TAU));
                let through = middle + random.point(-0.005, 0.005);
                let far = if cut == 3 { 0.0 } else { 0.2 };
                let edge = |x: f32| [-0.2, 0.2].map(|z| through + turn * vec3(x, 0.0, z));
                let sweep = Sweep {
                    start: edge(-0.2),
                    end: edge(far),
                };
                let before = kept(&world, body);
                pieces += world.cut(body, &sweep).unwrap().pieces_parted;
                let after = kept(&world, body);
                after.check_motion(&before, &what);
                assert!(
                    (after.energy / before.energy - 1.0).abs() < 1e-6,
                    "{what}: {} {}",
                    before.energy,
                    after.energy
                );
                let it = world.body(body).unwrap();
                let changes = it.changes_since(version).unwrap();
                version = changes.version;
                for new in changes.nodes {
                    assert_eq!(new.node as usize, tracked.len());
                    tracked.push(
                        (0..3)
                            .map(|k| f64::from(new.weights[k]) * tracked[new.sources[k] as usize])
                            .sum(),
                    );
                }
                triangles.resize(it.surface().len(), [0; 3]);
                for &triangle in changes.triangles {
                    triangles[triangle as usize] = it.surface()[triangle as usize];
                }
                assert_eq!(triangles, it.surface(), "{what}");
                let now = enclosed(&triangles, |node| tracked[node as usize]);
                assert!((now / whole - 1.0).abs() < 1e-6, "{what}: {now} of {whole} m³");
                assert_eq!(it.pieces().unwrap().count, pieces, "{what}");
            }
            for _ in 0..10 {
                world.step(5e-4).unwrap();
            }
            assert!(
                world
                    .body(body)
                    .unwrap()
                    .positions()
                    .iter()
                    .all(|position| position.is_finite()),
                "{what}"
            );
        }
    }
}
