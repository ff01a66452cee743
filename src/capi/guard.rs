//! The border that no panic crosses.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

use super::status::{SINEW_STATUS_OK, fail, sinew_status};
use crate::base::{Error, Result};
use crate::world::World;

/// World: a set of bodies and tools that are stepped together.
pub struct sinew_world {
    world: World,
    /// Set by a fault inside the library; what the world holds is not to be trusted then.
    faulty: AtomicBool,
}

impl sinew_world {
    pub(super) fn new(world: World) -> Self {
        Self {
            world,
            faulty: AtomicBool::new(false),
        }
    }
}

/// Runs `call` once; a panic becomes an error, and every error a status with its message kept.
pub(super) fn guard(mut call: impl FnMut() -> Result<()>) -> sinew_status {
    answer(&mut call, None)
}

/// Drops what the caller was given as a pointer; NULL has no effect.
///
/// # Safety
/// `pointer` is NULL or was made by `Box::into_raw`, and is given back once.
pub(super) unsafe fn destroy<T>(pointer: *mut T) {
    if !pointer.is_null() {
        guard(|| {
            drop(Box::from_raw(pointer));
            Ok(())
        });
    }
}

/// Runs `call` once with a world to look at.
///
/// # Safety
/// `world` is NULL or a world that is not destroyed, and that nobody changes meanwhile.
pub(super) unsafe fn with_world(world: *const sinew_world, mut call: impl FnMut(&World) -> Result<()>) -> sinew_status {
    // SAFETY: the caller vouches for the world where the pointer is not NULL.
    match unsafe { world.as_ref() } {
        Some(sinew_world { world, faulty }) => answer(&mut || call(world), Some(faulty)),
        None => fail(Error::invalid("world is NULL")),
    }
}

/// Runs `call` once with a world to change.
///
/// # Safety
/// `world` is NULL or a world that is not destroyed, and that nobody else uses meanwhile.
pub(super) unsafe fn with_world_mut(
    world: *mut sinew_world,
    mut call: impl FnMut(&mut World) -> Result<()>,
) -> sinew_status {
    // SAFETY: the caller vouches for the world where the pointer is not NULL.
    match unsafe { world.as_mut() } {
        Some(sinew_world { world, faulty }) => answer(&mut || call(world), Some(faulty)),
        None => fail(Error::invalid("world is NULL")),
    }
}

/// Runs `call`, and marks its world faulty where it panics. Of hundreds of calls there is but this one copy.
fn answer(call: &mut dyn FnMut() -> Result<()>, faulty: Option<&AtomicBool>) -> sinew_status {
    if faulty.is_some_and(|faulty| faulty.load(Ordering::Acquire)) {
        return fail(Error::Internal(
            "the world met a fault inside the library earlier: it can only be destroyed".into(),
        ));
    }
    // What a panic leaves half done is inside a world, which is marked faulty and never looked at again.
    let result = catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let reason = text.or(panic.downcast_ref::<&str>().copied());
        let reason = reason.unwrap_or("no reason given");
        Err(Error::Internal(format!("a fault inside the library: {reason}")))
    });
    let Err(error) = result else {
        return SINEW_STATUS_OK;
    };
    if let (Error::Internal(_), Some(faulty)) = (&error, faulty) {
        faulty.store(true, Ordering::Release);
    }
    fail(error)
}

#[cfg(test)]
mod tests {
    use super::super::status::{SINEW_STATUS_INTERNAL, SINEW_STATUS_INVALID_ARGUMENT};
    use super::super::world::{
        sinew_world_create, sinew_world_def_init, sinew_world_destroy, sinew_world_get_state_hash,
        sinew_world_set_gravity, sinew_world_step,
    };
    use super::*;

    #[test]
    fn after_a_fault_a_world_refuses_everything_but_its_end() {
        let mut world = std::ptr::null_mut();
        // SAFETY: pointers to live variables throughout, and a world used before its end alone.
        unsafe {
            let mut def = std::mem::zeroed();
            assert_eq!(sinew_world_def_init(&mut def, size_of_val(&def)), SINEW_STATUS_OK);
            assert_eq!(sinew_world_create(&def, &mut world), SINEW_STATUS_OK);
            let status = with_world_mut(world, |_| panic!("on purpose"));
            assert_eq!(status, SINEW_STATUS_INTERNAL);
            assert_eq!(
                sinew_world_step(world, 0.01, std::ptr::null_mut()),
                SINEW_STATUS_INTERNAL
            );
            assert_eq!(sinew_world_set_gravity(world, [0.0; 3].as_ptr()), SINEW_STATUS_INTERNAL);
            let mut hash = 7;
            assert_eq!(sinew_world_get_state_hash(world, &mut hash), SINEW_STATUS_INTERNAL);
            assert_eq!(hash, 7);
            sinew_world_destroy(world);

            assert_eq!(sinew_world_create(&def, &mut world), SINEW_STATUS_OK);
            let status = with_world(world, |_| panic!("on purpose, while others look too"));
            assert_eq!(status, SINEW_STATUS_INTERNAL);
            assert_eq!(
                sinew_world_step(world, 0.01, std::ptr::null_mut()),
                SINEW_STATUS_INTERNAL
            );
            sinew_world_destroy(world);
        }
        assert_eq!(guard(|| panic!("outside any world")), SINEW_STATUS_INTERNAL);
        assert_eq!(guard(|| Err(Error::invalid("no"))), SINEW_STATUS_INVALID_ARGUMENT);
    }
}
