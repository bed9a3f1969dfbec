//! The film: per-pixel sums of samples in eight consecutive blocks.
//!
//! Sample `i` of a pixel belongs to block `i / b`; when a ninth block would begin, neighbours are merged
//! pairwise and `b` doubles. All sums are f64 in an order fixed by the sample indices, so that the picture
//! does not depend on threads, tiles or on where a render was split, as long as it was split at multiples of
//! the block size. The spread of the block means is an honest estimate of the error under low-discrepancy
//! sampling, where the plain sample variance is far too large.

use crate::color::rgb_to_xyz;
use glam::{DVec3, Vec3};

/// Blocks a pixel keeps.
pub const BLOCKS: usize = 8;
/// Side of the square tiles that the film is stored in, pixels.
pub const TILE: u32 = 8;
const TILE_PIXELS: usize = (TILE * TILE) as usize;

/// Sums of one pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pixel {
    blocks: [DVec3; BLOCKS],
    squares: DVec3,
    count: u32,
    block_size: u32,
}

impl Pixel {
    /// Adds the next sample.
    #[inline]
    pub fn add(&mut self, sample: Vec3) {
        let s = sample.as_dvec3();
        self.squares += s * s;
        let mut block = (self.count / self.block_size.max(1)) as usize;
        if self.block_size == 0 {
            self.block_size = 1;
        } else if block == BLOCKS {
            for i in 0..BLOCKS / 2 {
                self.blocks[i] = self.blocks[2 * i] + self.blocks[2 * i + 1];
            }
            self.blocks[BLOCKS / 2..].fill(DVec3::ZERO);
            self.block_size *= 2;
            block = BLOCKS / 2;
        }
        self.blocks[block] += s;
        self.count += 1;
    }

    /// Samples added.
    #[inline]
    #[must_use]
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Sum of all samples: the blocks added pairwise.
    #[must_use]
    pub fn sum(&self) -> DVec3 {
        let b = &self.blocks;
        ((b[0] + b[1]) + (b[2] + b[3])) + ((b[4] + b[5]) + (b[6] + b[7]))
    }

    /// Mean of all samples; 0 without any.
    #[must_use]
    pub fn mean(&self) -> DVec3 {
        if self.count == 0 { DVec3::ZERO } else { self.sum() / f64::from(self.count) }
    }

    /// Unbiased variance of the mean per channel as if the samples were independent (an over-estimate for
    /// low-discrepancy samplers); 0 with fewer than two samples, never negative.
    #[must_use]
    pub fn variance_of_mean(&self) -> DVec3 {
        if self.count < 2 {
            return DVec3::ZERO;
        }
        let n = f64::from(self.count);
        let mean = self.mean();
        // Cancellation can leave at most a few ulp of squares/n below zero: clamped.
        ((self.squares / n - mean * mean) / (n - 1.0)).max(DVec3::ZERO)
    }

    /// Sums and sizes of the blocks that hold samples, in order.
    pub fn blocks(&self) -> impl Iterator<Item = (DVec3, u32)> + '_ {
        let size = self.block_size.max(1);
        (0..BLOCKS as u32).map_while(move |i| {
            let n = self.count.saturating_sub(i * size).min(size);
            (n > 0).then(|| (self.blocks[i as usize], n))
        })
    }

    /// Sum of squared samples.
    #[must_use]
    pub fn squares(&self) -> DVec3 {
        self.squares
    }

    /// All block sums, those without samples 0.
    #[must_use]
    pub fn block_sums(&self) -> &[DVec3; BLOCKS] {
        &self.blocks
    }

    /// A pixel as it was: what [`Pixel::block_sums`], [`Pixel::squares`] and [`Pixel::count`] gave.
    #[must_use]
    pub fn from_sums(blocks: [DVec3; BLOCKS], squares: DVec3, count: u32) -> Self {
        let block_size = if count == 0 { 0 } else { count.div_ceil(BLOCKS as u32).next_power_of_two() };
        Self { blocks, squares, count, block_size }
    }

    /// A pixel that samples `first..` are added to: as if the samples before had been black. Its blocks are those of a pixel with
    /// all samples, so that pixels of disjoint ranges add up.
    #[must_use]
    pub fn starting_at(first: u32) -> Self {
        Self::from_sums([DVec3::ZERO; BLOCKS], DVec3::ZERO, first)
    }

    /// Adds the samples of a pixel that was made with [`Pixel::starting_at`] this one's count. Blocks of the result are bit for bit
    /// those of adding the samples here one by one, if ranges begin and end at multiples of the final block size; squares
    /// are added in another order.
    pub fn append(&mut self, later: &Self) {
        while self.block_size < later.block_size {
            for i in 0..BLOCKS / 2 {
                self.blocks[i] = self.blocks[2 * i] + self.blocks[2 * i + 1];
            }
            self.blocks[BLOCKS / 2..].fill(DVec3::ZERO);
            self.block_size = if self.block_size == 0 { later.block_size } else { 2 * self.block_size };
        }
        self.blocks.iter_mut().zip(&later.blocks).for_each(|(a, b)| *a += *b);
        self.squares += later.squares;
        self.count = self.count.max(later.count);
    }
}

