//! Newton iterations for the equation of an IMPLICIT step.

use glam::Vec3;

use super::Implicit;
use super::conjugate_gradient::SolveGoal;
use super::node_kernels::{AddScaled, CorrectResidual, Residual, ResidualSlope};
use super::step::{MAX_MULTIPLIER_UPDATES, Substep};
use crate::nodes::Pin;
use crate::simd::ChosenKernel;
use crate::soa::{TILE, TileForces, Vectors, tile_count, tile_nodes};
use crate::solver::System;
use crate::springs::{ForceInput, Tangent};
use crate::threads::{Items, Team};

/// Maximum number of linear solves per substep.
const MAX_NEWTON_ITERATIONS: u32 = 200;

/// Extra products for contacts of a long step, in budgets: if they are inaccurate, and again if they are very
/// inaccurate. Short substeps would cost more. The second constant limits the products of each.
const EXTRA_BUDGETS: [u32; 2] = [2, 4];
const MAX_EXTRA_PRODUCTS: u32 = 64;

/// Contact errors that count as inaccurate and as very inaccurate, relative to the contact contribution. Most of the
/// error is gone one frame later.
const CONTACT_TOLERANCES: [f64; 2] = [0.01, 0.05];

/// Relative error allowed in a correction after the active contacts have changed, because they will change again.
const ACTIVE_SET_TOLERANCE: f64 = 0.3;

/// A residual up to this multiple of the roundoff bound may be due to rounding.
const STAGNATION_LIMIT: f64 = 100.0;

/// Residual of rounded forces relative to that of rounded positions. It remains after position rounding is corrected.
/// It is not used if contacts hold nodes, which round more, or if nothing moves.
const FORCE_ROUNDOFF: f64 = 1e-4;

/// Up to this multiple of the roundoff bound, the residual is corrected for rounded positions. Above, rounding does not
/// matter.
const REFINE_LIMIT: f64 = 1e4;

