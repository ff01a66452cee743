//! IMPLICIT: one solved equation per step, stable at any step.
//!
//! A step of length h goes from the positions x and velocities v to those at its end, where
//! `v1 = w + t a(x1, v1)` and `x1 = x + y + s`, with `s = t² a`. For implicit Euler (order 1) t = h, w = v, y = h v. For the second
//! backward difference formula (order 2; Curtiss, Hirschfelder 1952) with steps h after h' and q = h/h': t = h (1 + q)/(1 + 2q),
//! w = v + c (v - v'), y = c (x - x') + t w, c = q²/(1 + 2q). Both are `M s / t² = f(x + y + s)`, and differ in y, w and t alone.
//!
//! The unknown is s, what forces do within the step, not the position: the velocity is w + s/t, and nothing that is small is
//! found as a difference of what is large.

mod blocks;
mod coarse;
mod contact;
mod energy;
mod estimate;
mod gradient;
mod iterations;
mod loops;
mod parts;
mod pressed;
mod rigid;
mod solution;
mod step;

pub(crate) use solution::Solution;

use crate::base::{Result, StateHasher, memory};
use crate::codec::{Saved, Writer, saved};
use crate::contact::Contacts;
use crate::def::{BodyDefinition, MOST_ITERATIONS, Solver, SolverReport};
use crate::forces::{Changes, Forces};
use crate::geometry::Bounds;
use crate::soa::{PerNode, Vectors, tile_count};
use crate::solver::System;
use crate::solver::changed::Cached;
use crate::solver::integrator::{CoupledBody, CoupledStep, IMPLICIT, Integrator};
use crate::solver::needs::Need;
use crate::solver::newton::Newton;
use crate::solver::step_request::{StepRequest, StepStart};
use crate::solver::verlet::{Stepped, TooLong, begin};
use crate::threads::Team;
use blocks::{Blocks, Noise};
use coarse::Coarse;
use estimate::Spectrum;
use gradient::Partial;
use parts::{parts_near, take_part};
use pressed::Pressed;
use solution::History;
use step::Formula;

/// The energy that a solved equation has gained is taken off where there are so many, rather than that the step is taken in more.
const SLOWED_FROM: u32 = 256;

/// What rounding makes of a coordinate, as a fraction of the body's extent.
const ROUNDING: f64 = 1e-7;

/// How a substep ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Fine,
    /// With more energy than was put in.
    Gained,
    /// So near a tool that it is to be taken in shorter parts.
    Near,
    NotFinite,
}

/// What is known of the preconditioner from the steps before.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Experience {
    /// The smallest eigenvalue of the preconditioned matrix.
    smallest: f64,
    /// Products that the first solution with the preconditioner took.
    fresh_products: u32,
    /// Whether it has become so much worse that it is to be made again.
    worn: bool,
}

saved! { Experience { smallest, fresh_products, worn } }

/// What a body that is moved implicitly has beside its state.
#[derive(Debug)]
pub(crate) struct Implicit {
    /// 1 or 2.
    order: u32,
    /// The most products with the matrix for each equation asked for, and what is left of it for the step in progress.
    budget: u32,
    left: u32,
    /// The most products in the step in progress, whatever the definition allows.
    allowed: u32,
    /// The part of a step's correction that may be missing.
    accuracy: f32,
    solution: Solution,
    /// How the last equation that was solved makes velocities of what forces do.
    taken: Formula,
    /// s: what forces do within the step, m.
    pushes: Vectors,
    /// Where there are tools: how fast nodes go on their way, m/s.
    means: Option<Vectors>,
    // What follows, up to the spectrum, has room for no node where the equations are solved exactly.
    /// What is added to it by one solution of the linearised equation, m.
    corrections: Vectors,
    residuals: Vectors,
    searches: Vectors,
    /// What forces make of the search direction: lent by the body while its equation is solved.
    changes: Changes,
    /// The matrix times the search direction, and what the preconditioner makes of the residual.
    products: Vectors,
    preconditioned: Vectors,
    /// N/m; 0 for what is pinned.
    inertia: Vec<f32>,
    /// The sum of all.
    all_inertia: f64,
    /// For coordinates that are off by 1 m.
    noise: Noise,
    /// What `inertia` was made for: t, s; 0: nothing.
    prepared: f32,
    blocks: Blocks,
    coarse: Coarse,
    /// Nodes that tools press on, and what they take of the coarse level otherwise.
    stiffened: Vec<(u32, [f32; 4])>,
    /// The loads of the clusters from each tile.
    loads: Vec<f32>,
    partials: Vec<Partial>,
    spectrum: Spectrum,
    /// Whether the preconditioner is to be made again, from the current state: then what it is now means nothing.
    stale: bool,
    /// Whether that was so before the step in progress.
    was_stale: bool,
    /// That of the step in progress, and that of the current state.
    memory: Experience,
    kept: Experience,
    /// Where the equations are solved exactly.
    newton: Option<Box<Newton>>,
    /// The same with room for a cut that is not made yet.
    roomier: Option<Box<Newton>>,
    /// How the step in progress is taken, and how that was which led to the current state.
    report: SolverReport,
    told: SolverReport,
}

