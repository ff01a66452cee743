//! Which faces of the material lie on the blade's way.

use glam::{DVec3, Vec3};

use super::body::{CutSolid, Face, SolidVertex};
use super::cut::SolidCut;
use crate::base::{Result, StateHasher, memory};
use crate::codec::{saved, saved_enum};
use crate::cutting::cut::Sweep;
use crate::cutting::divided::NONE;

/// Steps of the blade that go on from each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SolidStroke {
    /// Its number, from 1 on.
    pub(crate) number: u32,
    /// The blade's edge at the end of the last step.
    end: [Vec3; 2],
    /// The normal of what was swept last, on the side that counts as above.
    normal: DVec3,
    /// Whether it has turned to the side that counts as above, where it turned last.
    turns_up: bool,
}

saved! { SolidStroke { number, end, normal, turns_up } }

impl SolidStroke {
    /// Before the first.
    pub(crate) const NONE: Self = Self {
        number: 0,
        end: [Vec3::NAN; 2],
        normal: DVec3::ZERO,
        turns_up: false,
    };

    /// What tears without a blade.
    pub(crate) fn of_tear(number: u32) -> Self {
        Self { number, ..Self::NONE }
    }

    /// Goes on with a step, or begins again with it, as the next of so many strokes.
    pub(crate) fn go_on(&mut self, sweep: &Sweep, strokes: &mut u32) {
        if self.end != sweep.start {
            *strokes += 1;
            self.number = *strokes;
            self.normal = DVec3::ZERO;
        }
        let way = (sweep.end[0] + sweep.end[1] - sweep.start[0] - sweep.start[1]).as_dvec3();
        let up = self.normal.dot(way);
        if up.abs() > TURN * way.length() {
            self.turns_up = up > 0.0;
        }
        self.end = sweep.end;
    }

    /// Adds its bits.
    pub(crate) fn hash(&self, hasher: &mut StateHasher) {
        hasher.write_u64(u64::from(self.number) << 1 | u64::from(self.turns_up));
        hasher.write_vectors(self.end);
        hasher.write_doubles(&self.normal.to_array());
    }

    /// What was cut has moved since: the edge is here now.
    pub(crate) fn carry(&mut self, edge: [Vec3; 2]) {
        self.end = edge;
    }

    /// The sign with which a normal points to the side that was above before, also of a blade that goes to and fro.
    pub(crate) fn turn(&mut self, normal: DVec3) -> f64 {
        if normal == DVec3::ZERO {
            return 1.0;
        }
        let normal = normal.normalize();
        let sign = if self.normal.dot(normal) < BACK { -1.0 } else { 1.0 };
        self.normal = sign * normal;
        sign
    }
}

/// A plane in the rest shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    /// Of length 1; 0 if the material is so flat that there is none.
    pub(crate) normal: DVec3,
    pub(crate) offset: f64,
}

saved! { Plane { normal, offset } }

impl Plane {
    pub(crate) const NONE: Self = Self {
        normal: DVec3::ZERO,
        offset: 0.0,
    };

    pub(crate) fn height(&self, place: DVec3) -> f64 {
        self.normal.dot(place) - self.offset
    }
}

/// Where a vertex lies, as a stroke has found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// On the blade, which is flat there.
    On,
    /// On the blade, which bends there, so that its plane does not tell the sides.
    OnBend,
    /// Above the blade.
    Above,
    /// Below the blade.
    Below,
}

saved_enum!(Side { 0 => On, 1 => OnBend, 2 => Above, 3 => Below });

/// What the last stroke that came near a vertex has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mark {
    /// The stroke; 0 for none.
    stroke: u32,
    side: Side,
    /// The blade's plane; of a vertex on the blade.
    plane: Plane,
}

saved! { Mark { stroke, side, plane } }

impl Mark {
    pub(crate) const NONE: Self = Self {
        stroke: 0,
        side: Side::Below,
        plane: Plane::NONE,
    };

    /// Adds its bits, with which of so many vertices it is of, if there is one.
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
        matches!(self.side, Side::On | Side::OnBend)
    }
}

