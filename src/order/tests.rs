use glam::Quat;

use super::*;
use crate::mesh::Mesh;
use crate::random::Random;

type TestBody = (Vec<Vec3>, Vec<[u32; 2]>);

/// A lattice in rows along x, with every node joined to all around it.
fn lattice(size: [u32; 3]) -> TestBody {
    let [nx, ny, nz] = size;
    let node = |x, y, z| x + nx * (y + ny * z);
    let mut positions = Vec::new();
    let mut springs = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                positions.push(Vec3::new(x as f32, y as f32, z as f32) * 0.01);
                // The half of the 26 directions that comes after the center.
                for direction in 14..27 {
                    let [a, b, c] = [x + direction % 3, y + direction / 3 % 3, z + direction / 9]
                        .map(|coordinate| coordinate.wrapping_sub(1));
                    if a < nx && b < ny && c < nz {
                        springs.push([node(x, y, z), node(a, b, c)]);
                    }
                }
            }
        }
    }
    (positions, springs)
}

/// The body with its nodes and springs in random order.
fn mixed((positions, springs): &TestBody) -> TestBody {
    let mut random = Random(7);
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    random.shuffle(&mut order);
    let ranks = inverse(&order).expect("memory for a test");
    let mut springs: Vec<_> = springs
        .iter()
        .map(|spring| spring.map(|node| ranks[node as usize]))
        .collect();
    random.shuffle(&mut springs);
    (order.iter().map(|&node| positions[node as usize]).collect(), springs)
}

fn organ() -> TestBody {
    let organ = Mesh::organ(0.2, 0.2 / 40.0).expect("a sound organ");
    let springs = organ.edges().expect("memory for a test");
    (organ.positions, springs)
}

fn identity(count: usize) -> Vec<u32> {
    (0..count as u32).collect()
}

fn cost_of(order: &[u32], (positions, springs): &TestBody) -> f64 {
    let links = Links::new(springs, &identity(positions.len()), Costs::SHARED).expect("memory for a test");
    cost(order, &links).expect("memory for a test")
}

fn cost_as_given(body: &TestBody) -> f64 {
    cost_of(&identity(body.0.len()), body)
}

/// The best order, checked to be a permutation.
fn best((positions, springs): &TestBody) -> Option<Vec<u32>> {
    let order = best_order(positions, springs, Costs::SHARED).expect("memory for a test");
    if let Some(order) = &order {
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, identity(positions.len()));
    }
    order
}

fn best_cost(body: &TestBody) -> f64 {
    let order = best(body).unwrap_or_else(|| identity(body.0.len()));
    cost_of(&order, body)
}

#[test]
fn a_grid_in_rows_stays_as_it_is() {
    assert_eq!(best(&lattice([200, 150, 1])), None);
    assert_eq!(best(&lattice([14, 13, 12])), None);
}

#[test]
fn a_mixed_lattice_comes_back_in_rows() {
    for size in [[200, 150, 1], [12, 13, 14], [1000, 3, 1], [7, 8, 400]] {
        let rows = lattice(size);
        let mixed = mixed(&rows);
        let (given, best) = (cost_as_given(&mixed), best_cost(&mixed));
        assert!(best <= 1.03 * cost_as_given(&rows), "{size:?}: {best}");
        assert!(best < 0.5 * given, "{size:?}: {best}, {given} as given");
    }
}

#[test]
fn a_lattice_may_be_turned_and_bent() {
    let rows = lattice([200, 150, 1]);
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
    // Rolled up around an axis more than once, in a spiral, and stretched along it.
    let bent = |p: Vec3| {
        let angle = 5.0 * p.x;
        let radius = 1.0 + 0.05 * angle;
        turn * Vec3::new(radius * angle.cos(), p.y * (1.0 + p.y), radius * angle.sin())
    };
    let mut mixed = mixed(&rows);
    for position in &mut mixed.0 {
        *position = bent(*position);
    }
    let best = best_cost(&mixed);
    assert!(best <= 1.03 * cost_as_given(&rows), "{best}");
}

#[test]
fn an_organ_is_no_worse_than_as_given_however_it_is_mixed() {
    let given = organ();
    let mixed = mixed(&given);
    let (best_given, best_mixed) = (best_cost(&given), best_cost(&mixed));
    assert!(best_given <= cost_as_given(&given), "{best_given}");
    assert!(best_mixed <= 1.01 * cost_as_given(&given), "{best_mixed}");
    assert!(best_mixed < 0.6 * cost_as_given(&mixed), "{best_mixed}");
}

#[test]
fn random_points_come_in_an_order_that_keeps_neighbours_near() {
    let mut random = Random(3);
    let positions: Vec<Vec3> = (0..20_000)
        .map(|_| Vec3::new(random.unit(), random.unit(), random.unit()))
        .collect();
    // Sorted by x, so that only nodes within the radius are compared.
    let mut by_x = identity(positions.len());
    by_x.sort_by(|&a, &b| positions[a as usize].x.total_cmp(&positions[b as usize].x));
    let radius = 0.055;
    let mut springs = Vec::new();
    for (i, &a) in by_x.iter().enumerate() {
        let position = positions[a as usize];
        let near = by_x[i + 1..]
            .iter()
            .take_while(|&&b| positions[b as usize].x - position.x < radius);
        springs.extend(
            near.filter(|&&b| positions[b as usize].distance(position) < radius)
                .map(|&b| [a, b]),
        );
    }
    random.shuffle(&mut springs);
    let body = (positions, springs);
    let (given, best) = (cost_as_given(&body), best_cost(&body));
    assert!(best < 0.6 * given, "{best}, {given} as given");
}

