//! Debug drawing: contacts, pins, attachments, springs and sleep as lines, points and triangles for the renderer of the
//! host.

use glam::Vec3;

use crate::base::{Result, above_zero, not_negative};
use crate::body::Body;
use crate::soa::{TILE, tile_count};
use crate::world::World;

/// A color, 8 bits each, from the highest: red, green, blue, opacity.
///
/// ```
/// let color: sinew::Rgba = 0xff80_00ff;
/// assert_eq!(color.to_be_bytes(), [255, 128, 0, 255]);
/// ```
pub type Rgba = u32;

const PRESSED: Rgba = 0xff40_30ff;
const NORMAL: Rgba = 0xffd0_20ff;
const PINNED: Rgba = 0x4080_ffff;
const SLIDING: Rgba = 0x40d0_ffff;
const ATTACHED: Rgba = 0xd040_ffff;
const ASLEEP: Rgba = 0x6070_a060;
const BOX: Rgba = 0x8080_80ff;
/// The colors of springs at rest, at the largest compression and at the largest stretch of the scale.
const RELAXED: [f32; 3] = [0.85, 0.85, 0.85];
const COMPRESSED: [f32; 3] = [0.1, 0.3, 1.0];
const STRETCHED: [f32; 3] = [1.0, 0.15, 0.1];

/// The interface of a renderer. Positions are in world coordinates, m.
///
/// ```
/// # use glam::Vec3;
#[doc = include_str!("doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # world.create_body(&cloth)?;
/// #[derive(Default)]
/// struct LineList(Vec<[Vec3; 2]>);
/// impl DebugCanvas for LineList {
///     fn line(&mut self, ends: [Vec3; 2], _: Rgba) { self.0.push(ends); }
///     fn point(&mut self, _: Vec3, _: Rgba) {}
///     fn triangle(&mut self, _: [Vec3; 3], _: Rgba) {}
/// }
/// let mut lines = LineList::default();
/// world.debug_draw(&DebugDrawDefinition::default(), &mut lines)?;
/// assert!(lines.0.len() > mesh.edges()?.len());
/// # Ok::<(), sinew::Error>(())
/// ```
pub trait DebugCanvas {
    /// A line between two points.
    fn line(&mut self, ends: [Vec3; 2], color: Rgba);
    /// A point.
    fn point(&mut self, place: Vec3, color: Rgba);
    /// A triangle.
    fn triangle(&mut self, corners: [Vec3; 3], color: Rgba);
}

/// The definition of a debug drawing.
///
/// ```
/// # use glam::Vec3;
#[doc = include_str!("doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// # struct LineCount(usize);
/// # impl DebugCanvas for LineCount {
/// #     fn line(&mut self, _: [Vec3; 2], _: Rgba) { self.0 += 1; }
/// #     fn point(&mut self, _: Vec3, _: Rgba) {}
/// #     fn triangle(&mut self, _: [Vec3; 3], _: Rgba) {}
/// # }
/// # let mut lines = LineCount(0);
/// let definition = DebugDrawDefinition { bounds: false, ..DebugDrawDefinition::default() };
/// world.debug_draw(&definition, &mut lines)?;
/// // Springs alone: nothing is touched or attached.
/// assert_eq!(lines.0, world.body(body)?.spring_pairs()?.len());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DebugDrawDefinition {
    /// A point at each contact of a tool with a body at the end of the last step, and a line along the force on the
    /// tool.
    pub contacts: bool,
    /// A line along the normal of each such contact, away from the tool.
    pub normals: bool,
    /// A point at each pinned node, in another color if an axis is free.
    pub pins: bool,
    /// A line from a tool to each attached node, and between attached or sutured points.
    pub attachments: bool,
    /// A line along each spring, blue if compressed, red if stretched.
    pub springs: bool,
    /// The surface triangles whose nodes all sleep.
    pub sleeping: bool,
    /// The bounding box of each body.
    pub bounds: bool,
    /// The length of normals, m, at least 0.
    pub normal_length: f32,
    /// The length of a force of 1 N, m/N, at least 0.
    pub force_scale: f32,
    /// The strain of the strongest color, above 0.
    pub full_strain: f32,
}

