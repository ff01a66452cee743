//! A cloth that lies on a tool: the time of a step and what the tool feels, with each detection.

use glam::Vec3;
use sinew::{
    BodyContact, BodyDefinition, BodyId, Detection, Shape as ToolShape, Solver, ToolDefinition, ToolId, Values, World,
    WorldDefinition,
};

use crate::claims::Claims;
use crate::report::{Report, Table, count, digits, milliseconds};
use crate::rounds::{Contender, Effort, interleave};
use crate::scene::SIZE;
use crate::shapes::{Shape, bumpy_radius};
use crate::truth::Truth;

/// kg, and what the cloth keeps off the tool, m.
const MASS: f32 = 0.02;
const THICKNESS: f32 = 0.2e-3;

/// 1/s, so that it soon lies still.
const DAMPING: f32 = 100.0;

/// s
const STEP: f32 = 1e-3;

/// A cloth that nothing touches, for comparison.
const FREE: &str = "no tool";

const DETECTIONS: [(&str, Detection); 3] = [
    ("EXACT", Detection::Exact),
    ("IMAGE_SPACE, 1/256", Detection::ImageSpace),
    ("DISTANCE_FIELD, 1/64", Detection::DistanceField),
];

/// A cloth and a tool that are measured.
pub struct Extent {
    pub solver: Solver,
    /// Triangles of the tool.
    pub tool: usize,
    /// Cells along the cloth.
    pub cells: u32,
}

/// Steps until a cloth lies still.
const SETTLING: usize = 40;

/// A cloth and perhaps a tool.
struct Drape {
    world: World,
    cloth: BodyId,
    tool: Option<ToolId>,
}

impl Drape {
    fn new(detection: Option<Detection>, tool: &Shape, solver: Solver, cells: u32) -> Result<Self, String> {
        let row = cells + 1;
        let square = sinew::mesh::Mesh::cloth([SIZE, SIZE], [cells, cells]).map_err(|error| error.to_string())?;
        // As it lies on the upper side, within 30 degrees of the top, so that friction holds it.
        let lying = square.positions.iter().map(|place| {
            let direction = Vec3::new(0.8 * place.x, SIZE, 0.8 * place.z).normalize();
            direction * (bumpy_radius(SIZE, direction) + THICKNESS)
        });
        let positions: Vec<Vec3> = lying.collect();
        let mass = MASS / (row * row) as f32;
        let mut world = World::new(WorldDefinition {
            thread_count: 1,
            ..Default::default()
        })
        .map_err(|error| error.to_string())?;
        let cloth = world
            .create_body(&BodyDefinition {
                positions: &positions,
                masses: Values::Uniform(mass),
                node_dampings: Values::Uniform(DAMPING * mass),
                stiffnesses: Values::Uniform(30.0),
                spring_dampings: Values::Uniform(0.01),
                triangles: &square.triangles,
                contact: BodyContact {
                    thickness: THICKNESS,
                    ..Default::default()
                },
                solver,
                ..Default::default()
            })
            .map_err(|error| error.to_string())?;
        let tool = match detection {
            Some(detection) => {
                let definition = ToolDefinition {
                    detection,
                    friction: 0.6,
                    ..ToolDefinition::new(ToolShape::Mesh {
                        positions: &tool.positions,
                        triangles: &tool.triangles,
                    })
                };
                Some(world.create_tool(&definition).map_err(|error| error.to_string())?)
            }
            None => None,
        };
        Ok(Self { world, cloth, tool })
    }

    fn step(&mut self, steps: usize) {
        for _ in 0..steps {
            self.world.step(STEP).expect("a step");
        }
    }

    fn force(&self) -> Vec3 {
        self.tool
            .map_or(Vec3::ZERO, |tool| self.world.wrench(tool).expect("a tool").0)
    }
}

/// Where the cloth lies, and what the tool feels.
struct Lie {
    /// The force on the tool over the weight, less 1, of the mean over the last steps.
    force: f64,
    /// The largest that a single step's differs from that mean, in the weight.
    jitter: f64,
    inside: usize,
    nodes: usize,
    /// m
    deepest: f64,
    /// Of the points in contact: how far off the thickness they are, RMS and worst, m.
    off: f64,
    worst: f64,
    contacts: usize,
}

