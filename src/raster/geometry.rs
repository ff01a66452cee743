//! A scene as a list of triangles for the rasterizer.

use super::scale::{ColourScale, Coloured};
use super::scene::{Lines, Look, Scene, Shape, Surface};
use super::shade::linear;
use super::tessellate::{self, Tessellation};
use super::view::View;
use crate::base::memory;
use crate::{Error, Result};
use glam::Vec3;

/// All objects of a scene as triangles.
#[derive(Default)]
pub(crate) struct Geometry {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    /// The part of each triangle.
    pub part_index: Vec<u32>,
    pub parts: Vec<MeshPart>,
}

/// The appearance of a run of triangles.
pub(crate) struct MeshPart {
    pub look: Look,
    /// The look's color in linear RGB.
    pub colour: Vec3,
    pub kind: PartKind,
    /// The values that color the part; `None` for the look's color.
    pub value_colors: Option<ValueColors>,
}

/// Values that color a part by a scale.
pub(crate) struct ValueColors {
    scale: ColourScale,
    /// The index of the part's first position.
    first: u32,
    /// A value for each position.
    values: Vec<f32>,
}

impl ValueColors {
    fn new(coloured: &Coloured, first: usize, count: usize) -> Result<Self> {
        Ok(Self {
            scale: coloured.scale,
            first: first as u32,
            values: memory::reserved(count)?,
        })
    }
}

/// The kind of a part, which decides about shadows.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum PartKind {
    /// Casts and receives shadows.
    Solid,
    /// A line, too thin for shadows.
    Thread,
    /// A plane that receives shadows, has a pattern and fades out.
    Ground(Ground),
}

/// The checkerboard pattern of a plane, around its center.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Ground {
    pub centre: Vec3,
    pub axes: [Vec3; 2],
    pub cell: f32,
    pub radius: f32,
}

impl Geometry {
    /// Converts a scene to triangles for `view`, in an image `height` pixels high.
    pub fn new(scene: &Scene, view: &View, height: u32) -> Result<Self> {
        let mut geometry = Geometry::default();
        for surface in &scene.surfaces {
            geometry.add_surface(surface)?;
        }
        for lines in &scene.lines {
            geometry.add_lines(lines, view, height)?;
        }
        let (centre, mut radius) = scene.extent().map_or((Vec3::ZERO, 0.0), |(low, high)| {
            ((low + high) / 2.0, (high - low).length() / 2.0)
        });
        if radius == 0.0 {
            radius = 1.0;
        }
        let eye = view.origin().as_vec3();
        for (shape, look) in &scene.shapes {
            geometry.add_shape(shape, look, eye, (centre, radius))?;
        }
        Ok(geometry)
    }

    fn add_surface(&mut self, surface: &Surface) -> Result<()> {
        check_indices(surface.triangles.as_flattened(), surface.positions.len())?;
        let first = self.begin(
            surface.look,
            PartKind::Solid,
            surface.positions.len(),
            surface.triangles.len(),
        )?;
        if let Some(coloured) = &surface.coloured {
            coloured.check(surface.positions.len())?;
            let mut value_colors = ValueColors::new(coloured, first as usize, coloured.values.len())?;
            value_colors.values.extend_from_slice(coloured.values);
            self.set_value_colors(value_colors);
        }
        self.positions.extend_from_slice(surface.positions);
        self.normals.resize(self.positions.len(), Vec3::ZERO);
        tessellate::add_vertex_normals(
            surface.positions,
            surface.triangles.iter().copied(),
            &mut self.normals[first as usize..],
        );
        self.add_triangles(first, surface.triangles);
        Ok(())
    }

    fn add_lines(&mut self, lines: &Lines, view: &View, height: u32) -> Result<()> {
        check_indices(lines.pairs.as_flattened(), lines.positions.len())?;
        let count = lines.pairs.len();
        self.begin(lines.look, PartKind::Thread, 4 * count, 2 * count)?;
        let mut value_colors = None;
        if let Some(coloured) = &lines.coloured {
            coloured.check(lines.positions.len())?;
            value_colors = Some(ValueColors::new(coloured, self.positions.len(), 4 * count)?);
        }
        let eye = view.origin().as_vec3();
        let half_pixels = (f64::from(lines.thickness) / 1000.0 * f64::from(height) / 2.0).max(0.25);
        for pair in lines.pairs {
            let ends = pair.map(|index| lines.positions[index as usize]);
            let projected = ends.map(|end| view.project(end));
            let [Some(a), Some(b)] = projected else {
                continue;
            };
            let half_widths = [a, b].map(|end| (half_pixels * view.meters_per_pixel(end.depth)) as f32);
            if let Some((positions, normals, triangles)) = tessellate::ribbon(ends, half_widths, eye) {
                let first = self.positions.len() as u32;
                self.positions.extend(positions);
                self.normals.extend(normals);
                self.add_triangles(first, &triangles);
                if let (Some(value_colors), Some(coloured)) = (&mut value_colors, &lines.coloured) {
                    let [a, b] = pair.map(|node| coloured.values[node as usize]);
                    value_colors.values.extend([a, b, b, a]);
                }
            }
        }
        if let Some(value_colors) = value_colors {
            self.set_value_colors(value_colors);
        }
        Ok(())
    }

