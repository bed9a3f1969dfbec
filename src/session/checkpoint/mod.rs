//! Checkpoints and shards: a render's state in an OpenEXR file, which any viewer shows.
//!
//! [`sparing_image::raw`] has the film. Besides it, a file has what the loop of layers knows ([`State`]): targets and the ledger as
//! channels, the rest as JSON in the attribute `sparing.state`, beside the [`Identity`] that must agree for the file to be
//! taken up or merged.

mod header;
mod lock;
mod timer;

pub use header::{Header, Identity, Part};
pub use lock::Lock;
pub use timer::Timer;

use anyhow::{Context, anyhow, bail};
use sparing_adaptive::ledger::{Ledger, Passed};
use sparing_adaptive::pooling::Plane;
use sparing_adaptive::state::State;
use sparing_image::exr::{ExrAttribute, write_image};
use sparing_image::openexr_core::{self, Channel, Compression, Image, ImageRef, Limits, Samples};
use sparing_image::raw;
use std::fs::File;
use std::path::Path;

/// What is read at most.
pub const LIMITS: Limits = Limits { max_side: 65_536, max_channels: 1024, max_bytes: 64 << 30 };

const STATE: &str = "sparing.state";
const PLAN: &str = "State.Plan";
const TARGET: &str = "State.Target";
const DECISION: &str = "Decision.Y";

/// A file in memory.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// What it is of and how far it got.
    pub header: Header,
    /// The state.
    pub state: State,
    /// The last decision values, in rows; empty if there are none.
    pub decisions: Vec<f32>,
}

/// Writes a file; it appears when it is complete.
///
/// # Errors
/// The disk or the folder refuses.
pub fn write(
    path: &Path,
    header: &Header,
    state: &State,
    decisions: &[f32],
    mut attributes: Vec<(String, ExrAttribute)>,
) -> anyhow::Result<()> {
    let film = &state.film;
    let text = serde_json::to_string(header).context("a header is JSON")?;
    attributes.push((STATE.to_owned(), ExrAttribute::String(text)));
    let mut channels = Vec::new();
    let mut push = |name: String, samples| channels.push(Channel { name, samples });
    if !state.targets.is_empty() {
        push(TARGET.to_owned(), Samples::U32(state.targets.clone()));
    }
    let (plan, passed) = state.ledger.parts();
    if let Some(plan) = plan {
        push(PLAN.to_owned(), Samples::F32(plan.values.clone()));
    }
    let pixels = film.width() as usize * film.height() as usize;
    for (k, layer) in by_layer(passed, pixels).into_iter().enumerate() {
        push(format!("State.Passed{k}.Count"), Samples::U32(layer.iter().map(|p| p.count).collect()));
        for (c, rgb) in ["R", "G", "B"].into_iter().enumerate() {
            let means = layer.iter().map(|p| p.mean[c]).collect();
            push(format!("State.Passed{k}.{rgb}"), Samples::F32(means));
        }
    }
    if !film.correction.is_empty() {
        for (c, rgb) in ["R", "G", "B"].into_iter().enumerate() {
            push(
                format!("Raw.Correction.{rgb}"),
                Samples::F32(film.correction.iter().map(|v| v[c]).collect()),
            );
        }
    }
    if !decisions.is_empty() {
        push(DECISION.to_owned(), Samples::F32(decisions.to_vec()));
    }
    let image = raw::image_of(film, attributes, channels);
    // Written in a moment rather than small: bits of sums hardly pack.
    write_image(path, ImageRef { compression: Compression::None, ..ImageRef::from(&image) })?;
    Ok(())
}

/// What passed, once a pixel and layer: the k-th time that each pixel was noted, of count 0 where there was none.
fn by_layer(passed: &[Passed], pixels: usize) -> Vec<Vec<Passed>> {
    let mut layers: Vec<Vec<Passed>> = Vec::new();
    let mut noted = vec![0_usize; pixels];
    for p in passed {
        let Some(k) = noted.get_mut(p.pixel as usize) else { continue };
        if layers.len() == *k {
            let none = |pixel| Passed { pixel, count: 0, mean: [0.0; 3] };
            layers.push((0..pixels as u32).map(none).collect());
        }
        layers[*k][p.pixel as usize] = *p;
        *k += 1;
    }
    layers
}

/// Reads a file.
///
/// # Errors
/// It cannot be read, is no checkpoint, or is damaged.
pub fn read(path: &Path) -> anyhow::Result<Checkpoint> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let image = openexr_core::read(&bytes, &LIMITS).map_err(|e| anyhow!("{}: {e}", path.display()))?;
    drop(bytes);
    parse(&image).with_context(|| format!("{} is no checkpoint or shard that can be used", path.display()))
}

/// Reads what a file is of, and its attributes, without its pixels.
///
/// # Errors
/// As [`read`].
pub fn read_header(path: &Path) -> anyhow::Result<(Header, Vec<(String, ExrAttribute)>)> {
    let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    let image =
        openexr_core::read_header_from(file, &LIMITS).map_err(|e| anyhow!("{}: {e}", path.display()))?;
    let unusable = || format!("{} is no checkpoint or shard that can be used", path.display());
    Ok((header(&image).with_context(unusable)?, image.attributes))
}

fn header(image: &Image) -> anyhow::Result<Header> {
    let text = raw::text(image, STATE).context("it is a picture, without the sums it was made of")?;
    serde_json::from_str(text).context("its state is damaged or of another version")
}

fn parse(image: &Image) -> anyhow::Result<Checkpoint> {
    let header = header(image)?;
    let mut film = raw::film_of(image).map_err(anyhow::Error::msg)?;
    let [width, height] = image.data.size.map(|n| n as usize);
    let floats = |name: &str| match image.channel(name).map(|c| &c.samples) {
        Some(Samples::F32(values)) => Some(values),
        _ => None,
    };
    let colours = |layer: &str| -> Option<Vec<[f32; 3]>> {
        let [r, g, b] = ["R", "G", "B"].map(|c| floats(&format!("{layer}.{c}")));
        Some(r?.iter().zip(g?).zip(b?).map(|((r, g), b)| [*r, *g, *b]).collect())
    };
    film.correction = colours("Raw.Correction").unwrap_or_default();
    let plan = floats(PLAN).map(|values| Plane { width, height, values: values.clone() });
    let mut passed = Vec::new();
    for k in 0.. {
        let Ok(counts) = raw::u32s(image, &format!("State.Passed{k}.Count")) else { break };
        let means = colours(&format!("State.Passed{k}")).context("what passed is damaged")?;
        passed.extend(
            counts
                .iter()
                .zip(means)
                .enumerate()
                .filter(|(_, (n, _))| **n > 0)
                .map(|(pixel, (count, mean))| Passed { pixel: pixel as u32, count: *count, mean }),
        );
    }
    let targets = raw::u32s(image, TARGET).map(<[u32]>::to_vec).unwrap_or_default();
    if targets.iter().any(|n| *n > header.most) {
        bail!("it has targets beyond the most samples of a pixel");
    }
    let lambdas = header.lambdas.iter().map(|l| l.unwrap_or(f64::INFINITY));
    let state = State {
        film,
        ledger: Ledger::from_parts(plan, lambdas.collect(), passed),
        targets,
        exposure: header.exposure,
        layers: header.layers.clone(),
        rays: header.rays.into(),
        seconds: header.seconds,
        base_samples: header.base_samples,
    };
    let decisions = floats(DECISION).cloned().unwrap_or_default();
    Ok(Checkpoint { header, state, decisions })
}
