//! All renders, one scene after the other, with progress.

use super::plan::{Clock, Knob, Plan, PolicyName};
use super::record::{Metric, Record};
use super::references::Reference;
use super::results::SceneRuns;
use super::stage::{Rendered, Stage};
use crate::session::console::note;
use crate::session::progress::clock;
use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use sparing_adaptive::study::Curve;
use sparing_image::film::Film;
use std::io::IsTerminal;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Renders shorter than this are made three times if there are fewer seeds, and the median time counts.
const SHORT_SECONDS: f64 = 0.4;

/// Runs the whole plan; `None` if interrupted.
pub(super) fn all(plan: &Plan, interrupt: &AtomicBool) -> anyhow::Result<Option<Vec<SceneRuns>>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(plan.threads).build()?;
    let mut progress = Progress::new(plan);
    let mut scenes = Vec::new();
    for file in &plan.scenes {
        let runs = pool.install(|| -> anyhow::Result<Option<SceneRuns>> {
            let stage = Stage::new(file, plan)?;
            scene(&stage, plan, interrupt, &mut progress)
        });
        match runs.with_context(|| format!("cannot study {}", file.path.display()))? {
            Some(runs) => scenes.push(runs),
            None => return Ok(None),
        }
        progress.scenes_left -= 1;
    }
    progress.finish();
    Ok(Some(scenes))
}

fn scene(
    stage: &Stage,
    plan: &Plan,
    interrupt: &AtomicBool,
    progress: &mut Progress,
) -> anyhow::Result<Option<SceneRuns>> {
    progress.begin(stage, plan);
    let begin = Instant::now();
    let Some(reference) = Reference::get(stage, plan, interrupt, progress.bar.as_ref())? else {
        return Ok(None);
    };
    let how = if reference.seconds.is_some() { "rendered" } else { "found" };
    progress.done(f64::from(plan.reference_spp), reference.seconds.map(|_| begin.elapsed().as_secs_f64()));
    if reference.seconds.is_none() {
        progress.expect_references();
    }
    progress.line(format_args!("{}: reference of {} spp {how}", stage.name, reference.spp));
    let key = Record::key(stage, plan);
    let mut records: Vec<Record> = Vec::new();
    let mut warm = false;
    let guess = |policy, knob| plan.guess(policy, knob) * f64::from(plan.seeds);
    for &policy in &plan.policies {
        let knobs = plan.knobs(policy);
        for (i, &knob) in knobs.iter().enumerate() {
            let of_curve = !matches!(knob, Knob::Tolerance(_));
            if of_curve && enough(&records, policy, plan) {
                progress.done(guess(policy, knob), None);
                continue;
            }
            let found = plan.resume.then(|| Record::find(plan, &stage.name, policy, knob, &key)).flatten();
            let (record, fresh) = match found {
                Some(record) => (record, false),
                None => {
                    if !warm {
                        // Caches and clocks settle in a render that does not count.
                        let (mut uniform, bounds) = PolicyName::Uniform.policy(Knob::Spp(8), plan);
                        stage.render(&mut *uniform, bounds, plan.seed, interrupt, None);
                        warm = true;
                    }
                    let begin = Instant::now();
                    let measured = measure(stage, plan, (policy, knob), &reference, interrupt, progress)?;
                    let Some((record, film)) = measured else { return Ok(None) };
                    record.keep(plan, &stage.name, &film)?;
                    progress.done(guess(policy, knob), Some(begin.elapsed().as_secs_f64()));
                    (record, true)
                }
            };
            if !fresh {
                progress.done(guess(policy, knob), None);
            }
            progress.line(format_args!(
                "{}: {} {} ({} of at most {}): {:.1} spp, {}{}",
                stage.name,
                policy.name(),
                knob.label(),
                i + 1,
                knobs.len(),
                record.average_spp,
                clock(record.wall_seconds),
                if fresh { "" } else { ", found" },
            ));
            records.push(record);
        }
    }
    Ok(Some(SceneRuns { name: stage.name.clone(), clock: plan.clock, size: stage.size, reference, records }))
}

/// The renders of a setting, and the first one's film. `None` if interrupted.
fn measure(
    stage: &Stage,
    plan: &Plan,
    (policy, knob): (PolicyName, Knob),
    reference: &Reference,
    interrupt: &AtomicBool,
    progress: &Progress,
) -> anyhow::Result<Option<(Record, Film)>> {
    let (mut records, mut first) = (Vec::new(), None);
    for k in 0..plan.seeds {
        let seed = plan.seed.wrapping_add(u64::from(k));
        let Some(rendered) = timed(stage, plan, (policy, knob), seed, interrupt, progress) else {
            return Ok(None);
        };
        records.push(Record::new(policy, knob, &rendered, reference, Record::key(stage, plan))?);
        first.get_or_insert(rendered.film);
    }
    Ok(Record::mean(&records).zip(first))
}

