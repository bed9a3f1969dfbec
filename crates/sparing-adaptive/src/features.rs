//! Features: what a machine knows of a pixel at a barrier.
//!
//! Each has a name that stands in the model's card. Errors are in the units of [`Statistics`], times the square root of
//! the count, so that they say the same of a pixel at every layer. Magnitudes enter as logarithms, held above a
//! floor, so that black and saturated pixels have finite features too.

use crate::policy::own_spread;
use crate::view::{Statistics, View};
use multiversion::multiversion;
use rayon::prelude::*;
use sparing_image::color::{fast, luminance, rgb_to_lab};

/// One feature of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Feature {
    /// Logarithm of the count.
    Count,
    /// Of the relative error of the luminance times sqrt(n).
    RelativeError,
    /// Of the length of the channels' errors times sqrt(n).
    ChannelError,
    /// Of the CIEDE2000 error times sqrt(n).
    PerceivedError,
    /// Of the CIEDE2000 difference between the first and the second half of the samples, times sqrt(n).
    HalfDifference,
    /// L* of the mean.
    Lightness,
    /// a* of the mean.
    GreenRed,
    /// b* of the mean.
    BlueYellow,
    /// Logarithm of the mean's luminance.
    Luminance,
    /// Of the brightest block over the mean.
    Peak,
    /// Share of black blocks.
    Zeros,
    /// Of the mean spread of 3 by 3 pixels.
    SpreadMean,
    /// Of their largest spread.
    SpreadMax,
    /// Of their mean CIEDE2000 error times sqrt(n).
    PerceivedMean,
    /// Of the largest of them.
    PerceivedMax,
    /// Of their mean peak.
    PeakMean,
    /// Of their largest peak.
    PeakMax,
    /// Logarithm of the distance in L*a*b* to the mean colour of 3 by 3 pixels.
    NeighbourDistance,
    /// Logarithm of the pooled rule's gain over its threshold: by how far the rule would go on.
    Gain,
    /// The same by the plan, what the neighbours had in the first layer.
    PlanGain,
}

impl Feature {
    /// All, in the order of their columns.
    pub const ALL: [Self; 20] = [
        Self::Count,
        Self::RelativeError,
        Self::ChannelError,
        Self::PerceivedError,
        Self::HalfDifference,
        Self::Lightness,
        Self::GreenRed,
        Self::BlueYellow,
        Self::Luminance,
        Self::Peak,
        Self::Zeros,
        Self::SpreadMean,
        Self::SpreadMax,
        Self::PerceivedMean,
        Self::PerceivedMax,
        Self::PeakMean,
        Self::PeakMax,
        Self::NeighbourDistance,
        Self::Gain,
        Self::PlanGain,
    ];

    /// Those that machines get unless asked otherwise: more cost time and make them worse (docs/adaptive-training.md).
    pub const DEFAULT: [Self; 12] = [
        Self::Count,
        Self::RelativeError,
        Self::PerceivedError,
        Self::HalfDifference,
        Self::Luminance,
        Self::Peak,
        Self::Zeros,
        Self::SpreadMean,
        Self::SpreadMax,
        Self::NeighbourDistance,
        Self::Gain,
        Self::PlanGain,
    ];

    /// The name in cards. Names never change their meaning: what is computed otherwise gets another one.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Count => "log-count",
            Self::RelativeError => "log-relative-error",
            Self::ChannelError => "log-channel-error",
            Self::PerceivedError => "log-perceived-error",
            Self::HalfDifference => "log-half-difference",
            Self::Lightness => "lab-l",
            Self::GreenRed => "lab-a",
            Self::BlueYellow => "lab-b",
            Self::Luminance => "log-luminance",
            Self::Peak => "log-peak",
            Self::Zeros => "zeros",
            Self::SpreadMean => "log-spread-mean3",
            Self::SpreadMax => "log-spread-max3",
            Self::PerceivedMean => "log-perceived-mean3",
            Self::PerceivedMax => "log-perceived-max3",
            Self::PeakMean => "log-peak-mean3",
            Self::PeakMax => "log-peak-max3",
            Self::NeighbourDistance => "log-lab-distance3",
            Self::Gain => "log-gain",
            Self::PlanGain => "log-plan-gain",
        }
    }

    /// For features that are logarithms: what is added before, so that black and even pixels have finite ones.
    fn floor(self) -> Option<f64> {
        match self {
            Self::RelativeError | Self::Luminance => Some(1e-4),
            Self::ChannelError => Some(1e-5),
            Self::Peak | Self::PeakMean | Self::PeakMax | Self::NeighbourDistance => Some(1e-2),
            Self::PerceivedError
            | Self::HalfDifference
            | Self::SpreadMean
            | Self::SpreadMax
            | Self::PerceivedMean
            | Self::PerceivedMax => Some(1e-3),
            Self::Count
            | Self::Lightness
            | Self::GreenRed
            | Self::BlueYellow
            | Self::Zeros
            | Self::Gain
            | Self::PlanGain => None,
        }
    }

    /// The feature of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.name() == name)
    }
}

