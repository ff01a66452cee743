//! Where a surface is nearly flat. There its corners alone keep other tissue off: edges between faces that lie in one plane reach no further than these.

use glam::Vec3;

use super::skin::NONE;
use crate::base::{Result, memory};
use crate::codec::saved;

/// Two edges may come nearer to each other by this part of what is kept off before corners stop them: then these alone meet.
const FLAT: f32 = 0.25;

/// The faces around a corner.
#[derive(Clone, Copy, Debug, Default)]
struct Fan {
    /// The sum of their normals.
    normals: Vec3,
    faces: u16,
    edges: u16,
}

saved! { Fan { normals, faces, edges } }

impl Fan {
    /// By how much the normals leave their mean, root mean square, rad; infinity at the rim of an open surface, which has an edge more than faces.
    fn turn(&self) -> f32 {
        if self.faces == 0 || self.faces != self.edges {
            return f32::INFINITY;
        }
        let spread = 1.0 - self.normals.length() / f32::from(self.faces);
        (2.0 * spread.max(0.0)).sqrt()
    }
}

/// An edge of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ridge {
    /// By how much the faces about its ends leave their mean, rad; infinity: an end is at a rim, or this is not known.
    turn: f32,
    /// m, and 1 / m
    length: f32,
    per_length: f32,
}

saved! { Ridge { turn, length, per_length } }

impl Ridge {
    pub const UNKNOWN: Self = Self {
        turn: f32::INFINITY,
        length: 0.0,
        per_length: 0.0,
    };
    const FLAT: Self = Self {
        turn: 0.0,
        ..Self::UNKNOWN
    };

    /// How far another edge can enter the surface between its corners before one of its own ends touches that, m: as it turns about this edge, or
    /// further on where the other is longer.
    fn let_in(&self, other: &Self) -> f32 {
        0.5 * self.turn * other.length * (other.length * self.per_length).max(1.0)
    }

    /// Whether corners alone keep two surfaces `radius` apart where these edges of them are, m, but for a part of that.
    pub fn is_flat_beside(&self, other: &Self, radius: f32) -> bool {
        let most = FLAT * radius;
        self.let_in(other) <= most || other.let_in(self) <= most
    }
}

/// The edges of a surface as a step begins.
#[derive(Debug)]
pub(super) struct Flatness {
    fans: Vec<Fan>,
    ridges: Vec<Ridge>,
}

saved! { Flatness { fans, ridges } }

impl Flatness {
    /// Of nothing yet, with room for a surface of so many numbers of nodes, and so many edges.
    pub fn new(nodes: usize, edges: usize) -> Result<Self> {
        let mut flatness = Self {
            fans: Vec::new(),
            ridges: Vec::new(),
        };
        flatness.reserve(nodes, edges)?;
        Ok(flatness)
    }

    /// Makes room for a surface of so many numbers of nodes, and so many edges.
    pub fn reserve(&mut self, nodes: usize, edges: usize) -> Result<()> {
        memory::reserve(&mut self.fans, nodes)?;
        memory::reserve(&mut self.ridges, edges)
    }

    /// Forgets what was measured.
    pub fn clear(&mut self) {
        self.ridges.clear();
    }

    /// Measures a surface with so many numbers of nodes, which are at these places: flat is what was so each time since the last was forgotten. Without
    /// room nothing counts as flat.
    pub fn measure(&mut self, nodes: usize, triangles: &[[u32; 3]], edges: &[[u32; 2]], at: impl Fn(u32) -> Vec3) {
        let Self { fans, ridges } = self;
        if fans.capacity() < nodes || ridges.capacity() < edges.len() {
            return;
        }
        fans.clear();
        fans.resize(nodes, Fan::default());
        for triangle in triangles {
            let [a, b, c] = triangle.map(&at);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            for &node in triangle {
                let fan = &mut fans[node as usize];
                fan.normals += normal;
                fan.faces = fan.faces.saturating_add(1);
            }
        }
        for &node in edges.iter().filter(|edge| edge[0] != NONE).flatten() {
            let fan = &mut fans[node as usize];
            fan.edges = fan.edges.saturating_add(1);
        }
        ridges.resize(edges.len(), Ridge::FLAT);
        for (ridge, edge) in ridges.iter_mut().zip(edges) {
            if edge[0] == NONE {
                *ridge = Ridge::UNKNOWN;
                continue;
            }
            let [a, b] = edge.map(|node| fans[node as usize].turn());
            let length = at(edge[0]).distance(at(edge[1]));
            *ridge = Ridge {
                turn: ridge.turn.max(a).max(b),
                length,
                per_length: 1.0 / length.max(f32::MIN_POSITIVE),
            };
        }
    }

