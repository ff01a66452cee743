//! Springs of a body that is cut: parts of those along edges of cells, and those along none that the blade passes through.

use super::Body;
use super::cuttable::passes;
use crate::base::{Result, memory};
use crate::cutting::{Changes, CutMaterial, PieceOfSpring, Sweep};
use crate::def::Spring;
use crate::springs::{Link, Rewiring, SpringChange};

impl Body {
    /// What becomes of springs along edges of cells.
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
                Some(piece) => memory::push(&mut rewiring.changed, part_of(source[0], link, piece.part))?,
                None => memory::push(&mut rewiring.removed, spring_of(source, &link, 1.0))?,
            }
            let others = pieces.iter().filter(|piece| !is_source(piece));
            let others = others.map(|piece| spring_of(own(piece.nodes), &link, piece.part));
            memory::extend(&mut rewiring.added, others)?;
        }
        Ok(rewiring)
    }

    /// Springs along no edge of a cell: those that the blade passed through go, and those of nodes that fell apart become as much softer as
    /// the lighter of their nodes becomes lighter.
    pub(super) fn take_away(
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
        // New ones have no springs yet.
        let known = self.node_count() as u32;
        nodes.retain(|&node| node < known);
        let parted = changes.nodes.iter().filter(|piece| piece.node == piece.source);
        let parts = parted.map(|piece| (self.system.order.own(piece.node), piece.part));
        let mut parts = memory::collected_within(changes.nodes.len(), parts)?;
        parts.sort_unstable_by_key(|&(node, _)| node);
        nodes.try_reserve(parts.len())?;
        nodes.extend(parts.iter().map(|&(node, _)| node));
        memory::sort_once(&mut nodes);
        let part_of_node = |node: u32| match parts.binary_search_by_key(&node, |&(node, _)| node) {
            Ok(place) => parts[place].1,
            Err(_) => 1.0,
        };
        let mut known_ends = memory::reserved(rewiring.removed.len() + rewiring.changed.len())?;
        let ordered = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        known_ends.extend(rewiring.removed.iter().map(|spring| ordered(spring.nodes)));
        known_ends.extend(
            rewiring
                .changed
                .iter()
                .map(|change| ordered([change.node, change.before.neighbour])),
        );
        known_ends.sort_unstable();
        let (positions, swept) = (self.positions(), sweep.triangles());
        let mut found = Vec::new();
        for &node in &nodes {
            let mut room = Ok(());
            self.system.forces.springs.visit(node as usize, &mut |link| {
                let ends = ordered([node, link.neighbour]);
                // Of two nodes that are both looked at the lower sees to it.
                let is_seen = ends[0] != node && nodes.binary_search(&ends[0]).is_ok();
                if !is_seen && room.is_ok() && known_ends.binary_search(&ends).is_err() {
                    room = memory::push(&mut found, (node, link));
                }
            });
            room?;
        }
        for (node, link) in found {
            let ends = [node, link.neighbour];
            let callers = ends.map(|node| self.system.order.caller(node));
            if material.has_edge(callers) {
                continue;
            }
            let segment = callers.map(|node| positions[node as usize]);
            let part = part_of_node(node).min(part_of_node(link.neighbour));
            if swept.into_iter().any(|triangle| passes(segment, triangle)) {
                memory::push(&mut rewiring.removed, spring_of(ends, &link, 1.0))?;
            } else if part < 1.0 {
                memory::push(&mut rewiring.changed, part_of(node, link, part))?;
            }
        }
        Ok(())
    }
}

/// A spring of the ends of a link, with a part of its stiffness and damping.
fn spring_of(nodes: [u32; 2], link: &Link, part: f64) -> Spring {
    Spring {
        nodes,
        stiffness: (f64::from(link.stiffness) * part) as f32,
        rest_length: link.rest_length,
        damping: (f64::from(link.damping) * part) as f32,
    }
}

fn part_of(node: u32, link: Link, part: f64) -> SpringChange {
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
