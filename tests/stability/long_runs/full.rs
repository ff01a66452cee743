//! Every row of the table.
#![allow(dead_code, reason = "the bench takes them")]

use sinew::Solver;

use super::activity::Activity;
use super::subject::{Extra, Law, Matter, Shape};
use super::table::{DAMPING, FRAME, Row, matter, row};
use Activity::{Hanging, Led, Plucked, Poked, Pushed, Spinning};
use Extra::{Bending, Cubic, Exponential, Fibres, Home, Limited, Maxwell, Nothing, Voigt, Volume};
use Law::{Elements, Springs, Young};
use Shape::{Balloon, Cloth, Flap, Gallbladder, Lattice, Liver, Organ, SmallOrgan, Stomach};

/// The most common bodies, for all activities and steps.
const MAIN: [Matter; 13] = [
    matter(Organ, Young, Nothing),
    matter(Organ, Elements(0.3), Nothing),
    matter(SmallOrgan, Young, Nothing),
    matter(SmallOrgan, Elements(0.3), Nothing),
    matter(Flap, Young, Nothing),
    matter(Flap, Elements(0.3), Nothing),
    matter(Liver, Young, Nothing),
    matter(Liver, Elements(0.3), Nothing),
    matter(Gallbladder, Young, Nothing),
    matter(Gallbladder, Elements(0.3), Nothing),
    matter(Cloth, Young, Bending),
    matter(Lattice, Young, Nothing),
    matter(Balloon, Young, Nothing),
];

/// Further bodies, for three activities and one step.
const OTHERS: [Matter; 31] = [
    matter(Organ, Springs(10.0), Nothing),
    matter(Organ, Elements(0.45), Nothing),
    matter(Organ, Young, Volume),
    matter(Organ, Young, Maxwell),
    matter(Organ, Young, Voigt),
    matter(Organ, Elements(0.3), Maxwell),
    matter(Organ, Elements(0.3), Voigt),
    matter(Organ, Elements(0.3), Fibres),
    matter(Organ, Young, Fibres),
    matter(Organ, Young, Exponential),
    matter(Organ, Young, Cubic),
    matter(Organ, Young, Limited),
    matter(Organ, Young, Home),
    matter(SmallOrgan, Elements(0.45), Nothing),
    matter(SmallOrgan, Young, Volume),
    matter(SmallOrgan, Young, Exponential),
    matter(Stomach, Young, Nothing),
    matter(Stomach, Elements(0.3), Nothing),
    matter(Stomach, Elements(0.45), Nothing),
    matter(Stomach, Young, Volume),
    matter(Flap, Elements(0.45), Nothing),
    matter(Liver, Elements(0.45), Nothing),
    matter(Gallbladder, Elements(0.45), Nothing),
    matter(Cloth, Springs(20.0), Nothing),
    matter(Cloth, Young, Nothing),
    matter(Cloth, Young, Exponential),
    matter(Cloth, Young, Voigt),
    matter(Lattice, Springs(20.0), Nothing),
    matter(Lattice, Young, Cubic),
    matter(Lattice, Young, Maxwell),
    matter(Balloon, Young, Bending),
];

const ACTIVITIES: [Activity; 6] = [Hanging, Spinning, Led, Pushed, Poked, Plucked];

const STEPS: [f32; 4] = [FRAME, 1.0 / 30.0, 1.0 / 120.0, 1e-3];

/// NEWTON is slow, and takes part with small bodies.
fn solvers(matter: Matter) -> &'static [Solver] {
    match matter.shape {
        SmallOrgan | Liver | Lattice => &[Solver::Verlet, Solver::Implicit, Solver::Newton],
        _ => &[Solver::Verlet, Solver::Implicit],
    }
}

/// Every row.
pub fn full() -> Vec<Row> {
    let mut rows = Vec::new();
    let mut add = |matter: Matter, activity, damping, step| {
        for &solver in solvers(matter) {
            rows.push(Row {
                damping,
                ..row(matter, activity, solver, step)
            });
        }
    };
    for matter in MAIN {
        for activity in ACTIVITIES {
            for step in STEPS {
                let is_long = matches!(activity, Hanging | Spinning | Plucked);
                if is_long || step == FRAME {
                    add(matter, activity, 0.0, step);
                }
            }
        }
        add(matter, Hanging, DAMPING, FRAME);
        add(matter, Led, DAMPING, FRAME);
    }
    for matter in OTHERS {
        for activity in [Hanging, Spinning, Plucked] {
            // Anchor springs act from outside: such a body is not free.
            if !(matter.extra == Home && activity == Spinning) {
                add(matter, activity, 0.0, FRAME);
            }
        }
    }
    rows
}
