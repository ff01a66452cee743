//! Rapier's soft bodies: constraints, and its finite elements where they are built in.

use std::f32::consts::TAU;

use rapier3d::dynamics::SoftBodySolver;
use rapier3d::prelude::*;

use super::serve::{Player, Settings};
use super::{Engine, Line};
use crate::precision::law::Law;
use crate::precision::model::{Ball, FRAME, Model};
use crate::scenes::Scene;

pub fn engine() -> Engine {
    Engine {
        name: "Rapier",
        color: "#b5541c",
        program: || super::built_in("rapier"),
        lines: |scene| Ok(lines(scene)),
        notes: "Rapier 0.36 in single precision, `fem` built in. `substeps` are its solver iterations of one step per frame. \
                Constraints: 4 sweeps by default, and 32. A spring is a constraint of its frequency against the masses at its ends. \
                FEM: at most 20 iterations of its linear solver by default, and 500. \
                Its corotational cells are left out: beside their law they keep volume by a constraint of their own.",
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
    body: SoftBodyHandle,
}

impl Player for RapierPlayer {
    fn build(model: &Model, settings: &Settings) -> Result<Self, String> {
        let mut world = PhysicsWorld::new();
        world.configure_thread_pool(1).map_err(|error| error.to_string())?;
        world.gravity = Vector::new(0.0, -model.gravity as f32, 0.0);
        let parameters = &mut world.integration_parameters;
        parameters.dt = FRAME as f32;
        parameters.num_solver_iterations = settings.number("substeps").unwrap_or(4.0) as usize;
        parameters.soft_bodies.max_extra_substeps = 0;
        parameters.soft_bodies.resweep_strain = f32::MAX;
        if let Some(iterations) = settings.number("iterations") {
            parameters.soft_bodies.fem.max_linear_iterations = iterations as usize;
        }
        let position = |place: &[f64; 3]| Vector::from(place.map(|x| x as f32));
        let mut builder = SoftBodyBuilder::new(model.positions.iter().map(position).collect())
            .masses(model.masses.iter().map(|&mass| mass as f32).collect())
            .pinned_particles(model.pinned.iter().map(|&node| node as u32))
            .linear_damping(model.damping as f32)
            .can_sleep(false);
        builder = match model.ball {
            Some(Ball { center, radius }) => {
                let ball = ColliderBuilder::ball(radius as f32).friction(0.0);
                let place = RigidBodyBuilder::fixed().translation(position(&center));
                world.insert(place, ball);
                let triangles = model.triangles.iter().map(|corners| corners.map(|node| node as u32));
                let surface = builder.surface(triangles.collect()).particle_radius(1e-3);
                surface.surface_collider(ColliderBuilder::default().friction(0.0))
            }
            None => builder.no_surface_collider(),
        };
        if let Some(sweeps) = settings.number("sweeps") {
            builder = builder.additional_pgs_iterations(sweeps as usize - 1);
        }
        if settings.word("solver") == Some("fem") {
            builder = builder.solver(SoftBodySolver::Fem);
        }
        let builder = match model.tetrahedra.is_empty() {
            true => with_springs(builder, model),
            false => with_cells(builder, model),
        };
        let body = world.insert_soft_body(builder);
        Ok(Self { world, body })
    }

    fn version() -> String {
        format!("rapier3d {}", rapier3d::VERSION)
    }

    fn frame(&mut self) -> Result<(), String> {
        self.world.step();
        Ok(())
    }

    fn position(&self, node: usize) -> [f32; 3] {
        let body = self.world.soft_bodies.get(self.body).expect("still there");
        body.particle_position(node).into()
    }
}

/// A spring is an undamped implicit one of a frequency against the masses at its ends: half a node's, or a whole one where
/// the other end is pinned.
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
