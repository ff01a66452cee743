//! Results of a detection.

use glam::{DVec3, Vec3};

use super::surface::Surface;
use crate::base::{Result, memory};

/// Overlap of two surfaces. Index 0 belongs to the first surface, 1 to the second.
///
/// ```
#[doc = include_str!("../../doctest/two_cubes.txt")]
/// # let mut space = ImageSpace::new(&ImageSpaceDefinition::new(0.002), &[&cube, &cube])?;
/// # let overlap = space.detect(&bodies)?;
/// // The second cube is 8 cm along x: the first moves back.
/// assert!(overlap.normal.x < -0.99);
/// assert!((overlap.depth - 0.02).abs() < 0.002);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct Overlap {
    /// Parts of each surface inside the other; empty if the other is open.
    pub inside: [Inside; 2],
    /// Overlap volume, m³, the mean over the views; 0 if a surface is open, and with
    /// [`Form::Counted`](super::Form::Counted).
    pub volume: f64,
    /// Gradient of the volume by each node of each surface, m² (Faure et al. 2008); zero if the volume is 0.
    pub gradients: [Vec<DVec3>; 2],
    /// Unit direction in which the first surface must move so that the volume shrinks fastest, opposite to the
    /// gradient; zero if there is no volume.
    pub normal: Vec3,
    /// Displacement that would reduce the volume to 0 at that rate, m.
    pub depth: f32,
    /// Largest pixel used, m: the requested one, or a power of two times it if the reserved memory was too small.
    pub pixel: f32,
}

/// Parts of a surface inside another.
///
/// ```
#[doc = include_str!("../../doctest/two_cubes.txt")]
/// # let mut space = ImageSpace::new(&ImageSpaceDefinition::new(0.002), &[&cube, &cube])?;
/// # let overlap = space.detect(&bodies)?;
/// let [first, second] = &overlap.inside;
/// assert!(!first.points.is_empty() && !second.points.is_empty());
/// assert_eq!(first.unlisted, 0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug, Default)]
pub struct Inside {
    /// Nodes in ascending order; empty if the surface is open.
    pub points: Vec<PointInside>,
    /// Sorted by edge, then along the edge.
    pub edges: Vec<EdgeInside>,
    /// Number of parts of edges for which the memory was too small.
    pub unlisted: u32,
}

/// A node inside a surface.
///
/// ```
#[doc = include_str!("../../doctest/two_cubes.txt")]
/// # let mut space = ImageSpace::new(&ImageSpaceDefinition::new(0.002), &[&cube, &cube])?;
/// # let overlap = space.detect(&bodies)?;
/// # assert!(!overlap.inside[0].points.is_empty());
/// for point in &overlap.inside[0].points {
///     assert!(mesh.positions[point.node as usize].x > 0.03);
///     assert!(point.depth <= 0.021);
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointInside {
    /// The node.
    pub node: u32,
    /// Distance to the surface along the view, m; the least over all views.
    pub depth: f32,
    /// Triangle of the other surface at that distance.
    pub triangle: u32,
}

/// A part of an edge inside a surface.
///
/// ```
#[doc = include_str!("../../doctest/two_cubes.txt")]
/// # let mut space = ImageSpace::new(&ImageSpaceDefinition::new(0.002), &[&cube, &cube])?;
/// # let overlap = space.detect(&bodies)?;
/// # assert!(!overlap.inside[0].edges.is_empty());
/// for part in &overlap.inside[0].edges {
///     let [start, end] = cube.edges()[part.edge as usize].map(|node| mesh.positions[node as usize]);
///     assert!(start.lerp(end, part.entry).x > 0.028 && start.lerp(end, part.exit).x > 0.028);
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeInside {
    /// Index in [`Surface::edges`].
    pub edge: u32,
    /// Start and end, as fractions of the edge.
    pub entry: f32,
    /// See `entry`.
    pub exit: f32,
    /// Largest distance to the surface along the view, m; the least over all views.
    pub depth: f32,
}

