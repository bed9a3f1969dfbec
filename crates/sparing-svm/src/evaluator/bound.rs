//! What is proven about the error of each level.
//!
//! All bounds are to the value that [`crate::Model::decision_values`] computes, so they include that computation's own
//! rounding. Notation: u is [`Real::UNIT`]; a tile's sum of kernel values, all of one sign, is S; relative errors of
//! its terms are at most r, so that the sum is off by r S; sums of tiles are in f64.

use super::machine::{Levels, Machine, Value};
use super::packed::{Packed, Tile};
use super::run::{EXP_ERROR_F64, Sum, TileError, exp_error, tile_errors};
use super::simd::Real;
use crate::model::Kernel;
use std::f64::consts::LN_2;

/// Kernel values below `2^-60` count in bounds by their number only.
const NEGLIGIBLE: f64 = 60.0;

/// What is added to the bound of every value of an RBF machine.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Allowance {
    /// Sum of what clamped and padded lanes add.
    tail: f64,
    /// Relative to the sum of all kernel values.
    of_magnitude: f64,
    /// For each value.
    constant: f64,
}

/// Relative error of a sum, RBF by inner products: constant, linear and quadratic in the query's norm |q|.
///
/// The exponent is t = start + bias + <q, s>, in chains of multiply-adds. The intermediate sums of one step of all chains
/// are together at most |start| + |bias| + |q||s| (Cauchy-Schwarz over the chains), and each is rounded once. There
/// are features / chains steps, and log2(chains) more to join the chains; the start and the bias are rounded once before, the
/// features of q and s as well, and the products where multiply-add is not fused. An error of e in t is one of
/// 2^e - 1 < 0.7 e in 2^t.
///
/// In f64 the roundings while centring, scaling and adding up squared norms count too, one a feature and six more.
pub(crate) fn rbf_error<R: Real>(tile: &Tile, steps: f64, features: usize, far: bool, exp: f64) -> [f64; 3] {
    let before = if R::MANTISSA_BITS > 23 { features as f64 + 6.0 } else { 0.0 };
    let steps = steps + before;
    let unit = R::UNIT * LN_2 * 1.01;
    let constant = exp + R::UNIT * tile.depth + unit * (steps + 1.0) * tile.start;
    // |bias| = |q|^2 / 2; it is one more number in the sums only where queries are far.
    let quadratic = if far { unit * (steps + 1.0) / 2.0 } else { 0.0 };
    [constant, unit * (steps + 3.0) * tile.norm, quadratic]
}

impl Machine {
    /// Roundings of a sum of products over the features, one after the other.
    pub(crate) fn steps(&self, features: usize) -> f64 {
        let chains = self.set.chains();
        (features / chains) as f64 + f64::from(chains.ilog2())
    }

    /// Relative errors of sums in f64, RBF by differences of features as they are.
    ///
    /// In t = start - factor d2, d is rounded once, its square once, the sums [`Machine::steps`] times, the factor, the
    /// product and the difference once each; the start is off by 2 units. Exponents below -60 are negligible.
    pub(crate) fn difference_errors(&self, packed: &Packed<f64>) -> Vec<TileError> {
        let steps = self.steps(packed.features) + 6.0;
        tile_errors(&packed.tiles, |t| {
            let exponent = steps * (NEGLIGIBLE + 2.0 * t.start);
            [EXP_ERROR_F64 + f64::UNIT * (LN_2 * exponent + t.depth), 0.0, 0.0]
        })
    }

    /// What the bounds of an RBF machine add to each value.
    ///
    /// Clamped and padded lanes each add at most `2^MIN_EXPONENT`. The definition adds up `len` terms one by one, each off by
    /// the rounding of its exponent, at most 60 ln 2 unless it is negligible; this level adds up tiles in f64.
    pub(crate) fn allowance<R: Real>(&self, packed: &Packed<R>) -> Allowance {
        let lanes = packed.tiles.iter().map(|t| t.groups * R::LANES).sum::<usize>() as f64;
        let per_exponent = NEGLIGIBLE * LN_2 * (self.features + 4) as f64;
        let negligible = self.len as f64 * (-NEGLIGIBLE).exp2() * 1e-12 * (self.features + 4) as f64;
        Allowance {
            tail: lanes * (R::MIN_EXPONENT + 1.0).exp2(),
            of_magnitude: 1.1 * f64::UNIT * (self.len as f64 + per_exponent + 96.0),
            constant: self.weight * negligible + 2.2 * f64::UNIT * self.rho.abs(),
        }
    }

