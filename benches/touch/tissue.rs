//! Tissue against tissue, and with itself: the same bodies with contact and without.

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

/// A scene with contact or without, the first frame that is timed, and how many frames there are.
type Row = (&'static str, fn(bool) -> Result<Crowd, Error>, usize, usize);

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
struct Crowd {
    world: World,
    bodies: Vec<BodyId>,
}

/// What a run with contact showed.
#[derive(Default)]
struct Shown {
    crossings: u32,
    /// J, above the energy at the start; and the most kinetic and elastic energy there was.
    gain: f64,
    most: f64,
    /// m
    depth: f32,
}

impl Crowd {
    fn new(gravity: f32) -> Result<Self, Error> {
        Ok(Self {
            world: Scene::world(gravity)?,
            bodies: Vec::new(),
        })
    }

    /// A body of a mesh moved to a place.
    fn add(&mut self, mesh: &Mesh, place: Vec3, definition: &BodyDefinition) -> Result<BodyId, Error> {
        let positions: Vec<Vec3> = mesh.positions.iter().map(|corner| *corner + place).collect();
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

    fn pin_where(&mut self, body: BodyId, is_held: impl Fn(Vec3) -> bool) -> Result<(), Error> {
        let positions: Vec<Vec3> = self.world.body(body)?.positions().to_vec();
        for (node, _) in (0..).zip(positions).filter(|&(_, place)| is_held(place)) {
            self.world.body_mut(body)?.pin(node)?;
        }
        Ok(())
    }

    /// Kinetic and elastic energy, and that with the gravitational, J.
    fn energy(&self) -> [f64; 2] {
        let energies = self.world.bodies().map(|body| body.energy(self.world.gravity()));
        energies.fold([0.0; 2], |[inner, all], energy| {
            let own = energy.kinetic + energy.elastic;
            [inner + own, all + own + energy.gravitational]
        })
    }

    /// How deep any surface node is within another closed body, m.
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
                    .filter(|place| place.cmpgt(*low).all() && place.cmplt(*high).all());
                for &place in within {
                    deepest = deepest.max(depth(place, corners, triangles));
                }
            }
        }
        Ok(deepest)
    }
}

/// How deep a point is within a closed surface, m; 0 outside. By the solid angle of its triangles (van Oosterom, Strackee 1983).
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

