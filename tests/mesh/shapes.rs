//! Edges and surfaces, cleaning, and generated shapes.
#![allow(clippy::unwrap_used)]

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use sinew::Error;
use sinew::mesh::{LoadedMesh, Mesh, NO_NODE, boundary, edges, is_closed, tidy};

const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

fn unit_points() -> Vec<Vec3> {
    vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]
}

fn position_of(mesh: &Mesh, node: u32) -> DVec3 {
    mesh.positions[node as usize].as_dvec3()
}

/// Returns the Euler characteristic of a surface: vertices - edges + faces. It is 2 for a ball and 1 for a disc.
fn euler(triangles: &[[u32; 3]]) -> i64 {
    let mut nodes: Vec<u32> = triangles.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes.len() as i64 - edges(triangles, &[]).unwrap().len() as i64 + triangles.len() as i64
}

/// Checks that every edge has exactly two triangles, and that the triangles around a node form a single cycle.
fn check_manifold(triangles: &[[u32; 3]]) {
    let mut next = HashMap::new();
    for &[a, b, c] in triangles {
        for (node, from, to) in [(a, b, c), (b, c, a), (c, a, b)] {
            assert_eq!(
                next.insert((node, from), to),
                None,
                "an edge of more than two triangles"
            );
        }
    }
    let mut degrees: HashMap<u32, usize> = HashMap::new();
    for &node in triangles.iter().flatten() {
        *degrees.entry(node).or_default() += 1;
    }
    for &[node, start, _] in triangles {
        let mut at = start;
        for step in 1..=degrees[&node] {
            at = next[&(node, at)];
            assert_eq!(at == start, step == degrees[&node], "node {node} is no disc");
        }
    }
}

fn check_volumes(mesh: &Mesh) {
    for &[a, b, c, d] in &mesh.tetrahedra {
        let [a, b, c, d] = [a, b, c, d].map(|node| position_of(mesh, node));
        assert!((b - a).cross(c - a).dot(d - a) > 0.0);
    }
}

/// Returns the smallest and the largest dihedral angle (degrees).
fn dihedral_angles(mesh: &Mesh) -> (f64, f64) {
    let mut range = (180.0f64, 0.0f64);
    for t in &mesh.tetrahedra {
        for [i, j, k, l] in [
            [0, 1, 2, 3],
            [0, 2, 1, 3],
            [0, 3, 1, 2],
            [1, 2, 0, 3],
            [1, 3, 0, 2],
            [2, 3, 0, 1],
        ] {
            let [i, j, k, l] = [i, j, k, l].map(|corner: usize| position_of(mesh, t[corner]));
            let angle = (j - i).cross(k - i).angle_between((j - i).cross(l - i)).to_degrees();
            range = (range.0.min(angle), range.1.max(angle));
        }
    }
    range
}

#[test]
fn edges_are_listed_once() {
    assert_eq!(edges(&[], &[]).unwrap(), Vec::<[u32; 2]>::new());
    let expected = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
    assert_eq!(edges(&TETRAHEDRON, &[]).unwrap(), expected);
    assert_eq!(edges(&TETRAHEDRON, &[[3, 1, 0, 2]]).unwrap(), expected);
    let last = u32::MAX;
    assert_eq!(edges(&[[last, 0, last]], &[]).unwrap(), [[0, last]]);
}

#[test]
fn the_boundary_excludes_inner_faces() {
    assert!(boundary(&[]).unwrap().is_empty());
    // Two tetrahedra on both sides of 1 2 3.
    let surface = boundary(&[[0, 1, 2, 3], [4, 1, 3, 2]]).unwrap();
    assert_eq!(surface.len(), 6);
    assert!(is_closed(&surface).unwrap());
    assert_eq!(euler(&surface), 2);
    // The same tetrahedron twice has no boundary face.
    assert!(boundary(&[[0, 1, 2, 3], [3, 2, 1, 0]]).unwrap().is_empty());
    let mesh = Mesh {
        positions: unit_points(),
        triangles: boundary(&[[0, 1, 2, 3]]).unwrap(),
        tetrahedra: vec![],
        ..Mesh::default()
    };
    assert!((mesh.volume().unwrap() - 1.0 / 6.0).abs() < 1e-12);
}

