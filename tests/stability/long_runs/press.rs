//! A body is pressed once and let go of, and the work done on it is added up.

use glam::Vec3;
use sinew::{Pose, Shape, ToolDefinition, ToolId};

use super::activity::Activity;
use super::scene::Scene;
use super::subject::Subject;
use crate::support::tissue::penetration;

/// How long it is pressed further and further, and when it is let go of, s.
const GROWING: f64 = 0.25;
const LET_GO: f64 = 0.5;

/// How far pins and tools go, as a part of the body's length.
const DEPTH: f32 = 0.1;

/// What pushes it, as a part of its weight.
const LOAD: f32 = 0.3;

/// The radius of the tool, as a part of the body's length.
const RADIUS: f32 = 0.15;

#[derive(Clone, Copy)]
enum By {
    Pins,
    /// As large at the most, N on each node.
    Forces(Vec3),
    Tool(ToolId),
}

pub struct Press {
    by: By,
    nodes: Vec<u32>,
    /// How far pins or the tool are led, m.
    displacement: Vec3,
    /// Where what is led was at first, and before the step, m.
    first: Vec<Vec3>,
    before: Vec<Vec3>,
    /// The force on each node in the step, N.
    force: Vec3,
    is_over: bool,
}

impl Press {
    /// `None` where nothing is pressed.
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
        press.first = press.places(scene);
        Some(press)
    }

    /// Whether nothing acts on the body any more.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Before a step that ends at `time`.
    pub fn act(&mut self, scene: &mut Scene, time: f64) {
        if self.is_over {
            return;
        }
        self.before = self.places(scene);
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
                // Back as it came, and further.
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
        let ways = self.places(scene).into_iter().zip(&self.before);
        let ways = ways.map(|(now, before)| now.as_dvec3() - before.as_dvec3());
        match self.by {
            By::Pins => {
                let force = |node: u32| scene.body().pin_force(node).expect("a pin").as_dvec3();
                self.nodes
                    .iter()
                    .zip(ways)
                    .map(|(&node, way)| force(node).dot(way))
                    .sum()
            }
            By::Forces(_) => ways.map(|way| self.force.as_dvec3().dot(way)).sum(),
            By::Tool(tool) => {
                let (force, _) = scene.world.wrench(tool).expect("the tool");
                ways.map(|way| -force.as_dvec3().dot(way)).sum()
            }
        }
    }

    /// Where the nodes, or the tool, are now, m.
    fn places(&self, scene: &Scene) -> Vec<Vec3> {
        if let By::Tool(tool) = self.by {
            return vec![scene.world.pose(tool).expect("the tool").position];
        }
        let positions = scene.body().positions();
        self.nodes.iter().map(|&node| positions[node as usize]).collect()
    }
}

/// A sphere beside the middle of the body, which it just touches.
fn create_tool(scene: &mut Scene, across: Vec3, radius: f32) -> ToolId {
    let body = scene.body();
    let shape = Shape::Sphere { radius };
    let middle = body.positions().iter().sum::<Vec3>() / body.node_count() as f32;
    let heights = body.positions().iter().map(|p| (p - middle).dot(across));
    let mut pose = Pose {
        position: middle + (heights.fold(0.0, f32::max) + 2.0 * radius) * across,
        ..Pose::IDENTITY
    };
    // So far it may always go without touching anything.
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
