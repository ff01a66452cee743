//! Bending: hinges of two triangles that share an edge, which resist turning about it.
//!
//! An *arm* of a hinge is the way from the edge to the corner opposite, from where its foot is at rest, over its height at rest: `T` and
//! `T'`, of length 1 and at right angles to the edge `e` as long as the triangles keep their shape. Then `|T + T'| = 2 sin(phi/2)` and
//! `|T - T'| = 2 cos(phi/2)`, with phi the angle by which the surface turns at the edge, both along one line, and of
//!
//! `G = cos(phi0/2) (T + T') - sin(phi0/2) e/|e0| x (T - T')`
//!
//! the length is `2 |sin((phi - phi0)/2)|`. The energy of a hinge is `k/2 |G|²`. For a flat rest shape it is the quadratic one of
//! isometric bending (Bergou, Wardetzky, Harmon, Zorin, Grinspun 2006); for a curved one a polynomial too, as in cubic shells (Garg,
//! Grinspun, Wardetzky, Zorin 2007), but one that is nowhere below 0. `G` turns with the body and is 0 at rest, so momentum is kept and
//! the rest shape is at rest; nothing is divided by what may become 0, so whatever becomes of a triangle, forces are finite.
//!
//! With `k = D |e0|² / (A + A')` the flexural rigidity is D, whichever way it is bent, where triangles are equilateral, and Poisson's
//! ratio is -1/3 (Seung, Nelson 1988). A sum over hinges cannot have both on every mesh: of squares that are cut alternately every other
//! node gives way, which leaves 5/6 of D along a side.

use glam::{DMat3, DVec3};

use super::Term;
use super::parting::Parting;
use super::stencils::{SeePart, Stencil, StencilLaw, Stencils};
use crate::base::{Error, Result, cross_matrix, ensure, memory, not_negative};
use crate::codec::saved;
use crate::def::BodyDefinition;
use crate::soa::NodeOrder;

/// Hinges: the two nodes of the edge, then those opposite.
#[derive(Debug)]
pub(super) struct Hinges;

saved! { Hinges }

