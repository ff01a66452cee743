//! How players in Python are started.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::contender::target;

/// The interpreter and a script beside this crate, if the interpreter has the module. The interpreter of an environment in
/// `target/peers/venv` goes before the one of the system.
pub fn script(name: &str, module: &str, package: &str) -> Result<Vec<PathBuf>, String> {
    let own = target().join("peers/venv/bin/python");
    let python = if own.exists() { own } else { "python3".into() };
    let found = Command::new(&python)
        .args([
            "-c",
            &format!("import importlib.util, sys; sys.exit(importlib.util.find_spec('{module}') is None)"),
        ])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .map_err(|_| "python3 is not installed")?;
    if !found.success() {
        return Err(format!("{module} is not installed (pip install {package})"));
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("players").join(name);
    Ok(vec![python, script])
}
