//! What a machine said at the last barrier: at late ones next to nothing has changed.

use crate::pooling::Plane;
use crate::view::{Statistics, View};
use rayon::prelude::*;

/// Decision values of the last barrier with all that they depend on. Within a render, the statistics of a pixel are a function
/// of its count.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    lambda: f64,
    exposure: f32,
    counts: Vec<u32>,
    values: Vec<f64>,
}

impl Memory {
    /// The values that asking again would give, NaN for pixels that must be asked: those whose 3 by 3 pixels are not all as
    /// they were, and all if the threshold is another.
    pub(super) fn recall(&self, view: &View, lambda: f64) -> Vec<f64> {
        if (lambda, view.exposure) != (self.lambda, self.exposure) || view.pixels.len() != self.counts.len() {
            return vec![f64::NAN; view.pixels.len()];
        }
        let changed = |(now, before): (&Statistics, &u32)| if now.count == *before { 0.0 } else { 1.0 };
        let values = view.pixels.par_iter().zip(&self.counts).map(changed).collect();
        let changed = Plane { width: view.width, height: view.height, values }.dilated();
        let recall = |(value, changed): (&f64, &f32)| if *changed > 0.0 { f64::NAN } else { *value };
        self.values.par_iter().zip(&changed.values).map(recall).collect()
    }

    /// Keeps the values of a barrier, NaN for pixels that were not asked.
    pub(super) fn keep(&mut self, view: &View, lambda: f64, values: Vec<f64>) {
        self.lambda = lambda;
        self.exposure = view.exposure;
        self.counts.clear();
        self.counts.extend(view.pixels.iter().map(|p| p.count));
        self.values = values;
    }
}
