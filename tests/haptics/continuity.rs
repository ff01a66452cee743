//! No tick changes the force by more than the motion of the hand explains, whatever becomes of the tissue.

use super::bench::*;
use glam::{DVec3, dvec3, vec3};
use sinew::Solver;
use sinew::cutting::Sweep;

const TOP: f64 = RADIUS as f64;
const STIFFNESS: f64 = 1000.0;
/// Critical for 50 g.
const DAMPING: f64 = 14.142_135_6;

/// Checks that no record's force differs from the one before by more than may be; how close it came to that.
fn check(records: &[Record], case: &str) -> f64 {
    let mut closest = 0.0_f64;
    for pair in records.windows(2) {
        let [before, now] = [&pair[0], &pair[1]];
        let [a, b] = [before, now].map(|record| record.tick.force.as_dvec3());
        let way = (now.position - before.position).length();
        let change = (now.velocity - before.velocity).length();
        let allowed = STIFFNESS * way + DAMPING * change + 0.02_f64.max(0.02 * a.length());
        let jump = (b - a).length();
        assert!(jump <= allowed, "{case}: {jump} N where {allowed} N may be: {now:?}");
        closest = closest.max(jump / allowed);
    }
    closest
}

/// A hand that wanders about the surface with up to 0.2 m/s, and at times stands still.
fn wandering(t: f64) -> DVec3 {
    let t = 0.4 * (t / 0.5).floor() + (t % 0.5).min(0.4);
    dvec3(
        0.018 * (3.1 * t).sin(),
        TOP - 0.002 - 0.005 * (23.0 * t).sin(),
        0.015 * (2.3 * t).sin(),
    )
}

#[test]
fn presses_and_slides_are_felt_without_jumps() {
    for (solver, every) in [(Solver::Verlet, 1), (Solver::Verlet, 16), (Solver::Implicit, 16)] {
        let mut bench = Bench::new(solver, every);
        let records = bench.follow(1.5, wandering);
        let speed = records
            .iter()
            .map(|record| record.velocity.length())
            .fold(0.0, f64::max);
        let most = records
            .iter()
            .map(|record| record.tick.force.length())
            .fold(0.0, f32::max);
        assert!(speed < 0.2 && speed > 0.1, "{speed}");
        let case = format!("{solver:?}, a step for {every} ticks");
        assert!(most > 0.2, "{case}: {most} N");
        check(&records, &case);
    }
}

#[test]
fn a_cut_under_the_tool_is_felt_without_a_jump() {
    let mut bench = Bench::new(Solver::Verlet, 16);
    let mut records = bench.follow(1.0, |t| dvec3(0.0, TOP - 0.01 * t.min(0.8), 0.0));
    let before = records.last().unwrap().tick.force.y;
    // Cuts about what is pressed: a column that gives way.
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
    assert!(after < 0.9 * before, "the cut is felt: {before} N, {after} N");
    check(&records, "a cut");
}

#[test]
fn stalls_are_felt_without_jumps() {
    let mut bench = Bench::new(Solver::Implicit, 16);
    let mut records = Vec::new();
    for round in 0..4 {
        bench.every = if round % 2 == 0 { 16 } else { 0 };
        let start = 0.35 * f64::from(round);
        records.extend(bench.follow(0.35, |t| wandering(start + t)));
    }
    check(&records, "stalls");
}
