//! Tears the surface at springs beyond their limits, at the end of a step.

use glam::{DMat3, DVec3};

use super::cut_state::CutState;
use super::{Body, CutReport};
use crate::base::{Error, Result, memory, outer};
use crate::cutting::{CellComplex, CutSurface, VertexLoad};
use crate::def::{TearRefusal, TearReport, Values, check_given};
use crate::deformable_contact::CollisionSurface;
use crate::springs::{Link, pull};
use crate::threads::Team;

/// The outcome of an attempt to tear at a spring.
#[derive(Clone, Copy, Debug)]
pub(crate) enum TearOutcome {
    Made,
    Refused(TearRefusal),
}

fn no_tearing_error() -> Error {
    Error::Unsupported("most_tears is 0: the body was not made to tear".into())
}

impl Body {
    /// Sets tear limits of springs, or of edges of elements, in place of
    /// [`BodyDefinition::tearing`](crate::BodyDefinition::tearing). The limits are a strain, a force in N, or both. 0
    /// means no limit, and `None` leaves a limit unchanged. Edges of elements have a strain limit only. Springs that
    /// are added later have no limits. If a pair occurs more than once, the last entry counts.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: the body was created without tearing. [`Error::InvalidArgument`]: a pair has neither a
    /// spring nor an edge, or a number is missing, negative or not finite. [`Error::OutOfMemory`].
    pub fn set_tear_limits(
        &mut self,
        pairs: &[[u32; 2]],
        strains: Option<Values>,
        forces: Option<Values>,
    ) -> Result<()> {
        check_given([("strain", strains), ("force", forces)], pairs.len())?;
        let springs = self.breakable_links(pairs)?;
        let tear_queue = self.tear_queue.as_mut().ok_or_else(no_tearing_error)?;
        tear_queue.reserve(pairs.len())?;
        for (index, (node, link)) in springs.into_iter().enumerate() {
            let limits = [strains, forces].map(|values| values.map(|values| values.get(index)));
            tear_queue.set([node, link.neighbor], limits, &link);
        }
        Ok(())
    }

    /// The tear limits of springs, or of edges of elements: strain, and force in N. 0 means no limit.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: the body was created without tearing. [`Error::InvalidArgument`]: a pair has neither a
    /// spring nor an edge. [`Error::OutOfMemory`].
    pub fn tear_limits(&self, pairs: &[[u32; 2]]) -> Result<Vec<[f32; 2]>> {
        let springs = self.breakable_links(pairs)?;
        let tear_queue = self.tear_queue.as_ref().ok_or_else(no_tearing_error)?;
        memory::collected(
            springs
                .iter()
                .map(|(node, link)| tear_queue.limits([*node, link.neighbor])),
        )
    }

    fn breakable_links(&self, pairs: &[[u32; 2]]) -> Result<Vec<(u32, Link)>> {
        memory::try_collected((0..pairs.len()).map(|index| self.breakable_link(pairs, index)))
    }

    /// The link between two nodes: that of their spring, or without stiffness that of an edge of elements.
    fn breakable_link(&self, pairs: &[[u32; 2]], index: usize) -> Result<(u32, Link)> {
        let spring_link = self.link_of_pair(pairs, index);
        let (Err(_), Some(tear_queue), Some(cut_state)) = (&spring_link, &self.tear_queue, &self.cut_state) else {
            return spring_link;
        };
        let (callers, solid) = (pairs[index], cut_state.material.solid());
        let nodes_exist = callers.iter().all(|&node| (node as usize) < self.node_count());
        let (Some(solid), true) = (solid, nodes_exist) else {
            return spring_link;
        };
        let nodes = callers.map(|node| self.system.order.own(node));
        if !tear_queue.has_limits(nodes) {
            return spring_link;
        }
        let [a, b] = callers.map(|node| solid.rest(node));
        let [node, neighbor] = [nodes[0].min(nodes[1]), nodes[0].max(nodes[1])];
        Ok((node, Link::slack(neighbor, a.distance(b))))
    }

    /// The tears of the last step, and those that were not made. All 0 for a body that cannot tear.
    pub fn tear_report(&self) -> TearReport {
        self.tear_queue
            .as_ref()
            .map(|tear_queue| tear_queue.report)
            .unwrap_or_default()
    }

