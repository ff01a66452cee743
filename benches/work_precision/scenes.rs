//! The scenes: an organ of uniform and of varying stiffness, a real organ with slivers, a cloth, a cantilever.

use std::path::Path;

use glam::{DVec3, Vec3};
use sinew::mesh::{Mesh, MeshFormat, load};

use crate::random::Random;
use crate::scene::Scene;

pub const NAMES: [&str; 5] = ["organ", "stomach", "contrast", "cloth", "cantilever"];

/// Planned scenes that are not possible yet, and the reasons.
pub const PENDING: [(&str, &str); 2] = [
    (
        "liver under gravity with a pressing sphere",
        "baselines and reference have no contact yet",
    ),
    ("nearly incompressible block", "bodies have no volume term yet"),
];

/// The scene of this name, or the reason that it is not available.
pub fn scene(name: &str) -> Result<Scene, String> {
    match name {
        "organ" => Ok(organ()),
        "stomach" => stomach(),
        "contrast" => Ok(contrast()),
        "cloth" => Ok(cloth()),
        _ => Ok(cantilever()),
    }
}

/// Density of most soft tissue [kg/m³].
const DENSITY: f64 = 1060.0;

/// A body of well-shaped tetrahedra, about as many as the stomach has.
fn organ() -> Scene {
    let mesh = Mesh::organ(0.133, 0.0037).expect("an organ of this spacing");
    hung("organ", "a body shaped like a liver, without slivers", &mesh)
}

/// A real mesh with slivers.
fn stomach() -> Result<Scene, String> {
    const FILE: &str = "shared/meshes/stomach.msh";
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().skip(1);
    let mut files = above.map(|folder| folder.join(FILE));
    let file = files
        .find(|file| file.exists())
        .ok_or_else(|| format!("there is no {FILE}"))?;
    let loaded = load(&file, MeshFormat::Auto, 1e-3).map_err(|error| error.to_string())?;
    let mut scene = hung("stomach", "a stomach, with slivers", &centered(loaded.mesh));
    // Under its whole weight slivers snap through, differently each time.
    scene.gravity_at_rest = 2.0 * scene.gravity.normalize();
    Ok(scene)
}

/// A body fixed at one end of its longest axis, which starts to sag under its own weight.
fn hung(name: &'static str, body: &str, mesh: &Mesh) -> Scene {
    const YOUNG: f64 = 5e3;
    const PINNED_FRACTION: f64 = 0.03;
    let low = mesh.positions.iter().fold(Vec3::INFINITY, |low, p| low.min(*p));
    let high = mesh.positions.iter().fold(Vec3::NEG_INFINITY, |high, p| high.max(*p));
    let extent = high - low;
    let long = (0..3).fold(0, |long, axis| if extent[axis] > extent[long] { axis } else { long });
    let description = format!(
        "The tetrahedra of {body}, {:.0} mm long, E = 5 kPa by Van Gelder's springs, fixed in the upper 3 % and released from \
         its rest shape.",
        1e3 * extent[long]
    );
    Scene::of_tetrahedra(
        name,
        description,
        mesh,
        [YOUNG, DENSITY],
        DVec3::AXES[long],
        PINNED_FRACTION,
    )
}

/// The organ with one spring in five a thousand times as stiff.
fn contrast() -> Scene {
    let mut scene = organ();
    let mut random = Random(5);
    for stiffness in &mut scene.stiffnesses {
        if random.below(5) == 0 {
            *stiffness *= 1000.0;
        }
    }
    scene.name = "contrast";
    scene.description = "The organ, one spring in five 1000 times as stiff.".into();
    scene
}

/// A sheet, initially flat, that swings down from two of its corners.
fn cloth() -> Scene {
    const SIDE: u32 = 100;
    /// Surface density [kg/m²].
    const SURFACE_DENSITY: f32 = 0.2;
    /// Stiffness [N/m].
    const STIFFNESS: f32 = 100.0;
    let spacing = 1.0 / (SIDE - 1) as f32;
    let diagonal = std::f32::consts::SQRT_2 * spacing;
    let mut positions = Vec::new();
    let mut springs = Vec::new();
    let mut rest_lengths = Vec::new();
    let mut join = |pair: [u32; 2], length: f32| {
        springs.push(pair);
        rest_lengths.push(length);
    };
    for row in 0..SIDE {
        for column in 0..SIDE {
            let node = row * SIDE + column;
            positions.push(Vec3::new(column as f32, 0.0, row as f32) * spacing - Vec3::new(0.5, 0.0, 0.5));
            let (right, below) = (column + 1 < SIDE, row + 1 < SIDE);
            if right {
                join([node, node + 1], spacing);
            }
            if below {
                join([node, node + SIDE], spacing);
            }
            if right && below {
                join([node, node + SIDE + 1], diagonal);
                join([node + 1, node + SIDE], diagonal);
            }
        }
    }
    let mut masses = vec![SURFACE_DENSITY * spacing * spacing; positions.len()];
    masses[0] = 0.0;
    masses[SIDE as usize - 1] = 0.0;
    Scene {
        name: "cloth",
        description: "100 x 100 nodes, 1 m, 0.2 kg/m², springs of 100 N/m along the axes and both diagonals, flat at \
                      first, pinned at two corners."
            .into(),
        positions,
        masses,
        stiffnesses: vec![STIFFNESS; springs.len()],
        springs,
        tetrahedra: Vec::new(),
        rest_lengths,
        gravity: Vec3::new(0.0, -9.81, 0.0),
        // A hanging cloth wrinkles differently each time; in its plane it has one rest shape.
        gravity_at_rest: Vec3::new(0.0, 0.0, 9.81),
        damping_rate: 0.0,
    }
}

