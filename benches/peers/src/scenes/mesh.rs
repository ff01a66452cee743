//! Blocks of cubes that are cut in five tetrahedra each.

use std::collections::HashMap;

/// Positions and tetrahedra of a block.
pub struct Block {
    pub positions: Vec<[f64; 3]>,
    pub tetrahedra: Vec<[usize; 4]>,
}

/// The corner of a block of so many cubes along each axis is at the origin.
pub fn block(cells: [usize; 3], edge: f64) -> Block {
    let [nx, ny, nz] = cells.map(|count| count + 1);
    let node = |x: usize, y: usize, z: usize| (z * ny + y) * nx + x;
    let mut positions = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                positions.push([x, y, z].map(|place| place as f64 * edge));
            }
        }
    }
    let mut tetrahedra = Vec::new();
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                // Neighbours are mirror images, so that diagonals of faces meet.
                let is_odd = (x + y + z) % 2 == 1;
                let corner = |bits: usize| {
                    let along = if is_odd { 1 - (bits & 1) } else { bits & 1 };
                    node(x + along, y + (bits >> 1 & 1), z + (bits >> 2))
                };
                for [a, b, c, d] in [[0, 1, 2, 4], [3, 2, 1, 7], [5, 1, 4, 7], [6, 4, 2, 7], [1, 2, 4, 7]] {
                    let [a, b, c, d] = [corner(a), corner(b), corner(c), corner(d)];
                    tetrahedra.push(if is_odd { [a, c, b, d] } else { [a, b, c, d] });
                }
            }
        }
    }
    Block { positions, tetrahedra }
}

/// The faces of tetrahedra that no other shares, their fronts outside.
pub fn surface(tetrahedra: &[[usize; 4]]) -> Vec<[usize; 3]> {
    let faces = |&[a, b, c, d]: &[usize; 4]| [[a, c, b], [a, b, d], [b, c, d], [a, d, c]];
    let sorted = |mut face: [usize; 3]| {
        face.sort_unstable();
        face
    };
    let mut uses: HashMap<[usize; 3], usize> = HashMap::new();
    for face in tetrahedra.iter().flat_map(faces) {
        *uses.entry(sorted(face)).or_default() += 1;
    }
    let all = tetrahedra.iter().flat_map(faces);
    all.filter(|&face| uses[&sorted(face)] == 1).collect()
}

/// The nodes of which something is true.
pub fn nodes(positions: &[[f64; 3]], is_one: impl Fn([f64; 3]) -> bool) -> Vec<usize> {
    (0..positions.len()).filter(|&node| is_one(positions[node])).collect()
}
