//! The difference of two similar byte strings.
//!
//! It is a list of parts. Each part has three numbers of 8 bytes: the offset of a copy in the old string, its length,
//! and the number of new bytes that follow the copy. Then come these bytes. Snapshots differ by changed numbers and by
//! insertions, so bytes are compared at the same offset from the start, and from the end.

use super::append;
use crate::base::{Error, Result, ensure};

/// The shortest copy that is worth a part.
const SHORTEST_COPY: usize = 48;

/// Appends to `out` the difference that turns `old` into `new`.
pub(super) fn difference(old: &[u8], new: &[u8], out: &mut Vec<u8>) -> Result<()> {
    let mut copy = (0, 0);
    let (mut at, mut literal) = (0, 0);
    while at < new.len() {
        // The same offset, from the start and from the end.
        let offsets = [Some(at), (at + old.len()).checked_sub(new.len())];
        let runs = offsets.into_iter().flatten().filter_map(|offset| {
            let run = common_prefix(old.get(offset..)?, &new[at..]);
            Some((run, offset))
        });
        let (run, offset) = runs.max_by_key(|&(run, _)| run).unwrap_or((0, 0));
        if run >= SHORTEST_COPY {
            write_part(out, copy, &new[literal..at])?;
            copy = (offset, run);
            at += run;
            literal = at;
        } else {
            // A different byte ends the run.
            at = (at + run + 1).min(new.len());
        }
    }
    write_part(out, copy, &new[literal..])
}

/// Applies a difference to the old string.
pub(super) fn apply(old: &[u8], difference: &[u8], size: usize) -> Result<Vec<u8>> {
    let damaged = || Error::invalid("the recording is damaged: a difference is none");
    let mut made = Vec::new();
    let mut rest = difference;
    while !rest.is_empty() {
        let (numbers, behind) = rest.split_at_checked(24).ok_or_else(damaged)?;
        let number = |index: usize| {
            let bytes = numbers[8 * index..].first_chunk().copied();
            bytes.and_then(|bytes| usize::try_from(u64::from_le_bytes(bytes)).ok())
        };
        let [Some(from), Some(length), Some(fresh)] = [0, 1, 2].map(number) else {
            return Err(damaged());
        };
        let end = from.checked_add(length).ok_or_else(damaged)?;
        let copied = old.get(from..end).ok_or_else(damaged)?;
        let (literal, behind) = behind.split_at_checked(fresh).ok_or_else(damaged)?;
        ensure!(copied.len() + literal.len() <= size - made.len(), damaged());
        made.try_reserve(copied.len() + literal.len())?;
        made.extend_from_slice(copied);
        made.extend_from_slice(literal);
        rest = behind;
    }
    if made.len() == size { Ok(made) } else { Err(damaged()) }
}

fn write_part(out: &mut Vec<u8>, (from, length): (usize, usize), literal: &[u8]) -> Result<()> {
    if length + literal.len() == 0 {
        return Ok(());
    }
    for number in [from, length, literal.len()] {
        append(out, &(number as u64).to_le_bytes())?;
    }
    append(out, literal)
}

/// The length of the common_prefix prefix.
fn common_prefix(a: &[u8], b: &[u8]) -> usize {
    const CHUNK: usize = 64;
    let chunks = a.chunks_exact(CHUNK).zip(b.chunks_exact(CHUNK));
    let whole = CHUNK * chunks.take_while(|(a, b)| a == b).count();
    let rest = a[whole..].iter().zip(&b[whole..]);
    whole + rest.take_while(|(a, b)| a == b).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn bytes(count: usize, seed: u64) -> Vec<u8> {
        let mut random = Random(seed);
        (0..count).map(|_| random.below(256) as u8).collect()
    }

    /// The length of the difference, after a check that it turns `old` into `new`.
    fn size(old: &[u8], new: &[u8]) -> usize {
        let mut out = Vec::new();
        difference(old, new, &mut out).expect("memory");
        assert_eq!(apply(old, &out, new.len()).as_deref(), Ok(new));
        out.len()
    }

    #[test]
    fn a_difference_makes_the_new_of_the_old_and_is_short() {
        let old = bytes(10_000, 1);
        assert_eq!(size(&old, &old), 24);
        assert_eq!(size(&[], &old), 24 + old.len());
        assert_eq!(size(&old, &[]), 0);
        let mut changed = old.clone();
        changed[3] ^= 1;
        changed[7000] ^= 1;
        changed[9999] ^= 1;
        assert!(size(&old, &changed) < 150);
        // An insertion, and a changed length before it.
        let mut longer = old.clone();
        longer[20] ^= 1;
        longer.splice(5000..5000, bytes(300, 2));
        assert!(size(&old, &longer) < 300 + 200);
        assert!(size(&longer, &old) < 200);
        assert_eq!(size(&old, &bytes(10_000, 3)), 24 + 10_000);
    }

    #[test]
    fn what_is_no_difference_is_refused() {
        let old = bytes(1000, 1);
        let mut good = Vec::new();
        difference(&old, &bytes(700, 2), &mut good).expect("memory");
        for length in 0..40 {
            assert!(apply(&old, &good[..length], 700).is_err(), "{length}");
        }
        assert!(apply(&old, &good, 699).is_err() && apply(&old, &good, 701).is_err());
        // The offset of an empty copy does not matter.
        for at in 8..24 {
            let mut bad = good.clone();
            bad[at] = bad[at].wrapping_add(200);
            assert!(apply(&old, &bad, 700).is_err(), "byte {at}");
        }
    }
}
