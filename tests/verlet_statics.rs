//! Rest shapes that VERLET comes to under damping, against statics: chains, a catenary, patches of lattice and triangles
//! under even stress (Cauchy-Born), and that a body at rest keeps its shape for a million steps.

mod support;

use glam::{DMat3, DVec3, Vec3};
use sinew::{Kernel, WorldDefinition};
use support::bodies::{FREE, Parts, Random, Scene, largest_difference};

const G: f32 = 9.81;

fn gravity() -> WorldDefinition {
    WorldDefinition {
        gravity: Vec3::NEG_Y * G,
        ..FREE
    }
}

/// Damps all nodes by `rate` times their mass, 1/s.
fn damp(parts: &mut Parts, rate: f32) {
    for (damping, mass) in parts.node_dampings.iter_mut().zip(&parts.masses) {
        *damping = rate * mass;
    }
}

#[test]
fn a_chain_hangs_as_far_at_every_step() {
    let (links, mass, stiffness, spacing) = (10, 0.1_f32, 50.0_f32, 0.02_f32);
    let mut parts = Parts::chain(links + 1, Vec3::NEG_Y * spacing, mass, stiffness);
    parts.masses[0] = 0.0;
    parts.rest_lengths.fill(spacing);
    let extension = f64::from(mass) * f64::from(G) * (links * (links + 1)) as f64 / (2.0 * f64::from(stiffness));
    let length = f64::from(spacing) * links as f64;
    // The slowest mode has omega = 3.3 1/s. A node in f32 stops h omega² dx = rate ulp / 2 short of its place: the
    // shorter the step, the less the damping may be.
    for (h, rate, duration) in [
        (1.0_f32, 2.0_f32, 40.0_f32),
        (1.0 / 60.0, 2.0, 30.0),
        (5e-3, 1.0, 60.0),
        (1e-3, 0.2, 250.0),
    ] {
        damp(&mut parts, rate);
        let mut scene = Scene::new(&parts, gravity());
        scene.run(h, (duration / h).ceil() as usize);
        let tip = -scene.positions()[links].y - length;
        let error = tip / extension - 1.0;
        assert!(error.abs() < 1e-6, "h {h}: {error:e}");
        let held = scene.body().pin_force(0).expect("a pin");
        let weight = f64::from(G) * f64::from(mass) * links as f64;
        assert!((f64::from(held.y) / weight - 1.0).abs() < 1e-5, "{held} for {weight}");
    }
}

/// Where the nodes of a hanging chain are that starts at the origin, pulled there by (-horizontal, vertical): with
/// springs of stiffness k the i-th link carries the tension (H, V - i m g), and is L + T/k long.
fn catenary(horizontal: f64, vertical: f64, links: usize, weight: f64, rest: f64, stiffness: f64) -> Vec<DVec3> {
    let mut positions = vec![DVec3::ZERO];
    for link in 0..links {
        let tension = DVec3::new(horizontal, link as f64 * weight - vertical, 0.0);
        let length = rest + tension.length() / stiffness;
        positions.push(positions[link] + tension.normalize() * length);
    }
    positions
}

