//! Coefficients and threshold of a reduced machine, given its vectors.
//!
//! | fit | minimises | after |
//! | --- | --- | --- |
//! | [`project`] | the distance from w in the kernel's Hilbert space | Schoelkopf et al. 1999, section IV (reduced set) |
//! | [`ridge`] | squared error to targets at points, plus `lambda` times the coefficients' | Hoerl and Kennard 1970; Lee and Mangasarian 2001 (reduced kernel) |
//! | [`logistic`] | logistic loss of labels plus `lambda` times the squared norm, by Newton's method | Keerthi et al. 2005 |
//!
//! All solve small symmetric systems by Cholesky with a ridge that grows until the factorisation stands.

use super::PruneError;
use super::dense::{self, Rows, cholesky, expansion, gram, kernel_matrix, solve, times, transposed_times};
use crate::model::{Kernel, Model};
use rayon::prelude::*;

/// Coefficients and threshold.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// One for each vector.
    pub coefficients: Vec<f64>,
    /// Threshold, subtracted.
    pub rho: f64,
}

/// Ridges that are tried, as shares of the mean diagonal.
pub const RIDGES: [f64; 6] = [1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0];

/// The Cholesky factor of `a + ridge mean(diag a) I` for the smallest of growing ridges that works. The ridge
/// is left off from unknown `penalised` on.
fn factor(a: &[f64], m: usize, penalised: usize, ridge: f64) -> Option<Vec<f64>> {
    let mean = (0..penalised).map(|i| a[i * m + i]).sum::<f64>() / penalised.max(1) as f64;
    let mut ridge = ridge;
    while ridge <= 1.0 {
        let mut shifted = a.to_vec();
        (0..penalised).for_each(|i| shifted[i * m + i] += ridge * mean);
        if let Some(l) = cholesky(shifted, m) {
            return Some(l);
        }
        ridge = (ridge * 10.0).max(1e-15);
    }
    None
}

/// The solution of the system of [`factor`].
pub(crate) fn solve_ridge(a: &[f64], m: usize, penalised: usize, b: &[f64], ridge: f64) -> Option<Vec<f64>> {
    let x = solve(&factor(a, m, penalised, ridge)?, m, b);
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// The projection of w onto the span of the centres: `(K_mm + ridge) gamma = f(centres) + rho`, the threshold
/// kept. A larger ridge keeps the coefficients small, which an evaluation in f32 needs; 1e-12 is as exact as
/// f64 allows.
///
/// # Errors
/// Nothing finite comes out.
pub fn project(model: &Model, centres: &[f64], ridge: f64) -> Result<Fitted, PruneError> {
    let (all, centres) =
        (Rows::new(&model.support_vectors, model.features), Rows::new(centres, model.features));
    let values = expansion(model.kernel, all, &model.coefficients[0], centres);
    let k = kernel_matrix(model.kernel, centres, centres);
    let coefficients =
        solve_ridge(&k, centres.len(), centres.len(), &values, ridge).ok_or(PruneError::Fit)?;
    Ok(Fitted { coefficients, rho: model.rho[0] })
}

/// What a fit is chosen by, on points that it has not seen: the share of right signs, then the smaller error.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Score(f64, f64);

/// Points with what the machine should say there.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// Row by row.
    pub rows: &'a [f64],
    /// One for each row; the sign is what counts when fits are compared.
    pub targets: &'a [f64],
}

/// Every fifth point is held out to choose ridge and clipping.
const HELD_OUT: usize = 5;

