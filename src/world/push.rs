//! A blade's proxies follow it as a step ends, and tissue is cut to them.

use glam::{DVec3, Vec3};

use super::World;
use super::approach::Approach;
use super::blade::{Blade, BladeReport, Proxy, Stand, edge_behind};
use super::holds::{NOWHERE, fill, points_at};
use super::resistance::{Advance, Resistance};
use crate::base::{BodyId, Result};
use crate::cutting::{Met, Sweep};

/// An edge that turned back through no more than this part of a cell is out of the tissue.
const TURNED_BACK: f64 = 0.1;

/// What is met of tissue over less than this part of a cell is rounding.
const CRUMB: f64 = 1e-3;

/// Tissue is looked for so far beyond an edge, as a part of a cell: further than what snapping has opened before it.
const PROBED: f64 = 0.12;

/// Tissue that sprang ahead of an edge by no more than this part of a cell still lies before it.
const SLACK: f64 = 0.2;

/// A proxy that stands in tissue is followed by cuts of no less than this part of a cell: shorter ones would zigzag from what they snap to.
const SHORTEST_CUT: f64 = 0.2;

/// The same in solids: the further the cut is behind, the more it lets go at once, and what springs back then is lost.
const SHORTEST_CUT_IN_SOLIDS: f64 = 0.1;

impl World {
    /// Has the proxy of a blade in a body follow it, and cuts what is between. Where it fails the proxy stays.
    pub(super) fn follow_blade(
        &mut self,
        blade: &mut Blade,
        id: BodyId,
        [start, end]: [[Vec3; 2]; 2],
        dt: f32,
    ) -> Result<()> {
        let body = self.bodies.get(id.0)?;
        let Some(toughness) = body.toughness() else {
            return Ok(());
        };
        let at = blade.proxy(id)?;
        if !blade.filter.meets(body.system().contact.filter) {
            let proxy = &mut blade.proxies[at];
            self.let_go_of_blade(proxy);
            proxy.was_outside = None;
            return Ok(());
        }
        let start = self.start_in(blade, at, start, dt)?;
        let result = if toughness > 0.0 {
            self.push_blade(blade, id, f64::from(toughness), [start, end])
        } else {
            self.pass_blade(blade, at, &Sweep { start, end })
        };
        let stands = self.bodies.get(id.0)?.velocity_about(end, &mut blade.near)?;
        let proxy = &mut blade.proxies[at];
        let has_entered = !proxy.holds.is_empty() || !proxy.stroke.ends().is_empty();
        // One that has just come to the skin has not.
        proxy.was_outside = Some(stands.is_none() || proxy.was_outside == Some(true) && !has_entered);
        result
    }

    /// Where the edge of a blade, which was here in the world as the step began, was then beside the tissue as that is now: tissue may have
    /// come onto it. Where it stood in the tissue, that tells by itself.
    fn start_in(&self, blade: &mut Blade, at: usize, start: [Vec3; 2], dt: f32) -> Result<[Vec3; 2]> {
        let proxy = &blade.proxies[at];
        if !proxy.holds.is_empty() || !proxy.stroke.ends().is_empty() || proxy.was_outside != Some(true) {
            return Ok(start);
        }
        let body = self.bodies.get(proxy.body.0)?;
        let Some(velocity) = body.velocity_about(start, &mut blade.near)? else {
            return Ok(start);
        };
        // What is there now need not be as fast all along.
        for times in [1.0, 2.0, 4.0, 8.0] {
            let before = start.map(|end| end + times * dt * velocity);
            if before.iter().all(|end| end.is_finite()) && body.velocity_about(before, &mut blade.near)?.is_none() {
                return Ok(before);
            }
        }
        Ok(start)
    }

    /// Cuts tissue that does not resist where an edge goes through it, or it goes over the edge.
    fn pass_blade(&mut self, blade: &mut Blade, at: usize, sweep: &Sweep) -> Result<()> {
        let Proxy { body: id, stroke, .. } = &blade.proxies[at];
        let body = self.bodies.get(id.0)?;
        let stands = !stroke.ends().is_empty();
        if sweep.start == sweep.end && !(stands && body.has_gone_on(stroke)) {
            return Ok(());
        }
        body.meet_blade(sweep, &mut blade.near, &mut blade.met)?;
        if !blade.near.is_empty() || stands {
            let proxy = &mut blade.proxies[at];
            blade.report.add(&self.cut_along(proxy.body, sweep, &mut proxy.stroke)?);
        }
        Ok(())
    }

