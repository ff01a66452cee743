//! Embedding: a fine render surface bound to a coarse body.

mod bind;
mod follow;
mod read;

use glam::Vec3;

use crate::base::{BodyId, Error, Result, ensure, memory};
use crate::body::Body;
use crate::cutting::CutMaterial;
use crate::def::{BodyDefinition, Values};
use crate::geometry::vertex_normals;
use crate::mesh::{MAX_COORDINATE, Mesh};
use crate::world::World;

use bind::Binding;
use follow::Follower;

/// The definition of an embedding. Plain data, used only during [`World::create_embedding`].
///
/// ```
/// # use glam::Vec3;
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&block)?;
/// let skin = EmbeddingDefinition { vertices: &[0.01 * Vec3::ONE], tetrahedra: &mesh.tetrahedra,
/// ..EmbeddingDefinition::default() }; let embedding = world.create_embedding(body, &skin)?;
/// assert!(embedding.positions()[0].distance(0.01 * Vec3::ONE) < 1e-6);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct EmbeddingDefinition<'a> {
    /// The positions of the vertices for the current positions of the body, m, within 1e9 m of the origin.
    pub vertices: &'a [Vec3],
    /// The triangles, outward by the right-hand rule. Without them there are no normals.
    pub triangles: &'a [[u32; 3]],
    /// The tetrahedra that the body was created with. Each vertex is bound to the one that contains it, or the nearest.
    /// After a cut or tear the body's current tetrahedra are used instead. If the list is empty, each vertex is bound
    /// to the nearest triangle of the body's render surface, and keeps its distance from it.
    pub tetrahedra: &'a [[u32; 4]],
}

/// A fine surface bound to a coarse body. The caller owns it; it costs the body nothing.
///
/// In a tetrahedron a vertex keeps its barycentric weights, so the surface follows affine motions of the body exactly.
/// On a triangle a vertex keeps its barycentric weights and its distance along the normal. After cuts and tears each
/// vertex follows its own side, and triangles that would span the cut are removed.
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
    /// The number of nodes of the body, and its topology version.
    node_count: usize,
    topology: u64,
    /// The data to follow cuts, for cuttable bodies.
    follower: Option<Box<Follower>>,
    binding: Binding,
    triangles: Vec<[u32; 3]>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// True if the normals match the positions.
    are_normals_new: bool,
    /// The inverse of the mean edge, 1/m. It keeps normals of very small and very large triangles in the range of
    /// `f32`.
    scale: f32,
}

impl Embedding {
    /// An embedding for node positions and a render surface, and the cells of the material that the vertices are bound
    /// to. `material` is given for surfaces, and for bodies that have been cut.
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
        let (binding, cells) = match (tetrahedra, material) {
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
        Ok((embedding, cells))
    }

    /// Attaches the embedding to a body.
    fn join(&mut self, id: BodyId, body: &Body, definition: &EmbeddingDefinition, cells: Vec<u32>) -> Result<()> {
        self.body = id;
        self.topology = body.topology_version();
        if let Some(material) = body.material()
            && !cells.is_empty()
            && is_made_of(material, definition.tetrahedra, self.topology > 0)
        {
            self.follower = Follower::new(material, cells, definition.triangles)?;
        }
        Ok(())
    }

    /// The body that the surface is bound to.
    pub fn body(&self) -> BodyId {
        self.body
    }

    /// Moves the vertices with the body. It allocates only after a cut or tear, when it binds the vertices again.
    ///
    /// # Errors
    /// [`Error::StaleId`]: the body was destroyed. [`Error::Unsupported`]: the body was cut or torn, and the vertices
    /// are bound to the surface of a tetrahedral body, or to other tetrahedra than it was created with.
    /// [`Error::InvalidArgument`]: the body lacks nodes that the vertices are bound to, as in a snapshot from before a
    /// cut. [`Error::OutOfMemory`]. After an error the vertices keep their positions.
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

    /// Moves the vertices to node positions, m, such as [`Frame::positions`](crate::Frame::positions). It can be called
    /// on any thread while the world steps.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the number of positions differs from the number of nodes at the last
    /// [`update`](Self::update), which follows cuts.
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

