//! History variables of tetrahedra: the stresses of Maxwell branches (Simo 1987), added to the elastic stress, and
//! plastic stresses.
//!
//! In a time h the stress q of a branch becomes `a q + g (S' - S)`, S being the elastic stress. Explicit solvers apply
//! q as it is between two substeps. Implicit ones apply `a q - g S` as an extra stress, and scale the elastic stress
//! by 1 + g, so that forces are those at the end of the step. Nodal pressures have branches too.

use super::cut::TetrahedronIndex;
use super::law::{ElasticLaw, TetStress};
use super::parts::FemPart;
use super::plasticity::{PlasticStresses, YieldLimits};
use super::tetrahedra::{GROUP, Group, Stresses};
use crate::base::{Result, StateHasher, memory};
use crate::codec::{Saved, saved};
use crate::def::{RelaxationStep, Viscosity, Yielding};
use crate::simd::ChosenKernel;

#[derive(Debug)]
pub(super) struct ElementHistory {
    pub viscosity: Viscosity,
    /// The gain g of the equation that is being solved; 0 if extra stresses are the current branch stresses.
    pub gain: f32,
    /// The yield limits, with plasticity.
    pub yield_limits: Option<YieldLimits>,
    pub parts: Vec<PartHistory>,
    /// Histories reserved for parts that cuts will add.
    spare: Vec<PartHistory>,
    pub nodal: MaxwellBranches<f32>,
}

saved! { ElementHistory { viscosity, gain, yield_limits, parts, spare, nodal } }

/// The history of the tetrahedra of a part.
#[derive(Debug)]
pub(super) struct PartHistory {
    maxwell: MaxwellBranches<Stresses>,
    plastic: Option<PlasticStresses>,
    /// A buffer for the current elastic stresses.
    pub newest: Vec<Stresses>,
}

saved! { PartHistory { maxwell, plastic, newest } }

/// The stresses of Maxwell branches in the step in progress, and their committed values.
#[derive(Debug)]
pub(super) struct MaxwellBranches<T> {
    branches: Vec<T>,
    elastic: Vec<T>,
    pub extra: Vec<T>,
    committed_branches: Vec<T>,
    committed_elastic: Vec<T>,
}

saved! { [T: Saved] MaxwellBranches<T> { branches, elastic, extra, committed_branches, committed_elastic } }

/// A fixed number of `f32` components.
pub(super) trait Components: Copy {
    const ZERO: Self;

    fn components(&self) -> &[f32];

    fn components_mut(&mut self) -> &mut [f32];
}

impl Components for f32 {
    const ZERO: Self = 0.0;

    fn components(&self) -> &[f32] {
        std::slice::from_ref(self)
    }

    fn components_mut(&mut self) -> &mut [f32] {
        std::slice::from_mut(self)
    }
}

impl Components for Stresses {
    const ZERO: Self = Self::ZERO;

    fn components(&self) -> &[f32] {
        self.0.as_flattened()
    }

    fn components_mut(&mut self) -> &mut [f32] {
        self.0.as_flattened_mut()
    }
}

impl<T: Components> MaxwellBranches<T> {
    fn new(count: usize) -> Result<Self> {
        let zeros = || memory::filled(T::ZERO, count);
        Ok(Self {
            branches: zeros()?,
            elastic: zeros()?,
            extra: zeros()?,
            committed_branches: zeros()?,
            committed_elastic: zeros()?,
        })
    }

    /// Sets extra stresses to `decay` times the branch stress minus `gain` times the elastic stress.
    fn predict(&mut self, relaxation: RelaxationStep) {
        let stresses = self.branches.iter().zip(&self.elastic);
        for (extra, (branch, elastic)) in self.extra.iter_mut().zip(stresses) {
            let components = branch.components().iter().zip(elastic.components());
            for (extra, (branch, elastic)) in extra.components_mut().iter_mut().zip(components) {
                *extra = relaxation.decay as f32 * branch - relaxation.gain as f32 * elastic;
            }
        }
    }

