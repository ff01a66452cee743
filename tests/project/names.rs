//! A name stands for one type of `src`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Names that several types have, in modules that do not meet.
const SHARED: [&str; 9] = [
    "EdgeInside",
    "Overlap",
    "PointInside",
    "Product",
    "Shape",
    "Substep",
    "Surface",
    "Symmetric",
    "View",
];

/// Counts the types that each name stands for, but for associated types.
fn count_types(folder: &Path, counts: &mut BTreeMap<String, usize>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("a file").path();
        if path.is_dir() {
            count_types(&path, counts);
            continue;
        }
        let text = fs::read_to_string(&path).expect("text");
        for line in text.lines() {
            let mut words = line
                .split(|c: char| !c.is_alphanumeric() && c != '_')
                .filter(|word| !word.is_empty());
            let is_inner = line.starts_with(' ');
            let kind = words.find(|word| !matches!(*word, "pub" | "crate" | "super" | "in" | "unsafe"));
            if matches!(kind, Some("struct" | "enum" | "trait")) || kind == Some("type") && !is_inner {
                *counts.entry(words.next().expect("a name").into()).or_default() += 1;
            }
        }
    }
}

#[test]
fn a_name_stands_for_one_type() {
    let mut counts = BTreeMap::new();
    count_types(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut counts);
    assert!(counts["World"] == 1 && counts.len() > 500, "{}", counts.len());
    let shared: Vec<_> = counts
        .iter()
        .filter(|(_, count)| **count > 1)
        .map(|(name, _)| name)
        .collect();
    assert_eq!(shared, SHARED);
}

/// Rust files of the repository, by their paths.
fn rust_files(folder: &Path, files: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("a file").path();
        let name = path.file_name().expect("a name").to_string_lossy();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            rust_files(&path, files);
        } else if name.ends_with(".rs") || name.ends_with(".md") {
            files.push(path.to_string_lossy().into_owned());
        }
    }
}

#[test]
fn source_files_named_in_documents_and_comments_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    rust_files(root, &mut files);
    let mut named = 0;
    for file in files
        .iter()
        .filter(|file| !file.ends_with("CHANGELOG.md") && !file.contains("/docs/decisions/"))
    {
        let text = fs::read_to_string(file).expect("text");
        for name in text.split('`').skip(1).step_by(2).filter(|name| name.ends_with(".rs")) {
            let is_path = name
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '/' | '.'));
            let exists = || files.iter().any(|file| file.ends_with(&format!("/{name}")));
            assert!(!is_path || exists(), "{file} names {name}, which does not exist");
            named += usize::from(is_path);
        }
    }
    assert!(named > 100, "{named} names");
}
