//! Creates a solid before any cut.

use glam::{DVec3, Vec3};

use super::body::{CutSolid, FACES, FaceState, SolidCell, SolidTetrahedron, SolidTriangle, SolidVertex};
use super::separate::{BladeMark, SolidStroke};
use crate::base::{Error, Result, ensure, memory};
use crate::cutting::cell_complex::{NONE, SNAP, insert_corners, nodes_without_cells, rest_positions_of};
use crate::cutting::tracked::Tracked;

impl CutSolid {
    /// Creates a solid from the rest positions of its nodes, m, and from cells with four nodes each, in any order.
    /// `render_triangles` contains the outer faces of the cells, each once and outward, in any order. If it is empty,
    /// they are found. The material of each cell starts as one tetrahedron, with a vertex for each node.
    ///
    /// Positions must be finite, nodes known, and volumes not zero. A face must have at most two cells, on different
    /// sides. The cells around a node must be connected through faces at it.
    pub fn new(rest: &[Vec3], cells: &[[u32; 4]], render_triangles: &[[u32; 3]]) -> Result<Self> {
        ensure!(
            rest.len().max(cells.len()) < (NONE / 4) as usize,
            "more than 2^30 nodes or cells"
        );
        let mut nodes = nodes_without_cells(rest)?;
        let mut vertices = memory::collected((0..rest.len() as u32).map(|node| SolidVertex {
            nodes: [node; 4],
            weights: [1.0, 0.0, 0.0, 0.0],
            point: node,
            around: NONE,
            mark: BladeMark::NONE,
            other_mark: BladeMark::NONE,
        }))?;
        let mut solid_cells = memory::reserved(cells.len())?;
        let mut tetrahedra = memory::reserved(cells.len())?;
        for (number, &corners) in cells.iter().enumerate() {
            let positions = rest_positions_of(number, corners, rest)?;
            let volume = volume_of(positions);
            ensure!(volume.abs() > 0.0, "cell {number} of nodes {corners:?} has no volume");
            for node in corners {
                vertices[node as usize].around = number as u32;
            }
            solid_cells.push(SolidCell {
                nodes: corners,
                volume: volume.abs(),
                snap: SNAP * shortest_edge(positions),
                first: number as u32,
                next: insert_corners(&mut nodes, number, corners),
            });
            let [a, b, c, d] = corners;
            tetrahedra.push(SolidTetrahedron {
                corners: if volume > 0.0 { corners } else { [a, b, d, c] },
                cell: number as u32,
                volume: volume.abs(),
                neighbors: [NONE; 4],
                faces: [FaceState::Whole; 4],
                render_triangles: [NONE; 4],
                flipped_in: 0,
                next: NONE,
            });
        }
        let mut triangles = join_neighbors(&mut tetrahedra)?;
        if !render_triangles.is_empty() {
            reorder_triangles(&mut triangles, &mut tetrahedra, render_triangles)?;
        }
        let solid = Self {
            nodes: Tracked::new(nodes),
            cells: Tracked::new(solid_cells),
            tetrahedra: Tracked::new(tetrahedra),
            triangles: Tracked::new(triangles),
            vertices: Tracked::new(vertices),
            strokes: 0,
            stroke: SolidStroke::NONE,
            before: (0, SolidStroke::NONE),
        };
        solid.check_stars()?;
        Ok(solid)
    }

    fn check_stars(&self) -> Result<()> {
        let mut counts = memory::filled(0, self.vertices.values().len())?;
        for corner in self.tetrahedra().iter().flat_map(|tetrahedron| tetrahedron.corners) {
            counts[corner as usize] += 1;
        }
        let mut star = Vec::new();
        for (vertex, &count) in counts.iter().enumerate() {
            self.vertex_star(vertex as u32, &mut star)?;
            ensure!(
                star.len() == count,
                "node {vertex} has {count} cells, of which {} hang together by faces at it",
                star.len()
            );
        }
        Ok(())
    }
}

