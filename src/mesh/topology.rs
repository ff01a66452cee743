//! Edges and surfaces of meshes. They are found by sorting: nearly linear, with the same result in every run.

use glam::Vec3;

use super::tetrahedron_volume;
use crate::Result;
use crate::base::memory;

/// The corners of a tetrahedron's faces, outward if its volume is positive.
pub(super) const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// The corners of a cell's faces in order, outward, beginning with a corner that has an even number of bits set. Bits
/// are x 1, y 2, z 4.
const CELL_FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [3, 7, 5, 1],
    [0, 1, 5, 4],
    [6, 7, 3, 2],
    [0, 2, 3, 1],
    [5, 7, 6, 4],
];

/// The pairs of a tetrahedron's corners.
pub(crate) const TETRAHEDRON_EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// The pairs of a triangle's corners.
pub(crate) const TRIANGLE_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// The pairs of a cell's corners along an axis.
pub(crate) const CELL_EDGES: [[usize; 2]; 12] = pairs_apart(1);

/// The pairs of a cell's corners on a face diagonal.
pub(crate) const CELL_DIAGONALS: [[usize; 2]; 12] = pairs_apart(2);

/// The pairs of a cell's corners whose indices differ in this number of bits, 1 or 2.
const fn pairs_apart(bits: u32) -> [[usize; 2]; 12] {
    let mut pairs = [[0; 2]; 12];
    let (mut count, mut a) = (0, 0);
    while a < 8_usize {
        let mut b = a + 1;
        while b < 8 {
            if (a ^ b).count_ones() == bits {
                pairs[count] = [a, b];
                count += 1;
            }
            b += 1;
        }
        a += 1;
    }
    pairs
}

/// Every edge of the triangles and tetrahedra once, with its lower node first, in ascending order. An edge between
/// equal nodes is left out.
///
/// Errors: [`Error::OutOfMemory`](crate::Error::OutOfMemory).
pub fn edges(triangles: &[[u32; 3]], tetrahedra: &[[u32; 4]]) -> Result<Vec<[u32; 2]>> {
    element_edges(triangles, tetrahedra, &[])
}

/// Like [`edges`], with the edges and face diagonals of cells.
pub(crate) fn element_edges(
    triangles: &[[u32; 3]],
    tetrahedra: &[[u32; 4]],
    cells: &[[u32; 8]],
) -> Result<Vec<[u32; 2]>> {
    let mut packed = memory::reserved(triangles.len() * 3 + tetrahedra.len() * 6 + cells.len() * 24)?;
    for triangle in triangles {
        packed.extend(TRIANGLE_EDGES.map(|ends| pack(triangle, ends)));
    }
    for tetrahedron in tetrahedra {
        packed.extend(TETRAHEDRON_EDGES.map(|ends| pack(tetrahedron, ends)));
    }
    for cell in cells {
        packed.extend(CELL_EDGES.map(|ends| pack(cell, ends)));
        packed.extend(CELL_DIAGONALS.map(|ends| pack(cell, ends)));
    }
    memory::sort_once(&mut packed);

    let edges = packed.iter().map(|&edge| unpack(edge)).filter(|[a, b]| a != b);
    memory::collected_within(packed.len(), edges)
}

/// The surface of the tetrahedra: the faces of exactly one tetrahedron, in the order of the tetrahedra. They face
/// outward if volumes are positive. Faces of two or more tetrahedra are not part of it.
///
/// Errors: [`Error::OutOfMemory`](crate::Error::OutOfMemory).
pub fn boundary(tetrahedra: &[[u32; 4]]) -> Result<Vec<[u32; 3]>> {
    boundary_faces(tetrahedra, &FACES, |_| false)
}

/// The surface of the tetrahedra with nodes at `positions`, outward for either orientation of the tetrahedra.
pub(crate) fn outer_faces(positions: &[Vec3], tetrahedra: &[[u32; 4]]) -> Result<Vec<[u32; 3]>> {
    boundary_faces(tetrahedra, &FACES, |corners| {
        tetrahedron_volume(corners.map(|node| positions[node as usize].as_dvec3())) < 0.0
    })
}

