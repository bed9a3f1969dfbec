//! The support vector machine that comes with the program.

use sparing_adaptive::machine::{Machine, MachineError};

/// Made by `sparing train`; the card has the command.
const MODEL: &str = include_str!("../../models/svm/default.model");
const CARD: &str = include_str!("../../models/svm/default.model.toml");

/// The machine of `--policy svm`.
pub(super) fn shipped() -> Result<Machine, MachineError> {
    Machine::from_text(MODEL, CARD)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_in_the_program_is_sound() {
        let machine = shipped().expect("the model in the program");
        assert!((1..=256).contains(&machine.vectors()));
    }
}
