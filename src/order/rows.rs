//! Rows of a lattice, found by walking along its springs.
//!
//! In a lattice, flat or solid, the springs of every node are integer multiples of its axes. A walk starts with the
//! axes at one node and gives each reached node integer coordinates. The axes are refitted at each node, so the lattice
//! may be rotated, bent or stretched. Other meshes get coordinates too; the cost decides if they make a good order. The
//! walk gives up if too many springs fit no multiple.

use std::cmp::Reverse;

use glam::{DVec3, Vec3};

use super::axes::{Axes, AxisSteps, NEAR, nearest_multiple};
use super::links::Links;
use crate::Result;
use crate::base::memory;

/// The maximum number of springs that are examined to find the axes at a node. Lattices have up to 26, or twice that
/// with second neighbors.
const MAX_LINKS: usize = 64;

/// The number of nodes of a component among which the start is chosen.
const START_CANDIDATES: usize = 64;

/// The number of ill-fitting springs per reached node beyond which a mesh is no lattice. Measured: tetrahedra of organs
/// with a lattice inside have up to 1.2; Delaunay meshes and random points have 4.4 or more. A constant number is
/// allowed anywhere.
const DOUBTFUL_PER_NODE: usize = 2;
const DOUBTFUL_ALLOWED: usize = 256;

/// The nodes row by row and layer by layer, with rows along the longest axis. Components follow one another, and nodes
/// at the same coordinates keep their order. `None` if the mesh is far from a lattice.
pub(super) fn along_rows(positions: &[Vec3], links: &Links) -> Result<Option<Vec<u32>>> {
    let Some(cells) = Walk::through(positions, links)? else {
        return Ok(None);
    };
    let mut axes = [0, 1, 2];
    let extents = axes.map(|axis| {
        let (low, high) = cells.iter().fold((0, 0), |(low, high), cell| {
            (cell.coordinates[axis].min(low), cell.coordinates[axis].max(high))
        });
        i64::from(high) - i64::from(low)
    });
    axes.sort_by_key(|&axis| Reverse(extents[axis]));
    let [along, across, up] = axes;

    let key = |(node, &LatticeCell { component, coordinates }): (usize, _)| {
        (
            component,
            coordinates[up],
            coordinates[across],
            coordinates[along],
            node as u32,
        )
    };
    let mut keyed = memory::collected(cells.iter().enumerate().map(key))?;
    keyed.sort_unstable();
    memory::collected(keyed.iter().map(|&(.., node)| node)).map(Some)
}

/// The coordinates of a node in the lattice of its component.
#[derive(Clone, Copy)]
struct LatticeCell {
    component: u32,
    coordinates: [i32; 3],
}

impl LatticeCell {
    /// The value of a node that was not reached yet.
    const UNASSIGNED: Self = Self {
        component: u32::MAX,
        coordinates: [0; 3],
    };

    fn is_assigned(&self) -> bool {
        self.component != Self::UNASSIGNED.component
    }

