//! The render surface of a body, at creation and after cuts.

use super::Body;
use crate::base::{Result, memory};
use crate::contact::SurfaceChange;
use crate::def::BodyDefinition;
use crate::mesh::{cell_boundary, outer_faces, turn_outward};

/// The surface of a definition, or the outer faces of its elements. It faces outward, whatever the orientation of
/// tetrahedra.
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
    /// Reserves space for a change of the surface: new nodes, and changed and added triangles.
    pub(crate) fn reserve_surface(&mut self, nodes: usize, changed: usize, added: usize) -> Result<()> {
        self.system.surface.try_reserve(added)?;
        if let Some(frames) = self.frames.as_mut().filter(|_| changed + added > 0) {
            frames.reserve_triangles(self.system.surface.capacity())?;
        }
        let node_count = self.node_count() + nodes;
        self.system.bindings.get_or_insert_default().reserve(0, node_count)?;
        if let Some(contacts) = &mut self.system.contacts {
            contacts.reserve_surface(nodes, changed, added)?;
        }
        self.system.reserve_holds()
    }

    /// Changes the surface, for which space is reserved. All nodes of the change exist. Nodes added since the last
    /// change become touchable unless they are hidden.
    pub(crate) fn change_surface(&mut self, change: &SurfaceChange) {
        for &(index, corners) in change.changed {
            self.system.surface[index as usize] = corners;
        }
        self.system.surface.extend_from_slice(change.added);
        self.query_tree.mark_outdated();
        if let Some(frames) = &mut self.frames {
            frames.forget_triangles();
        }
        let bindings = self.system.bindings.get_or_insert_default();
        let order = &self.system.order;
        let own = |node: u32| order.own(node);
        change.hidden.iter().for_each(|&node| bindings.hide(own(node)));
        let changed = change.changed.iter().map(|(_, corners)| corners);
        let corners = changed.chain(change.added).flatten();
        for &corner in corners.clone() {
            bindings.show(own(corner));
            if let Some(word) = self.surface_corners.get_mut(corner as usize / 64) {
                *word |= 1 << (corner % 64);
            }
        }
        if let Some(contacts) = &mut self.system.contacts {
            let positions_and_bindings = (self.system.state.positions(), &*bindings);
            contacts.change_surface(change, corners.map(|&corner| own(corner)), own, positions_and_bindings);
        }
    }
}
