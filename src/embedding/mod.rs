//! What is drawn of a body need not be what is solved: a fine surface that goes with a coarse body.

mod bind;
mod follow;
mod read;

use glam::Vec3;

use crate::base::{BodyId, Error, Result, ensure, memory};
use crate::body::Body;
use crate::cutting::CutMaterial;
use crate::def::{BodyDefinition, Values};
use crate::geometry::vertex_normals;
use crate::mesh::{FURTHEST, Mesh};
use crate::world::World;

use bind::Binding;
use follow::Follower;

/// A surface that is drawn, and what of a body it goes with. Plain data, used only during [`World::create_embedding`].
///
/// ```
/// # use glam::Vec3;
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&block)?;
/// let skin = EmbeddingDefinition { vertices: &[0.01 * Vec3::ONE], tetrahedra: &mesh.tetrahedra, ..EmbeddingDefinition::default() };
/// let embedding = world.create_embedding(body, &skin)?;
/// assert!(embedding.positions()[0].distance(0.01 * Vec3::ONE) < 1e-6);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct EmbeddingDefinition<'a> {
    /// Where each vertex is while the body is where it is, m, within 1e9 m of the origin.
    pub vertices: &'a [Vec3],
    /// Three vertices each, outward by the right-hand rule: what normals come from. Empty: there are none.
    pub triangles: &'a [[u32; 3]],
    /// The tetrahedra of the body, as it was created with: each vertex goes with the one that it is in, or nearest to. Where the body has been cut or
    /// torn, those that it has now are taken instead. Empty: each goes with the nearest triangle that is drawn of the body, and keeps its
    /// distance from that.
    pub tetrahedra: &'a [[u32; 4]],
}

/// A fine surface bound to a coarse body, and where its vertices are. It belongs to the caller; the body knows nothing of it and pays nothing.
///
/// In a tetrahedron a vertex keeps its barycentric weights, so that an affine motion of the body is one of the surface; over a triangle it keeps
/// its place in it and its distance along the normal. It follows cuts and tears: each vertex goes on with its own side, and triangles that would reach
/// across are left out.
///
/// ```
/// # use glam::Vec3;
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&block)?;
/// # let skin = EmbeddingDefinition { vertices: &[0.01 * Vec3::ONE], tetrahedra: &mesh.tetrahedra, ..EmbeddingDefinition::default() };
/// let mut embedding = world.create_embedding(body, &skin)?;
/// world.step(1.0 / 60.0)?;
/// embedding.update(&world)?;
/// // It has fallen with the body.
/// assert!(embedding.positions()[0].y < skin.vertices[0].y);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct Embedding {
    body: BodyId,
    /// How many nodes the body has, and which version its topology.
    node_count: usize,
    topology: u64,
    /// For bodies that may be cut.
    follower: Option<Box<Follower>>,
    binding: Binding,
    triangles: Vec<[u32; 3]>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// Whether the normals are those of the positions.
    are_normals_new: bool,
    /// 1 over the mean edge, 1/m: normals neither vanish nor overflow where triangles are small or large.
    scale: f32,
}

impl Embedding {
    /// Of a body with its nodes at `positions`, of which these triangles are drawn; with the cells of its material that vertices go with. The material
    /// is asked for where it is that of a surface, or has been cut.
    fn new(
        definition: &EmbeddingDefinition,
        positions: &[Vec3],
        drawn: &[[u32; 3]],
        material: Option<&CutMaterial>,
    ) -> Result<(Self, Vec<u32>)> {
        let EmbeddingDefinition {
            vertices,
            triangles,
            tetrahedra,
        } = *definition;
        check(definition, positions.len())?;
        let (binding, homes) = match (tetrahedra, material) {
            ([], Some(CutMaterial::Surface(surface))) => Binding::to_surface(vertices, positions, surface)?,
            ([], _) => (Binding::to_triangles(vertices, positions, drawn)?, Vec::new()),
            (_, Some(CutMaterial::Solid(solid))) => Binding::to_solid(vertices, positions, solid)?,
            _ => Binding::to_tetrahedra(vertices, positions, tetrahedra)?,
        };
        let mut embedding = Self {
            body: BodyId::default(),
            node_count: positions.len(),
            topology: 0,
            follower: None,
            binding,
            triangles: memory::copied(triangles)?,
            positions: memory::filled(Vec3::ZERO, vertices.len())?,
            normals: memory::filled(Vec3::ZERO, if triangles.is_empty() { 0 } else { vertices.len() })?,
            are_normals_new: false,
            scale: scale(vertices, triangles),
        };
        embedding.update_from(positions)?;
        Ok((embedding, homes))
    }

