//! Tetrahedralization of the inside of a closed surface.

use glam::{DVec3, IVec3};

use super::hinges::remove_hinges;
use super::isosurface_stuffing::{IsosurfaceStuffing, Lattice, Site};
use super::{ClosedSurface, Mesh, boundary, tetrahedron_volume, tidy};
use crate::base::{ensure, memory};
use crate::geometry::Aabb;
use crate::geometry::bvh::Bvh;
use crate::geometry::predicates::pierce;
use crate::{Error, Result};

impl Mesh {
    /// Fills the inside of a surface with tetrahedra whose edges have a mean length of `spacing` meters. The result's
    /// own surface, in `triangles`, follows the given one where that has no detail finer than the spacing.
    ///
    /// Only `positions` and `triangles` of the surface are used; triangles face outward by the right-hand rule.
    /// Vertices nearer than 1e-6 of the bounding box's diagonal are merged, as in [`tidy`]. The surface may have
    /// several components and holes, and may intersect itself: inside is where the winding number is positive. Parts
    /// thinner than about half of the spacing are lost, and so may be parts attached by them. Parts attached only by
    /// an edge or a corner are removed. Nodes lie on an axis-aligned lattice except near the surface (isosurface
    /// stuffing, Labelle and Shewchuk 2007). Dihedral angles are at least about 10 degrees where the surface is smooth
    /// relative to the spacing, and less at its edges and corners.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] in these cases: a position is not finite; an index is out of range; the surface is
    /// open, inverted or without a volume; the spacing is not finite and above 0, is so fine that `u32` cannot count
    /// the nodes, or is so coarse that no tetrahedron results. [`Error::OutOfMemory`].
    pub fn filled(surface: &Mesh, spacing: f32) -> Result<Mesh> {
        ensure!(
            spacing.is_normal() && spacing > 0.0,
            "spacing is {spacing} m: it must be finite and above 0"
        );
        let input = Mesh {
            positions: memory::copied(&surface.positions)?,
            triangles: memory::copied(&surface.triangles)?,
            ..Mesh::default()
        };
        ensure!(!input.triangles.is_empty(), "no triangles: they enclose nothing");
        let repaired = tidy(&input)?.mesh;
        let surface = ClosedSurface::allowing_intersections(repaired.positions, repaired.triangles)?;
        let intersection = LatticeIntersection::new(&surface)?;
        let bounds = intersection.tree.bounds();
        let ends = [bounds.min.as_dvec3(), bounds.max.as_dvec3()];
        let lattice = Lattice::around(ends, f64::from(spacing))
            .ok_or_else(|| Error::invalid(format!("spacing is {spacing} m: too fine to count the nodes")))?;
        let node_sides = intersection.node_sides(&lattice)?;
        let between = |inner: DVec3, outer: DVec3| intersection.between(inner, outer);
        let (nodes, tetrahedra) = IsosurfaceStuffing::new(&lattice, node_sides, &between).fill()?;
        let mut mesh = Mesh {
            tetrahedra,
            ..Mesh::default()
        };
        mesh.positions.try_reserve_exact(nodes.len())?;
        mesh.positions.extend(nodes.iter().map(|position| position.as_vec3()));
        // Rounding to f32 can make a tetrahedron flat.
        let Mesh {
            positions, tetrahedra, ..
        } = &mut mesh;
        tetrahedra.retain(|tetrahedron| {
            let corners = tetrahedron.map(|node| positions[node as usize].as_dvec3());
            tetrahedron_volume(corners) > 0.0
        });
        remove_hinges(tetrahedra, positions.len())?;
        ensure!(
            !mesh.tetrahedra.is_empty(),
            "spacing is {spacing} m: too coarse for anything of the surface to be filled"
        );
        let mut mesh = tidy(&mesh)?.mesh;
        mesh.triangles = boundary(&mesh.tetrahedra)?;
        Ok(mesh)
    }
}

/// A surface and its search tree, for intersection with a lattice.
struct LatticeIntersection<'a> {
    surface: &'a ClosedSurface,
    tree: Bvh,
}

impl<'a> LatticeIntersection<'a> {
    fn new(surface: &'a ClosedSurface) -> Result<Self> {
        let corners =
            |triangle: u32| surface.triangles()[triangle as usize].map(|node| surface.positions()[node as usize]);
        Ok(Self {
            surface,
            tree: Bvh::new(surface.triangles().len(), corners)?,
        })
    }

    /// The fraction of a segment at which it crosses a triangle of the tree, and whether inward.
    fn pierce(&self, index: usize, from: DVec3, to: DVec3) -> Option<(f64, bool)> {
        let nodes = self.surface.triangles()[self.tree.triangle(index) as usize];
        let corners = nodes.map(|node| self.surface.positions()[node as usize].as_dvec3());
        pierce(from, to, corners, nodes)
    }

    /// For each lattice node 1 if it is inside, else -1. Each row along x is traversed from outside.
    fn node_sides(&self, lattice: &Lattice) -> Result<Vec<i8>> {
        let mut node_sides = memory::filled(-1i8, lattice.node_count())?;
        let mut crossings: Vec<(f64, i32)> = Vec::new();
        for is_center in [false, true] {
            let size = lattice.size(is_center);
            for row in 0..size.y * size.z {
                let cell = IVec3::new(0, row % size.y, row / size.y);
                let from = lattice.position(Site { is_center, cell });
                let to = from + DVec3::X * (f64::from(size.x - 1) * lattice.side());
                crossings.clear();
                let mut result = Ok(());
                self.tree.near(&extended_box(from, to), 0.0, |index| {
                    if let Some((fraction, enters)) = self.pierce(index, from, to)
                        && result.is_ok()
                    {
                        result = memory::push(&mut crossings, (fraction, if enters { 1 } else { -1 }));
                    }
                    0.0
                });
                result?;
                crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
                let mut passed = crossings.iter().peekable();
                let mut winding = 0;
                for x in 0..size.x {
                    let node_fraction = f64::from(x) / f64::from(size.x - 1);
                    while let Some((_, winding_change)) = passed.next_if(|crossing| crossing.0 <= node_fraction) {
                        winding += winding_change;
                    }
                    let node = lattice.node(Site {
                        is_center,
                        cell: cell.with_x(x),
                    });
                    if let Some(node) = node
                        && winding > 0
                    {
                        node_sides[node] = 1;
                    }
                }
            }
        }
        Ok(node_sides)
    }

    /// The point between an inner and an outer position where the surface crosses the segment. Of several it is the
    /// one nearest to the middle; the middle itself if rounding misses the surface.
    fn between(&self, inner: DVec3, outer: DVec3) -> DVec3 {
        let offset_from_middle = |fraction: f64| (fraction - 0.5).abs();
        let mut nearest: Option<f64> = None;
        self.tree.near(&extended_box(inner, outer), 0.0, |index| {
            if let Some((fraction, _)) = self.pierce(index, inner, outer)
                && nearest.is_none_or(|other| offset_from_middle(fraction) < offset_from_middle(other))
            {
                nearest = Some(fraction);
            }
            0.0
        });
        inner.lerp(outer, nearest.unwrap_or(0.5))
    }
}

/// The bounding box of a segment, extended by more than rounding errors.
fn extended_box(from: DVec3, to: DVec3) -> Aabb {
    let ends = Aabb::of([from, to].map(|end| end.as_vec3()).into_iter());
    let largest = ends.max.abs().max(ends.min.abs()).max(ends.max - ends.min);
    ends.extended(1e-6 * largest.max_element())
}
