//! Contacts begin a substep with the impulses of the one before (warm starting, Catto 2005): what rests on something is pressed as it was, and few
//! sweeps correct that.
//!
//! Impulses that no longer fit could add energy. So a substep takes as much of them as lowers the dual energy most, which is a quadratic of that
//! share. It takes none where any would raise it, and kinetic energy never grows.

use glam::Vec3;

use super::link::{Key, Link};
use super::skin::Skin;
use crate::base::{Result, memory};
use crate::codec::saved;

/// What a contact gave in the last substep, N s.
#[derive(Clone, Copy, Debug)]
struct Push {
    key: Key,
    impulse: f32,
    friction: Vec3,
}

saved!(Push { key, impulse, friction });

/// The impulses of the last substep of the same step and island, in the order of their sides.
#[derive(Debug, Default)]
pub(super) struct Pushes(Vec<Push>);

saved!(Pushes { 0 });

impl Pushes {
    /// Makes room for so many.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        memory::reserve(&mut self.0, count)
    }

    /// A step or an island begins.
    pub fn forget(&mut self) {
        self.0.clear();
    }

    /// Takes up what contacts have given, as far as there is room.
    pub fn keep(&mut self, links: &[Link]) {
        self.0.clear();
        let room = self.0.capacity();
        let pressing = links.iter().filter(|link| link.presses()).take(room);
        self.0.extend(pressing.map(|link| {
            let (impulse, friction) = link.impulses();
            Push {
                key: link.key(),
                impulse,
                friction,
            }
        }));
        self.0.sort_unstable_by_key(|push| push.key);
    }

    /// Has a new contact recall what it gave.
    pub fn recall(&self, link: &mut Link) {
        let key = link.key();
        if let Ok(place) = self.0.binary_search_by_key(&key, |push| push.key) {
            link.recall(self.0[place].impulse, self.0[place].friction);
        }
    }
}

/// Gives nodes what new contacts recall, or the best share of it: the fastest that one makes its sides by that, m/s.
pub(super) fn give_again(links: &mut [Link], skins: &mut [Option<Skin>]) -> f32 {
    let pressing = |links: &[Link]| links.iter().any(Link::presses);
    if !pressing(links) {
        return 0.0;
    }
    let works = |links: &[Link], skins: &[Option<Skin>]| {
        let works = links.iter().filter(|link| link.presses()).map(|link| link.work(skins));
        works.fold([0.0; 2], |[all, allowed], [work, free]| [all + work, allowed + free])
    };
    let [before, allowed] = works(links, skins);
    links.iter().for_each(|link| link.give_share(1.0, skins));
    let [after, _] = works(links, skins);
    let (slope, curvature) = (before - allowed, after - before);
    let share = if curvature > 0.0 {
        (-slope / curvature).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let mut fastest = 0.0_f32;
    for link in links.iter_mut().filter(|link| link.presses()) {
        link.give_share(share - 1.0, skins);
        link.scale(share);
        fastest = fastest.max(link.speed());
    }
    fastest
}
