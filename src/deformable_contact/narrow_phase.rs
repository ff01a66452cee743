//! Contact search between bodies that take a substep together.

use super::DeformableContact;
use super::attachments::PointAttachments;
use super::collision_surface::CollisionSurface;
use super::interpenetrating_pairs::InterpenetratingPairs;
use super::pair_contact::{ContactSide, PairContact};
use super::plan::SPEED_MARGIN;
use super::search::{ClearanceUpdate, PairSearch, SearchSide, shift};
use super::{can_collide, share_attachment};
use crate::geometry::Aabb;
use crate::solver::{SubstepSpan, System, Systems};

/// Contact distance of a surface without thickness, as a fraction of its short edges. It exceeds rounding in `f32`.
pub(super) const MIN_THICKNESS: f32 = 1e-3;

impl DeformableContact {
    /// Draws the part of each surface that is near others that use its images, at the start of a substep.
    pub(super) fn draw_images(&mut self, island: usize, bodies: &impl Systems, span: &SubstepSpan) {
        for member in 0..self.islands.members(island).len() {
            let a = self.islands.members(island)[member] as usize;
            // Moved out, because it is written while others are read.
            let Some(mut first) = self.surfaces.get_mut(a).and_then(Option::take) else {
                continue;
            };
            if let Some(body) = bodies.at(a)
                && first.images.is_some()
                && span.concerns(body)
            {
                let mut drawn_bounds = Aabb::EMPTY;
                for &b in self.islands.members(island) {
                    let b = b as usize;
                    if let (Some(Some(other)), Some(other_body)) = (self.surfaces.get(b), bodies.at(b))
                        && span.concerns(other_body)
                        && find_in_images(&first, other)
                    {
                        let search_sides =
                            [(a, &first), (b, other)].map(|(body_index, surface)| SearchSide { body_index, surface });
                        if let Some(radius) = contact_distance(&search_sides[0], &search_sides[1], [body, other_body]) {
                            drawn_bounds = drawn_bounds.and(&overlap_bounds(&first, other, radius));
                        }
                    }
                }
                first.draw_images(&drawn_bounds);
            }
            self.surfaces[a] = Some(first);
        }
    }

    /// True if the first search of the substep found all that impulses may make touch.
    pub(super) fn is_search_complete(&self, island: usize, bodies: &impl Systems, span: &SubstepSpan) -> bool {
        self.islands.searches(island).all(|pair| {
            let search = Self::pair_search((&self.surfaces, &self.interpenetrating_pairs), pair, bodies, span);
            search.is_none_or(|search| search.is_search_complete())
        })
    }

