//! The rows of `cargo test`.

use sinew::Solver;

use super::activity::Activity;
use super::subject::{Extra, Law, Shape};
use super::table::{DAMPING, FRAME, Row, matter, row};
use Activity::{Hanging, Led, Plucked, Poked, Pushed, Spinning};
use Extra::{Bending, Fibres, Limited, Maxwell, Nothing, Voigt};
use Law::{Elements, Young};
use Shape::{Balloon, Cloth, Gallbladder, Lattice, Liver, Organ, SmallOrgan};

/// Rows with their simulated time, s; a plucked body takes a fixed number of periods.
pub fn quick() -> Vec<(Row, f64)> {
    let verlet = |matter, activity, step, seconds| (row(matter, activity, Solver::Verlet, step), seconds);
    let implicit = |matter, activity, step, seconds| (row(matter, activity, Solver::Implicit, step), seconds);
    let newton = |matter, activity, step, seconds| (row(matter, activity, Solver::Newton, step), seconds);
    let springs = matter(Organ, Young, Nothing);
    let elements = matter(Organ, Elements(0.3), Nothing);
    let small = matter(SmallOrgan, Elements(0.3), Nothing);
    let stiff_cloth = matter(Cloth, Young, Bending);
    let lattice = matter(Lattice, Young, Nothing);
    let balloon = matter(Balloon, Young, Nothing);
    let liver = |law| matter(Liver, law, Nothing);
    let damped = |(row, seconds)| {
        let damping = DAMPING;
        (Row { damping, ..row }, seconds)
    };
    vec![
        verlet(liver(Elements(0.3)), Hanging, FRAME, 5.0),
        // After 54 s a few elements need more substeps than are allowed.
        verlet(liver(Elements(0.3)), Hanging, 1.0 / 30.0, 56.0),
        verlet(elements, Hanging, FRAME, 3.0),
        verlet(matter(Organ, Young, Maxwell), Hanging, FRAME, 3.0),
        verlet(matter(Organ, Elements(0.3), Voigt), Hanging, FRAME, 1.0),
        verlet(springs, Hanging, FRAME, 10.0),
        verlet(springs, Hanging, 1e-3, 5.0),
        verlet(matter(Organ, Young, Limited), Hanging, FRAME, 5.0),
        verlet(matter(Cloth, Young, Nothing), Hanging, FRAME, 10.0),
        verlet(stiff_cloth, Hanging, FRAME, 10.0),
        verlet(lattice, Hanging, FRAME, 10.0),
        verlet(small, Led, FRAME, 10.0),
        verlet(small, Hanging, FRAME, 10.0),
        verlet(liver(Young), Hanging, FRAME, 10.0),
        damped(verlet(liver(Young), Hanging, FRAME, 10.0)),
        verlet(stiff_cloth, Pushed, FRAME, 5.0),
        verlet(lattice, Poked, FRAME, 5.0),
        verlet(balloon, Led, FRAME, 5.0),
        verlet(springs, Spinning, FRAME, 5.0),
        // Mass is added in the first step, when the velocities are already set.
        verlet(matter(Organ, Young, Fibres), Spinning, FRAME, 5.0),
        verlet(matter(Gallbladder, Elements(0.3), Nothing), Spinning, FRAME, 5.0),
        verlet(elements, Plucked, FRAME, 0.0),
        implicit(springs, Hanging, FRAME, 3.0),
        implicit(elements, Hanging, FRAME, 3.0),
        implicit(stiff_cloth, Hanging, FRAME, 3.0),
        implicit(lattice, Poked, FRAME, 2.0),
        damped(implicit(lattice, Hanging, FRAME, 110.0)),
        implicit(small, Pushed, FRAME, 3.0),
        implicit(small, Spinning, FRAME, 5.0),
        // An earlier allowance for rounding reached a thousandth after 160 s.
        implicit(matter(SmallOrgan, Young, Nothing), Spinning, 1.0 / 30.0, 170.0),
        implicit(balloon, Spinning, 1.0 / 120.0, 5.0),
        implicit(matter(Gallbladder, Young, Nothing), Plucked, 1e-3, 0.0),
        implicit(elements, Plucked, 1e-3, 0.0),
        implicit(springs, Plucked, FRAME, 0.0),
        implicit(small, Plucked, 1.0 / 30.0, 0.0),
        newton(small, Hanging, FRAME, 2.0),
        newton(small, Spinning, FRAME, 3.0),
    ]
}
