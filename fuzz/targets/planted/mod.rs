//! The fault that has to be found: a read beyond what was given, of which nobody but the sanitizer tells.

use std::hint::black_box;

/// Does so where faults are planted and this is so.
pub fn fault(is_met: bool) {
    if cfg!(planted) && is_met {
        eprintln!("the planted fault");
        let given = black_box(vec![0_u8; 8]);
        // SAFETY: there is none.
        black_box(unsafe { given.as_ptr().add(black_box(8)).read_volatile() });
    }
}
