//! The ten degenerate scenes of Erleben (2018), built in code: tips, edges and notches that meet exactly.

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{
    BodyContact, BodyDefinition, BodyId, Material, Model, Shape, Solver, ToolDefinition, Values, World, WorldDefinition,
};

/// m
const CELL: f32 = 0.05;
const TALL: f32 = 0.1;

/// A block of even cells on the ground, the nodes of its top lifted by a function of where they are, m.
fn ground_shape(lift: impl Fn(f32, f32) -> f32) -> Mesh {
    let mut mesh = Mesh::block([6.0 * CELL, TALL, 6.0 * CELL], [6, 2, 6]).expect("a block");
    for place in &mut mesh.positions {
        place.y += 0.5 * TALL;
        if place.y > 0.99 * TALL {
            place.y += lift(place.x, place.z);
        }
    }
    mesh
}

/// A block of 2 x 1 x 2 cells with its lowest point at 0, the nodes of its bottom lifted likewise.
fn falling_shape(lift: impl Fn(f32, f32) -> f32) -> Mesh {
    let mut mesh = Mesh::block([2.0 * CELL, CELL, 2.0 * CELL], [2, 1, 2]).expect("a block");
    for place in &mut mesh.positions {
        place.y += if place.y < 0.0 { lift(place.x, place.z) } else { TALL };
    }
    let lowest = mesh.positions.iter().map(|place| place.y).fold(f32::MAX, f32::min);
    mesh.positions.iter_mut().for_each(|place| place.y -= lowest);
    mesh
}

fn flat(_: f32, _: f32) -> f32 {
    0.0
}

/// Down from the rim to the middle, and from the sides to the middle line.
fn tip(x: f32, z: f32) -> f32 {
    TALL * (x.abs().max(z.abs()) / CELL).min(1.0)
}

fn edge(x: f32, _: f32) -> f32 {
    TALL * (x.abs() / CELL).min(1.0)
}

/// How the same shapes look from the other side.
fn spike(x: f32, z: f32) -> f32 {
    TALL - tip(x, z)
}

fn wedge(x: f32, z: f32) -> f32 {
    TALL - edge(x, z)
}

fn hole(x: f32, z: f32) -> f32 {
    0.9 * (tip(x, z) - TALL)
}

fn crack(x: f32, z: f32) -> f32 {
    0.9 * (edge(x, z) - TALL)
}

struct Case {
    name: &'static str,
    ground: Mesh,
    falls: Mesh,
    /// From above the middle of the ground, m, and its velocity, m/s.
    place: Vec3,
    velocity: Vec3,
}

fn cases() -> Vec<Case> {
    let case = |name, ground: Mesh, falls: Mesh, place, velocity| Case {
        name,
        ground,
        falls,
        place,
        velocity,
    };
    let still = Vec3::ZERO;
    let on_top = Vec3::Y * TALL;
    let across = |mesh: Mesh| {
        let mut mesh = mesh;
        let turned = mesh.positions.iter().map(|place| Vec3::new(place.z, place.y, -place.x));
        mesh.positions = turned.collect();
        mesh
    };
    vec![
        case(
            "a spike on a spike",
            ground_shape(spike),
            falling_shape(tip),
            2.0 * on_top,
            still,
        ),
        case(
            "a spike on a wedge",
            ground_shape(wedge),
            falling_shape(tip),
            2.0 * on_top,
            still,
        ),
        case(
            "a wedge across a wedge",
            ground_shape(wedge),
            across(falling_shape(edge)),
            2.0 * on_top,
            still,
        ),
        case(
            "a spike in a hole",
            ground_shape(hole),
            falling_shape(tip),
            on_top,
            still,
        ),
        case(
            "a spike in a crack",
            ground_shape(crack),
            falling_shape(tip),
            on_top,
            still,
        ),
        case(
            "a wedge in a crack",
            ground_shape(crack),
            falling_shape(edge),
            on_top,
            still,
        ),
        case(
            "a spike slides",
            ground_shape(flat),
            falling_shape(tip),
            on_top,
            Vec3::X * 0.5,
        ),
        case(
            "a wedge slides",
            ground_shape(flat),
            falling_shape(edge),
            on_top,
            Vec3::X * 0.5,
        ),
        // Flush with a side of the ground, and half beyond it.
        case(
            "a cube on the edge of a cliff",
            ground_shape(flat),
            falling_shape(flat),
            on_top + Vec3::X * (2.0 * CELL),
            still,
        ),
        case(
            "a cube half beyond a cliff",
            ground_shape(flat),
            falling_shape(flat),
            on_top + Vec3::X * (3.0 * CELL),
            still,
        ),
        case(
            "a cube slides over inner edges",
            ground_shape(flat),
            falling_shape(flat),
            on_top,
            Vec3::X * 0.5,
        ),
    ]
}

