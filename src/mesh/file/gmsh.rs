//! Gmsh ASCII format, versions 1, 2 and 4.1.

use std::collections::HashMap;

use super::scanner::{Scanner, parse, quoted};
use super::{RawMesh, check_vertex_count};
use crate::Result;
use crate::base::{ensure, memory};

/// The versions of the layout of nodes and elements.
#[derive(Clone, Copy, PartialEq)]
enum Version {
    One,
    Two,
    FourOne,
}

pub fn read(scanner: &mut Scanner) -> Result<RawMesh> {
    let mut version = None;
    let mut nodes = None;
    let mut raw = RawMesh::default();
    let mut has_elements = false;
    while let Some(section) = scanner.next_word() {
        match (section, version) {
            (b"$MeshFormat", None) => version = Some(read_version(scanner)?),
            // Version 1 has no header.
            (b"$NOD", None) => {
                version = Some(Version::One);
                nodes = Some(read_nodes(scanner, Version::One, &mut raw)?);
                scanner.expect("$ENDNOD")?;
            }
            (b"$Nodes", Some(version)) if nodes.is_none() => {
                nodes = Some(read_nodes(scanner, version, &mut raw)?);
                scanner.expect("$EndNodes")?;
            }
            (b"$ELM" | b"$Elements", Some(version)) if !has_elements => {
                let Some(nodes) = &nodes else {
                    return Err(scanner.fail("elements before the nodes"));
                };
                read_elements(scanner, version, nodes, &mut raw)?;
                scanner.expect(if section == b"$ELM" { "$ENDELM" } else { "$EndElements" })?;
                has_elements = true;
            }
            ([b'$', name @ ..], _) if !is_read(name) => skip_section(scanner, name)?,
            _ => return Err(scanner.fail(format!("{} has no place here", quoted(section)))),
        }
    }
    ensure!(has_elements, scanner.fail("the file ends without elements"));
    Ok(raw)
}

/// True for a section that is read, so that a repeated one must not be skipped.
fn is_read(name: &[u8]) -> bool {
    matches!(name, b"MeshFormat" | b"NOD" | b"Nodes" | b"ELM" | b"Elements")
        || name.starts_with(b"End")
        || name.starts_with(b"END")
}

fn read_version(scanner: &mut Scanner) -> Result<Version> {
    let word = scanner.word("version")?;
    let version = match parse::<f64>(word) {
        Some(number) if (2.0..3.0).contains(&number) => Version::Two,
        Some(4.1) => Version::FourOne,
        _ => {
            return Err(scanner.fail(format!(
                "version {} of Gmsh's format; 1, 2 and 4.1 can be read",
                quoted(word)
            )));
        }
    };
    match scanner.integer("file type")? {
        0 => {}
        1 => {
            return Err(scanner.fail("a binary Gmsh file; only ASCII can be read: save it with -format msh2"));
        }
        other => return Err(scanner.fail(format!("file type {other} is neither 0 nor 1"))),
    }
    scanner.integer("data size")?;
    scanner.expect("$EndMeshFormat")?;
    Ok(version)
}

/// Skips a section of any content.
fn skip_section(scanner: &mut Scanner, name: &[u8]) -> Result<()> {
    let position = scanner.position();
    scanner.line();
    while scanner.remaining() > 0 {
        let line = scanner.line().trim_ascii();
        let end = line.strip_prefix(b"$End").or_else(|| line.strip_prefix(b"$END"));
        if end == Some(name) {
            return Ok(());
        }
    }
    Err(scanner.fail_at(position, format!("section {} has no end", quoted(name))))
}

/// Reads the nodes. Returns the vertex of each tag; tags may be sparse and in any order.
fn read_nodes(scanner: &mut Scanner, version: Version, raw: &mut RawMesh) -> Result<HashMap<u64, u32>> {
    let mut nodes = HashMap::new();
    let add = |scanner: &Scanner, nodes: &mut HashMap<u64, u32>, tag: u64| -> Result<()> {
        check_vertex_count(scanner, nodes.len() + 1)?;
        nodes.try_reserve(1)?;
        match nodes.insert(tag, nodes.len() as u32) {
            None => Ok(()),
            Some(_) => Err(scanner.fail(format!("node {tag} is there twice"))),
        }
    };
    if version != Version::FourOne {
        for _ in 0..scanner.count("nodes", 8)? {
            let tag = scanner.integer("node number")?;
            add(scanner, &mut nodes, tag)?;
            memory::push(&mut raw.vertices, scanner.point()?)?;
        }
        return Ok(nodes);
    }
    let blocks = scanner.count("blocks of nodes", 8)?;
    let total = scanner.count("nodes", 8)?;
    skip_numbers(scanner, 2, "node tag")?;
    for _ in 0..blocks {
        let dimension = scanner.integer("dimension")?;
        entity_tag(scanner)?;
        let parameters = match scanner.integer("parametric flag")? {
            0 => 0,
            1 => dimension.min(3),
            other => {
                return Err(scanner.fail(format!("parametric flag {other} is neither 0 nor 1")));
            }
        };
        let count = scanner.count("nodes", 8)?;
        for _ in 0..count {
            let tag = scanner.integer("node tag")?;
            add(scanner, &mut nodes, tag)?;
        }
        for _ in 0..count {
            memory::push(&mut raw.vertices, scanner.point()?)?;
            for _ in 0..parameters {
                scanner.number("parametric coordinate")?;
            }
        }
    }
    if nodes.len() != total {
        let found = nodes.len();
        return Err(scanner.fail(format!("{found} nodes, but {total} were announced")));
    }
    Ok(nodes)
}

