//! What a body that may be cut keeps beside what it is moved with: its material, where that is to be looked for, and what has changed.

use glam::Vec3;

use super::{Body, BodyDefinition, Bounds, NodeOrder, Spring};
use crate::cutting::{CutSurface, Sweep};
use crate::error::{Error, Result};
use crate::memory;
use crate::springs::{TILE, tile_count};

use super::change_log::ChangeLog;
use super::stroke::Stroke;

/// What a body that may be cut keeps.
#[derive(Debug)]
pub(super) struct Cuttable {
    /// In the caller's numbers.
    pub surface: CutSurface,
    pub search: Search,
    pub log: ChangeLog,
    pub stroke: Stroke,
    /// Mass by area in the mean, kg/m², of nodes that have mass.
    pub density: f64,
    /// Whether every spring lies along an edge of a cell.
    pub springs_are_edges: bool,
    /// What it takes to cut it, J/m.
    pub toughness: f32,
}

impl Cuttable {
    /// With springs in the caller's numbers; `None`: the body is not to be cut.
    pub fn new(definition: &BodyDefinition, springs: &[Spring], order: &NodeOrder) -> Result<Option<Box<Self>>> {
        let spare = definition.spare_nodes;
        if spare == 0 {
            return Ok(None);
        }
        check_offered(definition)?;
        let rest = definition.rest_positions.unwrap_or(definition.positions);
        let refused = |error| match error {
            Error::InvalidArgument(why) => {
                Error::invalid(format!("spare_nodes is {spare}, and triangles cannot be cut: {why}"))
            }
            error => error,
        };
        let mut surface = CutSurface::new(rest, definition.triangles).map_err(refused)?;
        surface.reserve(spare)?;
        let mut search = Search::new(rest.len(), definition.triangles, order)?;
        // Each copy of a cell brings copies of nodes.
        search.home_of_cell.try_reserve_exact(spare as usize)?;
        let (mut mass, mut area) = (0.0, 0.0);
        for node in 0..rest.len() {
            let of_node = f64::from(definition.masses.get(node));
            if of_node > 0.0 {
                mass += of_node;
                area += surface.area_at(node as u32);
            }
        }
        let mut edges = crate::mesh::edges(definition.triangles, &[])?;
        for edge in &mut edges {
            edge.sort_unstable();
        }
        edges.sort_unstable();
        let is_edge = |spring: &Spring| {
            let mut nodes = spring.nodes;
            nodes.sort_unstable();
            edges.binary_search(&nodes).is_ok()
        };
        Ok(Some(Box::new(Self {
            search,
            surface,
            density: if area > 0.0 { mass / area } else { 0.0 },
            log: ChangeLog::default(),
            stroke: Stroke::default(),
            springs_are_edges: springs.iter().all(is_edge),
            toughness: definition.toughness,
        })))
    }
}

/// Refuses what cannot be cut yet.
fn check_offered(definition: &BodyDefinition) -> Result<()> {
    let spare = definition.spare_nodes;
    let lacking = |what: &str| {
        Err(Error::Unsupported(format!(
            "spare_nodes is {spare}: bodies with {what} cannot be cut"
        )))
    };
    if !definition.tetrahedra.is_empty() {
        return lacking("tetrahedra");
    }
    if !definition.cells.is_empty() {
        return lacking("cells");
    }
    if definition.triangles.is_empty() {
        return lacking("no triangles");
    }
    if definition.enclosed_stiffness > 0.0 || definition.pressure != 0.0 {
        return lacking("an enclosed_stiffness or a pressure");
    }
    if definition.contact.with_bodies || definition.contact.with_itself {
        return lacking("contact with other tissue or with themselves");
    }
    Ok(())
}

/// Where what is drawn is to be looked for: by tiles of nodes, whose boxes each step finds anew.
#[derive(Debug)]
pub(super) struct Search {
    /// Of each cell that tile at which it, and what it was copied from, is listed.
    home_of_cell: Vec<u32>,
    homes: Vec<Home>,
    /// Nodes of the body as it was made.
    first_count: u32,
}

/// The triangles that are listed at one tile.
#[derive(Clone, Debug, Default)]
struct Home {
    triangles: Vec<u32>,
    /// The tiles that nodes which they were made of lie in.
    tiles: Vec<u32>,
    /// Their corners that came later, in the caller's numbers.
    later: Vec<u32>,
}