/// Ridge regression of the targets clipped to +-clip, threshold free. The ridge (of [`RIDGES`]) and the clip
/// (of `clips`, infinity for none) that give most right signs on held-out points are taken, then all points
/// fitted.
///
/// # Errors
/// Nothing finite comes out.
pub fn ridge(
    kernel: Kernel,
    features: usize,
    centres: &[f64],
    points: Points<'_>,
    clips: &[f64],
) -> Result<Fitted, PruneError> {
    let system = System::new(kernel, features, centres, points);
    let mut best: Option<(Score, f64, f64)> = None;
    let (fit, check) = (&system.fit, &system.check);
    let g = gram(&fit.columns, fit.m, None);
    let right: Vec<Vec<f64>> =
        clips.iter().map(|&clip| times(&fit.columns, fit.m, &clipped(&fit.targets, clip))).collect();
    for ridge in RIDGES {
        let Some(l) = factor(&g, fit.m, fit.m - 1, ridge) else { continue };
        for (b, &clip) in right.iter().zip(clips) {
            let x = solve(&l, fit.m, b);
            let score = check.score(&x, clip);
            if x.iter().all(|v| v.is_finite()) && best.is_none_or(|(s, ..)| score > s) {
                best = Some((score, ridge, clip));
            }
        }
    }
    let (_, ridge, clip) = best.ok_or(PruneError::Fit)?;
    let mut g = g;
    let mut b = times(&fit.columns, fit.m, &clipped(&fit.targets, clip));
    if check.points() > 0 && !system.shared {
        let held_out = gram(&check.columns, check.m, None);
        g.iter_mut().zip(&held_out).for_each(|(a, b)| *a += b);
        let more = times(&check.columns, check.m, &clipped(&check.targets, clip));
        b.iter_mut().zip(&more).for_each(|(a, b)| *a += b);
    }
    solve_ridge(&g, fit.m, fit.m - 1, &b, ridge).map(fitted).ok_or(PruneError::Fit)
}

/// Logistic regression on the signs of the targets, by iteratively reweighted least squares. The ridge that
/// gives most right signs on held-out points is taken.
///
/// # Errors
/// Nothing finite comes out.
pub fn logistic(
    kernel: Kernel,
    features: usize,
    centres: &[f64],
    points: Points<'_>,
) -> Result<Fitted, PruneError> {
    let system = System::new(kernel, features, centres, points);
    let mut best: Option<(Score, Vec<f64>)> = None;
    for ridge in [1e-6, 1e-4, 1e-2] {
        let Some(x) = system.fit.newton(ridge) else { continue };
        let score = system.check.score(&x, f64::INFINITY);
        if best.as_ref().is_none_or(|(s, _)| score > *s) {
            best = Some((score, x));
        }
    }
    best.map(|(_, x)| fitted(x)).ok_or(PruneError::Fit)
}

fn clipped(targets: &[f64], clip: f64) -> Vec<f64> {
    targets.iter().map(|t| t.clamp(-clip, clip)).collect()
}

/// The last unknown is the threshold's.
fn fitted(mut x: Vec<f64>) -> Fitted {
    let rho = -x.pop().unwrap_or(0.0);
    Fitted { coefficients: x, rho }
}

/// Design matrices of the points that are fitted and of those held out.
struct System {
    fit: Part,
    check: Part,
    /// Too few points to hold any out: both parts are the same.
    shared: bool,
}

/// A design matrix: `m` rows (kernel values with each centre, then ones) of one column a point.
struct Part {
    columns: Vec<f64>,
    m: usize,
    targets: Vec<f64>,
}

impl System {
    fn new(kernel: Kernel, features: usize, centres: &[f64], points: Points<'_>) -> Self {
        let n = points.targets.len();
        let shared = n < 50;
        let part = |held_out: bool| {
            let chosen: Vec<usize> =
                (0..n).filter(|i| shared || (i % HELD_OUT == HELD_OUT - 1) == held_out).collect();
            let rows: Vec<f64> = chosen
                .iter()
                .flat_map(|&i| points.rows[i * features..(i + 1) * features].iter().copied())
                .collect();
            let centres = Rows::new(centres, features);
            let mut columns = kernel_matrix(kernel, centres, Rows::new(&rows, features));
            columns.resize(columns.len() + chosen.len(), 1.0);
            Part {
                columns,
                m: centres.len() + 1,
                targets: chosen.iter().map(|&i| points.targets[i]).collect(),
            }
        };
        Self { fit: part(false), check: part(true), shared }
    }
}

impl Part {
    fn points(&self) -> usize {
        self.targets.len()
    }

