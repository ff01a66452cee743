//! The ridges of a mesh: whether tissue that its nodes keep out of the mesh may still be entered by a ridge between them.

use glam::Vec3;

use crate::base::{Result, memory};
use crate::geometry::Bounds;
use crate::geometry::tree::Tree;
use crate::mesh::{ClosedSurface, ends_of};

/// The turn of a surface at a convex edge from which that is a ridge, rad: less is how a smooth surface is divided into triangles.
const RIDGE: f32 = 0.7;

/// The triangles at ridges of a surface.
#[derive(Debug)]
pub(super) struct Ridges {
    /// Over them; `None`: there are none.
    tree: Option<Tree>,
    /// By how much the surface turns at the sharpest convex edge of each of them, rad.
    turns: Vec<f32>,
    /// At the sharpest of all, rad.
    sharpest: f32,
}

impl Ridges {
    pub fn of(surface: &ClosedSurface) -> Result<Self> {
        let (positions, triangles) = (surface.positions(), surface.triangles());
        let corners = |face: usize| triangles[face].map(|corner| positions[corner as usize]);
        let normal = |face: usize| {
            let [a, b, c] = corners(face);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let centre = |face: usize| corners(face).iter().sum::<Vec3>() / 3.0;
        let mut edges: Vec<([u32; 2], u32)> = memory::reserved(3 * triangles.len())?;
        for (face, corners) in (0..).zip(triangles) {
            edges.extend(ends_of(*corners).map(|ends| (ends, face)));
        }
        edges.sort_unstable();
        let mut turns = memory::filled(0.0_f32, triangles.len())?;
        for uses in edges.chunk_by(|one, other| one.0 == other.0) {
            for pair in uses.windows(2) {
                let [one, other] = [pair[0].1 as usize, pair[1].1 as usize];
                let is_convex = (centre(other) - centre(one)).dot(normal(one)) < 0.0;
                let turn = normal(one).angle_between(normal(other));
                // Of a triangle without area the turn is not known.
                let turn = if turn.is_finite() { turn } else { std::f32::consts::PI };
                if is_convex && turn > RIDGE {
                    for face in [one, other] {
                        turns[face] = turns[face].max(turn);
                    }
                }
            }
        }
        let mut ridges: Vec<u32> = memory::reserved(triangles.len())?;
        ridges.extend((0..triangles.len() as u32).filter(|&face| turns[face as usize] > 0.0));
        turns.retain(|&turn| turn > 0.0);
        let tree = match ridges.len() {
            0 => None,
            count => Some(Tree::new(count, |ridge| corners(ridges[ridge as usize] as usize))?),
        };
        let sharpest = turns.iter().copied().fold(0.0, f32::max);
        Ok(Self { tree, turns, sharpest })
    }

    /// Whether a ridge within `reach` of these bounds may be deeper than `depth` within a chord of this length whose ends lie on the surface, m: at
    /// most `length turn / 4`.
    pub fn are_near(&self, bounds: &Bounds, reach: f32, length: f32, depth: f32) -> bool {
        let is_deep = |turn: f32| 0.25 * length * turn > depth;
        let mut is_found = false;
        let Some(tree) = self.tree.as_ref().filter(|_| is_deep(self.sharpest)) else {
            return false;
        };
        tree.near(bounds, reach * reach, |place| {
            is_found |= is_deep(self.turns[tree.triangle(place) as usize]);
            if is_found { -1.0 } else { reach * reach }
        });
        is_found
    }
}
