//! Rows of a lattice, found by walking along its springs.
//!
//! In a lattice, flat or solid, the springs of every node go the same few ways: whole multiples of its axes. A walk that
//! starts with the axes at one node gives each node it comes to whole coordinates. As it takes the axes at each node
//! from the springs there, the lattice may be turned, bent or stretched. Where a mesh is no lattice it still gives
//! coordinates; whether they make a good order is for its cost to tell. With too many springs that fit nowhere it gives up.

use std::cmp::Reverse;

use glam::{DVec3, Vec3};

use super::axes::{Axes, AxisSteps, NEAR, whole};
use super::links::Links;
use crate::Result;
use crate::base::memory;

/// Springs of a node that are looked at to find axes there. Lattices have up to 26, or twice that with second neighbours.
const MOST_LINKS: usize = 64;

/// Nodes of a part among which the one to start from is chosen.
const STARTS: usize = 64;

/// Springs that fit nowhere, for each node reached, with which a mesh is no lattice: measured, tetrahedra of organs that are
/// a lattice within have up to 1.2, those of a Delaunay mesh and random points 4.4 and more. A few may be anywhere.
const DOUBTFUL: usize = 2;
const A_FEW: usize = 256;

/// The nodes row by row, layer by layer, the longest way along the rows; connected parts one after the other, and what is
/// in one place of the lattice in its own order. `None` where the mesh is far from a lattice.
pub(super) fn along_rows(positions: &[Vec3], links: &Links) -> Result<Option<Vec<u32>>> {
    let Some(cells) = Walk::through(positions, links)? else {
        return Ok(None);
    };
    let mut axes = [0, 1, 2];
    let extents = axes.map(|axis| {
        let (low, high) = cells.iter().fold((0, 0), |(low, high), cell| {
            (cell.at[axis].min(low), cell.at[axis].max(high))
        });
        i64::from(high) - i64::from(low)
    });
    axes.sort_by_key(|&axis| Reverse(extents[axis]));
    let [along, across, up] = axes;

    let key = |(node, &LatticeCell { part, at }): (usize, _)| (part, at[up], at[across], at[along], node as u32);
    let mut keyed = memory::collected(cells.iter().enumerate().map(key))?;
    keyed.sort_unstable();
    memory::collected(keyed.iter().map(|&(.., node)| node)).map(Some)
}

/// The place of a node in the lattice of its part.
#[derive(Clone, Copy)]
struct LatticeCell {
    part: u32,
    at: [i32; 3],
}

impl LatticeCell {
    /// Of a node that was not reached yet.
    const UNKNOWN: Self = Self {
        part: u32::MAX,
        at: [0; 3],
    };

    fn is_known(&self) -> bool {
        self.part != Self::UNKNOWN.part
    }

    fn stepped(&self, steps: [i32; 3]) -> Self {
        let [x, y, z] = self.at;
        Self {
            part: self.part,
            at: [
                x.saturating_add(steps[0]),
                y.saturating_add(steps[1]),
                z.saturating_add(steps[2]),
            ],
        }
    }
}

struct Walk<'a> {
    positions: &'a [Vec3],
    links: &'a Links,
    cells: Vec<LatticeCell>,
    /// Of nodes with a cell: those it was found with, and from the node's own springs once the walk went on from there.
    axes: Vec<Axes>,
    /// How many axes the lattice of the part has.
    axis_count: usize,
    /// The nodes of the part; again in the order in which they were reached.
    members: Vec<u32>,
    reached: Vec<u32>,
    /// Springs near no whole multiple of the axes, in that order: taken only when nothing better is left.
    doubtful: Vec<[u32; 2]>,
    /// Whether a node is of a part that was begun.
    begun: Vec<bool>,
}

impl<'a> Walk<'a> {
    /// The cells of all nodes, unless the mesh is no lattice.
    fn through(positions: &'a [Vec3], links: &'a Links) -> Result<Option<Vec<LatticeCell>>> {
        let count = positions.len();
        let mut walk = Self {
            positions,
            links,
            cells: memory::filled(LatticeCell::UNKNOWN, count)?,
            axes: memory::filled(Axes::default(), count)?,
            axis_count: 0,
            members: memory::reserved(count)?,
            reached: memory::reserved(count)?,
            doubtful: Vec::new(),
            begun: memory::filled(false, count)?,
        };
        let mut part = 0;
        for node in 0..count as u32 {
            if !walk.begun[node as usize] {
                if !walk.part(part, node)? {
                    return Ok(None);
                }
                part += 1;
            }
        }
        Ok(Some(walk.cells))
    }

    fn offset(&self, from: u32, to: u32) -> DVec3 {
        self.positions[to as usize].as_dvec3() - self.positions[from as usize].as_dvec3()
    }

