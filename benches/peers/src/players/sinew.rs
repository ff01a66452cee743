//! sinew through its Rust interface.

use glam::Vec3;
use sinew::{
    Body, BodyContact, BodyDefinition, BodyId, ElementLaw, Material, Model as MaterialModel, Shape, Solver,
    ToolDefinition, ToolId, Values, World, WorldDefinition,
};

use super::serve::{Player, Settings};
use super::{Engine, Line};
use crate::precision::law::Law;
use crate::precision::model::{Ball, FRAME, Model, SKIN};
use crate::scenes::Scene;

pub fn engine() -> Engine {
    Engine {
        name: "sinew",
        color: "#0b6e99",
        program: || super::built_in("sinew"),
        lines: |scene| Ok(lines(scene)),
        notes: "VERLET chooses its substeps by stability, or takes `substeps` of them; IMPLICIT takes `substeps` steps per frame.",
    }
}

fn lines(scene: &Scene) -> Vec<Line> {
    let has_springs = scene.model.has(Law::Springs);
    let law = if has_springs { Law::Springs } else { Law::SignedVolume };
    let point = |settings: &[&str]| {
        settings
            .iter()
            .map(|setting| (*setting).to_string())
            .collect::<Vec<_>>()
    };
    let mut verlet = Line::doubling("VERLET", law, &["solver=verlet", "mass_scaling=0"], 32, 1024);
    verlet.points.insert(0, point(&["solver=verlet", "mass_scaling=0"]));
    let scaled = ["0.3", "0.1", "0.03", "0.01", "0.001"];
    let scaled = scaled.map(|value| point(&["solver=verlet", &format!("mass_scaling={value}")]));
    let line = |name: &str, points| Line {
        name: name.into(),
        law,
        points,
    };
    let mut all = vec![
        line("AUTO, all defaults", vec![point(&["solver=auto"])]),
        verlet,
        line("VERLET, `mass_scaling` 0.3 to 0.001", scaled.into()),
        Line::doubling("IMPLICIT, defaults", law, &["solver=implicit"], 1, 256),
        Line::doubling(
            "IMPLICIT, `iterations` 8",
            law,
            &["solver=implicit", "iterations=8"],
            1,
            256,
        ),
        Line::doubling(
            "IMPLICIT, `accuracy` 0.1",
            law,
            &["solver=implicit", "accuracy=0.1"],
            1,
            256,
        ),
        Line::doubling(
            "IMPLICIT, `accuracy` 1e-4",
            law,
            &["solver=implicit", "accuracy=1e-4"],
            1,
            256,
        ),
        Line::doubling("IMPLICIT, `order` 1", law, &["solver=implicit", "order=1"], 1, 256),
    ];
    if !has_springs {
        all.push(Line {
            name: "VERLET, NEO_HOOKEAN".into(),
            law: Law::NeoHookean,
            points: vec![point(&["solver=verlet", "mass_scaling=0", "law=neo-hookean"])],
        });
    }
    all
}

pub struct SinewPlayer {
    world: World,
    bodies: Vec<BodyId>,
    ball: Option<(ToolId, Ball)>,
    passed: usize,
    frames: usize,
    /// Calls of `step` per frame.
    steps: u32,
    substeps: u32,
}

impl SinewPlayer {
    /// Calls `step` once.
    pub fn step(&mut self, seconds: f32) -> Result<(), String> {
        let report = self.world.step(seconds).map_err(|error| error.to_string())?;
        self.substeps = self.substeps.max(report.substeps);
        Ok(())
    }

    fn first_body(&self) -> &Body {
        self.world.body(self.bodies[0]).expect("still there")
    }
}

fn vector([x, y, z]: [f64; 3]) -> Vec3 {
    Vec3::new(x as f32, y as f32, z as f32)
}

