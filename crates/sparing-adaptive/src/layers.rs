//! The loop: sample a layer, look, decide, again.

use crate::audit::Audit;
use crate::budget::afford;
use crate::goal::{Bounds, predicted_error};
use crate::ledger::Ledger;
use crate::policy::{Barrier, Decisions, Policy, plan_bounds};
use crate::state::State;
use crate::view::View;
use serde::{Deserialize, Serialize};
use sparing_image::film::{Film, Tile};
use sparing_render::Renderer;
use sparing_render::integrator::{TraceStatistics, Wave};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// When to stop, whatever the policy says.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Least and most samples of a pixel.
    pub bounds: Bounds,
    /// Time for sampling and deciding. Where it does not suffice for all pixels that want to go on, those with the largest
    /// decision values do ([`afford`]). Even the first layer ends with it; without any time no sample is taken.
    pub time: Option<Duration>,
    /// What radiance is multiplied by before it is judged; by default what the first layer suggests.
    pub exposure: Option<f32>,
}

/// Why a render stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StoppedBy {
    /// All pixels have the most samples.
    Spp,
    /// The policy is content with all pixels.
    Policy,
    /// The time limit.
    TimeLimit,
    /// A signal.
    Interrupt,
}

/// One layer, afterwards.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Layer {
    /// Most samples that a pixel has afterwards.
    pub spp: u32,
    /// Pixels sampled.
    pub active_pixels: u64,
    /// Seconds of sampling.
    pub sample_seconds: f64,
    /// Seconds of deciding who goes on after it.
    pub decide_seconds: f64,
}

/// A finished render.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Layers in order.
    pub layers: Vec<Layer>,
    /// Rays traced.
    pub rays: TraceStatistics,
    /// Why it ended.
    pub stopped_by: StoppedBy,
    /// Seconds of sampling and deciding.
    pub seconds: f64,
    /// What radiance was multiplied by; `None` if no decision depended on it.
    pub exposure: Option<f32>,
    /// Predicted mean CIEDE2000 error of the picture at that exposure, if the policy looked at errors.
    pub predicted_error: Option<f64>,
    /// Samples of the audit, a second render of few pixels from which the error is measured; not part of the film.
    pub audit_samples: u64,
    /// The last decision values, one a pixel in rows; empty if the policy has none.
    pub decisions: Vec<f32>,
}

/// Where a render is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// When sampling began.
    pub start: Instant,
    /// Most samples per pixel that the layer aims at.
    pub spp: u32,
    /// Pixels that are sampled in it.
    pub active_pixels: u64,
    /// Samples taken.
    pub done: u64,
    /// Samples at most.
    pub total: u64,
}

/// Watches a render.
pub trait Observe: Sync {
    /// Called several times a second, from another thread.
    fn tick(&self, progress: &Progress);
    /// Called at every barrier.
    fn barrier(&mut self, film: &Film, progress: &Progress);
    /// When the next checkpoint is due: sampling stops at the next pixel then, and goes on after it.
    fn checkpoint_due(&self) -> Option<Instant> {
        None
    }
    /// Called when a checkpoint is due (`now`), and after every layer.
    fn checkpoint(&mut self, _state: &State, _now: bool) {}
}

/// For renders that nobody watches.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unwatched;

impl Observe for Unwatched {
    fn tick(&self, _progress: &Progress) {}
    fn barrier(&mut self, _film: &Film, _progress: &Progress) {}
}

