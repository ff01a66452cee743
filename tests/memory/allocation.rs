//! A step allocates nothing, accepted or refused, nor does image-space detection.

use super::allocator::allocator_calls;
use glam::{Quat, Vec3};
use sinew::capi::body::{sinew_body_create, sinew_body_set_positions};
use sinew::capi::definition::{sinew_body_def, sinew_body_def_init};
use sinew::capi::detector::{
    SINEW_IMAGE_FORM_COUNTED, SINEW_IMAGE_FORM_INTERVALS, sinew_detector_create, sinew_detector_def,
    sinew_detector_def_init, sinew_detector_destroy, sinew_detector_find, sinew_detector_report,
};
use sinew::capi::tool::SINEW_DETECTION_IMAGE_SPACE;
use sinew::capi::world::{sinew_world_create, sinew_world_def_init, sinew_world_destroy};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{
    BladeDefinition, BodyContact, BodyDefinition, DebugCanvas, DebugDrawDefinition, Detection, Error, HapticDefinition,
    Material, Model, Pose, Rgba, Shape, Solver, Storage, Tearing, ToolDefinition, Values, Viscosity, World,
    WorldDefinition, Yielding,
};

#[test]
fn the_allocator_counts_calls() {
    assert!(allocator_calls(|| drop(vec![1_u8; 100])) >= 2);
}

#[test]
fn a_step_allocates_nothing() {
    steps_allocate_nothing(Storage::Packed, Solver::Verlet, &[0.0, 1e-4]);
    steps_allocate_nothing(Storage::Packed, Solver::Implicit, &[0.0, 1e-3]);
    steps_allocate_nothing(Storage::Packed, Solver::Newton, &[0.0]);
    for storage in [Storage::Efficient, Storage::FastLink, Storage::DynamicBulk] {
        for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
            steps_allocate_nothing(storage, solver, &[0.0]);
        }
    }
}

#[test]
fn a_blade_that_cuts_nothing_allocates_nothing() {
    let mesh = Mesh::cloth([0.1, 0.1], [9, 9]).expect("a cloth");
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            ..WorldDefinition::default()
        })
        .expect("a world");
        let edge = [Vec3::new(0.0, -0.01, 0.0), Vec3::new(0.0, 0.01, 0.0)];
        let blade = world
            .create_blade(&BladeDefinition {
                pose: Pose {
                    position: Vec3::new(-0.07, 0.0, 0.003),
                    ..Pose::IDENTITY
                },
                ..BladeDefinition::new(edge)
            })
            .expect("a blade");
        // The body is created after the blade.
        let cloth = BodyDefinition {
            masses: Values::Uniform(2e-4),
            stiffnesses: Values::Uniform(50.0),
            spare_nodes: 100,
            toughness: 1.0,
            solver,
            ..BodyDefinition::of(&mesh)
        };
        let body = world.create_body(&cloth).expect("a body");
        let mut contact_steps = 0;
        world.set_profiling(true).expect("room");
        for step in 0..40 {
            // The blade moves from beside the cloth against its border, and back.
            let part = (1.0 - (step as f32 / 20.0 - 1.0).abs()) * 0.0205;
            let target = Vec3::new(-0.07 + part, 0.0, 0.003);
            world.set_blade_pose(blade, target, None).expect("a pose");
            assert_eq!(allocator_calls(|| drop(world.step(1e-3))), 0, "{solver:?}, step {step}");
            contact_steps += usize::from(world.blade_report(blade).expect("a blade").force != Vec3::ZERO);
        }
        assert!(contact_steps > 0);
        assert_eq!(world.body(body).expect("a body").topology_version(), 0);
    }
}

