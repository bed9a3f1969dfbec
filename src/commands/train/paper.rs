//! The sampler of Lin and Wu (2015): a folder with a machine a layer.

use super::{Stage, TrainArguments};
use crate::session::console::{note, print};
use anyhow::Context;
use rayon::ThreadPool;
use sparing_adaptive::paper_features::{COUNT, NAMES};
use sparing_adaptive::policy::Paper;
use sparing_adaptive::policy::paper::LAYERS;
use sparing_adaptive::training::paper::{Fit, Row, collect, fit, ordinary};
use sparing_image::atomic::check_writable;
use sparing_svm::Card;
use sparing_svm::card::{CARD_FORMAT, CardScaling};
use std::sync::atomic::{AtomicBool, Ordering};

/// Numbers of a row of one layer: distance, features.
const COLUMNS: usize = 1 + COUNT;

/// Trains and writes the machines. Gives the number of their support vectors.
pub(super) fn train(a: &TrainArguments, pool: &ThreadPool, armed: &AtomicBool) -> anyhow::Result<usize> {
    let command = command(a)?;
    std::fs::create_dir_all(&a.output)
        .with_context(|| format!("cannot make the folder {}", a.output.display()))?;
    for path in LAYERS.map(|samples| Paper::path(&a.output, samples)) {
        check_writable(&path)?;
        check_writable(&Card::path(&path))?;
    }
    let settings = format!("paper seed {} scene-rows {} size-scale {}", a.seed, a.scene_rows, a.size_scale);
    let all = a.rows(settings, LAYERS.len() * COLUMNS, pool, ordinary, |stage| rows_of(a, stage))?.concat();
    let mut models = Vec::new();
    for (layer, samples) in LAYERS.into_iter().enumerate() {
        let row = |numbers: &Vec<f64>| {
            let (distance, features) = numbers.chunks(COLUMNS).nth(layer)?.split_first()?;
            Some(Row { distance: *distance, features: features.try_into().ok()? })
        };
        let rows: Vec<Row> = all.iter().filter_map(row).collect();
        let what = Fit { rows: a.rows, seed: a.seed, ..Fit::default() };
        let report = |p: sparing_svm::train::Progress| {
            note(format_args!("{samples} samples: fit {} of {}", p.done, p.total));
        };
        let fitted = pool.install(|| fit(layer, &rows, &what, Some(&report)));
        let fitted = fitted.with_context(|| format!("cannot train the layer of {samples} samples"))?;
        let card = Card {
            format: CARD_FORMAT,
            sha256: "0".repeat(64),
            features: NAMES.map(str::to_owned).to_vec(),
            label: format!(
                "+1: a pixel of {samples} samples is farther from one of 512 (CIEDE2000) than the mean pixel"
            ),
            data: vec![format!("training scenes 0 to {} of seed {}", a.scenes() - 1, a.seed)],
            licence: "MIT OR Apache-2.0".to_owned(),
            command: command.clone(),
            seed: a.seed,
            scaling: Some(CardScaling::from(&fitted.scaling)),
            metrics: fitted.metrics,
        };
        models.push((fitted.model, card));
    }
    let vectors = Paper::new(&models)?.vectors().iter().sum();
    armed.store(false, Ordering::SeqCst); // from here on it takes a moment, and is finished
    for ((model, card), samples) in models.iter_mut().zip(LAYERS) {
        let path = Paper::path(&a.output, samples);
        model.write(&path)?;
        card.write(&path)?;
        print(format_args!("layer of {samples} samples"))?;
        for (name, value) in &card.metrics {
            print(format_args!("  {name}: {value:.4}"))?;
        }
    }
    Ok(vectors)
}

/// The command that gives the same models, with all defaults said.
fn command(a: &TrainArguments) -> anyhow::Result<String> {
    Ok(format!(
        "sparing train --label paper --scenes {} --rows {} --scene-rows {} --size-scale {} --seed {} -o {}",
        a.scenes(),
        a.rows,
        a.scene_rows,
        a.size_scale,
        a.seed,
        a.name()?
    ))
}

/// Renders a scene and collects its pixels: distance and features of all layers.
fn rows_of(a: &TrainArguments, stage: &Stage) -> Vec<Vec<f64>> {
    let pixels = collect(&stage.scene, stage.size, stage.settings, stage.seed, a.scene_rows);
    let numbers = |row: &Row| [&[row.distance][..], &row.features].concat();
    pixels.iter().map(|pixel| pixel.iter().flat_map(numbers).collect()).collect()
}
