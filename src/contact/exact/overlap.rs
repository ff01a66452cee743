//! Stand-alone EXACT queries: points and edges of a surface inside a solid.

use glam::Vec3;

use super::ExactSolid;
#[cfg(doc)]
use crate::base::Error;
use crate::base::{Result, ensure};
use crate::mesh::ClosedSurface;

/// A rigid or deformable solid that finds the points and edges inside it.
///
/// ```
/// # use glam::vec3;
/// # use sinew::detection::exact::*;
/// # use sinew::mesh::{ClosedSurface, Mesh};
/// # let mesh = Mesh::block([0.1, 0.1, 0.1], [2, 2, 2])?;
/// # let cube = Exact::new(&ClosedSurface::new(&mesh.positions, &mesh.surface()?)?)?;
/// # let points = [vec3(0.0, 0.04, 0.0), vec3(0.0, 0.14, 0.0)];
/// assert!(cube.is_inside(points[0]) && !cube.is_inside(points[1]));
/// let (distance, normal) = cube.distance(vec3(0.0, 0.052, 0.0), 0.01).expect("it is 2 mm away");
/// assert!((distance - 0.002).abs() < 1e-6 && normal.y > 0.99);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct Exact {
    solid: ExactSolid,
    node_count: usize,
}

/// Points and edges inside a solid. Its memory is reused by the next search.
///
/// ```
/// # use glam::vec3;
/// # use sinew::detection::exact::*;
/// # use sinew::mesh::{ClosedSurface, Mesh};
/// # let mesh = Mesh::block([0.1, 0.1, 0.1], [2, 2, 2])?;
/// # let cube = Exact::new(&ClosedSurface::new(&mesh.positions, &mesh.surface()?)?)?;
/// # let points = [vec3(0.0, 0.04, 0.0), vec3(0.0, 0.14, 0.0)];
/// let mut overlap = Overlap::default();
/// cube.find(&points, &[[0, 1]], &mut overlap)?;
/// assert_eq!((overlap.points.len(), overlap.edges.len()), (1, 1));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Overlap {
    /// Sorted by point.
    pub points: Vec<PointInside>,
    /// Sorted by edge, and along each edge.
    pub edges: Vec<EdgeInside>,
    crossings: Vec<(f64, bool)>,
}

/// A point inside a solid.
///
/// ```
/// # use glam::vec3;
/// # use sinew::detection::exact::*;
/// # use sinew::mesh::{ClosedSurface, Mesh};
/// # let mesh = Mesh::block([0.1, 0.1, 0.1], [2, 2, 2])?;
/// # let cube = Exact::new(&ClosedSurface::new(&mesh.positions, &mesh.surface()?)?)?;
/// # let points = [vec3(0.0, 0.04, 0.0), vec3(0.0, 0.14, 0.0)];
/// # let mut overlap = Overlap::default();
/// cube.find(&points, &[], &mut overlap)?;
/// let inside = overlap.points[0];
/// assert_eq!(inside.point, 0);
/// // The upper side is 1 cm away.
/// assert!((inside.depth - 0.01).abs() < 1e-6 && inside.normal.y > 0.99);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointInside {
    /// Index of the point.
    pub point: u32,
    /// Distance to the solid's surface, m.
    pub depth: f32,
    /// Unit direction of the shortest path out of the solid.
    pub normal: Vec3,
}

/// A part of an edge inside a solid.
///
/// ```
/// # use glam::vec3;
/// # use sinew::detection::exact::*;
/// # use sinew::mesh::{ClosedSurface, Mesh};
/// # let mesh = Mesh::block([0.1, 0.1, 0.1], [2, 2, 2])?;
/// # let cube = Exact::new(&ClosedSurface::new(&mesh.positions, &mesh.surface()?)?)?;
/// # let points = [vec3(0.0, 0.04, 0.0), vec3(0.0, 0.14, 0.0)];
/// # let mut overlap = Overlap::default();
/// cube.find(&points, &[[0, 1]], &mut overlap)?;
/// let EdgeInside { enters, leaves, .. } = overlap.edges[0];
/// // From 4 cm to 14 cm above the middle; the upper side is at 5 cm.
/// assert!(enters == 0.0 && (leaves - 0.1).abs() < 1e-5);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeInside {
    /// Index of the edge.
    pub edge: u32,
    /// Position where the edge enters, as a fraction of it; 0 if it begins inside.
    pub enters: f32,
    /// Position where the edge leaves; 1 if it ends inside.
    pub leaves: f32,
}

