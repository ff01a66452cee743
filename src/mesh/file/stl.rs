//! STL, binary and ASCII.

use glam::{DVec3, Vec3};

use super::scanner::{Scanner, is};
use super::{RawMesh, check_vertex_count};
use crate::Result;
use crate::base::memory;

const HEADER: usize = 80;
/// A normal, three corners and two bytes of attributes.
const FACET: usize = 50;

pub fn read(scanner: &mut Scanner) -> Result<RawMesh> {
    // Binary headers can begin with "solid" too, so the size decides.
    let bytes = scanner.bytes();
    let begins_with_solid = scanner.peek_word().is_some_and(|word| is(word, "solid"));
    if binary_size(bytes) == Some(bytes.len() as u64) || !begins_with_solid {
        scanner.binary = true;
        return read_binary(scanner);
    }
    read_ascii(scanner)
}

/// The size of a binary file with this file's number of facets.
fn binary_size(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(HEADER..)?.first_chunk()?;
    let facets = FACET as u64 * u64::from(u32::from_le_bytes(*count));
    Some(HEADER as u64 + 4 + facets)
}

fn read_binary(scanner: &mut Scanner) -> Result<RawMesh> {
    scanner.skip(HEADER, "the header; an ASCII file begins with \"solid\"")?;
    let count = u32::from_le_bytes(scanner.take("the number of facets")?) as usize;
    if scanner.remaining() as u64 != FACET as u64 * count as u64 {
        let (size, facets) = (scanner.remaining(), FACET);
        return Err(scanner.fail(format!(
            "{count} facets of {facets} bytes should follow, but {size} bytes do; an ASCII file begins with \"solid\""
        )));
    }
    let mut raw = RawMesh::default();
    raw.vertices.try_reserve_exact(3 * count)?;
    raw.triangles.try_reserve_exact(count)?;
    for _ in 0..count {
        scanner.skip(12, "a normal")?;
        for _ in 0..3 {
            let mut corner = [0.0; 3];
            for coordinate in &mut corner {
                *coordinate = f32::from_le_bytes(scanner.take("a corner")?);
                scanner.finite(f64::from(*coordinate), "coordinate")?;
            }
            raw.vertices.push(Vec3::from(corner).as_dvec3());
        }
        scanner.skip(2, "the attributes")?;
        add_triangle(scanner, &mut raw)?;
    }
    Ok(raw)
}

fn read_ascii(scanner: &mut Scanner) -> Result<RawMesh> {
    let mut raw = RawMesh::default();
    while scanner.peek_word().is_some() {
        scanner.expect("solid")?;
        scanner.line(); // its name
        loop {
            let word = scanner.word("\"facet\" or \"endsolid\"")?;
            if is(word, "endsolid") {
                scanner.line();
                break;
            }
            if !is(word, "facet") {
                return Err(scanner.fail("a facet should begin or the solid end here"));
            }
            scanner.expect("normal")?;
            for _ in 0..3 {
                // Some programs write "nan" for the normal of a degenerate facet.
                scanner.word("a normal")?;
            }
            scanner.expect("outer")?;
            scanner.expect("loop")?;
            for _ in 0..3 {
                scanner.expect("vertex")?;
                let corner: DVec3 = scanner.point()?;
                memory::push(&mut raw.vertices, corner)?;
            }
            scanner.expect("endloop")?;
            scanner.expect("endfacet")?;
            add_triangle(scanner, &mut raw)?;
        }
    }
    Ok(raw)
}

/// Adds the triangle of the last three vertices.
fn add_triangle(scanner: &Scanner, raw: &mut RawMesh) -> Result<()> {
    check_vertex_count(scanner, raw.vertices.len())?;
    let next = raw.vertices.len() as u32;
    memory::push(&mut raw.triangles, [next - 3, next - 2, next - 1])
}
