//! Which policy, with what goal and bounds.

use super::{RenderArguments, paper};
use crate::commands::Usage;
use crate::commands::machine::{shipped, shipped_paper};
use clap::ValueEnum;
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::machine::Machine;
use sparing_adaptive::policy::{Paper, Planned, Policy, Shapes, Svm, Threshold, Uniform};

/// The policies by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum PolicyName {
    /// Every pixel the same.
    #[default]
    Uniform,
    /// Pixels whose estimated error gains most from more samples.
    Threshold,
    /// The same, but a support vector machine decides where the estimate is in doubt.
    Svm,
    /// Pixels that show several shapes get the most, the others the least.
    Shapes,
}

/// What decides for the policy `svm`.
#[derive(Clone, Debug)]
enum Chosen {
    Machine(Machine),
    Paper(Paper),
}

/// A policy and what it is to reach.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    name: PolicyName,
    goal: Goal,
    model: Option<Chosen>,
    unbiased: bool,
    pub(super) bounds: Bounds,
    pub(super) exposure: Option<f32>,
}

impl Choice {
    /// From the arguments and what the scene says about samples per pixel.
    pub(super) fn new(a: &RenderArguments, scene_spp: Option<u32>) -> anyhow::Result<Self> {
        if a.judge_exposure.is_some_and(|ev| !(-60.0..=60.0).contains(&ev)) {
            return Err(Usage::error("the exposure for judging errors must be between -60 and 60 stops"));
        }
        let exposure = a.judge_exposure.map(f32::exp2);
        if a.unbiased && a.model.is_some() {
            return Err(Usage::error("--unbiased asks no model: leave out --model"));
        }
        let model = match (&a.model, a.policy) {
            (Some(path), PolicyName::Svm) if path.as_os_str() == "paper" => {
                Some(Chosen::Paper(shipped_paper()?))
            }
            (Some(path), PolicyName::Svm) if path.is_dir() => Some(Chosen::Paper(Paper::read(path)?)),
            (Some(path), PolicyName::Svm) => Some(Chosen::Machine(Machine::read(path)?)),
            (None, PolicyName::Svm) => Some(Chosen::Machine(shipped()?)),
            (Some(_), _) => return Err(Usage::error("--model is for --policy svm")),
            (None, _) => None,
        };
        if a.unbiased && !matches!(a.policy, PolicyName::Threshold | PolicyName::Svm) {
            return Err(Usage::error("--unbiased is for --policy threshold and svm; the others are"));
        }
        if a.policy == PolicyName::Uniform {
            let extra = [
                a.tolerance.map(|_| "tolerance"),
                a.threshold.map(|_| "threshold"),
                a.min_spp.map(|_| "min-spp"),
                a.max_spp.map(|_| "max-spp"),
            ];
            if let Some(option) = extra.into_iter().flatten().next() {
                return Err(Usage::error(format!(
                    "--{option} is for adaptive policies; say --spp or choose a --policy"
                )));
            }
            let max_spp = a.spp.or(scene_spp).unwrap_or(64);
            let bounds = Bounds { min_spp: max_spp.min(8), max_spp };
            return Ok(Self {
                name: a.policy,
                goal: Goal::Average(f64::from(max_spp)),
                model,
                unbiased: false,
                bounds,
                exposure,
            });
        }
        if a.policy == PolicyName::Shapes {
            without_goal(a, "the policy shapes")?;
        }
        let min_spp = a.min_spp.unwrap_or(8.min(a.max_spp.unwrap_or(8)));
        let max_spp = a.max_spp.unwrap_or(512.max(min_spp));
        if matches!(model, Some(Chosen::Paper(_))) {
            paper::check(a, min_spp, max_spp)?;
        }
        if min_spp > max_spp {
            return Err(Usage::error(format!("--min-spp {min_spp} is above --max-spp {max_spp}")));
        }
        let goal = match (a.spp, a.threshold) {
            (_, Some(lambda)) => Goal::Threshold(lambda),
            (Some(n), _) if !(min_spp..=max_spp).contains(&n) => {
                let range = format!("{min_spp} to {max_spp}");
                return Err(Usage::error(format!(
                    "--spp {n}: an average must lie between least and most, {range}"
                )));
            }
            (Some(n), None) => Goal::Average(f64::from(n)),
            (None, None) => Goal::Tolerance(a.tolerance.unwrap_or(1.0)),
        };
        Ok(Self {
            name: a.policy,
            goal,
            model,
            unbiased: a.unbiased,
            bounds: Bounds { min_spp, max_spp },
            exposure,
        })
    }

    /// The policy, ready to run.
    pub(super) fn policy(&self) -> Box<dyn Policy> {
        if self.unbiased {
            return Box::new(Planned { goal: self.goal });
        }
        match (self.name, &self.model) {
            (PolicyName::Svm, Some(Chosen::Machine(machine))) => {
                Box::new(Svm::new(self.goal, machine.clone()))
            }
            (PolicyName::Svm, Some(Chosen::Paper(paper))) => Box::new(paper.clone()),
            (PolicyName::Uniform, _) => Box::new(Uniform),
            // Without a machine, which `new` does not let happen, its rule is left.
            (PolicyName::Threshold | PolicyName::Svm, _) => Box::new(Threshold::new(self.goal)),
            (PolicyName::Shapes, _) => Box::new(Shapes),
        }
    }

    /// What it is to reach.
    pub(super) fn goal(&self) -> Goal {
        self.goal
    }

    /// Whether pixels get different numbers of samples.
    pub(super) fn is_adaptive(&self) -> bool {
        self.name != PolicyName::Uniform
    }

    /// Whether what a pixel gets depends on the pixels around it only.
    pub(super) fn is_local(&self) -> bool {
        let needs_no_goal = self.name == PolicyName::Shapes;
        let fixed = matches!(self.goal, Goal::Threshold(_)) && self.exposure.is_some();
        needs_no_goal || fixed
    }

    /// The name of the model in the program, if it is not the default one.
    pub(super) fn model(&self) -> Option<&'static str> {
        matches!(self.model, Some(Chosen::Paper(_))).then_some("paper")
    }

    /// The policy's name.
    pub(super) fn name(&self) -> &'static str {
        self.policy().name()
    }
}

/// Refuses the options that set a goal.
pub(super) fn without_goal(a: &RenderArguments, policy: &str) -> anyhow::Result<()> {
    let goal = [a.tolerance.map(|_| "tolerance"), a.threshold.map(|_| "threshold"), a.spp.map(|_| "spp")];
    match goal.into_iter().flatten().next() {
        Some(option) => Err(Usage::error(format!("--{option}: {policy} has no goal to set"))),
        None => Ok(()),
    }
}
