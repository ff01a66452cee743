//! Finds the faces of the material on the blade's path.

use glam::{DVec3, Vec3};

use super::body::{CutSolid, FaceState, SolidVertex};
use super::cut::SolidCut;
use crate::base::{Result, StateHasher, memory};
use crate::codec::{saved, saved_enum};
use crate::cutting::cell_complex::NONE;
use crate::cutting::cut::Sweep;

/// Consecutive steps of a blade.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SolidStroke {
    /// The number of the stroke, from 1 on.
    pub(crate) number: u32,
    /// The blade's edge at the end of the last step.
    end: [Vec3; 2],
    /// The normal of the last swept triangle, on the side that counts as above.
    normal: DVec3,
    /// True if the last bend of the path was towards the side that counts as above.
    bends_up: bool,
}

saved! { SolidStroke { number, end, normal, bends_up } }

impl SolidStroke {
    /// The state before the first stroke.
    pub(crate) const NONE: Self = Self {
        number: 0,
        end: [Vec3::NAN; 2],
        normal: DVec3::ZERO,
        bends_up: false,
    };

    /// The stroke of a tear without a blade.
    pub(crate) fn for_tear(number: u32) -> Self {
        Self { number, ..Self::NONE }
    }

    /// Continues the stroke with a step, or begins the next stroke if the step starts elsewhere.
    pub(crate) fn advance(&mut self, sweep: &Sweep, strokes: &mut u32) {
        if self.end != sweep.start {
            *strokes += 1;
            self.number = *strokes;
            self.normal = DVec3::ZERO;
        }
        let displacement = (sweep.end[0] + sweep.end[1] - sweep.start[0] - sweep.start[1]).as_dvec3();
        let up = self.normal.dot(displacement);
        if up.abs() > MIN_BEND * displacement.length() {
            self.bends_up = up > 0.0;
        }
        self.end = sweep.end;
    }

    /// Hashes the stroke.
    pub(crate) fn hash(&self, hasher: &mut StateHasher) {
        hasher.write_u64(u64::from(self.number) << 1 | u64::from(self.bends_up));
        hasher.write_vectors(self.end);
        hasher.write_doubles(&self.normal.to_array());
    }

    /// Sets the current position of the edge after the material has moved.
    pub(crate) fn set_edge(&mut self, edge: [Vec3; 2]) {
        self.end = edge;
    }

    /// The sign with which a normal points to the side that was above before, also if the blade reverses.
    pub(crate) fn orient(&mut self, normal: DVec3) -> f64 {
        if normal == DVec3::ZERO {
            return 1.0;
        }
        let normal = normal.normalize();
        let sign = if self.normal.dot(normal) < REVERSED { -1.0 } else { 1.0 };
        self.normal = sign * normal;
        sign
    }
}

/// A plane in the rest shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    /// Unit normal; 0 if the material is too flat to define a plane.
    pub(crate) normal: DVec3,
    pub(crate) offset: f64,
}

saved! { Plane { normal, offset } }

impl Plane {
    pub(crate) const NONE: Self = Self {
        normal: DVec3::ZERO,
        offset: 0.0,
    };

    pub(crate) fn height(&self, position: DVec3) -> f64 {
        self.normal.dot(position) - self.offset
    }
}

/// The position of a vertex relative to the blade of a stroke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BladeSide {
    /// On the blade, where it is flat.
    On,
    /// On the blade at a bend, where its plane does not define the sides.
    OnBend,
    /// Above the blade.
    Above,
    /// Below the blade.
    Below,
}

saved_enum!(BladeSide { 0 => On, 1 => OnBend, 2 => Above, 3 => Below });

/// The position of a vertex relative to the blade in a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BladeMark {
    /// The stroke; 0 for none.
    stroke: u32,
    side: BladeSide,
    /// The blade's plane, for a vertex on the blade.
    plane: Plane,
}

saved! { BladeMark { stroke, side, plane } }

impl BladeMark {
    pub(crate) const NONE: Self = Self {
        stroke: 0,
        side: BladeSide::Below,
        plane: Plane::NONE,
    };

    /// Hashes the mark and the index of its vertex, if it belongs to a stroke.
    fn hash(&self, vertex: usize, hasher: &mut StateHasher) {
        if self.stroke == 0 {
            return;
        }
        hasher.write_u64((vertex as u64) << 32 | u64::from(self.stroke));
        hasher.write_u64(self.side as u64);
        hasher.write_doubles(&self.plane.normal.to_array());
        hasher.write_doubles(&[self.plane.offset]);
    }

