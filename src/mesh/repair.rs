//! Mesh repair: merges repeated vertices, removes degenerate and duplicate elements and unused vertices, and fixes
//! orientations.

use std::collections::HashMap;

use glam::DVec3;

use super::topology::{boundary, smallest_first, sorted, turn_outward};
use super::{Mesh, tetrahedron_volume};
use crate::Result;
#[cfg(doc)]
use crate::base::Error;
use crate::base::{ensure, memory};

/// The value in [`LoadedMesh::node_of_vertex`] of a removed vertex.
pub const NO_NODE: u32 = u32::MAX;

/// Vertices nearer than this fraction of the bounding box's diagonal are merged.
const WELD: f64 = 1e-6;

/// A repaired mesh, and the node of each vertex it was made from.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::mesh::{Mesh, tidy};
/// // Two triangles with two corners written twice.
/// let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::X, Vec3::Z, Vec3::X + Vec3::Z];
/// let loaded = tidy(&Mesh { positions, triangles: vec![[0, 2, 1], [3, 4, 5]], ..Mesh::default() })?;
/// assert_eq!(loaded.mesh.triangles, [[0, 2, 1], [1, 2, 3]]);
/// assert_eq!(loaded.node_of_vertex, [0, 1, 2, 1, 2, 3]);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadedMesh {
    /// A mesh in which every node is used and no element repeats a node.
    pub mesh: Mesh,
    /// The node of each vertex of the file, or [`NO_NODE`]. Nodes keep the order of their first vertices.
    pub node_of_vertex: Vec<u32>,
    /// The changes that were made.
    pub report: TidyReport,
}

/// The changes that repaired a mesh. The nodes, `welded_vertices` and `dropped_vertices` add up to the number of
/// vertices.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::mesh::{Mesh, tidy};
/// // The last vertex is unused, and a triangle occurs twice.
/// let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::Y];
/// let report = tidy(&Mesh { positions, triangles: vec![[0, 2, 1], [2, 1, 0]], ..Mesh::default() })?.report;
/// assert_eq!((report.dropped_vertices, report.doubled_triangles), (1, 1));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TidyReport {
    /// The number of vertices merged with an earlier one.
    pub welded_vertices: usize,
    /// The number of vertices that no remaining triangle or tetrahedron uses.
    pub dropped_vertices: usize,
    /// The number of triangles removed because two of their corners are one node.
    pub collapsed_triangles: usize,
    /// The number of triangles removed because another has the same nodes in the same direction, or is the same face
    /// of the tetrahedra's surface.
    pub doubled_triangles: usize,
    /// The number of triangles on the surface of the tetrahedra that faced inward and were reversed.
    pub turned_triangles: usize,
    /// The number of tetrahedra removed because two of their corners are one node.
    pub collapsed_tetrahedra: usize,
    /// The number of tetrahedra removed because another has the same nodes.
    pub doubled_tetrahedra: usize,
    /// The number of inverted tetrahedra; two of their nodes were swapped.
    pub flipped_tetrahedra: usize,
    /// The number of tetrahedra without volume whose nodes differ. They are kept.
    pub flat_tetrahedra: usize,
    /// The number of cells of the file that are points or lines, which are not used.
    pub ignored_cells: usize,
}

impl TidyReport {
    /// The number of removed triangles, degenerate or duplicate.
    pub fn dropped_triangles(&self) -> usize {
        self.collapsed_triangles + self.doubled_triangles
    }

    /// The number of removed tetrahedra, degenerate or duplicate.
    pub fn dropped_tetrahedra(&self) -> usize {
        self.collapsed_tetrahedra + self.doubled_tetrahedra
    }
}

impl LoadedMesh {
    /// Wraps a mesh that needs no repair, such as a generated shape. Every vertex is its own node.
    ///
    /// Errors: those of [`Mesh::check`], [`Error::OutOfMemory`].
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

/// Repairs a mesh like [`load`](super::load):
///
/// - vertices nearer than 1e-6 of the diagonal of the used vertices' bounding box are merged, at the position of the
///   first of them;
/// - triangles and tetrahedra that repeat a node are removed. Thin ones, even flat ones, are kept;
/// - tetrahedra with the same nodes are kept once, and oriented such that their volume is positive;
/// - triangles on the surface of the tetrahedra are oriented outward and kept once. Other triangles are kept once for
///   each direction. Two with the same nodes in opposite directions are the two sides of a sheet; removing one would
///   open a closed surface;
/// - unused vertices are removed.
///
/// Errors: [`Error::InvalidArgument`] if [`Mesh::check`] fails or if there are cells; [`Error::OutOfMemory`].
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

/// The contents of a file: finite vertices, in meters once scaled, and indices in range.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    pub vertices: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    pub tetrahedra: Vec<[u32; 4]>,
    pub ignored_cells: usize,
}

impl RawMesh {
    /// Adds a polygon as a fan of triangles around its first corner.
    pub fn add_polygon(&mut self, corners: &[u32]) -> Result<()> {
        if let [first, rest @ ..] = corners {
            let fan = rest.windows(2).map(|pair| [*first, pair[0], pair[1]]);
            memory::extend(&mut self.triangles, fan)?;
        }
        Ok(())
    }

    /// Repairs the mesh, see [`tidy`].
    pub fn tidy(mut self) -> Result<LoadedMesh> {
        let mut report = TidyReport {
            ignored_cells: self.ignored_cells,
            ..TidyReport::default()
        };
        let first_of_vertex = weld(&self.vertices, &self.used()?)?;
        report.collapsed_triangles = renumber(&mut self.triangles, &first_of_vertex);
        report.collapsed_tetrahedra = renumber(&mut self.tetrahedra, &first_of_vertex);
        self.orient_tetrahedra(&mut report)?;
        self.orient_triangles(&mut report)?;

        // Vertices of removed elements may have become unused.
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
        renumber(&mut self.triangles, &node_of_vertex);
        renumber(&mut self.tetrahedra, &node_of_vertex);
        mesh.triangles = self.triangles;
        mesh.tetrahedra = self.tetrahedra;
        Ok(LoadedMesh {
            mesh,
            node_of_vertex,
            report,
        })
    }

