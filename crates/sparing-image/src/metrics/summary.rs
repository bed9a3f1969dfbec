//! Mean and upper percentiles of a per-pixel difference.

/// Of values that are finite and not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// Arithmetic mean.
    pub mean: f64,
    /// 95th percentile, nearest rank: the smallest value that at least 95 % of the values do not exceed.
    pub p95: f64,
    /// 99th percentile, nearest rank.
    pub p99: f64,
    /// Largest value.
    pub max: f64,
}

impl Summary {
    /// Of these values; all NaN without any.
    #[must_use]
    pub fn of(mut values: Vec<f64>) -> Self {
        let n = values.len();
        if n == 0 {
            return Self { mean: f64::NAN, p95: f64::NAN, p99: f64::NAN, max: f64::NAN };
        }
        let mean = values.iter().sum::<f64>() / n as f64;
        let mut rank = |percent: usize| {
            let index = (n * percent).div_ceil(100).saturating_sub(1);
            *values.select_nth_unstable_by(index, f64::total_cmp).1
        };
        Self { mean, p95: rank(95), p99: rank(99), max: rank(100) }
    }
}
