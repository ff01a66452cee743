//! Terms beside springs in sheets that are cut: copies get their share, and severed terms are removed.

use glam::{Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::{Body, BodyDefinition, Solver, SpringLaw, Storage, Values, Viscosity, World, WorldDefinition, Yielding};

use super::motion::{across, in_flight_with};
use super::sheet::grid;
use crate::support::kept::kept;
use crate::support::scene::SOLVERS;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Beside {
    Home,
    Bending,
    Stiffening,
    Relaxing,
    Limited,
    Yielding,
}

const ALL: [Beside; 6] = [
    Beside::Home,
    Beside::Bending,
    Beside::Stiffening,
    Beside::Relaxing,
    Beside::Limited,
    Beside::Yielding,
];

impl Beside {
    fn with(self, definition: BodyDefinition) -> BodyDefinition {
        match self {
            Self::Home => BodyDefinition {
                home_stiffnesses: Values::Uniform(3.0),
                ..definition
            },
            Self::Bending => BodyDefinition {
                bending_stiffness: 1e-4,
                ..definition
            },
            Self::Stiffening => BodyDefinition {
                spring_law: SpringLaw::Cubic {
                    quadratic: 0.0,
                    cubic: 100.0,
                    limit: 0.5,
                },
                ..definition
            },
            Self::Relaxing => BodyDefinition {
                viscosity: Viscosity {
                    retardation_time: 0.02,
                    relaxation_time: 0.02,
                },
                ..definition
            },
            Self::Limited => BodyDefinition {
                strain_limit: 0.01,
                limit_stiffening: 20.0,
                ..definition
            },
            Self::Yielding => BodyDefinition {
                yielding: Yielding {
                    strain: 0.01,
                    largest: 0.3,
                },
                ..definition
            },
        }
    }
}

const CUTS: [(Vec3, Vec3); 4] = [
    (vec3(-0.01, 0.083, 0.0), vec3(0.11, 0.095, 0.0)),
    (vec3(0.11, 0.095, 0.0), vec3(0.22, 0.12, 0.0)),
    (vec3(0.052, -0.02, 0.0), vec3(0.049, 0.22, 0.0)),
    (vec3(0.1, 0.04, 0.0), vec3(0.17, 0.17, 0.0)),
];

/// Each term with one solver and storage, and each solver and storage with a term.
#[test]
fn cuts_in_motion_keep_the_energy_of_terms() {
    cuts_in_motion_keep_the_energy_of_terms_of(|case| case % 4 == 2);
}

#[test]
#[ignore = "long"]
fn cuts_in_motion_keep_the_energy_of_terms_in_the_other_cases() {
    cuts_in_motion_keep_the_energy_of_terms_of(|case| case % 4 != 2);
}

fn cuts_in_motion_keep_the_energy_of_terms_of(is_selected: fn(usize) -> bool) {
    for (number, beside) in (0..).zip(ALL) {
        for (_, (solver, storage)) in (number..)
            .zip([
                (Solver::Verlet, Storage::Packed),
                (Solver::Verlet, Storage::FastLink),
                (Solver::Implicit, Storage::DynamicBulk),
                (Solver::Newton, Storage::Packed),
            ])
            .filter(|case| is_selected(case.0))
        {
            let what = format!("{beside:?}, {solver:?}, {storage:?}");
            let (mut world, body) = in_flight_with(20, solver, storage, 0.0, |definition| beside.with(definition));
            for (from, to) in CUTS {
                for _ in 0..10 {
                    world.step(1e-3).unwrap();
                }
                let before = kept(&world, body);
                let sweep = across(world.body(body).unwrap(), from, to);
                assert!(world.cut(body, &sweep).unwrap().new_nodes > 0, "{what}");
                let after = kept(&world, body);
                after.check_motion(&before, &what);
                let gained = (after.energy - before.energy) / before.energy;
                assert!(gained < 1e-6, "{what}: {gained} of the energy comes in");
                // Hinges across the cut are removed.
                assert!(
                    gained > -1e-6 || beside == Beside::Bending,
                    "{what}: {gained} of the energy is lost"
                );
            }
            let at_end = kept(&world, body);
            for _ in 0..100 {
                world.step(1e-3).unwrap();
            }
            let later = kept(&world, body);
            assert!(
                later.energy < 1.02 * at_end.energy,
                "{what}: {} {}",
                at_end.energy,
                later.energy
            );
            if beside != Beside::Home {
                let error = later.momentum.distance(at_end.momentum);
                assert!(
                    error < 1e-4 * at_end.momentum.length(),
                    "{what}: momentum off by {error}"
                );
            }
        }
    }
}

fn elastic(world: &World, body: sinew::BodyId) -> f64 {
    world.body(body).unwrap().energy(Vec3::ZERO).elastic
}

/// Terms of springs follow their springs and the copies of these.
#[test]
fn springs_of_copies_have_their_terms() {
    for beside in [Beside::Stiffening, Beside::Limited, Beside::Bending] {
        let (mut world, body) = in_flight_with(20, Solver::Verlet, Storage::Packed, 0.0, |definition| {
            beside.with(definition)
        });
        for (from, to) in CUTS {
            for _ in 0..20 {
                world.step(1e-3).unwrap();
            }
            let sweep = across(world.body(body).unwrap(), from, to);
            world.cut(body, &sweep).unwrap();
        }
        for _ in 0..20 {
            world.step(1e-3).unwrap();
        }
        let whole = elastic(&world, body);
        let it = world.body_mut(body).unwrap();
        let pairs = it.spring_pairs().unwrap();
        if beside != Beside::Bending {
            let springs = it.springs(&pairs).unwrap();
            let twice: Vec<f32> = springs.iter().map(|spring| 2.0 * spring.stiffness).collect();
            it.set_springs(&pairs, Some(Values::Each(&twice)), None).unwrap();
            let doubled = elastic(&world, body);
            assert!(
                (doubled / whole - 2.0).abs() < 1e-5,
                "{beside:?}: {whole} to {doubled} J"
            );
        }
        let it = world.body_mut(body).unwrap();
        for [a, b] in pairs {
            it.remove_spring(a, b).unwrap();
        }
        assert_eq!(elastic(&world, body), 0.0, "{beside:?}");
    }
}

/// Returns a blade along an edge.
fn along(body: &Body, from: u32, to: u32) -> Sweep {
    let [from, to] = [from, to].map(|node| body.positions()[node as usize]);
    let direction = (to - from).normalize();
    let edge = |position: Vec3| [position - 0.05 * Vec3::Z, position + 0.05 * Vec3::Z];
    Sweep {
        start: edge(from - 0.02 * direction),
        end: edge(to + 0.02 * direction),
    }
}

#[test]
fn a_severed_fold_has_no_bending_force() {
    for solver in SOLVERS {
        let (rest, cells) = grid(6);
        let flat: Vec<Vec3> = rest
            .iter()
            .map(|position| 0.01 * vec3(position.x, position.y, 0.0))
            .collect();
        let folded: Vec<Vec3> = flat
            .iter()
            .map(|position| {
                let over = (position.y - 0.03).max(0.0);
                vec3(position.x, position.y - 0.2 * over, 0.6 * over)
            })
            .collect();
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            ..Default::default()
        })
        .unwrap();
        let definition = BodyDefinition {
            positions: &folded,
            rest_positions: Some(&flat),
            masses: Values::Uniform(1e-4),
            triangles: &cells,
            stiffnesses: Values::Uniform(50.0),
            bending_stiffness: 1e-4,
            spare_nodes: 400,
            solver,
            ..Default::default()
        };
        let body = world.create_body(&definition).unwrap();
        let before = elastic(&world, body);
        // A hinge rotates by asin(0.6).
        let turn: f64 = 0.6_f64.asin();
        assert!(before > 1e-4 * (0.5 * turn).sin().powi(2), "{before} J");
        let sweep = along(world.body(body).unwrap(), 21, 27);
        assert_eq!(world.cut(body, &sweep).unwrap().pieces_parted, 1);
        let after = elastic(&world, body);
        assert!(after < 1e-9 * before, "{solver:?}: {before} J before, {after} J after");
    }
}

