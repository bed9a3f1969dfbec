//! Film buffers, pictures in and out, colour, error metrics.
//!
//! * [`film`]: sums of samples; [`exr::film_layers`] turns them into layers.
//! * [`exr`], [`png`]: pictures out, always through [`atomic::AtomicFile`].
//! * [`raw`]: a film as it is in a file, and back.
//! * [`picture`]: pictures in, for textures, environment maps and comparisons.
//! * [`color`], [`metrics`]: colour spaces and differences; how far a picture is from its reference.

pub mod atomic;
pub mod color;
mod decode;
pub mod exr;
pub mod film;
pub mod metrics;
pub mod pfm;
pub mod picture;
pub mod png;
pub mod raw;

pub use openexr_core;
