//! `include/sinew.h` is what cbindgen makes of `src/capi`, and says the version of the crate.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The header as it lies there; written first where SINEW_WRITE_HEADER asks for it.
fn committed() -> &'static str {
    static HEADER: OnceLock<String> = OnceLock::new();
    HEADER.get_or_init(|| {
        let place = root().join("include/sinew.h");
        if std::env::var_os("SINEW_WRITE_HEADER").is_some() {
            fs::create_dir_all(root().join("include")).expect("include/ can be made");
            fs::write(&place, generated()).expect("include/sinew.h can be written");
        }
        fs::read_to_string(&place).unwrap_or_default()
    })
}

/// The header made anew, in memory. Only `src/capi` is read, so no constant of another room slips in.
fn generated() -> String {
    let config = cbindgen::Config::from_file(root().join("cbindgen.toml")).expect("cbindgen.toml");
    let bindings = cbindgen::Builder::new()
        .with_config(config)
        .with_src(root().join("src/capi/mod.rs"))
        .generate()
        .expect("cbindgen reads src/capi");
    let mut header = Vec::new();
    bindings.write(&mut header);
    String::from_utf8(header).expect("the header is UTF-8")
}

/// What follows each `#define`, but for the include guard.
fn defines(header: &str) -> impl Iterator<Item = (&str, &str)> {
    header
        .lines()
        .filter_map(|line| line.strip_prefix("#define "))
        .filter(|rest| *rest != "SINEW_H")
        .map(|rest| rest.split_once(' ').unwrap_or((rest, "")))
}

#[test]
fn the_committed_header_is_the_generated_one() {
    let header = generated();
    if committed() == header {
        return;
    }
    let fresh = Path::new(env!("CARGO_TARGET_TMPDIR")).join("sinew.h");
    fs::write(&fresh, &header).expect("the target directory can be written");
    panic!(
        "include/sinew.h is not what src/capi declares. The new one is {}; to take it over:\n\
         SINEW_WRITE_HEADER=1 cargo test --test header",
        fresh.display()
    );
}

#[test]
fn the_version_macros_are_the_crates_version() {
    let header = committed();
    let value_of = |name: &str| {
        let mut values = defines(header).filter(|(define, _)| *define == name);
        let (_, value) = values.next().unwrap_or_else(|| panic!("no {name}"));
        assert_eq!(values.next(), None, "{name} is defined twice");
        value.trim().to_owned()
    };
    for (name, expected) in [
        ("SINEW_VERSION_MAJOR", env!("CARGO_PKG_VERSION_MAJOR")),
        ("SINEW_VERSION_MINOR", env!("CARGO_PKG_VERSION_MINOR")),
        ("SINEW_VERSION_PATCH", env!("CARGO_PKG_VERSION_PATCH")),
    ] {
        assert_eq!(value_of(name), expected, "{name}");
    }
}

#[test]
fn every_macro_carries_the_prefix() {
    let header = committed();
    assert!(defines(header).count() > 20, "the constants are there");
    for (name, _) in defines(header) {
        assert!(name.starts_with("SINEW_"), "{name} is not ours to define");
    }
}

/// The comment and the first line of every function that the header declares.
fn functions(header: &str) -> Vec<(String, String)> {
    let mut comment = String::new();
    let mut functions = Vec::new();
    for line in header.lines() {
        match line {
            "/**" => comment.clear(),
            _ if line.starts_with(" *") => comment.push_str(line),
            _ if line.contains(" sinew_") || line.contains("*sinew_") => {
                if line.contains('(') {
                    functions.push((std::mem::take(&mut comment), line.to_owned()));
                }
            }
            _ => comment.clear(),
        }
    }
    functions
}

#[test]
fn every_function_says_what_it_does_and_how_it_fails() {
    let functions = functions(committed());
    assert!(functions.len() >= 31, "the functions of the contract are there");
    for (comment, declaration) in functions {
        assert!(!comment.is_empty(), "undocumented: {declaration}");
        assert_eq!(
            comment.contains("Errors: "),
            declaration.starts_with("sinew_status "),
            "{declaration}"
        );
    }
}

/// Those that have a `struct_size`, by a program that tries each with sizes that no header gave them.
#[test]
fn every_function_that_takes_a_struct_is_tried_with_a_wrong_struct_size() {
    let header = committed();
    let sized: Vec<&str> = header
        .split("typedef struct ")
        .filter(|declaration| {
            declaration
                .split("} ")
                .next()
                .unwrap_or_default()
                .contains(" struct_size;")
        })
        .filter_map(|declaration| declaration.split(" {").next())
        .collect();
    assert!(sized.len() > 20, "{sized:?}");
    let tried = fs::read_to_string(root().join("tests/c/struct_sizes.c")).expect("the program");
    // Definitions are filled by a macro.
    let kinds: Vec<String> = sized
        .iter()
        .filter_map(|name| name.strip_suffix("_def"))
        .map(str::to_owned)
        .collect();
    let mut count = 0;
    for declaration in header.split("\nsinew_status ").skip(1) {
        let declaration = declaration.split(';').next().unwrap_or_default();
        let name = declaration.split('(').next().unwrap_or_default();
        if sized
            .iter()
            .any(|sized| declaration.contains(&format!("struct {sized} *")))
        {
            let fills = kinds.iter().find(|kind| name == format!("{kind}_def_init"));
            let call = fills.map_or(format!("{name}("), |kind| {
                format!("DEFINITION({}, ", &kind["sinew_".len()..])
            });
            assert!(tried.contains(&call), "{name}");
            count += 1;
        }
    }
    assert!(count > 35, "{count}");
}

#[test]
fn the_documents_list_every_function_beside_its_counterpart_in_rust() {
    let page = fs::read_to_string(root().join("src/capi/functions.md")).expect("src/capi/functions.md");
    let rows = page.lines().filter_map(|line| line.strip_prefix("| [`sinew_"));
    let listed: Vec<String> = rows
        .map(|row| {
            let (name, rest) = row.split_once('`').expect("a name ends");
            let beside = rest.split(" | ").nth(1).expect("a second column");
            // rustdoc sees to it that what is linked is there.
            assert!(
                beside.contains("](crate::") || beside.contains("of the crate"),
                "sinew_{name}: {beside}"
            );
            format!("sinew_{name}")
        })
        .collect();
    let declared: Vec<String> = functions(committed())
        .into_iter()
        .filter(|(_, line)| !line.starts_with("typedef"))
        .filter_map(|(_, line)| Some(line.split_once('(')?.0.rsplit([' ', '*']).next()?.to_owned()))
        .collect();
    assert_eq!(listed, declared, "in the order of the header");
}
