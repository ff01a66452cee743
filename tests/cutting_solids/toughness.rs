//! Blades in tough solids: the work of a stroke, and the momentum it transfers.

use glam::{Vec3, vec3};
use sinew::{BodyDefinition, BodyId, Material, Model, Solver, Values, World, WorldDefinition};

use super::block::{shaken, upright};
use crate::support::kept::kept;
use crate::support::stroke::{Stroke, blade_at};

/// J/m².
const TOUGHNESS: f32 = 2.0;

/// A block of 6, 5 and 4 cm in cells of 1 cm, with a density of 1000 kg/m³.
#[derive(Clone, Copy)]
struct Block {
    solver: Solver,
    has_elements: bool,
    /// For cells of springs.
    volume_stiffness: f32,
    /// True if its sides along y are held.
    is_held: bool,
    toughness: f32,
    spare: u32,
    damping: f32,
    thread_count: u32,
    mass_scaling: f32,
}

impl Block {
    const HELD: Self = Self {
        solver: Solver::Verlet,
        has_elements: true,
        volume_stiffness: 0.0,
        is_held: true,
        toughness: TOUGHNESS,
        spare: 6000,
        damping: 40.0,
        thread_count: 1,
        mass_scaling: 0.0,
    };

    fn world(&self) -> (World, BodyId) {
        let (rest, cells) = shaken([6, 5, 4], 3);
        let cells: Vec<[u32; 4]> = cells.iter().map(|&cell| upright(&rest, cell)).collect();
        let positions: Vec<Vec3> = rest.iter().map(|&position| 0.01 * position).collect();
        let node_mass = 0.12 / positions.len() as f32;
        let is_side = |position: &Vec3| position.y < 1e-4 || position.y > 0.0499;
        let masses: Vec<f32> = positions
            .iter()
            .map(|position| {
                if self.is_held && is_side(position) {
                    0.0
                } else {
                    node_mass
                }
            })
            .collect();
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            thread_count: self.thread_count,
            ..Default::default()
        })
        .unwrap();
        let definition = BodyDefinition {
            positions: &positions,
            masses: Values::Each(&masses),
            node_dampings: Values::Uniform(self.damping * node_mass),
            tetrahedra: &cells,
            spare_nodes: self.spare,
            toughness: self.toughness,
            solver: self.solver,
            mass_scaling: self.mass_scaling,
            ..Default::default()
        };
        let definition = if self.has_elements {
            BodyDefinition {
                material: Some(Material {
                    model: Model::Tetrahedra,
                    young_modulus: 3000.0,
                    poisson_ratio: 0.3,
                    ..Default::default()
                }),
                ..definition
            }
        } else {
            BodyDefinition {
                stiffnesses: Values::Uniform(20.0),
                volume_stiffness: self.volume_stiffness,
                ..definition
            }
        };
        let body = world.create_body(&definition).unwrap();
        (world, body)
    }

    /// Returns the stable substep in the first frame and its minimum (s), while a stiff blade whose edge ends inside is
    /// drawn through.
    fn first_and_least_substep(&self) -> (f32, f32) {
        let (mut world, _) = self.world();
        let path = [vec3(-0.01, 0.023, 0.02), vec3(0.09, 0.027, 0.02)];
        let blade = blade_at(&mut world, 3000.0, path[0], [vec3(0.0, 0.0, -0.04), Vec3::ZERO]);
        let (mut first, mut least, mut area) = (0.0, f32::INFINITY, 0.0);
        for step in 1..=120 {
            let position = path[0].lerp(path[1], step as f32 / 120.0);
            world.set_blade_pose(blade, position, None).unwrap();
            let report = world.step(1.0 / 60.0).unwrap();
            if step == 1 {
                first = report.stable_substep;
            }
            least = least.min(report.stable_substep);
            area += world.blade_report(blade).unwrap().area;
        }
        assert!(area > 3e-4, "{area} m²");
        (first, least)
    }
}

/// An edge of 8 cm along z about its own origin, at mid-height of the block.
const THROUGH: [Vec3; 2] = [vec3(0.0, 0.0, -0.04), vec3(0.0, 0.0, 0.04)];

#[test]
fn the_work_of_a_stroke_is_toughness_times_area() {
    the_work_of_a_stroke_is_toughness_times_area_of(&[
        (Solver::Verlet, true, 60),
        (Solver::Verlet, true, 1000),
        (Solver::Implicit, false, 250),
    ]);
}

#[test]
#[ignore = "long"]
fn the_work_of_a_stroke_is_toughness_times_area_in_the_other_cases() {
    the_work_of_a_stroke_is_toughness_times_area_of(&[
        (Solver::Verlet, true, 250),
        (Solver::Verlet, true, 2000),
        (Solver::Verlet, true, 4000),
        (Solver::Verlet, false, 250),
        (Solver::Implicit, true, 250),
    ]);
}

