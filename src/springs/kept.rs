//! What is kept of a link: bodies without damping along springs do not pay for it.

use super::Link;

/// No node: a body has fewer.
pub(super) const NOBODY: u32 = u32::MAX;

/// A link as a storage keeps it.
pub(super) trait KeptLink: Copy + Send + Sync + std::fmt::Debug + 'static {
    /// Whether damping is kept.
    const DAMPED: bool;

    fn of(link: &Link) -> Self;

    fn link(&self) -> Link;

    fn neighbour(&self) -> u32;
}

/// A link of a body without damping along springs.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub(super) struct UndampedLink {
    neighbour: u32,
    stiffness: f32,
    rest_length: f32,
}

/// A link of a body with damping along springs.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub(super) struct DampedLink {
    undamped: UndampedLink,
    damping: f32,
}

impl KeptLink for UndampedLink {
    const DAMPED: bool = false;

    #[inline(always)]
    fn of(link: &Link) -> Self {
        Self {
            neighbour: link.neighbour,
            stiffness: link.stiffness,
            rest_length: link.rest_length,
        }
    }

    #[inline(always)]
    fn link(&self) -> Link {
        Link {
            neighbour: self.neighbour,
            stiffness: self.stiffness,
            rest_length: self.rest_length,
            damping: 0.0,
        }
    }

    #[inline(always)]
    fn neighbour(&self) -> u32 {
        self.neighbour
    }
}

impl KeptLink for DampedLink {
    const DAMPED: bool = true;

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
        self.undamped.neighbour
    }
}
