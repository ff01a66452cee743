//! A heap as much cutting leaves it: its free blocks lie scattered, in no order.
#![allow(unsafe_code)]

use std::ffi::c_void;

use crate::clock;
use crate::random::Random;

/// A heap whose free blocks of one size lie scattered among others that are taken until this is dropped.
pub struct Fragmented {
    taken: Vec<*mut c_void>,
}

impl Fragmented {
    /// Leaves `count` free blocks for what is allocated next with `size` bytes or up to 16 fewer.
    ///
    /// Twice as many are allocated, and every second one is freed, in random order: those between keep the allocator from
    /// joining neighbours to one large block.
    pub fn new(size: usize, count: usize) -> Self {
        // SAFETY: malloc may be called with any size.
        let mut blocks: Vec<*mut c_void> = (0..2 * count).map(|_| unsafe { libc::malloc(size) }).collect();
        let mut taken = Vec::with_capacity(count);
        let mut free = Vec::with_capacity(count);
        for pair in blocks.chunks_exact(2) {
            free.push(pair[0]);
            taken.push(pair[1]);
        }
        blocks.clear();
        Random(5).shuffle(&mut free);
        for block in free {
            // SAFETY: from malloc, or null, and freed once.
            unsafe { libc::free(block) };
        }
        Self { taken }
    }
}

impl Drop for Fragmented {
    fn drop(&mut self) {
        for &block in &self.taken {
            // SAFETY: from malloc, or null, and freed once.
            unsafe { libc::free(block) };
        }
    }
}

/// Gives what is free back to the system, so that what comes next finds a heap without history.
pub fn trim() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: may be called at any time.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Bytes that the program holds from its allocator now; where it does not tell, `None`.
pub fn allocated() -> Option<usize> {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: may be called at any time.
        let account = unsafe { libc::mallinfo2() };
        Some(account.uordblks + account.hblkhd)
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    None
}

/// A link of a list, as large as one that holds a spring.
struct Link {
    next: Option<Box<Link>>,
    value: [u32; 4],
}

/// How many times as long a walk over lists takes that were made in a fragmented heap as over those made in a fresh one: a
/// check that fragmentation does what it is meant to.
pub fn effect(links: usize) -> f64 {
    const ROW: usize = 8;
    let make = || {
        let lists = (0..links / ROW).map(|list| {
            let mut first = None;
            for place in 0..ROW {
                first = Some(Box::new(Link {
                    next: first,
                    value: [list as u32, place as u32, 0, 1],
                }));
            }
            first
        });
        lists.collect::<Vec<Option<Box<Link>>>>()
    };
    let walk = |lists: &[Option<Box<Link>>]| {
        let mut sum = 0u32;
        for list in lists {
            let mut link = list.as_deref();
            while let Some(here) = link {
                sum = sum.wrapping_add(here.value.iter().sum());
                link = here.next.as_deref();
            }
        }
        std::hint::black_box(sum);
    };
    let best = |lists: &[Option<Box<Link>>]| {
        let times = (0..3).map(|_| clock::time(|| walk(lists)).processor);
        times.fold(f64::INFINITY, f64::min)
    };
    trim();
    let fresh = make();
    let _heap = Fragmented::new(size_of::<Link>(), links);
    let scattered = make();
    best(&scattered) / best(&fresh)
}