    /// An edge by its number.
    pub fn of(&self, edge: usize) -> Ridge {
        self.ridges.get(edge).copied().unwrap_or(Ridge::UNKNOWN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, edges};

    fn measured(places: &[Vec3], triangles: &[[u32; 3]]) -> (Vec<[u32; 2]>, Flatness) {
        let edges = edges(triangles, &[]).expect("memory");
        let mut flatness = Flatness::new(places.len(), edges.len()).expect("memory");
        flatness.measure(places.len(), triangles, &edges, |node| places[node as usize]);
        (edges, flatness)
    }

    #[test]
    fn a_plane_is_flat_but_for_its_rim() {
        let cloth = Mesh::cloth([0.3, 0.2], [6, 4]).expect("a cloth");
        let (edges, flatness) = measured(&cloth.positions, &cloth.triangles);
        let at_rim = |node: u32| {
            let place = cloth.positions[node as usize];
            place.x.abs() > 0.149 || place.z.abs() > 0.099
        };
        let inner = (0..edges.len()).find(|&edge| edges[edge].iter().all(|&node| !at_rim(node)));
        let inner = flatness.of(inner.expect("an inner edge"));
        for (number, edge) in edges.iter().enumerate() {
            let ridge = flatness.of(number);
            if edge.iter().any(|&node| at_rim(node)) {
                assert_eq!(ridge.turn, f32::INFINITY, "{edge:?}");
                assert!(!ridge.is_flat_beside(&ridge, 1.0), "{edge:?}");
            } else {
                assert!(ridge.is_flat_beside(&ridge, 1e-4), "{edge:?}: {ridge:?}");
            }
            assert!(ridge.is_flat_beside(&inner, 1e-4), "{edge:?}: {ridge:?}");
        }
        assert_eq!(flatness.of(edges.len()).turn, f32::INFINITY);
    }

    #[test]
    fn a_fold_lets_in_what_lies_across_it_by_its_height() {
        // The middle row is the fold: faces on both sides turn by this angle.
        let angle = 0.2_f32;
        let cloth = Mesh::cloth([0.4; 2], [4; 2]).expect("a cloth");
        let places: Vec<Vec3> = cloth
            .positions
            .iter()
            .map(|place| Vec3::new(place.x, -place.z.abs() * angle.sin(), place.z * angle.cos()))
            .collect();
        let (edges, flatness) = measured(&places, &cloth.triangles);
        let inner = |node: u32| places[node as usize].x.abs() < 0.11 && cloth.positions[node as usize].z == 0.0;
        let mut seen = 0;
        for (number, edge) in edges.iter().enumerate() {
            if edge.iter().all(|&node| inner(node)) {
                // All normals are at that angle from their mean, with three faces on either side. An edge of 0.1 m across it has its ends so far
                // from the fold that the faces are this much below it there.
                let height = 0.05 * angle;
                let ridge = flatness.of(number);
                let let_in = ridge.let_in(&ridge);
                assert!((let_in / height - 1.0).abs() < 0.01, "{edge:?}: {let_in} m of {height}");
                let twice = Ridge {
                    length: 0.2,
                    per_length: 5.0,
                    ..ridge
                };
                assert!((ridge.let_in(&twice) / let_in - 4.0).abs() < 0.01);
                seen += 1;
            }
        }
        assert_eq!(seen, 2);
    }

    #[test]
    fn a_sheet_whose_faces_turn_both_ways_is_not_taken_for_flat() {
        let cloth = Mesh::cloth([0.4; 2], [4; 2]).expect("a cloth");
        let mut triangles = cloth.triangles.clone();
        triangles.iter_mut().step_by(2).for_each(|triangle| triangle.swap(0, 1));
        let (edges, flatness) = measured(&cloth.positions, &triangles);
        assert!((0..edges.len()).all(|edge| flatness.of(edge).turn > 0.5));
    }

    #[test]
    fn what_bends_meanwhile_is_not_flat() {
        let cloth = Mesh::cloth([0.4; 2], [4; 2]).expect("a cloth");
        let edges = edges(&cloth.triangles, &[]).expect("memory");
        let middle = (0..).zip(&cloth.positions).find(|(_, place)| place.length() < 1e-6);
        let (middle, _) = middle.expect("a node in the middle");
        let turn_after = |bends: &[f32]| {
            let mut flatness = Flatness::new(cloth.positions.len(), edges.len()).expect("memory");
            for &bend in bends {
                let at = |node: u32| {
                    cloth.positions[node as usize] + if node == middle { bend * Vec3::Y } else { Vec3::ZERO }
                };
                flatness.measure(cloth.positions.len(), &cloth.triangles, &edges, at);
            }
            let edge = edges
                .iter()
                .position(|edge| edge.contains(&middle))
                .expect("an edge there");
            flatness.of(edge).turn
        };
        assert!(turn_after(&[0.0]) < 1e-3);
        let bent = turn_after(&[0.02]);
        assert!(bent > 0.1, "{bent}");
        assert_eq!(turn_after(&[0.02, 0.0]), bent);
        assert_eq!(turn_after(&[0.0, 0.02]), bent);
    }
}
