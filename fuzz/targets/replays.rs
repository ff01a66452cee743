//! Call sequences, recorded and replayed with equal state hashes. The planted fault changes the last bit of a recorded
//! step duration; the replay must report that step.
#![no_main]

mod model;

use std::fs;
use std::path::{Path, PathBuf};

use arbitrary::Unstructured;
use libfuzzer_sys::fuzz_target;
use model::Model;
use sinew::{ReplayReport, World};

/// Sizes in bytes: the file header, and the parts of a step's frame before and after the state difference.
const HEAD: usize = 12;
const BEGIN: usize = 25;
const END: usize = 10;

/// The byte offset of a step's `dt` in the recording.
fn dt_at(bytes: &[u8], step: u64) -> usize {
    let mut at = HEAD;
    for _ in 1..step {
        let length = bytes[at + BEGIN - 8..].first_chunk().copied().map(u64::from_le_bytes);
        at += BEGIN + length.expect("a length") as usize + END;
    }
    at + 1
}

/// Changes the step duration, and panics if the replay finds the change, as it should.
fn plant(path: &Path, step: u64) {
    let mut bytes = fs::read(path).expect("the file");
    let dt = dt_at(&bytes, step);
    bytes[dt] ^= 1;
    fs::write(path, bytes).expect("a file");
    let report = World::replay(path, 1).expect("a replay");
    // The hash stays equal if the step is refused or nothing moves.
    if let Some(difference) = report.difference {
        assert_eq!(
            (report.steps, difference.step),
            (step - 1, step),
            "found at another step"
        );
        panic!("the planted fault");
    }
}

fn path() -> PathBuf {
    std::env::temp_dir().join(format!("{}.recording", std::process::id()))
}

fuzz_target!(|bytes: &[u8]| {
    let mut input = Unstructured::new(bytes);
    let Ok(mut model) = Model::new(&mut input) else {
        return;
    };
    let path = path();
    model.world.start_recording(&path).expect("a file");
    while !input.is_empty() && model.call(&mut input).is_ok() {}
    let steps = model.world.stop_recording().expect("a recording");
    for thread_count in [1, 2] {
        let expected = ReplayReport {
            steps,
            ..ReplayReport::default()
        };
        assert_eq!(World::replay(&path, thread_count), Ok(expected));
    }
    if cfg!(planted) && steps > 0 {
        plant(&path, steps.div_ceil(2));
    }
});
