//! Training the sampler of Lin and Wu (2015): rows, labels and machines of its layers.
//!
//! Every scene is rendered evenly at 8 to 256 samples, and once, with another seed, at 512. A row's distance is the CIEDE2000
//! difference between the two renders of its pixel (section III.F). Its class is +1, "go on", where that is
//! above one cut for the whole layer. `docs/adaptive-paper.md` says where the report leaves a choice.

use super::random::Random;
use super::{FitError, Fitted, Replay};
use crate::goal::Bounds;
use crate::machine::scale;
use crate::paper_features::{COUNT, FILM, features};
use crate::policy::paper::{CAP, CARD_LAYERS, CARD_SAMPLES, LAYERS, SCALED};
use sparing_image::color::{ciede2000, rgb_to_lab};
use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::Wave;
use sparing_render::{RenderSettings, Renderer, Scene};
use sparing_scene::SceneDescription;
use sparing_svm::train::{ConstantFeatures, Control, Folds, Grid, Progress, grid_search};
use sparing_svm::{Data, Evaluator, Model, Parameters, Scaling, SvmError};
use std::collections::BTreeMap;

/// A pixel at one layer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Its features.
    pub features: [f64; COUNT],
    /// CIEDE2000 to the same pixel of the render with 512 samples; radiance as it is, not exposed.
    pub distance: f64,
}

/// A pixel at all layers.
pub type Pixel = [Row; LAYERS.len()];

/// Undoes the brightness of a generated scene: every fifth is up to 512 times brighter or darker than others, which raw
/// features scaled by their extremes do not bear. The scenes of 2015 were ordinary pictures.
pub fn ordinary(scene: &mut SceneDescription) {
    scene.film.scale = 1.0;
}

/// Renders a scene, which must be built for this size, and collects at most `pixels` of its pixels, by chance. The
/// same for the same seed, whatever the threads.
#[must_use]
pub fn collect(
    scene: &Scene,
    size: [u32; 2],
    settings: RenderSettings,
    seed: u64,
    pixels: usize,
) -> Vec<Pixel> {
    let mut random = Random::new(seed);
    let seeds = [random.bits(), random.bits()];
    let bounds = Bounds { min_spp: LAYERS[0], max_spp: LAYERS[LAYERS.len() - 1] };
    let replay = Replay::new(scene, size, RenderSettings { seed: seeds[0], ..settings }, bounds, FILM);
    let mut best = Film::new(size, [0, 0, size[0], size[1]], FilmOptions::default());
    let renderer =
        Renderer::new(scene, RenderSettings { seed: seeds[1], ..settings }, FilmOptions::default());
    renderer.run(&mut best, &Wave::default(), |_, _| CAP);

    let lab = |film: &Film| film.map(|t, i| rgb_to_lab(t.pixels[i].mean().to_array()));
    let best = lab(&best);
    let mut all = vec![Pixel::default(); best.len()];
    for (layer, film) in replay.films().iter().enumerate() {
        let rows = film.map(features).into_iter().zip(lab(film).into_iter().zip(&best));
        for (pixel, (features, (own, best))) in all.iter_mut().zip(rows) {
            pixel[layer] = Row { features, distance: ciede2000(own, *best) };
        }
    }
    all.retain(|pixel| pixel.iter().all(|row| row.distance.is_finite()));
    random.some_of(all.len(), pixels).into_iter().map(|i| all[i]).collect()
}

/// Where a layer's distances are cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cut {
    /// At their mean, as the report says.
    #[default]
    Mean,
    /// At their median, which "partitions the data exactly in half", as the report says too.
    Median,
}

impl Cut {
    /// The cut of these rows; 0 without any.
    #[must_use]
    pub fn of(self, rows: &[Row]) -> f64 {
        let mut distances: Vec<f64> = rows.iter().map(|r| r.distance).collect();
        match self {
            Self::Mean => distances.iter().sum::<f64>() / distances.len().max(1) as f64,
            Self::Median => {
                distances.sort_by(f64::total_cmp);
                distances.get(distances.len() / 2).copied().unwrap_or(0.0)
            }
        }
    }
}

