//! Scene descriptions and their loaders.
//!
//! A loader turns a file into a [`SceneDescription`]: plain data, no Embree, no GPU, nothing decoded that
//! the renderer may not need. All loaders share one error type with file, line and column.

pub mod description;

pub use description::SceneDescription;
