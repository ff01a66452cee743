//! Tools of every shape that move far in one step, with each kind of detection: nothing passes through.

use std::fmt::Write;

use crate::support::solid::{Solid, ball, real};
use crate::support::tissue::*;
use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, BodyId, Detection, Error, Pose, Shape, Solver, ToolDefinition, ToolId, Values, World,
    WorldDefinition,
};

/// The side of a small cloth, and of one that is too large for a tip to slip off within a frame (m).
const SMALL: f32 = 0.2;
const LARGE: f32 = 1.2;
const CELLS: u32 = 8;
/// The radius of a tip (m).
const RADIUS: f32 = 0.005;
/// The displacement of a tip in one step (m).
const FAR: f32 = 0.5;
const TISSUE: Tissue = Tissue {
    mass: 0.02,
    stiffness: 30.0,
    drag: 20.0,
    spring_damping: 0.01,
};
const STEPS: [f32; 2] = [0.001, 1.0 / 60.0];
const SOLVERS: [Solver; 2] = [Solver::Verlet, Solver::Implicit];

/// Target points on a cloth with cells of size 1: a node, an edge, the middle of a face, another point.
const AIMS: [Vec3; 4] = [
    Vec3::new(0.0, 0.0, 0.0),
    Vec3::new(0.5, 0.0, 0.0),
    Vec3::new(1.33, 0.0, 0.66),
    Vec3::new(-1.62, 0.0, 1.17),
];

/// A tool shape and points inside it.
struct Tip {
    name: &'static str,
    form: Form,
    /// Points well inside, in its own frame.
    inside: Vec<Vec3>,
    /// Its extent from its position along y (m).
    reach: f32,
}

enum Form {
    Round(Shape<'static>),
    Mesh(Mesh),
}

impl Tip {
    fn round(name: &'static str, half_length: f32) -> Self {
        let shape = if half_length > 0.0 {
            Shape::Capsule {
                radius: RADIUS,
                half_length,
            }
        } else {
            Shape::Sphere { radius: RADIUS }
        };
        Self {
            name,
            form: Form::Round(shape),
            inside: vec![Vec3::ZERO, Vec3::Y * half_length, Vec3::Y * -half_length],
            reach: RADIUS + half_length,
        }
    }

    fn mesh(name: &'static str, mesh: Mesh) -> Self {
        let solid = Solid::new(&mesh, Pose::IDENTITY);
        let low = mesh.positions.iter().copied().reduce(Vec3::min).expect("nodes");
        let high = mesh.positions.iter().copied().reduce(Vec3::max).expect("nodes");
        let mut random = Random::new(11);
        let mut points: Vec<(f64, Vec3)> = (0..200)
            .map(|_| {
                let point = low + (high - low) * (random.vector() * 0.5 + 0.5);
                (solid.signed_distance(point.as_dvec3()), point)
            })
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points.truncate(8);
        assert!(points[7].0 < 0.0);
        Self {
            name,
            form: Form::Mesh(mesh),
            inside: points.into_iter().map(|point| point.1).collect(),
            reach: low.y.abs().max(high.y.abs()),
        }
    }

    fn shape(&self) -> Shape<'_> {
        match &self.form {
            Form::Round(shape) => *shape,
            Form::Mesh(mesh) => Shape::Mesh {
                positions: &mesh.positions,
                triangles: &mesh.triangles,
            },
        }
    }

    /// Returns how deep nodes, edges and faces of a body lie in the tip (m).
    fn depth(&self, world: &World, cloth: BodyId, tool: ToolId) -> f64 {
        let pose = world.pose(tool).expect("a tool");
        let mesh = match &self.form {
            Form::Round(shape) => return penetration(body(world, cloth), *shape, pose),
            Form::Mesh(mesh) => mesh,
        };
        let solid = Solid::new(mesh, pose);
        let reach = mesh.positions.iter().map(|node| node.length()).fold(0.0, f32::max);
        let cloth = body(world, cloth);
        let mut deepest = 0.0;
        for &triangle in cloth.surface() {
            let near = (pose.position.as_dvec3(), f64::from(reach));
            deepen(&solid, near, corners(cloth, triangle), &mut deepest);
        }
        deepest
    }
}

