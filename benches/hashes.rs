//! Prints the state hash after some steps, one line for each scene and SIMD level.
//!
//! `.ci/hashes COMMIT` compares them with those of another commit. A change that only moves code must not change any of
//! them.
//!
//! `cargo bench --bench hashes [-- part of a scene's name]`
#![allow(clippy::print_stdout)]

use glam::{Quat, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{
    Anchor, BladeDefinition, BodyContact, BodyDefinition, Detection, ElementLaw, Error, Kernel, MassProperties,
    Material, Model, RestStateDefinition, Result, Shape, Sleep, Solver, SpringLaw, Storage, SutureDefinition, Tearing,
    ToolDefinition, Values, Viscosity, World, WorldDefinition, Yielding,
};

const SOLVERS: [Solver; 3] = [Solver::Verlet, Solver::Implicit, Solver::Newton];

const ELEMENTS: Material = Material {
    model: Model::Tetrahedra,
    young_modulus: 5000.0,
    poisson_ratio: 0.3,
    density: 1000.0,
    thickness: 0.0,
};

/// Runs a scene at a SIMD level and returns its world, whose hash is printed.
type Scene = Box<dyn Fn(Kernel) -> Result<World>>;

fn world(kernel: Kernel) -> Result<World> {
    World::new(WorldDefinition {
        kernel,
        ..WorldDefinition::default()
    })
}

/// A block of springs, 6 x 4 x 6 cm.
fn springs(mesh: &Mesh) -> BodyDefinition<'_> {
    BodyDefinition {
        positions: &mesh.positions,
        triangles: &mesh.triangles,
        tetrahedra: &mesh.tetrahedra,
        masses: Values::Uniform(1e-3),
        stiffnesses: Values::Uniform(50.0),
        spring_dampings: Values::Uniform(1e-3),
        node_dampings: Values::Uniform(1e-3),
        ..BodyDefinition::default()
    }
}

fn elements(mesh: &Mesh) -> BodyDefinition<'_> {
    BodyDefinition {
        masses: Values::Uniform(0.0),
        stiffnesses: Values::Uniform(0.0),
        spring_dampings: Values::Uniform(0.0),
        material: Some(ELEMENTS),
        ..springs(mesh)
    }
}

/// Presses a tool onto the middle of a body from above, turns it and moves it aside.
fn press(world: &mut World, tool: &ToolDefinition, top: f32) -> Result<()> {
    let tool = world.create_tool(tool)?;
    for step in 0..20 {
        let progress = step as f32 / 20.0;
        let position = vec3(0.01 * progress, top - 0.012 * progress, 0.0);
        world.set_pose(tool, position, Some(Quat::from_rotation_y(progress)))?;
        world.step(4e-3)?;
    }
    Ok(())
}

/// A body fixed at its left side, pressed by a ball and released.
fn hang(kernel: Kernel, definition: &BodyDefinition) -> Result<World> {
    let mut world = world(kernel)?;
    let body = world.create_body(definition)?;
    let [low, high] = [Vec3::splat(-1.0), vec3(-0.029, 1.0, 1.0)];
    world.body_mut(body)?.pin_box(low, high)?;
    let top = definition
        .positions
        .iter()
        .map(|position| position.y)
        .fold(f32::MIN, f32::max);
    press(
        &mut world,
        &ToolDefinition::new(Shape::Sphere { radius: 0.01 }),
        top + 0.011,
    )?;
    Ok(world)
}

