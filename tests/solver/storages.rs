//! The storages of Halic et al. and PACKED: the motion of one body, its edits, its exact memory use, full rows.

use std::collections::BTreeSet;

use crate::support::bodies::{FREE, Parts, Random, Scene, largest_difference};
use crate::support::reference::Reference;
use crate::support::scene::STORAGES;
use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Error, Storage, StorageReport, Values, WorldDefinition};

const OF_THE_PAPER: [Storage; 3] = [Storage::Efficient, Storage::FastLink, Storage::DynamicBulk];

/// Creates a scene with a body of these parts in this storage.
fn scene(parts: &Parts, storage: Storage, springs_per_node: u32) -> Scene {
    let mut world = sinew::World::new(FREE).expect("a world");
    let definition = BodyDefinition {
        storage,
        springs_per_node,
        ..parts.definition()
    };
    let id = world.create_body(&definition).expect("a body");
    Scene { world, id }
}

/// Returns the smallest row width for the body, plus spare slots.
fn width_with_spare(parts: &Parts, spare: u32) -> u32 {
    degrees(parts).into_iter().max().unwrap_or(0) as u32 + spare
}

fn degrees(parts: &Parts) -> Vec<usize> {
    let mut degrees = vec![0; parts.positions.len()];
    for node in parts.springs.iter().flatten() {
        degrees[*node as usize] += 1;
    }
    degrees
}

/// Returns the pairs of a body, each with the lower node first.
fn pairs(scene: &Scene) -> BTreeSet<[u32; 2]> {
    let list = scene.body().spring_pairs().expect("memory");
    let set: BTreeSet<_> = list.iter().copied().collect();
    assert_eq!(set.len(), list.len(), "a pair is reported twice");
    set
}

