//! A million frames: bodies and tools that come and go, are pushed, held, cut and torn, for as long as a day of play.
//!
//! `cargo bench --bench soak` (some minutes; `-- 50000`: so many frames) fails where anything that can be read is not finite, a step fails that should not, a
//! frame gains a tenth of the energy there is beyond what tools and forces put in, or the memory of a world that was emptied is larger in the second half than in the first by more than a hundredth. `-- --planted` keeps a body of each tenth, and must fail.
#![allow(clippy::print_stderr)]

#[path = "bill/held.rs"]
mod held;

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

/// How many bodies there are at once, and tools.
const BODIES: usize = 4;
const TOOLS: usize = 3;

/// So much energy a frame may have gained from nowhere, as a part of what is kinetic, elastic or was put in: that of VERLET oscillates, and
/// jumps by up to as much where a spring of a coarse cloth passes through no length (`docs/guide/limits.md`).
const GAIN: f64 = 0.1;

/// Nodes below this are attached to tools; forces act on others, since one on a node that is held does nothing.
const HELD: usize = 6;

/// Marsaglia's xorshift, 2003.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 >> 11
    }

    /// Below a number.
    fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    /// Between -1 and 1.
    fn number(&mut self) -> f32 {
        self.next() as f32 / (1_u64 << 52) as f32 - 1.0
    }

    fn vector(&mut self, most: f32) -> Vec3 {
        most * Vec3::new(self.number(), self.number(), self.number())
    }
}

/// What happened, to be told.
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

/// What a frame began with.
#[derive(Debug, Default)]
struct Start {
    /// J, all that is kinetic or elastic, and that with the gravitational.
    energy: [f64; 2],
    tools: Vec<Vec3>,
    /// A force on a node, and where that is.
    force: Option<(BodyId, u32, Vec3, Vec3)>,
}

struct Play {
    world: World,
    bodies: Vec<BodyId>,
    tools: Vec<ToolId>,
    /// What was made where something was already: it is pushed out, which takes energy.
    crowded: (Vec<BodyId>, Vec<ToolId>),
    start: Start,
    dice: Dice,
    counts: Counts,
}

