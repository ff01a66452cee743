//! Extreme pins, forces, tools and cuts, as careless programs may apply them.

use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Pose, Shape, Solver, ToolDefinition, Values};

use super::ledger::State;
use super::ratios::{damp, hold_side};
use super::setup::{Outcome, Setup, at_most, fault};
use super::watched::{Watched, momentum};
use crate::support::bodies::{Parts, Random, largest_difference};

pub fn pin_let_go(setup: &Setup) -> Outcome {
    let mut parts = Parts::chain(6, Vec3::X * 0.02, 0.01, 50.0);
    damp(&mut parts, 40.0);
    parts.masses[0] = 0.0;
    let mut watched = Watched::new(setup, &parts, Vec3::ZERO)?;
    // To ten times its length, where it stays for a while.
    watched.pin(5);
    watched.move_pin(5, Vec3::new(1.0, 0.1, 0.0));
    watched.run(setup.step, setup.steps(0.01, 2, 1000))?;
    watched.unpin(5);
    if !watched.settle(setup.step, 2.0)? {
        return Ok(watched.figures());
    }
    // A chain of springs has no shape, only lengths.
    let state = watched.state();
    let stretch = state
        .positions
        .windows(2)
        .map(|pair| pair[0].distance(pair[1]) / 0.02 - 1.0);
    let error = stretch.map(f64::abs).fold(0.0, f64::max);
    at_most("strain left", error, 1e-4)?;
    let speed = state.velocities.iter().map(|v| v.length()).fold(0.0, f64::max);
    at_most("speed left, m/s", speed, 1e-4)?;
    Ok(format!("strain left {error:.1e}; {}", watched.figures()))
}

pub fn pin_jumps(setup: &Setup) -> Outcome {
    let mut parts = Parts::block([3, 3, 3], 0.05, 0.01, 100.0);
    hold_side(&mut parts);
    let node = parts.positions.len() - 1;
    let to = parts.positions[node] + Vec3::new(3.0, 4.0, 0.0);
    let mut watched = Watched::new(setup, &parts, Vec3::ZERO)?;
    watched.pin(node);
    watched.move_pin(node, to);
    watched.step(setup.step)?;
    if watched.body().positions()[node] != to {
        return fault("the pin is not at its target");
    }
    watched.run(setup.step, setup.steps(3.0, 5, setup.pick(200, 2000)))?;
    // Back at the same speed, then released.
    watched.move_pin(node, parts.positions[node]);
    watched.step(setup.step)?;
    watched.unpin(node);
    watched.run(setup.step, setup.steps(3.0, 5, setup.pick(200, 2000)))?;
    Ok(watched.figures())
}

pub fn pushed(setup: &Setup) -> Outcome {
    let mut parts = Parts::block([2, 2, 2], 0.05, 0.01, 100.0);
    hold_side(&mut parts);
    let node = parts.positions.len() - 1;
    let mut watched = Watched::new(setup, &parts, Vec3::ZERO)?;
    watched.push(node, Vec3::new(6e5, 8e5, 0.0));
    watched.run(setup.step, setup.steps(1.0, 5, setup.pick(100, 1000)))?;
    Ok(watched.figures())
}

/// A node without springs.
struct Flight {
    node: usize,
    /// Where it was released (m).
    position: DVec3,
    velocity: DVec3,
    /// When it was released (s), and after how many substeps.
    time: f64,
    substeps: f64,
}

impl Flight {
    /// Returns the expected position.
    fn at(&self, time: f64) -> DVec3 {
        self.position + self.velocity * (time - self.time)
    }
}

/// Returns the angular momentum of nodes about the origin, and the sum of its magnitudes (N m s).
fn angular_momentum(state: &State, masses: &[f32]) -> (DVec3, f64) {
    let nodes = state.positions.iter().zip(&state.velocities).zip(masses);
    nodes.fold((DVec3::ZERO, 0.0), |(sum, size), ((p, v), &mass)| {
        let momentum = *v * f64::from(mass);
        (sum + p.cross(momentum), size + p.length() * momentum.length())
    })
}

