//! Filter importance sampling (M. Ernst, M. Stamminger, G. Greiner 2006): positions are drawn in proportion
//! to the absolute value of the pixel filter, so that every sample belongs to one pixel and has weight ±w.

use sparing_scene::description::PixelFilter;

const CELLS: usize = 256;

/// A separable pixel filter, ready to sample.
#[derive(Clone, Debug)]
pub struct FilterSampler {
    axes: [Axis; 2],
}

#[derive(Clone, Debug)]
enum Axis {
    Box { radius: f32 },
    Triangle { radius: f32 },
    Table(Box<Table>),
}

#[derive(Clone, Debug)]
struct Table {
    radius: f32,
    /// Cumulative share of |f| at cell borders.
    cdf: [f32; CELLS + 1],
    /// Sign of f in each cell times the integral of |f| over that of f.
    weight: [f32; CELLS],
}

impl FilterSampler {
    /// Prepares a filter; radii must be positive.
    #[must_use]
    pub fn new(filter: PixelFilter) -> Self {
        let axis = |i: usize| match filter {
            PixelFilter::Box { radius } => Axis::Box { radius: radius[i] },
            PixelFilter::Triangle { radius } => Axis::Triangle { radius: radius[i] },
            PixelFilter::Gaussian { radius, sigma } => {
                let edge = gaussian(radius[i], sigma);
                tabulate(radius[i], |x| (gaussian(x, sigma) - edge).max(0.0))
            }
            PixelFilter::BlackmanHarris { radius } => {
                let r = radius[i];
                tabulate(r, |x| blackman_harris(x / r))
            }
            PixelFilter::Mitchell { radius, b, c } => {
                let r = radius[i];
                tabulate(r, |x| mitchell(2.0 * x / r, b, c))
            }
        };
        Self { axes: [axis(0), axis(1)] }
    }

    /// Offset from the pixel's centre in pixels, and the weight of the sample.
    #[inline]
    #[must_use]
    pub fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        let (x, wx) = self.axes[0].sample(u[0]);
        let (y, wy) = self.axes[1].sample(u[1]);
        ([x, y], wx * wy)
    }

    /// Filter value, normalised to integrate to 1, at an offset along one axis (for tests and plots).
    #[must_use]
    pub fn value(&self, axis: usize, x: f32) -> f32 {
        self.axes[axis].value(x)
    }
}

impl Axis {
    #[inline]
    fn sample(&self, u: f32) -> (f32, f32) {
        match self {
            Self::Box { radius } => (radius * (2.0 * u - 1.0), 1.0),
            Self::Triangle { radius } => {
                let x = if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 * (1.0 - u)).sqrt() };
                (radius * x, 1.0)
            }
            Self::Table(t) => t.sample(u),
        }
    }

    fn value(&self, x: f32) -> f32 {
        match self {
            Self::Box { radius } => {
                if x.abs() <= *radius { 0.5 / radius } else { 0.0 }
            }
            Self::Triangle { radius } => (1.0 - x.abs() / radius).max(0.0) / radius,
            Self::Table(t) => {
                let cell = ((x / t.radius + 1.0) * 0.5 * CELLS as f32).floor();
                if !(0.0..CELLS as f32).contains(&cell) {
                    return 0.0;
                }
                let i = cell as usize;
                (t.cdf[i + 1] - t.cdf[i]) * CELLS as f32 / (2.0 * t.radius) * t.weight[i]
            }
        }
    }
}

impl Table {
    #[inline]
    fn sample(&self, u: f32) -> (f32, f32) {
        let i = self.cdf.partition_point(|c| *c <= u).clamp(1, CELLS) - 1;
        let width = self.cdf[i + 1] - self.cdf[i];
        let within = if width > 0.0 { ((u - self.cdf[i]) / width).clamp(0.0, 1.0) } else { 0.5 };
        let x = ((i as f32 + within) / CELLS as f32 * 2.0 - 1.0) * self.radius;
        (x, self.weight[i])
    }
}

fn tabulate(radius: f32, f: impl Fn(f32) -> f32) -> Axis {
    let mut cdf = [0.0f32; CELLS + 1];
    let mut weight = [0.0f32; CELLS];
    let (mut absolute, mut signed) = (0.0f64, 0.0f64);
    for i in 0..CELLS {
        let x = ((i as f32 + 0.5) / CELLS as f32 * 2.0 - 1.0) * radius;
        let v = f64::from(f(x));
        absolute += v.abs();
        signed += v;
        cdf[i + 1] = absolute as f32;
        weight[i] = if v < 0.0 { -1.0 } else { 1.0 };
    }
    for c in &mut cdf {
        *c = (f64::from(*c) / absolute) as f32;
    }
    cdf[CELLS] = 1.0;
    for w in &mut weight {
        *w *= (absolute / signed) as f32;
    }
    Axis::Table(Box::new(Table { radius, cdf, weight }))
}