/// Where the pooled rule stands: logarithm of gain over threshold, within +-[`MOST_LOG_GAIN`], finite.
#[must_use]
pub fn log_gain(spread: f32, count: u32, lambda: f64) -> f64 {
    if spread <= 0.0 {
        return -MOST_LOG_GAIN;
    }
    // lambda is 0 or infinite where a goal is beyond reach or reached.
    (f64::from(spread) / f64::from(count.max(1)) / lambda).ln().clamp(-MOST_LOG_GAIN, MOST_LOG_GAIN)
}

/// [`log_gain`] to 1e-9, in half the time.
pub(crate) fn rough_log_gain(spread: f32, count: u32, lambda: f64) -> f64 {
    if spread <= 0.0 {
        return -MOST_LOG_GAIN;
    }
    let ratio = f64::from(spread) / f64::from(count.max(1)) / lambda;
    ln(ratio.clamp(1e-30, 1e30)).clamp(-MOST_LOG_GAIN, MOST_LOG_GAIN)
}

/// Largest magnitude of [`log_gain`].
pub const MOST_LOG_GAIN: f64 = 40.0;

/// A pixel and how far the rule would go on there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// Index of the pixel, in rows.
    pub pixel: usize,
    /// [`log_gain`] of it.
    pub log_gain: f64,
    /// The same by its plan alone.
    pub plan_gain: f64,
}

/// Features of some pixels, row-major, as an evaluator takes them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeatureMatrix {
    /// Columns.
    pub features: usize,
    /// `rows * features`; all finite.
    pub values: Vec<f64>,
}

impl FeatureMatrix {
    /// Computes these features, and no others, of these pixels.
    ///
    /// # Panics
    /// When a query is outside of the view.
    #[must_use]
    pub fn new(view: &View, queries: &[Query], features: &[Feature]) -> Self {
        let mut values = vec![0.0; queries.len() * features.len()];
        let parts = values.par_chunks_mut(ROWS * features.len().max(1)).zip(queries.par_chunks(ROWS));
        parts.for_each(|(rows, queries)| fill_rows(view, queries, features, rows));
        Self { features: features.len(), values }
    }
}

/// Rows that are computed together.
const ROWS: usize = 64;

/// Writes these features of these pixels, a row each, by this thread alone.
pub(crate) fn fill_rows(view: &View, queries: &[Query], features: &[Feature], rows: &mut [f64]) {
    let (wanted, width) = (Wanted::by(features), features.len());
    // A feature at a time, so that logarithms are vector code.
    let mut columns = vec![[0.0; ROWS]; width];
    for (queries, rows) in queries.chunks(ROWS).zip(rows.chunks_mut(ROWS * width.max(1))) {
        for (i, query) in queries.iter().enumerate() {
            let around = Around::new(view, query.pixel, wanted);
            for (column, feature) in columns.iter_mut().zip(features) {
                column[i] = around.value(*feature, query);
            }
        }
        for (f, (column, feature)) in columns.iter_mut().zip(features).enumerate() {
            if let Some(floor) = feature.floor() {
                logs(&mut column[..queries.len()], floor);
            }
            rows.iter_mut().skip(f).step_by(width).zip(&*column).for_each(|(out, value)| *out = *value);
        }
    }
}

/// Which sums over neighbours some features take.
#[derive(Clone, Copy)]
struct Wanted {
    spread: bool,
    perceived: bool,
    peak: bool,
    mean: bool,
}

impl Wanted {
    fn by(features: &[Feature]) -> Self {
        let any = |of: &[Feature]| features.iter().any(|f| of.contains(f));
        Self {
            spread: any(&[Feature::SpreadMean, Feature::SpreadMax]),
            perceived: any(&[Feature::PerceivedMean, Feature::PerceivedMax]),
            peak: any(&[Feature::PeakMean, Feature::PeakMax]),
            mean: any(&[Feature::NeighbourDistance]),
        }
    }
}

/// A pixel with sums over its 3 by 3 neighbours, those that are wanted.
struct Around<'a> {
    own: &'a Statistics,
    mean: [f64; 3],
    spread: Summary,
    perceived: Summary,
    peak: Summary,
}

/// Mean and largest of a quantity that is not negative.
#[derive(Default)]
struct Summary {
    mean: f64,
    max: f64,
}