/// How far a triangle is from the origin.
fn distance(a: Vec3, b: Vec3, c: Vec3) -> f32 {
    let normal = (b - a).cross(c - a);
    let is_inside = |from: Vec3, to: Vec3| (to - from).cross(-from).dot(normal) >= 0.0;
    if is_inside(a, b) && is_inside(b, c) && is_inside(c, a) && normal != Vec3::ZERO {
        return a.dot(normal.normalize()).abs();
    }
    let to_edge = |from: Vec3, to: Vec3| {
        let edge = to - from;
        let part = (-from.dot(edge) / edge.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        (from + part * edge).length()
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

/// Steps a scene: times of its frames from one on, and what it showed.
fn run(mut crowd: Crowd, frames: usize, from: usize) -> Result<(Frames, Shown), Error> {
    let (mut times, mut shown) = (Vec::new(), Shown::default());
    let start = crowd.energy()[1];
    for frame in 0..frames {
        let mut result = Ok(0);
        let elapsed = clock::time(|| result = crowd.world.step(FRAME).map(|report| report.crossings));
        shown.crossings = shown.crossings.max(result?);
        let [inner, all] = crowd.energy();
        shown.most = shown.most.max(inner);
        shown.gain = shown.gain.max(all - start);
        if frame >= from {
            times.push(1e3 * elapsed.processor);
        }
        if frame % 10 == 9 {
            shown.depth = shown.depth.max(crowd.deepest()?);
        }
    }
    Ok((Frames::new(times), shown))
}

/// Adds the rows to the report.
pub fn report(report: &mut String, only: &str, is_quick: bool) {
    report.push_str(
        "\n# Contact: tissue against tissue\n\nThe same bodies with `meets_bodies` or `meets_itself` and without. Energy gain: the largest rise of all energy over \
         that at the start, and as a part of the most kinetic and elastic energy. Depth: of nodes within other closed bodies, every tenth frame.\n\n\
         | scene | without, ms | with contact, ms | ratio | slowest, ms | crossings | energy gain, mJ | gain, % | depth, mm |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for (name, make, from, frames) in SCENES.iter().filter(|row| row.0.contains(only)) {
        // What is at rest has to come to rest.
        let frames = if is_quick && *from < 100 {
            from + (frames - from) / 4
        } else {
            *frames
        };
        let row = (|| {
            // What rests is compared with what moves.
            let (without, _) = run(make(false)?, frames.min(120), *from.min(&20))?;
            let (with, shown) = run(make(true)?, frames, *from)?;
            Ok::<_, Error>(format!(
                "| {name} | {:.3} | {:.3} | {:.2} | {:.3} | {} | {:.4} | {:.4} | {:.3} |",
                without.median(),
                with.median(),
                with.median() / without.median(),
                with.slowest(),
                shown.crossings,
                1e3 * shown.gain,
                100.0 * shown.gain / shown.most.max(f64::MIN_POSITIVE),
                1e3 * shown.depth,
            ))
        })();
        let row = row.unwrap_or_else(|error| format!("| {name} | refused: {error} |"));
        eprintln!("{row}");
        let _ = writeln!(report, "{row}");
    }
}

fn meeting(with: bool, thickness: f32) -> BodyContact {
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

/// Blocks of 0.1 m one upon the other, 1 mm apart, on the ground; without contact they all stand on it.
fn stacked(count: usize, solver: Solver, with: bool) -> Result<Crowd, Error> {
    let mut crowd = Crowd::new(9.81)?;
    let mesh = Mesh::block([0.1; 3], [if count == 2 { 8 } else { 4 }; 3])?;
    let definition = BodyDefinition {
        material: soft(Model::Tetrahedra),
        node_dampings: Values::Uniform(2e-3),
        contact: meeting(with, 1e-3),
        solver,
        ..Default::default()
    };
    crowd.ground()?;
    for place in 0..count {
        crowd.add(&mesh, Vec3::Y * (0.052 + 0.103 * place as f32), &definition)?;
    }
    Ok(crowd)
}

/// Blocks of 27 nodes and 40 mm fall into a bowl of four walls.
fn heap(count: usize, with: bool) -> Result<Crowd, Error> {
    let mut crowd = Crowd::new(9.81)?;
    let mesh = Mesh::block([0.04; 3], [2; 3])?;
    let definition = BodyDefinition {
        material: soft(Model::Tetrahedra),
        node_dampings: Values::Uniform(1e-2),
        contact: meeting(with, 1e-3),
        sleep: Sleep {
            speed: if with { 0.02 } else { 0.0 },
            time: 0.5,
        },
        mass_scaling: 1e-3,
        ..Default::default()
    };
    crowd.ground()?;
    let side = (count as f32 / 3.0).sqrt().ceil() as usize;
    let half = 0.025 * side as f32 + 0.02;
    for wall in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
        let shape = Shape::Box {
            half_extents: Vec3::new(0.02 + half * wall.z.abs(), 0.5, 0.02 + half * wall.x.abs()),
        };
        let mut definition = ToolDefinition::new(shape);
        definition.pose.position = wall * (half + 0.02) + Vec3::Y * 0.5;
        crowd.world.create_tool(&definition)?;
    }
    for index in 0..count {
        let [x, z] = [index % side, index / side % side].map(|place| 0.05 * (place as f32 - 0.5 * (side as f32 - 1.0)));
        let layer = (index / side / side) as f32;
        // Each layer stands askew on the one below.
        let askew = 0.008 * if (layer as usize).is_multiple_of(2) { 1.0 } else { -1.0 };
        crowd.add(&mesh, Vec3::new(x + askew, 0.03 + 0.05 * layer, z - askew), &definition)?;
    }
    Ok(crowd)
}

/// Lattices of 27 nodes and 0.2 m, 0.1 m apart, all with one velocity.
fn far(count: usize, speed: f32, with: bool) -> Result<Crowd, Error> {
    let mut crowd = Crowd::new(0.0)?;
    let mesh = Mesh::lattice(0.1, [2; 3])?;
    let side = (count as f32).cbrt().ceil() as usize;
    for index in 0..count {
        let cell = [index % side, index / side / side, index / side % side];
        let body = crowd.add(
            &mesh,
            0.3 * Vec3::from(cell.map(|place| place as f32)),
            &BodyDefinition {
                material: Some(Material {
                    young_modulus: 5e4,
                    density: 500.0,
                    ..Material::default()
                }),
                contact: meeting(with, 0.0),
                ..Default::default()
            },
        )?;
        crowd.world.body_mut(body)?.set_velocities(&[Vec3::X * speed; 27])?;
    }
    Ok(crowd)
}

/// A cloth that falls upright onto the ground and crumples there.
fn crumpling(cells: [u32; 2], with: bool) -> Result<Crowd, Error> {
    let mut crowd = Crowd::new(9.81)?;
    let mut mesh = Mesh::cloth([0.2, 0.2 * cells[1] as f32 / cells[0] as f32], cells)?;
    for place in &mut mesh.positions {
        // Upright, in slight folds.
        *place = Vec3::new(place.z, place.x + 0.11, 0.004 * (60.0 * place.x).sin());
    }
    let mass = 0.02 / mesh.positions.len() as f32;
    crowd.ground()?;
    crowd.add(
        &mesh,
        Vec3::ZERO,
        &BodyDefinition {
            masses: Values::Uniform(mass),
            stiffnesses: Values::Uniform(30.0),
            node_dampings: Values::Uniform(2.0 * mass),
            contact: BodyContact {
                with_itself: with,
                ..meeting(false, 5e-4)
            },
            ..Default::default()
        },
    )?;
    Ok(crowd)
}

/// An organ of 1.3K nodes that lies on another, which is held at its end.
fn organs(with: bool) -> Result<Crowd, Error> {
    let mut crowd = Crowd::new(9.81)?;
    let mesh = Mesh::organ(0.12, 0.0075)?;
    let [low, high] = [f32::min, f32::max]
        .map(|of: fn(f32, f32) -> f32| mesh.positions.iter().map(|place| place.y).reduce(of).unwrap_or(0.0));
    let definition = BodyDefinition {
        material: soft(Model::Springs),
        node_dampings: Values::Uniform(1e-3),
        contact: meeting(with, 5e-4),
        mass_scaling: 1e-3,
        ..Default::default()
    };
    let below = crowd.add(&mesh, Vec3::ZERO, &definition)?;
    crowd.pin_where(below, |place| place.y < low + 0.3 * (high - low))?;
    crowd.add(&mesh, Vec3::Y * (high - low + 0.002), &definition)?;
    Ok(crowd)
}

/// Two flaps of 475 nodes side by side, held at their far ends, whose edges five sutures draw together.
fn wound(with: bool) -> Result<Crowd, Error> {
    let mut crowd = Crowd::new(0.0)?;
    let mesh = Mesh::block([0.08, 0.008, 0.048], [18, 4, 4])?;
    let mut flaps = Vec::new();
    for side in [-1.0_f32, 1.0] {
        let flap = crowd.add(
            &mesh,
            Vec3::X * (side * 0.042),
            &BodyDefinition {
                material: soft(Model::Tetrahedra),
                node_dampings: Values::Uniform(1e-3),
                contact: meeting(with, 5e-4),
                mass_scaling: 1e-3,
                ..Default::default()
            },
        )?;
        crowd.pin_where(flap, |place| place.x.abs() > 0.081)?;
        flaps.push(flap);
    }
    for along in -2..=2 {
        let mut anchors = Vec::new();
        for &flap in &flaps {
            let body = crowd.world.body(flap)?;
            let wish = Vec3::new(0.0, 0.004, 0.01 * along as f32);
            let positions = body.positions();
            let middle = |triangle: &[u32; 3]| triangle.map(|node| positions[node as usize]).iter().sum::<Vec3>() / 3.0;
            let nearest = body.surface().iter().enumerate().min_by(|(_, a), (_, b)| {
                middle(a)
                    .distance_squared(wish)
                    .total_cmp(&middle(b).distance_squared(wish))
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
        crowd
            .world
            .suture(flaps[0], &anchors[0], flaps[1], &anchors[1], &thread)?;
    }
    Ok(crowd)
}
