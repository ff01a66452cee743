//! Contacts begin a substep with the impulses of the one before, and a step with those that the last one ended with (warm starting, Catto 2005):
//! what rests on something is pressed as it was, and few sweeps correct that.
//!
//! Impulses that no longer fit could add energy. So a substep takes as much of them as lowers the dual energy most, which is a quadratic of that
//! share. It takes none where any would raise it, and kinetic energy never grows.

use glam::Vec3;

use super::link::{Key, Link};
use super::skin::Skin;
use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;

/// A substep takes so many times as much as the first of a step gave, at most: a step of VERLET begins with half a kick. Later ones take no more than
/// the one before: where contacts push against each other, impulses would grow without end.
const AFTER_FIRST: f32 = 2.0;

/// One of so many contacts that there is room for presses at most; what others gave is not recalled.
pub(super) const PRESSING: usize = 3;

/// A contact takes up what one with a face beside its own gave if the cosine between their normals is more.
const BESIDE: f32 = 0.99;

/// What a contact gave in the last substep, N s.
#[derive(Clone, Copy, Debug)]
struct WarmStart {
    key: Key,
    impulse: f32,
    friction: Vec3,
    /// From the second side to the first.
    normal: Vec3,
    /// Whether a contact of the substep in progress has begun with it.
    is_recalled: bool,
}

saved! { WarmStart { key, impulse, friction, normal, is_recalled } }

impl WarmStart {
    fn recall(&mut self, link: &mut Link) {
        self.is_recalled = true;
        link.recall(self.impulse, self.friction);
    }
}

/// The impulses of earlier substeps, in the order of their sides.
#[derive(Debug, Default)]
pub(crate) struct Pushes {
    /// Those of the last substep of the island whose turn it is.
    last: Vec<WarmStart>,
    /// Those that the last step ended with.
    settled: Vec<WarmStart>,
    /// Those that the step in progress ends with, of islands that have taken it.
    next: Vec<WarmStart>,
    /// How many substeps of its step that island has taken, and whether it goes on with what the last step gave.
    substeps: u32,
    recalls: bool,
}

saved! { Pushes { last, settled, next, substeps, recalls } }

impl Pushes {
    /// Makes room for those of so many contacts, of which few press at once.
    pub(super) fn reserve(&mut self, contacts: usize) -> Result<()> {
        let count = contacts / PRESSING;
        let mut all = [&mut self.last, &mut self.settled, &mut self.next].into_iter();
        all.try_for_each(|pushes| memory::reserve_in_steps(pushes, count))
    }

    /// A step begins, or is begun again.
    pub fn begin(&mut self) {
        self.next.clear();
    }

    /// The bodies at these places begin a step, with what the last one ended with if that is to be recalled.
    pub(super) fn begin_island(&mut self, members: &[u32], recalls: bool) {
        self.last.clear();
        (self.substeps, self.recalls) = (0, recalls);
        if recalls {
            let settled = settled(&self.settled, members);
            self.last.extend(settled);
        }
        self.last.iter_mut().for_each(|push| push.is_recalled = false);
        self.last.sort_unstable_by_key(|push| push.key);
    }

    /// Takes up what contacts of a substep have given, as far as there is room.
    pub(super) fn keep(&mut self, links: &[Link]) {
        self.substeps = self.substeps.saturating_add(1);
        self.last.clear();
        let room = self.last.capacity();
        let pressing = links.iter().filter(|link| link.presses()).take(room);
        self.last.extend(pressing.map(|link| {
            let (impulse, friction) = link.impulses();
            WarmStart {
                key: link.key(),
                impulse,
                friction,
                normal: link.normal,
                is_recalled: false,
            }
        }));
        self.last.sort_unstable_by_key(|push| push.key);
    }

    /// The island whose turn it is has ended its step.
    pub(super) fn end_island(&mut self) {
        let room = self.next.capacity() - self.next.len();
        self.next.extend(self.last.iter().take(room));
    }

    /// The step is taken.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.settled, &mut self.next);
        self.settled.sort_unstable_by_key(|push| push.key);
        self.next.clear();
    }

    /// How many times as much as the last substep this one takes at most.
    pub(super) fn most(&self) -> f32 {
        if self.recalls && self.substeps == 1 {
            AFTER_FIRST
        } else {
            1.0
        }
    }

    /// A body is gone.
    pub(super) fn leave(&mut self, place: usize) {
        self.settled.retain(|push| push.key.iter().all(|side| side.0 != place));
    }

    /// The sides of contacts of these bodies that pressed as the last step ended, and what they gave along their normals, N s.
    pub(super) fn settled<'a>(&'a self, members: &'a [u32]) -> impl Iterator<Item = (Key, f32)> + 'a {
        settled(&self.settled, members).map(|push| (push.key, push.impulse))
    }

    /// Has a new contact recall what it gave.
    pub(super) fn recall(&mut self, link: &mut Link) {
        let key = link.key();
        if let Ok(place) = self.last.binary_search_by_key(&key, |push| push.key) {
            self.last[place].recall(link);
        }
    }

    /// Has new contacts of corners that recalled nothing take up what no other has: which of faces that hold a corner alike meets it may change.
    pub(super) fn recall_beside(&mut self, links: &mut [Link]) {
        for link in links.iter_mut().filter(|link| !link.presses()) {
            let [(body, nodes), (other, others)] = link.key();
            if nodes[0] != nodes[2] {
                continue;
            }
            let first = self.last.partition_point(|push| push.key[0] < (body, nodes));
            let of_corner = self.last[first..].iter_mut();
            let mut of_corner = of_corner.take_while(|push| push.key[0] == (body, nodes));
            let beside = of_corner.find(|push| {
                let (pushed, corners) = push.key[1];
                let shares = pushed == other && corners.iter().any(|node| others.contains(node));
                shares && !push.is_recalled && push.normal.dot(link.normal) > BESIDE
            });
            if let Some(push) = beside {
                push.recall(link);
            }
        }
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for push in &self.settled {
            for (body, nodes) in push.key {
                hasher.write_u64(body as u64);
                nodes.into_iter().for_each(|node| hasher.write_u64(u64::from(node)));
            }
            hasher.write_floats(&[push.impulse]);
            hasher.write_vectors([push.friction, push.normal]);
        }
    }
}

/// What contacts gave whose first side is of one of these bodies, of what all did in order.
fn settled<'a>(all: &'a [WarmStart], members: &'a [u32]) -> impl Iterator<Item = &'a WarmStart> {
    members.iter().map(|&place| place as usize).flat_map(|place| {
        let first = all.partition_point(|push| push.key[0].0 < place);
        all[first..].iter().take_while(move |push| push.key[0].0 == place)
    })
}

/// Gives nodes what new contacts recall, or the best share of it up to `most`: the fastest that one makes its sides by that, m/s.
pub(super) fn give_again(links: &mut [Link], most: f32, skins: &mut [Option<Skin>]) -> f32 {
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
        (-slope / curvature).clamp(0.0, most)
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
