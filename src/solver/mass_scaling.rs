//! Selective mass scaling: adds mass to the few nodes whose springs or elements would require short substeps, as
//! explicit finite-element codes do (Belytschko, Liu, Moran 2000, section 6.2).
//!
//! For the quadratic form of every spring, `q(x_i - x_j) <= 2 q(x_i) + 2 q(x_j)`. Let S and C be the sums of the
//! stiffnesses and dampings of a node's springs. Leapfrog is stable for a substep `h` if each node has at least the
//! mass `h (h S / 2 + C)`. This holds at all positions, so that no estimate is needed during motion. Inertia grows,
//! weight does not.
//!
//! Elements, terms and cavities have such sums only for the rest shape. Masses are computed for these sums, and the
//! stable substep is then found as with any other masses. If motion stiffens elements so much that a step would be
//! rejected, the sums are updated for the deformed elements (`deformed_mass_scaling.rs`).

use super::stability::RESERVE as RESERVE_AT_REST;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::def::NodalStiffness;
use crate::nodes::NodeDamping;
use crate::soa::NodalMasses;
use crate::springs::Springs;

/// Mass is added only if it reduces the number of substeps to this fraction.
const MAX_SUBSTEP_RATIO: f64 = 0.75;

/// The used fraction of the stable substep. It is larger than for an estimate that motion can invalidate. This limit
/// holds at all positions and is reached only if all springs of a node are parallel.
const RESERVE: f64 = 0.9;

/// The minimum gain in substep length for which mass scaling is prepared.
const MIN_GAIN: f64 = 1.125;

/// The minimum factor of further stiffening that masses allow for before they are computed again.
pub(super) const MIN_MARGIN: f32 = 1.3;

/// The maximum of that factor.
const MAX_MARGIN: f32 = 10.0;

/// The increase of the mass bound for stiffened elements. If the step would still be rejected, the bound is the mass of
/// the body.
const STIFFENED_BOUND_FACTOR: f64 = 10.0;

/// The time after which masses are those of elements at rest again, s.
const STIFFENED_TIME: f32 = 0.25;

/// The number of nodes between two tests of the mass bound.
const CHUNK: usize = 256;

/// A node that may receive added mass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AddedMass {
    pub node: u32,
    /// The bounds of elements, terms and cavities at the node.
    non_spring: NodalStiffness,
    /// The sum over springs and `non_spring`, N/m.
    stiffness: f32,
    /// The sum of damping along springs, N s/m.
    damping: f32,
    /// The stiffness of its elements relative to the rest shape.
    stiffening: f32,
    /// The value of `stiffening` at the end of the last step. `None` if the node was not in the list.
    committed_stiffening: Option<f32>,
    /// Its damping over its unscaled mass, 1/s.
    rate: f32,
    /// The added mass, kg.
    pub added: f32,
    /// The value of `added` at the end of the last step, kg.
    committed: f32,
}

saved! { AddedMass { node, non_spring, stiffness, damping, stiffening, committed_stiffening, rate, added, committed } }

impl AddedMass {
    /// Creates a node without springs and without added mass.
    fn new(node: u32, non_spring: NodalStiffness, rate: f32) -> Self {
        Self {
            node,
            non_spring,
            stiffness: non_spring.stiffness,
            damping: non_spring.damping,
            stiffening: 1.0,
            committed_stiffening: Some(1.0),
            rate,
            added: 0.0,
            committed: 0.0,
        }
    }

    /// The mass (kg) for which a substep of `step` seconds is stable, if elements stiffen further by the factor
    /// `margin`.
    fn required_mass(&self, step: f64, margin: f32) -> f64 {
        let extra_stiffness =
            (f64::from(margin * self.stiffening) - 1.0).max(0.0) * f64::from(self.non_spring.stiffness);
        step * (0.5 * step * (f64::from(self.stiffness) + extra_stiffness) + f64::from(self.damping))
    }

    /// The change of added mass since the end of the last step, kg.
    pub fn change(&self) -> f32 {
        self.added - self.committed
    }

