//! The surface of a body that meets other tissue.

use glam::{DVec3, Vec3};

use super::images::Images;
use crate::body::{Body, Bounds, Vectors};
use crate::contact::sweep::{Corners, Segment};
use crate::contact::tool::Detection;
use crate::contact::tree::Tree;
use crate::error::Result;
use crate::memory;
use crate::mesh;

/// Where the nodes of a body may go in a step, and the tree of its triangles as the step begins.
#[derive(Debug)]
pub(super) struct Skin {
    /// The nodes of the surface, in the body's own numbers.
    pub nodes: Vec<u32>,
    pub edges: Vec<[u32; 2]>,
    pub triangles: Vec<[u32; 3]>,
    /// The edges that are looked at with a triangle: each with one.
    owned: Vec<[u32; 3]>,
    pub tree: Tree,
    /// Whether it encloses something.
    pub is_closed: bool,
    /// The edges that pass through other tissue, or the body's own, as the step begins.
    pub pierces: Vec<bool>,
    /// Where the body's coordinates begin.
    pub origin: DVec3,
    /// Where nodes are as a step or substep begins, in the body's coordinates, and how fast they go through it, m/s.
    pub starts: Vectors,
    pub velocities: Vectors,
    /// The middle of these velocities, m/s, and how far any node leaves that, m.
    pub drift: Vec3,
    pub spread: f32,
    /// The box of all velocities that were given.
    pub given: Bounds,
    /// How long its short edges were at first, m: but for a twentieth all are longer. Those without length do not count.
    pub short: f32,
    /// Where nodes were at first, in the body's coordinates, where it meets itself.
    firsts: Option<Vectors>,
    /// How far any node goes, m.
    pub travel: f32,
    /// Whether it meets other bodies, and asks to find them in images.
    pub meets_bodies: bool,
    pub asks_for_images: bool,
    /// The side of a pixel of its images, m.
    pub resolution: f32,
    /// Where others find it, or it others, in images.
    pub images: Option<Images>,
}

/// No edge.
pub(super) const NONE: u32 = u32::MAX;

/// How many pixels a mean edge is long, where it is not said how fine images are; and the longest extent at most.
const PIXELS_OF_EDGE: f32 = 2.0;
const PIXELS: f32 = 1024.0;

impl Skin {
    /// That of a body, which has triangles.
    pub fn new(body: &Body) -> Result<Self> {
        let triangles = body.own_surface()?;
        let edges = mesh::edges(&triangles, &[])?;
        let mut owned = memory::filled([NONE; 3], triangles.len())?;
        let mut is_taken = memory::filled(false, edges.len())?;
        for (of_triangle, &[a, b, c]) in owned.iter_mut().zip(&triangles) {
            for (place, [a, b]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
                if let Ok(edge) = edges.binary_search(&[a.min(b), a.max(b)])
                    && !is_taken[edge]
                {
                    is_taken[edge] = true;
                    of_triangle[place] = edge as u32;
                }
            }
        }
        let pierces = memory::filled(false, edges.len())?;
        let mut nodes = memory::copied(triangles.as_flattened())?;
        nodes.sort_unstable();
        nodes.dedup();
        let positions = body.state.positions();
        let at = |node: u32| positions.get(node as usize);
        let tree = Tree::new(triangles.len(), |triangle| triangles[triangle as usize].map(at))?;
        let lengths = || edges.iter().map(|&[a, b]| at(a).distance(at(b)));
        let contact = &body.contact;
        let mut firsts = None;
        if contact.with_itself {
            let firsts = firsts.insert(Vectors::zeros(body.node_count())?);
            nodes.iter().for_each(|&node| firsts.set(node as usize, at(node)));
        }
        let asks_for_images = contact.with_bodies && contact.detection == Detection::ImageSpace;
        let resolution = if asks_for_images && contact.resolution > 0.0 {
            contact.resolution
        } else {
            let bounds = tree.bounds();
            let chosen = lengths().sum::<f32>() / (edges.len() as f32 * PIXELS_OF_EDGE);
            chosen
                .max((bounds.max - bounds.min).max_element() / PIXELS)
                .max(f32::MIN_POSITIVE)
        };
        Ok(Self {
            short: short_of(lengths(), edges.len())?,
            firsts,
            travel: 0.0,
            meets_bodies: contact.with_bodies,
            asks_for_images,
            resolution,
            images: None,
            nodes,
            edges,
            owned,
            tree,
            is_closed: mesh::is_closed(&triangles)?,
            pierces,
            origin: body.origin,
            starts: Vectors::zeros(body.node_count())?,
            velocities: Vectors::zeros(body.node_count())?,
            drift: Vec3::ZERO,
            spread: 0.0,
            given: Bounds::EMPTY,
            triangles,
        })
    }