impl CutSolid {
    /// What the stroke that goes on has found of a vertex, or else the last that came near it.
    fn mark_of(&self, vertex: u32) -> Mark {
        let SolidVertex { mark, other_mark, .. } = self.vertices[vertex];
        if other_mark.stroke == self.stroke.number {
            other_mark
        } else {
            mark
        }
    }

    /// Adds the bits that what the next cut does depends on: strokes, and what they have left.
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
            let severed = (0..4).filter(|&face| tetrahedron.faces[face] == Face::Severed);
            let severed: u64 = severed.map(|face| 1 << face).sum();
            if severed != 0 || tetrahedron.turned != 0 {
                hasher.write_u64((number as u64) << 4 | severed);
                hasher.write_u64(u64::from(tetrahedron.turned));
            }
        }
    }
}

/// The sine of the angle beyond which a step of the blade turns.
const TURN: f64 = 0.01;

/// What is snapped to a plane again lies within this part of the snapping distance of where it should.
const AGAIN: f64 = 0.5;

/// Planes tell the side of a vertex for sure if they outweigh those that tell the other by this part of all.
const SURE: f64 = 0.5;

/// The cosine of the angle between planes beyond which a stroke bends.
const BENT: f64 = 0.95;

/// The cosine of the angle up to which an earlier stroke lies in the plane of this one.
const SAME: f64 = 0.7;

/// The cosine of the angle beyond which a blade that turns goes back the way that it came.
const BACK: f64 = -0.9;