    /// Returns the search of a near pair of bodies, or of a body with itself, if they collide.
    fn pair_search<'a>(
        (surfaces, interpenetrating_pairs): (&'a [Option<CollisionSurface>], &InterpenetratingPairs),
        [a, b]: [usize; 2],
        bodies: &impl Systems,
        span: &SubstepSpan,
    ) -> Option<PairSearch<'a>> {
        let side = |body_index: usize| {
            let surface = surfaces.get(body_index)?.as_ref()?;
            Some(SearchSide { body_index, surface })
        };
        let bodies_of_pair = [bodies.at(a)?, bodies.at(b)?];
        let (mut first, mut second) = (side(a)?, side(b)?);
        let radius = contact_distance(&first, &second, bodies_of_pair)?;
        // The side with shorter edges comes first, because each of its edges touches few edges of the second.
        if second.surface.short_edge < first.surface.short_edge {
            std::mem::swap(&mut first, &mut second);
        }
        let both_take_part = bodies_of_pair.into_iter().all(|body| span.concerns(body));
        let [first_surface, second_surface] = [first.surface, second.surface];
        (both_take_part && !interpenetrating_pairs.contains([a, b])).then(|| PairSearch {
            search_sides: [first, second],
            dt: span.duration,
            radius,
            speculative_margin: first_surface
                .speculative_margin()
                .min(second_surface.speculative_margin()),
            motion: first_surface.displacement_spread
                + second_surface.displacement_spread
                + (first_surface.center_velocity - second_surface.center_velocity).length() * span.duration,
            uses_images: a != b && find_in_images(first_surface, second_surface),
            is_repeated: false,
            clearance_update: ClearanceUpdate::Nothing,
            may_be_inside: a != b
                && (first_surface.crossings > 0
                    || second_surface.crossings > 0
                    || may_contain_each_other(first_surface, second_surface)),
        })
    }

    /// Returns the same search if it does not use images.
    fn tree_search<'a>(
        surfaces: (&'a [Option<CollisionSurface>], &InterpenetratingPairs),
        pair: [usize; 2],
        bodies: &impl Systems,
        span: &SubstepSpan,
    ) -> Option<PairSearch<'a>> {
        Self::pair_search(surfaces, pair, bodies, span).filter(|search| !search.uses_images)
    }

    /// Updates the candidates of an island, or refits the trees if candidates do not fit into memory.
    fn update_candidates(&mut self, island: usize, bodies: &impl Systems, span: &SubstepSpan, is_repeated: bool) {
        let Self {
            surfaces,
            interpenetrating_pairs,
            candidate_pairs,
            islands,
            ..
        } = self;
        for (pair_index, pair) in islands.searches(island).enumerate() {
            let search = Self::tree_search((surfaces, interpenetrating_pairs), pair, bodies, span);
            if search.is_none_or(|search| {
                is_repeated && search.is_search_complete() || candidate_pairs.covers(pair_index, &search)
            }) {
                continue;
            }
            for body_index in pair {
                surfaces[body_index].iter_mut().for_each(CollisionSurface::refit_trees);
            }
            let search = Self::tree_search((surfaces, interpenetrating_pairs), pair, bodies, span);
            if search.is_some_and(|search| candidate_pairs.relist(pair_index, &search)) {
                continue;
            }
            for &body_index in islands.members(island) {
                if let Some(Some(surface)) = surfaces.get_mut(body_index as usize) {
                    surface.refit_trees();
                }
            }
            let (surfaces, interpenetrating_pairs) = (&*surfaces, &*interpenetrating_pairs);
            let all_pairs = islands.searches(island);
            candidate_pairs.list_all(
                all_pairs.map(|pair| Self::tree_search((surfaces, interpenetrating_pairs), pair, bodies, span)),
            );
            return;
        }
    }

    /// Finds contacts and adds those that are not listed yet. `is_repeated` marks further searches in a substep.
    pub(super) fn find_contacts(
        &mut self,
        island: usize,
        bodies: &impl Systems,
        span: &SubstepSpan,
        is_repeated: bool,
    ) {
        let updates_clearances = span.begins && !is_repeated;
        self.update_candidates(island, bodies, span, is_repeated);
        let Self {
            surfaces,
            clearances,
            interpenetrating_pairs,
            pair_contacts,
            contact_order,
            warm_start,
            candidate_pairs,
            attachments,
            islands,
            ..
        } = self;
        let key = PairContact::key;
        contact_order.clear();
        contact_order.extend(0..pair_contacts.len() as u32);
        contact_order.sort_unstable_by_key(|&contact| key(&pair_contacts[contact as usize]));
        let first_new = pair_contacts.len();
        // Without capacity, contacts that touch replace speculative ones.
        let mut replaceable = pair_contacts.len()..pair_contacts.capacity();
        for (pair_index, [a, b]) in islands.searches(island).enumerate() {
            let Some(mut search) = Self::pair_search((surfaces, interpenetrating_pairs), [a, b], bodies, span) else {
                continue;
            };
            if is_repeated && search.is_search_complete() {
                continue;
            }
            search.is_repeated = is_repeated;
            let [a, b] = search.search_sides.map(|search_side| search_side.body_index);
            let (Some(body_a), Some(body_b)) = (bodies.at(a), bodies.at(b)) else {
                continue;
            };
            let friction = body_a.contact.friction.max(body_b.contact.friction);
            let pair_index = Some(pair_index).filter(|_| !search.uses_images);
            // Self-contact has no clearances.
            let mut no_clearances = [None, None];
            let [clearances_a, clearances_b] = match clearances.get_disjoint_mut([a, b]) {
                Ok(both) => both,
                Err(_) => no_clearances.each_mut(),
            };
            if updates_clearances
                && [&*clearances_a, &*clearances_b]
                    .into_iter()
                    .flatten()
                    .any(|clearances_of_body| clearances_of_body.is_new)
            {
                search.clearance_update = ClearanceUpdate::Reductions;
                let candidates = pair_index.and_then(|pair_index| candidate_pairs.view(pair_index));
                search.run([&mut *clearances_a, &mut *clearances_b], candidates, |_| {});
            }
            search.clearance_update = if updates_clearances {
                ClearanceUpdate::Distances
            } else {
                ClearanceUpdate::Nothing
            };
            let candidates = pair_index.and_then(|pair_index| candidate_pairs.view(pair_index));
            search.run([clearances_a, clearances_b], candidates, |found| {
                let sides = found.sides.map(|side| side.key());
                let is_in_list = contact_order
                    .binary_search_by_key(&sides, |&contact| key(&pair_contacts[contact as usize]))
                    .is_ok();
                if is_in_list || are_joined(attachments, bodies, &found.sides) {
                    return;
                }
                let side_bodies = found.sides.map(|side| if side.body == a { body_a } else { body_b });
                if let Some(mut contact) = PairContact::new(found.sides, found.normal, side_bodies) {
                    contact.friction = friction;
                    (contact.is_cut_apart, contact.is_speculative) = (found.is_cut_apart, found.is_speculative);
                    contact.set_gap(found.gap, span.duration);
                    warm_start.restore(&mut contact);
                    if pair_contacts.len() < pair_contacts.capacity() {
                        pair_contacts.push(contact);
                    } else if !contact.is_speculative
                        && let Some(contact_index) =
                            replaceable.find(|&contact_index| pair_contacts[contact_index].is_speculative)
                    {
                        pair_contacts[contact_index] = contact;
                    }
                }
            });
        }
        warm_start.restore_from_neighbors(&mut pair_contacts[first_new..]);
        if updates_clearances {
            for &body_index in islands.members(island) {
                if let Some(Some(clearances_of_body)) = clearances.get_mut(body_index as usize) {
                    let surface = surfaces.get(body_index as usize).and_then(Option::as_ref);
                    clearances_of_body.update(surface.map_or(&[], |surface| &surface.is_crossing));
                }
            }
        }
    }
}

