//! The unidirectional path tracer with next-event estimation (J. Kajiya 1986; E. Veach 1997), working on
//! packets of up to sixteen samples of one pixel, and the loop that fills a film with it.
//!
//! Camera rays and shadow rays of a packet go to Embree together, where they are coherent; bounces go one by
//! one, since packets do not help them. The code is compiled for a few combinations of
//! [`Needs`](crate::Needs), chosen once per scene.

pub mod inspect;
mod packet;
mod render;
pub mod replay;
mod shading;

pub use packet::{PACKET, TraceStatistics};
pub use render::{Renderer, Wave};

use sparing_scene::description::{IntegratorSettings, SamplerKind};

/// Which estimators of direct light to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// Light sampling and BSDF sampling, combined by the power heuristic.
    #[default]
    Mis,
    /// Light sampling only (and what only BSDF sampling can find).
    LightOnly,
    /// BSDF sampling only (and what only light sampling can find).
    BsdfOnly,
}

/// What a render is, besides the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// Sampler kind.
    pub sampler: SamplerKind,
    /// Seed.
    pub seed: u64,
    /// Bounces after the camera ray.
    pub max_depth: u32,
    /// Estimator of direct light.
    pub estimator: Estimator,
    /// Bounces after which Russian roulette may end a path.
    pub roulette_depth: u32,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            sampler: SamplerKind::Sobol,
            seed: 0,
            max_depth: IntegratorSettings::default().max_depth,
            estimator: Estimator::Mis,
            roulette_depth: 4,
        }
    }
}
