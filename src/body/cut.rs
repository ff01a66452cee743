//! Applies a cut to a body: springs, elements, masses, pins and the surface follow the new topology.

use super::Body;
use super::change_log::{TopologyChanges, unchanged};
use super::cut_state::CutState;
use crate::base::{Error, Result, memory};
use crate::contact::SurfaceChange;
use crate::cutting::{BoundPoint, Changes, CutMaterial, Limits, Sweep};
use crate::deformable_contact::{CollisionSurface, NewCollisionSurface, PreparedSurfaceChange};
use crate::elements::ElementPiece;
use crate::forces::ForcePieces;
use crate::nodes::{NewNode, NodeBinding};
use crate::soa::NodeOrder;
use crate::solver::{Changed, System, preview_flush};
use crate::springs::{Rewiring, SpringChange};
use crate::terms::TermPieces;

/// The result of a cut.
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
    /// The number of new nodes: copies of nodes, and points of the surface that are bound to nodes.
    pub new_nodes: u32,
    /// The number of new triangles of the surface.
    pub new_triangles: u32,
    /// The number of springs that were removed by the blade or replaced by springs of copies.
    pub springs_removed: u32,
    /// The number of connected components that the surface has gained.
    pub pieces_parted: u32,
    /// The length of the cut in the rest shape, m; for solids, along their skin.
    pub length: f64,
    /// For solids, the area of the faces that opened, in the rest shape, counted on one side, m². A cell in which the
    /// cut ends does not open, so the area can be less than the blade swept.
    pub area: f64,
}

impl Body {
    /// Cuts the body: see [`World::cut`](crate::World::cut), which updates attachments. The skin is updated here, if
    /// the body collides with tissue. An error leaves everything unchanged.
    pub(crate) fn cut(&mut self, sweep: &Sweep, skin: Option<&mut CollisionSurface>) -> Result<CutReport> {
        let mut cut_state = self
            .cut_state
            .take()
            .ok_or_else(|| Error::Unsupported("spare_nodes is 0: the body was not made to be cut".into()))?;
        let stroke = cut_state.material.stroke();
        let report = self.cut_material(&mut cut_state, *sweep, skin);
        if report.is_err() {
            cut_state.material.restore_stroke(stroke);
        }
        self.cut_state = Some(cut_state);
        report
    }

