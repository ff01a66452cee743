//! Intervals in which the ray of a pixel is inside a body.

use super::layers::RayCrossing;

/// An interval of a ray inside a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    /// Depths along the view, m.
    pub entry: f64,
    pub exit: f64,
    /// Triangles at entry and exit.
    pub triangles: [u32; 2],
}

impl Interval {
    /// Returns the distance of a depth to the nearer end of the interval, negative outside, and the triangle at that
    /// end.
    pub fn depth_of(&self, depth: f64) -> (f64, u32) {
        let (to_entry, to_exit) = (depth - self.entry, self.exit - depth);
        if to_entry <= to_exit {
            (to_entry, self.triangles[0])
        } else {
            (to_exit, self.triangles[1])
        }
    }
}

/// Iterates over the intervals of a ray inside a body, each extended by `thickness` at both ends. Intervals that then
/// touch are merged.
pub(super) struct Intervals<'a> {
    crossings: std::slice::Iter<'a, RayCrossing>,
    thickness: f64,
    next_interval: Option<Interval>,
}

impl<'a> Intervals<'a> {
    pub fn new(crossings: &'a [RayCrossing], thickness: f64) -> Self {
        let mut intervals = Self {
            crossings: crossings.iter(),
            thickness,
            next_interval: None,
        };
        intervals.next_interval = intervals.read();
        intervals
    }

    /// Returns the next interval with a positive winding number.
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
        let mut merged = self.next_interval.take()?;
        self.next_interval = self.read();
        while let Some(next) = self.next_interval.filter(|next| next.entry <= merged.exit) {
            merged.exit = next.exit;
            merged.triangles[1] = next.triangles[1];
            self.next_interval = self.read();
        }
        Some(merged)
    }
}
