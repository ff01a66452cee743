//! The surface of a body that meets other tissue.

use glam::{DVec3, Vec3};

use crate::body::{Body, Bounds, Vectors};
use crate::contact::tree::Tree;
use crate::error::Result;
use crate::memory;
use crate::mesh;

/// Where the nodes of a body may go in a step, and the tree of its triangles as the step begins.
#[derive(Debug)]
pub(super) struct Skin {
    /// The nodes of the surface, in the body's own numbers.
    pub nodes: Vec<u32>,
    pub edges: Vec<[u32; 2]>,
    pub triangles: Vec<[u32; 3]>,
    /// The edges that are looked at with a triangle: each with one.
    owned: Vec<[u32; 3]>,
    tree: Tree,
    /// Whether it encloses something.
    pub is_closed: bool,
    /// The edges that pass through other tissue, or the body's own, as the step begins.
    pub pierces: Vec<bool>,
    /// Where the body's coordinates begin.
    pub origin: DVec3,
    /// Where nodes are as a step or substep begins, in the body's coordinates, and how fast they go through it, m/s.
    pub starts: Vectors,
    pub velocities: Vectors,
    /// The middle of these velocities, m/s, and how far any node leaves that, m.
    pub drift: Vec3,
    pub spread: f32,
    /// The box of all velocities that were given.
    pub given: Bounds,
    /// How long its shortest edge was at first, m.
    pub shortest: f32,
}

/// No edge.
const NONE: u32 = u32::MAX;

impl Skin {
    /// That of a body, which has triangles.
    pub fn new(body: &Body) -> Result<Self> {
        let triangles = body.own_surface()?;
        let edges = mesh::edges(&triangles, &[])?;
        let mut owned = memory::filled([NONE; 3], triangles.len())?;
        let mut is_taken = memory::filled(false, edges.len())?;
        for (of_triangle, &[a, b, c]) in owned.iter_mut().zip(&triangles) {
            for (place, [a, b]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
                if let Ok(edge) = edges.binary_search(&[a.min(b), a.max(b)])
                    && !is_taken[edge]
                {
                    is_taken[edge] = true;
                    of_triangle[place] = edge as u32;
                }
            }
        }
        let pierces = memory::filled(false, edges.len())?;
        let mut nodes = memory::copied(triangles.as_flattened())?;
        nodes.sort_unstable();
        nodes.dedup();
        let positions = body.state.positions();
        let at = |node: u32| positions.get(node as usize);
        let tree = Tree::new(triangles.len(), |triangle| triangles[triangle as usize].map(at))?;
        let lengths = edges.iter().map(|&[a, b]| at(a).distance(at(b)));
        Ok(Self {
            shortest: lengths.fold(f32::INFINITY, f32::min),
            nodes,
            edges,
            owned,
            tree,
            is_closed: mesh::is_closed(&triangles)?,
            pierces,
            origin: body.origin,
            starts: Vectors::zeros(body.node_count())?,
            velocities: Vectors::zeros(body.node_count())?,
            drift: Vec3::ZERO,
            spread: 0.0,
            given: Bounds::EMPTY,
            triangles,
        })
    }

    /// Takes a substep of `duration` seconds as it is to be.
    pub fn follow(&mut self, body: &mut Body, duration: f32) {
        let origin = body.origin;
        let state = body.state.substep();
        let (starts, velocities) = (state.positions, &*state.velocities);
        match &body.implicit {
            None => self.take(origin, duration, |node| (starts.get(node), velocities.get(node))),
            Some(implicit) => self.take(origin, duration, |node| (starts.get(node), implicit.mean(node))),
        }
    }

    /// Takes the body as it stands when a step that was tried begins, or as it ends.
    pub fn stand(&mut self, body: &Body, at_end: bool) {
        let positions = if at_end {
            body.state.newest().0
        } else {
            body.state.positions()
        };
        self.take(body.origin, 0.0, |node| (positions.get(node), Vec3::ZERO));
    }

    fn take(&mut self, origin: DVec3, duration: f32, motion_of: impl Fn(usize) -> (Vec3, Vec3)) {
        self.origin = origin;
        self.given = Bounds::EMPTY;
        let mut all = Bounds::EMPTY;
        for &node in &self.nodes {
            let (start, velocity) = motion_of(node as usize);
            self.starts.set(node as usize, start);
            self.velocities.set(node as usize, velocity);
            all = all.with(velocity);
        }
        self.drift = 0.5 * (all.min + all.max);
        self.spread = 0.5 * duration * (all.max - all.min).length();
        let (triangles, starts) = (&self.triangles, &self.starts);
        self.tree
            .refit(|triangle| triangles[triangle as usize].map(|node| starts.get(node as usize)));
    }

    /// Shows the triangles that a box comes within `reach` of.
    pub fn near(&self, bounds: &Bounds, reach: f32, mut see: impl FnMut(usize)) {
        self.tree.near(bounds, reach * reach, |place| {
            see(self.tree.triangle(place) as usize);
            reach * reach
        });
    }

    /// The edges that are looked at with a triangle, but for those that pass through tissue: there is no telling which side they belong to.
    pub fn owned(&self, triangle: usize) -> impl Iterator<Item = [u32; 2]> + '_ {
        let edges = self.owned[triangle].into_iter().filter(|&edge| edge != NONE);
        let edges = edges.map(|edge| edge as usize).filter(|&edge| !self.pierces[edge]);
        edges.map(|edge| self.edges[edge])
    }
}
