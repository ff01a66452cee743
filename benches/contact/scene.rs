//! Two closed surfaces that overlap: tissue, which changes its shape, and a ring, which reaches into it.

use glam::{Mat3, Quat, Vec3};
use sinew::detection::image_space::{Placed, Surface};

use crate::random::Random;
use crate::shapes::Shape;

/// Of the tissue, m; what pixels and errors are told in parts of.
pub const SIZE: f32 = 0.1;

/// How wide the ring is, in parts of that.
const RINGS: [f32; 3] = [0.4, 0.8, 1.2];

/// The same tissue and rings of several sizes, each turned and placed at random.
pub struct Scene {
    /// At rest.
    pub tissue: Shape,
    pub tissue_surface: Surface,
    pub pairs: Vec<Pair>,
}

pub struct Pair {
    /// Where the tissue's nodes are.
    pub positions: Vec<Vec3>,
    pub ring: Shape,
    pub ring_surface: Surface,
}

impl Scene {
    /// Of surfaces of about so many triangles each.
    pub fn new(triangles: usize) -> Self {
        let tissue = Shape::bumpy(SIZE, triangles);
        let mut random = Random(6);
        let mut vector = || Vec3::new(random.signed(), random.signed(), random.signed());
        let pairs = RINGS.map(|ring| {
            let phase = 3.0 * vector().x;
            let turn = Quat::from_scaled_axis(3.0 * vector());
            let direction = vector().normalize_or(Vec3::X);
            let ring = Shape::ring(ring * SIZE, triangles).turned(Mat3::from_quat(turn), direction * (0.4 * SIZE));
            Pair {
                positions: tissue.clone().deformed(SIZE, phase).positions,
                ring_surface: closed(&ring),
                ring,
            }
        });
        Self {
            tissue_surface: closed(&tissue),
            tissue,
            pairs: pairs.into(),
        }
    }

    /// The mean of both surfaces.
    pub fn triangle_count(&self) -> usize {
        (self.tissue.triangles.len() + self.pairs[0].ring.triangles.len()) / 2
    }

    /// The tissue and the ring of a pair.
    pub fn placed<'a>(&'a self, pair: &'a Pair) -> [Placed<'a>; 2] {
        let tissue = (&self.tissue_surface, &pair.positions);
        [tissue, (&pair.ring_surface, &pair.ring.positions)].map(|(surface, positions)| Placed {
            surface,
            positions,
            thickness: 0.0,
        })
    }
}

fn closed(shape: &Shape) -> Surface {
    Surface::closed(shape.positions.len(), &shape.triangles).expect("a closed surface")
}
