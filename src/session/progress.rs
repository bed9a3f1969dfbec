//! Progress for people (a bar or lines on standard error) and for machines (JSON lines on standard output).

use super::checkpoint::Timer;
use super::console::note;
use super::tev::Tev;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use sparing_adaptive::layers::{Observe, Progress, StoppedBy};
use sparing_adaptive::state::State;
use sparing_image::film::Film;
use std::io::{IsTerminal, Write};
use std::time::Instant;

/// How to report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum ProgressMode {
    /// A bar on a terminal, else a line a wave.
    #[default]
    Auto,
    /// A bar.
    Tty,
    /// One JSON object a line on standard output.
    Json,
    /// `ALF_PROGRESS 35%` lines on standard output, as render farms read them.
    Alf,
    /// Nothing.
    None,
}

fn fraction(p: &Progress) -> f64 {
    p.done as f64 / p.total.max(1) as f64
}

fn eta_seconds(p: &Progress) -> Option<f64> {
    let f = fraction(p);
    (f > 0.0).then(|| p.start.elapsed().as_secs_f64() * (1.0 - f) / f)
}

/// Reports a render.
pub struct Observer {
    bar: Option<ProgressBar>,
    json: bool,
    alf: bool,
    timer: Option<Timer>,
    lines: bool,
    tev: Option<Tev>,
}

impl Observer {
    /// An observer; `tev` is a connected viewer.
    #[must_use]
    pub fn new(mode: ProgressMode, tev: Option<Tev>) -> Self {
        let tty = std::io::stderr().is_terminal();
        let bar = (mode == ProgressMode::Tty || (mode == ProgressMode::Auto && tty)).then(|| {
            let bar = ProgressBar::new(1000);
            let style = ProgressStyle::with_template("{bar:40} {percent:>3}%  {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        let is = |wanted| mode == wanted;
        let lines = is(ProgressMode::Auto) && !tty;
        Self { bar, json: is(ProgressMode::Json), alf: is(ProgressMode::Alf), timer: None, lines, tev }
    }

    /// Writes checkpoints, too.
    pub fn keep(&mut self, timer: Option<Timer>) {
        self.timer = timer;
    }

    /// What writes checkpoints, taken back.
    pub fn timer(&mut self) -> Option<Timer> {
        self.timer.take()
    }

    /// Called once at the end, when everything is saved.
    pub fn finish(&self, stopped_by: StoppedBy) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        if self.alf && !matches!(stopped_by, StoppedBy::Interrupt) {
            emit(&"ALF_PROGRESS 100%");
        }
        if self.json {
            emit(&json!({ "event": "done", "stopped_by": stopped_by }));
        }
    }
}

impl Observe for Observer {
    fn checkpoint_due(&self) -> Option<Instant> {
        self.timer.as_ref()?.due()
    }

    fn checkpoint(&mut self, state: &State, now: bool) {
        if let Some(timer) = &mut self.timer {
            timer.visit(state, now);
        }
    }

    fn tick(&self, p: &Progress) {
        let eta = eta_seconds(p);
        if let Some(bar) = &self.bar {
            bar.set_position((fraction(p) * 1000.0) as u64);
            bar.set_message(format!(
                "{} spp  {} pixels active  {} left",
                p.spp,
                p.active_pixels,
                eta.map_or("?".to_owned(), clock)
            ));
        }
        if self.alf {
            emit(&format_args!("ALF_PROGRESS {:.0}%", (fraction(p) * 100.0).min(99.0)));
        }
        if self.json {
            emit(&json!({
                "event": "progress",
                "phase": "sampling",
                "fraction": fraction(p),
                "spp": p.spp,
                "active_pixels": p.active_pixels,
                "samples": p.done,
                "seconds": p.start.elapsed().as_secs_f64(),
                "eta_seconds": eta,
            }));
        }
    }

    fn barrier(&mut self, film: &Film, p: &Progress) {
        self.tick(p);
        if self.lines {
            note(format_args!(
                "{:>4.0} %  {} spp  {} pixels active  {}",
                fraction(p) * 100.0,
                p.spp,
                p.active_pixels,
                clock(p.start.elapsed().as_secs_f64())
            ));
        }
        if let Some(Err(e)) = self.tev.as_mut().map(|tev| tev.update(film)) {
            note(format_args!("warning: the viewer is gone: {e}"));
            self.tev = None;
        }
    }
}

fn emit(value: &dyn std::fmt::Display) {
    // A closed pipe is the reader's decision, not an error.
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "{value}").and_then(|()| out.flush());
}

/// Seconds as people write them.
#[must_use]
pub fn clock(seconds: f64) -> String {
    let s = seconds.round() as u64;
    match (s / 3600, s / 60 % 60, s % 60) {
        (0, 0, _) => format!("{seconds:.1} s"),
        (0, m, s) => format!("{m} min {s:02} s"),
        (h, m, _) => format!("{h} h {m:02} min"),
    }
}
