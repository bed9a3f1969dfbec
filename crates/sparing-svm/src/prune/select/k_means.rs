//! Weighted k-means with k-means++ seeding.

use crate::prune::Random;
use crate::prune::dense::Rows;
use rayon::prelude::*;

/// Rounds of Lloyd's iteration: later ones move the centres less than the refit notices.
const ROUNDS: usize = 15;

/// At most `size` centres of the weighted rows, row by row: k-means++ seeds (Arthur and Vassilvitskii 2007) and
/// Lloyd's iteration (1982), in the plain metric of the features, which is the RBF kernel's. Fewer centres come
/// back when there are fewer different rows. Weights that are not positive count as 0; when all are, every row
/// counts as 1.
///
/// # Panics
/// When there are not as many weights as rows.
#[must_use]
pub fn k_means(data: &[f64], features: usize, weights: &[f64], size: usize, seed: u64) -> Vec<f64> {
    let rows = Rows::new(data, features);
    assert_eq!(rows.len(), weights.len(), "one weight a row");
    let mut weights: Vec<f64> = weights.iter().map(|w| if *w > 0.0 { *w } else { 0.0 }).collect();
    if weights.iter().all(|w| *w == 0.0) {
        weights.fill(1.0);
    }
    let mut centres = seeds(rows, &weights, size, seed);
    for _ in 0..ROUNDS {
        let nearest: Vec<usize> =
            (0..rows.len()).into_par_iter().map(|i| nearest(rows.row(i), &centres, features)).collect();
        let k = centres.len() / features.max(1);
        let (mut sums, mut mass) = (vec![0.0; centres.len()], vec![0.0; k]);
        for (i, &c) in nearest.iter().enumerate() {
            mass[c] += weights[i];
            for (sum, value) in sums[c * features..(c + 1) * features].iter_mut().zip(rows.row(i)) {
                *sum += weights[i] * value;
            }
        }
        let mut moved = false;
        for c in (0..k).filter(|&c| mass[c] > 0.0) {
            for f in c * features..(c + 1) * features {
                let mean = sums[f] / mass[c];
                moved |= mean != centres[f];
                centres[f] = mean;
            }
        }
        if !moved {
            break;
        }
    }
    centres
}

fn distance2(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum()
}

/// The first of the nearest centres.
fn nearest(x: &[f64], centres: &[f64], features: usize) -> usize {
    let mut best = (0, f64::INFINITY);
    for (c, centre) in centres.chunks_exact(features).enumerate() {
        let d = distance2(x, centre);
        if d < best.1 {
            best = (c, d);
        }
    }
    best.0
}

/// k-means++: each next seed with a chance in proportion to its weight times squared distance from those
/// before.
fn seeds(rows: Rows<'_>, weights: &[f64], size: usize, seed: u64) -> Vec<f64> {
    let mut rng = Random::stream(seed, 0x6b6d_6561_6e73);
    let mut centres = Vec::with_capacity(size * rows.features);
    let mut distance = vec![1.0_f64; rows.len()];
    for _ in 0..size.min(rows.len()) {
        let total: f64 = distance.iter().zip(weights).map(|(d, w)| d * w).sum();
        if !(total > 0.0 && total.is_finite()) {
            break; // every row is a centre already
        }
        let mut left = rng.uniform() * total;
        let mut chosen = None;
        for (i, (d, w)) in distance.iter().zip(weights).enumerate() {
            if d * w > 0.0 {
                chosen = Some(i);
                left -= d * w;
                if left < 0.0 {
                    break;
                }
            }
        }
        let Some(chosen) = chosen else { break };
        let centre = rows.row(chosen);
        let first = centres.is_empty();
        centres.extend_from_slice(centre);
        distance.par_iter_mut().enumerate().for_each(|(i, d)| {
            let new = distance2(rows.row(i), centre);
            *d = if first { new } else { d.min(new) };
        });
    }
    centres
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_are_found() {
        let mut rng = Random::stream(1, 1);
        let data: Vec<f64> = (0..300)
            .flat_map(|i| [f64::from(i % 3) * 10.0 + rng.normal() * 0.1, rng.normal() * 0.1])
            .collect();
        let mut centres = k_means(&data, 2, &[1.0; 300], 3, 7);
        centres.chunks_exact_mut(2).for_each(|c| c[1] = c[1].abs());
        let mut x: Vec<f64> = centres.chunks_exact(2).map(|c| c[0]).collect();
        x.sort_by(f64::total_cmp);
        for (found, truth) in x.iter().zip([0.0, 10.0, 20.0]) {
            assert!((found - truth).abs() < 0.1, "{x:?}");
        }
    }

    #[test]
    fn few_different_rows_give_few_centres() {
        let data = [1.0, 2.0, 1.0, 2.0, 3.0, 4.0];
        assert_eq!(k_means(&data, 2, &[1.0; 3], 10, 0).len(), 4);
        assert_eq!(k_means(&data, 2, &[0.0; 3], 1, 0), [5.0 / 3.0, 8.0 / 3.0]);
    }
}
