//! A bounding volume hierarchy over triangles, for proximity and ray queries.

use glam::{DVec3, Vec3, Vec3A};

use super::Aabb;
use crate::base::{Result, memory};
use crate::codec::saved;

/// The most triangles of a leaf.
const LEAF: usize = 4;

/// The most levels: each level halves the triangles, which have 32-bit indices.
const LEVELS: usize = 40;

/// The relative rounding error of a squared gap.
const ROUNDING: f32 = 1e-6;

/// A balanced binary tree of boxes, with triangles in the order of its leaves. The topology is built once; the boxes
/// are refitted.
#[derive(Debug)]
pub(crate) struct Bvh {
    nodes: Vec<BvhNode>,
    /// The index of the triangle at each slot.
    order: Vec<u32>,
    triangles: Vec<BvhTriangle>,
}

saved! { Bvh { nodes, order, triangles } }

/// A triangle with its current position and normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BvhTriangle {
    pub corners: [Vec3; 3],
    /// A unit vector; 0 if the area is 0.
    pub normal: Vec3,
}

saved! { BvhTriangle { corners, normal } }

#[derive(Clone, Copy, Debug)]
struct BvhNode {
    min: Vec3A,
    max: Vec3A,
    /// The first of two children, or the slot of a leaf's first triangle.
    first: u32,
    /// The number of triangles of a leaf; 0 for an inner node.
    count: u32,
}

saved! { BvhNode { min, max, first, count } }

impl Bvh {
    /// Builds the tree over `count` triangles. Nodes are split at the median along the longest side of the centroids'
    /// box.
    pub fn new(count: usize, corners: impl Fn(u32) -> [Vec3; 3]) -> Result<Self> {
        let mut order: Vec<u32> = memory::collected(0..count as u32)?;
        let mut centroids: Vec<Vec3> = memory::reserved(count)?;
        centroids.extend(order.iter().map(|&triangle| {
            let [a, b, c] = corners(triangle);
            a + b + c
        }));
        // Every leaf has at least two triangles, unless it is the only one.
        let mut nodes = memory::reserved(count.max(1))?;
        nodes.push(BvhNode::over(0, count));
        let mut stack = [(0_usize, 0_usize, 0_usize); LEVELS];
        stack[0] = (0, 0, count);
        let mut stack_size = 1;
        while stack_size > 0 {
            stack_size -= 1;
            let (node, start, end) = stack[stack_size];
            if end - start <= LEAF {
                nodes[node] = BvhNode::over(start, end - start);
                continue;
            }
            let range = &mut order[start..end];
            let bounds = Aabb::of(range.iter().map(|&triangle| centroids[triangle as usize]));
            let sides = bounds.max - bounds.min;
            let axis = sides.max_position();
            let middle = (end - start) / 2;
            range.select_nth_unstable_by(middle, |&a, &b| {
                let [first, second] = [a, b].map(|triangle| centroids[triangle as usize][axis]);
                first.total_cmp(&second).then(a.cmp(&b))
            });
            let children = nodes.len();
            nodes[node] = BvhNode::over(children, 0);
            nodes.push(BvhNode::over(start, middle));
            nodes.push(BvhNode::over(start + middle, end - start - middle));
            // The first half is processed next, so the stack never exceeds the number of levels.
            stack[stack_size] = (children + 1, start + middle, end);
            stack[stack_size + 1] = (children, start, start + middle);
            stack_size += 2;
        }
        let mut tree = Self {
            nodes,
            triangles: memory::filled(BvhTriangle::new([Vec3::ZERO; 3]), count)?,
            order,
        };
        tree.refit(corners);
        Ok(tree)
    }

    /// Moves the triangles to their current positions.
    pub fn refit(&mut self, corners: impl Fn(u32) -> [Vec3; 3]) {
        for (slot, &triangle) in self.order.iter().enumerate() {
            self.triangles[slot] = BvhTriangle::new(corners(triangle));
        }
        self.fit();
    }

    /// Like [`Self::refit`], with triangles given by their slots.
    pub fn refit_slots(&mut self, corners: impl Fn(usize) -> [Vec3; 3]) {
        for (slot, triangle) in self.triangles.iter_mut().enumerate() {
            *triangle = BvhTriangle::new(corners(slot));
        }
        self.fit();
    }

    fn fit(&mut self) {
        // Children have higher indices than their parents.
        for index in (0..self.nodes.len()).rev() {
            let node = self.nodes[index];
            let first = node.first as usize;
            let (min, max) = if node.count == 0 && !self.order.is_empty() {
                let [a, b] = [self.nodes[first], self.nodes[first + 1]];
                (a.min.min(b.min), a.max.max(b.max))
            } else {
                let triangles = &self.triangles[first..][..node.count as usize];
                let bounds = Aabb::of(triangles.iter().flat_map(|triangle| triangle.corners));
                (bounds.min.into(), bounds.max.into())
            };
            self.nodes[index] = BvhNode { min, max, ..node };
        }
    }

    /// The bounding box of all triangles.
    pub fn bounds(&self) -> Aabb {
        Aabb {
            min: self.nodes[0].min.into(),
            max: self.nodes[0].max.into(),
        }
    }

    pub fn triangle_count(&self) -> usize {
        self.order.len()
    }

    /// The index of the triangle in a slot.
    pub fn triangle(&self, slot: usize) -> u32 {
        self.order[slot]
    }

