//! One line: continue while the estimated error's marginal gain exceeds a threshold.

use super::approach::approach;
use super::{Barrier, Decisions, Policy, doubled};
use crate::goal::Goal;
use crate::pooling::Plane;
use crate::view::Statistics;
use rayon::prelude::*;

/// CIEDE2000 of a relative error of 1 at middle brightness (d L* = 116 / 3 Y^(1/3) dY / Y, at Y = 0.4): brings the two
/// measures of error to one scale.
pub const PERCEIVED_PER_RELATIVE: f32 = 28.0;

/// What a pixel's own spread counts for against that of the neighbourhood.
const OWN: f32 = std::f32::consts::SQRT_2;
/// Neighbours of the plan, pixels to each side.
pub(super) const PLAN_RADIUS: usize = 1;

/// The pooled rule. A pixel's spread is the larger of its relative and its perceived error from block means, times the square
/// root of its samples. It continues while the largest of its own spread, the root mean square of 3 by 3, and what its
/// neighbours had in the first layer, divided by its samples, exceeds lambda. The last is the pixel's plan, without which
/// dark places came out too dark (see [`Ledger`](crate::ledger::Ledger)).
#[derive(Clone, Copy, Debug)]
pub struct Threshold {
    /// What sets lambda.
    pub goal: Goal,
}

impl Threshold {
    /// The pooled rule for a goal.
    #[must_use]
    pub fn new(goal: Goal) -> Self {
        Self { goal }
    }

    /// The spread of each pixel by which it is judged, in CIEDE2000 for one sample.
    #[must_use]
    pub fn spread(&self, barrier: &Barrier<'_>) -> Plane {
        let mut spread = barrier.view().plane(own_spread).pooled(OWN);
        let plan = &barrier.plan(PLAN_RADIUS).values;
        spread.values.iter_mut().zip(plan).for_each(|(spread, plan)| *spread = spread.max(*plan));
        spread
    }
}

/// The spread of one pixel by itself, in CIEDE2000 for one sample.
#[must_use]
pub fn own_spread(p: &Statistics) -> f32 {
    let error = (PERCEIVED_PER_RELATIVE * p.relative_error).max(p.perceived_error);
    // Saturated sums give no infinity here.
    (error * (p.count as f32).sqrt()).min(1e30)
}

impl Policy for Threshold {
    fn name(&self) -> &'static str {
        "threshold"
    }

    fn wants_audit(&self) -> bool {
        self.goal.wants_audit()
    }

    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions {
        let view = barrier.view();
        let spread = self.spread(barrier);
        let bounds = barrier.bounds;
        approach(self.goal, view, &spread, bounds, |lambda| {
            let decide = |(pixel, &spread): (&Statistics, &f32)| {
                let gain = f64::from(spread) / f64::from(pixel.count.max(1));
                // Zero spread never continues, whatever lambda.
                let go_on = gain > lambda && spread > 0.0;
                let target = if go_on { doubled(pixel.count, bounds) } else { pixel.count };
                (target, decision_value(gain, lambda))
            };
            let (targets, values) = view.pixels.par_iter().zip(&spread.values).map(decide).unzip();
            Decisions { targets, values, lambda: Some(lambda) }
        })
    }
}

/// log2 of the gain over lambda, within +-64: positive where a pixel continues.
pub(super) fn decision_value(gain: f64, lambda: f64) -> f32 {
    if gain <= 0.0 {
        return -64.0;
    }
    (gain / lambda).log2().clamp(-64.0, 64.0) as f32
}
