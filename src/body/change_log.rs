//! What cuts have changed, in order, for renderers that follow.

use crate::base::{Error, Result, ensure};
use crate::codec::saved;
use crate::cutting::Changes;

/// Where a node that a cut added comes from: what it carries (texture coordinates, weights of a skin) follows by these weights.
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
    /// The new node: one more than that of the entry before.
    pub node: u32,
    /// Those that it lies between, each of a lower number than its own; those beyond the first may repeat it with weight 0. A copy has the
    /// node that it was copied from alone.
    pub sources: [u32; 3],
    /// How much of each, at least 0, 1 in all.
    pub weights: [f32; 3],
}

saved! { NewNodeSource { node, sources, weights } }

/// An edge of the rim of a cut. Each edge that was cut is two of them, one on either side.
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
    /// Its ends, in the order in which its triangle has them.
    pub nodes: [u32; 2],
    /// The triangle of the surface that it is a side of.
    pub triangle: u32,
}

saved! { NewRimEdge { nodes, triangle } }

/// What has come, changed or gone since a version.
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
    /// What the body's topology has now; to be asked with next time.
    pub version: u64,
    /// All new nodes, in the order of their numbers.
    pub nodes: &'a [NewNodeSource],
    /// Triangles of [`Body::surface`](crate::Body::surface) whose corners changed or that are new; one may be named several times.
    pub triangles: &'a [u32],
    /// Springs that are gone: taken away by a blade or by hand, or replaced by springs of copies.
    pub removed_springs: &'a [[u32; 2]],
    /// New edges of the rim, as they were when they came: later cuts may have split or renumbered them.
    pub rim: &'a [NewRimEdge],
}

/// How long the lists were when a version came.
#[derive(Clone, Copy, Debug)]
struct Lengths {
    nodes: usize,
    triangles: usize,
    removed_springs: usize,
    rim: usize,
}

saved! { Lengths { nodes, triangles, removed_springs, rim } }

/// All that has changed since the body was made.
#[derive(Debug, Default)]
pub(super) struct ChangeLog {
    nodes: Vec<NewNodeSource>,
    triangles: Vec<u32>,
    removed_springs: Vec<[u32; 2]>,
    rim: Vec<NewRimEdge>,
    /// For each version but the first.
    versions: Vec<Lengths>,
}

saved! { ChangeLog { nodes, triangles, removed_springs, rim, versions } }

impl ChangeLog {
    pub fn version(&self) -> u64 {
        self.versions.len() as u64
    }

    fn lengths(&self) -> Lengths {
        Lengths {
            nodes: self.nodes.len(),
            triangles: self.triangles.len(),
            removed_springs: self.removed_springs.len(),
            rim: self.rim.len(),
        }
    }

    /// Makes room for a version with these changes, and so many springs that are gone.
    pub fn reserve(&mut self, changes: &Changes, removed_springs: usize) -> Result<()> {
        self.nodes.try_reserve(changes.nodes.len() + changes.sources.len())?;
        self.triangles.try_reserve(changes.triangles.len())?;
        self.removed_springs.try_reserve(removed_springs)?;
        self.rim.try_reserve(changes.rim.len())?;
        Ok(self.versions.try_reserve(1)?)
    }

    /// Begins a version with these changes, for which there is room.
    pub fn add(&mut self, changes: &Changes, removed_springs: &[[u32; 2]]) {
        let before = self.lengths();
        self.versions.push(before);
        let drawn = changes.sources.iter().map(|source| NewNodeSource {
            node: source.point,
            sources: source.sources,
            weights: source.weights.map(|weight| weight as f32),
        });
        self.nodes.extend(drawn);
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

    /// Makes room for a spring that is removed by hand.
    pub fn reserve_one(&mut self) -> Result<()> {
        self.removed_springs.try_reserve(1)?;
        Ok(self.versions.try_reserve(1)?)
    }

    /// Begins a version with a spring less, for which there is room.
    pub fn add_removed_spring(&mut self, spring: [u32; 2]) {
        self.versions.push(self.lengths());
        self.removed_springs.push(spring);
    }

    /// What came after a version.
    pub fn since(&self, version: u64) -> Result<TopologyChanges<'_>> {
        let now = self.version();
        ensure!(version <= now, to_come(version, now));
        let from = usize::try_from(version)
            .ok()
            .and_then(|version| self.versions.get(version));
        let from = from.copied().unwrap_or(self.lengths());
        Ok(TopologyChanges {
            version: now,
            nodes: &self.nodes[from.nodes..],
            triangles: &self.triangles[from.triangles..],
            removed_springs: &self.removed_springs[from.removed_springs..],
            rim: &self.rim[from.rim..],
        })
    }
}

/// What there is of a body that cannot be cut.
pub(super) fn unchanged(version: u64) -> Result<TopologyChanges<'static>> {
    ensure!(version == 0, to_come(version, 0));
    Ok(TopologyChanges {
        version,
        nodes: &[],
        triangles: &[],
        removed_springs: &[],
        rim: &[],
    })
}

fn to_come(version: u64, now: u64) -> Error {
    Error::invalid(format!("version is {version}: the body's topology has version {now}"))
}
