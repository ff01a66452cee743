//! Modules of `src` import only modules that stand below them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Span, TokenStream, TokenTree};

/// A module, and the modules that it may import; lower ones first, so that no loop can be written.
type Row<'a> = (&'a str, &'a [&'a str]);

#[rustfmt::skip]
const MAY_IMPORT: &[Row] = &[
    ("base", &[]),
    ("simd", &["base"]),
    ("codec", &["base", "simd"]),
    ("slots", &["base", "codec"]),
    ("sync", &[]),
    ("threads", &["base"]),
    ("soa", &["base", "simd", "codec", "threads"]),
    ("nodes", &["base", "codec", "threads", "soa"]),
    ("geometry", &["base", "simd", "codec"]),
    ("order", &["base"]),
    ("mesh", &["base", "geometry"]),
    ("def", &["base", "codec", "soa", "mesh"]),
    ("strain", &["base", "def"]),
    ("raster", &["base"]),
    ("springs", &["base", "simd", "codec", "soa", "order", "def"]),
    ("elements", &["base", "simd", "codec", "threads", "soa", "def", "springs"]),
    ("terms", &["base", "simd", "codec", "threads", "soa", "def", "springs"]),
    ("cavities", &["base", "codec", "threads", "soa", "def", "springs"]),
    ("forces", &["base", "simd", "codec", "threads", "soa", "def", "springs", "elements", "terms", "cavities"]),
    ("material", &["base", "mesh", "def", "elements"]),
    ("cutting", &["base", "codec", "strain"]),
    ("contact", &["base", "simd", "codec", "soa", "nodes", "geometry", "mesh", "def", "raster"]),
    ("readers", &["base", "codec", "sync", "threads", "soa"]),
    ("solver", &["base", "simd", "codec", "threads", "soa", "nodes", "geometry", "def", "springs", "elements", "forces",
        "contact"]),
    ("deformable_contact", &["base", "codec", "threads", "soa", "nodes", "geometry", "mesh", "def", "contact", "solver"]),
    ("body", &["base", "simd", "codec", "slots", "threads", "soa", "nodes", "geometry", "order", "mesh", "def", "springs",
        "elements", "terms", "forces", "material", "cutting", "contact", "readers", "solver", "deformable_contact"]),
    ("haptics", &["base", "sync", "geometry", "def", "contact"]),
    ("world", &["base", "simd", "codec", "slots", "sync", "threads", "soa", "geometry", "mesh", "def", "cutting", "contact",
        "readers", "solver", "deformable_contact", "body", "haptics"]),
    ("embedding", &["base", "geometry", "mesh", "def", "cutting", "body", "world"]),
    ("query", &["base", "geometry", "def", "contact", "body", "world"]),
    ("detection", &["contact"]),
    ("picture", &["base", "mesh", "def", "raster", "contact", "body", "world"]),
    ("debug_draw", &["base", "soa", "body", "world"]),
    ("capi", &["base", "simd", "threads", "mesh", "def", "strain", "raster", "material", "cutting", "contact",
        "readers", "solver", "body", "world", "haptics", "embedding", "query", "detection", "picture", "debug_draw"]),
];

/// A word, `::` or another sign of Rust text, and its line.
#[derive(Clone, Copy)]
struct Token<'a> {
    text: &'a str,
    line: usize,
}

/// The tokens of Rust text, without comments, strings and characters.
fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    add_tokens(text.parse().expect("Rust text"), text, &mut tokens);
    tokens
}

fn add_tokens<'a>(stream: TokenStream, text: &'a str, tokens: &mut Vec<Token<'a>>) {
    let token = |span: Span| Token {
        text: &text[span.byte_range()],
        line: span.start().line,
    };
    let mut trees = stream.into_iter().peekable();
    while let Some(tree) = trees.next() {
        match tree {
            TokenTree::Group(group) => {
                tokens.push(token(group.span_open()));
                add_tokens(group.stream(), text, tokens);
                tokens.push(token(group.span_close()));
            }
            TokenTree::Punct(_) if text[tree.span().byte_range().start..].starts_with("::") => {
                trees.next();
                tokens.push(Token {
                    text: "::",
                    ..token(tree.span())
                });
            }
            TokenTree::Ident(_) | TokenTree::Punct(_) => tokens.push(token(tree.span())),
            TokenTree::Literal(_) => {}
        }
    }
}

