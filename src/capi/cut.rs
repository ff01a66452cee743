//! Cuts, and what they change.

use glam::Vec3;

use super::body::{sinew_body_id, with_body};
use super::guard::{sinew_world, with_world_mut};
use super::memory::{self, told, versioned};
use super::status::sinew_status;
use crate::body::{CutReport, NewNodeSource, NewRimEdge};
use crate::cutting::Sweep;
use crate::def::expect_count;

/// Report of a cut.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_cut_report {
    /// Set to sizeof(sinew_cut_report) before the call.
    pub struct_size: usize,
    /// Number of new nodes: copies, and surface points bound to nodes.
    pub new_nodes: u32,
    /// Number of new surface triangles.
    pub new_triangles: u32,
    /// Number of springs removed, or replaced by springs of copies.
    pub springs_removed: u32,
    /// Increase of the number of connected surface components.
    pub pieces_parted: u32,
    /// [m] Length of the cut in the rest shape; for a solid on its surface.
    pub length: f64,
    /// [m^2] Area of one side of a solid's opened faces at rest; a cell where it ends stays whole.
    pub area: f64,
}

/// Origin of a node that a cut added; vertex attributes interpolate by its weights.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_new_node {
    /// Index of the new node; indices increase by 1 per entry.
    pub node: u32,
    /// Source nodes, lower than the new node; an unused entry has weight 0.
    pub sources: [u32; 3],
    /// Weights of the sources, with sum 1; a copy has a single source.
    pub weights: [f32; 3],
}

/// Cut-boundary edge; each cut edge has one on either side.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_rim_edge {
    /// End nodes in the order of the triangle.
    pub nodes: [u32; 2],
    /// Triangle that has this edge; in a solid of the cut face.
    pub triangle: u32,
}

/// Changes of the topology of a body since a version.
///
/// Lifetime of the lists: until the next topology change of the body, or its destruction.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_topology_changes {
    /// Set to sizeof(sinew_topology_changes) before the call.
    pub struct_size: usize,
    /// Current topology version; pass it to the next call.
    pub version: u64,
    /// New nodes in ascending order of index.
    pub nodes: *const sinew_new_node,
    /// Number of new nodes.
    pub node_count: usize,
    /// Changed and new triangles of the surface; may repeat.
    pub triangles: *const u32,
    /// Number of triangle indices.
    pub triangle_count: usize,
    /// 2 * removed_spring_count nodes of removed springs.
    pub removed_springs: *const u32,
    /// Number of removed springs.
    pub removed_spring_count: usize,
    /// New cut-boundary edges as they were made; later cuts change them.
    pub rim: *const sinew_rim_edge,
    /// Number of cut-boundary edges.
    pub rim_count: usize,
}

/// Borrowed array of triangles of 3 node indices each, outward by the right-hand rule.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_triangle_view {
    /// 3 * count node indices.
    pub data: *const u32,
    /// Number of triangles.
    pub count: usize,
}

impl sinew_triangle_view {
    pub(super) fn of(triangles: &[[u32; 3]]) -> Self {
        Self {
            data: triangles.as_ptr().cast(),
            count: triangles.len(),
        }
    }
}

versioned! { sinew_cut_report, sinew_topology_changes }

told! { CutReport => sinew_cut_report { new_nodes, new_triangles, springs_removed, pieces_parted, length, area } }

// The lists are lent as they are kept.
const _: () = assert!(size_of::<sinew_new_node>() == size_of::<NewNodeSource>());
const _: () = assert!(size_of::<sinew_rim_edge>() == size_of::<NewRimEdge>());

/// Cuts a body along the surface that a blade's edge swept, at the current positions.
///
/// `start` and `end` [m] hold the 2 end points of the edge, 6 floats each. `out_report` is nullable. A sweep that
/// starts where the last one ended continues it. New nodes are appended, and views end; see
/// sinew_body_get_topology_changes.
///
/// Errors: SINEW_STATUS_UNSUPPORTED without spare_nodes; SINEW_STATUS_CAPACITY if too few are left.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_cut(
    world: *mut sinew_world,
    body: sinew_body_id,
    start: *const f32,
    end: *const f32,
    out_report: *mut sinew_cut_report,
) -> sinew_status {
    with_world_mut(world, |world| {
        let start = edge("start", start)?;
        let end = edge("end", end)?;
        let out = memory::optional_report("out_report", out_report)?;
        let done = world.cut(body.id(), &Sweep { start, end })?;
        if let Some(out) = out {
            out.fill(done.into());
        }
        Ok(())
    })
}

