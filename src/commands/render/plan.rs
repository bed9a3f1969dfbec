//! Everything that is decided before the scene is built.

use super::choice::Choice;
use super::shard::Shard;
use super::{EstimatorChoice, RenderArguments, Sampler};
use crate::commands::Usage;
use crate::commands::options::check_size;
use crate::session::memory;
use sparing_image::exr::ExrAttribute;
use sparing_image::film::{Film, FilmOptions, TILE};
use sparing_render::RenderSettings;
use sparing_render::integrator::Estimator;
use sparing_scene::SceneDescription;
use sparing_scene::description::{Projection, SamplerKind};
use std::path::{Path, PathBuf};

/// Everything decided before the scene is built.
pub(super) struct Plan {
    pub(super) outputs: Vec<PathBuf>,
    pub(super) size: [u32; 2],
    pub(super) shard: Shard,
    pub(super) choice: Choice,
    pub(super) film: FilmOptions,
    pub(super) settings: RenderSettings,
    /// A pixel's bytes besides the film.
    bytes_beside: u64,
    pub(super) camera: Vec<(String, ExrAttribute)>,
}

impl Plan {
    pub(super) fn new(a: &RenderArguments, d: &mut SceneDescription) -> anyhow::Result<Self> {
        if let Some([w, h]) = a.size {
            if [w, h] != [d.film.width, d.film.height] {
                d.film.crop = None; // the scene's crop is in pixels of the scene's size
            }
            (d.film.width, d.film.height) = (w, h);
        }
        let size = [d.film.width, d.film.height];
        check_size(size[0], size[1]).map_err(anyhow::Error::msg)?;
        let crop = a.crop.or(d.film.crop).unwrap_or([0, 0, size[0], size[1]]);
        if crop[2] > size[0] || crop[3] > size[1] {
            let [x0, y0, x1, y1] = crop;
            return Err(Usage::error(format!(
                "the crop {x0},{y0},{x1},{y1} reaches outside the picture of {}x{}",
                size[0], size[1]
            )));
        }
        let sampler = match a.sampler {
            Some(Sampler::Sobol) => SamplerKind::Sobol,
            Some(Sampler::Independent) => SamplerKind::Independent,
            None => d.sampler.kind,
        };
        let estimator = match a.estimator {
            EstimatorChoice::Mis => Estimator::Mis,
            EstimatorChoice::Light => Estimator::LightOnly,
            EstimatorChoice::Bsdf => Estimator::BsdfOnly,
        };
        let settings = RenderSettings {
            sampler,
            seed: a.seed.unwrap_or(d.sampler.seed),
            max_depth: a.max_depth.unwrap_or(d.integrator.max_depth),
            estimator,
            ..RenderSettings::default()
        };
        let choice = Choice::new(a, d.sampler.spp)?;
        Ok(Self {
            outputs: outputs(a, d)?,
            size,
            shard: Shard::new(a, &choice, crop)?,
            film: FilmOptions {
                auxiliary: a.layers,
                shapes: a.layers || choice.policy().film_options().shapes,
                luminance: choice.policy().film_options().luminance,
            },
            bytes_beside: LAYER_BYTES
                + if a.checkpoint.is_some() || a.shard.is_some() { STATE_BYTES } else { 0 },
            choice,
            settings,
            camera: camera_attributes(d),
        })
    }
}

/// Layers of a picture and their copies while it is written, bytes a pixel: never below what is measured.
const LAYER_BYTES: u64 = 128;
/// Channels of a checkpoint or a part while it is written.
const STATE_BYTES: u64 = 320;

impl Plan {
    /// Whether the film and the pictures made of it fit into memory: an error now, not a kill in an hour.
    pub(super) fn check_memory(&self) -> anyhow::Result<()> {
        let [x0, y0, x1, y1] = self.shard.rendered.map(u64::from);
        let tile = u64::from(TILE);
        let tiles = (x1.div_ceil(tile) - x0 / tile) * (y1.div_ceil(tile) - y0 / tile);
        let film = tiles * Film::new([TILE, TILE], [0, 0, TILE, TILE], self.film).bytes();
        let what = format!("a picture of {}x{}", x1 - x0, y1 - y0);
        memory::check(&what, film + (x1 - x0) * (y1 - y0) * self.bytes_beside).map_err(anyhow::Error::msg)
    }
}

fn outputs(a: &RenderArguments, d: &SceneDescription) -> anyhow::Result<Vec<PathBuf>> {
    if a.shard.is_some() && !matches!(&a.output[..], [path] if is_exr(path)) {
        return Err(Usage::error("--shard: say -o with one .exr file, which `sparing merge` takes"));
    }
    if a.output.is_empty() {
        let named = d.film.filename.as_ref().and_then(|f| Path::new(f).file_stem().map(PathBuf::from));
        let stem =
            named.or_else(|| a.scene.file_stem().map(PathBuf::from)).unwrap_or_else(|| "render".into());
        let mut name = stem.into_os_string(); // not with_extension: `a.b.pbrt` makes `a.b.exr`
        name.push(".exr");
        return Ok(vec![name.into()]);
    }
    for path in &a.output {
        if !is_exr(path) && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            return Err(Usage::error(format!("{}: pictures are written as .exr or .png", path.display())));
        }
    }
    let mut targets: Vec<PathBuf> = Vec::new();
    for path in a.output.iter().chain(&a.stats).chain(&a.heat_map).chain(&a.checkpoint) {
        let target = target(path);
        if targets.contains(&target) {
            return Err(Usage::error(format!("{} is to be written twice", path.display())));
        }
        targets.push(target);
    }
    Ok(a.output.clone())
}

/// The file that a path leads to, whether it exists already or not.
fn target(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let named = || Some(folder.canonicalize().ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(named).unwrap_or_else(|| path.to_owned())
}

pub(super) fn is_standard_output(path: &Path) -> bool {
    path == Path::new("-")
}

pub(super) fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"))
}

/// The camera by OpenEXR's standard names, and its optics by ours.
fn camera_attributes(d: &SceneDescription) -> Vec<(String, ExrAttribute)> {
    let c = &d.camera;
    // OpenEXR multiplies row vectors: its rows are our columns.
    let world_to_camera = c.camera_to_world.inverse().to_cols_array();
    let mut list = vec![("worldToCamera".to_owned(), ExrAttribute::M44f(world_to_camera))];
    if let Projection::Perspective { fov } = c.projection {
        list.push(("sparing.fieldOfView".to_owned(), ExrAttribute::Float(fov)));
    }
    list.push(("sparing.lensRadius".to_owned(), ExrAttribute::Float(c.lens_radius)));
    list.push(("sparing.focalDistance".to_owned(), ExrAttribute::Float(c.focal_distance)));
    list
}
