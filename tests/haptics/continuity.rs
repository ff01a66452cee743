//! Between ticks, the force changes by no more than the motion of the hand explains, whatever happens to the tissue.

use super::bench::*;
use glam::{DVec3, dvec3, vec3};
use sinew::Solver;
use sinew::cutting::Sweep;

const TOP: f64 = RADIUS as f64;
const STIFFNESS: f64 = 1000.0;
/// Critical for 50 g.
const DAMPING: f64 = 14.142_135_6;

/// Checks that the force never changes by more than allowed between records. Returns the largest change relative to the
/// allowed change.
fn check(records: &[Record], case: &str) -> f64 {
    let mut closest = 0.0_f64;
    for pair in records.windows(2) {
        let [before, now] = [&pair[0], &pair[1]];
        let [a, b] = [before, now].map(|record| record.tick.force.as_dvec3());
        let displacement = (now.position - before.position).length();
        let change = (now.velocity - before.velocity).length();
        let allowed = STIFFNESS * displacement + DAMPING * change + 0.02_f64.max(0.02 * a.length());
        let jump = (b - a).length();
        assert!(jump <= allowed, "{case}: {jump} N where {allowed} N may be: {now:?}");
        closest = closest.max(jump / allowed);
    }
    closest
}

/// Returns the position of a hand that wanders about the surface at up to 0.2 m/s and sometimes stands still.
fn wandering(t: f64) -> DVec3 {
    let t = 0.4 * (t / 0.5).floor() + (t % 0.5).min(0.4);
    dvec3(
        0.018 * (3.1 * t).sin(),
        TOP - 0.002 - 0.005 * (23.0 * t).sin(),
        0.015 * (2.3 * t).sin(),
    )
}

#[test]
fn pressing_and_sliding_cause_no_force_jumps() {
    for (solver, every) in [(Solver::Verlet, 1), (Solver::Verlet, 16), (Solver::Implicit, 16)] {
        let mut bench = Bench::new(solver, every);
        let records = bench.follow(1.5, wandering);
        let speed = records
            .iter()
            .map(|record| record.velocity.length())
            .fold(0.0, f64::max);
        let largest = records
            .iter()
            .map(|record| record.tick.force.length())
            .fold(0.0, f32::max);
        assert!(speed < 0.2 && speed > 0.1, "{speed}");
        let case = format!("{solver:?}, a step for {every} ticks");
        assert!(largest > 0.2, "{case}: {largest} N");
        check(&records, &case);
    }
}

#[test]
fn a_cut_under_the_tool_lowers_the_force_without_a_jump() {
    let mut bench = Bench::new(Solver::Verlet, 16);
    let mut records = bench.follow(1.0, |t| dvec3(0.0, TOP - 0.01 * t.min(0.8), 0.0));
    let before = records.last().unwrap().tick.force.y;
    // Cuts around the pressed region leave a column that yields.
    for side in [-0.014, 0.016] {
        for [from, to] in [
            [vec3(-0.06, 0.01, side), vec3(0.06, 0.01, side)],
            [vec3(side, 0.01, -0.06), vec3(side, 0.01, 0.06)],
        ] {
            let down = vec3(0.0, -0.045, 0.0);
            let cut = Sweep {
                start: [from, from + down],
                end: [to, to + down],
            };
            bench.world.cut(bench.body, &cut).unwrap();
        }
    }
    records.extend(bench.follow(1.0, |_| dvec3(0.0, TOP - 0.008, 0.0)));
    let after = records.last().unwrap().tick.force.y;
    assert!(
        after < 0.9 * before,
        "the cut must lower the force: {before} N, {after} N"
    );
    check(&records, "a cut");
}

#[test]
fn stalls_of_the_simulation_cause_no_force_jumps() {
    let mut bench = Bench::new(Solver::Implicit, 16);
    let mut records = Vec::new();
    for round in 0..4 {
        bench.every = if round % 2 == 0 { 16 } else { 0 };
        let start = 0.35 * f64::from(round);
        records.extend(bench.follow(0.35, |t| wandering(start + t)));
    }
    check(&records, "stalls");
}
