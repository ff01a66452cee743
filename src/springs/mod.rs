//! The springs of a body: how they are kept, and the forces of a tile's.

mod chain;
mod dynamic_bulk;
mod efficient;
mod ends;
mod fast_link;
mod gather;
mod kept;
mod kernels;
mod law;
mod packed;

use std::fmt::Debug;
use std::ops;

use glam::Vec3;

use crate::def::{BodyDefinition, Spring, Storage};
use crate::simd::ChosenKernel;
use crate::soa::{Masses, Rates, TileForces, Vectors, View, tile_nodes};
use law::half_energy;
pub(crate) use law::{Tangent, pull, separation};
use packed::Packed;
pub(crate) use packed::costs;

use crate::base::{Error, Result, memory};
use crate::codec::{Reader, Saved, Writer, saved, shape_with};
use dynamic_bulk::DynamicBulk;
use efficient::Efficient;
use fast_link::FastLink;
use kept::{DampedLink, UndampedLink};

/// One end of a spring, as the node at the other end sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Link {
    pub neighbour: u32,
    /// N/m
    pub stiffness: f32,
    /// m
    pub rest_length: f32,
    /// N s/m
    pub damping: f32,
}

saved! { Link { neighbour, stiffness, rest_length, damping } }

impl Link {
    /// One that pulls at nothing, of this rest length.
    pub fn slack(neighbour: u32, rest_length: f32) -> Self {
        Self {
            neighbour,
            stiffness: 0.0,
            rest_length,
            damping: 0.0,
        }
    }

    /// A spring as each of its nodes sees it.
    pub fn ends(spring: &Spring) -> [Self; 2] {
        let [a, b] = spring.nodes;
        [b, a].map(|neighbour| Self {
            neighbour,
            stiffness: spring.stiffness,
            rest_length: spring.rest_length,
            damping: spring.damping,
        })
    }
}

/// A spring that is to have another stiffness, rest length or damping, as one of its nodes sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpringChange {
    pub node: u32,
    pub before: Link,
    /// To the same neighbour.
    pub after: Link,
}

impl SpringChange {
    /// Its nodes, each with what it sees then.
    pub fn ends(&self) -> [(u32, Link); 2] {
        let other = Link {
            neighbour: self.node,
            ..self.after
        };
        [(self.node, self.after), (self.after.neighbour, other)]
    }
}

/// What a cut makes of springs.
#[derive(Debug, Default)]
pub(crate) struct Rewiring {
    /// Springs that there are.
    pub removed: Vec<Spring>,
    /// Others that there are, each once.
    pub changed: Vec<SpringChange>,
    /// Between nodes that have none.
    pub added: Vec<Spring>,
}

impl Rewiring {
    pub fn is_empty(&self) -> bool {
        self.removed.is_empty() && self.changed.is_empty() && self.added.is_empty()
    }
}

/// What spring forces depend on, and what is wanted next.
#[derive(Clone, Copy)]
pub(crate) struct Motion<'a> {
    pub positions: View<'a>,
    /// Given where springs are damped.
    pub velocities: Option<&'a Vectors>,
    /// What the nodes of the tile need after the forces, to be fetched from memory meanwhile.
    pub soon: [&'a [f32]; 6],
}

impl<'a> Motion<'a> {
    /// Nothing is wanted next.
    pub fn at(positions: &'a Vectors, velocities: Option<&'a Vectors>) -> Self {
        Self {
            positions: positions.view(),
            velocities,
            soon: [&[]; 6],
        }
    }
}

/// Where the nodes of a body are, and by which ways they go from there.
#[derive(Clone, Copy)]
pub(crate) struct Course<'a> {
    pub node_count: usize,
    pub positions: View<'a>,
    pub ways: View<'a>,
    pub tangent: Tangent,
}

/// How the springs of a body are kept. Every solver and every change of topology goes through this.
pub(crate) trait Springs: Debug + Send + Sync {
    /// Whether springs may have damping: fixed when the body is made.
    fn damped(&self) -> bool;

