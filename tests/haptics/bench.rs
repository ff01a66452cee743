//! A block of tissue, a sphere, and a hand that leads it: ticks and steps by turns, on one thread.

use glam::{DVec3, Quat, Vec3, vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, BodyId, HapticDefinition, HapticHandle, HapticTick, Material, Model, Pose, Shape, Solver,
    ToolDefinition, ToolId, Values, World, WorldDefinition,
};

/// s.
pub const TICK: f32 = 1e-3;

/// m.
pub const RADIUS: f32 = 0.01;

/// m: so far above the tissue the tool begins.
pub const CLEAR: f32 = 2e-3;

/// m: the top of the block is at y = 0.
pub const HEIGHT: f32 = 0.04;

pub struct Bench {
    pub world: World,
    pub body: BodyId,
    pub tool: ToolId,
    pub handle: HapticHandle,
    /// Ticks for each step; 0: it stands still.
    pub every: u32,
    ticks: u32,
}

/// A tick as it was.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    pub position: DVec3,
    pub velocity: DVec3,
    pub tick: HapticTick,
}

impl Bench {
    /// One step for so many ticks.
    pub fn new(solver: Solver, every: u32) -> Self {
        Self::with(solver, every, |_| ())
    }

    /// The same with another definition of the handle.
    pub fn with(solver: Solver, every: u32, change: impl FnOnce(&mut HapticDefinition)) -> Self {
        Self::of([10, 4, 10], solver, every, change)
    }

    /// The same with smaller elements.
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

    /// A tick of a hand that is here.
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

    /// What the tissue has, J.
    pub fn energy(&self) -> f64 {
        let energy = self.world.body(self.body).unwrap().energy(self.world.gravity());
        energy.kinetic + energy.elastic
    }

    /// Ticks of a hand that goes where `path` says, s to m.
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
