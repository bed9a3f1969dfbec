//! Data files: an error or rows that read back the same from what is written.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sparing_svm::Data;
use sparing_svm::data::{DataLimits, DataOptions, DataReader};

fuzz_target!(|bytes: &[u8]| {
    let limits = DataLimits { rows: 10_000, features: 10_000, values: 100_000 };
    let options = DataOptions { features: None, limits };
    let streamed: Result<Vec<_>, _> = DataReader::new(bytes, "fuzz", &options).collect();
    let Ok(data) = Data::read_from(bytes, "fuzz", &options) else { return };
    assert_eq!(streamed.expect("the same lines").len(), data.len());
    let text = data.to_text().expect("what was read can be written");
    let again = Data::read_from(text.as_bytes(), "again", &options).expect("what was written can be read");
    assert_eq!(again, data);
    assert_eq!(again.to_text().expect("valid"), text);
});
