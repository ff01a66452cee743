//! Bending: hinges, which are two triangles with a common edge, resist rotation about it.
//!
//! An *arm* of a hinge is the vector from the edge to the opposite corner, divided by the rest height. It starts at the
//! foot of that corner at rest. The arms are `T` and `T'`. While the triangles keep their shape, they have unit length
//! and are perpendicular to the edge `e`. Then `|T + T'| = 2 sin(phi/2)` and `|T - T'| = 2 cos(phi/2)` with the bending
//! angle phi. The vector
//!
//! `G = cos(phi0/2) (T + T') - sin(phi0/2) e/|e0| x (T - T')`
//!
//! has the length `2 |sin((phi - phi0)/2)|`. The energy of a hinge is `k/2 |G|²`. For a flat rest shape it is the
//! quadratic energy of isometric bending (Bergou, Wardetzky, Harmon, Zorin, Grinspun 2006). For a curved one it is a
//! polynomial, as in cubic shells (Garg, Grinspun, Wardetzky, Zorin 2007), but never negative. `G` rotates with the
//! body and is 0 at rest, so momentum is conserved and the rest shape is in equilibrium. No divisor can become 0, so
//! forces are finite even if a triangle degenerates.
//!
//! With `k = D |e0|² / (A + A')` equilateral triangles have the flexural rigidity D in every direction, and Poisson's
//! ratio -1/3 (Seung, Nelson 1988). No sum over hinges has both properties on every mesh. In squares with alternating
//! diagonals every other node yields, which leaves 5/6 of D along a side.

use glam::{DMat3, DVec3};

use super::Term;
use super::pieces::TermPieces;
use super::stencils::{PieceVisitor, Stencil, StencilLaw, Stencils};
use crate::base::{Error, Result, cross_matrix, ensure, memory, not_negative};
use crate::codec::saved;
use crate::def::BodyDefinition;
use crate::soa::NodeOrder;

/// The law of hinges. Nodes are the two of the edge, then the opposite ones.
#[derive(Debug)]
pub(super) struct Hinges;

saved! { Hinges }

/// The rest shape of a hinge.
#[derive(Clone, Copy, Debug)]
pub(super) struct HingeShape {
    /// The positions of the arms' feet on the edge; 0 is its first node, 1 its second.
    feet: [f32; 2],
    /// The inverse rest heights, 1/m.
    inverse_heights: [f32; 2],
    /// The cosine of half the rest angle.
    cosine: f32,
    /// The sine of half the rest angle divided by the rest length of the edge, 1/m. 0: flat.
    sine: f32,
}

saved! { HingeShape { feet, inverse_heights, cosine, sine } }

pub(super) fn new(definition: &BodyDefinition, order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let rigidity = definition.bending_stiffness;
    not_negative("bending_stiffness", rigidity)?;
    if rigidity == 0.0 {
        return Ok(None);
    }
    ensure!(
        !definition.triangles.is_empty(),
        "bending_stiffness is {rigidity} while the body has no triangles: there is no surface to bend"
    );
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let at = |node: u32| rest[node as usize].as_dvec3();
    let mut hinges = memory::reserved(definition.triangles.len() * 3 / 2)?;
    let sides = sides(definition.triangles)?;
    for edge_sides in sides.chunk_by(|a, b| a.edge == b.edge) {
        let &[a, b] = edge_sides else {
            if let [_] = edge_sides {
                continue;
            }
            return Err(Error::invalid(format!(
                "{} triangles share the edge of nodes {:?}: bending_stiffness needs one or two at each edge",
                edge_sides.len(),
                edge_sides[0].edge
            )));
        };
        let nodes = [a.edge[0], a.edge[1], a.opposite, b.opposite];
        ensure!(
            a.opposite != b.opposite,
            "triangles[{}] and triangles[{}] have the same corners: bending_stiffness needs each once",
            a.triangle,
            b.triangle
        );
        let reach = nodes.map(|node| rest[node as usize].abs().max_element());
        let reach = reach.into_iter().fold(0.0, f32::max);
        let Some((shape, stiffness)) = HingeShape::new(nodes.map(at), f64::from(reach)) else {
            return Err(Error::invalid(format!(
                "triangles[{}] or triangles[{}] has no area at rest: too little for bending_stiffness",
                a.triangle, b.triangle
            )));
        };
        let stiffness = (stiffness * f64::from(rigidity)) as f32;
        not_negative("the stiffness of a hinge by bending_stiffness", stiffness)?;
        hinges.push(Stencil {
            nodes: nodes.map(|node| order.own(node)),
            stiffness,
            shape,
        });
    }
    Stencils::boxed(Hinges, hinges, rest.len())
}

