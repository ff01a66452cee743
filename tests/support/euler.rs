//! One step of implicit Euler in `f64`, solved by dense elimination.

use glam::DVec3;

use super::bodies::{Parts, Random};

/// Returns a block that is clamped at one end. One spring in five is stiffer by the factor `contrast`.
pub fn uneven_block(contrast: f32) -> Parts {
    let mut parts = Parts::block([4, 3, 3], 0.05, 0.002, 20.0);
    let mut random = Random::new(11);
    for stiffness in &mut parts.stiffnesses {
        if random.below(5) == 0 {
            *stiffness *= contrast;
        }
    }
    for (position, mass) in parts.positions.iter().zip(&mut parts.masses) {
        if position.x < 0.01 {
            *mass = 0.0;
        }
    }
    parts
}

/// Computes the first step of implicit Euler in `f64`, by Newton's method with dense elimination, to rounding error.
pub fn euler_step(parts: &Parts, gravity: DVec3, h: f64) -> Vec<DVec3> {
    let start: Vec<DVec3> = parts.positions.iter().map(|p| p.as_dvec3()).collect();
    let free: Vec<usize> = (0..start.len()).filter(|&node| parts.masses[node] > 0.0).collect();
    let row_of: Vec<Option<usize>> = (0..start.len())
        .map(|node| free.iter().position(|&f| f == node))
        .collect();
    let size = 3 * free.len();
    let mut now = start.clone();
    for _ in 0..30 {
        let mut matrix = vec![vec![0.0; size + 1]; size];
        for (index, &node) in free.iter().enumerate() {
            let inertia = f64::from(parts.masses[node]) / (h * h);
            let residual = gravity * f64::from(parts.masses[node]) - (now[node] - start[node]) * inertia;
            for axis in 0..3 {
                matrix[3 * index + axis][3 * index + axis] += inertia;
                matrix[3 * index + axis][size] += residual[axis];
            }
        }
        for ((&[a, b], &k), &rest) in parts.springs.iter().zip(&parts.stiffnesses).zip(&parts.rest_lengths) {
            let [a, b] = [a as usize, b as usize];
            let (k, rest) = (f64::from(k), f64::from(rest));
            let offset = now[b] - now[a];
            let (length, direction) = (offset.length(), offset.normalize());
            let force = direction * (k * (length - rest));
            let transverse = k * (1.0 - rest / length);
            for (node, sign) in [(a, 1.0), (b, -1.0)] {
                let Some(row) = row_of[node] else { continue };
                for i in 0..3 {
                    matrix[3 * row + i][size] += sign * force[i];
                    for (other, other_sign) in [(a, 1.0), (b, -1.0)] {
                        let Some(column) = row_of[other] else { continue };
                        for j in 0..3 {
                            let unit = if i == j { transverse } else { 0.0 };
                            let entry = (k - transverse) * direction[i] * direction[j] + unit;
                            matrix[3 * row + i][3 * column + j] += sign * other_sign * entry;
                        }
                    }
                }
            }
        }
        let correction = eliminate(matrix);
        for (index, &node) in free.iter().enumerate() {
            now[node] += DVec3::from_slice(&correction[3 * index..3 * index + 3]);
        }
        if correction.iter().all(|c| c.abs() < 1e-14) {
            break;
        }
    }
    now
}

/// Solves a linear system whose right-hand side is the last column.
fn eliminate(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    let size = rows.len();
    for pivot in 0..size {
        let best = (pivot..size).max_by(|&a, &b| rows[a][pivot].abs().total_cmp(&rows[b][pivot].abs()));
        rows.swap(pivot, best.expect("rows"));
        let (above, below) = rows.split_at_mut(pivot + 1);
        let head = &above[pivot];
        for row in below {
            let factor = row[pivot] / head[pivot];
            for (entry, value) in row[pivot..].iter_mut().zip(&head[pivot..]) {
                *entry -= factor * value;
            }
        }
    }
    let mut solution = vec![0.0; size];
    for row in (0..size).rev() {
        let known_terms: f64 = (row + 1..size).map(|column| rows[row][column] * solution[column]).sum();
        solution[row] = (rows[row][size] - known_terms) / rows[row][row];
    }
    solution
}
