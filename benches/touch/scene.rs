//! A body and optional tools that touch it.

use glam::{Quat, Vec3};
use sinew::{BodyId, Error, Pose, Shape, ToolDefinition, ToolId, World, WorldDefinition};

/// Duration of a frame [s].
pub const FRAME: f32 = 1.0 / 60.0;

/// A tool and its pose at each frame.
pub struct MovingTool {
    pub id: ToolId,
    pub pose: fn(usize) -> Pose,
    /// For depths: the radius of a ball or capsule and half the length of its axis; `None` for a mesh.
    pub rounded: Option<(f32, f32)>,
}

pub struct Scene {
    pub world: World,
    pub body: BodyId,
    pub triangles: Vec<[u32; 3]>,
    pub tools: Vec<MovingTool>,
}

impl Scene {
    /// Creates a world with one thread.
    pub fn world(gravity: f32) -> Result<World, Error> {
        World::new(WorldDefinition {
            gravity: Vec3::NEG_Y * gravity,
            thread_count: 1,
            max_substeps: 10_000,
            ..Default::default()
        })
    }

    /// Adds a tool with this motion.
    pub fn add_tool(&mut self, shape: Shape, friction: f32, pose: fn(usize) -> Pose) -> Result<(), Error> {
        let rounded = match shape {
            Shape::Sphere { radius } => Some((radius, 0.0)),
            Shape::Capsule { radius, half_length } => Some((radius, half_length)),
            _ => None,
        };
        let id = self.world.create_tool(&ToolDefinition {
            friction,
            pose: pose(0),
            ..ToolDefinition::new(shape)
        })?;
        self.tools.push(MovingTool { id, pose, rounded });
        Ok(())
    }

    /// Sets the next poses of the tools.
    pub fn act(&mut self, frame: usize) -> Result<(), Error> {
        for tool in &self.tools {
            let pose = (tool.pose)(frame + 1);
            self.world.set_pose(tool.id, pose.position, Some(pose.orientation))?;
        }
        Ok(())
    }

    pub fn step(&mut self) -> Result<u32, Error> {
        Ok(self.world.step(FRAME)?.substeps)
    }

    /// The sum of the forces on all tools [N].
    pub fn force(&self) -> f64 {
        let forces = self
            .tools
            .iter()
            .map(|tool| self.world.wrench(tool.id).map_or(Vec3::ZERO, |wrench| wrench.0));
        forces.map(|force| f64::from(force.length())).sum()
    }

    /// The largest depth of nodes and of face centers in round tools [m].
    pub fn deepest(&self) -> [f64; 2] {
        let mut deepest = [0.0_f64; 2];
        let Ok(body) = self.world.body(self.body) else {
            return deepest;
        };
        let positions: Vec<Vec3> = body.positions().to_vec();
        for tool in &self.tools {
            let (Some((radius, half_length)), Ok(pose)) = (tool.rounded, self.world.pose(tool.id)) else {
                continue;
            };
            let depth = |point: Vec3| {
                let local = pose.orientation.conjugate() * (point - pose.position);
                let axis = Vec3::Y * local.y.clamp(-half_length, half_length);
                f64::from(radius - local.distance(axis))
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

/// The identity orientation at a point.
pub fn at(position: Vec3) -> Pose {
    Pose {
        position,
        ..Pose::IDENTITY
    }
}

/// A rotation about an axis at a point.
pub fn turned(position: Vec3, axis: Vec3, angle: f32) -> Pose {
    Pose {
        position,
        orientation: Quat::from_axis_angle(axis, angle),
    }
}

/// A smooth ramp from 0 to 1 within this many frames.
pub fn ramp(frame: usize, frames: f32) -> f32 {
    let fraction = (frame as f32 / frames).min(1.0);
    fraction * fraction * (3.0 - 2.0 * fraction)
}
