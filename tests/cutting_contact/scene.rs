//! Bodies that are cut and meet tissue, and measures of where they are in `f64` that know nothing of the library's contact.

use crate::support::kept::Kept;
use crate::support::tissue::point_to_triangle;
use glam::{DVec3, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{Body, BodyContact, BodyDefinition, BodyId, Material, Model, Solver, Values, World, WorldDefinition};

pub const DOWN: Vec3 = vec3(0.0, -9.81, 0.0);

pub const MEETS_ITSELF: BodyContact = BodyContact {
    with_itself: true,
    ..BodyContact::NOTHING
};

/// What a body is made of.
#[derive(Clone, Copy, Debug)]
pub struct Matter {
    /// kg.
    pub mass: f32,
    /// Of springs, N/m, for sheets and where there are no elements.
    pub stiffness: f32,
    /// Along springs, N s/m.
    pub damping: f32,
    /// Against the world, 1/s.
    pub drag: f32,
    /// Pa; 0: springs.
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

/// One of so many substeps; 0: as many as it takes.
pub fn world_of(gravity: Vec3, threads: u32, substeps: u32) -> World {
    World::new(WorldDefinition {
        gravity,
        thread_count: threads,
        substeps,
        ..Default::default()
    })
    .unwrap()
}

/// 4 x 3 x 3 cm about the origin, in cells of 1 cm.
pub fn block() -> Mesh {
    Mesh::block([0.04, 0.03, 0.03], [4, 3, 3]).unwrap()
}

/// A square in the plane y = 0 about the origin, of so many cells of 1 cm.
pub fn sheet(cells: u32) -> Mesh {
    let size = 0.01 * cells as f32;
    Mesh::cloth([size; 2], [cells; 2]).unwrap()
}

/// A blade's edge along `along` that passes from one place to another.
pub fn sweep(from: Vec3, to: Vec3, along: Vec3) -> Sweep {
    Sweep {
        start: [from - along, from + along],
        end: [to - along, to + along],
    }
}

/// Where the corners of each triangle of a surface are.
pub fn triangles(body: &Body) -> Vec<[DVec3; 3]> {
    let places = body.positions();
    let corners = body.surface().iter();
    corners
        .map(|corners| corners.map(|corner| places[corner as usize].as_dvec3()))
        .collect()
}

/// How often a closed surface winds about a point (van Oosterom, Strackee 1983).
pub fn winding(triangles: &[[DVec3; 3]], point: DVec3) -> f64 {
    let angle = |triangle: &[DVec3; 3]| {
        let [a, b, c] = triangle.map(|corner| corner - point);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// How many corners of a solid's surface lie within tissue other than that behind them, deeper than `depth`: twice as far behind a corner there is
/// a place, so deep within all that is about it, that the surface winds about more than once.
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
        corners.filter_map(|(outward, place)| Some(place.as_dvec3() - outward.try_normalize()? * (2.0 * depth)));
    let is_deep = |place: DVec3| {
        triangles
            .iter()
            .all(|&triangle| point_to_triangle(place, triangle) > depth)
    };
    corners
        .filter(|&place| winding(&triangles, place) > 1.5 && is_deep(place))
        .count()
}

pub fn kept(world: &World, bodies: &[BodyId]) -> Kept {
    let mut kept = Kept::default();
    for &id in bodies {
        kept.add(world.body(id).unwrap(), world.gravity());
    }
    kept
}

/// The sum of what holds these pins, N.
pub fn pin_force(world: &World, body: BodyId, nodes: &[u32]) -> DVec3 {
    let force = |&node: &u32| world.body(body).unwrap().pin_force(node).unwrap().as_dvec3();
    nodes.iter().map(force).sum()
}
