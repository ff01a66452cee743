//! Takes away tetrahedra that hang on others by an edge or a corner alone: tissue would turn about them as about a hinge, and cannot be cut there.

use super::topology::{FACES, sorted_faces};
use crate::base::{DisjointSets, Result, memory};

/// Leaves of the tetrahedra about each node the most that hang together by faces there, until all do.
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
    let mut fans = DisjointSets::new(corners)?;
    let corner_of = |index: usize, node: u32| {
        let place = tetrahedra[index].iter().position(|&corner| corner == node);
        4 * index + place.expect("a face has corners of its tetrahedron")
    };
    for pair in sorted_faces(tetrahedra, &FACES)?
        .windows(2)
        .filter(|pair| pair[0].0 == pair[1].0)
    {
        for node in pair[0].0 {
            let [one, other] = [pair[0].1, pair[1].1].map(|face| corner_of(face / FACES.len(), node));
            fans.unite(one, other);
        }
    }
    let fans = fans.into_lowest();
    let mut sizes: Vec<u32> = memory::filled(0, corners)?;
    for &fan in &fans {
        sizes[fan as usize] += 1;
    }
    // The largest fan of each node, and of equal ones the first.
    let mut largest: Vec<u32> = memory::filled(u32::MAX, node_count)?;
    for (corner, &node) in (0..).zip(tetrahedra.as_flattened()) {
        let kept = &mut largest[node as usize];
        if *kept == u32::MAX || sizes[corner] > sizes[*kept as usize] {
            *kept = corner as u32;
        }
    }
    let mut fans = fans.chunks_exact(4);
    tetrahedra.retain(|tetrahedron| {
        let fans = fans.next().unwrap_or_default();
        fans.iter()
            .zip(tetrahedron)
            .all(|(&fan, &node)| fan == largest[node as usize])
    });
    Ok(())
}
