//! Mass for elements that motion has made stiff, so that no step is refused because of a few of them.
//!
//! Where a step would take more substeps than are allowed, each node is asked for the mass that it needs with its elements as they are
//! deformed, and masses are made for the fewest substeps that the bound on added mass allows. They stay so for a while. Nodes keep
//! their velocities but for what the added mass would add to the kinetic energy of the deformation, which is taken off all of it.

use super::attempt::{StepRequest, fewer_substeps};
use super::verlet;
use crate::body::Body;
use crate::soa::Masses;
use crate::threads::Team;

/// Makes masses for elements as they are deformed: at the current state, or where a step that `was_tried` has come to. The longest stable
/// substep that the step then begins with, as far as springs are not concerned, s; `None`: there is not enough mass for that.
pub(super) fn relieve(body: &mut Body, request: &StepRequest, was_tried: bool, team: &Team) -> Option<f32> {
    if request.substeps > 0 || request.tolerance > 0.0 {
        return None;
    }
    let (Some(scaling), Some(elements)) = (&mut body.scaling, &body.elements) else {
        return None;
    };
    let growths = scaling.begin_relief()?;
    let positions = if was_tried {
        body.state.newest().0
    } else {
        body.state.positions()
    };
    elements.stiffenings(positions, &mut |corners, stiffening| {
        for node in corners {
            let growth = &mut growths[node as usize];
            *growth = growth.max(stiffening as f32);
        }
    });
    let in_use = Masses {
        masses: &body.masses,
        inverse_masses: &body.inverse_masses,
        are_heavier: scaling.step() > 0.0,
    };
    let rates = body.damping.as_ref().map(|damping| damping.rates());
    scaling.relieve(&body.masses, rates, |node| {
        elements.carried_at_rest(node, in_use.inverse(node))
    });
    let (_, masses_for) = fewer_substeps(body, request, 0.0)?;
    body.scale_masses(masses_for);
    verlet::begin(body, request);
    Some(body.limit_beside_springs(team))
}
