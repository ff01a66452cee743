//! Finds the contacts of bodies that take a substep together.

use super::DeformableContact;
use super::bonds::Bonds;
use super::entangled::Entangled;
use super::link::{ContactSide, Link};
use super::plan::FASTER;
use super::search::{Measure, PairSearch, Party, shift};
use super::skin::Skin;
use super::{join_movers, meet_each_other};
use crate::geometry::Bounds;
use crate::solver::{Span, System, Systems};

/// What keeps off a surface without thickness, as a part of its short edges: in `f32` something must.
pub(super) const LEAST_THICKNESS: f32 = 1e-3;

impl DeformableContact {
    /// Draws what of each surface is near others that it is found by in images, as the substep begins.
    pub(super) fn draw(&mut self, island: usize, bodies: &impl Systems, moment: &Span) {
        for member in 0..self.islands.members(island).len() {
            let a = self.islands.members(island)[member] as usize;
            // It is written to while others are read.
            let Some(mut first) = self.skins.get_mut(a).and_then(Option::take) else {
                continue;
            };
            if let Some(body) = bodies.at(a)
                && first.images.is_some()
                && moment.concerns(body)
            {
                let mut part = Bounds::EMPTY;
                for &b in self.islands.members(island) {
                    let b = b as usize;
                    if let (Some(Some(other)), Some(other_body)) = (self.skins.get(b), bodies.at(b))
                        && moment.concerns(other_body)
                        && meet_in_images(&first, other)
                    {
                        let parties = [(a, &first), (b, other)].map(|(place, skin)| Party { place, skin });
                        if let Some(radius) = radius(&parties[0], &parties[1], [body, other_body]) {
                            part = part.and(&near(&first, other, radius));
                        }
                    }
                }
                first.draw(&part);
            }
            self.skins[a] = Some(first);
        }
    }

    /// Whether what may meet where impulses have led nodes was found before they acted.
    pub(super) fn has_foreseen(&self, island: usize, bodies: &impl Systems, moment: &Span) -> bool {
        self.islands.searches(island).all(|pair| {
            let search = Self::search((&self.skins, &self.entangled), pair, bodies, moment);
            search.is_none_or(|search| search.has_foreseen())
        })
    }

