//! Queries of a body for a blade.

use glam::Vec3;

use super::cut_state::segment_crosses_triangle;
use super::{BladeStroke, Body};
use crate::base::Result;
use crate::cutting::{BladeContact, CutEnd, CutMaterial, Sweep};
use crate::def::{Anchor, SurfacePoint};
use crate::geometry::Aabb;

/// A point of the tissue that holds a blade.
#[derive(Clone, Copy, Debug)]
pub(crate) enum TissuePoint {
    Anchor(Anchor),
    /// Between nodes of a tetrahedron, in the caller's indices, with their weights.
    Inside([u32; 4], [f64; 4]),
}

impl Body {
    /// The work of cutting the body, J/m, for solids J/m². `None` if it cannot be cut.
    pub(crate) fn toughness(&self) -> Option<f32> {
        self.system.cut_properties.map(|cut| cut.toughness)
    }

    /// Finds the material that a blade passes through, at the current positions of the nodes. `near` returns the
    /// candidates.
    pub(crate) fn query_blade(
        &self,
        sweep: &Sweep,
        near: &mut Vec<u32>,
        contacts: &mut Vec<BladeContact>,
    ) -> Result<()> {
        near.clear();
        contacts.clear();
        let (Some(cut_state), true) = (&self.cut_state, self.is_near(sweep)) else {
            return Ok(());
        };
        self.items_near_sweep(cut_state, sweep, near)?;
        cut_state.material.query_blade(sweep, self.positions(), near, contacts)
    }

    /// The mean velocity of the tissue that an edge lies in, m/s; `None` if it lies in none. `near` returns the items
    /// it lies in.
    pub(crate) fn tissue_velocity(&self, edge: [Vec3; 2], near: &mut Vec<u32>) -> Result<Option<Vec3>> {
        near.clear();
        let sweep = Sweep { start: edge, end: edge };
        let (Some(cut_state), true) = (&self.cut_state, self.is_near(&sweep)) else {
            return Ok(None);
        };
        self.items_near_sweep(cut_state, &sweep, near)?;
        let (material, positions) = (&cut_state.material, self.positions());
        near.retain(|&item| {
            let [a, b, c, _] = material.item_corners(item).map(|corner| positions[corner as usize]);
            match material {
                CutMaterial::Springs(_) => false,
                CutMaterial::Surface(_) => segment_crosses_triangle(edge, [a, b, c]),
                CutMaterial::Solid(solid) => solid.end_in(item, &sweep, positions).is_some(),
            }
        });
        let velocities = self.velocities();
        let corners = near.iter().flat_map(|&item| material.item_corners(item));
        let sum: Vec3 = corners.map(|corner| velocities[corner as usize]).sum();
        Ok((!near.is_empty()).then(|| sum / (4 * near.len()) as f32))
    }

    /// True if the bounding boxes of the body and of the sweep overlap.
    fn is_near(&self, sweep: &Sweep) -> bool {
        let (bounds, origin) = (self.system.local_bounds(), self.system.origin.as_vec3());
        let slack = 1e-3 * self.system.extent() + 4.0 * f32::EPSILON * origin.abs().max_element();
        let bounds = Aabb {
            min: bounds.min + origin,
            max: bounds.max + origin,
        };
        bounds
            .extended(slack)
            .overlaps(&Aabb::of(sweep.start.into_iter().chain(sweep.end)))
    }

    /// Exchanges the stroke that the next cut continues.
    pub(crate) fn swap_stroke(&mut self, stroke: &mut BladeStroke) {
        if let Some(cut_state) = &mut self.cut_state {
            // The material has a part of the current stroke.
            cut_state.material.swap_stroke(&mut cut_state.stroke.solid_stroke);
            std::mem::swap(&mut cut_state.stroke, stroke);
            cut_state.material.swap_stroke(&mut cut_state.stroke.solid_stroke);
        }
    }

    /// True if the tissue at the end of a stroke has moved away.
    pub(crate) fn has_tissue_moved(&self, stroke: &BladeStroke) -> bool {
        self.cut_state
            .as_ref()
            .is_some_and(|cut_state| stroke.has_tissue_moved(&cut_state.material, self.positions()))
    }

    /// The point that holds the blade at an end of a cut.
    pub(crate) fn point_at_end(&self, end: &CutEnd) -> Option<TissuePoint> {
        let Some(vertex) = end.vertex else {
            return Some(TissuePoint::Inside(end.nodes, end.weights));
        };
        let vertices = self.cut_state.as_ref()?.material.surface()?.vertices();
        let point = vertices.get(vertex as usize)?.point;
        Some(TissuePoint::Anchor(Anchor::Node(point)))
    }

    /// The point with these weights in an item that a blade meets.
    pub(crate) fn point_in_item(&self, contacts: &BladeContact, weights: [f64; 4]) -> Option<TissuePoint> {
        let cut_state = self.cut_state.as_ref()?;
        if cut_state.material.surface().is_none() {
            return Some(TissuePoint::Inside(cut_state.material.nodes_of(contacts.item), weights));
        }
        let [a, b, c, _] = weights.map(|weight| weight as f32);
        Some(TissuePoint::Anchor(Anchor::Point(SurfacePoint {
            triangle: contacts.item,
            weights: [a, b, c],
        })))
    }
}
