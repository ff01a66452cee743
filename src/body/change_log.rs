//! What cuts have changed, in order, for renderers that follow.

use crate::cutting::{RimEdge, Source};
use crate::error::{Error, Result};

/// What has come, changed or gone since a version.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopologyChanges<'a> {
    /// What the body's topology is now; to be asked with next time.
    pub version: u64,
    /// Of each new node that is drawn where it comes from: what it carries (texture coordinates, weights of a skin) follows by these weights.
    pub sources: &'a [Source],
    /// Triangles of [`Body::surface`](crate::Body::surface) that changed or are new; one may be named several times.
    pub triangles: &'a [u32],
    /// Springs that are gone, each with the number that it had among those.
    pub removed_springs: &'a [[u32; 2]],
    /// New edges of the rim.
    pub rim: &'a [RimEdge],
}

/// How long the lists were when a version came.
#[derive(Clone, Copy, Debug, Default)]
struct Lengths {
    sources: usize,
    triangles: usize,
    removed_springs: usize,
    rim: usize,
}

/// All that has changed since the body was made.
#[derive(Debug, Default)]
pub(super) struct ChangeLog {
    sources: Vec<Source>,
    triangles: Vec<u32>,
    removed_springs: Vec<[u32; 2]>,
    rim: Vec<RimEdge>,
    /// For each version from the first on.
    versions: Vec<Lengths>,
}

impl ChangeLog {
    pub fn version(&self) -> u64 {
        self.versions.len() as u64
    }

    /// Makes room for a version with so much.
    pub fn reserve(&mut self, sources: usize, triangles: usize, removed_springs: usize, rim: usize) -> Result<()> {
        self.sources.try_reserve(sources)?;
        self.triangles.try_reserve(triangles)?;
        self.removed_springs.try_reserve(removed_springs)?;
        self.rim.try_reserve(rim)?;
        Ok(self.versions.try_reserve(1)?)
    }

    /// Begins a version with these changes, for which there is room.
    pub fn add(&mut self, sources: &[Source], triangles: &[u32], removed_springs: &[[u32; 2]], rim: &[RimEdge]) {
        self.versions.push(Lengths {
            sources: self.sources.len(),
            triangles: self.triangles.len(),
            removed_springs: self.removed_springs.len(),
            rim: self.rim.len(),
        });
        self.sources.extend_from_slice(sources);
        self.triangles.extend_from_slice(triangles);
        self.removed_springs.extend_from_slice(removed_springs);
        self.rim.extend_from_slice(rim);
    }

    /// What came after a version.
    pub fn since(&self, version: u64) -> Result<TopologyChanges<'_>> {
        let now = self.version();
        if version > now {
            return Err(Error::invalid(format!(
                "version is {version}: the body's topology has version {now}"
            )));
        }
        let from = self.versions.get(version as usize).copied().unwrap_or(Lengths {
            sources: self.sources.len(),
            triangles: self.triangles.len(),
            removed_springs: self.removed_springs.len(),
            rim: self.rim.len(),
        });
        Ok(TopologyChanges {
            version: now,
            sources: &self.sources[from.sources..],
            triangles: &self.triangles[from.triangles..],
            removed_springs: &self.removed_springs[from.removed_springs..],
            rim: &self.rim[from.rim..],
        })
    }

    /// Bytes held from the allocator.
    pub fn bytes(&self) -> usize {
        self.sources.capacity() * size_of::<Source>()
            + self.triangles.capacity() * size_of::<u32>()
            + self.removed_springs.capacity() * size_of::<[u32; 2]>()
            + self.rim.capacity() * size_of::<RimEdge>()
            + self.versions.capacity() * size_of::<Lengths>()
    }
}

/// A list of nothing, for bodies that cannot be cut.
pub(super) const UNCHANGED: TopologyChanges<'static> = TopologyChanges {
    version: 0,
    sources: &[],
    triangles: &[],
    removed_springs: &[],
    rim: &[],
};
