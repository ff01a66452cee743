//! Closed surfaces: what they are made of, and what is not closed.

use glam::DVec3;

use super::Cavity;
use crate::base::{Error, Result, ensure, memory};
use crate::codec::saved;
use crate::def::BodyDefinition;
use crate::soa::{NodeOrder, TILE, tile_count};

/// Triangles that are worked on together, at most.
const BLOCK: usize = 512;

/// A cavity with less of a volume than this part of what a cube about as large as its surface has is flat: positions are rounded.
const FLAT: f64 = 1e-6;

/// Triangles of one cavity.
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
    /// The end of its triangles; they begin where those of the last end.
    end: u32,
}

saved! { Member { node, cavity, end } }

/// The triangles of all cavities, cavity by cavity, and those about each node.
#[derive(Debug, Default)]
pub(super) struct CavitySurface {
    /// In the body's own numbers, turned so that volumes are positive.
    pub triangles: Vec<[u32; 3]>,
    pub blocks: Vec<SurfaceBlock>,
    /// Where each block begins.
    pub starts: Vec<usize>,
    members: Vec<Member>,
    /// The members of each tile.
    tiles: Vec<u32>,
    /// The triangles about each member.
    about: Vec<u32>,
    /// Whether any node belongs to two cavities.
    pub nodes_are_shared: bool,
}

saved! { CavitySurface { triangles, blocks, starts, members, tiles, about, nodes_are_shared } }

/// Finds the cavities of triangles in the caller's numbers.
///
/// Triangles that have an edge in common belong to the same. Where some surfaces are inside out, as the inner wall of a hollow organ
/// is, these alone have cavities: what lies between them and those around is the tissue itself.
pub(super) fn close(
    definition: &BodyDefinition,
    triangles: &[[u32; 3]],
    order: &NodeOrder,
) -> Result<(CavitySurface, Vec<Cavity>)> {
    let (name, value) = asked(definition);
    ensure!(
        !triangles.is_empty(),
        "{name} is {value} Pa, and the body has no surface: no triangles, tetrahedra or cells"
    );
    let walls = walls((name, value), triangles)?;
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let mut order_of_walls: Vec<u32> = memory::collected(0..triangles.len() as u32)?;
    let lowest = |triangle: u32| {
        triangles[triangle as usize]
            .into_iter()
            .map(|node| order.own(node))
            .min()
    };
    order_of_walls.sort_unstable_by_key(|&triangle| (walls[triangle as usize], lowest(triangle), triangle));
    let same_wall = |a: &u32, b: &u32| walls[*a as usize] == walls[*b as usize];
    let volume_of = |wall: &[u32]| {
        let at = |node: u32| rest[node as usize].as_dvec3();
        let apex = at(triangles[wall[0] as usize][0]);
        let (mut volume, mut area) = (0.0, 0.0);
        for &triangle in wall {
            let [a, b, c] = triangles[triangle as usize].map(at);
            let vector = (b - a).cross(c - a);
            volume += (a - apex).dot(vector) / 6.0;
            area += vector.length() / 2.0;
        }
        (volume, area)
    };
    let mut has_inner = false;
    for wall in order_of_walls.chunk_by(same_wall) {
        let (volume, area) = volume_of(wall);
        ensure!(
            volume.abs() > FLAT * area * area.sqrt(),
            "{name} is {value} Pa, and the closed surface of node {} encloses {volume:e} m³ at rest: it is flat",
            triangles[wall[0] as usize][0]
        );
        has_inner |= volume < 0.0;
    }
    let mut made = CavitySurface {
        triangles: memory::reserved(triangles.len())?,
        ..CavitySurface::default()
    };
    let mut cavities = Vec::new();
    for wall in order_of_walls.chunk_by(same_wall) {
        let (volume, _) = volume_of(wall);
        if has_inner && volume > 0.0 {
            continue;
        }
        let start = made.triangles.len();
        made.triangles.extend(wall.iter().map(|&triangle| {
            let [a, b, c] = triangles[triangle as usize].map(|node| order.own(node));
            if volume > 0.0 { [a, b, c] } else { [a, c, b] }
        }));
        let end = made.triangles.len();
        for start in (start..end).step_by(BLOCK) {
            let block = SurfaceBlock {
                cavity: cavities.len(),
                start,
                end: end.min(start + BLOCK),
            };
            memory::push(&mut made.blocks, block)?;
            memory::push(&mut made.starts, start)?;
        }
        let cavity = Cavity {
            rest_volume: volume.abs(),
            triangles: [start as u32, end as u32],
            is_open: false,
            pressure: 0.0,
        };
        memory::push(&mut cavities, cavity)?;
    }
    made.find_members(&cavities, definition.positions.len())?;
    Ok((made, cavities))
}

