use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use glam::{DVec3, Vec3};

use super::Packed;
use crate::def::{Rounding, Spring};
use crate::random::Random;
use crate::simd::Kernel;
use crate::soa::{Records, TileForces, Vectors, WriteRecords, tile_count, tile_nodes};
use crate::springs::{DirectionInput, ForceInput, Link, Rewiring, SpringChange, Springs, Tangent};

const KERNELS: [Kernel; 4] = [Kernel::Portable, Kernel::Avx2, Kernel::Avx512, Kernel::Neon];

/// Springs by their lower and higher node.
type TestPairs = BTreeMap<[u32; 2], Spring>;

fn spring(nodes: [u32; 2], [stiffness, rest_length, damping]: [f32; 3]) -> Spring {
    Spring {
        nodes,
        stiffness,
        rest_length,
        damping,
    }
}

fn join(pairs: &mut TestPairs, a: usize, b: usize, parameters: [f32; 3]) {
    if a != b {
        let nodes = [a.min(b) as u32, a.max(b) as u32];
        pairs.entry(nodes).or_insert(spring(nodes, parameters));
    }
}

/// A band of springs at constant index offsets, with the given parameters.
fn band(count: usize, offsets: &[usize], mut parameters: impl FnMut(usize) -> [f32; 3]) -> TestPairs {
    let mut pairs = TestPairs::new();
    for (class, &offset) in offsets.iter().enumerate() {
        for node in 0..count.saturating_sub(offset) {
            join(&mut pairs, node, node + offset, parameters(class));
        }
    }
    pairs
}

/// Test bodies for every column layout: name, number of nodes and springs.
fn bodies(damped: bool) -> Vec<(&'static str, usize, TestPairs)> {
    let mut random = Random(7);
    let damping = if damped { 0.5 } else { 0.0 };
    let shared = |class: usize| [10.0 + class as f32, 0.1 * (1 + class) as f32, damping];
    let mut bodies = vec![
        ("a pair", 2, band(2, &[1], shared)),
        ("runs", 1000, band(1000, &[1, 17, 31, 32, 33], shared)),
        (
            "runs without a number that sixteen divides",
            77,
            band(77, &[1, 40, 76], shared),
        ),
        ("no springs", 20, TestPairs::new()),
    ];
    let mut own = Random(8);
    let each = |_| [own.unit(), own.unit(), damping * own.unit()];
    bodies.push(("runs with parameters of their own", 700, band(700, &[1, 2, 50], each)));
    let mut lengths = Random(9);
    let uniform = |_| [25.0, lengths.unit(), damping];
    bodies.push(("runs of one stiffness", 700, band(700, &[1, 2, 50], uniform)));
    for (name, count, links) in [("gathers", 3000, 12_000), ("far gathers", 150_000, 400_000)] {
        let mut pairs = TestPairs::new();
        for _ in 0..links {
            let (a, b) = (random.below(count), random.below(count));
            join(
                &mut pairs,
                a,
                b,
                [random.unit(), random.unit(), damping * random.unit()],
            );
        }
        bodies.push((name, count, pairs));
    }
    let mut pairs = band(5000, &[1], shared);
    for node in 1..4000 {
        join(&mut pairs, 100, node, [random.unit(), random.unit(), damping]);
    }
    bodies.push(("a star", 5000, pairs));
    bodies
}

fn vectors(count: usize, random: &mut Random) -> Vectors {
    let mut vectors = Vectors::zeros(count).expect("memory");
    for node in 0..count {
        vectors.set(node, random.vector());
    }
    vectors
}

fn packed(kernel: Kernel, count: usize, pairs: &TestPairs) -> Option<Packed> {
    let springs: Vec<Spring> = pairs.values().copied().collect();
    let packed = Packed::new(kernel.choose().ok()?, count, &springs, Rounding { reach: 0.0 });
    Some(packed.expect("memory"))
}

/// The vectors as records.
fn records(vectors: &Vectors) -> Records {
    let mut records = Records::zeros(vectors.len()).expect("memory");
    let kernel = Kernel::Portable.choose().expect("a kernel for every processor");
    kernel.run(WriteRecords {
        axes: vectors.axes(),
        records: records.as_mut_slice(),
    });
    records
}

