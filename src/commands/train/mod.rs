//! `sparing train`.

mod cache;

use super::Usage;
use super::options::{spp, threads};
use crate::session::console::{note, print};
use crate::session::progress::clock;
use anyhow::Context;
use cache::Cache;
use clap::Args;
use sparing_adaptive::goal::Bounds;
use sparing_adaptive::machine::Machine;
use sparing_adaptive::training::{Collection, Fit, Label, Row, collect, fit};
use sparing_image::atomic::check_writable;
use sparing_render::{BuildOptions, RenderSettings, Scene};
use sparing_scene::generate::training::{Split, scene};
use sparing_svm::Card;
use sparing_svm::card::{CARD_FORMAT, CardScaling};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Arguments of `sparing train`.
#[derive(Debug, Args)]
pub(super) struct TrainArguments {
    /// Model to write, with its card beside it. Rows are kept in a folder OUTPUT.rows, so that a run that was stopped goes
    /// on where it was.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Training scenes [default: every kind four times].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=10_000), allow_negative_numbers = true)]
    scenes: Option<u32>,
    /// Rows that the machine is trained on.
    #[arg(long, value_name = "N", default_value_t = 3000, value_parser = rows, allow_negative_numbers = true)]
    rows: usize,
    /// Rows collected from each scene.
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = rows, allow_negative_numbers = true)]
    scene_rows: usize,
    /// What a row is told: realised, conditional or expected gain.
    #[arg(long, default_value = "conditional")]
    label: Label,
    /// Independent renders of each scene.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=64),
        allow_negative_numbers = true)]
    replicates: u32,
    /// Samples per pixel of the references.
    #[arg(long, value_name = "N", default_value_t = 2048, value_parser = spp, allow_negative_numbers = true)]
    reference: u32,
    /// Samples per pixel that no policy exceeds.
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = most, allow_negative_numbers = true)]
    max_spp: u32,
    /// Factor of the sides of the scenes' pictures, which have about 10,000 pixels.
    #[arg(long, value_name = "F", default_value_t = 0.5, value_parser = size_scale, allow_negative_numbers = true)]
    size_scale: f64,
    /// Most support vectors.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = rows, allow_negative_numbers = true)]
    vectors: usize,
    /// Seed of all random choices.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64),
        allow_negative_numbers = true)]
    seed: u64,
    /// Threads, at most 1024; 0 is all. They do not change the model.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = threads, allow_negative_numbers = true)]
    threads: usize,
}

fn rows(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(n @ 2..=1_000_000) => Ok(n),
        _ => Err(format!("'{text}' is not a number from 2 to 1000000")),
    }
}

fn most(text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(n @ 32..=65_536) => Ok(n),
        _ => Err(format!("'{text}' is not a number of samples from 32 to 65536")),
    }
}

fn size_scale(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(f) if (0.05..=8.0).contains(&f) => Ok(f),
        _ => Err(format!("'{text}' is not a factor from 0.05 to 8")),
    }
}

pub(super) fn run(a: &TrainArguments) -> anyhow::Result<ExitCode> {
    // While the flag is set, a signal ends the process: what is kept so far are whole scenes.
    let armed = Arc::new(AtomicBool::new(true));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, 130, Arc::clone(&armed))?;
    }
    let Some(name) = a.output.file_name() else {
        return Err(Usage::error(format!("{} is not the name of a file", a.output.display())));
    };
    check_writable(&a.output)?;
    check_writable(&Card::path(&a.output))?;
    let start = Instant::now();
    let scenes = a.scenes.unwrap_or(Split::Training.scenes());
    let mut folder = name.to_owned();
    folder.push(".rows");
    let cache = Cache::new(a.output.with_file_name(folder), &settings(a))?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(a.threads).build()?;
    let mut all = Vec::new();
    for index in 0..scenes {
        let (rows, line) = match cache.read(index)? {
            Some(rows) => (rows, "kept".to_owned()),
            None => {
                let begin = Instant::now();
                let rows = pool.install(|| rows_of(a, index))?;
                cache.write(index, &rows)?;
                (rows, clock(begin.elapsed().as_secs_f64()))
            }
        };
        let name = scene(index, a.seed, Split::Training).name;
        note(format_args!("{} of {scenes}: {name}, {} rows, {line}", index + 1, rows.len()));
        all.push(rows);
    }
    let what = Fit { label: a.label, rows: a.rows, vectors: a.vectors, seed: a.seed, ..Fit::default() };
    let fitted =
        pool.install(|| fit(&all, &what, Some(&|p| note(format_args!("fit {} of {}", p.done, p.total)))));
    let fitted = fitted.context("cannot train on the rows")?;
    let mut card = Card {
        format: CARD_FORMAT,
        sha256: "0".repeat(64),
        features: what.features.iter().map(|f| f.name().to_owned()).collect(),
        label: format!("+1: the {} gain of twice the samples is above the rule's average", a.label),
        data: vec![format!("training scenes 0 to {} of seed {}", scenes - 1, a.seed)],
        licence: "MIT OR Apache-2.0".to_owned(),
        command: command(a, scenes),
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
    note(format_args!(
        "{}: {} support vectors, in {}",
        a.output.display(),
        fitted.model.len(),
        clock(start.elapsed().as_secs_f64())
    ));
    Ok(ExitCode::SUCCESS)
}

/// Everything that the rows of a scene depend on.
fn settings(a: &TrainArguments) -> String {
    format!(
        "seed {} scene-rows {} replicates {} reference {} max-spp {} size-scale {}",
        a.seed, a.scene_rows, a.replicates, a.reference, a.max_spp, a.size_scale
    )
}

/// The command that gives the same model, with all defaults said.
fn command(a: &TrainArguments, scenes: u32) -> String {
    let output = a.output.file_name().unwrap_or_default().to_string_lossy();
    format!(
        "sparing train --scenes {scenes} --rows {} --scene-rows {} --label {} --replicates {} --reference {} \
         --max-spp {} --size-scale {} --vectors {} --seed {} -o {output}",
        a.rows, a.scene_rows, a.label, a.replicates, a.reference, a.max_spp, a.size_scale, a.vectors, a.seed
    )
}

/// Renders a scene and collects its rows.
fn rows_of(a: &TrainArguments, index: u32) -> anyhow::Result<Vec<Row>> {
    let mut description = scene(index, a.seed, Split::Training);
    let side = |pixels: u32| (f64::from(pixels) * a.size_scale).round().max(1.0) as u32;
    let size = [side(description.film.width), side(description.film.height)];
    // The camera is built for the film's size.
    [description.film.width, description.film.height] = size;
    let settings =
        RenderSettings { max_depth: description.integrator.max_depth, ..RenderSettings::default() };
    let name = description.name.clone();
    let scene = Scene::build(description, BuildOptions { threads: a.threads, robust: true })
        .with_context(|| format!("cannot build {name}"))?;
    let what = Collection {
        // Every scene has its own sample points.
        seed: a.seed.wrapping_add(u64::from(index) << 16),
        replicates: a.replicates,
        reference_spp: a.reference,
        bounds: Bounds { min_spp: 8, max_spp: a.max_spp },
        rows: a.scene_rows,
        ..Collection::default()
    };
    Ok(collect(&scene, size, settings, &what))
}
