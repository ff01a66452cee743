//! The cost of the library and of an empty world.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use sinew::{World, WorldDefinition};

use crate::clock;

/// Steps of an idle world.
const STEPS: u32 = 10_000;

/// Number of timed runs; the fastest counts.
const REPEATS: usize = 3;

/// Two tables: the size of the shared library, and a world without bodies. `allocated` returns the allocated bytes.
pub fn report(allocated: impl Fn() -> usize) -> String {
    let mut report = String::from("| shared library | KiB |\n|---|---|\n");
    for (name, arguments, folder) in [
        ("all features", &[][..], "target"),
        (
            "none (`--no-default-features`)",
            &["--no-default-features"][..],
            "target/bill",
        ),
    ] {
        let size = library_size(arguments, folder);
        let text = size.map_or_else(|reason| reason, |bytes| format!("{:.0}", bytes as f64 / 1024.0));
        let _ = writeln!(report, "| {name} | {text} |");
    }
    let _ = writeln!(report, "\n| world without bodies | us a step | bytes |\n|---|---|---|");
    for threads in [1, 2] {
        let before = allocated();
        let mut world = World::new(WorldDefinition {
            thread_count: threads,
            ..WorldDefinition::default()
        })
        .expect("a world");
        let bytes = allocated() - before;
        let mut least = f64::INFINITY;
        for _ in 0..REPEATS {
            let elapsed = clock::time(|| {
                for _ in 0..STEPS {
                    world.step(1e-3).expect("a step");
                }
            });
            least = least.min(1e6 * elapsed.wall / f64::from(STEPS));
        }
        let _ = writeln!(report, "| thread_count {threads} | {least:.3} | {bytes} |");
    }
    report.push('\n');
    report
}

/// Builds the shared library as it is shipped, unless it is up to date, and returns its size in bytes.
fn library_size(arguments: &[&str], folder: &str) -> Result<u64, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder: PathBuf = root.join(folder);
    eprintln!("building the library, {arguments:?}: about two minutes unless it is up to date");
    let status = Command::new(env!("CARGO"))
        .current_dir(root)
        .args(["build", "--quiet", "--release", "--lib", "--target-dir"])
        .arg(&folder)
        .args(arguments)
        .status();
    if !status.is_ok_and(|status| status.success()) {
        return Err("not built".into());
    }
    let name = format!("{}sinew{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let library = std::fs::metadata(folder.join("release").join(name));
    library.map(|library| library.len()).map_err(|error| error.to_string())
}