fn the_work_of_a_stroke_is_toughness_times_area_of(cases: &[(Solver, bool, usize)]) {
    for &(solver, has_elements, steps) in cases {
        let block = Block {
            solver,
            has_elements,
            ..Block::HELD
        };
        let (mut world, body) = block.world();
        let path = [vec3(-0.01, 0.023, 0.021), vec3(0.08, 0.027, 0.021)];
        let blade = blade_at(&mut world, 100.0, path[0], THROUGH);
        let mut stroke = Stroke::default();
        stroke.draw(&mut world, blade, path, steps, 1.5 / steps as f32);
        let spent = f64::from(TOUGHNESS) * stroke.area;
        let what = format!(
            "{solver:?}, elements {has_elements}, {steps} steps: work {:.6} J, told {:.6}, opened {:.6} m², ratio {:.4}, jump {:.4}",
            stroke.work,
            stroke.told,
            stroke.area,
            stroke.work / spent,
            stroke.largest_jump(),
        );
        assert!((stroke.work / spent - 1.0).abs() < 0.05, "{what}");
        assert!((stroke.told / stroke.work - 1.0).abs() < 1e-3, "{what}");
        assert!((stroke.area / 2.4e-3 - 1.0).abs() < 0.05, "{what}");
        assert_eq!(stroke.refused, 0);
        assert_eq!(world.body(body).unwrap().pieces().unwrap().count, 2, "{what}");
        assert_eq!(*stroke.forces.last().unwrap(), Vec3::ZERO, "{what}");
    }
}

#[test]
fn a_stroke_that_ends_inside_costs_its_opened_area() {
    // The softer the tissue is relative to its toughness, the more energy it has stored where it slips off the end of
    // the edge: that energy is lost.
    for (solver, has_elements, toughness, depth, lost) in [
        (Solver::Verlet, true, TOUGHNESS, 0.02, 0.0),
        (Solver::Verlet, true, TOUGHNESS, 0.014, 0.0),
        (Solver::Verlet, true, TOUGHNESS, 0.026, 0.0),
        (Solver::Verlet, false, TOUGHNESS, 0.02, 0.0),
        (Solver::Implicit, true, TOUGHNESS, 0.02, 0.0),
        (Solver::Verlet, true, 5.0 * TOUGHNESS, 0.02, 0.05),
    ] {
        let block = Block {
            toughness,
            solver,
            has_elements,
            ..Block::HELD
        };
        let (mut world, body) = block.world();
        let path = [vec3(-0.01, 0.023, 0.02), vec3(0.08, 0.027, 0.02)];
        let edge = [vec3(0.0, 0.0, -0.04), vec3(0.0, 0.0, depth - 0.02)];
        let blade = blade_at(&mut world, 500.0, path[0], edge);
        let mut stroke = Stroke::default();
        stroke.draw(&mut world, blade, path, 300, 3.0 / 300.0);
        let cost = stroke.work / (f64::from(toughness) * stroke.area);
        let opened = stroke.area / (0.06 * f64::from(depth));
        let what = format!(
            "{solver:?}, elements {has_elements}, toughness {toughness}, depth {depth}: {cost} of the opened area, {opened} of the swept area"
        );
        assert!(cost > 0.97 && cost < 1.03 + lost, "{what}");
        // Whole cells open: along the end of the edge, up to one cell is left.
        assert!(opened > 0.5 && opened < 1.03, "{what}");
        assert_eq!(world.body(body).unwrap().pieces().unwrap().count, 1, "{what}");
        assert_eq!(*stroke.forces.last().unwrap(), Vec3::ZERO, "{what}");
    }
}

/// Toughness over Young's modulus is two cells: the edge compresses the cells around it before they separate. With
/// added mass for these cells, the stable substep stays above half of its value at rest.
#[test]
fn soft_tough_tissue_keeps_half_of_its_stable_substep() {
    let springs = Block {
        has_elements: false,
        volume_stiffness: 5000.0,
        toughness: 200.0,
        ..Block::HELD
    };
    let elements = Block {
        toughness: 60.0,
        ..Block::HELD
    };
    for (block, what) in [
        (elements, "elements"),
        (springs, "springs whose cells keep their volume"),
    ] {
        let [bare, scaled] = [0.0, 0.02].map(|mass_scaling| {
            let (first, least) = Block { mass_scaling, ..block }.first_and_least_substep();
            least / first
        });
        assert!(
            scaled > 0.5 && bare < 0.5,
            "{what}: {scaled} of it, {bare} without mass"
        );
    }
}

