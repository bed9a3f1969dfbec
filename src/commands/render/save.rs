//! What a render leaves behind: pictures, statistics, a line on the terminal.

use super::RenderArguments;
use super::keep::Kept;
use super::plan::{Plan, is_exr, is_standard_output};
use crate::session::console::{note, print};
use crate::session::memory;
use crate::session::progress::{ProgressMode, clock};
use crate::session::stats::Statistics;
use anyhow::Context;
use sparing_adaptive::layers::{Outcome, StoppedBy};
use sparing_adaptive::state::State;
use sparing_image::atomic::AtomicFile;
use sparing_image::exr::{ExrAttribute, film_layers, write_exr};
use sparing_image::film::Film;
use sparing_image::metrics::false_color;
use sparing_image::png::write_png;
use sparing_render::{Needs, Scene};
use sparing_scene::description::SamplerKind;
use std::io::Write;
use std::path::Path;

/// Invalid samples that the statistics name.
const MOST_NAMED: usize = 64;

/// A render, afterwards.
pub(super) struct Run<'a> {
    pub(super) name: &'a str,
    pub(super) plan: &'a Plan,
    pub(super) scene: &'a Scene,
    pub(super) state: &'a State,
    pub(super) outcome: &'a Outcome,
}

impl Run<'_> {
    pub(super) fn statistics(&self, threads: usize, [load_seconds, build_seconds]: [f64; 2]) -> Statistics {
        let Self { plan, scene, outcome, .. } = *self;
        let film = &self.state.film;
        let samples = film.samples().saturating_sub(self.state.base_samples);
        let rays = outcome.rays;
        let (major, minor, patch) = scene.embree().device().version();
        let mut needs = scene.needs();
        needs.set(Needs::AUXILIARY, plan.film.auxiliary);
        needs.set(Needs::SHAPE_COUNT, plan.film.shapes);
        Statistics {
            scene: self.name.to_owned(),
            width: film.width(),
            height: film.height(),
            policy: plan.choice.name().to_owned(),
            model: plan.choice.model().map(str::to_owned),
            seed: plan.settings.seed,
            threads,
            load_seconds,
            build_seconds,
            render_seconds: outcome.seconds,
            samples,
            average_spp: samples as f64 / (f64::from(film.width()) * f64::from(film.height())),
            rays: rays.into(),
            rays_per_second: (rays.camera + rays.bounce + rays.shadow) as f64 / outcome.seconds.max(1e-9),
            layers: outcome.layers.clone(),
            invalid_samples: film.invalid_samples(),
            invalid: film.named_invalid().map(|([x, y], n)| [x, y, n]).take(MOST_NAMED).collect(),
            exposure: outcome.exposure,
            threshold: self.state.ledger.lambdas().iter().rev().copied().find(|l| l.is_finite()),
            predicted_error: outcome.predicted_error,
            audit_samples: outcome.audit_samples,
            stopped_by: outcome.stopped_by,
            peak_memory_bytes: memory::peak_bytes(),
            resident_bytes: memory::resident_bytes(),
            film_bytes: film.bytes(),
            embree_bytes: scene.statistics.embree_bytes,
            geometry_bytes: scene.statistics.geometry_bytes,
            texture_bytes: scene.statistics.texture_bytes,
            embree_version: format!("{major}.{minor}.{patch}"),
            needs: needs.names(),
            skipped: needs.complement().names(),
        }
    }

    /// Writes all pictures and files that were asked for.
    pub(super) fn save(&self, s: &Statistics, arguments: &RenderArguments) -> anyhow::Result<()> {
        let (plan, film) = (self.plan, &self.state.film);
        for path in &plan.outputs {
            if is_exr(path) {
                let mut image = film_layers(film, attributes(plan, s));
                if !self.outcome.decisions.is_empty() {
                    image.push("Decision.Y", self.outcome.decisions.clone());
                }
                write_exr(path, &image)?;
            } else {
                write_png(path, film.width(), film.height(), &film.beauty(), arguments.exposure)?;
            }
        }
        if let Some(path) = &arguments.heat_map {
            write_png(path, film.width(), film.height(), &heat_map(film, plan), 0.0)?;
        }
        if let Some(path) = &arguments.stats {
            write_stats(path, s, arguments.progress)?;
        }
        Ok(())
    }

    /// Writes the part that was rendered.
    pub(super) fn save_shard(
        &self,
        s: &Statistics,
        arguments: &RenderArguments,
        keeper: &Kept,
    ) -> anyhow::Result<()> {
        for path in &self.plan.outputs {
            keeper.write_shard(path, self.state, &self.outcome.decisions, attributes(self.plan, s))?;
        }
        if let Some(path) = &arguments.stats {
            write_stats(path, s, arguments.progress)?;
        }
        Ok(())
    }

    /// The line for people.
    pub(super) fn report(&self, s: &Statistics, arguments: &RenderArguments) {
        let (plan, film) = (self.plan, &self.state.film);
        if s.invalid_samples > 0 {
            let place = s
                .invalid
                .first()
                .map_or(String::new(), |[x, y, n]| format!("; the first: --pixel {x},{y} --sample {n}"));
            note(format_args!(
                "warning: {} samples were not finite or negative and count as black{place}",
                s.invalid_samples
            ));
        }
        let empty = film.map(|t, i| t.pixels[i].count() == 0).into_iter().filter(|empty| *empty).count();
        if empty > 0 {
            note(format_args!("warning: {empty} pixels got no sample before the stop and are black"));
        }
        if matches!(arguments.progress, ProgressMode::None | ProgressMode::Json | ProgressMode::Alf) {
            return;
        }
        let files: Vec<String> = plan.outputs.iter().map(|p| p.display().to_string()).collect();
        note(format_args!(
            "{}: {}x{}, {:.1} samples per pixel, {} ({:.2} million samples and {:.1} million rays a second)",
            files.join(", "),
            s.width,
            s.height,
            s.average_spp,
            clock(s.render_seconds),
            s.samples as f64 / s.render_seconds.max(1e-9) / 1e6,
            s.rays_per_second / 1e6,
        ));
        if let Some(error) = s.predicted_error {
            note(format_args!(
                "predicted error: {error:.2} just noticeable differences (CIEDE2000) on average"
            ));
        }
        if matches!(s.stopped_by, StoppedBy::TimeLimit | StoppedBy::Interrupt) {
            let kept = match (&arguments.shard, &arguments.checkpoint) {
                (None, _) => "the picture so far is saved",
                (Some(_), Some(_)) => "the part so far is in the checkpoint",
                (Some(_), None) => "a part that is not finished is not written: --checkpoint would keep it",
            };
            note(format_args!("stopped by {}; {kept}", stop_name(s.stopped_by)));
        }
    }
}

