//! Meshes: from files, and shapes that need none.

use std::mem::offset_of;

use libc::c_char;

use super::guard::guard;
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::base::{Error, Result};
use crate::mesh::{self, LoadedMesh, Mesh, MeshFormat, is_closed};

/// A mesh: positions, triangles, tetrahedra and cells. It belongs to the caller, never changes, and may be read by any number of
/// threads at once.
pub struct sinew_mesh {
    loaded: LoadedMesh,
    surface: Vec<[u32; 3]>,
    closed: bool,
}

/// By the file's name: .obj .stl .vtk .msh .node .ele.
pub const SINEW_MESH_FORMAT_AUTO: u32 = 0;
/// Wavefront OBJ.
pub const SINEW_MESH_FORMAT_OBJ: u32 = 1;
/// STL, binary or ASCII.
pub const SINEW_MESH_FORMAT_STL: u32 = 2;
/// VTK legacy: unstructured grids and polygonal data, ASCII or binary.
pub const SINEW_MESH_FORMAT_VTK: u32 = 3;
/// Gmsh, versions 1, 2 and 4.1, ASCII.
pub const SINEW_MESH_FORMAT_GMSH: u32 = 4;
/// TetGen: .node and .ele side by side, whichever is named.
pub const SINEW_MESH_FORMAT_TETGEN: u32 = 5;

/// In node_of_vertex: the vertex was dropped.
pub const SINEW_NO_NODE: u32 = u32::MAX;

/// What a mesh holds, and what was tidied; all borrowed from the mesh, valid until its end.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_mesh_view {
    /// Set by the caller.
    pub struct_size: usize,
    /// 3 node_count floats, m.
    pub positions: *const f32,
    /// Nodes; each is used.
    pub node_count: usize,
    /// 3 triangle_count node indices: what the file or the shape gives as triangles.
    pub triangles: *const u32,
    /// Triangles.
    pub triangle_count: usize,
    /// 4 tetrahedron_count node indices, of positive volume.
    pub tetrahedra: *const u32,
    /// Tetrahedra.
    pub tetrahedron_count: usize,
    /// 3 surface_triangle_count node indices, outward: the boundary of the tetrahedra or cells; without either the
    /// triangles.
    pub surface: *const u32,
    /// Triangles of the surface.
    pub surface_triangle_count: usize,
    /// vertex_count node indices: for each vertex of the file its node, or SINEW_NO_NODE where it was dropped.
    pub node_of_vertex: *const u32,
    /// Vertices of the file; of a shape, its nodes.
    pub vertex_count: usize,
    /// Vertices that became one node with an earlier one.
    pub welded_vertices: usize,
    /// Points that nothing uses.
    pub dropped_vertices: usize,
    /// Collapsed or doubled.
    pub dropped_triangles: usize,
    /// Collapsed or doubled.
    pub dropped_tetrahedra: usize,
    /// Were inside out; two of their nodes were swapped.
    pub flipped_tetrahedra: usize,
    /// 1: every edge of the surface is used equally often in both directions; 0: it is open.
    pub closed: u32,
    /// 0.
    pub reserved: u32,
    /// 8 cell_count node indices: the cubes of a lattice, corners numbered by bits, x 1, y 2, z 4.
    pub cells: *const u32,
    /// Cells.
    pub cell_count: usize,
}

// SAFETY: repr(C), begins with struct_size; numbers and pointers, which any bits are.
unsafe impl Versioned for sinew_mesh_view {
    const SIZES: &'static [usize] = &[offset_of!(Self, cells), size_of::<Self>()];
    const NAME: &'static str = "sinew_mesh_view";
}

impl sinew_mesh_view {
    fn of(mesh: &sinew_mesh) -> Self {
        let sinew_mesh {
            loaded,
            surface,
            closed,
        } = mesh;
        let report = &loaded.report;
        Self {
            struct_size: size_of::<Self>(),
            positions: loaded.mesh.positions.as_ptr().cast(),
            node_count: loaded.mesh.positions.len(),
            triangles: loaded.mesh.triangles.as_ptr().cast(),
            triangle_count: loaded.mesh.triangles.len(),
            tetrahedra: loaded.mesh.tetrahedra.as_ptr().cast(),
            tetrahedron_count: loaded.mesh.tetrahedra.len(),
            surface: surface.as_ptr().cast(),
            surface_triangle_count: surface.len(),
            node_of_vertex: loaded.node_of_vertex.as_ptr(),
            vertex_count: loaded.node_of_vertex.len(),
            welded_vertices: report.welded_vertices,
            dropped_vertices: report.dropped_vertices,
            dropped_triangles: report.dropped_triangles(),
            dropped_tetrahedra: report.dropped_tetrahedra(),
            flipped_tetrahedra: report.flipped_tetrahedra,
            closed: u32::from(*closed),
            reserved: 0,
            cells: loaded.mesh.cells.as_ptr().cast(),
            cell_count: loaded.mesh.cells.len(),
        }
    }
}

