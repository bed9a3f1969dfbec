//! Whether two pictures could be renderings of the same scene, given the variance of their pixels.
//!
//! A Z-test a channel of each pixel, corrected for their number after Šidák (1967), as Mitsuba's and other
//! renderers' regression tests do. Valid if pixel means are near normal and variances near true: with few samples
//! or heavy tails it rejects too often, with variances that are too large (independent-sample estimates of
//! low-discrepancy samplers) too seldom.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use super::SizeMismatch;

/// The outcome of [`z_test`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZTest {
    /// Tests made: finite channels of finite pixels.
    pub tests: u64,
    /// Channels left out because a value or a variance is not finite, or a variance is negative.
    pub skipped: u64,
    /// p-value below which a single test rejects, so that all of them together reject at the level asked for:
    /// 1 - (1 - level)^(1 / tests).
    pub threshold: f64,
    /// Share of the tests that do not reject.
    pub accepted: f64,
    /// Smallest p-value.
    pub min_p: f64,
}

impl ZTest {
    /// Whether there were tests and none rejects.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.tests > 0 && self.min_p >= self.threshold
    }
}

/// Tests the hypothesis that each pixel of both pictures has the same expected value. Variances are of the pixel
/// means, in the pictures' units squared; those of an exact reference are 0. `level` is the chance of rejecting
/// equal pictures, for example 0.01.
///
/// # Errors
/// [`SizeMismatch`] unless all four have the same length.
pub fn z_test(
    image: &[[f32; 3]],
    variance: &[[f32; 3]],
    reference: &[[f32; 3]],
    reference_variance: &[[f32; 3]],
    level: f64,
) -> Result<ZTest, SizeMismatch> {
    let n = image.len();
    if [variance.len(), reference.len(), reference_variance.len()] != [n; 3] {
        return Err(SizeMismatch { image: n, reference: reference.len(), width: n as u32, height: 1 });
    }
    let mut p_values = Vec::with_capacity(3 * n);
    for i in 0..n {
        for c in 0..3 {
            let difference = f64::from(image[i][c]) - f64::from(reference[i][c]);
            let (v, w) = (variance[i][c], reference_variance[i][c]);
            let sum = f64::from(v) + f64::from(w);
            if !difference.is_finite() || !sum.is_finite() || v < 0.0 || w < 0.0 {
                continue;
            }
            // Without variance the pictures must agree exactly.
            let z = if difference == 0.0 { 0.0 } else { difference / sum.sqrt() };
            p_values.push(normal_p_value(z));
        }
    }
    let tests = p_values.len();
    // 1 - (1 - level)^(1 / tests) without cancellation.
    let threshold = -((-level).ln_1p() / tests.max(1) as f64).exp_m1();
    let accepted = p_values.iter().filter(|p| **p >= threshold).count();
    Ok(ZTest {
        tests: tests as u64,
        skipped: (3 * n - tests) as u64,
        threshold,
        accepted: accepted as f64 / tests as f64,
        min_p: p_values.iter().copied().fold(f64::NAN, f64::min),
    })
}

/// Chance that a standard normal variable is at least as far from 0 as `z`: erfc(|z| / sqrt 2).
///
/// A series up to |z| = 2.8 and a continued fraction beyond (Abramowitz and Stegun 1964, 7.1.6 and 7.1.14); relative error
/// below 1e-12 until the result underflows.
#[must_use]
pub fn normal_p_value(z: f64) -> f64 {
    let x = z.abs() * FRAC_1_SQRT_2;
    if x.is_nan() {
        return f64::NAN;
    }
    let density = (-x * x).exp() / PI.sqrt();
    if x < 2.0 {
        // erf x = 2/sqrt(pi) exp(-x^2) sum of 2^n x^(2n+1) / (1 * 3 * ... (2n+1))
        let (mut term, mut sum, mut n) = (x, x, 1.0);
        while term > 1e-17 * sum {
            term *= 2.0 * x * x / (2.0 * n + 1.0);
            sum += term;
            n += 1.0;
        }
        return 1.0 - 2.0 * density * sum;
    }
    // sqrt(pi) exp(x^2) erfc x = 1/(x + (1/2)/(x + 1/(x + (3/2)/(x + ...)))), from the inside out.
    let fraction = (1..=100).rev().fold(x, |inner, k| x + f64::from(k) / 2.0 / inner);
    density / fraction
}
