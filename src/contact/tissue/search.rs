//! Which parts of two surfaces, or of one, meet within a step: the first touch of each node with a face and of each edge with an edge, both
//! moving, by conservative advancement.

use glam::Vec3;

use super::link::Side;
use super::skin::Skin;
use crate::body::Bounds;
use crate::contact::sweep::{Corners, Segment, Separation};

/// A body in a search, by its place in the world.
#[derive(Clone, Copy)]
pub(super) struct Party<'a> {
    pub place: usize,
    pub skin: &'a Skin,
}

/// What was found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    pub sides: [Side; 2],
    /// From the second side to the first.
    pub normal: Vec3,
    /// How far apart they are along it when the step begins, less what they keep off, m.
    pub gap: f32,
}

/// A search over a step of `dt` seconds for what comes closer than `radius`, m.
pub(super) struct Search<'a> {
    pub parties: [Party<'a>; 2],
    pub dt: f32,
    pub radius: f32,
}

impl Search<'_> {
    /// Shows all that meets.
    pub fn run(&self, mut see: impl FnMut(Touch)) {
        let [first, second] = self.parties;
        self.nodes_with_faces(first, second, &mut see);
        if !self.is_of_one() {
            self.nodes_with_faces(second, first, &mut see);
        }
        self.edges_with_edges(first, second, &mut see);
    }

    fn is_of_one(&self) -> bool {
        self.parties[0].place == self.parties[1].place
    }

    fn nodes_with_faces(&self, of_nodes: Party, of_faces: Party, see: &mut impl FnMut(Touch)) {
        let shift = shift(of_nodes.skin, of_faces.skin);
        for &node in &of_nodes.skin.nodes {
            let (place, step) = self.way(of_nodes, node, shift, of_faces.skin.drift);
            let segment = Segment {
                ends: [place; 2],
                steps: [step; 2],
                radius: self.radius,
            };
            let mut closest: Option<(usize, Separation)> = None;
            let mut nearest = f32::INFINITY;
            let around = Bounds::of([place, place + step].into_iter());
            of_faces
                .skin
                .near(&around, self.radius + of_faces.skin.spread, |triangle| {
                    let nodes = of_faces.skin.triangles[triangle];
                    if self.is_of_one() && nodes.contains(&node) {
                        return;
                    }
                    let corners = self.corners(of_faces, &nodes);
                    let start = corners.separation(&segment, 0.0);
                    let distance = start.offset.length();
                    if distance >= nearest {
                        return;
                    }
                    if self.is_behind(of_faces.skin, &corners, &start) {
                        if start.inside {
                            // On the wrong side: let out, or led out where it is near the surface.
                            nearest = distance;
                            closest = (distance < self.radius).then_some((triangle, start));
                        }
                    } else if let Some(found) = corners.approach(&segment, 0.0) {
                        nearest = distance;
                        closest = Some((triangle, found));
                    }
                });
            if let Some((triangle, found)) = closest {
                let nodes = of_faces.skin.triangles[triangle];
                let sides = [
                    Side {
                        body: of_nodes.place,
                        nodes: [node; 3],
                        weights: [1.0, 0.0, 0.0],
                    },
                    Side {
                        body: of_faces.place,
                        nodes,
                        weights: found.weights,
                    },
                ];
                let is_behind = self.is_behind(of_faces.skin, &self.corners(of_faces, &nodes), &found);
                self.show(sides, if is_behind { found.offset } else { -found.offset }, shift, see);
            }
        }
    }

    /// Whether what is compared with a face of a closed surface begins on its inner side.
    fn is_behind(&self, of_face: &Skin, face: &Corners, start: &Separation) -> bool {
        let [a, b, c] = face.points;
        of_face.is_closed && !self.is_of_one() && start.offset.dot((b - a).cross(c - a)) > 0.0
    }

    fn edges_with_edges(&self, first: Party, second: Party, see: &mut impl FnMut(Touch)) {
        let shift = shift(first.skin, second.skin);
        for (index, &edge) in first.skin.edges.iter().enumerate() {
            if first.skin.pierces[index] {
                continue;
            }
            let ways = edge.map(|node| self.way(first, node, shift, second.skin.drift));
            let segment = Segment {
                ends: ways.map(|(place, _)| place),
                steps: ways.map(|(_, step)| step),
                radius: self.radius,
            };
            let mut closest: Option<(f32, [u32; 2], Separation)> = None;
            let around = Bounds::of(ways.into_iter().flat_map(|(place, step)| [place, place + step]));
            second.skin.near(&around, self.radius + second.skin.spread, |triangle| {
                for other in second.skin.owned(triangle) {
                    if self.is_of_one()
                        && (other <= first.skin.edges[index] || other.iter().any(|node| edge.contains(node)))
                    {
                        continue;
                    }
                    let corners = self.corners(second, &other);
                    let Some(found) = corners.approach(&segment, 0.0) else {
                        continue;
                    };
                    // At an end of either it is a node that meets.
                    if found.inside && found.along > 0.0 && found.along < 1.0 {
                        let start = corners.separation(&segment, 0.0).offset.length_squared();
                        if closest.is_none_or(|(least, ..)| start < least) {
                            closest = Some((start, other, found));
                        }
                    }
                }
            });
            if let Some((_, other, found)) = closest {
                let sides = [
                    Side {
                        body: first.place,
                        nodes: [edge[0], edge[1], edge[1]],
                        weights: [1.0 - found.along, found.along, 0.0],
                    },
                    Side {
                        body: second.place,
                        nodes: [other[0], other[1], other[1]],
                        weights: found.weights,
                    },
                ];
                self.show(sides, -found.offset, shift, see);
            }
        }
    }

    fn show(&self, sides: [Side; 2], offset: Vec3, shift: Vec3, see: &mut impl FnMut(Touch)) {
        if let Some(normal) = offset.try_normalize() {
            let apart = self.apart(&sides, shift);
            see(Touch {
                sides,
                normal,
                gap: apart.dot(normal) - self.radius,
            });
        }
    }

    /// From the second side to the first when the step begins.
    fn apart(&self, sides: &[Side; 2], shift: Vec3) -> Vec3 {
        let [first, second] = [0, 1].map(|index| {
            let party = if self.parties[0].place == sides[index].body {
                self.parties[0]
            } else {
                self.parties[1]
            };
            sides[index].weighted(|node| party.skin.starts.get(node))
        });
        first + shift - second
    }

    /// Where a node begins and how far it goes, as seen from the other body, which goes with `drift`.
    fn way(&self, party: Party, node: u32, shift: Vec3, drift: Vec3) -> (Vec3, Vec3) {
        let node = node as usize;
        let place = party.skin.starts.get(node) + shift;
        (place, (party.skin.velocities.get(node) - drift) * self.dt)
    }

    /// The corners of an edge or a face in its own body's coordinates, and how far they leave its drift.
    fn corners(&self, party: Party, nodes: &[u32]) -> Corners {
        let mut corners = Corners {
            points: [Vec3::ZERO; 3],
            steps: [Vec3::ZERO; 3],
            count: nodes.len(),
        };
        for (corner, &node) in nodes.iter().enumerate() {
            (corners.points[corner], corners.steps[corner]) = self.way(party, node, Vec3::ZERO, party.skin.drift);
        }
        corners
    }
}

/// From the coordinates of one body to those of another.
pub(super) fn shift(from: &Skin, to: &Skin) -> Vec3 {
    (from.origin - to.origin).as_vec3()
}
