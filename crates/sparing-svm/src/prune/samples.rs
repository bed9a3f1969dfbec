//! Queries made from a machine's own support, for when no data is given.

use super::Random;
use crate::model::Model;

/// Share of the distance between two support vectors by which a query may lie outside of them.
const BEYOND: f64 = 0.2;
/// Noise added to each feature, as a share of its standard deviation over the support vectors.
const JITTER: f64 = 0.1;

/// `count` queries, row by row: each on the line through two random support vectors (and a little beyond them),
/// with normal noise on every feature. The support vectors of noisy data cover the data, so these queries do
/// too; their density is a guess, and so is every agreement that is measured with them.
#[must_use]
pub fn queries(model: &Model, count: usize, seed: u64) -> Vec<f64> {
    let (n, features) = (model.len(), model.features);
    if n == 0 {
        return vec![0.0; count * features];
    }
    let spread: Vec<f64> = (0..features)
        .map(|f| {
            let column = || (0..n).map(|i| model.support_vectors[i * features + f]);
            let mean = column().sum::<f64>() / n as f64;
            (column().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n as f64).sqrt()
        })
        .collect();
    let mut rng = Random::stream(seed, 0x73_616d_706c_6573);
    let mut out = Vec::with_capacity(count * features);
    for _ in 0..count {
        let (a, b) = (rng.below(n), rng.below(n));
        let t = rng.uniform() * (1.0 + 2.0 * BEYOND) - BEYOND;
        for ((x, y), spread) in model.support_vector(a).iter().zip(model.support_vector(b)).zip(&spread) {
            out.push(x + t * (y - x) + JITTER * spread * rng.normal());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prune::testing::machine;

    #[test]
    fn samples_cover_the_support_and_repeat() {
        let model = machine(200, 3, 1.0, 1.0, 1);
        let rows = queries(&model, 500, 7);
        assert_eq!(rows, queries(&model, 500, 7));
        assert_eq!(rows.len(), 1500);
        assert!(rows.iter().all(|v| (-1.0..2.0).contains(v)));
        let inside = rows.chunks(3).filter(|x| x.iter().all(|v| (0.0..1.0).contains(v))).count();
        assert!(inside > 400, "{inside}");
    }
}
