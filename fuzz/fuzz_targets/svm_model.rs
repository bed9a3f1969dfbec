//! Model files: an error or a model that is valid, reads back the same from what is written, and can be
//! evaluated.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sparing_svm::Model;
use sparing_svm::model::{ModelLimits, ReadOptions};

fuzz_target!(|bytes: &[u8]| {
    let limits = ModelLimits { vectors: 10_000, features: 10_000, classes: 50, values: 100_000 };
    let options = ReadOptions { features: None, limits };
    let Ok(model) = Model::read_from(bytes, "fuzz", &options) else { return };
    model.validate().expect("what was read is valid");
    let text = model.to_text().expect("what was read can be written");
    let again = Model::read_from(text.as_bytes(), "again", &options).expect("what was written can be read");
    assert_eq!(again, model);
    assert_eq!(again.to_text().expect("valid"), text);
    let mut values = vec![0.0; model.machines()];
    model.decision_values(&vec![0.5; model.features], &mut values);
    let _ = model.prediction(&values);
});
