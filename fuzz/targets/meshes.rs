//! Random mesh files: a loaded mesh must be valid, and any other file must be refused.
#![no_main]

mod planted;

use std::path::PathBuf;

use libfuzzer_sys::fuzz_target;
use sinew::mesh::{MeshFormat, NO_NODE, load};

/// A file path that is unique to this process.
fn path(extension: &str) -> PathBuf {
    std::env::temp_dir().join(format!("sinew_fuzz_{}.{extension}", std::process::id()))
}

fuzz_target!(|bytes: &[u8]| {
    let Some((&kind, text)) = bytes.split_first() else {
        return;
    };
    let format = [
        MeshFormat::Obj,
        MeshFormat::Stl,
        MeshFormat::Vtk,
        MeshFormat::Gmsh,
        MeshFormat::TetGen,
    ][usize::from(kind) % 5];
    let file = path("node");
    if format == MeshFormat::TetGen {
        // TetGen has two files, separated here by a zero byte.
        let cut = text.iter().position(|&byte| byte == 0).unwrap_or(text.len());
        std::fs::write(&file, &text[..cut]).expect("a folder for files");
        std::fs::write(path("ele"), text.get(cut + 1..).unwrap_or_default()).expect("a folder for files");
    } else {
        std::fs::write(&file, text).expect("a folder for files");
    }
    let Ok(loaded) = load(&file, format, 1.0) else {
        return;
    };
    let mesh = &loaded.mesh;
    mesh.check().expect("what was read can be used");
    assert!(!mesh.triangles.is_empty() || !mesh.tetrahedra.is_empty());
    let mut nodes = loaded.node_of_vertex.iter();
    assert!(nodes.all(|&node| node == NO_NODE || (node as usize) < mesh.positions.len()));
    planted::fault(mesh.positions.first().is_some_and(|first| first.x > 1.0));
});
