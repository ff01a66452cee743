//! What a body that may be cut keeps beside what it is moved with: its material, where that is to be looked for, and what has changed.

use glam::Vec3;

use super::Body;
use crate::base::{Error, Result, memory};
use crate::codec::saved;
use crate::cutting::{CutMaterial, CutSolid, CutSurface, Sweep};
use crate::def::{BodyDefinition, Spring};
use crate::geometry::Bounds;
use crate::soa::{NodeOrder, TILE, tile_count};

use super::change_log::ChangeLog;
use super::stroke::Stroke;

/// What a body that may be cut keeps.
#[derive(Debug)]
pub(super) struct Cuttable {
    /// In the caller's numbers.
    pub material: CutMaterial,
    pub search: TileSearch,
    pub log: ChangeLog,
    pub stroke: Stroke,
    /// Mass by material in the mean, kg/m² or kg/m³, of nodes that have mass.
    pub density: f64,
    /// How many triangles there may be after all cuts.
    pub max_triangles: u32,
    /// Whether every spring lies along an edge of a cell.
    pub springs_are_edges: bool,
}

saved! { Cuttable { material, search, log, stroke, density, max_triangles, springs_are_edges } }

impl Cuttable {
    /// With springs and the triangles that are drawn in the caller's numbers; `None`: the body is not to be cut.
    pub fn new(
        definition: &BodyDefinition,
        springs: &[Spring],
        drawn: &[[u32; 3]],
        order: &NodeOrder,
    ) -> Result<Option<Box<Self>>> {
        let spare = definition.spare_nodes;
        if spare == 0 {
            return Ok(None);
        }
        check_offered(definition)?;
        let rest = definition.rest_positions.unwrap_or(definition.positions);
        let tetrahedra = definition.tetrahedra;
        let what = if tetrahedra.is_empty() {
            "triangles"
        } else {
            "tetrahedra"
        };
        let refused = |error| match error {
            Error::InvalidArgument(why) => {
                Error::invalid(format!("spare_nodes is {spare}, and {what} cannot be cut: {why}"))
            }
            error => error,
        };
        let mut material = match (drawn, tetrahedra) {
            ([], []) => {
                let pairs = memory::collected(springs.iter().map(|spring| spring.nodes))?;
                CutMaterial::Springs(pairs)
            }
            (_, []) => CutMaterial::Surface(CutSurface::new(rest, drawn).map_err(refused)?),
            _ => CutMaterial::Solid(CutSolid::new(rest, tetrahedra, definition.triangles).map_err(refused)?),
        };
        material.reserve(spare)?;
        let mut search = TileSearch::new(rest.len(), &material, order)?;
        // Each copy of a cell brings copies of nodes.
        search.home_of_cell.try_reserve_exact(spare as usize)?;
        let (mut mass, mut size) = (0.0, 0.0);
        for node in 0..rest.len() {
            let of_node = f64::from(definition.masses.get(node));
            if of_node > 0.0 {
                mass += of_node;
                size += material.share_at(node as u32);
            }
        }
        let mut edges = if tetrahedra.is_empty() {
            crate::mesh::edges(drawn, &[])?
        } else {
            crate::mesh::edges(&[], tetrahedra)?
        };
        for edge in &mut edges {
            edge.sort_unstable();
        }
        edges.sort_unstable();
        let added = spare.saturating_mul(material.triangles_per_node());
        let is_edge = |spring: &Spring| {
            let mut nodes = spring.nodes;
            nodes.sort_unstable();
            edges.binary_search(&nodes).is_ok()
        };
        Ok(Some(memory::boxed(Self {
            search,
            max_triangles: material.triangle_count().saturating_add(added),
            material,
            density: if size > 0.0 { mass / size } else { 0.0 },
            log: ChangeLog::default(),
            stroke: Stroke::default(),
            springs_are_edges: springs.iter().all(is_edge),
        })?))
    }
}

impl Cuttable {
    /// Makes a surface that of the material.
    pub fn take_surface(&self, surface: &mut Vec<[u32; 3]>) -> Result<()> {
        let count = self.material.triangle_count();
        surface.clear();
        surface.try_reserve(count as usize)?;
        surface.extend((0..count).map(|triangle| self.material.corner_points(triangle)));
        Ok(())
    }

    /// Makes room for a spring that is added by hand.
    pub fn reserve_spring(&mut self, nodes: [u32; 2], order: &NodeOrder) -> Result<()> {
        if let CutMaterial::Springs(springs) = &mut self.material {
            springs.try_reserve(1)?;
            self.search.reserve_item(nodes, order)?;
        }
        Ok(())
    }

