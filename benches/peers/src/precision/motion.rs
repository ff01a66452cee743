//! Positions of nodes at the end of each frame, and differences of two motions.

use crate::precision::model::{FRAME, Model};

/// Positions of the nodes at the start and at the end of each frame.
#[derive(Clone)]
pub struct Motion {
    start: Vec<[f64; 3]>,
    pub frames: Vec<Vec<[f64; 3]>>,
}

impl Motion {
    pub fn new(start: Vec<[f64; 3]>, frames: Vec<Vec<[f64; 3]>>) -> Self {
        Self { start, frames }
    }

    /// Builds a motion from the coordinates of all frames in order; an incomplete last frame is dropped.
    pub fn from_numbers(numbers: &[f64], model: &Model) -> Self {
        let (nodes, _) = numbers.as_chunks::<3>();
        let frames = nodes.chunks_exact(model.positions.len()).map(<[_]>::to_vec);
        Self::new(model.positions.clone(), frames.collect())
    }

    /// The last frame only.
    pub fn end(&self) -> Self {
        let last = self.frames.last().cloned();
        Self::new(self.start.clone(), last.into_iter().collect())
    }

    /// RMS speed of nodes over the last ten frames [m/s].
    pub fn speed_at_end(&self) -> f64 {
        let last = &self.frames[self.frames.len().saturating_sub(11)..];
        rms(last.iter().skip(1).zip(last)) / FRAME
    }

    /// The mean height of the nodes at the last frame [m].
    pub fn height(&self) -> f64 {
        let last = self.frames.last().map_or(&self.start, |frame| frame);
        last.iter().map(|position| position[1]).sum::<f64>() / last.len() as f64
    }

    /// True if every coordinate is finite.
    pub fn is_finite(&self) -> bool {
        self.frames.iter().flatten().flatten().all(|number| number.is_finite())
    }

    /// RMS distance of the nodes from their start, over all frames.
    pub fn displacement(&self) -> f64 {
        let start = std::iter::repeat(&self.start);
        rms(self.frames.iter().zip(start))
    }
}

/// RMS distance of nodes over all frames, relative to the RMS displacement of `reference`.
pub fn relative_difference(motion: &Motion, reference: &Motion) -> f64 {
    rms(motion.frames.iter().zip(&reference.frames)) / reference.displacement()
}

fn rms<'a>(pairs: impl Iterator<Item = (&'a Vec<[f64; 3]>, &'a Vec<[f64; 3]>)>) -> f64 {
    let (mut sum, mut count) = (0.0, 0_u64);
    for (a, b) in pairs {
        for (a, b) in a.iter().zip(b) {
            sum += (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>();
            count += 1;
        }
    }
    (sum / count as f64).sqrt()
}
