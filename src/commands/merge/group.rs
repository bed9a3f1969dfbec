//! The parts of one picture: whether they fit, and together.

use crate::commands::render::identity::SEED;
use crate::session::checkpoint::{self, Checkpoint, Header, Part};
use anyhow::{Context, bail};
use sparing_adaptive::state::State;
use sparing_image::film::Film;
use std::path::{Path, PathBuf};

/// The seed of a part.
pub(super) fn seed(header: &Header) -> String {
    header.identity.0.get(SEED).cloned().unwrap_or_default()
}

/// Refuses a part of another picture, or one that is not finished.
pub(super) fn check(header: &Header, path: &Path, other: &Header, beside: &Path) -> anyhow::Result<()> {
    if !header.complete {
        bail!("{} is not finished: it is a checkpoint, to go on from with --resume", path.display());
    }
    other
        .identity
        .check(&header.identity, &[SEED])
        .with_context(|| format!("{} and {} are of different renders", beside.display(), path.display()))
}

/// Parts of one seed.
#[derive(Default)]
pub(super) struct Group {
    parts: Vec<(PathBuf, Header)>,
}

/// A picture that is whole again.
pub(super) struct Merged {
    pub(super) state: State,
    pub(super) decisions: Vec<f32>,
}

/// Index, count and kind of a part.
fn place(part: Part) -> (u32, u32, &'static str) {
    match part {
        Part::Whole => (1, 1, "the whole picture"),
        Part::Rows { index, count } => (index, count, "rows"),
        Part::Samples { index, count, .. } => (index, count, "samples"),
    }
}

impl Group {
    /// Adds a part; refuses one that is there already or that is split otherwise.
    pub(super) fn add(&mut self, path: PathBuf, header: Header) -> anyhow::Result<()> {
        let (index, count, kind) = place(header.part);
        for (other, there) in &self.parts {
            let (other_index, other_count, other_kind) = place(there.part);
            if (count, kind) != (other_count, other_kind) {
                bail!(
                    "{} is part {other_index} of {other_count} by {other_kind}, {} is part {index} of {count} by {kind}: they do not \
                     fit together",
                    other.display(),
                    path.display()
                );
            }
            if index == other_index {
                bail!(
                    "{} and {} are both part {index} of {count}{}",
                    other.display(),
                    path.display(),
                    if count == 1 { ", with the same seed: samples would count twice" } else { "" }
                );
            }
        }
        self.parts.push((path, header));
        self.parts.sort_by_key(|(_, h)| place(h.part).0);
        Ok(())
    }

    /// Refuses gaps.
    pub(super) fn check_complete(&self) -> anyhow::Result<()> {
        let Some((path, header)) = self.parts.first() else { bail!("no parts") };
        let (_, count, kind) = place(header.part);
        let there: Vec<u32> = self.parts.iter().map(|(_, h)| place(h.part).0).collect();
        let missing: Vec<String> =
            (1..=count).filter(|i| !there.contains(i)).take(8).map(|i| i.to_string()).collect();
        if !missing.is_empty() {
            bail!(
                "{} of {count} parts by {kind} are missing beside {}: {}",
                count as usize - there.len(),
                path.display(),
                missing.join(", ")
            );
        }
        Ok(())
    }

    /// Reads all parts, one at a time, into one film.
    pub(super) fn merge(self) -> anyhow::Result<Merged> {
        let mut merged: Option<Merged> = None;
        for (path, _) in self.parts {
            let part = checkpoint::read(&path)?;
            let damaged = || format!("{}: its pixels are not those of its part", path.display());
            match &mut merged {
                Some(merged) => merged.add(part).with_context(damaged)?,
                None => {
                    let Checkpoint { header, mut state, decisions } = part;
                    if let Part::Rows { .. } = header.part {
                        // Room for the rows below.
                        let crop = header.crop;
                        if state.film.crop[1] != crop[1] || state.film.crop[0] != crop[0] {
                            bail!(damaged());
                        }
                    }
                    state.base_samples = 0;
                    merged = Some(Merged { state, decisions });
                }
            }
        }
        merged.context("no parts")
    }
}

impl Merged {
    fn add(&mut self, part: Checkpoint) -> anyhow::Result<()> {
        let film = part.state.film;
        match part.header.part {
            Part::Samples { .. } => add_samples(&mut self.state.film, film)?,
            _ => self.add_rows(film, part.decisions)?,
        }
        self.state.rays += part.state.rays;
        self.state.seconds += part.state.seconds;
        Ok(())
    }

    fn add_rows(&mut self, film: Film, decisions: Vec<f32>) -> anyhow::Result<()> {
        let whole = &mut self.state.film;
        let ([x0, _, x1, y1], [px0, py0, px1, py1]) = (whole.crop, film.crop);
        if [x0, x1, y1] != [px0, px1, py0] || whole.options != film.options {
            bail!("rows do not follow on each other");
        }
        let above = whole.width() as usize * whole.height() as usize;
        whole.crop[3] = py1;
        whole.tiles.extend(film.tiles);
        if !film.correction.is_empty() || !whole.correction.is_empty() {
            // A part where nothing had to be set right has no correction.
            whole.correction.resize(above, [0.0; 3]);
            whole.correction.extend(film.correction);
            let all = whole.width() as usize * whole.height() as usize;
            whole.correction.resize(all, [0.0; 3]);
        }
        self.decisions.extend(decisions);
        Ok(())
    }
}

/// Adds a later range of samples.
fn add_samples(whole: &mut Film, film: Film) -> anyhow::Result<()> {
    if whole.crop != film.crop || whole.options != film.options || whole.tiles.len() != film.tiles.len() {
        bail!("pictures of different pixels");
    }
    for (tile, later) in whole.tiles.iter_mut().zip(film.tiles) {
        for (pixel, later) in tile.pixels.iter_mut().zip(&later.pixels) {
            pixel.append(later);
        }
        for (sums, later) in tile.auxiliary.iter_mut().zip(&later.auxiliary) {
            sums.albedo += later.albedo;
            sums.normal += later.normal;
            sums.depth += later.depth;
            sums.hits += later.hits;
        }
        for (set, later) in tile.shapes.iter_mut().zip(&later.shapes) {
            later.ids().for_each(|id| set.insert(id));
        }
        for (sum, later) in tile.luminance_squares.iter_mut().zip(&later.luminance_squares) {
            *sum += later;
        }
        tile.invalid += later.invalid;
        tile.name_invalid(&later.named_invalid);
    }
    Ok(())
}
