//! Point lights that throw a picture: by direction (goniometric), or like a slide projector.
//!
//! Both look up the nearest texel and measure `power` as pbrt-v4 does ("Physically Based Rendering", 4th edition,
//! sections 12.2.2 and 12.2.3).

use super::environment::{direction_to_lat_long, equal_area_to_square};
use super::point::from_point;
use super::{LightSample, luminance};
use crate::texture::Image;
use glam::{Mat3, Vec3};
use std::f32::consts::PI;

/// A point light whose intensity is a picture of directions.
#[derive(Clone, Debug)]
pub struct GoniometricLight {
    /// World position.
    pub position: Vec3,
    /// Factor on the picture, W/sr.
    pub intensity: Vec3,
    /// The mean of its channels counts; none is white.
    pub image: Option<Image>,
    /// Equal-area octahedral, or latitude and longitude.
    pub equal_area: bool,
    /// Light space, z the pole of the picture, to world space.
    pub light_to_world: Mat3,
}

/// Texel of a position in the unit square, v from the top.
fn nearest(image: &Image, [u, v]: [f32; 2]) -> Vec3 {
    let index = |t: f32, n: u32| ((t * n as f32) as u32).min(n - 1);
    clean(image.texel(index(u, image.width()), index(v, image.height())))
}

fn clean(v: Vec3) -> Vec3 {
    let c = |x: f32| if x.is_finite() { x.max(0.0) } else { 0.0 };
    Vec3::new(c(v.x), c(v.y), c(v.z))
}

impl GoniometricLight {
    /// Scales the light to a power in W.
    #[must_use]
    pub fn with_power(mut self, watt: f32) -> Self {
        let unit = 4.0 * PI * self.mean();
        self.intensity *= if unit > 0.0 { watt / unit } else { 0.0 };
        self
    }

    /// Mean of the picture over all directions.
    fn mean(&self) -> f32 {
        let Some(image) = &self.image else { return 1.0 };
        let (w, h) = (image.width(), image.height());
        let (mut sum, mut weights) = (0.0f64, 0.0f64);
        for y in 0..h {
            let theta = (f64::from(y) + 0.5) * std::f64::consts::PI / f64::from(h);
            let weight = if self.equal_area { 1.0 } else { theta.sin() };
            for x in 0..w {
                sum += f64::from(clean(image.texel(x, y)).element_sum() / 3.0) * weight;
            }
            weights += weight * f64::from(w);
        }
        (sum / weights) as f32
    }

    #[inline]
    pub(super) fn sample(&self, p: Vec3) -> Option<LightSample> {
        let mut s = from_point(self.position, self.intensity, p)?;
        if let Some(image) = &self.image {
            let w = (self.light_to_world.transpose() * -s.wi).normalize_or(Vec3::Z);
            let uv = if self.equal_area { equal_area_to_square(w) } else { direction_to_lat_long(w) };
            s.radiance *= nearest(image, uv).element_sum() / 3.0;
        }
        (s.radiance != Vec3::ZERO).then_some(s)
    }

    pub(super) fn power(&self) -> f32 {
        4.0 * PI * self.mean() * luminance(self.intensity)
    }
}

/// A slide projector.
#[derive(Clone, Debug)]
pub struct ProjectionLight {
    /// World position.
    pub position: Vec3,
    /// Factor on the picture, W/sr.
    pub intensity: Vec3,
    /// The slide; none is even light.
    pub image: Option<Image>,
    /// Tangents of half the angles along the rows and columns.
    pub half: [f32; 2],
    /// Light space, x along the rows from left, y along the columns from the top, to world space.
    pub light_to_world: Mat3,
}

impl ProjectionLight {
    /// A projector whose shorter side spans `fov` degrees.
    #[must_use]
    pub fn new(
        position: Vec3,
        intensity: Vec3,
        image: Option<Image>,
        fov: f32,
        light_to_world: Mat3,
    ) -> Self {
        let tan = (fov.to_radians() * 0.5).tan();
        let aspect = image.as_ref().map_or(1.0, |i| i.width() as f32 / i.height() as f32);
        let half = if aspect > 1.0 { [tan * aspect, tan] } else { [tan, tan / aspect] };
        Self { position, intensity, image, half, light_to_world }
    }

    /// Scales the light to a power in W.
    #[must_use]
    pub fn with_power(mut self, watt: f32) -> Self {
        let unit = self.integral(luminance);
        self.intensity *= if unit > 0.0 { watt / unit } else { 0.0 };
        self
    }

