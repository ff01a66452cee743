//! Where a body is at rest: the nearest place downhill where its potential energy is smallest.

use glam::{BVec3, DVec3, Vec3};

use super::descent::{Descent, DescentReport, Goal};
use crate::base::{Error, Result, ensure, memory};
use crate::solver::System;

/// Linearised equations solved at most.
const ITERATIONS: u32 = 10_000;

/// Products where the definition does not say.
const BUDGET: u32 = 1_000_000;

/// How near the state of rest must be, as a part of the body's extent, where the definition does not say.
const TOLERANCE: f64 = 1e-6;

/// A part's forces that leave less than this part of themselves cancel.
const CANCELS: f64 = 1e-5;

/// Places where the function is level without being lowest that are left at most.
const SADDLES: u32 = 50;

/// How a state of rest is looked for; see [`World::rest_state`](crate::World::rest_state).
///
/// ```
/// # use glam::vec3;
#[doc = include_str!("../../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&block)?;
/// # world.body_mut(body)?.pin_box(vec3(-1.0, 0.019, -1.0), vec3(1.0, 1.0, 1.0))?;
/// // The block hangs from its upper side.
/// let report = world.rest_state(body, &RestStateDefinition { tolerance: 1e-6, ..RestStateDefinition::default() })?;
/// assert!(report.error <= 1e-6);
/// assert!(world.body(body)?.bounds()[0].y < -0.02);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RestStateDefinition {
    /// How far a node may be from where it is at rest, as far as that can be told, m; 0: a millionth of the body's extent.
    pub tolerance: f32,
    /// The most products with the matrix of second derivatives; 0: a million.
    pub iterations: u32,
}

/// How a state of rest was found.
///
/// ```
/// # use glam::vec3;
#[doc = include_str!("../../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&block)?;
/// # world.body_mut(body)?.pin_box(vec3(-1.0, 0.019, -1.0), vec3(1.0, 1.0, 1.0))?;
/// let report = world.rest_state(body, &RestStateDefinition::default())?;
/// assert!(report.energy_after < report.energy_before);
/// assert!(report.iterations > 0 && report.residual < 1e-3);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RestStateReport {
    /// Linearised equations that were solved.
    pub iterations: u32,
    /// Products with their matrices.
    pub products: u32,
    /// The largest force left on a node, without what pins take, before positions were rounded to `f32`, N.
    pub residual: f64,
    /// How far a node may be from where it is at rest, before positions were rounded to `f32`, m.
    pub error: f64,
    /// Of springs, gravity and forces, J, zero at the origin, before and after.
    pub energy_before: f64,
    /// After.
    pub energy_after: f64,
}

/// Moves `body` to rest.
pub(crate) fn rest_state(
    body: &mut System,
    gravity: Vec3,
    definition: &RestStateDefinition,
) -> Result<RestStateReport> {
    // At rest nothing that is viscous holds anything.
    body.forces.release(body.state.positions());
    let mut descent = Descent::new(&body.forces)?;
    descent.network.beside = std::mem::take(&mut body.forces.beside);
    descent.equation.pins = std::mem::take(&mut body.pins);
    let found = find(&mut descent, body, gravity, definition);
    body.forces.beside = std::mem::take(&mut descent.network.beside);
    body.pins = std::mem::take(&mut descent.equation.pins);
    if found.is_err() {
        body.forces.recall();
    }
    let report = found?;
    if body.forces.yield_at(|node| descent.equation.position(node)) {
        body.forces.recall();
        return Err(Error::NotConverged(
            "tetrahedra would yield in the state of rest that was found: it is not one".into(),
        ));
    }
    let held = |node: usize| -descent.residuals[node].as_vec3();
    body.rest_at(|node| descent.equation.position(node).as_vec3(), held);
    Ok(report)
}

/// Finds where `body` is at rest.
fn find(
    descent: &mut Descent,
    body: &System,
    gravity: Vec3,
    definition: &RestStateDefinition,
) -> Result<RestStateReport> {
    ensure!(
        definition.tolerance >= 0.0 && definition.tolerance.is_finite(),
        "tolerance is {}: must be at least 0 and finite",
        definition.tolerance
    );
    set_up(descent, body, gravity);
    let parts = Parts::new(descent)?;
    parts.balance(descent, body)?;
    let origin = body.origin;
    let energy_before = descent.equation.potential(&descent.network, origin);
    let extent = extent(descent);
    let tolerance = match definition.tolerance {
        0.0 => TOLERANCE * extent,
        given => f64::from(given),
    };
    let budget = match definition.iterations {
        0 => BUDGET,
        given => given,
    };
    let found = settle(descent, tolerance, extent, budget);
    if !found.converged {
        return Err(Error::NotConverged(format!(
            "no state of rest was found with {} products, of {budget} allowed: the last correction was {:e} m long, {tolerance:e} m \
             are asked for",
            found.products, found.error
        )));
    }
    descent.weigh();
    let energy_after = descent.equation.potential(&descent.network, origin);
    let equation = &descent.equation;
    let free = |node: usize| equation.free_part(node, descent.residuals[node]).length();
    let residual = (0..body.node_count()).map(free).fold(0.0, f64::max);
    if !(0..body.node_count()).all(|node| equation.position(node).as_vec3().length_squared().is_finite()) {
        return Err(Error::NotConverged("the state of rest is too far away for f32".into()));
    }
    Ok(RestStateReport {
        iterations: found.iterations,
        products: found.products,
        residual,
        error: found.error,
        energy_before,
        energy_after,
    })
}

