//! Tetrahedra that fill what a closed surface encloses.

use glam::{DVec3, IVec3};

use super::hinges::remove_hinges;
use super::stuffing::{Lattice, Site, Stuffing};
use super::{ClosedSurface, Mesh, boundary, tetrahedron_volume, tidy};
use crate::base::{ensure, memory};
use crate::geometry::Bounds;
use crate::geometry::predicates::pierce;
use crate::geometry::tree::Tree;
use crate::{Error, Result};

impl Mesh {
    /// Fills what a surface of triangles encloses with tetrahedra whose edges are `spacing` metres long in the mean; its own surface, in
    /// `triangles`, follows the one given where that is not finer than the spacing.
    ///
    /// Of the surface only its `positions` and `triangles` are used, outward by the right-hand rule; vertices nearer than 1e-6 of the
    /// diagonal of the box around it are one, as in [`tidy`]. It may have several parts and holes, and may cross itself: inside is what it
    /// winds about. What is thinner than about half of the spacing is lost, and with it may be what hangs on that; so is what would
    /// hang on by an edge or a corner alone. Nodes lie on a lattice along the axes but near the surface (isosurface stuffing, Labelle and Shewchuk 2007), so that no dihedral angle is very small: from
    /// some 10 degrees where the surface is smooth beside the spacing, less at its edges and corners.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a position is not finite, an index that of no node, the surface open, inside out or without a volume; the
    /// spacing not finite and above 0, so fine that `u32` cannot count the nodes, or so coarse that nothing is filled. [`Error::OutOfMemory`].
    pub fn filled(surface: &Mesh, spacing: f32) -> Result<Mesh> {
        ensure!(
            spacing.is_normal() && spacing > 0.0,
            "spacing is {spacing} m: it must be finite and above 0"
        );
        let given = Mesh {
            positions: memory::copied(&surface.positions)?,
            triangles: memory::copied(&surface.triangles)?,
            ..Mesh::default()
        };
        ensure!(!given.triangles.is_empty(), "no triangles: they enclose nothing");
        let tidied = tidy(&given)?.mesh;
        let surface = ClosedSurface::loose(tidied.positions, tidied.triangles)?;
        let filling = Filling::new(&surface)?;
        let bounds = filling.tree.bounds();
        let ends = [bounds.min.as_dvec3(), bounds.max.as_dvec3()];
        let lattice = Lattice::around(ends, f64::from(spacing))
            .ok_or_else(|| Error::invalid(format!("spacing is {spacing} m: too fine to count the nodes")))?;
        let sides = filling.sides(&lattice)?;
        let between = |inner: DVec3, outer: DVec3| filling.between(inner, outer);
        let (nodes, tetrahedra) = Stuffing::new(&lattice, sides, &between).fill()?;
        let mut mesh = Mesh {
            tetrahedra,
            ..Mesh::default()
        };
        mesh.positions.try_reserve_exact(nodes.len())?;
        mesh.positions.extend(nodes.iter().map(|place| place.as_vec3()));
        // What rounding to f32 has made flat.
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

/// A surface as a lattice meets it.
struct Filling<'a> {
    surface: &'a ClosedSurface,
    tree: Tree,
}

impl<'a> Filling<'a> {
    fn new(surface: &'a ClosedSurface) -> Result<Self> {
        let corners =
            |triangle: u32| surface.triangles()[triangle as usize].map(|node| surface.positions()[node as usize]);
        Ok(Self {
            surface,
            tree: Tree::new(surface.triangles().len(), corners)?,
        })
    }

    /// Where a segment passes through a triangle of the tree, and whether inward.
    fn pierce(&self, place: usize, from: DVec3, to: DVec3) -> Option<(f64, bool)> {
        let nodes = self.surface.triangles()[self.tree.triangle(place) as usize];
        let corners = nodes.map(|node| self.surface.positions()[node as usize].as_dvec3());
        pierce(from, to, corners, nodes)
    }

    /// For each node of the lattice whether it is inside, 1, or outside, -1: row by row along x, from the outside on.
    fn sides(&self, lattice: &Lattice) -> Result<Vec<i8>> {
        let mut sides = memory::filled(-1i8, lattice.node_count())?;
        let mut crossings: Vec<(f64, i32)> = Vec::new();
        for middle in [false, true] {
            let size = lattice.size(middle);
            for row in 0..size.y * size.z {
                let cell = IVec3::new(0, row % size.y, row / size.y);
                let from = lattice.position(Site { middle, cell });
                let to = from + DVec3::X * (f64::from(size.x - 1) * lattice.side());
                crossings.clear();
                let mut room = Ok(());
                self.tree.near(&roomy(from, to), 0.0, |place| {
                    if let Some((fraction, enters)) = self.pierce(place, from, to)
                        && room.is_ok()
                    {
                        room = memory::push(&mut crossings, (fraction, if enters { 1 } else { -1 }));
                    }
                    0.0
                });
                room?;
                crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
                let mut passed = crossings.iter().peekable();
                let mut winding = 0;
                for x in 0..size.x {
                    let here = f64::from(x) / f64::from(size.x - 1);
                    while let Some((_, change)) = passed.next_if(|crossing| crossing.0 <= here) {
                        winding += change;
                    }
                    let node = lattice.node(Site {
                        middle,
                        cell: cell.with_x(x),
                    });
                    if let Some(node) = node
                        && winding > 0
                    {
                        sides[node] = 1;
                    }
                }
            }
        }
        Ok(sides)
    }

    /// Where the surface passes between a place inside and one outside: nearest to the middle, where it does several times; the middle,
    /// where it is missed by rounding.
    fn between(&self, inner: DVec3, outer: DVec3) -> DVec3 {
        let middle = |fraction: f64| (fraction - 0.5).abs();
        let mut found: Option<f64> = None;
        self.tree.near(&roomy(inner, outer), 0.0, |place| {
            if let Some((fraction, _)) = self.pierce(place, inner, outer)
                && found.is_none_or(|known| middle(fraction) < middle(known))
            {
                found = Some(fraction);
            }
            0.0
        });
        inner.lerp(outer, found.unwrap_or(0.5))
    }
}

/// The box of a segment, and more of it than rounding can matter.
fn roomy(from: DVec3, to: DVec3) -> Bounds {
    let ends = Bounds::of([from, to].map(|end| end.as_vec3()).into_iter());
    let largest = ends.max.abs().max(ends.min.abs()).max(ends.max - ends.min);
    ends.extended(1e-6 * largest.max_element())
}
