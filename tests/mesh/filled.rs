//! Tetrahedral meshes that fill a closed surface.

use glam::{DVec3, Vec3, vec3};
use sinew::mesh::{Mesh, boundary, is_closed};
use sinew::{BodyDefinition, Values, World, WorldDefinition};

use crate::support::solid::ball;

/// Returns the surface of a tetrahedral mesh, with all of its nodes.
fn surface_of(mesh: &Mesh) -> Mesh {
    Mesh {
        positions: mesh.positions.clone(),
        triangles: boundary(&mesh.tetrahedra).expect("a boundary"),
        ..Mesh::default()
    }
}

/// Returns the smallest and the largest dihedral angle (degrees).
fn angles(mesh: &Mesh) -> [f64; 2] {
    let mut range = [180.0_f64, 0.0];
    for tetrahedron in &mesh.tetrahedra {
        let p = tetrahedron.map(|node| mesh.positions[node as usize].as_dvec3());
        for [a, b, c, d] in [
            [0, 1, 2, 3],
            [0, 2, 1, 3],
            [0, 3, 1, 2],
            [1, 2, 0, 3],
            [1, 3, 0, 2],
            [2, 3, 0, 1],
        ] {
            let axis = (p[b] - p[a]).normalize();
            let projected = |q: DVec3| (q - p[a]).reject_from_normalized(axis).normalize();
            let angle = projected(p[c])
                .dot(projected(p[d]))
                .clamp(-1.0, 1.0)
                .acos()
                .to_degrees();
            range = [range[0].min(angle), range[1].max(angle)];
        }
    }
    range
}

fn check(filled: &Mesh) {
    let is_positive = |t: &[u32; 4]| {
        let [a, b, c, d] = t.map(|node| filled.positions[node as usize].as_dvec3());
        (b - a).dot((c - a).cross(d - a)) > 0.0
    };
    assert!(filled.tetrahedra.iter().all(is_positive));
    assert!(is_closed(&filled.triangles).expect("memory"));
    let mut used = vec![false; filled.positions.len()];
    filled
        .tetrahedra
        .iter()
        .flatten()
        .for_each(|&node| used[node as usize] = true);
    assert!(used.iter().all(|&used| used));
}

#[test]
fn a_smooth_body_is_filled_to_its_surface() {
    let organ = surface_of(&Mesh::organ(0.2, 0.006).expect("an organ"));
    let volume = organ.volume().expect("a volume");
    let mut last = f64::INFINITY;
    for spacing in [0.016, 0.008, 0.004] {
        let filled = Mesh::filled(&organ, spacing).expect("a mesh");
        check(&filled);
        let error = (filled.volume().expect("a volume") / volume - 1.0).abs();
        assert!(error < last, "{spacing}: {error}, after {last}");
        last = error;
        let [least, largest] = angles(&filled);
        assert!(
            least > 5.0 && largest < 170.0,
            "{spacing}: {least} to {largest} degrees"
        );
        // The mean edge length is about the requested spacing.
        let edges = filled.edges().expect("edges");
        let lengths = edges.iter().map(|edge| {
            let [a, b] = edge.map(|node| filled.positions[node as usize].as_dvec3());
            a.distance(b)
        });
        let mean = lengths.sum::<f64>() / edges.len() as f64;
        assert!((0.85..1.1).contains(&(mean / f64::from(spacing))), "{spacing}: {mean}");
    }
    assert!(last < 0.005, "{last}");
}

#[test]
fn a_block_is_filled_at_any_position() {
    // Faces, edges and corners coincide with the lattice, so rays hit them exactly.
    for shift in [Vec3::ZERO, vec3(0.3, 0.1, -0.2), vec3(100.0, -50.0, 20.0)] {
        let mut block = surface_of(&Mesh::block([0.1, 0.06, 0.08], [5, 3, 4]).expect("a block"));
        block.positions.iter_mut().for_each(|position| *position += shift);
        for spacing in [0.0092, 0.01, 0.02, 0.009233] {
            let filled = Mesh::filled(&block, spacing).expect("a mesh");
            check(&filled);
            let error = filled.volume().expect("a volume") / (0.1 * 0.06 * 0.08) - 1.0;
            // Its edges are cut off by at most a part of a cell.
            assert!((-0.12..0.001).contains(&error), "{shift}, {spacing}: {error}");
        }
    }
}

