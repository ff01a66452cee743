//! Blades: edges that cut what they are moved through, and feel it.
//!
//! A blade's *proxy* in a body is the edge that its tissue is cut to; the true edge is ahead of it on a spring (Mahvash, Hayward 2001). Through a step
//! the spring is a thread between the tissue where the proxy stands and the true edge, which is led along its way: an impulse of each substep, found
//! implicitly, so that neither the spring nor the step can be too much for the tissue. It pulls no harder than the tissue resists. With the step
//! the proxy goes on, and what is between its places is cut.

use glam::{DVec3, Quat, Vec3};

use super::attachments::Which;
use super::blade::{Blade, BladeDefinition, BladeReport, Hold, MOST_HOLDS, Proxy, Stand, edge_behind};
use super::resistance::{Advance, Resistance};
use super::{Anchor, BodyId, SurfacePoint, World, make_walks};
use crate::contact::{Lead, Pose, Thread};
use crate::cutting::{Met, Sweep};
use crate::error::Result;
use crate::slots::{SlotId, Slots};

/// A blade of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BladeId(pub(crate) SlotId);

/// Where a proxy is to be held: a point of the tissue, and that of the proxy next to it.
type Held = (Anchor, DVec3);

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

const NOWHERE: [Option<Held>; MOST_HOLDS] = [None; MOST_HOLDS];

/// A proxy as a step ends, and the true edge ahead of it.
struct Approach {
    /// The points where it stands in the tissue.
    stands: [Stand; MOST_HOLDS],
    count: usize,
    /// The proxy, which is the true edge before the step where it stands nowhere, and the true edge.
    from: [Vec3; 2],
    end: [Vec3; 2],
    /// From the one to the other across the edge, in the mean, m, and how far.
    lag: DVec3,
    way: f64,
    /// How far beyond tissue is looked for.
    probe: DVec3,
}

