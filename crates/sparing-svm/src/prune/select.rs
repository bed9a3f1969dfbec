//! Which vectors a reduced machine keeps. Every choice depends on the model, the size and the seed only, not on
//! threads.

mod greedy;
mod k_means;

pub use greedy::{GreedyRule, Ordering, order};
pub(crate) use greedy::{norm2, order_with};
pub use k_means::k_means;

use super::Random;
use crate::model::Model;

/// The `size` vectors of largest |coefficient|, the first of equals: what dropping the smallest leaves. It
/// fails on machines trained on noisy labels, where nearly all coefficients sit at the bound C.
#[must_use]
pub fn largest_coefficients(model: &Model, size: usize) -> Vec<usize> {
    let coefficients = &model.coefficients[0];
    let mut order: Vec<usize> = (0..model.len()).collect();
    order.sort_by(|&i, &j| coefficients[j].abs().total_cmp(&coefficients[i].abs()));
    order.truncate(size);
    order
}

/// `size` different vectors at random.
#[must_use]
pub fn random(model: &Model, size: usize, seed: u64) -> Vec<usize> {
    Random::stream(seed, 0x72616e64).choose(model.len(), size)
}

/// The chosen vectors, row by row.
#[must_use]
pub fn gather(model: &Model, indices: &[usize]) -> Vec<f64> {
    indices.iter().flat_map(|&i| model.support_vector(i).iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prune::testing::machine;

    #[test]
    fn largest_and_random_subsets() {
        let mut model = machine(20, 2, 1.0, 1.0, 5);
        model.coefficients[0] = (0..20).map(|i| f64::from(i % 7) - 3.0).collect();
        assert_eq!(largest_coefficients(&model, 4), [0, 6, 7, 13]);
        let chosen = random(&model, 12, 3);
        assert_eq!(chosen, random(&model, 12, 3));
        assert_ne!(chosen, random(&model, 12, 4));
        let mut sorted = chosen;
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), 12);
        assert_eq!(random(&model, 100, 3).len(), 20);
    }
}
