//! The examples in Rust: each prints what its first lines say.

use std::path::Path;
use std::process::Command;

use crate::support::{root, succeed};

fn prints_what_it_says(name: &str) {
    let source = std::fs::read_to_string(root().join(format!("examples/{name}.rs"))).expect("the example");
    let (_, rest) = source.split_once("//! ```text\n").expect("what it prints");
    let (block, _) = rest.split_once("//! ```\n").expect("its end");
    let expected: Vec<&str> = block
        .lines()
        .map(|line| line.trim_start_matches("//!").trim())
        .collect();
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command
        .args(["run", "--quiet", "--example", name, "--target-dir"])
        .arg(
            Path::new(env!("CARGO_TARGET_TMPDIR"))
                .parent()
                .expect("the target folder"),
        )
        .current_dir(root());
    let output = String::from_utf8(succeed(&mut command).stdout).expect("text");
    let printed: Vec<&str> = output.lines().map(str::trim).collect();
    assert_eq!(printed, expected, "{name}");
}

#[test]
fn press() {
    prints_what_it_says("press");
}

#[test]
fn cut() {
    prints_what_it_says("cut");
}

#[test]
fn cloth() {
    prints_what_it_says("cloth");
}
