//! What a body may have: the energy that was put into it, and the momentum it began with.
//!
//! **Energy.** A body that begins with the energy `E0` can turn into motion what it has above its lowest state, `E0 - E_rest`, and the work
//! `W` that was done on it since. This sum is the energy put in. Nothing but work raises `E`, so that `E <= E0 + W`, whatever dampers take.
//! Positions and velocities of IMPLICIT and NEWTON belong to the same time, and `E` is compared as it is.
//!
//! VERLET keeps another energy. A kick of half a substep h, a drift and half a kick again take v to `v' = v + h/2 (a0 + a1)` and x to
//! `x + h (v + h/2 a0)`. So the kinetic energy changes by `m/2 (v' - v)(v' + v) = (F0 + F1)/2 . dx + h²/8 (F1² - F0²)/m`, where dx is the
//! displacement. The first part is the trapezoidal rule for the work of the forces, which is exact where they are linear. So
//! `E - h²/8 Q`, with Q the sum of `F²/m` over free nodes, is what leapfrog keeps of a linear body: its shadow energy. E oscillates about it
//! by at most the part `(h omega / 2)²` of the elastic energy, since `F²/m <= omega² 2 U`. This is what E may show without a fault, and it is
//! not bounded by a guess of omega here: Q is measured, by one very short step of a copy, and `E - h²/8 Q <= E0 + W` is asked for.
//!
//! **Momentum** of a body on which nothing acts from outside stays, and so does its angular momentum.

use glam::{DVec3, Vec3};
use sinew::{Body, BodyDefinition, BodyId, RestStateDefinition, World, WorldDefinition};

use crate::support::bodies::FREE;

/// A copy of the body whose accelerations are measured.
pub struct Copy {
    world: World,
    id: BodyId,
}

impl Copy {
    pub fn new(definition: &BodyDefinition, gravity: Vec3, pins: &[u32]) -> Self {
        let definition = BodyDefinition {
            mass_scaling: 0.0,
            ..*definition
        };
        let world = WorldDefinition { gravity, ..FREE };
        let mut world = World::new(world).expect("a world");
        let id = world.create_body(&definition).expect("a body");
        let mut copy = Self { world, id };
        for &node in pins {
            copy.body_mut().pin(node).expect("a pin");
        }
        copy
    }

    fn body_mut(&mut self) -> &mut Body {
        self.world.body_mut(self.id).expect("the body")
    }

    /// The energy where it is at rest, J.
    pub fn energy_at_rest(&mut self) -> f64 {
        let found = self.world.rest_state(self.id, &RestStateDefinition::default());
        found.expect("a state of rest").energy_after
    }

    /// h²/8 Q of a body in this state, J.
    pub fn oscillation(&mut self, body: &Body, substep: f64) -> f64 {
        let before = body.velocities();
        let short = (substep / 16.0) as f32;
        let copy = self.body_mut();
        copy.set_positions(body.positions()).expect("positions");
        copy.set_velocities(before).expect("velocities");
        self.world.step(short).expect("a short step");
        let after = self.world.body(self.id).expect("the body").velocities();
        let squares = (0..).zip(after.iter().zip(before)).map(|(node, (after, before))| {
            let mass = f64::from(body.node_mass(node).expect("a node"));
            mass * (after.as_dvec3() - before.as_dvec3()).length_squared()
        });
        substep * substep / 8.0 * squares.sum::<f64>() / (f64::from(short) * f64::from(short))
    }
}

/// The sum of the momenta, that of their sizes, and the angular momentum about the origin.
pub fn momenta(body: &Body) -> (DVec3, f64, DVec3) {
    let nodes = body.positions().iter().zip(body.velocities());
    let zero = (DVec3::ZERO, 0.0, DVec3::ZERO);
    (0..).zip(nodes).fold(zero, |(sum, size, turning), (node, (p, v))| {
        let momentum = v.as_dvec3() * f64::from(body.node_mass(node).expect("a node"));
        (
            sum + momentum,
            size + momentum.length(),
            turning + p.as_dvec3().cross(momentum),
        )
    })
}