    fn node_count(&self) -> usize;

    fn spring_count(&self) -> usize;

    /// Bytes taken by the springs that exist, and bytes held from the allocator.
    fn bytes(&self) -> (usize, usize);

    /// Shows the links of `node`, each once.
    fn visit(&self, node: usize, see: &mut dyn FnMut(Link));

    /// The nodes whose positions the forces of a tile are made of, and what lies between and at most sixteen beyond them;
    /// `None`: any.
    fn reads(&self, _tile: usize) -> Option<ops::Range<isize>> {
        None
    }

    /// Whether neighbours are gathered so much that it pays to have positions as records too.
    fn gathers(&self) -> bool {
        false
    }

    /// Writes the spring forces on the nodes of `tile`, in newtons; with velocities also the damping along springs.
    fn forces(&self, tile: usize, motion: &Motion, forces: &mut TileForces);

    /// Writes how the spring forces on the nodes of `tile` change, N, in the first order.
    fn changes(&self, tile: usize, course: &Course, changes: &mut TileForces) {
        let &Course {
            node_count,
            positions,
            ways,
            tangent,
        } = course;
        let nodes = tile_nodes(tile, node_count);
        for node in nodes.clone() {
            let (position, way) = (positions.get(node), ways.get(node));
            let mut sum = Vec3::ZERO;
            self.visit(node, &mut |link| {
                let neighbour = link.neighbour as usize;
                let offset = positions.get(neighbour) - position;
                sum += tangent.change(node, &link, offset, ways.get(neighbour) - way);
            });
            changes.set(node - nodes.start, sum);
        }
    }

    /// Half the energy of all links of the nodes of a tile, J: of a spring between two tiles each has a half.
    fn half_energy(&self, nodes: ops::Range<usize>, positions: View) -> f64 {
        let mut sum = 0.0;
        for node in nodes {
            self.visit(node, &mut |link| {
                let way = positions.get(link.neighbour as usize) - positions.get(node);
                sum += f64::from(half_energy(node, &link, way));
            });
        }
        sum
    }

    /// Makes room for so many nodes in all.
    fn reserve_nodes(&mut self, node_count: usize) -> Result<()>;

    /// Adds nodes without springs, for which room was made, up to so many in all, or takes the last away again. Changes nothing where it
    /// fails.
    fn resize(&mut self, node_count: usize) -> Result<()>;

    /// Adds a spring between two nodes of the body; refused where the pair has one already. Its damping counts only where
    /// springs are damped. Changes nothing where it fails.
    fn add(&mut self, spring: &Spring) -> Result<()>;

    /// Removes the spring between `a` and `b`; refused where there is none.
    fn remove(&mut self, a: u32, b: u32) -> Result<()>;

    /// Gives springs that there are, each once, other parameters. Changes nothing where it fails.
    fn set(&mut self, changes: &[SpringChange]) -> Result<()>;

    /// Writes which storage it is, and what it keeps.
    fn save(&self, to: &mut Writer);

    /// Changes springs as a cut does. Changes nothing where it fails.
    fn rewire(&mut self, rewiring: &Rewiring) -> Result<()> {
        rewire_by(self, rewiring, Self::add, |springs, [a, b]| springs.remove(a, b))
    }
}

impl Saved for Box<dyn Springs> {
    const SHAPE: u64 = {
        let shape = shape_with(Packed::SHAPE, Efficient::SHAPE);
        let shape = shape_with(shape, FastLink::<DampedLink>::SHAPE);
        shape_with(shape, DynamicBulk::<DampedLink>::SHAPE)
    };
    const LEAST: usize = 1;