/// Springs are removed while the body tumbles, all springs of one node: the node flies straight on.
pub fn springs_removed(setup: &Setup) -> Outcome {
    let parts = Parts::block([3, 2, 2], 0.05, 0.01, 100.0);
    let mut random = Random::new(41);
    let mut watched = Watched::new(setup, &parts, Vec3::ZERO)?;
    let mut velocities: Vec<Vec3> = parts.positions.iter().map(|_| random.vector()).collect();
    let momenta = velocities.iter().zip(&parts.masses).map(|(v, &mass)| *v * mass);
    let mean = momenta.sum::<Vec3>() / parts.masses.iter().sum::<f32>();
    velocities.iter_mut().for_each(|velocity| *velocity -= mean);
    watched.change(|body| body.set_velocities(&velocities));
    let first = momentum(&watched.state(), &parts.masses).0;
    let mut flights: Vec<Flight> = Vec::new();
    let first_turning = angular_momentum(&watched.state(), &parts.masses).0;
    let lonely = 13;
    let has_lonely = |pair: &[u32; 2]| pair.contains(&lonely);
    let mut left = parts.springs.clone();
    let (mut lost, mut lost_turning) = (0.0_f64, 0.0_f64);
    let (mut time, mut substeps) = (0.0, 0.0);
    for round in 0..30 {
        let chosen = match left.iter().position(has_lonely) {
            Some(index) => index,
            None => random.below(left.len()),
        };
        watched.remove_spring(left.swap_remove(chosen));
        if round < 20 {
            // Not of the same node again: it is alone by now, or will be.
            watched.remove_spring(left.swap_remove(random.below(left.len())));
        }
        let state = watched.state();
        // Implicit formulas use the forces of the step before.
        let straight = if setup.solver == Solver::Verlet {
            parts.masses.len()
        } else {
            0
        };
        for node in 0..straight {
            let is_held = left.iter().any(|pair| pair.contains(&(node as u32)));
            if !is_held && flights.iter().all(|flight| flight.node != node) {
                flights.push(Flight {
                    node,
                    position: state.positions[node],
                    velocity: state.velocities[node],
                    time,
                    substeps,
                });
            }
        }
        for _ in 0..setup.steps(0.02, 1, 20) {
            substeps += f64::from(watched.step(setup.step)?.substeps.max(1));
            time += f64::from(setup.step);
        }
        let mut state = watched.state();
        let (sum, size) = momentum(&state, &parts.masses);
        lost = lost.max(sum.distance(first) / size);
        // A lone node is rounded alike in every substep, with all its momentum: the errors add up, and are checked
        // separately.
        for flight in &flights {
            let (straight, position) = (flight.at(time), &mut state.positions[flight.node]);
            let reach = position.length().max(flight.position.length());
            let rounded = (substeps - flight.substeps) * 2.0_f64.powi(-24) * reach;
            at_most("way off a straight flight, m", position.distance(straight), rounded)?;
            *position = straight;
        }
        let (sum, size) = angular_momentum(&state, &parts.masses);
        lost_turning = lost_turning.max(sum.distance(first_turning) / size);
    }
    // Each node's velocity and sum of forces are rounded in every substep, a random walk. The bound 2^-23 sqrt(n) is
    // four times the walk of 2e-7 of a node's momentum in 36 nodes.
    let same = (2.0_f64.powi(-23) * substeps.sqrt()).max(1e-6);
    at_most("momentum lost over that of the parts", lost, same)?;
    at_most("angular momentum lost over that of the parts", lost_turning, same)?;
    let mut expected: Vec<[u32; 2]> = left.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
    let mut pairs = watched.body().spring_pairs().expect("memory");
    expected.sort_unstable();
    pairs.sort_unstable();
    if pairs != expected {
        return fault("the springs are not the expected ones");
    }

    // The remainder moves like a body that never had those springs.
    let mut other = parts.clone();
    let keep: Vec<bool> = parts.springs.iter().map(|pair| left.contains(pair)).collect();
    let mut kept = keep.iter();
    other.springs.retain(|_| *kept.next().expect("a spring"));
    let mut kept = keep.iter();
    other.stiffnesses.retain(|_| *kept.next().expect("a spring"));
    let mut kept = keep.iter();
    other.rest_lengths.retain(|_| *kept.next().expect("a spring"));
    let mut fresh = Watched::new(setup, &other, Vec3::ZERO)?;
    let (positions, velocities) = (
        watched.body().positions().to_vec(),
        watched.body().velocities().to_vec(),
    );
    for body in [&mut fresh, &mut watched] {
        body.change(|body| body.set_positions(&positions));
        body.change(|body| body.set_velocities(&velocities));
        body.step(setup.step.min(1e-3))?;
    }
    let reach = positions.iter().map(|p| p.length()).fold(0.0, f32::max);
    let difference = largest_difference(&fresh.state().positions, &watched.state().positions);
    at_most(
        "difference from a body without them over its reach",
        difference / f64::from(reach),
        1e-6,
    )?;
    Ok(format!("momentum {lost:.1e}, angular {lost_turning:.1e}"))
}