impl Overlap {
    /// Reserves memory for the overlap of any two of these surfaces.
    pub(super) fn reserved(surfaces: &[&Surface]) -> Result<Self> {
        let nodes = surfaces.iter().map(|surface| surface.node_count()).max().unwrap_or(0);
        let edges = surfaces.iter().map(|surface| surface.edges().len()).max().unwrap_or(0);
        let inside = || -> Result<Inside> {
            Ok(Inside {
                points: memory::reserved(3 * nodes)?,
                edges: memory::reserved(4 * edges)?,
                unlisted: 0,
            })
        };
        Ok(Self {
            inside: [inside()?, inside()?],
            volume: 0.0,
            gradients: [memory::reserved(nodes)?, memory::reserved(nodes)?],
            normal: Vec3::ZERO,
            depth: 0.0,
            pixel: 0.0,
        })
    }

    /// True if the memory is sufficient for these two surfaces.
    pub(super) fn fits(&self, surfaces: [&Surface; 2]) -> bool {
        let nodes = self.gradients[0].capacity().min(self.gradients[1].capacity());
        let edges = self.inside[0].edges.capacity().min(self.inside[1].edges.capacity()) / 4;
        let surface_fits = |surface: &Surface| surface.node_count() <= nodes && surface.edges().len() <= edges;
        surfaces.into_iter().all(surface_fits)
    }

    /// Clears the overlap, for surfaces with these numbers of nodes.
    pub(super) fn clear(&mut self, node_counts: [usize; 2], pixel: f32) {
        for inside in &mut self.inside {
            inside.points.clear();
            inside.edges.clear();
            inside.unlisted = 0;
        }
        for (gradient, node_count) in self.gradients.iter_mut().zip(node_counts) {
            gradient.clear();
            gradient.resize(node_count, DVec3::ZERO);
        }
        (self.volume, self.normal, self.depth, self.pixel) = (0.0, Vec3::ZERO, 0.0, pixel);
    }

    /// True if no overlap was found.
    pub fn is_empty(&self) -> bool {
        self.volume == 0.0 && self.inside.iter().all(|i| i.points.is_empty() && i.edges.is_empty())
    }
}

impl Inside {
    /// Adds a part of an edge, merged with the last one if they touch. Parts before `first` belong to other views.
    pub(super) fn add(&mut self, part: EdgeInside, first: usize) {
        if let Some(last) = self.edges[first..].last_mut()
            && last.edge == part.edge
            && part.entry <= last.exit
            && last.entry <= part.exit
        {
            last.entry = last.entry.min(part.entry);
            last.exit = last.exit.max(part.exit);
            last.depth = last.depth.max(part.depth);
        } else if self.edges.len() < self.edges.capacity() {
            self.edges.push(part);
        } else {
            self.unlisted += 1;
        }
    }

    /// Sorts the parts from `first` on and merges those that touch. `depth` combines two depths.
    pub(super) fn merge_edges(&mut self, first: usize, depth: impl Fn(f32, f32) -> f32) {
        let by_position = |a: &EdgeInside, b: &EdgeInside| a.edge.cmp(&b.edge).then(a.entry.total_cmp(&b.entry));
        self.edges[first..].sort_unstable_by(by_position);
        let mut last = first;
        for next in first..self.edges.len() {
            let part = self.edges[next];
            let merged = &mut self.edges[last];
            if part.edge == merged.edge && part.entry <= merged.exit {
                if next > last {
                    merged.exit = merged.exit.max(part.exit);
                    merged.depth = depth(merged.depth, part.depth);
                }
            } else {
                last += 1;
                self.edges[last] = part;
            }
        }
        self.edges.truncate((last + 1).min(self.edges.len()));
    }

    /// Keeps the least depth of each node.
    pub(super) fn merge_points(&mut self) {
        let by_node = |a: &PointInside, b: &PointInside| a.node.cmp(&b.node).then(a.depth.total_cmp(&b.depth));
        self.points.sort_unstable_by(by_node);
        self.points.dedup_by_key(|point| point.node);
    }
}
