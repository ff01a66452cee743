//! Helpers that tests and benchmarks share: builds of the library, running external programs, bodies and their motion
//! in `f64`.

#![allow(dead_code, reason = "each test uses some of these helpers")]

pub mod bodies;
pub mod change_lists;
pub mod crossings;
pub mod euler;
pub mod hanging;
pub mod held_block;
pub mod kept;
pub mod motion;
pub mod organ;
pub mod random;
pub mod reference;
pub mod scene;
pub mod solid;
pub mod statics;
pub mod stroke;
pub mod tissue;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

/// The crate's own folder.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Returns the folder for the reports of tests and benchmarks.
pub fn report_folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("report")
}

/// Replaces one section of `pending.md`, the list of missing features. Sections of other tests remain.
pub fn report_pending(title: &str, lines: &[String]) {
    let folder = report_folder();
    let path = folder.join("pending.md");
    let head = format!("# {title}\n");
    let old_text = std::fs::read_to_string(&path).unwrap_or_default();
    let others = old_text
        .split_inclusive('\n')
        .scan(false, |is_ours, line| {
            if line.starts_with("# ") {
                *is_ours = line == head;
            }
            Some((!*is_ours).then_some(line))
        })
        .flatten();
    let text: String = others.map(str::to_owned).chain([head.clone(), "\n".into()]).collect();
    let list: String = lines.iter().map(|line| format!("- {line}\n")).collect();
    std::fs::create_dir_all(&folder).expect("a folder for reports");
    std::fs::write(&path, format!("{text}{list}\n")).expect("a report");
}

/// Reports a skipped test on stderr. The test harness does not capture it.
pub fn skip(what: &str) {
    // One write, so that output of other tests cannot split the line.
    let _ = std::io::stderr().write_all(format!("SKIPPED: {what}\n").as_bytes());
}

/// Returns true if a program can be run here.
pub fn installed(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

/// Returns a cargo command that runs in the root folder of the crate.
pub fn cargo() -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(root());
    cargo
}

/// Returns the output of a command that fails.
pub fn failure(command: &mut Command) -> Option<String> {
    match command.output() {
        Ok(output) if output.status.success() => None,
        Ok(output) => Some(format!(
            "{command:?}: {}\n{}{}",
            output.status,
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        )),
        Err(error) => Some(format!("{command:?}: {error}")),
    }
}

/// Runs a command that must succeed, and returns its output.
pub fn succeed(command: &mut Command) -> Output {
    match command.output() {
        Ok(output) if output.status.success() => output,
        _ => panic!("{}", failure(command).unwrap_or_default()),
    }
}

/// Returns the folder that cargo builds in.
fn target() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
        .parent()
        .expect("the target folder")
}

/// The library as C programs link it.
pub struct Library {
    /// The folder that holds the library under all its names.
    pub folder: PathBuf,
    /// The native libraries that a program needs if it links the static library.
    pub native_libraries: Vec<String>,
}

impl Library {
    /// Returns the library that `cargo test` built for the tests, with its assertions.
    pub fn get() -> &'static Self {
        static LIBRARY: OnceLock<Library> = OnceLock::new();
        // Building an example reuses the library of the tests. A plain build compiles it again, because
        // dev-dependencies can select other features of shared dependencies.
        let profile: &[&str] = if cfg!(debug_assertions) { &[] } else { &["--release"] };
        LIBRARY.get_or_init(|| Self::build("tested", target(), &[&["--example", "cloth"], profile].concat()))
    }

    /// Returns the release build, as it is delivered. It takes minutes and is for long tests.
    pub fn release() -> &'static Self {
        static LIBRARY: OnceLock<Library> = OnceLock::new();
        LIBRARY.get_or_init(|| Self::build("release", target(), &["--release", "--lib"]))
    }

    /// Returns a build with the feature `allocator` in a separate folder, with little optimization. It takes a minute.
    pub fn with_allocator() -> &'static Self {
        static LIBRARY: OnceLock<Library> = OnceLock::new();
        let target = Path::new(env!("CARGO_TARGET_TMPDIR")).join("with_allocator");
        let quick = ["lto=\"off\"", "opt-level=1", "codegen-units=16"];
        let quick = quick.map(|setting| format!("--config=profile.release.{setting}"));
        let mut options = vec!["--release", "--lib", "--features", "allocator"];
        options.extend(quick.iter().map(String::as_str));
        LIBRARY.get_or_init(|| Self::build("allocator", &target, &options))
    }

    /// The shared library.
    pub fn shared(&self) -> PathBuf {
        self.folder.join("libsinew.so")
    }

    /// The static library.
    pub fn archive(&self) -> PathBuf {
        self.folder.join("libsinew.a")
    }

    /// Builds the library with cargo. A file in `target/` can come from another build, so only cargo can decide what to
    /// rebuild.
    fn build(name: &str, target: &Path, options: &[&str]) -> Self {
        let scratch = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let output = succeed(
            cargo()
                .args(["build", "--message-format", "json", "--target-dir"])
                .arg(target)
                .args(options),
        );
        let messages = String::from_utf8_lossy(&output.stdout);
        // The crate adds no native libraries. Those of an empty crate are complete.
        let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
        let output = succeed(
            Command::new(rustc)
                .args(["--crate-type", "staticlib", "--crate-name", "nothing"])
                .args(["--print", "native-static-libs", "-o"])
                .arg(scratch.join("libnothing.a"))
                .arg("-")
                .stdin(Stdio::null()),
        );
        let text = String::from_utf8_lossy(&output.stderr);
        let native_libraries = text
            .lines()
            .find_map(|line| line.split_once("native-static-libs: "))
            .unwrap_or_else(|| panic!("rustc names the native libraries:\n{text}"))
            .1
            .split_whitespace()
            .map(str::to_owned)
            .collect();
        let folder = scratch.join("library").join(name);
        std::fs::create_dir_all(&folder).expect("the target directory can be written");
        #[cfg(unix)]
        for (name, built) in [
            ("libsinew.so", "libsinew.so"),
            (
                concat!(
                    "libsinew.so.",
                    env!("CARGO_PKG_VERSION_MAJOR"),
                    ".",
                    env!("CARGO_PKG_VERSION_MINOR")
                ),
                "libsinew.so",
            ),
            ("libsinew.a", "libsinew.a"),
        ] {
            let mut files = messages.split('"').filter(|word| word.ends_with(&format!("/{built}")));
            let file = files
                .next_back()
                .unwrap_or_else(|| panic!("cargo names {built}:\n{messages}"));
            let link = folder.join(name);
            let _ = std::fs::remove_file(&link);
            std::os::unix::fs::symlink(file, &link).expect("a link to the library");
        }
        Self {
            folder,
            native_libraries,
        }
    }
}
