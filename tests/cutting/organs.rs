//! Surfaces of real organs, uneven and curved: planes separate them along the path of the blade.

use std::f32::consts::TAU;
use std::path::Path;

use glam::{DVec3, Quat, Vec3, vec3};
use sinew::cutting::{Limits, Sweep};
use sinew::mesh::MeshFormat;

use super::sheet::{Body, flat, snap};
use crate::support::random::Random;

/// Real surfaces, scaled to length 10 about the origin; missing files are reported.
type Surface = (Vec<Vec3>, Vec<[u32; 3]>);

fn organs() -> Vec<(&'static str, Surface)> {
    let mut all = Vec::new();
    for name in ["liver_collision.stl", "stomach.stl", "tissue_surface.obj"] {
        let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
        let mut paths = above.map(|folder| folder.join("shared/meshes").join(name));
        let Some(path) = paths.find(|path| path.exists()) else {
            use std::io::Write;
            let _ = writeln!(
                std::io::stderr(),
                "SKIPPED: cuts of ../shared/meshes/{name}, which is missing"
            );
            continue;
        };
        let mesh = sinew::mesh::load(path, MeshFormat::Auto, 1.0).unwrap().mesh;
        let low = mesh.positions.iter().copied().reduce(Vec3::min).unwrap();
        let high = mesh.positions.iter().copied().reduce(Vec3::max).unwrap();
        let scale = 10.0 / (high - low).max_element();
        let positions = mesh
            .positions
            .iter()
            .map(|&position| scale * (position - 0.5 * (low + high)));
        all.push((name, (positions.collect(), mesh.triangles)));
    }
    all
}

fn cut(body: &mut Body, start: [Vec3; 2], end: [Vec3; 2]) {
    let sweep = Sweep { start, end };
    let near = body.surface.near(&sweep, &body.positions).unwrap();
    let changes = body
        .surface
        .cut(&sweep, &body.follower.positions, &near, Limits::NONE)
        .unwrap();
    body.apply(&changes);
}

/// Checks that no triangle has corners farther than the snapping distance on both sides of the blade's path, and that
/// every cut-boundary edge lies along it.
fn assert_parted(what: &str, body: &Body, side: impl Fn(DVec3) -> f64) {
    let far = 1.01 * snap(body);
    for triangle in body.surface.triangles() {
        let distance = triangle.corners.map(|corner| side(body.surface.rest_place(corner)));
        assert!(
            distance.iter().all(|&distance| distance < far) || distance.iter().all(|&distance| distance > -far),
            "{what}: {distance:?}"
        );
    }
    for edge in body.rim() {
        assert!(edge.iter().all(|&end| side(end).abs() < far), "{what}: the rim");
    }
}

#[test]
fn planes_and_loops_separate_surfaces_of_organs() {
    for (name, mesh) in organs() {
        let mut random = Random(41);
        for round in 0..6 {
            let mut turned = || Quat::from_rotation_y(random.between(0.0, TAU));
            let turn = turned() * Quat::from_rotation_x(1.3) * turned();
            let mut offset = || random.between(-0.8, 0.8);
            let through = vec3(offset(), offset(), offset());
            let mut body = Body::new(mesh.clone(), flat);
            let whole = body.check();
            let steps = [1, 7, 40][round % 3];
            let at = |x: f32, z: f32| through + turn * vec3(x, 0.0, z);
            for step in 0..steps {
                let x = |step: u32| 40.0 * step as f32 / steps as f32 - 20.0;
                let (from, to) = (x(step), x(step + 1));
                cut(
                    &mut body,
                    [at(from, -20.0), at(from, 20.0)],
                    [at(to, -20.0), at(to, 20.0)],
                );
            }
            let what = format!("{name}, round {round}");
            let pieces = body.check();
            assert!(pieces > whole, "{what}: {pieces} pieces of {whole}");
            let normal = (turn * Vec3::Y).as_dvec3();
            assert_parted(&what, &body, |position| (position - through.as_dvec3()).dot(normal));
            // Across it, again all the way.
            let at = |x: f32, z: f32| through + turn * vec3(0.0, x, z);
            cut(
                &mut body,
                [at(-20.0, -20.0), at(-20.0, 20.0)],
                [at(20.0, -20.0), at(20.0, 20.0)],
            );
            assert!(body.check() > pieces, "{what}: crossing");
        }
        for round in 0..3 {
            let mut body = Body::new(mesh.clone(), flat);
            let whole = body.check();
            let (radius, steps) = (random.between(1.0, 2.0), 80);
            let turn = Quat::from_rotation_x(random.between(0.0, TAU));
            let edge = |step: u32| {
                let angle = (step % steps) as f32 / steps as f32 * TAU;
                [-20.0, 20.0].map(|z| turn * vec3(radius * angle.cos(), radius * angle.sin(), z))
            };
            for step in 0..steps {
                cut(&mut body, edge(step), edge(step + 1));
            }
            assert!(body.check() > whole, "{name}, loop {round}");
        }
    }
}
