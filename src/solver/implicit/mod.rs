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
mod integrator;
mod iterations;
mod loops;
mod parts;
mod pressed;
mod rigid;
mod solution;
mod step;

pub(crate) use solution::Solution;

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::def::{BodyDefinition, MOST_ITERATIONS, Solver, SolverReport};
use crate::forces::{Changes, Forces};
use crate::soa::{Vectors, tile_count};
use crate::solver::newton::Newton;
use blocks::{Blocks, Noise};
use coarse::Coarse;
use estimate::Spectrum;
use gradient::Partial;
use solution::History;
use step::Formula;

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
    fn vectors_mut(&mut self) -> impl Iterator<Item = &mut Vectors> {
        let is_exact = self.newton.is_some();
        let solved = [
            &mut self.corrections,
            &mut self.residuals,
            &mut self.searches,
            &mut self.products,
            &mut self.preconditioned,
        ];
        let solved = solved.into_iter().filter(move |_| !is_exact);
        let histories = self.solution.histories.iter_mut();
        let histories = histories.flat_map(move |history| history.vectors_mut(is_exact));
        histories.chain([&mut self.pushes]).chain(&mut self.means).chain(solved)
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
