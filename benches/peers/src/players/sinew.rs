//! sinew through its Rust interface.

use glam::Vec3;
use sinew::{
    BodyDefinition, BodyId, ElementLaw, Material, Model as MaterialModel, Pose, Shape, Solver, ToolDefinition, Values,
    World, WorldDefinition,
};

use super::serve::{Player, Settings};
use super::{Engine, Line};
use crate::precision::law::Law;
use crate::precision::model::{Ball, FRAME, Model};
use crate::scenes::Scene;

pub fn engine() -> Engine {
    Engine {
        name: "sinew",
        color: "#0b6e99",
        program: || super::built_in("sinew"),
        lines: |scene| Ok(lines(scene)),
        notes: "VERLET chooses its substeps from stability, or takes `substeps` of them; IMPLICIT is stepped so many times a frame.",
    }
}

fn lines(scene: &Scene) -> Vec<Line> {
    let is_of_springs = scene.model.has(Law::Springs);
    let law = if is_of_springs { Law::Springs } else { Law::SignedVolume };
    let point = |settings: &[&str]| {
        settings
            .iter()
            .map(|setting| (*setting).to_string())
            .collect::<Vec<_>>()
    };
    let mut verlet = Line::doubling("VERLET", law, &["solver=verlet", "mass_scaling=0"], 32, 1024);
    verlet.points.insert(0, point(&["solver=verlet", "mass_scaling=0"]));
    let scaled = ["0.3", "0.1", "0.03", "0.01", "0.001"];
    let scaled = scaled.map(|part| point(&["solver=verlet", &format!("mass_scaling={part}")]));
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
    if !is_of_springs {
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
    body: BodyId,
    /// Calls of `step` per frame.
    steps: u32,
    substeps: u32,
}

impl SinewPlayer {
    /// One call of `step`.
    pub fn step(&mut self, seconds: f32) -> Result<(), String> {
        let report = self.world.step(seconds).map_err(|error| error.to_string())?;
        self.substeps = self.substeps.max(report.substeps);
        Ok(())
    }
}

impl Player for SinewPlayer {
    fn build(model: &Model, settings: &Settings) -> Result<Self, String> {
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
        })
        .map_err(|error| error.to_string())?;
        let positions: Vec<Vec3> = model
            .positions
            .iter()
            .map(|place| Vec3::from(place.map(|x| x as f32)))
            .collect();
        let masses: Vec<f32> = model.masses.iter().map(|&mass| mass as f32).collect();
        let springs: Vec<[u32; 2]> = model.springs.iter().map(|ends| ends.map(|node| node as u32)).collect();
        let tetrahedra: Vec<[u32; 4]> = model
            .tetrahedra
            .iter()
            .map(|ends| ends.map(|node| node as u32))
            .collect();
        let triangles: Vec<[u32; 3]> = model
            .triangles
            .iter()
            .map(|corners| corners.map(|node| node as u32))
            .collect();
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
        if let Some(part) = settings.number("mass_scaling") {
            definition.mass_scaling = part;
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
        let body = world.create_body(&definition).map_err(|error| error.to_string())?;
        let pinned = world.body_mut(body).map_err(|error| error.to_string())?;
        for &node in &model.pinned {
            pinned.pin(node as u32).map_err(|error| error.to_string())?;
        }
        if let Some(Ball { center, radius }) = model.ball {
            let mut pose = Pose::IDENTITY;
            pose.position = Vec3::from(center.map(|x| x as f32));
            let shape = Shape::Sphere { radius: radius as f32 };
            let ball = ToolDefinition {
                pose,
                ..ToolDefinition::new(shape)
            };
            world.create_tool(&ball).map_err(|error| error.to_string())?;
        }
        Ok(Self {
            world,
            body,
            steps: if is_verlet { 1 } else { cut.max(1) },
            substeps: 0,
        })
    }

    fn version() -> String {
        "this one".into()
    }

    fn frame(&mut self) -> Result<(), String> {
        let step = (FRAME / f64::from(self.steps)) as f32;
        (0..self.steps).try_for_each(|_| self.step(step))
    }

    fn position(&self, node: usize) -> [f32; 3] {
        self.world.body(self.body).expect("still there").positions()[node].to_array()
    }

    fn note(&self) -> Option<String> {
        let choice = self.world.body(self.body).expect("still there").solver_choice();
        Some(format!(
            "{:?}, at most {} substeps a step",
            choice.solver, self.substeps
        ))
    }
}
