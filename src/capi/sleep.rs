//! Bodies that sleep where they rest, as C asks for them: sinew_body_def.sleep_speed.

use super::body::{sinew_body_id, with_body, with_body_mut};
use super::memory;
use super::status::sinew_status;
use super::world::sinew_world;

/// Writes the fraction of the nodes that are awake; 1 for a body that never sleeps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_awake_share(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut f32,
) -> sinew_status {
    with_body(world, body, |body| memory::write("out", out, body.awake_share()))
}

/// Wakes all nodes of a body until they come to rest; anything that affects it does too.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_wake(world: *mut sinew_world, body: sinew_body_id) -> sinew_status {
    with_body_mut(world, body, |body| {
        body.wake();
        Ok(())
    })
}
