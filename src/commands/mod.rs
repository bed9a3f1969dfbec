//! One file per subcommand.

mod compare;
mod convert;
mod info;
mod machine;
mod merge;
mod options;
mod render;
mod sandbox;
mod stress;
mod study;
mod tradeoff;
mod train;

pub use render::RenderArguments;

use crate::session::console::print;
use anyhow::Context;
use clap::{CommandFactory, Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// A path tracer that learns where to spend its samples.
#[derive(Debug, Parser)]
#[command(name = "sparing", version = crate::VERSION, about, propagate_version = true)]
#[command(
    after_help = "Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted with the partial picture saved."
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene (.pbrt, .gltf, .glb, .obj, .ply) to EXR or PNG.
    Render(Box<RenderArguments>),
    /// Measure how far a picture is from a reference.
    Compare(compare::CompareArguments),
    /// Say what is in a scene or a picture, and what rendering will skip.
    Info(info::InfoArguments),
    /// Put the parts of a picture together, or average pictures with different seeds.
    Merge(merge::MergeArguments),
    /// Write a scene (.pbrt, .gltf, .glb, .obj, .ply) as one pbrt file, with its meshes and pictures beside it.
    Convert(convert::ConvertArguments),
    /// Compare sampling policies at equal error: time, samples, bias; tables, plots and one HTML page.
    Study(study::StudyArguments),
    /// Measure what fewer support vectors cost: accuracy, agreement, time and memory of pruned machines.
    Tradeoff(tradeoff::TradeoffArguments),
    /// Run numbers that hurt through everything, and check the bounds that must hold.
    Stress(stress::StressArguments),
    /// Train the machine of the policy svm on scenes made for it.
    Train(train::TrainArguments),
    /// Write shell completions to standard output.
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
    /// Write the manual pages into a folder.
    Man {
        /// Folder, made if missing.
        #[arg(default_value = "man")]
        folder: PathBuf,
    },
}

/// A usage error found after parsing: exit code 2.
#[derive(Debug)]
pub struct Usage(String);

impl Usage {
    /// An error with a message.
    #[must_use]
    pub fn error(message: impl Into<String>) -> anyhow::Error {
        anyhow::Error::new(Self(message.into()))
    }
}

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// Runs a command line.
///
/// # Errors
/// What went wrong; [`Usage`] if the arguments were.
pub fn run(cli: Cli) -> anyhow::Result<ExitCode> {
    match cli.command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Stress(arguments) => stress::run(&arguments),
        Command::Tradeoff(arguments) => tradeoff::run(&arguments),
        Command::Train(arguments) => train::run(&arguments),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "sparing", &mut script);
            print(String::from_utf8_lossy(&script).trim_end())?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Man { folder } => {
            std::fs::create_dir_all(&folder)
                .and_then(|()| clap_mangen::generate_to(Cli::command(), &folder))
                .with_context(|| format!("cannot write manual pages into {}", folder.display()))?;
            print(folder.display())?;
            Ok(ExitCode::SUCCESS)
        }
    }
}