impl Play {
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
            dice: Dice(88_172_645_463_325_252),
            counts: Counts::default(),
        }
    }

    fn create_body(&mut self) {
        let dice = &mut self.dice;
        let is_solid = dice.below(3) == 0;
        let spare_nodes = [0, 150][dice.below(2)];
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
            Mesh::cloth([0.1; 2], [2 + dice.below(4) as u32, 4])
        };
        let mut mesh = mesh.expect("a mesh");
        let half = mesh
            .positions
            .iter()
            .fold(Vec3::ZERO, |half, place| half.max(place.abs()));
        let (shift, is_crowded) = self.place(0.1, half);
        let dice = &mut self.dice;
        mesh.positions.iter_mut().for_each(|place| *place += shift);
        let created = self.world.create_body(&BodyDefinition {
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(30.0),
            node_dampings: Values::Uniform(2e-3),
            solver: [Solver::Verlet, Solver::Verlet, Solver::Implicit][dice.below(3)],
            storage: [Storage::Packed, Storage::FastLink][dice.below(2)],
            spare_nodes,
            tearing,
            sleep: Sleep {
                speed: [0.0, 0.005][dice.below(2)],
                time: 0.1,
            },
            contact: BodyContact {
                with_bodies: dice.below(2) == 0,
                ..BodyContact::default()
            },
            ..BodyDefinition::of(&mesh)
        });
        let id = created.expect("a body");
        for _ in 0..2 {
            let node = self.dice.below(mesh.positions.len()) as u32;
            self.world.body_mut(id).and_then(|body| body.pin(node)).expect("a pin");
        }
        self.bodies.push(id);
        self.crowded.0.extend(is_crowded.then_some(id));
        self.counts.bodies += 1;
    }

    /// A place for what reaches so far from its middle, mostly one where nothing is yet; and whether something may be.
    fn place(&mut self, most: f32, half: Vec3) -> (Vec3, bool) {
        let tries = if self.dice.below(16) == 0 { 0 } else { 20 };
        for _ in 0..tries {
            let place = self.dice.vector(most);
            if self.is_free(place - half, place + half) {
                return (place, false);
            }
        }
        (self.dice.vector(most), true)
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
        let fold = |places: &[Vec3], with: fn(Vec3, Vec3) -> Vec3| places.iter().copied().reduce(with).expect("a node");
        bodies.all(|places| are_apart(fold(places, Vec3::min), fold(places, Vec3::max)))
            && tools.all(|place| are_apart(place - 0.06, place + 0.06))
    }

    fn create_tool(&mut self) {
        let dice = &mut self.dice;
        let radius = 0.01 + 0.02 * dice.number().abs();
        let shape = match dice.below(2) {
            0 => Shape::Sphere { radius },
            _ => Shape::Capsule {
                half_length: 0.03,
                radius,
            },
        };
        let (position, is_crowded) = self.place(0.3, Vec3::splat(radius + 0.03));
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

    /// What somebody does before a frame.
    fn act(&mut self) {
        self.start.force = None;
        while self.bodies.len() < BODIES {
            self.create_body();
        }
        while self.tools.len() < TOOLS {
            self.create_tool();
        }
        match self.dice.below(100) {
            0 if self.bodies.len() == BODIES => {
                let gone = self.bodies.swap_remove(self.dice.below(BODIES));
                self.world.destroy_body(gone).expect("a body");
                self.crowded.0.retain(|&body| body != gone);
            }
            1 if self.tools.len() == TOOLS => {
                let gone = self.tools.swap_remove(self.dice.below(TOOLS));
                self.world.destroy_tool(gone).expect("a tool");
                self.crowded.1.retain(|&tool| tool != gone);
            }
            2..=4 => {
                let body = self.bodies[self.dice.below(self.bodies.len())];
                let (place, along, down) = (self.dice.vector(0.1), self.dice.vector(0.1), self.dice.vector(0.15));
                let sweep = Sweep {
                    start: [place - along, place + along],
                    end: [place - along + down, place + along + down],
                };
                match self.world.cut(body, &sweep) {
                    Ok(_) => self.counts.cuts += 1,
                    Err(_) => self.counts.refused += 1,
                }
            }
            5 => {
                let body = self.bodies[self.dice.below(self.bodies.len())];
                let tool = self.tools[self.dice.below(self.tools.len())];
                let held = self.world.attach_node(body, self.dice.below(HELD) as u32, tool, 0.5);
                self.counts.attachments += u32::from(held.is_ok());
            }
            6..=20 => {
                let body = self.bodies[self.dice.below(self.bodies.len())];
                let force = self.dice.vector(0.2);
                let node = (HELD + self.dice.below(6)) as u32;
                let pushed = self.world.body_mut(body).and_then(|body| {
                    body.apply_force(node, force)?;
                    Ok(body.positions()[node as usize])
                });
                match pushed {
                    Ok(place) => self.start.force = Some((body, node, force, place)),
                    Err(_) => self.counts.refused += 1,
                }
            }
            _ => (),
        }
        for &tool in &self.tools {
            let pose = self.world.pose(tool).expect("a pose");
            let to = (pose.position + self.dice.vector(0.004)).clamp(Vec3::splat(-0.2), Vec3::splat(0.2));
            self.world.set_pose(tool, to, None).expect("a pose");
        }
    }

    fn energy(&self) -> [f64; 2] {
        let energies = self.world.bodies().map(|body| body.energy(self.world.gravity()));
        energies.fold([0.0; 2], |[inner, all], energy| {
            let own = energy.kinetic + energy.elastic;
            [inner + own, all + own + energy.gravitational]
        })
    }

    /// What a frame gained beyond the work of tools and forces, as a part of the energy there is; nothing is told while something is pushed out.
    fn gain(&self) -> f64 {
        if !self.crowded.0.is_empty() || !self.crowded.1.is_empty() {
            return f64::NEG_INFINITY;
        }
        let place = |&id: &ToolId| self.world.pose(id).expect("a pose").position;
        let force = |&id: &ToolId| self.world.wrench(id).expect("a tool").0;
        let tools = self.tools.iter().zip(&self.start.tools);
        let mut works: Vec<f64> = tools
            .map(|(id, from)| -force(id).as_dvec3().dot((place(id) - *from).as_dvec3()))
            .collect();
        if let Some((body, node, force, from)) = self.start.force {
            let place = self.world.body(body).expect("a body").positions()[node as usize];
            works.push(force.as_dvec3().dot((place - from).as_dvec3()));
        }
        let [inner, all] = self.energy();
        let [inner_before, all_before] = self.start.energy;
        let scale = inner.max(inner_before) + works.iter().map(|work| work.abs()).sum::<f64>();
        (all - all_before - works.iter().sum::<f64>()) / scale.max(f64::MIN_POSITIVE)
    }

    /// A frame: whether all that can be read is finite, and no energy comes from nowhere.
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
            // Too many substeps: a world that says so is as it was.
            Err(Error::Unstable { .. }) => self.counts.unstable += 1,
            Err(error) => panic!("a step: {error}"),
        }
        let gain = self.gain();
        self.counts.watched += u32::from(gain.is_finite());
        self.counts.most_gained = self.counts.most_gained.max(gain);
        let bodies = self.bodies.iter().map(|&id| self.world.body(id).expect("a body"));
        let tools = self.tools.iter().map(|&id| self.world.wrench(id).expect("a tool"));
        gain <= GAIN && { bodies }.all(|body| body.positions().iter().all(|place| place.is_finite())) && { tools }
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
    let asked = std::env::args().find_map(|argument| argument.parse().ok());
    let frames: u32 = asked.unwrap_or(FRAMES);
    let before = held::held();
    let mut play = Play::new();
    let mut held = Vec::new();
    for tenth in 0..TENTHS {
        for frame in 0..frames / TENTHS {
            if !play.frame() {
                eprintln!(
                    "frame {frame} of tenth {tenth}: not all is finite, or energy came from nowhere: {:?}",
                    play.counts
                );
                return ExitCode::FAILURE;
            }
            if frame % 500 == 0 && std::io::stderr().is_terminal() {
                eprint!("\r{} of {frames} frames", tenth * (frames / TENTHS) + frame);
                let _ = std::io::stderr().flush();
            }
        }
        if is_planted {
            play.bodies.pop();
        }
        play.empty();
        held.push(held::held() - before);
    }
    // What a world keeps room for grows by steps to the most that was ever asked for at once, which takes longer and longer to be more.
    let (early, late) = held.split_at(TENTHS as usize / 2);
    let [early, late] = [early, late].map(|held| held.iter().max().copied().unwrap_or(0));
    eprintln!(
        "\r{frames} frames: {:?}; bytes held by an empty world after each tenth: {held:?}",
        play.counts
    );
    if play.counts.unstable > frames / 100 {
        eprintln!("{} frames were not taken: that is no soak", play.counts.unstable);
        return ExitCode::FAILURE;
    }
    if late > early + early / 100 {
        eprintln!("memory grows: {early} bytes, then {late}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
