//! The path tracer: camera, samplers, textures, materials, lights, scene build, integrator.
//!
//! A [`scene::Scene`] is built once from a description. [`integrator`] then samples pixels: the value of a
//! sample is a function of pixel, sample index and seed alone, so pictures do not depend on threads, tiles or
//! crops. [`needs::Needs`] says what a scene uses; the rest is compiled out of the inner loop.

pub mod camera;
pub mod counters;
pub mod filter;
pub mod integrator;
pub mod lights;
pub mod materials;
pub mod needs;
pub mod noise;
pub mod sampler;
pub mod sampling;
pub mod scene;
pub mod texture;

pub use integrator::{RenderSettings, Renderer};
pub use needs::Needs;
pub use scene::{BuildError, BuildOptions, Scene};
