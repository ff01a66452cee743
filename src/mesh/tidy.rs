//! Real files are untidy: corners repeated, elements collapsed, doubled or inside out, points that nothing uses.

use std::collections::HashMap;

use glam::DVec3;

use super::topology::{boundary, smallest_first, sorted, turn_outward};
use super::{Mesh, tetrahedron_volume};
use crate::Result;
#[cfg(doc)]
use crate::base::Error;
use crate::base::{ensure, memory};

/// In [`LoadedMesh::node_of_vertex`]: the vertex was dropped.
pub const NO_NODE: u32 = u32::MAX;

/// Vertices nearer than this share of the diagonal of the box around the mesh are one node.
const WELD: f64 = 1e-6;

/// A tidy mesh, and what became of the vertices it was made from.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::mesh::{Mesh, tidy};
/// // Two triangles with a corner that is written twice.
/// let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::X, Vec3::Z, Vec3::X + Vec3::Z];
/// let loaded = tidy(&Mesh { positions, triangles: vec![[0, 2, 1], [3, 4, 5]], ..Mesh::default() })?;
/// assert_eq!(loaded.mesh.triangles, [[0, 2, 1], [1, 2, 3]]);
/// assert_eq!(loaded.node_of_vertex, [0, 1, 2, 1, 2, 3]);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadedMesh {
    /// Every node is used; no element repeats a node.
    pub mesh: Mesh,
    /// For each vertex of the file its node in the mesh, or [`NO_NODE`]. Nodes keep the order of their first vertices.
    pub node_of_vertex: Vec<u32>,
    /// What was changed.
    pub report: TidyReport,
}

/// What was changed to make a mesh tidy. `welded_vertices + dropped_vertices` and the nodes add up to the vertices.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::mesh::{Mesh, tidy};
/// // Nothing uses the last vertex, and a triangle is there twice.
/// let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::Y];
/// let report = tidy(&Mesh { positions, triangles: vec![[0, 2, 1], [2, 1, 0]], ..Mesh::default() })?.report;
/// assert_eq!((report.dropped_vertices, report.doubled_triangles), (1, 1));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TidyReport {
    /// Vertices that became one node with an earlier one.
    pub welded_vertices: usize,
    /// Vertices that no remaining triangle or tetrahedron uses.
    pub dropped_vertices: usize,
    /// Triangles dropped because two of their corners are one node.
    pub collapsed_triangles: usize,
    /// Triangles dropped because another has the same nodes in the same direction, or lies on the same face of the
    /// surface of the tetrahedra.
    pub doubled_triangles: usize,
    /// Triangles on the surface of the tetrahedra that faced inward and were turned.
    pub turned_triangles: usize,
    /// Tetrahedra dropped because two of their corners are one node.
    pub collapsed_tetrahedra: usize,
    /// Tetrahedra dropped because another has the same nodes.
    pub doubled_tetrahedra: usize,
    /// Tetrahedra that were inside out; two of their nodes were swapped.
    pub flipped_tetrahedra: usize,
    /// Tetrahedra that lie in a plane and have no volume although their nodes differ. They are kept.
    pub flat_tetrahedra: usize,
    /// Cells of the file that are points or lines: neither triangles nor tetrahedra, and not used.
    pub ignored_cells: usize,
}

impl TidyReport {
    /// Triangles that were dropped, collapsed or doubled.
    pub fn dropped_triangles(&self) -> usize {
        self.collapsed_triangles + self.doubled_triangles
    }

    /// Tetrahedra that were dropped, collapsed or doubled.
    pub fn dropped_tetrahedra(&self) -> usize {
        self.collapsed_tetrahedra + self.doubled_tetrahedra
    }
}

impl LoadedMesh {
    /// A mesh that needs no tidying, such as a generated shape: every vertex is its own node, nothing was changed.
    ///
    /// Errors: [`Error::InvalidArgument`] where [`Mesh::check`] gives it, [`Error::OutOfMemory`].
    pub fn unchanged(mesh: Mesh) -> Result<Self> {
        mesh.check()?;
        let node_of_vertex = memory::collected(0..mesh.positions.len() as u32)?;
        Ok(LoadedMesh {
            mesh,
            node_of_vertex,
            report: TidyReport::default(),
        })
    }
}

