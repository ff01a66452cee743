//! Selects the severed faces that can open while the render surface stays manifold.
//!
//! A severed face cannot open if none of its corners separates. It then stays closed until the blade advances, and so
//! does a face that is connected to the others only through a corner.

use super::body::{CutSolid, FaceState};
use super::cut::SolidCut;
use crate::base::DisjointSets;
use crate::base::{Result, memory};
use crate::cutting::cell_complex::NONE;

/// A tetrahedron and the index of one of its faces.
type FaceOf = (u32, usize);

/// A face at a vertex that will have no neighbor.
#[derive(Clone, Copy)]
struct BareFace {
    tetrahedron: u32,
    face: usize,
    /// The other corners, counterclockwise seen from outside.
    from: u32,
    to: u32,
    /// The component around the vertex that has the face.
    component: usize,
    /// The loop of such faces around the vertex that contains it.
    loop_index: usize,
}

/// The connected components around a vertex after faces open.
struct VertexComponents {
    star: Vec<(u32, usize)>,
    union: DisjointSets,
}

impl VertexComponents {
    /// The component that contains a tetrahedron.
    fn component_of(&mut self, tetrahedron: u32) -> Option<usize> {
        let index = self
            .star
            .binary_search_by_key(&tetrahedron, |&(member, _)| member)
            .ok()?;
        Some(self.union.lowest(index))
    }
}

