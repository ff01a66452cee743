//! Each feature of a body, in motion, compressed and cut: saved in the middle of a run, it continues bitwise
//! identically.

use crate::support::scene::SOLVERS;
use glam::{Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{
    BodyContact, BodyDefinition, BodyId, Detection, ElementLaw, Material, Model, Shape, Sleep, Solver, SpringLaw,
    Storage, Tearing, ToolDefinition, ToolId, Values, Viscosity, World, WorldDefinition, Yielding,
};

/// A block of tissue or a sheet, held at some nodes, and a tool that moves down on it.
struct Scene {
    world: World,
    body: BodyId,
    tool: ToolId,
}

const ELEMENTS: Material = Material {
    model: Model::Tetrahedra,
    young_modulus: 3e3,
    poisson_ratio: 0.3,
    density: 1000.0,
    thickness: 0.0,
};

const SPRINGS: Material = Material {
    model: Model::Springs,
    poisson_ratio: 0.25,
    ..ELEMENTS
};

const FIBRES: [Vec3; 300] = [Vec3::X; 300];

type Change = fn(&mut BodyDefinition);

/// Features of a block beside springs.
const BLOCK_FEATURES: [(&str, Change); 17] = [
    ("PACKED", |_| ()),
    ("EFFICIENT", |body| body.storage = Storage::Efficient),
    ("FAST_LINK", |body| {
        (body.storage, body.springs_per_node) = (Storage::FastLink, 60)
    }),
    ("DYNAMIC_BULK", |body| body.storage = Storage::DynamicBulk),
    ("damped springs", |body| body.spring_dampings = Values::Uniform(1e-2)),
    ("damped springs by lists", |body| {
        (body.storage, body.spring_dampings) = (Storage::DynamicBulk, Values::Uniform(1e-2))
    }),
    ("elements", |body| body.material = Some(ELEMENTS)),
    ("elements of Poisson's ratio 0.45", |body| {
        body.material = Some(Material {
            poisson_ratio: 0.45,
            ..ELEMENTS
        })
    }),
    ("neo-Hookean elements", |body| {
        body.material = Some(ELEMENTS);
        body.element_law = ElementLaw::NeoHookean;
    }),
    ("elements of Mooney and Rivlin", |body| {
        body.material = Some(Material {
            poisson_ratio: 0.45,
            ..ELEMENTS
        });
        body.element_law = ElementLaw::MooneyRivlin { ratio: 0.3 };
    }),
    ("elements that creep", |body| {
        body.material = Some(ELEMENTS);
        body.viscosity = Viscosity {
            retardation_time: 0.01,
            relaxation_time: 0.05,
        };
    }),
    ("elements that yield", |body| {
        body.material = Some(ELEMENTS);
        body.yielding = Yielding {
            strain: 0.01,
            largest: 0.5,
        };
    }),
    ("volumes", |body| body.volume_stiffness = 1e4),
    ("fibres", |body| {
        body.fibre_directions = &FIBRES[..body.tetrahedra.len()];
        body.fibre_stiffnesses = Values::Uniform(1e3);
    }),
    ("a home", |body| body.home_stiffnesses = Values::Uniform(0.3)),
    ("an enclosed volume", |body| {
        (body.enclosed_stiffness, body.pressure) = (1e3, 5.0)
    }),
    ("tolerance of mass scaling", |body| body.mass_scaling = 0.05),
];

/// Features of a sheet.
const SHEET_FEATURES: [(&str, Change); 9] = [
    ("a sheet", |_| ()),
    ("bending", |body| body.bending_stiffness = 1e-6),
    ("a strain limit", |body| body.strain_limit = 0.05),
    ("a law of springs", |body| {
        body.spring_law = SpringLaw::Exponential {
            steepness: 5.0,
            limit: 0.3,
        }
    }),
    ("springs that creep", |body| body.viscosity.retardation_time = 0.01),
    ("springs that yield", |body| body.yielding.strain = 0.02),
    ("tearing", |body| {
        body.tearing = Tearing {
            strain: 0.1,
            most_per_step: 2,
            ..Tearing::default()
        };
    }),
    ("sleep", |body| {
        body.sleep = Sleep {
            speed: 0.05,
            time: 0.005,
        }
    }),
    ("contact with itself", |body| {
        body.contact = BodyContact {
            with_itself: true,
            with_bodies: true,
            ..BodyContact::default()
        };
    }),
];

impl Scene {
    /// `None` if the settings conflict.
    fn new(is_block: bool, solver: Solver, change: Change, room: u32) -> Option<Self> {
        let mesh = if is_block {
            Mesh::block([0.06; 3], [3, 3, 3])
        } else {
            Mesh::cloth([0.06; 2], [8, 8])
        }
        .expect("a mesh");
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let mut definition = BodyDefinition {
            material: is_block.then_some(SPRINGS),
            node_dampings: Values::Uniform(5e-3),
            spare_nodes: room,
            solver,
            ..BodyDefinition::of(&mesh)
        };
        if !is_block {
            definition.masses = Values::Uniform(1e-3);
            definition.stiffnesses = Values::Uniform(20.0);
        }
        change(&mut definition);
        let body = world.create_body(&definition).ok()?;
        for (node, position) in mesh.positions.iter().enumerate() {
            if position.x < -0.029 {
                world.body_mut(body).expect("a body").pin(node as u32).expect("a pin");
            }
        }
        let mut tool = ToolDefinition::new(Shape::Sphere { radius: 0.015 });
        tool.pose.position = vec3(0.01, 0.05, 0.01);
        let tool = world.create_tool(&tool).expect("a tool");
        Some(Self { world, body, tool })
    }
}

/// Performs the actions of a step: the tool moves down and up, a blade passes through, a corner is pulled.
fn step(world: &mut World, body: BodyId, tool: ToolId, step: usize, is_cuttable: bool) {
    let height = 0.05 - 0.0015 * step.min(60 - step.min(60)) as f32;
    world.set_pose(tool, vec3(0.01, height, 0.01), None).expect("a pose");
    if is_cuttable && (8..22).contains(&step) {
        let at = |step: usize| vec3(0.005, -0.1, -0.04 + 0.005 * (step - 8) as f32);
        let edge = |step: usize| [at(step), at(step) + 0.2 * Vec3::Y];
        let sweep = Sweep {
            start: edge(step),
            end: edge(step + 1),
        };
        world.cut(body, &sweep).expect("a cut");
    }
    let last = world.body(body).expect("a body").node_count() as u32 - 1;
    world
        .body_mut(body)
        .expect("a body")
        .apply_force(last, vec3(0.2, 0.0, 0.1))
        .expect("a force");
    world.step(2e-3).expect("a step");
}

fn bits(world: &World, body: BodyId) -> Vec<u32> {
    let body = world.body(body).expect("a body");
    let vectors = body.positions().iter().chain(body.velocities());
    let bits = vectors.flat_map(|vector| vector.to_array().map(f32::to_bits));
    bits.chain(body.surface().iter().flatten().copied()).collect()
}

#[test]
fn every_feature_continues_bitwise() {
    let [made, cut] = check_bitwise_continuation(is_short);
    assert!(made > 40 && cut > 16, "{made} bodies, {cut} cut");
}

#[test]
#[ignore = "long"]
fn every_feature_continues_bitwise_with_the_other_solvers() {
    let [made, cut] = check_bitwise_continuation(|feature, solver| !is_short(feature, solver));
    assert!(made > 80 && cut > 34, "{made} bodies, {cut} cut");
}

/// One solver for each feature; NEWTON, which is slow for blocks, for sheets only.
fn is_short(feature: usize, solver: usize) -> bool {
    let solvers = if feature < BLOCK_FEATURES.len() { 2 } else { 3 };
    feature % solvers == solver
}

/// Runs these features and solvers; returns the number of bodies created, and of those cut.
fn check_bitwise_continuation(is_selected: fn(usize, usize) -> bool) -> [usize; 2] {
    let [mut made, mut cut] = [0; 2];
    let blocks = BLOCK_FEATURES.iter().map(|feature| (true, feature));
    let all = blocks.chain(SHEET_FEATURES.iter().map(|feature| (false, feature)));
    for (feature, (is_block, (name, change))) in all.enumerate() {
        for (_, solver) in (0..).zip(SOLVERS).filter(|&(number, _)| is_selected(feature, number)) {
            for room in [0, 600] {
                let Some(Scene { mut world, body, tool }) = Scene::new(is_block, solver, *change, room) else {
                    continue;
                };
                let is_cuttable = room > 0;
                made += 1;
                cut += usize::from(is_cuttable);
                let mut twin = None;
                for at in 0..22 {
                    if [5, 14].contains(&at) {
                        let bytes = world.save().expect("bytes");
                        let threads = if at == 5 { 1 } else { 2 };
                        twin = Some(World::load(&bytes, threads, None).expect("a world"));
                    }
                    for world in twin.iter_mut().chain([&mut world]) {
                        step(world, body, tool, at, is_cuttable);
                    }
                    if let Some(twin) = &twin {
                        assert_eq!(
                            twin.state_hash(),
                            world.state_hash(),
                            "{name}, {solver:?}, room {room}, step {at}"
                        );
                        assert!(
                            bits(twin, body) == bits(&world, body),
                            "{name}, {solver:?}, room {room}, step {at}"
                        );
                        assert_eq!(twin.wrench(tool).expect("a tool"), world.wrench(tool).expect("a tool"));
                    }
                }
                let world = world.body(body).expect("a body");
                let moved = world.velocities().iter().any(|velocity| *velocity != Vec3::ZERO);
                assert!(moved || *name == "sleep", "{name}, {solver:?}");
                if is_cuttable {
                    assert!(
                        world.changes_since(0).expect("changes").triangles.len() > 5,
                        "{name}, {solver:?}"
                    );
                }
            }
        }
    }
    [made, cut]
}

/// The contact data of a tool is saved with it.
#[test]
fn tools_of_every_kind_continue_bitwise() {
    let rod = Mesh::block([0.02, 0.03, 0.02], [2, 3, 2]).expect("a mesh");
    let shapes = [
        Shape::Sphere { radius: 0.015 },
        Shape::Capsule {
            radius: 0.01,
            half_length: 0.01,
        },
        Shape::Mesh {
            positions: &rod.positions,
            triangles: &rod.triangles,
        },
    ];
    for (kind, shape) in shapes.into_iter().enumerate() {
        for detection in [Detection::Exact, Detection::ImageSpace, Detection::DistanceField] {
            let Some(Scene { mut world, body, tool }) = Scene::new(true, Solver::Verlet, |_| (), 0) else {
                unreachable!("plain blocks are made");
            };
            world.destroy_tool(tool).expect("a tool");
            let mut definition = ToolDefinition {
                detection,
                friction: 0.4,
                ..ToolDefinition::new(shape)
            };
            definition.pose.position = vec3(0.01, 0.05, 0.01);
            if detection != Detection::Exact {
                definition.resolution = 2e-3;
            }
            let Ok(tool) = world.create_tool(&definition) else {
                assert!(detection == Detection::DistanceField && kind < 2);
                continue;
            };
            let mut twin = None;
            for at in 0..30 {
                if at == 17 {
                    assert!(world.contacts(tool).expect("a tool").count() > 0);
                    let bytes = world.save().expect("bytes");
                    twin = Some(World::load(&bytes, 2, None).expect("a world"));
                }
                for world in twin.iter_mut().chain([&mut world]) {
                    step(world, body, tool, at, false);
                }
                if let Some(twin) = &twin {
                    assert_eq!(
                        twin.state_hash(),
                        world.state_hash(),
                        "{kind}, {detection:?}, step {at}"
                    );
                    assert_eq!(twin.wrench(tool).expect("a tool"), world.wrench(tool).expect("a tool"));
                }
            }
        }
    }
}