/// A mesh as tidy as a loaded one:
///
/// - vertices nearer than 1e-6 of the diagonal of the box around what is used become one node, at the place of the
///   first of them;
/// - triangles and tetrahedra that repeat a node are dropped. Thin ones, even flat ones, are kept;
/// - tetrahedra with the same nodes are kept once, and turned so that their volume is positive;
/// - triangles on the surface of the tetrahedra are turned outward and kept once. Other triangles are kept once for each
///   direction: two over the same nodes that face opposite ways are the two sides of a sheet or a wall, and dropping one
///   would open a closed surface;
/// - vertices that nothing uses are dropped.
///
/// Errors: [`Error::InvalidArgument`] where [`Mesh::check`] gives it, and where there are cells;
/// [`Error::OutOfMemory`].
pub fn tidy(mesh: &Mesh) -> Result<LoadedMesh> {
    mesh.check()?;
    ensure!(
        mesh.cells.is_empty(),
        "cells are given: only triangles and tetrahedra are tidied"
    );
    let mut raw = RawMesh::default();
    raw.vertices.try_reserve_exact(mesh.positions.len())?;
    raw.triangles.try_reserve_exact(mesh.triangles.len())?;
    raw.tetrahedra.try_reserve_exact(mesh.tetrahedra.len())?;
    raw.vertices.extend(mesh.positions.iter().map(|p| p.as_dvec3()));
    raw.triangles.extend_from_slice(&mesh.triangles);
    raw.tetrahedra.extend_from_slice(&mesh.tetrahedra);
    raw.tidy()
}

/// What stands in a file: vertices finite, in metres; every index below their number.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    pub vertices: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    pub tetrahedra: Vec<[u32; 4]>,
    pub ignored_cells: usize,
}

impl RawMesh {
    /// Adds a polygon as triangles, a fan about its first corner.
    pub fn add_polygon(&mut self, corners: &[u32]) -> Result<()> {
        if let [first, rest @ ..] = corners {
            let fan = rest.windows(2).map(|pair| [*first, pair[0], pair[1]]);
            memory::extend(&mut self.triangles, fan)?;
        }
        Ok(())
    }

    /// The tidy mesh, as [`tidy`] describes it.
    pub fn tidy(mut self) -> Result<LoadedMesh> {
        let mut report = TidyReport {
            ignored_cells: self.ignored_cells,
            ..TidyReport::default()
        };
        let first_of_vertex = weld(&self.vertices, &self.used()?)?;
        report.collapsed_triangles = rename(&mut self.triangles, &first_of_vertex);
        report.collapsed_tetrahedra = rename(&mut self.tetrahedra, &first_of_vertex);
        self.orient_tetrahedra(&mut report)?;
        self.orient_triangles(&mut report)?;

        // What only dropped elements used is used no longer.
        let used = self.used()?;
        let mut mesh = Mesh::default();
        let mut node_of_vertex = memory::filled(NO_NODE, self.vertices.len())?;
        for (vertex, &position) in self.vertices.iter().enumerate() {
            let first = first_of_vertex[vertex] as usize;
            if !used[first] {
                report.dropped_vertices += 1;
            } else if first < vertex {
                node_of_vertex[vertex] = node_of_vertex[first];
                report.welded_vertices += 1;
            } else {
                node_of_vertex[vertex] = mesh.positions.len() as u32;
                memory::push(&mut mesh.positions, position.as_vec3())?;
            }
        }
        rename(&mut self.triangles, &node_of_vertex);
        rename(&mut self.tetrahedra, &node_of_vertex);
        mesh.triangles = self.triangles;
        mesh.tetrahedra = self.tetrahedra;
        Ok(LoadedMesh {
            mesh,
            node_of_vertex,
            report,
        })
    }

    /// For each vertex, whether an element uses it.
    fn used(&self) -> Result<Vec<bool>> {
        let mut used = memory::filled(false, self.vertices.len())?;
        let in_triangles = self.triangles.iter().flatten();
        for &vertex in in_triangles.chain(self.tetrahedra.iter().flatten()) {
            used[vertex as usize] = true;
        }
        Ok(used)
    }

    /// Drops doubled tetrahedra and turns those that are inside out.
    fn orient_tetrahedra(&mut self, report: &mut TidyReport) -> Result<()> {
        report.doubled_tetrahedra = keep_first(&mut self.tetrahedra, |t| sorted(*t))?;
        for tetrahedron in &mut self.tetrahedra {
            // As rounded as the positions will be: the sign must be that of the finished mesh.
            let corners = tetrahedron.map(|node| self.vertices[node as usize].as_vec3().as_dvec3());
            let volume = tetrahedron_volume(corners);
            if volume < 0.0 {
                tetrahedron.swap(2, 3);
                report.flipped_tetrahedra += 1;
            } else if volume == 0.0 {
                report.flat_tetrahedra += 1;
            }
        }
        Ok(())
    }