/// Checks the forces on nodes, to this fraction of the terms of their sums. Returns their total.
fn check(label: &str, actual: &[Vec3], expected: &[(DVec3, f64)], part: f64) -> DVec3 {
    for (node, (actual, (expected, size))) in actual.iter().zip(expected).enumerate() {
        let error = (actual.as_dvec3() - *expected).length();
        assert!(error <= part * size, "{label}, node {node}: {actual} for {expected}");
    }
    actual.iter().map(|force| force.as_dvec3()).sum()
}

fn forces_in(packed: &dyn Springs, input: &ForceInput, count: usize) -> Vec<Vec3> {
    let mut all = Vec::new();
    for tile in 0..tile_count(count) {
        let mut forces = TileForces::ZERO;
        packed.forces(tile, input, &mut forces);
        all.extend((0..tile_nodes(tile, count).len()).map(|index| forces.get(index)));
    }
    all
}

/// Forces from positions without records; with records the last bits of a sum may differ.
fn plain_forces(packed: &dyn Springs, positions: &Vectors, velocities: Option<&Vectors>) -> Vec<Vec3> {
    forces_in(packed, &ForceInput::at(positions, velocities), positions.len())
}

fn forces(packed: &dyn Springs, positions: &Vectors, velocities: Option<&Vectors>) -> Vec<Vec3> {
    let actual = plain_forces(packed, positions, velocities);
    let records = records(positions);
    let input = ForceInput {
        positions: positions.view().with_records(Some(&records)),
        ..ForceInput::at(positions, velocities)
    };
    assert_eq!(actual, forces_in(packed, &input, positions.len()), "from records");
    actual
}

/// The forces in `f64`, and the magnitude of the terms of each sum.
fn reference(pairs: &TestPairs, positions: &Vectors, velocities: Option<&Vectors>) -> Vec<(DVec3, f64)> {
    let mut forces = vec![(DVec3::ZERO, 0.0); positions.len()];
    for spring in pairs.values() {
        let [a, b] = spring.nodes.map(|node| node as usize);
        let offset = positions.get(b).as_dvec3() - positions.get(a).as_dvec3();
        let direction = if offset == DVec3::ZERO {
            DVec3::X
        } else {
            offset.normalize()
        };
        let rate = velocities.map_or(0.0, |velocities| {
            direction.dot(velocities.get(b).as_dvec3() - velocities.get(a).as_dvec3())
        });
        let tension = f64::from(spring.stiffness) * (offset.length() - f64::from(spring.rest_length));
        let damping = f64::from(spring.damping) * rate;
        let size = f64::from(spring.stiffness) * (offset.length() + f64::from(spring.rest_length)) + damping.abs();
        for (node, sign) in [(a, 1.0), (b, -1.0)] {
            forces[node].0 += direction * (sign * (tension + damping));
            forces[node].1 += size;
        }
    }
    forces
}

#[test]
fn every_kernel_computes_the_forces() {
    for damped in [false, true] {
        for (name, count, pairs) in bodies(damped) {
            let mut random = Random(3);
            let mut positions = vectors(count, &mut random);
            // Some nodes coincide exactly, others almost.
            for node in (0..count.saturating_sub(60)).step_by(97) {
                positions.set(node + 1, positions.get(node));
                positions.set(node + 50, positions.get(node) + Vec3::splat(1e-22));
            }
            let velocities = damped.then(|| vectors(count, &mut random));
            let expected = reference(&pairs, &positions, velocities.as_ref());
            let mut tried = 0;
            for kernel in KERNELS {
                let Some(packed) = packed(kernel, count, &pairs) else {
                    continue;
                };
                tried += 1;
                assert_eq!(packed.damped(), damped && !pairs.is_empty());
                let actual = forces(&packed, &positions, velocities.as_ref().filter(|_| packed.damped()));
                let sum = check(&format!("{name}, {kernel:?}"), &actual, &expected, 1e-6);
                // Both ends get opposite forces; only the sums of each node are rounded.
                let total: f64 = expected.iter().map(|(_, size)| size).sum();
                assert!(sum.length() <= 1e-7 * total.max(1e-30), "{name}, {kernel:?}: {sum}");
            }
            assert!(tried >= 1);
        }
    }
}