saved! { Implicit {
    order, budget, left, accuracy, solution, taken, pushes, means, corrections, residuals, searches, products,
    preconditioned, inertia, all_inertia, noise, prepared, blocks, coarse, stiffened, loads, partials, spectrum, stale,
    was_stale, memory, kept, newton, report, told } leaves { allowed: u32::MAX, changes: Changes::default(), roomier: None,
} where Self::ends }

impl Experience {
    const NONE: Self = Self {
        smallest: 1.0,
        fresh_products: 0,
        worn: false,
    };
}

impl Implicit {
    /// Whether a step of it ends as soon as one that a caller may ask for.
    fn ends(&self) -> bool {
        self.budget <= MOST_ITERATIONS
    }

    /// For nodes at these positions that these forces move; what is 0 in the definition is as by default.
    pub fn new(definition: &BodyDefinition, positions: &Vectors, forces: &mut Forces) -> Result<Self> {
        let node_count = positions.len();
        let is_exact = definition.solver == Solver::Newton;
        let (accuracy, budget) = if is_exact {
            // As good as nothing, and far above what rounding makes; for bodies of a million nodes.
            (1e-6, 100_000)
        } else {
            // A fraction of what a step of a length worth taking is off by itself, and more products than a body can need that is to be
            // stepped while somebody waits.
            (0.01, 1000)
        };
        let nothing = Vectors::zeros(0)?;
        let solved = if is_exact { &nothing } else { positions };
        let newton = is_exact.then(|| memory::boxed(Newton::new(forces)?)).transpose()?;
        if !is_exact {
            forces.make_room_for_changes()?;
        }
        let solved_count = solved.len();
        let vectors = || Vectors::zeros(solved_count);
        let coarse = Coarse::new(solved)?;
        let or = |given: u32, default| if given == 0 { default } else { given };
        let given = definition.accuracy;
        Ok(Self {
            order: or(definition.order, 2),
            budget: or(definition.iterations, budget),
            left: 0,
            allowed: u32::MAX,
            accuracy: if given > 0.0 { given } else { accuracy },
            solution: Solution::new(node_count, solved_count)?,
            taken: Formula::new(1, 0.0, 0.0),
            pushes: Vectors::zeros(node_count)?,
            means: None,
            corrections: vectors()?,
            residuals: vectors()?,
            searches: vectors()?,
            changes: Changes::default(),
            products: vectors()?,
            preconditioned: vectors()?,
            inertia: memory::filled(0.0, solved_count)?,
            all_inertia: 0.0,
            noise: Noise::default(),
            prepared: 0.0,
            blocks: Blocks::new(solved_count)?,
            loads: memory::filled(0.0, coarse.size() * tile_count(solved_count))?,
            coarse,
            stiffened: Vec::new(),
            partials: memory::filled(Partial::default(), tile_count(solved_count))?,
            spectrum: Spectrum::new(solved_count)?,
            stale: true,
            was_stale: true,
            memory: Experience::NONE,
            kept: Experience::NONE,
            newton,
            roomier: None,
            report: SolverReport::BEFORE,
            told: SolverReport::default(),
        })
    }