/// A hinge at rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct HingeShape {
    /// Where the feet of the arms lie on the edge, 0: at its first node, 1: at its second.
    feet: [f32; 2],
    /// 1/m
    inverse_heights: [f32; 2],
    /// Of half the angle.
    cosine: f32,
    /// That of half the angle, over the length of the edge, 1/m; 0: flat.
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
    for joined in sides.chunk_by(|a, b| a.edge == b.edge) {
        let &[a, b] = joined else {
            if let [_] = joined {
                continue;
            }
            return Err(Error::invalid(format!(
                "{} triangles share the edge of nodes {:?}: bending_stiffness needs one or two at each edge",
                joined.len(),
                joined[0].edge
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
        let Some((shape, stiffness)) = HingeShape::of(nodes.map(at), f64::from(reach)) else {
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

/// The sides of all triangles, those of one edge in a row.
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
    /// Of a hinge whose corners are here at rest, with coordinates up to `reach`, and its stiffness over the flexural rigidity;
    /// `None`: a triangle has no area.
    fn of(corners: [DVec3; 4], reach: f64) -> Option<(Self, f64)> {
        let [start, end, opposite @ ..] = corners;
        let edge = end - start;
        let square = edge.length_squared();
        let feet = opposite.map(|corner| (corner - start).dot(edge) / square);
        let arms = [0, 1].map(|arm| opposite[arm] - start - edge * feet[arm]);
        let heights = arms.map(DVec3::length);
        let [first, second] = [0, 1].map(|arm| arms[arm] / heights[arm]);
        let (sine, cosine) = (0.5 * (first + second).length(), 0.5 * (first - second).length());
        // What rounded coordinates make of a flat hinge.
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
        let is_fine = numbers.as_flattened().iter().all(|number| number.is_finite());
        (is_fine && areas > 0.0).then_some((shape, square / areas))
    }

    /// The arms, or how they change where nodes go these ways.
    #[inline(always)]
    fn arms(&self, [start, end, first, second]: &[DVec3; 4]) -> [DVec3; 2] {
        let edge = *end - *start;
        let arm = |corner: DVec3, arm: usize| {
            (corner - *start - edge * f64::from(self.feet[arm])) * f64::from(self.inverse_heights[arm])
        };
        [arm(*first, 0), arm(*second, 1)]
    }

    #[inline(always)]
    fn bent(&self, places: &[DVec3; 4]) -> Bent {
        let [first, second] = self.arms(places);
        let (edge, across) = (places[1] - places[0], first - second);
        let mut turn = (first + second) * f64::from(self.cosine);
        if self.sine != 0.0 {
            turn -= edge.cross(across) * f64::from(self.sine);
        }
        Bent { edge, across, turn }
    }

    /// What share each place has in each arm.
    fn shares(&self) -> [[f64; 4]; 2] {
        [0, 1].map(|arm| {
            let foot = f64::from(self.feet[arm]);
            let mut shares = [foot - 1.0, -foot, 0.0, 0.0];
            shares[2 + arm] = 1.0;
            shares.map(|share| share * f64::from(self.inverse_heights[arm]))
        })
    }
}

/// A hinge as it is.
struct Bent {
    /// m
    edge: DVec3,
    /// `T - T'`.
    across: DVec3,
    /// `G`.
    turn: DVec3,
}

impl Bent {
    /// How G changes where nodes go these ways: in the first order, and what there is of the second.
    #[inline(always)]
    fn changes(&self, shape: &HingeShape, ways: &[DVec3; 4]) -> [DVec3; 2] {
        let [first, second] = shape.arms(ways);
        let change = (first + second) * f64::from(shape.cosine);
        if shape.sine == 0.0 {
            return [change, DVec3::ZERO];
        }
        let (sine, edge, across) = (f64::from(shape.sine), ways[1] - ways[0], first - second);
        [
            change - (edge.cross(self.across) + self.edge.cross(across)) * sine,
            edge.cross(across) * -sine,
        ]
    }

    /// What a weight on G is on each node.
    #[inline(always)]
    fn spread(&self, shape: &HingeShape, weight: DVec3) -> [DVec3; 4] {
        let along = weight * f64::from(shape.cosine);
        let (mut sideways, mut of_edge) = (DVec3::ZERO, DVec3::ZERO);
        if shape.sine != 0.0 {
            sideways = weight.cross(self.edge) * f64::from(shape.sine);
            of_edge = self.across.cross(weight) * f64::from(-shape.sine);
        }
        let first = (along - sideways) * f64::from(shape.inverse_heights[0]);
        let second = (along + sideways) * f64::from(shape.inverse_heights[1]);
        let end = of_edge - first * f64::from(shape.feet[0]) - second * f64::from(shape.feet[1]);
        [-(first + second + end), end, first, second]
    }
}

/// The share of the places in the edge.
const EDGE: [f64; 4] = [-1.0, 1.0, 0.0, 0.0];

impl StencilLaw<4> for Hinges {
    const SAVED_AS: u8 = 4;

    type Shape = HingeShape;

    fn energy(&self, shape: &HingeShape, places: &[DVec3; 4]) -> f64 {
        0.5 * shape.bent(places).turn.length_squared()
    }

    /// Pieces of its two triangles that still have an edge together are hinges, as stiff as what they have of its area.
    fn show_parts(&self, shape: &HingeShape, [a, b, c, d]: [u32; 4], parting: &Parting, see: &mut SeePart<4>) {
        let areas = shape.inverse_heights.map(|inverse| 1.0 / f64::from(inverse));
        let show = |see: &mut SeePart<4>| {
            for first in parting.of_cell([a, b, c]) {
                for second in parting.of_cell([a, b, d]) {
                    let ([a, b, c], [other_a, other_b, d]) = (first.nodes, second.nodes);
                    if [a, b] == [other_a, other_b] {
                        let part = (areas[0] * first.part + areas[1] * second.part) / (areas[0] + areas[1]);
                        see([a, b, c, d], part);
                    }
                }
            }
        };
        // Pieces that hang together elsewhere may have the edge in common with the same one: in all they are no more than the whole.
        let mut sum = 0.0_f64;
        show(&mut |_, part| sum += part);
        show(&mut |nodes, part| see(nodes, part / sum.max(1.0)));
    }

    fn change(&self, shape: &HingeShape, places: &[DVec3; 4], ways: &[DVec3; 4]) -> f64 {
        let bent = shape.bent(places);
        let [first, second] = bent.changes(shape, ways);
        let change = first + second;
        change.dot(bent.turn + change * 0.5)
    }

    #[inline(always)]
    fn forces(&self, shape: &HingeShape, places: &[DVec3; 4]) -> [DVec3; 4] {
        let bent = shape.bent(places);
        bent.spread(shape, -bent.turn)
    }

    #[inline(always)]
    fn changes(&self, shape: &HingeShape, places: &[DVec3; 4], ways: &[DVec3; 4]) -> [DVec3; 4] {
        let bent = shape.bent(places);
        let [change, _] = bent.changes(shape, ways);
        bent.spread(shape, -change)
    }

    fn blocks(&self, shape: &HingeShape, places: &[DVec3; 4], is_exact: bool) -> [[DMat3; 4]; 4] {
        let bent = shape.bent(places);
        let (cosine, sine) = (f64::from(shape.cosine), f64::from(shape.sine));
        let [first, second] = shape.shares();
        let [edge, across, turn] = [bent.edge, bent.across, bent.turn].map(cross_matrix);
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

    /// With the arms no longer than 1 and the edge no longer than at rest `|dG|` is at most the sum of what is here, times the ways.
    fn rate(&self, shape: &HingeShape, inverse_masses: [f64; 4]) -> f64 {
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

    /// Longer arms and edges raise that bound; and with x the arms' part of it and y the edge's, G adds `|G| x y <= |G| (x + y)²/4`.
    #[inline(always)]
    fn stiffening(&self, shape: &HingeShape, places: &[DVec3; 4]) -> f64 {
        if shape.sine == 0.0 {
            return 1.0;
        }
        let bent = shape.bent(places);
        let (cosine, sine) = (f64::from(shape.cosine), f64::from(shape.sine));
        // The sine itself, squared, is its part of the edge's length at rest.
        let edge = bent.edge.length_squared() * sine * sine / (1.0 - cosine * cosine).max(f64::from(f32::EPSILON));
        let longest = edge.max(0.25 * bent.across.length_squared()).max(1.0);
        longest + 0.25 * bent.turn.length()
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
