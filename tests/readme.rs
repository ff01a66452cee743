//! The README shows programs that are built and run.

use std::fs;
use std::path::Path;

#[test]
fn the_smallest_program_is_the_one_that_runs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = fs::read_to_string(root.join("README.md")).expect("README.md");
    let program = fs::read_to_string(root.join("c_examples/quickstart.c")).expect("c_examples/quickstart.c");
    assert!(
        readme.contains(&format!("```c\n{program}```")),
        "copy c_examples/quickstart.c into the README"
    );
    assert!(program.lines().count() < 40);
}

#[test]
fn what_else_it_shows_is_part_of_programs_that_run() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = fs::read_to_string(root.join("README.md")).expect("README.md");
    let programs: String = ["c_examples", "tests/c"]
        .iter()
        .flat_map(|folder| fs::read_dir(root.join(folder)).expect("a folder"))
        .map(|entry| entry.expect("a file").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "c"))
        .map(|path| fs::read_to_string(path).expect("a program"))
        .collect();
    let snippets: Vec<&str> = readme
        .split("```c\n")
        .skip(1)
        .map(|rest| rest.split("```").next().unwrap_or_default())
        .collect();
    assert!(snippets.len() > 1);
    for snippet in snippets {
        assert!(programs.contains(snippet), "no program has\n{snippet}");
    }
}
