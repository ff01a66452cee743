//! What a step changes, kept so that a step that fails can be forgotten.

use std::ops::Range;

use glam::Vec3;

use crate::base::Result;
use crate::codec::saved;
use crate::soa::{Vectors, per_node};

/// Positions, velocities and spring forces of all nodes, with room for a step in progress.
///
/// A step reads what is current and writes beside it; nothing is current before [`State::commit`]. Positions take three
/// places, because a substep reads one and writes another while the first of the step must survive.
#[derive(Debug)]
pub(crate) struct State {
    positions: [Vectors; 3],
    velocities: [Vectors; 2],
    forces: [Vectors; 2],
    /// What positions lack of where the nodes are, m: less than the last place of their coordinates (Kahan 1965). IMPLICIT and NEWTON
    /// keep their own.
    remainders: Option<[Vectors; 2]>,
    /// The place of the current positions.
    current: usize,
    /// The place of the newest positions of the step in progress.
    latest: usize,
    /// The place of the current velocities and forces.
    settled: usize,
    /// The place of the current remainders.
    kept: usize,
    /// The place of those of the step in progress.
    carried: usize,
}

saved! { State { positions, velocities, forces, remainders, current, latest, settled, kept, carried } }

per_node! { State { positions, velocities, forces, remainders } }

/// What a substep reads and writes.
pub(crate) struct Substep<'a> {
    /// Velocities and spring forces when the step began.
    pub first_velocities: &'a Vectors,
    pub first_forces: &'a Vectors,
    /// Positions now.
    pub positions: &'a Vectors,
    /// Positions at the end of the substep.
    pub next_positions: &'a mut Vectors,
    /// Velocities, half a substep ahead of or behind the positions within a step.
    pub velocities: &'a mut Vectors,
    /// Where the last substep leaves its spring forces.
    pub forces: &'a mut Vectors,
    /// What positions lacked when the step began, and lack now, where that is carried on.
    pub remainders: Option<[&'a mut Vectors; 2]>,
}

impl State {
    /// Whether it is that of so many nodes, and finite.
    pub fn is_sound(&self, count: usize) -> bool {
        let mut all =
            (self.positions.iter().chain(&self.velocities).chain(&self.forces)).chain(self.remainders.iter().flatten());
        self.current < self.positions.len()
            && self.latest < self.positions.len()
            && self.settled < self.velocities.len()
            && self.kept.max(self.carried) < 2
            && all.all(|vectors| vectors.len() == count)
            && [self.positions(), self.velocities()]
                .into_iter()
                .all(|vectors| vectors.iter().all(|vector| vector.is_finite()))
    }

    /// `carries`: whether its substeps may carry on what positions lack.
    pub fn new(node_count: usize, carries: bool) -> Result<Self> {
        let zeros = || Vectors::zeros(node_count);
        Ok(Self {
            positions: [zeros()?, zeros()?, zeros()?],
            velocities: [zeros()?, zeros()?],
            forces: [zeros()?, zeros()?],
            remainders: if carries { Some([zeros()?, zeros()?]) } else { None },
            current: 0,
            latest: 0,
            settled: 0,
            kept: 0,
            carried: 0,
        })
    }

    /// Has a node move as another does.
    pub fn copy(&mut self, source: usize, node: usize) {
        let current = [
            &mut self.positions[self.current],
            &mut self.velocities[self.settled],
            &mut self.forces[self.settled],
        ];
        let remainders = self.remainders.as_mut().map(|places| &mut places[self.kept]);
        for vectors in current.into_iter().chain(remainders) {
            vectors.set(node, vectors.get(source));
        }
    }

    pub fn positions(&self) -> &Vectors {
        &self.positions[self.current]
    }

    pub fn positions_mut(&mut self) -> &mut Vectors {
        &mut self.positions[self.current]
    }

    pub fn velocities(&self) -> &Vectors {
        &self.velocities[self.settled]
    }

    pub fn velocities_mut(&mut self) -> &mut Vectors {
        &mut self.velocities[self.settled]
    }

    /// The spring forces at the current positions and velocities.
    pub fn forces(&self) -> &Vectors {
        &self.forces[self.settled]
    }

    /// What the current positions lack, where that may be carried on.
    pub fn remainders(&self) -> Option<&Vectors> {
        self.remainders.as_ref().map(|places| &places[self.kept])
    }

