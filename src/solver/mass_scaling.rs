//! Selective mass scaling: the few nodes whose springs, or elements, would make substeps short are made heavier, as explicit
//! finite-element codes do (Belytschko, Liu, Moran 2000, section 6.2).
//!
//! With `q(x_i - x_j) <= 2 q(x_i) + 2 q(x_j)` for the form of every spring, leapfrog is stable for a substep `h` where
//! each node has at least the mass `h (h S / 2 + C)`, with S and C the sums of its springs' stiffnesses and dampings:
//! wherever the nodes are, so that nothing has to be estimated on the way. Inertia grows and weight does not.
//!
//! Elements, terms and cavities have such sums too, but at rest alone: masses are made for those, and how short substeps have to be with these
//! masses is found as it is with any others. Where motion makes elements so stiff that a step would be refused, the sums of their nodes are
//! made again for how they are deformed (`relief.rs`), within the same bound on the mass.

use super::stability::RESERVE as RESERVE_AT_REST;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::def::Carried;
use crate::nodes::NodeDamping;
use crate::springs::Springs;

/// What is left of the substeps where mass is added, at most: for less the motion is not changed.
const WORTH_ADDING: f64 = 0.75;

/// The part of the longest stable substep that is used: more than where the limit is an estimate that motion can overtake,
/// because this one holds wherever nodes go, and is reached only where all springs of a node point one way.
const RESERVE: f64 = 0.9;

/// Bodies that could not take steps so many times as long are not prepared for it.
const WORTH_KEEPING: f64 = 1.125;

/// How many times as stiff elements may become as they are where masses are made for that, before it is done again: at least.
pub(super) const MARGIN: f32 = 1.3;

/// The same, at most.
const MOST_MARGIN: f32 = 10.0;

/// How many times as much mass may be added as otherwise for elements that motion has made stiff. Where a step would be refused with so much it may
/// be as much as the body has.
const MORE: f64 = 10.0;

/// After so long, s, masses are those for elements at rest again.
const RELIEF: f32 = 0.25;

/// So many nodes are asked for what they need before the sum is looked at.
const TOGETHER: usize = 256;

/// A node that may be made heavier.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sliver {
    pub node: u32,
    /// What it carries beside its springs.
    beside: Carried,
    /// The sum over its springs, and what is beside them, N/m.
    stiffness: f32,
    /// N s/m, along them.
    damping: f32,
    /// How many times as stiff the elements at it were seen to be as at rest.
    growth: f32,
    /// The same as the last step ended; `None`: it was not in the list.
    settled_growth: Option<f32>,
    /// Its damping over its mass as it is, 1/s.
    rate: f32,
    /// By how much it is heavier now, kg.
    pub added: f32,
    /// The same as the last step ended, kg.
    settled: f32,
}

saved! { Sliver { node, beside, stiffness, damping, growth, settled_growth, rate, added, settled } }

impl Sliver {
    /// A node as it is, with nothing but what it carries beside its springs.
    fn new(node: u32, beside: Carried, rate: f32) -> Self {
        Self {
            node,
            beside,
            stiffness: beside.stiffness,
            damping: beside.damping,
            growth: 1.0,
            settled_growth: Some(1.0),
            rate,
            added: 0.0,
            settled: 0.0,
        }
    }

    /// The mass that makes a substep of `step` seconds stable, kg, where elements may become so many times as stiff as they are deformed.
    fn needs(&self, step: f64, margin: f32) -> f64 {
        let more = (f64::from(margin * self.growth) - 1.0).max(0.0) * f64::from(self.beside.stiffness);
        step * (0.5 * step * (f64::from(self.stiffness) + more) + f64::from(self.damping))
    }

    /// By how much it is heavier than as the last step ended, kg.
    pub fn change(&self) -> f32 {
        self.added - self.settled
    }

    /// The longest substep that is stable with this mass, s.
    fn longest_step(&self, mass: f64) -> f64 {
        let damping = f64::from(self.damping);
        2.0 * mass / (damping + (damping * damping + 2.0 * mass * f64::from(self.stiffness)).sqrt())
    }

    /// Takes the sums over its springs anew.
    fn add_up(&mut self, springs: &dyn Springs) {
        (self.stiffness, self.damping) = (self.beside.stiffness, self.beside.damping);
        springs.visit(self.node as usize, &mut |link| {
            self.stiffness += link.stiffness;
            self.damping += link.damping;
        });
    }
}

/// What of a body becomes heavier.
pub(crate) struct Heavier<'a> {
    pub masses: &'a [f32],
    /// 0 for nodes that are pinned.
    pub inverse_masses: &'a mut [f32],
    pub uniform_inverse_mass: &'a mut Option<f32>,
    pub damping: Option<&'a mut NodeDamping>,
}