/// Makes a mesh for the caller.
///
/// # Safety
/// `out` is NULL or writable.
unsafe fn create(out: *mut *mut sinew_mesh, make: impl FnOnce() -> Result<LoadedMesh>) -> sinew_status {
    guard(|| {
        // SAFETY: the same contract.
        let out = unsafe { memory::output("out", out) }?;
        let loaded = make()?;
        let surface = loaded.mesh.surface()?;
        let closed = is_closed(&surface)?;
        *out = Box::into_raw(crate::base::memory::boxed(sinew_mesh {
            loaded,
            surface,
            closed,
        })?);
        Ok(())
    })
}

/// Reads a mesh from a file and makes it tidy: corners that lie together become one node, collapsed and doubled elements
/// and points that nothing uses are dropped, tetrahedra that are inside out are turned; the view counts it all. `path` is
/// UTF-8, `format` a SINEW_MESH_FORMAT_..., `scale` what one unit of the file is in m, above 0. The caller destroys the mesh
/// with sinew_mesh_destroy.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT; SINEW_STATUS_IO (missing, cut short, malformed, of another format, with indices
/// out of range or numbers that are not finite: the message names the line or byte); SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `path` is NULL or ends with NUL; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_load(
    path: *const c_char,
    format: u32,
    scale: f32,
    out: *mut *mut sinew_mesh,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        create(out, || {
            let format = match format {
                SINEW_MESH_FORMAT_AUTO => MeshFormat::Auto,
                SINEW_MESH_FORMAT_OBJ => MeshFormat::Obj,
                SINEW_MESH_FORMAT_STL => MeshFormat::Stl,
                SINEW_MESH_FORMAT_VTK => MeshFormat::Vtk,
                SINEW_MESH_FORMAT_GMSH => MeshFormat::Gmsh,
                SINEW_MESH_FORMAT_TETGEN => MeshFormat::TetGen,
                unknown => return Err(Error::invalid(format!("format is {unknown}: no SINEW_MESH_FORMAT_..."))),
            };
            mesh::load(memory::text("path", path)?, format, scale)
        })
    }
}

/// Makes a cloth in the plane y = 0 about the origin, up outward: `size` are its 2 extents along x and z, m, above 0,
/// `cells` its 2 numbers of cells, at least 1, of two triangles each. The caller destroys it with sinew_mesh_destroy.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `size` is NULL or 2 floats, `cells` NULL or 2 numbers; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_create_cloth(
    size: *const f32,
    cells: *const u32,
    out: *mut *mut sinew_mesh,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        create(out, || {
            let size: &[f32; 2] = memory::reference("size", size.cast())?;
            let cells: &[u32; 2] = memory::reference("cells", cells.cast())?;
            LoadedMesh::unchanged(Mesh::cloth(*size, *cells)?)
        })
    }
}

/// Makes a block of tetrahedra about the origin: `size` are its 3 extents, m, above 0, `cells` its 3 numbers of cells, at
/// least 1. The caller destroys it with sinew_mesh_destroy.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `size` is NULL or 3 floats, `cells` NULL or 3 numbers; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_create_block(
    size: *const f32,
    cells: *const u32,
    out: *mut *mut sinew_mesh,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        create(out, || {
            let size: &[f32; 3] = memory::reference("size", size.cast())?;
            let cells: &[u32; 3] = memory::reference("cells", cells.cast())?;
            LoadedMesh::unchanged(Mesh::block(*size, *cells)?)
        })
    }
}

/// Makes a lattice of cubes about the origin: `edge` is the length of theirs, m, above 0, `cells` their 3 numbers along the axes,
/// at least 1. The caller destroys it with sinew_mesh_destroy.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `cells` is NULL or 3 numbers; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_create_lattice(
    edge: f32,
    cells: *const u32,
    out: *mut *mut sinew_mesh,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        create(out, || {
            let cells: &[u32; 3] = memory::reference("cells", cells.cast())?;
            LoadedMesh::unchanged(Mesh::lattice(edge, *cells)?)
        })
    }
}

/// Makes an organ, liver-like, of tetrahedra about the origin: `length` is its longest extent, along x, and `spacing` that
/// of its nodes, both m, above 0. Thin in y. The caller destroys it with sinew_mesh_destroy.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_create_organ(length: f32, spacing: f32, out: *mut *mut sinew_mesh) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { create(out, || LoadedMesh::unchanged(Mesh::organ(length, spacing)?)) }
}

/// Writes a view of what a mesh holds; nothing is copied, all is valid until the mesh's end. `out->struct_size` is set by
/// the caller.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `mesh` is NULL or a mesh that is not destroyed; `out` is NULL or writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_get_view(mesh: *const sinew_mesh, out: *mut sinew_mesh_view) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe {
        let mesh = memory::reference("mesh", mesh)?;
        memory::report("out", out)?.fill(sinew_mesh_view::of(mesh));
        Ok(())
    })
}

/// Destroys a mesh. NULL: nothing.
///
/// # Safety
/// `mesh` is NULL or a mesh that is not destroyed and that nobody uses any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_destroy(mesh: *mut sinew_mesh) {
    if !mesh.is_null() {
        guard(|| {
            // SAFETY: made by Box::into_raw in `create`, and given back once.
            drop(unsafe { Box::from_raw(mesh) });
            Ok(())
        });
    }
}
