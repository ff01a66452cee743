//! The samples program without a window: every scene runs and is drawn, and the pointer pulls, presses and cuts.
#![cfg(all(target_os = "linux", feature = "pictures"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, OnceLock};

use crate::support::{Library, root, skip, succeed};

/// Returns the program, built once; `None` if SDL2, OpenGL or a virtual display is missing.
fn program() -> Option<&'static Path> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    PROGRAM.get_or_init(build).as_deref()
}

fn build() -> Option<PathBuf> {
    let needs = ["pkg-config --exists sdl2 gl", "command -v xvfb-run", "command -v xauth"];
    for need in needs {
        let probe = Command::new("sh").args(["-c", need]).output();
        if !probe.is_ok_and(|output| output.status.success()) {
            skip(&format!("samples: failed: {need}"));
            return None;
        }
    }
    Library::release();
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap();
    succeed(
        Command::new("make")
            .arg("-C")
            .arg(root().join("c_examples"))
            .arg("samples")
            .env("CARGO_TARGET_DIR", target)
            .env_remove("MAKEFLAGS")
            .env_remove("LD_LIBRARY_PATH"),
    );
    Some(target.join("c_examples/samples"))
}

/// One virtual display at a time: `xvfb-run -a` is not safe against another one that starts at the same moment.
static TURN: Mutex<()> = Mutex::new(());

/// Plays a scene for several frames; returns its output and its last image.
fn play(program: &Path, scene: &str, frames: u32, pointer: &str) -> (String, PathBuf) {
    let _turn = TURN.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("samples");
    std::fs::create_dir_all(&folder).unwrap();
    let name = format!("{scene}_{pointer}.png");
    let mut command = Command::new("xvfb-run");
    command
        .args(["-a", "-s", "-screen 0 1280x1024x24"])
        .arg(program)
        .args(["--offscreen", &frames.to_string(), "--scene", scene, "--out", &name])
        .current_dir(&folder)
        .env_remove("DISPLAY")
        .env_remove("LD_LIBRARY_PATH");
    if !pointer.is_empty() {
        command.args(["--pointer", pointer]);
    }
    let output = succeed(&mut command);
    (String::from_utf8_lossy(&output.stdout).into_owned(), folder.join(name))
}

/// Returns all numbers of a line that begins with this text.
fn numbers(printed: &str, begins: &str) -> Vec<f64> {
    let line = printed.lines().find(|line| line.starts_with(begins));
    let line = line.unwrap_or_else(|| panic!("no line {begins}: {printed}"));
    let words = line.split(|letter: char| !(letter.is_ascii_digit() || letter == '.'));
    words.filter_map(|word| word.parse().ok()).collect()
}

/// Checks that tissue, which alone has saturated colors, covers part of the image, and not its corner.
fn check_not_blank(path: &Path) {
    let mut decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    let all: Vec<[u8; 3]> = pixels.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    let saturated = |p: &&[u8; 3]| p.iter().max().unwrap() - p.iter().min().unwrap() > 40;
    let share = all.iter().filter(saturated).count() as f64 / all.len() as f64;
    assert!(
        (0.02..0.9).contains(&share),
        "{}: tissue has {share} of the picture",
        path.display()
    );
    assert!(!saturated(&&all[0]), "{}: no background in the corner", path.display());
    // Light and shade: a body in one flat color has few.
    let shades: BTreeSet<_> = all.iter().filter(saturated).map(|p| p.map(|c| c >> 3)).collect();
    assert!(shades.len() > 30, "{}: {} shades", path.display(), shades.len());
}

#[test]
#[ignore = "long"]
fn every_scene_runs_and_is_drawn() {
    let Some(program) = program() else { return };
    let listed = succeed(Command::new(program).arg("--list"));
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    let scenes: Vec<&str> = listed.lines().filter_map(|line| line.split(':').next()).collect();
    assert_eq!(
        scenes,
        [
            "organ", "cloth", "cutting", "suturing", "pile", "haptics", "balloon", "tearing"
        ]
    );
    for scene in scenes {
        let (printed, picture) = play(program, scene, 60, "");
        assert!(!printed.contains("refused"), "{printed}");
        check_not_blank(&picture);
    }
}

#[test]
#[ignore = "long"]
fn the_pointer_pulls_tissue_along() {
    let Some(program) = program() else { return };
    for scene in ["organ", "cloth", "pile"] {
        let (printed, _) = play(program, scene, 60, "pull");
        let [moved, nearest, force] = numbers(&printed, "pointer")[..] else {
            panic!("{printed}")
        };
        // Half a triangle edge at most: 11 mm for the organ, 10 mm for the cloth, 24 mm for the diagonals of the
        // blocks.
        assert!(moved > 20.0 && nearest < 12.0 && force > 0.01, "{printed}");
    }
}

#[test]
#[ignore = "long"]
fn the_pointer_presses_with_a_ball_that_stays_outside() {
    let Some(program) = program() else { return };
    for scene in ["organ", "haptics"] {
        let (printed, _) = play(program, scene, 60, "press");
        let [moved, nearest, force] = numbers(&printed, "pointer")[..] else {
            panic!("{printed}")
        };
        // It penetrates by at most 18 mm, and no node enters the ball, whose radius is 12 mm.
        assert!(moved > 10.0 && (11.9..20.0).contains(&nearest), "{printed}");
        assert!(force > 0.1, "{printed}");
    }
}

#[test]
#[ignore = "long"]
fn the_pointer_cuts() {
    let Some(program) = program() else { return };
    for scene in ["organ", "cloth", "balloon"] {
        let (printed, picture) = play(program, scene, 60, "cut");
        let [nodes, triangles, new_nodes, new_triangles] = numbers(&printed, scene)[..] else {
            panic!("{printed}")
        };
        assert!(
            new_nodes > nodes + 10.0 && new_triangles > triangles + 10.0,
            "{printed}"
        );
        assert!(!printed.contains("refused"), "{printed}");
        if scene != "balloon" {
            check_not_blank(&picture); // the balloon is below its weight
        }
    }
}
