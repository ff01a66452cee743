//! Spring bodies for physics tests, owned by the test that changes them, and a world that steps one body.

use glam::{DVec3, Quat, Vec3};
use sinew::{Body, BodyDefinition, BodyId, Solver, StepReport, Values, World, WorldDefinition};

use super::reference::Reference;

/// Settings without gravity, with one thread and with substeps that the library chooses.
pub const FREE: WorldDefinition = WorldDefinition {
    gravity: Vec3::ZERO,
    thread_count: 1,
    tasks: None,
    substeps: 0,
    max_substeps: 1000,
    tolerance: 0.0,
    kernel: sinew::Kernel::Best,
};

/// Clears the body ids of a report, to compare it with the report of another world.
pub fn without_ids(report: StepReport) -> StepReport {
    StepReport {
        substeps_body: None,
        restored_body: None,
        crossing_body: None,
        ..report
    }
}

/// The nodes and springs of a body.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    pub positions: Vec<Vec3>,
    /// kg; 0 pins the node.
    pub masses: Vec<f32>,
    pub node_dampings: Vec<f32>,
    pub springs: Vec<[u32; 2]>,
    pub stiffnesses: Vec<f32>,
    pub rest_lengths: Vec<f32>,
    pub spring_damping: f32,
}

impl Parts {
    /// Returns nodes of equal mass without springs.
    pub fn nodes(positions: Vec<Vec3>, mass: f32) -> Self {
        let count = positions.len();
        Self {
            positions,
            masses: vec![mass; count],
            node_dampings: vec![0.0; count],
            ..Self::default()
        }
    }

    /// Adds a spring whose rest length is the current distance of its nodes.
    pub fn join(&mut self, a: usize, b: usize, stiffness: f32) {
        let length = self.positions[a].as_dvec3().distance(self.positions[b].as_dvec3());
        self.springs.push([a as u32, b as u32]);
        self.stiffnesses.push(stiffness);
        self.rest_lengths.push(length as f32);
    }

    /// Returns a line of nodes along `direction`, each joined to the next.
    pub fn chain(count: usize, direction: Vec3, mass: f32, stiffness: f32) -> Self {
        let mut parts = Self::nodes((0..count).map(|i| direction * i as f32).collect(), mass);
        for i in 1..count {
            parts.join(i - 1, i, stiffness);
        }
        parts
    }

    /// Returns a block of cubes with springs along their edges and face diagonals. Masses and stiffnesses are shared as
    /// in an infinite lattice: each cube owns a quarter of each edge, half of each diagonal and an eighth of the mass
    /// at each corner.
    pub fn block(cells: [usize; 3], spacing: f32, node_mass: f32, stiffness: f32) -> Self {
        let node = |c: [usize; 3]| (c[2] * (cells[1] + 1) + c[1]) * (cells[0] + 1) + c[0];
        let mut positions = Vec::new();
        for z in 0..=cells[2] {
            for y in 0..=cells[1] {
                for x in 0..=cells[0] {
                    positions.push(Vec3::new(x as f32, y as f32, z as f32) * spacing);
                }
            }
        }
        let mut parts = Self::nodes(positions, 0.0);
        let mut shares = std::collections::BTreeMap::new();
        for cell in 0..cells.iter().product() {
            let low = [
                cell % cells[0],
                cell / cells[0] % cells[1],
                cell / (cells[0] * cells[1]),
            ];
            let corner = |bits: usize| node([low[0] + (bits & 1), low[1] + (bits >> 1 & 1), low[2] + (bits >> 2)]);
            for a in 0..8_usize {
                parts.masses[corner(a)] += node_mass / 8.0;
                for b in 0..a {
                    let share = match (a ^ b).count_ones() {
                        1 => 0.25,
                        2 => 0.5,
                        _ => continue,
                    };
                    let (a, b) = (corner(a), corner(b));
                    *shares.entry([a.min(b), a.max(b)]).or_insert(0.0) += share;
                }
            }
        }
        for ([a, b], share) in shares {
            parts.join(a, b, share * stiffness);
        }
        parts
    }

    /// Returns the extent of the body along its longest axis (m).
    pub fn size(&self) -> f64 {
        let low = self.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = self.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        f64::from((high - low).max_element())
    }