    /// For each vertex, true if an element uses it.
    fn used(&self) -> Result<Vec<bool>> {
        let mut used = memory::filled(false, self.vertices.len())?;
        let in_triangles = self.triangles.iter().flatten();
        for &vertex in in_triangles.chain(self.tetrahedra.iter().flatten()) {
            used[vertex as usize] = true;
        }
        Ok(used)
    }

    /// Removes duplicate tetrahedra and reorients inverted ones.
    fn orient_tetrahedra(&mut self, report: &mut TidyReport) -> Result<()> {
        report.doubled_tetrahedra = remove_duplicates(&mut self.tetrahedra, |t| sorted(*t))?;
        for tetrahedron in &mut self.tetrahedra {
            // Positions are rounded like the result, so that the sign is that of the final mesh.
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

    /// Removes duplicate triangles, and reverses those on the surface of the tetrahedra that face inward.
    fn orient_triangles(&mut self, report: &mut TidyReport) -> Result<()> {
        report.doubled_triangles = remove_duplicates(&mut self.triangles, |t| smallest_first(*t))?;
        if self.tetrahedra.is_empty() || self.triangles.is_empty() {
            return Ok(());
        }
        report.turned_triangles = turn_outward(&mut self.triangles, boundary(&self.tetrahedra)?);
        // A triangle reversed onto one that already faced outward was a duplicate.
        let duplicates = remove_duplicates(&mut self.triangles, |t| smallest_first(*t))?;
        report.doubled_triangles += duplicates;
        report.turned_triangles -= duplicates;
        Ok(())
    }
}

/// Replaces node indices, and removes elements that repeat a node. Returns the number removed.
fn renumber<const N: usize>(elements: &mut Vec<[u32; N]>, new_indices: &[u32]) -> usize {
    let before = elements.len();
    elements.retain_mut(|element| {
        *element = element.map(|node| new_indices[node as usize]);
        let nodes = sorted(*element);
        nodes.windows(2).all(|pair| pair[0] != pair[1])
    });
    before - elements.len()
}

/// Keeps the first element of each key, in order. Returns the number removed.
fn remove_duplicates<const N: usize>(
    elements: &mut Vec<[u32; N]>,
    key: impl Fn(&[u32; N]) -> [u32; N],
) -> Result<usize> {
    let mut order = memory::collected(elements.iter().enumerate().map(|(i, e)| (key(e), i)))?;
    order.sort_unstable();
    let mut is_kept = memory::filled(true, elements.len())?;
    for pair in order.windows(2) {
        is_kept[pair[1].1] = pair[0].0 != pair[1].0;
    }
    let before = elements.len();
    let mut is_kept = is_kept.into_iter();
    elements.retain(|_| is_kept.next().unwrap_or(true));
    Ok(before - elements.len())
}

/// The first vertex that each vertex is merged with; the vertex itself if there is none, or if it is unused.
///
/// Each vertex is compared with the first vertices in the grid cells near it. First vertices are apart from each
/// other, so a cell has few of them and the time is linear.
fn weld(vertices: &[DVec3], used: &[bool]) -> Result<Vec<u32>> {
    let mut first_of_vertex = memory::collected(0..vertices.len() as u32)?;

    let used_vertices = || vertices.iter().zip(used).filter(|(_, used)| **used);
    let low = used_vertices().fold(DVec3::INFINITY, |low, (p, _)| low.min(*p));
    let high = used_vertices().fold(DVec3::NEG_INFINITY, |high, (p, _)| high.max(*p));
    let radius = WELD * (high - low).length();
    let cell_size = 4.0 * radius;
    // At most 250 000 cells along the diagonal: 21 bits per axis.
    let cell_of = |position: DVec3| {
        if cell_size > 0.0 {
            ((position - low) / cell_size).max(DVec3::ZERO).as_u64vec3().to_array()
        } else {
            [0; 3]
        }
    };

    // The latest first vertex of each cell, and for each first vertex the one before it in its cell.
    let mut latest: HashMap<u64, u32> = HashMap::new();
    let mut previous_in_cell = memory::filled(NO_NODE, vertices.len())?;
    for (vertex, &position) in vertices.iter().enumerate().filter(|(i, _)| used[*i]) {
        let [x0, y0, z0] = cell_of(position - radius);
        let [x1, y1, z1] = cell_of(position + radius);
        let mut first = vertex as u32;
        for x in x0..=x1 {
            for y in y0..=y1 {
                for z in z0..=z1 {
                    let mut other = latest.get(&pack([x, y, z])).copied().unwrap_or(NO_NODE);
                    while other != NO_NODE {
                        if position.distance_squared(vertices[other as usize]) <= radius * radius {
                            first = first.min(other);
                        }
                        other = previous_in_cell[other as usize];
                    }
                }
            }
        }
        first_of_vertex[vertex] = first;
        if first as usize == vertex {
            latest.try_reserve(1)?;
            let previous = latest.insert(pack(cell_of(position)), vertex as u32);
            previous_in_cell[vertex] = previous.unwrap_or(NO_NODE);
        }
    }
    Ok(first_of_vertex)
}

/// The indices of a cell packed into one number.
fn pack([x, y, z]: [u64; 3]) -> u64 {
    x << 42 | y << 21 | z
}