#[test]
fn closed_and_open_surfaces() {
    assert!(!is_closed(&[]).unwrap());
    assert!(!is_closed(&[[0, 1, 2]]).unwrap());
    assert!(is_closed(&[[0, 1, 2], [0, 2, 1]]).unwrap());
    assert!(is_closed(&TETRAHEDRON).unwrap());
    for missing in 0..4 {
        let mut open = TETRAHEDRON.to_vec();
        open.remove(missing);
        assert!(!is_closed(&open).unwrap());
        let mut flipped = TETRAHEDRON;
        flipped[missing].swap(0, 1);
        assert!(!is_closed(&flipped).unwrap());
    }
}

#[test]
fn volumes_are_signed_and_accurate_far_from_the_origin() {
    let mut mesh = Mesh {
        positions: unit_points(),
        triangles: TETRAHEDRON.to_vec(),
        tetrahedra: vec![],
        ..Mesh::default()
    };
    assert!((mesh.volume().unwrap() - 1.0 / 6.0).abs() < 1e-12);
    for position in &mut mesh.positions {
        *position += Vec3::splat(1024.0);
    }
    assert!((mesh.volume().unwrap() - 1.0 / 6.0).abs() < 1e-12);
    mesh.tetrahedra = vec![[0, 1, 3, 2]];
    assert!((mesh.volume().unwrap() + 1.0 / 6.0).abs() < 1e-12);
    mesh.tetrahedra = vec![[0, 1, 3, 4]];
    assert!(matches!(mesh.volume(), Err(Error::InvalidArgument(_))));
}

#[test]
fn tidy_counts_what_it_does() {
    let mut positions = unit_points();
    positions.push(Vec3::new(7.0, 7.0, 7.0)); // 4: unused
    positions.push(Vec3::new(1.0, 1e-7, 0.0)); // 5: the same as 1
    positions.push(Vec3::new(1.0, 1e-3, 0.0)); // 6: not the same as 1
    positions.push(Vec3::new(0.5, 0.5, -0.5)); // 7: used only by a triangle that collapses
    let mesh = Mesh {
        positions,
        triangles: vec![
            [0, 1, 2], // on the surface, facing inward
            [2, 0, 5], // the same again
            [0, 3, 2], // on the surface, facing outward
            [0, 2, 3], // and its reverse
            [7, 1, 5], // collapses
            [0, 6, 2], // a separate sheet ...
            [2, 6, 0], // ... and its reverse
            [6, 2, 0], // the sheet again
        ],
        tetrahedra: vec![
            [0, 1, 3, 2], // inverted
            [3, 2, 5, 0], // the same again
            [0, 1, 2, 5], // collapses
            [0, 6, 2, 1], // flat
        ],
        ..Mesh::default()
    };
    let LoadedMesh {
        mesh,
        node_of_vertex,
        report,
    } = tidy(&mesh).unwrap();
    assert_eq!(node_of_vertex, [0, 1, 2, 3, NO_NODE, 1, 4, NO_NODE]);
    assert_eq!((report.welded_vertices, report.dropped_vertices), (1, 2));
    assert_eq!((report.collapsed_tetrahedra, report.doubled_tetrahedra), (1, 1));
    assert_eq!((report.flipped_tetrahedra, report.flat_tetrahedra), (1, 1));
    assert_eq!(report.dropped_tetrahedra(), 2);
    assert_eq!(mesh.tetrahedra.len(), 2);
    assert!((mesh.volume().unwrap() - 1.0 / 6.0).abs() < 1e-12);
    assert_eq!(report.collapsed_triangles, 1);
    assert_eq!(mesh.triangles.len() + report.dropped_triangles(), 8);
    // A second run changes nothing.
    let repeated = tidy(&mesh).unwrap();
    assert_eq!(repeated.mesh, mesh);
    assert_eq!(
        repeated.report.dropped_triangles() + repeated.report.flipped_tetrahedra,
        0
    );
}

