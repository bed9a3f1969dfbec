//! `--shard I/N`: a part of a picture, to be merged with the others.

use super::RenderArguments;
use super::choice::Choice;
use crate::commands::Usage;
use crate::session::checkpoint::Part;
use clap::ValueEnum;
use sparing_adaptive::ledger::Ledger;
use sparing_adaptive::state::State;
use sparing_image::film::{Film, FilmOptions, Pixel, TILE};

/// How a picture is split.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum ShardBy {
    /// Bands of rows. Merged, they are the picture bit for bit.
    #[default]
    Rows,
    /// Ranges of samples, with the policy uniform. Merged, radiance and counts are those of the picture bit for bit, the other
    /// layers but for rounding.
    Samples,
}

/// What pixels see of their neighbours beyond one pixel a doubling: plan, errors and spreading.
const REACH: u32 = 12;

/// Samples of a packet: ranges that begin in the middle of one would trace it otherwise.
const PACKET: u32 = 16;

/// The part that is rendered.
#[derive(Clone, Debug)]
pub(super) struct Shard {
    pub(super) part: Part,
    /// The picture that all shards make.
    pub(super) whole: [u32; 4],
    /// What this one keeps of it.
    pub(super) own: [u32; 4],
    /// What it renders: with the neighbours that decisions depend on.
    pub(super) rendered: [u32; 4],
}

impl Shard {
    /// From the arguments and the crop.
    pub(super) fn new(a: &RenderArguments, choice: &Choice, whole: [u32; 4]) -> anyhow::Result<Self> {
        let Some([index, count]) = a.shard else {
            return Ok(Self { part: Part::Whole, whole, own: whole, rendered: whole });
        };
        if a.heat_map.is_some() {
            return Err(Usage::error("--heat-map is for whole pictures, not for --shard"));
        }
        if a.time_limit.is_some() {
            return Err(Usage::error("--shard: a time limit would leave parts that do not fit each other"));
        }
        let adaptive = choice.is_adaptive();
        if adaptive && !choice.is_local() {
            return Err(Usage::error(
                "--shard: an adaptive policy must not depend on the other shards; give --threshold (the statistics of a render have \
                 it) and --judge-exposure",
            ));
        }
        match a.shard_by {
            ShardBy::Rows => Self::rows(whole, index, count, adaptive.then_some(choice)),
            ShardBy::Samples if adaptive => Err(Usage::error("--shard-by samples is for the policy uniform")),
            ShardBy::Samples => {
                let [from, to] = range(choice.bounds.max_spp, index, count)?;
                let part = Part::Samples { index, count, from, to };
                Ok(Self { part, whole, own: whole, rendered: whole })
            }
        }
    }

    fn rows(whole: [u32; 4], index: u32, count: u32, adaptive: Option<&Choice>) -> anyhow::Result<Self> {
        let [x0, y0, x1, y1] = whole;
        let (first, end) = (y0 / TILE, y1.div_ceil(TILE));
        let rows = end - first;
        if count > rows {
            return Err(Usage::error(format!("--shard: {rows} rows of tiles cannot be split in {count}")));
        }
        let border = |k: u32| first + (u64::from(rows) * u64::from(k) / u64::from(count)) as u32;
        let own = [x0, (border(index - 1) * TILE).max(y0), x1, (border(index) * TILE).min(y1)];
        let halo = adaptive.map_or(0, |choice| {
            let bounds = choice.bounds;
            let doublings = (bounds.max_spp / bounds.min_spp.max(1)).max(1).ilog2() + 1;
            doublings + REACH
        });
        let rendered = [x0, own[1].saturating_sub(halo).max(y0), x1, own[3].saturating_add(halo).min(y1)];
        Ok(Self { part: Part::Rows { index, count }, whole, own, rendered })
    }

    /// A film to begin with.
    pub(super) fn film(&self, size: [u32; 2], options: FilmOptions) -> Film {
        let mut film = Film::new(size, self.rendered, options);
        if let Part::Samples { from, .. } = self.part {
            for tile in &mut film.tiles {
                for i in tile.indices() {
                    tile.pixels[i] = Pixel::starting_at(from);
                }
            }
        }
        film
    }

    /// Samples that pixels are brought to at most.
    pub(super) fn most(&self, max_spp: u32) -> u32 {
        if let Part::Samples { to, .. } = self.part { to } else { max_spp }
    }

    /// Whether [`Shard::cut`] drops anything.
    pub(super) fn cuts(&self) -> bool {
        self.own != self.rendered
    }

    /// Drops what is not this shard's. The state's film and the decision values stay as long as the part's rows.
    pub(super) fn cut(&self, state: &mut State, decisions: &mut Vec<f32>) {
        if !self.cuts() {
            return;
        }
        let width = state.film.width() as usize;
        let skip = (self.own[1] - self.rendered[1]) as usize * width;
        let keep = (self.own[3] - self.own[1]) as usize * width;
        let film = &mut state.film;
        // Own rows begin and end at tiles, so tiles are kept whole.
        film.tiles.retain(|t| (self.own[1]..self.own[3]).contains(&t.y0));
        film.crop = self.own;
        film.correction = film.correction.iter().skip(skip).take(keep).copied().collect();
        *decisions = decisions.iter().skip(skip).take(keep).copied().collect();
        state.targets.clear();
        state.ledger = Ledger::from_parts(None, state.ledger.lambdas().to_vec(), Vec::new());
    }
}

/// The samples of a range: whole eighths, as the film keeps them, so that sums are those of one render.
fn range(spp: u32, index: u32, count: u32) -> anyhow::Result<[u32; 2]> {
    let block = spp.div_ceil(8).next_power_of_two();
    let border = |k: u32| (8 * k / count * block).min(spp);
    let borders: Vec<u32> = (0..=count.min(9)).map(border).collect();
    let inner = &borders[1..borders.len() - 1];
    let whole = inner.iter().all(|b| b % PACKET == 0) && borders.windows(2).all(|b| b[0] < b[1]);
    if count > 8 || !whole {
        return Err(Usage::error(format!(
            "--shard-by samples: {spp} samples cannot be split in {count}; there can be 8 shards at most, of a multiple of {PACKET} \
             samples each"
        )));
    }
    Ok([border(index - 1), border(index)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_cover_all_samples_once() {
        for (spp, count) in [(128, 8), (128, 3), (256, 5), (512, 8), (1000, 7), (64, 4), (100, 1)] {
            let mut next = 0;
            for index in 1..=count {
                let [from, to] = range(spp, index, count).expect("it can be split");
                assert_eq!(from, next, "{spp} {count}");
                next = to;
            }
            assert_eq!(next, spp);
        }
        for (spp, count) in [(64, 8), (1000, 9), (8, 2), (16, 3), (130, 8)] {
            assert!(range(spp, 1, count).is_err(), "{spp} {count}");
        }
    }

    #[test]
    fn rows_cover_the_crop_once() {
        for whole in [[0, 0, 40, 30_u32], [3, 5, 20, 77], [0, 9, 8, 16]] {
            for count in 1..=whole[3].div_ceil(TILE) - whole[1] / TILE {
                let mut next = whole[1];
                for index in 1..=count {
                    let shard = Shard::rows(whole, index, count, None).expect("it can be split");
                    assert_eq!((shard.own[0], shard.own[1], shard.own[2]), (whole[0], next, whole[2]));
                    next = shard.own[3];
                }
                assert_eq!(next, whole[3]);
            }
        }
        assert!(Shard::rows([0, 0, 40, 30], 1, 5, None).is_err());
    }
}
