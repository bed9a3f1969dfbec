//! The measures of one render.

use super::plan::{Clock, Knob, Plan, PolicyName};
use super::references::Reference;
use super::stage::{Rendered, Stage};
use anyhow::Context;
use serde::{Deserialize, Serialize};
use sparing_adaptive::goal::predicted_error;
use sparing_adaptive::view::{BLOCK_EXCESS, View};
use sparing_image::exr::{film_layers, write_exr};
use sparing_image::film::Film;
use sparing_image::metrics::{Exposure, REL_MSE_EPSILON, compare};
use std::path::PathBuf;

/// The errors that policies are compared at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Metric {
    RelMse,
    Mean,
    P95,
    P99,
    Flip,
}

impl Metric {
    pub(super) const ALL: [Self; 5] = [Self::RelMse, Self::Mean, Self::P95, Self::P99, Self::Flip];

    /// As people read it.
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::RelMse => "relMSE",
            Self::Mean => "mean CIEDE2000",
            Self::P95 => "p95 CIEDE2000",
            Self::P99 => "p99 CIEDE2000",
            Self::Flip => "mean FLIP",
        }
    }

    /// For files and narrow columns.
    pub(super) fn short(self) -> &'static str {
        match self {
            Self::RelMse => "relMSE",
            Self::Mean => "mean-dE",
            Self::P95 => "p95-dE",
            Self::P99 => "p99-dE",
            Self::Flip => "FLIP",
        }
    }

    pub(super) fn of(self, r: &Record) -> f64 {
        match self {
            Self::RelMse => r.rel_mse,
            Self::Mean => r.mean_de,
            Self::P95 => r.p95_de,
            Self::P99 => r.p99_de,
            Self::Flip => r.flip,
        }
    }
}

/// One render, or what several of the same setting give on average.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Record {
    pub(super) policy: PolicyName,
    #[serde(flatten)]
    pub(super) knob: Knob,
    /// Time that sampling and deciding took.
    pub(super) wall_seconds: f64,
    /// Processor time of it over the number of threads.
    pub(super) cpu_seconds: Option<f64>,
    /// Share of the time that went into deciding.
    pub(super) decide_share: f64,
    pub(super) average_spp: f64,
    pub(super) rel_mse: f64,
    pub(super) mean_de: f64,
    pub(super) p95_de: f64,
    pub(super) p99_de: f64,
    pub(super) flip: f64,
    /// As in [`Comparison`](sparing_image::metrics::Comparison).
    pub(super) bias: f64,
    /// None if the reference is black.
    pub(super) bias_dark: Option<f64>,
    /// The mean CIEDE2000 error that the render reports; where it reports none, what the film predicts.
    pub(super) predicted_de: f64,
    /// The relMSE that it predicts.
    pub(super) predicted_rel_mse: f64,
    /// What it was rendered from and by.
    key: String,
}

impl Record {
    /// Measures a render.
    pub(super) fn new(
        policy: PolicyName,
        knob: Knob,
        rendered: &Rendered,
        reference: &Reference,
        key: String,
    ) -> anyhow::Result<Self> {
        let Rendered { film, outcome, cpu_seconds } = rendered;
        let [w, h] = film.full_size;
        let scale = reference.exposure;
        let c = compare(&film.beauty(), &reference.pixels, w, h, Exposure::Scale(scale))?;
        if c.compared == 0 {
            anyhow::bail!("no pixel of the reference is finite: there is nothing to compare with");
        }
        let view = View::new(film, scale);
        let deciding: f64 = outcome.layers.iter().map(|l| l.decide_seconds).sum();
        Ok(Self {
            policy,
            knob,
            wall_seconds: outcome.seconds,
            cpu_seconds: *cpu_seconds,
            decide_share: deciding / outcome.seconds.max(1e-9),
            average_spp: film.samples() as f64 / (f64::from(w) * f64::from(h)),
            rel_mse: c.rel_mse,
            mean_de: c.ciede2000.mean,
            p95_de: c.ciede2000.p95,
            p99_de: c.ciede2000.p99,
            flip: c.flip.mean,
            bias: c.signed_bias,
            bias_dark: Some(c.signed_bias_dark).filter(|b| b.is_finite()),
            predicted_de: outcome.predicted_error.unwrap_or_else(|| predicted_error(&view)),
            predicted_rel_mse: predicted_rel_mse(&view),
            key,
        })
    }

    /// The mean of renders with several seeds, and the medians of their times; `None` of none.
    pub(super) fn mean(records: &[Self]) -> Option<Self> {
        let n = records.len() as f64;
        let mean = |f: fn(&Self) -> f64| records.iter().map(f).sum::<f64>() / n;
        let all = |f: fn(&Self) -> Option<f64>| records.iter().map(f).collect::<Option<Vec<f64>>>();
        let first = records.first()?;
        Some(Self {
            wall_seconds: median(records.iter().map(|r| r.wall_seconds).collect()),
            cpu_seconds: all(|r| r.cpu_seconds).map(median),
            decide_share: median(records.iter().map(|r| r.decide_share).collect()),
            average_spp: mean(|r| r.average_spp),
            rel_mse: mean(|r| r.rel_mse),
            mean_de: mean(|r| r.mean_de),
            p95_de: mean(|r| r.p95_de),
            p99_de: mean(|r| r.p99_de),
            flip: mean(|r| r.flip),
            bias: mean(|r| r.bias),
            bias_dark: all(|r| r.bias_dark).map(|b| b.iter().sum::<f64>() / n),
            predicted_de: mean(|r| r.predicted_de),
            predicted_rel_mse: mean(|r| r.predicted_rel_mse),
            key: first.key.clone(),
            ..*first
        })
    }

