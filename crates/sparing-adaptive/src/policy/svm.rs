//! A support vector machine decides where the pooled rule is in doubt.

use super::approach::approach;
use super::memory::{Memory, Said};
use super::threshold::PLAN_RADIUS;
use super::{Barrier, Decisions, Policy, Threshold, doubled};
use crate::features::{self, Query};
use crate::goal::{Bounds, Goal, planned};
use crate::machine::Machine;
use crate::pooling::Plane;
use crate::view::View;
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

/// The pooled rule of [`Threshold`], and within a band around its threshold a machine. One a render: it remembers what the machine said
/// of pixels, by their samples.
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

/// Thresholds that a goal leads to are rounded to powers of this: what the machine said of a pixel at one of them holds until
/// samples are added around it, and most barriers ask about the same few. At 0.8 the last layers miss their goal by more.
const STEP: f64 = 0.9;

/// The power of [`STEP`] that is nearest to a threshold.
fn rounded(lambda: f64) -> f64 {
    let power = (lambda.ln() / STEP.ln()).round();
    if power.is_finite() { (power * STEP.ln()).exp() } else { lambda }
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
        approach(goal, view, &spread, barrier.bounds, |lambda| {
            let lambda = if matches!(goal, Goal::Threshold(_)) { lambda } else { rounded(lambda) };
            self.decide_at(lambda, barrier, &spread)
        })
    }
}

impl Svm {
    fn decide_at(&mut self, lambda: f64, barrier: &Barrier<'_>, spread: &Plane) -> Decisions {
        let view = barrier.view();
        let said = self.memory.recall(view, lambda);
        let judge = Judge {
            view,
            bounds: barrier.bounds,
            spread: &spread.values,
            plan: &barrier.plan(PLAN_RADIUS).values,
            lambda,
            band: self.band,
            machine: &self.machine,
        };
        let mut decisions = Decisions {
            targets: vec![0; view.pixels.len()],
            values: vec![0.0; view.pixels.len()],
            lambda: Some(lambda),
        };
        let parts = (decisions.targets.par_chunks_mut(PIXELS))
            .zip(decisions.values.par_chunks_mut(PIXELS))
            .zip(said.par_chunks_mut(PIXELS));
        let judged = parts
            .enumerate()
            .map(|(part, ((targets, values), said))| judge.pixels(part * PIXELS, targets, values, said));
        let [decided, undefined] = judged.reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        self.decided += decided;
        self.undefined += undefined;
        decisions
    }
}

/// Pixels that one task judges.
const PIXELS: usize = 512;
/// Near the borders of the band, the logarithm of the gain is computed in full: the quick one is good to a thousandth of this.
const NEAR: f64 = 1e-6;

/// What pixels are judged by at a barrier.
struct Judge<'a> {
    view: &'a View,
    bounds: Bounds,
    spread: &'a [f32],
    plan: &'a [f32],
    lambda: f64,
    band: Band,
    machine: &'a Machine,
}

impl Judge<'_> {
    /// Targets and decision values of the pixels from `first` on. Returns how many values the machine computed, and how many of
    /// them are undefined.
    fn pixels(&self, first: usize, targets: &mut [u32], values: &mut [f32], said: &mut [Said]) -> [u64; 2] {
        let mut queries = Vec::new();
        for (i, (target, value)) in targets.iter_mut().zip(values.iter_mut()).enumerate() {
            let pixel = first + i;
            let (count, spread) = (self.view.pixels[pixel].count, self.spread[pixel]);
            let mut log_gain = features::rough_log_gain(spread, count, self.lambda);
            if log_gain > self.band.stop - NEAR && log_gain < self.band.go_on + NEAR {
                log_gain = features::log_gain(spread, count, self.lambda);
            }
            *value = (log_gain * std::f64::consts::LOG2_E) as f32;
            // The machine is not asked about pixels that have the most or less than their plan.
            let open =
                count < self.bounds.max_spp && count >= planned(self.plan[pixel], self.lambda, self.bounds);
            let go_on = if open { log_gain > self.band.go_on } else { log_gain > 0.0 } && spread > 0.0;
            *target = if go_on { doubled(count, self.bounds) } else { count };
            if open && spread > 0.0 && self.band.contains(log_gain) {
                match said[i].with(self.view.samples_around(pixel)) {
                    Some(said) => (*target, *value) = self.by_machine(count, said),
                    None => {
                        let plan_gain = features::log_gain(self.plan[pixel], count, self.lambda);
                        queries.push(Query { pixel, log_gain, plan_gain });
                    }
                }
            }
        }
        let mut found = vec![0.0; queries.len()];
        self.machine.decide(self.view, &queries, &mut found);
        for (query, found) in queries.iter().zip(&found) {
            let i = query.pixel - first;
            let value = decision_value(*found);
            said[i].note(self.view.samples_around(query.pixel), value);
            (targets[i], values[i]) = self.by_machine(self.view.pixels[query.pixel].count, value);
        }
        [queries.len() as u64, found.iter().filter(|v| v.is_nan()).count() as u64]
    }

    /// Target and decision value of a pixel of which the machine says this.
    fn by_machine(&self, count: u32, value: f32) -> (u32, f32) {
        (if value > 0.0 { doubled(count, self.bounds) } else { count }, value)
    }
}

/// What the machine says as an f32 of the same sign, within +-64. What is undefined goes on.
fn decision_value(found: f64) -> f32 {
    let value = found.clamp(-64.0, 64.0) as f32;
    match found {
        _ if found.is_nan() => 1.0,
        _ if found > 0.0 => value.max(f32::MIN_POSITIVE),
        _ => value,
    }
}
