//! Light from infinity: constant, or a picture sampled in proportion to its brightness.
//!
//! A picture twice as wide as high is a latitude-longitude map, its upper edge towards +z of light space; a
//! square one is an equal-area octahedral map (P. Clarberg 2008, as in pbrt-v4). Texels are weighted with the
//! mean of their neighbourhood, so that bilinear look-ups never find light where sampling does not go.

use super::{LightSample, luminance};
use crate::sampling::uniform_sphere;
use crate::texture::Image;
use glam::{Mat3, Vec3};
use sparing_scene::description::{SphereMapping, Wrap};
use std::f32::consts::{FRAC_1_PI, PI};

/// How directions map to the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mapping {
    /// Latitude and longitude.
    LatLong,
    /// Equal-area octahedral.
    EqualArea,
}

/// A picture of the surroundings.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    image: Image,
    mapping: Mapping,
    distribution: Distribution,
    mean_luminance: f32,
}

/// An environment light.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Radiance, or a factor on the map.
    pub radiance: Vec3,
    /// Picture.
    pub map: Option<EnvironmentMap>,
    /// Light space to world space, orthonormal.
    pub light_to_world: Mat3,
}

impl EnvironmentMap {
    /// Prepares a picture; `None` for the mapping if its shape fits neither convention.
    #[must_use]
    pub fn new(image: Image) -> Option<Self> {
        Self::with_mapping(image, SphereMapping::Auto)
    }

    /// Prepares a picture of a known mapping; `None` if it does not fit the picture's shape.
    #[must_use]
    pub fn with_mapping(image: Image, mapping: SphereMapping) -> Option<Self> {
        let (w, h) = (image.width(), image.height());
        let mapping = match mapping {
            SphereMapping::Auto if w == 2 * h => Mapping::LatLong,
            SphereMapping::Auto | SphereMapping::EqualArea if w == h => Mapping::EqualArea,
            SphereMapping::LatLong => Mapping::LatLong,
            _ => return None,
        };
        // Luminance of each texel; what is not a number, infinite or negative is black.
        let value = |x: u32, y: u32| {
            let l = luminance(clean(image.texel(x, y)));
            if l.is_finite() { l } else { 0.0 }
        };
        let mut weights = Vec::with_capacity(w as usize * h as usize);
        for y in 0..h {
            let (sin0, sin1) = (theta(y, h).sin(), theta(y + 1, h).sin());
            let middle = ((f64::from(y) + 0.5) * std::f64::consts::PI / f64::from(h)).sin();
            let area = if mapping == Mapping::LatLong { middle.max((sin0 + sin1) * 0.25) } else { 1.0 };
            for x in 0..w {
                let mut sum = 0.0f64;
                for dy in -1i64..=1 {
                    for dx in -1i64..=1 {
                        let yy = (i64::from(y) + dy).clamp(0, i64::from(h) - 1) as u32;
                        let xx = (i64::from(x) + dx).rem_euclid(i64::from(w)) as u32;
                        let tent = [0.5, 1.0, 0.5][(dx + 1) as usize] * [0.5, 1.0, 0.5][(dy + 1) as usize];
                        sum += f64::from(value(xx, yy)) * tent * 0.25;
                    }
                }
                weights.push(sum * area);
            }
        }
        let total: f64 = weights.iter().sum();
        let solid: f64 = (0..h)
            .map(|y| {
                if mapping == Mapping::LatLong {
                    ((f64::from(y) + 0.5) * std::f64::consts::PI / f64::from(h)).sin()
                } else {
                    1.0
                }
            })
            .sum::<f64>()
            * f64::from(w);
        let mean_luminance = (total / solid) as f32;
        let distribution = Distribution::new(&weights, w as usize, h as usize);
        Some(Self { image, mapping, distribution, mean_luminance })
    }