fn gaussian(x: f32, sigma: f32) -> f32 {
    (-x * x / (2.0 * sigma * sigma)).exp()
}

/// Four-term Blackman-Harris window on -1..1 (F. Harris 1978).
fn blackman_harris(x: f32) -> f32 {
    let t = std::f32::consts::PI * (x + 1.0);
    0.358_75 - 0.488_29 * t.cos() + 0.141_28 * (2.0 * t).cos() - 0.011_68 * (3.0 * t).cos()
}

/// D. Mitchell and A. Netravali 1988, eq. 8, on -2..2.
fn mitchell(x: f32, b: f32, c: f32) -> f32 {
    let x = x.abs();
    if x <= 1.0 {
        ((12.0 - 9.0 * b - 6.0 * c) * x.powi(3) + (-18.0 + 12.0 * b + 6.0 * c) * x * x + (6.0 - 2.0 * b)) / 6.0
    } else if x <= 2.0 {
        ((-b - 6.0 * c) * x.powi(3)
            + (6.0 * b + 30.0 * c) * x * x
            + (-12.0 * b - 48.0 * c) * x
            + (8.0 * b + 24.0 * c))
            / 6.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::sobol::owen_sobol_2d;

    fn all() -> Vec<(&'static str, PixelFilter)> {
        vec![
            ("box", PixelFilter::Box { radius: [0.5, 1.0] }),
            ("triangle", PixelFilter::Triangle { radius: [2.0, 1.0] }),
            ("gaussian", PixelFilter::Gaussian { radius: [1.5, 2.0], sigma: 0.5 }),
            ("blackman-harris", PixelFilter::BlackmanHarris { radius: [1.5, 1.5] }),
            ("mitchell", PixelFilter::Mitchell { radius: [2.0, 2.0], b: 1.0 / 3.0, c: 1.0 / 3.0 }),
        ]
    }

    #[test]
    fn samples_follow_the_filter() {
        for (name, filter) in all() {
            let f = FilterSampler::new(filter);
            for axis in 0..2 {
                let bins = 40;
                let (lo, hi) = (-2.0f32, 2.0f32);
                let mut sums = vec![0.0f64; bins];
                let n = 1 << 16;
                for i in 0..n {
                    let u = owen_sobol_2d(i, 9).map(|b| (b >> 8) as f32 / 16_777_216.0);
                    let (p, w) = f.sample(u);
                    assert!(p[axis] >= lo && p[axis] <= hi, "{name}");
                    let b = ((p[axis] - lo) / (hi - lo) * bins as f32) as usize;
                    sums[b.min(bins - 1)] += f64::from(w) / f64::from(n);
                }
                let steps = 1000;
                for (b, s) in sums.iter().enumerate() {
                    let h = (hi - lo) / (bins * steps) as f32;
                    let expected: f64 = (0..steps)
                        .map(|k| lo + ((b * steps + k) as f32 + 0.5) * h)
                        .map(|x| f64::from(f.value(axis, x) * h))
                        .sum();
                    assert!((s - expected).abs() < 2e-3, "{name} axis {axis} bin {b}: {s} vs {expected}");
                }
            }
        }
    }

    #[test]
    fn weights_average_to_one_and_only_mitchell_is_negative() {
        for (name, filter) in all() {
            let f = FilterSampler::new(filter);
            let n = 1 << 14;
            let mut negative = 0;
            let mean: f64 = (0..n)
                .map(|i| {
                    let w = f.sample(owen_sobol_2d(i, 3).map(|b| (b >> 8) as f32 / 16_777_216.0)).1;
                    negative += u32::from(w < 0.0);
                    f64::from(w)
                })
                .sum::<f64>()
                / f64::from(n);
            assert!((mean - 1.0).abs() < 2e-3, "{name}: {mean}");
            assert_eq!(negative > 0, name == "mitchell");
        }
    }

    #[test]
    fn mitchell_values_from_the_paper() {
        // B = C = 1/3: k(0) = 8/9, k(1) = 1/18, k(2) = 0.
        let third = 1.0 / 3.0;
        assert!((mitchell(0.0, third, third) - 8.0 / 9.0).abs() < 1e-6);
        assert!((mitchell(1.0, third, third) - 1.0 / 18.0).abs() < 1e-6);
        assert!(mitchell(2.0, third, third).abs() < 1e-6);
    }
}
