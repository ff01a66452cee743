//! Rows of a lattice, found by walking along its springs.
//!
//! In a lattice, flat or solid, the springs of every node go the same few ways: whole multiples of its axes. A walk that
//! starts with the axes at one node gives each node it comes to whole coordinates. As it takes the axes at each node
//! from the springs there, the lattice may be turned, bent or stretched. Where a mesh is no lattice it still gives
//! coordinates; whether they make a good order is for its cost to tell.

use glam::{DMat3, DVec3, Vec3};

use super::links::Links;
use crate::Result;
use crate::memory;

/// A spring is taken for the whole multiple of the axes that it comes this near to, in axes.
const NEAR: f64 = 0.25;

/// The smallest height of an axis over the others, in its length.
const STEEP: f64 = 0.3;

/// No spring of a lattice reaches further than this many axes.
const REACH: f64 = 4.0;

/// Springs of a node that are looked at to find its axes. Lattices have up to 26, or twice that with second neighbours.
const MOST_LINKS: usize = 64;

/// Nodes of a part among which the one to start from is chosen.
const STARTS: usize = 64;

/// What is not reached yet has no part.
const NO_PART: u32 = u32::MAX;

/// The place of a node in its part's lattice.
#[derive(Clone, Copy)]
struct Cell {
    part: u32,
    at: [i32; 3],
}

/// The axes of the lattice at a node; in a sheet the third is its normal, and never stepped along.
#[derive(Clone, Copy, Default)]
struct Axes {
    vectors: [Vec3; 3],
}

impl Axes {
    /// What takes an offset in space to one in axes. Not finite if they lie in a plane.
    fn inverse(&self) -> DMat3 {
        let [a, b, c] = self.vectors.map(|v| v.as_dvec3());
        DMat3::from_cols(a, b, c).inverse()
    }

    /// How far an offset reaches out of what the first axes span.
    fn height(&self, rank: usize, offset: DVec3) -> f64 {
        let [a, b, _] = self.vectors.map(|v| v.as_dvec3());
        match rank {
            0 => offset.length(),
            1 => offset.cross(a.normalize_or_zero()).length(),
            _ => offset.dot(a.cross(b).normalize_or_zero()).abs(),
        }
    }

    /// Makes up what is missing, at right angles to the axes there are.
    fn complete(&mut self, rank: usize) {
        if rank == 0 {
            self.vectors[0] = Vec3::X;
        }
        let a = self.vectors[0].as_dvec3();
        if rank < 2 {
            self.vectors[1] = (a.normalize_or_zero().any_orthogonal_vector() * a.length()).as_vec3();
        }
        if rank < 3 {
            let normal = a.cross(self.vectors[1].as_dvec3()).normalize_or_zero();
            self.vectors[2] = (normal * a.length()).as_vec3();
        }
    }
}

/// The nodes row by row, layer by layer, the longest way along the rows; parts one after the other.
pub(super) fn rows(positions: &[Vec3], links: &Links, split: bool) -> Result<Vec<u32>> {
    let walk = Walk::all(positions, links)?;
    walk.order(links, split)
}

struct Walk<'a> {
    positions: &'a [Vec3],
    links: &'a Links,
    cells: Vec<Cell>,
    axes: Vec<Axes>,
    /// Nodes that were reached, in that order; and those that are only near a whole multiple, to be walked from once
    /// nothing better is left.
    reached: Vec<u32>,
    doubtful: Vec<(u32, Cell, u32)>,
    /// How many axes the lattice of the part has.
    rank: usize,
    /// The nodes of a part.
    members: Vec<u32>,
    seen: Vec<bool>,
}

