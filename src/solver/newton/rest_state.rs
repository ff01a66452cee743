//! Static equilibrium: a local minimum of the potential energy.

use glam::{BVec3, DVec3, Vec3};

use super::descent::{Descent, DescentGoal, DescentReport};
use crate::base::{Error, Result, ensure, memory};
use crate::solver::System;

/// Maximum number of linear solves.
const ITERATIONS: u32 = 10_000;

/// Default budget of products.
const BUDGET: u32 = 1_000_000;

/// Default tolerance, as a fraction of the body's extent.
const TOLERANCE: f64 = 1e-6;

/// Loads of a component balance if their sum is below this fraction of their magnitudes.
const BALANCE_TOLERANCE: f64 = 1e-5;

/// Maximum number of saddle points to leave.
const MAX_SADDLES: u32 = 50;

/// Parameters of the search for static equilibrium; see [`World::rest_state`](crate::World::rest_state).
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
    /// Allowed error of a node's position, as far as it can be estimated, m; 0: a millionth of the body's extent.
    pub tolerance: f32,
    /// Maximum number of products with the matrix of second derivatives; 0: a million.
    pub iterations: u32,
}

/// Result of a search for static equilibrium.
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
    /// Number of linear solves.
    pub iterations: u32,
    /// Number of matrix-vector products.
    pub products: u32,
    /// Largest unbalanced force on a node, without pin reactions, before positions are rounded to `f32`, N.
    pub residual: f64,
    /// Estimated error of a node's position, before positions are rounded to `f32`, m.
    pub error: f64,
    /// Energy of springs, gravity and forces before the search, J. It is zero at the origin.
    pub energy_before: f64,
    /// The same energy after the search, J.
    pub energy_after: f64,
}

/// Moves `body` to static equilibrium.
pub(crate) fn rest_state(
    body: &mut System,
    gravity: Vec3,
    definition: &RestStateDefinition,
) -> Result<RestStateReport> {
    // Viscous forces vanish in equilibrium.
    body.forces.set_relaxed(body.state.positions());
    let mut descent = Descent::new(&body.forces)?;
    descent.sparsity.non_spring = std::mem::take(&mut body.forces.auxiliary);
    descent.equation.pins = std::mem::take(&mut body.pins);
    let report = solve_rest_state(&mut descent, body, gravity, definition);
    body.forces.auxiliary = std::mem::take(&mut descent.sparsity.non_spring);
    body.pins = std::mem::take(&mut descent.equation.pins);
    if report.is_err() {
        body.forces.restore();
    }
    let report = report?;
    if body.forces.would_yield(|node| descent.equation.position(node)) {
        body.forces.restore();
        return Err(Error::NotConverged(
            "tetrahedra would yield in the state of rest that was found: it is not one".into(),
        ));
    }
    let held = |node: usize| -descent.residuals[node].as_vec3();
    body.set_at_rest(|node| descent.equation.position(node).as_vec3(), held);
    Ok(report)
}

/// Computes the static equilibrium of `body`.
fn solve_rest_state(
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
    let components = ConnectedComponents::new(descent)?;
    components.balance_loads(descent, body)?;
    let origin = body.origin;
    let energy_before = descent.equation.potential(&descent.sparsity, origin);
    let extent = extent(descent);
    let tolerance = match definition.tolerance {
        0.0 => TOLERANCE * extent,
        given => f64::from(given),
    };
    let budget = match definition.iterations {
        0 => BUDGET,
        given => given,
    };
    let report = minimize(descent, tolerance, extent, budget);
    if !report.converged {
        return Err(Error::NotConverged(format!(
            "no state of rest was found with {} products, of {budget} allowed: the last correction was {:e} m long, {tolerance:e} m \
             are asked for",
            report.products, report.error
        )));
    }
    descent.update_residuals();
    let energy_after = descent.equation.potential(&descent.sparsity, origin);
    let equation = &descent.equation;
    let free = |node: usize| equation.free_part(node, descent.residuals[node]).length();
    let residual = (0..body.node_count()).map(free).fold(0.0, f64::max);
    if !(0..body.node_count()).all(|node| equation.position(node).as_vec3().length_squared().is_finite()) {
        return Err(Error::NotConverged("the state of rest is too far away for f32".into()));
    }
    Ok(RestStateReport {
        iterations: report.iterations,
        products: report.products,
        residual,
        error: report.error,
        energy_before,
        energy_after,
    })
}

fn set_up(descent: &mut Descent, body: &System, gravity: Vec3) {
    let equation = &mut descent.equation;
    let applied = body.applied.as_ref().filter(|_| body.forces_applied);
    for node in 0..body.node_count() {
        let mass = f64::from(body.masses[node]);
        equation.predicted_positions[node] = body.state.positions().get(node).as_dvec3();
        equation.loads[node] = gravity.as_dvec3() * mass;
        if body.inverse_masses[node] > 0.0 {
            equation.masses[node] = mass;
            if let Some(applied) = applied {
                equation.loads[node] += applied.get(node).as_dvec3();
            }
        }
    }
}

