//! The measuring process's side of the [`protocol`](crate::protocol): the contenders and how to start them.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde::de::DeserializeOwned;

use crate::cloth::Cloth;
use crate::protocol::{Hello, Report, Steps};

/// An engine with a number of threads.
#[derive(Clone, Debug)]
pub struct Contender {
    pub name: &'static str,
    pub threads: usize,
    /// The program and its first arguments.
    command: Vec<PathBuf>,
}

/// A contender's process with its cloth.
pub struct Running {
    pub version: String,
    process: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
}

/// All contenders; compiles those that need it. An error is the reason that a contender is not available.
pub fn all() -> Vec<Result<Contender, String>> {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let this = std::env::current_exe().expect("the path of this program");
    let rust_command = |engine: &str| vec![this.clone(), "child".into(), engine.into()];
    let python_command = |script: &str| vec!["python3".into(), crate_folder.join(script)];
    let contender = |name, threads, command| Contender { name, threads, command };
    let mut contenders = Vec::new();
    for threads in [1, 2] {
        contenders.push(Ok(contender("sinew", threads, rust_command("sinew"))));
    }
    for threads in [1, 2] {
        contenders.push(Ok(contender("Taichi", threads, python_command("taichi_cloth.py"))));
    }
    contenders.push(Ok(contender("Warp", 1, python_command("warp_cloth.py"))));
    for threads in [1, 2] {
        contenders.push(Ok(contender("Rapier", threads, rust_command("rapier"))));
    }
    contenders.push(
        match compile_bullet(&crate_folder.join("bullet_cloth.cpp"), "bullet_cloth") {
            Ok(program) => Ok(contender("Bullet", 1, vec![program])),
            Err(reason) => Err(format!("Bullet: {reason}")),
        },
    );
    contenders
}

/// The folder of all output.
pub fn target() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target")
}

/// Compiles a program against Bullet, if it is installed.
pub fn compile_bullet(source: &Path, name: &str) -> Result<PathBuf, String> {
    let flags = Command::new("pkg-config")
        .args(["--cflags", "--libs", "bullet"])
        .output()
        .map_err(|_| "pkg-config is not installed (apt-get install pkg-config)")?;
    if !flags.status.success() {
        return Err("libbullet-dev is not installed (apt-get install libbullet-dev)".into());
    }
    let flags = String::from_utf8_lossy(&flags.stdout);
    let folder = target().join("peers");
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let folder = folder
        .canonicalize()
        .map_err(|error| format!("{}: {error}", folder.display()))?;
    let program = folder.join(name);
    let compiled = Command::new("g++")
        .args(["-std=c++17", "-O3", "-DNDEBUG"])
        .arg(source)
        .arg("-o")
        .arg(&program)
        .args(flags.split_whitespace())
        .status()
        .map_err(|_| "g++ is not installed (apt-get install g++)")?;
    match compiled.success() {
        true => Ok(program),
        false => Err(format!("{} does not compile here", source.display())),
    }
}

impl Contender {
    /// Starts a process and waits until it has built the cloth, or returns the reason of a failure.
    pub fn start(&self, cloth: &Cloth) -> Result<Running, String> {
        let mut process = Command::new(&self.command[0])
            .args(&self.command[1..])
            .arg(self.threads.to_string())
            .args(cloth.arguments())
            // No files beside the scripts or in the user's caches, and no requests to servers.
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .env("XDG_CACHE_HOME", target().join("peers/cache"))
            .env("TI_SKIP_VERSION_CHECK", "ON")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| format!("{}: {error}", self.command[0].display()))?;
        let input = process.stdin.take();
        let output = BufReader::new(process.stdout.take().expect("piped"));
        let mut running = Running {
            version: String::new(),
            process,
            input,
            output,
        };
        let hello: Hello = running.answer()?;
        match hello.refused {
            Some(reason) => Err(reason),
            None => {
                running.version = hello.version.unwrap_or_default();
                Ok(running)
            }
        }
    }
}

impl Running {
    /// Takes `count` steps and returns their times [ms].
    pub fn steps(&mut self, count: usize) -> Result<Vec<f64>, String> {
        self.ask(&format!("steps {count}"))?;
        self.answer().map(|steps: Steps| steps.milliseconds)
    }

    /// The current state of the cloth.
    pub fn report(&mut self) -> Result<Report, String> {
        self.ask("report")?;
        self.answer()
    }

    fn ask(&mut self, question: &str) -> Result<(), String> {
        let input = self.input.as_mut().expect("open until dropped");
        writeln!(input, "{question}").map_err(|error| error.to_string())
    }

    fn answer<T: DeserializeOwned>(&mut self) -> Result<T, String> {
        let mut line = String::new();
        self.output.read_line(&mut line).map_err(|error| error.to_string())?;
        if line.is_empty() {
            return Err("its process ended without an answer".into());
        }
        serde_json::from_str(&line).map_err(|error| format!("{error} in {line}"))
    }
}

impl Drop for Running {
    /// A contender exits when its input ends.
    fn drop(&mut self) {
        self.input = None;
        if let Err(error) = self.process.wait() {
            eprintln!("a contender did not end: {error}");
        }
    }
}
