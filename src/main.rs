//! The `sparing` command. Exit codes: 0 done, 1 failed, 2 usage, 130 interrupted with the picture saved.

use clap::Parser;
use sparing::commands::{Cli, run};
use sparing::session::console::note;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = Cli::parse(); // exits with 2 on a usage error
    tracing_subscriber::fmt()
        .with_env_filter(tracing_subscriber::EnvFilter::from_env("SPARING_LOG"))
        .with_writer(std::io::stderr)
        .log_internal_errors(false) // it would panic when standard error is closed
        .init();
    match run(cli) {
        Ok(code) => code,
        Err(error) => {
            note(format_args!("error: {}", message(&error)));
            ExitCode::from(if error.is::<sparing::commands::Usage>() { 2 } else { 1 })
        }
    }
}

/// The error and its causes, each said once: some messages already end in their cause.
fn message(error: &anyhow::Error) -> String {
    error.chain().skip(1).fold(error.to_string(), |text, cause| {
        let cause = cause.to_string();
        if text.ends_with(&cause) { text } else { format!("{text}: {cause}") }
    })
}