    fn stepped(&self, steps: [i32; 3]) -> Self {
        let [x, y, z] = self.coordinates;
        Self {
            component: self.component,
            coordinates: [
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
    /// The axes at nodes with a cell: those of the node it was reached from, and refitted ones once the walk has left
    /// it.
    axes: Vec<Axes>,
    /// The number of axes of the component's lattice.
    axis_count: usize,
    /// The nodes of the component, and those in the order in which they were reached.
    members: Vec<u32>,
    reached: Vec<u32>,
    /// Springs that are near no integer multiple of the axes, in order of discovery. They are followed only if no other
    /// springs are left.
    doubtful: Vec<[u32; 2]>,
    /// True for nodes of a component whose walk has begun.
    visited: Vec<bool>,
}

impl<'a> Walk<'a> {
    /// Computes the cells of all nodes. `None`: the mesh is no lattice.
    fn through(positions: &'a [Vec3], links: &'a Links) -> Result<Option<Vec<LatticeCell>>> {
        let count = positions.len();
        let mut walk = Self {
            positions,
            links,
            cells: memory::filled(LatticeCell::UNASSIGNED, count)?,
            axes: memory::filled(Axes::default(), count)?,
            axis_count: 0,
            members: memory::reserved(count)?,
            reached: memory::reserved(count)?,
            doubtful: Vec::new(),
            visited: memory::filled(false, count)?,
        };
        let mut component = 0;
        for node in 0..count as u32 {
            if !walk.visited[node as usize] {
                if !walk.walk_component(component, node)? {
                    return Ok(None);
                }
                component += 1;
            }
        }
        Ok(Some(walk.cells))
    }

    fn offset(&self, from: u32, to: u32) -> DVec3 {
        self.positions[to as usize].as_dvec3() - self.positions[from as usize].as_dvec3()
    }

    /// Gives a cell to each node in the component of `node`. Returns true if it may be a lattice.
    fn walk_component(&mut self, component: u32, node: u32) -> Result<bool> {
        self.find_members(node);
        let start = self.choose_start();
        let axes;
        (axes, self.axis_count) = self.axes_at(start);
        self.reached.clear();
        self.doubtful.clear();
        self.reach(
            start,
            LatticeCell {
                component,
                coordinates: [0; 3],
            },
            axes,
        );
        let (mut next, mut next_doubtful) = (0, 0);
        loop {
            if let Some(&node) = self.reached.get(next) {
                next += 1;
                self.step_from(node)?;
                if self.doubtful.len() > DOUBTFUL_PER_NODE * self.reached.len() + DOUBTFUL_ALLOWED {
                    return Ok(false);
                }
            } else if let Some(&[from, to]) = self.doubtful.get(next_doubtful) {
                next_doubtful += 1;
                self.step_along_doubtful(from, to);
            } else {
                return Ok(true);
            }
        }
    }

    /// Finds the nodes that are connected to `first` by springs.
    fn find_members(&mut self, first: u32) {
        self.members.clear();
        self.members.push(first);
        self.visited[first as usize] = true;
        let mut next = 0;
        while let Some(&node) = self.members.get(next) {
            next += 1;
            for &neighbor in self.links.neighbors(node) {
                if !std::mem::replace(&mut self.visited[neighbor as usize], true) {
                    self.members.push(neighbor);
                }
            }
        }
    }

    /// The sampled node whose springs look most like those inside a lattice, where each has an opposite one.
    fn choose_start(&self) -> u32 {
        let step = self.members.len().div_ceil(START_CANDIDATES);
        let candidates = self.members.iter().step_by(step);
        let best = candidates.min_by_key(|&&node| Reverse(self.opposites(node)));
        best.map_or(self.members[0], |&node| node)
    }

    /// The number of springs of a node that have an opposite one, minus those that have none.
    fn opposites(&self, node: u32) -> isize {
        let neighbors = self.links.neighbors(node);
        if neighbors.len() > MAX_LINKS {
            return 0;
        }
        let offsets = || neighbors.iter().map(|&neighbor| self.offset(node, neighbor));
        let has_opposite = |d: DVec3| offsets().any(|e| (d + e).length_squared() < NEAR * NEAR * d.length_squared());
        offsets().map(|d| if has_opposite(d) { 1 } else { -1 }).sum()
    }

    /// The shortest linearly independent springs of a node, and their number.
    fn axes_at(&self, node: u32) -> (Axes, usize) {
        let mut offsets = [DVec3::ZERO; MAX_LINKS];
        let neighbors = self.links.neighbors(node);
        for (offset, &neighbor) in offsets.iter_mut().zip(neighbors) {
            *offset = self.offset(node, neighbor);
        }
        let offsets = &mut offsets[..neighbors.len().min(MAX_LINKS)];
        let key = |d: &DVec3| (d.length_squared(), d.x, d.y, d.z);
        offsets.sort_unstable_by(|d, e| key(d).partial_cmp(&key(e)).unwrap_or(std::cmp::Ordering::Equal));
        Axes::from_offsets(offsets.iter().copied())
    }

    fn reach(&mut self, node: u32, cell: LatticeCell, axes: Axes) {
        self.cells[node as usize] = cell;
        self.axes[node as usize] = axes;
        self.reached.push(node);
    }

    /// Walks to the unreached neighbors of a node and refits the axes to its springs.
    fn step_from(&mut self, node: u32) -> Result<()> {
        let links = self.links;
        let mut axes = self.axes[node as usize];
        let to_axes = axes.inverse();
        let mut single_steps = AxisSteps::default();
        let first = self.reached.len();
        for &neighbor in links.neighbors(node) {
            let offset = self.offset(node, neighbor);
            let (steps, near) = nearest_multiple(to_axes * offset);
            if near {
                single_steps.add(offset, steps);
            }
            if self.cells[neighbor as usize].is_assigned() {
                continue;
            }
            if near {
                self.cells[neighbor as usize] = self.cells[node as usize].stepped(steps);
                self.reached.push(neighbor);
            } else {
                memory::push(&mut self.doubtful, [node, neighbor])?;
            }
        }
        axes.fit(&single_steps, self.axis_count);
        self.axes[node as usize] = axes;
        for &neighbor in &self.reached[first..] {
            self.axes[neighbor as usize] = axes;
        }
        Ok(())
    }

    /// Walks along an ill-fitting spring, unless its end was reached otherwise.
    fn step_along_doubtful(&mut self, from: u32, to: u32) {
        if !self.cells[to as usize].is_assigned() {
            let axes = self.axes[from as usize];
            let (steps, _) = nearest_multiple(axes.inverse() * self.offset(from, to));
            self.reach(to, self.cells[from as usize].stepped(steps), axes);
        }
    }
}