/// True if an attachment joins nodes of both sides.
fn are_joined(attachments: &PointAttachments, bodies: &impl Systems, sides: &[ContactSide; 2]) -> bool {
    let [a, b] = sides;
    !attachments.is_empty() && share_attachment(attachments, bodies, [a.body, b.body], [&a.nodes, &b.nodes])
}

/// Returns the contact distance of two bodies, or of one with itself, m; `None` if they do not collide.
fn contact_distance(first: &SearchSide, second: &SearchSide, bodies: [&System; 2]) -> Option<f32> {
    let [a, b] = bodies.map(|body| &body.contact);
    if first.body_index == second.body_index {
        return first.surface.self_contact_radius(a);
    }
    let shortest = first.surface.short_edge.min(second.surface.short_edge);
    let distance = (a.thickness + b.thickness).max(MIN_THICKNESS * shortest);
    can_collide(bodies[0], bodies[1]).then_some(distance)
}

/// True if two bodies that collide use images.
fn find_in_images(first: &CollisionSurface, second: &CollisionSurface) -> bool {
    first.wants_images || second.wants_images
}

/// True if one surface may be completely inside the other. Otherwise, without crossing edges, nothing is
/// inside.
fn may_contain_each_other(first: &CollisionSurface, second: &CollisionSurface) -> bool {
    let (a, b) = (
        first.forest.bounds(),
        second.forest.bounds().moved(second.origin - first.origin),
    );
    a.contains(&b) || b.contains(&a)
}

/// Returns bounds of the part of a surface that another may touch at the distance `radius`, m.
fn overlap_bounds(surface: &CollisionSurface, other: &CollisionSurface, radius: f32) -> Aabb {
    let margin = radius + surface.short_edge + SPEED_MARGIN * (surface.max_displacement + other.max_displacement);
    let shift = shift(other, surface);
    let (own_bounds, other_bounds) = (surface.forest.bounds(), other.forest.bounds());
    Aabb {
        min: (other_bounds.min + shift - margin).max(own_bounds.min),
        max: (other_bounds.max + shift + margin).min(own_bounds.max),
    }
}

#[cfg(test)]
mod tests {
    use super::super::candidate_pairs::tests::world;
    use super::super::pair_contact::PairContact;
    use crate::mesh::Mesh;
    use crate::{Solver, World};

    fn pair_contacts(world: &mut World) -> &mut Vec<PairContact> {
        &mut world
            .deformable_contact
            .as_mut()
            .expect("it meets itself")
            .pair_contacts
    }

    #[test]
    fn touching_contacts_replace_speculative_ones() {
        let sheet = Mesh::cloth([0.1; 2], [8; 2]).expect("a cloth");
        let (mut world, _) = world(&sheet, Solver::Verlet, 0.002);
        let mut seen = 0;
        for _ in 0..40 {
            let before = world.save().expect("a snapshot");
            world.step(1e-3).expect("a step");
            let found = pair_contacts(&mut world);
            let meeting = found.iter().filter(|contact| !contact.is_speculative).count();
            if meeting < found.len() && meeting > 4 {
                let mut other = World::load(&before, 1, None).expect("the snapshot");
                // Capacity for half of the contacts that touch.
                *pair_contacts(&mut other) = Vec::with_capacity(meeting / 2);
                other.step(1e-3).expect("a step");
                let found = pair_contacts(&mut other);
                assert_eq!(found.len(), found.capacity());
                assert!(found.iter().all(|contact| !contact.is_speculative));
                seen += 1;
            }
        }
        assert!(seen > 10, "{seen}");
    }
}
