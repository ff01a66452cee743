//! Meshes: from files, and shapes that need none.

use std::ffi::c_char;

use super::guard::{destroy, guard};
use super::memory::{self, versioned};
use super::status::sinew_status;
use crate::base::{Error, Result};
use crate::mesh::{self, LoadedMesh, Mesh, MeshFormat, is_closed};

/// Immutable mesh of nodes, triangles, tetrahedra and cells, readable by any number of threads.
pub struct sinew_mesh {
    loaded: LoadedMesh,
    surface: Vec<[u32; 3]>,
    closed: bool,
}

/// By file name: .obj .stl .vtk .msh .node .ele.
pub const SINEW_MESH_FORMAT_AUTO: u32 = 0;
/// Wavefront OBJ.
pub const SINEW_MESH_FORMAT_OBJ: u32 = 1;
/// STL, binary or ASCII.
pub const SINEW_MESH_FORMAT_STL: u32 = 2;
/// VTK legacy, ASCII or binary: unstructured grid or polygonal data.
pub const SINEW_MESH_FORMAT_VTK: u32 = 3;
/// Gmsh 1, 2 and 4.1, ASCII.
pub const SINEW_MESH_FORMAT_GMSH: u32 = 4;
/// TetGen .node and .ele with the same base name; name either.
pub const SINEW_MESH_FORMAT_TETGEN: u32 = 5;

/// Value of node_of_vertex for a dropped vertex.
pub const SINEW_NO_NODE: u32 = u32::MAX;

/// Borrowed contents of a mesh, and a report of its cleaning.
///
/// Lifetime: until the mesh is destroyed.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_mesh_view {
    /// Set to sizeof(sinew_mesh_view) before the call.
    pub struct_size: usize,
    /// [m] 3 * node_count floats.
    pub positions: *const f32,
    /// Number of nodes; every node is used.
    pub node_count: usize,
    /// 3 * triangle_count node indices: triangles of the file or shape.
    pub triangles: *const u32,
    /// Number of triangles.
    pub triangle_count: usize,
    /// 4 * tetrahedron_count node indices, of positive volume.
    pub tetrahedra: *const u32,
    /// Number of tetrahedra.
    pub tetrahedron_count: usize,
    /// 3 * surface_triangle_count node indices, outward: the boundary of the tetrahedra or cells, if any, else the
    /// triangles.
    pub surface: *const u32,
    /// Number of surface triangles.
    pub surface_triangle_count: usize,
    /// vertex_count nodes, one of each vertex, or SINEW_NO_NODE.
    pub node_of_vertex: *const u32,
    /// Number of vertices in the file; for a shape its nodes.
    pub vertex_count: usize,
    /// Number of vertices merged into an earlier one.
    pub welded_vertices: usize,
    /// Number of unused vertices dropped.
    pub dropped_vertices: usize,
    /// Number of degenerate or duplicate triangles dropped.
    pub dropped_triangles: usize,
    /// Number of degenerate or duplicate tetrahedra dropped.
    pub dropped_tetrahedra: usize,
    /// Number of inverted tetrahedra corrected.
    pub flipped_tetrahedra: usize,
    /// 1: every surface edge is used equally often in both directions; 0: open.
    pub is_closed: u32,
    /// 8 * cell_count node indices of cubes; corner bits: x 1, y 2, z 4.
    pub cells: *const u32,
    /// Number of cells.
    pub cell_count: usize,
}

versioned! { sinew_mesh_view { cells } }

impl sinew_mesh {
    /// Its surface as a mesh of its own.
    pub(super) fn drawn(&self) -> Result<Mesh> {
        Ok(Mesh {
            positions: crate::base::memory::copied(&self.loaded.mesh.positions)?,
            triangles: crate::base::memory::copied(&self.surface)?,
            ..Mesh::default()
        })
    }
}

impl sinew_mesh_view {
    pub(super) fn of(mesh: &sinew_mesh) -> Self {
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
            is_closed: u32::from(*closed),
            cells: loaded.mesh.cells.as_ptr().cast(),
            cell_count: loaded.mesh.cells.len(),
        }
    }
}

/// Makes a mesh for the caller.
///
/// # Safety
/// `out` is NULL or writable.
pub(super) unsafe fn create(out: *mut *mut sinew_mesh, mut make: impl FnMut() -> Result<LoadedMesh>) -> sinew_status {
    guard(|| {
        let out = memory::output("out", out)?;
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

/// Loads a mesh from a file and cleans it.
///
/// It welds coincident vertices, drops degenerate and duplicate elements and unused vertices, and corrects inverted
/// tetrahedra. `path` is UTF-8, `format` a sinew_mesh_format value, `scale` [m] the length of one file unit, above 0.
///
/// Errors: SINEW_STATUS_IO for a missing or malformed file; the message names the line or byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_load(
    path: *const c_char,
    format: u32,
    scale: f32,
    out: *mut *mut sinew_mesh,
) -> sinew_status {
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

/// Creates a cloth of triangles in the plane y = 0, centered at the origin, with normals along +y.
///
/// `size` [m] holds the extents along x and z, above 0; `cells` the 2 counts of squares, above 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_create_cloth(
    size: *const f32,
    cells: *const u32,
    out: *mut *mut sinew_mesh,
) -> sinew_status {
    create(out, || {
        let size: &[f32; 2] = memory::reference("size", size.cast())?;
        let cells: &[u32; 2] = memory::reference("cells", cells.cast())?;
        LoadedMesh::unchanged(Mesh::cloth(*size, *cells)?)
    })
}

/// Creates a box of tetrahedra, centered at the origin.
///
/// `size` [m] holds the 3 extents, above 0; `cells` the 3 cell counts, at least 1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_create_block(
    size: *const f32,
    cells: *const u32,
    out: *mut *mut sinew_mesh,
) -> sinew_status {
    create(out, || {
        let size: &[f32; 3] = memory::reference("size", size.cast())?;
        let cells: &[u32; 3] = memory::reference("cells", cells.cast())?;
        LoadedMesh::unchanged(Mesh::block(*size, *cells)?)
    })
}

/// Creates a lattice of cubes, centered at the origin.
///
/// `edge` [m] is the edge length of a cube, above 0; `cells` holds the 3 cell counts, at least 1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_create_lattice(
    edge: f32,
    cells: *const u32,
    out: *mut *mut sinew_mesh,
) -> sinew_status {
    create(out, || {
        let cells: &[u32; 3] = memory::reference("cells", cells.cast())?;
        LoadedMesh::unchanged(Mesh::lattice(edge, *cells)?)
    })
}

/// Creates a liver-like organ of tetrahedra, centered at the origin and thin in y.
///
/// `length` [m] is its extent along x and `spacing` [m] the node spacing, both above 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_create_organ(length: f32, spacing: f32, out: *mut *mut sinew_mesh) -> sinew_status {
    create(out, || LoadedMesh::unchanged(Mesh::organ(length, spacing)?))
}

/// Writes a view of the contents of a mesh, which ends with the mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_get_view(mesh: *const sinew_mesh, out: *mut sinew_mesh_view) -> sinew_status {
    guard(|| {
        let mesh = memory::reference("mesh", mesh)?;
        memory::write_report("out", out, sinew_mesh_view::of(mesh))
    })
}

/// Destroys a mesh and ends its views; NULL has no effect.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_destroy(mesh: *mut sinew_mesh) {
    destroy(mesh);
}