#[test]
fn triangles_on_tetrahedra_face_outward() {
    let mut triangles = TETRAHEDRON.to_vec();
    triangles[1].swap(0, 1); // inward
    triangles.push([2, 1, 3]); // the reverse of an outward one
    triangles.push([1, 2, 0]); // and of another one
    let mesh = Mesh {
        positions: unit_points(),
        triangles,
        tetrahedra: vec![[0, 1, 2, 3]],
        ..Mesh::default()
    };
    let cleaned = tidy(&mesh).unwrap();
    assert_eq!(
        (cleaned.report.turned_triangles, cleaned.report.doubled_triangles),
        (1, 2)
    );
    assert_eq!(cleaned.mesh.triangles.len(), 4);
    assert!(is_closed(&cleaned.mesh.triangles).unwrap());
    let surface = Mesh {
        tetrahedra: vec![],
        ..cleaned.mesh
    };
    assert!(surface.volume().unwrap() > 0.0);
}

/// Compares welding with a comparison of all pairs, for points at about the limit distance across every border of the
/// grid.
#[test]
fn welding_agrees_with_comparing_all_pairs() {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / (1 << 24) as f32
    };
    // A box with a diagonal of 1000 m has a limit of 1 mm. The other points lie within 20 mm of the origin, where f32
    // is accurate.
    let half = 500.0 / 3f32.sqrt();
    let mut positions = vec![Vec3::splat(-half), Vec3::splat(half), Vec3::new(half, -half, half)];
    positions.extend((0..3000).map(|_| Vec3::new(random(), random(), random()) * 0.02 - 0.01));
    let limit = 1e-6 * (positions[1] - positions[0]).as_dvec3().length();
    let count = positions.len() as u32;
    let triangles = (0..count / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let cleaned = tidy(&Mesh {
        positions: positions.clone(),
        triangles,
        tetrahedra: vec![],
        ..Mesh::default()
    })
    .unwrap();

    let mut first: Vec<usize> = Vec::new();
    for (i, a) in positions.iter().enumerate() {
        let near = (0..i).find(|&j| first[j] == j && a.as_dvec3().distance(positions[j].as_dvec3()) <= limit);
        first.push(near.unwrap_or(i));
    }
    assert!(first.iter().enumerate().filter(|&(i, &f)| f < i).count() > 300);
    for (i, &f) in first.iter().enumerate() {
        assert_eq!(cleaned.node_of_vertex[i], cleaned.node_of_vertex[f]);
        let node = cleaned.node_of_vertex[i];
        if node != NO_NODE {
            assert_eq!(cleaned.mesh.positions[node as usize], positions[f]);
        }
    }
}

#[test]
fn tidy_refuses_invalid_meshes() {
    let mut mesh = Mesh {
        positions: unit_points(),
        triangles: vec![[0, 1, 4]],
        tetrahedra: vec![],
        ..Mesh::default()
    };
    assert!(matches!(tidy(&mesh), Err(Error::InvalidArgument(m)) if m.contains("node 4")));
    mesh.triangles = vec![[0, 1, 2]];
    mesh.positions[3].y = f32::NAN;
    assert!(matches!(tidy(&mesh), Err(Error::InvalidArgument(m)) if m.contains("node 3")));
    assert!(LoadedMesh::unchanged(mesh).is_err());
    assert_eq!(tidy(&Mesh::default()).unwrap(), LoadedMesh::default());
    let same = LoadedMesh::unchanged(Mesh::cloth([1.0, 1.0], [1, 1]).unwrap()).unwrap();
    assert_eq!(same.node_of_vertex, [0, 1, 2, 3]);
    let lattice = Mesh::lattice(1.0, [1, 1, 1]).unwrap();
    assert!(matches!(tidy(&lattice), Err(Error::InvalidArgument(m)) if m.contains("cells")));
}

