//! Messages to a callback of the program.

use std::fmt::{self, Display, Write};
use std::sync::RwLock;
use std::sync::atomic::{AtomicU32, Ordering};

use std::ffi::{c_char, c_void};

use super::guard::guard;
use super::memory;
use super::status::sinew_status;
use crate::base::{Error, ensure};

/// No messages.
pub const SINEW_LOG_OFF: u32 = 0;
/// Faults inside the library, such as a failed assertion.
pub const SINEW_LOG_FAULT: u32 = 1;
/// Calls that were refused or failed; the text of sinew_last_error.
pub const SINEW_LOG_ERROR: u32 = 2;
/// Steps that rolled bodies back.
pub const SINEW_LOG_WARNING: u32 = 3;

/// Callback that receives a message, which is valid during the call only.
///
/// It may run on any thread that calls the library. It must not call the library.
pub type sinew_log = Option<unsafe extern "C" fn(context: *mut c_void, level: u32, message: *const c_char)>;

/// A longer message is cut.
const LONGEST: usize = 512;

/// The level, looked at first: without a callback no lock is taken.
static LEVEL: AtomicU32 = AtomicU32::new(SINEW_LOG_OFF);
static CALLBACK: RwLock<(sinew_log, usize)> = RwLock::new((None, 0));

/// Text on the stack, that ends with NUL: what failed may have been memory.
struct Text {
    bytes: [u8; LONGEST],
    length: usize,
}

impl Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut fits = text.len().min(LONGEST - 1 - self.length);
        while !text.is_char_boundary(fits) {
            fits -= 1;
        }
        self.bytes[self.length..self.length + fits].copy_from_slice(&text.as_bytes()[..fits]);
        self.length += fits;
        // What comes behind a cut is left out too.
        if fits < text.len() { Err(fmt::Error) } else { Ok(()) }
    }
}

fn current() -> (sinew_log, usize) {
    match CALLBACK.read() {
        Ok(callback) => *callback,
        Err(poisoned) => *poisoned.into_inner(),
    }
}

/// Tells the callback, if it is to hear of this level.
pub(super) fn log(level: u32, message: impl Display) {
    if level > LEVEL.load(Ordering::Acquire) {
        return;
    }
    let (Some(callback), context) = current() else { return };
    let mut text = Text {
        bytes: [0; LONGEST],
        length: 0,
    };
    // A message that is cut is one.
    let _ = write!(text, "{message}");
    // SAFETY: who set the callback vouches for it and its context; the text ends with NUL.
    unsafe { callback(context as *mut c_void, level, text.bytes.as_ptr().cast()) };
}

/// A call has failed.
pub(super) fn failed(error: &Error) {
    let level = match error {
        Error::Internal(_) => SINEW_LOG_FAULT,
        _ => SINEW_LOG_ERROR,
    };
    log(level, error);
}

/// Sets the callback that receives messages up to a level, for the whole process.
///
/// `level` is a sinew_log_level value. `callback` (none) and `context` are nullable. Other threads may still be in the
/// callback that it replaces.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_set_log_callback(level: u32, callback: sinew_log, context: *mut c_void) -> sinew_status {
    guard(|| {
        ensure!(level <= SINEW_LOG_WARNING, "level is {level}: no SINEW_LOG_...");
        let mut place = match CALLBACK.write() {
            Ok(place) => place,
            Err(poisoned) => poisoned.into_inner(),
        };
        *place = (callback, context as usize);
        let level = if callback.is_some() { level } else { SINEW_LOG_OFF };
        LEVEL.store(level, Ordering::Release);
        Ok(())
    })
}

/// Writes the level, callback and context of sinew_set_log_callback; all outputs are nullable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_get_log_callback(
    out_level: *mut u32,
    out_callback: *mut sinew_log,
    out_context: *mut *mut c_void,
) -> sinew_status {
    guard(|| {
        let (callback, context) = current();
        memory::write_wanted_of_three(
            ("out_level", out_level, LEVEL.load(Ordering::Acquire)),
            ("out_callback", out_callback, callback),
            ("out_context", out_context, context as *mut c_void),
        )
    })
}
