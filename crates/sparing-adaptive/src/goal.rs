//! What a render is to reach, and the threshold that reaches it.
//!
//! Policies that rank pixels continue while `spread / count` exceeds a threshold lambda, the square root of what one more
//! sample takes off the squared error. Marginal benefit, not the error itself: hopeless pixels would absorb the
//! budget. A goal in units is turned into lambda anew at every barrier, from what the pixels look like by then.

use crate::pooling::Plane;
use crate::view::View;
use std::ops::Range;

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
const SAMPLE: usize = 1 << 14;

/// Share of the way to a goal that a layer is to lead, and the share of the samples from which on it leads all of it.
const WAY: f64 = 0.5;
const LITTLE_LEFT: f64 = 0.95;
/// An average of samples is reached to this.
const REACHED: f64 = 0.995;

/// Most samples of a plan over those of the first layer: the first layer cannot justify more, and one outlier must not send
/// all around it to the maximum.
const MOST_PLANNED: u32 = 64;

/// The least doubling of the minimum at which `spread / count` does not exceed lambda, within the bounds; at most
/// 64 times the minimum.
#[must_use]
pub fn planned(spread: f32, lambda: f64, bounds: Bounds) -> u32 {
    let most = most_planned(bounds);
    let mut n = bounds.min_spp.max(1).min(bounds.max_spp);
    while n < most && f64::from(spread) > lambda * f64::from(n) {
        n = n.saturating_mul(2).min(most);
    }
    n
}

/// Most samples of any plan.
pub(crate) fn most_planned(bounds: Bounds) -> u32 {
    bounds.min_spp.max(1).saturating_mul(MOST_PLANNED).min(bounds.max_spp)
}

/// Samples of all pixels.
fn samples(view: &View) -> f64 {
    view.pixels.iter().map(|p| f64::from(p.count)).sum()
}

/// The predicted mean CIEDE2000 error of the pixels as they are.
#[must_use]
pub fn predicted_error(view: &View) -> f64 {
    let sum: f64 = view.pixels.iter().map(|p| f64::from(p.perceived_error)).sum();
    sum / view.pixels.len().max(1) as f64 * view.error_scale
}

/// What pixels would do at every threshold: changes of a sum by the gain at which a pixel doubles. Bins are the bits of
/// the gain as f32, whose order is that of the numbers: 128 an octave, so that the threshold is found to 0.8 %.
///
/// With each doubling of a pixel the gain halves, which is an octave of bins, and the change of the sum is `ratio` times the one before.
/// So only where a pixel's doublings begin and end is written down.
struct Histogram {
    bins: Vec<f64>,
    /// Those that hold anything.
    used: Range<usize>,
    ratio: f64,
    /// The sum if no pixel goes on.
    start: f64,
    pixels: usize,
}

impl Histogram {
    const SHIFT: u32 = f32::MANTISSA_DIGITS - 1 - 7;
    const OCTAVE: usize = 1 << 7;

    fn new(ratio: f64) -> Self {
        let bins = vec![0.0; (f32::INFINITY.to_bits() >> Self::SHIFT) as usize + 1];
        Self { used: bins.len()..0, bins, ratio, start: 0.0, pixels: 0 }
    }

    /// Adds a pixel that has `count` samples and this spread: `value` gives its part of the sum at a count, and must change
    /// by `ratio` as much with each doubling.
    fn add(&mut self, count: u32, spread: f32, bounds: Bounds, value: impl Fn(f64) -> f64) {
        let n = count.max(bounds.min_spp).max(1);
        let now = value(f64::from(n));
        self.start += now;
        self.pixels += 1;
        if n >= bounds.max_spp || spread <= 0.0 {
            return;
        }
        let doublings = (bounds.max_spp / n).ilog2();
        let most = value(f64::from(bounds.max_spp));
        let first = ((spread / n as f32).to_bits() >> Self::SHIFT) as usize;
        // A gain that no f32 holds is none.
        let Some(last) = first.checked_sub(doublings as usize * Self::OCTAVE) else { return };
        let reached = f64::from(n) * f64::from(1_u32 << doublings);
        if doublings == 0 {
            self.bins[first] += most - now;
        } else {
            self.bins[first] += value(2.0 * f64::from(n)) - now;
            // What is left up to the most, in place of another doubling.
            self.bins[last] += most - value(2.0 * reached);
        }
        // And nothing after it.
        if let Some(after) = last.checked_sub(Self::OCTAVE) {
            self.bins[after] -= self.ratio * (most - value(reached));
        }
        self.used = self.used.start.min(last.saturating_sub(Self::OCTAVE))..self.used.end.max(first + 1);
    }

