//! What a blade finds of a body.

use glam::Vec3;

use super::cuttable::passes;
use super::{Body, Stroke};
use crate::base::Result;
use crate::cutting::{CutEnd, CutMaterial, Met, Sweep};
use crate::def::{Anchor, SurfacePoint};
use crate::geometry::Bounds;

/// A point of the tissue in which a blade stands.
#[derive(Clone, Copy, Debug)]
pub(crate) enum HoldAt {
    Anchor(Anchor),
    /// Between nodes of a solid's cell, in the caller's numbers.
    Inside([u32; 4], [f64; 4]),
}

impl Body {
    /// What it takes to cut it, J/m, of solids J/m²; `None`: it cannot be cut.
    pub(crate) fn toughness(&self) -> Option<f32> {
        self.system.may_be_cut.map(|cut| cut.toughness)
    }

    /// What of its material a blade would pass through, in the places of the nodes as they are. `near` becomes what it may meet.
    pub(crate) fn meet_blade(&self, sweep: &Sweep, near: &mut Vec<u32>, met: &mut Vec<Met>) -> Result<()> {
        near.clear();
        met.clear();
        let (Some(cuttable), true) = (&self.cuttable, self.is_near(sweep)) else {
            return Ok(());
        };
        self.items_near(cuttable, sweep, near)?;
        cuttable.material.meet(sweep, self.positions(), near, met)
    }

    /// The mean velocity of what an edge stands in, m/s; `None`: it stands nowhere. `near` becomes what it may stand in.
    pub(crate) fn velocity_about(&self, edge: [Vec3; 2], near: &mut Vec<u32>) -> Result<Option<Vec3>> {
        near.clear();
        let sweep = Sweep { start: edge, end: edge };
        let (Some(cuttable), true) = (&self.cuttable, self.is_near(&sweep)) else {
            return Ok(None);
        };
        self.items_near(cuttable, &sweep, near)?;
        let (material, positions) = (&cuttable.material, self.positions());
        near.retain(|&item| {
            let [a, b, c, _] = material.corners_of(item).map(|corner| positions[corner as usize]);
            match material {
                CutMaterial::Springs(_) => false,
                CutMaterial::Surface(_) => passes(edge, [a, b, c]),
                CutMaterial::Solid(solid) => solid.end_in(item, &sweep, positions).is_some(),
            }
        });
        let velocities = self.velocities();
        let corners = near.iter().flat_map(|&item| material.corners_of(item));
        let sum: Vec3 = corners.map(|corner| velocities[corner as usize]).sum();
        Ok((!near.is_empty()).then(|| sum / (4 * near.len()) as f32))
    }

    /// Whether the box about it meets that about a sweep.
    fn is_near(&self, sweep: &Sweep) -> bool {
        let (own, origin) = (self.system.local_bounds(), self.system.origin.as_vec3());
        let slack = 1e-3 * self.system.extent() + 4.0 * f32::EPSILON * origin.abs().max_element();
        let own = Bounds {
            min: own.min + origin,
            max: own.max + origin,
        };
        own.extended(slack)
            .overlaps(&Bounds::of(sweep.start.into_iter().chain(sweep.end)))
    }

    /// Takes a stroke for that of its next cut, and gives the one that it had.
    pub(crate) fn swap_stroke(&mut self, stroke: &mut Stroke) {
        if let Some(cuttable) = &mut self.cuttable {
            // The material has the one that is in use.
            cuttable.material.swap_stroke(&mut cuttable.stroke.of_solid);
            std::mem::swap(&mut cuttable.stroke, stroke);
            cuttable.material.swap_stroke(&mut cuttable.stroke.of_solid);
        }
    }

    /// Whether the tissue in which a stroke stands has gone from under it.
    pub(crate) fn has_gone_on(&self, stroke: &Stroke) -> bool {
        self.cuttable
            .as_ref()
            .is_some_and(|cuttable| stroke.has_tissue_gone(&cuttable.material, self.positions()))
    }

    /// Where an end of a cut is to be held.
    pub(crate) fn hold_at(&self, end: &CutEnd) -> Option<HoldAt> {
        let Some(vertex) = end.vertex else {
            return Some(HoldAt::Inside(end.nodes, end.weights));
        };
        let vertices = self.cuttable.as_ref()?.material.surface()?.vertices();
        let point = vertices.get(vertex as usize)?.point;
        Some(HoldAt::Anchor(Anchor::Node(point)))
    }

    /// Where what is met is to be held, at these weights.
    pub(crate) fn hold_in(&self, met: &Met, weights: [f64; 4]) -> Option<HoldAt> {
        let cuttable = self.cuttable.as_ref()?;
        if cuttable.material.surface().is_none() {
            return Some(HoldAt::Inside(cuttable.material.nodes_of(met.item), weights));
        }
        let [a, b, c, _] = weights.map(|weight| weight as f32);
        Some(HoldAt::Anchor(Anchor::Point(SurfacePoint {
            triangle: met.item,
            weights: [a, b, c],
        })))
    }
}
