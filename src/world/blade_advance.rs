//! Advances the proxies of a blade at the end of a step, and cuts tissue up to them.

use glam::{DVec3, Vec3};

use super::World;
use super::blade::{Blade, BladeReport, EdgePoint, Proxy, lagging_edge};
use super::blade_coupling::{NOWHERE, fill, points_at};
use super::blade_resistance::{Advance, Resistance};
use super::proxy_motion::Approach;
use crate::base::{BodyId, Result};
use crate::cutting::{BladeContact, Sweep};

/// An edge that has moved back by at most this fraction of a cell has left the tissue.
const TURNED_BACK: f64 = 0.1;

/// An intersection with tissue shorter than this fraction of a cell is rounding.
const CRUMB: f64 = 1e-3;

/// How far beyond an edge tissue is searched, as a fraction of a cell: further than snapping opens cuts ahead of the
/// edge.
const PROBED: f64 = 0.12;

/// Tissue that has moved past an edge by at most this fraction of a cell still counts as ahead of it.
const SLACK: f64 = 0.2;

/// The shortest cut behind a held proxy, as a fraction of a cell. Snapping would turn shorter cuts into a zigzag.
const SHORTEST_CUT: f64 = 0.2;

/// The same in solids. With longer cuts more elastic energy is released at once and lost.
const SHORTEST_CUT_IN_SOLIDS: f64 = 0.1;