#[test]
fn tissue_against_tissue_allocates_nothing() {
    let [upper, lower] = [0.0025, 0.0].map(|height| {
        let mut mesh = Mesh::cloth([0.1, 0.1], [9, 9]).expect("a cloth");
        mesh.positions
            .iter_mut()
            .for_each(|position| *position += Vec3::new(0.3 * height, height, height));
        mesh
    });
    for detection in [Detection::Exact, Detection::ImageSpace] {
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let mut first = None;
        for (mesh, pinned) in [(&upper, 0..0), (&lower, 0..100)] {
            let cloth = BodyDefinition {
                masses: Values::Uniform(2e-4),
                stiffnesses: Values::Uniform(50.0),
                contact: BodyContact {
                    thickness: 1e-3,
                    with_bodies: true,
                    with_itself: true,
                    detection,
                    ..BodyContact::NOTHING
                },
                ..BodyDefinition::of(mesh)
            };
            let cloth = world.create_body(&cloth).expect("a body");
            first.get_or_insert(cloth);
            for node in pinned {
                world.body_mut(cloth).and_then(|body| body.pin(node)).expect("a node");
            }
        }
        // A step with profiling allocates nothing either.
        world.set_profiling(detection == Detection::Exact).expect("room");
        for step in 0..40 {
            assert_eq!(
                allocator_calls(|| drop(world.step(0.002))),
                0,
                "{detection:?}, step {step}"
            );
        }
        // The cloths collided: the upper one would have fallen three centimeters.
        let new_positions = world.body(first.expect("a body")).expect("a body").positions();
        assert!(new_positions.iter().all(|position| position.y > 0.001), "{detection:?}");
    }
}

/// A canvas that draws nothing.
struct Nowhere;

impl DebugCanvas for Nowhere {
    fn line(&mut self, _: [Vec3; 2], _: Rgba) {}
    fn point(&mut self, _: Vec3, _: Rgba) {}
    fn triangle(&mut self, _: [Vec3; 3], _: Rgba) {}
}

#[test]
fn debug_drawing_allocates_nothing() {
    let mesh = Mesh::cloth([0.1, 0.1], [9, 9]).expect("a cloth");
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let cloth = BodyDefinition {
        masses: Values::Uniform(2e-4),
        stiffnesses: Values::Uniform(50.0),
        ..BodyDefinition::of(&mesh)
    };
    let cloth = world.create_body(&cloth).expect("a body");
    world.body_mut(cloth).and_then(|body| body.pin(0)).expect("a node");
    let mut ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
    ball.pose.position = Vec3::new(0.0, -0.01, 0.0);
    let ball = world.create_tool(&ball).expect("a tool");
    world.attach_node(cloth, 1, ball, 0.0).expect("an attachment");
    for _ in 0..5 {
        world.step(0.002).expect("a step");
    }
    assert!(world.contacts(ball).expect("a tool").next().is_some());
    let draw = || world.debug_draw(&DebugDrawDefinition::default(), &mut Nowhere);
    assert_eq!(allocator_calls(|| draw().expect("a drawing")), 0);
}

#[test]
fn a_step_that_tears_nothing_allocates_nothing() {
    let mesh = Mesh::cloth([0.1, 0.1], [9, 9]).expect("a cloth");
    let taut: Vec<Vec3> = mesh.positions.iter().map(|position| 1.3 * *position).collect();
    for is_taut in [false, true] {
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let cloth = BodyDefinition {
            positions: if is_taut { &taut } else { &mesh.positions },
            rest_positions: Some(&mesh.positions),
            triangles: &mesh.triangles,
            masses: Values::Uniform(2e-4),
            stiffnesses: Values::Uniform(50.0),
            spare_nodes: 100,
            tearing: Tearing {
                strain: 0.2,
                most_per_step: 1000,
                // No piece may be torn off.
                smallest_piece: 1.0,
                ..Tearing::default()
            },
            ..BodyDefinition::default()
        };
        let cloth = world.create_body(&cloth).expect("a body");
        for node in [0, 9] {
            world.body_mut(cloth).and_then(|body| body.pin(node)).expect("a node");
        }
        if is_taut {
            // All candidates have been tried, or the spare nodes are used up.
            for _ in 0..30 {
                world.step(1e-5).expect("a step");
            }
        }
        let mut steps_without_tears = 0;
        for step in 0..40 {
            let allocated = allocator_calls(|| drop(world.step(if is_taut { 1e-5 } else { 1e-3 })));
            let report = world.body(cloth).expect("a body").tear_report();
            assert!(
                allocated == 0 || report.tears > 0,
                "taut: {is_taut}, step {step}, {report:?}"
            );
            steps_without_tears += u32::from(report.tears == 0);
            assert_eq!(is_taut, report.no_room + report.small_pieces > 0, "{report:?}");
        }
        assert!(steps_without_tears > 20, "taut: {is_taut}: {steps_without_tears}");
    }
}

