use super::*;
use crate::random::Random;

fn matrix(random: &mut Random, size: f64) -> MatrixColumns<f64> {
    [[0; 3]; 3].map(|column| column.map(|_| size * (2.0 * f64::from(random.unit()) - 1.0)))
}

fn sum(a: MatrixColumns<f64>, b: MatrixColumns<f64>, factor: f64) -> MatrixColumns<f64> {
    std::array::from_fn(|column| std::array::from_fn(|row| a[column][row] + factor * b[column][row]))
}

const IDENTITY: MatrixColumns<f64> = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Deformations near rest, large ones, flat ones and inverted ones.
fn deformations(random: &mut Random) -> Vec<MatrixColumns<f64>> {
    let mut deformations = Vec::new();
    for size in [0.0, 1e-3, 0.1, 0.5, 1.0, 2.0] {
        for _ in 0..100 {
            deformations.push(sum(IDENTITY, matrix(random, size), 1.0));
            let mut other = sum(IDENTITY, matrix(random, 0.3 * size), 1.0);
            let factor = f64::from(random.unit()) * 2.0 - 1.0;
            other[2] = other[2].map(|entry| entry * factor);
            deformations.push(other);
        }
    }
    deformations
}

fn invariants(gradient: MatrixColumns<f64>) -> [f64; 3] {
    let state = StrainState::new(NeoHookean::new(1.0), gradient, 0.0);
    let i2 = inner(state.cofactors, state.cofactors);
    [state.i1, i2, state.volume_strain]
}

fn density(law: impl Hyperelastic, gradient: MatrixColumns<f64>, kappa: f64) -> f64 {
    let [i1, i2, volume_strain] = invariants(gradient);
    law.energy([i1, i2, volume_strain]) + 0.5 * kappa * volume_strain * volume_strain
}

/// Checks a law with mu = 1 Pa.
fn check(law: impl Hyperelastic) {
    const STEP: f64 = 1e-5;
    let mut random = Random(3);
    for kappa in [0.0, 1.5, 30.0] {
        let (least, most) = (1.0 / (kappa + 2.0 / 3.0), 1.0 / (kappa + 2.0));
        let rest = StrainState::new(law, IDENTITY, kappa);
        // At rest nothing is shifted, and the bound is nearly sharp.
        let (at_rest, lift) = rest.clamped();
        let removed = sum(at_rest.stress(), rest.stress(), -1.0);
        assert!(lift < 1e-12 && inner(removed, removed) < 1e-12, "{lift} {removed:?}");
        let stiffening = rest.stiffening(least, most);
        assert!((1.0..1.3).contains(&stiffening), "{stiffening}");
        for gradient in deformations(&mut random) {
            let at = StrainState::new(law, gradient, kappa);
            let size = 1.0 + kappa + inner(at.stress(), at.stress()).sqrt();
            let size = size * (1.0 + at.i1);
            let change = matrix(&mut random, 1.0);
            let deformed = |by: f64| sum(gradient, change, by);
            let expected = (density(law, deformed(STEP), kappa) - density(law, deformed(-STEP), kappa)) / (2.0 * STEP);
            assert!((inner(at.stress(), change) - expected).abs() < 1e-7 * size);
            let [more, less] = [STEP, -STEP].map(|by| StrainState::new(law, deformed(by), kappa).stress());
            let expected = sum(more, less, -1.0);
            let tangent = at.stress_change(change, 0.0);
            let error = sum(tangent, expected, -0.5 / STEP);
            assert!(inner(error, error).sqrt() < 1e-7 * size, "{error:?}");
            // The shifted tangent is positive semidefinite.
            let (clamped, lift) = at.clamped();
            for _ in 0..20 {
                let change = matrix(&mut random, 1.0);
                let form = inner(clamped.stress_change(change, lift), change);
                assert!(form > -1e-9 * size, "{form} {lift} {gradient:?}");
            }
            // No corner of a regular tetrahedron or of a needle is stiffer than the bound.
            let stiffening = at.stiffening(least, most);
            for shear in [1.0 / 3.0, 1.0] {
                for _ in 0..20 {
                    check_bound(&at, &mut random, stiffening * (kappa + 2.0 * shear), shear);
                }
            }
        }
    }
}

/// Checks that the quadratic form of any displacements is at most c sum |g|² |u|² / p, for a tetrahedron with this
/// fraction of shear.
fn check_bound(at: &StrainState<f64>, random: &mut Random, most: f64, shear: f64) {
    let regular = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let needle = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [-2.0, 0.0, 0.0]];
    let gradients: [[f64; 3]; 4] = if shear < 0.5 { regular } else { needle };
    let sizes = gradients.map(|gradient| gradient.iter().map(|x| x * x).sum::<f64>().sqrt());
    let total: f64 = sizes.iter().sum();
    let (mut change, mut bound) = ([[0.0; 3]; 3], 0.0);
    for (gradient, size) in gradients.into_iter().zip(sizes) {
        let [displacement, ..] = matrix(random, 1.0);
        for (column, component) in change.iter_mut().zip(gradient) {
            for (entry, displacement) in column.iter_mut().zip(displacement) {
                *entry += displacement * component;
            }
        }
        bound += most * size * total * displacement.iter().map(|x| x * x).sum::<f64>();
    }
    let form = inner(at.stress_change(change, 0.0), change);
    assert!(form <= bound * (1.0 + 1e-9), "{form} {bound} {:?}", at.gradient);
}

#[test]
fn stresses_and_tangents_are_derivatives_and_their_bounds_hold() {
    check(NeoHookean::new(1.0));
    for ratio in [0.0, 0.3, 1.0] {
        check(MooneyRivlin::new(1.0, ratio));
    }
}

#[test]
fn small_strains_depend_on_the_shear_modulus_alone() {
    fn check(law: impl Hyperelastic) {
        let strain = [[2e-5, 1e-5, -3e-5], [1e-5, -1e-5, 2e-5], [-3e-5, 2e-5, 4e-5]];
        let stress = StrainState::new(law, sum(IDENTITY, strain, 1.0), 0.0).stress();
        let error = sum(stress, strain, -2.0);
        assert!(inner(error, error).sqrt() < 2e-8, "{error:?}");
    }
    check(NeoHookean::new(1.0));
    check(MooneyRivlin::new(1.0, 0.4));
}

/// Lanes without a tetrahedron have F = 0; their results are summed with the others and must be finite.
#[test]
fn lanes_without_a_tetrahedron_give_finite_results() {
    fn check(law: impl Hyperelastic, kappa: f64) {
        let at = StrainState::new(law, [[0.0; 3]; 3], kappa);
        let (clamped, lift) = at.clamped();
        let changed = clamped.stress_change([[0.0; 3]; 3], lift);
        assert!(lift.is_finite() && inner(changed, IDENTITY).is_finite());
        assert!(at.stiffening(1.0, 1.0).is_finite() && inner(at.stress(), IDENTITY).is_finite());
    }
    for kappa in [0.0, 3.0] {
        check(NeoHookean::new(1.0), kappa);
        check(MooneyRivlin::new(1.0, 0.3), kappa);
    }
}