/// Removes the items marked `#[cfg(test)]`; returns the names of the modules among them that are files.
fn remove_tests<'a>(tokens: &mut Vec<Token<'a>>) -> Vec<&'a str> {
    const MARK: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut files = Vec::new();
    while let Some(start) = tokens
        .windows(MARK.len())
        .position(|window| window.iter().map(|token| token.text).eq(MARK))
    {
        let item = start + MARK.len();
        let mut depth = 0;
        let length = tokens[item..].iter().position(|token| {
            match token.text {
                "{" => depth += 1,
                "}" => depth -= 1,
                _ => {}
            }
            depth == 0 && matches!(token.text, "}" | ";")
        });
        let end = item + length.expect("items end") + 1;
        if let [.., module, name, end] = &tokens[item..end]
            && (module.text, end.text) == ("mod", ";")
        {
            files.push(name.text);
        }
        tokens.drain(start..end);
    }
    files
}

/// Adds the paths that a use tree or a path stands for, from `at` on, each behind `before`; returns where it ends.
fn add_paths<'a>(
    tokens: &[Token<'a>],
    mut at: usize,
    before: &[&'a str],
    found: &mut Vec<(usize, Vec<&'a str>)>,
) -> usize {
    if tokens[at].text == "{" {
        at += 1;
        while tokens[at].text != "}" {
            at = match tokens[at].text {
                "," => at + 1,
                _ => add_paths(tokens, at, before, found),
            };
        }
        return at + 1;
    }
    let mut path = before.to_vec();
    match tokens[at].text {
        "super" => {
            path.pop();
        }
        "self" => {}
        name => path.push(name),
    }
    let goes_on = |token: &Token| token.text == "{" || token.text == "*" || token.text.starts_with(char::is_alphabetic);
    match tokens.get(at + 1..at + 3) {
        Some([colons, next]) if colons.text == "::" && goes_on(next) => add_paths(tokens, at + 2, &path, found),
        _ => {
            found.push((tokens[at].line, path));
            at + if tokens.get(at + 1).is_some_and(|token| token.text == "as") {
                3
            } else {
                1
            }
        }
    }
}

/// The paths from the root of the crate that a module's text names by `crate::` or `super::`, with their lines.
fn crate_paths<'a>(tokens: &[Token<'a>], module: &[&'a str]) -> Vec<(usize, Vec<&'a str>)> {
    let mut found = Vec::new();
    let mut open: Vec<Option<&str>> = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let text = |at: usize| tokens.get(at).map_or("", |token| token.text);
        let is_first = at == 0 || text(at - 1) != "::";
        match (text(at), text(at + 1), text(at + 2)) {
            ("mod", name, "{") => {
                open.push(Some(name));
                at += 3;
            }
            ("crate", "::", _) if is_first => at = add_paths(tokens, at + 2, &[], &mut found),
            ("super", "::", _) if is_first => {
                let inner: Vec<_> = module.iter().copied().chain(open.iter().copied().flatten()).collect();
                at = add_paths(tokens, at, &inner, &mut found);
            }
            (sign, _, _) => {
                match sign {
                    "{" => open.push(None),
                    "}" => {
                        open.pop();
                    }
                    _ => {}
                }
                at += 1;
            }
        }
    }
    found
}

/// The module that a file of `src` holds, from the root of the crate.
fn module_of(file: &str) -> Vec<&str> {
    let path = file.strip_suffix(".rs").expect("a file of Rust");
    let path = path.strip_suffix("/mod").unwrap_or(path);
    path.split('/').collect()
}

/// The names that the root of the crate re-exports, each with the module that it is from.
fn root_names<'a>(tokens: &[Token<'a>]) -> BTreeMap<&'a str, &'a str> {
    let mut paths = Vec::new();
    for at in 0..tokens.len() {
        if tokens[at].text == "use" {
            add_paths(tokens, at + 1, &[], &mut paths);
        }
    }
    paths.iter().map(|(_, path)| (path[path.len() - 1], path[0])).collect()
}

/// What is wrong with a table: a module that stands in it twice, or may import one that does not stand before it.
fn faults_of_table(table: &[Row]) -> Vec<String> {
    let mut faults = Vec::new();
    let mut below = BTreeSet::new();
    for (module, imports) in table {
        for import in imports.iter().filter(|import| !below.contains(*import)) {
            faults.push(format!(
                "the table: {module} may not import {import}, which does not stand above it in the list"
            ));
        }
        if !below.insert(module) {
            faults.push(format!("the table: {module} has two rows"));
        }
    }
    faults
}

