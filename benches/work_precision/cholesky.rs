//! A sparse supernodal Cholesky factor, computed in `f64` by the multifrontal method (Duff and Reid 1983; Liu 1992). It
//! solves in `f32` with three right-hand sides at once.
//!
//! For a supernode the factor stores `P = [D^-1; B D^-1]`, where D is its triangle and B the rows below. Both passes of
//! a solve are then products with one dense matrix. The forward pass is `y = D^-1 x` and `x_below -= B D^-1 x`, the
//! backward pass `x = P^T [y; -x_below]`.

use crate::simd::{self, Kernel, Proof, Record, Vector, lanes};

/// The maximum number of columns of a supernode.
const WIDEST: usize = 96;
/// Supernodes are merged while the fraction of explicit zeros stays below this.
const MOST_ZEROS: f64 = 0.25;

/// A symmetric matrix by columns: the diagonal and the entries below it.
pub struct Matrix {
    pub diagonal: Vec<f64>,
    /// Row and value of each entry.
    pub below: Vec<Vec<(u32, f64)>>,
}

pub struct Factor {
    supernodes: Vec<Supernode>,
    /// Row indices of all supernodes below their own columns.
    rows: Vec<u32>,
    /// P of all supernodes, in groups of as many rows as a vector has records, column by column in each group.
    panels: Vec<f32>,
    /// Work space of a solve.
    inputs: Vec<Record>,
    sums: Vec<Record>,
}

/// Columns with the same row structure.
#[derive(Clone, Copy, Debug)]
struct Supernode {
    first: usize,
    columns: usize,
    /// Start and number of its rows.
    rows: (usize, usize),
    /// Start of its panel.
    panel: usize,
}

impl Factor {
    /// Factors a positive definite matrix.
    pub fn new(matrix: &Matrix) -> Self {
        let (mut supernodes, rows) = supernodes(matrix);
        let mut panels = Vec::new();
        let numeric = simd::run(Numeric {
            matrix,
            supernodes: &supernodes,
            rows: &rows,
        });
        let group = lanes() / 4;
        let mut tallest = 0;
        for (supernode, dense) in supernodes.iter_mut().zip(numeric) {
            supernode.panel = panels.len();
            let height = supernode.columns + supernode.rows.1;
            let padded = height.next_multiple_of(group);
            tallest = tallest.max(padded);
            for start in (0..padded).step_by(group) {
                for column in 0..supernode.columns {
                    let value = |row: usize| {
                        if row < height {
                            dense[column * height + row] as f32
                        } else {
                            0.0
                        }
                    };
                    panels.extend((start..start + group).map(value));
                }
            }
        }
        Self {
            supernodes,
            rows,
            panels,
            inputs: vec![Record::default(); tallest + 16],
            sums: vec![Record::default(); tallest + 16],
        }
    }

    /// Solves in place.
    pub fn solve(&mut self, vector: &mut [Record]) {
        simd::run(Solve { factor: self, vector });
    }
}

/// Finds the supernodes and the rows below their columns.
fn supernodes(matrix: &Matrix) -> (Vec<Supernode>, Vec<u32>) {
    let count = matrix.diagonal.len();
    let mut patterns: Vec<Vec<u32>> = vec![Vec::new(); count];
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); count];
    for column in 0..count {
        let mut pattern: Vec<u32> = matrix.below[column].iter().map(|entry| entry.0).collect();
        for &child in &children[column] {
            pattern.extend(patterns[child].iter().filter(|&&row| row as usize > column));
        }
        pattern.sort_unstable();
        pattern.dedup();
        if let Some(&parent) = pattern.first() {
            children[parent as usize].push(column);
        }
        patterns[column] = pattern;
    }
    let mut supernodes: Vec<Supernode> = Vec::new();
    let mut rows = Vec::new();
    let mut first = 0;
    while first < count {
        let mut last = first;
        let mut zeros = 0;
        while last + 1 < count && last + 1 - first < WIDEST && patterns[last].first() == Some(&(last as u32 + 1)) {
            let columns = last + 1 - first;
            let added = columns * (patterns[last + 1].len() + 1 - patterns[last].len());
            let size = (columns + 1) * (patterns[last + 1].len() + columns / 2 + 1);
            if (zeros + added) as f64 > MOST_ZEROS * size as f64 {
                break;
            }
            zeros += added;
            last += 1;
        }
        supernodes.push(Supernode {
            first,
            columns: last + 1 - first,
            rows: (rows.len(), patterns[last].len()),
            panel: 0,
        });
        rows.extend_from_slice(&patterns[last]);
        first = last + 1;
    }
    (supernodes, rows)
}

/// Computes P of each supernode, by columns.
struct Numeric<'a> {
    matrix: &'a Matrix,
    supernodes: &'a [Supernode],
    rows: &'a [u32],
}