    fn score(&self, x: &[f64], clip: f64) -> Score {
        let values = transposed_times(&self.columns, x);
        let right = values.iter().zip(&self.targets).filter(|(v, t)| (**v > 0.0) == (**t > 0.0)).count();
        let error: f64 =
            values.iter().zip(&self.targets).map(|(v, t)| (v - t.clamp(-clip, clip)).powi(2)).sum();
        Score(right as f64, -error)
    }

    /// Newton's method on the logistic loss: each step solves `(R W R^T + ridge) dx = R (y - p) - ridge x`.
    fn newton(&self, ridge: f64) -> Option<Vec<f64>> {
        let (m, n) = (self.m, self.points());
        let lambda = ridge * n as f64;
        let mut x = vec![0.0; m];
        for _ in 0..12 {
            let p: Vec<f64> = transposed_times(&self.columns, &x)
                .into_par_iter()
                .map(|v| 1.0 / (1.0 + (-v).exp()))
                .collect();
            let weights: Vec<f64> = p.iter().map(|p| (p * (1.0 - p)).max(1e-9)).collect();
            let rest: Vec<f64> =
                p.iter().zip(&self.targets).map(|(p, t)| f64::from(u8::from(*t > 0.0)) - p).collect();
            let mut b = times(&self.columns, m, &rest);
            b[..m - 1].iter_mut().zip(&x).for_each(|(b, x)| *b -= lambda * x);
            let mut g = gram(&self.columns, m, Some(&weights));
            (0..m - 1).for_each(|i| g[i * m + i] += lambda);
            let step = solve_ridge(&g, m, m, &b, 1e-14)?;
            x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
            if dense::dot(&step, &step) <= 1e-12 * dense::dot(&x, &x) {
                break;
            }
        }
        x.iter().all(|v| v.is_finite()).then_some(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prune::select::{GreedyRule, gather, order};
    use crate::prune::testing::machine;
    use crate::prune::{Random, with_vectors};

    fn agreement(model: &Model, centres: &[f64], f: &Fitted) -> f64 {
        let reduced = with_vectors(model, centres, &f.coefficients, f.rho);
        let mut rng = Random::stream(1, 2);
        let same = (0..1000).filter(|_| {
            let x: Vec<f64> = (0..model.features).map(|_| rng.uniform()).collect();
            (model.decision_value(&x) > 0.0) == (reduced.decision_value(&x) > 0.0)
        });
        same.count() as f64 / 1000.0
    }

    #[test]
    fn a_projection_on_all_vectors_is_the_machine() {
        let model = machine(50, 2, 20.0, 4.0, 8);
        let fitted = project(&model, &model.support_vectors, 1e-15).unwrap();
        let reduced = with_vectors(&model, &model.support_vectors, &fitted.coefficients, fitted.rho);
        for i in 0..50 {
            let x = model.support_vector(i);
            assert!((model.decision_value(x) - reduced.decision_value(x)).abs() < 1e-6);
        }
    }

    #[test]
    fn fits_agree_with_the_machine() {
        let model = machine(400, 3, 3.0, 10.0, 9);
        let centres = gather(&model, &order(&model, GreedyRule::Residual, 40).indices);
        assert!(agreement(&model, &centres, &project(&model, &centres, 1e-12).unwrap()) > 0.97);
        let mut rng = Random::stream(5, 5);
        let rows: Vec<f64> = (0..3 * 3000).map(|_| rng.uniform()).collect();
        let targets: Vec<f64> = rows.chunks(3).map(|x| model.decision_value(x)).collect();
        let points = Points { rows: &rows, targets: &targets };
        let fit = ridge(model.kernel, 3, &centres, points, &[1.0, 1.5, f64::INFINITY]).unwrap();
        assert!(agreement(&model, &centres, &fit) > 0.97);
        let fit = logistic(model.kernel, 3, &centres, points).unwrap();
        assert!(agreement(&model, &centres, &fit) > 0.96);
    }

    #[test]
    fn nothing_to_fit_is_an_error() {
        let points = Points { rows: &[1e200, -1e200], targets: &[1.0, -1.0] };
        let kernel = Kernel::Polynomial { degree: 3, gamma: 1.0, coef0: 0.0 };
        assert_eq!(ridge(kernel, 1, &[1e200], points, &[1.0]).unwrap_err(), PruneError::Fit);
    }
}