/// Raises `deepest` to the depth of a triangle in a solid that fits in a ball. It subdivides the triangle into quarters
/// down to 0.4 mm.
fn deepen(solid: &Solid, ball: (DVec3, f64), [a, b, c]: [DVec3; 3], deepest: &mut f64) {
    let middle = (a + b + c) / 3.0;
    let radius = a.distance(middle).max(b.distance(middle)).max(c.distance(middle));
    // Culls by the bounding balls of the triangle and the solid.
    if middle.distance(ball.0) > ball.1 + radius {
        return;
    }
    let depth = -solid.signed_distance(middle);
    *deepest = deepest.max(depth);
    if depth + radius > *deepest + 4e-4 {
        let (ab, bc, ca) = ((a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0);
        for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            deepen(solid, ball, part, deepest);
        }
    }
}

/// Creates a prism between z = -half and half. The profile is a simple polygon that is star-shaped from its first
/// point.
fn prism(profile: &[[f32; 2]], half: f32) -> Mesh {
    let count = profile.len() as u32;
    let positions: Vec<Vec3> = [-half, half]
        .iter()
        .flat_map(|&z| profile.iter().map(move |&[x, y]| Vec3::new(x, y, z)))
        .collect();
    let mut triangles = Vec::new();
    for i in 0..count {
        let next = (i + 1) % count;
        triangles.push([i, next, next + count]);
        triangles.push([i, next + count, i + count]);
        if i > 0 && next > 0 {
            triangles.push([0, next, i]);
            triangles.push([count, count + i, count + next]);
        }
    }
    Mesh {
        positions,
        triangles,
        ..Default::default()
    }
}

/// Creates a block from x = 0 to `length` with teeth on its lower side.
fn toothed(length: f32, height: f32, half: f32, teeth: u32) -> Mesh {
    let columns = 2 * teeth;
    let mut positions = Vec::new();
    for column in 0..=columns {
        let x = length * column as f32 / columns as f32;
        let low = if column % 2 == 0 { 0.0 } else { 0.3 * height };
        for (y, z) in [(low, -half), (height, -half), (height, half), (low, half)] {
            positions.push(Vec3::new(x, y - 0.5 * height, z));
        }
    }
    let mut triangles = vec![[0, 2, 1], [0, 3, 2]];
    for column in 0..columns {
        for side in 0..4 {
            let (a, b) = (4 * column + side, 4 * column + (side + 1) % 4);
            triangles.push([a, b, b + 4]);
            triangles.push([a, b + 4, a + 4]);
        }
    }
    let end = 4 * columns;
    triangles.extend([[end, end + 1, end + 2], [end, end + 2, end + 3]]);
    let reversed: Vec<[u32; 3]> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let volume = |triangles: &[[u32; 3]]| -> f32 {
        let corner = |node: u32| positions[node as usize];
        triangles
            .iter()
            .map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))))
            .sum()
    };
    Mesh {
        triangles: if volume(&triangles) > 0.0 { triangles } else { reversed },
        positions,
        ..Default::default()
    }
}

fn cube(half: f32) -> Mesh {
    prism(&[[-half, -half], [half, -half], [half, half], [-half, half]], half)
}

/// Its edge points down.
fn wedge(half: f32) -> Mesh {
    prism(&[[0.0, -half], [half, half], [-half, half]], half)
}

fn round_tips() -> Vec<Tip> {
    vec![Tip::round("sphere", 0.0), Tip::round("capsule", 0.01)]
}

fn mesh_tips() -> Vec<Tip> {
    let mut tips = vec![
        Tip::mesh("ball", ball(RADIUS, 1)),
        Tip::mesh("cube", cube(RADIUS)),
        Tip::mesh("wedge", wedge(RADIUS)),
        Tip::mesh("toothed", toothed(0.03, 0.005, 0.0025, 6)),
    ];
    tips.extend(real("forceps_jaw_left.stl", 1e-3).map(|mesh| Tip::mesh("jaw", mesh)));
    tips
}