    /// The largest thresholds at which the mean has passed each goal, from above if `falling`.
    fn thresholds<const N: usize>(mut self, goals: [f64; N], falling: bool) -> [f64; N] {
        for bin in self.used.clone().rev() {
            self.bins[bin] += self.ratio * self.bins.get(bin + Self::OCTAVE).copied().unwrap_or(0.0);
        }
        goals.map(|goal| {
            let goal = goal * self.pixels as f64;
            let reached = |sum: f64| if falling { sum <= goal } else { sum >= goal };
            let mut sum = self.start;
            if reached(sum) {
                return f64::INFINITY;
            }
            for bin in self.used.clone().rev() {
                sum += self.bins[bin];
                if reached(sum) {
                    return f32::from_bits((bin as u32) << Self::SHIFT).into();
                }
            }
            0.0
        })
    }
}

impl Goal {
    /// Whether an audit helps to reach it.
    #[must_use]
    pub fn wants_audit(self) -> bool {
        matches!(self, Self::Tolerance(_))
    }

    /// The threshold for the next layer, given the spread of each pixel, and that for all of the goal. The first is expected to lead half
    /// of the way, until little is left. What has not been found yet, such as rare bright light, asks for samples later, and
    /// those that are spent cannot be taken back; a pixel that stops too early goes on at a later barrier. Infinite where
    /// nothing more is needed, 0 where all that is allowed does not suffice.
    #[must_use]
    pub fn thresholds(self, view: &View, spread: &Plane, bounds: Bounds) -> [f64; 2] {
        let whole = match self {
            Self::Average(n) => Self::Average(REACHED * n),
            goal => goal,
        };
        whole.expected([whole.half_way(view), whole], view, spread, bounds)
    }

    /// Samples that are expected to reach the goal; 0 where it is reached, and where it is a threshold.
    pub(crate) fn samples_left(self, view: &View) -> f64 {
        let now = samples(view);
        let left = match self {
            Self::Threshold(_) => 0.0,
            Self::Average(n) => REACHED * n * view.pixels.len() as f64 - now,
            Self::Tolerance(t) => now * ((predicted_error(view) / t).powi(2) - 1.0),
        };
        if left > 0.0 { left } else { 0.0 }
    }

    /// Samples that the next layer may take: an average is never exceeded, but may be reached in full, so that what fits is well
    /// within [`REACHED`] and no barrier follows for the sake of a few pixels.
    pub(crate) fn samples_allowed(self, view: &View) -> f64 {
        match self {
            Self::Average(n) => n * view.pixels.len() as f64 - samples(view),
            goal => goal.samples_left(view),
        }
    }

    /// The goal for the next layer.
    fn half_way(self, view: &View) -> Self {
        let half = |goal: f64, now: f64| {
            if now > LITTLE_LEFT * goal { goal } else { now + WAY * (goal - now) }
        };
        match self {
            Self::Threshold(_) => self,
            Self::Average(n) => Self::Average(half(n, samples(view) / view.pixels.len().max(1) as f64)),
            // Samples are as one over the square of the error.
            Self::Tolerance(t) => {
                let error = predicted_error(view);
                let aim = half(1.0 / (t * t), 1.0 / (error * error)).sqrt().recip();
                Self::Tolerance(if aim.is_finite() { aim.max(t) } else { t })
            }
        }
    }

    /// The threshold that is expected to reach the goal, if the spread of each pixel stays as it is.
    #[must_use]
    pub fn expected_threshold(self, view: &View, spread: &Plane, bounds: Bounds) -> f64 {
        self.expected([self], view, spread, bounds)[0]
    }

    /// The same for several goals of this kind.
    fn expected<const N: usize>(
        self,
        goals: [Self; N],
        view: &View,
        spread: &Plane,
        bounds: Bounds,
    ) -> [f64; N] {
        let stride = view.pixels.len().div_ceil(SAMPLE).max(1);
        let pixels = || view.pixels.iter().zip(&spread.values).step_by(stride);
        match self {
            // What is undefined counts as 0: nobody stops by it.
            Self::Threshold(_) => goals.map(|goal| goal.number().max(0.0)),
            Self::Average(_) => {
                let mut histogram = Histogram::new(2.0);
                pixels().for_each(|(p, spread)| histogram.add(p.count, *spread, bounds, |n| n));
                histogram.thresholds(goals.map(Self::number), false)
            }
            Self::Tolerance(_) => {
                let mut histogram = Histogram::new(std::f64::consts::FRAC_1_SQRT_2);
                for (p, spread) in pixels() {
                    let error = f64::from(p.perceived_error) * view.error_scale * f64::from(p.count).sqrt();
                    histogram.add(p.count, *spread, bounds, |n| error / n.sqrt());
                }
                histogram.thresholds(goals.map(Self::number), true)
            }
        }
    }

