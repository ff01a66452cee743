//! Images of a world.

use glam::Vec3;

#[cfg(doc)]
use crate::base::Error;
use crate::base::{BodyId, Result, ensure, memory};
use crate::body::Body;
use crate::contact::{Contact, Pose, Tool, ToolShape};
use crate::def::finite_vector;
use crate::mesh::is_closed;
use crate::raster::{self, Camera, ColourScale, Coloured, Image, Lines, Look, Scene, Surface};
use crate::world::World;

/// The definition of an image of a world.
///
/// ```
#[doc = include_str!("doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # world.create_body(&cloth)?;
/// let definition = PictureDefinition { width: 64, height: 48, ..PictureDefinition::default() };
/// let picture = world.picture(&definition)?;
/// assert_eq!((picture.width, picture.height), (64, 48));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureDefinition {
    /// Pixels, 1 to 16384.
    pub width: u32,
    /// Pixels, 1 to 16384.
    pub height: u32,
    /// The position of the camera and its target, m; `None` for a view fitted to the bodies.
    pub eye_and_target: Option<(Vec3, Vec3)>,
    /// The up direction of the image.
    pub up: Vec3,
    /// The direction from the scene to the camera, for a fitted view.
    pub direction: Vec3,
    /// The vertical field of view, above 0 and below pi, rad.
    pub field_of_view: f32,
    /// Draws the contacts of tools with bodies, and the forces on the tools. The largest force is as long as a sixth of
    /// the scene. They are visible through other surfaces.
    pub show_contacts: bool,
}

impl Default for PictureDefinition {
    /// 1280 x 960 pixels, fitted to the bodies, seen from above and the side.
    fn default() -> Self {
        Self {
            width: 1280,
            height: 960,
            eye_and_target: None,
            up: Vec3::Y,
            direction: Vec3::new(1.0, 0.6, 1.4),
            field_of_view: 0.6,
            show_contacts: false,
        }
    }
}

/// A body colored by a value for each node, such as strain or a force.
///
/// ```
#[doc = include_str!("doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// # let definition = PictureDefinition { width: 64, height: 48, ..PictureDefinition::default() };
/// use sinew::raster::{ColourScale, Colours};
/// let heat: Vec<f32> = mesh.positions.iter().map(|place| place.x).collect();
/// let scale = ColourScale { colours: Colours::Diverging, low: -0.05, high: 0.05 };
/// let picture = world.picture_of_values(&definition, &[BodyValues { body, values: &heat, scale }])?;
/// assert_ne!(picture, world.picture(&definition)?);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyValues<'a> {
    /// The body.
    pub body: BodyId,
    /// The value of each node, in the caller's order.
    pub values: &'a [f32],
    /// The color scale.
    pub scale: ColourScale,
}

impl World {
    /// Renders an image of all bodies and tools. Bodies without a surface are drawn as springs.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a value of the definition is out of range. [`Error::OutOfMemory`].
    pub fn picture(&self, definition: &PictureDefinition) -> Result<Image> {
        self.picture_of_values(definition, &[])
    }

    /// Renders an image with some bodies colored by values. The image has no legend.
    ///
    /// # Errors
    /// Those of [`World::picture`]. [`Error::InvalidArgument`]: the number of values differs from the number of nodes,
    /// a value is not finite, or `low` of a scale is not below `high`. [`Error::StaleId`].
    pub fn picture_of_values(&self, definition: &PictureDefinition, coloured: &[BodyValues]) -> Result<Image> {
        for of in coloured {
            self.body(of.body)?;
        }
        let springs = self.springs_to_draw()?;
        let parts = self.bodies().map(skin_and_inside).collect::<Result<Vec<_>>>()?;
        let mut scene = Scene::default();
        for ((body, springs), parts) in self.bodies().zip(&springs).zip(&parts) {
            let is_this = |of: &&BodyValues| self.body(of.body).is_ok_and(|other| std::ptr::eq(body, other));
            let coloured = coloured.iter().find(is_this).map(|of| Coloured {
                values: of.values,
                scale: of.scale,
            });
            let look = |look| if coloured.is_some() { Look::CHART } else { look };
            if body.surface().is_empty() {
                scene.lines.push(Lines {
                    positions: body.positions(),
                    pairs: springs,
                    thickness: 2.0,
                    look: look(Look::SPRINGS),
                    coloured,
                });
            } else {
                let all = if is_closed(body.surface())? {
                    Look::TISSUE
                } else {
                    Look::CLOTH
                };
                let parts = match parts {
                    None => [(body.surface(), all), (&[], all)],
                    Some([skin, inside]) => [(&skin[..], all), (&inside[..], Look::INSIDE)],
                };
                for (triangles, of_part) in parts.into_iter().filter(|(triangles, _)| !triangles.is_empty()) {
                    scene.surfaces.push(Surface {
                        positions: body.positions(),
                        triangles,
                        look: look(of_part),
                        coloured,
                    });
                }
            }
        }
        scene.shapes.extend(self.tools().filter_map(shape_of));
        let meshes: Vec<_> = self.tools().filter_map(mesh_of).collect();
        for (positions, triangles) in &meshes {
            scene.surfaces.push(Surface {
                positions,
                triangles,
                look: Look::INSTRUMENT,
                coloured: None,
            });
        }
        let camera = definition.camera(&scene)?;
        if definition.show_contacts {
            scene.shapes.extend(self.marks_of_contacts(&scene));
        }
        scene.draw(&camera, definition.width, definition.height)
    }