impl Default for DebugDrawDefinition {
    /// Draws everything, with normals of 1 cm, forces of 1 cm/N, and the strongest color at a strain of 0.1.
    fn default() -> Self {
        Self {
            contacts: true,
            normals: true,
            pins: true,
            attachments: true,
            springs: true,
            sleeping: true,
            bounds: true,
            normal_length: 0.01,
            force_scale: 0.01,
            full_strain: 0.1,
        }
    }
}

impl World {
    /// Draws the state after the last step. It allocates nothing and changes nothing.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): a length or the scale is out of range. After an error
    /// nothing is drawn.
    pub fn debug_draw(&self, definition: &DebugDrawDefinition, canvas: &mut dyn DebugCanvas) -> Result<()> {
        not_negative("normal_length", definition.normal_length)?;
        not_negative("force_scale", definition.force_scale)?;
        let full = definition.full_strain;
        above_zero("full_strain", full)?;
        for body in self.bodies() {
            if definition.sleeping {
                draw_sleeping(body, canvas);
            }
            if definition.springs {
                draw_springs(body, full, canvas);
            }
            if definition.pins {
                draw_pins(body, canvas);
            }
            if definition.bounds && body.node_count() > 0 {
                draw_box(body.bounds(), canvas);
            }
        }
        if definition.attachments {
            self.visit_attachments(|ends| canvas.line(ends, ATTACHED));
        }
        if definition.contacts || definition.normals {
            self.draw_contacts(definition, canvas);
        }
        Ok(())
    }

    fn draw_contacts(&self, definition: &DebugDrawDefinition, canvas: &mut dyn DebugCanvas) {
        for tool in self.tool_ids() {
            for contact in self.contacts(tool).into_iter().flatten() {
                let from = contact.point;
                if definition.contacts {
                    canvas.point(from, PRESSED);
                    canvas.line([from, from + contact.force * definition.force_scale], PRESSED);
                }
                if definition.normals {
                    canvas.line([from, from + contact.normal * definition.normal_length], NORMAL);
                }
            }
        }
    }
}

fn draw_sleeping(body: &Body, canvas: &mut dyn DebugCanvas) {
    let Some(sleep_state) = body.system().sleep_state.as_deref() else {
        return;
    };
    let positions = body.positions();
    let count = body.node_count();
    let sleeps = |node: u32| {
        let tile = body.system().order.own(node) as usize / TILE;
        tile < tile_count(count) && sleep_state.is_asleep(tile)
    };
    for triangle in body.surface() {
        if triangle.iter().all(|&node| sleeps(node)) {
            canvas.triangle(triangle.map(|node| positions[node as usize]), ASLEEP);
        }
    }
}

fn draw_springs(body: &Body, full: f32, canvas: &mut dyn DebugCanvas) {
    let positions = body.positions();
    for (node, &place) in positions.iter().enumerate() {
        let system = body.system();
        let own = system.order.own(node as u32) as usize;
        system.forces.springs.visit(own, &mut |link| {
            let other = system.caller_index(link.neighbor as usize);
            if other > node && link.rest_length > 0.0 {
                let strain = place.distance(positions[other]) / link.rest_length - 1.0;
                canvas.line([place, positions[other]], color_of(strain / full));
            }
        });
    }
}

/// The color of a spring for a strain relative to the largest of the scale.
fn color_of(part: f32) -> Rgba {
    let part = part.clamp(-1.0, 1.0);
    let end = if part < 0.0 { COMPRESSED } else { STRETCHED };
    let channel = |index: usize| {
        let value = RELAXED[index] + (end[index] - RELAXED[index]) * part.abs();
        (value * 255.0).round() as u32
    };
    channel(0) << 24 | channel(1) << 16 | channel(2) << 8 | 0xff
}

fn draw_pins(body: &Body, canvas: &mut dyn DebugCanvas) {
    for pin in body.system().pins.iter() {
        let place = body.positions()[body.system().caller_index(pin.node as usize)];
        canvas.point(place, if pin.is_partial() { SLIDING } else { PINNED });
    }
}

/// The twelve edges of a box.
fn draw_box([low, high]: [Vec3; 2], canvas: &mut dyn DebugCanvas) {
    let corner = |index: usize| {
        let of = |axis: usize| if index >> axis & 1 == 0 { low[axis] } else { high[axis] };
        Vec3::new(of(0), of(1), of(2))
    };
    for index in 0..8 {
        for axis in (0..3).filter(|axis| index >> axis & 1 == 0) {
            canvas.line([corner(index), corner(index | 1 << axis)], BOX);
        }
    }
}
