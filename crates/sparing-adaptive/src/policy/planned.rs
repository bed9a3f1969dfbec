//! Without bias: no pixel's own samples say how many it gets.

use super::threshold::decision_value;
use super::{Barrier, Decisions, Policy, doubled};
use crate::goal::{Bounds, Goal, planned};

/// Samples of the first layer: all that is known for the plan comes from it.
const FIRST: u32 = 16;
/// Neighbours of the plan, pixels to each side.
const RADIUS: usize = 2;

/// Each pixel gets the number of samples that its neighbours' spread in the first layer asks for: two-stage sampling with a
/// pilot that is not the pixel's own. The mean of every pixel is unbiased for a given threshold; what a goal makes of the
/// threshold depends on all pixels, so hardly on one.
#[derive(Clone, Copy, Debug)]
pub struct Planned {
    /// What sets lambda.
    pub goal: Goal,
}

fn bounds_of(bounds: Bounds) -> Bounds {
    Bounds { min_spp: bounds.min_spp.max(FIRST).min(bounds.max_spp), ..bounds }
}

impl Policy for Planned {
    fn name(&self) -> &'static str {
        "planned"
    }

    fn first_target(&self, bounds: Bounds) -> u32 {
        bounds_of(bounds).min_spp
    }

    fn wants_audit(&self) -> bool {
        self.goal.wants_audit()
    }

    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions {
        let (view, bounds) = (barrier.view(), bounds_of(barrier.bounds));
        let plan = barrier.plan(RADIUS);
        // The plan does not change: nothing is found later.
        let [_, lambda] = self.goal.thresholds(view, plan, bounds);
        let mut decisions = Decisions { lambda: Some(lambda), ..Decisions::default() };
        for (pixel, &spread) in view.pixels.iter().zip(&plan.values) {
            let go_on = pixel.count < planned(spread, lambda, bounds);
            decisions.targets.push(if go_on { doubled(pixel.count, bounds) } else { pixel.count });
            decisions.values.push(decision_value(f64::from(spread) / f64::from(pixel.count.max(1)), lambda));
        }
        decisions
    }
}
