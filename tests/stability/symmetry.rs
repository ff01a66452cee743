//! The same body rotated, mirrored, reordered, or far away: the same motion.

use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Values};

use super::ratios::{damp, hold_side};
use super::setup::{Outcome, Setup, at_most};
use super::watched::Watched;
use crate::support::bodies::{Parts, Random, largest_difference};

const DOWN: Vec3 = Vec3::new(0.0, -9.81, 0.0);

/// The allowed difference of equal motions, relative to the size of a body (rigid motion, in the table of accuracy).
const SAME: f64 = 1e-6;

/// The rounding error over many substeps: a random walk of both bodies' positions. Each step has 0.29 of the last place
/// of a quarter of a meter; the bound is four standard deviations.
fn rounding(substeps: f64, size: f64) -> f64 {
    4.0 * 2.0_f64.sqrt() * 0.29 * 2.0_f64.powi(-26) * substeps.sqrt() / size
}

fn hanging_block() -> Parts {
    let mut parts = Parts::block([3, 2, 2], 0.0625, 0.01, 60.0);
    hold_side(&mut parts);
    damp(&mut parts, 4.0);
    parts
}

pub fn rotated(setup: &Setup) -> Outcome {
    let parts = hanging_block();
    let (mut worst, mut same) = (0.0_f64, SAME);
    for degrees in [10.0_f32, 90.0, 180.0] {
        let turn = Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), degrees.to_radians());
        let turned = parts.moved(turn, Vec3::ZERO);
        let mut upright = Watched::new(setup, &parts, DOWN)?;
        let definition = BodyDefinition {
            rest_positions: Some(&parts.positions),
            ..turned.definition()
        };
        let mut turned = Watched::of(setup, &definition, turn * DOWN)?;
        let mut substeps = 0.0;
        for _ in 0..setup.steps(1.0, 5, setup.pick(100, 1000)) {
            substeps += f64::from(upright.step(setup.step)?.substeps);
            turned.step(setup.step)?;
            let expected: Vec<DVec3> = upright.state().positions.iter().map(|p| turn.as_dquat() * *p).collect();
            let error = largest_difference(&turned.state().positions, &expected) / parts.size();
            worst = worst.max(error);
        }
        same = same.max(rounding(substeps, parts.size()));
    }
    at_most("difference over the size", worst, same)?;
    Ok(format!("differs by {worst:.1e}"))
}

fn tetrahedra(mesh: &Mesh) -> BodyDefinition<'_> {
    BodyDefinition {
        masses: Values::Uniform(0.001),
        node_dampings: Values::Uniform(0.004),
        stiffnesses: Values::Uniform(40.0),
        ..BodyDefinition::of(mesh)
    }
}

/// Reorders the tetrahedra, and the corners of each.
pub fn reordered(setup: &Setup) -> Outcome {
    let mesh = Mesh::block([0.15; 3], [3; 3]).expect("a block");
    let mut other = mesh.clone();
    let mut random = Random::new(31);
    for i in (1..other.tetrahedra.len()).rev() {
        other.tetrahedra.swap(i, random.below(i + 1));
    }
    for tetrahedron in &mut other.tetrahedra {
        // Even permutations: the volume keeps its sign.
        tetrahedron[1..].rotate_left(random.below(3));
        if random.below(2) == 0 {
            tetrahedron.swap(0, 1);
            tetrahedron.swap(2, 3);
        }
    }
    compare(setup, &mesh, &other, |p| p)
}

/// Mirroring inverts every tetrahedron; springs do not depend on orientation.
pub fn mirrored(setup: &Setup) -> Outcome {
    let mesh = Mesh::block([0.15; 3], [3; 3]).expect("a block");
    compare(setup, &mesh, &mesh, |p| p * DVec3::new(-1.0, 1.0, 1.0))
}

/// Compares two bodies whose motions are images of each other.
fn compare(setup: &Setup, mesh: &Mesh, other: &Mesh, image: fn(DVec3) -> DVec3) -> Outcome {
    let size = 0.15;
    let mut one = Watched::of(setup, &tetrahedra(mesh), Vec3::ZERO)?;
    let mut two = Watched::of(setup, &tetrahedra(other), Vec3::ZERO)?;
    let bent: Vec<Vec3> = mesh
        .positions
        .iter()
        .map(|p| *p * (Vec3::ONE + 2.0 * Vec3::new(p.y, p.z, p.x)))
        .collect();
    let images: Vec<Vec3> = bent.iter().map(|p| image(p.as_dvec3()).as_vec3()).collect();
    one.change(|body| body.set_positions(&bent));
    two.change(|body| body.set_positions(&images));
    let (first, same) = (one.state().energy(), two.state().energy());
    at_most(
        "difference of the energies over one of them",
        (first - same).abs() / first,
        1e-12,
    )?;
    let mut worst = 0.0_f64;
    for _ in 0..setup.steps(1.0, 5, setup.pick(100, 1000)) {
        one.step(setup.step)?;
        two.step(setup.step)?;
        let expected: Vec<DVec3> = one.state().positions.into_iter().map(image).collect();
        worst = worst.max(largest_difference(&two.state().positions, &expected) / size);
    }
    at_most("difference over the size", worst, SAME)?;
    Ok(format!("differs by {worst:.1e}; {}", one.figures()))
}

pub fn far_from_the_origin(setup: &Setup) -> Outcome {
    let parts = hanging_block();
    let offset = Vec3::new(10_000.0, -10_000.0, 10_000.0);
    let far = parts.moved(Quat::IDENTITY, offset);
    let mut near = Watched::new(setup, &parts, DOWN)?;
    // Positions are returned with millimeter rounding: too coarse for a ledger.
    let mut far = Watched::new(setup, &far, DOWN)?.without_ledger();
    let rounding = 0.5 * f64::from(offset.x.next_up() - offset.x) * 3.0_f64.sqrt();
    let (mut worst, mut fastest) = (0.0_f64, 0.0_f64);
    for _ in 0..setup.steps(1.0, 5, setup.pick(100, 1000)) {
        near.step(setup.step)?;
        far.step(setup.step)?;
        let (near, far) = (near.state(), far.state());
        let expected: Vec<DVec3> = near.positions.iter().map(|p| *p + offset.as_dvec3()).collect();
        let error = largest_difference(&far.positions, &expected);
        at_most("difference of positions, m", error, rounding + SAME * parts.size())?;
        // Velocities are not rounded on output.
        worst = worst.max(largest_difference(&far.velocities, &near.velocities));
        fastest = near.velocities.iter().map(|v| v.length()).fold(fastest, f64::max);
    }
    at_most("difference of velocities over the highest", worst / fastest, 1e-5)?;
    Ok(format!("velocities differ by {:.1e} of the highest", worst / fastest))
}
