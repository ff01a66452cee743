//! A cut: what the blade parted falls apart in everything that a body is moved with.

use glam::{BVec3, DVec3, Vec3};

use super::change_log::{TopologyChanges, unchanged};
use super::cuttable::{Cuttable, passes};
use super::{Body, Bound, NewNode, SMALLEST_MASS, Spring};
use crate::contact::SurfaceChange;
use crate::cutting::{BoundPoint, Changes, CutMaterial, Limits, PieceOfSpring, Sweep};
use crate::elements::PieceOfElement;
use crate::error::{Error, Result};
use crate::memory;
use crate::solver::{Candidate, Masses, close, make_up_for};
use crate::springs::{Change, Link, Rewiring, pull};

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

/// A node whose springs or mass a cut changes.
struct Touched {
    /// In its own number.
    node: u32,
    source: u32,
    /// Its part of the mass that it, or its source, had.
    part: f32,
    /// What springs did to its source, N.
    before: Vec3,
}

impl Body {
    /// Cuts the surface where a blade's edge passed since the last step, while nodes are where they are: see [`CutSurface::cut`] for what
    /// is drawn then. What is simulated stays as well shaped as it was: triangles that fell apart are copied for each of their pieces, with nodes that
    /// are not drawn where their material is beyond the cut, and with their parts of masses and stiffnesses (Molino, Bao, Fedkiw 2004). Springs
    /// along no edge of a triangle are taken away where the blade passed through them.
    ///
    /// Velocities and places stay what they were, and with them momentum and energy. A node that is held stays held where it is drawn; copies of it
    /// beyond the cut are free, and have the mass that their material has in the mean where it had none.
    ///
    /// [`CutSurface::cut`]: crate::cutting::CutSurface::cut
    ///
    /// # Errors
    /// [`Error::Unsupported`]: the body was made without [`BodyDefinition::spare_nodes`](crate::BodyDefinition::spare_nodes).
    /// [`Error::InvalidArgument`]: an end of the blade is not finite. [`Error::Capacity`]: there are not as many spare nodes left, or a node has no
    /// free place in a row of fixed length. [`Error::OutOfMemory`]. Then nothing has changed.
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

    /// Changes springs, of which there are nodes already, and what a solver knows of them and so many pairs of nodes of elements more. Changes
    /// nothing where it fails.
    pub(super) fn rewire(&mut self, rewiring: &Rewiring, pairs: usize) -> Result<()> {
        let beside = (self.terms.as_deref(), self.enclosed.as_deref());
        let roomier = match &self.implicit {
            Some(implicit) => {
                let more = rewiring.added.len() + pairs;
                implicit.roomier(&*self.springs, more, self.elements.as_deref(), beside)?
            }
            None => None,
        };
        self.springs.rewire(rewiring)?;
        if let (Some(implicit), Some(roomier)) = (&mut self.implicit, roomier) {
            implicit.adopt(roomier);
        }
        Ok(())
    }

