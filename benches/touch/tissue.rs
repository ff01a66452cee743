//! Tissue against tissue, and self-contact: the same bodies with contact and without.

use std::fmt::Write;

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{
    Anchor, BodyContact, BodyDefinition, BodyId, Error, Material, Model, Shape, Sleep, Solver, SurfacePoint,
    SutureDefinition, ToolDefinition, Values, World,
};

use crate::Frames;
use crate::clock;
use crate::scene::{FRAME, Scene};

/// A scene with or without contact, the first timed frame, and the number of frames.
type Row = (&'static str, fn(bool) -> Result<Bodies, Error>, usize, usize);

const SCENES: [Row; 15] = [
    (
        "two blocks of 729 nodes, VERLET",
        |with| stacked(2, Solver::Verlet, with),
        20,
        60,
    ),
    (
        "two blocks of 729 nodes, IMPLICIT",
        |with| stacked(2, Solver::Implicit, with),
        20,
        60,
    ),
    (
        "eight blocks of 125 nodes, VERLET",
        |with| stacked(8, Solver::Verlet, with),
        20,
        60,
    ),
    (
        "eight blocks of 125 nodes, IMPLICIT",
        |with| stacked(8, Solver::Implicit, with),
        20,
        60,
    ),
    ("heap of 20 in a bowl", |with| heap(20, with), 20, 120),
    ("heap of 20 in a bowl, at rest", |with| heap(20, with), 590, 600),
    ("heap of 100 in a bowl", |with| heap(100, with), 20, 120),
    ("heap of 100 in a bowl, at rest", |with| heap(100, with), 590, 600),
    ("heap of 500 in a bowl", |with| heap(500, with), 20, 60),
    ("2000 far bodies", |with| far(2000, 0.0, with), 2, 12),
    ("64 near bodies, all at 20 m/s", |with| far(64, 20.0, with), 2, 12),
    ("cloth of 231 nodes crumples", |with| crumpling([20, 10], with), 20, 60),
    ("cloth of 3.7K nodes crumples", |with| crumpling([60, 60], with), 20, 60),
    ("organ on an organ", organs, 10, 40),
    ("sutured wound of 950 nodes", wound, 10, 40),
];

/// Bodies in a world.
struct Bodies {
    world: World,
    bodies: Vec<BodyId>,
}

/// The results of a run with contact.
#[derive(Default)]
struct ContactResult {
    crossings: u32,
    /// Largest energy above that at the start, and largest kinetic and elastic energy [J].
    gain: f64,
    most: f64,
    /// Deepest penetration [m].
    depth: f32,
}

impl Bodies {
    fn new(gravity: f32) -> Result<Self, Error> {
        Ok(Self {
            world: Scene::world(gravity)?,
            bodies: Vec::new(),
        })
    }

    /// Adds a body of a mesh at an offset.
    fn add(&mut self, mesh: &Mesh, offset: Vec3, definition: &BodyDefinition) -> Result<BodyId, Error> {
        let positions: Vec<Vec3> = mesh.positions.iter().map(|position| *position + offset).collect();
        let body = self.world.create_body(&BodyDefinition {
            positions: &positions,
            triangles: if mesh.tetrahedra.is_empty() && mesh.cells.is_empty() {
                &mesh.triangles
            } else {
                &[]
            },
            tetrahedra: &mesh.tetrahedra,
            cells: &mesh.cells,
            ..*definition
        })?;
        self.bodies.push(body);
        Ok(body)
    }

    fn ground(&mut self) -> Result<(), Error> {
        self.world.create_tool(&ToolDefinition {
            friction: 0.5,
            ..ToolDefinition::new(Shape::Plane)
        })?;
        Ok(())
    }

    fn pin_where(&mut self, body: BodyId, is_pinned: impl Fn(Vec3) -> bool) -> Result<(), Error> {
        let positions: Vec<Vec3> = self.world.body(body)?.positions().to_vec();
        for (node, _) in (0..).zip(positions).filter(|&(_, position)| is_pinned(position)) {
            self.world.body_mut(body)?.pin(node)?;
        }
        Ok(())
    }

    /// Kinetic and elastic energy, and the total with gravitational energy [J].
    fn energy(&self) -> [f64; 2] {
        let energies = self.world.bodies().map(|body| body.energy(self.world.gravity()));
        energies.fold([0.0; 2], |[inner, all], energy| {
            let internal = energy.kinetic + energy.elastic;
            [inner + internal, all + internal + energy.gravitational]
        })
    }

    /// The largest depth of a surface node in another closed body [m].
    fn deepest(&self) -> Result<f32, Error> {
        let bodies: Result<Vec<_>, Error> = self.bodies.iter().map(|&id| self.world.body(id)).collect();
        let solids = bodies?.into_iter().filter(|body| body.is_closed());
        let solids: Vec<_> = solids
            .map(|body| {
                let positions = body.positions().to_vec();
                let fold = |with: fn(Vec3, Vec3) -> Vec3| positions.iter().copied().reduce(with).unwrap_or(Vec3::ZERO);
                let bounds = [fold(Vec3::min), fold(Vec3::max)];
                (positions, body.surface(), bounds)
            })
            .collect();
        let mut deepest = 0.0_f32;
        for (index, (positions, ..)) in solids.iter().enumerate() {
            for (_, (corners, triangles, [low, high])) in solids.iter().enumerate().filter(|(other, _)| *other != index)
            {
                let within = positions
                    .iter()
                    .filter(|position| position.cmpgt(*low).all() && position.cmplt(*high).all());
                for &position in within {
                    deepest = deepest.max(depth(position, corners, triangles));
                }
            }
        }
        Ok(deepest)
    }
}

/// The depth of a point in a closed surface [m]; 0 outside. Uses the solid angle of its triangles (van Oosterom,
/// Strackee 1983).
fn depth(point: Vec3, corners: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let (mut angle, mut nearest) = (0.0_f32, f32::INFINITY);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| corners[corner as usize] - point);
        let lengths = [a.length(), b.length(), c.length()];
        let down = lengths[0] * lengths[1] * lengths[2]
            + a.dot(b) * lengths[2]
            + b.dot(c) * lengths[0]
            + c.dot(a) * lengths[1];
        angle += 2.0 * a.dot(b.cross(c)).atan2(down);
        nearest = nearest.min(distance(a, b, c));
    }
    if angle.abs() > 2.0 * std::f32::consts::PI {
        nearest
    } else {
        0.0
    }
}