/// Every storage and term with every solver.
fn bodies(scenes: &mut Vec<(String, Scene)>) {
    type Change = fn(&mut BodyDefinition);
    let of_springs: [(&str, Change); 14] = [
        ("packed", |_| {}),
        ("efficient", |body| body.storage = Storage::Efficient),
        ("fast link", |body| body.storage = Storage::FastLink),
        ("dynamic bulk", |body| body.storage = Storage::DynamicBulk),
        ("volume", |body| body.volume_stiffness = 500.0),
        ("anchors", |body| body.home_stiffnesses = Values::Uniform(5.0)),
        ("exponential", |body| {
            body.spring_law = SpringLaw::Exponential {
                steepness: 5.0,
                limit: 0.5,
            };
        }),
        ("cubic", |body| {
            body.spring_law = SpringLaw::Cubic {
                quadratic: 1.0,
                cubic: 2.0,
                limit: 0.5,
            };
        }),
        ("dashpots", |body| body.viscosity.retardation_time = 0.01),
        ("Maxwell springs", |body| {
            body.viscosity = Viscosity {
                retardation_time: 0.02,
                relaxation_time: 0.05,
            };
        }),
        ("plastic springs", |body| {
            body.yielding = Yielding {
                strain: 0.02,
                largest: 0.3,
            };
        }),
        ("strain limit", |body| body.strain_limit = 0.05),
        ("cavity", |body| {
            body.enclosed_stiffness = 1e4;
            body.pressure = 20.0;
        }),
        ("sleep", |body| {
            body.sleep = Sleep { speed: 0.5, time: 0.01 };
        }),
    ];
    let of_elements: [(&str, Change); 7] = [
        ("St Venant-Kirchhoff", |_| {}),
        ("neo-Hookean", |body| body.element_law = ElementLaw::NeoHookean),
        ("Mooney-Rivlin", |body| {
            body.element_law = ElementLaw::MooneyRivlin { ratio: 0.3 }
        }),
        ("nodal pressure", |body| {
            body.material = Some(Material {
                poisson_ratio: 0.47,
                ..ELEMENTS
            });
        }),
        ("viscous elements", |body| body.viscosity.retardation_time = 1e-3),
        ("Maxwell elements", |body| {
            body.viscosity = Viscosity {
                retardation_time: 0.02,
                relaxation_time: 0.05,
            };
        }),
        ("plastic elements", |body| body.yielding.strain = 0.02),
    ];
    for solver in SOLVERS {
        let mut add = |name: &str, has_elements: bool, change: Change| {
            let scene = move |kernel| {
                let mesh = Mesh::block([0.06, 0.04, 0.06], [6, 4, 6])?;
                let mut body = if has_elements { elements(&mesh) } else { springs(&mesh) };
                body.solver = solver;
                change(&mut body);
                hang(kernel, &body)
            };
            scenes.push((format!("{name}, {solver:?}"), Box::new(scene)));
        };
        of_springs
            .into_iter()
            .for_each(|(name, change)| add(name, false, change));
        of_elements
            .into_iter()
            .for_each(|(name, change)| add(name, true, change));
        let cloth = move |kernel| {
            let mesh = Mesh::cloth([0.06, 0.06], [9, 9])?;
            hang(
                kernel,
                &BodyDefinition {
                    bending_stiffness: 1e-5,
                    solver,
                    ..springs(&mesh)
                },
            )
        };
        scenes.push((format!("bending, {solver:?}"), Box::new(cloth)));
        let fibers = move |kernel| {
            let mesh = Mesh::block([0.06, 0.04, 0.06], [6, 4, 6])?;
            let directions = vec![Vec3::X; mesh.tetrahedra.len()];
            hang(
                kernel,
                &BodyDefinition {
                    fibre_directions: &directions,
                    fibre_stiffnesses: Values::Uniform(2e4),
                    solver,
                    ..springs(&mesh)
                },
            )
        };
        scenes.push((format!("fibers, {solver:?}"), Box::new(fibers)));
    }
}

