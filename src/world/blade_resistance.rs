//! How far an edge cuts tissue when a spring couples it to the cut (Mahvash, Hayward 2001).

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::cutting::BladeContact;

/// Snapping opens a cut ahead of the proxy. A gap shorter than this fraction of a cell keeps the
/// resistance of the tissue in front of it.
const MAX_GAP: f64 = 0.1;

/// An edge parallel to a triangle's side opens the triangle over at least this fraction of its size.
const MIN_WIDTH: f64 = 0.1;

/// In solids the resistance follows the measured one over this fraction of a cell.
const SMOOTHING: f64 = 0.1;

/// A distance below this fraction of a cell is rounding.
const ROUNDING: f64 = 1e-4;

/// The stiffness of the spring, N/m, and the toughness of the tissue, J/m or J/m².
#[derive(Clone, Copy, Debug)]
pub(super) struct Resistance {
    pub stiffness: f64,
    pub toughness: f64,
}

/// Where an intersection begins or ends along the path, m, and the change of the resistance there, N, and of its slope,
/// N/m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knot {
    at: f64,
    change: f64,
    slope: f64,
    begins: bool,
}

saved! { Knot { at, change, slope, begins } }

/// How far the proxy advances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Advance {
    /// The fraction of the path.
    pub part: f64,
    /// The resistance that stops it, N; `None` if it reaches the true edge.
    pub force: Option<f64>,
    /// True if it passed through tissue.
    pub cuts: bool,
}

impl Resistance {
    /// Advances the proxy along a path of `distance` meters until the spring pulls no harder than the tissue resists.
    /// The work of the spring is then the toughness times the cut. `met` has the intersections up to `reach`; `held` is
    /// the resistance at the start.
    ///
    /// The strain differs from triangle to triangle, so that the measured resistance jumps. The resistance therefore
    /// follows it over the length of a cell, and over less in solids, where an edge is in many cells.
    pub fn advance(
        &self,
        (met, reach): (&[BladeContact], f64),
        distance: f64,
        held: Option<f64>,
        knots: &mut Vec<Knot>,
    ) -> Result<Advance> {
        knots.clear();
        let (mut size, mut smoothing) = (0.0_f64, 0.0_f64);
        for part in met.iter().filter(|part| part.amount > 0.0) {
            size = size.max(part.size);
            smoothing = smoothing.max(if part.is_area { SMOOTHING * part.size } else { part.size });
            let [from, to] = part.times.map(|time| time * reach);
            let width = (to - from).max(MIN_WIDTH * part.size * part.amount / part.unit());
            let mean = self.toughness * part.amount / width;
            let [first, last] = part.profile.map(|part| part * mean);
            let slope = (last - first) / width;
            for (at, change, slope, begins) in [(from, first, slope, true), (from + width, -last, -slope, false)] {
                let knot = Knot {
                    at,
                    change,
                    slope,
                    begins,
                };
                memory::push(knots, knot)?;
            }
        }
        knots.sort_unstable_by(|a, b| a.at.total_cmp(&b.at).then(a.change.total_cmp(&b.change)));
        if let (Some(force), Some(first)) = (held, knots.first())
            && self.stiffness * distance <= force
            && first.at <= MAX_GAP * size
        {
            return Ok(Advance {
                part: 0.0,
                force: held,
                cuts: false,
            });
        }
        let (mut at, mut force, mut cuts) = (0.0, held, false);
        let (mut level, mut slope, mut open) = (0.0_f64, 0.0, 0_u32);
        for index in 0..=knots.len() {
            let knot = knots.get(index);
            let end = knot.map_or(distance, |knot| knot.at.min(distance));
            if force.is_none() && open > 0 && knot.is_some() && end - at <= ROUNDING * size {
                // An edge parallel to a flat side meets all of its triangles at once.
                level += slope * (end - at);
                at = end;
            }
            if end > at {
                let bridged = force.filter(|_| knot.is_some() && end - at <= MAX_GAP * size);
                match (open > 0).then(|| level.max(0.0)).or(bridged) {
                    None => force = None,
                    Some(measured) => {
                        let begun = force.unwrap_or(measured);
                        // The solution of f' = (measured - f) / smoothing.
                        let behind = slope * smoothing;
                        let resisting = |point: f64| {
                            let gone = point - at;
                            let left = (begun - measured + behind) * libm::exp(-gone / smoothing);
                            (measured + slope * gone - behind + left).max(0.0)
                        };
                        let pulling = |point: f64| self.stiffness * (distance - point);
                        if pulling(at) <= begun {
                            return Ok(stopped(at, distance, begun, cuts));
                        }
                        cuts |= open > 0;
                        if pulling(end) < resisting(end) {
                            let point = root([at, end], |point| pulling(point) - resisting(point));
                            return Ok(stopped(point, distance, resisting(point), cuts));
                        }
                        force = Some(resisting(end));
                    }
                }
                level += slope * (end - at);
                at = end;
            }
            if let Some(knot) = knot {
                open = if knot.begins { open + 1 } else { open - 1 };
                (level, slope) = if open > 0 {
                    (level + knot.change, slope + knot.slope)
                } else {
                    (0.0, 0.0)
                };
            }
        }
        Ok(Advance {
            part: 1.0,
            force: None,
            cuts,
        })
    }
}

fn stopped(at: f64, distance: f64, force: f64, cuts: bool) -> Advance {
    Advance {
        part: at / distance,
        force: Some(force),
        cuts,
    }
}

/// The root of a function that is above 0 at the first point and below at the second, by bisection.
fn root([mut above, mut below]: [f64; 2], excess: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (above + below);
        if excess(middle) > 0.0 {
            above = middle;
        } else {
            below = middle;
        }
    }
    below
}