    /// The longest stable substep with this mass, s.
    fn stable_step(&self, mass: f64) -> f64 {
        let damping = f64::from(self.damping);
        2.0 * mass / (damping + (damping * damping + 2.0 * mass * f64::from(self.stiffness)).sqrt())
    }

    /// Recomputes the sums over springs.
    fn update_sums(&mut self, springs: &dyn Springs) {
        (self.stiffness, self.damping) = (self.non_spring.stiffness, self.non_spring.damping);
        springs.visit(self.node as usize, &mut |link| {
            self.stiffness += link.stiffness;
            self.damping += link.damping;
        });
    }
}

/// The masses in use, with those that `scaling` has added.
pub(crate) fn masses_in_use<'a>(
    masses: &'a [f32],
    inverse_masses: &'a [f32],
    scaling: Option<&MassScaling>,
) -> NodalMasses<'a> {
    NodalMasses {
        masses,
        inverse_masses,
        are_scaled: scaling.is_some_and(|scaling| scaling.step > 0.0),
    }
}

/// The body data that mass scaling modifies.
pub(crate) struct MassScaleTarget<'a> {
    pub masses: &'a [f32],
    /// 0 for pinned nodes.
    pub inverse_masses: &'a mut [f32],
    pub uniform_inverse_mass: &'a mut Option<f32>,
    pub damping: Option<&'a mut NodeDamping>,
}

/// The mass scaling of a body.
#[derive(Debug)]
pub(crate) struct MassScaling {
    /// The bound of the added mass, kg.
    max_added: f64,
    /// The mass of the body, kg.
    body_mass: f64,
    /// The used fraction of the stable substep.
    reserve: f64,
    /// The longest stable substep without added mass, s. It holds at all positions, or at rest if there are elements.
    unscaled_substep: f64,
    /// The common inverse mass of all nodes without added mass, if there is one.
    pub uniform_inverse_mass: Option<f32>,
    /// Sorted by node.
    candidates: Vec<AddedMass>,
    /// The longest substep for which no other node needs mass, s.
    complete_up_to: f64,
    /// The substep that masses are computed for, s; 0 without added mass.
    step: f32,
    /// The fraction of the mass that gravity acts on, equal for all nodes of an unconstrained body, so that it does not
    /// rotate. `None`: gravity acts on the unscaled mass.
    weight_share: Option<f32>,
    /// The stiffness of each node's elements relative to the rest shape. Empty without elements.
    stiffenings: Vec<f32>,
    /// The factor of further stiffening that masses allow for; 1 at rest.
    pub margin: f32,
    /// The time since masses were computed for deformed elements, s.
    stiffened_age: Option<f32>,
    /// The values at the end of the last step.
    committed_stiffened_age: Option<f32>,
    committed_margin: f32,
    /// True if the attempted step has changed the stiffness that masses are computed for.
    changed: bool,
}

saved! { MassScaling {
    max_added, body_mass, reserve, unscaled_substep, uniform_inverse_mass, candidates, complete_up_to, step,
    weight_share, stiffenings, margin, stiffened_age, committed_stiffened_age, committed_margin, changed,
} }