fn attributes(plan: &Plan, s: &Statistics) -> Vec<(String, ExrAttribute)> {
    let text = |v: &str| ExrAttribute::String(v.to_owned());
    [
        ("software", text(&format!("Sparing {}", crate::VERSION))),
        ("sparing.scene", text(&s.scene)),
        ("sparing.policy", text(&s.policy)),
        (
            "sparing.sampler",
            text(if plan.settings.sampler == SamplerKind::Sobol { "sobol" } else { "independent" }),
        ),
        ("sparing.seed", text(&s.seed.to_string())),
        ("sparing.maxDepth", ExrAttribute::Int(plan.settings.max_depth.try_into().unwrap_or(i32::MAX))),
        ("sparing.spp", ExrAttribute::Int(plan.choice.bounds.max_spp.try_into().unwrap_or(i32::MAX))),
        ("sparing.averageSpp", ExrAttribute::Double(s.average_spp)),
        ("sparing.renderSeconds", ExrAttribute::Double(s.render_seconds)),
        ("sparing.stoppedBy", text(stop_name(s.stopped_by))),
        ("sparing.embree", text(&s.embree_version)),
    ]
    .into_iter()
    .chain(s.exposure.map(|x| ("sparing.exposure", ExrAttribute::Float(x))))
    .chain(s.predicted_error.map(|x| ("sparing.predictedError", ExrAttribute::Double(x))))
    .map(|(k, v)| (k.to_owned(), v))
    .chain(plan.camera.clone())
    .collect()
}

fn stop_name(s: StoppedBy) -> &'static str {
    match s {
        StoppedBy::Spp => "spp",
        StoppedBy::Policy => "policy",
        StoppedBy::TimeLimit => "time-limit",
        StoppedBy::Interrupt => "interrupt",
    }
}

fn write_stats(path: &Path, s: &Statistics, progress: ProgressMode) -> anyhow::Result<()> {
    if is_standard_output(path) {
        // Among progress lines the statistics are one line too.
        let one_line = progress == ProgressMode::Json;
        return print(if one_line { serde_json::to_string(s)? } else { serde_json::to_string_pretty(s)? });
    }
    let json = serde_json::to_string_pretty(s)?;
    let mut file = AtomicFile::create(path)?;
    file.write_all(json.as_bytes())
        .and_then(|()| file.write_all(b"\n"))
        .with_context(|| format!("cannot write {}", path.display()))?;
    file.commit()?;
    Ok(())
}

/// Sample counts in false colour, by their logarithm between the least and the most that were allowed.
fn heat_map(film: &Film, plan: &Plan) -> Vec<[f32; 3]> {
    let bounds = plan.choice.bounds;
    let log = |n: u32| (n.max(1) as f32).log2();
    let (low, high) = (log(bounds.min_spp.min(bounds.max_spp)), log(bounds.max_spp));
    film.map(|t, i| false_color(((log(t.pixels[i].count()) - low) / (high - low).max(1e-3)).clamp(0.0, 1.0)))
}
