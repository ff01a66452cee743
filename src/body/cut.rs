//! A cut: what the blade parted falls apart in everything that a body is moved with.

use super::Body;
use super::change_log::{TopologyChanges, unchanged};
use super::cuttable::Cuttable;
use crate::base::{Error, Result, memory};
use crate::contact::SurfaceChange;
use crate::cutting::{BoundPoint, Changes, CutMaterial, Limits, Sweep};
use crate::deformable_contact::{Skin, SkinChange, SurfaceToBe};
use crate::elements::PieceOfElement;
use crate::forces::Parts;
use crate::nodes::{Bound, NewNode};
use crate::soa::NodeOrder;
use crate::solver::{Changed, System, close_beside};
use crate::springs::{Rewiring, SpringChange};
use crate::terms::Parting;

/// What a cut did.
///
/// ```
/// # use glam::vec3;
/// # use sinew::cutting::Sweep;
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let sheet = world.create_body(&BodyDefinition { spare_nodes: 200, ..cloth })?;
/// # let edge = |z| [vec3(0.003, -0.01, z), vec3(0.003, 0.01, z)];
/// # let across = Sweep { start: edge(-0.06), end: edge(0.06) };
/// let report = world.cut(sheet, &across)?;
/// assert_eq!(report.pieces_parted, 1);
/// // The sheet is 0.1 m wide.
/// assert!((report.length - 0.1).abs() < 1e-3);
/// # Ok::<(), sinew::Error>(())
/// ```
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
    /// A cell in which the cut ends holds: this can be less than what the blade swept.
    pub area: f64,
}

