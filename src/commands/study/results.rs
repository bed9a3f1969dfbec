//! What the renders say: costs at equal error, their means over scenes, biases, what an oracle would save.

use super::plan::{Clock, MIN_SPP, Plan, PolicyName};
use super::record::{Metric, Record};
use super::references::Reference;
use serde::Serialize;
use sparing_adaptive::goal::Bounds;
use sparing_adaptive::study::{Curve, Mean, Ratio, interpolate, oracle_ratio};

/// All renders of a scene.
#[derive(Clone, Debug, Serialize)]
pub(super) struct SceneRuns {
    pub(super) name: String,
    #[serde(skip)]
    pub(super) clock: Clock,
    pub(super) size: [u32; 2],
    pub(super) reference: Reference,
    #[serde(rename = "renders")]
    pub(super) records: Vec<Record>,
}

impl SceneRuns {
    /// Renders of a policy's curve.
    pub(super) fn of(&self, policy: PolicyName) -> impl Iterator<Item = &Record> {
        self.records.iter().filter(move |r| r.policy == policy && r.on_curve())
    }

    /// A policy's error over its render time.
    pub(super) fn time_curve(&self, policy: PolicyName, metric: Metric) -> Curve {
        Curve::new(self.of(policy).map(|r| (r.seconds(self.clock), metric.of(r))))
    }

    /// A policy's error over its samples per pixel.
    pub(super) fn spp_curve(&self, policy: PolicyName, metric: Metric) -> Curve {
        Curve::new(self.of(policy).map(|r| (r.average_spp, metric.of(r))))
    }

    /// What uniform sampling costs at so many samples per pixel.
    pub(super) fn uniform_seconds(&self, spp: f64) -> f64 {
        interpolate(self.of(PolicyName::Uniform).map(|r| (r.average_spp, r.seconds(self.clock))), spp)
            .unwrap_or(f64::NAN)
    }

    /// The render of a policy's curve that is nearest to an average of samples per pixel.
    pub(super) fn nearest(&self, policy: PolicyName, spp: f64) -> Option<&Record> {
        let distance = |r: &Record| (r.average_spp / spp).ln().abs();
        self.of(policy).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

/// A policy at a level of uniform sampling, in one scene.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    pub(super) level: u32,
    pub(super) policy: PolicyName,
    /// Render time over uniform's at equal error; in the order of [`Metric::ALL`].
    pub(super) time: Vec<Option<Ratio>>,
    /// Samples over uniform's.
    pub(super) spp: Vec<Option<Ratio>>,
    /// Signed bias at an average of `level` samples per pixel: overall, and of the darkest lit quarter.
    pub(super) bias: [Option<f64>; 2],
    /// Share of the oracle's saving in samples at equal relMSE.
    pub(super) oracle_share: Option<f64>,
}

/// A scene with its rows.
#[derive(Clone, Debug, Serialize)]
pub(super) struct SceneResult {
    #[serde(flatten)]
    pub(super) runs: SceneRuns,
    /// Samples of the best allocation over uniform's, for each level.
    pub(super) oracle: Vec<Option<f64>>,
    pub(super) rows: Vec<Row>,
}

/// A policy at a level, over all scenes.
#[derive(Clone, Debug, Serialize)]
pub(super) struct SummaryRow {
    pub(super) level: u32,
    pub(super) policy: PolicyName,
    pub(super) time: Vec<Mean>,
    pub(super) spp: Vec<Mean>,
    /// The bias farthest from 0 in any scene: overall, and of the darkest lit quarter.
    pub(super) worst_bias: [Option<f64>; 2],
    pub(super) oracle_share: Option<f64>,
}

/// A learned policy against the rule that it starts from, at a level.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Against {
    pub(super) level: u32,
    pub(super) policy: PolicyName,
    /// Render time over that of `threshold`: geometric mean and largest of the scenes where both reach the error. In the order
    /// of [`Metric::ALL`].
    pub(super) time: Vec<Option<[f64; 2]>>,
    /// Samples over those of `threshold`.
    pub(super) spp: Vec<Option<[f64; 2]>>,
}

/// Everything.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Study {
    pub(super) version: &'static str,
    pub(super) levels: Vec<u32>,
    pub(super) policies: Vec<PolicyName>,
    pub(super) metrics: [Metric; 5],
    pub(super) max_spp: u32,
    pub(super) reference_spp: u32,
    pub(super) seed: u64,
    pub(super) seeds: u32,
    pub(super) threads: usize,
    pub(super) clock: Clock,
    pub(super) scenes: Vec<SceneResult>,
    /// Geometric mean of the oracle's ratio over scenes, for each level.
    pub(super) oracle: Vec<Option<f64>>,
    pub(super) summary: Vec<SummaryRow>,
    /// `svm` against `threshold`, for each level.
    pub(super) against: Vec<Against>,
}

