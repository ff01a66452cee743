//! What a blade finds of a body.

use super::{Body, Bounds, Stroke};
use crate::cutting::{Met, Sweep};
use crate::error::Result;

impl Body {
    /// What it takes to cut it, J/m; `None`: it cannot be cut.
    pub(crate) fn toughness(&self) -> Option<f32> {
        self.cuttable.as_ref().map(|cuttable| cuttable.toughness)
    }

    /// What of its surface a blade would pass through, in the places of the nodes as they are. `near` becomes what it may meet.
    pub(crate) fn meet_blade(&self, sweep: &Sweep, near: &mut Vec<u32>, met: &mut Vec<Met>) -> Result<()> {
        near.clear();
        met.clear();
        let (Some(cuttable), true) = (&self.cuttable, self.is_near(sweep)) else {
            return Ok(());
        };
        self.items_near(cuttable, sweep, near)?;
        match cuttable.material.surface() {
            Some(surface) => surface.meet(sweep, self.positions(), near, met),
            None => Ok(()),
        }
    }

    /// Whether the box about it meets that about a sweep.
    fn is_near(&self, sweep: &Sweep) -> bool {
        let (own, origin) = (self.local_bounds(), self.origin.as_vec3());
        let slack = 1e-3 * self.extent() + 4.0 * f32::EPSILON * origin.abs().max_element();
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

    /// A vertex of what is drawn, by its number among nodes.
    pub(crate) fn point_of_vertex(&self, vertex: u32) -> Option<u32> {
        let vertices = self.cuttable.as_ref()?.material.surface()?.vertices();
        Some(vertices.get(vertex as usize)?.point)
    }
}
