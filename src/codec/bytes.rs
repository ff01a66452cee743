//! Writing values to bytes, and reading them from bytes that can be forged.

use crate::base::{Error, Result};
use crate::simd::ChosenKernel;

/// The memory that a world can reserve beyond a multiple of its snapshot, bytes.
const ROOM: usize = 1 << 30;

/// The largest ratio of memory to bytes of the snapshot.
const GROWTH: usize = 64;

/// Writes to a buffer, or only counts bytes.
pub(crate) struct Writer<'a> {
    to: Option<&'a mut [u8]>,
    size: usize,
    /// The memory that a reader will reserve for the section.
    memory: usize,
    is_too_large: bool,
}

impl<'a> Writer<'a> {
    pub fn new(to: Option<&'a mut [u8]>) -> Self {
        Self {
            to,
            size: 0,
            memory: 0,
            is_too_large: false,
        }
    }

    pub fn write(&mut self, bytes: &[u8]) {
        if let Some(buffer) = self.buffer(bytes.len()) {
            buffer.copy_from_slice(bytes);
        }
    }

    /// The buffer for the next `count` bytes; `None` if bytes are only counted.
    pub fn buffer(&mut self, count: usize) -> Option<&mut [u8]> {
        let start = self.size;
        self.size += count;
        self.to.as_deref_mut()?.get_mut(start..start + count)
    }

    /// The number of bytes written.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Overwrites earlier bytes.
    pub fn overwrite(&mut self, start: usize, bytes: &[u8]) {
        let buffer = self
            .to
            .as_deref_mut()
            .and_then(|to| to.get_mut(start..start + bytes.len()));
        if let Some(buffer) = buffer {
            buffer.copy_from_slice(bytes);
        }
    }

    /// Notes that a reader will reserve `memory` bytes here.
    pub fn needs(&mut self, memory: usize) {
        self.memory = self.memory.saturating_add(memory);
    }

    /// Ends a section of `size` bytes and checks that a reader will not refuse its memory ([`max_memory`]).
    pub fn end_section(&mut self, size: usize) {
        self.is_too_large |= std::mem::take(&mut self.memory) > max_memory(size);
    }

    /// True if a reader will refuse to reserve the memory.
    pub fn is_too_large(&self) -> bool {
        self.is_too_large
    }
}

/// The largest memory for a section of `size` bytes.
fn max_memory(size: usize) -> usize {
    size.saturating_mul(GROWTH).saturating_add(ROOM)
}

/// Reads values from bytes.
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// The memory that can still be reserved.
    memory: usize,
    /// The SIMD level of all loaded objects.
    pub kernel: ChosenKernel,
}

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8], kernel: ChosenKernel) -> Self {
        Self {
            bytes,
            at: 0,
            memory: max_memory(bytes.len()),
            kernel,
        }
    }

    /// The next `count` bytes.
    pub fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let end = self.at.checked_add(count);
        let Some(taken) = end.and_then(|end| self.bytes.get(self.at..end)) else {
            return Err(self.refusal("more is announced than there is"));
        };
        self.at += count;
        Ok(taken)
    }

    pub fn take_array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// The number of bytes left.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// Refuses to reserve more memory than a world of this size can have; `None` stands for an overflow.
    pub fn reserve_memory(&mut self, size: Option<usize>) -> Result<()> {
        let left = size.and_then(|size| self.memory.checked_sub(size));
        self.memory = left.ok_or_else(|| self.refusal("more room is announced than such a world has"))?;
        Ok(())
    }

    /// An empty list with room for `count` values.
    pub fn reserved<T>(&mut self, count: usize) -> Result<Vec<T>> {
        self.reserve_memory(count.checked_mul(size_of::<T>()))?;
        crate::base::memory::reserved(count)
    }

    /// The error for bytes that are refused.
    pub fn refusal(&self, why: &str) -> Error {
        Error::invalid(format!("bytes are no world: {why}, at byte {}", self.at))
    }
}
