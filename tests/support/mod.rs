//! What the tests share: the library as it is delivered, how programs beside cargo are run, bodies and their motion in
//! `f64`.

#![allow(dead_code, reason = "every test takes a part of it")]

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

/// Where what the tests and benches have to tell is written.
pub fn report_folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("report")
}

/// Writes a section of `pending.md`, the list of what is not there yet; those of other tests stay.
pub fn report_pending(title: &str, lines: &[String]) {
    let folder = report_folder();
    let path = folder.join("pending.md");
    let head = format!("# {title}\n");
    let said = std::fs::read_to_string(&path).unwrap_or_default();
    let others = said
        .split_inclusive('\n')
        .scan(false, |ours, line| {
            if line.starts_with("# ") {
                *ours = line == head;
            }
            Some((!*ours).then_some(line))
        })
        .flatten();
    let text: String = others.map(str::to_owned).chain([head.clone(), "\n".into()]).collect();
    let list: String = lines.iter().map(|line| format!("- {line}\n")).collect();
    std::fs::create_dir_all(&folder).expect("a folder for reports");
    std::fs::write(&path, format!("{text}{list}\n")).expect("a report");
}

/// Says past the test harness's capture, so that it is seen, what was not tested.
pub fn skip(what: &str) {
    // In one piece, whatever other tests write.
    let _ = std::io::stderr().write_all(format!("SKIPPED: {what}\n").as_bytes());
}

/// Whether a program can be run here.
pub fn installed(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

/// cargo, in the crate's own folder.
pub fn cargo() -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(root());
    cargo
}

/// What a command says that does not succeed.
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

/// A command that must succeed; its output.
pub fn succeed(command: &mut Command) -> Output {
    match command.output() {
        Ok(output) if output.status.success() => output,
        _ => panic!("{}", failure(command).unwrap_or_default()),
    }
}

/// The folder that cargo builds in.
fn target() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
        .parent()
        .expect("the target folder")
}

/// The library as programs in C link it.
pub struct Library {
    /// The folder that holds it under all its names.
    pub folder: PathBuf,
    /// What a program linked to the static library needs beside it.
    pub native_libraries: Vec<String>,
}

impl Library {
    /// What `cargo test` built for the tests, with its assertions.
    pub fn get() -> &'static Self {
        static LIBRARY: OnceLock<Library> = OnceLock::new();
        // Of an example, cargo takes the library that the tests have; by itself it would be built again, as what only tests depend on
        // may choose other features of what the library depends on.
        let profile: &[&str] = if cfg!(debug_assertions) { &[] } else { &["--release"] };
        LIBRARY.get_or_init(|| Self::build("tested", target(), &[&["--example", "cloth"], profile].concat()))
    }

    /// The release build, as it is delivered. It takes minutes: for long tests.
    pub fn release() -> &'static Self {
        static LIBRARY: OnceLock<Library> = OnceLock::new();
        LIBRARY.get_or_init(|| Self::build("release", target(), &["--release", "--lib"]))
    }

    /// With the feature `allocator`, apart from the others, and hardly optimised: it takes a minute.
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

    /// By cargo, which knows best whether there is anything to build: what is in `target/` may be of another build.
    fn build(name: &str, target: &Path, options: &[&str]) -> Self {
        let scratch = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let output = succeed(
            cargo()
                .args(["build", "--message-format", "json", "--target-dir"])
                .arg(target)
                .args(options),
        );
        let told = String::from_utf8_lossy(&output.stdout);
        // The crate brings no native libraries of its own: they are those of a crate with nothing in it.
        let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
        let output = succeed(
            Command::new(rustc)
                .args(["--crate-type", "staticlib", "--crate-name", "nothing"])
                .args(["--print", "native-static-libs", "-o"])
                .arg(scratch.join("libnothing.a"))
                .arg("-")
                .stdin(Stdio::null()),
        );
        let said = String::from_utf8_lossy(&output.stderr);
        let native_libraries = said
            .lines()
            .find_map(|line| line.split_once("native-static-libs: "))
            .unwrap_or_else(|| panic!("rustc names the native libraries:\n{said}"))
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
            let mut files = told.split('"').filter(|word| word.ends_with(&format!("/{built}")));
            let file = files
                .next_back()
                .unwrap_or_else(|| panic!("cargo names {built}:\n{told}"));
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
