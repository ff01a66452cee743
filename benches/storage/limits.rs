//! Memory limits: the bytes that a substep must move, moved by loops that do nothing else.
#![allow(unsafe_code)]

use std::hint::black_box;

use crate::clock;

/// Methods to advance positions. The fastest depends on the processor and on the addresses of the arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Method {
    /// All x, then all y, then all z.
    AxisByAxis,
    /// All axes in one loop.
    Together,
    /// Non-temporal stores of new positions, which avoid reading their cache lines first.
    Streaming,
}

/// The state of a thread's share of the nodes, one array per axis.
struct Share {
    positions: [Vec<f32>; 3],
    next: [Vec<f32>; 3],
    velocities: [Vec<f32>; 3],
    /// Data of the same size as the links.
    links: Vec<u64>,
}

impl Share {
    fn new(nodes: usize, link_bytes: usize) -> Self {
        let axes = |value: f32| std::array::from_fn(|_| vec![value; nodes]);
        Self {
            positions: axes(1.0),
            next: axes(1.0),
            velocities: axes(1e-3),
            links: (0..link_bytes as u64 / 8).collect(),
        }
    }

    /// Reads positions, reads and writes velocities, writes the next positions.
    fn advance(&mut self, method: Method) {
        let (kick, drift) = (black_box(1e-9f32), black_box(1e-4f32));
        let [x, y, z] = &self.positions;
        let [next_x, next_y, next_z] = &mut self.next;
        let [velocity_x, velocity_y, velocity_z] = &mut self.velocities;
        match method {
            Method::AxisByAxis => {
                axis(x, velocity_x, next_x, kick, drift);
                axis(y, velocity_y, next_y, kick, drift);
                axis(z, velocity_z, next_z, kick, drift);
            }
            Method::Together => {
                let positions = x.iter().zip(y).zip(z);
                let velocities = velocity_x.iter_mut().zip(velocity_y).zip(velocity_z);
                let next = next_x.iter_mut().zip(next_y).zip(next_z);
                for ((((x, y), z), ((u, v), w)), ((next_x, next_y), next_z)) in positions.zip(velocities).zip(next) {
                    *u += kick;
                    *v += kick;
                    *w += kick;
                    *next_x = x + drift * *u;
                    *next_y = y + drift * *v;
                    *next_z = z + drift * *w;
                }
            }
            Method::Streaming => {
                axis_streaming(x, velocity_x, next_x, kick, drift);
                axis_streaming(y, velocity_y, next_y, kick, drift);
                axis_streaming(z, velocity_z, next_z, kick, drift);
            }
        }
        std::mem::swap(&mut self.positions, &mut self.next);
    }

    fn read_links(&self) -> u64 {
        self.links.iter().fold(0, |sum, &link| sum.wrapping_add(link))
    }
}

fn axis(positions: &[f32], velocities: &mut [f32], next: &mut [f32], kick: f32, drift: f32) {
    for ((next, position), velocity) in next.iter_mut().zip(positions).zip(velocities) {
        *velocity += kick;
        *next = position + drift * *velocity;
    }
}

#[cfg(target_arch = "x86_64")]
fn axis_streaming(positions: &[f32], velocities: &mut [f32], next: &mut [f32], kick: f32, drift: f32) {
    use std::arch::x86_64::{__m128, _mm_add_ps, _mm_loadu_ps, _mm_mul_ps, _mm_set1_ps, _mm_sfence, _mm_storeu_ps};
    // SAFETY: four floats have the size of this register type, for which every bit pattern is valid.
    let (before, middle, after) = unsafe { next.align_to_mut::<__m128>() };
    let (start, end) = (before.len(), before.len() + 4 * middle.len());
    axis(&positions[..start], &mut velocities[..start], before, kick, drift);
    axis(&positions[end..], &mut velocities[end..], after, kick, drift);
    let sources = positions[start..end]
        .chunks_exact(4)
        .zip(velocities[start..end].chunks_exact_mut(4));
    // SAFETY: SSE is part of x86-64. Four floats are read and written at a time, and the destination of the
    // non-temporal store is aligned.
    unsafe {
        let (kick, drift) = (_mm_set1_ps(kick), _mm_set1_ps(drift));
        for (next, (position, velocity)) in middle.iter_mut().zip(sources) {
            let kicked = _mm_add_ps(_mm_loadu_ps(velocity.as_ptr()), kick);
            _mm_storeu_ps(velocity.as_mut_ptr(), kicked);
            let moved = _mm_add_ps(_mm_loadu_ps(position.as_ptr()), _mm_mul_ps(drift, kicked));
            std::arch::x86_64::_mm_stream_ps(std::ptr::from_mut(next).cast(), moved);
        }
        _mm_sfence();
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn axis_streaming(positions: &[f32], velocities: &mut [f32], next: &mut [f32], kick: f32, drift: f32) {
    axis(positions, velocities, next, kick, drift);
}

/// A body's state and its links' bytes, moved by one or more threads.
pub struct Memory {
    shares: Vec<Share>,
    method: Method,
}

impl Memory {
    pub fn new(nodes: usize, link_bytes: usize, threads: usize) -> Self {
        let mut memory = Self {
            shares: (0..threads)
                .map(|_| Share::new(nodes / threads, link_bytes / threads))
                .collect(),
            method: Method::AxisByAxis,
        };
        let passes = 1 + 2_000_000 / nodes;
        let mut time = |method| {
            memory.method = method;
            let times = (0..4).map(|_| clock::time(|| memory.advance(passes)).wall);
            times.fold(f64::INFINITY, f64::min)
        };
        let timings = [Method::AxisByAxis, Method::Together, Method::Streaming].map(|method| (time(method), method));
        let best = timings.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        memory.method = best.map_or(Method::AxisByAxis, |(_, method)| method);
        memory
    }

    /// Moves the state's bytes of a substep, `passes` times.
    pub fn advance(&mut self, passes: usize) {
        let method = self.method;
        self.share(|share| {
            for _ in 0..passes {
                share.advance(method);
            }
        });
    }

    /// Moves the state's bytes and reads the links, `passes` times.
    pub fn substep(&mut self, passes: usize) {
        let method = self.method;
        self.share(|share| {
            for _ in 0..passes {
                black_box(share.read_links());
                share.advance(method);
            }
        });
    }

    fn share(&mut self, work: impl Fn(&mut Share) + Sync) {
        if let [share] = &mut self.shares[..] {
            return work(share);
        }
        std::thread::scope(|scope| {
            for share in &mut self.shares {
                let work = &work;
                scope.spawn(move || work(share));
            }
        });
    }
}
