//! How far tissue is cut by an edge that is ahead of it on a spring (Mahvash, Hayward 2001).

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::cutting::Met;

/// What a cut snaps to within a part of a cell lies open before the proxy is there: a gap no longer than this part of a cell is gone through as
/// the tissue before it.
const BRIDGED: f64 = 0.1;

/// An edge that meets a triangle all along at once opens it over no less than this part of its length.
const STEEPEST: f64 = 0.1;

/// In solids what holds is drawn after what is measured over this part of a cell.
const DRAWN: f64 = 0.1;

/// What of a way is less than this part of a cell is rounding.
const ROUNDING: f64 = 1e-4;

/// What resists along the way of an edge: the spring that it is on, N/m, and the tissue, J/m or J/m².
#[derive(Clone, Copy, Debug)]
pub(super) struct Resistance {
    pub stiffness: f64,
    pub toughness: f64,
}

/// Where what is met begins or ends, m along the way, and by how much more resists from there on, N, and with each metre, N/m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knot {
    at: f64,
    change: f64,
    slope: f64,
    begins: bool,
}

saved! { Knot { at, change, slope, begins } }

/// How far the proxy follows the true edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Advance {
    /// Which part of the way.
    pub part: f64,
    /// What stops it there, N; `None`: nothing does, and it is where the true edge is.
    pub force: Option<f64>,
    /// Whether it went through tissue.
    pub cuts: bool,
}

impl Resistance {
    /// Lets the proxy go along a way of so many metres, on which, and on to its `reach`, it meets this, until the spring pulls no harder than the tissue resists there; so
    /// what the spring gives is the toughness times what is cut. `held`: what resisted where it stands.
    ///
    /// Triangles are strained each for itself, so that resistance jumps between them; what holds is drawn after that over the length of a cell, or
    /// less in solids, where an edge is in many cells.
    pub fn advance(
        &self,
        (met, reach): (&[Met], f64),
        way: f64,
        held: Option<f64>,
        knots: &mut Vec<Knot>,
    ) -> Result<Advance> {
        knots.clear();
        let (mut size, mut drawn) = (0.0_f64, 0.0_f64);
        for part in met.iter().filter(|part| part.amount > 0.0) {
            size = size.max(part.size);
            drawn = drawn.max(if part.is_area { DRAWN * part.size } else { part.size });
            let [from, to] = part.times.map(|time| time * reach);
            let width = (to - from).max(STEEPEST * part.size * part.amount / part.unit());
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
            && self.stiffness * way <= force
            && first.at <= BRIDGED * size
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
            let end = knot.map_or(way, |knot| knot.at.min(way));
            if force.is_none() && open > 0 && knot.is_some() && end - at <= ROUNDING * size {
                // An edge that comes to a flat side all along meets all that is there at once.
                level += slope * (end - at);
                at = end;
            }
            if end > at {
                let bridged = force.filter(|_| knot.is_some() && end - at <= BRIDGED * size);
                match (open > 0).then(|| level.max(0.0)).or(bridged) {
                    None => force = None,
                    Some(measured) => {
                        let begun = force.unwrap_or(measured);
                        // What f' = (measured - f) / drawn makes of it.
                        let behind = slope * drawn;
                        let resisting = |place: f64| {
                            let gone = place - at;
                            let left = (begun - measured + behind) * libm::exp(-gone / drawn);
                            (measured + slope * gone - behind + left).max(0.0)
                        };
                        let pulling = |place: f64| self.stiffness * (way - place);
                        if pulling(at) <= begun {
                            return Ok(stopped(at, way, begun, cuts));
                        }
                        cuts |= open > 0;
                        if pulling(end) < resisting(end) {
                            let place = meeting([at, end], |place| pulling(place) - resisting(place));
                            return Ok(stopped(place, way, resisting(place), cuts));
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

fn stopped(at: f64, way: f64, force: f64, cuts: bool) -> Advance {
    Advance {
        part: at / way,
        force: Some(force),
        cuts,
    }
}

/// Where what is above 0 at the first place and below at the second is 0.
fn meeting([mut above, mut below]: [f64; 2], excess: impl Fn(f64) -> f64) -> f64 {
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
