//! Fibres: what pulls tetrahedra together along one direction where they are longer than at rest along it, and does nothing where they
//! are shorter, as collagen does.
//!
//! With F the deformation of a tetrahedron, V its volume and d the direction, both at rest, the energy is `V/2 k <|F d| - 1>²`, with `<>`
//! what is above 0 (the simplest of the fibre families of Holzapfel, Gasser, Ogden 2000: linear in the fibre's stretch). `F d` is a
//! weighted sum of the corners' places, so a fibre is a string between such sums.

use glam::{DMat3, DVec3};

use super::Term;
use super::parting::Parting;
use super::stencils::{SeePart, Stencil, StencilLaw, Stencils, directed, lengthening, shares, weighted};
use super::strings::Tension;
use crate::base::{Result, ensure, memory};
use crate::codec::saved;
use crate::def::{BodyDefinition, check_values, expect_count};
use crate::soa::NodeOrder;

/// What the length of a direction may differ from 1 by.
const UNIT: f32 = 1e-3;

/// Strings of length 1 at rest; shapes are the weights of all corners but the first, 1/m.
#[derive(Debug)]
pub(super) struct Fibres;

saved! { Fibres }

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
    let mut fibres = memory::reserved(tetrahedra.len())?;
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
        fibres.push(Stencil {
            nodes: corners.map(|corner| order.own(corner)),
            stiffness,
            shape: weights.to_array(),
        });
    }
    if fibres.is_empty() {
        return Ok(None);
    }
    Stencils::boxed(Fibres, fibres, rest.len())
}

/// By how much a fibre is longer than at rest, as a part of its length there.
fn stretch(fibre: DVec3) -> f64 {
    (fibre.length() - 1.0).max(0.0)
}

/// What resists a change of a fibre, where it is taut.
fn stiffness(fibre: DVec3) -> DMat3 {
    let length = fibre.length();
    if length <= 1.0 {
        return DMat3::ZERO;
    }
    directed(fibre / length, 1.0, 1.0 - 1.0 / length)
}

impl StencilLaw<4> for Fibres {
    const SAVED_AS: u8 = 6;

    type Shape = [f32; 3];

    fn energy(&self, weights: &[f32; 3], places: &[DVec3; 4]) -> f64 {
        0.5 * stretch(weighted(weights, places)).powi(2)
    }

    fn change(&self, weights: &[f32; 3], places: &[DVec3; 4], ways: &[DVec3; 4]) -> f64 {
        let (fibre, more) = (weighted(weights, places), weighted(weights, ways));
        let then = fibre + more;
        let (before, after) = (stretch(fibre), stretch(then));
        let longer = if before > 0.0 && after > 0.0 {
            lengthening(fibre, more)
        } else {
            after - before
        };
        0.5 * longer * (before + after)
    }

    fn forces(&self, weights: &[f32; 3], places: &[DVec3; 4]) -> [DVec3; 4] {
        let fibre = weighted(weights, places);
        let stretch = stretch(fibre);
        if stretch == 0.0 {
            return [DVec3::ZERO; 4];
        }
        let pull = fibre * (-stretch / (1.0 + stretch));
        shares(weights).map(|share| pull * share)
    }

    fn blocks(&self, weights: &[f32; 3], places: &[DVec3; 4], _is_exact: bool) -> [[DMat3; 4]; 4] {
        let (shares, stiffness) = (shares(weights), stiffness(weighted(weights, places)));
        shares.map(|a| shares.map(|b| stiffness * (a * b)))
    }

    fn show_parts(&self, _weights: &[f32; 3], nodes: [u32; 4], parting: &Parting, see: &mut SeePart<4>) {
        parting.of_cell(nodes).for_each(|part| see(part.nodes, part.part));
    }

    fn scaled(&self, weights: &[f32; 3], length: f64) -> ([f32; 3], f64) {
        // As long at rest as its tetrahedron, whose volume is part of its stiffness.
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

    const IS_STRING: bool = true;

    #[inline(always)]
    fn weights(&[a, b, c]: &[f32; 3]) -> [f32; 4] {
        [-(a + b + c), a, b, c]
    }

    #[inline(always)]
    fn tension(&self, _numbers: [f32; 2], length: f32) -> Tension {
        let longer = length - 1.0;
        let slope = if longer > 0.0 { 1.0 } else { 0.0 };
        let pull = slope * longer;
        Tension {
            pull,
            slope,
            sideways: pull,
            stiffening: 1.0,
        }
    }

    fn rate(&self, weights: &[f32; 3], inverse_masses: [f64; 4]) -> f64 {
        let nodes = shares(weights).into_iter().zip(inverse_masses);
        nodes.map(|(share, inverse_mass)| share * share * inverse_mass).sum()
    }
}