    fn save(&self, to: &mut Writer) {
        Springs::save(&**self, to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let [kind] = from.take_array()?;
        Ok(match kind {
            Packed::SAVED_AS => memory::boxed(Packed::load(from)?)?,
            Efficient::SAVED_AS => memory::boxed(Efficient::load(from)?)?,
            FastLink::<UndampedLink>::SAVED_AS => memory::boxed(FastLink::<UndampedLink>::load(from)?)?,
            FastLink::<DampedLink>::SAVED_AS => memory::boxed(FastLink::<DampedLink>::load(from)?)?,
            DynamicBulk::<UndampedLink>::SAVED_AS => memory::boxed(DynamicBulk::<UndampedLink>::load(from)?)?,
            DynamicBulk::<DampedLink>::SAVED_AS => memory::boxed(DynamicBulk::<DampedLink>::load(from)?)?,
            _ => return Err(from.refusal("no storage of springs")),
        })
    }
}

/// `springs`, kept as a body's definition asks.
pub(crate) fn store(kernel: ChosenKernel, definition: &BodyDefinition, springs: &[Spring]) -> Result<Box<dyn Springs>> {
    let node_count = definition.positions.len();
    let width = definition.springs_per_node as usize;
    let damped = springs.iter().any(|spring| spring.damping != 0.0);
    Ok(match (definition.storage, damped) {
        (Storage::Packed, _) => memory::boxed(Packed::new(kernel, node_count, springs, definition.rounding())?)?,
        (Storage::Efficient, _) => memory::boxed(Efficient::new(node_count, springs)?)?,
        (Storage::FastLink, false) => {
            memory::boxed(FastLink::<UndampedLink>::new(kernel, node_count, springs, width)?)?
        }
        (Storage::FastLink, true) => memory::boxed(FastLink::<DampedLink>::new(kernel, node_count, springs, width)?)?,
        (Storage::DynamicBulk, false) => {
            memory::boxed(DynamicBulk::<UndampedLink>::new(kernel, node_count, springs, width)?)?
        }
        (Storage::DynamicBulk, true) => {
            memory::boxed(DynamicBulk::<DampedLink>::new(kernel, node_count, springs, width)?)?
        }
    })
}

/// Changes springs as a cut does, with these ways to add one and to remove one that is there. Changes nothing where it fails.
fn rewire_by<S: Springs + ?Sized>(
    springs: &mut S,
    Rewiring {
        removed,
        changed,
        added,
    }: &Rewiring,
    add: fn(&mut S, &Spring) -> Result<()>,
    remove: fn(&mut S, [u32; 2]) -> Result<()>,
) -> Result<()> {
    let take_out = |springs: &mut S, all: &[Spring]| all.iter().try_for_each(|spring| remove(springs, spring.nodes));
    for (done, spring) in added.iter().enumerate() {
        if let Err(error) = add(springs, spring) {
            take_out(springs, &added[..done])?;
            return Err(error);
        }
    }
    if let Err(error) = springs.set(changed) {
        take_out(springs, added)?;
        return Err(error);
    }
    take_out(springs, removed)
}

/// Those of a node wherever it and its neighbours are; `None`: it is pinned.
pub(crate) fn rates_anywhere(node: usize, springs: &dyn Springs, masses: &Masses) -> Option<Rates> {
    let inverse_mass = masses.inverse(node);
    let mut rates = Rates::ZERO;
    springs.visit(node, &mut |link| {
        // Masses that were added are what a node needs by itself, with half of each spring.
        let inverse_mass = if masses.are_heavier {
            2.0 * inverse_mass
        } else {
            masses.of_spring(inverse_mass, link.neighbour as usize)
        };
        rates.stiffest += link.stiffness * inverse_mass;
        rates.most_damped += link.damping * inverse_mass;
    });
    (inverse_mass > 0.0).then_some(rates)
}

/// Why a spring is not added.
pub(crate) fn already_joined(a: u32, b: u32) -> Error {
    Error::invalid(format!("nodes {a} and {b} have a spring already"))
}

/// Why a spring is not removed.
pub(crate) fn not_joined(a: u32, b: u32) -> Error {
    Error::invalid(format!("nodes {a} and {b} have no spring"))
}