/// The force changes in `f64` with the magnitude of their terms, and the energy.
fn reference_change(
    pairs: &TestPairs,
    positions: &Vectors,
    displacements: &Vectors,
    tangent: Tangent,
) -> (Vec<(DVec3, f64)>, f64) {
    let mut changes = vec![(DVec3::ZERO, 0.0); positions.len()];
    let mut energy = 0.0;
    for spring in pairs.values() {
        let [a, b] = spring.nodes.map(|node| node as usize);
        let [k, rest, damping] = [spring.stiffness, spring.rest_length, spring.damping].map(f64::from);
        let offset = positions.get(b).as_dvec3() - positions.get(a).as_dvec3();
        let length = offset.length();
        let direction = if length == 0.0 { DVec3::X } else { offset / length };
        let floor = if length == 0.0 { 0.0 } else { f64::from(tangent.floor) };
        let slack = if rest == 0.0 { 1.0 } else { 1.0 - rest / length };
        let across = (k * slack).max(floor);
        let along = k + damping * f64::from(tangent.rate);
        let difference = displacements.get(b).as_dvec3() - displacements.get(a).as_dvec3();
        let lengthening = direction * direction.dot(difference);
        let change = lengthening * along + (difference - lengthening) * across;
        energy += 0.5 * k * (length - rest).powi(2);
        for (node, sign) in [(a, 1.0), (b, -1.0)] {
            changes[node].0 += change * sign;
            // The effect of a rounded length on the transverse part.
            changes[node].1 += difference.length() * (along + across.abs() + k * (slack - 1.0).abs().min(1e6));
        }
    }
    (changes, energy)
}

#[test]
fn every_kernel_computes_changes_and_energy() {
    for (damped, floor) in [
        (false, 0.0),
        (true, 0.0),
        (false, f32::NEG_INFINITY),
        (true, f32::NEG_INFINITY),
    ] {
        let tangent = Tangent { floor, rate: 3.0 };
        for (name, count, pairs) in bodies(damped) {
            let mut random = Random(5);
            let mut positions = vectors(count, &mut random);
            for node in (0..count.saturating_sub(60)).step_by(97) {
                positions.set(node + 1, positions.get(node));
            }
            let displacements = vectors(count, &mut random);
            let [position_records, way_records] = [&positions, &displacements].map(records);
            let input = DirectionInput {
                node_count: count,
                positions: positions.view(),
                displacements: displacements.view(),
                tangent,
            };
            let input_with_records = DirectionInput {
                positions: positions.view().with_records(Some(&position_records)),
                displacements: displacements.view().with_records(Some(&way_records)),
                ..input
            };
            let (expected, energy) = reference_change(&pairs, &positions, &displacements, tangent);
            for kernel in KERNELS {
                let Some(packed) = packed(kernel, count, &pairs) else {
                    continue;
                };
                let (mut sum, mut found_energy) = (DVec3::ZERO, 0.0);
                for tile in 0..tile_count(count) {
                    let mut changes = TileForces::ZERO;
                    packed.force_changes(tile, &input, &mut changes);
                    found_energy += packed.half_energy(tile_nodes(tile, count), input_with_records.positions);
                    let mut from_records = TileForces::ZERO;
                    packed.force_changes(tile, &input_with_records, &mut from_records);
                    assert_eq!(changes.axes(), from_records.axes(), "{name}, {kernel:?}, from records");
                    for (index, node) in tile_nodes(tile, count).enumerate() {
                        let (actual, (expected, size)) = (changes.get(index).as_dvec3(), expected[node]);
                        assert!(
                            (actual - expected).length() <= 2e-6 * size,
                            "{name}, {kernel:?}, {floor}, node {node}: {actual} for {expected}"
                        );
                        sum += actual;
                    }
                }
                let total: f64 = expected.iter().map(|(_, size)| size).sum();
                assert!(sum.length() <= 1e-7 * total.max(1e-30), "{name}, {kernel:?}: {sum}");
                assert!(
                    (found_energy - energy).abs() <= 1e-5 * energy,
                    "{name}, {kernel:?}: {found_energy} J for {energy} J"
                );
            }
        }
    }
}