impl Kernel for Numeric<'_> {
    type Output = Vec<Vec<f64>>;

    #[inline(always)]
    fn run<V: Vector>(self, _: Proof<V>) -> Vec<Vec<f64>> {
        let Self {
            matrix,
            supernodes,
            rows,
        } = self;
        let mut supernode_of = vec![0; matrix.diagonal.len()];
        for (index, supernode) in supernodes.iter().enumerate() {
            supernode_of[supernode.first..supernode.first + supernode.columns].fill(index);
        }
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); supernodes.len()];
        let mut updates: Vec<Vec<f64>> = vec![Vec::new(); supernodes.len()];
        let mut local_rows = vec![0; matrix.diagonal.len()];
        let mut panels = Vec::new();
        for (index, supernode) in supernodes.iter().enumerate() {
            let Supernode { first, columns, .. } = *supernode;
            let below = &rows[supernode.rows.0..][..supernode.rows.1];
            let height = columns + below.len();
            for column in 0..columns {
                local_rows[first + column] = column;
            }
            for (row, &node) in below.iter().enumerate() {
                local_rows[node as usize] = columns + row;
            }
            let mut front = vec![0.0; height * height];
            for column in 0..columns {
                front[column * height + column] = matrix.diagonal[first + column];
                for &(row, value) in &matrix.below[first + column] {
                    front[column * height + local_rows[row as usize]] = value;
                }
            }
            for &child in &children[index] {
                let update = std::mem::take(&mut updates[child]);
                let (start, size) = supernodes[child].rows;
                let rows = &rows[start..start + size];
                for (column, &node) in rows.iter().enumerate() {
                    let to = local_rows[node as usize] * height;
                    for row in column..size {
                        front[to + local_rows[rows[row] as usize]] += update[column * size + row];
                    }
                }
            }
            eliminate(&mut front, height, columns);
            if let Some(&parent) = below.first() {
                children[supernode_of[parent as usize]].push(index);
                let mut update = Vec::with_capacity(below.len() * below.len());
                for column in columns..height {
                    update.extend_from_slice(&front[column * height + columns..(column + 1) * height]);
                }
                updates[index] = update;
            }
            front.truncate(columns * height);
            invert(&mut front, height, columns);
            panels.push(front);
        }
        panels
    }
}

/// Factors the first columns of a dense matrix and updates the others, four columns at a time.
#[inline(always)]
fn eliminate(front: &mut [f64], height: usize, columns: usize) {
    const TOGETHER: usize = 4;
    for start in (0..columns).step_by(TOGETHER) {
        let end = (start + TOGETHER).min(columns);
        for pivot in start..end {
            let (done, rest) = front.split_at_mut((pivot + 1) * height);
            let column = &mut done[pivot * height..];
            let scale = 1.0 / column[pivot].sqrt();
            column[pivot..].iter_mut().for_each(|value| *value *= scale);
            for target in pivot + 1..end {
                let factor = column[target];
                let to = &mut rest[(target - pivot - 1) * height..][..height];
                subtract(to, target, [(&*column, factor)]);
            }
        }
        let (done, rest) = front.split_at_mut(end * height);
        let column = |pivot: usize| &done[pivot * height..][..height];
        for target in end..height {
            let to = &mut rest[(target - end) * height..][..height];
            if end - start == TOGETHER {
                let four: [_; TOGETHER] = std::array::from_fn(|k| (column(start + k), column(start + k)[target]));
                subtract(to, target, four);
            } else {
                for pivot in start..end {
                    subtract(to, target, [(column(pivot), column(pivot)[target])]);
                }
            }
        }
    }
}

/// Subtracts multiples of columns from another, from row `from` on.
#[inline(always)]
fn subtract<const N: usize>(to: &mut [f64], from: usize, columns: [(&[f64], f64); N]) {
    let columns = columns.map(|(column, factor)| (&column[from..], factor));
    for (row, value) in to[from..].iter_mut().enumerate() {
        for (column, factor) in &columns {
            *value -= column[row] * factor;
        }
    }
}

/// Turns columns of L into P: inverts the triangle and multiplies the rows below by the inverse.
#[inline(always)]
fn invert(front: &mut [f64], height: usize, columns: usize) {
    // P = [1; B] D^-1 solves P D = [1; B]: column by column from the last.
    let mut diagonal = vec![0.0; columns];
    let mut triangle = front.to_vec();
    for column in 0..columns {
        diagonal[column] = triangle[column * height + column];
        triangle[column * height..][..columns].fill(0.0);
        triangle[column * height + column] = 1.0;
    }
    for column in (0..columns).rev() {
        let (before, after) = triangle.split_at_mut((column + 1) * height);
        let target = &mut before[column * height..];
        for other in column + 1..columns {
            let factor = front[column * height + other];
            subtract(target, 0, [(&after[(other - column - 1) * height..][..height], factor)]);
        }
        let scale = 1.0 / diagonal[column];
        target.iter_mut().for_each(|value| *value *= scale);
    }
    front.copy_from_slice(&triangle);
}

