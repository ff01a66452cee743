//! The README shows the program that is built and run.

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