    /// Follows a spring that was added by hand, for which there is room.
    pub fn add_spring(&mut self, nodes: [u32; 2], order: &NodeOrder) {
        if let CutMaterial::Springs(springs) = &mut self.material {
            springs.push(nodes);
            self.search.add_item(springs.len() as u32 - 1, nodes, order);
        }
        self.springs_are_edges &= self.material.has_edge(nodes);
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
    if !definition.cells.is_empty() {
        return lacking("cells");
    }
    if definition.toughness > 0.0 && definition.triangles.is_empty() && definition.tetrahedra.is_empty() {
        return lacking("a toughness and springs alone");
    }
    Ok(())
}

/// Where what is drawn is to be looked for: by tiles of nodes, whose boxes each step finds anew.
#[derive(Debug)]
pub(super) struct TileSearch {
    /// Of each cell that tile at which it, and what it was copied from, is listed.
    home_of_cell: Vec<u32>,
    homes: Vec<TileItems>,
    /// Nodes of the body as it was made.
    first_count: u32,
}

saved! { TileSearch { home_of_cell, homes, first_count } }

/// The items that are listed at one tile.
#[derive(Clone, Debug, Default)]
struct TileItems {
    items: Vec<u32>,
    /// The tiles that nodes which they were made of lie in.
    tiles: Vec<u32>,
    /// Their corners that came later, in the caller's numbers.
    later: Vec<u32>,
}

saved! { TileItems { items, tiles, later } }

/// The tile at which what lies between these is listed.
fn home_of<const CORNERS: usize>(corners: [u32; CORNERS], order: &NodeOrder) -> u32 {
    let tiles = corners.into_iter().map(|corner| order.own(corner) / TILE as u32);
    tiles.min().unwrap_or(0)
}

impl TileSearch {
    fn new(node_count: usize, material: &CutMaterial, order: &NodeOrder) -> Result<Self> {
        let mut homes = memory::filled(TileItems::default(), tile_count(node_count))?;
        let mut home_of_cell = memory::reserved(material.item_count() as usize)?;
        for item in 0..material.item_count() {
            let corners = material.corners_of(item);
            let tiles = corners.map(|corner| order.own(corner) / TILE as u32);
            let home = home_of(corners, order);
            home_of_cell.push(home);
            let home = &mut homes[home as usize];
            memory::push(&mut home.items, item)?;
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

    /// Adds the items that a blade may have met.
    fn near(&self, body: &Body, material: &CutMaterial, swept: &Bounds, near: &mut Vec<u32>) -> Result<()> {
        let positions = body.positions();
        let origin = body.system.origin.as_vec3();
        // What was rounded is in the box all the same.
        let slack = 4.0 * f32::EPSILON * (origin.abs().max_element() + body.reach());
        for home in &self.homes {
            let tiles = home.tiles.iter().map(|&tile| body.system.boxes[tile as usize]);
            let tiles = tiles.fold(Bounds::EMPTY, |all, tile| all.and(&tile)).extended(slack);
            let tiles = Bounds {
                min: tiles.min + origin,
                max: tiles.max + origin,
            };
            let later = Bounds::of(home.later.iter().map(|&point| positions[point as usize]));
            // An item may lie between nodes of both.
            if !tiles.and(&later).overlaps(swept) {
                continue;
            }
            let is_near = |&item: &u32| {
                let places = material.corners_of(item).map(|corner| positions[corner as usize]);
                Bounds::of(places.into_iter()).overlaps(swept)
            };
            memory::extend(near, home.items.iter().copied().filter(is_near))?;
        }
        Ok(())
    }

    /// Makes room for what a cut adds, so many cells and of these items, so that listing it cannot fail.
    pub fn reserve(&mut self, material: &CutMaterial, cells: usize, items: &[u32]) -> Result<()> {
        self.home_of_cell.try_reserve(cells)?;
        let mut homes = memory::reserved(items.len())?;
        let known = items.iter().map(|&item| material.cell_of(item) as usize);
        homes.extend(known.filter_map(|cell| self.home_of_cell.get(cell).copied()));
        homes.sort_unstable();
        // Copies come to the homes of what they were copied from, which may be any of these.
        let copies = items.len() - homes.len();
        for at_home in homes.chunk_by(|a, b| a == b) {
            let home = &mut self.homes[at_home[0] as usize];
            let most = at_home.len() + copies;
            home.items.try_reserve(most)?;
            home.later.try_reserve(4 * most)?;
        }
        Ok(())
    }

    /// Makes room for an item between these.
    fn reserve_item(&mut self, corners: [u32; 2], order: &NodeOrder) -> Result<()> {
        self.home_of_cell.try_reserve(1)?;
        let home = &mut self.homes[home_of(corners, order) as usize];
        home.items.try_reserve(1)?;
        Ok(home.tiles.try_reserve(corners.len())?)
    }

    /// Lists the next item, between these, for which there is room.
    fn add_item(&mut self, item: u32, corners: [u32; 2], order: &NodeOrder) {
        let home = home_of(corners, order);
        self.home_of_cell.push(home);
        let home = &mut self.homes[home as usize];
        home.items.push(item);
        for tile in corners.map(|corner| order.own(corner) / TILE as u32) {
            if !home.tiles.contains(&tile) {
                home.tiles.push(tile);
            }
        }
    }

    /// Lists cells that are copies, given with what they were copied from in the order of their numbers.
    pub fn add_cells(&mut self, copies: impl Iterator<Item = u32>) {
        for source in copies {
            self.home_of_cell.push(self.home_of_cell[source as usize]);
        }
    }

    /// Sees items that changed, and those that are new from this one on, for which there is room.
    pub fn see(&mut self, material: &CutMaterial, items: &[u32], first_new: u32) {
        for &item in items {
            let home = &mut self.homes[self.home_of_cell[material.cell_of(item) as usize] as usize];
            if item >= first_new {
                home.items.push(item);
            }
            for corner in material.corners_of(item) {
                if corner >= self.first_count && !home.later.contains(&corner) {
                    home.later.push(corner);
                }
            }
        }
    }
}

impl Body {
    /// Adds the items of its material whose box a sweep's meets.
    pub(super) fn items_near(&self, cuttable: &Cuttable, sweep: &Sweep, near: &mut Vec<u32>) -> Result<()> {
        let ends = sweep.start.into_iter().chain(sweep.end);
        cuttable.search.near(self, &cuttable.material, &Bounds::of(ends), near)
    }

    /// How far it reaches from where its coordinates begin, m.
    fn reach(&self) -> f32 {
        let bounds = self.system.local_bounds();
        bounds.magnitudes().max_element()
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
