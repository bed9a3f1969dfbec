//! Counts of what the integrator ran, for the tests that prove what it skips. Without the feature
//! `counters` they cost nothing.

/// What is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Counter {
    /// A texture was evaluated.
    TextureLookup,
    /// Texture coordinates were interpolated.
    TextureCoordinates,
    /// Shading normals were interpolated.
    ShadingNormal,
    /// A light was sampled.
    LightSample,
    /// The density of light sampling was computed for a hit: multiple importance sampling.
    LightPdf,
    /// The environment was looked up for a ray that missed.
    Environment,
    /// A normal or bump map was applied.
    NormalMap,
    /// Albedo, normal and depth were accumulated.
    Auxiliary,
    /// A shape was entered into a pixel's set.
    Shape,
    /// An alpha test ran in an Embree filter.
    AlphaTest,
    /// A lens sample was taken.
    Lens,
    /// A second set of random numbers was drawn for lobes, lights or mixes.
    Choice,
    /// Colours of vertices were interpolated.
    VertexColor,
    /// Times of rays were drawn.
    Time,
    /// The placement of a hit was computed for the ray's time.
    Motion,
    /// Second texture coordinates were interpolated.
    SecondUv,
}

#[cfg(feature = "counters")]
mod enabled {
    use super::Counter;
    use std::sync::atomic::{AtomicU64, Ordering};

    static COUNTS: [AtomicU64; 16] = [const { AtomicU64::new(0) }; 16];

    /// Adds one.
    pub fn count(counter: Counter) {
        COUNTS[counter as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// Reads and clears.
    #[must_use]
    pub fn take(counter: Counter) -> u64 {
        COUNTS[counter as usize].swap(0, Ordering::Relaxed)
    }
}

#[cfg(feature = "counters")]
pub use enabled::{count, take};

/// Adds one where the feature `counters` is on.
#[cfg(not(feature = "counters"))]
#[inline(always)]
pub fn count(_: Counter) {}
