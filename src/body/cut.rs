//! A cut: what the blade parted falls apart in everything that a body is moved with.

use super::change_log::{TopologyChanges, unchanged};
use super::cuttable::Cuttable;
use super::{Body, Bound, NewNode};
use crate::contact::SurfaceChange;
use crate::cutting::{BoundPoint, Changes, CutMaterial, Limits, Sweep};
use crate::elements::PieceOfElement;
use crate::error::{Error, Result};
use crate::memory;
use crate::solver::close;

/// What a cut did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CutReport {
    /// Nodes that are new: copies of others, and points of the surface that are bound to nodes.
    pub new_nodes: u32,
    /// Triangles of the surface that are new.
    pub new_triangles: u32,
    /// Springs that are gone: taken away by the blade, or replaced by springs of copies.
    pub springs_removed: u32,
    /// How many more pieces the surface has.
    pub pieces_parted: u32,
    /// How long the cut is, in the rest shape, m; of solids on their skin.
    pub length: f64,
    /// Of solids: how large the faces are that have opened, in the rest shape, each on one of its sides, m².
    pub area: f64,
}

impl Body {
    /// See [`World::cut`](crate::World::cut), which has what is attached follow. Changes nothing where it fails.
    pub(crate) fn cut(&mut self, sweep: &Sweep) -> Result<CutReport> {
        let mut cuttable = self
            .cuttable
            .take()
            .ok_or_else(|| Error::Unsupported("spare_nodes is 0: the body was not made to be cut".into()))?;
        let report = self.cut_with(&mut cuttable, sweep);
        self.cuttable = Some(cuttable);
        report
    }

