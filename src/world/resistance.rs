//! How far tissue is cut by an edge that is ahead of it on a spring (Mahvash, Hayward 2001).

use crate::cutting::Met;
use crate::error::Result;
use crate::memory;

/// What a cut snaps to within a part of a cell lies open before the proxy is there: a gap no longer than this part of a cell is gone through as
/// the tissue before it.
const BRIDGED: f64 = 0.1;

/// An edge that meets a triangle all along at once opens it over no less than this part of its length.
const STEEPEST: f64 = 0.1;

/// What resists along the way of an edge: the spring that it is on, N/m, and the tissue, J/m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resistance {
    pub stiffness: f64,
    pub toughness: f64,
}

/// Where what is met begins or ends, m along the way, and by how much more resists from there on, N.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knot {
    at: f64,
    change: f64,
    begins: bool,
}

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
    /// Triangles are strained each for itself, so that resistance jumps between them; what holds is drawn after that over the length of a cell.
    pub fn advance(
        &self,
        (met, reach): (&[Met], f64),
        way: f64,
        held: Option<f64>,
        knots: &mut Vec<Knot>,
    ) -> Result<Advance> {
        knots.clear();
        let mut size = 0.0_f64;
        for part in met.iter().filter(|part| part.length > 0.0) {
            size = size.max(part.size);
            let [from, to] = part.times.map(|time| time * reach);
            let width = (to - from).max(STEEPEST * part.length);
            let change = self.toughness * part.length / width;
            for (at, change, begins) in [(from, change, true), (from + width, -change, false)] {
                memory::push(knots, Knot { at, change, begins })?;
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
        let (mut level, mut open) = (0.0_f64, 0_u32);
        for index in 0..=knots.len() {
            let knot = knots.get(index);
            let end = knot.map_or(way, |knot| knot.at.min(way));
            if end > at {
                let bridged = force.filter(|_| knot.is_some() && end - at <= BRIDGED * size);
                match (open > 0).then(|| level.max(0.0)).or(bridged) {
                    None => force = None,
                    Some(measured) => {
                        let begun = force.unwrap_or(measured);
                        let resisting = |place: f64| measured + (begun - measured) * (-(place - at) / size).exp();
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
                at = end;
            }
            if let Some(knot) = knot {
                open = if knot.begins { open + 1 } else { open - 1 };
                level = if open > 0 { level + knot.change } else { 0.0 };
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
