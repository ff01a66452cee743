//! A name stands for one type of `src`, and files that are named exist.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::words::texts;

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
fn count_types(folder: &Path) -> BTreeMap<String, usize> {
    let (mut paths, mut counts) = (Vec::new(), BTreeMap::new());
    texts(folder, &["rs"], &mut paths);
    for path in paths {
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
    counts
}

#[test]
fn a_name_stands_for_one_type() {
    let counts = count_types(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    assert!(counts["World"] == 1 && counts.len() > 500, "{}", counts.len());
    let shared: Vec<_> = counts
        .iter()
        .filter(|(_, count)| **count > 1)
        .map(|(name, _)| name)
        .collect();
    assert_eq!(shared, SHARED);
}

#[test]
fn source_files_named_in_documents_and_comments_exist() {
    let mut paths = Vec::new();
    texts(Path::new(env!("CARGO_MANIFEST_DIR")), &["rs", "md"], &mut paths);
    let is_history =
        |path: &Path| path.ends_with("CHANGELOG.md") || path.components().any(|c| c.as_os_str() == "decisions");
    let mut named = 0;
    for path in paths.iter().filter(|path| !is_history(path)) {
        let text = fs::read_to_string(path).expect("text");
        for name in text.split('`').skip(1).step_by(2).filter(|name| name.ends_with(".rs")) {
            let is_path = name
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '/' | '.'));
            let exists = || paths.iter().any(|path| path.ends_with(name));
            assert!(
                !is_path || exists(),
                "{} names {name}, which does not exist",
                path.display()
            );
            named += usize::from(is_path);
        }
    }
    assert!(named > 100, "{named} names");
}
