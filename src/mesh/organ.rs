//! A liver-like body, filled with well-shaped tetrahedra.

use glam::DVec3;

use super::stuffing::{Lattice, Stuffing};
use super::{Mesh, boundary, is_closed, tetrahedron_volume};
use crate::base::{ensure, memory};
use crate::{Error, Result};

/// The largest spacing, in lengths of the organ: coarser, its thin lobe is lost.
const COARSEST: f64 = 0.125;

impl Mesh {
    /// A smooth, closed body of tetrahedra about the origin, shaped like a liver: `length` metres long, along x; thin in y,
    /// its upper side domed; a fat lobe on the left (-x) and one that tapers to the right, with a notch between them in
    /// front (+z). Its edges are `spacing` metres long on average; `length / spacing` must be at least 8. Its surface is
    /// in `triangles`.
    ///
    /// The dihedral angles of the tetrahedra lie between 10 and 160 degrees: measured 10.7 to 158.4 over 293 spacings from
    /// 1/8 to 1/46 of the length.
    ///
    /// Errors: [`Error::InvalidArgument`] for a length or spacing that is not above 0 and finite, a spacing too coarse to
    /// show the shape, or one so fine that `u32` cannot count the nodes; [`Error::OutOfMemory`].
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
        // The body is two units long here.
        let lattice = Lattice::around([LOW, HIGH], 2.0 * relative)
            .ok_or_else(|| Error::invalid(format!("spacing is {spacing} m: too fine to count the nodes")))?;
        let mut sides = memory::filled(0i8, lattice.node_count())?;
        for (node, side) in sides.iter_mut().enumerate() {
            let value = inside(lattice.position(lattice.site(node)));
            *side = i8::from(value > 0.0) - i8::from(value < 0.0);
        }
        let (nodes, tetrahedra) = Stuffing::new(&lattice, sides, &surface_between).fill()?;

        // Exactly as long as asked for, and about the origin; the shape, and so the angles, stay.
        let low = nodes.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = nodes.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        let scale = f64::from(length) / (high.x - low.x);
        let mut mesh = Mesh {
            tetrahedra,
            ..Mesh::default()
        };
        mesh.positions.try_reserve_exact(nodes.len())?;
        let centre = (low + high) / 2.0;
        mesh.positions
            .extend(nodes.iter().map(|&p| ((p - centre) * scale).as_vec3()));
        mesh.triangles = boundary(&mesh.tetrahedra)?;

        let positive = |t: &[u32; 4]| tetrahedron_volume(mesh.corners(*t)) > 0.0;
        ensure!(
            is_closed(&mesh.triangles)? && mesh.tetrahedra.iter().all(positive),
            "spacing is {spacing} m: no sound mesh of {length} m comes of it"
        );
        Ok(mesh)
    }
}

/// Above 0 inside the body, below outside, 0 on its surface: an ellipsoid with a blunt rim, tapered along x, notched, and
/// bent over the x-z plane. It reaches from -1 to 1 along x.
fn inside(p: DVec3) -> f64 {
    let notch = 0.22 * libm::exp(-((p.x - 0.35) / 0.18).powi(2));
    let half_height = 0.26 * (1.0 - 0.4 * p.x);
    let half_depth = 0.56 * (1.0 - 0.25 * p.x) * (1.0 - notch);
    let y = p.y + 0.16 * p.x * p.x + 0.2 * p.z * p.z;
    // The notch takes from the front only.
    let z = p.z + 0.56 * notch;
    let blunt = |share: f64| (share.powi(2) + share.powi(4)) / 2.0;
    1.0 - blunt(p.x) - (y / half_height).powi(2) - blunt(z / half_depth)
}

/// Where the surface passes between a place inside and one outside.
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

/// A box that holds the body.
const LOW: DVec3 = DVec3::new(-1.0, -0.36, -0.62);
const HIGH: DVec3 = DVec3::new(1.0, 0.3, 0.62);
