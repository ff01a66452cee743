//! The format of snapshots: a header, and sections. Each type saves its fields next to its definition.
//!
//! | bytes | what |
//! |---|---|
//! | 0..8 | [`MAGIC`] |
//! | 8..12 | [`VERSION`] |
//! | 12..20 | the shape: a hash over the names and types of all fields |
//! | 20..28 | the total number of bytes |
//! | 28..36 | XXH3 of all other bytes |
//! | 36.. | sections: a tag of four bytes, the length in eight bytes, and the content |
//!
//! All numbers are little-endian.

mod bytes;
mod kernel;
mod saved;

use xxhash_rust::xxh3::Xxh3Default;

pub(crate) use bytes::{Reader, Writer};
pub(crate) use saved::{
    Saved, floats_into, least_of_field, load_count, saved, saved_enum, shape_of_field, shape_of_name, shape_with,
};

use crate::base::{Error, Result, ensure};
use crate::simd::ChosenKernel;

/// No text begins with these bytes, and a transfer in text mode changes them.
const MAGIC: [u8; 8] = *b"\x93sinew\r\n";

/// Raise this when a field changes its meaning but not its name and type.
const VERSION: u32 = 3;

const CHECKSUM: usize = 28;
const HEADER: usize = 36;

/// Writes the header for this shape. Call [`seal`] after all sections.
pub(crate) fn begin(to: &mut Writer, shape: u64) {
    to.write(&MAGIC);
    VERSION.save(to);
    shape.save(to);
    0_u64.save(to);
    0_u64.save(to);
}

/// Writes a section.
pub(crate) fn write_section(to: &mut Writer, tag: [u8; 4], content: impl FnOnce(&mut Writer)) {
    to.write(&tag);
    let length_at = to.size();
    0_u64.save(to);
    let start = to.size();
    content(to);
    let size = to.size() - start;
    to.end_section(size);
    to.overwrite(length_at, &(size as u64).to_le_bytes());
}

/// Completes the header. Bytes too short for a header are refused by [`opened`].
pub(crate) fn seal(bytes: &mut [u8]) {
    if bytes.len() < HEADER {
        return;
    }
    let size = bytes.len() as u64;
    bytes[CHECKSUM - 8..CHECKSUM].copy_from_slice(&size.to_le_bytes());
    let checksum = checksum(bytes);
    bytes[CHECKSUM..HEADER].copy_from_slice(&checksum.to_le_bytes());
}

fn checksum(bytes: &[u8]) -> u64 {
    let mut hasher = Xxh3Default::new();
    hasher.update(&bytes[..CHECKSUM]);
    hasher.update(&bytes[HEADER..]);
    hasher.digest()
}

/// The bytes after the header, if the header is valid and of this shape.
pub(crate) fn opened(bytes: &[u8], shape: u64) -> Result<&[u8]> {
    let size = bytes.len();
    let known = size.min(MAGIC.len());
    ensure!(
        bytes[..known] == MAGIC[..known],
        "bytes are no world: they begin with something else"
    );
    ensure!(
        size >= HEADER,
        "size is {size}: bytes of a world have a header of {HEADER}"
    );
    let number = |at: usize| bytes[at..].first_chunk().copied().map_or(0, u64::from_le_bytes);
    let version = bytes[8..].first_chunk().copied().map_or(0, u32::from_le_bytes);
    if version != VERSION || number(12) != shape {
        return Err(Error::Unsupported(format!(
            "bytes are of a world of another version of sinew: {version} {:016x}, this one reads {VERSION} {shape:016x}",
            number(12)
        )));
    }
    ensure!(
        number(20) == size as u64,
        "size is {size}: the world in bytes was saved as {}",
        number(20)
    );
    ensure!(
        number(CHECKSUM) == checksum(bytes),
        "bytes are no world: some have changed since it was saved, as their checksum tells"
    );
    Ok(&bytes[HEADER..])
}

/// Reads the next section, which must have this tag and end with its content.
pub(crate) fn read_section<T>(
    bytes: &mut &[u8],
    tag: [u8; 4],
    kernel: ChosenKernel,
    content: impl FnOnce(&mut Reader) -> Result<T>,
) -> Result<T> {
    let refusal = |why: &str| {
        let name = String::from_utf8_lossy(&tag);
        Error::invalid(format!("bytes are no world: section {name} {why}"))
    };
    let (found, rest) = bytes.split_first_chunk().ok_or_else(|| refusal("is missing"))?;
    ensure!(*found == tag, refusal("is missing"));
    let (size, rest) = rest.split_first_chunk().ok_or_else(|| refusal("ends early"))?;
    let size = usize::try_from(u64::from_le_bytes(*size)).map_err(|_| refusal("ends early"))?;
    let (section, rest) = rest.split_at_checked(size).ok_or_else(|| refusal("ends early"))?;
    *bytes = rest;
    let mut from = Reader::new(section, kernel);
    let value = content(&mut from)?;
    if from.left() > 0 {
        return Err(from.refusal("something is behind what a section holds"));
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Kernel;

    #[test]
    fn what_is_saved_can_be_loaded_or_is_refused_by_both() {
        let room = |other_bytes: usize| {
            let mut to = Writer::new(None);
            write_section(&mut to, *b"LONG", |to| {
                to.buffer(other_bytes);
            });
            write_section(&mut to, *b"ROOM", |to| to.needs(2 << 30));
            to
        };
        // Memory is counted for each section alone.
        for other_bytes in [0, 1 << 28] {
            assert!(room(other_bytes).is_too_large());
        }
        let kernel = Kernel::Portable.choose().expect("a kernel for every processor");
        let mut bytes = &b"ROOM\0\0\0\0\0\0\0\0"[..];
        let refused = read_section(&mut bytes, *b"ROOM", kernel, |from| from.reserve_memory(Some(2 << 30)));
        assert!(refused.is_err());
    }
}