    /// The same where the tissue resists.
    fn push_blade(&mut self, blade: &mut Blade, id: BodyId, toughness: f64, edges: [[Vec3; 2]; 2]) -> Result<()> {
        let mut approach = Approach::of(edges);
        let Some(at) = blade.proxies.iter().position(|proxy| proxy.body == id) else {
            return self.go_on(blade, id, toughness, &mut approach);
        };
        let (proxy, report) = (&mut blade.proxies[at], &mut blade.report);
        self.stand(proxy, &mut approach);
        let Some(stands) = approach.stands() else {
            return self.go_on(blade, id, toughness, &mut approach);
        };
        if !stands.iter().any(Stand::is_beside) {
            // It has left the tissue along itself.
            return self.end_stroke(proxy, [approach.from; 2], report);
        }
        if proxy.came_along().dot(approach.lag) < 0.0 {
            // Behind it is what was gone through: that is open from now on.
            if proxy.uncut > 0.0
                && let Err(error) = self.cut_to(proxy, approach.from, approach.from, report)
            {
                self.let_go_of_blade(proxy);
                return Err(error);
            }
            if approach.way <= SLACK * proxy.size {
                // It hangs loose in its cut, of which it has not gone out.
                return self.hold_blade(proxy, &NOWHERE, edges[1], (blade.stiffness, 0.0));
            }
            self.look_ahead(blade, id, &approach)?;
            if way_through(&blade.met, approach.end) <= TURNED_BACK * blade.proxies[at].size {
                return self.end_stroke(&mut blade.proxies[at], [approach.from; 2], &mut blade.report);
            }
        }
        self.go_on(blade, id, toughness, &mut approach)
    }

    /// Finds where a proxy stands, if it does.
    fn stand(&self, proxy: &Proxy, approach: &mut Approach) {
        let Some(tissue) = &self.tissue else { return };
        let points = proxy.holds.iter().filter_map(|hold| {
            let place = tissue.bonds.place_of(&self.bodies, hold.id)?;
            Some(Stand::next_to(place - hold.offset, approach.end))
        });
        approach.count = approach
            .stands
            .iter_mut()
            .zip(points)
            .map(|(stand, found)| *stand = found)
            .count();
        if let Some(stands) = approach.stands() {
            let count = stands.len() as f64;
            let lag = stands.iter().map(|stand| stand.lag).sum::<DVec3>() / count;
            let way = stands.iter().map(|stand| stand.lag.length()).sum::<f64>() / count;
            let ahead = lag.try_normalize().unwrap_or(proxy.came_along().normalize_or_zero());
            *approach = Approach {
                from: edge_behind(stands, approach.end),
                lag,
                way,
                probe: PROBED * proxy.size * ahead,
                ..*approach
            };
        }
    }

    /// Finds what of a body is ahead of a proxy, and a little beyond the true edge.
    fn look_ahead(&self, blade: &mut Blade, id: BodyId, approach: &Approach) -> Result<()> {
        let end = approach.end.map(|end| (end.as_dvec3() + approach.probe).as_vec3());
        let sweep = Sweep {
            start: approach.from,
            end,
        };
        self.bodies
            .get(id.0)?
            .meet_blade(&sweep, &mut blade.near, &mut blade.met)?;
        if approach.count > 0 {
            let unit = blade.met.iter().map(|part| part.unit()).fold(0.0, f64::max);
            blade.met.retain(|part| part.amount > CRUMB * unit);
        }
        Ok(())
    }