/// The nodes of a body that may be made heavier.
#[derive(Debug)]
pub(crate) struct MassScaling {
    /// kg, in all.
    most: f64,
    /// The mass of the body, kg.
    total: f64,
    /// The part that is used of the substep that masses are made for.
    reserve: f64,
    /// The longest stable substep with masses as they are, s, wherever nodes are or at rest.
    unscaled: f64,
    /// The inverse mass of every node as it is, where they all have the same.
    pub uniform_inverse_mass: Option<f32>,
    /// In the order of their nodes.
    slivers: Vec<Sliver>,
    /// No other node needs mass for shorter substeps, s.
    complete_to: f64,
    /// The substep that masses are made for, s; 0: they are as they are.
    step: f32,
    /// What gravity pulls at, of a body that nothing holds: all mass, this part of it, so that it does not turn; `None`: mass as it is.
    weight_share: Option<f32>,
    /// How many times as stiff as at rest the elements at each node are; of no nodes where masses are not made for that.
    growths: Vec<f32>,
    /// How many times as stiff as that they may become; 1 at rest.
    pub margin: f32,
    /// For how long masses have been made for that, s.
    relief: Option<f32>,
    /// The same as the last step ended.
    settled_relief: Option<f32>,
    settled_margin: f32,
    /// Whether the step in progress has changed for what masses are made.
    changed: bool,
}

saved! { MassScaling {
    most, total, reserve, unscaled, uniform_inverse_mass, slivers, complete_to, step, weight_share, growths, margin,
    relief, settled_relief, settled_margin, changed,
} }

impl MassScaling {
    /// Finds the nodes of a body that are to be made heavier where it takes the longest substeps that `fraction` of its mass
    /// can make stable; `None`: that is no gain. `beside` is what nodes carry beside their springs, of no nodes where that is nothing. Where
    /// there are elements, any of as many nodes as there is `room` for may have to be made heavier later.
    pub fn new(
        springs: &dyn Springs,
        beside: &[Carried],
        masses: &[f32],
        uniform_inverse_mass: Option<f32>,
        damping: Option<&NodeDamping>,
        room: usize,
        fraction: f32,
    ) -> Result<Option<Self>> {
        let total: f64 = masses.iter().map(|&mass| f64::from(mass)).sum();
        let most = f64::from(fraction) * total;
        let mut nodes = memory::reserved(masses.len())?;
        for (node, &mass) in (0..).zip(masses) {
            let beside = beside.get(node as usize).copied().unwrap_or_default();
            let rate = damping.map_or(0.0, |damping| damping.rates()[node as usize]);
            let mut sliver = Sliver::new(node, beside, rate);
            if mass > 0.0 {
                sliver.add_up(springs);
                nodes.push((sliver.longest_step(f64::from(mass)), sliver));
            }
        }
        nodes.sort_unstable_by(|(a, one), (b, other)| a.total_cmp(b).then(one.node.cmp(&other.node)));
        let Some(&(first, _)) = nodes.first() else {
            return Ok(None);
        };
        // What the nodes before need for the step that a node can do with.
        let (mut stiffness, mut dampings, mut mass) = (0.0, 0.0, 0.0);
        let mut count = 0;
        let mut complete_to = first;
        for &(step, sliver) in &nodes {
            // A negated comparison, so that what is not a number ends it too.
            if !(step * (0.5 * step * stiffness + dampings) - mass <= most && step < f64::INFINITY) {
                break;
            }
            complete_to = step;
            stiffness += f64::from(sliver.stiffness);
            dampings += f64::from(sliver.damping);
            mass += f64::from(masses[sliver.node as usize]);
            count += 1;
        }
        if count == 0 || !(complete_to >= WORTH_KEEPING * first) {
            if room == 0 {
                return Ok(None);
            }
            (count, complete_to) = (0, first);
        }
        let mut slivers = memory::reserved(count.max(room))?;
        slivers.extend(nodes[..count].iter().map(|&(_, sliver)| sliver));
        slivers.sort_unstable_by_key(|sliver| sliver.node);
        Ok(Some(Self {
            most,
            total,
            reserve: if beside.is_empty() {
                RESERVE
            } else {
                f64::from(RESERVE_AT_REST)
            },
            unscaled: first,
            uniform_inverse_mass,
            slivers,
            complete_to,
            step: 0.0,
            weight_share: None,
            growths: memory::filled(0.0, room)?,
            margin: 1.0,
            relief: None,
            settled_relief: None,
            settled_margin: 1.0,
            changed: false,
        }))
    }

    /// The substep that masses are made for, s; 0: they are as they are.
    pub fn step(&self) -> f32 {
        self.step
    }

    /// What is added now, kg.
    pub fn added_mass(&self) -> f64 {
        self.slivers.iter().map(|sliver| f64::from(sliver.added)).sum()
    }