    /// The search of one of the near pairs of bodies, or of one body, in a substep, if they meet then.
    fn search<'a>(
        (skins, entangled): (&'a [Option<Skin>], &Entangled),
        [a, b]: [usize; 2],
        bodies: &impl Systems,
        moment: &Span,
    ) -> Option<PairSearch<'a>> {
        let party = |place: usize| {
            let skin = skins.get(place)?.as_ref()?;
            Some(Party { place, skin })
        };
        let both = [bodies.at(a)?, bodies.at(b)?];
        let (mut first, mut second) = (party(a)?, party(b)?);
        let radius = radius(&first, &second, both)?;
        // Each edge of the first meets one edge of the second: of a long edge across short ones, that would be one of many.
        if second.skin.short < first.skin.short {
            std::mem::swap(&mut first, &mut second);
        }
        let is_looked_at = both.into_iter().all(|body| moment.concerns(body));
        let [own, others] = [first.skin, second.skin];
        (is_looked_at && !entangled.has([a, b])).then(|| PairSearch {
            parties: [first, second],
            dt: moment.duration,
            radius,
            ahead: own.ahead().min(others.ahead()),
            motion: own.spread + others.spread + (own.drift - others.drift).length() * moment.duration,
            in_images: a != b && meet_in_images(own, others),
            again: false,
            measures: Measure::Nothing,
            may_be_inside: a != b && (own.crossings > 0 || others.crossings > 0 || are_in_each_other(own, others)),
        })
    }

    /// The same of a pair that is not found in images.
    fn search_by_distance<'a>(
        skins: (&'a [Option<Skin>], &Entangled),
        pair: [usize; 2],
        bodies: &impl Systems,
        moment: &Span,
    ) -> Option<PairSearch<'a>> {
        Self::search(skins, pair, bodies, moment).filter(|search| !search.in_images)
    }

    /// Has what is near be known of the pairs of an island, or trees be where surfaces are.
    fn know_pairs(&mut self, island: usize, bodies: &impl Systems, moment: &Span, again: bool) {
        let Self {
            skins,
            entangled,
            pairs,
            islands,
            ..
        } = self;
        for (number, pair) in islands.searches(island).enumerate() {
            let search = Self::search_by_distance((skins, entangled), pair, bodies, moment);
            if search.is_none_or(|search| again && search.has_foreseen() || pairs.holds(number, &search)) {
                continue;
            }
            for place in pair {
                skins[place].iter_mut().for_each(Skin::fit);
            }
            let search = Self::search_by_distance((skins, entangled), pair, bodies, moment);
            if search.is_some_and(|search| pairs.renew(number, &search)) {
                continue;
            }
            for &place in islands.members(island) {
                if let Some(Some(skin)) = skins.get_mut(place as usize) {
                    skin.fit();
                }
            }
            let (skins, entangled) = (&*skins, &*entangled);
            let all = islands.searches(island);
            pairs.find(all.map(|pair| Self::search_by_distance((skins, entangled), pair, bodies, moment)));
            return;
        }
    }

    /// Adds the contacts that are not known yet, of those that meet; again in the same substep: where impulses have led further than was looked.
    pub(super) fn find(&mut self, island: usize, bodies: &impl Systems, moment: &Span, again: bool) {
        let measures = moment.begins && !again;
        self.know_pairs(island, bodies, moment, again);
        let Self {
            skins,
            clearances,
            entangled,
            links,
            known,
            pushes,
            pairs,
            bonds,
            islands,
            ..
        } = self;
        let key = Link::key;
        known.clear();
        known.extend(0..links.len() as u32);
        known.sort_unstable_by_key(|&link| key(&links[link as usize]));
        let first_new = links.len();
        // Without room for all, what only comes near gives way to what meets.
        let mut replaced = links.len()..links.capacity();
        for (number, [a, b]) in islands.searches(island).enumerate() {
            let Some(mut search) = Self::search((skins, entangled), [a, b], bodies, moment) else {
                continue;
            };
            if again && search.has_foreseen() {
                continue;
            }
            search.again = again;
            let [a, b] = search.parties.map(|party| party.place);
            let (Some(body_a), Some(body_b)) = (bodies.at(a), bodies.at(b)) else {
                continue;
            };
            let friction = body_a.contact.friction.max(body_b.contact.friction);
            let number = Some(number).filter(|_| !search.in_images);
            // A place is lent to neither where it is its own partner.
            let mut none = [None, None];
            let [kept_a, kept_b] = match clearances.get_disjoint_mut([a, b]) {
                Ok(both) => both,
                Err(_) => none.each_mut(),
            };
            if measures && [&*kept_a, &*kept_b].into_iter().flatten().any(|kept| kept.is_new) {
                search.measures = Measure::Reductions;
                let known = number.and_then(|number| pairs.of(number));
                search.run([&mut *kept_a, &mut *kept_b], known, |_| {});
            }
            search.measures = if measures { Measure::Distances } else { Measure::Nothing };
            let near = number.and_then(|number| pairs.of(number));
            search.run([kept_a, kept_b], near, |touch| {
                let sides = touch.sides.map(|side| side.key());
                let is_known = known
                    .binary_search_by_key(&sides, |&link| key(&links[link as usize]))
                    .is_ok();
                if is_known || are_joined(bonds, bodies, &touch.sides) {
                    return;
                }
                let of_sides = touch.sides.map(|side| if side.body == a { body_a } else { body_b });
                if let Some(mut link) = Link::new(touch.sides, touch.normal, of_sides) {
                    link.friction = friction;
                    (link.is_parted, link.is_ahead) = (touch.is_parted, touch.is_ahead);
                    link.allow_gap(touch.gap, moment.duration);
                    pushes.recall(&mut link);
                    if links.len() < links.capacity() {
                        links.push(link);
                    } else if !link.is_ahead
                        && let Some(place) = replaced.find(|&place| links[place].is_ahead)
                    {
                        links[place] = link;
                    }
                }
            });
        }
        pushes.recall_beside(&mut links[first_new..]);
        if measures {
            for &place in islands.members(island) {
                if let Some(Some(kept)) = clearances.get_mut(place as usize) {
                    let skin = skins.get(place as usize).and_then(Option::as_ref);
                    kept.settle(skin.map_or(&[], |skin| &skin.pierces));
                }
            }
        }
    }
}

