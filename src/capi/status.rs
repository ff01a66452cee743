//! Statuses, the version, and the message of the last failure.

use std::cell::{Cell, RefCell};
use std::fmt::{self, Write};

use std::ffi::c_char;

use super::log;
use crate::base::Error;

/// Result of every function that can fail: a sinew_status_code value.
pub type sinew_status = i32;

/// The call succeeded.
pub const SINEW_STATUS_OK: sinew_status = 0;
/// An argument is outside its range; nothing changed.
pub const SINEW_STATUS_INVALID_ARGUMENT: sinew_status = 1;
/// The id refers to a destroyed object, or to none.
pub const SINEW_STATUS_STALE_ID: sinew_status = 2;
/// A storage of fixed capacity is full.
pub const SINEW_STATUS_CAPACITY: sinew_status = 3;
/// Memory could not be allocated; nothing changed.
pub const SINEW_STATUS_OUT_OF_MEMORY: sinew_status = 4;
/// Step or equilibrium failed: nothing moved; forces and poses stay.
pub const SINEW_STATUS_UNSTABLE: sinew_status = 5;
/// Valid, but this build or combination does not offer it.
pub const SINEW_STATUS_UNSUPPORTED: sinew_status = 6;
/// A file could not be read or written.
pub const SINEW_STATUS_IO: sinew_status = 7;
/// Fault in the library; the world accepts only sinew_world_destroy.
pub const SINEW_STATUS_INTERNAL: sinew_status = 8;

/// Major version of this header.
pub const SINEW_VERSION_MAJOR: u32 = 0;
/// Minor version of this header.
pub const SINEW_VERSION_MINOR: u32 = 2;
/// Patch version of this header.
pub const SINEW_VERSION_PATCH: u32 = 0;
/// Version of this header as one number: major << 16 | minor << 8 | patch.
pub const SINEW_VERSION: u32 = SINEW_VERSION_MAJOR << 16 | SINEW_VERSION_MINOR << 8 | SINEW_VERSION_PATCH;

thread_local! {
    static LAST_ERROR: RefCell<Option<Error>> = const { RefCell::new(None) };
    /// The last was that memory ran out: kept by itself, as a thread's first use of what has to be dropped at its end
    /// takes memory, or ends the program.
    static OUT_OF_MEMORY: Cell<bool> = const { Cell::new(false) };
}

/// Keeps `error` as this thread's last failure: its status.
pub(super) fn fail(error: Error) -> sinew_status {
    let status = status_of(&error);
    log::failed(&error);
    let is_out_of_memory = matches!(error, Error::OutOfMemory);
    OUT_OF_MEMORY.set(is_out_of_memory);
    if !is_out_of_memory {
        // Nothing where the thread is at its end.
        let _ = LAST_ERROR.try_with(|last| last.replace(Some(error)));
    }
    status
}

/// A buffer of the caller's: what is written goes there as far as it fits, and is counted.
struct Message {
    to: *mut u8,
    room: usize,
    written: usize,
    needed: usize,
}

impl Write for Message {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        // Behind what was cut nothing follows.
        if self.written == self.needed {
            let mut fits = text.len().min(self.room - self.written);
            while !text.is_char_boundary(fits) {
                fits -= 1;
            }
            // SAFETY: there is room for what fits behind what is written.
            unsafe { std::ptr::copy_nonoverlapping(text.as_ptr(), self.to.add(self.written), fits) };
            self.written += fits;
        }
        self.needed += text.len();
        Ok(())
    }
}

pub(super) fn status_of(error: &Error) -> sinew_status {
    match error {
        Error::InvalidArgument(_) => SINEW_STATUS_INVALID_ARGUMENT,
        Error::StaleId(_) => SINEW_STATUS_STALE_ID,
        Error::Capacity(_) => SINEW_STATUS_CAPACITY,
        Error::OutOfMemory => SINEW_STATUS_OUT_OF_MEMORY,
        Error::Unstable { .. } | Error::NotConverged(_) => SINEW_STATUS_UNSTABLE,
        Error::Unsupported(_) => SINEW_STATUS_UNSUPPORTED,
        Error::Io(_) => SINEW_STATUS_IO,
        Error::Internal(_) => SINEW_STATUS_INTERNAL,
    }
}

/// Returns the version of the linked library; compare it with SINEW_VERSION.
#[unsafe(no_mangle)]
pub extern "C" fn sinew_version() -> u32 {
    SINEW_VERSION
}

/// Returns the name of a status, such as "SINEW_STATUS_OK".
///
/// The string is static and never NULL, also for an unknown status.
#[unsafe(no_mangle)]
pub extern "C" fn sinew_status_name(status: sinew_status) -> *const c_char {
    let name = match status {
        SINEW_STATUS_OK => c"SINEW_STATUS_OK",
        SINEW_STATUS_INVALID_ARGUMENT => c"SINEW_STATUS_INVALID_ARGUMENT",
        SINEW_STATUS_STALE_ID => c"SINEW_STATUS_STALE_ID",
        SINEW_STATUS_CAPACITY => c"SINEW_STATUS_CAPACITY",
        SINEW_STATUS_OUT_OF_MEMORY => c"SINEW_STATUS_OUT_OF_MEMORY",
        SINEW_STATUS_UNSTABLE => c"SINEW_STATUS_UNSTABLE",
        SINEW_STATUS_UNSUPPORTED => c"SINEW_STATUS_UNSUPPORTED",
        SINEW_STATUS_IO => c"SINEW_STATUS_IO",
        SINEW_STATUS_INTERNAL => c"SINEW_STATUS_INTERNAL",
        _ => c"unknown status",
    };
    name.as_ptr()
}

/// Copies the message of this thread's last failed call into a buffer.
///
/// The text is cut to `capacity` bytes and always ends with NUL. `buffer` is nullable. Returns the number of bytes
/// that the whole message needs, NUL included; 1 if no call has failed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_last_error(buffer: *mut c_char, capacity: usize) -> usize {
    let has_room = !buffer.is_null() && capacity > 0;
    let mut message = Message {
        to: buffer.cast(),
        room: if has_room { capacity - 1 } else { 0 },
        written: 0,
        needed: 0,
    };
    // Without memory: there may be none.
    let _ = match OUT_OF_MEMORY.get() {
        true => write!(message, "{}", Error::OutOfMemory),
        false => LAST_ERROR
            .try_with(|last| {
                last.borrow()
                    .as_ref()
                    .map_or(Ok(()), |error| write!(message, "{error}"))
            })
            .unwrap_or(Ok(())),
    };
    if has_room {
        // SAFETY: the caller vouches for `capacity` bytes, of which less are written.
        unsafe { *buffer.add(message.written) = 0 };
    }
    message.needed + 1
}