impl Exact {
    /// Creates a rigid solid.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(surface: &ClosedSurface) -> Result<Self> {
        Ok(Self {
            solid: ExactSolid::new(surface)?,
            node_count: surface.positions().len(),
        })
    }

    /// Creates a deformable solid. It has no distance grid, which makes points far from a rigid surface cheap.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn changing(surface: &ClosedSurface) -> Result<Self> {
        Ok(Self {
            solid: ExactSolid::changing(surface)?,
            node_count: surface.positions().len(),
        })
    }

    /// Updates the solid's node positions (m) without allocating. The surface is not checked for self-intersection.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if their number differs from that of the surface, or one is not finite; the solid
    /// then stays unchanged.
    pub fn refit(&mut self, positions: &[Vec3]) -> Result<()> {
        ensure!(
            positions.len() == self.node_count,
            "{} positions: the surface has {} nodes",
            positions.len(),
            self.node_count
        );
        check_positions(positions)?;
        self.solid.refit(|node| positions[node]);
        Ok(())
    }

    /// Finds which of `points` lie inside the solid (m, in its own coordinates), and which parts of `edges` (two
    /// point indices each). Allocates only if `overlap` lacks capacity.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if a point is not finite or an edge has an invalid index; [`Error::OutOfMemory`].
    pub fn find(&self, points: &[Vec3], edges: &[[u32; 2]], overlap: &mut Overlap) -> Result<()> {
        check_positions(points)?;
        for (edge, ends) in edges.iter().enumerate() {
            ensure!(
                ends.iter().all(|&end| (end as usize) < points.len()),
                "edge {edge} joins points {ends:?}; there are {}",
                points.len()
            );
        }
        overlap.points.clear();
        overlap.edges.clear();
        for (point, &position) in (0..).zip(points) {
            if let Some((distance, normal)) = self.solid.measure(position, 0.0)
                && distance < 0.0
            {
                overlap.points.try_reserve(1)?;
                overlap.points.push(PointInside {
                    point,
                    depth: -distance,
                    normal,
                });
            }
        }
        for (edge, ends) in (0..).zip(edges) {
            let [from, to] = ends.map(|end| points[end as usize]);
            overlap.add_edge(&self.solid, edge, from, to)?;
        }
        Ok(())
    }

    /// True if a point lies inside the solid.
    pub fn is_inside(&self, point: Vec3) -> bool {
        self.solid.is_inside(point)
    }

    /// Returns the distance of a point from the surface (m), negative inside, and the direction away from the solid;
    /// `None` if it is further outside than `within`.
    pub fn distance(&self, point: Vec3, within: f32) -> Option<(f32, Vec3)> {
        self.solid.measure(point, within)
    }
}

impl Overlap {
    fn add_edge(&mut self, solid: &ExactSolid, edge: u32, from: Vec3, to: Vec3) -> Result<()> {
        let crossings = &mut self.crossings;
        crossings.clear();
        let mut full = Ok(());
        solid.crossings(from, to, |crossing| {
            if let Err(error) = crossings.try_reserve(1) {
                full = Err(error);
                return;
            }
            crossings.push((crossing.fraction, crossing.enters));
        });
        full?;
        // An entry at the same position as an exit comes first, so that the edge stays inside.
        crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        let step = |enters: bool| if enters { 1 } else { -1 };
        let mut winding = 0;
        let mut lowest = 0;
        for &(_, enters) in crossings.iter() {
            winding += step(enters);
            lowest = lowest.min(winding);
        }
        // The edge begins inside if it leaves more often than it has entered.
        winding = if crossings.is_empty() {
            i32::from(solid.is_inside(from))
        } else {
            -lowest
        };
        let mut begins = 0.0;
        for &(fraction, enters) in crossings.iter().chain(&[(1.0, false)]) {
            let before = winding;
            winding += step(enters);
            if before == 0 {
                begins = fraction;
            }
            let ends = before > 0 && (winding <= 0 || fraction == 1.0);
            if ends && fraction > begins {
                self.edges.try_reserve(1)?;
                self.edges.push(EdgeInside {
                    edge,
                    enters: begins as f32,
                    leaves: fraction as f32,
                });
                begins = fraction;
            }
        }
        Ok(())
    }
}

fn check_positions(positions: &[Vec3]) -> Result<()> {
    for (point, position) in positions.iter().enumerate() {
        ensure!(
            position.is_finite(),
            "the position of point {point} is {position}: must be finite"
        );
    }
    Ok(())
}
