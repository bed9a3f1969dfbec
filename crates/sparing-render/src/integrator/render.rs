//! Filling a film: waves of samples over tiles, in parallel.

use super::RenderSettings;
use super::packet::{PACKET, Packet, TracePacket, TraceStatistics, select};
use crate::needs::Needs;
use crate::scene::Scene;
use rayon::prelude::*;
use sparing_image::film::{Film, FilmOptions, Tile};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// A scene with settings, ready to sample pixels.
pub struct Renderer<'a> {
    scene: &'a Scene,
    settings: RenderSettings,
    pub(super) trace: TracePacket,
}

/// Samples above which a tile is split into rows: a few milliseconds, a thousand times what the split costs.
const LARGEST_TASK: u64 = 4096;

fn add(mut a: TraceStatistics, b: TraceStatistics) -> TraceStatistics {
    a += b;
    a
}

/// One pass over the film, seen and stopped from outside.
#[derive(Debug, Default)]
pub struct Wave {
    /// Set from outside to end the wave at the next pixel.
    pub stop: AtomicBool,
    /// Samples taken so far, for progress.
    pub samples: AtomicU64,
}

impl<'a> Renderer<'a> {
    /// Prepares the tracer for a scene and what the film keeps.
    #[must_use]
    pub fn new(scene: &'a Scene, settings: RenderSettings, film: FilmOptions) -> Self {
        let mut needs = scene.needs();
        needs.set(Needs::AUXILIARY, film.auxiliary);
        needs.set(Needs::SHAPE_COUNT, film.shapes);
        Self { scene, settings, trace: select(needs) }
    }

    /// A renderer that runs the code for `extra` needs too, whether the scene has them or not: for measuring
    /// what leaving them out saves.
    #[must_use]
    pub fn with_needs(scene: &'a Scene, settings: RenderSettings, extra: Needs) -> Self {
        Self { scene, settings, trace: select(scene.needs() | extra) }
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// Brings every pixel to as many samples as `target` says; those that have them are left alone. Returns the
    /// rays traced.
    ///
    /// Tiles are tasks, and those with much to do are split into their rows, so that all threads are busy to the end even if
    /// the active pixels are few and close together. A pixel is sampled by one thread, in order: the split does not matter.
    pub fn run(
        &self,
        film: &mut Film,
        wave: &Wave,
        target: impl Fn(&Tile, usize) -> u32 + Sync,
    ) -> TraceStatistics {
        let tiles = film.tiles.par_iter_mut().with_max_len(1);
        tiles.map(|tile| self.run_tile(tile, wave, &target)).reduce(TraceStatistics::default, add)
    }

    fn run_tile(
        &self,
        tile: &mut Tile,
        wave: &Wave,
        target: &(impl Fn(&Tile, usize) -> u32 + Sync),
    ) -> TraceStatistics {
        let missing = |i: usize| u64::from(target(tile, i).saturating_sub(tile.pixels[i].count()));
        let samples: u64 = tile.indices().map(missing).sum();
        if samples <= LARGEST_TASK {
            return if samples > 0 {
                self.run_pixels(tile, wave, target)
            } else {
                TraceStatistics::default()
            };
        }
        let mut rows = tile.split_rows();
        let rays = rows
            .par_iter_mut()
            .with_max_len(1)
            .map(|row| self.run_pixels(row, wave, target))
            .reduce(TraceStatistics::default, add);
        tile.join_rows(rows);
        rays
    }

    fn run_pixels(
        &self,
        tile: &mut Tile,
        wave: &Wave,
        target: &impl Fn(&Tile, usize) -> u32,
    ) -> TraceStatistics {
        let mut statistics = TraceStatistics::default();
        let mut samples = 0;
        for index in tile.indices() {
            if wave.stop.load(Ordering::Relaxed) {
                break;
            }
            let (from, to) = (tile.pixels[index].count(), target(tile, index));
            if from < to {
                statistics += self.sample_pixel(tile, index, from, to);
                samples += u64::from(to - from);
            }
        }
        wave.samples.fetch_add(samples, Ordering::Relaxed);
        statistics
    }

    /// Takes samples `from..to` of one pixel. Packets start at multiples of [`PACKET`] (and at 8), so the same
    /// samples travel together whatever the waves.
    pub fn sample_pixel(&self, tile: &mut Tile, index: usize, from: u32, to: u32) -> TraceStatistics {
        let packet = Packet { scene: self.scene, settings: &self.settings, recorder: None, witness: None };
        let mut statistics = TraceStatistics::default();
        self.packets(from, to, |first, n| statistics += (self.trace)(&packet, tile, index, first, n));
        statistics
    }

    /// Splits samples `from..to` into packets.
    pub(super) fn packets(&self, from: u32, to: u32, mut trace: impl FnMut(u32, usize)) {
        let mut first = from;
        while first < to {
            // The first 16 samples go in two halves: 8 is where the first decision falls.
            let border = if first < 8 { 8 } else { (first / PACKET as u32 + 1) * PACKET as u32 };
            let end = border.min(to);
            trace(first, (end - first) as usize);
            first = end;
        }
    }
}
