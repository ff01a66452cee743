//! Anchor springs: they pull each node to its rest position, the paper's restoring forces (Halic et al., section 3).

use glam::{DMat3, DVec3, Vec3};

use super::Term;
use super::pieces::TermPieces;
use super::stencils::{PieceVisitor, Stencil, StencilLaw, Stencils};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::def::{BodyDefinition, check_values};
use crate::soa::NodeOrder;

/// The law of springs with rest length 0 to a fixed point.
#[derive(Debug)]
pub(super) struct AnchorSprings;

saved! { AnchorSprings }

#[derive(Clone, Copy, Debug)]
pub(super) struct AnchorShape {
    /// The rest position in the caller's coordinates, m.
    rest: Vec3,
    /// The rest position in the body's coordinates, m.
    local: Vec3,
}

saved! { AnchorShape { rest, local } }

pub(super) fn new(definition: &BodyDefinition, order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let (stiffnesses, node_count) = (&definition.home_stiffnesses, definition.positions.len());
    check_values("home_stiffness", stiffnesses, node_count)?;
    if stiffnesses.all_zero() {
        return Ok(None);
    }
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let mut springs = memory::reserved(node_count)?;
    let active = rest.iter().enumerate().filter(|(node, _)| stiffnesses.get(*node) > 0.0);
    springs.extend(active.map(|(node, &rest)| Stencil {
        nodes: [order.own(node as u32)],
        stiffness: stiffnesses.get(node),
        shape: AnchorShape { rest, local: rest },
    }));
    Stencils::boxed(AnchorSprings, springs, node_count)
}

impl StencilLaw<1> for AnchorSprings {
    const SAVED_AS: u8 = 0;

    type Shape = AnchorShape;

    fn energy(&self, shape: &AnchorShape, [position]: &[DVec3; 1]) -> f64 {
        0.5 * position.distance_squared(shape.local.as_dvec3())
    }

    fn energy_change(&self, shape: &AnchorShape, [position]: &[DVec3; 1], [displacement]: &[DVec3; 1]) -> f64 {
        displacement.dot(*position - shape.local.as_dvec3()) + 0.5 * displacement.length_squared()
    }

    fn forces(&self, shape: &AnchorShape, [position]: &[DVec3; 1]) -> [DVec3; 1] {
        [shape.local.as_dvec3() - *position]
    }

    fn force_changes(&self, _shape: &AnchorShape, _positions: &[DVec3; 1], [displacement]: &[DVec3; 1]) -> [DVec3; 1] {
        [-*displacement]
    }

    fn blocks(&self, _shape: &AnchorShape, _positions: &[DVec3; 1], _is_exact: bool) -> [[DMat3; 1]; 1] {
        [[DMat3::IDENTITY]]
    }

    fn rate_bound(&self, _shape: &AnchorShape, [inverse_mass]: [f64; 1]) -> f64 {
        inverse_mass
    }

    fn visit_pieces(&self, _shape: &AnchorShape, [node]: [u32; 1], pieces: &TermPieces, f: &mut PieceVisitor<1>) {
        pieces.node_pieces(node).for_each(|piece| f(piece.nodes, piece.share));
    }

    fn move_origin(&self, shape: &mut AnchorShape, origin: DVec3) {
        shape.local = (shape.rest.as_dvec3() - origin).as_vec3();
    }
}
