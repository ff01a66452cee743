//! Fine surfaces that go with coarse bodies, and bodies made from surfaces.

use std::mem::MaybeUninit;

use super::body::{sinew_body_id, sinew_vec3_view};
use super::cut::sinew_triangle_view;
use super::definition::sinew_body_def;
use super::guard::{destroy, guard, sinew_world, with_world, with_world_mut};
use super::memory::{self, Versioned, versioned};
use super::status::sinew_status;
use crate::embedding::{Embedding, EmbeddingDefinition};

/// Embedding: a fine render surface that follows a coarse body.
///
/// The caller owns it. Use it on one thread at a time. The body has no cost from it.
pub struct sinew_embedding {
    embedding: Embedding,
}

/// Render surface of an embedding and the elements that it follows.
///
/// Filled by sinew_embedding_def_init; read only during sinew_embedding_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_embedding_def {
    /// Size of this struct; sinew_embedding_def_init sets it.
    pub struct_size: usize,
    /// [m] 3 * vertex_count floats for the body's current positions.
    pub vertices: *const f32,
    /// Number of vertices, at least 1.
    pub vertex_count: usize,
    /// 3 * triangle_count vertex indices, outward; nullable: no normals.
    pub triangles: *const u32,
    /// Number of triangles.
    pub triangle_count: usize,
    /// 4 * tetrahedron_count nodes: the body's tetrahedra at its creation; nullable.
    ///
    /// Each vertex keeps its weights in the nearest one, or, with NULL, its distance to the nearest surface triangle. A
    /// cut body uses its current tetrahedra.
    pub tetrahedra: *const u32,
    /// Number of tetrahedra.
    pub tetrahedron_count: usize,
}

versioned! { sinew_embedding_def }

impl sinew_embedding_def {
    /// # Safety
    /// Arrays of the lengths that it states, for as long as the result lives.
    unsafe fn definition<'a>(&self) -> crate::Result<EmbeddingDefinition<'a>> {
        Ok(EmbeddingDefinition {
            vertices: memory::array("vertices", self.vertices.cast(), self.vertex_count)?,
            triangles: memory::array("triangles", self.triangles.cast(), self.triangle_count)?,
            tetrahedra: memory::array("tetrahedra", self.tetrahedra.cast(), self.tetrahedron_count)?,
        })
    }
}

/// Fills an embedding definition with its defaults; `struct_size` is sizeof(sinew_embedding_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_def_init(def: *mut sinew_embedding_def, struct_size: usize) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, sinew_embedding_def::empty()))
}

/// Creates an embedding: binds a render surface to a body at its current positions.
///
/// It copies what `def` points to, and costs about 100 updates. Destroy it with sinew_embedding_destroy, before or
/// after the body and its world.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if no tetrahedron has a volume, or without a surface.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_create(
    world: *const sinew_world,
    body: sinew_body_id,
    def: *const sinew_embedding_def,
    out: *mut *mut sinew_embedding,
) -> sinew_status {
    with_world(world, |world| {
        let out = memory::output("out", out)?;
        let def = memory::definition("def", def, sinew_embedding_def::empty())?;
        let embedding = world.create_embedding(body.id(), &def.definition()?)?;
        *out = Box::into_raw(crate::base::memory::boxed(sinew_embedding { embedding })?);
        Ok(())
    })
}

/// Destroys an embedding and ends its views; NULL has no effect.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_destroy(embedding: *mut sinew_embedding) {
    destroy(embedding);
}

/// Moves the vertices of an embedding to the body's current positions.
///
/// After a cut or tear it allocates; vertices follow their side, and triangles across are dropped.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the nodes are not those it is bound to; SINEW_STATUS_UNSUPPORTED for a cut
/// body, if it is bound to triangles or some of the tetrahedra.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_update(
    embedding: *mut sinew_embedding,
    world: *const sinew_world,
) -> sinew_status {
    with_world(world, |world| {
        let embedding = memory::output("embedding", embedding)?;
        embedding.embedding.update(world)
    })
}

/// Moves the vertices of an embedding to node positions [m], 3 * node_count packed floats.
///
/// They are, for example, those of a reader's frame. It may run beside a step.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT for another number of nodes than at the last update.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_update_from(
    embedding: *mut sinew_embedding,
    positions: *const f32,
    node_count: usize,
) -> sinew_status {
    guard(|| {
        let embedding = memory::output("embedding", embedding)?;
        let positions = memory::array("positions", positions.cast(), node_count)?;
        embedding.embedding.update_from(positions)
    })
}

/// Writes a view of the vertex positions [m], which updates change.
///
/// Lifetime: until the embedding is destroyed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_get_positions(
    embedding: *const sinew_embedding,
    out: *mut sinew_vec3_view,
) -> sinew_status {
    guard(|| {
        let embedding = memory::reference("embedding", embedding)?;
        memory::write("out", out, sinew_vec3_view::of(embedding.embedding.positions()))
    })
}

/// Writes a view of the triangles, in the given order, without those across a cut.
///
/// Lifetime: until the first update after the next cut, or the embedding's destruction.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_get_triangles(
    embedding: *const sinew_embedding,
    out: *mut sinew_triangle_view,
) -> sinew_status {
    guard(|| {
        let triangles = memory::reference("embedding", embedding)?.embedding.triangles();
        memory::write("out", out, sinew_triangle_view::of(triangles))
    })
}

/// Computes the unit vertex normals if needed, and writes a view of them.
///
/// They are area-weighted and point outward; 0 without area. The view is empty without triangles. Lifetime: until the
/// embedding is destroyed; the next call after an update changes them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_get_normals(
    embedding: *mut sinew_embedding,
    out: *mut sinew_vec3_view,
) -> sinew_status {
    guard(|| {
        let embedding = memory::output("embedding", embedding)?;
        let out = memory::output("out", out)?;
        *out = sinew_vec3_view::of(embedding.embedding.normals());
        Ok(())
    })
}

/// Creates a body of tetrahedra that fills a closed surface, and binds the surface to it.
///
/// positions and triangles of `def` are the surface, outward; vertices may repeat. `spacing` [m] is the mean edge
/// length; features thinner than half of it are lost. `out_embedding` is nullable.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the surface is open or inverted, `spacing` too fine or too coarse, or `def`
/// lists elements, springs or values.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_create_from_surface(
    world: *mut sinew_world,
    def: *const sinew_body_def,
    spacing: f32,
    out_body: *mut sinew_body_id,
    out_embedding: *mut *mut sinew_embedding,
) -> sinew_status {
    with_world_mut(world, |world| {
        let out_body = memory::output("out_body", out_body)?;
        let out_embedding = match out_embedding.is_null() {
            true => None,
            false => Some(memory::output("out_embedding", out_embedding)?),
        };
        let def = memory::definition("def", def, sinew_body_def::defaults())?;
        // Nothing may fail once there is a body.
        let place = crate::base::memory::boxed(MaybeUninit::uninit())?;
        let (body, embedding) = def.placed(|definition| world.create_body_from_surface(definition, spacing))?;
        world.body_mut(body)?.set_gravity_scale(def.gravity_scale)?;
        *out_body = body.into();
        if let Some(out) = out_embedding {
            *out = Box::into_raw(Box::write(place, sinew_embedding { embedding }));
        }
        Ok(())
    })
}