impl Body {
    /// See [`World::cut`](crate::World::cut), which has what is attached follow; its skin follows here, if it meets
    /// tissue. Changes nothing where it fails.
    pub(crate) fn cut(&mut self, sweep: &Sweep, skin: Option<&mut Skin>) -> Result<CutReport> {
        let mut cuttable = self
            .cuttable
            .take()
            .ok_or_else(|| Error::Unsupported("spare_nodes is 0: the body was not made to be cut".into()))?;
        let stroke = cuttable.material.stroke();
        let report = self.cut_from(&mut cuttable, *sweep, skin);
        if report.is_err() {
            cuttable.material.take_back(stroke);
        }
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

    /// What a body is made of that may be cut.
    pub(crate) fn material(&self) -> Option<&CutMaterial> {
        self.cuttable.as_ref().map(|cuttable| &cuttable.material)
    }

    /// How many nodes it may have after cuts and tears: those that it was made with, and [`BodyDefinition::spare_nodes`].
    ///
    /// [`BodyDefinition::spare_nodes`]: crate::BodyDefinition::spare_nodes
    pub fn max_nodes(&self) -> usize {
        self.system.node_room.max(self.node_count())
    }

    /// How many triangles its surface may have after cuts and tears: those that it was made with, and for each of
    /// [`BodyDefinition::spare_nodes`] two, of a solid six. What would take more is [`Error::Capacity`].
    ///
    /// [`BodyDefinition::spare_nodes`]: crate::BodyDefinition::spare_nodes
    pub fn max_triangles(&self) -> usize {
        let of_cuts = self.cuttable.as_ref().map_or(0, |cuttable| cuttable.max_triangles);
        self.surface().len().max(of_cuts as usize)
    }

    /// What a cut or tear may make of it.
    pub(super) fn limits(&self, cuttable: &Cuttable) -> Limits {
        Limits {
            nodes: self.system.node_room as u32,
            triangles: cuttable.max_triangles,
            ..Limits::NONE
        }
    }

    /// Which version its topology has: 0 when it was made.
    pub fn topology_version(&self) -> u64 {
        self.cuttable.as_ref().map_or(0, |cuttable| cuttable.log.version())
    }

    /// The same with what it is cut by, which has another stroke where it fails.
    fn cut_from(&mut self, cuttable: &mut Cuttable, mut sweep: Sweep, skin: Option<&mut Skin>) -> Result<CutReport> {
        if let Some(start) = cuttable.stroke.carried(&sweep, &cuttable.material, self.positions()) {
            sweep.start = start;
            cuttable.material.carry(start);
        }
        let mut near = Vec::new();
        self.items_near(cuttable, &sweep, &mut near)?;
        let limits = self.limits(cuttable);
        let counts = [cuttable.material.triangle_count(), cuttable.material.item_count()];
        let mut changes = cuttable.material.cut(&sweep, self.positions(), &near, limits)?;
        let shared = self.share_by_stiffness(&cuttable.material, &mut changes);
        let room = shared.and_then(|()| cuttable.stroke.reserve(cuttable.material.most_ends(&changes, &near)));
        let applied = room.and_then(|()| self.apply(cuttable, skin, (&sweep, &near), &changes, counts));
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
        skin: Option<&mut Skin>,
        way: (&Sweep, &[u32]),
        changes: &Changes,
        before: [u32; 2],
    ) -> Result<CutReport> {
        let applied = self.try_apply(cuttable, skin, way, changes, before);
        if applied.is_err() {
            self.system.forces.forget_parts();
        }
        applied
    }

    fn try_apply(
        &mut self,
        cuttable: &mut Cuttable,
        mut skin: Option<&mut Skin>,
        (sweep, near): (&Sweep, &[u32]),
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
        let mut closed = None;
        let is_held = |source: u32| self.system.inverse_masses[self.system.order.own(source) as usize] == 0.0;
        if self.system.carry.masses_for > 0.0 || changes.nodes.iter().any(|piece| is_held(piece.source)) {
            // What closes the last step is made with the masses that it was taken with, and gives nothing to copies of what was held.
            if let Some(beside) = close_beside(&mut self.system) {
                let forces = beside.forces(&self.system)?;
                closed = Some((beside, forces));
            }
        }
        let nodes = self.new_nodes(changes)?;
        let parts = self.parts(material, changes, &rewiring)?;
        let touched = self.touched(changes, &rewiring)?;
        let copies = changes.cells.iter().filter(|piece| piece.cell != piece.source);
        let items = material.items_changed(changes)?;
        cuttable.search.reserve(material, copies.clone().count(), &items)?;
        let gone = memory::collected(
            rewiring
                .removed
                .iter()
                .map(|spring| spring.nodes.map(|node| self.system.order.caller(node))),
        )?;
        cuttable.log.reserve(changes, gone.len())?;
        let (known_triangles, new) = split_at(&changes.triangles, first_triangle);
        let changed = memory::collected(
            known_triangles
                .iter()
                .map(|&triangle| (triangle, material.corner_points(triangle))),
        )?;
        let added = memory::collected(new.iter().map(|&triangle| material.corner_points(triangle)))?;
        let change = SurfaceChange {
            changed: &changed,
            added: &added,
            hidden: &changes.undrawn,
        };
        self.reserve_surface(nodes.len(), changed.len(), added.len())?;
        let skin_change = match &mut skin {
            Some(skin) => self.prepare_skin(skin, material, changes, (&change, &nodes))?,
            None => None,
        };
        self.system.pins.reserve(nodes.len(), known + nodes.len())?;
        if let Some(scaling) = &mut self.system.scaling {
            scaling.reserve(touched.len())?;
        }
        let changing = memory::collected(touched.iter().map(|touched| touched.node))?;
        let candidates = memory::reserved(touched.len())?;
        let of_pieces = parts.elements.iter().flat_map(|piece| piece.nodes);
        let mut at_pieces = memory::reserved(4 * parts.elements.len() + touched.len())?;
        if self.system.forces.has_elements() {
            at_pieces.extend(of_pieces.chain(changing.iter().copied()));
            memory::sort_once(&mut at_pieces);
        }
        self.system.forces.prepare_parts(&parts, known + nodes.len())?;
        if let Some(tears) = &mut self.tears {
            tears.reserve(changes.springs.len().max(rewiring.added.len()))?;
        }
        self.system.forces.springs.resize(known + nodes.len())?;
        let rewired = self.system.rewire(&rewiring, 6 * parts.elements.len());
        if rewired.is_err() {
            self.system.forces.springs.resize(known)?;
            return rewired.map(|()| CutReport::default());
        }
        // From here on nothing fails.
        if let Some((beside, forces)) = closed {
            let pins = self.system.pins.iter_mut().zip(forces);
            pins.for_each(|(pin, force)| pin.force = force);
            beside.commit(&mut self.system);
        }
        // Damping is to be that of masses as they are.
        self.system.scale_masses(0.0);
        self.add_nodes(&nodes);
        self.system.forces.take_parts(&parts, known + nodes.len());
        if let Some(tears) = &mut self.tears {
            tears.grow(known + nodes.len());
            tears.follow(changes, &rewiring, &self.system.order);
        }
        self.rebind(changes);
        self.part_rings(&cuttable.material, changes);
        self.share_masses(cuttable, changes)?;
        self.follow_elements(&cuttable.material, changes, &at_pieces);
        self.go_on(&touched, &changing, candidates);
        self.open_cavities(&changed);
        self.change_surface(&change);
        if let (Some(skin), Some(change)) = (skin, skin_change) {
            skin.change(change);
        }
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

    /// Parts the rings of nodes that fell apart.
    fn part_rings(&mut self, material: &CutMaterial, changes: &Changes) {
        let system = &mut self.system;
        let Some(elements) = system.forces.elements_mut() else {
            return;
        };
        for pieces in changes.nodes.chunk_by(|a, b| a.source == b.source) {
            let copies = pieces.iter().map(|piece| system.order.own(piece.node));
            let cells_at = |node: u32| material.tetrahedra_at(system.order.caller(node));
            let source = system.order.own(pieces[0].source);
            elements.part_ring(source, copies, cells_at, system.state.positions());
        }
    }

    /// Opens the cavities of which triangles, given as they are now, had other corners.
    fn open_cavities(&mut self, changed: &[(u32, [u32; 3])]) {
        let System {
            forces, order, surface, ..
        } = &mut self.system;
        let before = changed.iter().filter_map(|&(triangle, mut corners)| {
            let mut before = surface[triangle as usize];
            before.sort_unstable();
            corners.sort_unstable();
            (before != corners).then(|| before.map(|node| order.own(node)))
        });
        if forces.open_cavities(before) {
            // What a step of second order takes from the last, pressure gave.
            self.system.changed(Changed::Course);
        }
    }

    /// Remembers where the blade stands in the material.
    fn stop(&self, cuttable: &mut Cuttable, sweep: &Sweep, near: &[u32], changes: &Changes) {
        let Cuttable { stroke, material, .. } = cuttable;
        if stroke.stop(sweep) {
            let positions = self.positions();
            material.ends(changes, sweep, positions, near, |end| {
                stroke.stands_at(end, material, positions)
            });
            stroke.sort_ends();
        }
    }

    /// What becomes of elements and terms.
    fn parts(&self, material: &CutMaterial, changes: &Changes, rewiring: &Rewiring) -> Result<Parts> {
        let System { forces, order, .. } = &self.system;
        let mut parts = Parts {
            ring_count: changes.nodes.len(),
            ..Parts::default()
        };
        if forces.has_elements() {
            parts.elements = memory::reserved(changes.cells.len())?;
            parts.elements.extend(changes.cells.iter().map(|piece| PieceOfElement {
                cell: piece.cell,
                source: piece.source,
                nodes: material.nodes_of(piece.cell).map(|node| order.own(node)),
                part: piece.part as f32,
            }));
        }
        if forces.beside.terms.is_some() {
            parts.terms = parting(order, material, changes, rewiring)?;
        }
        Ok(parts)
    }

    /// What becomes of its skin.
    fn prepare_skin(
        &self,
        skin: &mut Skin,
        material: &CutMaterial,
        changes: &Changes,
        (change, nodes): (&SurfaceChange, &[NewNode]),
    ) -> Result<Option<SkinChange>> {
        let bared = memory::collected(changes.triangles.iter().map(|&triangle| material.is_bared(triangle)))?;
        let bound = memory::collected(changes.bound.iter().map(|bound| self.bound(bound)))?;
        let to_be = SurfaceToBe {
            change,
            bared: &bared,
            nodes,
            bound: &bound,
            is_open: material.surface().is_some() && !changes.rim.is_empty(),
        };
        skin.prepare(&self.system, &to_be)
    }

    /// The new nodes in the order of their numbers.
    fn new_nodes(&self, changes: &Changes) -> Result<Vec<NewNode>> {
        let known = self.node_count() as u32;
        let mut nodes = memory::reserved(changes.nodes.len() + changes.bound.len())?;
        for piece in &changes.nodes {
            if piece.node >= known {
                nodes.push((piece.node, NewNode::Copy(self.system.order.own(piece.source))));
            }
        }
        for bound in &changes.bound {
            if bound.point >= known {
                nodes.push((bound.point, NewNode::Bound(self.bound(bound))));
            }
        }
        nodes.sort_unstable_by_key(|&(node, _)| node);
        memory::collected(nodes.into_iter().map(|(_, new)| new))
    }

    /// Binds points to the copies that move them now.
    fn rebind(&mut self, changes: &Changes) {
        for of in &changes.bound {
            let bound = self.bound(of);
            let bindings = self.system.bindings.as_mut();
            if let Some(known) = bindings.and_then(|bindings| bindings.get_mut(of.point)) {
                *known = bound;
            }
        }
    }

    fn bound(&self, bound: &BoundPoint) -> Bound {
        let own = |node: u32| self.system.order.own(node);
        Bound {
            node: bound.point,
            nodes: bound.nodes.map(own),
            weights: bound.weights.map(|weight| weight as f32),
        }
    }
}

/// What becomes of what terms are of.
fn parting(order: &NodeOrder, material: &CutMaterial, changes: &Changes, rewiring: &Rewiring) -> Result<Parting> {
    let own = |nodes: [u32; 2]| nodes.map(|node| order.own(node));
    let mut parting = Parting::default();
    for piece in &changes.nodes {
        parting.add_node(order.own(piece.source), order.own(piece.node), piece.part)?;
    }
    for piece in &changes.springs {
        parting.add_spring(own(piece.source), own(piece.nodes), piece.part)?;
    }
    let known = parting.know_springs();
    for spring in &rewiring.removed {
        parting.add_other_spring(spring.nodes, known, 0.0)?;
    }
    for SpringChange { node, before, after } in &rewiring.changed {
        let part = f64::from(after.stiffness) / f64::from(before.stiffness);
        parting.add_other_spring(
            [*node, before.neighbour],
            known,
            if part.is_finite() { part } else { 1.0 },
        )?;
    }
    let sources = parting.know_nodes()?;
    for piece in &changes.cells {
        let nodes = material.nodes_of_cell(piece.cell).iter();
        parting.add_cell(nodes.map(|&node| order.own(node)), piece.part, &sources)?;
    }
    parting.complete()?;
    Ok(parting)
}

/// Those below a number, and the others, of numbers in order.
fn split_at(numbers: &[u32], first: u32) -> (&[u32], &[u32]) {
    numbers.split_at(numbers.partition_point(|&number| number < first))
}