    /// Finds the springs to tear, at the end of a step.
    pub(crate) fn find_tears(&mut self, team: &Team) {
        let version = self.topology_version();
        if let Some(mut tear_queue) = self.tear_queue.take() {
            let link = |nodes| self.link(nodes);
            let system = &self.system;
            tear_queue.collect_overloaded(
                system.state.positions(),
                version,
                &system.order,
                link,
                (system.kernel, team),
            );
            self.tear_queue = Some(tear_queue);
        }
    }

    /// The next spring to tear, in internal indices.
    pub(crate) fn next_tear(&mut self) -> Option<[u32; 2]> {
        self.tear_queue.as_mut()?.next()
    }

    /// Tears at a spring: from the end of a cut next to it, or through the node with the larger separating force.
    ///
    /// # Errors
    /// As [`Body::cut`]. An error changes nothing.
    pub(crate) fn tear(&mut self, spring: [u32; 2], skin: Option<&mut CollisionSurface>) -> Result<TearOutcome> {
        let Some(mut cut_state) = self.cut_state.take() else {
            return Ok(TearOutcome::Refused(TearRefusal::NoPath));
        };
        let torn = self.tear_at_spring(&mut cut_state, spring, skin);
        self.cut_state = Some(cut_state);
        torn
    }

    /// Records that a spring was not torn.
    pub(crate) fn refuse_tear(&mut self, spring: [u32; 2], reason: TearRefusal) {
        let version = self.topology_version();
        if let Some(tear_queue) = &mut self.tear_queue {
            tear_queue.refuse(spring, reason, version);
        }
    }

    /// Tears at the first location where it is possible. Otherwise returns the reason.
    fn tear_at_spring(
        &mut self,
        cut_state: &mut CutState,
        spring: [u32; 2],
        mut skin: Option<&mut CollisionSurface>,
    ) -> Result<TearOutcome> {
        let is_solid = cut_state.material.solid().is_some();
        let candidates = if is_solid {
            self.solid_tear_candidates(cut_state, spring)?
        } else {
            self.surface_tear_candidates(cut_state, spring)?
        };
        let mut reason = TearRefusal::NoPath;
        for (candidate, load) in candidates {
            let skin = skin.as_deref_mut();
            let torn = if is_solid {
                self.tear_solid_at(cut_state, candidate, &load, skin)?
            } else {
                self.tear_surface_at(cut_state, candidate, &load, skin)?
            };
            match torn {
                TearOutcome::Made => return Ok(TearOutcome::Made),
                TearOutcome::Refused(TearRefusal::NoPath) => {}
                TearOutcome::Refused(other) => reason = other,
            }
        }
        Ok(TearOutcome::Refused(reason))
    }

    /// The locations where a spring can tear the surface, in the order in which to try them.
    fn surface_tear_candidates(&self, cut_state: &CutState, spring: [u32; 2]) -> Result<Vec<(u32, VertexLoad)>> {
        let Some(surface) = cut_state.material.surface() else {
            return Ok(Vec::new());
        };
        let callers = spring.map(|node| self.system.order.caller(node));
        let is_free = |own: u32| self.system.inverse_masses[own as usize] > 0.0;
        let mut at_nodes = memory::reserved(2)?;
        for (own, node) in spring.into_iter().zip(callers) {
            // Copies of a held node would be held too.
            if is_free(own)
                && let Some(vertex) = surface.vertex_of(node)
                && let Some(load) = surface.load_at(vertex, self.separation_tensor(own), self.positions())?
            {
                at_nodes.push((vertex, load));
            }
        }
        at_nodes.sort_unstable_by(|a, b| b.1.tension.total_cmp(&a.1.tension).then(a.0.cmp(&b.0)));
        let mut candidates = memory::reserved(4)?;
        let other = if spring.into_iter().any(is_free) {
            None
        } else {
            surface.vertex_between(callers, |node| is_free(self.system.order.own(node)))
        };
        for vertex in surface.cut_end_near(callers)?.into_iter().chain(other) {
            let mut forces = DMat3::ZERO;
            for node in surface.nodes_around(vertex)? {
                forces += self.separation_tensor(self.system.order.own(node));
            }
            if let Some(load) = surface.load_at(vertex, forces, self.positions())? {
                candidates.push((vertex, load));
            }
        }
        candidates.extend(at_nodes);
        Ok(candidates)
    }

