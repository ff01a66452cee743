//! Terms computed with SIMD: bitwise identical at every SIMD level and for any number of threads, and the same motion
//! for every assignment of nodes to tiles.

use crate::support::bodies::{FREE, largest_difference};
use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, Error, Kernel, Solver, SpringLaw, Storage, Values, Viscosity, World, WorldDefinition, Yielding,
};

const STEPS: u32 = 8;

/// Bodies that have each of these terms in several tiles.
fn bodies(mesh: &Mesh) -> [BodyDefinition<'_>; 3] {
    let springs = BodyDefinition {
        masses: Values::Uniform(1e-4),
        stiffnesses: Values::Uniform(20.0),
        ..BodyDefinition::of(mesh)
    };
    let viscosity = Viscosity {
        retardation_time: 0.004,
        relaxation_time: 0.002,
    };
    [
        BodyDefinition {
            spring_law: SpringLaw::Exponential {
                steepness: 12.0,
                limit: 0.3,
            },
            viscosity,
            ..springs
        },
        BodyDefinition {
            spring_law: SpringLaw::Cubic {
                quadratic: 3.0,
                cubic: 4.0,
                limit: 0.1,
            },
            ..springs
        },
        BodyDefinition {
            viscosity,
            strain_limit: 0.1,
            limit_stiffening: 10.0,
            yielding: Yielding {
                strain: 0.02,
                largest: 0.5,
            },
            ..springs
        },
    ]
}

fn block() -> Mesh {
    let mesh = Mesh::block([0.2, 0.08, 0.08], [20, 8, 8]).expect("a block");
    assert!(mesh.positions.len() > 1024, "several tiles");
    mesh
}

fn as_f64(positions: &[Vec3]) -> Vec<DVec3> {
    positions.iter().map(|position| position.as_dvec3()).collect()
}

/// Returns the hash and the positions of a body that was stretched, compressed and twisted in flight.
fn thrown(world: WorldDefinition, definition: &BodyDefinition) -> Result<(u64, Vec<DVec3>), Error> {
    let mut world = World::new(world)?;
    let body = world.create_body(definition)?;
    let velocities: Vec<Vec3> = definition
        .positions
        .iter()
        .map(|p| Vec3::new(20.0 * p.x - 60.0 * p.y * p.x, 30.0 * p.z * p.x, -10.0 * p.z))
        .collect();
    world.body_mut(body)?.set_velocities(&velocities)?;
    for step in 0..STEPS {
        if step == STEPS / 2 {
            // Removed terms leave gaps in the SIMD batches.
            let last = definition.positions.len() as u32 - 1;
            for (a, b) in [(600, 601), (last - 600, last - 601)] {
                world.body_mut(body)?.remove_spring(a, b)?;
            }
        }
        world.step(1e-3)?;
    }
    let positions = as_f64(world.body(body)?.positions());
    Ok((world.state_hash(), positions))
}

#[test]
fn kernels_and_threads_are_bitwise_identical() {
    kernels_and_threads_are_bitwise_identical_of(|case| case == 1);
}

#[test]
#[ignore = "long"]
fn kernels_and_threads_are_bitwise_identical_in_the_other_cases() {
    kernels_and_threads_are_bitwise_identical_of(|case| case != 1);
}

fn kernels_and_threads_are_bitwise_identical_of(is_selected: fn(usize) -> bool) {
    let mesh = block();
    for (number, solver) in (0..).zip([Solver::Verlet, Solver::Implicit]) {
        for (which, body) in (number..).zip(&bodies(&mesh)).filter(|case| is_selected(case.0)) {
            // A storage that uses scalar code itself.
            let definition = BodyDefinition {
                solver,
                storage: Storage::Efficient,
                ..*body
            };
            let result = |kernel, thread_count| {
                let world = WorldDefinition {
                    kernel,
                    thread_count,
                    ..FREE
                };
                thrown(world, &definition)
            };
            let (expected, _) = result(Kernel::Portable, 1).expect("a portable kernel");
            for kernel in [Kernel::Portable, Kernel::Avx512, Kernel::Avx2, Kernel::Neon] {
                match result(kernel, 3) {
                    Ok((hash, _)) => assert_eq!(hash, expected, "{solver:?}, body {which}, {kernel:?}"),
                    Err(error) => assert!(matches!(error, Error::Unsupported(_)), "{kernel:?}: {error}"),
                }
            }
        }
    }
}

#[test]
fn the_order_of_nodes_does_not_change_the_motion() {
    // With nodes in reverse order, tiles have other nodes, and other springs cross two tiles.
    let mesh = block();
    let mut reversed = block();
    reversed.positions.reverse();
    let last = mesh.positions.len() as u32 - 1;
    for corner in reversed.tetrahedra.as_flattened_mut() {
        *corner = last - *corner;
    }
    for (which, (body, other)) in bodies(&mesh).iter().zip(&bodies(&reversed)).enumerate() {
        let [ours, mut others] = [body, other].map(|body| {
            let world = WorldDefinition { substeps: 20, ..FREE };
            let definition = BodyDefinition {
                storage: Storage::Efficient,
                ..*body
            };
            thrown(world, &definition).expect("a motion").1
        });
        others.reverse();
        let moved = largest_difference(&ours, &as_f64(&mesh.positions));
        let error = largest_difference(&ours, &others);
        assert!(moved > 0.01 && error < 1e-4 * moved, "body {which}: {error} of {moved}");
    }
}
