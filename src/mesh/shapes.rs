//! Regular shapes: a cloth, a block and a lattice.

use glam::Vec3;

use super::tidy::NO_NODE;
use super::{Mesh, boundary, cell_boundary};
use crate::base::{above_zero, ensure, memory};
use crate::{Error, Result};

/// The tetrahedra of a cell, by its corners x + 2 y + 4 z: one in the middle and four at its corners. Cells that share a
/// face are cut in opposite ways, so that the diagonals meet.
pub(super) const EVEN_CELL: [[usize; 4]; 5] = [[0, 3, 6, 5], [1, 0, 5, 3], [2, 0, 3, 6], [4, 0, 6, 5], [7, 3, 5, 6]];
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

    /// A box about the origin: `size` along x, y and z in metres, above 0, in `cells` along each. Node
    /// `x + (cells[0] + 1) (y + (cells[1] + 1) z)`; five tetrahedra a cell, cut in opposite ways in neighbouring cells,
    /// and the surface as triangles.
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

    /// A box about the origin of cubes: `edge` is the length of theirs in metres, above 0, `cells` their number along x, y
    /// and z. Nodes as in [`Mesh::block`]; the cubes are in `cells`, and the surface is there as triangles too.
    ///
    /// Errors: those of [`Mesh::cloth`].
    pub fn lattice(edge: f32, cells: [u32; 3]) -> Result<Mesh> {
        check_node_count(&cells)?;
        above_zero("edge", edge)?;
        let [xs, ys, zs] = [("x", 0), ("y", 1), ("z", 2)]
            .map(|(name, along)| axis(name, f64::from(edge) * f64::from(cells[along]), cells[along]));
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

/// The nodes of a grid in three dimensions, x first.
fn grid(xs: &[f32], ys: &[f32], zs: &[f32]) -> Result<Vec<Vec3>> {
    let mut positions = memory::reserved(xs.len() * ys.len() * zs.len())?;
    for &z in zs {
        for &y in ys {
            positions.extend(xs.iter().map(|&x| Vec3::new(x, y, z)));
        }
    }
    Ok(positions)
}

/// The cells of a grid in three dimensions and their corners, x first.
fn cells_of_grid([nx, ny, nz]: [u32; 3]) -> impl Iterator<Item = ([u32; 3], [u32; 8])> {
    let row = nx + 1;
    let layer = row * (ny + 1);
    let [across, area] = [nx as usize, nx as usize * ny as usize];
    (0..area * nz as usize).map(move |cell| {
        let [x, y, z] = [cell % across, cell % area / across, cell / area].map(|place| place as u32);
        let first = x + y * row + z * layer;
        let corner = |bits: u32| first + (bits & 1) + (bits >> 1 & 1) * row + (bits >> 2) * layer;
        ([x, y, z], std::array::from_fn(|bits| corner(bits as u32)))
    })
}

/// Refuses a grid whose nodes `u32` cannot count.
fn check_node_count(cells: &[u32]) -> Result<()> {
    let nodes = cells.iter().map(|&count| u128::from(count) + 1);
    let node_count: u128 = nodes.product();
    ensure!(
        node_count <= u128::from(NO_NODE),
        "cells {cells:?}: {node_count} nodes, at most {NO_NODE} are possible"
    );
    Ok(())
}

/// The places of a grid's nodes along one axis, about 0.
fn axis(name: &str, size: f64, cells: u32) -> Result<Vec<f32>> {
    ensure!(cells != 0, "cells along {name} is 0: there must be at least 1");
    above_zero(&format!("size along {name}"), size as f32)?;
    let coincide = || {
        Error::invalid(format!(
            "cells along {name} is {cells} over {} m: nodes would coincide",
            size as f32
        ))
    };
    // f32 has no more evenly spaced values than that; no need to try.
    ensure!(cells <= 1 << 25, coincide());
    let places = (0..=cells).map(|i| ((f64::from(i) / f64::from(cells) - 0.5) * size) as f32);
    let places = memory::collected_within(cells as usize + 1, places)?;
    if places.windows(2).any(|pair| pair[0] >= pair[1]) {
        return Err(coincide());
    }
    Ok(places)
}
