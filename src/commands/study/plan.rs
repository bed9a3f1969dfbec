//! What is rendered: scenes, policies, and the knob that makes each cheaper or dearer.

use super::StudyArguments;
use crate::commands::Usage;
use crate::commands::machine::shipped;
use crate::commands::render::load;
use crate::commands::sandbox::FileArguments;
use crate::session::cpu::thread_seconds;
use anyhow::Context;
use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::machine::Machine;
use sparing_adaptive::policy::{HalfBuffer, Planned, Policy, Shapes, Svm, Threshold, Uniform};
use std::path::PathBuf;

/// Samples that every pixel gets, as in `sparing render`.
pub(super) const MIN_SPP: u32 = 8;

/// The policies by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum PolicyName {
    /// Every pixel the same.
    Uniform,
    /// Pixels whose estimated error gains most from more samples.
    Threshold,
    /// The same, but a support vector machine decides where the estimate is in doubt.
    Svm,
    /// Pixels whose neighbours were noisy in the first layer: `--unbiased`.
    Planned,
    /// Pixels that show several shapes get the most, the others the least.
    Shapes,
    /// Pixels that differ from the mean of half of their samples (Dammertz et al. 2010, as in Cycles).
    HalfBuffer,
}

/// What time is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Clock {
    /// Time that passes. On an idle machine.
    #[default]
    Wall,
    /// Processor time of all threads over their number, for machines that others use too. Idle threads are not seen.
    Cpu,
}

/// What a policy is set to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "knob", content = "setting")]
pub(super) enum Knob {
    /// Samples of every pixel.
    Spp(u32),
    /// The average of samples per pixel.
    Average(u32),
    /// Most samples of a pixel.
    MaxSpp(u32),
    /// The policy's own threshold.
    Threshold(f64),
    /// The mean error in just noticeable differences. Not part of the curve: it asks whether the tolerance is true.
    Tolerance(f64),
}

impl Knob {
    /// Its name and value; also names files.
    pub(super) fn label(self) -> String {
        match self {
            Self::Spp(n) => format!("spp-{n}"),
            Self::Average(n) => format!("average-{n}"),
            Self::MaxSpp(n) => format!("max-spp-{n}"),
            Self::Threshold(t) => format!("threshold-{t:.5}"),
            Self::Tolerance(t) => format!("tolerance-{t}"),
        }
    }

    /// A guess of the samples per pixel.
    fn guess(self, max_spp: u32) -> f64 {
        let most = f64::from(max_spp);
        match self {
            Self::Spp(n) | Self::Average(n) => f64::from(n),
            Self::MaxSpp(n) => 8.0 + 0.3 * f64::from(n),
            Self::Threshold(t) => (16.0 + 0.1 / (t * t)).min(0.5 * most),
            Self::Tolerance(t) => (100.0 / (t * t)).min(most),
        }
    }
}

impl PolicyName {
    /// Its name on the command line.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Threshold => "threshold",
            Self::Svm => "svm",
            Self::Planned => "planned",
            Self::Shapes => "shapes",
            Self::HalfBuffer => "half-buffer",
        }
    }

    /// The settings to render with, from cheap to dear. For the adaptive ones the sweep ends where the errors of all
    /// levels have been reached; all end at four times the highest level.
    pub(super) fn knobs(self, levels: &[u32], max_spp: u32) -> Vec<Knob> {
        let doubling = || (3..=20).map(|k| 1u32 << k).take_while(move |n| *n < max_spp).chain([max_spp]);
        match self {
            Self::Uniform => {
                let mut all: Vec<u32> = doubling().chain(levels.iter().copied()).collect();
                all.sort_unstable();
                all.dedup();
                all.into_iter().map(Knob::Spp).collect()
            }
            Self::Threshold | Self::Svm | Self::Planned => {
                let halves = doubling().flat_map(|n| [n, n / 2 * 3]);
                let inside = halves.filter(move |n| (MIN_SPP + 1..=max_spp).contains(n));
                inside.map(Knob::Average).collect()
            }
            Self::Shapes => doubling().map(Knob::MaxSpp).collect(),
            Self::HalfBuffer => {
                (0..30).map(|k| 4.0 * 0.5_f64.powf(0.5 * f64::from(k))).map(Knob::Threshold).collect()
            }
        }
    }

    /// Tolerances to render with, besides the curve.
    pub(super) fn tolerances(self) -> &'static [f64] {
        if matches!(self, Self::Threshold | Self::Svm) { &[2.0, 1.0] } else { &[] }
    }

    /// Whether the sweep may end where all levels have been reached.
    pub(super) fn ends_early(self) -> bool {
        !matches!(self, Self::Uniform | Self::Shapes)
    }

    /// The policy at a setting, and its bounds.
    pub(super) fn policy(self, knob: Knob, plan: &Plan) -> (Box<dyn Policy>, Bounds) {
        let max_spp = plan.max_spp;
        let bounds = Bounds { min_spp: MIN_SPP.min(max_spp), max_spp };
        let ranking = |goal: Goal| -> Box<dyn Policy> {
            match self {
                Self::Svm => Box::new(Svm::new(goal, plan.machine.clone())),
                Self::Planned => Box::new(Planned { goal }),
                _ => Box::new(Threshold::new(goal)),
            }
        };
        let policy: Box<dyn Policy> = match (self, knob) {
            (_, Knob::Spp(n)) => {
                return (Box::new(Uniform), Bounds { min_spp: MIN_SPP.min(n), max_spp: n });
            }
            (_, Knob::MaxSpp(n)) => return (Box::new(Shapes), Bounds { max_spp: n, ..bounds }),
            (_, Knob::Average(n)) => ranking(Goal::Average(f64::from(n))),
            (_, Knob::Tolerance(t)) => ranking(Goal::Tolerance(t)),
            (_, Knob::Threshold(threshold)) => Box::new(HalfBuffer { threshold }),
        };
        (policy, bounds)
    }
}

