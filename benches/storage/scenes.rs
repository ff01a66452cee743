//! Bodies to measure: a sheet, a sheet numbered at random, an organ of tetrahedra.

use glam::Vec3;
use sinew::mesh::Mesh;

use crate::random::Random;

/// Spacing of the nodes of a sheet [m].
const SPACING: f32 = 1e-3;
/// Initial displacement of nodes, in spacings. It causes forces everywhere from the first step on, none so small that
/// the processor slows down.
const DISTURBANCE: f32 = 0.02;
/// Displacement of an organ's nodes from the lattice, in spacings. All springs have different lengths, as in a mesh of
/// a real organ.
const UNEVENNESS: f32 = 0.1;

/// Mass of a node [kg].
pub const MASS: f32 = 1e-4;
/// Stiffness of a spring [N/m].
pub const STIFFNESS: f32 = 100.0;
/// Substep [s], always stable in these scenes, so that no step has to estimate it.
pub const SUBSTEP: f32 = 1e-4;
/// Gravity along y [m/s²].
pub const GRAVITY: f32 = -9.81;

/// The data of a body.
pub struct Scene {
    pub name: &'static str,
    pub rest_positions: Vec<Vec3>,
    /// Initial positions, slightly displaced from rest.
    pub positions: Vec<Vec3>,
    pub springs: Vec<[u32; 2]>,
    pub pinned: Vec<u32>,
}

/// The kinds of scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Grid,
    GridAtRandom,
    Organ,
}

impl Kind {
    pub const ALL: [Self; 3] = [Self::Grid, Self::Organ, Self::GridAtRandom];

    pub fn name(self) -> &'static str {
        match self {
            Self::Grid => "grid",
            Self::GridAtRandom => "grid at random",
            Self::Organ => "organ",
        }
    }

    /// Creates a scene of about `nodes` nodes.
    pub fn scene(self, nodes: usize) -> Scene {
        match self {
            Self::Grid => Scene::grid(nodes),
            Self::GridAtRandom => Scene::grid(nodes).renumbered(),
            Self::Organ => Scene::organ(nodes),
        }
    }
}

impl Scene {
    /// A nearly square sheet of about `nodes` nodes, each joined to its 8 neighbors, pinned along one side.
    pub fn grid(nodes: usize) -> Self {
        let rows = (nodes as f64).sqrt().round().max(2.0) as u32;
        let columns = (nodes as f64 / f64::from(rows)).round().max(2.0) as u32;
        let mut rest_positions = Vec::with_capacity((rows * columns) as usize);
        let mut springs = Vec::with_capacity(4 * (rows * columns) as usize);
        for row in 0..rows {
            for column in 0..columns {
                let node = row * columns + column;
                rest_positions.push(Vec3::new(column as f32, 0.0, row as f32) * SPACING);
                let (right, below) = (column + 1 < columns, row + 1 < rows);
                if right {
                    springs.push([node, node + 1]);
                }
                if below {
                    springs.push([node, node + columns]);
                }
                if right && below {
                    springs.push([node, node + columns + 1]);
                    springs.push([node + 1, node + columns]);
                }
            }
        }
        Self {
            name: Kind::Grid.name(),
            positions: jittered(&rest_positions, DISTURBANCE * SPACING, 1),
            rest_positions,
            springs,
            pinned: (0..columns).collect(),
        }
    }

    /// The same body with its nodes numbered at random.
    fn renumbered(self) -> Self {
        let mut names: Vec<u32> = (0..self.positions.len() as u32).collect();
        Random(2).shuffle(&mut names);
        let moved = |positions: &[Vec3]| {
            let mut moved = vec![Vec3::ZERO; positions.len()];
            for (&name, &position) in names.iter().zip(positions) {
                moved[name as usize] = position;
            }
            moved
        };
        Self {
            name: Kind::GridAtRandom.name(),
            rest_positions: moved(&self.rest_positions),
            positions: moved(&self.positions),
            springs: self
                .springs
                .iter()
                .map(|pair| pair.map(|node| names[node as usize]))
                .collect(),
            pinned: self.pinned.iter().map(|&node| names[node as usize]).collect(),
        }
    }

    /// An irregular organ of tetrahedra with about `nodes` nodes, pinned at one end.
    pub fn organ(nodes: usize) -> Self {
        // An organ of unit length and spacing s has about 0.154 / s³ nodes; small ones have more because of their
        // surface.
        const COARSEST: f64 = 0.124;
        let mut spacing = (0.154 / nodes as f64).cbrt().min(COARSEST);
        let mut mesh = Mesh::organ(1.0, spacing as f32).expect("an organ of this spacing");
        if nodes <= 100_000 {
            spacing = (spacing * (mesh.positions.len() as f64 / nodes as f64).cbrt()).min(COARSEST);
            mesh = Mesh::organ(1.0, spacing as f32).expect("an organ of this spacing");
        }
        let springs = mesh.edges().expect("memory for the edges");
        let spacing = spacing as f32;
        let rest_positions = jittered(&mesh.positions, UNEVENNESS * spacing, 3);
        let first = rest_positions
            .iter()
            .fold(f32::INFINITY, |least, position| least.min(position.x));
        let pinned = (0..rest_positions.len() as u32)
            .filter(|&node| rest_positions[node as usize].x < first + 2.0 * spacing)
            .collect();
        Self {
            name: Kind::Organ.name(),
            positions: jittered(&rest_positions, DISTURBANCE * spacing, 4),
            rest_positions,
            springs,
            pinned,
        }
    }

    /// The rest length of a spring [m].
    pub fn rest_length(&self, [a, b]: [u32; 2]) -> f32 {
        self.rest_positions[a as usize].distance(self.rest_positions[b as usize])
    }
}

/// Moves each position at random by up to `reach` along each axis.
fn jittered(positions: &[Vec3], reach: f32, seed: u64) -> Vec<Vec3> {
    let mut random = Random(seed);
    let mut moved = |position: &Vec3| *position + reach * Vec3::from_array(std::array::from_fn(|_| random.signed()));
    positions.iter().map(&mut moved).collect()
}
