//! Tetrahedra that fill what a surface encloses.

use glam::{DVec3, Vec3, vec3};
use sinew::mesh::{Mesh, boundary, is_closed};
use sinew::{BodyDefinition, Values, World, WorldDefinition};

use crate::support::solid::ball;

/// The surface of a mesh of tetrahedra, its nodes alone.
fn surface_of(mesh: &Mesh) -> Mesh {
    Mesh {
        positions: mesh.positions.clone(),
        triangles: boundary(&mesh.tetrahedra).expect("a boundary"),
        ..Mesh::default()
    }
}

/// The least and the largest dihedral angle, degrees.
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
            let flat = |q: DVec3| (q - p[a]).reject_from_normalized(axis).normalize();
            let angle = flat(p[c]).dot(flat(p[d])).clamp(-1.0, 1.0).acos().to_degrees();
            range = [range[0].min(angle), range[1].max(angle)];
        }
    }
    range
}

fn check(filled: &Mesh) {
    let sound = |t: &[u32; 4]| {
        let [a, b, c, d] = t.map(|node| filled.positions[node as usize].as_dvec3());
        (b - a).dot((c - a).cross(d - a)) > 0.0
    };
    assert!(filled.tetrahedra.iter().all(sound));
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
        let off = (filled.volume().expect("a volume") / volume - 1.0).abs();
        assert!(off < last, "{spacing}: {off}, after {last}");
        last = off;
        let [least, largest] = angles(&filled);
        assert!(
            least > 5.0 && largest < 170.0,
            "{spacing}: {least} to {largest} degrees"
        );
        // The mean edge is about what was asked for.
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
fn a_block_is_filled_wherever_it_stands() {
    // Faces along the lattice, edges and corners on it: what a ray meets exactly.
    for shift in [Vec3::ZERO, vec3(0.3, 0.1, -0.2), vec3(100.0, -50.0, 20.0)] {
        let mut block = surface_of(&Mesh::block([0.1, 0.06, 0.08], [5, 3, 4]).expect("a block"));
        block.positions.iter_mut().for_each(|place| *place += shift);
        for spacing in [0.0092, 0.01, 0.02, 0.009233] {
            let filled = Mesh::filled(&block, spacing).expect("a mesh");
            check(&filled);
            let off = filled.volume().expect("a volume") / (0.1 * 0.06 * 0.08) - 1.0;
            // Its edges are cut by at most a part of a cell.
            assert!((-0.12..0.001).contains(&off), "{shift}, {spacing}: {off}");
        }
    }
}

#[test]
fn hollows_stay_hollow_and_what_crosses_is_one() {
    let outer = surface_of(&Mesh::block([0.1, 0.1, 0.1], [2, 2, 2]).expect("a block"));
    let join = |other: &Mesh, turned: bool| {
        let mut both = outer.clone();
        let first = both.positions.len() as u32;
        both.positions.extend_from_slice(&other.positions);
        both.triangles.extend(other.triangles.iter().map(|&triangle| {
            let [a, b, c] = triangle.map(|node| node + first);
            if turned { [a, c, b] } else { [a, b, c] }
        }));
        both
    };
    let inner = surface_of(&Mesh::block([0.05, 0.05, 0.05], [2, 2, 2]).expect("a block"));
    let hollow = Mesh::filled(&join(&inner, true), 0.01).expect("a mesh");
    check(&hollow);
    let volume = hollow.volume().expect("a volume");
    assert!((volume / (1e-3 - 1.25e-4) - 1.0).abs() < 0.06, "{volume}");
    let middle = hollow.positions.iter().filter(|place| place.abs().max_element() < 0.02);
    assert_eq!(middle.count(), 0);
    // Two blocks that cross: each of them with what they share, once.
    let mut other = inner.clone();
    other.positions.iter_mut().for_each(|place| place.x += 0.05);
    let both = Mesh::filled(&join(&other, false), 0.01).expect("a mesh");
    let volume = both.volume().expect("a volume");
    assert!((volume / (1e-3 + 0.5 * 1.25e-4) - 1.0).abs() < 0.06, "{volume}");
}

#[test]
fn corners_may_be_repeated_as_in_stl_files() {
    let organ = surface_of(&Mesh::organ(0.2, 0.012).expect("an organ"));
    let mut apart = Mesh::default();
    for triangle in &organ.triangles {
        let first = apart.positions.len() as u32;
        apart
            .positions
            .extend(triangle.map(|node| organ.positions[node as usize]));
        apart.triangles.push([first, first + 1, first + 2]);
    }
    let [one, other] = [&organ, &apart].map(|surface| Mesh::filled(surface, 0.01).expect("a mesh"));
    let volumes = [one.volume().expect("a volume"), other.volume().expect("a volume")];
    assert!((volumes[0] / volumes[1] - 1.0).abs() < 1e-6, "{volumes:?}");
    assert_eq!(one.tetrahedra.len(), other.tetrahedra.len());
}

/// Where two balls that cross are as thin as the spacing, and in an organ: nothing hangs on by an edge or a corner alone, so each can be cut.
#[test]
fn what_is_filled_can_be_cut_at_each_spacing() {
    let organ = Mesh::organ(0.12, 0.006).expect("an organ");
    let mut balls = ball(0.03, 3);
    for offset in [vec3(0.0585, 0.0, 0.0), vec3(0.03, 0.0497, 0.003)] {
        let first = balls.positions.len() as u32;
        let other = ball(0.03, 3);
        balls
            .positions
            .extend(other.positions.iter().map(|place| *place + offset));
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
