//! What tetrahedra remember of how they were deformed: the stresses of the arms beside them (Simo 1987), which are loads on top of what
//! is elastic.
//!
//! In a time h an arm's stress q becomes `a q + g (S' - S)`, S being the elastic stress. An explicit solver lets it act as it is between
//! two substeps. An implicit one has `a q - g S` as a load, and g times what is elastic on top of the latter, so that forces are those at
//! the end of the step. Pressures of rings have arms of their own.

use super::cut::TetrahedronPlace;
use super::law::{Law, Load};
use super::parts::FemPart;
use super::set::{PlasticSet, YieldBounds};
use super::tetrahedra::{GROUP, Group, Stresses};
use crate::base::{Result, StateHasher, memory};
use crate::codec::{Saved, saved};
use crate::def::{RelaxationStep, Viscosity, Yielding};
use crate::simd::ChosenKernel;

#[derive(Debug)]
pub(super) struct Memory {
    pub viscosity: Viscosity,
    /// g of the equation that is being solved; 0 where loads are the arms' stresses as they are.
    pub gain: f32,
    /// Where they yield.
    pub bounds: Option<YieldBounds>,
    pub parts: Vec<OfPart>,
    /// Of parts that are to come.
    spare: Vec<OfPart>,
    pub rings: Past<f32>,
}

saved! { Memory { viscosity, gain, bounds, parts, spare, rings } }

/// What is remembered of the tetrahedra of a part.
#[derive(Debug)]
pub(super) struct OfPart {
    past: Past<Stresses>,
    set: Option<PlasticSet>,
    /// Room for elastic stresses.
    pub newest: Vec<Stresses>,
}

saved! { OfPart { past, set, newest } }

/// Stresses of the step in progress, and of the current state.
#[derive(Debug)]
pub(super) struct Past<T> {
    arms: Vec<T>,
    elastic: Vec<T>,
    pub loads: Vec<T>,
    kept_arms: Vec<T>,
    kept_elastic: Vec<T>,
}

saved! { [T: Saved] Past<T> { arms, elastic, loads, kept_arms, kept_elastic } }

/// What has the numbers of some tetrahedra, or one.
pub(super) trait Numbers: Copy {
    const ZERO: Self;

    fn numbers(&self) -> &[f32];

    fn numbers_mut(&mut self) -> &mut [f32];
}

impl Numbers for f32 {
    const ZERO: Self = 0.0;

    fn numbers(&self) -> &[f32] {
        std::slice::from_ref(self)
    }

    fn numbers_mut(&mut self) -> &mut [f32] {
        std::slice::from_mut(self)
    }
}

impl Numbers for Stresses {
    const ZERO: Self = Self::ZERO;

    fn numbers(&self) -> &[f32] {
        self.0.as_flattened()
    }

    fn numbers_mut(&mut self) -> &mut [f32] {
        self.0.as_flattened_mut()
    }
}

impl<T: Numbers> Past<T> {
    fn new(count: usize) -> Result<Self> {
        let zeros = || memory::filled(T::ZERO, count);
        Ok(Self {
            arms: zeros()?,
            elastic: zeros()?,
            loads: zeros()?,
            kept_arms: zeros()?,
            kept_elastic: zeros()?,
        })
    }

    /// Makes loads `decay` times the arms' stresses less `gain` times what is elastic.
    fn foresee(&mut self, course: RelaxationStep) {
        let stresses = self.arms.iter().zip(&self.elastic);
        for (load, (arm, elastic)) in self.loads.iter_mut().zip(stresses) {
            let numbers = arm.numbers().iter().zip(elastic.numbers());
            for (load, (arm, elastic)) in load.numbers_mut().iter_mut().zip(numbers) {
                *load = course.decay as f32 * arm - course.gain as f32 * elastic;
            }
        }
    }

    /// What is elastic has become this.
    pub fn age(&mut self, course: RelaxationStep, newest: &[T]) {
        let stresses = self.arms.iter_mut().zip(&mut self.elastic).zip(&mut self.loads);
        for (((arm, elastic), load), newest) in stresses.zip(newest) {
            let numbers = arm.numbers_mut().iter_mut().zip(elastic.numbers_mut());
            for ((arm, elastic), newest) in numbers.zip(newest.numbers()) {
                // Nothing is held by what is beyond the range of numbers.
                *arm = finite(course.decay as f32 * *arm + course.gain as f32 * (newest - *elastic));
                *elastic = finite(*newest);
            }
            *load = *arm;
        }
    }

    /// Makes room for so many in all.
    fn reserve(&mut self, count: usize) -> Result<()> {
        let mut all = self.fields_mut().into_iter();
        all.try_for_each(|values| memory::reserve(values, count))
    }

    /// Becomes one of so many, for which there is room.
    fn grow(&mut self, count: usize) {
        self.fields_mut()
            .into_iter()
            .for_each(|values| values.resize(count, T::ZERO));
    }

    fn fields_mut(&mut self) -> [&mut Vec<T>; 5] {
        [
            &mut self.arms,
            &mut self.elastic,
            &mut self.loads,
            &mut self.kept_arms,
            &mut self.kept_elastic,
        ]
    }

