//! Mass for elements that motion has made stiff, so that no step is refused because of a few of them.
//!
//! Where a step would take more substeps than are allowed, each node is asked for the mass that it needs with its elements as they are
//! deformed, and masses are made for as many substeps as are allowed, with more mass than otherwise if need be. They stay so for a while. Nodes keep
//! their velocities but for what the added mass would add to the kinetic energy of the deformation, which is taken off all of it.
//!
//! Elements are looked at where the step begins and where it has come to: what is stiff now may be soft then. Each time they are taken to become
//! stiffer still, as far as there is mass for that.

use super::System;
use super::mass_scaling::MARGIN;
use super::needs::fewer_substeps;
use super::step_request::StepRequest;
use super::verlet::begin;
use crate::soa::Masses;
use crate::threads::Team;

impl System {
    /// Makes masses for elements as they are deformed: at the current state, and where a step that `was_tried` has come to; so many `times` in this
    /// step. The longest stable substep that the step then begins with, as far as springs are not concerned, s; `None`: there is not enough mass for
    /// that.
    pub(crate) fn relieve(&mut self, request: &StepRequest, was_tried: bool, times: i32, team: &Team) -> Option<f32> {
        if request.substeps > 0 || request.tolerance > 0.0 || !request.relieves {
            return None;
        }
        let scaling = self.scaling.as_mut()?;
        let growths = scaling.begin_relief()?;
        let tried = was_tried.then(|| self.state.newest().0);
        for positions in [Some(self.state.positions()), tried].into_iter().flatten() {
            self.forces.show_stiffenings(positions, &mut |corners, stiffening| {
                for node in corners {
                    if let Some(growth) = growths.get_mut(node as usize) {
                        *growth = growth.max(stiffening as f32);
                    }
                }
            });
        }
        let in_use = Masses {
            masses: &self.masses,
            inverse_masses: &self.inverse_masses,
            are_heavier: scaling.step() > 0.0,
        };
        let rates = self.damping.as_ref().map(|damping| damping.rates());
        scaling.relieve(&*self.forces.springs, &self.masses, rates, |node| {
            self.forces.carried_at_rest(node, in_use.inverse(node))
        });
        // With as much margin as there is mass for.
        let margins = (1..=times).rev().map(|power| MARGIN.powi(power));
        let masses_for = margins.into_iter().find_map(|margin| {
            self.scaling.as_mut()?.margin = margin;
            Some(fewer_substeps(self, request, 0.0)?.1)
        })?;
        self.scale_masses(masses_for);
        begin(self, request);
        Some(self.limit_beside_springs(team))
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

    /// An organ of elements, each node of which is moved by some millimetres.
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
        let moved = mesh.positions.iter().map(|&place| place + 2e-3 * random.vector());
        let moved: Vec<Vec3> = moved.collect();
        let body = world.body_mut(id).expect("a body");
        body.set_positions(&moved).expect("positions");
        (world, id)
    }

    #[test]
    fn what_is_put_back_is_as_heavy_as_before() {
        let (mut world, id) = crumpled(0.45);
        let system = world.body_mut(id).expect("a body").system_mut();
        let before = system.inverse_masses.clone();
        let request = StepRequest {
            relieves: true,
            ..StepRequest::alone(1e-2, 20)
        };
        let limit = system.relieve(&request, false, 1, &Team::alone());
        assert!(limit.is_some() && system.inverse_masses != before, "{limit:?}");
        system.put_back();
        assert_eq!(system.inverse_masses, before);
    }

    #[test]
    fn elements_one_by_one_give_the_bound_that_kernels_find() {
        for poisson_ratio in [0.3, 0.45] {
            let (mut world, id) = crumpled(poisson_ratio);
            let body = world.body_mut(id).expect("a body");
            let limit = f64::from(body.system_mut().limit_beside_springs(&Team::alone()));
            let forces = &body.system().forces;
            let mut stiffest = 0.0_f64;
            forces.show_stiffenings(body.system().state.positions(), &mut |corners, stiffening| {
                for node in corners {
                    let inverse_mass = body.system().inverse_masses[node as usize];
                    let carried = forces.carried_at_rest(node as usize, inverse_mass);
                    stiffest = stiffest.max(2.0 * stiffening * f64::from(carried.stiffness * inverse_mass));
                }
            });
            let found = 2.0 / stiffest.sqrt();
            assert!((found / limit - 1.0).abs() < 1e-4, "{found:e} s, {limit:e} s");
        }
    }
}
