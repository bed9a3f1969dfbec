//! Proven allowances for the rounding of f64, for RBF machines.
//!
//! With `u = 2^-53`, every operation gives its exact result times `1 + d`, `|d| <= u` (Higham 2002, "Accuracy
//! and Stability of Numerical Algorithms", section 2.2), and `exp` is taken to be within one unit in the last
//! place, `2 u`, as all mathematics libraries in use are.

use crate::model::{Kernel, Model};

/// Unit roundoff.
pub(crate) const U: f64 = f64::EPSILON / 2.0;

/// Bound of `|computed K - K|`.
///
/// The exponent `t = gamma |x - y|^2` is computed as `t (1 + d)`: one rounding for each difference (squared:
/// two), one for its square, `features - 1` for the sum, one for gamma: `|d| <= (features + 3) u` to first
/// order, one more `u` covers the higher orders. Since `t exp(-t) <= 1/e < 0.37`, `|exp(-t (1 + d)) - exp(-t)|
/// <= 0.38 |d|`; `exp` itself adds `2 u`. Squares that underflow change t by at most `gamma features 2^-1074`.
pub(crate) fn kernel(gamma: f64, features: usize) -> f64 {
    let relative = (features as f64 + 4.0) * U;
    0.4 * relative + 3.0 * U + gamma * features as f64 * 5e-324
}

/// Bound of `|Model::decision_value - f|` with f in real arithmetic: `n + 1` roundings on each term of the
/// plain sum, the kernel's error on each, one subtraction of rho.
pub(crate) fn decision(model: &Model) -> f64 {
    let Kernel::Rbf { gamma } = model.kernel else { return f64::INFINITY };
    let sum = mass(model);
    let n = model.len() as f64;
    (sum * (kernel(gamma, model.features) + 1.01 * (n + 3.0) * U) + 1.01 * U * model.rho[0].abs()) * 1.01
}

/// Bound of the rounding of a quadratic form `beta^T K beta` (or a part of it) whose sums are compensated, with
/// `mass` the sum of |beta|: kernel error, two products, two compensated sums (`2 u` each: Ogita, Rump and
/// Oishi 2005, proposition 4.5, for fewer than 2^25 terms) and the additions of the parts.
pub(crate) fn quadratic(gamma: f64, features: usize, mass: f64) -> f64 {
    mass * mass * (kernel(gamma, features) + 10.0 * U) * 1.01
}

/// Sum of |coefficients|, rounded up.
pub(crate) fn mass(model: &Model) -> f64 {
    model.coefficients[0].iter().map(|c| c.abs()).sum::<f64>() * (1.0 + model.len() as f64 * 2.0 * U)
}