impl Summary {
    fn add(&mut self, value: f32, weight: f64) {
        self.mean += weight * f64::from(value);
        self.max = self.max.max(value.into());
    }
}

impl<'a> Around<'a> {
    fn new(view: &'a View, pixel: usize, wanted: Wanted) -> Self {
        let (x, y) = (pixel % view.width, pixel / view.width);
        let columns = x.saturating_sub(1)..(x + 2).min(view.width);
        let rows = y.saturating_sub(1)..(y + 2).min(view.height);
        let weight = 1.0 / (columns.len() * rows.len()).max(1) as f64;
        let (mut spread, mut perceived, mut peak) =
            (Summary::default(), Summary::default(), Summary::default());
        let mut mean = [0.0; 3];
        for row in rows {
            for p in &view.pixels[row * view.width..][columns.clone()] {
                if wanted.spread {
                    spread.add(own_spread(p), weight);
                }
                if wanted.perceived {
                    perceived.add((p.perceived_error * (p.count as f32).sqrt()).min(1e30), weight);
                }
                if wanted.peak {
                    peak.add(p.peak, weight);
                }
                if wanted.mean {
                    mean.iter_mut().zip(p.mean).for_each(|(m, v)| *m += weight * f64::from(v));
                }
            }
        }
        Self { own: &view.pixels[pixel], mean, spread, perceived, peak }
    }

    /// A feature; of those that are logarithms, what the logarithm is taken of, without the floor.
    fn value(&self, feature: Feature, query: &Query) -> f64 {
        let p = self.own;
        match feature {
            Feature::Count => f64::from(p.count.max(1)).ln(),
            Feature::RelativeError => f64::from(p.relative_error) * root(p),
            Feature::ChannelError => {
                let squares: f64 = p.error.iter().map(|e| f64::from(*e) * f64::from(*e)).sum();
                squares.sqrt() * root(p)
            }
            Feature::PerceivedError => f64::from(p.perceived_error) * root(p),
            Feature::HalfDifference => f64::from(p.perceived_half_difference) * root(p),
            Feature::Lightness => p.lab[0].into(),
            Feature::GreenRed => p.lab[1].into(),
            Feature::BlueYellow => p.lab[2].into(),
            Feature::Luminance => luminance(p.mean),
            Feature::Peak => p.peak.into(),
            Feature::Zeros => p.zeros.into(),
            Feature::SpreadMean => self.spread.mean,
            Feature::SpreadMax => self.spread.max,
            Feature::PerceivedMean => self.perceived.mean,
            Feature::PerceivedMax => self.perceived.max,
            Feature::PeakMean => self.peak.mean,
            Feature::PeakMax => self.peak.max,
            Feature::NeighbourDistance => {
                let mean = fast::rgb_to_lab(self.mean.map(|x| x.clamp(0.0, 1.0) as f32));
                let squares: f32 = p.lab.iter().zip(mean).map(|(a, b)| (a - b) * (a - b)).sum();
                squares.sqrt().into()
            }
            Feature::Gain => query.log_gain,
            // A plan of nothing says nothing beyond the band.
            Feature::PlanGain => query.plan_gain.clamp(-6.0, 6.0),
        }
    }
}

/// Logarithms, from a floor on: what is smaller does not matter. No fused operations: the same bits on every machine.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2"))]
fn logs(values: &mut [f64], floor: f64) {
    for v in values {
        *v = ln((*v + floor).max(floor).min(1e30));
    }
}

/// The natural logarithm of a positive normal number, to 1e-9: by 2 artanh((m - 1) / (m + 1)) of the mantissa m between
/// the roots of 1/2 and 2. Several times faster than the library's, and the same on every machine.
#[inline(always)]
fn ln(x: f64) -> f64 {
    const ROOT: u64 = std::f64::consts::FRAC_1_SQRT_2.to_bits();
    let shifted = x.to_bits().wrapping_sub(ROOT);
    let exponent = (shifted as i64) >> 52;
    let m = f64::from_bits(x.to_bits().wrapping_sub((exponent << 52) as u64));
    let s = (m - 1.0) / (m + 1.0);
    let s2 = s * s;
    let series = 1.0 + s2 * (1.0 / 3.0 + s2 * (1.0 / 5.0 + s2 * (1.0 / 7.0 + s2 * (1.0 / 9.0))));
    exponent as f64 * std::f64::consts::LN_2 + 2.0 * s * series
}

fn root(p: &Statistics) -> f64 {
    f64::from(p.count).sqrt()
}

