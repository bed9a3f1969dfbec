//! What a checkpoint or shard is of.

use crate::session::stats::Rays;
use anyhow::bail;
use serde::{Deserialize, Serialize};
use sparing_adaptive::layers::Layer;
use sparing_adaptive::state::State;
use sparing_render::integrator::TraceStatistics;
use std::collections::{BTreeMap, BTreeSet};

/// Everything that the samples depend on, by names that people understand. All must agree for a render to go on.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity(pub BTreeMap<String, String>);

impl Identity {
    /// Refuses another render, and says in what it differs.
    ///
    /// # Errors
    /// They differ, in more than `but`.
    pub fn check(&self, other: &Self, but: &[&str]) -> anyhow::Result<()> {
        let nothing = String::new();
        let names: BTreeSet<&String> = self.0.keys().chain(other.0.keys()).collect();
        let mut differences = Vec::new();
        for name in names.into_iter().filter(|name| !but.contains(&name.as_str())) {
            let [a, b] = [self, other].map(|i| i.0.get(name).unwrap_or(&nothing));
            if a != b {
                differences.push(format!("{name}: {} there, {} here", shown(a), shown(b)));
            }
        }
        if !differences.is_empty() {
            bail!("{}", differences.join("; "));
        }
        Ok(())
    }
}

/// Hashes are cut, absent values named.
fn shown(value: &str) -> &str {
    match value.len() {
        0 => "none",
        64 => &value[..12],
        _ => value,
    }
}

/// Which part of a picture a file has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// All of it.
    #[default]
    Whole,
    /// Some rows of tiles.
    Rows {
        /// From 1.
        index: u32,
        /// How many shards there are.
        count: u32,
    },
    /// Some samples of every pixel.
    Samples {
        /// From 1.
        index: u32,
        /// How many shards there are.
        count: u32,
        /// First sample.
        from: u32,
        /// One past the last.
        to: u32,
    },
}

/// What a file is of and how far it got.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Header {
    /// Must agree.
    pub identity: Identity,
    /// The part that is there.
    pub part: Part,
    /// Pixel bounds of the picture that all parts make.
    pub crop: [u32; 4],
    /// Whether nothing is left to do.
    pub complete: bool,
    /// Most samples of a pixel.
    pub most: u32,
    /// See [`Ledger::lambdas`](sparing_adaptive::ledger::Ledger::lambdas); none for infinity, which JSON has not.
    pub lambdas: Vec<Option<f64>>,
    /// See [`State::exposure`].
    pub exposure: Option<f32>,
    /// Layers so far.
    pub layers: Vec<Layer>,
    /// Rays so far.
    pub rays: Rays,
    /// Seconds of sampling and deciding so far.
    pub seconds: f64,
    /// See [`State::base_samples`].
    pub base_samples: u64,
}

impl Header {
    /// Of a state.
    #[must_use]
    pub fn new(
        identity: Identity,
        (part, crop): (Part, [u32; 4]),
        complete: bool,
        most: u32,
        state: &State,
    ) -> Self {
        Self {
            identity,
            part,
            crop,
            complete,
            most,
            lambdas: state.ledger.lambdas().iter().map(|l| l.is_finite().then_some(*l)).collect(),
            exposure: state.exposure,
            layers: state.layers.clone(),
            rays: state.rays.into(),
            seconds: state.seconds,
            base_samples: state.base_samples,
        }
    }
}

impl From<TraceStatistics> for Rays {
    fn from(rays: TraceStatistics) -> Self {
        Self { camera: rays.camera, bounce: rays.bounce, shadow: rays.shadow }
    }
}

impl From<Rays> for TraceStatistics {
    fn from(rays: Rays) -> Self {
        Self { camera: rays.camera, bounce: rays.bounce, shadow: rays.shadow }
    }
}
