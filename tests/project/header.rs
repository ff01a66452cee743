//! The headers of `include/` are what cbindgen makes of `src/capi`, arranged by subject, and say the version of the crate.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

mod bindings;
mod layout;

use crate::support::{failure, root, skip};
use layout::{Header, WIDTH};

/// Headers that most programs need, and the most lines that they may have together.
const CORE: [&str; 5] = [
    "sinew/base.h",
    "sinew/world.h",
    "sinew/mesh.h",
    "sinew/body.h",
    "sinew/tool.h",
];
const CORE_LINES: usize = 900;
const ALL_LINES: usize = 2300;
const IN_ONE: &str = "sinew/sinew_all.h";
/// Headers that are written by hand: what they have is inline, and nothing that the library exports.
const BY_HAND: [&str; 2] = ["compat_0_1.h", "helpers.h"];

/// The declarations of cbindgen. Only `src/capi` is read, so no constant of another module is declared.
fn declared() -> &'static str {
    static DECLARED: OnceLock<String> = OnceLock::new();
    DECLARED.get_or_init(|| {
        let config = cbindgen::Config::from_file(root().join("cbindgen.toml")).expect("cbindgen.toml");
        let bindings = cbindgen::Builder::new()
            .with_config(config)
            .with_src(root().join("src/capi/mod.rs"))
            .generate()
            .expect("cbindgen reads src/capi");
        let mut declared = Vec::new();
        bindings.write(&mut declared);
        String::from_utf8(declared).expect("declarations are UTF-8")
    })
}

/// The headers as generated now; written to `include/` if SINEW_WRITE_HEADER is set.
fn generated() -> &'static [Header] {
    static HEADERS: OnceLock<Vec<Header>> = OnceLock::new();
    HEADERS.get_or_init(|| {
        let headers = layout::arrange(declared());
        if std::env::var_os("SINEW_WRITE_HEADER").is_some() {
            let folder = fs::read_dir(root().join("include/sinew")).expect("include/sinew");
            for entry in folder.map(|entry| entry.expect("a file")) {
                if BY_HAND.iter().all(|name| *name != entry.file_name()) {
                    fs::remove_file(entry.path()).expect("an old header can be removed");
                }
            }
            for header in &headers {
                fs::write(root().join("include").join(&header.path), &header.text).expect("a header can be written");
            }
        }
        headers
    })
}

/// All declarations in one text.
fn committed() -> &'static str {
    static HEADER: OnceLock<String> = OnceLock::new();
    HEADER.get_or_init(|| {
        generated();
        fs::read_to_string(root().join("include").join(IN_ONE)).unwrap_or_default()
    })
}

/// What follows each `#define`, but for the include guards.
fn defines(header: &str) -> impl Iterator<Item = (&str, &str)> {
    header
        .lines()
        .filter_map(|line| line.strip_prefix("#define "))
        .filter_map(|rest| rest.split_once(' '))
        .map(|(name, value)| (name, value.split("//").next().unwrap_or_default().trim()))
}

#[test]
fn the_committed_headers_are_the_generated_ones() {
    let fresh = Path::new(env!("CARGO_TARGET_TMPDIR")).join("include");
    for header in generated() {
        let committed = fs::read_to_string(root().join("include").join(&header.path)).unwrap_or_default();
        if committed != header.text {
            let path = fresh.join(&header.path);
            fs::create_dir_all(path.parent().expect("a folder")).expect("the target directory can be written");
            fs::write(&path, &header.text).expect("the target directory can be written");
            panic!(
                "include/{} is not what src/capi declares. The new one is {}; to take it over:\n\
                 SINEW_WRITE_HEADER=1 cargo test --test project header",
                header.path,
                path.display()
            );
        }
    }
    let there = fs::read_dir(root().join("include/sinew")).expect("include/sinew");
    let there: BTreeSet<String> = there
        .map(|entry| entry.expect("a file").file_name().to_string_lossy().into_owned())
        .collect();
    let made = generated()
        .iter()
        .filter_map(|header| header.path.strip_prefix("sinew/"));
    assert_eq!(there, made.chain(BY_HAND).map(str::to_owned).collect());
}

#[test]
fn the_headers_are_short() {
    let lines_of = |path: &str| {
        let mut headers = generated().iter().filter(|header| header.path == path);
        headers
            .next()
            .unwrap_or_else(|| panic!("no {path}"))
            .text
            .lines()
            .count()
    };
    let core: usize = CORE.into_iter().map(lines_of).sum();
    let all = generated().iter().filter(|header| header.path != IN_ONE);
    let helpers = fs::read_to_string(root().join("include/sinew/helpers.h")).expect("helpers.h");
    let all: usize = all.map(|header| header.text.lines().count()).sum::<usize>() + helpers.lines().count();
    assert!(core <= CORE_LINES, "the core has {core} lines");
    assert!(all <= ALL_LINES, "the headers have {all} lines");
    for header in generated() {
        for line in header.text.lines() {
            // A macro stays in one line, for tools that drop lines of the preprocessor.
            let is_macro = line.starts_with("#define ") && !line.contains("//");
            assert!(is_macro || line.chars().count() <= WIDTH, "{}: {line}", header.path);
            assert!(!line.contains("Safety"), "{}: {line}", header.path);
        }
    }
}

