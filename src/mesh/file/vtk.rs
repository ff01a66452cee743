//! VTK legacy format: unstructured grids and polygonal data, ASCII and binary (big-endian).

use glam::DVec3;

use super::scanner::{Scanner, is, parse, quoted};
use super::{RawMesh, check_vertex_count};
use crate::Result;
use crate::base::memory;

pub fn read(scanner: &mut Scanner) -> Result<RawMesh> {
    let header = scanner.line();
    let version: f64 = header
        .strip_prefix(b"# vtk DataFile Version ")
        .and_then(|version| parse(version.trim_ascii()))
        .filter(|version| (1.0..6.0).contains(version))
        .ok_or_else(|| scanner.fail("\"# vtk DataFile Version\" and a number from 1 to 5 should be here"))?;
    scanner.line(); // the title
    let encoding = scanner.word("ASCII or BINARY")?;
    let binary = is(encoding, "BINARY");
    if !binary && !is(encoding, "ASCII") {
        return Err(scanner.fail(format!("{} is neither ASCII nor BINARY", quoted(encoding))));
    }
    scanner.expect("DATASET")?;
    let dataset = scanner.word("the kind of data")?;
    let grid = is(dataset, "UNSTRUCTURED_GRID");
    if !grid && !is(dataset, "POLYDATA") {
        return Err(scanner.fail(format!(
            "{}: only UNSTRUCTURED_GRID and POLYDATA can be read",
            quoted(dataset)
        )));
    }
    scanner.binary = binary;

    let mut raw = RawMesh::default();
    let mut grid_cells = None;
    let mut grid_kinds = None;
    while let Some(section) = scanner.next_word() {
        // Point data and cell data follow all points and cells.
        if is(section, "POINT_DATA") || is(section, "CELL_DATA") {
            break;
        } else if is(section, "METADATA") {
            skip_metadata(scanner);
        } else if is(section, "FIELD") {
            skip_field(scanner)?;
        } else if is(section, "POINTS") && raw.vertices.is_empty() {
            raw.vertices = read_points(scanner)?;
        } else if grid && is(section, "CELLS") && grid_cells.is_none() {
            grid_cells = Some(Connectivity::read(scanner, version, raw.vertices.len())?);
        } else if grid && is(section, "CELL_TYPES") && grid_kinds.is_none() {
            grid_kinds = Some(read_kinds(scanner)?);
        } else if !grid && let Some(kind) = section_kind(section) {
            let cells = Connectivity::read(scanner, version, raw.vertices.len())?;
            for i in 0..cells.ends.len() {
                add_cell(&mut raw, scanner, kind, cells.corners(i))?;
            }
        } else {
            return Err(scanner.fail(format!("{} has no place here", quoted(section))));
        }
    }
    if grid {
        let cells = grid_cells.ok_or_else(|| scanner.fail("the file ends without CELLS"))?;
        let kinds = grid_kinds.ok_or_else(|| scanner.fail("the file ends without CELL_TYPES"))?;
        if cells.ends.len() != kinds.len() {
            let (cells, kinds) = (cells.ends.len(), kinds.len());
            return Err(scanner.fail(format!("{kinds} cell types for {cells} cells")));
        }
        for (i, &kind) in kinds.iter().enumerate() {
            add_cell(&mut raw, scanner, kind, cells.corners(i))?;
        }
    }
    Ok(raw)
}

// The cell types of VTK.
const EMPTY: u64 = 0;
const VERTEX: u64 = 1;
const POLY_VERTEX: u64 = 2;
const LINE: u64 = 3;
const POLY_LINE: u64 = 4;
const TRIANGLE: u64 = 5;
const TRIANGLE_STRIP: u64 = 6;
const POLYGON: u64 = 7;
const PIXEL: u64 = 8;
const QUAD: u64 = 9;
const TETRAHEDRON: u64 = 10;
const QUADRATIC_EDGE: u64 = 21;
const QUADRATIC_TRIANGLE: u64 = 22;
const QUADRATIC_QUAD: u64 = 23;
const QUADRATIC_TETRAHEDRON: u64 = 24;

/// The cell type of a section of polygonal data.
fn section_kind(section: &[u8]) -> Option<u64> {
    let kinds = [
        ("VERTICES", POLY_VERTEX),
        ("LINES", POLY_LINE),
        ("POLYGONS", POLYGON),
        ("TRIANGLE_STRIPS", TRIANGLE_STRIP),
    ];
    let matching = kinds.iter().find(|(name, _)| is(section, name));
    matching.map(|&(_, kind)| kind)
}

