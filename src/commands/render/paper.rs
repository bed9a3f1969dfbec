//! `--model paper`: the sampler of Lin and Wu (2015).

use super::RenderArguments;
use crate::commands::Usage;
use sparing_adaptive::machine::MachineError;
use sparing_adaptive::policy::Paper;
use sparing_adaptive::policy::paper::{CAP, LAYERS};

/// Model and card of a layer.
macro_rules! layer {
    ($name:literal) => {
        [
            include_str!(concat!("../../../models/svm/paper/", $name, ".model")),
            include_str!(concat!("../../../models/svm/paper/", $name, ".model.toml")),
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

/// The models in the program.
pub(super) fn in_the_program() -> Result<Paper, MachineError> {
    Paper::from_texts(&TEXTS)
}

/// Refuses options that the sampler has no use for, and samples that it has no machines for.
pub(super) fn check(a: &RenderArguments, min_spp: u32, max_spp: u32) -> anyhow::Result<()> {
    let goal = [a.tolerance.map(|_| "tolerance"), a.spp.map(|_| "spp")];
    if let Some(option) = goal.into_iter().flatten().next() {
        return Err(Usage::error(format!("--{option}: the sampler of 2015 has no goal to set")));
    }
    if !LAYERS.contains(&min_spp) || max_spp > CAP {
        return Err(Usage::error(format!(
            "the sampler of 2015 begins at 8, 16, 32, 64, 128 or 256 samples and ends at {CAP}: not {min_spp} to {max_spp}"
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_models_in_the_program_are_sound() {
        let paper = in_the_program().expect("the models in the program");
        assert!(paper.vectors().iter().all(|n| *n > 100));
    }
}
