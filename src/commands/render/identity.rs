//! What a render depends on, for checkpoints and shards.

use super::RenderArguments;
use super::plan::Plan;
use crate::session::checkpoint::Identity;
use anyhow::Context;
use sha2::{Digest, Sha256};
use sparing_scene::SceneDescription;
use std::path::{Path, PathBuf};

/// The name of the seed, in which parts to be averaged may differ.
pub(in crate::commands) const SEED: &str = "seed";

/// Everything that samples depend on, read from the scene before it is built.
pub(super) fn identity(a: &RenderArguments, plan: &Plan, d: &SceneDescription) -> anyhow::Result<Identity> {
    let ([w, h], [x0, y0, x1, y1]) = (plan.size, plan.shard.whole);
    let settings = plan.settings;
    let model = match &a.model {
        Some(path) if path.as_os_str() != "paper" => hash_model(path)?,
        Some(_) => "paper".to_owned(),
        None => String::new(),
    };
    let entries = [
        ("version", crate::VERSION.to_owned()),
        ("scene", d.fingerprint()?),
        ("size", format!("{w}x{h}")),
        ("crop", format!("{x0},{y0},{x1},{y1}")),
        ("sampler", format!("{:?}", settings.sampler)),
        (SEED, settings.seed.to_string()),
        ("max-depth", settings.max_depth.to_string()),
        ("estimator", format!("{:?}", settings.estimator)),
        ("robust intersection", (!a.no_robust).to_string()),
        ("policy", plan.choice.name().to_owned()),
        ("goal", format!("{:?}", plan.choice.goal())),
        ("min-spp", plan.choice.bounds.min_spp.to_string()),
        ("max-spp", plan.choice.bounds.max_spp.to_string()),
        ("judge-exposure", format!("{:?}", plan.choice.exposure)),
        ("model", model),
        ("layers", format!("{:?}", plan.film)),
    ];
    Ok(Identity(entries.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()))
}

/// SHA-256 of a model with its card, or of all files of a folder of models.
fn hash_model(path: &Path) -> anyhow::Result<String> {
    let fail = || format!("cannot read {}", path.display());
    let mut files: Vec<PathBuf> = if path.is_dir() {
        let entries = std::fs::read_dir(path).with_context(fail)?;
        entries.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>().with_context(fail)?
    } else {
        vec![path.to_owned(), sparing_svm::Card::path(path)]
    };
    files.retain(|f| f.is_file());
    files.sort();
    let mut hasher = Sha256::new();
    for file in files {
        hasher.update(std::fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?);
    }
    Ok(hasher.finalize().iter().map(|b| format!("{b:02x}")).collect())
}