fn read_elements(scanner: &mut Scanner, version: Version, nodes: &HashMap<u64, u32>, raw: &mut RawMesh) -> Result<()> {
    if version != Version::FourOne {
        for _ in 0..scanner.count("elements", 6)? {
            scanner.integer("element number")?;
            let kind = scanner.integer("element type")?;
            if version == Version::One {
                skip_numbers(scanner, 2, "region")?;
                let count = scanner.integer("number of nodes")?;
                let expected = node_count(scanner, kind)?;
                if count != expected as u64 {
                    return Err(scanner.fail(format!("{count} nodes for an element of {expected}")));
                }
            } else {
                let tags = scanner.count("tags", 2)?;
                for _ in 0..tags {
                    scanner.word("a tag")?; // partitions may be negative
                }
            }
            read_element(scanner, kind, nodes, raw)?;
        }
        return Ok(());
    }
    let blocks = scanner.count("blocks of elements", 8)?;
    let total = scanner.count("elements", 4)?;
    skip_numbers(scanner, 2, "element tag")?;
    let mut found = 0;
    for _ in 0..blocks {
        scanner.integer("dimension")?;
        entity_tag(scanner)?;
        let kind = scanner.integer("element type")?;
        let count = scanner.count("elements", 4)?;
        for _ in 0..count {
            scanner.integer("element tag")?;
            read_element(scanner, kind, nodes, raw)?;
        }
        found += count;
    }
    if found != total {
        return Err(scanner.fail(format!("{found} elements, but {total} were announced")));
    }
    Ok(())
}

/// Reads the nodes of an element and adds it to the mesh.
fn read_element(scanner: &mut Scanner, kind: u64, nodes: &HashMap<u64, u32>, raw: &mut RawMesh) -> Result<()> {
    let count = node_count(scanner, kind)?;
    let mut corners = [0; 10];
    for corner in &mut corners[..count] {
        let tag = scanner.integer("node number")?;
        *corner = *nodes
            .get(&tag)
            .ok_or_else(|| scanner.fail(format!("node {tag} is not there")))?;
    }
    let [a, b, c, d, ..] = corners;
    match kind {
        TRIANGLE | TRIANGLE_OF_6 => memory::push(&mut raw.triangles, [a, b, c]),
        QUAD | QUAD_OF_8 | QUAD_OF_9 => raw.add_polygon(&[a, b, c, d]),
        TETRAHEDRON | TETRAHEDRON_OF_10 => memory::push(&mut raw.tetrahedra, [a, b, c, d]),
        _ => {
            raw.ignored_cells += 1;
            Ok(())
        }
    }
}

const LINE: u64 = 1;
const TRIANGLE: u64 = 2;
const QUAD: u64 = 3;
const TETRAHEDRON: u64 = 4;
const LINE_OF_3: u64 = 8;
const TRIANGLE_OF_6: u64 = 9;
const QUAD_OF_9: u64 = 10;
const TETRAHEDRON_OF_10: u64 = 11;
const POINT: u64 = 15;
const QUAD_OF_8: u64 = 16;

/// The number of nodes of an element type. The corners come first.
fn node_count(scanner: &Scanner, kind: u64) -> Result<usize> {
    match kind {
        POINT => Ok(1),
        LINE => Ok(2),
        TRIANGLE | LINE_OF_3 => Ok(3),
        QUAD | TETRAHEDRON => Ok(4),
        TRIANGLE_OF_6 => Ok(6),
        QUAD_OF_8 => Ok(8),
        QUAD_OF_9 => Ok(9),
        TETRAHEDRON_OF_10 => Ok(10),
        _ => Err(scanner.fail(format!(
            "element type {kind}: only points, lines, triangles, quadrangles and tetrahedra can be read"
        ))),
    }
}

/// Skips an entity tag, which may be negative.
fn entity_tag(scanner: &mut Scanner) -> Result<()> {
    scanner.number("entity tag").map(drop)
}

fn skip_numbers(scanner: &mut Scanner, count: usize, what: &str) -> Result<()> {
    for _ in 0..count {
        scanner.number(what)?;
    }
    Ok(())
}
