//! Tetrahedra of a region made stiffer and larger.
//!
//! The energy of a tetrahedron is its volume at rest times a function of the deformation, so one that is f times as stiff, with the same
//! Poisson's ratio, has f times the volume; and one that is s times as long at rest has s³ times the volume, and the inverse of its edges
//! over s. Of rings the volume is the sum of those, by which each tetrahedron counts as much as it is stiff.

use glam::DVec3;

use super::Elements;
use super::parts::{FemPart, PART};
use super::tetrahedra::{GROUP, Group};
use crate::base::{Result, ensure};
use crate::soa::{Region, Scale};

/// Which nodes of a part are in a region: a bit each, of which tetrahedra have four at most.
struct InsideBits([u64; 4 * PART / 64]);

impl InsideBits {
    /// `None`: no node is.
    fn of(part: &FemPart, region: &Region) -> Option<Self> {
        let mut bits = [0; 4 * PART / 64];
        let mut any = false;
        if part.is_later {
            for (place, node) in part.nodes.iter().enumerate() {
                if region.nodes().binary_search(node).is_ok() {
                    bits[place / 64] |= 1 << (place % 64);
                    any = true;
                }
            }
            return any.then_some(Self(bits));
        }
        let (&first, &last) = (part.nodes.first()?, part.nodes.last()?);
        let nodes = region.nodes();
        let start = nodes.partition_point(|&node| node < first);
        let near = nodes[start..].iter().take_while(|&&node| node <= last);
        let mut rest = &part.nodes[..];
        let mut base = 0;
        for &node in near {
            let skipped = rest.partition_point(|&other| other < node);
            (rest, base) = (&rest[skipped..], base + skipped);
            if rest.first() == Some(&node) {
                bits[base / 64] |= 1 << (base % 64);
                any = true;
            }
        }
        any.then_some(Self(bits))
    }

    fn has(&self, place: usize) -> bool {
        self.0[place / 64] >> (place % 64) & 1 == 1
    }

    /// Whether all corners of a tetrahedron are inside.
    fn has_all(&self, group: &Group, lane: usize) -> bool {
        let corners = group.corners.iter();
        corners
            .into_iter()
            .all(|corners| self.has(usize::from(corners[lane] / 2)))
    }
}

/// The volume and the inverse of a tetrahedron once it is scaled.
fn scaled(group: &Group, lane: usize, scale: Scale) -> (f32, [f32; 6]) {
    let length = f64::from(scale.length);
    let volume = f64::from(group.volumes[lane]) * f64::from(scale.stiffness) * length.powi(3);
    let inverse = group.inverse.map(|entry| (f64::from(entry[lane]) / length) as f32);
    (volume as f32, inverse)
}

impl Elements {
    /// Refuses to scale what would be no tetrahedron any more.
    pub fn check_scale(&self, region: &Region, scale: Scale) -> Result<()> {
        for part in &self.parts {
            let Some(inside) = InsideBits::of(part, region) else {
                continue;
            };
            for group in part.groups.as_slice() {
                let there = (0..GROUP).filter(|&lane| group.volumes[lane] > 0.0);
                for lane in there.filter(|&lane| inside.has_all(group, lane)) {
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

    /// Scales the tetrahedra with all corners in a region, which must not be refused: how many.
    pub fn scale(&mut self, region: &Region, scale: Scale) -> usize {
        let mut count = 0;
        for part in &mut self.parts {
            let Some(inside) = InsideBits::of(part, region) else {
                continue;
            };
            part.groups.reshape(|group, lane| {
                inside.has_all(group, lane).then(|| {
                    count += 1;
                    scaled(group, lane, scale)
                })
            });
        }
        if count > 0 {
            self.add_up_again(region);
            self.forget_rates();
        }
        count
    }

    /// Makes the sums over the tetrahedra at the nodes of a region what they are now.
    fn add_up_again(&mut self, region: &Region) {
        let whole = f64::from(self.law.whole());
        for &node in region.nodes() {
            self.stiffnesses[node as usize] = 0.0;
            if let Some(rings) = &mut self.rings {
                // Of a volume of 1 m³, until it is known how large it is.
                self.offsets.scale(node, 1.0 / rings.volumes[node as usize]);
                rings.volumes[node as usize] = 0.0;
            }
        }
        for part in &self.parts {
            let Some(inside) = InsideBits::of(part, region) else {
                continue;
            };
            let groups = part.groups.as_slice();
            part.visit(&mut |corners, rest, [group, lane]| {
                let places = groups[group].corners.map(|corners| usize::from(corners[lane] / 2));
                if !places.iter().any(|&place| inside.has(place)) {
                    return;
                }
                for ((node, place), gradient) in corners.into_iter().zip(places).zip(rest.gradients()) {
                    if inside.has(place) {
                        let stiffness: f64 = rest.volume * whole * DVec3::length_squared(gradient);
                        self.stiffnesses[node as usize] += stiffness as f32;
                        if let Some(rings) = &mut self.rings {
                            rings.volumes[node as usize] += 0.25 * rest.volume as f32;
                        }
                    }
                }
            });
        }
        for &node in region.nodes() {
            if let Some(rings) = &mut self.rings {
                self.offsets.scale(node, rings.volumes[node as usize]);
            }
        }
    }
}
