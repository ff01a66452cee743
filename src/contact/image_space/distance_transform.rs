//! Distance transform of an image (Danielsson 1980, "Euclidean distance mapping").

use crate::base::{Result, memory};

const NONE: u32 = u32::MAX;

/// Returns for each pixel the nearest covered one; itself if it is covered, and `NONE` if no pixel is.
pub(super) fn nearest_covered(width: u32, height: u32, covered: impl Fn(usize) -> bool) -> Result<Vec<u32>> {
    let (columns, rows) = (width as usize, height as usize);
    let mut nearest = memory::filled(NONE, columns * rows)?;
    for (pixel, nearest_pixel) in nearest.iter_mut().enumerate() {
        if covered(pixel) {
            *nearest_pixel = pixel as u32;
        }
    }
    let propagate = |nearest: &mut [u32], pixel: usize, neighbor: usize| {
        let squared_distance = |candidate: u32| {
            let along = |a: usize, b: usize| (a as i64 - b as i64).pow(2);
            let candidate = candidate as usize;
            along(candidate % columns, pixel % columns) + along(candidate / columns, pixel / columns)
        };
        let (current, candidate) = (nearest[pixel], nearest[neighbor]);
        if candidate != NONE && (current == NONE || squared_distance(candidate) < squared_distance(current)) {
            nearest[pixel] = candidate;
        }
    };
    let mut sweep = |rows: &mut dyn Iterator<Item = usize>, downward: bool| {
        for row in rows {
            let start = row * columns;
            if downward && row > 0 {
                (start..start + columns).for_each(|pixel| propagate(&mut nearest, pixel, pixel - columns));
            } else if !downward && row + 1 < height as usize {
                (start..start + columns).for_each(|pixel| propagate(&mut nearest, pixel, pixel + columns));
            }
            (start + 1..start + columns).for_each(|pixel| propagate(&mut nearest, pixel, pixel - 1));
            (start + 1..start + columns)
                .rev()
                .for_each(|pixel| propagate(&mut nearest, pixel - 1, pixel));
        }
    };
    sweep(&mut (0..rows), true);
    sweep(&mut (0..rows).rev(), false);
    Ok(nearest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn nothing_covered_is_nearer_by_more_than_the_method_errs() {
        let mut random = Random(5);
        let (width, height) = (23, 17);
        let spots: Vec<usize> = (0..9).map(|_| random.below(width * height)).collect();
        let found = nearest_covered(width as u32, height as u32, |pixel| spots.contains(&pixel)).expect("memory");
        let distance = |a: usize, b: usize| {
            let along = |a: usize, b: usize| (a as f64 - b as f64).powi(2);
            (along(a % width, b % width) + along(a / width, b / width)).sqrt()
        };
        for (pixel, &nearest) in found.iter().enumerate() {
            assert!(spots.contains(&(nearest as usize)));
            let least = spots.iter().map(|&spot| distance(pixel, spot)).fold(f64::MAX, f64::min);
            assert!(distance(pixel, nearest as usize) < least + 0.3, "{pixel}");
        }
        let none = nearest_covered(4, 4, |_| false).expect("memory");
        assert!(none.iter().all(|&pixel| pixel == NONE));
    }
}
