//! Two overlapping closed surfaces: deformable tissue, and a ring that reaches into it.

use glam::{Mat3, Quat, Vec3};
use sinew::detection::image_space::{Placed, Surface};

use crate::random::Random;
use crate::shapes::Shape;

/// The size of the tissue [m]; pixels and errors are relative to it.
pub const SIZE: f32 = 0.1;

/// Widths of the rings, relative to the size.
const RINGS: [f32; 3] = [0.4, 0.8, 1.2];

/// The same tissue and rings of several sizes, each with a random pose.
pub struct Scene {
    /// The tissue at rest.
    pub tissue: Shape,
    pub tissue_surface: Surface,
    pub pairs: Vec<Pair>,
}

pub struct Pair {
    /// Positions of the tissue's nodes.
    pub positions: Vec<Vec3>,
    pub ring: Shape,
    pub ring_surface: Surface,
}

impl Scene {
    /// Creates surfaces of about `triangles` triangles each.
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

    /// The mean number of triangles of both surfaces.
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