    /// Drops doubled triangles, and on the surface of the tetrahedra those that face inward.
    fn orient_triangles(&mut self, report: &mut TidyReport) -> Result<()> {
        report.doubled_triangles = keep_first(&mut self.triangles, |t| smallest_first(*t))?;
        if self.tetrahedra.is_empty() || self.triangles.is_empty() {
            return Ok(());
        }
        report.turned_triangles = turn_outward(&mut self.triangles, boundary(&self.tetrahedra)?);
        // A triangle that was turned onto one that faced outward already was the back of it.
        let backs = keep_first(&mut self.triangles, |t| smallest_first(*t))?;
        report.doubled_triangles += backs;
        report.turned_triangles -= backs;
        Ok(())
    }
}

/// Gives the elements other node numbers and drops those that repeat a node; returns how many.
fn rename<const N: usize>(elements: &mut Vec<[u32; N]>, names: &[u32]) -> usize {
    let before = elements.len();
    elements.retain_mut(|element| {
        *element = element.map(|node| names[node as usize]);
        let nodes = sorted(*element);
        nodes.windows(2).all(|pair| pair[0] != pair[1])
    });
    before - elements.len()
}

/// Keeps the first of all elements with the same key, in their order; returns how many were dropped.
fn keep_first<const N: usize>(elements: &mut Vec<[u32; N]>, key: impl Fn(&[u32; N]) -> [u32; N]) -> Result<usize> {
    let mut order = memory::collected(elements.iter().enumerate().map(|(i, e)| (key(e), i)))?;
    order.sort_unstable();
    let mut keep = memory::filled(true, elements.len())?;
    for pair in order.windows(2) {
        keep[pair[1].1] = pair[0].0 != pair[1].0;
    }
    let before = elements.len();
    let mut keep = keep.into_iter();
    elements.retain(|_| keep.next().unwrap_or(true));
    Ok(before - elements.len())
}

/// For each vertex the first vertex it is one with, itself if there is none. Vertices that are not used stay alone.
///
/// Every vertex is compared with the firsts of the cells of a grid that its ball reaches. Firsts lie apart, so a cell
/// holds few of them and the time is linear.
fn weld(vertices: &[DVec3], used: &[bool]) -> Result<Vec<u32>> {
    let mut first_of_vertex = memory::collected(0..vertices.len() as u32)?;

    let in_use = || vertices.iter().zip(used).filter(|(_, used)| **used);
    let low = in_use().fold(DVec3::INFINITY, |low, (p, _)| low.min(*p));
    let high = in_use().fold(DVec3::NEG_INFINITY, |high, (p, _)| high.max(*p));
    let reach = WELD * (high - low).length();
    let cell_size = 4.0 * reach;
    // 250 000 cells along the diagonal: 21 bits an axis.
    let cell_of = |position: DVec3| {
        if cell_size > 0.0 {
            ((position - low) / cell_size).max(DVec3::ZERO).as_u64vec3().to_array()
        } else {
            [0; 3]
        }
    };

    // The cell's latest first, and for each first the one before it in its cell.
    let mut latest: HashMap<u64, u32> = HashMap::new();
    let mut before = memory::filled(NO_NODE, vertices.len())?;
    for (vertex, &position) in vertices.iter().enumerate().filter(|(i, _)| used[*i]) {
        let [x0, y0, z0] = cell_of(position - reach);
        let [x1, y1, z1] = cell_of(position + reach);
        let mut first = vertex as u32;
        for x in x0..=x1 {
            for y in y0..=y1 {
                for z in z0..=z1 {
                    let mut other = latest.get(&pack([x, y, z])).copied().unwrap_or(NO_NODE);
                    while other != NO_NODE {
                        if position.distance_squared(vertices[other as usize]) <= reach * reach {
                            first = first.min(other);
                        }
                        other = before[other as usize];
                    }
                }
            }
        }
        first_of_vertex[vertex] = first;
        if first as usize == vertex {
            latest.try_reserve(1)?;
            let previous = latest.insert(pack(cell_of(position)), vertex as u32);
            before[vertex] = previous.unwrap_or(NO_NODE);
        }
    }
    Ok(first_of_vertex)
}

/// A cell as one number.
fn pack([x, y, z]: [u64; 3]) -> u64 {
    x << 42 | y << 21 | z
}