/// One render; a short one three times, for the median of its times, unless there are as many seeds.
fn timed(
    stage: &Stage,
    plan: &Plan,
    (policy, knob): (PolicyName, Knob),
    seed: u64,
    interrupt: &AtomicBool,
    progress: &Progress,
) -> Option<Rendered> {
    let once = || {
        let (mut policy, bounds) = policy.policy(knob, plan);
        stage.render(&mut *policy, bounds, seed, interrupt, progress.bar.as_ref())
    };
    let first = once()?;
    if first.outcome.seconds >= SHORT_SECONDS || plan.seeds >= 3 {
        return Some(first);
    }
    let mut runs = [first, once()?, once()?];
    let seconds = |r: &Rendered| match plan.clock {
        Clock::Wall => r.outcome.seconds,
        Clock::Cpu => r.cpu_seconds.unwrap_or(f64::NAN),
    };
    runs.sort_by(|a, b| seconds(a).total_cmp(&seconds(b)));
    let [_, median, _] = runs;
    Some(median)
}

/// A sweep goes on to so many times the highest level at most, whether it reaches the errors or not.
const BEYOND: f64 = 4.0;

/// Whether a policy's renders so far reach well beyond the highest level in all metrics, or go far enough without.
fn enough(records: &[Record], policy: PolicyName, plan: &Plan) -> bool {
    let Some(last) = records.iter().rfind(|r| r.policy == policy) else { return false };
    if last.average_spp >= 0.98 * f64::from(plan.max_spp) {
        return true;
    }
    let Some(top) = plan.levels.last().map(|n| f64::from(*n)) else { return true };
    if last.average_spp >= BEYOND * top {
        return true;
    }
    if !policy.ends_early() {
        return false;
    }
    let uniform = |m: Metric| {
        let points = records.iter().filter(|r| r.policy == PolicyName::Uniform);
        Curve::new(points.map(|r| (r.average_spp, m.of(r)))).error_at(top)
    };
    let reached = |m: Metric| uniform(m).is_none_or(|error| m.of(last) <= 0.9 * error);
    Metric::ALL.into_iter().all(reached)
}

/// What is done and what is left, in samples per pixel as guessed beforehand, times pixels.
struct Progress {
    bar: Option<ProgressBar>,
    scenes_left: usize,
    /// Work of a scene, and that without its reference.
    of_scene: f64,
    of_renders: f64,
    /// Work left in this scene.
    left: f64,
    /// Pixels of this scene.
    pixels: f64,
    /// Work that took time, and the time.
    measured: [f64; 2],
}

impl Progress {
    fn new(plan: &Plan) -> Self {
        let guesses = |p: &PolicyName| -> f64 { plan.knobs(*p).iter().map(|k| plan.guess(*p, *k)).sum() };
        let of_renders = plan.policies.iter().map(guesses).sum::<f64>() * f64::from(plan.seeds);
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new((1000 * plan.scenes.len()) as u64);
            let style = ProgressStyle::with_template("{bar:30} {percent:>3}%  {msg}  {prefix}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        Self {
            bar,
            scenes_left: plan.scenes.len(),
            of_scene: of_renders + f64::from(plan.reference_spp),
            of_renders,
            left: 0.0,
            pixels: 1.0,
            measured: [0.0; 2],
        }
    }

    fn begin(&mut self, stage: &Stage, plan: &Plan) {
        self.left = self.of_scene;
        self.pixels = stage.pixels();
        if let Some(bar) = &self.bar {
            bar.set_position((1000 * (plan.scenes.len() - self.scenes_left)) as u64);
        }
    }

    /// A reference was there already: those of the scenes left will be.
    fn expect_references(&mut self) {
        self.of_scene = self.of_renders;
    }

    /// So much work is done; it took time if it was not found.
    fn done(&mut self, spp: f64, seconds: Option<f64>) {
        self.left = (self.left - spp).max(0.0);
        if let Some(seconds) = seconds {
            self.measured[0] += spp * self.pixels;
            self.measured[1] += seconds;
        }
        if let Some(bar) = &self.bar {
            bar.set_position(bar.position() + (1000.0 * spp / self.of_scene) as u64);
            bar.set_message(self.remaining());
        }
    }

    /// The time left at the pace so far.
    fn remaining(&self) -> String {
        let work = (self.left + self.of_scene * self.scenes_left.saturating_sub(1) as f64) * self.pixels;
        let [done, seconds] = self.measured;
        if done > 0.0 { format!("about {} left", clock(work * seconds / done)) } else { String::new() }
    }

    fn line(&self, text: std::fmt::Arguments<'_>) {
        let left = self.remaining();
        let left = if left.is_empty() { left } else { format!("; {left}") };
        match &self.bar {
            Some(bar) => bar.suspend(|| note(text)),
            None => note(format_args!("{text}{left}")),
        }
    }

    fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