/// Sums of the first hit of the camera rays, for the auxiliary layers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AuxiliarySums {
    /// Reflectance.
    pub albedo: Vec3,
    /// World-space shading normal.
    pub normal: Vec3,
    /// Distance along the camera's axis.
    pub depth: f32,
    /// Camera rays that hit something.
    pub hits: u32,
}

/// Distinct shapes that a pixel's camera rays met; up to four without an allocation.
#[derive(Clone, Debug, Default)]
pub struct ShapeSet {
    first: [u32; 4],
    len: u32,
    more: Vec<u32>,
}

impl ShapeSet {
    /// Adds a shape id.
    #[inline]
    pub fn insert(&mut self, id: u32) {
        let n = (self.len as usize).min(4);
        if self.first[..n].contains(&id) || (self.len > 4 && self.more.contains(&id)) {
            return;
        }
        if n < 4 {
            self.first[n] = id;
        } else {
            self.more.push(id);
        }
        self.len += 1;
    }

    /// How many.
    #[must_use]
    pub fn len(&self) -> u32 {
        self.len
    }

    /// The ids, in the order in which they were met.
    pub fn ids(&self) -> impl Iterator<Item = u32> + '_ {
        self.first.iter().take(self.len.min(4) as usize).chain(&self.more).copied()
    }

    /// Whether no camera ray was traced.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

/// One tile: pixels in rows, those outside the crop unused.
#[derive(Clone, Debug)]
pub struct Tile {
    /// Position of the first pixel in the full picture.
    pub x0: u32,
    /// Position of the first pixel in the full picture.
    pub y0: u32,
    /// Columns in use, 1..=[`TILE`].
    pub width: u32,
    /// Rows in use, 1..=[`TILE`].
    pub height: u32,
    /// `TILE * TILE` pixels.
    pub pixels: Vec<Pixel>,
    /// Empty unless asked for.
    pub auxiliary: Vec<AuxiliarySums>,
    /// Empty unless asked for.
    pub shapes: Vec<ShapeSet>,
    /// Sums of the squared Y of XYZ, which the squares of the channels do not give. Empty unless asked for.
    pub luminance_squares: Vec<f64>,
    /// Samples that were not finite or negative, and were left out.
    pub invalid: u32,
    /// The first of them by sample and position, at most [`NAMED`]: whatever the order they came in.
    pub named_invalid: Vec<InvalidSample>,
}

/// Sample index, y and x of a sample that was left out.
pub type InvalidSample = [u32; 3];

/// Invalid samples of a tile that are named.
pub const NAMED: usize = 16;

impl Tile {
    /// Index into `pixels` of picture position (`x`, `y`).
    #[inline]
    #[must_use]
    pub fn index(&self, x: u32, y: u32) -> usize {
        ((y - self.y0) * TILE + (x - self.x0)) as usize
    }

    /// Picture position (x, y) of an index into `pixels`.
    #[inline]
    #[must_use]
    pub fn position(&self, index: usize) -> (u32, u32) {
        (self.x0 + index as u32 % TILE, self.y0 + index as u32 / TILE)
    }

    /// Indices into `pixels` of those that are in use, in rows.
    pub fn indices(&self) -> impl Iterator<Item = usize> + use<> {
        let width = self.width;
        (0..self.height).flat_map(move |y| (0..width).map(move |x| (y * TILE + x) as usize))
    }

