//! Counts the components that a cut has separated, searching from both sides of the cut.

use std::collections::HashMap;

use super::cell_complex::{CellComplex, NONE};
use super::changes::{CutFace, RimEdge};
use super::solid::CutSolid;
use super::surface::CutSurface;
use crate::base::DisjointSets;
use crate::base::{Result, memory};

impl CutSurface {
    /// The number of components that the last cut has added to the render mesh. `rim` contains its new cut-boundary
    /// edges.
    ///
    /// A flood fill from both sides stops when all floods have met around the ends of the cut, or when all but one have
    /// covered their component. The cost is therefore that of the smaller components, or of the path around the cut.
    /// `None` if it exceeds `max_simplices` triangles.
    pub fn parted(&self, rim: &[RimEdge], max_simplices: usize) -> Result<Option<u32>> {
        count_separated(
            self,
            Floods::about_rim(rim)?,
            rim.iter().map(sides_of_edge),
            max_simplices,
        )
    }

    /// True if the last cut has separated a component with less area than `min_size` in the rest shape, m². `rim`
    /// contains its new cut-boundary edges.
    ///
    /// Each flood fill stops when all have met, or when it has covered that area or its whole component.
    pub fn has_parted_less(&self, rim: &[RimEdge], min_size: f64) -> Result<bool> {
        let area = |triangle| self.rest_area(triangle);
        has_parted_less(
            self,
            Floods::about_rim(rim)?,
            rim.iter().map(sides_of_edge),
            min_size,
            area,
        )
    }
}

impl CutSolid {
    /// The number of components that the last cut, which has opened `faces`, has added to the material.
    ///
    /// A flood fill from both sides stops when all floods have met around the ends of the cut, or when all but one have
    /// covered their component. The cost is therefore that of the smaller components, or of the path around the cut.
    /// `None` if it exceeds `max_simplices` tetrahedra.
    pub fn parted(&self, faces: &[CutFace], max_simplices: usize) -> Result<Option<u32>> {
        let sides = faces.iter().map(|face| self.sides_of(face));
        count_separated(self, Floods::from(sides.clone().flatten())?, sides, max_simplices)
    }

    /// True if the last cut, which has opened `faces`, has separated a component with less volume than `min_size` in
    /// the rest shape, m³.
    ///
    /// Each flood fill stops when all have met, or when it has covered that volume or its whole component.
    pub(crate) fn has_parted_less(&self, faces: &[CutFace], min_size: f64) -> Result<bool> {
        let sides = faces.iter().map(|face| self.sides_of(face));
        let volume = |tetrahedron| self.tetrahedra[tetrahedron].volume;
        has_parted_less(self, Floods::from(sides.clone().flatten())?, sides, min_size, volume)
    }

    fn sides_of(&self, face: &CutFace) -> [u32; 2] {
        face.triangles.map(|triangle| self.triangles[triangle].tetrahedron)
    }
}

fn sides_of_edge(edge: &RimEdge) -> [u32; 2] {
    [edge.triangle, edge.across]
}

fn count_separated<const N: usize>(
    body: &impl CellComplex<N>,
    mut floods: Floods,
    sides: impl Iterator<Item = [u32; 2]>,
    max_simplices: usize,
) -> Result<Option<u32>> {
    let mut active = memory::collected(0..floods.frontier.len())?;
    while active.len() > 1 {
        for &flood in &active {
            if floods.reached.len() > max_simplices {
                return Ok(None);
            }
            floods.expand(flood, body)?;
        }
        // Floods that were merged into another have no open simplices either.
        active.retain(|&flood| !floods.frontier[flood].is_empty());
    }
    let after = floods.count();
    for [one, other] in sides {
        floods.unite(floods.reached[&one], floods.reached[&other])?;
    }
    Ok(Some(after - floods.count()))
}

fn has_parted_less<const N: usize>(
    body: &impl CellComplex<N>,
    mut floods: Floods,
    sides: impl Iterator<Item = [u32; 2]>,
    min_size: f64,
    size_of: impl Fn(u32) -> f64,
) -> Result<bool> {
    let mut sizes = memory::filled(0.0, floods.frontier.len())?;
    let mut is_done = false;
    while !is_done {
        is_done = true;
        for flood in 0..floods.frontier.len() {
            if floods.sum(flood, &sizes) >= min_size {
                continue;
            }
            if let Some(simplex) = floods.expand(flood, body)? {
                is_done = false;
                sizes[flood] += size_of(simplex);
            }
        }
    }
    for sides in sides {
        let [a, b] = sides.map(|side| floods.merged.lowest(floods.reached[&side]));
        if a != b && floods.sum(a, &sizes).min(floods.sum(b, &sizes)) < min_size {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Growing sets of connected simplices.
#[derive(Default)]
struct Floods {
    /// The flood that reached each simplex first.
    reached: HashMap<u32, usize>,
    /// For each flood, simplices whose neighbors have not been visited. Of merged floods, the lowest has all.
    frontier: Vec<Vec<u32>>,
    merged: DisjointSets,
}

impl Floods {
    fn about_rim(rim: &[RimEdge]) -> Result<Self> {
        Self::from(rim.iter().map(|edge| edge.triangle))
    }

    /// One flood from each of these simplices.
    fn from(starts: impl Iterator<Item = u32>) -> Result<Self> {
        let mut floods = Self::default();
        for start in starts {
            if !floods.reached.contains_key(&start) {
                let mut frontier = memory::reserved(4)?;
                frontier.push(start);
                floods.reached.try_reserve(1)?;
                floods.reached.insert(start, floods.frontier.len());
                memory::push(&mut floods.frontier, frontier)?;
            }
        }
        floods.merged.reset(floods.frontier.len())?;
        Ok(floods)
    }

    /// Visits the neighbors of one open simplex of a flood, and returns this simplex. `None` if there is none.
    fn expand<const N: usize>(&mut self, flood: usize, body: &impl CellComplex<N>) -> Result<Option<u32>> {
        let Some(simplex) = self.frontier[flood].pop() else {
            return Ok(None);
        };
        for across in body.simplex(simplex).neighbors {
            if across != NONE {
                self.visit(across, flood)?;
            }
        }
        Ok(Some(simplex))
    }

    fn count(&mut self) -> u32 {
        (0..self.frontier.len())
            .filter(|&flood| self.merged.lowest(flood) == flood)
            .count() as u32
    }

    /// The sum of the values of all floods merged with this one.
    fn sum(&mut self, flood: usize, values: &[f64]) -> f64 {
        let lowest = self.merged.lowest(flood);
        (0..values.len())
            .filter(|&other| self.merged.lowest(other) == lowest)
            .map(|other| values[other])
            .sum()
    }

    fn visit(&mut self, simplex: u32, flood: usize) -> Result<()> {
        if let Some(&other) = self.reached.get(&simplex) {
            return self.unite(flood, other);
        }
        let flood = self.merged.lowest(flood);
        self.reached.try_reserve(1)?;
        self.reached.insert(simplex, flood);
        memory::push(&mut self.frontier[flood], simplex)
    }

    fn unite(&mut self, a: usize, b: usize) -> Result<()> {
        let (a, b) = (self.merged.lowest(a), self.merged.lowest(b));
        if a != b {
            let mut more = std::mem::take(&mut self.frontier[a.max(b)]);
            let frontier = &mut self.frontier[a.min(b)];
            frontier.try_reserve(more.len())?;
            frontier.append(&mut more);
            self.merged.unite(a, b);
        }
        Ok(())
    }
}
