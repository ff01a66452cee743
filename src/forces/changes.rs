//! The product of the tangent and displacements, and the parts of the tangent for preconditioners.

use glam::DMat3;

use super::{ForceSum, Forces};
use crate::base::Result;
use crate::cavities;
use crate::codec::saved;
use crate::elements::{self, Sums};
use crate::soa::{Records, Vectors};
use crate::terms::TangentBlocks;
use crate::threads::Team;

/// Force changes that are not computed tile by tile.
#[derive(Debug, Default)]
pub(crate) struct ForceChanges {
    /// The displacements as records, for elements and for springs that gather them.
    pub records: Option<Records>,
    pub(super) elements: Option<Sums>,
    cavities: Option<cavities::PressureDifferentials>,
}

saved! { ForceChanges { records, elements, cavities } }

impl ForceChanges {
    /// Ends the use of an assembled tangent.
    pub fn discard_tangent(&mut self) {
        self.elements.iter_mut().for_each(Sums::discard_tangent);
    }
}

impl Forces {
    /// Allocates the memory for force changes.
    pub fn make_room_for_changes(&mut self) -> Result<()> {
        let records = self.records.as_ref();
        let records = records.map(|records| Records::zeros(records.as_slice().len()));
        let cavities = self.auxiliary.cavities.as_ref();
        self.changes = ForceChanges {
            records: records.transpose()?,
            elements: self
                .elements()
                .map(|elements| elements.new_differentials())
                .transpose()?,
            cavities: cavities.map(|cavities| cavities.new_differentials()).transpose()?,
        };
        Ok(())
    }

    /// Computes the first-order force changes that are not computed tile by tile. Records of positions and
    /// displacements must be up to date.
    pub fn find_changes(&self, displacements: &Vectors, changes: &mut ForceChanges, team: &Team) {
        if let (Some(elements), Some(sums)) = (&self.elements, &mut changes.elements)
            && let (Some(positions), Some(displacements)) = (&self.records, &changes.records)
        {
            elements.find_differentials(
                self.kernel,
                [positions.as_slice(), displacements.as_slice()],
                sums,
                team,
            );
        }
        if let (Some(cavities), Some(changes)) = (&self.auxiliary.cavities, &mut changes.cavities) {
            cavities.find_differentials(displacements, changes, team);
        }
    }

    /// Assembles the tangent of elements at the current records of positions, which makes the following products
    /// faster.
    pub fn assemble(&self, changes: &mut ForceChanges, team: &Team) {
        if let (Some(elements), Some(sums), Some(positions)) = (&self.elements, &mut changes.elements, &self.records) {
            elements.assemble(self.kernel, positions.as_slice(), sums, team);
        }
    }

    /// The sum of these changes with those of springs and terms.
    pub fn sum_of<'a>(&'a self, changes: &'a ForceChanges) -> ForceSum<'a> {
        let (elements, cavities) = (self.elements(), self.auxiliary.cavities.as_ref());
        ForceSum {
            elements: elements.map(|elements| elements.node_forces(changes.elements.as_ref())),
            cavities: cavities.map(|cavities| cavities.node_forces(changes.cavities.as_ref())),
            ..self.sum()
        }
    }

    /// Calls `f` with each element's corners, shape-function gradients and deformation at `positions`. Nodal-pressure
    /// terms are included as if each element had this share of them alone.
    pub fn visit_deformed(&self, positions: &Vectors, ring_share: f32, f: &mut elements::VisitDeformed) {
        let elements = self.elements.iter();
        elements.for_each(|elements| elements.visit_deformed(positions, ring_share, f));
    }

    /// Calls `f` with each term's nodes and its positive semidefinite blocks at `positions`.
    pub fn visit_term_blocks(&self, positions: &Vectors, f: &mut dyn FnMut(&[u32], &TangentBlocks)) {
        let at = |node: usize| positions.get(node).as_dvec3();
        self.auxiliary.visit_blocks(&at, false, f);
    }

    /// Calls `f` with the diagonal blocks of cavities at `positions`, N/m.
    pub fn visit_cavity_diagonal(&self, positions: &Vectors, f: &mut dyn FnMut(usize, DMat3)) {
        let at = |node: usize| positions.get(node).as_dvec3();
        let cavities = self.auxiliary.cavities.iter();
        cavities.for_each(|cavities| cavities.visit_diagonal(&at, f));
    }

