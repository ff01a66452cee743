//! The scenes.

use std::path::Path;
use std::sync::OnceLock;

use glam::Vec3;
use sinew::mesh::{Mesh, MeshFormat, load};
use sinew::{BodyDefinition, Error, Material, Model, Pose, Shape, Solver, Values};

use crate::scene::{Scene, at, ramp, turned};

/// A scene with or without a tool, the frame of the first contact, and the number of frames.
pub type Row = (&'static str, fn(bool) -> Result<Scene, Error>, usize, usize);

pub const SCENES: [Row; 18] = [
    (
        "ball pressed into a cloth, 41 x 41",
        |with| pressed(40, with, ball),
        20,
        80,
    ),
    (
        "ball pressed into a cloth, 81 x 81",
        |with| pressed(80, with, ball),
        20,
        60,
    ),
    (
        "ball pressed into a cloth, 121 x 121",
        |with| pressed(120, with, ball),
        20,
        50,
    ),
    (
        "capsule dragged across a cloth, 81 x 81",
        |with| pressed(80, with, capsule),
        30,
        90,
    ),
    ("cloth falls over a ball, 30 x 30", |with| draped(29, with), 20, 80),
    ("cloth falls over a ball, 60 x 60", |with| draped(59, with), 20, 80),
    ("cloth on a mesh, 16 x 16", |with| on_a_mesh(15, with), 5, 60),
    ("cloth on a mesh, 32 x 32", |with| on_a_mesh(31, with), 5, 60),
    ("cloth on a mesh, 100 x 100", |with| on_a_mesh(99, with), 5, 30),
    (
        "ball in an organ, springs, VERLET",
        |with| organ(SPRINGS, with, one_ball),
        20,
        60,
    ),
    (
        "ball in an organ, springs, IMPLICIT",
        |with| organ(SPRINGS_16, with, one_ball),
        20,
        60,
    ),
    (
        "ball in an organ, tetrahedra, IMPLICIT",
        |with| organ(TETRAHEDRA_16, with, one_ball),
        20,
        60,
    ),
    (
        "needle in an organ, springs, VERLET",
        |with| organ(SPRINGS, with, needle),
        20,
        60,
    ),
    (
        "needle in an organ, springs, IMPLICIT",
        |with| organ(SPRINGS_16, with, needle),
        20,
        60,
    ),
    (
        "ten balls on an organ, springs, VERLET",
        |with| organ(SPRINGS, with, ten_balls),
        20,
        60,
    ),
    (
        "jaw in an organ, springs, VERLET",
        |with| organ(SPRINGS, with, jaw),
        20,
        60,
    ),
    (
        "jaw in an organ, springs, IMPLICIT",
        |with| organ(SPRINGS_16, with, jaw),
        20,
        60,
    ),
    (
        "jaw in an organ, tetrahedra, IMPLICIT",
        |with| organ(TETRAHEDRA_16, with, jaw),
        20,
        60,
    ),
];

type Tissue = (Model, Solver, u32);

const SPRINGS: Tissue = (Model::Springs, Solver::Verlet, 0);
const SPRINGS_16: Tissue = (Model::Springs, Solver::Implicit, 16);
const TETRAHEDRA_16: Tissue = (Model::Tetrahedra, Solver::Implicit, 16);

type Tools = fn(&mut Scene) -> Result<(), Error>;

/// A cloth of 0.2 m with a pinned border: 100 N/m, 0.1 kg.
fn pressed(cells: u32, with: bool, tools: Tools) -> Result<Scene, Error> {
    let mesh = Mesh::cloth([0.2; 2], [cells; 2])?;
    let mut scene = cloth(mesh, Vec3::ZERO, 0.0)?;
    let border = scene.world.body(scene.body)?.positions().iter().enumerate();
    let border: Vec<u32> = border
        .filter(|(_, position)| position.x.abs().max(position.z.abs()) > 0.0999)
        .map(|(node, _)| node as u32)
        .collect();
    for node in border {
        scene.world.body_mut(scene.body)?.pin(node)?;
    }
    if with {
        tools(&mut scene)?;
    }
    Ok(scene)
}

fn ball(scene: &mut Scene) -> Result<(), Error> {
    scene.add_tool(Shape::Sphere { radius: 0.03 }, 0.0, |frame| {
        at(Vec3::Y * (0.03 - 0.04 * ramp(frame, 30.0)))
    })
}

/// A capsule lies across the cloth, presses 20 mm and moves 60 mm aside.
fn capsule(scene: &mut Scene) -> Result<(), Error> {
    let shape = Shape::Capsule {
        radius: 0.01,
        half_length: 0.03,
    };
    scene.add_tool(shape, 0.3, |frame| {
        let aside = 0.03 - 0.06 * ramp(frame.saturating_sub(30), 60.0);
        let position = Vec3::new(aside, 0.01 - 0.02 * ramp(frame, 30.0), 0.0);
        turned(position, Vec3::X, std::f32::consts::FRAC_PI_2)
    })
}

/// The same cloth, free, above a ball.
fn draped(cells: u32, with: bool) -> Result<Scene, Error> {
    let mesh = Mesh::cloth([0.2; 2], [cells; 2])?;
    let mut scene = cloth(mesh, Vec3::Y * 0.061, 9.81)?;
    if with {
        scene.add_tool(Shape::Sphere { radius: 0.06 }, 0.5, |_| at(Vec3::ZERO))?;
    }
    Ok(scene)
}

/// A cloth of 0.12 m on the surface of an organ, a closed mesh of 6.6K triangles.
fn on_a_mesh(cells: u32, with: bool) -> Result<Scene, Error> {
    let organ = Mesh::organ(0.12, 0.0029)?;
    let triangles = organ.surface()?;
    let top = organ
        .positions
        .iter()
        .map(|position| position.y)
        .fold(f32::MIN, f32::max);
    let mesh = Mesh::cloth([0.12; 2], [cells; 2])?;
    let middle = organ.positions.iter().sum::<Vec3>() / organ.positions.len() as f32;
    let mut scene = cloth(mesh, middle.with_y(top + 0.001), 9.81)?;
    if with {
        let shape = Shape::Mesh {
            positions: &organ.positions,
            triangles: &triangles,
        };
        scene.add_tool(shape, 0.5, |_| Pose::IDENTITY)?;
    }
    Ok(scene)
}

fn cloth(mesh: Mesh, position: Vec3, gravity: f32) -> Result<Scene, Error> {
    let mut world = Scene::world(gravity)?;
    let positions: Vec<Vec3> = mesh.positions.iter().map(|corner| *corner + position).collect();
    let mass = 0.1 / positions.len() as f32;
    let body = world.create_body(&BodyDefinition {
        positions: &positions,
        triangles: &mesh.triangles,
        masses: Values::Uniform(mass),
        stiffnesses: Values::Uniform(100.0),
        node_dampings: Values::Uniform(2.0 * mass),
        ..Default::default()
    })?;
    Ok(Scene {
        world,
        body,
        triangles: mesh.triangles,
        tools: Vec::new(),
    })
}

/// An organ of 5.8K nodes and 23K tetrahedra, fixed at one end.
fn organ((model, solver, iterations): Tissue, with: bool, tools: Tools) -> Result<Scene, Error> {
    let mesh = Mesh::organ(0.2, 0.0074)?;
    let mut world = Scene::world(0.0)?;
    let left = mesh
        .positions
        .iter()
        .map(|position| position.x)
        .fold(f32::MAX, f32::min);
    let body = world.create_body(&BodyDefinition {
        positions: &mesh.positions,
        tetrahedra: &mesh.tetrahedra,
        material: Some(Material {
            model,
            young_modulus: 5000.0,
            poisson_ratio: if model == Model::Springs { 0.25 } else { 0.3 },
            density: 1060.0,
            ..Material::default()
        }),
        solver,
        iterations,
        mass_scaling: 1e-3,
        ..Default::default()
    })?;
    let pinned = (0..)
        .zip(&mesh.positions)
        .filter(|(_, position)| position.x < left + 0.02);
    for (node, _) in pinned {
        world.body_mut(body)?.pin(node)?;
    }
    let triangles = world.body(body)?.surface().to_vec();
    let mut scene = Scene {
        world,
        body,
        triangles,
        tools: Vec::new(),
    };
    if with {
        tools(&mut scene)?;
    }
    Ok(scene)
}

/// The highest point of the organ near its middle, shifted by `along` [m].
fn top(along: f32) -> Vec3 {
    static ORGAN: OnceLock<Mesh> = OnceLock::new();
    let mesh = ORGAN.get_or_init(|| Mesh::organ(0.2, 0.0074).expect("an organ"));
    let middle = mesh.positions.iter().sum::<Vec3>() / mesh.positions.len() as f32;
    let near = mesh
        .positions
        .iter()
        .filter(|position| (position.x - middle.x - along).abs() < 0.008 && (position.z - middle.z).abs() < 0.008);
    *near.max_by(|a, b| a.y.total_cmp(&b.y)).expect("a node")
}

/// A ball of 8 mm, 6 mm deep.
fn one_ball(scene: &mut Scene) -> Result<(), Error> {
    scene.add_tool(Shape::Sphere { radius: 0.008 }, 0.0, |frame| {
        at(top(0.0) + Vec3::Y * (0.008 - 0.006 * ramp(frame, 20.0)))
    })
}

fn needle(scene: &mut Scene) -> Result<(), Error> {
    let shape = Shape::Capsule {
        radius: 0.0005,
        half_length: 0.03,
    };
    scene.add_tool(shape, 0.2, |frame| {
        at(top(0.0) + Vec3::Y * (0.0305 - 0.004 * ramp(frame, 20.0)))
    })
}

fn ten_balls(scene: &mut Scene) -> Result<(), Error> {
    const POSES: [fn(usize) -> Pose; 10] = [
        |frame| pressing(0, frame),
        |frame| pressing(1, frame),
        |frame| pressing(2, frame),
        |frame| pressing(3, frame),
        |frame| pressing(4, frame),
        |frame| pressing(5, frame),
        |frame| pressing(6, frame),
        |frame| pressing(7, frame),
        |frame| pressing(8, frame),
        |frame| pressing(9, frame),
    ];
    POSES
        .into_iter()
        .try_for_each(|pose| scene.add_tool(Shape::Sphere { radius: 0.006 }, 0.2, pose))
}

fn pressing(index: usize, frame: usize) -> Pose {
    let along = 0.013 * (index as f32 - 4.5);
    at(top(along) + Vec3::Y * (0.006 - 0.004 * ramp(frame, 20.0)))
}

/// The jaw of a forceps, 5 mm deep; a block of its size if the file is missing.
fn jaw(scene: &mut Scene) -> Result<(), Error> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/meshes/forceps_jaw_left.stl");
    let mesh = match load(&path, MeshFormat::Auto, 1e-3) {
        Ok(loaded) => loaded.mesh,
        Err(_) => Mesh::block([0.004, 0.02, 0.004], [2, 8, 2])?,
    };
    let triangles = if mesh.triangles.is_empty() {
        mesh.surface()?
    } else {
        mesh.triangles.clone()
    };
    let (low, high) = mesh
        .positions
        .iter()
        .fold((Vec3::MAX, Vec3::MIN), |(low, high), position| {
            (low.min(*position), high.max(*position))
        });
    let middle = (0.5 * (low + high)).with_y(low.y);
    let longest = (high - low).max_element();
    let positions: Vec<Vec3> = mesh
        .positions
        .iter()
        .map(|position| (*position - middle) * (0.02 / longest))
        .collect();
    scene.add_tool(
        Shape::Mesh {
            positions: &positions,
            triangles: &triangles,
        },
        0.3,
        |frame| at(top(0.0) + Vec3::Y * (0.001 - 0.005 * ramp(frame, 20.0))),
    )
}