/// A side of a triangle.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct TriangleSide {
    edge: [u32; 2],
    opposite: u32,
    triangle: u32,
}

/// The sides of all triangles, sorted by edge.
fn sides(triangles: &[[u32; 3]]) -> Result<Vec<TriangleSide>> {
    let mut sides = memory::reserved(3 * triangles.len())?;
    for (triangle, &[a, b, c]) in (0..).zip(triangles) {
        sides.extend([[a, b, c], [b, c, a], [c, a, b]].map(|[a, b, opposite]| TriangleSide {
            edge: [a.min(b), a.max(b)],
            opposite,
            triangle,
        }));
    }
    sides.sort_unstable();
    Ok(sides)
}

impl HingeShape {
    /// The rest shape of a hinge with these corners and coordinates up to `reach`, and its stiffness per flexural
    /// rigidity. `None`: a triangle has no area.
    fn new(corners: [DVec3; 4], reach: f64) -> Option<(Self, f64)> {
        let [start, end, opposite @ ..] = corners;
        let edge = end - start;
        let square = edge.length_squared();
        let feet = opposite.map(|corner| (corner - start).dot(edge) / square);
        let arms = [0, 1].map(|arm| opposite[arm] - start - edge * feet[arm]);
        let heights = arms.map(DVec3::length);
        let [first, second] = [0, 1].map(|arm| arms[arm] / heights[arm]);
        let (sine, cosine) = (0.5 * (first + second).length(), 0.5 * (first - second).length());
        // The angle that rounded coordinates give a flat hinge.
        let rounding = 4.0 * f64::from(f32::EPSILON) * (1.0 + reach / heights[0].min(heights[1]));
        let side = (first + second).dot(edge.cross(first - second)).signum();
        let is_flat = sine <= rounding;
        let shape = Self {
            feet: feet.map(|foot| foot as f32),
            inverse_heights: heights.map(|height| (1.0 / height) as f32),
            cosine: if is_flat { 1.0 } else { cosine as f32 },
            sine: if is_flat {
                0.0
            } else {
                (side * sine / edge.length()) as f32
            },
        };
        let areas = 0.5 * edge.length() * (heights[0] + heights[1]);
        let numbers = [shape.feet, shape.inverse_heights, [shape.cosine, shape.sine]];
        let is_valid = numbers.as_flattened().iter().all(|number| number.is_finite());
        (is_valid && areas > 0.0).then_some((shape, square / areas))
    }

    /// The arms; linear, so also their changes for displacements.
    #[inline(always)]
    fn arms(&self, [start, end, first, second]: &[DVec3; 4]) -> [DVec3; 2] {
        let edge = *end - *start;
        let arm = |corner: DVec3, arm: usize| {
            (corner - *start - edge * f64::from(self.feet[arm])) * f64::from(self.inverse_heights[arm])
        };
        [arm(*first, 0), arm(*second, 1)]
    }

    #[inline(always)]
    fn state(&self, positions: &[DVec3; 4]) -> HingeState {
        let [first, second] = self.arms(positions);
        let (edge, across) = (positions[1] - positions[0], first - second);
        let mut turn = (first + second) * f64::from(self.cosine);
        if self.sine != 0.0 {
            turn -= edge.cross(across) * f64::from(self.sine);
        }
        HingeState { edge, across, turn }
    }

