//! A caller that uses the whole API, identically in several worlds, which must return the same results.

use std::collections::BTreeMap;
use std::fmt::Debug;

use glam::{Quat, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{
    Anchor, AttachmentId, BladeDefinition, BladeId, Body, BodyContact, BodyDefinition, BodyId, CollisionFilter,
    Detection, Error, Material, Model, Pose, RestStateDefinition, Result, Shape, Sleep, Solver, SpringLaw, Storage,
    SurfacePoint, SutureDefinition, Tearing, ToolDefinition, ToolId, Values, Viscosity, World, Yielding,
};

/// A linear congruential generator; its upper bits are used.
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    pub fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * (self.next() as f32 / (1_u64 << 31) as f32)
    }

    fn vector(&mut self, size: f32) -> Vec3 {
        vec3(
            self.between(-size, size),
            self.between(-size, size),
            self.between(-size, size),
        )
    }

    fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }
}

/// The objects it has created, and the number of successes of each action.
pub struct Caller {
    pub random: Random,
    pub done: BTreeMap<&'static str, usize>,
    /// Lets this many allocations succeed and the others fail; `None`: all succeed.
    pub scarce: Option<fn(Option<usize>)>,
    /// The number of failed calls.
    pub failed: usize,
    bodies: Vec<BodyId>,
    tools: Vec<ToolId>,
    attachments: Vec<AttachmentId>,
    sutures: Vec<AttachmentId>,
    blades: Vec<BladeId>,
}

/// Returns the common result of all worlds.
fn agreed_result<T: Debug>(worlds: &mut [World], ask: impl Fn(&mut World) -> T) -> T {
    let mut answers: Vec<T> = worlds.iter_mut().map(ask).collect();
    let first = answers.remove(0);
    let first_text = format!("{first:?}");
    for answer in answers {
        assert_eq!(first_text, format!("{answer:?}"));
    }
    first
}

/// Returns a square meter of tissue in the plane, or a block of it.
fn mesh(random: &mut Random) -> Mesh {
    let cells = [0; 3].map(|_| 2 + random.below(2) as u32);
    match random.below(3) {
        0 => Mesh::block([0.1; 3], cells),
        _ => Mesh::cloth([0.1; 2], [2 * cells[0], 2 * cells[1]]),
    }
    .expect("a mesh")
}

impl Caller {
    pub fn new(seed: u64) -> Self {
        Self {
            random: Random(seed),
            done: BTreeMap::new(),
            scarce: None,
            failed: 0,
            bodies: Vec::new(),
            tools: Vec::new(),
            attachments: Vec::new(),
            sutures: Vec::new(),
            blades: Vec::new(),
        }
    }

    /// Returns the common result of an action in all worlds. If allocations can fail, the first world is first called
    /// with too few of them, which must change nothing. Calls that are refused anyway are not tested this way: their
    /// error messages need memory.
    fn call<T: Debug>(&mut self, worlds: &mut [World], act: impl Fn(&mut World) -> Result<T>) -> Result<T> {
        let Some(scarce) = self.scarce else {
            return agreed_result(worlds, act);
        };
        let [world] = worlds else {
            unreachable!("memory is made scarce for one world alone");
        };
        let bytes = world.save().expect("bytes");
        let mut twin = World::load(&bytes, 1, None).expect("a world");
        let expected = act(&mut twin);
        if expected.is_err() {
            return act(world);
        }
        let hash = world.state_hash();
        // First in a fresh copy each time, then in the same world, which keeps earlier allocations and so needs fewer.
        for is_copied in [true, false] {
            for requests in 0.. {
                let mut copy;
                let target = if is_copied {
                    copy = World::load(&bytes, 1, None).expect("a world");
                    &mut copy
                } else {
                    &mut *world
                };
                scarce(Some(requests));
                let answer = act(target);
                scarce(None);
                if !matches!(answer, Err(Error::OutOfMemory)) {
                    assert_eq!(format!("{answer:?}"), format!("{expected:?}"));
                    assert_eq!(target.state_hash(), twin.state_hash());
                    if is_copied {
                        break;
                    }
                    return answer;
                }
                assert_eq!(target.state_hash(), hash, "request {requests}");
                self.failed += 1;
            }
        }
        unreachable!("memory is enough at some time")
    }