    /// Advances the branches to the elastic stresses `newest`.
    pub fn advance(&mut self, relaxation: RelaxationStep, newest: &[T]) {
        let stresses = self.branches.iter_mut().zip(&mut self.elastic).zip(&mut self.extra);
        for (((branch, elastic), extra), newest) in stresses.zip(newest) {
            let components = branch.components_mut().iter_mut().zip(elastic.components_mut());
            for ((branch, elastic), newest) in components.zip(newest.components()) {
                // A value beyond the range of `f32` would stay forever.
                *branch = finite(relaxation.decay as f32 * *branch + relaxation.gain as f32 * (newest - *elastic));
                *elastic = finite(*newest);
            }
            *extra = *branch;
        }
    }

    /// Reserves memory for `count` values in all.
    fn reserve(&mut self, count: usize) -> Result<()> {
        let mut all = self.fields_mut().into_iter();
        all.try_for_each(|values| memory::reserve(values, count))
    }

    /// Resizes to `count` values, within the reserved memory.
    fn grow(&mut self, count: usize) {
        self.fields_mut()
            .into_iter()
            .for_each(|values| values.resize(count, T::ZERO));
    }

    fn fields_mut(&mut self) -> [&mut Vec<T>; 5] {
        [
            &mut self.branches,
            &mut self.elastic,
            &mut self.extra,
            &mut self.committed_branches,
            &mut self.committed_elastic,
        ]
    }

    fn restore(&mut self) {
        self.branches.copy_from_slice(&self.committed_branches);
        self.elastic.copy_from_slice(&self.committed_elastic);
        self.extra.copy_from_slice(&self.committed_branches);
    }

    fn commit(&mut self) {
        self.committed_branches.copy_from_slice(&self.branches);
        self.committed_elastic.copy_from_slice(&self.elastic);
    }
}

impl PartHistory {
    /// Creates the history of `count` groups, with Maxwell branches and plastic stresses as requested.
    fn new(has_branches: bool, yields: bool, count: usize) -> Result<Self> {
        Ok(Self {
            maxwell: MaxwellBranches::new(if has_branches { count } else { 0 })?,
            plastic: if yields {
                Some(PlasticStresses::new(count)?)
            } else {
                None
            },
            newest: memory::filled(Stresses::ZERO, count)?,
        })
    }

    /// The stresses that are added to the elastic ones.
    pub fn extra_stresses(&self) -> &[Stresses] {
        self.plastic
            .as_ref()
            .map_or(&self.maxwell.extra, |plastic| &plastic.extra)
    }

    /// Advances branches to the elastic stresses in `newest`, and plastic flow if there are yield limits.
    pub fn advance(&mut self, kernel: ChosenKernel, relaxation: RelaxationStep, limits: Option<YieldLimits>) {
        self.maxwell.advance(relaxation, &self.newest);
        if let (Some(plastic), Some(limits)) = (&mut self.plastic, limits) {
            plastic.flow(kernel, limits, &self.newest);
        }
        self.combine();
    }

    /// True if a tetrahedron with this elastic stress would yield.
    pub fn yields(&self, limits: YieldLimits, lane_index: [usize; 2], elastic: TetStress) -> bool {
        self.plastic
            .as_ref()
            .is_some_and(|plastic| plastic.yields(limits, lane_index, elastic.stress))
    }

    /// All stored stresses; the slices of absent ones are empty.
    fn fields_mut(&mut self) -> [&mut [Stresses]; 9] {
        let Self {
            maxwell,
            plastic,
            newest,
        } = self;
        let [stresses, committed, extra] = plastic
            .as_mut()
            .map_or([&mut [][..], &mut [], &mut []], PlasticStresses::fields_mut);
        let [branches, elastic, branch_extra, committed_branches, committed_elastic] = maxwell.fields_mut();
        [
            branches,
            elastic,
            branch_extra,
            committed_branches,
            committed_elastic,
            newest,
            stresses,
            committed,
            extra,
        ]
    }

    fn combine(&mut self) {
        if let Some(plastic) = &mut self.plastic {
            plastic.combine(&self.maxwell.extra);
        }
    }
}

