//! A body and perhaps tools that touch it.

use glam::{Quat, Vec3};
use sinew::{BodyId, Error, Pose, Shape, ToolDefinition, ToolId, World, WorldDefinition};

/// s
pub const FRAME: f32 = 1.0 / 60.0;

/// A tool, and its pose at a frame.
pub struct Hand {
    pub tool: ToolId,
    pub pose: fn(usize) -> Pose,
    /// For depths: the radius of a ball or capsule and half the length of its axis; `None` for a mesh.
    pub rounded: Option<(f32, f32)>,
}

pub struct Scene {
    pub world: World,
    pub body: BodyId,
    pub triangles: Vec<[u32; 3]>,
    pub hands: Vec<Hand>,
}

impl Scene {
    /// A world of one thread.
    pub fn world(gravity: f32) -> Result<World, Error> {
        World::new(WorldDefinition {
            gravity: Vec3::NEG_Y * gravity,
            thread_count: 1,
            max_substeps: 10_000,
            ..Default::default()
        })
    }

    /// Adds a tool with this motion.
    pub fn hold(&mut self, shape: Shape, friction: f32, pose: fn(usize) -> Pose) -> Result<(), Error> {
        let rounded = match shape {
            Shape::Sphere { radius } => Some((radius, 0.0)),
            Shape::Capsule { radius, half_length } => Some((radius, half_length)),
            _ => None,
        };
        let tool = self.world.create_tool(&ToolDefinition {
            friction,
            pose: pose(0),
            ..ToolDefinition::new(shape)
        })?;
        self.hands.push(Hand { tool, pose, rounded });
        Ok(())
    }

    /// Sends the tools on.
    pub fn act(&mut self, frame: usize) -> Result<(), Error> {
        for hand in &self.hands {
            let pose = (hand.pose)(frame + 1);
            self.world.set_pose(hand.tool, pose.position, Some(pose.orientation))?;
        }
        Ok(())
    }

    pub fn step(&mut self) -> Result<u32, Error> {
        Ok(self.world.step(FRAME)?.substeps)
    }

    /// The forces on all tools together, N.
    pub fn force(&self) -> f64 {
        let forces = self
            .hands
            .iter()
            .map(|hand| self.world.wrench(hand.tool).map_or(Vec3::ZERO, |wrench| wrench.0));
        forces.map(|force| f64::from(force.length())).sum()
    }

    /// How deep nodes are within round tools, and middles of faces, m.
    pub fn deepest(&self) -> [f64; 2] {
        let mut deepest = [0.0_f64; 2];
        let Ok(body) = self.world.body(self.body) else {
            return deepest;
        };
        let positions: Vec<Vec3> = body.positions().to_vec();
        for hand in &self.hands {
            let (Some((radius, half_length)), Ok(pose)) = (hand.rounded, self.world.pose(hand.tool)) else {
                continue;
            };
            let depth = |point: Vec3| {
                let own = pose.orientation.conjugate() * (point - pose.position);
                let axis = Vec3::Y * own.y.clamp(-half_length, half_length);
                f64::from(radius - own.distance(axis))
            };
            for &point in &positions {
                deepest[0] = deepest[0].max(depth(point));
            }
            for triangle in &self.triangles {
                let middle = triangle.iter().map(|&node| positions[node as usize]).sum::<Vec3>() / 3.0;
                deepest[1] = deepest[1].max(depth(middle));
            }
        }
        deepest
    }
}

/// Upright at a point.
pub fn at(position: Vec3) -> Pose {
    Pose {
        position,
        ..Pose::IDENTITY
    }
}

/// Turned about an axis at a point.
pub fn turned(position: Vec3, axis: Vec3, angle: f32) -> Pose {
    Pose {
        position,
        orientation: Quat::from_axis_angle(axis, angle),
    }
}

/// From 0 to 1 within so many frames, smoothly.
pub fn ramp(frame: usize, frames: f32) -> f32 {
    let part = (frame as f32 / frames).min(1.0);
    part * part * (3.0 - 2.0 * part)
}
