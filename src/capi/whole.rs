//! A body as a whole: meshes into definitions, where it lies, and where it is moved.

use std::mem::offset_of;

use glam::{Quat, Vec3};
use std::ffi::c_void;

use super::body::{sinew_body_id, with_body, with_body_mut};
use super::definition::sinew_body_def;
use super::guard::{guard, sinew_world};
use super::memory;
use super::mesh::{create, sinew_mesh, sinew_mesh_view};
use super::status::sinew_status;
use crate::base::memory::copied;
use crate::base::{Error, ensure};
use crate::mesh::{LoadedMesh, Mesh, tidy};

/// Creates a mesh from arrays and cleans it like sinew_mesh_load.
///
/// `positions` [m] holds 3 * node_count floats, `triangles` 3 * triangle_count and `tetrahedra` 4 * tetrahedron_count
/// node indices. node_of_vertex of sinew_mesh_view maps the given nodes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_create(
    positions: *const f32,
    node_count: usize,
    triangles: *const u32,
    triangle_count: usize,
    tetrahedra: *const u32,
    tetrahedron_count: usize,
    out: *mut *mut sinew_mesh,
) -> sinew_status {
    create(out, || {
        tidy(&Mesh {
            positions: copied(memory::array("positions", positions.cast::<Vec3>(), node_count)?)?,
            triangles: copied(memory::array("triangles", triangles.cast(), triangle_count)?)?,
            tetrahedra: copied(memory::array("tetrahedra", tetrahedra.cast(), tetrahedron_count)?)?,
            ..Mesh::default()
        })
    })
}

/// Creates a mesh of tetrahedra that fills the closed surface of a mesh.
///
/// `spacing` [m] is the mean edge length. The result is that of sinew_body_create_from_surface.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the surface is open or inverted, or `spacing` unfit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mesh_create_filled(
    surface: *const sinew_mesh,
    spacing: f32,
    out: *mut *mut sinew_mesh,
) -> sinew_status {
    create(out, || {
        let surface = memory::reference("surface", surface)?;
        LoadedMesh::unchanged(Mesh::filled(&surface.drawn()?, spacing)?)
    })
}

/// Sets the nodes and elements of a body definition to those of a mesh.
///
/// The mesh must exist until the body is created.
///
/// Errors: SINEW_STATUS_UNSUPPORTED for a mesh of cells if `def` is of an older header.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_def_set_mesh(def: *mut sinew_body_def, mesh: *const sinew_mesh) -> sinew_status {
    guard(|| {
        let mut changed = memory::definition("def", def, sinew_body_def::defaults())?;
        let view = sinew_mesh_view::of(memory::reference("mesh", mesh)?);
        let (size, cell_count) = (changed.struct_size, view.cell_count);
        ensure!(
            cell_count == 0 || size > offset_of!(sinew_body_def, cells),
            Error::Unsupported(format!(
                "mesh has {cell_count} cells: def->struct_size is {size}, of an older header that has no field for them"
            ))
        );
        changed.take_mesh(&view);
        memory::write_report("def", def, changed)
    })
}

/// Rotates a body about a pivot and then translates it, with its pins and velocities.
///
/// `translation` [m], `rotation` and `pivot` [m] are nullable: none, none, and the center of the bounding box. Nothing
/// is swept; otherwise like sinew_body_set_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_transform(
    world: *mut sinew_world,
    body: sinew_body_id,
    translation: *const f32,
    rotation: *const f32,
    pivot: *const f32,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        let translation = memory::optional_array("translation", translation.cast::<Vec3>(), 1)?;
        let rotation = memory::optional_orientation("rotation", rotation)?.unwrap_or(Quat::IDENTITY);
        let pivot = memory::optional_array("pivot", pivot.cast::<Vec3>(), 1)?;
        let translation = translation.map_or(Vec3::ZERO, |translation| translation[0]);
        body.transform(translation, rotation, pivot.map(|pivot| pivot[0]))
    })
}

/// Writes the bounding box [m] of the nodes of a body, as two corners of 3 floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_bounds(
    world: *const sinew_world,
    body: sinew_body_id,
    out_min: *mut f32,
    out_max: *mut f32,
) -> sinew_status {
    with_body(world, body, |body| {
        let [min, max] = body.bounds().map(|corner| corner.to_array());
        memory::write_both(("out_min", out_min.cast(), min), ("out_max", out_max.cast(), max))
    })
}

/// Writes the unit normals of the surface of a body at its nodes, 3 * node_count floats.
///
/// They are area-weighted and point outward; 0 for a node without a triangle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_normals(
    world: *const sinew_world,
    body: sinew_body_id,
    out_normals: *mut f32,
    node_count: usize,
) -> sinew_status {
    with_body(world, body, |body| {
        body.normals(memory::output_array("out_normals", out_normals.cast(), node_count)?)
    })
}

/// Writes the masses [kg] of all nodes of a body; see sinew_body_get_node_mass.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_masses(
    world: *const sinew_world,
    body: sinew_body_id,
    out_masses: *mut f32,
    node_count: usize,
) -> sinew_status {
    with_body(world, body, |body| {
        body.node_masses(memory::output_array("out_masses", out_masses, node_count)?)
    })
}

/// Changes the velocities of nodes at once by impulses [N s], 3 * count floats.
///
/// `nodes`: `count` indices, which may repeat. None acts on a pinned or attached node or axis.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_apply_impulses(
    world: *mut sinew_world,
    body: sinew_body_id,
    nodes: *const u32,
    impulses: *const f32,
    count: usize,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        let nodes = memory::array("nodes", nodes, count)?;
        body.apply_impulses(nodes, memory::array("impulses", impulses.cast(), count)?)
    })
}

/// Sets the factor of the world's gravity on a body, any finite number, from the next step on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_gravity_scale(
    world: *mut sinew_world,
    body: sinew_body_id,
    scale: f32,
) -> sinew_status {
    with_body_mut(world, body, |body| body.set_gravity_scale(scale))
}

/// Writes the factor of the world's gravity on a body.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_gravity_scale(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut f32,
) -> sinew_status {
    with_body(world, body, |body| memory::write("out", out, body.gravity_scale()))
}

/// Sets an acceleration [m/s^2] of a body beside gravity, such as wind, from the next step on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_acceleration(
    world: *mut sinew_world,
    body: sinew_body_id,
    acceleration: *const f32,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        body.set_acceleration(memory::vector("acceleration", acceleration)?)
    })
}

/// Writes the acceleration [m/s^2] of sinew_body_set_acceleration, 3 floats; 0 by default.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_acceleration(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut f32,
) -> sinew_status {
    with_body(world, body, |body| {
        memory::write("out", out.cast(), body.acceleration().to_array())
    })
}

/// Stores a pointer of the caller, nullable, with a body; snapshots do not hold it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_user_data(
    world: *mut sinew_world,
    body: sinew_body_id,
    user_data: *mut c_void,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        body.set_user_data(user_data as usize);
        Ok(())
    })
}

/// Writes the pointer that is stored with a body; NULL by default.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_user_data(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut *mut c_void,
) -> sinew_status {
    with_body(world, body, |body| {
        memory::write("out", out, body.user_data() as *mut c_void)
    })
}