    fn is_on(&self) -> bool {
        matches!(self.side, BladeSide::On | BladeSide::OnBend)
    }
}

impl CutSolid {
    /// The mark of a vertex in the current stroke, or in the last stroke near it.
    fn current_mark(&self, vertex: u32) -> BladeMark {
        let SolidVertex { mark, other_mark, .. } = self.vertices[vertex];
        if other_mark.stroke == self.stroke.number {
            other_mark
        } else {
            mark
        }
    }

    /// Hashes the state that the next cut depends on: strokes and their marks.
    pub(crate) fn hash(&self, hasher: &mut StateHasher) {
        if self.strokes == 0 {
            return;
        }
        hasher.write_u64(u64::from(self.strokes));
        self.stroke.hash(hasher);
        for (number, vertex) in self.vertices().iter().enumerate() {
            vertex.mark.hash(number, hasher);
            vertex.other_mark.hash(number, hasher);
        }
        for (number, tetrahedron) in self.tetrahedra().iter().enumerate() {
            let severed = (0..4).filter(|&face| tetrahedron.faces[face] == FaceState::Severed);
            let severed: u64 = severed.map(|face| 1 << face).sum();
            if severed != 0 || tetrahedron.flipped_in != 0 {
                hasher.write_u64((number as u64) << 4 | severed);
                hasher.write_u64(u64::from(tetrahedron.flipped_in));
            }
        }
    }
}

/// The sine of the smallest angle at which a step bends the path.
const MIN_BEND: f64 = 0.01;

/// A vertex is snapped to a plane again within this fraction of the snapping distance from its expected position.
const RESNAP: f64 = 0.5;

/// The side of a vertex is certain if the net vote of the planes exceeds this fraction of the total.
const CERTAIN: f64 = 0.5;

/// The cosine of the smallest angle between planes at which a stroke has a bend.
const BEND: f64 = 0.95;

/// The cosine of the largest angle at which an earlier stroke is in the same plane.
const SAME_PLANE: f64 = 0.7;

/// The cosine of the smallest angle at which the blade reverses.
const REVERSED: f64 = -0.9;