#[test]
fn hollows_stay_hollow_and_crossing_parts_are_merged() {
    let outer = surface_of(&Mesh::block([0.1, 0.1, 0.1], [2, 2, 2]).expect("a block"));
    let join = |other: &Mesh, is_flipped: bool| {
        let mut both = outer.clone();
        let first = both.positions.len() as u32;
        both.positions.extend_from_slice(&other.positions);
        both.triangles.extend(other.triangles.iter().map(|&triangle| {
            let [a, b, c] = triangle.map(|node| node + first);
            if is_flipped { [a, c, b] } else { [a, b, c] }
        }));
        both
    };
    let inner = surface_of(&Mesh::block([0.05, 0.05, 0.05], [2, 2, 2]).expect("a block"));
    let hollow = Mesh::filled(&join(&inner, true), 0.01).expect("a mesh");
    check(&hollow);
    let volume = hollow.volume().expect("a volume");
    assert!((volume / (1e-3 - 1.25e-4) - 1.0).abs() < 0.06, "{volume}");
    let middle = hollow
        .positions
        .iter()
        .filter(|position| position.abs().max_element() < 0.02);
    assert_eq!(middle.count(), 0);
    // Two blocks that cross: the volume of both, with the shared part counted once.
    let mut other = inner.clone();
    other.positions.iter_mut().for_each(|position| position.x += 0.05);
    let both = Mesh::filled(&join(&other, false), 0.01).expect("a mesh");
    let volume = both.volume().expect("a volume");
    assert!((volume / (1e-3 + 0.5 * 1.25e-4) - 1.0).abs() < 0.06, "{volume}");
}

#[test]
fn corners_may_be_repeated_as_in_stl_files() {
    let organ = surface_of(&Mesh::organ(0.2, 0.012).expect("an organ"));
    let mut separate = Mesh::default();
    for triangle in &organ.triangles {
        let first = separate.positions.len() as u32;
        separate
            .positions
            .extend(triangle.map(|node| organ.positions[node as usize]));
        separate.triangles.push([first, first + 1, first + 2]);
    }
    let [one, other] = [&organ, &separate].map(|surface| Mesh::filled(surface, 0.01).expect("a mesh"));
    let volumes = [one.volume().expect("a volume"), other.volume().expect("a volume")];
    assert!((volumes[0] / volumes[1] - 1.0).abs() < 1e-6, "{volumes:?}");
    assert_eq!(one.tetrahedra.len(), other.tetrahedra.len());
}

/// Two crossing balls, as thin as the spacing at their crossing, and an organ. No part is connected by only an edge or
/// a corner, so each mesh can be cut.
#[test]
fn filled_meshes_can_be_cut_at_each_spacing() {
    let organ = Mesh::organ(0.12, 0.006).expect("an organ");
    let mut balls = ball(0.03, 3);
    for offset in [vec3(0.0585, 0.0, 0.0), vec3(0.03, 0.0497, 0.003)] {
        let first = balls.positions.len() as u32;
        let other = ball(0.03, 3);
        balls
            .positions
            .extend(other.positions.iter().map(|position| *position + offset));
        let triangles = other.triangles.iter().map(|triangle| triangle.map(|node| node + first));
        balls.triangles.extend(triangles);
    }
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    for surface in [surface_of(&organ), balls] {
        for step in 0..24 {
            let spacing = 0.007 + 3e-4 * step as f32;
            let filled = Mesh::filled(&surface, spacing).expect("tetrahedra");
            check(&filled);
            let body = world.create_body(&BodyDefinition {
                masses: Values::Uniform(1e-3),
                stiffnesses: Values::Uniform(20.0),
                spare_nodes: 10,
                ..BodyDefinition::of(&filled)
            });
            let body = body.unwrap_or_else(|error| panic!("{spacing} m: {error}"));
            world.destroy_body(body).expect("a body");
        }
    }
}
