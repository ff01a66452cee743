//! A block of tissue, a sphere, and a hand that moves it. Ticks and steps alternate on one thread.

use glam::{DVec3, Quat, Vec3, vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, BodyId, HapticDefinition, HapticHandle, HapticTick, Material, Model, Pose, Shape, Solver,
    ToolDefinition, ToolId, Values, World, WorldDefinition,
};

/// The time of a tick (s).
pub const TICK: f32 = 1e-3;

/// The radius of the tool (m).
pub const RADIUS: f32 = 0.01;

/// The initial height of the tool above the tissue (m).
pub const CLEAR: f32 = 2e-3;

/// The height of the block (m). Its top is at y = 0.
pub const HEIGHT: f32 = 0.04;

pub struct Bench {
    pub world: World,
    pub body: BodyId,
    pub tool: ToolId,
    pub handle: HapticHandle,
    /// The number of ticks per step; 0 takes no steps.
    pub every: u32,
    ticks: u32,
}

/// The input and the result of a tick.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    pub position: DVec3,
    pub velocity: DVec3,
    pub tick: HapticTick,
}

impl Bench {
    /// Creates a bench that takes one step per `every` ticks.
    pub fn new(solver: Solver, every: u32) -> Self {
        Self::with(solver, every, |_| ())
    }

    /// Creates a bench with a handle definition that `change` edits.
    pub fn with(solver: Solver, every: u32, change: impl FnOnce(&mut HapticDefinition)) -> Self {
        Self::of([10, 4, 10], solver, every, change)
    }

    /// Creates a bench with smaller elements.
    pub fn fine(solver: Solver, every: u32) -> Self {
        Self::of([14, 5, 14], solver, every, |_| ())
    }

    fn of(cells: [u32; 3], solver: Solver, every: u32, change: impl FnOnce(&mut HapticDefinition)) -> Self {
        let size = [0.1, HEIGHT, 0.1];
        let mut mesh = Mesh::block(size, cells).unwrap();
        let low = mesh.positions.iter().copied().reduce(Vec3::min).unwrap();
        for position in &mut mesh.positions {
            *position -= low + vec3(0.5 * size[0], size[1], 0.5 * size[2]);
        }
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            ..WorldDefinition::default()
        })
        .unwrap();
        let count = mesh.positions.len() as f32;
        let material = Material {
            model: Model::Tetrahedra,
            young_modulus: 5e3,
            poisson_ratio: 0.3,
            density: 1000.0,
            thickness: 0.0,
        };
        let body = world
            .create_body(&BodyDefinition {
                material: Some(material),
                solver,
                spare_nodes: 2000,
                node_dampings: Values::Uniform(20.0 * 0.4 / count),
                ..BodyDefinition::of(&mesh)
            })
            .unwrap();
        for (node, position) in mesh.positions.iter().enumerate() {
            if position.y < -HEIGHT + 1e-4 {
                world.body_mut(body).unwrap().pin(node as u32).unwrap();
            }
        }
        let tool = world
            .create_tool(&ToolDefinition {
                pose: Pose {
                    position: vec3(0.0, RADIUS + CLEAR, 0.0),
                    orientation: Quat::IDENTITY,
                },
                ..ToolDefinition::new(Shape::Sphere { radius: RADIUS })
            })
            .unwrap();
        let mut definition = HapticDefinition::new(tool);
        change(&mut definition);
        let handle = world.create_haptic(&definition).unwrap();
        Self {
            world,
            body,
            tool,
            handle,
            every,
            ticks: 0,
        }
    }

    /// Takes a tick with the hand at this position.
    pub fn tick(&mut self, position: DVec3, velocity: DVec3) -> Record {
        let pose = Pose {
            position: position.as_vec3(),
            orientation: Quat::IDENTITY,
        };
        let tick = self.handle.tick(pose, Some(velocity.as_vec3()), None, TICK).unwrap();
        self.ticks += 1;
        if self.every > 0 && self.ticks.is_multiple_of(self.every) {
            self.world.step(self.every as f32 * TICK).unwrap();
        }
        Record {
            position,
            velocity,
            tick,
        }
    }

    /// Returns the energy of the tissue (J).
    pub fn energy(&self) -> f64 {
        let energy = self.world.body(self.body).unwrap().energy(self.world.gravity());
        energy.kinetic + energy.elastic
    }

    /// Takes ticks with a hand that follows `path`, which maps seconds to meters.
    pub fn follow(&mut self, seconds: f64, path: impl Fn(f64) -> DVec3) -> Vec<Record> {
        let ticks = (seconds / f64::from(TICK)).round() as u32;
        (1..=ticks)
            .map(|tick| {
                let t = f64::from(tick) * f64::from(TICK);
                let h = 1e-6;
                self.tick(path(t), (path(t + h) - path(t - h)) / (2.0 * h))
            })
            .collect()
    }
}
