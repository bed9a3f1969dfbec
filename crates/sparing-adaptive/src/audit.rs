//! A second, independent render of a few pixels, which tells how large the error is.
//!
//! What block means predict is wrong by factors up to two in either direction: it depends on how much faster than independent
//! samples the points converge, on noise of colour, and on light that was not met yet. The difference between two
//! independent renders knows nothing of all this: over sqrt 2, its mean is the mean error (within 5 % where no light is missing).
//! The ratio of the two, over the audited pixels, corrects the prediction for all.

use crate::features::display_lab;
use crate::view::{ERROR_SCALE, View};
use sparing_image::color::ciede2000;
use sparing_image::film::{Film, FilmOptions, Tile};
use sparing_render::integrator::{TraceStatistics, Wave};
use sparing_render::{RenderSettings, Renderer};

/// One pixel in so many is audited; of small pictures more.
const ONE_IN: u64 = 64;
/// At least so many, or one in eight.
const LEAST: u64 = 512;
/// The usual ratio counts as if it had been measured in so many pixels.
const PRIOR: f64 = 32.0;
/// Tells the second render's sample points from the first's.
const SEED: u64 = 0x5eed_a0d1_7000_0001;

/// The second render.
pub(crate) struct Audit<'a> {
    renderer: Renderer<'a>,
    film: Film,
    one_in: u64,
}

/// Whether a pixel is audited: the same for any crop and order.
fn chosen([x, y]: [u32; 2], one_in: u64) -> bool {
    // SplitMix64's finalizer (Steele et al. 2014).
    let mut h = (u64::from(y) << 32 | u64::from(x)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (h ^ (h >> 31)) % one_in == 0
}

impl<'a> Audit<'a> {
    pub(crate) fn new(renderer: &Renderer<'a>, film: &Film) -> Self {
        let pixels = u64::from(film.width()) * u64::from(film.height());
        let settings = RenderSettings { seed: renderer.settings().seed ^ SEED, ..*renderer.settings() };
        let second = Renderer::new(renderer.scene(), settings, FilmOptions::default());
        let mut film = Film::new(film.full_size, film.crop, FilmOptions::default());
        let one_in = (pixels / LEAST).clamp(8, ONE_IN);
        film.tiles.retain(|tile| positions(tile).any(|p| chosen(p, one_in)));
        Self { renderer: second, film, one_in }
    }

    /// Brings the audited pixels to the counts of the first render, as far as it got.
    pub(crate) fn follow(&mut self, film: &Film) -> TraceStatistics {
        let counts = film.map(|t, i| t.pixels[i].count());
        let (width, [x0, y0, ..]) = (film.width(), film.crop);
        let one_in = self.one_in;
        self.renderer.run(&mut self.film, &Wave::default(), |tile, index| {
            let (x, y) = tile.position(index);
            if chosen([x, y], one_in) { counts[((y - y0) * width + (x - x0)) as usize] } else { 0 }
        })
    }

    /// Samples so far.
    pub(crate) fn samples(&self) -> u64 {
        self.film.samples()
    }

    /// The mean measured error of the audited pixels over their mean perceived one: see [`View::error_scale`].
    pub(crate) fn error_scale(&self, view: &View) -> f64 {
        let [x0, y0, ..] = self.film.crop;
        let (mut measured, mut predicted, mut pixels) = (0.0, 0.0, 0.0);
        for tile in &self.film.tiles {
            for p @ [x, y] in positions(tile).filter(|p| chosen(*p, self.one_in)) {
                let first = &view.pixels[(y - y0) as usize * view.width + (x - x0) as usize];
                let second = &tile.pixels[tile.index(p[0], p[1])];
                if second.count() == first.count && first.count > 0 {
                    let scale = f64::from(view.exposure);
                    let second = (second.mean() * scale).to_array();
                    let difference = ciede2000(display_lab(first.mean.map(f64::from)), display_lab(second));
                    measured += difference * std::f64::consts::FRAC_1_SQRT_2;
                    predicted += f64::from(first.perceived_error);
                    pixels += 1.0;
                }
            }
        }
        let prior = PRIOR * predicted / pixels;
        let scale = (measured + ERROR_SCALE * prior) / (predicted + prior);
        if scale.is_finite() { scale } else { ERROR_SCALE }
    }
}

/// Positions of the pixels of a tile.
fn positions(tile: &Tile) -> impl Iterator<Item = [u32; 2]> + '_ {
    (tile.y0..tile.y0 + tile.height).flat_map(|y| (tile.x0..tile.x0 + tile.width).map(move |x| [x, y]))
}