    /// What there is for each node: beside histories, pushes and means where its equation is solved by conjugate gradients.
    fn per_node_mut(&mut self) -> impl Iterator<Item = &mut dyn PerNode> {
        let is_exact = self.newton.is_some();
        let all: [&mut dyn PerNode; 10] = [
            &mut self.pushes,
            &mut self.means,
            &mut self.corrections,
            &mut self.residuals,
            &mut self.searches,
            &mut self.products,
            &mut self.preconditioned,
            &mut self.inertia,
            &mut self.blocks,
            &mut self.coarse,
        ];
        let histories = self.solution.histories.iter_mut();
        let histories = histories.flat_map(move |history| history.vectors_mut(is_exact));
        let histories = histories.map(|vectors| vectors as &mut dyn PerNode);
        histories.chain(all.into_iter().take(if is_exact { 2 } else { 10 }))
    }

    /// Begins a step anew, from the current state.
    fn begin_anew(&mut self) {
        (self.report.error, self.report.has_converged) = (0.0, true);
        self.memory = self.kept;
        self.spectrum.assume(self.kept.smallest);
    }

    /// What rounding leaves in a body that reaches so far, m.
    fn noise(&self, extent: f32) -> Noise {
        let square = (ROUNDING * f64::from(extent)).powi(2);
        Noise {
            error: square * self.noise.error,
            square: square * self.noise.square,
            energy: square * self.noise.energy,
        }
    }

    /// Notes how many products a solution took.
    fn wear(&mut self, products: u32) {
        let fresh = &mut self.memory.fresh_products;
        if *fresh == 0 {
            *fresh = products;
        } else if products > 2 * *fresh + 8 {
            self.memory.worn = true;
        }
    }
}

impl Integrator for Implicit {
    fn step(&mut self, body: &mut System, request: &StepRequest, again: Option<StepStart>, team: &Team) -> Stepped {
        self.allowed = request.work;
        let start = again.unwrap_or_else(|| StepStart::new(body.carry, request.substeps.max(1)));
        self.run(body, request, start, team)
    }

    fn need(&mut self, body: &mut System, request: &StepRequest, _team: &Team) -> Need {
        Need {
            start: body.carry,
            substeps: parts_near(request.dt).max(request.substeps),
            masses_for: 0.0,
        }
    }

    fn begin(&mut self, body: &mut System, _walk: &mut CoupledBody, step: &CoupledStep) -> Stepped<()> {
        begin(body, &step.request.of(body));
        self.report = SolverReport::BEFORE;
        self.allowed = step.request.work;
        self.left = self.budget.min(self.allowed);
        self.grant(step.substeps);
        self.begin_anew();
        Ok(())
    }

    fn substep(&mut self, body: &mut System, _walk: &mut CoupledBody, step: &CoupledStep, index: u32) -> Stepped<()> {
        let request = &step.request.of(body);
        // There may be no more substeps to try it in.
        let is_last_resort = step.is_last || step.substeps >= SLOWED_FROM;
        let part_of = [index, step.substeps];
        match take_part(body, self, request, part_of, [is_last_resort, false], step.team) {
            End::Fine => Ok(()),
            _ => Err(TooLong {
                stable_substep: 0.25 * step.substep(),
            }),
        }
    }

    fn end(&mut self, body: &mut System, _walk: &mut CoupledBody, _step: &CoupledStep, _given: Bounds) -> Stepped<()> {
        self.solution.settle_deflection();
        body.state.advance();
        Ok(())
    }

    fn solution(&self) -> Option<&Solution> {
        Some(&self.solution)
    }

    fn solution_mut(&mut self) -> Option<&mut Solution> {
        Some(&mut self.solution)
    }

    fn put_back(&mut self) {
        self.stale = self.was_stale;
    }

    fn commit(&mut self) {
        self.solution.settled = 1 - self.solution.settled;
        self.told = self.report;
        self.kept = self.memory;
        self.kept.smallest = self.spectrum.known_smallest();
        self.stale |= self.kept.worn;
        self.was_stale = self.stale;
    }

