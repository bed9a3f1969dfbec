//! The inner loop, once for all instruction sets: sums of kernel values of one query over a tile of vectors.
//!
//! Vectors lie in groups of [`Real::LANES`]: a row of start values, then one row for each feature. Two groups are
//! evaluated side by side and four chains of additions within each, so that the latency of one multiply-add hides
//! behind the others; that, not the choice of exponential, decides the speed. Partial sums of [`CHUNK`] groups
//! keep the error of the additions small.

use super::exp::Exp;
use super::simd::{Real, Simd};

/// Features are padded to a multiple of the number of chains.
pub(crate) const CHAINS: usize = 4;
/// Groups whose values are added up before they join the tile's sum.
pub(crate) const CHUNK: usize = 16;

/// Rounded additions that a kernel value goes through at most, in a tile of `groups`.
pub(crate) fn sum_depth(groups: usize) -> f64 {
    (CHUNK / 2 + 1 + groups.div_ceil(CHUNK)) as f64
}

/// Numbers of the kernel function.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct KernelParameters {
    /// RBF by differences: factor of the squared distance.
    pub(crate) factor: f64,
    /// Polynomial: its degree.
    pub(crate) degree: u32,
}

/// What becomes of the exponent or inner product of a vector and the query.
pub(crate) trait Head<S: Simd>: Copy {
    /// Loads constants.
    fn new(simd: S, parameters: KernelParameters) -> Self;
    /// Whether the row of start values belongs to the exponent; else it is a row of weights for [`Head::add`].
    const STARTS: bool;
    /// Whether the query's start value belongs to the exponent beside the row of start values.
    const BIAS: bool;
    /// Whether features are compared by difference, `start - factor * sum (x - s)^2`, not by product.
    const DIFFERENCES: bool;
    /// The factor of the squared distance.
    fn factor(self) -> S::V;
    /// Adds the kernel value of `t`, weighted by the row `weights`, to `sum`.
    fn add(self, simd: S, t: S::V, weights: S::V, sum: S::V) -> S::V;
}

/// The RBF kernel: the exponent holds the logarithm of the weight, sums are of one sign.
#[derive(Clone, Copy)]
pub(crate) struct RbfHead<S: Simd, E, const CLAMP: bool, const DIFFERENCES: bool> {
    exp: E,
    /// [`Real::MIN_EXPONENT`]
    min: S::V,
    /// Factor of the squared distance; unused without `DIFFERENCES`.
    factor: S::V,
}

impl<S: Simd, E: Exp<S>, const CLAMP: bool, const DIFFERENCES: bool> Head<S>
    for RbfHead<S, E, CLAMP, DIFFERENCES>
{
    const STARTS: bool = true;
    const BIAS: bool = CLAMP && !DIFFERENCES;
    const DIFFERENCES: bool = DIFFERENCES;

    #[inline(always)]
    fn new(simd: S, parameters: KernelParameters) -> Self {
        let min = simd.set(S::Real::from_f64(S::Real::MIN_EXPONENT));
        Self { exp: E::new(simd), min, factor: simd.set(S::Real::from_f64(parameters.factor)) }
    }

    #[inline(always)]
    fn factor(self) -> S::V {
        self.factor
    }

    #[inline(always)]
    fn add(self, simd: S, t: S::V, _weights: S::V, sum: S::V) -> S::V {
        let t = if CLAMP { simd.max(self.min, t) } else { t };
        self.exp.add_power(simd, t, sum)
    }
}

/// The polynomial kernel: `weight * t^degree`.
#[derive(Clone, Copy)]
pub(crate) struct PolynomialHead<S: Simd> {
    degree: u32,
    one: S::V,
}

impl<S: Simd> Head<S> for PolynomialHead<S> {
    const STARTS: bool = false;
    const BIAS: bool = false;
    const DIFFERENCES: bool = false;

    #[inline(always)]
    fn new(simd: S, parameters: KernelParameters) -> Self {
        Self { degree: parameters.degree, one: simd.set(S::Real::from_f64(1.0)) }
    }

    #[inline(always)]
    fn factor(self) -> S::V {
        self.one
    }

    #[inline(always)]
    fn add(self, simd: S, t: S::V, weights: S::V, sum: S::V) -> S::V {
        let (mut square, mut power, mut left) = (t, self.one, self.degree);
        while left > 0 {
            if left % 2 == 1 {
                power = simd.mul(power, square);
            }
            square = simd.mul(square, square);
            left /= 2;
        }
        simd.mul_add(power, weights, sum)
    }
}

/// The sigmoid kernel: `weight * tanh(t)`.
#[derive(Clone, Copy)]
pub(crate) struct SigmoidHead<S: Simd, E> {
    exp: E,
    zero: S::V,
    one: S::V,
    two: S::V,
    /// Twice the logarithm of e to base 2.
    log: S::V,
    max: S::V,
    min: S::V,
}