/// If all nodes sink alike, their copies do too.
#[test]
fn copies_get_their_share_of_anchor_springs() {
    for solver in SOLVERS {
        let (rest, cells) = super::sheet::unstructured(10, 4);
        let positions: Vec<Vec3> = rest
            .iter()
            .map(|position| 0.01 * vec3(position.x, position.y, 0.0))
            .collect();
        let mut masses = vec![0.0; positions.len()];
        for cell in &cells {
            let [a, b, c] = cell.map(|node| positions[node as usize]);
            cell.iter()
                .for_each(|&node| masses[node as usize] += 0.5 * (b - a).cross(c - a).length() / 3.0);
        }
        let stiffnesses: Vec<f32> = masses.iter().map(|mass| 2000.0 * mass).collect();
        let mut world = World::new(WorldDefinition::default()).unwrap();
        let definition = BodyDefinition {
            positions: &positions,
            masses: Values::Each(&masses),
            triangles: &cells,
            stiffnesses: Values::Uniform(50.0),
            home_stiffnesses: Values::Each(&stiffnesses),
            spare_nodes: 1000,
            solver,
            ..Default::default()
        };
        let body = world.create_body(&definition).unwrap();
        let sink = vec3(0.0, -9.81 / 2000.0, 0.0);
        let lowered: Vec<Vec3> = positions.iter().map(|&position| position + sink).collect();
        world.body_mut(body).unwrap().set_positions(&lowered).unwrap();
        let edge = |x: f32, y: f32| [vec3(x, y, -0.05), vec3(x, y, 0.05)];
        let sweep = Sweep {
            start: edge(0.033, -0.02),
            end: edge(0.048, 0.12),
        };
        let report = world.cut(body, &sweep).unwrap();
        assert_eq!(report.pieces_parted, 1);
        let start = world.body(body).unwrap().positions().to_vec();
        for _ in 0..50 {
            world.step(2e-3).unwrap();
        }
        let displacements = world.body(body).unwrap().positions().iter().zip(&start);
        let most = displacements.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(most < 1e-6, "{solver:?}: a node goes {most} m");
    }
}
