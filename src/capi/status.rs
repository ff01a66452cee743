//! Statuses, the version, and the message of the last failure.

use std::cell::RefCell;

use libc::c_char;

use crate::error::Error;

/// The answer of every function that can fail: one of the `SINEW_STATUS_...`.
pub type sinew_status = i32;

/// Done.
pub const SINEW_STATUS_OK: sinew_status = 0;
/// An argument is out of its range; nothing changed.
pub const SINEW_STATUS_INVALID_ARGUMENT: sinew_status = 1;
/// The id is of something destroyed, or of nothing.
pub const SINEW_STATUS_STALE_ID: sinew_status = 2;
/// A fixed-capacity storage is full.
pub const SINEW_STATUS_CAPACITY: sinew_status = 3;
/// Memory could not be reserved; nothing changed.
pub const SINEW_STATUS_OUT_OF_MEMORY: sinew_status = 4;
/// The step could not be taken, or the state of rest was not found: nothing moved, pending forces and poses stay pending.
pub const SINEW_STATUS_UNSTABLE: sinew_status = 5;
/// Valid, but this build or this combination does not offer it.
pub const SINEW_STATUS_UNSUPPORTED: sinew_status = 6;
/// A file could not be read or written.
pub const SINEW_STATUS_IO: sinew_status = 7;
/// A fault inside the library; the world refuses further calls but destroy.
pub const SINEW_STATUS_INTERNAL: sinew_status = 8;

/// The first number of the version that this header is of.
pub const SINEW_VERSION_MAJOR: u32 = 0;
/// The second.
pub const SINEW_VERSION_MINOR: u32 = 1;
/// The third.
pub const SINEW_VERSION_PATCH: u32 = 0;
/// All three: major << 16 | minor << 8 | patch.
pub const SINEW_VERSION: u32 = SINEW_VERSION_MAJOR << 16 | SINEW_VERSION_MINOR << 8 | SINEW_VERSION_PATCH;

thread_local! {
    static LAST_ERROR: RefCell<Option<Error>> = const { RefCell::new(None) };
}

/// Keeps `error` as this thread's last failure: its status.
pub(super) fn fail(error: Error) -> sinew_status {
    let status = status_of(&error);
    // Nothing where the thread is at its end.
    let _ = LAST_ERROR.try_with(|last| last.replace(Some(error)));
    status
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

/// The version of the library that is linked: major << 16 | minor << 8 | patch; compare with SINEW_VERSION.
#[unsafe(no_mangle)]
pub extern "C" fn sinew_version() -> u32 {
    SINEW_VERSION
}

/// The name of a status, such as "SINEW_STATUS_OK"; never NULL, valid for ever.
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

/// Writes the message of this thread's last failed call to `buffer`, cut where `capacity` bytes do not hold it, and ended
/// by NUL. `buffer` may be NULL where `capacity` is 0.
///
/// Returns the bytes that the whole message needs, NUL included; 1, an empty message, where no call has failed.
///
/// # Safety
/// `buffer` must be writable for `capacity` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_last_error(buffer: *mut c_char, capacity: usize) -> usize {
    let message = LAST_ERROR.try_with(|last| last.borrow().as_ref().map(Error::to_string));
    let message = message.ok().flatten().unwrap_or_default();
    if !buffer.is_null() && capacity > 0 {
        let mut written = message.len().min(capacity - 1);
        while !message.is_char_boundary(written) {
            written -= 1;
        }
        // SAFETY: the caller vouches for `capacity` bytes, of which at most `capacity - 1` and a NUL are written.
        unsafe {
            std::ptr::copy_nonoverlapping(message.as_ptr().cast(), buffer, written);
            *buffer.add(written) = 0;
        }
    }
    message.len() + 1
}