impl SolidCut<'_> {
    /// The severed faces that are connected with vertices found on the blade in this step and that can open. Each is
    /// given by its lower tetrahedron, and marked as opening.
    pub(crate) fn openable_faces(&mut self) -> Result<Vec<(u32, usize)>> {
        let (mut faces, mut vertices) = self.collect_severed()?;
        self.keep_slivers(&mut faces)?;
        loop {
            self.close_nonmanifold(&mut faces, vertices)?;
            let count = faces.len();
            self.keep_slivers(&mut faces)?;
            if faces.len() == count {
                return Ok(faces);
            }
            // Faces around a sliver can have kept the rest manifold.
            vertices = memory::reserved(3 * faces.len())?;
            for &(tetrahedron, face) in &faces {
                vertices.extend(self.solid.face(tetrahedron, face));
            }
            memory::sort_once(&mut vertices);
        }
    }

    /// Closes faces until the render surface is manifold at all vertices. The search starts at the given vertices.
    fn close_nonmanifold(&mut self, faces: &mut Vec<(u32, usize)>, mut vertices: Vec<u32>) -> Result<()> {
        let mut index = 0;
        let mut closed = Vec::new();
        while let Some(&vertex) = vertices.get(index) {
            index += 1;
            self.faces_to_close(vertex, &mut closed)?;
            if !self.is_tear && self.flip_tip(vertex, &closed, faces, &mut vertices)? {
                closed.clear();
                memory::push(&mut vertices, vertex)?;
                continue;
            }
            for (tetrahedron, face) in closed.drain(..) {
                if self.solid.tetrahedra[tetrahedron].faces[face] == FaceState::Opening {
                    self.set_face(tetrahedron, face, FaceState::Severed)?;
                    memory::extend(&mut vertices, self.solid.face(tetrahedron, face))?;
                }
            }
        }
        memory::sort_once(faces);
        faces.retain(|&(tetrahedron, face)| self.solid.tetrahedra[tetrahedron].faces[face] == FaceState::Opening);
        Ok(())
    }

    /// Moves a tip to the other side of the blade. A tip has all corners on the blade and only touches a vertex at
    /// which the other side is rendered too. Returns true if there was one.
    fn flip_tip(
        &mut self,
        vertex: u32,
        closed: &[(u32, usize)],
        faces: &mut Vec<(u32, usize)>,
        vertices: &mut Vec<u32>,
    ) -> Result<bool> {
        let Some(&(adjacent, face)) = closed.first() else {
            return Ok(false);
        };
        let stroke = self.solid.stroke.number;
        let mut components = self.solid.components(vertex)?;
        let Some(component) = components.component_of(self.solid.tetrahedra[adjacent].neighbors[face]) else {
            return Ok(false);
        };
        let members = components.star.iter().enumerate();
        let mut tip = memory::gathered(
            members
                .filter(|&(index, _)| components.union.lowest(index) == component)
                .map(|(_, member)| member.0),
        )?;
        let can_flip = |&member: &u32| self.tip(member).is_none() && self.solid.tetrahedra[member].flipped_in != stroke;
        if components.component_of(adjacent) == Some(component) || !tip.iter().all(can_flip) {
            tip.clear();
            let sides = [self.solid.tetrahedra[adjacent].neighbors[face], adjacent];
            tip.extend(sides.iter().find(|side| can_flip(side)));
            if tip.is_empty() {
                return Ok(false);
            }
        }
        for &tetrahedron in &tip {
            self.solid.tetrahedra.edit(tetrahedron, |it| it.flipped_in = stroke)?;
        }
        for &tetrahedron in &tip {
            for face in 0..4 {
                let it = self.solid.tetrahedra[tetrahedron];
                let across = it.neighbors[face];
                if across == NONE {
                    continue;
                }
                let to = if self.lies_on_path(tetrahedron, face) {
                    FaceState::Opening
                } else {
                    FaceState::Whole
                };
                if it.faces[face] == to {
                    continue;
                }
                self.set_face(tetrahedron, face, to)?;
                let opposite_face = self.solid.face_in_neighbor(tetrahedron, face);
                memory::push(faces, (tetrahedron, face).min((across, opposite_face)))?;
                memory::extend(vertices, self.solid.face(tetrahedron, face))?;
            }
        }
        Ok(true)
    }

    /// All severed faces connected with vertices found on the blade, marked as opening, and their corners, both in
    /// order.
    fn collect_severed(&mut self) -> Result<(Vec<FaceOf>, Vec<u32>)> {
        let (mut faces, mut corners) = (Vec::new(), Vec::new());
        let mut vertices = std::mem::take(&mut self.marked);
        let mut star = Vec::new();
        while !vertices.is_empty() {
            for vertex in std::mem::take(&mut vertices) {
                self.solid.vertex_star(vertex, &mut star)?;
                for &(tetrahedron, corner) in &star {
                    for face in (0..4).filter(|&face| face != corner) {
                        let it = self.solid.tetrahedra[tetrahedron];
                        if it.faces[face] == FaceState::Severed && it.neighbors[face] > tetrahedron {
                            self.set_face(tetrahedron, face, FaceState::Opening)?;
                            memory::push(&mut faces, (tetrahedron, face))?;
                            memory::extend(&mut vertices, self.solid.face(tetrahedron, face))?;
                            memory::extend(&mut corners, self.solid.face(tetrahedron, face))?;
                        }
                    }
                }
            }
            memory::sort_once(&mut vertices);
        }
        faces.sort_unstable();
        memory::sort_once(&mut corners);
        Ok((faces, corners))
    }

    /// The opening faces at a vertex that must stay closed. These are faces in all loops around a component but the
    /// main one, and faces without a separating corner. If there are none, it is one face at an edge that would occur
    /// twice in the render surface.
    fn faces_to_close(&self, vertex: u32, closed: &mut Vec<(u32, usize)>) -> Result<()> {
        let mut components = self.solid.components(vertex)?;
        let bare = self.bare_faces(vertex, &mut components)?;
        let is_skin = |bare: &BareFace| self.solid.tetrahedra[bare.tetrahedron].neighbors[bare.face] == NONE;
        // For each component the loop that stays: that with skin, or otherwise the longest.
        let mut main: Vec<(usize, usize, bool, usize)> = Vec::new();
        for loop_faces in bare.chunk_by(|a, b| a.loop_index == b.loop_index) {
            let this = (
                loop_faces[0].component,
                loop_faces[0].loop_index,
                loop_faces.iter().any(is_skin),
                loop_faces.len(),
            );
            match main.iter_mut().find(|best| best.0 == this.0) {
                None => memory::push(&mut main, this)?,
                Some(best) if (this.2, this.3) > (best.2, best.3) => *best = this,
                Some(_) => {}
            }
        }
        for it in &bare {
            let is_main = main.iter().any(|main| main.1 == it.loop_index);
            if !is_main && !is_skin(it) {
                memory::push(closed, (it.tetrahedron, it.face))?;
            }
        }
        for it in &bare {
            if is_skin(it) {
                continue;
            }
            let across = self.solid.tetrahedra[it.tetrahedron].neighbors[it.face];
            let separates = components.component_of(across) != Some(it.component)
                || self.separates(it.from, it.tetrahedron, it.face)?
                || self.separates(it.to, it.tetrahedron, it.face)?;
            if !separates {
                memory::push(closed, (it.tetrahedron, it.face))?;
            }
        }
        if !closed.is_empty() {
            return Ok(());
        }
        for (index, one) in bare.iter().enumerate() {
            for other in &bare[index + 1..] {
                if (one.from, one.component) != (other.from, other.component) {
                    continue;
                }
                let mut far = self.solid.components(one.from)?;
                if far.component_of(one.tetrahedron) == far.component_of(other.tetrahedron)
                    && let Some(face) = self.loosest_face(one.tetrahedron, [vertex, one.from])?
                {
                    return memory::push(closed, face);
                }
            }
        }
        Ok(())
    }

    /// True if the two sides of an opening face separate at another of its corners.
    fn separates(&self, vertex: u32, tetrahedron: u32, face: usize) -> Result<bool> {
        let mut components = self.solid.components(vertex)?;
        let across = self.solid.tetrahedra[tetrahedron].neighbors[face];
        Ok(components.component_of(tetrahedron) != components.component_of(across))
    }

    /// The bare faces at a vertex, in groups of one loop each.
    fn bare_faces(&self, vertex: u32, components: &mut VertexComponents) -> Result<Vec<BareFace>> {
        let mut bare = Vec::new();
        for index in 0..components.star.len() {
            let (tetrahedron, corner) = components.star[index];
            for face in (0..4).filter(|&face| face != corner) {
                if self.solid.is_bare(tetrahedron, face) {
                    let corners = self.solid.face(tetrahedron, face);
                    let first = corners.iter().position(|&corner| corner == vertex).unwrap_or(0);
                    let component = components.union.lowest(index);
                    memory::push(
                        &mut bare,
                        BareFace {
                            tetrahedron,
                            face,
                            from: corners[(first + 1) % 3],
                            to: corners[(first + 2) % 3],
                            component,
                            loop_index: usize::MAX,
                        },
                    )?;
                }
            }
        }
        for start in 0..bare.len() {
            let mut index = start;
            while bare[index].loop_index == usize::MAX {
                bare[index].loop_index = start;
                let it = &bare[index];
                let next = self.solid.next_bare_face(it.tetrahedron, it.face, [vertex, it.to]);
                index = bare
                    .iter()
                    .position(|other| (other.tetrahedron, other.face) == next)
                    .unwrap_or(index);
            }
        }
        bare.sort_by_key(|bare_face| bare_face.loop_index);
        Ok(bare)
    }

    /// The opening face at an edge that has the most edges without another bare face.
    fn loosest_face(&self, tetrahedron: u32, edge: [u32; 2]) -> Result<Option<(u32, usize)>> {
        let (mut ring, mut about) = (Vec::new(), Vec::new());
        self.solid.ring(tetrahedron, edge, &mut ring)?;
        ring.sort_unstable();
        let mut loosest = None;
        for &member in &ring {
            for face in 0..4 {
                let it = self.solid.tetrahedra[member];
                let corners = self.solid.face(member, face);
                let is_at_edge = edge.iter().all(|end| corners.contains(end));
                if !is_at_edge || it.faces[face] != FaceState::Opening || it.neighbors[face] < member {
                    continue;
                }
                let mut free = 0;
                for k in 0..3 {
                    let side = [corners[k], corners[(k + 1) % 3]];
                    self.solid.ring(member, side, &mut about)?;
                    let others = about
                        .iter()
                        .flat_map(|&neighbor| (0..4).map(move |face| (neighbor, face)));
                    let bare = others.filter(|&(neighbor, face)| {
                        let corners = self.solid.face(neighbor, face);
                        side.iter().all(|end| corners.contains(end)) && self.solid.is_bare(neighbor, face)
                    });
                    free += usize::from(bare.count() == 2);
                }
                if loosest.is_none_or(|(most, _)| free > most) {
                    loosest = Some((free, (member, face)));
                }
            }
        }
        Ok(loosest.map(|(_, face)| face))
    }
}

