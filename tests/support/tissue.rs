//! Helpers of the contact tests: tissue, tools, and measures in `f64` that do not use the library's geometry.

#![allow(dead_code, reason = "each test uses some of these helpers")]

use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    Body, BodyDefinition, BodyId, Pose, Shape, Solver, ToolDefinition, ToolId, Values, World, WorldDefinition,
};

/// Pseudo-random numbers from a fixed seed.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(2).wrapping_add(1))
    }

    /// Returns a number between 0 and 1.
    pub fn unit(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    /// Returns a number between `low` and `high`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Returns a vector with coordinates between -1 and 1.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(
            self.between(-1.0, 1.0),
            self.between(-1.0, 1.0),
            self.between(-1.0, 1.0),
        )
    }

    pub fn direction(&mut self) -> Vec3 {
        loop {
            let vector = self.vector();
            if (0.1..1.0).contains(&vector.length()) {
                return vector.normalize();
            }
        }
    }

    pub fn orientation(&mut self) -> Quat {
        Quat::from_axis_angle(self.direction(), self.between(-3.1, 3.1))
    }

    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f32) as usize % count
    }
}

/// The parameters of spring tissue.
#[derive(Clone, Copy, Debug)]
pub struct Tissue {
    /// The mass of the whole body (kg).
    pub mass: f32,
    /// The stiffness of each spring (N/m).
    pub stiffness: f32,
    /// Damping against the world (1/s).
    pub drag: f32,
    /// Damping along springs (N s/m).
    pub spring_damping: f32,
}

impl Tissue {
    /// Light and soft, without damping.
    pub const SOFT: Self = Self {
        mass: 0.1,
        stiffness: 20.0,
        drag: 0.0,
        spring_damping: 0.0,
    };

    /// Soft, with damping along springs only, which conserves momentum.
    pub const VISCOUS: Self = Self {
        spring_damping: 0.02,
        ..Self::SOFT
    };

    /// Viscous, with drag that brings it to rest soon.
    pub const CALM: Self = Self {
        drag: 8.0,
        ..Self::VISCOUS
    };

    pub fn node_mass(&self, mesh: &Mesh) -> f32 {
        self.mass / mesh.positions.len() as f32
    }

    pub fn put(&self, world: &mut World, mesh: &Mesh) -> BodyId {
        self.put_for(Solver::default(), world, mesh)
    }

    pub fn put_for(&self, solver: Solver, world: &mut World, mesh: &Mesh) -> BodyId {
        let node_mass = self.node_mass(mesh);
        world
            .create_body(&BodyDefinition {
                masses: Values::Uniform(node_mass),
                node_dampings: Values::Uniform(self.drag * node_mass),
                stiffnesses: Values::Uniform(self.stiffness),
                spring_dampings: Values::Uniform(self.spring_damping),
                solver,
                ..BodyDefinition::of(mesh)
            })
            .expect("a body")
    }
}

/// Creates a world with this gravity and default settings.
pub fn world(gravity: Vec3) -> World {
    World::new(WorldDefinition {
        gravity,
        ..Default::default()
    })
    .expect("a world")
}

/// Creates a world with this gravity that takes exactly `substeps`.
pub fn world_of(gravity: Vec3, substeps: u32) -> World {
    World::new(WorldDefinition {
        gravity,
        substeps,
        ..Default::default()
    })
    .expect("a world")
}

pub fn tool(world: &mut World, shape: Shape, friction: f32, position: Vec3, orientation: Quat) -> ToolId {
    world
        .create_tool(&ToolDefinition {
            friction,
            pose: Pose { position, orientation },
            ..ToolDefinition::new(shape)
        })
        .expect("a tool")
}

pub fn sphere(world: &mut World, radius: f32, position: Vec3) -> ToolId {
    tool(world, Shape::Sphere { radius }, 0.0, position, Quat::IDENTITY)
}

/// Returns a square cloth of side `size` in the plane y = 0.
pub fn square(size: f32, cells: u32) -> Mesh {
    Mesh::cloth([size, size], [cells, cells]).expect("a cloth")
}

pub fn moved(mut mesh: Mesh, by: Vec3) -> Mesh {
    for position in &mut mesh.positions {
        *position += by;
    }
    mesh
}

