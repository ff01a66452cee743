//! The elastic laws of the engines, in double precision. All have the same Young's modulus and Poisson's ratio at small
//! strains. They differ at large strains, so every law has its own reference.

use glam::DMat3;

/// The elastic law of a model's tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Law {
    /// No tetrahedra, only springs.
    Springs,
    /// `mu tr E² + lambda/2 (J - 1)²`, where E is Green's strain: the default of sinew for Poisson's ratios from 1/4 to
    /// 0.4.
    SignedVolume,
    /// The stable neo-Hookean law with a logarithm (Smith, de Goes, Kim 2018, equation 14).
    NeoHookean,
    /// The same law without the logarithm: `mu/2 (I1 - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)²`.
    PlainNeoHookean,
    /// The law of St Venant and Kirchhoff: `mu tr E² + lambda/2 (tr E)²`.
    StVenantKirchhoff,
}

impl Law {
    /// The name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Springs => "springs",
            Self::SignedVolume => "signed-volume",
            Self::NeoHookean => "neo-hookean",
            Self::PlainNeoHookean => "plain-neo-hookean",
            Self::StVenantKirchhoff => "st-venant-kirchhoff",
        }
    }

    /// The first Piola-Kirchhoff stress of a deformation gradient.
    pub fn stress(self, f: DMat3, mu: f64, lambda: f64) -> DMat3 {
        let cofactor = DMat3::from_cols(
            f.y_axis.cross(f.z_axis),
            f.z_axis.cross(f.x_axis),
            f.x_axis.cross(f.y_axis),
        );
        let volume = f.x_axis.dot(cofactor.x_axis);
        let green = || (f.transpose() * f - DMat3::IDENTITY) * 0.5;
        match self {
            Self::Springs => DMat3::ZERO,
            Self::SignedVolume => f * green() * (2.0 * mu) + cofactor * (lambda * (volume - 1.0)),
            Self::NeoHookean => {
                let (mu, lambda) = (4.0 / 3.0 * mu, lambda + 5.0 / 6.0 * mu);
                let square = f.x_axis.length_squared() + f.y_axis.length_squared() + f.z_axis.length_squared();
                f * (mu * (1.0 - 1.0 / (square + 1.0))) + cofactor * (lambda * (volume - 1.0) - 0.75 * mu)
            }
            Self::PlainNeoHookean => f * mu + cofactor * ((lambda + mu) * (volume - 1.0) - mu),
            Self::StVenantKirchhoff => {
                let strain = green();
                f * (strain * (2.0 * mu) + DMat3::IDENTITY * (lambda * trace(strain)))
            }
        }
    }
}

fn trace(matrix: DMat3) -> f64 {
    matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z
}

#[cfg(test)]
mod tests {
    use super::*;

    /// There is no stress at rest, and small strains follow Hooke's law.
    #[test]
    fn laws_agree_at_small_strains() {
        let (mu, lambda) = (3.0, 5.0);
        let small = 1e-6;
        let strain = DMat3::from_cols_array(&[1.0, 0.3, 0.2, 0.3, -0.5, 0.1, 0.2, 0.1, 0.7]) * small;
        let hooke = strain * (2.0 * mu) + DMat3::IDENTITY * (lambda * trace(strain));
        for law in [
            Law::SignedVolume,
            Law::NeoHookean,
            Law::PlainNeoHookean,
            Law::StVenantKirchhoff,
        ] {
            let difference = law.stress(DMat3::IDENTITY + strain, mu, lambda) - hooke;
            for value in difference.to_cols_array() {
                assert!(value.abs() < 1e-4 * small, "{}: {value}", law.name());
            }
        }
    }
}
