//! Filter importance sampling (M. Ernst, M. Stamminger, G. Greiner 2006): positions are drawn in proportion
//! to the absolute value of the pixel filter, so that every sample belongs to one pixel and has weight ±w.

use sparing_scene::description::PixelFilter;

/// Equal shares of |f|; within each, samples are even.
const CELLS: usize = 1024;
/// Resolution at which filters are integrated, per share.
const FINE: usize = 16;

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
    /// Borders of the shares: the inverse of the cumulative |f|.
    borders: [f32; CELLS + 1],
    /// Sign of f in each share times the integral of |f| over that of f.
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
                if x.abs() <= *radius {
                    0.5 / radius
                } else {
                    0.0
                }
            }
            Self::Triangle { radius } => (1.0 - x.abs() / radius).max(0.0) / radius,
            Self::Table(t) => {
                let i = t.borders.partition_point(|b| *b <= x);
                if i == 0 || i > CELLS {
                    return 0.0;
                }
                t.weight[i - 1] / (CELLS as f32 * (t.borders[i] - t.borders[i - 1]))
            }
        }
    }
}

impl Table {
    #[inline]
    fn sample(&self, u: f32) -> (f32, f32) {
        let x = u * CELLS as f32;
        let i = (x as usize).min(CELLS - 1);
        let (a, b) = (self.borders[i], self.borders[i + 1]);
        (a + (x - i as f32) * (b - a), self.weight[i])
    }
}

fn tabulate(radius: f32, f: impl Fn(f32) -> f32) -> Axis {
    let n = CELLS * FINE;
    let step = 2.0 * f64::from(radius) / n as f64;
    let position = |i: usize| -f64::from(radius) + i as f64 * step;
    let values: Vec<f64> = (0..n).map(|i| f64::from(f((position(i) + 0.5 * step) as f32))).collect();
    let absolute: f64 = values.iter().map(|v| v.abs()).sum();
    let signed: f64 = values.iter().sum();
    let mut borders = [radius; CELLS + 1];
    borders[0] = -radius;
    let (mut next, mut sum) = (1, 0.0);
    for (i, v) in values.iter().enumerate() {
        let before = sum;
        sum += v.abs();
        while next < CELLS && sum >= absolute * next as f64 / CELLS as f64 {
            let share = (absolute * next as f64 / CELLS as f64 - before) / v.abs();
            borders[next] = (position(i) + share * step) as f32;
            next += 1;
        }
    }
    let norm = (absolute / signed) as f32;
    let sign = |i: usize| if f(0.5 * (borders[i] + borders[i + 1])) < 0.0 { -norm } else { norm };
    let weight = std::array::from_fn(sign);
    Axis::Table(Box::new(Table { borders, weight }))
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
        ((12.0 - 9.0 * b - 6.0 * c) * x.powi(3) + (-18.0 + 12.0 * b + 6.0 * c) * x * x + (6.0 - 2.0 * b))
            / 6.0
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
