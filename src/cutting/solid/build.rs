//! The solid as it is before any cut.

use glam::{DVec3, Vec3};

use super::body::{CutSolid, FACES, Face, SolidCell, SolidTetrahedron, SolidTriangle, SolidVertex};
use super::sever::{Mark, SolidStroke};
use crate::base::{Error, Result, ensure, memory};
use crate::cutting::divided::{NONE, SNAP, nodes_at, places_of, put_at};
use crate::cutting::tracked::Tracked;

impl CutSolid {
    /// Of the rest positions of its nodes, m, of cells with four nodes each, in any order, and of the triangles that are drawn: the outer faces of
    /// the cells, each once and outward, in any order, or none, if they are to be found. The material of each cell is one tetrahedron, and there is
    /// a vertex for each node.
    ///
    /// Refused unless positions are finite, nodes are known, each cell has a volume, at a face there are two cells at most, on either side of it,
    /// the cells about a node hang together by faces at it, and triangles are as they are asked for.
    pub fn new(rest: &[Vec3], cells: &[[u32; 4]], drawn: &[[u32; 3]]) -> Result<Self> {
        ensure!(
            rest.len().max(cells.len()) < (NONE / 4) as usize,
            "more than 2^30 nodes or cells"
        );
        let mut nodes = nodes_at(rest)?;
        let mut vertices = memory::collected((0..rest.len() as u32).map(|node| SolidVertex {
            nodes: [node; 4],
            weights: [1.0, 0.0, 0.0, 0.0],
            point: node,
            around: NONE,
            mark: Mark::NONE,
            other_mark: Mark::NONE,
        }))?;
        let mut made = memory::reserved(cells.len())?;
        let mut tetrahedra = memory::reserved(cells.len())?;
        for (number, &corners) in cells.iter().enumerate() {
            let places = places_of(number, corners, rest)?;
            let volume = volume_of(places);
            ensure!(volume.abs() > 0.0, "cell {number} of nodes {corners:?} has no volume");
            for node in corners {
                vertices[node as usize].around = number as u32;
            }
            made.push(SolidCell {
                nodes: corners,
                volume: volume.abs(),
                snap: SNAP * shortest_edge(places),
                first: number as u32,
                next: put_at(&mut nodes, number, corners),
            });
            let [a, b, c, d] = corners;
            tetrahedra.push(SolidTetrahedron {
                corners: if volume > 0.0 { corners } else { [a, b, d, c] },
                cell: number as u32,
                volume: volume.abs(),
                neighbours: [NONE; 4],
                faces: [Face::Whole; 4],
                drawn: [NONE; 4],
                turned: 0,
                next: NONE,
            });
        }
        let mut triangles = join_neighbours(&mut tetrahedra)?;
        if !drawn.is_empty() {
            put_in_order(&mut triangles, &mut tetrahedra, drawn)?;
        }
        let solid = Self {
            nodes: Tracked::new(nodes),
            cells: Tracked::new(made),
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
            self.star(vertex as u32, &mut star)?;
            ensure!(
                star.len() == count,
                "node {vertex} has {count} cells, of which {} hang together by faces at it",
                star.len()
            );
        }
        Ok(())
    }
}

/// Finds the neighbours of each tetrahedron, and draws the faces that have none.
fn join_neighbours(tetrahedra: &mut [SolidTetrahedron]) -> Result<Vec<SolidTriangle>> {
    let mut sides = memory::reserved(4 * tetrahedra.len())?;
    for (number, tetrahedron) in tetrahedra.iter().enumerate() {
        for (face, corners) in FACES.iter().enumerate() {
            let [a, b, c] = corners.map(|k| tetrahedron.corners[k]);
            let mut sorted = [a, b, c];
            sorted.sort_unstable();
            // Whether it takes an even number of swaps to sort them.
            let is_even = (a < b) ^ (b < c) ^ (a < c);
            sides.push((sorted, is_even, number as u32, face));
        }
    }
    sides.sort_unstable();
    let mut drawn = memory::reserved(sides.chunk_by(|a, b| a.0 == b.0).filter(|at| at.len() == 1).count())?;
    for at_face in sides.chunk_by(|a, b| a.0 == b.0) {
        match *at_face {
            [(_, _, number, face)] => drawn.push((number, face)),
            [(_, false, a, face_a), (_, true, b, face_b)] => {
                tetrahedra[a as usize].neighbours[face_a] = b;
                tetrahedra[b as usize].neighbours[face_b] = a;
            }
            [(nodes, _, a, _), (_, _, b, _)] => {
                return Err(Error::invalid(format!(
                    "cells {a} and {b} lie on the same side of the face of nodes {nodes:?}"
                )));
            }
            _ => {
                return Err(Error::invalid(format!(
                    "{} cells have the face of nodes {:?}",
                    at_face.len(),
                    at_face[0].0
                )));
            }
        }
    }
    drawn.sort_unstable();
    let mut triangles = memory::reserved(drawn.len())?;
    for (tetrahedron, face) in drawn {
        let it = &mut tetrahedra[tetrahedron as usize];
        it.drawn[face] = triangles.len() as u32;
        triangles.push(SolidTriangle {
            corners: FACES[face].map(|k| it.corners[k]),
            cell: it.cell,
            is_inner: false,
            tetrahedron,
        });
    }
    Ok(triangles)
}

/// Gives triangles the order and the first corners of those given.
fn put_in_order(
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
    let mut places =
        memory::collected((0..given.len() as u32).map(|place| (from_lowest(given[place as usize]), place)))?;
    places.sort_unstable();
    let mut known = memory::copied(triangles)?;
    known.sort_unstable_by_key(|triangle| from_lowest(triangle.corners));
    for (&(corners, place), triangle) in places.iter().zip(known) {
        ensure!(
            from_lowest(triangle.corners) == corners,
            "triangle {place} of nodes {:?} is no outer face of a cell, turned outward, or is there twice",
            given[place as usize]
        );
        let it = &mut tetrahedra[triangle.tetrahedron as usize];
        for (drawn, face) in it.drawn.iter_mut().zip(FACES) {
            if *drawn != NONE && from_lowest(face.map(|k| it.corners[k])) == corners {
                *drawn = place;
            }
        }
        triangles[place as usize] = SolidTriangle {
            corners: given[place as usize],
            ..triangle
        };
    }
    Ok(())
}

/// The corners from the lowest on.
fn from_lowest(mut corners: [u32; 3]) -> [u32; 3] {
    let lowest = (0..3).min_by_key(|&k| corners[k]).unwrap_or(0);
    corners.rotate_left(lowest);
    corners
}

/// The volume of a tetrahedron, below 0 if it is turned over.
fn volume_of([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

fn shortest_edge(places: [DVec3; 4]) -> f64 {
    let lengths = (0..4).flat_map(|a| (0..a).map(move |b| places[a].distance(places[b])));
    lengths.fold(f64::INFINITY, f64::min)
}