    /// The changes since a version of the topology, for renderers. Version 0 is that of the new body.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the topology has not reached this version.
    pub fn changes_since(&self, version: u64) -> Result<TopologyChanges<'_>> {
        match &self.cut_state {
            Some(cut_state) => cut_state.log.since(version),
            None => unchanged(version),
        }
    }

    /// For each triangle of the surface, true if a cut exposed it. Empty if the body cannot be cut.
    pub(crate) fn exposed(&self) -> impl Iterator<Item = bool> {
        let material = self.cut_state.as_ref().map(|cut_state| &cut_state.material);
        material.into_iter().flat_map(CutMaterial::exposed)
    }

    /// The material, if the body can be cut.
    pub(crate) fn material(&self) -> Option<&CutMaterial> {
        self.cut_state.as_ref().map(|cut_state| &cut_state.material)
    }

    /// The maximum number of nodes after cuts and tears: the nodes at creation plus [`BodyDefinition::spare_nodes`].
    ///
    /// [`BodyDefinition::spare_nodes`]: crate::BodyDefinition::spare_nodes
    pub fn max_nodes(&self) -> usize {
        self.system.node_capacity.max(self.node_count())
    }

    /// The maximum number of triangles of the surface after cuts and tears: the triangles at creation plus two for each
    /// of [`BodyDefinition::spare_nodes`], for a solid six. A cut that needs more fails with [`Error::Capacity`].
    ///
    /// [`BodyDefinition::spare_nodes`]: crate::BodyDefinition::spare_nodes
    pub fn max_triangles(&self) -> usize {
        let limit = self.cut_state.as_ref().map_or(0, |cut_state| cut_state.max_triangles);
        self.surface().len().max(limit as usize)
    }

    /// The limits of what a cut or tear may add.
    pub(super) fn cut_limits(&self, cut_state: &CutState) -> Limits {
        Limits {
            nodes: self.system.node_capacity as u32,
            triangles: cut_state.max_triangles,
            ..Limits::NONE
        }
    }

    /// The version of the topology. A new body has version 0.
    pub fn topology_version(&self) -> u64 {
        self.cut_state.as_ref().map_or(0, |cut_state| cut_state.log.version())
    }

    /// Cuts with a material whose stroke differs after an error.
    fn cut_material(
        &mut self,
        cut_state: &mut CutState,
        mut sweep: Sweep,
        skin: Option<&mut CollisionSurface>,
    ) -> Result<CutReport> {
        if let Some(start) = cut_state
            .stroke
            .carried_edge(&sweep, &cut_state.material, self.positions())
        {
            sweep.start = start;
            cut_state.material.set_edge(start);
        }
        let mut near = Vec::new();
        self.items_near_sweep(cut_state, &sweep, &mut near)?;
        let limits = self.cut_limits(cut_state);
        let counts = [cut_state.material.triangle_count(), cut_state.material.item_count()];
        let mut changes = cut_state.material.cut(&sweep, self.positions(), &near, limits)?;
        let shared_mass = self.shift_mass_by_stiffness(&cut_state.material, &mut changes);
        let room = shared_mass.and_then(|()| cut_state.stroke.reserve(cut_state.material.max_ends(&changes, &near)));
        let result = room.and_then(|()| self.apply(cut_state, skin, (&sweep, &near), &changes, counts));
        match result {
            Ok(_) => self.end_stroke(cut_state, &sweep, &near, &changes),
            Err(_) => cut_state.material.undo(),
        }
        result
    }

    /// Applies changes, given the numbers of triangles and of items before them. An error leaves the body unchanged.
    pub(super) fn apply(
        &mut self,
        cut_state: &mut CutState,
        skin: Option<&mut CollisionSurface>,
        swept: (&Sweep, &[u32]),
        changes: &Changes,
        before: [u32; 2],
    ) -> Result<CutReport> {
        let result = self.try_apply(cut_state, skin, swept, changes, before);
        if result.is_err() {
            self.system.forces.discard_cut();
        }
        result
    }

    fn try_apply(
        &mut self,
        cut_state: &mut CutState,
        mut skin: Option<&mut CollisionSurface>,
        (sweep, near): (&Sweep, &[u32]),
        changes: &Changes,
        [first_triangle, first_item]: [u32; 2],
    ) -> Result<CutReport> {
        let material = &cut_state.material;
        let node_count_before = self.node_count();
        // Everything that can fail comes first.
        let pieces_parted = material.parted(changes, usize::MAX)?.unwrap_or(0);
        let mut rewiring = self.rewiring(changes)?;
        if !cut_state.springs_are_edges {
            self.rewire_non_edges(material, sweep, near, changes, &mut rewiring)?;
        }
        if changes.is_empty() && rewiring.is_empty() {
            return Ok(CutReport::default());
        }
        let mut half_kick = None;
        let is_held = |source: u32| self.system.inverse_masses[self.system.order.own(source) as usize] == 0.0;
        if self.system.carry.scaling_substep > 0.0 || changes.nodes.iter().any(|piece| is_held(piece.source)) {
            // The last step is closed with the masses that it was taken with. It gives nothing to copies of held nodes.
            if let Some(flushed) = preview_flush(&mut self.system) {
                let forces = flushed.forces(&self.system)?;
                half_kick = Some((flushed, forces));
            }
        }
        let nodes = self.new_nodes(changes)?;
        let force_changes = self.force_changes(material, changes, &rewiring)?;
        let affected = self.affected_nodes(changes, &rewiring)?;
        let cell_copies = changes.cells.iter().filter(|piece| piece.cell != piece.source);
        let items = material.items_changed(changes)?;
        cut_state
            .search
            .reserve(material, cell_copies.clone().count(), &items)?;
        let removed_springs = memory::collected(
            rewiring
                .removed
                .iter()
                .map(|spring| spring.nodes.map(|node| self.system.order.caller(node))),
        )?;
        cut_state.log.reserve(changes, removed_springs.len())?;
        let (old_triangles, new) = split_at(&changes.triangles, first_triangle);
        let changed = memory::collected(
            old_triangles
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
        self.system.pins.reserve(nodes.len(), node_count_before + nodes.len())?;
        if let Some(scaling) = &mut self.system.scaling {
            scaling.reserve(affected.len())?;
        }
        let affected_indices = memory::collected(affected.iter().map(|affected| affected.node))?;
        let candidates = memory::reserved(affected.len())?;
        let piece_nodes = force_changes.elements.iter().flat_map(|piece| piece.nodes);
        let mut element_nodes = memory::reserved(4 * force_changes.elements.len() + affected.len())?;
        if self.system.forces.has_elements() {
            element_nodes.extend(piece_nodes.chain(affected_indices.iter().copied()));
            memory::sort_once(&mut element_nodes);
        }
        self.system
            .forces
            .prepare_cut(&force_changes, node_count_before + nodes.len())?;
        if let Some(tear_queue) = &mut self.tear_queue {
            tear_queue.reserve(changes.springs.len().max(rewiring.added.len()))?;
        }
        self.system.forces.springs.resize(node_count_before + nodes.len())?;
        let rewired = self.system.rewire(&rewiring, 6 * force_changes.elements.len());
        if rewired.is_err() {
            self.system.forces.springs.resize(node_count_before)?;
            return rewired.map(|()| CutReport::default());
        }
        // Nothing fails from here on.
        if let Some((flushed, forces)) = half_kick {
            let pins = self.system.pins.iter_mut().zip(forces);
            pins.for_each(|(pin, force)| pin.force = force);
            flushed.commit(&mut self.system);
        }
        // Damping is computed from the masses without scaling.
        self.system.scale_masses(0.0);
        self.add_nodes(&nodes);
        self.system
            .forces
            .apply_cut(&force_changes, node_count_before + nodes.len());
        if let Some(tear_queue) = &mut self.tear_queue {
            tear_queue.resize_nodes(node_count_before + nodes.len());
            tear_queue.apply_cut(changes, &rewiring, &self.system.order);
        }
        self.rebind_points(changes);
        self.separate_nodal_pressures(&cut_state.material, changes);
        self.distribute_masses(cut_state, changes)?;
        self.update_elements(&cut_state.material, changes, &element_nodes);
        self.finish_cut(&affected, &affected_indices, candidates);
        self.open_cavities(&changed);
        self.change_surface(&change);
        if let (Some(skin), Some(change)) = (skin, skin_change) {
            skin.apply_change(change);
        }
        cut_state.search.add_cells(cell_copies.map(|piece| piece.source));
        cut_state.search.update_items(&cut_state.material, &items, first_item);
        if !changes.is_empty() || !removed_springs.is_empty() {
            cut_state.log.add(changes, &removed_springs);
        }
        self.publish_new_nodes(node_count_before);
        Ok(CutReport {
            new_nodes: nodes.len() as u32,
            new_triangles: added.len() as u32,
            springs_removed: removed_springs.len() as u32,
            pieces_parted,
            length: 0.5 * changes.rim.iter().map(|edge| edge.length).sum::<f64>(),
            area: changes.faces.iter().map(|face| face.area).sum(),
        })
    }

    /// Separates the nodal pressures of the copies of each node.
    fn separate_nodal_pressures(&mut self, material: &CutMaterial, changes: &Changes) {
        let system = &mut self.system;
        let Some(elements) = system.forces.elements_mut() else {
            return;
        };
        for pieces in changes.nodes.chunk_by(|a, b| a.source == b.source) {
            let node_copies = pieces.iter().map(|piece| system.order.own(piece.node));
            let cells_at = |node: u32| material.tetrahedra_at(system.order.caller(node));
            let source = system.order.own(pieces[0].source);
            elements.split_nodal_volume(source, node_copies, cells_at, system.state.positions());
        }
    }

    /// Opens the cavities that had other triangles, given the triangles as they are now.
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
            // A second-order step extrapolates from the last one, in which the pressure acted.
            self.system.changed(Changed::Trajectory);
        }
    }

    /// Stores where the blade stopped in the material.
    fn end_stroke(&self, cut_state: &mut CutState, sweep: &Sweep, near: &[u32], changes: &Changes) {
        let CutState { stroke, material, .. } = cut_state;
        if stroke.end_sweep(sweep) {
            let positions = self.positions();
            material.visit_ends(changes, sweep, positions, near, |end| {
                stroke.add_end(end, material, positions)
            });
            stroke.sort_ends();
        }
    }

    /// The changes of elements and terms.
    fn force_changes(&self, material: &CutMaterial, changes: &Changes, rewiring: &Rewiring) -> Result<ForcePieces> {
        let System { forces, order, .. } = &self.system;
        let mut force_changes = ForcePieces {
            ring_count: changes.nodes.len(),
            ..ForcePieces::default()
        };
        if forces.has_elements() {
            force_changes.elements = memory::reserved(changes.cells.len())?;
            force_changes
                .elements
                .extend(changes.cells.iter().map(|piece| ElementPiece {
                    cell: piece.cell,
                    source: piece.source,
                    nodes: material.nodes_of(piece.cell).map(|node| order.own(node)),
                    part: piece.part as f32,
                }));
        }
        if forces.auxiliary.terms.is_some() {
            force_changes.terms = term_changes(order, material, changes, rewiring)?;
        }
        Ok(force_changes)
    }

    /// The change of the skin.
    fn prepare_skin(
        &self,
        skin: &mut CollisionSurface,
        material: &CutMaterial,
        changes: &Changes,
        (change, nodes): (&SurfaceChange, &[NewNode]),
    ) -> Result<Option<PreparedSurfaceChange>> {
        let exposed = memory::collected(changes.triangles.iter().map(|&triangle| material.is_exposed(triangle)))?;
        let bindings = memory::collected(changes.bound.iter().map(|binding| self.binding(binding)))?;
        let to_be = NewCollisionSurface {
            change,
            exposed: &exposed,
            nodes,
            bound: &bindings,
            is_open: material.surface().is_some() && !changes.rim.is_empty(),
        };
        skin.prepare(&self.system, &to_be)
    }

    /// The new nodes in the order of their indices.
    fn new_nodes(&self, changes: &Changes) -> Result<Vec<NewNode>> {
        let node_count_before = self.node_count() as u32;
        let mut nodes = memory::reserved(changes.nodes.len() + changes.bound.len())?;
        for piece in &changes.nodes {
            if piece.node >= node_count_before {
                nodes.push((piece.node, NewNode::Copy(self.system.order.own(piece.source))));
            }
        }
        for binding in &changes.bound {
            if binding.point >= node_count_before {
                nodes.push((binding.point, NewNode::Bound(self.binding(binding))));
            }
        }
        nodes.sort_unstable_by_key(|&(node, _)| node);
        memory::collected(nodes.into_iter().map(|(_, new)| new))
    }

    /// Binds points of the surface to the copies that move them now.
    fn rebind_points(&mut self, changes: &Changes) {
        for point in &changes.bound {
            let binding = self.binding(point);
            let bindings = self.system.bindings.as_mut();
            if let Some(current) = bindings.and_then(|bindings| bindings.get_mut(point.point)) {
                *current = binding;
            }
        }
    }

    fn binding(&self, binding: &BoundPoint) -> NodeBinding {
        let own = |node: u32| self.system.order.own(node);
        NodeBinding {
            node: binding.point,
            nodes: binding.nodes.map(own),
            weights: binding.weights.map(|weight| weight as f32),
        }
    }
}

