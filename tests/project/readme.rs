//! The documents: programs in them are built and run, links have valid targets, and the short documents stay short.

use std::collections::HashMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::support::root;

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Returns all documents by their paths within the crate: those beside the README and those in `docs`.
fn documents() -> Vec<PathBuf> {
    let mut folders = vec![PathBuf::from("docs")];
    let mut found: Vec<PathBuf> = files(Path::new("")).filter(|path| is_document(path)).collect();
    while let Some(folder) = folders.pop() {
        for path in files(&folder) {
            if root().join(&path).is_dir() {
                folders.push(path);
            } else if is_document(&path) {
                found.push(path);
            }
        }
    }
    found
}

fn files(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(root().join(folder)).expect("a folder");
    entries.map(move |entry| folder.join(entry.expect("a file").file_name()))
}

fn is_document(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "md")
}

/// Returns a document without its code blocks.
fn prose(text: &str) -> String {
    let mut in_code = false;
    let is_prose = |line: &&str| {
        let is_fence = line.starts_with("```");
        in_code ^= is_fence;
        !in_code && !is_fence
    };
    text.lines().filter(is_prose).flat_map(|line| [line, "\n"]).collect()
}

/// Returns the targets of `[text](target)`, without inline code.
fn links(text: &str) -> Vec<String> {
    let text: String = prose(text).split('`').step_by(2).collect();
    let targets = text.split("](").skip(1);
    targets
        .map(|rest| rest.split(')').next().unwrap_or_default().to_owned())
        .collect()
}

/// Returns the anchors of a document's headings, as repository hosts generate them.
fn anchors(text: &str) -> Vec<String> {
    let mut seen: HashMap<String, usize> = HashMap::new();
    let headings = prose(text);
    let headings = headings.lines().filter(|line| line.starts_with('#'));
    headings
        .map(|line| {
            let title = line.trim_start_matches('#').trim().to_lowercase();
            let kept = |letter: &char| letter.is_alphanumeric() || matches!(letter, ' ' | '-' | '_');
            let anchor = title.chars().filter(kept).collect::<String>().replace(' ', "-");
            let count = seen.entry(anchor.clone()).or_default();
            *count += 1;
            if *count == 1 {
                anchor
            } else {
                format!("{anchor}-{}", *count - 1)
            }
        })
        .collect()
}

/// Returns a path within the crate, or `None` if it leads outside.
fn within(path: &Path) -> Option<PathBuf> {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir if !plain.pop() => return None,
            Component::Normal(name) => plain.push(name),
            _ => {}
        }
    }
    Some(plain)
}

/// Returns the broken links of a document.
fn broken_links(document: &Path, text: &str) -> Vec<String> {
    let is_broken = |link: &String| {
        if link.starts_with("https://") || link.starts_with("http://") {
            return false;
        }
        let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
        if path.is_empty() {
            return !anchors(text).iter().any(|there| there == anchor);
        }
        let target = within(&document.parent().unwrap_or(Path::new("")).join(path));
        let Some(target) = target.filter(|target| root().join(target).exists()) else {
            return true;
        };
        let has_anchor = || is_document(&target) && anchors(&read(&target)).iter().any(|there| there == anchor);
        !anchor.is_empty() && !has_anchor()
    };
    links(text).into_iter().filter(is_broken).collect()
}

/// Returns the code blocks of a language.
fn code<'a>(text: &'a str, language: &str) -> Vec<&'a str> {
    let fence = format!("```{language}\n");
    let blocks = text.split(&fence).skip(1);
    blocks
        .map(|rest| rest.split("```").next().unwrap_or_default())
        .collect()
}

#[test]
fn the_smallest_program_is_the_one_that_runs() {
    let program = read("c_examples/quickstart.c");
    assert!(
        read("README.md").contains(&format!("```c\n{program}```")),
        "copy c_examples/quickstart.c into the README"
    );
    assert!(program.lines().count() < 40);
}