    /// Takes the pixels out as tiles of one row each, for [`Tile::join_rows`].
    #[must_use]
    pub fn split_rows(&mut self) -> Vec<Self> {
        let (mut pixels, mut auxiliary, mut shapes) = (
            std::mem::take(&mut self.pixels).into_iter(),
            std::mem::take(&mut self.auxiliary).into_iter(),
            std::mem::take(&mut self.shapes).into_iter(),
        );
        let mut squares = std::mem::take(&mut self.luminance_squares).into_iter();
        (0..self.height)
            .map(|y| Self {
                x0: self.x0,
                y0: self.y0 + y,
                width: self.width,
                height: 1,
                pixels: pixels.by_ref().take(TILE as usize).collect(),
                auxiliary: auxiliary.by_ref().take(TILE as usize).collect(),
                shapes: shapes.by_ref().take(TILE as usize).collect(),
                luminance_squares: squares.by_ref().take(TILE as usize).collect(),
                invalid: 0,
                named_invalid: Vec::new(),
            })
            .collect()
    }

    /// Puts the rows of [`Tile::split_rows`] back.
    pub fn join_rows(&mut self, rows: Vec<Self>) {
        for row in rows {
            self.pixels.extend(row.pixels);
            self.auxiliary.extend(row.auxiliary);
            self.shapes.extend(row.shapes);
            self.luminance_squares.extend(row.luminance_squares);
            self.invalid += row.invalid;
            self.name_invalid(&row.named_invalid);
        }
        // What lies below the crop was dropped: nothing ever was in it.
        self.pixels.resize_with(TILE_PIXELS, Pixel::default);
        if !self.auxiliary.is_empty() {
            self.auxiliary.resize_with(TILE_PIXELS, AuxiliarySums::default);
        }
        if !self.shapes.is_empty() {
            self.shapes.resize_with(TILE_PIXELS, ShapeSet::default);
        }
        if !self.luminance_squares.is_empty() {
            self.luminance_squares.resize(TILE_PIXELS, 0.0);
        }
    }

    /// Adds a sample if it is finite and not negative, else counts it. `weight` is the filter's.
    #[inline]
    pub fn add_sample(&mut self, index: usize, sample_index: u32, radiance: Vec3, weight: f32) {
        // The product: a weight above 1 makes the largest numbers infinite.
        let sample = radiance * weight;
        if sample.is_finite() && radiance.min_element() >= 0.0 {
            self.pixels[index].add(sample);
            if let Some(sum) = self.luminance_squares.get_mut(index) {
                *sum += rgb_to_xyz(sample.as_dvec3().to_array())[1].powi(2);
            }
        } else {
            self.add_invalid(index, sample_index);
        }
    }

    #[cold]
    fn add_invalid(&mut self, index: usize, sample_index: u32) {
        self.invalid += 1;
        let (x, y) = self.position(index);
        self.name_invalid(&[[sample_index, y, x]]);
        // A black sample keeps the count, and with it the block structure, as scheduled.
        self.pixels[index].add(Vec3::ZERO);
    }

    /// Names further invalid samples.
    pub fn name_invalid(&mut self, samples: &[InvalidSample]) {
        if samples.is_empty() {
            return;
        }
        self.named_invalid.extend(samples);
        self.named_invalid.sort_unstable();
        self.named_invalid.truncate(NAMED);
    }
}

/// What a film keeps besides the sums of radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FilmOptions {
    /// Albedo, normal, depth.
    pub auxiliary: bool,
    /// Shape sets.
    pub shapes: bool,
    /// Sums of squared luminance, the Y of XYZ.
    pub luminance: bool,
}

/// The film of a picture or of its crop.
#[derive(Clone, Debug)]
pub struct Film {
    /// Size of the full picture.
    pub full_size: [u32; 2],
    /// Pixel bounds x0, y0, x1, y1 (end exclusive) of what is kept.
    pub crop: [u32; 4],
    /// What is kept.
    pub options: FilmOptions,
    /// Tiles in rows.
    pub tiles: Vec<Tile>,
    /// What [`Film::beauty`] adds to the mean of each pixel of the crop, in rows, linear Rec.709; empty for nothing. An adaptive
    /// sampler puts back here what its choice of pixels takes away.
    pub correction: Vec<[f32; 3]>,
}