impl<'a> Walk<'a> {
    fn all(positions: &'a [Vec3], links: &'a Links) -> Result<Self> {
        let count = positions.len();
        let nowhere = Cell {
            part: NO_PART,
            at: [0; 3],
        };
        let mut walk = Self {
            positions,
            links,
            cells: memory::filled(nowhere, count)?,
            axes: memory::filled(Axes::default(), count)?,
            reached: memory::reserved(count)?,
            doubtful: Vec::new(),
            rank: 0,
            members: memory::reserved(count)?,
            seen: memory::filled(false, count)?,
        };
        let mut part = 0;
        for node in 0..count as u32 {
            if walk.cells[node as usize].part == NO_PART {
                walk.walk_part(node, part)?;
                part += 1;
            }
        }
        Ok(walk)
    }

    fn offset(&self, from: u32, to: u32) -> DVec3 {
        self.positions[to as usize].as_dvec3() - self.positions[from as usize].as_dvec3()
    }

    /// Gives a cell to each node of the part that `first` is in.
    fn walk_part(&mut self, first: u32, part: u32) -> Result<()> {
        self.gather_members(first);
        let start = self.start();
        let axes = self.axes_at(start);
        self.reached.clear();
        self.doubtful.clear();
        self.reach(start, Cell { part, at: [0; 3] }, axes);
        let (mut next, mut next_doubtful) = (0, 0);
        loop {
            if let Some(&node) = self.reached.get(next) {
                next += 1;
                self.step_from(node)?;
            } else if let Some(&(node, cell, from)) = self.doubtful.get(next_doubtful) {
                next_doubtful += 1;
                if self.cells[node as usize].part == NO_PART {
                    self.reach(node, cell, self.axes[from as usize]);
                }
            } else {
                return Ok(());
            }
        }
    }

    /// Finds the nodes that springs connect with `first`.
    fn gather_members(&mut self, first: u32) {
        self.members.clear();
        self.members.push(first);
        self.seen[first as usize] = true;
        let mut next = 0;
        while let Some(&node) = self.members.get(next) {
            next += 1;
            for &neighbour in self.links.of(node) {
                if !std::mem::replace(&mut self.seen[neighbour as usize], true) {
                    self.members.push(neighbour);
                }
            }
        }
    }

    /// Of some nodes of the part that whose springs look most like those inside a lattice: for each way there is one, there
    /// is one the opposite way.
    fn start(&self) -> u32 {
        let step = self.members.len().div_ceil(STARTS);
        let mut best = (self.members[0], 0);
        for &node in self.members.iter().step_by(step) {
            let opposites = self.opposites(node);
            if opposites > best.1 {
                best = (node, opposites);
            }
        }
        best.0
    }

    /// How many springs of a node have one the opposite way, less those that have none.
    fn opposites(&self, node: u32) -> isize {
        let neighbours = self.links.of(node);
        if neighbours.len() > MOST_LINKS {
            return 0;
        }
        let offsets = || neighbours.iter().map(|&n| self.offset(node, n));
        let has_opposite = |d: DVec3| offsets().any(|e| (d + e).length_squared() < NEAR * NEAR * d.length_squared());
        offsets().map(|d| if has_opposite(d) { 1 } else { -1 }).sum()
    }

    /// The shortest springs of a node that do not lie in one line or plane; what is missing is made up.
    fn axes_at(&mut self, node: u32) -> Axes {
        let mut offsets = [(0.0, DVec3::ZERO); MOST_LINKS];
        let neighbours = self.links.of(node);
        let count = neighbours.len().min(MOST_LINKS);
        for (offset, &neighbour) in offsets.iter_mut().zip(neighbours) {
            let d = self.offset(node, neighbour);
            *offset = (d.length(), d);
        }
        let offsets = &mut offsets[..count];
        offsets.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut ways = offsets.iter();
        let mut axes = Axes::default();
        self.rank = 0;
        while let Some((_, way)) = ways.find(|(length, way)| axes.height(self.rank, *way) > STEEP * length) {
            axes.vectors[self.rank] = way.as_vec3();
            self.rank += 1;
            if self.rank == 3 {
                break;
            }
        }
        axes.complete(self.rank);
        axes
    }