#[test]
fn other_snippets_are_parts_of_programs_that_run() {
    let programs: String = ["c_examples", "c_examples/lessons", "tests/c"]
        .iter()
        .flat_map(|folder| files(Path::new(folder)))
        .filter(|path| path.extension().is_some_and(|extension| extension == "c"))
        .map(read)
        .collect();
    let wrapped = read("c_examples/quickstart.cpp");
    let managed = read("c_examples/engines/mono/Program.cs");
    let mut count = 0;
    for document in documents() {
        let text = read(&document);
        for (language, programs) in [("c", &programs), ("cpp", &wrapped), ("csharp", &managed)] {
            for snippet in code(&text, language) {
                assert!(
                    programs.contains(snippet),
                    "{}: no program has\n{snippet}",
                    document.display()
                );
                count += 1;
            }
        }
    }
    assert!(count > 20, "{count} snippets");
}

#[test]
fn links_lead_to_files_and_headings_that_exist() {
    let mut broken = Vec::new();
    let mut count = 0;
    for document in documents() {
        let text = read(&document);
        count += links(&text).len();
        let lost = broken_links(&document, &text);
        broken.extend(lost.into_iter().map(|link| format!("{}: {link}", document.display())));
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
    assert!(count > 100, "{count} links");
}

#[test]
fn a_broken_link_is_found() {
    let text = "# A heading\n[a](#a-heading) [b](#no-heading) [c](guide/limits.md#platforms) [d](guide/limits.md#none)\n\
                [e](guide/none.md) [f](../../elsewhere.md) `[g](none.md)` [h](../README.md)\n```c\n[i](none.md)\n```\n";
    let lost = broken_links(Path::new("docs/README.md"), text);
    assert_eq!(
        lost,
        [
            "#no-heading",
            "guide/limits.md#none",
            "guide/none.md",
            "../../elsewhere.md"
        ]
    );
}

/// Every guide, method and decision is in the index of its folder.
#[test]
fn every_page_is_in_an_index() {
    for (folder, index) in [
        ("docs/guide", "docs/README.md"),
        ("docs/tutorials", "docs/tutorials/README.md"),
        ("docs/methods", "docs/methods/README.md"),
        ("docs/decisions", "docs/decisions/README.md"),
    ] {
        let listed: Vec<PathBuf> = links(&read(index))
            .iter()
            .filter_map(|link| within(&Path::new(index).with_file_name(link.split('#').next().unwrap_or_default())))
            .collect();
        for page in files(Path::new(folder)).filter(|page| is_document(page) && page.as_path() != Path::new(index)) {
            assert!(listed.contains(&page), "{index} lacks {}", page.display());
        }
    }
}

/// Every page of the guide is in the book, and every entry of the book exists.
#[test]
fn the_book_has_every_page() {
    let summary = links(&read("docs/SUMMARY.md"));
    for folder in ["docs/guide", "docs/tutorials"] {
        for page in files(Path::new(folder)) {
            let entry = page
                .strip_prefix("docs")
                .expect("a page")
                .to_string_lossy()
                .into_owned();
            assert!(summary.contains(&entry), "docs/SUMMARY.md lacks {entry}");
        }
    }
}

/// Links of the packaged README lead to packaged files.
#[test]
fn the_package_has_the_documents() {
    let manifest = read("Cargo.toml");
    let include = manifest
        .lines()
        .find(|line| line.starts_with("include = "))
        .expect("a list of what is packaged");
    for document in documents() {
        let first = document.components().next().expect("a path").as_os_str();
        let entry = format!("\"/{}\"", first.to_string_lossy());
        assert!(
            include.contains(&entry),
            "Cargo.toml does not package {}",
            document.display()
        );
    }
}

#[test]
fn the_first_documents_stay_short() {
    let readme = read("README.md");
    assert!(
        readme.lines().count() <= 180,
        "README.md: {} lines",
        readme.lines().count()
    );
    let words = readme.split_whitespace().count();
    assert!(words <= 1300, "README.md: {words} words");
    let map = read("ARCHITECTURE.md").len();
    assert!(map <= 12 * 1024, "ARCHITECTURE.md: {map} bytes");
    for (folder, most) in [("docs/methods", 1500), ("docs/guide", 1500), ("docs/tutorials", 1000)] {
        for page in files(Path::new(folder)) {
            let words = read(&page).split_whitespace().count();
            assert!(words <= most, "{}: {words} words", page.display());
        }
    }
}