impl Substep<'_> {
    /// Computes the residual at the next positions. Returns its product with the last correction, J.
    fn residual(&self, body: &mut System, implicit: &mut Implicit) -> f64 {
        if let Some(contacts) = &mut body.contacts {
            contacts
                .multipliers
                .evaluate(|node| implicit.force_displacements.get(node).as_dvec3());
        }
        let node_count = body.node_count();
        let state = body.state.substep();
        body.forces.compute(state.next_positions, self.team);
        let forces = body.forces.sum();
        let (positions, velocities) = (&*state.next_positions, &*state.velocities);
        let multipliers = body.contacts.as_ref().map(|contacts| &contacts.multipliers);
        let applied = body.applied.as_ref().filter(|_| body.forces_applied);
        let contact_forces = implicit.solution.next().active_contact_forces();
        let rates = body.damping.as_ref().map(|damping| damping.rates());
        let (masses, kernel) = (&body.masses, body.kernel);
        let motion = ForceInput {
            positions: body.forces.view(positions),
            ..ForceInput::at(positions, body.predicted_velocities.as_ref())
        };
        let (force_displacements, corrections, inertia) =
            (&implicit.force_displacements, &implicit.corrections, &implicit.inertia);
        let gravity = self.request.gravity;
        let written = (
            implicit.residuals.tiles_mut(),
            Items::new(&mut implicit.tile_sums),
            body.pins.tiles_mut(),
        );
        self.team.pass(
            tile_count(node_count),
            written,
            |tile, (mut residuals, partial, pins)| {
                let nodes = tile_nodes(tile, node_count);
                let mut sums = TileForces::ZERO;
                forces.write(tile, nodes.clone(), &motion, &mut sums);
                store_pin_reactions(pins, &sums, gravity, masses);
                kernel.run(Residual {
                    gravity,
                    forces: &sums,
                    applied: applied.map(|applied| applied.slices(nodes.clone())),
                    masses: &masses[nodes.clone()],
                    rates: rates.map(|rates| &rates[nodes.clone()]),
                    inertia: &inertia[nodes.clone()],
                    velocities: velocities.slices(nodes.clone()),
                    force_displacements: force_displacements.slices(nodes.clone()),
                    residuals: &mut residuals,
                });
                if let Some(contact_forces) = contact_forces {
                    kernel.run(AddScaled {
                        factor: 1.0,
                        from: contact_forces.slices(nodes.clone()),
                        to: residuals.each_mut().map(|axis| &mut **axis),
                    });
                }
                if let Some(multipliers) = multipliers {
                    multipliers.add_forces(&nodes, &mut residuals);
                }
                for pin in &*pins {
                    pin.write_held(&mut residuals, pin.node as usize - nodes.start, Vec3::ZERO);
                }
                partial.product = kernel.run(ResidualSlope {
                    residuals: residuals.map(|axis| &*axis),
                    corrections: corrections.slices(nodes),
                });
            },
        );
        implicit.tile_sums.iter().map(|partial| partial.product).sum()
    }

    /// Minimizes until the equation holds to the requested accuracy or the budget is used up. Returns true if all
    /// values are finite.
    pub(super) fn minimize(&self, body: &mut System, implicit: &mut Implicit) -> bool {
        let total_inertia = implicit.total_inertia;
        let roundoff = implicit.roundoff(body.extent());
        // The displacement errors of n equations also enter the velocity and grow as n² by the end of the step.
        let fraction = self.end - self.start;
        let tolerated = 0.1 * f64::from(self.request.tolerance) * fraction * fraction;
        let absolute = tolerated.powi(2) * total_inertia;
        let relative = f64::from(implicit.accuracy).powi(2);
        let mut whole_budget = self.budget(implicit);
        let mut extra = EXTRA_BUDGETS.map(|budgets| (budgets * whole_budget).min(MAX_EXTRA_PRODUCTS));
        // A caller that bounds the work of a step gets no extra products.
        if !self.is_long() || implicit.work_limit < u32::MAX {
            extra = [0; 2];
        }
        let mut products = 0;
        let mut previous_norm_sq = 0.0;
        let mut error = f64::INFINITY;
        let mut is_solved = false;
        let held = body.held_axes();
        let is_held = held.all();
        self.update_positions(body, implicit);
        self.residual(body, implicit);
        let (mut step_fraction, mut stagnant_count, mut solved_error, mut is_small) = (0.0, 0, 0.0_f64, false);
        let mut residual_sq = 0.0;
        let has_holds = body
            .contacts
            .as_deref()
            .is_some_and(|contacts| !contacts.multipliers.is_empty());
        for iteration in 0..MAX_NEWTON_ITERATIONS {
            self.add_contact_stiffness(body, implicit);
            let active_set_changed = body
                .contacts
                .as_mut()
                .is_some_and(|contacts| contacts.multipliers.active_set_changed());
            implicit.corrections.clear();
            residual_sq = implicit.precondition(body, 0.0, self.team).product;
            // The part of the residual that a solve leaves is due to rounding.
            let rounding = if has_holds || is_small { 1.0 } else { FORCE_ROUNDOFF } * roundoff.residual_sq;
            if residual_sq <= REFINE_LIMIT * roundoff.residual_sq && (step_fraction < 1.0 || residual_sq > rounding) {
                self.refine_residual(body, implicit);
                residual_sq = implicit.precondition(body, 0.0, self.team).product;
            }
            if step_fraction >= 1.0 && residual_sq <= rounding {
                error = solved_error.max(roundoff.error);
                is_solved = true;
                break;
            }
            implicit.ritz.begin();
            let remaining = residual_sq * implicit.ritz.factor();
            // Full steps cannot reduce rounding. A residual far above rounding is slow because of nonlinearity.
            let is_stagnant = step_fraction >= 1.0
                && remaining > 0.5 * error
                && residual_sq <= STAGNATION_LIMIT * roundoff.residual_sq;
            stagnant_count = if is_stagnant { stagnant_count + 1 } else { 0 };
            let is_stuck = stagnant_count > 2;
            error = remaining;
            for (extra, tolerance) in extra.iter_mut().zip(CONTACT_TOLERANCES) {
                if products >= whole_budget && !self.is_balanced(body, implicit, tolerance) {
                    whole_budget += std::mem::take(extra);
                }
            }
            let budget = whole_budget - products.min(whole_budget);
            // A rigid motion may cost less than rounding of stiff springs, so one solve is always tried.
            let has_tried = iteration > 0 || residual_sq == 0.0;
            let is_accurate = has_tried
                && error <= absolute.max(relative * previous_norm_sq)
                && self.is_balanced(body, implicit, CONTACT_TOLERANCES[0]);
            is_solved = is_accurate || is_stuck;
            if is_solved || budget == 0 || !error.is_finite() {
                break;
            }
            let goal = SolveGoal {
                budget,
                absolute,
                relative,
                previous_norm_sq,
                self_relative: if active_set_changed {
                    ACTIVE_SET_TOLERANCE.powi(2)
                } else {
                    0.0
                },
            };
            let positions = body.state.next_positions();
            let solved = implicit.solve(body, positions, self.tangent(), goal, residual_sq, self.team);
            implicit.report.solves += 1;
            products += solved.products;
            if implicit.stiffened_nodes.is_empty() {
                implicit.record_products(solved.products);
            }
            solved_error = solved.error;
            if let Some(contacts) = &mut body.contacts {
                contacts.multipliers.forbid_tension();
            }
            // If the correction is below rounding, its residual is not computed. Bodies that nothing holds are
            // excluded: they must keep their momentum.
            is_small = solved.norm_sq <= f64::max(absolute, roundoff.error)
                && solved.error <= absolute.max(relative * f64::max(previous_norm_sq, solved.norm_sq));
            if is_small && is_held && implicit.stiffened_nodes.is_empty() {
                add(
                    &mut implicit.force_displacements,
                    &implicit.corrections,
                    1.0,
                    body.kernel,
                    self.team,
                );
                self.update_positions(body, implicit);
                error = solved.error;
                is_solved = true;
                break;
            }
            step_fraction = self.line_search(body, implicit, solved.work);
            previous_norm_sq = f64::max(previous_norm_sq, step_fraction * step_fraction * solved.norm_sq);
            let displacement = |node: usize| implicit.force_displacements.get(node).as_dvec3();
            // Before a full step, contact forces are not final, and their error would grow with each multiplier update.
            if iteration < MAX_MULTIPLIER_UPDATES
                && step_fraction == 1.0
                && let Some(contacts) = &mut body.contacts
                && contacts.multipliers.multiplier_error(displacement) > f64::from(implicit.accuracy)
            {
                let (residuals, free) = (&mut implicit.residuals, &body.inverse_masses);
                contacts.multipliers.update_multipliers(displacement, |node, change| {
                    if free[node] > 0.0 {
                        residuals.set(node, residuals.get(node) + change.as_vec3());
                    }
                });
                for pin in body.pins.partial() {
                    pin.set_held(residuals, Vec3::ZERO);
                }
            }
            if step_fraction == 1.0
                && solved.norm_sq.max(solved.error) <= relative * previous_norm_sq
                && self.is_balanced(body, implicit, CONTACT_TOLERANCES[0])
            {
                error = solved.error;
                is_solved = true;
                break;
            }
        }
        implicit.remove_contact_stiffness();
        if let Some(contacts) = &mut body.contacts {
            contacts.multipliers.forbid_tension();
        }
        let is_touched = body
            .contacts
            .as_ref()
            .is_some_and(|contacts| contacts.multipliers.has_active());
        if !is_held && !is_touched {
            implicit.balance_residual(body.state.next_positions(), held);
            self.update_positions(body, implicit);
        }
        implicit.report.iterations += products;
        implicit.budget_left = implicit.budget_left.saturating_sub(products);
        implicit.report.has_converged &= is_solved;
        self.bound_tool_forces(body, implicit, error);
        let error = (error / total_inertia).sqrt() as f32;
        implicit.report.error = implicit.report.error.max(error);
        residual_sq.is_finite()
    }

    /// Corrects the residual for the rounding of positions.
    fn refine_residual(&self, body: &System, implicit: &mut Implicit) {
        self.find_position_defects(body, implicit);
        // A rounding error has no velocity.
        let tangent = Tangent {
            rate: 0.0,
            ..self.tangent()
        };
        implicit.multiply(body, body.state.next_positions(), tangent, None, self.team);
        let node_count = body.node_count();
        let (inertia, search_directions, products) =
            (&implicit.inertia, &implicit.search_directions, &implicit.products);
        let written = implicit.residuals.tiles_mut();
        self.team.pass(tile_count(node_count), written, |tile, mut residuals| {
            let nodes = tile_nodes(tile, node_count);
            body.kernel.run(CorrectResidual {
                inertia: &inertia[nodes.clone()],
                displacements: search_directions.slices(nodes.clone()),
                products: products.slices(nodes),
                residuals: &mut residuals,
            });
        });
    }

    /// Moves along the correction, shortened until forces no longer oppose it strongly. Returns the fraction of the
    /// correction.
    fn line_search(&self, body: &mut System, implicit: &mut Implicit, work: f64) -> f64 {
        let mut step_fraction = 1.0;
        add(
            &mut implicit.force_displacements,
            &implicit.corrections,
            1.0,
            body.kernel,
            self.team,
        );
        for _ in 0..12 {
            self.update_positions(body, implicit);
            let slope = self.residual(body, implicit);
            if slope >= -0.5 * work {
                return step_fraction;
            }
            // Zero of the slope if it is linear; a much shorter step if the slope is not finite.
            let fraction = if slope.is_finite() { work / (work - slope) } else { 0.1 };
            let next = step_fraction * f64::clamp(fraction, 0.1, 0.7);
            add(
                &mut implicit.force_displacements,
                &implicit.corrections,
                (next - step_fraction) as f32,
                body.kernel,
                self.team,
            );
            step_fraction = next;
        }
        self.update_positions(body, implicit);
        self.residual(body, implicit);
        step_fraction
    }
}

/// Stores the reaction of each pin of a tile to these forces.
pub(super) fn store_pin_reactions(pins: &mut [Pin], forces: &TileForces, gravity: Vec3, masses: &[f32]) {
    for pin in pins {
        let node = pin.node as usize;
        pin.reaction = -(forces.get(node % TILE) + gravity * masses[node]);
    }
}

/// Adds `factor * from` to `to`.
fn add(to: &mut Vectors, from: &Vectors, factor: f32, kernel: ChosenKernel, team: &Team) {
    let node_count = from.len();
    team.pass(tile_count(node_count), to.tiles_mut(), |tile, to| {
        let from = from.slices(tile_nodes(tile, node_count));
        kernel.run(AddScaled { factor, from, to });
    });
}
