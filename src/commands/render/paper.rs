//! `--model paper`: the sampler of Lin and Wu (2015).

use super::RenderArguments;
use crate::commands::Usage;
use sparing_adaptive::policy::paper::{CAP, LAYERS};

/// Refuses options that the sampler has no use for, and samples that it has no machines for.
pub(super) fn check(a: &RenderArguments, min_spp: u32, max_spp: u32) -> anyhow::Result<()> {
    let goal = [a.tolerance.map(|_| "tolerance"), a.spp.map(|_| "spp")];
    if let Some(option) = goal.into_iter().flatten().next() {
        return Err(Usage::error(format!("--{option}: the sampler of 2015 has no goal to set")));
    }
    if !LAYERS.contains(&min_spp) || max_spp > CAP {
        return Err(Usage::error(format!(
            "the sampler of 2015 begins at 8, 16, 32, 64, 128 or 256 samples and ends at {CAP}: not {min_spp} to {max_spp}"
        )));
    }
    Ok(())
}
