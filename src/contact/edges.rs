//! The edges of a surface that changes, with the number of triangles at each. A change takes time in proportion to its
//! size.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, DefaultHasher};

use super::features::HOLE;
use crate::base::{Result, memory};
use crate::codec::{Reader, Saved, Writer, shape_of_name};
use crate::mesh;

/// The number of triangles at each edge of a surface.
#[derive(Debug)]
pub(super) struct EdgeUses {
    /// Start of each lower corner's edges among the original edges, which are sorted.
    starts: Vec<u32>,
    /// The number of triangles at each edge. At [`MANY`] the count is saturated and stays.
    counts: Vec<u8>,
    /// Indices of added edges, by their corners.
    added: HashMap<[u32; 2], u32, BuildHasherDefault<DefaultHasher>>,
    /// Indices of removed edges.
    holes: Vec<u32>,
}

const MANY: u8 = u8::MAX;

/// Bytes of an added edge and its index.
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
        if let Some(bytes) = to.buffer(added.len() * EDGE) {
            let (edges, _) = bytes.as_chunks_mut::<EDGE>();
            for (edge, (&[low, high], &number)) in edges.iter_mut().zip(added) {
                for (to, number) in edge.as_chunks_mut().0.iter_mut().zip([low, high, number]) {
                    *to = number.to_le_bytes();
                }
            }
            // The bytes must not depend on the order of insertion.
            edges.sort_unstable();
        }
        holes.save(to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let (starts, counts) = (Saved::load(from)?, Saved::load(from)?);
        let (count, capacity) = (usize::load(from)?, usize::load(from)?);
        from.reserve_memory(capacity.max(count).checked_mul(size_of::<([u32; 2], u32)>()))?;
        let mut added = HashMap::default();
        added.try_reserve(capacity.max(count))?;
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
    /// Counts the uses of these sorted edges by the faces.
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

    /// Reserves memory for removing `removed` and adding `inserted` edges.
    pub fn reserve(&mut self, removed: usize, inserted: usize) -> Result<()> {
        self.counts.try_reserve(inserted)?;
        self.added.try_reserve(inserted)?;
        Ok(self.holes.try_reserve(removed)?)
    }

    /// Counts a new triangle with these corners. `new` receives the indices of its new edges.
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

    /// Removes a triangle with these corners, and the edges that no other triangle has.
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

    /// The index of the edge with these ends, the lower end first.
    fn find(&self, ends: [u32; 2], edges: &[[u32; 2]]) -> Option<usize> {
        let low = ends[0] as usize;
        if low + 1 < self.starts.len() {
            let first = self.starts[low] as usize..self.starts[low + 1] as usize;
            if let Some(position) = edges[first.clone()].iter().position(|edge| *edge == ends) {
                return Some(first.start + position);
            }
        }
        self.added.get(&ends).map(|&edge| edge as usize)
    }
}

/// The ends of a triangle's edges between distinct nodes, the lower end first.
fn ends_of(face: [u32; 3]) -> impl Iterator<Item = [u32; 2]> {
    mesh::ends_of(face).into_iter().filter(|[a, b]| a != b)
}
