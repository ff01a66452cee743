//! A body pays for its own solver alone, and what is destroyed for nothing: bytes, counted at the allocator.

use glam::Vec3;

use super::allocator;
use crate::support::solid;
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, Detection, Material, Shape, Solver, Storage, ToolDefinition, Values, World, WorldDefinition,
};

/// What a body of so many nodes without springs holds, bytes.
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

/// What each node of a body takes beyond what it takes with VERLET, bytes.
fn beyond_verlet(solver: Solver, storage: Storage) -> usize {
    let [few, many] =
        [1 << 14, 1 << 15].map(|count| held(solver, storage, count) - held(Solver::Verlet, storage, count));
    (many - few + (1 << 13)) >> 14
}

#[test]
fn a_body_pays_for_its_own_solver_alone() {
    /// Three numbers of single and of double precision.
    const SINGLE: usize = 12;
    const DOUBLE: usize = 24;
    for storage in [Storage::Packed, Storage::FastLink] {
        // Two histories of two vectors each, and the pushes.
        let both = 5 * SINGLE;
        // What positions lack, twice, as VERLET has it; anchors, ways, loads, drifts; masses and inertia; residuals; five vectors of the
        // conjugate gradient; two diagonals of 3x3; where rows begin.
        let newton = 4 * DOUBLE + 2 * 8 + DOUBLE + 5 * DOUBLE + 2 * 72 + 8;
        assert_eq!(beyond_verlet(Solver::Newton, storage), both + newton, "{storage:?}");
        // Five vectors, what positions lack, twice, as VERLET has it, the inertia, two symmetric blocks, and a place in a cluster; each 256 nodes or
        // fewer a few numbers more.
        let implicit = 5 * SINGLE + 4 + 2 * 24 + 4 * 4;
        let found = beyond_verlet(Solver::Implicit, storage);
        let records = 16 * usize::from(found > both + implicit + 16);
        assert!(
            (both + implicit..both + implicit + records + 16).contains(&found),
            "{storage:?}: {found}"
        );
    }
}

#[test]
fn a_tool_that_is_destroyed_takes_nothing() {
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
        let with = allocator::held() - before;
        world.destroy_tool(tool).expect("a tool");
        let after = allocator::held() - before;
        assert!(
            with > 1 << 17 && after < with / 8,
            "{detection:?}: {after} bytes of {with}"
        );
    }
}

/// What a small body holds that is alone in its world, bytes: a lattice of 27 nodes.
fn held_by_a_small_one(solver: Solver) -> usize {
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

/// VERLET has about 12 vectors of its nodes, padded to whole lanes, and springs, surface and itself; IMPLICIT twice that.
#[test]
fn a_small_body_takes_little() {
    for (solver, most) in [(Solver::Verlet, 16 << 10), (Solver::Implicit, 38 << 10)] {
        let held = held_by_a_small_one(solver);
        assert!(held <= most, "{solver:?}: {held} bytes");
    }
}
