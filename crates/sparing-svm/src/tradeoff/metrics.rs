//! How good decisions are, given the signs they should have.

use serde::Serialize;

/// Quality of a two-class machine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// Share of right decisions, 0 to 1.
    pub accuracy: f64,
    /// Mean of the shares of right decisions within each class; absent when a class is.
    pub balanced_accuracy: Option<f64>,
    /// Area under the receiver operating characteristic; absent when a class is.
    pub auc: Option<f64>,
}

/// Quality of decision values for labels whose sign counts. Both have the same length.
#[must_use]
pub fn quality(values: &[f64], labels: &[f64]) -> Quality {
    let (mut count, mut right) = ([0_usize; 2], [0_usize; 2]);
    for (value, label) in values.iter().zip(labels) {
        let class = usize::from(*label > 0.0);
        count[class] += 1;
        right[class] += usize::from((*value > 0.0) == (*label > 0.0));
    }
    let share = |class: usize| right[class] as f64 / count[class] as f64;
    let both = count[0] > 0 && count[1] > 0;
    Quality {
        accuracy: (right[0] + right[1]) as f64 / (count[0] + count[1]).max(1) as f64,
        balanced_accuracy: both.then(|| 0.5 * (share(0) + share(1))),
        auc: area_under_curve(values, labels),
    }
}

/// The chance that a random positive has a larger value than a random negative, ties counted half: the
/// statistic of Mann and Whitney (1947), as Hanley and McNeil (1982) read it. `None` when a class is missing.
#[must_use]
pub fn area_under_curve(values: &[f64], labels: &[f64]) -> Option<f64> {
    let mut order: Vec<(f64, bool)> = values.iter().zip(labels).map(|(v, l)| (*v, *l > 0.0)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut negatives, mut positives, mut sum) = (0.0, 0.0, 0.0);
    for ties in order.chunk_by(|a, b| a.0 == b.0) {
        let up = ties.iter().filter(|(_, positive)| *positive).count() as f64;
        let down = ties.len() as f64 - up;
        sum += up * (negatives + 0.5 * down);
        negatives += down;
        positives += up;
    }
    (positives > 0.0 && negatives > 0.0).then(|| sum / (positives * negatives))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        let q = quality(&[1.0, 2.0, -1.0, -3.0, 0.5], &[1.0, 1.0, -1.0, -1.0, -1.0]);
        assert_eq!(q.accuracy, 0.8);
        assert!((q.balanced_accuracy.unwrap() - (1.0 + 2.0 / 3.0) / 2.0).abs() < 1e-15);
        assert_eq!(q.auc, Some(1.0));
        assert_eq!(area_under_curve(&[1.0, 1.0], &[1.0, -1.0]), Some(0.5));
        assert_eq!(area_under_curve(&[0.0, 1.0, 2.0, 3.0], &[1.0, -1.0, 1.0, -1.0]), Some(0.25));
        assert_eq!(area_under_curve(&[1.0], &[1.0]), None);
        assert_eq!(quality(&[], &[]).accuracy, 0.0);
    }
}