    /// The triangle in a slot, at its current position.
    #[inline]
    pub fn placed(&self, slot: usize) -> &BvhTriangle {
        &self.triangles[slot]
    }

    /// Calls `visit` with the slots of all triangles whose boxes are within a distance of `bounds`, and possibly
    /// others. Nearer nodes come first. `visit` returns the squared distance limit for the triangles that follow.
    #[inline]
    pub fn near(&self, bounds: &Aabb, limit_squared: f32, mut visit: impl FnMut(usize) -> f32) {
        let (low, high) = (Vec3A::from(bounds.min), Vec3A::from(bounds.max));
        let gap = |node: &BvhNode| {
            let separation = (node.min - high).max(low - node.max).max(Vec3A::ZERO);
            separation.length_squared()
        };
        let mut limit = limit_squared * (1.0 + ROUNDING);
        let mut stack = [(0_u32, 0.0_f32); LEVELS];
        let mut stack_size = 0;
        let mut next = (0_u32, gap(&self.nodes[0]));
        loop {
            if next.1 <= limit {
                let node = &self.nodes[next.0 as usize];
                if node.count == 0 && !self.order.is_empty() {
                    let [mut near, mut far] = [0, 1].map(|child| {
                        let index = node.first + child;
                        (index, gap(&self.nodes[index as usize]))
                    });
                    if far.1 < near.1 {
                        (near, far) = (far, near);
                    }
                    if far.1 <= limit {
                        stack[stack_size] = far;
                        stack_size += 1;
                    }
                    next = near;
                    continue;
                }
                for slot in node.first..node.first + node.count {
                    let [a, b, c] = self.triangles[slot as usize].corners.map(Vec3A::from);
                    let triangle_box = BvhNode {
                        min: a.min(b).min(c),
                        max: a.max(b).max(c),
                        ..*node
                    };
                    if gap(&triangle_box) <= limit {
                        limit = visit(slot as usize) * (1.0 + ROUNDING);
                    }
                }
            }
            if stack_size == 0 {
                return;
            }
            stack_size -= 1;
            next = stack[stack_size];
        }
    }

    /// Calls `visit` with the slots of all triangles whose boxes the ray can hit before `limit` times `direction`,
    /// nearer nodes first. `visit` returns the limit for the triangles that follow.
    pub fn along(&self, origin: Vec3, direction: Vec3, mut limit: f32, mut visit: impl FnMut(usize) -> f32) {
        let start = Vec3A::from(origin);
        // For a zero component, the ray is either always or never within the slab.
        let inverse = Vec3A::from(direction.to_array().map(|component| {
            if component == 0.0 {
                f32::MAX
            } else {
                (1.0 / component).clamp(f32::MIN, f32::MAX)
            }
        }));
        let entry_distance = |node: &BvhNode, limit: f32| {
            let (first, last) = ((node.min - start) * inverse, (node.max - start) * inverse);
            let enter = first.min(last).max_element() * (1.0 - ROUNDING);
            let leave = first.max(last).min_element() * (1.0 + ROUNDING);
            // Negated, so that overflowing boxes are visited.
            let misses = leave < enter || leave < 0.0 || enter > limit;
            (!misses).then_some(enter)
        };
        let mut stack = [(0_u32, 0.0_f32); LEVELS];
        let mut stack_size = 0;
        let mut next = entry_distance(&self.nodes[0], limit).map(|enter| (0_u32, enter));
        loop {
            if let Some((index, enter)) = next
                && !(enter > limit)
            {
                let node = &self.nodes[index as usize];
                if node.count == 0 && !self.order.is_empty() {
                    let child = |child: u32| {
                        let index = node.first + child;
                        entry_distance(&self.nodes[index as usize], limit).map(|enter| (index, enter))
                    };
                    next = match (child(0), child(1)) {
                        (Some(a), Some(b)) => {
                            let (near, far) = if b.1 < a.1 { (b, a) } else { (a, b) };
                            stack[stack_size] = far;
                            stack_size += 1;
                            Some(near)
                        }
                        (one, other) => one.or(other),
                    };
                    continue;
                }
                for slot in node.first..node.first + node.count {
                    limit = visit(slot as usize);
                }
            }
            if stack_size == 0 {
                return;
            }
            stack_size -= 1;
            next = Some(stack[stack_size]);
        }
    }
}

impl BvhTriangle {
    pub fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        Self { corners, normal }
    }

    pub fn exact(&self) -> [DVec3; 3] {
        self.corners.map(|corner| corner.as_dvec3())
    }

    /// Lower and upper bounds on the signed height of a point above the plane, including rounding errors.
    #[inline]
    pub fn height(&self, point: Vec3) -> (f32, f32) {
        let from = point - self.corners[0];
        let height = from.dot(self.normal);
        let error = ROUNDING * from.abs().element_sum();
        (height - error, height + error)
    }

    /// True if all points are further than `distance` from the plane, on the same side.
    #[inline]
    pub fn is_beside(&self, points: &[Vec3], distance: f32) -> bool {
        let mut lowest = f32::INFINITY;
        let mut highest = f32::NEG_INFINITY;
        for &point in points {
            let (low, high) = self.height(point);
            lowest = lowest.min(low);
            highest = highest.max(high);
        }
        lowest > distance || highest < -distance
    }
}

impl BvhNode {
    /// A node that still needs to be fitted.
    fn over(first: usize, count: usize) -> Self {
        Self {
            min: Vec3A::ZERO,
            max: Vec3A::ZERO,
            first: first as u32,
            count: count as u32,
        }
    }
}
