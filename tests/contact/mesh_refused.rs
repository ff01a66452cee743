//! Meshes that bound no solid are refused with the defect and its location, and nothing changes. Unusual but valid
//! solids work.

use crate::support::solid::{ball, cuboid};
use crate::support::tissue::*;
use glam::{Quat, Vec3};
use sinew::{Detection, Error, Pose, Shape, ToolDefinition};

const DETECTIONS: [Detection; 3] = [Detection::Exact, Detection::DistanceField, Detection::ImageSpace];

type Parts = (Vec<Vec3>, Vec<[u32; 3]>);

fn cube() -> Parts {
    cuboid(Vec3::splat(-0.01), Vec3::splat(0.01))
}

fn with(change: impl FnOnce(&mut Vec<Vec3>, &mut Vec<[u32; 3]>)) -> Parts {
    let (mut positions, mut triangles) = cube();
    change(&mut positions, &mut triangles);
    (positions, triangles)
}

/// Returns invalid meshes: a name, the mesh, and words of the error message.
fn invalid_meshes() -> Vec<(&'static str, Parts, &'static [&'static str])> {
    let second = |by: Vec3, scale: f32| {
        with(|positions, triangles| {
            let (corners, others) = cube();
            positions.extend(corners.iter().map(|corner| *corner * scale + by));
            triangles.extend(others.iter().map(|triangle| triangle.map(|node| node + 8)));
        })
    };
    vec![
        ("empty", (Vec::new(), Vec::new()), &["no triangles"]),
        (
            "without triangles",
            with(|_, triangles| triangles.clear()),
            &["no triangles"],
        ),
        (
            "without nodes",
            with(|positions, _| positions.clear()),
            &["triangle", "0"],
        ),
        (
            "an index out of range",
            with(|_, triangles| triangles[7][1] = 8),
            &["triangle", "7", "8"],
        ),
        (
            "the largest index",
            with(|_, triangles| triangles[2][0] = u32::MAX),
            &["triangle", "2", "4294967295"],
        ),
        (
            "NaN",
            with(|positions, _| positions[3].y = f32::NAN),
            &["position", "node 3", "NaN"],
        ),
        (
            "infinite",
            with(|positions, _| positions[5].z = f32::INFINITY),
            &["position", "node 5", "inf"],
        ),
        (
            "too far away",
            with(|positions, _| positions[5].z = 1e30),
            &["position", "node 5"],
        ),
        (
            "open",
            with(|_, triangles| triangles.truncate(11)),
            &["not closed", "edge from node"],
        ),
        (
            "a single triangle",
            with(|_, triangles| triangles.truncate(1)),
            &["not closed", "triangle 0"],
        ),
        (
            "a triangle turned",
            with(|_, triangles| triangles[4].reverse()),
            &["not closed", "triangle"],
        ),
        (
            "a triangle twice",
            with(|_, triangles| triangles.push(triangles[0])),
            &["not closed", "triangle"],
        ),
        (
            "a triangle and its back",
            with(|_, triangles| *triangles = vec![[0, 1, 2], [2, 1, 0]]),
            &["encloses 0e0"],
        ),
        (
            "a node twice in a triangle",
            with(|_, triangles| triangles[6] = [1, 1, 2]),
            &["triangle 6", "no area"],
        ),
        (
            "all in one place",
            with(|positions, _| positions.fill(Vec3::ONE)),
            &["triangle 0", "no area"],
        ),
        (
            "all along a line",
            with(|positions, _| {
                for (index, corner) in positions.iter_mut().enumerate() {
                    *corner = Vec3::X * index as f32;
                }
            }),
            &["triangle 0", "no area", "along a line"],
        ),
        (
            "flat",
            with(|positions, _| positions.iter_mut().for_each(|corner| corner.y = 0.0)),
            &["triangle", "no area"],
        ),
        (
            "inside out",
            with(|_, triangles| triangles.iter_mut().for_each(|triangle| triangle.reverse())),
            &["encloses -7.99", "inward"],
        ),
        (
            "two that cross",
            second(Vec3::new(0.005, 0.007, 0.003), 1.0),
            &["triangles", "pass through each other"],
        ),
        (
            "one within the other",
            second(Vec3::ZERO, 0.5),
            &["triangle 12", "within another"],
        ),
        (
            "a corner pulled through the other side",
            with(|positions, _| positions[7] = Vec3::new(-0.03, -0.02, -0.04)),
            &[],
        ),
    ]
}

#[test]
fn meshes_that_bound_no_solid_are_refused_and_nothing_changes() {
    let mut world = world(Vec3::ZERO);
    TISSUE.put(&mut world, &square(0.1, 4));
    sphere(&mut world, 0.01, Vec3::Y * 0.01);
    world.step(0.001).expect("a step");
    let before = world.state_hash();
    for (name, (positions, triangles), words) in invalid_meshes() {
        for detection in DETECTIONS {
            let shape = Shape::Mesh {
                positions: &positions,
                triangles: &triangles,
            };
            let definition = ToolDefinition {
                detection,
                ..ToolDefinition::new(shape)
            };
            let error = match world.create_tool(&definition) {
                Err(Error::InvalidArgument(error)) => error,
                other => panic!("{name}, {detection:?}: {other:?}"),
            };
            let error = error.to_string();
            for word in words {
                assert!(error.contains(word), "{name}, {detection:?}: {error:?} has no {word:?}");
            }
            assert_eq!(world.state_hash(), before, "{name}, {detection:?}");
        }
    }
    // The number of tools is unchanged.
    world.step(0.001).expect("a step");
}

const TISSUE: Tissue = Tissue::CALM;

#[test]
fn an_invalid_resolution_is_refused() {
    let (positions, triangles) = cube();
    let shape = Shape::Mesh {
        positions: &positions,
        triangles: &triangles,
    };
    let mut world = world(Vec3::ZERO);
    for detection in DETECTIONS {
        for resolution in [-1.0, f32::NAN, f32::INFINITY, 1e-9] {
            if detection == Detection::Exact && resolution == 1e-9 {
                continue;
            }
            let definition = ToolDefinition {
                detection,
                resolution,
                ..ToolDefinition::new(shape)
            };
            let error = world.create_tool(&definition).expect_err("refused").to_string();
            assert!(
                ["resolution", "cell", "pixel"].iter().any(|word| error.contains(word)),
                "{detection:?} {resolution}: {error}"
            );
        }
    }
}

/// Presses a ball into a cloth of this size with its center at `center`. Returns the force divided by stiffness times
/// size, and the relative depth.
fn press_force(detection: Detection, size: f32, center: Vec3) -> (Vec3, f64) {
    let mesh = moved(square(2.0 * size, 6), center);
    let mut world = world_of(Vec3::ZERO, 4);
    let cloth = Tissue {
        drag: 100.0,
        ..Tissue::CALM
    }
    .put(&mut world, &mesh);
    pin_all(&mut world, cloth, &rim(6));
    let round = ball(0.25 * size, 2);
    let at = |height: f32| center + Vec3::new(0.05, height, 0.03) * size;
    let tool = world
        .create_tool(&ToolDefinition {
            detection,
            resolution: if detection == Detection::Exact {
                0.0
            } else {
                0.02 * size
            },
            pose: Pose {
                position: at(0.3),
                orientation: Quat::IDENTITY,
            },
            ..ToolDefinition::new(Shape::Mesh {
                positions: &round.positions,
                triangles: &round.triangles,
            })
        })
        .expect("a tool");
    for step in 0..200 {
        let height = 0.3 - 0.3 * (step as f32 / 50.0).min(1.0);
        world.set_pose(tool, at(height), None).expect("a pose");
        let report = world.step(0.002).expect("a step");
        assert_eq!(report.bodies_restored, 0);
    }
    let solid = crate::support::solid::Solid::new(&round, world.pose(tool).expect("a tool"));
    let nodes = body(&world, cloth).positions().iter();
    let deepest = nodes.map(|node| -solid.signed_distance(node.as_dvec3()));
    let deepest = deepest.fold(f64::NEG_INFINITY, f64::max) / f64::from(size);
    let force = world.wrench(tool).expect("a tool").0;
    (force / (Tissue::CALM.stiffness * size), deepest)
}

#[test]
fn solids_press_alike_at_every_size_and_position() {
    let mut failures = Vec::new();
    for detection in [Detection::Exact, Detection::DistanceField] {
        let (force, depth) = press_force(detection, 0.1, Vec3::ZERO);
        assert!(force.y > 0.02 && depth < 0.01, "{detection:?}: {force}, {depth}");
        for (size, center, allowed) in [
            // A micrometer and a kilometer.
            (1e-6, Vec3::ZERO, 0.1),
            (1e3, Vec3::ZERO, 0.1),
            // At this distance from the origin, f32 resolves a thousandth of the size.
            (0.1, Vec3::new(800.0, -300.0, 500.0), 0.15),
        ] {
            let (other, deep) = press_force(detection, size, center);
            let error = (other - force).length() / force.length();
            if !(error < allowed) || !(deep < 0.01) {
                failures.push(format!(
                    "{detection:?} {size} m at {center}: {other} for {force}, {deep} deep"
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{}:\n{}", failures.len(), failures.join("\n"));
}
