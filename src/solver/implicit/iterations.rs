//! Newton's iterations of a step of IMPLICIT: along corrections, to where its equation holds.

use glam::Vec3;

use super::Implicit;
use super::gradient::Goal;
use super::loops::{Add, Refine, Residual, Slope};
use super::step::{MULTIPLIERS, Substep};
use crate::nodes::Pin;
use crate::simd::ChosenKernel;
use crate::soa::{TILE, TileForces, Vectors, tile_count, tile_nodes};
use crate::solver::System;
use crate::springs::{Motion, Tangent};
use crate::threads::{Items, Team};

/// Linearised equations solved in a step at most.
const NEWTON: u32 = 200;

/// What the contacts of a long step may take beyond its budget, in budgets: where they lack something, and beside that where they lack much,
/// which short parts would cost more. And no more products than that.
const MORE: [u32; 2] = [2, 4];
const MOST_MORE: u32 = 64;

/// What contacts of a long step lack then, as a part of what they do: a frame later little is there.
const LACKING: [f64; 2] = [0.01, 0.05];

/// What may be missing of a correction where other contacts push than before it, as a fraction of its size: others will after it.
const OTHER: f64 = 0.3;

/// What is left may be rounding, as far as it is no more than so many times what rounding is taken to leave.
const NEARLY: f64 = 100.0;

/// What rounded forces leave, as a part of what rounded positions do: that much is left once the latter is taken off. It is more where contacts
/// hold nodes, and does not count where nothing moves.
const QUIET: f64 = 1e-4;

/// Up to so many times what rounding leaves, what it makes of the residual is taken off again: beyond that it does not count.
const FINE: f64 = 1e4;