/// Finds the neighbors of each tetrahedron. Returns render triangles for the faces without one.
fn join_neighbors(tetrahedra: &mut [SolidTetrahedron]) -> Result<Vec<SolidTriangle>> {
    let mut sides = memory::reserved(4 * tetrahedra.len())?;
    for (number, tetrahedron) in tetrahedra.iter().enumerate() {
        for (face, corners) in FACES.iter().enumerate() {
            let [a, b, c] = corners.map(|k| tetrahedron.corners[k]);
            let mut sorted = [a, b, c];
            sorted.sort_unstable();
            // True if an even number of swaps sorts them.
            let is_even = (a < b) ^ (b < c) ^ (a < c);
            sides.push((sorted, is_even, number as u32, face));
        }
    }
    sides.sort_unstable();
    let mut outer_faces = memory::reserved(sides.chunk_by(|a, b| a.0 == b.0).filter(|at| at.len() == 1).count())?;
    for face_sides in sides.chunk_by(|a, b| a.0 == b.0) {
        match *face_sides {
            [(_, _, number, face)] => outer_faces.push((number, face)),
            [(_, false, a, face_a), (_, true, b, face_b)] => {
                tetrahedra[a as usize].neighbors[face_a] = b;
                tetrahedra[b as usize].neighbors[face_b] = a;
            }
            [(nodes, _, a, _), (_, _, b, _)] => {
                return Err(Error::invalid(format!(
                    "cells {a} and {b} lie on the same side of the face of nodes {nodes:?}"
                )));
            }
            _ => {
                return Err(Error::invalid(format!(
                    "{} cells have the face of nodes {:?}",
                    face_sides.len(),
                    face_sides[0].0
                )));
            }
        }
    }
    outer_faces.sort_unstable();
    let mut triangles = memory::reserved(outer_faces.len())?;
    for (tetrahedron, face) in outer_faces {
        let it = &mut tetrahedra[tetrahedron as usize];
        it.render_triangles[face] = triangles.len() as u32;
        triangles.push(SolidTriangle {
            corners: FACES[face].map(|k| it.corners[k]),
            cell: it.cell,
            is_inner: false,
            tetrahedron,
        });
    }
    Ok(triangles)
}

/// Puts triangles into the order of the given ones, with the same first corners.
fn reorder_triangles(
    triangles: &mut [SolidTriangle],
    tetrahedra: &mut [SolidTetrahedron],
    given: &[[u32; 3]],
) -> Result<()> {
    ensure!(
        given.len() == triangles.len(),
        "there are {} triangles, and cells have {} outer faces",
        given.len(),
        triangles.len()
    );
    let mut sorted_given =
        memory::collected((0..given.len() as u32).map(|place| (from_lowest(given[place as usize]), place)))?;
    sorted_given.sort_unstable();
    let mut unordered = memory::copied(triangles)?;
    unordered.sort_unstable_by_key(|triangle| from_lowest(triangle.corners));
    for (&(corners, place), triangle) in sorted_given.iter().zip(unordered) {
        ensure!(
            from_lowest(triangle.corners) == corners,
            "triangle {place} of nodes {:?} is no outer face of a cell, turned outward, or is there twice",
            given[place as usize]
        );
        let it = &mut tetrahedra[triangle.tetrahedron as usize];
        for (render_triangle, face) in it.render_triangles.iter_mut().zip(FACES) {
            if *render_triangle != NONE && from_lowest(face.map(|k| it.corners[k])) == corners {
                *render_triangle = place;
            }
        }
        triangles[place as usize] = SolidTriangle {
            corners: given[place as usize],
            ..triangle
        };
    }
    Ok(())
}

/// Rotates the corners so that the lowest is first.
fn from_lowest(mut corners: [u32; 3]) -> [u32; 3] {
    let lowest = (0..3).min_by_key(|&k| corners[k]).unwrap_or(0);
    corners.rotate_left(lowest);
    corners
}

/// The signed volume of a tetrahedron, below 0 if it is inverted.
fn volume_of([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

fn shortest_edge(positions: [DVec3; 4]) -> f64 {
    let lengths = (0..4).flat_map(|a| (0..a).map(move |b| positions[a].distance(positions[b])));
    lengths.fold(f64::INFINITY, f64::min)
}
