//! Strain against deformations with known principal stretches, and against its definition: the largest and smallest
//! stretch of any direction.

use crate::support::bodies::Random;
use glam::{DMat3, DQuat, DVec3, Quat, Vec3};
use sinew::strain::{self, Strain};

/// An irregular tetrahedron; its first three corners are an irregular triangle.
const REST: [Vec3; 4] = [
    Vec3::new(0.1, 0.2, -0.1),
    Vec3::new(1.3, 0.1, 0.2),
    Vec3::new(0.2, 0.9, 0.1),
    Vec3::new(0.3, 0.1, 1.2),
];

fn moved(deformation: DMat3) -> Vec<Vec3> {
    let place = |p: &Vec3| (deformation * p.as_dvec3() + DVec3::new(0.3, -0.2, 0.5)).as_vec3();
    REST.iter().map(place).collect()
}

fn tetrahedron_strain(deformation: DMat3) -> Strain {
    let mut strains = [Strain::default()];
    strain::of_tetrahedra(&REST, &moved(deformation), &[[0, 1, 2, 3]], &mut strains).expect("a strain");
    strains[0]
}

/// Returns the strain of a triangle at rest in the plane z = 0, rotated out of it.
fn triangle_strain(deformation: DMat3, turn: DQuat) -> Strain {
    let rest = REST.map(|p| Vec3::new(p.x, p.y, 0.0));
    let deformed = rest.map(|p| (turn * (deformation * p.as_dvec3())).as_vec3());
    let rest = rest.map(|p| turn.as_quat() * p);
    let mut strains = [Strain::default()];
    strain::of_triangles(&rest, &deformed, &[[0, 1, 2]], &mut strains).expect("a strain");
    strains[0]
}

fn assert_strain(strain: Strain, largest: f64, smallest: f64, growth: f64) {
    let error = [
        f64::from(strain.largest) - largest,
        f64::from(strain.smallest) - smallest,
        f64::from(strain.growth) - growth,
    ];
    // The inputs are rounded to `f32`.
    let allowed = 2e-6 * (1.0 + largest.abs() + growth.abs());
    assert!(
        error.iter().all(|error| error.abs() < allowed),
        "{strain:?}: not {largest} {smallest} {growth}"
    );
}

fn turn(random: &mut Random) -> DQuat {
    let axis = random.vector().normalize_or(Vec3::X);
    Quat::from_axis_angle(axis, 3.0 * random.signed())
        .as_dquat()
        .normalize()
}

#[test]
fn known_deformations_have_their_strain() {
    let mut random = Random::new(1);
    for _ in 0..20 {
        let [before, after] = [turn(&mut random), turn(&mut random)];
        let rotated = |stretch: DMat3| DMat3::from_quat(after) * stretch * DMat3::from_quat(before);
        assert_strain(tetrahedron_strain(rotated(DMat3::IDENTITY)), 0.0, 0.0, 0.0);
        assert_strain(triangle_strain(DMat3::IDENTITY, after), 0.0, 0.0, 0.0);
        for (along, across) in [(1.3, 0.9), (0.4, 1.2), (1.0001, 1.0), (30.0, 0.05)] {
            let stretch = DMat3::from_diagonal(DVec3::new(along, across, across));
            let (largest, smallest) = (f64::max(along, across), f64::min(along, across));
            let volume = along * across * across;
            assert_strain(
                tetrahedron_strain(rotated(stretch)),
                largest - 1.0,
                smallest - 1.0,
                volume - 1.0,
            );
            let strain = triangle_strain(stretch, after);
            assert_strain(strain, largest - 1.0, smallest - 1.0, along * across - 1.0);
        }
        for shear in [0.001, 0.2, -1.5] {
            let sheared = DMat3::from_cols(DVec3::X, DVec3::new(shear, 1.0, 0.0), DVec3::Z);
            // The principal stretches of simple shear are sqrt(1 + g²/4) ± g/2, and 1.
            let (middle, half) = ((1.0 + 0.25 * shear * shear).sqrt(), 0.5 * f64::abs(shear));
            let (largest, smallest) = (middle + half - 1.0, middle - half - 1.0);
            assert_strain(tetrahedron_strain(rotated(sheared)), largest, smallest, 0.0);
            assert_strain(triangle_strain(sheared, after), largest, smallest, 0.0);
        }
    }
}

#[test]
fn no_direction_becomes_longer_or_shorter_than_the_principal_ones() {
    let mut random = Random::new(2);
    for _ in 0..200 {
        let [a, b, c] = [0; 3].map(|_| random.vector().as_dvec3());
        let deformation = DMat3::from_cols(a, b, c);
        let strain = tetrahedron_strain(deformation);
        let (mut longest, mut shortest) = (0.0_f64, f64::INFINITY);
        for _ in 0..3000 {
            let stretch = (deformation * random.vector().as_dvec3().normalize_or(DVec3::X)).length();
            (longest, shortest) = (longest.max(stretch), shortest.min(stretch));
        }
        let [largest, smallest] = [strain.largest, strain.smallest].map(|strain| f64::from(strain) + 1.0);
        assert!(
            longest < largest + 1e-5 && longest > 0.98 * largest,
            "{longest} {largest}"
        );
        assert!(
            shortest > smallest - 1e-5 && shortest < smallest + 0.1 * largest,
            "{shortest} {smallest}"
        );
        let volume = f64::from(strain.growth) + 1.0;
        assert!((volume - deformation.determinant()).abs() < 1e-5, "{volume}");
        // The product of all three stretches is the volume, so the middle one lies between the others.
        let middle = volume.abs() / (largest * smallest);
        assert!(middle < largest + 1e-3 && middle > smallest - 1e-3 || smallest < 1e-3);
    }
}

