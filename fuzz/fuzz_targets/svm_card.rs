//! Model cards: an error or a card that reads back the same from what is written.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sparing_svm::Card;

fuzz_target!(|text: &str| {
    let Ok(card) = Card::from_text(text, "fuzz") else { return };
    let written = card.to_text().expect("what was read can be written");
    let again = Card::from_text(&written, "again").expect("what was written can be read");
    assert_eq!(again, card);
    assert_eq!(again.to_text().expect("valid"), written);
    let _ = card.check_features(&["mean"]);
    let _ = card.scaling();
});
