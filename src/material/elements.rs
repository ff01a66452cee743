//! The elements that a material fills, chosen from a definition and checked for a nonzero volume.

use glam::{DVec3, Vec3};

use crate::base::{Error, Result, ensure};
use crate::def::{BodyDefinition, Rounding};
use crate::mesh::{CELL_DIAGONALS, CELL_EDGES, cell_volume, tetrahedron_volume};

/// The largest height of a degenerate element relative to its longest edge, which rounding can give to flat ones.
const FLAT: f64 = 1e-7;

/// The largest deviation of a cell from a cube, relative to its edge.
const SAME_EDGE: f64 = 1e-3;

/// The elements of one body, all of one kind, each with a nonzero volume.
pub(super) enum MaterialElements<'a> {
    Tetrahedra(&'a [[u32; 4]]),
    /// Cubes of this edge length, m.
    Cells(&'a [[u32; 8]], f64),
    /// Triangles of this thickness, m.
    Triangles(&'a [[u32; 3]], f64),
}

impl<'a> MaterialElements<'a> {
    /// Selects the elements of a definition. Triangles beside tetrahedra or cells are a surface and no elements.
    pub fn from_definition(definition: &BodyDefinition<'a>, thickness: f32) -> Result<Self> {
        let BodyDefinition {
            triangles,
            tetrahedra,
            cells,
            ..
        } = *definition;
        let rest = definition.rest_positions.unwrap_or(definition.positions);
        let elements = match (triangles, tetrahedra, cells) {
            ([], [], []) => {
                return Err(Error::invalid(
                    "material is given without triangles, tetrahedra or cells, which it would fill",
                ));
            }
            (_, [_, ..], [_, ..]) => {
                return Err(Error::invalid(
                    "tetrahedra and cells are both given: a material fills the one or the other",
                ));
            }
            (_, tetrahedra @ [_, ..], []) => {
                check_each("tetrahedra", tetrahedra, rest, &tetrahedron_height)?;
                Self::Tetrahedra(tetrahedra)
            }
            (_, [], cells @ [_, ..]) => Self::Cells(cells, common_edge(cells, rest, definition.rounding())?),
            (triangles, [], []) => {
                ensure!(
                    thickness != 0.0,
                    "thickness is 0 m: must be above 0 where a material fills triangles"
                );
                check_each("triangles", triangles, rest, &triangle_height)?;
                return Ok(Self::Triangles(triangles, f64::from(thickness)));
            }
        };
        ensure!(
            thickness == 0.0,
            "thickness is {thickness} m: must be 0 where a material fills {}",
            elements.name()
        );
        Ok(elements)
    }

    pub fn name(&self) -> &'static str {
        match self {
            Self::Tetrahedra(_) => "tetrahedra",
            Self::Cells(..) => "cells",
            Self::Triangles(..) => "triangles",
        }
    }

    pub fn poisson_ratio_of_springs(&self) -> f32 {
        match self {
            Self::Tetrahedra(_) | Self::Cells(..) => 0.25,
            Self::Triangles(..) => 1.0 / 3.0,
        }
    }
}

/// The rest positions of an element's corners.
pub(super) fn corners<const N: usize>(element: &[u32; N], rest: &[Vec3]) -> [DVec3; N] {
    element.map(|node| rest[node as usize].as_dvec3())
}

/// The area of a triangle, m².
pub(super) fn triangle_area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

fn longest_edge<const N: usize>(corners: &[DVec3; N]) -> f64 {
    let from = |(i, a): (usize, &DVec3)| corners[..i].iter().map(|b| a.distance(*b)).fold(0.0, f64::max);
    corners.iter().enumerate().map(from).fold(0.0, f64::max)
}

/// The height above the largest face, relative to the longest edge.
fn tetrahedron_height(corners: [DVec3; 4]) -> f64 {
    6.0 * tetrahedron_volume(corners).abs() / longest_edge(&corners).powi(3)
}

fn triangle_height(corners: [DVec3; 3]) -> f64 {
    2.0 * triangle_area(corners) / longest_edge(&corners).powi(2)
}

/// Returns an error if an element is flat.
fn check_each<const N: usize>(
    name: &str,
    elements: &[[u32; N]],
    rest: &[Vec3],
    height: &dyn Fn([DVec3; N]) -> f64,
) -> Result<()> {
    match elements
        .iter()
        .position(|element| !(height(corners(element, rest)) > FLAT))
    {
        None => Ok(()),
        Some(index) => Err(Error::invalid(format!(
            "{name}[{index}], of nodes {:?}, is flat at rest: a material needs room",
            elements[index]
        ))),
    }
}

/// The common edge length of cells that are equal cubes up to rounding of their coordinates.
fn common_edge(cells: &[[u32; 8]], rest: &[Vec3], Rounding { reach }: Rounding) -> Result<f64> {
    // A coordinate has an error of half a unit in the last place, an edge of one unit; a diagonal, and the mean it is
    // compared with, of 1.42.
    let rounding = 3.0 * f64::from(f32::EPSILON) * f64::from(reach);
    let distance = |corners: &[DVec3; 8], [a, b]: [usize; 2]| corners[a].distance(corners[b]);
    let sum_of = |cell: &[u32; 8]| {
        let corners = corners(cell, rest);
        CELL_EDGES.iter().map(|&ends| distance(&corners, ends)).sum::<f64>()
    };
    let edge = cells.iter().map(sum_of).sum::<f64>() / (12 * cells.len()) as f64;
    for (index, cell) in cells.iter().enumerate() {
        let corners = corners(cell, rest);
        let diagonal = std::f64::consts::SQRT_2 * edge;
        for (pairs, expected) in [(CELL_EDGES, edge), (CELL_DIAGONALS, diagonal)] {
            for ends in pairs {
                let length = distance(&corners, ends);
                if !(length > 0.0 && (length - expected).abs() <= SAME_EDGE * expected + rounding) {
                    let [a, b] = ends.map(|corner| cell[corner]);
                    return Err(Error::invalid(format!(
                        "cells[{index}] is no cube of the cells' mean edge, {} m: nodes {a} and {b} lie {} m apart, not {} m",
                        edge as f32, length as f32, expected as f32
                    )));
                }
            }
        }
        ensure!(
            cell_volume(corners) >= 0.5 * edge.powi(3),
            "cells[{index}] is a mirrored cube: its corners are numbered by bits, x 1, y 2, z 4, right-handed"
        );
    }
    Ok(edge)
}
