//! `sparing train`.

mod cache;
mod gain;
mod paper;

use super::Usage;
use super::options::{spp, threads};
use crate::session::console::note;
use crate::session::progress::clock;
use anyhow::Context;
use cache::Cache;
use clap::Args;
use rayon::ThreadPool;
use sparing_adaptive::features::Feature;
use sparing_adaptive::training::Label;
use sparing_render::{BuildOptions, RenderSettings, Scene};
use sparing_scene::SceneDescription;
use sparing_scene::generate::training::{Split, scene};
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Arguments of `sparing train`.
#[derive(Debug, Args)]
pub(super) struct TrainArguments {
    /// Model to write, with its card beside it; with --label paper, a folder of models. Rows are kept in a folder
    /// OUTPUT.rows, so that a run that was stopped goes on where it was.
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
    /// What a row is told: realised, conditional or expected gain. Or paper: the sampler of Lin and Wu (2015), which has no
    /// use for --replicates, --reference, --max-spp, --features and --vectors.
    #[arg(long, default_value = "realised")]
    label: Target,
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
    /// Features that the machine uses, by the names in its card [default: twelve].
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', value_parser = feature)]
    features: Vec<Feature>,
    /// Most support vectors.
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = rows, allow_negative_numbers = true)]
    vectors: usize,
    /// Seed of all random choices.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64),
        allow_negative_numbers = true)]
    seed: u64,
    /// Threads, at most 1024; 0 is all. They do not change the model.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = threads, allow_negative_numbers = true)]
    threads: usize,
}

/// What is trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Target {
    Gain(Label),
    Paper,
}

impl FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "paper" => Ok(Self::Paper),
            _ => text.parse().map(Self::Gain).map_err(|e: String| format!("{e}, paper")),
        }
    }
}

fn feature(text: &str) -> Result<Feature, String> {
    Feature::from_name(text).ok_or_else(|| {
        let names: Vec<&str> = Feature::ALL.iter().map(|f| f.name()).collect();
        format!("'{text}' is not a feature: use {}", names.join(", "))
    })
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
    let start = Instant::now();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(a.threads).build()?;
    let vectors = match a.label {
        Target::Gain(label) => gain::train(a, label, &pool, &armed)?,
        Target::Paper => paper::train(a, &pool, &armed)?,
    };
    let seconds = start.elapsed().as_secs_f64();
    note(format_args!("{}: {vectors} support vectors, in {}", a.output.display(), clock(seconds)));
    Ok(ExitCode::SUCCESS)
}

/// A training scene, built for its size.
struct Stage {
    scene: Scene,
    size: [u32; 2],
    settings: RenderSettings,
    /// Every scene has its own sample points.
    seed: u64,
}

impl TrainArguments {
    fn scenes(&self) -> u32 {
        self.scenes.unwrap_or(Split::Training.scenes())
    }

    /// The output's last name.
    fn name(&self) -> anyhow::Result<String> {
        let name = self.output.file_name();
        let name =
            name.ok_or_else(|| Usage::error(format!("{} is not the name of a file", self.output.display())))?;
        Ok(name.to_string_lossy().into_owned())
    }

    /// The rows of all scenes, a list a scene: those that are kept already, and those that `collect` gives of a scene, which
    /// `change` may change before it is built. `settings` is everything that they depend on.
    fn rows(
        &self,
        settings: String,
        columns: usize,
        pool: &ThreadPool,
        change: fn(&mut SceneDescription),
        collect: impl Fn(&Stage) -> Vec<Vec<f64>> + Sync,
    ) -> anyhow::Result<Vec<Vec<Vec<f64>>>> {
        let mut folder = self.output.file_name().unwrap_or_default().to_owned();
        folder.push(".rows");
        let cache = Cache::new(self.output.with_file_name(folder), settings, columns)?;
        let mut all = Vec::new();
        for index in 0..self.scenes() {
            let (rows, line) = match cache.read(index)? {
                Some(rows) => (rows, "kept".to_owned()),
                None => {
                    let begin = Instant::now();
                    let rows =
                        pool.install(|| Ok::<_, anyhow::Error>(collect(&self.stage(index, change)?)))?;
                    cache.write(index, &rows)?;
                    (rows, clock(begin.elapsed().as_secs_f64()))
                }
            };
            let name = scene(index, self.seed, Split::Training).name;
            note(format_args!("{} of {}: {name}, {} rows, {line}", index + 1, self.scenes(), rows.len()));
            all.push(rows);
        }
        Ok(all)
    }

    fn stage(&self, index: u32, change: fn(&mut SceneDescription)) -> anyhow::Result<Stage> {
        let mut description = scene(index, self.seed, Split::Training);
        change(&mut description);
        let side = |pixels: u32| (f64::from(pixels) * self.size_scale).round().max(1.0) as u32;
        let size = [side(description.film.width), side(description.film.height)];
        // The camera is built for the film's size.
        [description.film.width, description.film.height] = size;
        let settings =
            RenderSettings { max_depth: description.integrator.max_depth, ..RenderSettings::default() };
        let name = description.name.clone();
        let scene = Scene::build(description, BuildOptions { threads: self.threads, robust: true })
            .with_context(|| format!("cannot build {name}"))?;
        Ok(Stage { scene, size, settings, seed: self.seed.wrapping_add(u64::from(index) << 16) })
    }
}
