//! `include/sinew.hpp`: each C++ compiler builds the programs of `tests/cxx` and the example, which run, also under
//! sanitizers. The header covers the whole C header.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::header::function_names;
use crate::support::{Library, installed, root, skip, succeed};

const COMPILERS: [&str; 2] = ["g++", "clang++"];

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap()
}

/// Returns every name that begins with `sinew_` and ends before one of these characters.
fn names(text: &str) -> BTreeSet<&str> {
    text.split(|letter: char| !(letter.is_ascii_alphanumeric() || letter == '_'))
        .filter(|word| word.starts_with("sinew_"))
        .collect()
}

fn build(compiler: &str, source: &Path, name: &str, options: &[&str]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cxx").join(compiler);
    std::fs::create_dir_all(&folder).unwrap();
    let program = folder.join(name);
    let library = Library::get();
    succeed(
        Command::new(compiler)
            .args([
                "-std=c++17",
                "-Wall",
                "-Wextra",
                "-Wpedantic",
                "-Wshadow",
                "-Werror",
                "-O1",
                "-g",
            ])
            .args(options)
            .arg("-I")
            .arg(root().join("include"))
            .args(["-x", "c++"])
            .arg(source)
            .args(["-x", "none", "-o"])
            .arg(&program)
            .arg(library.shared())
            .arg(format!("-Wl,-rpath,{}", library.folder.display())),
    );
    program
}

fn run(program: &Path) -> String {
    let output = succeed(Command::new(program).env_remove("LD_LIBRARY_PATH"));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn programs_build_and_run() {
    for compiler in COMPILERS {
        if !installed(compiler) {
            skip(&format!("{compiler}, which is not installed"));
            continue;
        }
        run(&build(compiler, &root().join("tests/cxx/owners.cpp"), "owners", &[]));
        let without = root().join("tests/cxx/without_exceptions.cpp");
        run(&build(compiler, &without, "without_exceptions", &["-fno-exceptions"]));
        // Both languages produce the same world.
        let c = build(
            compiler,
            &root().join("c_examples/quickstart.c"),
            "quickstart_c",
            &["-xc++"],
        );
        let cpp = build(compiler, &root().join("c_examples/quickstart.cpp"), "quickstart", &[]);
        assert_eq!(run(&cpp), run(&c));
    }
}

#[test]
fn nothing_is_leaked_or_destroyed_twice() {
    let options = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    let probe = Path::new(env!("CARGO_TARGET_TMPDIR")).join("probe.cpp");
    std::fs::write(&probe, "int main() {}\n").unwrap();
    let sanitizes = Command::new("g++")
        .args(options)
        .arg(&probe)
        .arg("-o")
        .arg(probe.with_extension("out"))
        .output()
        .is_ok_and(|output| output.status.success());
    if !sanitizes {
        return skip("sinew.hpp under sanitizers: no g++ that has them");
    }
    run(&build(
        "g++",
        &root().join("tests/cxx/owners.cpp"),
        "owners_sanitized",
        &options,
    ));
}

#[test]
fn it_covers_the_c_header() {
    let (c, cpp) = (read("include/sinew/sinew_all.h"), read("include/sinew.hpp"));
    let (functions, used): (BTreeSet<&str>, _) = (function_names(&c).collect(), names(&cpp));
    assert!(functions.len() > 100, "the functions are found");
    let missing: Vec<&str> = functions.difference(&used).copied().collect();
    assert!(missing.is_empty(), "sinew.hpp leaves to C: {missing:?}");

    // Types that are declared and not defined are opaque: their owner destroys them.
    let opaque: Vec<&str> = c
        .lines()
        .filter_map(|line| line.strip_prefix("typedef struct ")?.strip_suffix(';')?.split_once(' '))
        .filter(|(tag, name)| tag == name)
        .map(|(tag, _)| tag)
        .collect();
    assert!(opaque.len() >= 6, "the opaque types are found: {opaque:?}");
    for name in opaque {
        let class = name.strip_prefix("sinew_").unwrap();
        let head = format!("class {class} : public owner<{name}, {name}_destroy> {{");
        assert!(cpp.contains(&head), "{head}");
    }
    for init in functions.iter().filter(|name| name.ends_with("_def_init")) {
        let def = init.strip_suffix("_init").unwrap();
        let class = def.strip_prefix("sinew_").unwrap();
        let head = format!("using {class} = definition<{def}, {init}>;");
        assert!(cpp.contains(&head), "{head}");
    }
}