    /// Has a proxy go as far as the true edge draws it through what resists, and cuts that where it is time.
    fn go_on(&mut self, blade: &mut Blade, id: BodyId, toughness: f64, approach: &mut Approach) -> Result<()> {
        self.look_ahead(blade, id, approach)?;
        let known = blade.proxies.iter().position(|proxy| proxy.body == id);
        let standing = known.filter(|_| approach.count > 0);
        if standing.is_none() {
            approach.enter(&blade.met);
        }
        let Approach {
            from, end, lag, way, ..
        } = *approach;
        if blade.met.is_empty() || way == 0.0 && standing.is_none() {
            return match standing {
                Some(at) => self.end_stroke(&mut blade.proxies[at], [from, end], &mut blade.report),
                None => Ok(()),
            };
        }
        let resistance = Resistance {
            stiffness: blade.stiffness,
            toughness,
        };
        let held = standing.map(|at| blade.proxies[at].force);
        let reach = way + approach.probe.length();
        let advance = resistance.advance((&blade.met, reach), way, held, &mut blade.knots)?;
        let at = blade.proxy(id)?;
        let (proxy, report, met) = (&mut blade.proxies[at], &mut blade.report, &blade.met[..]);
        let is_solid = met.iter().any(|part| part.is_area);
        let mut begins = 0.0;
        if standing.is_none() {
            begins = met.iter().map(|part| part.times[0]).fold(1.0, f64::min);
            self.let_go_of_blade(proxy);
            if proxy.was_outside == Some(true) && is_solid {
                // The skin bulges beside where an edge presses it.
                proxy.behind = lag.normalize_or_zero() * size_of(met);
            }
        }
        let Advance {
            mut part,
            mut force,
            cuts,
        } = advance;
        let shortest = if is_solid { SHORTEST_CUT_IN_SOLIDS } else { SHORTEST_CUT };
        let is_due = proxy.uncut + way * (part - begins) >= shortest * size_of(met);
        let is_through = force.is_none() && (cuts || standing.is_some());
        let mut points = NOWHERE;
        let mut result = Ok(());
        if cuts && is_due || is_through {
            let reached = [0, 1].map(|k| from[k].lerp(end[k], part as f32));
            result = self.cut_to(proxy, from, if part == 1.0 { end } else { reached }, report);
            if result.is_ok() {
                let body = self.bodies.get(id.0)?;
                let ends = proxy
                    .stroke
                    .ends()
                    .iter()
                    .filter_map(|&(end, point)| Some((body.hold_at(&end)?, point.as_dvec3())));
                fill(&mut points, ends);
            } else {
                // It stays where it was.
                part = begins;
                force = Some(held.unwrap_or(toughness));
            }
        }
        let Some(force) = force else {
            self.let_go_of_blade(proxy);
            return result;
        };
        if !(cuts && is_due && result.is_ok()) {
            proxy.uncut += way * (part - begins);
            // What comes before the tissue is part of the first cut.
            proxy.behind += lag * part;
            if standing.is_none() || part > 0.0 {
                fill(&mut points, points_at(self.bodies.get(id.0)?, met, part * way / reach));
            }
        }
        proxy.force = force;
        proxy.forward = lag;
        proxy.size = size_of(met);
        report.lag = report.lag.max(way * (1.0 - part));
        // Where tissue is open already it is held by what it was.
        for (hold, stand) in proxy.holds.iter_mut().zip(&approach.stands) {
            hold.offset -= part * stand.lag;
        }
        self.hold_blade(proxy, &points, end, (blade.stiffness, force))?;
        result
    }

    /// Cuts from where the last cut of a proxy that is now here came to, or from where it met the tissue, to another edge.
    fn cut_to(
        &mut self,
        proxy: &mut Proxy,
        here: [Vec3; 2],
        reached: [Vec3; 2],
        report: &mut BladeReport,
    ) -> Result<()> {
        let entered = here.map(|end| (end.as_dvec3() - proxy.behind).as_vec3());
        let sweep = Sweep {
            start: proxy.last.unwrap_or(entered),
            end: reached,
        };
        report.add(&self.cut_along(proxy.body, &sweep, &mut proxy.stroke)?);
        proxy.last = Some(reached);
        proxy.uncut = 0.0;
        proxy.behind = DVec3::ZERO;
        Ok(())
    }

    /// A proxy that is now here stands in its body no more: what it has gone through since the last cut is cut, and on to where nothing is in its way.
    fn end_stroke(
        &mut self,
        proxy: &mut Proxy,
        [here, reached]: [[Vec3; 2]; 2],
        report: &mut BladeReport,
    ) -> Result<()> {
        let result = if proxy.uncut > 0.0 || proxy.last.is_some() && here != reached {
            self.cut_to(proxy, here, reached, report)
        } else {
            Ok(())
        };
        self.let_go_of_blade(proxy);
        result
    }
}

/// The largest of the cells that are met, by their shortest edges, m.
fn size_of(met: &[Met]) -> f64 {
    met.iter().map(|part| part.size).fold(0.0, f64::max)
}

/// How far an edge goes through what is met in the rest shape, m: of solids in the mean along the part of the edge that they are about.
fn way_through(met: &[Met], edge: [Vec3; 2]) -> f64 {
    let amount: f64 = met.iter().map(|part| part.amount).sum();
    if !met.iter().any(|part| part.is_area) {
        return amount;
    }
    let along = (edge[1] - edge[0]).as_dvec3().normalize_or_zero();
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for place in met.iter().flat_map(|part| part.places) {
        low = low.min(along.dot(place));
        high = high.max(along.dot(place));
    }
    amount / (high - low).max(size_of(met))
}