/// Returns how the cloth winds about a point, closed by its initial shape and by the strip that its border has swept.
fn carried_past(world: &World, cloth: BodyId, first: &Mesh, point: DVec3) -> f64 {
    let nodes = body(world, cloth).positions();
    let row = CELLS + 1;
    let (mut rim, last) = (Vec::new(), row - 1);
    rim.extend(0..last);
    rim.extend((0..last).map(|i| i * row + last));
    rim.extend((0..last).map(|i| last * row + last - i));
    rim.extend((0..last).map(|i| (last - i) * row));
    let angle = |[a, b, c]: [DVec3; 3]| {
        let [a, b, c] = [a - point, b - point, c - point];
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    let current = |node: u32| nodes[node as usize].as_dvec3();
    let then = |node: u32| first.positions[node as usize].as_dvec3();
    let mut strip = 0.0;
    for (index, &a) in rim.iter().enumerate() {
        let b = rim[(index + 1) % rim.len()];
        strip += angle([current(a), current(b), then(b)]) + angle([current(a), then(b), then(a)]);
    }
    let sheets = winding(body(world, cloth), first, point);
    // The border can go round in either direction.
    let strip = strip / (4.0 * std::f64::consts::PI);
    let both = [sheets + strip, sheets - strip];
    let errors = both.map(|sum| (sum - sum.round()).abs());
    if errors[0] < errors[1] { both[0] } else { both[1] }
}

fn put(world: &mut World, mesh: &Mesh, solver: Solver) -> BodyId {
    let node_mass = TISSUE.node_mass(mesh);
    world
        .create_body(&BodyDefinition {
            masses: Values::Uniform(node_mass),
            node_dampings: Values::Uniform(TISSUE.drag * node_mass),
            stiffnesses: Values::Uniform(TISSUE.stiffness),
            spring_dampings: Values::Uniform(TISSUE.spring_damping),
            solver,
            ..BodyDefinition::of(mesh)
        })
        .expect("a body")
}

fn empty_world() -> World {
    World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..Default::default()
    })
    .expect("a world")
}

/// Returns the resolution of a field or an image of a tip (m). It is coarser than the default, because every jump
/// creates its own.
fn fineness(detection: Detection) -> f32 {
    match detection {
        Detection::Exact => 0.0,
        Detection::DistanceField => 0.4e-3,
        Detection::ImageSpace => 0.4e-3,
    }
}

/// One motion of a tip.
#[derive(Clone, Copy)]
struct Jump {
    detection: Detection,
    solver: Solver,
    dt: f32,
    size: f32,
    from: Pose,
    to: Pose,
}

impl Jump {
    fn name(&self, tip: &Tip) -> String {
        format!(
            "{} {:?} {:?} dt {} from {} {} to {} {}",
            tip.name,
            self.detection,
            self.solver,
            self.dt,
            self.from.position,
            self.from.orientation,
            self.to.position,
            self.to.orientation,
        )
    }

    fn set(&self, tip: &Tip, pinned: &[u32]) -> (World, Mesh, BodyId, ToolId) {
        let mesh = square(self.size, CELLS);
        let mut world = empty_world();
        let cloth = put(&mut world, &mesh, self.solver);
        pin_all(&mut world, cloth, pinned);
        let tool = world
            .create_tool(&ToolDefinition {
                detection: self.detection,
                resolution: fineness(self.detection),
                pose: self.from,
                ..ToolDefinition::new(tip.shape())
            })
            .expect("a tool");
        (world, mesh, cloth, tool)
    }

    /// Makes a tip jump through a cloth that is pinned along one edge. Returns an error message on failure.
    fn check(&self, tip: &Tip, allowed_depth: f64) -> Result<(), String> {
        let hung: Vec<u32> = (0..=CELLS).collect();
        let (mut world, mesh, cloth, tool) = self.set(tip, &hung);
        let step = |world: &mut World| -> Result<(), String> {
            let report = world.step(self.dt).map_err(|error| error.to_string())?;
            if report.bodies_restored > 0 {
                return Err("restored".into());
            }
            Ok(())
        };
        step(&mut world).map_err(|how| format!("before: {how}"))?;
        world
            .set_pose(tool, self.to.position, Some(self.to.orientation))
            .expect("a pose");
        step(&mut world)?;
        if !all_finite(body(&world, cloth)) {
            return Err("not finite".into());
        }
        let mut errors = String::new();
        for inside in &tip.inside {
            let position = |pose: Pose| (pose.position + pose.orientation * *inside).as_dvec3();
            let (from, to) = (position(self.from), position(self.to));
            let turns = carried_past(&world, cloth, &mesh, to).abs();
            let expected = if (from.y > 0.0) == (to.y > 0.0) { 0.0 } else { 1.0 };
            if (turns - expected).abs() > 0.01 {
                let _ = write!(errors, "passed through at {to}, winding {turns}; ");
            }
        }
        let depth = tip.depth(&world, cloth, tool);
        if depth > allowed_depth {
            let _ = write!(errors, "{depth} m deep; ");
        }
        let force = world.wrench(tool).expect("a tool").0;
        if !(force.length() > 0.0) {
            let _ = write!(errors, "not touched; ");
        }
        if !errors.is_empty() {
            return Err(errors);
        }
        // Tissue that was carried along flies on and comes back.
        for later in 0..2 {
            step(&mut world).map_err(|how| format!("step {later} after: {how}"))?;
            if !all_finite(body(&world, cloth)) {
                return Err(format!("step {later} after: not finite"));
            }
        }
        Ok(())
    }
}