/// The distance of a triangle from the origin.
fn distance(a: Vec3, b: Vec3, c: Vec3) -> f32 {
    let normal = (b - a).cross(c - a);
    let is_inside = |from: Vec3, to: Vec3| (to - from).cross(-from).dot(normal) >= 0.0;
    if is_inside(a, b) && is_inside(b, c) && is_inside(c, a) && normal != Vec3::ZERO {
        return a.dot(normal.normalize()).abs();
    }
    let to_edge = |from: Vec3, to: Vec3| {
        let edge = to - from;
        let fraction = (-from.dot(edge) / edge.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        (from + fraction * edge).length()
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

/// Steps a scene. Returns the frame times from frame `from` on, and the results.
fn run(mut bodies: Bodies, frames: usize, from: usize) -> Result<(Frames, ContactResult), Error> {
    let (mut times, mut outcome) = (Vec::new(), ContactResult::default());
    let start = bodies.energy()[1];
    for frame in 0..frames {
        let mut result = Ok(0);
        let elapsed = clock::time(|| result = bodies.world.step(FRAME).map(|report| report.crossings));
        outcome.crossings = outcome.crossings.max(result?);
        let [inner, all] = bodies.energy();
        outcome.most = outcome.most.max(inner);
        outcome.gain = outcome.gain.max(all - start);
        if frame >= from {
            times.push(1e3 * elapsed.processor);
        }
        if frame % 10 == 9 {
            outcome.depth = outcome.depth.max(bodies.deepest()?);
        }
    }
    Ok((Frames::new(times), outcome))
}

/// Adds the rows to the report.
pub fn report(report: &mut String, only: &str, is_quick: bool) {
    report.push_str(
        "\n# Contact: tissue against tissue\n\nThe same bodies with `meets_bodies` or `meets_itself` and without. Energy gain: the largest rise of the total energy over \
         that at the start, and relative to the largest kinetic and elastic energy. Depth: of nodes within other closed bodies, every tenth frame.\n\n\
         | scene | without, ms | with contact, ms | ratio | slowest, ms | crossings | energy gain, mJ | gain, % | depth, mm |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for (name, make, from, frames) in SCENES.iter().filter(|row| row.0.contains(only)) {
        // Bodies that are timed at rest must first come to rest.
        let frames = if is_quick && *from < 100 {
            from + (frames - from) / 4
        } else {
            *frames
        };
        let row = (|| {
            // The frame times of resting bodies are compared with those of moving ones.
            let (without, _) = run(make(false)?, frames.min(120), *from.min(&20))?;
            let (with, outcome) = run(make(true)?, frames, *from)?;
            Ok::<_, Error>(format!(
                "| {name} | {:.3} | {:.3} | {:.2} | {:.3} | {} | {:.4} | {:.4} | {:.3} |",
                without.median(),
                with.median(),
                with.median() / without.median(),
                with.slowest(),
                outcome.crossings,
                1e3 * outcome.gain,
                100.0 * outcome.gain / outcome.most.max(f64::MIN_POSITIVE),
                1e3 * outcome.depth,
            ))
        })();
        let row = row.unwrap_or_else(|error| format!("| {name} | refused: {error} |"));
        eprintln!("{row}");
        let _ = writeln!(report, "{row}");
    }
}

fn contact(with: bool, thickness: f32) -> BodyContact {
    BodyContact {
        thickness,
        friction: 0.5,
        with_bodies: with,
        ..BodyContact::NOTHING
    }
}

fn soft(model: Model) -> Option<Material> {
    Some(Material {
        model,
        young_modulus: 2e4,
        poisson_ratio: if model == Model::Springs { 0.25 } else { 0.3 },
        density: 1000.0,
        ..Material::default()
    })
}

/// Blocks of 0.1 m stacked on the ground, 1 mm apart; without contact all of them rest on the ground.
fn stacked(count: usize, solver: Solver, with: bool) -> Result<Bodies, Error> {
    let mut bodies = Bodies::new(9.81)?;
    let mesh = Mesh::block([0.1; 3], [if count == 2 { 8 } else { 4 }; 3])?;
    let definition = BodyDefinition {
        material: soft(Model::Tetrahedra),
        node_dampings: Values::Uniform(2e-3),
        contact: contact(with, 1e-3),
        solver,
        ..Default::default()
    };
    bodies.ground()?;
    for index in 0..count {
        bodies.add(&mesh, Vec3::Y * (0.052 + 0.103 * index as f32), &definition)?;
    }
    Ok(bodies)
}

/// Blocks of 27 nodes and 40 mm fall into a bowl of four walls.
fn heap(count: usize, with: bool) -> Result<Bodies, Error> {
    let mut bodies = Bodies::new(9.81)?;
    let mesh = Mesh::block([0.04; 3], [2; 3])?;
    let definition = BodyDefinition {
        material: soft(Model::Tetrahedra),
        node_dampings: Values::Uniform(1e-2),
        contact: contact(with, 1e-3),
        sleep: Sleep {
            speed: if with { 0.02 } else { 0.0 },
            time: 0.5,
        },
        mass_scaling: 1e-3,
        ..Default::default()
    };
    bodies.ground()?;
    let side = (count as f32 / 3.0).sqrt().ceil() as usize;
    let half = 0.025 * side as f32 + 0.02;
    for wall in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
        let shape = Shape::Box {
            half_extents: Vec3::new(0.02 + half * wall.z.abs(), 0.5, 0.02 + half * wall.x.abs()),
        };
        let mut definition = ToolDefinition::new(shape);
        definition.pose.position = wall * (half + 0.02) + Vec3::Y * 0.5;
        bodies.world.create_tool(&definition)?;
    }
    for index in 0..count {
        let [x, z] = [index % side, index / side % side].map(|cell| 0.05 * (cell as f32 - 0.5 * (side as f32 - 1.0)));
        let layer = (index / side / side) as f32;
        // Each layer is offset against the one below.
        let askew = 0.008 * if (layer as usize).is_multiple_of(2) { 1.0 } else { -1.0 };
        bodies.add(&mesh, Vec3::new(x + askew, 0.03 + 0.05 * layer, z - askew), &definition)?;
    }
    Ok(bodies)
}

/// Lattices of 27 nodes and 0.2 m, 0.1 m apart, all with one velocity.
fn far(count: usize, speed: f32, with: bool) -> Result<Bodies, Error> {
    let mut bodies = Bodies::new(0.0)?;
    let mesh = Mesh::lattice(0.1, [2; 3])?;
    let side = (count as f32).cbrt().ceil() as usize;
    for index in 0..count {
        let cell = [index % side, index / side / side, index / side % side];
        let body = bodies.add(
            &mesh,
            0.3 * Vec3::from(cell.map(|index| index as f32)),
            &BodyDefinition {
                material: Some(Material {
                    young_modulus: 5e4,
                    density: 500.0,
                    ..Material::default()
                }),
                contact: contact(with, 0.0),
                ..Default::default()
            },
        )?;
        bodies.world.body_mut(body)?.set_velocities(&[Vec3::X * speed; 27])?;
    }
    Ok(bodies)
}

/// A cloth that falls upright onto the ground and crumples there.
fn crumpling(cells: [u32; 2], with: bool) -> Result<Bodies, Error> {
    let mut bodies = Bodies::new(9.81)?;
    let mut mesh = Mesh::cloth([0.2, 0.2 * cells[1] as f32 / cells[0] as f32], cells)?;
    for position in &mut mesh.positions {
        // Upright, with slight folds.
        *position = Vec3::new(position.z, position.x + 0.11, 0.004 * (60.0 * position.x).sin());
    }
    let mass = 0.02 / mesh.positions.len() as f32;
    bodies.ground()?;
    bodies.add(
        &mesh,
        Vec3::ZERO,
        &BodyDefinition {
            masses: Values::Uniform(mass),
            stiffnesses: Values::Uniform(30.0),
            node_dampings: Values::Uniform(2.0 * mass),
            contact: BodyContact {
                with_itself: with,
                ..contact(false, 5e-4)
            },
            ..Default::default()
        },
    )?;
    Ok(bodies)
}

/// An organ of 1.3K nodes on top of another, which is fixed at its end.
fn organs(with: bool) -> Result<Bodies, Error> {
    let mut bodies = Bodies::new(9.81)?;
    let mesh = Mesh::organ(0.12, 0.0075)?;
    let [low, high] = [f32::min, f32::max].map(|extreme: fn(f32, f32) -> f32| {
        mesh.positions
            .iter()
            .map(|position| position.y)
            .reduce(extreme)
            .unwrap_or(0.0)
    });
    let definition = BodyDefinition {
        material: soft(Model::Springs),
        node_dampings: Values::Uniform(1e-3),
        contact: contact(with, 5e-4),
        mass_scaling: 1e-3,
        ..Default::default()
    };
    let below = bodies.add(&mesh, Vec3::ZERO, &definition)?;
    bodies.pin_where(below, |position| position.y < low + 0.3 * (high - low))?;
    bodies.add(&mesh, Vec3::Y * (high - low + 0.002), &definition)?;
    Ok(bodies)
}

/// Two flaps of 475 nodes side by side, fixed at their far ends. Five sutures pull their edges together.
fn wound(with: bool) -> Result<Bodies, Error> {
    let mut bodies = Bodies::new(0.0)?;
    let mesh = Mesh::block([0.08, 0.008, 0.048], [18, 4, 4])?;
    let mut flaps = Vec::new();
    for side in [-1.0_f32, 1.0] {
        let flap = bodies.add(
            &mesh,
            Vec3::X * (side * 0.042),
            &BodyDefinition {
                material: soft(Model::Tetrahedra),
                node_dampings: Values::Uniform(1e-3),
                contact: contact(with, 5e-4),
                mass_scaling: 1e-3,
                ..Default::default()
            },
        )?;
        bodies.pin_where(flap, |position| position.x.abs() > 0.081)?;
        flaps.push(flap);
    }
    for along in -2..=2 {
        let mut anchors = Vec::new();
        for &flap in &flaps {
            let body = bodies.world.body(flap)?;
            let target = Vec3::new(0.0, 0.004, 0.01 * along as f32);
            let positions = body.positions();
            let middle = |triangle: &[u32; 3]| triangle.map(|node| positions[node as usize]).iter().sum::<Vec3>() / 3.0;
            let nearest = body.surface().iter().enumerate().min_by(|(_, a), (_, b)| {
                middle(a)
                    .distance_squared(target)
                    .total_cmp(&middle(b).distance_squared(target))
            });
            anchors.push(Anchor::Point(SurfacePoint {
                triangle: nearest.map_or(0, |(index, _)| index as u32),
                weights: [0.25, 0.25, 0.5],
            }));
        }
        let thread = SutureDefinition {
            length: Some(0.001),
            ..SutureDefinition::default()
        };
        bodies
            .world
            .suture(flaps[0], &anchors[0], flaps[1], &anchors[1], &thread)?;
    }
    Ok(bodies)
}
