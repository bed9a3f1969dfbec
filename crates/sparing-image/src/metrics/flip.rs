//! LDR-FLIP (Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "FLIP: A Difference
//! Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), High Performance Graphics).
//!
//! The colour part filters both pictures with the eye's contrast sensitivity in an opponent space (section 4.1,
//! table 1), measures the HyAB distance of Hunt-adjusted L*a*b* and compresses it to 0..=1. The feature part
//! compares edge and point detectors on the achromatic channel (section 4.2). The feature difference is an
//! exponent on the colour difference (section 4.3). All filters are separable, as the authors note later.

use rayon::prelude::*;

use super::{Exposure, SizeMismatch, check_sizes, shown};
use crate::color::{WHITE, rgb_to_lab, rgb_to_xyz, xyz_to_rgb};

/// How the pictures are looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlipOptions {
    /// Pixels per degree of visual angle. The default of 67 is the paper's: a screen 3840 pixels and 0.7 m wide
    /// seen from 0.7 m. Clamped to 1..=1000.
    pub pixels_per_degree: f64,
}

impl Default for FlipOptions {
    fn default() -> Self {
        Self { pixels_per_degree: 3840.0 * std::f64::consts::PI / 180.0 }
    }
}

/// Exponents, and the point (PC, PT) where the compression of colour differences bends (section 4.1.3).
const QC: f64 = 0.7;
const PC: f64 = 0.4;
const PT: f64 = 0.95;
const QF: f64 = 0.5;
/// Width of the human edge detector, degrees, peak to trough (section 4.2).
const DETECTOR_WIDTH: f64 = 0.082;

/// Contrast sensitivity as sums of Gaussians (a, b), for the achromatic, red-green and blue-yellow channel (table 1).
const SENSITIVITY: [&[(f64, f64)]; 3] = [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];

/// One value in 0..=1 a pixel: how visible the difference is when the two pictures alternate in place.
///
/// Both are exposed and clamped to 0..=1 in linear light, without a tone curve; values that are NaN count as 0.
///
/// # Errors
/// [`SizeMismatch`] unless both have `width * height` pixels.
pub fn flip_map(
    image: &[[f32; 3]],
    reference: &[[f32; 3]],
    width: u32,
    height: u32,
    exposure: Exposure,
    options: &FlipOptions,
) -> Result<Vec<f32>, SizeMismatch> {
    check_sizes(image, reference, width, height)?;
    if image.is_empty() {
        return Ok(Vec::new());
    }
    let scale = exposure.scale(reference);
    let ppd =
        if options.pixels_per_degree.is_nan() { 67.0 } else { options.pixels_per_degree.clamp(1.0, 1000.0) };
    let prepare = |pixels: &[[f32; 3]]| Prepared::new(pixels, scale, width as usize, ppd);
    let (a, b) = (prepare(image), prepare(reference));
    let max = hyab(hunt([0.0, 1.0, 0.0]), hunt([0.0, 0.0, 1.0])).powf(QC);
    let pixels = (0..image.len()).into_par_iter().map(|i| {
        let color = compress(hyab(a.lab[i].map(f64::from), b.lab[i].map(f64::from)).powf(QC), max);
        let difference = |f: fn([f32; 4]) -> f32| f64::from((f(a.features[i]) - f(b.features[i])).abs());
        let edge = difference(|[x, y, ..]| x.hypot(y));
        let point = difference(|[.., x, y]| x.hypot(y));
        let feature = (edge.max(point) * std::f64::consts::FRAC_1_SQRT_2).powf(QF);
        color.powf(1.0 - feature).clamp(0.0, 1.0) as f32
    });
    Ok(pixels.collect())
}

/// Maps differences up to PC of the maximum to 0..=PT and the rest to PT..=1.
fn compress(difference: f64, max: f64) -> f64 {
    let bend = PC * max;
    if difference < bend {
        PT / bend * difference
    } else {
        PT + (difference - bend) / (max - bend) * (1.0 - PT)
    }
}

/// L*a*b* of a linear colour with a and b scaled by L/100: saturation fades in the dark (the Hunt effect).
fn hunt(rgb: [f64; 3]) -> [f64; 3] {
    let [l, a, b] = rgb_to_lab(rgb);
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// City-block in lightness, Euclidean in the chroma plane (Abasi, Amani Tehran and Fairchild 2020).
fn hyab(p: [f64; 3], q: [f64; 3]) -> f64 {
    (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2])
}

/// What is compared of one picture.
struct Prepared {
    /// Filtered, Hunt-adjusted L*a*b*.
    lab: Vec<[f32; 3]>,
    /// Edge detector in x and y, point detector in x and y.
    features: Vec<[f32; 4]>,
}

