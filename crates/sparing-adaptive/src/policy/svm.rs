//! A support vector machine decides where the pooled rule is in doubt.

use super::threshold::{PLAN_RADIUS, decision_value};
use super::{Barrier, Decisions, Policy, Threshold, doubled};
use crate::features::{self, FeatureMatrix, Query};
use crate::goal::{Goal, planned};
use crate::machine::Machine;

/// Where the machine decides: where the logarithm of the rule's gain over its threshold is between these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Below, a pixel stops.
    pub stop: f64,
    /// Above, it goes on.
    pub go_on: f64,
}

impl Default for Band {
    /// The band in which the experiments were made: farther out, a machine only extrapolates.
    fn default() -> Self {
        Self { stop: -1.0, go_on: 0.35 }
    }
}

impl Band {
    /// Whether the machine decides.
    #[must_use]
    pub fn contains(self, log_gain: f64) -> bool {
        (self.stop..=self.go_on).contains(&log_gain)
    }
}

/// The pooled rule of [`Threshold`], and within a band around its threshold a machine.
#[derive(Clone, Debug)]
pub struct Svm {
    /// The rule and its goal.
    pub rule: Threshold,
    /// The machine.
    pub machine: Machine,
    /// Where it decides.
    pub band: Band,
    /// Decision values so far.
    pub decided: u64,
    /// Of them, those that were undefined; such a pixel goes on.
    pub undefined: u64,
}

impl Svm {
    /// The machine for a goal, with the default rule and band.
    #[must_use]
    pub fn new(goal: Goal, machine: Machine) -> Self {
        Self { rule: Threshold::new(goal), machine, band: Band::default(), decided: 0, undefined: 0 }
    }
}

impl Policy for Svm {
    fn name(&self) -> &'static str {
        "svm"
    }

    fn wants_audit(&self) -> bool {
        self.rule.goal.wants_audit()
    }

    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions {
        let (view, bounds) = (barrier.view(), barrier.bounds);
        let spread = self.rule.spread(barrier);
        let lambda = self.rule.goal.threshold(view, &spread, bounds);
        let plan = &barrier.plan(PLAN_RADIUS).values;
        let mut decisions = Decisions { lambda: Some(lambda), ..Decisions::default() };
        let mut queries = Vec::new();
        for (pixel, (p, &spread)) in view.pixels.iter().zip(&spread.values).enumerate() {
            let log_gain = features::log_gain(spread, p.count, lambda);
            // Nothing is asked of the machine about pixels that have the most or less than their plan.
            let open = p.count < bounds.max_spp && p.count >= planned(plan[pixel], lambda, bounds);
            if self.band.contains(log_gain) && spread > 0.0 && open {
                let plan_gain = features::log_gain(plan[pixel], p.count, lambda);
                queries.push(Query { pixel, log_gain, plan_gain });
            }
            let gain = f64::from(spread) / f64::from(p.count.max(1));
            decisions.values.push(decision_value(gain, lambda));
            let go_on = (log_gain > self.band.go_on || !open) && log_gain > 0.0 && spread > 0.0;
            decisions.targets.push(if go_on { doubled(p.count, bounds) } else { p.count });
        }
        let matrix = FeatureMatrix::new(view, &queries, self.machine.features());
        for (query, value) in queries.iter().zip(self.machine.decide(matrix)) {
            self.decided += 1;
            self.undefined += u64::from(value.is_nan());
            let value = if value.is_nan() { 1.0 } else { value };
            let count = view.pixels[query.pixel].count;
            decisions.targets[query.pixel] = if value > 0.0 { doubled(count, bounds) } else { count };
            decisions.values[query.pixel] = value.clamp(-64.0, 64.0) as f32;
        }
        decisions
    }
}
