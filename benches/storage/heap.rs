//! A fragmented heap, as after many cuts: free blocks are scattered in random order.
#![allow(unsafe_code)]

use std::ffi::c_void;

use crate::clock;
use crate::random::Random;

/// A heap whose free blocks of one size are scattered among others, which stay allocated until this is dropped.
pub struct Fragmented {
    allocated_blocks: Vec<*mut c_void>,
}

impl Fragmented {
    /// Leaves `count` free blocks for later allocations of `size` bytes or up to 16 fewer.
    ///
    /// It allocates twice as many blocks and frees every second one, in random order. The blocks between prevent the
    /// allocator from merging neighbors.
    pub fn new(size: usize, count: usize) -> Self {
        // SAFETY: malloc may be called with any size.
        let mut blocks: Vec<*mut c_void> = (0..2 * count).map(|_| unsafe { libc::malloc(size) }).collect();
        let mut allocated_blocks = Vec::with_capacity(count);
        let mut free = Vec::with_capacity(count);
        for pair in blocks.chunks_exact(2) {
            free.push(pair[0]);
            allocated_blocks.push(pair[1]);
        }
        blocks.clear();
        Random(5).shuffle(&mut free);
        for block in free {
            // SAFETY: from malloc, or null, and freed once.
            unsafe { libc::free(block) };
        }
        Self { allocated_blocks }
    }
}

impl Drop for Fragmented {
    fn drop(&mut self) {
        for &block in &self.allocated_blocks {
            // SAFETY: from malloc, or null, and freed once.
            unsafe { libc::free(block) };
        }
    }
}

/// Returns free memory to the system, so that later allocations use a fresh heap.
pub fn trim() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: may be called at any time.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Bytes currently allocated by the program; `None` if the allocator does not report them.
pub fn allocated() -> Option<usize> {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: may be called at any time.
        let statistics = unsafe { libc::mallinfo2() };
        Some(statistics.uordblks + statistics.hblkhd)
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    None
}

/// A link of a list, as large as one that stores a spring.
struct Link {
    next: Option<Box<Link>>,
    value: [u32; 4],
}

/// The time of a walk over lists in a fragmented heap over that in a fresh heap. It checks that fragmentation has an
/// effect.
pub fn effect(links: usize) -> f64 {
    const ROW: usize = 8;
    let make = || {
        let lists = (0..links / ROW).map(|list| {
            let mut first = None;
            for index in 0..ROW {
                first = Some(Box::new(Link {
                    next: first,
                    value: [list as u32, index as u32, 0, 1],
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
