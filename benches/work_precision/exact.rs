//! Forces, energy and stability limit of a scene in `f64`.

use glam::DVec3;

use crate::random::Random;
use crate::scene::Scene;

/// A scene in `f64`.
pub struct Exact {
    pub springs: Vec<Spring>,
    /// Masses [kg]; 0 is pinned.
    pub masses: Vec<f64>,
    pub gravity: DVec3,
}

#[derive(Clone, Copy)]
pub struct Spring {
    pub a: u32,
    pub b: u32,
    pub stiffness: f64,
    pub rest_length: f64,
}

impl Spring {
    /// The vector from `b` to `a`.
    pub fn between(&self, vectors: &[DVec3]) -> DVec3 {
        vectors[self.a as usize] - vectors[self.b as usize]
    }
}

/// Energies [J].
#[derive(Clone, Copy)]
pub struct Energy {
    pub kinetic: f64,
    pub potential: f64,
}

impl Energy {
    pub fn total(self) -> f64 {
        self.kinetic + self.potential
    }
}

impl Exact {
    pub fn new(scene: &Scene) -> Self {
        let spring = |(index, &[a, b]): (usize, &[u32; 2])| Spring {
            a,
            b,
            stiffness: f64::from(scene.stiffnesses[index]),
            rest_length: f64::from(scene.rest_lengths[index]),
        };
        Self {
            springs: scene.springs.iter().enumerate().map(spring).collect(),
            masses: scene.masses.iter().map(|&mass| f64::from(mass)).collect(),
            gravity: scene.gravity.as_dvec3(),
        }
    }

    /// Computes the force of springs and gravity on each node [N]; zero for pinned nodes.
    pub fn forces(&self, positions: &[DVec3], forces: &mut [DVec3]) {
        for (force, &mass) in forces.iter_mut().zip(&self.masses) {
            *force = mass * self.gravity;
        }
        for spring in &self.springs {
            let apart = spring.between(positions);
            let length = apart.length();
            let pull = apart * (spring.stiffness * (spring.rest_length - length) / length);
            forces[spring.a as usize] += pull;
            forces[spring.b as usize] -= pull;
        }
        self.hold(forces);
    }

    /// The total force of the springs on the pinned nodes [N].
    pub fn force_on_pins(&self, positions: &[DVec3]) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for spring in &self.springs {
            let pinned = [spring.a, spring.b].map(|node| self.masses[node as usize] == 0.0);
            if pinned[0] != pinned[1] {
                let apart = spring.between(positions);
                let length = apart.length();
                let pull = apart * (spring.stiffness * (spring.rest_length - length) / length);
                sum += if pinned[0] { pull } else { -pull };
            }
        }
        sum
    }

    /// Sets the entries of pinned nodes to zero.
    pub fn hold(&self, vectors: &mut [DVec3]) {
        for (vector, &mass) in vectors.iter_mut().zip(&self.masses) {
            if mass == 0.0 {
                *vector = DVec3::ZERO;
            }
        }
    }

    pub fn energy(&self, positions: &[DVec3], velocities: &[DVec3]) -> Energy {
        let kinetic = |(mass, velocity): (&f64, &DVec3)| 0.5 * mass * velocity.length_squared();
        Energy {
            kinetic: self.masses.iter().zip(velocities).map(kinetic).sum(),
            potential: self.potential(positions),
        }
    }

    pub fn potential(&self, positions: &[DVec3]) -> f64 {
        let stretched = |spring: &Spring| {
            let stretch = spring.between(positions).length() - spring.rest_length;
            0.5 * spring.stiffness * stretch * stretch
        };
        let raised = |(mass, position): (&f64, &DVec3)| -mass * self.gravity.dot(*position);
        let elastic: f64 = self.springs.iter().map(stretched).sum();
        elastic + self.masses.iter().zip(positions).map(raised).sum::<f64>()
    }

    /// The longest stable leapfrog step at these positions with unstretched springs: 2 over the highest frequency, by
    /// power iteration.
    pub fn stable_step(&self, positions: &[DVec3]) -> f64 {
        let mut random = Random(1);
        let mut shape: Vec<DVec3> = positions
            .iter()
            .map(|_| DVec3::from_array(std::array::from_fn(|_| f64::from(random.signed()))))
            .collect();
        let mut pushed = vec![DVec3::ZERO; positions.len()];
        let mut stiffest = 0.0;
        for _ in 0..300 {
            self.hold(&mut shape);
            let size = shape.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
            shape.iter_mut().for_each(|v| *v /= size);
            pushed.fill(DVec3::ZERO);
            for spring in &self.springs {
                let along = spring.between(positions).normalize();
                let push = along * (spring.stiffness * along.dot(spring.between(&shape)));
                pushed[spring.a as usize] += push;
                pushed[spring.b as usize] -= push;
            }
            self.hold(&mut pushed);
            for (push, &mass) in pushed.iter_mut().zip(&self.masses) {
                *push /= if mass > 0.0 { mass } else { 1.0 };
            }
            stiffest = pushed.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
            std::mem::swap(&mut shape, &mut pushed);
        }
        2.0 / f64::sqrt(stiffest)
    }
}
