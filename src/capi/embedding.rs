//! Fine surfaces that go with coarse bodies, and bodies made from surfaces.

use std::mem::MaybeUninit;

use super::body::{sinew_body_id, sinew_vec3_view};
use super::cut::sinew_triangle_view;
use super::definition::sinew_body_def;
use super::guard::{guard, sinew_world, with_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::embedding::{Embedding, EmbeddingDefinition};

/// A fine surface, drawn, bound to a coarse body, simulated. It belongs to the caller, who uses it on one thread at a time; the body knows nothing of it
/// and pays nothing.
pub struct sinew_embedding {
    embedding: Embedding,
}

/// A surface that is drawn, and what of a body it goes with.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_embedding_def {
    /// Set by sinew_embedding_def_init.
    pub struct_size: usize,
    /// 3 vertex_count floats: where each vertex is while the body is where it is, m, within 1e9 m of the origin; no default.
    pub vertices: *const f32,
    /// At least 1.
    pub vertex_count: usize,
    /// 3 triangle_count vertices, outward by the right-hand rule: what normals come from; nullable: there are none.
    pub triangles: *const u32,
    /// Triangles.
    pub triangle_count: usize,
    /// 4 tetrahedron_count nodes: the tetrahedra of the body, as it was created with. Each vertex keeps its barycentric weights in the one that it
    /// is in, or nearest to. Where the body has been cut or torn, those that it has now are taken instead. Nullable: each goes with the nearest
    /// triangle that is drawn of the body, and keeps its distance from that.
    pub tetrahedra: *const u32,
    /// Tetrahedra.
    pub tetrahedron_count: usize,
}

// SAFETY: repr(C), begins with struct_size; numbers and pointers, which any bits are.
unsafe impl Versioned for sinew_embedding_def {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_embedding_def";
}

impl sinew_embedding_def {
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            vertices: std::ptr::null(),
            vertex_count: 0,
            triangles: std::ptr::null(),
            triangle_count: 0,
            tetrahedra: std::ptr::null(),
            tetrahedron_count: 0,
        }
    }

    /// # Safety
    /// Arrays of the lengths that it states, for as long as the result lives.
    unsafe fn definition<'a>(&self) -> crate::Result<EmbeddingDefinition<'a>> {
        // SAFETY: the same contract.
        unsafe {
            Ok(EmbeddingDefinition {
                vertices: memory::array("vertices", self.vertices.cast(), self.vertex_count)?,
                triangles: memory::array("triangles", self.triangles.cast(), self.triangle_count)?,
                tetrahedra: memory::array("tetrahedra", self.tetrahedra.cast(), self.tetrahedron_count)?,
            })
        }
    }
}

/// Writes the defaults of the `struct_size` bytes that the caller compiled.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `def` is NULL or writable for `struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_def_init(def: *mut sinew_embedding_def, struct_size: usize) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe { memory::initialise(def, struct_size, sinew_embedding_def::defaults()) })
}

/// Binds a fine surface to a body, where both are now, in a time as long as some hundred updates; copies what `def` points to. The caller destroys it
/// with sinew_embedding_destroy, before or after the body and its world. Of an affine motion of the body the surface takes part to within rounding,
/// where it is bound to tetrahedra.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where no tetrahedron has a volume, or nothing is drawn of the body), SINEW_STATUS_STALE_ID,
/// SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `def` is NULL or a definition of the size that it states, with arrays of the lengths that it states;
/// `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_create(
    world: *const sinew_world,
    body: sinew_body_id,
    def: *const sinew_embedding_def,
    out: *mut *mut sinew_embedding,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let out = memory::output("out", out)?;
            let def = memory::definition("def", def, sinew_embedding_def::defaults())?;
            let embedding = world.create_embedding(body.id(), &def.definition()?)?;
            *out = Box::into_raw(crate::base::memory::boxed(sinew_embedding { embedding })?);
            Ok(())
        })
    }
}

/// Destroys an embedding; its views end. NULL: nothing.
///
/// # Safety
/// `embedding` is NULL or an embedding that is not destroyed and that nobody uses any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_destroy(embedding: *mut sinew_embedding) {
    if !embedding.is_null() {
        guard(|| {
            // SAFETY: made by Box::into_raw when it was created, and given back once.
            drop(unsafe { Box::from_raw(embedding) });
            Ok(())
        });
    }
}

/// Puts the vertices where the body is now, in the place where they are read. Nothing is allocated, but when the body has been cut or torn since:
/// then each vertex is bound to the copy on its side, and triangles that would reach across are left out of
/// sinew_embedding_get_triangles.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the body has not the nodes that the vertices are bound to, as in a world that was saved before it was
/// cut), SINEW_STATUS_STALE_ID (the body is gone), SINEW_STATUS_OUT_OF_MEMORY, SINEW_STATUS_UNSUPPORTED (it has been cut or torn, and the vertices are
/// bound to the triangles of a body of tetrahedra, or not to all of the tetrahedra of which it was made). The vertices stay where they were then.
///
/// # Safety
/// `embedding` is NULL or an embedding nobody else uses; `world` is NULL or the body's world, which nobody changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_update(
    embedding: *mut sinew_embedding,
    world: *const sinew_world,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let embedding = memory::output("embedding", embedding)?;
            embedding.embedding.update(world)
        })
    }
}

