//! When a body tears, and what it says of it.

use super::BodyDefinition;
use super::Model;
use crate::base::{Error, Result, ensure, not_negative};
use crate::codec::{saved, saved_enum};

/// When a body tears.
///
/// A spring that a step has left beyond its limits tears the surface through one of its nodes, across what pulls that node apart (O'Brien,
/// Hodgins 1999, equation 13); where a cut ends in a triangle next to the spring, that goes on instead. A tear goes as far as the next triangle
/// that is simulated, and is a cut in all it does.
///
/// A solid tears at that of the spring's nodes about which its material is stretched more, by the mean of (F Fᵀ - 1) / 2 over the tetrahedra there, with
/// the gradient F of the deformation: the tetrahedra about it whose middles lie on the two sides of the plane across the largest principal
/// stretch part along their faces, as far as what is drawn stays a closed surface. Of tetrahedra that are elements each edge counts as a spring with a
/// strain.
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
    /// The part of its rest length by which a spring may become longer, at least 0; 0: any. A spring without a rest length has no strain.
    pub strain: f32,
    /// How much a spring may pull, N, at least 0; 0: any. Edges of elements bear any force. What a cut leaves of a spring bears its part.
    pub force: f32,
    /// The most tears in a step, those of the most loaded springs; 0: the body does not tear, and pays nothing for it.
    pub most_per_step: u32,
    /// A tear that would part a piece with less area in the rest shape, m², of solids with less volume, m³, is not made; at least 0.
    pub smallest_piece: f32,
}

saved! { Tearing { strain, force, most_per_step, smallest_piece } }

/// What tore in the last step, and what did not.
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
    /// Tears that were made.
    pub tears: u32,
    /// How many more pieces the surface has.
    pub pieces_parted: u32,
    /// Springs beyond their limits whose turn is to come: there were as many tears as there may be, one beside them, or nothing pulls their nodes
    /// apart.
    pub waiting: u32,
    /// Springs beyond their limits that would part too small a piece.
    pub small_pieces: u32,
    /// Springs beyond their limits for whose tears there is no room: not as many spare nodes, or places in a row of fixed length, or memory.
    pub no_room: u32,
}

saved! { TearReport { tears, pieces_parted, waiting, small_pieces, no_room } }

/// Why a spring beyond its limits was not torn. It is not tried again before the topology changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Withheld {
    SmallPiece,
    NoRoom,
    NoWay,
}

saved_enum!(Withheld { 0 => SmallPiece, 1 => NoRoom, 2 => NoWay });

impl Tearing {
    /// Refuses what is out of its range, or not possible for such a body.
    pub(crate) fn check(&self, definition: &BodyDefinition) -> Result<()> {
        let of_springs = [("tear_strain", self.strain), ("tear_force", self.force)];
        for (name, value) in of_springs.into_iter().chain([("smallest_piece", self.smallest_piece)]) {
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
    pub(crate) fn withhold(&mut self, why: Withheld) {
        *match why {
            Withheld::SmallPiece => &mut self.small_pieces,
            Withheld::NoRoom => &mut self.no_room,
            Withheld::NoWay => &mut self.waiting,
        } += 1;
    }
}