    /// The value from the sum of all tiles; `factor` is the weight times 2 to the bias that was left out.
    #[inline(always)]
    pub(crate) fn finish_rbf(&self, sum: &Sum, allowance: &Allowance, factor: f64) -> Value {
        let error = sum.error + allowance.tail + allowance.of_magnitude * sum.magnitude;
        Value::new(factor * sum.value - self.rho, factor * error + allowance.constant)
    }

    /// The value of a polynomial or sigmoid machine from the sum of all tiles.
    ///
    /// With B = |q| |s| + |coef0| the largest magnitude of an inner product, e its error: the power is off by
    /// degree (B + e)^(degree - 1) e and its roundings, tanh (slope at most 1) by e and its roundings.
    pub(crate) fn finish_product<R: Real>(
        &self,
        sum: &Sum,
        packed: &Packed<R>,
        norm: f64,
        exp_error: f64,
    ) -> Value {
        let coef0 = match self.kernel {
            Kernel::Polynomial { coef0, .. } | Kernel::Sigmoid { coef0, .. } => coef0,
            Kernel::Rbf { .. } | Kernel::Linear => 0.0,
        };
        let vectors = packed.tiles.iter().map(|t| t.norm).fold(0.0, f64::max);
        let depth = packed.tiles.iter().map(|t| t.depth).fold(0.0, f64::max) + packed.tiles.len() as f64;
        let b = norm * vectors * (1.0 + 1e-6) + coef0.abs();
        let definition = 2.0 * (self.features + 4) as f64 * f64::UNIT / R::UNIT;
        let steps = self.steps(packed.features) + 4.0 + definition;
        let e = steps * R::UNIT * b;
        let largest_power = match self.kernel {
            Kernel::Polynomial { degree, .. } => f64::from(degree),
            _ => 1.0,
        };
        let (error, largest) = match self.kernel {
            Kernel::Polynomial { .. } => {
                let p = largest_power;
                (p * (b + e).powf((p - 1.0).max(0.0)) * e + (2.0 * p + 4.0) * R::UNIT * b.powf(p), b.powf(p))
            }
            _ => (e + 8.0 * R::UNIT + exp_error, 1.0),
        };
        let sums = (depth + 2.0) * R::UNIT + (self.len as f64 + 8.0) * f64::UNIT;
        let operations = self.len as f64 * (self.features as f64 + 2.0 * largest_power + 8.0);
        let underflow = R::TINY * operations * b.max(1.0).powf(largest_power);
        let error = self.weights * (error + sums * largest) + underflow;
        let bound = 1.1 * (self.weight * error + 2.0 * f64::UNIT * self.rho.abs());
        Value::new(self.weight * sum.value - self.rho, bound)
    }

    /// The largest [`Value::bound`] of the first level over all queries (RBF), or over the queries no longer than the
    /// longest support vector (other kernels).
    pub(crate) fn error_bound(&self) -> f64 {
        match &self.levels {
            Levels::Linear(l) => self.linear(&l.reach).map_or(f64::INFINITY, |v| v.bound),
            Levels::Kernel { single: Some(s), .. } => match self.kernel {
                Kernel::Rbf { .. } => self.rbf_error_bound(&s.packed, &s.far),
                _ => {
                    let longest = s.norm * s.scale.abs();
                    self.finish_product::<f32>(
                        &Sum::default(),
                        &s.packed,
                        longest,
                        exp_error(self.set, s.exp),
                    )
                    .bound
                }
            },
            Levels::Kernel { errors, double, .. } => match self.kernel {
                Kernel::Rbf { .. } => self.rbf_error_bound(double, errors),
                _ => f64::INFINITY,
            },
        }
    }

    // A kernel value of a query at distance d outside the ball of a tile's vectors is below 2^(-d^2 / 2), and
    // d 2^(-d^2 / 2) <= 0.73, d^2 2^(-d^2 / 2) <= 1.07.
    fn rbf_error_bound<R: Real>(&self, packed: &Packed<R>, errors: &[TileError]) -> f64 {
        let mut sum = Sum::default();
        for (tile, error) in packed.tiles.iter().zip(errors) {
            let [constant, linear, quadratic] = error.coefficients;
            let n = tile.norm;
            let relative = constant + linear * (n + 0.73) + quadratic * (n * n + 1.46 * n + 1.07);
            sum.error += tile.weight * if relative < 0.01 { 1.05 * relative } else { f64::INFINITY };
            sum.magnitude += tile.weight;
        }
        self.finish_rbf(&sum, &self.allowance(packed), self.weight).bound
    }
}
