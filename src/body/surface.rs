//! The surface where a body is drawn and touched, as it is made and as it changes.

use super::Body;
use crate::base::{Result, memory};
use crate::contact::SurfaceChange;
use crate::def::BodyDefinition;
use crate::mesh::{cell_boundary, outer_faces, turn_outward};

/// The surface that a definition gives, or the outer faces of its elements; outward however its tetrahedra are turned.
pub(super) fn surface_of(definition: &BodyDefinition) -> Result<Vec<[u32; 3]>> {
    let (triangles, tetrahedra) = (definition.triangles, definition.tetrahedra);
    if triangles.is_empty() && tetrahedra.is_empty() {
        return cell_boundary(definition.cells);
    }
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let outer = outer_faces(rest, tetrahedra)?;
    if triangles.is_empty() {
        return Ok(outer);
    }
    let mut surface = memory::copied(triangles)?;
    turn_outward(&mut surface, outer);
    Ok(surface)
}

impl Body {
    /// Makes room for a change of its surface with which so many nodes come, and so many triangles change and are added.
    pub(crate) fn reserve_surface(&mut self, nodes: usize, changed: usize, added: usize) -> Result<()> {
        self.system.surface.try_reserve(added)?;
        if let Some(shown) = self.shown.as_mut().filter(|_| changed + added > 0) {
            shown.reserve_triangles(self.system.surface.capacity())?;
        }
        let node_count = self.node_count() + nodes;
        self.system.bindings.get_or_insert_default().reserve(0, node_count)?;
        if let Some(contacts) = &mut self.system.contacts {
            contacts.reserve_surface(nodes, changed, added)?;
        }
        self.system.reserve_holds()
    }

    /// Changes its surface, for which there is room; all that is named is there, and nodes that have come since the surface last changed
    /// are touched unless they are hidden.
    pub(crate) fn change_surface(&mut self, change: &SurfaceChange) {
        for &(index, corners) in change.changed {
            self.system.surface[index as usize] = corners;
        }
        self.system.surface.extend_from_slice(change.added);
        self.query_tree.outdate();
        if let Some(shown) = &mut self.shown {
            shown.forget_triangles();
        }
        let bindings = self.system.bindings.get_or_insert_default();
        let order = &self.system.order;
        let own = |node: u32| order.own(node);
        change.hidden.iter().for_each(|&node| bindings.hide(own(node)));
        let changed = change.changed.iter().map(|(_, corners)| corners);
        let corners = changed.chain(change.added).flatten();
        for &corner in corners.clone() {
            bindings.show(own(corner));
            if let Some(word) = self.corners.get_mut(corner as usize / 64) {
                *word |= 1 << (corner % 64);
            }
        }
        if let Some(contacts) = &mut self.system.contacts {
            let places = (self.system.state.positions(), &*bindings);
            contacts.change_surface(change, corners.map(|&corner| own(corner)), own, places);
        }
    }
}