fn jumps(tip: &Tip, detection: Detection) -> Vec<Jump> {
    let mut random = Random::new(5);
    let mut jumps = Vec::new();
    for solver in SOLVERS {
        for dt in STEPS {
            let size = if dt > 0.01 { LARGE } else { SMALL };
            for (index, aim) in AIMS.iter().enumerate() {
                let rotated = random.orientation();
                if (index < 2) == (dt > 0.01) {
                    continue;
                }
                // Each target once upright and once rotated.
                let upright = (index % 2 == 0) == (solver == Solver::Verlet);
                let orientation = if upright { Quat::IDENTITY } else { rotated };
                let height = tip.reach.max(0.03) + 0.002;
                let lateral = random.vector() * Vec3::new(0.1, 0.0, 0.1);
                let from = *aim * (size / CELLS as f32) + (Vec3::Y - lateral) * height;
                let to = from + (lateral - Vec3::Y).normalize() * FAR;
                let pose = |position: Vec3| Pose { position, orientation };
                jumps.push(Jump {
                    detection,
                    solver,
                    dt,
                    size,
                    from: pose(from),
                    to: pose(to),
                });
            }
        }
    }
    jumps
}

/// Allows only the known limitation: the thin end of a jaw, or a tooth, passes through a coarse cloth in at most one of
/// twelve jumps.
fn assert_only_known_failures(failures: &[String], count: usize) {
    let is_known = |failure: &String| {
        (failure.starts_with("jaw") || failure.starts_with("toothed")) && failure.contains("passed through")
    };
    assert!(
        failures.iter().all(is_known) && failures.len() <= count / 12,
        "{} of {count}:\n{}",
        failures.len(),
        failures.join("\n")
    );
}

fn jump_everywhere(tips: &[Tip], detection: Detection, allowed_depth: f64) {
    let mut failures = Vec::new();
    let mut count = 0;
    for tip in tips {
        for jump in jumps(tip, detection) {
            count += 1;
            if let Err(how) = jump.check(tip, allowed_depth) {
                failures.push(format!("{}: {how}", jump.name(tip)));
            }
        }
    }
    assert_only_known_failures(&failures, count);
}

#[test]
fn a_round_tip_carries_a_cloth_half_a_meter() {
    jump_everywhere(&round_tips(), Detection::Exact, 0.5 * f64::from(RADIUS));
}

#[test]
fn a_mesh_carries_a_cloth_half_a_meter_with_exact_detection() {
    jump_everywhere(&mesh_tips()[1..3], Detection::Exact, 0.5 * f64::from(RADIUS));
}

#[test]
#[ignore = "long"]
fn other_meshes_carry_a_cloth_half_a_meter_with_exact_detection() {
    let mut tips = mesh_tips();
    tips.drain(1..3);
    jump_everywhere(&tips, Detection::Exact, 0.5 * f64::from(RADIUS));
}

#[test]
#[ignore = "long"]
fn a_mesh_carries_a_cloth_half_a_meter_with_a_distance_field() {
    jump_everywhere(&mesh_tips(), Detection::DistanceField, 0.5 * f64::from(RADIUS));
}

#[test]
fn a_swinging_jaw_carries_a_cloth() {
    check_a_swinging_jaw_carries_a_cloth(&[Detection::Exact]);
}

#[test]
#[ignore = "long"]
fn a_swinging_jaw_carries_a_cloth_with_other_detections() {
    check_a_swinging_jaw_carries_a_cloth(&[Detection::DistanceField, Detection::ImageSpace]);
}

