//! Mesh files: every format gives the same mesh, and no file content does harm.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

use std::path::{Path, PathBuf};

use sinew::Error;
use sinew::mesh::{LoadedMesh, MeshFormat, NO_NODE, is_closed, load};

/// A unit cube with corners numbered x + 2 y + 4 z, as five tetrahedra of positive volume and as six outward quads.
const TETRAHEDRA: [[u32; 4]; 5] = [[0, 6, 5, 3], [1, 0, 5, 3], [2, 0, 3, 6], [4, 0, 6, 5], [7, 3, 5, 6]];
const QUADS: [[u32; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

fn corner(i: u32) -> [f32; 3] {
    [(i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32]
}

fn lines<const N: usize>(rows: impl IntoIterator<Item = [String; N]>) -> String {
    rows.into_iter().map(|row| row.join(" ") + "\n").collect()
}

fn points() -> String {
    lines((0..8).map(|i| corner(i).map(|x| x.to_string())))
}

/// A file, and the number of its bytes that are required. A shorter file must be refused.
struct Fixture {
    name: &'static str,
    bytes: Vec<u8>,
    needed: usize,
    solid: bool,
}

fn text(name: &'static str, text: String, unneeded: usize, solid: bool) -> Fixture {
    let needed = text.len().saturating_sub(unneeded);
    Fixture {
        name,
        bytes: text.into_bytes(),
        needed,
        solid,
    }
}

/// Returns the cube in every single-file format. OBJ has neither counts nor an end marker, so truncation can go
/// undetected.
fn fixtures() -> Vec<Fixture> {
    let faces = lines(
        QUADS
            .map(|quad| quad.map(|i| format!("{}/9/7", i + 1)))
            .map(|[a, b, c, d]| ["f".into(), a, b, c, d]),
    );
    let vertices: String = points().lines().map(|line| format!("v {line}\n")).collect();
    let obj = format!("# a cube\nmtllib x.mtl\no cube\n{vertices}vn 0 0 1\ns off\n{faces}l 1 2\n");

    let triangles: Vec<[u32; 3]> = QUADS.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let mut ascii_stl = "solid cube of mine\n".to_string();
    let mut binary_stl = b"solid but binary".to_vec();
    binary_stl.resize(80, b' ');
    binary_stl.extend((triangles.len() as u32).to_le_bytes());
    for triangle in &triangles {
        ascii_stl += "facet normal nan 0 0\n outer loop\n";
        binary_stl.extend([0xff; 12]); // not numbers
        for &i in triangle {
            let [x, y, z] = corner(i);
            ascii_stl += &format!("  vertex {x} {y:e} {z:.3}\n");
            binary_stl.extend([x, y, z].iter().flat_map(|x| x.to_le_bytes()));
        }
        ascii_stl += " endloop\nendfacet\n";
        binary_stl.extend([0, 0]);
    }
    ascii_stl += "endsolid cube of mine\n";
    let name_length = " cube of mine\n".len();

    // A vertex, a line and the tetrahedra. The reader must ignore the point data.
    let kinds = [1, 3, 10, 10, 10, 10, 10];
    let mut cells: Vec<Vec<u32>> = vec![vec![0], vec![0, 1]];
    cells.extend(TETRAHEDRA.iter().map(|t| t.to_vec()));
    let numbers: usize = cells.iter().map(|cell| cell.len() + 1).sum();
    let grid = |version, encoding| {
        format!("# vtk DataFile Version {version}\na cube\n{encoding}\nDATASET UNSTRUCTURED_GRID\n")
    };
    let field = "FIELD FieldData 1\nTIME 1 2 double\n";
    let metadata = "METADATA\nINFORMATION 0\n\n";
    let tail = "POINT_DATA 8\nSCALARS s float\nLOOKUP_TABLE default\nnan\n";

    let rows: String = cells
        .iter()
        .map(|cell| {
            let row: Vec<String> = cell.iter().map(u32::to_string).collect();
            format!("{} {}\n", cell.len(), row.join(" "))
        })
        .collect();
    let types = kinds.map(|kind: i32| kind.to_string()).join("\n");
    let vtk4 = format!(
        "{}{field}0.5 1\nPOINTS 8 float\n{}\n{metadata}CELLS 7 {numbers}\n{rows}CELL_TYPES 7\n{types}\n{tail}",
        grid("3.0", "ASCII"),
        points().replace('\n', " ")
    );
    let offsets: Vec<u32> = cells
        .iter()
        .scan(0, |end, cell| {
            *end += cell.len() as u32;
            Some(*end)
        })
        .collect();
    let flat: Vec<String> = cells.iter().flatten().map(u32::to_string).collect();
    let offset_words: Vec<String> = offsets.iter().map(u32::to_string).collect();
    let vtk5 = format!(
        "{}POINTS 8 double\n{}CELLS 8 {}\nOFFSETS vtktypeint64\n0 {}\nCONNECTIVITY vtktypeint64\n{}\nCELL_TYPES 7\n{types}\n{tail}",
        grid("5.1", "ASCII"),
        points(),
        flat.len(),
        offset_words.join(" "),
        flat.join("\n"),
    );

    let mut binary_types = format!("\nCELL_TYPES {}\n", kinds.len()).into_bytes();
    binary_types.extend(kinds.iter().flat_map(|kind| kind.to_be_bytes()));
    let mut vtk4_binary = (grid("4.2", "BINARY") + field).into_bytes();
    vtk4_binary.extend([0.5f64, 1.0].iter().flat_map(|x| x.to_be_bytes()));
    vtk4_binary.extend(b"\nPOINTS 8 float\n");
    vtk4_binary.extend((0..8).flat_map(corner).flat_map(|x| x.to_be_bytes()));
    vtk4_binary.extend(format!("\n{metadata}CELLS 7 {numbers}\n").bytes());
    for cell in &cells {
        vtk4_binary.extend((cell.len() as u32).to_be_bytes());
        vtk4_binary.extend(cell.iter().flat_map(|i| i.to_be_bytes()));
    }
    vtk4_binary.extend(&binary_types);
    let mut vtk5_binary = (grid("5.1", "BINARY") + "POINTS 8 double\n").into_bytes();
    vtk5_binary.extend((0..8).flat_map(corner).flat_map(|x| f64::from(x).to_be_bytes()));
    vtk5_binary.extend(format!("\nCELLS 8 {}\nOFFSETS vtktypeint64\n", flat.len()).bytes());
    vtk5_binary.extend(0u64.to_be_bytes());
    vtk5_binary.extend(offsets.iter().flat_map(|&end| u64::from(end).to_be_bytes()));
    vtk5_binary.extend(b"\nCONNECTIVITY vtktypeint64\n");
    vtk5_binary.extend(cells.iter().flatten().flat_map(|&i| u64::from(i).to_be_bytes()));
    vtk5_binary.extend(&binary_types);
    let binary = |name, bytes: Vec<u8>, solid| Fixture {
        name,
        needed: bytes.len(),
        bytes,
        solid,
    };

    let quads =
        lines(QUADS.map(|[a, b, c, d]| ["4".into(), a.to_string(), b.to_string(), c.to_string(), d.to_string()]));
    let polydata = format!(
        "# vtk DataFile Version 2.0\n\nASCII\nDATASET POLYDATA\nPOINTS 8 float\n{}LINES 1 3\n2 0 1\nPOLYGONS 6 30\n{quads}",
        points()
    );

    // Tags are neither dense nor in order.
    let tag = |i: u32| 1000 - 7 * i;
    let tagged = lines((0..8).map(|i| {
        let [x, y, z] = corner(i);
        [tag(i).to_string(), x.to_string(), y.to_string(), z.to_string()]
    }));
    let tagged_cells = |prefix: &str| -> String {
        TETRAHEDRA
            .iter()
            .map(|t| t.map(|i| tag(i).to_string()).join(" "))
            .map(|row| format!("{prefix}{row}\n"))
            .collect()
    };
    let gmsh1 = format!(
        "$NOD\n8\n{tagged}$ENDNOD\n$ELM\n6\n1 15 1 1 1 {}\n{}$ENDELM\n",
        tag(0),
        tagged_cells("5 4 1 1 4 ")
    );
    let gmsh2 = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"$Nodes\"\n$EndPhysicalNames\n$Nodes\n8\n{tagged}$EndNodes\n$Elements\n6\n9 1 2 0 1 {} {}\n{}$EndElements\n",
        tag(0),
        tag(1),
        tagged_cells("5 4 3 0 -1 1 ")
    );
    let (upper, lower): (Vec<u32>, Vec<u32>) = (0..8).partition(|&i| i >= 4);
    let block = |header: &str, nodes: &[u32], parameters: &str| {
        let tags: String = nodes.iter().map(|&i| format!("{}\n", tag(i))).collect();
        let coordinates: String = nodes
            .iter()
            .map(|&i| corner(i).map(|x| x.to_string()).join(" ") + parameters + "\n")
            .collect();
        format!("{header} {}\n{tags}{coordinates}", nodes.len())
    };
    let gmsh4 = format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 0\n$EndEntities\n$Nodes\n2 8 951 1000\n{}{}$EndNodes\n$Elements\n2 6 1 9\n1 4 1 1\n9 {} {}\n3 1 4 5\n{}$EndElements\n",
        block("2 1 1", &lower, " 0.5 0.5"),
        block("3 1 0", &upper, ""),
        tag(0),
        tag(1),
        tagged_cells("3 ")
    );

    vec![
        text("cube.obj", obj, usize::MAX, false),
        text("ascii.stl", ascii_stl, name_length, false),
        binary("binary.STL", binary_stl, false),
        // "10" truncated to "1" is a vertex, which cannot be detected.
        text("four.vtk", vtk4, tail.len() + 2, true),
        text("five.vtk", vtk5, tail.len() + 2, true),
        binary("four_binary.vtk", vtk4_binary, true),
        binary("five_binary.vtk", vtk5_binary, true),
        text("polydata.vtk", polydata, 1, false),
        text("one.msh", gmsh1, 1, true),
        text("two.msh", gmsh2, 1, true),
        text("four_one.msh", gmsh4, 1, true),
    ]
}

/// Returns TetGen's two files, numbered from 0 or 1. Elements have attributes, which are not used.
fn tetgen(base: u32) -> (String, String) {
    let mut nodes = "# made by hand\n8 3 1 1\n".to_string();
    for i in 0..8 {
        let [x, y, z] = corner(i);
        nodes += &format!("{} {x} {y} {z} 0.25 -1 # {i}\n", i + base);
    }
    let mut elements = "5 4 1 # with a region\n".to_string();
    for (i, t) in TETRAHEDRA.iter().enumerate() {
        let row = t.map(|i| (i + base).to_string()).join(" ");
        elements += &format!("{} {row} 7\n", i as u32 + base);
    }
    (nodes, elements + "# end\n")
}

/// Returns a separate folder for each test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mesh_files").join(test);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn write(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    // A new file each time, because some file systems wait for the disk when a file is overwritten.
    let _ = std::fs::remove_file(&path);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn load_bytes(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> sinew::Result<LoadedMesh> {
    load(write(folder, name, bytes), MeshFormat::Auto, 1.0)
}

/// Checks what holds for every loaded mesh, whatever the file contained.
fn check_sound(loaded: &LoadedMesh) {
    let LoadedMesh {
        mesh,
        node_of_vertex,
        report,
    } = loaded;
    mesh.check().unwrap();
    let nodes = mesh.positions.len();
    assert_eq!(
        node_of_vertex.len(),
        nodes + report.welded_vertices + report.dropped_vertices
    );
    let dropped = node_of_vertex.iter().filter(|&&node| node == NO_NODE).count();
    assert_eq!(dropped, report.dropped_vertices);
    let mut referenced = vec![false; nodes];
    for &node in node_of_vertex.iter().filter(|&&node| node != NO_NODE) {
        referenced[node as usize] = true;
    }
    let mut used = vec![false; nodes];
    let elements = mesh.triangles.iter().map(|t| t.to_vec());
    for element in elements.chain(mesh.tetrahedra.iter().map(|t| t.to_vec())) {
        for (i, &node) in element.iter().enumerate() {
            used[node as usize] = true;
            assert!(!element[..i].contains(&node));
        }
    }
    assert!(referenced.iter().chain(&used).all(|&yes| yes));
}

fn check_cube(loaded: &LoadedMesh, solid: bool, side: f64) {
    check_sound(loaded);
    let mesh = &loaded.mesh;
    assert_eq!(mesh.positions.len(), 8);
    let surface = mesh.surface().unwrap();
    assert_eq!(surface.len(), 12);
    assert!(is_closed(&surface).unwrap());
    // Twelve edges of the cube and a diagonal on each of its six faces.
    assert_eq!(mesh.edges().unwrap().len(), 18);
    let volume = mesh.volume().unwrap();
    assert!((volume / side.powi(3) - 1.0).abs() < 1e-6, "{volume}");
    assert_eq!(mesh.tetrahedra.len(), if solid { 5 } else { 0 });
    assert_eq!(mesh.triangles.len(), if solid { 0 } else { 12 });
    // Every vertex of the file is at its node, if the file has one vertex per corner.
    if loaded.node_of_vertex.len() == 8 {
        for (i, &node) in loaded.node_of_vertex.iter().enumerate() {
            let expected = corner(i as u32).map(|x| (f64::from(x) * side) as f32);
            assert_eq!(mesh.positions[node as usize].to_array(), expected);
        }
    }
}

#[test]
fn every_format_gives_the_same_cube() {
    let folder = folder("same");
    for fixture in fixtures() {
        let path = write(&folder, fixture.name, &fixture.bytes);
        for scale in [1.0, 0.001] {
            let loaded =
                load(&path, MeshFormat::Auto, scale).unwrap_or_else(|error| panic!("{}: {error}", fixture.name));
            check_cube(&loaded, fixture.solid, f64::from(scale));
            if fixture.solid {
                assert_eq!(loaded.mesh.tetrahedra, TETRAHEDRA, "{}", fixture.name);
            }
        }
        let loaded = load(&path, MeshFormat::Auto, 1.0).unwrap();
        let ignored = match fixture.name {
            "ascii.stl" | "binary.STL" => 0,
            "four.vtk" | "five.vtk" | "four_binary.vtk" | "five_binary.vtk" => 2,
            _ => 1,
        };
        assert_eq!(loaded.report.ignored_cells, ignored, "{}", fixture.name);
    }
    for base in [0, 1] {
        let (nodes, elements) = tetgen(base);
        let node_path = write(&folder, "cube.node", nodes);
        let element_path = write(&folder, "cube.ele", elements);
        for path in [node_path, element_path] {
            let loaded = load(&path, MeshFormat::Auto, 2.0).unwrap();
            check_cube(&loaded, true, 2.0);
            assert_eq!(loaded.mesh.tetrahedra, TETRAHEDRA);
        }
    }
}

#[test]
fn stl_corners_are_welded_to_the_first() {
    let folder = folder("stl");
    let fixture = fixtures().remove(2);
    let loaded = load_bytes(&folder, fixture.name, &fixture.bytes).unwrap();
    assert_eq!(loaded.node_of_vertex.len(), 36);
    assert_eq!(loaded.report.welded_vertices, 28);
    // The corners of the first quads in the order of the file.
    assert_eq!(loaded.node_of_vertex[..6], [0, 1, 2, 0, 2, 3]);
}

#[test]
fn a_truncated_file_is_refused() {
    let folder = folder("cut");
    for fixture in fixtures() {
        let whole = load_bytes(&folder, fixture.name, &fixture.bytes).unwrap();
        for length in 0..fixture.bytes.len() {
            match load_bytes(&folder, fixture.name, &fixture.bytes[..length]) {
                Ok(loaded) => {
                    check_sound(&loaded);
                    let name = fixture.name;
                    assert!(length >= fixture.needed, "{name} cut at {length}");
                    let same = loaded == whole || name == "cube.obj" || length < fixture.needed + 2;
                    assert!(same, "{name} cut at {length}");
                }
                Err(Error::Io(message)) => assert!(message.contains(fixture.name)),
                Err(error) => panic!("{error:?}"),
            }
        }
    }
    let (nodes, elements) = tetgen(1);
    let path = write(&folder, "cube.ele", &elements);
    for length in 0..nodes.len() - "7 # 7\n".len() - 4 {
        write(&folder, "cube.node", &nodes[..length]);
        assert!(
            matches!(load(&path, MeshFormat::Auto, 1.0), Err(Error::Io(_))),
            "{length}"
        );
    }
    write(&folder, "cube.node", &nodes);
    for length in 0..elements.len() - "7\n# end\n".len() {
        let path = write(&folder, "cube.ele", &elements[..length]);
        assert!(
            matches!(load(&path, MeshFormat::Auto, 1.0), Err(Error::Io(_))),
            "{length}"
        );
    }
}

/// A generator of pseudo-random numbers (xorshift).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit.max(1) as u64) as usize
    }

    /// Returns the bytes with a few changed, removed or repeated.
    fn corrupt(&mut self, bytes: &[u8]) -> Vec<u8> {
        const LIKELY: &[u8] = b"0123456789-+.eE \n#/$naif\\\xff\x00\x7f";
        let mut bytes = bytes.to_vec();
        for _ in 0..=self.below(3) {
            let at = self.below(bytes.len());
            let end = (at + self.below(12)).min(bytes.len());
            match self.below(5) {
                0 if !bytes.is_empty() => bytes[at] = self.below(256) as u8,
                1 => drop(bytes.drain(at..end)),
                2 => {
                    let piece = bytes[at..end].to_vec();
                    bytes.splice(at..at, piece);
                }
                3 => bytes.insert(at, LIKELY[self.below(LIKELY.len())]),
                _ if !bytes.is_empty() => bytes[at] = LIKELY[self.below(LIKELY.len())],
                _ => {}
            }
        }
        bytes
    }
}

