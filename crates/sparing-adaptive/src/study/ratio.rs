//! Costs at equal error as ratios, and their means over scenes.

use super::curve::{Cost, Curve};
use serde::Serialize;

/// A policy's cost at the error of another one's, over that one's cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind", content = "ratio")]
pub enum Ratio {
    /// So much.
    Exactly(f64),
    /// At most so much: the policy's cheapest render is better already.
    AtMost(f64),
    /// The error was never reached; the dearest render cost so much.
    Unreached(f64),
}

impl Ratio {
    /// The ratio of `curve` to `base`, at the error that `base` has at `cost`. `None` if `base` was not measured there or
    /// has no error there, or `curve` is empty.
    #[must_use]
    pub fn at_cost(curve: &Curve, base: &Curve, cost: f64) -> Option<Self> {
        Self::at_error(curve, base.error_at(cost)?, cost)
    }

    /// The ratio of what `error` costs on `curve` to `cost`.
    #[must_use]
    pub fn at_error(curve: &Curve, error: f64, cost: f64) -> Option<Self> {
        Some(match curve.cost_at(error)? {
            Cost::Exactly(c) => Self::Exactly(c / cost),
            Cost::AtMost(c) => Self::AtMost(c / cost),
            Cost::MoreThan(c) => Self::Unreached(c / cost),
        })
    }

    /// How it enters a mean. An error that was never reached counts as what the dearest render cost, which is too
    /// little, but never as a gain.
    #[must_use]
    pub fn value(self) -> f64 {
        match self {
            Self::Exactly(r) | Self::AtMost(r) => r,
            Self::Unreached(r) => r.max(1.0),
        }
    }
}

/// A geometric mean over scenes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Mean {
    /// The mean; a lower bound if some are unreached. NaN without any.
    pub value: f64,
    /// Scenes in it.
    pub scenes: usize,
    /// Scenes of these where the error was never reached.
    pub unreached: usize,
    /// Scenes of these where the cheapest render was better already.
    pub at_most: usize,
    /// The largest ratio.
    pub worst: f64,
}

impl Mean {
    /// Of these.
    #[must_use]
    pub fn of(ratios: &[Ratio]) -> Self {
        let n = ratios.len();
        let logs: f64 = ratios.iter().map(|r| r.value().ln()).sum();
        Self {
            value: (logs / n as f64).exp(),
            scenes: n,
            unreached: ratios.iter().filter(|r| matches!(r, Ratio::Unreached(_))).count(),
            at_most: ratios.iter().filter(|r| matches!(r, Ratio::AtMost(_))).count(),
            worst: ratios.iter().map(|r| r.value()).fold(f64::NAN, f64::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inverse(factor: f64) -> Curve {
        Curve::new((3..=10).map(|k| f64::from(1 << k)).map(|c| (c, factor / c)))
    }

    #[test]
    fn known_curves_give_known_ratios() {
        let uniform = inverse(1.0);
        for factor in [0.25, 0.4, 1.0, 2.0] {
            let Some(Ratio::Exactly(r)) = Ratio::at_cost(&inverse(factor), &uniform, 64.0) else { panic!() };
            assert!((r / factor - 1.0).abs() < 1e-12);
        }
        assert_eq!(Ratio::at_cost(&uniform, &uniform, 4.0), None);
        let Some(Ratio::AtMost(r)) = Ratio::at_cost(&inverse(0.01), &uniform, 64.0) else { panic!() };
        assert!((r - 0.125).abs() < 1e-12);
        let Some(Ratio::Unreached(r)) = Ratio::at_cost(&inverse(100.0), &uniform, 64.0) else { panic!() };
        assert!((r - 16.0).abs() < 1e-9);
    }

    #[test]
    fn means_say_what_is_in_them() {
        let mean = Mean::of(&[Ratio::Exactly(0.25), Ratio::AtMost(0.5), Ratio::Unreached(0.2)]);
        assert!((mean.value - 0.5).abs() < 1e-12, "unreached is no gain: {}", mean.value);
        assert_eq!((mean.scenes, mean.unreached, mean.at_most, mean.worst), (3, 1, 1, 1.0));
        assert!(Mean::of(&[]).value.is_nan());
    }
}
