//! The changes by cuts, in order, for renderers.

use crate::base::{Error, Result, ensure};
use crate::codec::saved;
use crate::cutting::Changes;

/// The origin of a node that a cut added. Attributes of vertices, such as texture coordinates and skinning weights, are
/// interpolated with these weights.
///
/// ```
/// # use glam::vec3;
/// # use sinew::cutting::Sweep;
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let sheet = world.create_body(&BodyDefinition { spare_nodes: 200, ..cloth })?;
/// # let edge = |z| [vec3(0.003, -0.01, z), vec3(0.003, 0.01, z)];
/// # let across = Sweep { start: edge(-0.06), end: edge(0.06) };
/// let mut texture: Vec<f32> = mesh.positions.iter().map(|place| place.x).collect();
/// world.cut(sheet, &across)?;
/// for new in world.body(sheet)?.changes_since(0)?.nodes {
///     let parts = new.sources.iter().zip(new.weights);
///     texture.push(parts.map(|(&source, weight)| weight * texture[source as usize]).sum());
/// }
/// assert_eq!(texture.len(), world.body(sheet)?.node_count());
/// # Ok::<(), sinew::Error>(())
/// ```
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewNodeSource {
    /// The new node. Its index is one more than that of the entry before.
    pub node: u32,
    /// The nodes that it lies between, each with a lower index than its own. A copy has one source. Further entries may
    /// repeat the first one with weight 0.
    pub sources: [u32; 3],
    /// The weights of the sources. They are at least 0 and add up to 1.
    pub weights: [f32; 3],
}

saved! { NewNodeSource { node, sources, weights } }

/// A cut-boundary edge. A cut edge becomes two of them, one on each side.
///
/// ```
/// # use glam::vec3;
/// # use sinew::cutting::Sweep;
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let sheet = world.create_body(&BodyDefinition { spare_nodes: 200, ..cloth })?;
/// # let edge = |z| [vec3(0.003, -0.01, z), vec3(0.003, 0.01, z)];
/// # let across = Sweep { start: edge(-0.06), end: edge(0.06) };
/// world.cut(sheet, &across)?;
/// let body = world.body(sheet)?;
/// # assert!(!body.changes_since(0)?.rim.is_empty());
/// for edge in body.changes_since(0)?.rim {
///     let triangle = body.surface()[edge.triangle as usize];
///     assert!(edge.nodes.iter().all(|node| triangle.contains(node)));
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewRimEdge {
    /// The ends, in the order of the corners of the triangle.
    pub nodes: [u32; 2],
    /// The triangle of the surface that has this edge.
    pub triangle: u32,
}

saved! { NewRimEdge { nodes, triangle } }

/// The changes of a body's topology since a version.
///
/// ```
/// # use glam::vec3;
/// # use sinew::cutting::Sweep;
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let sheet = world.create_body(&BodyDefinition { spare_nodes: 200, ..cloth })?;
/// # let edge = |z| [vec3(0.003, -0.01, z), vec3(0.003, 0.01, z)];
/// # let across = Sweep { start: edge(-0.06), end: edge(0.06) };
/// let before = world.body(sheet)?.topology_version();
/// let report = world.cut(sheet, &across)?;
/// let changes = world.body(sheet)?.changes_since(before)?;
/// assert_eq!(changes.nodes.len(), report.new_nodes as usize);
/// assert!(changes.version > before && !changes.rim.is_empty());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopologyChanges<'a> {
    /// The current version of the topology. Pass it to the next call.
    pub version: u64,
    /// All new nodes, in the order of their indices.
    pub nodes: &'a [NewNodeSource],
    /// Triangles of [`Body::surface`](crate::Body::surface) that are new or have other corners. A triangle may occur
    /// more than once.
    pub triangles: &'a [u32],
    /// Springs that have been removed: by a blade, by the caller, or replaced by springs of copies.
    pub removed_springs: &'a [[u32; 2]],
    /// New cut-boundary edges, as they were when they were created. Later cuts may have split or renumbered them.
    pub rim: &'a [NewRimEdge],
}

/// The lengths of the lists before a version.
#[derive(Clone, Copy, Debug)]
struct ListLengths {
    nodes: usize,
    triangles: usize,
    removed_springs: usize,
    rim: usize,
}

