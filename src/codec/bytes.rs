//! Bytes that values are written to, and read from as if somebody had made them up.

use crate::base::{Error, Result};
use crate::simd::ChosenKernel;

/// What a world may take beside its bytes: rooms that are kept for what may come.
const ROOM: usize = 1 << 30;

/// A world may take so many times its bytes in memory.
const GROWTH: usize = 64;

/// What is written; without a place for it, only counted.
pub(crate) struct Writer<'a> {
    to: Option<&'a mut [u8]>,
    size: usize,
    /// What a reader will reserve for the section.
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

    pub fn put(&mut self, bytes: &[u8]) {
        if let Some(place) = self.place(bytes.len()) {
            place.copy_from_slice(bytes);
        }
    }

    /// Where the next so many bytes go, if anywhere.
    pub fn place(&mut self, count: usize) -> Option<&mut [u8]> {
        let start = self.size;
        self.size += count;
        self.to.as_deref_mut()?.get_mut(start..start + count)
    }

    /// How many bytes were written.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Writes over what was put.
    pub fn put_at(&mut self, start: usize, bytes: &[u8]) {
        let place = self
            .to
            .as_deref_mut()
            .and_then(|to| to.get_mut(start..start + bytes.len()));
        if let Some(place) = place {
            place.copy_from_slice(bytes);
        }
    }

    /// A reader will reserve so many bytes of memory here.
    pub fn needs(&mut self, memory: usize) {
        self.memory = self.memory.saturating_add(memory);
    }

    /// A section of so many bytes is written, for which by itself a reader reserves no more than [`most_memory`].
    pub fn end_section(&mut self, size: usize) {
        self.is_too_large |= std::mem::take(&mut self.memory) > most_memory(size);
    }

    /// Whether a reader will refuse to reserve what it takes.
    pub fn is_too_large(&self) -> bool {
        self.is_too_large
    }
}

/// What so many bytes may take of memory.
fn most_memory(size: usize) -> usize {
    size.saturating_mul(GROWTH).saturating_add(ROOM)
}

/// What is read.
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// What may still be reserved.
    memory: usize,
    /// Of all that is read.
    pub kernel: ChosenKernel,
}

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8], kernel: ChosenKernel) -> Self {
        Self {
            bytes,
            at: 0,
            memory: most_memory(bytes.len()),
            kernel,
        }
    }

    /// The next so many bytes.
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

    /// How many bytes are left.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// Refuses to take more memory than such a world does; `None`: more than there is.
    pub fn will_take(&mut self, size: Option<usize>) -> Result<()> {
        let left = size.and_then(|size| self.memory.checked_sub(size));
        self.memory = left.ok_or_else(|| self.refusal("more room is announced than such a world has"))?;
        Ok(())
    }

    /// An empty list with room for so many values.
    pub fn reserved<T>(&mut self, count: usize) -> Result<Vec<T>> {
        self.will_take(count.checked_mul(size_of::<T>()))?;
        crate::base::memory::reserved(count)
    }

    /// Why the bytes are refused.
    pub fn refusal(&self, why: &str) -> Error {
        Error::invalid(format!("bytes are no world: {why}, at byte {}", self.at))
    }
}