#[test]
fn corrupted_files_do_no_harm() {
    let folder = folder("spoilt");
    let mut random = Random(0x5eed_0001);
    let mut refused = 0;
    let mut rounds = |load: &mut dyn FnMut(&mut Random) -> sinew::Result<LoadedMesh>| {
        for _ in 0..3000 {
            match load(&mut random) {
                Ok(loaded) => check_sound(&loaded),
                Err(Error::Io(_) | Error::InvalidArgument(_)) => refused += 1,
                Err(error) => panic!("{error:?}"),
            }
        }
    };
    for fixture in fixtures() {
        rounds(&mut |random| load_bytes(&folder, fixture.name, random.corrupt(&fixture.bytes)));
    }
    let (nodes, elements) = tetgen(1);
    rounds(&mut |random| {
        write(&folder, "cube.node", random.corrupt(nodes.as_bytes()));
        load_bytes(&folder, "cube.ele", random.corrupt(elements.as_bytes()))
    });
    assert!(refused > 3000, "only {refused} of 36000 were refused");
}

/// Each file is refused with a message that names the file and the location of the fault.
#[test]
fn faults_are_reported_with_their_location() {
    let folder = folder("faults");
    let tetra_vtk = |points: &str, cells: &str, kind: &str| {
        format!(
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n{points}\n{cells}\nCELL_TYPES 1\n{kind}\n"
        )
    };
    let four = "POINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1";
    let msh = |middle: &str| format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{middle}");
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let cases: Vec<(&str, String, &str)> = vec![
        ("empty.obj", String::new(), "neither triangles"),
        ("empty.stl", String::new(), "byte 0"),
        ("empty.vtk", String::new(), "line 1"),
        ("empty.msh", String::new(), "line 1"),
        ("nan.obj", "v 0 0 0\nv 1 nan 0\n".into(), "line 2"),
        ("huge.obj", "v 0 0 0\nv 1e999 0 0\n".into(), "line 2"),
        ("short.obj", "v 0 0\n".into(), "line 1"),
        (
            "range.obj",
            format!("{triangle}\nf 1 2 4\nf 1 2 3\n"),
            "line 5: vertex 4",
        ),
        ("zero.obj", format!("{triangle}f 0 1 2\n"), "line 4"),
        ("back.obj", format!("{triangle}f -1 -2 -4\n"), "line 4"),
        ("big.obj", format!("{triangle}f 1 2 99999999999999999999\n"), "line 4"),
        ("two.obj", format!("{triangle}f 1 2\n"), "line 4"),
        ("points.obj", triangle.into(), "neither triangles"),
        ("line.obj", format!("{triangle}f 1 2 2\n"), "neither triangles"),
        ("other.obj", "solid x\nendsolid x\n".into(), "line 1: \"solid\""),
        (
            "nan.stl",
            "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 inf\n".into(),
            "line 4",
        ),
        (
            "word.stl",
            "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x\n".into(),
            "line 4",
        ),
        ("no_facets.stl", "solid\nendsolid\n".into(), "neither triangles"),
        ("lies.stl", format!("{:80}\u{1}\u{1}\u{1}\u{1}", ""), "facets"),
        ("magic.vtk", "# vtk XML\n".into(), "line 1"),
        (
            "kind.vtk",
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\n".into(),
            "line 4",
        ),
        ("nan.vtk", tetra_vtk("POINTS 1 float\n0 0 nan", "", ""), "line 6"),
        ("range.vtk", tetra_vtk(four, "CELLS 1 5\n4 0 1 2 4", "10"), "line 8"),
        ("negative.vtk", tetra_vtk(four, "CELLS 1 5\n4 0 1 2 -1", "10"), "line 8"),
        (
            "count.vtk",
            tetra_vtk("POINTS 4000000000 double\n0 0 0", "", ""),
            "line 5: 4000000000 points",
        ),
        (
            "cells.vtk",
            tetra_vtk(four, "CELLS 4000000000 5\n4 0 1 2 3", "10"),
            "line 7",
        ),
        ("size.vtk", tetra_vtk(four, "CELLS 2 0\n0 0 0 0 0 0 0", "10"), "line 8"),
        (
            "hexahedron.vtk",
            tetra_vtk(four, "CELLS 1 9\n8 0 1 2 3 0 1 2 3", "12"),
            "type 12",
        ),
        (
            "offsets.vtk",
            tetra_vtk(four, "CELLS 2 4\nOFFSETS vtktypeint64\n0 4", "10").replace("3.0", "5.1"),
            "CONNECTIVITY",
        ),
        (
            "no_cells.vtk",
            format!("# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n{four}\n"),
            "without CELLS",
        ),
        (
            "binary.msh",
            "$MeshFormat\n2.2 1 8\n\x01\0\0\0\n$EndMeshFormat\n".into(),
            "binary Gmsh",
        ),
        ("four.msh", "$MeshFormat\n4.0 0 8\n$EndMeshFormat\n".into(), "line 2"),
        ("twice.msh", msh("$Nodes\n2\n5 0 0 0\n5 0 0 0\n"), "line 7: node 5"),
        (
            "unknown.msh",
            msh("$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 2 0 1 1 2\n$EndElements\n"),
            "line 10: node 2",
        ),
        (
            "hexahedron.msh",
            msh("$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 5 0 1 1 1 1 1 1 1 1\n"),
            "line 10: element type 5",
        ),
        ("count.msh", msh("$Nodes\n18446744073709551615\n1 0 0 0\n"), "line 5"),
        ("nan.msh", msh("$Nodes\n1\n1 0 NaN 0\n"), "line 6"),
        ("section.msh", msh("$Whatever\n1 2 3\n"), "line 4"),
        ("early.msh", msh("$Elements\n0\n$EndElements\n"), "line 4"),
        ("count.node", "4000000000 3 0 0\n0 0 0 0\n".into(), "line 1"),
        ("plane.node", "1 2 0 0\n1 0 0\n".into(), "line 1"),
        ("gap.node", "2 3 0 0\n# two\n1 0 0 0\n3 0 0 0\n".into(), "line 4"),
        (
            "attributes.node",
            "1 3 18446744073709551615 0\n1 0 0 0\n".into(),
            "attribute",
        ),
        ("alone.node", "1 3 0 0\n1 0 0 0\n".into(), "alone.ele"),
        ("missing.ele", "1 4 0\n1 1 2 3 4\n".into(), "missing.node"),
    ];
    for (name, content, expected) in cases {
        match load_bytes(&folder, name, content) {
            Err(Error::Io(message)) => {
                let stem = name.split('.').next().unwrap();
                assert!(
                    message.contains(stem) && message.contains(expected),
                    "{name}: {message}"
                );
            }
            other => panic!("{name}: {other:?}"),
        }
    }
    write(&folder, "range.node", "4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n");
    for (elements, expected) in [
        ("1 4 0\n1 1 2 3 5\n", "line 2: point 5"),
        ("1 4 0\n1 1 2 3 0\n", "line 2"),
        ("1 3 0\n1 1 2 3\n", "line 1"),
        ("1 4 0\n1 1 2 3 4\n2 1 2 3 4\n", "line 3"),
    ] {
        let error = load_bytes(&folder, "range.ele", elements).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn invalid_mesh_files_are_refused() {
    let folder = folder("refused");
    let cube = write(&folder, "cube.obj", &fixtures().remove(0).bytes);
    for scale in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let error = load(&cube, MeshFormat::Auto, scale).unwrap_err();
        assert!(
            matches!(&error, Error::InvalidArgument(m) if m.contains("scale")),
            "{error}"
        );
    }
    let far = write(&folder, "far.obj", "v 1e30 0 0\nv 0 1e30 0\nv 0 0 1e30\nf 1 2 3\n");
    assert!(load(&far, MeshFormat::Auto, 1.0).is_ok());
    assert!(matches!(
        load(&far, MeshFormat::Auto, 1e10),
        Err(Error::InvalidArgument(_))
    ));
    let unknown = write(&folder, "cube.xyz", "v 0 0 0\n");
    assert!(matches!(
        load(&unknown, MeshFormat::Auto, 1.0),
        Err(Error::InvalidArgument(_))
    ));
    assert!(matches!(
        load("", MeshFormat::Auto, 1.0),
        Err(Error::InvalidArgument(_))
    ));
    // A folder, a missing file, and each format read as every other.
    std::fs::create_dir_all(folder.join("folder.stl")).unwrap();
    for path in ["folder.stl", "absent.vtk"] {
        assert!(matches!(
            load(folder.join(path), MeshFormat::Auto, 1.0),
            Err(Error::Io(_))
        ));
    }
    use MeshFormat::{Gmsh, Obj, Stl, TetGen, Vtk};
    for fixture in fixtures() {
        let path = write(&folder, fixture.name, &fixture.bytes);
        let right = match path.extension().unwrap().to_str().unwrap() {
            "obj" => Obj,
            "vtk" => Vtk,
            "msh" => Gmsh,
            _ => Stl,
        };
        for format in [Obj, Stl, Vtk, Gmsh, TetGen] {
            let loaded = load(&path, format, 1.0);
            if format == right {
                check_cube(&loaded.unwrap(), fixture.solid, 1.0);
            } else {
                assert!(matches!(loaded, Err(Error::Io(_))), "{} as {format:?}", fixture.name);
            }
        }
    }
}

#[test]
fn all_obj_variants_are_read() {
    let folder = folder("obj");
    // A pentagon written over two lines with negative indices, then a triangle of later vertices.
    let content = "v 0 0 0 1 0.5 0.5 0.5\r\nv 2 0 0\r\nv 3 1 0\r\nv 1 2 0\r\nv -1 1 0\r\nf -5 -4//1 -3/2 \\\r\n -2 5\r\nf 6 7 8 # later\r\nv 5 0 0\nv 6 0 0\nv 5 1 0";
    let loaded = load_bytes(&folder, "ways.obj", content).unwrap();
    assert_eq!(loaded.mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [5, 6, 7]]);
}

