//! Tears of solids, along faces of their tetrahedra.

use super::Body;
use super::cut_state::CutState;
use super::tear::TearOutcome;
use crate::base::{Result, memory};
use crate::cutting::{CellComplex, CutMaterial, VertexLoad};
use crate::def::TearRefusal;
use crate::deformable_contact::CollisionSurface;

impl Body {
    /// The nodes at which a spring, or an edge of elements, can tear its solid, in the order in which to try them. The
    /// more stretched of its own nodes comes first, then the other one, then the nodes next to them.
    pub(super) fn solid_tear_candidates(
        &self,
        cut_state: &CutState,
        spring: [u32; 2],
    ) -> Result<Vec<(u32, VertexLoad)>> {
        let Some(solid) = cut_state.material.solid() else {
            return Ok(Vec::new());
        };
        let callers = spring.map(|node| self.system.order.caller(node));
        let mut adjacent = memory::gathered(solid.opposite_nodes(callers))?;
        memory::sort_once(&mut adjacent);
        let mut candidates = memory::reserved(2 + adjacent.len())?;
        // Copies of a held node would be held too.
        let load_at = |&node: &u32| {
            let is_free = self.system.inverse_masses[self.system.order.own(node) as usize] > 0.0;
            let load = is_free.then(|| solid.load_at(node, self.positions())).flatten()?;
            Some((node, load))
        };
        let by_load =
            |a: &(u32, VertexLoad), b: &(u32, VertexLoad)| b.1.tension.total_cmp(&a.1.tension).then(a.0.cmp(&b.0));
        candidates.extend(callers.iter().filter_map(load_at));
        candidates.sort_unstable_by(by_load);
        let own_count = candidates.len();
        candidates.extend(adjacent.iter().filter_map(load_at));
        candidates[own_count..].sort_unstable_by(by_load);
        Ok(candidates)
    }

    pub(super) fn tear_solid_at(
        &mut self,
        cut_state: &mut CutState,
        node: u32,
        load: &VertexLoad,
        skin: Option<&mut CollisionSurface>,
    ) -> Result<TearOutcome> {
        let limits = self.cut_limits(cut_state);
        let counts = [cut_state.material.triangle_count(), cut_state.material.item_count()];
        let CutMaterial::Solid(solid) = &mut cut_state.material else {
            return Ok(TearOutcome::Refused(TearRefusal::NoPath));
        };
        let Some(vertex) = solid.vertex_of(node) else {
            return Ok(TearOutcome::Refused(TearRefusal::NoPath));
        };
        let near = memory::gathered(solid.cells_at(node))?;
        let nodes_near = near.iter().flat_map(|&cell| solid.cells()[cell as usize].nodes);
        let mut nodes = memory::collected_within(4 * near.len(), nodes_near)?;
        memory::sort_once(&mut nodes);
        let positions = self.positions();
        let sweep = solid.tear_sweep(vertex, load, positions)?;
        let Some(mut changes) = solid.tear(vertex, load, positions, limits)? else {
            return Ok(TearOutcome::Refused(TearRefusal::NoPath));
        };
        let min_size = self
            .tear_queue
            .as_ref()
            .map_or(0.0, |tear_queue| tear_queue.smallest_piece());
        let is_too_small = if min_size > 0.0 {
            solid.has_parted_less(&changes.faces, min_size)
        } else {
            Ok(false)
        };
        let applied = match is_too_small {
            Ok(false) => self
                .shift_mass_by_stiffness(&cut_state.material, &mut changes)
                .and_then(|()| self.apply(cut_state, skin, (&sweep, &near), &changes, counts)),
            Ok(true) => {
                cut_state.material.undo();
                return Ok(TearOutcome::Refused(TearRefusal::SmallPiece));
            }
            Err(error) => Err(error),
        };
        nodes.iter_mut().for_each(|node| *node = self.system.order.own(*node));
        self.finish_tear(cut_state, applied, nodes)
    }
}