#[test]
fn a_step_with_readers_allocates_nothing() {
    let mesh = Mesh::cloth([0.1, 0.1], [9, 9]).expect("a cloth");
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let cloth = BodyDefinition {
        masses: Values::Uniform(2e-4),
        stiffnesses: Values::Uniform(50.0),
        spare_nodes: 300,
        ..BodyDefinition::of(&mesh)
    };
    let cloth = world.create_body(&cloth).expect("a body");
    let mut readers = [(), (), ()].map(|()| world.create_reader(cloth).expect("a reader"));
    for cut in 0..6 {
        let x = 0.017 * (cut as f32 - 2.4);
        let edge = |z: f32| [Vec3::new(x, -9.0, z), Vec3::new(x, 9.0, z)];
        let sweep = Sweep {
            start: edge(-0.1),
            end: edge(0.02),
        };
        world.cut(cloth, &sweep).expect("a cut");
        for step in 0..9 {
            assert_eq!(allocator_calls(|| drop(world.step(1e-3))), 0, "cut {cut}, step {step}");
            // One reader reads every step, one every third, and one holds a frame from before the last cut, so that
            // frames of old topologies are released too.
            for (reader, every) in readers.iter_mut().zip([1, 3, 8]) {
                if step % every == every - 1 {
                    assert_eq!(
                        allocator_calls(|| assert!(reader.read().is_new)),
                        0,
                        "cut {cut}, step {step}"
                    );
                }
            }
        }
    }
    assert!(world.body(cloth).expect("a body").topology_version() >= 6);
}

#[test]
fn a_haptic_tick_allocates_nothing() {
    let mesh = Mesh::cloth([0.1, 0.1], [9, 9]).expect("a cloth");
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let is_border = |rest: &Vec3| rest.x.abs().max(rest.z.abs()) > 0.049;
    let masses: Vec<f32> = mesh
        .positions
        .iter()
        .map(|rest| if is_border(rest) { 0.0 } else { 2e-4 })
        .collect();
    let cloth = BodyDefinition {
        masses: Values::Each(&masses),
        stiffnesses: Values::Uniform(50.0),
        ..BodyDefinition::of(&mesh)
    };
    world.create_body(&cloth).expect("a body");
    let mut handles = [-0.02, 0.02].map(|x| {
        let pose = Pose {
            position: Vec3::new(x, 0.02, 0.0),
            ..Pose::IDENTITY
        };
        let ball = ToolDefinition {
            pose,
            ..ToolDefinition::new(Shape::Sphere { radius: 0.01 })
        };
        let tool = world.create_tool(&ball).expect("a tool");
        Some((
            world.create_haptic(&HapticDefinition::new(tool)).expect("a handle"),
            pose,
        ))
    });
    let mut contact_ticks = 0;
    for tick in 0..600 {
        for (handle, pose) in handles.iter_mut().flatten() {
            pose.position.y -= 5e-5;
            let allocator_calls = allocator_calls(|| {
                let tick = handle.tick(*pose, None, None, 1e-3).expect("a tick");
                contact_ticks += u32::from(tick.force.length() > 0.01);
            });
            assert_eq!(allocator_calls, 0, "tick {tick}");
        }
        if tick == 500 {
            // The remains of the handle are not freed within a step.
            handles[1] = None;
        }
        if tick % 4 == 0 {
            assert_eq!(allocator_calls(|| drop(world.step(4e-3))), 0, "tick {tick}");
        }
    }
    assert!(contact_ticks > 100, "{contact_ticks}");
}

