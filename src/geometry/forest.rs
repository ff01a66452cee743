//! Bounding volume hierarchies of a surface that can be cut: one of the original surface, and others of triangles that
//! cuts have added.

use super::Aabb;
use super::bvh::{Bvh, BvhTriangle};
use crate::base::Result;
use crate::codec::saved;
use glam::Vec3;

/// Trees over consecutive ranges of triangles. Each tree of added triangles has at least twice as many as the next one
/// (Bentley, Saxe 1980). So there are few trees, and the cost of a cut is proportional to what it adds, times a
/// logarithm of all added triangles.
#[derive(Debug)]
pub(crate) struct Forest {
    first: Bvh,
    added: Vec<AddedTree>,
}

saved! { Forest { first, added } }

/// A tree of added triangles.
#[derive(Debug)]
pub(crate) struct AddedTree {
    /// The index of its first triangle.
    start: usize,
    tree: Bvh,
}

saved! { AddedTree { start, tree } }

impl Forest {
    /// Builds a tree over `count` triangles.
    pub fn new(count: usize, corners: impl Fn(u32) -> [Vec3; 3]) -> Result<Self> {
        Ok(Self {
            first: Bvh::new(count, corners)?,
            added: Vec::new(),
        })
    }

    pub fn triangle_count(&self) -> usize {
        let last = self.added.last();
        last.map_or(self.first.triangle_count(), |last| {
            last.start + last.tree.triangle_count()
        })
    }

    /// Builds the tree to be [added](Self::add) when `count` triangles follow the last. `corners` returns the corners
    /// of any triangle. Reserves memory for the tree.
    pub fn build_added(&mut self, count: usize, corners: impl Fn(u32) -> [Vec3; 3]) -> Result<Option<AddedTree>> {
        if count == 0 {
            return Ok(None);
        }
        let end = self.triangle_count() + count;
        let mut start = self.triangle_count();
        for added in self.added.iter().rev() {
            if added.tree.triangle_count() >= 2 * (end - start) {
                break;
            }
            start = added.start;
        }
        self.added.try_reserve(1)?;
        let tree = Bvh::new(end - start, |triangle| corners(start as u32 + triangle))?;
        Ok(Some(AddedTree { start, tree }))
    }

    /// Adds a tree and removes those whose triangles it contains.
    pub fn add(&mut self, tree: AddedTree) {
        self.added.retain(|added| added.start < tree.start);
        self.added.push(tree);
    }

    /// Moves the triangles to their current positions.
    pub fn refit(&mut self, corners: impl Fn(u32) -> [Vec3; 3]) {
        self.first.refit(&corners);
        for added in &mut self.added {
            let start = added.start as u32;
            added.tree.refit(|triangle| corners(start + triangle));
        }
    }

    /// The bounding box of all triangles.
    pub fn bounds(&self) -> Aabb {
        let added = self.added.iter().map(|added| added.tree.bounds());
        added.fold(self.first.bounds(), |all, bounds| all.and(&bounds))
    }

    /// All triangles with their current positions, in an unspecified order.
    pub fn placed(&self) -> impl Iterator<Item = &BvhTriangle> {
        let added = self.added.iter().map(|added| &added.tree);
        let trees = std::iter::once(&self.first).chain(added);
        trees.flat_map(|tree| (0..tree.triangle_count()).map(|slot| tree.placed(slot)))
    }

    /// Calls `f` with the triangles whose boxes are within `reach` of `bounds`, and possibly others.
    pub fn near(&self, bounds: &Aabb, reach: f32, mut f: impl FnMut(usize)) {
        self.nearest(bounds, reach, |triangle| {
            f(triangle);
            reach
        });
    }

    /// Like [`Self::near`], but `f` returns the reach for the triangles that follow.
    pub fn nearest(&self, bounds: &Aabb, mut reach: f32, mut f: impl FnMut(usize) -> f32) {
        let added = self.added.iter().map(|added| (added.start, &added.tree));
        for (start, tree) in std::iter::once((0, &self.first)).chain(added) {
            tree.near(bounds, reach * reach, |slot| {
                reach = f(start + tree.triangle(slot) as usize);
                reach * reach
            });
        }
    }

    /// Calls `f` with the triangles whose boxes the ray can hit before `limit` times `direction`. `f` returns the
    /// limit for the triangles that follow.
    pub fn along(&self, origin: Vec3, direction: Vec3, mut limit: f32, mut f: impl FnMut(usize) -> f32) {
        let added = self.added.iter().map(|added| (added.start, &added.tree));
        for (start, tree) in std::iter::once((0, &self.first)).chain(added) {
            tree.along(origin, direction, limit, |slot| {
                limit = f(start + tree.triangle(slot) as usize);
                limit
            });
        }
    }
}
