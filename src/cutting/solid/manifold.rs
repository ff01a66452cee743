//! Which severed faces can open: those with which what is drawn stays manifold.
//!
//! A severed face of which no corner parts cannot gape. It stays closed, like one that hangs on to the others by a corner alone, until the blade has
//! gone on.

use super::body::{CutSolid, Face};
use super::cut::SolidCut;
use crate::base::DisjointSets;
use crate::base::{Result, memory};
use crate::cutting::divided::NONE;

/// A tetrahedron and which of its faces.
type FaceOf = (u32, usize);

/// A face at a vertex that will have nothing across.
#[derive(Clone, Copy)]
struct Bare {
    tetrahedron: u32,
    face: usize,
    /// The other corners, counterclockwise seen from outside.
    from: u32,
    to: u32,
    /// Which of the parts about the vertex it belongs to.
    part: usize,
    /// Which of the rounds of such faces.
    round: usize,
}

/// What hangs together about a vertex once faces are open.
struct VertexParts {
    star: Vec<(u32, usize)>,
    union: DisjointSets,
}

impl VertexParts {
    /// The part that a tetrahedron is in.
    fn of(&mut self, tetrahedron: u32) -> Option<usize> {
        let at = self.star.binary_search_by_key(&tetrahedron, |&(of, _)| of).ok()?;
        Some(self.union.lowest(at))
    }
}

