//! Spring storages of a body and the spring forces of a tile.

mod adjacency;
mod chain;
mod dynamic_bulk;
mod efficient;
mod fast_link;
mod kernels;
mod law;
mod node_sum;
mod packed;
mod stored_link;

use std::fmt::Debug;
use std::ops;

use glam::Vec3;

use crate::def::{BodyDefinition, Spring, Storage};
use crate::simd::ChosenKernel;
use crate::soa::{FrequencyBound, NodalMasses, TileForces, Vectors, View, tile_nodes};
use law::half_energy;
pub(crate) use law::{Tangent, pull, separation};
use packed::Packed;
pub(crate) use packed::costs;

use crate::base::{Error, Result, memory};
use crate::codec::{Reader, Saved, Writer, saved, shape_with};
use dynamic_bulk::DynamicBulk;
use efficient::Efficient;
use fast_link::FastLink;
use stored_link::{DampedLink, UndampedLink};

/// One end of a spring: its parameters and the node at the other end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Link {
    pub neighbor: u32,
    /// N/m
    pub stiffness: f32,
    /// m
    pub rest_length: f32,
    /// N s/m
    pub damping: f32,
}

saved! { Link { neighbor, stiffness, rest_length, damping } }

impl Link {
    /// A link of stiffness 0 with this rest length.
    pub fn slack(neighbor: u32, rest_length: f32) -> Self {
        Self {
            neighbor,
            stiffness: 0.0,
            rest_length,
            damping: 0.0,
        }
    }

    /// Both ends of a spring, in the order of its nodes.
    pub fn ends(spring: &Spring) -> [Self; 2] {
        let [a, b] = spring.nodes;
        [b, a].map(|neighbor| Self {
            neighbor,
            stiffness: spring.stiffness,
            rest_length: spring.rest_length,
            damping: spring.damping,
        })
    }
}

/// New parameters for an existing spring, stored from the side of one of its nodes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpringChange {
    pub node: u32,
    pub before: Link,
    /// The new link, to the same neighbor.
    pub after: Link,
}

impl SpringChange {
    /// Both nodes of the spring, each with its new link.
    pub fn ends(&self) -> [(u32, Link); 2] {
        let other = Link {
            neighbor: self.node,
            ..self.after
        };
        [(self.node, self.after), (self.after.neighbor, other)]
    }
}

/// The changes that a cut makes to the springs.
#[derive(Debug, Default)]
pub(crate) struct Rewiring {
    /// Existing springs to remove.
    pub removed: Vec<Spring>,
    /// Existing springs with new parameters, each once.
    pub changed: Vec<SpringChange>,
    /// New springs between nodes that have none yet.
    pub added: Vec<Spring>,
}

impl Rewiring {
    pub fn is_empty(&self) -> bool {
        self.removed.is_empty() && self.changed.is_empty() && self.added.is_empty()
    }
}

/// The input of a spring-force evaluation.
#[derive(Clone, Copy)]
pub(crate) struct ForceInput<'a> {
    pub positions: View<'a>,
    /// Node velocities, present if springs are damped.
    pub velocities: Option<&'a Vectors>,
    /// Per-node data that the caller needs after the forces; it is prefetched during the evaluation.
    pub prefetched: [&'a [f32]; 6],
}

impl<'a> ForceInput<'a> {
    /// An input without prefetched data.
    pub fn at(positions: &'a Vectors, velocities: Option<&'a Vectors>) -> Self {
        Self {
            positions: positions.view(),
            velocities,
            prefetched: [&[]; 6],
        }
    }
}

/// The input of a tangent product: node positions and displacements.
#[derive(Clone, Copy)]
pub(crate) struct DirectionInput<'a> {
    pub node_count: usize,
    pub positions: View<'a>,
    pub displacements: View<'a>,
    pub tangent: Tangent,
}

/// A spring storage. Every solver and every topology change uses this trait.
pub(crate) trait Springs: Debug + Send + Sync {
    /// True if springs may have damping. Fixed when the body is created.
    fn damped(&self) -> bool;

    fn node_count(&self) -> usize;

    fn spring_count(&self) -> usize;

    /// Bytes used by the existing springs, and bytes held from the allocator.
    fn bytes(&self) -> (usize, usize);

    /// Calls `f` once for each link of `node`.
    fn visit(&self, node: usize, f: &mut dyn FnMut(Link));

    /// The range of nodes whose positions the forces of a tile depend on, with at most sixteen nodes beyond it. `None`:
    /// any node.
    fn reads(&self, _tile: usize) -> Option<ops::Range<isize>> {
        None
    }

