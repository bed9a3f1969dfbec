//! The machine trained again on a part of the data, as small as asked for: how the sampler of 2015 was made
//! cheap.

use super::method::Examples;
use super::{PruneError, Random};
use crate::data::Data;
use crate::model::{Model, SvmType};
use crate::train::{ConstantFeatures, Parameters};

/// Trainings at most; each takes a part that should give the size asked for.
const TRIALS: usize = 5;
/// Rows for each vector wanted, at first: noisy labels make about 40 % of the rows support vectors.
const FIRST: f64 = 2.2;

/// A machine of at most `size` vectors, trained with libSVM's algorithm on a random part of the labelled rows,
/// with the model's kernel. C is the model's largest |coefficient| of each class, which is C when any vector
/// sits at its bound.
///
/// # Errors
/// The model is no C-SVC, there are no labels, one class is missing, or training fails.
pub fn retrain(model: &Model, examples: Examples<'_>, size: usize, seed: u64) -> Result<Model, PruneError> {
    let labels = examples.labels.ok_or_else(|| PruneError::NoLabels("retrain".to_owned()))?;
    if model.svm_type != SvmType::CSvc || model.labels.len() != 2 {
        return Err(PruneError::Training(format!("retraining is for c_svc, not {}", model.svm_type.name())));
    }
    let bound = |side: f64| model.coefficients[0].iter().map(|c| c * side).fold(0.0, f64::max);
    let bounds = [bound(1.0), bound(-1.0)];
    let c = bounds[0].max(bounds[1]);
    let mut parameters = Parameters::new(SvmType::CSvc, model.kernel);
    parameters.c = c;
    parameters.class_weights =
        model.labels.iter().zip(bounds).filter(|(_, b)| *b > 0.0).map(|(l, b)| (*l, b / c)).collect();
    parameters.constant_features = ConstantFeatures::Allow;
    let order = Random::stream(seed, 0x7265_7472).choose(labels.len(), labels.len());
    let first = order
        .iter()
        .position(|&i| labels[i] > 0.0)
        .ok_or_else(|| PruneError::Training(format!("no row has the label {}", model.labels[0])))?;
    let mut rows = ((size as f64 * FIRST) as usize).clamp(8, labels.len());
    let mut best: Option<Model> = None;
    for _ in 0..TRIALS {
        // The first row's class is the one of positive values, in libSVM and here.
        let chosen: Vec<usize> = std::iter::once(order[first])
            .chain(order.iter().copied().filter(|i| *i != order[first]))
            .take(rows)
            .collect();
        let trained = train(model, examples.rows, labels, &chosen, &parameters)?;
        let vectors = trained.len();
        if vectors <= size && best.as_ref().is_none_or(|b| vectors > b.len()) {
            best = Some(trained);
        }
        // Fewer rows have a larger share of support vectors: aim lower when the size was missed.
        let aim = if vectors > size { 0.93 } else { 0.99 };
        let next = (rows as f64 * size as f64 / vectors.max(1) as f64 * aim) as usize;
        let next = next.clamp(4, labels.len());
        if next == rows || (vectors <= size && vectors * 20 >= size * 19) {
            break;
        }
        rows = next;
    }
    best.ok_or_else(|| {
        PruneError::Training(format!("every part that was tried gave more than {size} vectors"))
    })
}

fn train(
    model: &Model,
    rows: &[f64],
    labels: &[f64],
    chosen: &[usize],
    parameters: &Parameters,
) -> Result<Model, PruneError> {
    let features = model.features;
    let data = Data {
        features,
        rows: chosen.iter().flat_map(|&i| rows[i * features..(i + 1) * features].iter().copied()).collect(),
        labels: chosen.iter().map(|&i| f64::from(model.labels[usize::from(labels[i] <= 0.0)])).collect(),
        weights: None,
    };
    parameters.train(&data).map_err(|e| PruneError::Training(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prune::testing::machine;
    use crate::prune::{Options, reduce, samples};

    #[test]
    fn a_part_of_the_data_gives_a_smaller_machine() {
        let model = machine(300, 3, 3.0, 5.0, 2);
        let rows = samples::queries(&model, 2000, 4);
        let mut rng = Random::stream(2, 2);
        let labels: Vec<f64> = rows
            .chunks(3)
            .map(|x| if (model.decision_value(x) > 0.0) != (rng.uniform() < 0.2) { 1.0 } else { -1.0 })
            .collect();
        let examples = Examples { rows: &rows, labels: Some(&labels) };
        let small = reduce(&model, "retrain".parse().unwrap(), 100, examples, Options { seed: 1 }).unwrap();
        assert!((50..=100).contains(&small.len()), "{}", small.len());
        assert_eq!(small.labels, model.labels);
        let same =
            rows.chunks(3).filter(|x| (small.decision_value(x) > 0.0) == (model.decision_value(x) > 0.0));
        assert!(same.count() > 1500);
    }
}