    fn tear_surface_at(
        &mut self,
        cut_state: &mut CutState,
        vertex: u32,
        load: &VertexLoad,
        skin: Option<&mut CollisionSurface>,
    ) -> Result<TearOutcome> {
        let Some(surface) = cut_state.material.surface() else {
            return Ok(TearOutcome::Refused(TearRefusal::NoPath));
        };
        let Some(tear) = surface.tear(vertex, load, self.positions())? else {
            return Ok(TearOutcome::Refused(TearRefusal::NoPath));
        };
        let mut nodes = memory::reserved(3 * tear.triangles.len())?;
        let cell_nodes = tear.triangles.iter().flat_map(|&triangle| surface.cell_nodes(triangle));
        nodes.extend(cell_nodes.map(|node| self.system.order.own(node)));
        let counts = [cut_state.material.triangle_count(), cut_state.material.item_count()];
        let limits = self.cut_limits(cut_state);
        let changes = cut_state
            .material
            .cut(&tear.sweep, self.positions(), &tear.triangles, limits)?;
        let min_size = self
            .tear_queue
            .as_ref()
            .map_or(0.0, |tear_queue| tear_queue.smallest_piece());
        let reason = match cut_state.material.surface() {
            _ if changes.rim.is_empty() => Ok(Some(TearRefusal::NoPath)),
            Some(surface) if min_size > 0.0 => {
                let is_too_small = surface.has_parted_less(&changes.rim, min_size);
                is_too_small.map(|is_too_small| is_too_small.then_some(TearRefusal::SmallPiece))
            }
            _ => Ok(None),
        };
        let applied = match reason {
            // Springs along no edge can span a triangle.
            Ok(None) => {
                let adjacent = |surface: &CutSurface| surface.adjacent_triangles(&tear.triangles);
                let near = cut_state.material.surface().map_or(Ok(Vec::new()), adjacent);
                near.and_then(|near| self.apply(cut_state, skin, (&tear.path_sweep, &near), &changes, counts))
            }
            Ok(Some(reason)) => {
                cut_state.material.undo();
                return Ok(TearOutcome::Refused(reason));
            }
            Err(error) => Err(error),
        };
        self.finish_tear(cut_state, applied, nodes)
    }

    /// Records a tear that was applied, or undoes its cut.
    pub(super) fn finish_tear(
        &mut self,
        cut_state: &mut CutState,
        applied: Result<CutReport>,
        nodes: Vec<u32>,
    ) -> Result<TearOutcome> {
        match applied {
            Ok(CutReport { pieces_parted, .. }) => {
                if let Some(tear_queue) = &mut self.tear_queue {
                    tear_queue.record_tear(pieces_parted, nodes.into_iter());
                }
                Ok(TearOutcome::Made)
            }
            Err(error) => {
                cut_state.material.undo();
                Err(error)
            }
        }
    }

    /// The separation tensor of a node from its springs, N (O'Brien, Hodgins 1999, equation 13).
    fn separation_tensor(&self, node: u32) -> DMat3 {
        let positions = self.system.state.positions();
        let here = positions.get(node as usize);
        let mut sums = [DVec3::ZERO; 2];
        let mut tensors = [DMat3::ZERO; 2];
        self.system.forces.springs.visit(node as usize, &mut |link| {
            let offset = positions.get(link.neighbor as usize) - here;
            let force = pull(node as usize, &link, offset, None).as_dvec3();
            let is_compressed = usize::from(force.dot(offset.as_dvec3()) < 0.0);
            sums[is_compressed] += force;
            tensors[is_compressed] += uniaxial_tensor(force);
        });
        let [tension, compression] = [0, 1].map(|kind| tensors[kind] - uniaxial_tensor(sums[kind]));
        0.5 * (tension - compression)
    }
}

/// The matrix whose eigenvector is the vector, with its length as eigenvalue. The other eigenvalues are 0.
fn uniaxial_tensor(vector: DVec3) -> DMat3 {
    let length = vector.length();
    if length > 0.0 {
        outer(vector, vector) * (1.0 / length)
    } else {
        DMat3::ZERO
    }
}
