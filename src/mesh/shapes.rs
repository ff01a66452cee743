//! Regular shapes: a cloth, a block and a lattice.

use glam::Vec3;

use super::repair::NO_NODE;
use super::{Mesh, boundary, cell_boundary};
use crate::base::{above_zero, ensure, memory};
use crate::{Error, Result};

/// The tetrahedra of a cell, by its corners x + 2 y + 4 z: one in the middle and four at corners. Cells that share a
/// face use opposite patterns, so that the diagonals match.
pub(super) const EVEN_CELL: [[usize; 4]; 5] = [[0, 3, 6, 5], [1, 0, 5, 3], [2, 0, 3, 6], [4, 0, 6, 5], [7, 3, 5, 6]];
const ODD_CELL: [[usize; 4]; 5] = [[1, 2, 4, 7], [0, 1, 2, 4], [3, 1, 7, 2], [5, 1, 4, 7], [6, 2, 7, 4]];

impl Mesh {
    /// A rectangle in the plane y = 0, centered at the origin and facing up (+y). `size` is its extent along x and z,
    /// above 0, m; `cells` is the number of cells along each. Nodes have the indices `x + z (cells[0] + 1)`. Each cell
    /// has two triangles, with alternating diagonals so that no direction is preferred.
    ///
    /// Errors: [`Error::InvalidArgument`] if a size is not finite and above 0, a number of cells is 0, `u32` cannot
    /// count the nodes, or cells are so small that nodes would coincide; [`Error::OutOfMemory`].
    pub fn cloth(size: [f32; 2], cells: [u32; 2]) -> Result<Mesh> {
        check_node_count(&cells)?;
        let xs = axis("x", f64::from(size[0]), cells[0])?;
        let zs = axis("z", f64::from(size[1]), cells[1])?;
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

    /// A box centered at the origin. `size` is its extent along x, y and z, above 0, m; `cells` is the number of cells
    /// along each. Nodes have the indices `x + (cells[0] + 1) (y + (cells[1] + 1) z)`. Each cell has five tetrahedra,
    /// in opposite patterns in neighboring cells. The surface is in `triangles`.
    ///
    /// Errors: those of [`Mesh::cloth`].
    pub fn block(size: [f32; 3], cells: [u32; 3]) -> Result<Mesh> {
        check_node_count(&cells)?;
        let xs = axis("x", f64::from(size[0]), cells[0])?;
        let ys = axis("y", f64::from(size[1]), cells[1])?;
        let zs = axis("z", f64::from(size[2]), cells[2])?;
        let mut mesh = Mesh {
            positions: grid(&xs, &ys, &zs)?,
            ..Mesh::default()
        };
        for (cell, corners) in cells_of_grid(cells) {
            let pattern = if cell.iter().sum::<u32>() & 1 == 0 {
                &EVEN_CELL
            } else {
                &ODD_CELL
            };
            let tetrahedra = pattern
                .iter()
                .map(|tetrahedron| tetrahedron.map(|corner| corners[corner]));
            memory::extend(&mut mesh.tetrahedra, tetrahedra)?;
        }
        mesh.triangles = boundary(&mesh.tetrahedra)?;
        Ok(mesh)
    }

    /// A box of cubes, centered at the origin. `edge` is the edge length of a cube, above 0, m; `cells` is the number
    /// of cubes along x, y and z. Nodes are those of [`Mesh::block`]; the cubes are in `cells`, and the surface is in
    /// `triangles`.
    ///
    /// Errors: those of [`Mesh::cloth`].
    pub fn lattice(edge: f32, cells: [u32; 3]) -> Result<Mesh> {
        check_node_count(&cells)?;
        above_zero("edge", edge)?;
        let [xs, ys, zs] = [("x", 0), ("y", 1), ("z", 2)]
            .map(|(name, axis_index)| axis(name, f64::from(edge) * f64::from(cells[axis_index]), cells[axis_index]));
        let mut mesh = Mesh {
            positions: grid(&xs?, &ys?, &zs?)?,
            cells: memory::reserved(cells.iter().map(|&count| count as usize).product())?,
            ..Mesh::default()
        };
        mesh.cells.extend(cells_of_grid(cells).map(|(_, corners)| corners));
        mesh.triangles = cell_boundary(&mesh.cells)?;
        Ok(mesh)
    }
}

/// The nodes of a three-dimensional grid, x first.
fn grid(xs: &[f32], ys: &[f32], zs: &[f32]) -> Result<Vec<Vec3>> {
    let mut positions = memory::reserved(xs.len() * ys.len() * zs.len())?;
    for &z in zs {
        for &y in ys {
            positions.extend(xs.iter().map(|&x| Vec3::new(x, y, z)));
        }
    }
    Ok(positions)
}

/// The cells of a three-dimensional grid and their corners, x first.
fn cells_of_grid([nx, ny, nz]: [u32; 3]) -> impl Iterator<Item = ([u32; 3], [u32; 8])> {
    let row = nx + 1;
    let layer = row * (ny + 1);
    let [cells_per_row, cells_per_layer] = [nx as usize, nx as usize * ny as usize];
    (0..cells_per_layer * nz as usize).map(move |cell| {
        let [x, y, z] = [
            cell % cells_per_row,
            cell % cells_per_layer / cells_per_row,
            cell / cells_per_layer,
        ]
        .map(|index| index as u32);
        let first = x + y * row + z * layer;
        let corner = |bits: u32| first + (bits & 1) + (bits >> 1 & 1) * row + (bits >> 2) * layer;
        ([x, y, z], std::array::from_fn(|bits| corner(bits as u32)))
    })
}

/// Returns an error if `u32` cannot count the nodes of a grid.
fn check_node_count(cells: &[u32]) -> Result<()> {
    let nodes = cells.iter().map(|&count| u128::from(count) + 1);
    let node_count: u128 = nodes.product();
    ensure!(
        node_count <= u128::from(NO_NODE),
        "cells {cells:?}: {node_count} nodes, at most {NO_NODE} are possible"
    );
    Ok(())
}

/// The coordinates of a grid's nodes along one axis, centered at 0.
fn axis(name: &str, size: f64, cells: u32) -> Result<Vec<f32>> {
    ensure!(cells != 0, "cells along {name} is 0: there must be at least 1");
    above_zero(&format!("size along {name}"), size as f32)?;
    let coincide = || {
        Error::invalid(format!(
            "cells along {name} is {cells} over {} m: nodes would coincide",
            size as f32
        ))
    };
    // `f32` cannot represent more evenly spaced values.
    ensure!(cells <= 1 << 25, coincide());
    let coordinates = (0..=cells).map(|i| ((f64::from(i) / f64::from(cells) - 0.5) * size) as f32);
    let coordinates = memory::collected_within(cells as usize + 1, coordinates)?;
    if coordinates.windows(2).any(|pair| pair[0] >= pair[1]) {
        return Err(coincide());
    }
    Ok(coordinates)
}