    fn recall(&mut self) {
        self.arms.copy_from_slice(&self.kept_arms);
        self.elastic.copy_from_slice(&self.kept_elastic);
        self.loads.copy_from_slice(&self.kept_arms);
    }

    fn keep(&mut self) {
        self.kept_arms.copy_from_slice(&self.arms);
        self.kept_elastic.copy_from_slice(&self.elastic);
    }
}

impl OfPart {
    /// Of so many groups; whether what relaxes is remembered, and what yields.
    fn new(has_arms: bool, yields: bool, count: usize) -> Result<Self> {
        Ok(Self {
            past: Past::new(if has_arms { count } else { 0 })?,
            set: if yields { Some(PlasticSet::new(count)?) } else { None },
            newest: memory::filled(Stresses::ZERO, count)?,
        })
    }

    /// On top of the elastic stresses.
    pub fn loads(&self) -> &[Stresses] {
        self.set.as_ref().map_or(&self.past.loads, |set| &set.loads)
    }

    /// The newest elastic stresses are those now.
    /// They yield where there are bounds.
    pub fn age(&mut self, kernel: ChosenKernel, course: RelaxationStep, bounds: Option<YieldBounds>) {
        self.past.age(course, &self.newest);
        if let (Some(set), Some(bounds)) = (&mut self.set, bounds) {
            set.flow(kernel, bounds, &self.newest);
        }
        self.combine();
    }

    /// Whether a tetrahedron would yield where this is elastic.
    pub fn yields(&self, bounds: YieldBounds, place: [usize; 2], elastic: Load) -> bool {
        self.set
            .as_ref()
            .is_some_and(|set| set.yields(bounds, place, elastic.stress))
    }

    /// All that is remembered; nothing where it is not.
    fn fields_mut(&mut self) -> [&mut [Stresses]; 9] {
        let Self { past, set, newest } = self;
        let [stresses, kept, loads] = set
            .as_mut()
            .map_or([&mut [][..], &mut [], &mut []], PlasticSet::fields_mut);
        let [arms, elastic, of_arms, kept_arms, kept_elastic] = past.fields_mut();
        [
            arms,
            elastic,
            of_arms,
            kept_arms,
            kept_elastic,
            newest,
            stresses,
            kept,
            loads,
        ]
    }

    fn combine(&mut self) {
        if let Some(set) = &mut self.set {
            set.combine(&self.past.loads);
        }
    }
}

impl Memory {
    /// For so many rings, or none.
    pub fn new(
        law: Law,
        viscosity: Viscosity,
        yielding: Yielding,
        parts: &[FemPart],
        ring_count: usize,
    ) -> Result<Option<Box<Self>>> {
        // Volume alone does not yield.
        let yields = !yielding.is_none() && law.mu > 0.0;
        if viscosity.is_none() && !yields {
            return Ok(None);
        }
        let has_arms = !viscosity.is_none();
        let of_parts = parts
            .iter()
            .map(|part| OfPart::new(has_arms, yields, part.groups.as_slice().len()));
        let of_parts = memory::try_collected(of_parts)?;
        Ok(Some(memory::boxed(Self {
            viscosity,
            gain: 0.0,
            bounds: yields.then(|| YieldBounds::new(law, yielding)),
            parts: of_parts,
            spare: Vec::new(),
            rings: Past::new(if has_arms { ring_count } else { 0 })?,
        })?))
    }

    /// Makes room for more parts of so many groups.
    pub fn reserve_parts(&mut self, more: usize, groups: usize) -> Result<()> {
        self.parts.try_reserve(more)?;
        while self.spare.len() < more {
            let part = OfPart::new(!self.viscosity.is_none(), self.bounds.is_some(), groups)?;
            memory::push(&mut self.spare, part)?;
        }
        Ok(())
    }

    /// Adds a part, for which there is room.
    pub fn add_part(&mut self) {
        self.parts.extend(self.spare.pop());
    }

    /// Gives a tetrahedron what another remembers.
    pub fn copy(&mut self, from: TetrahedronPlace, to: TetrahedronPlace) {
        let read = self.parts[from.part as usize].fields_mut().map(|stresses| {
            let Stresses(numbers) = stresses.get(usize::from(from.group))?;
            Some(numbers.map(|lanes| lanes[usize::from(from.lane)]))
        });
        let written = self.parts[to.part as usize].fields_mut();
        for (stresses, numbers) in written.into_iter().zip(read) {
            if let (Some(Stresses(to_numbers)), Some(numbers)) = (stresses.get_mut(usize::from(to.group)), numbers) {
                for (lanes, number) in to_numbers.iter_mut().zip(numbers) {
                    lanes[usize::from(to.lane)] = number;
                }
            }
        }
    }

    /// Makes room for the rings of so many nodes in all.
    pub fn reserve_rings(&mut self, node_count: usize) -> Result<()> {
        if self.viscosity.is_none() {
            return Ok(());
        }
        self.rings.reserve(node_count)
    }

