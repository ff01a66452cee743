//! Which triangles' corners the edges of a surface that changes join: found and counted, so that a change costs what it changes.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, DefaultHasher};

use super::features::HOLE;
use crate::base::{Result, memory};
use crate::codec::{Reader, Saved, Writer, shape_of_name};
use crate::mesh;

/// How many triangles have each edge of a surface.
#[derive(Debug)]
pub(super) struct EdgeUses {
    /// Where the edges of each lower corner begin among those that the surface had at first, which are in order.
    starts: Vec<u32>,
    /// How many triangles have each edge; [`MANY`] stays.
    counts: Vec<u8>,
    /// The numbers of edges that came later, by their corners.
    added: HashMap<[u32; 2], u32, BuildHasherDefault<DefaultHasher>>,
    /// The numbers of edges that are gone.
    holes: Vec<u32>,
}

const MANY: u8 = u8::MAX;

/// Bytes of an edge that came later and its number.
const EDGE: usize = 12;

impl Saved for EdgeUses {
    const SHAPE: u64 = shape_of_name("EdgeUses { starts, counts, added, holes }");
    const LEAST: usize = 64;

    fn save(&self, to: &mut Writer) {
        let Self {
            starts,
            counts,
            added,
            holes,
        } = self;
        starts.save(to);
        counts.save(to);
        added.len().save(to);
        added.capacity().save(to);
        to.needs(added.capacity() * size_of::<([u32; 2], u32)>());
        if let Some(place) = to.place(added.len() * EDGE) {
            let (edges, _) = place.as_chunks_mut::<EDGE>();
            for (edge, (&[low, high], &number)) in edges.iter_mut().zip(added) {
                for (to, number) in edge.as_chunks_mut().0.iter_mut().zip([low, high, number]) {
                    *to = number.to_le_bytes();
                }
            }
            // In an order that says nothing of what came when.
            edges.sort_unstable();
        }
        holes.save(to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let (starts, counts) = (Saved::load(from)?, Saved::load(from)?);
        let (count, room) = (usize::load(from)?, usize::load(from)?);
        from.will_take(room.max(count).checked_mul(size_of::<([u32; 2], u32)>()))?;
        let mut added = HashMap::default();
        added.try_reserve(room.max(count))?;
        for _ in 0..count {
            let (ends, edge) = Saved::load(from)?;
            added.insert(ends, edge);
        }
        Ok(Self {
            starts,
            counts,
            added,
            holes: Saved::load(from)?,
        })
    }
}

impl EdgeUses {
    /// Of a surface with these edges, in order, and faces.
    pub fn new(node_count: u32, edges: &[[u32; 2]], faces: &[[u32; 3]]) -> Result<Self> {
        let mut starts = memory::filled(0_u32, node_count as usize + 1)?;
        for &[low, _] in edges {
            starts[low as usize + 1] += 1;
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut uses = Self {
            starts,
            counts: memory::filled(0, edges.len())?,
            added: HashMap::default(),
            holes: Vec::new(),
        };
        for &face in faces {
            for ends in ends_of(face) {
                if let Some(edge) = uses.find(ends, edges) {
                    uses.counts[edge] = uses.counts[edge].saturating_add(1);
                }
            }
        }
        Ok(uses)
    }

    /// Makes room for so many edges that go and so many that come.
    pub fn reserve(&mut self, going: usize, coming: usize) -> Result<()> {
        self.counts.try_reserve(coming)?;
        self.added.try_reserve(coming)?;
        Ok(self.holes.try_reserve(going)?)
    }

    /// A triangle with these corners has come: shows the numbers of edges that came with it.
    pub fn add(&mut self, face: [u32; 3], edges: &mut Vec<[u32; 2]>, mut new: impl FnMut(u32)) {
        for ends in ends_of(face) {
            if let Some(edge) = self.find(ends, edges) {
                self.counts[edge] = self.counts[edge].saturating_add(1);
                continue;
            }
            let edge = self.holes.pop().unwrap_or(edges.len() as u32);
            if edge as usize == edges.len() {
                edges.push(ends);
                self.counts.push(1);
            } else {
                edges[edge as usize] = ends;
                self.counts[edge as usize] = 1;
            }
            self.added.insert(ends, edge);
            new(edge);
        }
    }

    /// A triangle with these corners has gone, and with it edges that no other has.
    pub fn remove(&mut self, face: [u32; 3], edges: &mut [[u32; 2]]) {
        for ends in ends_of(face) {
            let Some(edge) = self.find(ends, edges) else {
                continue;
            };
            if self.counts[edge] != MANY {
                self.counts[edge] -= 1;
            }
            if self.counts[edge] == 0 {
                edges[edge] = HOLE;
                self.added.remove(&ends);
                self.holes.push(edge as u32);
            }
        }
    }

    /// The number of the edge with these ends, the lower first.
    fn find(&self, ends: [u32; 2], edges: &[[u32; 2]]) -> Option<usize> {
        let low = ends[0] as usize;
        if low + 1 < self.starts.len() {
            let first = self.starts[low] as usize..self.starts[low + 1] as usize;
            if let Some(place) = edges[first.clone()].iter().position(|edge| *edge == ends) {
                return Some(first.start + place);
            }
        }
        self.added.get(&ends).map(|&edge| edge as usize)
    }
}

/// The ends of a triangle's edges that have a length, the lower first.
fn ends_of(face: [u32; 3]) -> impl Iterator<Item = [u32; 2]> {
    mesh::ends_of(face).into_iter().filter(|[a, b]| a != b)
}
