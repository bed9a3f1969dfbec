//! What a render is to reach, and the threshold that reaches it.
//!
//! Policies that rank pixels continue while `spread / count` exceeds a threshold lambda, the square root of what one more
//! sample takes off the squared error. Marginal benefit, not the error itself: hopeless pixels would absorb the
//! budget. A goal in units is turned into lambda anew at every barrier, from what the pixels look like by then.

use crate::pooling::Plane;
use crate::view::View;

/// What to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The predicted mean CIEDE2000 error of the pixels, in just noticeable differences; positive.
    Tolerance(f64),
    /// The average of samples per pixel; positive.
    Average(f64),
    /// The threshold itself; not negative.
    Threshold(f64),
}

/// Least and most samples of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// All pixels get these.
    pub min_spp: u32,
    /// No pixel gets more.
    pub max_spp: u32,
}

/// Pixels looked at, evenly spread, to find a threshold.
const SAMPLE: usize = 1 << 16;

/// Most samples of a plan over those of the first layer: the first layer cannot justify more, and one outlier must not send
/// all around it to the maximum.
const MOST_PLANNED: u32 = 64;

/// The least doubling of the minimum at which `spread / count` does not exceed lambda, within the bounds; at most
/// 64 times the minimum.
#[must_use]
pub fn planned(spread: f32, lambda: f64, bounds: Bounds) -> u32 {
    let first = bounds.min_spp.max(1).min(bounds.max_spp);
    let most = first.saturating_mul(MOST_PLANNED).min(bounds.max_spp);
    let mut n = first;
    while n < most && f64::from(spread) > lambda * f64::from(n) {
        n = n.saturating_mul(2).min(most);
    }
    n
}

/// The predicted mean CIEDE2000 error of the pixels as they are.
#[must_use]
pub fn predicted_error(view: &View) -> f64 {
    let sum: f64 = view.pixels.iter().map(|p| f64::from(p.perceived_error)).sum();
    sum / view.pixels.len().max(1) as f64 * view.error_scale
}

/// What pixels would do at every threshold: changes of a sum by the gain at which a pixel doubles. Bins are the bits of
/// the gain as f32, whose order is that of the numbers: 128 an octave, so that the threshold is found to 0.8 %.
struct Histogram {
    bins: Vec<f64>,
    /// The sum if no pixel goes on.
    start: f64,
    pixels: usize,
}

impl Histogram {
    const SHIFT: u32 = f32::MANTISSA_DIGITS - 1 - 7;

    fn new() -> Self {
        Self { bins: vec![0.0; (f32::INFINITY.to_bits() >> Self::SHIFT) as usize + 1], start: 0.0, pixels: 0 }
    }

    /// Adds a pixel that has `count` samples and this spread: `value` gives its part of the sum at a count.
    fn add(&mut self, count: u32, spread: f32, bounds: Bounds, value: impl Fn(u32) -> f64) {
        let mut n = count.max(bounds.min_spp).max(1);
        let mut last = value(n);
        self.start += last;
        self.pixels += 1;
        while n < bounds.max_spp && spread > 0.0 {
            let gain = spread / n as f32;
            n = n.saturating_mul(2).min(bounds.max_spp);
            let next = value(n);
            self.bins[(gain.to_bits() >> Self::SHIFT) as usize] += next - last;
            last = next;
        }
    }

    /// The largest threshold at which the mean has passed `goal`, from above if `falling`.
    fn threshold(&self, goal: f64, falling: bool) -> f64 {
        let goal = goal * self.pixels as f64;
        let reached = |sum: f64| if falling { sum <= goal } else { sum >= goal };
        let mut sum = self.start;
        if reached(sum) {
            return f64::INFINITY;
        }
        for (bin, change) in self.bins.iter().enumerate().rev() {
            sum += change;
            if reached(sum) {
                return f32::from_bits((bin as u32) << Self::SHIFT).into();
            }
        }
        0.0
    }
}

impl Goal {
    /// Whether an audit helps to reach it.
    #[must_use]
    pub fn wants_audit(self) -> bool {
        matches!(self, Self::Tolerance(_))
    }

    /// The threshold that is expected to reach the goal, given the spread of each pixel. Infinite where nothing more is
    /// needed, 0 where all that is allowed does not suffice.
    #[must_use]
    pub fn threshold(self, view: &View, spread: &Plane, bounds: Bounds) -> f64 {
        let stride = view.pixels.len().div_ceil(SAMPLE).max(1);
        let candidates = view.pixels.iter().zip(&spread.values).step_by(stride);
        let mut histogram = Histogram::new();
        match self {
            // What is undefined counts as 0: nobody stops by it.
            Self::Threshold(lambda) => lambda.max(0.0),
            Self::Tolerance(t) => {
                for (p, &spread) in candidates {
                    let error = f64::from(p.perceived_error) * view.error_scale * f64::from(p.count).sqrt();
                    histogram.add(p.count, spread, bounds, |n| error / f64::from(n).sqrt());
                }
                histogram.threshold(t, true)
            }
            Self::Average(n) => {
                for (p, &spread) in candidates {
                    histogram.add(p.count, spread, bounds, f64::from);
                }
                histogram.threshold(n, false)
            }
        }
    }
}
