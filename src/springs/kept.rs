//! What is kept of a link: bodies without damping along springs do not pay for it.

use super::Link;
use crate::codec::{Saved, saved};
use crate::simd::EightLinks;

/// No node: a body has fewer.
pub(super) const NOBODY: u32 = u32::MAX;

/// A link as a storage keeps it.
pub(super) trait KeptLink: Saved + Copy + Send + Sync + std::fmt::Debug + 'static {
    /// Whether damping is kept.
    const DAMPED: bool;

    /// An empty place.
    const EMPTY: Self;

    fn of(link: &Link) -> Self;

    fn link(&self) -> Link;

    fn neighbour(&self) -> u32;

    /// Eight links for a kernel, where it takes them.
    fn eight(links: &[Self; 8]) -> Option<&EightLinks>;
}

/// A link of a body without damping along springs: the neighbour, and the bits of the stiffness and the rest length.
pub(super) type UndampedLink = [u32; 3];

/// A link of a body with damping along springs.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub(super) struct DampedLink {
    undamped: UndampedLink,
    damping: f32,
}

saved! { DampedLink { undamped, damping } }

impl KeptLink for UndampedLink {
    const DAMPED: bool = false;
    const EMPTY: Self = [NOBODY, 0, 0];

    #[inline(always)]
    fn of(link: &Link) -> Self {
        [link.neighbour, link.stiffness.to_bits(), link.rest_length.to_bits()]
    }

    #[inline(always)]
    fn link(&self) -> Link {
        let [neighbour, stiffness, rest_length] = *self;
        Link {
            neighbour,
            stiffness: f32::from_bits(stiffness),
            rest_length: f32::from_bits(rest_length),
            damping: 0.0,
        }
    }

    #[inline(always)]
    fn neighbour(&self) -> u32 {
        self[0]
    }

    #[inline(always)]
    fn eight(links: &[Self; 8]) -> Option<&EightLinks> {
        Some(links)
    }
}

impl KeptLink for DampedLink {
    const DAMPED: bool = true;
    const EMPTY: Self = Self {
        undamped: UndampedLink::EMPTY,
        damping: 0.0,
    };

    #[inline(always)]
    fn of(link: &Link) -> Self {
        Self {
            undamped: UndampedLink::of(link),
            damping: link.damping,
        }
    }

    #[inline(always)]
    fn link(&self) -> Link {
        Link {
            damping: self.damping,
            ..self.undamped.link()
        }
    }

    #[inline(always)]
    fn neighbour(&self) -> u32 {
        self.undamped.neighbour()
    }

    #[inline(always)]
    fn eight(_links: &[Self; 8]) -> Option<&EightLinks> {
        None
    }
}

/// The links in a row of places: they come first, behind them all places are empty.
#[inline]
pub(super) fn links<L: KeptLink>(row: &[L]) -> &[L] {
    let count = row.iter().position(|link| link.neighbour() == NOBODY);
    &row[..count.unwrap_or(row.len())]
}

/// The first empty place of a row.
pub(super) fn empty_place<L: KeptLink>(row: &[L]) -> Option<usize> {
    let count = links(row).len();
    (count < row.len()).then_some(count)
}

/// Where in a row the link to `neighbour` is.
pub(super) fn place_of<L: KeptLink>(row: &[L], neighbour: u32) -> Option<usize> {
    links(row).iter().position(|link| link.neighbour() == neighbour)
}

/// Empties a place with a link; the row's last link moves there.
pub(super) fn vacate<L: KeptLink>(row: &mut [L], place: usize) {
    let last = links(row).len() - 1;
    row[place] = row[last];
    row[last] = L::EMPTY;
}
