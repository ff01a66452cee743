//! A name stands for one type of `src`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Names that several types have, in modules that do not meet.
const SHARED: [&str; 20] = [
    "Changes",
    "EdgeInside",
    "Form",
    "Frame",
    "Goal",
    "Link",
    "Motion",
    "Overlap",
    "Parts",
    "PointInside",
    "Product",
    "Shape",
    "Solved",
    "Spring",
    "Substep",
    "Surface",
    "Sweep",
    "Symmetric",
    "Tangent",
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
