//! The closed surfaces of a body, grouped into cavities.

use glam::DVec3;

use super::Cavity;
use crate::base::{Error, Result, ensure, memory};
use crate::codec::saved;
use crate::def::BodyDefinition;
use crate::soa::{NodeOrder, TILE, tile_count};

/// The most triangles of a block.
const BLOCK: usize = 512;

/// A cavity with less than this fraction of the volume of a cube of about its surface area is degenerate, given
/// rounded positions.
const FLAT: f64 = 1e-6;

/// Consecutive triangles of one cavity.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceBlock {
    pub cavity: usize,
    pub start: usize,
    pub end: usize,
}

saved! { SurfaceBlock { cavity, start, end } }

/// A node of a cavity.
#[derive(Clone, Copy, Debug)]
struct Member {
    node: u32,
    cavity: u32,
    /// The end of its triangles in `node_triangles`; they begin at the end of the previous member.
    end: u32,
}

saved! { Member { node, cavity, end } }

/// The triangles of all cavities, cavity by cavity, and the triangles at each node.
#[derive(Debug, Default)]
pub(super) struct CavitySurface {
    /// In the body's internal indices, oriented such that volumes are positive.
    pub triangles: Vec<[u32; 3]>,
    pub blocks: Vec<SurfaceBlock>,
    /// The first triangle of each block.
    pub starts: Vec<usize>,
    members: Vec<Member>,
    /// The first member of each tile.
    tiles: Vec<u32>,
    /// The triangles at each member.
    node_triangles: Vec<u32>,
    /// True if any node belongs to two cavities.
    pub nodes_are_shared: bool,
}

saved! { CavitySurface { triangles, blocks, starts, members, tiles, node_triangles, nodes_are_shared } }

/// Groups triangles in the caller's indices into cavities.
///
/// Triangles with a common edge belong to the same surface. If some surfaces are inverted, like the inner wall of a
/// hollow organ, only these become cavities: the tissue is between them and the outer surfaces.
pub(super) fn build(
    definition: &BodyDefinition,
    triangles: &[[u32; 3]],
    order: &NodeOrder,
) -> Result<(CavitySurface, Vec<Cavity>)> {
    let (name, value) = requesting_parameter(definition);
    ensure!(
        !triangles.is_empty(),
        "{name} is {value} Pa, and the body has no surface: no triangles, tetrahedra or cells"
    );
    let components = components((name, value), triangles)?;
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let mut by_component: Vec<u32> = memory::collected(0..triangles.len() as u32)?;
    let lowest_node = |triangle: u32| {
        triangles[triangle as usize]
            .into_iter()
            .map(|node| order.own(node))
            .min()
    };
    by_component.sort_unstable_by_key(|&triangle| (components[triangle as usize], lowest_node(triangle), triangle));
    let same_component = |a: &u32, b: &u32| components[*a as usize] == components[*b as usize];
    let volume_and_area = |component: &[u32]| {
        let at = |node: u32| rest[node as usize].as_dvec3();
        let apex = at(triangles[component[0] as usize][0]);
        let (mut volume, mut area) = (0.0, 0.0);
        for &triangle in component {
            let [a, b, c] = triangles[triangle as usize].map(at);
            let vector = (b - a).cross(c - a);
            volume += (a - apex).dot(vector) / 6.0;
            area += vector.length() / 2.0;
        }
        (volume, area)
    };
    let mut has_inverted = false;
    for component in by_component.chunk_by(same_component) {
        let (volume, area) = volume_and_area(component);
        ensure!(
            volume.abs() > FLAT * area * area.sqrt(),
            "{name} is {value} Pa, and the closed surface of node {} encloses {volume:e} m³ at rest: it is flat",
            triangles[component[0] as usize][0]
        );
        has_inverted |= volume < 0.0;
    }
    let mut built = CavitySurface {
        triangles: memory::reserved(triangles.len())?,
        ..CavitySurface::default()
    };
    let mut cavities = Vec::new();
    for component in by_component.chunk_by(same_component) {
        let (volume, _) = volume_and_area(component);
        if has_inverted && volume > 0.0 {
            continue;
        }
        let start = built.triangles.len();
        built.triangles.extend(component.iter().map(|&triangle| {
            let [a, b, c] = triangles[triangle as usize].map(|node| order.own(node));
            if volume > 0.0 { [a, b, c] } else { [a, c, b] }
        }));
        let end = built.triangles.len();
        for start in (start..end).step_by(BLOCK) {
            let block = SurfaceBlock {
                cavity: cavities.len(),
                start,
                end: end.min(start + BLOCK),
            };
            memory::push(&mut built.blocks, block)?;
            memory::push(&mut built.starts, start)?;
        }
        let cavity = Cavity {
            rest_volume: volume.abs(),
            triangles: [start as u32, end as u32],
            is_open: false,
            pressure: 0.0,
        };
        memory::push(&mut cavities, cavity)?;
    }
    built.find_members(&cavities, definition.positions.len())?;
    Ok((built, cavities))
}

/// The parameter that requests cavities, for error messages.
fn requesting_parameter(definition: &BodyDefinition) -> (&'static str, f32) {
    if definition.enclosed_stiffness > 0.0 {
        ("enclosed_stiffness", definition.enclosed_stiffness)
    } else {
        ("pressure", definition.pressure)
    }
}

