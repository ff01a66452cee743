//! A tree of boxes over triangles: what is near, and what a ray meets, without looking at all of them.

use glam::{DVec3, Vec3, Vec3A};

use super::Bounds;
use crate::base::{Result, memory};
use crate::codec::saved;

/// Triangles of a leaf at most.
const LEAF: usize = 4;

/// Levels at most: triangles are halved from one to the next, and have 32-bit numbers.
const LEVELS: usize = 40;

/// What rounding may take from the square of a gap, as a part of it.
const ROUNDING: f32 = 1e-6;

/// Triangles in the order of the leaves of a balanced binary tree. Its shape is found once; its boxes follow the triangles.
#[derive(Debug)]
pub(crate) struct Tree {
    nodes: Vec<TreeNode>,
    /// The triangle at each place.
    order: Vec<u32>,
    triangles: Vec<PlacedTriangle>,
}

saved! { Tree { nodes, order, triangles } }

/// A triangle where it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedTriangle {
    pub corners: [Vec3; 3],
    /// Of unit length; 0 where it has no area.
    pub normal: Vec3,
}

saved! { PlacedTriangle { corners, normal } }

#[derive(Clone, Copy, Debug)]
struct TreeNode {
    min: Vec3A,
    max: Vec3A,
    /// The first of its two children, or the place of its first triangle.
    first: u32,
    /// How many triangles a leaf has; 0 for what is none.
    count: u32,
}

saved! { TreeNode { min, max, first, count } }

impl Tree {
    /// Over `count` triangles, halved at the median along the longest side of their centres' box.
    pub fn new(count: usize, corners: impl Fn(u32) -> [Vec3; 3]) -> Result<Self> {
        let mut order: Vec<u32> = memory::collected(0..count as u32)?;
        let mut centres: Vec<Vec3> = memory::reserved(count)?;
        centres.extend(order.iter().map(|&triangle| {
            let [a, b, c] = corners(triangle);
            a + b + c
        }));
        // Every leaf but a lone one has two triangles at least.
        let mut nodes = memory::reserved(count.max(1))?;
        nodes.push(TreeNode::over(0, count));
        let mut waiting = [(0_usize, 0_usize, 0_usize); LEVELS];
        waiting[0] = (0, 0, count);
        let mut waits = 1;
        while waits > 0 {
            waits -= 1;
            let (node, start, end) = waiting[waits];
            if end - start <= LEAF {
                nodes[node] = TreeNode::over(start, end - start);
                continue;
            }
            let part = &mut order[start..end];
            let bounds = Bounds::of(part.iter().map(|&triangle| centres[triangle as usize]));
            let sides = bounds.max - bounds.min;
            let axis = sides.max_position();
            let middle = (end - start) / 2;
            part.select_nth_unstable_by(middle, |&a, &b| {
                let [first, second] = [a, b].map(|triangle| centres[triangle as usize][axis]);
                first.total_cmp(&second).then(a.cmp(&b))
            });
            let children = nodes.len();
            nodes[node] = TreeNode::over(children, 0);
            nodes.push(TreeNode::over(start, middle));
            nodes.push(TreeNode::over(start + middle, end - start - middle));
            // The half that is taken next does not wait long: no more wait than there are levels.
            waiting[waits] = (children + 1, start + middle, end);
            waiting[waits + 1] = (children, start, start + middle);
            waits += 2;
        }
        let mut tree = Self {
            nodes,
            triangles: memory::filled(PlacedTriangle::new([Vec3::ZERO; 3]), count)?,
            order,
        };
        tree.refit(corners);
        Ok(tree)
    }

    /// Takes the triangles where they are now.
    pub fn refit(&mut self, corners: impl Fn(u32) -> [Vec3; 3]) {
        for (place, &triangle) in self.order.iter().enumerate() {
            self.triangles[place] = PlacedTriangle::new(corners(triangle));
        }
        self.fit();
    }

    /// The same, of triangles known by their places.
    pub fn refit_places(&mut self, corners: impl Fn(usize) -> [Vec3; 3]) {
        for (place, taken) in self.triangles.iter_mut().enumerate() {
            *taken = PlacedTriangle::new(corners(place));
        }
        self.fit();
    }

    fn fit(&mut self) {
        // Children come after their parents.
        for index in (0..self.nodes.len()).rev() {
            let node = self.nodes[index];
            let first = node.first as usize;
            let (min, max) = if node.count == 0 && !self.order.is_empty() {
                let [a, b] = [self.nodes[first], self.nodes[first + 1]];
                (a.min.min(b.min), a.max.max(b.max))
            } else {
                let triangles = &self.triangles[first..][..node.count as usize];
                let bounds = Bounds::of(triangles.iter().flat_map(|triangle| triangle.corners));
                (bounds.min.into(), bounds.max.into())
            };
            self.nodes[index] = TreeNode { min, max, ..node };
        }
    }

    /// The box about everything.
    pub fn bounds(&self) -> Bounds {
        Bounds {
            min: self.nodes[0].min.into(),
            max: self.nodes[0].max.into(),
        }
    }

