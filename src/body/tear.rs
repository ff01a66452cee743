//! Tears: springs beyond what they bear tear the surface at the end of a step.

use glam::{DMat3, DVec3};

use super::cuttable::Cuttable;
use super::{Body, CutReport};
use crate::base::{Error, Result, memory, outer};
use crate::cutting::{CutSurface, Divided, VertexLoad};
use crate::def::{TearReport, Values, Withheld, check_given};
use crate::deformable_contact::Skin;
use crate::springs::{Link, pull};
use crate::threads::Team;

/// What became of a spring that was to tear.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Torn {
    Made,
    Not(Withheld),
}

fn not_made_to_tear() -> Error {
    Error::Unsupported("most_tears is 0: the body was not made to tear".into())
}

impl Body {
    /// Gives the springs of these pairs of nodes, or edges of elements, which bear a strain alone, other limits than [`BodyDefinition::tearing`](crate::BodyDefinition::tearing): a strain, a
    /// force in N, or both; 0: any; `None` leaves them. Springs that are added later have none until they are given some. Of a pair that is
    /// named more than once the last counts.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: the body was made not to tear. [`Error::InvalidArgument`]: a pair has neither, or a number is missing, negative
    /// or not finite. [`Error::OutOfMemory`].
    pub fn set_tear_limits(
        &mut self,
        pairs: &[[u32; 2]],
        strains: Option<Values>,
        forces: Option<Values>,
    ) -> Result<()> {
        check_given([("strain", strains), ("force", forces)], pairs.len())?;
        let springs = self.borne_by_pairs(pairs)?;
        let tears = self.tears.as_mut().ok_or_else(not_made_to_tear)?;
        tears.reserve(pairs.len())?;
        for (index, (node, link)) in springs.into_iter().enumerate() {
            let limits = [strains, forces].map(|values| values.map(|values| values.get(index)));
            tears.set([node, link.neighbour], limits, &link);
        }
        Ok(())
    }

    /// The limits of the springs of these pairs of nodes, or edges of elements, strain and force in N; 0: any.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: the body was made not to tear. [`Error::InvalidArgument`]: a pair has neither. [`Error::OutOfMemory`].
    pub fn tear_limits(&self, pairs: &[[u32; 2]]) -> Result<Vec<[f32; 2]>> {
        let springs = self.borne_by_pairs(pairs)?;
        let tears = self.tears.as_ref().ok_or_else(not_made_to_tear)?;
        memory::collected(springs.iter().map(|(node, link)| tears.limits([*node, link.neighbour])))
    }

    fn borne_by_pairs(&self, pairs: &[[u32; 2]]) -> Result<Vec<(u32, Link)>> {
        memory::try_collected((0..pairs.len()).map(|index| self.borne_by_pair(pairs, index)))
    }

    /// What the first of two nodes sees of their spring, or of an edge of elements, which bears a strain alone.
    fn borne_by_pair(&self, pairs: &[[u32; 2]], index: usize) -> Result<(u32, Link)> {
        let found = self.link_of_pair(pairs, index);
        let (Err(_), Some(tears), Some(cuttable)) = (&found, &self.tears, &self.cuttable) else {
            return found;
        };
        let (callers, solid) = (pairs[index], cuttable.material.solid());
        let is_known = callers.iter().all(|&node| (node as usize) < self.node_count());
        let (Some(solid), true) = (solid, is_known) else {
            return found;
        };
        let nodes = callers.map(|node| self.system.order.own(node));
        if !tears.watches(nodes) {
            return found;
        }
        let [a, b] = callers.map(|node| solid.rest(node));
        let [node, neighbour] = [nodes[0].min(nodes[1]), nodes[0].max(nodes[1])];
        Ok((node, Link::slack(neighbour, a.distance(b))))
    }

    /// What tore in the last step, and what did not; all 0 of a body that does not tear.
    pub fn tear_report(&self) -> TearReport {
        self.tears.as_ref().map(|tears| tears.report).unwrap_or_default()
    }