/// Returns the border nodes of a square cloth.
pub fn rim(cells: u32) -> Vec<u32> {
    let row = cells + 1;
    (0..row * row)
        .filter(|node| {
            [node % row, node / row]
                .iter()
                .any(|&coordinate| coordinate == 0 || coordinate == cells)
        })
        .collect()
}

pub fn pin_all(world: &mut World, body: BodyId, nodes: &[u32]) {
    for &node in nodes {
        world.body_mut(body).expect("a body").pin(node).expect("a pin");
    }
}

pub fn body(world: &World, id: BodyId) -> &Body {
    world.body(id).expect("a body")
}

pub fn kinetic(world: &World, id: BodyId) -> f64 {
    body(world, id).energy(world.gravity()).kinetic
}

pub fn total_energy(world: &World, id: BodyId) -> f64 {
    let energy = body(world, id).energy(world.gravity());
    energy.kinetic + energy.elastic + energy.gravitational
}

/// Returns the sum of the forces on these pins.
pub fn pin_forces(world: &World, id: BodyId, nodes: &[u32]) -> DVec3 {
    nodes
        .iter()
        .map(|&node| body(world, id).pin_force(node).expect("a pin").as_dvec3())
        .sum()
}

/// Returns the moment about `about` of the forces on these pins.
pub fn pin_moments(world: &World, id: BodyId, nodes: &[u32], about: DVec3) -> DVec3 {
    let body = body(world, id);
    nodes
        .iter()
        .map(|&node| {
            let arm = body.positions()[node as usize].as_dvec3() - about;
            arm.cross(body.pin_force(node).expect("a pin").as_dvec3())
        })
        .sum()
}

/// Returns the momentum of a body whose nodes have equal masses.
pub fn momentum(body: &Body, node_mass: f32) -> DVec3 {
    let sum: DVec3 = body.velocities().iter().map(|velocity| velocity.as_dvec3()).sum();
    sum * f64::from(node_mass)
}

/// Returns the angular momentum about a point of a body whose nodes have equal masses.
pub fn angular_momentum(body: &Body, node_mass: f32, about: DVec3) -> DVec3 {
    let sum: DVec3 = body
        .positions()
        .iter()
        .zip(body.velocities())
        .map(|(position, velocity)| (position.as_dvec3() - about).cross(velocity.as_dvec3()))
        .sum();
    sum * f64::from(node_mass)
}

pub fn centre(body: &Body) -> DVec3 {
    let sum: DVec3 = body.positions().iter().map(|position| position.as_dvec3()).sum();
    sum / body.node_count() as f64
}

pub fn all_finite(body: &Body) -> bool {
    body.positions()
        .iter()
        .chain(body.velocities())
        .all(|vector| vector.is_finite())
}

/// Returns the distance of a point from the segment from `a` to `b`.
pub fn point_to_segment(point: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = b - a;
    let length = along.length_squared();
    let t = if length > 0.0 {
        ((point - a).dot(along) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    point.distance(a + along * t)
}

/// Returns the distance of a point from a triangle: to its plane if the foot point lies within, else to the nearest
/// edge.
pub fn point_to_triangle(point: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let edges = point_to_segment(point, a, b)
        .min(point_to_segment(point, b, c))
        .min(point_to_segment(point, c, a));
    let normal = (b - a).cross(c - a);
    let Some(unit) = normal.try_normalize() else {
        return edges;
    };
    let height = (point - a).dot(unit);
    let foot = point - unit * height;
    let within = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|&(p, q)| (q - p).cross(foot - p).dot(unit) >= 0.0);
    if within { height.abs() } else { edges }
}

/// Returns the distance of two segments: between their ends, or along the common perpendicular if it meets both.
pub fn segment_to_segment(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let ends = point_to_segment(a, c, d)
        .min(point_to_segment(b, c, d))
        .min(point_to_segment(c, a, b))
        .min(point_to_segment(d, a, b));
    let (u, v, w) = (b - a, d - c, c - a);
    let cross = u.cross(v);
    let square = cross.length_squared();
    if square <= 1e-12 * u.length_squared() * v.length_squared() {
        return ends;
    }
    let s = w.cross(v).dot(cross) / square;
    let t = w.cross(u).dot(cross) / square;
    if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
        ends.min(w.dot(cross).abs() / square.sqrt())
    } else {
        ends
    }
}