    /// Whether a node or an edge, and an edge or a face of the same body, were no further from each other at first than `radius`, m.
    pub fn were_near(&self, nodes: [u32; 2], others: &[u32], radius: f32) -> bool {
        self.firsts.as_ref().is_some_and(|firsts| {
            let at = |node: &u32| firsts.get(*node as usize);
            let segment = Segment {
                ends: nodes.map(|node| at(&node)),
                steps: [Vec3::ZERO; 2],
                radius,
            };
            let mut corners = Corners {
                points: [Vec3::ZERO; 3],
                steps: [Vec3::ZERO; 3],
                count: others.len(),
            };
            for (point, other) in corners.points.iter_mut().zip(others) {
                *point = at(other);
            }
            corners.separation(&segment, 0.0).offset.length_squared() <= radius * radius
        })
    }

    /// Takes a substep of `duration` seconds as it is to be.
    pub fn follow(&mut self, body: &mut Body, duration: f32) {
        let origin = body.origin;
        self.is_closed &= !body.is_cut_open;
        let state = body.state.substep();
        let (starts, velocities) = (state.positions, &*state.velocities);
        match &body.implicit {
            None => self.take(origin, duration, |node| (starts.get(node), velocities.get(node))),
            Some(implicit) => self.take(origin, duration, |node| (starts.get(node), implicit.mean(node))),
        }
    }

    /// Takes the body as it stands when a step that was tried begins, or as it ends.
    pub fn stand(&mut self, body: &Body, at_end: bool) {
        let positions = if at_end {
            body.state.newest().0
        } else {
            body.state.positions()
        };
        self.take(body.origin, 0.0, |node| (positions.get(node), Vec3::ZERO));
    }

    fn take(&mut self, origin: DVec3, duration: f32, motion_of: impl Fn(usize) -> (Vec3, Vec3)) {
        self.origin = origin;
        self.given = Bounds::EMPTY;
        let mut all = Bounds::EMPTY;
        for &node in &self.nodes {
            let (start, velocity) = motion_of(node as usize);
            self.starts.set(node as usize, start);
            self.velocities.set(node as usize, velocity);
            all = all.with(velocity);
        }
        self.drift = 0.5 * (all.min + all.max);
        self.travel = duration * all.min.abs().max(all.max.abs()).length();
        self.spread = 0.5 * duration * (all.max - all.min).length();
        let (triangles, starts) = (&self.triangles, &self.starts);
        self.tree
            .refit(|triangle| triangles[triangle as usize].map(|node| starts.get(node as usize)));
    }

    /// Has images of the surface, if it has none.
    pub fn add_images(&mut self) -> Result<()> {
        if self.images.is_none() {
            self.images = Some(Images::new(self)?);
        }
        Ok(())
    }

    /// Draws what of the surface lies within `part`.
    pub fn draw(&mut self, part: &Bounds) {
        if let Some(mut images) = self.images.take() {
            images.draw(self, part);
            self.images = Some(images);
        }
    }

    /// Shows the triangles that a box comes within `reach` of.
    pub fn near(&self, bounds: &Bounds, reach: f32, mut see: impl FnMut(usize)) {
        self.tree.near(bounds, reach * reach, |place| {
            see(self.tree.triangle(place) as usize);
            reach * reach
        });
    }

    /// The edges that are looked at with a triangle, as numbers.
    pub fn owned(&self, triangle: usize) -> [u32; 3] {
        self.owned[triangle]
    }

    /// Those of these edges that do not pass through tissue: of the others there is no telling which side they belong to.
    pub fn sound(&self, edges: [u32; 3]) -> impl Iterator<Item = [u32; 2]> + '_ {
        let edges = edges.into_iter().filter(|&edge| edge != NONE);
        let edges = edges.map(|edge| edge as usize).filter(|&edge| !self.pierces[edge]);
        edges.map(|edge| self.edges[edge])
    }
}

/// The length that all but a twentieth are longer than, of those that are above 0.
fn short_of(lengths: impl Iterator<Item = f32>, count: usize) -> Result<f32> {
    let mut sorted = memory::reserved(count)?;
    sorted.extend(lengths.filter(|&length| length > 0.0));
    if sorted.is_empty() {
        return Ok(f32::MIN_POSITIVE);
    }
    let place = sorted.len() / 20;
    Ok(*sorted.select_nth_unstable_by(place, f32::total_cmp).1)
}
