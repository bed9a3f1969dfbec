//! Pictures made by formulas, as portable float maps in memory.

use crate::description::{Image, ImageSource, TextureEncoding};
use crate::generate::fractal_noise;
use crate::generate::turn::turn;
use glam::Vec3;

/// A picture of linear colours; `at` gets u and v in 0..1, v = 0 at the bottom.
pub(super) fn picture(name: &str, width: u32, height: u32, at: impl Fn(f32, f32) -> Vec3) -> Image {
    // A negative scale says little endian; rows come from the bottom.
    let mut bytes = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    for y in 0..height {
        for x in 0..width {
            let value = at((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
            bytes.extend(value.to_array().iter().flat_map(|v| v.to_le_bytes()));
        }
    }
    let source = ImageSource::Bytes { name: format!("{name}.pfm"), bytes: bytes.into() };
    Image { source, encoding: TextureEncoding::Auto }
}

/// Blotches of two colours.
pub(super) fn noise(a: Vec3, b: Vec3, scale: f32, seed: u32) -> Image {
    picture("noise", 64, 64, |u, v| {
        let t = 0.5 + 0.9 * fractal_noise(Vec3::new(u * scale, v * scale, 0.5), 5, seed);
        a.lerp(b, t.clamp(0.0, 1.0))
    })
}

/// Stripes of uneven width, at a slant.
pub(super) fn stripes(a: Vec3, b: Vec3, seed: u32) -> Image {
    picture("stripes", 96, 96, |u, v| {
        let band = fractal_noise(Vec3::new(12.0 * u + 3.0 * v, 0.5, 0.5), 2, seed);
        if band > 0.0 { a } else { b }
    })
}

/// Bricks with joints, each brick of its own tone.
pub(super) fn bricks(brick: Vec3, joint: Vec3, seed: u32) -> Image {
    picture("bricks", 96, 96, |u, v| {
        let row = (v * 8.0).floor();
        let x = u * 4.0 + 0.5 * (row % 2.0);
        let column = x.floor().rem_euclid(4.0);
        let edge = (v * 8.0 - row) < 0.14 || (x - x.floor()) < 0.07;
        let tone = 1.0 + 0.5 * fractal_noise(Vec3::new(column + 0.3, row + 0.4, 0.5), 1, seed);
        if edge { joint } else { (brick * tone).min(Vec3::ONE) }
    })
}

/// Dots on a regular grid.
pub(super) fn dots(dot: Vec3, between: Vec3, radius: f32) -> Image {
    picture("dots", 64, 64, |u, v| {
        let (x, y) = (u * 4.0 % 1.0 - 0.5, v * 4.0 % 1.0 - 0.5);
        if x * x + y * y < radius * radius { dot } else { between }
    })
}

/// A sky with a horizon, a hazy sun around `sun` (unit, y up) and dark ground, for a light whose z is the
/// world's y. Latitude-longitude.
pub(super) fn sky(zenith: Vec3, horizon: Vec3, sun: Vec3, sun_radiance: f32, sharpness: f32) -> Image {
    picture("sky", 64, 32, |u, v| {
        let (sin, cos) = turn((1.0 - v) * 0.5);
        let (sin_phi, cos_phi) = turn(u);
        // Light space (x, y, z) is (x, -z, y) of the world; see `Stage::environment`.
        let d = Vec3::new(sin * cos_phi, cos, -sin * sin_phi);
        let base = if d.y < 0.0 { horizon * 0.35 } else { horizon.lerp(zenith, d.y.sqrt()) };
        base + Vec3::new(1.0, 0.92, 0.8) * (sun_radiance * glow(d.dot(sun), sharpness))
    })
}

/// A studio of a few soft boxes, as an equal-area octahedral map: boxes are squares of the map.
pub(super) fn studio(fill: Vec3, boxes: &[([f32; 2], f32, Vec3)]) -> Image {
    picture("studio", 32, 32, |u, v| {
        let inside =
            |(c, half, _): &&([f32; 2], f32, Vec3)| (u - c[0]).abs() < *half && (v - c[1]).abs() < *half;
        boxes.iter().find(inside).map_or(fill, |b| b.2)
    })
}

/// Falls from 1 at cosine 1 like a Lorentz curve.
fn glow(cos: f32, sharpness: f32) -> f32 {
    let x = (1.0 - cos) * sharpness;
    1.0 / (1.0 + x * x)
}
