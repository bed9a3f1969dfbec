//! What a render remembers so that choosing pixels by their samples takes little light away.
//!
//! A pixel whose samples happen to be bright looks noisy, is sampled on and comes down; one whose samples happen to be dark stops
//! and stays. Dark places lit by few bright samples come out too dark, by a third in the worst of our scenes. The cure:
//!
//! - The *plan* of a pixel is a number of samples set by its neighbours in the first layer and by the thresholds so far. Its mean at
//!   that number is unbiased: its own samples had no say. Every pixel gets at least its plan.
//! - A pixel that goes on beyond its plan, by its own samples, has its means noted on the way.
//! - In the end, the difference between the mean by plan and the final mean is spread over the neighbourhood, in
//!   proportion to how uncertain the pixels are: sums over neighbourhoods are those of the plan, and so unbiased, but for
//!   the bound that [`spread_out`] puts on what a pixel may change.
//!
//! So an outlier is sampled on, and its light goes to where it belongs, its neighbourhood.

use crate::goal::{Bounds, most_planned};
use crate::policy::Decisions;
use crate::pooling::Plane;
use crate::redistribute::spread_out;
use crate::view::View;
use sparing_image::film::Film;
use std::sync::OnceLock;

/// Mean of a pixel at a barrier that it passed beyond its plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passed {
    /// Index, in rows.
    pub pixel: u32,
    /// Samples that it had.
    pub count: u32,
    /// Mean radiance then.
    pub mean: [f32; 3],
}

/// See the module. One a render, empty at first.
#[derive(Clone, Debug, Default)]
pub struct Ledger {
    plan: OnceLock<Plane>,
    lambdas: Vec<f64>,
    passed: Vec<Passed>,
}

/// Samples that a plan has come to if each barrier doubled them where the neighbours' spread over them exceeded its threshold.
fn carried_out(lambdas: &[f64], spread: f32, bounds: Bounds) -> u32 {
    let most = most_planned(bounds);
    let first = bounds.min_spp.max(1).min(bounds.max_spp);
    lambdas.iter().fold(first, |n, lambda| {
        if n < most && f64::from(spread) > lambda * f64::from(n) { n.saturating_mul(2).min(most) } else { n }
    })
}

impl Ledger {
    /// A ledger as it was: what [`Ledger::parts`] and [`Ledger::lambdas`] gave.
    #[must_use]
    pub fn from_parts(plan: Option<Plane>, lambdas: Vec<f64>, passed: Vec<Passed>) -> Self {
        Self { plan: plan.map(OnceLock::from).unwrap_or_default(), lambdas, passed }
    }

    /// The plan's spreads, once there are any, and the means that were noted, to be kept in a file.
    #[must_use]
    pub fn parts(&self) -> (Option<&Plane>, &[Passed]) {
        (self.plan.get(), &self.passed)
    }

    /// The thresholds that plans are carried out by, one a barrier; infinite where they are not.
    #[must_use]
    pub fn lambdas(&self) -> &[f64] {
        &self.lambdas
    }

    /// For each pixel, the spread that its neighbours had at the first barrier where this was asked for; `view` is that of
    /// the barrier.
    pub fn plan(&self, spread: impl FnOnce() -> Plane) -> &Plane {
        self.plan.get_or_init(spread)
    }

    /// The pixels that go on though their plan does not ask for it.
    pub(crate) fn passing(&self, view: &View, decisions: &Decisions, bounds: Bounds) -> Vec<Passed> {
        let (Some(plan), Some(_)) = (self.plan.get(), decisions.lambda) else { return Vec::new() };
        let lambdas: Vec<f64> = self.lambdas.iter().copied().chain(decisions.lambda).collect();
        let pixels = view.pixels.iter().zip(&decisions.targets).zip(&plan.values).enumerate();
        pixels
            .filter(|(_, ((p, target), plan))| {
                **target > p.count && p.count >= carried_out(&lambdas, **plan, bounds)
            })
            .map(|(pixel, ((p, _), _))| Passed {
                pixel: pixel as u32,
                count: p.count,
                mean: p.mean.map(|m| m / view.exposure),
            })
            .collect()
    }

    /// Notes them, and the threshold that plans are carried out by.
    pub(crate) fn note(&mut self, passed: Vec<Passed>, decisions: &Decisions) {
        self.passed.extend(passed);
        self.lambdas.extend(decisions.lambda);
    }

