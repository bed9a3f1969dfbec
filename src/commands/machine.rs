//! The support vector machines that come with the program.

use sparing_adaptive::machine::{Machine, MachineError};
use sparing_adaptive::policy::Paper;
use sparing_adaptive::policy::paper::LAYERS;

/// Made by `sparing train`; the card has the command.
const MODEL: &str = include_str!("../../models/svm/default.model");
const CARD: &str = include_str!("../../models/svm/default.model.toml");

/// The machine of `--policy svm`.
pub(super) fn shipped() -> Result<Machine, MachineError> {
    Machine::from_text(MODEL, CARD)
}

/// Model and card of a layer.
macro_rules! layer {
    ($name:literal) => {
        [
            include_str!(concat!("../../models/svm/paper/", $name, ".model")),
            include_str!(concat!("../../models/svm/paper/", $name, ".model.toml")),
        ]
    };
}

/// What `sparing train --label paper` made; the cards have the command.
const TEXTS: [[&str; 2]; LAYERS.len()] = [
    layer!("layer-8"),
    layer!("layer-16"),
    layer!("layer-32"),
    layer!("layer-64"),
    layer!("layer-128"),
    layer!("layer-256"),
];

/// The machines of `--policy svm --model paper`, the sampler of Lin and Wu (2015).
pub(super) fn shipped_paper() -> Result<Paper, MachineError> {
    Paper::from_texts(&TEXTS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_in_the_program_is_sound() {
        let machine = shipped().expect("the model in the program");
        assert!((1..=256).contains(&machine.classifier().vectors()));
    }

    #[test]
    fn the_models_of_2015_are_sound() {
        let paper = shipped_paper().expect("the models in the program");
        assert!(paper.vectors().iter().all(|n| *n > 100));
    }
}