#[test]
fn a_cloth_is_a_flat_rectangle() {
    for cells in [[1, 1], [3, 2], [8, 8], [1, 5]] {
        let cloth = Mesh::cloth([0.3, 0.5], cells).unwrap();
        let [x, z] = cells.map(|count| count as usize);
        assert_eq!(cloth.positions.len(), (x + 1) * (z + 1));
        assert_eq!(cloth.triangles.len(), 2 * x * z);
        assert_eq!(euler(&cloth.triangles), 1);
        assert!(!is_closed(&cloth.triangles).unwrap());
        // Edges along x, along z, and one diagonal per cell.
        assert_eq!(cloth.edges().unwrap().len(), x * (z + 1) + z * (x + 1) + x * z);
        let mut area = 0.0;
        for &t in &cloth.triangles {
            let [a, b, c] = t.map(|node| position_of(&cloth, node));
            let normal = (b - a).cross(c - a);
            assert!(normal.y > 0.0 && normal.x == 0.0 && normal.z == 0.0);
            area += normal.y / 2.0;
        }
        assert!((area / 0.15 - 1.0).abs() < 1e-6);
        assert_eq!(cloth.positions[0], Vec3::new(-0.15, 0.0, -0.25));
        assert_eq!(cloth.positions[x], Vec3::new(0.15, 0.0, -0.25));
        assert_eq!(cloth.positions[cloth.positions.len() - 1], Vec3::new(0.15, 0.0, 0.25));
    }
    // As many diagonals in one direction as in the other.
    let cloth = Mesh::cloth([1.0, 1.0], [4, 4]).unwrap();
    let diagonals: Vec<f64> = cloth
        .edges()
        .unwrap()
        .iter()
        .map(|&[a, b]| position_of(&cloth, b) - position_of(&cloth, a))
        .map(|d| d.x * d.z)
        .filter(|&product| product != 0.0)
        .collect();
    assert_eq!(diagonals.len(), 16);
    assert_eq!(diagonals.iter().sum::<f64>(), 0.0);
}

#[test]
fn a_block_is_filled_without_gaps() {
    for cells in [[1, 1, 1], [2, 3, 4], [5, 1, 2]] {
        let size = [0.2f32, 0.3, 0.5];
        let block = Mesh::block(size, cells).unwrap();
        let [x, y, z] = cells.map(|count| count as usize);
        assert_eq!(block.positions.len(), (x + 1) * (y + 1) * (z + 1));
        assert_eq!(block.tetrahedra.len(), 5 * x * y * z);
        // Two triangles on each outer square. Cells that do not fit together would leave more.
        assert_eq!(block.triangles.len(), 4 * (x * y + y * z + z * x));
        check_volumes(&block);
        check_manifold(&block.triangles);
        assert!(is_closed(&block.triangles).unwrap());
        assert_eq!(euler(&block.triangles), 2);
        assert!((block.volume().unwrap() / 0.03 - 1.0).abs() < 1e-6);
        let surface = Mesh {
            tetrahedra: vec![],
            ..block.clone()
        };
        assert!((surface.volume().unwrap() / 0.03 - 1.0).abs() < 1e-6);
        assert_eq!(block.positions[0], -Vec3::from(size) / 2.0);
        assert_eq!(block.positions[block.positions.len() - 1], Vec3::from(size) / 2.0);
        // The mesh is already clean.
        assert_eq!(tidy(&block).unwrap().mesh, block);
    }
}

/// Returns the volume of the organ shape, in cubes of half its length. Its sections are bent and shifted, which changes
/// no volume. So each section has the area half_height half_depth times an area that depends only on the remainder of
/// the equation at that x.
fn organ_volume() -> f64 {
    let blunt = |fraction: f64| (fraction.powi(2) + fraction.powi(4)) / 2.0;
    let steps = 2000;
    let middle = |i: usize| (i as f64 + 0.5) / steps as f64 * 2.0 - 1.0;
    let step = 2.0 / steps as f64;
    let mut volume = 0.0;
    for x in (0..steps).map(middle) {
        let left = 1.0 - blunt(x);
        let notch = 1.0 - 0.22 * (-((x - 0.35) / 0.18).powi(2)).exp();
        let sizes = 0.26 * (1.0 - 0.4 * x) * 0.56 * (1.0 - 0.25 * x) * notch;
        let heights = (0..400).map(|i| ((i as f64 + 0.5) / 200.0) - 1.0);
        let area: f64 = heights.map(|w| 2.0 * (left - blunt(w)).max(0.0).sqrt() / 200.0).sum();
        volume += sizes * area * step;
    }
    volume
}

#[test]
fn an_organ_is_sound_at_every_spacing() {
    check_an_organ_is_sound_at_every_spacing([8.0, 28.0]);
}

#[test]
#[ignore = "long"]
fn an_organ_is_sound_at_every_fine_spacing() {
    check_an_organ_is_sound_at_every_spacing([28.0, 42.0]);
}