impl Film {
    /// An empty film. `crop` must lie inside the picture and not be empty.
    ///
    /// # Panics
    /// If it does not.
    #[must_use]
    pub fn new(full_size: [u32; 2], crop: [u32; 4], options: FilmOptions) -> Self {
        let [x0, y0, x1, y1] = crop;
        assert!(x0 < x1 && y0 < y1 && x1 <= full_size[0] && y1 <= full_size[1], "crop {crop:?}");
        // Tiles start at multiples of TILE of the full picture, whatever the crop.
        let mut tiles = Vec::new();
        for ty in y0 / TILE..y1.div_ceil(TILE) {
            for tx in x0 / TILE..x1.div_ceil(TILE) {
                let (left, top) = ((tx * TILE).max(x0), (ty * TILE).max(y0));
                tiles.push(Tile {
                    x0: left,
                    y0: top,
                    width: ((tx + 1) * TILE).min(x1) - left,
                    height: ((ty + 1) * TILE).min(y1) - top,
                    pixels: vec![Pixel::default(); TILE_PIXELS],
                    auxiliary: vec![
                        AuxiliarySums::default();
                        if options.auxiliary { TILE_PIXELS } else { 0 }
                    ],
                    shapes: vec![ShapeSet::default(); if options.shapes { TILE_PIXELS } else { 0 }],
                    luminance_squares: vec![0.0; if options.luminance { TILE_PIXELS } else { 0 }],
                    invalid: 0,
                    named_invalid: Vec::new(),
                });
            }
        }
        Self { full_size, crop, options, tiles, correction: Vec::new() }
    }