#[test]
fn a_chain_held_at_both_ends_hangs_as_the_discrete_catenary() {
    let (links, mass, stiffness, spacing) = (20, 0.01_f32, 400.0_f32, 0.05_f32);
    let span = DVec3::new(0.7, 0.1, 0.0).as_vec3().as_dvec3();
    let weight = f64::from(mass) * f64::from(G);
    let end = |h: f64, v: f64| catenary(h, v, links, weight, f64::from(spacing), f64::from(stiffness))[links] - span;
    // Newton's method for the force at the first end.
    let (mut horizontal, mut vertical) = (weight * 5.0, weight * 9.0);
    for _ in 0..60 {
        let (e, d) = (end(horizontal, vertical), 1e-6);
        let (dh, dv) = (
            (end(horizontal + d, vertical) - e) / d,
            (end(horizontal, vertical + d) - e) / d,
        );
        let determinant = dh.x * dv.y - dv.x * dh.y;
        horizontal -= (e.x * dv.y - dv.x * e.y) / determinant;
        vertical -= (dh.x * e.y - e.x * dh.y) / determinant;
    }
    assert!(end(horizontal, vertical).length() < 1e-12, "no catenary found");
    let expected = catenary(
        horizontal,
        vertical,
        links,
        weight,
        f64::from(spacing),
        f64::from(stiffness),
    );

    let mut parts = Parts::chain(links + 1, Vec3::X, mass, stiffness);
    for (i, position) in parts.positions.iter_mut().enumerate() {
        let along = i as f64 / links as f64;
        *position = (span * along - DVec3::Y * 1.4 * along * (1.0 - along)).as_vec3();
    }
    parts.rest_lengths.fill(spacing);
    parts.masses[0] = 0.0;
    parts.masses[links] = 0.0;
    damp(&mut parts, 2.0);
    let mut scene = Scene::new(&parts, gravity());
    scene.run(4e-3, 12_000);
    let error = largest_difference(&scene.positions(), &expected) / (f64::from(spacing) * links as f64);
    assert!(error < 1e-6, "{error:e}");
    let held = scene.body().pin_force(0).expect("a pin").as_dvec3();
    let force = DVec3::new(-horizontal, vertical, 0.0);
    assert!(held.distance(force) < 1e-4 * force.length(), "{held} for {force}");
}

/// The first Piola-Kirchhoff stress of a lattice under the deformation `f`, from the springs that a cell of volume
/// `volume` owns: `sum k (|F d| - |d|) / |F d| (F d) d^T / volume`.
fn stress(f: DMat3, springs: &[(DVec3, f64)], volume: f64) -> DMat3 {
    springs.iter().fold(DMat3::ZERO, |sum, &(d, stiffness)| {
        let stretched = f * d;
        let force = stretched * (stiffness * (1.0 - d.length() / stretched.length()));
        sum + DMat3::from_cols(force * d.x, force * d.y, force * d.z) * (1.0 / volume)
    })
}

/// The diagonal deformation with the stretch `stretch` along `axis` and no stress across it; `free` axes of three.
fn uniaxial(axis: usize, stretch: f64, free: &[usize], springs: &[(DVec3, f64)], volume: f64) -> DMat3 {
    let deformation = |across: f64| {
        let mut diagonal = DVec3::ONE;
        for &other in free {
            diagonal[other] = across;
        }
        diagonal[axis] = stretch;
        DMat3::from_diagonal(diagonal)
    };
    let (mut low, mut high) = (0.5, 1.5);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if stress(deformation(middle), springs, volume).col(free[0])[free[0]] > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    deformation(0.5 * (low + high))
}

/// Loads `parts` by `loads`, lets it come to rest: how far it then is from `expected`, but for its place, over its size.
fn error_at_rest(parts: &Parts, loads: &[DVec3], expected: impl Fn(DVec3) -> DVec3, h: f32, steps: usize) -> f64 {
    let nodes: Vec<u32> = (0..parts.positions.len() as u32).collect();
    let loads: Vec<Vec3> = loads.iter().map(|load| load.as_vec3()).collect();
    let mut scene = Scene::new(parts, FREE);
    for _ in 0..steps {
        scene.body_mut().apply_forces(&nodes, &loads).expect("forces");
        scene.step(h);
    }
    let expected: Vec<DVec3> = parts.positions.iter().map(|p| expected(p.as_dvec3())).collect();
    let mut reached = scene.positions();
    let shift = (expected.iter().sum::<DVec3>() - reached.iter().sum::<DVec3>()) / nodes.len() as f64;
    for position in &mut reached {
        *position += shift;
    }
    largest_difference(&reached, &expected) / parts.size()
}