#[test]
fn a_detection_in_image_space_allocates_nothing() {
    let mesh = Mesh::organ(0.1, 0.01).expect("an organ");
    let mut moved = mesh.positions.clone();
    moved
        .iter_mut()
        .for_each(|position| *position += Vec3::new(0.03, 0.01, 0.02));
    let surface = mesh.surface().expect("memory");
    for form in [SINEW_IMAGE_FORM_INTERVALS, SINEW_IMAGE_FORM_COUNTED] {
        // SAFETY: definitions are filled by their init functions, pointers are to live objects, and the detector is
        // destroyed before its world.
        unsafe {
            let mut world_def = std::mem::zeroed();
            assert_eq!(sinew_world_def_init(&mut world_def, size_of_val(&world_def)), 0);
            let mut world = std::ptr::null_mut();
            assert_eq!(sinew_world_create(&world_def, &mut world), 0);
            let mut def: sinew_detector_def = std::mem::zeroed();
            assert_eq!(sinew_detector_def_init(&mut def, size_of_val(&def)), 0);
            for (body, positions) in def.bodies.iter_mut().zip([&mesh.positions, &moved]) {
                let mut body_def: sinew_body_def = std::mem::zeroed();
                assert_eq!(sinew_body_def_init(&mut body_def, size_of_val(&body_def)), 0);
                body_def.positions = positions.as_ptr().cast();
                body_def.node_count = positions.len();
                body_def.triangles = surface.as_ptr().cast();
                body_def.triangle_count = surface.len();
                body_def.node_mass = 1e-3;
                assert_eq!(sinew_body_create(world, &body_def, body), 0);
            }
            def.detection = SINEW_DETECTION_IMAGE_SPACE;
            def.form = form;
            def.pixel = 5e-4;
            let mut detector = std::ptr::null_mut();
            assert_eq!(sinew_detector_create(world, &def, &mut detector), 0);
            let mut report: sinew_detector_report = std::mem::zeroed();
            report.struct_size = size_of_val(&report);
            for shift in [Vec3::ZERO, Vec3::new(-0.02, 0.0, -0.01)] {
                let new_positions: Vec<_> = moved.iter().map(|position| *position + shift).collect();
                let (data, count) = (new_positions.as_ptr().cast(), new_positions.len());
                assert_eq!(sinew_body_set_positions(world, def.bodies[1], data, count), 0);
                let find = || assert_eq!(sinew_detector_find(detector, world, &mut report), 0);
                assert_eq!(allocator_calls(find), 0, "form {form}");
                assert!(report.edge_counts.iter().all(|&count| count > 10), "they overlap");
            }
            sinew_detector_destroy(detector);
            sinew_world_destroy(world);
        }
    }
}

fn steps_allocate_nothing(storage: Storage, solver: Solver, tolerances: &[f32]) {
    let mesh = Mesh::cloth([0.2, 0.2], [12, 12]).expect("a cloth");
    for &tolerance in tolerances {
        let definition = WorldDefinition {
            tolerance,
            ..WorldDefinition::default()
        };
        let mut world = World::new(definition).expect("a world");
        let cloth = BodyDefinition {
            masses: Values::Uniform(2e-4),
            stiffnesses: Values::Uniform(50.0),
            node_dampings: Values::Uniform(1e-3),
            spring_dampings: Values::Uniform(1e-3),
            storage,
            solver,
            ..BodyDefinition::of(&mesh)
        };
        let cloth = world.create_body(&cloth).expect("a body");
        world.body_mut(cloth).and_then(|body| body.pin(0)).expect("a node");
        let capsule = Shape::Capsule {
            radius: 0.01,
            half_length: 0.03,
        };
        let mut tools = Vec::new();
        for (shape, height) in [
            (capsule, 0.02),
            (Shape::Plane, -0.03),
            (Shape::Sphere { radius: 0.02 }, 0.03),
        ] {
            let definition = ToolDefinition {
                friction: 0.4,
                pose: Pose {
                    position: Vec3::Y * height,
                    ..Pose::IDENTITY
                },
                ..ToolDefinition::new(shape)
            };
            tools.push(world.create_tool(&definition).expect("a tool"));
        }
        let body = world.body_mut(cloth).expect("a body");
        body.apply_force(5, Vec3::Y * 0.01).expect("a force");
        let steps = match solver {
            Solver::Verlet | Solver::Auto => 40,
            Solver::Implicit => 8,
            Solver::Newton => 3,
        };
        for step in 0..steps {
            let rotation = Quat::from_rotation_x(0.05 * step as f32);
            let target = Vec3::Y * (0.02 - 0.0005 * step as f32);
            world.set_pose(tools[0], target, Some(rotation)).expect("a pose");
            assert_eq!(
                allocator_calls(|| drop(world.step(0.004))),
                0,
                "{storage:?}, {solver:?}, tolerance {tolerance}, step {step}"
            );
        }
        if solver != Solver::Verlet {
            // These solvers refuse no step.
            continue;
        }
        let refused = allocator_calls(|| assert!(matches!(world.step(1e6), Err(Error::Unstable { .. }))));
        assert_eq!(refused, 0);
    }
}

