//! `sparing merge`.

mod average;
mod group;

use super::Usage;
use crate::session::checkpoint::{self, Header};
use crate::session::console::note;
use average::Average;
use clap::Args;
use group::Group;
use sparing_image::atomic::check_writable;
use sparing_image::exr::{ExrAttribute, ExrImage, film_layers, write_exr};
use sparing_image::png::write_png;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `sparing merge`.
#[derive(Debug, Args)]
pub(super) struct MergeArguments {
    /// Files of `sparing render --shard`: all parts of one picture, or of several that differ in nothing but the seed, which are
    /// averaged by their numbers of samples.
    #[arg(required = true)]
    shards: Vec<PathBuf>,
    /// Picture to write, .exr or .png; may be given several times.
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Exposure of PNG pictures in stops.
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
}

/// Attributes of a shard that a merged picture has too: the same in all of them.
const KEPT: [&str; 10] = [
    "software",
    "worldToCamera",
    "sparing.scene",
    "sparing.policy",
    "sparing.sampler",
    "sparing.maxDepth",
    "sparing.spp",
    "sparing.fieldOfView",
    "sparing.lensRadius",
    "sparing.focalDistance",
];

/// Runs the command.
pub(super) fn run(a: &MergeArguments) -> anyhow::Result<ExitCode> {
    for path in &a.output {
        let known =
            ["exr", "png"].iter().any(|e| path.extension().is_some_and(|x| x.eq_ignore_ascii_case(e)));
        if !known {
            return Err(Usage::error(format!("{}: pictures are written as .exr or .png", path.display())));
        }
        check_writable(path)?;
    }
    if !a.exposure.is_finite() {
        return Err(Usage::error("the exposure must be a finite number"));
    }
    // A seed's parts come together; all else must agree.
    let mut groups: BTreeMap<String, Group> = BTreeMap::new();
    let mut first: Option<(PathBuf, Header)> = None;
    let mut kept = Vec::new();
    for path in &a.shards {
        let (header, attributes) = checkpoint::read_header(path)?;
        let (reference, agreed) = first.get_or_insert_with(|| {
            kept = attributes;
            (path.clone(), header.clone())
        });
        group::check(&header, path, agreed, reference)?;
        groups.entry(group::seed(&header)).or_default().add(path.clone(), header)?;
    }
    for group in groups.values() {
        group.check_complete()?;
    }
    let attributes = attributes(kept, groups.keys());
    let seeds = groups.len();
    let (mut average, mut image) = (None::<Average>, None);
    for group in groups.into_values() {
        let merged = group.merge()?;
        if seeds == 1 {
            image = Some(whole(&merged, attributes.clone()));
        } else {
            match &mut average {
                Some(average) => average.add(&merged.state.film),
                None => average = Some(Average::new(&merged.state.film)),
            }
        }
    }
    let image = image.or(average.map(|average| average.image(attributes)));
    let Some(image) = image else { return Err(Usage::error("nothing to merge")) };
    for path in &a.output {
        save(path, &image, a.exposure)?;
    }
    let seeds = if seeds > 1 { format!(" of {seeds} seeds") } else { String::new() };
    note(format_args!("{} parts{seeds} merged: {}x{}", a.shards.len(), image.width, image.height));
    Ok(ExitCode::SUCCESS)
}

/// The picture of a film that is complete, as `sparing render` writes it.
fn whole(merged: &group::Merged, attributes: Vec<(String, ExrAttribute)>) -> ExrImage {
    let mut image = film_layers(&merged.state.film, attributes);
    if !merged.decisions.is_empty() {
        image.push("Decision.Y", merged.decisions.clone());
    }
    image.attributes.push(("sparing.renderSeconds".to_owned(), ExrAttribute::Double(merged.state.seconds)));
    image
}

fn save(path: &Path, image: &ExrImage, exposure: f32) -> anyhow::Result<()> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        write_exr(path, image)?;
    } else {
        let pixels = image.rgb("").unwrap_or_default();
        write_png(path, image.width, image.height, &pixels, exposure)?;
    }
    Ok(())
}

/// Those of a part that its picture has too, and all seeds.
fn attributes<'a>(
    of_part: Vec<(String, ExrAttribute)>,
    seeds: impl Iterator<Item = &'a String>,
) -> Vec<(String, ExrAttribute)> {
    let mut kept: Vec<_> = of_part.into_iter().filter(|(name, _)| KEPT.contains(&name.as_str())).collect();
    let seeds: Vec<&str> = seeds.map(String::as_str).collect();
    kept.push(("sparing.seed".to_owned(), ExrAttribute::String(seeds.join(", "))));
    kept
}
