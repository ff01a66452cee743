//! The surface of a body that meets other tissue.

use glam::Vec3;

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
    /// The mean velocities of nodes over the step, m/s.
    pub means: Vectors,
    /// The mean of them all, m/s, and how far any node leaves that in the step, m.
    pub drift: Vec3,
    pub spread: f32,
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
            means: Vectors::zeros(body.node_count())?,
            drift: Vec3::ZERO,
            spread: 0.0,
            triangles,
        })
    }

    /// Takes the body as it is when a step of `dt` seconds that was tried begins, and where that has led it.
    pub fn follow(&mut self, body: &Body, dt: f32) {
        let (start, end) = (body.state.positions(), body.state.newest().0);
        self.tree
            .refit(|triangle| self.triangles[triangle as usize].map(|node| start.get(node as usize)));
        let mut ways = Bounds::EMPTY;
        for &node in &self.nodes {
            let mean = (end.get(node as usize) - start.get(node as usize)) / dt;
            self.means.set(node as usize, mean);
            ways = ways.with(mean);
        }
        self.drift = 0.5 * (ways.min + ways.max);
        self.spread = 0.5 * dt * (ways.max - ways.min).length();
    }

    /// Shows the triangles that a box comes within `reach` of.
    pub fn near(&self, bounds: &Bounds, reach: f32, mut see: impl FnMut(usize)) {
        self.tree.near(bounds, reach * reach, |place| {
            see(self.tree.triangle(place) as usize);
            reach * reach
        });
    }

    /// The edges that are looked at with a triangle.
    pub fn owned(&self, triangle: usize) -> impl Iterator<Item = [u32; 2]> + '_ {
        let edges = self.owned[triangle].into_iter().filter(|&edge| edge != NONE);
        edges.map(|edge| self.edges[edge as usize])
    }
}