/// The changes of the nodes, springs and cells that terms depend on.
fn term_changes(
    order: &NodeOrder,
    material: &CutMaterial,
    changes: &Changes,
    rewiring: &Rewiring,
) -> Result<TermPieces> {
    let own = |nodes: [u32; 2]| nodes.map(|node| order.own(node));
    let mut term_changes = TermPieces::default();
    for piece in &changes.nodes {
        term_changes.add_node(order.own(piece.source), order.own(piece.node), piece.part)?;
    }
    for piece in &changes.springs {
        term_changes.add_spring(own(piece.source), own(piece.nodes), piece.part)?;
    }
    let listed = term_changes.sort_springs();
    for spring in &rewiring.removed {
        term_changes.add_other_spring(spring.nodes, listed, 0.0)?;
    }
    for SpringChange { node, before, after } in &rewiring.changed {
        let part = f64::from(after.stiffness) / f64::from(before.stiffness);
        term_changes.add_other_spring(
            [*node, before.neighbor],
            listed,
            if part.is_finite() { part } else { 1.0 },
        )?;
    }
    let sources = term_changes.sorted_nodes()?;
    for piece in &changes.cells {
        let nodes = material.nodes_of_cell(piece.cell).iter();
        term_changes.add_cell(nodes.map(|&node| order.own(node)), piece.part, &sources)?;
    }
    term_changes.complete()?;
    Ok(term_changes)
}

/// Splits sorted indices into those below an index and the others.
fn split_at(numbers: &[u32], first: u32) -> (&[u32], &[u32]) {
    numbers.split_at(numbers.partition_point(|&number| number < first))
}
