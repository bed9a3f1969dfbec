//! A machine ready for many queries: the one place where pruning and the trade-off meet the evaluator.

use super::PruneError;
use crate::evaluator::Evaluator;
use crate::model::Model;
use rayon::prelude::*;

/// A compiled machine with one decision value a query.
#[derive(Debug)]
pub(crate) struct Machine(Evaluator);

impl Machine {
    pub(crate) fn new(model: &Model) -> Result<Self, PruneError> {
        Evaluator::new(model).map(Self).map_err(|e| PruneError::Evaluator(e.to_string()))
    }

    /// Memory that an evaluation in f32 reads.
    pub(crate) fn bytes(&self) -> usize {
        self.0.bytes()
    }

    pub(crate) fn features(&self) -> usize {
        self.0.features()
    }

    pub(crate) fn decision_values(&self, queries: &[f64], out: &mut [f64]) {
        self.0.decision_values(queries, out);
    }

    /// Values, each with a proven bound of its distance from [`Model::decision_value`].
    pub(crate) fn decision_values_with_bounds(&self, queries: &[f64], out: &mut [f64], bounds: &mut [f64]) {
        self.0.decision_values_with_bounds(queries, out, bounds);
    }

    /// Values whose signs are those of [`Model::decision_value`].
    pub(crate) fn decide(&self, queries: &[f64], out: &mut [f64]) {
        self.0.decide(queries, out);
    }

    /// Decision values of many queries with all threads; chunks do not change the bits.
    pub(crate) fn all_values(&self, queries: &[f64]) -> Vec<f64> {
        let features = self.features();
        let mut out = vec![0.0; queries.len() / features];
        out.par_chunks_mut(512)
            .zip(queries.par_chunks(512 * features))
            .for_each(|(out, queries)| self.decision_values(queries, out));
        out
    }
}
