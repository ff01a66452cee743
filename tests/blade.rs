//! Blades: what they cut, and what that costs whoever moves them.
#![allow(clippy::unwrap_used)]

use glam::{DVec3, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::{
    BladeDefinition, BladeId, BodyDefinition, BodyId, Error, Pose, Solver, Values, World, WorldDefinition,
};

/// J/m.
const TOUGHNESS: f32 = 0.02;

/// m: a square sheet in the plane z = 0, from the origin.
const SIZE: f32 = 0.1;

/// What a sheet is like.
#[derive(Clone, Copy)]
struct Sheet {
    cells: usize,
    toughness: f32,
    is_held: bool,
    solver: Solver,
    spare: u32,
    mass: f32,
    damping: f32,
    threads: u32,
}

impl Sheet {
    const HELD: Self = Self {
        cells: 20,
        toughness: TOUGHNESS,
        is_held: true,
        solver: Solver::Verlet,
        spare: 4000,
        mass: 1.0,
        damping: 40.0,
        threads: 1,
    };

    /// Nodes off their grid but at the border, springs of 100 N/m.
    fn world(&self) -> (World, BodyId) {
        let n = self.cells;
        let side = SIZE / n as f32;
        let mut seed = 7_u32;
        let mut off = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            0.3 * ((seed >> 8) as f32 / (1 << 24) as f32 - 0.5)
        };
        let mut positions = Vec::new();
        let mut masses = Vec::new();
        for y in 0..=n {
            for x in 0..=n {
                let is_border = x == 0 || y == 0 || x == n || y == n;
                let (dx, dy) = if is_border { (0.0, 0.0) } else { (off(), off()) };
                positions.push(side * vec3(x as f32 + dx, y as f32 + dy, 0.0));
                let is_pinned = self.is_held && (y == 0 || y == n);
                masses.push(if is_pinned { 0.0 } else { self.mass * side * side });
            }
        }
        let mut triangles = Vec::new();
        for y in 0..n {
            for x in 0..n {
                let a = (y * (n + 1) + x) as u32;
                let (b, c, d) = (a + 1, a + n as u32 + 1, a + n as u32 + 2);
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            thread_count: self.threads,
            ..Default::default()
        })
        .unwrap();
        let body = world
            .create_body(&BodyDefinition {
                positions: &positions,
                masses: Values::Each(&masses),
                node_dampings: Values::Uniform(self.damping * self.mass * side * side),
                triangles: &triangles,
                stiffnesses: Values::Uniform(100.0),
                spare_nodes: self.spare,
                toughness: self.toughness,
                solver: self.solver,
                mass_scaling: 0.0,
                ..Default::default()
            })
            .unwrap();
        (world, body)
    }
}

/// An upright edge of 4 cm about its own origin.
fn upright(world: &mut World, stiffness: f32, at: Vec3) -> BladeId {
    let edge = [vec3(0.0, 0.0, -0.02), vec3(0.0, 0.0, 0.02)];
    let pose = Pose {
        position: at,
        ..Pose::IDENTITY
    };
    world
        .create_blade(&BladeDefinition {
            stiffness,
            pose,
            ..BladeDefinition::new(edge)
        })
        .unwrap()
}

/// What a stroke came to.
#[derive(Default)]
struct Stroke {
    /// The work of the hand by force and displacement of its edge, and as it was reported, J.
    work: f64,
    told: f64,
    /// m.
    length: f64,
    /// The force on the blade after each step, N, and how far it was ahead, m.
    forces: Vec<Vec3>,
    lags: Vec<f64>,
    refused: usize,
}

impl Stroke {
    /// Moves a blade evenly from a place to another.
    fn draw(&mut self, world: &mut World, blade: BladeId, [from, to]: [Vec3; 2], steps: usize, dt: f32) {
        let mut before = from;
        for step in 1..=steps {
            let place = from.lerp(to, step as f32 / steps as f32);
            world.set_blade_pose(blade, place, None).unwrap();
            world.step(dt).unwrap();
            let report = world.blade_report(blade).unwrap();
            self.work -= report.force.as_dvec3().dot((place - before).as_dvec3());
            self.told += report.work;
            self.length += report.length;
            self.forces.push(report.force);
            self.lags.push(report.lag);
            self.refused += usize::from(report.refused.is_some());
            before = place;
        }
    }

    fn largest_jump(&self) -> f32 {
        let jumps = self.forces.windows(2).map(|pair| pair[0].distance(pair[1]));
        jumps.fold(0.0, f32::max)
    }
}

#[test]
fn the_work_of_a_stroke_is_toughness_times_length() {
    for steps in [100, 200, 400, 800] {
        let (mut world, _) = Sheet::HELD.world();
        let way = [vec3(-0.01, 0.048, 0.0), vec3(0.115, 0.053, 0.0)];
        let blade = upright(&mut world, 200.0, way[0]);
        let mut stroke = Stroke::default();
        stroke.draw(&mut world, blade, way, steps, 1.0 / steps as f32);
        let spent = f64::from(TOUGHNESS) * stroke.length;
        println!(
            "steps {steps}: length {} work {:.6} told {:.6} spent {spent:.6} ratio {:.4} jump {} refused {} last {:?} max lag {}",
            stroke.length,
            stroke.work,
            stroke.told,
            stroke.work / spent,
            stroke.largest_jump(),
            stroke.refused,
            stroke.forces.last(),
            stroke.lags.iter().fold(0.0_f64, |a, b| a.max(*b))
        );
        if steps == 400 {
            for (i, f) in stroke.forces.iter().enumerate() {
                if i % 4 == 0 { println!("{i} {} {} {}", f.x, f.y, stroke.lags[i]); }
            }
        }
    }
}
