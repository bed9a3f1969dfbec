//! Where a render stands: all that a later process needs to go on as if nothing had happened.

use crate::layers::{Layer, Outcome};
use crate::ledger::Ledger;
use crate::policy::Decisions;
use sparing_image::film::Film;
use sparing_render::integrator::TraceStatistics;
use std::time::Instant;

/// A render between two samples. What follows from it, such as the view and what a machine said before, is computed anew.
#[derive(Clone, Debug)]
pub struct State {
    /// The samples.
    pub film: Film,
    /// What choosing pixels by their samples is to be set right with.
    pub ledger: Ledger,
    /// What each pixel is to be brought to, in rows; empty before the first layer.
    pub targets: Vec<u32>,
    /// What radiance is multiplied by, once the first layer has said so.
    pub exposure: Option<f32>,
    /// Layers so far.
    pub layers: Vec<Layer>,
    /// Rays so far, those of an audit included.
    pub rays: TraceStatistics,
    /// Seconds of sampling and deciding so far.
    pub seconds: f64,
    /// Samples that the film counted when it was new: those that other shards take.
    pub base_samples: u64,
}

impl State {
    /// Of a render that begins.
    #[must_use]
    pub fn new(film: Film) -> Self {
        Self {
            base_samples: film.samples(),
            film,
            ledger: Ledger::default(),
            targets: Vec::new(),
            exposure: None,
            layers: Vec::new(),
            rays: TraceStatistics::default(),
            seconds: 0.0,
        }
    }

    /// Takes over what the loop knows. `start` is when this process began to sample.
    pub(crate) fn keep(&mut self, outcome: &Outcome, decisions: &Decisions, start: Instant) {
        self.targets.clone_from(&decisions.targets);
        self.exposure = outcome.exposure;
        self.layers.clone_from(&outcome.layers);
        self.rays = outcome.rays;
        self.seconds = outcome.seconds + start.elapsed().as_secs_f64();
    }
}
