//! A soak test of a million frames: bodies and tools are created, destroyed, pushed, attached, cut and torn.
//!
//! `cargo bench --bench soak` takes some minutes; `-- 50000` sets the number of frames. It fails if a readable value is
//! not finite, or if a step fails unexpectedly. It fails if a frame gains a tenth of the present energy beyond the work
//! of tools and forces. It fails if an emptied world uses over a hundredth more memory in the second half than in the
//! first. `-- --planted` keeps a body of each tenth, and must fail.
#![allow(clippy::print_stderr)]

#[path = "bill/allocator.rs"]
mod allocator;

use std::io::{IsTerminal, Write};
use std::process::ExitCode;

use glam::Vec3;
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{
    BodyContact, BodyDefinition, BodyId, Error, Pose, Shape, Sleep, Solver, Storage, Tearing, ToolDefinition, ToolId,
    Values, World, WorldDefinition,
};

const FRAMES: u32 = 1_000_000;

const TENTHS: u32 = 10;

/// Number of simultaneous bodies and tools.
const BODIES: usize = 4;
const TOOLS: usize = 3;

/// The largest energy a frame may gain, relative to kinetic and elastic energy and work. The energy of VERLET
/// oscillates, and jumps by up to as much if a spring of a coarse cloth passes through zero length
/// (`docs/guide/limits.md`).
const GAIN: f64 = 0.1;

/// Nodes below this index are attached to tools. Forces act on other nodes, since they have no effect on attached ones.
const ATTACHED_NODES: usize = 6;

/// Marsaglia's xorshift, 2003.
struct Xorshift(u64);

impl Xorshift {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 >> 11
    }

    /// A random integer below `count`.
    fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    /// A random number between -1 and 1.
    fn number(&mut self) -> f32 {
        self.next() as f32 / (1_u64 << 52) as f32 - 1.0
    }

    fn vector(&mut self, most: f32) -> Vec3 {
        most * Vec3::new(self.number(), self.number(), self.number())
    }
}

/// Event counts for the report.
#[derive(Debug, Default)]
struct Counts {
    bodies: u32,
    cuts: u32,
    refused: u32,
    attachments: u32,
    restored: u32,
    unstable: u32,
    watched: u32,
    most_gained: f64,
}

/// State at the start of a frame.
#[derive(Debug, Default)]
struct Start {
    /// The kinetic and elastic energy, and the total with gravitational energy [J].
    energy: [f64; 2],
    tools: Vec<Vec3>,
    /// A node, the force on it, and its position.
    force: Option<(BodyId, u32, Vec3, Vec3)>,
}

struct Soak {
    world: World,
    bodies: Vec<BodyId>,
    tools: Vec<ToolId>,
    /// Bodies and tools that were created in occupied space: contact pushes them out, which adds energy.
    crowded: (Vec<BodyId>, Vec<ToolId>),
    start: Start,
    random: Xorshift,
    counts: Counts,
}

impl Soak {
    fn new() -> Self {
        let definition = WorldDefinition {
            max_substeps: 400,
            ..WorldDefinition::default()
        };
        Self {
            world: World::new(definition).expect("a world"),
            bodies: Vec::new(),
            tools: Vec::new(),
            crowded: Default::default(),
            start: Start::default(),
            random: Xorshift(88_172_645_463_325_252),
            counts: Counts::default(),
        }
    }

    fn create_body(&mut self) {
        let random = &mut self.random;
        let is_solid = random.below(3) == 0;
        let spare_nodes = [0, 150][random.below(2)];
        let tearing = if spare_nodes > 0 {
            Tearing {
                strain: 1.5,
                most_per_step: 2,
                ..Tearing::default()
            }
        } else {
            Tearing::default()
        };
        let mesh = if is_solid {
            Mesh::block([0.06; 3], [2, 1, 2])
        } else {
            Mesh::cloth([0.1; 2], [2 + random.below(4) as u32, 4])
        };
        let mut mesh = mesh.expect("a mesh");
        let half = mesh
            .positions
            .iter()
            .fold(Vec3::ZERO, |half, position| half.max(position.abs()));
        let (shift, is_crowded) = self.random_position(0.1, half);
        let random = &mut self.random;
        mesh.positions.iter_mut().for_each(|position| *position += shift);
        let created = self.world.create_body(&BodyDefinition {
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(30.0),
            node_dampings: Values::Uniform(2e-3),
            solver: [Solver::Verlet, Solver::Verlet, Solver::Implicit][random.below(3)],
            storage: [Storage::Packed, Storage::FastLink][random.below(2)],
            spare_nodes,
            tearing,
            sleep: Sleep {
                speed: [0.0, 0.005][random.below(2)],
                time: 0.1,
            },
            contact: BodyContact {
                with_bodies: random.below(2) == 0,
                ..BodyContact::default()
            },
            ..BodyDefinition::of(&mesh)
        });
        let id = created.expect("a body");
        for _ in 0..2 {
            let node = self.random.below(mesh.positions.len()) as u32;
            self.world.body_mut(id).and_then(|body| body.pin(node)).expect("a pin");
        }
        self.bodies.push(id);
        self.crowded.0.extend(is_crowded.then_some(id));
        self.counts.bodies += 1;
    }

