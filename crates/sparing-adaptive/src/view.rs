//! What is known of every pixel at a barrier.
//!
//! Radiance is multiplied by an exposure first ([`auto_exposure`](View::auto_exposure) of the first layer unless given), so
//! that 0.9 is bright, and thresholds mean the same in every scene. The error of a pixel is estimated from the spread of its
//! block means ([`Pixel::blocks`](sparing_image::film::Pixel::blocks)), which is honest under low-discrepancy sampling, where
//! the variance of single samples is far too large: measured, the estimate exceeds the true error by a nearly constant
//! factor, [`BLOCK_EXCESS`].

use crate::pooling::Plane;
pub use crate::statistics::Statistics;
use crate::statistics::update_tile;
use rayon::prelude::*;
use sparing_image::color;
use sparing_image::film::{Film, TILE, Tile};

/// By how much the spread of block means over-estimates the error under Owen-scrambled Sobol points, for 8 blocks.
pub const BLOCK_EXCESS: f64 = 1.35;

/// What the mean CIEDE2000 error usually is over the mean of the pixels' perceived errors at 64 samples: less because errors are
/// over-estimated and because the mean magnitude of a normal error is 0.8 of its deviation, more because noise of colour is not
/// seen in the perceived error. Between 0.6 and 1.4 in our training scenes, and rising with the samples; so renders with a
/// tolerance have an audit.
pub const ERROR_SCALE: f64 = 0.95;

/// Luminance below which a relative error counts as if it were this bright, in exposed units.
pub const DARK: f64 = 0.1;

/// Statistics of all pixels of a film, in rows.
#[derive(Clone, Debug)]
pub struct View {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// What radiance is multiplied by.
    pub exposure: f32,
    /// The mean CIEDE2000 error of the pixels over the mean of their perceived errors: [`ERROR_SCALE`], or what an audit found.
    pub error_scale: f64,
    /// `width * height`
    pub pixels: Vec<Statistics>,
}

impl View {
    /// Looks at a film.
    #[must_use]
    pub fn new(film: &Film, exposure: f32) -> Self {
        let (width, height) = (film.width() as usize, film.height() as usize);
        // By all threads: most of it is the time that fresh memory takes.
        let pixels = (0..width * height).into_par_iter().map(|_| Statistics::EMPTY).collect();
        let mut view = Self { width, height, exposure, error_scale: ERROR_SCALE, pixels };
        view.update(film);
        view
    }

    /// Looks at the same film again, to which samples were added since: only pixels whose count has changed are computed
    /// anew, and the result is that of [`View::new`], bit for bit.
    ///
    /// # Panics
    /// When the film has another size.
    pub fn update(&mut self, film: &Film) {
        let size = [film.width() as usize, film.height() as usize];
        assert_eq!([self.width, self.height], size, "the film that the view was made of");
        let (exposure, x0) = (self.exposure, film.crop[0]);
        let mut rest = &mut self.pixels[..];
        let rows: Vec<(&[Tile], &mut [Statistics])> = film
            .tiles
            .chunk_by(|a, b| a.y0 == b.y0)
            .map(|tiles| {
                let (row, below) = std::mem::take(&mut rest).split_at_mut(tiles[0].height as usize * size[0]);
                rest = below;
                (tiles, row)
            })
            .collect();
        rows.into_par_iter().with_max_len(1).for_each(|(tiles, row)| {
            for tile in tiles {
                update_tile(tile, exposure, &mut row[(tile.x0 - x0) as usize..], size[0]);
            }
        });
    }

    /// The exposure that a film suggests: [`color::auto_exposure`] of its pixels; of large films, of some in each tile.
    #[must_use]
    pub fn auto_exposure(film: &Film) -> f32 {
        // About 65,536 pixels, but at least one a tile: tiles left out could be whole columns of the picture.
        let step = (film.tiles.len() / 1024).clamp(1, (TILE * TILE) as usize);
        let means = |tile: &Tile| {
            let mean = |y: u32, x: u32| tile.pixels[tile.index(tile.x0 + x, tile.y0 + y)].mean();
            let position = (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| (y, x)));
            position.step_by(step).map(|(y, x)| mean(y, x).as_vec3().to_array()).collect::<Vec<_>>()
        };
        let parts: Vec<Vec<[f32; 3]>> = film.tiles.par_iter().map(means).collect();
        color::auto_exposure(&parts.concat())
    }

    /// Samples of a pixel and those beside it, up to eight.
    ///
    /// # Panics
    /// When the pixel is outside.
    #[must_use]
    pub fn samples_around(&self, pixel: usize) -> u32 {
        let (x, y) = (pixel % self.width, pixel / self.width);
        let rows = y.saturating_sub(1)..(y + 2).min(self.height);
        let columns = x.saturating_sub(1)..(x + 2).min(self.width);
        let row = |y: usize| &self.pixels[y * self.width..][columns.clone()];
        rows.flat_map(row).fold(0, |sum, p| sum.saturating_add(p.count))
    }

    /// One number a pixel.
    pub fn plane(&self, f: impl Fn(&Statistics) -> f32 + Sync + Send) -> Plane {
        Plane { width: self.width, height: self.height, values: self.pixels.par_iter().map(f).collect() }
    }
}
