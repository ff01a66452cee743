//! The Rust examples: each prints the output stated in its first lines.

use std::path::Path;

use crate::support::{cargo, root, succeed};

fn prints_what_it_says(name: &str) {
    let source = std::fs::read_to_string(root().join(format!("examples/{name}.rs"))).expect("the example");
    let (_, rest) = source.split_once("//! ```text\n").expect("what it prints");
    let (block, _) = rest.split_once("//! ```\n").expect("its end");
    let expected: Vec<&str> = block
        .lines()
        .map(|line| line.trim_start_matches("//!").trim())
        .collect();
    let mut command = cargo();
    command.args(["run", "--quiet", "--example", name, "--target-dir"]).arg(
        Path::new(env!("CARGO_TARGET_TMPDIR"))
            .parent()
            .expect("the target folder"),
    );
    let output = String::from_utf8(succeed(&mut command).stdout).expect("text");
    let printed: Vec<&str> = output.lines().map(str::trim).collect();
    assert_eq!(printed.len(), expected.len(), "{name}: {output}");
    for (printed, expected) in printed.iter().zip(&expected) {
        assert!(
            are_equal_up_to_rounding(printed, expected),
            "{name}: {printed}, not {expected}"
        );
    }
}

/// True if words are equal and numbers differ by at most one unit of the last digit: processors round differently.
fn are_equal_up_to_rounding(a: &str, b: &str) -> bool {
    let (a, b): (Vec<&str>, Vec<&str>) = (a.split_whitespace().collect(), b.split_whitespace().collect());
    a.len() == b.len()
        && a.iter()
            .zip(&b)
            .all(|(a, b)| match (a.parse::<f64>(), b.parse::<f64>()) {
                (Ok(of_a), Ok(of_b)) => {
                    let digits = b.split_once('.').map_or(0, |(_, digits)| digits.len());
                    (of_a - of_b).abs() <= 1.001 * 0.1_f64.powi(digits as i32)
                }
                _ => a == b,
            })
}

#[test]
fn numbers_may_differ_by_one_of_their_last_digit() {
    assert!(are_equal_up_to_rounding("0.33 -176 of", "0.33 -177 of"));
    assert!(!are_equal_up_to_rounding("0.33 -175", "0.33 -177"));
    assert!(!are_equal_up_to_rounding("0.33", "0.35"));
    assert!(!are_equal_up_to_rounding("1 of", "1 or"));
    assert!(!are_equal_up_to_rounding("1", "1 1"));
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
#[ignore = "long"]
fn cloth() {
    prints_what_it_says("cloth");
}