impl SolidCut<'_> {
    /// Whether a vertex was found on the blade in this stroke.
    pub(crate) fn is_on(&self, vertex: u32) -> bool {
        let mark = self.solid.mark_of(vertex);
        mark.stroke == self.solid.stroke.number && mark.is_on()
    }

    /// What a vertex between two has of a stroke that goes on after this one: it lies on that blade if both do.
    pub(crate) fn mark_between(&self, edge: [u32; 2]) -> Mark {
        let [a, b] = edge.map(|end| {
            let SolidVertex { mark, other_mark, .. } = self.solid.vertices[end];
            let is_open = |mark: &Mark| mark.stroke != self.solid.stroke.number && mark.is_on();
            [mark, other_mark].map(|mark| Some(mark).filter(is_open))
        });
        let of_both = |mark: &Mark| b.iter().flatten().any(|other| other.stroke == mark.stroke);
        a.into_iter().flatten().find(of_both).unwrap_or(Mark::NONE)
    }

    /// Whether a vertex that was found on the blade, in this stroke or before, lies on it again if that has gone on to a plane: near that plane, or
    /// as far off as it was from the same plane before, when it was snapped. Of a blade that goes straight on rounding alone tells.
    pub(crate) fn is_on_again(&self, vertex: u32, plane: Plane, snap: f64) -> bool {
        let mark = self.solid.mark_of(vertex);
        let place = self.solid.rest_place(vertex);
        let (height, turn) = (plane.height(place), plane.normal.dot(mark.plane.normal));
        if !mark.is_on() || height.abs() > snap {
            return false;
        }
        let is_near = self.is_on(vertex) && height.abs() <= AGAIN * snap;
        let is_same = turn.abs() > SAME && (height - turn.signum() * mark.plane.height(place)).abs() <= AGAIN * snap;
        is_near || is_same
    }

    /// A vertex lies on the blade.
    pub(crate) fn mark_on(&mut self, vertex: u32, plane: Plane) -> Result<()> {
        let is_flat = plane.normal == DVec3::ZERO;
        let side = if is_flat { Side::OnBend } else { Side::On };
        let mut new = Mark {
            stroke: self.solid.stroke.number,
            side,
            plane,
        };
        if self.is_on(vertex) {
            let mark = self.solid.mark_of(vertex);
            new.plane = mark.plane;
            if mark.side == Side::OnBend || mark.plane.normal.dot(plane.normal) < BENT {
                new.side = Side::OnBend;
            }
        }
        self.set_mark(vertex, new)?;
        memory::push(&mut self.marked, vertex)
    }

    /// An edge from a vertex leads through the blade.
    pub(crate) fn mark_beside(&mut self, vertex: u32, is_above: bool) -> Result<()> {
        if self.is_on(vertex) {
            return Ok(());
        }
        let mark = Mark {
            stroke: self.solid.stroke.number,
            side: if is_above { Side::Above } else { Side::Below },
            plane: Plane::NONE,
        };
        if self.solid.mark_of(vertex) != mark {
            memory::push(&mut self.beside, vertex)?;
        }
        self.set_mark(vertex, mark)
    }

    fn set_mark(&mut self, vertex: u32, mark: Mark) -> Result<()> {
        if self.solid.mark_of(vertex) == mark {
            return Ok(());
        }
        self.solid.vertices.edit(vertex, |vertex| {
            if vertex.mark.stroke != mark.stroke && vertex.mark.stroke != 0 {
                vertex.other_mark = vertex.mark;
            }
            vertex.mark = mark;
        })
    }

    /// Marks the faces as severed of which all corners are on the blade, and that lie between its two sides.
    pub(crate) fn sever(&mut self) -> Result<()> {
        let mut marked = std::mem::take(&mut self.marked);
        memory::sort_once(&mut marked);
        let mut star = Vec::new();
        let mut adopted = Vec::new();
        for &vertex in &marked {
            self.solid.star(vertex, &mut star)?;
            self.adopt(vertex, &star, &mut adopted)?;
        }
        marked.try_reserve(adopted.len())?;
        marked.append(&mut adopted);
        memory::sort_once(&mut marked);
        let mut about = Vec::new();
        for vertex in marked.iter().copied().chain(std::mem::take(&mut self.beside)) {
            self.solid.star(vertex, &mut star)?;
            about.try_reserve(star.len())?;
            about.extend(star.iter().map(|&(tetrahedron, _)| tetrahedron));
        }
        memory::sort_once(&mut about);
        let tips = about.iter().filter_map(|&tetrahedron| self.tip(tetrahedron));
        let mut tips = memory::collected_within(about.len(), tips)?;
        memory::sort_once(&mut tips);
        for tip in tips {
            self.solid.star(tip, &mut star)?;
            if self.tell_side(tip, &star)? {
                about.try_reserve(star.len())?;
                about.extend(star.iter().map(|&(tetrahedron, _)| tetrahedron));
            }
        }
        memory::sort_once(&mut about);
        for &tetrahedron in &about {
            let it = self.solid.tetrahedra[tetrahedron];
            for face in 0..4 {
                if it.neighbours[face] != NONE && it.faces[face] == Face::Whole && self.is_on_the_way(tetrahedron, face)
                {
                    self.set_face(tetrahedron, face, Face::Severed)?;
                    memory::extend(&mut marked, self.solid.face(tetrahedron, face))?;
                }
            }
        }
        memory::sort_once(&mut marked);
        self.marked = marked;
        Ok(())
    }

    /// Vertices beside one on the blade that an earlier stroke left in the same plane are of this stroke too.
    fn adopt(&mut self, vertex: u32, star: &[(u32, usize)], adopted: &mut Vec<u32>) -> Result<()> {
        let Mark { stroke, plane, .. } = self.solid.mark_of(vertex);
        let place = self.solid.rest_place(vertex);
        for &(tetrahedron, _) in star {
            let it = self.solid.tetrahedra[tetrahedron];
            let snap = self.solid.cells[it.cell].snap;
            for corner in it.corners {
                let SolidVertex { mark, other_mark, .. } = self.solid.vertices[corner];
                if [mark, other_mark].iter().any(|mark| mark.stroke == stroke) || mark.stroke == 0 || !mark.is_on() {
                    continue;
                }
                let turn = mark.plane.normal.dot(plane.normal);
                let is_near =
                    plane.height(self.solid.rest_place(corner)).abs() <= snap && mark.plane.height(place).abs() <= snap;
                if turn.abs() > SAME && is_near {
                    self.solid.vertices.edit(corner, |corner| {
                        corner.mark.stroke = stroke;
                        corner.mark.plane.normal *= turn.signum();
                        corner.mark.plane.offset *= turn.signum();
                    })?;
                    memory::push(adopted, corner)?;
                }
            }
        }
        Ok(())
    }

    pub(crate) fn is_on_the_way(&self, tetrahedron: u32, face: usize) -> bool {
        let across = self.solid.tetrahedra[tetrahedron].neighbours[face];
        let corners = self.solid.face(tetrahedron, face);
        corners.iter().all(|&corner| self.is_on(corner)) && self.is_above(tetrahedron) != self.is_above(across)
    }

    /// The corner of a tetrahedron that alone is not on the blade.
    pub(crate) fn tip(&self, tetrahedron: u32) -> Option<u32> {
        let mut tips = self.solid.tetrahedra[tetrahedron]
            .corners
            .into_iter()
            .filter(|&corner| !self.is_on(corner));
        tips.next().filter(|_| tips.next().is_none())
    }

    /// Finds the side that a vertex lies on, by the planes of those on the blade to which it has edges, the near ones above all; answers whether
    /// that is news.
    fn tell_side(&mut self, vertex: u32, star: &[(u32, usize)]) -> Result<bool> {
        let place = self.solid.rest_place(vertex);
        let (mut flat, mut bent, mut size) = (0.0, 0.0, 0.0);
        for &(tetrahedron, corner) in star {
            for other in (0..4).filter(|&other| other != corner) {
                let other = self.solid.tetrahedra[tetrahedron].corners[other];
                if self.is_on(other) {
                    let mark = self.solid.mark_of(other);
                    let distance = self.solid.rest_place(other).distance(place);
                    let term = mark.plane.height(place) / distance.powi(3);
                    if mark.side == Side::On {
                        (flat, size) = (flat + term, size + term.abs());
                    } else {
                        bent += term;
                    }
                }
            }
        }
        let mark = self.solid.mark_of(vertex);
        let is_above = if size > 0.0 && flat.abs() <= SURE * size {
            if mark.stroke == self.solid.stroke.number {
                return Ok(false);
            }
            // It lies outside of a bend: below one part of the blade where that turns up.
            !self.solid.stroke.turns_up
        } else if flat == 0.0 {
            bent >= 0.0
        } else {
            flat > 0.0
        };
        let mark = Mark {
            stroke: self.solid.stroke.number,
            side: if is_above { Side::Above } else { Side::Below },
            plane: Plane::NONE,
        };
        let is_news = self.solid.mark_of(vertex) != mark;
        self.set_mark(vertex, mark)?;
        Ok(is_news)
    }

    /// Whether a tetrahedron with three corners or more on the blade lies above it.
    pub(crate) fn is_above(&self, tetrahedron: u32) -> bool {
        match self.tip(tetrahedron) {
            Some(tip) if self.solid.mark_of(tip).stroke == self.solid.stroke.number => {
                self.solid.mark_of(tip).side == Side::Above
            }
            Some(tip) => self.is_place_above(tetrahedron, self.solid.rest_place(tip)),
            None => {
                let corners = self.solid.tetrahedra[tetrahedron].corners;
                let sum: DVec3 = corners.map(|corner| self.solid.rest_place(corner)).iter().sum();
                let is_turned = self.solid.tetrahedra[tetrahedron].turned == self.solid.stroke.number;
                self.is_place_above(tetrahedron, 0.25 * sum) != is_turned
            }
        }
    }

    /// Whether a place lies above the blade by the planes at a tetrahedron's corners, those of bends only if there are no others.
    fn is_place_above(&self, tetrahedron: u32, place: DVec3) -> bool {
        let (mut flat, mut bent) = (0.0, 0.0);
        for corner in self.solid.tetrahedra[tetrahedron].corners {
            let mark = self.solid.mark_of(corner);
            if self.is_on(corner) {
                let sum = if mark.side == Side::On { &mut flat } else { &mut bent };
                *sum += mark.plane.height(place);
            }
        }
        if flat == 0.0 { bent >= 0.0 } else { flat > 0.0 }
    }

    /// Sets what becomes of a face with a tetrahedron across.
    pub(crate) fn set_face(&mut self, tetrahedron: u32, face: usize, to: Face) -> Result<()> {
        let across = self.solid.tetrahedra[tetrahedron].neighbours[face];
        let back = self.solid.back(tetrahedron, face);
        self.solid.tetrahedra.edit(tetrahedron, |it| it.faces[face] = to)?;
        self.solid.tetrahedra.edit(across, |it| it.faces[back] = to)
    }
}
