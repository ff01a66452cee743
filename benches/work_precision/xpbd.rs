//! XPBD with substeps of one iteration each (Macklin et al. 2019, "Small steps in physics simulation"), compliances 1 over
//! the stiffness, in displacements: what a substep solves for is how far nodes move in it, so that the velocity, that over h,
//! does not magnify the rounding of positions.
//!
//! Springs are coloured greedily; as many of a colour as there are lanes are worked on at a time.

use crate::bisection;
use crate::contender::{Contender, Setup, State, record, vector};
use crate::scene::Scene;
use crate::simd::{self, Kernel, Places, Proof, Record, Vector, lanes};

/// Squared lengths are no smaller, m².
const LEAST: f32 = 1e-30;

pub struct Xpbd {
    places: Vec<u32>,
    start: Vec<Record>,
    /// Of each node, where it was when the substep began, with the inverse mass beside it, and how far it has moved since;
    /// next to each other, since they are always wanted together.
    records: Vec<Record>,
    /// Of both ends of each spring, colour by colour, each colour filled up to the lanes: twice the number of the node.
    ends: [Places; 2],
    rest_lengths: Vec<f32>,
    /// 1 / (k h²)
    compliances: Vec<f32>,
    /// What gravity adds to a displacement in a substep, m.
    fall: Record,
    /// What is left of a velocity after a substep.
    damping: f32,
    steps: u32,
    /// s
    step: f64,
}

impl Xpbd {
    pub fn new(scene: &Scene, setup: Setup) -> Self {
        let order = bisection::order(scene);
        let places = bisection::places(&order);
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
        // For what fills up colours: two nodes that never move.
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
        for colour in coloured(scene, &places) {
            for &spring in &colour {
                let [a, b] = scene.springs[spring].map(|node| places[node as usize]);
                ends[0].push(2 * a);
                ends[1].push(2 * b);
                rest_lengths.push(scene.rest_lengths[spring]);
                compliances.push((1.0 / (f64::from(scene.stiffnesses[spring]) * h * h)) as f32);
            }
            let filled = ends[0].len().next_multiple_of(lanes());
            ends[0].resize(filled, 2 * spare);
            ends[1].resize(filled, 2 * (spare + 1));
            rest_lengths.resize(filled, 1.0);
            compliances.resize(filled, 1.0);
        }
        let mut xpbd = Self {
            places,
            records: Vec::new(),
            start,
            ends: ends.map(Places::new),
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
            let of = |&place: &u32| vector(&self.records[2 * place as usize + offset]);
            self.places.iter().map(of).collect::<Vec<_>>()
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

/// Ends a substep and begins the next: nodes are where they moved to, and will move as far again and by what gravity adds.
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
        let apart: [V; 3] = std::array::from_fn(|axis| (from[axis] - to[axis]) + (moved_a[axis] - moved_b[axis]));
        let square = apart[0]
            .mul_add(apart[0], apart[1].mul_add(apart[1], apart[2] * apart[2]))
            .max(least);
        let inverse_length = square.inverse_root();
        let stretch = square * inverse_length - V::load(proof, &xpbd.rest_lengths[at..]);
        let yielding = from[3] + to[3] + V::load(proof, &xpbd.compliances[at..]);
        let multiplier = (stretch * inverse_length).divided_by(yielding);
        let (share_a, share_b) = (multiplier * from[3], multiplier * to[3]);
        for axis in 0..3 {
            moved_a[axis] = moved_a[axis] - share_a * apart[axis];
            moved_b[axis] = moved_b[axis] + share_b * apart[axis];
        }
        V::store_records(moved_a, records, a, at, 1);
        V::store_records(moved_b, records, b, at, 1);
    }
}

/// Springs of which no two of a colour share a node, in the order of their nodes.
fn coloured(scene: &Scene, places: &[u32]) -> Vec<Vec<usize>> {
    let mut springs: Vec<usize> = (0..scene.springs.len()).collect();
    springs.sort_by_key(|&spring| {
        let [a, b] = scene.springs[spring].map(|node| places[node as usize]);
        (a.min(b), a.max(b))
    });
    let mut taken = vec![0u128; scene.node_count()];
    let mut colours: Vec<Vec<usize>> = Vec::new();
    for spring in springs {
        let [a, b] = scene.springs[spring].map(|node| node as usize);
        let colour = (taken[a] | taken[b]).trailing_ones() as usize;
        assert!(colour < 128, "a colour left");
        taken[a] |= 1 << colour;
        taken[b] |= 1 << colour;
        if colour == colours.len() {
            colours.push(Vec::new());
        }
        colours[colour].push(spring);
    }
    colours
}