    /// Gives a cell to each node of the part that `node` is in: whether it may be a lattice.
    fn part(&mut self, part: u32, node: u32) -> Result<bool> {
        self.find_members(node);
        let start = self.start();
        let axes;
        (axes, self.axis_count) = self.axes_at(start);
        self.reached.clear();
        self.doubtful.clear();
        self.reach(start, LatticeCell { part, at: [0; 3] }, axes);
        let (mut next, mut next_doubtful) = (0, 0);
        loop {
            if let Some(&node) = self.reached.get(next) {
                next += 1;
                self.step_from(node)?;
                if self.doubtful.len() > DOUBTFUL * self.reached.len() + A_FEW {
                    return Ok(false);
                }
            } else if let Some(&[from, to]) = self.doubtful.get(next_doubtful) {
                next_doubtful += 1;
                self.step_anyway(from, to);
            } else {
                return Ok(true);
            }
        }
    }

    /// Finds the nodes that springs connect with `first`.
    fn find_members(&mut self, first: u32) {
        self.members.clear();
        self.members.push(first);
        self.begun[first as usize] = true;
        let mut next = 0;
        while let Some(&node) = self.members.get(next) {
            next += 1;
            for &neighbour in self.links.of(node) {
                if !std::mem::replace(&mut self.begun[neighbour as usize], true) {
                    self.members.push(neighbour);
                }
            }
        }
    }

    /// Of some nodes of the part, the one whose springs look most like those inside a lattice: each has one the opposite way.
    fn start(&self) -> u32 {
        let step = self.members.len().div_ceil(STARTS);
        let some = self.members.iter().step_by(step);
        let best = some.min_by_key(|&&node| Reverse(self.opposites(node)));
        best.map_or(self.members[0], |&node| node)
    }

    /// How many springs of a node have one the opposite way, less those that have none.
    fn opposites(&self, node: u32) -> isize {
        let neighbours = self.links.of(node);
        if neighbours.len() > MOST_LINKS {
            return 0;
        }
        let offsets = || neighbours.iter().map(|&neighbour| self.offset(node, neighbour));
        let has_opposite = |d: DVec3| offsets().any(|e| (d + e).length_squared() < NEAR * NEAR * d.length_squared());
        offsets().map(|d| if has_opposite(d) { 1 } else { -1 }).sum()
    }

    /// The shortest springs of a node that do not lie in one line or plane, and how many there are.
    fn axes_at(&self, node: u32) -> (Axes, usize) {
        let mut offsets = [DVec3::ZERO; MOST_LINKS];
        let neighbours = self.links.of(node);
        for (offset, &neighbour) in offsets.iter_mut().zip(neighbours) {
            *offset = self.offset(node, neighbour);
        }
        let offsets = &mut offsets[..neighbours.len().min(MOST_LINKS)];
        let key = |d: &DVec3| (d.length_squared(), d.x, d.y, d.z);
        offsets.sort_unstable_by(|d, e| key(d).partial_cmp(&key(e)).unwrap_or(std::cmp::Ordering::Equal));
        Axes::of(offsets.iter().copied())
    }

    fn reach(&mut self, node: u32, cell: LatticeCell, axes: Axes) {
        self.cells[node as usize] = cell;
        self.axes[node as usize] = axes;
        self.reached.push(node);
    }

    /// Walks to the neighbours of a node that were not reached yet, and on the way takes the axes from its springs.
    fn step_from(&mut self, node: u32) -> Result<()> {
        let links = self.links;
        let mut axes = self.axes[node as usize];
        let to_axes = axes.inverse();
        let mut single_steps = AxisSteps::default();
        let first = self.reached.len();
        for &neighbour in links.of(node) {
            let offset = self.offset(node, neighbour);
            let (steps, near) = whole(to_axes * offset);
            if near {
                single_steps.add(offset, steps);
            }
            if self.cells[neighbour as usize].is_known() {
                continue;
            }
            if near {
                self.cells[neighbour as usize] = self.cells[node as usize].stepped(steps);
                self.reached.push(neighbour);
            } else {
                memory::push(&mut self.doubtful, [node, neighbour])?;
            }
        }
        axes.fit(&single_steps, self.axis_count);
        self.axes[node as usize] = axes;
        for &neighbour in &self.reached[first..] {
            self.axes[neighbour as usize] = axes;
        }
        Ok(())
    }

    /// Walks along a doubtful spring, unless its end was reached another way.
    fn step_anyway(&mut self, from: u32, to: u32) {
        if !self.cells[to as usize].is_known() {
            let axes = self.axes[from as usize];
            let (steps, _) = whole(axes.inverse() * self.offset(from, to));
            self.reach(to, self.cells[from as usize].stepped(steps), axes);
        }
    }
}
