//! Forged snapshots: loading must refuse them, or return a world that steps without memory errors.
#![no_main]

mod planted;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::OnceLock;

use glam::{Vec3, vec3};
use libfuzzer_sys::fuzz_target;
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{
    BodyContact, BodyDefinition, Material, Model, Shape, Sleep, Solver, Storage, ToolDefinition, Values, World,
    WorldDefinition,
};
use xxhash_rust::xxh3::Xxh3Default;

/// Byte offset of the header's checksum, and the end of the header.
const CHECKSUM: usize = 28;
const HEADER: usize = 36;

const STORAGES: [Storage; 4] = [
    Storage::Packed,
    Storage::Efficient,
    Storage::FastLink,
    Storage::DynamicBulk,
];

/// Byte offsets of the fixed and the maximum number of substeps. They are restored, since callers may choose any
/// number.
fn substeps() -> &'static [usize] {
    static OFFSETS: OnceLock<Vec<usize>> = OnceLock::new();
    OFFSETS.get_or_init(|| {
        let saved = |substeps, max_substeps| {
            let definition = WorldDefinition {
                substeps,
                max_substeps,
                ..WorldDefinition::default()
            };
            World::new(definition).and_then(|world| world.save()).expect("bytes")
        };
        let (first, second) = (saved(1, 1), saved(!1, !1));
        (HEADER..first.len()).filter(|&at| first[at] != second[at]).collect()
    })
}

/// Small worlds, each with other features.
fn worlds() -> &'static [Vec<u8>] {
    static WORLDS: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    WORLDS.get_or_init(|| {
        // A step of a forged world may panic; the panic is caught.
        std::panic::set_hook(Box::new(|_| ()));
        (0..12).map(world).collect()
    })
}

/// A sheet or a block with a ball in contact, which is cut.
fn world(kind: usize) -> Vec<u8> {
    let is_block = kind % 2 == 1;
    let mesh = if is_block {
        Mesh::block([0.03; 3], [1, 2, 1])
    } else {
        Mesh::cloth([0.03; 2], [3, 3])
    };
    let mesh = mesh.expect("a mesh");
    let mut world = World::new(WorldDefinition {
        max_substeps: 8,
        ..WorldDefinition::default()
    })
    .expect("a world");
    let has_elements = is_block && kind % 4 == 3;
    let definition = BodyDefinition {
        positions: &mesh.positions,
        triangles: &mesh.triangles,
        tetrahedra: &mesh.tetrahedra,
        masses: Values::Uniform(if has_elements { 0.0 } else { 1e-3 }),
        stiffnesses: Values::Uniform(if has_elements { 0.0 } else { 1.0 }),
        material: has_elements.then_some(Material {
            model: Model::Tetrahedra,
            young_modulus: 100.0,
            poisson_ratio: 0.3,
            density: 1000.0,
            thickness: 0.0,
        }),
        bending_stiffness: if kind == 4 { 1e-7 } else { 0.0 },
        node_dampings: Values::Uniform(1e-3),
        solver: [Solver::Verlet, Solver::Implicit, Solver::Newton][kind / 4],
        storage: STORAGES[kind / 2 % 4],
        springs_per_node: 60,
        spare_nodes: 80,
        sleep: Sleep {
            speed: if kind == 6 { 0.01 } else { 0.0 },
            time: 0.1,
        },
        contact: BodyContact {
            with_bodies: kind % 3 == 0,
            ..BodyContact::default()
        },
        ..BodyDefinition::default()
    };
    let body = world.create_body(&definition).expect("a body");
    world.body_mut(body).and_then(|body| body.pin(0)).expect("a pin");
    let mut tool = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
    tool.pose.position = vec3(0.0, if is_block { 0.024 } else { 0.009 }, 0.0);
    let tool = world.create_tool(&tool).expect("a tool");
    world.attach_node(body, 1, tool, 1.0).expect("a node");
    let edge = |z: f32| [vec3(0.002, -0.1, z), vec3(0.002, 0.1, z)];
    for step in 0..4 {
        let at = 0.006 * step as f32 - 0.02;
        let sweep = Sweep {
            start: edge(at),
            end: edge(at + 0.006),
        };
        world.cut(body, &sweep).expect("a cut");
        world
            .body_mut(body)
            .and_then(|body| body.apply_force(2, 1e-3 * Vec3::X))
            .expect("a force");
        world.step(1e-3).expect("a step");
    }
    world.save().expect("bytes")
}

fuzz_target!(|input: &[u8]| {
    let worlds = worlds();
    let Some((&kind, edits)) = input.split_first() else {
        return;
    };
    let mut bytes;
    if kind == u8::MAX {
        bytes = edits.to_vec();
    } else {
        bytes = worlds[usize::from(kind) % worlds.len()].clone();
        let (edits, _) = edits.as_chunks::<4>();
        for &[low, high, operation, value] in edits {
            let at = HEADER
                + (usize::from(u16::from_le_bytes([low, high])) + (usize::from(operation) >> 4 << 16))
                    % (bytes.len() - HEADER);
            match operation & 3 {
                0 => bytes[at] = value,
                1 => bytes[at] ^= 1 << (value % 8),
                2 => bytes[at] = bytes[at].wrapping_add(value as i8 as u8),
                _ => bytes[at..].iter_mut().take(8).for_each(|byte| *byte = value),
            }
        }
        let saved = &worlds[usize::from(kind) % worlds.len()];
        for &at in substeps() {
            bytes[at] = saved[at];
        }
    }
    // A valid checksum, so that the snapshot is not refused for it.
    if bytes.len() >= HEADER {
        let size = bytes.len() as u64;
        bytes[CHECKSUM - 8..CHECKSUM].copy_from_slice(&size.to_le_bytes());
        let mut hasher = Xxh3Default::new();
        hasher.update(&bytes[..CHECKSUM]);
        hasher.update(&bytes[HEADER..]);
        bytes[CHECKSUM..HEADER].copy_from_slice(&hasher.digest().to_le_bytes());
    }
    let Ok(loaded) = catch_unwind(|| World::load(&bytes, 1, None)) else {
        eprintln!("a world that is read must not panic");
        std::process::abort();
    };
    if let Ok(mut world) = loaded {
        // A step takes longer than everything else, so only one in four inputs takes it.
        if kind < 64 {
            let _ = catch_unwind(AssertUnwindSafe(|| world.step(1e-3)));
        }
        planted::fault(edits.len() == 13);
    }
});
