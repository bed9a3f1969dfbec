//! Dense algebra for some hundreds of unknowns: kernel matrices, Gram products, Cholesky.
//!
//! Every sum runs in an order that does not depend on threads. Sizes are small (at most a few thousand
//! unknowns), so plain blocked loops that the compiler vectorises are enough: 30,000 rows x 512 columns take
//! about a second.

use crate::model::Kernel;
use rayon::prelude::*;

/// Rows of `features` values each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows<'a> {
    pub(crate) data: &'a [f64],
    pub(crate) features: usize,
}

impl<'a> Rows<'a> {
    pub(crate) fn new(data: &'a [f64], features: usize) -> Self {
        Self { data, features }
    }

    pub(crate) fn len(&self) -> usize {
        self.data.len() / self.features.max(1)
    }

    pub(crate) fn row(&self, i: usize) -> &'a [f64] {
        &self.data[i * self.features..(i + 1) * self.features]
    }
}

/// K(c_i, x_j), one row for each of `centres`: `centres.len() * points.len()` values.
pub(crate) fn kernel_matrix(kernel: Kernel, centres: Rows<'_>, points: Rows<'_>) -> Vec<f64> {
    let n = points.len();
    let mut out = vec![0.0; centres.len() * n];
    out.par_chunks_mut(n.max(1)).enumerate().for_each(|(i, row)| {
        for (j, value) in row.iter_mut().enumerate() {
            *value = kernel.evaluate(centres.row(i), points.row(j));
        }
    });
    out
}

/// `sum_i coefficients_i K(x_i, y_j)` for each `y_j`, with compensated sums: the rounding is that of the
/// products, whatever the number of terms (see `certified::rounding`).
pub(crate) fn expansion(kernel: Kernel, x: Rows<'_>, coefficients: &[f64], y: Rows<'_>) -> Vec<f64> {
    (0..y.len())
        .into_par_iter()
        .map(|j| {
            let query = y.row(j);
            compensated(coefficients.iter().enumerate().map(|(i, c)| c * kernel.evaluate(x.row(i), query)))
        })
        .collect()
}

/// The sum with the rounding errors carried along (Neumaier 1974, "Rundungsfehleranalyse einiger Verfahren zur
/// Summation endlicher Summen").
pub(crate) fn compensated(terms: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut rest) = (0.0_f64, 0.0_f64);
    for term in terms {
        let next = sum + term;
        rest += if sum.abs() >= term.abs() { (sum - next) + term } else { (term - next) + sum };
        sum = next;
    }
    sum + rest
}

/// Dot product with eight partial sums in a fixed order.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut partial = [0.0; 8];
    let (blocks_a, rest_a) = a.as_chunks::<8>();
    let (blocks_b, rest_b) = b.as_chunks::<8>();
    for (x, y) in blocks_a.iter().zip(blocks_b) {
        for lane in 0..8 {
            partial[lane] += x[lane] * y[lane];
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(x, y)| x * y).sum();
    partial.iter().sum::<f64>() + rest
}

/// Columns of a tile of [`gram`]: two rows and this many values of each stay in the first cache.
const TILE: usize = 1024;

/// `R diag(weights) R^T` of a matrix of `m` rows: symmetric, `m * m` values. Without weights they are 1.
pub(crate) fn gram(rows: &[f64], m: usize, weights: Option<&[f64]>) -> Vec<f64> {
    let n = rows.len() / m.max(1);
    let weighted: Vec<f64> = weights.map_or_else(Vec::new, |w| {
        rows.par_chunks(n.max(1)).flat_map_iter(|row| row.iter().zip(w).map(|(a, b)| a * b)).collect()
    });
    let left = if weights.is_some() { &weighted } else { rows };
    let mut out = vec![0.0; m * m];
    // Eight rows of the result at a time: each tile of the right side is read once for all of them.
    out.par_chunks_mut(8 * m).enumerate().for_each(|(block, out)| {
        let first = block * 8;
        let count = out.len() / m;
        for start in (0..n).step_by(TILE) {
            let range = start..(start + TILE).min(n);
            for j in 0..(first + count).min(m) {
                let right = &rows[j * n..][range.clone()];
                for i in first.max(j)..first + count {
                    out[(i - first) * m + j] += dot(&left[i * n..][range.clone()], right);
                }
            }
        }
    });
    for i in 0..m {
        for j in 0..i {
            out[j * m + i] = out[i * m + j];
        }
    }
    out
}