impl MassScaling {
    /// Selects the nodes that need added mass for the longest substep that `fraction` of the body's mass can stabilize.
    /// Returns `None` if the gain is too small. `non_spring` holds the bounds of elements, terms and cavities for each
    /// node, or is empty. If there are elements, `room` is the maximum number of nodes that may need mass later.
    pub fn new(
        springs: &dyn Springs,
        non_spring: &[NodalStiffness],
        masses: &[f32],
        uniform_inverse_mass: Option<f32>,
        damping: Option<&NodeDamping>,
        room: usize,
        fraction: f32,
    ) -> Result<Option<Self>> {
        let body_mass: f64 = masses.iter().map(|&mass| f64::from(mass)).sum();
        let max_added = f64::from(fraction) * body_mass;
        let mut nodes = memory::reserved(masses.len())?;
        for (node, &mass) in (0..).zip(masses) {
            let non_spring = non_spring.get(node as usize).copied().unwrap_or_default();
            let rate = damping.map_or(0.0, |damping| damping.rates()[node as usize]);
            let mut candidate = AddedMass::new(node, non_spring, rate);
            if mass > 0.0 {
                candidate.update_sums(springs);
                nodes.push((candidate.stable_step(f64::from(mass)), candidate));
            }
        }
        nodes.sort_unstable_by(|(a, one), (b, other)| a.total_cmp(b).then(one.node.cmp(&other.node)));
        let Some(&(first, _)) = nodes.first() else {
            return Ok(None);
        };
        // Sums over the nodes that need mass for the substep of the next node.
        let (mut stiffness, mut dampings, mut mass) = (0.0, 0.0, 0.0);
        let mut count = 0;
        let mut complete_up_to = first;
        for &(step, candidate) in &nodes {
            // The negated comparison also ends the loop at NaN.
            if !(step * (0.5 * step * stiffness + dampings) - mass <= max_added && step < f64::INFINITY) {
                break;
            }
            complete_up_to = step;
            stiffness += f64::from(candidate.stiffness);
            dampings += f64::from(candidate.damping);
            mass += f64::from(masses[candidate.node as usize]);
            count += 1;
        }
        if count == 0 || !(complete_up_to >= MIN_GAIN * first) {
            if room == 0 {
                return Ok(None);
            }
            (count, complete_up_to) = (0, first);
        }
        let mut candidates = memory::reserved(count.max(room))?;
        candidates.extend(nodes[..count].iter().map(|&(_, candidate)| candidate));
        candidates.sort_unstable_by_key(|candidate| candidate.node);
        Ok(Some(Self {
            max_added,
            body_mass,
            reserve: if non_spring.is_empty() {
                RESERVE
            } else {
                f64::from(RESERVE_AT_REST)
            },
            unscaled_substep: first,
            uniform_inverse_mass,
            candidates,
            complete_up_to,
            step: 0.0,
            weight_share: None,
            stiffenings: memory::filled(0.0, room)?,
            margin: 1.0,
            stiffened_age: None,
            committed_stiffened_age: None,
            committed_margin: 1.0,
            changed: false,
        }))
    }

    /// The substep that masses are computed for, s; 0 without added mass.
    pub fn step(&self) -> f32 {
        self.step
    }

    /// The total added mass, kg.
    pub fn added_mass(&self) -> f64 {
        self.candidates.iter().map(|candidate| f64::from(candidate.added)).sum()
    }

    /// All nodes that may receive added mass.
    pub fn candidates(&self) -> &[AddedMass] {
        &self.candidates
    }

    /// The nodes whose added mass must not add weight.
    pub fn weightless(&self) -> &[AddedMass] {
        if self.step > 0.0 && self.weight_share.is_none() {
            &self.candidates
        } else {
            &[]
        }
    }

    /// The fraction of the mass that gravity acts on, if it is the same for all nodes.
    pub fn weight_share(&self) -> Option<f32> {
        self.weight_share
    }

    /// The number of substeps for a step of `dt` seconds at rest without added mass. If elements have stiffened too
    /// much, it is the `allowed` number.
    pub fn needed_at_rest(&self, dt: f32, allowed: u32) -> f64 {
        match self.stiffened_age {
            None => self.unscaled_at_rest(dt),
            Some(_) => f64::from(allowed),
        }
    }

    /// The number of substeps for a step of `dt` seconds at rest without added mass.
    pub fn unscaled_at_rest(&self, dt: f32) -> f64 {
        (f64::from(dt) / (self.reserve * self.unscaled_substep)).ceil()
    }

    /// Starts mass scaling for deformed elements. Returns the relative stiffness of each node, initialized to 0, for
    /// the caller to fill in. `None` without elements.
    pub fn begin_stiffened(&mut self) -> Option<&mut [f32]> {
        if self.stiffenings.is_empty() {
            return None;
        }
        if !self.changed {
            self.reset_to_rest();
        }
        self.stiffened_age = Some(0.0);
        self.stiffenings.fill(0.0);
        Some(&mut self.stiffenings)
    }