#[test]
fn the_order_does_not_depend_on_the_run() {
    let body = mixed(&organ());
    assert_eq!(best(&body), best(&body));
}

/// Degenerate bodies that a definition may still describe.
fn nasty() -> Vec<(&'static str, TestBody)> {
    let count = 3000;
    let mut random = Random(11);
    let mut point = |scale: f32| Vec3::new(random.unit(), random.unit(), random.unit()) * scale;
    let somewhere: Vec<Vec3> = (0..count).map(|_| point(1.0)).collect();
    let on_a_line: Vec<Vec3> = (0..count)
        .map(|i| Vec3::new((i * 7 % count) as f32, 0.0, 0.0))
        .collect();
    let huge: Vec<Vec3> = (0..count).map(|_| point(2e30) - 1e30).collect();
    let mut an_outlier = somewhere.clone();
    an_outlier[5] = Vec3::splat(1e30);
    let tiny: Vec<Vec3> = (0..count).map(|_| point(1e-40)).collect();
    let pairs_double: Vec<Vec3> = (0..count).map(|i| somewhere[i / 2]).collect();

    let chain: Vec<[u32; 2]> = (1..count as u32).map(|n| [n - 1, n]).collect();
    let star: Vec<[u32; 2]> = (0..count as u32).filter(|&n| n != 9).map(|n| [9, n]).collect();
    let pairs: Vec<[u32; 2]> = (0..count as u32 / 4).map(|n| [4 * n, 4 * n + 3]).collect();
    let mut tangle = Vec::new();
    for i in 0..count as u32 {
        tangle.extend([[i, (i + 1) % count as u32], [i, (i * 37 + 5) % count as u32]]);
    }
    for spring in &mut tangle {
        spring.sort_unstable();
    }
    tangle.sort_unstable();
    tangle.dedup();
    tangle.retain(|[a, b]| a != b);

    let layouts = [
        ("somewhere", somewhere),
        ("all in one place", vec![Vec3::splat(3.0); count]),
        ("on a line", on_a_line),
        ("huge", huge),
        ("an outlier", an_outlier),
        ("tiny", tiny),
        ("doubled", pairs_double),
    ];
    let mut bodies = vec![
        ("nothing", (Vec::new(), Vec::new())),
        ("one node", (vec![Vec3::ONE], Vec::new())),
        ("one spring", (vec![Vec3::ONE, Vec3::ZERO], vec![[1, 0]])),
    ];
    for (name, positions) in layouts {
        for springs in [&chain, &star, &pairs, &tangle, &Vec::new()] {
            bodies.push((name, (positions.clone(), springs.clone())));
        }
    }
    bodies
}

#[test]
fn whatever_comes_in_the_order_has_every_node_once_and_costs_no_more() {
    for (name, body) in nasty() {
        for body in [mixed(&body), body] {
            if let Some(order) = best(&body) {
                let (best, given) = (cost_of(&order, &body), cost_as_given(&body));
                assert!(best < given, "{name}: {best}, {given} as given");
            }
        }
    }
}

#[test]
fn a_star_of_a_hundred_thousand_springs_is_ordered() {
    let positions: Vec<Vec3> = (0..100_001).map(|i| Vec3::new(i as f32, 0.0, 0.0)).collect();
    let springs: Vec<[u32; 2]> = (0..100_000).map(|n| [n, 100_000]).collect();
    best(&(positions, springs));
}

#[test]
fn chains_that_are_coincident_are_ordered_by_their_springs() {
    let count = 4000;
    let chain = (1..count).map(|n| [n - 1, n]).collect();
    let body = mixed(&(vec![Vec3::ZERO; count as usize], chain));
    // Two springs per node, and full runs except at the ends.
    assert!(best_cost(&body) < 1.03 * (2.0 * Costs::SHARED.run * f64::from(count) / 16.0));
}

#[test]
fn columns_are_counted_as_they_are_packed() {
    // Two blocks of sixteen, with each node joined to the one sixteen further on: one full run in each.
    let run: Vec<[u32; 2]> = (0..16).map(|n| [n, n + 16]).collect();
    let body = (vec![Vec3::ZERO; 32], run);
    assert_eq!(cost_as_given(&body), 2.0 * Costs::SHARED.run);
    // The blocks joined crosswise: no two offsets are equal, so there is one gather in each.
    let gather: Vec<[u32; 2]> = (0..16).map(|n| [n, 31 - n]).collect();
    let body = (vec![Vec3::ZERO; 32], gather);
    assert_eq!(cost_as_given(&body), 2.0 * Costs::SHARED.gather);
    // Three springs are too few for a gather, so each end is a stray.
    let strays = vec![[0, 31], [5, 20], [9, 30]];
    let body = (vec![Vec3::ZERO; 32], strays);
    assert_eq!(cost_as_given(&body), 6.0 * Costs::SHARED.stray);
}

#[test]
fn the_curve_passes_from_cell_to_neighbouring_cell() {
    // Nodes at the centers of the curve's cells, in a cube of 8 cells along each edge.
    let mut positions = Vec::new();
    for i in 0..512 {
        positions.push(Vec3::new((i % 8) as f32, (i / 8 % 8) as f32, (i / 64) as f32));
    }
    let order = along_curve(&positions).expect("memory for a test");
    for pair in order.windows(2) {
        let [a, b] = [pair[0], pair[1]].map(|node| positions[node as usize]);
        assert_eq!((a - b).abs().element_sum(), 1.0, "{a} to {b}");
    }
}
