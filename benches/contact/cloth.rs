//! A cloth on a tool: the time of a step and the error of the force on the tool, with each detection.

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

/// Mass of the cloth [kg] and its contact thickness [m].
const MASS: f32 = 0.02;
const THICKNESS: f32 = 0.2e-3;

/// Damping rate, so that the cloth soon rests [1/s].
const DAMPING: f32 = 100.0;

/// Duration of a step [s].
const STEP: f32 = 1e-3;

/// A cloth without contact, as the baseline.
const FREE: &str = "no tool";

const DETECTIONS: [(&str, Detection); 3] = [
    ("EXACT", Detection::Exact),
    ("IMAGE_SPACE, 1/256", Detection::ImageSpace),
    ("DISTANCE_FIELD, 1/64", Detection::DistanceField),
];

/// The size of a measured cloth and its tool.
pub struct Extent {
    pub solver: Solver,
    /// Number of triangles of the tool.
    pub tool: usize,
    /// Number of cells along the cloth.
    pub cells: u32,
}

/// Steps until the cloth is at rest.
const SETTLING: usize = 40;

/// A cloth, with a tool or without.
struct DrapedCloth {
    world: World,
    cloth: BodyId,
    tool: Option<ToolId>,
}

impl DrapedCloth {
    fn new(detection: Option<Detection>, tool: &Shape, solver: Solver, cells: u32) -> Result<Self, String> {
        let row = cells + 1;
        let square = sinew::mesh::Mesh::cloth([SIZE, SIZE], [cells, cells]).map_err(|error| error.to_string())?;
        // The cloth starts on the upper side, within 30 degrees of the top, so that friction holds it.
        let draped = square.positions.iter().map(|position| {
            let direction = Vec3::new(0.8 * position.x, SIZE, 0.8 * position.z).normalize();
            direction * (bumpy_radius(SIZE, direction) + THICKNESS)
        });
        let positions: Vec<Vec3> = draped.collect();
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

/// The resting position of the cloth and the force on the tool.
struct RestReport {
    /// The mean force on the tool over the last steps, over the weight, less 1.
    force: f64,
    /// The largest deviation of a single step's force from that mean, over the weight.
    jitter: f64,
    inside: usize,
    nodes: usize,
    /// The deepest penetration [m].
    deepest: f64,
    /// Deviation of contact points from the contact thickness, RMS and worst [m].
    thickness_error: f64,
    worst: f64,
    contacts: usize,
}

impl RestReport {
    fn of(drape: &mut DrapedCloth, truth: &Truth) -> Self {
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
        let squares: f64 = contacts.iter().map(|error| error * error).sum();
        Self {
            force: f64::from((mean + weight * Vec3::Y).length() / weight),
            jitter: f64::from(jitter / weight),
            inside: distances.iter().filter(|distance| **distance < 0.0).count(),
            nodes: distances.len(),
            deepest: distances
                .iter()
                .fold(0.0, |deepest, distance| f64::max(deepest, -distance)),
            thickness_error: (squares / contacts.len().max(1) as f64).sqrt(),
            worst: contacts.iter().fold(0.0, |worst, error| f64::max(worst, error.abs())),
            contacts: contacts.len(),
        }
    }
}

pub fn run(report: &mut Report, claims: &mut Claims, extents: &[Extent], effort: Effort) {
    report.write(&format!(
        "\n## A cloth on a tool\n\n{} g, on the upper side of a bumpy ball of {} mm, steps of {} ms on one thread. Over a free \
         cloth: the median of the ratios within rounds. Force: the mean on the tool over 10 steps against the weight, and the deviation of a single step's \
         force. Off: deviation of contact points from the contact thickness.\n",
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
        rest(report, claims, &mut table, extent, effort);
    }
    report.table(&table);
}

fn rest(report: &mut Report, claims: &mut Claims, table: &mut Table, extent: &Extent, effort: Effort) {
    let Extent { solver, tool, cells } = *extent;
    let tool = Shape::bumpy(SIZE, tool);
    let truth = Truth::new(&tool.positions, &tool.triangles);
    let triangles = tool.triangles.len();
    report.progress(&format!("{solver:?}, a cloth on a tool of {triangles} triangles"));
    let mut drapes = Vec::new();
    for (name, detection) in DETECTIONS {
        match DrapedCloth::new(Some(detection), &tool, solver, cells) {
            Ok(mut drape) => {
                drape.step(SETTLING);
                report.progress(&format!("{name} has settled"));
                drapes.push((name, drape));
            }
            Err(reason) => report.not_offered(name, &reason),
        }
    }
    let lies: Vec<RestReport> = drapes
        .iter_mut()
        .map(|(_, drape)| RestReport::of(drape, &truth))
        .collect();
    if let Ok(free) = DrapedCloth::new(None, &tool, solver, cells) {
        drapes.push((FREE, free));
    }
    let contenders = drapes
        .iter_mut()
        .map(|(name, drape)| Contender::new(*name, 1, |units| drape.step(units)));
    let results = interleave(contenders.collect(), effort);
    report.disturbed(results.waited);
    let free = results.get(FREE);
    for ((name, _), rest) in drapes.iter().zip(&lies) {
        let Some(samples) = results.get(name) else { continue };
        let ratio = free.map_or(f64::NAN, |free| samples.ratio(free));
        table.row(vec![
            format!("{solver:?}"),
            rest.nodes.to_string(),
            count(triangles),
            (*name).into(),
            milliseconds(samples.minimum()),
            digits(ratio),
            digits(100.0 * rest.force),
            digits(100.0 * rest.jitter),
            rest.contacts.to_string(),
            digits(1e3 * rest.thickness_error),
            digits(1e3 * rest.worst),
            rest.inside.to_string(),
            digits(1e3 * rest.deepest),
        ]);
        let what = format!("{solver:?}, a cloth on {} triangles, {name}:", count(triangles));
        claims.at_most(format!("{what} the force off the weight"), rest.force, 0.01);
        claims.at_most(format!("{what} the deepest node, m"), rest.deepest, 0.5e-3);
    }
}
