//! Strain of a mesh, from current positions and rest positions.
//!
//! A body keeps rest positions and elements only if it needs them, so the caller passes both. Any triangles, tetrahedra
//! and pairs of nodes can be used. Bodies whose strain is never queried use no extra memory. With other rest positions,
//! such as those of an earlier moment, the result is the strain since then.
//!
//! Let F be the deformation gradient of a triangle or tetrahedron and U its stretch, `F = R U` with a rotation R. The
//! principal strains are the eigenvalues of `U - 1` (engineering strain, Biot 1965): 0 under rigid motion, 0.1 for an
//! elongation by a tenth, -1 if flat.

use glam::{DMat3, DVec3, Vec3};

#[cfg(doc)]
use crate::base::Error;
use crate::base::{Result, all_finite, memory};
use crate::def::{Values, check_values, expect_count, finite_vectors, node_indices};

/// The strain of a triangle or tetrahedron. Without area or volume at rest the strain is 0.
///
/// ```
/// # use glam::Vec3;
/// use sinew::strain::{Strain, of_triangles};
/// let rest = [Vec3::ZERO, Vec3::X, Vec3::Z];
/// let stretched = [Vec3::ZERO, 1.5 * Vec3::X, Vec3::Z];
/// let mut strains = [Strain::default()];
/// of_triangles(&rest, &stretched, &[[0, 2, 1]], &mut strains)?;
/// assert_eq!(strains[0], Strain { largest: 0.5, smallest: 0.0, growth: 0.5 });
/// # Ok::<(), sinew::Error>(())
/// ```
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Strain {
    /// The largest principal strain: the relative elongation along the direction of largest stretch.
    pub largest: f32,
    /// The smallest principal strain, at least -1.
    pub smallest: f32,
    /// The relative change of area or volume, J - 1; below -1 for an inverted tetrahedron.
    pub growth: f32,
}

/// Writes the strain `L/L0 - 1` of lines between pairs of nodes, such as springs, with rest lengths in meters; 0 if the
/// rest length is 0.
///
/// # Errors
/// [`Error::InvalidArgument`]: the lists differ in length, a pair does not name two nodes, a position is
/// not finite, or a rest length is negative or not finite. After an error nothing is written.
pub fn of_springs(positions: &[Vec3], pairs: &[[u32; 2]], rest_lengths: &[f32], strains: &mut [f32]) -> Result<()> {
    finite_vectors("positions", positions)?;
    node_indices("pairs", pairs, positions.len())?;
    check_values("rest_length", &Values::Each(rest_lengths), pairs.len())?;
    expect_count("strains", strains.len(), pairs.len())?;
    for ((strain, &[a, b]), &rest_length) in strains.iter_mut().zip(pairs).zip(rest_lengths) {
        let [a, b] = [a, b].map(|node| positions[node as usize].as_dvec3());
        let rest_length = f64::from(rest_length);
        *strain = if rest_length > 0.0 {
            rounded(a.distance(b) / rest_length - 1.0)
        } else {
            0.0
        };
    }
    Ok(())
}

/// Writes the strain of triangles with these rest positions.
///
/// # Errors
/// [`Error::InvalidArgument`]: `positions` and `rest_positions`, or `strains` and `triangles`, differ in length, a
/// triangle does not name three nodes, or a position is not finite. After an error nothing is written.
pub fn of_triangles(
    rest_positions: &[Vec3],
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    strains: &mut [Strain],
) -> Result<()> {
    of_elements(
        "triangles",
        [rest_positions, positions],
        triangles,
        strains,
        of_triangle,
    )
}

/// Writes the strain of tetrahedra with these rest positions.
///
/// # Errors
/// Those of [`of_triangles`].
pub fn of_tetrahedra(
    rest_positions: &[Vec3],
    positions: &[Vec3],
    tetrahedra: &[[u32; 4]],
    strains: &mut [Strain],
) -> Result<()> {
    of_elements(
        "tetrahedra",
        [rest_positions, positions],
        tetrahedra,
        strains,
        of_tetrahedron,
    )
}

/// Writes for each node the mean of the values of its elements, for example to draw strain; 0 for a node without
/// elements.
///
/// # Errors
/// [`Error::InvalidArgument`]: `values` and elements differ in length, an element does not name `N` of the nodes, or a
/// value is not finite. [`Error::OutOfMemory`]. After an error nothing is written.
pub fn mean_at_nodes<const N: usize>(elements: &[[u32; N]], values: &[f32], means: &mut [f32]) -> Result<()> {
    node_indices("elements", elements, means.len())?;
    expect_count("values", values.len(), elements.len())?;
    all_finite("values", values)?;
    let mut sums = memory::filled((0.0_f64, 0_u32), means.len())?;
    for (nodes, &value) in elements.iter().zip(values) {
        for &node in nodes {
            let (sum, count) = &mut sums[node as usize];
            *sum += f64::from(value);
            *count += 1;
        }
    }
    for (mean, (sum, count)) in means.iter_mut().zip(sums) {
        *mean = rounded(sum / f64::from(count.max(1)));
    }
    Ok(())
}

