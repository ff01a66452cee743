//! Regular shapes: a cloth and a block.

use glam::Vec3;

use super::tidy::NO_NODE;
use super::{Mesh, boundary};
use crate::memory;
use crate::{Error, Result};

/// The tetrahedra of a cell, by its corners x + 2 y + 4 z: one in the middle and four at its corners. Cells that share a
/// face are cut in opposite ways, so that the diagonals meet.
const EVEN_CELL: [[usize; 4]; 5] = [[0, 3, 6, 5], [1, 0, 5, 3], [2, 0, 3, 6], [4, 0, 6, 5], [7, 3, 5, 6]];
const ODD_CELL: [[usize; 4]; 5] = [[1, 2, 4, 7], [0, 1, 2, 4], [3, 1, 7, 2], [5, 1, 4, 7], [6, 2, 7, 4]];

impl Mesh {
    /// A rectangle in the plane y = 0 about the origin, facing up (+y): `size` along x and z in metres, above 0, in
    /// `cells` along each. Node `x + z (cells[0] + 1)`; two triangles a cell, their diagonals alternating so that no
    /// direction is favoured.
    ///
    /// Errors: [`Error::InvalidArgument`] for a size that is not above 0 and finite, no cells, more than `u32` can count,
    /// or cells so small that their nodes would coincide; [`Error::OutOfMemory`].
    pub fn cloth(size: [f32; 2], cells: [u32; 2]) -> Result<Mesh> {
        check_node_count(&cells)?;
        let xs = axis("x", size[0], cells[0])?;
        let zs = axis("z", size[1], cells[1])?;
        let mut mesh = Mesh::default();
        mesh.positions.try_reserve_exact(xs.len() * zs.len())?;
        for &z in &zs {
            mesh.positions.extend(xs.iter().map(|&x| Vec3::new(x, 0.0, z)));
        }
        let row = xs.len() as u32;
        mesh.triangles.try_reserve_exact(2 * (xs.len() - 1) * (zs.len() - 1))?;
        for z in 0..cells[1] {
            for x in 0..cells[0] {
                let a = x + z * row;
                let [b, c, d] = [a + 1, a + row, a + row + 1];
                mesh.triangles.extend(if (x ^ z) & 1 == 0 {
                    [[a, d, b], [a, c, d]]
                } else {
                    [[a, c, b], [b, c, d]]
                });
            }
        }
        Ok(mesh)
    }

    /// A box about the origin: `size` along x, y and z in metres, above 0, in `cells` along each. Node
    /// `x + (cells[0] + 1) (y + (cells[1] + 1) z)`; five tetrahedra a cell, cut in opposite ways in neighbouring cells,
    /// and the surface as triangles.
    ///
    /// Errors: those of [`Mesh::cloth`].
    pub fn block(size: [f32; 3], cells: [u32; 3]) -> Result<Mesh> {
        check_node_count(&cells)?;
        let xs = axis("x", size[0], cells[0])?;
        let ys = axis("y", size[1], cells[1])?;
        let zs = axis("z", size[2], cells[2])?;
        let mut mesh = Mesh::default();
        mesh.positions.try_reserve_exact(xs.len() * ys.len() * zs.len())?;
        for &z in &zs {
            for &y in &ys {
                mesh.positions.extend(xs.iter().map(|&x| Vec3::new(x, y, z)));
            }
        }
        let row = xs.len() as u32;
        let layer = row * ys.len() as u32;
        for z in 0..cells[2] {
            for y in 0..cells[1] {
                for x in 0..cells[0] {
                    let first = x + y * row + z * layer;
                    let pattern = if (x ^ y ^ z) & 1 == 0 { &EVEN_CELL } else { &ODD_CELL };
                    for corners in pattern {
                        let tetrahedron = corners.map(|corner| {
                            let corner = corner as u32;
                            first + (corner & 1) + (corner >> 1 & 1) * row + (corner >> 2) * layer
                        });
                        memory::push(&mut mesh.tetrahedra, tetrahedron)?;
                    }
                }
            }
        }
        mesh.triangles = boundary(&mesh.tetrahedra)?;
        Ok(mesh)
    }
}

/// Refuses a grid whose nodes `u32` cannot count.
fn check_node_count(cells: &[u32]) -> Result<()> {
    let nodes = cells.iter().map(|&count| u128::from(count) + 1);
    let node_count: u128 = nodes.product();
    if node_count > u128::from(NO_NODE) {
        return Err(Error::invalid(format!(
            "cells {cells:?}: {node_count} nodes, at most {NO_NODE} are possible"
        )));
    }
    Ok(())
}

/// The places of a grid's nodes along one axis, about 0.
fn axis(name: &str, size: f32, cells: u32) -> Result<Vec<f32>> {
    if !(size.is_finite() && size > 0.0) {
        return Err(Error::invalid(format!(
            "size along {name} is {size} m: it must be finite and above 0"
        )));
    }
    if cells == 0 {
        return Err(Error::invalid(format!(
            "cells along {name} is 0: there must be at least 1"
        )));
    }
    let coincide = || {
        Error::invalid(format!(
            "cells along {name} is {cells} over {size} m: nodes would coincide"
        ))
    };
    // f32 has no more evenly spaced values than that; no need to try.
    if cells > 1 << 25 {
        return Err(coincide());
    }
    let mut places = memory::reserved(cells as usize + 1)?;
    places.extend((0..=cells).map(|i| {
        let share = f64::from(i) / f64::from(cells) - 0.5;
        (share * f64::from(size)) as f32
    }));
    if places.windows(2).any(|pair| pair[0] >= pair[1]) {
        return Err(coincide());
    }
    Ok(places)
}