    /// Integral of the picture over the directions that it covers: a texel's solid angle is its area on the plane at
    /// distance 1 times cos³.
    fn integral(&self, value: impl Fn(Vec3) -> f32) -> f32 {
        let (w, h) = self.image.as_ref().map_or((64, 64), |i| (i.width(), i.height()));
        let mut sum = 0.0f64;
        for y in 0..h {
            for x in 0..w {
                let at = |i: u32, n: u32, half: f32| (2.0 * (i as f32 + 0.5) / n as f32 - 1.0) * half;
                let (px, py) = (at(x, w, self.half[0]), at(y, h, self.half[1]));
                let cos = 1.0 / (1.0 + px * px + py * py).sqrt();
                let color = self.image.as_ref().map_or(Vec3::ONE, |i| clean(i.texel(x, y)));
                sum += f64::from(value(color) * cos * cos * cos);
            }
        }
        let area = 4.0 * self.half[0] * self.half[1];
        (sum / (f64::from(w) * f64::from(h))) as f32 * area
    }

    #[inline]
    pub(super) fn sample(&self, p: Vec3) -> Option<LightSample> {
        let mut s = from_point(self.position, self.intensity, p)?;
        let w = self.light_to_world.transpose() * -s.wi;
        if w.z < 1e-3 {
            return None; // behind, or so far aside that pbrt stops as well
        }
        let (x, y) = (w.x / (w.z * self.half[0]), w.y / (w.z * self.half[1]));
        if x.abs() > 1.0 || y.abs() > 1.0 {
            return None;
        }
        if let Some(image) = &self.image {
            s.radiance *= nearest(image, [(x + 1.0) * 0.5, (y + 1.0) * 0.5]);
        }
        (s.radiance != Vec3::ZERO).then_some(s)
    }

    pub(super) fn power(&self) -> f32 {
        self.integral(|color| luminance(color * self.intensity))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sparing_image::picture::{Picture, Pixels};
    use sparing_scene::description::TextureEncoding;

    fn picture(width: u32, data: Vec<[f32; 3]>) -> Option<Image> {
        let height = data.len() as u32 / width;
        let picture = Picture { width, height, pixels: Pixels::Rgb32F(data) };
        Some(Image::new(picture, TextureEncoding::Linear))
    }

    /// Upper left red, upper right green, lower left blue, lower right black.
    fn slide() -> Option<Image> {
        picture(2, vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]])
    }

    #[test]
    fn a_slide_lands_where_it_should() {
        let light = ProjectionLight::new(Vec3::ZERO, Vec3::splat(8.0), slide(), 90.0, Mat3::IDENTITY);
        // On a wall at z = 2, y grows downwards along the columns; distance² of (±1, ±1, 2) is 6.
        let at = |x: f32, y: f32| light.sample(Vec3::new(x, y, 2.0)).map(|s| s.radiance * 6.0 / 8.0);
        assert!(at(-1.0, -1.0).is_some_and(|c| c.abs_diff_eq(Vec3::X, 1e-5)));
        assert!(at(1.0, -1.0).is_some_and(|c| c.abs_diff_eq(Vec3::Y, 1e-5)));
        assert!(at(-1.0, 1.0).is_some_and(|c| c.abs_diff_eq(Vec3::Z, 1e-5)));
        assert!(at(1.0, 1.0).is_none() && at(2.1, 0.0).is_none());
        assert!(light.sample(Vec3::new(0.0, 0.0, -2.0)).is_none());
    }

    /// A square of half-angle 45 degrees is a face of a cube: a sixth of the sphere.
    #[test]
    fn power_is_the_integral_of_the_intensity() {
        let light = ProjectionLight::new(Vec3::ZERO, Vec3::ONE, None, 90.0, Mat3::IDENTITY);
        assert!((light.power() - 4.0 * PI / 6.0).abs() < 1e-3, "{}", light.power());
        assert!((light.with_power(10.0).power() - 10.0).abs() < 1e-4);
        let mut data = vec![[0.5f32; 3]; 16];
        data[5] = [1.5, 1.5, 1.5];
        for equal_area in [true, false] {
            let light = GoniometricLight {
                position: Vec3::ZERO,
                intensity: Vec3::ONE,
                image: picture(4, data.clone()),
                equal_area,
                light_to_world: Mat3::IDENTITY,
            };
            assert!((light.with_power(7.0).power() - 7.0).abs() < 1e-4);
        }
    }

    /// Latitude and longitude, 4 by 2: the second texel of the upper row is at longitudes of 90 to 180 degrees.
    #[test]
    fn directions_meet_their_texels() {
        let mut data = vec![[0.0f32; 3]; 8];
        data[1] = [3.0; 3];
        let light = GoniometricLight {
            position: Vec3::ZERO,
            intensity: Vec3::ONE,
            image: picture(4, data),
            equal_area: false,
            light_to_world: Mat3::IDENTITY,
        };
        let lit = light.sample(Vec3::new(-1.0, 1.0, 1.0));
        assert!(lit.is_some_and(|s| (s.radiance.x - 1.0).abs() < 1e-5));
        assert!(light.sample(Vec3::new(1.0, 1.0, 1.0)).is_none());
        assert!(light.sample(Vec3::new(-1.0, 1.0, -1.0)).is_none());
    }
}