/// Reverses the triangles that are faces in `outer`, which faces outward, but face inward. Returns their number.
pub(crate) fn turn_outward(triangles: &mut [[u32; 3]], mut outer: Vec<[u32; 3]>) -> usize {
    outer.iter_mut().for_each(|face| *face = smallest_first(*face));
    outer.sort_unstable();
    let mut count = 0;
    for triangle in triangles {
        let [a, b, c] = *triangle;
        if outer.binary_search(&smallest_first([a, c, b])).is_ok() {
            triangle.swap(1, 2);
            count += 1;
        }
    }
    count
}

/// The triangle rotated such that its smallest node is first.
pub(super) fn smallest_first(mut nodes: [u32; 3]) -> [u32; 3] {
    let smallest = (0..3).min_by_key(|&k| nodes[k]).unwrap_or(0);
    nodes.rotate_left(smallest);
    nodes
}

/// The surface of cells: their outer faces, in the order of the cells and facing outward. Each face has two triangles,
/// cut along the diagonal between corners with an even number of bits set.
pub(crate) fn cell_boundary(cells: &[[u32; 8]]) -> Result<Vec<[u32; 3]>> {
    let faces = boundary_faces(cells, &CELL_FACES, |_| false)?;
    let halves = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    memory::collected_within(faces.len() * 2, halves)
}

/// All faces of all elements, sorted by their sorted nodes, with their indices. Equal faces are adjacent.
pub(super) fn sorted_faces<const CORNERS: usize, const SIDES: usize, const FACES: usize>(
    elements: &[[u32; CORNERS]],
    sides: &[[usize; SIDES]; FACES],
) -> Result<Vec<([u32; SIDES], usize)>> {
    let mut faces = memory::reserved(elements.len() * FACES)?;
    for (i, element) in elements.iter().enumerate() {
        for (k, corners) in sides.iter().enumerate() {
            faces.push((sorted(corners.map(|corner| element[corner])), i * FACES + k));
        }
    }
    faces.sort_unstable();
    Ok(faces)
}

/// The faces of exactly one element, in the order of the elements. Faces of inverted elements are reversed.
fn boundary_faces<const CORNERS: usize, const SIDES: usize, const FACES: usize>(
    elements: &[[u32; CORNERS]],
    sides: &[[usize; SIDES]; FACES],
    is_inverted: impl Fn(&[u32; CORNERS]) -> bool,
) -> Result<Vec<[u32; SIDES]>> {
    let faces = sorted_faces(elements, sides)?;
    let single = faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1);
    let mut indices = memory::gathered(single.map(|same| same[0].1))?;
    indices.sort_unstable();

    memory::collected(indices.iter().map(|face| {
        let element = &elements[face / FACES];
        let mut nodes = sides[face % FACES].map(|corner| element[corner]);
        if is_inverted(element) {
            nodes.reverse();
        }
        nodes
    }))
}

/// True if the triangles enclose a volume without gaps, that is, every edge is used equally often in both directions.
/// False without triangles.
///
/// Errors: [`Error::OutOfMemory`](crate::Error::OutOfMemory).
pub fn is_closed(triangles: &[[u32; 3]]) -> Result<bool> {
    let mut forward = Vec::new();
    let mut backward = Vec::new();
    forward.try_reserve_exact(triangles.len() * 3)?;
    backward.try_reserve_exact(triangles.len() * 3)?;
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            forward.push((from, to));
            backward.push((to, from));
        }
    }
    forward.sort_unstable();
    backward.sort_unstable();
    Ok(!triangles.is_empty() && forward == backward)
}

/// The nodes in ascending order.
pub(super) fn sorted<const N: usize>(mut nodes: [u32; N]) -> [u32; N] {
    nodes.sort_unstable();
    nodes
}

/// The edge between two corners packed into one number. It sorts by the lower node, then the higher.
pub(crate) fn pack<const N: usize>(element: &[u32; N], ends: [usize; 2]) -> u64 {
    let [a, b] = ends.map(|corner| element[corner]);
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// The edges of a triangle, with the lower node first.
pub(crate) fn ends_of(triangle: [u32; 3]) -> [[u32; 2]; 3] {
    TRIANGLE_EDGES.map(|ends| unpack(pack(&triangle, ends)))
}

/// The nodes of a packed edge.
pub(crate) fn unpack(edge: u64) -> [u32; 2] {
    [(edge >> 32) as u32, edge as u32]
}