impl Search {
    fn new(node_count: usize, triangles: &[[u32; 3]], order: &NodeOrder) -> Result<Self> {
        let mut homes = memory::filled(Home::default(), tile_count(node_count))?;
        let mut home_of_cell = memory::reserved(triangles.len())?;
        for (number, corners) in (0..).zip(triangles) {
            let tiles = corners.map(|corner| order.own(corner) / TILE as u32);
            let home = tiles.into_iter().min().unwrap_or(0);
            home_of_cell.push(home);
            let home = &mut homes[home as usize];
            memory::push(&mut home.triangles, number)?;
            for tile in tiles {
                if !home.tiles.contains(&tile) {
                    memory::push(&mut home.tiles, tile)?;
                }
            }
        }
        Ok(Self {
            home_of_cell,
            homes,
            first_count: node_count as u32,
        })
    }

    /// Adds the triangles that a blade may have met.
    fn near(&self, body: &Body, surface: &CutSurface, swept: &Bounds, near: &mut Vec<u32>) -> Result<()> {
        let positions = body.positions();
        let origin = body.origin.as_vec3();
        // What was rounded is in the box all the same.
        let slack = 4.0 * f32::EPSILON * (origin.abs().max_element() + body.reach());
        for home in &self.homes {
            let tiles = home.tiles.iter().map(|&tile| body.boxes[tile as usize]);
            let tiles = tiles.fold(Bounds::EMPTY, |all, tile| all.and(&tile)).extended(slack);
            let tiles = Bounds {
                min: tiles.min + origin,
                max: tiles.max + origin,
            };
            let later = Bounds::of(home.later.iter().map(|&point| positions[point as usize]));
            // A triangle may lie between nodes of both.
            if !tiles.and(&later).overlaps(swept) {
                continue;
            }
            for &triangle in &home.triangles {
                let corners = surface.corner_points(triangle);
                let places = corners.map(|corner| positions[corner as usize]);
                if Bounds::of(places.into_iter()).overlaps(swept) {
                    memory::push(near, triangle)?;
                }
            }
        }
        Ok(())
    }

    /// Makes room for what a cut adds, so that listing it cannot fail.
    pub fn reserve(&mut self, surface: &CutSurface, cells: usize, triangles: &[u32]) -> Result<()> {
        self.home_of_cell.try_reserve(cells)?;
        // Each of them may come to any home, and with three corners.
        for &triangle in triangles {
            let cell = surface.triangles()[triangle as usize].cell;
            if let Some(&home) = self.home_of_cell.get(cell as usize) {
                let home = &mut self.homes[home as usize];
                home.triangles.try_reserve(triangles.len())?;
                home.later.try_reserve(3 * triangles.len())?;
            }
        }
        Ok(())
    }

    /// Lists cells that are copies, given with what they were copied from in the order of their numbers.
    pub fn add_cells(&mut self, copies: impl Iterator<Item = u32>) {
        for source in copies {
            self.home_of_cell.push(self.home_of_cell[source as usize]);
        }
    }

    /// Sees triangles that changed, and those that are new from this one on, for which there is room.
    pub fn see(&mut self, surface: &CutSurface, triangles: &[u32], first_new: u32) {
        for &triangle in triangles {
            let cell = surface.triangles()[triangle as usize].cell;
            let home = &mut self.homes[self.home_of_cell[cell as usize] as usize];
            if triangle >= first_new {
                home.triangles.push(triangle);
            }
            for corner in surface.corner_points(triangle) {
                if corner >= self.first_count && !home.later.contains(&corner) {
                    home.later.push(corner);
                }
            }
        }
    }
}

impl Body {
    /// Adds the triangles whose box a sweep's meets.
    pub(super) fn triangles_near(&self, cuttable: &Cuttable, sweep: &Sweep, near: &mut Vec<u32>) -> Result<()> {
        let ends = sweep.start.into_iter().chain(sweep.end);
        cuttable.search.near(self, &cuttable.surface, &Bounds::of(ends), near)
    }

    /// How far it reaches from where its coordinates begin, m.
    fn reach(&self) -> f32 {
        let bounds = self.local_bounds();
        bounds.min.abs().max(bounds.max.abs()).max_element()
    }
}

/// Whether a segment passes through a triangle; touching counts.
pub(super) fn passes(segment: [Vec3; 2], triangle: [Vec3; 3]) -> bool {
    let [from, to] = segment.map(|end| end.as_dvec3());
    let [a, b, c] = triangle.map(|corner| corner.as_dvec3());
    let volume = |p: glam::DVec3, q: glam::DVec3, r: glam::DVec3, s: glam::DVec3| (q - p).cross(r - p).dot(s - p);
    let (before, after) = (volume(a, b, c, from), volume(a, b, c, to));
    if before * after > 0.0 || before == after {
        return false;
    }
    let sides = [volume(from, to, a, b), volume(from, to, b, c), volume(from, to, c, a)];
    sides.iter().all(|&side| side >= 0.0) || sides.iter().all(|&side| side <= 0.0)
}
