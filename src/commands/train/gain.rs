//! Machines of the gain by doubling.

use super::{Stage, TrainArguments};
use crate::session::console::{note, print};
use anyhow::Context;
use rayon::ThreadPool;
use sparing_adaptive::features::Feature;
use sparing_adaptive::goal::Bounds;
use sparing_adaptive::machine::Machine;
use sparing_adaptive::training::{Collection, Fit, Label, Row, collect, fit};
use sparing_image::atomic::check_writable;
use sparing_svm::Card;
use sparing_svm::card::{CARD_FORMAT, CardScaling};
use std::sync::atomic::{AtomicBool, Ordering};

/// Trains and writes a machine. Gives the number of its support vectors.
pub(super) fn train(
    a: &TrainArguments,
    label: Label,
    pool: &ThreadPool,
    armed: &AtomicBool,
) -> anyhow::Result<usize> {
    let command = command(a, label)?;
    check_writable(&a.output)?;
    check_writable(&Card::path(&a.output))?;
    let gains = Label::ALL.len();
    let lists = a.rows(settings(a), gains + Feature::ALL.len(), pool, |_| (), |stage| rows_of(a, stage))?;
    let row = |numbers: &Vec<f64>| {
        let (gains, features) = numbers.split_first_chunk()?;
        Some(Row { gains: *gains, features: features.to_vec() })
    };
    let all: Vec<Vec<Row>> = lists.iter().map(|rows| rows.iter().filter_map(row).collect()).collect();
    let mut what = Fit { label, rows: a.rows, vectors: a.vectors, seed: a.seed, ..Fit::default() };
    if !a.features.is_empty() {
        what.features = Feature::ALL.into_iter().filter(|f| a.features.contains(f)).collect();
    }
    let fitted =
        pool.install(|| fit(&all, &what, Some(&|p| note(format_args!("fit {} of {}", p.done, p.total)))));
    let fitted = fitted.context("cannot train on the rows")?;
    let mut card = Card {
        format: CARD_FORMAT,
        sha256: "0".repeat(64),
        features: what.features.iter().map(|f| f.name().to_owned()).collect(),
        label: format!("+1: the {label} gain of twice the samples is above the rule's average"),
        data: vec![format!("training scenes 0 to {} of seed {}", a.scenes() - 1, a.seed)],
        licence: "MIT OR Apache-2.0".to_owned(),
        command,
        seed: a.seed,
        scaling: Some(CardScaling::from(&fitted.scaling)),
        metrics: fitted.metrics,
    };
    Machine::new(&fitted.model, &card)?;
    armed.store(false, Ordering::SeqCst); // from here on it takes a moment, and is finished
    fitted.model.write(&a.output)?;
    card.write(&a.output)?;
    for (name, value) in &card.metrics {
        print(format_args!("{name}: {value:.4}"))?;
    }
    Ok(fitted.model.len())
}

/// Everything that the rows of a scene depend on.
fn settings(a: &TrainArguments) -> String {
    let features: Vec<&str> = Feature::ALL.iter().map(|f| f.name()).collect();
    format!(
        "seed {} scene-rows {} replicates {} reference {} max-spp {} size-scale {} features {}",
        a.seed,
        a.scene_rows,
        a.replicates,
        a.reference,
        a.max_spp,
        a.size_scale,
        features.join(",")
    )
}

/// The command that gives the same model, with all defaults said.
fn command(a: &TrainArguments, label: Label) -> anyhow::Result<String> {
    let names: Vec<&str> = a.features.iter().map(|f| f.name()).collect();
    let features = if names.is_empty() { String::new() } else { format!(" --features {}", names.join(",")) };
    Ok(format!(
        "sparing train --scenes {} --rows {} --scene-rows {} --label {label} --replicates {} --reference {} \
         --max-spp {} --size-scale {}{features} --vectors {} --seed {} -o {}",
        a.scenes(),
        a.rows,
        a.scene_rows,
        a.replicates,
        a.reference,
        a.max_spp,
        a.size_scale,
        a.vectors,
        a.seed,
        a.name()?
    ))
}

/// Renders a scene and collects its rows: gains, then features.
fn rows_of(a: &TrainArguments, stage: &Stage) -> Vec<Vec<f64>> {
    let what = Collection {
        seed: stage.seed,
        replicates: a.replicates,
        reference_spp: a.reference,
        bounds: Bounds { min_spp: 8, max_spp: a.max_spp },
        rows: a.scene_rows,
        ..Collection::default()
    };
    let rows = collect(&stage.scene, stage.size, stage.settings, &what);
    rows.into_iter().map(|row| [&row.gains[..], &row.features].concat()).collect()
}
