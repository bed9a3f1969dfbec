//! `sparing study`: policies against each other at equal error, with references of their own.
//!
//! | module | what it holds |
//! | --- | --- |
//! | `plan` | what is rendered: scenes, policies, their knobs |
//! | `stage` | one scene ready to render, one render |
//! | `references` | converged pictures, cached |
//! | `record` | the measures of one render, kept for `--resume` |
//! | `run` | all renders of a scene, with progress |
//! | `results` | costs at equal error, their means, biases, the oracle |
//! | `tables`, `plots`, `pictures`, `page` | what is written |

mod page;
mod pictures;
mod plan;
mod plots;
mod record;
mod references;
mod results;
mod run;
mod stage;
mod tables;

use super::options::{size, spp, threads};
use super::sandbox::FileArguments;
use crate::plot::write_text;
use crate::session::console::{note, print};
use crate::session::progress::clock;
use anyhow::Context;
use clap::Args;
use plan::{Clock, Plan, PolicyName};
use sparing_image::atomic::check_writable;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Arguments of `sparing study`.
#[derive(Debug, Args)]
pub(super) struct StudyArguments {
    /// Scenes, .pbrt or .obj.
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// Folder, made if missing: index.html with everything inside it, study.csv, summary.csv, study.json, plots, pictures,
    /// references, renders.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Policies to compare; uniform is always one of them.
    #[arg(
        long,
        value_name = "NAME,..",
        value_enum,
        value_delimiter = ',',
        default_value = "uniform,threshold,svm,planned,shapes,half-buffer"
    )]
    policies: Vec<PolicyName>,
    /// Policies are compared at the errors that uniform sampling has at these samples per pixel.
    #[arg(long, value_name = "N,..", value_delimiter = ',', default_value = "64,256", value_parser = spp,
        allow_negative_numbers = true)]
    levels: Vec<u32>,
    /// Samples that no pixel of a render exceeds.
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = spp, allow_negative_numbers = true)]
    max_spp: u32,
    /// Samples per pixel of the references. They stay in DIR and are used again when scene file, size, seed and this number
    /// are the same.
    #[arg(long, value_name = "N", default_value_t = 8192, value_parser = spp, allow_negative_numbers = true)]
    reference_spp: u32,
    /// Size of the pictures, overriding the scenes'.
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Seed of the renders; references get another one.
    #[arg(long, value_name = "S", default_value_t = 0, allow_negative_numbers = true)]
    seed: u64,
    /// Renders of each setting, with seeds from --seed on. Errors and samples are their means, times their medians.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000),
        allow_negative_numbers = true)]
    seeds: u32,
    /// Threads, at most 1024; 0 is all.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = threads, allow_negative_numbers = true)]
    threads: usize,
    #[command(flatten)]
    files: FileArguments,
    /// What time is.
    #[arg(long, value_enum, default_value_t)]
    clock: Clock,
    /// Take finished renders of the same settings and version from DIR instead of rendering them again.
    #[arg(long)]
    resume: bool,
}

/// Names of what is written into the folder besides pictures.
const PAGE: &str = "index.html";
const RENDERS: &str = "study.csv";
const SUMMARY: &str = "summary.csv";
const JSON: &str = "study.json";

pub(super) fn run(a: &StudyArguments) -> anyhow::Result<ExitCode> {
    let start = Instant::now();
    let plan = Plan::new(a)?;
    for folder in ["references", "renders", "plots", "pictures"].map(|f| plan.folder.join(f)) {
        std::fs::create_dir_all(&folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    for name in [PAGE, RENDERS, SUMMARY, JSON] {
        check_writable(&plan.folder.join(name))?;
    }
    // The first signal ends the study after what is finished is kept, the second ends the process.
    let interrupt = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, 130, Arc::clone(&interrupt))?;
        signal_hook::flag::register(signal, Arc::clone(&interrupt))?;
    }
    let Some(scenes) = run::all(&plan, &interrupt)? else {
        note(format_args!(
            "interrupted; finished renders are in {}: --resume goes on",
            plan.folder.display()
        ));
        return Ok(ExitCode::from(130));
    };
    let study = results::Study::new(&plan, scenes);
    write_text(&plan.folder.join(RENDERS), &tables::renders_csv(&study))?;
    write_text(&plan.folder.join(SUMMARY), &tables::summary_csv(&study))?;
    write_text(&plan.folder.join(JSON), &(serde_json::to_string_pretty(&study)? + "\n"))?;
    let plots = plots::write(&plan, &study)?;
    let pictures = pictures::write(&plan, &study)?;
    write_text(&plan.folder.join(PAGE), &page::page(&study, &plots, &pictures))?;
    print(tables::text(&study))?;
    note(format_args!("{} in {}", plan.folder.join(PAGE).display(), clock(start.elapsed().as_secs_f64())));
    Ok(ExitCode::SUCCESS)
}
