//! Cuts, and what they change.

use glam::Vec3;

use super::body::{sinew_body_id, with_body};
use super::guard::{sinew_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::body::{NewNodeSource, NewRimEdge};
use crate::cutting::Sweep;
use crate::def::expect_count;

/// What a cut did.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_cut_report {
    /// Set by the caller.
    pub struct_size: usize,
    /// Nodes that are new: copies of others, and points of the surface that are bound to nodes.
    pub new_nodes: u32,
    /// Triangles of the surface that are new.
    pub new_triangles: u32,
    /// Springs that are gone: taken away by the blade, or replaced by springs of copies.
    pub springs_removed: u32,
    /// How many more pieces the surface has.
    pub pieces_parted: u32,
    /// How long the cut is, in the rest shape, m; of tetrahedra on their skin.
    pub length: f64,
    /// Of tetrahedra: how large the faces are that have opened, in the rest shape, each on one of its sides, m².
    /// A cell in which the cut ends holds: this can be less than what the blade swept.
    pub area: f64,
}

/// Where a node that a cut added comes from: what it carries (texture coordinates, weights of a skin) follows by these weights.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_new_node {
    /// The new node: one more than that of the entry before.
    pub node: u32,
    /// Those that it lies between, each of a lower number than its own; those beyond the first may repeat it with weight 0. A copy has the
    /// node that it was copied from alone.
    pub sources: [u32; 3],
    /// How much of each, at least 0, 1 in all.
    pub weights: [f32; 3],
}

/// An edge of the rim of a cut. Each edge that was cut is two of them, one on either side.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_rim_edge {
    /// Its ends, in the order in which its triangle has them.
    pub nodes: [u32; 2],
    /// The triangle of the surface that it is a side of.
    pub triangle: u32,
}

/// What has come, changed or gone. The lists are valid until the next change of topology of the body, or its end.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_topology_changes {
    /// Set by the caller.
    pub struct_size: usize,
    /// What the body's topology has now; to be asked with next time.
    pub version: u64,
    /// All new nodes, in the order of their numbers.
    pub nodes: *const sinew_new_node,
    /// How many.
    pub node_count: usize,
    /// Triangles, by their places in sinew_body_get_triangles, whose corners changed or that are new; one may be named several times.
    pub triangles: *const u32,
    /// How many.
    pub triangle_count: usize,
    /// Springs that are gone, 2 removed_spring_count nodes: taken away by a blade or by hand, or replaced by springs of copies.
    pub removed_springs: *const u32,
    /// How many.
    pub removed_spring_count: usize,
    /// New edges of the rim, as they were when they came: later cuts may have split or renumbered them.
    pub rim: *const sinew_rim_edge,
    /// How many.
    pub rim_count: usize,
}

/// Triangles of three nodes each, outward by the right-hand rule; valid until the next change of topology of the body, or its end.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_triangle_view {
    /// 3 `count` nodes.
    pub data: *const u32,
    /// How many triangles.
    pub count: usize,
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_cut_report {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_cut_report";
}

// SAFETY: repr(C), begins with struct_size; numbers and pointers, which any bits are.
unsafe impl Versioned for sinew_topology_changes {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_topology_changes";
}

// The lists are lent as they are kept.
const _: () = assert!(size_of::<sinew_new_node>() == size_of::<NewNodeSource>());
const _: () = assert!(size_of::<sinew_rim_edge>() == size_of::<NewRimEdge>());