impl Substep<'_> {
    /// What the equation lacks with the nodes where they are: its product with the last correction, J.
    fn residual(&self, body: &mut System, implicit: &mut Implicit) -> f64 {
        if let Some(contacts) = &mut body.contacts {
            contacts.holds.press(|node| implicit.pushes.get(node).as_dvec3());
        }
        let node_count = body.node_count();
        let state = body.state.substep();
        body.forces.find(state.next_positions, self.team);
        let forces = body.forces.sum();
        let (positions, velocities) = (&*state.next_positions, &*state.velocities);
        let holds = body.contacts.as_ref().map(|contacts| &contacts.holds);
        let applied = body.applied.as_ref().filter(|_| body.forces_applied);
        let pressed = implicit.solution.next().pressing();
        let rates = body.damping.as_ref().map(|damping| damping.rates());
        let (masses, kernel) = (&body.masses, body.kernel);
        let motion = Motion {
            positions: body.forces.view(positions),
            ..Motion::at(positions, body.predicted_velocities.as_ref())
        };
        let (pushes, corrections, inertia) = (&implicit.pushes, &implicit.corrections, &implicit.inertia);
        let gravity = self.request.gravity;
        let written = (
            implicit.residuals.tiles_mut(),
            Items::new(&mut implicit.partials),
            body.pins.tiles_mut(),
        );
        self.team.pass(
            tile_count(node_count),
            written,
            |tile, (mut residuals, partial, pins)| {
                let nodes = tile_nodes(tile, node_count);
                let mut sums = TileForces::ZERO;
                forces.write(tile, nodes.clone(), &motion, &mut sums);
                show_held(pins, &sums, gravity, masses);
                kernel.run(Residual {
                    gravity,
                    forces: &sums,
                    applied: applied.map(|applied| applied.slices(nodes.clone())),
                    masses: &masses[nodes.clone()],
                    rates: rates.map(|rates| &rates[nodes.clone()]),
                    inertia: &inertia[nodes.clone()],
                    velocities: velocities.slices(nodes.clone()),
                    pushes: pushes.slices(nodes.clone()),
                    residuals: &mut residuals,
                });
                if let Some(pressed) = pressed {
                    kernel.run(Add {
                        factor: 1.0,
                        from: pressed.slices(nodes.clone()),
                        to: residuals.each_mut().map(|axis| &mut **axis),
                    });
                }
                if let Some(holds) = holds {
                    holds.add_forces(&nodes, &mut residuals);
                }
                for pin in &*pins {
                    pin.put(&mut residuals, pin.node as usize - nodes.start, Vec3::ZERO);
                }
                partial.first = kernel.run(Slope {
                    residuals: residuals.map(|axis| &*axis),
                    corrections: corrections.slices(nodes),
                });
            },
        );
        implicit.partials.iter().map(|partial| partial.first).sum()
    }

    /// Goes down to where the equation holds, as far as is asked for and the budget reaches; whether all is finite.
    pub(super) fn minimise(&self, body: &mut System, implicit: &mut Implicit) -> bool {
        let all_inertia = implicit.all_inertia;
        let noise = implicit.noise(body.extent());
        // What each of n equations lacks of its ways goes into the velocity too, and grows as n² by the step's end.
        let part = self.end - self.start;
        let tolerated = 0.1 * f64::from(self.request.tolerance) * part * part;
        let absolute = tolerated.powi(2) * all_inertia;
        let relative = f64::from(implicit.accuracy).powi(2);
        let mut whole_budget = self.budget(implicit);
        let mut more = MORE.map(|budgets| (budgets * whole_budget).min(MOST_MORE));
        // A caller that bounds the work of a step has it bounded.
        if !self.is_long() || implicit.allowed < u32::MAX {
            more = [0; 2];
        }
        let mut products = 0;
        let mut size = 0.0;
        let mut error = f64::INFINITY;
        let mut is_solved = false;
        let held = body.held_axes();
        let is_held = held.all();
        self.place(body, implicit);
        self.residual(body, implicit);
        let (mut gone, mut vain, mut solved_error, mut is_small) = (0.0, 0, 0.0_f64, false);
        let mut square = 0.0;
        let has_holds = body
            .contacts
            .as_deref()
            .is_some_and(|contacts| !contacts.holds.is_empty());
        for iteration in 0..NEWTON {
            self.stiffen(body, implicit);
            let is_other = body
                .contacts
                .as_mut()
                .is_some_and(|contacts| contacts.holds.have_changed());
            implicit.corrections.clear();
            square = implicit.precondition(body, 0.0, self.team).first;
            // What a solution has left of it is rounding.
            let rounding = if has_holds || is_small { 1.0 } else { QUIET } * noise.square;
            if square <= FINE * noise.square && (gone < 1.0 || square > rounding) {
                self.refine(body, implicit);
                square = implicit.precondition(body, 0.0, self.team).first;
            }
            if gone >= 1.0 && square <= rounding {
                error = solved_error.max(noise.error);
                is_solved = true;
                break;
            }
            implicit.spectrum.begin();
            let remaining = square * implicit.spectrum.factor();
            // What rounding leaves is not improved by going all the way again; far above that, it is bends that take so long.
            let is_in_vain = gone >= 1.0 && remaining > 0.5 * error && square <= NEARLY * noise.square;
            vain = if is_in_vain { vain + 1 } else { 0 };
            let is_stuck = vain > 2;
            error = remaining;
            for (more, missing) in more.iter_mut().zip(LACKING) {
                if products >= whole_budget && !self.is_balanced(body, implicit, missing) {
                    whole_budget += std::mem::take(more);
                }
            }
            let budget = whole_budget - products.min(whole_budget);
            // What all nodes do together may be less than what rounding does to stiff springs: a solution is tried in any case.
            let is_tried = iteration > 0 || square == 0.0;
            let is_found =
                is_tried && error <= absolute.max(relative * size) && self.is_balanced(body, implicit, LACKING[0]);
            is_solved = is_found || is_stuck;
            if is_solved || budget == 0 || !error.is_finite() {
                break;
            }
            let goal = Goal {
                budget,
                absolute,
                relative,
                size,
                own: if is_other { OTHER.powi(2) } else { 0.0 },
            };
            let positions = body.state.next_positions();
            let solved = implicit.solve(body, positions, self.tangent(), goal, square, self.team);
            implicit.report.solves += 1;
            products += solved.products;
            if implicit.stiffened.is_empty() {
                implicit.wear(solved.products);
            }
            solved_error = solved.error;
            if let Some(contacts) = &mut body.contacts {
                contacts.holds.let_go();
            }
            // Where the correction itself is no more than rounding, there is no need to look at what it led to: but what
            // nothing holds is to keep its momentum.
            is_small = solved.size <= f64::max(absolute, noise.error)
                && solved.error <= absolute.max(relative * f64::max(size, solved.size));
            if is_small && is_held && implicit.stiffened.is_empty() {
                add(&mut implicit.pushes, &implicit.corrections, 1.0, body.kernel, self.team);
                self.place(body, implicit);
                error = solved.error;
                is_solved = true;
                break;
            }
            gone = self.go(body, implicit, solved.work);
            size = f64::max(size, gone * gone * solved.size);
            let push = |node: usize| implicit.pushes.get(node).as_dvec3();
            // Before that, what contacts do is not what it will be, and would grow with each multiplier made of it.
            if iteration < MULTIPLIERS
                && gone == 1.0
                && let Some(contacts) = &mut body.contacts
                && contacts.holds.missing(push) > f64::from(implicit.accuracy)
            {
                let (residuals, free) = (&mut implicit.residuals, &body.inverse_masses);
                contacts.holds.improve(push, |node, more| {
                    if free[node] > 0.0 {
                        residuals.set(node, residuals.get(node) + more.as_vec3());
                    }
                });
                for pin in body.pins.partial() {
                    pin.put_among(residuals, Vec3::ZERO);
                }
            }
            if gone == 1.0
                && solved.size.max(solved.error) <= relative * size
                && self.is_balanced(body, implicit, LACKING[0])
            {
                error = solved.error;
                is_solved = true;
                break;
            }
        }
        implicit.soften();
        if let Some(contacts) = &mut body.contacts {
            contacts.holds.let_go();
        }
        let is_touched = body
            .contacts
            .as_ref()
            .is_some_and(|contacts| contacts.holds.are_pressed());
        if !is_held && !is_touched {
            implicit.balance(body.state.next_positions(), held);
            self.place(body, implicit);
        }
        implicit.report.iterations += products;
        implicit.left = implicit.left.saturating_sub(products);
        implicit.report.has_converged &= is_solved;
        self.bound_tool_forces(body, implicit, error);
        let error = (error / all_inertia).sqrt() as f32;
        implicit.report.error = implicit.report.error.max(error);
        square.is_finite()
    }

    /// Has the residual be that of where the nodes are, not of where their positions are rounded to.
    fn refine(&self, body: &System, implicit: &mut Implicit) {
        self.find_lacks(body, implicit);
        // What is lacking has no speed.
        let tangent = Tangent {
            rate: 0.0,
            ..self.tangent()
        };
        implicit.multiply(body, body.state.next_positions(), tangent, None, self.team);
        let node_count = body.node_count();
        let (inertia, searches, products) = (&implicit.inertia, &implicit.searches, &implicit.products);
        let written = implicit.residuals.tiles_mut();
        self.team.pass(tile_count(node_count), written, |tile, mut residuals| {
            let nodes = tile_nodes(tile, node_count);
            body.kernel.run(Refine {
                inertia: &inertia[nodes.clone()],
                ways: searches.slices(nodes.clone()),
                products: products.slices(nodes),
                residuals: &mut residuals,
            });
        });
    }

    /// Goes along the correction, as far as the forces do not turn against it, and on where they still pull along it, as they do
    /// where pressed springs buckle: what part of it.
    fn go(&self, body: &mut System, implicit: &mut Implicit, work: f64) -> f64 {
        let mut gone = 1.0;
        add(&mut implicit.pushes, &implicit.corrections, 1.0, body.kernel, self.team);
        for _ in 0..12 {
            self.place(body, implicit);
            let slope = self.residual(body, implicit);
            if slope >= -0.5 * work {
                return gone;
            }
            // Where the slope would be zero if it changed evenly; far less where it is nothing at all.
            let part = if slope.is_finite() { work / (work - slope) } else { 0.1 };
            let next = gone * f64::clamp(part, 0.1, 0.7);
            add(
                &mut implicit.pushes,
                &implicit.corrections,
                (next - gone) as f32,
                body.kernel,
                self.team,
            );
            gone = next;
        }
        self.place(body, implicit);
        self.residual(body, implicit);
        gone
    }
}

/// Shows each pin of a tile what holds it against these forces.
pub(super) fn show_held(pins: &mut [Pin], forces: &TileForces, gravity: Vec3, masses: &[f32]) {
    for pin in pins {
        let node = pin.node as usize;
        pin.solved = -(forces.get(node % TILE) + gravity * masses[node]);
    }
}

/// Adds `factor` times the one to the other.
fn add(to: &mut Vectors, from: &Vectors, factor: f32, kernel: ChosenKernel, team: &Team) {
    let node_count = from.len();
    team.pass(tile_count(node_count), to.tiles_mut(), |tile, to| {
        let from = from.slices(tile_nodes(tile, node_count));
        kernel.run(Add { factor, from, to });
    });
}