    /// Adopts the relative stiffnesses that the caller has filled in. `at_rest` returns the bounds of each node at rest
    /// (`Elements::nodal_stiffness_at_rest`). The next `apply` uses them.
    pub fn adopt_stiffenings(
        &mut self,
        springs: &dyn Springs,
        masses: &[f32],
        rates: Option<&[f32]>,
        at_rest: impl Fn(usize) -> NodalStiffness,
    ) {
        let listed = self.candidates.len();
        let mut next = 0;
        for (node, &mass) in masses.iter().enumerate() {
            let stiffening = self.stiffenings.get(node).copied().unwrap_or(0.0);
            if let Some(candidate) = self.candidates[..listed]
                .get_mut(next)
                .filter(|candidate| candidate.node as usize == node)
            {
                candidate.stiffening = candidate.stiffening.max(stiffening);
                next += 1;
            } else if mass > 0.0 && self.candidates.len() < self.candidates.capacity() {
                let rate = rates.map_or(0.0, |rates| rates[node]);
                let mut candidate = AddedMass {
                    stiffening,
                    committed_stiffening: None,
                    ..AddedMass::new(node as u32, at_rest(node), rate)
                };
                candidate.update_sums(springs);
                if candidate.required_mass(self.complete_up_to, MAX_MARGIN) > f64::from(mass) {
                    self.candidates.push(candidate);
                }
            }
        }
        self.candidates.sort_unstable_by_key(|candidate| candidate.node);
    }

    /// Returns to the masses of elements at rest after the time `STIFFENED_TIME`. Returns true if masses must be
    /// computed again.
    pub fn end_stiffened(&mut self) -> bool {
        let ends = self.stiffened_age.is_some_and(|age| age > STIFFENED_TIME);
        if ends {
            self.reset_to_rest();
        }
        ends
    }

    fn reset_to_rest(&mut self) {
        self.candidates
            .iter_mut()
            .for_each(|candidate| candidate.stiffening = 1.0);
        (self.stiffened_age, self.margin) = (None, 1.0);
        self.changed = true;
    }

    /// True if the attempted step has changed the stiffness that masses are computed for.
    pub fn has_changed(&self) -> bool {
        self.changed
    }

    /// Commits a step of `dt` seconds.
    pub fn commit(&mut self, dt: f32) {
        if let Some(age) = &mut self.stiffened_age {
            *age += dt;
        }
        (self.committed_stiffened_age, self.committed_margin) = (self.stiffened_age, self.margin);
        self.changed = false;
        for candidate in &mut self.candidates {
            (candidate.committed_stiffening, candidate.committed) = (Some(candidate.stiffening), candidate.added);
        }
    }

    /// Restores the state at the end of the last step.
    pub fn rollback(&mut self) {
        (self.stiffened_age, self.margin) = (self.committed_stiffened_age, self.committed_margin);
        self.candidates
            .retain(|candidate| candidate.committed_stiffening.is_some());
        for candidate in &mut self.candidates {
            candidate.stiffening = candidate.committed_stiffening.unwrap_or(1.0);
        }
        self.changed = false;
    }

