//! A body holds memory for its own solver only, and destroyed objects hold none: bytes, counted at the allocator.

use glam::Vec3;

use super::allocator;
use crate::support::solid;
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, Detection, Material, Shape, Solver, Storage, ToolDefinition, Values, World, WorldDefinition,
};

/// Returns the memory of a body with `node_count` nodes without springs [bytes].
fn held(solver: Solver, storage: Storage, node_count: usize) -> usize {
    let positions: Vec<Vec3> = (0..node_count).map(|i| Vec3::X * i as f32 * 0.01).collect();
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let before = allocator::held();
    world
        .create_body(&BodyDefinition {
            positions: &positions,
            masses: Values::Uniform(1e-3),
            springs: Some(&[]),
            solver,
            storage,
            mass_scaling: 0.0,
            ..BodyDefinition::default()
        })
        .expect("a body");
    (allocator::held() - before) as usize
}

/// Returns the memory per node beyond that of VERLET [bytes].
fn beyond_verlet(solver: Solver, storage: Storage) -> usize {
    let [few, many] =
        [1 << 14, 1 << 15].map(|count| held(solver, storage, count) - held(Solver::Verlet, storage, count));
    (many - few + (1 << 13)) >> 14
}

#[test]
fn a_body_holds_memory_for_its_own_solver_only() {
    /// Three numbers of single and of double precision.
    const SINGLE: usize = 12;
    const DOUBLE: usize = 24;
    for storage in [Storage::Packed, Storage::FastLink] {
        // Two histories of two vectors each, and the force displacements.
        let both = 5 * SINGLE;
        // Twice the position remainders, as in VERLET; anchors, displacements, loads, drifts; masses and inertia;
        // residuals; five vectors of conjugate gradients; two diagonals of 3x3 blocks; row offsets.
        let newton = 4 * DOUBLE + 2 * 8 + DOUBLE + 5 * DOUBLE + 2 * 72 + 8;
        assert_eq!(beyond_verlet(Solver::Newton, storage), both + newton, "{storage:?}");
        // Five vectors, twice the position remainders as in VERLET, the inertia, two symmetric blocks, and a cluster
        // index. Each tile of up to 256 nodes adds a few numbers.
        let implicit = 5 * SINGLE + 4 + 2 * 24 + 4 * 4;
        let bytes = beyond_verlet(Solver::Implicit, storage);
        let records = 16 * usize::from(bytes > both + implicit + 16);
        assert!(
            (both + implicit..both + implicit + records + 16).contains(&bytes),
            "{storage:?}: {bytes}"
        );
    }
}

#[test]
fn a_destroyed_tool_holds_no_memory() {
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let (positions, triangles) = solid::cuboid(Vec3::ZERO, Vec3::ONE);
    let before = allocator::held();
    for detection in [Detection::ImageSpace, Detection::DistanceField] {
        let tool = world.create_tool(&ToolDefinition {
            detection,
            resolution: 0.02,
            ..ToolDefinition::new(Shape::Mesh {
                positions: &positions,
                triangles: &triangles,
            })
        });
        let tool = tool.expect("a tool");
        world.step(0.001).expect("a step");
        let while_alive = allocator::held() - before;
        world.destroy_tool(tool).expect("a tool");
        let after = allocator::held() - before;
        assert!(
            while_alive > 1 << 17 && after < while_alive / 8,
            "{detection:?}: {after} bytes of {while_alive}"
        );
    }
}

/// Returns the memory of a small body alone in its world: a lattice of 27 nodes [bytes].
fn small_body_memory(solver: Solver) -> usize {
    let mesh = Mesh::lattice(0.1, [2; 3]).expect("a lattice");
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let before = allocator::held();
    world
        .create_body(&BodyDefinition {
            material: Some(Material {
                young_modulus: 5e4,
                density: 500.0,
                ..Material::default()
            }),
            solver,
            ..BodyDefinition::of(&mesh)
        })
        .expect("a body");
    (allocator::held() - before) as usize
}

/// VERLET has about 12 vectors of nodes, padded to whole lanes, plus springs, surface and the body itself. IMPLICIT has
/// twice that.
#[test]
fn a_small_body_holds_little_memory() {
    for (solver, limit) in [(Solver::Verlet, 16 << 10), (Solver::Implicit, 38 << 10)] {
        let held = small_body_memory(solver);
        assert!(held <= limit, "{solver:?}: {held} bytes");
    }
}
