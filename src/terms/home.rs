//! Home springs: the paper's restoring forces, which draw each node back to where it is at rest (Halic et al., section 3).

use glam::{DMat3, DVec3, Vec3};

use super::Term;
use super::parting::Parting;
use super::stencils::{SeePart, Stencil, StencilLaw, Stencils};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::def::{BodyDefinition, check_values};
use crate::soa::NodeOrder;

/// Springs of no rest length to a point that stays.
#[derive(Debug)]
pub(super) struct Home;

saved! { Home }

#[derive(Clone, Copy, Debug)]
pub(super) struct HomeShape {
    /// In the caller's coordinates, m.
    rest: Vec3,
    /// In the body's.
    local: Vec3,
}

saved! { HomeShape { rest, local } }

pub(super) fn new(definition: &BodyDefinition, order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let (stiffnesses, node_count) = (&definition.home_stiffnesses, definition.positions.len());
    check_values("home_stiffness", stiffnesses, node_count)?;
    if stiffnesses.all_zero() {
        return Ok(None);
    }
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let mut springs = memory::reserved(node_count)?;
    let there = rest.iter().enumerate().filter(|(node, _)| stiffnesses.get(*node) > 0.0);
    springs.extend(there.map(|(node, &rest)| Stencil {
        nodes: [order.own(node as u32)],
        stiffness: stiffnesses.get(node),
        shape: HomeShape { rest, local: rest },
    }));
    Stencils::boxed(Home, springs, node_count)
}

impl StencilLaw<1> for Home {
    const SAVED_AS: u8 = 0;

    type Shape = HomeShape;

    fn energy(&self, shape: &HomeShape, [place]: &[DVec3; 1]) -> f64 {
        0.5 * place.distance_squared(shape.local.as_dvec3())
    }

    fn change(&self, shape: &HomeShape, [place]: &[DVec3; 1], [way]: &[DVec3; 1]) -> f64 {
        way.dot(*place - shape.local.as_dvec3()) + 0.5 * way.length_squared()
    }

    fn forces(&self, shape: &HomeShape, [place]: &[DVec3; 1]) -> [DVec3; 1] {
        [shape.local.as_dvec3() - *place]
    }

    fn changes(&self, _shape: &HomeShape, _places: &[DVec3; 1], [way]: &[DVec3; 1]) -> [DVec3; 1] {
        [-*way]
    }

    fn blocks(&self, _shape: &HomeShape, _places: &[DVec3; 1], _is_exact: bool) -> [[DMat3; 1]; 1] {
        [[DMat3::IDENTITY]]
    }

    fn rate(&self, _shape: &HomeShape, [inverse_mass]: [f64; 1]) -> f64 {
        inverse_mass
    }

    fn show_parts(&self, _shape: &HomeShape, [node]: [u32; 1], parting: &Parting, see: &mut SeePart<1>) {
        parting.of_node(node).for_each(|part| see(part.nodes, part.part));
    }

    fn move_origin(&self, shape: &mut HomeShape, origin: DVec3) {
        shape.local = (shape.rest.as_dvec3() - origin).as_vec3();
    }
}
