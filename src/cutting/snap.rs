//! Turns points of the render mesh into vertices. A point near an existing vertex is snapped to it.

use glam::DVec3;

use super::cell_complex::NONE;
use super::cut::Cut;
use super::surface::{SurfaceTriangle, signed_area_fraction};
use crate::base::{Result, memory};

impl Cut<'_> {
    /// The triangles around a vertex, with its corner index in each.
    pub(crate) fn ring(&self, vertex: u32) -> Result<Vec<(u32, usize)>> {
        let mut ring = memory::reserved(8)?;
        self.surface.ring(vertex, &mut ring)?;
        Ok(ring)
    }

    /// The snapping distance at a side of a triangle.
    fn snap_distance_at(&self, triangle: u32, side: usize) -> f64 {
        let snap = |triangle: u32| self.surface.cells[self.surface.triangles[triangle].cell].snap;
        let across = self.surface.triangles[triangle].neighbors[side];
        if across == NONE {
            snap(triangle)
        } else {
            snap(triangle).min(snap(across))
        }
    }

    /// The vertex at the fraction `along` of a triangle's side: one of its ends, or a new one.
    pub(crate) fn vertex_on_side(&mut self, triangle: u32, side: usize, along: f64) -> Result<u32> {
        let corners = self.surface.triangles[triangle].corners;
        let (from, to) = (corners[side], corners[(side + 1) % 3]);
        let length = self.surface.rest_place(from).distance(self.surface.rest_place(to));
        if along.min(1.0 - along) * length <= self.snap_distance_at(triangle, side) {
            return Ok(if along < 0.5 { from } else { to });
        }
        self.split_edge(triangle, side, along)
    }

    /// The vertex at a point: a vertex near it, or a new one on an edge or inside a triangle. The point is given by
    /// weights of its cell, and `triangle` contained it before it was split.
    pub(crate) fn vertex_in_triangle(&mut self, triangle: u32, weights: [f64; 3]) -> Result<u32> {
        let (triangle, weights) = self.locate(triangle, weights);
        let SurfaceTriangle { corners, cell, .. } = self.surface.triangles[triangle];
        let corner_positions = corners.map(|corner| self.surface.rest_place(corner));
        let position: DVec3 = (0..3).map(|k| weights[k] * corner_positions[k]).sum();
        let snap = self.surface.cells[cell].snap;
        if let Some((vertex, ends)) = self.nearest_vertex(triangle, position, snap)? {
            self.schedule_join(vertex, &ends)?;
            return Ok(vertex);
        }
        let mut edge = (snap * std::f64::consts::FRAC_1_SQRT_2, 0, 0.0);
        for side in 0..3 {
            let (from, to) = (corner_positions[side], corner_positions[(side + 1) % 3]);
            let direction = to - from;
            let along = (position - from).dot(direction) / direction.length_squared();
            let distance = (from + along * direction).distance(position);
            if distance < edge.0 && (0.0..=1.0).contains(&along) {
                edge = (distance, side + 1, along);
            }
        }
        match edge {
            (_, 0, _) => self.split_inside(triangle, weights),
            (_, side, along) => self.split_edge(triangle, side - 1, along),
        }
    }

    /// Schedules edges from a vertex to the ends of cuts near it.
    pub(crate) fn schedule_join(&mut self, vertex: u32, ends: &[u32]) -> Result<()> {
        self.pending_joins.try_reserve(ends.len())?;
        self.pending_joins.extend(ends.iter().map(|&end| [vertex, end]));
        Ok(())
    }

    /// The nearest vertex within `reach` of a point in a triangle, and all ends of cuts within `reach`, which must be
    /// connected to it.
    pub(crate) fn nearest_vertex(&self, triangle: u32, position: DVec3, reach: f64) -> Result<Option<(u32, Vec<u32>)>> {
        let (mut nearest, mut ends) = (None, Vec::new());
        let mut smallest = f64::INFINITY;
        for (vertex, distance) in self.vertices_near(triangle, position, reach)? {
            let is_cut = self.is_cut_at(vertex)?;
            // Beyond a cut, another vertex can be at the same position.
            if is_cut && distance > 1e-3 * reach && self.exit_towards(vertex, position)?.is_none() {
                continue;
            }
            if is_cut && self.is_cut_end(vertex)? {
                memory::push(&mut ends, vertex)?;
            }
            if distance < smallest {
                (nearest, smallest) = (Some(vertex), distance);
            }
        }
        Ok(nearest.map(|vertex| (vertex, ends)))
    }

    /// The vertices within `reach` of a point in a triangle, as far as triangles are connected there. `reach` is
    /// enlarged a little, so that a snapped point is found again in spite of rounding.
    fn vertices_near(&self, triangle: u32, position: DVec3, reach: f64) -> Result<Vec<(u32, f64)>> {
        let reach = 1.001 * reach;
        let mut visited = memory::reserved(16)?;
        visited.push(triangle);
        let (mut at, mut vertices) = (0, Vec::new());
        while let Some(&triangle) = visited.get(at) {
            at += 1;
            let it = &self.surface.triangles[triangle];
            let corner_positions = it.corners.map(|corner| self.surface.rest_place(corner));
            for k in 0..3 {
                let distance = corner_positions[k].distance(position);
                if distance <= reach && !vertices.contains(&(it.corners[k], distance)) {
                    memory::push(&mut vertices, (it.corners[k], distance))?;
                }
                let across = it.neighbors[k];
                if across != NONE
                    && !visited.contains(&across)
                    && segment_distance(position, corner_positions[k], corner_positions[(k + 1) % 3]) <= reach
                {
                    memory::push(&mut visited, across)?;
                }
            }
        }
        Ok(vertices)
    }

    /// True if an edge at a vertex is cut.
    fn is_cut_at(&self, vertex: u32) -> Result<bool> {
        Ok(self.ring(vertex)?.into_iter().any(|(triangle, corner)| {
            let rim = self.surface.triangles[triangle].rim;
            rim[corner] || rim[(corner + 2) % 3]
        }))
    }

    /// True if a cut ends at a vertex: one edge there is cut, and the triangles around it connect its two sides.
    fn is_cut_end(&self, vertex: u32) -> Result<bool> {
        let (mut far_vertices, mut count) = ([vertex; 2], 0);
        for (triangle, corner) in self.ring(vertex)? {
            let it = &self.surface.triangles[triangle];
            for (side, other) in [(corner, (corner + 1) % 3), ((corner + 2) % 3, (corner + 2) % 3)] {
                if it.rim[side] {
                    far_vertices[count.min(1)] = it.corners[other];
                    count += 1;
                } else if it.neighbors[side] == NONE {
                    return Ok(false);
                }
            }
        }
        Ok(count == 2 && self.surface.rest_place(far_vertices[0]) == self.surface.rest_place(far_vertices[1]))
    }

    /// The triangle that contains a point, given by weights of its cell, and the weights of this triangle's corners.
    /// The search walks from a triangle that contained the point before it was split.
    fn locate(&self, mut triangle: u32, point: [f64; 3]) -> (u32, [f64; 3]) {
        let cell = self.surface.triangles[triangle].cell;
        let mut steps = 0;
        loop {
            let it = &self.surface.triangles[triangle];
            let corner_weights = it.corners.map(|corner| self.surface.weights_in(corner, cell));
            let area = signed_area_fraction(corner_weights);
            let inside = [0, 1, 2].map(|k| {
                signed_area_fraction([corner_weights[(k + 1) % 3], corner_weights[(k + 2) % 3], point]) / area
            });
            let exit = (0..3)
                .filter(|&k| inside[k] < 0.0)
                .map(|k| (k, it.neighbors[(k + 1) % 3]))
                .filter(|&(_, across)| across != NONE && self.surface.triangles[across].cell == cell)
                .min_by(|a, b| inside[a.0].total_cmp(&inside[b.0]));
            steps += 1;
            match exit {
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
    let direction = to - from;
    let along = (point - from).dot(direction) / direction.length_squared();
    point.distance(from + along.clamp(0.0, 1.0) * direction)
}
