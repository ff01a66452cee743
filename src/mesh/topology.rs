//! Edges and surfaces, found by sorting: near-linear, and the same result on every run.

use crate::Result;
use crate::memory;

/// The corners of a tetrahedron's faces; outward if its volume is positive.
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// Every edge of the triangles and tetrahedra once, the lower node first, in ascending order. An element that repeats a
/// node has no edge there.
///
/// Errors: [`Error::OutOfMemory`](crate::Error::OutOfMemory).
pub fn edges(triangles: &[[u32; 3]], tetrahedra: &[[u32; 4]]) -> Result<Vec<[u32; 2]>> {
    let mut packed = memory::reserved(triangles.len() * 3 + tetrahedra.len() * 6)?;
    for &[a, b, c] in triangles {
        packed.extend([pack(a, b), pack(b, c), pack(c, a)]);
    }
    for &[a, b, c, d] in tetrahedra {
        packed.extend([pack(a, b), pack(a, c), pack(a, d)]);
        packed.extend([pack(b, c), pack(b, d), pack(c, d)]);
    }
    packed.sort_unstable();
    packed.dedup();

    let mut edges = memory::reserved(packed.len())?;
    let unpacked = packed.iter().map(|&edge| [(edge >> 32) as u32, edge as u32]);
    edges.extend(unpacked.filter(|[a, b]| a != b));
    Ok(edges)
}

/// The surface of the tetrahedra: the faces that exactly one of them has, in the order of the tetrahedra; outward where
/// these have positive volume. Interfaces between tetrahedra and faces of more than two are not part of it.
///
/// Errors: [`Error::OutOfMemory`](crate::Error::OutOfMemory).
pub fn boundary(tetrahedra: &[[u32; 4]]) -> Result<Vec<[u32; 3]>> {
    let mut faces = memory::reserved(tetrahedra.len() * 4)?;
    for (i, tetrahedron) in tetrahedra.iter().enumerate() {
        for (k, corners) in FACES.iter().enumerate() {
            faces.push((sorted(corners.map(|corner| tetrahedron[corner])), i * 4 + k));
        }
    }
    faces.sort_unstable();

    let mut once = Vec::new();
    for same in faces.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, face)] = same {
            memory::push(&mut once, *face)?;
        }
    }
    once.sort_unstable();

    let mut surface = memory::reserved(once.len())?;
    surface.extend(
        once.iter()
            .map(|face| FACES[face % 4].map(|corner| tetrahedra[face / 4][corner])),
    );
    Ok(surface)
}

/// Whether the triangles enclose a volume without a gap: every edge is used equally often in both directions. No
/// triangles at all enclose nothing.
///
/// Errors: [`Error::OutOfMemory`](crate::Error::OutOfMemory).
pub fn is_closed(triangles: &[[u32; 3]]) -> Result<bool> {
    let mut there = Vec::new();
    let mut back = Vec::new();
    there.try_reserve_exact(triangles.len() * 3)?;
    back.try_reserve_exact(triangles.len() * 3)?;
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            there.push((from, to));
            back.push((to, from));
        }
    }
    there.sort_unstable();
    back.sort_unstable();
    Ok(!triangles.is_empty() && there == back)
}

/// The nodes in ascending order: the same for every orientation of an element.
pub(super) fn sorted<const N: usize>(mut nodes: [u32; N]) -> [u32; N] {
    nodes.sort_unstable();
    nodes
}

/// An edge as one number that sorts by its lower node, then its higher.
fn pack(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}