impl World {
    /// Moves the proxy of a blade in a body after the blade, and cuts the tissue between. After an error the proxy
    /// stays.
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
            self.remove_holds(proxy);
            proxy.was_outside = None;
            return Ok(());
        }
        let start = self.start_in(blade, at, start, dt)?;
        let result = if toughness > 0.0 {
            self.cut_with_resistance(blade, id, f64::from(toughness), [start, end])
        } else {
            self.cut_without_resistance(blade, at, &Sweep { start, end })
        };
        let points = self.bodies.get(id.0)?.tissue_velocity(end, &mut blade.near)?;
        let proxy = &mut blade.proxies[at];
        let has_entered = !proxy.holds.is_empty() || !proxy.stroke.ends().is_empty();
        // An edge that has only reached the surface has not entered.
        proxy.was_outside = Some(points.is_none() || proxy.was_outside == Some(true) && !has_entered);
        result
    }

    /// Where the edge was before the step, relative to the tissue in its current position: tissue can have moved onto
    /// the edge. If the proxy is held in the tissue, its holds determine that.
    fn start_in(&self, blade: &mut Blade, at: usize, start: [Vec3; 2], dt: f32) -> Result<[Vec3; 2]> {
        let proxy = &blade.proxies[at];
        if !proxy.holds.is_empty() || !proxy.stroke.ends().is_empty() || proxy.was_outside != Some(true) {
            return Ok(start);
        }
        let body = self.bodies.get(proxy.body.0)?;
        let Some(velocity) = body.tissue_velocity(start, &mut blade.near)? else {
            return Ok(start);
        };
        // The tissue may have had another velocity earlier in the step.
        for times in [1.0, 2.0, 4.0, 8.0] {
            let before = start.map(|end| end + times * dt * velocity);
            if before.iter().all(|end| end.is_finite()) && body.tissue_velocity(before, &mut blade.near)?.is_none() {
                return Ok(before);
            }
        }
        Ok(start)
    }

    /// Cuts tissue without toughness wherever the edge passes through it, or the tissue passes over the edge.
    fn cut_without_resistance(&mut self, blade: &mut Blade, at: usize, sweep: &Sweep) -> Result<()> {
        let Proxy { body: id, stroke, .. } = &blade.proxies[at];
        let body = self.bodies.get(id.0)?;
        let points = !stroke.ends().is_empty();
        if sweep.start == sweep.end && !(points && body.has_tissue_moved(stroke)) {
            return Ok(());
        }
        body.query_blade(sweep, &mut blade.near, &mut blade.met)?;
        if !blade.near.is_empty() || points {
            let proxy = &mut blade.proxies[at];
            blade.report.add(&self.cut_along(proxy.body, sweep, &mut proxy.stroke)?);
        }
        Ok(())
    }

    /// Cuts tissue with toughness.
    fn cut_with_resistance(
        &mut self,
        blade: &mut Blade,
        id: BodyId,
        toughness: f64,
        edges: [[Vec3; 2]; 2],
    ) -> Result<()> {
        let mut approach = Approach::of(edges);
        let Some(at) = blade.proxies.iter().position(|proxy| proxy.body == id) else {
            return self.advance_proxy(blade, id, toughness, &mut approach);
        };
        let (proxy, report) = (&mut blade.proxies[at], &mut blade.report);
        self.find_holds(proxy, &mut approach);
        let Some(points) = approach.points() else {
            return self.advance_proxy(blade, id, toughness, &mut approach);
        };
        if !points.iter().any(EdgePoint::is_on_edge) {
            // The edge has left the tissue along its own direction.
            return self.end_stroke(proxy, [approach.from; 2], report);
        }
        if proxy.travel().dot(approach.lag) < 0.0 {
            // The edge moves back: what it has passed through is cut now.
            if proxy.uncut > 0.0
                && let Err(error) = self.cut_to(proxy, approach.from, approach.from, report)
            {
                self.remove_holds(proxy);
                return Err(error);
            }
            if approach.distance <= SLACK * proxy.size {
                // The edge is still within its cut, without load.
                return self.hold_blade(proxy, &NOWHERE, edges[1], (blade.stiffness, 0.0));
            }
            self.look_ahead(blade, id, &approach)?;
            if depth_through(&blade.met, approach.end) <= TURNED_BACK * blade.proxies[at].size {
                return self.end_stroke(&mut blade.proxies[at], [approach.from; 2], &mut blade.report);
            }
        }
        self.advance_proxy(blade, id, toughness, &mut approach)
    }

    /// Finds the holds of a proxy, and its position that follows from them.
    fn find_holds(&self, proxy: &Proxy, approach: &mut Approach) {
        let Some(deformable_contact) = &self.deformable_contact else {
            return;
        };
        let points = proxy.holds.iter().filter_map(|hold| {
            let position = deformable_contact
                .attachments
                .first_point_position(&self.bodies, hold.id)?;
            Some(EdgePoint::next_to(position - hold.offset, approach.end))
        });
        approach.count = approach
            .points
            .iter_mut()
            .zip(points)
            .map(|(point, found)| *point = found)
            .count();
        if let Some(points) = approach.points() {
            let count = points.len() as f64;
            let lag = points.iter().map(|point| point.lag).sum::<DVec3>() / count;
            let distance = points.iter().map(|point| point.lag.length()).sum::<f64>() / count;
            let ahead = lag.try_normalize().unwrap_or(proxy.travel().normalize_or_zero());
            *approach = Approach {
                from: lagging_edge(points, approach.end),
                lag,
                distance,
                probe: PROBED * proxy.size * ahead,
                ..*approach
            };
        }
    }

    /// Finds the tissue between a proxy and a little beyond the true edge.
    fn look_ahead(&self, blade: &mut Blade, id: BodyId, approach: &Approach) -> Result<()> {
        let end = approach.end.map(|end| (end.as_dvec3() + approach.probe).as_vec3());
        let sweep = Sweep {
            start: approach.from,
            end,
        };
        self.bodies
            .get(id.0)?
            .query_blade(&sweep, &mut blade.near, &mut blade.met)?;
        if approach.count > 0 {
            let unit = blade.met.iter().map(|part| part.unit()).fold(0.0, f64::max);
            blade.met.retain(|part| part.amount > CRUMB * unit);
        }
        Ok(())
    }

    /// Advances a proxy as far as the coupling force exceeds the resistance, and cuts where the uncut distance is long
    /// enough.
    fn advance_proxy(&mut self, blade: &mut Blade, id: BodyId, toughness: f64, approach: &mut Approach) -> Result<()> {
        self.look_ahead(blade, id, approach)?;
        let known = blade.proxies.iter().position(|proxy| proxy.body == id);
        let held_at = known.filter(|_| approach.count > 0);
        if held_at.is_none() {
            approach.enter(&blade.met);
        }
        let Approach {
            from,
            end,
            lag,
            distance,
            ..
        } = *approach;
        if blade.met.is_empty() || distance == 0.0 && held_at.is_none() {
            return match held_at {
                Some(at) => self.end_stroke(&mut blade.proxies[at], [from, end], &mut blade.report),
                None => Ok(()),
            };
        }
        let resistance = Resistance {
            stiffness: blade.stiffness,
            toughness,
        };
        let last_force = held_at.map(|at| blade.proxies[at].force);
        let reach = distance + approach.probe.length();
        let advance = resistance.advance((&blade.met, reach), distance, last_force, &mut blade.knots)?;
        let at = blade.proxy(id)?;
        let (proxy, report, met) = (&mut blade.proxies[at], &mut blade.report, &blade.met[..]);
        let is_solid = met.iter().any(|part| part.is_area);
        let mut begins = 0.0;
        if held_at.is_none() {
            begins = met.iter().map(|part| part.times[0]).fold(1.0, f64::min);
            self.remove_holds(proxy);
            if proxy.was_outside == Some(true) && is_solid {
                // The surface bulges beside a pressing edge.
                proxy.behind = lag.normalize_or_zero() * size_of(met);
            }
        }
        let Advance {
            mut part,
            mut force,
            cuts,
        } = advance;
        let shortest = if is_solid { SHORTEST_CUT_IN_SOLIDS } else { SHORTEST_CUT };
        let is_due = proxy.uncut + distance * (part - begins) >= shortest * size_of(met);
        let is_through = force.is_none() && (cuts || held_at.is_some());
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
                    .filter_map(|&(end, point)| Some((body.point_at_end(&end)?, point.as_dvec3())));
                fill(&mut points, ends);
            } else {
                // The proxy stays where it was.
                part = begins;
                force = Some(last_force.unwrap_or(toughness));
            }
        }
        let Some(force) = force else {
            self.remove_holds(proxy);
            return result;
        };
        if !(cuts && is_due && result.is_ok()) {
            proxy.uncut += distance * (part - begins);
            // The distance before the tissue is part of the first cut.
            proxy.behind += lag * part;
            if held_at.is_none() || part > 0.0 {
                fill(
                    &mut points,
                    points_at(self.bodies.get(id.0)?, met, part * distance / reach),
                );
            }
        }
        proxy.force = force;
        proxy.forward = lag;
        proxy.size = size_of(met);
        report.lag = report.lag.max(distance * (1.0 - part));
        // In open tissue the proxy keeps its holds.
        for (hold, point) in proxy.holds.iter_mut().zip(&approach.points) {
            hold.offset -= part * point.lag;
        }
        self.hold_blade(proxy, &points, end, (blade.stiffness, force))?;
        result
    }

    /// Cuts from the end of the proxy's last cut, or from its first contact with the tissue, to the edge `reached`.
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

    /// Ends the stroke of a proxy that has left its body: cuts what it has passed through since the last cut, up to
    /// `reached`.
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
        self.remove_holds(proxy);
        result
    }
}

/// The size of the largest intersected cell, by its shortest edge, m.
fn size_of(met: &[BladeContact]) -> f64 {
    met.iter().map(|part| part.size).fold(0.0, f64::max)
}

/// The distance that an edge passes through tissue in the rest shape, m. In solids it is the mean along the part of the
/// edge inside.
fn depth_through(met: &[BladeContact], edge: [Vec3; 2]) -> f64 {
    let amount: f64 = met.iter().map(|part| part.amount).sum();
    if !met.iter().any(|part| part.is_area) {
        return amount;
    }
    let along = (edge[1] - edge[0]).as_dvec3().normalize_or_zero();
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for point in met.iter().flat_map(|part| part.positions) {
        low = low.min(along.dot(point));
        high = high.max(along.dot(point));
    }
    amount / (high - low).max(size_of(met))
}