    fn record<T>(&mut self, what: &'static str, answer: &Result<T>) {
        *self.done.entry(what).or_default() += usize::from(answer.is_ok());
    }

    /// Performs one action.
    pub fn act(&mut self, worlds: &mut [World]) {
        if self.bodies.len() < 2 {
            return self.make_body(worlds);
        }
        match self.random.below(24) {
            0 if self.bodies.len() < 4 => self.make_body(worlds),
            0 if self.random.one_in(3) => {
                let body = self.bodies.swap_remove(self.random.below(self.bodies.len()));
                let answer = self.call(worlds, |world| world.destroy_body(body));
                self.record("a body destroyed", &answer);
            }
            1 if self.tools.len() < 3 => self.make_tool(worlds),
            1 | 2 if !self.tools.is_empty() => {
                let tool = self.random.of(&self.tools);
                // Slowly: fast bodies collide with everything, which takes long.
                let (displacement, turn) = (self.random.vector(0.003), self.random.between(-0.1, 0.1));
                let answer = self.call(worlds, |world| {
                    let pose = world.tool_target(tool)?;
                    let turned = pose.orientation * Quat::from_rotation_z(turn);
                    world.set_pose(tool, pose.position + displacement, Some(turned))
                });
                self.record("a pose", &answer);
            }
            3 if !self.tools.is_empty() && self.random.one_in(4) => {
                let tool = self.tools.swap_remove(self.random.below(self.tools.len()));
                let answer = self.call(worlds, |world| world.destroy_tool(tool));
                self.record("a tool destroyed", &answer);
            }
            4 | 5 => self.cut(worlds),
            6 if self.blades.is_empty() => {
                let mut definition = BladeDefinition::new([Vec3::ZERO, vec3(0.0, 0.06, 0.0)]);
                definition.pose.position = self.random.vector(0.1);
                let answer = self.call(worlds, |world| world.create_blade(&definition));
                self.record("a blade", &answer);
                self.blades.extend(answer);
            }
            6 | 7 if !self.blades.is_empty() => {
                let (place, blade) = (self.random.vector(0.05), self.blades[0]);
                let answer = self.call(worlds, |world| world.set_blade_pose(blade, place, None));
                self.record("a blade led", &answer);
            }
            8 | 9 => self.attach(worlds),
            10 => self.attach_suture(worlds),
            11 => {
                if let Some(attachment) = self.attachments.pop() {
                    let answer = self.call(worlds, |world| world.release(attachment));
                    self.record("a release", &answer);
                }
            }
            12 => {
                if let Some(&suture) = self.sutures.last() {
                    let length = self.random.between(0.0, 0.05);
                    let answer = self.call(worlds, |world| world.set_suture_length(suture, length));
                    self.record("a suture drawn", &answer);
                }
            }
            13 => {
                let gravity = self.random.vector(9.81);
                let answer = self.call(worlds, |world| world.set_gravity(gravity));
                self.record("gravity", &answer);
            }
            _ => self.change_body(worlds),
        }
    }