    /// Has it go with this body.
    fn join(&mut self, id: BodyId, body: &Body, definition: &EmbeddingDefinition, homes: Vec<u32>) -> Result<()> {
        self.body = id;
        self.topology = body.topology_version();
        if let Some(material) = body.material()
            && !homes.is_empty()
            && is_made_of(material, definition.tetrahedra, self.topology > 0)
        {
            self.follower = Follower::new(material, homes, definition.triangles)?;
        }
        Ok(())
    }

    /// The body it goes with.
    pub fn body(&self) -> BodyId {
        self.body
    }

    /// Puts the vertices where the body is now. Nothing is allocated, but when the body has been cut or torn since: then the vertices are bound anew.
    ///
    /// # Errors
    /// [`Error::StaleId`]: the body is gone. [`Error::Unsupported`]: it has been cut or torn since, and the vertices are bound to the triangles of a body of
    /// tetrahedra, or not to all of the tetrahedra of which it was made. [`Error::InvalidArgument`]: it has not the nodes that the vertices are bound to, as in a world that was
    /// saved before it was cut. [`Error::OutOfMemory`]. The vertices stay where they were.
    pub fn update(&mut self, world: &World) -> Result<()> {
        let body = world.body(self.body)?;
        if body.topology_version() != self.topology {
            let is_followed = match (&self.follower, body.material()) {
                (Some(follower), Some(material)) => {
                    let pieces = body.pieces()?.of_nodes;
                    follower.follow((material, &pieces), &mut self.binding, &mut self.triangles)?
                }
                _ => false,
            };
            if !is_followed {
                return Err(Error::Unsupported(format!(
                    "the body has been cut or torn since the embedding was made (its topology has version {}): that is followed by vertices bound to \
                     all of its tetrahedra, or to a body of triangles",
                    body.topology_version()
                )));
            }
            self.topology = body.topology_version();
            self.node_count = body.node_count();
        }
        self.update_from(body.positions())
    }

    /// The same with the body's nodes at `positions`, m, such as [`Frame::positions`](crate::Frame::positions): on any thread, whatever the world does.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there are not as many positions as the body had nodes at the last [`update`](Self::update), which follows its cuts.
    pub fn update_from(&mut self, positions: &[Vec3]) -> Result<()> {
        ensure!(
            positions.len() == self.node_count,
            "{} positions are given: the embedding knows of {} nodes",
            positions.len(),
            self.node_count
        );
        self.binding.read(positions, &mut self.positions);
        self.are_normals_new = false;
        Ok(())
    }

    /// Where each vertex is, m, in the order given. The list stays in its place.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The triangles, in the order given, less those that reach across a cut: they change with updates after cuts alone.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The normal of each vertex, outward, of unit length: the mean of its triangles' by area; 0 where that is 0, and no list without triangles.
    /// The first call after an update works them out; the list stays in its place.
    pub fn normals(&mut self) -> &[Vec3] {
        if !self.are_normals_new && !self.normals.is_empty() {
            vertex_normals(&self.positions, &self.triangles, self.scale, &mut self.normals);
        }
        self.are_normals_new = true;
        &self.normals
    }
}

impl World {
    /// Binds a fine surface to a body, where both are now.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: there are no vertices; one is not finite or further than 1e9 m from the origin; an index is
    /// that of no vertex or node; no tetrahedron has a volume; there are none, and nothing is drawn of the body. [`Error::OutOfMemory`].
    pub fn create_embedding(&self, body: BodyId, definition: &EmbeddingDefinition) -> Result<Embedding> {
        let host = self.body(body)?;
        // A solid that was not cut is what the caller says it is.
        let is_asked = |material: &&CutMaterial| material.surface().is_some() || host.topology_version() > 0;
        let material = host.material().filter(is_asked);
        let (mut embedding, homes) = Embedding::new(definition, host.positions(), host.surface(), material)?;
        embedding.join(body, host, definition, homes)?;
        Ok(embedding)
    }

