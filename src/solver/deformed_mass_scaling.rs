//! Mass scaling for elements that motion has stiffened, so that a few of them do not cause a step to be rejected.
//!
//! If a step would take more substeps than allowed, masses are computed for the allowed number of substeps. Each node
//! then has the mass that its deformed elements need, within an increased bound. The masses stay for a while. Nodes
//! keep their velocities, except that the added kinetic energy of deformation is removed from the whole body.
//!
//! Stiffness is sampled at the start of the step and at the positions that an attempt has reached, because elements
//! that are stiff now may be soft then. Each repetition assumes further stiffening, as far as the mass bound permits.

use super::System;
use super::mass_scaling::{MIN_MARGIN, masses_in_use};
use super::step_request::StepRequest;
use super::substep_count::fewer_substeps;
use super::verlet::begin;
use crate::threads::Team;

impl System {
    /// Computes masses for deformed elements: at the current state and, if `was_tried`, at the positions of the
    /// attempted step. `times` counts the calls in this step. Returns the longest stable substep of all forces except
    /// springs at the start of the step (s), or `None` if the mass bound is too low.
    pub(crate) fn scale_for_deformation(
        &mut self,
        request: &StepRequest,
        was_tried: bool,
        times: i32,
        team: &Team,
    ) -> Option<f32> {
        if request.substeps > 0 || request.tolerance > 0.0 || !request.may_add_mass {
            return None;
        }
        let scaling = self.scaling.as_mut()?;
        let stiffenings = scaling.begin_stiffened()?;
        let tried = was_tried.then(|| self.state.newest().0);
        for positions in [Some(self.state.positions()), tried].into_iter().flatten() {
            self.forces.visit_stiffenings(positions, &mut |corners, stiffening| {
                for node in corners {
                    if let Some(node_stiffening) = stiffenings.get_mut(node as usize) {
                        *node_stiffening = node_stiffening.max(stiffening as f32);
                    }
                }
            });
        }
        let in_use = masses_in_use(&self.masses, &self.inverse_masses, Some(scaling));
        let rates = self.damping.as_ref().map(|damping| damping.rates());
        scaling.adopt_stiffenings(&*self.forces.springs, &self.masses, rates, |node| {
            self.forces.nodal_stiffness_at_rest(node, in_use.inverse(node))
        });
        // Use the largest margin that the mass bound permits.
        let margins = (1..=times).rev().map(|power| MIN_MARGIN.powi(power));
        let scaling_substep = margins.into_iter().find_map(|margin| {
            self.scaling.as_mut()?.margin = margin;
            Some(fewer_substeps(self, request, 0.0)?.1)
        })?;
        self.scale_masses(scaling_substep);
        begin(self, request);
        Some(self.non_spring_dt_limit(team))
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use crate::base::BodyId;
    use crate::def::{BodyDefinition, Material, Model};
    use crate::mesh::Mesh;
    use crate::random::Random;
    use crate::solver::StepRequest;
    use crate::threads::Team;
    use crate::world::{World, WorldDefinition};

    /// An organ of elements with node displacements of a few millimeters.
    fn crumpled(poisson_ratio: f32) -> (World, BodyId) {
        let mesh = Mesh::organ(0.15, 0.15 / 8.0).expect("a mesh");
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let id = world.create_body(&BodyDefinition {
            material: Some(Material {
                model: Model::Tetrahedra,
                poisson_ratio,
                young_modulus: 5000.0,
                density: 1060.0,
                ..Material::default()
            }),
            ..BodyDefinition::of(&mesh)
        });
        let mut random = Random(7);
        let id = id.expect("a body");
        let positions = mesh.positions.iter().map(|&position| position + 2e-3 * random.vector());
        let positions: Vec<Vec3> = positions.collect();
        let body = world.body_mut(id).expect("a body");
        body.set_positions(&positions).expect("positions");
        (world, id)
    }

    #[test]
    fn a_rollback_restores_masses() {
        let (mut world, id) = crumpled(0.45);
        let system = world.body_mut(id).expect("a body").system_mut();
        let before = system.inverse_masses.clone();
        let request = StepRequest {
            may_add_mass: true,
            ..StepRequest::alone(1e-2, 20)
        };
        let limit = system.scale_for_deformation(&request, false, 1, &Team::alone());
        assert!(limit.is_some() && system.inverse_masses != before, "{limit:?}");
        system.rollback();
        assert_eq!(system.inverse_masses, before);
    }

    #[test]
    fn per_element_bounds_match_the_kernels() {
        for poisson_ratio in [0.3, 0.45] {
            let (mut world, id) = crumpled(poisson_ratio);
            let body = world.body_mut(id).expect("a body");
            let limit = f64::from(body.system_mut().non_spring_dt_limit(&Team::alone()));
            let forces = &body.system().forces;
            let mut stiffest = 0.0_f64;
            forces.visit_stiffenings(body.system().state.positions(), &mut |corners, stiffening| {
                for node in corners {
                    let inverse_mass = body.system().inverse_masses[node as usize];
                    let carried = forces.nodal_stiffness_at_rest(node as usize, inverse_mass);
                    stiffest = stiffest.max(2.0 * stiffening * f64::from(carried.stiffness * inverse_mass));
                }
            });
            let found = 2.0 / stiffest.sqrt();
            assert!((found / limit - 1.0).abs() < 1e-4, "{found:e} s, {limit:e} s");
        }
    }
}
