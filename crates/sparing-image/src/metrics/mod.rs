//! How far a picture is from its reference.
//!
//! Both pictures are linear Rec.709 and are multiplied by the same factor first ([`Exposure`]), so that every
//! number is about the picture as it would be shown. Pixels in which either picture is not finite are left out of
//! every mean and counted. Sums are f64 in a fixed order: the numbers do not depend on the number of threads.

mod flip;
mod map;
mod summary;
mod ztest;

use rayon::prelude::*;

pub use flip::{FlipOptions, flip_map};
pub use map::{ErrorKind, block_means, error_map, false_color, signed_difference};
pub use summary::Summary;
pub use ztest::{ZTest, normal_p_value, z_test};

use crate::color::{auto_exposure, ciede2000, luminance, rgb_to_lab, srgb_encode};

/// What is added to the squared reference in [`Comparison::rel_mse`], in exposed units.
pub const REL_MSE_EPSILON: f64 = 0.01;

/// Pixels added up by one task.
const BLOCK: usize = 4096;

/// The factor that both pictures are multiplied by before they are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exposure {
    /// [`auto_exposure`] of the reference.
    #[default]
    Auto,
    /// 2 to this power.
    Ev(f32),
    /// This factor.
    Scale(f32),
}

impl Exposure {
    /// The factor.
    #[must_use]
    pub fn scale(self, reference: &[[f32; 3]]) -> f32 {
        match self {
            Self::Auto => auto_exposure(reference),
            Self::Ev(ev) => ev.exp2(),
            Self::Scale(scale) => scale,
        }
    }
}

/// The two pictures, or a picture and its claimed size, do not fit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("pictures of {image} and {reference} pixels cannot be compared as {width} x {height}")]
pub struct SizeMismatch {
    /// Pixels of the picture.
    pub image: usize,
    /// Pixels of the reference.
    pub reference: usize,
    /// Width asked for.
    pub width: u32,
    /// Height asked for.
    pub height: u32,
}

/// All differences between a picture and its reference. With I and R the exposed values:
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The factor that both pictures were multiplied by.
    pub scale: f32,
    /// Pixels compared: those that are finite in both pictures. Without any, every number below is NaN.
    pub compared: u64,
    /// Pixels of the picture with a NaN or infinite channel.
    pub non_finite_image: u64,
    /// Pixels of the reference with a NaN or infinite channel.
    pub non_finite_reference: u64,
    /// Mean of (I - R)^2 over pixels and channels, linear, not clamped.
    pub mse: f64,
    /// Mean of (I - R)^2 / (R^2 + [`REL_MSE_EPSILON`]) over pixels and channels, linear, not clamped.
    pub rel_mse: f64,
    /// Peak signal to noise ratio in decibels of what is shown: -10 log10 of the mean squared difference of the
    /// sRGB values, clamped to 0..=1 and not rounded. Infinite for equal pictures.
    pub psnr: f64,
    /// CIEDE2000 of the colours shown (clamped to 0..=1 in linear light), per pixel.
    pub ciede2000: Summary,
    /// LDR-FLIP of the pictures shown, per pixel; see [`flip_map`].
    pub flip: Summary,
    /// (sum of I - sum of R) / sum of R, of luminance: 0.01 is a picture 1 % too bright. 0 if both are black.
    pub signed_bias: f64,
    /// The same over the darkest quarter of the pixels that the reference lights at all: where bias hides. NaN
    /// if the reference is black.
    pub signed_bias_dark: f64,
}