fn segment_to_triangle(p: DVec3, q: DVec3, triangle: [DVec3; 3]) -> f64 {
    let [a, b, c] = triangle;
    let normal = (b - a).cross(c - a);
    let (at_p, at_q) = ((p - a).dot(normal), (q - a).dot(normal));
    if at_p * at_q < 0.0 {
        let foot = p.lerp(q, at_p / (at_p - at_q));
        let within = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|&(s, e)| (e - s).cross(foot - s).dot(normal) >= 0.0);
        if within {
            return 0.0;
        }
    }
    segment_to_segment(p, q, a, b)
        .min(segment_to_segment(p, q, b, c))
        .min(segment_to_segment(p, q, c, a))
        .min(point_to_triangle(p, triangle))
        .min(point_to_triangle(q, triangle))
}

pub fn corners(body: &Body, triangle: [u32; 3]) -> [DVec3; 3] {
    triangle.map(|node| body.positions()[node as usize].as_dvec3())
}

/// Returns how deep the surface and the nodes of a body lie in a tool shape at a pose; negative outside (m).
pub fn penetration(body: &Body, shape: Shape, pose: Pose) -> f64 {
    let centre = pose.position.as_dvec3();
    let axis = pose.orientation.as_dquat() * DVec3::Y;
    let (p, q, radius) = match shape {
        Shape::Sphere { radius } => (centre, centre, radius),
        Shape::Capsule { radius, half_length } => {
            let half = axis * f64::from(half_length);
            (centre - half, centre + half, radius)
        }
        Shape::Plane => {
            let lowest = body
                .positions()
                .iter()
                .map(|node| (node.as_dvec3() - centre).dot(axis))
                .fold(f64::INFINITY, f64::min);
            return -lowest;
        }
        Shape::Box { half_extents } => return penetration_of_box(body, half_extents.as_dvec3(), pose),
        Shape::Mesh { .. } => unreachable!("mesh tools have their own measure of depth"),
    };
    let nodes = body
        .positions()
        .iter()
        .map(|node| point_to_segment(node.as_dvec3(), p, q));
    let faces = body.surface().iter().map(|&triangle| {
        let triangle = corners(body, triangle);
        if p == q {
            point_to_triangle(p, triangle)
        } else {
            segment_to_triangle(p, q, triangle)
        }
    });
    f64::from(radius) - nodes.chain(faces).fold(f64::INFINITY, f64::min)
}

/// Returns how deep the surface of a body lies in a box; negative outside (m). It samples triangles with eight points
/// per side.
fn penetration_of_box(body: &Body, half_extents: DVec3, pose: Pose) -> f64 {
    const SAMPLES: u32 = 8;
    let to_local = pose.orientation.as_dquat().inverse();
    let mut deepest = f64::NEG_INFINITY;
    for &triangle in body.surface() {
        let [a, b, c] = corners(body, triangle).map(|corner| to_local * (corner - pose.position.as_dvec3()));
        for i in 0..=SAMPLES {
            for j in 0..=SAMPLES - i {
                let [u, v] = [i, j].map(|part| f64::from(part) / f64::from(SAMPLES));
                let point = a + (b - a) * u + (c - a) * v;
                deepest = deepest.max((half_extents - point.abs()).min_element());
            }
        }
    }
    deepest
}

/// Returns how deep a body lies in a tool of a world (m).
pub fn penetration_of(world: &World, id: BodyId, shape: Shape, tool: ToolId) -> f64 {
    penetration(body(world, id), shape, world.pose(tool).expect("a tool"))
}

/// Returns how often the surface between a cloth and its initial shape winds about a point. The border of the cloth
/// must not move.
///
/// The result is 0 for points that the cloth did not pass, and -1 or 1 for points that it passed. It sums the solid
/// angles of the triangles (van Oosterom and Strackee 1983).
pub fn winding(body: &Body, first: &Mesh, point: DVec3) -> f64 {
    let solid_angle = |triangle: [DVec3; 3]| {
        let [a, b, c] = triangle.map(|corner| corner - point);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    let now: f64 = body
        .surface()
        .iter()
        .map(|&triangle| solid_angle(corners(body, triangle)))
        .sum();
    let before: f64 = first
        .triangles
        .iter()
        .map(|triangle| solid_angle(triangle.map(|node| first.positions[node as usize].as_dvec3())))
        .sum();
    (now - before) / (4.0 * std::f64::consts::PI)
}