    /// A random position for an object of this half extent, mostly in free space, and true if the space may be
    /// occupied.
    fn random_position(&mut self, most: f32, half: Vec3) -> (Vec3, bool) {
        let tries = if self.random.below(16) == 0 { 0 } else { 20 };
        for _ in 0..tries {
            let position = self.random.vector(most);
            if self.is_free(position - half, position + half) {
                return (position, false);
            }
        }
        (self.random.vector(most), true)
    }

    fn is_free(&self, low: Vec3, high: Vec3) -> bool {
        let are_apart = |from: Vec3, to: Vec3| (low.cmpgt(to + 0.003) | high.cmplt(from - 0.003)).any();
        let mut bodies = self
            .bodies
            .iter()
            .map(|&id| self.world.body(id).expect("a body").positions());
        let mut tools = self
            .tools
            .iter()
            .map(|&id| self.world.pose(id).expect("a pose").position);
        let fold =
            |positions: &[Vec3], with: fn(Vec3, Vec3) -> Vec3| positions.iter().copied().reduce(with).expect("a node");
        bodies.all(|positions| are_apart(fold(positions, Vec3::min), fold(positions, Vec3::max)))
            && tools.all(|position| are_apart(position - 0.06, position + 0.06))
    }

    fn create_tool(&mut self) {
        let random = &mut self.random;
        let radius = 0.01 + 0.02 * random.number().abs();
        let shape = match random.below(2) {
            0 => Shape::Sphere { radius },
            _ => Shape::Capsule {
                half_length: 0.03,
                radius,
            },
        };
        let (position, is_crowded) = self.random_position(0.3, Vec3::splat(radius + 0.03));
        let tool = ToolDefinition {
            pose: Pose {
                position,
                ..Pose::IDENTITY
            },
            friction: 0.3,
            ..ToolDefinition::new(shape)
        };
        let id = self.world.create_tool(&tool).expect("a tool");
        self.tools.push(id);
        self.crowded.1.extend(is_crowded.then_some(id));
    }

    /// Applies random actions before a frame.
    fn act(&mut self) {
        self.start.force = None;
        while self.bodies.len() < BODIES {
            self.create_body();
        }
        while self.tools.len() < TOOLS {
            self.create_tool();
        }
        match self.random.below(100) {
            0 if self.bodies.len() == BODIES => {
                let destroyed = self.bodies.swap_remove(self.random.below(BODIES));
                self.world.destroy_body(destroyed).expect("a body");
                self.crowded.0.retain(|&body| body != destroyed);
            }
            1 if self.tools.len() == TOOLS => {
                let destroyed = self.tools.swap_remove(self.random.below(TOOLS));
                self.world.destroy_tool(destroyed).expect("a tool");
                self.crowded.1.retain(|&tool| tool != destroyed);
            }
            2..=4 => {
                let body = self.bodies[self.random.below(self.bodies.len())];
                let (middle, along, down) = (
                    self.random.vector(0.1),
                    self.random.vector(0.1),
                    self.random.vector(0.15),
                );
                let sweep = Sweep {
                    start: [middle - along, middle + along],
                    end: [middle - along + down, middle + along + down],
                };
                match self.world.cut(body, &sweep) {
                    Ok(_) => self.counts.cuts += 1,
                    Err(_) => self.counts.refused += 1,
                }
            }
            5 => {
                let body = self.bodies[self.random.below(self.bodies.len())];
                let tool = self.tools[self.random.below(self.tools.len())];
                let attached = self
                    .world
                    .attach_node(body, self.random.below(ATTACHED_NODES) as u32, tool, 0.5);
                self.counts.attachments += u32::from(attached.is_ok());
            }
            6..=20 => {
                let body = self.bodies[self.random.below(self.bodies.len())];
                let force = self.random.vector(0.2);
                let node = (ATTACHED_NODES + self.random.below(6)) as u32;
                let pushed = self.world.body_mut(body).and_then(|body| {
                    body.apply_force(node, force)?;
                    Ok(body.positions()[node as usize])
                });
                match pushed {
                    Ok(position) => self.start.force = Some((body, node, force, position)),
                    Err(_) => self.counts.refused += 1,
                }
            }
            _ => (),
        }
        for &tool in &self.tools {
            let pose = self.world.pose(tool).expect("a pose");
            let to = (pose.position + self.random.vector(0.004)).clamp(Vec3::splat(-0.2), Vec3::splat(0.2));
            self.world.set_pose(tool, to, None).expect("a pose");
        }
    }

