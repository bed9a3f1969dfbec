//! How good predictions are.

use std::collections::BTreeMap;

/// Figures of predictions against labels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scores {
    /// Classification, and one-class machines against labels +1 and -1.
    Classes {
        /// Share of rows with the right class, 0 to 1.
        accuracy: f64,
        /// Mean over classes of the share that is right: 0.5 for a coin with two classes, however unequal
        /// they are.
        balanced_accuracy: f64,
        /// Area under the receiver operating characteristic, 0 to 1: two classes only, the larger label is
        /// positive.
        auc: Option<f64>,
    },
    /// Regression.
    Values {
        /// Mean squared error.
        mean_squared_error: f64,
        /// Share of the labels' variance that is explained, at most 1; NaN if the labels have none.
        r_squared: f64,
    },
}

impl Scores {
    /// Of classes. `values` grow with the confidence in the larger label; empty where there is no such order.
    #[must_use]
    pub(super) fn of_classes(labels: &[f64], predictions: &[f64], values: &[f64]) -> Self {
        let mut classes: BTreeMap<i64, (usize, usize)> = BTreeMap::new();
        for (label, prediction) in labels.iter().zip(predictions) {
            let entry = classes.entry(*label as i64).or_default();
            entry.0 += usize::from(label == prediction);
            entry.1 += 1;
        }
        let right: usize = classes.values().map(|c| c.0).sum();
        let shares = classes.values().map(|c| c.0 as f64 / c.1 as f64);
        let balanced_accuracy = shares.sum::<f64>() / classes.len() as f64;
        let auc = match (classes.len(), classes.last_key_value()) {
            (2, Some((&positive, _))) if values.len() == labels.len() => Some(auc(labels, values, positive)),
            _ => None,
        };
        Self::Classes { accuracy: right as f64 / labels.len() as f64, balanced_accuracy, auc }
    }

    /// Of values.
    #[must_use]
    pub(super) fn of_values(labels: &[f64], predictions: &[f64]) -> Self {
        let n = labels.len() as f64;
        let mean = labels.iter().sum::<f64>() / n;
        let error: f64 = labels.iter().zip(predictions).map(|(l, p)| (l - p) * (l - p)).sum();
        let spread: f64 = labels.iter().map(|l| (l - mean) * (l - mean)).sum();
        Self::Values { mean_squared_error: error / n, r_squared: 1.0 - error / spread }
    }

    /// What a search maximises: the accuracy, or the negative mean squared error.
    #[must_use]
    pub fn merit(&self) -> f64 {
        match *self {
            Self::Classes { accuracy, .. } => accuracy,
            Self::Values { mean_squared_error, .. } => -mean_squared_error,
        }
    }
}

/// The share of pairs of a positive and a negative row that are in the right order; ties count half (the
/// statistic of Mann and Whitney 1947 over the number of pairs).
fn auc(labels: &[f64], values: &[f64], positive: i64) -> f64 {
    let mut order: Vec<usize> = (0..labels.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let (mut pairs, mut negatives, mut positives, mut i) = (0.0, 0.0, 0.0, 0);
    while i < order.len() {
        let (mut tied_negatives, mut tied_positives) = (0.0, 0.0);
        let value = values[order[i]];
        while i < order.len() && values[order[i]] == value {
            if labels[order[i]] as i64 == positive {
                tied_positives += 1.0;
            } else {
                tied_negatives += 1.0;
            }
            i += 1;
        }
        pairs += tied_positives * (negatives + 0.5 * tied_negatives);
        negatives += tied_negatives;
        positives += tied_positives;
    }
    pairs / (negatives * positives)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_scores() {
        let labels = [1.0, 1.0, 1.0, -1.0];
        let Scores::Classes { accuracy, balanced_accuracy, auc } =
            Scores::of_classes(&labels, &[1.0; 4], &[0.9, 0.5, 0.1, 0.1])
        else {
            panic!("classes")
        };
        assert_eq!((accuracy, balanced_accuracy), (0.75, 0.5));
        // Of three pairs two are right and one is a tie.
        assert!((auc.unwrap() - 2.5 / 3.0).abs() < 1e-15);
        let scores = Scores::of_values(&[0.0, 2.0], &[1.0, 1.0]);
        assert_eq!(scores, Scores::Values { mean_squared_error: 1.0, r_squared: 0.0 });
    }
}
