//! Points on what is drawn become vertices: those that are there where they are near enough.

use glam::DVec3;

use super::cut::Cut;
use super::divided::NONE;
use super::surface::{SurfaceTriangle, turn};
use crate::base::{Result, memory};

impl Cut<'_> {
    /// The triangles about a vertex, with its number in each.
    pub(crate) fn ring(&self, vertex: u32) -> Result<Vec<(u32, usize)>> {
        let mut ring = memory::reserved(8)?;
        self.surface.ring(vertex, &mut ring)?;
        Ok(ring)
    }

    /// How near what is snapped to a side of a triangle has to be.
    fn snap_at(&self, triangle: u32, side: usize) -> f64 {
        let snap = |triangle: u32| self.surface.cells[self.surface.triangles[triangle].cell].snap;
        let across = self.surface.triangles[triangle].neighbours[side];
        if across == NONE {
            snap(triangle)
        } else {
            snap(triangle).min(snap(across))
        }
    }

    /// The vertex at a point of a triangle's side, `along` of the way to the next corner: one of the side's ends, or a new one.
    pub(crate) fn vertex_at(&mut self, triangle: u32, side: usize, along: f64) -> Result<u32> {
        let corners = self.surface.triangles[triangle].corners;
        let (from, to) = (corners[side], corners[(side + 1) % 3]);
        let length = self.surface.rest_place(from).distance(self.surface.rest_place(to));
        if along.min(1.0 - along) * length <= self.snap_at(triangle, side) {
            return Ok(if along < 0.5 { from } else { to });
        }
        self.split_edge(triangle, side, along)
    }

    /// The vertex at a point in what a triangle has been split into, by weights of its cell: one of the vertices about it, or a new one on an edge
    /// or inside.
    pub(crate) fn vertex_inside(&mut self, triangle: u32, weights: [f64; 3]) -> Result<u32> {
        let (triangle, weights) = self.locate(triangle, weights);
        let SurfaceTriangle { corners, cell, .. } = self.surface.triangles[triangle];
        let places = corners.map(|corner| self.surface.rest_place(corner));
        let place: DVec3 = (0..3).map(|k| weights[k] * places[k]).sum();
        let snap = self.surface.cells[cell].snap;
        if let Some((vertex, ends)) = self.nearest(triangle, place, snap)? {
            self.join(vertex, &ends)?;
            return Ok(vertex);
        }
        let mut edge = (snap * std::f64::consts::FRAC_1_SQRT_2, 0, 0.0);
        for side in 0..3 {
            let (from, to) = (places[side], places[(side + 1) % 3]);
            let way = to - from;
            let along = (place - from).dot(way) / way.length_squared();
            let distance = (from + along * way).distance(place);
            if distance < edge.0 && (0.0..=1.0).contains(&along) {
                edge = (distance, side + 1, along);
            }
        }
        match edge {
            (_, 0, _) => self.split_inside(triangle, weights),
            (_, side, along) => self.split_edge(triangle, side - 1, along),
        }
    }

    /// A vertex is to be joined to the ends of cuts near it.
    pub(crate) fn join(&mut self, vertex: u32, ends: &[u32]) -> Result<()> {
        self.joins.try_reserve(ends.len())?;
        self.joins.extend(ends.iter().map(|&end| [vertex, end]));
        Ok(())
    }

    /// The nearest vertex within `reach` of a point in a triangle, and all ends of cuts within reach, which are to be joined to it.
    pub(crate) fn nearest(&self, triangle: u32, place: DVec3, reach: f64) -> Result<Option<(u32, Vec<u32>)>> {
        let (mut nearest, mut ends) = (None, Vec::new());
        let mut least = f64::INFINITY;
        for (vertex, distance) in self.vertices_about(triangle, place, reach)? {
            let is_cut = self.is_cut_at(vertex)?;
            // Beyond what was cut there may be another vertex at the same place.
            if is_cut && distance > 1e-3 * reach && self.way_out(vertex, place)?.is_none() {
                continue;
            }
            if is_cut && self.is_end(vertex)? {
                memory::push(&mut ends, vertex)?;
            }
            if distance < least {
                (nearest, least) = (Some(vertex), distance);
            }
        }
        Ok(nearest.map(|vertex| (vertex, ends)))
    }

    /// The vertices within `reach` of a point in a triangle, and a little more, so that a point that was snapped before is found again whatever
    /// rounding did; as far as triangles hang together there.
    fn vertices_about(&self, triangle: u32, place: DVec3, reach: f64) -> Result<Vec<(u32, f64)>> {
        let reach = 1.001 * reach;
        let mut seen = memory::reserved(16)?;
        seen.push(triangle);
        let (mut at, mut vertices) = (0, Vec::new());
        while let Some(&triangle) = seen.get(at) {
            at += 1;
            let it = &self.surface.triangles[triangle];
            let places = it.corners.map(|corner| self.surface.rest_place(corner));
            for k in 0..3 {
                let distance = places[k].distance(place);
                if distance <= reach && !vertices.contains(&(it.corners[k], distance)) {
                    memory::push(&mut vertices, (it.corners[k], distance))?;
                }
                let across = it.neighbours[k];
                if across != NONE
                    && !seen.contains(&across)
                    && segment_distance(place, places[k], places[(k + 1) % 3]) <= reach
                {
                    memory::push(&mut seen, across)?;
                }
            }
        }
        Ok(vertices)
    }

    /// Whether an edge at a vertex is cut.
    fn is_cut_at(&self, vertex: u32) -> Result<bool> {
        Ok(self.ring(vertex)?.into_iter().any(|(triangle, corner)| {
            let rim = self.surface.triangles[triangle].rim;
            rim[corner] || rim[(corner + 2) % 3]
        }))
    }

    /// Whether a cut ends at a vertex: one edge there is cut, and the triangles about it hang together from its one side to the other.
    fn is_end(&self, vertex: u32) -> Result<bool> {
        let (mut far, mut count) = ([vertex; 2], 0);
        for (triangle, corner) in self.ring(vertex)? {
            let it = &self.surface.triangles[triangle];
            for (side, other) in [(corner, (corner + 1) % 3), ((corner + 2) % 3, (corner + 2) % 3)] {
                if it.rim[side] {
                    far[count.min(1)] = it.corners[other];
                    count += 1;
                } else if it.neighbours[side] == NONE {
                    return Ok(false);
                }
            }
        }
        Ok(count == 2 && self.surface.rest_place(far[0]) == self.surface.rest_place(far[1]))
    }

    /// The triangle that a point lies in, by weights of its cell, walking from a triangle that it lay in before that was split; and the weights of
    /// that triangle's corners.
    fn locate(&self, mut triangle: u32, point: [f64; 3]) -> (u32, [f64; 3]) {
        let cell = self.surface.triangles[triangle].cell;
        let mut steps = 0;
        loop {
            let it = &self.surface.triangles[triangle];
            let of = it.corners.map(|corner| self.surface.weights_in(corner, cell));
            let whole = turn(of);
            let inside = [0, 1, 2].map(|k| turn([of[(k + 1) % 3], of[(k + 2) % 3], point]) / whole);
            let out = (0..3)
                .filter(|&k| inside[k] < 0.0)
                .map(|k| (k, it.neighbours[(k + 1) % 3]))
                .filter(|&(_, across)| across != NONE && self.surface.triangles[across].cell == cell)
                .min_by(|a, b| inside[a.0].total_cmp(&inside[b.0]));
            steps += 1;
            match out {
                Some((_, across)) if steps < 64 => triangle = across,
                _ => {
                    let inside = inside.map(|weight| weight.max(0.0));
                    let sum: f64 = inside.iter().sum();
                    return (triangle, inside.map(|weight| weight / sum));
                }
            }
        }
    }
}

fn segment_distance(point: DVec3, from: DVec3, to: DVec3) -> f64 {
    let way = to - from;
    let along = (point - from).dot(way) / way.length_squared();
    point.distance(from + along.clamp(0.0, 1.0) * way)
}
