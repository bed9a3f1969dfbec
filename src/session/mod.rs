//! A render from start to stop: waves, limits, progress, statistics.

pub mod console;
pub mod memory;
pub mod progress;
pub mod stats;
pub mod tev;

use progress::{Observer, Progress};
use sparing_image::film::Film;
use sparing_render::Renderer;
use sparing_render::integrator::{TraceStatistics, Wave};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Samples per pixel.
    pub spp: u32,
    /// Time for sampling.
    pub time: Option<Duration>,
}

/// Why a render stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StoppedBy {
    /// All samples were taken.
    Spp,
    /// The time limit.
    TimeLimit,
    /// A signal.
    Interrupt,
}

/// One wave, afterwards.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Layer {
    /// Samples per pixel afterwards.
    pub spp: u32,
    /// Pixels sampled.
    pub active_pixels: u64,
    /// Seconds of sampling.
    pub sample_seconds: f64,
    /// Seconds of deciding who goes on.
    pub decide_seconds: f64,
}

/// A finished render.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Waves in order.
    pub layers: Vec<Layer>,
    /// Rays traced.
    pub rays: TraceStatistics,
    /// Why it ended.
    pub stopped_by: StoppedBy,
    /// Seconds of sampling and deciding.
    pub seconds: f64,
}

/// Largest number of samples between two barriers, so that progress, previews and stops are not far apart.
const MAX_WAVE: u32 = 64;

/// Samples per pixel after each wave: doubling from 8, in steps of at most 64.
pub fn schedule(spp: u32) -> impl Iterator<Item = u32> {
    let mut n = 0;
    std::iter::from_fn(move || {
        if n >= spp {
            return None;
        }
        n = (n + n.clamp(8, MAX_WAVE)).min(spp);
        Some(n)
    })
}

/// Renders until a limit is reached or `interrupt` is set. The observer sees the film at every barrier.
pub fn render(
    renderer: &Renderer<'_>,
    film: &mut Film,
    limits: Limits,
    interrupt: &AtomicBool,
    observer: &mut Observer,
) -> Outcome {
    let start = Instant::now();
    let pixels = u64::from(film.width()) * u64::from(film.height());
    let total = pixels * u64::from(limits.spp);
    let mut outcome = Outcome {
        layers: Vec::new(),
        rays: TraceStatistics::default(),
        stopped_by: StoppedBy::Spp,
        seconds: 0.0,
    };
    let mut done = 0;
    for target in schedule(limits.spp) {
        let wave = Wave { target, ..Wave::default() };
        let wave_start = Instant::now();
        let finished = AtomicBool::new(false);
        let deadline = limits.time.and_then(|t| start.checked_add(t));
        let rays = std::thread::scope(|scope| {
            let (wave, observer, finished) = (&wave, &*observer, &finished);
            scope.spawn(move || {
                watch(wave, finished, interrupt, deadline, |samples| {
                    observer.tick(&Progress {
                        start,
                        spp: target,
                        active_pixels: pixels,
                        done: done + samples,
                        total,
                    });
                });
            });
            let rays = renderer.run(film, wave, |_, _| true);
            finished.store(true, Ordering::Relaxed);
            rays
        });
        done += wave.samples.load(Ordering::Relaxed);
        outcome.rays += rays;
        outcome.layers.push(Layer {
            spp: target,
            active_pixels: pixels,
            sample_seconds: wave_start.elapsed().as_secs_f64(),
            decide_seconds: 0.0,
        });
        observer.barrier(film, &Progress { start, spp: target, active_pixels: pixels, done, total });
        if interrupt.load(Ordering::Relaxed) {
            outcome.stopped_by = StoppedBy::Interrupt;
            break;
        }
        if limits.time.is_some_and(|t| start.elapsed() >= t) && done < total {
            outcome.stopped_by = StoppedBy::TimeLimit;
            break;
        }
    }
    outcome.seconds = start.elapsed().as_secs_f64();
    outcome
}

/// Watches a wave from a thread of its own: stops it on a signal or at the deadline, and reports.
fn watch(
    wave: &Wave,
    finished: &AtomicBool,
    interrupt: &AtomicBool,
    deadline: Option<Instant>,
    report: impl Fn(u64),
) {
    let mut last = Instant::now();
    while !finished.load(Ordering::Relaxed) {
        let mut pause = Duration::from_millis(5);
        if let Some(d) = deadline {
            pause = pause.min(d.saturating_duration_since(Instant::now()));
        }
        std::thread::sleep(pause);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules_double_and_end_at_the_target() {
        assert_eq!(schedule(1).collect::<Vec<_>>(), [1]);
        assert_eq!(schedule(8).collect::<Vec<_>>(), [8]);
        assert_eq!(schedule(100).collect::<Vec<_>>(), [8, 16, 32, 64, 100]);
        assert_eq!(schedule(256).collect::<Vec<_>>(), [8, 16, 32, 64, 128, 192, 256]);
    }
}