/// Compares the result with that of an independent reader.
#[test]
fn obj_agrees_with_tobj() {
    let folder = folder("tobj");
    let path = write(&folder, "cube.obj", &fixtures().remove(0).bytes);
    let mut paths = vec![path];
    paths.extend(shared("tissue_surface.obj"));
    for path in paths {
        let loaded = load(&path, MeshFormat::Obj, 1.0).unwrap().mesh;
        let options = tobj::LoadOptions {
            triangulate: true,
            ignore_lines: true,
            ..Default::default()
        };
        let text = std::fs::read_to_string(&path).unwrap();
        // Only positions are compared. Other attributes would need their own indices.
        let plain: String = text
            .lines()
            .filter(|line| line.starts_with("v ") || line.starts_with("f "))
            .map(|line| {
                line.split(' ')
                    .map(|word| word.split('/').next().unwrap())
                    .collect::<Vec<_>>()
                    .join(" ")
                    + "\n"
            })
            .collect();
        let (models, _) =
            tobj::load_obj_buf(&mut plain.as_bytes(), &options, |_| Err(tobj::LoadError::ReadError)).unwrap();
        let reference = &models[0].mesh;
        assert_eq!(reference.indices.len(), 3 * loaded.triangles.len());
        for (&a, &b) in loaded.triangles.iter().flatten().zip(&reference.indices) {
            let b = b as usize;
            assert_eq!(
                loaded.positions[a as usize].to_array(),
                reference.positions[3 * b..3 * b + 3]
            );
        }
    }
}

