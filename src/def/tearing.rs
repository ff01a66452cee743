//! Tearing limits and reports.

use super::BodyDefinition;
use super::Model;
use crate::base::{Error, Result, ensure, not_negative};
use crate::codec::{saved, saved_enum};

/// The limits beyond which a body tears.
///
/// A spring beyond its limits after a step tears the surface through one of its nodes. The tear is perpendicular to the
/// tension at that node (O'Brien and Hodgins 1999, equation 13). If a cut ends in a triangle next to the spring, that
/// cut is continued instead. A tear extends to the next simulated triangle, and otherwise behaves as a cut.
///
/// A solid tears at the node of the spring with the larger strain. This is (F Fᵀ - 1) / 2 with the deformation gradient
/// F, averaged over the tetrahedra around the node. These tetrahedra separate along their faces if their centers are on
/// different sides of the plane perpendicular to the largest principal stretch. The render surface stays closed. Each
/// edge of an element counts as a spring with a strain.
///
/// ```
/// # use glam::{Vec3, vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// let tearing = Tearing { strain: 0.5, most_per_step: 4, ..Tearing::default() };
/// let body = world.create_body(&BodyDefinition { tearing, spare_nodes: 200, ..cloth })?;
/// let stretched: Vec<Vec3> = mesh.positions.iter().map(|place| vec3(2.0, 1.0, 1.0) * place).collect();
/// world.body_mut(body)?.set_positions(&stretched)?;
/// world.step(1e-4)?;
/// assert!(world.body(body)?.node_count() > stretched.len());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tearing {
    /// The maximum strain of a spring, at least 0. 0: unlimited. A spring without a rest length has no strain.
    pub strain: f32,
    /// The maximum tension of a spring (N), at least 0. 0: unlimited. It does not apply to edges of elements. The
    /// remainder of a cut spring has its share of the limit.
    pub force: f32,
    /// The maximum number of tears per step; the most loaded springs tear first. 0: the body does not tear, and has no
    /// cost for it.
    pub most_per_step: u32,
    /// The minimum fragment size at rest, at least 0: area (m²), or volume of solids, m³. A tear that would separate a
    /// smaller fragment is not made.
    pub smallest_piece: f32,
}

saved! { Tearing { strain, force, most_per_step, smallest_piece } }

/// The tears of the last step, and the springs beyond their limits that did not tear.
///
/// ```
/// # use glam::{Vec3, vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # let tearing = Tearing { strain: 0.5, most_per_step: 4, ..Tearing::default() };
/// # let body = world.create_body(&BodyDefinition { tearing, spare_nodes: 200, ..cloth })?;
/// # let stretched: Vec<Vec3> = mesh.positions.iter().map(|place| vec3(2.0, 1.0, 1.0) * place).collect();
/// # world.body_mut(body)?.set_positions(&stretched)?;
/// // The body is stretched to twice its length, and may tear four times in a step.
/// world.step(1e-4)?;
/// let report = world.body(body)?.tear_report();
/// assert!(report.tears >= 1 && report.tears <= 4);
/// assert!(report.waiting > 0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TearReport {
    /// The number of tears.
    pub tears: u32,
    /// The number of connected components that the surface gained.
    pub pieces_parted: u32,
    /// Springs beyond their limits that wait: the maximum number of tears was reached, a tear was made next to them, or
    /// no tension acts on their nodes.
    pub waiting: u32,
    /// Springs beyond their limits whose tear would separate too small a fragment.
    pub small_pieces: u32,
    /// Springs beyond their limits whose tear lacks spare nodes, slots for springs, or memory.
    pub no_room: u32,
}

saved! { TearReport { tears, pieces_parted, waiting, small_pieces, no_room } }

/// The reason why a spring beyond its limits was not torn. It is not tried again until the topology changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TearRefusal {
    SmallPiece,
    NoRoom,
    NoPath,
}

saved_enum!(TearRefusal { 0 => SmallPiece, 1 => NoRoom, 2 => NoPath });

impl Tearing {
    /// Returns an error for values out of range or not supported by such a body.
    pub(crate) fn check(&self, definition: &BodyDefinition) -> Result<()> {
        let limits = [("tear_strain", self.strain), ("tear_force", self.force)];
        for (name, value) in limits.into_iter().chain([("smallest_piece", self.smallest_piece)]) {
            not_negative(name, value)?;
            ensure!(
                value <= 0.0 || self.most_per_step != 0,
                "{name} is {value}, and most_tears is 0: must be at least 1"
            );
        }
        if self.most_per_step == 0 {
            return Ok(());
        }
        let most = self.most_per_step;
        ensure!(
            definition.spare_nodes != 0,
            "most_tears is {most}, and spare_nodes is 0: a tear needs nodes to come"
        );
        ensure!(
            definition.cells.is_empty(),
            Error::Unsupported(format!("most_tears is {most}: bodies with cells do not tear"))
        );
        let has_elements = definition
            .material
            .is_some_and(|material| material.model == Model::Tetrahedra);
        if has_elements && self.force > 0.0 && definition.springs.is_none_or(<[_]>::is_empty) {
            return Err(Error::Unsupported(format!(
                "tear_force is {}: elements have no springs that pull, but a tear_strain",
                self.force
            )));
        }
        ensure!(
            !definition.triangles.is_empty() || !definition.tetrahedra.is_empty(),
            Error::Unsupported(format!("most_tears is {most}: bodies without triangles do not tear"))
        );
        Ok(())
    }
}

impl TearReport {
    pub(crate) fn count_refusal(&mut self, why: TearRefusal) {
        *match why {
            TearRefusal::SmallPiece => &mut self.small_pieces,
            TearRefusal::NoRoom => &mut self.no_room,
            TearRefusal::NoPath => &mut self.waiting,
        } += 1;
    }
}
