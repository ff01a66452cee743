//! The binary interface is unchanged: the functions, structs and constants of the header, as a C compiler lays them
//! out, against the description in `tests/sinew.abi`. `symbols.rs` and `header.rs` check that the library exports what
//! the header declares.
//!
//! `SINEW_WRITE_ABI=1 cargo test --test project abi` writes the description again.
#![cfg(target_os = "linux")]

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::{installed, root, skip, succeed};

fn header() -> String {
    std::fs::read_to_string(root().join("include/sinew/sinew_all.h")).expect("sinew_all.h")
}

/// Builds a shared library of empty functions with the types of a header; each constant becomes an enumeration that a
/// function takes.
fn library(name: &str, header: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("abi");
    std::fs::create_dir_all(&folder).expect("the target directory can be written");
    let lines = header.lines().map(|line| line.split("//").next().unwrap_or_default());
    let code = lines.collect::<Vec<_>>().join("\n");
    let mut source = String::new();
    for block in code.split("\n\n") {
        let is_function = !block.trim_start().starts_with(['#', '}']) && !block.contains("typedef ");
        let body = if is_function { ") { for (;;) {} }" } else { ");" };
        writeln!(source, "{}\n", block.replace(");", body)).expect("a string");
    }
    for line in code.lines() {
        let mut words = line.split([' ', ',', '=']).filter(|word| !word.is_empty());
        let constant = match (words.next(), words.next(), words.next()) {
            (Some("#define"), Some(constant), Some(_)) => constant,
            (Some(constant), Some(_), None) if line.contains(" = ") => constant,
            _ => continue,
        };
        if !constant.starts_with("SINEW_VERSION") {
            // For two enumerations, abidiff checks only whether each value of one exists in the other.
            let (of, is) = (format!("enum {constant}_"), format!("{constant}_is"));
            writeln!(
                source,
                "{of} {{ {is} = {constant} }}; void {constant}_value({of} value) {{ (void)value; }}"
            )
            .expect("a string");
        }
    }
    let file = folder.join(name).with_extension("c");
    let library = file.with_extension("so");
    std::fs::write(&file, source).expect("a file can be written");
    succeed(
        Command::new("cc")
            .args(["-w", "-g", "-O0", "-fPIC", "-shared"])
            // The description does not depend on the project's folder.
            .arg(format!("-ffile-prefix-map={}=.", folder.display()))
            .arg(&file)
            .arg("-o")
            .arg(&library),
    );
    library
}

fn describe(library: &Path) -> Vec<u8> {
    succeed(
        Command::new("abidw")
            .args([
                "--no-show-locs",
                "--no-comp-dir-path",
                "--no-corpus-path",
                "--no-elf-needed",
            ])
            .args(["--no-architecture", "--no-parameter-names", "--type-id-style", "hash"])
            .arg(library),
    )
    .stdout
}

/// Returns the differences from the description.
fn differences(library: &Path) -> Option<String> {
    let output = Command::new("abidiff")
        .arg("--no-architecture")
        .arg(root().join("tests/sinew.abi"))
        .arg(library)
        .output()
        .expect("abidiff runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    // The exit code consists of bits: 4, a difference; 8, a certain break; 1 and 2, undecided.
    match output.status.code() {
        Some(0) => None,
        Some(code) if code & 3 == 0 => Some(said),
        _ => panic!("abidiff: {said}{}", String::from_utf8_lossy(&output.stderr)),
    }
}

fn are_tools_there() -> bool {
    let missing = ["cc", "abidw", "abidiff"].into_iter().find(|tool| !installed(tool));
    if let Some(tool) = missing {
        skip(&format!(
            "the binary interface against its description: {tool} is not installed"
        ));
    }
    missing.is_none()
}

#[test]
fn the_binary_interface_is_unchanged() {
    if !are_tools_there() {
        return;
    }
    let library = library("sinew", &header());
    if std::env::var_os("SINEW_WRITE_ABI").is_some() {
        std::fs::write(root().join("tests/sinew.abi"), describe(&library)).expect("the description can be written");
    }
    if let Some(said) = differences(&library) {
        panic!(
            "{said}\nWhat was added alone: SINEW_WRITE_ABI=1 cargo test --test project abi describes it. Anything else breaks programs that are linked \
             already: then the version in Cargo.toml, and with it the soname, has to change first."
        );
    }
}

#[test]
fn a_break_is_noticed() {
    if !are_tools_there() {
        return;
    }
    let header = header();
    for (name, was, is) in [
        ("wider", "  float friction;", "  double friction;"),
        ("turned", "  float gravity[3];", ""),
        ("renumbered", "SINEW_SOLVER_NEWTON = 2", "SINEW_SOLVER_NEWTON = 3"),
        ("argument", "float dt,", "double dt,"),
        (
            "removed",
            "uint32_t sinew_version(void);",
            "static uint32_t sinew_version(void);",
        ),
        (
            "signed",
            "typedef int32_t sinew_status;",
            "typedef uint32_t sinew_status;",
        ),
    ] {
        assert!(header.contains(was), "{name}: the header has no {was}");
        let library = library(name, &header.replacen(was, is, 1));
        assert!(differences(&library).is_some(), "{name}: {is} is not noticed");
    }
}