/// Length scale of the body, m: its extent, or the rest length of its longest spring if that is larger. If both are 0,
/// it is the elongation of a spring under its nodes' loads.
fn extent(descent: &Descent) -> f64 {
    let springs = || descent.sparsity.springs();
    let lengths = springs().map(|(_, _, link)| f64::from(link.rest_length));
    let extent = lengths.fold(descent.equation.extent(), f64::max);
    if extent > 0.0 {
        return extent;
    }
    let load = |node: usize| descent.equation.loads[node].length();
    springs()
        .filter(|(_, _, link)| link.stiffness > 0.0)
        .map(|(_, node, link)| load(node).max(load(link.neighbor as usize)) / f64::from(link.stiffness))
        .fold(0.0, f64::max)
}

/// Minimizes the energy, and continues from saddle points.
fn minimize(descent: &mut Descent, tolerance: f64, extent: f64, budget: u32) -> DescentReport {
    descent.update_residuals();
    let equation = &descent.equation;
    let free = (0..descent.residuals.len()).filter(|&node| equation.is_free(node));
    let fastest = free
        .map(|node| equation.free_part(node, descent.residuals[node]).length() / equation.masses[node])
        .fold(0.0, f64::max);
    // In free fall, the body moves by its own extent in this time. The initial shift restrains nodes accordingly.
    let mut shift = fastest / extent;
    if !(shift > 0.0 && shift.is_finite()) {
        shift = 1.0;
    }
    let mut report = DescentReport::default();
    for _ in 0..MAX_SADDLES {
        let run = descent.run(&DescentGoal {
            absolute: tolerance,
            relative: 0.0,
            rounding: 1e-9 * extent,
            iterations: ITERATIONS,
            budget: budget.saturating_sub(report.products),
            shift,
            least_shift: 1e-10 * shift,
            next_shift: shift,
        });
        report = DescentReport {
            iterations: report.iterations + run.iterations,
            products: report.products + run.products,
            ..run
        };
        let remaining = budget.saturating_sub(report.products);
        if !report.converged || !descent.leave_saddle(1e-8 * shift, 0.01 * extent, &mut report, remaining) {
            return report;
        }
        report.converged = false;
    }
    report
}

/// Connected components of a body: for each node the lowest node of its component.
struct ConnectedComponents {
    lowest: Vec<u32>,
}

impl ConnectedComponents {
    fn new(descent: &Descent) -> Result<Self> {
        let node_count = descent.sparsity.node_count();
        let lowest = memory::collected(0..node_count as u32)?;
        let mut components = Self { lowest };
        for (_, node, link) in descent.sparsity.springs() {
            if link.stiffness > 0.0 {
                let [a, b] = [node as u32, link.neighbor].map(|end| components.find_root(end));
                components.lowest[a.max(b) as usize] = a.min(b);
            }
        }
        for tetrahedron in descent.sparsity.tetrahedra().map(|element| element.of) {
            let [first, others @ ..] = tetrahedron.corners;
            for other in others {
                let [a, b] = [first as u32, other as u32].map(|end| components.find_root(end));
                components.lowest[a.max(b) as usize] = a.min(b);
            }
        }
        descent.sparsity.non_spring.visit_nodes(&mut |nodes, are_joined| {
            for &other in nodes[1..].iter().filter(|_| are_joined) {
                let [a, b] = [nodes[0], other].map(|end| components.find_root(end));
                components.lowest[a.max(b) as usize] = a.min(b);
            }
        });
        for node in 0..node_count as u32 {
            components.lowest[node as usize] = components.find_root(node);
        }
        Ok(components)
    }

    fn find_root(&mut self, mut node: u32) -> u32 {
        while self.lowest[node as usize] != node {
            let parent = self.lowest[node as usize];
            self.lowest[node as usize] = self.lowest[parent as usize];
            node = parent;
        }
        node
    }

    /// Fails if nothing holds a component against its loads, along any axis. Loads that balance up to rounding are
    /// corrected, in proportion to mass, because the rest would move the component away.
    fn balance_loads(&self, descent: &mut Descent, body: &System) -> Result<()> {
        #[derive(Clone, Copy, Default)]
        struct ComponentSums {
            load: DVec3,
            size: f64,
            mass: f64,
            held: BVec3,
        }
        let equation = &mut descent.equation;
        let mut sums = memory::filled(ComponentSums::default(), self.lowest.len())?;
        for (node, &component) in self.lowest.iter().enumerate() {
            let sums = &mut sums[component as usize];
            sums.load += equation.loads[node];
            sums.size += equation.loads[node].length();
            sums.mass += equation.masses[node];
            let is_held = !equation.is_free(node) || descent.sparsity.non_spring.holds(node);
            sums.held |= BVec3::splat(is_held) | equation.pins.partial_axes_of(node as u32);
        }
        for (node, &component) in self.lowest.iter().enumerate() {
            let ComponentSums { load, size, mass, held } = sums[component as usize];
            if held.all() {
                continue;
            }
            let load = DVec3::select(held, DVec3::ZERO, load);
            ensure!(
                load.length() <= BALANCE_TOLERANCE * size,
                "there is no state of rest: nothing holds node {} and what it is joined to against {:e} N",
                body.caller_index(component as usize),
                load.length()
            );
            equation.loads[node] -= load * (equation.masses[node] / mass);
        }
        Ok(())
    }
}
