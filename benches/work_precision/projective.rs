//! Fast simulation of mass-spring systems (Liu et al. 2013): block coordinate descent on the energy of implicit Euler.
//! The local step sets the directions of springs. The global step moves all nodes by solving the constant system `M +
//! h² L`, which is factored in advance.
//!
//! It is solved for the change of the displacement, `(M + h² L) du = M (s - u) + h² f(x + u)`. The iterates are the
//! same, without the rounding of positions.

use crate::bisection;
use crate::cholesky::{Factor, Matrix};
use crate::contender::{Contender, Setup, State, record, vector};
use crate::rows::Rows;
use crate::scene::Scene;
use crate::simd::{self, Kernel, Proof, Record, Vector};

pub struct Projective {
    ranks: Vec<u32>,
    /// Springs, with stiffnesses times h².
    rows: Rows,
    factor: Factor,
    /// Masses for each lane [kg]; 0 is pinned.
    masses: Vec<f32>,
    /// 1 for each lane of a free node; 0 is pinned.
    free: Vec<f32>,
    start: Vec<Record>,
    /// Positions at the start of the step, with 1 as the fourth number; 0 is pinned.
    step_start: Vec<Record>,
    /// Current positions.
    positions: Vec<Record>,
    /// Displacements in the step.
    displacement: Vec<Record>,
    /// Displacements without springs.
    inertial: Vec<Record>,
    residual: Vec<Record>,
    fall: Record,
    damping: f32,
    steps: u32,
    iterations: u32,
    /// Duration of a step [s].
    step: f64,
}

impl Projective {
    pub fn new(scene: &Scene, setup: Setup) -> Self {
        let order = bisection::order(scene);
        let ranks = bisection::ranks(&order);
        let h = setup.step();
        let square = h * h;
        let rows = Rows::new(scene, &ranks, square as f32);
        let mass = |rank: u32| scene.masses[order[rank as usize] as usize];
        let free = |rank: u32| f32::from(mass(rank) > 0.0);
        let mut start: Vec<Record> = (0..order.len() as u32)
            .map(|rank| record(scene.positions[order[rank as usize] as usize], free(rank)))
            .collect();
        start.push(Record::default());
        let zeros = vec![Record::default(); start.len()];
        Self {
            factor: Factor::new(&system(scene, &ranks, square)),
            masses: rows.per_lane(mass),
            free: rows.per_lane(free),
            ranks,
            rows,
            step_start: start.clone(),
            positions: start.clone(),
            start,
            displacement: zeros.clone(),
            inertial: zeros.clone(),
            residual: zeros,
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
            let nodes = self.ranks.len();
            self.factor.solve(&mut self.residual[..nodes]);
            simd::run(Move(self));
        }
    }
}

impl Contender for Projective {
    fn restart(&mut self) {
        self.step_start.clone_from(&self.start);
        self.positions.clone_from(&self.start);
        self.displacement.fill(Record::default());
    }

    fn advance(&mut self) -> Result<(), String> {
        for _ in 0..self.steps {
            self.step();
        }
        Ok(())
    }

    fn read(&mut self) -> State {
        let exact =
            |records: &[Record]| -> Vec<_> { self.ranks.iter().map(|&rank| vector(&records[rank as usize])).collect() };
        let displacement = exact(&self.displacement);
        State {
            positions: exact(&self.step_start)
                .into_iter()
                .zip(&displacement)
                .map(|(at, displacement)| at + *displacement)
                .collect(),
            velocities: displacement
                .iter()
                .map(|displacement| *displacement / self.step)
                .collect(),
        }
    }
}

/// `M + h² L` without pinned nodes, of which only the diagonal remains.
pub fn system(scene: &Scene, ranks: &[u32], square: f64) -> Matrix {
    let count = scene.node_count();
    let mut matrix = Matrix {
        diagonal: vec![1.0; count],
        below: vec![Vec::new(); count],
    };
    for (node, &mass) in scene.masses.iter().enumerate() {
        if mass > 0.0 {
            matrix.diagonal[ranks[node] as usize] = f64::from(mass);
        }
    }
    for (&[a, b], &stiffness) in scene.springs.iter().zip(&scene.stiffnesses) {
        let weight = square * f64::from(stiffness);
        let free = [a, b].map(|node| !scene.is_pinned(node as usize));
        let [a, b] = [a, b].map(|node| ranks[node as usize]);
        for (rank, free) in [a, b].into_iter().zip(free) {
            if free {
                matrix.diagonal[rank as usize] += weight;
            }
        }
        if free == [true, true] {
            matrix.below[a.min(b) as usize].push((a.max(b), -weight));
        }
    }
    matrix
}

/// Ends a step and begins the next at the inertial prediction.
struct Begin<'a>(&'a mut Projective);

impl Kernel for Begin<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self, _: Proof<V>) {
        let Projective {
            step_start,
            positions,
            displacement,
            inertial,
            fall,
            damping,
            ..
        } = self.0;
        for (((step_start, position), displacement), inertial) in
            step_start.iter_mut().zip(positions).zip(displacement).zip(inertial)
        {
            *step_start = step_start.zip(*displacement, |step_start, displacement| step_start + displacement);
            let predicted = displacement.zip(*fall, |displacement, fall| displacement * *damping + fall);
            *inertial = if step_start.0[3] > 0.0 {
                predicted
            } else {
                Record::default()
            };
            *displacement = *inertial;
            *position = step_start.zip(*displacement, |step_start, displacement| step_start + displacement);
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
            displacement,
            inertial,
            residual,
            ..
        } = self.0;
        for block in 0..rows.block_count() {
            let at = block * V::COUNT;
            let [x, y, z, _] = V::load_records(proof, positions, &rows.nodes, at, 0);
            let displacement = V::load_records(proof, displacement, &rows.nodes, at, 0);
            let inertial = V::load_records(proof, inertial, &rows.nodes, at, 0);
            let forces = rows.forces(proof, block, positions, [x, y, z]);
            let mass = V::load(proof, &masses[at..]);
            let free = V::load(proof, &free[at..]);
            let component = |axis: usize| (inertial[axis] - displacement[axis]).mul_add(mass, forces[axis] * free);
            let sum = [component(0), component(1), component(2), V::splat(proof, 0.0)];
            V::store_records(sum, residual, &rows.nodes, at, 0);
        }
    }
}

/// Adds the solution to the displacements.
struct Move<'a>(&'a mut Projective);

impl Kernel for Move<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self, _: Proof<V>) {
        let Projective {
            step_start,
            positions,
            displacement,
            residual,
            ..
        } = self.0;
        for (((step_start, position), displacement), change) in
            step_start.iter().zip(positions).zip(displacement).zip(residual)
        {
            *displacement = displacement.zip(*change, |displacement, change| displacement + change);
            *position = step_start.zip(*displacement, |step_start, displacement| step_start + displacement);
        }
    }
}
