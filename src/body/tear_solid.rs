//! Tears of solids, along faces of their material.

use super::Body;
use super::cuttable::Cuttable;
use super::tear::Torn;
use crate::base::{Result, memory};
use crate::cutting::{CutMaterial, Divided, VertexLoad};
use crate::def::Withheld;
use crate::deformable_contact::Skin;

impl Body {
    /// The nodes at which a spring, or an edge of elements, may tear its solid, in the order in which they are to be tried: that of its own nodes
    /// which is stretched more, the other, and those beside it.
    pub(super) fn stretched_at(&self, cuttable: &Cuttable, spring: [u32; 2]) -> Result<Vec<(u32, VertexLoad)>> {
        let Some(solid) = cuttable.material.solid() else {
            return Ok(Vec::new());
        };
        let callers = spring.map(|node| self.system.order.caller(node));
        let mut beside = memory::gathered(solid.nodes_beside(callers))?;
        memory::sort_once(&mut beside);
        let mut found = memory::reserved(2 + beside.len())?;
        // What holds a node would hold its copies too.
        let load_at = |&node: &u32| {
            let is_free = self.system.inverse_masses[self.system.order.own(node) as usize] > 0.0;
            let load = is_free.then(|| solid.load_at(node, self.positions())).flatten()?;
            Some((node, load))
        };
        let more =
            |a: &(u32, VertexLoad), b: &(u32, VertexLoad)| b.1.tension.total_cmp(&a.1.tension).then(a.0.cmp(&b.0));
        found.extend(callers.iter().filter_map(load_at));
        found.sort_unstable_by(more);
        let ends = found.len();
        found.extend(beside.iter().filter_map(load_at));
        found[ends..].sort_unstable_by(more);
        Ok(found)
    }

    pub(super) fn tear_node(
        &mut self,
        cuttable: &mut Cuttable,
        node: u32,
        load: &VertexLoad,
        skin: Option<&mut Skin>,
    ) -> Result<Torn> {
        let limits = self.limits(cuttable);
        let counts = [cuttable.material.triangle_count(), cuttable.material.item_count()];
        let CutMaterial::Solid(solid) = &mut cuttable.material else {
            return Ok(Torn::Not(Withheld::NoWay));
        };
        let Some(vertex) = solid.vertex_of(node) else {
            return Ok(Torn::Not(Withheld::NoWay));
        };
        let near = memory::gathered(solid.cells_at(node))?;
        let nodes_near = near.iter().flat_map(|&cell| solid.cells()[cell as usize].nodes);
        let mut nodes = memory::collected_within(4 * near.len(), nodes_near)?;
        memory::sort_once(&mut nodes);
        let positions = self.positions();
        let way = solid.way_of(vertex, load, positions)?;
        let Some(mut changes) = solid.tear(vertex, load, positions, limits)? else {
            return Ok(Torn::Not(Withheld::NoWay));
        };
        let least = self.tears.as_ref().map_or(0.0, |tears| tears.smallest_piece());
        let is_less = if least > 0.0 {
            solid.has_parted_less(&changes.faces, least)
        } else {
            Ok(false)
        };
        let applied = match is_less {
            Ok(false) => self
                .share_by_stiffness(&cuttable.material, &mut changes)
                .and_then(|()| self.apply(cuttable, skin, (&way, &near), &changes, counts)),
            Ok(true) => {
                cuttable.material.undo();
                return Ok(Torn::Not(Withheld::SmallPiece));
            }
            Err(error) => Err(error),
        };
        nodes.iter_mut().for_each(|node| *node = self.system.order.own(*node));
        self.end_tear(cuttable, applied, nodes)
    }
}
