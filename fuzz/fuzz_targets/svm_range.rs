//! Range files: an error or a scaling that reads back the same from what is written. The first byte may say
//! how many features there are.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sparing_svm::Scaling;

fuzz_target!(|input: (Option<u8>, &[u8])| {
    let features = input.0.map(usize::from);
    let Ok(scaling) = Scaling::read_from(input.1, "fuzz", features) else { return };
    scaling.validate().expect("what was read is valid");
    let text = scaling.to_text().expect("what was read can be written");
    let count = Some(scaling.features.len());
    let again = Scaling::read_from(text.as_bytes(), "again", count).expect("what was written can be read");
    assert_eq!(again, scaling);
    assert_eq!(again.to_text().expect("valid"), text);
    scaling.apply(&mut vec![0.5; scaling.features.len()]).expect("as many features");
});
