//! What a render is to reach, and the threshold that reaches it.
//!
//! Policies that rank pixels continue while `spread / count` exceeds a threshold lambda, the square root of what one more
//! sample takes off the squared error. Marginal benefit, not the error itself: hopeless pixels would absorb the
//! budget. A goal in units is turned into lambda anew at every barrier, from what the pixels look like by then.

use crate::pooling::Plane;
use crate::view::{BLOCK_EXCESS, View};

/// What to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The predicted mean CIEDE2000 error of the pixels, in just noticeable differences; positive.
    Tolerance(f64),
    /// The average of samples per pixel; positive.
    Average(f64),
    /// The threshold itself.
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

/// Mean magnitude of a normal error with standard deviation 1.
const MEAN_OF_NORMAL: f64 = 0.798;
/// Pixels looked at, evenly spread, to find a threshold.
const SAMPLE: usize = 1 << 16;
const STEPS: usize = 50;

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
    sum / view.pixels.len().max(1) as f64 * MEAN_OF_NORMAL / BLOCK_EXCESS
}

/// One pixel as the search sees it.
struct Candidate {
    count: u32,
    spread: f64,
    error: f64,
}

impl Candidate {
    /// Samples in the end if lambda is the threshold.
    fn final_count(&self, lambda: f64, bounds: Bounds) -> u32 {
        let mut n = self.count.max(bounds.min_spp).max(1);
        while n < bounds.max_spp && self.spread > lambda * f64::from(n) {
            n = n.saturating_mul(2).min(bounds.max_spp);
        }
        n
    }
}

impl Goal {
    /// The threshold that is expected to reach the goal, given the spread of each pixel. Infinite where nothing more is
    /// needed, 0 where all that is allowed does not suffice.
    #[must_use]
    pub fn threshold(self, view: &View, spread: &Plane, bounds: Bounds) -> f64 {
        let stride = view.pixels.len().div_ceil(SAMPLE).max(1);
        let candidates: Vec<Candidate> = view
            .pixels
            .iter()
            .zip(&spread.values)
            .step_by(stride)
            .map(|(p, &s)| Candidate {
                count: p.count,
                spread: f64::from(s),
                error: f64::from(p.perceived_error) * MEAN_OF_NORMAL / BLOCK_EXCESS,
            })
            .collect();
        let mean = |f: &dyn Fn(&Candidate) -> f64| {
            candidates.iter().map(f).sum::<f64>() / candidates.len().max(1) as f64
        };
        // Whether lambda asks for too little: the error is above, the average below the goal.
        let too_lax = |lambda: f64| match self {
            Self::Threshold(_) => false,
            Self::Tolerance(t) => {
                mean(&|c| c.error * (f64::from(c.count) / f64::from(c.final_count(lambda, bounds))).sqrt())
                    > t
            }
            Self::Average(n) => mean(&|c| f64::from(c.final_count(lambda, bounds))) < n,
        };
        if let Self::Threshold(lambda) = self {
            return lambda;
        }
        if !too_lax(f64::INFINITY) {
            return f64::INFINITY;
        }
        if too_lax(0.0) {
            return 0.0;
        }
        let largest = candidates.iter().map(|c| c.spread).fold(0.0, f64::max);
        let (mut low, mut high) = (largest.max(f64::MIN_POSITIVE).log2() - 80.0, largest.log2() + 1.0);
        for _ in 0..STEPS {
            let middle = 0.5 * (low + high);
            if too_lax(middle.exp2()) { high = middle } else { low = middle }
        }
        low.exp2()
    }
}