    /// All nodes that may be made heavier.
    pub fn slivers(&self) -> &[Sliver] {
        &self.slivers
    }

    /// Those of the nodes that gravity may pull less than in proportion to their mass.
    pub fn heavier(&self) -> &[Sliver] {
        if self.step > 0.0 && self.weight_share.is_none() {
            &self.slivers
        } else {
            &[]
        }
    }

    /// What part of all mass gravity pulls at, where it pulls all nodes in proportion.
    pub fn weight_share(&self) -> Option<f32> {
        self.weight_share
    }

    /// How many substeps a step of `dt` seconds takes at rest with masses as they are; where elements have become so stiff that it would be
    /// refused, as many as are `allowed`.
    pub fn needed_at_rest(&self, dt: f32, allowed: u32) -> f64 {
        match self.relief {
            None => self.unscaled_at_rest(dt),
            Some(_) => f64::from(allowed),
        }
    }

    /// How many substeps a step of `dt` seconds takes at rest with masses as they are.
    pub fn unscaled_at_rest(&self, dt: f32) -> f64 {
        (f64::from(dt) / (self.reserve * self.unscaled)).ceil()
    }

    /// Lets masses be made for how stiff elements are where they are deformed: to be filled in for each node, given 0. `None`: there are no
    /// elements.
    pub fn begin_relief(&mut self) -> Option<&mut [f32]> {
        if self.growths.is_empty() {
            return None;
        }
        if !self.changed {
            self.rest();
        }
        self.relief = Some(0.0);
        self.growths.fill(0.0);
        Some(&mut self.growths)
    }

    /// Takes in what was filled in, with what bounds each node at rest (`Elements::carried_at_rest`). Masses are made for it when they are made next.
    pub fn relieve(
        &mut self,
        springs: &dyn Springs,
        masses: &[f32],
        rates: Option<&[f32]>,
        at_rest: impl Fn(usize) -> Carried,
    ) {
        let listed = self.slivers.len();
        let mut next = 0;
        for (node, &mass) in masses.iter().enumerate() {
            let growth = self.growths.get(node).copied().unwrap_or(0.0);
            if let Some(sliver) = self.slivers[..listed]
                .get_mut(next)
                .filter(|sliver| sliver.node as usize == node)
            {
                sliver.growth = sliver.growth.max(growth);
                next += 1;
            } else if mass > 0.0 && self.slivers.len() < self.slivers.capacity() {
                let rate = rates.map_or(0.0, |rates| rates[node]);
                let mut sliver = Sliver {
                    growth,
                    settled_growth: None,
                    ..Sliver::new(node as u32, at_rest(node), rate)
                };
                sliver.add_up(springs);
                if sliver.needs(self.complete_to, MOST_MARGIN) > f64::from(mass) {
                    self.slivers.push(sliver);
                }
            }
        }
        self.slivers.sort_unstable_by_key(|sliver| sliver.node);
    }

    /// Makes masses for elements at rest again, after a while: whether that has to be done.
    pub fn end_relief(&mut self) -> bool {
        let ends = self.relief.is_some_and(|age| age > RELIEF);
        if ends {
            self.rest();
        }
        ends
    }

    fn rest(&mut self) {
        self.slivers.iter_mut().for_each(|sliver| sliver.growth = 1.0);
        (self.relief, self.margin) = (None, 1.0);
        self.changed = true;
    }

    /// Whether the step in progress has changed for what masses are made.
    pub fn has_changed(&self) -> bool {
        self.changed
    }

    /// Keeps what masses are made for, after a step of `dt` seconds.
    pub fn settle(&mut self, dt: f32) {
        if let Some(age) = &mut self.relief {
            *age += dt;
        }
        (self.settled_relief, self.settled_margin) = (self.relief, self.margin);
        self.changed = false;
        for sliver in &mut self.slivers {
            (sliver.settled_growth, sliver.settled) = (Some(sliver.growth), sliver.added);
        }
    }

    /// Has masses be made for what they were made for as the last step ended.
    pub fn unsettle(&mut self) {
        (self.relief, self.margin) = (self.settled_relief, self.settled_margin);
        self.slivers.retain(|sliver| sliver.settled_growth.is_some());
        for sliver in &mut self.slivers {
            sliver.growth = sliver.settled_growth.unwrap_or(1.0);
        }
        self.changed = false;
    }

