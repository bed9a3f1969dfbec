//! Scenes and films made to fool an adaptive sampler, and rules for stopping at their limits.
//!
//! No policy may lose a feature that uniform sampling with as many samples shows, divide by zero, or decide on what is
//! undefined.

mod common;
mod crops;
mod exposure;
mod features;
mod hostile;
mod measure;
mod scenes;
mod stops;