/// What a definition asks for, to begin a message with.
fn asked(definition: &BodyDefinition) -> (&'static str, f32) {
    if definition.enclosed_stiffness > 0.0 {
        ("enclosed_stiffness", definition.enclosed_stiffness)
    } else {
        ("pressure", definition.pressure)
    }
}

/// For each triangle the lowest of those that it hangs together with by edges. Each edge must have as many triangles on one side as on the
/// other.
fn walls((name, value): (&str, f32), triangles: &[[u32; 3]]) -> Result<Vec<u32>> {
    // Each edge by its lower node, with the triangles that go up along it, and those that go down.
    let mut edges: Vec<([u32; 2], bool, u32)> = memory::reserved(3 * triangles.len())?;
    for (index, &[a, b, c]) in (0..).zip(triangles) {
        edges.extend([[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], a < b, index)));
    }
    edges.sort_unstable();
    let mut walls: Vec<u32> = memory::collected(0..triangles.len() as u32)?;
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
            let [a, b] = [same[0].2, *triangle].map(|triangle| lowest(&mut walls, triangle));
            walls[a.max(b) as usize] = a.min(b);
        }
    }
    for triangle in 0..triangles.len() as u32 {
        walls[triangle as usize] = lowest(&mut walls, triangle);
    }
    Ok(walls)
}

fn lowest(walls: &mut [u32], mut triangle: u32) -> u32 {
    while walls[triangle as usize] != triangle {
        let above = walls[triangle as usize];
        walls[triangle as usize] = walls[above as usize];
        triangle = above;
    }
    triangle
}

impl CavitySurface {
    fn find_members(&mut self, cavities: &[Cavity], node_count: usize) -> Result<()> {
        let mut corners: Vec<[u32; 3]> = memory::reserved(3 * self.triangles.len())?;
        for (cavity, of) in (0..).zip(cavities) {
            for triangle in of.triangles[0]..of.triangles[1] {
                corners.extend(self.triangles[triangle as usize].map(|node| [node, cavity, triangle]));
            }
        }
        corners.sort_unstable();
        let same_member = |a: &[u32; 3], b: &[u32; 3]| a[..2] == b[..2];
        self.members = memory::reserved(corners.chunk_by(same_member).count())?;
        self.about = memory::reserved(corners.len())?;
        self.tiles = memory::filled(0, tile_count(node_count) + 1)?;
        for of_member in corners.chunk_by(same_member) {
            let [node, cavity, _] = of_member[0];
            self.about.extend(of_member.iter().map(|corner| corner[2]));
            self.nodes_are_shared |= self.members.last().is_some_and(|last| last.node == node);
            self.members.push(Member {
                node,
                cavity,
                end: self.about.len() as u32,
            });
            self.tiles[node as usize / TILE + 1] += 1;
        }
        for tile in 1..self.tiles.len() {
            self.tiles[tile] += self.tiles[tile - 1];
        }
        Ok(())
    }

    /// Shows some members: node, cavity, and the triangles about it there.
    #[inline(always)]
    fn visit_members(&self, members: std::ops::Range<usize>, mut see: impl FnMut(usize, usize, &[u32])) {
        let mut start = members.start.checked_sub(1).map_or(0, |last| self.members[last].end);
        for member in &self.members[members] {
            let triangles = &self.about[start as usize..member.end as usize];
            see(member.node as usize, member.cavity as usize, triangles);
            start = member.end;
        }
    }

    /// Shows all nodes, the cavity of each, and the triangles about it there.
    pub fn visit(&self, see: &mut dyn FnMut(usize, usize, &[u32])) {
        self.visit_members(0..self.members.len(), see);
    }

    /// Shows those of a tile, by their places in it.
    #[inline(always)]
    pub fn visit_tile(&self, tile: usize, see: &mut impl FnMut(usize, usize, &[u32])) {
        // Nodes that cuts have added have none.
        let Some(&[start, end]) = self.tiles.get(tile..tile + 2) else {
            return;
        };
        let members = start as usize..end as usize;
        self.visit_members(members, |node, cavity, triangles| {
            see(node - tile * TILE, cavity, triangles);
        });
    }

    /// Shows the cavities of a node, and the triangles about it in each.
    pub fn visit_node(&self, node: usize, see: &mut impl FnMut(usize, &[u32])) {
        let start = self.members.partition_point(|member| (member.node as usize) < node);
        let count = self.members[start..]
            .iter()
            .take_while(|member| member.node as usize == node)
            .count();
        self.visit_members(start..start + count, |_, cavity, triangles| see(cavity, triangles));
    }

    /// The gradient of a cavity's volume by the place of a node with these triangles, m².
    pub fn gradient(&self, triangles: &[u32], at: &dyn Fn(usize) -> DVec3) -> DVec3 {
        let vectors = triangles.iter().map(|&triangle| {
            let [a, b, c] = self.triangles[triangle as usize].map(|node| at(node as usize));
            (b - a).cross(c - a)
        });
        vectors.sum::<DVec3>() / 6.0
    }
}
