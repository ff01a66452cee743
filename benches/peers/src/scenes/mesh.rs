//! Blocks of cubes with five tetrahedra each, and nets of springs.

use crate::cloth::Cloth;
use crate::precision::model::Model;

/// Positions and tetrahedra of a block.
pub struct Block {
    pub positions: Vec<[f64; 3]>,
    pub tetrahedra: Vec<[usize; 4]>,
}

/// A block of `cells` cubes along each axis, with a corner at the origin.
pub fn block(cells: [usize; 3], edge: f64) -> Block {
    let [nx, ny, nz] = cells.map(|count| count + 1);
    let node = |x: usize, y: usize, z: usize| (z * ny + y) * nx + x;
    let mut positions = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                positions.push([x, y, z].map(|coordinate| coordinate as f64 * edge));
            }
        }
    }
    let mut tetrahedra = Vec::new();
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                // Neighboring cubes are mirror images, so that the diagonals of shared faces match.
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

/// The surface of tetrahedra, facing outward.
pub fn surface(tetrahedra: &[[usize; 4]]) -> Vec<[usize; 3]> {
    let tetrahedra: Vec<[u32; 4]> = tetrahedra.iter().map(|nodes| nodes.map(|node| node as u32)).collect();
    let faces = sinew::mesh::boundary(&tetrahedra).expect("memory");
    faces.into_iter().map(|nodes| nodes.map(|node| node as usize)).collect()
}

/// A square net in the plane y = 0 with `side` nodes per side, of equal mass [kg], and springs to all 8 neighbors.
pub fn net(side: u32, spacing: f32, mass: f64) -> Model {
    let cloth = Cloth {
        spacing,
        ..Cloth::new(side)
    };
    let side = side as usize;
    let corners = (0..side - 1).flat_map(|row| (0..side - 1).map(move |column| row * side + column));
    Model {
        positions: cloth
            .positions()
            .map(|coordinates| coordinates.map(f64::from))
            .collect(),
        masses: vec![mass; side * side],
        springs: cloth.springs().map(|ends| ends.map(|end| end as usize)).collect(),
        triangles: corners
            .flat_map(|a| [[a, a + side, a + 1], [a + 1, a + side, a + side + 1]])
            .collect(),
        ..Model::default()
    }
}

/// The nodes that satisfy a predicate.
pub fn nodes(positions: &[[f64; 3]], is_one: impl Fn([f64; 3]) -> bool) -> Vec<usize> {
    (0..positions.len()).filter(|&node| is_one(positions[node])).collect()
}
