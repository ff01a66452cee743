//! The planted fault: a read out of bounds, which only the sanitizer detects.

use std::hint::black_box;

/// Reads out of bounds if faults are planted and the condition is met.
pub fn fault(is_met: bool) {
    if cfg!(planted) && is_met {
        eprintln!("the planted fault");
        let buffer = black_box(vec![0_u8; 8]);
        // SAFETY: unsound on purpose.
        black_box(unsafe { buffer.as_ptr().add(black_box(8)).read_volatile() });
    }
}
