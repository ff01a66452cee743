//! Scaling the stiffness and rest size of the tetrahedra in a region.
//!
//! The energy of a tetrahedron is its rest volume times a function of the deformation. Scaling its stiffness by f,
//! with the same Poisson's ratio, therefore scales the volume by f. Scaling its rest length by s scales the volume by
//! s³ and the inverse edge matrix by 1/s. A nodal volume is the sum of these volumes, so each tetrahedron counts in
//! proportion to its stiffness.

use glam::DVec3;

use super::Elements;
use super::parts::{FemPart, PART_SIZE};
use super::tetrahedra::{GROUP, Group};
use crate::base::{Result, ensure};
use crate::soa::{Region, Scale};

/// The nodes of a part that are in a region, one bit each. A tetrahedron has at most four nodes in the part.
struct InsideBits([u64; 4 * PART_SIZE / 64]);

impl InsideBits {
    /// Finds the nodes; `None` if no node is in the region.
    fn find(part: &FemPart, region: &Region) -> Option<Self> {
        let mut bits = [0; 4 * PART_SIZE / 64];
        let mut any = false;
        if part.is_from_cut {
            for (position, node) in part.nodes.iter().enumerate() {
                if region.nodes().binary_search(node).is_ok() {
                    bits[position / 64] |= 1 << (position % 64);
                    any = true;
                }
            }
            return any.then_some(Self(bits));
        }
        let (&first, &last) = (part.nodes.first()?, part.nodes.last()?);
        let nodes = region.nodes();
        let start = nodes.partition_point(|&node| node < first);
        let candidates = nodes[start..].iter().take_while(|&&node| node <= last);
        let mut remaining = &part.nodes[..];
        let mut offset = 0;
        for &node in candidates {
            let skipped = remaining.partition_point(|&other| other < node);
            (remaining, offset) = (&remaining[skipped..], offset + skipped);
            if remaining.first() == Some(&node) {
                bits[offset / 64] |= 1 << (offset % 64);
                any = true;
            }
        }
        any.then_some(Self(bits))
    }

    fn contains(&self, position: usize) -> bool {
        self.0[position / 64] >> (position % 64) & 1 == 1
    }

    /// True if all corners of a tetrahedron are in the region.
    fn contains_all(&self, group: &Group, lane: usize) -> bool {
        let corners = group.corners.iter();
        corners
            .into_iter()
            .all(|corners| self.contains(usize::from(corners[lane] / 2)))
    }
}

/// The volume and the inverse edge matrix of a scaled tetrahedron.
fn scaled(group: &Group, lane: usize, scale: Scale) -> (f32, [f32; 6]) {
    let length = f64::from(scale.length);
    let volume = f64::from(group.volumes[lane]) * f64::from(scale.stiffness) * length.powi(3);
    let inverse = group.inverse.map(|entry| (f64::from(entry[lane]) / length) as f32);
    (volume as f32, inverse)
}

impl Elements {
    /// Returns an error if a scaled tetrahedron would be degenerate or overflow.
    pub fn check_scale(&self, region: &Region, scale: Scale) -> Result<()> {
        for part in &self.parts {
            let Some(inside) = InsideBits::find(part, region) else {
                continue;
            };
            for group in part.groups.as_slice() {
                let occupied = (0..GROUP).filter(|&lane| group.volumes[lane] > 0.0);
                for lane in occupied.filter(|&lane| inside.contains_all(group, lane)) {
                    let (volume, inverse) = scaled(group, lane, scale);
                    let has_volume = volume > 0.0 || scale.stiffness == 0.0;
                    let [xx, _, _, yy, _, zz] = inverse;
                    let has_edges = xx != 0.0 && yy != 0.0 && zz != 0.0;
                    let is_finite = volume.is_finite() && inverse.iter().all(|entry| entry.is_finite());
                    ensure!(
                        has_volume && has_edges && is_finite,
                        "a tetrahedron would have a volume times its stiffness_factor of {volume} m³ at rest: too little or too much"
                    );
                }
            }
        }
        Ok(())
    }

    /// Scales the tetrahedra whose corners are all in the region. Returns their number. [`Self::check_scale`] must
    /// have accepted the scale.
    pub fn scale(&mut self, region: &Region, scale: Scale) -> usize {
        let mut count = 0;
        for part in &mut self.parts {
            let Some(inside) = InsideBits::find(part, region) else {
                continue;
            };
            part.groups.reshape(|group, lane| {
                inside.contains_all(group, lane).then(|| {
                    count += 1;
                    scaled(group, lane, scale)
                })
            });
        }
        if count > 0 {
            self.resum(region);
            self.forget_rates();
        }
        count
    }

    /// Recomputes the sums over tetrahedra at the nodes of a region.
    fn resum(&mut self, region: &Region) {
        let p_wave_modulus = f64::from(self.law.p_wave_modulus());
        for &node in region.nodes() {
            self.stiffnesses[node as usize] = 0.0;
            if let Some(nodal_volumes) = &mut self.nodal_volumes {
                // The offset is kept per unit volume until the new volume is known.
                self.pressure_offsets
                    .scale(node, 1.0 / nodal_volumes.volumes[node as usize]);
                nodal_volumes.volumes[node as usize] = 0.0;
            }
        }
        for part in &self.parts {
            let Some(inside) = InsideBits::find(part, region) else {
                continue;
            };
            let groups = part.groups.as_slice();
            part.visit(&mut |corners, rest, [group, lane]| {
                let positions = groups[group].corners.map(|corners| usize::from(corners[lane] / 2));
                if !positions.iter().any(|&position| inside.contains(position)) {
                    return;
                }
                for ((node, position), gradient) in corners.into_iter().zip(positions).zip(rest.gradients()) {
                    if inside.contains(position) {
                        let stiffness: f64 = rest.volume * p_wave_modulus * DVec3::length_squared(gradient);
                        self.stiffnesses[node as usize] += stiffness as f32;
                        if let Some(nodal_volumes) = &mut self.nodal_volumes {
                            nodal_volumes.volumes[node as usize] += 0.25 * rest.volume as f32;
                        }
                    }
                }
            });
        }
        for &node in region.nodes() {
            if let Some(nodal_volumes) = &mut self.nodal_volumes {
                self.pressure_offsets.scale(node, nodal_volumes.volumes[node as usize]);
            }
        }
    }
}