fn add_cell(raw: &mut RawMesh, scanner: &Scanner, kind: u64, corners: &[u32]) -> Result<()> {
    match (kind, corners) {
        (EMPTY | VERTEX | POLY_VERTEX | LINE | POLY_LINE | QUADRATIC_EDGE, _) => {
            raw.ignored_cells += 1;
            Ok(())
        }
        (TRIANGLE, &[a, b, c]) | (QUADRATIC_TRIANGLE, &[a, b, c, _, _, _]) => {
            memory::push(&mut raw.triangles, [a, b, c])
        }
        (QUAD, &[a, b, c, d]) | (QUADRATIC_QUAD, &[a, b, c, d, _, _, _, _]) => raw.add_polygon(&[a, b, c, d]),
        (PIXEL, &[a, b, c, d]) => raw.add_polygon(&[a, b, d, c]),
        (POLYGON, &[_, _, _, ..]) => raw.add_polygon(corners),
        (TRIANGLE_STRIP, &[_, _, _, ..]) => {
            for (i, corners) in corners.windows(3).enumerate() {
                let &[a, b, c] = corners else { continue };
                // Every second triangle of a strip is reversed.
                let triangle = if i % 2 == 0 { [a, b, c] } else { [b, a, c] };
                memory::push(&mut raw.triangles, triangle)?;
            }
            Ok(())
        }
        (TETRAHEDRON, &[a, b, c, d]) | (QUADRATIC_TETRAHEDRON, &[a, b, c, d, _, _, _, _, _, _]) => {
            memory::push(&mut raw.tetrahedra, [a, b, c, d])
        }
        _ => Err(scanner.fail(format!(
            "a cell of type {kind} with {} points: only points, lines, triangles, polygons and tetrahedra can be read",
            corners.len()
        ))),
    }
}

/// The points of all cells, cell by cell.
struct Connectivity {
    points: Vec<u32>,
    /// The end of each cell, where the next begins.
    ends: Vec<usize>,
}

impl Connectivity {
    /// The points of a cell.
    fn corners(&self, cell: usize) -> &[u32] {
        let start = match cell {
            0 => 0,
            _ => self.ends[cell - 1],
        };
        &self.points[start..self.ends[cell]]
    }

    fn read(scanner: &mut Scanner, version: f64, vertex_count: usize) -> Result<Connectivity> {
        let mut cells = Connectivity {
            points: Vec::new(),
            ends: Vec::new(),
        };
        if version < 5.0 {
            // Each cell consists of its number of points and the points.
            let count = scanner.count("cells", 4)?;
            let total = scanner.count("numbers of cells", 2)?;
            begin_data(scanner)?;
            cells.ends.try_reserve_exact(count)?;
            cells.points.try_reserve_exact(total.saturating_sub(count))?;
            for _ in 0..count {
                let length = integer(scanner, DataType::I32)?;
                let before = cells.points.len() + cells.ends.len() + 1;
                if (before as u64).saturating_add(length) > total as u64 {
                    return Err(scanner.fail(format!(
                        "a cell of {length} points: with it, the cells are more than {total} numbers"
                    )));
                }
                for _ in 0..length {
                    cells.add_point(scanner, DataType::I32, vertex_count)?;
                }
                cells.ends.push(cells.points.len());
            }
            if cells.points.len() + count != total {
                return Err(scanner.fail(format!("the cells are not {total} numbers")));
            }
            return Ok(cells);
        }
        // The start of each cell, the end of the last one, and then all points.
        let offset_count = scanner.count("offsets", 2)?;
        let total = scanner.count("points of cells", 2)?;
        scanner.expect("OFFSETS")?;
        let data_type = DataType::read(scanner)?;
        begin_data(scanner)?;
        cells.ends.try_reserve_exact(offset_count)?;
        let mut latest = 0;
        for i in 0..offset_count {
            let offset = integer(scanner, data_type)?;
            if offset < latest || offset > total as u64 || (i == 0 && offset != 0) {
                return Err(scanner.fail(format!("offset {offset} after {latest}, of {total} points of cells")));
            }
            latest = offset;
            if i > 0 {
                cells.ends.push(offset as usize);
            }
        }
        if latest != total as u64 {
            return Err(scanner.fail(format!("the offsets end at {latest}, not at {total}")));
        }
        scanner.expect("CONNECTIVITY")?;
        let data_type = DataType::read(scanner)?;
        begin_data(scanner)?;
        cells.points.try_reserve_exact(total)?;
        for _ in 0..total {
            cells.add_point(scanner, data_type, vertex_count)?;
        }
        Ok(cells)
    }

    /// Reads a point of the current cell.
    fn add_point(&mut self, scanner: &mut Scanner, data_type: DataType, vertex_count: usize) -> Result<()> {
        let point = integer(scanner, data_type)?;
        let point = scanner.vertex(point, 0, vertex_count)?;
        memory::push(&mut self.points, point)
    }
}

fn read_points(scanner: &mut Scanner) -> Result<Vec<DVec3>> {
    let count = scanner.count("points", 6)?;
    check_vertex_count(scanner, count)?;
    let data_type = DataType::read(scanner)?;
    begin_data(scanner)?;
    let mut coordinate = || number(scanner, data_type);
    memory::try_collected((0..count).map(|_| Ok(DVec3::new(coordinate()?, coordinate()?, coordinate()?))))
}

