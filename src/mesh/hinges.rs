//! Removal of tetrahedra attached to others only by an edge or a corner. Tissue would rotate about them as a hinge,
//! and cannot be cut there.

use super::topology::{FACES, sorted_faces};
use crate::base::{DisjointSets, Result, memory};

/// At each node, keeps the largest set of tetrahedra that is connected through faces at the node. Repeats until
/// nothing changes.
pub(super) fn remove_hinges(tetrahedra: &mut Vec<[u32; 4]>, node_count: usize) -> Result<()> {
    loop {
        let before = tetrahedra.len();
        remove_once(tetrahedra, node_count)?;
        if tetrahedra.len() == before {
            return Ok(());
        }
    }
}

fn remove_once(tetrahedra: &mut Vec<[u32; 4]>, node_count: usize) -> Result<()> {
    let corners = 4 * tetrahedra.len();
    let mut components = DisjointSets::new(corners)?;
    let corner_of = |index: usize, node: u32| {
        let corner_index = tetrahedra[index].iter().position(|&corner| corner == node);
        4 * index + corner_index.expect("a face has corners of its tetrahedron")
    };
    for pair in sorted_faces(tetrahedra, &FACES)?
        .windows(2)
        .filter(|pair| pair[0].0 == pair[1].0)
    {
        for node in pair[0].0 {
            let [one, other] = [pair[0].1, pair[1].1].map(|face| corner_of(face / FACES.len(), node));
            components.unite(one, other);
        }
    }
    let components = components.into_lowest();
    let mut sizes: Vec<u32> = memory::filled(0, corners)?;
    for &component in &components {
        sizes[component as usize] += 1;
    }
    // The largest set of each node; the first of equal ones.
    let mut largest: Vec<u32> = memory::filled(u32::MAX, node_count)?;
    for (corner, &node) in (0..).zip(tetrahedra.as_flattened()) {
        let best = &mut largest[node as usize];
        if *best == u32::MAX || sizes[corner] > sizes[*best as usize] {
            *best = corner as u32;
        }
    }
    let mut components = components.chunks_exact(4);
    tetrahedra.retain(|tetrahedron| {
        let components = components.next().unwrap_or_default();
        components
            .iter()
            .zip(tetrahedron)
            .all(|(&component, &node)| component == largest[node as usize])
    });
    Ok(())
}