    /// What has changed since a version of the topology, 0 when the body was made, for a renderer that follows.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the version is to come.
    pub fn changes_since(&self, version: u64) -> Result<TopologyChanges<'_>> {
        match &self.cuttable {
            Some(cuttable) => cuttable.log.since(version),
            None => unchanged(version),
        }
    }

    /// For each triangle of its surface whether a cut has bared it; nothing where none can be.
    pub(crate) fn bared(&self) -> impl Iterator<Item = bool> {
        let material = self.cuttable.as_ref().map(|cuttable| &cuttable.material);
        material.into_iter().flat_map(CutMaterial::bared)
    }

    /// Which version its topology has: 0 when it was made.
    pub fn topology_version(&self) -> u64 {
        self.cuttable.as_ref().map_or(0, |cuttable| cuttable.log.version())
    }

    fn cut_with(&mut self, cuttable: &mut Cuttable, sweep: &Sweep) -> Result<CutReport> {
        let mut sweep = *sweep;
        if let Some(start) = cuttable.stroke.carried(&sweep, &cuttable.material, self.positions()) {
            sweep.start = start;
            cuttable.material.carry(start);
        }
        let mut near = Vec::new();
        self.items_near(cuttable, &sweep, &mut near)?;
        let limits = Limits {
            nodes: self.node_room as u32,
            ..Limits::NONE
        };
        let counts = [cuttable.material.triangle_count(), cuttable.material.item_count()];
        let changes = cuttable.material.cut(&sweep, self.positions(), &near, limits)?;
        let room = cuttable.stroke.reserve(cuttable.material.most_ends(&changes, &near));
        let applied = room.and_then(|()| self.apply(cuttable, &sweep, &near, &changes, counts));
        match applied {
            Ok(_) => self.stop(cuttable, &sweep, &near, &changes),
            Err(_) => cuttable.material.undo(),
        }
        applied
    }

    /// Makes the body what the changes say, of so many triangles and items that there were before. Changes nothing where it fails.
    pub(super) fn apply(
        &mut self,
        cuttable: &mut Cuttable,
        sweep: &Sweep,
        near: &[u32],
        changes: &Changes,
        [first_triangle, first_item]: [u32; 2],
    ) -> Result<CutReport> {
        let material = &cuttable.material;
        let known = self.node_count();
        // What may fail comes first.
        let pieces_parted = material.parted(changes, usize::MAX)?.unwrap_or(0);
        let mut rewiring = self.rewiring(changes)?;
        if !cuttable.springs_are_edges {
            self.take_away(material, sweep, near, changes, &mut rewiring)?;
        }
        if changes.is_empty() && rewiring.is_empty() {
            return Ok(CutReport::default());
        }
        let is_held = |source: u32| self.inverse_masses[self.order.own(source) as usize] == 0.0;
        if self.carry.masses_for > 0.0 || changes.nodes.iter().any(|piece| is_held(piece.source)) {
            // What closes the last step is made with the masses that it was taken with, and gives nothing to copies of what was held.
            close(self);
        }
        let nodes = self.new_nodes(changes)?;
        let pieces = self.pieces_of_elements(material, changes)?;
        let touched = self.touched(changes, &rewiring)?;
        let copies = changes.cells.iter().filter(|piece| piece.cell != piece.source);
        let items = material.items_changed(changes)?;
        cuttable.search.reserve(material, copies.clone().count(), &items)?;
        let mut gone = memory::reserved(rewiring.removed.len())?;
        gone.extend(
            rewiring
                .removed
                .iter()
                .map(|spring| spring.nodes.map(|node| self.order.caller(node))),
        );
        cuttable.log.reserve(changes, gone.len())?;
        let (known_triangles, new) = split_at(&changes.triangles, first_triangle);
        let mut changed = memory::reserved(known_triangles.len())?;
        changed.extend(
            known_triangles
                .iter()
                .map(|&triangle| (triangle, material.corner_points(triangle))),
        );
        let mut added = memory::reserved(new.len())?;
        added.extend(new.iter().map(|&triangle| material.corner_points(triangle)));
        let change = SurfaceChange {
            changed: &changed,
            added: &added,
            hidden: &changes.undrawn,
        };
        self.reserve_surface(nodes.len(), changed.len(), added.len())?;
        self.pins.reserve(nodes.len(), known + nodes.len())?;
        if let Some(scaling) = &mut self.scaling {
            scaling.reserve(touched.len())?;
        }
        let mut changing = memory::reserved(touched.len())?;
        changing.extend(touched.iter().map(|touched| touched.node));
        let candidates = memory::reserved(touched.len())?;
        let of_pieces = pieces.iter().flat_map(|piece| piece.nodes);
        let mut at_pieces = memory::reserved(4 * pieces.len() + touched.len())?;
        if self.elements.is_some() {
            at_pieces.extend(of_pieces.chain(changing.iter().copied()));
            memory::sort_once(&mut at_pieces);
        }
        if let Some(elements) = &mut self.elements {
            let sums = self.implicit.as_mut().and_then(|implicit| implicit.changes_mut());
            elements.reserve_pieces(&pieces, known + nodes.len(), sums)?;
        }
        if let Some(tears) = &mut self.tears {
            tears.reserve(rewiring.added.len())?;
        }
        self.springs.resize(known + nodes.len())?;
        let rewired = self.rewire(&rewiring, 6 * pieces.len());
        if rewired.is_err() {
            self.springs.resize(known)?;
            return rewired.map(|()| CutReport::default());
        }
        // From here on nothing fails. Damping is to be that of masses as they are.
        self.scale_masses(0.0);
        self.add_nodes(&nodes)?;
        if let Some(elements) = &mut self.elements {
            let sums = self.implicit.as_mut().and_then(|implicit| implicit.changes_mut());
            elements.rewire(&pieces, known + nodes.len(), sums);
        }
        if let Some(tears) = &mut self.tears {
            tears.grow(known + nodes.len());
            tears.follow(changes, &rewiring, &self.order);
        }
        self.rebind(changes);
        self.share_masses(cuttable, changes)?;
        self.follow_elements(&cuttable.material, changes, &at_pieces);
        self.go_on(&touched, &changing, candidates);
        self.change_surface(&change);
        cuttable.search.add_cells(copies.map(|piece| piece.source));
        cuttable.search.see(&cuttable.material, &items, first_item);
        if !changes.is_empty() || !gone.is_empty() {
            cuttable.log.add(changes, &gone);
        }
        self.publish_new(known);
        Ok(CutReport {
            new_nodes: nodes.len() as u32,
            new_triangles: added.len() as u32,
            springs_removed: gone.len() as u32,
            pieces_parted,
            length: 0.5 * changes.rim.iter().map(|edge| edge.length).sum::<f64>(),
            area: changes.faces.iter().map(|face| face.area).sum(),
        })
    }

    /// Remembers where the blade stands in the material.
    fn stop(&self, cuttable: &mut Cuttable, sweep: &Sweep, near: &[u32], changes: &Changes) {
        let Cuttable { stroke, material, .. } = cuttable;
        if stroke.stop(sweep) {
            let positions = self.positions();
            material.ends(changes, sweep, positions, near, |end| {
                stroke.stands_at(end, material, positions)
            });
        }
    }

    /// What becomes of tetrahedra that are elements.
    fn pieces_of_elements(&self, material: &CutMaterial, changes: &Changes) -> Result<Vec<PieceOfElement>> {
        if self.elements.is_none() {
            return Ok(Vec::new());
        }
        let mut pieces = memory::reserved(changes.cells.len())?;
        pieces.extend(changes.cells.iter().map(|piece| PieceOfElement {
            cell: piece.cell,
            source: piece.source,
            nodes: material.nodes_of(piece.cell).map(|node| self.order.own(node)),
            part: piece.part as f32,
        }));
        Ok(pieces)
    }

    /// The new nodes in the order of their numbers.
    fn new_nodes(&self, changes: &Changes) -> Result<Vec<NewNode>> {
        let known = self.node_count() as u32;
        let mut nodes = memory::reserved(changes.nodes.len() + changes.bound.len())?;
        for piece in &changes.nodes {
            if piece.node >= known {
                nodes.push((piece.node, NewNode::Copy(self.order.own(piece.source))));
            }
        }
        for bound in &changes.bound {
            if bound.point >= known {
                nodes.push((bound.point, NewNode::Bound(self.bound(bound))));
            }
        }
        nodes.sort_unstable_by_key(|&(node, _)| node);
        let mut new = memory::reserved(nodes.len())?;
        new.extend(nodes.into_iter().map(|(_, new)| new));
        Ok(new)
    }

    /// Binds points to the copies that move them now.
    fn rebind(&mut self, changes: &Changes) {
        for of in &changes.bound {
            let bound = self.bound(of);
            if let Some(known) = self.bindings.as_mut().and_then(|bindings| bindings.get_mut(of.point)) {
                *known = bound;
            }
        }
    }

    fn bound(&self, bound: &BoundPoint) -> Bound {
        let own = |node: u32| self.order.own(node);
        Bound {
            node: bound.point,
            nodes: bound.nodes.map(own),
            weights: bound.weights.map(|weight| weight as f32),
        }
    }
}

/// Those below a number, and the others, of numbers in order.
fn split_at(numbers: &[u32], first: u32) -> (&[u32], &[u32]) {
    numbers.split_at(numbers.partition_point(|&number| number < first))
}