fn read_kinds(scanner: &mut Scanner) -> Result<Vec<u64>> {
    let count = scanner.count("cell types", 2)?;
    begin_data(scanner)?;
    memory::try_collected((0..count).map(|_| integer(scanner, DataType::I32)))
}

/// Skips the description of an array, which ends with an empty line.
fn skip_metadata(scanner: &mut Scanner) {
    scanner.line();
    while scanner.remaining() > 0 && !scanner.line().trim_ascii().is_empty() {}
}

/// Skips the arrays of a field.
fn skip_field(scanner: &mut Scanner) -> Result<()> {
    scanner.word("the name of a field")?;
    let mut arrays = scanner.count("arrays", 8)?;
    while arrays > 0 {
        let name = scanner.word("the name of an array")?;
        if is(name, "METADATA") {
            skip_metadata(scanner);
            continue;
        }
        let components = scanner.integer("number of components")?;
        let tuples = scanner.integer("number of tuples")?;
        let data_type = DataType::read(scanner)?;
        let count = components.saturating_mul(tuples);
        if count > scanner.remaining() as u64 {
            return Err(scanner.fail(format!("{count} values, but the file ends before")));
        }
        begin_data(scanner)?;
        for _ in 0..count {
            if scanner.binary {
                scanner.skip(data_type.size(), "an array")?;
            } else {
                scanner.word("a value")?;
            }
        }
        arrays -= 1;
    }
    Ok(())
}

/// Ends the line before binary data.
fn begin_data(scanner: &mut Scanner) -> Result<()> {
    if scanner.binary {
        scanner.end_line()?;
    }
    Ok(())
}

/// The type of a value; binary values are big-endian.
#[derive(Clone, Copy)]
enum DataType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl DataType {
    fn read(scanner: &mut Scanner) -> Result<DataType> {
        let word = scanner.word("a data type")?;
        let names = [
            ("char", DataType::I8),
            ("unsigned_char", DataType::U8),
            ("short", DataType::I16),
            ("unsigned_short", DataType::U16),
            ("int", DataType::I32),
            ("vtkIdType", DataType::I32), // in files always of 4 bytes
            ("vtktypeint32", DataType::I32),
            ("unsigned_int", DataType::U32),
            ("vtktypeuint32", DataType::U32),
            ("long", DataType::I64),
            ("vtktypeint64", DataType::I64),
            ("unsigned_long", DataType::U64),
            ("vtktypeuint64", DataType::U64),
            ("float", DataType::F32),
            ("double", DataType::F64),
        ];
        let matching = names.iter().find(|(name, _)| is(word, name));
        matching
            .map(|&(_, data_type)| data_type)
            .ok_or_else(|| scanner.fail(format!("{} is no data type", quoted(word))))
    }

    /// The size in bytes.
    fn size(self) -> usize {
        match self {
            DataType::I8 | DataType::U8 => 1,
            DataType::I16 | DataType::U16 => 2,
            DataType::I32 | DataType::U32 | DataType::F32 => 4,
            DataType::I64 | DataType::U64 | DataType::F64 => 8,
        }
    }
}

/// Reads a finite number.
fn number(scanner: &mut Scanner, data_type: DataType) -> Result<f64> {
    if !scanner.binary {
        return scanner.number("coordinate");
    }
    let what = "a number";
    let number = match data_type {
        DataType::F32 => f64::from(f32::from_be_bytes(scanner.take(what)?)),
        DataType::F64 => f64::from_be_bytes(scanner.take(what)?),
        DataType::I8 => f64::from(i8::from_be_bytes(scanner.take(what)?)),
        DataType::U8 => f64::from(u8::from_be_bytes(scanner.take(what)?)),
        DataType::I16 => f64::from(i16::from_be_bytes(scanner.take(what)?)),
        DataType::U16 => f64::from(u16::from_be_bytes(scanner.take(what)?)),
        DataType::I32 => f64::from(i32::from_be_bytes(scanner.take(what)?)),
        DataType::U32 => f64::from(u32::from_be_bytes(scanner.take(what)?)),
        DataType::I64 => i64::from_be_bytes(scanner.take(what)?) as f64,
        DataType::U64 => u64::from_be_bytes(scanner.take(what)?) as f64,
    };
    scanner.finite(number, "number")
}

/// Reads a nonnegative integer.
fn integer(scanner: &mut Scanner, data_type: DataType) -> Result<u64> {
    if !scanner.binary {
        return scanner.integer("whole number");
    }
    let number = number(scanner, data_type)?;
    // Indices are far below the limit of exact integers in f64.
    if number < 0.0 || number.fract() != 0.0 {
        return Err(scanner.fail(format!("{number} is no whole number")));
    }
    Ok(number as u64)
}