    /// The weight of each node in each arm.
    fn shares(&self) -> [[f64; 4]; 2] {
        [0, 1].map(|arm| {
            let foot = f64::from(self.feet[arm]);
            let mut shares = [foot - 1.0, -foot, 0.0, 0.0];
            shares[2 + arm] = 1.0;
            shares.map(|share| share * f64::from(self.inverse_heights[arm]))
        })
    }
}

/// The current state of a hinge.
struct HingeState {
    /// The edge, m.
    edge: DVec3,
    /// The difference of the arms, `T - T'`.
    across: DVec3,
    /// The bending vector `G`.
    turn: DVec3,
}

impl HingeState {
    /// The first-order and second-order changes of G for these displacements.
    #[inline(always)]
    fn turn_changes(&self, shape: &HingeShape, displacements: &[DVec3; 4]) -> [DVec3; 2] {
        let [first, second] = shape.arms(displacements);
        let change = (first + second) * f64::from(shape.cosine);
        if shape.sine == 0.0 {
            return [change, DVec3::ZERO];
        }
        let (sine, edge, across) = (
            f64::from(shape.sine),
            displacements[1] - displacements[0],
            first - second,
        );
        [
            change - (edge.cross(self.across) + self.edge.cross(across)) * sine,
            edge.cross(across) * -sine,
        ]
    }

    /// The transpose of the derivative of G, applied to a vector: one vector per node.
    #[inline(always)]
    fn distribute(&self, shape: &HingeShape, weight: DVec3) -> [DVec3; 4] {
        let along = weight * f64::from(shape.cosine);
        let (mut transverse, mut of_edge) = (DVec3::ZERO, DVec3::ZERO);
        if shape.sine != 0.0 {
            transverse = weight.cross(self.edge) * f64::from(shape.sine);
            of_edge = self.across.cross(weight) * f64::from(-shape.sine);
        }
        let first = (along - transverse) * f64::from(shape.inverse_heights[0]);
        let second = (along + transverse) * f64::from(shape.inverse_heights[1]);
        let end = of_edge - first * f64::from(shape.feet[0]) - second * f64::from(shape.feet[1]);
        [-(first + second + end), end, first, second]
    }
}

/// The weights of the nodes in the edge.
const EDGE: [f64; 4] = [-1.0, 1.0, 0.0, 0.0];

impl StencilLaw<4> for Hinges {
    const SAVED_AS: u8 = 4;

    type Shape = HingeShape;

    fn energy(&self, shape: &HingeShape, positions: &[DVec3; 4]) -> f64 {
        0.5 * shape.state(positions).turn.length_squared()
    }

    /// Pieces of both triangles with a common edge are hinges, with stiffness proportional to their area.
    fn visit_pieces(&self, shape: &HingeShape, [a, b, c, d]: [u32; 4], pieces: &TermPieces, f: &mut PieceVisitor<4>) {
        let areas = shape.inverse_heights.map(|inverse| 1.0 / f64::from(inverse));
        let visit_all = |f: &mut PieceVisitor<4>| {
            for first in pieces.cell_pieces([a, b, c]) {
                for second in pieces.cell_pieces([a, b, d]) {
                    let ([a, b, c], [other_a, other_b, d]) = (first.nodes, second.nodes);
                    if [a, b] == [other_a, other_b] {
                        let share = (areas[0] * first.share + areas[1] * second.share) / (areas[0] + areas[1]);
                        f([a, b, c, d], share);
                    }
                }
            }
        };
        // Several pieces may share the edge of one piece. The shares are normalized if their sum exceeds 1.
        let mut sum = 0.0_f64;
        visit_all(&mut |_, share| sum += share);
        visit_all(&mut |nodes, share| f(nodes, share / sum.max(1.0)));
    }

    fn energy_change(&self, shape: &HingeShape, positions: &[DVec3; 4], displacements: &[DVec3; 4]) -> f64 {
        let state = shape.state(positions);
        let [first, second] = state.turn_changes(shape, displacements);
        let change = first + second;
        change.dot(state.turn + change * 0.5)
    }