fn check_an_organ_is_sound_at_every_spacing([from, to]: [f64; 2]) {
    let exact = organ_volume() * 0.1f64.powi(3);
    assert!(exact > PI * 1e-4 && exact < 1e-3, "{exact}");
    // 40 uneven fractions of the length from 1/8 on, to cover every position of the lattice.
    let ratios = std::iter::successors(Some(8.0), |ratio| Some(ratio * 1.043));
    for ratio in ratios.skip_while(|ratio| *ratio < from).take_while(|ratio| *ratio < to) {
        let spacing = (0.2 / ratio) as f32;
        let organ = Mesh::organ(0.2, spacing).unwrap();
        check_volumes(&organ);
        check_manifold(&organ.triangles);
        assert_eq!(euler(&organ.triangles), 2);
        assert_eq!(boundary(&organ.tetrahedra).unwrap(), organ.triangles);
        let (smallest, largest) = dihedral_angles(&organ);
        assert!(smallest > 10.0 && largest < 160.0, "{ratio}: {smallest} to {largest}");

        let low = organ.positions.iter().copied().reduce(Vec3::min).unwrap();
        let high = organ.positions.iter().copied().reduce(Vec3::max).unwrap();
        assert!((low + high).abs().max_element() < 1e-6, "not about the origin");
        let size = high - low;
        assert!((size.x - 0.2).abs() < 1e-6);
        assert!(size.x > 1.5 * size.z && size.z > 1.8 * size.y, "{size}");
        // Scaling to the full length compensates for the tip that the lattice misses, at most a few percent.
        let volume = organ.volume().unwrap();
        let error = (volume / exact - 1.0).abs();
        assert!(error < 25.0 / (ratio * ratio), "{ratio}: {error}");
        let edges = organ.edges().unwrap();
        let total: f64 = edges
            .iter()
            .map(|&[a, b]| position_of(&organ, a).distance(position_of(&organ, b)))
            .sum();
        let mean = total / edges.len() as f64 / f64::from(spacing);
        assert!((0.88..1.05).contains(&mean), "{ratio}: {mean}");
        // The thick lobe is on the left.
        let (left, right): (Vec<_>, Vec<_>) = organ.positions.iter().map(|p| p.x).partition(|&x| x < 0.0);
        assert!(left.len() > right.len());
    }
    assert_eq!(Mesh::organ(0.2, 0.02).unwrap(), Mesh::organ(0.2, 0.02).unwrap());
}

#[test]
fn parameters_out_of_range_are_refused() {
    let refused = |mesh: sinew::Result<Mesh>, name: &str| match mesh {
        Err(Error::InvalidArgument(message)) => assert!(message.contains(name), "{message}"),
        other => panic!("{name}: {other:?}"),
    };
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        refused(Mesh::cloth([bad, 1.0], [2, 2]), "size along x");
        refused(Mesh::cloth([1.0, bad], [2, 2]), "size along z");
        refused(Mesh::block([1.0, bad, 1.0], [2, 2, 2]), "size along y");
        refused(Mesh::lattice(bad, [2, 2, 2]), "edge");
        refused(Mesh::organ(bad, 0.01), "length");
        refused(Mesh::organ(0.2, bad), "spacing");
    }
    refused(Mesh::cloth([1.0, 1.0], [0, 2]), "cells along x");
    refused(Mesh::block([1.0, 1.0, 1.0], [2, 2, 0]), "cells along z");
    refused(Mesh::cloth([1.0, 1.0], [u32::MAX, u32::MAX]), "nodes");
    refused(Mesh::cloth([1.0, 1.0], [u32::MAX - 1, 1]), "nodes");
    refused(Mesh::cloth([1.0, 1.0], [2_000_000_000, 1]), "coincide");
    refused(Mesh::cloth([1e-45, 1.0], [2, 1]), "coincide");
    refused(Mesh::block([1.0, 1.0, 1.0], [2000, 2000, 2000]), "nodes");
    refused(Mesh::organ(0.2, 0.026), "spacing");
    refused(Mesh::organ(0.2, 1e-6), "spacing");
    refused(Mesh::organ(f32::MIN_POSITIVE, f32::MIN_POSITIVE / 10.0), "spacing");
    for mesh in [
        Mesh::block([3e38, 1e-30, 1.0], [2, 2, 2]).unwrap(),
        Mesh::organ(3e38, 3e37).unwrap(),
        Mesh::organ(1e-30, 1e-31).unwrap(),
    ] {
        check_volumes(&mesh);
    }
}