impl ElementHistory {
    /// Creates the history for this number of nodal pressures; `None` without viscosity and plasticity.
    pub fn new(
        law: ElasticLaw,
        viscosity: Viscosity,
        yielding: Yielding,
        parts: &[FemPart],
        pressure_count: usize,
    ) -> Result<Option<Box<Self>>> {
        // The volume term does not yield.
        let yields = !yielding.is_none() && law.mu > 0.0;
        if viscosity.is_none() && !yields {
            return Ok(None);
        }
        let has_branches = !viscosity.is_none();
        let part_histories = parts
            .iter()
            .map(|part| PartHistory::new(has_branches, yields, part.groups.as_slice().len()));
        let part_histories = memory::try_collected(part_histories)?;
        Ok(Some(memory::boxed(Self {
            viscosity,
            gain: 0.0,
            yield_limits: yields.then(|| YieldLimits::new(law, yielding)),
            parts: part_histories,
            spare: Vec::new(),
            nodal: MaxwellBranches::new(if has_branches { pressure_count } else { 0 })?,
        })?))
    }

    /// Reserves memory for additional parts of `groups` groups each.
    pub fn reserve_parts(&mut self, additional: usize, groups: usize) -> Result<()> {
        self.parts.try_reserve(additional)?;
        while self.spare.len() < additional {
            let part = PartHistory::new(!self.viscosity.is_none(), self.yield_limits.is_some(), groups)?;
            memory::push(&mut self.spare, part)?;
        }
        Ok(())
    }

    /// Adds a part, within the reserved memory.
    pub fn add_part(&mut self) {
        self.parts.extend(self.spare.pop());
    }

    /// Copies the history of one tetrahedron to another.
    pub fn copy(&mut self, from: TetrahedronIndex, to: TetrahedronIndex) {
        let read = self.parts[from.part as usize].fields_mut().map(|stresses| {
            let Stresses(components) = stresses.get(usize::from(from.group))?;
            Some(components.map(|lanes| lanes[usize::from(from.lane)]))
        });
        let written = self.parts[to.part as usize].fields_mut();
        for (stresses, components) in written.into_iter().zip(read) {
            if let (Some(Stresses(to_components)), Some(components)) =
                (stresses.get_mut(usize::from(to.group)), components)
            {
                for (lanes, component) in to_components.iter_mut().zip(components) {
                    lanes[usize::from(to.lane)] = component;
                }
            }
        }
    }

    /// Reserves memory for the nodal pressures of `node_count` nodes in all.
    pub fn reserve_nodal(&mut self, node_count: usize) -> Result<()> {
        if self.viscosity.is_none() {
            return Ok(());
        }
        self.nodal.reserve(node_count)
    }

    /// Resizes to the nodal pressures of `node_count` nodes, within the reserved memory.
    pub fn grow_nodal(&mut self, node_count: usize) {
        if !self.viscosity.is_none() {
            self.nodal.grow(node_count);
        }
    }

    /// Copies the nodal history of one node to another.
    pub fn copy_node(&mut self, from: u32, to: u32) {
        for values in self.nodal.fields_mut() {
            if !values.is_empty() {
                values[to as usize] = values[from as usize];
            }
        }
    }

    /// Adds `change` to the stored elastic pressure of a node without an effect on its branch, Pa.
    pub fn shift_nodal_pressure(&mut self, node: u32, change: f32) {
        for values in [&mut self.nodal.elastic, &mut self.nodal.committed_elastic] {
            if let Some(value) = values.get_mut(node as usize) {
                *value += change;
            }
        }
    }

    /// Predicts extra stresses at the end of `time` seconds, for the equation to be solved.
    pub fn predict(&mut self, time: f64) {
        let relaxation = self.viscosity.over(time);
        self.gain = relaxation.gain as f32;
        for part in &mut self.parts {
            part.maxwell.predict(relaxation);
            part.combine();
        }
        self.nodal.predict(relaxation);
    }

    /// Restores the committed history, at the beginning of a step.
    pub fn restore(&mut self) {
        self.gain = 0.0;
        for part in &mut self.parts {
            part.maxwell.restore();
            part.plastic.iter_mut().for_each(PlasticStresses::restore);
            part.combine();
        }
        self.nodal.restore();
    }