impl SolidCut<'_> {
    /// True if a vertex was found on the blade in this stroke.
    pub(crate) fn is_on(&self, vertex: u32) -> bool {
        let mark = self.solid.current_mark(vertex);
        mark.stroke == self.solid.stroke.number && mark.is_on()
    }

    /// The mark of a new vertex between two others in an earlier stroke that can continue. It is on that blade if both
    /// others are.
    pub(crate) fn mark_between(&self, edge: [u32; 2]) -> BladeMark {
        let [a, b] = edge.map(|end| {
            let SolidVertex { mark, other_mark, .. } = self.solid.vertices[end];
            let is_open = |mark: &BladeMark| mark.stroke != self.solid.stroke.number && mark.is_on();
            [mark, other_mark].map(|mark| Some(mark).filter(is_open))
        });
        let is_on_both = |mark: &BladeMark| b.iter().flatten().any(|other| other.stroke == mark.stroke);
        a.into_iter().flatten().find(is_on_both).unwrap_or(BladeMark::NONE)
    }

    /// True if a vertex on the blade, of this or an earlier stroke, is also on the next plane. It must be near that
    /// plane, or as far from it as it was from the same plane when it was snapped. For a straight path, only rounding
    /// matters.
    pub(crate) fn is_on_again(&self, vertex: u32, plane: Plane, snap: f64) -> bool {
        let mark = self.solid.current_mark(vertex);
        let position = self.solid.rest_place(vertex);
        let (height, cosine) = (plane.height(position), plane.normal.dot(mark.plane.normal));
        if !mark.is_on() || height.abs() > snap {
            return false;
        }
        let is_near = self.is_on(vertex) && height.abs() <= RESNAP * snap;
        let is_same = cosine.abs() > SAME_PLANE
            && (height - cosine.signum() * mark.plane.height(position)).abs() <= RESNAP * snap;
        is_near || is_same
    }

    /// Marks a vertex as on the blade.
    pub(crate) fn mark_on(&mut self, vertex: u32, plane: Plane) -> Result<()> {
        let is_flat = plane.normal == DVec3::ZERO;
        let side = if is_flat { BladeSide::OnBend } else { BladeSide::On };
        let mut new = BladeMark {
            stroke: self.solid.stroke.number,
            side,
            plane,
        };
        if self.is_on(vertex) {
            let mark = self.solid.current_mark(vertex);
            new.plane = mark.plane;
            if mark.side == BladeSide::OnBend || mark.plane.normal.dot(plane.normal) < BEND {
                new.side = BladeSide::OnBend;
            }
        }
        self.set_mark(vertex, new)?;
        memory::push(&mut self.marked, vertex)
    }

    /// Marks a vertex next to the blade, on one of its sides, because an edge from it crosses the blade.
    pub(crate) fn mark_beside(&mut self, vertex: u32, is_above: bool) -> Result<()> {
        if self.is_on(vertex) {
            return Ok(());
        }
        let mark = BladeMark {
            stroke: self.solid.stroke.number,
            side: if is_above { BladeSide::Above } else { BladeSide::Below },
            plane: Plane::NONE,
        };
        if self.solid.current_mark(vertex) != mark {
            memory::push(&mut self.side_changed, vertex)?;
        }
        self.set_mark(vertex, mark)
    }

    fn set_mark(&mut self, vertex: u32, mark: BladeMark) -> Result<()> {
        if self.solid.current_mark(vertex) == mark {
            return Ok(());
        }
        self.solid.vertices.edit(vertex, |vertex| {
            if vertex.mark.stroke != mark.stroke && vertex.mark.stroke != 0 {
                vertex.other_mark = vertex.mark;
            }
            vertex.mark = mark;
        })
    }

    /// Marks faces as severed if all their corners are on the blade, and they lie between its two sides.
    pub(crate) fn mark_severed(&mut self) -> Result<()> {
        let mut marked = std::mem::take(&mut self.marked);
        memory::sort_once(&mut marked);
        let mut star = Vec::new();
        let mut adopted = Vec::new();
        for &vertex in &marked {
            self.solid.vertex_star(vertex, &mut star)?;
            self.adopt_earlier_marks(vertex, &star, &mut adopted)?;
        }
        marked.try_reserve(adopted.len())?;
        marked.append(&mut adopted);
        memory::sort_once(&mut marked);
        let mut around = Vec::new();
        for vertex in marked.iter().copied().chain(std::mem::take(&mut self.side_changed)) {
            self.solid.vertex_star(vertex, &mut star)?;
            around.try_reserve(star.len())?;
            around.extend(star.iter().map(|&(tetrahedron, _)| tetrahedron));
        }
        memory::sort_once(&mut around);
        let tips = around.iter().filter_map(|&tetrahedron| self.tip(tetrahedron));
        let mut tips = memory::collected_within(around.len(), tips)?;
        memory::sort_once(&mut tips);
        for tip in tips {
            self.solid.vertex_star(tip, &mut star)?;
            if self.classify_side(tip, &star)? {
                around.try_reserve(star.len())?;
                around.extend(star.iter().map(|&(tetrahedron, _)| tetrahedron));
            }
        }
        memory::sort_once(&mut around);
        for &tetrahedron in &around {
            let it = self.solid.tetrahedra[tetrahedron];
            for face in 0..4 {
                if it.neighbors[face] != NONE
                    && it.faces[face] == FaceState::Whole
                    && self.lies_on_path(tetrahedron, face)
                {
                    self.set_face(tetrahedron, face, FaceState::Severed)?;
                    memory::extend(&mut marked, self.solid.face(tetrahedron, face))?;
                }
            }
        }
        memory::sort_once(&mut marked);
        self.marked = marked;
        Ok(())
    }

    /// Assigns vertices next to one on the blade to this stroke, if an earlier stroke in the same plane marked them.
    fn adopt_earlier_marks(&mut self, vertex: u32, star: &[(u32, usize)], adopted: &mut Vec<u32>) -> Result<()> {
        let BladeMark { stroke, plane, .. } = self.solid.current_mark(vertex);
        let position = self.solid.rest_place(vertex);
        for &(tetrahedron, _) in star {
            let it = self.solid.tetrahedra[tetrahedron];
            let snap = self.solid.cells[it.cell].snap;
            for corner in it.corners {
                let SolidVertex { mark, other_mark, .. } = self.solid.vertices[corner];
                if [mark, other_mark].iter().any(|mark| mark.stroke == stroke) || mark.stroke == 0 || !mark.is_on() {
                    continue;
                }
                let cosine = mark.plane.normal.dot(plane.normal);
                let is_near = plane.height(self.solid.rest_place(corner)).abs() <= snap
                    && mark.plane.height(position).abs() <= snap;
                if cosine.abs() > SAME_PLANE && is_near {
                    self.solid.vertices.edit(corner, |corner| {
                        corner.mark.stroke = stroke;
                        corner.mark.plane.normal *= cosine.signum();
                        corner.mark.plane.offset *= cosine.signum();
                    })?;
                    memory::push(adopted, corner)?;
                }
            }
        }
        Ok(())
    }

    pub(crate) fn lies_on_path(&self, tetrahedron: u32, face: usize) -> bool {
        let across = self.solid.tetrahedra[tetrahedron].neighbors[face];
        let corners = self.solid.face(tetrahedron, face);
        corners.iter().all(|&corner| self.is_on(corner)) && self.is_above(tetrahedron) != self.is_above(across)
    }

    /// The only corner of a tetrahedron that is not on the blade.
    pub(crate) fn tip(&self, tetrahedron: u32) -> Option<u32> {
        let mut tips = self.solid.tetrahedra[tetrahedron]
            .corners
            .into_iter()
            .filter(|&corner| !self.is_on(corner));
        tips.next().filter(|_| tips.next().is_none())
    }

    /// Finds the side of a vertex from the planes of adjacent vertices on the blade. Near ones have more weight.
    /// True if the side has changed.
    fn classify_side(&mut self, vertex: u32, star: &[(u32, usize)]) -> Result<bool> {
        let position = self.solid.rest_place(vertex);
        let (mut flat, mut bent, mut size) = (0.0, 0.0, 0.0);
        for &(tetrahedron, corner) in star {
            for other in (0..4).filter(|&other| other != corner) {
                let other = self.solid.tetrahedra[tetrahedron].corners[other];
                if self.is_on(other) {
                    let mark = self.solid.current_mark(other);
                    let distance = self.solid.rest_place(other).distance(position);
                    let term = mark.plane.height(position) / distance.powi(3);
                    if mark.side == BladeSide::On {
                        (flat, size) = (flat + term, size + term.abs());
                    } else {
                        bent += term;
                    }
                }
            }
        }
        let mark = self.solid.current_mark(vertex);
        let is_above = if size > 0.0 && flat.abs() <= CERTAIN * size {
            if mark.stroke == self.solid.stroke.number {
                return Ok(false);
            }
            // The vertex lies on the outside of a bend: below one part of the blade where its path bends up.
            !self.solid.stroke.bends_up
        } else if flat == 0.0 {
            bent >= 0.0
        } else {
            flat > 0.0
        };
        let mark = BladeMark {
            stroke: self.solid.stroke.number,
            side: if is_above { BladeSide::Above } else { BladeSide::Below },
            plane: Plane::NONE,
        };
        let has_changed = self.solid.current_mark(vertex) != mark;
        self.set_mark(vertex, mark)?;
        Ok(has_changed)
    }

    /// True if a tetrahedron with at least three corners on the blade lies above it.
    pub(crate) fn is_above(&self, tetrahedron: u32) -> bool {
        match self.tip(tetrahedron) {
            Some(tip) if self.solid.current_mark(tip).stroke == self.solid.stroke.number => {
                self.solid.current_mark(tip).side == BladeSide::Above
            }
            Some(tip) => self.is_position_above(tetrahedron, self.solid.rest_place(tip)),
            None => {
                let corners = self.solid.tetrahedra[tetrahedron].corners;
                let sum: DVec3 = corners.map(|corner| self.solid.rest_place(corner)).iter().sum();
                let is_flipped = self.solid.tetrahedra[tetrahedron].flipped_in == self.solid.stroke.number;
                self.is_position_above(tetrahedron, 0.25 * sum) != is_flipped
            }
        }
    }

    /// True if a position lies above the blade according to the planes at a tetrahedron's corners. Planes of bends
    /// count only if there are no others.
    fn is_position_above(&self, tetrahedron: u32, position: DVec3) -> bool {
        let (mut flat, mut bent) = (0.0, 0.0);
        for corner in self.solid.tetrahedra[tetrahedron].corners {
            let mark = self.solid.current_mark(corner);
            if self.is_on(corner) {
                let sum = if mark.side == BladeSide::On {
                    &mut flat
                } else {
                    &mut bent
                };
                *sum += mark.plane.height(position);
            }
        }
        if flat == 0.0 { bent >= 0.0 } else { flat > 0.0 }
    }

    /// Sets the state of a face between two tetrahedra.
    pub(crate) fn set_face(&mut self, tetrahedron: u32, face: usize, to: FaceState) -> Result<()> {
        let across = self.solid.tetrahedra[tetrahedron].neighbors[face];
        let opposite_face = self.solid.face_in_neighbor(tetrahedron, face);
        self.solid.tetrahedra.edit(tetrahedron, |it| it.faces[face] = to)?;
        self.solid.tetrahedra.edit(across, |it| it.faces[opposite_face] = to)
    }
}