/// Returns a real file, or `None` if it is missing.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/meshes")
        .join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is missing", path.display());
    None
}

/// The counts and volumes come from another program, which joins corners by comparing all pairs.
#[test]
fn real_files() {
    struct Facts {
        name: &'static str,
        nodes: usize,
        triangles: usize,
        tetrahedra: usize,
        surface: usize,
        edges: usize,
        volume: f64,
    }
    let facts = |name, nodes, triangles, tetrahedra, surface, edges, volume| Facts {
        name,
        nodes,
        triangles,
        tetrahedra,
        surface,
        edges,
        volume,
    };
    for expected in [
        // Every triangle is contained twice, forward and backward: 186 on the surface, and two inner walls.
        facts("liver_volumetric.vtk", 98, 186 + 4, 273, 186, 464, 1_179_442.283_165),
        // The same, and an unused point.
        facts("gallbladder_volumetric.vtk", 366, 728, 1063, 728, 1792, 34_122.545_207),
        facts("tissue_volume.msh", 493, 892, 1432, 892, 2370, 1.152_024_829_7e-4),
        facts("tissue_surface.obj", 448, 892, 0, 892, 1338, 1.152_004_892_7e-4),
        // 479 facets, of which 153 collapse. The rest is a closed surface without holes: 2 = 165 - 489 + 326.
        facts("liver_collision.stl", 165, 326, 0, 326, 489, 1_752_086.272_3),
        // Two of the facets are back to back. Both stay, because the surface would be open otherwise.
        facts("forceps_jaw_left.stl", 541, 1082, 0, 1082, 1622, 110.284_772),
        facts("stomach.stl", 4864, 9724, 0, 9724, 14586, 289_353.484_87),
        facts("stomach.msh", 8599, 0, 34613, 11132, 48777, 289_353.402_27),
    ] {
        let Some(path) = shared(expected.name) else {
            continue;
        };
        let loaded = load(&path, MeshFormat::Auto, 0.001).unwrap();
        check_sound(&loaded);
        let mesh = &loaded.mesh;
        let name = expected.name;
        let surface = mesh.surface().unwrap();
        assert_eq!(mesh.positions.len(), expected.nodes, "{name}");
        assert_eq!(mesh.triangles.len(), expected.triangles, "{name}");
        assert_eq!(mesh.tetrahedra.len(), expected.tetrahedra, "{name}");
        assert_eq!(surface.len(), expected.surface, "{name}");
        assert_eq!(mesh.edges().unwrap().len(), expected.edges, "{name}");
        assert!(is_closed(&surface).unwrap(), "{name}");
        let volume = mesh.volume().unwrap() * 1e9;
        assert!((volume / expected.volume - 1.0).abs() < 1e-5, "{name}: {volume}");
        assert_eq!(
            loaded.report.flipped_tetrahedra + loaded.report.flat_tetrahedra,
            0,
            "{name}"
        );
    }
}
