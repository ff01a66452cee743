//! Fibers: they pull tetrahedra together along one direction when stretched and do nothing when compressed, as collagen
//! does.
//!
//! With the deformation gradient F of a tetrahedron, its rest volume V and the rest direction d, the energy is `V/2
//! k <|F d| - 1>²`, where `<>` is the positive part. It is the simplest of the fiber families of Holzapfel, Gasser and
//! Ogden (2000), linear in the fiber's stretch. `F d` is a weighted sum of the corners' positions, so a fiber is an
//! axial term.

use glam::{DMat3, DVec3};

use super::Term;
use super::axial_terms::AxialResponse;
use super::pieces::TermPieces;
use super::stencils::{PieceVisitor, Stencil, StencilLaw, Stencils, axial_matrix, lengthening, shares, weighted};
use crate::base::{Result, ensure, memory};
use crate::codec::saved;
use crate::def::{BodyDefinition, check_values, expect_count};
use crate::soa::NodeOrder;

/// The tolerance of the length of a unit direction.
const UNIT: f32 = 1e-3;

/// The law of fibers with rest length 1. Shapes are the weights of all corners but the first, 1/m.
#[derive(Debug)]
pub(super) struct Fibers;

saved! { Fibers }

pub(super) fn new(definition: &BodyDefinition, order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let (directions, stiffnesses) = (definition.fibre_directions, &definition.fibre_stiffnesses);
    let tetrahedra = definition.tetrahedra;
    if directions.is_empty() {
        check_values("fibre_stiffness", stiffnesses, 0)?;
        ensure!(
            stiffnesses.all_zero(),
            "fibre_stiffness is given while fibre_directions is not"
        );
        return Ok(None);
    }
    ensure!(
        !tetrahedra.is_empty(),
        "fibre_directions is given while the body has no tetrahedra: fibres lie in tetrahedra"
    );
    expect_count("fibre_directions", directions.len(), tetrahedra.len())?;
    check_values("fibre_stiffness", stiffnesses, tetrahedra.len())?;
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let mut fibers = memory::reserved(tetrahedra.len())?;
    for (index, (&corners, &direction)) in tetrahedra.iter().zip(directions).enumerate() {
        let length = direction.length();
        ensure!(
            length == 0.0 || (length - 1.0).abs() <= UNIT,
            "fibre_directions[{index}] is {direction}, {length} long: must be 1 long, or 0"
        );
        let stiffness = f64::from(stiffnesses.get(index));
        if length == 0.0 || stiffness == 0.0 {
            continue;
        }
        let [a, b, c, d] = corners.map(|corner| rest[corner as usize].as_dvec3());
        let edges = DMat3::from_cols(b - a, c - a, d - a);
        let volume = edges.determinant().abs() / 6.0;
        let weights = (edges.inverse() * direction.as_dvec3().normalize()).as_vec3();
        let stiffness = (stiffness * volume) as f32;
        ensure!(
            volume > 0.0 && weights.length_squared().is_finite() && stiffness.is_finite(),
            "tetrahedra[{index}] has a volume of {volume} m³ at rest: too little, or too much, for a fibre"
        );
        fibers.push(Stencil {
            nodes: corners.map(|corner| order.own(corner)),
            stiffness,
            shape: weights.to_array(),
        });
    }
    if fibers.is_empty() {
        return Ok(None);
    }
    Stencils::boxed(Fibers, fibers, rest.len())
}

/// The strain of a stretched fiber; 0 if it is compressed.
fn stretch(fiber: DVec3) -> f64 {
    (fiber.length() - 1.0).max(0.0)
}

/// The tangent matrix of a fiber; 0 if it is slack.
fn stiffness(fiber: DVec3) -> DMat3 {
    let length = fiber.length();
    if length <= 1.0 {
        return DMat3::ZERO;
    }
    axial_matrix(fiber / length, 1.0, 1.0 - 1.0 / length)
}

impl StencilLaw<4> for Fibers {
    const SAVED_AS: u8 = 6;

    type Shape = [f32; 3];

    fn energy(&self, weights: &[f32; 3], positions: &[DVec3; 4]) -> f64 {
        0.5 * stretch(weighted(weights, positions)).powi(2)
    }

    fn energy_change(&self, weights: &[f32; 3], positions: &[DVec3; 4], displacements: &[DVec3; 4]) -> f64 {
        let (fiber, change) = (weighted(weights, positions), weighted(weights, displacements));
        let then = fiber + change;
        let (before, after) = (stretch(fiber), stretch(then));
        let elongation = if before > 0.0 && after > 0.0 {
            lengthening(fiber, change)
        } else {
            after - before
        };
        0.5 * elongation * (before + after)
    }

    fn forces(&self, weights: &[f32; 3], positions: &[DVec3; 4]) -> [DVec3; 4] {
        let fiber = weighted(weights, positions);
        let stretch = stretch(fiber);
        if stretch == 0.0 {
            return [DVec3::ZERO; 4];
        }
        let pull = fiber * (-stretch / (1.0 + stretch));
        shares(weights).map(|share| pull * share)
    }

    fn blocks(&self, weights: &[f32; 3], positions: &[DVec3; 4], _is_exact: bool) -> [[DMat3; 4]; 4] {
        let (shares, stiffness) = (shares(weights), stiffness(weighted(weights, positions)));
        shares.map(|a| shares.map(|b| stiffness * (a * b)))
    }

    fn visit_pieces(&self, _weights: &[f32; 3], nodes: [u32; 4], pieces: &TermPieces, f: &mut PieceVisitor<4>) {
        pieces.cell_pieces(nodes).for_each(|piece| f(piece.nodes, piece.share));
    }

    fn scaled(&self, weights: &[f32; 3], length: f64) -> ([f32; 3], f64) {
        // It scales with its tetrahedron, whose volume is a factor of its stiffness.
        (
            weights.map(|weight| (f64::from(weight) / length) as f32),
            length.powi(3),
        )
    }

    fn is_finite(&self, weights: &[f32; 3]) -> bool {
        weights.iter().all(|weight| weight.is_finite())
    }

    fn size(&self, weights: &[f32; 3]) -> f32 {
        weights.iter().fold(0.0, |size, weight| size.max(weight.abs()))
    }

    const IS_AXIAL: bool = true;

    #[inline(always)]
    fn weights(&[a, b, c]: &[f32; 3]) -> [f32; 4] {
        [-(a + b + c), a, b, c]
    }

    #[inline(always)]
    fn response(&self, _parameters: [f32; 2], length: f32) -> AxialResponse {
        let elongation = length - 1.0;
        let slope = if elongation > 0.0 { 1.0 } else { 0.0 };
        let pull = slope * elongation;
        AxialResponse {
            pull,
            slope,
            transverse: pull,
            stiffening: 1.0,
        }
    }

    fn rate_bound(&self, weights: &[f32; 3], inverse_masses: [f64; 4]) -> f64 {
        let nodes = shares(weights).into_iter().zip(inverse_masses);
        nodes.map(|(share, inverse_mass)| share * share * inverse_mass).sum()
    }
}
