//! Rest shapes of VERLET under damping, against statics: chains, a catenary, patches of lattice and triangles under
//! uniform stress (Cauchy-Born). A body at rest keeps its shape for a million steps.

use crate::support::bodies::{FREE, Parts, Random, Scene, largest_difference};
use crate::support::statics::{Catenary, G, Patch, cubic_cell, damp, hanging_chain, stress, triangle_cell, uniaxial};
use glam::Vec3;
use sinew::{BodyDefinition, Kernel, Storage, WorldDefinition};

fn gravity() -> WorldDefinition {
    WorldDefinition {
        gravity: Vec3::NEG_Y * G,
        ..FREE
    }
}

#[test]
fn a_chain_has_the_same_sag_for_every_step() {
    let (links, mass, spacing) = (10, 0.1_f32, 0.02_f32);
    let (mut parts, extension) = hanging_chain(links, spacing, mass, 50.0);
    let length = f64::from(spacing) * links as f64;
    // The slowest mode has omega = 3.3 1/s. A node in `f32` stops h omega² dx = rate ulp / 2 short of its rest
    // position: shorter steps need less damping.
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

/// The chain that IMPLICIT, NEWTON and static equilibria are also tested with. Its slowest mode has omega = 2.7 1/s.
#[test]
fn a_chain_of_forty_has_the_same_sag_in_every_storage() {
    let (links, spacing) = (40, 0.1_f32);
    let (mut parts, extension) = hanging_chain(links, spacing, 0.01, 50.0);
    damp(&mut parts, 2.0);
    for storage in [
        Storage::Packed,
        Storage::Efficient,
        Storage::FastLink,
        Storage::DynamicBulk,
    ] {
        for h in [1.0_f32, 0.1, 1.0 / 60.0, 5e-3] {
            let mut scene = Scene::with(&parts, gravity(), |definition| BodyDefinition { storage, ..definition });
            scene.run(h, (30.0 / h) as usize);
            let tip = -scene.positions()[links].y - f64::from(spacing) * links as f64;
            let error = (tip / extension - 1.0).abs();
            assert!(error < 2e-5, "{storage:?}, {h} s: {error:.2e}");
        }
    }
}

#[test]
fn a_chain_held_at_both_ends_is_a_discrete_catenary() {
    let mut chain = Catenary::new();
    damp(&mut chain.parts, 2.0);
    let mut scene = Scene::new(&chain.parts, gravity());
    scene.run(4e-3, 12_000);
    let error = chain.error_of(&scene);
    assert!(error < 1e-6, "{error:e}");
}

/// Loads a patch, lets it come to rest, and returns its distance from the expected deformation.
fn error_at_rest(patch: &Patch, h: f32, steps: usize) -> f64 {
    let mut scene = Scene::new(&patch.parts, FREE);
    for _ in 0..steps {
        patch.load(&mut scene);
        scene.step(h);
    }
    patch.error_of(&scene)
}

#[test]
fn a_lattice_patch_stretches_by_its_moduli() {
    let (spacing, stiffness) = (0.05_f64, 100.0);
    let springs = cubic_cell(spacing, stiffness);
    let volume = spacing.powi(3);

    // The moduli of the lattice at small strains, and the shift of E with strain.
    let young = 5.0 * stiffness / (2.0 * spacing);
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

    for stretch in [1.02, 1.08] {
        let mut patch = Patch::lattice(stretch);
        damp(&mut patch.parts, 15.0);
        let error = error_at_rest(&patch, 4e-3, 1500);
        assert!(error < 1e-5, "stretched {stretch}: {error:e}");
    }
}

#[test]
fn a_triangle_patch_stretches_by_its_moduli() {
    let (side, stiffness) = (0.05, 100.0);
    let (directions, area) = triangle_cell(side, stiffness);
    let stiff = 2.0 * stiffness / 3.0_f64.sqrt();
    for (axis, other) in [(0, 1), (1, 0)] {
        let f = uniaxial(axis, 1.0 + 1e-5, &[other], &directions, area);
        let measured = stress(f, &directions, area).col(axis)[axis] / 1e-5;
        assert!((measured / stiff - 1.0).abs() < 1e-4, "E t {measured} for {stiff}");
        let poisson = (1.0 - f.col(other)[other]) / 1e-5;
        assert!((poisson - 1.0 / 3.0).abs() < 1e-4, "nu {poisson}");

        for stretch in [1.02, 1.06] {
            let mut patch = Patch::triangles(axis, other, stretch);
            damp(&mut patch.parts, 10.0);
            let error = error_at_rest(&patch, 4e-3, 2500);
            assert!(error < 1e-5, "axis {axis}, stretched {stretch}: {error:e}");
        }
    }
}

#[test]
#[ignore = "long"]
fn a_free_body_at_rest_keeps_its_shape_for_a_million_steps() {
    // `x += h v` rounds by 4e-9 m per step; these errors add up to undamped vibrations and to a slow drift through
    // space.
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
fn a_hanging_body_keeps_its_rest_shape() {
    a_hanging_body_keeps_its_rest_shape_for(200_000);
}

#[test]
#[ignore = "long"]
fn a_hanging_body_keeps_its_rest_shape_for_a_million_steps() {
    a_hanging_body_keeps_its_rest_shape_for(1_000_000);
}

fn a_hanging_body_keeps_its_rest_shape_for(steps: usize) {
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
    scene.run(1e-3, steps);
    let error = largest_difference(&scene.positions(), &rest) / parts.size();
    assert!(error < 1e-6, "{error:e}");
}
