//! The `sparing` command. Exit codes: 0 done, 1 failed, 2 usage, 130 interrupted with the picture saved.

use clap::Parser;
use sparing::commands::{Cli, run};
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = Cli::parse(); // exits with 2 on a usage error
    tracing_subscriber::fmt()
        .with_env_filter(tracing_subscriber::EnvFilter::from_env("SPARING_LOG"))
        .with_writer(std::io::stderr)
        .init();
    match run(cli) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {}", message(&error));
            ExitCode::from(if error.is::<sparing::commands::Usage>() { 2 } else { 1 })
        }
    }
}

/// An error with its causes, those that it already quotes left out.
fn message(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}