    fn set_value_colors(&mut self, value_colors: ValueColors) {
        if let Some(part) = self.parts.last_mut() {
            part.value_colors = Some(value_colors);
        }
    }

    fn add_shape(&mut self, shape: &Shape, look: &Look, eye: Vec3, (middle, radius): (Vec3, f32)) -> Result<()> {
        match *shape {
            Shape::Sphere { centre, radius } => {
                let sphere = tessellate::capsule(centre, centre, radius);
                self.add_tessellation(&sphere, *look, PartKind::Solid)
            }
            Shape::Capsule { start, end, radius } => {
                let capsule = tessellate::capsule(start, end, radius);
                self.add_tessellation(&capsule, *look, PartKind::Solid)
            }
            Shape::Plane { point, normal } => {
                let normal = normal.normalize_or_zero();
                if (eye - point).dot(normal) <= 0.0 {
                    return Ok(());
                }
                let centre = middle - normal * (middle - point).dot(normal);
                let ground = Ground {
                    centre,
                    axes: ground_axes(normal),
                    cell: round_length(radius / 3.0),
                    radius: 3.5 * radius,
                };
                let disc = tessellate::disc(centre, normal, ground.radius);
                self.add_tessellation(&disc, *look, PartKind::Ground(ground))
            }
        }
    }

    fn add_tessellation(
        &mut self,
        (positions, normals, triangles): &Tessellation,
        look: Look,
        kind: PartKind,
    ) -> Result<()> {
        let first = self.begin(look, kind, positions.len(), triangles.len())?;
        self.positions.extend_from_slice(positions);
        self.normals.extend_from_slice(normals);
        self.add_triangles(first, triangles);
        Ok(())
    }

    /// Starts a part and reserves memory for it. Returns the index of its first position.
    fn begin(&mut self, look: Look, kind: PartKind, positions: usize, triangles: usize) -> Result<u32> {
        let too_many = || Error::Unsupported("a picture of more than 2^32 points".into());
        let total = self.positions.len() + positions;
        u32::try_from(total.max(self.triangles.len() + triangles)).map_err(|_| too_many())?;
        self.positions.try_reserve_exact(positions)?;
        self.normals.try_reserve_exact(positions)?;
        self.triangles.try_reserve_exact(triangles)?;
        self.part_index.try_reserve_exact(triangles)?;
        self.parts.push(MeshPart {
            look,
            colour: linear(look.colour),
            kind,
            value_colors: None,
        });
        u32::try_from(self.positions.len()).map_err(|_| too_many())
    }

    fn add_triangles(&mut self, first: u32, triangles: &[[u32; 3]]) {
        let part = (self.parts.len() - 1) as u32;
        self.triangles
            .extend(triangles.iter().map(|triangle| triangle.map(|index| first + index)));
        self.part_index.resize(self.triangles.len(), part);
    }

    /// The part of a triangle.
    pub fn part(&self, triangle: u32) -> &MeshPart {
        &self.parts[self.part_index[triangle as usize] as usize]
    }

    /// The corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|index| self.positions[index as usize])
    }

    /// The color inside a triangle, in linear RGB.
    pub fn colour(&self, triangle: u32, weights: [f32; 3]) -> Vec3 {
        let part = self.part(triangle);
        let Some(ValueColors { scale, first, values }) = &part.value_colors else {
            return part.colour;
        };
        let corners = self.triangles[triangle as usize].map(|index| values[(index - first) as usize]);
        scale.colour((0..3).map(|i| corners[i] * weights[i]).sum())
    }

    /// The interpolated normal inside a triangle, oriented toward the eye, and whether the outside faces the eye.
    pub fn normal(&self, triangle: u32, weights: [f32; 3], to_eye: Vec3) -> (Vec3, bool) {
        let [a, b, c] = self.corners(triangle);
        let face = (b - a).cross(c - a);
        let front = face.dot(to_eye) >= 0.0;
        let corners = self.triangles[triangle as usize].map(|index| self.normals[index as usize]);
        let smooth = (0..3).map(|i| corners[i] * weights[i]).sum::<Vec3>();
        let smooth = smooth.try_normalize().unwrap_or(face.normalize_or_zero());
        let normal = if front { smooth } else { -smooth };
        // Near the silhouette, an interpolated normal can point away from the eye. It is projected back.
        let excess = normal.dot(to_eye).min(0.0);
        ((normal - to_eye * excess).normalize_or_zero(), front)
    }
}

fn check_indices(indices: &[u32], count: usize) -> Result<()> {
    match indices.iter().find(|&&index| index as usize >= count) {
        Some(index) => Err(Error::invalid(format!("index {index} of {count} positions"))),
        None => Ok(()),
    }
}

/// Two axes in the plane, aligned with those of the world if the plane is.
fn ground_axes(normal: Vec3) -> [Vec3; 2] {
    let helper = if normal.x.abs() < 0.9 { Vec3::X } else { Vec3::Z };
    let first = (helper - normal * helper.dot(normal)).normalize_or_zero();
    [first, normal.cross(first)]
}

/// The largest of 1, 2, 5 times a power of ten that is at most `length`.
fn round_length(length: f32) -> f32 {
    let power = 10.0_f32.powf(length.log10().floor());
    let steps = [5.0, 2.0, 1.0].map(|step| step * power);
    steps.into_iter().find(|&step| step <= length).unwrap_or(power)
}