    /// The positions of the vertices, m, in the order given. The address of the list does not change.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The triangles in the order given, without those that span a cut. They change only in the first update after a
    /// cut.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The outward unit normals of the vertices: area-weighted means over the triangles, 0 if the mean is 0. The list
    /// is empty without triangles. The first call after an update computes them; the address of the list does not
    /// change.
    pub fn normals(&mut self) -> &[Vec3] {
        if !self.are_normals_new && !self.normals.is_empty() {
            vertex_normals(&self.positions, &self.triangles, self.scale, &mut self.normals);
        }
        self.are_normals_new = true;
        &self.normals
    }
}

impl World {
    /// Binds a fine surface to a body in their current positions.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: there are no vertices; a vertex is not finite or further than
    /// 1e9 m from the origin; an index is out of range; no tetrahedron has a volume; there are neither tetrahedra nor a
    /// render surface of the body. [`Error::OutOfMemory`].
    pub fn create_embedding(&self, body: BodyId, definition: &EmbeddingDefinition) -> Result<Embedding> {
        let host = self.body(body)?;
        // For an uncut solid the caller's tetrahedra are used.
        let is_asked = |material: &&CutMaterial| material.surface().is_some() || host.topology_version() > 0;
        let material = host.material().filter(is_asked);
        let (mut embedding, cells) = Embedding::new(definition, host.positions(), host.surface(), material)?;
        embedding.join(body, host, definition, cells)?;
        Ok(embedding)
    }

    /// Creates a tetrahedral body from a closed render surface, and binds the surface to it. [`Mesh::filled`] makes the
    /// tetrahedra, with a mean edge of `spacing` meters. The surface is `positions` and `triangles` of the definition;
    /// the other fields are as for [`create_body`](World::create_body), with uniform values for nodes and springs.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: as for [`Mesh::filled`] and [`create_body`](World::create_body), or the definition
    /// has tetrahedra, cells, springs, rest positions, rest lengths, or values for each node or spring, which do not
    /// exist yet. [`Error::OutOfMemory`].
    pub fn create_body_from_surface(
        &mut self,
        definition: &BodyDefinition,
        spacing: f32,
    ) -> Result<(BodyId, Embedding)> {
        refuse_node_values(definition)?;
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
        let (mut embedding, cells) = Embedding::new(&surface, &mesh.positions, &[], None)?;
        let body = self.create_body(&BodyDefinition {
            positions: &mesh.positions,
            triangles: &[],
            tetrahedra: &mesh.tetrahedra,
            ..*definition
        })?;
        let joined = self
            .body(body)
            .and_then(|host| embedding.join(body, host, &surface, cells));
        if let Err(error) = joined {
            self.destroy_body(body)?;
            return Err(error);
        }
        Ok((body, embedding))
    }
}

/// True if vertices bound to these tetrahedra are bound to cells of the material. After a topology change they always
/// are.
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

/// Refuses values for nodes and springs that do not exist yet.
fn refuse_node_values(definition: &BodyDefinition) -> Result<()> {
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
    for (vertex, position) in vertices.iter().enumerate() {
        ensure!(
            position.is_finite() && position.abs().max_element() <= MAX_COORDINATE,
            "vertices[{vertex}] is {position}: must be finite and within {MAX_COORDINATE:e} m of the origin"
        );
    }
    let within = |name: &str, number: usize, indices: &[u32], count: usize, what: &str| {
        let wrong = indices.iter().find(|&&index| index as usize >= count);
        wrong.map_or(Ok(()), |index| {
            Err(Error::invalid(format!(
                "{name}[{number}] names {what} {index}; there are {count}"
            )))
        })
    };
    for (number, triangle) in triangles.iter().enumerate() {
        within("triangles", number, triangle, vertices.len(), "vertex")?;
    }
    for (number, tetrahedron) in tetrahedra.iter().enumerate() {
        within("tetrahedra", number, tetrahedron, node_count, "node")?;
    }
    Ok(())
}

/// The inverse of the mean edge; 1 if that is not a normal number.
fn scale(vertices: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let edges = triangles.iter().map(|&[a, b, _]| {
        let [a, b] = [a, b].map(|vertex| vertices[vertex as usize].as_dvec3());
        a.distance(b)
    });
    let inverse = (triangles.len() as f64 / edges.sum::<f64>()) as f32;
    if inverse.is_normal() { inverse } else { 1.0 }
}
