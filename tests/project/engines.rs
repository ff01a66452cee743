//! The library in other engines, by their FFI. Each program of `c_examples/engines` runs if its engine is installed,
//! checks forces and positions itself, and writes an image that is not blank.
#![cfg(all(target_os = "linux", feature = "pictures"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

use crate::support::{Library, root, skip, succeed};

/// One engine at a time, since each uses several threads.
static TURN: Mutex<()> = Mutex::new(());

/// Returns the missing requirements of an engine, found by a shell.
fn missing<'a>(needs: &[&'a str]) -> Vec<&'a str> {
    let is_available = |need: &str| {
        let probe = match need.split_once(".pc") {
            Some((package, _)) => format!("pkg-config --exists {package}"),
            None => format!("command -v {need}"),
        };
        Command::new("sh")
            .arg("-c")
            .arg(probe)
            .output()
            .is_ok_and(|output| output.status.success())
    };
    needs.iter().copied().filter(|need| !is_available(need)).collect()
}

/// Runs `make ENGINE`; returns its output, or `None` if the engine is not installed.
fn run(engine: &str, needs: &[&str], settings: &[String]) -> Option<String> {
    let missing = missing(needs);
    if !missing.is_empty() {
        skip(&format!("{engine}: not installed: {}", missing.join(" ")));
        return None;
    }
    let _turn = TURN.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    Library::release();
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap();
    let output = succeed(
        Command::new("make")
            .arg("-C")
            .arg(root().join("c_examples"))
            .arg(engine)
            .arg(format!("PICTURES={}", pictures(engine).display()))
            .args(settings)
            .env("CARGO_TARGET_DIR", target)
            .env_remove("MAKEFLAGS")
            .env_remove("LD_LIBRARY_PATH"),
    );
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn pictures(engine: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("engines").join(engine);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Checks that the image exists, and that no color covers nearly all of it, as in a black or empty one.
fn check_not_blank(engine: &str, name: &str) {
    let path = pictures(engine).join(name);
    let file = std::fs::File::open(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut decoder = png::Decoder::new(std::io::BufReader::new(file));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    assert!(frame.width >= 600 && frame.height >= 400, "{}", path.display());
    let mut counts = BTreeMap::new();
    for pixel in pixels.chunks_exact(frame.color_type.samples()) {
        // Sixteen shades of each channel.
        *counts
            .entry([pixel[0] >> 4, pixel[1] >> 4, pixel[2] >> 4])
            .or_insert(0_usize) += 1;
    }
    let all: usize = counts.values().sum();
    let most = counts.values().max().copied().unwrap_or(0);
    assert!(
        counts.len() > 20 && most < all * 9 / 10,
        "{}: {} colors, {most} of {all} pixels of one",
        path.display(),
        counts.len()
    );
}

fn begin(engine: &str) {
    let _ = std::fs::remove_dir_all(pictures(engine));
}

#[test]
#[ignore = "long"]
fn love_draws_soft_blocks_with_luajit() {
    begin("love");
    if let Some(said) = run("love", &["love", "xvfb-run", "xauth"], &["DISPLAY=".into()]) {
        assert!(said.contains("N carried"), "{said}");
        check_not_blank("love", "love.png");
    }
}

#[test]
#[ignore = "long"]
fn mono_calls_it_as_unity_does() {
    begin("mono");
    if let Some(said) = run("mono", &["mcs", "mono"], &[]) {
        assert!(said.contains("floor"), "{said}");
        check_not_blank("mono", "mono.png");
    }
}

#[test]
#[ignore = "long"]
fn a_ball_of_bullet_lies_in_a_sheet() {
    begin("bullet");
    if let Some(said) = run("bullet", &["bullet.pc", "c++"], &[]) {
        assert!(said.contains("momentum") && !said.contains("differ"), "{said}");
        check_not_blank("bullet", "bullet.png");
    }
}

#[test]
#[ignore = "long"]
fn godot_lays_a_cloth_over_a_ball() {
    for (engine, needs) in [
        ("DISPLAY= ", &["godot3-runner", "xvfb-run", "xauth"] as &[&str]),
        ("GODOT=godot3-server", &["godot3-server"]),
    ] {
        begin("godot");
        if let Some(said) = run("godot", needs, &[engine.trim().into()]) {
            assert!(said.contains("the ball bears"), "{said}");
            check_not_blank("godot", "godot.png");
        }
    }
}