    /// A step has ended: finds the springs that are to tear.
    pub(crate) fn find_tears(&mut self, team: &Team) {
        let version = self.topology_version();
        if let Some(mut tears) = self.tears.take() {
            let link = |nodes| self.link(nodes);
            let system = &self.system;
            tears.begin(
                system.state.positions(),
                version,
                &system.order,
                link,
                (system.kernel, team),
            );
            self.tears = Some(tears);
        }
    }

    /// The next of them, in its own numbers.
    pub(crate) fn next_tear(&mut self) -> Option<[u32; 2]> {
        self.tears.as_mut()?.next()
    }

    /// Tears at a spring: from the end of a cut next to it, or else through that of its nodes which is pulled apart with the larger force.
    ///
    /// # Errors
    /// As [`Body::cut`]. Then nothing has changed.
    pub(crate) fn tear(&mut self, spring: [u32; 2], skin: Option<&mut Skin>) -> Result<Torn> {
        let Some(mut cuttable) = self.cuttable.take() else {
            return Ok(Torn::Not(Withheld::NoWay));
        };
        let torn = self.tear_with(&mut cuttable, spring, skin);
        self.cuttable = Some(cuttable);
        torn
    }

    /// A spring was to tear, but could not.
    pub(crate) fn withhold_tear(&mut self, spring: [u32; 2], why: Withheld) {
        let version = self.topology_version();
        if let Some(tears) = &mut self.tears {
            tears.withhold(spring, why, version);
        }
    }

    /// Tears at the first of some places where that can be done; else says why it cannot.
    fn tear_with(&mut self, cuttable: &mut Cuttable, spring: [u32; 2], mut skin: Option<&mut Skin>) -> Result<Torn> {
        let is_solid = cuttable.material.solid().is_some();
        let places = if is_solid {
            self.stretched_at(cuttable, spring)?
        } else {
            self.torn_apart(cuttable, spring)?
        };
        let mut why = Withheld::NoWay;
        for (place, load) in places {
            let skin = skin.as_deref_mut();
            let torn = if is_solid {
                self.tear_node(cuttable, place, &load, skin)?
            } else {
                self.tear_through(cuttable, place, &load, skin)?
            };
            match torn {
                Torn::Made => return Ok(Torn::Made),
                Torn::Not(Withheld::NoWay) => {}
                Torn::Not(other) => why = other,
            }
        }
        Ok(Torn::Not(why))
    }

    /// Where a spring may tear the surface, what is to be tried first before the others.
    fn torn_apart(&self, cuttable: &Cuttable, spring: [u32; 2]) -> Result<Vec<(u32, VertexLoad)>> {
        let Some(surface) = cuttable.material.surface() else {
            return Ok(Vec::new());
        };
        let callers = spring.map(|node| self.system.order.caller(node));
        let is_free = |own: u32| self.system.inverse_masses[own as usize] > 0.0;
        let mut at_nodes = memory::reserved(2)?;
        for (own, node) in spring.into_iter().zip(callers) {
            // What holds a node would hold its copies too.
            if is_free(own)
                && let Some(vertex) = surface.vertex_of(node)
                && let Some(load) = surface.load_at(vertex, self.separation(own), self.positions())?
            {
                at_nodes.push((vertex, load));
            }
        }
        at_nodes.sort_unstable_by(|a, b| b.1.tension.total_cmp(&a.1.tension).then(a.0.cmp(&b.0)));
        let mut found = memory::reserved(4)?;
        let other = if spring.into_iter().any(is_free) {
            None
        } else {
            surface.vertex_between(callers, |node| is_free(self.system.order.own(node)))
        };
        for vertex in surface.tip_near(callers)?.into_iter().chain(other) {
            let mut forces = DMat3::ZERO;
            for node in surface.nodes_about(vertex)? {
                forces += self.separation(self.system.order.own(node));
            }
            if let Some(load) = surface.load_at(vertex, forces, self.positions())? {
                found.push((vertex, load));
            }
        }
        found.extend(at_nodes);
        Ok(found)
    }