/// The same with the body's nodes at `positions`, m, 3 node_count packed floats, such as a reader's frame has them: on any thread, whatever the world
/// does meanwhile.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the body had another number of nodes at the last sinew_embedding_update, which alone follows
/// cuts).
///
/// # Safety
/// `embedding` is NULL or an embedding nobody else uses; `positions` is NULL or 3 `node_count` floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_update_from(
    embedding: *mut sinew_embedding,
    positions: *const f32,
    node_count: usize,
) -> sinew_status {
    guard(|| {
        // SAFETY: the same contract.
        unsafe {
            let embedding = memory::output("embedding", embedding)?;
            let positions = memory::array("positions", positions.cast(), node_count)?;
            embedding.embedding.update_from(positions)
        }
    })
}

/// Writes a view of where each vertex is, m, in the order given. It stays the same until the embedding's end; updates change what it shows.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `embedding` is NULL or an embedding nobody changes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_get_positions(
    embedding: *const sinew_embedding,
    out: *mut sinew_vec3_view,
) -> sinew_status {
    guard(|| {
        // SAFETY: the same contract.
        unsafe {
            let embedding = memory::reference("embedding", embedding)?;
            *memory::output("out", out)? = sinew_vec3_view::of(embedding.embedding.positions());
            Ok(())
        }
    })
}

/// Writes a view of the triangles, in the order given, less those that reach across a cut. It changes with updates after cuts alone, and lives until then.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `embedding` is NULL or an embedding nobody changes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_get_triangles(
    embedding: *const sinew_embedding,
    out: *mut sinew_triangle_view,
) -> sinew_status {
    guard(|| {
        // SAFETY: the same contract.
        unsafe {
            let triangles = memory::reference("embedding", embedding)?.embedding.triangles();
            *memory::output("out", out)? = sinew_triangle_view {
                data: triangles.as_ptr().cast(),
                count: triangles.len(),
            };
            Ok(())
        }
    })
}

/// Works out the normals, where that was not done since the last update, and writes a view of them: of unit length, outward, the mean of a
/// vertex's triangles by area, 0 where that is 0; an empty view without triangles. The view lives like that of the positions.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `embedding` is NULL or an embedding nobody else uses; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_embedding_get_normals(
    embedding: *mut sinew_embedding,
    out: *mut sinew_vec3_view,
) -> sinew_status {
    guard(|| {
        // SAFETY: the same contract.
        unsafe {
            let embedding = memory::output("embedding", embedding)?;
            let out = memory::output("out", out)?;
            *out = sinew_vec3_view::of(embedding.embedding.normals());
            Ok(())
        }
    })
}

/// Makes a body of a closed surface, and binds the surface to it: tissue from what is drawn, in one call. `positions` and `triangles` of `def` are the
/// surface, outward, with vertices that may be repeated as in STL files; it is filled with tetrahedra whose edges are `spacing` metres long in the
/// mean (isosurface stuffing, Labelle and Shewchuk 2007), which are the nodes and elements of the body: its own surface follows the one given where that is
/// not finer than the spacing, and what is thinner than about half of it is lost. All else in `def` is as for sinew_body_create, with one value for
/// all nodes and springs. `out_embedding` is nullable; the caller destroys what it is given there.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (the surface is open or inside out; spacing is not above 0, too fine to count the nodes, or so coarse that
/// nothing is filled; tetrahedra, cells, springs, rest positions or lists of values are given), SINEW_STATUS_UNSUPPORTED as sinew_body_create,
/// SINEW_STATUS_CAPACITY, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states, with arrays of the lengths that it states;
/// `out_body` is NULL or writable, and so is `out_embedding`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_create_from_surface(
    world: *mut sinew_world,
    def: *const sinew_body_def,
    spacing: f32,
    out_body: *mut sinew_body_id,
    out_embedding: *mut *mut sinew_embedding,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let out_body = memory::output("out_body", out_body)?;
            let out_embedding = match out_embedding.is_null() {
                true => None,
                false => Some(memory::output("out_embedding", out_embedding)?),
            };
            let def = memory::definition("def", def, sinew_body_def::defaults())?;
            // Nothing may fail once there is a body.
            let place = crate::base::memory::boxed(MaybeUninit::uninit())?;
            let (body, embedding) = world.create_body_from_surface(&def.definition()?, spacing)?;
            *out_body = body.into();
            if let Some(out) = out_embedding {
                *out = Box::into_raw(Box::write(place, sinew_embedding { embedding }));
            }
            Ok(())
        })
    }
}
