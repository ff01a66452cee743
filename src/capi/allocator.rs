//! Memory from functions of the program. Only a build with the feature `allocator` asks them: it decides for the whole
//! program, so a crate of Rust must not do it to others.

use std::ffi::c_void;

use super::guard::guard;
use super::memory;
use super::status::sinew_status;

/// Callback that returns `size` bytes at a multiple of `alignment`, or NULL without memory.
pub type sinew_alloc = Option<unsafe extern "C" fn(context: *mut c_void, size: usize, alignment: usize) -> *mut c_void>;

/// Callback that frees memory of sinew_alloc; `size` and `alignment` are those of its request.
pub type sinew_dealloc =
    Option<unsafe extern "C" fn(context: *mut c_void, memory: *mut c_void, size: usize, alignment: usize)>;

/// The functions, and the address of their context.
type Functions = (sinew_alloc, sinew_dealloc, usize);

#[cfg(feature = "allocator")]
mod routed {
    use std::alloc::{GlobalAlloc, Layout, System};
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicU8, Ordering};

    use super::{Functions, c_void};
    use crate::base::{Error, Result};

    /// Whose memory it is: not decided before the first request.
    static OWNER: AtomicU8 = AtomicU8::new(OPEN);
    const OPEN: u8 = 0;
    const SYSTEM: u8 = 1;
    const PROGRAM: u8 = 2;

    /// Set before the owner becomes the program.
    static FUNCTIONS: OnceLock<Functions> = OnceLock::new();

    #[global_allocator]
    static ROUTED: Routed = Routed;

    struct Routed;

    pub fn set(functions: Functions) -> Result<()> {
        let is_first = OWNER.load(Ordering::Acquire) == OPEN && FUNCTIONS.set(functions).is_ok();
        let change = || OWNER.compare_exchange(OPEN, PROGRAM, Ordering::AcqRel, Ordering::Acquire);
        if is_first && change().is_ok() {
            return Ok(());
        }
        Err(Error::invalid(
            "alloc comes too late: the library has allocated memory already, or has an allocator",
        ))
    }

    /// The program's functions, as far as it is decided.
    pub fn given() -> Option<&'static Functions> {
        FUNCTIONS.get().filter(|_| OWNER.load(Ordering::Acquire) == PROGRAM)
    }

    /// The program's functions; `None`: the system's.
    fn functions() -> Option<&'static Functions> {
        match OWNER.load(Ordering::Acquire) {
            SYSTEM => None,
            PROGRAM => FUNCTIONS.get(),
            _ => {
                // Whoever comes first decides.
                let _ = OWNER.compare_exchange(OPEN, SYSTEM, Ordering::AcqRel, Ordering::Acquire);
                functions()
            }
        }
    }

    // SAFETY: all requests go to the system, or all go to functions whose setter vouches for them. Memory that is not
    // aligned counts as none.
    unsafe impl GlobalAlloc for Routed {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            let Some(&(Some(allocate), Some(deallocate), context)) = functions() else {
                // SAFETY: the same contract.
                return unsafe { System.alloc(layout) };
            };
            let (context, size, alignment) = (context as *mut c_void, layout.size(), layout.align());
            // SAFETY: as their setter vouches; what is freed has just been allocated.
            unsafe {
                let memory = allocate(context, size, alignment);
                if memory.addr() & (alignment - 1) == 0 {
                    return memory.cast();
                }
                deallocate(context, memory, size, alignment);
            }
            std::ptr::null_mut()
        }

        unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
            let Some(&(_, Some(deallocate), context)) = functions() else {
                // SAFETY: the same contract.
                return unsafe { System.dealloc(memory, layout) };
            };
            // SAFETY: as its setter vouches; the memory is of `allocate`, by the same layout.
            unsafe { deallocate(context as *mut c_void, memory.cast(), layout.size(), layout.align()) };
        }

        unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
            if functions().is_none() {
                // SAFETY: the same contract.
                return unsafe { System.alloc_zeroed(layout) };
            }
            // SAFETY: the same contract; what there is has `size` bytes.
            unsafe {
                let memory = self.alloc(layout);
                if !memory.is_null() {
                    memory.write_bytes(0, layout.size());
                }
                memory
            }
        }

        unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
            if functions().is_none() {
                // SAFETY: the same contract.
                return unsafe { System.realloc(memory, layout, size) };
            }
            // SAFETY: the same contract, by which `size` is fit for a layout; both have the bytes that are copied, and
            // are apart.
            unsafe {
                let longer = self.alloc(Layout::from_size_align_unchecked(size, layout.align()));
                if !longer.is_null() {
                    longer.copy_from_nonoverlapping(memory, size.min(layout.size()));
                    self.dealloc(memory, layout);
                }
                longer
            }
        }
    }
}

#[cfg(not(feature = "allocator"))]
mod routed {
    use super::Functions;
    use crate::base::{Error, Result};

    pub fn set(_: Functions) -> Result<()> {
        Err(Error::Unsupported(
            "this build of the library takes no allocator: it needs the cargo feature `allocator`".into(),
        ))
    }

    pub fn given() -> Option<&'static Functions> {
        None
    }
}

/// Sets the functions that allocate all memory of the library, until the process ends.
///
/// Call it before every other function. Both run on any thread that uses the library, and must not call it. `context`
/// is nullable. Thread stacks and memory of the C library are not routed.
///
/// Errors: SINEW_STATUS_UNSUPPORTED without the cargo feature `allocator`; SINEW_STATUS_INVALID_ARGUMENT after the
/// first allocation, also for the message of a failed call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_set_allocator(
    alloc: sinew_alloc,
    dealloc: sinew_dealloc,
    context: *mut c_void,
) -> sinew_status {
    guard(|| {
        for (name, is_none) in [("alloc", alloc.is_none()), ("dealloc", dealloc.is_none())] {
            if is_none {
                return Err(memory::null(name));
            }
        }
        routed::set((alloc, dealloc, context as usize))
    })
}

/// Writes what sinew_set_allocator has set, else NULL; all outputs are nullable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_get_allocator(
    out_alloc: *mut sinew_alloc,
    out_dealloc: *mut sinew_dealloc,
    out_context: *mut *mut c_void,
) -> sinew_status {
    guard(|| {
        let (alloc, dealloc, context) = routed::given().copied().unwrap_or_default();
        memory::write_wanted_of_three(
            ("out_alloc", out_alloc, alloc),
            ("out_dealloc", out_dealloc, dealloc),
            ("out_context", out_context, context as *mut c_void),
        )
    })
}