saved! { ListLengths { nodes, triangles, removed_springs, rim } }

/// All changes since the body was created.
#[derive(Debug, Default)]
pub(super) struct ChangeLog {
    nodes: Vec<NewNodeSource>,
    triangles: Vec<u32>,
    removed_springs: Vec<[u32; 2]>,
    rim: Vec<NewRimEdge>,
    /// One entry for each version but the first.
    versions: Vec<ListLengths>,
}

saved! { ChangeLog { nodes, triangles, removed_springs, rim, versions } }

impl ChangeLog {
    pub fn version(&self) -> u64 {
        self.versions.len() as u64
    }

    fn lengths(&self) -> ListLengths {
        ListLengths {
            nodes: self.nodes.len(),
            triangles: self.triangles.len(),
            removed_springs: self.removed_springs.len(),
            rim: self.rim.len(),
        }
    }

    /// Reserves space for a version with these changes and this many removed springs.
    pub fn reserve(&mut self, changes: &Changes, removed_springs: usize) -> Result<()> {
        self.nodes.try_reserve(changes.nodes.len() + changes.sources.len())?;
        self.triangles.try_reserve(changes.triangles.len())?;
        self.removed_springs.try_reserve(removed_springs)?;
        self.rim.try_reserve(changes.rim.len())?;
        Ok(self.versions.try_reserve(1)?)
    }

    /// Begins a version with these changes, for which space is reserved.
    pub fn add(&mut self, changes: &Changes, removed_springs: &[[u32; 2]]) {
        let before = self.lengths();
        self.versions.push(before);
        let rendered = changes.sources.iter().map(|source| NewNodeSource {
            node: source.point,
            sources: source.sources,
            weights: source.weights.map(|weight| weight as f32),
        });
        self.nodes.extend(rendered);
        let is_undrawn = |node: &u32| changes.undrawn.binary_search(node).is_ok();
        for piece in changes.nodes.iter().filter(|piece| is_undrawn(&piece.node)) {
            self.nodes.push(NewNodeSource {
                node: piece.node,
                sources: [piece.source; 3],
                weights: [1.0, 0.0, 0.0],
            });
        }
        self.nodes[before.nodes..].sort_unstable_by_key(|source| source.node);
        self.triangles.extend_from_slice(&changes.triangles);
        self.removed_springs.extend_from_slice(removed_springs);
        self.rim.extend(changes.rim.iter().map(|edge| NewRimEdge {
            nodes: edge.points,
            triangle: edge.triangle,
        }));
    }

    /// Reserves space for a spring that the caller removes.
    pub fn reserve_removed_spring(&mut self) -> Result<()> {
        self.removed_springs.try_reserve(1)?;
        Ok(self.versions.try_reserve(1)?)
    }

    /// Begins a version without this spring, for which space is reserved.
    pub fn add_removed_spring(&mut self, spring: [u32; 2]) {
        self.versions.push(self.lengths());
        self.removed_springs.push(spring);
    }

    /// The changes after a version.
    pub fn since(&self, version: u64) -> Result<TopologyChanges<'_>> {
        let now = self.version();
        ensure!(version <= now, future_version_error(version, now));
        let lengths_before = usize::try_from(version)
            .ok()
            .and_then(|version| self.versions.get(version));
        let lengths_before = lengths_before.copied().unwrap_or(self.lengths());
        Ok(TopologyChanges {
            version: now,
            nodes: &self.nodes[lengths_before.nodes..],
            triangles: &self.triangles[lengths_before.triangles..],
            removed_springs: &self.removed_springs[lengths_before.removed_springs..],
            rim: &self.rim[lengths_before.rim..],
        })
    }
}

/// The changes of a body that cannot be cut: none.
pub(super) fn unchanged(version: u64) -> Result<TopologyChanges<'static>> {
    ensure!(version == 0, future_version_error(version, 0));
    Ok(TopologyChanges {
        version,
        nodes: &[],
        triangles: &[],
        removed_springs: &[],
        rim: &[],
    })
}

fn future_version_error(version: u64, now: u64) -> Error {
    Error::invalid(format!("version is {version}: the body's topology has version {now}"))
}