fn of_elements<const N: usize>(
    name: &str,
    [rest, positions]: [&[Vec3]; 2],
    elements: &[[u32; N]],
    strains: &mut [Strain],
    of: impl Fn([[DVec3; N]; 2]) -> Option<Strain>,
) -> Result<()> {
    expect_count("positions", positions.len(), rest.len())?;
    finite_vectors("rest_positions", rest)?;
    finite_vectors("positions", positions)?;
    node_indices(name, elements, positions.len())?;
    expect_count("strains", strains.len(), elements.len())?;
    for (strain, corners) in strains.iter_mut().zip(elements) {
        let places = [rest, positions].map(|of| corners.map(|corner| of[corner as usize].as_dvec3()));
        *strain = of(places).unwrap_or_default();
    }
    Ok(())
}

/// `None` without area at rest.
fn of_triangle([rest, places]: [[DVec3; 3]; 2]) -> Option<Strain> {
    let edges = |[a, b, c]: [DVec3; 3]| [b - a, c - a];
    let ([a, b], [x, y]) = (edges(rest), edges(places));
    // In a frame whose first axis is the first rest edge.
    let length = a.length();
    let along = b.dot(a) / length;
    let height = (b - a * (along / length)).length();
    let first = x / length;
    let second = (y - first * along) / height;
    let scale = first.abs().max_element().max(second.abs().max_element());
    if !(height > 0.0 && scale.is_finite()) {
        return None;
    }
    if scale == 0.0 {
        return Some(Strain::FLAT);
    }
    let (first, second) = (first / scale, second / scale);
    let (xx, xy, yy) = (first.length_squared(), first.dot(second), second.length_squared());
    let (mean, spread) = (0.5 * (xx + yy), (0.25 * (xx - yy).powi(2) + xy * xy).sqrt());
    let area = first.cross(second).length();
    // The smaller stretch is the area over the larger one; a difference would cancel for thin triangles.
    let longest = (mean + spread).sqrt();
    Some(Strain::new(
        [longest, area / longest].map(|stretch| scale * stretch),
        area * scale * scale,
    ))
}

/// `None` without volume at rest.
fn of_tetrahedron([rest, places]: [[DVec3; 4]; 2]) -> Option<Strain> {
    let edges = |[a, b, c, d]: [DVec3; 4]| DMat3::from_cols(b - a, c - a, d - a);
    let gradient = edges(places) * edges(rest).inverse();
    let columns = [gradient.x_axis, gradient.y_axis, gradient.z_axis];
    let scale = columns.map(|column| column.abs().max_element());
    let scale = scale.into_iter().fold(0.0, f64::max);
    // A rest shape without a volume has an inverse that is not finite.
    let volume = edges(rest).determinant();
    if !(gradient.is_finite() && volume != 0.0) {
        return None;
    }
    if scale == 0.0 {
        return Some(Strain::FLAT);
    }
    let scaled = gradient * (1.0 / scale);
    let [smallest, _, largest] = eigenvalues(&(scaled.transpose() * scaled));
    let stretches = [largest, smallest].map(|square| scale * square.max(0.0).sqrt());
    Some(Strain::new(stretches, edges(places).determinant() / volume))
}

impl Strain {
    /// The strain of an element that has collapsed to a point.
    const FLAT: Self = Self {
        largest: -1.0,
        smallest: -1.0,
        growth: -1.0,
    };

    fn new([longest, shortest]: [f64; 2], size: f64) -> Self {
        Self {
            largest: rounded(longest - 1.0),
            smallest: rounded(shortest - 1.0),
            growth: rounded(size - 1.0),
        }
    }
}

/// The eigenvalues of a symmetric matrix, the smallest first (Smith 1961).
pub(crate) fn eigenvalues(matrix: &DMat3) -> [f64; 3] {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let mean = (x.x + y.y + z.z) / 3.0;
    let off = *matrix - DMat3::from_diagonal(DVec3::splat(mean));
    let squares = off.x_axis.length_squared() + off.y_axis.length_squared() + off.z_axis.length_squared();
    let spread = (squares / 6.0).sqrt();
    if spread == 0.0 {
        return [mean; 3];
    }
    let cosine = 0.5 * (off * (1.0 / spread)).determinant();
    let angle = libm::acos(cosine.clamp(-1.0, 1.0)) / 3.0;
    let largest = mean + 2.0 * spread * libm::cos(angle);
    let smallest = mean + 2.0 * spread * libm::cos(angle + std::f64::consts::TAU / 3.0);
    [smallest, 3.0 * mean - largest - smallest, largest]
}

/// Rounds to `f32`, without overflow.
fn rounded(value: f64) -> f32 {
    value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}