fn put(world: &mut World, mesh: &Mesh, place: Vec3, solver: Solver) -> BodyId {
    let positions: Vec<Vec3> = mesh.positions.iter().map(|corner| *corner + place).collect();
    world
        .create_body(&BodyDefinition {
            positions: &positions,
            tetrahedra: &mesh.tetrahedra,
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: 1e5,
                poisson_ratio: 0.3,
                density: 1000.0,
                ..Material::default()
            }),
            node_dampings: Values::Uniform(0.3),
            contact: BodyContact {
                thickness: 5e-4,
                friction: 0.5,
                with_bodies: true,
                ..BodyContact::NOTHING
            },
            solver,
            ..Default::default()
        })
        .expect("a body")
}

fn nothing_passes_and_all_comes_to_rest(solver: Solver) {
    for case in cases() {
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::NEG_Y * 9.81,
            ..Default::default()
        })
        .expect("a world");
        let plane = ToolDefinition {
            friction: 0.5,
            ..ToolDefinition::new(Shape::Plane)
        };
        world.create_tool(&plane).expect("a floor");
        let ground = put(&mut world, &case.ground, Vec3::Y * 1e-3, solver);
        for (node, place) in (0..).zip(&case.ground.positions) {
            if place.y < 0.01 {
                world.body_mut(ground).expect("a body").pin(node).expect("a pin");
            }
        }
        let falls = put(&mut world, &case.falls, case.place + Vec3::Y * 3e-3, solver);
        let velocities = vec![case.velocity; case.falls.positions.len()];
        world
            .body_mut(falls)
            .expect("a body")
            .set_velocities(&velocities)
            .expect("velocities");
        let all = |world: &World| -> f64 {
            let energies = world.bodies().map(|body| body.energy(world.gravity()));
            energies
                .map(|energy| energy.kinetic + energy.elastic + energy.gravitational)
                .sum()
        };
        let start = all(&world);
        // What falls has about so much to lose, J.
        let most = 2.0;
        let (mut fastest, mut at_rest) = (f32::INFINITY, 0);
        for frame in 0..600 {
            let report = world.step(1.0 / 60.0).expect("a step");
            let name = format!("{}, {solver:?}, frame {frame}", case.name);
            assert_eq!(report.crossings, 0, "{name}");
            let gain = all(&world) - start;
            assert!(gain < 1e-3 * most, "{name}: {gain} J");
            let speeds = world
                .body(falls)
                .expect("a body")
                .velocities()
                .iter()
                .map(|velocity| velocity.length());
            fastest = speeds.fold(0.0, f32::max);
            at_rest = if fastest < 1e-3 { at_rest + 1 } else { 0 };
            if at_rest == 30 {
                break;
            }
        }
        assert_eq!(at_rest, 30, "{}, {solver:?}: {fastest} m/s", case.name);
    }
}

#[test]
fn nothing_passes_and_all_comes_to_rest_in_degenerate_scenes() {
    nothing_passes_and_all_comes_to_rest(Solver::Verlet);
}

#[test]
#[ignore = "long"]
fn nothing_passes_and_all_comes_to_rest_in_degenerate_scenes_of_implicit() {
    nothing_passes_and_all_comes_to_rest(Solver::Implicit);
}
