//! Pearson's chi-square test of a direction sampler against its density.
//!
//! Bins are equal in solid angle (cos theta x phi) over the whole sphere. Expected counts integrate the
//! density over each bin by adaptive quadrature; bins that expect fewer than five are pooled. The idea is
//! that of nori's chi2test (W. Jakob) and of pbrt-v4's BSDF tests.

use crate::special::chi_square_tail;
use glam::DVec3;
use std::f64::consts::PI;

/// Resolution and sample count.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Bins along cos theta. Even, so that no bin straddles the horizon.
    pub rows: usize,
    /// Bins along phi.
    pub columns: usize,
    /// Samples.
    pub samples: usize,
    /// Level of one test; divide by the number of tests (Bonferroni).
    pub level: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { rows: 20, columns: 20, samples: 200_000, level: 1e-5 }
    }
}

/// Runs the test. `sample(i)` gives the i-th unit direction or `None` for a failed sample (counted as mass
/// outside the sphere); `pdf` is its density per steradian.
///
/// # Errors
/// A message when the density integrates to more than 1 (by 0.5 %), is negative or not finite, or when the
/// histogram differs from it at the level asked for.
pub fn test_directions(
    settings: Settings,
    mut sample: impl FnMut(usize) -> Option<DVec3>,
    pdf: impl Fn(DVec3) -> f64,
) -> Result<f64, String> {
    let (rows, columns) = (settings.rows, settings.columns);
    let mut observed = vec![0.0; rows * columns];
    for i in 0..settings.samples {
        let Some(w) = sample(i) else { continue };
        if !w.is_finite() || (w.length() - 1.0).abs() > 1e-4 {
            return Err(format!("sample {i} is not a unit vector: {w}"));
        }
        let row = ((w.z + 1.0) * 0.5 * rows as f64) as usize;
        let phi = w.y.atan2(w.x).rem_euclid(2.0 * PI);
        let column = (phi / (2.0 * PI) * columns as f64) as usize;
        observed[row.min(rows - 1) * columns + column.min(columns - 1)] += 1.0;
    }
    let mut expected = vec![0.0; rows * columns];
    for (bin, e) in expected.iter_mut().enumerate() {
        let (row, column) = (bin / columns, bin % columns);
        let z = [row, row + 1].map(|r| 2.0 * r as f64 / rows as f64 - 1.0);
        let phi = [column, column + 1].map(|c| 2.0 * PI * c as f64 / columns as f64);
        let density = |z: f64, phi: f64| {
            let r = (1.0 - z * z).max(0.0).sqrt();
            pdf(DVec3::new(r * phi.cos(), r * phi.sin(), z))
        };
        *e = integrate(&density, z, phi) * settings.samples as f64;
        if !(*e >= 0.0 && e.is_finite()) {
            return Err(format!("the density integrates to {e} over bin {bin}"));
        }
    }
    let total: f64 = expected.iter().sum::<f64>() / settings.samples as f64;
    if total > 1.005 {
        return Err(format!("the density integrates to {total}"));
    }
    compare(&observed, &expected, settings.samples as f64, settings.level)
}

/// Compares a histogram with expected counts; what is missing from either up to `samples` is one more bin.
///
/// # Errors
/// A message when they differ at `level`.
pub fn compare(observed: &[f64], expected: &[f64], samples: f64, level: f64) -> Result<f64, String> {
    let missing_o = samples - observed.iter().sum::<f64>();
    let missing_e = (samples - expected.iter().sum::<f64>()).max(0.0);
    let mut bins: Vec<(f64, f64)> = expected.iter().copied().zip(observed.iter().copied()).collect();
    bins.push((missing_e, missing_o));
    bins.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut statistic, mut dof) = (0.0, 0usize);
    let (mut pool_e, mut pool_o) = (0.0, 0.0);
    for (e, o) in bins {
        pool_e += e;
        pool_o += o;
        if pool_e >= 5.0 {
            statistic += (pool_o - pool_e).powi(2) / pool_e;
            dof += 1;
            (pool_e, pool_o) = (0.0, 0.0);
        }
    }
    // A remainder that expects next to nothing must hold next to nothing (quadrature error aside).
    if pool_o > 10.0 + 10.0 * pool_e + 1e-4 * samples {
        return Err(format!("{pool_o} samples where {pool_e:.3} were expected"));
    }
    if dof < 2 {
        return Ok(1.0);
    }
    let p = chi_square_tail(statistic, dof - 1);
    if p < level {
        let message = format!("chi-square {statistic:.1} with {} degrees of freedom: p = {p:.2e}", dof - 1);
        return Err(message);
    }
    Ok(p)
}

/// Adaptive tensor Gauss-Legendre quadrature over a rectangle.
pub fn integrate(f: &impl Fn(f64, f64) -> f64, x: [f64; 2], y: [f64; 2]) -> f64 {
    adapt(f, x, y, gauss(f, x, y), 0)
}

fn adapt(f: &impl Fn(f64, f64) -> f64, x: [f64; 2], y: [f64; 2], whole: f64, depth: u32) -> f64 {
    let (mx, my) = ((x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0);
    let parts = [
        ([x[0], mx], [y[0], my]),
        ([mx, x[1]], [y[0], my]),
        ([x[0], mx], [my, y[1]]),
        ([mx, x[1]], [my, y[1]]),
    ];
    let values = parts.map(|(px, py)| gauss(f, px, py));
    let sum: f64 = values.iter().sum();
    if depth >= 9 || (depth >= 2 && (sum - whole).abs() <= 1e-6 + 1e-5 * sum.abs()) {
        return sum;
    }
    parts.iter().zip(values).map(|((px, py), v)| adapt(f, *px, *py, v, depth + 1)).sum()
}

fn gauss(f: &impl Fn(f64, f64) -> f64, x: [f64; 2], y: [f64; 2]) -> f64 {
    const NODES: [(f64, f64); 3] =
        [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];
    let (cx, hx) = ((x[0] + x[1]) / 2.0, (x[1] - x[0]) / 2.0);
    let (cy, hy) = ((y[0] + y[1]) / 2.0, (y[1] - y[0]) / 2.0);
    let mut sum = 0.0;
    for (nx, wx) in NODES {
        for (ny, wy) in NODES {
            sum += wx * wy * f(cx + hx * nx, cy + hy * ny);
        }
    }
    sum * hx * hy
}