/// Every tool shape and detection, on springs and elements with every solver.
fn tools(scenes: &mut Vec<(String, Scene)>) {
    const SHAPES: [&str; 7] = [
        "capsule",
        "plane",
        "box",
        "mesh",
        "mesh in images",
        "mesh in a field",
        "dynamic",
    ];
    for solver in SOLVERS {
        for name in SHAPES {
            let scene = move |kernel| {
                let mut world = world(kernel)?;
                let mesh = Mesh::block([0.06, 0.04, 0.06], [6, 4, 6])?;
                let body = world.create_body(&BodyDefinition {
                    solver,
                    ..elements(&mesh)
                })?;
                let [low, high] = [Vec3::splat(-1.0), vec3(1.0, -0.019, 1.0)];
                world.body_mut(body)?.pin_box(low, high)?;
                let cube = Mesh::block([0.02; 3], [1; 3])?;
                let mut tool = ToolDefinition::new(match name {
                    "capsule" => Shape::Capsule {
                        radius: 0.01,
                        half_length: 0.02,
                    },
                    "plane" => Shape::Plane,
                    "box" | "dynamic" => Shape::Box {
                        half_extents: Vec3::splat(0.01),
                    },
                    _ => Shape::Mesh {
                        positions: &cube.positions,
                        triangles: &cube.triangles,
                    },
                });
                tool.friction = 0.3;
                tool.detection = match name {
                    "mesh in images" => Detection::ImageSpace,
                    "mesh in a field" => Detection::DistanceField,
                    _ => Detection::Exact,
                };
                tool.pose.position = Vec3::Y * 0.031;
                match name {
                    "dynamic" => {
                        let tool = world.create_tool(&tool)?;
                        let mass: MassProperties = world.mass_of_density(tool, 2000.0)?;
                        world.set_dynamic(tool, Some(&mass))?;
                        (0..20).try_for_each(|_| world.step(4e-3).map(drop))?;
                    }
                    "plane" => {
                        tool.pose.position = Vec3::Y * 0.021;
                        tool.pose.orientation = Quat::from_rotation_x(std::f32::consts::PI);
                        let tool = world.create_tool(&tool)?;
                        for step in 0..20 {
                            world.set_pose(tool, Vec3::Y * (0.021 - 2e-4 * step as f32), None)?;
                            world.step(4e-3)?;
                        }
                    }
                    _ => press(&mut world, &tool, 0.031)?,
                }
                Ok(world)
            };
            scenes.push((format!("{name}, {solver:?}"), Box::new(scene)));
        }
    }
}

/// Tissue in contact with tissue, attached, sutured and grasped.
fn tissue(scenes: &mut Vec<(String, Scene)>) {
    for solver in SOLVERS {
        for name in [
            "tissue on tissue",
            "tissue in images",
            "a fold",
            "attached",
            "sutured",
            "grasped",
        ] {
            let scene = move |kernel| {
                let mut world = world(kernel)?;
                let mesh = Mesh::block([0.06, 0.02, 0.06], [6, 2, 6])?;
                let above: Vec<Vec3> = mesh
                    .positions
                    .iter()
                    .map(|position| position + 0.022 * Vec3::Y)
                    .collect();
                let lower = BodyDefinition {
                    contact: BodyContact {
                        thickness: 1e-3,
                        friction: 0.4,
                        with_bodies: true,
                        with_itself: name == "a fold",
                        detection: match name {
                            "tissue in images" => Detection::ImageSpace,
                            _ => Detection::Exact,
                        },
                        ..BodyContact::default()
                    },
                    solver,
                    ..springs(&mesh)
                };
                let bodies = [
                    world.create_body(&lower)?,
                    world.create_body(&BodyDefinition {
                        positions: &above,
                        ..lower
                    })?,
                ];
                let [low, high] = [Vec3::splat(-1.0), vec3(1.0, -0.009, 1.0)];
                world.body_mut(bodies[0])?.pin_box(low, high)?;
                let anchors = [bodies[0], bodies[1]].map(|_| Anchor::Node(5));
                match name {
                    "attached" => {
                        world.attach_to_body(bodies[0], &anchors[..1], bodies[1], &anchors[1..], 0.0)?;
                    }
                    "sutured" => {
                        let thread = SutureDefinition {
                            length: Some(0.01),
                            ..SutureDefinition::default()
                        };
                        world.suture(bodies[0], &anchors[0], bodies[1], &anchors[1], &thread)?;
                    }
                    _ => {}
                }
                let mut ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
                ball.pose.position = Vec3::Y * 0.044;
                if name == "grasped" {
                    let ball = world.create_tool(&ball)?;
                    world.attach_nodes(bodies[1], &[3, 4, 5], ball, 0.0)?;
                    for step in 0..20 {
                        world.set_pose(ball, Vec3::Y * (0.044 + 5e-4 * step as f32), None)?;
                        world.step(4e-3)?;
                    }
                } else {
                    press(&mut world, &ball, 0.044)?;
                }
                Ok(world)
            };
            scenes.push((format!("{name}, {solver:?}"), Box::new(scene)));
        }
    }
}

