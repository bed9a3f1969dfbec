//! The statistics of a render as one JSON object.

use serde::{Deserialize, Serialize};
use sparing_adaptive::layers::{Layer, StoppedBy};

/// What `--stats` writes.
#[derive(Clone, Debug, Serialize)]
pub struct Statistics {
    /// Scene file.
    pub scene: String,
    /// Pixels across, of the part that was rendered.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Sampling policy.
    pub policy: String,
    /// Model of the policy.
    pub model: Option<String>,
    /// Seed.
    pub seed: u64,
    /// Threads.
    pub threads: usize,
    /// Reading the scene.
    pub load_seconds: f64,
    /// Building acceleration structures, light tables, textures.
    pub build_seconds: f64,
    /// Sampling and deciding.
    pub render_seconds: f64,
    /// Samples taken.
    pub samples: u64,
    /// Samples per pixel.
    pub average_spp: f64,
    /// Rays by kind.
    pub rays: Rays,
    /// All rays over the seconds of rendering.
    pub rays_per_second: f64,
    /// Layers.
    pub layers: Vec<Layer>,
    /// Samples that were not finite or negative.
    pub invalid_samples: u64,
    /// Some of them: x, y, sample index.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub invalid: Vec<[u32; 3]>,
    /// What radiance was multiplied by before errors were judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure: Option<f32>,
    /// The threshold in the end: a render with it, and with the exposure, takes the same samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<f64>,
    /// Predicted mean CIEDE2000 error at that exposure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub predicted_error: Option<f64>,
    /// Samples of the second render that measures the error of a tolerance; not in `samples`.
    pub audit_samples: u64,
    /// Why rendering stopped.
    pub stopped_by: StoppedBy,
    /// Largest memory of the process.
    pub peak_memory_bytes: u64,
    /// Memory of the process while rendering, film included.
    pub resident_bytes: u64,
    /// The film's part of it.
    pub film_bytes: u64,
    /// What Embree holds for the scene.
    pub embree_bytes: u64,
    /// Vertices, indices, normals, texture coordinates.
    pub geometry_bytes: u64,
    /// Decoded pictures.
    pub texture_bytes: u64,
    /// Embree's version.
    pub embree_version: String,
    /// What the scene needs.
    pub needs: Vec<&'static str>,
    /// What was skipped because it does not.
    pub skipped: Vec<&'static str>,
}

/// Rays traced.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Rays {
    /// From the camera.
    pub camera: u64,
    /// Between surfaces.
    pub bounce: u64,
    /// To lights.
    pub shadow: u64,
}