    #[inline(always)]
    fn forces(&self, shape: &HingeShape, positions: &[DVec3; 4]) -> [DVec3; 4] {
        let state = shape.state(positions);
        state.distribute(shape, -state.turn)
    }

    #[inline(always)]
    fn force_changes(&self, shape: &HingeShape, positions: &[DVec3; 4], displacements: &[DVec3; 4]) -> [DVec3; 4] {
        let state = shape.state(positions);
        let [change, _] = state.turn_changes(shape, displacements);
        state.distribute(shape, -change)
    }

    fn blocks(&self, shape: &HingeShape, positions: &[DVec3; 4], is_exact: bool) -> [[DMat3; 4]; 4] {
        let state = shape.state(positions);
        let (cosine, sine) = (f64::from(shape.cosine), f64::from(shape.sine));
        let [first, second] = shape.shares();
        let [edge, across, turn] = [state.edge, state.across, state.turn].map(cross_matrix);
        let difference = [0, 1, 2, 3].map(|node| first[node] - second[node]);
        let rates = [0, 1, 2, 3].map(|node| {
            DMat3::from_diagonal(DVec3::splat(cosine * (first[node] + second[node]))) + across * (sine * EDGE[node])
                - edge * (sine * difference[node])
        });
        [0, 1, 2, 3].map(|a| {
            [0, 1, 2, 3].map(|b| {
                let block = rates[a].transpose() * rates[b];
                if is_exact {
                    block + turn * (sine * (EDGE[a] * difference[b] - EDGE[b] * difference[a]))
                } else {
                    block
                }
            })
        })
    }

    /// For arms of at most unit length and an edge of at most its rest length, `|dG|` is at most the sum of these
    /// bounds times the displacements.
    fn rate_bound(&self, shape: &HingeShape, inverse_masses: [f64; 4]) -> f64 {
        let [first, second] = shape.shares();
        let (cosine, sine) = (f64::from(shape.cosine), f64::from(shape.sine).abs());
        let bound = |node: usize| {
            if sine == 0.0 {
                return first[node] + second[node];
            }
            let both = (1.0 - cosine * cosine).max(0.0).sqrt() + cosine;
            both * (first[node].abs() + second[node].abs()) + 2.0 * sine * EDGE[node].abs()
        };
        let nodes = inverse_masses.iter().enumerate();
        nodes
            .map(|(node, inverse_mass)| bound(node).powi(2) * inverse_mass)
            .sum()
    }

    /// Longer arms and edges raise that bound. With its arm part x and edge part y, G adds `|G| x y <= |G| (x + y)²/4`.
    #[inline(always)]
    fn stiffening(&self, shape: &HingeShape, positions: &[DVec3; 4]) -> f64 {
        if shape.sine == 0.0 {
            return 1.0;
        }
        let state = shape.state(positions);
        let (cosine, sine) = (f64::from(shape.cosine), f64::from(shape.sine));
        // Squared sine times edge length, relative to its value at rest.
        let edge = state.edge.length_squared() * sine * sine / (1.0 - cosine * cosine).max(f64::from(f32::EPSILON));
        let longest = edge.max(0.25 * state.across.length_squared()).max(1.0);
        longest + 0.25 * state.turn.length()
    }

    fn scaled(&self, shape: &HingeShape, length: f64) -> (HingeShape, f64) {
        let over = |number: f32| (f64::from(number) / length) as f32;
        let scaled = HingeShape {
            inverse_heights: shape.inverse_heights.map(over),
            sine: over(shape.sine),
            ..*shape
        };
        (scaled, 1.0)
    }

    fn is_finite(&self, shape: &HingeShape) -> bool {
        let [first, second] = shape.inverse_heights;
        first.is_finite() && second.is_finite() && shape.sine.is_finite()
    }

    fn size(&self, shape: &HingeShape) -> f32 {
        shape.inverse_heights[0]
    }

    fn is_edge(&self, a: usize, b: usize) -> bool {
        a < 2 || b < 2
    }
}
