//! Rest shapes of IMPLICIT and NEWTON under damping, and static equilibria, against statics: a catenary, patches of
//! lattice and triangles under uniform stress (Cauchy-Born). Hanging chains are in `implicit.rs`, `newton.rs` and
//! `rest_state.rs`.

use std::ops::Range;

use crate::support::bodies::{FREE, Parts, Scene};
use crate::support::statics::{Catenary, G, Patch, damp};
use glam::Vec3;
use sinew::{BodyDefinition, RestStateDefinition, Solver, Storage, WorldDefinition};

/// A solver and a storage for each case: every solver with two storages, by motion or by a search for equilibrium.
const CASES: [(Solver, Storage, bool); 8] = [
    (Solver::Implicit, Storage::Packed, true),
    (Solver::Implicit, Storage::FastLink, true),
    (Solver::Implicit, Storage::Efficient, true),
    (Solver::Implicit, Storage::DynamicBulk, true),
    (Solver::Newton, Storage::Packed, true),
    (Solver::Newton, Storage::DynamicBulk, true),
    (Solver::Verlet, Storage::Efficient, false),
    (Solver::Implicit, Storage::Packed, false),
];

/// Returns the body after this many frames, or in static equilibrium, under `load`.
fn settled(
    parts: &Parts,
    gravity: Vec3,
    frames: usize,
    (solver, storage, moves): (Solver, Storage, bool),
    load: impl Fn(&mut Scene),
) -> Scene {
    let mut scene = Scene::with(parts, WorldDefinition { gravity, ..FREE }, |definition| {
        BodyDefinition {
            solver,
            storage,
            ..definition
        }
    });
    if moves {
        for _ in 0..frames {
            load(&mut scene);
            scene.step(1.0 / 60.0);
        }
    } else {
        load(&mut scene);
        let found = scene.world.rest_state(scene.id, &RestStateDefinition::default());
        found.expect("a state of rest");
    }
    scene
}

#[test]
fn a_chain_held_at_both_ends_is_a_discrete_catenary() {
    let mut chain = Catenary::new();
    damp(&mut chain.parts, 2.0);
    for case in CASES {
        let scene = settled(&chain.parts, Vec3::NEG_Y * G, 1200, case, |_| {});
        let error = chain.error_of(&scene);
        assert!(error < 1e-6, "{case:?}: {error:.2e}");
    }
}

#[test]
fn patches_stretch_like_their_lattices() {
    patches_stretch_like_their_lattices_of(0..1);
}

#[test]
#[ignore = "long"]
fn patches_stretch_like_their_lattices_in_the_other_cases() {
    patches_stretch_like_their_lattices_of(1..3);
}

fn patches_stretch_like_their_lattices_of(cases: Range<usize>) {
    for (name, mut patch) in [
        ("lattice", Patch::lattice(1.08)),
        ("triangles along x", Patch::triangles(0, 1, 1.06)),
        ("triangles along y", Patch::triangles(1, 0, 1.06)),
    ]
    .into_iter()
    .take(cases.end)
    .skip(cases.start)
    {
        damp(&mut patch.parts, 10.0);
        for case in CASES {
            let scene = settled(&patch.parts, Vec3::ZERO, 600, case, |scene| patch.load(scene));
            let error = patch.error_of(&scene);
            assert!(error < 1e-5, "{name}, {case:?}: {error:.2e}");
        }
    }
}