impl World {
    /// Adds a blade: an edge that is moved by its pose, as tools are, cuts the bodies made for it ([`BodyDefinition::spare_nodes`]) as
    /// [`World::cut`] does, and feels their [`toughness`](crate::BodyDefinition::toughness). It is an edge alone: what has a body needs a tool beside it.
    ///
    /// Tissue that the edge meets gives way until the edge is so far ahead, on the spring of [`BladeDefinition::stiffness`], that this pulls as hard
    /// as the tissue resists: by its toughness for each metre that is cut, in the rest shape. From then on its proxy follows, at the end of each
    /// step, as far as keeps both equal; so the work of the blade is the toughness times the length that is cut, and what the spring stores
    /// (Mahvash, Hayward 2001). What pulls at the tissue through a step is what the blade feels: momentum is kept. An edge that goes along itself
    /// meets nothing, nor does one that goes back through its cut.
    ///
    /// The cut is made where the proxy went, by a fifth of a triangle's shortest edge at a time and to its end where it leaves the tissue; so a triangle
    /// that is passed through takes some ten [`spare_nodes`](crate::BodyDefinition::spare_nodes). Tissue of toughness 0 is cut with each step,
    /// just where the edge went. Where a cut fails the proxy stays and pulls on, as hard as the tissue resisted: [`BladeReport::refused`].
    ///
    /// A body that a blade stands in takes its substeps as one that is attached does. A step in which a blade goes through tissue may allocate.
    ///
    /// [`BodyDefinition::spare_nodes`]: crate::BodyDefinition::spare_nodes
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): something in the definition is out of its range.
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn create_blade(&mut self, definition: &BladeDefinition) -> Result<BladeId> {
        let mut blade = Blade::new(definition)?;
        for place in 0..self.bodies.places() {
            self.make_room_for_holds(place, MOST_HOLDS)?;
            if let Some(id) = self.bodies.id_at(place) {
                blade.proxy(BodyId(id))?;
            }
        }
        Ok(BladeId(self.blades.insert(blade)?))
    }

    /// Removes a blade. What it has cut stays.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn destroy_blade(&mut self, blade: BladeId) -> Result<()> {
        let mut blade = self.blades.remove(blade.0)?;
        for proxy in &mut blade.proxies {
            self.let_go_of_blade(proxy);
        }
        Ok(())
    }

    /// Moves a blade to `position`, m, over the next step, straight and evenly, and turns it to `orientation`, `None`: it stays as it is.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId). [`Error::InvalidArgument`](crate::Error::InvalidArgument): a number is not finite, a coordinate is
    /// further than 1e9 m from 0, or the orientation is zero.
    pub fn set_blade_pose(&mut self, blade: BladeId, position: Vec3, orientation: Option<Quat>) -> Result<()> {
        let blade = self.blades.get_mut(blade.0)?;
        let pose = blade.target.unwrap_or(blade.pose);
        let target = Pose {
            position,
            orientation: orientation.unwrap_or(pose.orientation),
        };
        blade.target = Some(target.checked()?);
        Ok(())
    }

    /// What a blade did and felt in the last step.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn blade_report(&self, blade: BladeId) -> Result<&BladeReport> {
        Ok(&self.blades.get(blade.0)?.report)
    }

    /// Lets blades stand in a new body.
    pub(super) fn meet_blades(&mut self, id: SlotId) -> Result<()> {
        if self.blades.count() == 0 {
            return Ok(());
        }
        self.make_room_for_holds(self.bodies.place(id)?, MOST_HOLDS)?;
        for (_, blade) in self.blades.iter_mut() {
            blade.proxy(BodyId(id))?;
        }
        Ok(())
    }

    /// A body is gone.
    pub(super) fn leave_blades(&mut self, body: BodyId) {
        for (_, blade) in self.blades.iter_mut() {
            blade.proxies.retain(|proxy| proxy.body != body);
        }
    }

    /// Makes room for a blade to be held at so many points more of the body at this place, if it can be cut.
    fn make_room_for_holds(&mut self, place: usize, count: usize) -> Result<()> {
        let Some(body) = self.bodies.at_mut(place).filter(|body| body.toughness().is_some()) else {
            return Ok(());
        };
        body.reserve_bonds()?;
        make_walks(&mut self.walks, place)?;
        let tissue = self.tissue.get_or_insert_default();
        tissue.bonds.reserve_rebinding(place)?;
        tissue.reserve_bonds([place; 2], count)
    }

    /// Leads what holds tissue to blades along their ways in the next step.
    pub(super) fn lead_blades(&mut self) {
        let Self {
            blades, tissue, bodies, ..
        } = self;
        let Some(bonds) = tissue.as_mut().map(|tissue| &mut tissue.bonds) else {
            return;
        };
        for (_, blade) in blades.iter_mut() {
            let edges = blade.edges();
            for hold in blade.proxies.iter_mut().flat_map(|proxy| &mut proxy.holds) {
                let Some(place) = bonds.place_of(bodies, hold.id) else {
                    continue;
                };
                let point = place - hold.offset;
                let [from, to] = edges.map(|edge| Stand::next_to(point, edge));
                // One that goes back beyond the proxy leaves it behind.
                let to = if from.lag.dot(to.lag) < 0.0 { point } else { to.foot() };
                hold.way = Lead { from: from.foot(), to };
                if hold.way.from.is_finite() && hold.way.to.is_finite() {
                    bonds.lead(hold.id, hold.way.moved(hold.offset));
                }
            }
        }
    }

    /// Has blades be where the step led them, feel what it did to them, and cut.
    pub(super) fn move_blades(&mut self) {
        if self.blades.count() == 0 {
            return;
        }
        let mut blades = std::mem::replace(&mut self.blades, Slots::new("blade"));
        for (_, blade) in blades.iter_mut() {
            let [start, end] = blade.edges();
            self.feel(blade);
            for place in 0..self.bodies.places() {
                if let Some(id) = self.bodies.id_at(place)
                    && let Err(error) = self.follow_blade(blade, BodyId(id), [start, end])
                {
                    blade.report.refused = Some(error);
                }
            }
        }
        self.blades = blades;
    }

    /// Reports what the step did to a blade, which is at its end from now on.
    fn feel(&self, blade: &mut Blade) {
        let before = blade.pose.position.as_dvec3();
        blade.pose = blade.target.take().unwrap_or(blade.pose);
        let middle = 0.5 * (before + blade.pose.position.as_dvec3());
        let (mut force, mut torque, mut work) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for hold in blade.proxies.iter().flat_map(|proxy| &proxy.holds) {
            let bonds = self.tissue.as_ref().map(|tissue| &tissue.bonds);
            let on_tissue = bonds.map_or(Vec3::ZERO, |bonds| bonds.force_of(hold.id)).as_dvec3();
            let Lead { from, to } = hold.way;
            force -= on_tissue;
            torque -= (0.5 * (from + to) - middle).cross(on_tissue);
            work += on_tissue.dot(to - from);
        }
        // Finite, whatever the step's length.
        let finite = |sum: DVec3| sum.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
        blade.report = BladeReport {
            force: finite(force),
            torque: finite(torque),
            work,
            ..BladeReport::default()
        };
    }

    /// Has the proxy of a blade in a body follow it, and cuts what is between. Where it fails the proxy stays.
    fn follow_blade(&mut self, blade: &mut Blade, id: BodyId, [start, end]: [[Vec3; 2]; 2]) -> Result<()> {
        let body = self.bodies.get(id.0)?;
        let Some(toughness) = body.toughness() else {
            return Ok(());
        };
        let is_met = blade.filter.meets(body.contact.filter);
        let known = blade.proxies.iter().position(|proxy| proxy.body == id);
        if !is_met {
            known
                .into_iter()
                .for_each(|at| self.let_go_of_blade(&mut blade.proxies[at]));
            return Ok(());
        }
        if toughness > 0.0 {
            return self.push_blade(blade, id, f64::from(toughness), [start, end]);
        }
        let sweep = Sweep { start, end };
        if start == end {
            return Ok(());
        }
        body.meet_blade(&sweep, &mut blade.near, &mut blade.met)?;
        let stands = known.is_some_and(|at| !blade.proxies[at].stroke.ends().is_empty());
        if !blade.near.is_empty() || stands {
            let at = blade.proxy(id)?;
            blade.report.length += self.cut_along(id, &sweep, &mut blade.proxies[at].stroke)?.length;
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
            let length: f64 = blade.met.iter().map(|part| part.length).sum();
            if length <= TURNED_BACK * blade.proxies[at].size {
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
            let size = size_of(&blade.met);
            blade.met.retain(|part| part.length > CRUMB * size);
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
        let mut begins = 0.0;
        if standing.is_none() {
            begins = met.iter().map(|part| part.times[0]).fold(1.0, f64::min);
            self.let_go_of_blade(proxy);
        }
        let Advance {
            mut part,
            mut force,
            cuts,
        } = advance;
        let is_due = proxy.uncut + way * (part - begins) >= SHORTEST_CUT * size_of(met);
        let is_through = force.is_none() && (cuts || standing.is_some());
        let mut points = NOWHERE;
        let mut result = Ok(());
        if cuts && is_due || is_through {
            let reached = [0, 1].map(|k| from[k].lerp(end[k], part as f32));
            result = self.cut_to(proxy, from, if part == 1.0 { end } else { reached }, report);
            if result.is_ok() {
                let body = self.bodies.get(id.0)?;
                let ends = proxy.stroke.ends().iter().filter_map(|&(end, point)| {
                    let node = body.point_of_vertex(end.vertex?)?;
                    Some((Anchor::Node(node), point.as_dvec3()))
                });
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
                fill(&mut points, points_at(met, part * way / reach));
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
        report.length += self.cut_along(proxy.body, &sweep, &mut proxy.stroke)?.length;
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

    /// Holds a proxy at these points, where there are any, else where it was held, on a spring of this stiffness between all of them that pulls no
    /// harder than this, N/m and N.
    fn hold_blade(
        &mut self,
        proxy: &mut Proxy,
        points: &[Option<Held>; MOST_HOLDS],
        edge: [Vec3; 2],
        (stiffness, most): (f64, f64),
    ) -> Result<()> {
        let place = self.bodies.place(proxy.body.0)?;
        let count = points.iter().flatten().count();
        self.make_room_for_holds(place, if count > proxy.holds.len() { count } else { 0 })?;
        let which = Which {
            prefix: "",
            index: None,
        };
        let mut bounds = [None; MOST_HOLDS];
        for (bound, (anchor, _)) in bounds.iter_mut().zip(points.iter().flatten()) {
            *bound = Some(self.bound(proxy.body, which, anchor)?);
        }
        if proxy.holds.is_empty() && bounds[0].is_some() {
            self.bodies.get_mut(proxy.body.0)?.begin_bonds();
        }
        let Self {
            bodies,
            tissue,
            holds_made,
            ..
        } = self;
        let Some(bonds) = tissue.as_mut().map(|tissue| &mut tissue.bonds) else {
            return Ok(());
        };
        if count > 0 {
            for hold in proxy.holds.drain(count.min(proxy.holds.len())..) {
                bonds.end(bodies, hold.id);
            }
        }
        for (index, (bound, held)) in bounds.into_iter().zip(points).enumerate() {
            let (Some(bound), Some((_, point))) = (bound, held) else {
                break;
            };
            if index == proxy.holds.len() {
                *holds_made = holds_made.wrapping_add(1);
                proxy.holds.push(Hold::new(*holds_made));
            }
            let hold = &mut proxy.holds[index];
            bonds.hold(hold.id, bound)?;
            hold.offset = bonds.place_of(bodies, hold.id).unwrap_or(*point) - *point;
        }
        let share = proxy.holds.len() as f64;
        for hold in &mut proxy.holds {
            let place = bonds.place_of(bodies, hold.id).unwrap_or_default();
            let foot = Stand::next_to(place - hold.offset, edge).foot();
            hold.way = Lead { from: foot, to: foot };
            let thread = Thread::led(hold.way.moved(hold.offset), share / stiffness, most / share);
            bonds.pull(hold.id, thread);
        }
        bonds.settle();
        Ok(())
    }

    /// Nothing is in the way of a blade any more in a body.
    fn let_go_of_blade(&mut self, proxy: &mut Proxy) {
        let Self { bodies, tissue, .. } = self;
        for hold in proxy.holds.drain(..) {
            if let Some(tissue) = tissue {
                tissue.bonds.end(bodies, hold.id);
            }
        }
        proxy.last = None;
        proxy.uncut = 0.0;
        proxy.behind = DVec3::ZERO;
    }
}

impl Approach {
    /// Of an edge that stands nowhere, before a step and after it.
    fn of([from, end]: [[Vec3; 2]; 2]) -> Self {
        Self {
            stands: [Stand::next_to(DVec3::ZERO, end); MOST_HOLDS],
            count: 0,
            from,
            end,
            lag: DVec3::ZERO,
            way: 0.0,
            probe: DVec3::ZERO,
        }
    }

    /// The points where it stands in the tissue, if it does.
    fn stands(&self) -> Option<&[Stand]> {
        (self.count > 0).then(|| &self.stands[..self.count])
    }

    /// Sees how far an edge that stood nowhere has to go across itself, from where it first met something.
    fn enter(&mut self, met: &[Met]) {
        let Some(first) = met.iter().min_by(|a, b| a.times[0].total_cmp(&b.times[0])) else {
            return;
        };
        let [from, to] = [self.from, self.end].map(|edge| edge.map(|end| end.as_dvec3()));
        let met_by = [0, 1].map(|k| from[k].lerp(to[k], first.times[0]));
        let edge = met_by[1] - met_by[0];
        let along = ((first.places[0] - met_by[0]).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        let gone = (to[0] - from[0]).lerp(to[1] - from[1], along);
        let edge = (to[1] - to[0]).normalize_or_zero();
        let across = gone - edge * gone.dot(edge);
        // What rounding makes of an edge that goes along itself is no way.
        let ends = self.from.into_iter().chain(self.end);
        let furthest = ends.fold(0.0, |furthest: f32, end| furthest.max(end.abs().max_element()));
        if across.length() > f64::from(2.0 * f32::EPSILON * furthest) {
            self.lag = across;
            self.way = across.length();
        }
    }
}

/// The largest of the cells that are met, by their shortest edges, m.
fn size_of(met: &[Met]) -> f64 {
    met.iter().map(|part| part.size).fold(0.0, f64::max)
}

/// The points of the surface in which the edge stands when it has gone a part of its way.
fn points_at(met: &[Met], time: f64) -> impl Iterator<Item = Held> {
    let is_there = move |part: &&Met| part.times[0] <= time && time <= part.times[1];
    met.iter().filter(is_there).map(move |part| {
        let [from, to] = part.times;
        let along = if to > from { (time - from) / (to - from) } else { 0.0 };
        let weights = [0, 1, 2].map(|k| {
            let [a, b] = part.weights.map(|weights| weights[k]);
            (a + (b - a) * along) as f32
        });
        let point = SurfacePoint {
            triangle: part.triangle,
            weights,
        };
        (Anchor::Point(point), part.places[0].lerp(part.places[1], along))
    })
}

fn fill(points: &mut [Option<Held>; MOST_HOLDS], held: impl Iterator<Item = Held>) {
    for (place, held) in points.iter_mut().zip(held) {
        *place = Some(held);
    }
}
