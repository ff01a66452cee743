//! XPBD with substeps of one iteration each (Macklin et al. 2019, "Small steps in physics simulation"), with
//! compliances of 1 over the stiffness. A substep solves for displacements, so that velocities, displacements over h,
//! do not magnify the rounding of positions.
//!
//! Springs are colored greedily; a vector processes as many springs of a color as it has lanes.

use crate::bisection;
use crate::contender::{Contender, Setup, State, record, vector};
use crate::scene::Scene;
use crate::simd::{self, IndexList, Kernel, Proof, Record, Vector, lanes};

/// Lower bound of squared lengths [m²].
const LEAST: f32 = 1e-30;

pub struct Xpbd {
    ranks: Vec<u32>,
    start: Vec<Record>,
    /// For each node two adjacent records: its position at the start of the substep with the inverse mass, and its
    /// displacement since.
    records: Vec<Record>,
    /// Both ends of each spring, color by color, padded to the lanes: twice the node's index.
    ends: [IndexList; 2],
    rest_lengths: Vec<f32>,
    /// 1 / (k h²)
    compliances: Vec<f32>,
    /// The displacement by gravity in a substep [m].
    fall: Record,
    /// The factor of velocities per substep.
    damping: f32,
    steps: u32,
    /// Duration of a substep [s].
    step: f64,
}

impl Xpbd {
    pub fn new(scene: &Scene, setup: Setup) -> Self {
        let order = bisection::order(scene);
        let ranks = bisection::ranks(&order);
        let h = setup.step();
        let mut start = Vec::new();
        for &node in &order {
            let mass = scene.masses[node as usize];
            start.push(record(
                scene.positions[node as usize],
                if mass > 0.0 { 1.0 / mass } else { 0.0 },
            ));
            start.push(Record::default());
        }
        // Padding of colors: two nodes that never move.
        let spare = scene.node_count() as u32;
        start.extend([
            Record::default(),
            Record::default(),
            record(glam::Vec3::X, 0.0),
            Record::default(),
        ]);
        let mut ends = [Vec::new(), Vec::new()];
        let mut rest_lengths = Vec::new();
        let mut compliances = Vec::new();
        for color in colored(scene, &ranks) {
            for &spring in &color {
                let [a, b] = scene.springs[spring].map(|node| ranks[node as usize]);
                ends[0].push(2 * a);
                ends[1].push(2 * b);
                rest_lengths.push(scene.rest_lengths[spring]);
                compliances.push((1.0 / (f64::from(scene.stiffnesses[spring]) * h * h)) as f32);
            }
            let padded = ends[0].len().next_multiple_of(lanes());
            ends[0].resize(padded, 2 * spare);
            ends[1].resize(padded, 2 * (spare + 1));
            rest_lengths.resize(padded, 1.0);
            compliances.resize(padded, 1.0);
        }
        let mut xpbd = Self {
            ranks,
            records: Vec::new(),
            start,
            ends: ends.map(IndexList::new),
            rest_lengths,
            compliances,
            fall: record(scene.gravity * (h * h) as f32, 0.0),
            damping: (-f64::from(scene.damping_rate) * h).exp() as f32,
            steps: setup.steps,
            step: h,
        };
        xpbd.restart();
        xpbd
    }
}

impl Contender for Xpbd {
    fn restart(&mut self) {
        self.records.clone_from(&self.start);
    }

    fn advance(&mut self) -> Result<(), String> {
        simd::run(Substeps(self));
        Ok(())
    }

    fn read(&mut self) -> State {
        let [at, moved] = [0, 1].map(|offset| {
            let of = |&rank: &u32| vector(&self.records[2 * rank as usize + offset]);
            self.ranks.iter().map(of).collect::<Vec<_>>()
        });
        State {
            positions: at.iter().zip(&moved).map(|(at, moved)| *at + *moved).collect(),
            velocities: moved.into_iter().map(|moved| moved / self.step).collect(),
        }
    }
}

/// The substeps of a span.
struct Substeps<'a>(&'a mut Xpbd);

impl Kernel for Substeps<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self, proof: Proof<V>) {
        for _ in 0..self.0.steps {
            predict(self.0);
            project(self.0, proof);
        }
    }
}

/// Ends a substep and begins the next: displacements are added to positions, and repeated with gravity's contribution.
#[inline(always)]
fn predict(xpbd: &mut Xpbd) {
    let (nodes, _) = xpbd.records.as_chunks_mut::<2>();
    for [position, moved] in nodes {
        *position = position.zip(*moved, |position, moved| position + moved);
        let next = moved.zip(xpbd.fall, |moved, fall| moved * xpbd.damping + fall);
        *moved = if position.0[3] > 0.0 { next } else { Record::default() };
    }
}

/// Corrects the displacements for one spring after the other.
#[inline(always)]
fn project<V: Vector>(xpbd: &mut Xpbd, proof: Proof<V>) {
    let records = &mut xpbd.records[..];
    let [a, b] = &xpbd.ends;
    let least = V::splat(proof, LEAST);
    for at in (0..xpbd.rest_lengths.len()).step_by(V::COUNT) {
        let from = V::load_records(proof, records, a, at, 0);
        let to = V::load_records(proof, records, b, at, 0);
        let mut moved_a = V::load_records(proof, records, a, at, 1);
        let mut moved_b = V::load_records(proof, records, b, at, 1);
        let separation: [V; 3] = std::array::from_fn(|axis| (from[axis] - to[axis]) + (moved_a[axis] - moved_b[axis]));
        let square = separation[0]
            .mul_add(
                separation[0],
                separation[1].mul_add(separation[1], separation[2] * separation[2]),
            )
            .max(least);
        let inverse_length = square.inverse_root();
        let stretch = square * inverse_length - V::load(proof, &xpbd.rest_lengths[at..]);
        let denominator = from[3] + to[3] + V::load(proof, &xpbd.compliances[at..]);
        let multiplier = (stretch * inverse_length).divided_by(denominator);
        let (share_a, share_b) = (multiplier * from[3], multiplier * to[3]);
        for axis in 0..3 {
            moved_a[axis] = moved_a[axis] - share_a * separation[axis];
            moved_b[axis] = moved_b[axis] + share_b * separation[axis];
        }
        V::store_records(moved_a, records, a, at, 1);
        V::store_records(moved_b, records, b, at, 1);
    }
}

/// Springs in colors, sorted by nodes; no two springs of a color share a node.
fn colored(scene: &Scene, ranks: &[u32]) -> Vec<Vec<usize>> {
    let mut springs: Vec<usize> = (0..scene.springs.len()).collect();
    springs.sort_by_key(|&spring| {
        let [a, b] = scene.springs[spring].map(|node| ranks[node as usize]);
        (a.min(b), a.max(b))
    });
    let mut used_colors = vec![0u128; scene.node_count()];
    let mut colors: Vec<Vec<usize>> = Vec::new();
    for spring in springs {
        let [a, b] = scene.springs[spring].map(|node| node as usize);
        let color = (used_colors[a] | used_colors[b]).trailing_ones() as usize;
        assert!(color < 128, "a colour left");
        used_colors[a] |= 1 << color;
        used_colors[b] |= 1 << color;
        if color == colors.len() {
            colors.push(Vec::new());
        }
        colors[color].push(spring);
    }
    colors
}