#[test]
fn inverted_flat_and_collapsed() {
    let mirrored = tetrahedron_strain(DMat3::from_diagonal(DVec3::new(1.0, 1.0, -0.8)));
    assert_strain(mirrored, 0.0, -0.2, -1.8);
    let flat = tetrahedron_strain(DMat3::from_diagonal(DVec3::new(1.1, 1.0, 0.0)));
    assert_strain(flat, 0.1, -1.0, -1.0);
    let strain = tetrahedron_strain(DMat3::ZERO);
    assert_strain(strain, -1.0, -1.0, -1.0);
    assert_strain(triangle_strain(DMat3::ZERO, DQuat::IDENTITY), -1.0, -1.0, -1.0);
    let line = DMat3::from_diagonal(DVec3::new(1.5, 0.0, 1.0));
    assert_strain(triangle_strain(line, DQuat::IDENTITY), 0.5, -1.0, -1.0);
    // The strain relative to a rest size of zero is undefined.
    let deformed = moved(DMat3::IDENTITY);
    for at_rest in [Vec3::ZERO, Vec3::new(f32::MIN_POSITIVE, 0.0, 0.0)] {
        let rest = [at_rest, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO];
        let mut strains = [Strain {
            largest: 7.0,
            ..Strain::default()
        }];
        strain::of_tetrahedra(&rest, &deformed, &[[0, 1, 2, 3]], &mut strains).expect("a strain");
        assert_eq!(strains[0], Strain::default());
        strain::of_triangles(&rest, &deformed, &[[0, 1, 2]], &mut strains).expect("a strain");
        assert_eq!(strains[0], Strain::default());
    }
}

#[test]
fn finite_positions_have_finite_strain() {
    let mut random = Random::new(3);
    let sizes = [0.0, f32::MIN_POSITIVE, 1e-45, 1e-20, 1.0, 1e20, f32::MAX];
    let mut positions = || [0; 4].map(|_| random.vector() * sizes[random.below(sizes.len())]);
    for _ in 0..20_000 {
        let (rest, deformed) = (positions(), positions());
        let mut strains = [Strain::default(); 2];
        strain::of_tetrahedra(&rest, &deformed, &[[0, 1, 2, 3]], &mut strains[..1]).expect("a strain");
        strain::of_triangles(&rest, &deformed, &[[0, 1, 2]], &mut strains[1..]).expect("a strain");
        let mut lines = [0.0];
        strain::of_springs(&deformed, &[[0, 1]], &[rest[0].x.abs()], &mut lines).expect("a strain");
        for strain in strains {
            assert!(
                strain.largest.is_finite() && strain.growth.is_finite(),
                "{strain:?} {rest:?} {deformed:?}"
            );
            assert!(
                strain.smallest >= -1.0 && strain.smallest <= strain.largest,
                "{strain:?} {rest:?} {deformed:?}"
            );
        }
        assert!(lines[0].is_finite() && lines[0] >= -1.0);
    }
}

#[test]
fn springs_and_means() {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 3.0, 4.0)];
    let mut strains = [9.0; 3];
    let pairs = [[0, 1], [2, 0], [1, 0]];
    strain::of_springs(&positions, &pairs, &[0.5, 4.0, 0.0], &mut strains).expect("strains");
    assert_eq!(strains, [1.0, 0.25, 0.0]);
    let mut means = [9.0; 4];
    strain::mean_at_nodes(&[[0, 1, 2], [2, 1, 3]], &[1.0, 4.0], &mut means).expect("means");
    assert_eq!(means, [1.0, 2.5, 2.5, 4.0]);
    strain::mean_at_nodes(&[[0, 1]], &[3.0], &mut means).expect("means");
    assert_eq!(means, [3.0, 3.0, 0.0, 0.0]);
}

#[test]
fn refused_queries_write_nothing() {
    let deformed = moved(DMat3::IDENTITY);
    let mut bad = deformed.clone();
    bad[3].y = f32::NAN;
    let untouched = Strain {
        largest: 7.0,
        ..Strain::default()
    };
    let mut strains = [untouched; 2];
    let good = [[0, 1, 2, 3], [3, 2, 1, 0]];
    for (rest, positions, tetrahedra, count, name) in [
        (&REST[..], &deformed[..3], good, 2, "positions"),
        (&REST, &bad, good, 2, "positions[3]"),
        (&bad, &deformed, good, 2, "rest_positions[3]"),
        (&REST, &deformed, [good[0], [0, 1, 2, 4]], 2, "tetrahedra[1]"),
        (&REST, &deformed, [good[0], [0, 1, 2, 2]], 2, "tetrahedra[1]"),
        (&REST, &deformed, good, 1, "strains"),
    ] {
        let refused = strain::of_tetrahedra(rest, positions, &tetrahedra, &mut strains[..count]);
        let message = refused.expect_err(name).to_string();
        assert!(message.contains(name), "{message}");
        assert_eq!(strains, [untouched; 2]);
    }
    let mut lines = [7.0];
    for lengths in [&[][..], &[-1.0], &[f32::NAN], &[1.0, 1.0]] {
        assert!(strain::of_springs(&deformed, &[[0, 1]], lengths, &mut lines).is_err());
    }
    assert!(strain::mean_at_nodes(&[[0, 1]], &[1.0], &mut lines).is_err());
    assert!(strain::mean_at_nodes::<1>(&[[0]], &[f32::NAN], &mut lines).is_err());
    assert_eq!(lines, [7.0]);
}
