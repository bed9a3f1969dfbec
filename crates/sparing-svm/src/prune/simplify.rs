//! Simplifications that keep the function: only the rounding of f64 sums changes.
//!
//! What looks exact and is not: a feature that is constant in all support vectors of an RBF machine cannot be
//! left out, since a query that differs there is further from every vector: it multiplies each kernel value by
//! `exp(-gamma (x - c)^2)`. For kernels of the inner product, a feature that is zero in all vectors has no
//! effect on any finite query; the evaluator leaves it out when it compiles the machine, and the model keeps
//! its number of features.

use super::{PruneError, check, with_vectors};
use crate::model::{Kernel, Model};
use std::collections::HashMap;

/// What [`simplify`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Simplification {
    /// Vectors merged into an equal one.
    pub merged: usize,
    /// Vectors dropped because their coefficient was, or had become, zero.
    pub dropped: usize,
    /// Whether a linear machine became one weight vector.
    pub collapsed: bool,
}

/// The same machine with duplicate vectors merged, zero coefficients dropped, and, for the linear kernel, all
/// vectors collapsed to `w = sum of coefficient times vector` (one support vector of coefficient 1). At least
/// one vector stays.
///
/// # Errors
/// The model has several machines, is a regression, or is broken.
pub fn simplify(model: &Model) -> Result<(Model, Simplification), PruneError> {
    check(model)?;
    let (features, n) = (model.features, model.len());
    let coefficients = &model.coefficients[0];
    if model.kernel == Kernel::Linear && (n > 1 || coefficients[0] != 1.0) {
        let mut w = vec![0.0; features];
        for (k, value) in w.iter_mut().enumerate() {
            *value = super::dense::compensated((0..n).map(|i| coefficients[i] * model.support_vector(i)[k]));
        }
        if w.iter().all(|v| v.is_finite()) {
            let what = Simplification { merged: 0, dropped: 0, collapsed: true };
            return Ok((with_vectors(model, &w, &[1.0], model.rho[0]), what));
        }
    }
    let mut first: HashMap<Vec<u64>, usize> = HashMap::with_capacity(n);
    let mut vectors = Vec::with_capacity(model.support_vectors.len());
    let mut merged: Vec<f64> = Vec::with_capacity(n);
    for (i, coefficient) in coefficients.iter().enumerate() {
        let row = model.support_vector(i);
        // -0 and 0 are one value.
        let key = row.iter().map(|v| if *v == 0.0 { 0 } else { v.to_bits() }).collect();
        let place = *first.entry(key).or_insert(merged.len());
        if place == merged.len() {
            vectors.extend_from_slice(row);
            merged.push(0.0);
        }
        merged[place] += coefficient;
    }
    if merged.iter().any(|c| !c.is_finite()) {
        return Ok((model.clone(), Simplification::default())); // sums that overflow are no simplification
    }
    let dropped = merged.iter().filter(|c| **c == 0.0).count();
    let what = Simplification { merged: n - merged.len(), dropped, collapsed: false };
    if dropped == merged.len() {
        // The constant -rho: a model file needs a vector, so one stays, without effect.
        let mut constant = with_vectors(model, &vectors[..features], &[1.0], model.rho[0]);
        constant.coefficients[0][0] = 0.0;
        return Ok((constant, Simplification { dropped: dropped - 1, ..what }));
    }
    Ok((with_vectors(model, &vectors, &merged, model.rho[0]), what))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prune::Random;
    use crate::prune::testing::machine;

    #[test]
    fn duplicates_merge_and_zeros_drop() {
        let mut model = machine(40, 3, 2.0, 10.0, 1);
        let (a, b) = (model.support_vector(3).to_vec(), model.support_vector(5).to_vec());
        model.support_vectors[30 * 3..31 * 3].copy_from_slice(&a);
        model.support_vectors[31 * 3..32 * 3].copy_from_slice(&b);
        model.coefficients[0][31] = -model.coefficients[0][5];
        model.coefficients[0][30] = -0.5;
        model.coefficients[0][7] = 0.0;
        let (simple, what) = simplify(&model).unwrap();
        assert_eq!((what.merged, what.dropped, what.collapsed), (2, 2, false));
        assert_eq!(simple.len(), 36);
        assert_eq!(simple.class_counts.iter().sum::<usize>(), 36);
        let mut rng = Random::stream(9, 9);
        for _ in 0..100 {
            let x = [rng.uniform(), rng.uniform(), rng.uniform()];
            assert!((model.decision_value(&x) - simple.decision_value(&x)).abs() < 1e-12);
        }
        assert_eq!(simplify(&simple).unwrap(), (simple.clone(), Simplification::default()));
    }

    #[test]
    fn linear_machines_collapse_to_one_vector() {
        let mut model = machine(50, 4, 1.0, 3.0, 2);
        model.kernel = Kernel::Linear;
        let (simple, what) = simplify(&model).unwrap();
        assert!(what.collapsed);
        assert_eq!(
            (simple.len(), &simple.coefficients[0], &simple.class_counts),
            (1, &vec![1.0], &vec![1, 0])
        );
        let x = [0.3, -4.0, 1e3, 0.0];
        assert!((model.decision_value(&x) - simple.decision_value(&x)).abs() < 1e-9);
        assert!(!simplify(&simple).unwrap().1.collapsed);
    }

    #[test]
    fn everything_cancelled_leaves_the_constant() {
        let mut model = machine(2, 2, 1.0, 3.0, 2);
        let first = model.support_vector(0).to_vec();
        model.support_vectors[2..].copy_from_slice(&first);
        model.coefficients[0] = vec![2.0, -2.0];
        let (simple, _) = simplify(&model).unwrap();
        assert_eq!(simple.len(), 1);
        assert_eq!(simple.decision_value(&[0.5, 0.5]), -model.rho[0]);
    }

    #[test]
    fn what_cannot_be_pruned_says_why() {
        let mut model = machine(10, 2, 1.0, 1.0, 1);
        model.support_vectors[3] = f64::NAN;
        assert_eq!(simplify(&model).unwrap_err(), PruneError::Invalid);
        let mut model = machine(10, 2, 1.0, 1.0, 1);
        model.rho = vec![0.0; 3];
        assert_eq!(simplify(&model).unwrap_err(), PruneError::Machines(3));
    }
}
