//! Takes away tetrahedra that hang on others by an edge or a corner alone: tissue would turn about them as about a hinge, and cannot be cut there.

use super::closed::root;
use super::topology::FACES;
use crate::Result;
use crate::base::memory;

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
    let mut fans: Vec<u32> = memory::reserved(corners)?;
    fans.extend(0..corners as u32);
    let mut faces: Vec<([u32; 3], u32)> = memory::reserved(corners)?;
    for (index, tetrahedron) in (0..).zip(tetrahedra.iter()) {
        for face in FACES {
            let mut nodes = face.map(|corner| tetrahedron[corner]);
            nodes.sort_unstable();
            faces.push((nodes, index));
        }
    }
    faces.sort_unstable();
    let corner_of = |index: u32, node: u32| {
        let place = tetrahedra[index as usize].iter().position(|&corner| corner == node);
        4 * index + place.expect("a face has corners of its tetrahedron") as u32
    };
    for pair in faces.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        for node in pair[0].0 {
            let [one, other] = [pair[0].1, pair[1].1].map(|index| root(&mut fans, corner_of(index, node)));
            fans[one.max(other) as usize] = one.min(other);
        }
    }
    let mut sizes: Vec<u32> = memory::filled(0, corners)?;
    for corner in 0..corners as u32 {
        sizes[root(&mut fans, corner) as usize] += 1;
    }
    // The largest fan of each node, and of equal ones the first.
    let mut largest: Vec<u32> = memory::filled(u32::MAX, node_count)?;
    for (corner, &node) in (0..).zip(tetrahedra.as_flattened()) {
        let kept = &mut largest[node as usize];
        if *kept == u32::MAX || sizes[corner] > sizes[*kept as usize] {
            *kept = corner as u32;
        }
    }
    let mut corner = 0..;
    tetrahedra.retain(|tetrahedron| {
        let mut own = corner.by_ref().take(4);
        tetrahedron.iter().fold(true, |hangs, &node| {
            let corner = own.next().unwrap_or_default();
            hangs & (root(&mut fans, corner) == largest[node as usize])
        })
    });
    Ok(())
}
