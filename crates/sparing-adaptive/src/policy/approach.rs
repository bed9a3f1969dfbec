//! How a ranking policy approaches its goal, barrier by barrier.

use super::Decisions;
use crate::budget::afford;
use crate::goal::{Bounds, Goal};
use crate::pooling::Plane;
use crate::view::View;

/// A layer takes at least this share of the samples that are left: each barrier has its cost.
const LEAST: f64 = 0.125;
/// The threshold falls to this share of it where a layer would take less, so many times at most: in the end, what a machine declines at
/// first is far above its band.
const LESS: f64 = 0.8;
const MOST_TRIES: usize = 8;

/// Decides by the threshold for the next layer, or by a lower one if hardly any pixel would go on and the goal is not reached. A
/// layer takes no more samples than the goal allows; those that are worth most go first.
pub(super) fn approach(
    goal: Goal,
    view: &View,
    spread: &Plane,
    bounds: Bounds,
    mut decide: impl FnMut(f64) -> Decisions,
) -> Decisions {
    let [mut lambda, whole] = goal.thresholds(view, spread, bounds);
    let mut decisions = decide(lambda);
    let left = goal.samples_left(view);
    let least = LEAST * left;
    for _ in 0..MOST_TRIES {
        let taken = samples(view, &decisions);
        // At 0 all go on that can: nothing lower is left.
        if (taken > 0.0 && taken >= least) || least == 0.0 || lambda == 0.0 || !lambda.is_finite() {
            break;
        }
        lambda = whole.min(LESS * lambda);
        decisions = decide(lambda);
    }
    if left > 0.0 {
        // Where many pixels are worth nearly the same, the next threshold can be far beyond the goal.
        let counts: Vec<u32> = view.pixels.iter().map(|p| p.count).collect();
        if afford(&mut decisions, &counts, goal.samples_allowed(view) as u64) {
            // Not all that the threshold asks for is done: plans stay as they are.
            decisions.lambda = Some(f64::INFINITY);
            for ((value, target), count) in decisions.values.iter_mut().zip(&decisions.targets).zip(&counts) {
                *value = if target > count { *value } else { value.min(0.0) };
            }
        }
    }
    decisions
}

/// Samples that the next layer takes.
fn samples(view: &View, decisions: &Decisions) -> f64 {
    let missing =
        view.pixels.iter().zip(&decisions.targets).map(|(p, t)| u64::from(t.saturating_sub(p.count)));
    missing.sum::<u64>() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Statistics;

    const BOUNDS: Bounds = Bounds { min_spp: 8, max_spp: 64 };

    /// A hundred pixels of 8 samples, and their spreads: 100, 99 ..
    fn scene() -> (View, Plane) {
        let pixel = Statistics { count: 8, perceived_error: 2.0, ..Statistics::EMPTY };
        let view = View { width: 100, height: 1, exposure: 1.0, error_scale: 1.0, pixels: vec![pixel; 100] };
        let values = (0..100_u8).map(|i| 100.0 - f32::from(i)).collect();
        (view, Plane { width: 100, height: 1, values })
    }

    /// Sends on those whose gain exceeds `factor` lambda; gives the thresholds asked, the pixels that go on, and the last threshold.
    fn run(goal: Goal, factor: f64) -> (Vec<f64>, usize, Option<f64>) {
        let (view, spread) = scene();
        let mut asked = Vec::new();
        let decisions = approach(goal, &view, &spread, BOUNDS, |lambda| {
            asked.push(lambda);
            let gains: Vec<f64> = spread.values.iter().map(|s| f64::from(*s) / 8.0).collect();
            Decisions {
                targets: gains.iter().map(|g| if *g > factor * lambda { 16 } else { 8 }).collect(),
                values: gains.iter().map(|g| (g / lambda).log2() as f32).collect(),
                lambda: Some(lambda),
            }
        });
        (asked, decisions.targets.iter().filter(|t| **t > 8).count(), decisions.lambda)
    }

    #[test]
    fn thresholds_are_asked_once() {
        for factor in [0.0, 1.0, 1e9] {
            assert_eq!(run(Goal::Threshold(5.0), factor).0, [5.0]);
        }
        for goal in [Goal::Tolerance(0.0), Goal::Average(1e9)] {
            let (asked, going, _) = run(goal, 1.0);
            assert_eq!((&asked[..], going), (&[0.0][..], 100), "{goal:?}: out of reach");
        }
    }

    #[test]
    fn a_layer_takes_no_more_than_is_left() {
        // 12 samples on average: 4 for each of 100 pixels are left.
        for factor in [0.0, 0.1] {
            let (_, going, lambda) = run(Goal::Average(12.0), factor);
            assert_eq!((going, lambda), (50, Some(f64::INFINITY)), "{factor}");
        }
    }

    #[test]
    fn the_threshold_falls_until_pixels_go_on() {
        let (asked, going, _) = run(Goal::Average(32.0), 3.0);
        assert!(asked.len() > 1 && asked.is_sorted_by(|a, b| a > b), "{asked:?}");
        assert!(going >= 30, "{going}: an eighth of what is left");
        let (asked, going, _) = run(Goal::Average(32.0), 1e9);
        assert!(asked.len() == 1 + MOST_TRIES && going == 0, "{asked:?}: it ends");
    }
}