impl Prepared {
    fn new(pixels: &[[f32; 3]], scale: f32, width: usize, ppd: f64) -> Self {
        // The linear cousin of L*a*b*: YCxCz.
        let opponent: Vec<[f32; 3]> = pixels
            .par_iter()
            .map(|p| {
                let xyz = rgb_to_xyz(shown(*p, scale));
                let [x, y, z] = [xyz[0] / WHITE[0], xyz[1] / WHITE[1], xyz[2] / WHITE[2]];
                [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)].map(|v| v as f32)
            })
            .collect();
        let channel = |c: usize| opponent.iter().map(|p| p[c]).collect::<Vec<f32>>();
        let filtered = [0, 1, 2].map(|c| sensitivity_filter(&channel(c), width, SENSITIVITY[c], ppd));
        let lab = (0..pixels.len()).into_par_iter().map(|i| {
            let [y, cx, cz] = [0, 1, 2].map(|c| f64::from(filtered[c][i]));
            let y = (y + 16.0) / 116.0;
            let rgb = xyz_to_rgb([(y + cx / 500.0) * WHITE[0], y * WHITE[1], (y - cz / 200.0) * WHITE[2]]);
            hunt(rgb.map(|v| v.clamp(0.0, 1.0))).map(|v| v as f32)
        });
        let lab = lab.collect();
        let luminance: Vec<f32> = opponent.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
        Self { lab, features: features(&luminance, width, ppd) }
    }
}

/// Convolves with a contrast sensitivity function, normalised to keep constants.
fn sensitivity_filter(data: &[f32], width: usize, gaussians: &[(f64, f64)], ppd: f64) -> Vec<f32> {
    use std::f64::consts::PI;
    // Three standard deviations of the widest Gaussian of all channels, for every channel.
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i32;
    let terms: Vec<(f64, Vec<f64>)> = gaussians
        .iter()
        .map(|(a, b)| {
            let weight = |x: i32| (-(PI * f64::from(x) / ppd).powi(2) / b).exp();
            (a * (PI / b).sqrt(), (-radius..=radius).map(weight).collect())
        })
        .collect();
    let sum = |kernel: &[f64]| kernel.iter().sum::<f64>();
    let total: f64 = terms.iter().map(|(factor, kernel)| factor * sum(kernel).powi(2)).sum();
    let mut out = vec![0.0; data.len()];
    for (factor, kernel) in &terms {
        let share = factor / total;
        let horizontal: Vec<f64> = kernel.iter().map(|w| w * share).collect();
        let filtered = convolve(data, width, &horizontal, kernel);
        out.iter_mut().zip(filtered).for_each(|(o, f)| *o += f);
    }
    out
}

/// Gradients and second derivatives of a Gaussian, positive and negative weights each summing to one.
fn features(luminance: &[f32], width: usize, ppd: f64) -> Vec<[f32; 4]> {
    let deviation = 0.5 * DETECTOR_WIDTH * ppd;
    let radius = (3.0 * deviation).ceil() as i32;
    let offsets = || (-radius..=radius).map(f64::from);
    let gaussian = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
    let smooth: Vec<f64> = offsets().map(gaussian).collect();
    let sum: f64 = smooth.iter().sum();
    let smooth: Vec<f64> = smooth.into_iter().map(|w| w / sum).collect();
    let edge = balanced(offsets().map(|x| -x * gaussian(x)).collect());
    let point = balanced(offsets().map(|x| (x * x / (deviation * deviation) - 1.0) * gaussian(x)).collect());
    let detect = |horizontal: &[f64], vertical: &[f64]| convolve(luminance, width, horizontal, vertical);
    let edges = [detect(&edge, &smooth), detect(&smooth, &edge)];
    let points = [detect(&point, &smooth), detect(&smooth, &point)];
    (0..luminance.len()).map(|i| [edges[0][i], edges[1][i], points[0][i], points[1][i]]).collect()
}

fn balanced(mut kernel: Vec<f64>) -> Vec<f64> {
    let positive: f64 = kernel.iter().filter(|w| **w > 0.0).sum();
    let negative: f64 = -kernel.iter().filter(|w| **w < 0.0).sum::<f64>();
    for w in &mut kernel {
        *w /= if *w > 0.0 { positive } else { negative };
    }
    kernel
}

/// Separable convolution (in truth correlation: only magnitudes of the results are used), edges repeated.
fn convolve(data: &[f32], width: usize, horizontal: &[f64], vertical: &[f64]) -> Vec<f32> {
    let height = data.len() / width;
    let mut across = vec![0.0f32; data.len()];
    across.par_chunks_mut(width).zip(data.par_chunks(width)).for_each(|(out, line)| {
        let radius = horizontal.len() / 2;
        let mut padded = vec![line[0]; width + 2 * radius];
        padded[radius..radius + width].copy_from_slice(line);
        padded[radius + width..].fill(line[width - 1]);
        add_lines(out, horizontal.iter().enumerate().map(|(k, w)| (*w, &padded[k..k + width])));
    });
    let mut out = vec![0.0f32; data.len()];
    out.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let radius = vertical.len() / 2;
        let line = |k: usize| (y + k).saturating_sub(radius).min(height - 1) * width;
        add_lines(out, vertical.iter().enumerate().map(|(k, w)| (*w, &across[line(k)..][..width])));
    });
    out
}

/// The weighted sum of lines as long as `out`.
fn add_lines<'a>(out: &mut [f32], lines: impl Iterator<Item = (f64, &'a [f32])>) {
    let mut sums = vec![0.0f64; out.len()];
    for (weight, line) in lines {
        sums.iter_mut().zip(line).for_each(|(sum, value)| *sum += weight * f64::from(*value));
    }
    out.iter_mut().zip(sums).for_each(|(out, sum)| *out = sum as f32);
}
