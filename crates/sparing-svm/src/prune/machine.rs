//! A machine ready for many queries: the one place where pruning and the trade-off meet the evaluator.

use super::PruneError;
use super::certified::rounding;
use crate::model::Model;
use rayon::prelude::*;

/// Stand-in: decision values in f64.
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    model: Model,
}

impl Machine {
    pub(crate) fn new(model: &Model) -> Result<Self, PruneError> {
        Ok(Self { model: model.clone() })
    }

    /// Memory of the compiled machine.
    pub(crate) fn bytes(&self) -> usize {
        8 * self.model.len() * (self.model.features + 1)
    }

    pub(crate) fn features(&self) -> usize {
        self.model.features
    }

    pub(crate) fn decision_values(&self, queries: &[f64], out: &mut [f64]) {
        for (query, out) in queries.chunks_exact(self.model.features).zip(out) {
            *out = self.model.decision_value(query);
        }
    }

    /// Values, each with a proven bound of its distance from the machine's exact value in real arithmetic.
    pub(crate) fn decision_values_with_bounds(&self, queries: &[f64], out: &mut [f64], bounds: &mut [f64]) {
        self.decision_values(queries, out);
        bounds.fill(rounding::decision(&self.model));
    }

    /// Values whose signs are those of [`Model::decision_value`].
    pub(crate) fn decide(&self, queries: &[f64], out: &mut [f64]) {
        self.decision_values(queries, out);
    }

    /// Decision values of many queries with all threads; chunks do not change the bits.
    pub(crate) fn all_values(&self, queries: &[f64]) -> Vec<f64> {
        let features = self.features();
        let mut out = vec![0.0; queries.len() / features];
        out.par_chunks_mut(256)
            .zip(queries.par_chunks(256 * features))
            .for_each(|(out, queries)| self.decision_values(queries, out));
        out
    }
}