impl Study {
    pub(super) fn new(plan: &Plan, scenes: Vec<SceneRuns>) -> Self {
        let scenes: Vec<SceneResult> = scenes.into_iter().map(|runs| result(plan, runs)).collect();
        let oracle: Vec<Option<f64>> = (0..plan.levels.len())
            .map(|i| geometric(&scenes.iter().filter_map(|s| s.oracle[i]).collect::<Vec<_>>()))
            .collect();
        let mut summary = Vec::new();
        for (&level, oracle) in plan.levels.iter().zip(&oracle) {
            for &policy in &plan.policies {
                summary.push(summarise(level, policy, &scenes, *oracle));
            }
        }
        let both = [PolicyName::Svm, PolicyName::Threshold];
        let against = match both.iter().all(|p| plan.policies.contains(p)) {
            true => plan.levels.iter().map(|&level| against(level, both, &scenes)).collect(),
            false => Vec::new(),
        };
        let threads = match plan.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        };
        Self {
            version: crate::VERSION,
            levels: plan.levels.clone(),
            policies: plan.policies.clone(),
            metrics: Metric::ALL,
            max_spp: plan.max_spp,
            reference_spp: plan.reference_spp,
            seed: plan.seed,
            seeds: plan.seeds,
            threads,
            clock: plan.clock,
            scenes,
            oracle,
            summary,
            against,
        }
    }

    /// What is compared, in words.
    pub(super) fn time_name(&self) -> &'static str {
        match self.clock {
            Clock::Wall => "render time",
            Clock::Cpu => "processor time",
        }
    }

    /// What the means are of.
    pub(super) fn mean_of(&self) -> String {
        match self.scenes.len() {
            1 => "one scene".to_owned(),
            n => format!("geometric mean of {n} scenes"),
        }
    }
}

fn result(plan: &Plan, runs: SceneRuns) -> SceneResult {
    let bounds = Bounds { min_spp: MIN_SPP, max_spp: plan.max_spp };
    let mut rows = Vec::new();
    let mut oracles = Vec::new();
    for &level in &plan.levels {
        let spp = f64::from(level);
        let oracle = oracle_ratio(&runs.reference.variances, spp, bounds);
        oracles.push(oracle);
        for &policy in &plan.policies {
            let ratios =
                |curve: fn(&SceneRuns, PolicyName, Metric) -> Curve, at: f64| -> Vec<Option<Ratio>> {
                    let uniform = PolicyName::Uniform;
                    let ratio =
                        |m: Metric| Ratio::at_cost(&curve(&runs, policy, m), &curve(&runs, uniform, m), at);
                    Metric::ALL.into_iter().map(ratio).collect()
                };
            let samples = ratios(SceneRuns::spp_curve, spp);
            let bias =
                |f: fn(&Record) -> f64| interpolate(runs.of(policy).map(|r| (r.average_spp, f(r))), spp);
            rows.push(Row {
                level,
                policy,
                time: ratios(SceneRuns::time_curve, runs.uniform_seconds(spp)),
                oracle_share: match samples[0] {
                    Some(Ratio::Exactly(r)) => share(r, oracle),
                    _ => None,
                },
                spp: samples,
                bias: [bias(|r| r.bias), bias(|r| r.bias_dark.unwrap_or(f64::NAN))],
            });
        }
    }
    SceneResult { runs, oracle: oracles, rows }
}

/// Part of what the oracle saves, if that is anything to speak of.
fn share(ratio: f64, oracle: Option<f64>) -> Option<f64> {
    oracle.filter(|o| *o < 0.99 && ratio.is_finite()).map(|o| (1.0 - ratio) / (1.0 - o))
}

fn geometric(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    (n > 0.0).then(|| (values.iter().map(|v| v.ln()).sum::<f64>() / n).exp())
}

fn summarise(level: u32, policy: PolicyName, scenes: &[SceneResult], oracle: Option<f64>) -> SummaryRow {
    let rows: Vec<&Row> =
        scenes.iter().flat_map(|s| &s.rows).filter(|r| r.level == level && r.policy == policy).collect();
    let means = |f: fn(&Row) -> &Vec<Option<Ratio>>| -> Vec<Mean> {
        let of = |i: usize| Mean::of(&rows.iter().filter_map(|r| f(r)[i]).collect::<Vec<_>>());
        (0..Metric::ALL.len()).map(of).collect()
    };
    let worst = |i: usize| {
        rows.iter().filter_map(|r| r.bias[i]).max_by(|a: &f64, b: &f64| a.abs().total_cmp(&b.abs()))
    };
    let spp = means(|r| &r.spp);
    SummaryRow {
        level,
        policy,
        time: means(|r| &r.time),
        oracle_share: if spp[0].unreached + spp[0].at_most == 0 { share(spp[0].value, oracle) } else { None },
        spp,
        worst_bias: [worst(0), worst(1)],
    }
}

/// Ratios of the first policy's cost to the second's at equal error.
fn against(level: u32, [policy, base]: [PolicyName; 2], scenes: &[SceneResult]) -> Against {
    let row = |s: &'_ SceneResult, p: PolicyName, i: usize, f: fn(&Row) -> &Vec<Option<Ratio>>| {
        let row = s.rows.iter().find(|r| r.level == level && r.policy == p)?;
        match f(row)[i] {
            Some(Ratio::Exactly(v)) => Some(v),
            _ => None,
        }
    };
    let ratios = |f: fn(&Row) -> &Vec<Option<Ratio>>| -> Vec<Option<[f64; 2]>> {
        let of = |i: usize| {
            let all: Vec<f64> =
                scenes.iter().filter_map(|s| Some(row(s, policy, i, f)? / row(s, base, i, f)?)).collect();
            Some([geometric(&all)?, all.iter().copied().fold(0.0, f64::max)])
        };
        (0..Metric::ALL.len()).map(of).collect()
    };
    Against { level, policy, time: ratios(|r| &r.time), spp: ratios(|r| &r.spp) }
}
