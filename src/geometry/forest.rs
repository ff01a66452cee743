//! Trees over the triangles of a surface that may be cut: that of the surface as it was made, and trees of those that cuts have added.

use super::Bounds;
use super::tree::{PlacedTriangle, Tree};
use crate::base::Result;
use crate::codec::saved;
use glam::Vec3;

/// Trees, each over the triangles that follow those of the one before. Of the later ones each has twice as many as the next or more (Bentley,
/// Saxe 1980): there are few of them, and what a cut costs is a matter of what it adds, but for a factor of the logarithm of what all have added.
#[derive(Debug)]
pub(crate) struct Forest {
    first: Tree,
    later: Vec<Later>,
}

saved! { Forest { first, later } }

/// A tree of triangles that came later.
#[derive(Debug)]
pub(crate) struct Later {
    /// The number of its first triangle.
    from: usize,
    tree: Tree,
}

saved! { Later { from, tree } }

impl Forest {
    /// Over so many triangles.
    pub fn new(count: usize, corners: impl Fn(u32) -> [Vec3; 3]) -> Result<Self> {
        Ok(Self {
            first: Tree::new(count, corners)?,
            later: Vec::new(),
        })
    }

    pub fn triangle_count(&self) -> usize {
        let last = self.later.last();
        last.map_or(self.first.triangle_count(), |last| {
            last.from + last.tree.triangle_count()
        })
    }

    /// The tree that is to be [added](Self::add) where so many triangles follow the last, all with these corners, for which there is room then.
    pub fn with_more(&mut self, more: usize, corners: impl Fn(u32) -> [Vec3; 3]) -> Result<Option<Later>> {
        if more == 0 {
            return Ok(None);
        }
        let end = self.triangle_count() + more;
        let mut from = self.triangle_count();
        for later in self.later.iter().rev() {
            if later.tree.triangle_count() >= 2 * (end - from) {
                break;
            }
            from = later.from;
        }
        self.later.try_reserve(1)?;
        let tree = Tree::new(end - from, |triangle| corners(from as u32 + triangle))?;
        Ok(Some(Later { from, tree }))
    }

    /// Adds a tree, instead of those whose triangles it has.
    pub fn add(&mut self, tree: Later) {
        self.later.retain(|later| later.from < tree.from);
        self.later.push(tree);
    }

    /// Takes the triangles where they are now.
    pub fn refit(&mut self, corners: impl Fn(u32) -> [Vec3; 3]) {
        self.first.refit(&corners);
        for later in &mut self.later {
            let from = later.from as u32;
            later.tree.refit(|triangle| corners(from + triangle));
        }
    }

    /// The box about everything.
    pub fn bounds(&self) -> Bounds {
        let later = self.later.iter().map(|later| later.tree.bounds());
        later.fold(self.first.bounds(), |all, bounds| all.and(&bounds))
    }

    /// The triangles where they are, in some order.
    pub fn placed(&self) -> impl Iterator<Item = &PlacedTriangle> {
        let later = self.later.iter().map(|later| &later.tree);
        let trees = std::iter::once(&self.first).chain(later);
        trees.flat_map(|tree| (0..tree.triangle_count()).map(|place| tree.placed(place)))
    }

    /// Shows the triangles whose boxes come within `reach` of this one, and some more.
    pub fn near(&self, bounds: &Bounds, reach: f32, mut see: impl FnMut(usize)) {
        self.nearest(bounds, reach, |triangle| {
            see(triangle);
            reach
        });
    }

    /// The same, where `see` tells after each triangle how far the next ones may be.
    pub fn nearest(&self, bounds: &Bounds, mut reach: f32, mut see: impl FnMut(usize) -> f32) {
        let later = self.later.iter().map(|later| (later.from, &later.tree));
        for (from, tree) in std::iter::once((0, &self.first)).chain(later) {
            tree.near(bounds, reach * reach, |place| {
                reach = see(from + tree.triangle(place) as usize);
                reach * reach
            });
        }
    }

    /// Shows the triangles whose boxes the ray may meet before `limit` times its direction; `see` tells the limit after each triangle.
    pub fn along(&self, origin: Vec3, direction: Vec3, mut limit: f32, mut see: impl FnMut(usize) -> f32) {
        let later = self.later.iter().map(|later| (later.from, &later.tree));
        for (from, tree) in std::iter::once((0, &self.first)).chain(later) {
            tree.along(origin, direction, limit, |place| {
                limit = see(from + tree.triangle(place) as usize);
                limit
            });
        }
    }
}
