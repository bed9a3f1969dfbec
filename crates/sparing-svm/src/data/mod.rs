//! Labelled rows: what a machine is trained on.

mod read;
mod write;

pub use read::{DataLimits, DataOptions, DataReader, SparseRow};
pub use write::DataWriter;

use crate::error::{Result, SvmError};

/// Rows of one length with a label each, dense, in f64.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Data {
    /// Features of a row.
    pub features: usize,
    /// Row by row, `labels.len() * features` values.
    pub rows: Vec<f64>,
    /// One a row: a class (a whole number in `i32`) or the value to be learned.
    pub labels: Vec<f64>,
    /// How much each row counts, positive; `None` for all alike. Not part of the file format.
    pub weights: Option<Vec<f64>>,
}

impl Data {
    /// Data from its parts.
    ///
    /// # Errors
    /// As [`Data::validate`].
    pub fn new(features: usize, rows: Vec<f64>, labels: Vec<f64>) -> Result<Self> {
        let data = Self { features, rows, labels, weights: None };
        data.validate()?;
        Ok(data)
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.labels.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.labels.is_empty()
    }

    /// Row `i`, `features` values.
    ///
    /// # Panics
    /// When there are not so many rows.
    #[must_use]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.rows[i * self.features..(i + 1) * self.features]
    }

    /// Checks the lengths, and that all values, labels and weights are finite and weights positive.
    ///
    /// # Errors
    /// [`SvmError::Data`] with the row (from 0) and the feature (from 1, as in files) of the first fault.
    pub fn validate(&self) -> Result<()> {
        if self.len().checked_mul(self.features) != Some(self.rows.len()) {
            return Err(SvmError::Data(format!(
                "{} values for {} rows of {} features",
                self.rows.len(),
                self.len(),
                self.features
            )));
        }
        if let Some(i) = self.rows.iter().position(|v| !v.is_finite()) {
            let (row, feature) = (i / self.features, i % self.features + 1);
            return Err(SvmError::Data(format!(
                "feature {feature} of row {row} is not finite: {}",
                self.rows[i]
            )));
        }
        if let Some(i) = self.labels.iter().position(|v| !v.is_finite()) {
            return Err(SvmError::Data(format!("the label of row {i} is not finite: {}", self.labels[i])));
        }
        if let Some(weights) = &self.weights {
            if weights.len() != self.len() {
                return Err(SvmError::Data(format!("{} weights for {} rows", weights.len(), self.len())));
            }
            if let Some(i) = weights.iter().position(|w| !(w.is_finite() && *w > 0.0)) {
                return Err(SvmError::Data(format!(
                    "the weight of row {i} must be positive and finite: {}",
                    weights[i]
                )));
            }
        }
        Ok(())
    }

    /// The rows with these numbers, in this order; a number may occur more than once.
    ///
    /// # Panics
    /// When there are not so many rows.
    #[must_use]
    pub fn select(&self, numbers: &[usize]) -> Self {
        Self {
            features: self.features,
            rows: numbers.iter().flat_map(|&i| self.row(i)).copied().collect(),
            labels: numbers.iter().map(|&i| self.labels[i]).collect(),
            weights: self.weights.as_ref().map(|weights| numbers.iter().map(|&i| weights[i]).collect()),
        }
    }
}
