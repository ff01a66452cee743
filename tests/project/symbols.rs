//! The exported symbols of the shared library: exactly the functions of the header, under its versioned name.
#![cfg(target_os = "linux")]

use std::collections::BTreeSet;
use std::process::Command;

use super::header::function_names;
use crate::support::{Library, installed, root, skip, succeed};

fn exported() -> BTreeSet<String> {
    let output = succeed(
        Command::new("nm")
            .args(["-D", "--defined-only", "--format=posix"])
            .arg(Library::get().shared()),
    );
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_exported_symbols_are_the_functions_of_the_header() {
    if !installed("nm") {
        return skip("the exported symbols: nm is not installed");
    }
    let header = std::fs::read_to_string(root().join("include/sinew/sinew_all.h")).expect("sinew_all.h");
    let declared: BTreeSet<String> = function_names(&header).map(str::to_owned).collect();
    let exported = exported();
    assert!(
        declared.contains("sinew_world_step"),
        "the header was read: {declared:?}"
    );
    let missing: Vec<_> = declared.difference(&exported).collect();
    let unknown: Vec<_> = exported.difference(&declared).collect();
    assert!(missing.is_empty(), "declared and not exported: {missing:?}");
    assert!(unknown.is_empty(), "exported and not declared: {unknown:?}");
    for name in &exported {
        assert!(name.starts_with("sinew_"), "{name} has not the prefix");
    }
}

#[test]
fn the_shared_library_is_named_by_its_version() {
    if !installed("readelf") {
        return skip("the soname: readelf is not installed");
    }
    let output = succeed(Command::new("readelf").arg("-d").arg(Library::get().shared()));
    let said = String::from_utf8_lossy(&output.stdout);
    let soname = said
        .lines()
        .find(|line| line.contains("SONAME"))
        .and_then(|line| line.split(['[', ']']).nth(1));
    let expected = concat!(
        "libsinew.so.",
        env!("CARGO_PKG_VERSION_MAJOR"),
        ".",
        env!("CARGO_PKG_VERSION_MINOR")
    );
    assert_eq!(soname, Some(expected));
}

#[test]
fn kernel_arithmetic_is_inlined() {
    if !installed("nm") {
        return skip("the functions of kernels: nm is not installed");
    }
    let output = succeed(Command::new("nm").arg(Library::get().shared()));
    let symbols = String::from_utf8_lossy(&output.stdout);
    // Calling them once per spring takes ten times as long. The library is built here with as little inlining between
    // crates as in a user's program.
    let has = |name: &str| symbols.lines().any(|line| line.contains(name));
    assert!(
        has("run_avx512") || cfg!(not(target_arch = "x86_64")),
        "kernels are seen"
    );
    for width in [256, 512] {
        for operation in ["add", "sub", "mul", "fmadd", "fmsub", "fnmadd"] {
            let name = format!("_mm{width}_{operation}_ps");
            assert!(
                !has(&name),
                "{name} is called: from a closure that is compiled on its own?"
            );
        }
    }
}
