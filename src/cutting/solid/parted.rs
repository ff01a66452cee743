//! How many pieces a cut has parted, found from the faces that have opened.

use std::collections::HashMap;

use super::body::{CutSolid, NONE};
use crate::base::{Result, memory};
use crate::cutting::changes::CutFace;
use crate::cutting::union::Union;

impl CutSolid {
    /// How many more pieces the material has after the last cut, which has opened `faces`.
    ///
    /// From both sides of the faces at once it goes on from tetrahedron to tetrahedron until all meet round the ends of the cut, or have been all
    /// over their piece but for one: the cost is that of the smaller pieces, or of the way round. None if that is more than `most` tetrahedra.
    pub fn parted(&self, faces: &[CutFace], most: usize) -> Result<Option<u32>> {
        let sides_of = |face: &CutFace| face.triangles.map(|triangle| self.triangles[triangle].tetrahedron);
        let mut floods = Floods::default();
        for side in faces.iter().flat_map(sides_of) {
            floods.start(side)?;
        }
        floods.met.reset(floods.open.len())?;
        let mut live = memory::reserved(floods.open.len())?;
        live.extend(0..floods.open.len());
        while live.len() > 1 {
            for &flood in &live {
                if floods.reached.len() > most {
                    return Ok(None);
                }
                let Some(tetrahedron) = floods.open[flood].pop() else {
                    continue;
                };
                for across in self.tetrahedra[tetrahedron].neighbours {
                    if across != NONE {
                        floods.reach(across, flood)?;
                    }
                }
            }
            // Those that have met another have nothing open either.
            live.retain(|&flood| !floods.open[flood].is_empty());
        }
        let after = floods.count();
        for [one, other] in faces.iter().map(sides_of) {
            floods.unite(floods.reached[&one], floods.reached[&other])?;
        }
        Ok(Some(after - floods.count()))
    }
}

impl CutSolid {
    /// Whether the last cut, which has opened `faces`, has parted a piece of less volume than `least` in the rest shape, m³.
    ///
    /// From both sides of the faces it goes on until all meet, or have been over as much, or all over their piece.
    pub(crate) fn has_parted_less(&self, faces: &[CutFace], least: f64) -> Result<bool> {
        let sides_of = |face: &CutFace| face.triangles.map(|triangle| self.triangles[triangle].tetrahedron);
        let mut floods = Floods::default();
        for side in faces.iter().flat_map(sides_of) {
            floods.start(side)?;
        }
        floods.met.reset(floods.open.len())?;
        let mut volumes = memory::filled(0.0, floods.open.len())?;
        let mut is_done = false;
        while !is_done {
            is_done = true;
            for flood in 0..floods.open.len() {
                if floods.sum(flood, &volumes) >= least {
                    continue;
                }
                if let Some(tetrahedron) = floods.open[flood].pop() {
                    is_done = false;
                    volumes[flood] += self.tetrahedra[tetrahedron].volume;
                    for across in self.tetrahedra[tetrahedron].neighbours {
                        if across != NONE {
                            floods.reach(across, flood)?;
                        }
                    }
                }
            }
        }
        for [one, other] in faces.iter().map(sides_of) {
            let [a, b] = [one, other].map(|side| floods.met.lowest(floods.reached[&side]));
            if a != b && floods.sum(a, &volumes).min(floods.sum(b, &volumes)) < least {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// Sets of tetrahedra that hang together, each growing.
#[derive(Default)]
struct Floods {
    /// The flood that has reached a tetrahedron first.
    reached: HashMap<u32, usize>,
    /// Those that a flood has reached, but not looked beyond; of floods that have met, the lowest has all.
    open: Vec<Vec<u32>>,
    met: Union,
}

impl Floods {
    /// Starts one from a tetrahedron, if none has yet.
    fn start(&mut self, tetrahedron: u32) -> Result<()> {
        if self.reached.contains_key(&tetrahedron) {
            return Ok(());
        }
        let mut open = memory::reserved(4)?;
        open.push(tetrahedron);
        self.reached.try_reserve(1)?;
        self.reached.insert(tetrahedron, self.open.len());
        memory::push(&mut self.open, open)
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

    fn reach(&mut self, tetrahedron: u32, flood: usize) -> Result<()> {
        if let Some(&other) = self.reached.get(&tetrahedron) {
            return self.unite(flood, other);
        }
        let flood = self.met.lowest(flood);
        self.reached.try_reserve(1)?;
        self.reached.insert(tetrahedron, flood);
        memory::push(&mut self.open[flood], tetrahedron)
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