/// The surface of each triangle, as the lowest triangle connected through edges. Each edge must have equally many
/// triangles in both directions.
fn components((name, value): (&str, f32), triangles: &[[u32; 3]]) -> Result<Vec<u32>> {
    // Each edge with its lower node first, whether the triangle goes from the lower to the higher node, and the
    // triangle.
    let mut edges: Vec<([u32; 2], bool, u32)> = memory::reserved(3 * triangles.len())?;
    for (index, &[a, b, c]) in (0..).zip(triangles) {
        edges.extend([[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], a < b, index)));
    }
    edges.sort_unstable();
    let mut components: Vec<u32> = memory::collected(0..triangles.len() as u32)?;
    for same in edges.chunk_by(|a, b| a.0 == b.0) {
        let ups = same.iter().filter(|(_, goes_up, _)| *goes_up).count();
        if 2 * ups != same.len() {
            let [a, b] = same[0].0;
            return Err(Error::invalid(format!(
                "{name} is {value} Pa, and the surface is not closed: {ups} of its triangles go from node {a} to node {b}, {} go back",
                same.len() - ups
            )));
        }
        for (_, _, triangle) in &same[1..] {
            let [a, b] = [same[0].2, *triangle].map(|triangle| find_root(&mut components, triangle));
            components[a.max(b) as usize] = a.min(b);
        }
    }
    for triangle in 0..triangles.len() as u32 {
        components[triangle as usize] = find_root(&mut components, triangle);
    }
    Ok(components)
}

fn find_root(components: &mut [u32], mut triangle: u32) -> u32 {
    while components[triangle as usize] != triangle {
        let above = components[triangle as usize];
        components[triangle as usize] = components[above as usize];
        triangle = above;
    }
    triangle
}

impl CavitySurface {
    fn find_members(&mut self, cavities: &[Cavity], node_count: usize) -> Result<()> {
        let mut corners: Vec<[u32; 3]> = memory::reserved(3 * self.triangles.len())?;
        for (cavity, cavity_data) in (0..).zip(cavities) {
            for triangle in cavity_data.triangles[0]..cavity_data.triangles[1] {
                corners.extend(self.triangles[triangle as usize].map(|node| [node, cavity, triangle]));
            }
        }
        corners.sort_unstable();
        let same_member = |a: &[u32; 3], b: &[u32; 3]| a[..2] == b[..2];
        self.members = memory::reserved(corners.chunk_by(same_member).count())?;
        self.node_triangles = memory::reserved(corners.len())?;
        self.tiles = memory::filled(0, tile_count(node_count) + 1)?;
        for member_corners in corners.chunk_by(same_member) {
            let [node, cavity, _] = member_corners[0];
            self.node_triangles
                .extend(member_corners.iter().map(|corner| corner[2]));
            self.nodes_are_shared |= self.members.last().is_some_and(|last| last.node == node);
            self.members.push(Member {
                node,
                cavity,
                end: self.node_triangles.len() as u32,
            });
            self.tiles[node as usize / TILE + 1] += 1;
        }
        for tile in 1..self.tiles.len() {
            self.tiles[tile] += self.tiles[tile - 1];
        }
        Ok(())
    }

    /// Calls `f` with a range of members: the node, its cavity, and its triangles in that cavity.
    #[inline(always)]
    fn visit_members(&self, members: std::ops::Range<usize>, mut f: impl FnMut(usize, usize, &[u32])) {
        let mut start = members.start.checked_sub(1).map_or(0, |last| self.members[last].end);
        for member in &self.members[members] {
            let triangles = &self.node_triangles[start as usize..member.end as usize];
            f(member.node as usize, member.cavity as usize, triangles);
            start = member.end;
        }
    }

    /// Calls `f` with every member: the node, its cavity, and its triangles in that cavity.
    pub fn visit(&self, f: &mut dyn FnMut(usize, usize, &[u32])) {
        self.visit_members(0..self.members.len(), f);
    }

    /// Calls `f` with the members of a tile, the node as an index in the tile.
    #[inline(always)]
    pub fn visit_tile(&self, tile: usize, f: &mut impl FnMut(usize, usize, &[u32])) {
        // Nodes added by cuts have no members.
        let Some(&[start, end]) = self.tiles.get(tile..tile + 2) else {
            return;
        };
        let members = start as usize..end as usize;
        self.visit_members(members, |node, cavity, triangles| {
            f(node - tile * TILE, cavity, triangles);
        });
    }

    /// Calls `f` with each cavity of a node, and the node's triangles in it.
    pub fn visit_node(&self, node: usize, f: &mut impl FnMut(usize, &[u32])) {
        let start = self.members.partition_point(|member| (member.node as usize) < node);
        let count = self.members[start..]
            .iter()
            .take_while(|member| member.node as usize == node)
            .count();
        self.visit_members(start..start + count, |_, cavity, triangles| f(cavity, triangles));
    }

    /// The derivative of a cavity's volume with respect to the position of a node with these triangles, m².
    pub fn gradient(&self, triangles: &[u32], at: &dyn Fn(usize) -> DVec3) -> DVec3 {
        let vectors = triangles.iter().map(|&triangle| {
            let [a, b, c] = self.triangles[triangle as usize].map(|node| at(node as usize));
            (b - a).cross(c - a)
        });
        vectors.sum::<DVec3>() / 6.0
    }
}
