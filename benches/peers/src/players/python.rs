//! The command of players in Python.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::contender::target;

/// Returns the interpreter and a script of this crate, if the module is installed. An environment in
/// `target/peers/venv` takes precedence over the system's interpreter.
pub fn script(name: &str, module: &str, package: &str) -> Result<Vec<PathBuf>, String> {
    let own = target().join("peers/venv/bin/python");
    let python = if own.exists() { own } else { "python3".into() };
    let check = Command::new(&python)
        .args([
            "-c",
            &format!("import importlib.util, sys; sys.exit(importlib.util.find_spec('{module}') is None)"),
        ])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .map_err(|_| "python3 is not installed")?;
    if !check.success() {
        return Err(format!("{module} is not installed (pip install {package})"));
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("players").join(name);
    Ok(vec![python, script])
}