/// Renders until the policy is content, a limit is reached or `interrupt` is set. The state may come from an earlier render that was
/// interrupted, at any moment: with the same policy, bounds and exposure the result is the same bit for bit.
pub fn render(
    renderer: &Renderer<'_>,
    state: &mut State,
    policy: &mut dyn Policy,
    limits: &Limits,
    interrupt: &AtomicBool,
    observer: &mut dyn Observe,
) -> Outcome {
    let start = Instant::now();
    state.film.correction.clear(); // of an earlier render
    let bounds = limits.bounds;
    let pixels = u64::from(state.film.width()) * u64::from(state.film.height());
    let total = (pixels * u64::from(bounds.max_spp)).saturating_sub(state.base_samples);
    let deadline = limits.time.and_then(|t| start.checked_add(t));
    let mut outcome = Outcome {
        layers: std::mem::take(&mut state.layers),
        rays: state.rays,
        stopped_by: StoppedBy::Spp,
        seconds: state.seconds,
        exposure: limits.exposure.or(state.exposure),
        predicted_error: None,
        audit_samples: 0,
        decisions: Vec::new(),
    };
    let mut counts = state.film.map(|t, i| t.pixels[i].count());
    let mut done = counts.iter().map(|n| u64::from(*n)).sum::<u64>().saturating_sub(state.base_samples);
    let mut look =
        Look { view: None, audit: policy.wants_audit().then(|| Audit::new(renderer, &state.film)) };
    let mut held_back = false;
    let targets = match std::mem::take(&mut state.targets) {
        targets if targets.len() == counts.len() => targets,
        _ => vec![policy.first_target(bounds); counts.len()],
    };
    let mut decisions = Decisions { targets, ..Decisions::default() };
    if counts.iter().any(|n| *n > 0) && pending(&counts, &decisions.targets).is_none() {
        // The film comes from an earlier render: it stands at a barrier.
        look.follow(&state.film, &mut outcome);
        decisions = decide(policy, state, bounds, &mut look, &mut outcome, |_| false);
    }
    loop {
        let Some((spp, active_pixels)) = pending(&counts, &decisions.targets) else {
            let all = decisions.targets.iter().all(|&t| t >= bounds.max_spp);
            outcome.stopped_by = match (held_back, all) {
                (true, _) => StoppedBy::TimeLimit,
                (false, true) => StoppedBy::Spp,
                (false, false) => StoppedBy::Policy,
            };
            break;
        };
        if deadline.is_some_and(|d| Instant::now() >= d) {
            outcome.stopped_by = StoppedBy::TimeLimit;
            break;
        }
        let layer_start = Instant::now();
        let progress = |done| Progress { start, spp, active_pixels, done, total };
        let mut taken = 0;
        loop {
            let until = match (deadline, observer.checkpoint_due()) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            };
            let sampled = sample(renderer, &mut state.film, &decisions.targets, until, interrupt, |more| {
                observer.tick(&progress(done + more));
            });
            outcome.rays += sampled.rays;
            done += sampled.taken;
            taken += sampled.taken;
            let over = deadline.is_some_and(|d| Instant::now() >= d);
            if !sampled.stopped || over || interrupt.load(Ordering::Relaxed) {
                break;
            }
            state.keep(&outcome, &decisions, start);
            observer.checkpoint(state, true);
        }
        if !interrupt.load(Ordering::Relaxed) {
            look.follow(&state.film, &mut outcome);
        }
        let sample_seconds = layer_start.elapsed().as_secs_f64();
        observer.barrier(&state.film, &progress(done));
        let stopped = if interrupt.load(Ordering::Relaxed) {
            Some(StoppedBy::Interrupt)
        } else if limits.time.is_some_and(|t| start.elapsed() >= t) && done < total {
            Some(StoppedBy::TimeLimit)
        } else {
            None
        };
        let decide_start = Instant::now();
        if stopped.is_none() {
            counts.iter_mut().zip(&decisions.targets).for_each(|(n, target)| *n = (*n).max(*target));
            decisions = decide(policy, state, bounds, &mut look, &mut outcome, |decisions| {
                held_back = deadline.is_some_and(|d| {
                    // As many as the layer just rendered would be in the time that is left.
                    let left = d.saturating_duration_since(Instant::now()).as_secs_f64();
                    afford(decisions, &counts, (taken as f64 / sample_seconds * left) as u64)
                });
                held_back
            });
        }
        let decide_seconds = decide_start.elapsed().as_secs_f64();
        outcome.layers.push(Layer { spp, active_pixels, sample_seconds, decide_seconds });
        state.keep(&outcome, &decisions, start);
        if let Some(stopped_by) = stopped {
            outcome.stopped_by = stopped_by;
            break;
        }
        observer.checkpoint(state, false);
    }
    if let Some(exposure) = outcome.exposure.filter(|_| policy.uses_exposure()) {
        let barrier = look.barrier(&state.film, &state.ledger, bounds, exposure);
        outcome.predicted_error = Some(predicted_error(barrier.view()));
        let counts = state.film.map(|t, i| t.pixels[i].count());
        let stopped_short = pending(&counts, &decisions.targets).is_some();
        let plans = plan_bounds(policy, bounds);
        let correction = state.ledger.correction(&state.film, barrier.view(), plans, stopped_short);
        state.film.correction = correction;
    }
    state.keep(&outcome, &decisions, start);
    outcome.decisions = decisions.values;
    outcome.seconds = state.seconds;
    outcome
}

/// What is kept from barrier to barrier besides film and ledger.
struct Look<'a> {
    view: Option<View>,
    audit: Option<Audit<'a>>,
}

