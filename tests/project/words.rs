//! The standard term for each concept: replaced phrases must not return to documents, headers and examples. The
//! glossary in docs/guide/glossary.md has the terms.

use std::fs;
use std::path::{Path, PathBuf};

/// The phrases to avoid, and their replacements.
const REPLACED: [(&str, &str); 30] = [
    ("in a row", "in series"),
    ("hang together", "are connected"),
    ("hangs together", "is connected"),
    ("turned one way", "consistently oriented"),
    ("inside out", "inverted"),
    ("turn back from", "recover from inversion"),
    ("the same bits", "bitwise identical"),
    ("to the bit", "bitwise identical"),
    ("last places", "last bits"),
    ("of order 2", "second-order accurate"),
    ("home spring", "anchor spring"),
    ("drawn surface", "render surface"),
    ("multiplied out", "matrix-vector products"),
    ("state of rest", "static equilibrium"),
    ("the bill ", "cost table"),
    ("yardstick", "reference solver"),
    ("put back", "rolled back"),
    ("made anew", "rebuilt"),
    (" anew", "again"),
    ("worked out", "computed"),
    ("numbered on", "appended"),
    ("tidied", "cleaned"),
    ("likewise", "the noun that it refers to"),
    (" lends", "returns a view of"),
    ("some 0.", "about"),
    ("whatever that is", "the noun that it refers to"),
    ("as above", "the name of the thing"),
    ("the same with", "the name of the thing"),
    ("is gone", "has been destroyed"),
    ("crumbs", "fragments"),
];

const FOLDERS: [&str; 4] = ["docs", "include", "c_examples", "packaging"];
const ENDINGS: [&str; 5] = ["md", "h", "hpp", "c", "cpp"];

/// Collects the files with these endings below a folder, but for build folders.
pub fn texts(folder: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("a file").path();
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        if path.is_dir() && !path.ends_with("target") {
            texts(&path, endings, found);
        } else if endings.contains(&ending) {
            found.push(path);
        }
    }
}

/// Returns the lines of a text that contain a replaced phrase.
fn faults(name: &str, text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.to_lowercase();
        for (phrase, term) in REPLACED {
            if line.contains(phrase) {
                found.push(format!("{name}:{}: \"{phrase}\"; write: {term}", number + 1));
            }
        }
    }
    found
}

#[test]
fn documents_headers_and_examples_use_the_standard_terms() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths: Vec<PathBuf> = [
        "README.md",
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "FIGURES.md",
    ]
    .map(|name| root.join(name))
    .to_vec();
    for folder in FOLDERS {
        texts(&root.join(folder), &ENDINGS, &mut paths);
    }
    assert!(paths.len() > 80, "{} texts", paths.len());
    let found: Vec<String> = paths
        .iter()
        .flat_map(|path| faults(&path.display().to_string(), &fs::read_to_string(path).expect("a text")))
        .collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn a_replaced_phrase_is_found() {
    assert_eq!(faults("a.md", "Two springs\nin a Row.").len(), 1);
    assert!(faults("a.md", "Two springs in series.").is_empty());
}