/// Whether a bond makes one point of nodes of both sides.
fn are_joined(bonds: &Bonds, bodies: &impl Systems, sides: &[ContactSide; 2]) -> bool {
    let [a, b] = sides;
    !bonds.are_none() && join_movers(bonds, bodies, [a.body, b.body], [&a.nodes, &b.nodes])
}

/// How far two bodies, or one with itself, keep apart, m; `None` where they do not meet.
fn radius(first: &Party, second: &Party, bodies: [&System; 2]) -> Option<f32> {
    let [a, b] = bodies.map(|body| &body.contact);
    if first.place == second.place {
        return first.skin.radius_with_itself(a);
    }
    let shortest = first.skin.short.min(second.skin.short);
    let apart = (a.thickness + b.thickness).max(LEAST_THICKNESS * shortest);
    meet_each_other(bodies[0], bodies[1]).then_some(apart)
}

/// Whether two bodies that meet are found in images.
fn meet_in_images(first: &Skin, second: &Skin) -> bool {
    first.asks_for_images || second.asks_for_images
}

/// Whether one of two surfaces may be inside the other as a whole: else nothing of it is, without edges that pass through faces.
fn are_in_each_other(first: &Skin, second: &Skin) -> bool {
    let (a, b) = (
        first.forest.bounds(),
        second.forest.bounds().moved(second.origin - first.origin),
    );
    a.contains(&b) || b.contains(&a)
}

/// A box about what of a surface another may meet that it keeps `radius` away from.
fn near(skin: &Skin, other: &Skin, radius: f32) -> Bounds {
    let margin = radius + skin.short + FASTER * (skin.travel + other.travel);
    let shift = shift(other, skin);
    let (own, others) = (skin.forest.bounds(), other.forest.bounds());
    Bounds {
        min: (others.min + shift - margin).max(own.min),
        max: (others.max + shift + margin).min(own.max),
    }
}

#[cfg(test)]
mod tests {
    use super::super::link::Link;
    use super::super::pairs::tests::world;
    use crate::mesh::Mesh;
    use crate::{Solver, World};

    fn links(world: &mut World) -> &mut Vec<Link> {
        &mut world.tissue.as_mut().expect("it meets itself").links
    }

    #[test]
    fn what_only_comes_near_gives_way_to_what_meets() {
        let sheet = Mesh::cloth([0.1; 2], [8; 2]).expect("a cloth");
        let (mut world, _) = world(&sheet, Solver::Verlet, 0.002);
        let mut seen = 0;
        for _ in 0..40 {
            let before = world.save().expect("a snapshot");
            world.step(1e-3).expect("a step");
            let found = links(&mut world);
            let meeting = found.iter().filter(|link| !link.is_ahead).count();
            if meeting < found.len() && meeting > 4 {
                let mut other = World::load(&before, 1, None).expect("the snapshot");
                // Room for some of what meets.
                *links(&mut other) = Vec::with_capacity(meeting / 2);
                other.step(1e-3).expect("a step");
                let found = links(&mut other);
                assert_eq!(found.len(), found.capacity());
                assert!(found.iter().all(|link| !link.is_ahead));
                seen += 1;
            }
        }
        assert!(seen > 10, "{seen}");
    }
}
