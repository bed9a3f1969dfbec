//! A support vector machine decides where the pooled rule is in doubt.

use super::approach::approach;
use super::memory::Memory;
use super::threshold::PLAN_RADIUS;
use super::{Barrier, Decisions, Policy, Threshold, doubled};
use crate::features::{self, FeatureMatrix, Query};
use crate::goal::{Goal, planned};
use crate::machine::Machine;
use crate::pooling::Plane;
use rayon::prelude::*;

/// Where the machine decides: where the logarithm of the rule's gain over its threshold is between these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Below, a pixel stops.
    pub stop: f64,
    /// Above, it goes on.
    pub go_on: f64,
}

impl Default for Band {
    /// Wider ones gained nothing and cost more decisions, and far out a machine only extrapolates: docs/adaptive.md.
    fn default() -> Self {
        Self { stop: -0.6, go_on: 0.35 }
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
    /// Decision values computed so far.
    pub decided: u64,
    /// Of them, those that were undefined; such a pixel goes on.
    pub undefined: u64,
    memory: Memory,
}

impl Svm {
    /// The machine for a goal, with the default rule and band.
    #[must_use]
    pub fn new(goal: Goal, machine: Machine) -> Self {
        Self {
            rule: Threshold::new(goal),
            machine,
            band: Band::default(),
            decided: 0,
            undefined: 0,
            memory: Memory::default(),
        }
    }
}

/// The machine is asked at thresholds 5 % apart: a goal's threshold hardly moves at late barriers, and what was asked before is
/// not asked again.
fn on_grid(lambda: f64) -> f64 {
    if lambda > 0.0 && lambda.is_finite() { ((20.0 * lambda.ln()).round() / 20.0).exp() } else { lambda }
}

impl Policy for Svm {
    fn name(&self) -> &'static str {
        "svm"
    }

    fn wants_audit(&self) -> bool {
        self.rule.goal.wants_audit()
    }

    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions {
        let view = barrier.view();
        let spread = self.rule.spread(barrier);
        let goal = self.rule.goal;
        approach(goal, view, &spread, barrier.bounds, |lambda| self.decide_at(lambda, barrier, &spread))
    }
}

impl Svm {
    fn decide_at(&mut self, lambda: f64, barrier: &Barrier<'_>, spread: &Plane) -> Decisions {
        let (view, bounds) = (barrier.view(), barrier.bounds);
        let asked_at = on_grid(lambda);
        let plan = &barrier.plan(PLAN_RADIUS).values;
        let band = self.band;
        let shift = if asked_at == lambda { 0.0 } else { (asked_at / lambda).ln() };
        // Target, decision value, and where the machine is to be asked the gain. Nothing is asked about pixels that have the
        // most or less than their plan.
        let judged: Vec<(u32, f32, Option<f64>)> = (view.pixels.par_iter().zip(&spread.values).zip(plan))
            .map(|((p, &spread), &plan)| {
                let log_gain = features::log_gain(spread, p.count, asked_at);
                let value = ((log_gain + shift) * std::f64::consts::LOG2_E).clamp(-64.0, 64.0) as f32;
                let open = p.count < bounds.max_spp && p.count >= planned(plan, lambda, bounds);
                let go_on = if open { log_gain > band.go_on } else { value > 0.0 } && spread > 0.0;
                let target = if go_on { doubled(p.count, bounds) } else { p.count };
                (target, value, (open && spread > 0.0 && band.contains(log_gain)).then_some(log_gain))
            })
            .collect();
        let query = |(pixel, judged): (usize, &(u32, f32, Option<f64>))| {
            let log_gain = judged.2?;
            let plan_gain = features::log_gain(plan[pixel], view.pixels[pixel].count, asked_at);
            Some(Query { pixel, log_gain, plan_gain })
        };
        let queries: Vec<Query> = judged.par_iter().enumerate().filter_map(query).collect();
        let (targets, values) = judged.into_iter().map(|(target, value, _)| (target, value)).unzip();
        let mut decisions = Decisions { targets, values, lambda: Some(lambda) };
        let mut values = self.memory.recall(view, asked_at);
        let asked: Vec<Query> = queries.iter().filter(|q| values[q.pixel].is_nan()).copied().collect();
        let matrix = FeatureMatrix::new(view, &asked, self.machine.features());
        for (query, value) in asked.iter().zip(self.machine.decide(matrix)) {
            self.decided += 1;
            self.undefined += u64::from(value.is_nan());
            values[query.pixel] = value;
        }
        for query in &queries {
            let value = values[query.pixel];
            let value = if value.is_nan() { 1.0 } else { value };
            let count = view.pixels[query.pixel].count;
            decisions.targets[query.pixel] = if value > 0.0 { doubled(count, bounds) } else { count };
            decisions.values[query.pixel] = value.clamp(-64.0, 64.0) as f32;
        }
        self.memory.keep(view, asked_at, values);
        decisions
    }
}
