//! The rest shape of a hanging body of springs, in `f64`: Newton's method with a line search on the total energy.

use glam::{DMat3, DVec3};

use crate::support::reference::Reference;

/// Returns the rest shape near the model's positions; pinned nodes stay.
pub fn rest_shape(model: &Reference) -> Vec<DVec3> {
    let mut model = model.clone();
    let free: Vec<usize> = (0..model.masses.len()).filter(|&i| model.masses[i] > 0.0).collect();
    for _ in 0..200 {
        let forces = total_forces(&model);
        let right: Vec<f64> = free.iter().flat_map(|&node| forces[node].to_array()).collect();
        let correction = solve(stiffness_matrix(&model, &free), right);
        let from = model.positions.clone();
        let energy = total_energy(&model);
        let mut share = 1.0;
        loop {
            for (free_index, &node) in free.iter().enumerate() {
                model.positions[node] = from[node] + share * DVec3::from_slice(&correction[3 * free_index..]);
            }
            if total_energy(&model) <= energy + 1e-14 * energy.abs() || share < 1e-9 {
                break;
            }
            share *= 0.5;
        }
        let longest = model.positions.iter().zip(&from).map(|(a, b)| a.distance(*b));
        if longest.fold(0.0, f64::max) < 1e-13 {
            return model.positions;
        }
    }
    panic!("the rest shape is not found");
}

fn total_forces(model: &Reference) -> Vec<DVec3> {
    let weights = model.masses.iter().map(|&mass| model.gravity * mass);
    model.forces().into_iter().zip(weights).map(|(f, w)| f + w).collect()
}

fn total_energy(model: &Reference) -> f64 {
    let weights = model.positions.iter().zip(&model.masses);
    model.elastic() - weights.map(|(p, &mass)| mass * model.gravity.dot(*p)).sum::<f64>()
}

/// Returns the stiffness of the free nodes without the negative terms of compressed springs: positive semidefinite, and
/// exact if no spring is compressed.
fn stiffness_matrix(model: &Reference, free: &[usize]) -> Vec<Vec<f64>> {
    let mut free_index = vec![usize::MAX; model.masses.len()];
    for (index, &node) in free.iter().enumerate() {
        free_index[node] = index;
    }
    let mut matrix = vec![vec![0.0; 3 * free.len()]; 3 * free.len()];
    for &([a, b], stiffness, rest_length) in &model.springs {
        let offset = model.positions[b as usize] - model.positions[a as usize];
        let (length, n) = (offset.length(), offset.normalize());
        let across = (1.0 - rest_length / length).max(0.0);
        let along = DMat3::from_cols(n * n.x, n * n.y, n * n.z);
        let block = stiffness * (along + across * (DMat3::IDENTITY - along));
        let ends = [free_index[a as usize], free_index[b as usize]];
        for i in ends {
            for j in ends {
                if i == usize::MAX || j == usize::MAX {
                    continue;
                }
                let sign = if i == j { 1.0 } else { -1.0 };
                for row in 0..3 {
                    for column in 0..3 {
                        matrix[3 * i + row][3 * j + column] += sign * block.col(column)[row];
                    }
                }
            }
        }
    }
    matrix
}

/// Solves by Cholesky factors; the symmetric `matrix` is made positive definite by a small multiple of its diagonal.
fn solve(mut matrix: Vec<Vec<f64>>, mut vector: Vec<f64>) -> Vec<f64> {
    let size = vector.len();
    let least = (0..size).map(|i| matrix[i][i]).fold(f64::INFINITY, f64::min);
    for i in 0..size {
        matrix[i][i] += 1e-9 * least;
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| matrix[i][k] * matrix[j][k]).sum();
            matrix[i][j] = if i == j {
                (matrix[i][i] - sum).max(f64::MIN_POSITIVE).sqrt()
            } else {
                (matrix[i][j] - sum) / matrix[j][j]
            };
        }
        let sum: f64 = (0..i).map(|k| matrix[i][k] * vector[k]).sum();
        vector[i] = (vector[i] - sum) / matrix[i][i];
    }
    for i in (0..size).rev() {
        let sum: f64 = (i + 1..size).map(|k| matrix[k][i] * vector[k]).sum();
        vector[i] = (vector[i] - sum) / matrix[i][i];
    }
    vector
}
