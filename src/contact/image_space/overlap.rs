//! What a detection finds.

use glam::{DVec3, Vec3};

use super::surface::Surface;
use crate::base::{Result, memory};

/// What two surfaces have in common. Index 0 belongs to the first, 1 to the second.
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
    /// What of each lies inside the other; nothing where the other is open.
    pub inside: [Inside; 2],
    /// m³, the mean over the views; 0 where one of them is open, and with [`Form::Counted`](super::Form::Counted).
    pub volume: f64,
    /// How the volume changes with each node of each, m² (Faure et al. 2008); zero where the volume is.
    pub gradients: [Vec<DVec3>; 2],
    /// The direction of unit length in which the first has to be moved so that the volume shrinks fastest, opposite to the
    /// gradient; zero where there is no volume.
    pub normal: Vec3,
    /// How far it has to be moved, were the volume to shrink so all the way, m.
    pub depth: f32,
    /// The largest pixel used, m: that asked for, or twice that and so on where it would have needed more memory than was
    /// reserved.
    pub pixel: f32,
}

/// What of a surface lies inside another.
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
    /// In ascending order; none of a surface that is open.
    pub points: Vec<PointInside>,
    /// By edge, then from its first node on.
    pub edges: Vec<EdgeInside>,
    /// Parts of edges inside that there was no room for.
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
    /// The way out along the view, m; the shortest of those of several views.
    pub depth: f32,
    /// The triangle of the other surface at the end of that way.
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
    /// Its place among [`Surface::edges`].
    pub edge: u32,
    /// Where it begins and ends, as fractions of the edge.
    pub entry: f32,
    /// See `entry`.
    pub exit: f32,
    /// The longest of the ways out along the view, m; of several views the one that sees the least.
    pub depth: f32,
}

impl Overlap {
    /// Room for what any two of these surfaces can have in common.
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

    /// Whether there is room for these two.
    pub(super) fn takes(&self, surfaces: [&Surface; 2]) -> bool {
        let nodes = self.gradients[0].capacity().min(self.gradients[1].capacity());
        let edges = self.inside[0].edges.capacity().min(self.inside[1].edges.capacity()) / 4;
        let fits = |surface: &Surface| surface.node_count() <= nodes && surface.edges().len() <= edges;
        surfaces.into_iter().all(fits)
    }

    /// Nothing, between surfaces of so many nodes.
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

    /// Whether anything was found.
    pub fn is_empty(&self) -> bool {
        self.volume == 0.0 && self.inside.iter().all(|i| i.points.is_empty() && i.edges.is_empty())
    }
}

impl Inside {
    /// Adds a part of an edge, joined to the one before where it goes on from there; those before `first` are of other views.
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

    /// Sorts the parts from `first` on and joins what touches: `depth` tells which of two depths that has.
    pub(super) fn join(&mut self, first: usize, depth: impl Fn(f32, f32) -> f32) {
        let by_place = |a: &EdgeInside, b: &EdgeInside| a.edge.cmp(&b.edge).then(a.entry.total_cmp(&b.entry));
        self.edges[first..].sort_unstable_by(by_place);
        let mut last = first;
        for next in first..self.edges.len() {
            let part = self.edges[next];
            let whole = &mut self.edges[last];
            if part.edge == whole.edge && part.entry <= whole.exit {
                if next > last {
                    whole.exit = whole.exit.max(part.exit);
                    whole.depth = depth(whole.depth, part.depth);
                }
            } else {
                last += 1;
                self.edges[last] = part;
            }
        }
        self.edges.truncate((last + 1).min(self.edges.len()));
    }

    /// Keeps of each node the least depth.
    pub(super) fn join_points(&mut self) {
        let by_node = |a: &PointInside, b: &PointInside| a.node.cmp(&b.node).then(a.depth.total_cmp(&b.depth));
        self.points.sort_unstable_by(by_node);
        self.points.dedup_by_key(|point| point.node);
    }
}
