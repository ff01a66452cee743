//! Blocks that hang from each other.

#![allow(dead_code, reason = "each test uses some of these helpers")]

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{Anchor, AttachmentId, BodyContact, BodyDefinition, BodyId, Solver, Storage, Values, World};

use super::tissue::{body, moved, pin_all, world};

pub const SIZE: f32 = 0.04;
pub const HEIGHT: f32 = 0.02;
pub const DOWN: Vec3 = Vec3::new(0.0, -9.81, 0.0);

/// The parameters of a block.
#[derive(Clone, Copy)]
pub struct Block {
    pub at: Vec3,
    pub mass: f32,
    pub stiffness: f32,
    pub drag: f32,
    pub solver: Solver,
    pub contact: BodyContact,
    pub cells: [u32; 3],
    pub storage: Storage,
}

impl Block {
    /// A block without damping.
    pub const FREE: Self = Self {
        drag: 0.0,
        ..Self::CALM
    };
    pub const CALM: Self = Self {
        at: Vec3::ZERO,
        mass: 0.1,
        stiffness: 1000.0,
        drag: 30.0,
        solver: Solver::Verlet,
        contact: BodyContact::NOTHING,
        cells: [4, 2, 4],
        storage: Storage::Packed,
    };

    pub fn mesh(&self) -> Mesh {
        moved(Mesh::block([SIZE, HEIGHT, SIZE], self.cells).expect("a block"), self.at)
    }

    pub fn put(&self, world: &mut World) -> BodyId {
        let mesh = self.mesh();
        let node_mass = self.mass / mesh.positions.len() as f32;
        world
            .create_body(&BodyDefinition {
                masses: Values::Uniform(node_mass),
                node_dampings: Values::Uniform(self.drag * node_mass),
                stiffnesses: Values::Uniform(self.stiffness),
                solver: self.solver,
                storage: self.storage,
                contact: self.contact,
                ..BodyDefinition::of(&mesh)
            })
            .expect("a body")
    }
}

/// Returns the nodes whose rest position satisfies `is_one`.
pub fn nodes_at(mesh: &Mesh, is_selected: impl Fn(Vec3) -> bool) -> Vec<u32> {
    let nodes = (0..)
        .zip(&mesh.positions)
        .filter(|(_, position)| is_selected(**position));
    nodes.map(|(node, _)| node).collect()
}

pub fn anchors(nodes: &[u32]) -> Vec<Anchor> {
    nodes.iter().copied().map(Anchor::Node).collect()
}

/// A lower block attached to the bottom of an upper block by nodes of its top. The top of the upper block is pinned.
pub struct Hanging {
    pub world: World,
    pub above: BodyId,
    pub below: BodyId,
    pub pinned: Vec<u32>,
    pub pairs: Vec<[u32; 2]>,
    pub ids: Vec<AttachmentId>,
}

impl Hanging {
    pub fn new(above: Block, below: Block, count: usize, gravity: Vec3) -> Self {
        Self::in_world(world(gravity), above, below, count)
    }

    pub fn in_world(mut world: World, above: Block, below: Block, count: usize) -> Self {
        let half = SIZE / 2.0;
        let above = Block {
            at: Vec3::Y * (HEIGHT / 2.0),
            ..above
        };
        let below = Block {
            at: Vec3::NEG_Y * (HEIGHT / 2.0),
            ..below
        };
        let meshes = [above.mesh(), below.mesh()];
        let bodies = [above.put(&mut world), below.put(&mut world)];
        let pinned = nodes_at(&meshes[0], |position| position.y > HEIGHT - 1e-4);
        pin_all(&mut world, bodies[0], &pinned);
        let is_corner = |position: Vec3| position.x.abs() > half - 1e-4 && position.z.abs() > half - 1e-4;
        let is_attached = |position: Vec3| {
            position.y.abs() < 1e-4
                && match count {
                    1 => position.x.abs() < 1e-4 && position.z.abs() < 1e-4,
                    4 => is_corner(position),
                    _ => true,
                }
        };
        let [first, second] = [0, 1].map(|index| nodes_at(&meshes[index], is_attached));
        assert_eq!([first.len(), second.len()], [count; 2]);
        let ids = world
            .attach_to_body(bodies[1], &anchors(&second), bodies[0], &anchors(&first), 0.0)
            .expect("attachments");
        Self {
            world,
            above: bodies[0],
            below: bodies[1],
            pinned,
            pairs: first.into_iter().zip(second).map(|(a, b)| [a, b]).collect(),
            ids,
        }
    }

    pub fn drift(&self) -> f32 {
        let [above, below] = [self.above, self.below].map(|id| body(&self.world, id).positions());
        let gap = |&[a, b]: &[u32; 2]| above[a as usize].distance(below[b as usize]);
        self.pairs.iter().map(gap).fold(0.0, f32::max)
    }

    pub fn force(&self) -> DVec3 {
        let force = |&id: &AttachmentId| self.world.attachment_force(id).expect("a force").as_dvec3();
        self.ids.iter().map(force).sum()
    }
}