/// Cuts a body where a blade's edge passed from one place to another, while its nodes are where they are: `start` and `end` are the two
/// ends of the edge, 6 floats each, m. Between them it swept two triangles, which share the way from the first end at the start to the second at
/// the end. `report` is nullable; its struct_size is set by the caller.
///
/// Where the blade crosses an edge of the surface, or ends within a triangle, there is a point of the surface from then on: one that is there, or on
/// an edge that is there, if it lies within 5 % of the shortest edge of the triangle that is simulated there, at rest. Between them the
/// surface is open; a cut that goes on where the last ended joins it. What is simulated stays as well shaped as it was: a triangle whose material
/// fell apart is copied for each piece, with nodes that are not drawn where its material is beyond the cut, and with its part of masses and
/// stiffnesses; copies share nodes where their material hangs together (Molino, Bao, Fedkiw 2004). Springs along no edge of a triangle are taken
/// away where the blade passed through them.
///
/// Of tetrahedra the edges that the blade crosses are divided in the same way, and faces between points on its way open once one of their corners
/// parts: at the latest when a tetrahedron's last edge is crossed. What was inside is drawn from then on. A body of springs alone loses those
/// that the blade passed through.
///
/// A sweep that begins just where the last of the body ended goes on with it: it begins where the tissue that the blade stood in has gone
/// meanwhile. A blade that stays in tissue that moves so leaves no bridges.
///
/// Nodes keep their numbers, and new ones are numbered on: copies, which move as what they copied moved, and points of the surface between nodes,
/// which have no mass and go where their nodes go. Mass, momentum and energy stay what they were. What holds a node holds it where it is
/// drawn; copies of it beyond the cut are free, and have the mass of their material in the mean where it had none. It takes as long as the cut is
/// large, but with NEWTON, which is made anew. Positions and triangles that were lent before are stale; sinew_body_get_topology_changes tells what has changed.
///
/// Terms beside springs go on in parts: home springs with those of the nodes' masses, what goes by springs with those, fibres with the tetrahedra, and hinges of
/// bending by area, where pieces of both triangles still share the edge. A hinge whose edge is cut along is gone, with its energy, and so is what a cavity had that is cut open.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID, SINEW_STATUS_UNSUPPORTED (spare_nodes was 0), SINEW_STATUS_CAPACITY (there are
/// not as many spare nodes left, or FAST_LINK: a node has no free place), SINEW_STATUS_OUT_OF_MEMORY; then nothing has changed.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated; `report` is NULL or writable for the size that it
/// states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_cut(
    world: *mut sinew_world,
    body: sinew_body_id,
    start: *const f32,
    end: *const f32,
    report: *mut sinew_cut_report,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let start = edge("start", start)?;
            let end = edge("end", end)?;
            let out = if report.is_null() {
                None
            } else {
                Some(memory::report("report", report)?)
            };
            let done = world.cut(body.id(), &Sweep { start, end })?;
            if let Some(out) = out {
                out.fill(sinew_cut_report {
                    struct_size: size_of::<sinew_cut_report>(),
                    new_nodes: done.new_nodes,
                    new_triangles: done.new_triangles,
                    springs_removed: done.springs_removed,
                    pieces_parted: done.pieces_parted,
                    length: done.length,
                    area: done.area,
                });
            }
            Ok(())
        })
    }
}

/// Writes what has changed since a version of a body's topology: 0 when it was made, and what was told as `version` the last time.
/// `out->struct_size` is set by the caller. Nothing is copied, but for bodies that were not cut the lists are empty.
///
/// A renderer that follows gives each new node what its sources carry, by their weights, and reads the triangles that are named again.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the version is to come), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_topology_changes(
    world: *const sinew_world,
    body: sinew_body_id,
    since_version: u64,
    out: *mut sinew_topology_changes,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let changes = body.changes_since(since_version)?;
            memory::report("out", out)?.fill(sinew_topology_changes {
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
            });
            Ok(())
        })
    }
}

/// Writes a view of the triangles that are drawn and touched: those of the definition, or the boundary of its tetrahedra or cells, as cuts have
/// changed them. Nothing is copied.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_triangles(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_triangle_view,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let triangles = body.surface();
            *memory::output("out", out)? = sinew_triangle_view {
                data: triangles.as_ptr().cast(),
                count: triangles.len(),
            };
            Ok(())
        })
    }
}

/// Writes which piece each node belongs to, from 0 on, and how many there are: nodes hang together by springs, elements and the surface.
/// `pieces` are `count` numbers, as many as the body has nodes; nullable, as `piece_count` is. All nodes are looked at.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `count` is not the body's), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `pieces` is NULL or as long as stated, `piece_count` NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_pieces(
    world: *const sinew_world,
    body: sinew_body_id,
    pieces: *mut u32,
    count: usize,
    piece_count: *mut u32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let out = memory::optional_output_array("pieces", pieces, count)?;
            let piece_count = memory::optional_output_array("piece_count", piece_count, 1)?;
            if out.is_some() {
                expect_count("pieces", count, body.node_count())?;
            }
            let found = body.pieces()?;
            if let Some(out) = out {
                out.copy_from_slice(&found.of_nodes);
            }
            if let Some(piece_count) = piece_count {
                piece_count[0] = found.count;
            }
            Ok(())
        })
    }
}

/// Writes the mass of a node, kg: 0 of one that is pinned for good, or bound to others.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_node_mass(
    world: *const sinew_world,
    body: sinew_body_id,
    node: u32,
    out: *mut f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            *memory::output("out", out)? = body.node_mass(node)?;
            Ok(())
        })
    }
}

/// Both ends of a blade's edge.
///
/// # Safety
/// As [`memory::array`] of 6 numbers.
unsafe fn edge(name: &str, ends: *const f32) -> crate::base::Result<[Vec3; 2]> {
    // SAFETY: the same contract.
    let ends: &[[f32; 3]] = unsafe { memory::array(name, ends.cast(), 2) }?;
    Ok([ends[0], ends[1]].map(Vec3::from))
}