    /// Draws a dot at each contact of a tool, and a line along the force on it.
    fn marks_of_contacts(&self, scene: &Scene) -> Vec<(raster::Shape, Look)> {
        let extent = scene.extent().map_or(0.0, |(low, high)| (high - low).max_element());
        let contacts: Vec<Contact> = self
            .tool_ids()
            .filter_map(|tool| self.contacts(tool).ok())
            .flatten()
            .collect();
        let largest = contacts
            .iter()
            .fold(0.0_f32, |largest, contact| largest.max(contact.force.length()));
        let marks = contacts.iter().flat_map(|contact| {
            let centre = contact.point;
            let radius = DOT * extent;
            let dot = raster::Shape::Sphere { centre, radius };
            let arrow = raster::Shape::Capsule {
                start: centre,
                end: centre + contact.force * (LONGEST_FORCE * extent / largest),
                radius: 0.4 * radius,
            };
            [dot, arrow].map(|shape| (shape, Look::CONTACT))
        });
        if largest > 0.0 && extent > 0.0 {
            marks.collect()
        } else {
            Vec::new()
        }
    }

    /// The springs to draw for each body without a surface.
    fn springs_to_draw(&self) -> Result<Vec<Vec<[u32; 2]>>> {
        let springs = |body: &Body| {
            if body.surface().is_empty() {
                body.spring_pairs()
            } else {
                Ok(Vec::new())
            }
        };
        self.bodies().map(springs).collect()
    }
}

impl PictureDefinition {
    fn camera(&self, scene: &Scene) -> Result<Camera> {
        let aspect = self.width.max(1) as f32 / self.height.max(1) as f32;
        let Some((eye, target)) = self.eye_and_target else {
            return scene.camera(self.direction, self.up, self.field_of_view, aspect);
        };
        finite_vector("eye", eye)?;
        finite_vector("target", target)?;
        ensure!(eye != target, "eye and target are both {eye}: there is no direction");
        Ok(Camera {
            eye,
            target,
            up: self.up,
            field_of_view: self.field_of_view,
        })
    }
}

/// The surface of a body and the faces exposed by cuts, with a sharp edge between them; `None` without exposed faces.
fn skin_and_inside(body: &Body) -> Result<Option<[Vec<[u32; 3]>; 2]>> {
    if !body.exposed().any(|is_exposed| is_exposed) {
        return Ok(None);
    }
    let mut parts = [Vec::new(), Vec::new()];
    for (&triangle, is_exposed) in body.surface().iter().zip(body.exposed()) {
        memory::push(&mut parts[usize::from(is_exposed)], triangle)?;
    }
    Ok(Some(parts))
}

/// The radius of a contact's dot, and the length of the largest force, relative to the scene.
const DOT: f32 = 0.006;
const LONGEST_FORCE: f32 = 1.0 / 6.0;

/// The mesh that stands for a tool of a closed form.
fn shape_of(tool: &Tool) -> Option<(raster::Shape, Look)> {
    let centre = tool.pose.position;
    let up = tool.pose.orientation * Vec3::Y;
    let shape = match tool.shape {
        ToolShape::Mesh(_) => return None,
        ToolShape::HalfSpace => {
            let plane = raster::Shape::Plane {
                point: centre,
                normal: up,
            };
            return Some((plane, Look::GROUND));
        }
        ToolShape::Rounded {
            radius,
            half_length: 0.0,
        } => raster::Shape::Sphere { centre, radius },
        ToolShape::Rounded { radius, half_length } => raster::Shape::Capsule {
            start: centre - up * half_length,
            end: centre + up * half_length,
            radius,
        },
    };
    Some((shape, Look::INSTRUMENT))
}

/// The surface of a mesh tool at its pose.
fn mesh_of(tool: &Tool) -> Option<(Vec<Vec3>, &[[u32; 3]])> {
    let ToolShape::Mesh(solid) = &tool.shape else {
        return None;
    };
    let Pose { position, orientation } = tool.pose;
    let placed = solid.positions().iter().map(|&corner| position + orientation * corner);
    Some((placed.collect(), solid.triangles()))
}