/// `R v`: the dot product of each of `m` rows with `v`.
pub(crate) fn times(rows: &[f64], m: usize, v: &[f64]) -> Vec<f64> {
    let n = rows.len() / m.max(1);
    rows.par_chunks(n.max(1)).map(|row| dot(row, v)).collect()
}

/// `R^T c`: the sum of `m` rows, each times its coefficient.
pub(crate) fn transposed_times(rows: &[f64], coefficients: &[f64]) -> Vec<f64> {
    let n = rows.len() / coefficients.len().max(1);
    let mut out = vec![0.0; n];
    out.par_chunks_mut(TILE).enumerate().for_each(|(block, out)| {
        for (row, c) in rows.chunks_exact(n.max(1)).zip(coefficients) {
            for (sum, value) in out.iter_mut().zip(&row[block * TILE..]) {
                *sum += c * value;
            }
        }
    });
    out
}

/// The lower triangle L of `a = L L^T`, row by row in place; `None` if `a` is not positive definite in f64.
pub(crate) fn cholesky(mut a: Vec<f64>, m: usize) -> Option<Vec<f64>> {
    for i in 0..m {
        let (above, row) = a.split_at_mut(i * m);
        for j in 0..i {
            let other = &above[j * m..j * m + j + 1];
            row[j] = (row[j] - dot(&row[..j], &other[..j])) / other[j];
        }
        let pivot = row[i] - dot(&row[..i], &row[..i]);
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        row[i] = pivot.sqrt();
    }
    Some(a)
}

/// The solution of `L L^T x = b`.
pub(crate) fn solve(l: &[f64], m: usize, b: &[f64]) -> Vec<f64> {
    let mut x = b.to_vec();
    for i in 0..m {
        x[i] = (x[i] - dot(&l[i * m..i * m + i], &x[..i])) / l[i * m + i];
    }
    for i in (0..m).rev() {
        let value = x[i] / l[i * m + i];
        x[i] = value;
        for (left, factor) in x[..i].iter_mut().zip(&l[i * m..i * m + i]) {
            *left -= factor * value;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prune::Random;

    #[test]
    fn gram_and_solution_match_the_definition() {
        let mut rng = Random::stream(3, 0);
        let (m, n) = (19, 2100);
        let rows: Vec<f64> = (0..m * n).map(|_| rng.normal()).collect();
        let weights: Vec<f64> = (0..n).map(|_| rng.uniform()).collect();
        let g = gram(&rows, m, Some(&weights));
        for i in 0..m {
            for j in 0..m {
                let naive: f64 = (0..n).map(|k| rows[i * n + k] * weights[k] * rows[j * n + k]).sum();
                assert!((g[i * m + j] - naive).abs() < 1e-10, "{i} {j}");
            }
        }
        let truth: Vec<f64> = (0..m).map(|_| rng.normal()).collect();
        let b: Vec<f64> = g.chunks(m).map(|row| dot(row, &truth)).collect();
        let l = cholesky(g, m).expect("a Gram matrix of more columns than rows");
        for (x, t) in solve(&l, m, &b).iter().zip(&truth) {
            assert!((x - t).abs() < 1e-10);
        }
        let v = transposed_times(&rows, &truth);
        assert!((v[2050] - (0..m).map(|i| truth[i] * rows[i * n + 2050]).sum::<f64>()).abs() < 1e-12);
    }

    #[test]
    fn compensated_sums_keep_what_plain_ones_lose() {
        assert_eq!(compensated([1.0, 1e100, 1.0, -1e100].into_iter()), 2.0);
    }

    #[test]
    fn a_singular_matrix_is_refused() {
        assert!(cholesky(vec![1.0, 1.0, 1.0, 1.0], 2).is_none());
        assert!(cholesky(vec![f64::NAN], 1).is_none());
    }
}
