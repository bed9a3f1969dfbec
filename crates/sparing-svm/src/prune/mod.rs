//! Fewer support vectors: what a decision does not need, left out.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`simplify`] | changes nothing but rounding: duplicates merged, zeros dropped, linear machines collapsed |
//! | [`select`] | which vectors to keep: by coefficient, at random, k-means, greedily in the kernel's Hilbert space |
//! | [`refit`] | their new coefficients: projection in the Hilbert space, ridge fit to decisions, fit to labels |
//! | [`retrain`] | the machine trained again on a part of the data |
//! | [`certified`] | a cascade of reduced machines whose every sign is the full machine's |
//!
//! [`reduce`] runs one [`Method`] on a model. The result is again a libSVM model.

pub mod certified;
mod dense;
pub mod refit;
pub mod retrain;
pub mod samples;
pub mod select;
pub mod simplify;

mod error;
mod machine;
mod method;

pub use error::PruneError;
pub use method::{Examples, Method, Options, Refit, Select, Sweep, reduce};

pub(crate) use crate::random::Random;
pub(crate) use machine::Machine;

use crate::model::{Kernel, Model, SvmType};

/// Whether the model has the one machine, the shape and the finite numbers that pruning needs.
pub(crate) fn check(model: &Model) -> Result<(), PruneError> {
    if model.machines() != 1 || model.coefficients.len() != 1 {
        return Err(PruneError::Machines(model.machines()));
    }
    if matches!(model.svm_type, SvmType::EpsilonSvr | SvmType::NuSvr) {
        return Err(PruneError::Regression);
    }
    if model.svm_type.is_classifier() && model.labels.len() != 2 {
        return Err(PruneError::Machines(model.machines()));
    }
    let numbers = || {
        let all = model.coefficients[0].iter().chain(&model.rho).chain(&model.support_vectors);
        all.copied().all(f64::is_finite)
    };
    if model.features == 0 || model.support_vectors.len() != model.len() * model.features || !numbers() {
        return Err(PruneError::Invalid);
    }
    if model.is_empty() {
        return Err(PruneError::Empty);
    }
    Ok(())
}

/// Whether the kernel is an inner product of some Hilbert space (for all inputs).
pub(crate) fn check_positive_definite(kernel: Kernel) -> Result<(), PruneError> {
    match kernel {
        Kernel::Rbf { gamma } if gamma >= 0.0 => Ok(()),
        Kernel::Linear => Ok(()),
        Kernel::Polynomial { gamma, coef0, .. } if gamma >= 0.0 && coef0 >= 0.0 => Ok(()),
        _ => Err(PruneError::NotPositiveDefinite(kernel.name())),
    }
}

/// A model of the same kind with other vectors, coefficients and threshold: sorted by class as libSVM wants it,
/// without zero coefficients. Platt's probabilities no longer fit and are dropped.
pub(crate) fn with_vectors(model: &Model, vectors: &[f64], coefficients: &[f64], rho: f64) -> Model {
    let features = model.features;
    let mut order: Vec<usize> = (0..coefficients.len()).filter(|&i| coefficients[i] != 0.0).collect();
    let classifier = model.svm_type.is_classifier();
    if classifier {
        order.sort_by_key(|&i| coefficients[i] < 0.0); // stable: the order inside a class stays
    }
    let positive = order.iter().filter(|&&i| coefficients[i] > 0.0).count();
    Model {
        class_counts: if classifier { vec![positive, order.len() - positive] } else { Vec::new() },
        rho: vec![rho],
        prob_a: Vec::new(),
        prob_b: Vec::new(),
        prob_density_marks: Vec::new(),
        support_vectors: order
            .iter()
            .flat_map(|&i| vectors[i * features..(i + 1) * features].iter().copied())
            .collect(),
        coefficients: vec![order.iter().map(|&i| coefficients[i]).collect()],
        labels: model.labels.clone(),
        ..*model
    }
}

#[cfg(test)]
pub(crate) mod testing {
    //! Machines for tests, made from nothing but a seed.

    use super::Random;
    use crate::model::{Kernel, Model, SvmType};

    /// A two-class RBF machine of `n` vectors in the unit box: labels are noisy, so most coefficients sit at
    /// `c`.
    pub(crate) fn machine(n: usize, features: usize, gamma: f64, c: f64, seed: u64) -> Model {
        let mut rng = Random::stream(seed, 1);
        let mut rows: Vec<(f64, Vec<f64>)> = (0..n)
            .map(|_| {
                let x: Vec<f64> = (0..features).map(|_| rng.uniform()).collect();
                let truth = x[0] + 0.5 * (6.0 * x[features - 1]).sin() - 0.6;
                let flipped = rng.uniform() < 0.25;
                let sign = if (truth > 0.0) != flipped { 1.0 } else { -1.0 };
                let size = if rng.uniform() < 0.8 { c } else { c * rng.uniform() };
                (sign * size, x)
            })
            .collect();
        rows.sort_by_key(|(a, _)| *a < 0.0);
        let positive = rows.iter().filter(|(a, _)| *a > 0.0).count();
        let mut model = Model {
            svm_type: SvmType::CSvc,
            kernel: Kernel::Rbf { gamma },
            labels: vec![1, -1],
            class_counts: vec![positive, n - positive],
            rho: vec![0.0],
            prob_a: Vec::new(),
            prob_b: Vec::new(),
            prob_density_marks: Vec::new(),
            features,
            support_vectors: rows.iter().flat_map(|(_, x)| x.iter().copied()).collect(),
            coefficients: vec![rows.iter().map(|(a, _)| *a).collect()],
        };
        // The median decision value becomes 0, so that both signs occur.
        let mut values: Vec<f64> =
            (0..200.min(n)).map(|i| model.decision_value(model.support_vector(i * n / 200.min(n)))).collect();
        values.sort_by(f64::total_cmp);
        model.rho[0] = values[values.len() / 2];
        model
    }
}