/// Compares a picture to its reference, both linear Rec.709 in rows.
///
/// # Errors
/// [`SizeMismatch`] unless both have `width * height` pixels.
pub fn compare(
    image: &[[f32; 3]],
    reference: &[[f32; 3]],
    width: u32,
    height: u32,
    exposure: Exposure,
) -> Result<Comparison, SizeMismatch> {
    check_sizes(image, reference, width, height)?;
    let scale = exposure.scale(reference);
    let finite = |p: &[f32; 3]| exposed(*p, scale).iter().all(|x| x.is_finite());
    let valid: Vec<bool> = image.par_iter().zip(reference).map(|(i, r)| finite(i) && finite(r)).collect();
    let flip = flip_map(image, reference, width, height, Exposure::Scale(scale), &FlipOptions::default())?;
    let keep = |values: Vec<f32>| {
        let kept = values.into_iter().zip(&valid).filter(|(_, valid)| **valid).map(|(x, _)| f64::from(x));
        Summary::of(kept.collect())
    };
    let delta_e: Vec<f32> =
        image.par_iter().zip(reference).map(|(i, r)| delta_e(shown(*i, scale), shown(*r, scale))).collect();
    let compared = valid.iter().filter(|valid| **valid).count() as u64;
    let mean = |f: &(dyn Fn(f64, f64) -> f64 + Sync)| {
        // Blocks of a fixed size, added in order: the same sum on every machine.
        let sums: Vec<f64> = valid
            .par_chunks(BLOCK)
            .zip(image.par_chunks(BLOCK).zip(reference.par_chunks(BLOCK)))
            .map(|(valid, (i, r))| {
                let pairs = i.iter().zip(r).zip(valid).filter(|(_, valid)| **valid);
                pairs.map(|((i, r), _)| of_channels(f, exposed(*i, scale), exposed(*r, scale))).sum()
            })
            .collect();
        sums.iter().sum::<f64>() / (3.0 * compared as f64)
    };
    let square = |x: f64| x * x;
    let srgb = |x: f64| srgb_encode(x.clamp(0.0, 1.0));
    let (signed_bias, signed_bias_dark) = signed_biases(image, reference, &valid, scale);
    Ok(Comparison {
        scale,
        compared,
        non_finite_image: image.iter().filter(|p| !finite(p)).count() as u64,
        non_finite_reference: reference.iter().filter(|p| !finite(p)).count() as u64,
        mse: mean(&|i, r| square(i - r)),
        rel_mse: mean(&|i, r| square(i - r) / (r * r + REL_MSE_EPSILON)),
        psnr: -10.0 * mean(&|i, r| square(srgb(i) - srgb(r))).log10(),
        ciede2000: keep(delta_e),
        flip: keep(flip),
        signed_bias,
        signed_bias_dark,
    })
}

fn of_channels(f: &dyn Fn(f64, f64) -> f64, i: [f64; 3], r: [f64; 3]) -> f64 {
    f(i[0], r[0]) + f(i[1], r[1]) + f(i[2], r[2])
}

fn check_sizes(i: &[[f32; 3]], r: &[[f32; 3]], width: u32, height: u32) -> Result<(), SizeMismatch> {
    let pixels = u64::from(width) * u64::from(height);
    if i.len() as u64 == pixels && r.len() as u64 == pixels {
        return Ok(());
    }
    Err(SizeMismatch { image: i.len(), reference: r.len(), width, height })
}

fn exposed(pixel: [f32; 3], scale: f32) -> [f64; 3] {
    pixel.map(|x| f64::from(x) * f64::from(scale))
}

/// What a screen can show of a pixel, linear; 0 for NaN.
fn shown(pixel: [f32; 3], scale: f32) -> [f64; 3] {
    exposed(pixel, scale).map(|x| if x.is_nan() { 0.0 } else { x.clamp(0.0, 1.0) })
}

fn delta_e(image: [f64; 3], reference: [f64; 3]) -> f32 {
    if image == reference { 0.0 } else { ciede2000(rgb_to_lab(image), rgb_to_lab(reference)) as f32 }
}

fn signed_biases(image: &[[f32; 3]], reference: &[[f32; 3]], valid: &[bool], scale: f32) -> (f64, f64) {
    let of = |p: &[f32; 3]| luminance(*p) * f64::from(scale);
    let mut lit: Vec<(f64, f64)> = image
        .iter()
        .zip(reference)
        .zip(valid)
        .filter(|(_, v)| **v)
        .map(|((i, r), _)| (of(i), of(r)))
        .collect();
    let bias = |pairs: &[(f64, f64)]| {
        let difference: f64 = pairs.iter().map(|(i, r)| i - r).sum();
        if pairs.is_empty() {
            f64::NAN
        } else if difference == 0.0 {
            0.0
        } else {
            difference / pairs.iter().map(|(_, r)| r).sum::<f64>()
        }
    };
    let all = bias(&lit);
    lit.retain(|(_, r)| *r > 0.0);
    lit.sort_by(|a, b| a.1.total_cmp(&b.1)); // stable: ties stay in pixel order
    lit.truncate(lit.len().div_ceil(4));
    (all, bias(&lit))
}

#[cfg(test)]
mod tests;