    fn number(self) -> f64 {
        let (Self::Threshold(x) | Self::Average(x) | Self::Tolerance(x)) = self;
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Statistics;

    fn view(counts: &[u32], perceived_error: f32) -> View {
        let pixels = counts.iter().map(|&count| Statistics { count, perceived_error, ..Statistics::EMPTY });
        View { width: counts.len(), height: 1, exposure: 1.0, error_scale: 1.0, pixels: pixels.collect() }
    }

    #[test]
    fn a_layer_leads_half_of_the_way_until_little_is_left() {
        let next = |goal: Goal, counts: &[u32], error| goal.half_way(&view(counts, error));
        assert_eq!(next(Goal::Average(64.0), &[8, 8], 1.0), Goal::Average(36.0));
        assert_eq!(next(Goal::Average(64.0), &[8, 64], 1.0), Goal::Average(50.0));
        for counts in [[60, 62], [64, 64], [64, 512]] {
            assert_eq!(next(Goal::Average(64.0), &counts, 1.0), Goal::Average(64.0));
        }
        // An error of 2 with a quarter of the samples that an error of 1 takes: half of the way is 2.5 quarters.
        let Goal::Tolerance(t) = next(Goal::Tolerance(1.0), &[8], 2.0) else { panic!("another goal") };
        assert!((t - (1.0_f64 / 0.625).sqrt()).abs() < 1e-12, "{t}");
        for error in [0.0, 0.5, 1.0, 1.01] {
            assert_eq!(next(Goal::Tolerance(1.0), &[8], error), Goal::Tolerance(1.0));
        }
        assert_eq!(next(Goal::Threshold(0.3), &[8], 2.0), Goal::Threshold(0.3));
    }

    /// What [`Histogram`] shortens: all doublings of all pixels, the largest gain first.
    fn threshold_by_sorting(pixels: &[(u32, f32, f64)], bounds: Bounds, goal: f64, falling: bool) -> f64 {
        let value = |error: f64, n: u32| if falling { error / f64::from(n).sqrt() } else { n.into() };
        let mut sum: f64 = pixels.iter().map(|(n, _, e)| value(*e, *n)).sum();
        let mut changes = Vec::new();
        for &(count, spread, error) in pixels {
            let mut n = count;
            while n < bounds.max_spp && spread > 0.0 {
                let next = n.saturating_mul(2).min(bounds.max_spp);
                changes.push((spread / n as f32, value(error, next) - value(error, n)));
                n = next;
            }
        }
        changes.sort_by(|a, b| b.0.total_cmp(&a.0));
        let goal = goal * pixels.len() as f64;
        let reached = |sum: f64| if falling { sum <= goal } else { sum >= goal };
        if reached(sum) {
            return f64::INFINITY;
        }
        for (gain, change) in changes {
            sum += change;
            if reached(sum) {
                return gain.into();
            }
        }
        0.0
    }

    #[test]
    fn thresholds_are_those_of_all_doublings_sorted() {
        let mut random = testkit::svm_data::Random::new(5);
        for max_spp in [64, 100, 1000, 4096] {
            let bounds = Bounds { min_spp: 8, max_spp };
            for _ in 0..20 {
                let pixel = |_| {
                    let count = (8_u32 << (random.uniform() * 6.0) as u32).min(max_spp);
                    let spread = if random.uniform() < 0.1 {
                        0.0
                    } else {
                        10_f32.powf(random.uniform() as f32 * 8.0 - 4.0)
                    };
                    (count, spread, 0.2 * f64::from(spread))
                };
                let pixels: Vec<(u32, f32, f64)> = (0..500).map(pixel).collect();
                for falling in [false, true] {
                    let mut histogram =
                        Histogram::new(if falling { std::f64::consts::FRAC_1_SQRT_2 } else { 2.0 });
                    for &(count, spread, error) in &pixels {
                        histogram.add(count, spread, bounds, |n| if falling { error / n.sqrt() } else { n });
                    }
                    let [start, pixels_added] = [histogram.start, histogram.pixels as f64];
                    let goals = [0.0, 0.01, 0.5, 0.9, 1.1, 2.0, 8.0, 1e9].map(|f| f * start / pixels_added);
                    for (found, goal) in histogram.thresholds(goals, falling).into_iter().zip(goals) {
                        let sorted = threshold_by_sorting(&pixels, bounds, goal, falling);
                        // A bin begins at most 0.8 % below what is in it.
                        let same = found == sorted || (found <= sorted && found >= sorted / 1.008);
                        assert!(same, "{max_spp} {falling} {goal}: {found} {sorted}");
                    }
                }
            }
        }
    }

    #[test]
    fn extreme_goals_stay_what_they_are() {
        for (goal, error) in [
            (Goal::Average(1e-9), 1.0),
            (Goal::Average(f64::INFINITY), 1.0),
            (Goal::Tolerance(f64::INFINITY), 1.0),
            (Goal::Tolerance(0.0), 1.0),
            (Goal::Tolerance(0.0), 0.0),
            (Goal::Tolerance(f64::MIN_POSITIVE), f32::MAX),
        ] {
            let next = goal.half_way(&view(&[8, 16], error));
            let (Goal::Average(x) | Goal::Tolerance(x) | Goal::Threshold(x)) = next;
            assert!(x >= 0.0, "{goal:?} {error}: {next:?}");
        }
    }
}