    /// The correction of a film; empty if no pixel went beyond its plan. `stopped_short` says that not all that was decided at last
    /// has been sampled: plans are those of the barrier before then.
    #[must_use]
    pub(crate) fn correction(
        &self,
        film: &Film,
        view: &View,
        bounds: Bounds,
        stopped_short: bool,
    ) -> Vec<[f32; 3]> {
        let Some(plan) = self.plan.get() else { return Vec::new() };
        let lambdas =
            &self.lambdas[..self.lambdas.len() - usize::from(stopped_short && !self.lambdas.is_empty())];
        let mut taken = vec![[0.0_f32; 3]; view.pixels.len()];
        let mut any = false;
        let means = film.map(|t, i| t.pixels[i].mean().as_vec3().to_array());
        for p in &self.passed {
            let pixel = p.pixel as usize;
            if p.count == carried_out(lambdas, plan.values[pixel], bounds) {
                taken[pixel] = std::array::from_fn(|c| p.mean[c] - means[pixel][c]);
                any = true;
            }
        }
        if any { spread_out(view, &taken) } else { Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::goal::Goal;
    use crate::policy::{Barrier, Policy, Threshold};
    use glam::Vec3;
    use sparing_image::film::FilmOptions;
    use testkit::svm_data::Random;

    const SIDE: u32 = 24;
    const BOUNDS: Bounds = Bounds { min_spp: 8, max_spp: 128 };
    const TRUTH: f64 = 0.02 * 1.0 + 0.01;

    /// Renders a dark wall that one sample in fifty lights up, in so many layers at most, with the goal of each barrier; gives the sums of
    /// the means and of the corrected ones.
    fn wall(seed: u64, layers: usize, goal: impl Fn(usize) -> Goal) -> [f64; 2] {
        let mut random = Random::new(seed);
        let mut film = Film::new([SIDE, SIDE], [0, 0, SIDE, SIDE], FilmOptions::default());
        let mut ledger = Ledger::default();
        let mut decisions = Decisions { targets: vec![8; (SIDE * SIDE) as usize], ..Decisions::default() };
        let mut stopped_short = true;
        for barrier in 0..layers {
            let mut any = false;
            for tile in &mut film.tiles {
                for i in 0..tile.pixels.len() {
                    let (x, y) = tile.position(i);
                    while tile.pixels[i].count() < decisions.targets[(y * SIDE + x) as usize] {
                        let light = if random.uniform() < 0.02 { 1.0 } else { 0.0 };
                        tile.pixels[i].add(Vec3::splat(light + 0.01));
                        any = true;
                    }
                }
            }
            if !any {
                stopped_short = false;
                break;
            }
            let mut policy = Threshold::new(goal(barrier));
            let barrier = Barrier::new(&film, &ledger, BOUNDS, 1.0);
            decisions = policy.decide(&barrier);
            let passed = barrier.passed(&decisions, BOUNDS);
            ledger.note(passed, &decisions);
        }
        let sum = |film: &Film| film.beauty().iter().map(|p| f64::from(p[0])).sum::<f64>();
        let plain = sum(&film);
        film.correction = ledger.correction(&film, &View::new(&film, 1.0), BOUNDS, stopped_short);
        [plain, sum(&film)]
    }

    /// Bias without and with the correction, each with its standard error.
    fn biases(layers: usize, goal: impl Fn(usize) -> Goal) -> [[f64; 2]; 2] {
        let trials: Vec<[f64; 2]> = (0..60).map(|seed| wall(seed, layers, &goal)).collect();
        std::array::from_fn(|k| {
            let n = trials.len() as f64;
            let values = trials.iter().map(|t| t[k] / f64::from(SIDE * SIDE) / TRUTH - 1.0);
            let mean = values.clone().sum::<f64>() / n;
            let variance = values.map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
            [mean, (variance / n).sqrt()]
        })
    }

    #[test]
    fn choosing_pixels_by_their_samples_takes_no_light_away() {
        let [plain, corrected] = biases(usize::MAX, |_| Goal::Average(24.0));
        assert!(plain[0] < -0.1, "without the correction the wall is dark: {plain:?}");
        assert!(corrected[0].abs() < (4.0 * corrected[1]).min(0.02), "{corrected:?}");
    }

    #[test]
    fn nor_does_a_threshold_that_falls_and_rises() {
        // Plans are carried out by low thresholds first; then only what is far above goes on.
        for lambdas in [[0.1, 0.5, 5.0, 5.0], [5.0, 5.0, 0.1, 5.0], [5.0, 0.5, 0.1, 5.0]] {
            let [plain, corrected] = biases(usize::MAX, |barrier| Goal::Threshold(lambdas[barrier.min(3)]));
            assert!(plain[0] < -0.01, "{lambdas:?}: {plain:?}");
            assert!(corrected[0].abs() < (4.0 * corrected[1]).min(0.02), "{lambdas:?}: {corrected:?}");
        }
    }
    #[test]
    fn nor_does_a_last_layer_that_is_not_sampled() {
        // The last threshold asks for more of all, and nobody gets it.
        for lambdas in [[5.0, 5.0, 0.1], [5.0, 1.0, 0.1]] {
            let [plain, corrected] = biases(3, |barrier| Goal::Threshold(lambdas[barrier]));
            assert!(plain[0] < -0.01, "{lambdas:?}: {plain:?}");
            assert!(corrected[0].abs() < (4.0 * corrected[1]).min(0.02), "{lambdas:?}: {corrected:?}");
        }
    }
}