    /// The current positions lack nothing.
    pub fn forget_remainders(&mut self) {
        if let Some(places) = &mut self.remainders {
            places[self.kept].clear();
        }
    }

    /// Starts a step over, from what is current.
    pub fn begin(&mut self) {
        self.latest = self.current;
        self.carried = self.kept;
    }

    /// Has the substeps of the step in progress carry on what positions lack.
    pub fn carry(&mut self) {
        if self.remainders.is_some() {
            self.carried = 1 - self.kept;
        }
    }

    pub fn substep(&mut self) -> Substep<'_> {
        let next = self.next();
        let [a, b, c] = &mut self.positions;
        let (positions, next_positions) = match (self.latest, next) {
            (0, 1) => (&*a, b),
            (0, _) => (&*a, c),
            (1, 0) => (&*b, a),
            (1, _) => (&*b, c),
            (_, 0) => (&*c, a),
            _ => (&*c, b),
        };
        let [first_velocities, velocities] = current_and_next(&mut self.velocities, self.settled);
        let [first_forces, forces] = current_and_next(&mut self.forces, self.settled);
        let carries = self.carried != self.kept;
        let remainders = self.remainders.as_mut().filter(|_| carries);
        Substep {
            remainders: remainders.map(|places| current_and_next(places, self.kept)),
            first_velocities,
            first_forces,
            positions,
            next_positions,
            velocities,
            forces,
        }
    }

    /// Positions now, those of the next substep, and velocities, of a step that has taken its first substep; the one after
    /// the next may write over the positions. And what positions lack, where that is carried on.
    pub fn two_substeps(&mut self) -> ([&mut Vectors; 3], Option<&mut Vectors>) {
        assert_ne!(self.latest, self.current, "the current positions must survive");
        let is_swapped = self.latest > self.next();
        let current = self.current;
        let mut others = (0..).zip(&mut self.positions).filter(|(place, _)| *place != current);
        let [Some((_, first)), Some((_, second))] = [others.next(), others.next()] else {
            unreachable!("there are three places");
        };
        let [latest, next] = if is_swapped { [second, first] } else { [first, second] };
        let carries = self.carried != self.kept;
        let remainders = self.remainders.as_mut().filter(|_| carries);
        (
            [latest, next, &mut self.velocities[1 - self.settled]],
            remainders.map(|places| &mut places[self.carried]),
        )
    }

    /// The positions just written become the newest of the step in progress.
    pub fn advance(&mut self) {
        self.latest = self.next();
    }

    /// The positions that the substep in progress has written.
    pub fn next_positions(&self) -> &Vectors {
        &self.positions[self.next()]
    }

    /// The newest positions and velocities of the step in progress.
    pub fn newest(&self) -> (&Vectors, &Vectors) {
        (&self.positions[self.latest], &self.velocities[1 - self.settled])
    }

    /// Whether those, and their squares, are finite.
    pub fn newest_is_finite(&self) -> bool {
        let (positions, velocities) = self.newest();
        positions.largest_length().is_finite() && velocities.largest_length().is_finite()
    }

    /// Whether the positions and velocities that the substep in progress has written, and their squares, are finite.
    pub fn next_is_finite(&self) -> bool {
        let velocities = &self.velocities[1 - self.settled];
        self.next_positions().largest_length().is_finite() && velocities.largest_length().is_finite()
    }

    /// Has these nodes stand where they are, in every place: a step that leaves them out changes nothing of them.
    pub fn stand_still(&mut self, nodes: Range<usize>) {
        for node in nodes {
            let place = self.positions[self.current].get(node);
            self.positions
                .iter_mut()
                .for_each(|positions| positions.set(node, place));
            let still = self.velocities.iter_mut().chain(self.remainders.iter_mut().flatten());
            still.for_each(|vectors| vectors.set(node, Vec3::ZERO));
        }
    }

    /// Makes the step in progress the current state.
    pub fn commit(&mut self) {
        self.current = self.latest;
        self.settled = 1 - self.settled;
        self.kept = self.carried;
    }

    /// The place that holds neither the first nor the newest positions of the step.
    fn next(&self) -> usize {
        if self.latest == self.current {
            (self.current + 1) % 3
        } else {
            3 - self.current - self.latest
        }
    }
}

/// Of a pair that takes turns the one that is current, and the other.
pub(crate) fn current_and_next<T>(pair: &mut [T; 2], current: usize) -> [&mut T; 2] {
    let [a, b] = pair;
    if current == 0 { [a, b] } else { [b, a] }
}
