//! Mesh file formats.

mod gmsh;
mod obj;
mod scanner;
mod stl;
mod tetgen;
mod vtk;

use std::io::{ErrorKind, Read};
use std::path::Path;

use super::repair::{LoadedMesh, NO_NODE, RawMesh};
use crate::base::{above_zero, ensure};
use crate::{Error, Result};
use scanner::Scanner;

/// The format of a mesh file.
///
/// ```
/// use sinew::mesh::{MeshFormat, load};
/// # let path = std::env::temp_dir().join(format!("sinew_mesh_format_{}.txt", std::process::id()));
/// # std::fs::write(&path, "v 0 0 0\nv 100 0 0\nv 0 0 100\nf 1 3 2\n").expect("a file");
/// // A file in millimeters whose name has no known extension.
/// let loaded = load(&path, MeshFormat::Obj, 0.001)?;
/// assert_eq!(loaded.mesh.positions[1].x, 0.1);
/// # std::fs::remove_file(&path).expect("the file");
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeshFormat {
    /// The format is chosen by the extension: `.obj`, `.stl`, `.vtk`, `.msh`, `.node` or `.ele`, in any case.
    #[default]
    Auto,
    /// Wavefront OBJ: `v` and `f`. Polygons become fans of triangles; lines and points are ignored.
    Obj,
    /// STL, binary or ASCII. Normals are ignored; the order of the corners defines the orientation.
    Stl,
    /// VTK legacy, versions 1 to 5, ASCII or binary: unstructured grids and polygonal data.
    Vtk,
    /// Gmsh, ASCII, versions 1, 2 and 4.1.
    Gmsh,
    /// TetGen: a `.node` and an `.ele` file in one folder, with the path of either.
    TetGen,
}

/// Reads a mesh and repairs it, see [`tidy`](super::tidy). `scale` is the length of a file unit in meters, above 0:
/// 0.001 for a file in millimeters.
///
/// Triangles and tetrahedra are read; second-order ones are reduced to their corners. Other polygons become triangles,
/// and triangles keep the file's orientation. Cells that are points or lines are ignored and counted. A file with
/// other cells, such as hexahedra, is an error, because the mesh would have holes.
///
/// Errors: [`Error::InvalidArgument`] if the scale is not finite and above 0, or makes a coordinate overflow `f32`, or
/// the extension is unknown. [`Error::Io`] for all problems of the file: it cannot be read, is truncated, malformed or
/// of another format, refers to a missing point, or has a coordinate that is not finite, or neither triangles nor
/// tetrahedra. The message has the path and the line, or the byte offset in binary data. [`Error::OutOfMemory`].
pub fn load(path: impl AsRef<Path>, format: MeshFormat, scale: f32) -> Result<LoadedMesh> {
    let path = path.as_ref();
    above_zero("scale", scale)?;
    let mut raw = match format {
        MeshFormat::Auto => return load(path, format_from_extension(path)?, scale),
        MeshFormat::TetGen => tetgen::read(path)?,
        MeshFormat::Obj => obj::read(&mut Scanner::new(path, &read_file(path)?))?,
        MeshFormat::Stl => stl::read(&mut Scanner::new(path, &read_file(path)?))?,
        MeshFormat::Vtk => vtk::read(&mut Scanner::new(path, &read_file(path)?))?,
        MeshFormat::Gmsh => gmsh::read(&mut Scanner::new(path, &read_file(path)?))?,
    };
    for vertex in &mut raw.vertices {
        *vertex *= f64::from(scale);
        ensure!(
            vertex.as_vec3().is_finite(),
            "scale is {scale}: a point of {} would be at {vertex}",
            path.display()
        );
    }
    let loaded = raw.tidy()?;
    if loaded.mesh.triangles.is_empty() && loaded.mesh.tetrahedra.is_empty() {
        return Err(Error::Io(format!(
            "{}: neither triangles nor tetrahedra remain; {} points, {} collapsed triangles and tetrahedra, {} cells of other kinds",
            path.display(),
            loaded.node_of_vertex.len(),
            loaded.report.collapsed_triangles + loaded.report.collapsed_tetrahedra,
            loaded.report.ignored_cells
        )));
    }
    Ok(loaded)
}

/// The format of a file by its extension.
fn format_from_extension(path: &Path) -> Result<MeshFormat> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    match extension.to_ascii_lowercase().as_str() {
        "obj" => Ok(MeshFormat::Obj),
        "stl" => Ok(MeshFormat::Stl),
        "vtk" => Ok(MeshFormat::Vtk),
        "msh" => Ok(MeshFormat::Gmsh),
        "node" | "ele" => Ok(MeshFormat::TetGen),
        _ => Err(Error::invalid(format!(
            "{}: the name does not tell the format; .obj, .stl, .vtk, .msh, .node and .ele do",
            path.display()
        ))),
    }
}

/// Reads all bytes of a file.
fn read_file(path: &Path) -> Result<Vec<u8>> {
    let failed = |error: std::io::Error| match error.kind() {
        ErrorKind::OutOfMemory => Error::OutOfMemory,
        _ => Error::Io(format!("{}: {error}", path.display())),
    };
    // A pipe or a device may never end.
    if !std::fs::metadata(path).map_err(failed)?.is_file() {
        return Err(Error::Io(format!("{}: not a file", path.display())));
    }
    let mut bytes = Vec::new();
    let mut file = std::fs::File::open(path).map_err(failed)?;
    file.read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

/// Returns an error if `u32` cannot count the vertices.
fn check_vertex_count(scanner: &Scanner, count: usize) -> Result<()> {
    if count > NO_NODE as usize {
        return Err(scanner.fail(format!("more than {NO_NODE} points")));
    }
    Ok(())
}