/// Returns the RMS strain of the edges, and the number of inverted tetrahedra.
fn recovery(mesh: &Mesh, positions: &[DVec3]) -> (f64, usize) {
    let edges = mesh.edges().expect("edges");
    let strain = |&[a, b]: &[u32; 2]| {
        let rest = mesh.positions[a as usize]
            .as_dvec3()
            .distance(mesh.positions[b as usize].as_dvec3());
        (positions[a as usize].distance(positions[b as usize]) / rest - 1.0).powi(2)
    };
    let rms = (edges.iter().map(strain).sum::<f64>() / edges.len() as f64).sqrt();
    let inverted = mesh.tetrahedra.iter().filter(|tetrahedron| {
        let [a, b, c, d] = tetrahedron.map(|node| positions[node as usize]);
        (b - a).cross(c - a).dot(d - a) <= 0.0
    });
    (rms, inverted.count())
}

pub fn crushed(setup: &Setup) -> Outcome {
    // Compressed to five sixths of its thickness it recovers; compressed further, springs alone may buckle or fold.
    let little = crush(setup, 0.05)?;
    let flat = crush(setup, 1e-4)?;
    if little.came_to_rest {
        at_most("RMS strain left after a little pressing", little.strain, 1e-3)?;
        at_most(
            "tetrahedra inverted after a little pressing",
            little.inverted as f64,
            0.0,
        )?;
    }
    Ok(format!(
        "RMS strain left {:.1e}; after 0.1 mm {:.1e} and {} inverted, most force {:.1e} N",
        little.strain, flat.strain, flat.inverted, flat.force
    ))
}

struct Crushed {
    /// True if it had time to come to rest.
    came_to_rest: bool,
    strain: f64,
    inverted: usize,
    force: f64,
}

/// Compresses a block between two planes that close to `gap`, stay, and retreat.
fn crush(setup: &Setup, gap: f32) -> Result<Crushed, super::setup::Stop> {
    const THICKNESS: f32 = 0.06;
    let mesh = Mesh::block([THICKNESS; 3], [4; 3]).expect("a block");
    let node_mass = 0.1 / mesh.positions.len() as f32;
    let definition = BodyDefinition {
        masses: Values::Uniform(node_mass),
        node_dampings: Values::Uniform(30.0 * node_mass),
        stiffnesses: Values::Uniform(100.0),
        ..BodyDefinition::of(&mesh)
    };
    let mut watched = Watched::of(setup, &definition, Vec3::ZERO)?.without_ledger();
    let half_turn = Quat::from_rotation_x(std::f32::consts::PI);
    let tools = [(-1.0, Quat::IDENTITY), (1.0, half_turn)].map(|(side, orientation)| {
        let tool = ToolDefinition {
            friction: 0.5,
            pose: Pose {
                position: Vec3::Y * side * (0.5 * THICKNESS + 5e-4),
                orientation,
            },
            ..ToolDefinition::new(Shape::Plane)
        };
        (side, watched.change_worlds(|world| world.create_tool(&tool)))
    });
    let steps = setup.steps(0.1, 1, setup.pick(150, 2000));
    let mut most = 0.0_f64;
    let mut thinnest = f32::INFINITY;
    let mut worked = 0.0;
    let mut distance = THICKNESS + 1e-3;
    for step in 1..=3 * steps {
        let part = step.min(steps) as f32 / steps as f32;
        let next = if step <= 2 * steps {
            THICKNESS + 1e-3 - (THICKNESS + 1e-3 - gap) * part
        } else {
            10.0 * THICKNESS
        };
        for (side, tool) in tools {
            watched.change_worlds(|world| world.set_pose(tool, Vec3::Y * side * 0.5 * next, None));
        }
        watched.step(setup.step)?;
        for (side, tool) in tools {
            let (force, torque) = watched.world().wrench(tool).expect("a tool");
            if !(force.is_finite() && torque.is_finite()) {
                return fault(format!("a plane feels {force} N, {torque} N m"));
            }
            most = most.max(f64::from(force.length()));
            worked -= f64::from(force.y * side * 0.5 * (next - distance));
        }
        distance = next;
        let heights = || watched.body().positions().iter().map(|p| p.y);
        let thickness = heights().fold(f32::MIN, f32::max) - heights().fold(f32::MAX, f32::min);
        thinnest = thinnest.min(thickness);
        at_most("thickness over the gap", f64::from(thickness / next), 1.0 + 1e-3)?;
        // Contact and friction only dissipate: the planes did the work. The bound is exact where the force is constant
        // over the step, else it includes the shadow energy at 0.8 of the limit.
        let state = watched.state();
        at_most(
            "energy, J",
            state.kinetic + state.elastic,
            1e-6 + worked / (1.0 - 0.8 * 0.8),
        )?;
    }
    if thinnest <= 0.0 {
        return fault("compressed to zero thickness");
    }
    let came_to_rest = watched.settle(setup.step, 2.0)?;
    let (strain, inverted) = recovery(&mesh, &watched.state().positions);
    Ok(Crushed {
        came_to_rest,
        strain,
        inverted,
        force: most,
    })
}
