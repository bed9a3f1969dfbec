//! Cross-validation: every row is predicted by a machine that was trained without its fold.

use rayon::prelude::*;

use super::control::Counter;
use super::{ConstantFeatures, Control, Folds, Parameters, Scores};
use crate::data::Data;
use crate::error::{Result, SvmError};
use crate::model::SvmType;

/// What the held-out rows say.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossValidation {
    /// One a row: the class or value predicted without having seen its fold.
    pub predictions: Vec<f64>,
    /// One a row, growing with the confidence in the larger label, or in +1 of a one-class machine; empty for
    /// more than two classes and for regression.
    pub values: Vec<f64>,
    /// The figures of all rows together.
    pub scores: Scores,
    /// Support vectors, the mean over the folds.
    pub support_vectors: f64,
}

/// The held-out part of one fold.
pub(super) struct FoldResult {
    rows: Vec<usize>,
    predictions: Vec<f64>,
    values: Vec<f64>,
    support_vectors: usize,
}

/// Cross-validates, folds in parallel. The result does not depend on the number of threads.
///
/// # Errors
/// As [`Parameters::train`], for the whole data or for what a fold leaves (a fold can take a class away);
/// [`SvmError::TimeLimit`] when the deadline came first.
pub fn cross_validate(
    parameters: &Parameters,
    data: &Data,
    folds: &Folds,
    control: &Control<'_>,
) -> Result<CrossValidation> {
    check(parameters, data, folds)?;
    let counter = Counter::new(control, folds.count());
    let results: Vec<Option<Result<FoldResult>>> = (0..folds.count())
        .into_par_iter()
        .map(|fold| counter.run(|| run_fold(parameters, data, folds, fold)))
        .collect();
    let missing: Vec<String> =
        results.iter().enumerate().filter(|(_, r)| r.is_none()).map(|(fold, _)| fold.to_string()).collect();
    if !missing.is_empty() {
        return Err(SvmError::TimeLimit {
            done: folds.count() - missing.len(),
            total: folds.count(),
            missing: format!("folds {}", missing.join(", ")),
        });
    }
    combine(parameters, data, results.into_iter().flatten().collect::<Result<Vec<_>>>()?)
}

pub(super) fn check(parameters: &Parameters, data: &Data, folds: &Folds) -> Result<()> {
    parameters.check(data)?;
    if folds.of_row().len() != data.len() {
        return Err(SvmError::Data(format!(
            "folds of {} rows for {} rows",
            folds.of_row().len(),
            data.len()
        )));
    }
    Ok(())
}

/// Trains without a fold and predicts it.
pub(super) fn run_fold(
    parameters: &Parameters,
    data: &Data,
    folds: &Folds,
    fold: usize,
) -> Result<FoldResult> {
    let (train, rows) = folds.split(fold);
    // The whole data were checked; what is constant in a part of them is no mistake.
    let parameters = Parameters { constant_features: ConstantFeatures::Allow, ..parameters.clone() };
    let model = parameters.train(&data.select(&train)).map_err(|error| match error {
        SvmError::Data(message) => SvmError::Data(format!("without fold {fold}: {message}")),
        other => other,
    })?;
    let mut out = vec![0.0; model.machines()];
    let sign = if model.labels.len() == 2 && model.labels[0] < model.labels[1] { -1.0 } else { 1.0 };
    let ordered = model.svm_type == SvmType::OneClass || model.labels.len() == 2;
    let mut result = FoldResult {
        rows: Vec::new(),
        predictions: Vec::with_capacity(rows.len()),
        values: Vec::new(),
        support_vectors: model.len(),
    };
    for &row in &rows {
        model.decision_values(data.row(row), &mut out);
        result.predictions.push(model.prediction(&out));
        if ordered {
            result.values.push(sign * out[0]);
        }
    }
    result.rows = rows;
    Ok(result)
}

/// Puts the folds together.
pub(super) fn combine(
    parameters: &Parameters,
    data: &Data,
    folds: Vec<FoldResult>,
) -> Result<CrossValidation> {
    let mut predictions = vec![0.0; data.len()];
    let ordered = folds.iter().all(|fold| fold.values.len() == fold.rows.len());
    let mut values = vec![0.0; if ordered { data.len() } else { 0 }];
    let mut support_vectors = 0.0;
    let count = folds.len() as f64;
    for fold in folds {
        for (k, &row) in fold.rows.iter().enumerate() {
            predictions[row] = fold.predictions[k];
            if ordered {
                values[row] = fold.values[k];
            }
        }
        support_vectors += fold.support_vectors as f64 / count;
    }
    let scores = match parameters.svm_type {
        SvmType::EpsilonSvr | SvmType::NuSvr => Scores::of_values(&data.labels, &predictions),
        _ => Scores::of_classes(&data.labels, &predictions, &values),
    };
    Ok(CrossValidation { predictions, values, scores, support_vectors })
}
