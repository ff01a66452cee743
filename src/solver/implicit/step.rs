//! A part of a step of IMPLICIT, one solved equation: where it aims, and what is made of what Newton's iterations find.

use glam::Vec3;

use super::energy::EnergyBefore;
use super::loops::{Add, Finish, Lack, Place, Predict, Remain};
use super::{End, Experience, Implicit};
use crate::base::{Stage, Stopwatch};
use crate::codec::saved;
use crate::soa::{Records, Vectors, WriteRecords, copy_axes, tile_count, tile_nodes};
use crate::solver::System;
use crate::solver::kick::{Survey, look};
use crate::solver::newton::{Aimed, Newton};
use crate::solver::step_request::StepRequest;
use crate::springs::Tangent;
use crate::threads::{Items, Team};

/// The largest ratio of a step to the last with which the formula of order 2 is used: it is stable up to 2.41.
const LARGEST_RATIO: f64 = 2.0;

/// The multipliers of contacts are improved so often at most: then what is left has a function to minimise.
pub(super) const MULTIPLIERS: u32 = 20;

/// How one step is made from what was before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Formula {
    /// t, s.
    pub(super) time: f64,
    /// c: what part of the last way and of the last gain goes on.
    pub carried: f64,
}

saved! { Formula { time, carried } }

impl Formula {
    pub(super) fn new(order: u32, step: f64, last_step: f64) -> Self {
        let ratio = if last_step > 0.0 { step / last_step } else { 0.0 };
        if order == 1 || ratio == 0.0 || ratio > LARGEST_RATIO {
            Self {
                time: step,
                carried: 0.0,
            }
        } else {
            let carried = ratio * ratio / (1.0 + 2.0 * ratio);
            Self {
                time: step * (1.0 + ratio) / (1.0 + 2.0 * ratio),
                carried,
            }
        }
    }
}

/// One solved equation.
#[derive(Clone, Copy)]
pub(super) struct Substep<'a> {
    pub request: &'a StepRequest<'a>,
    /// s
    pub step: f64,
    /// Fractions of the step asked for.
    pub start: f64,
    pub end: f64,
    pub is_first: bool,
    /// With those that come after it in the step.
    pub(super) equations: u32,
    /// Whether it stands whatever it did not foresee of contacts.
    pub(super) stands: bool,
    pub(super) formula: Formula,
    pub team: &'a Team<'a>,
}