    /// The smallest number of substeps for a step of `dt` seconds, and the substep that masses must be computed for.
    /// `None` if that saves too little of the `needed` ones.
    pub fn fewer_substeps(
        &self,
        (dt, max_substeps): (f32, u32),
        needed: f64,
        masses: &[f32],
        inverse_masses: &[f32],
    ) -> Option<(u32, f32)> {
        let longest = f64::from(dt) / self.reserve;
        let fits_in = |substeps: u32, max_added: f64| {
            let step = longest / f64::from(substeps);
            step <= self.complete_up_to && self.has_mass_for(step, max_added, masses, inverse_masses)
        };
        let fits = |substeps: u32| fits_in(substeps, self.max_added);
        if self.stiffened_age.is_some() {
            // Uses no more mass than the `needed` substeps require. If that is too much, more substeps are taken.
            let mut substeps = (needed.min(f64::from(u32::MAX)) as u32).max(1);
            while !fits_in(substeps, self.body_mass.min(STIFFENED_BOUND_FACTOR * self.max_added)) {
                if substeps >= max_substeps {
                    if fits_in(substeps, self.body_mass) {
                        break;
                    }
                    return None;
                }
                substeps = substeps.saturating_add(substeps / 8 + 1).min(max_substeps);
            }
            return Some((substeps, (longest / f64::from(substeps)) as f32));
        }
        let max_count = (MAX_SUBSTEP_RATIO * needed).floor().min(f64::from(u32::MAX)) as u32;
        // Most steps equal the previous step.
        let last_count = (longest / f64::from(self.step)).round().min(f64::from(u32::MAX)) as u32;
        if (1..=max_count).contains(&last_count) && fits(last_count) && (last_count == 1 || !fits(last_count - 1)) {
            return Some((last_count, (longest / f64::from(last_count)) as f32));
        }
        if max_count == 0 || !fits(max_count) {
            return None;
        }
        let (mut too_few, mut enough) = (0, max_count);
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

    /// True if the added mass for this substep does not exceed the bound `max_added`.
    fn has_mass_for(&self, step: f64, max_added: f64, masses: &[f32], inverse_masses: &[f32]) -> bool {
        let mut added = 0.0;
        self.candidates.chunks(CHUNK).all(|candidates| {
            let missing_masses = candidates.iter().map(|candidate| {
                let node = candidate.node as usize;
                let missing = candidate.required_mass(step, self.margin) - f64::from(masses[node]);
                if inverse_masses[node] > 0.0 {
                    missing.max(0.0)
                } else {
                    0.0
                }
            });
            added += missing_masses.sum::<f64>();
            added <= max_added
        })
    }

    /// Computes masses for a substep of `step` seconds; 0 removes the added mass. `is_free`: the body is unconstrained,
    /// though damping may act.
    pub fn apply(&mut self, step: f32, body: MassScaleTarget, is_free: bool) {
        self.step = step;
        *body.uniform_inverse_mass = self.uniform_inverse_mass.filter(|_| step == 0.0);
        let mut damping = body.damping;
        for candidate in &mut self.candidates {
            let node = candidate.node as usize;
            let mass = body.masses[node];
            candidate.added = 0.0;
            if body.inverse_masses[node] > 0.0 {
                let scaled_mass = mass.max(candidate.required_mass(f64::from(step), self.margin) as f32);
                candidate.added = scaled_mass - mass;
                body.inverse_masses[node] = 1.0 / scaled_mass;
                if let Some(damping) = &mut damping {
                    damping.set_rate(node, candidate.rate * (mass / scaled_mass));
                }
            }
        }
        let added = self.added_mass();
        self.weight_share =
            (is_free && damping.is_none() && added > 0.0).then(|| (self.body_mass / (self.body_mass + added)) as f32);
    }

    /// Sets the damping rates of nodes at their unscaled mass, 1/s.
    pub fn set_rates(&mut self, rates: &[f32]) {
        for candidate in &mut self.candidates {
            candidate.rate = rates[candidate.node as usize];
        }
    }

    /// True if one of these nodes may receive added mass.
    pub fn concerns(&self, nodes: [u32; 2]) -> bool {
        nodes.into_iter().any(|node| self.index_of(node).is_ok())
    }

    /// Reserves memory for `nodes` more nodes.
    pub fn reserve(&mut self, nodes: usize) -> Result<()> {
        Ok(self.candidates.try_reserve(nodes)?)
    }

    /// Updates a node whose springs have changed. Memory must be reserved for an added node.
    pub fn change(&mut self, node: u32, springs: &dyn Springs, masses: &[f32], rates: Option<&[f32]>) {
        match self.index_of(node) {
            Ok(index) => self.candidates[index].update_sums(springs),
            Err(index) => {
                let rate = rates.map_or(0.0, |rates| rates[node as usize]);
                let mut candidate = AddedMass::new(node, NodalStiffness::default(), rate);
                candidate.update_sums(springs);
                let mass = f64::from(masses[node as usize]);
                if mass > 0.0 && candidate.stable_step(mass) < self.complete_up_to {
                    self.candidates.insert(index, candidate);
                }
            }
        }
    }

    fn index_of(&self, node: u32) -> std::result::Result<usize, usize> {
        self.candidates.binary_search_by_key(&node, |candidate| candidate.node)
    }
}
