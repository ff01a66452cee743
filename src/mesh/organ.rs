//! A liver-shaped body of well-shaped tetrahedra.

use glam::DVec3;

use super::isosurface_stuffing::{IsosurfaceStuffing, Lattice};
use super::{Mesh, boundary, is_closed, tetrahedron_volume};
use crate::base::{ensure, memory};
use crate::{Error, Result};

/// The largest spacing relative to the organ's length; a coarser one loses the thin lobe.
const COARSEST: f64 = 0.125;

impl Mesh {
    /// A smooth, closed, liver-shaped body of tetrahedra, centered at the origin. It is `length` meters long along x
    /// and thin in y, with a domed upper side. A thick lobe is on the left (-x), one that tapers is on the right, and
    /// a notch is between them in front (+z). Its edges have a mean length of `spacing` meters; `length / spacing`
    /// must be at least 8. Its surface is in `triangles`.
    ///
    /// The dihedral angles of the tetrahedra are between 10 and 160 degrees: 10.7 to 158.4 measured for 293 spacings
    /// from 1/8 to 1/46 of the length.
    ///
    /// Errors: [`Error::InvalidArgument`] if the length or spacing is not finite and above 0, the spacing is too
    /// coarse for the shape, or so fine that `u32` cannot count the nodes; [`Error::OutOfMemory`].
    pub fn organ(length: f32, spacing: f32) -> Result<Mesh> {
        for (name, value) in [("length", length), ("spacing", spacing)] {
            ensure!(
                value.is_normal() && value > 0.0,
                "{name} is {value} m: it must be finite and above 0"
            );
        }
        let relative = f64::from(spacing) / f64::from(length);
        ensure!(
            relative <= COARSEST,
            "spacing is {spacing} m: at most {COARSEST} of the length, {length} m, shows the shape"
        );
        // The body has a length of 2 in lattice coordinates.
        let lattice = Lattice::around([LOW, HIGH], 2.0 * relative)
            .ok_or_else(|| Error::invalid(format!("spacing is {spacing} m: too fine to count the nodes")))?;
        let mut sides = memory::filled(0i8, lattice.node_count())?;
        for (node, side) in sides.iter_mut().enumerate() {
            let value = inside(lattice.position(lattice.site(node)));
            *side = i8::from(value > 0.0) - i8::from(value < 0.0);
        }
        let (nodes, tetrahedra) = IsosurfaceStuffing::new(&lattice, sides, &surface_between).fill()?;

        // Scaled to the exact length and centered at the origin; this preserves the shape and the angles.
        let low = nodes.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = nodes.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        let scale = f64::from(length) / (high.x - low.x);
        let mut mesh = Mesh {
            tetrahedra,
            ..Mesh::default()
        };
        mesh.positions.try_reserve_exact(nodes.len())?;
        let center = (low + high) / 2.0;
        mesh.positions
            .extend(nodes.iter().map(|&p| ((p - center) * scale).as_vec3()));
        mesh.triangles = boundary(&mesh.tetrahedra)?;

        let positive = |t: &[u32; 4]| tetrahedron_volume(mesh.corners(*t)) > 0.0;
        ensure!(
            is_closed(&mesh.triangles)? && mesh.tetrahedra.iter().all(positive),
            "spacing is {spacing} m: no sound mesh of {length} m comes of it"
        );
        Ok(mesh)
    }
}

/// An implicit function: positive inside the body, negative outside, 0 on its surface. The shape is an ellipsoid with
/// a blunt rim, tapered along x, notched, and bent over the x-z plane. It extends from -1 to 1 along x.
fn inside(p: DVec3) -> f64 {
    let notch = 0.22 * libm::exp(-((p.x - 0.35) / 0.18).powi(2));
    let half_height = 0.26 * (1.0 - 0.4 * p.x);
    let half_depth = 0.56 * (1.0 - 0.25 * p.x) * (1.0 - notch);
    let y = p.y + 0.16 * p.x * p.x + 0.2 * p.z * p.z;
    // The notch removes from the front only.
    let z = p.z + 0.56 * notch;
    let blunt = |coordinate: f64| (coordinate.powi(2) + coordinate.powi(4)) / 2.0;
    1.0 - blunt(p.x) - (y / half_height).powi(2) - blunt(z / half_depth)
}

/// The point where the surface crosses the segment between an inner and an outer position.
fn surface_between(mut inner: DVec3, mut outer: DVec3) -> DVec3 {
    for _ in 0..50 {
        let middle = (inner + outer) / 2.0;
        if inside(middle) > 0.0 {
            inner = middle;
        } else {
            outer = middle;
        }
    }
    inner
}

/// The bounding box of the body.
const LOW: DVec3 = DVec3::new(-1.0, -0.36, -0.62);
const HIGH: DVec3 = DVec3::new(1.0, 0.3, 0.62);