fn check_a_swinging_jaw_carries_a_cloth(detections: &[Detection]) {
    let mut tips = mesh_tips();
    tips.retain(|tip| tip.name == "toothed" || tip.name == "jaw");
    let mut failures = Vec::new();
    let mut count = 0;
    for tip in &tips {
        // The toothed block lies along x, the jaw along z. Each swings downward about its end.
        let (lying, axis) = if tip.name == "toothed" {
            (Quat::IDENTITY, Vec3::NEG_Z)
        } else {
            (Quat::from_rotation_z(0.3), Vec3::X)
        };
        for &detection in detections {
            for solver in SOLVERS {
                for dt in STEPS {
                    for (aim, swing) in AIMS.iter().zip([1.0, 1.571]) {
                        let position = *aim * (SMALL / CELLS as f32) + Vec3::Y * 0.006;
                        let orientation = Quat::from_axis_angle(axis, swing) * lying;
                        let jump = Jump {
                            detection,
                            solver,
                            dt,
                            size: SMALL,
                            from: Pose {
                                position,
                                orientation: lying,
                            },
                            to: Pose { position, orientation },
                        };
                        count += 1;
                        if let Err(how) = jump.check(tip, 0.5 * f64::from(RADIUS)) {
                            failures.push(format!("{}: {how}", jump.name(tip)));
                        }
                    }
                }
            }
        }
    }
    assert_only_known_failures(&failures, count);
}

/// Steps a cloth for `seconds`, then checks that it has returned to its rest shape.
fn recover(world: &mut World, cloth: BodyId, first: &Mesh, dt: f32, seconds: f32) -> Result<(), String> {
    for step in 0..(seconds / dt) as u32 {
        world.step(dt).map_err(|error| format!("step {step} after: {error}"))?;
    }
    let nodes = body(world, cloth).positions();
    let error = nodes
        .iter()
        .zip(&first.positions)
        .map(|(current, then)| current.distance(*then));
    let error = error.fold(0.0, f32::max);
    // A flat cloth without tension returns slowly across its plane.
    if !(error < 3e-3) {
        return Err(format!("{error} m from its shape"));
    }
    Ok(())
}

#[test]
fn a_cloth_with_a_pinned_border_recovers_when_the_tool_returns() {
    check_a_cloth_with_a_pinned_border_recovers_when_the_tool_returns(|detection| detection == Detection::Exact);
}

#[test]
#[ignore = "long"]
fn a_cloth_with_a_pinned_border_recovers_when_the_tool_returns_with_a_distance_field() {
    check_a_cloth_with_a_pinned_border_recovers_when_the_tool_returns(|detection| detection != Detection::Exact);
}

fn check_a_cloth_with_a_pinned_border_recovers_when_the_tool_returns(is_selected: fn(Detection) -> bool) {
    let mut failures = Vec::new();
    let mut count = 0;
    let mut tips = mesh_tips();
    // Thin and toothed tips pass through, and drag the cloth along when they come back.
    tips.retain(|tip| tip.name != "toothed" && tip.name != "jaw");
    tips.extend(round_tips());
    for tip in &tips {
        // Image-space detection would take a minute.
        let detections = match tip.form {
            Form::Round(_) => &[Detection::Exact][..],
            Form::Mesh(_) => &[Detection::Exact, Detection::DistanceField],
        };
        for &detection in detections {
            for solver in SOLVERS {
                let dt = 1.0 / 60.0;
                let aim = AIMS[count % 4] * (SMALL / CELLS as f32);
                let from = aim + Vec3::Y * (tip.reach.max(0.03) + 0.002);
                let pose = |position: Vec3| Pose {
                    position,
                    orientation: Quat::IDENTITY,
                };
                let to = from - Vec3::Y * FAR;
                let jump = Jump {
                    detection,
                    solver,
                    dt,
                    size: SMALL,
                    from: pose(from),
                    to: pose(to),
                };
                count += 1;
                if !is_selected(detection) {
                    continue;
                }
                let (mut world, mesh, cloth, tool) = jump.set(tip, &rim(CELLS));
                world.step(dt).expect("a step");
                world.set_pose(tool, to, None).expect("a pose");
                for _ in 0..2 {
                    match world.step(dt) {
                        Ok(_) | Err(Error::Unstable { .. }) => {}
                        Err(error) => failures.push(format!("{}: {error}", jump.name(tip))),
                    }
                }
                world.set_pose(tool, from, None).expect("a pose");
                let finite = all_finite(body(&world, cloth));
                let recovered = recover(&mut world, cloth, &mesh, dt, 1.0);
                if let Err(how) = recovered {
                    failures.push(format!("{}: {how}, finite {finite}", jump.name(tip)));
                }
            }
        }
    }
    assert!(
        failures.is_empty(),
        "{} of {count}:\n{}",
        failures.len(),
        failures.join("\n")
    );
}
