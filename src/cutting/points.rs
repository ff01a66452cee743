//! Numbers for what is drawn: of the vertices at a node one has that of the node, any other vertex has one of its own among nodes.

use super::changes::BoundPoint;
use super::cut::Cut;
use super::divided::{NONE, Node};
use super::numbers::FreeNodes;
use super::surface::SurfaceVertex;
use crate::base::{Result, memory};

impl Cut<'_> {
    /// Numbers what is drawn and new, and lists it.
    pub(crate) fn number_points(&mut self) -> Result<()> {
        let before = self.surface.vertices.before()?;
        let has_left = |&(vertex, was): &(u32, SurfaceVertex)| {
            let is = self.surface.vertices[vertex];
            (was.point == was.nodes[0] && is.nodes[0] != was.point).then_some(was.point)
        };
        let made = self.surface.nodes.count_before()..self.surface.nodes.count();
        let mut free = FreeNodes::new(before.iter().filter_map(has_left), made)?;
        let touched = self.surface.vertices.touched()?;
        let mut drawn = memory::reserved(touched.len())?;
        for vertex in touched {
            let it = self.surface.vertices[vertex];
            let is_at_node = it.weights[0] == 1.0;
            let has_own = it.point != NONE && self.surface.nodes[it.point].is_bound();
            let point = if has_own || is_at_node && it.point == it.nodes[0] {
                it.point
            } else if is_at_node && free.take(it.nodes[0]) {
                it.nodes[0]
            } else {
                self.limits
                    .check("nodes", self.surface.nodes.count(), self.limits.nodes)?;
                self.surface.nodes.push(Node::BOUND)?
            };
            if point != it.point {
                self.surface.vertices.edit(vertex, |vertex| vertex.point = point)?;
                let ring = self.ring(vertex)?;
                memory::extend(&mut self.changes.triangles, ring.iter().map(|&(triangle, _)| triangle))?;
            }
            if is_at_node && point == it.nodes[0] {
                drawn.push(point);
            } else {
                let ([a, b, c], [u, v, w]) = (it.nodes, it.weights);
                let bound = BoundPoint {
                    point,
                    nodes: [a, b, c, a],
                    weights: [u, v, w, 0.0],
                };
                memory::push(&mut self.changes.bound, bound)?;
            }
        }
        memory::sort_once(&mut self.changes.triangles);
        self.changes.bound.sort_unstable_by_key(|bound| bound.point);
        memory::sort_once(&mut drawn);
        self.changes.list_copies(&drawn)?;
        // Of a vertex that is at a copy now what it was at has the lower number.
        let vertices = &self.surface.vertices;
        let point_before = |vertex: u32| match before.binary_search_by_key(&vertex, |&(at, _)| at) {
            Ok(place) => before[place].1.point,
            Err(_) => vertices[vertex].point,
        };
        let at = |vertex: u32| [vertices[vertex].point, vertices[vertex].nodes[0]];
        self.changes.list_sources(vertices.count_before(), at, point_before)
    }
}