    /// Has rings of so many nodes, for which there is room.
    pub fn grow_rings(&mut self, node_count: usize) {
        if !self.viscosity.is_none() {
            self.rings.grow(node_count);
        }
    }

    /// Gives the ring of a node what another remembers.
    pub fn copy_ring(&mut self, from: u32, to: u32) {
        for values in self.rings.fields_mut() {
            if !values.is_empty() {
                values[to as usize] = values[from as usize];
            }
        }
    }

    /// The elastic pressure of a ring has become so much higher where it is, Pa, of which nothing was deformed.
    pub fn shift_ring(&mut self, node: u32, more: f32) {
        for values in [&mut self.rings.elastic, &mut self.rings.kept_elastic] {
            if let Some(value) = values.get_mut(node as usize) {
                *value += more;
            }
        }
    }

    /// An equation is to be solved for the end of so many seconds.
    pub fn foresee(&mut self, time: f64) {
        let course = self.viscosity.over(time);
        self.gain = course.gain as f32;
        for part in &mut self.parts {
            part.past.foresee(course);
            part.combine();
        }
        self.rings.foresee(course);
    }

    /// A step begins, from what is current.
    pub fn recall(&mut self) {
        self.gain = 0.0;
        for part in &mut self.parts {
            part.past.recall();
            part.set.iter_mut().for_each(PlasticSet::recall);
            part.combine();
        }
        self.rings.recall();
    }

    /// The step in progress is the current state.
    pub fn keep(&mut self) {
        for part in &mut self.parts {
            part.past.keep();
            part.set.iter_mut().for_each(PlasticSet::keep);
        }
        self.rings.keep();
    }

    /// The load on a tetrahedron.
    pub fn load(&self, part: usize, [group, lane]: [usize; 2]) -> Load {
        load_of(&self.parts[part].loads()[group], lane)
    }

    /// The load on the ring of a node, Pa.
    pub fn load_of_ring(&self, node: usize) -> f64 {
        self.rings.loads.get(node).map_or(0.0, |&load| f64::from(load))
    }

    /// What stiffens the law where it is multiplied by the gain.
    pub fn stiffened(&self, law: Law) -> Law {
        law.times(1.0 + self.gain)
    }

    /// Whether anything of it has energy.
    pub fn has_energy(&self) -> bool {
        self.viscosity.stiffening().is_some() || self.bounds.is_some()
    }

    /// The energy per volume of the arm's spring of a tetrahedron, and what it differs by because it has yielded, given what is elastic
    /// without that, Pa.
    pub fn energy_of(&self, law: Law, part: usize, [group, lane]: [usize; 2], elastic: Load) -> f64 {
        let OfPart { past, set, .. } = &self.parts[part];
        let mut energy = set
            .as_ref()
            .map_or(0.0, |set| set.energy(law, [group, lane], elastic.stress));
        if let Some(stiffening) = self.viscosity.stiffening() {
            let (load, gain) = (load_of(&past.loads[group], lane), f64::from(self.gain));
            let arm = Load {
                stress: load.stress + elastic.stress * gain,
                pressure: load.pressure + elastic.pressure * gain,
            };
            energy += law.energy_of(arm) / stiffening;
        }
        energy
    }

    /// That of all tetrahedra of a part with the newest elastic stresses, J.
    pub fn energy_of_part(&self, law: Law, part: usize, groups: &[Group]) -> f64 {
        let mut energy = 0.0;
        for (index, group) in groups.iter().enumerate() {
            for lane in (0..GROUP).filter(|&lane| group.volumes[lane] > 0.0) {
                let elastic = load_of(&self.parts[part].newest[index], lane);
                energy += f64::from(group.volumes[lane]) * self.energy_of(law, part, [index, lane], elastic);
            }
        }
        energy
    }

    /// The same of a ring with this elastic pressure, Pa, and volume, m³.
    pub fn energy_of_ring(&self, law: Law, node: usize, pressure: f64, volume: f64) -> f64 {
        let Some(stiffening) = self.viscosity.stiffening() else {
            return 0.0;
        };
        let arm = f64::from(self.rings.loads[node]) + f64::from(self.gain) * pressure;
        0.5 * volume * arm * arm / (f64::from(law.kappa) * stiffening)
    }

    /// What may change of it.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for OfPart { past, set, .. } in &self.parts {
            let left = set.iter().flat_map(PlasticSet::kept);
            for stresses in past.kept_arms.iter().chain(&past.kept_elastic).chain(left) {
                hasher.write_floats(stresses.numbers());
            }
        }
        hasher.write_floats(&self.rings.kept_arms);
        hasher.write_floats(&self.rings.kept_elastic);
    }
}

/// The number, or 0 where it is none.
#[inline(always)]
fn finite(number: f32) -> f32 {
    if number.is_finite() { number } else { 0.0 }
}

/// The stresses of a lane.
fn load_of(Stresses(numbers): &Stresses, lane: usize) -> Load {
    Load::of(numbers.map(|number| f64::from(number[lane])))
}