impl Lie {
    fn of(drape: &mut Drape, truth: &Truth) -> Self {
        const STEPS: usize = 10;
        let forces: Vec<Vec3> = (0..STEPS)
            .map(|_| {
                drape.step(1);
                drape.force()
            })
            .collect();
        let weight = MASS * 9.81;
        let mean = forces.iter().sum::<Vec3>() / STEPS as f32;
        let jitter = forces.iter().map(|force| force.distance(mean)).fold(0.0, f32::max);
        let positions = drape.world.body(drape.cloth).expect("a body").positions();
        let distances: Vec<f64> = positions
            .iter()
            .map(|node| truth.signed_distance(node.as_dvec3()))
            .collect();
        let contacts: Vec<f64> = drape
            .tool
            .into_iter()
            .flat_map(|tool| drape.world.contacts(tool).expect("a tool"))
            .map(|contact| truth.signed_distance(contact.point.as_dvec3()) - f64::from(THICKNESS))
            .collect();
        let squares: f64 = contacts.iter().map(|off| off * off).sum();
        Self {
            force: f64::from((mean + weight * Vec3::Y).length() / weight),
            jitter: f64::from(jitter / weight),
            inside: distances.iter().filter(|distance| **distance < 0.0).count(),
            nodes: distances.len(),
            deepest: distances
                .iter()
                .fold(0.0, |deepest, distance| f64::max(deepest, -distance)),
            off: (squares / contacts.len().max(1) as f64).sqrt(),
            worst: contacts.iter().fold(0.0, |worst, off| f64::max(worst, off.abs())),
            contacts: contacts.len(),
        }
    }
}

pub fn run(report: &mut Report, claims: &mut Claims, extents: &[Extent], effort: Effort) {
    report.write(&format!(
        "\n## A cloth on a tool\n\n{} g, on the upper side of a bumpy ball of {} mm, steps of {} ms on one thread. Over a free \
         cloth: the median of the ratios within rounds. Force: the mean on the tool over 10 steps against the weight, and by how much a single step's \
         differs from it. Off: of the points in contact, from the cloth's thickness.\n",
        digits(1e3 * f64::from(MASS)),
        digits(1e3 * f64::from(SIZE)),
        digits(1e3 * f64::from(STEP))
    ));
    let mut table = Table::new(&[
        "solver",
        "nodes",
        "tool",
        "detection",
        "ms a step",
        "over a free cloth",
        "force off %",
        "step to step %",
        "contacts",
        "off RMS mm",
        "worst mm",
        "inside",
        "deepest mm",
    ]);
    for extent in extents {
        lie(report, claims, &mut table, extent, effort);
    }
    report.table(&table);
}

fn lie(report: &mut Report, claims: &mut Claims, table: &mut Table, extent: &Extent, effort: Effort) {
    let Extent { solver, tool, cells } = *extent;
    let tool = Shape::bumpy(SIZE, tool);
    let truth = Truth::new(&tool.positions, &tool.triangles);
    let triangles = tool.triangles.len();
    report.progress(&format!("{solver:?}, a cloth on a tool of {triangles} triangles"));
    let mut drapes = Vec::new();
    for (name, detection) in DETECTIONS {
        match Drape::new(Some(detection), &tool, solver, cells) {
            Ok(mut drape) => {
                drape.step(SETTLING);
                report.progress(&format!("{name} has settled"));
                drapes.push((name, drape));
            }
            Err(reason) => report.not_offered(name, &reason),
        }
    }
    let lies: Vec<Lie> = drapes.iter_mut().map(|(_, drape)| Lie::of(drape, &truth)).collect();
    if let Ok(free) = Drape::new(None, &tool, solver, cells) {
        drapes.push((FREE, free));
    }
    let contenders = drapes
        .iter_mut()
        .map(|(name, drape)| Contender::new(*name, 1, |units| drape.step(units)));
    let results = interleave(contenders.collect(), effort);
    report.disturbed(results.waited);
    let free = results.get(FREE);
    for ((name, _), lie) in drapes.iter().zip(&lies) {
        let Some(samples) = results.get(name) else { continue };
        let ratio = free.map_or(f64::NAN, |free| samples.ratio(free));
        table.row(vec![
            format!("{solver:?}"),
            lie.nodes.to_string(),
            count(triangles),
            (*name).into(),
            milliseconds(samples.minimum()),
            digits(ratio),
            digits(100.0 * lie.force),
            digits(100.0 * lie.jitter),
            lie.contacts.to_string(),
            digits(1e3 * lie.off),
            digits(1e3 * lie.worst),
            lie.inside.to_string(),
            digits(1e3 * lie.deepest),
        ]);
        let what = format!("{solver:?}, a cloth on {} triangles, {name}:", count(triangles));
        claims.at_most(format!("{what} the force off the weight"), lie.force, 0.01);
        claims.at_most(format!("{what} the deepest node, m"), lie.deepest, 0.5e-3);
    }
}