#[test]
fn springs_come_back_as_they_were_given() {
    for damped in [false, true] {
        for (name, count, pairs) in bodies(damped) {
            let packed = packed(Kernel::Best, count, &pairs).expect("a kernel");
            assert_eq!(packed.spring_count(), pairs.len());
            assert_eq!(links(&packed, count), pairs, "{name}");
        }
    }
}

/// The springs, collected from the links of both nodes.
fn links(packed: &dyn Springs, count: usize) -> TestPairs {
    let mut ends: BTreeMap<[u32; 2], Vec<Link>> = BTreeMap::new();
    for node in 0..count as u32 {
        packed.visit(node as usize, &mut |link| {
            let pair = [node.min(link.neighbor), node.max(link.neighbor)];
            ends.entry(pair).or_default().push(link);
        });
    }
    let joined = |(nodes, ends): ([u32; 2], Vec<Link>)| {
        assert_eq!(ends.len(), 2, "{nodes:?}");
        let parameters = |link: &Link| [link.stiffness, link.rest_length, link.damping];
        assert_eq!(parameters(&ends[0]), parameters(&ends[1]));
        (nodes, spring(nodes, parameters(&ends[0])))
    };
    ends.into_iter().map(joined).collect()
}

#[test]
fn any_change_of_springs_is_kept() {
    let mut random = Random(5);
    let count = 1200;
    let mut pairs = band(count, &[1, 30, 31], |class| [10.0, 0.1 + class as f32, 0.0]);
    let mut packed = packed(Kernel::Best, count, &pairs).expect("a kernel");
    let positions = vectors(count, &mut random);
    for round in 0..12 {
        for _ in 0..500 {
            let (a, b) = (random.below(count) as u32, random.below(count) as u32);
            let nodes = [a.min(b), a.max(b)];
            // Springs of a common class, and others.
            let stiffness = if random.below(2) == 0 { 10.0 } else { random.unit() };
            let spring = spring(nodes, [stiffness, 0.1, 0.0]);
            if a == b {
                continue;
            }
            match pairs.entry(nodes) {
                Entry::Occupied(_) => assert!(packed.add(&spring).is_err()),
                Entry::Vacant(vacant) => {
                    assert!(packed.remove(a, b).is_err());
                    packed.add(&spring).expect("memory");
                    vacant.insert(spring);
                }
            }
        }
        let share = if round == 9 { 10 } else { 3 };
        let removed: Vec<[u32; 2]> = pairs
            .keys()
            .copied()
            .filter(|_| random.below(share) > 0 && round > 5)
            .collect();
        for [a, b] in removed {
            packed.remove(b, a).expect("a spring");
            pairs.remove(&[a, b]);
        }
        assert_eq!(packed.spring_count(), pairs.len());
        assert!(packed.is_valid());
        assert_eq!(links(&packed, count), pairs);
        let expected = reference(&pairs, &positions, None);
        check("changed", &forces(&packed, &positions, None), &expected, 1e-6);
        let (used, held) = packed.bytes();
        assert!(used <= held);
    }
}