    fn tear_through(
        &mut self,
        cuttable: &mut Cuttable,
        vertex: u32,
        load: &VertexLoad,
        skin: Option<&mut Skin>,
    ) -> Result<Torn> {
        let Some(surface) = cuttable.material.surface() else {
            return Ok(Torn::Not(Withheld::NoWay));
        };
        let Some(tear) = surface.tear(vertex, load, self.positions())? else {
            return Ok(Torn::Not(Withheld::NoWay));
        };
        let mut nodes = memory::reserved(3 * tear.triangles.len())?;
        let under = tear
            .triangles
            .iter()
            .flat_map(|&triangle| surface.nodes_under(triangle));
        nodes.extend(under.map(|node| self.system.order.own(node)));
        let counts = [cuttable.material.triangle_count(), cuttable.material.item_count()];
        let limits = self.limits(cuttable);
        let changes = cuttable
            .material
            .cut(&tear.sweep, self.positions(), &tear.triangles, limits)?;
        let least = self.tears.as_ref().map_or(0.0, |tears| tears.smallest_piece());
        let why = match cuttable.material.surface() {
            _ if changes.rim.is_empty() => Ok(Some(Withheld::NoWay)),
            Some(surface) if least > 0.0 => {
                let is_less = surface.has_parted_less(&changes.rim, least);
                is_less.map(|is_less| is_less.then_some(Withheld::SmallPiece))
            }
            _ => Ok(None),
        };
        let applied = match why {
            // Springs along no edge may reach over a triangle.
            Ok(None) => {
                let beside = |surface: &CutSurface| surface.beside(&tear.triangles);
                let near = cuttable.material.surface().map_or(Ok(Vec::new()), beside);
                near.and_then(|near| self.apply(cuttable, skin, (&tear.way, &near), &changes, counts))
            }
            Ok(Some(why)) => {
                cuttable.material.undo();
                return Ok(Torn::Not(why));
            }
            Err(error) => Err(error),
        };
        self.end_tear(cuttable, applied, nodes)
    }

    /// Counts a tear at these nodes that was applied, or takes its cut back.
    pub(super) fn end_tear(
        &mut self,
        cuttable: &mut Cuttable,
        applied: Result<CutReport>,
        nodes: Vec<u32>,
    ) -> Result<Torn> {
        match applied {
            Ok(CutReport { pieces_parted, .. }) => {
                if let Some(tears) = &mut self.tears {
                    tears.made(pieces_parted, nodes.into_iter());
                }
                Ok(Torn::Made)
            }
            Err(error) => {
                cuttable.material.undo();
                Err(error)
            }
        }
    }

    /// The tensor of the forces that pull a node apart, N (O'Brien, Hodgins 1999, equation 13), of its springs.
    fn separation(&self, node: u32) -> DMat3 {
        let positions = self.system.state.positions();
        let here = positions.get(node as usize);
        let mut sums = [DVec3::ZERO; 2];
        let mut tensors = [DMat3::ZERO; 2];
        self.system.forces.springs.visit(node as usize, &mut |link| {
            let offset = positions.get(link.neighbour as usize) - here;
            let force = pull(node as usize, &link, offset, None).as_dvec3();
            let pushes = usize::from(force.dot(offset.as_dvec3()) < 0.0);
            sums[pushes] += force;
            tensors[pushes] += along_itself(force);
        });
        let [pulled, pushed] = [0, 1].map(|kind| tensors[kind] - along_itself(sums[kind]));
        0.5 * (pulled - pushed)
    }
}

/// The matrix with the vector as its eigenvector, and the vector's length as its value; nothing across it.
fn along_itself(vector: DVec3) -> DMat3 {
    let length = vector.length();
    if length > 0.0 {
        outer(vector, vector) * (1.0 / length)
    } else {
        DMat3::ZERO
    }
}
