//! Pictures of where the error is.

use rayon::prelude::*;

use super::{
    Exposure, FlipOptions, REL_MSE_EPSILON, SizeMismatch, check_sizes, delta_e, exposed, flip_map, shown,
};
use crate::color::{lab_to_xyz, luminance, xyz_to_rgb};

/// What an error map shows, and the value that is brightest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ErrorKind {
    /// LDR-FLIP, 0 to 1.
    #[default]
    Flip,
    /// CIEDE2000, 0 to 20.
    Ciede2000,
    /// Root of the mean over channels of (I - R)^2 / (R^2 + [`REL_MSE_EPSILON`]), 0 to 1.
    Relative,
}

/// A picture of the error of each pixel in false colours, linear Rec.709, to write with no exposure. Pixels that
/// are not finite in either picture are pure green.
///
/// # Errors
/// [`SizeMismatch`] unless both have `width * height` pixels.
pub fn error_map(
    image: &[[f32; 3]],
    reference: &[[f32; 3]],
    width: u32,
    height: u32,
    exposure: Exposure,
    kind: ErrorKind,
) -> Result<Vec<[f32; 3]>, SizeMismatch> {
    check_sizes(image, reference, width, height)?;
    let scale = exposure.scale(reference);
    let pairs = image.par_iter().zip(reference);
    let errors: Vec<f32> = match kind {
        ErrorKind::Flip => {
            flip_map(image, reference, width, height, Exposure::Scale(scale), &FlipOptions::default())?
        }
        ErrorKind::Ciede2000 => {
            pairs.map(|(i, r)| delta_e(shown(*i, scale), shown(*r, scale)) / 20.0).collect()
        }
        ErrorKind::Relative => {
            let relative = |i: f64, r: f64| (i - r) * (i - r) / (r * r + REL_MSE_EPSILON);
            pairs
                .map(|(i, r)| {
                    let (i, r) = (exposed(*i, scale), exposed(*r, scale));
                    let sum: f64 = (0..3).map(|c| relative(i[c], r[c])).sum();
                    (sum / 3.0).sqrt() as f32
                })
                .collect()
        }
    };
    let table: Vec<[f32; 3]> = (0..=255).map(|i| false_color(i as f32 / 255.0)).collect();
    let finite = |p: &[f32; 3]| exposed(*p, scale).iter().all(|x| x.is_finite());
    let color = |((error, i), r): ((&f32, &[f32; 3]), &[f32; 3])| {
        if finite(i) && finite(r) {
            table[(error.clamp(0.0, 1.0) * 255.0).round() as usize]
        } else {
            [0.0, 1.0, 0.0]
        }
    };
    Ok(errors.par_iter().zip(image).zip(reference).map(color).collect())
}

/// A picture of where luminance is too high (red), too low (blue) or right (white), linear Rec.709, to write with no
/// exposure. The difference is relative: (I - R) / sqrt(R^2 + [`REL_MSE_EPSILON`]); `range` of it and more are the full
/// colour. Pixels that are not finite in either picture are pure green.
///
/// # Errors
/// [`SizeMismatch`] unless both have `width * height` pixels.
pub fn signed_difference(
    image: &[[f32; 3]],
    reference: &[[f32; 3]],
    width: u32,
    height: u32,
    exposure: Exposure,
    range: f32,
) -> Result<Vec<[f32; 3]>, SizeMismatch> {
    check_sizes(image, reference, width, height)?;
    let scale = exposure.scale(reference);
    let color = |(i, r): (&[f32; 3], &[f32; 3])| {
        let [i, r] = [i, r].map(|p| f64::from(scale) * luminance(*p));
        let difference = (i - r) / (r * r + REL_MSE_EPSILON).sqrt();
        let part: f32 = (difference / f64::from(range)) as f32;
        if !difference.is_finite() {
            [0.0, 1.0, 0.0]
        } else if part >= 0.0 {
            [1.0, (1.0 - part).max(0.0), (1.0 - part).max(0.0)]
        } else {
            [(1.0 + part).max(0.0), (1.0 + part).max(0.0), 1.0]
        }
    };
    Ok(image.par_iter().zip(reference).map(color).collect())
}

/// Means over blocks of `side` times `side` pixels, with the size in blocks; blocks at the right and the bottom are what
/// is left. A pixel that is not finite makes its block so. What is left of a picture is too coarse to stand in for it, but
/// signed differences of such means show where light is missing, with less noise.
///
/// # Panics
/// If there are not `width * height` pixels, or `side` is 0.
#[must_use]
pub fn block_means(pixels: &[[f32; 3]], width: u32, height: u32, side: u32) -> (Vec<[f32; 3]>, [u32; 2]) {
    assert_eq!(pixels.len(), width as usize * height as usize, "the size of the picture");
    let size = [width.div_ceil(side), height.div_ceil(side)];
    let mean = |i: usize| {
        let corner = [i as u32 % size[0] * side, i as u32 / size[0] * side];
        let (x1, y1) = ((corner[0] + side).min(width), (corner[1] + side).min(height));
        let mut sum = [0.0; 3];
        for y in corner[1]..y1 {
            let row = y as usize * width as usize;
            for pixel in &pixels[row + corner[0] as usize..row + x1 as usize] {
                sum.iter_mut().zip(pixel).for_each(|(s, v)| *s += f64::from(*v));
            }
        }
        let count = f64::from((x1 - corner[0]) * (y1 - corner[1]));
        sum.map(|s| (s / count) as f32)
    };
    ((0..size[0] as usize * size[1] as usize).into_par_iter().map(mean).collect(), size)
}

/// A colour for 0..=1, linear Rec.709: lightness rises evenly from black to near white while the hue goes from
/// violet over red to yellow, so that it also reads in grey and to the colour-blind. Values outside are clamped,
/// NaN is black.
#[must_use]
pub fn false_color(value: f32) -> [f32; 3] {
    let t = if value.is_nan() { 0.0 } else { f64::from(value.clamp(0.0, 1.0)) };
    let lightness = 97.0 * t;
    let hue = (300.0 + 150.0 * t).to_radians();
    // No more chroma than the screen can show at either end.
    let chroma = 75.0 * (std::f64::consts::PI * t.powf(0.8)).sin();
    let rgb = xyz_to_rgb(lab_to_xyz([lightness, chroma * hue.cos(), chroma * hue.sin()]));
    rgb.map(|x| x.clamp(0.0, 1.0) as f32)
}
