//! How many pieces a cut has parted, found from what it has parted.

use std::collections::HashMap;

use super::changes::{CutFace, RimEdge};
use super::divided::{Divided, NONE};
use super::solid::CutSolid;
use super::surface::CutSurface;
use crate::base::DisjointSets;
use crate::base::{Result, memory};

impl CutSurface {
    /// How many more pieces what is drawn has after the last cut, of which `rim` is the new rim.
    ///
    /// From both sides of the rim at once it goes on from triangle to triangle until all meet round the ends of the cut, or have been all over
    /// their piece but for one: the cost is that of the smaller pieces, or of the way round. None if that is more than `most` triangles.
    pub fn parted(&self, rim: &[RimEdge], most: usize) -> Result<Option<u32>> {
        parted(self, Floods::about_rim(rim)?, rim.iter().map(sides_of_edge), most)
    }

    /// Whether the last cut, of which `rim` is the new rim, has parted a piece of less area than `least` in the rest shape, m².
    ///
    /// From both sides of the rim it goes on until all meet, or have been over as much, or all over their piece.
    pub fn has_parted_less(&self, rim: &[RimEdge], least: f64) -> Result<bool> {
        let area = |triangle| self.rest_area(triangle);
        has_parted_less(
            self,
            Floods::about_rim(rim)?,
            rim.iter().map(sides_of_edge),
            least,
            area,
        )
    }
}

impl CutSolid {
    /// How many more pieces the material has after the last cut, which has opened `faces`.
    ///
    /// From both sides of the faces at once it goes on from tetrahedron to tetrahedron until all meet round the ends of the cut, or have been all
    /// over their piece but for one: the cost is that of the smaller pieces, or of the way round. None if that is more than `most` tetrahedra.
    pub fn parted(&self, faces: &[CutFace], most: usize) -> Result<Option<u32>> {
        let sides = faces.iter().map(|face| self.sides_of(face));
        parted(self, Floods::from(sides.clone().flatten())?, sides, most)
    }

    /// Whether the last cut, which has opened `faces`, has parted a piece of less volume than `least` in the rest shape, m³.
    ///
    /// From both sides of the faces it goes on until all meet, or have been over as much, or all over their piece.
    pub(crate) fn has_parted_less(&self, faces: &[CutFace], least: f64) -> Result<bool> {
        let sides = faces.iter().map(|face| self.sides_of(face));
        let volume = |tetrahedron| self.tetrahedra[tetrahedron].volume;
        has_parted_less(self, Floods::from(sides.clone().flatten())?, sides, least, volume)
    }

    fn sides_of(&self, face: &CutFace) -> [u32; 2] {
        face.triangles.map(|triangle| self.triangles[triangle].tetrahedron)
    }
}

fn sides_of_edge(edge: &RimEdge) -> [u32; 2] {
    [edge.triangle, edge.across]
}

fn parted<const N: usize>(
    body: &impl Divided<N>,
    mut floods: Floods,
    sides: impl Iterator<Item = [u32; 2]>,
    most: usize,
) -> Result<Option<u32>> {
    let mut live = memory::collected(0..floods.open.len())?;
    while live.len() > 1 {
        for &flood in &live {
            if floods.reached.len() > most {
                return Ok(None);
            }
            floods.go_on(flood, body)?;
        }
        // Those that have met another have nothing open either.
        live.retain(|&flood| !floods.open[flood].is_empty());
    }
    let after = floods.count();
    for [one, other] in sides {
        floods.unite(floods.reached[&one], floods.reached[&other])?;
    }
    Ok(Some(after - floods.count()))
}

fn has_parted_less<const N: usize>(
    body: &impl Divided<N>,
    mut floods: Floods,
    sides: impl Iterator<Item = [u32; 2]>,
    least: f64,
    material_of: impl Fn(u32) -> f64,
) -> Result<bool> {
    let mut material = memory::filled(0.0, floods.open.len())?;
    let mut is_done = false;
    while !is_done {
        is_done = true;
        for flood in 0..floods.open.len() {
            if floods.sum(flood, &material) >= least {
                continue;
            }
            if let Some(simplex) = floods.go_on(flood, body)? {
                is_done = false;
                material[flood] += material_of(simplex);
            }
        }
    }
    for sides in sides {
        let [a, b] = sides.map(|side| floods.met.lowest(floods.reached[&side]));
        if a != b && floods.sum(a, &material).min(floods.sum(b, &material)) < least {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Sets of simplices that hang together, each growing.
#[derive(Default)]
struct Floods {
    /// The flood that has reached a simplex first.
    reached: HashMap<u32, usize>,
    /// Those that a flood has reached, but not looked beyond; of floods that have met, the lowest has all.
    open: Vec<Vec<u32>>,
    met: DisjointSets,
}

impl Floods {
    fn about_rim(rim: &[RimEdge]) -> Result<Self> {
        Self::from(rim.iter().map(|edge| edge.triangle))
    }

    /// One from each of these simplices.
    fn from(starts: impl Iterator<Item = u32>) -> Result<Self> {
        let mut floods = Self::default();
        for start in starts {
            if !floods.reached.contains_key(&start) {
                let mut open = memory::reserved(4)?;
                open.push(start);
                floods.reached.try_reserve(1)?;
                floods.reached.insert(start, floods.open.len());
                memory::push(&mut floods.open, open)?;
            }
        }
        floods.met.reset(floods.open.len())?;
        Ok(floods)
    }

    /// Looks beyond a simplex that a flood has reached; `None`: there is none.
    fn go_on<const N: usize>(&mut self, flood: usize, body: &impl Divided<N>) -> Result<Option<u32>> {
        let Some(simplex) = self.open[flood].pop() else {
            return Ok(None);
        };
        for across in body.simplex(simplex).neighbours {
            if across != NONE {
                self.reach(across, flood)?;
            }
        }
        Ok(Some(simplex))
    }

    fn count(&mut self) -> u32 {
        (0..self.open.len())
            .filter(|&flood| self.met.lowest(flood) == flood)
            .count() as u32
    }

    /// What all floods that have met with this one have.
    fn sum(&mut self, flood: usize, values: &[f64]) -> f64 {
        let lowest = self.met.lowest(flood);
        (0..values.len())
            .filter(|&other| self.met.lowest(other) == lowest)
            .map(|other| values[other])
            .sum()
    }

    fn reach(&mut self, simplex: u32, flood: usize) -> Result<()> {
        if let Some(&other) = self.reached.get(&simplex) {
            return self.unite(flood, other);
        }
        let flood = self.met.lowest(flood);
        self.reached.try_reserve(1)?;
        self.reached.insert(simplex, flood);
        memory::push(&mut self.open[flood], simplex)
    }

    fn unite(&mut self, a: usize, b: usize) -> Result<()> {
        let (a, b) = (self.met.lowest(a), self.met.lowest(b));
        if a != b {
            let mut more = std::mem::take(&mut self.open[a.max(b)]);
            let open = &mut self.open[a.min(b)];
            open.try_reserve(more.len())?;
            open.append(&mut more);
            self.met.unite(a, b);
        }
        Ok(())
    }
}