fn report(scene: &Scene) -> StorageReport {
    scene.body().storage_report()
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// A swinging sheet with slightly different springs to all 8 neighbors.
fn swinging_sheet(side: usize, random: &mut Random) -> Parts {
    let positions = (0..side * side).map(|i| Vec3::new((i % side) as f32, 0.0, (i / side) as f32) * 0.01);
    let mut parts = Parts::nodes(positions.collect(), 1e-3);
    for node in 0..side * side {
        let (row, column) = (node / side, node % side);
        for (down, right) in [(0, 1), (1, -1), (1, 0), (1, 1)] {
            let (row, column) = (row as i32 + down, column as i32 + right);
            if row < side as i32 && (0..side as i32).contains(&column) {
                let stiffness = 5.0 + 4.0 * random.signed();
                parts.join(node, row as usize * side + column as usize, stiffness);
            }
        }
    }
    parts
}

/// A swinging organ.
fn organ(random: &mut Random) -> Parts {
    let mesh = Mesh::organ(0.1, 0.012).expect("an organ");
    let mut parts = Parts::nodes(mesh.positions.clone(), 1e-3);
    for [a, b] in mesh.edges().expect("its edges") {
        parts.join(a as usize, b as usize, 5.0 + 4.0 * random.signed());
    }
    parts
}

/// Adds and removes springs between the steps of a moving body.
fn edit_in_motion(parts: &Parts, seed: u64) {
    const H: f32 = 5e-4;
    let mut random = Random::new(seed);
    let velocities: Vec<Vec3> = parts.positions.iter().map(|_| 0.05 * random.vector()).collect();
    let spare = width_with_spare(parts, 12);
    let mut scenes =
        STORAGES.map(|storage| scene(parts, storage, if storage == Storage::FastLink { spare } else { 0 }));
    let mut reference: Option<Reference> = (parts.spring_damping == 0.0).then(|| parts.reference(Vec3::ZERO));
    for scene in &mut scenes {
        scene.body_mut().set_velocities(&velocities).expect("velocities");
    }
    if let Some(reference) = &mut reference {
        reference.velocities = velocities.iter().map(|v| v.as_dvec3()).collect();
    }
    let mut alive: Vec<[u32; 2]> = parts.springs.iter().map(|&pair| sorted(pair)).collect();
    let nodes = parts.positions.len();
    for edit in 0..300 {
        if edit % 2 == 0 {
            let [a, b] = alive.swap_remove(random.below(alive.len()));
            for scene in &mut scenes {
                scene.body_mut().remove_spring(b, a).expect("a spring");
            }
            if let Some(reference) = &mut reference {
                reference.springs.retain(|&(pair, _, _)| sorted(pair) != [a, b]);
            }
        } else {
            let a = random.below(nodes) as u32;
            let b = (a + 1 + random.below(nodes - 1) as u32) % nodes as u32;
            if alive.contains(&sorted([a, b])) {
                continue;
            }
            let (stiffness, rest_length) = (0.2 + 0.1 * random.signed(), 0.02 + 0.01 * random.signed());
            for scene in &mut scenes {
                let body = scene.body_mut();
                body.add_spring(a, b, stiffness, Some(rest_length)).expect("room");
            }
            if let Some(reference) = &mut reference {
                reference
                    .springs
                    .push(([a, b], f64::from(stiffness), f64::from(rest_length)));
            }
            alive.push(sorted([a, b]));
        }
        for scene in &mut scenes {
            assert_eq!(scene.step(H).substeps, 1);
        }
        if let Some(reference) = &mut reference {
            reference.step(f64::from(H));
        }
    }
    let expected: BTreeSet<[u32; 2]> = alive.iter().copied().collect();
    let first = scenes[0].positions();
    let start: Vec<DVec3> = parts.positions.iter().map(|p| p.as_dvec3()).collect();
    assert!(largest_difference(&first, &start) > 1e-3, "nothing moved");
    for (scene, storage) in scenes.iter().zip(STORAGES) {
        assert_eq!(report(scene).spring_count, alive.len(), "{storage:?}");
        assert_eq!(pairs(scene), expected, "{storage:?}");
        let difference = largest_difference(&first, &scene.positions());
        assert!(difference < 2e-6, "{storage:?}: {difference} m");
        if let Some(reference) = &reference {
            let error = largest_difference(&scene.positions(), &reference.positions);
            assert!(error < 2e-6, "{storage:?} against f64: {error} m");
        }
    }
}

#[test]
fn a_sheet_edited_in_motion_is_the_same_in_every_storage() {
    let mut parts = swinging_sheet(20, &mut Random::new(40));
    edit_in_motion(&parts, 41);
    parts.spring_damping = 2e-4;
    edit_in_motion(&parts, 42);
}

#[test]
fn an_organ_edited_in_motion_is_the_same_in_every_storage() {
    let mut parts = organ(&mut Random::new(43));
    edit_in_motion(&parts, 44);
    parts.spring_damping = 2e-4;
    edit_in_motion(&parts, 45);
}

#[test]
fn each_spring_has_its_own_damping() {
    let mut random = Random::new(46);
    let parts = swinging_sheet(9, &mut random);
    let dampings: Vec<f32> = parts.springs.iter().map(|_| 1e-3 + 1e-3 * random.signed()).collect();
    let velocities: Vec<Vec3> = parts.positions.iter().map(|_| 0.3 * random.vector()).collect();
    let moved = STORAGES.map(|storage| {
        let mut world = sinew::World::new(FREE).expect("a world");
        let definition = BodyDefinition {
            storage,
            spring_dampings: Values::Each(&dampings),
            ..parts.definition()
        };
        let id = world.create_body(&definition).expect("a body");
        let mut scene = Scene { world, id };
        scene.body_mut().set_velocities(&velocities).expect("velocities");
        scene.run(5e-4, 100);
        scene.positions()
    });
    let mut undamped = scene(&parts, Storage::Efficient, 0);
    undamped.body_mut().set_velocities(&velocities).expect("velocities");
    undamped.run(5e-4, 100);
    let effect = largest_difference(&moved[1], &undamped.positions());
    assert!(effect > 1e-4, "damping changes {effect} m");
    for (positions, storage) in moved.iter().zip(STORAGES) {
        let difference = largest_difference(&moved[0], positions);
        assert!(difference < 2e-6, "{storage:?}: {difference} m");
    }
}

#[test]
fn coincident_nodes_separate_in_every_storage() {
    let mut parts = Parts::nodes(vec![Vec3::ZERO; 2], 1e-3);
    parts.springs.push([1, 0]);
    parts.stiffnesses.push(10.0);
    parts.rest_lengths.push(0.01);
    for spring_damping in [0.0, 1e-3] {
        parts.spring_damping = spring_damping;
        for storage in STORAGES {
            let mut scene = scene(&parts, storage, 0);
            scene.step(1e-4);
            let velocities = scene.velocities();
            assert!(velocities[0].x < -1e-4, "{storage:?}: {velocities:?}");
            assert_eq!(velocities[0], -velocities[1], "{storage:?}");
        }
    }
}

/// Returns the memory by the paper's formulas, with sizes as a C compiler lays them out: (of existing springs, of all
/// slots).
fn formula(storage: Storage, degrees: &[usize], slots: usize, damped: bool) -> (usize, usize) {
    const POINTER: usize = size_of::<*const ()>();
    const COUNT: usize = size_of::<usize>();
    // A neighbor, a stiffness, a rest length; a damping where springs are damped.
    let link = if damped { 16 } else { 12 };
    let (nodes, links) = (degrees.len(), degrees.iter().sum::<usize>());
    match storage {
        Storage::Packed => unreachable!("it has no formula"),
        // With the pointer to the next, a link is padded to whole pointers: room for a damping, used or not.
        Storage::Efficient => {
            let element = 16 + POINTER;
            (links * element, links * element + nodes * POINTER)
        }
        Storage::FastLink => (links * link, nodes * slots * link),
        // A table holds the pointer, length and successor of each node's first array.
        Storage::DynamicBulk => {
            let header = POINTER + COUNT + POINTER;
            let chunk = |&degree: &usize| {
                let arrays = degree.div_ceil(slots);
                header * arrays.max(1) + arrays * slots * link
            };
            (links * link, degrees.iter().map(chunk).sum())
        }
    }
}

#[test]
fn memory_agrees_with_the_formulas() {
    for damped in [false, true] {
        let mut parts = swinging_sheet(12, &mut Random::new(47));
        parts.spring_damping = if damped { 1e-4 } else { 0.0 };
        for storage in OF_THE_PAPER {
            for slots in [8, 12, 31] {
                let mut scene = scene(&parts, storage, slots);
                let mut degrees = degrees(&parts);
                let check = |scene: &Scene, degrees: &[usize]| {
                    let report = report(scene);
                    assert_eq!(
                        (report.bytes_used, report.bytes_reserved),
                        formula(storage, degrees, slots as usize, damped),
                        "{storage:?}, {slots} slots, damped {damped}"
                    );
                };
                check(&scene, &degrees);
                for &[a, b] in &parts.springs {
                    scene.body_mut().remove_spring(a, b).expect("a spring");
                    degrees[a as usize] -= 1;
                    degrees[b as usize] -= 1;
                }
                check(&scene, &degrees);
                for node in 1..=8 {
                    scene.body_mut().add_spring(0, node, 1.0, None).expect("room");
                    degrees[0] += 1;
                    degrees[node as usize] += 1;
                }
                check(&scene, &degrees);
            }
        }
    }
}

#[test]
fn arrays_are_added_as_a_node_needs_them() {
    let parts = swinging_sheet(6, &mut Random::new(48));
    for slots in [1, 3, 4, 5] {
        let scene = scene(&parts, Storage::DynamicBulk, slots);
        let (used, reserved) = formula(Storage::DynamicBulk, &degrees(&parts), slots as usize, false);
        assert_eq!(
            (report(&scene).bytes_used, report(&scene).bytes_reserved),
            (used, reserved)
        );
    }
}

#[test]
fn the_default_row_width_is_that_of_the_longest_row() {
    let parts = organ(&mut Random::new(49));
    let degrees = degrees(&parts);
    let longest = degrees.iter().copied().max().unwrap_or(0);
    let scene = scene(&parts, Storage::FastLink, 0);
    let (_, reserved) = formula(Storage::FastLink, &degrees, longest, false);
    assert_eq!(report(&scene).bytes_reserved, reserved);
}

#[test]
fn edits_that_do_not_fit_are_refused_and_change_nothing() {
    // Node 1 has two springs, the others have fewer; each has two slots.
    let mut parts = Parts::nodes((0..5).map(|i| Vec3::X * i as f32).collect(), 0.1);
    parts.join(0, 1, 10.0);
    parts.join(1, 2, 10.0);
    parts.join(3, 4, 10.0);
    let mut scene = scene(&parts, Storage::FastLink, 2);
    scene.run(1e-3, 3);
    let seen = |scene: &Scene| (scene.world.state_hash(), report(scene), pairs(scene));
    let before = seen(&scene);
    // The rows of the first and second nodes are full.
    for (a, b) in [(1, 3), (3, 1)] {
        let refused = scene.body_mut().add_spring(a, b, 10.0, None);
        let Err(Error::Capacity(message)) = refused else {
            panic!("{refused:?}");
        };
        assert!(message.contains("node 1 "), "{message}");
        assert_eq!(seen(&scene), before);
    }
    // An existing pair is refused as such, full row or not; so is the removal of a missing pair.
    for refused in [
        scene.body_mut().add_spring(1, 0, 10.0, None),
        scene.body_mut().remove_spring(0, 3),
    ] {
        assert!(matches!(refused, Err(Error::InvalidArgument(_))), "{refused:?}");
    }
    assert_eq!(seen(&scene), before);
    // A freed slot is used again any number of times.
    for _ in 0..10 {
        scene.body_mut().remove_spring(0, 1).expect("a spring");
        scene.body_mut().add_spring(3, 1, 10.0, None).expect("a free slot");
        assert!(scene.body_mut().add_spring(0, 1, 10.0, None).is_err());
        scene.body_mut().remove_spring(1, 3).expect("a spring");
        scene.body_mut().add_spring(0, 1, 10.0, None).expect("a free slot");
        assert_eq!(report(&scene), before.1);
    }
    assert_eq!(pairs(&scene), before.2);
}

#[test]
fn a_definition_that_does_not_fit_is_refused() {
    let parts = Parts::chain(4, Vec3::X, 0.1, 10.0);
    let mut world = sinew::World::new(FREE).expect("a world");
    let narrow = BodyDefinition {
        storage: Storage::FastLink,
        springs_per_node: 1,
        ..parts.definition()
    };
    let refused = world.create_body(&narrow);
    assert!(
        matches!(&refused, Err(Error::Capacity(message)) if message.contains("node 1 ")),
        "{refused:?}"
    );
    // Chains of arrays grow as needed.
    let chained = BodyDefinition {
        storage: Storage::DynamicBulk,
        ..narrow
    };
    world.create_body(&chained).expect("a body");
}

#[test]
fn pairs_are_joined_once_in_every_storage() {
    let parts = Parts::chain(3, Vec3::X, 0.1, 10.0);
    for storage in STORAGES {
        let mut scene = scene(&parts, storage, 2);
        let before = scene.world.state_hash();
        for (a, b) in [(0, 1), (1, 0)] {
            let twice = scene.body_mut().add_spring(a, b, 1.0, None);
            assert!(
                matches!(twice, Err(Error::InvalidArgument(_))),
                "{storage:?}: {twice:?}"
            );
        }
        let none = scene.body_mut().remove_spring(0, 2);
        assert!(matches!(none, Err(Error::InvalidArgument(_))), "{storage:?}: {none:?}");
        assert_eq!(scene.world.state_hash(), before, "{storage:?}");
        assert_eq!(report(&scene).spring_count, 2);
    }
}

#[test]
fn nodes_without_springs_fall_freely() {
    for storage in STORAGES {
        // Every third node has a spring to the next, and one tile has no springs.
        let mut parts = Parts::nodes((0..2000).map(|i| Vec3::X * (0.01 * i as f32)).collect(), 1e-3);
        for node in (0..500).step_by(3) {
            parts.join(node, node + 1, 5.0);
        }
        let mut scene = scene(&parts, storage, 0);
        scene.body_mut().set_velocities(&[Vec3::Y; 2000]).expect("velocities");
        scene.run(1e-3, 10);
        for (moved, start) in scene.positions().iter().zip(&parts.positions) {
            let expected = start.as_dvec3() + DVec3::Y * 0.01;
            assert!(moved.distance(expected) < 2e-6, "{storage:?}: {moved} not {expected}");
        }
    }
}

#[test]
fn a_body_without_springs_accepts_springs() {
    let parts = Parts::nodes((0..3).map(|i| Vec3::X * i as f32).collect(), 0.5);
    for storage in STORAGES {
        let mut scene = scene(&parts, storage, 0);
        assert_eq!(report(&scene).spring_count, 0);
        scene.body_mut().add_spring(0, 2, 100.0, Some(1.5)).expect("room");
        scene.step(1e-3);
        let pull = 100.0 * 0.5 / 0.5 * 1e-3;
        assert!((scene.velocities()[0].x - pull).abs() < 1e-3 * pull, "{storage:?}");
        assert_eq!(scene.velocities()[1], DVec3::ZERO, "{storage:?}");
    }
}

#[test]
fn a_hub_of_thousands_is_pulled_from_all_sides() {
    const RAYS: usize = 5000;
    let ray = |index: usize| {
        let angle = index as f64 * std::f64::consts::TAU / RAYS as f64;
        DVec3::new(angle.cos(), angle.sin(), 0.0).as_vec3()
    };
    let mut parts = Parts::nodes((0..RAYS).map(ray).collect(), 1e-3);
    // Rows with this many slots per node would be too large: FAST_LINK is left out.
    parts.positions.push(Vec3::new(0.1, 0.2, 0.3));
    parts.masses.push(10.0);
    parts.node_dampings.push(0.0);
    for node in 0..RAYS {
        parts.join(node, RAYS, 1.0 + (node % 7) as f32);
    }
    parts.rest_lengths.iter_mut().for_each(|length| *length *= 0.9);
    let mut reference = parts.reference(Vec3::ZERO);
    let h = 2e-4;
    (0..20).for_each(|_| reference.step(h));
    for storage in [Storage::Packed, Storage::Efficient, Storage::DynamicBulk] {
        let mut scene = scene(&parts, storage, 0);
        for _ in 0..20 {
            assert_eq!(scene.step(h as f32).substeps, 1);
        }
        let error = largest_difference(&scene.positions(), &reference.positions);
        assert!(error < 2e-6, "{storage:?}: {error} m");
        for node in (0..RAYS as u32).rev() {
            scene.body_mut().remove_spring(RAYS as u32, node).expect("a spring");
        }
        assert_eq!(report(&scene).spring_count, 0, "{storage:?}");
        let speed = scene.velocities()[RAYS];
        scene.step(h as f32);
        assert_eq!(scene.velocities()[RAYS], speed, "{storage:?}");
    }
}

#[test]
fn a_list_of_a_million_links_is_dropped() {
    let count = 1_000_000;
    let mut positions = vec![Vec3::X; count];
    positions.push(Vec3::ZERO);
    let springs: Vec<[u32; 2]> = (0..count as u32).map(|node| [node, count as u32]).collect();
    let drop_it = move || {
        let mut world = sinew::World::new(WorldDefinition::default()).expect("a world");
        let definition = BodyDefinition {
            positions: &positions,
            springs: Some(&springs),
            masses: Values::Uniform(1.0),
            stiffnesses: Values::Uniform(1.0),
            storage: Storage::Efficient,
            ..BodyDefinition::default()
        };
        let id = world.create_body(&definition).expect("a body");
        world.destroy_body(id).expect("the body");
    };
    let thread = std::thread::Builder::new().stack_size(1 << 20).spawn(drop_it);
    thread.expect("a thread").join().expect("no recursion");
}

#[test]
fn more_slots_than_memory_are_refused() {
    let parts = Parts::nodes(vec![Vec3::ZERO; 100_000], 1.0);
    let mut world = sinew::World::new(FREE).expect("a world");
    let definition = BodyDefinition {
        storage: Storage::FastLink,
        springs_per_node: u32::MAX,
        ..parts.definition()
    };
    assert_eq!(world.create_body(&definition).err(), Some(Error::OutOfMemory));
}
