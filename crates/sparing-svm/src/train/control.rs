//! Progress and the time limit of many fits.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Called after each fit, from any thread.
pub type ProgressFn<'a> = dyn Fn(Progress) + Sync + 'a;

/// How far it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Fits that are finished.
    pub done: usize,
    /// Fits in all.
    pub total: usize,
}

/// Watching and stopping many fits. The default does neither.
#[derive(Clone, Copy, Default)]
pub struct Control<'a> {
    /// Called after each fit.
    pub progress: Option<&'a ProgressFn<'a>>,
    /// No fit begins after this moment; those that run are finished.
    pub deadline: Option<Instant>,
}

/// Counts the fits of one run.
pub(super) struct Counter<'a> {
    control: &'a Control<'a>,
    done: AtomicUsize,
    total: usize,
}

impl<'a> Counter<'a> {
    pub(super) fn new(control: &'a Control<'a>, total: usize) -> Self {
        Self { control, done: AtomicUsize::new(0), total }
    }

    pub(super) fn run<T>(&self, fit: impl FnOnce() -> T) -> Option<T> {
        if self.control.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            return None;
        }
        let result = fit();
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(progress) = self.control.progress {
            progress(Progress { done, total: self.total });
        }
        Some(result)
    }
}
