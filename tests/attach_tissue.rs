//! Tissue attached to tissue.

#[path = "support/tissue.rs"]
mod tissue;

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{Anchor, AttachmentId, BodyDefinition, BodyId, Solver, Values, World};
use tissue::*;

const SIZE: f32 = 0.04;
const CELLS: u32 = 4;
const DOWN: Vec3 = Vec3::new(0.0, -9.81, 0.0);

/// What a block is like.
#[derive(Clone, Copy)]
struct Block {
    at: Vec3,
    mass: f32,
    stiffness: f32,
    drag: f32,
    solver: Solver,
}

impl Block {
    const CALM: Self = Self {
        at: Vec3::ZERO,
        mass: 0.1,
        stiffness: 2000.0,
        drag: 10.0,
        solver: Solver::Verlet,
    };

    fn mesh(&self) -> Mesh {
        moved(Mesh::block([SIZE; 3], [CELLS; 3]).expect("a block"), self.at)
    }

    fn put(&self, world: &mut World) -> BodyId {
        let mesh = self.mesh();
        let node_mass = self.mass / mesh.positions.len() as f32;
        world
            .create_body(&BodyDefinition {
                positions: &mesh.positions,
                masses: Values::Uniform(node_mass),
                node_dampings: Values::Uniform(self.drag * node_mass),
                stiffnesses: Values::Uniform(self.stiffness),
                triangles: &mesh.triangles,
                tetrahedra: &mesh.tetrahedra,
                solver: self.solver,
                ..Default::default()
            })
            .expect("a body")
    }
}

/// The nodes of a block at rest with this height above its middle.
fn nodes_at(mesh: &Mesh, is_one: impl Fn(Vec3) -> bool) -> Vec<u32> {
    let nodes = (0..).zip(&mesh.positions).filter(|(_, position)| is_one(**position));
    nodes.map(|(node, _)| node).collect()
}

/// A block that hangs by some nodes of its top from the bottom of another, whose top is pinned.
struct Hanging {
    world: World,
    above: BodyId,
    below: BodyId,
    pinned: Vec<u32>,
    pairs: Vec<[u32; 2]>,
    ids: Vec<AttachmentId>,
}

impl Hanging {
    fn new(above: Block, below: Block, count: usize, gravity: Vec3) -> Self {
        let mut world = world(gravity);
        let half = SIZE / 2.0;
        let above = Block {
            at: Vec3::new(0.0, half, 0.0),
            ..above
        };
        let below = Block {
            at: Vec3::new(0.0, -half, 0.0),
            ..below
        };
        let meshes = [above.mesh(), below.mesh()];
        let bodies = [above.put(&mut world), below.put(&mut world)];
        let pinned = nodes_at(&meshes[0], |place| place.y > SIZE - 1e-4);
        pin_all(&mut world, bodies[0], &pinned);
        let corner = |place: Vec3| place.x.abs() > half - 1e-4 && place.z.abs() > half - 1e-4;
        let chosen = |place: Vec3| {
            place.y.abs() < 1e-4
                && match count {
                    1 => place.x.abs() < 1e-4 && place.z.abs() < 1e-4,
                    4 => corner(place),
                    _ => true,
                }
        };
        let [first, second] = [0, 1].map(|index| nodes_at(&meshes[index], chosen));
        assert_eq!([first.len(), second.len()], [count; 2]);
        let anchors = |nodes: &[u32]| nodes.iter().copied().map(Anchor::Node).collect::<Vec<_>>();
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

    fn drift(&self) -> f32 {
        let [above, below] = [self.above, self.below].map(|id| body(&self.world, id).positions());
        let apart = |&[a, b]: &[u32; 2]| above[a as usize].distance(below[b as usize]);
        self.pairs.iter().map(apart).fold(0.0, f32::max)
    }

    fn force(&self) -> DVec3 {
        let force = |&id: &AttachmentId| self.world.attachment_force(id).expect("a force").as_dvec3();
        self.ids.iter().map(force).sum()
    }
}

#[test]
fn a_block_hangs_from_another() {
    for [upper, lower] in [[0.01, 1.0], [1.0, 0.01]] {
        for solvers in [
            [Solver::Verlet; 2],
            [Solver::Implicit; 2],
            [Solver::Verlet, Solver::Implicit],
            [Solver::Implicit, Solver::Verlet],
        ] {
            for dt in [1e-3, 1.0 / 60.0] {
                for count in [1, 4, 25] {
                    let start = std::time::Instant::now();
                    let mut hanging = Hanging::new(
                        Block {
                            mass: upper,
                            solver: solvers[0],
                            ..Block::CALM
                        },
                        Block {
                            mass: lower,
                            solver: solvers[1],
                            ..Block::CALM
                        },
                        count,
                        DOWN,
                    );
                    let mut drift = 0.0_f32;
                    for _ in 0..(2.0 / dt) as u32 {
                        hanging.world.step(dt).expect("a step");
                        drift = drift.max(hanging.drift());
                    }
                    let weight = 9.81 * f64::from(lower);
                    let error = (hanging.force().y - weight) / weight;
                    let fastest = [hanging.above, hanging.below].map(|id| {
                        let velocities = body(&hanging.world, id).velocities();
                        velocities.iter().fold(0.0_f32, |most, v| most.max(v.length()))
                    });
                    println!(
                        "{upper}:{lower} {solvers:?} {dt} {count}: drift {:.1e} most {:.1e}, force off by {error:.1e}, speeds {fastest:?}, {:.1} s",
                        hanging.drift() / SIZE,
                        drift / SIZE,
                        start.elapsed().as_secs_f64()
                    );
                }
            }
        }
    }
}
