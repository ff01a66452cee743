//! A cache of numbers that take long to compute, in `target/reference`, keyed by a hash of the scene.

use std::path::{Path, PathBuf};

use xxhash_rust::xxh3::xxh3_64;

use crate::report::Report;
use crate::scene::{DURATION, SAMPLES, Scene};

/// Must be incremented if the computation of the numbers changes.
const VERSION: u8 = 2;

/// Returns the `count` cached numbers of this name for the scene, or computes and caches them. `None` if they cannot be
/// computed.
pub fn cached(
    scene: &Scene,
    name: &str,
    count: usize,
    report: &Report,
    compute: impl FnOnce() -> Option<Vec<f64>>,
) -> Option<Vec<f64>> {
    let path = path(scene, name);
    if let Some(numbers) = read(&path).filter(|numbers| numbers.len() == count) {
        return Some(numbers);
    }
    let numbers = compute()?;
    if let Err(error) = write(&path, &numbers) {
        report.progress(&format!("{} could not be cached: {error}", path.display()));
    }
    Some(numbers)
}

fn path(scene: &Scene, name: &str) -> PathBuf {
    let mut bytes = vec![VERSION];
    let mut add = |values: &[f32]| bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    scene.positions.iter().for_each(|position| add(&position.to_array()));
    add(&scene.masses);
    add(&scene.stiffnesses);
    add(&scene.rest_lengths);
    add(&scene.gravity.to_array());
    add(&[DURATION as f32, SAMPLES as f32]);
    bytes.extend(scene.springs.iter().flatten().flat_map(|node| node.to_le_bytes()));
    let file = format!("{}-{name}-{:016x}.f64", scene.name, xxh3_64(&bytes));
    Path::new(env!("CARGO_TARGET_TMPDIR"))
        .with_file_name("reference")
        .join(file)
}

fn write(path: &Path, numbers: &[f64]) -> std::io::Result<()> {
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    std::fs::create_dir_all(path.parent().unwrap_or(path))?;
    std::fs::write(path, bytes)
}

fn read(path: &Path) -> Option<Vec<f64>> {
    let bytes = std::fs::read(path).ok()?;
    let (numbers, _) = bytes.as_chunks::<8>();
    Some(numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
}
