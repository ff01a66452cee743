//! TetGen's .node and .ele files.

use std::path::Path;

use super::scanner::Scanner;
use super::{RawMesh, check_vertex_count, read_file};
use crate::Result;

/// Reads both files, given the path of either.
pub fn read(path: &Path) -> Result<RawMesh> {
    let mut raw = RawMesh::default();
    let node_path = path.with_extension("node");
    let node_bytes = read_file(&node_path)?;
    let first = read_nodes(
        &mut Scanner::new(&node_path, &node_bytes).comments_begin_with(b'#'),
        &mut raw,
    )?;
    let element_path = path.with_extension("ele");
    let element_bytes = read_file(&element_path)?;
    read_elements(
        &mut Scanner::new(&element_path, &element_bytes).comments_begin_with(b'#'),
        &mut raw,
        first,
    )?;
    Ok(raw)
}

/// Reads the nodes. Returns the index of the first, 0 or 1.
fn read_nodes(scanner: &mut Scanner, raw: &mut RawMesh) -> Result<u64> {
    let count = scanner.count("points", 7)?;
    check_vertex_count(scanner, count)?;
    let dimension = scanner.integer("dimension")?;
    if dimension != 3 {
        return Err(scanner.fail(format!("points of dimension {dimension}, not 3")));
    }
    let attributes = scanner.integer("number of attributes")?;
    let markers = scanner.integer("number of boundary markers")?;
    raw.vertices.try_reserve_exact(count)?;
    let mut first = 0;
    for i in 0..count as u64 {
        let number = scanner.integer("point number")?;
        if i == 0 && number <= 1 {
            first = number;
        }
        if number != first + i {
            let expected = first + i;
            return Err(scanner.fail(format!("point {number} where {expected} should be")));
        }
        raw.vertices.push(scanner.point()?);
        for _ in 0..attributes {
            scanner.number("attribute")?;
        }
        for _ in 0..markers {
            scanner.number("boundary marker")?;
        }
    }
    expect_end(scanner)?;
    Ok(first)
}

fn read_elements(scanner: &mut Scanner, raw: &mut RawMesh, first: u64) -> Result<()> {
    let count = scanner.count("tetrahedra", 10)?;
    let corners = scanner.integer("number of points per tetrahedron")?;
    if corners != 4 && corners != 10 {
        return Err(scanner.fail(format!("tetrahedra of {corners} points, not 4 or 10")));
    }
    let attributes = scanner.integer("number of attributes")?;
    raw.tetrahedra.try_reserve_exact(count)?;
    for _ in 0..count {
        scanner.integer("tetrahedron number")?;
        let mut tetrahedron = [0; 4];
        for corner in &mut tetrahedron {
            let number = scanner.integer("point number")?;
            *corner = scanner.vertex(number, first, raw.vertices.len())?;
        }
        for _ in 4..corners {
            let number = scanner.integer("point number")?;
            scanner.vertex(number, first, raw.vertices.len())?;
        }
        for _ in 0..attributes {
            scanner.number("attribute")?;
        }
        raw.tetrahedra.push(tetrahedron);
    }
    expect_end(scanner)
}

/// Returns an error if anything but comments follows: the header's count would be wrong.
fn expect_end(scanner: &mut Scanner) -> Result<()> {
    match scanner.next_word() {
        None => Ok(()),
        Some(_) => Err(scanner.fail("more follows than the first line says")),
    }
}