impl Substep<'_> {
    /// Takes it, with order 1 where that of order 2 gains energy; as a last resort, or where no product is left to try
    /// anything else, what was gained is taken off again. Then tools stop what would enter them.
    pub(super) fn take_safely(self, body: &mut System, implicit: &mut Implicit, is_last_resort: bool) -> End {
        let watch = Stopwatch::start(self.request.profile);
        let before = self.energy_before(body, implicit);
        let report = implicit.report;
        let mut end = self.take(body, implicit, before);
        if matches!(end, End::Gained | End::NotFinite) && self.may_be_of_order_1(implicit) {
            (implicit.report.error, implicit.report.has_converged) = (report.error, report.has_converged);
            end = self.of_order_1().take(body, implicit, before);
        }
        if end == End::Gained && (is_last_resort || implicit.left == 0) {
            self.slow_down(body, implicit, before);
            end = End::Fine;
        }
        if end == End::Fine {
            end = self.meet(body, implicit);
        }
        if end == End::Fine {
            if let Some(contacts) = &mut body.contacts {
                contacts.remember(self.request.tools);
            }
            let next = body.state.next_positions();
            body.forces.age(self.step, next, self.team);
            if body.forces.remember() {
                // What was stored is lost by then.
                implicit.solution.part();
            }
        }
        watch.stop(self.request.profile, Stage::Solver);
        end
    }

    /// Whether the step can be taken again by implicit Euler, and was not. What a later substep began with has been written over: then the whole
    /// step is taken again.
    pub(super) fn may_be_of_order_1(&self, implicit: &Implicit) -> bool {
        self.formula.carried != 0.0 && self.is_first && implicit.left > 0
    }

    /// The same step by implicit Euler.
    pub(super) fn of_order_1(&self) -> Self {
        Self {
            formula: Formula::new(1, self.step, 0.0),
            ..*self
        }
    }

    fn take(&self, body: &mut System, implicit: &mut Implicit, before: EnergyBefore) -> End {
        body.forces.foresee(self.step);
        match self.foreseeing(body, implicit) {
            Some(foreseeing) => foreseeing.take_formula(body, implicit, before),
            None => End::Near,
        }
    }

    fn take_formula(&self, body: &mut System, implicit: &mut Implicit, before: EnergyBefore) -> End {
        if let Some(mut newton) = implicit.newton.take() {
            self.aim(body, implicit);
            self.solve_exactly(body, implicit, &mut newton);
            implicit.newton = Some(newton);
        } else {
            self.prepare(body, implicit);
            self.aim(body, implicit);
            implicit.changes = std::mem::take(&mut body.forces.changes);
            let is_finite = self.minimise(body, implicit);
            body.forces.changes = std::mem::take(&mut implicit.changes);
            if !is_finite {
                return End::NotFinite;
            }
        }
        if self.finish(body, implicit) {
            self.account(body, implicit, before)
        } else {
            End::NotFinite
        }
    }

    /// t of its formula, s.
    pub(super) fn time(&self) -> f64 {
        self.formula.time
    }

    /// c of its formula.
    pub(super) fn carried(&self) -> f64 {
        self.formula.carried
    }

    /// The tangent of the springs for this step.
    pub(super) fn tangent(&self) -> Tangent {
        Tangent {
            floor: 0.0,
            rate: (1.0 / self.formula.time) as f32,
        }
    }

    /// Makes inertia and preconditioner those of this step.
    fn prepare(&self, body: &System, implicit: &mut Implicit) {
        /// What viscosity adds goes with the step: within this factor the preconditioner serves.
        const SIMILAR: f32 = 2.0;
        let time = self.formula.time as f32;
        let is_similar = (implicit.prepared / SIMILAR..=implicit.prepared * SIMILAR).contains(&time);
        implicit.stale |= !is_similar && body.forces.remember();
        let positions = body.state.newest().0;
        if implicit.stale {
            let (forces, tangent) = (&body.forces, self.tangent());
            implicit.blocks.gather(forces, positions, tangent, self.team);
            implicit
                .coarse
                .gather(forces, &body.inverse_masses, &body.pins, positions, tangent);
            for pin in body.pins.partial() {
                implicit.blocks.hold(pin.node as usize, pin.axes);
            }
        }
        if time != implicit.prepared || implicit.stale {
            let per_mass = 1.0 / (self.formula.time * self.formula.time);
            for (node, inertia) in implicit.inertia.iter_mut().enumerate() {
                let rate = body
                    .damping
                    .as_ref()
                    .map_or(0.0, |damping| f64::from(damping.rates()[node]));
                let mass = f64::from(body.masses[node]);
                let per_mass = per_mass + rate / self.formula.time;
                *inertia = if body.inverse_masses[node] > 0.0 {
                    (mass * per_mass) as f32
                } else {
                    0.0
                };
            }
            implicit.all_inertia = implicit.inertia.iter().map(|&inertia| f64::from(inertia)).sum();
            implicit.blocks.invert(&implicit.inertia, self.team);
            implicit.coarse.invert(&implicit.inertia, &body.pins);
            implicit.noise = implicit.blocks.noise(&implicit.inertia);
            implicit.prepared = time;
        }
        if implicit.stale {
            implicit.stale = false;
            implicit.memory = Experience::NONE;
            implicit.spectrum.assume(1.0);
        }
    }

    /// Puts the velocities where they would be without forces, and begins with no pushes at all: what forces did before is
    /// the better guess where motion is smooth, and where stiff springs turn it is far worse than none.
    fn aim(&self, body: &mut System, implicit: &mut Implicit) {
        let node_count = body.node_count();
        let state = body.state.substep();
        let first = self.is_first.then_some(state.first_velocities);
        let gains = &implicit.solution.last(self.is_first).gains;
        let carried = self.formula.carried as f32;
        implicit.pushes.clear();
        let written = (state.velocities.tiles_mut(), body.pins.tiles_mut());
        let (kernel, dt) = (body.kernel, self.request.dt);
        self.team
            .pass(tile_count(node_count), written, |tile, (mut velocities, pins)| {
                let nodes = tile_nodes(tile, node_count);
                if let Some(first) = first {
                    copy_axes(&mut velocities, first.slices(nodes.clone()));
                }
                kernel.run(Add {
                    factor: carried,
                    from: gains.slices(nodes.clone()),
                    to: velocities.each_mut().map(|axis| &mut **axis),
                });
                for pin in pins {
                    let place = pin.node as usize - nodes.start;
                    pin.put(&mut velocities, place, pin.travel / dt);
                }
            });
    }

    /// Puts the nodes where `pushes` has them.
    pub(super) fn place(&self, body: &mut System, implicit: &Implicit) {
        let node_count = body.node_count();
        let state = body.state.substep();
        let history = implicit.solution.last(self.is_first);
        let time = self.formula.time as f32;
        let carried = self.formula.carried as f32;
        let (positions, velocities) = (state.positions, &*state.velocities);
        let predicted = body.predicted_velocities.as_mut().map(Vectors::tiles_mut);
        let records = body.forces.records.as_mut().map(Records::tiles_mut);
        let written = (
            state.next_positions.tiles_mut(),
            predicted,
            body.pins.tiles_mut(),
            records,
        );
        let (kernel, end) = (body.kernel, self.end);
        self.team.pass(
            tile_count(node_count),
            written,
            |tile, (mut next, predicted, pins, records)| {
                let nodes = tile_nodes(tile, node_count);
                kernel.run(Place {
                    carried,
                    time,
                    positions: positions.slices(nodes.clone()),
                    velocities: velocities.slices(nodes.clone()),
                    ways: history.ways.slices(nodes.clone()),
                    pushes: implicit.pushes.slices(nodes.clone()),
                    remainders: history.remainders.slices(nodes.clone()),
                    next: &mut next,
                });
                if let Some(mut predicted) = predicted {
                    kernel.run(Predict {
                        time,
                        velocities: velocities.slices(nodes.clone()),
                        pushes: implicit.pushes.slices(nodes.clone()),
                        predicted: &mut predicted,
                    });
                }
                for pin in pins {
                    pin.put(&mut next, pin.node as usize - nodes.start, pin.place(end));
                }
                if let Some(records) = records {
                    let axes = next.each_ref().map(|axis| &**axis);
                    kernel.run(WriteRecords { axes, records });
                }
            },
        );
    }

    /// Makes the search direction what the next positions lack of where `pushes` has the nodes.
    pub(super) fn find_lacks(&self, body: &System, implicit: &mut Implicit) {
        let node_count = body.node_count();
        let (positions, velocities) = body.state.newest();
        let next = body.state.next_positions();
        let (history, pushes) = (implicit.solution.last(self.is_first), &implicit.pushes);
        let time = self.formula.time as f32;
        let carried = self.formula.carried as f32;
        let records = implicit.changes.records.as_mut().map(Records::tiles_mut);
        let written = (implicit.searches.tiles_mut(), records);
        let kernel = body.kernel;
        self.team
            .pass(tile_count(node_count), written, |tile, (mut lacks, records)| {
                let nodes = tile_nodes(tile, node_count);
                kernel.run(Lack {
                    carried,
                    time,
                    positions: positions.slices(nodes.clone()),
                    velocities: velocities.slices(nodes.clone()),
                    ways: history.ways.slices(nodes.clone()),
                    pushes: pushes.slices(nodes.clone()),
                    remainders: history.remainders.slices(nodes.clone()),
                    next: next.slices(nodes.clone()),
                    lacks: &mut lacks,
                });
                for pin in body.pins.of_tile(tile) {
                    pin.put(&mut lacks, pin.node as usize - nodes.start, Vec3::ZERO);
                }
                if let Some(records) = records {
                    let axes = lacks.each_ref().map(|axis| &**axis);
                    kernel.run(WriteRecords { axes, records });
                }
            });
    }

    /// How many products this equation may take: its share of what is left, and one at least.
    pub(super) fn budget(&self, implicit: &Implicit) -> u32 {
        (implicit.left / self.equations).max(1)
    }

    /// Finds the pushes to the last digit that counts.
    fn solve_exactly(&self, body: &mut System, implicit: &mut Implicit, newton: &mut Newton) {
        /// What contacts may still lack, as a part of what they do.
        const CONTACTS: f64 = 1e-4;
        for multipliers in 0..=MULTIPLIERS {
            self.solve_pressed(body, implicit, newton);
            let Some(contacts) = &mut body.contacts else {
                break;
            };
            let push = |node: usize| implicit.pushes.get(node).as_dvec3();
            if multipliers == MULTIPLIERS || contacts.holds.missing(push) <= CONTACTS {
                break;
            }
            contacts.holds.improve(push, |_, _| ());
        }
    }

    /// The same, with the multipliers that contacts have.
    fn solve_pressed(&self, body: &mut System, implicit: &mut Implicit, newton: &mut Newton) {
        let (from, to) = (implicit.solution.place(self.is_first), 1 - implicit.solution.settled);
        let aimed = Aimed {
            time: self.formula.time,
            carried: self.formula.carried,
            gravity: self.request.gravity,
            end: self.end,
            ways: &implicit.solution.last(self.is_first).ways,
            pressed: implicit.solution.next().pressing(),
            from,
            to,
            budget: self.budget(implicit),
            accuracy: f64::from(implicit.accuracy),
            tolerance: f64::from(self.request.tolerance),
        };
        let found = newton.solve(body, &aimed, &mut implicit.pushes);
        implicit.left = implicit.left.saturating_sub(found.products);
        let report = &mut implicit.report;
        report.iterations += found.products;
        report.solves += found.iterations;
        report.error = report.error.max(found.error as f32);
        report.has_converged &= found.converged;
    }

    /// Makes velocities and history of what was found; whether all is finite.
    fn finish(&self, body: &mut System, implicit: &mut Implicit) -> bool {
        implicit.taken = self.formula;
        implicit.solution.latest = self.step as f32;
        let node_count = body.node_count();
        let turn = self.lost_turn(body, implicit);
        let (kernel, dt, part) = (body.kernel, self.request.dt, (self.end - self.start) as f32);
        let time = self.formula.time as f32;
        let carried = self.formula.carried as f32;
        let [settled, next] = implicit.solution.current_and_next();
        let from = self.is_first.then_some(&*settled);
        next.step = self.step as f32;
        let state = body.state.substep();
        let (starts, positions) = (state.positions, &*state.next_positions);
        let pushes = &implicit.pushes;
        let is_exact = implicit.newton.is_some();
        let before = self.is_first.then_some(state.first_velocities);
        let written = (
            state.velocities.tiles_mut(),
            next.ways.tiles_mut(),
            next.gains.tiles_mut(),
            (!is_exact).then(|| next.remainders.tiles_mut()),
            body.pins.tiles_mut(),
            Items::new(&mut body.surveys),
        );
        self.team.pass(
            tile_count(node_count),
            written,
            |tile, (mut velocities, mut ways, mut gains, remainders, pins, survey)| {
                let nodes = tile_nodes(tile, node_count);
                if let Some(from) = from {
                    copy_axes(&mut ways, from.ways.slices(nodes.clone()));
                    copy_axes(&mut gains, from.gains.slices(nodes.clone()));
                }
                kernel.run(Finish {
                    carried,
                    time,
                    pushes: pushes.slices(nodes.clone()),
                    before: before.map(|before| before.slices(nodes.clone())),
                    velocities: &mut velocities,
                    ways: &mut ways,
                    gains: &mut gains,
                });
                if let Some(turn) = &turn {
                    turn.add(positions.slices(nodes.clone()), &mut velocities, &mut gains);
                }
                if let Some(mut remainders) = remainders {
                    if let Some(from) = from {
                        copy_axes(&mut remainders, from.remainders.slices(nodes.clone()));
                    }
                    kernel.run(Remain {
                        ways: ways.each_ref().map(|axis| &**axis),
                        starts: starts.slices(nodes.clone()),
                        ends: positions.slices(nodes.clone()),
                        remainders: &mut remainders,
                    });
                    for pin in &*pins {
                        pin.put(&mut remainders, pin.node as usize - nodes.start, Vec3::ZERO);
                    }
                }
                for pin in pins {
                    let place = pin.node as usize - nodes.start;
                    pin.put(&mut velocities, place, pin.travel / dt);
                    pin.put(&mut ways, place, pin.travel * part);
                    pin.put(&mut gains, place, Vec3::ZERO);
                }
                let velocities = velocities.map(|axis| &*axis);
                *survey = look(kernel, velocities, Some(positions.slices(nodes)));
            },
        );
        body.surveys.iter().copied().fold(Survey::NOTHING, Survey::and).finite
    }
}
