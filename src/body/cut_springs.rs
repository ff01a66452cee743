//! Springs of a body that is cut: those along edges of cells are divided, others are removed if the blade passes
//! through them.

use super::Body;
use super::cut_state::segment_crosses_triangle;
use crate::base::{Result, memory};
use crate::cutting::{Changes, CutMaterial, PieceOfSpring, Sweep};
use crate::def::Spring;
use crate::springs::{Link, Rewiring, SpringChange};

impl Body {
    /// The changes of the springs along edges of cells.
    pub(super) fn rewiring(&self, changes: &Changes) -> Result<Rewiring> {
        let mut rewiring = Rewiring::default();
        let own = |nodes: [u32; 2]| nodes.map(|node| self.system.order.own(node));
        for pieces in changes.springs.chunk_by(|a, b| a.source == b.source) {
            let source = own(pieces[0].source);
            let Some(link) = self.link(source) else {
                continue;
            };
            let is_source = |piece: &&PieceOfSpring| piece.nodes == piece.source;
            match pieces.iter().find(is_source) {
                Some(piece) => memory::push(&mut rewiring.changed, scaled_change(source[0], link, piece.part))?,
                None => memory::push(&mut rewiring.removed, scaled_spring(source, &link, 1.0))?,
            }
            let others = pieces.iter().filter(|piece| !is_source(piece));
            let others = others.map(|piece| scaled_spring(own(piece.nodes), &link, piece.part));
            memory::extend(&mut rewiring.added, others)?;
        }
        Ok(rewiring)
    }

    /// Adds the changes of springs along no edge of a cell. Those that the blade passes through are removed. Those of
    /// nodes that fell apart are scaled by the smaller mass ratio of their two nodes.
    pub(super) fn rewire_non_edges(
        &self,
        material: &CutMaterial,
        sweep: &Sweep,
        near: &[u32],
        changes: &Changes,
        rewiring: &mut Rewiring,
    ) -> Result<()> {
        let mut nodes = memory::reserved(4 * near.len())?;
        for &item in near {
            nodes.extend(material.nodes_of(item).map(|node| self.system.order.own(node)));
        }
        // New nodes have no springs yet.
        let node_count_before = self.node_count() as u32;
        nodes.retain(|&node| node < node_count_before);
        let sources = changes.nodes.iter().filter(|piece| piece.node == piece.source);
        let parts = sources.map(|piece| (self.system.order.own(piece.node), piece.part));
        let mut parts = memory::collected_within(changes.nodes.len(), parts)?;
        parts.sort_unstable_by_key(|&(node, _)| node);
        nodes.try_reserve(parts.len())?;
        nodes.extend(parts.iter().map(|&(node, _)| node));
        memory::sort_once(&mut nodes);
        let mass_ratio = |node: u32| match parts.binary_search_by_key(&node, |&(node, _)| node) {
            Ok(index) => parts[index].1,
            Err(_) => 1.0,
        };
        let mut handled_pairs = memory::reserved(rewiring.removed.len() + rewiring.changed.len())?;
        let ordered = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        handled_pairs.extend(rewiring.removed.iter().map(|spring| ordered(spring.nodes)));
        handled_pairs.extend(
            rewiring
                .changed
                .iter()
                .map(|change| ordered([change.node, change.before.neighbor])),
        );
        handled_pairs.sort_unstable();
        let (positions, swept) = (self.positions(), sweep.triangles());
        let mut candidates = Vec::new();
        for &node in &nodes {
            let mut pushed = Ok(());
            self.system.forces.springs.visit(node as usize, &mut |link| {
                let ends = ordered([node, link.neighbor]);
                // Of two nodes in the list, the lower one handles their spring.
                let is_handled_by_other = ends[0] != node && nodes.binary_search(&ends[0]).is_ok();
                if !is_handled_by_other && pushed.is_ok() && handled_pairs.binary_search(&ends).is_err() {
                    pushed = memory::push(&mut candidates, (node, link));
                }
            });
            pushed?;
        }
        for (node, link) in candidates {
            let ends = [node, link.neighbor];
            let callers = ends.map(|node| self.system.order.caller(node));
            if material.has_edge(callers) {
                continue;
            }
            let segment = callers.map(|node| positions[node as usize]);
            let part = mass_ratio(node).min(mass_ratio(link.neighbor));
            if swept
                .into_iter()
                .any(|triangle| segment_crosses_triangle(segment, triangle))
            {
                memory::push(&mut rewiring.removed, scaled_spring(ends, &link, 1.0))?;
            } else if part < 1.0 {
                memory::push(&mut rewiring.changed, scaled_change(node, link, part))?;
            }
        }
        Ok(())
    }
}

/// A spring between the ends of a link, with a part of its stiffness and damping.
fn scaled_spring(nodes: [u32; 2], link: &Link, part: f64) -> Spring {
    Spring {
        nodes,
        stiffness: (f64::from(link.stiffness) * part) as f32,
        rest_length: link.rest_length,
        damping: (f64::from(link.damping) * part) as f32,
    }
}

fn scaled_change(node: u32, link: Link, part: f64) -> SpringChange {
    SpringChange {
        node,
        before: link,
        after: Link {
            stiffness: (f64::from(link.stiffness) * part) as f32,
            damping: (f64::from(link.damping) * part) as f32,
            ..link
        },
    }
}
