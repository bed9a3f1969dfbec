//! Weights of rows for a trainer that has none: rows are drawn in proportion to their weight.

use crate::data::Data;
use crate::error::{Result, SvmError};
use crate::random::Random;

impl Data {
    /// `rows` rows drawn in proportion to the weights by systematic sampling (one random offset, equal
    /// steps): a row of weight `w` occurs `rows w / sum` times, rounded down or up, and its expected count is
    /// exact. Rows stay in their order; the result has no weights. Without weights all rows count alike.
    ///
    /// # Errors
    /// The data are not valid or have no row.
    pub fn resampled(&self, rows: usize, seed: u64) -> Result<Self> {
        self.validate()?;
        if self.is_empty() {
            return Err(SvmError::Data("there is no row".to_owned()));
        }
        let weight = |i: usize| self.weights.as_ref().map_or(1.0, |weights| weights[i]);
        let sum: f64 = (0..self.len()).map(weight).sum();
        if !sum.is_finite() {
            return Err(SvmError::Data("the weights add up to more than a double can hold".to_owned()));
        }
        let (offset, step) = (Random::new(seed).uniform(), sum / rows as f64);
        let (mut numbers, mut reached, mut i) = (Vec::with_capacity(rows), weight(0), 0);
        for k in 0..rows {
            let target = (k as f64 + offset) * step;
            // The last row takes what rounding leaves.
            while reached <= target && i + 1 < self.len() {
                i += 1;
                reached += weight(i);
            }
            numbers.push(i);
        }
        let mut data = self.select(&numbers);
        data.weights = None;
        Ok(data)
    }
}