    /// In how few substeps a step of `dt` seconds can be taken, and for what substep masses are to be made; `None`: that
    /// saves too little of the `needed` ones.
    pub fn fewer_substeps(
        &self,
        (dt, max_substeps): (f32, u32),
        needed: f64,
        masses: &[f32],
        inverse_masses: &[f32],
    ) -> Option<(u32, f32)> {
        let longest = f64::from(dt) / self.reserve;
        let fits_in = |substeps: u32, most: f64| {
            let step = longest / f64::from(substeps);
            step <= self.complete_to && self.has_mass_for(step, most, masses, inverse_masses)
        };
        let fits = |substeps: u32| fits_in(substeps, self.most);
        if self.relief.is_some() {
            // Only as much as is needed for as many as are asked for, or where that is too much for some more.
            let mut substeps = (needed.min(f64::from(u32::MAX)) as u32).max(1);
            while !fits_in(substeps, self.total.min(MORE * self.most)) {
                if substeps >= max_substeps {
                    if fits_in(substeps, self.total) {
                        break;
                    }
                    return None;
                }
                substeps = substeps.saturating_add(substeps / 8 + 1).min(max_substeps);
            }
            return Some((substeps, (longest / f64::from(substeps)) as f32));
        }
        let worth = (WORTH_ADDING * needed).floor().min(f64::from(u32::MAX)) as u32;
        // Most steps are as the one before.
        let known = (longest / f64::from(self.step)).round().min(f64::from(u32::MAX)) as u32;
        if (1..=worth).contains(&known) && fits(known) && (known == 1 || !fits(known - 1)) {
            return Some((known, (longest / f64::from(known)) as f32));
        }
        if worth == 0 || !fits(worth) {
            return None;
        }
        let (mut too_few, mut enough) = (0, worth);
        while enough - too_few > 1 {
            let middle = too_few + (enough - too_few) / 2;
            if fits(middle) {
                enough = middle;
            } else {
                too_few = middle;
            }
        }
        Some((enough, (longest / f64::from(enough)) as f32))
    }

    /// Whether what would be added for this substep is no more than may be, kg.
    fn has_mass_for(&self, step: f64, most: f64, masses: &[f32], inverse_masses: &[f32]) -> bool {
        let mut added = 0.0;
        self.slivers.chunks(TOGETHER).all(|slivers| {
            let adds = slivers.iter().map(|sliver| {
                let node = sliver.node as usize;
                let lacks = sliver.needs(step, self.margin) - f64::from(masses[node]);
                if inverse_masses[node] > 0.0 {
                    lacks.max(0.0)
                } else {
                    0.0
                }
            });
            added += adds.sum::<f64>();
            added <= most
        })
    }

    /// Makes masses those for a substep of `step` seconds; 0: as they are. `is_free`: nothing holds the body, though damping may.
    pub fn apply(&mut self, step: f32, body: Heavier, is_free: bool) {
        self.step = step;
        *body.uniform_inverse_mass = self.uniform_inverse_mass.filter(|_| step == 0.0);
        let mut damping = body.damping;
        for sliver in &mut self.slivers {
            let node = sliver.node as usize;
            let mass = body.masses[node];
            sliver.added = 0.0;
            if body.inverse_masses[node] > 0.0 {
                let heavier = mass.max(sliver.needs(f64::from(step), self.margin) as f32);
                sliver.added = heavier - mass;
                body.inverse_masses[node] = 1.0 / heavier;
                if let Some(damping) = &mut damping {
                    damping.set_rate(node, sliver.rate * (mass / heavier));
                }
            }
        }
        let added = self.added_mass();
        self.weight_share =
            (is_free && damping.is_none() && added > 0.0).then(|| (self.total / (self.total + added)) as f32);
    }

    /// Nodes are damped at these rates from now on, 1/s, with their masses as they are.
    pub fn set_rates(&mut self, rates: &[f32]) {
        for sliver in &mut self.slivers {
            sliver.rate = rates[sliver.node as usize];
        }
    }

    /// Whether one of these nodes may be made heavier.
    pub fn concerns(&self, nodes: [u32; 2]) -> bool {
        nodes.into_iter().any(|node| self.find(node).is_ok())
    }

    /// Makes room for so many nodes more.
    pub fn reserve(&mut self, nodes: usize) -> Result<()> {
        Ok(self.slivers.try_reserve(nodes)?)
    }

    /// Sees that the springs of this node have changed; room for it has been made where they are more.
    pub fn change(&mut self, node: u32, springs: &dyn Springs, masses: &[f32], rates: Option<&[f32]>) {
        match self.find(node) {
            Ok(place) => self.slivers[place].add_up(springs),
            Err(place) => {
                let rate = rates.map_or(0.0, |rates| rates[node as usize]);
                let mut sliver = Sliver::new(node, Carried::default(), rate);
                sliver.add_up(springs);
                let mass = f64::from(masses[node as usize]);
                if mass > 0.0 && sliver.longest_step(mass) < self.complete_to {
                    self.slivers.insert(place, sliver);
                }
            }
        }
    }

    fn find(&self, node: u32) -> std::result::Result<usize, usize> {
        self.slivers.binary_search_by_key(&node, |sliver| sliver.node)
    }
}