    /// Makes a body of a closed surface, which [`Mesh::filled`] fills with tetrahedra of edges `spacing` metres long in the mean, and binds the
    /// surface to it: tissue from what is drawn. The surface is `positions` and `triangles` of the definition; all else in it is as for
    /// [`create_body`](World::create_body), with one value for all nodes and springs.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: as [`Mesh::filled`] and [`create_body`](World::create_body) answer; the definition has tetrahedra, cells, springs, rest
    /// positions or rest lengths, or lists of values: the nodes and springs are to come. [`Error::OutOfMemory`].
    pub fn create_body_from_surface(
        &mut self,
        definition: &BodyDefinition,
        spacing: f32,
    ) -> Result<(BodyId, Embedding)> {
        check_is_to_come(definition)?;
        let drawn = Mesh {
            positions: memory::copied(definition.positions)?,
            triangles: memory::copied(definition.triangles)?,
            ..Mesh::default()
        };
        let mesh = Mesh::filled(&drawn, spacing)?;
        let surface = EmbeddingDefinition {
            vertices: &drawn.positions,
            triangles: &drawn.triangles,
            tetrahedra: &mesh.tetrahedra,
        };
        let (mut embedding, homes) = Embedding::new(&surface, &mesh.positions, &[], None)?;
        let body = self.create_body(&BodyDefinition {
            positions: &mesh.positions,
            triangles: &[],
            tetrahedra: &mesh.tetrahedra,
            ..*definition
        })?;
        let joined = self
            .body(body)
            .and_then(|host| embedding.join(body, host, &surface, homes));
        if let Err(error) = joined {
            self.destroy_body(body)?;
            return Err(error);
        }
        Ok((body, embedding))
    }
}

/// Whether vertices bound to these tetrahedra, where there are some, are bound to cells of the material: once it was changed, its own were taken.
fn is_made_of(material: &CutMaterial, tetrahedra: &[[u32; 4]], was_changed: bool) -> bool {
    match material {
        CutMaterial::Springs(_) => false,
        CutMaterial::Surface(_) => tetrahedra.is_empty(),
        CutMaterial::Solid(solid) => {
            let cells = solid.cells().iter().map(|cell| cell.nodes);
            was_changed || cells.eq(tetrahedra.iter().copied())
        }
    }
}

/// Refuses what names nodes or springs of a body whose nodes are not made yet.
fn check_is_to_come(definition: &BodyDefinition) -> Result<()> {
    let is_list = |values: Values| matches!(values, Values::Each(_));
    let given = [
        ("tetrahedra", !definition.tetrahedra.is_empty()),
        ("cells", !definition.cells.is_empty()),
        ("springs", definition.springs.is_some()),
        ("rest_positions", definition.rest_positions.is_some()),
        ("rest_lengths", definition.rest_lengths.is_some()),
        ("masses", is_list(definition.masses)),
        ("node_dampings", is_list(definition.node_dampings)),
        ("stiffnesses", is_list(definition.stiffnesses)),
        ("spring_dampings", is_list(definition.spring_dampings)),
        ("home_stiffnesses", is_list(definition.home_stiffnesses)),
        ("fibre_directions", !definition.fibre_directions.is_empty()),
        ("fibre_stiffnesses", is_list(definition.fibre_stiffnesses)),
    ];
    for (name, is_given) in given {
        ensure!(
            !is_given,
            "{name} are given: a body made from a surface has nodes and springs of its own"
        );
    }
    Ok(())
}

fn check(definition: &EmbeddingDefinition, node_count: usize) -> Result<()> {
    let EmbeddingDefinition {
        vertices,
        triangles,
        tetrahedra,
    } = definition;
    ensure!(!vertices.is_empty(), "vertices are 0: there is nothing to bind");
    ensure!(
        u32::try_from(vertices.len()).is_ok(),
        "{} vertices: too many to count",
        vertices.len()
    );
    for (vertex, place) in vertices.iter().enumerate() {
        ensure!(
            place.is_finite() && place.abs().max_element() <= FURTHEST,
            "vertices[{vertex}] is {place}: must be finite and within {FURTHEST:e} m of the origin"
        );
    }
    let within = |name: &str, place: usize, indices: &[u32], count: usize, what: &str| {
        let wrong = indices.iter().find(|&&index| index as usize >= count);
        wrong.map_or(Ok(()), |index| {
            Err(Error::invalid(format!(
                "{name}[{place}] names {what} {index}; there are {count}"
            )))
        })
    };
    for (place, triangle) in triangles.iter().enumerate() {
        within("triangles", place, triangle, vertices.len(), "vertex")?;
    }
    for (place, tetrahedron) in tetrahedra.iter().enumerate() {
        within("tetrahedra", place, tetrahedron, node_count, "node")?;
    }
    Ok(())
}

/// 1 over the mean edge; 1 where that is nothing.
fn scale(vertices: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let edges = triangles.iter().map(|&[a, b, _]| {
        let [a, b] = [a, b].map(|vertex| vertices[vertex as usize].as_dvec3());
        a.distance(b)
    });
    let inverse = (triangles.len() as f64 / edges.sum::<f64>()) as f32;
    if inverse.is_normal() { inverse } else { 1.0 }
}
