//! `--model paper`: the sampler of Lin and Wu (2015).

use super::RenderArguments;
use super::choice::without_goal;
use crate::commands::Usage;
use sparing_adaptive::policy::paper::{CAP, LAYERS};

/// Refuses options that the sampler has no use for, and samples that it has no machines for.
pub(super) fn check(a: &RenderArguments, min_spp: u32, max_spp: u32) -> anyhow::Result<()> {
    without_goal(a, "the sampler of 2015")?;
    if !LAYERS.contains(&min_spp) || max_spp > CAP {
        return Err(Usage::error(format!(
            "the sampler of 2015 begins at 8, 16, 32, 64, 128 or 256 samples and ends at {CAP}: not {min_spp} to {max_spp}"
        )));
    }
    Ok(())
}