#[test]
fn rest_lengths_that_differ_by_rounding_are_one() {
    let count = 1000;
    let spacing = 0.01;
    let springs: Vec<Spring> = (1..count)
        .map(|node| {
            // Rest lengths as a caller computes them from positions.
            let rest_length = node as f32 * spacing - (node - 1) as f32 * spacing;
            spring([node - 1, node], [1.0, rest_length, 0.0])
        })
        .collect();
    let lengths: std::collections::BTreeSet<u32> = springs.iter().map(|spring| spring.rest_length.to_bits()).collect();
    assert!(lengths.len() > 10);
    let kernel = Kernel::Best.choose().expect("a kernel");
    let reach = count as f32 * spacing;
    let given = Packed::new(kernel, count as usize, &springs, Rounding { reach: 0.0 }).expect("memory");
    let derived = Packed::new(kernel, count as usize, &springs, Rounding { reach }).expect("memory");
    // All columns share their rest lengths.
    let (one, many) = (derived.bytes().0, given.bytes().0);
    assert!(3 * one < 2 * many, "{one} bytes for {many}");
    for (node, spring) in springs.iter().enumerate() {
        derived.visit(node, &mut |link| {
            assert!((link.rest_length - spacing).abs() <= f32::EPSILON * reach);
        });
        given.visit(node, &mut |link| {
            let known = |spring: &Spring| spring.rest_length == link.rest_length;
            let nearby = &springs[node.saturating_sub(1)..=node];
            assert!(
                nearby.iter().any(known),
                "{} for {}",
                link.rest_length,
                spring.rest_length
            );
        });
    }
}

#[test]
fn springs_that_are_changed_have_what_they_were_given_at_both_ends() {
    let mut random = Random(8);
    for damped in [false, true] {
        for (name, count, mut pairs) in bodies(damped) {
            let mut packed = packed(Kernel::Best, count, &pairs).expect("a kernel");
            for _ in 0..3 {
                let mut changes = Vec::new();
                for (&[a, b], spring) in &mut pairs {
                    if random.below(3) > 0 {
                        continue;
                    }
                    let before = Link::ends(spring)[0];
                    spring.stiffness *= 0.5;
                    spring.rest_length *= 1.5;
                    spring.damping *= 0.25;
                    let after = Link::ends(spring)[0];
                    assert_eq!([a, b], spring.nodes);
                    changes.push(SpringChange { node: a, before, after });
                }
                packed.set(&changes).expect("memory");
                assert_eq!(links(&packed, count), pairs, "{name}");
            }
        }
    }
}

#[test]
fn nodes_that_come_later_have_their_springs() {
    const MORE: usize = 700;
    for damped in [false, true] {
        for kernel in [Kernel::Best, Kernel::Portable] {
            for (name, count, mut pairs) in bodies(damped) {
                let mut random = Random(4);
                let mut packed = packed(kernel, count, &pairs).expect("a kernel");
                packed.reserve_nodes(count + MORE).expect("memory");
                packed.resize(count + MORE).expect("memory");
                let mut rewiring = Rewiring::default();
                for node in count..count + MORE {
                    // One spring to an old node, one to a new node.
                    for other in [random.below(count), count + random.below(node + 1 - count)] {
                        let nodes = [other as u32, node as u32];
                        let stiffness = random.unit();
                        let damping = if packed.damped() { random.unit() } else { 0.0 };
                        let spring = spring(nodes, [stiffness, 0.1, damping]);
                        if other != node && pairs.insert(nodes, spring).is_none() {
                            rewiring.added.push(spring);
                        }
                    }
                }
                packed.rewire(&rewiring).expect("memory");
                assert!(packed.is_valid(), "{name}");
                assert_eq!(links(&packed, count + MORE), pairs, "{name}");
                let positions = vectors(count + MORE, &mut random);
                let velocities = packed.damped().then(|| vectors(count + MORE, &mut random));
                let expected = reference(&pairs, &positions, velocities.as_ref());
                let actual = plain_forces(&packed, &positions, velocities.as_ref());
                assert_eq!(actual.len(), count + MORE);
                check(name, &actual, &expected, 2e-6);
                // The new springs and nodes are removed again.
                rewiring.removed = std::mem::take(&mut rewiring.added);
                packed.rewire(&rewiring).expect("memory");
                packed.resize(count).expect("memory");
                assert!(packed.is_valid(), "{name}, as it was");
                pairs.retain(|nodes, _| nodes.iter().all(|&node| (node as usize) < count));
                assert_eq!(links(&packed, count), pairs, "{name}");
                let positions = vectors(count, &mut random);
                let expected = reference(&pairs, &positions, None);
                if !packed.damped() {
                    check(name, &plain_forces(&packed, &positions, None), &expected, 2e-6);
                }
            }
        }
    }
}
