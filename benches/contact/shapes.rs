//! Closed surfaces of about as many triangles as are asked for.

use std::collections::HashMap;
use std::f32::consts::TAU;

use glam::{Mat3, Vec3};
use sinew::mesh::ClosedSurface;

/// A closed surface; its triangles face outwards.
#[derive(Clone)]
pub struct Shape {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// A ball of this diameter with bumps of a few parts of it: the six sides of a cube, blown up.
    pub fn bumpy(diameter: f32, triangles: usize) -> Self {
        let cells = ((triangles as f32 / 12.0).sqrt().round() as i32).max(1);
        let mut numbers = HashMap::new();
        let mut positions = Vec::new();
        let mut faces = Vec::with_capacity(triangles);
        for axis in 0..3 {
            for (side, outward) in [(0, false), (cells, true)] {
                let mut node = |u: i32, v: i32| {
                    let mut place = [0; 3];
                    (place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3]) = (side, u, v);
                    *numbers.entry(place).or_insert_with(|| {
                        // Equal angles, so that triangles are of about one size.
                        let angle = |i: i32| (2.0 * i as f32 / cells as f32 - 1.0) * std::f32::consts::FRAC_PI_4;
                        let direction = Vec3::from_array(place.map(|i| angle(i).tan())).normalize();
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

    /// A ring whose tube is a quarter as thick as it is wide.
    pub fn ring(diameter: f32, triangles: usize) -> Self {
        let across = ((triangles as f32 / 6.0).sqrt().round() as u32).max(3);
        let around = 3 * across;
        let (radius, tube) = (0.375 * diameter, 0.125 * diameter);
        let place = |i: u32, j: u32| {
            let (u, v) = (TAU * i as f32 / around as f32, TAU * j as f32 / across as f32);
            let out = radius + tube * v.cos();
            Vec3::new(out * u.cos(), tube * v.sin(), out * u.sin())
        };
        let node = |i: u32, j: u32| i % around * across + j % across;
        let squares = || (0..around).flat_map(|i| (0..across).map(move |j| (i, j)));
        Self {
            positions: squares().map(|(i, j)| place(i, j)).collect(),
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

    /// As tissue of this size would deform: bent and squeezed by a twelfth of it.
    pub fn deformed(mut self, size: f32, phase: f32) -> Self {
        for position in &mut self.positions {
            let at = *position * (3.0 / size);
            let way = Vec3::new((at.y + phase).sin(), (at.z + 2.0 * phase).sin(), (at.x - phase).cos());
            *position += size / 24.0 * way;
        }
        self
    }

    pub fn checked(&self) -> ClosedSurface {
        ClosedSurface::new(&self.positions, &self.triangles).expect("a closed surface")
    }
}

/// How far the surface of a bumpy ball is from its middle.
pub fn bumpy_radius(diameter: f32, direction: Vec3) -> f32 {
    let bumps = (5.0 * direction.x + 1.0).sin() * (4.0 * direction.y).cos() + 0.5 * (7.0 * direction.z).sin();
    0.5 * diameter * (1.0 + 0.04 * bumps)
}