/// How to fit a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Where distances are cut.
    pub cut: Cut,
    /// Rows that the machine is trained on, drawn by chance.
    pub rows: usize,
    /// Penalties and kernel widths to try.
    pub grid: Grid,
    /// Folds of the cross-validation, by row: ten in the report.
    pub folds: usize,
    /// Seed of all random choices.
    pub seed: u64,
}

impl Default for Fit {
    fn default() -> Self {
        Self {
            cut: Cut::default(),
            rows: 3500,
            grid: Grid { c: vec![1.0, 16.0, 256.0], gamma: vec![8.0, 64.0, 512.0] },
            folds: 10,
            seed: 1,
        }
    }
}

/// Fits the machine of layer `layer`, counted from 0, to its rows: the cut is that of all rows, the machine sees some of
/// them. Bit for bit the same for the same input.
///
/// # Errors
/// Too few rows, or one class only.
pub fn fit(
    layer: usize,
    rows: &[Row],
    what: &Fit,
    progress: Option<&(dyn Fn(Progress) + Sync)>,
) -> Result<Fitted, FitError> {
    let Some(&samples) = LAYERS.get(layer) else {
        return Err(FitError::Rows(format!("there are {} layers, no layer {layer}", LAYERS.len())));
    };
    let cut = what.cut.of(rows);
    let chosen = Random::new(what.seed ^ u64::from(samples)).some_of(rows.len(), what.rows);
    let chosen: Vec<Row> = chosen.into_iter().map(|i| rows[i]).collect();
    let data = labelled(&chosen, cut)?;
    let scaling = Scaling::fit(&data, SCALED[0], SCALED[1])?;
    let data = scaling.apply_data(data)?;
    let folds = Folds::stratified(&data, what.folds, what.seed)?;
    let parameters = Parameters { constant_features: ConstantFeatures::Allow, ..Parameters::rbf(1.0, 1.0) };
    let control = Control { progress: progress.map(|p| p as _), deadline: None };
    let found = grid_search(&parameters, &what.grid, &data, &folds, &control)?;
    let model = found.best.train(&data)?;

    let c = found.best_point.c;
    let bound = model.coefficients.iter().flatten().filter(|v| v.abs() >= c * (1.0 - 1e-9)).count();
    let positive = data.labels.iter().filter(|l| **l > 0.0).count();
    let metrics = BTreeMap::from(
        [
            (CARD_LAYERS, LAYERS.len() as f64),
            (CARD_SAMPLES, f64::from(samples)),
            ("c", c),
            ("gamma", found.best_point.gamma),
            ("cut, CIEDE2000", cut),
            ("rows", data.len() as f64),
            ("share of rows that go on", positive as f64 / data.len().max(1) as f64),
            ("training accuracy", accuracy(&model, &scaling, &chosen, cut)?),
            ("cross-validation accuracy", found.best_point.scores.map_or(0.0, |s| s.merit())),
            ("support vectors", model.len() as f64),
            ("share of support vectors at C", bound as f64 / model.len().max(1) as f64),
        ]
        .map(|(name, value)| (name.to_owned(), value)),
    );
    Ok(Fitted { model, scaling, metrics })
}

/// Share of the rows that a machine puts on the right side of a cut.
///
/// # Errors
/// The machine cannot be evaluated, or has other features.
pub fn accuracy(model: &Model, scaling: &Scaling, rows: &[Row], cut: f64) -> Result<f64, SvmError> {
    let mut data = labelled(rows, cut)?;
    data.rows.chunks_exact_mut(COUNT).for_each(|row| scale(scaling, row));
    let mut out = vec![0.0; data.len()];
    Evaluator::new(model)?.decide(&data.rows, &mut out);
    let right = out.iter().zip(&data.labels).filter(|(value, label)| model.prediction(&[**value]) == **label);
    Ok(right.count() as f64 / data.len().max(1) as f64)
}

/// Rows with their class at a cut.
fn labelled(rows: &[Row], cut: f64) -> Result<Data, SvmError> {
    let labels = rows.iter().map(|r| if r.distance > cut { 1.0 } else { -1.0 }).collect();
    Data::new(COUNT, rows.iter().flat_map(|r| r.features).collect(), labels)
}
