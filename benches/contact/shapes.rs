//! Closed surfaces with about a given number of triangles.

use std::collections::HashMap;
use std::f32::consts::TAU;

use glam::{Mat3, Vec3};
use sinew::mesh::ClosedSurface;

/// A closed surface; its triangles face outward.
#[derive(Clone)]
pub struct Shape {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// A bumpy ball of this diameter: the six sides of a cube, projected to a sphere.
    pub fn bumpy(diameter: f32, triangles: usize) -> Self {
        let cells = ((triangles as f32 / 12.0).sqrt().round() as i32).max(1);
        let mut numbers = HashMap::new();
        let mut positions = Vec::new();
        let mut faces = Vec::with_capacity(triangles);
        for axis in 0..3 {
            for (side, outward) in [(0, false), (cells, true)] {
                let mut node = |u: i32, v: i32| {
                    let mut index = [0; 3];
                    (index[axis], index[(axis + 1) % 3], index[(axis + 2) % 3]) = (side, u, v);
                    *numbers.entry(index).or_insert_with(|| {
                        // Equal angles, so that triangles have similar sizes.
                        let angle = |i: i32| (2.0 * i as f32 / cells as f32 - 1.0) * std::f32::consts::FRAC_PI_4;
                        let direction = Vec3::from_array(index.map(|i| angle(i).tan())).normalize();
                        positions.push(direction * bumpy_radius(diameter, direction));
                        positions.len() as u32 - 1
                    })
                };
                for u in 0..cells {
                    for v in 0..cells {
                        let [a, b, c, d] = [node(u, v), node(u + 1, v), node(u + 1, v + 1), node(u, v + 1)];
                        if outward {
                            faces.extend([[a, b, c], [a, c, d]]);
                        } else {
                            faces.extend([[a, c, b], [a, d, c]]);
                        }
                    }
                }
            }
        }
        Self {
            positions,
            triangles: faces,
        }
    }

    /// A torus whose tube is a quarter as thick as the torus is wide.
    pub fn ring(diameter: f32, triangles: usize) -> Self {
        let across = ((triangles as f32 / 6.0).sqrt().round() as u32).max(3);
        let around = 3 * across;
        let (radius, tube) = (0.375 * diameter, 0.125 * diameter);
        let point = |i: u32, j: u32| {
            let (u, v) = (TAU * i as f32 / around as f32, TAU * j as f32 / across as f32);
            let out = radius + tube * v.cos();
            Vec3::new(out * u.cos(), tube * v.sin(), out * u.sin())
        };
        let node = |i: u32, j: u32| i % around * across + j % across;
        let squares = || (0..around).flat_map(|i| (0..across).map(move |j| (i, j)));
        Self {
            positions: squares().map(|(i, j)| point(i, j)).collect(),
            triangles: squares()
                .flat_map(|(i, j)| {
                    let [a, b, c, d] = [node(i, j), node(i, j + 1), node(i + 1, j + 1), node(i + 1, j)];
                    [[a, b, c], [a, c, d]]
                })
                .collect(),
        }
    }

    pub fn turned(mut self, turn: Mat3, by: Vec3) -> Self {
        self.positions
            .iter_mut()
            .for_each(|position| *position = turn * *position + by);
        self
    }

    /// Deforms the shape like tissue of this size: bent and compressed by a twelfth of it.
    pub fn deformed(mut self, size: f32, phase: f32) -> Self {
        for position in &mut self.positions {
            let at = *position * (3.0 / size);
            let shift = Vec3::new((at.y + phase).sin(), (at.z + 2.0 * phase).sin(), (at.x - phase).cos());
            *position += size / 24.0 * shift;
        }
        self
    }

    pub fn checked(&self) -> ClosedSurface {
        ClosedSurface::new(&self.positions, &self.triangles).expect("a closed surface")
    }
}

/// The distance of a bumpy ball's surface from its center.
pub fn bumpy_radius(diameter: f32, direction: Vec3) -> f32 {
    let bumps = (5.0 * direction.x + 1.0).sin() * (4.0 * direction.y).cos() + 0.5 * (7.0 * direction.z).sin();
    0.5 * diameter * (1.0 + 0.04 * bumps)
}
