//! Link formats of the storages: bodies without spring damping store no damping.

use super::Link;
use crate::codec::{Saved, saved};
use crate::simd::LinkBatch;

/// Marks an empty slot: no body has a node with this index.
pub(super) const NO_NODE: u32 = u32::MAX;

/// The stored format of a link.
pub(super) trait StoredLink: Saved + Copy + Send + Sync + std::fmt::Debug + 'static {
    /// True if the format stores damping.
    const DAMPED: bool;

    /// The value of an empty slot.
    const EMPTY: Self;

    fn from_link(link: &Link) -> Self;

    fn link(&self) -> Link;

    fn neighbor(&self) -> u32;

    /// Eight links as a SIMD kernel takes them. `None` if the format does not support it.
    fn eight(links: &[Self; 8]) -> Option<&LinkBatch>;
}

/// A link of a body without spring damping: the neighbor, and the bits of the stiffness and rest length.
pub(super) type UndampedLink = [u32; 3];

/// A link of a body with spring damping.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub(super) struct DampedLink {
    undamped: UndampedLink,
    damping: f32,
}

saved! { DampedLink { undamped, damping } }

impl StoredLink for UndampedLink {
    const DAMPED: bool = false;
    const EMPTY: Self = [NO_NODE, 0, 0];

    #[inline(always)]
    fn from_link(link: &Link) -> Self {
        [link.neighbor, link.stiffness.to_bits(), link.rest_length.to_bits()]
    }

    #[inline(always)]
    fn link(&self) -> Link {
        let [neighbor, stiffness, rest_length] = *self;
        Link {
            neighbor,
            stiffness: f32::from_bits(stiffness),
            rest_length: f32::from_bits(rest_length),
            damping: 0.0,
        }
    }

    #[inline(always)]
    fn neighbor(&self) -> u32 {
        self[0]
    }

    #[inline(always)]
    fn eight(links: &[Self; 8]) -> Option<&LinkBatch> {
        Some(links)
    }
}

impl StoredLink for DampedLink {
    const DAMPED: bool = true;
    const EMPTY: Self = Self {
        undamped: UndampedLink::EMPTY,
        damping: 0.0,
    };

    #[inline(always)]
    fn from_link(link: &Link) -> Self {
        Self {
            undamped: UndampedLink::from_link(link),
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
    fn neighbor(&self) -> u32 {
        self.undamped.neighbor()
    }

    #[inline(always)]
    fn eight(_links: &[Self; 8]) -> Option<&LinkBatch> {
        None
    }
}

/// The links of a row of slots. Links come first; empty slots follow.
#[inline]
pub(super) fn links<L: StoredLink>(row: &[L]) -> &[L] {
    let count = row.iter().position(|link| link.neighbor() == NO_NODE);
    &row[..count.unwrap_or(row.len())]
}

/// The first empty slot of a row.
pub(super) fn empty_slot<L: StoredLink>(row: &[L]) -> Option<usize> {
    let count = links(row).len();
    (count < row.len()).then_some(count)
}

/// The slot of the link to `neighbor`.
pub(super) fn slot_of<L: StoredLink>(row: &[L], neighbor: u32) -> Option<usize> {
    links(row).iter().position(|link| link.neighbor() == neighbor)
}

/// Removes the link in a slot. The last link of the row moves there.
pub(super) fn remove_slot<L: StoredLink>(row: &mut [L], slot: usize) {
    let last = links(row).len() - 1;
    row[slot] = row[last];
    row[last] = L::EMPTY;
}
