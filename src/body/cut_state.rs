//! The state of a body that can be cut: its material, a search structure and a log of the changes.

use glam::Vec3;

use super::Body;
use crate::base::{Error, Result, memory};
use crate::codec::saved;
use crate::cutting::{CutMaterial, CutSolid, CutSurface, Sweep};
use crate::def::{BodyDefinition, Spring};
use crate::geometry::Aabb;
use crate::soa::{NodeOrder, TILE, tile_count};

use super::change_log::ChangeLog;
use super::stroke::BladeStroke;

/// The state of a body that can be cut.
#[derive(Debug)]
pub(super) struct CutState {
    /// In the caller's indices.
    pub material: CutMaterial,
    pub search: TileSearch,
    pub log: ChangeLog,
    pub stroke: BladeStroke,
    /// Mean mass per area or volume of the nodes that have mass, kg/m² or kg/m³.
    pub density: f64,
    /// The maximum number of triangles after all cuts.
    pub max_triangles: u32,
    /// True if every spring lies along an edge of a cell.
    pub springs_are_edges: bool,
}

saved! { CutState { material, search, log, stroke, density, max_triangles, springs_are_edges } }

impl CutState {
    /// Creates the state from springs and the triangles of the render surface, in the caller's indices. `None` if the
    /// body cannot be cut.
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
        check_supported(definition)?;
        let rest = definition.rest_positions.unwrap_or(definition.positions);
        let tetrahedra = definition.tetrahedra;
        let what = if tetrahedra.is_empty() {
            "triangles"
        } else {
            "tetrahedra"
        };
        let cut_error = |error| match error {
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
            (_, []) => CutMaterial::Surface(CutSurface::new(rest, drawn).map_err(cut_error)?),
            _ => CutMaterial::Solid(CutSolid::new(rest, tetrahedra, definition.triangles).map_err(cut_error)?),
        };
        material.reserve(spare)?;
        let mut search = TileSearch::new(rest.len(), &material, order)?;
        // Each copy of a cell creates copies of nodes.
        search.tile_of_cell.try_reserve_exact(spare as usize)?;
        let (mut mass, mut size) = (0.0, 0.0);
        for node in 0..rest.len() {
            let node_mass = f64::from(definition.masses.get(node));
            if node_mass > 0.0 {
                mass += node_mass;
                size += material.material_at(node as u32);
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
            stroke: BladeStroke::default(),
            springs_are_edges: springs.iter().all(is_edge),
        })?))
    }
}

impl CutState {
    /// Sets a surface to that of the material.
    pub fn copy_surface(&self, surface: &mut Vec<[u32; 3]>) -> Result<()> {
        let count = self.material.triangle_count();
        surface.clear();
        surface.try_reserve(count as usize)?;
        surface.extend((0..count).map(|triangle| self.material.corner_points(triangle)));
        Ok(())
    }

    /// Reserves space for a spring that the caller adds.
    pub fn reserve_spring(&mut self, nodes: [u32; 2], order: &NodeOrder) -> Result<()> {
        if let CutMaterial::Springs(springs) = &mut self.material {
            springs.try_reserve(1)?;
            self.search.reserve_item(nodes, order)?;
        }
        Ok(())
    }

    /// Follows a spring that the caller added, for which space is reserved.
    pub fn add_spring(&mut self, nodes: [u32; 2], order: &NodeOrder) {
        if let CutMaterial::Springs(springs) = &mut self.material {
            springs.push(nodes);
            self.search.add_item(springs.len() as u32 - 1, nodes, order);
        }
        self.springs_are_edges &= self.material.has_edge(nodes);
    }
}

/// Refuses definitions for which cutting is not supported.
fn check_supported(definition: &BodyDefinition) -> Result<()> {
    let spare = definition.spare_nodes;
    let unsupported = |what: &str| {
        Err(Error::Unsupported(format!(
            "spare_nodes is {spare}: bodies with {what} cannot be cut"
        )))
    };
    if !definition.cells.is_empty() {
        return unsupported("cells");
    }
    if definition.toughness > 0.0 && definition.triangles.is_empty() && definition.tetrahedra.is_empty() {
        return unsupported("a toughness and springs alone");
    }
    Ok(())
}

/// A spatial search for items of the material, by tiles of nodes. Each step updates the bounding boxes of the tiles.
#[derive(Debug)]
pub(super) struct TileSearch {
    /// For each cell, the tile that lists it and its copies.
    tile_of_cell: Vec<u32>,
    listings: Vec<TileItems>,
    /// The number of nodes at creation.
    initial_node_count: u32,
}

saved! { TileSearch { tile_of_cell, listings, initial_node_count } }

/// The items that one tile lists.
#[derive(Clone, Debug, Default)]
struct TileItems {
    items: Vec<u32>,
    /// The tiles of the nodes of these items at creation.
    tiles: Vec<u32>,
    /// Corners that were added later, in the caller's indices.
    later_corners: Vec<u32>,
}

saved! { TileItems { items, tiles, later_corners } }

/// The tile that lists an item with these corners.
fn lowest_tile<const CORNERS: usize>(corners: [u32; CORNERS], order: &NodeOrder) -> u32 {
    let tiles = corners.into_iter().map(|corner| order.own(corner) / TILE as u32);
    tiles.min().unwrap_or(0)
}