#[test]
fn the_jumps_of_the_force_halve_with_the_step() {
    // Soft enough for several steps of 8 ms before it cuts; a step of each length ends at the skin.
    let jumps: Vec<f32> = [8e-3, 4e-3, 2e-3, 1e-3]
        .into_iter()
        .map(|dt: f32| {
            let (mut world, _) = Block::HELD.world();
            let start = -0.05 * 0.024 + 1e-6;
            let path = [vec3(start, 0.023, 0.021), vec3(start + 0.04, 0.026, 0.021)];
            let blade = blade_at(&mut world, 10.0, path[0], THROUGH);
            let mut stroke = Stroke::default();
            stroke.draw(&mut world, blade, path, (0.8 / dt).round() as usize, dt);
            assert!(stroke.area > 5e-4, "{} m²", stroke.area);
            stroke.largest_jump()
        })
        .collect();
    for pair in jumps.windows(2) {
        assert!(pair[1] < 0.6 * pair[0], "{jumps:?} N");
    }
}

#[test]
fn a_free_block_gets_the_momentum_and_at_most_the_work() {
    a_free_block_gets_the_momentum_and_at_most_the_work_of(&[(Solver::Verlet, true)]);
}

#[test]
#[ignore = "long"]
fn a_free_block_gets_the_momentum_and_at_most_the_work_in_the_other_cases() {
    a_free_block_gets_the_momentum_and_at_most_the_work_of(&[
        (Solver::Verlet, false),
        (Solver::Implicit, true),
        (Solver::Newton, true),
    ]);
}

fn a_free_block_gets_the_momentum_and_at_most_the_work_of(cases: &[(Solver, bool)]) {
    for &(solver, has_elements) in cases {
        let block = Block {
            is_held: false,
            toughness: 0.5,
            damping: 0.0,
            solver,
            has_elements,
            ..Block::HELD
        };
        let (mut world, body) = block.world();
        let path = [vec3(-0.01, 0.018, 0.035), vec3(0.05, 0.022, 0.035)];
        // Not all the way through.
        let edge = [vec3(0.0, 0.0, -0.02), vec3(0.0, 0.0, 0.03)];
        let blade = blade_at(&mut world, 100.0, path[0], edge);
        let mut stroke = Stroke::default();
        stroke.draw(&mut world, blade, path, 150, 0.5e-3);
        let kept = kept(&world, body);
        let spent = f64::from(block.toughness) * stroke.area;
        let what = format!(
            "{solver:?}, elements {has_elements}: work {:.3e} J, {spent:.3e} cut, {:.3e} kept; momentum {:?}, impulse {:?}; {:?} {:?}",
            stroke.work, kept.energy, kept.momentum, stroke.impulse, kept.spin, stroke.spin,
        );
        assert!(
            kept.momentum.distance(stroke.impulse) <= 1e-4 * stroke.impulse.length(),
            "{what}"
        );
        assert!(kept.spin.distance(stroke.spin) <= 1e-2 * stroke.spin.length(), "{what}");
        // The opened area lags behind the paid work.
        assert!(
            stroke.area > 2e-4 && stroke.work >= 0.95 * spent + kept.energy,
            "{what}"
        );
    }
}

#[test]
fn blade_resistance_is_the_same_for_any_number_of_threads() {
    let [one, three] = [1, 3].map(|thread_count| {
        let (mut world, body) = Block {
            thread_count,
            ..Block::HELD
        }
        .world();
        let path = [vec3(-0.01, 0.023, 0.021), vec3(0.04, 0.027, 0.021)];
        let blade = blade_at(&mut world, 100.0, path[0], THROUGH);
        let mut stroke = Stroke::default();
        stroke.draw(&mut world, blade, path, 60, 5e-3);
        (
            world.state_hash(),
            stroke.forces,
            world.body(body).unwrap().positions().to_vec(),
        )
    });
    assert_eq!(one, three);
}

#[test]
fn without_capacity_a_blade_stays_and_the_block_is_unchanged() {
    let (mut world, body) = Block {
        spare: 5,
        ..Block::HELD
    }
    .world();
    let triangles = world.body(body).unwrap().surface().to_vec();
    let path = [vec3(-0.01, 0.023, 0.021), vec3(0.05, 0.027, 0.021)];
    let blade = blade_at(&mut world, 20.0, path[0], THROUGH);
    let mut stroke = Stroke::default();
    stroke.draw(&mut world, blade, path, 100, 5e-3);
    assert!(stroke.refused > 20 && stroke.area == 0.0);
    assert_eq!(world.body(body).unwrap().surface(), triangles);
    // It still resists, with no more force than if it were cut.
    let force = stroke.forces.last().unwrap().length();
    let most = 0.04 * TOUGHNESS;
    assert!(force > 0.2 * most && force < 1.3 * most, "{force} N");
}