    /// The time that counts.
    pub(super) fn seconds(&self, clock: Clock) -> f64 {
        match clock {
            Clock::Wall => self.wall_seconds,
            Clock::Cpu => self.cpu_seconds.unwrap_or(f64::NAN),
        }
    }

    /// Whether it belongs to the policy's curve.
    pub(super) fn on_curve(&self) -> bool {
        !matches!(self.knob, Knob::Tolerance(_))
    }

    /// What a render depends on, its time included.
    pub(super) fn key(stage: &Stage, plan: &Plan) -> String {
        let [w, h] = stage.size;
        format!(
            "scene {:016x}, {w}x{h}, {} seeds from {} on, at most {} spp, {} threads, reference {} spp, Sparing {}",
            stage.fingerprint,
            plan.seeds,
            plan.seed,
            plan.max_spp,
            plan.threads,
            plan.reference_spp,
            crate::VERSION
        )
    }

    /// Its files without an extension.
    fn path(plan: &Plan, scene: &str, policy: PolicyName, knob: Knob, extension: &str) -> PathBuf {
        let name = format!("{}-{}.{extension}", policy.name(), knob.label());
        plan.folder.join("renders").join(scene).join(name)
    }

    /// Its picture.
    pub(super) fn picture(&self, plan: &Plan, scene: &str) -> PathBuf {
        Self::path(plan, scene, self.policy, self.knob, "exr")
    }

    /// A finished one of the same settings.
    pub(super) fn find(plan: &Plan, scene: &str, policy: PolicyName, knob: Knob, key: &str) -> Option<Self> {
        let text = std::fs::read_to_string(Self::path(plan, scene, policy, knob, "json")).ok()?;
        let record: Self = serde_json::from_str(&text).ok()?;
        let same = record.key == key && record.policy == policy && record.knob.label() == knob.label();
        (same && record.picture(plan, scene).is_file()).then_some(record)
    }

    /// Keeps it: the picture first, so that a record has one.
    pub(super) fn keep(&self, plan: &Plan, scene: &str, film: &Film) -> anyhow::Result<()> {
        let path = self.picture(plan, scene);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        write_exr(&path, &film_layers(film, Vec::new()))?;
        let json = serde_json::to_string_pretty(self)?;
        crate::plot::write_text(&path.with_extension("json"), &json)?;
        Ok(())
    }
}

/// The middle value, or the mean of the two.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let upper = values.len() / 2;
    0.5 * (values[values.len().saturating_sub(1) / 2] + values[upper])
}

/// The mean of the squared standard errors, from block means, in relMSE's terms.
fn predicted_rel_mse(view: &View) -> f64 {
    let channel = |(m, e): (&f32, &f32)| {
        let (m, e) = (f64::from(*m), f64::from(*e) / BLOCK_EXCESS);
        e * e / (m * m + REL_MSE_EPSILON)
    };
    let sum: f64 =
        view.pixels.iter().map(|p| p.mean.iter().zip(&p.error).map(channel).sum::<f64>() / 3.0).sum();
    sum / view.pixels.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_averaged_and_times_are_not() {
        let record = |seconds: f64, error: f64, dark: Option<f64>| Record {
            policy: PolicyName::Svm,
            knob: Knob::Average(24),
            wall_seconds: seconds,
            cpu_seconds: Some(seconds),
            decide_share: 0.5 * seconds,
            average_spp: error,
            rel_mse: error,
            mean_de: error,
            p95_de: error,
            p99_de: error,
            flip: error,
            bias: error,
            bias_dark: dark,
            predicted_de: error,
            predicted_rel_mse: error,
            key: "key".to_owned(),
        };
        let all = [record(9.0, 1.0, Some(0.0)), record(1.0, 2.0, Some(1.0)), record(2.0, 6.0, Some(5.0))];
        let mean = Record::mean(&all).expect("there are some");
        assert_eq!((mean.wall_seconds, mean.cpu_seconds, mean.decide_share), (2.0, Some(2.0), 1.0));
        for metric in Metric::ALL {
            assert_eq!(metric.of(&mean), 3.0);
        }
        assert_eq!((mean.average_spp, mean.bias, mean.bias_dark), (3.0, 3.0, Some(2.0)));
        assert_eq!((mean.predicted_de, mean.predicted_rel_mse, mean.key.as_str()), (3.0, 3.0, "key"));
        let two = Record::mean(&[record(1.0, 1.0, None), record(2.0, 2.0, Some(1.0))]).expect("two");
        assert_eq!((two.wall_seconds, two.bias_dark), (1.5, None));
        assert!(Record::mean(&[]).is_none());
    }
}