/// What is wrong with files, given as their paths in `src` and their texts.
fn faults(sources: &[(String, String)], table: &[Row]) -> Vec<String> {
    let mut faults = faults_of_table(table);
    let mut tests = BTreeSet::new();
    let mut root = BTreeMap::new();
    let mut files = Vec::new();
    for (file, text) in sources {
        let mut tokens = tokens(text);
        for name in remove_tests(&mut tokens) {
            let parent = if file == "lib.rs" { Vec::new() } else { module_of(file) };
            tests.insert([parent, vec![name]].concat());
        }
        match file.as_str() {
            "lib.rs" => root = root_names(&tokens),
            _ => files.push((file.as_str(), module_of(file), tokens)),
        }
    }
    files.retain(|(_, module, _)| !(1..=module.len()).any(|length| tests.contains(&module[..length])));

    let mut imported = BTreeSet::new();
    for (file, module, tokens) in &files {
        let Some((_, allowed)) = table.iter().find(|(name, _)| *name == module[0]) else {
            faults.push(format!("{file}: the table has no row of {}", module[0]));
            continue;
        };
        for (line, path) in crate_paths(tokens, module) {
            let Some(&first) = path.first() else {
                continue;
            };
            let import = root.get(first).copied().unwrap_or(first);
            if import == module[0] {
            } else if allowed.contains(&import) {
                imported.insert((module[0], import));
            } else {
                faults.push(format!("{file}:{line}: {} may not import {import}", module[0]));
            }
        }
    }

    for &(module, imports) in table {
        if !files.iter().any(|(_, path, _)| path[0] == module) {
            faults.push(format!("the table: there is no module {module}"));
        }
        for import in imports.iter().filter(|import| !imported.contains(&(module, **import))) {
            faults.push(format!(
                "the table: {module} does not import {import}: remove the entry"
            ));
        }
    }
    faults
}

/// Adds the files of Rust in a directory, as their paths in `src` and their texts.
fn read_sources(directory: &Path, src: &Path, sources: &mut Vec<(String, String)>) {
    for entry in fs::read_dir(directory).expect("src can be read") {
        let path = entry.expect("src can be read").path();
        if path.is_dir() {
            read_sources(&path, src, sources);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let name: Vec<_> = path
                .strip_prefix(src)
                .expect("a path in src")
                .iter()
                .map(|part| part.to_string_lossy())
                .collect();
            sources.push((name.join("/"), fs::read_to_string(&path).expect("a file of Rust")));
        }
    }
}

/// All files of `src`.
fn all_sources() -> Vec<(String, String)> {
    let src = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut sources = Vec::new();
    read_sources(&src, &src, &mut sources);
    sources.sort();
    assert!(sources.len() > 100, "src was read");
    sources
}

#[test]
fn few_files_beside_forces_name_elements_terms_or_cavities() {
    const NAMED: [&str; 3] = ["elements", "terms", "cavities"];
    let sources = all_sources();
    let names = |(file, text): &&(String, String)| {
        let module = module_of(file);
        let paths = crate_paths(&tokens(text), &module);
        !["forces", "material"].contains(&module[0])
            && !NAMED.contains(&module[0])
            && paths
                .iter()
                .any(|(_, path)| path.first().is_some_and(|first| NAMED.contains(first)))
    };
    let files: Vec<_> = sources.iter().filter(names).map(|(file, _)| file).collect();
    assert!(files.len() <= 3, "{files:?}");
}

/// Where a file names the implicit solver otherwise than as `Solver::Implicit`, which `tokens` are those of.
fn lines_naming_the_implicit_solver(tokens: &[Token]) -> Vec<usize> {
    let names = |at: &usize| {
        let is_of_definition = *at >= 2 && tokens[at - 2].text == "Solver" && tokens[at - 1].text == "::";
        // A comment of a document is a token too.
        let is_comment = tokens[*at].text.starts_with('/');
        tokens[*at].text.to_lowercase().contains("implicit") && !is_of_definition && !is_comment
    };
    let found = (0..tokens.len()).filter(names);
    found.map(|at| tokens[at].line).collect()
}

#[test]
fn the_implicit_solver_is_not_named_outside_of_solvers() {
    // A definition asks for it.
    const ASK: [&str; 2] = ["def", "capi"];
    for (file, text) in all_sources() {
        let module = module_of(&file);
        if module[0] != "solver" && !ASK.contains(&module[0]) {
            let lines = lines_naming_the_implicit_solver(&tokens(&text));
            assert!(lines.is_empty(), "{file} names it in lines {lines:?}");
        }
    }
    let planted = "/// implicit\nfn f() {\nSolver::Implicit; // implicit\nbody.implicit.is_some() }";
    assert_eq!(lines_naming_the_implicit_solver(&tokens(planted)), [4]);
}

/// The fields of a struct, each with whether other modules see it.
fn fields<'a>(tokens: &[Token<'a>], name: &str) -> Vec<(&'a str, bool)> {
    let start = tokens
        .windows(3)
        .position(|window| window[0].text == "struct" && window[1].text == name && window[2].text == "{");
    let mut depth = 0;
    let mut fields = Vec::new();
    let mut is_seen = false;
    for pair in tokens[start.expect("the struct") + 2..].windows(2) {
        match pair[0].text {
            "{" | "(" | "<" => depth += 1,
            "}" if depth == 1 => break,
            "}" | ")" | ">" => depth -= 1,
            "pub" => is_seen = true,
            "," if depth == 1 => is_seen = false,
            field if depth == 1 && pair[1].text == ":" => fields.push((field, is_seen)),
            _ => {}
        }
    }
    fields
}