    fn make_body(&mut self, worlds: &mut [World]) {
        let random = &mut self.random;
        let mesh = mesh(random);
        let is_solid = !mesh.tetrahedra.is_empty();
        let shift = random.vector(0.06);
        let positions: Vec<Vec3> = mesh.positions.iter().map(|&place| place + shift).collect();
        let material = random.one_in(2).then(|| Material {
            model: if is_solid && random.one_in(2) {
                Model::Tetrahedra
            } else {
                Model::Springs
            },
            young_modulus: random.between(1e3, 1e4),
            poisson_ratio: if is_solid { 0.25 } else { 1.0 / 3.0 },
            density: 1000.0,
            thickness: if is_solid { 0.0 } else { 2e-3 },
        });
        let sometimes = |random: &mut Random, value: f32| if random.one_in(4) { value } else { 0.0 };
        let definition = BodyDefinition {
            positions: &positions,
            rest_positions: random.one_in(3).then_some(&mesh.positions),
            triangles: &mesh.triangles,
            tetrahedra: &mesh.tetrahedra,
            masses: Values::Uniform(random.between(1e-3, 3e-3)),
            stiffnesses: Values::Uniform(if material.is_some() {
                0.0
            } else {
                random.between(5.0, 30.0)
            }),
            material,
            node_dampings: Values::Uniform(random.between(1e-3, 1e-2)),
            spring_dampings: Values::Uniform(sometimes(random, 1e-2)),
            volume_stiffness: if is_solid { sometimes(random, 1e4) } else { 0.0 },
            home_stiffnesses: Values::Uniform(sometimes(random, 0.1)),
            bending_stiffness: sometimes(random, 1e-6),
            strain_limit: sometimes(random, 0.3),
            enclosed_stiffness: sometimes(random, 100.0),
            pressure: sometimes(random, 10.0),
            spring_law: if random.one_in(5) {
                SpringLaw::Cubic {
                    quadratic: 0.5,
                    cubic: 1.0,
                    limit: 0.5,
                }
            } else {
                SpringLaw::Linear
            },
            viscosity: Viscosity {
                retardation_time: sometimes(random, 0.01),
                relaxation_time: sometimes(random, 0.1),
            },
            yielding: Yielding {
                strain: sometimes(random, 0.1),
                ..Yielding::default()
            },
            solver: random.of(&[Solver::Verlet, Solver::Implicit, Solver::Newton]),
            storage: random.of(&[
                Storage::Packed,
                Storage::Packed,
                Storage::Efficient,
                Storage::FastLink,
                Storage::DynamicBulk,
            ]),
            springs_per_node: 60,
            mass_scaling: random.of(&[0.0, 0.001, 0.05]),
            sleep: Sleep {
                speed: sometimes(random, 0.01),
                time: 0.02,
            },
            spare_nodes: random.of(&[0, 300, 300]),
            tearing: Tearing {
                strain: sometimes(random, 0.15),
                most_per_step: 2,
                ..Tearing::default()
            },
            toughness: sometimes(random, 0.01),
            contact: BodyContact {
                with_bodies: random.one_in(4),
                with_itself: random.one_in(10),
                thickness: 1e-3,
                friction: sometimes(random, 0.3),
                detection: random.of(&[Detection::Exact, Detection::Exact, Detection::ImageSpace]),
                ..BodyContact::default()
            },
            ..BodyDefinition::default()
        };
        // Many settings conflict: then the remainder is used.
        let plain = BodyDefinition {
            viscosity: Viscosity::default(),
            yielding: Yielding::default(),
            tearing: Tearing::default(),
            enclosed_stiffness: 0.0,
            pressure: 0.0,
            spare_nodes: 0,
            ..definition
        };
        let plainest = BodyDefinition {
            contact: BodyContact::default(),
            spring_law: SpringLaw::Linear,
            strain_limit: 0.0,
            bending_stiffness: 0.0,
            volume_stiffness: 0.0,
            spare_nodes: 300,
            toughness: 0.0,
            ..plain
        };
        for (what, definition) in [
            ("a body", definition),
            ("a plainer body", plain),
            ("a plain body", plainest),
        ] {
            let answer = self.call(worlds, |world| world.create_body(&definition));
            self.record(what, &answer);
            if let Ok(body) = answer {
                if definition
                    .material
                    .is_some_and(|material| material.model != Model::Springs)
                {
                    self.record("elements", &Ok(()));
                }
                self.bodies.push(body);
                for node in [0, 1] {
                    agreed_result(worlds, |world| world.body_mut(body)?.pin(node)).expect("a pin");
                }
                return;
            }
        }
    }

    fn make_tool(&mut self, worlds: &mut [World]) {
        let random = &mut self.random;
        let mesh = Mesh::block([0.02, 0.05, 0.02], [1, 2, 1]).expect("a mesh");
        // Tools share meshes by the standard library's `Arc`, whose allocation cannot fail gracefully.
        let is_scarce = self.scarce.is_some();
        let shape = match random.below(if is_scarce { 3 } else { 4 }) {
            0 => Shape::Sphere { radius: 0.015 },
            1 => Shape::Capsule {
                radius: 0.01,
                half_length: 0.03,
            },
            2 => Shape::Plane,
            _ => Shape::Mesh {
                positions: &mesh.positions,
                triangles: &mesh.triangles,
            },
        };
        let is_mesh = matches!(shape, Shape::Mesh { .. });
        let definition = ToolDefinition {
            detection: match random.below(3) {
                0 if is_mesh => Detection::DistanceField,
                1 if !is_scarce => Detection::ImageSpace,
                _ => Detection::Exact,
            },
            resolution: 2e-3,
            friction: random.of(&[0.0, 0.4]),
            force_limit: random.of(&[f32::INFINITY, 0.5]),
            pose: Pose {
                position: random.vector(0.05),
                ..Pose::IDENTITY
            },
            ..ToolDefinition::new(shape)
        };
        let plain = ToolDefinition {
            detection: Detection::Exact,
            resolution: 0.0,
            ..definition
        };
        for definition in [definition, plain] {
            let answer = self.call(worlds, |world| world.create_tool(&definition));
            self.record("a tool", &answer);
            if let Ok(tool) = answer {
                self.tools.push(tool);
                return;
            }
        }
    }

