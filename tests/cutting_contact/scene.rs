//! Bodies that are cut and collide, and geometric measures in `f64` that do not use the library's contact.

use crate::support::kept::Kept;
use crate::support::tissue::point_to_triangle;
use glam::{DVec3, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{Body, BodyContact, BodyDefinition, BodyId, Material, Model, Solver, Values, World, WorldDefinition};

pub const DOWN: Vec3 = vec3(0.0, -9.81, 0.0);

pub const SELF_CONTACT: BodyContact = BodyContact {
    with_itself: true,
    ..BodyContact::NOTHING
};

/// The parameters of a body.
#[derive(Clone, Copy, Debug)]
pub struct Matter {
    /// kg.
    pub mass: f32,
    /// The stiffness of springs (N/m), for sheets and for bodies without elements.
    pub stiffness: f32,
    /// Damping along springs (N s/m).
    pub damping: f32,
    /// Damping against the world (1/s).
    pub drag: f32,
    /// Young's modulus (Pa); 0 for springs.
    pub young: f32,
    pub solver: Solver,
    pub contact: BodyContact,
    pub spare: u32,
}

impl Matter {
    /// A block of 120 g.
    pub const BLOCK: Self = Self {
        mass: 0.12,
        stiffness: 60.0,
        damping: 0.0,
        drag: 0.0,
        young: 0.0,
        solver: Solver::Verlet,
        contact: BodyContact::NOTHING,
        spare: 2000,
    };

    /// A sheet of 10 g.
    pub const SHEET: Self = Self {
        mass: 0.01,
        stiffness: 20.0,
        ..Self::BLOCK
    };

    pub fn put(&self, world: &mut World, mesh: &Mesh) -> BodyId {
        let mass = self.mass / mesh.positions.len() as f32;
        let elements = Material {
            model: Model::Tetrahedra,
            young_modulus: self.young,
            poisson_ratio: 0.3,
            ..Default::default()
        };
        let is_elements = self.young > 0.0;
        world
            .create_body(&BodyDefinition {
                masses: Values::Uniform(mass),
                node_dampings: Values::Uniform(self.drag * mass),
                stiffnesses: Values::Uniform(if is_elements { 0.0 } else { self.stiffness }),
                spring_dampings: Values::Uniform(if is_elements { 0.0 } else { self.damping }),
                material: is_elements.then_some(elements),
                solver: self.solver,
                contact: self.contact,
                spare_nodes: self.spare,
                mass_scaling: 0.0,
                ..BodyDefinition::of(mesh)
            })
            .unwrap()
    }
}

pub fn world(gravity: Vec3, threads: u32) -> World {
    world_of(gravity, threads, 0)
}

/// Creates a world that takes `substeps` substeps; 0 lets the library choose.
pub fn world_of(gravity: Vec3, threads: u32, substeps: u32) -> World {
    World::new(WorldDefinition {
        gravity,
        thread_count: threads,
        substeps,
        ..Default::default()
    })
    .unwrap()
}

/// Returns a block of 4 x 3 x 3 cm about the origin, in cells of 1 cm.
pub fn block() -> Mesh {
    Mesh::block([0.04, 0.03, 0.03], [4, 3, 3]).unwrap()
}

/// Returns a square in the plane y = 0 about the origin, with `cells` cells of 1 cm per side.
pub fn sheet(cells: u32) -> Mesh {
    let size = 0.01 * cells as f32;
    Mesh::cloth([size; 2], [cells; 2]).unwrap()
}

/// Returns the sweep of an edge along `along` that moves from `from` to `to`.
pub fn sweep(from: Vec3, to: Vec3, along: Vec3) -> Sweep {
    Sweep {
        start: [from - along, from + along],
        end: [to - along, to + along],
    }
}

/// Returns the corners of each triangle of a surface.
pub fn triangles(body: &Body) -> Vec<[DVec3; 3]> {
    let positions = body.positions();
    let corners = body.surface().iter();
    corners
        .map(|corners| corners.map(|corner| positions[corner as usize].as_dvec3()))
        .collect()
}

/// Returns the winding number of a closed surface about a point (van Oosterom, Strackee 1983).
pub fn winding(triangles: &[[DVec3; 3]], point: DVec3) -> f64 {
    let angle = |triangle: &[DVec3; 3]| {
        let [a, b, c] = triangle.map(|corner| corner - point);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(denominator)
    };
    triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Counts the corners of a solid's surface that overlap other tissue by more than `depth`. For such a corner, the point
/// at twice this depth behind it is far from the surface, and the surface winds about it more than once.
pub fn overlapping(body: &Body, depth: f64) -> usize {
    let triangles = triangles(body);
    let mut outward = vec![DVec3::ZERO; body.positions().len()];
    for (corners, [a, b, c]) in body.surface().iter().zip(&triangles) {
        for &corner in corners {
            outward[corner as usize] += (*b - *a).cross(*c - *a);
        }
    }
    let corners = outward.iter().zip(body.positions());
    let corners =
        corners.filter_map(|(outward, point)| Some(point.as_dvec3() - outward.try_normalize()? * (2.0 * depth)));
    let is_deep = |point: DVec3| {
        triangles
            .iter()
            .all(|&triangle| point_to_triangle(point, triangle) > depth)
    };
    corners
        .filter(|&point| winding(&triangles, point) > 1.5 && is_deep(point))
        .count()
}

pub fn kept(world: &World, bodies: &[BodyId]) -> Kept {
    let mut kept = Kept::default();
    for &id in bodies {
        kept.add(world.body(id).unwrap(), world.gravity());
    }
    kept
}

/// Returns the sum of the forces on these pins (N).
pub fn pin_force(world: &World, body: BodyId, nodes: &[u32]) -> DVec3 {
    let force = |&node: &u32| world.body(body).unwrap().pin_force(node).unwrap().as_dvec3();
    nodes.iter().map(force).sum()
}