    /// Commits the history of the step in progress.
    pub fn commit(&mut self) {
        for part in &mut self.parts {
            part.maxwell.commit();
            part.plastic.iter_mut().for_each(PlasticStresses::commit);
        }
        self.nodal.commit();
    }

    /// The extra stress of a tetrahedron.
    pub fn extra_stress(&self, part: usize, [group, lane]: [usize; 2]) -> TetStress {
        lane_stress(&self.parts[part].extra_stresses()[group], lane)
    }

    /// The extra pressure of a node, Pa.
    pub fn extra_pressure(&self, node: usize) -> f64 {
        self.nodal.extra.get(node).map_or(0.0, |&extra| f64::from(extra))
    }

    /// The law with the elastic stress scaled by 1 plus the gain.
    pub fn stiffened(&self, law: ElasticLaw) -> ElasticLaw {
        law.scaled(1.0 + self.gain)
    }

    /// True if branches or plastic stresses have energy.
    pub fn has_energy(&self) -> bool {
        self.viscosity.stiffening().is_some() || self.yield_limits.is_some()
    }

    /// The energy density of a tetrahedron's branch spring and plastic stress, for its elastic stress, Pa.
    pub fn energy_density(&self, law: ElasticLaw, part: usize, [group, lane]: [usize; 2], elastic: TetStress) -> f64 {
        let PartHistory { maxwell, plastic, .. } = &self.parts[part];
        let mut energy = plastic
            .as_ref()
            .map_or(0.0, |plastic| plastic.energy(law, [group, lane], elastic.stress));
        if let Some(stiffening) = self.viscosity.stiffening() {
            let (extra, gain) = (lane_stress(&maxwell.extra[group], lane), f64::from(self.gain));
            let branch = TetStress {
                stress: extra.stress + elastic.stress * gain,
                pressure: extra.pressure + elastic.pressure * gain,
            };
            energy += law.energy_density(branch) / stiffening;
        }
        energy
    }

    /// The energy of branch springs and plastic stresses of a part at the elastic stresses in `newest`, J.
    pub fn part_energy(&self, law: ElasticLaw, part: usize, groups: &[Group]) -> f64 {
        let mut energy = 0.0;
        for (index, group) in groups.iter().enumerate() {
            for lane in (0..GROUP).filter(|&lane| group.volumes[lane] > 0.0) {
                let elastic = lane_stress(&self.parts[part].newest[index], lane);
                energy += f64::from(group.volumes[lane]) * self.energy_density(law, part, [index, lane], elastic);
            }
        }
        energy
    }

    /// The energy of the branch spring of a node with this elastic pressure, Pa, and rest volume, m³.
    pub fn nodal_energy(&self, law: ElasticLaw, node: usize, pressure: f64, volume: f64) -> f64 {
        let Some(stiffening) = self.viscosity.stiffening() else {
            return 0.0;
        };
        let branch = f64::from(self.nodal.extra[node]) + f64::from(self.gain) * pressure;
        0.5 * volume * branch * branch / (f64::from(law.kappa) * stiffening)
    }

    /// Hashes the committed state.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for PartHistory { maxwell, plastic, .. } in &self.parts {
            let plastic_stresses = plastic.iter().flat_map(PlasticStresses::committed);
            for stresses in maxwell
                .committed_branches
                .iter()
                .chain(&maxwell.committed_elastic)
                .chain(plastic_stresses)
            {
                hasher.write_floats(stresses.components());
            }
        }
        hasher.write_floats(&self.nodal.committed_branches);
        hasher.write_floats(&self.nodal.committed_elastic);
    }
}

/// The number if it is finite, else 0.
#[inline(always)]
fn finite(number: f32) -> f32 {
    if number.is_finite() { number } else { 0.0 }
}

/// The stress of one lane.
fn lane_stress(Stresses(components): &Stresses, lane: usize) -> TetStress {
    TetStress::from_components(components.map(|component| f64::from(component[lane])))
}