/// L*a*b* as a display shows it: values beyond 1 are white.
#[must_use]
pub fn display_lab(rgb: [f64; 3]) -> [f64; 3] {
    rgb_to_lab(rgb.map(|x| x.clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use sparing_image::film::{Film, FilmOptions};

    /// A film whose pixel `i` of its tile holds these samples.
    fn film(side: u32, samples: impl Fn(usize) -> Vec<Vec3>) -> Film {
        let mut film = Film::new([side, side], [0, 0, side, side], FilmOptions::default());
        for tile in &mut film.tiles {
            for i in 0..tile.pixels.len() {
                for (n, s) in samples(i).into_iter().enumerate() {
                    tile.add_sample(i, n as u32, s, 1.0);
                }
            }
        }
        film
    }

    fn all(view: &View) -> FeatureMatrix {
        let queries: Vec<Query> = (0..view.pixels.len())
            .map(|pixel| Query { pixel, log_gain: log_gain(1.0, 8, 0.0), plan_gain: 0.5 })
            .collect();
        FeatureMatrix::new(view, &queries, &Feature::ALL)
    }

    #[test]
    fn names_are_distinct_and_lead_back() {
        for feature in Feature::ALL {
            assert_eq!(Feature::from_name(feature.name()), Some(feature));
        }
        assert_eq!(Feature::from_name("log-gain "), None);
    }

    #[test]
    fn hostile_films_have_finite_features() {
        let one = |value: f32| {
            let mut samples = vec![Vec3::splat(0.5); 8];
            samples[5] = Vec3::splat(value);
            samples
        };
        let cases = [
            Vec::new(),
            vec![Vec3::ZERO; 8],
            vec![Vec3::ONE],
            vec![Vec3::splat(f32::MAX); 16],
            vec![Vec3::splat(1e-45); 8],
            one(f32::NAN),
            one(f32::MAX),
        ];
        for samples in cases {
            for side in [1, 3, 9] {
                for exposure in [1e-30, 1e-6, 1.0, 1e6, 1e30] {
                    let view = View::new(
                        &film(side, |i| if i % 3 == 1 { one(3.0) } else { samples.clone() }),
                        exposure,
                    );
                    let matrix = all(&view);
                    assert_eq!(matrix.values.len(), view.pixels.len() * Feature::ALL.len());
                    assert!(matrix.values.iter().all(|v| v.is_finite()), "{samples:?} {side} {exposure}");
                }
            }
        }
    }

    #[test]
    fn values_are_what_their_names_say() {
        // Pixel 4, the middle of 3 by 3, has one bright block; tiles are 8 wide.
        let view = View::new(
            &film(3, |i| {
                let mut samples = vec![Vec3::splat(0.25); 8];
                if i == 9 {
                    samples[0] = Vec3::ZERO;
                    samples[7] = Vec3::splat(0.5);
                }
                samples
            }),
            2.0,
        );
        let value = |pixel: usize, feature| {
            FeatureMatrix::new(&view, &[Query { pixel, log_gain: -0.5, plan_gain: -9.0 }], &[feature]).values
                [0]
        };
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-3 * b.abs().max(1.0), "{a} {b}");
        close(value(4, Feature::Count), 8_f64.ln());
        close(value(4, Feature::Luminance), 0.5_f64.ln());
        close(value(4, Feature::Peak), 2.01_f64.ln());
        close(value(0, Feature::Peak), 1.01_f64.ln());
        close(value(0, Feature::PeakMax), 2.01_f64.ln());
        close(value(0, Feature::PeakMean), (1.0 + 0.25 + 0.01_f64).ln());
        close(value(4, Feature::Zeros), 0.125);
        close(value(0, Feature::HalfDifference), 1e-3_f64.ln());
        close(value(4, Feature::Gain), -0.5);
        close(value(4, Feature::PlanGain), -6.0);
        close(value(4, Feature::NeighbourDistance), 1e-2_f64.ln());
        assert!(value(4, Feature::HalfDifference) > 1.0);
        assert!(value(0, Feature::SpreadMax) > value(0, Feature::SpreadMean));
        assert_eq!(value(8, Feature::SpreadMax), value(4, Feature::SpreadMax));
    }

    #[test]
    fn logarithms_are_good_to_a_billionth() {
        for i in -40_000..40_000 {
            let x = (f64::from(i) * 1.7e-3).exp();
            assert!((ln(x) - x.ln()).abs() < 1e-9, "{x}");
        }
    }

    #[test]
    fn the_log_gain_is_finite_for_any_threshold() {
        assert_eq!(log_gain(0.0, 8, 0.0), -MOST_LOG_GAIN);
        assert_eq!(log_gain(1.0, 8, 0.0), MOST_LOG_GAIN);
        assert_eq!(log_gain(1.0, 8, f64::INFINITY), -MOST_LOG_GAIN);
        assert!((log_gain(16.0, 8, 1.0) - 2_f64.ln()).abs() < 1e-12);
    }
}