fn set_up(descent: &mut Descent, body: &System, gravity: Vec3) {
    let equation = &mut descent.equation;
    let applied = body.applied.as_ref().filter(|_| body.forces_applied);
    for node in 0..body.node_count() {
        let mass = f64::from(body.masses[node]);
        equation.anchors[node] = body.state.positions().get(node).as_dvec3();
        equation.loads[node] = gravity.as_dvec3() * mass;
        if body.inverse_masses[node] > 0.0 {
            equation.masses[node] = mass;
            if let Some(applied) = applied {
                equation.loads[node] += applied.get(node).as_dvec3();
            }
        }
    }
}

/// How far the body reaches, where it lies in one place at least as far as its longest spring would, and where springs have no
/// length as far as what its nodes carry stretches one, m.
fn extent(descent: &Descent) -> f64 {
    let springs = || descent.network.springs();
    let lengths = springs().map(|(_, _, link)| f64::from(link.rest_length));
    let extent = lengths.fold(descent.equation.extent(), f64::max);
    if extent > 0.0 {
        return extent;
    }
    let load = |node: usize| descent.equation.loads[node].length();
    springs()
        .filter(|(_, _, link)| link.stiffness > 0.0)
        .map(|(_, node, link)| load(node).max(load(link.neighbour as usize)) / f64::from(link.stiffness))
        .fold(0.0, f64::max)
}

/// Goes down, and on from where it is level without being lowest.
fn settle(descent: &mut Descent, tolerance: f64, extent: f64, budget: u32) -> DescentReport {
    descent.weigh();
    let equation = &descent.equation;
    let free = (0..descent.residuals.len()).filter(|&node| equation.is_free(node));
    let fastest = free
        .map(|node| equation.free_part(node, descent.residuals[node]).length() / equation.masses[node])
        .fold(0.0, f64::max);
    // A body that falls freely goes as far as it is long in such a time: nodes are held back by so much at first.
    let mut shift = fastest / extent;
    if !(shift > 0.0 && shift.is_finite()) {
        shift = 1.0;
    }
    let mut found = DescentReport::default();
    for _ in 0..SADDLES {
        let part = descent.run(&Goal {
            absolute: tolerance,
            relative: 0.0,
            rounding: 1e-9 * extent,
            iterations: ITERATIONS,
            budget: budget.saturating_sub(found.products),
            shift,
            least_shift: 1e-10 * shift,
            next_shift: shift,
        });
        found = DescentReport {
            iterations: found.iterations + part.iterations,
            products: found.products + part.products,
            ..part
        };
        let left = budget.saturating_sub(found.products);
        if !found.converged || !descent.leave_saddle(1e-8 * shift, 0.01 * extent, &mut found, left) {
            return found;
        }
        found.converged = false;
    }
    found
}

/// The parts of a body that springs and elements hold together: for each node the lowest node of its part.
struct Parts {
    lowest: Vec<u32>,
}

impl Parts {
    fn new(descent: &Descent) -> Result<Self> {
        let node_count = descent.network.node_count();
        let lowest = memory::collected(0..node_count as u32)?;
        let mut parts = Self { lowest };
        for (_, node, link) in descent.network.springs() {
            if link.stiffness > 0.0 {
                let [a, b] = [node as u32, link.neighbour].map(|end| parts.find(end));
                parts.lowest[a.max(b) as usize] = a.min(b);
            }
        }
        for tetrahedron in descent.network.tetrahedra().map(|element| element.of) {
            let [first, others @ ..] = tetrahedron.corners;
            for other in others {
                let [a, b] = [first as u32, other as u32].map(|end| parts.find(end));
                parts.lowest[a.max(b) as usize] = a.min(b);
            }
        }
        descent.network.beside.show_nodes(&mut |nodes, are_joined| {
            for &other in nodes[1..].iter().filter(|_| are_joined) {
                let [a, b] = [nodes[0], other].map(|end| parts.find(end));
                parts.lowest[a.max(b) as usize] = a.min(b);
            }
        });
        for node in 0..node_count as u32 {
            parts.lowest[node as usize] = parts.find(node);
        }
        Ok(parts)
    }

    fn find(&mut self, mut node: u32) -> u32 {
        while self.lowest[node as usize] != node {
            let above = self.lowest[node as usize];
            self.lowest[node as usize] = self.lowest[above as usize];
            node = above;
        }
        node
    }

    /// Refuses a part that nothing holds against the forces on it, along any axis. Where they cancel but for rounding, the rest is taken
    /// off them, by mass: it would carry the part away.
    fn balance(&self, descent: &mut Descent, body: &System) -> Result<()> {
        #[derive(Clone, Copy, Default)]
        struct PieceSums {
            load: DVec3,
            size: f64,
            mass: f64,
            held: BVec3,
        }
        let equation = &mut descent.equation;
        let mut sums = memory::filled(PieceSums::default(), self.lowest.len())?;
        for (node, &part) in self.lowest.iter().enumerate() {
            let sums = &mut sums[part as usize];
            sums.load += equation.loads[node];
            sums.size += equation.loads[node].length();
            sums.mass += equation.masses[node];
            let is_held = !equation.is_free(node) || descent.network.beside.holds(node);
            sums.held |= BVec3::splat(is_held) | equation.pins.partial_axes_of(node as u32);
        }
        for (node, &part) in self.lowest.iter().enumerate() {
            let PieceSums { load, size, mass, held } = sums[part as usize];
            if held.all() {
                continue;
            }
            let load = DVec3::select(held, DVec3::ZERO, load);
            ensure!(
                load.length() <= CANCELS * size,
                "there is no state of rest: nothing holds node {} and what it is joined to against {:e} N",
                body.callers(part as usize),
                load.length()
            );
            equation.loads[node] -= load * (equation.masses[node] / mass);
        }
        Ok(())
    }
}