/// Writes the topology changes of a body since a version.
///
/// Pass 0 for all changes, then the `version` of the previous call. Interpolate the attributes of new nodes from their
/// sources and read the listed triangles again.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the version is in the future.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_topology_changes(
    world: *const sinew_world,
    body: sinew_body_id,
    since_version: u64,
    out: *mut sinew_topology_changes,
) -> sinew_status {
    with_body(world, body, |body| {
        let changes = body.changes_since(since_version)?;
        let filled = sinew_topology_changes {
            struct_size: size_of::<sinew_topology_changes>(),
            version: changes.version,
            nodes: changes.nodes.as_ptr().cast(),
            node_count: changes.nodes.len(),
            triangles: changes.triangles.as_ptr(),
            triangle_count: changes.triangles.len(),
            removed_springs: changes.removed_springs.as_ptr().cast(),
            removed_spring_count: changes.removed_springs.len(),
            rim: changes.rim.as_ptr().cast(),
            rim_count: changes.rim.len(),
        };
        memory::write_report("out", out, filled)
    })
}

/// Writes a view of the render and contact surface: the triangles of a body after all cuts.
///
/// Lifetime: until the next topology change of the body, or its destruction.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_triangles(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_triangle_view,
) -> sinew_status {
    with_body(world, body, |body| {
        memory::write("out", out, sinew_triangle_view::of(body.surface()))
    })
}

/// Writes the connected component of each node, from 0, and the number of components.
///
/// Nodes are connected by springs, elements and the surface. `out_pieces` receives `node_count` numbers; both outputs
/// are nullable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_pieces(
    world: *const sinew_world,
    body: sinew_body_id,
    out_pieces: *mut u32,
    node_count: usize,
    out_piece_count: *mut u32,
) -> sinew_status {
    with_body(world, body, |body| {
        let out = memory::optional_output_array("out_pieces", out_pieces, node_count)?;
        let out_piece_count = memory::optional_output_array("out_piece_count", out_piece_count, 1)?;
        if out.is_some() {
            expect_count("out_pieces", node_count, body.node_count())?;
        }
        let found = body.pieces()?;
        if let Some(out) = out {
            out.copy_from_slice(&found.of_nodes);
        }
        if let Some(out_piece_count) = out_piece_count {
            out_piece_count[0] = found.count;
        }
        Ok(())
    })
}

/// Writes how many nodes and surface triangles a body has at most after all cuts and tears.
///
/// `spare_nodes` more than at creation, and 2 triangles for each of those, 6 in a solid. A cut that needs more returns
/// SINEW_STATUS_CAPACITY. Both outputs are nullable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_max_counts(
    world: *const sinew_world,
    body: sinew_body_id,
    out_max_nodes: *mut u32,
    out_max_triangles: *mut u32,
) -> sinew_status {
    with_body(world, body, |body| {
        let [nodes, triangles] = [body.max_nodes(), body.max_triangles()].map(|most| most as u32);
        let triangles = ("out_max_triangles", out_max_triangles, triangles);
        memory::write_wanted(("out_max_nodes", out_max_nodes, nodes), triangles)
    })
}

/// Writes the mass of a node [kg]; 0 for a permanent pin or a node bound to others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_node_mass(
    world: *const sinew_world,
    body: sinew_body_id,
    node: u32,
    out: *mut f32,
) -> sinew_status {
    with_body(world, body, |body| memory::write("out", out, body.node_mass(node)?))
}

/// Both ends of a blade's edge.
///
/// # Safety
/// As [`memory::array`] of 6 numbers.
unsafe fn edge(name: &str, ends: *const f32) -> crate::base::Result<[Vec3; 2]> {
    let ends: &[[f32; 3]] = memory::array(name, ends.cast(), 2)?;
    Ok([ends[0], ends[1]].map(Vec3::from))
}
