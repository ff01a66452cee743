//! The samples as a web page (`make web`): bitwise identical to the native build without a browser, and driven by
//! pointer events in one.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use crate::support::{Library, installed, report_folder, root, skip, succeed};

const TARGET: &str = "wasm32-unknown-unknown";

/// The first version of node with WebAssembly SIMD.
const NODE: u32 = 16;

fn folder() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
}

/// Returns a command's output, or `None` if it fails.
fn output_of(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok()?;
    output
        .status
        .success()
        .then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Returns the page, built once; `None` if a tool is missing.
fn page() -> Option<&'static Path> {
    static PAGE: OnceLock<Option<PathBuf>> = OnceLock::new();
    PAGE.get_or_init(build).as_deref()
}

fn build() -> Option<PathBuf> {
    let libraries = output_of("rustc", &["--print", "target-libdir", "--target", TARGET]);
    let node = output_of("node", &["--version"])
        .and_then(|version| version.trim_start_matches('v').split('.').next()?.parse().ok());
    let missing = [
        ("make", installed("make")),
        (
            "clang",
            output_of("clang", &["--print-targets"]).is_some_and(|targets| targets.contains("wasm32")),
        ),
        (TARGET, libraries.is_some_and(|folder| Path::new(&folder).is_dir())),
        ("node 16", node.is_some_and(|version: u32| version >= NODE)),
    ];
    let missing: Vec<&str> = missing
        .iter()
        .filter(|(_, there)| !there)
        .map(|&(tool, _)| tool)
        .collect();
    if !missing.is_empty() {
        skip(&format!("the page, for which is not installed: {}", missing.join(", ")));
        return None;
    }
    let target = folder().parent().unwrap();
    succeed(
        Command::new("make")
            .arg("-C")
            .arg(root().join("web"))
            .arg("QUICK=1")
            .env("CARGO_TARGET_DIR", target)
            .env_remove("MAKEFLAGS"),
    );
    Some(target.join("web"))
}

/// Returns the sources of the scenes.
fn scenes() -> Vec<PathBuf> {
    let samples = std::fs::read_dir(root().join("c_examples/samples")).unwrap();
    let is_scene = |name: &str| name.starts_with("scene") || name == "pointer.c";
    let mut scenes: Vec<PathBuf> = samples
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            path.extension().is_some_and(|end| end == "c") && is_scene(path.file_name().unwrap().to_str().unwrap())
        })
        .collect();
    scenes.sort();
    scenes
}

/// Returns the hash after each of these frames of every scene, with the portable kernel and no browser.
fn native_hashes(frames: &str) -> String {
    let library = Library::release();
    let program = folder().join("web_native");
    succeed(
        Command::new("cc")
            .args([
                "-std=c99",
                "-Wall",
                "-Wextra",
                "-Werror",
                "-O1",
                "-Wl,--wrap=sinew_world_create",
            ])
            .args(
                [
                    root().join("include"),
                    root().join("web"),
                    root().join("c_examples/samples"),
                ]
                .map(|folder| format!("-I{}", folder.display())),
            )
            .arg(root().join("tests/web/native.c"))
            .arg(root().join("web/demo.c"))
            .args(scenes())
            .arg(library.archive())
            .args(&library.native_libraries)
            .args(["-lm", "-o"])
            .arg(&program),
    );
    String::from_utf8(succeed(Command::new(program).arg(frames)).stdout).unwrap()
}

#[test]
#[ignore = "long"]
fn every_scene_is_bitwise_that_of_the_portable_kernel() {
    let Some(page) = page() else { return };
    const FRAMES: &str = "60";
    let output = succeed(
        Command::new("node")
            .arg(root().join("tests/web/run.mjs"))
            .arg(page.join("sinew.wasm"))
            .arg(FRAMES),
    );
    let found = String::from_utf8(output.stdout).unwrap();
    let expected = native_hashes(FRAMES);
    assert!(expected.lines().count() >= 60, "{expected}");
    assert_eq!(found.lines().count(), expected.lines().count());
    let other = found
        .lines()
        .zip(expected.lines())
        .find(|(found, expected)| found != expected);
    assert_eq!(other, None, "the first that differs, here and natively");
}

#[test]
#[ignore = "long"]
fn the_page_is_small_enough_to_download() {
    let Some(page) = page() else { return };
    let files = std::fs::read_dir(page)
        .unwrap()
        .map(|entry| entry.unwrap().metadata().unwrap());
    let size: u64 = files.filter(|file| file.is_file()).map(|file| file.len()).sum();
    assert!((1..5_000_000).contains(&size), "{size} bytes");
}

#[test]
#[ignore = "long"]
fn a_browser_drags_and_cuts() {
    let Some(page) = page() else { return };
    let Some(browser) = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| installed(name))
    else {
        return skip("the page in a browser: no chromium");
    };
    let profile = folder().join("web_profile");
    let _ = std::fs::remove_dir_all(&profile);
    std::fs::create_dir_all(report_folder()).unwrap();
    let picture = report_folder().join("web.png");
    let output = succeed(
        Command::new("node")
            .arg(root().join("tests/web/browse.mjs"))
            .arg(page)
            .arg(browser)
            .arg(&profile)
            .arg(&picture),
    );
    let report = String::from_utf8(output.stdout).unwrap();
    let value = |name: &str| -> f64 {
        let (_, rest) = report
            .split_once(&format!("\"{name}\":"))
            .unwrap_or_else(|| panic!("{name}: {report}"));
        rest.split([',', '}']).next().unwrap().parse().unwrap()
    };
    // m: the pointer moved by 8 % of the canvas in x and y. The held point lies on the pointer's ray up to
    // single-precision rounding, and the tissue is within a node distance of it.
    assert!(
        value("moved") > 0.02 && value("off") < 1e-6 && value("nearest") < 0.011,
        "{report}"
    );
    assert!(value("after") > value("before"), "{report}");
    // Shades of a lit surface; a blank image has one.
    assert!(value("colors") > 500.0, "{report}");
    assert!(std::fs::metadata(&picture).unwrap().len() > 10_000);
}
