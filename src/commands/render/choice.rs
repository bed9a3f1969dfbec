//! Which policy, with what goal and bounds.

use super::RenderArguments;
use crate::commands::Usage;
use clap::ValueEnum;
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::policy::{Policy, Shapes, Threshold, Uniform};

/// The policies by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum PolicyName {
    /// Every pixel the same.
    #[default]
    Uniform,
    /// Pixels whose estimated error gains most from more samples.
    Threshold,
    /// Pixels that show several shapes get the most, the others the least.
    Shapes,
}

/// A policy and what it is to reach.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    name: PolicyName,
    goal: Goal,
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
        if a.policy == PolicyName::Uniform {
            let extra = [
                a.tolerance.map(|_| "tolerance"),
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
            return Ok(Self { name: a.policy, goal: Goal::Average(f64::from(max_spp)), bounds, exposure });
        }
        let min_spp = a.min_spp.unwrap_or(8.min(a.max_spp.unwrap_or(8)));
        let max_spp = a.max_spp.unwrap_or(512.max(min_spp));
        if min_spp > max_spp {
            return Err(Usage::error(format!("--min-spp {min_spp} is above --max-spp {max_spp}")));
        }
        let goal = match a.spp {
            Some(n) if !(min_spp..=max_spp).contains(&n) => {
                let range = format!("{min_spp} to {max_spp}");
                return Err(Usage::error(format!(
                    "--spp {n}: an average must lie between least and most, {range}"
                )));
            }
            Some(n) => Goal::Average(f64::from(n)),
            None => Goal::Tolerance(a.tolerance.unwrap_or(1.0)),
        };
        Ok(Self { name: a.policy, goal, bounds: Bounds { min_spp, max_spp }, exposure })
    }

    /// The policy, ready to run.
    pub(super) fn policy(&self) -> Box<dyn Policy> {
        match self.name {
            PolicyName::Uniform => Box::new(Uniform),
            PolicyName::Threshold => Box::new(Threshold::new(self.goal)),
            PolicyName::Shapes => Box::new(Shapes),
        }
    }

    /// The policy's name.
    pub(super) fn name(&self) -> &'static str {
        self.policy().name()
    }
}
