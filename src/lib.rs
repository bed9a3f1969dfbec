//! Sparing: a path tracer on Intel Embree 4 that learns where to spend its samples.
//!
//! This crate gathers the workspace's crates under one name and holds the `sparing` command.

pub use embree4;
pub use sparing_adaptive as adaptive;
pub use sparing_image as image;
pub use sparing_render as render;
pub use sparing_scene as scene;
pub use sparing_svm as svm;

pub mod commands;
mod plot;
pub mod session;

/// Version and commit.
pub const VERSION: &str = env!("SPARING_VERSION");