    /// Returns the body rotated about the origin, then moved. Its rest lengths are bitwise identical.
    pub fn moved(&self, rotation: Quat, offset: Vec3) -> Self {
        let mut moved = self.clone();
        for position in &mut moved.positions {
            *position = (rotation.as_dquat() * position.as_dvec3() + offset.as_dvec3()).as_vec3();
        }
        moved
    }

    pub fn definition(&self) -> BodyDefinition<'_> {
        BodyDefinition {
            positions: &self.positions,
            masses: Values::Each(&self.masses),
            node_dampings: Values::Each(&self.node_dampings),
            springs: Some(&self.springs),
            stiffnesses: Values::Each(&self.stiffnesses),
            rest_lengths: Some(&self.rest_lengths),
            spring_dampings: Values::Uniform(self.spring_damping),
            solver: Solver::Verlet,
            ..BodyDefinition::default()
        }
    }

    /// Returns the same body in `f64`.
    pub fn reference(&self, gravity: Vec3) -> Reference {
        assert_eq!(self.spring_damping, 0.0, "the reference has no damping along springs");
        let springs = self.springs.iter().zip(&self.stiffnesses).zip(&self.rest_lengths);
        Reference::new(
            self.positions.iter().map(|p| p.as_dvec3()).collect(),
            self.masses.iter().map(|&m| f64::from(m)).collect(),
            self.node_dampings.iter().map(|&d| f64::from(d)).collect(),
            springs.map(|((s, &k), &l)| (*s, f64::from(k), f64::from(l))).collect(),
            gravity.as_dvec3(),
        )
    }
}

/// A world with one body.
pub struct Scene {
    pub world: World,
    pub id: BodyId,
}

impl Scene {
    pub fn new(parts: &Parts, definition: WorldDefinition) -> Self {
        let mut world = World::new(definition).expect("a world");
        let id = world.create_body(&parts.definition()).expect("a body");
        Self { world, id }
    }

    pub fn body(&self) -> &Body {
        self.world.body(self.id).expect("the body")
    }

    pub fn body_mut(&mut self) -> &mut Body {
        self.world.body_mut(self.id).expect("the body")
    }

    /// Creates the scene with the body definition that `change` returns.
    pub fn with(
        parts: &Parts,
        definition: WorldDefinition,
        change: impl FnOnce(BodyDefinition) -> BodyDefinition,
    ) -> Self {
        let mut world = World::new(definition).expect("a world");
        let id = world.create_body(&change(parts.definition())).expect("a body");
        Self { world, id }
    }

    /// Takes a step that must succeed.
    pub fn step(&mut self, dt: f32) -> StepReport {
        let report = self.world.step(dt).expect("a step");
        assert_eq!(report.bodies_restored, 0);
        without_ids(report)
    }

    pub fn run(&mut self, dt: f32, steps: usize) {
        for _ in 0..steps {
            self.step(dt);
        }
    }

    pub fn positions(&self) -> Vec<DVec3> {
        self.body().positions().iter().map(|p| p.as_dvec3()).collect()
    }

    pub fn velocities(&self) -> Vec<DVec3> {
        self.body().velocities().iter().map(|v| v.as_dvec3()).collect()
    }

    /// Returns the sum of kinetic, elastic and gravitational energy (J).
    pub fn energy(&self) -> f64 {
        let energy = self.body().energy(self.world.gravity());
        energy.kinetic + energy.elastic + energy.gravitational
    }

    pub fn is_finite(&self) -> bool {
        let body = self.body();
        body.positions().iter().chain(body.velocities()).all(|v| v.is_finite())
    }
}

/// Returns the largest distance between nodes with the same index (m).
pub fn largest_difference(a: &[DVec3], b: &[DVec3]) -> f64 {
    assert_eq!(a.len(), b.len());
    let larger = |largest: f64, (a, b): (&DVec3, &DVec3)| largest.max(a.distance(*b));
    let largest = a.iter().zip(b).fold(0.0, larger);
    assert!(a.iter().all(|p| p.is_finite()), "a position is not finite");
    largest
}

/// Deterministic pseudo-random numbers (SplitMix64).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Returns a number from -1 up to 1.
    pub fn signed(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    /// Returns an index less than `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    /// Returns a point of the cube from -1 to 1.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}