    fn cut(&mut self, worlds: &mut [World]) {
        let (body, random) = (self.random.of(&self.bodies), &mut self.random);
        let places = worlds[0].body(body).expect("a body").positions();
        let middle = places.iter().copied().sum::<Vec3>() / places.len() as f32;
        let (along, displacement) = (vec3(0.0, random.between(0.03, 0.1), 0.03), random.vector(0.06));
        let from = middle - 0.5 * along + random.vector(0.03);
        let sweep = Sweep {
            start: [from, from + along],
            end: [from + displacement, from + along + displacement],
        };
        let answer = self.call(worlds, |world| world.cut(body, &sweep));
        self.record("a cut", &answer);
    }

    fn node(&mut self, world: &World, body: BodyId) -> u32 {
        let count = world.body(body).map_or(1, Body::node_count);
        self.random.below(count) as u32
    }

    fn anchor(&mut self, world: &World, body: BodyId) -> Anchor {
        let triangles = world.body(body).expect("a body").surface().len();
        if triangles == 0 || self.random.one_in(3) {
            return Anchor::Node(self.node(world, body));
        }
        Anchor::Point(SurfacePoint {
            triangle: self.random.below(triangles) as u32,
            weights: [0.5, 0.25, 0.25],
        })
    }

    fn attach(&mut self, worlds: &mut [World]) {
        let body = self.random.of(&self.bodies);
        let limit = self.random.of(&[f32::INFINITY, 0.2]);
        let answer = if self.random.one_in(2) && !self.tools.is_empty() {
            let (node, tool) = (self.node(&worlds[0], body), self.random.of(&self.tools));
            self.call(worlds, |world| world.attach_node(body, node, tool, limit))
                .map(|one| vec![one])
        } else {
            let other = self.random.of(&self.bodies);
            let anchors = [self.anchor(&worlds[0], body)];
            let others = [self.anchor(&worlds[0], other)];
            agreed_result(worlds, |world| {
                world.attach_to_body(body, &anchors, other, &others, limit)
            })
        };
        self.record("an attachment", &answer);
        self.attachments.extend(answer.into_iter().flatten());
    }

    fn attach_suture(&mut self, worlds: &mut [World]) {
        let [body, other] = [0; 2].map(|_| self.random.of(&self.bodies));
        let anchors = [self.anchor(&worlds[0], body), self.anchor(&worlds[0], other)];
        let definition = SutureDefinition {
            stiffness: self.random.of(&[30.0, f32::INFINITY]),
            length: self.random.of(&[None, Some(0.02)]),
            force_limit: self.random.of(&[f32::INFINITY, 0.3]),
        };
        let answer = self.call(worlds, |world| {
            world.suture(body, &anchors[0], other, &anchors[1], &definition)
        });
        self.record("a suture", &answer);
        self.sutures.extend(answer);
    }