/// One scene of the study.
#[derive(Clone, Debug)]
pub(super) struct SceneFile {
    /// Short and unique; names files.
    pub(super) name: String,
    pub(super) path: PathBuf,
    /// Of the scene file's bytes.
    pub(super) fingerprint: u64,
}

/// Everything that is decided before anything is rendered.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) folder: PathBuf,
    pub(super) scenes: Vec<SceneFile>,
    pub(super) policies: Vec<PolicyName>,
    pub(super) levels: Vec<u32>,
    pub(super) max_spp: u32,
    pub(super) reference_spp: u32,
    pub(super) size: Option<[u32; 2]>,
    /// Of the first render of each setting.
    pub(super) seed: u64,
    /// Renders of each setting.
    pub(super) seeds: u32,
    pub(super) threads: usize,
    pub(super) files: FileArguments,
    pub(super) resume: bool,
    pub(super) clock: Clock,
    /// Of the policy svm.
    pub(super) machine: Machine,
}

impl Plan {
    pub(super) fn new(a: &StudyArguments) -> anyhow::Result<Self> {
        let mut levels = a.levels.clone();
        levels.sort_unstable();
        levels.dedup();
        if let Some(n) = levels.iter().find(|n| !(MIN_SPP..=a.max_spp).contains(n)) {
            return Err(Usage::error(format!(
                "the level {n} must lie between {MIN_SPP} samples and --max-spp {}",
                a.max_spp
            )));
        }
        let mut policies = vec![PolicyName::Uniform];
        for &policy in &a.policies {
            if !policies.contains(&policy) {
                policies.push(policy);
            }
        }
        if a.clock == Clock::Cpu && thread_seconds().is_none() {
            return Err(Usage::error("this system does not tell processor times; use --clock wall"));
        }
        let mut scenes: Vec<SceneFile> = Vec::new();
        for path in &a.scenes {
            load(path, &a.files)?; // all mistakes now, not in an hour
            let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
            let name = unique(&file_name(path), &scenes);
            scenes.push(SceneFile { name, path: path.clone(), fingerprint: fnv1a(&bytes) });
        }
        Ok(Self {
            folder: a.output.clone(),
            scenes,
            policies,
            levels,
            max_spp: a.max_spp,
            reference_spp: a.reference_spp,
            size: a.size,
            seed: a.seed,
            seeds: a.seeds,
            threads: a.threads,
            files: a.files.clone(),
            resume: a.resume,
            clock: a.clock,
            machine: shipped()?,
        })
    }

    /// The settings of a policy that make its curve, then the tolerances.
    pub(super) fn knobs(&self, policy: PolicyName) -> Vec<Knob> {
        let mut knobs = policy.knobs(&self.levels, self.max_spp);
        knobs.extend(policy.tolerances().iter().map(|t| Knob::Tolerance(*t)));
        knobs
    }

    /// A guess of the samples per pixel of a render, for the time left: nothing for those that an early end of the sweep
    /// will probably leave out.
    pub(super) fn guess(&self, policy: PolicyName, knob: Knob) -> f64 {
        let spp = knob.guess(self.max_spp);
        let top = self.levels.last().map_or(0.0, |n| f64::from(*n));
        let end = if policy.ends_early() { 2.0 } else { 4.0 };
        if spp > end * top { 0.0 } else { spp }
    }
}

/// The scene's file name without its extension, of letters that any file system takes.
fn file_name(path: &std::path::Path) -> String {
    let stem = path.file_stem().map_or_else(|| "scene".into(), |s| s.to_string_lossy());
    stem.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' }).collect()
}

fn unique(name: &str, others: &[SceneFile]) -> String {
    let taken = |n: &str| others.iter().any(|s| s.name == n);
    let numbered = (2..).map(|i| format!("{name}-{i}"));
    std::iter::once(name.to_owned()).chain(numbered).find(|n| !taken(n)).unwrap_or_default()
}

/// Fowler, Noll and Vo's hash: tells files apart, not forgeries.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_rise_and_hold_the_levels() {
        let labels = |p: PolicyName, levels: &[u32], max| -> Vec<String> {
            p.knobs(levels, max).into_iter().map(Knob::label).collect()
        };
        assert_eq!(
            labels(PolicyName::Uniform, &[8, 20], 33),
            ["spp-8", "spp-16", "spp-20", "spp-32", "spp-33"]
        );
        assert_eq!(labels(PolicyName::Shapes, &[8], 32), ["max-spp-8", "max-spp-16", "max-spp-32"]);
        assert_eq!(
            labels(PolicyName::Threshold, &[8], 32),
            ["average-12", "average-16", "average-24", "average-32"]
        );
        let guesses: Vec<f64> =
            PolicyName::HalfBuffer.knobs(&[64], 4096).into_iter().map(|k| k.guess(4096)).collect();
        assert!(guesses.is_sorted());
    }

    #[test]
    fn names_are_unique_and_plain() {
        let scene = |n: &str| SceneFile { name: n.into(), path: PathBuf::new(), fingerprint: 0 };
        assert_eq!(unique("a", &[scene("a"), scene("a-2")]), "a-3");
        assert_eq!(file_name(std::path::Path::new("x/my scene.v2.pbrt")), "my-scene-v2");
    }
}
