//! Calls in any order with any arguments, checked against a simple model. Refused calls change nothing, stale ids stay
//! stale, and springs and pins are those that were created. All readable values stay finite.

use std::collections::BTreeSet;

use arbitrary::{Result, Unstructured};
use glam::{Quat, Vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{
    AttachmentId, BodyContact, BodyDefinition, BodyId, Error, Pose, Shape, Sleep, Solver, Storage, ToolDefinition,
    ToolId, Values, World, WorldDefinition,
};

/// The model of a body.
struct BodyModel {
    id: BodyId,
    exists: bool,
    /// `None` after the first cut, since the model does not predict springs after cuts.
    springs: Option<BTreeSet<[u32; 2]>>,
    pins: BTreeSet<u32>,
}

pub struct Model {
    pub world: World,
    /// A spring of a body with pins was removed: the condition of the planted fault of `calls`.
    pub has_removed: bool,
    bodies: Vec<BodyModel>,
    tools: Vec<(ToolId, bool)>,
    attachments: Vec<AttachmentId>,
}

const STORAGES: [Storage; 5] = [
    Storage::Packed,
    Storage::Packed,
    Storage::Efficient,
    Storage::FastLink,
    Storage::DynamicBulk,
];

/// The limit of most step durations [s].
const LONG: f32 = 0.02;

/// A number as callers pass it: mostly sensible, sometimes special or arbitrary.
fn number(input: &mut Unstructured) -> Result<f32> {
    const ODD: [f32; 12] = [
        0.0,
        -0.0,
        -1.0,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN_POSITIVE,
        1e-30,
        1e30,
        1e9,
        -1e-9,
    ];
    Ok(match input.int_in_range(0..=15)? {
        0 => *input.choose(&ODD)?,
        1 => f32::from_bits(input.arbitrary()?),
        _ => f32::from(input.arbitrary::<i16>()?) * 1e-5,
    })
}

fn vector(input: &mut Unstructured) -> Result<Vec3> {
    Ok(Vec3::new(number(input)?, number(input)?, number(input)?))
}

/// A mostly valid number: above 0 and at most `most`.
fn amount(input: &mut Unstructured, most: f32) -> Result<f32> {
    Ok(if input.ratio(1, 20)? {
        number(input)?
    } else {
        most * f32::from(input.int_in_range(1_u8..=255)?) / 255.0
    })
}

fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Model {
    pub fn new(input: &mut Unstructured) -> Result<Self> {
        let definition = WorldDefinition {
            substeps: *input.choose(&[0, 0, 0, 1, 3])?,
            max_substeps: 32,
            thread_count: *input.choose(&[1, 1, 2])?,
            ..WorldDefinition::default()
        };
        Ok(Self {
            world: World::new(definition).expect("a world"),
            has_removed: false,
            bodies: Vec::new(),
            tools: Vec::new(),
            attachments: Vec::new(),
        })
    }

    fn body(&self, input: &mut Unstructured) -> Result<Option<usize>> {
        Ok(match self.bodies.len() {
            0 => None,
            count => Some(input.choose_index(count)?),
        })
    }

    fn create_body(&mut self, input: &mut Unstructured) -> Result<()> {
        if self.bodies.len() > 5 {
            return Ok(());
        }
        let cells = [input.int_in_range(1..=4)?, input.int_in_range(1..=4)?];
        let mesh = if input.ratio(1, 3)? {
            Mesh::block([0.1; 3], [cells[0], 1, cells[1]])
        } else {
            Mesh::cloth([0.1; 2], cells)
        };
        let mesh = mesh.expect("a mesh");
        let shift = if input.ratio(1, 8)? { vector(input)? } else { Vec3::ZERO };
        let positions: Vec<Vec3> = mesh.positions.iter().map(|position| *position + shift).collect();
        let definition = BodyDefinition {
            positions: &positions,
            triangles: &mesh.triangles,
            tetrahedra: &mesh.tetrahedra,
            masses: Values::Uniform(amount(input, 1e-2)?),
            stiffnesses: Values::Uniform(amount(input, 100.0)?),
            node_dampings: Values::Uniform(amount(input, 1e-2)?),
            spring_dampings: Values::Uniform(if input.ratio(1, 4)? { amount(input, 1e-2)? } else { 0.0 }),
            volume_stiffness: if input.ratio(1, 4)? { amount(input, 1e4)? } else { 0.0 },
            bending_stiffness: if input.ratio(1, 4)? { amount(input, 1e-5)? } else { 0.0 },
            solver: *input.choose(&[Solver::Verlet, Solver::Verlet, Solver::Implicit, Solver::Newton])?,
            storage: *input.choose(&STORAGES)?,
            spare_nodes: *input.choose(&[0, 0, 60])?,
            sleep: Sleep {
                speed: *input.choose(&[0.0, 0.0, 0.01])?,
                time: 0.01,
            },
            contact: BodyContact {
                with_bodies: input.ratio(1, 4)?,
                with_itself: input.ratio(1, 8)?,
                ..BodyContact::default()
            },
            ..BodyDefinition::default()
        };
        let hash = self.world.state_hash();
        match self.world.create_body(&definition) {
            Ok(id) => {
                let springs = self
                    .world
                    .body(id)
                    .and_then(|body| body.spring_pairs())
                    .expect("its springs");
                self.bodies.push(BodyModel {
                    id,
                    exists: true,
                    springs: Some(springs.into_iter().map(ordered).collect()),
                    pins: BTreeSet::new(),
                });
            }
            Err(_) => assert_eq!(self.world.state_hash(), hash, "a refused body changes nothing"),
        }
        Ok(())
    }

    pub fn call(&mut self, input: &mut Unstructured) -> Result<()> {
        let kind = input.int_in_range(0..=21)?;
        if kind == 0 {
            return self.create_body(input);
        }
        let hash = self.world.state_hash();
        let Some(chosen) = self.body(input)? else {
            return self.create_body(input);
        };
        let (id, exists) = (self.bodies[chosen].id, self.bodies[chosen].exists);
        let tool = match self.tools.len() {
            0 => None,
            count => Some(input.choose_index(count)?),
        };
        let nodes = self.world.body(id).map_or(3, |body| body.node_count()) as u32;
        // Indices out of range now and then.
        let [a, b] = [input.int_in_range(0..=nodes)?, input.int_in_range(0..=nodes)?];
        let world = &mut self.world;
        let (model, has_removed) = (&mut self.bodies[chosen], &mut self.has_removed);
        let result: std::result::Result<(), Error> = match kind {
            1 if input.ratio(1, 4)? => world.destroy_body(id).inspect(|()| model.exists = false),
            1 | 2 => {
                let (stiffness, length) = (amount(input, 100.0)?, input.ratio(1, 2)?.then_some(0.05));
                let added = world
                    .body_mut(id)
                    .and_then(|body| body.add_spring(a, b, stiffness, length));
                added.inspect(|()| {
                    let is_new = model
                        .springs
                        .as_mut()
                        .is_none_or(|springs| springs.insert(ordered([a, b])));
                    assert!(is_new, "an existing spring is refused");
                })
            }
            3 => {
                let removed = world.body_mut(id).and_then(|body| body.remove_spring(a, b));
                removed.inspect(|()| {
                    let existed = model
                        .springs
                        .as_mut()
                        .is_none_or(|springs| springs.remove(&ordered([a, b])));
                    assert!(existed, "a missing spring is refused");
                    *has_removed |= !model.pins.is_empty();
                })
            }
            4 => world.body_mut(id).and_then(|body| body.pin(a)).inspect(|()| {
                model.pins.insert(a);
            }),
            5 => world.body_mut(id).and_then(|body| body.unpin(a)).inspect(|()| {
                model.pins.remove(&a);
            }),
            6 => {
                let position = vector(input)?;
                world.body_mut(id).and_then(|body| body.move_pin(a, position))
            }
            7 => {
                let force = vector(input)?;
                world.body_mut(id).and_then(|body| body.apply_force(a, force))
            }
            8 => {
                let change = vector(input)?;
                let positions = world.body(id).map(|body| body.positions().to_vec());
                positions.and_then(|mut positions| {
                    positions[a as usize % nodes as usize] += change;
                    world.body_mut(id)?.set_positions(&positions)
                })
            }
            9 => {
                let (velocity, count) = (vector(input)?, nodes as usize - usize::from(input.ratio(1, 20)?));
                world
                    .body_mut(id)
                    .and_then(|body| body.set_velocities(&vec![velocity; count]))
            }
            10 | 11 => {
                let sweep = Sweep {
                    start: [vector(input)?, vector(input)?],
                    end: [vector(input)?, vector(input)?],
                };
                model.springs = None;
                world.cut(id, &sweep).map(|_| ())
            }
            12 => {
                let radius = amount(input, 0.05)?;
                let shape = match input.int_in_range(0..=2)? {
                    0 => Shape::Sphere { radius },
                    1 => Shape::Plane,
                    _ => Shape::Capsule {
                        half_length: amount(input, 0.05)?,
                        radius,
                    },
                };
                let definition = ToolDefinition {
                    pose: Pose {
                        position: vector(input)?,
                        ..Pose::IDENTITY
                    },
                    friction: if input.ratio(1, 2)? { amount(input, 1.0)? } else { 0.0 },
                    force_limit: if input.ratio(1, 6)? {
                        amount(input, 1.0)?
                    } else {
                        f32::INFINITY
                    },
                    ..ToolDefinition::new(shape)
                };
                if self.tools.len() > 3 {
                    return Ok(());
                }
                world.create_tool(&definition).map(|tool| self.tools.push((tool, true)))
            }
            13 => {
                let Some(tool) = tool else { return Ok(()) };
                let (position, angle) = (vector(input)?, number(input)?);
                let orientation = input.ratio(1, 2)?.then(|| Quat::from_rotation_z(angle));
                world.set_pose(self.tools[tool].0, position, orientation)
            }
            14 if input.ratio(1, 3)? => {
                let Some(tool) = tool else { return Ok(()) };
                let destroyed = world.destroy_tool(self.tools[tool].0);
                destroyed.inspect(|()| self.tools[tool].1 = false)
            }
            14 | 15 => {
                let Some(tool) = tool else { return Ok(()) };
                let limit = if input.ratio(1, 2)? {
                    f32::INFINITY
                } else {
                    amount(input, 1.0)?
                };
                let attached = world.attach_node(id, a, self.tools[tool].0, limit);
                attached.map(|attachment| self.attachments.push(attachment))
            }
            16 => match self.attachments.pop() {
                Some(attachment) => world.release(attachment),
                None => Ok(()),
            },
            17 => world.set_gravity(vector(input)?),
            _ => {
                let dt = amount(input, 0.02)?;
                // Near contact, IMPLICIT and NEWTON take substeps of fractions of a millisecond, thousands per long
                // step. All but one in 64 long steps are shortened.
                let dt = if dt > LONG && !input.ratio(1, 64)? { LONG } else { dt };
                world.step(dt).map(|_| ())
            }
        };
        if let Err(error) = &result {
            assert_eq!(
                self.world.state_hash(),
                hash,
                "a refused call ({error}) changed the state"
            );
            assert!(!error.to_string().is_empty());
        }
        if !exists && (1..=11).contains(&kind) {
            assert!(
                matches!(result, Err(Error::StaleId(_))),
                "{result:?} of a destroyed body"
            );
        }
        self.check();
        Ok(())
    }

    /// Checks all readable values.
    fn check(&self) {
        for model in &self.bodies {
            let body = self.world.body(model.id);
            assert_eq!(body.is_ok(), model.exists, "an id stays valid or stale");
            let Ok(body) = body else { continue };
            assert!(
                body.positions().iter().all(|position| position.is_finite()),
                "a position is not finite"
            );
            if let Some(springs) = &model.springs {
                let actual: BTreeSet<[u32; 2]> =
                    body.spring_pairs().expect("springs").into_iter().map(ordered).collect();
                assert_eq!(&actual, springs, "springs are those that were created");
            }
            for &pin in &model.pins {
                assert!(body.pin_force(pin).expect("a pin remains").is_finite());
            }
            let count = body.node_count() as u32;
            assert!(body.surface().iter().flatten().all(|&node| node < count));
        }
        for &(tool, exists) in &self.tools {
            let wrench = self.world.wrench(tool);
            assert_eq!(wrench.is_ok(), exists, "an id stays valid or stale");
            if let Ok((force, torque)) = wrench {
                assert!(force.is_finite() && torque.is_finite());
            }
        }
    }
}