#[test]
fn a_body_has_a_dozen_fields_at_most_and_keeps_them_to_itself() {
    let sources = all_sources();
    let (_, text) = sources.iter().find(|(file, _)| file == "body/mod.rs").expect("bodies");
    let found = fields(&tokens(text), "Body");
    assert!((2..=12).contains(&found.len()), "{found:?}");
    assert!(found.iter().all(|(_, is_seen)| !is_seen), "{found:?}");
    let planted = "pub struct Body { a: Box<Vec<u8>>, #[doc(hidden)] pub(crate) b: u8, c: [u8; 2] } struct C { d: u8 }";
    let expected = [("a", false), ("b", true), ("c", false)];
    assert_eq!(fields(&tokens(planted), "Body"), expected);
}

#[test]
fn modules_import_only_what_stands_below_them() {
    let sources = all_sources();
    let faults = faults(&sources, MAY_IMPORT);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The faults of files that are planted beside a root and three modules that are as they should be.
fn faults_beside(planted: &[(&str, &str)]) -> Vec<String> {
    let table: &[Row] = &[("low", &[]), ("middle", &["low"]), ("high", &["low", "middle"])];
    let whole = [
        (
            "lib.rs",
            "mod low; mod middle; mod high; pub use high::{World, inner::Body}; #[cfg(test)] mod trial;",
        ),
        ("low.rs", "pub(crate) const LOW: u32 = 1;"),
        ("middle.rs", "use crate::low::LOW;"),
        ("high/mod.rs", "use super::{low, middle::{self, Name}}; mod inner;"),
        ("trial.rs", "use crate::high;"),
    ];
    let sources: Vec<_> = whole
        .iter()
        .chain(planted)
        .map(|(file, text)| ((*file).to_owned(), (*text).to_owned()))
        .collect();
    faults(&sources, table)
}

#[test]
fn a_planted_import_is_found_however_it_is_written() {
    assert_eq!(faults_beside(&[]), [""; 0]);
    for planted in [
        "use crate::high::World;",
        "use crate::{low::LOW, high};",
        "use crate::{low::{LOW}, high::{self}};",
        "use crate::World;",
        "use crate::{low, Body};",
        "pub(crate) use crate::high::*;",
        "fn f<'a>(quote: char) -> crate::high::World { g('\"', '\\'', 'x') }",
        "use super::super::high;",
        "mod inner { mod deeper { use super::super::super::super::high; } }",
        "#[cfg(test)] mod tests { fn f() {} } use crate::high;",
        "/* a /* nested */ comment */ use crate::high;",
        "const TEXT: &str = r#\"a \" quote\"#; use crate::high;",
        "macro_rules! make { () => { $crate::high::World } }",
    ] {
        let text = format!("use crate::low;\n{planted}");
        let found = faults_beside(&[("middle/part.rs", &text)]);
        assert_eq!(found, ["middle/part.rs:2: middle may not import high"], "{planted}");
    }
}

#[test]
fn what_is_no_import_is_none() {
    for harmless in [
        "// use crate::high;",
        "/* use crate::high; */",
        "const TEXT: &str = \"use \\\" crate::high;\";",
        "const TEXT: &str = r#\"use crate::high;\"#;",
        "#[cfg(test)]\nmod tests { use crate::high; fn f() { if true {} } }",
        "#[cfg(test)]\nuse crate::high;",
        "mod inner { use super::high; }",
        "use super::high;",
        "use super::{low::{self as bottom}, super::low};",
        "pub(crate) fn f() {}",
    ] {
        assert_eq!(faults_beside(&[("middle/part.rs", harmless)]), [""; 0], "{harmless}");
    }
}

#[test]
fn a_module_without_a_row_is_found() {
    let unknown = faults_beside(&[("other.rs", "")]);
    assert_eq!(unknown, ["other.rs: the table has no row of other"]);
}

#[test]
fn a_planted_loop_in_the_table_is_found() {
    assert_eq!(faults_of_table(MAY_IMPORT), [""; 0]);
    for planted in [
        &[("low", &["high"][..]), ("high", &["low"])][..],
        &[("low", &["low"])],
        &[("low", &[]), ("high", &["low"]), ("low", &["high"])],
    ] {
        assert_eq!(faults_of_table(planted).len(), 1, "{planted:?}");
    }
}