    fn change_body(&mut self, worlds: &mut [World]) {
        let id = self.random.of(&self.bodies);
        let [a, b] = [0; 2].map(|_| self.node(&worlds[0], id));
        let vector = self.random.vector(0.02);
        let number = self.random.between(0.1, 1.0);
        let kind = self.random.below(12);
        let answer = self.call(worlds, |world| {
            let body = world.body_mut(id)?;
            match kind {
                0 => body.pin(a),
                1 => body.pin_axes(a, [true, false, true]),
                2 => body.unpin(a),
                3 => {
                    let place = body.positions()[a as usize] + 0.1 * vector;
                    body.move_pin(a, place)
                }
                4 => body.add_spring(a, b, 20.0 * number, None),
                5 => {
                    let pairs = body.spring_pairs()?;
                    let [a, b] = pairs.get(a as usize % pairs.len().max(1)).copied().unwrap_or([0, 0]);
                    body.remove_spring(a, b)
                }
                6 => {
                    let pairs = body.spring_pairs()?;
                    let some = &pairs[..pairs.len().min(5)];
                    body.set_springs(some, Some(Values::Uniform(30.0 * number)), None)
                }
                7 => body.scale_region(&[a, b], number, 1.0),
                8 => {
                    let mut velocities = Vec::new();
                    velocities.try_reserve_exact(body.node_count())?;
                    velocities.extend(body.velocities().iter().map(|&velocity| velocity + vector));
                    body.set_velocities(&velocities)
                }
                9 => body.set_pressure(20.0 * number),
                10 => {
                    body.set_collision_filter(CollisionFilter {
                        category: 1 << (a % 3),
                        mask: u32::MAX,
                    });
                    Ok(())
                }
                _ => body.apply_force(a, vector),
            }
        });
        const KINDS: [&str; 12] = [
            "a pin",
            "a pin along axes",
            "a pin let go",
            "a pin moved",
            "a spring added",
            "a spring removed",
            "springs set",
            "a region scaled",
            "velocities",
            "pressure",
            "a filter",
            "a force",
        ];
        self.record(KINDS[kind], &answer);
        if self.random.one_in(40) {
            let answer = self.call(worlds, |world| {
                world.rest_state(id, &RestStateDefinition::default()).map(|_| ())
            });
            self.record("a state of rest", &answer);
        }
    }

    /// Steps, and compares all readable state.
    pub fn step(&mut self, worlds: &mut [World]) {
        let dt = self.random.of(&[1e-3, 2e-3]);
        if let Some(scarce) = self.scarce {
            // Cuts and tears are left out here: they do not fail a step.
            let (world, requests) = (&mut worlds[0], self.random.below(10));
            let hash = world.state_hash();
            scarce(Some(requests));
            let answer = world.step(dt);
            scarce(None);
            assert!(answer.is_ok() || world.state_hash() == hash, "{answer:?}");
        }
        let answer = agreed_result(worlds, |world| world.step(dt));
        self.record("a step", &answer);
        agreed_result(worlds, |world| world.state_hash());
        for &id in &self.bodies {
            agreed_result(worlds, |world| {
                let body = world.body(id).expect("a body");
                let bits = |vectors: &[Vec3]| -> Vec<[u32; 3]> {
                    vectors
                        .iter()
                        .map(|vector| vector.to_array().map(f32::to_bits))
                        .collect()
                };
                let read = (
                    bits(body.positions()),
                    bits(body.velocities()),
                    body.surface().to_vec(),
                    body.spring_pairs(),
                );
                xxhash(&format!("{read:?}"))
            });
            agreed_result(worlds, |world| {
                let gravity = world.gravity();
                let body = world.body(id).expect("a body");
                let changes = format!("{:?}", body.changes_since(0));
                let pieces = format!("{:?}", body.pieces());
                let reports = (
                    body.storage_report(),
                    body.solver_report(),
                    body.enclosed(),
                    body.tear_report(),
                );
                (
                    body.energy(gravity),
                    reports,
                    body.awake_share(),
                    xxhash(&changes),
                    xxhash(&pieces),
                )
            });
        }
        for &tool in &self.tools {
            agreed_result(worlds, |world| {
                let contacts: Vec<_> = world.contacts(tool).expect("a tool").collect();
                format!(
                    "{:?} {:?} {:?} {contacts:?}",
                    world.wrench(tool),
                    world.pose(tool),
                    world.tool_target(tool)
                )
            });
        }
        for &blade in &self.blades {
            agreed_result(worlds, |world| format!("{:?}", world.blade_report(blade)));
        }
        agreed_result(worlds, |world| {
            (world.slipped().to_vec(), world.contact_changes().collect::<Vec<_>>())
        });
        for &held in self.attachments.iter().chain(&self.sutures) {
            agreed_result(worlds, |world| {
                format!("{:?} {:?}", world.attachment_force(held), world.suture_report(held))
            });
        }
    }
}

/// A short stand-in for a long text.
fn xxhash(text: &str) -> u64 {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    text.hash(&mut hasher);
    hasher.finish()
}