#[test]
fn the_version_macros_are_the_crates_version() {
    let header = committed();
    let value_of = |name: &str| {
        let mut values = defines(header).filter(|(define, _)| *define == name);
        let (_, value) = values.next().unwrap_or_else(|| panic!("no {name}"));
        assert_eq!(values.next(), None, "{name} is defined twice");
        value.to_owned()
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
fn every_constant_carries_the_prefix() {
    for header in generated() {
        for line in header.text.lines().filter(|line| line.starts_with("#define ")) {
            assert!(line.starts_with("#define SINEW_"), "{line} is not ours to define");
        }
    }
    let codes = committed()
        .lines()
        .map(|line| line.split("///<").next().unwrap_or_default());
    let enumerators = codes.filter(|line| line.contains(" = "));
    let enumerators: Vec<&str> = enumerators.filter(|line| !line.trim_start().starts_with('/')).collect();
    assert!(enumerators.len() > 40, "the constants are there");
    for line in enumerators {
        assert!(line.starts_with("  SINEW_"), "{line} is not ours to define");
    }
}

#[test]
fn constants_are_in_enums_but_for_versions_flags_and_values_for_none() {
    let mut count = 0;
    for (name, value) in defines(committed()) {
        count += 1;
        let may_stand_alone = match name {
            // For the preprocessor.
            "SINEW_VERSION" | "SINEW_VERSION_MAJOR" | "SINEW_VERSION_MINOR" | "SINEW_VERSION_PATCH" => true,
            // Flags are joined by |, which makes an int of enumerators.
            "SINEW_AXIS_X" | "SINEW_AXIS_Y" | "SINEW_AXIS_Z" => true,
            // Values for none are no int, which enumerators are before C23.
            "SINEW_NO_NODE" | "SINEW_NO_TRIANGLE" => value == "UINT32_MAX",
            _ => false,
        };
        assert!(may_stand_alone, "{name} is {value}: it belongs in an enum");
    }
    assert!(count >= 9, "{count} constants are found");
}

/// The name of the function that each declaration begins with in its line.
pub fn function_names(header: &str) -> impl Iterator<Item = &str> {
    header
        .lines()
        .filter(|line| !line.starts_with([' ', '/', '#']) && !line.starts_with("typedef"))
        .filter_map(|line| line.split_once('(')?.0.rsplit([' ', '*']).next())
}

/// The lines of the comment, and the declaration, of every function in a header.
fn functions(header: &str) -> Vec<(Vec<&str>, &str)> {
    let mut functions = Vec::new();
    for block in header.split("\n\n") {
        let count = block.lines().take_while(|line| line.starts_with("///")).count();
        let comment: Vec<&str> = block.lines().take(count).collect();
        let start = comment.iter().map(|line| line.len() + 1).sum::<usize>();
        let declaration = block.get(start..).unwrap_or_default();
        if declaration.trim_end().ends_with(");") && !declaration.starts_with("typedef") {
            functions.push((comment, declaration));
        }
    }
    functions
}

#[test]
fn every_function_says_first_what_it_does() {
    let functions = functions(committed());
    let mut bad = Vec::new();
    assert!(functions.len() >= 31, "the functions of the contract are there");
    for (comment, declaration) in functions {
        // An editor shows the first line alone.
        let first = comment.first().unwrap_or(&"").trim_start_matches("/// ");
        let words = comment
            .iter()
            .map(|line| line.split_whitespace().count() - 1)
            .sum::<usize>();
        if !first.ends_with('.') || first.split_whitespace().count() < 4 || words > 75 {
            bad.push(format!("{words} words: {first}"));
        }
        let can_fail = declaration.starts_with("sinew_status ");
        let errors = comment.iter().any(|line| line.contains("Errors: "));
        assert!(can_fail || !errors, "{declaration}");
    }
    assert!(bad.is_empty(), "no short sentence of its own, or too long: {bad:#?}");
    // Which errors every function may return stands in one place.
    for status in ["INVALID_ARGUMENT", "STALE_ID", "OUT_OF_MEMORY", "INTERNAL"] {
        let line = format!("//   SINEW_STATUS_{status} ");
        assert_eq!(committed().matches(&line).count(), 1, "{line}");
    }
}

#[test]
fn each_name_of_0_1_is_tried_and_in_the_guide() {
    let read = |path: &str| fs::read_to_string(root().join(path)).expect(path);
    let (header, tried) = (read("include/sinew/compat_0_1.h"), read("tests/c/compat_0_1.c"));
    let guide = read("docs/guide/migration.md");
    let macros = header.lines().filter_map(|line| line.strip_prefix("#define sinew_"));
    let functions = header
        .lines()
        .filter_map(|line| line.strip_prefix("static inline sinew_status sinew_"));
    let names = macros
        .chain(functions)
        .filter_map(|rest| rest.split([' ', '(']).next())
        .filter(|name| !name.starts_with("compat_"));
    let mut count = 0;
    for name in names {
        count += 1;
        assert!(tried.contains(&format!("sinew_{name}")), "sinew_{name} is not tried");
        assert!(
            guide.contains(&format!("`sinew_{name}`")),
            "sinew_{name} is not in the guide"
        );
    }
    assert!(count > 15, "{count} names are found");
}

#[test]
fn every_field_and_constant_has_a_comment() {
    let header = committed();
    let mut above = Vec::new();
    let mut count = 0;
    for line in header.lines() {
        if let Some(text) = line.strip_prefix("  /// ") {
            above.push(text);
            continue;
        }
        let behind = line.split_once("///< ").map(|(_, text)| text);
        let text = above.join(" ") + behind.unwrap_or_default();
        above.clear();
        let ends = line.split("///<").next().unwrap_or_default().trim_end();
        // Arguments of a function are further in.
        if ends.starts_with("  ") && !ends.starts_with("   ") && ends.ends_with([';', ',']) {
            count += 1;
            assert!(text.split_whitespace().count() >= 2, "{line}");
        }
    }
    assert!(count > 300, "{count} members are found");
}

/// Those that have a `struct_size`, by a program that tries each with sizes that no header gave them.
#[test]
fn every_function_that_takes_a_struct_is_tried_with_a_wrong_struct_size() {
    let header = committed();
    let sized: Vec<&str> = header
        .split("typedef struct ")
        .filter(|declaration| {
            declaration
                .split("\n} ")
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
        if sized.iter().any(|sized| declaration.contains(&format!("{sized} *"))) {
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
fn every_function_is_in_an_example_or_in_the_guides_list() {
    let mut texts = fs::read_to_string(root().join("docs/guide/examples.md")).expect("the list of examples");
    let mut folders = vec![root().join("c_examples")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder of examples") {
            let path = entry.expect("a file").path();
            if path.is_dir() {
                folders.push(path);
            } else if let Ok(text) = fs::read_to_string(path) {
                texts += &text;
            }
        }
    }
    let words: BTreeSet<&str> = texts
        .split(|letter: char| !(letter.is_ascii_alphanumeric() || letter == '_'))
        .collect();
    let missing: Vec<&str> = function_names(declared())
        .filter(|name| !words.contains(name))
        .collect();
    assert!(missing.is_empty(), "in no example: {missing:?}");
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
    let in_modules: Vec<&str> = function_names(declared()).collect();
    assert_eq!(listed, in_modules, "in the order of the modules");
}

#[test]
fn the_bindings_are_those_of_the_header() {
    let bindings = [
        ("bindings/python/sinew_cffi.h", bindings::cffi(committed())),
        ("bindings/csharp/Sinew.cs", bindings::csharp(committed())),
    ];
    for (path, text) in &bindings {
        let path = root().join(path);
        if std::env::var_os("SINEW_WRITE_HEADER").is_some() {
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder can be made");
            fs::write(&path, text).expect("a binding can be written");
        }
        let there = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            there == *text,
            "{}: SINEW_WRITE_HEADER=1 cargo test --test project header",
            path.display()
        );
    }
    for name in function_names(committed()) {
        for (path, text) in &bindings {
            assert!(text.contains(&format!("{name}(")), "{name} is not in {path}");
        }
    }
}

#[test]
fn python_reads_its_declarations() {
    let program = "import cffi, sys; f = cffi.FFI(); f.cdef(open(sys.argv[1]).read()); \
        print(f.sizeof('sinew_body_def'), f.sizeof('sinew_ray_hit'))";
    if !Command::new("python3")
        .args(["-c", "import cffi"])
        .output()
        .is_ok_and(|output| output.status.success())
    {
        return skip("the declarations for Python: cffi is not installed");
    }
    let path = root().join("bindings/python/sinew_cffi.h");
    assert_eq!(failure(Command::new("python3").args(["-c", program]).arg(path)), None);
}

#[test]
fn csharp_compiles_its_binding() {
    if Command::new("mcs").arg("--version").output().is_err() {
        return skip("the binding for C#: mcs is not installed");
    }
    let path = root().join("bindings/csharp/Sinew.cs");
    let mut compiler = Command::new("mcs");
    compiler
        .args(["-unsafe", "-target:library", "-out:Sinew.dll"])
        .arg(path);
    assert_eq!(failure(compiler.current_dir(env!("CARGO_TARGET_TMPDIR"))), None);
}