#[test]
fn a_step_with_dynamic_tools_allocates_nothing() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let cloth = |world: &mut World, height: f32| {
            let mesh = Mesh::cloth([0.2, 0.2], [6, 6]).expect("a cloth");
            let positions: Vec<Vec3> = mesh.positions.iter().map(|at| *at + Vec3::Y * height).collect();
            let definition = BodyDefinition {
                positions: &positions,
                triangles: &mesh.triangles,
                masses: Values::Uniform(2e-3),
                stiffnesses: Values::Uniform(50.0),
                spring_dampings: Values::Uniform(1e-2),
                solver,
                ..BodyDefinition::default()
            };
            world.create_body(&definition).expect("a body")
        };
        let tool = |world: &mut World, shape: Shape, height: f32| {
            let mut definition = ToolDefinition::new(shape);
            definition.pose.position = Vec3::Y * height;
            let tool = world.create_tool(&definition).expect("a tool");
            if shape != Shape::Plane {
                let mass = world.mass_of_density(tool, 300.0).expect("a mass");
                world.set_dynamic(tool, Some(&mass)).expect("a dynamic tool");
            }
        };
        // Bodies and tools that are created before and after the first dynamic tool.
        cloth(&mut world, 0.0);
        tool(&mut world, Shape::Sphere { radius: 0.02 }, 0.03);
        cloth(&mut world, -0.005);
        tool(&mut world, Shape::Plane, -0.01);
        tool(&mut world, Shape::Sphere { radius: 0.01 }, 0.06);
        for step in 0..30 {
            assert_eq!(
                allocator_calls(|| drop(world.step(0.008))),
                0,
                "{solver:?}, step {step}"
            );
        }
    }
}

#[test]
fn a_step_with_cavity_pressure_allocates_nothing() {
    let block = Mesh::block([0.05; 3], [3; 3]).expect("a block");
    for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let body = BodyDefinition {
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(50.0),
            enclosed_stiffness: 1000.0,
            pressure: 100.0,
            solver,
            ..BodyDefinition::of(&block)
        };
        let body = world.create_body(&body).expect("a body");
        for step in 0..4 {
            assert_eq!(
                allocator_calls(|| drop(world.step(0.004))),
                0,
                "{solver:?}, step {step}"
            );
            let body = world.body_mut(body).expect("the body");
            assert_eq!(allocator_calls(|| drop(body.set_pressure(100.0 * step as f32))), 0);
            drop(body.remove_spring(0, step + 1));
        }
    }
}

#[test]
fn a_step_with_internal_variables_allocates_nothing() {
    let block = Mesh::block([0.05; 3], [3; 3]).expect("a block");
    let plain = BodyDefinition {
        viscosity: Viscosity {
            retardation_time: 0.02,
            relaxation_time: 0.01,
        },
        yielding: Yielding {
            strain: 1e-3,
            ..Yielding::default()
        },
        ..BodyDefinition::of(&block)
    };
    let springs = BodyDefinition {
        masses: Values::Uniform(1e-3),
        stiffnesses: Values::Uniform(50.0),
        strain_limit: 1e-3,
        ..plain
    };
    let tetrahedra = BodyDefinition {
        material: Some(Material {
            model: Model::Tetrahedra,
            young_modulus: 5000.0,
            poisson_ratio: 0.45,
            density: 1000.0,
            ..Material::default()
        }),
        ..plain
    };
    for definition in [springs, tetrahedra] {
        for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
            let mut world = World::new(WorldDefinition::default()).expect("a world");
            let body = world.create_body(&BodyDefinition { solver, ..definition });
            let body = body.expect("a body");
            let pinned = world.body_mut(body).expect("the body");
            pinned.pin(0).expect("a node");
            pinned.pin_axes(5, [true, false, true]).expect("a node");
            for step in 0..4 {
                assert_eq!(
                    allocator_calls(|| drop(world.step(0.004))),
                    0,
                    "{solver:?}, step {step}"
                );
                let body = world.body_mut(body).expect("the body");
                drop(body.remove_spring(0, step + 1));
            }
        }
    }
}

