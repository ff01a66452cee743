//! Fast simulation of mass-spring systems (Liu et al. 2013): block coordinate descent on implicit Euler's energy. Springs
//! choose their directions, then all nodes move together by a system that never changes, `M + h² L`, factored beforehand.
//!
//! Solved for the change of the displacement, `(M + h² L) du = M (s - u) + h² f(x + u)`: the same iterates, without the
//! rounding of positions in them.

use crate::bisection;
use crate::cholesky::{Factor, Matrix};
use crate::contender::{Contender, Setup, State, record, vector};
use crate::rows::Rows;
use crate::scene::Scene;
use crate::simd::{self, Kernel, Proof, Record, Vector};

pub struct Projective {
    places: Vec<u32>,
    /// Stiffnesses times h².
    rows: Rows,
    factor: Factor,
    /// kg for each lane; 0: pinned.
    masses: Vec<f32>,
    /// For each lane 1; 0: pinned.
    free: Vec<f32>,
    start: Vec<Record>,
    /// Where nodes were when the step began, and 1 beside it; 0: pinned.
    begun: Vec<Record>,
    /// Where they are.
    positions: Vec<Record>,
    /// How far they have moved in the step.
    moved: Vec<Record>,
    /// How far they would without springs.
    inert: Vec<Record>,
    residual: Vec<Record>,
    fall: Record,
    damping: f32,
    steps: u32,
    iterations: u32,
    /// s
    step: f64,
}

impl Projective {
    pub fn new(scene: &Scene, setup: Setup) -> Self {
        let order = bisection::order(scene);
        let places = bisection::places(&order);
        let h = setup.step();
        let square = h * h;
        let rows = Rows::new(scene, &places, square as f32);
        let mass = |place: u32| scene.masses[order[place as usize] as usize];
        let free = |place: u32| f32::from(mass(place) > 0.0);
        let mut start: Vec<Record> = (0..order.len() as u32)
            .map(|place| record(scene.positions[order[place as usize] as usize], free(place)))
            .collect();
        start.push(Record::default());
        let nothing = vec![Record::default(); start.len()];
        Self {
            factor: Factor::new(&system(scene, &places, square)),
            masses: rows.per_lane(mass),
            free: rows.per_lane(free),
            places,
            rows,
            begun: start.clone(),
            positions: start.clone(),
            start,
            moved: nothing.clone(),
            inert: nothing.clone(),
            residual: nothing,
            fall: record(scene.gravity * square as f32, 0.0),
            damping: (-f64::from(scene.damping_rate) * h).exp() as f32,
            steps: setup.steps,
            iterations: setup.iterations,
            step: h,
        }
    }

    fn step(&mut self) {
        simd::run(Begin(self));
        for _ in 0..self.iterations {
            simd::run(Residual(self));
            let nodes = self.places.len();
            self.factor.solve(&mut self.residual[..nodes]);
            simd::run(Move(self));
        }
    }
}

impl Contender for Projective {
    fn restart(&mut self) {
        self.begun.clone_from(&self.start);
        self.positions.clone_from(&self.start);
        self.moved.fill(Record::default());
    }

    fn advance(&mut self) -> Result<(), String> {
        for _ in 0..self.steps {
            self.step();
        }
        Ok(())
    }

    fn read(&mut self) -> State {
        let exact = |records: &[Record]| -> Vec<_> {
            self.places
                .iter()
                .map(|&place| vector(&records[place as usize]))
                .collect()
        };
        let moved = exact(&self.moved);
        State {
            positions: exact(&self.begun)
                .into_iter()
                .zip(&moved)
                .map(|(at, moved)| at + *moved)
                .collect(),
            velocities: moved.iter().map(|moved| *moved / self.step).collect(),
        }
    }
}

/// `M + h² L` without the nodes that are pinned, of which the diagonal alone is left.
pub fn system(scene: &Scene, places: &[u32], square: f64) -> Matrix {
    let count = scene.node_count();
    let mut matrix = Matrix {
        diagonal: vec![1.0; count],
        below: vec![Vec::new(); count],
    };
    for (node, &mass) in scene.masses.iter().enumerate() {
        if mass > 0.0 {
            matrix.diagonal[places[node] as usize] = f64::from(mass);
        }
    }
    for (&[a, b], &stiffness) in scene.springs.iter().zip(&scene.stiffnesses) {
        let weight = square * f64::from(stiffness);
        let free = [a, b].map(|node| !scene.is_pinned(node as usize));
        let [a, b] = [a, b].map(|node| places[node as usize]);
        for (place, free) in [a, b].into_iter().zip(free) {
            if free {
                matrix.diagonal[place as usize] += weight;
            }
        }
        if free == [true, true] {
            matrix.below[a.min(b) as usize].push((a.max(b), -weight));
        }
    }
    matrix
}

/// Ends a step and begins the next, from where inertia leads.
struct Begin<'a>(&'a mut Projective);

impl Kernel for Begin<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self, _: Proof<V>) {
        let Projective {
            begun,
            positions,
            moved,
            inert,
            fall,
            damping,
            ..
        } = self.0;
        for (((begun, position), moved), inert) in begun.iter_mut().zip(positions).zip(moved).zip(inert) {
            *begun = begun.zip(*moved, |begun, moved| begun + moved);
            let led = moved.zip(*fall, |moved, fall| moved * *damping + fall);
            *inert = if begun.0[3] > 0.0 { led } else { Record::default() };
            *moved = *inert;
            *position = begun.zip(*moved, |begun, moved| begun + moved);
        }
    }
}

/// `M (s - u) + h² f`
struct Residual<'a>(&'a mut Projective);

impl Kernel for Residual<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self, proof: Proof<V>) {
        let Projective {
            rows,
            masses,
            free,
            positions,
            moved,
            inert,
            residual,
            ..
        } = self.0;
        for block in 0..rows.block_count() {
            let at = block * V::COUNT;
            let [x, y, z, _] = V::load_records(proof, positions, &rows.nodes, at, 0);
            let moved = V::load_records(proof, moved, &rows.nodes, at, 0);
            let inert = V::load_records(proof, inert, &rows.nodes, at, 0);
            let forces = rows.forces(proof, block, positions, [x, y, z]);
            let mass = V::load(proof, &masses[at..]);
            let free = V::load(proof, &free[at..]);
            let of = |axis: usize| (inert[axis] - moved[axis]).mul_add(mass, forces[axis] * free);
            let sum = [of(0), of(1), of(2), V::splat(proof, 0.0)];
            V::store_records(sum, residual, &rows.nodes, at, 0);
        }
    }
}

/// Moves the nodes by the solution.
struct Move<'a>(&'a mut Projective);

impl Kernel for Move<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self, _: Proof<V>) {
        let Projective {
            begun,
            positions,
            moved,
            residual,
            ..
        } = self.0;
        for (((begun, position), moved), change) in begun.iter().zip(positions).zip(moved).zip(residual) {
            *moved = moved.zip(*change, |moved, change| moved + change);
            *position = begun.zip(*moved, |begun, moved| begun + moved);
        }
    }
}
