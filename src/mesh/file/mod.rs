//! Mesh files.

mod gmsh;
mod obj;
mod scanner;
mod stl;
mod tetgen;
mod vtk;

use std::io::{ErrorKind, Read};
use std::path::Path;

use super::tidy::{LoadedMesh, NO_NODE, RawMesh};
use crate::base::{above_zero, ensure};
use crate::{Error, Result};
use scanner::Scanner;

/// How a mesh is written in a file.
///
/// ```
/// use sinew::mesh::{MeshFormat, load};
/// # let path = std::env::temp_dir().join(format!("sinew_mesh_format_{}.txt", std::process::id()));
/// # std::fs::write(&path, "v 0 0 0\nv 100 0 0\nv 0 0 100\nf 1 3 2\n").expect("a file");
/// // A file in millimetres, whose name says nothing about its format.
/// let loaded = load(&path, MeshFormat::Obj, 0.001)?;
/// assert_eq!(loaded.mesh.positions[1].x, 0.1);
/// # std::fs::remove_file(&path).expect("the file");
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeshFormat {
    /// By the file's name: `.obj`, `.stl`, `.vtk`, `.msh`, `.node` or `.ele`, in any case.
    #[default]
    Auto,
    /// Wavefront OBJ: `v` and `f`. Polygons become fans of triangles, lines and points are ignored.
    Obj,
    /// STL, binary or ASCII. The normals are not read: the order of the corners says what is outside.
    Stl,
    /// VTK legacy, versions 1 to 5, ASCII or binary: unstructured grids and polygonal data.
    Vtk,
    /// Gmsh, ASCII, versions 1, 2 and 4.1.
    Gmsh,
    /// TetGen: a `.node` and an `.ele` file side by side, whichever of them is named.
    TetGen,
}

/// Reads a mesh and makes it tidy, as [`tidy`](super::tidy) describes. `scale` is what one unit of the file is in
/// metres, above 0: 0.001 for a file in millimetres.
///
/// Triangles and tetrahedra are used, those of second order by their corners; other polygons become triangles, and the
/// triangles keep the file's direction. Cells that are points or lines are ignored and counted. A file with other cells,
/// such as hexahedra, is refused, since the mesh would have holes.
///
/// Errors: [`Error::InvalidArgument`] for a scale that is not above 0 and finite or takes a coordinate out of the range
/// of `f32`, and for a name that does not tell the format; [`Error::Io`] for everything that is wrong with the file (it
/// cannot be read, is cut short, is malformed or of another format, names a point it does not have, holds a coordinate
/// that is not finite, or no triangles and tetrahedra at all), with its path and the line, in binary data the byte;
/// [`Error::OutOfMemory`].
pub fn load(path: impl AsRef<Path>, format: MeshFormat, scale: f32) -> Result<LoadedMesh> {
    let path = path.as_ref();
    above_zero("scale", scale)?;
    let mut raw = match format {
        MeshFormat::Auto => return load(path, format_of(path)?, scale),
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

/// The format that a file's name tells.
fn format_of(path: &Path) -> Result<MeshFormat> {
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

/// All bytes of a file.
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

/// Refuses more vertices than can be named.
fn check_vertex_count(scanner: &Scanner, count: usize) -> Result<()> {
    if count > NO_NODE as usize {
        return Err(scanner.fail(format!("more than {NO_NODE} points")));
    }
    Ok(())
}
