//! Call sequences, checked against a model: `model.rs`.
#![no_main]

mod model;

use arbitrary::Unstructured;
use libfuzzer_sys::fuzz_target;
use model::Model;

fuzz_target!(|bytes: &[u8]| {
    let mut input = Unstructured::new(bytes);
    let Ok(mut model) = Model::new(&mut input) else {
        return;
    };
    while !input.is_empty() && model.call(&mut input).is_ok() {
        assert!(!(cfg!(planted) && model.has_removed), "the planted fault");
    }
});