impl SolidCut<'_> {
    /// The severed faces that hang together with vertices found on the blade in this step and can open, each by the lower of its tetrahedra, marked
    /// as such.
    pub(crate) fn ready(&mut self) -> Result<Vec<(u32, usize)>> {
        let (mut faces, mut vertices) = self.severed()?;
        self.keep_crumbs(&mut faces)?;
        loop {
            self.close_some(&mut faces, vertices)?;
            let count = faces.len();
            self.keep_crumbs(&mut faces)?;
            if faces.len() == count {
                return Ok(faces);
            }
            // What was drawn about a crumb may have kept the rest manifold.
            vertices = memory::reserved(3 * faces.len())?;
            for &(tetrahedron, face) in &faces {
                vertices.extend(self.solid.face(tetrahedron, face));
            }
            memory::sort_once(&mut vertices);
        }
    }

    /// Closes faces until what is drawn about all vertices is manifold; looks at those given, and goes on from there.
    fn close_some(&mut self, faces: &mut Vec<(u32, usize)>, mut vertices: Vec<u32>) -> Result<()> {
        let mut at = 0;
        let mut closed = Vec::new();
        while let Some(&vertex) = vertices.get(at) {
            at += 1;
            self.closed_at(vertex, &mut closed)?;
            if !self.is_tear && self.turn_tip(vertex, &closed, faces, &mut vertices)? {
                closed.clear();
                memory::push(&mut vertices, vertex)?;
                continue;
            }
            for (tetrahedron, face) in closed.drain(..) {
                if self.solid.tetrahedra[tetrahedron].faces[face] == Face::Opening {
                    self.set_face(tetrahedron, face, Face::Severed)?;
                    memory::extend(&mut vertices, self.solid.face(tetrahedron, face))?;
                }
            }
        }
        memory::sort_once(faces);
        faces.retain(|&(tetrahedron, face)| self.solid.tetrahedra[tetrahedron].faces[face] == Face::Opening);
        Ok(())
    }

    /// A tip of what lies on one side of the blade that only touches a vertex where the other side is drawn too, and that has all corners on the
    /// blade, counts as on the other side. Answers whether there was one.
    fn turn_tip(
        &mut self,
        vertex: u32,
        closed: &[(u32, usize)],
        faces: &mut Vec<(u32, usize)>,
        vertices: &mut Vec<u32>,
    ) -> Result<bool> {
        let Some(&(beside, face)) = closed.first() else {
            return Ok(false);
        };
        let stroke = self.solid.stroke.number;
        let mut parts = self.solid.parts(vertex)?;
        let Some(part) = parts.of(self.solid.tetrahedra[beside].neighbours[face]) else {
            return Ok(false);
        };
        let of_part = parts.star.iter().enumerate();
        let mut tip = memory::gathered(
            of_part
                .filter(|&(at, _)| parts.union.lowest(at) == part)
                .map(|(_, of)| of.0),
        )?;
        let may_turn = |&of: &u32| self.tip(of).is_none() && self.solid.tetrahedra[of].turned != stroke;
        if parts.of(beside) == Some(part) || !tip.iter().all(may_turn) {
            tip.clear();
            let sides = [self.solid.tetrahedra[beside].neighbours[face], beside];
            tip.extend(sides.iter().find(|of| may_turn(of)));
            if tip.is_empty() {
                return Ok(false);
            }
        }
        for &tetrahedron in &tip {
            self.solid.tetrahedra.edit(tetrahedron, |it| it.turned = stroke)?;
        }
        for &tetrahedron in &tip {
            for face in 0..4 {
                let it = self.solid.tetrahedra[tetrahedron];
                let across = it.neighbours[face];
                if across == NONE {
                    continue;
                }
                let to = if self.is_on_the_way(tetrahedron, face) {
                    Face::Opening
                } else {
                    Face::Whole
                };
                if it.faces[face] == to {
                    continue;
                }
                self.set_face(tetrahedron, face, to)?;
                let back = self.solid.back(tetrahedron, face);
                memory::push(faces, (tetrahedron, face).min((across, back)))?;
                memory::extend(vertices, self.solid.face(tetrahedron, face))?;
            }
        }
        Ok(true)
    }

    /// All severed faces that hang together with vertices found on the blade, marked as opening, and their corners, both in order.
    fn severed(&mut self) -> Result<(Vec<FaceOf>, Vec<u32>)> {
        let (mut faces, mut corners) = (Vec::new(), Vec::new());
        let mut vertices = std::mem::take(&mut self.marked);
        let mut star = Vec::new();
        while !vertices.is_empty() {
            for vertex in std::mem::take(&mut vertices) {
                self.solid.star(vertex, &mut star)?;
                for &(tetrahedron, corner) in &star {
                    for face in (0..4).filter(|&face| face != corner) {
                        let it = self.solid.tetrahedra[tetrahedron];
                        if it.faces[face] == Face::Severed && it.neighbours[face] > tetrahedron {
                            self.set_face(tetrahedron, face, Face::Opening)?;
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

    /// Opening faces at a vertex that have to stay closed: of rounds of bare faces about one part all but the main one; those of which no corner
    /// parts; and one face at an edge that would be twice in what is drawn.
    fn closed_at(&self, vertex: u32, closed: &mut Vec<(u32, usize)>) -> Result<()> {
        let mut parts = self.solid.parts(vertex)?;
        let bare = self.bare(vertex, &mut parts)?;
        let is_skin = |bare: &Bare| self.solid.tetrahedra[bare.tetrahedron].neighbours[bare.face] == NONE;
        // For each part the round that stays: that of skin, or else the longest.
        let mut main: Vec<(usize, usize, bool, usize)> = Vec::new();
        for of_round in bare.chunk_by(|a, b| a.round == b.round) {
            let this = (
                of_round[0].part,
                of_round[0].round,
                of_round.iter().any(is_skin),
                of_round.len(),
            );
            match main.iter_mut().find(|known| known.0 == this.0) {
                None => memory::push(&mut main, this)?,
                Some(known) if (this.2, this.3) > (known.2, known.3) => *known = this,
                Some(_) => {}
            }
        }
        for it in &bare {
            let is_main = main.iter().any(|main| main.1 == it.round);
            if !is_main && !is_skin(it) {
                memory::push(closed, (it.tetrahedron, it.face))?;
            }
        }
        for it in &bare {
            if is_skin(it) {
                continue;
            }
            let across = self.solid.tetrahedra[it.tetrahedron].neighbours[it.face];
            let is_parted = parts.of(across) != Some(it.part)
                || self.is_parted(it.from, it.tetrahedron, it.face)?
                || self.is_parted(it.to, it.tetrahedron, it.face)?;
            if !is_parted {
                memory::push(closed, (it.tetrahedron, it.face))?;
            }
        }
        if !closed.is_empty() {
            return Ok(());
        }
        for (at, one) in bare.iter().enumerate() {
            for other in &bare[at + 1..] {
                if (one.from, one.part) != (other.from, other.part) {
                    continue;
                }
                let mut far = self.solid.parts(one.from)?;
                if far.of(one.tetrahedron) == far.of(other.tetrahedron)
                    && let Some(face) = self.loosest(one.tetrahedron, [vertex, one.from])?
                {
                    return memory::push(closed, face);
                }
            }
        }
        Ok(())
    }

    /// Whether at another corner what lies on the two sides of an opening face parts.
    fn is_parted(&self, vertex: u32, tetrahedron: u32, face: usize) -> Result<bool> {
        let mut parts = self.solid.parts(vertex)?;
        let across = self.solid.tetrahedra[tetrahedron].neighbours[face];
        Ok(parts.of(tetrahedron) != parts.of(across))
    }

    /// The bare faces at a vertex, those of a round one after the other.
    fn bare(&self, vertex: u32, parts: &mut VertexParts) -> Result<Vec<Bare>> {
        let mut bare = Vec::new();
        for at in 0..parts.star.len() {
            let (tetrahedron, corner) = parts.star[at];
            for face in (0..4).filter(|&face| face != corner) {
                if self.solid.is_bare(tetrahedron, face) {
                    let corners = self.solid.face(tetrahedron, face);
                    let first = corners.iter().position(|&of| of == vertex).unwrap_or(0);
                    let part = parts.union.lowest(at);
                    memory::push(
                        &mut bare,
                        Bare {
                            tetrahedron,
                            face,
                            from: corners[(first + 1) % 3],
                            to: corners[(first + 2) % 3],
                            part,
                            round: usize::MAX,
                        },
                    )?;
                }
            }
        }
        for start in 0..bare.len() {
            let mut at = start;
            while bare[at].round == usize::MAX {
                bare[at].round = start;
                let it = &bare[at];
                let next = self.solid.beside(it.tetrahedron, it.face, [vertex, it.to]);
                at = bare
                    .iter()
                    .position(|of| (of.tetrahedron, of.face) == next)
                    .unwrap_or(at);
            }
        }
        bare.sort_by_key(|of| of.round);
        Ok(bare)
    }

    /// Of the opening faces at an edge that with the most edges that no other bare face has.
    fn loosest(&self, tetrahedron: u32, edge: [u32; 2]) -> Result<Option<(u32, usize)>> {
        let (mut ring, mut about) = (Vec::new(), Vec::new());
        self.solid.ring(tetrahedron, edge, &mut ring)?;
        ring.sort_unstable();
        let mut loosest = None;
        for &at in &ring {
            for face in 0..4 {
                let it = self.solid.tetrahedra[at];
                let corners = self.solid.face(at, face);
                let is_at_edge = edge.iter().all(|end| corners.contains(end));
                if !is_at_edge || it.faces[face] != Face::Opening || it.neighbours[face] < at {
                    continue;
                }
                let mut free = 0;
                for k in 0..3 {
                    let side = [corners[k], corners[(k + 1) % 3]];
                    self.solid.ring(at, side, &mut about)?;
                    let others = about.iter().flat_map(|&of| (0..4).map(move |face| (of, face)));
                    let bare = others.filter(|&(of, face)| {
                        let corners = self.solid.face(of, face);
                        side.iter().all(|end| corners.contains(end)) && self.solid.is_bare(of, face)
                    });
                    free += usize::from(bare.count() == 2);
                }
                if loosest.is_none_or(|(most, _)| free > most) {
                    loosest = Some((free, (at, face)));
                }
            }
        }
        Ok(loosest.map(|(_, face)| face))
    }
}

impl CutSolid {
    /// Whether a face has nothing across, or is opening.
    pub(crate) fn is_bare(&self, tetrahedron: u32, face: usize) -> bool {
        let it = &self.tetrahedra[tetrahedron];
        it.neighbours[face] == NONE || it.faces[face] == Face::Opening
    }

    fn parts(&self, vertex: u32) -> Result<VertexParts> {
        let mut parts = VertexParts {
            star: Vec::new(),
            union: DisjointSets::default(),
        };
        self.star(vertex, &mut parts.star)?;
        parts.union.reset(parts.star.len())?;
        for (at, &(tetrahedron, corner)) in parts.star.iter().enumerate() {
            for face in (0..4).filter(|&face| face != corner && !self.is_bare(tetrahedron, face)) {
                let across = self.tetrahedra[tetrahedron].neighbours[face];
                if let Ok(other) = parts.star.binary_search_by_key(&across, |&(of, _)| of) {
                    parts.union.unite(at, other);
                }
            }
        }
        Ok(parts)
    }

    /// The bare face that comes next round an edge of a bare face, on the material's side.
    pub(crate) fn beside(&self, mut tetrahedron: u32, mut face: usize, edge: [u32; 2]) -> (u32, usize) {
        loop {
            let third = self.tetrahedra[tetrahedron].corners[face];
            let left = self.others(tetrahedron, edge);
            let other = if left[0] == third { left[1] } else { left[0] };
            let next = self.corner(tetrahedron, other);
            if self.is_bare(tetrahedron, next) {
                return (tetrahedron, next);
            }
            let across = self.tetrahedra[tetrahedron].neighbours[next];
            face = self.back(tetrahedron, next);
            tetrahedron = across;
        }
    }
}
