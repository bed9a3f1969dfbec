//! The sampler of Lin and Wu, "An Attempt at Adaptive Sampling for Photorealistic Image Generation" (2015), as a
//! yardstick: one RBF machine a layer decides from eight raw features of a pixel whether it doubles its samples.
//!
//! It has no goal: how many samples a pixel gets lies in the labels that the machines were trained with.

use super::{Barrier, Decisions, Policy, doubled};
use crate::features::FeatureMatrix;
use crate::goal::Bounds;
use crate::machine::{Classifier, MachineError, parse};
use crate::paper_features::{COUNT, FILM, NAMES, features};
use sparing_image::film::{FilmOptions, Tile};
use sparing_svm::{Card, Model};
use std::path::{Path, PathBuf};

/// Samples at which the machines decide.
pub const LAYERS: [u32; 6] = [8, 16, 32, 64, 128, 256];
/// No pixel gets more.
pub const CAP: u32 = 512;
/// What smallest and largest value of a feature in the training rows become: svm-scale's default.
pub const SCALED: [f64; 2] = [-1.0, 1.0];

/// Name of a figure in the cards: the samples at which the machine decides.
pub const CARD_SAMPLES: &str = "samples";
/// Name of a figure in the cards: how many machines there are.
pub const CARD_LAYERS: &str = "layers";

/// The sampler. A pixel that a layer calls good has stopped for good.
#[derive(Clone, Debug)]
pub struct Paper {
    machines: Vec<Classifier>,
    /// The last decision value of each pixel.
    values: Vec<f32>,
    /// Decision values so far.
    pub decided: u64,
    /// Of them, those that were undefined; such a pixel goes on.
    pub undefined: u64,
}

impl Paper {
    /// From a model and its card for each of [`LAYERS`], in order.
    ///
    /// # Errors
    /// A number of models other than that; a model of another layer, other features or another scaling; as
    /// [`Classifier::new`].
    pub fn new(models: &[(Model, Card)]) -> Result<Self, MachineError> {
        let unfit = |message: String| MachineError::Unfit(message);
        if models.len() != LAYERS.len() {
            let found = models.len();
            return Err(unfit(format!("the sampler of 2015 has {} layers, here are {found}", LAYERS.len())));
        }
        let machine = |((model, card), samples): (&(Model, Card), u32)| {
            card.check_features(&NAMES)?;
            for (name, wanted) in [(CARD_LAYERS, LAYERS.len() as f64), (CARD_SAMPLES, f64::from(samples))] {
                match card.metrics.get(name) {
                    Some(found) if *found == wanted => (),
                    Some(found) => {
                        return Err(unfit(format!("its card says {name} = {found}, not {wanted}")));
                    }
                    None => return Err(unfit(format!("its card does not say {name} = {wanted}"))),
                }
            }
            if card.scaling.as_ref().is_some_and(|s| [s.lower, s.upper] != SCALED) {
                return Err(unfit(format!("its features are not scaled to {SCALED:?}")));
            }
            Classifier::new(model, card)
        };
        let machines = models.iter().zip(LAYERS).map(machine).collect::<Result<_, _>>()?;
        Ok(Self { machines, values: Vec::new(), decided: 0, undefined: 0 })
    }

    /// Reads the models of a folder and the cards beside them.
    ///
    /// # Errors
    /// As [`Model::read_with_card`] and [`Paper::new`].
    pub fn read(folder: impl AsRef<Path>) -> Result<Self, MachineError> {
        let read = |samples| Model::read_with_card(Self::path(folder.as_ref(), samples), &NAMES);
        Self::new(&LAYERS.into_iter().map(read).collect::<Result<Vec<_>, _>>()?)
    }

    /// From the texts of all models and their cards.
    ///
    /// # Errors
    /// As [`Paper::read`], but that the cards' hashes are not looked at.
    pub fn from_texts(texts: &[[&str; 2]]) -> Result<Self, MachineError> {
        let parsed = texts.iter().map(|[model, card]| parse(model, card));
        Self::new(&parsed.collect::<Result<Vec<_>, _>>()?)
    }

    /// Where the model of a layer is in its folder.
    #[must_use]
    pub fn path(folder: &Path, samples: u32) -> PathBuf {
        folder.join(format!("layer-{samples}.model"))
    }

    /// Number of support vectors of each layer.
    #[must_use]
    pub fn vectors(&self) -> Vec<usize> {
        self.machines.iter().map(Classifier::vectors).collect()
    }

    /// Decision values of rows of features at the layer of this many samples, positive for pixels that go on. Between
    /// layers the one below decides, before the first the first.
    #[must_use]
    pub fn layer(&self, samples: u32, matrix: FeatureMatrix) -> Vec<f64> {
        let layer = LAYERS.iter().rposition(|&n| n <= samples).unwrap_or(0);
        self.machines[layer].decide(matrix)
    }
}

impl Policy for Paper {
    fn name(&self) -> &'static str {
        "svm"
    }

    fn film_options(&self) -> FilmOptions {
        FILM
    }

    fn uses_exposure(&self) -> bool {
        false
    }

    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions {
        let film = barrier.film;
        let bounds = Bounds { max_spp: barrier.bounds.max_spp.min(CAP), ..barrier.bounds };
        let counts = film.map(|t, i| t.pixels[i].count());
        // Pixels that have fewer samples than others have stopped.
        let reached = counts.iter().copied().max().unwrap_or(0);
        self.values.resize(counts.len(), -1.0);
        let mut targets = counts;
        let active = |t: &Tile, i: usize| t.pixels[i].count() == reached && reached < bounds.max_spp;
        let rows = film.map(|t, i| active(t, i).then(|| features(t, i)));
        let values = rows.iter().flatten().flatten().copied().collect();
        let found = self.layer(reached, FeatureMatrix { features: COUNT, values });
        let pixels = rows.iter().enumerate().filter(|(_, row)| row.is_some()).map(|(pixel, _)| pixel);
        for (pixel, value) in pixels.zip(found) {
            self.decided += 1;
            self.undefined += u64::from(value.is_nan());
            let value = if value.is_nan() { 1.0 } else { value };
            self.values[pixel] = value.clamp(-64.0, 64.0) as f32;
            if value > 0.0 {
                targets[pixel] = doubled(reached, bounds);
            }
        }
        Decisions { targets, values: self.values.clone(), lambda: None }
    }
}