/// The springs that a cell of the cubic lattice owns.
fn cubic_cell(spacing: f64, stiffness: f64) -> Vec<(DVec3, f64)> {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    [x, y, z, x + y, x - y, y + z, y - z, z + x, z - x]
        .map(|d| (d * spacing, stiffness))
        .to_vec()
}

#[test]
fn a_lattice_patch_stretches_as_its_lattice() {
    let (spacing, stiffness, cells) = (0.05_f32, 100.0_f32, 4);
    let a = f64::from(spacing);
    let springs = cubic_cell(a, f64::from(stiffness));
    let volume = a * a * a;

    // What the lattice is when strains are small, and how E shifts with them.
    let young = 5.0 * f64::from(stiffness) / (2.0 * a);
    for strain in [1e-5, -1e-5, 1e-3, -1e-3] {
        let f = uniaxial(0, 1.0 + strain, &[1, 2], &springs, volume);
        let measured = stress(f, &springs, volume).col(0).x / strain / young - 1.0;
        assert!(
            (measured - 0.7 * strain).abs() < 0.1 * strain.abs() + 1e-6,
            "{strain}: E shifts by {measured}"
        );
        let poisson = (1.0 - f.col(1).y) / strain;
        assert!((poisson - 0.25).abs() < 10.0 * strain.abs(), "nu {poisson}");
    }

    // Pulled alone: under a pressing load that keeps its direction a free body turns over.
    for stretch in [1.02, 1.08] {
        let f = uniaxial(0, stretch, &[1, 2], &springs, volume);
        let traction = stress(f, &springs, volume).col(0).x;
        let mut parts = Parts::block([cells; 3], spacing, 0.01, stiffness);
        damp(&mut parts, 15.0);
        let far = spacing * cells as f32;
        let edge = |x: f32| if x == 0.0 || x == far { 0.5 } else { 1.0 };
        let loads: Vec<DVec3> = parts
            .positions
            .iter()
            .map(|p| {
                let outward = if p.x == 0.0 {
                    -1.0
                } else {
                    f64::from(u8::from(p.x == far))
                };
                DVec3::X * (outward * traction * a * a * edge(p.y) * edge(p.z))
            })
            .collect();
        let error = error_at_rest(&parts, &loads, |p| f * p, 4e-3, 1500);
        assert!(error < 1e-5, "stretched {stretch}: {error:e}");
    }
}

/// A patch of equilateral triangles; each owns half of its springs.
fn triangle_patch(cells: usize, side: f64, stiffness: f32) -> (Parts, Vec<[usize; 3]>) {
    let corner = |x: usize, y: usize| y * (cells + 1) + x;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for y in 0..=cells {
        for x in 0..=cells {
            let place = DVec3::new(x as f64 + 0.5 * y as f64, 0.75_f64.sqrt() * y as f64, 0.0);
            positions.push((place * side).as_vec3());
            if x < cells && y < cells {
                triangles.push([corner(x, y), corner(x + 1, y), corner(x, y + 1)]);
                triangles.push([corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)]);
            }
        }
    }
    let mut parts = Parts::nodes(positions, 0.01);
    let mut shares = std::collections::BTreeMap::new();
    for [a, b, c] in &triangles {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            *shares.entry([*a.min(b), *a.max(b)]).or_insert(0.0) += 0.5;
        }
    }
    for ([a, b], share) in shares {
        parts.join(a, b, share * stiffness);
    }
    (parts, triangles)
}