impl CutSolid {
    /// True if a face has no neighbor, or is opening.
    pub(crate) fn is_bare(&self, tetrahedron: u32, face: usize) -> bool {
        let it = &self.tetrahedra[tetrahedron];
        it.neighbors[face] == NONE || it.faces[face] == FaceState::Opening
    }

    fn components(&self, vertex: u32) -> Result<VertexComponents> {
        let mut components = VertexComponents {
            star: Vec::new(),
            union: DisjointSets::default(),
        };
        self.vertex_star(vertex, &mut components.star)?;
        components.union.reset(components.star.len())?;
        for (index, &(tetrahedron, corner)) in components.star.iter().enumerate() {
            for face in (0..4).filter(|&face| face != corner && !self.is_bare(tetrahedron, face)) {
                let across = self.tetrahedra[tetrahedron].neighbors[face];
                if let Ok(other) = components.star.binary_search_by_key(&across, |&(member, _)| member) {
                    components.union.unite(index, other);
                }
            }
        }
        Ok(components)
    }

    /// The next bare face around an edge of a bare face, on the side of the material.
    pub(crate) fn next_bare_face(&self, mut tetrahedron: u32, mut face: usize, edge: [u32; 2]) -> (u32, usize) {
        loop {
            let third = self.tetrahedra[tetrahedron].corners[face];
            let left = self.opposite_corners(tetrahedron, edge);
            let other = if left[0] == third { left[1] } else { left[0] };
            let next = self.corner(tetrahedron, other);
            if self.is_bare(tetrahedron, next) {
                return (tetrahedron, next);
            }
            let across = self.tetrahedra[tetrahedron].neighbors[next];
            face = self.face_in_neighbor(tetrahedron, next);
            tetrahedron = across;
        }
    }
}
