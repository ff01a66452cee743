//! Presses a body once, releases it, and measures the work.

use glam::Vec3;
use sinew::{Pose, Shape, ToolDefinition, ToolId};

use super::activity::Activity;
use super::scene::Scene;
use super::subject::Subject;
use crate::support::tissue::penetration;

/// The duration of the loading, and the time of the release, s.
const GROWING: f64 = 0.25;
const LET_GO: f64 = 0.5;

/// The displacement of pins and tools, as a fraction of the length of the body.
const DEPTH: f32 = 0.1;

/// The total force, as a fraction of the weight of the body.
const LOAD: f32 = 0.3;

/// The radius of the tool, as a fraction of the length of the body.
const RADIUS: f32 = 0.15;

#[derive(Clone, Copy)]
enum By {
    Pins,
    /// The final force on each node, N.
    Forces(Vec3),
    Tool(ToolId),
}

pub struct Press {
    by: By,
    nodes: Vec<u32>,
    /// Of pins or the tool, m.
    displacement: Vec3,
    /// Initial positions of the nodes or the tool, m.
    first: Vec<Vec3>,
    /// Their positions before the step, m.
    before: Vec<Vec3>,
    /// The force on each node in the step, N.
    force: Vec3,
    is_over: bool,
}

impl Press {
    /// `None` if the activity does not press.
    pub fn new(activity: Activity, subject: &Subject, scene: &mut Scene) -> Option<Self> {
        let across = subject.across();
        let mut displacement = DEPTH * subject.length * across;
        let nodes = subject.ends[1].clone();
        let by = match activity {
            Activity::Led => {
                scene.pin(&nodes);
                By::Pins
            }
            Activity::Pushed => {
                let weight = 9.81 * subject.masses.iter().sum::<f32>();
                By::Forces(LOAD * weight / nodes.len() as f32 * across)
            }
            Activity::Poked => {
                displacement = -displacement;
                By::Tool(create_tool(scene, across, RADIUS * subject.length))
            }
            _ => return None,
        };
        let mut press = Self {
            by,
            nodes,
            displacement,
            first: Vec::new(),
            before: Vec::new(),
            force: Vec3::ZERO,
            is_over: false,
        };
        press.first = press.positions(scene);
        Some(press)
    }

    /// True if the body has been released.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Prepares a step that ends at `time`.
    pub fn act(&mut self, scene: &mut Scene, time: f64) {
        if self.is_over {
            return;
        }
        self.before = self.positions(scene);
        let share = (time / GROWING).min(1.0) as f32;
        self.is_over = match self.by {
            By::Tool(_) => time > LET_GO + 2.0 * GROWING,
            _ => time > LET_GO,
        };
        match self.by {
            By::Pins if self.is_over => {
                for &node in &self.nodes {
                    scene.body_mut().unpin(node).expect("a pin");
                }
            }
            By::Pins => {
                for (&node, &first) in self.nodes.iter().zip(&self.first) {
                    let to = first + share * self.displacement;
                    scene.body_mut().move_pin(node, to).expect("a pin");
                }
            }
            By::Forces(most) => {
                self.force = if self.is_over { Vec3::ZERO } else { share * most };
                for &node in &self.nodes {
                    scene.body_mut().apply_force(node, self.force).expect("a node");
                }
            }
            By::Tool(tool) if self.is_over => scene.world.destroy_tool(tool).expect("the tool"),
            By::Tool(tool) => {
                // It retreats beyond its initial position.
                let back = ((time - LET_GO) / GROWING).max(0.0) as f32;
                let to = self.first[0] + (share - back) * self.displacement;
                scene.world.set_pose(tool, to, None).expect("the tool");
            }
        }
    }

    /// The work done on the body in the step, J.
    pub fn work(&self, scene: &Scene) -> f64 {
        if self.is_over {
            return 0.0;
        }
        let displacements = self.positions(scene).into_iter().zip(&self.before);
        let displacements = displacements.map(|(now, before)| now.as_dvec3() - before.as_dvec3());
        match self.by {
            By::Pins => {
                let force = |node: u32| scene.body().pin_force(node).expect("a pin").as_dvec3();
                self.nodes
                    .iter()
                    .zip(displacements)
                    .map(|(&node, displacement)| force(node).dot(displacement))
                    .sum()
            }
            By::Forces(_) => displacements
                .map(|displacement| self.force.as_dvec3().dot(displacement))
                .sum(),
            By::Tool(tool) => {
                let (force, _) = scene.world.wrench(tool).expect("the tool");
                displacements
                    .map(|displacement| -force.as_dvec3().dot(displacement))
                    .sum()
            }
        }
    }

    /// The positions of the nodes or the tool, m.
    fn positions(&self, scene: &Scene) -> Vec<Vec3> {
        if let By::Tool(tool) = self.by {
            return vec![scene.world.pose(tool).expect("the tool").position];
        }
        let positions = scene.body().positions();
        self.nodes.iter().map(|&node| positions[node as usize]).collect()
    }
}

/// Creates a sphere that touches the body near its middle.
fn create_tool(scene: &mut Scene, across: Vec3, radius: f32) -> ToolId {
    let body = scene.body();
    let shape = Shape::Sphere { radius };
    let middle = body.positions().iter().sum::<Vec3>() / body.node_count() as f32;
    let heights = body.positions().iter().map(|p| (p - middle).dot(across));
    let mut pose = Pose {
        position: middle + (heights.fold(0.0, f32::max) + 2.0 * radius) * across,
        ..Pose::IDENTITY
    };
    // Conservative advancement: a step as long as the distance touches nothing.
    for _ in 0..100 {
        let room = -penetration(body, shape, pose) as f32;
        pose.position -= room.max(0.0) * across;
    }
    let tool = ToolDefinition {
        pose,
        ..ToolDefinition::new(shape)
    };
    scene.world.create_tool(&tool).expect("a tool")
}