/// A beam of cubes, fixed at one end, that starts to bend under its own weight.
fn cantilever() -> Scene {
    /// Cells along x, y and z.
    const CELLS: [usize; 3] = [40, 10, 10];
    /// Size of a cell [m].
    const CELL: f64 = 5e-3;
    /// Young's modulus [Pa].
    const YOUNG: f64 = 100e3;
    let nodes = CELLS.map(|cells| cells + 1);
    let number = |[x, y, z]: [usize; 3]| (x + nodes[0] * (y + nodes[1] * z)) as u32;
    // At an end of the block along an axis, a node has half of a cell's share.
    let share = |index: usize, axis: usize| if index == 0 || index == CELLS[axis] { 0.5 } else { 1.0 };
    let mut scene = Scene {
        name: "cantilever",
        description:
            "40 x 10 x 10 cubes of 5 mm, E = 100 kPa by axis and face-diagonal springs of 0.4 E a, fixed at one \
                      end."
                .into(),
        positions: Vec::new(),
        masses: Vec::new(),
        springs: Vec::new(),
        tetrahedra: Vec::new(),
        stiffnesses: Vec::new(),
        rest_lengths: Vec::new(),
        gravity: Vec3::new(0.0, -9.81, 0.0),
        gravity_at_rest: Vec3::new(0.0, -9.81, 0.0),
        damping_rate: 0.0,
    };
    for z in 0..nodes[2] {
        for y in 0..nodes[1] {
            for x in 0..nodes[0] {
                let index = [x, y, z];
                let centered =
                    DVec3::new(x as f64, y as f64, z as f64) - DVec3::from_array(CELLS.map(|c| c as f64 / 2.0));
                scene.positions.push((CELL * centered).as_vec3());
                let volume: f64 = (0..3).map(|axis| CELL * share(index[axis], axis)).product();
                scene.masses.push(if x == 0 { 0.0 } else { (DENSITY * volume) as f32 });
                for (step, length) in AXES_AND_DIAGONALS {
                    let Some(to) = neighbor(index, step, &nodes) else {
                        continue;
                    };
                    // Along the axes perpendicular to the spring, it belongs to the cells on both sides.
                    let across = (0..3).filter(|&axis| step[axis] == 0);
                    let shares: f64 = across.map(|axis| share(index[axis], axis)).product();
                    scene.springs.push([number(index), number(to)]);
                    scene.stiffnesses.push((0.4 * YOUNG * CELL * shares) as f32);
                    scene.rest_lengths.push((CELL * length) as f32);
                }
            }
        }
    }
    scene
}

/// Half of a node's lattice neighbors, and their distances in cells.
const AXES_AND_DIAGONALS: [([isize; 3], f64); 9] = [
    ([1, 0, 0], 1.0),
    ([0, 1, 0], 1.0),
    ([0, 0, 1], 1.0),
    ([1, 1, 0], std::f64::consts::SQRT_2),
    ([-1, 1, 0], std::f64::consts::SQRT_2),
    ([1, 0, 1], std::f64::consts::SQRT_2),
    ([-1, 0, 1], std::f64::consts::SQRT_2),
    ([0, 1, 1], std::f64::consts::SQRT_2),
    ([0, -1, 1], std::f64::consts::SQRT_2),
];

/// The lattice index offset by `step`, if it exists.
fn neighbor(index: [usize; 3], step: [isize; 3], nodes: &[usize; 3]) -> Option<[usize; 3]> {
    let mut to = index;
    for axis in 0..3 {
        to[axis] = index[axis]
            .checked_add_signed(step[axis])
            .filter(|&at| at < nodes[axis])?;
    }
    Some(to)
}

/// Centers the mesh at the origin, where `f32` is most accurate.
fn centered(mut mesh: Mesh) -> Mesh {
    let low = mesh.positions.iter().fold(Vec3::INFINITY, |low, p| low.min(*p));
    let high = mesh.positions.iter().fold(Vec3::NEG_INFINITY, |high, p| high.max(*p));
    for position in &mut mesh.positions {
        *position -= (low + high) / 2.0;
    }
    mesh
}
