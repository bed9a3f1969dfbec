//! How a ranking policy approaches its goal, barrier by barrier.

use super::Decisions;
use crate::goal::{Bounds, Goal};
use crate::pooling::Plane;
use crate::view::View;

/// A layer takes at least this share of the samples that are left: each barrier has its cost.
const LEAST: f64 = 0.125;
/// The threshold falls to this share of it where a layer would take less, so many times at most: in the end, what a machine declines at
/// first is far above its band.
const LESS: f64 = 0.8;
const MOST_TRIES: usize = 8;

/// Decides by the threshold for the next layer, or by a lower one if hardly any pixel would go on and the goal is not reached.
pub(super) fn approach(
    goal: Goal,
    view: &View,
    spread: &Plane,
    bounds: Bounds,
    mut decide: impl FnMut(f64) -> Decisions,
) -> Decisions {
    let [mut lambda, whole] = goal.thresholds(view, spread, bounds);
    let mut decisions = decide(lambda);
    let least = LEAST * goal.samples_left(view);
    for _ in 0..MOST_TRIES {
        let taken = samples(view, &decisions);
        if (taken > 0.0 && taken >= least) || least == 0.0 || !lambda.is_finite() {
            break;
        }
        lambda = whole.min(LESS * lambda);
        decisions = decide(lambda);
    }
    decisions
}

/// Samples that the next layer takes.
fn samples(view: &View, decisions: &Decisions) -> f64 {
    let missing =
        view.pixels.iter().zip(&decisions.targets).map(|(p, t)| u64::from(t.saturating_sub(p.count)));
    missing.sum::<u64>() as f64
}
