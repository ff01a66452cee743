//! A body definition with its position and orientation applied.

use glam::{Quat, Vec3};

use super::definition::sinew_body_def;
use super::mesh::sinew_mesh_view;
use crate::base::{Result, finite, memory};
use crate::contact::Pose;
use crate::def::BodyDefinition;

impl sinew_body_def {
    /// Takes nodes and elements from a mesh.
    pub(super) fn take_mesh(&mut self, mesh: &sinew_mesh_view) {
        let is_surface = mesh.tetrahedron_count + mesh.cell_count == 0;
        let given = |pointer: *const u32, count: usize| if count > 0 { pointer } else { std::ptr::null() };
        self.positions = mesh.positions;
        self.node_count = mesh.node_count;
        self.triangle_count = if is_surface { mesh.triangle_count } else { 0 };
        self.triangles = given(mesh.triangles, self.triangle_count);
        self.tetrahedron_count = mesh.tetrahedron_count;
        self.tetrahedra = given(mesh.tetrahedra, self.tetrahedron_count);
        self.cell_count = mesh.cell_count;
        self.cells = given(mesh.cells, self.cell_count);
    }

    /// Makes something of the definition, its positions, rest positions and fibers moved to its pose.
    ///
    /// # Safety
    /// As [`definition`](Self::definition).
    pub(super) unsafe fn placed<T>(&self, make: impl FnOnce(&BodyDefinition) -> Result<T>) -> Result<T> {
        let definition = self.definition()?;
        finite("gravity_scale", self.gravity_scale)?;
        let pose = Pose {
            position: Vec3::from_array(self.position),
            orientation: Quat::from_array(self.orientation),
        };
        let pose = pose.checked()?;
        if pose == Pose::IDENTITY {
            return make(&definition);
        }
        let turn = pose.orientation.as_dquat().normalize();
        let moved = |vectors: &[Vec3], by: Vec3| -> Result<Vec<Vec3>> {
            let place = |at: &Vec3| (turn * at.as_dvec3() + by.as_dvec3()).as_vec3();
            let moved = memory::collected(vectors.iter().map(place))?;
            Ok(moved)
        };
        let positions = moved(definition.positions, pose.position)?;
        let rest = definition.rest_positions.map(|rest| moved(rest, pose.position));
        let rest = rest.transpose()?;
        let fibres = moved(definition.fibre_directions, Vec3::ZERO)?;
        make(&BodyDefinition {
            positions: &positions,
            rest_positions: rest.as_deref(),
            fibre_directions: &fibres,
            ..definition
        })
    }
}