    /// Illuminance as pbrt-v4 measures it to meet a target: the sum over the texels above the horizon of luminance
    /// times cosine, times 2 pi over their number. That is half of what arrives on a patch that faces +z.
    #[must_use]
    pub fn illuminance(&self) -> f32 {
        let (w, h) = (self.image.width(), self.image.height());
        let mut sum = 0.0f64;
        for y in 0..h {
            for x in 0..w {
                let uv = [(x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32];
                // Share of the sphere that the texel covers.
                let (cos, share) = match self.mapping {
                    Mapping::EqualArea => (square_to_equal_area(uv).z, 1.0),
                    Mapping::LatLong => ((uv[1] * PI).cos(), (uv[1] * PI).sin() * 0.5 * PI),
                };
                if cos > 0.0 {
                    sum += f64::from(luminance(clean(self.image.texel(x, y))) * cos * share);
                }
            }
        }
        (sum / (f64::from(w) * f64::from(h))) as f32 * 2.0 * PI
    }

    /// Radiance along a unit direction of light space.
    #[inline]
    #[must_use]
    pub fn radiance(&self, w: Vec3) -> Vec3 {
        let [u, v] = self.to_square(w);
        // Row 0 is the top of the picture; texture coordinates have v = 0 at the bottom.
        let wrap = if self.mapping == Mapping::LatLong { Wrap::Repeat } else { Wrap::Clamp };
        clean(match wrap {
            // Longitude wraps round, latitude does not.
            Wrap::Repeat => self.image.bilinear(
                [u, 1.0 - v.clamp(0.5 / self.image.height() as f32, 1.0 - 0.5 / self.image.height() as f32)],
                [wrap; 2],
            ),
            _ => self.image.bilinear([u, 1.0 - v], [wrap; 2]),
        })
    }

    fn to_square(&self, w: Vec3) -> [f32; 2] {
        match self.mapping {
            Mapping::LatLong => direction_to_lat_long(w),
            Mapping::EqualArea => equal_area_to_square(w),
        }
    }

    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, f32)> {
        let (uv, density) = self.distribution.sample(u);
        match self.mapping {
            Mapping::LatLong => {
                let (sin_t, cos_t) = (uv[1] * PI).sin_cos();
                let (sin_p, cos_p) = (uv[0] * 2.0 * PI).sin_cos();
                let w = Vec3::new(sin_t * cos_p, sin_t * sin_p, cos_t);
                (sin_t > 0.0).then(|| (w, density / (2.0 * PI * PI * sin_t)))
            }
            Mapping::EqualArea => Some((square_to_equal_area(uv), density / (4.0 * PI))),
        }
    }

    fn pdf(&self, w: Vec3) -> f32 {
        let density = self.distribution.density(self.to_square(w));
        match self.mapping {
            Mapping::LatLong => {
                let sin_t = w.x.hypot(w.y);
                if sin_t > 0.0 { density / (2.0 * PI * PI * sin_t) } else { 0.0 }
            }
            Mapping::EqualArea => density / (4.0 * PI),
        }
    }
}

impl Environment {
    #[inline]
    pub(super) fn radiance(&self, wi: Vec3) -> Vec3 {
        match &self.map {
            None => self.radiance,
            Some(map) => self.radiance * map.radiance(self.light_to_world.transpose() * wi),
        }
    }

    #[inline]
    pub(super) fn sample(&self, u: [f32; 2]) -> Option<LightSample> {
        let (wi, radiance, pdf) = match &self.map {
            None => (uniform_sphere(u), self.radiance, 1.0 / (4.0 * PI)),
            Some(map) => {
                let (w, pdf) = map.sample(u)?;
                let wi = (self.light_to_world * w).normalize();
                (wi, self.radiance * map.radiance(w), pdf)
            }
        };
        (pdf > 0.0).then_some(LightSample { wi, distance: f32::INFINITY, radiance, pdf, is_delta: false })
    }

    #[inline]
    pub(super) fn pdf(&self, wi: Vec3) -> f32 {
        match &self.map {
            None => 1.0 / (4.0 * PI),
            Some(map) => map.pdf(self.light_to_world.transpose() * wi),
        }
    }

    pub(super) fn power(&self, scene_radius: f32) -> f32 {
        let mean = self.map.as_ref().map_or(1.0, |m| m.mean_luminance);
        4.0 * PI * PI * scene_radius * scene_radius * luminance(self.radiance) * mean
    }
}

fn clean(v: Vec3) -> Vec3 {
    let c = |x: f32| if x.is_finite() { x.max(0.0) } else { 0.0 };
    Vec3::new(c(v.x), c(v.y), c(v.z))
}

fn theta(row: u32, rows: u32) -> f64 {
    f64::from(row) * std::f64::consts::PI / f64::from(rows)
}

/// Piecewise constant density on the unit square: rows by a marginal, then columns.
#[derive(Clone, Debug)]
struct Distribution {
    width: usize,
    height: usize,
    /// Cumulative share of rows, `height + 1` values.
    marginal: Vec<f32>,
    /// Cumulative share within each row, `width + 1` values a row.
    conditional: Vec<f32>,
}

impl Distribution {
    fn new(weights: &[f64], width: usize, height: usize) -> Self {
        let mut marginal = Vec::with_capacity(height + 1);
        let mut conditional = Vec::with_capacity((width + 1) * height);
        let mut sums = Vec::with_capacity(height);
        for row in weights.chunks_exact(width) {
            let sum: f64 = row.iter().sum();
            cumulate(row, sum, &mut conditional);
            sums.push(sum);
        }
        let total = sums.iter().sum();
        cumulate(&sums, total, &mut marginal);
        Self { width, height, marginal, conditional }
    }

    fn row(&self, y: usize) -> &[f32] {
        &self.conditional[y * (self.width + 1)..(y + 1) * (self.width + 1)]
    }

    fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        let (y, v) = invert(&self.marginal, u[1]);
        let row = self.row(y);
        let (x, h) = invert(row, u[0]);
        let density = (self.marginal[y + 1] - self.marginal[y])
            * self.height as f32
            * (row[x + 1] - row[x])
            * self.width as f32;
        ([(x as f32 + h) / self.width as f32, (y as f32 + v) / self.height as f32], density)
    }

    fn density(&self, uv: [f32; 2]) -> f32 {
        let x = ((uv[0] * self.width as f32) as usize).min(self.width - 1);
        let y = ((uv[1] * self.height as f32) as usize).min(self.height - 1);
        let row = self.row(y);
        (self.marginal[y + 1] - self.marginal[y])
            * self.height as f32
            * (row[x + 1] - row[x])
            * self.width as f32
    }
}

fn cumulate(weights: &[f64], sum: f64, out: &mut Vec<f32>) {
    let mut total = 0.0;
    out.push(0.0);
    for (i, w) in weights.iter().enumerate() {
        total += if sum > 0.0 { w / sum } else { 1.0 / weights.len() as f64 };
        out.push(if i + 1 == weights.len() { 1.0 } else { total.min(1.0) as f32 });
    }
}

/// Cell of `u` and the position within it.
fn invert(cdf: &[f32], u: f32) -> (usize, f32) {
    let i = cdf.partition_point(|c| *c <= u).clamp(1, cdf.len() - 1) - 1;
    let width = cdf[i + 1] - cdf[i];
    (i, if width > 0.0 { ((u - cdf[i]) / width).clamp(0.0, 0.999_999_94) } else { 0.5 })
}

/// The unit square to the sphere, preserving areas.
pub(crate) fn square_to_equal_area(uv: [f32; 2]) -> Vec3 {
    let (u, v) = (2.0 * uv[0] - 1.0, 2.0 * uv[1] - 1.0);
    let (up, vp) = (u.abs(), v.abs());
    let signed_distance = 1.0 - (up + vp);
    let r = 1.0 - signed_distance.abs();
    let phi = if r == 0.0 { 1.0 } else { (vp - up) / r + 1.0 } * std::f32::consts::FRAC_PI_4;
    let z = (1.0 - r * r).copysign(signed_distance);
    let s = r * (2.0 - r * r).max(0.0).sqrt();
    let (sin, cos) = phi.sin_cos();
    Vec3::new(cos.copysign(u) * s, sin.copysign(v) * s, z)
}

/// Longitude over 2 pi and angle from the pole over pi.
#[inline]
pub(super) fn direction_to_lat_long(w: Vec3) -> [f32; 2] {
    let u = w.y.atan2(w.x) * (0.5 * FRAC_1_PI);
    // acos loses digits near the poles; atan2 does not.
    let theta = w.x.hypot(w.y).atan2(w.z);
    [if u < 0.0 { u + 1.0 } else { u }, theta * FRAC_1_PI]
}

/// Inverse of [`square_to_equal_area`].
pub(super) fn equal_area_to_square(d: Vec3) -> [f32; 2] {
    let (x, y, z) = (d.x.abs(), d.y.abs(), d.z.abs());
    let r = (1.0 - z).max(0.0).sqrt();
    let phi = y.atan2(x) * (2.0 * FRAC_1_PI);
    let (mut v, mut u) = (phi * r, r - phi * r);
    if d.z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    [(u.copysign(d.x) + 1.0) * 0.5, (v.copysign(d.y) + 1.0) * 0.5]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_area_map_is_a_bijection() {
        for i in 0..10_000 {
            let uv = [(i as f32 * 0.618_034).fract(), (i as f32 * 0.754_877_7).fract()];
            let w = square_to_equal_area(uv);
            assert!((w.length() - 1.0).abs() < 1e-5);
            let back = equal_area_to_square(w);
            assert!((back[0] - uv[0]).abs() < 1e-3 && (back[1] - uv[1]).abs() < 1e-3, "{uv:?} {back:?}");
        }
    }

    /// An even sky of luminance 1 lights a patch with pi; pbrt's measure says half of it.
    #[test]
    fn illuminance_of_an_even_sky() {
        use sparing_image::picture::{Picture, Pixels};
        use sparing_scene::description::TextureEncoding;
        for (w, h) in [(64, 64), (128, 64)] {
            let pixels = Pixels::Rgb32F(vec![[1.0; 3]; w * h]);
            let picture = Picture { width: w as u32, height: h as u32, pixels };
            let map = EnvironmentMap::new(Image::new(picture, TextureEncoding::Linear)).expect("it fits");
            assert!((map.illuminance() / (0.5 * PI) - 1.0).abs() < 1e-3, "{}", map.illuminance());
        }
    }
}
