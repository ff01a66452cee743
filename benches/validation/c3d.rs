//! A reader of C3D motion capture files: points only, as 32-bit floats in this machine's byte order.

use std::path::Path;

use glam::DVec3;

/// Frames of points [m].
pub struct Capture {
    /// Frame rate [Hz].
    pub rate: f64,
    pub frames: Vec<Vec<DVec3>>,
}

impl Capture {
    /// Reads a file, or returns the reason that it cannot be read.
    pub fn read(path: &Path) -> Result<Self, String> {
        const BLOCK: usize = 512;
        let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
        let short = |word: usize| {
            bytes
                .get(2 * word..2 * word + 2)
                .map(|pair| usize::from(u16::from_le_bytes([pair[0], pair[1]])))
        };
        let float = |at: usize| {
            bytes
                .get(at..at + 4)
                .map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]]))
        };
        let header = (|| {
            Some((
                short(1)?,
                short(2)?,
                [short(3)?, short(4)?],
                float(12)?,
                short(8)?,
                float(20)?,
            ))
        })();
        let (points, analog, [first, last], scale, start, rate) = header.ok_or("too short for a header")?;
        if bytes.get(1) != Some(&0x50) || scale >= 0.0 || start == 0 || last < first {
            return Err("not a C3D file of floats".into());
        }
        let frame_bytes = 4 * (4 * points + analog);
        let point = |frame: usize, index: usize| {
            let at = (start - 1) * BLOCK + frame * frame_bytes + 16 * index;
            let [x, y, z] = [0, 4, 8].map(|offset| float(at + offset).map(f64::from));
            Some(DVec3::new(x?, y?, z?))
        };
        let frames: Option<Vec<Vec<DVec3>>> = (0..=last - first)
            .map(|frame| (0..points).map(|index| point(frame, index)).collect())
            .collect();
        Ok(Self {
            rate: f64::from(rate),
            frames: frames.ok_or("cut short")?,
        })
    }
}