impl Look<'_> {
    /// Brings the audit to where the film is.
    fn follow(&mut self, film: &Film, outcome: &mut Outcome) {
        if let Some(audit) = &mut self.audit {
            outcome.rays += audit.follow(film);
            outcome.audit_samples = audit.samples();
        }
    }

    fn barrier<'b>(
        &mut self,
        film: &'b Film,
        ledger: &'b Ledger,
        bounds: Bounds,
        exposure: f32,
    ) -> Barrier<'b> {
        let mut barrier = Barrier::with_view(film, ledger, bounds, exposure, self.view.take());
        if let Some(audit) = &self.audit {
            let scale = audit.error_scale(barrier.view());
            barrier.set_error_scale(scale);
        }
        barrier
    }
}

/// Asks the policy; notes the exposure, the threshold and who goes on beyond the plan, and keeps the view. `hold_back` may take pixels
/// out, and says whether it did.
fn decide(
    policy: &mut dyn Policy,
    state: &mut State,
    bounds: Bounds,
    look: &mut Look<'_>,
    outcome: &mut Outcome,
    hold_back: impl FnOnce(&mut Decisions) -> bool,
) -> Decisions {
    if policy.uses_exposure() && outcome.exposure.is_none() {
        outcome.exposure = Some(View::auto_exposure(&state.film));
    }
    let exposure = outcome.exposure.unwrap_or(1.0);
    let barrier = look.barrier(&state.film, &state.ledger, bounds, exposure);
    let mut decisions = policy.decide(&barrier);
    if hold_back(&mut decisions) {
        decisions.lambda = decisions.lambda.map(|_| f64::INFINITY);
    }
    let passed = barrier.passed(&decisions, plan_bounds(policy, bounds));
    look.view = barrier.into_view();
    state.ledger.note(passed, &decisions);
    decisions
}

/// The most samples that a pixel is to get, and the number of pixels that get any; `None` if no pixel does.
fn pending(counts: &[u32], targets: &[u32]) -> Option<(u32, u64)> {
    let (mut spp, mut active) = (0, 0);
    for (&count, &target) in counts.iter().zip(targets) {
        if target > count {
            spp = spp.max(target);
            active += 1;
        }
    }
    (active > 0).then_some((spp, active))
}

/// What one pass over the film did.
struct Sampled {
    rays: TraceStatistics,
    taken: u64,
    /// Whether it was told to stop, so that pixels may be below their targets.
    stopped: bool,
}

/// Brings every pixel to its target, or as far as it gets until then.
fn sample(
    renderer: &Renderer<'_>,
    film: &mut Film,
    targets: &[u32],
    deadline: Option<Instant>,
    interrupt: &AtomicBool,
    report: impl Fn(u64) + Sync,
) -> Sampled {
    let wave = Wave::default();
    let finished = AtomicBool::new(false);
    let (width, [x0, y0, ..]) = (film.width() as usize, film.crop);
    let target = |tile: &Tile, index: usize| {
        let (x, y) = tile.position(index);
        targets[(y - y0) as usize * width + (x - x0) as usize]
    };
    let rays = std::thread::scope(|scope| {
        let watcher = scope.spawn(|| watch(&wave, &finished, interrupt, deadline, &report));
        let rays = renderer.run(film, &wave, target);
        finished.store(true, Ordering::Relaxed);
        watcher.thread().unpark(); // the layer does not wait for the end of a pause
        rays
    });
    let stopped = wave.stop.load(Ordering::Relaxed);
    Sampled { rays, taken: wave.samples.load(Ordering::Relaxed), stopped }
}

/// Watches a layer from a thread of its own: stops it on a signal or at the deadline, and reports.
fn watch(
    wave: &Wave,
    finished: &AtomicBool,
    interrupt: &AtomicBool,
    deadline: Option<Instant>,
    report: &(impl Fn(u64) + Sync),
) {
    let mut last = Instant::now();
    while !finished.load(Ordering::Relaxed) {
        let mut pause = Duration::from_millis(5);
        if let Some(d) = deadline {
            pause = pause.min(d.saturating_duration_since(Instant::now()));
        }
        std::thread::park_timeout(pause);
        if interrupt.load(Ordering::Relaxed) || deadline.is_some_and(|d| Instant::now() >= d) {
            wave.stop.store(true, Ordering::Relaxed);
            return;
        }
        if last.elapsed() > Duration::from_millis(100) {
            report(wave.samples.load(Ordering::Relaxed));
            last = Instant::now();
        }
    }
}