    /// True if so many neighbors are gathered that positions stored as records pay off.
    fn prefers_records(&self) -> bool {
        false
    }

    /// Writes the spring forces on all nodes of `tile`, N; 0 for a node without springs. With velocities, the damping
    /// along springs is included.
    fn forces(&self, tile: usize, input: &ForceInput, forces: &mut TileForces);

    /// Writes the first-order changes of the spring forces on the nodes of `tile`, N: the tangent times the
    /// displacements.
    fn force_changes(&self, tile: usize, input: &DirectionInput, changes: &mut TileForces) {
        let &DirectionInput {
            node_count,
            positions,
            displacements,
            tangent,
        } = input;
        let nodes = tile_nodes(tile, node_count);
        for node in nodes.clone() {
            let (position, displacement) = (positions.get(node), displacements.get(node));
            let mut sum = Vec3::ZERO;
            self.visit(node, &mut |link| {
                let neighbor = link.neighbor as usize;
                let offset = positions.get(neighbor) - position;
                sum += tangent.force_change(node, &link, offset, displacements.get(neighbor) - displacement);
            });
            changes.set(node - nodes.start, sum);
        }
    }

    /// Half the energy of all links of a tile's nodes, J. Each end of a spring counts half of its energy.
    fn half_energy(&self, nodes: ops::Range<usize>, positions: View) -> f64 {
        let mut sum = 0.0;
        for node in nodes {
            self.visit(node, &mut |link| {
                let offset = positions.get(link.neighbor as usize) - positions.get(node);
                sum += f64::from(half_energy(node, &link, offset));
            });
        }
        sum
    }

    /// Reserves memory for this total number of nodes.
    fn reserve_nodes(&mut self, node_count: usize) -> Result<()>;

    /// Appends nodes without springs, within the reserved memory, or removes the last nodes, up to this total number.
    /// Changes nothing on failure.
    fn resize(&mut self, node_count: usize) -> Result<()>;

    /// Adds a spring between two nodes. Returns an error if the pair already has one. The damping is stored only if
    /// springs are damped. Changes nothing on failure.
    fn add(&mut self, spring: &Spring) -> Result<()>;

    /// Removes the spring between `a` and `b`. Returns an error if there is none.
    fn remove(&mut self, a: u32, b: u32) -> Result<()>;

    /// Sets the parameters of existing springs, each listed once. Changes nothing on failure.
    fn set(&mut self, changes: &[SpringChange]) -> Result<()>;

    /// Writes the storage's tag and contents.
    fn save(&self, to: &mut Writer);

    /// Applies the changes of a cut. Changes nothing on failure.
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

/// Stores `springs` in the storage that the definition names.
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

/// Applies the changes of a cut with these functions to add a spring and to remove an existing one. Changes nothing on
/// failure.
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
    let remove_all = |springs: &mut S, all: &[Spring]| all.iter().try_for_each(|spring| remove(springs, spring.nodes));
    for (done, spring) in added.iter().enumerate() {
        if let Err(error) = add(springs, spring) {
            remove_all(springs, &added[..done])?;
            return Err(error);
        }
    }
    if let Err(error) = springs.set(changed) {
        remove_all(springs, added)?;
        return Err(error);
    }
    remove_all(springs, removed)
}

/// The spring rates of a node, valid at any positions. `None`: the node is pinned.
pub(crate) fn spring_rates(node: usize, springs: &dyn Springs, masses: &NodalMasses) -> Option<FrequencyBound> {
    let inverse_mass = masses.inverse(node);
    let mut rates = FrequencyBound::ZERO;
    springs.visit(node, &mut |link| {
        // With mass scaling each node is bounded on its own and carries half of each spring: 2 / m_a replaces 1 / m_a +
        // 1 / m_b.
        let inverse_mass = if masses.are_scaled {
            2.0 * inverse_mass
        } else {
            masses.spring_factor(inverse_mass, link.neighbor as usize)
        };
        rates.omega_sq += link.stiffness * inverse_mass;
        rates.damping_rate += link.damping * inverse_mass;
    });
    (inverse_mass > 0.0).then_some(rates)
}

/// The error of an added spring whose nodes already have one.
pub(crate) fn already_joined(a: u32, b: u32) -> Error {
    Error::invalid(format!("nodes {a} and {b} have a spring already"))
}

/// The error of a removed spring that does not exist.
pub(crate) fn not_joined(a: u32, b: u32) -> Error {
    Error::invalid(format!("nodes {a} and {b} have no spring"))
}