#[test]
fn a_triangle_patch_stretches_as_its_lattice() {
    let (cells, side, stiffness) = (6, 0.05, 100.0_f32);
    let (mut parts, triangles) = triangle_patch(cells, side, stiffness);
    damp(&mut parts, 10.0);
    // A node owns three directions, and the area of two triangles.
    let area = 0.75_f64.sqrt() * side * side;
    let directions = [0.0_f64, 60.0, 120.0].map(|degrees| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        (DVec3::new(cosine, sine, 0.0) * side, f64::from(stiffness))
    });
    let stiff = 2.0 * f64::from(stiffness) / 3.0_f64.sqrt();
    for (axis, other) in [(0, 1), (1, 0)] {
        let f = uniaxial(axis, 1.0 + 1e-5, &[other], &directions, area);
        let measured = stress(f, &directions, area).col(axis)[axis] / 1e-5;
        assert!((measured / stiff - 1.0).abs() < 1e-4, "E t {measured} for {stiff}");
        let poisson = (1.0 - f.col(other)[other]) / 1e-5;
        assert!((poisson - 1.0 / 3.0).abs() < 1e-4, "nu {poisson}");

        for stretch in [1.02, 1.06] {
            let f = uniaxial(axis, stretch, &[other], &directions, area);
            let stress = stress(f, &directions, area);
            // What an even stress does to the corners of each triangle: P times half the opposite side's normal.
            let mut loads = vec![DVec3::ZERO; parts.positions.len()];
            for triangle in &triangles {
                for corner in 0..3 {
                    let [from, to] = [1, 2].map(|next| parts.positions[triangle[(corner + next) % 3]].as_dvec3());
                    let side = to - from;
                    loads[triangle[corner]] += stress * DVec3::new(-side.y, side.x, 0.0) * 0.5;
                }
            }
            let error = error_at_rest(&parts, &loads, |p| f * p, 4e-3, 2500);
            assert!(error < 1e-5, "axis {axis}, stretched {stretch}: {error:e}");
        }
    }
}

#[test]
fn a_free_body_at_rest_keeps_its_shape_for_a_million_steps() {
    // What `x += h v` rounds away is 4e-9 m a step, and adds up in vibrations that nothing ends, and in a
    // slow way through space.
    for (rate, bound) in [(0.0, 3e-4), (0.1, 2e-5), (1.0, 5e-6)] {
        for kernel in [Kernel::Best, Kernel::Portable] {
            let mut parts = Parts::block([1, 1, 2], 0.0371, 0.01, 100.0);
            let mut random = Random::new(90);
            for position in &mut parts.positions {
                *position += 0.004 * random.vector();
            }
            for ([a, b], rest_length) in parts.springs.iter().zip(&mut parts.rest_lengths) {
                *rest_length = parts.positions[*a as usize].distance(parts.positions[*b as usize]);
            }
            damp(&mut parts, rate);
            let mut scene = Scene::new(&parts, WorldDefinition { kernel, ..FREE });
            let rest = scene.positions();
            scene.run(1e-3, 1_000_000);
            let now = scene.positions();
            let stretch = parts
                .springs
                .iter()
                .zip(&parts.rest_lengths)
                .map(|([a, b], rest_length)| {
                    let length = now[*a as usize].distance(now[*b as usize]);
                    (length / f64::from(*rest_length) - 1.0).abs()
                });
            let stretch = stretch.fold(0.0, f64::max);
            let moved = largest_difference(&now, &rest) / parts.size();
            let named = format!("{kernel:?}, damped at {rate}/s: stretched by {stretch:e}, moved by {moved:e}");
            assert!(stretch < bound && moved < 1e-4, "{named}");
        }
    }
}

#[test]
fn a_hanging_body_keeps_its_rest_shape_for_a_million_steps() {
    let mut parts = Parts::block([1, 1, 2], 0.0371, 0.01, 100.0);
    for (position, mass) in parts.positions.iter().zip(&mut parts.masses) {
        if position.z == 0.0 {
            *mass = 0.0;
        }
    }
    damp(&mut parts, 20.0);
    let mut scene = Scene::new(&parts, gravity());
    scene.run(1e-3, 3000);
    let rest = scene.positions();
    scene.run(1e-3, 1_000_000);
    let error = largest_difference(&scene.positions(), &rest) / parts.size();
    assert!(error < 1e-6, "{error:e}");
}