/// Cuts, blades, tears and static equilibria, of sheets and solids.
fn topology(scenes: &mut Vec<(String, Scene)>) {
    for solver in SOLVERS {
        for is_solid in [false, true] {
            for name in ["cut", "blade", "tear", "rest state"] {
                let scene = move |kernel| {
                    let mut world = world(kernel)?;
                    let mesh = match is_solid {
                        true => Mesh::block([0.06, 0.02, 0.06], [5, 2, 5])?,
                        false => Mesh::cloth([0.06, 0.06], [8, 8])?,
                    };
                    let mut definition = if is_solid { elements(&mesh) } else { springs(&mesh) };
                    definition.solver = solver;
                    definition.spare_nodes = 2000;
                    definition.toughness = 0.01;
                    if name == "tear" {
                        definition.tearing = Tearing {
                            strain: 0.05,
                            most_per_step: 2,
                            ..Tearing::default()
                        };
                    }
                    let body = world.create_body(&definition)?;
                    let [low, high] = [Vec3::splat(-1.0), vec3(-0.029, 1.0, 1.0)];
                    world.body_mut(body)?.pin_box(low, high)?;
                    let edge = [vec3(0.004, -0.03, 0.0), vec3(0.006, 0.03, 0.0)];
                    match name {
                        "cut" => {
                            let [start, end] = [-0.05, 0.01].map(|z| edge.map(|position| position + z * Vec3::Z));
                            world.cut(body, &Sweep { start, end })?;
                        }
                        "rest state" => {
                            world.rest_state(body, &RestStateDefinition::default())?;
                        }
                        _ => {}
                    }
                    let mut blade = BladeDefinition::new(edge);
                    blade.pose.position = -0.04 * Vec3::Z;
                    let blade = (name == "blade").then(|| world.create_blade(&blade)).transpose()?;
                    for step in 0..20 {
                        if let Some(blade) = blade {
                            world.set_blade_pose(blade, vec3(0.0, 0.0, 3e-3 * step as f32 - 0.04), None)?;
                        }
                        if name == "tear" {
                            world.body_mut(body)?.apply_force(5, vec3(1.0, 0.2, 0.0))?;
                        }
                        world.step(4e-3)?;
                    }
                    Ok(world)
                };
                let kind = if is_solid { "solid" } else { "sheet" };
                scenes.push((format!("{name} of a {kind}, {solver:?}"), Box::new(scene)));
            }
        }
    }
}

fn main() {
    let filter = std::env::args()
        .skip(1)
        .find(|word| word != "--bench")
        .unwrap_or_default();
    let mut scenes = Vec::new();
    for add in [bodies, tools, tissue, topology] {
        add(&mut scenes);
    }
    for (name, scene) in scenes.iter().filter(|(name, _)| name.contains(&filter)) {
        for kernel in [Kernel::Portable, Kernel::Avx2, Kernel::Avx512, Kernel::Neon] {
            match scene(kernel) {
                Ok(world) => println!("{name}, {kernel:?}: {:016x}", world.state_hash()),
                Err(Error::Unsupported(_)) => {}
                Err(error) => println!("{name}, {kernel:?}: {error}"),
            }
        }
    }
}