    /// Width of the crop.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.crop[2] - self.crop[0]
    }

    /// Height of the crop.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.crop[3] - self.crop[1]
    }

    /// Total of samples taken.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.tiles.iter().flat_map(|t| &t.pixels).map(|p| u64::from(p.count())).sum()
    }

    /// Bytes that the film takes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let tile = |t: &Tile| {
            t.pixels.capacity() * size_of::<Pixel>()
                + t.auxiliary.capacity() * size_of::<AuxiliarySums>()
                + t.shapes.iter().map(|s| size_of::<ShapeSet>() + 4 * s.more.capacity()).sum::<usize>()
                + t.luminance_squares.capacity() * size_of::<f64>()
        };
        self.tiles.iter().map(|t| tile(t) as u64).sum()
    }

    /// Samples left out as invalid.
    #[must_use]
    pub fn invalid_samples(&self) -> u64 {
        self.tiles.iter().map(|t| u64::from(t.invalid)).sum()
    }

    /// The invalid samples that are known by name, in tile order: pixel and sample index.
    pub fn named_invalid(&self) -> impl Iterator<Item = ([u32; 2], u32)> {
        self.tiles.iter().flat_map(|t| &t.named_invalid).map(|[n, y, x]| ([*x, *y], *n))
    }

    /// One value a pixel of the crop, in rows; the function gets the tile and the index within it.
    pub fn map<T: Clone + Default>(&self, f: impl Fn(&Tile, usize) -> T) -> Vec<T> {
        let mut out = vec![T::default(); self.width() as usize * self.height() as usize];
        for tile in &self.tiles {
            for y in tile.y0..tile.y0 + tile.height {
                for x in tile.x0..tile.x0 + tile.width {
                    let at =
                        (y - self.crop[1]) as usize * self.width() as usize + (x - self.crop[0]) as usize;
                    out[at] = f(tile, tile.index(x, y));
                }
            }
        }
        out
    }

    /// The picture: mean radiance with the correction, in rows, linear Rec.709, finite and not negative.
    #[must_use]
    pub fn beauty(&self) -> Vec<[f32; 3]> {
        let mut means = self.map(|t, i| t.pixels[i].mean().as_vec3().to_array());
        for (mean, correction) in means.iter_mut().zip(&self.correction) {
            *mean = std::array::from_fn(|c| (mean[c] + correction[c]).clamp(0.0, f32::MAX));
        }
        means
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_merge_and_keep_the_exact_sum() {
        let mut p = Pixel::default();
        for i in 0..1000u32 {
            p.add(Vec3::new(i as f32, 1.0, 0.5));
            let n = i + 1;
            assert_eq!(p.count(), n);
            assert_eq!(p.sum(), DVec3::new(f64::from(n * i) / 2.0, f64::from(n), f64::from(n) / 2.0));
            assert_eq!(p.blocks().map(|b| b.1).sum::<u32>(), n);
            let sizes: Vec<_> = p.blocks().map(|b| b.1).collect();
            assert!(n < 8 || sizes.len() > 4);
            assert!(sizes[..sizes.len() - 1].iter().all(|s| *s == sizes[0]));
        }
    }

    #[test]
    fn variance_of_a_constant_is_zero_even_at_a_huge_offset() {
        for value in [0.0, 1e-30, 0.1, 1e8, 1e18] {
            let mut p = Pixel::default();
            for _ in 0..4096 {
                p.add(Vec3::splat(value));
            }
            let v = p.variance_of_mean();
            assert!(v.min_element() >= 0.0);
            assert!(v.max_element() <= f64::from(value) * f64::from(value) * 1e-15, "{value}: {v}");
        }
    }

    #[test]
    fn variance_matches_the_textbook() {
        let values = [1.0f32, 4.0, 2.0, 8.0, 5.0];
        let mut p = Pixel::default();
        values.iter().for_each(|v| p.add(Vec3::splat(*v)));
        let mean = 4.0;
        let s2: f64 = values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / 4.0;
        assert!((p.variance_of_mean().x - s2 / 5.0).abs() < 1e-12);
    }

    #[test]
    fn crops_cover_exactly_their_pixels() {
        let film = Film::new([37, 21], [5, 3, 30, 20], FilmOptions::default());
        let positions = film.map(|t, i| [t.x0 + i as u32 % TILE, t.y0 + i as u32 / TILE]);
        for (k, p) in positions.iter().enumerate() {
            assert_eq!(*p, [5 + k as u32 % 25, 3 + k as u32 / 25]);
        }
    }

    #[test]
    fn rows_of_a_tile_come_back_as_they_were() {
        let options = FilmOptions { auxiliary: true, shapes: true, luminance: true };
        let mut film = Film::new([30, 30], [3, 5, 22, 13], options);
        for tile in &mut film.tiles {
            let (x0, y0, height) = (tile.x0, tile.y0, tile.height);
            for i in tile.indices() {
                tile.add_sample(i, 0, Vec3::splat(i as f32), 1.0);
                tile.shapes[i].insert(i as u32);
            }
            let before = tile.clone();
            let mut rows = tile.split_rows();
            assert_eq!(rows.len(), height as usize);
            for (y, row) in rows.iter_mut().enumerate() {
                assert_eq!(row.position(0), (x0, y0 + y as u32));
                row.add_sample(0, 1, Vec3::splat(f32::NAN), 1.0);
            }
            tile.join_rows(rows);
            let named: Vec<InvalidSample> = (y0..y0 + height).map(|y| [1, y, x0]).collect();
            assert_eq!((tile.invalid, &tile.named_invalid), (height, &named));
            assert_eq!(tile.pixels.len(), before.pixels.len());
            assert_eq!((tile.auxiliary.len(), tile.shapes.len()), (TILE_PIXELS, TILE_PIXELS));
            for i in tile.indices() {
                assert_eq!(tile.pixels[i].sum(), before.pixels[i].sum());
                assert_eq!(tile.shapes[i].len(), 1);
            }
        }
    }

    #[test]
    fn invalid_samples_are_counted_and_named() {
        let mut film = Film::new([8, 8], [0, 0, 8, 8], FilmOptions::default());
        let t = &mut film.tiles[0];
        t.add_sample(10, 3, Vec3::new(f32::NAN, 0.0, 0.0), 1.0);
        t.add_sample(10, 4, Vec3::new(0.0, -1.0, 0.0), 1.0);
        t.add_sample(10, 5, Vec3::new(0.0, f32::INFINITY, 0.0), 1.0);
        t.add_sample(10, 6, Vec3::ONE, 1.0);
        assert_eq!(film.invalid_samples(), 3);
        let named: Vec<_> = film.named_invalid().collect();
        assert_eq!(named, [([2, 1], 3), ([2, 1], 4), ([2, 1], 5)]);
        film.tiles[0].add_sample(12, 0, Vec3::splat(f32::MAX), 1.5);
        assert_eq!((film.invalid_samples(), film.beauty()[12]), (4, [0.0; 3]));
        assert_eq!(film.beauty()[10], [0.25; 3]);
        // More than are named: the first ones, in whatever order they come.
        let t = &mut film.tiles[0];
        for n in (0..40).rev() {
            t.add_sample(11, n, Vec3::NAN, 1.0);
        }
        assert_eq!((t.invalid, t.named_invalid.len()), (44, NAMED));
        assert_eq!(film.named_invalid().next(), Some(([3, 1], 0)));
        assert_eq!(film.named_invalid().last(), Some(([3, 1], 11)));
    }

    #[test]
    fn shape_sets_count_distinct_ids() {
        let mut s = ShapeSet::default();
        for id in [3, 3, 9, 1, 3, 77, 5, 5, 6, 77] {
            s.insert(id);
        }
        assert_eq!(s.len(), 6);
    }
}
