//! Converged pictures, from other random numbers than the renders, kept in the folder.

use super::plan::Plan;
use super::stage::{Rendered, Stage};
use indicatif::ProgressBar;
use serde::Serialize;
use sparing_adaptive::goal::Bounds;
use sparing_adaptive::policy::Uniform;
use sparing_image::color::auto_exposure;
use sparing_image::exr::{ExrAttribute, ExrImage, film_layers, read_exr, write_exr};
use sparing_image::metrics::REL_MSE_EPSILON;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Turns the seed of the renders into that of the reference (the golden ratio's bits: no small seed meets another's).
const OTHER_SEED: u64 = 0x9e37_79b9_7f4a_7c15;
/// Names what a cached reference was rendered from.
const KEY: &str = "sparing.reference";

/// What a scene's renders are judged by.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Reference {
    /// Samples per pixel.
    pub(super) spp: u32,
    /// Seconds it took; nothing if it was found.
    pub(super) seconds: Option<f64>,
    /// What all pictures of the scene are multiplied by: from this one.
    pub(super) exposure: f32,
    /// The mean of the variance of its pixels in relMSE's terms, samples taken as independent, so too large.
    pub(super) rel_mse: f64,
    /// Linear pixels.
    #[serde(skip)]
    pub(super) pixels: Vec<[f32; 3]>,
    /// What one sample adds to each pixel's relMSE.
    #[serde(skip)]
    pub(super) variances: Vec<f64>,
}

impl Reference {
    /// The cached one if it fits, else a new one; `None` if interrupted.
    pub(super) fn get(
        stage: &Stage,
        plan: &Plan,
        interrupt: &AtomicBool,
        bar: Option<&ProgressBar>,
    ) -> anyhow::Result<Option<Self>> {
        let path = plan.folder.join("references").join(format!("{}.exr", stage.name));
        let spp = plan.reference_spp;
        let seed = plan.seed ^ OTHER_SEED;
        let [w, h] = stage.size;
        let key = format!("scene {:016x}, {w}x{h}, seed {seed}, {spp} spp", stage.fingerprint);
        if let Some(found) = cached(&path, &key, stage) {
            return Ok(Some(Self::from_picture(&found, spp, None)));
        }
        let start = Instant::now();
        let bounds = Bounds { min_spp: spp.min(8), max_spp: spp };
        let Some(Rendered { film, .. }) = stage.render(&mut Uniform, bounds, seed, interrupt, bar) else {
            return Ok(None);
        };
        let seconds = start.elapsed().as_secs_f64();
        let picture = film_layers(&film, vec![(KEY.to_owned(), ExrAttribute::String(key))]);
        write_exr(&path, &picture)?;
        Ok(Some(Self::from_picture(&picture, spp, Some(seconds))))
    }

    fn from_picture(picture: &ExrImage, spp: u32, seconds: Option<f64>) -> Self {
        let pixels = picture.rgb("").unwrap_or_default();
        let of_mean = picture.rgb("Variance").unwrap_or_default();
        let exposure = auto_exposure(&pixels);
        let scale = f64::from(exposure);
        let relative = |pixel: &[f32; 3], variance: &[f32; 3]| -> f64 {
            let channel = |(p, v): (&f32, &f32)| {
                let r = f64::from(*p) * scale;
                f64::from(*v) * scale * scale / (r * r + REL_MSE_EPSILON)
            };
            pixel.iter().zip(variance).map(channel).sum::<f64>() / 3.0
        };
        let errors: Vec<f64> = pixels.iter().zip(&of_mean).map(|(p, v)| relative(p, v)).collect();
        Self {
            spp,
            seconds,
            exposure,
            rel_mse: errors.iter().sum::<f64>() / errors.len().max(1) as f64,
            variances: errors.iter().map(|e| e * f64::from(spp)).collect(),
            pixels,
        }
    }
}

/// A reference that was rendered from the same; whatever else the file is, it is rendered again.
fn cached(path: &Path, key: &str, stage: &Stage) -> Option<ExrImage> {
    let picture = read_exr(path).ok()?;
    let same = matches!(picture.attribute(KEY), Some(ExrAttribute::String(k)) if k == key);
    let whole = [picture.width, picture.height] == stage.size;
    (same && whole && picture.rgb("").is_some() && picture.rgb("Variance").is_some()).then_some(picture)
}