    pub fn triangle_count(&self) -> usize {
        self.order.len()
    }

    /// The number of the triangle at a place.
    pub fn triangle(&self, place: usize) -> u32 {
        self.order[place]
    }

    /// The triangle at a place, where it is.
    #[inline]
    pub fn placed(&self, place: usize) -> &PlacedTriangle {
        &self.triangles[place]
    }

    /// Shows the places of all triangles whose boxes come within a distance of `bounds`, and some more, the nearer half first. The
    /// distance is given by its square, and again after each triangle: what is further than the nearest found is left out.
    #[inline]
    pub fn near(&self, bounds: &Bounds, limit_squared: f32, mut visit: impl FnMut(usize) -> f32) {
        let (low, high) = (Vec3A::from(bounds.min), Vec3A::from(bounds.max));
        let gap = |node: &TreeNode| {
            let apart = (node.min - high).max(low - node.max).max(Vec3A::ZERO);
            apart.length_squared()
        };
        let mut limit = limit_squared * (1.0 + ROUNDING);
        let mut waiting = [(0_u32, 0.0_f32); LEVELS];
        let mut waits = 0;
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
                        waiting[waits] = far;
                        waits += 1;
                    }
                    next = near;
                    continue;
                }
                for place in node.first..node.first + node.count {
                    let [a, b, c] = self.triangles[place as usize].corners.map(Vec3A::from);
                    let of_triangle = TreeNode {
                        min: a.min(b).min(c),
                        max: a.max(b).max(c),
                        ..*node
                    };
                    if gap(&of_triangle) <= limit {
                        limit = visit(place as usize) * (1.0 + ROUNDING);
                    }
                }
            }
            if waits == 0 {
                return;
            }
            waits -= 1;
            next = waiting[waits];
        }
    }

    /// Shows the places of all triangles whose boxes the ray may meet before `limit` times its direction, the nearer half first. The
    /// limit is given again after each triangle.
    pub fn along(&self, origin: Vec3, direction: Vec3, mut limit: f32, mut visit: impl FnMut(usize) -> f32) {
        let start = Vec3A::from(origin);
        // What does not move along an axis is within a slab for ever or never.
        let inverse = Vec3A::from(direction.to_array().map(|along| {
            if along == 0.0 {
                f32::MAX
            } else {
                (1.0 / along).clamp(f32::MIN, f32::MAX)
            }
        }));
        let enters = |node: &TreeNode, limit: f32| {
            let (first, last) = ((node.min - start) * inverse, (node.max - start) * inverse);
            let enter = first.min(last).max_element() * (1.0 - ROUNDING);
            let leave = first.max(last).min_element() * (1.0 + ROUNDING);
            // Written so that what overflowed is looked at.
            let misses = leave < enter || leave < 0.0 || enter > limit;
            (!misses).then_some(enter)
        };
        let mut waiting = [(0_u32, 0.0_f32); LEVELS];
        let mut waits = 0;
        let mut next = enters(&self.nodes[0], limit).map(|enter| (0_u32, enter));
        loop {
            if let Some((index, enter)) = next
                && !(enter > limit)
            {
                let node = &self.nodes[index as usize];
                if node.count == 0 && !self.order.is_empty() {
                    let child = |child: u32| {
                        let index = node.first + child;
                        enters(&self.nodes[index as usize], limit).map(|enter| (index, enter))
                    };
                    next = match (child(0), child(1)) {
                        (Some(a), Some(b)) => {
                            let (near, far) = if b.1 < a.1 { (b, a) } else { (a, b) };
                            waiting[waits] = far;
                            waits += 1;
                            Some(near)
                        }
                        (one, other) => one.or(other),
                    };
                    continue;
                }
                for place in node.first..node.first + node.count {
                    limit = visit(place as usize);
                }
            }
            if waits == 0 {
                return;
            }
            waits -= 1;
            next = Some(waiting[waits]);
        }
    }
}

impl PlacedTriangle {
    pub fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        Self { corners, normal }
    }

    pub fn exact(&self) -> [DVec3; 3] {
        self.corners.map(|corner| corner.as_dvec3())
    }

    /// What the height of a point above its plane lies between, with rounding.
    #[inline]
    pub fn height(&self, point: Vec3) -> (f32, f32) {
        let from = point - self.corners[0];
        let height = from.dot(self.normal);
        let doubt = ROUNDING * from.abs().element_sum();
        (height - doubt, height + doubt)
    }

    /// Whether all of these points are further than `distance` from its plane, on one side.
    #[inline]
    pub fn is_beside(&self, points: &[Vec3], distance: f32) -> bool {
        let mut least = f32::INFINITY;
        let mut most = f32::NEG_INFINITY;
        for &point in points {
            let (low, high) = self.height(point);
            least = least.min(low);
            most = most.max(high);
        }
        least > distance || most < -distance
    }
}

impl TreeNode {
    /// Not fitted yet.
    fn over(first: usize, count: usize) -> Self {
        Self {
            min: Vec3A::ZERO,
            max: Vec3A::ZERO,
            first: first as u32,
            count: count as u32,
        }
    }
}