impl TileSearch {
    fn new(node_count: usize, material: &CutMaterial, order: &NodeOrder) -> Result<Self> {
        let mut listings = memory::filled(TileItems::default(), tile_count(node_count))?;
        let mut tile_of_cell = memory::reserved(material.item_count() as usize)?;
        for item in 0..material.item_count() {
            let corners = material.item_corners(item);
            let tiles = corners.map(|corner| order.own(corner) / TILE as u32);
            let listing = lowest_tile(corners, order);
            tile_of_cell.push(listing);
            let listing = &mut listings[listing as usize];
            memory::push(&mut listing.items, item)?;
            for tile in tiles {
                if !listing.tiles.contains(&tile) {
                    memory::push(&mut listing.tiles, tile)?;
                }
            }
        }
        Ok(Self {
            tile_of_cell,
            listings,
            initial_node_count: node_count as u32,
        })
    }

    /// Adds the items that a blade can intersect.
    fn add_near_items(&self, body: &Body, material: &CutMaterial, swept: &Aabb, near: &mut Vec<u32>) -> Result<()> {
        let positions = body.positions();
        let origin = body.system.origin.as_vec3();
        // Boxes are enlarged by the rounding of positions.
        let slack = 4.0 * f32::EPSILON * (origin.abs().max_element() + body.max_coordinate());
        for listing in &self.listings {
            let tiles = listing.tiles.iter().map(|&tile| body.system.boxes[tile as usize]);
            let tiles = tiles.fold(Aabb::EMPTY, |all, tile| all.and(&tile)).extended(slack);
            let tiles = Aabb {
                min: tiles.min + origin,
                max: tiles.max + origin,
            };
            let later_corners = Aabb::of(listing.later_corners.iter().map(|&point| positions[point as usize]));
            // An item can lie between nodes of both kinds.
            if !tiles.and(&later_corners).overlaps(swept) {
                continue;
            }
            let is_near = |&item: &u32| {
                let corner_positions = material.item_corners(item).map(|corner| positions[corner as usize]);
                Aabb::of(corner_positions.into_iter()).overlaps(swept)
            };
            memory::extend(near, listing.items.iter().copied().filter(is_near))?;
        }
        Ok(())
    }

    /// Reserves space for this many cells and for these items, so that adding them cannot fail.
    pub fn reserve(&mut self, material: &CutMaterial, cells: usize, items: &[u32]) -> Result<()> {
        self.tile_of_cell.try_reserve(cells)?;
        let mut listings = memory::reserved(items.len())?;
        let old_cells = items.iter().map(|&item| material.cell_of(item) as usize);
        listings.extend(old_cells.filter_map(|cell| self.tile_of_cell.get(cell).copied()));
        listings.sort_unstable();
        // Copies are listed with their sources, which can be any of these.
        let copies = items.len() - listings.len();
        for same_tile in listings.chunk_by(|a, b| a == b) {
            let listing = &mut self.listings[same_tile[0] as usize];
            let max_added = same_tile.len() + copies;
            listing.items.try_reserve(max_added)?;
            listing.later_corners.try_reserve(4 * max_added)?;
        }
        Ok(())
    }

    /// Reserves space for an item between these corners.
    fn reserve_item(&mut self, corners: [u32; 2], order: &NodeOrder) -> Result<()> {
        self.tile_of_cell.try_reserve(1)?;
        let listing = &mut self.listings[lowest_tile(corners, order) as usize];
        listing.items.try_reserve(1)?;
        Ok(listing.tiles.try_reserve(corners.len())?)
    }

    /// Adds the next item, for which space is reserved.
    fn add_item(&mut self, item: u32, corners: [u32; 2], order: &NodeOrder) {
        let listing = lowest_tile(corners, order);
        self.tile_of_cell.push(listing);
        let listing = &mut self.listings[listing as usize];
        listing.items.push(item);
        for tile in corners.map(|corner| order.own(corner) / TILE as u32) {
            if !listing.tiles.contains(&tile) {
                listing.tiles.push(tile);
            }
        }
    }

    /// Adds cells that are copies. The sources are given in the order of the copies' indices.
    pub fn add_cells(&mut self, copies: impl Iterator<Item = u32>) {
        for source in copies {
            self.tile_of_cell.push(self.tile_of_cell[source as usize]);
        }
    }

    /// Updates changed items, and adds those from `first_new` on, for which space is reserved.
    pub fn update_items(&mut self, material: &CutMaterial, items: &[u32], first_new: u32) {
        for &item in items {
            let listing = &mut self.listings[self.tile_of_cell[material.cell_of(item) as usize] as usize];
            if item >= first_new {
                listing.items.push(item);
            }
            for corner in material.item_corners(item) {
                if corner >= self.initial_node_count && !listing.later_corners.contains(&corner) {
                    listing.later_corners.push(corner);
                }
            }
        }
    }
}

impl Body {
    /// Adds the items of the material whose bounding box overlaps that of a sweep.
    pub(super) fn items_near_sweep(&self, cut_state: &CutState, sweep: &Sweep, near: &mut Vec<u32>) -> Result<()> {
        let ends = sweep.start.into_iter().chain(sweep.end);
        cut_state
            .search
            .add_near_items(self, &cut_state.material, &Aabb::of(ends), near)
    }

    /// The largest distance from the local origin along an axis, m.
    fn max_coordinate(&self) -> f32 {
        let bounds = self.system.local_bounds();
        bounds.magnitudes().max_element()
    }
}

/// True if a segment passes through a triangle or touches it.
pub(super) fn segment_crosses_triangle(segment: [Vec3; 2], triangle: [Vec3; 3]) -> bool {
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
