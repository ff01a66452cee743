//! Where bodies press each other, or themselves, for whoever wants to know.

use glam::Vec3;

use super::link::{ContactSide, Link};
use super::warm_start::PRESSING;
use crate::base::{Result, memory};
use crate::codec::saved;

/// A contact as the last step left it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TissueTouch {
    pub sides: [ContactSide; 2],
    /// From the second side to the first.
    pub normal: Vec3,
    /// On the first side, N.
    pub force: Vec3,
}

saved! { TissueTouch { sides, normal, force } }

/// The contacts that the last step ended with, and those of the step in progress.
#[derive(Debug, Default)]
pub(crate) struct Touches {
    settled: Vec<TissueTouch>,
    next: Vec<TissueTouch>,
}

saved! { Touches { settled, next } }

impl Touches {
    /// Makes room for those of so many contacts, of which few press at once.
    pub(super) fn reserve(&mut self, contacts: usize) -> Result<()> {
        let mut all = [&mut self.settled, &mut self.next].into_iter();
        all.try_for_each(|touches| memory::reserve_in_steps(touches, contacts / PRESSING))
    }

    /// A step begins, or is begun again.
    pub fn begin(&mut self) {
        self.next.clear();
    }

    /// The bodies at these places begin a step, or begin it again.
    pub(super) fn begin_island(&mut self, members: &[u32]) {
        self.next
            .retain(|touch| !members.contains(&(touch.sides[0].body as u32)));
    }

    /// Takes up what contacts gave within so long, those whose two sides are of such bodies, as far as there is room.
    pub(super) fn note(&mut self, links: &[Link], duration: f32, is_asked: impl Fn([usize; 2]) -> bool) {
        let room = self.next.capacity() - self.next.len();
        let pressing = links
            .iter()
            .filter(|link| link.presses() && is_asked(link.sides.map(|side| side.body)));
        self.next.extend(pressing.take(room).map(|link| TissueTouch {
            sides: link.sides,
            normal: link.normal,
            force: link.given() / duration,
        }));
    }

    /// The step is taken.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.settled, &mut self.next);
    }

    /// A body is gone.
    pub(super) fn leave(&mut self, place: usize) {
        self.settled
            .retain(|touch| touch.sides.iter().all(|side| side.body != place));
    }

    pub fn iter(&self) -> impl Iterator<Item = &TissueTouch> {
        self.settled.iter()
    }
}
