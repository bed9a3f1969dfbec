//! What a row is told: how much a pixel gained by twice the samples.

use crate::features::display_lab;
use crate::policy::PERCEIVED_PER_RELATIVE;
use crate::view::DARK;
use sparing_image::color::ciede2000;
use std::fmt;
use std::str::FromStr;

/// How the gain is measured. All are in the units of the pooled rule, squared, for one sample: the drop of the squared error
/// from n to 2n samples, divided by n.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Label {
    /// Of this very pixel: |m_n - mu|^2 - |m_2n - mu|^2.
    #[default]
    Realised,
    /// Of this pixel's mean and the next n samples of all replicates: |m_n - mu|^2 less the mean of |(m_n + s) / 2 - mu|^2,
    /// s the mean of a replicate's second n samples. Less noisy than [`Label::Realised`].
    Conditional,
    /// Of the mean replicate: it knows the pixel, not what was drawn.
    Expected,
}

impl Label {
    /// All, in the order of [`super::Row::gains`].
    pub const ALL: [Self; 3] = [Self::Realised, Self::Conditional, Self::Expected];
}

const NAMES: [(Label, &str); 3] =
    [(Label::Realised, "realised"), (Label::Conditional, "conditional"), (Label::Expected, "expected")];

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(NAMES.iter().find(|(l, _)| l == self).map_or("", |(_, name)| name))
    }
}

impl FromStr for Label {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = NAMES.iter().find(|(_, name)| *name == text).map(|(label, _)| *label);
        found
            .ok_or_else(|| format!("'{text}' is not a label: use {}", NAMES.map(|(_, name)| name).join(", ")))
    }
}

/// Means of one pixel at n and 2n samples in one replicate, in exposed units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Doubling {
    pub(super) at_n: [f64; 3],
    pub(super) at_2n: [f64; 3],
}

impl Doubling {
    fn realised(&self, truth: [f64; 3]) -> f64 {
        squared_error(self.at_n, truth) - squared_error(self.at_2n, truth)
    }
}

impl Label {
    /// The gain of replicate `own`, for one sample.
    pub(super) fn gain(self, replicates: &[Doubling], own: usize, truth: [f64; 3], n: u32) -> f64 {
        let count = replicates.len().max(1) as f64;
        let gain = match self {
            Self::Realised => replicates[own].realised(truth),
            Self::Expected => replicates.iter().map(|r| r.realised(truth)).sum::<f64>() / count,
            Self::Conditional => {
                let m = replicates[own].at_n;
                let after = |r: &Doubling| {
                    let second = |c: usize| 2.0 * r.at_2n[c] - r.at_n[c];
                    squared_error(std::array::from_fn(|c| 0.5 * (m[c] + second(c))), truth)
                };
                squared_error(m, truth) - replicates.iter().map(after).sum::<f64>() / count
            }
        };
        gain / f64::from(n.max(1))
    }
}

/// Squared distance to the truth in the rule's units: the larger of the relative and the perceived error.
pub(super) fn squared_error(mean: [f64; 3], truth: [f64; 3]) -> f64 {
    let y = |c: [f64; 3]| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    let relative = f64::from(PERCEIVED_PER_RELATIVE) * (y(mean) - y(truth)) / (y(truth) + DARK);
    let perceived = ciede2000(display_lab(mean), display_lab(truth));
    (relative * relative).max(perceived * perceived)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_are_drops_of_squared_errors() {
        let grey = |v: f64| [v; 3];
        let near = Doubling { at_n: grey(0.6), at_2n: grey(0.5) };
        let far = Doubling { at_n: grey(0.5), at_2n: grey(0.7) };
        let truth = grey(0.5);
        let square = squared_error(grey(0.6), truth);
        assert!(square > 20.0 && squared_error(truth, truth) == 0.0);
        let both = [near, far];
        assert_eq!(Label::Realised.gain(&both, 0, truth, 8), square / 8.0);
        assert!(Label::Realised.gain(&both, 1, truth, 8) < 0.0);
        let expected = Label::Expected.gain(&both, 0, truth, 8);
        assert_eq!(expected, Label::Expected.gain(&both, 1, truth, 8));
        // Alone, a replicate's conditional gain is its realised one, but for rounding.
        let alone = Label::Conditional.gain(&both[..1], 0, truth, 8);
        assert!((alone - square / 8.0).abs() < 1e-9);
    }

    #[test]
    fn names_lead_back() {
        for (label, name) in NAMES {
            assert_eq!((label.to_string().as_str(), name.parse::<Label>()), (name, Ok(label)));
        }
        assert!("gain".parse::<Label>().is_err());
    }
}
