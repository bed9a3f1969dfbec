//! When checkpoints are written during a render.

use super::{Header, Identity, Part, write};
use crate::session::console::note;
use sparing_adaptive::state::State;
use sparing_image::exr::ExrAttribute;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Share of the time that checkpoints at the ends of layers may take.
const MOST_OVERHEAD: u32 = 50;

/// Writes checkpoints of a render: every so often, and at ends of layers if that costs next to nothing.
#[derive(Debug)]
pub struct Timer {
    path: PathBuf,
    identity: Identity,
    part: (Part, [u32; 4]),
    most: u32,
    interval: Duration,
    last: Instant,
    /// What the last one took.
    cost: Duration,
    failed: bool,
}

impl Timer {
    /// For a render that begins now. `most` is the most samples of a pixel.
    #[must_use]
    pub fn new(
        path: PathBuf,
        identity: Identity,
        part: (Part, [u32; 4]),
        most: u32,
        interval: Duration,
    ) -> Self {
        let cost = Duration::ZERO;
        Self { path, identity, part, most, interval, last: Instant::now(), cost, failed: false }
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// When the next one is due.
    #[must_use]
    pub fn due(&self) -> Option<Instant> {
        self.last.checked_add(self.interval)
    }

    /// At a moment between samples; `now` if one is due.
    pub fn visit(&mut self, state: &State, now: bool) {
        if now || self.last.elapsed() > self.cost * MOST_OVERHEAD {
            self.save(state);
        }
    }

    /// Writes one. If that fails, the one before stays, a warning is given, and the render goes on.
    pub fn save(&mut self, state: &State) {
        let start = Instant::now();
        let header = Header::new(self.identity.clone(), self.part, false, self.most, state);
        let software = ("software".to_owned(), ExrAttribute::String(format!("Sparing {}", crate::VERSION)));
        match write(&self.path, &header, state, &[], vec![software]) {
            Ok(()) => self.failed = false,
            Err(e) => {
                if !self.failed {
                    note(format_args!("warning: no checkpoint: {e:#}"));
                }
                self.failed = true;
            }
        }
        (self.last, self.cost) = (Instant::now(), start.elapsed());
    }

    /// Whether the last one could be written.
    #[must_use]
    pub fn succeeded(&self) -> bool {
        !self.failed
    }

    /// Removes the file: the render is finished.
    pub fn finish(self) {
        // Where nothing was written there is nothing to remove.
        let _ = std::fs::remove_file(&self.path);
    }
}
