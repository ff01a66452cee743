//! For each pixel the nearest one that shows anything (Danielsson 1980, "Euclidean distance mapping").

use crate::base::{Result, memory};

const NONE: u32 = u32::MAX;

/// For each pixel of an image the nearest that is covered; itself where it is. Nothing where none is.
pub(super) fn nearest_covered(width: u32, height: u32, covered: impl Fn(usize) -> bool) -> Result<Vec<u32>> {
    let (columns, rows) = (width as usize, height as usize);
    let mut nearest = memory::filled(NONE, columns * rows)?;
    for (pixel, found) in nearest.iter_mut().enumerate() {
        if covered(pixel) {
            *found = pixel as u32;
        }
    }
    let offer = |nearest: &mut [u32], pixel: usize, neighbour: usize| {
        let squared_distance = |found: u32| {
            let along = |a: usize, b: usize| (a as i64 - b as i64).pow(2);
            let found = found as usize;
            along(found % columns, pixel % columns) + along(found / columns, pixel / columns)
        };
        let (known, offered) = (nearest[pixel], nearest[neighbour]);
        if offered != NONE && (known == NONE || squared_distance(offered) < squared_distance(known)) {
            nearest[pixel] = offered;
        }
    };
    let mut sweep = |rows: &mut dyn Iterator<Item = usize>, downwards: bool| {
        for row in rows {
            let start = row * columns;
            if downwards && row > 0 {
                (start..start + columns).for_each(|pixel| offer(&mut nearest, pixel, pixel - columns));
            } else if !downwards && row + 1 < height as usize {
                (start..start + columns).for_each(|pixel| offer(&mut nearest, pixel, pixel + columns));
            }
            (start + 1..start + columns).for_each(|pixel| offer(&mut nearest, pixel, pixel - 1));
            (start + 1..start + columns)
                .rev()
                .for_each(|pixel| offer(&mut nearest, pixel - 1, pixel));
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
        for (pixel, &answer) in found.iter().enumerate() {
            assert!(spots.contains(&(answer as usize)));
            let least = spots.iter().map(|&spot| distance(pixel, spot)).fold(f64::MAX, f64::min);
            assert!(distance(pixel, answer as usize) < least + 0.3, "{pixel}");
        }
        let none = nearest_covered(4, 4, |_| false).expect("memory");
        assert!(none.iter().all(|&pixel| pixel == NONE));
    }
}
