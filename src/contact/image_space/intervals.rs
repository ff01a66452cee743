//! Where the ray of a pixel is inside a body.

use super::layers::RayCrossing;

/// A piece of a ray within a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    /// Depths along the view, m.
    pub entry: f64,
    pub exit: f64,
    /// The triangles there.
    pub triangles: [u32; 2],
}

impl Interval {
    /// How deep a depth lies in it, and the triangle through which the way out is shorter; below 0 outside.
    pub fn depth_of(&self, depth: f64) -> (f64, u32) {
        let (back, ahead) = (depth - self.entry, self.exit - depth);
        if back <= ahead {
            (back, self.triangles[0])
        } else {
            (ahead, self.triangles[1])
        }
    }
}

/// The pieces of a ray that lie within a body, each longer by `thickness` at both ends; pieces that then touch are one.
pub(super) struct Intervals<'a> {
    crossings: std::slice::Iter<'a, RayCrossing>,
    thickness: f64,
    ahead: Option<Interval>,
}

impl<'a> Intervals<'a> {
    pub fn new(crossings: &'a [RayCrossing], thickness: f64) -> Self {
        let mut intervals = Self {
            crossings: crossings.iter(),
            thickness,
            ahead: None,
        };
        intervals.ahead = intervals.read();
        intervals
    }

    /// The next piece in which the surface is wound around the ray.
    fn read(&mut self) -> Option<Interval> {
        let mut winding = 0;
        let mut entry: Option<&RayCrossing> = None;
        for crossing in self.crossings.by_ref() {
            winding += crossing.winding();
            match entry {
                None if winding > 0 => entry = Some(crossing),
                Some(first) if winding <= 0 => {
                    return Some(Interval {
                        entry: f64::from(first.depth) - self.thickness,
                        exit: f64::from(crossing.depth) + self.thickness,
                        triangles: [first.triangle(), crossing.triangle()],
                    });
                }
                _ => {}
            }
        }
        None
    }
}

impl Iterator for Intervals<'_> {
    type Item = Interval;

    fn next(&mut self) -> Option<Interval> {
        let mut whole = self.ahead.take()?;
        self.ahead = self.read();
        while let Some(next) = self.ahead.filter(|next| next.entry <= whole.exit) {
            whole.exit = next.exit;
            whole.triangles[1] = next.triangles[1];
            self.ahead = self.read();
        }
        Some(whole)
    }
}
