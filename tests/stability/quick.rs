//! A part of the table of stability. Each case runs with each solver, or with the first ones if the others are slow, at
//! one step, which varies from case to case. A long test runs the remainder, with NEWTON at that one step alone. Each
//! step has one of the storages. `cargo bench --bench stability` runs everything.

use crate::stability::{CASES, PENDING, SOLVERS, STEPS, STORAGES, Setup, Stop, Tier, Verdict};
use sinew::Solver;

/// Runs a line of the table with this many solvers at one step, or all the remaining ones, and reports all unexpected
/// results together.
fn check(name: &str, solvers: usize, is_rest: bool) {
    let line = CASES
        .iter()
        .position(|case| case.name == name)
        .expect("a line of the table");
    let case = &CASES[line];
    let mut wrong = Vec::new();
    // Advancing five steps per line equals going back by one: STEPS has six.
    for (number, (solver, first)) in SOLVERS.into_iter().zip([line, line + 2, 5 * line]).enumerate() {
        // NEWTON is slow: one of the steps for each line.
        let steps = if solver == Solver::Newton { 1 } else { STEPS.len() };
        for index in (0..steps).filter(|&index| (index > 0 || number >= solvers) == is_rest) {
            let index = (first + index) % STEPS.len();
            let setup = Setup {
                solver,
                storage: STORAGES[(line + index) % STORAGES.len()],
                step: STEPS[index],
                tier: Tier::Quick,
            };
            let verdict = Verdict::of(case, &setup);
            if !verdict.is_expected(&setup) {
                wrong.push(format!("{setup:?}: {verdict}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{name}\n{}", wrong.join("\n"));
}

macro_rules! lines {
    ($($test:ident: $name:literal, $solvers:literal;)*) => {
        $(
            #[test]
            fn $test() {
                check($name, $solvers, false);
            }
        )*

        mod at_other_steps {
            use super::check;

            $(
                #[test]
                #[ignore = "long"]
                fn $test() {
                    check($name, $solvers, true);
                }
            )*
        }

        #[test]
        fn every_line_of_the_table_is_run() {
            let tried = [$($name),*];
            for case in &CASES {
                assert!(tried.contains(&case.name), "{}", case.name);
            }
        }
    };
}

lines! {
    scattered: "scattered at random", 2;
    flattened: "flattened to a plane", 2;
    collapsed: "collapsed to a point", 2;
    scattered_large: "scattered, 9261 nodes", 2;
    coincident: "nodes in one place, springs without length", 2;
    stiffness_in_a_chain: "stiffness 1 : 1e6 in a chain", 3;
    stiffness_in_a_block: "stiffness 1 : 1e6 in a block", 2;
    masses: "masses 1 : 1e6", 3;
    above_the_limit: "a step far above the limit", 3;
    rotated: "started rotated", 2;
    reordered: "tetrahedra reordered", 3;
    inverted: "tetrahedra inverted", 3;
    far_from_the_origin: "10 km from the origin", 3;
    pin_let_go: "a pin stretched and let go", 3;
    pin_jumps: "a pin moved 100 cells in a step", 3;
    crushed: "crushed between two tools", 1;
    pushed: "1e6 N on a node for a step", 3;
    springs_removed: "springs removed in motion", 2;
    changing_steps: "steps of changing length", 2;
    a_million_steps: "a million steps", 2;
}

/// Lists pending features for the report: once a solver is available it takes part, and its line is removed.
#[test]
fn pending_features_are_reported() {
    let setup = |solver| Setup {
        solver,
        storage: STORAGES[0],
        step: 1e-3,
        tier: Tier::Quick,
    };
    let case = CASES
        .iter()
        .find(|case| case.name == "tetrahedra inverted")
        .expect("a case");
    let mut lines = Vec::new();
    for solver in SOLVERS {
        if let Err(Stop::Unsupported(why)) = Verdict::of(case, &setup(solver)).outcome {
            assert_ne!(solver, Solver::Verlet);
            lines.push(format!("every case with {solver:?}: {why}"));
        }
    }
    for (name, what) in PENDING {
        assert!(CASES.iter().any(|case| case.name == name), "{name}");
        lines.push(format!("{name}: {what}"));
    }
    crate::support::report_pending("Stability", &lines);
}

/// A few seconds of long runs.
mod long_runs {
    use crate::stability::long_runs::{Activity, found, quick};
    use glam::Vec3;
    use sinew::Solver;

    /// Runs these rows, selected by their numbers.
    fn check(solver: Solver, is_selected: fn(usize) -> bool) {
        let mut wrong = Vec::new();
        let rows = quick().into_iter().filter(|(row, _)| row.solver == solver);
        for (_, (row, seconds)) in rows.enumerate().filter(|row| is_selected(row.0)) {
            let outcome = row.run(seconds, f64::INFINITY, &mut |_| {});
            if outcome.has_failed() {
                wrong.push(format!("{row}: {outcome}"));
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    fn verlet() {
        check(Solver::Verlet, |row| row % 4 == 0);
    }

    #[test]
    fn implicit() {
        check(Solver::Implicit, |row| row % 8 == 0);
    }

    #[test]
    fn newton() {
        check(Solver::Newton, |_| true);
    }

    #[test]
    #[ignore = "long"]
    fn other_rows_of_verlet() {
        check(Solver::Verlet, |row| row % 4 != 0);
    }

    #[test]
    #[ignore = "long"]
    fn other_rows_of_implicit() {
        check(Solver::Implicit, |row| row % 8 != 0);
    }

    /// True if a check detects a change of the velocities.
    fn detects(check: &str, activity: Activity, change: fn(Vec3) -> Vec3) {
        let [before, after] = found(activity, change);
        assert!(before.is_empty(), "{before:?}");
        assert!(after.iter().any(|what| what.starts_with(check)), "{check}: {after:?}");
    }

    #[test]
    fn planted_faults_are_found() {
        detects("energy", Activity::Hanging, |v| 1.01 * v);
        detects("momentum", Activity::Spinning, |v| v + Vec3::splat(1e-5));
        detects("angular momentum", Activity::Spinning, |v| 0.997 * v);
    }

    /// Compares the bound of the mean energy with leapfrog of one mode: mass and frequency 1, substeps z.
    #[test]
    fn mean_energy_stays_below_the_conserved_energy_of_leapfrog() {
        for z in [0.1_f64, 0.5, 1.0, 1.6] {
            let c = 2.0 * (z / 2.0).asin() / (z * (1.0 - z * z / 4.0).sqrt());
            let [mut x, mut v] = [0.6_f64, 0.8];
            let conserved = |x: f64, v: f64| c * (v * v + (1.0 - z * z / 4.0) * x * x) / 2.0;
            let first = conserved(x, v);
            let (mut sum, count) = (0.0, 100_000);
            for _ in 0..count {
                v -= z / 2.0 * x;
                x += z * v;
                v -= z / 2.0 * x;
                sum += (v * v + x * x) / 2.0;
            }
            assert!((conserved(x, v) / first - 1.0).abs() < 1e-9, "z {z}");
            let mean = sum / f64::from(count) / first;
            let expected = (1.0 - z * z / 8.0) / (c * (1.0 - z * z / 4.0));
            assert!((mean - expected).abs() < 1e-4 && mean < 1.0, "z {z}: {mean}");
        }
    }
}
