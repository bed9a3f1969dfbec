//! `sparing render`.

mod choice;
pub(super) mod identity;
mod keep;
mod paper;
mod plan;
mod replay;
mod save;
mod shard;

use super::Usage;
use super::options::{crop, duration, lambda, pixel, shard, size, spp, threads, tolerance};
use super::sandbox::FileArguments;
use crate::session::console::note;
use crate::session::progress::{Observer, ProgressMode};
use crate::session::tev::Tev;
use anyhow::Context;
use choice::PolicyName;
use clap::{Args, ValueEnum};
use keep::Keeper;
use plan::{Plan, is_standard_output};
use shard::ShardBy;
use sparing_adaptive::goal::Bounds;
use sparing_adaptive::layers::{Limits, StoppedBy, render};
use sparing_image::atomic::check_writable;
use sparing_render::{BuildOptions, Renderer, Scene};
use sparing_scene::SceneDescription;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Arguments of `sparing render`.
#[derive(Debug, Args)]
pub struct RenderArguments {
    /// Scene: .pbrt, or .obj, which is framed and lit automatically.
    scene: PathBuf,
    /// Picture to write, .exr or .png; may be given several times. Default: the scene's own name, as .exr.
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Who gets samples.
    #[arg(long, value_enum, default_value_t)]
    policy: PolicyName,
    /// Model of the policy svm, with its card beside it; paper, or a folder of models, for the sampler of Lin and Wu (2015).
    /// Default: the one in the program.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Policies threshold and svm: a pixel's own samples have no say in how many it gets, so that every pixel's mean is unbiased.
    /// Takes 1.2 to 2 times the samples for the same error. Without it, some rare bright light is lost.
    #[arg(long)]
    unbiased: bool,
    /// Adaptive policies: render until the predicted mean error of the pixels is T just noticeable differences (CIEDE2000).
    /// Default: 1, unless --spp is given.
    #[arg(long, value_name = "T", value_parser = tolerance, conflicts_with = "spp", allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// Adaptive policies: render until no pixel gains more than this from one more sample, as the statistics of a render report it;
    /// decisions then depend on the pixels around only.
    #[arg(long, value_name = "L", value_parser = lambda, conflicts_with_all = ["spp", "tolerance"], allow_negative_numbers = true)]
    threshold: Option<f64>,
    /// Adaptive policies: samples that every pixel gets [default: 8].
    #[arg(long, value_name = "N", value_parser = spp, allow_negative_numbers = true)]
    min_spp: Option<u32>,
    /// Adaptive policies: samples that no pixel exceeds [default: 512].
    #[arg(long, value_name = "N", value_parser = spp, allow_negative_numbers = true)]
    max_spp: Option<u32>,
    /// Adaptive policies: multiply radiance by 2^EV before errors are judged. Default: by what makes the first layer well exposed.
    #[arg(long, value_name = "EV", allow_negative_numbers = true)]
    judge_exposure: Option<f32>,
    /// Sample points. Default: what the scene says, else sobol.
    #[arg(long, value_enum)]
    sampler: Option<Sampler>,
    /// Samples per pixel; with an adaptive policy, their average. Default: what the scene says, else 64.
    #[arg(long, value_parser = spp, allow_negative_numbers = true)]
    spp: Option<u32>,
    /// End sampling after this time: 90, 30s, 5m, 1h.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    time_limit: Option<Duration>,
    /// Keep the state of the render in FILE, an EXR that any viewer shows: every --checkpoint-interval, at ends of layers, on Ctrl-C
    /// and SIGTERM. Removed when the picture is finished.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Time between checkpoints.
    #[arg(long, value_name = "TIME", default_value = "5m", value_parser = duration, requires = "checkpoint")]
    checkpoint_interval: Duration,
    /// Go on from the checkpoint if there is one.
    #[arg(long, requires = "checkpoint")]
    resume: bool,
    /// Render part I of N only, from 1, into a file for `sparing merge`.
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<[u32; 2]>,
    /// How the picture is split.
    #[arg(long, value_enum, default_value_t, requires = "shard")]
    shard_by: ShardBy,
    /// Seed of all random numbers.
    #[arg(long, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Threads, at most 1024; 0 is all.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = threads, allow_negative_numbers = true)]
    threads: usize,
    /// Size of the picture, overriding the scene's.
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Render only the pixels x0 <= x < x1, y0 <= y < y1: the same bits as in the full picture.
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = crop)]
    crop: Option<[u32; 4]>,
    /// Bounces after the camera ray, overriding the scene's.
    #[arg(long, value_name = "D", value_parser = clap::value_parser!(u32).range(0..=10_000), allow_negative_numbers = true)]
    max_depth: Option<u32>,
    /// Estimator of direct light, for studies.
    #[arg(long, value_enum, default_value_t, hide_short_help = true)]
    estimator: EstimatorChoice,
    /// Exposure of PNG pictures in stops.
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Also write a picture of where the samples went, .png: dark is the least, bright the most.
    #[arg(long, value_name = "FILE")]
    heat_map: Option<PathBuf>,
    /// Add albedo, normal, depth and shape-count layers to EXR pictures.
    #[arg(long)]
    layers: bool,
    /// Faster intersection that may miss hits along the edges of meshes.
    #[arg(long)]
    no_robust: bool,
    /// Show the picture in tev, HDRView or another viewer that listens at HOST:PORT (tev's default port: 14158).
    #[arg(long, value_name = "HOST:PORT")]
    tev: Option<String>,
    /// How to report progress.
    #[arg(long, value_enum, default_value_t)]
    progress: ProgressMode,
    /// Write statistics as JSON to FILE; - is standard output.
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Trace one sample of this pixel (with --sample) and print it instead of rendering.
    #[arg(long, value_name = "X,Y", value_parser = pixel, requires = "sample")]
    pixel: Option<[u32; 2]>,
    /// Index of the sample for --pixel.
    #[arg(long, value_name = "N", requires = "pixel")]
    sample: Option<u32>,
    #[command(flatten)]
    files: FileArguments,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Sampler {
    /// Owen-scrambled Sobol points.
    Sobol,
    /// Independent random points.
    Independent,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum EstimatorChoice {
    /// Light and BSDF sampling, combined.
    #[default]
    Mis,
    /// Light sampling only.
    Light,
    /// BSDF sampling only.
    Bsdf,
}

/// Runs the command.
pub(super) fn run(arguments: &RenderArguments) -> anyhow::Result<ExitCode> {
    if !arguments.exposure.is_finite() {
        return Err(Usage::error("the exposure must be a finite number"));
    }
    let load_start = Instant::now();
    let quiet = !matches!(arguments.progress, ProgressMode::Auto | ProgressMode::Tty);
    let files = arguments.files.clone().with_quiet(quiet);
    let mut description = load(&arguments.scene, &files)?;
    let load_seconds = load_start.elapsed().as_secs_f64();
    let plan = Plan::new(arguments, &mut description)?;
    let stats = arguments.stats.as_ref().filter(|p| !is_standard_output(p));
    for file in plan.outputs.iter().chain(&arguments.heat_map).chain(stats) {
        check_writable(file)?;
    }
    plan.check_memory()?;
    let name = arguments.scene.display().to_string();
    let tev = arguments.tev.as_deref().map(|address| {
        Tev::connect(address, &format!("sparing {name}"))
            .with_context(|| format!("cannot reach a viewer at {address}"))
    });
    let tev = tev.transpose()?;

    let keeper = Keeper::new(arguments, &plan, &description)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build()?;
    let build_start = Instant::now();
    let options = BuildOptions { threads: arguments.threads, robust: !arguments.no_robust };
    let scene = pool.install(|| Scene::build(description, options))?;
    let build_seconds = build_start.elapsed().as_secs_f64();
    for warning in &scene.warnings {
        note(format_args!("warning: {warning}"));
    }
    if let (Some(pixel), Some(sample)) = (arguments.pixel, arguments.sample) {
        return replay::replay(&scene, &plan, pixel, sample);
    }

    let mut observer = Observer::new(arguments.progress, tev);
    plan.check_memory()?; // the scene has taken its part by now
    // From here on the first signal ends the render with its picture saved, the second ends the process.
    let interrupt = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, 130, Arc::clone(&interrupt))?;
        signal_hook::flag::register(signal, Arc::clone(&interrupt))?;
    }
    let (mut state, keeper) = keeper.begin(&plan)?;
    observer.keep(keeper.timer());
    let renderer = Renderer::new(&scene, plan.settings, plan.film);
    let mut policy = plan.choice.policy();
    let bounds = Bounds { max_spp: plan.shard.most(plan.choice.bounds.max_spp), ..plan.choice.bounds };
    let limits = Limits { bounds, time: arguments.time_limit, exposure: plan.choice.exposure };
    let mut outcome =
        pool.install(|| render(&renderer, &mut state, &mut *policy, &limits, &interrupt, &mut observer));

    let finished = !matches!(outcome.stopped_by, StoppedBy::Interrupt | StoppedBy::TimeLimit);
    let mut timer = observer.timer();
    if let Some(timer) = &mut timer
        && (!finished || plan.shard.cuts())
    {
        timer.save(&state);
    }
    plan.shard.cut(&mut state, &mut outcome.decisions);
    let seconds = [load_seconds, build_seconds];
    let run = save::Run { name: &name, plan: &plan, scene: &scene, state: &state, outcome: &outcome };
    let statistics = run.statistics(pool.current_num_threads(), seconds);
    let saved = match arguments.shard {
        None => run.save(&statistics, arguments),
        Some(_) if finished => run.save_shard(&statistics, arguments, &keeper),
        Some(_) => Ok(()),
    };
    if let (Err(_), Some(timer)) = (&saved, &mut timer) {
        if finished && !plan.shard.cuts() {
            timer.save(&state);
        }
        if timer.succeeded() {
            note(format_args!("the render is in {}: --resume goes on from it", timer.path().display()));
        }
    }
    saved?;
    keeper.end(finished, timer)?;
    observer.finish(outcome.stopped_by);
    run.report(&statistics, arguments);
    Ok(if outcome.stopped_by == StoppedBy::Interrupt { ExitCode::from(130) } else { ExitCode::SUCCESS })
}

/// Loads a scene and prints its warnings; errors show the place in the file.
pub(super) fn load(path: &Path, files: &FileArguments) -> anyhow::Result<SceneDescription> {
    let description = files.load(path).map_err(|e| {
        let report = e.report();
        anyhow::anyhow!("{}", report.strip_prefix("error: ").unwrap_or(&report).trim_end())
    })?;
    for warning in &description.warnings {
        note(format_args!("warning: {warning}"));
    }
    Ok(description)
}
