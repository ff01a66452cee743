//! How many pieces a cut has parted, found from its rim.

use std::collections::HashMap;

use super::changes::RimEdge;
use super::surface::{CutSurface, NONE};
use super::union::Union;
use crate::base::{Result, memory};

impl CutSurface {
    /// How many more pieces what is drawn has after the last cut, of which `rim` is the new rim.
    ///
    /// From both sides of the rim at once it goes on from triangle to triangle until all meet round the ends of the cut, or have been all over
    /// their piece but for one: the cost is that of the smaller pieces, or of the way round. None if that is more than `most` triangles.
    pub fn parted(&self, rim: &[RimEdge], most: usize) -> Result<Option<u32>> {
        let mut floods = Floods::from(rim)?;
        let mut live = memory::reserved(floods.open.len())?;
        live.extend(0..floods.open.len());
        while live.len() > 1 {
            for &flood in &live {
                if floods.reached.len() > most {
                    return Ok(None);
                }
                let Some(triangle) = floods.open[flood].pop() else {
                    continue;
                };
                for across in self.triangles[triangle].neighbours {
                    if across != NONE {
                        floods.reach(across, flood)?;
                    }
                }
            }
            // Those that have met another have nothing open either.
            live.retain(|&flood| !floods.open[flood].is_empty());
        }
        let after = floods.count();
        for edge in rim {
            floods.unite(floods.reached[&edge.triangle], floods.reached[&edge.across])?;
        }
        Ok(Some(after - floods.count()))
    }

    /// Whether the last cut, of which `rim` is the new rim, has parted a piece of less area than `least` in the rest shape, m².
    ///
    /// From both sides of the rim it goes on until all meet, or have been over as much, or all over their piece.
    pub fn has_parted_less(&self, rim: &[RimEdge], least: f64) -> Result<bool> {
        let mut floods = Floods::from(rim)?;
        let mut areas = memory::filled(0.0, floods.open.len())?;
        let mut is_done = false;
        while !is_done {
            is_done = true;
            for flood in 0..floods.open.len() {
                if floods.sum(flood, &areas) >= least {
                    continue;
                }
                if let Some(triangle) = floods.open[flood].pop() {
                    is_done = false;
                    areas[flood] += self.rest_area(triangle);
                    for across in self.triangles[triangle].neighbours {
                        if across != NONE {
                            floods.reach(across, flood)?;
                        }
                    }
                }
            }
        }
        for edge in rim {
            let [a, b] = [edge.triangle, edge.across].map(|triangle| floods.of(triangle));
            if a != b && floods.sum(a, &areas).min(floods.sum(b, &areas)) < least {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// Sets of triangles that hang together, each growing.
#[derive(Default)]
struct Floods {
    /// The flood that has reached a triangle first.
    reached: HashMap<u32, usize>,
    /// Those that a flood has reached, but not looked beyond; of floods that have met, the lowest has all.
    open: Vec<Vec<u32>>,
    met: Union,
}

impl Floods {
    fn from(rim: &[RimEdge]) -> Result<Self> {
        let mut floods = Self::default();
        for edge in rim {
            if !floods.reached.contains_key(&edge.triangle) {
                let mut open = memory::reserved(4)?;
                open.push(edge.triangle);
                floods.reached.try_reserve(1)?;
                floods.reached.insert(edge.triangle, floods.open.len());
                memory::push(&mut floods.open, open)?;
            }
        }
        floods.met.reset(floods.open.len())?;
        Ok(floods)
    }

    fn count(&mut self) -> u32 {
        (0..self.open.len())
            .filter(|&flood| self.met.lowest(flood) == flood)
            .count() as u32
    }

    /// The lowest of the floods that have met with that which has reached a triangle.
    fn of(&mut self, triangle: u32) -> usize {
        self.met.lowest(self.reached[&triangle])
    }

    /// What all floods that have met with this one have.
    fn sum(&mut self, flood: usize, values: &[f64]) -> f64 {
        let lowest = self.met.lowest(flood);
        (0..values.len())
            .filter(|&other| self.met.lowest(other) == lowest)
            .map(|other| values[other])
            .sum()
    }

    fn reach(&mut self, triangle: u32, flood: usize) -> Result<()> {
        if let Some(&other) = self.reached.get(&triangle) {
            return self.unite(flood, other);
        }
        let flood = self.met.lowest(flood);
        self.reached.try_reserve(1)?;
        self.reached.insert(triangle, flood);
        memory::push(&mut self.open[flood], triangle)
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