/// Both passes of a solve.
struct Solve<'a> {
    factor: &'a mut Factor,
    vector: &'a mut [Record],
}

impl Kernel for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self, proof: Proof<V>) {
        let Self { factor, vector } = self;
        let Factor {
            supernodes,
            rows,
            panels,
            inputs,
            sums,
        } = factor;
        let group = V::COUNT / 4;
        for supernode in supernodes.iter() {
            let Supernode { first, columns, .. } = *supernode;
            let below = &rows[supernode.rows.0..][..supernode.rows.1];
            let height = columns + below.len();
            inputs[..columns].copy_from_slice(&vector[first..first + columns]);
            let panel = &panels[supernode.panel..][..height.next_multiple_of(group) * columns];
            multiply(proof, panel, &inputs[..columns], sums);
            vector[first..first + columns].copy_from_slice(&sums[..columns]);
            for (&row, sum) in below.iter().zip(&sums[columns..]) {
                let value = &mut vector[row as usize];
                *value = value.zip(*sum, |value, sum| value - sum);
            }
        }
        for supernode in supernodes.iter().rev() {
            let Supernode { first, columns, .. } = *supernode;
            let below = &rows[supernode.rows.0..][..supernode.rows.1];
            let height = columns + below.len();
            inputs[..columns].copy_from_slice(&vector[first..first + columns]);
            for (&row, input) in below.iter().zip(&mut inputs[columns..]) {
                *input = Record(vector[row as usize].0.map(|value| -value));
            }
            let padded = height.next_multiple_of(group);
            inputs[height..padded].fill(Record::default());
            let panel = &panels[supernode.panel..][..padded * columns];
            multiply_transposed(proof, panel, &inputs[..padded], &mut vector[first..first + columns]);
        }
    }
}

/// Number of row groups that are processed together, so that sums are independent.
const GROUPS: usize = 4;

/// `sums = panel inputs`
#[inline(always)]
fn multiply<V: Vector>(proof: Proof<V>, panel: &[f32], inputs: &[Record], sums: &mut [Record]) {
    let group = V::COUNT / 4;
    let stride = inputs.len() * group;
    let mut done = 0;
    let mut chunks = panel.chunks_exact(GROUPS * stride);
    for chunk in &mut chunks {
        let mut totals = [V::splat(proof, 0.0); GROUPS];
        for (column, input) in inputs.iter().enumerate() {
            let input = V::repeat(proof, input);
            for (index, total) in totals.iter_mut().enumerate() {
                *total = V::spread(proof, &chunk[index * stride + column * group..]).mul_add(input, *total);
            }
        }
        for total in totals {
            total.store_adjacent(&mut sums[done..]);
            done += group;
        }
    }
    for chunk in chunks.remainder().chunks_exact(stride) {
        let mut total = V::splat(proof, 0.0);
        for (input, values) in inputs.iter().zip(chunk.chunks_exact(group)) {
            total = V::spread(proof, values).mul_add(V::repeat(proof, input), total);
        }
        total.store_adjacent(&mut sums[done..]);
        done += group;
    }
}

/// Number of columns that are processed together.
const COLUMNS: usize = 8;

/// `outputs = panel^T inputs`
#[inline(always)]
fn multiply_transposed<V: Vector>(proof: Proof<V>, panel: &[f32], inputs: &[Record], outputs: &mut [Record]) {
    let group = V::COUNT / 4;
    let stride = outputs.len() * group;
    let (eights, rest) = outputs.as_chunks_mut::<COLUMNS>();
    let mut column = 0;
    for outputs in eights {
        let mut totals = [V::splat(proof, 0.0); COLUMNS];
        for (values, inputs) in panel.chunks_exact(stride).zip(inputs.chunks_exact(group)) {
            let input = V::load_adjacent(proof, inputs);
            let values = &values[column * group..][..COLUMNS * group];
            for (index, total) in totals.iter_mut().enumerate() {
                *total = V::spread(proof, &values[index * group..]).mul_add(input, *total);
            }
        }
        *outputs = totals.map(V::folded);
        column += COLUMNS;
    }
    for output in rest {
        let mut total = V::splat(proof, 0.0);
        for (values, inputs) in panel.chunks_exact(stride).zip(inputs.chunks_exact(group)) {
            let values = V::spread(proof, &values[column * group..]);
            total = values.mul_add(V::load_adjacent(proof, inputs), total);
        }
        *output = total.folded();
        column += 1;
    }
}