#[test]
fn detection_in_image_space_allocates_nothing() {
    use sinew::detection::image_space::{Form, ImageSpace, ImageSpaceDefinition, LayeredImage, Placed, Surface};
    let organ = Mesh::block([0.1; 3], [6; 3]).expect("a block");
    let triangles = organ.surface().expect("its surface");
    let surface = Surface::closed(organ.positions.len(), &triangles).expect("closed");
    let moved: Vec<Vec3> = organ
        .positions
        .iter()
        .map(|&p| p * 0.9 + Vec3::new(0.03, 0.02, 0.04))
        .collect();
    let bodies = [&organ.positions, &moved].map(|positions| Placed {
        surface: &surface,
        positions,
        thickness: 0.001,
    });
    for form in [Form::Intervals, Form::Counted] {
        // Capacity for the coarser pixels only.
        let definition = ImageSpaceDefinition {
            form,
            pixels: 2000,
            crossings: 5000,
            ..ImageSpaceDefinition::new(0.001)
        };
        let mut detector = ImageSpace::new(&definition, &[&surface]).expect("a detector");
        let mut found = 0;
        let count = allocator_calls(|| {
            let overlap = detector.detect(&bodies).expect("an overlap");
            assert!(overlap.pixel > 0.001);
            found = overlap.inside[0].edges.len() + overlap.inside[1].edges.len();
        });
        assert_eq!(count, 0, "{form:?}");
        assert!(found > 20, "{form:?}");
    }
    let image = LayeredImage::new(&organ.positions, &triangles, 0.001).expect("an image");
    let mut near = 0;
    let count = allocator_calls(|| {
        near = moved
            .iter()
            .filter(|&&point| image.distance(point, 0.01).is_some())
            .count()
    });
    assert_eq!(count, 0);
    assert!(near > 20);
}

#[test]
fn a_step_with_attachments_that_break_allocates_nothing() {
    let mesh = Mesh::cloth([0.2, 0.2], [12, 12]).expect("a cloth");
    for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let cloth = BodyDefinition {
            masses: Values::Uniform(2e-4),
            stiffnesses: Values::Uniform(50.0),
            node_dampings: Values::Uniform(1e-3),
            solver,
            ..BodyDefinition::of(&mesh)
        };
        let cloth = world.create_body(&cloth).expect("a body");
        let tool = ToolDefinition::new(Shape::Sphere { radius: 0.02 });
        let tool = world.create_tool(&tool).expect("a tool");
        world.attach_nodes(cloth, &[0, 5, 80], tool, 0.0).expect("attachments");
        // The first step breaks some of these attachments, later steps the rest.
        for (node, limit) in [(100, 1e-6), (101, 1e-6), (110, 0.05), (120, 0.1)] {
            world.attach_node(cloth, node, tool, limit).expect("an attachment");
        }
        let mut lost = 0;
        for step in 0..8 {
            let position = Vec3::Y * (1e-3 * (step * step) as f32);
            world
                .set_pose(tool, position, Some(Quat::from_rotation_x(0.02 * step as f32)))
                .expect("a pose");
            assert_eq!(
                allocator_calls(|| drop(world.step(0.004))),
                0,
                "{solver:?}, step {step}"
            );
            lost += world.slipped().len();
        }
        assert!(lost >= 2, "{solver:?}: {lost} lost");
    }
}
