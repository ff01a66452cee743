//! Wavefront OBJ.
//!
//! This reader keeps vertex indices, reports the line of an error, and never panics on malformed files.

use glam::DVec3;

use super::scanner::{Scanner, parse, quoted};
use super::{RawMesh, check_vertex_count};
use crate::Result;
use crate::base::memory;

/// Statements without points, triangles or lines: materials, groups, free-form surfaces.
const IGNORED: &str = "vn vt vp g o s mg usemtl mtllib usemap maplib bevel c_interp d_interp lod shadow_obj trace_obj ctech stech \
    cstype deg bmat step curv curv2 surf parm trim hole scrv sp end con call";

pub fn read(scanner: &mut Scanner) -> Result<RawMesh> {
    let mut raw = RawMesh::default();
    // A face may precede its vertices, so the largest corner is checked at the end.
    let mut largest_corner = None;
    let mut words = Vec::new();
    let mut corners = Vec::new();
    while scanner.remaining() > 0 {
        let position = next_statement(scanner, &mut words)?;
        let fail = |message: String| scanner.fail_at(position, message);
        match words.as_slice() {
            [] => {}
            [b"v", x, y, z, ..] => {
                let mut vertex = [0.0; 3];
                for (coordinate, word) in vertex.iter_mut().zip([x, y, z]) {
                    *coordinate = parse(word)
                        .filter(|number: &f64| number.is_finite())
                        .ok_or_else(|| fail(format!("{} is no finite number", quoted(word))))?;
                }
                memory::push(&mut raw.vertices, DVec3::from(vertex))?;
                check_vertex_count(scanner, raw.vertices.len())?;
            }
            [b"v", ..] => return Err(fail("a vertex needs x, y and z".into())),
            [b"f", words @ ..] if words.len() >= 3 => {
                corners.clear();
                for word in words {
                    let corner = corner(word, raw.vertices.len())
                        .ok_or_else(|| fail(format!("{} names no vertex", quoted(word))))?;
                    largest_corner = largest_corner.max(Some((corner, position)));
                    memory::push(&mut corners, corner)?;
                }
                raw.add_polygon(&corners)?;
            }
            [b"f", ..] => return Err(fail("a face needs three corners".into())),
            [b"l" | b"p", ..] => raw.ignored_cells += 1,
            [word, ..] if IGNORED.split(' ').any(|name| name.as_bytes() == *word) => {}
            [word, ..] => return Err(fail(format!("{} is no statement", quoted(word)))),
        }
    }
    match (largest_corner, raw.vertices.len()) {
        (Some((corner, position)), count) if corner as usize >= count => Err(scanner.fail_at(
            position,
            format!("vertex {} is not there: there are {count}", corner as u64 + 1),
        )),
        _ => Ok(raw),
    }
}

/// Collects the words of the next statement. A statement is a line, or several if all but the last end in a backslash.
/// Returns its position.
fn next_statement<'a>(scanner: &mut Scanner<'a>, words: &mut Vec<&'a [u8]>) -> Result<usize> {
    words.clear();
    let mut position = None;
    loop {
        let line = scanner.line();
        let position = *position.get_or_insert(scanner.position());
        let text = line.split(|&byte| byte == b'#').next().unwrap_or(line);
        let continued = text.trim_ascii_end().strip_suffix(b"\\");
        let text = continued.unwrap_or(text);
        let words_of_line = text.split(u8::is_ascii_whitespace);
        memory::extend(words, words_of_line.filter(|word| !word.is_empty()))?;
        if continued.is_none() || scanner.remaining() == 0 {
            return Ok(position);
        }
    }
}

/// The vertex of a face's corner: `v`, `v/vt`, `v//vn` or `v/vt/vn`. Indices count from 1 up, or from -1, the latest
/// vertex, down.
fn corner(word: &[u8], vertex_count: usize) -> Option<u32> {
    let number: i64 = parse(word.split(|&byte| byte == b'/').next()?)?;
    let vertex = match number {
        0 => return None,
        1.. => number - 1,
        _ => number.checked_add(i64::try_from(vertex_count).ok()?)?,
    };
    u32::try_from(vertex).ok()
}