fn add_body(world: &mut World, model: &Model, settings: &Settings, solver: Solver) -> sinew::Result<BodyId> {
    fn nodes<const N: usize>(elements: &[[usize; N]]) -> Vec<[u32; N]> {
        elements.iter().map(|nodes| nodes.map(|node| node as u32)).collect()
    }
    let positions: Vec<Vec3> = model.positions.iter().copied().map(vector).collect();
    let masses: Vec<f32> = model.masses.iter().map(|&mass| mass as f32).collect();
    let (springs, tetrahedra) = (nodes(&model.springs), nodes(&model.tetrahedra));
    // A solid derives its surface from its tetrahedra.
    let triangles = nodes(if tetrahedra.is_empty() { &model.triangles } else { &[] });
    let mut definition = BodyDefinition {
        positions: &positions,
        masses: Values::Each(&masses),
        damping_rate: model.damping as f32,
        tetrahedra: &tetrahedra,
        triangles: &triangles,
        solver,
        order: settings.number("order").unwrap_or(0.0) as u32,
        iterations: settings.number("iterations").unwrap_or(0.0) as u32,
        accuracy: settings.number("accuracy").unwrap_or(0.0),
        ..BodyDefinition::default()
    };
    if model.has_floor {
        definition.contact = BodyContact {
            thickness: SKIN as f32,
            friction: model.friction as f32,
            with_bodies: true,
            ..BodyContact::default()
        };
    }
    if let Some(value) = settings.number("mass_scaling") {
        definition.mass_scaling = value;
    }
    if tetrahedra.is_empty() {
        definition.springs = Some(&springs);
        definition.stiffnesses = Values::Uniform(model.stiffness as f32);
    } else {
        definition.material = Some(Material {
            model: MaterialModel::Tetrahedra,
            young_modulus: model.young as f32,
            poisson_ratio: model.poisson as f32,
            density: 0.0,
            thickness: 0.0,
        });
        if settings.word("law") == Some("neo-hookean") {
            definition.element_law = ElementLaw::NeoHookean;
        }
    }
    let id = world.create_body(&definition)?;
    let body = world.body_mut(id)?;
    for &node in &model.pinned {
        body.pin(node as u32)?;
    }
    Ok(id)
}

fn build(model: &Model, settings: &Settings) -> sinew::Result<SinewPlayer> {
    let solver = match settings.word("solver") {
        Some("verlet") => Solver::Verlet,
        Some("implicit") => Solver::Implicit,
        _ => Solver::Auto,
    };
    let cut = settings.number("substeps").unwrap_or(0.0) as u32;
    let is_verlet = solver == Solver::Verlet;
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::new(0.0, -model.gravity as f32, 0.0),
        substeps: if is_verlet { cut } else { 0 },
        max_substeps: 8192,
        ..WorldDefinition::default()
    })?;
    let bodies = (0..model.body_count()).map(|index| add_body(&mut world, &model.body(index), settings, solver));
    let bodies = bodies.collect::<sinew::Result<Vec<_>>>()?;
    if model.has_floor {
        world.create_tool(&ToolDefinition {
            friction: model.friction as f32,
            ..ToolDefinition::new(Shape::Plane)
        })?;
    }
    let mut ball = None;
    if let Some(model_ball) = model.ball {
        let mut definition = ToolDefinition::new(Shape::Sphere {
            radius: model_ball.radius as f32,
        });
        definition.pose.position = vector(model_ball.center);
        ball = Some((world.create_tool(&definition)?, model_ball));
    }
    Ok(SinewPlayer {
        world,
        bodies,
        ball,
        passed: 0,
        frames: model.frames,
        steps: if is_verlet { 1 } else { cut.max(1) },
        substeps: 0,
    })
}

impl Player for SinewPlayer {
    fn build(model: &Model, settings: &Settings) -> Result<Self, String> {
        build(model, settings).map_err(|error| error.to_string())
    }

    fn version() -> String {
        "this one".into()
    }

    fn frame(&mut self) -> Result<(), String> {
        let step = (FRAME / f64::from(self.steps)) as f32;
        let before = self.passed;
        self.passed += 1;
        for index in 1..=self.steps {
            if let Some((tool, ball)) = &self.ball {
                let ends = [before, self.passed].map(|passed| vector(ball.center_after(passed, self.frames)));
                let center = ends[0].lerp(ends[1], index as f32 / self.steps as f32);
                let moved = self.world.set_pose(*tool, center, None);
                moved.map_err(|error| error.to_string())?;
            }
            self.step(step)?;
        }
        Ok(())
    }

    fn position(&self, node: usize) -> [f32; 3] {
        let size = self.first_body().positions().len();
        let body = self.world.body(self.bodies[node / size]).expect("still there");
        body.positions()[node % size].to_array()
    }

    fn note(&self) -> Option<String> {
        let choice = self.first_body().solver_choice();
        Some(format!(
            "{:?}, at most {} substeps a step",
            choice.solver, self.substeps
        ))
    }
}