impl<S: Simd, E: Exp<S>> Head<S> for SigmoidHead<S, E> {
    const STARTS: bool = false;
    const BIAS: bool = false;
    const DIFFERENCES: bool = false;

    #[inline(always)]
    fn new(simd: S, _parameters: KernelParameters) -> Self {
        let set = |x: f64| simd.set(S::Real::from_f64(x));
        Self {
            exp: E::new(simd),
            zero: set(0.0),
            one: set(1.0),
            two: set(2.0),
            log: set(2.0 * std::f64::consts::LOG2_E),
            max: set(-S::Real::MIN_EXPONENT),
            min: set(S::Real::MIN_EXPONENT),
        }
    }

    #[inline(always)]
    fn factor(self) -> S::V {
        self.one
    }

    // tanh t = 1 - 2 / (1 + e^2t)
    #[inline(always)]
    fn add(self, simd: S, t: S::V, weights: S::V, sum: S::V) -> S::V {
        let t = simd.min(self.max, simd.max(self.min, simd.mul(t, self.log)));
        let power = self.exp.add_power(simd, t, self.zero);
        let tanh = simd.sub(self.one, simd.div(self.two, simd.add(self.one, power)));
        simd.mul_add(tanh, weights, sum)
    }
}

/// Exponent or inner product of the query and the vectors of one group, and the row of weights.
#[inline(always)]
fn group<S: Simd, H: Head<S>>(
    simd: S,
    head: H,
    rows: &[<S::Real as Real>::Row],
    query: &[S::Real],
    start: S::V,
) -> (S::V, S::V) {
    let first = simd.load(&rows[0]);
    let mut chain = [if H::STARTS { first } else { start }; CHAINS];
    if H::STARTS && H::BIAS {
        chain[1] = start;
    }
    let (head_features, more) = query.split_at(CHAINS);
    let (head_rows, more_rows) = rows[1..].split_at(CHAINS);
    let difference = |x, s| if H::DIFFERENCES { simd.sub(x, s) } else { s };
    let factor = |x, d| if H::DIFFERENCES { d } else { x };
    for i in 0..CHAINS {
        let (x, s, c) = (simd.set(head_features[i]), simd.load(&head_rows[i]), i % S::CHAINS);
        let d = difference(x, s);
        // Chains that start with nothing start with a product.
        let begins = i < S::CHAINS && (H::DIFFERENCES || (i > 0 && !(i == 1 && H::BIAS)));
        chain[c] = if begins { simd.mul(factor(x, d), d) } else { simd.mul_add(factor(x, d), d, chain[c]) };
    }
    for (x, s) in more.chunks_exact(CHAINS).zip(more_rows.chunks_exact(CHAINS)) {
        for i in 0..CHAINS {
            let (x, s, c) = (simd.set(x[i]), simd.load(&s[i]), i % S::CHAINS);
            let d = difference(x, s);
            chain[c] = simd.mul_add(factor(x, d), d, chain[c]);
        }
    }
    let mut sum = simd.add(chain[0], chain[1]);
    if S::CHAINS == 4 {
        sum = simd.add(sum, simd.add(chain[2], chain[3]));
    }
    if H::DIFFERENCES { (simd.neg_mul_add(head.factor(), sum, first), first) } else { (sum, first) }
}

/// The sum of the kernel values of `query` and all vectors of `rows`, groups of `1 + query.len()` rows.
/// `FEATURES` is the length of the query where it is known at compile time, else 0.
#[inline(always)]
pub(crate) fn sum_rows<S: Simd, H: Head<S>, const FEATURES: usize>(
    simd: S,
    head: H,
    rows: &[<S::Real as Real>::Row],
    query: &[S::Real],
    start: S::Real,
) -> f64 {
    let query = if FEATURES > 0 { &query[..FEATURES] } else { query };
    let stride = if FEATURES > 0 { 1 + FEATURES } else { 1 + query.len() };
    let zero = simd.set(S::Real::from_f64(0.0));
    let start = simd.set(start);
    let mut total = zero;
    for chunk in rows.chunks(CHUNK * stride) {
        let (mut even, mut odd) = (zero, zero);
        let mut pairs = chunk.chunks_exact(2 * stride);
        for pair in &mut pairs {
            let (a, weights_a) = group(simd, head, &pair[..stride], query, start);
            even = head.add(simd, a, weights_a, even);
            let (b, weights_b) = group(simd, head, &pair[stride..], query, start);
            odd = head.add(simd, b, weights_b, odd);
        }
        if pairs.remainder().len() == stride {
            let (a, weights) = group(simd, head, pairs.remainder(), query, start);
            even = head.add(simd, a, weights, even);
        }
        total = simd.add(total, simd.add(even, odd));
    }
    simd.sum(total)
}