    /// What becomes of springs along edges of cells.
    fn rewiring(&self, changes: &Changes) -> Result<Rewiring> {
        let mut rewiring = Rewiring::default();
        let own = |nodes: [u32; 2]| nodes.map(|node| self.order.own(node));
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
            for piece in pieces.iter().filter(|piece| !is_source(piece)) {
                memory::push(&mut rewiring.added, spring_of(own(piece.nodes), &link, piece.part))?;
            }
        }
        Ok(rewiring)
    }

    /// Springs along no edge of a cell: those that the blade passed through go, and those of nodes that fell apart become as much softer as
    /// the lighter of their nodes becomes lighter.
    fn take_away(
        &self,
        material: &CutMaterial,
        sweep: &Sweep,
        near: &[u32],
        changes: &Changes,
        rewiring: &mut Rewiring,
    ) -> Result<()> {
        let mut nodes = memory::reserved(4 * near.len())?;
        for &item in near {
            nodes.extend(material.nodes_of(item).map(|node| self.order.own(node)));
        }
        // New ones have no springs yet.
        let known = self.node_count() as u32;
        nodes.retain(|&node| node < known);
        let parted = changes.nodes.iter().filter(|piece| piece.node == piece.source);
        let mut parts = memory::reserved(changes.nodes.len())?;
        parts.extend(parted.map(|piece| (self.order.own(piece.node), piece.part)));
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
            self.springs.visit(node as usize, &mut |link| {
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
            let callers = ends.map(|node| self.order.caller(node));
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

    /// All nodes whose springs or mass are to change, in order, with what springs do to them now.
    fn touched(&self, changes: &Changes, rewiring: &Rewiring) -> Result<Vec<Touched>> {
        let known = self.node_count() as u32;
        let mut touched: Vec<Touched> = Vec::new();
        for piece in &changes.nodes {
            memory::push(
                &mut touched,
                Touched {
                    node: self.order.own(piece.node),
                    source: self.order.own(piece.source),
                    part: piece.part as f32,
                    before: Vec3::ZERO,
                },
            )?;
        }
        let changed = rewiring
            .changed
            .iter()
            .flat_map(|change| [change.node, change.before.neighbour]);
        let ends = rewiring.removed.iter().flat_map(|spring| spring.nodes).chain(changed);
        let added = rewiring.added.iter().flat_map(|spring| spring.nodes);
        for node in ends.chain(added.filter(|&node| node < known)) {
            let (source, part, before) = (node, 1.0, Vec3::ZERO);
            memory::push(
                &mut touched,
                Touched {
                    node,
                    source,
                    part,
                    before,
                },
            )?;
        }
        // Of a node that fell apart what is known of that comes first.
        touched.sort_unstable_by(|a, b| a.node.cmp(&b.node).then(a.part.total_cmp(&b.part)));
        touched.dedup_by_key(|touched| touched.node);
        for touched in &mut touched {
            touched.before = self.spring_force(touched.source);
        }
        Ok(touched)
    }

    /// What springs do to a node where it is, but for their damping, N; nothing where nobody asks.
    fn spring_force(&self, node: u32) -> Vec3 {
        let mut force = Vec3::ZERO;
        if self.carry.closing.is_some() {
            let positions = self.state.positions();
            let here = positions.get(node as usize);
            self.springs.visit(node as usize, &mut |link| {
                force += pull(
                    node as usize,
                    &link,
                    positions.get(link.neighbour as usize) - here,
                    None,
                );
            });
        }
        force
    }

    /// Gives nodes that fell apart their parts of the mass, and holds copies of held nodes that are drawn.
    fn share_masses(&mut self, cuttable: &Cuttable, changes: &Changes) -> Result<()> {
        for pieces in changes.nodes.chunk_by(|a, b| a.source == b.source) {
            let source = self.order.own(pieces[0].source);
            let whole = f64::from(self.masses[source as usize]);
            // Of what a tool holds no copies are held.
            let axes = if self.is_held_by_tool(source) {
                BVec3::FALSE
            } else {
                self.pins.axes_of(source)
            };
            let is_held = self.inverse_masses[source as usize] == 0.0;
            for piece in pieces {
                let node = self.order.own(piece.node);
                let is_drawn = changes.undrawn.binary_search(&piece.node).is_err();
                let is_copy = piece.node != piece.source;
                let mass = if whole > 0.0 {
                    whole * piece.part
                } else if is_drawn {
                    0.0
                } else {
                    cuttable.density * cuttable.material.share_at(piece.node)
                } as f32;
                let mass = if mass > 0.0 { mass.max(SMALLEST_MASS) } else { mass };
                if is_copy && is_drawn && axes.any() {
                    let target = self.pins.get(source).and_then(|pin| pin.target);
                    self.pins.hold(node, axes)?;
                    if let Some(pin) = self.pins.get_mut(node) {
                        pin.target = target;
                    }
                } else if mass == 0.0 {
                    self.pins.hold(node, BVec3::TRUE)?;
                }
                let stays_held = mass == 0.0
                    || if is_copy {
                        is_drawn && axes == BVec3::TRUE
                    } else {
                        is_held
                    };
                self.masses[node as usize] = mass;
                self.inverse_masses[node as usize] = if stays_held { 0.0 } else { 1.0 / mass };
            }
        }
        Ok(())
    }

    /// The same for elements, at all nodes of pieces and all others of which masses or springs have changed.
    fn follow_elements(&mut self, material: &CutMaterial, changes: &Changes, nodes: &[u32]) {
        let Some(elements) = &mut self.elements else {
            return;
        };
        let order = &self.order;
        let masses = Masses {
            masses: &self.masses,
            inverse_masses: &self.inverse_masses,
        };
        let cells_at = |node: u32| material.tetrahedra_at(order.caller(node));
        elements.find_rates_at(nodes, cells_at, &*self.springs, &masses);
        if self.carry.closing.is_none() {
            return;
        }
        for pieces in changes.nodes.chunk_by(|a, b| a.source == b.source) {
            let force_on = |body: &Self, node: u32| {
                let cells = material.tetrahedra_at(node);
                let elements = body.elements.as_ref();
                elements.map_or(DVec3::ZERO, |elements| {
                    elements.force_at(body.order.own(node), cells, body.state.positions())
                })
            };
            let whole: DVec3 = pieces.iter().map(|piece| force_on(self, piece.node)).sum();
            for piece in pieces {
                let more = whole * piece.part - force_on(self, piece.node);
                make_up_for(self, self.order.own(piece.node), more.as_vec3());
            }
        }
    }

    /// Has nodes go on after their springs and masses have changed: closing the last step gives them what it would have given.
    fn go_on(&mut self, touched: &[Touched], nodes: &[u32], candidates: Vec<Candidate>) {
        self.forces_current = false;
        self.published.forget_velocities();
        self.scale_for_springs(nodes);
        for touched in touched {
            let force = self.spring_force(touched.node);
            make_up_for(self, touched.node, touched.before * touched.part - force);
        }
        self.follow_nodes();
        let masses = Masses {
            masses: &self.masses,
            inverse_masses: &self.inverse_masses,
        };
        let watched = (&mut self.watched, candidates);
        let positions = self.state.positions();
        self.carry.stability = self
            .carry
            .stability
            .cut(nodes, &*self.springs, masses, positions, watched);
        if let Some(implicit) = &mut self.implicit {
            implicit.forget_matrix();
        }
    }
}

/// Those below a number, and the others, of numbers in order.
fn split_at(numbers: &[u32], first: u32) -> (&[u32], &[u32]) {
    numbers.split_at(numbers.partition_point(|&number| number < first))
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

fn part_of(node: u32, link: Link, part: f64) -> Change {
    Change {
        node,
        before: link,
        after: Link {
            stiffness: (f64::from(link.stiffness) * part) as f32,
            damping: (f64::from(link.damping) * part) as f32,
            ..link
        },
    }
}
