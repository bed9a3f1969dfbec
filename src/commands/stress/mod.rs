//! `sparing stress`: numbers that hurt, and the bounds that must hold.

mod case;
mod colour;
mod geometry;
mod lights;
mod reference;
mod report;
mod sampling;
mod scenes;
mod shading;
mod statistics;
mod svm;

use crate::session::console::note;
use anyhow::bail;
use case::{Case, Effort};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Arguments of `sparing stress`.
#[derive(Debug, Args)]
pub(super) struct StressArguments {
    /// Fewer samples and sizes: a minute instead of half an hour.
    #[arg(long)]
    quick: bool,
    /// Write the table as stability.md and stability.csv into this folder.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Only cases whose name contains this text.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
}

/// All cases, in the order of the table.
fn cases() -> Vec<Case> {
    let areas = [
        statistics::CASES,
        svm::CASES,
        geometry::CASES,
        shading::CASES,
        lights::CASES,
        colour::CASES,
        sampling::CASES,
    ];
    areas.concat()
}

/// Runs the command.
pub(super) fn run(a: &StressArguments) -> anyhow::Result<ExitCode> {
    let effort = Effort { quick: a.quick };
    let wanted = |case: &Case| a.only.as_ref().is_none_or(|text| case.name.contains(text.as_str()));
    let cases: Vec<Case> = cases().into_iter().filter(wanted).collect();
    if cases.is_empty() {
        bail!("no case has a name with {:?} in it", a.only.as_deref().unwrap_or_default());
    }
    let mut outcomes = Vec::new();
    for (k, case) in cases.iter().enumerate() {
        let start = Instant::now();
        let outcome = case.run(effort);
        note(format_args!(
            "{:>3} of {}: {} {}: {} ({:.1} s)",
            k + 1,
            cases.len(),
            if outcome.holds() { "holds" } else { "FAILS" },
            case.name,
            outcome.measured(),
            start.elapsed().as_secs_f64()
        ));
        outcomes.push(outcome);
    }
    if let Some(folder) = &a.report {
        report::write(folder, &outcomes, effort)?;
    }
    let failed: Vec<&str> = outcomes.iter().filter(|o| !o.holds()).map(|o| o.case.name).collect();
    if !failed.is_empty() {
        bail!("{} of {} cases do not hold: {}", failed.len(), outcomes.len(), failed.join(", "));
    }
    note(format_args!("all {} cases hold", outcomes.len()));
    Ok(ExitCode::SUCCESS)
}