    fn energy(&self) -> [f64; 2] {
        let energies = self.world.bodies().map(|body| body.energy(self.world.gravity()));
        energies.fold([0.0; 2], |[inner, all], energy| {
            let internal = energy.kinetic + energy.elastic;
            [inner + internal, all + internal + energy.gravitational]
        })
    }

    /// Energy gain of a frame beyond the work of tools and forces, relative to the present energy; -infinity while
    /// objects are pushed out.
    fn gain(&self) -> f64 {
        if !self.crowded.0.is_empty() || !self.crowded.1.is_empty() {
            return f64::NEG_INFINITY;
        }
        let position = |&id: &ToolId| self.world.pose(id).expect("a pose").position;
        let force = |&id: &ToolId| self.world.wrench(id).expect("a tool").0;
        let tools = self.tools.iter().zip(&self.start.tools);
        let mut works: Vec<f64> = tools
            .map(|(id, from)| -force(id).as_dvec3().dot((position(id) - *from).as_dvec3()))
            .collect();
        if let Some((body, node, force, from)) = self.start.force {
            let position = self.world.body(body).expect("a body").positions()[node as usize];
            works.push(force.as_dvec3().dot((position - from).as_dvec3()));
        }
        let [inner, all] = self.energy();
        let [inner_before, all_before] = self.start.energy;
        let scale = inner.max(inner_before) + works.iter().map(|work| work.abs()).sum::<f64>();
        (all - all_before - works.iter().sum::<f64>()) / scale.max(f64::MIN_POSITIVE)
    }

    /// Takes a frame. Returns true if all readable values are finite and no energy appears.
    fn frame(&mut self) -> bool {
        self.act();
        self.start.energy = self.energy();
        self.start.tools = self
            .tools
            .iter()
            .map(|&id| self.world.pose(id).expect("a pose").position)
            .collect();
        match self.world.step(1.0 / 60.0) {
            Ok(report) => self.counts.restored += report.bodies_restored,
            // Too many substeps: the world is unchanged.
            Err(Error::Unstable { .. }) => self.counts.unstable += 1,
            Err(error) => panic!("a step: {error}"),
        }
        let gain = self.gain();
        self.counts.watched += u32::from(gain.is_finite());
        self.counts.most_gained = self.counts.most_gained.max(gain);
        let bodies = self.bodies.iter().map(|&id| self.world.body(id).expect("a body"));
        let tools = self.tools.iter().map(|&id| self.world.wrench(id).expect("a tool"));
        gain <= GAIN && { bodies }.all(|body| body.positions().iter().all(|position| position.is_finite())) && { tools }
            .all(|(force, torque)| force.is_finite() && torque.is_finite())
    }

    fn empty(&mut self) {
        self.crowded = Default::default();
        for body in self.bodies.drain(..) {
            self.world.destroy_body(body).expect("a body");
        }
        for tool in self.tools.drain(..) {
            self.world.destroy_tool(tool).expect("a tool");
        }
    }
}

fn main() -> ExitCode {
    let is_planted = std::env::args().any(|argument| argument == "--planted");
    let requested = std::env::args().find_map(|argument| argument.parse().ok());
    let frames: u32 = requested.unwrap_or(FRAMES);
    let before = allocator::allocated();
    let mut soak = Soak::new();
    let mut allocated = Vec::new();
    for tenth in 0..TENTHS {
        for frame in 0..frames / TENTHS {
            if !soak.frame() {
                eprintln!(
                    "frame {frame} of tenth {tenth}: a value is not finite, or energy was gained: {:?}",
                    soak.counts
                );
                return ExitCode::FAILURE;
            }
            if frame % 500 == 0 && std::io::stderr().is_terminal() {
                eprint!("\r{} of {frames} frames", tenth * (frames / TENTHS) + frame);
                let _ = std::io::stderr().flush();
            }
        }
        if is_planted {
            soak.bodies.pop();
        }
        soak.empty();
        allocated.push(allocator::allocated() - before);
    }
    // A world's capacity grows in steps to its largest demand so far, which rises ever more slowly.
    let (early, late) = allocated.split_at(TENTHS as usize / 2);
    let [early, late] = [early, late].map(|bytes| bytes.iter().max().copied().unwrap_or(0));
    eprintln!(
        "\r{frames} frames: {:?}; bytes allocated by an empty world after each tenth: {allocated:?}",
        soak.counts
    );
    if soak.counts.unstable > frames / 100 {
        eprintln!("{} frames were refused: the soak test is invalid", soak.counts.unstable);
        return ExitCode::FAILURE;
    }
    if late > early + early / 100 {
        eprintln!("memory grows: {early} bytes, then {late}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
