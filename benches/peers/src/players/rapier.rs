//! Rapier's soft bodies: constraints, and its finite elements where they are built in.

use std::f32::consts::TAU;

use rapier3d::dynamics::SoftBodySolver;
use rapier3d::prelude::*;

use super::serve::{Player, Settings};
use super::{Engine, Line};
use crate::precision::law::Law;
use crate::precision::model::{Ball, FRAME, Model, SKIN};
use crate::scenes::Scene;

pub fn engine() -> Engine {
    Engine {
        name: "Rapier",
        color: "#b5541c",
        program: || super::built_in("rapier"),
        lines: |scene| Ok(lines(scene)),
        notes: "Rapier 0.36 in single precision, `fem` built in. `substeps` are its solver iterations of one step per frame. \
                Constraints: 4 sweeps by default, and 32. A spring is a constraint with its frequency for the masses at its ends. \
                FEM: at most 20 iterations of its linear solver by default, and 500. \
                Its corotational cells are omitted, since they preserve volume by a separate constraint.",
    }
}

fn lines(scene: &Scene) -> Vec<Line> {
    if scene.model.has(Law::Springs) {
        return vec![
            Line::doubling("constraints", Law::Springs, &[], 1, 4096),
            Line::doubling("constraints, 32 sweeps", Law::Springs, &["sweeps=32"], 1, 4096),
            Line::doubling("FEM", Law::Springs, &["solver=fem"], 1, 4096),
        ];
    }
    let neo = Law::PlainNeoHookean;
    vec![
        Line::doubling("constraints, neo-Hookean", neo, &[], 1, 4096),
        Line::doubling("constraints, neo-Hookean, 32 sweeps", neo, &["sweeps=32"], 1, 4096),
        Line::doubling("FEM, neo-Hookean", neo, &["solver=fem"], 1, 4096),
        Line::doubling(
            "FEM, neo-Hookean, 500 iterations",
            neo,
            &["solver=fem", "iterations=500"],
            1,
            4096,
        ),
    ]
}

pub struct RapierPlayer {
    world: PhysicsWorld,
    bodies: Vec<SoftBodyHandle>,
    /// Number of nodes per body.
    size: usize,
    ball: Option<(RigidBodyHandle, Ball)>,
    passed: usize,
    frames: usize,
}

fn vector(components: [f64; 3]) -> Vector {
    Vector::from(components.map(|x| x as f32))
}

impl Player for RapierPlayer {
    fn build(model: &Model, settings: &Settings) -> Result<Self, String> {
        let mut world = PhysicsWorld::new();
        world.configure_thread_pool(1).map_err(|error| error.to_string())?;
        world.gravity = Vector::new(0.0, -model.gravity as f32, 0.0);
        let parameters = &mut world.integration_parameters;
        parameters.dt = FRAME as f32;
        parameters.num_solver_iterations = settings.number("substeps").unwrap_or(4.0) as usize;
        if !model.has_contact() {
            // Rapier's measures against fast and far stretched bodies would hide the effect of the settings.
            parameters.soft_bodies.max_extra_substeps = 0;
            parameters.soft_bodies.resweep_strain = f32::MAX;
        }
        if let Some(iterations) = settings.number("iterations") {
            parameters.soft_bodies.fem.max_linear_iterations = iterations as usize;
        }
        let friction = model.friction as f32;
        let mut ball = None;
        if let Some(definition) = model.ball {
            let shape = ColliderBuilder::ball(definition.radius as f32).friction(friction);
            let body = RigidBodyBuilder::kinematic_position_based().translation(vector(definition.center));
            ball = Some((world.insert(body, shape).0, definition));
        }
        if model.has_floor {
            let ground = ColliderBuilder::cuboid(10.0, 1.0, 10.0).friction(friction);
            world.insert(
                RigidBodyBuilder::fixed().translation(Vector::new(0.0, -1.0, 0.0)),
                ground,
            );
        }
        let bodies =
            (0..model.body_count()).map(|index| world.insert_soft_body(soft_body(&model.body(index), settings)));
        Ok(Self {
            bodies: bodies.collect(),
            size: model.positions.len() / model.body_count(),
            world,
            ball,
            passed: 0,
            frames: model.frames,
        })
    }

    fn version() -> String {
        format!("rapier3d {}", rapier3d::VERSION)
    }

    fn frame(&mut self) -> Result<(), String> {
        self.passed += 1;
        if let Some((body, ball)) = &self.ball {
            let body = self.world.bodies.get_mut(*body).expect("still there");
            body.set_next_kinematic_translation(vector(ball.center_after(self.passed, self.frames)));
        }
        self.world.step();
        Ok(())
    }

    fn position(&self, node: usize) -> [f32; 3] {
        let body = self
            .world
            .soft_bodies
            .get(self.bodies[node / self.size])
            .expect("still there");
        body.particle_position(node % self.size).into()
    }
}

fn soft_body(model: &Model, settings: &Settings) -> SoftBodyBuilder {
    let mut builder = SoftBodyBuilder::new(model.positions.iter().copied().map(vector).collect())
        .masses(model.masses.iter().map(|&mass| mass as f32).collect())
        .pinned_particles(model.pinned.iter().map(|&node| node as u32))
        .linear_damping(model.damping as f32)
        .can_sleep(false);
    builder = if model.has_contact() {
        let triangles = model.triangles.iter().map(|corners| corners.map(|node| node as u32));
        let surface = builder.surface(triangles.collect()).particle_radius(SKIN as f32);
        surface.surface_collider(ColliderBuilder::default().friction(model.friction as f32))
    } else {
        builder.no_surface_collider()
    };
    if let Some(sweeps) = settings.number("sweeps") {
        builder = builder.additional_pgs_iterations(sweeps as usize - 1);
    }
    if settings.word("solver") == Some("fem") {
        builder = builder.solver(SoftBodySolver::Fem);
    }
    match model.tetrahedra.is_empty() {
        true => with_springs(builder, model),
        false => with_cells(builder, model),
    }
}

/// A spring is an undamped implicit one, set by a frequency for the masses at its ends: half a node's mass, or a whole
/// one if the other end is pinned.
fn with_springs(builder: SoftBodyBuilder, model: &Model) -> SoftBodyBuilder {
    let mass = model.masses[0];
    let softness = |mass: f64| SpringCoefficients::new((model.stiffness / mass).sqrt() as f32 / TAU, 0.0);
    let is_at_a_pin = |ends: &[usize; 2]| ends.iter().any(|node| model.pinned.contains(node));
    let at_a_pin = model.springs.iter().enumerate().filter(|(_, ends)| is_at_a_pin(ends));
    let edge_softness = at_a_pin.map(|(edge, _)| (edge as u32, softness(mass))).collect();
    let mut builder = builder
        .edges(model.springs.iter().map(|ends| ends.map(|node| node as u32)).collect())
        .softness(softness(mass / 2.0));
    builder.edge_softness = edge_softness;
    builder
}

fn with_cells(builder: SoftBodyBuilder, model: &Model) -> SoftBodyBuilder {
    builder
        .cells(
            model
                .tetrahedra
                .iter()
                .map(|corners| corners.map(|node| node as u32))
                .collect(),
        )
        .cell_model(SoftBodyCellModel::NeoHookean)
        .material(SoftBodyMaterial {
            young_modulus: model.young as f32,
            poisson_ratio: model.poisson as f32,
            elastic_damping_ratio: 0.0,
            ..SoftBodyMaterial::default()
        })
}