    fn forget(&mut self, known: Cached) {
        let history = self.solution.current_mut();
        match known {
            Cached::Energy | Cached::EquationEnergy => history.energy = None,
            Cached::Matrix => (self.stale, self.was_stale) = (true, true),
            Cached::History => {
                (history.step, history.energy) = (0.0, None);
                history.remainders.clear();
                history.pressed.iter_mut().for_each(Pressed::forget);
                if let Some(newton) = &mut self.newton {
                    newton.forget_remainders(self.solution.settled);
                }
            }
            _ => {}
        }
    }

    fn told(&self) -> SolverReport {
        self.told
    }

    fn hash(&self, hasher: &mut StateHasher) {
        let history = self.solution.current();
        let History {
            ways,
            gains,
            remainders,
            step,
            energy,
            credit,
            pressed: _,
        } = history;
        for vectors in [ways, gains, remainders] {
            hasher.write_vectors(vectors.iter());
        }
        hasher.write_floats(&[*step, self.accuracy]);
        let [energy, size] = energy.map_or([f64::NAN; 2], |total| [total.energy, total.size]);
        hasher.write_doubles(&[energy, size, *credit]);
        hasher.write_vectors(history.pressing().into_iter().flat_map(Vectors::iter));
        hasher.write_u64(u64::from(self.order) << 32 | u64::from(self.budget));
        if let Some(newton) = &self.newton {
            newton.hash(self.solution.settled, hasher);
        }
        hasher.write_u64(u64::from(self.stale));
        if !self.stale {
            hasher.write_u64(self.kept.smallest.to_bits());
            hasher.write_u64(u64::from(self.kept.fresh_products));
            self.blocks.hash(hasher);
            self.coarse.hash(hasher);
        }
    }

    fn save(&self, to: &mut Writer) {
        to.put(&[IMPLICIT]);
        Saved::save(self, to);
    }

    fn reserve_springs(&mut self, count: usize) -> Result<()> {
        self.newton.as_mut().map_or(Ok(()), |newton| newton.make_room(count))
    }

    fn reserve_contacts(&mut self, contacts: &mut Contacts) -> Result<()> {
        let count = contacts.reserve_holds()?;
        if self.means.is_none() {
            self.means = Some(Vectors::zeros(self.pushes.len())?);
        }
        // Up to four nodes move what a contact presses.
        let nodes = (4 * count).min(self.inertia.len());
        Ok(self.stiffened.try_reserve(nodes)?)
    }

    fn prepare_cut(&mut self, forces: &Forces, more: usize) -> Result<()> {
        let roomier = |newton: &Newton| memory::boxed(newton.roomier(forces, more)?);
        self.roomier = self.newton.as_deref().map(roomier).transpose()?;
        Ok(())
    }

    fn copy_motion(&mut self, source: usize, node: usize) {
        let history = self.solution.current_mut();
        for vectors in [&mut history.ways, &mut history.gains, &mut history.remainders] {
            if node < vectors.len() {
                vectors.set(node, vectors.get(source));
            }
        }
        if let Some(newton) = &mut self.newton {
            newton.copy_remainder(self.solution.settled, source, node);
        }
    }
}

impl PerNode for Implicit {
    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        self.per_node_mut().try_for_each(|it| it.reserve_nodes(count))?;
        if self.newton.is_some() {
            return Ok(());
        }
        self.spectrum.reserve(count)?;
        memory::reserve(&mut self.loads, self.coarse.size() * tile_count(count))?;
        memory::reserve(&mut self.partials, tile_count(count))
    }

    fn grow(&mut self, count: usize) {
        if let Some(roomier) = self.roomier.take() {
            self.newton = Some(roomier);
        }
        self.per_node_mut().for_each(|it| it.grow(count));
        self.prepared = 0.0;
        if self.newton.is_some() {
            return;
        }
        self.loads.resize(self.coarse.size() * tile_count(count), 0.0);
        self.partials.resize(tile_count(count), Partial::default());
    }
}