    /// Calls `f` for each cavity with kappa divided by its rest volume, Pa/m³, and the volume gradients of its
    /// triangles.
    pub fn visit_cavity_factors(&self, positions: &Vectors, f: &mut dyn FnMut(f64, cavities::VolumeGradients)) {
        let at = |node: usize| positions.get(node).as_dvec3();
        let cavities = self.auxiliary.cavities.iter();
        cavities.for_each(|cavities| cavities.visit_factors(&at, f));
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::{ForceChanges, Forces};
    use crate::def::{BodyDefinition, ElementLaw, Material, Model, Solver, Viscosity};
    use crate::mesh::Mesh;
    use crate::random::Random;
    use crate::simd::{Kernel, Record};
    use crate::soa::{TileForces, Vectors, tile_count, tile_nodes};
    use crate::springs::{DirectionInput, Tangent};
    use crate::threads::Team;
    use crate::world::{World, WorldDefinition};

    fn products(
        forces: &Forces,
        positions: &Vectors,
        displacements: &Vectors,
        changes: &mut ForceChanges,
    ) -> Vec<Vec3> {
        for (node, Record(record)) in (0..).zip(changes.records.as_mut().expect("records").as_mut_slice()) {
            record[..3].copy_from_slice(&displacements.get(node).to_array());
        }
        forces.find_changes(displacements, changes, &Team::alone());
        let (node_count, sum) = (positions.len(), forces.sum_of(changes));
        let input = DirectionInput {
            node_count,
            positions: forces.view(positions),
            displacements: displacements.view().with_records(changes.records.as_ref()),
            tangent: Tangent { floor: 0.0, rate: 0.0 },
        };
        let mut products = Vec::new();
        for tile in 0..tile_count(node_count) {
            let (nodes, mut changes) = (tile_nodes(tile, node_count), TileForces::ZERO);
            sum.write_changes(tile, nodes.clone(), &input, &mut changes);
            products.extend((0..nodes.len()).map(|index| changes.get(index)));
        }
        products
    }

    #[test]
    fn the_assembled_tangent_matches_products_without_it() {
        let mesh = Mesh::organ(0.15, 0.15 / 12.0).expect("a mesh");
        let laws = [
            ElementLaw::StVenantKirchhoff,
            ElementLaw::NeoHookean,
            ElementLaw::MooneyRivlin { ratio: 0.4 },
        ];
        let settings = laws
            .map(|law| (law, 0.0))
            .into_iter()
            .chain([(ElementLaw::StVenantKirchhoff, 0.01)]);
        for ((law, viscosity), kernel) in
            settings.flat_map(|setting| [Kernel::Best, Kernel::Portable].map(|kernel| (setting, kernel)))
        {
            let mut world = World::new(WorldDefinition {
                kernel,
                ..WorldDefinition::default()
            })
            .expect("a world");
            let id = world.create_body(&BodyDefinition {
                material: Some(Material {
                    model: Model::Tetrahedra,
                    poisson_ratio: 0.3,
                    young_modulus: 5000.0,
                    density: 1060.0,
                    ..Material::default()
                }),
                element_law: law,
                viscosity: Viscosity {
                    retardation_time: viscosity,
                    relaxation_time: viscosity,
                },
                solver: Solver::Implicit,
                ..BodyDefinition::of(&mesh)
            });
            let mut random = Random(5);
            let id = id.expect("a body");
            let body = world.body_mut(id).expect("a body");
            let moved: Vec<Vec3> = mesh.positions.iter().map(|&at| at + 3e-3 * random.vector()).collect();
            body.set_positions(&moved).expect("positions");
            world.step(1e-3).expect("a step");
            let system = world.body_mut(id).expect("a body").system_mut();
            let mut displacements = Vectors::zeros(moved.len()).expect("displacements");
            (0..moved.len()).for_each(|node| displacements.set(node, random.vector()));
            let mut changes = std::mem::take(&mut system.forces.changes);
            let (forces, positions) = (&mut system.forces, system.state.positions());
            forces.write_records(positions, &Team::alone());
            let summed = products(forces, positions, &displacements, &mut changes);
            forces.assemble(&mut changes, &Team::alone());
            let assembled = products(forces, positions, &displacements, &mut changes);
            let scale = summed.iter().map(|product| product.length()).fold(0.0, f32::max);
            let distance = |(one, other): (&Vec3, &Vec3)| one.distance(*other);
            let largest = summed.iter().zip(&assembled).map(distance).fold(0.0, f32::max);
            assert!(
                scale > 1.0 && largest < 2e-6 * scale,
                "{law:?}, {kernel:?}: {largest:e} of {scale:e} N"
            );
            assert!(summed != assembled, "{law:?}: nothing was assembled");
            // A translation causes no force at all.
            (0..moved.len()).for_each(|node| displacements.set(node, Vec3::new(1.0, -2.0, 3.0)));
            let translated = products(forces, positions, &displacements, &mut changes);
            assert!(translated.iter().all(|product| *product == Vec3::ZERO));
        }
    }
}
