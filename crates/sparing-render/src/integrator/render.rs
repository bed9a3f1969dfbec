//! Filling a film: waves of samples over tiles, in parallel.

use super::RenderSettings;
use super::packet::{PACKET, Packet, TracePacket, TraceStatistics, select};
use crate::needs::Needs;
use crate::scene::Scene;
use rayon::prelude::*;
use sparing_image::film::{Film, FilmOptions, TILE, Tile};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// A scene with settings, ready to sample pixels.
pub struct Renderer<'a> {
    scene: &'a Scene,
    settings: RenderSettings,
    pub(super) trace: TracePacket,
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
    pub fn run(
        &self,
        film: &mut Film,
        wave: &Wave,
        target: impl Fn(&Tile, usize) -> u32 + Sync,
    ) -> TraceStatistics {
        film.tiles.par_iter_mut().map(|tile| self.run_tile(tile, wave, &target)).reduce(
            TraceStatistics::default,
            |mut a, b| {
                a += b;
                a
            },
        )
    }

    fn run_tile(
        &self,
        tile: &mut Tile,
        wave: &Wave,
        target: &impl Fn(&Tile, usize) -> u32,
    ) -> TraceStatistics {
        let mut statistics = TraceStatistics::default();
        let mut samples = 0;
        for y in 0..tile.height {
            for x in 0..tile.width {
                let index = (y * TILE + x) as usize;
                if wave.stop.load(Ordering::Relaxed) {
                    wave.samples.fetch_add(samples, Ordering::Relaxed);
                    return statistics;
                }
                let (from, to) = (tile.pixels[index].count(), target(tile, index));
                if from < to {
                    statistics += self.sample_pixel(tile, index, from, to);
                    samples += u64::from(to - from);
                }
            }
        }
        wave.samples.fetch_add(samples, Ordering::Relaxed);
        statistics
    }

    /// Takes samples `from..to` of one pixel. Packets start at multiples of [`PACKET`] (and at 8), so the same
    /// samples travel together whatever the waves.
    pub fn sample_pixel(&self, tile: &mut Tile, index: usize, from: u32, to: u32) -> TraceStatistics {
        let packet = Packet { scene: self.scene, settings: &self.settings, recorder: None };
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