    fn reach(&mut self, node: u32, cell: Cell, axes: Axes) {
        self.cells[node as usize] = cell;
        self.axes[node as usize] = axes;
        self.reached.push(node);
    }

    /// Walks to the neighbours of a node that were not reached yet.
    fn step_from(&mut self, node: u32) -> Result<()> {
        let links = self.links;
        let cell = self.cells[node as usize];
        let inherited = self.axes[node as usize];
        let axes = self.fitted(node, inherited);
        let to_axes = axes.inverse();
        for &neighbour in links.of(node) {
            if self.cells[neighbour as usize].part != NO_PART {
                continue;
            }
            let (steps, near) = whole(to_axes * self.offset(node, neighbour));
            let mut at = cell.at;
            for axis in 0..3 {
                at[axis] = at[axis].saturating_add(steps[axis]);
            }
            let there = Cell { part: cell.part, at };
            if near {
                self.reach(neighbour, there, axes);
            } else {
                memory::push(&mut self.doubtful, (neighbour, there, node))?;
            }
        }
        self.axes[node as usize] = axes;
        Ok(())
    }

    /// The axes at a node: those where the walk came from, taken from the springs here where there are such.
    fn fitted(&self, node: u32, inherited: Axes) -> Axes {
        let to_axes = inherited.inverse();
        let mut sums = [DVec3::ZERO; 3];
        let mut counts = [0.0; 3];
        for &neighbour in self.links.of(node).iter().take(MOST_LINKS) {
            let offset = self.offset(node, neighbour);
            let (steps, near) = whole(to_axes * offset);
            let length: i32 = steps.iter().map(|step| step.abs()).sum();
            if let Some(axis) = steps.iter().position(|&step| step != 0)
                && near
                && length == 1
            {
                sums[axis] += offset * f64::from(steps[axis]);
                counts[axis] += 1.0;
            }
        }
        let mut fitted = inherited;
        for axis in 0..3 {
            if counts[axis] > 0.0 {
                fitted.vectors[axis] = (sums[axis] / counts[axis]).as_vec3();
            }
        }
        fitted.complete(self.rank);
        fitted
    }

    /// The nodes in the order of their cells.
    fn order(mut self, links: &Links, split: bool) -> Result<Vec<u32>> {
        let extents = self.extents();
        let mut axes = [0, 1, 2];
        axes.sort_by_key(|&axis| std::cmp::Reverse(extents[axis]));
        let [along, across, up] = axes;
        let mut keyed = memory::reserved(self.cells.len())?;
        keyed.extend((0..).zip(&self.cells).map(|(node, Cell { part, at }): (u32, _)| {
            let degree = if split { links.degree(node) as u32 } else { 0 };
            (*part, at[up], at[across], degree, at[along], node)
        }));
        keyed.sort_unstable();
        let mut order = std::mem::take(&mut self.reached);
        order.clear();
        order.extend(keyed.iter().map(|cell| cell.5));
        Ok(order)
    }

    /// How far the largest part reaches along each axis.
    fn extents(&self) -> [i64; 3] {
        let mut extents = [0; 3];
        let mut lows = [0_i64; 3];
        let mut highs = [0_i64; 3];
        for cell in &self.cells {
            for axis in 0..3 {
                lows[axis] = lows[axis].min(cell.at[axis].into());
                highs[axis] = highs[axis].max(cell.at[axis].into());
            }
        }
        for axis in 0..3 {
            extents[axis] = highs[axis] - lows[axis];
        }
        extents
    }
}

/// The whole multiple of the axes that an offset comes nearest to, and whether it is near.
fn whole(offset: DVec3) -> ([i32; 3], bool) {
    let rounded = offset.round().clamp(DVec3::splat(-REACH), DVec3::splat(REACH));
    let near = (offset - rounded).abs().max_element() < NEAR && rounded != DVec3::ZERO;
    // Axes in a plane have no inverse; what is not a number becomes 0.
    (rounded.to_array().map(|step| step as i32), near)
}
