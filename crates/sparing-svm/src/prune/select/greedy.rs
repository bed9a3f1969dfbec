//! Greedy orders of the support vectors in the kernel's Hilbert space, by the Newton basis.
//!
//! Both rules orthogonalise the kernel functions one after the other, which is the Cholesky factorisation of
//! the kernel matrix with pivots (Mueller and Schaback 2009, "A Newton basis for kernel spaces", section 4). A
//! prefix of the order is the order of the smaller size, so that one run serves all sizes.

use crate::model::Model;
use crate::prune::dense::{Rows, compensated, dot, expansion};
use rayon::prelude::*;

/// Which vector comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GreedyRule {
    /// The one furthest from the span of those before: pivoted Cholesky (Fine and Scheinberg 2001), the
    /// P-greedy rule of De Marchi, Schaback and Wendland (2005). Looks at the vectors only.
    Power,
    /// The one whose direction takes most off the rest of w: orthogonal matching pursuit with the best single
    /// step (Dutra Santos and Wendland's f/P-greedy; Wenzel, Santin and Haasdonk 2023). Needs f at all vectors.
    Residual,
}

/// A greedy order.
#[derive(Clone, Debug, PartialEq)]
pub struct Ordering {
    /// Support vectors, the most useful first; ends early where the rest depends on those before in f64.
    pub indices: Vec<usize>,
    /// Under [`GreedyRule::Residual`]: what each vector takes off |w|^2.
    pub gains: Vec<f64>,
}

/// Power below this share of the largest K(x, x) counts as dependent: rounding has reached it.
const DEPENDENT: f64 = 1e-13;

/// The first `size` vectors of the greedy order. Time grows with `n * size^2` (and `n^2` for the residual
/// rule), memory with `8 n * size` bytes. The kernel must be an inner product.
#[must_use]
pub fn order(model: &Model, rule: GreedyRule, size: usize) -> Ordering {
    let rows = Rows::new(&model.support_vectors, model.features);
    // f without rho at every vector; what is left of it, later.
    let residual = match rule {
        GreedyRule::Power => Vec::new(),
        GreedyRule::Residual => expansion(model.kernel, rows, &model.coefficients[0], rows),
    };
    order_with(model, rows, residual, size)
}

/// [`order`], with f without rho at every vector given (empty: the power rule).
pub(crate) fn order_with(model: &Model, rows: Rows<'_>, mut residual: Vec<f64>, size: usize) -> Ordering {
    let n = model.len();
    let size = size.min(n);
    let mut power: Vec<f64> = (0..n).map(|i| model.kernel.evaluate(rows.row(i), rows.row(i))).collect();
    let largest = power.iter().copied().fold(0.0, f64::max);
    let mut basis = vec![0.0; n * size]; // row i: the Newton basis at vector i
    let mut ordering = Ordering { indices: Vec::with_capacity(size), gains: Vec::new() };
    for step in 0..size {
        let score = |i: usize| {
            let usable = power[i] > DEPENDENT * largest;
            let gain = if residual.is_empty() { power[i] } else { residual[i] * residual[i] / power[i] };
            if usable && gain.is_finite() { gain } else { -1.0 }
        };
        let best = (0..n).fold((0, -1.0), |best, i| if score(i) > best.1 { (i, score(i)) } else { best });
        if best.1 <= 0.0 {
            break;
        }
        let pivot = best.0;
        let root = power[pivot].sqrt();
        let pivot_row = basis[pivot * size..pivot * size + step].to_vec();
        let centre = rows.row(pivot);
        let shift = residual.get(pivot).map_or(0.0, |r| r / root);
        ordering.indices.push(pivot);
        if !residual.is_empty() {
            ordering.gains.push(shift * shift);
        }
        let update = |i: usize, basis: &mut [f64], power: &mut f64| {
            let value = (model.kernel.evaluate(rows.row(i), centre) - dot(&basis[..step], &pivot_row)) / root;
            basis[step] = value;
            *power = (*power - value * value).max(0.0);
            value
        };
        if residual.is_empty() {
            basis.par_chunks_mut(size).zip(power.par_iter_mut()).enumerate().with_min_len(256).for_each(
                |(i, (basis, power))| {
                    update(i, basis, power);
                },
            );
        } else {
            let parts = basis.par_chunks_mut(size).zip(power.par_iter_mut()).zip(residual.par_iter_mut());
            parts.enumerate().with_min_len(256).for_each(|(i, ((basis, power), residual))| {
                *residual -= shift * update(i, basis, power);
            });
        }
        power[pivot] = 0.0;
    }
    ordering
}

/// |w|^2 from f without rho at every vector.
pub(crate) fn norm2(model: &Model, values: &[f64]) -> f64 {
    compensated(model.coefficients[0].iter().zip(values).map(|(a, f)| a * f))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prune::testing::machine;

    #[test]
    fn gains_sum_to_the_norm_and_orders_are_prefixes() {
        let model = machine(60, 3, 8.0, 5.0, 3);
        for rule in [GreedyRule::Power, GreedyRule::Residual] {
            let all = order(&model, rule, 60);
            assert_eq!(order(&model, rule, 17).indices, all.indices[..17]);
            let mut sorted = all.indices.clone();
            sorted.sort_unstable();
            sorted.dedup();
            assert_eq!(sorted.len(), all.indices.len(), "each vector once");
            if rule == GreedyRule::Residual {
                let rows = Rows::new(&model.support_vectors, 3);
                let values = expansion(model.kernel, rows, &model.coefficients[0], rows);
                let norm2 = norm2(&model, &values);
                let gained: f64 = all.gains.iter().sum();
                assert!((gained / norm2 - 1.0).abs() < 1e-6, "{gained} {norm2}");
            }
        }
    }

    #[test]
    fn dependent_vectors_end_the_order() {
        let mut model = machine(20, 2, 1.0, 1.0, 4);
        for i in 10..20 {
            let row = model.support_vector(i - 10).to_vec();
            model.support_vectors[i * 2..i * 2 + 2].copy_from_slice(&row);
        }
        assert!(order(&model, GreedyRule::Power, 20).indices.len() <= 10);
    }
}
